//! What each mode of operation asks of the axis.

use cia402::{Controlword, ModeOfOperation};

use super::parameters::{Parameters, Targets};
use super::power_drive::PowerDrive;
use super::set_points::SetPoint;
use crate::engine::axis::{Control, Demand, Ramp, Task};

impl PowerDrive {
    /// Bit 4 rose: a set-point or homing begins. Under halt it waits.
    pub(super) fn start(&mut self, set_point: SetPoint, parameters: &Parameters) {
        let SetPoint { target, relative, .. } = set_point;
        let way = if relative { target } else { target.wrapping_sub(self.axis.point().position) };
        match self.mode {
            ModeOfOperation::PROFILE_POSITION if !self.meets_limit(f64::from(way), parameters) => {
                self.short_of_target = false;
                if self.set_points.take(set_point) {
                    self.set_off(parameters);
                }
            }
            ModeOfOperation::HOMING => self.axis.begin(Task::Home(parameters.homing)),
            _ => {}
        }
    }

    /// The move to the present set-point begins, or goes on with the present speeds.
    pub(super) fn set_off(&mut self, parameters: &Parameters) {
        self.axis.begin(Task::Move { target: self.set_points.target(), limits: parameters.moves });
    }

    /// One period of the mode.
    pub(super) fn following(&mut self, targets: &Targets, parameters: &Parameters, dt_s: f64) -> Demand {
        let slow_down = parameters.moves.deceleration;
        match self.mode {
            ModeOfOperation::PROFILE_POSITION => {
                self.rest(Control::Position, slow_down);
                let demand = self.axis.update(dt_s);
                let new_set_point = self.power.controlword().has(Controlword::NEW_SET_POINT);
                if self.set_points.update(new_set_point, self.axis.has_arrived()) {
                    self.set_off(parameters);
                    return Demand::Position(self.axis.point());
                }
                return demand;
            }
            ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::VELOCITY => {
                self.axis.begin(Task::Speed { velocity: targets.velocity, ramps: parameters.velocity });
            }
            ModeOfOperation::PROFILE_TORQUE => {
                let slope_a_s = parameters.torque_slope_a_s;
                self.axis.begin(Task::Torque { current_a: targets.current_a, slope_a_s });
            }
            ModeOfOperation::HOMING => self.rest(Control::Position, parameters.homing.ramps.deceleration),
            mode if is_cyclic(mode) => match targets.cyclic {
                Some(set_point) => self.axis.begin(Task::Cyclic(set_point)),
                None => self.axis.begin(Task::Hold { control: Control::Position, ramp: slow_down }),
            },
            _ => self.rest(Control::Velocity, slow_down),
        }
        self.axis.update(dt_s)
    }

    /// With nothing to do the shaft is brought to rest.
    fn rest(&mut self, control: Control, ramp: Ramp) {
        if matches!(self.axis.task(), Task::Hold { .. }) {
            self.axis.begin(Task::Hold { control, ramp });
        }
    }
}

/// Interpolated position and the cyclic synchronous modes: the set-points are planned outside.
pub(super) const fn is_cyclic(mode: ModeOfOperation) -> bool {
    matches!(
        mode,
        ModeOfOperation::INTERPOLATED_POSITION
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE
    )
}
