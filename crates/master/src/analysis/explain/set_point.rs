//! What an enabled drive that stands still is commanded to do (CiA 402-2, the clauses of its modes).

use canopen::Mux;
use cia402::object::{
    MAX_CURRENT, MAX_MOTOR_SPEED, MAX_POSITION_LIMIT, MAX_PROFILE_VELOCITY, MAX_TORQUE, MIN_POSITION_LIMIT,
    NEGATIVE_TORQUE_LIMIT_VALUE, POSITION_ACTUAL_VALUE, POSITION_WINDOW, POSITIVE_TORQUE_LIMIT_VALUE,
    PROFILE_ACCELERATION, PROFILE_VELOCITY, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY, VL_TARGET_VELOCITY,
};
use cia402::{Controlword, ModeOfOperation, Statusword};
use devices::{HomingStart, HostWatch, NewSetPoint};

use super::finding::{Finding, Topic, cause};
use super::observed::Observed;

const TOPIC: Topic = Topic::SetPoint;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    let Some(mode) = seen.mode.filter(|_| seen.is_enabled() && !seen.turns() && !seen.follows_speed()) else { return };
    findings.extend(halt(seen, mode));
    match mode {
        ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => {
            let zero = zero(seen, "target_zero", target_velocity(seen), "A speed to turn at");
            findings.extend(zero.map(|finding| or_by_host_watch(seen, finding)));
            findings.extend(seen.target_rpm.and_then(|target_rpm| at_software_limit(seen, target_rpm)));
        }
        ModeOfOperation::VELOCITY => {
            findings.extend(zero(seen, "target_zero", seen.place(VL_TARGET_VELOCITY), "A speed to turn at"));
            findings.extend(ramp_held(seen));
        }
        ModeOfOperation::PROFILE_TORQUE | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE => {
            let zero = zero(seen, "target_zero", target_torque(seen), "A torque");
            findings.extend(zero.map(|finding| or_by_host_watch(seen, finding)));
        }
        ModeOfOperation::PROFILE_POSITION => {
            let own = seen.axis.and_then(|axis| axis.units.profile_velocity).map(|quantity| quantity.object);
            let object = own.unwrap_or_else(|| seen.place(PROFILE_VELOCITY));
            // What keeps it from getting there comes first: without it the start bit decides nothing, nor what bits 10 and 12 say of it.
            let no_speed = zero(seen, "profile_velocity_zero", object, "A speed for the way to the target");
            findings.extend(no_speed);
            findings.extend(software_limit(seen));
            limits(seen, mode, findings);
            if findings.iter().all(|finding| finding.topic != TOPIC) {
                findings.extend(position(seen));
            }
            return ramps(seen, mode, findings);
        }
        ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => findings.extend(software_limit(seen)),
        ModeOfOperation::HOMING => findings.extend(homing(seen)),
        _ => {}
    }
    limits(seen, mode, findings);
    ramps(seen, mode, findings);
}

/// Where the speed to turn at is.
pub(super) fn target_velocity(seen: &Observed) -> Mux {
    let own = seen.axis.and_then(|axis| axis.units.target_velocity).map(|quantity| quantity.object);
    own.unwrap_or_else(|| seen.place(TARGET_VELOCITY))
}

fn target_torque(seen: &Observed) -> Mux {
    let own = seen.axis.and_then(|axis| axis.units.target_current).map(|quantity| quantity.object);
    own.unwrap_or_else(|| seen.place(TARGET_TORQUE))
}

/// An object that has to be something else than 0.
fn zero(seen: &Observed, rule: &'static str, object: Mux, expected: &str) -> Option<Finding> {
    (seen.value(object)? == 0).then(|| {
        cause(
            TOPIC,
            rule,
            [
                format!("{expected} in {}", seen.named(object)),
                "It is 0".to_owned(),
                "The drive stands because it is commanded to".to_owned(),
                format!("Write {object}, by SDO or in the RPDO that carries it"),
            ],
        )
    })
}

