//! Virtual drives, their host and the studio's messages in one module without a server: what a page, a worker or node runs as
//! WebAssembly.
//!
//! [`HostedWorld`] is a machine with a host and one page, which the owner of a clock moves; [`SerialHost`] is the same host on the bus
//! behind a serial adapter, whose owner has its port too; [`Library`] carries out calls that are bytes in and bytes out; `abi` has its three functions for JavaScript. Nothing here reads a clock, a file or a socket, so that the
//! same calls give the same frames in every engine, and natively.
//!
//! ```
//! let mut library = web::Library::default();
//! let machine = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";
//! let opened = library.call(format!("{{\"call\":\"open\"}}\n{machine}").as_bytes());
//! let line = opened.split(|byte| *byte == b'\n').next().unwrap_or_default();
//! let answer: serde_json::Value = serde_json::from_slice(line)?;
//! assert_eq!(answer["ok"], true);
//! # Ok::<(), serde_json::Error>(())
//! ```

mod abi;
mod call;
mod hosted;
mod hosted_world;
mod requests;
mod serial_host;

pub use call::Library;
pub use hosted_world::{Failed, HostedWorld, Stored};
pub use requests::{Request, Response};
pub use serial_host::{LetGo, Line, SerialHost};
