//! Files of values: those that a page keeps, as a record; a record or a log that it loads, as values.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::Query;
use axum::extract::rejection::QueryRejection;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use can::Instant;
use host::HostHandle;
use recording::{Kind, Recorded, mcap_of_csv, read};
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use super::answer::{json_text, trouble};
use super::log_file::{LogFile, format_of};

/// The largest accepted record in bytes: a minute of twelve objects at 1 kHz has about half of it.
pub(super) const LARGEST: usize = 32 << 20;

/// Converts a CSV to MCAP, in another thread than the task that moves drives.
pub(super) async fn mcap(records: Arc<Semaphore>, csv: Bytes) -> Response {
    let Ok(permit) = records.try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another record is being converted: try again");
    };
    let work = move || {
        // It goes on if the client goes away, and so does its turn.
        let _permit = permit;
        mcap_of_csv(&csv)
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(file)) => ([(CONTENT_TYPE, "application/octet-stream")], file).into_response(),
        Ok(Err(why)) => trouble(StatusCode::BAD_REQUEST, "malformed", &why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
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
    let Ok(permit) = records.try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "another record is being read: try again");
    };
    let work = move || {
        let _permit = permit;
        let values = of_file(&handle, &name, &file)?;
        serde_json::to_string(&values).map_err(|error| error.to_string())
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(json)) => json_text(json),
        Ok(Err(why)) => trouble(StatusCode::BAD_REQUEST, "malformed", &why),
        Err(_) => trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending"),
    }
}

fn of_file(handle: &HostHandle, name: &str, bytes: &[u8]) -> Result<Values, String> {
    if let Some(kind) = Kind::of_name(name) {
        return read(kind, bytes).map(of_record).map_err(|why| format!("{name}: {why}"));
    }
    let format = format_of(name, bytes).ok_or_else(|| {
        format!("{name}: expected a record (.mcap, .csv) or a log of frames (candump, ASC, BLF, TRC, pcap, pcapng)")
    })?;
    of_log(handle, LogFile::new(bytes, format)).map_err(|why| format!("{name}: {why}"))
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
