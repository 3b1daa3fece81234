//! Files of values: those that a page keeps, as a record; a record or a log that it loads, as values, or as what they show of a drive.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::Query;
use axum::extract::rejection::QueryRejection;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use can::Instant;
use canopen::NodeId;
use host::HostHandle;
use host::capture::{record_of_log, refusal};
use host::tune::{CaptureReport, of_capture};
use recording::{Capture, Kind, Recorded, mcap_of_csv, read};
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use super::answer::{json_text, trouble};
use super::log_file::{LogFile, format_of};

/// The largest accepted record in bytes: a minute of twelve objects at 1 kHz has about half of it.
pub(super) const LARGEST: usize = 32 << 20;

/// Work on a file, in another thread than the task that moves drives, one at a time. What it answers, or why the file is refused.
async fn in_turn(
    records: Arc<Semaphore>,
    work: impl FnOnce() -> Result<Response, (&'static str, String)> + Send + 'static,
) -> Response {
    let Ok(permit) = records.try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another record is being read or made: try again");
    };
    let work = move || {
        // It goes on if the client goes away, and so does its turn.
        let _permit = permit;
        work()
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(answer)) => answer,
        Ok(Err((kind, why))) => trouble(StatusCode::BAD_REQUEST, kind, &why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
}

/// Converts a CSV to MCAP.
pub(super) async fn mcap(records: Arc<Semaphore>, csv: Bytes) -> Response {
    let converted = move || match mcap_of_csv(&csv) {
        Ok(file) => Ok(([(CONTENT_TYPE, "application/octet-stream")], file).into_response()),
        Err(why) => Err(("malformed", why)),
    };
    in_turn(records, converted).await
}

fn as_json(value: &impl Serialize) -> Result<Response, (&'static str, String)> {
    serde_json::to_string(value).map(json_text).map_err(|error| ("malformed", error.to_string()))
}

/// The query of a file that is loaded.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Named {
    pub(super) name: String,
}

/// The contents of a file.
#[derive(Debug, Default, Serialize)]
struct Values {
    columns: Vec<Column>,
    marks: Vec<Mark>,
    /// What of the file was not read.
    remark: String,
}

/// The values of one signal or object, by its name in a record: `4.velocity_rpm`, `4.606C_00`.
#[derive(Debug, Serialize)]
struct Column {
    name: String,
    title: String,
    unit: String,
    /// Time in s and value.
    points: Vec<(f64, f64)>,
}

#[derive(Debug, Serialize)]
struct Mark {
    time_s: f64,
    node: Option<u8>,
    text: String,
}

/// Reads a record (MCAP, CSV) or a log of frames, whose objects are decoded by the models of this bus's nodes.
pub(super) async fn values(
    handle: HostHandle,
    records: Arc<Semaphore>,
    asked: Result<Query<Named>, QueryRejection>,
    file: Bytes,
) -> Response {
    let name = match asked {
        Ok(Query(Named { name })) => name,
        Err(rejection) => return trouble(StatusCode::BAD_REQUEST, "malformed", &rejection.body_text()),
    };
    in_turn(records, move || as_json(&of_file(&handle, &name, &file).map_err(|why| ("malformed", why))?)).await
}

/// The query of a file from which a drive is identified.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Identified {
    name: String,
    node: Option<u8>,
}

/// What a record or a log shows of a drive: its frequency response, masses and speed loop. Nothing moves.
pub(super) async fn identified(
    handle: HostHandle,
    records: Arc<Semaphore>,
    asked: Result<Query<Identified>, QueryRejection>,
    file: Bytes,
) -> Response {
    let asked = match asked {
        Ok(Query(asked)) => asked,
        Err(rejection) => return trouble(StatusCode::BAD_REQUEST, "malformed", &rejection.body_text()),
    };
    in_turn(records, move || as_json(&identify(&handle, &asked, &file)?)).await
}

fn identify(
    handle: &HostHandle,
    Identified { name, node }: &Identified,
    bytes: &[u8],
) -> Result<CaptureReport, (&'static str, String)> {
    let recorded = match Kind::of_name(name) {
        Some(kind) => read(kind, bytes),
        None => log_of(name, bytes).and_then(|mut log| record_of_log(handle.trace().fresh_decoder(), &mut log)),
    };
    let capture = recorded.and_then(|recorded| Capture::of_node(&recorded, *node));
    let capture = capture.map_err(|why| ("malformed", format!("{name}: {why}")))?;
    // That of this bus may be another one than was captured.
    let on_bus = |node| handle.trace().model(node);
    let model = NodeId::new(capture.place.node).and_then(on_bus).filter(|_| capture.model.is_empty());
    of_capture(&capture, None, model).map_err(|failure| refusal(&failure))
}

