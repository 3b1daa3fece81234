//! SDO 19 to 27: block transfer, which a server may have or refuse as a whole (CiA 301, 7.2.4.3.8 to 7.2.4.3.16).

use can::Frame;
use canopen::sdo::wire::Reply;
use canopen::{AbortCode, Mux, connection_set};

use super::sdo_transfer::aborted;
use crate::bench::{Bench, hex, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const GUARD_TIME: Mux = Mux::new(0x100C, 0);
const HEARTBEAT_TIME: Mux = Mux::new(0x1017, 0);
const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("SDO 19", "Read 1000h as a block without CRC, or refuse it", "CiA 301, 7.2.4.3.12", [], [], |bench| read(bench, DEVICE_TYPE, false)),
    case!("SDO 20", "Write 100Ch as a block without CRC, or refuse it", "CiA 301, 7.2.4.3.8", [Need::Writable(0x100C)], [], |bench| write(bench, GUARD_TIME, false)),
    case!("SDO 21", "Write 1017h as a block without CRC, or refuse it", "CiA 301, 7.2.4.3.8", [Need::Writable(0x1017)], [], |bench| write(bench, HEARTBEAT_TIME, false)),
    case!("SDO 22", "Read a long object as a block, or refuse it", "CiA 301, 7.2.4.3.12", [], [], |bench| read_long(bench, false)),
    case!("SDO 23", "Read a long object as a block with CRC, or refuse it", "CiA 301, 7.2.4.3.16", [], [], |bench| read_long(bench, true)),
    case!("SDO 24", "Write 100Ch as a block with CRC, or refuse it", "CiA 301, 7.2.4.3.16", [Need::Writable(0x100C)], [], |bench| write(bench, GUARD_TIME, true)),
    case!("SDO 25", "Write 1017h as a block with CRC, or refuse it", "CiA 301, 7.2.4.3.16", [Need::Writable(0x1017)], [], |bench| write(bench, HEARTBEAT_TIME, true)),
    case!("SDO 26", "Refuse a block of 128 segments", "CiA 301, 7.2.4.3.13", [], [], block_size),
    case!("SDO 27", "Refuse a sequence number beyond the block", "CiA 301, 7.2.4.3.14", [], [], sequence_number),
    case!("SDO 60", "Refuse a block download whose CRC is wrong, and keep the value", "CiA 301, 7.2.4.3.16", [Need::Writable(0x1017)], [], wrong_crc),
];

const UNKNOWN: AbortCode = AbortCode::UNKNOWN_COMMAND;
/// Segments in a block that this client asks for.
const BLOCK: u8 = 127;
const WITH_CRC: u8 = 1 << 2;
const SIZE_INDICATED: u8 = 1 << 1;

/// What a block transfer came to.
enum Block<T> {
    Done(T),
    Aborted(AbortCode),
}

async fn read(bench: &mut Bench, mux: Mux, with_crc: bool) -> Verdict {
    match upload(bench, mux, with_crc, BLOCK).await? {
        Block::Aborted(code) => refused(&format!("block upload of {mux}"), &Err::<(), _>(code), &[UNKNOWN]),
        Block::Done(data) => {
            let by_segments = bench.read(mux).await?;
            if data != by_segments {
                fail!("{mux} is {} as a block and {} otherwise", hex(&data), hex(&by_segments));
            }
            Ok(format!("{} bytes of {mux} came as a block", data.len()))
        }
    }
}

async fn read_long(bench: &mut Bench, with_crc: bool) -> Verdict {
    let rows = bench.subject.rows().filter(|row| row.access.is_readable());
    let longest = rows.max_by_key(|row| bench.subject.default_of(row).map_or(0, |data| data.len()));
    let mux = longest.map_or(DEVICE_TYPE, |row| row.mux());
    read(bench, mux, with_crc).await
}

