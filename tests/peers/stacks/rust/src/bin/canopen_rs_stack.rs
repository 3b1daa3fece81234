//! A node of canopen-rs for the conformance test.
//!
//! The library has no clock and no bus: the program does what its documentation leaves to the application. It announces the
//! boot-up, also after a reset, with the objects as delivered; sends heartbeats with the period of 1017h, answers node guarding,
//! takes PDO parameters over that were written, and sends synchronous PDOs with SYNC.

use std::io;

use canopen_host::eds::Eds;
use canopen_rs::node::{Node, TxFrame};
use canopen_rs::{Address, LssAddress, NmtState, NodeId, Value};
use stacks::Hub;

const SYNC: u16 = 0x80;
const IDENTITY: LssAddress = LssAddress { vendor_id: 0, product_code: 1, revision_number: 1, serial_number: 1 };

/// A node with the objects as delivered.
fn delivered(id: NodeId, sheet: &Eds) -> Node<128> {
    let mut node = Node::new(id, sheet.object_dictionary().expect("at most 128 objects"));
    node.enable_lss(IDENTITY);
    node.configure_pdos_from_od();
    node
}

fn main() -> io::Result<()> {
    let (mut hub, arguments) = Hub::open()?;
    let id = NodeId::new(arguments.node).expect("a node-ID of 1 to 127");
    // The library resolves $NODEID by this section alone.
    let text = std::fs::read_to_string(&arguments.eds)?;
    let sheet = Eds::parse(&format!("{text}\n[DeviceComissioning]\nNodeID={}\n", arguments.node)).expect("an EDS");
    let mut node = delivered(id, &sheet);
    println!("running");
    send(&mut hub, node.boot())?;
    let mut heartbeat_due = 0;
    loop {
        if let Some(frame) = hub.receive()? {
            if frame.remote {
                if frame.id == 0x700 + u16::from(arguments.node) {
                    let answer = node.node_guard_response();
                    send(&mut hub, answer)?;
                }
                continue;
            }
            let was = node.state();
            if let Some(answer) = node.on_frame(frame.id, &frame.data) {
                send(&mut hub, answer)?;
            }
            if node.take_written_object().is_some_and(|object| (0x1400..0x1C00).contains(&object.index)) {
                node.configure_pdos_from_od();
            }
            if was != NmtState::Initialising && node.state() == NmtState::Initialising {
                node = delivered(id, &sheet);
                send(&mut hub, node.boot())?;
            }
            if frame.id == SYNC {
                for sent in node.sync_tpdos() {
                    send(&mut hub, sent)?;
                }
            }
        }
        let period = match node.od().read(Address::new(0x1017, 0)) {
            Ok(Value::Unsigned16(period)) => u64::from(period) * 1000,
            _ => 0,
        };
        let now = hub.micros();
        if period == 0 {
            heartbeat_due = now;
        } else if now >= heartbeat_due {
            heartbeat_due = now.max(heartbeat_due + period);
            let heartbeat = node.heartbeat();
            send(&mut hub, heartbeat)?;
        }
    }
}

fn send(hub: &mut Hub, frame: TxFrame) -> io::Result<()> {
    hub.send(frame.cob_id, frame.data())
}
