//! The file of a sweep's results: where it goes on, and what is on the disk.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufReader, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use scenario::sweep::results::{MergeError, Reader, ResultsError, RunResult, head, merge};
use scenario::sweep::{Shard, Summary, Sweep};
use transport::WallClock;

use crate::failure::Failure;
use crate::output::{is_stdout, stdout_file};

/// What a power failure may cost. A process that is killed loses nothing of what it has written.
const SYNCED_EVERY: Duration = Duration::from_secs(1);

/// A file of results, and what of it is there already.
pub(super) struct ResultsFile {
    path: PathBuf,
    file: File,
    clock: WallClock,
    synced: can::Instant,
}

impl ResultsFile {
    /// Makes the file, or with `resume` goes on with one: what is whole in it is added to `summary`, what was torn off at its end is
    /// cut. With the number of runs that it has.
    pub(super) fn open(
        path: &Path,
        sweep: &Sweep,
        resume: bool,
        summary: &mut Summary,
    ) -> Result<(Self, u64), Failure> {
        let failed = |error: std::io::Error| Failure::of_writing("the results", path, &error);
        if is_stdout(path) {
            let (file, clock) = (stdout_file().map_err(failed)?, WallClock::start());
            let mut results = Self { path: path.to_owned(), file, synced: clock.now(), clock };
            results.append(&head(sweep, sweep.shard()))?;
            return Ok((results, 0));
        }
        let mut file = if resume {
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?
        } else {
            create(path, "--resume continues it; otherwise remove it, or give another --output")?
        };
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                return Err(Failure::new(format!("{} is being written by another process", path.display()))
                    .of_kind("file")
                    .next("wait for that process, or end it; each shard has a file of its own"));
            }
            // Where the file system has no locks a second writer is not noticed.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let (runs, bytes) = go_through(&file, sweep, summary).map_err(|error| unusable(path, &error))?;
        file.set_len(bytes).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
        let clock = WallClock::start();
        let mut results = Self { path: path.to_owned(), file, synced: clock.now(), clock };
        if bytes == 0 {
            results.append(&head(sweep, sweep.shard()))?;
        }
        Ok((results, runs))
    }

    /// Appends a line, whole.
    pub(super) fn append(&mut self, line: &str) -> Result<(), Failure> {
        self.file.write_all(line.as_bytes()).map_err(|error| self.failed(&error))?;
        if self.clock.now() >= self.synced + SYNCED_EVERY {
            self.finish()?;
        }
        Ok(())
    }

    /// Returns when all of it is on the disk.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        self.synced = self.clock.now();
        // What is written to a pipe or a terminal is there at once.
        if is_stdout(&self.path) {
            return Ok(());
        }
        self.file.sync_data().map_err(|error| self.failed(&error))
    }

    fn failed(&self, error: &std::io::Error) -> Failure {
        if is_stdout(&self.path) {
            return Failure::of_writing("the results", &self.path, error);
        }
        Failure::of_writing("the results", &self.path, error)
            .next("what is in the file is kept: the same command with --resume goes on")
    }
}

/// A file that is not there yet.
fn create(path: &Path, if_it_exists: &str) -> Result<File, Failure> {
    OpenOptions::new().read(true).write(true).create_new(true).open(path).map_err(|error| {
        if error.kind() != std::io::ErrorKind::AlreadyExists {
            return Failure::of_writing("the results", path, &error);
        }
        already_exists(path, if_it_exists)
    })
}

fn already_exists(path: &Path, next: &str) -> Failure {
    Failure::new(format!("{} already exists", path.display())).of_kind("file_exists").next(next)
}

/// Adds what is whole to the summary. Makes the last of these runs again: what the head does not have (a data sheet, another build of
/// the same version) shows in its digest. How many runs and bytes are whole.
fn go_through(file: &File, sweep: &Sweep, summary: &mut Summary) -> Result<(u64, u64), ResultsError> {
    let Some(mut reader) = Reader::of_shard(sweep, sweep.shard(), BufReader::new(file))? else { return Ok((0, 0)) };
    let mut last = None;
    while let Some((_, result)) = reader.next_result()? {
        summary.add(sweep, &result);
        last = Some(result);
    }
    if let Some(last) = last.filter(|last| *last != RunResult::new(sweep, last.run, &sweep.run(last.run))) {
        return Err(ResultsError::Line {
            line: reader.runs() + 1,
            what: format!("run {} gives another result now", last.run),
            next: "go on with the build of ferrodrive and the data sheets of that time, or write to another file"
                .into(),
        });
    }
    Ok((reader.runs(), reader.bytes()))
}

