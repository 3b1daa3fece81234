//! A twist of a base for some time: as it is typed, within which limits, and how it is carried out.
//!
//! `ferrodrive drive-base` and a line of a scenario's host (`drive-base linear 0.3 angular 0.2 for 3s`) are this.

use std::str::FromStr;
use std::time::Duration;

use master::base::{Base, BaseError, BaseLimits, BaseState, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::units::Shown;
use master::{Drive, Network};

use crate::file::{BASE_PERIOD, BasePlan, speed_mode};
use words::failure::Failure;
use words::time::some_time;

/// How long the wheels may take to stand after their last set-point before the pose is reported.
const SETTLING: Duration = Duration::from_millis(500);

/// A twist, and how long it is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseDrive {
    /// Speed along the heading, and rate of turn.
    pub twist: Twist,
    /// From the first set-point on, ramp included; then the base comes to rest.
    pub time: Duration,
}

/// A number of a twist.
///
/// # Errors
/// What is expected.
pub fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| "expected a finite number, e.g. 0.3".into())
}

impl FromStr for BaseDrive {
    type Err = String;

    /// What stands behind `drive-base` in a line of a scenario: its [form](BaseDrive::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected: {}", Self::FORM);
        let (mut linear, mut angular, mut time) = (None, None, None);
        words::line::take(Self::FORM, text.split_whitespace(), |word, value| {
            match word {
                "linear" => linear = Some(finite(value()?)?),
                "angular" => angular = Some(finite(value()?)?),
                "for" => time = Some(some_time(value()?)?),
                _ => return Ok(false),
            }
            Ok(true)
        })?;
        let time = time.ok_or_else(|| format!("it needs a time, as in: for 3s; {}", expected()))?;
        if linear.or(angular).is_none() {
            return Err(format!("it needs a speed in m/s, a rate of turn in rad/s, or both; {}", expected()));
        }
        let twist = Twist { linear_m_s: linear.unwrap_or_default(), angular_rad_s: angular.unwrap_or_default() };
        Ok(Self { twist, time })
    }
}

impl BaseDrive {
    /// It as a line of a host has it.
    pub const FORM: &str = "drive-base [linear M/S] [angular RAD/S] for TIME";

    /// A twist that is named with its time is meant as it stands: one that the base would slow down is refused.
    ///
    /// # Errors
    /// It is beyond the limits, or these make no sense.
    pub fn check(&self, plan: &BasePlan, limits: &BaseLimits) -> Result<(), Failure> {
        limits.check()?;
        let driven = plan.geometry.saturate(self.twist, limits);
        if driven == self.twist {
            return Ok(());
        }
        let shown = |twist: Twist| format!("{} m/s and {} rad/s", Shown(twist.linear_m_s), Shown(twist.angular_rad_s));
        let [linear, angular, wheel] = [limits.linear_m_s, limits.angular_rad_s, limits.wheel_m_s].map(Shown);
        Err(Failure::new(format!(
            "{} is beyond the limits of [base]: {linear} m/s, {angular} rad/s and {wheel} m/s at a wheel",
            shown(self.twist)
        ))
        .of_kind("out_of_limits")
        .next(format!("give {}, the most in the same direction, or raise the limits in [base]", shown(driven))))
    }

    /// Drives so long; `watch` is called in each cycle with what it showed. The base [comes to rest](come_to_rest) after it.
    ///
    /// # Errors
    /// What has stopped it.
    pub async fn carry_out(
        &self,
        base: &mut Base,
        network: &Network,
        mut watch: impl FnMut(&BaseState),
    ) -> Result<(), BaseError> {
        let end = network.now() + self.time;
        while network.now() < end {
            base.command(self.twist)?;
            watch(&cycle(base).await?);
        }
        Ok(())
    }
}

/// The wheels of a base, the left one first, and how each is moved.
pub fn wheels(plan: &BasePlan, drives: [Drive; 2]) -> [WheelSetup; 2] {
    let [(_, left), (_, right)] = plan.wheels;
    let [left_drive, right_drive] = drives;
    [(left_drive, left), (right_drive, right)].map(|(drive, turns)| {
        let mode = plan.mode.unwrap_or_else(|| speed_mode(&drive));
        WheelSetup { drive, mode, turns }
    })
}

/// The base of these wheels, its drives set up and without power.
///
/// # Errors
/// Those of [`Base::open`].
pub async fn open(
    plan: &BasePlan,
    [left, right]: &[WheelSetup; 2],
    limits: BaseLimits,
    options: CyclicOptions,
) -> Result<Base, BaseError> {
    let period = plan.period.unwrap_or(BASE_PERIOD);
    Base::open([left, right], plan.geometry, limits, period, options).await
}

/// A cycle; an error once a wheel has stopped the base.
///
/// # Errors
/// [`BaseError::Stopped`], and those of [`Base::cycle`].
pub async fn cycle(base: &mut Base) -> Result<BaseState, BaseError> {
    let state = base.cycle().await?;
    if let Some(cause) = state.cause.filter(|cause| cause.wheel().is_some()) {
        // Both wheels come to rest before it is reported.
        base.stop().await?;
        return Err(BaseError::Stopped(cause));
    }
    Ok(state)
}

/// Comes to rest within the limits, and waits until the wheels stand: then the pose is where the base is.
///
/// # Errors
/// Those of [`Base::stop`].
pub async fn come_to_rest(base: &mut Base, network: &Network) -> Result<(), BaseError> {
    base.stop().await?;
    let settled = network.now() + SETTLING;
    while network.now() < settled {
        base.cycle().await?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_a_twist_and_a_time_in_any_order_and_what_is_none_is_refused_with_the_form() {
        let twist = |linear_m_s, angular_rad_s| Twist { linear_m_s, angular_rad_s };
        let time = Duration::from_secs(3);
        for (line, expected) in [
            ("linear 0.3 angular -0.2 for 3s", twist(0.3, -0.2)),
            ("for 3s linear -0.3", twist(-0.3, 0.0)),
            ("angular 1 for 3s", twist(0.0, 1.0)),
        ] {
            assert_eq!(line.parse(), Ok(BaseDrive { twist: expected, time }), "{line}");
        }
        for (line, said) in [
            ("", "it needs a time, as in: for 3s"),
            ("linear 0.3", "it needs a time"),
            ("linear 0.3 for 0s", "a time above 0"),
            ("linear 0.3 for 3", "has no unit"),
            ("for 3s", "a speed in m/s"),
            ("linear for 3s", "expected a finite number"),
            ("linear inf for 3s", "expected a finite number"),
            ("linear 0.3 for", "'for' has no value"),
            (
                "linear 0.3 sideways 1 for 3s",
                "'sideways' is not a part of drive-base; expected: drive-base [linear M/S]",
            ),
        ] {
            let refused = line.parse::<BaseDrive>().err().unwrap_or_default();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}