/// A log of frames, by what is in it or by its name.
fn log_of<'a>(name: &str, bytes: &'a [u8]) -> Result<LogFile<'a>, String> {
    let expected = "expected a record (.mcap, .csv) or a log of frames (candump, ASC, BLF, TRC, pcap, pcapng)";
    format_of(name, bytes).map(|format| LogFile::new(bytes, format)).ok_or_else(|| expected.to_owned())
}

fn of_file(handle: &HostHandle, name: &str, bytes: &[u8]) -> Result<Values, String> {
    if let Some(kind) = Kind::of_name(name) {
        return read(kind, bytes).map(of_record).map_err(|why| format!("{name}: {why}"));
    }
    log_of(name, bytes).and_then(|log| of_log(handle, log)).map_err(|why| format!("{name}: {why}"))
}

fn of_record(recorded: Recorded) -> Values {
    let columns = recorded.series.into_iter().map(|series| Column {
        name: series.column.name(),
        title: format!("{} of {}", series.column.signal, series.column.subject.title()),
        unit: series.column.unit.into_owned(),
        points: series.points.into_iter().filter(|(_, value)| value.is_finite()).collect(),
    });
    let seconds = |at: Instant| (at - Instant::ZERO).as_secs_f64();
    let marks = recorded.marks.into_iter().map(|mark| {
        let node = mark.of.strip_prefix("node ").and_then(|node| node.parse().ok());
        Mark { time_s: seconds(mark.at), node, text: mark.text }
    });
    let remark = if recorded.torn { "the file ends in the middle of something" } else { "" };
    Values {
        columns: columns.filter(|column: &Column| !column.points.is_empty()).collect(),
        marks: marks.collect(),
        remark: remark.into(),
    }
}

fn of_log(handle: &HostHandle, mut log: LogFile<'_>) -> Result<Values, String> {
    let series = handle.trace().values_of_log(&mut log)?;
    let columns = series.into_iter().map(|one| {
        let mut place = one.object.splitn(2, ':');
        let (node, object) = (place.next().unwrap_or_default(), place.next().unwrap_or_default());
        Column {
            name: format!("{node}.{}", object.replace(':', "_")),
            title: [one.object.as_str(), one.name.unwrap_or_default()].join(" ").trim_end().to_owned(),
            unit: if one.unit.is_empty() { String::new() } else { format!("[{}]", one.unit) },
            points: one.points.into_iter().map(|(at_s, value)| (at_s, value as f64)).collect(),
        }
    });
    Ok(Values { columns: columns.collect(), marks: Vec::new(), remark: log.remark() })
}

#[cfg(test)]
mod tests {
    use canlog::{Entry, Format, LogReader};
    use host::session::channel;
    use host::trace::{Origin, Trace};

    use super::*;

