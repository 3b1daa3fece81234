//! 402-01 to 402-23: a drive by CiA 402-2 with the motor off: its states, modes, option codes and limits.

use canopen::od::{DataType, Entry};
use canopen::{AbortCode, Mux};
use cia402::{ModeOfOperation, PowerCommand, PowerState, Statusword};

use devices::{AxisDescription, HomingStart};

use crate::bench::{Bench, CHANGE, hex, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};
use crate::subject::bytes_of;

const STATES: Need = Need::PowerStates;
const AXIS: Need = Need::Axis;

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("402-01", "The statusword shows a state of the standard", "CiA 402-2, 8.4.2", [AXIS, STATES], ["echoes_controlword"], shows_state),
    case!("402-02", "Shutdown leads to Ready to switch on (transition 2)", "CiA 402-2, 8.2", [AXIS, STATES], [], |bench| transition(bench, PowerState::SwitchOnDisabled, PowerCommand::Shutdown, PowerState::ReadyToSwitchOn)),
    case!("402-03", "Disable voltage leads to Switch on disabled (transition 7)", "CiA 402-2, 8.2", [AXIS, STATES], [], |bench| transition(bench, PowerState::ReadyToSwitchOn, PowerCommand::DisableVoltage, PowerState::SwitchOnDisabled)),
    case!("402-04", "Quick stop leads to Switch on disabled (transition 7)", "CiA 402-2, 8.2", [AXIS, STATES], [], |bench| transition(bench, PowerState::ReadyToSwitchOn, PowerCommand::QuickStop, PowerState::SwitchOnDisabled)),
    case!("402-05", "Enable operation does nothing in Switch on disabled", "CiA 402-2, 8.2", [AXIS, STATES, Need::Motion], [], |bench| transition(bench, PowerState::SwitchOnDisabled, PowerCommand::EnableOperation, PowerState::SwitchOnDisabled)),
    case!("402-06", "Fault reset without a fault does nothing", "CiA 402-2, 8.2", [AXIS, STATES], [], |bench| transition(bench, PowerState::SwitchOnDisabled, PowerCommand::FaultReset, PowerState::SwitchOnDisabled)),
    case!("402-07", "Bits of the statusword with the motor off", "CiA 402-2, 8.4.2", [AXIS, STATES], ["status_bit"], resting_bits),
    case!("402-08", "6041h can be read only, 6040h takes what 6041h follows", "CiA 402-2, 8.4.1", [AXIS], ["other_access"], words),
    case!("402-09", "6061h follows 6060h, for each mode", "CiA 402-2, 8.4.7", [AXIS], ["no_mode_display", "homing_starts_with_mode"], modes),
    case!("402-10", "A mode that is not supported does not become active", "CiA 402-2, 8.4.6", [AXIS], ["no_mode_display"], unsupported_mode),
    case!("402-11", "6502h has the modes that are taken", "CiA 402-2, 8.4.14", [AXIS, Need::Index(0x6502)], [], supported_modes),
    case!("402-12", "Option code 605Ah: its values are taken, reserved ones refused", "CiA 402-2, 8.4.3", [AXIS, Need::Index(0x605A)], [], |bench| option_code(bench, 0x605A, 9)),
    case!("402-13", "Option code 605Bh: its values are taken, reserved ones refused", "CiA 402-2, 8.4.3", [AXIS, Need::Index(0x605B)], [], |bench| option_code(bench, 0x605B, 2)),
    case!("402-14", "Option code 605Ch: its values are taken, reserved ones refused", "CiA 402-2, 8.4.3", [AXIS, Need::Index(0x605C)], [], |bench| option_code(bench, 0x605C, 2)),
    case!("402-15", "Option code 605Dh: its values are taken, reserved ones refused", "CiA 402-2, 8.4.3", [AXIS, Need::Index(0x605D)], [], |bench| option_code(bench, 0x605D, 5)),
    case!("402-16", "Option code 605Eh: its values are taken, reserved ones refused", "CiA 402-2, 8.4.3", [AXIS, Need::Index(0x605E)], [], |bench| option_code(bench, 0x605E, 5)),
    case!("402-17", "603Fh, 1001h and the state agree on whether there is a fault", "CiA 402-2, 8.4.5", [AXIS, STATES, Need::Index(0x603F)], [], error_code),
    case!("402-18", "Velocities and ramps of profiles read back as written", "CiA 402-2, 10.2", [AXIS], ["ramps_are_times"], profile_values),
    case!("402-19", "607Dh reads back as written", "CiA 402-2, 10.2", [AXIS, Need::Index(0x607D)], [], software_limits),
    case!("402-20", "Target and actual position have the same type", "CiA 402-2, 10.2", [AXIS, Need::Index(0x607A), Need::Index(0x6064)], ["other_type"], types),
    case!("402-21", "Factors of units read back as written, and refuse 0", "CiA 402-2, 8.5", [AXIS, Need::Index(0x6091)], [], factors),
    case!("402-22", "The state stays through reset communication", "CiA 402-2, 8.2", [AXIS, STATES], [], after_reset),
    case!("402-23", "The motor stands still", "CiA 402-2, 8.2", [AXIS, Need::Index(0x6064)], [], stands),
];

