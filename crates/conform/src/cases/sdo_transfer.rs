//! SDO 13 to 18: segmented transfers, and what breaks them off.

use can::Frame;
use canopen::od::{Access, Entry, Kind};
use canopen::sdo::wire::{Payload, Reply, Request, Segment};
use canopen::{AbortCode, Mux};

use crate::bench::{Bench, SdoResult, hex, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("SDO 13", "Read 1000h in segments, where the server uses them", "CiA 301, 7.2.4.3.6", [], [], read_device_type),
    case!("SDO 14", "Write 100Ch in segments", "CiA 301, 7.2.4.3.4", [Need::Writable(0x100C)], [], |bench| segmented_write(bench, Mux::new(0x100C, 0))),
    case!("SDO 15", "Write 1017h in segments", "CiA 301, 7.2.4.3.4", [Need::Writable(0x1017)], [], |bench| segmented_write(bench, Mux::new(0x1017, 0))),
    case!("SDO 16", "Read an object of more than four bytes", "CiA 301, 7.2.4.3.6", [], ["version_is_number"], segmented_read),
    case!("SDO 17", "Refuse a wrong toggle bit", "CiA 301, 7.2.4.3.17", [], [], wrong_toggle),
    case!("SDO 18", "Read objects in segments, each as long as announced", "CiA 301, 7.2.4.3.6", [], [], all_long_objects),
    case!("SDO 55", "An abort of the client ends a transfer", "CiA 301, 7.2.4.3.17", [], [], client_abort),
    case!("SDO 56", "A new request ends a transfer that is under way", "CiA 301, 7.2.4.1", [], [], new_request),
    case!("SDO 57", "Refuse a segment that no transfer waits for", "CiA 301, 7.2.4.3.17", [], [], stray_segment),
    case!("SDO 58", "Refuse a wrong toggle bit of a download, and keep the value", "CiA 301, 7.2.4.3.17", [], [], wrong_toggle_of_download),
    case!("SDO 59", "Refuse more bytes than were announced, and keep the value", "CiA 301, 7.2.4.3.17", [], [], more_than_announced),
];

const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);

async fn read_device_type(bench: &mut Bench) -> Verdict {
    let data = bench.read(DEVICE_TYPE).await?;
    if data.len() != 4 {
        fail!("1000h has {} bytes, not 4", data.len());
    }
    Ok(format!("{} in {} bytes", hex(&data), data.len()))
}

async fn segmented_write(bench: &mut Bench, mux: Mux) -> Verdict {
    let mut data = bench.read(mux).await?;
    let Some(low) = data.first_mut() else { fail!("{mux} has no bytes") };
    *low ^= 1;
    bench.touch(mux).await?;
    match bench.download_segmented(mux, &data).await? {
        Err(AbortCode::UNKNOWN_COMMAND) => {
            not_applicable!("the server has no segmented download: {}", AbortCode::UNKNOWN_COMMAND)
        }
        Err(code) => fail!("{mux} does not take {} in segments: {code}", hex(&data)),
        Ok(()) => {}
    }
    let after = bench.read(mux).await?;
    if after != data {
        fail!("{mux} was written with {} and reads as {}", hex(&data), hex(&after));
    }
    Ok(format!("{mux} took {} and has it", hex(&data)))
}

/// Objects whose value, as described, does not fit one frame.
fn long_objects(bench: &Bench) -> Vec<&'static Entry> {
    let longer = |row: &&Entry| {
        let by_type = row.data_type.size() > 4;
        let by_value =
            row.data_type.kind() == Kind::Bytes && bench.subject.default_of(row).is_some_and(|data| data.len() > 4);
        row.access.is_readable() && (by_type || by_value)
    };
    bench.subject.rows().filter(longer).collect()
}

fn long_object(bench: &Bench) -> Result<&'static Entry, Finding> {
    let rows = long_objects(bench);
    // The longest, so that there are segments to go wrong.
    let longest = rows.into_iter().max_by_key(|row| bench.subject.default_of(row).map_or(0, |data| data.len()));
    longest.ok_or_else(|| Finding::NotApplicable("no object has more than four bytes".into()))
}

async fn segmented_read(bench: &mut Bench) -> Verdict {
    let row = long_object(bench)?;
    let answer = bench.exchange(Request::InitiateUpload(row.mux()).emit()).await?;
    let Reply::InitiateUpload(_, Payload::Segmented { size }) = Reply::parse(&answer) else {
        fail!("the answer to the upload of {} does not begin a segmented transfer", row.mux());
    };
    bench.end_transfer(row.mux()).await;
    let data = bench.read(row.mux()).await?;
    let size = size.map_or("no size".to_owned(), |size| format!("{size} bytes"));
    Ok(format!("{}: {size} announced, {} came", row.mux(), data.len()))
}

async fn all_long_objects(bench: &mut Bench) -> Verdict {
    let rows = long_objects(bench);
    if rows.is_empty() {
        not_applicable!("no object has more than four bytes");
    }
    for row in &rows {
        let data = bench.read(row.mux()).await?;
        let constant = row.constant_bytes().filter(|_| row.access == Access::Const || row.access == Access::ReadOnly);
        if let Some(expected) = constant.filter(|expected| !expected.is_empty())
            && matches!(row.index, 0x1008..=0x100A)
            && data != expected
        {
            fail!("{} reads as {}; the description has {}", row.mux(), hex(&data), hex(expected));
        }
    }
    Ok(format!("{} objects", rows.len()))
}

async fn wrong_toggle(bench: &mut Bench) -> Verdict {
    let row = begin_upload(bench).await?;
    let answer = bench.exchange(Request::UploadSegment { toggle: true }.emit()).await?;
    let aborted = aborted(&answer);
    bench.end_transfer(row.mux()).await;
    refused(
        "the first segment asked for with the toggle bit set",
        &aborted,
        &[AbortCode::TOGGLE_BIT, AbortCode::GENERAL],
    )
}

