//! Defects of segmented transfers and of block transfer.

use can::Frame;

use super::causes::{
    BLOCKS_OF_NAME, BLOCKS_OF_PERIOD, BLOCKS_OF_TYPE, CONSTANTS, DICTIONARY, LENGTHS, NAME, PERIOD, PERIOD_AND_OFF,
    QUIET, SAVED, STATE, cause,
};
use super::station::{Kind, Memory, abort, answer, code_if, confirm, index, is_abort, reads, reply, request, writes};
use super::{Defect, defect};

use Kind::{Alter, Answer, Hear, Replace, Say};

/// What an answer is of a server that confirms a segmented write of this object and writes nothing.
fn forgets(memory: &mut Memory, asked: [u8; 8], object: u16) -> Option<[u8; 8]> {
    if asked[0] == 0x21 && index(&asked) == object {
        memory.flag = true;
        return Some(confirm(&asked));
    }
    (asked[0] >> 5 == 0 && core::mem::replace(&mut memory.flag, false)).then_some([0x20, 0, 0, 0, 0, 0, 0, 0])
}

/// A server that confirms block downloads of this object and writes nothing.
fn forgets_blocks(memory: &mut Memory, frame: Frame, object: u16) -> Option<Vec<Frame>> {
    let asked = request(&frame)?;
    if asked[0] >> 5 == 6 && index(&asked) == object && asked[0] & 1 == 0 {
        memory.count = 1;
        return Some(vec![reply(answer(&asked, 0xA4, 127))]);
    }
    match memory.count {
        1 => {
            memory.count = 2;
            Some(vec![reply([0xA2, 1, 127, 0, 0, 0, 0, 0])])
        }
        2 => {
            memory.count = 0;
            Some(vec![reply([0xA1, 0, 0, 0, 0, 0, 0, 0])])
        }
        _ => None,
    }
}

/// A block upload begins.
const fn asks_for_block(data: &[u8; 8]) -> bool {
    data[0] & 0xE1 == 0xA0
}

/// A block download of an object with CRC begins.
fn begins_block(data: &[u8; 8], object: u16) -> bool {
    data[0] >> 5 == 6 && data[0] & 1 == 0 && with_crc(data) && index(data) == object
}

const fn with_crc(data: &[u8; 8]) -> bool {
    data[0] & 4 != 0
}