/// A file that becomes NAME when it is whole: until then it is NAME.part, which a merge that is killed leaves. Standard output has
/// no such part.
struct Whole<'a> {
    path: &'a Path,
    part: Option<PathBuf>,
    file: BufWriter<File>,
}

impl<'a> Whole<'a> {
    fn begin(path: &'a Path) -> Result<Self, Failure> {
        if is_stdout(path) {
            let file = stdout_file().map_err(|error| Failure::of_writing("the results", path, &error))?;
            return Ok(Self { path, part: None, file: BufWriter::new(file) });
        }
        if path.symlink_metadata().is_ok() {
            return Err(already_exists(path, "remove it, or give another --output"));
        }
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = PathBuf::from(part);
        let file = create(&part, "another merge writes it; or one was ended before it was whole, then remove it")?;
        Ok(Self { path, part: Some(part), file: BufWriter::new(file) })
    }

    fn write(&mut self, line: &str) -> Result<(), Failure> {
        let place = self.part.as_deref().unwrap_or(self.path);
        self.file.write_all(line.as_bytes()).map_err(|error| Failure::of_writing("the results", place, &error))
    }

    /// Gives it its name, if all of it was `taken`; else it is removed.
    fn end(self, taken: Result<(), Failure>) -> Result<(), Failure> {
        let Self { path, part, mut file } = self;
        let Some(part) = part else {
            let written = file.flush().map_err(|error| Failure::of_writing("the results", path, &error));
            return taken.and(written);
        };
        let on_disk = |file: &mut BufWriter<File>| file.flush().and_then(|()| file.get_ref().sync_all());
        let written = taken.and_then(|()| {
            let named = on_disk(&mut file).and_then(|()| std::fs::rename(&part, path));
            named.map_err(|error| Failure::of_writing("the results", path, &error))
        });
        if written.is_err() {
            let _ = std::fs::remove_file(&part);
        }
        written
    }
}

/// Adds the results of all parts to `summary`, and writes them to one file if one is given.
pub(super) fn merge_files(
    parts: &[PathBuf],
    output: Option<&Path>,
    sweep: &Sweep,
    summary: &mut Summary,
    again: &str,
) -> Result<(), Failure> {
    let opened = parts
        .iter()
        .map(|path| File::open(path).map(BufReader::new).map_err(|error| unusable(path, &ResultsError::Read(error))));
    let opened = opened.collect::<Result<Vec<_>, _>>()?;
    let mut merged = output.map(Whole::begin).transpose()?;
    let mut write = |line: &str| merged.as_mut().map_or(Ok(()), |merged| merged.write(line));
    let taken = write(&head(sweep, Shard::WHOLE)).and_then(|()| {
        let take = |line: &str, result: &RunResult| {
            summary.add(sweep, result);
            write(line)
        };
        merge(sweep, opened, take).map_err(|error| of_merge(parts, error, again))
    });
    match merged {
        None => taken,
        Some(merged) => merged.end(taken),
    }
}

fn of_merge(parts: &[PathBuf], error: MergeError<Failure>, again: &str) -> Failure {
    match error {
        MergeError::Taken(failure) => failure,
        MergeError::Part { part, error } => unusable(&parts[part], &error),
        MergeError::Parts { .. } => Failure::bad_file("these files are not the parts of a sweep")
            .because(error)
            .next("give each part once: --merge part-*.jsonl"),
        MergeError::Incomplete { part, shard, .. } => {
            let path = parts[part].display();
            Failure::bad_file(format!("{path} is not whole"))
                .because(error)
                .next(format!("{again} --shard {shard} -o {path} --resume"))
        }
    }
}

fn unusable(path: &Path, error: &ResultsError) -> Failure {
    let failure = Failure::bad_file(format!("cannot use the results {}", path.display())).because(error);
    match error {
        ResultsError::Line { next, .. } => failure.next(next),
        ResultsError::Read(_) => failure.next("make sure that it is a file that can be read"),
    }
}
