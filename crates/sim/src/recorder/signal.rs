//! What can be recorded of a drive: a table.

use crate::{Brake, Report};

/// What can be recorded of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Actual position in the drive's counts.
    Position,
    /// Position demand in the drive's counts.
    PositionDemand,
    /// Motor speed in r/min.
    Velocity,
    /// Velocity demand in r/min.
    VelocityDemand,
    /// Motor current in A.
    Current,
    /// Current demand in A.
    CurrentDemand,
    /// Supply voltage in V.
    Supply,
    /// Motor temperature in °C.
    MotorTemperature,
    /// Power stage temperature in °C.
    DriverTemperature,
    /// True angle of the motor shaft in rad.
    ShaftAngle,
    /// Statusword as a number.
    Statusword,
    /// Code of the present fault; 0 for none.
    ErrorCode,
    /// Supply switched on: 1, or 0.
    Powered,
    /// Where the rotor of a drive that does not measure it truly is, in its counts.
    RotorPosition,
    /// Digital outputs, one bit each.
    Outputs,
    /// Holding brake engaged: 1, or 0.
    Brake,
    /// Angle of the shaft behind a reducer in rad.
    OutputAngle,
    /// Torque at the shaft behind a reducer in N·m.
    OutputTorque,
    /// Mode of operation in effect, as 6061h has it.
    Mode,
    /// NMT state, as a heartbeat has it (CiA 301, 7.2.8.3.2.2).
    NmtState,
    /// Torque of the motor on its rotor in N·m, with the sign of the velocity.
    MotorTorque,
    /// Torque of the load at its own shaft in N·m, positive against positive motion; friction is not in it.
    LoadTorque,
    /// True angle of the load in rad: behind a gear if there is one.
    LoadAngle,
    /// Voltage that the source is set to in V.
    Source,
    /// True temperature of the winding in °C, measured or not.
    Winding,
    /// True temperature of the power stage's heat sink in °C, measured or not.
    HeatSink,
    /// Temperature of the surroundings in °C.
    Ambient,
    /// Energy from the source in J since the begin.
    SourceEnergy,
    /// Of it: what the drive's own electronics took, in J.
    ElectronicsEnergy,
    /// Of it: heat of the winding in J.
    WindingHeat,
    /// Of it: heat of the power stage in J.
    SwitchesHeat,
    /// Of it: heat of the bleeder in J.
    BleederHeat,
    /// Of it: heat of all friction in J, brake and gear included.
    FrictionHeat,
    /// Of it: work done on the load's active torque, or on a machine that others move too, in J; negative while that drives.
    LoadWork,
    /// Energy stored now in J: in what moves, in springs, in the winding's field, in the bus capacitor.
    StoredEnergy,
    /// Current of wire U, or the first of a stepper's phases, in A, positive into the motor.
    Phase1,
    /// Current of wire V, or the second of a stepper's phases, in A, positive into the motor.
    Phase2,
    /// Current of wire W, in A, positive into the motor.
    Phase3,
}

/// A row of the table.
struct SignalRow {
    signal: Signal,
    /// With the unit at its end, as in CSV headers.
    name: &'static str,
    /// As people write it; empty for none.
    unit: &'static str,
    /// `None` where the drive has no value at present.
    of: fn(&Report) -> Option<f64>,
}

const fn row(signal: Signal, name: &'static str, unit: &'static str, of: fn(&Report) -> Option<f64>) -> SignalRow {
    SignalRow { signal, name, unit, of }
}

