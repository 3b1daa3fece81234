//! PDO configuration as a transaction, against toy nodes.

mod support;

use std::time::Duration;

use canopen::AbortCode;
use master::core::{MappedObject, PdoMap};
use master::decode::Direction;
use master::pdo::{PdoConfig, PdoError, TimerUnits, TransmissionType};
use support::toy::Toy;
use support::{Bus, mux, node};

/// The ZLAC8030L's PDO timers count 0.5 ms (quick start guide V1.00, 6.1).
const HALF_MS: TimerUnits = TimerUnits { inhibit: Duration::from_micros(500), event: Duration::from_micros(500) };

/// The PDO part of a drive as it leaves the factory.
fn drive() -> Toy {
    let mut toy = Toy::new(4).u32(0x1800, 1, 0x184).u8(0x1800, 2, 0xFF).u16(0x1800, 3, 0).u16(0x1800, 5, 0);
    toy = toy.u8(0x1A00, 0, 0).u32(0x1400, 1, 0x204).u8(0x1400, 2, 0xFF);
    toy = toy.u8(0x1600, 0, 1).u32(0x1600, 1, 0x6040_0010).u32(0x1600, 2, 0);
    for sub_index in 1..=4 {
        toy = toy.u32(0x1A00, sub_index, 0);
    }
    toy
}

fn position_and_speed() -> PdoMap {
    PdoMap(vec![MappedObject::from_record(0x6064_0020), MappedObject::from_record(0x606C_0020)])
}

#[test]
fn a_tpdo_is_set_up_in_the_legal_order_and_then_received() {
    let mut bus = Bus::new(vec![drive()]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let config = PdoConfig::new(Direction::Tpdo, 0, position_and_speed())
        .transmission(TransmissionType::EVENT_MANUFACTURER)
        .inhibit_time(Duration::from_millis(500));
    bus.block_on(node.configure_pdo(&config, HALF_MS)).unwrap();
    let writes: Vec<String> = bus.frames().into_iter().filter(|frame| frame.starts_with("604#2")).collect();
    assert_eq!(
        writes,
        [
            "604#2300180184010080",
            "604#2F001A0000000000",
            "604#23001A0120006460",
            "604#23001A0220006C60",
            "604#2F001A0002000000",
            "604#2F001802FE000000",
            "604#2B001803E8030000",
            "604#2300180184010000",
        ]
    );
    bus.toys[0].send(0x180, &[1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]);
    bus.settle();
    let received = network.received(node.id(), mux(0x606C, 0)).unwrap();
    assert_eq!(received.raw, 0xFFFF_FFFF);
    assert_eq!(received.at, bus.now);
}

#[test]
fn a_value_that_does_not_read_back_is_told_and_the_pdo_put_back() {
    let mut toy = drive();
    toy.ignores.push((0x1800, 3));
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let config = PdoConfig::new(Direction::Tpdo, 0, position_and_speed()).inhibit_time(Duration::from_millis(500));
    let error = bus.block_on(network.node(node(4)).configure_pdo(&config, HALF_MS)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "TPDO0 of node 4: 1800h:03 was written 3E8h (set the inhibit time) and reads back 0h: the device does not \
         take this setting. Read its manual on 1800h:03, or choose what it supports. The PDO was put back as it was"
    );
    let objects = &bus.toys[0].objects;
    assert_eq!((&objects[&(0x1A00, 0)], &objects[&(0x1800, 1)]), (&vec![0], &vec![0x84, 1, 0, 0]));
}

#[test]
fn a_refused_object_is_told_with_the_abort_and_the_old_mapping_comes_back() {
    let mut toy = drive();
    toy.aborts.insert((0x1600, 2), AbortCode::NOT_MAPPABLE.0);
    // Reading it is refused too, but only mapped entries are read.
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let config = PdoConfig::new(Direction::Rpdo, 0, position_and_speed());
    let error = bus.block_on(network.node(node(4)).configure_pdo(&config, HALF_MS)).unwrap_err();
    assert!(matches!(error, PdoError::Step { step: "map an object", restored: true, .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("refused to write 1600h:02: 0604 0041h"), "{text}");
    assert_eq!(bus.toys[0].objects[&(0x1600, 1)], 0x6040_0010_u32.to_le_bytes());
    assert_eq!(bus.toys[0].objects[&(0x1600, 0)], [1]);
    assert_eq!(bus.toys[0].objects[&(0x1400, 1)], 0x204_u32.to_le_bytes());
}

#[test]
fn what_cannot_fit_is_refused_before_anything_is_sent() {
    let mut bus = Bus::new(vec![drive()]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let mut map = position_and_speed();
    map.0.push(MappedObject::from_record(0x6041_0010));
    let long = PdoConfig::new(Direction::Tpdo, 0, map);
    assert!(matches!(
        bus.block_on(node.configure_pdo(&long, HALF_MS)),
        Err(PdoError::TooLong { bits: 80, objects: 3, .. })
    ));
    let slow = PdoConfig::new(Direction::Tpdo, 0, position_and_speed()).event_time(Duration::from_secs(60));
    let error = bus.block_on(node.configure_pdo(&slow, HALF_MS)).unwrap_err();
    assert!(error.to_string().ends_with("Choose a time up to 32767 ms"), "{error}");
    assert!(bus.log.is_empty());
}

#[test]
fn an_rpdo_goes_out_when_a_value_in_it_is_written() {
    let mut bus = Bus::new(vec![drive()]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let config = bus.block_on(node.adopt_pdo(Direction::Rpdo, 0, HALF_MS)).unwrap();
    assert_eq!(config.map, PdoMap(vec![MappedObject::from_record(0x6040_0010)]));
    assert!(node.send_by_pdo(mux(0x6040, 0), 0x000F));
    assert!(!node.send_by_pdo(mux(0x60FF, 0), 1));
    bus.settle();
    assert_eq!(bus.frames().last().unwrap(), "204#0F00");
}
