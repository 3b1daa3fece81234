//! SDO 01 to 12 and 28 to 30: single requests, and what a server has to refuse.

use can::Frame;
use canopen::od::{Access, Entry};
use canopen::sdo::wire::{Payload, Reply, Request};
use canopen::{AbortCode, Mux, NmtCommand, connection_set};

use crate::bench::{Bench, SdoResult, hex, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Verdict, fail, not_applicable};
use crate::subject::{Subject, bytes_of};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("SDO 01", "Read 1000h in one frame", "CiA 301, 7.2.4.3.5", [], [], expedited_upload),
    case!("SDO 02", "Write and read an object of the communication profile", "CiA 301, 7.2.4.3.3", [], [], write_and_read),
    case!("SDO 03", "Refuse a write to 1000h", "CiA 301, 7.2.4.3.17", [], [], write_read_only),
    case!("SDO 04", "Refuse the read of a write-only object", "CiA 301, 7.2.4.3.17", [], [], read_write_only),
    case!("SDO 05", "Refuse the read of a missing sub-index, 1000h:01", "CiA 301, 7.2.4.3.17", [], [], missing_sub_index),
    case!("SDO 06", "Refuse the read of a missing object, 1004h", "CiA 301, 7.2.4.3.17", [], [], missing_object),
    case!("SDO 07", "Refuse an unknown command specifier", "CiA 301, 7.2.4.3.17", [], [], unknown_command),
    case!("SDO 08", "Refuse four bytes for an object of one or two", "CiA 301, 7.2.4.3.17", [], [], too_long),
    case!("SDO 09", "Refuse one byte for an object of two or four", "CiA 301, 7.2.4.3.17", [], [], too_short),
    case!("SDO 10", "Refuse a value above the limit", "CiA 301, 7.2.4.3.17", [], [], too_high),
    case!("SDO 11", "Refuse a value below the limit", "CiA 301, 7.2.4.3.17", [], [], too_low),
    case!("SDO 12", "Identifiers of the first server, 1200h", "CiA 301, 7.5.2.33", [Need::Index(0x1200)], [], server_identifiers),
    case!("SDO 28", "Further servers and clients, 1201h and 1280h on, are there or refused", "CiA 301, 7.5.2.33", [], [], further_channels),
    case!("SDO 29", "The same after reset communication", "CiA 301, 7.5.2.33", [], [], further_channels_after_reset),
    case!("SDO 30", "The same after save and reset communication", "CiA 301, 7.5.2.13", [Need::Index(0x1010), Need::Store], [], further_channels_after_save),
    case!("SDO 51", "Frames of fewer than eight bytes do no harm", "CiA 301, 7.2.4.3", [], [], short_frames),
    case!("SDO 52", "Remote frames of the server's identifier do no harm", "CiA 301, 7.2.4.3", [], [], remote_frame),
    case!("SDO 53", "One answer for each request, about its object", "CiA 301, 7.2.4.3", [], [], one_answer_each),
    case!("SDO 54", "A missing sub-index of a record is not a missing object", "CiA 301, 7.2.4.3.17", [], [], missing_sub_index_of_record),
];

const UNSUPPORTED: AbortCode = AbortCode::UNSUPPORTED_ACCESS;
const GENERAL: AbortCode = AbortCode::GENERAL;
const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);

async fn expedited_upload(bench: &mut Bench) -> Verdict {
    let answer = bench.exchange(Request::InitiateUpload(DEVICE_TYPE).emit()).await?;
    let Reply::InitiateUpload(DEVICE_TYPE, Payload::Expedited { length: Some(4), bytes }) = Reply::parse(&answer)
    else {
        fail!("the answer is not the four bytes of 1000h in one frame");
    };
    let (says, described) = (u32::from_le_bytes(bytes), bench.subject.description.identity.device_type);
    if says != described {
        fail!("1000h is {says:08X}h; the description has {described:08X}h");
    }
    Ok(format!("{says:08X}h"))
}

async fn write_and_read(bench: &mut Bench) -> Verdict {
    let Some(row) = bench.subject.harmless().next() else {
        not_applicable!("no object of 1000h to 1FFFh can be written without harm");
    };
    let before = bench.number(row.mux()).await?;
    let Some(other) = [before + 1, before - 1].into_iter().find(|other| fits(row, *other)) else {
        not_applicable!("{} takes one value only", row.mux());
    };
    let data = bytes_of(row.data_type, other);
    bench.write(row.mux(), &data).await?;
    let after = bench.read(row.mux()).await?;
    if after != data {
        fail!("{} was written with {} and reads as {}", row.mux(), hex(&data), hex(&after));
    }
    Ok(format!("{} took {} and has it", row.mux(), hex(&data)))
}

