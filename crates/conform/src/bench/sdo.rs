//! An SDO client that shows each frame: what is right and what a case makes wrong.

use can::Frame;
use canopen::od::DataType;
use canopen::sdo::wire::{Payload, Reply, Request, Segment};
use canopen::{AbortCode, Mux};

use super::{Bench, SILENCE, ms};
use crate::finding::{Finding, Verdict, fail};
use crate::subject::number_of;

/// What a server made of a request: it did it, or aborted.
pub(crate) type SdoResult<T> = Result<T, AbortCode>;

/// Most segments that are read: a server that does not come to an end is wrong.
const MOST_SEGMENTS: usize = 1 << 16;

impl Bench {
    /// Sends eight bytes to the server and takes its answer.
    pub(crate) async fn exchange(&mut self, request: [u8; 8]) -> Result<[u8; 8], Finding> {
        let frame = Frame::full(self.server.0, request);
        let Some(answer) = self.ask(frame).await else {
            fail!("no answer to {frame} within {} ms", self.timeout.as_millis());
        };
        if answer.dlc() != 8 {
            fail!("the answer {answer} has {} bytes, not 8", answer.dlc());
        }
        Ok(*answer.padded())
    }

    /// Sends a frame of any form; the server's answer, if it gives one.
    pub(crate) async fn ask(&mut self, frame: Frame) -> Option<Frame> {
        self.absorb();
        self.send(frame);
        self.answer().await
    }

    /// The server's next frame.
    pub(crate) async fn answer(&mut self) -> Option<Frame> {
        let reply = self.server.1;
        let heard = self.wait_for(self.timeout, |frame| frame.id() == reply && !frame.is_remote()).await;
        heard.map(|passed| passed.frame)
    }

    /// Sends a frame that need not be answered; the answer, if there is one.
    pub(crate) async fn ask_briefly(&mut self, frame: Frame) -> Option<Frame> {
        self.absorb();
        self.send(frame);
        self.further_answer().await
    }

    /// A frame of the server that was not asked for.
    pub(crate) async fn further_answer(&mut self) -> Option<Frame> {
        let reply = self.server.1;
        self.wait_for(SILENCE, |frame| frame.id() == reply).await.map(|passed| passed.frame)
    }

    /// Reads an object.
    pub(crate) async fn upload(&mut self, mux: Mux) -> Result<SdoResult<Vec<u8>>, Finding> {
        let reply = Reply::parse(&self.exchange(Request::InitiateUpload(mux).emit()).await?);
        let size = match reply {
            Reply::Abort(about, code) => return aborted(mux, about, code),
            Reply::InitiateUpload(about, Payload::Expedited { length, bytes }) if about == mux => {
                return Ok(Ok(bytes[..usize::from(length.unwrap_or(4)).min(4)].to_vec()));
            }
            Reply::InitiateUpload(about, Payload::Segmented { size }) if about == mux => size,
            other => fail!("the answer to the upload of {mux} is {other:?}"),
        };
        let mut data = Vec::new();
        let mut toggle = false;
        for _ in 0..MOST_SEGMENTS {
            let reply = Reply::parse(&self.exchange(Request::UploadSegment { toggle }.emit()).await?);
            let segment = match reply {
                Reply::Abort(_, code) => return Ok(Err(code)),
                Reply::UploadSegment(segment) => segment,
                other => fail!("the answer to the request of a segment of {mux} is {other:?}"),
            };
            if segment.toggle != toggle {
                fail!("the toggle bit of a segment of {mux} is not that of its request");
            }
            data.extend_from_slice(segment.data());
            toggle = !toggle;
            if segment.last {
                return match size.filter(|size| *size as usize != data.len()) {
                    Some(size) => fail!("{mux} was announced with {size} bytes and came with {}", data.len()),
                    None => Ok(Ok(data)),
                };
            }
        }
        fail!("the upload of {mux} does not come to an end")
    }

    /// Writes an object, in one frame where it fits.
    pub(crate) async fn download(&mut self, mux: Mux, data: &[u8]) -> Result<SdoResult<()>, Finding> {
        let Some(payload) = Payload::expedited(data) else { return self.download_segmented(mux, data).await };
        self.initiate_download(mux, payload).await
    }

    /// Writes an object in segments, whatever its length.
    pub(crate) async fn download_segmented(&mut self, mux: Mux, data: &[u8]) -> Result<SdoResult<()>, Finding> {
        let begun = self.initiate_download(mux, Payload::Segmented { size: Some(data.len() as u32) }).await?;
        if begun.is_err() {
            return Ok(begun);
        }
        let mut toggle = false;
        let parts: Vec<&[u8]> = if data.is_empty() { vec![&[]] } else { data.chunks(7).collect() };
        for (position, part) in parts.iter().enumerate() {
            let segment = Segment::new(toggle, position + 1 == parts.len(), part);
            match Reply::parse(&self.exchange(Request::DownloadSegment(segment).emit()).await?) {
                Reply::Abort(_, code) => return Ok(Err(code)),
                Reply::DownloadSegment { toggle: answered } if answered == toggle => {}
                Reply::DownloadSegment { .. } => fail!("the toggle bit that confirms a segment is not the segment's"),
                other => fail!("the answer to a segment of {mux} is {other:?}"),
            }
            toggle = !toggle;
        }
        Ok(Ok(()))
    }

