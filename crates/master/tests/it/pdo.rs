//! PDO configuration as a transaction, against toy nodes.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use canopen::AbortCode;
use canopen::pdo::{AddressMode, Direction, MappingRecord, PdoId, PdoNumber};
use master::core::PdoMap;
use master::pdo::{PdoConfig, PdoError, TimerUnits, TransmissionType};

const RPDO1: PdoId = PdoId { direction: Direction::Rpdo, number: PdoNumber::FIRST };
const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

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
    PdoMap(vec![MappingRecord::from_raw(0x6064_0020), MappingRecord::from_raw(0x606C_0020)])
}

#[test]
fn a_tpdo_is_set_up_in_the_legal_order_and_then_received() {
    let mut bus = Bus::new(vec![drive()]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let config = PdoConfig::new(TPDO1, position_and_speed())
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

/// CiA 301, 7.5.2.38: FEh and FFh in sub-index 00h count no entries. What was there is read, written over, and put back when that fails.
#[test]
fn a_multiplexed_pdo_is_read_and_another_mapping_takes_its_place_or_leaves_it() {
    let multiplexed = || drive().u8(0x1A00, 0, 0xFE);
    let mut bus = Bus::new(vec![multiplexed()]);
    let node = bus.network.node(node(4));
    let (read, _) = bus.block_on(node.pdo_config(TPDO1, HALF_MS)).unwrap();
    assert_eq!(read.when(), "multiplexed, by source address");
    assert!(!read.is_empty() && read.bytes() == 8);
    assert_eq!((read.multiplexed, read.map), (Some(AddressMode::Source), PdoMap::default()));
    let config = PdoConfig::new(TPDO1, position_and_speed());
    bus.block_on(node.configure_pdo(&config, HALF_MS)).unwrap();
    assert_eq!(bus.block_on(node.pdo_config(TPDO1, HALF_MS)).unwrap().0.map, position_and_speed());
    let back = PdoConfig { multiplexed: Some(AddressMode::Destination), ..PdoConfig::new(TPDO1, PdoMap::default()) };
    bus.block_on(node.configure_pdo(&back, HALF_MS)).unwrap();
    assert_eq!(bus.toys[0].objects[&(0x1A00, 0)], [0xFF]);

    let mut bus = Bus::new(vec![multiplexed()]);
    bus.toys[0].aborts.insert((0x1A00, 2), AbortCode::NOT_MAPPABLE.0);
    let node = bus.network.node(self::node(4));
    assert!(bus.block_on(node.configure_pdo(&config, HALF_MS)).is_err());
    assert_eq!(bus.toys[0].objects[&(0x1A00, 0)], [0xFE]);
}

#[test]
fn a_value_that_does_not_read_back_is_reported_and_the_pdo_put_back() {
    let mut toy = drive();
    toy.ignores.push((0x1800, 3));
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let config = PdoConfig::new(TPDO1, position_and_speed()).inhibit_time(Duration::from_millis(500));
    let error = bus.block_on(network.node(node(4)).configure_pdo(&config, HALF_MS)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "TPDO1 of node 4: 1800h:03 was written 3E8h (set the inhibit time) and reads back 0h: the device does not \
         take this setting. Read its manual on 1800h:03, or choose what it supports. The PDO was put back as it was"
    );
    let objects = &bus.toys[0].objects;
    assert_eq!((&objects[&(0x1A00, 0)], &objects[&(0x1800, 1)]), (&vec![0], &vec![0x84, 1, 0, 0]));
}

#[test]
fn a_refused_object_is_reported_with_the_abort_and_the_old_mapping_comes_back() {
    let mut toy = drive();
    toy.aborts.insert((0x1600, 2), AbortCode::NOT_MAPPABLE.0);
    // Reading it is refused too, but only mapped entries are read.
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let config = PdoConfig::new(RPDO1, position_and_speed());
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
    map.0.push(MappingRecord::from_raw(0x6041_0010));
    let long = PdoConfig::new(TPDO1, map);
    assert!(matches!(
        bus.block_on(node.configure_pdo(&long, HALF_MS)),
        Err(PdoError::TooLong { bits: 80, objects: 3, .. })
    ));
    let slow = PdoConfig::new(TPDO1, position_and_speed()).event_time(Duration::from_secs(60));
    let error = bus.block_on(node.configure_pdo(&slow, HALF_MS)).unwrap_err();
    assert!(error.to_string().ends_with("Choose a time up to 32767 ms"), "{error}");
    assert!(bus.log.is_empty());
}

#[test]
fn an_rpdo_goes_out_when_a_value_in_it_is_written() {
    let mut bus = Bus::new(vec![drive()]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let config = bus.block_on(node.adopt_pdo(RPDO1, HALF_MS)).unwrap();
    assert_eq!(config.map, PdoMap(vec![MappingRecord::from_raw(0x6040_0010)]));
    assert!(node.send_by_pdo(mux(0x6040, 0), 0x000F));
    assert!(!node.send_by_pdo(mux(0x60FF, 0), 1));
    bus.settle();
    assert_eq!(bus.frames().last().unwrap(), "204#0F00");
}

#[test]
fn a_tpdo_that_waits_for_remote_frames_is_asked_by_one() {
    let toy = drive().u8(0x1A00, 0, 1).u32(0x1A00, 1, 0x606C_0020).u32(0x1800, 1, 0x184);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let config = PdoConfig::new(TPDO1, PdoMap(vec![MappingRecord::from_raw(0x606C_0020)]))
        .transmission(TransmissionType::EVENT_RTR);
    bus.block_on(node.configure_pdo(&config, HALF_MS)).unwrap();
    assert_eq!(bus.toys[0].objects[&(0x1800, 2)], [253]);
    assert!(node.request_tpdo(PdoNumber::FIRST));
    assert!(!node.request_tpdo(PdoNumber::new(2).unwrap()));
    bus.settle();
    // A remote frame has the length of the frame that it asks for (CiA 301, 7.2.2.5.4).
    assert_eq!(bus.frames().last().unwrap(), "184#R4");
}

#[test]
fn a_pdo_of_64_bits_and_one_of_any_number_are_set_up() {
    let mut toy = Toy::new(4).u32(0x19FF, 1, 0x8000_0184).u8(0x19FF, 2, 0xFF).u8(0x1BFF, 0, 0);
    for sub_index in 1..=64 {
        toy = toy.u32(0x1BFF, sub_index, 0);
    }
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let last = PdoId { direction: Direction::Tpdo, number: PdoNumber::new(512).unwrap() };
    let bits = (1..=64).map(|sub_index| MappingRecord { mux: mux(0x2100, sub_index), bits: 1 }).collect();
    let config = PdoConfig { id: Some(0x184), ..PdoConfig::new(last, PdoMap(bits)) };
    bus.block_on(node.configure_pdo(&config, TimerUnits::STANDARD)).unwrap();
    assert_eq!(bus.toys[0].objects[&(0x1BFF, 64)], 0x2100_4001_u32.to_le_bytes());
    bus.toys[0].send(0x180, &[0, 0, 0, 0, 0, 0, 0, 0x80]);
    bus.settle();
    let bit = |number| node.signal::<bool>(mux(0x2100, number)).unwrap();
    let (first, last) = (bit(1), bit(64));
    assert_eq!(network.exchange(|io| (io.read(first), io.read(last))), (Some(false), Some(true)));
}
