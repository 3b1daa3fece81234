//! Every EDS and DCF file of a folder, simulated: it boots, and answers its objects as the file has them.
//!
//! `FERRODRIVE_EDS_FILES` names the folder; without it there is nothing to do. The files are makers', and none is kept here.

use std::io::Write;
use std::path::Path;

use can::{Bitrate, Frame, Instant};
use canopen::od::{DefaultValue, Entry};
use canopen::{Mux, NodeId};
use devices::Description;
use eds::{Eds, Severity, keep};
use sim::VirtualDrive;
use sim::machine::{Order, order, without_effect};

const NODE: u8 = 5;

/// One line on standard error, for the table.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// What a running device measures or shows, or what a service changes at the start.
fn is_live(row: &Entry) -> bool {
    let profile = if row.index >= 0x6000 { 0x6000 | row.index & 0x7FF } else { row.index };
    let measured = [
        0x1001, 0x1003, 0x1010, 0x1011, 0x603F, 0x6041, 0x6061, 0x6062, 0x6063, 0x6064, 0x606B, 0x606C, 0x6074, 0x6077,
        0x6078, 0x6079, 0x60B9, 0x60BA, 0x60BB, 0x60BC, 0x60BD, 0x60F4, 0x60FC, 0x60FD,
    ];
    measured.contains(&profile)
}

struct Subject {
    machine: Box<dyn VirtualDrive>,
    now: Instant,
}

impl Subject {
    fn new(description: &'static Description) -> Self {
        let node = NodeId::new(NODE).unwrap();
        let mut machine = order(description, &Order::new(description, node, Bitrate::K500)).unwrap();
        machine.set_power(true, Instant::ZERO);
        let mut subject = Self { machine, now: Instant::ZERO };
        for _ in 0..200 {
            subject.now = subject.now.plus_nanos(1_000_000);
            subject.machine.handle_timeout(subject.now);
            while subject.machine.poll_transmit().is_some() {}
        }
        subject
    }

    /// What an expedited upload answers: up to four bytes, or none.
    fn read(&mut self, mux: Mux) -> Option<u32> {
        let [low, high] = mux.index.to_le_bytes();
        let request = format!("{:03X}#40{low:02X}{high:02X}{:02X}00000000", 0x600 + u32::from(NODE), mux.sub_index);
        let frame: Frame = request.parse().unwrap();
        self.machine.handle_frame(&frame, self.now);
        let mut answer = None;
        while let Some(frame) = self.machine.poll_transmit() {
            self.machine.handle_transmitted(&frame, self.now);
            if frame.id().raw() == 0x580 + u32::from(NODE) {
                answer = Some(frame);
            }
        }
        let answer = answer?;
        let data = answer.data();
        (data[0] & 0xE2 == 0x42).then(|| u32::from_le_bytes([data[4], data[5], data[6], data[7]]))
    }
}

/// Readable objects of up to four bytes with a default: how many there are, and which answer otherwise.
fn defaults(description: &'static Description) -> (usize, Vec<String>) {
    let mut subject = Subject::new(description);
    let mut asked = 0;
    let mut wrong = Vec::new();
    for row in description.dictionary.rows() {
        let cell = row.data_type.fits_cell() && row.data_type.is_integer() && row.access.is_readable();
        let expected = match row.default {
            DefaultValue::Value(value) => value,
            DefaultValue::NodeIdPlus(base) => i64::from(base) + i64::from(NODE),
            _ => continue,
        };
        if !cell || is_live(row) {
            continue;
        }
        asked += 1;
        let answer = subject.read(row.mux());
        if answer.map(|raw| row.data_type.value(raw)) != Some(row.data_type.value(row.data_type.raw(expected))) {
            wrong.push(format!("{} {answer:?} for {expected}", row.mux()));
        }
    }
    (asked, wrong)
}

fn simulate(path: &Path) -> Result<String, String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let Ok(reading) = Eds::load(&bytes) else { return Ok(format!("{name}: refused by the reader")) };
    let count = |severity| reading.findings.count(severity);
    let found = format!("{} errors, {} warnings", count(Severity::Error), count(Severity::Warning));
    let description = match keep(&reading.eds) {
        Ok(description) => description,
        Err(error) => return Ok(format!("{name}: {found}: {error}")),
    };
    let kind = if description.axes.is_empty() { "node".into() } else { format!("servo, {}", description.axes.len()) };
    let (asked, wrong) = defaults(description);
    let line = format!(
        "{name}: {found}; {kind}; {} objects, {} without effect; {} of {asked} defaults answered",
        description.dictionary.rows().len(),
        without_effect(description).count(),
        asked - wrong.len()
    );
    if wrong.is_empty() { Ok(line) } else { Err(format!("{line}: {wrong:?}")) }
}

#[test]
fn every_file_is_simulated_and_answers_its_defaults() {
    let Some(folder) = std::env::var_os("FERRODRIVE_EDS_FILES") else {
        say("skipped: FERRODRIVE_EDS_FILES names no folder with EDS and DCF files");
        return;
    };
    let entries = std::fs::read_dir(&folder).expect("the folder of FERRODRIVE_EDS_FILES");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "eds" || ending == "dcf"));
    paths.sort();
    let mut failed = Vec::new();
    for path in &paths {
        match simulate(path) {
            Ok(line) => say(&line),
            Err(line) => failed.push(line),
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(!paths.is_empty(), "no files");
}
