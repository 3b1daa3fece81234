use std::time::Duration;

use ferrodrive::can::Bitrate;
use ferrodrive::canopen::od::{Entry, Index, Table};
use ferrodrive::canopen::{Mux, NodeId};
use ferrodrive::devices::name;
use ferrodrive::devices::row::{U16, U32, merge, ro, rw};
use ferrodrive::devices::servo::{CIA402, objects};
use ferrodrive::devices::{Description, Identity};
use ferrodrive::master::units::Degrees;
use ferrodrive::master::{Drive, MotionOptions, Network};
use ferrodrive::sim::machine::{Order, order};
use ferrodrive::sim::{World, block_on};

/// What the maker has beyond the standard's rows, or otherwise, as its manual prints it.
#[rustfmt::skip]
static OWN: [Entry; 4] = [
    ro(0x1018, 1, U32, name!("Vendor-ID")).default(0x0ACE_0000),
    ro(0x1018, 2, U32, name!("Product code")).default(1),
    rw(0x2000, 0, U16, name!("Brake delay")).range(0, 500).default(40).unit("ms").saved(),
    ro(0x2001, 0, U16, name!("Operating hours")).unit("h").mappable(),
];

/// Two of them are new; the other two replace rows.
const ROW_COUNT: usize = objects::ROW_COUNT + 2;
static ROWS: [Entry; ROW_COUNT] = merge(&[objects::TABLE.rows(), &OWN]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);

/// A servo that keeps to the standard, of a maker with the (invented) vendor-ID 0ACE0000h.
static ACME_S1: Description = Description {
    name: "acme-s1",
    title: "Acme S1 servo",
    manual: "Acme S1 manual 1.0",
    identity: Identity { vendor_id: 0x0ACE_0000, product_code: 1, ..CIA402.identity },
    dictionary: &TABLE,
    ..CIA402
};

#[test]
fn a_described_servo_turns_and_has_its_makers_objects() {
    let node = NodeId::new(5).unwrap();
    let mut world = World::new(Bitrate::M1, 1);
    world.add_drive(5, order(&ACME_S1, &Order::new(&ACME_S1, node, Bitrate::M1)).unwrap()).unwrap();
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(Duration::from_secs(1));

    let drive = Drive::new(network.node(node), &ACME_S1);
    block_on(&mut world, drive.move_relative(Degrees(360.0), MotionOptions::default())).unwrap().unwrap();
    let vendor = block_on(&mut world, drive.node().read::<u32>(Mux::new(0x1018, 1))).unwrap().unwrap();
    let delay = block_on(&mut world, drive.node().read::<u16>(Mux::new(0x2000, 0))).unwrap().unwrap();
    assert_eq!((vendor, delay), (0x0ACE_0000, 40));
    assert!(block_on(&mut world, drive.node().write(Mux::new(0x2000, 0), 501_u16)).unwrap().is_err());
}
