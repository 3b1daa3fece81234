//! The world of a simulator that runs as another program, for a host that is asked about it: by its control connection.
//!
//! A thread of its own asks and waits. When the simulator has gone, it ends, and requests are answered that there is no world.

use host::WorldDoor;
use host::around::{Around, Changed, understand};
use serde_json::{Value, json};

use crate::control_client::{ControlArgs, ControlClient};
use crate::failure::Failure;

/// Connects, and gives where to ask.
pub(crate) fn open(control: &ControlArgs) -> Result<WorldDoor, Failure> {
    let mut far = FarWorld { client: control.connect()?, gone: false };
    let (door, mut asks) = host::world_door(None);
    std::thread::spawn(move || while !far.gone && asks.answer_next(&mut far) {});
    Ok(door)
}

struct FarWorld {
    client: ControlClient,
    gone: bool,
}

impl FarWorld {
    fn ask(&mut self, request: Value) -> Result<Value, (&'static str, String)> {
        self.client.ask(request).map_err(|failure| {
            // No answer, or none that can be read: everything else is a refusal.
            self.gone |= failure.kind == "control";
            (failure.kind, failure.to_string())
        })
    }
}

impl Around for FarWorld {
    fn look(&mut self) -> Value {
        let mut nodes = Vec::new();
        for node in self.client.nodes() {
            if let Ok(mut got) = self.ask(json!({ "request": "get", "node": node })) {
                got["place"] = node.to_string().into();
                nodes.push(got);
            }
        }
        let time_s = nodes.last().map_or(Value::Null, |got| got["t"].clone());
        // A control connection names no bodies; a line may name one that is known.
        json!({ "t": time_s, "nodes": nodes, "bodies": [] })
    }

    fn change(&mut self, line: &str) -> Result<Changed, (&'static str, String)> {
        let (_, changed) = understand(line)?;
        let answer = self.ask(json!({ "request": "world", "line": changed.line }))?;
        Ok(Changed { note: answer["note"].as_str().map(str::to_owned), ..changed })
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};

    use can::Bitrate;
    use host::control::{Class, Control, LineBuffer, Sink};
    use sim::World;
    use sim::command::Service;
    use sim::machine::zlac8030l;

    use super::*;

    struct Out(TcpStream);

    impl Sink for Out {
        fn put(&mut self, _: Class, line: String) {
            writeln!(self.0, "{line}").expect("the client reads");
        }

        fn admit(&mut self) {}
    }

    /// A simulator for one client, in whose world no time passes, until it has heard so many requests.
    fn simulator(mut requests: usize) -> ControlArgs {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = listener.local_addr().expect("bound").to_string();
        std::thread::spawn(move || {
            let mut world = World::new(Bitrate::K500, 1);
            world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the first");
            let (mut stream, _) = listener.accept().expect("a client");
            let mut control = Control::new(None);
            control.join(1, Out(stream.try_clone().expect("a second handle")));
            let (mut buffer, mut bytes) = (LineBuffer::default(), [0; 1024]);
            while requests > 0 {
                let count = stream.read(&mut bytes).expect("the client speaks");
                buffer.take(&bytes[..count], |line| {
                    requests -= 1;
                    control.handle(1, &line, &mut world, Service::default());
                });
            }
        });
        ControlArgs::of(place.parse().expect("an address"))
    }

    #[test]
    fn the_world_of_another_program_is_seen_and_changed_until_that_ends() {
        // hello, get, world, get.
        let mut far = FarWorld { client: simulator(4).connect().expect("it listens"), gone: false };
        let seen = far.look();
        assert_eq!((&seen["nodes"][0]["place"], &seen["nodes"][0]["node"]), (&json!("4"), &json!(4)), "{seen}");
        assert_eq!(far.change("4 hello").map_err(|(kind, _)| kind), Err("usage"), "found without asking");
        assert_eq!(far.change("4 get").map_err(|(kind, _)| kind), Err("usage"), "that changes nothing");
        let changed = far.change("4 cable cut").expect("it is done");
        assert_eq!((changed.node, changed.back.as_deref()), (Some(4), Some("4 cable join")));
        assert_eq!(far.look()["nodes"].as_array().map(Vec::len), Some(1));
        assert!(!far.gone);
        assert!(far.change("4 cable join").is_err_and(|(kind, _)| kind == "control") && far.gone, "it has ended");
    }
}
