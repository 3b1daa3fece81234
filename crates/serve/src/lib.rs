//! Virtual drives for other programs: a world whose bus is served, whose time follows a clock or is moved by hand, which is
//! commanded by lines and over sockets, and whose stores, logs and records reach the disk without holding the bus up.
//!
//! [`world::ServedWorld`] is the world behind a [`transport::Hub`]; [`pacer`] says how fast its time passes; [`service`] answers what is
//! asked of it between two steps, and [`control`] has the sockets of the control connection. [`live::LiveBus`] is the other side:
//! the bus on which a program has its master, which may be a world of this very program.
//!
//! What the clock shows is an argument: without a hub and its sockets a served world is moved by a test as well.
//!
//! ```
//! use can::{Bitrate, Instant};
//! use serve::messages::Messages;
//! use serve::pacer::{Clock, Pacer, Speed};
//! use serve::world::ServedWorld;
//! use sim::World;
//! use sim::machine::zlac8030l;
//! use transport::RealTimeWorld;
//!
//! let mut world = World::new(Bitrate::K500, 1);
//! world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
//! let pacer = Pacer::new(Clock::Real, Speed::Times(10.0));
//! let mut served = ServedWorld::new(world, pacer, false, Messages::of_warnings());
//! let target = served.target(Instant::from_millis(50));
//! served.advance_to(target);
//! assert_eq!(served.now(), Instant::from_millis(500));
//! ```

pub mod control;
pub mod eeprom;
pub mod files;
mod input;
mod kept;
mod lag;
pub mod live;
pub mod messages;
pub mod pacer;
mod registers;
mod round_robin;
pub mod service;
pub mod store_writer;
mod stores;
pub mod world;
mod world_bus;
pub mod writing;
