//! Defects of a second SDO server, whose identifiers the cases set to 6C0h and 6C1h.

use can::{CanId, Frame};

use super::causes::{DELIVERED, cause};
use super::station::{Kind, answer, confirm, reads, reply, writes, written};
use super::{Defect, defect};

use Kind::{Alter, Answer, Hear, Say};

const REQUEST: u16 = 0x6C0;
const REPLY: u16 = 0x6C1;

/// What the second server is asked.
fn asked(frame: &Frame) -> Option<[u8; 8]> {
    (frame.standard_data_id() == Some(REQUEST)).then(|| *frame.padded())
}

/// What the second server answers.
fn answered(frame: &Frame) -> Option<[u8; 8]> {
    (frame.standard_data_id() == Some(REPLY)).then(|| *frame.padded())
}

/// The same request to the first server.
fn to_first(data: [u8; 8]) -> Frame {
    Frame::full(CanId::standard(0x605), data)
}

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("1201h:02 is an identifier of the first server", "SDO 61", &[DELIVERED, cause("It writes back what it reads: a restricted identifier.", &["OD 09"])], Alter(|m, a| if reads(&m.request, 0x1201, 2) { answer(&a, 0x43, 0x585) } else { a })),
    defect("the second server answers with the identifier of the first too", "SDO 62", &[], Say(|_, f| answered(&f).map_or_else(|| vec![f], |data| vec![f, reply(data)]))),
    defect("an upload on the second server ends one on the first", "SDO 63", &[], Hear(|_, f| match asked(&f) { Some(data) if data[0] == 0x40 => vec![to_first([0x80, 0, 0, 0, 0, 0, 0, 8]), f], _ => vec![f] })),
    defect("an abort on the second server is one on the first", "SDO 64", &[], Hear(|_, f| match asked(&f) { Some(data) if data[0] == 0x80 => vec![f, to_first(data)], _ => vec![f] })),
    defect("the second server refuses everything as a hardware error", "SDO 65", &[], Say(|_, f| match answered(&f) { Some(data) if data[0] == 0x80 => vec![Frame::full(f.id(), answer(&data, 0x80, 0x0606_0000))], _ => vec![f] })),
    defect("the identifier of the second server moves while it is valid", "SDO 66", &[], Answer(|_, r| (writes(&r, 0x1201, 1) && written(&r) == 0x6C2).then(|| confirm(&r)))),
    defect("the second server answers with bit 31", "SDO 67", &[], Answer(|_, r| (writes(&r, 0x1201, 1) && written(&r) == 0x8000_06C0).then(|| confirm(&r)))),
    defect("the second server takes the identifier of a first one", "SDO 68", &[], Answer(|_, r| (writes(&r, 0x1201, 1) && written(&r) == 0x601).then(|| confirm(&r)))),
];
