//! A file for each model, which drives are ordered as, and the list of them.

mod boxed;
mod following;
mod kept;
mod mjoint;
mod node;
mod order;
mod pulse_source;
mod registry;
mod servo;
mod zlac8030l;
mod zlim42c;

pub use boxed::Boxed;
pub use drives::servo::SpeedWorth;
pub use mjoint::{Joint, MJointMachine, mjoint};
pub use node::NodeMachine;
pub use order::{Order, OrderError};
pub use registry::{is_built_in, models, order};
pub use servo::{ServoBench, ServoMachine, servo, without_effect};
pub use zlac8030l::{HubWheel, Zlac8030lMachine, zlac8030l};
pub use zlim42c::{Stepper, Zlim42c82Machine, Zlim42cMachine, zlim42c, zlim42c_82};
