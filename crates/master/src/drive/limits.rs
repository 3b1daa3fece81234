//! What an object takes at this time, and why: limits from the model's table, moved by the objects that the row
//! names ([`Entry::resolution`], [`Entry::held_to`]). Their values are read from the drive, and no rule is written here a
//! second time.

use canopen::Mux;
use canopen::od::{Entry, HeldTo};
use cia402::object::{
    MAX_MOTOR_SPEED, MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, POSITION_ACTUAL_VALUE, PROFILE_VELOCITY, TARGET_POSITION,
    TARGET_VELOCITY, VL_TARGET_VELOCITY, VL_VELOCITY_MAX_AMOUNT, VL_VELOCITY_MIN_AMOUNT,
};
use devices::{Quantity, Scale};

use super::handle::Drive;
use super::state::refused_is_none;
use crate::error::Error;
use crate::limits::{HeldBy, Limits, Setting};

/// Where the highest speed of the motor is said.
enum MotorBound {
    /// In the manual, r/min.
    Manual(f64),
    /// In this object, in r/min (6080h).
    Object(Mux),
}

impl Drive {
    /// What an object takes at this time. Asks the drive for the objects that have a say in it.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; [`Error::Aborted`] with the code of a missing object where the model has none; those of the
    /// SDO reads.
    pub async fn limits(&self, object: Mux) -> Result<Limits, Error> {
        let row = self.row(object, "find out its limits")?;
        self.limits_of(row).await
    }

    pub(super) async fn limits_of(&self, row: &'static Entry) -> Result<Limits, Error> {
        let resolution = match row.resolution {
            Some(object) => Some(self.setting(object).await?),
            None => None,
        };
        let scale = resolution.map_or(1, |setting| setting.value.max(1));
        let held_to = match row.held_to {
            Some(HeldTo { object, counts }) => {
                // A drive that refuses the object holds nothing back by it.
                let setting = refused_is_none(self.setting(object).await)?;
                // Of 0 it lets nothing move, or some devices everything: what keeps a drive from turning is another question.
                setting
                    .filter(|setting| setting.value != 0)
                    .map(|setting| (setting.value * counts * scale, HeldBy::Setting(setting)))
            }
            None => {
                let greatest = self.amount(row.mux(), VL_VELOCITY_MAX_AMOUNT).await?;
                greatest.map(|(counts, setting)| (counts as i64, HeldBy::Setting(setting)))
            }
        };
        let held_to = match self.motor_speed(row.mux()).await? {
            Some(by_motor) if held_to.is_none_or(|(most, _)| by_motor.0 < most) => Some(by_motor),
            _ => held_to,
        };
        let least = self.amount(row.mux(), VL_VELOCITY_MIN_AMOUNT).await?;
        let raised_to = least.map(|(counts, setting)| (counts.ceil() as i64, setting));
        let (low, high) = row.limits_at(scale);
        let (object, Entry { name, unit, values: listed, .. }) = (row.mux(), *row);
        Ok(Limits { object, name, unit, low, high, listed, resolution, held_to, raised_to })
    }

    /// What limits the target of an axis that turns in velocity mode (vl): the greatest amount, 6046h:02, or the least, 6046h:01, to
    /// which a drive raises a smaller target (CiA 402-2, vl velocity min max amount), in counts of the target; 0 limits nothing.
    async fn amount(&self, target: Mux, amount: Mux) -> Result<Option<(f64, Setting)>, Error> {
        let amount = self.place(amount);
        let Some(Scale::Factors { times, over }) = self.scale_of_velocity_mode(target) else { return Ok(None) };
        if self.row(amount, "find out its limits").is_err() {
            return Ok(None);
        }
        let setting = refused_is_none(self.setting(amount).await)?.filter(|setting| setting.value != 0);
        let Some(setting) = setting else { return Ok(None) };
        // Amounts lack the set-point factor (604Bh), which is the first of the target's.
        let factor = self.product([times[0], None]).await? / self.product([over[0], None]).await?;
        Ok(Some((setting.value as f64 / factor.abs(), setting)))
    }

    /// What holds back a speed beside the object of its own row, in counts of this object: 6080h, which is in r/min of the motor whatever
    /// the units are (CiA 402-2, max motor speed) and of which 0 limits nothing, or the motor itself.
    async fn motor_speed(&self, object: Mux) -> Result<Option<(i64, HeldBy)>, Error> {
        let Some((quantity, bound)) = self.motor_bound(object) else { return Ok(None) };
        let (rpm, by) = match bound {
            MotorBound::Manual(rpm) => (rpm, HeldBy::Motor),
            MotorBound::Object(most) => {
                let setting = refused_is_none(self.setting(most).await)?.filter(|setting| setting.value > 0);
                let Some(setting) = setting else { return Ok(None) };
                (setting.value as f64, HeldBy::Setting(setting))
            }
        };
        let counts = self.gear.at_output(rpm) / self.step_of(quantity).await?.abs();
        // The count to which the very speed is rounded is within it.
        Ok(Some(((counts - 1e-6).ceil() as i64, by)))
    }

