//! What a device does at its restarts, with its store and with its errors.

use super::*;
use crate::engine::faults::{FaultMonitor, FaultRow, error_register};
use canopen::od::{Fixed, Index, Object, Table};
use devices::name;
use devices::row::{U8, U16, ro, rws};

const PERIOD_NS: u64 = 500_000;

static ROWS: [Entry; 3] = [
    ro(0x1001, 0, U8, name!("error_register")),
    rws(0x1017, 0, U16, name!("producer_heartbeat_time")).default(100),
    rws(0x2000, 0, U16, name!("parameter")).default(7),
];
static INDEX: Index<3> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);
static FAULTS: [FaultRow; 1] = [FaultRow::new(0x3210, "over-voltage", error_register::VOLTAGE, "")];
const ERROR_REGISTER: Object<u8> = TABLE.object(0x1001, 0);
const HEARTBEAT: Object<u16> = TABLE.object(0x1017, 0);
const PARAMETER: Object<u16> = TABLE.object(0x2000, 0);

fn started() -> Device<Fixed<3>> {
    let image = StoredImage::of(&Dictionary::<Fixed<3>>::new(&TABLE, NodeId::MIN));
    let mut device = Device::new(&PROFILE, Bitrate::K500, image, PERIOD_NS, Variant::first_of(&[]));
    device.power_on(image);
    device.restart(NodeId::MIN, Bitrate::K500, Instant::ZERO);
    device.boot(Instant::ZERO);
    device
}

fn at(periods: u64, ns: u64) -> Instant {
    Instant::ZERO.plus_nanos(periods * PERIOD_NS + ns)
}

#[test]
fn the_task_keeps_its_grid_when_it_is_called_late_and_begins_a_new_one_after_a_long_pause() {
    let mut device = started();
    assert!(!device.is_task_due(at(0, PERIOD_NS - 1)));
    assert!(device.is_task_due(at(1, 400_000)));
    assert!(device.is_task_due(at(2, 0)));
    assert!(!device.is_task_due(at(2, 0)));
    assert!(device.is_task_due(at(9, 100_000)));
    assert!(!device.is_task_due(at(10, 99_999)));
    assert!(device.is_task_due(at(10, 100_000)));
    device.power_off();
    assert!(!device.is_task_due(at(20, 0)));
    assert_eq!(device.poll_timeout(), None);
}

#[test]
fn what_is_marked_waits_while_the_eeprom_does_not_answer() {
    let mut device = started();
    device.values_mut().set(PARAMETER, 8);
    device.mark(PARAMETER.slot());
    device.set_eeprom_ok(false);
    device.commit();
    assert!(!device.save(&device.values().clone()) && !device.restore_factory_settings(|_| true));
    assert_eq!((device.values().get(PARAMETER), device.stored_values().get(PARAMETER)), (8, 7));
    device.set_eeprom_ok(true);
    device.commit();
    assert_eq!(device.stored_values().get(PARAMETER), 8);
}

#[test]
fn factory_settings_show_parameters_at_once_and_communication_objects_after_a_restart() {
    let mut device = started();
    device.values_mut().set(PARAMETER, 8);
    device.values_mut().set(HEARTBEAT, 200);
    assert!(device.restore_factory_settings(|_| true));
    assert_eq!((device.values().get(PARAMETER), device.values().get(HEARTBEAT)), (7, 200));
    device.restart(NodeId::MIN, Bitrate::K500, at(1, 0));
    assert_eq!(device.values().get(HEARTBEAT), 100);
}

#[test]
fn a_restart_of_communication_leaves_parameters_and_the_error_register() {
    let mut device = started();
    let mut faults = FaultMonitor::new(&FAULTS, &[1]);
    faults.raise(0);
    device.report_faults(faults.latched(), &faults, Instant::ZERO);
    device.values_mut().set(PARAMETER, 8);
    device.values_mut().set(HEARTBEAT, 200);
    device.restart_communication(at(1, 0));
    let values = device.values();
    assert_eq!((values.get(ERROR_REGISTER), values.get(HEARTBEAT), values.get(PARAMETER)), (0b101, 100, 8));
    assert!(faults.reset());
    device.report_reset(&faults, at(1, 0));
    assert_eq!(device.values().get(ERROR_REGISTER), 0);
}

/// These frames and no others wait to be sent; then what 1001h shows.
#[track_caller]
fn assert_sent<const F: usize>(device: &mut Device<Fixed<3>>, frames: [&str; F], error_register: u8) {
    for frame in frames {
        assert_eq!(device.poll_transmit(), Some(frame.parse().expect("it is written as a frame is")));
    }
    assert_eq!((device.poll_transmit(), device.values().get(ERROR_REGISTER)), (None, error_register));
}

#[test]
fn errors_of_communication_stand_beside_the_faults_and_no_error_is_reported_when_the_last_has_ended() {
    let mut device = started();
    let mut faults = FaultMonitor::new(&FAULTS, &[1]);
    device.report_rpdo_length(false, at(1, 0));
    device.report_rpdo_length(false, at(1, 0));
    assert_sent(&mut device, ["701#00", "081#1082110000000000", "081#1082110000000000"], 0b1_0001);
    faults.raise(0);
    device.report_faults(faults.latched(), &faults, at(1, 0));
    assert_sent(&mut device, ["081#1032150000000000"], 0b1_0101);
    device.report_rpdo_length(true, at(1, 0));
    assert!(faults.reset());
    device.report_reset(&faults, at(1, 0));
    assert_sent(&mut device, [], 0b1_0001);
    device.report_rpdo_length(true, at(1, 0));
    assert_sent(&mut device, ["081#0000000000000000"], 0);
}

#[test]
fn lost_events_are_reported_as_objects_lost_until_faults_are_reset_or_communication_is() {
    let mut device = started();
    device.report_lost_events(at(1, 0));
    assert_sent(&mut device, ["701#00", "081#1081110000000000"], 0b1_0001);
    let mut again = device.clone();
    device.report_reset(&FaultMonitor::new(&FAULTS, &[1]), at(1, 0));
    assert_sent(&mut device, ["081#0000000000000000"], 0);
    again.restart_communication(at(1, 0));
    assert_sent(&mut again, ["701#00"], 0);
}