async fn shows_state(bench: &mut Bench) -> Verdict {
    let word = bench.statusword().await?;
    match word.state() {
        Some(state) => Ok(format!("{:04X}h: {}", word.0, state.name())),
        None => fail!("{:04X}h shows none of the eight states", word.0),
    }
}

pub(super) async fn transition(bench: &mut Bench, from: PowerState, command: PowerCommand, to: PowerState) -> Verdict {
    bench.lead_to(from).await?;
    bench.command(command).await?;
    if from == to {
        // Nothing may happen: time for it to happen.
        bench.pause(crate::bench::SILENCE).await;
    }
    let word = bench.expect_power(to).await?;
    Ok(format!("{} in {} leads to {} ({:04X}h)", command.name(), from.name(), to.name(), word.0))
}

async fn resting_bits(bench: &mut Bench) -> Verdict {
    bench.lead_to(PowerState::SwitchOnDisabled).await?;
    let word = bench.statusword().await?;
    if !word.has(Statusword::REMOTE) {
        fail!("{:04X}h: bit 9 (remote) is not set though the controlword is followed", word.0);
    }
    if word.has(Statusword::FAULT) || word.0 & 0x07 != 0 {
        fail!("{:04X}h: bits 0 to 3 are not those of Switch on disabled", word.0);
    }
    bench.lead_to(PowerState::ReadyToSwitchOn).await?;
    let word = bench.statusword().await?;
    if !word.has(Statusword::QUICK_STOP) {
        fail!("{:04X}h: bit 5 (no quick stop) is not set in Ready to switch on", word.0);
    }
    Ok(format!("{:04X}h in Ready to switch on", word.0))
}

async fn words(bench: &mut Bench) -> Verdict {
    let status = bench.place(0x6041);
    let data = bench.read(status).await?;
    let codes = [AbortCode::READ_ONLY, AbortCode::UNSUPPORTED_ACCESS, AbortCode::GENERAL];
    let answer = bench.download(status, &data).await?;
    refused("write of 6041h", &answer, &codes)
}

async fn modes(bench: &mut Bench) -> Verdict {
    let axis = bench.axis()?;
    if axis.mode_display == bench.place(0x6060) {
        fail!("there is no 6061h");
    }
    let mut seen = Vec::new();
    for mode in axis.modes.iter().filter(|mode| **mode != ModeOfOperation::NONE && !moves(axis, **mode)) {
        bench.choose(*mode).await?;
        seen.push(mode.0.to_string());
    }
    Ok(format!("modes {}", seen.join(", ")))
}