#[rustfmt::skip]
pub(crate) static DEFECTS: &[Defect] = &[
    defect("a segmented write of 100Ch is confirmed and not made", "SDO 14", &[], Answer(|m, r| forgets(m, r, 0x100C))),
    defect("a segmented write of 1017h is confirmed and not made", "SDO 15", &[cause("The segment that they spoil is one of 1017h, which this server does not look at.", &["SDO 58", "SDO 59"])], Answer(|m, r| forgets(m, r, 0x1017))),
    defect("segmented writes of 1017h are confirmed with the wrong toggle bit", "SDO 15", &[cause("It writes 100Ch in segments, whose confirmations are the same.", &["SDO 14"])], Alter(|m, a| if a[0] == 0x20 && m.request[0] >> 5 == 0 { [0x30, 0, 0, 0, 0, 0, 0, 0] } else { a })),
    defect("1008h comes in one frame, without its end", "SDO 16", &[NAME, BLOCKS_OF_NAME, CONSTANTS], Alter(|m, a| if reads(&m.request, 0x1008, 0) { answer(&a, 0x43, 0x4120_4120) } else { a })),
    defect("1008h is announced one byte longer than it is", "SDO 16", &[cause("It compares the length of each object with the announced one.", &["SDO 18"]), BLOCKS_OF_NAME, DICTIONARY, CONSTANTS], Alter(|m, a| if reads(&m.request, 0x1008, 0) && a[0] == 0x41 { answer(&a, 0x41, u32::from(a[4]) + 1) } else { a })),
    defect("a wrong toggle bit is answered with the segment", "SDO 17", &[], Hear(|m, f| { let first = m.flag; m.flag = request(&f).is_some_and(|asked| asked[0] == 0x40); match request(&f) { Some([0x70, ..]) if first => vec!["605#6000000000000000".parse().unwrap()], _ => vec![f] } })),
    defect("a wrong toggle bit is refused as an unknown command", "SDO 17", &[cause("It waits for the code of a wrong toggle bit too.", &["SDO 58"])], Alter(|_, a| { let so = a[4..] == [0, 0, 0x03, 0x05]; code_if(a, so, 0x0504_0001) })),
    defect("segments of 100Ah come with the toggle bit of the one before", "SDO 18", &[DICTIONARY, CONSTANTS], Say(|m, f| { m.flag = if reads(&m.request, 0x100A, 0) { true } else { m.flag && m.request[0] >> 5 == 3 }; if m.flag && m.request[0] == 0x70 && f.id().raw() == 0x585 { let mut data = *f.padded(); data[0] &= !0x10; vec![reply(data)] } else { vec![f] } })),
    defect("the abort of a client ends nothing", "SDO 55", &[], Hear(|_, f| match request(&f) { Some([0x80, ..]) => vec![], _ => vec![f] })),
    defect("the abort of a client is answered", "SDO 55", &[], Kind::Add(|_, f| match request(&f) { Some(data @ [0x80, ..]) => vec![reply(abort(&data, 0x0800_0000))], _ => vec![] })),
    defect("no request begins while an upload is under way", "SDO 56", &[cause("They read another object after 1008h, without a write or a segment in between, for which this server waits.", &["SDO 17", "SDO 18", "SDO 55", "SDO 24", "SDO 25", "OD 51", "OD 52", "OD 53"]), DICTIONARY, CONSTANTS], Answer(|m, r| { if r[0] == 0x40 && m.flag { return Some(abort(&r, 0x0504_0005)); } m.flag = reads(&r, 0x1008, 0) || m.flag && r[0] >> 5 == 3; None })),
    defect("a segment without a transfer is confirmed", "SDO 57", &[cause("After the client's abort it sends a segment that nothing waits for.", &["SDO 55"])], Alter(|m, a| if is_abort(&a) && m.request[0] == 0x60 { [0x0F, 0, 0, 0, 0, 0, 0, 0] } else { a })),
    defect("a download with the wrong toggle bit is taken", "SDO 58", &[], Kind::Ask(|_, r| if r[0] >> 5 == 0 && r[0] & 0x10 != 0 { let mut right = r; right[0] &= !0x10; right } else { r })),
    defect("a download that is too long is cut and taken", "SDO 59", &[], Kind::Ask(|_, r| if r[0] == 0x09 { let mut cut = r; cut[0] = 0x0B; cut[3] = 0; cut } else { r })),
    defect("a block upload without CRC is refused as missing", "SDO 19", &[BLOCKS_OF_TYPE], Answer(|_, r| (asks_for_block(&r) && !with_crc(&r) && index(&r) == 0x1000).then(|| abort(&r, 0x0602_0000)))),
    defect("block uploads of 1008h are refused as missing", "SDO 22", &[cause("It reads 1008h as a block with CRC.", &["SDO 23"])], Answer(|_, r| (asks_for_block(&r) && index(&r) == 0x1008).then(|| abort(&r, 0x0602_0000)))),
    defect("block uploads with CRC are refused as missing", "SDO 23", &[], Answer(|_, r| (asks_for_block(&r) && with_crc(&r)).then(|| abort(&r, 0x0602_0000)))),
    defect("block downloads of 100Ch are confirmed and not made", "SDO 20", &[cause("It writes the same as a block with CRC.", &["SDO 24"])], Replace(|m, f| forgets_blocks(m, f, 0x100C))),
    defect("block downloads of 1017h are confirmed and not made", "SDO 21", &[BLOCKS_OF_PERIOD], Replace(|m, f| forgets_blocks(m, f, 0x1017))),
    defect("block downloads of 100Ch with CRC are refused as missing", "SDO 24", &[], Answer(|_, r| begins_block(&r, 0x100C).then(|| abort(&r, 0x0602_0000)))),
    defect("block downloads of 1017h with CRC are refused as missing", "SDO 25", &[cause("It writes 1017h as a block with a wrong CRC.", &["SDO 60"])], Answer(|_, r| begins_block(&r, 0x1017).then(|| abort(&r, 0x0602_0000)))),
    defect("a block whose CRC is wrong is confirmed", "SDO 60", &[cause("They write 1017h as a block, whatever the CRC, and this server forgets it.", &["SDO 21", "SDO 25"])], Replace(|m, f| forgets_blocks(m, f, 0x1017))),
    defect("a block of 128 segments is begun", "SDO 26", &[], Answer(|_, r| (asks_for_block(&r) && r[4] == 128).then(|| answer(&r, 0xC2, 4)))),
    defect("a sequence number beyond the block is taken", "SDO 27", &[BLOCKS_OF_NAME], Answer(|m, r| match r[0] { 0xA0 if index(&r) == 0x1000 && r[4] == 127 => { m.flag = true; Some(answer(&r, 0xC2, 4)) } 0xA3 if m.flag => Some([0x81, 0x91, 0x01, 0x0F, 0, 0, 0, 0]), 0xA2 if m.flag => Some([0xCD, 0, 0, 0, 0, 0, 0, 0]), 0xA1 if m.flag => Some([0; 8]), _ => None })),
    defect("the answer to a write has seven bytes", "SDO 02", &[LENGTHS, cause("It writes 1017h in segments.", &["SDO 15"]), cause("It writes back what it has read, 1017h too.", &["OD 09"]), QUIET, cause("It switches the heartbeat off by 1017h before the remote frames.", &["GUARD 02"]), PERIOD, PERIOD_AND_OFF, cause("They write 1017h and read it after a reset.", &["HB 01", "HB 53", "STATE 01"]), SAVED, STATE], Say(|m, f| if f.id().raw() == 0x585 && writes(&m.request, 0x1017, 0) { vec![Frame::new(f.id(), &f.padded()[..7])] } else { vec![f] })),
];
