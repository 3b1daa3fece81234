//! Defects of EMCY, SYNC, guarding, heartbeat, NMT and LSS.

use can::Frame;

use super::causes::{
    DELIVERED, DICTIONARY, ERROR, EVENTS, GUARD_TIME, LENGTHS, PERIOD, PERIOD_AND_OFF, QUIET, RECEIVED, SAVED, STATE,
    STATE_AFTER_RESET, TOGGLE, cause,
};
use super::station::{
    Kind, Memory, abort, answer, confirm, frame, index, is_abort, reads, reply, request, writes, written,
};
use super::{Defect, defect};

use Kind::{Add, Alter, Answer, Ask, Every, Hear, Replace, Say};

fn is_emcy(said: &Frame) -> bool {
    said.id().raw() == 0x85
}

fn is_heartbeat(said: &Frame) -> bool {
    said.id().raw() == 0x705 && !said.is_remote()
}

fn is_boot_up(said: &Frame) -> bool {
    is_heartbeat(said) && said.data() == [0]
}

fn is_nmt(heard: &Frame, command: u8) -> bool {
    heard.id().raw() == 0 && heard.data() == [command, 5]
}

fn guards(heard: &Frame) -> bool {
    heard.is_remote() && heard.id().raw() == 0x705
}

/// An LSS answer that goes out otherwise.
fn lss(said: Frame, command: u8, data: &[u8]) -> Vec<Frame> {
    if said.id().raw() != 0x7E4 || said.padded()[0] != command {
        return vec![said];
    }
    let mut full = [0; 8];
    full[..data.len()].copy_from_slice(data);
    vec![Frame::full(said.id(), full)]
}

