//! 402-31 to 402-51: a drive by CiA 402-2 with the motor on. They need the leave to move; each move is a twentieth of a turn, or
//! a second at 20 r/min. Whatever a case comes to, the motor is stopped and let go after it.

use canopen::Mux;
use canopen::NmtCommand;
use cia402::{Controlword, ModeOfOperation, PowerCommand, PowerState, Statusword};

use super::cia402::transition;
use super::emcy::{TIME_MS, absent_node, beat, consume};
use crate::bench::{Bench, CHANGE, MOTION, ms};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const AXIS: Need = Need::Axis;
const STATES: Need = Need::PowerStates;
const MOTOR: Need = Need::Motion;
const PP: Need = Need::Mode(ModeOfOperation::PROFILE_POSITION);
const PV: Need = Need::Mode(ModeOfOperation::PROFILE_VELOCITY);

use PowerCommand::{DisableVoltage, EnableOperation, QuickStop, Shutdown, SwitchOn};
use PowerState::{OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("402-31", "Switch on leads to Switched on (transition 3)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, ReadyToSwitchOn, SwitchOn, SwitchedOn)),
    case!("402-32", "Enable operation leads to Operation enabled (transition 4)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, SwitchedOn, EnableOperation, OperationEnabled)),
    case!("402-33", "Disable operation leads to Switched on (transition 5)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, OperationEnabled, SwitchOn, SwitchedOn)),
    case!("402-34", "Shutdown leads to Ready to switch on (transition 6)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, SwitchedOn, Shutdown, ReadyToSwitchOn)),
    case!("402-35", "Shutdown leads to Ready to switch on (transition 8)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, OperationEnabled, Shutdown, ReadyToSwitchOn)),
    case!("402-36", "Disable voltage leads to Switch on disabled (transition 9)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, OperationEnabled, DisableVoltage, SwitchOnDisabled)),
    case!("402-37", "Disable voltage leads to Switch on disabled (transition 10)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, SwitchedOn, DisableVoltage, SwitchOnDisabled)),
    case!("402-38", "Quick stop leads to Switch on disabled (transition 10)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, SwitchedOn, QuickStop, SwitchOnDisabled)),
    case!("402-39", "Enable operation in Ready to switch on takes transitions 3 and 4", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR], [], |bench| transition(bench, ReadyToSwitchOn, EnableOperation, OperationEnabled)),
    case!("402-40", "Quick stop with 605Ah = 6 stays in Quick stop active (transition 11)", "CiA 402-2, 8.4.3", [AXIS, STATES, MOTOR, Need::Index(0x605A)], [], |bench| quick_stop(bench, Leaving::Stays)),
    case!("402-41", "Enable operation leaves Quick stop active (transition 16)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR, Need::Index(0x605A)], [], |bench| quick_stop(bench, Leaving::By(EnableOperation, OperationEnabled))),
    case!("402-42", "Disable voltage leaves Quick stop active (transition 12)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR, Need::Index(0x605A)], [], |bench| quick_stop(bench, Leaving::By(DisableVoltage, SwitchOnDisabled))),
    case!("402-43", "Quick stop with 605Ah = 2 ends in Switch on disabled (transition 12)", "CiA 402-2, 8.4.3", [AXIS, STATES, MOTOR, Need::Index(0x605A)], [], quick_stop_and_off),
    case!("402-44", "New set-point, acknowledged, reached, within its window", "CiA 402-2, 10.1", [AXIS, STATES, PP, MOTOR], ["new_set_point_clears_itself"], handshake),
    case!("402-45", "A relative move adds to the position", "CiA 402-2, 10.1", [AXIS, STATES, PP, MOTOR], ["new_set_point_clears_itself"], relative),
    case!("402-46", "Profile velocity turns with the sign of 60FFh", "CiA 402-2, 13.1", [AXIS, STATES, PV, MOTOR], [], velocity),
    case!("402-47", "Bit 10 in profile velocity: the target is reached", "CiA 402-2, 13.3", [AXIS, STATES, PV, MOTOR], [], velocity_reached),
    case!("402-48", "Halt stops, and goes on when it is taken back", "CiA 402-2, 8.4.1", [AXIS, STATES, PV, MOTOR], [], halt),
    case!("402-49", "A quick stop while it turns ends at standstill", "CiA 402-2, 8.4.3", [AXIS, STATES, PV, MOTOR], [], quick_stop_turning),
    case!("402-50", "A target beyond 607Dh is not gone to", "CiA 402-2, 10.2", [AXIS, STATES, PP, MOTOR, Need::Index(0x607D)], [], beyond_limit),
    case!("402-51", "A fault: its state, its code, and fault reset (transitions 13 to 15)", "CiA 402-2, 8.2", [AXIS, STATES, MOTOR, Need::Index(0x6007), Need::Index(0x1016)], [], fault),
];

/// How Quick stop active is left.
#[derive(Clone, Copy)]
enum Leaving {
    Stays,
    By(PowerCommand, PowerState),
}

async fn quick_stop(bench: &mut Bench, leaving: Leaving) -> Verdict {
    let option = bench.place(0x605A);
    bench.lead_to(SwitchOnDisabled).await?;
    if let Err(code) = bench.try_write(option, &6_i16.to_le_bytes()).await? {
        not_applicable!("605Ah does not take 6: {code}");
    }
    bench.lead_to(OperationEnabled).await?;
    bench.command(QuickStop).await?;
    bench.expect_power(QuickStopActive).await?;
    match leaving {
        Leaving::Stays => {
            bench.pause(ms(300)).await;
            bench.expect_power(QuickStopActive).await?;
            Ok("it stays in Quick stop active".into())
        }
        Leaving::By(command, state) => {
            bench.command(command).await?;
            let word = bench.expect_power(state).await?;
            Ok(format!("{} leads to {} ({:04X}h)", command.name(), state.name(), word.0))
        }
    }
}

async fn quick_stop_and_off(bench: &mut Bench) -> Verdict {
    bench.lead_to(SwitchOnDisabled).await?;
    if let Err(code) = bench.try_write(bench.place(0x605A), &2_i16.to_le_bytes()).await? {
        not_applicable!("605Ah does not take 2: {code}");
    }
    bench.lead_to(OperationEnabled).await?;
    bench.command(QuickStop).await?;
    let word = bench.expect_power(SwitchOnDisabled).await?;
    Ok(format!("{:04X}h", word.0))
}

const ENABLED: u16 = 0x000F;

async fn handshake(bench: &mut Bench) -> Verdict {
    bench.enable_in(ModeOfOperation::PROFILE_POSITION).await?;
    let (from, step) = (bench.position().await?, bench.small_step().await?);
    let target = from.wrapping_add(step);
    bench.set(0x607A, target).await?;
    bench.control(ENABLED | Controlword::NEW_SET_POINT).await?;
    let acknowledged = |word: Statusword| word.has(Statusword::SET_POINT_ACKNOWLEDGE);
    if let Err(word) = bench.until(CHANGE, acknowledged).await? {
        fail!("bit 4 of the controlword is set, and bit 12 of the statusword is not: {word}");
    }
    bench.control(ENABLED).await?;
    if let Err(word) = bench.until(CHANGE, |word| !acknowledged(word)).await? {
        fail!("bit 4 of the controlword is clear again, and bit 12 of the statusword is not: {word}");
    }
    if let Err(word) = bench.until(MOTION, |word| word.has(Statusword::TARGET_REACHED)).await? {
        fail!("the target is not reached within {} s: {word}", MOTION.as_secs());
    }
    near(bench, target, step).await
}

async fn near(bench: &mut Bench, target: i32, step: i32) -> Verdict {
    let at = bench.position().await?;
    let off = at.wrapping_sub(target).abs();
    // A tenth of the way, where the device has no window that is narrower.
    if off > step.abs() / 10 + 5 {
        fail!("bit 10 says reached, and 6064h is {off} counts from the target of {step} counts");
    }
    Ok(format!("{step} counts, {off} off"))
}

async fn relative(bench: &mut Bench) -> Verdict {
    bench.enable_in(ModeOfOperation::PROFILE_POSITION).await?;
    let (from, step) = (bench.position().await?, bench.small_step().await?);
    bench.set(0x607A, step).await?;
    bench.control(ENABLED | Controlword::RELATIVE).await?;
    bench.control(ENABLED | Controlword::RELATIVE | Controlword::NEW_SET_POINT).await?;
    bench.until(CHANGE, |word| word.has(Statusword::SET_POINT_ACKNOWLEDGE)).await?.ok();
    bench.control(ENABLED | Controlword::RELATIVE).await?;
    bench.pause(ms(20)).await;
    if let Err(word) = bench.until(MOTION, |word| word.has(Statusword::TARGET_REACHED)).await? {
        fail!("the target is not reached within {} s: {word}", MOTION.as_secs());
    }
    near(bench, from.wrapping_add(step), step).await
}

/// It turns at a small speed.
async fn turning(bench: &mut Bench, sign: i32) -> Result<i32, Finding> {
    bench.enable_in(ModeOfOperation::PROFILE_VELOCITY).await?;
    let target = bench.slow().await? * sign;
    bench.set(0x60FF, target).await?;
    Ok(target)
}

async fn velocity(bench: &mut Bench) -> Verdict {
    for sign in [1, -1] {
        let target = turning(bench, sign).await?;
        bench.pause(ms(500)).await;
        let travel = bench.travel(ms(300)).await?;
        if travel.signum() != sign {
            fail!("60FFh is {target}, and 6064h changes by {travel} in 300 ms");
        }
        let actual = bench.number(bench.place(0x606C)).await?;
        if actual.signum() != i64::from(sign) {
            fail!("60FFh is {target}, and 606Ch is {actual}");
        }
        bench.set(0x60FF, 0).await?;
        bench.expect_standstill().await?;
    }
    Ok("both directions; 606Ch has the sign".into())
}

async fn velocity_reached(bench: &mut Bench) -> Verdict {
    turning(bench, 1).await?;
    match bench.until(MOTION, |word| word.has(Statusword::TARGET_REACHED) && !word.has(Statusword::SPEED)).await? {
        Ok(word) => Ok(format!("{:04X}h", word.0)),
        Err(word) => fail!(
            "bit 10 (target reached) is not set within {} s, or bit 12 (speed is 0) not clear: {word}",
            MOTION.as_secs()
        ),
    }
}

async fn halt(bench: &mut Bench) -> Verdict {
    turning(bench, 1).await?;
    bench.pause(ms(500)).await;
    bench.control(ENABLED | Controlword::HALT).await?;
    bench.expect_standstill().await?;
    bench.expect_power(OperationEnabled).await?;
    bench.control(ENABLED).await?;
    bench.pause(ms(500)).await;
    let travel = bench.travel(ms(300)).await?;
    if travel <= 0 {
        fail!("halt was taken back, and 6064h changes by {travel} in 300 ms");
    }
    Ok("it stands, stays enabled, and turns again".into())
}

async fn quick_stop_turning(bench: &mut Bench) -> Verdict {
    turning(bench, 1).await?;
    bench.pause(ms(500)).await;
    bench.command(QuickStop).await?;
    let left = |word: Statusword| word.state() != Some(OperationEnabled);
    if let Err(word) = bench.until(CHANGE, left).await? {
        fail!("after a quick stop the statusword is {word}");
    }
    bench.expect_standstill().await?;
    Ok("it stands".into())
}

async fn beyond_limit(bench: &mut Bench) -> Verdict {
    bench.lead_to(SwitchOnDisabled).await?;
    let (from, step) = (bench.position().await?, bench.small_step().await?);
    for (sub_index, limit) in [(1, from.wrapping_sub(step)), (2, from.wrapping_add(step))] {
        bench.write(bench.place_sub(0x607D, sub_index), &limit.to_le_bytes()).await?;
    }
    bench.enable_in(ModeOfOperation::PROFILE_POSITION).await?;
    let answer = bench.try_write(bench.place(0x607A), &from.wrapping_add(step * 3).to_le_bytes()).await?;
    if let Err(code) = answer {
        return Ok(format!("the target is refused: {code}"));
    }
    bench.control(ENABLED | Controlword::NEW_SET_POINT).await?;
    bench.pause(ms(1500)).await;
    bench.control(ENABLED).await?;
    let travel = bench.position().await?.wrapping_sub(from);
    if travel > step + step / 10 + 5 {
        fail!("607Dh allows {step} counts, and it went {travel}");
    }
    Ok(format!("607Dh allows {step} counts, and it went {travel}"))
}

async fn fault(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    bench.lead_to(SwitchOnDisabled).await?;
    // 1: a lost connection is a malfunction.
    if let Err(code) = bench.try_write(bench.place(0x6007), &1_i16.to_le_bytes()).await? {
        not_applicable!("6007h does not take 1: {code}");
    }
    bench.lead_to(OperationEnabled).await?;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    beat(bench, producer).await;
    bench.pause(ms(u64::from(TIME_MS))).await;
    bench.expect_power(PowerState::Fault).await?;
    let code = bench.number(bench.place(0x603F)).await?;
    let register = bench.number(Mux::new(0x1001, 0)).await?;
    if code == 0 || register & 1 == 0 {
        fail!("in Fault 603Fh is {code:04X}h and 1001h {register:02X}h");
    }
    bench.put_back().await?;
    bench.control(0).await?;
    bench.command(PowerCommand::FaultReset).await?;
    let word = bench.expect_power(SwitchOnDisabled).await?;
    Ok(format!("603Fh {code:04X}h; reset to {:04X}h", word.0))
}
