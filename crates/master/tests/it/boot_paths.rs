//! The paths of a boot-up that a manager's dictionary asks for (CiA 302-2: 1F26h, 1F27h, 1F55h, 1F80h, 1F8Ah), and servers that answer
//! late or twice, against hand-written nodes.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use canopen::NmtState;
use master::boot::{Assignment, BootPlan, ErrorStatus, Expectation, NodeReport, Startup};

const NODE: u8 = 7;
const SLAVE: u32 = Assignment::SLAVE | Assignment::BOOT | Assignment::MANDATORY;
const DEVICE_TYPE: u32 = 0x0001_0191;

/// An I/O device whose heartbeat this bus sends for it, as long as a test may take.
fn bus_of(toy: Toy) -> Bus {
    let mut bus = Bus::new(vec![toy]);
    let beats = (1..200).map(|count| (bus.now + Duration::from_millis(100 * count), "707#7F".parse().unwrap()));
    bus.noise = beats.collect();
    bus
}

fn device() -> Toy {
    Toy::new(NODE).u32(0x1000, 0, DEVICE_TYPE).u16(0x1017, 0, 100)
}

fn expecting(assignment: u32) -> Expectation {
    Expectation { assignment: Assignment(assignment), device_type: Some(DEVICE_TYPE), ..Expectation::default() }
}

fn boot(bus: &mut Bus, startup: u32, expectation: Expectation) -> NodeReport {
    let mut plan = BootPlan::new([(node(NODE), expectation)]);
    plan.startup = Startup(startup);
    let network = bus.network.clone();
    bus.block_on(network.boot(&plan)).nodes.remove(0)
}

fn letter(report: &NodeReport) -> Option<char> {
    report.status.map(ErrorStatus::letter)
}

fn written(bus: &Bus, index: u16) -> bool {
    // A download's command specifier is 1 (CiA 301, 7.2.4.3.3).
    bus.toys[0]
        .requests
        .iter()
        .any(|[command, low, high, ..]| command >> 5 == 1 && [*low, *high] == index.to_le_bytes())
}

/// CiA 302-2, error status: H where the update is not allowed, which it never is for a node that must be left as it is,
/// G where it is and there is no program to load.
#[test]
fn another_program_version_ends_with_g_or_h_and_the_right_one_goes_on() {
    const UPDATE: u32 = Assignment::VERIFY_SOFTWARE | Assignment::UPDATE_SOFTWARE;
    for (there, bits, expected) in [
        (0x1234, Assignment::VERIFY_SOFTWARE, None),
        (0x1235, Assignment::VERIFY_SOFTWARE, Some('H')),
        (0x1235, UPDATE, Some('G')),
        (0x1235, UPDATE | Assignment::KEEP_ALIVE, Some('H')),
        (0x1234, UPDATE | Assignment::KEEP_ALIVE, None),
        // No request is sent.
        (0x1235, 0, None),
    ] {
        let mut bus = bus_of(device().u32(0x1F56, 1, there));
        let report = boot(&mut bus, 0, Expectation { software: Some(0x1234), ..expecting(SLAVE | bits) });
        assert_eq!(letter(&report), expected, "{there:X}h, {bits:X}h: {report}");
        if expected.is_some() {
            assert!(report.to_string().contains("1F56h:01 expected 1234h, got 1235h"), "{report}");
        }
    }
}

/// CiA 302-2, error status: G where there is nothing to compare the program with, in the plan or in the node.
#[test]
fn a_program_that_cannot_be_compared_ends_with_g() {
    for (toy, software) in [(device().u32(0x1F56, 1, 0x1234), None), (device(), Some(0x1234))] {
        for bits in [0, Assignment::UPDATE_SOFTWARE, Assignment::KEEP_ALIVE] {
            let mut bus = bus_of(toy.clone());
            let expectation = expecting(SLAVE | Assignment::VERIFY_SOFTWARE | bits);
            let report = boot(&mut bus, 0, Expectation { software, ..expectation });
            assert_eq!(letter(&report), Some('G'), "{software:?} {bits:X}h: {report}");
        }
    }
}

/// CiA 302-2, 1F81h: without bit 2 the node is not booted by this master, which only watches its heartbeat.
#[test]
fn a_slave_that_another_device_boots_is_neither_reset_nor_written_nor_started() {
    for bits in [Assignment::SLAVE, Assignment::SLAVE | Assignment::MANDATORY | Assignment::VERIFY_SOFTWARE] {
        let mut bus = bus_of(device().u32(0x2000, 0, 1));
        let configuration = vec![(mux(0x2000, 0), 5_u32.to_le_bytes().to_vec())];
        let expectation = Expectation { configuration, device_type: Some(1), ..expecting(bits) };
        let report = boot(&mut bus, 0, expectation);
        assert_eq!(letter(&report), None, "{report}");
        assert!(bus.frames().iter().all(|frame| !frame.starts_with("000#")), "{:?}", bus.frames());
        assert!([0x2000, 0x1017].iter().all(|index| !written(&bus, *index)));
        assert!(bus.network.node(node(NODE)).facts().heartbeat_watch.is_some(), "its heartbeat is watched");
    }
}