/// A block upload. The threshold for a change to the ordinary protocol is 0: the server may not change (CiA 301, 7.2.4.3.13).
async fn upload(bench: &mut Bench, mux: Mux, with_crc: bool, block: u8) -> Result<Block<Vec<u8>>, Finding> {
    let [low, high] = mux.index.to_le_bytes();
    let command = 0xA0 | if with_crc { WITH_CRC } else { 0 };
    let answer = bench.exchange([command, low, high, mux.sub_index, block, 0, 0, 0]).await?;
    if let Reply::Abort(_, code) = Reply::parse(&answer) {
        return Ok(Block::Aborted(code));
    }
    if answer[0] & 0xE1 != 0xC0 {
        fail!("the answer to a block upload is {}", hex(&answer));
    }
    let crc = answer[0] & WITH_CRC != 0;
    let size =
        (answer[0] & SIZE_INDICATED != 0).then(|| u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]));
    bench.send(request(bench, [0xA3, 0, 0, 0, 0, 0, 0, 0]));
    let mut data = Vec::new();
    loop {
        let (last, count) = sub_block(bench, &mut data, block).await?;
        let end = bench.exchange_or_none([0xA2, count, block, 0, 0, 0, 0, 0], last).await?;
        if let Some(end) = end {
            return finish(bench, mux, data, end, crc && with_crc, size).await;
        }
    }
}

/// Segments up to the last of their sub-block; whether it is the last one of all, and how many there were.
async fn sub_block(bench: &mut Bench, data: &mut Vec<u8>, block: u8) -> Result<(bool, u8), Finding> {
    for expected in 1..=block {
        let Some(frame) = bench.answer().await else { fail!("segment {expected} of a block does not come") };
        let [head, bytes @ ..] = *frame.padded();
        if head == 0x80 {
            fail!("the block is aborted: {frame}");
        }
        if head & 0x7F != expected {
            fail!("segment {expected} of a block comes as number {}", head & 0x7F);
        }
        data.extend_from_slice(&bytes);
        if head & 0x80 != 0 {
            return Ok((true, expected));
        }
    }
    Ok((false, block))
}

async fn finish(
    bench: &mut Bench,
    mux: Mux,
    mut data: Vec<u8>,
    end: [u8; 8],
    crc: bool,
    size: Option<u32>,
) -> Result<Block<Vec<u8>>, Finding> {
    if end[0] & 0xE3 != 0xC1 {
        fail!("a block upload ends with {}", hex(&end));
    }
    let unused = usize::from(end[0] >> 2 & 0b111);
    data.truncate(data.len().saturating_sub(unused));
    let confirmation = request(bench, [0xA1, 0, 0, 0, 0, 0, 0, 0]);
    if let Some(answer) = bench.ask_briefly(confirmation).await {
        fail!("the client's confirmation of the end of a block upload is answered with {answer}");
    }
    if let Some(size) = size.filter(|size| *size as usize != data.len()) {
        fail!("{mux} was announced with {size} bytes and came with {}", data.len());
    }
    let says = u16::from_le_bytes([end[1], end[2]]);
    if crc && says != crc16(&data) {
        fail!("the CRC of {mux} is {:04X}h; the server says {says:04X}h", crc16(&data));
    }
    Ok(Block::Done(data))
}

fn request(bench: &Bench, data: [u8; 8]) -> Frame {
    Frame::full(connection_set::sdo_request(bench.node()), data)
}

async fn write(bench: &mut Bench, mux: Mux, with_crc: bool) -> Verdict {
    let mut data = bench.read(mux).await?;
    if let Some(low) = data.first_mut() {
        *low ^= 1;
    }
    bench.touch(mux).await?;
    match download(bench, mux, &data, with_crc, 0).await? {
        Block::Aborted(code) => refused(&format!("block download of {mux}"), &Err::<(), _>(code), &[UNKNOWN]),
        Block::Done(()) => {
            let after = bench.read(mux).await?;
            if after != data {
                fail!("{mux} was written with {} and reads as {}", hex(&data), hex(&after));
            }
            Ok(format!("{mux} took {} as a block and has it", hex(&data)))
        }
    }
}

