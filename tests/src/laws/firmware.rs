//! What the laws about firmware ask of each drive.

use canopen::od::{Slot, Table};
use drives::{Firmware, mjoint, zlac8030l, zlim42c};

/// A drive's firmware, and what differs between drives.
pub(super) trait LawSubject: Firmware<Sensors: Default> {
    /// What a selector of a frame picks, SDO first.
    const IDS: [u16; 8];
    /// Writable objects that do not keep to the limits of their row, see [`keeps_its_own_rules`](Self::keeps_its_own_rules).
    const OWN_RULE: &'static [u16] = &[];

    fn table() -> &'static Table;
    fn value(&self, slot: Slot) -> i64;
    /// What the sensors read: each bit spoils something.
    fn sensors(place: u8, bits: u8) -> Self::Sensors;
    /// The power stage does nothing that hardware cannot do.
    fn is_possible(actuation: &Self::Actuation) -> bool;
    /// The power stage does nothing without a command.
    fn is_off(_actuation: &Self::Actuation) -> bool {
        true
    }
    /// What only this drive promises of its objects.
    fn keeps_its_own_rules(&self) -> bool {
        true
    }
}

/// SDO, NMT, SYNC, the four RPDOs, a heartbeat.
const ZL_IDS: [u16; 8] = [0x601, 0x000, 0x080, 0x201, 0x301, 0x401, 0x501, 0x701];

fn are_shares(duty: &[f32]) -> bool {
    duty.iter().all(|share| (0.0..=1.0).contains(share))
}

impl LawSubject for zlac8030l::Zlac8030l {
    const IDS: [u16; 8] = ZL_IDS;

    fn table() -> &'static Table {
        &zlac8030l::objects::TABLE
    }

    fn value(&self, slot: Slot) -> i64 {
        self.values().value(slot)
    }

    fn sensors(place: u8, bits: u8) -> zlac8030l::hardware::Sensors {
        let has = |bit: u8| bits & 1 << bit != 0;
        zlac8030l::hardware::Sensors {
            encoder_count: u16::from(place) * 257,
            encoder_wired: !has(0),
            hall: if has(1) { place } else { 5 },
            phase_current_a: if has(2) { [f32::from(place) * 1e3, -1e6] } else { [0.5, 0.25] },
            bus_v: if has(3) { f32::from(place) } else { 48.0 },
            motor_c: if has(4) { 300.0 } else { 25.0 },
            driver_c: if has(4) { -300.0 } else { 25.0 },
            inputs: [has(5), has(6)],
            eeprom_ok: !has(7),
            ..Default::default()
        }
    }

    fn is_possible(actuation: &Self::Actuation) -> bool {
        match actuation.power_stage {
            zlac8030l::hardware::PowerStage::Modulate { duty } => are_shares(&duty),
            _ => true,
        }
    }

    /// A shorted motor is what 202F:01 asks for without being enabled.
    fn is_off(actuation: &Self::Actuation) -> bool {
        matches!(actuation.power_stage, zlac8030l::hardware::PowerStage::Off | zlac8030l::hardware::PowerStage::Shorted)
    }
}

// 200Bh locks the shaft at power-on.
impl LawSubject for zlim42c::Zlim42c {
    const IDS: [u16; 8] = ZL_IDS;

    fn table() -> &'static Table {
        &zlim42c::objects::TABLE
    }

    fn value(&self, slot: Slot) -> i64 {
        self.values().value(slot)
    }

    fn sensors(place: u8, bits: u8) -> zlim42c::hardware::Sensors {
        let has = |bit: u8| bits & 1 << bit != 0;
        zlim42c::hardware::Sensors {
            phase_current_a: if has(2) { [f32::from(place) * 1e3, -1e6] } else { [0.5, 0.25] },
            bus_v: if has(3) { f32::from(place) } else { 24.0 },
            bus_current_a: if has(2) { 30.0 } else { 0.5 },
            reference_v: if has(4) { 0.0 } else { zlim42c::assumptions::REFERENCE_V },
            inputs: [has(0), has(1), has(5), has(6)],
            eeprom_ok: !has(7),
            ..Default::default()
        }
    }

    fn is_possible(actuation: &Self::Actuation) -> bool {
        match actuation.power_stage {
            zlim42c::hardware::PowerStage::Modulate { duty } => duty.iter().all(|share| share.abs() <= 1.0),
            _ => true,
        }
    }
}

// Pulse mode enables by itself.
impl LawSubject for mjoint::MJoint {
    /// SDO, the four RPDOs, SYNC, the host's heartbeat, NMT.
    const IDS: [u16; 8] = [0x601, 0x201, 0x301, 0x401, 0x501, 0x080, 0x77F, 0x000];
    /// The save flag reads 2 when all is stored, which cannot be written.
    const OWN_RULE: &'static [u16] = &[0x2614];

    fn table() -> &'static Table {
        &mjoint::objects::TABLE
    }

    fn value(&self, slot: Slot) -> i64 {
        self.values().value(slot)
    }

    fn sensors(place: u8, bits: u8) -> mjoint::Sensors {
        let has = |bit: u8| bits & 1 << bit != 0;
        let mut sensors = mjoint::Sensors {
            angle_count: u16::from(place) << 8 | u16::from(bits),
            position_counts: if has(0) { i32::MIN + i32::from(place) } else { i32::from(place) * 128 },
            turns_lost: has(1),
            phase_current_a: if has(2) { [40.0, -40.0] } else { [0.5, 0.25] },
            bus_v: if has(3) { 60.0 } else { 36.0 },
            driver_c: if has(4) { f32::INFINITY } else { 30.0 },
            pu: has(5),
            dir: has(6),
            eeprom_fails: has(7),
            ..mjoint::Sensors::default()
        };
        sensors.pulses.falls = u16::from(bits) << 8 | u16::from(place);
        sensors.pulses.quadrature = sensors.pulses.falls;
        sensors.pulses.duty = has(0).then(|| f32::from(place) / 200.0);
        sensors
    }

    fn is_possible(actuation: &Self::Actuation) -> bool {
        match actuation.power_stage {
            mjoint::PowerStage::Modulate { duty } => are_shares(&duty),
            _ => true,
        }
    }

    /// Bits 0 to 5, 10, 12 and 13 are all that the statusword has.
    fn keeps_its_own_rules(&self) -> bool {
        let values = self.values();
        values.get(mjoint::objects::STATUSWORD) & !0x343F == 0 && values.get(mjoint::objects::DATA_SAVE_FLAG) <= 2
    }
}
