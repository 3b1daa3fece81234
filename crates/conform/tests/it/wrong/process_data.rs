//! Defects of PDOs: when they are sent, what they carry, what may be mapped.

use can::{CanId, Frame};

use super::causes::{CONSTANTS, DELIVERED, DICTIONARY, EVENTS, MAPPING_REFUSED, RECEIVED, SYNCHRONOUS, cause};
use super::station::{
    Kind, Memory, abort, answer, code_if, confirm, frame, index, is_abort, reads, reply, request, writes, written,
};
use super::{Defect, defect};

use Kind::{Add, Alter, Answer, Ask, Every, Hear, Replace, Say};

const TPDO: u32 = 0x185;
const RPDO: u32 = 0x205;

fn is_tpdo(sent: &Frame) -> bool {
    sent.id().raw() == TPDO && !sent.is_remote()
}

fn is_sync(heard: &Frame) -> bool {
    heard.id().raw() == 0x80
}

/// What a request sets as transmission type of the transmit PDO, kept in the memory's first byte.
fn note_type(memory: &mut Memory, heard: &Frame) -> u8 {
    if let Some(asked) = request(heard).filter(|asked| writes(asked, 0x1800, 2)) {
        memory.bytes[0] = asked[4];
    }
    memory.bytes[0]
}

/// One more PDO with what is heard while the node is in this state, of this transmission type.
fn adds(
    memory: &mut Memory,
    heard: Frame,
    state: u8,
    types: core::ops::RangeInclusive<u8>,
    when: fn(&Frame) -> bool,
) -> Vec<Frame> {
    let of_type = types.contains(&note_type(memory, &heard));
    if of_type && memory.state == state && when(&heard) { vec![frame("185#0000")] } else { vec![] }
}

/// Sent by itself in a state: an event-driven PDO with or without an event timer.
fn sends(memory: &Memory, state: u8, timer: bool) -> Vec<Frame> {
    let is_so = memory.state == state && memory.pdo_valid && memory.pdo_type == 255 && (memory.pdo_timer > 0) == timer;
    if is_so { vec![frame("185#0000")] } else { vec![] }
}

/// An NMT command: the state begins.
fn is_nmt(heard: &Frame) -> bool {
    heard.id().raw() == 0
}

fn takes_253(memory: &mut Memory, heard: Frame, answers: bool) -> Option<Vec<Frame>> {
    match request(&heard) {
        Some(asked) if writes(&asked, 0x1800, 2) && asked[4] == 253 => {
            memory.flag = true;
            Some(vec![reply(confirm(&asked))])
        }
        _ if heard.is_remote() && heard.id().raw() == TPDO && memory.flag && (answers || memory.state == 5) => {
            Some(if answers { vec![frame("185#0000")] } else { vec![] })
        }
        _ => None,
    }
}

/// A mapping entry is taken in any circumstances; the node does not hear of it.
fn takes_entry(asked: &[u8; 8], mapping: u16, entry: u32) -> bool {
    writes(asked, mapping, 1) && written(asked) == entry
}

/// That entry, and then the count that makes it the mapping.
fn takes_mapping(memory: &mut Memory, asked: [u8; 8], mapping: u16, entry: u32) -> Option<[u8; 8]> {
    if takes_entry(&asked, mapping, entry) {
        memory.flag = true;
        return Some(confirm(&asked));
    }
    (writes(&asked, mapping, 0) && asked[4] > 0 && core::mem::replace(&mut memory.flag, false)).then(|| confirm(&asked))
}

