//! States that no virtual drive here comes into: a node of a few lines answers as the tables of CiA 402-2 have it, and the
//! explanation names what is so. Each case has its neighbour in which the rule has nothing to say.

use crate::support::toy::Toy;
use crate::support::{Bus, node};
use can::{CanId, Frame, Station};
use canopen::Mux;
use devices::servo::CIA402;
use master::Drive;
use master::explain::{Explained, Overheard, Weight};

/// A servo that answers with this statusword, controlword and mode, and an error-free rest.
fn servo(statusword: u16, controlword: u16, mode: u8) -> Toy {
    Toy::new(4)
        .u32(0x1000, 0, 0x0002_0192)
        .u16(0x1017, 0, 0)
        .u16(0x603F, 0, 0)
        .u16(0x6040, 0, controlword)
        .u16(0x6041, 0, statusword)
        .u8(0x6060, 0, mode)
        .u8(0x6061, 0, mode)
        .u32(0x6064, 0, 0)
        .u32(0x606C, 0, 0)
        .u32(0x607A, 0, 0)
        .u32(0x60FF, 0, 0)
}

fn explained_on(bus: &mut Bus) -> Explained {
    let drive = Drive::new(bus.network.node(node(4)), &CIA402);
    let heard = Overheard::from(bus.now);
    bus.block_on(drive.explain(&heard))
}

fn explained(statusword: u16, controlword: u16, mode: u8) -> Explained {
    explained_on(&mut Bus::new(vec![servo(statusword, controlword, mode)]))
}

fn has(explained: &Explained, rule: &str) -> bool {
    explained.findings.iter().any(|finding| finding.rule == rule && !finding.remedy.is_empty())
}

/// CiA 402-2, 8.4.2: the states by bits 0 to 3, 5 and 6; bit 4 is voltage enabled, bit 9 remote.
const NOT_READY: u16 = 0x0200;
const READY: u16 = 0x0231;
const SWITCHED_ON: u16 = 0x0233;
const ENABLED: u16 = 0x0237;
const VOLTAGE_ENABLED: u16 = 0x0010;
const REMOTE: u16 = 0x0200;
const FOLLOWING_ERROR: u16 = 0x2000;
const POSITION: u8 = 1;
const VELOCITY: u8 = 3;

#[test]
fn a_self_test_that_does_not_end_is_named() {
    assert!(has(&explained(NOT_READY, 0x06, VELOCITY), "not_ready"));
    assert!(!has(&explained(READY, 0x06, VELOCITY), "not_ready"));
}

#[test]
fn a_statusword_of_no_state_is_named() {
    // Bits 0 and 2 without bit 1: in no row of the table.
    assert!(has(&explained(0x0205, 0x06, VELOCITY), "no_power_state"));
    assert!(!has(&explained(ENABLED, 0x0F, VELOCITY), "no_power_state"));
}

/// Transition 3, "switch on", which the drive does not take.
#[test]
fn a_controlword_that_leads_on_and_is_not_followed_is_named_with_who_else_may_command() {
    let remote = explained(READY, 0x07, VELOCITY);
    assert!(has(&remote, "controlword_ignored"));
    let local = explained(READY & !REMOTE, 0x07, VELOCITY);
    let remedy = |explained: &Explained| {
        explained
            .findings
            .iter()
            .find(|finding| finding.rule == "controlword_ignored")
            .map(|found| found.remedy.clone())
    };
    assert!(remedy(&local).is_some_and(|remedy| remedy.contains("bit 9, remote, is 0")), "{local:#?}");
    assert!(remedy(&remote).is_some_and(|remedy| !remedy.contains("remote")), "{remote:#?}");
    // Shutdown leads to where it is: nothing is ignored.
    assert!(!has(&explained(READY, 0x06, VELOCITY), "controlword_ignored"));
}

