//! Modbus RTU: address, PDU and CRC, one frame between two silences (MODBUS over Serial Line V1.02, clause 2.5.1).
//!
//! A frame that is broken, too long or for nobody here is passed over. A line that fails is opened again.

use std::io;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc;
use tokio_serial::{SerialPortBuilder, SerialStream};

use super::pdu::MAX_PDU_LENGTH;
use super::{ModbusRequest, ask};
use crate::WallClock;

/// Address, PDU and CRC.
const MAX_FRAME_LENGTH: usize = MAX_PDU_LENGTH + 3;

/// The specification's silence is 3.5 characters; an operating system hands bytes over with gaps of its own that are
/// longer at the usual rates.
const SHORTEST_SILENCE: Duration = Duration::from_millis(5);

/// Bits of a character with start and stop.
const CHARACTER_BITS: u64 = 11;

/// Pause before a line that failed is opened again.
const REOPEN_PAUSE: Duration = Duration::from_millis(500);

/// Address of a request to all.
const BROADCAST: u8 = 0;

/// Serves a line until it is dropped.
pub(super) async fn serve<T: From<ModbusRequest>>(
    place: SerialPortBuilder,
    baud: u32,
    opened: SerialStream,
    requests: mpsc::Sender<T>,
    clock: WallClock,
) {
    let silence = silence(baud);
    let mut line = Some(opened);
    loop {
        if let Some(mut line) = line.take() {
            let _ = serve_line(&mut line, silence, &requests, &clock).await;
        }
        clock.sleep(REOPEN_PAUSE).await;
        line = SerialStream::open(&place).ok();
    }
}

/// What ends a frame.
fn silence(baud: u32) -> Duration {
    let characters = Duration::from_nanos(1_000_000_000 * CHARACTER_BITS * 7 / 2 / u64::from(baud.max(1)));
    characters.max(SHORTEST_SILENCE)
}

/// Answers one request after the other until the line fails.
async fn serve_line<T: From<ModbusRequest>>(
    line: &mut (impl AsyncRead + AsyncWrite + Unpin),
    silence: Duration,
    requests: &mpsc::Sender<T>,
    clock: &WallClock,
) -> io::Result<()> {
    loop {
        let frame = read_frame(line, silence, clock).await?;
        let Some((unit, request)) = open(&frame) else { continue };
        let response = ask(requests, unit, unit == BROADCAST, request).await;
        if let Some(response) = response.filter(|_| unit != BROADCAST) {
            line.write_all(&close(unit, &response)).await?;
            line.flush().await?;
        }
    }
}

/// All bytes up to the next silence; of too many, as many as show that they are too many.
async fn read_frame(line: &mut (impl AsyncRead + Unpin), silence: Duration, clock: &WallClock) -> io::Result<Vec<u8>> {
    let mut frame = Vec::new();
    let mut buffer = [0; MAX_FRAME_LENGTH];
    loop {
        let read = tokio::select! {
            read = line.read(&mut buffer) => read?,
            () = clock.sleep(silence), if !frame.is_empty() => return Ok(frame),
        };
        if read == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let room = MAX_FRAME_LENGTH + 1 - frame.len();
        frame.extend_from_slice(&buffer[..read.min(room)]);
    }
}

/// Address and PDU of a frame that is whole; `None` for one that is broken, too long, or without a PDU.
pub fn open(frame: &[u8]) -> Option<(u8, &[u8])> {
    let (content, check) = frame.split_last_chunk::<2>()?;
    let (unit, pdu) = content.split_first()?;
    let whole = frame.len() <= MAX_FRAME_LENGTH && !pdu.is_empty() && crc(content) == u16::from_le_bytes(*check);
    whole.then_some((*unit, pdu))
}

/// The frame of an address and a PDU.
pub fn close(unit: u8, pdu: &[u8]) -> Vec<u8> {
    let mut frame = [&[unit], pdu].concat();
    frame.extend(crc(&frame).to_le_bytes());
    frame
}

/// CRC-16 of x^16 + x^15 + x^2 + 1, low bit first, from FFFFh (clause 6.2.2).
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 != 0 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::super::{ModbusRequest, RegisterAccess};
    use super::*;

    /// The specification's example: 02 07 has the CRC 1241h (appendix B), sent low byte first.
    #[test]
    fn the_crc_is_that_of_the_specification() {
        assert_eq!(crc(&[0x02, 0x07]), 0x1241);
        assert_eq!(close(0x02, &[0x07]), [0x02, 0x07, 0x41, 0x12]);
        assert_eq!(crc(b"123456789"), 0x4B37, "the catalogue's check value of CRC-16/MODBUS");
    }

    #[test]
    fn a_frame_that_is_not_whole_is_passed_over() {
        let frame = close(1, &[0x03, 0, 0, 0, 1]);
        assert_eq!(open(&frame), Some((1, &[0x03, 0, 0, 0, 1][..])));
        for length in 0..frame.len() {
            assert_eq!(open(&frame[..length]), None, "{length}");
        }
        for bit in 0..frame.len() * 8 {
            let mut broken = frame.clone();
            broken[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(open(&broken), None, "bit {bit}");
        }
        assert_eq!(open(&close(1, &[0; MAX_PDU_LENGTH + 1])), None);
        assert_eq!(open(&close(1, &[])), None);
    }

    #[tokio::test]
    async fn a_line_is_answered_between_silences_and_not_for_others() {
        let clock = WallClock::start();
        let (mut ours, mut theirs) = tokio::io::duplex(1024);
        let (requests, mut incoming) = mpsc::channel::<ModbusRequest>(4);
        let line_clock = clock.clone();
        let line = tokio::spawn(async move { serve_line(&mut ours, silence(115_200), &requests, &line_clock).await });
        let units = tokio::spawn(async move {
            let mut heard = Vec::new();
            while let Some(request) = incoming.recv().await {
                heard.push((request.unit, request.broadcast, request.access.clone()));
                let answer = (request.unit <= 1).then_some(Ok(vec![0x1234]));
                request.answer(answer);
            }
            heard
        });
        let read = RegisterAccess::Read { address: 0x18, count: 1 };
        let pdu = [0x03, 0x00, 0x18, 0x00, 0x01];
        for (unit, noise) in [(2, false), (0, false), (9, true), (1, false)] {
            let mut frame = close(unit, &pdu);
            frame[3] ^= u8::from(noise);
            let (first, second) = frame.split_at(3);
            theirs.write_all(first).await.unwrap();
            theirs.write_all(second).await.unwrap();
            clock.sleep(Duration::from_millis(40)).await;
        }
        let mut answer = vec![0; 7];
        theirs.read_exact(&mut answer).await.unwrap();
        assert_eq!(open(&answer), Some((1, &[0x03, 0x02, 0x12, 0x34][..])));
        drop(theirs);
        assert!(line.await.unwrap().is_err(), "the end of the line is told");
        let expected = [(2, false, Ok(read.clone())), (0, true, Ok(read.clone())), (1, false, Ok(read))];
        assert_eq!(units.await.unwrap(), expected);
    }
}
