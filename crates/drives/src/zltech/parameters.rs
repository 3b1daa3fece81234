//! The CiA 402 objects that mean the same in both drives, in physical units: speeds in r/min, ramps as times in ms.

use canopen::od::{Dictionary, Object, Storage, Table};
use cia402::{DisableOperationOption, HaltOption, QuickStopOption, ShutdownOption, StopRamp};

use crate::engine::axis::{HomingParameters, MoveLimits, Ramp, VelocityRamps};
use crate::engine::cia402::DisableOptions;
use crate::engine::cia402::{ExternalStop, ModeChange, Parameters as AxisParameters, Tolerances};

/// Where a drive's table has them.
pub(crate) struct ProfileObjects {
    quick_stop_option_code: Object<i16>,
    shutdown_option_code: Object<i16>,
    disable_operation_option_code: Object<i16>,
    halt_option_code: Object<i16>,
    profile_velocity: Object<u32>,
    end_velocity: Object<u32>,
    profile_acceleration: Object<u32>,
    profile_deceleration: Object<u32>,
    quick_stop_deceleration: Object<u32>,
}

impl ProfileObjects {
    /// Those of `table`.
    pub(crate) const fn of(table: &Table) -> Self {
        Self {
            quick_stop_option_code: table.object(0x605A, 0),
            shutdown_option_code: table.object(0x605B, 0),
            disable_operation_option_code: table.object(0x605C, 0),
            halt_option_code: table.object(0x605D, 0),
            profile_velocity: table.object(0x6081, 0),
            end_velocity: table.object(0x6082, 0),
            profile_acceleration: table.object(0x6083, 0),
            profile_deceleration: table.object(0x6084, 0),
            quick_stop_deceleration: table.object(0x6085, 0),
        }
    }

    /// Ramps, speeds and option codes, with nothing that only one of the drives has. `speed` turns r/min into counts/s, no
    /// faster than the drive allows.
    pub(crate) fn axis<S: Storage>(
        &self,
        values: &Dictionary<S>,
        start_rpm: u16,
        max_rpm: f64,
        speed: impl Fn(f64) -> f64,
    ) -> AxisParameters {
        let ramp = |object| Ramp::Time(f64::from(values.get(object)) * 1e-3);
        let (start_speed, max_speed) = (speed(f64::from(start_rpm)), speed(max_rpm));
        let (acceleration, deceleration) = (ramp(self.profile_acceleration), ramp(self.profile_deceleration));
        AxisParameters {
            moves: MoveLimits {
                start_speed,
                max_speed: speed(f64::from(values.get(self.profile_velocity))),
                end_speed: speed(f64::from(values.get(self.end_velocity))),
                passes: false,
                acceleration,
                deceleration,
            },
            velocity: VelocityRamps { start_speed, max_speed, acceleration, deceleration },
            quick_stop_ramp: ramp(self.quick_stop_deceleration),
            torque_slope_a_s: 0.0,
            quick_stop: QuickStopOption(values.get(self.quick_stop_option_code)),
            disable: DisableOptions {
                shutdown: ShutdownOption(values.get(self.shutdown_option_code)),
                disable_operation: DisableOperationOption(values.get(self.disable_operation_option_code)),
            },
            halt: HaltOption(values.get(self.halt_option_code)),
            emergency_stop: StopRamp::CurrentLimit,
            limit_stop: None,
            homing: HomingParameters::default(),
            external_stop: ExternalStop::Hold,
            tolerances: Tolerances::default(),
            mode_change: ModeChange::AtStandstill,
        }
    }
}

/// What is done with a shaft that is not enabled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Holding {
    /// It is locked.
    pub(crate) when_disabled: bool,
    /// It is held from Switched on.
    pub(crate) when_switched_on: bool,
}