/// A block download of up to seven bytes, with what is to be wrong in its CRC.
async fn download(bench: &mut Bench, mux: Mux, data: &[u8], with_crc: bool, wrong: u16) -> Result<Block<()>, Finding> {
    let [low, high] = mux.index.to_le_bytes();
    let [size, ..] = (data.len() as u32).to_le_bytes();
    let command = 0xC0 | SIZE_INDICATED | if with_crc { WITH_CRC } else { 0 };
    let answer = bench.exchange([command, low, high, mux.sub_index, size, 0, 0, 0]).await?;
    if let Reply::Abort(_, code) = Reply::parse(&answer) {
        return Ok(Block::Aborted(code));
    }
    if answer[0] & 0xE3 != 0xA0 || !(1..=127).contains(&answer[4]) {
        fail!("the answer to a block download is {}", hex(&answer));
    }
    let crc = answer[0] & WITH_CRC != 0 && with_crc;
    if !crc && wrong != 0 {
        // It waits for the segments.
        bench.end_transfer(mux).await;
        not_applicable!("the server does not check a CRC");
    }
    let mut segment = [0; 8];
    segment[0] = 0x81;
    segment[1..=data.len()].copy_from_slice(data);
    let answer = bench.exchange(segment).await?;
    if answer[0] & 0xE3 != 0xA2 || answer[1] != 1 {
        fail!("the answer to a sub-block of one segment is {}", hex(&answer));
    }
    let unused = 7 - data.len() as u8;
    let [low, high] = if crc { (crc16(data) ^ wrong).to_le_bytes() } else { [0, 0] };
    let answer = bench.exchange([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]).await?;
    match Reply::parse(&answer) {
        Reply::Abort(_, code) => Ok(Block::Aborted(code)),
        _ if answer[0] == 0xA1 => Ok(Block::Done(())),
        _ => fail!("the answer to the end of a block download is {}", hex(&answer)),
    }
}

async fn block_size(bench: &mut Bench) -> Verdict {
    let [low, high] = DEVICE_TYPE.index.to_le_bytes();
    let answer = bench.exchange([0xA0, low, high, 0, 128, 0, 0, 0]).await?;
    let seen = refused(
        "a block of 128 segments",
        &aborted(&answer),
        &[UNKNOWN, AbortCode::INVALID_BLOCK_SIZE, AbortCode::GENERAL],
    );
    bench.end_transfer(DEVICE_TYPE).await;
    seen
}

async fn sequence_number(bench: &mut Bench) -> Verdict {
    let [low, high] = DEVICE_TYPE.index.to_le_bytes();
    let answer = bench.exchange([0xA0, low, high, 0, BLOCK, 0, 0, 0]).await?;
    let codes = [UNKNOWN, AbortCode::INVALID_SEQUENCE_NUMBER, AbortCode::GENERAL];
    if let Reply::Abort(_, code) = Reply::parse(&answer) {
        return refused("block upload of 1000h", &Err::<(), _>(code), &codes);
    }
    bench.send(request(bench, [0xA3, 0, 0, 0, 0, 0, 0, 0]));
    sub_block(bench, &mut Vec::new(), BLOCK).await?;
    // One segment was sent; 100 were not.
    let answer = bench.exchange([0xA2, 100, BLOCK, 0, 0, 0, 0, 0]).await?;
    let seen = refused("the confirmation of 100 segments where one was sent", &aborted(&answer), &codes);
    bench.end_transfer(DEVICE_TYPE).await;
    seen
}

async fn wrong_crc(bench: &mut Bench) -> Verdict {
    let before = bench.read(HEARTBEAT_TIME).await?;
    let mut data = before.clone();
    if let Some(low) = data.first_mut() {
        *low ^= 1;
    }
    bench.touch(HEARTBEAT_TIME).await?;
    let answer = match download(bench, HEARTBEAT_TIME, &data, true, 0x5A5A).await? {
        Block::Aborted(UNKNOWN) => not_applicable!("the server has no block transfer"),
        Block::Aborted(code) => Err(code),
        Block::Done(()) => Ok(()),
    };
    let seen = refused("a block download with a wrong CRC", &answer, &[AbortCode::CRC_ERROR, AbortCode::GENERAL])?;
    let after = bench.read(HEARTBEAT_TIME).await?;
    if after != before {
        fail!("{seen}; and yet 1017h has {} instead of {}", hex(&after), hex(&before));
    }
    Ok(seen)
}

/// x^16 + x^12 + x^5 + 1, from 0 on (CiA 301, 7.2.4.3.16).
fn crc16(data: &[u8]) -> u16 {
    data.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 })
    })
}

impl Bench {
    /// Confirms a sub-block. After the last one the end of the transfer is the answer; before, the next segments follow.
    async fn exchange_or_none(&mut self, confirmation: [u8; 8], last: bool) -> Result<Option<[u8; 8]>, Finding> {
        if last {
            return self.exchange(confirmation).await.map(Some);
        }
        self.send(request(self, confirmation));
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    /// CiA 301, 7.2.4.3.16 gives the test vector.
    #[test]
    fn the_check_sum_of_the_digits_is_that_of_the_standard() {
        assert_eq!(super::crc16(b"123456789"), 0x31C3);
    }
}
