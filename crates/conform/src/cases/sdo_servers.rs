//! SDO 61 to 68: servers beside the first one, 1201h to 127Fh (CiA 301, 7.5.2.33).

use can::CanId;
use canopen::sdo::parameter::{self, is_further_server};
use canopen::sdo::wire::{Reply, Request, Segment};
use canopen::{AbortCode, CobId, Mux};

use super::sdo_transfer::{aborted, begin_upload};
use crate::bench::{Bench, default_server, hex, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("SDO 61", "Valid COB-IDs of further servers are identifiers of their own", "CiA 301, 7.3.5", [Need::FurtherServer], [], own_identifiers),
    case!("SDO 62", "A further server answers under its identifier, and under no other", "CiA 301, 7.5.2.33", [Need::FurtherServer], [], answers),
    case!("SDO 63", "A transfer on a further server does not touch one on the first", "CiA 301, 7.2.4.1", [Need::FurtherServer], [], side_by_side),
    case!("SDO 64", "An abort on a further server ends no transfer on the first", "CiA 301, 7.2.4.3.17", [Need::FurtherServer], [], abort_of_one),
    case!("SDO 65", "A further server refuses with the abort codes of the first", "CiA 301, 7.2.4.3.17", [Need::FurtherServer], [], abort_codes),
    case!("SDO 66", "Refuse another identifier while the COB-ID of a server is valid", "CiA 301, 7.5.2.33", [Need::FurtherServer], [], changed_while_valid),
    case!("SDO 67", "A further server with bit 31 in its COB-ID does not answer", "CiA 301, 7.5.2.33", [Need::FurtherServer], [], switched_off),
    case!("SDO 68", "Refuse a restricted identifier for a further server", "CiA 301, 7.3.5", [Need::FurtherServer], [], restricted),
];

const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);
/// Identifiers that no service of the predefined connection set has, and none that is restricted.
const FREE: [u16; 2] = [0x6C0, 0x6C1];
const FREE_TOO: u32 = 0x6C2;
/// What a refused COB-ID is refused with.
const COB_ID_REFUSED: [AbortCode; 4] =
    [AbortCode::INVALID_VALUE, AbortCode::DEVICE_STATE, AbortCode::LOCAL_CONTROL, AbortCode::GENERAL];

/// A further server that is valid.
struct Further {
    /// Its record.
    index: u16,
    /// Identifiers of requests and replies.
    ids: (CanId, CanId),
}

/// The records of all further servers.
fn records(bench: &Bench) -> impl Iterator<Item = u16> + use<> {
    bench.subject.rows().filter(|row| is_further_server(row.index) && row.sub_index == 1).map(|row| row.index)
}

async fn cob_ids(bench: &mut Bench, index: u16) -> Result<[CobId; 2], Finding> {
    let request = bench.number(Mux::new(index, 1)).await?;
    let reply = bench.number(Mux::new(index, 2)).await?;
    Ok([request, reply].map(|value| CobId(value as u32)))
}

/// The first further server: as it is where it is valid, or else with free identifiers, which come off again after the case.
async fn open(bench: &mut Bench) -> Result<Further, Finding> {
    let Some(index) = records(bench).next() else { not_applicable!("the device has no further server") };
    let [request, reply] = cob_ids(bench, index).await?;
    if let Some((request, reply)) = parameter::identifiers(request, reply) {
        return Ok(Further { index, ids: (CanId::standard(request), reply) });
    }
    for (sub_index, id) in (1..).zip(FREE) {
        let mux = Mux::new(index, sub_index);
        if let Err(code) = bench.try_write(mux, &u32::from(id).to_le_bytes()).await? {
            not_applicable!("the server of {index:04X}h is not valid, and {mux} does not take {id:03X}h: {code}");
        }
    }
    let [request, reply] = FREE.map(CanId::standard);
    Ok(Further { index, ids: (request, reply) })
}

async fn own_identifiers(bench: &mut Bench) -> Verdict {
    let (request, reply) = default_server(bench.node());
    let mut taken = vec![request, reply];
    let mut servers = 0;
    for index in records(bench) {
        for (sub_index, cob) in (1..).zip(cob_ids(bench, index).await?) {
            let at = format!("{} is {:08X}h", Mux::new(index, sub_index), cob.0);
            match cob {
                _ if !cob.is_valid() => continue,
                _ if cob.is_restricted() => fail!("{at}, an identifier that no further server may have"),
                _ if taken.contains(&cob.can_id()) => fail!("{at}, the identifier of another server"),
                _ => taken.push(cob.can_id()),
            }
        }
        servers += 1;
    }
    Ok(format!("{servers} further servers"))
}

async fn answers(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    let expected = bench.read(DEVICE_TYPE).await?;
    let first = default_server(bench.node());
    bench.count(first.1);
    bench.ask_server(further.ids);
    let seen = bench.read(DEVICE_TYPE).await?;
    if seen != expected {
        fail!("1000h is {} by the server of {:04X}h and {} by the first", hex(&seen), further.index, hex(&expected));
    }
    if let Some(second) = bench.further_answer().await {
        fail!("the request was answered a second time: {second}");
    }
    match bench.last_counted() {
        Some(frame) => {
            fail!("a request to the server of {:04X}h was answered by the first too: {frame}", further.index)
        }
        None => Ok(format!("1000h by {:04X}h, asked with {:?}", further.index, further.ids.0)),
    }
}