    fn loaded(name: &str, bytes: &[u8]) -> Result<serde_json::Value, String> {
        let (handle, _inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
        of_file(&handle, name, bytes).map(|values| serde_json::to_value(values).expect("JSON"))
    }

    #[test]
    fn a_record_is_its_columns_and_what_happened() {
        let values =
            loaded("a.csv", b"t_s,4.velocity_rpm,mark\n0.5,60,\n1,,over-voltage\n1.5,61,\n").expect("a record");
        let column = serde_json::json!({
            "name": "4.velocity_rpm", "title": "velocity_rpm of node 4", "unit": "r/min", "points": [[0.5, 60.0], [1.5, 61.0]]
        });
        assert_eq!(values["columns"], serde_json::json!([column]));
        assert_eq!(values["marks"], serde_json::json!([{ "time_s": 1.0, "node": null, "text": "over-voltage" }]));
        assert_eq!(values["remark"], "");
        let mcap = mcap_of_csv(b"t_s,4.velocity_rpm,mark\n0.5,60,\n1,,over-voltage\n1.5,61,\n").expect("it is written");
        let of_mcap = loaded("a.mcap", &mcap).expect("a record");
        assert_eq!((&of_mcap["columns"], &of_mcap["marks"]), (&values["columns"], &values["marks"]));
    }

    #[test]
    fn a_record_has_the_same_values_in_both_of_its_forms() {
        let csv = b"t_s,4.velocity_rpm,4.current_a,mark\n0.5,60,1.5,\n1,,2.5,over-voltage\n1.5,61,-1,\n";
        let mcap = mcap_of_csv(csv).expect("it is written");
        let [of_csv, of_mcap] = [("a.csv", &csv[..]), ("a.mcap", &mcap)].map(|(name, bytes)| loaded(name, bytes));
        let (of_csv, of_mcap) = (of_csv.expect("a record"), of_mcap.expect("a record"));
        assert_eq!(of_mcap["columns"], of_csv["columns"]);
        assert_eq!((&of_mcap["marks"][0]["text"], &of_mcap["remark"]), (&"over-voltage".into(), &"".into()));
    }

    /// CiA 301, 7.2.4.3: an expedited upload of 4 bytes is answered by 43h.
    #[test]
    fn a_log_is_the_objects_that_it_carries_in_any_form() {
        let candump = b"(1700000000.500000) can0 604#406C600000000000\n(1700000000.6000\n(1700000000.750000) can0 584#436C6000C8000000\n";
        let values = loaded("a.log", candump).expect("a log");
        assert_eq!(values["columns"][0]["name"], "4.606C_00", "{values}");
        assert_eq!(values["columns"][0]["points"], serde_json::json!([[0.25, 200.0]]));
        assert!(values["remark"].as_str().expect("text").starts_with("1 lines or parts are not frames"), "{values}");
        let mut blf = canlog::LogWriter::new(std::io::Cursor::new(Vec::new()), Format::Blf).expect("it is written");
        for entry in LogReader::new(&candump[..], Format::Candump) {
            if let Entry::Record(record) = entry.expect("read") {
                blf.write(&record).expect("written");
            }
        }
        let blf = blf.finish().expect("written").into_inner();
        assert_eq!(loaded("a.blf", &blf).expect("a log")["columns"], values["columns"]);
    }

    /// A wheel of 0.02 kg m² with 0.05 N m s/rad, of a motor with the torque constant that a ZLAC8030L is delivered with, driven by a
    /// current with a random sign every 8 ms: between two samples it approaches its final speed exponentially.
    #[test]
    fn a_record_identifies_its_drive_as_the_command_line_does() {
        const PERIOD_S: f64 = 1e-3;
        let (handle, _inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
        let asked = |node| Identified { name: "a.csv".into(), node };
        let identify = |node, text: &str| {
            let found = identify(&handle, &asked(node), text.as_bytes())?;
            serde_json::to_value(&found).map_err(|error| ("json", error.to_string()))
        };
        let constant = host::tune::motor_of(devices::model("zlac8030l").expect("it is there")).expect("a motor");
        let constant = constant.windings.torque_constant_nm_a();
        let (inertia, viscous) = (0.02, 0.05);
        let decay = (-viscous / inertia * PERIOD_S).exp();
        let (mut angle, mut speed, mut current, mut bits) = (0.0, 0.0, 2.0, 1_u32);
        let about = r#""capture {""name"":""run"",""model"":""zlac8030l""}""#;
        let mut csv = format!("t_s,4.current_demand_a,4.position_deg,mark\n0,,,{about}\n");
        for row in 0..8000_u32 {
            if row % 8 == 0 {
                // A linear congruential generator (D. E. Knuth, "The Art of Computer Programming" 2, 3.2.1).
                bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                current = if bits >> 31 == 0 { 2.0 } else { -2.0 };
            }
            csv += &format!("{},{current},{},\n", f64::from(row) * PERIOD_S, f64::to_degrees(angle));
            let last = constant * current / viscous;
            angle += last * PERIOD_S + (speed - last) * (1.0 - decay) * inertia / viscous;
            speed = last + (speed - last) * decay;
        }
        let found = identify(Some(4), &csv).expect("it is identified");
        let of = |name: &str| found[name].as_f64().expect("a number");
        assert!((of("inertia_kg_m2") / inertia - 1.0).abs() < 0.05, "{found}");
        assert!((of("viscous_friction_nm_s") / viscous - 1.0).abs() < 0.1, "{found}");
        assert_eq!((found["node"].as_u64(), &found["resonance_hz"]), (Some(4), &serde_json::Value::Null));
        let (kind, why) = identify(Some(5), &csv).expect_err("another node");
        assert!(kind == "malformed" && why.contains("no values of node 5 are in it, only of: 4"), "{why}");
        let (kind, why) = identify(None, "t_s,4.velocity_rpm,mark\n0,1,\n1,2,\n").expect_err("nothing of a current");
        assert!(kind == "bad_file" && why.contains("it has no current in A") && !why.contains('\n'), "{why}");
    }

    #[test]
    fn what_is_no_such_file_is_refused_with_what_is_expected() {
        for (name, bytes, why) in [
            ("a.docx", &b"PK"[..], "expected a record (.mcap, .csv) or a log of frames"),
            ("a.csv", b"time,speed\n0,1\n", "its first column is not t_s"),
            ("a.mcap", b"", "not an MCAP file"),
        ] {
            let refused = loaded(name, bytes).expect_err(name);
            assert!(refused.starts_with(name) && refused.contains(why), "{refused}");
        }
        assert_eq!(loaded("a.log", b"\0\xff no log").expect("nothing in it")["columns"], serde_json::json!([]));
    }
}
