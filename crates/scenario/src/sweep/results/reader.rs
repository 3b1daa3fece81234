//! Reading a file of results, as far as it is whole and of this sweep.

use std::io::{self, BufRead, Read};

use serde_json::Value;

use super::{ResultsError, RunResult, head, head_fields};
use crate::sweep::{Shard, Sweep};

/// Longest line in bytes: what was seen in a run that failed is a sentence.
const LONGEST: u64 = 1 << 20;

/// What of a head decides whether its runs are those of a sweep, and what to do where it differs.
const DECISIVE: [(&str, &str, &str); 7] = [
    ("form", "the form of the file", "go on with the version of ferrodrive that wrote it"),
    ("version", "the version of ferrodrive", "go on with that version"),
    ("scenario", "the hash of the scenario and its machine file", "go on with these files as they were"),
    ("seeds", "--seeds", "give the same seeds"),
    ("parameters", "the parameters that are not swept", "give the same --set"),
    ("fidelity", "--fidelity", "give the same fidelity"),
    ("runs", "the number of runs", "give the same --set"),
];

/// The results in a file, one after the other. What was torn off at the end counts as not there.
#[derive(Debug)]
pub struct Reader<'a, R> {
    sweep: &'a Sweep,
    input: R,
    shard: Shard,
    lines: u64,
    bytes: u64,
}

impl<'a, R: BufRead> Reader<'a, R> {
    /// Reads the head of a part of a sweep. `None` if there is none yet: the file is empty, or was cut within it.
    ///
    /// # Errors
    /// That it is of another sweep or part, or not a file of results.
    pub fn of_shard(sweep: &'a Sweep, shard: Shard, mut input: R) -> Result<Option<Self>, ResultsError> {
        let (text, is_whole) = read_line(&mut input)?;
        // A cut may be anywhere, but what is before it is ours; else it is a file of another kind, which is not cut.
        if !is_whole && head(sweep, shard).as_bytes().starts_with(&text) {
            return Ok(None);
        }
        let reader = Self::behind_head(sweep, &text, input)?;
        if reader.shard == shard {
            return Ok(Some(reader));
        }
        let next = format!("give --shard {}, or write to another file", reader.shard);
        Err(bad_head(format!("it has shard {}, and this is shard {shard}", reader.shard), next))
    }

    /// Reads the head of any part of a sweep.
    ///
    /// # Errors
    /// That it is of another sweep, or not a file of results.
    pub fn of_any(sweep: &'a Sweep, mut input: R) -> Result<Self, ResultsError> {
        let (text, _) = read_line(&mut input)?;
        Self::behind_head(sweep, &text, input)
    }

    fn behind_head(sweep: &'a Sweep, text: &[u8], input: R) -> Result<Self, ResultsError> {
        let found: Value = serde_json::from_slice(text).unwrap_or_default();
        let shard = found["shard"].as_str().and_then(|shard| shard.parse().ok());
        let (Some(shard), true) = (shard, text.ends_with(b"\n")) else {
            let what = "expected the head that `ferrodrive run --seeds -o` writes";
            return Err(bad_head(what.into(), "give the file that such a command wrote, or another name".into()));
        };
        let ours = head_fields(sweep, shard);
        for (name, what, next) in DECISIVE {
            if found[name] != ours[name] {
                let what = format!("{what}: {} in the file, {} of this sweep", found[name], ours[name]);
                return Err(bad_head(what, format!("{next}, or write to another file")));
            }
        }
        Ok(Self { sweep, input, shard, lines: 1, bytes: text.len() as u64 })
    }

    /// Which part of the sweep it has.
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// How many runs were read.
    pub fn runs(&self) -> u64 {
        self.lines - 1
    }

    /// Bytes of what was read and is whole.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The next result with its line; `None` at the end of what is whole.
    ///
    /// # Errors
    /// A line that is not the result of the run that has its turn.
    pub fn next_result(&mut self) -> Result<Option<(String, RunResult)>, ResultsError> {
        let (text, is_whole) = read_line(&mut self.input)?;
        let is_torn = !is_whole && (text.len() as u64) < LONGEST;
        if is_torn {
            return Ok(None);
        }
        let (text, result) = self.checked(text).map_err(|what| {
            let line = self.lines + 1;
            let next = format!("delete line {line} and all after it; with --resume their runs are made again");
            ResultsError::Line { line, what, next }
        })?;
        self.lines += 1;
        self.bytes += text.len() as u64;
        Ok(Some((text, result)))
    }

    /// A line and its result, if that is of the run that has its turn.
    fn checked(&self, text: Vec<u8>) -> Result<(String, RunResult), String> {
        if self.runs() >= self.shard.share(self.sweep.runs) {
            return Err("expected no line after the last run".into());
        }
        let number = self.shard.number(self.runs());
        let not_a_result = |reason: String| format!("expected the result of run {number}: {reason}");
        let text = String::from_utf8(text).map_err(|error| not_a_result(error.to_string()))?;
        let result: RunResult = serde_json::from_str(&text).map_err(|error| not_a_result(error.to_string()))?;
        if result.run == number && result.is_of(self.sweep) {
            Ok((text, result))
        } else {
            Err(not_a_result(format!("it is that of run {}, seed {}", result.run, result.seed)))
        }
    }
}

fn bad_head(what: String, next: String) -> ResultsError {
    ResultsError::Line { line: 1, what, next }
}

/// The next line with its end, and whether it has one.
fn read_line(input: &mut impl BufRead) -> io::Result<(Vec<u8>, bool)> {
    let mut line = Vec::new();
    input.by_ref().take(LONGEST).read_until(b'\n', &mut line)?;
    let is_whole = line.ends_with(b"\n");
    Ok((line, is_whole))
}