/// A drive that is stopped by its watch for silence stays enabled, has no fault and sets its target to 0: a host that has written that
/// looks the same.
fn or_by_host_watch(seen: &Observed, finding: Finding) -> Finding {
    let watch = seen.description.map(|description| description.host_watch);
    let Some(HostWatch::Silence { time }) = watch else { return finding };
    let Some(limit) = seen.value(time).filter(|limit| *limit > 0) else { return finding };
    let (watch, before) = (seen.named(time), &finding.remedy);
    Finding {
        follows: format!(
            "Its host has commanded it to stand, or has fallen silent for {limit} ms: by its watch ({watch}) it then stops and sets the \
             target to 0 by itself. Which of the two does not show"
        ),
        remedy: format!(
            "{before}; and send it something more often than each {limit} ms (a read of its statusword), as ferrodrive does while it \
             moves it"
        ),
        ..finding
    }
}

/// Controlword bits 4 to 6 of velocity mode: the ramp leads nowhere without them.
fn ramp_held(seen: &Observed) -> Option<Finding> {
    const RAMP: u16 = Controlword::ENABLE_RAMP | Controlword::UNLOCK_RAMP | Controlword::REFERENCE_RAMP;
    let controlword = seen.controlword()?;
    (controlword.0 & RAMP != RAMP).then(|| {
        cause(
            TOPIC,
            "ramp_held",
            [
                "Controlword bits 4 to 6 (ramp enabled, unlocked, with its target) are 1".to_owned(),
                format!("Controlword {controlword}"),
                "In velocity mode (2) the speed stays as it is, or goes to 0, while one of them is 0".to_owned(),
                "Write 7Fh to 6040h".to_owned(),
            ],
        )
    })
}

/// Controlword bit 8, in the modes that have it (CiA 402-2, 8.4.1).
fn halt(seen: &Observed, mode: ModeOfOperation) -> Option<Finding> {
    let controlword = seen.controlword()?;
    let heeds = matches!(mode.0, 1 | 3 | 4 | 6) && seen.style == devices::PowerStyle::Cia402;
    (heeds && controlword.has(Controlword::HALT)).then(|| {
        cause(
            TOPIC,
            "halt",
            [
                "Controlword bit 8 (halt) is 0".to_owned(),
                format!("Controlword {controlword}"),
                "The axis is halted and stays so until the bit is cleared".to_owned(),
                "Write the controlword without bit 8".to_owned(),
            ],
        )
    })
}

/// Profile position: is there a way to go, and was it started?
fn position(seen: &Observed) -> Option<Finding> {
    let (target, at) = (seen.axis_value(TARGET_POSITION)?, seen.axis_value(POSITION_ACTUAL_VALUE)?);
    let (controlword, statusword) = (seen.controlword()?, seen.statusword?);
    let relative = controlword.has(Controlword::RELATIVE);
    let window = seen.axis_value(POSITION_WINDOW).filter(|window| *window < i64::from(u32::MAX)).unwrap_or(0).max(1);
    let object = seen.named(seen.place(TARGET_POSITION));
    let reached = statusword.has(Statusword::TARGET_REACHED);
    let found = format!("Target {target}, position {at} counts, controlword {controlword}, statusword {statusword}");
    if relative && reached {
        return Some(relative_reached(seen, &object, found));
    }
    if !relative && target.abs_diff(at) <= window as u64 {
        return Some(at_target(seen, &object, format!("Target {target}, position {at} counts")));
    }
    let handshake = seen.axis.is_none_or(|axis| axis.new_set_point == NewSetPoint::Handshake);
    let asked = controlword.has(Controlword::NEW_SET_POINT);
    // Bit 12 is 1 as long as bit 4 is, also on the way: it speaks for an edge that is missing only where nothing is left to be done.
    if handshake && asked && reached && statusword.has(Statusword::SET_POINT_ACKNOWLEDGE) {
        return Some(cause(
            TOPIC,
            "start_bit_left_set",
            [
                "Controlword bit 4 rises for each new target (CiA 402-2, 10.1)".to_owned(),
                found,
                "Bit 4 is still set from the target before: the one in 607Ah was never taken".to_owned(),
                "Clear bit 4, wait until statusword bit 12 is 0, then set it again".to_owned(),
            ],
        ));
    }
    (!asked && reached).then(|| {
        cause(
            TOPIC,
            "set_point_not_started",
            [
                "A 1 in controlword bit 4 after the target was written".to_owned(),
                found,
                "The target is in 607Ah and no move to it was started".to_owned(),
                format!(
                    "If the shaft is to turn to this target now, write the controlword with bit 4, 1Fh; or give the target anew: \
                     ferrodrive move {} POSITION",
                    seen.node
                ),
            ],
        )
    })
}

