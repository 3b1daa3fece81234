//! The parts of a sweep, put together.

use std::io::BufRead;

use super::{Reader, ResultsError, RunResult};
use crate::sweep::{Shard, Sweep};

/// Why parts do not make a whole.
#[derive(Debug, thiserror::Error)]
pub enum MergeError<E> {
    /// A part cannot be used.
    #[error("{error}")]
    Part {
        /// Its place in the order in which the parts were given, from 0 on.
        part: usize,
        /// Why it cannot be used.
        error: ResultsError,
    },
    /// There are not as many parts as the first of them says, or one is there twice.
    #[error("expected {expected} parts, one of each shard; shard {shard} is there {times} times")]
    Parts {
        /// How many there are to be.
        expected: u64,
        /// The first that is not there once.
        shard: Shard,
        /// How often it is there.
        times: usize,
    },
    /// A part ends before its last run.
    #[error("shard {shard} has {runs} of its {share} runs")]
    Incomplete {
        /// Which, from 0 on in the order in which they were given.
        part: usize,
        /// Which of the sweep.
        shard: Shard,
        /// Runs that it has.
        runs: u64,
        /// Runs that it is to have.
        share: u64,
    },
    /// What takes the results refuses one.
    #[error("{0}")]
    Taken(E),
}

/// Hands the results of all runs with their lines to `take`, in the order of the runs, however the parts were made.
///
/// # Errors
/// That the parts are not those of this sweep, each whole and there once; before the first result is handed out, but for what is
/// found on the way: a line that cannot be read, and an early end.
pub fn merge<R: BufRead, E>(
    sweep: &Sweep,
    parts: impl IntoIterator<Item = R>,
    mut take: impl FnMut(&str, &RunResult) -> Result<(), E>,
) -> Result<(), MergeError<E>> {
    let of_part = |part| move |error| MergeError::Part { part, error };
    let mut readers = Vec::new();
    for (part, input) in parts.into_iter().enumerate() {
        readers.push((part, Reader::of_any(sweep, input).map_err(of_part(part))?));
    }
    // By shard from here on: the run of number n is in the part n mod count.
    readers.sort_by_key(|(_, reader)| reader.shard().index());
    let expected = readers.first().map_or(1, |(_, reader)| reader.shard().count());
    if let Some((part, reader)) = readers.iter().find(|(_, reader)| reader.shard().count() != expected) {
        let what = format!("it is shard {}, and others are of {expected}", reader.shard());
        let error = ResultsError::Line { line: 1, what, next: "give the parts of one division".into() };
        return Err(MergeError::Part { part: *part, error });
    }
    for shard in (1..=expected).filter_map(|index| Shard::new(index, expected)) {
        let times = readers.iter().filter(|(_, reader)| reader.shard() == shard).count();
        if times != 1 {
            return Err(MergeError::Parts { expected, shard, times });
        }
    }
    for number in 0..sweep.runs {
        let (part, reader) = &mut readers[(number % expected) as usize];
        let Some((line, result)) = reader.next_result().map_err(of_part(*part))? else {
            let shard = reader.shard();
            let (runs, share) = (reader.runs(), shard.share(sweep.runs));
            return Err(MergeError::Incomplete { part: *part, shard, runs, share });
        };
        take(&line, &result).map_err(MergeError::Taken)?;
    }
    // Behind its last run a part has nothing.
    readers.iter_mut().try_for_each(|(part, reader)| reader.next_result().map(|_| ()).map_err(of_part(*part)))
}