/// An entry is refused as something else than it is.
fn refuses_otherwise(memory: &Memory, said: [u8; 8], mapping: u16) -> [u8; 8] {
    let so = index(&memory.request) == mapping && memory.request[3] == 1;
    code_if(said, so, 0x0606_0000)
}

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("1400h:00 is 1", "PDO 01", &[CONSTANTS, cause("It compares every sub-index 00h with the highest sub-index.", &["OD 51"])], Alter(|m, a| if reads(&m.request, 0x1400, 0) { answer(&a, 0x4F, 1) } else { a })),
    defect("1600h maps more than 64 bits", "PDO 01", &[DELIVERED], Alter(|m, a| if reads(&m.request, 0x1600, 1) { answer(&a, 0x43, 0x2003_0050) } else { a })),
    defect("1800h:02 is a reserved type", "PDO 02", &[DELIVERED, cause("It writes back what it reads, which is refused.", &["OD 09"])], Alter(|m, a| if reads(&m.request, 0x1800, 2) { answer(&a, 0x4F, 245) } else { a })),
    defect("type 253 is taken, and remote frames are not answered", "PDO 03", &[], Replace(|m, f| takes_253(m, f, false))),
    defect("remote frames are answered in stopped", "PDO 09", &[cause("The defect does not ask for the state.", &["PDO 15"])], Replace(|m, f| takes_253(m, f, true))),
    defect("remote frames are answered in pre-operational", "PDO 15", &[cause("The defect does not ask for the state.", &["PDO 09"])], Replace(|m, f| takes_253(m, f, true))),
    defect("a change is not sent", "PDO 04", &[cause("It counts the PDOs of two changes.", &["PDO 51"])], Say(|m, f| { let by_change = m.pdo_type == 255 && m.pdo_timer == 0 && m.request[0] >> 5 == 1; if is_tpdo(&f) && by_change { vec![] } else { vec![f] } })),
    defect("a change is sent twice", "PDO 04", &[cause("They count the PDOs that come of one cause, of whatever type.", &["PDO 03", "PDO 05", "PDO 06", "PDO 07", "PDO 51"]), SYNCHRONOUS], Say(|_, f| if is_tpdo(&f) { vec![f, f] } else { vec![f] })),
    defect("the event timer runs at half its period", "PDO 05", &[], Ask(|_, r| if writes(&r, 0x1800, 5) { answer(&r, r[0], written(&r) / 2) } else { r })),
    defect("the event timer does not run", "PDO 05", &[], Answer(|_, r| (writes(&r, 0x1800, 5)).then(|| confirm(&r)))),
    defect("every nth SYNC is every SYNC", "PDO 06", &[], Ask(|_, r| if writes(&r, 0x1800, 2) && r[4] == 2 { answer(&r, r[0], 1) } else { r })),
    defect("an acyclic PDO is sent with every SYNC", "PDO 07", &[], Ask(|_, r| if writes(&r, 0x1800, 2) && r[4] == 0 { answer(&r, r[0], 1) } else { r })),
    defect("an acyclic PDO is sent without a SYNC", "PDO 07", &[], Ask(|_, r| if writes(&r, 0x1800, 2) && r[4] == 0 { answer(&r, r[0], 255) } else { r })),
    defect("counting begins with the first SYNC, whatever the start value is", "PDO 08", &[cause("It counts PDOs of type 1, of which one more comes with each SYNC.", &["PDO 56"]), SYNCHRONOUS], Add(|m, f| adds(m, f, 5, 1..=1, is_sync))),
    defect("sent in stopped by itself", "PDO 10", &[], Every(50, |_, _| None, |m| sends(m, 4, false))),
    defect("the event timer goes on in stopped", "PDO 11", &[], Every(50, |_, _| None, |m| sends(m, 4, true))),
    defect("SYNC is followed by a cyclic PDO in stopped", "PDO 12", &[], Add(|m, f| adds(m, f, 4, 1..=240, is_sync))),
    defect("SYNC is followed by an acyclic PDO in stopped", "PDO 13", &[], Add(|m, f| adds(m, f, 4, 0..=0, is_sync))),
    defect("SYNC is followed by a PDO with a start value in stopped", "PDO 14", &[], Add(|m, f| adds(m, f, 4, 1..=1, is_sync))),
    defect("a change is sent in pre-operational", "PDO 16", &[], Add(|m, f| adds(m, f, 0x7F, 255..=255, |f| request(f).is_some_and(|asked| index(&asked) >= 0x2000 && asked[0] >> 5 == 1)))),
    defect("the event timer runs in pre-operational", "PDO 17", &[], Every(50, |_, _| None, |m| sends(m, 0x7F, true))),
    defect("SYNC is followed by a cyclic PDO in pre-operational", "PDO 18", &[], Add(|m, f| adds(m, f, 0x7F, 1..=240, is_sync))),
    defect("SYNC is followed by an acyclic PDO in pre-operational", "PDO 19", &[], Add(|m, f| adds(m, f, 0x7F, 0..=0, is_sync))),
    defect("SYNC is followed by a PDO with a start value in pre-operational", "PDO 20", &[], Add(|m, f| adds(m, f, 0x7F, 1..=1, is_sync))),
    defect("the inhibit time does nothing", "PDO 51", &[], Answer(|_, r| (writes(&r, 0x1800, 3) && written(&r) > 0).then(|| confirm(&r)))),
    defect("a receive PDO is not heard", "PDO 52", &[cause("It waits for what a synchronous receive PDO writes.", &["PDO 55"])], Hear(|_, f| if f.id().raw() == RPDO { vec![] } else { vec![f] })),
    defect("a receive PDO of pre-operational waits for the start", "PDO 53", &[], Hear(|m, f| { if f.id().raw() == RPDO && m.state == 0x7F { m.bytes = *f.padded(); m.count = u32::from(f.dlc()) + 1; return vec![]; } let starts = is_nmt(&f) && m.state == 5 && m.count > 0; if starts { let held = Frame::new(CanId::standard(RPDO as u16), &m.bytes[..m.count as usize - 1]); m.count = 0; vec![f, held] } else { vec![f] } })),
    defect("a receive PDO writes in pre-operational", "PDO 53", &[], Hear(|m, f| if f.id().raw() == RPDO && m.state == 0x7F { vec![frame("000#0105"), f, frame("000#8005")] } else { vec![f] })),
    defect("a short receive PDO is filled with zeros and written", "PDO 54", &[], Hear(|m, f| if f.id().raw() == RPDO && m.state == 5 { let mut data = *f.padded(); data[0] |= u8::from(f.dlc() == 0) << 4 | u8::from(f.dlc() == 0); vec![Frame::new(f.id(), &data)] } else { vec![f] })),
    defect("a synchronous receive PDO acts at once", "PDO 55", &[], Hear(|_, f| if f.id().raw() == RPDO { vec![f, frame("080#")] } else { vec![f] })),
    defect("a PDO that is off is sent", "PDO 56", &[], Add(|m, f| { if let Some(asked) = request(&f).filter(|asked| writes(asked, 0x1800, 1)) { m.flag = written(&asked) >> 31 == 1; } if m.flag && m.state == 5 && is_sync(&f) { vec![frame("185#0000")] } else { vec![] } })),
    defect("transmission type 241 is taken", "PDO 57", &[], Answer(|_, r| (writes(&r, 0x1800, 2) && r[4] == 241).then(|| confirm(&r)))),
    defect("what a PDO carries is not what SDO reads", "PDO 58", &[], Say(|_, f| if is_tpdo(&f) { let mut data = *f.padded(); data[0] ^= 0x80; vec![Frame::new(f.id(), &data[..f.dlc().into()])] } else { vec![f] })),
    defect("what is mapped as delivered is not there", "PDO 21", &[DICTIONARY], Answer(|_, r| reads(&r, 0x2002, 0).then(|| abort(&r, 0x0602_0000)))),
    defect("a mapping is confirmed and not changed", "PDO 22", &[EVENTS, cause("They map an object, change it and look at what the PDO carries.", &["PDO 07", "PDO 58"]), cause("The refusal that they wait for is of the entry that is confirmed here.", &["PDO 23", "PDO 31", "PDO 32"])], Answer(|_, r| writes(&r, 0x1A00, 1).then(|| confirm(&r)))),
    defect("an entry is taken while the mapping counts", "PDO 23", &[], Answer(|m, r| { if writes(&r, 0x1A00, 0) { m.flag = r[4] > 0; } (writes(&r, 0x1A00, 1) && m.flag).then(|| confirm(&r)) })),
    defect("a mapping is taken while the PDO is valid", "PDO 24", &[], Answer(|m, r| { if writes(&r, 0x1800, 1) { m.flag = written(&r) >> 31 == 0; } (writes(&r, 0x1A00, 0) && m.flag).then(|| confirm(&r)) })),
    defect("more objects than there is room for are taken", "PDO 25", &[], Answer(|_, r| (writes(&r, 0x1A00, 0) && r[4] == 4).then(|| confirm(&r)))),
    defect("96 bits are taken", "PDO 26", &[], Answer(|m, r| { if writes(&r, 0x1A00, 1) { m.count = 0; } m.count += u32::from(index(&r) == 0x1A00 && r[3] > 0) * (written(&r) & 0xFF); let counts = writes(&r, 0x1A00, 0) && r[4] == 3 && m.count > 64; (counts || m.count > 64 && index(&r) == 0x1A00 && r[0] >> 5 == 1 && r[3] == 3).then(|| confirm(&r)) })),
    defect("an output in a receive PDO is refused", "PDO 27", &[RECEIVED], Answer(|_, r| takes_entry(&r, 0x1600, 0x2000_0008).then(|| abort(&r, 0x0604_0041)))),
    defect("an input in a receive PDO is taken", "PDO 28", &[], Answer(|m, r| takes_mapping(m, r, 0x1600, 0x1001_0008).or_else(|| takes_mapping(m, r, 0x1600, 0x2002_0010)))),
    defect("an input in a receive PDO is a hardware error", "PDO 28", &[cause("They wait for the code of a refused entry of 1600h.", &["PDO 29", "PDO 59", "PDO 60"])], Alter(|m, a| refuses_otherwise(m, a, 0x1600))),
    defect("what cannot be mapped is taken in a receive PDO", "PDO 29", &[], Answer(|m, r| takes_mapping(m, r, 0x1600, 0x1000_0020))),
    defect("an input in a transmit PDO is refused", "PDO 30", &[cause("They map an input into the transmit PDO first.", &["PDO 22", "PDO 23", "PDO 24"])], Answer(|_, r| takes_entry(&r, 0x1A00, 0x2000_0008).then(|| abort(&r, 0x0604_0041)))),
    defect("an output in a transmit PDO is taken", "PDO 31", &[], Answer(|m, r| takes_mapping(m, r, 0x1A00, 0x2003_0008))),
    defect("what cannot be mapped is taken in a transmit PDO", "PDO 32", &[], Answer(|m, r| takes_mapping(m, r, 0x1A00, 0x1000_0020))),
    defect("a dummy object is a hardware error", "PDO 33", &[], Answer(|_, r| takes_entry(&r, 0x1600, 0x0005_0008).then(|| abort(&r, 0x0606_0000)))),
    defect("an object that is not there is mapped", "PDO 59", &[], Answer(|m, r| takes_mapping(m, r, 0x1600, 0x5FFE_0008))),
    defect("an entry of seven bits is taken", "PDO 60", &[], Answer(|m, r| takes_mapping(m, r, 0x1600, 0x2000_0007))),
    defect("SYNC is followed by two PDOs", "SYNC 03", &[cause("It counts PDOs of type 1.", &["PDO 56"]), cause("It counts the PDOs that come with each SYNC.", &["SYNC 51"])], Add(|m, f| adds(m, f, 5, 1..=1, is_sync))),
    defect("SYNC of 080h is taken whatever 1005h says", "SYNC 51", &[], Hear(|_, f| match request(&f) { Some(asked) if writes(&asked, 0x1005, 0) && written(&asked) == 0xA0 => vec![Frame::full(f.id(), answer(&asked, asked[0], 0x80))], _ => vec![f] })),
    defect("aborts of a mapping say nothing of it", "PDO 26", &[MAPPING_REFUSED], Alter(|m, a| if is_abort(&a) && index(&m.request) == 0x1A00 { abort(&m.request, 0x0606_0000) } else { a })),
];
