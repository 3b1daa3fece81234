//! Defects of the dictionary and of what a server refuses.

use super::causes::{
    ANSWERS, CONSTANTS, DELIVERED, DICTIONARY, ERROR, LSS_ADDRESS, PERIOD, PERIOD_AND_OFF, SAVED, STATE,
    STATE_AFTER_RESET, cause,
};
use super::station::{Kind, abort, answer, code_if, confirm, index, is_abort, reads, writes, written};
use super::{Defect, defect};

use Kind::{Alter, Answer, Ask, Hear};

const GARBAGE: u32 = 0x0606_0000;

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("1000h says another device type", "SDO 01", &[cause("They compare 1000h with the description.", &["SDO 56", "SDO 19"]), CONSTANTS], Alter(|m, a| if reads(&m.request, 0x1000, 0) { answer(&a, 0x43, 0x0004_0192) } else { a })),
    defect("1000h comes in segments of a size that is not its own", "SDO 13", &[cause("They read 1000h and compare its value or length.", &["SDO 01", "SDO 56", "SDO 19"]), DICTIONARY, CONSTANTS], Alter(|m, a| if reads(&m.request, 0x1000, 0) { answer(&a, 0x4B, 0x191) } else { a })),
    defect("1017h is confirmed and not written", "SDO 02", &[PERIOD, PERIOD_AND_OFF, cause("It reads 1017h back.", &["HB 01"]), SAVED, STATE, STATE_AFTER_RESET], Answer(|_, r| (r[0] == 0x2B && writes(&r, 0x1017, 0)).then(|| confirm(&r)))),
    defect("a write to 1000h is confirmed", "SDO 03", &[cause("It writes every object that can be read only, 1000h too.", &["OD 03"])], Answer(|_, r| writes(&r, 0x1000, 0).then(|| confirm(&r)))),
    defect("a write to 1000h is refused as missing", "SDO 03", &[cause("It writes every object that can be read only, 1000h too.", &["OD 03"])], Alter(|m, a| { let so = writes(&m.request, 0x1000, 0); code_if(a, so, 0x0602_0000) })),
    defect("a write-only object is read as 0", "SDO 04", &[cause("It reads every object that can be written only, 2001h too.", &["OD 04"])], Answer(|_, r| reads(&r, 0x2001, 0).then(|| answer(&r, 0x4F, 0)))),
    defect("a missing sub-index is a missing object", "SDO 05", &[cause("It waits for the code of a missing sub-index.", &["SDO 54"])], Alter(|_, a| { let so = a[4..] == [0x11, 0, 0x09, 0x06]; code_if(a, so, 0x0602_0000) })),
    defect("a missing object is read as 0", "SDO 06", &[cause("It reads objects that are not there, 1004h among them.", &["OD 53"])], Answer(|_, r| reads(&r, 0x1004, 0).then(|| answer(&r, 0x4F, 0)))),
    defect("a missing object is a hardware error", "SDO 06", &[cause("They read objects that are not there.", &["SDO 28", "SDO 29", "SDO 30", "OD 53"]), cause("It maps an object that is not there.", &["PDO 59"])], Alter(|_, a| { let so = a[4..] == [0, 0, 0x02, 0x06]; code_if(a, so, GARBAGE) })),
    defect("an unknown command specifier is not answered", "SDO 07", &[], Answer(|_, r| (r[0] >> 5 == 7).then_some([0; 8]))),
    defect("an unknown command specifier is a general incompatibility", "SDO 07", &[], Alter(|m, a| { let so = m.request[0] >> 5 == 7; code_if(a, so, 0x0604_0043) })),
    defect("four bytes are taken for 1017h", "SDO 08", &[], Answer(|_, r| (r[0] == 0x23 && index(&r) == 0x1017).then(|| confirm(&r)))),
    defect("one byte is taken for 1017h", "SDO 09", &[], Answer(|_, r| (r[0] == 0x2F && index(&r) == 0x1017).then(|| confirm(&r)))),
    defect("a value above the limit is taken", "SDO 10", &[cause("It writes beyond the limits of every object, 2000h too.", &["OD 06"])], Answer(|_, r| (writes(&r, 0x2000, 0) && written(&r) == 21).then(|| confirm(&r)))),
    defect("a value above the limit is refused as read-only", "SDO 10", &[cause("It writes beyond the limits of every object, 2000h too.", &["OD 06"])], Alter(|m, a| { let so = index(&m.request) == 0x2000 && written(&m.request) == 21; code_if(a, so, 0x0601_0002) })),
    defect("a value below the limit is taken", "SDO 11", &[cause("It writes beyond the limits of every object, 2000h too.", &["OD 06"])], Answer(|_, r| (writes(&r, 0x2000, 0) && written(&r) == 9).then(|| confirm(&r)))),
    defect("1200h:02 is another identifier", "SDO 12", &[], Alter(|m, a| if reads(&m.request, 0x1200, 2) { answer(&a, 0x43, 0x586) } else { a })),
    defect("1280h is there, and not described", "SDO 28", &[cause("They ask the same after a reset and after a save.", &["SDO 29", "SDO 30"])], Answer(|_, r| reads(&r, 0x1280, 1).then(|| answer(&r, 0x43, 0x8000_0000)))),
    defect("1201h appears with a reset of the communication", "SDO 29", &[cause("It ends with a reset of the communication too.", &["SDO 30"])], Answer(|m, r| { m.flag |= m.state == 0x7F && m.count > 40; m.count += 1; (reads(&r, 0x1201, 1) && m.flag && m.bytes[0] > 0).then(|| answer(&r, 0x43, 0)).or_else(|| { m.bytes[0] += u8::from(reads(&r, 0x1201, 1)); None }) })),
    defect("1201h appears with a save", "SDO 30", &[], Answer(|m, r| { m.flag |= writes(&r, 0x1010, 1) && written(&r) == 0x6576_6173; (reads(&r, 0x1201, 1) && m.flag).then(|| answer(&r, 0x43, 0)) })),
    defect("a frame of four bytes stops the server", "SDO 51", &[], Hear(|m, f| { m.flag |= f.standard_data_id() == Some(0x605) && f.dlc() == 4; m.flag &= f.id().raw() != 0; if m.flag && f.standard_data_id() == Some(0x605) { vec![] } else { vec![f] } })),
    defect("a remote frame is answered", "SDO 52", &[], Kind::Add(|_, f| if f.is_remote() && f.id().raw() == 0x605 { vec!["585#4300100000000000".parse().unwrap()] } else { vec![] })),
    defect("each answer comes twice", "SDO 53", &[ANSWERS], Kind::Say(|_, f| if f.id().raw() == 0x585 { vec![f, f] } else { vec![f] })),
    defect("aborts are about no object", "SDO 53", &[], Alter(|_, a| if is_abort(&a) { [a[0], 0, 0, 0, a[4], a[5], a[6], a[7]] } else { a })),
    defect("a missing sub-index of a record is a missing object", "SDO 54", &[], Alter(|m, a| { let so = m.request[3] == 0xFE; code_if(a, so, 0x0602_0000) })),
    defect("2005h cannot be read", "OD 01", &[cause("It reads every object in operational too.", &["OD 07"])], Answer(|_, r| reads(&r, 0x2005, 0).then(|| abort(&r, 0x0601_0001)))),
    defect("2006h:02 has four bytes", "OD 01", &[cause("It reads every object in operational too.", &["OD 07"]), cause("It writes back what it has read, which is too long.", &["OD 09"])], Alter(|m, a| if reads(&m.request, 0x2006, 2) { answer(&a, 0x43, 6) } else { a })),
    defect("2005h cannot be read in operational", "OD 07", &[], Answer(|m, r| (m.state == 5 && reads(&r, 0x2005, 0)).then(|| abort(&r, 0x0601_0001)))),
    defect("1015h is not as delivered after a reset", "OD 02", &[], Alter(|m, a| if reads(&m.request, 0x1015, 0) && a[0] == 0x4B { answer(&a, 0x4B, 3) } else { a })),
    defect("a write of 2005h is confirmed", "OD 03", &[], Answer(|_, r| writes(&r, 0x2005, 0).then(|| confirm(&r)))),
    defect("2001h can be read", "OD 04", &[cause("The write-only object that it reads is 2001h.", &["SDO 04"])], Answer(|_, r| reads(&r, 0x2001, 0).then(|| answer(&r, 0x4F, 7)))),
    defect("sub-index FFh says an unknown type of object", "OD 05", &[], Answer(|_, r| reads(&r, 0x1018, 0xFF).then(|| answer(&r, 0x43, 0x0203)))),
    defect("2004h takes more than its upper limit", "OD 06", &[], Answer(|_, r| (writes(&r, 0x2004, 0) && written(&r) == 2001).then(|| confirm(&r)))),
    defect("2004h does not take its lower limit", "OD 06", &[], Answer(|_, r| (writes(&r, 0x2004, 0) && written(&r) == 100).then(|| abort(&r, 0x0609_0032)))),
    defect("1010h:00 is another number", "OD 08", &[cause("It compares every sub-index 00h with the highest sub-index.", &["OD 51"])], Alter(|m, a| if reads(&m.request, 0x1010, 0) { answer(&a, 0x4F, 4) } else { a })),
    defect("2006h:01 does not take its own value", "OD 09", &[], Answer(|_, r| writes(&r, 0x2006, 1).then(|| abort(&r, 0x0609_0030)))),
    defect("2006h:01 takes another value than it is given", "OD 09", &[], Ask(|_, r| if writes(&r, 0x2006, 1) { answer(&r, r[0], written(&r) + 1) } else { r })),
    defect("2006h:00 counts one more", "OD 51", &[CONSTANTS], Alter(|m, a| if reads(&m.request, 0x2006, 0) { answer(&a, 0x4F, 3) } else { a })),
    defect("1018h:02 is another product code", "OD 52", &[LSS_ADDRESS], Alter(|m, a| if reads(&m.request, 0x1018, 2) { answer(&a, 0x43, 0x23) } else { a })),
    defect("2FFFh is there, and not described", "OD 53", &[], Answer(|_, r| reads(&r, 0x2FFF, 0).then(|| answer(&r, 0x4F, 0)))),
    defect("1014h is another identifier", "EMCY 01", &[DELIVERED, cause("It writes back what it reads: another identifier, while this one is in use.", &["OD 09"])], Alter(|m, a| if reads(&m.request, 0x1014, 0) { answer(&a, 0x43, 0x86) } else { a })),
    defect("1001h has two bytes", "EMCY 02", &[DICTIONARY, cause("They read 1001h to know whether there is an error.", &["EMCY 04"]), ERROR], Alter(|m, a| if reads(&m.request, 0x1001, 0) { answer(&a, 0x4B, u32::from(a[4])) } else { a })),
    defect("1003h counts an error that cannot be read", "EMCY 03", &[cause("It reads 1003h:00 after it has written 0.", &["EMCY 51"])], Alter(|m, a| if reads(&m.request, 0x1003, 0) { answer(&a, 0x4F, 5) } else { a })),
    defect("1003h:00 takes 1", "EMCY 51", &[], Answer(|_, r| (writes(&r, 0x1003, 0) && written(&r) == 1).then(|| confirm(&r)))),
    defect("a wrong signature stores", "OTHER 01", &[], Answer(|_, r| (writes(&r, 0x1010, 1) && written(&r) == u32::from_le_bytes(*b"wron")).then(|| confirm(&r)))),
    defect("the signature backwards stores", "OTHER 02", &[], Answer(|_, r| (writes(&r, 0x1010, 1) && written(&r) == u32::from_le_bytes(*b"evas")).then(|| confirm(&r)))),
    defect("a wrong signature restores", "OTHER 03", &[], Answer(|_, r| (writes(&r, 0x1011, 1) && written(&r) == u32::from_le_bytes(*b"wron")).then(|| confirm(&r)))),
    defect("the signature backwards restores", "OTHER 04", &[], Answer(|_, r| (writes(&r, 0x1011, 1) && written(&r) == u32::from_le_bytes(*b"daol")).then(|| confirm(&r)))),
    defect("a wrong signature stores the communication", "OTHER 05", &[], Answer(|_, r| (writes(&r, 0x1010, 2) && written(&r) == u32::from_le_bytes(*b"wron")).then(|| confirm(&r)))),
    defect("the signature backwards stores the communication", "OTHER 06", &[], Answer(|_, r| (writes(&r, 0x1010, 2) && written(&r) == u32::from_le_bytes(*b"evas")).then(|| confirm(&r)))),
    defect("a wrong signature restores the communication", "OTHER 07", &[], Answer(|_, r| (writes(&r, 0x1011, 2) && written(&r) == u32::from_le_bytes(*b"wron")).then(|| confirm(&r)))),
    defect("the signature backwards restores the communication", "OTHER 08", &[], Answer(|_, r| (writes(&r, 0x1011, 2) && written(&r) == u32::from_le_bytes(*b"daol")).then(|| confirm(&r)))),
    defect("1014h takes an identifier of SDO", "OTHER 10", &[], Answer(|_, r| (writes(&r, 0x1014, 0) && written(&r) == 0x601).then(|| confirm(&r)))),
    defect("1014h takes 050h", "OTHER 10", &[], Answer(|_, r| (writes(&r, 0x1014, 0) && written(&r) == 0x050).then(|| confirm(&r)))),
    defect("1010h:01 has reserved bits", "OTHER 51", &[], Alter(|m, a| if reads(&m.request, 0x1010, 1) { answer(&a, 0x43, 5) } else { a })),
    defect("a save stores nothing", "OTHER 52", &[cause("They save another value and look for it after a reset.", &["SYNC 08", "SYNC 10"])], Answer(|_, r| (writes(&r, 0x1010, 1) && written(&r) == u32::from_le_bytes(*b"save")).then(|| confirm(&r)))),
];