#[test]
fn a_power_stage_without_supply_is_named() {
    assert!(has(&explained(SWITCHED_ON & !VOLTAGE_ENABLED, 0x07, VELOCITY), "no_voltage"));
    assert!(!has(&explained(SWITCHED_ON, 0x07, VELOCITY), "no_voltage"));
    // Before "switched on" the supply may be away (8.4.2).
    assert!(!has(&explained(READY & !VOLTAGE_ENABLED, 0x06, VELOCITY), "no_voltage"));
}

/// The standard leaves the reaction to a following error to the maker: such a drive stays enabled and reports it. The
/// virtual ones take it for a fault.
#[test]
fn a_following_error_is_named_in_the_modes_whose_bit_13_it_is() {
    assert!(has(&explained(ENABLED | FOLLOWING_ERROR, 0x0F, POSITION), "following_error"));
    assert!(!has(&explained(ENABLED, 0x0F, POSITION), "following_error"));
    assert!(!has(&explained(ENABLED | FOLLOWING_ERROR, 0x0F, VELOCITY), "following_error"));
}

/// The toy has no block transfer (CiA 301, 7.2.4.2.9, leaves it to the device) and refuses it with 0504 0001h.
#[test]
fn a_refused_block_transfer_is_named_once_a_long_value_was_transferred_until_the_node_boots() {
    let mut bus = Bus::new(vec![servo(ENABLED, 0x0F, VELOCITY).with(0x1F50, 1, &[])]);
    let program = Mux::new(0x1F50, 1);
    let node = bus.network.node(node(4));
    // 63 bytes go in segments by themselves.
    bus.block_on(node.download(program, &[0; 63])).unwrap();
    assert!(!has(&explained_on(&mut bus), "no_block_transfer"));
    bus.block_on(node.download(program, &[0; 64])).unwrap();
    let explained = explained_on(&mut bus);
    assert!(has(&explained, "no_block_transfer"), "{explained:#?}");
    let found = explained.findings.iter().find(|finding| finding.rule == "no_block_transfer").unwrap();
    assert_eq!(found.weight, Weight::Warning);
    bus.network.handle_frame(&"704#00".parse().unwrap(), bus.now);
    assert!(!has(&explained_on(&mut bus), "no_block_transfer"));
}

/// RPDO1 with 6040h, event-driven, under its predefined identifier (CiA 301, 7.5.2.35 and 7.5.2.36); others send it with 06h.
#[test]
fn frames_with_a_controlword_that_the_node_does_not_have_are_no_cause() {
    let explained_with = |controlword: u16, frame: &[u8]| {
        let toy = servo(READY, controlword, VELOCITY)
            .u8(0x1400, 0, 2)
            .u32(0x1400, 1, 0x204)
            .u8(0x1400, 2, 255)
            .u8(0x1600, 0, 1)
            .u32(0x1600, 1, 0x6040_0010);
        let mut bus = Bus::new(vec![toy]);
        let drive = Drive::new(bus.network.node(node(4)), &CIA402);
        let mut heard = Overheard::from(bus.now);
        heard.note(&Frame::new(CanId::standard(0x204), frame), bus.now);
        bus.block_on(drive.explain(&heard))
    };
    // It was pre-operational all along, and sends no heartbeat: 6040h is as it was switched on.
    let ignored = explained_with(0x00, &[0x06, 0]);
    assert!(!has(&ignored, "controlword_by_rpdo") && has(&ignored, "not_enabled"), "{ignored:#?}");
    let finding = ignored.findings.iter().find(|finding| finding.rule == "rpdo_not_taken").unwrap();
    assert!(finding.follows.contains("pre-operational") && finding.remedy == "ferrodrive nmt 4 start", "{finding:?}");
    // Nor does the right one do anything there.
    assert!(has(&explained_with(0x00, &[0x0F, 0]), "rpdo_not_taken"));
    let taken = explained_with(0x06, &[0x06, 0]);
    assert!(has(&taken, "controlword_by_rpdo") && !has(&taken, "rpdo_not_taken"), "{taken:#?}");
}