/// CiA 302-2, 1F26h and 1F27h: what has the date and time of the configuration has the configuration.
#[test]
fn a_configuration_of_this_date_is_not_written_again() {
    for (date, is_written) in [(0x3A2F, false), (0x3A30, true)] {
        let toy = device().u32(0x1020, 1, date).u32(0x1020, 2, 0x0500_0000).u32(0x2000, 0, 1);
        let mut bus = bus_of(toy);
        let configuration = vec![(mux(0x2000, 0), 5_u32.to_le_bytes().to_vec())];
        let expectation = Expectation { configured: Some((0x3A2F, 0x0500_0000)), configuration, ..expecting(SLAVE) };
        let report = boot(&mut bus, 0, expectation);
        assert_eq!((letter(&report), written(&bus, 0x2000)), (None, is_written), "{report}");
    }
}

/// CiA 302-2, 1F8Ah: which sub-index of 1011h `load` is written to; what is restored counts after a reset (CiA 301,
/// 7.5.2.14).
#[test]
fn factory_settings_are_restored_before_the_configuration_where_it_is_asked_for() {
    let mut bus = bus_of(device().u32(0x1011, 2, 1).u32(0x2000, 0, 1));
    let configuration = vec![(mux(0x2000, 0), 5_u32.to_le_bytes().to_vec())];
    let expectation = Expectation { restore: 2, configuration, ..expecting(SLAVE | Assignment::RESTORE) };
    let report = boot(&mut bus, 0, expectation);
    assert_eq!(letter(&report), None, "{report}");
    let frames = bus.frames();
    let place = |wanted: &str| {
        frames.iter().position(|frame| frame == wanted).unwrap_or_else(|| panic!("{wanted}: {frames:?}"))
    };
    let (load, reset) = (place("607#231110026C6F6164"), place("000#8107"));
    assert!(load < reset && reset < place("607#2300200005000000"));
    // A device that does not take it is not configured over what it has.
    let mut bus = bus_of(device().u32(0x2000, 0, 1));
    let configuration = vec![(mux(0x2000, 0), 5_u32.to_le_bytes().to_vec())];
    let expectation = Expectation { restore: 2, configuration, ..expecting(SLAVE | Assignment::RESTORE) };
    assert_eq!((letter(&boot(&mut bus, 0, expectation)), written(&bus, 0x2000)), (Some('J'), false));
}

/// CiA 302-2, 1F80h, bit 3: the nodes are started by another device.
#[test]
fn a_master_that_starts_no_node_leaves_it_pre_operational() {
    for (startup, is_started) in [(0, true), (Startup::STARTS_NONE, false)] {
        let mut bus = bus_of(device());
        let report = boot(&mut bus, startup, expecting(SLAVE));
        assert_eq!((letter(&report), bus.frames().contains(&"000#0107".to_owned())), (None, is_started));
        assert_eq!(report.state, Some(NmtState::PreOperational), "as this bus says of it");
    }
}

/// CiA 302-2, 1F80h, bit 4.
#[test]
fn a_mandatory_node_that_fails_resets_all_with_bit_4_of_1f80h() {
    let mut bus = bus_of(device());
    let report = boot(&mut bus, Startup::RESET_ALL, Expectation { device_type: Some(1), ..expecting(SLAVE) });
    assert_eq!(letter(&report), Some('C'));
    // NMT reset node of all (CiA 301, 7.2.8.2.1).
    bus.settle();
    assert!(bus.frames().contains(&"000#8100".to_owned()), "{:?}", bus.frames());
}

/// A value of another question is never taken for the answer: the boot-up ends well, or says that no answer came in time.
#[test]
fn answers_that_come_twice_or_late_are_not_taken_for_others() {
    let identity = |toy: Toy| toy.u32(0x1018, 1, 0x11).u32(0x1018, 2, 0x22).u32(0x1018, 3, 0x33).u32(0x1018, 4, 0x44);
    for repeats in [false, true] {
        for late_ms in [0, 50, 150, 199, 201, 250, 390, 450, 700] {
            let late = Duration::from_millis(late_ms);
            let mut toy = identity(device());
            (toy.late, toy.repeats) = (late, repeats);
            let mut bus = bus_of(toy);
            let expectation = Expectation {
                vendor_id: Some(0x11),
                product_code: Some(0x22),
                revision_number: Some(0x33),
                serial_number: Some(0x44),
                ..expecting(SLAVE)
            };
            let report = boot(&mut bus, 0, expectation);
            match letter(&report) {
                None => {}
                Some('B' | 'D' | 'M' | 'N' | 'O' | 'J' | 'K') => {
                    let last = report.steps.last().unwrap().to_string();
                    assert!(late_ms > 199 && last.contains("got no answer within 200 ms"), "{late_ms} ms: {report}");
                }
                Some(other) => panic!("{other} at {late_ms} ms, twice {repeats}: {report}"),
            }
            // Within the time of an answer nothing is lost by it.
            assert!(late_ms > 150 || letter(&report).is_none(), "{late_ms} ms, twice {repeats}: {report}");
        }
    }
}
