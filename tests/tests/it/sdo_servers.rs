//! Further SDO servers of a described device (CiA 301, 7.5.2.33), from its file to two masters beside each other.

use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::{Mux, NodeId};
use devices::Description;
use ferrodrive_tests::sheet::{SheetRow, U8, U16, U32, sheet};
use master::{Error, Network};
use sim::machine::{Order, order};
use sim::{VirtualDrive, World, block_on};

const NODE: NodeId = NodeId::new(9).expect("a node-ID");

/// 1201h exists as delivered, 1202h does not; both have the node-ID of the client.
const SERVERS: [SheetRow; 10] = [
    (0x1000, 0, U32, "ro", 0, false),
    (0x1010, 1, U32, "rw", 1, false),
    (0x1201, 0, U8, "ro", 3, false),
    (0x1201, 1, U32, "rw", 0x680, false),
    (0x1201, 2, U32, "rw", 0x690, false),
    (0x1201, 3, U8, "rw", 1, false),
    (0x1202, 1, U32, "rw", 0x8000_0000, false),
    (0x1202, 2, U32, "rw", 0x8000_0000, false),
    (0x2000, 0, U16, "rw", 7, false),
    (0x2001, 0, U16, "rw", 0, false),
];

fn model() -> &'static Description {
    eds::keep(&eds::Eds::load(&sheet(&SERVERS)).expect("it is read").eds).expect("it is kept")
}

fn machine() -> Box<dyn VirtualDrive> {
    let mut machine = order(model(), &Order::new(model(), NODE, Bitrate::M1)).expect("it is built");
    power(&mut *machine);
    machine
}

fn power(machine: &mut dyn VirtualDrive) {
    machine.set_power(true, Instant::ZERO);
    machine.handle_timeout(Instant::from_secs(3));
    while machine.poll_transmit().is_some() {}
}

fn send(machine: &mut dyn VirtualDrive, frame: &str) -> Vec<String> {
    machine.handle_frame(&frame.parse().unwrap(), Instant::from_secs(3));
    std::iter::from_fn(|| machine.poll_transmit()).map(|frame| frame.to_string()).collect()
}

#[test]
fn a_server_that_the_file_delivers_is_served_from_boot_up_on() {
    let mut machine = machine();
    assert_eq!(send(&mut *machine, "680#4000200000000000"), ["690#4B00200007000000"]);
    assert_eq!(send(&mut *machine, "609#4000200000000000"), ["589#4B00200007000000"]);
    assert_eq!(send(&mut *machine, "680#A400200002000000"), ["690#C600200002000000"], "block transfer too");
}

/// Bit 30 of a COB-ID: given until the next start (CiA 301, 7.5.2.33).
#[test]
fn a_server_that_was_given_is_stored_unless_it_was_given_for_the_time() {
    for (flag, kept) in [(0, true), (1 << 30, false)] {
        let mut machine = machine();
        for (sub_index, id) in [(1, 0x6A0_u32), (2, 0x6B0)] {
            let [a, b, c, d] = (id | flag).to_le_bytes();
            let written = send(&mut *machine, &format!("609#230212{sub_index:02X}{a:02X}{b:02X}{c:02X}{d:02X}"));
            assert_eq!(written, [format!("589#600212{sub_index:02X}00000000")]);
        }
        assert_eq!(send(&mut *machine, "6A0#4000200000000000"), ["6B0#4B00200007000000"]);
        assert_eq!(send(&mut *machine, "609#2310100173617665"), ["589#6010100100000000"], "save");
        machine.set_power(false, Instant::from_secs(3));
        power(&mut *machine);
        assert_eq!(send(&mut *machine, "6A0#4000200000000000").len(), usize::from(kept), "{flag:X}");
        assert_eq!(send(&mut *machine, "680#4000200000000000").len(), 1, "what the file delivers");
    }
}

/// Each reads and writes its own object a hundred times in the same virtual moments. With one server for both, answers are taken for
/// those of the other.
#[test]
fn two_masters_with_a_server_each_do_not_disturb_each_other() {
    let mut world = World::new(Bitrate::M1, 1);
    let drive = order(model(), &Order::new(model(), NODE, Bitrate::M1)).expect("it is built");
    world.add_drive(NODE.raw(), drive).expect("the node-ID is free");
    let masters = [Network::new(), Network::new()];
    for network in &masters {
        world.add_station(network.clone());
    }
    let [first, second] = masters.map(|network| network.node(NODE).with_timeout(Duration::from_millis(100)));
    block_on(&mut world, async {
        first.network().sleep(Duration::from_secs(3)).await;
        let missing = second.use_sdo_server(0x1202).await;
        assert!(matches!(missing, Err(Error::NoSdoServer { record: 0x1202, .. })), "{missing:?}");
        let server = second.use_sdo_server(0x1201).await.expect("it exists");
        assert_eq!([server.request, server.reply].map(|id| id.raw()), [0x680, 0x690]);
        let work = |node: master::Node, index: u16| async move {
            for value in 0..100_u16 {
                node.write(Mux::new(index, 0), value).await.expect("it is written");
                assert_eq!(node.read::<u16>(Mux::new(index, 0)).await.expect("it is read"), value);
            }
        };
        master::join_all([work(first, 0x2000), work(second, 0x2001)]).await;
    })
    .expect("the world goes on");
}