    /// What bounds a target or profile velocity beside its row, where the axis has it where the standard does.
    fn motor_bound(&self, object: Mux) -> Option<(Quantity, MotorBound)> {
        let quantity = self.speed_of_standard(object)?;
        let most = self.place(MAX_MOTOR_SPEED);
        let by_object = || self.row(most, "find out its limits").is_ok().then_some(MotorBound::Object(most));
        let by_manual = self.axis_description()?.max_motor_rpm.map(MotorBound::Manual);
        Some((quantity, by_manual.or_else(by_object)?))
    }

    /// The target or profile velocity of an axis that has them where the standard does.
    fn speed_of_standard(&self, object: Mux) -> Option<Quantity> {
        let units = self.axis_description()?.units;
        let speeds = [(TARGET_VELOCITY, units.target_velocity), (PROFILE_VELOCITY, units.profile_velocity)];
        let its = |(standard, quantity): (Mux, Option<Quantity>)| {
            quantity.filter(|quantity| quantity.object == object && object == self.place(standard))
        };
        speeds.into_iter().find_map(its)
    }

    /// Refuses a position beyond the software limits (CiA 402-2, 607Dh), to which a drive does not go, before anything moves. Limits the
    /// wrong way round have no effect, and a model without them goes anywhere.
    ///
    /// # Errors
    /// [`Error::OutOfLimits`]; those of the SDO reads.
    pub(super) async fn check_software_limits(&self, counts: i64, relative: bool) -> Result<(), Error> {
        let [low, high] = [MIN_POSITION_LIMIT, MAX_POSITION_LIMIT].map(|object| self.place(object));
        if [low, high].iter().any(|object| self.row(*object, "find out its limits").is_err()) {
            return Ok(());
        }
        let (low, high) = (self.setting(low).await, self.setting(high).await);
        let (Some(low), Some(high)) = (refused_is_none(low)?, refused_is_none(high)?) else { return Ok(()) };
        let asked = match relative {
            true => counts.saturating_add(self.read_number(self.place(POSITION_ACTUAL_VALUE)).await?),
            false => counts,
        };
        let bound = match asked {
            _ if low.value >= high.value => return Ok(()),
            _ if asked < low.value => low,
            _ if asked > high.value => high,
            _ => return Ok(()),
        };
        let row = self.row(self.place(TARGET_POSITION), "find out its limits")?;
        let limits = self.limits_of(row).await?;
        Err(self.out_of_limits(asked, Limits { held_to: Some((bound.value, HeldBy::Setting(bound))), ..limits }))
    }

    fn scale_of_velocity_mode(&self, target: Mux) -> Option<Scale> {
        let quantity = self.axis_description()?.units.target_velocity?;
        (quantity.object == target && target == self.place(VL_TARGET_VELOCITY)).then_some(quantity.scale)
    }

    /// Whether what this object takes, or what of it acts, is not in its row alone: another object has a say in it, or the motor.
    pub fn is_limited_elsewhere(&self, row: &Entry) -> bool {
        let object = row.mux();
        row.resolution.is_some()
            || row.held_to.is_some()
            || self.scale_of_velocity_mode(object).is_some()
            || self.motor_bound(object).is_some()
    }

    async fn setting(&self, object: Mux) -> Result<Setting, Error> {
        let value = self.read_number(object).await?;
        let description = self.known("find out its limits")?;
        let name = description.row(object).map_or("", |row| row.name);
        let since_restart = description.storage.effective_after_restart.contains(&object);
        Ok(Setting { object, name, value, since_restart })
    }

    /// Checks a value against the object's limits, and gives its row. The drive is only asked about limits that move where
    /// the value is beyond those that hold in any case.
    pub(crate) async fn check_number(&self, mux: Mux, value: i64) -> Result<&'static Entry, Error> {
        let row = self.row(mux, "write an object by its model's table")?;
        let (low, high) = row.limits_at(1);
        let listed = row.values.is_empty() || row.meaning(value).is_some();
        if (low..=high).contains(&value) && listed {
            return Ok(row);
        }
        let limits = self.limits_of(row).await?;
        if limits.take(value) { Ok(row) } else { Err(self.out_of_limits(value, limits)) }
    }

    /// As [`check_number`](Self::check_number), for what is to take effect: a value that the drive would take and hold
    /// back, or raise, is refused too.
    pub(crate) async fn check_effect(&self, mux: Mux, value: i64) -> Result<&'static Entry, Error> {
        let row = self.check_number(mux, value).await?;
        if value == 0 || !self.is_limited_elsewhere(row) {
            return Ok(row);
        }
        let limits = self.limits_of(row).await?;
        if limits.changed(value).is_none() { Ok(row) } else { Err(self.out_of_limits(value, limits)) }
    }

    fn out_of_limits(&self, asked: i64, limits: Limits) -> Error {
        Error::OutOfLimits { node: self.node.id(), asked, limits: Box::new(limits) }
    }
}
