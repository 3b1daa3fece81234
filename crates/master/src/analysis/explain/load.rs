//! What the shaft does with all that: limits at work, a following error, a shaft that is held.

use cia402::{ModeOfOperation, Statusword};

use super::finding::{Finding, Topic, Weight, cause, warning};
use super::observed::Observed;

const TOPIC: Topic = Topic::Load;

/// A speed of less than this part of what was asked for, after its ramp, does not count.
const HELD_SHARE: f64 = 0.05;

/// A speed of more than this part of what was asked for is near it.
const REACHED_SHARE: f64 = 0.95;

/// A speed that changes by less than this between two looks is steady, r/min: more than the rounding of most objects, and less than
/// any ramp of more than some 5 (r/min)/s.
const STEADY_RPM: f64 = 0.5;

/// A current of more than this part of its limit may be at it.
const LIMITED_SHARE: f64 = 0.9;

/// Speeds below this are the rounding of the coarsest objects, r/min.
const LEAST_RPM: f64 = 1.0;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    if !seen.is_enabled() {
        return;
    }
    findings.extend(following_error(seen));
    findings.extend(internal_limit(seen));
    findings.extend(supply_limit(seen));
    let explained = findings.iter().any(|finding| finding.weight == Weight::Cause);
    findings.extend(held(seen).filter(|_| !explained));
}

/// Bit 13 in the position modes (CiA 402-2, 10.1 and 14.1).
fn following_error(seen: &Observed) -> Option<Finding> {
    let by_position =
        matches!(seen.mode?, ModeOfOperation::PROFILE_POSITION | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION);
    (by_position && seen.has_standard_bit(Statusword::FOLLOWING_ERROR)).then(|| {
        cause(
            TOPIC,
            "following_error",
            [
                "Statusword bit 13 (following error) is 0".to_owned(),
                format!("Bit 13 is 1{}", current(seen)),
                "The shaft does not keep up with the demand: 6065h and 6066h say how much and how long is allowed"
                    .to_owned(),
                "Look for a blocked or heavy load; make the ramps gentler; then the window, if it is too narrow"
                    .to_owned(),
            ],
        )
    })
}

fn internal_limit(seen: &Observed) -> Option<Finding> {
    seen.has_standard_bit(Statusword::INTERNAL_LIMIT_ACTIVE).then(|| {
        warning(
            TOPIC,
            "internal_limit",
            [
                "Statusword bit 11 (internal limit active) is 0".to_owned(),
                format!("Bit 11 is 1{}", current(seen)),
                "A limit of the drive holds its set-point back: position, speed, torque or current".to_owned(),
                "Compare target and limits (607Dh, 607Fh, 6080h, 6072h, 60E0h, 60E1h), and look for a heavy load"
                    .to_owned(),
            ],
        )
    })
}

/// Enabled, commanded to turn, and nothing found that prevents it: then the shaft is held.
fn held(seen: &Observed) -> Option<Finding> {
    let by_speed =
        matches!(seen.mode?, ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY);
    let (target, speed) = (seen.target_rpm.filter(|_| by_speed)?, seen.speed_rpm?);
    let least = (target.abs() * HELD_SHARE).max(LEAST_RPM);
    (target.abs() > LEAST_RPM && speed.abs() < least).then(|| {
        cause(
            TOPIC,
            "shaft_held",
            [
                format!("A speed near {target:.1} r/min"),
                format!("{speed:.1} r/min{}", current(seen)),
                "Nothing that the drive reports prevents it: its shaft is held, or its current does not suffice"
                    .to_owned(),
                "Look at the load, the brake, the motor's wires and the current limit".to_owned(),
            ],
        )
    })
}

/// A speed that stays below what was asked for with current to spare: there is no voltage left to drive it (the motor's own voltage,
/// which grows with the speed, has reached that of the bus).
fn supply_limit(seen: &Observed) -> Option<Finding> {
    let by_speed =
        matches!(seen.mode?, ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY);
    let (target, speed) = (seen.target_rpm.filter(|_| by_speed)?, seen.speed_rpm?);
    let (supply_v, current_a, limit_a) = (seen.supply_v?, seen.current_a?, seen.current_limit_a?);
    let asked = seen.speed_limit_rpm.map_or(target.abs(), |limit| target.abs().min(limit));
    let short = (target * speed > 0.0 && speed.abs() < asked * REACHED_SHARE)
        && speed.abs() > (asked * HELD_SHARE).max(LEAST_RPM)
        && seen.speed_change_rpm?.abs() < STEADY_RPM;
    let has_current = current_a.abs() < limit_a * LIMITED_SHARE;
    (short && has_current && !seen.has_standard_bit(Statusword::INTERNAL_LIMIT_ACTIVE)).then(|| {
        warning(
            TOPIC,
            "supply_limit",
            [
                format!("A speed near {:.1} r/min", target),
                format!("{speed:.1} r/min and steady, {supply_v:.1} V, {current_a:.2} A of {limit_a:.1} A"),
                "The current is not at its limit: the voltage of the supply limits the speed".to_owned(),
                format!("Ask for at most {:.0} r/min, or raise the supply within what the drive takes", speed.abs()),
            ],
        )
    })
}

fn current(seen: &Observed) -> String {
    seen.current_a.map_or_else(String::new, |amperes| format!(", motor current {amperes:.2} A"))
}