/// The position of a stepper without an encoder is that of its steps, whether its shaft has followed them or not.
fn at_target(seen: &Observed, object: &str, found: String) -> Finding {
    let (is, next) = match seen.axis.and_then(|axis| axis.open_loop.as_ref()) {
        None => ("The drive is where it is commanded to be", ""),
        Some(_) => (
            "The drive has made the steps to it; it has no encoder, and does not notice steps that its shaft has lost",
            "; if the shaft is elsewhere, it has lost steps: home it, and give it a softer ramp or more current",
        ),
    };
    cause(
        TOPIC,
        "at_target",
        [
            format!("A target elsewhere in {object}"),
            found,
            is.to_owned(),
            format!("Write another target, then start it with controlword bit 4{next}"),
        ],
    )
}

/// After a relative move 607Ah still has its distance: whether that has been gone or is yet to be started does not show, and to start it
/// would go it a second time.
fn relative_reached(seen: &Observed, object: &str, found: String) -> Finding {
    cause(
        TOPIC,
        "at_target",
        [
            format!("A relative move (controlword bit 6) under way: the distance is in {object}"),
            found,
            "The move that was started last is done (statusword bit 10), and the drive stands where that has led it"
                .to_owned(),
            format!(
                "For a further move give its distance: ferrodrive move {} --relative DISTANCE. To start what is in 607Ah moves the shaft \
                 by that once more, if it has been gone already",
                seen.node
            ),
        ],
    )
}

/// 607Dh (CiA 402-2, 10.4). No limits where the lower one is not below the upper one.
fn software_limit(seen: &Observed) -> Option<Finding> {
    let (low, high) = (seen.axis_value(MIN_POSITION_LIMIT)?, seen.axis_value(MAX_POSITION_LIMIT)?);
    let target = seen.axis_value(TARGET_POSITION)?;
    // The limits are for positions, and this is a distance.
    if seen.controlword().is_some_and(|controlword| controlword.has(Controlword::RELATIVE)) {
        return at_software_limit(seen, target as f64);
    }
    (low < high && !(low..=high).contains(&target)).then(|| {
        cause(
            TOPIC,
            "software_limit",
            [
                format!("A target from {low} to {high} counts (607Dh)"),
                format!("Target {target}"),
                "The drive stops at the limit, or does not start".to_owned(),
                "Choose a target within the limits, or write 607Dh when the machine allows more".to_owned(),
            ],
        )
    })
}

/// The drive stands at the end of 607Dh to which it is asked to turn: no load holds it.
fn at_software_limit(seen: &Observed, heading: f64) -> Option<Finding> {
    let (low, high) = (seen.axis_value(MIN_POSITION_LIMIT)?, seen.axis_value(MAX_POSITION_LIMIT)?);
    let at = seen.axis_value(POSITION_ACTUAL_VALUE)?;
    // A shaft that has been stopped there swings about it a little.
    let near = high.checked_sub(low).filter(|span| *span > 0)? / 1000;
    let (end, object) = match heading {
        ..0.0 if at <= low + near => (low, MIN_POSITION_LIMIT),
        0.0.. if heading > 0.0 && at >= high - near => (high, MAX_POSITION_LIMIT),
        _ => return None,
    };
    if end.abs() >= i64::from(i32::MAX) {
        return None;
    }
    Some(cause(
        TOPIC,
        "software_limit",
        [
            format!("A position from {low} to {high} counts (607Dh) with way left in the direction that is asked for"),
            format!("Position {at}; its end there is {end} ({})", seen.place(object)),
            "The drive does not turn beyond its software limits".to_owned(),
            "Turn it the other way, or write 607Dh when the machine allows more".to_owned(),
        ],
    ))
}