/// The choice of this mode is what starts a motion.
fn moves(axis: &AxisDescription, mode: ModeOfOperation) -> bool {
    mode == ModeOfOperation::HOMING && axis.homing.is_some_and(|rules| rules.start == HomingStart::ModeWrite)
}

async fn unsupported_mode(bench: &mut Bench) -> Verdict {
    let axis = bench.axis()?;
    let all = [1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 5].map(ModeOfOperation);
    let Some(mode) = all.into_iter().find(|mode| !axis.modes.contains(mode)) else {
        not_applicable!("every mode is supported")
    };
    let answer = bench.try_write(bench.place(0x6060), &[mode.0 as u8]).await?;
    bench.pause(crate::bench::SILENCE).await;
    let shown = bench.number(axis.mode_display).await?;
    if shown == i64::from(mode.0) {
        fail!("{} shows mode {}, which is not among those of the description", axis.mode_display, mode.0);
    }
    Ok(match answer {
        Err(code) => format!("mode {} is refused: {code}", mode.0),
        Ok(()) => format!("mode {} is taken and does not become active", mode.0),
    })
}

async fn supported_modes(bench: &mut Bench) -> Verdict {
    let axis = bench.axis()?;
    let says = bench.number(bench.place(0x6502)).await? as u32;
    let standard = axis.modes.iter().filter(|mode| (1..=10).contains(&mode.0));
    let described = standard.fold(0, |bits, mode| bits | 1 << (mode.0 - 1));
    if says & 0x3FF != described {
        fail!("6502h is {says:08X}h; the modes of the description are {described:08X}h");
    }
    let starts = |mode: u8| moves(axis, ModeOfOperation(mode as i8));
    for mode in (1..=10).filter(|mode| says >> (mode - 1) & 1 == 1 && !starts(*mode)) {
        if let Err(code) = bench.try_write(bench.place(0x6060), &[mode]).await? {
            fail!("6502h has mode {mode}, and 6060h refuses it: {code}");
        }
    }
    Ok(format!("{says:08X}h"))
}

async fn option_code(bench: &mut Bench, index: u16, reserved: i16) -> Verdict {
    let mux = bench.place(index);
    let Some(row) = bench.subject.description.row(mux) else { not_applicable!("the drive has no {mux}") };
    if !row.access.is_writable() {
        not_applicable!("the description has {mux} as read only");
    }
    let mut taken = Vec::new();
    for (value, _) in row.values {
        let data = bytes_of(row.data_type, *value);
        bench.write(mux, &data).await?;
        if bench.read(mux).await? != data {
            fail!("{mux} took {value} and reads otherwise");
        }
        taken.push(value.to_string());
    }
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::GENERAL];
    let answer = bench.try_write(mux, &reserved.to_le_bytes()).await?;
    refused(&format!("the reserved value {reserved} for {mux}"), &answer, &codes)?;
    Ok(format!("{} taken, {reserved} refused", if taken.is_empty() { "none listed".into() } else { taken.join(", ") }))
}

async fn error_code(bench: &mut Bench) -> Verdict {
    let word = bench.statusword().await?;
    let code = bench.number(bench.place(0x603F)).await?;
    let register = bench.number(Mux::new(0x1001, 0)).await?;
    let fault = word.has(Statusword::FAULT);
    if fault && code == 0 {
        fail!("the statusword is {word}, and 603Fh is 0");
    }
    if fault && register & 1 == 0 {
        fail!("the statusword is {word}, and bit 0 of 1001h is not set");
    }
    if !fault && register & 1 == 1 && code == 0 {
        not_applicable!("1001h reports an error that is not a fault of the axis");
    }
    Ok(format!("statusword {:04X}h, 603Fh {code:04X}h, 1001h {register:02X}h", word.0))
}

