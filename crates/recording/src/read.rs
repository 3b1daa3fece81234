//! A record's file, read back.
//!
//! A file whose writer was killed, or that is still being written, ends in the middle of something: what stands before that
//! is taken, and [`Recorded::torn`] is set.

use can::Instant;

use super::column::Column;
use super::mcap_read::read_mcap;
use super::piece::{Kind, Mark, Recorded, Series, Severity};

/// The contents of a file of this kind.
///
/// # Errors
/// Not a file of this kind, or without a record, in a sentence.
pub fn read(kind: Kind, bytes: &[u8]) -> Result<Recorded, String> {
    let mut recorded = match kind {
        Kind::Mcap => read_mcap(bytes)?,
        Kind::Csv => return read_csv(bytes),
    };
    recorded.series.retain(|series| !series.points.is_empty());
    Ok(recorded)
}

/// The contents of a CSV file.
///
/// # Errors
/// As [`read`].
pub fn read_csv(bytes: &[u8]) -> Result<Recorded, String> {
    let mut lines = CsvLines::of(bytes)?;
    let series = lines.columns.iter().map(|column| Series { column: column.clone(), points: Vec::new() });
    let mut recorded = Recorded { torn: lines.torn, series: series.collect(), marks: Vec::new() };
    while let Some((at, values, text)) = lines.next()? {
        // A line that has nothing but marks is not a sample.
        if text.is_empty() || values.iter().any(|value| !value.is_nan()) {
            recorded.series.iter_mut().zip(values).for_each(|(series, value)| series.points.push((at, *value)));
        }
        recorded.marks.extend(note(at, text));
    }
    recorded.series.retain(|series| !series.points.is_empty());
    Ok(recorded)
}

/// What a line of CSV says beside its values; nothing of an empty text.
pub(super) fn note(at_s: f64, text: &str) -> Option<Mark> {
    let at = Instant::from_nanos((at_s * 1e9) as u64);
    let (of, kind, severity) = ("".into(), "".into(), Severity::Note);
    (!text.is_empty()).then(|| Mark { at, of, kind, severity, text: text.to_owned() })
}

/// A line of a CSV file: its time in s, its values, not a number where there is none, and what happened.
pub(super) type CsvLine<'a> = (f64, &'a [f64], &'a str);

/// The lines of a CSV file, one after the other.
pub(super) struct CsvLines<'a> {
    reader: csv::Reader<&'a [u8]>,
    pub(super) columns: Vec<Column>,
    /// The file ends in the middle of a line.
    torn: bool,
    places: Vec<usize>,
    marks_at: Option<usize>,
    width: usize,
    line: csv::StringRecord,
    values: Vec<f64>,
}

impl<'a> CsvLines<'a> {
    /// Reads the first line.
    pub(super) fn of(bytes: &'a [u8]) -> Result<Self, String> {
        // The line in which a writer was killed does not count; no field holds the end of a line.
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(&bytes[..whole]);
        let header = reader.headers().map_err(|error| format!("not a CSV file: {error}"))?.clone();
        if !matches!(header.get(0), Some("t_s" | "time_s")) {
            let first = header.get(0).unwrap_or_default();
            return Err(format!("its first column is not t_s, the time in s: it is '{first}'"));
        }
        let marks_at = header.iter().position(|name| name == "mark");
        let (mut columns, mut places) = (Vec::new(), Vec::new());
        for (place, name) in header.iter().enumerate().skip(1).filter(|(place, _)| Some(*place) != marks_at) {
            columns.push(name.parse().map_err(|reason| format!("column {}: {reason}", place + 1))?);
            places.push(place);
        }
        let (line, values) = (csv::StringRecord::new(), Vec::new());
        Ok(Self { reader, columns, torn: whole < bytes.len(), places, marks_at, width: header.len(), line, values })
    }

