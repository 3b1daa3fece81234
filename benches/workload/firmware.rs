//! A ZLAC8030L and its CANopen node alone, set up and operational, and the frames whose cost is measured: what the
//! benchmark times and what the instruction count counts.

use std::hint::black_box;

use can::{Frame, Instant, Station};
use canopen::NodeId;
use canopen::node::Node;
use drives::Firmware;
use drives::zlac8030l::objects::TableStorage;
use drives::zlac8030l::{Hardware, NODE_PROFILE, Zlac8030l};

/// All happens at once: no deadline is reached while the same frame comes again and again.
pub(crate) const NOW: Instant = Instant::from_millis(10);

/// Heartbeat 1 s; RPDO0 6040h, 6060h, 60FFh; RPDO1 60FFh; TPDO0 6041h, 6061h, 606Ch at each SYNC; TPDO1 2029h on
/// change with 500 ms inhibit time and event timer. Then operational.
const SET_UP: &str = "
    604#2B171000E8030000
    604#2F00160000000000 604#2300160110004060 604#2300160208006060 604#230016032000FF60 604#2F00160003000000
    604#2F01160000000000 604#230116012000FF60 604#2F01160001000000
    604#2F001A0000000000 604#23001A0110004160 604#23001A0208006160 604#23001A0320006C60 604#2F001A0003000000
    604#2F00180201000000
    604#2F011A0000000000 604#23011A0110002920 604#2F011A0001000000 604#2B011803E8030000 604#2B011805E8030000
    000#0104";

/// Names and frames; the last is for node 5.
pub(crate) const FRAMES: [(&str, &str); 6] = [
    ("sdo expedited upload", "604#4064600000000000"),
    ("sdo expedited download", "604#23FF600064000000"),
    ("rpdo, 3 objects", "204#0F000364000000"),
    ("rpdo, 1 object", "304#64000000"),
    ("tpdo on SYNC, 3 objects", "080#"),
    ("a frame not for this node", "185#1122334455667788"),
];

pub(crate) fn frame(text: &str) -> Frame {
    text.parse().expect("candump form")
}

pub(crate) fn drain(station: &mut impl Station) -> u64 {
    let mut sum = 0;
    while let Some(frame) = station.poll_transmit() {
        sum += u64::from_le_bytes(*frame.padded());
        station.handle_transmitted(&frame, NOW);
    }
    sum
}

fn set_up(station: &mut impl Station) {
    drain(station);
    for text in SET_UP.split_whitespace() {
        station.handle_frame(&frame(text), NOW);
        while let Some(answer) = station.poll_transmit() {
            assert_ne!(answer.data().first(), Some(&0x80), "{text} is refused: {answer}");
            station.handle_transmitted(&answer, NOW);
        }
    }
}

/// The drive's communication without the drive.
pub(crate) fn node() -> Node<TableStorage> {
    let mut node = Node::new(&NODE_PROFILE, NodeId::new(4).expect("4 is a node-ID"));
    node.boot(Instant::ZERO);
    set_up(&mut node);
    while node.poll_event().is_some() {}
    node
}

/// The whole drive.
pub(crate) fn firmware() -> Zlac8030l {
    let mut drive = Zlac8030l::new();
    drive.power_on(&Hardware::default(), Instant::ZERO);
    set_up(&mut drive);
    drive
}

/// A frame to the node and all its consequences.
pub(crate) fn exchange_with_node(node: &mut Node<TableStorage>, frame: &Frame) -> u64 {
    node.handle_frame(black_box(frame), NOW);
    let sum = drain(node);
    while let Some(event) = node.poll_event() {
        black_box(event);
    }
    sum
}

/// A frame to the drive and all its consequences.
pub(crate) fn exchange_with_firmware(drive: &mut Zlac8030l, frame: &Frame) -> u64 {
    drive.handle_frame(black_box(frame), NOW);
    drain(drive)
}

/// A call when nothing is due.
pub(crate) fn idle(node: &mut Node<TableStorage>) -> (bool, bool, Option<Instant>) {
    node.handle_timeout(black_box(NOW));
    (node.poll_transmit().is_some(), node.poll_event().is_some(), node.poll_timeout())
}