/// Mode 6, by the model's own bits.
fn homing(seen: &Observed) -> Option<Finding> {
    let (rules, statusword) = (seen.axis?.homing?, seen.statusword?);
    let method = seen.value(rules.method).map_or_else(String::new, |method| format!(", method {method}"));
    if rules.failed.matches(statusword) {
        return Some(cause(
            TOPIC,
            "homing_failed",
            [
                "The reference is found".to_owned(),
                format!("Statusword {statusword}: homing has failed{method}"),
                "The drive does not know where it is".to_owned(),
                "Check the switch of the method, its wiring and its input's function, and the direction of the search"
                    .to_owned(),
            ],
        ));
    }
    let controlword = seen.controlword()?;
    let by_bit = rules.start == HomingStart::ControlwordBit4;
    let waits = by_bit && !controlword.has(Controlword::NEW_SET_POINT) && !rules.attained.matches(statusword);
    waits.then(|| {
        cause(
            TOPIC,
            "homing_not_started",
            [
                "Controlword bit 4 rises in mode 6 (CiA 402-2, 11.1)".to_owned(),
                format!("Controlword {controlword}{method}"),
                "The drive is ready to look for its reference and the search was not started".to_owned(),
                format!("Write the controlword with bit 4: 1Fh; or: ferrodrive home {} --method N", seen.node),
            ],
        )
    })
}

/// Limits of 0, by the model's rows where it is known ([`canopen::od::Entry::held_to`]), else by the standard.
fn limits(seen: &Observed, mode: ModeOfOperation, findings: &mut Vec<Finding>) {
    let held_to = seen.row(target_velocity(seen)).and_then(|row| row.held_to).map(|held| held.object);
    let speed = [MAX_PROFILE_VELOCITY, MAX_MOTOR_SPEED].map(|mux| seen.place(mux));
    let torque =
        [MAX_TORQUE, MAX_CURRENT, POSITIVE_TORQUE_LIMIT_VALUE, NEGATIVE_TORQUE_LIMIT_VALUE].map(|mux| seen.place(mux));
    let by_speed = matches!(mode.0, 1 | 3 | 9);
    let rows = speed.into_iter().chain(held_to).filter(|_| by_speed).map(|object| ("speed_limit_zero", object));
    let mut zero = Vec::new();
    for (rule, object) in rows.chain(torque.map(|object| ("torque_limit_zero", object))) {
        if seen.value(object) == Some(0) && !zero.contains(&object) {
            zero.push(object);
            findings.push(cause(
                TOPIC,
                rule,
                [
                    format!("A limit above 0 in {}", seen.named(object)),
                    "It is 0".to_owned(),
                    "The limit holds every set-point at 0".to_owned(),
                    format!("Write {object}: what the motor and the machine can take"),
                ],
            ));
        }
    }
}

/// A speed that may not change stays 0.
fn ramps(seen: &Observed, mode: ModeOfOperation, findings: &mut Vec<Finding>) {
    if !matches!(mode.0, 1 | 3) {
        return;
    }
    let standard = seen.place(PROFILE_ACCELERATION);
    let unknown = (seen.axis.is_none() && seen.value(standard) == Some(0)).then_some(standard);
    for object in seen.rates_of_zero.iter().copied().chain(unknown) {
        findings.push(cause(
            TOPIC,
            "ramp_zero",
            [
                format!("A rate above 0 in {}", seen.named(object)),
                "It is 0".to_owned(),
                "The speed may not change: many drives do not move so".to_owned(),
                format!("Write the permitted rate of change of its speed to {object}"),
            ],
        ));
    }
}
