//! Defects of a drive: its words, its modes and what it does with the motor.

use can::Frame;

use super::causes::{LEFT_READY, POSITION, VELOCITY, VIA_ENABLED, VIA_READY, VIA_SWITCHED_ON, cause};
use super::station::{Kind, Memory, abort, answer, confirm, frame, index, reads, writes, written};
use super::{Defect, defect};

use Kind::{Alter, Answer, Ask, Hear};

/// The statusword as it is read, with some bits otherwise.
fn status(memory: &Memory, said: [u8; 8], change: fn(u16) -> u16) -> [u8; 8] {
    if !reads(&memory.request, 0x6041, 0) || said[0] == 0x80 {
        return said;
    }
    answer(&said, said[0], change(u16::from_le_bytes([said[4], said[5]])).into())
}

/// The state of the power state machine that a statusword shows (CiA 402-2, table 30).
const fn state(word: u16) -> u16 {
    word & 0x6F
}

const SWITCH_ON_DISABLED: u16 = 0x40;
const READY: u16 = 0x21;
const SWITCHED_ON: u16 = 0x23;
const ENABLED: u16 = 0x27;

/// The controlword that a request writes.
fn control(asked: &[u8; 8]) -> Option<u16> {
    writes(asked, 0x6040, 0).then(|| written(asked) as u16)
}

/// A command is not heard after another one.
fn deaf(memory: &mut Memory, asked: [u8; 8], after: fn(u16) -> bool, to: fn(u16) -> bool) -> Option<[u8; 8]> {
    let word = control(&asked)?;
    let ignores = memory.flag && to(word);
    memory.flag = after(word) || ignores;
    ignores.then(|| confirm(&asked))
}

const fn command(word: u16) -> u16 {
    word & 0x8F
}

fn is_shutdown(word: u16) -> bool {
    command(word) & 0x87 == 0x06
}

fn is_switch_on(word: u16) -> bool {
    command(word) == 0x07
}

fn is_enable(word: u16) -> bool {
    command(word) == 0x0F
}

fn is_voltage_off(word: u16) -> bool {
    word & 0x82 == 0
}

fn is_quick_stop(word: u16) -> bool {
    word & 0x86 == 0x02
}

