//! An M joint on its motor at 36 V.

use canopen::od::Table;
use drives::Firmware;
use drives::engine::storage::StoredImage;
use drives::mjoint::objects::TABLE;
use drives::mjoint::{Actuation, Battery, Brake, MJoint, Model, PowerStage, Sensors};
use plant::absolute_encoder::BatteryState;
use plant::{Angle, Inverter, JointMotor, JointMotorModel, joint_motor};

use super::{Bench, Rig};

/// Counts of one turn.
pub(crate) const TURN: i64 = 32_768;

pub(crate) struct Joint {
    motor: JointMotor,
    start: i64,
}

impl Bench<Joint> {
    /// A drive as delivered, switched on and booted.
    pub(crate) fn new() -> Self {
        Self::of(&Model::M4230E17B50, JointMotorModel::M4230E17B50)
    }

    /// The same of this model.
    pub(crate) fn of(model: &'static Model, motor: JointMotorModel) -> Self {
        let motor = JointMotor::new(motor, Angle::new(0, 0.123), 36.0, 25.0);
        let start = motor.rotor.angle.count(TURN as u32);
        let mut bench = Self::unpowered(MJoint::new(model), Joint { motor, start }, 1);
        bench.power_on();
        bench
    }

    /// The EEPROM keeps what it holds.
    pub(crate) fn power_off(&mut self) {
        self.drive.power_off(self.now);
        self.hardware.eeprom = StoredImage::from_bytes(self.drive.eeprom().0);
    }

    /// Counts of the shaft from where the bench began.
    pub(crate) fn shaft(&self) -> i64 {
        self.rig.motor.rotor.angle.count(TURN as u32) - self.rig.start
    }

    /// Absolute moves, each new one at once (5.06.1).
    pub(crate) fn enable_absolute(&mut self) {
        self.write(0x6060, 0, 1);
        self.controlword(0x2F);
    }

    /// Speed mode (5.07.1).
    pub(crate) fn enable_speed(&mut self) {
        self.write(0x6060, 0, 3);
        self.controlword(0x0F);
    }

    pub(crate) fn until_reached(&mut self, limit_ms: u32) -> u32 {
        self.run_until(limit_ms, |bench| bench.statusword() & 0x0400 != 0)
    }
}

impl Rig for Joint {
    type Drive = MJoint;

    const TABLE: &'static Table = &TABLE;

    fn sensors(&self) -> Sensors {
        let read = self.motor.sense();
        Sensors {
            angle_count: self.motor.rotor.angle.count(TURN as u32).rem_euclid(TURN) as u16,
            position_counts: read.position_counts,
            turns_lost: read.turns_lost,
            battery: match read.battery {
                BatteryState::Full => Battery::Full,
                BatteryState::Charging => Battery::Charging,
                BatteryState::Disconnected => Battery::Missing,
            },
            phase_current_a: [read.phase_current_a[0] as f32, read.phase_current_a[1] as f32],
            bus_v: read.bus_v as f32,
            driver_c: read.heat_sink_c as f32,
            ..Sensors::default()
        }
    }

    fn step(&mut self, dt_s: f64, actuation: &Actuation) {
        let inverter = match actuation.power_stage {
            PowerStage::Off => Inverter::Open,
            PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            PowerStage::Follow(_) => unreachable!("of fidelity full"),
        };
        let brake_released = actuation.brake != Brake::Engaged;
        let set_origin = actuation.set_origin;
        self.motor.step(dt_s, &joint_motor::Actuation { inverter, brake_released, set_origin });
    }

    fn velocity_rad_s(&self) -> f64 {
        self.motor.rotor.velocity_rad_s
    }
}