fn fits(row: &Entry, value: i64) -> bool {
    let (low, high) = row.integer_limits().unwrap_or_else(|| row.data_type.range());
    (low..=high).contains(&value)
}

async fn write_read_only(bench: &mut Bench) -> Verdict {
    let value = bench.read(DEVICE_TYPE).await?;
    let answer = bench.download(DEVICE_TYPE, &value).await?;
    refused("write of 1000h", &answer, &[UNSUPPORTED, AbortCode::READ_ONLY, GENERAL])
}

async fn read_write_only(bench: &mut Bench) -> Verdict {
    let Some(row) = bench.subject.rows().find(|row| row.access == Access::WriteOnly) else {
        not_applicable!("no object is write-only");
    };
    let answer = bench.upload(row.mux()).await?;
    refused(&format!("read of {}", row.mux()), &answer, &[UNSUPPORTED, AbortCode::WRITE_ONLY, GENERAL])
}

async fn missing_sub_index(bench: &mut Bench) -> Verdict {
    let answer = bench.upload(Mux::new(0x1000, 1)).await?;
    refused("read of 1000h:01", &answer, &[AbortCode::NO_SUCH_SUB_INDEX, GENERAL])
}

async fn missing_object(bench: &mut Bench) -> Verdict {
    // CiA 301 reserves 1004h: no device has it.
    let answer = bench.upload(Mux::new(0x1004, 0)).await?;
    refused("read of 1004h", &answer, &[AbortCode::NO_SUCH_OBJECT, GENERAL])
}

async fn unknown_command(bench: &mut Bench) -> Verdict {
    let answer = bench.exchange([0xE0, 0x00, 0x10, 0, 0, 0, 0, 0]).await?;
    let aborted: SdoResult<()> = match Reply::parse(&answer) {
        Reply::Abort(_, code) => Err(code),
        _ => Ok(()),
    };
    refused("command specifier 7", &aborted, &[AbortCode::UNKNOWN_COMMAND, GENERAL])
}

/// A harmless object of one of these lengths in bytes.
fn of_length(subject: &Subject, lengths: &[usize]) -> Option<&'static Entry> {
    let any = subject.rows().filter(|row| row.access == Access::ReadWrite && subject.is_setting(row));
    subject.harmless().chain(any).find(|row| row.data_type.is_integer() && lengths.contains(&row.data_type.size()))
}

async fn too_long(bench: &mut Bench) -> Verdict {
    let Some(row) = of_length(&bench.subject, &[1, 2]) else {
        not_applicable!("no object of one or two bytes can be written")
    };
    let mut data = bench.read(row.mux()).await?;
    data.resize(4, 0);
    let answer = bench.try_write(row.mux(), &data).await?;
    let codes = [AbortCode::LENGTH_MISMATCH, AbortCode::TOO_LONG, GENERAL];
    refused(&format!("four bytes for {} ({})", row.mux(), row.data_type.name()), &answer, &codes)
}

async fn too_short(bench: &mut Bench) -> Verdict {
    let Some(row) = of_length(&bench.subject, &[2, 4]) else {
        not_applicable!("no object of two or four bytes can be written")
    };
    let data = bench.read(row.mux()).await?;
    let answer = bench.try_write(row.mux(), &data[..1]).await?;
    let codes = [AbortCode::LENGTH_MISMATCH, AbortCode::TOO_SHORT, GENERAL];
    refused(&format!("one byte for {} ({})", row.mux(), row.data_type.name()), &answer, &codes)
}

async fn too_high(bench: &mut Bench) -> Verdict {
    let limited = |row: &&Entry| limits(row).filter(|(_, high)| *high < row.data_type.range().1);
    let rows: Vec<_> = bench.subject.rows().filter(|row| bench.subject.is_setting(row)).collect();
    let Some((row, (_, high))) = rows.iter().find_map(|row| Some((*row, limited(row)?))) else {
        not_applicable!("no object has an upper limit below that of its type");
    };
    let answer = bench.try_write(row.mux(), &bytes_of(row.data_type, high + 1)).await?;
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, GENERAL];
    refused(&format!("{} for {}, whose upper limit is {high}", high + 1, row.mux()), &answer, &codes)
}

async fn too_low(bench: &mut Bench) -> Verdict {
    let limited = |row: &&Entry| limits(row).filter(|(low, _)| *low > row.data_type.range().0);
    let rows: Vec<_> = bench.subject.rows().filter(|row| bench.subject.is_setting(row)).collect();
    let Some((row, (low, _))) = rows.iter().find_map(|row| Some((*row, limited(row)?))) else {
        not_applicable!("no object has a lower limit above that of its type");
    };
    let answer = bench.try_write(row.mux(), &bytes_of(row.data_type, low - 1)).await?;
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_LOW, GENERAL];
    refused(&format!("{} for {}, whose lower limit is {low}", low - 1, row.mux()), &answer, &codes)
}

