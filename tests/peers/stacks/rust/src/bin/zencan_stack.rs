//! A node of zencan for the conformance test. Nothing is added to what the library does by itself.

use std::io;

use stacks::Hub;
use zencan_node::common::NodeId;
use zencan_node::common::messages::{CanId, CanMessage};
use zencan_node::{Callbacks, Node};

mod zencan {
    zencan_node::include_modules!(ZENCAN_CONFIG);
}

fn main() -> io::Result<()> {
    let (mut hub, arguments) = Hub::open()?;
    let id = NodeId::new(arguments.node).expect("a node-ID of 1 to 127");
    zencan::OBJECT1018.set_serial(1);
    let mut node = Node::new(id, Callbacks::new(), &zencan::NODE_MBOX, &zencan::NODE_STATE, &zencan::OD_TABLE);
    println!("running");
    loop {
        if let Some(frame) = hub.receive()? {
            let id = CanId::Std(frame.id);
            let message = if frame.remote { CanMessage::new_rtr(id) } else { CanMessage::new(id, &frame.data) };
            // What the stack does not want it gives back.
            let _ = zencan::NODE_MBOX.store_message(message);
        }
        node.process(hub.micros());
        while let Some(message) = zencan::NODE_MBOX.next_transmit_message() {
            if let CanId::Std(id) = message.id {
                hub.send(id, message.data())?;
            }
        }
    }
}
