//! `--foxglove`: what happens, live for Foxglove, Lichtblick and PlotJuggler.

use std::io::ErrorKind;

use foxglove::{Options, Server};
use recording::Channels;

use crate::failure::Failure;

/// Where viewers connect, and which.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct ViewerOptions {
    /// Stream the run to viewers such as Foxglove; listen at this address
    ///
    /// Signals, frames and events for Foxglove, Lichtblick and PlotJuggler, e.g. at 127.0.0.1:8765; a port alone is one
    /// of this machine, 0 a free one.
    ///
    /// The channels are those of an MCAP record, over the Foxglove WebSocket protocol. Viewers only look; one that reads
    /// slowly loses points, and the bus never waits for it. There is no password: any program that reaches the address
    /// sees what is shown.
    #[arg(long, value_name = "[HOST:]PORT", value_parser = place)]
    foxglove: Option<String>,
    /// Let a page of this origin look too, e.g. https://lichtblick.example; pages of this machine and of Foxglove may
    #[arg(long, value_name = "URL", requires = "foxglove", hide_short_help = true)]
    foxglove_origin: Vec<String>,
}

/// A port alone is one of this machine.
fn place(text: &str) -> Result<String, String> {
    match text.rsplit_once(':') {
        None if text.parse::<u16>().is_ok() => Ok(format!("127.0.0.1:{text}")),
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(text.to_owned()),
        _ => Err("expected HOST:PORT such as 127.0.0.1:8765, or a port of this machine".into()),
    }
}

impl ViewerOptions {
    /// A server is asked for.
    pub(crate) fn is_asked_for(&self) -> bool {
        self.foxglove.is_some()
    }

    /// Starts the server, if one is asked for, and says through `note` where it is.
    pub(crate) fn start(&self, channels: Channels, note: impl Fn(&str)) -> Result<Option<Server>, Failure> {
        let Some(address) = &self.foxglove else { return Ok(None) };
        let options = Options { origins: self.foxglove_origin.clone() };
        let server = Server::start(address, options, channels).map_err(|error| {
            let failure = Failure::new(format!("cannot serve viewers at {address}")).because(&error);
            match error.kind() {
                ErrorKind::AddrInUse => {
                    failure.next("end the program that has this port, or give --foxglove 127.0.0.1:0 for a free one")
                }
                _ => failure.next("give an address of this machine, e.g. --foxglove 127.0.0.1:8765"),
            }
        })?;
        let at = server.address();
        note(&format!("viewers connect to ws://{at}"));
        if !at.ip().is_loopback() {
            note(&format!("there is no password: anyone who can reach {at} sees the signals and frames"));
        }
        Ok(Some(server))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(address: &str) -> ViewerOptions {
        ViewerOptions { foxglove: Some(address.to_owned()), foxglove_origin: Vec::new() }
    }

    #[test]
    fn a_port_that_is_taken_and_a_bad_address_say_what_to_do() {
        let start = |address: &str| at(address).start(Channels::of(&[]), |_| {});
        let first = start("127.0.0.1:0").expect("a free port").expect("asked for");
        let taken = start(&first.address().to_string()).err().expect("it is taken");
        assert!(taken.next[0].contains("127.0.0.1:0"), "{taken:?}");
        // An address for documentation (RFC 5737) is not this machine's.
        let elsewhere = start("192.0.2.1:0").err().expect("another machine's");
        assert!(elsewhere.next[0].contains("127.0.0.1:8765"), "{elsewhere:?}");
        assert_eq!(place("8765").as_deref(), Ok("127.0.0.1:8765"));
        for bad in ["", "localhost", ":1", "127.0.0.1:99999", "99999"] {
            assert!(place(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn an_address_that_others_reach_is_warned_of() {
        let notes = |address: &str| {
            let notes = std::cell::RefCell::new(Vec::new());
            at(address).start(Channels::of(&[]), |note| notes.borrow_mut().push(note.to_owned())).expect("started");
            notes.into_inner().iter().filter(|note| note.contains("no password")).count()
        };
        assert_eq!((notes("127.0.0.1:0"), notes("0.0.0.0:0")), (0, 1));
    }
}