/// The node is made to produce SYNC, and these go out when it begins.
fn produces(memory: &mut Memory, heard: Frame, syncs: &[&str]) -> Option<Vec<Frame>> {
    let asked = request(&heard).filter(|asked| writes(asked, 0x1005, 0))?;
    memory.flag = written(&asked) & 1 << 30 != 0;
    if !memory.flag {
        return None;
    }
    let frames = syncs.iter().map(|text| frame(text));
    Some(std::iter::once(reply(confirm(&asked))).chain(frames).collect())
}

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("a lost heartbeat is not reported", "EMCY 04", &[ERROR, cause("They wait for the EMCY message of a producer that is late.", &["HB 06", "HB 07"]), cause("It waits for the EMCY message of a master that stays away.", &["GUARD 06"])], Say(|_, f| if is_emcy(&f) { vec![] } else { vec![f] })),
    defect("a lost heartbeat has another code", "EMCY 04", &[cause("It compares 1003h:01 with the code 8130h.", &["EMCY 06"]), cause("They expect the code 8130h of a master that stays away, and of a producer that is late.", &["GUARD 06", "HB 07"])], Say(|_, f| if is_emcy(&f) && f.padded()[1] == 0x81 { let mut data = *f.padded(); data[0] = 0x20; vec![Frame::full(f.id(), data)] } else { vec![f] })),
    defect("the error register is not set", "EMCY 05", &[], Alter(|m, a| if reads(&m.request, 0x1001, 0) { answer(&a, 0x4F, 0) } else { a })),
    defect("the history has another code", "EMCY 06", &[], Alter(|m, a| if reads(&m.request, 0x1003, 1) && !is_abort(&a) { answer(&a, 0x43, 0x2310) } else { a })),
    defect("the end of an error is not reported", "EMCY 52", &[], Say(|_, f| if is_emcy(&f) && f.padded()[1] == 0 { vec![] } else { vec![f] })),
    defect("bit 31 of 1014h does not switch EMCY off", "EMCY 53", &[], Answer(|_, r| (writes(&r, 0x1014, 0) && written(&r) >> 31 == 1).then(|| confirm(&r)))),
    defect("1005h is another identifier", "SYNC 01", &[DELIVERED], Alter(|m, a| if reads(&m.request, 0x1005, 0) { answer(&a, 0x43, 0x81) } else { a })),
    defect("SYNC comes three times as often", "SYNC 02", &[cause("The frames of the defect are over when they listen, and the node itself sends none.", &["SYNC 06", "SYNC 07"])], Replace(|m, f| produces(m, f, &["080#"; 30]))),
    defect("SYNC goes on with 1006h = 0", "SYNC 04", &[cause("The SYNC frames that go on have no counter.", &["SYNC 07"])], Every(20, |m, f| produces(m, f, &[]), |m| if m.flag { vec![frame("080#")] } else { vec![] })),
    defect("SYNC has a byte without a counter", "SYNC 06", &[cause("The frames of the defect are over when they listen, and the node itself sends none.", &["SYNC 02", "SYNC 07"])], Replace(|m, f| produces(m, f, &["080#01"; 5]))),
    defect("the counter of SYNC leaves one out", "SYNC 07", &[cause("The frames of the defect are over when they listen, and the node itself sends none.", &["SYNC 02", "SYNC 06"])], Replace(|m, f| produces(m, f, &["080#01", "080#02", "080#04", "080#01", "080#02", "080#03"]))),
    defect("the counter of SYNC goes on after stopped", "SYNC 52", &[], Say(|m, f| { if f.id().raw() != 0x80 || f.dlc() != 1 { return vec![f]; } let own = f.padded()[0]; if own == 1 && m.bytes[0] > 4 { m.bytes[1] = m.bytes[0]; } m.bytes[0] = own; vec![Frame::new(f.id(), &[own.wrapping_add(m.bytes[1])])] })),
    defect("240 is refused for 1019h", "SYNC 53", &[], Answer(|_, r| (writes(&r, 0x1019, 0) && r[4] == 240).then(|| abort(&r, 0x0609_0031)))),
    defect("1 is taken for 1019h", "SYNC 05", &[], Answer(|_, r| (writes(&r, 0x1019, 0) && r[4] == 1).then(|| confirm(&r)))),
    defect("1019h is not stored", "SYNC 08", &[], Alter(|m, a| { if m.request[0] == 0x23 && index(&m.request) == 0x1010 { m.flag = true; } if reads(&m.request, 0x1019, 0) && m.flag { m.flag = false; return answer(&a, 0x4F, 0); } a })),
    defect("1019h is taken while 1006h is not 0", "SYNC 09", &[], Answer(|m, r| { if writes(&r, 0x1006, 0) { m.flag = written(&r) != 0; } (writes(&r, 0x1019, 0) && m.flag).then(|| confirm(&r)) })),
    defect("1006h is not stored", "SYNC 10", &[], Alter(|m, a| { if m.request[0] == 0x23 && index(&m.request) == 0x1010 { m.flag = true; } if reads(&m.request, 0x1006, 0) && m.flag { m.flag = false; return answer(&a, 0x43, 0); } a })),
    defect("1020h stays when the configuration changes", "OTHER 09", &[], Alter(|m, a| { if writes(&m.request, 0x1020, 1) { m.bytes = m.request; } if reads(&m.request, 0x1020, 1) { return answer(&a, 0x43, written(&m.bytes)); } a })),
    defect("100Ch cannot be read", "GUARD 01", &[GUARD_TIME, DICTIONARY, cause("They read 100Ch.", &["GUARD 05", "HBG 01"])], Answer(|_, r| reads(&r, 0x100C, 0).then(|| abort(&r, 0x0602_0000)))),
    defect("guarding is not answered", "GUARD 02", &[TOGGLE, cause("It guards in time before it stays away.", &["GUARD 06"])], Hear(|_, f| if guards(&f) { vec![] } else { vec![f] })),
    defect("guarding is answered with pre-operational always", "GUARD 02", &[cause("The state that they see in heartbeats is operational or stopped.", &["HB 07", "HB 51", "STATE 03", "STATE 04", "TRANS 03", "TRANS 04", "TRANS 51"])], Say(|_, f| if is_heartbeat(&f) && f.data() != [0] { vec![Frame::new(f.id(), &[f.padded()[0] & 0x80 | 0x7F])] } else { vec![f] })),
    defect("the toggle bit of guarding stays", "GUARD 03", &[cause("It compares the toggle bits of two answers.", &["HBG 03"])], Say(|_, f| if is_heartbeat(&f) { vec![Frame::new(f.id(), &[f.padded()[0] & 0x7F])] } else { vec![f] })),
    defect("the toggle bit of guarding begins with 1", "GUARD 03", &[cause("It compares the first answer with the second, and the first alone is turned.", &["HBG 03"])], Say(|m, f| { if !is_heartbeat(&f) { return vec![f]; } m.count += 1; if is_boot_up(&f) { m.count = 0; } if m.count == 1 && m.heartbeat == 0 { vec![Frame::new(f.id(), &[f.padded()[0] ^ 0x80])] } else { vec![f] } })),
    defect("guarding of node 4 is answered", "GUARD 04", &[], Hear(|_, f| if f.is_remote() && f.id().raw() == 0x704 { vec![frame("705#R1")] } else { vec![f] })),
    defect("100Dh is confirmed and not written", "GUARD 05", &[cause("It waits for the life time, of which 100Dh is a factor.", &["GUARD 06"])], Answer(|_, r| writes(&r, 0x100D, 0).then(|| confirm(&r)))),
    defect("a master that stays away is not reported", "GUARD 06", &[], Say(|m, f| if is_emcy(&f) && m.guard_time == 50 { vec![] } else { vec![f] })),
    defect("100Ch cannot be read with a heartbeat", "HBG 01", &[GUARD_TIME, DICTIONARY, cause("They read 100Ch.", &["GUARD 01", "GUARD 05"])], Answer(|_, r| reads(&r, 0x100C, 0).then(|| abort(&r, 0x0602_0000)))),
    defect("1017h = 0 does not stop the heartbeat", "HBG 02", &[QUIET, cause("It writes 1017h = 0 and listens.", &["HB 03"])], Ask(|_, r| if r[0] == 0x2B && writes(&r, 0x1017, 0) && written(&r) == 0 { answer(&r, r[0], 30) } else { r })),
    defect("guarding without the toggle bit", "HBG 03", &[cause("It compares the toggle bits of four answers.", &["GUARD 03"])], Say(|_, f| if is_heartbeat(&f) { vec![Frame::new(f.id(), &[f.padded()[0] & 0x7F])] } else { vec![f] })),
    defect("heartbeats come at half the rate", "HBG 04", &[cause("They count heartbeats within a time.", &["HBG 05", "HBG 06", "HBG 07", "HB 02"])], Say(|m, f| { if is_heartbeat(&f) && f.data() != [0] && m.heartbeat > 0 { m.count += 1; if m.count % 2 == 0 { return vec![]; } } vec![f] })),
    defect("heartbeats have the toggle bit while there are remote frames", "HBG 05", &[cause("It sends remote frames too, with both set.", &["HBG 07"])], Add(|m, f| if guards(&f) && m.heartbeat > 0 { vec![Frame::new(can::CanId::standard(0x705), &[0xFF])] } else { vec![] })),
    defect("heartbeats stay away while guarding is on", "HBG 06", &[cause("It sets both, and waits for a heartbeat.", &["HBG 07"])], Say(|m, f| { if writes(&m.request, 0x100C, 0) { m.flag = written(&m.request) == 200; } if m.flag && is_heartbeat(&f) && f.data() != [0] { vec![] } else { vec![f] } })),
    defect("with both set remote frames are answered with the toggle bit", "HBG 07", &[], Add(|m, f| if guards(&f) && m.heartbeat > 0 && m.guard_time > 0 { vec![Frame::new(f.id(), &[0x85])] } else { vec![] })),
    defect("1017h is confirmed and always 0", "HB 01", &[cause("It reads 1017h back.", &["SDO 02"]), LENGTHS, PERIOD, PERIOD_AND_OFF, SAVED, STATE, STATE_AFTER_RESET], Answer(|_, r| writes(&r, 0x1017, 0).then(|| confirm(&r)))),
    defect("every tenth heartbeat is left out", "HB 02", &[], Say(|m, f| { if is_heartbeat(&f) && f.data() != [0] && m.heartbeat > 0 { m.count += 1; if m.count % 10 == 0 { return vec![]; } } vec![f] })),
    defect("with 1017h = 0 a heartbeat comes now and then", "HB 03", &[QUIET], Ask(|_, r| if r[0] == 0x2B && writes(&r, 0x1017, 0) && written(&r) == 0 { answer(&r, r[0], 400) } else { r })),
    defect("a node is taken twice in 1016h", "HB 04", &[], Answer(|m, r| { if writes(&r, 0x1016, 1) && written(&r) != 0 { m.bytes = r; } (writes(&r, 0x1016, 2) && written(&r) != 0 && written(&r) == written(&m.bytes)).then(|| confirm(&r)) })),
    defect("a heartbeat that is in time is missed", "HB 05", &[cause("The producer that comes back is missed again.", &["EMCY 52"])], Ask(|_, r| if writes(&r, 0x1016, 2) && written(&r) & 0xFFFF == 300 { answer(&r, r[0], written(&r) - 250) } else { r })),
    defect("a heartbeat that is late is not missed", "HB 06", &[cause("It is the error that they force.", &["EMCY 04", "HB 07"]), ERROR], Ask(|_, r| if writes(&r, 0x1016, 2) && written(&r) & 0xFFFF == 300 { answer(&r, r[0], written(&r) + 5000) } else { r })),
    defect("a node that misses a heartbeat stays operational", "HB 07", &[], Say(|m, f| { m.flag |= is_emcy(&f) && m.state == 5; if m.flag && m.state == 5 && is_heartbeat(&f) { vec![Frame::new(f.id(), &[5])] } else { vec![f] } })),
    defect("1017h is another after a reset", "HB 53", &[cause("They begin with a reset, after which 55 ms are written: heartbeats come that they take for answers.", &["GUARD 04", "HBG 03"])], Hear(|m, f| { m.flag |= is_nmt(&f, 0x82); if m.flag && request(&f).is_some_and(|asked| reads(&asked, 0x1017, 0)) { m.count += 1; m.flag = false; if m.count % 2 == 0 { return vec![frame("605#2B17100037000000"), f]; } } vec![f] })),
    defect("the heartbeat says operational always", "HB 51", &[cause("It sees the NMT state in the answer to a remote frame.", &["GUARD 02"]), TOGGLE, cause("The state that they see in heartbeats is pre-operational or stopped.", &["HB 07", "STATE 02", "STATE 04", "TRANS 02", "TRANS 04", "TRANS 51", "TRANS 52", "TRANS 53"])], Say(|_, f| if is_heartbeat(&f) && f.data() != [0] { vec![Frame::new(f.id(), &[5])] } else { vec![f] })),
    defect("a consumer does not wait for the first heartbeat", "HB 52", &[], Hear(|_, f| match request(&f) { Some(asked) if writes(&asked, 0x1016, 2) && written(&asked) != 0 => vec![f, frame("77F#05")], _ => vec![f] })),
    defect("after a reset what was written is kept", "STATE 01", &[cause("It writes 1017h, and compares it after a reset.", &["HB 53"])], Hear(|m, f| { if let Some(asked) = request(&f).filter(|asked| asked[0] == 0x2B && index(asked) == 0x1017) { m.bytes = asked; m.count = 1; } if f.id().raw() == 0 && [0x81, 0x82].contains(&f.padded()[0]) { m.flag = m.count == 1; } if m.flag && request(&f).is_some() { m.flag = false; return vec![Frame::full(f.id(), m.bytes), f]; } vec![f] })),
    defect("after the boot-up message the node is operational", "STATE 02", &[], Hear(|m, f| { if f.id().raw() == 0 && [0x81, 0x82].contains(&f.padded()[0]) { m.flag = true; } else if m.flag && f.id().raw() == 0x605 { m.flag = false; return vec![frame("000#0105"), f]; } vec![f] })),
    defect("SDO is not answered in operational", "STATE 03", &[EVENTS, cause("They read or write an object by SDO in operational.", &["PDO 07", "PDO 58", "OD 07"]), RECEIVED], Hear(|m, f| if m.state == 5 && request(&f).is_some() { vec![] } else { vec![f] })),
    defect("SDO is answered in stopped", "STATE 04", &[], Replace(|m, f| if m.state == 4 { request(&f).map(|asked| vec![reply(abort(&asked, 0x0800_0022))]) } else { None })),
    defect("a reset from stopped leaves the node silent", "TRANS 01", &[], Hear(|m, f| { if is_nmt(&f, 2) { m.flag = true; } else if f.id().raw() == 0 && [1, 0x80].contains(&f.padded()[0]) { m.flag = false; } if m.flag && f.id().raw() == 0 && f.padded()[0] >= 0x81 { vec![] } else { vec![f] } })),
    defect("enter pre-operational does nothing in stopped", "TRANS 02", &[cause("It has the node leave stopped by that command.", &["SYNC 52"]), cause("They come after a case that ends in stopped, which enter pre-operational does not end.", &["PDO 10", "PDO 12", "PDO 15", "HB 52", "TRANS 51"])], Hear(|m, f| { if is_nmt(&f, 2) { m.flag = true; } else if f.id().raw() == 0 && f.padded()[0] != 0x80 { m.flag = false; } if m.flag && is_nmt(&f, 0x80) { vec![] } else { vec![f] } })),
    defect("start does nothing in stopped", "TRANS 03", &[], Hear(|m, f| { if is_nmt(&f, 2) { m.flag = true; } else if f.id().raw() == 0 && f.padded()[0] != 1 { m.flag = false; } if m.flag && is_nmt(&f, 1) { vec![] } else { vec![f] } })),
    defect("stop does nothing in pre-operational", "TRANS 04", &[cause("They stop the node in pre-operational.", &["SYNC 52", "STATE 04"])], Hear(|m, f| { if is_nmt(&f, 2) && m.flag { return vec![]; } if f.id().raw() == 0 { m.flag = f.padded()[0] == 0x80; } vec![f] })),
    defect("a command to all nodes is ignored", "TRANS 51", &[], Hear(|_, f| if f.id().raw() == 0 && f.data().get(1) == Some(&0) { vec![] } else { vec![f] })),
    defect("a command to another node is taken", "TRANS 52", &[], Hear(|_, f| if f.id().raw() == 0 && f.data().get(1) == Some(&127) { vec![Frame::new(f.id(), &[f.padded()[0], 5])] } else { vec![f] })),
    defect("an unknown command starts the node", "TRANS 53", &[], Hear(|_, f| if is_nmt(&f, 0x55) { vec![frame("000#0105")] } else { vec![f] })),
    defect("a command of one byte starts the node", "TRANS 53", &[], Hear(|_, f| if f.id().raw() == 0 && f.data() == [1] { vec![frame("000#0105")] } else { vec![f] })),
    defect("the boot-up message comes twice", "TRANS 54", &[TOGGLE, cause("They take the second boot-up message for the answer, or for a heartbeat, that comes next.", &["GUARD 04", "HB 53", "STATE 02"])], Say(|_, f| if is_boot_up(&f) { vec![f, f] } else { vec![f] })),
    defect("another revision is selected too", "LSS 51", &[], Hear(|_, f| if f.id().raw() == 0x7E5 && f.padded()[0] == 0x42 { vec![frame("7E5#4233000000000000")] } else { vec![f] })),
    defect("the vendor-ID of LSS is another", "LSS 52", &[], Say(|_, f| lss(f, 0x5A, &[0x5A, 0x12]))),
    defect("the node-ID of LSS is another", "LSS 53", &[], Say(|_, f| lss(f, 0x5E, &[0x5E, 6]))),
    defect("node-ID 128 is taken", "LSS 54", &[], Say(|m, f| { if f.id().raw() == 0x7E4 && f.padded()[0] == 0x11 { m.count += 1; } if m.count == 2 { lss(f, 0x11, &[0x11, 0]) } else { vec![f] } })),
    defect("an unknown bit rate is taken", "LSS 55", &[], Say(|_, f| lss(f, 0x13, &[0x13, 0]))),
    defect("another product code is identified", "LSS 56", &[], Hear(|_, f| if f.id().raw() == 0x7E5 && f.padded()[0] == 0x47 { vec![frame("7E5#4722000000000000")] } else { vec![f] })),
    defect("an inquiry is answered in the waiting state", "LSS 57", &[], Hear(|m, f| { if f.id().raw() == 0x7E5 { let waits = f.padded()[0] == 4; if waits { m.flag = true; } else if f.padded()[0] == 0x40 { m.flag = false; } if m.flag && f.padded()[0] == 0x5E { return ["7E5#4011000000000000", "7E5#4122000000000000", "7E5#4233000000000000", "7E5#4344000000000000", "7E5#5E00000000000000"].map(frame).to_vec(); } } vec![f] })),
];

/// Of a device without 1016h: the error that is brought about is a receive PDO that is too short.
#[rustfmt::skip]
pub(crate) static OF_SHORT_PDOS: &[Defect] = &[
    defect("a PDO that is too short is not reported", "EMCY 04", &[cause("They wait for its EMCY message, before they look at what is their own.", &["EMCY 05", "EMCY 06"])], Say(|_, f| if is_emcy(&f) { vec![] } else { vec![f] })),
    defect("a PDO that is too short has the code of one that is too long", "EMCY 04", &[cause("It compares 1003h:01 with the code of the message.", &["EMCY 06"])], Say(|_, f| if is_emcy(&f) && f.padded()[0] == 0x10 { let mut data = *f.padded(); data[0] = 0x20; vec![Frame::full(f.id(), data)] } else { vec![f] })),
];