/// An upload of a long object, up to its initiation.
pub(super) async fn begin_upload(bench: &mut Bench) -> Result<&'static Entry, Finding> {
    let row = long_object(bench)?;
    let answer = bench.exchange(Request::InitiateUpload(row.mux()).emit()).await?;
    match Reply::parse(&answer) {
        Reply::InitiateUpload(about, Payload::Segmented { .. }) if about == row.mux() => Ok(row),
        other => fail!("the answer to the upload of {} is {other:?}", row.mux()),
    }
}

async fn client_abort(bench: &mut Bench) -> Verdict {
    let row = begin_upload(bench).await?;
    let id = canopen::connection_set::sdo_request(bench.node());
    let abort = Frame::full(id, Request::Abort(row.mux(), AbortCode::GENERAL).emit());
    if let Some(answer) = bench.ask_briefly(abort).await {
        fail!("the client's abort was answered with {answer}");
    }
    let answer = bench.exchange(Request::UploadSegment { toggle: false }.emit()).await?;
    refused("a segment asked for after the client's abort", &aborted(&answer), &STRAY)?;
    bench.read(DEVICE_TYPE).await?;
    Ok("the transfer has ended; 1000h is read after it".into())
}

async fn new_request(bench: &mut Bench) -> Verdict {
    begin_upload(bench).await?;
    // The server may refuse the first request, and with it end what is under way, which its abort may name.
    if let Err(code) = aborted(&bench.exchange(Request::InitiateUpload(DEVICE_TYPE).emit()).await?) {
        let data = bench.read(DEVICE_TYPE).await?;
        return Ok(format!("aborted with {code}; then 1000h is read as {}", hex(&data)));
    }
    let data = bench.read(DEVICE_TYPE).await?;
    let expected = bench.subject.description.identity.device_type.to_le_bytes();
    if data != expected {
        fail!("1000h reads as {} while an upload is under way; expected {}", hex(&data), hex(&expected));
    }
    Ok("1000h is read".into())
}

/// What a segment without a transfer may be refused with.
const STRAY: [AbortCode; 3] = [AbortCode::UNKNOWN_COMMAND, AbortCode::TOGGLE_BIT, AbortCode::GENERAL];

async fn stray_segment(bench: &mut Bench) -> Verdict {
    for request in [Request::UploadSegment { toggle: false }, Request::DownloadSegment(Segment::new(false, true, &[1]))]
    {
        let answer = bench.exchange(request.emit()).await?;
        refused("a segment without a transfer", &aborted(&answer), &STRAY)?;
    }
    Ok("both directions are refused".into())
}

/// Begins a segmented download of a harmless object; its value before, or that the server has none.
async fn begin_download(bench: &mut Bench) -> Result<(Mux, Vec<u8>), Finding> {
    let Some(row) = bench.subject.harmless().find(|row| row.data_type.size() == 2) else {
        not_applicable!("no object of 1000h to 1FFFh can be written without harm");
    };
    let mux = row.mux();
    let before = bench.read(mux).await?;
    bench.touch(mux).await?;
    let size = Some(before.len() as u32);
    let answer = bench.exchange(Request::InitiateDownload(mux, Payload::Segmented { size }).emit()).await?;
    match Reply::parse(&answer) {
        Reply::InitiateDownload(about) if about == mux => Ok((mux, before)),
        Reply::Abort(_, AbortCode::UNKNOWN_COMMAND) => not_applicable!("the server has no segmented download"),
        other => fail!("the answer to the download of {mux} is {other:?}"),
    }
}

async fn wrong_toggle_of_download(bench: &mut Bench) -> Verdict {
    let (mux, before) = begin_download(bench).await?;
    let segment = Segment::new(true, true, &inverted(&before));
    let answer = bench.exchange(Request::DownloadSegment(segment).emit()).await?;
    let seen = refused(
        "the first segment with the toggle bit set",
        &aborted(&answer),
        &[AbortCode::TOGGLE_BIT, AbortCode::GENERAL],
    );
    kept(bench, mux, &before, seen).await
}

async fn more_than_announced(bench: &mut Bench) -> Verdict {
    let (mux, before) = begin_download(bench).await?;
    let mut data = inverted(&before);
    data.push(0);
    let answer = bench.exchange(Request::DownloadSegment(Segment::new(false, true, &data)).emit()).await?;
    let codes = [AbortCode::LENGTH_MISMATCH, AbortCode::TOO_LONG, AbortCode::GENERAL];
    let seen = refused("three bytes where two were announced", &aborted(&answer), &codes);
    kept(bench, mux, &before, seen).await
}

/// The lowest bit inverted: another value, and a small one.
fn inverted(data: &[u8]) -> Vec<u8> {
    let mut data = data.to_vec();
    if let Some(low) = data.first_mut() {
        *low ^= 1;
    }
    data
}

async fn kept(bench: &mut Bench, mux: Mux, before: &[u8], seen: Verdict) -> Verdict {
    bench.end_transfer(mux).await;
    let seen = seen?;
    let after = bench.read(mux).await?;
    if after != before {
        fail!("{seen}; and yet {mux} has {} instead of {}", hex(&after), hex(before));
    }
    Ok(format!("{seen}; {mux} is as it was"))
}

/// An answer that should be an abort.
pub(super) fn aborted(answer: &[u8; 8]) -> SdoResult<()> {
    match Reply::parse(answer) {
        // A segment of a block begins with 81h and more.
        Reply::Abort(_, code) if answer[0] == 0x80 => Err(code),
        _ => Ok(()),
    }
}