/// An option code takes one value more than it should.
fn takes(asked: [u8; 8], object: u16, value: u32) -> Option<[u8; 8]> {
    (writes(&asked, object, 0) && written(&asked) == value).then(|| confirm(&asked))
}

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("the statusword shows no state", "402-01", &[LEFT_READY, cause("They look at the state with the motor off.", &["402-02", "402-05", "402-06", "402-07", "402-22"]), VIA_READY, VIA_SWITCHED_ON, VIA_ENABLED], Alter(|m, a| status(m, a, |word| word & !0x6F | 0x01))),
    defect("shutdown is ignored", "402-02", &[LEFT_READY, cause("It looks at the bits of Ready to switch on too.", &["402-07"]), VIA_READY, VIA_SWITCHED_ON, VIA_ENABLED], Answer(|_, r| control(&r).filter(|word| is_shutdown(*word)).map(|_| confirm(&r)))),
    defect("disable voltage is ignored in Ready to switch on", "402-03", &[cause("They begin in Switch on disabled, to which disable voltage leads from where the case before has ended.", &["402-04", "402-05", "402-06", "402-07", "402-22"]), VIA_READY, VIA_SWITCHED_ON, VIA_ENABLED], Answer(|m, r| deaf(m, r, is_shutdown, is_voltage_off))),
    defect("quick stop is ignored in Ready to switch on", "402-04", &[], Answer(|m, r| deaf(m, r, is_shutdown, is_quick_stop))),
    defect("enable operation leads on from Switch on disabled", "402-05", &[], Hear(|m, f| { let Some(word) = super::station::request(&f).and_then(|asked| control(&asked)) else { return vec![f] }; let jumps = m.flag && is_enable(word); m.flag = is_voltage_off(word) || is_quick_stop(word); if jumps { vec![frame("605#2B40600006000000"), f] } else { vec![f] } })),
    defect("a fault reset leads on from Switch on disabled", "402-06", &[cause("Its fault reset does not reach the drive, which hears shutdown in its place.", &["402-51"])], Ask(|_, r| if control(&r) == Some(0x80) { answer(&r, r[0], 0x06) } else { r })),
    defect("bit 9 is never set", "402-07", &[], Alter(|m, a| status(m, a, |word| word & !0x0200))),
    defect("bit 5 is never set in Ready to switch on", "402-07", &[cause("It waits for Ready to switch on.", &["402-02"]), LEFT_READY, VIA_READY, VIA_SWITCHED_ON, VIA_ENABLED], Alter(|m, a| status(m, a, |word| if state(word) == READY { word & !0x20 } else { word }))),
    defect("6041h can be written", "402-08", &[], Answer(|_, r| writes(&r, 0x6041, 0).then(|| confirm(&r)))),
    defect("6061h stays at profile position", "402-09", &[VELOCITY], Alter(|m, a| if reads(&m.request, 0x6061, 0) { answer(&a, 0x4F, 1) } else { a })),
    defect("mode 5 becomes active, and is not supported", "402-10", &[], Answer(|m, r| { if writes(&r, 0x6060, 0) { m.flag = r[4] == 5; if m.flag { return Some(confirm(&r)); } } (reads(&r, 0x6061, 0) && m.flag).then(|| answer(&r, 0x4F, 5)) })),
    defect("6502h has mode 5", "402-11", &[], Alter(|m, a| if reads(&m.request, 0x6502, 0) { answer(&a, 0x43, 0x07FF) } else { a })),
    defect("605Ah takes 9", "402-12", &[], Answer(|_, r| takes(r, 0x605A, 9))),
    defect("605Ah does not take 6", "402-12", &[], Answer(|_, r| (writes(&r, 0x605A, 0) && written(&r) == 6).then(|| abort(&r, 0x0609_0030)))),
    defect("605Bh takes 2", "402-13", &[], Answer(|_, r| takes(r, 0x605B, 2))),
    defect("605Ch takes 2", "402-14", &[], Answer(|_, r| takes(r, 0x605C, 2))),
    defect("605Dh takes 5", "402-15", &[], Answer(|_, r| takes(r, 0x605D, 5))),
    defect("605Eh takes 5", "402-16", &[], Answer(|_, r| takes(r, 0x605E, 5))),
    defect("the fault bit is set without a code", "402-17", &[], Alter(|m, a| status(m, a, |word| if state(word) & 0x4F == SWITCH_ON_DISABLED { 0x0208 } else { word }))),
    defect("6081h takes another value than it is given", "402-18", &[], Ask(|_, r| if writes(&r, 0x6081, 0) { answer(&r, r[0], written(&r) + 1) } else { r })),
    defect("607Dh:02 is confirmed and not written", "402-19", &[cause("It sets the limits of 607Dh, and goes beyond the upper one.", &["402-50"])], Answer(|_, r| writes(&r, 0x607D, 2).then(|| confirm(&r)))),
    defect("6064h has two bytes", "402-20", &[cause("It compares two readings of 6064h.", &["402-23"]), POSITION], Alter(|m, a| if reads(&m.request, 0x6064, 0) { answer(&a, 0x4B, 0) } else { a })),
    defect("a gear of 0 is taken", "402-21", &[], Answer(|_, r| (index(&r) == 0x6091 && r[0] >> 5 == 1 && written(&r) == 0).then(|| confirm(&r)))),
    defect("after reset communication the drive is Ready to switch on", "402-22", &[], Hear(|m, f| { if f.id().raw() == 0 && f.padded()[0] == 0x82 { m.flag = true; } else if m.flag && f.id().raw() == 0x605 { m.flag = false; return vec![frame("605#2B40600006000000"), f]; } vec![f] })),
    defect("the position runs away with the motor off", "402-23", &[POSITION], Alter(|m, a| { if !reads(&m.request, 0x6064, 0) { return a; } m.count += 100_000; answer(&a, 0x43, written(&a).wrapping_add(m.count)) })),
    defect("Switched on shows as Ready to switch on", "402-31", &[VIA_SWITCHED_ON, VIA_ENABLED], Alter(|m, a| status(m, a, |word| if state(word) == SWITCHED_ON { word & !2 } else { word }))),
    defect("enable operation is ignored in Switched on", "402-32", &[VIA_ENABLED], Answer(|m, r| deaf(m, r, is_switch_on, is_enable))),
    defect("disable operation is ignored", "402-33", &[], Answer(|m, r| deaf(m, r, is_enable, is_switch_on))),
    defect("shutdown is ignored in Switched on", "402-34", &[cause("It sends shutdown after enable operation, which this defect does not hear either.", &["402-35"])], Answer(|m, r| deaf(m, r, |word| is_switch_on(word) || is_enable(word), is_shutdown))),
    defect("shutdown is ignored in Operation enabled", "402-35", &[], Answer(|m, r| deaf(m, r, is_enable, is_shutdown))),
    defect("disable voltage is ignored in Operation enabled", "402-36", &[cause("It ends one direction with disable voltage, before it begins the other.", &["402-46"])], Answer(|m, r| deaf(m, r, is_enable, is_voltage_off))),
    defect("disable voltage is ignored in Switched on", "402-37", &[cause("They begin in Switch on disabled, to which disable voltage does not lead from where this one leaves the drive.", &["402-32", "402-34", "402-38", "402-39"]), VIA_ENABLED], Answer(|m, r| deaf(m, r, is_switch_on, is_voltage_off))),
    defect("quick stop is ignored in Switched on", "402-38", &[], Answer(|m, r| deaf(m, r, is_switch_on, is_quick_stop))),
    defect("enable operation stays in Switched on after Ready to switch on", "402-39", &[], Hear(|m, f| { let Some(asked) = super::station::request(&f) else { return vec![f] }; let Some(word) = control(&asked) else { return vec![f] }; let short = m.flag && is_enable(word); m.flag = is_shutdown(word); if short { vec![Frame::full(f.id(), answer(&asked, asked[0], 0x07))] } else { vec![f] } })),
    defect("605Ah = 6 leaves Quick stop active", "402-40", &[cause("It reads the option code back.", &["402-12"]), cause("They begin in Quick stop active, where 605Ah = 6 keeps a drive.", &["402-41", "402-42"])], Ask(|_, r| if writes(&r, 0x605A, 0) && written(&r) == 6 { answer(&r, r[0], 2) } else { r })),
    defect("enable operation is ignored in Quick stop active", "402-41", &[], Answer(|m, r| deaf(m, r, is_quick_stop, is_enable))),
    defect("disable voltage is ignored in Quick stop active", "402-42", &[cause("They begin in Switch on disabled, to which disable voltage does not lead from where the case before leaves the drive.", &["402-41", "402-43", "402-44", "402-45", "402-46", "402-47", "402-48", "402-49", "402-50", "402-51"])], Answer(|m, r| deaf(m, r, is_quick_stop, is_voltage_off))),
    defect("605Ah = 2 stays in Quick stop active", "402-43", &[cause("It reads the option code back.", &["402-12"])], Ask(|_, r| if writes(&r, 0x605A, 0) && written(&r) == 2 { answer(&r, r[0], 6) } else { r })),
    defect("a set-point is not acknowledged", "402-44", &[], Alter(|m, a| if m.bytes[7] == 0 { status(m, a, |word| word & !0x1000) } else { a })),
    defect("bit 10 is set before the target is reached", "402-44", &[cause("It waits for bit 10 and looks whether the position is that of the target.", &["402-45"])], Alter(|m, a| status(m, a, |word| if state(word) == ENABLED { word | 0x0400 } else { word }))),
    defect("a relative move is absolute", "402-45", &[], Ask(|_, r| match control(&r) { Some(word) => answer(&r, r[0], u32::from(word & !0x40)), None => r })),
    defect("the sign of 60FFh is lost", "402-46", &[], Ask(|_, r| if writes(&r, 0x60FF, 0) { answer(&r, r[0], (written(&r) as i32).unsigned_abs()) } else { r })),
    defect("bit 10 is never set", "402-47", &[cause("They wait for bit 10 at the end of a move.", &["402-44", "402-45"])], Alter(|m, a| status(m, a, |word| word & !0x0400))),
    defect("halt is ignored", "402-48", &[], Ask(|_, r| match control(&r) { Some(word) => answer(&r, r[0], u32::from(word & !0x100)), None => r })),
    defect("a quick stop is confirmed while it turns, and ignored", "402-49", &[], Answer(|m, r| { if writes(&r, 0x6060, 0) { m.flag = r[4] == 3; } control(&r).filter(|word| m.flag && is_quick_stop(*word)).map(|_| confirm(&r)) })),
    defect("607Dh is stored and not heeded", "402-50", &[], Kind::Replace(|m, f| { let asked = super::station::request(&f)?; if index(&asked) != 0x607D || asked[3] == 0 { return None; } let place = usize::from(asked[3] - 1) * 4; if asked[0] >> 5 == 1 { m.bytes[place..place + 4].copy_from_slice(&asked[4..]); m.count |= 1 << asked[3]; return Some(vec![super::station::reply(confirm(&asked))]); } let [a, b, c, d] = [m.bytes[place], m.bytes[place + 1], m.bytes[place + 2], m.bytes[place + 3]]; (m.count >> asked[3] & 1 == 1).then(|| vec![super::station::reply(answer(&asked, 0x43, u32::from_le_bytes([a, b, c, d])))]) })),
    defect("a fault has no code", "402-51", &[], Alter(|m, a| if reads(&m.request, 0x603F, 0) { answer(&a, 0x4B, 0) } else { a })),
    defect("fault reset is ignored", "402-51", &[], Ask(|_, r| match control(&r) { Some(word) => answer(&r, r[0], u32::from(word & !0x80)), None => r })),
];
