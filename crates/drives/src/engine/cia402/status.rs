//! What the statusword shows.

use cia402::ModeOfOperation;

use super::parameters::{Parameters, Status, Targets, Tolerances};
use super::power_drive::{Engaged, PowerDrive};
use super::stop::StopCause;
use crate::engine::axis::HomingState;

impl PowerDrive {
    /// What the statusword shows.
    pub fn status(&self, targets: &Targets, parameters: &Parameters) -> Status {
        let standing = self.axis.feedback().standing;
        let homing = self.axis.homing();
        Status {
            target_reached: self.target_reached(targets, parameters),
            acknowledged: self.set_points.is_acknowledged(),
            in_position: self.is_in_position(&parameters.tolerances),
            standing,
            running: !standing
                || (self.engaged == Engaged::Yes && self.axis.point().velocity != 0.0)
                || (homing == HomingState::Running && self.stop.is_none()),
            external_stop: self.external_stop,
            homing_attained: homing == HomingState::Attained,
            homing_error: homing == HomingState::Failed,
            limit_active: self.short_of_target || self.stop_cause() == Some(StopCause::Limit),
        }
    }

    fn target_reached(&self, targets: &Targets, parameters: &Parameters) -> bool {
        let Tolerances { velocity, current_a, .. } = parameters.tolerances;
        let feedback = self.axis.feedback();
        let homing_ended = matches!(self.axis.homing(), HomingState::Attained | HomingState::Failed);
        if self.mode == ModeOfOperation::HOMING && !homing_ended && self.stop_cause() != Some(StopCause::Halt) {
            return false;
        }
        if self.engaged != Engaged::Yes || self.stop.is_some() {
            return feedback.standing;
        }
        match self.mode {
            ModeOfOperation::PROFILE_POSITION => {
                !self.set_points.is_under_way() && !self.short_of_target && self.is_in_position(&parameters.tolerances)
            }
            ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::VELOCITY => {
                let limit = parameters.velocity.max_speed;
                (feedback.velocity - targets.velocity.clamp(-limit, limit)).abs() <= velocity
            }
            ModeOfOperation::PROFILE_TORQUE => {
                self.axis.torque_demand_a() == targets.current_a
                    && (feedback.current_a - targets.current_a).abs() <= current_a
            }
            _ => feedback.standing,
        }
    }

    fn is_in_position(&self, tolerances: &Tolerances) -> bool {
        if self.mode != ModeOfOperation::PROFILE_POSITION || self.engaged == Engaged::No {
            return true;
        }
        let deviation = self.axis.point().position.wrapping_sub(self.axis.feedback().position);
        deviation.unsigned_abs() <= tolerances.position
    }
}