    /// The next line.
    pub(super) fn next(&mut self) -> Result<Option<CsvLine<'_>>, String> {
        if !self.reader.read_record(&mut self.line).map_err(|error| format!("not a CSV file: {error}"))? {
            return Ok(None);
        }
        let line = &self.line;
        let row = line.position().map_or(0, csv::Position::line);
        let number = |place: usize| match line.get(place) {
            Some("") => Ok(f64::NAN),
            Some(text) => {
                text.parse().map_err(|_| format!("line {row}, column {}: '{text}' is not a number", place + 1))
            }
            None => Err(format!("line {row} has {} fields; the first line has {}", line.len(), self.width)),
        };
        let at: f64 = number(0)?;
        if !at.is_finite() || at < 0.0 {
            return Err(format!("line {row}: a time of {at} s"));
        }
        self.values.clear();
        for place in &self.places {
            self.values.push(number(*place)?);
        }
        let text = self.marks_at.and_then(|place| line.get(place)).unwrap_or_default();
        Ok(Some((at, &self.values, text)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::convert::Memory;
    use super::super::{Record, columns_of_drives};
    use super::*;
    use sim::Place;
    use std::io::{Read, Seek, SeekFrom, Write};

    fn columns() -> Vec<Column> {
        columns_of_drives([Place::node(4), "5.2".parse().unwrap()])
    }

    /// A value of its own in each field; every third is missing.
    fn row(number: usize) -> Vec<f64> {
        let value = |column: usize| (number * 100 + column) as f64 / 7.0;
        (0..columns().len())
            .map(|column| if (number + column).is_multiple_of(3) { f64::NAN } else { value(column) })
            .collect()
    }

    fn at(number: usize) -> Instant {
        Instant::from_millis(number as u64 * 500)
    }

    /// `rows` rows, flushed after each of them; a mark after the third.
    fn written(kind: Kind, rows: usize) -> (Memory, Record) {
        let memory = Memory::default();
        let mut record = Record::begin(kind, Box::new(memory.clone()), &columns()).unwrap();
        for number in 0..rows {
            record.row(at(number), &row(number)).unwrap();
            record.frame(at(number), &"604#4041600000000000".parse().unwrap()).unwrap();
            if number == 2 {
                let text = "over-voltage, \"hard\"".to_owned();
                let (of, kind) = ("node 4".into(), "fault".into());
                record.mark(&Mark { at: at(2), of, kind, severity: Severity::Fault, text }).unwrap();
            }
            record.flush().unwrap();
        }
        (memory, record)
    }

    /// CSV has each digit; of MCAP the table in docs/recording.md says how far a value may be off.
    fn check(kind: Kind, recorded: &Recorded, rows: usize) {
        assert_eq!(recorded.series.len(), columns().len());
        for (place, column) in columns().iter().enumerate() {
            let series = recorded.series.iter().find(|series| series.column == *column).unwrap();
            let off = match &*column.unit {
                _ if kind == Kind::Csv => 0.0,
                "r/min" => 1e-3,
                "A" => 0.5e-3,
                "V" | "J" => 4e-3,
                "°C" => 8e-3,
                "rad" => 4e-6,
                "N·m" => 0.25e-3,
                _ => 0.0,
            };
            assert_eq!(series.points.len(), rows);
            for (number, (seen_at, value)) in series.points.iter().enumerate() {
                let given = row(number)[place];
                let is_same = (value.is_nan() && given.is_nan()) || (value - given).abs() <= off;
                assert!(is_same && *seen_at == at(number).as_secs_f64(), "{}: {value}, {given}", column.name());
            }
        }
    }

    #[test]
    fn what_was_written_is_read_back() {
        for kind in [Kind::Mcap, Kind::Csv] {
            let (memory, record) = written(kind, 40);
            record.finish().unwrap();
            let recorded = read(kind, &memory.contents()).unwrap();
            assert!(!recorded.torn, "{kind:?}");
            check(kind, &recorded, 40);
            assert_eq!(recorded.marks.len(), 1);
            assert!(recorded.marks[0].line().ends_with("node 4: over-voltage, \"hard\""));
        }
    }

    #[test]
    fn a_writer_that_is_killed_loses_nothing_of_before_the_last_flush() {
        for kind in [Kind::Mcap, Kind::Csv] {
            let (memory, mut record) = written(kind, 40);
            let flushed = memory.contents();
            record.row(at(40), &row(40)).unwrap();
            // What a killed process leaves: the file as it is.
            std::mem::forget(record);
            let recorded = read(kind, &flushed).unwrap();
            check(kind, &recorded, 40);
            assert_eq!(recorded.torn, kind == Kind::Mcap);
            // Torn anywhere: what stands before is read, and nothing panics.
            let mut most = 0;
            for end in (0..flushed.len()).step_by(97) {
                let Ok(torn) = read(kind, &flushed[..end]) else { continue };
                let rows = torn.series.first().map_or(0, |series| series.points.len());
                assert!((most..=40).contains(&rows), "{kind:?} {end}: {rows}");
                most = rows;
            }
            assert!(most >= 38, "{kind:?}: {most}");
        }
    }

    #[test]
    fn a_file_that_is_something_else_is_refused_with_the_reason() {
        assert!(read(Kind::Mcap, b"t_s,4.velocity_rpm\n").unwrap_err().contains("not an MCAP file"));
        assert!(read(Kind::Mcap, b"").unwrap_err().contains("not an MCAP file"));
        assert!(read(Kind::Csv, b"a,b\n1,2\n").unwrap_err().contains("t_s"));
        let bad = read(Kind::Csv, b"t_s,4.velocity_rpm,mark\n0,1,\n1,fast,\n").unwrap_err();
        assert_eq!(bad, "line 3, column 2: 'fast' is not a number");
        assert!(read(Kind::Csv, b"t_s,4.velocity_rpm,mark\n0\n1,2,\n").unwrap_err().contains("line 2 has 1 fields"));
        assert!(read(Kind::Csv, b"t_s,4.velocity_rpm,mark\n-1,1,\n").unwrap_err().contains("a time of -1 s"));
        assert!(read(Kind::Csv, b"t_s,4.velocity_rpm,mark\n").unwrap().series.is_empty());
    }

    #[test]
    fn a_chunk_that_is_broken_ends_the_record_and_one_packed_otherwise_is_refused() {
        let (memory, record) = written(Kind::Mcap, 40);
        record.finish().unwrap();
        let whole = memory.contents();
        let packed = whole.windows(4).position(|window| window == b"zstd").unwrap();
        let mut otherwise = whole.clone();
        otherwise[packed] = b'x';
        assert!(read(Kind::Mcap, &otherwise).unwrap_err().contains("compressed with 'xstd'; expected 'zstd', 'lz4'"));
        let mut large = whole.clone();
        // The size before packing stands before the check sum and the length of the name.
        large[packed - 16..packed - 8].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(read(Kind::Mcap, &large).unwrap_err().contains("expected at most"));
        for place in packed + 12..packed + 200 {
            let mut broken = whole.clone();
            broken[place] ^= 0x55;
            let recorded = read(Kind::Mcap, &broken).unwrap();
            assert!(recorded.torn && recorded.series.is_empty(), "byte {place}");
        }
    }

    /// As records were before, and as other programs write: JSON, by the format's own writer.
    #[test]
    fn a_file_of_another_program_is_read_too() {
        let mut target = std::io::Cursor::new(Vec::new());
        let mut writer = mcap::WriteOptions::new().compression(None).create(&mut target).unwrap();
        let schema = br#"{"type":"object","properties":{"speed":{"type":"number","unit":"m/s"}}}"#;
        let schema = writer.add_schema("speed", "jsonschema", schema).unwrap();
        let none = std::collections::BTreeMap::new();
        let [signals, events, other] = [("/body/base", "json"), ("/events", "json"), ("/body/x", "cdr")]
            .map(|(topic, encoding)| writer.add_channel(schema, topic, encoding, &none).unwrap());
        let messages = [
            (signals, &br#"{"speed":1.5,"name":"base"}"#[..]),
            (signals, b"{\"speed\":null}"),
            (signals, b"no JSON"),
            (events, br#"{"level":4,"name":"node 4","message":"over-voltage"}"#),
            (other, &[0, 1, 0, 0, 9]),
        ];
        for (sequence, (channel_id, data)) in (0_u32..).zip(messages) {
            let time = u64::from(sequence) * 1_000_000_000;
            let header = mcap::records::MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let recorded = read(Kind::Mcap, target.get_ref()).unwrap();
        let [series] = &recorded.series[..] else { panic!("{recorded:?}") };
        assert_eq!((series.column.name().as_str(), &*series.column.unit), ("base.speed", "m/s"));
        assert!(series.points[0] == (0.0, 1.5) && series.points[1].1.is_nan() && series.points.len() == 2);
        assert_eq!((recorded.marks[0].severity, &*recorded.marks[0].text), (Severity::Fault, "over-voltage"));
    }

    #[test]
    fn a_disk_that_is_full_is_an_error_and_no_panic() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        impl Read for Full {
            fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
                Ok(0)
            }
        }
        impl Seek for Full {
            fn seek(&mut self, _: SeekFrom) -> std::io::Result<u64> {
                Ok(0)
            }
        }
        for kind in [Kind::Mcap, Kind::Csv] {
            let begun = Record::begin(kind, Box::new(Full), &columns());
            let error = match begun {
                Err(error) => error,
                Ok(mut record) => record.row(at(0), &row(0)).and_then(|()| record.flush()).unwrap_err(),
            };
            assert_eq!(error.kind(), std::io::ErrorKind::StorageFull, "{kind:?}");
        }
    }
}