/// The limits of a row that no other object moves.
pub(super) fn limits(row: &Entry) -> Option<(i64, i64)> {
    row.integer_limits().filter(|_| row.resolution.is_none() && row.data_type.is_integer())
}

async fn server_identifiers(bench: &mut Bench) -> Verdict {
    let node = u32::from(bench.node().raw());
    let mut seen = Vec::new();
    for (sub_index, expected) in [(1, 0x600 + node), (2, 0x580 + node)] {
        let Some(row) = bench.subject.row(0x1200, sub_index) else { continue };
        let says = bench.number(row.mux()).await? as u32;
        if says != expected {
            fail!("{} is {says:08X}h; the predefined connection set has {expected:08X}h", row.mux());
        }
        seen.push(format!("{} is {says:03X}h", row.mux()));
    }
    Ok(seen.join(", "))
}

async fn further_channels(bench: &mut Bench) -> Verdict {
    let mut there = 0;
    for index in [0x1201, 0x1202, 0x127F, 0x1280, 0x1281, 0x12FF] {
        let answer = bench.upload(Mux::new(index, 1)).await?;
        if bench.subject.description.has_index(index) {
            match answer {
                Ok(_) => there += 1,
                Err(code) => fail!("{index:04X}h:01 is in the description and cannot be read: {code}"),
            }
        } else {
            let missing = [AbortCode::NO_SUCH_OBJECT, GENERAL];
            refused(&format!("read of {index:04X}h:01, which the description does not have"), &answer, &missing)?;
        }
    }
    Ok(format!("{there} are there, the others are refused"))
}

async fn further_channels_after_reset(bench: &mut Bench) -> Verdict {
    bench.reset(NmtCommand::ResetCommunication).await?;
    further_channels(bench).await
}

async fn further_channels_after_save(bench: &mut Bench) -> Verdict {
    let save = Mux::new(0x1010, 1);
    if let Err(code) = bench.download(save, b"save").await? {
        fail!("{save} does not take \"save\": {code}");
    }
    further_channels_after_reset(bench).await
}

async fn short_frames(bench: &mut Bench) -> Verdict {
    let id = connection_set::sdo_request(bench.node());
    let request = Request::InitiateUpload(DEVICE_TYPE).emit();
    for length in 0..8 {
        // Whether a shorter frame is answered is left to the server.
        let _ = bench.ask_briefly(Frame::new(id, &request[..length])).await;
        if let Err(code) = bench.upload(DEVICE_TYPE).await? {
            fail!("after a frame of {length} bytes the read of 1000h is aborted with {code}");
        }
    }
    Ok("1000h is read after each of them".into())
}

async fn remote_frame(bench: &mut Bench) -> Verdict {
    let remote = Frame::remote(connection_set::sdo_request(bench.node()), 8);
    if let Some(answer) = bench.ask_briefly(remote).await {
        fail!("the remote frame {remote} was answered with {answer}");
    }
    bench.read(DEVICE_TYPE).await?;
    Ok("not answered; 1000h is read after it".into())
}

async fn one_answer_each(bench: &mut Bench) -> Verdict {
    for mux in [DEVICE_TYPE, Mux::new(0x1018, 1), Mux::new(0x1018, 0xFE), Mux::new(0x5FFE, 0)] {
        let answer = bench.exchange(Request::InitiateUpload(mux).emit()).await?;
        let about = match Reply::parse(&answer) {
            Reply::InitiateUpload(about, _) | Reply::Abort(about, _) => about,
            other => fail!("the answer to the upload of {mux} is {other:?}"),
        };
        if about != mux {
            fail!("the answer to the upload of {mux} is about {about}");
        }
        if let Some(second) = bench.further_answer().await {
            fail!("the upload of {mux} was answered a second time: {second}");
        }
    }
    Ok("four requests, four answers, each about its object".into())
}

async fn missing_sub_index_of_record(bench: &mut Bench) -> Verdict {
    let records = [0x1018, 0x1400, 0x1800, 0x1600];
    let Some(mux) = records.into_iter().find_map(|index| {
        let rows: Vec<_> = bench.subject.rows().filter(|row| row.index == index).map(|row| row.sub_index).collect();
        rows.last().copied().filter(|last| *last > 0).map(|_| Mux::new(index, 0xFE))
    }) else {
        not_applicable!("the device has no record to ask");
    };
    let answer = bench.upload(mux).await?;
    refused(&format!("read of {mux}"), &answer, &[AbortCode::NO_SUCH_SUB_INDEX])
}