/// In the order of the enum and of a record's columns.
#[rustfmt::skip]
const ROWS: [SignalRow; 38] = [
    row(Signal::Position, "position_counts", "counts", |report| Some(report.position as f64)),
    row(Signal::PositionDemand, "position_demand_counts", "counts", |report| report.position_demand.map(|demand| demand as f64)),
    row(Signal::Velocity, "velocity_rpm", "r/min", |report| Some(report.velocity_rpm)),
    row(Signal::VelocityDemand, "velocity_demand_rpm", "r/min", |report| report.velocity_demand_rpm),
    row(Signal::Current, "current_a", "A", |report| Some(report.current_a)),
    row(Signal::CurrentDemand, "current_demand_a", "A", |report| report.current_demand_a),
    row(Signal::Supply, "supply_v", "V", |report| Some(report.supply_v)),
    row(Signal::MotorTemperature, "motor_c", "°C", |report| report.motor_c),
    row(Signal::DriverTemperature, "driver_c", "°C", |report| report.driver_c),
    row(Signal::ShaftAngle, "shaft_angle_rad", "rad", |report| Some(report.shaft_angle_rad)),
    row(Signal::Statusword, "statusword", "", |report| report.statusword.map(f64::from)),
    row(Signal::ErrorCode, "error_code", "", |report| Some(f64::from(report.error_code))),
    row(Signal::Powered, "powered", "", |report| Some(number(report.powered))),
    row(Signal::RotorPosition, "rotor_position_counts", "counts", |report| report.rotor_position.map(|position| position as f64)),
    row(Signal::Outputs, "outputs", "", |report| (!report.outputs.names.is_empty()).then_some(report.outputs.bits as f64)),
    row(Signal::Brake, "brake", "", |report| report.brake.map(|brake| number(brake == Brake::Engaged))),
    row(Signal::OutputAngle, "output_angle_rad", "rad", |report| report.output.map(|shaft| shaft.angle_rad)),
    row(Signal::OutputTorque, "output_torque_nm", "N·m", |report| report.output.map(|shaft| shaft.torque_nm)),
    row(Signal::Mode, "mode", "", |report| report.mode.map(|mode| f64::from(mode.0))),
    row(Signal::NmtState, "nmt_state", "", |report| report.nmt.map(|state| f64::from(state.heartbeat_byte()))),
    row(Signal::MotorTorque, "motor_torque_nm", "N·m", |report| report.physics.map(|it| it.motor_torque_nm)),
    row(Signal::LoadTorque, "load_torque_nm", "N·m", |report| report.physics.map(|it| it.load_torque_nm)),
    row(Signal::LoadAngle, "load_angle_rad", "rad", |report| report.physics.map(|it| it.load_angle_rad)),
    row(Signal::Source, "source_v", "V", |report| report.physics.map(|it| it.source_v)),
    row(Signal::Winding, "winding_c", "°C", |report| report.physics.map(|it| it.winding_c)),
    row(Signal::HeatSink, "heat_sink_c", "°C", |report| report.physics.map(|it| it.heat_sink_c)),
    row(Signal::Ambient, "ambient_c", "°C", |report| report.physics.map(|it| it.ambient_c)),
    row(Signal::SourceEnergy, "source_energy_j", "J", |report| report.physics.map(|it| it.energy.source_j)),
    row(Signal::ElectronicsEnergy, "electronics_energy_j", "J", |report| report.physics.map(|it| it.energy.consumption_j)),
    row(Signal::WindingHeat, "winding_heat_j", "J", |report| report.physics.map(|it| it.energy.winding_j)),
    row(Signal::SwitchesHeat, "switches_heat_j", "J", |report| report.physics.map(|it| it.energy.switches_j)),
    row(Signal::BleederHeat, "bleeder_heat_j", "J", |report| report.physics.map(|it| it.energy.bleeder_j)),
    row(Signal::FrictionHeat, "friction_heat_j", "J", |report| report.physics.map(|it| it.energy.friction_j)),
    row(Signal::LoadWork, "load_work_j", "J", |report| report.physics.map(|it| it.energy.load_j)),
    row(Signal::StoredEnergy, "stored_energy_j", "J", |report| report.physics.map(|it| it.stored_j)),
    row(Signal::Phase1, "phase_1_a", "A", |report| report.physics.and_then(|it| it.phase_current_a[0])),
    row(Signal::Phase2, "phase_2_a", "A", |report| report.physics.and_then(|it| it.phase_current_a[1])),
    row(Signal::Phase3, "phase_3_a", "A", |report| report.physics.and_then(|it| it.phase_current_a[2])),
];

fn number(flag: bool) -> f64 {
    f64::from(u8::from(flag))
}

impl Signal {
    /// All of them, in the order of a record's columns.
    pub const ALL: [Self; ROWS.len()] = {
        let mut all = [Self::Position; ROWS.len()];
        let mut place = 0;
        while place < all.len() {
            all[place] = ROWS[place].signal;
            place += 1;
        }
        all
    };

    const fn row(self) -> &'static SignalRow {
        &ROWS[self as usize]
    }

    /// Name with unit, as in CSV headers.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Its unit as people write it; empty for what has none.
    pub fn unit(self) -> &'static str {
        self.row().unit
    }

    /// Its value in a report; not a number where the drive has none at present.
    pub fn of(self, report: &Report) -> f64 {
        (self.row().of)(report).unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_signal_stands_in_its_own_row_under_a_name_of_its_own() {
        for (place, row) in ROWS.iter().enumerate() {
            assert_eq!((row.signal as usize, row.signal.name()), (place, row.name));
            let same = ROWS.iter().filter(|other| other.name == row.name);
            assert_eq!(same.count(), 1, "{}", row.name);
        }
    }
}