    /// Aborts what is under way, as a client does; that is not answered.
    pub(crate) async fn end_transfer(&mut self, mux: Mux) {
        self.send(Frame::full(self.server.0, Request::Abort(mux, AbortCode::GENERAL).emit()));
        self.pause(ms(10)).await;
    }

    async fn initiate_download(&mut self, mux: Mux, payload: Payload) -> Result<SdoResult<()>, Finding> {
        match Reply::parse(&self.exchange(Request::InitiateDownload(mux, payload).emit()).await?) {
            Reply::Abort(about, code) => aborted(mux, about, code),
            Reply::InitiateDownload(about) if about == mux => Ok(Ok(())),
            other => fail!("the answer to the download of {mux} is {other:?}"),
        }
    }

    /// Reads an object that must be readable.
    pub(crate) async fn read(&mut self, mux: Mux) -> Result<Vec<u8>, Finding> {
        match self.upload(mux).await? {
            Ok(data) => Ok(data),
            Err(code) => fail!("{mux} cannot be read: {code}"),
        }
    }

    /// Reads a number of the type that its row has, or else one without a sign.
    pub(crate) async fn number(&mut self, mux: Mux) -> Result<i64, Finding> {
        let data = self.read(mux).await?;
        let by_length = match data.len() {
            1 => DataType::Unsigned8,
            2 => DataType::Unsigned16,
            _ => DataType::Unsigned32,
        };
        let row = self.subject.description.row(mux);
        match number_of(row.map_or(by_length, |row| row.data_type), &data) {
            Some(number) => Ok(number),
            None => fail!(
                "{mux} has {} bytes, not those of {}",
                data.len(),
                row.map_or(by_length, |row| row.data_type).name()
            ),
        }
    }

    /// Writes an object that must take the value; what it had comes back after the case.
    pub(crate) async fn write(&mut self, mux: Mux, data: &[u8]) -> Result<(), Finding> {
        match self.try_write(mux, data).await? {
            Ok(()) => Ok(()),
            Err(code) => fail!("{mux} does not take {}: {code}", hex(data)),
        }
    }

    /// Writes an object that may refuse the value; what it had comes back after the case.
    pub(crate) async fn try_write(&mut self, mux: Mux, data: &[u8]) -> Result<SdoResult<()>, Finding> {
        self.touch(mux).await?;
        let written = self.download(mux, data).await?;
        if written.is_err() {
            self.restorer.untouch(mux);
        }
        Ok(written)
    }

    /// What an object has now comes back after the case: for a case that writes it frame by frame.
    pub(crate) async fn touch(&mut self, mux: Mux) -> Result<(), Finding> {
        let readable = self.subject.description.row(mux).is_none_or(|row| row.access.is_readable());
        if readable && let Ok(before) = self.upload(mux).await? {
            self.restorer.touch(mux, before);
        }
        Ok(())
    }
}

/// An abort of a request about an object. That it names none is for SDO 53 to judge; an abort about another does not answer this one.
fn aborted<T>(asked: Mux, about: Mux, code: AbortCode) -> Result<SdoResult<T>, Finding> {
    if about != asked && about != Mux::new(0, 0) {
        fail!("the request was about {asked}, and is aborted as one about {about}: {code}");
    }
    Ok(Err(code))
}

/// Judges an answer that has to be an abort with one of these codes.
pub(crate) fn refused<T>(what: &str, answer: &SdoResult<T>, accepted: &[AbortCode]) -> Verdict {
    match answer {
        Err(code) if accepted.contains(code) => Ok(format!("{what}: aborted with {code}")),
        Err(code) => fail!("{what}: aborted with {code}; expected {}", listed(accepted)),
        Ok(_) => fail!("{what}: accepted; expected {}", listed(accepted)),
    }
}

fn listed(codes: &[AbortCode]) -> String {
    let words: Vec<String> =
        codes.iter().map(|AbortCode(code)| format!("{:04X} {:04X}h", code >> 16, code & 0xFFFF)).collect();
    words.join(" or ")
}

/// Few bytes as a number, more one after the other.
pub(crate) fn hex(data: &[u8]) -> String {
    if data.len() <= 4 {
        return data.iter().rev().map(|byte| format!("{byte:02X}")).collect::<String>() + "h";
    }
    data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