/// Writes another value within the limits of each of these objects that is there.
async fn read_back(bench: &mut Bench, indexes: &[u16]) -> Result<Vec<String>, Finding> {
    let mut seen = Vec::new();
    for index in indexes {
        let mux = bench.place(*index);
        let Some(row) = bench.subject.description.row(mux).filter(|row| row.access.is_writable()) else { continue };
        let before = bench.number(mux).await?;
        let Some(value) = smaller(row, before) else { continue };
        let data = bytes_of(row.data_type, value);
        if let Err(AbortCode::DEVICE_STATE) = bench.try_write(mux, &data).await? {
            continue;
        }
        let after = bench.read(mux).await?;
        if after != data {
            fail!("{mux} was written with {} and reads as {}", hex(&data), hex(&after));
        }
        seen.push(format!("{index:04X}h"));
    }
    Ok(seen)
}

fn smaller(row: &Entry, before: i64) -> Option<i64> {
    crate::bench::another(row, before)
}

async fn profile_values(bench: &mut Bench) -> Verdict {
    let seen = read_back(bench, &[0x6081, 0x6083, 0x6084, 0x6085, 0x6087, 0x609A]).await?;
    if seen.is_empty() {
        not_applicable!("the drive has no parameter of a profile that can be written");
    }
    Ok(seen.join(", "))
}

async fn software_limits(bench: &mut Bench) -> Verdict {
    for (sub_index, value) in [(1, -1_000_000_i32), (2, 1_000_000)] {
        let mux = bench.place_sub(0x607D, sub_index);
        bench.write(mux, &value.to_le_bytes()).await?;
        let says = bench.number(mux).await?;
        if says != i64::from(value) {
            fail!("{mux} was written with {value} and reads as {says}");
        }
    }
    Ok("-1000000 and 1000000".into())
}

async fn types(bench: &mut Bench) -> Verdict {
    for index in [0x607A, 0x6064] {
        let mux = bench.place(index);
        let data = bench.read(mux).await?;
        if data.len() != DataType::Integer32.size() {
            fail!("{mux} has {} bytes; INTEGER32 has 4", data.len());
        }
    }
    Ok("four bytes each".into())
}

async fn factors(bench: &mut Bench) -> Verdict {
    let codes =
        [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_LOW, AbortCode::PARAMETER_INCOMPATIBLE, AbortCode::GENERAL];
    for sub_index in [1, 2] {
        let mux = bench.place_sub(0x6091, sub_index);
        if bench.subject.description.row(mux).is_none_or(|row| !row.access.is_writable()) {
            continue;
        }
        let answer = bench.try_write(mux, &[0; 4]).await?;
        refused(&format!("0 for {mux}"), &answer, &codes)?;
        let before = bench.read(mux).await?;
        bench.write(mux, &7_u32.to_le_bytes()).await?;
        let says = bench.number(mux).await?;
        if says != 7 {
            fail!("{mux} was written with 7 and reads as {says}");
        }
        bench.write(mux, &before).await?;
    }
    Ok("a gear of 7 is taken, 0 refused".into())
}

async fn after_reset(bench: &mut Bench) -> Verdict {
    bench.lead_to(PowerState::SwitchOnDisabled).await?;
    bench.reset(canopen::NmtCommand::ResetCommunication).await?;
    match bench.until(CHANGE, |word| word.state() == Some(PowerState::SwitchOnDisabled)).await? {
        Ok(word) => Ok(format!("{:04X}h", word.0)),
        Err(word) => fail!("after reset communication the statusword is {word}; expected Switch on disabled"),
    }
}

async fn stands(bench: &mut Bench) -> Verdict {
    let travel = bench.travel(crate::bench::ms(200)).await?;
    // Two counts: an encoder between two of them.
    if travel.abs() > 2 && bench.counts_per_turn().await? / 100.0 < f64::from(travel.abs()) {
        fail!("with the motor off the position changes by {travel} counts in 200 ms");
    }
    Ok(format!("{travel} counts in 200 ms"))
}
