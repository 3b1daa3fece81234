//! A record as a file of the other kind.

use std::collections::BTreeMap;
use std::io::{self, Cursor, Read, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

use can::Instant;

use super::piece::Kind;
use super::read::{CsvLines, note, read};
use super::record::Record;

/// An MCAP file with the contents of a CSV file. A subject without values in a line has no message of that time:
/// columns that were sampled at times of their own take no more room than their samples.
///
/// # Errors
/// Not a CSV file of this kind, in a sentence.
pub fn mcap_of_csv(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut lines = CsvLines::of(bytes)?;
    let memory = Memory::default();
    let broken = |error: io::Error| error.to_string();
    let mut record = Record::exact(Kind::Mcap, Box::new(memory.clone()), &lines.columns).map_err(broken)?;
    while let Some((at_s, values, text)) = lines.next()? {
        record.row(Instant::from_nanos((at_s * 1e9).round() as u64), values).map_err(broken)?;
        if let Some(mark) = note(at_s, text) {
            record.mark(&mark).map_err(broken)?;
        }
    }
    record.finish().map_err(broken)?;
    Ok(memory.into_bytes())
}

/// A CSV file with the contents of an MCAP file: a line for each time of a sample, with the values that are of that time; and what
/// happened. CSV has no place for frames.
///
/// # Errors
/// Not an MCAP file with a record, in a sentence.
pub fn csv_of_mcap(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let recorded = read(Kind::Mcap, bytes)?;
    let mut lines: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (place, series) in recorded.series.iter().enumerate() {
        for (at_s, value) in &series.points {
            let line = lines.entry((at_s * 1e9).round() as u64);
            line.or_insert_with(|| vec![f64::NAN; recorded.series.len()])[place] = *value;
        }
    }
    let columns: Vec<_> = recorded.series.iter().map(|series| series.column.clone()).collect();
    let memory = Memory::default();
    let broken = |error: io::Error| error.to_string();
    let mut record = Record::exact(Kind::Csv, Box::new(memory.clone()), &columns).map_err(broken)?;
    let mut marks = recorded.marks.iter().peekable();
    for (nanos, values) in &lines {
        let at = Instant::from_nanos(*nanos);
        while let Some(mark) = marks.next_if(|mark| mark.at <= at) {
            record.mark(mark).map_err(broken)?;
        }
        record.row(at, values).map_err(broken)?;
    }
    marks.try_for_each(|mark| record.mark(mark)).map_err(broken)?;
    record.finish().map_err(broken)?;
    Ok(memory.into_bytes())
}

/// A file in memory, which its owner has when the record is done with it.
#[derive(Clone, Default)]
pub(super) struct Memory(Arc<Mutex<Cursor<Vec<u8>>>>);

#[cfg(test)]
impl Memory {
    /// What stands in the file now.
    pub(super) fn contents(&self) -> Vec<u8> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_ref().clone()
    }

    /// Changes what stands in it.
    pub(super) fn change(&self, change: impl FnOnce(&mut [u8])) {
        change(self.0.lock().unwrap_or_else(PoisonError::into_inner).get_mut());
    }
}

impl Memory {
    fn into_bytes(self) -> Vec<u8> {
        core::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).into_inner()
    }
}

impl Read for Memory {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).read(into)
    }
}

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Memory {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_the_csv_stands_in_the_mcap() {
        let csv = "t_s,4.velocity_rpm,4.current_a,5.606C_00,mark\n0,60,1.5,,\n0.001,,,600,\n0.0025,61.25,,,\"node 4: started, at last\"\n";
        let mcap = mcap_of_csv(csv.as_bytes()).expect("it is one");
        let (was, is) = (read(Kind::Csv, csv.as_bytes()).expect("CSV"), read(Kind::Mcap, &mcap).expect("MCAP"));
        let samples = |recorded: &crate::Recorded, name: &str| -> Vec<(f64, f64)> {
            let series = recorded.series.iter().find(|series| series.column.name() == name);
            let points = series.unwrap_or_else(|| panic!("{name}")).points.iter().copied();
            points.filter(|(_, value)| !value.is_nan()).collect()
        };
        for (name, expected) in [
            ("4.velocity_rpm", &[(0.0, 60.0), (0.0025, 61.25)][..]),
            ("4.current_a", &[(0.0, 1.5)]),
            ("5.606C_00", &[(0.001, 600.0)]),
        ] {
            assert_eq!(samples(&was, name), expected);
            assert_eq!(samples(&is, name), expected);
        }
        let speed = is.series.iter().find(|series| series.column.signal == "velocity_rpm").expect("a speed");
        assert_eq!(speed.column.unit, "r/min");
        let again = csv_of_mcap(&mcap).expect("it is one");
        let back = read(Kind::Csv, &again).expect("CSV");
        for name in ["4.velocity_rpm", "4.current_a", "5.606C_00"] {
            assert_eq!(samples(&back, name), samples(&was, name), "{name}");
        }
        assert_eq!(back.marks, was.marks);
        // A node has no messages at the times of another.
        assert_eq!(speed.points.len(), 2);
        assert_eq!(
            (is.marks[0].text.as_str(), is.marks[0].at),
            ("node 4: started, at last", Instant::from_nanos(2_500_000))
        );
    }

    #[test]
    fn what_is_no_record_is_refused_in_words() {
        for (csv, part) in [
            ("", "t_s"),
            ("time,4.velocity_rpm\n", "t_s"),
            ("t_s,velocity\n", "NODE.SIGNAL"),
            ("t_s,4.velocity_rpm\n0,fast\n", "line 2, column 2: 'fast'"),
            ("t_s,4.velocity_rpm\n-1,60\n", "time of -1 s"),
            ("t_s,4.velocity_rpm\n0\n", "line 2 has 1 fields"),
        ] {
            let why = mcap_of_csv(csv.as_bytes()).expect_err(csv);
            assert!(why.contains(part), "{csv:?}: {why}");
        }
    }
}