/// Takes the rest of an upload of which the initiation is answered, a segment of it for each upload on the other server.
async fn side_by_side(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    let first = default_server(bench.node());
    let row = begin_upload(bench).await?;
    bench.end_transfer(row.mux()).await;
    let expected = bench.read(row.mux()).await?;

    let mut parts = [Vec::new(), Vec::new()];
    for server in [first, further.ids] {
        bench.ask_server(server);
        begin_upload(bench).await?;
    }
    let mut toggle = false;
    for _ in expected.chunks(7) {
        for (server, part) in [first, further.ids].into_iter().zip(&mut parts) {
            bench.ask_server(server);
            part.extend_from_slice(segment(bench, toggle).await?.data());
        }
        toggle = !toggle;
    }
    for (part, of) in parts.iter().zip(["the first server", "the further one"]) {
        if *part != expected {
            fail!("{} came from {of} as {}; expected {}", row.mux(), hex(part), hex(&expected));
        }
    }
    Ok(format!("{} came from both servers, segment by segment in turn", row.mux()))
}

async fn segment(bench: &mut Bench, toggle: bool) -> Result<Segment, Finding> {
    match Reply::parse(&bench.exchange(Request::UploadSegment { toggle }.emit()).await?) {
        Reply::UploadSegment(segment) => Ok(segment),
        other => fail!("the answer to the request of a segment is {other:?}"),
    }
}

async fn abort_of_one(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    let first = default_server(bench.node());
    bench.ask_server(further.ids);
    let row = begin_upload(bench).await?;
    bench.ask_server(first);
    begin_upload(bench).await?;
    // The first has a segment to come at least: the object is longer than four bytes.
    bench.ask_server(further.ids);
    bench.end_transfer(row.mux()).await;
    bench.ask_server(first);
    let part = segment(bench, false).await?.data().to_vec();
    bench.end_transfer(row.mux()).await;
    let whole = bench.read(row.mux()).await?;
    if part.is_empty() || !whole.starts_with(&part) {
        fail!("after an abort on the server of {:04X}h the first sends {}", further.index, hex(&part));
    }
    Ok(format!("the first server goes on with {}", row.mux()))
}

async fn abort_codes(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    let device_type = bench.read(DEVICE_TYPE).await?;
    bench.ask_server(further.ids);
    // CiA 301 reserves 1004h: no device has it.
    let missing = bench.upload(Mux::new(0x1004, 0)).await?;
    refused("read of 1004h", &missing, &[AbortCode::NO_SUCH_OBJECT, AbortCode::GENERAL])?;
    let sub_index = bench.upload(Mux::new(0x1000, 1)).await?;
    refused("read of 1000h:01", &sub_index, &[AbortCode::NO_SUCH_SUB_INDEX, AbortCode::GENERAL])?;
    let read_only = bench.download(DEVICE_TYPE, &device_type).await?;
    let codes = [AbortCode::UNSUPPORTED_ACCESS, AbortCode::READ_ONLY, AbortCode::GENERAL];
    refused("write of 1000h", &read_only, &codes)?;
    let unknown = aborted(&bench.exchange([0xE0, 0x00, 0x10, 0, 0, 0, 0, 0]).await?);
    refused("command specifier 7", &unknown, &[AbortCode::UNKNOWN_COMMAND, AbortCode::GENERAL])?;
    Ok(format!("four requests to {:04X}h are refused", further.index))
}

async fn changed_while_valid(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    for sub_index in [1, 2] {
        let mux = Mux::new(further.index, sub_index);
        if bench.subject.row(mux.index, mux.sub_index).is_none_or(|row| !row.access.is_writable()) {
            not_applicable!("{mux} cannot be written");
        }
        let before = bench.read(mux).await?;
        let answer = bench.try_write(mux, &FREE_TOO.to_le_bytes()).await?;
        refused(&format!("{FREE_TOO:03X}h for {mux}, which is {}", hex(&before)), &answer, &COB_ID_REFUSED)?;
    }
    bench.ask_server(further.ids);
    bench.read(DEVICE_TYPE).await?;
    Ok("refused for both COB-IDs; the server answers as before".into())
}

async fn switched_off(bench: &mut Bench) -> Verdict {
    let further = open(bench).await?;
    let mux = Mux::new(further.index, 1);
    let off = further.ids.0.raw() | CobId::INVALID;
    if let Err(code) = bench.try_write(mux, &off.to_le_bytes()).await? {
        // CiA 301, 7.5.2.33 lets a server's identifiers be constant.
        not_applicable!("{mux} does not take bit 31: {code}");
    }
    let first = default_server(bench.node());
    bench.ask_server(further.ids);
    let asked = can::Frame::full(further.ids.0, Request::InitiateUpload(DEVICE_TYPE).emit());
    if let Some(answer) = bench.ask_briefly(asked).await {
        fail!("{mux} has bit 31, and {asked} was answered with {answer}");
    }
    bench.ask_server(first);
    bench.read(DEVICE_TYPE).await?;
    Ok(format!("{asked} is not answered; the first server answers"))
}

async fn restricted(bench: &mut Bench) -> Verdict {
    let Some(index) = records(bench).next() else { not_applicable!("the device has no further server") };
    let mux = Mux::new(index, 1);
    if bench.subject.row(index, 1).is_none_or(|row| !row.access.is_writable()) {
        not_applicable!("{mux} cannot be written");
    }
    // A valid COB-ID would be refused for the change alone.
    let off = bench.number(mux).await? as u32 | CobId::INVALID;
    if let Err(code) = bench.try_write(mux, &off.to_le_bytes()).await? {
        not_applicable!("{mux} does not take bit 31: {code}");
    }
    for id in [0x000, 0x101, 0x601, 0x701_u32] {
        let answer = bench.try_write(mux, &id.to_le_bytes()).await?;
        refused(&format!("{id:03X}h for {mux}"), &answer, &COB_ID_REFUSED)?;
    }
    Ok("000h, 101h, 601h and 701h are refused".into())
}
