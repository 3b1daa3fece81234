//! A bus with drives, on which a test gives one command line after another.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::Bitrate;
use clap::FromArgMatches;
use processes::Ended;
use serde_json::Value;
use sim::machine::TimingMode;
use sim::{Place, Report, World};

use crate::args::Cli;
use crate::global::SharedBus;
use crate::output::{Format, kept};
use crate::scope::{self, command_line};
use crate::signals::Signal;
use crate::{Typed, complaint, run};
use machine::file::{Machine, Placed};
use plot::Paint;
use words::drive::drive_spec;

/// What the bus is called on a command line. It is not opened.
const BUS: &str = "socketcand://virtual:29536/can0";

/// Longer than any of them takes to boot, and than a ZL drive ignores its inputs then.
const BOOT: Duration = Duration::from_secs(1);

/// A bus in virtual time, which passes while a command runs and by [`VirtualBus::pass`].
pub(super) struct VirtualBus {
    world: Arc<Mutex<World>>,
    options: Vec<String>,
}

impl VirtualBus {
    /// Drives as `--drive` of `ferrodrive sim` takes them, which have booted; they take no time for what they do.
    #[track_caller]
    pub(super) fn of(drives: &[&str]) -> Self {
        Self::of_drives(drives, TimingMode::Ideal)
    }

    /// The same drives, with the times that they take.
    #[track_caller]
    pub(super) fn of_real_times(drives: &[&str]) -> Self {
        Self::of_drives(drives, TimingMode::Device)
    }

    #[track_caller]
    fn of_drives(drives: &[&str], timing: TimingMode) -> Self {
        let specs = drives.iter().map(|drive| Placed::from(drive_spec(drive).expect("a drive")));
        let mut machine = Machine::default();
        (machine.bitrate, machine.timing, machine.drives) = (Some(Bitrate::K500), Some(timing), specs.collect());
        Self::of_machine(&machine)
    }

    /// The drives of a machine file, which have booted; they take no time for what they do, unless the file has `timing`.
    #[track_caller]
    pub(super) fn of_machine(machine: &Machine) -> Self {
        let mut machine = machine.clone();
        machine.timing = machine.timing.or(Some(TimingMode::Ideal));
        let world = machine.build().expect("a machine");
        let bus = Self { world: Arc::new(Mutex::new(world)), options: Vec::new() };
        bus.pass(BOOT);
        bus
    }

    /// Every command is given these options too.
    pub(super) fn with(self, options: &[&str]) -> Self {
        Self { options: options.iter().map(|word| (*word).to_owned()).collect(), ..self }
    }

    pub(super) fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets time pass for the drives.
    pub(super) fn pass(&self, time: Duration) {
        self.world().run_for(time);
    }

    /// What is true of a drive, whatever it says.
    #[track_caller]
    pub(super) fn report(&self, drive: u8) -> Report {
        self.world().report(drive).expect("a drive of this bus")
    }

    /// Does to a drive what a world command would: `load torque -1`.
    #[track_caller]
    pub(super) fn apply(&self, drive: u8, stimulus: &str) {
        let stimulus = stimulus.parse().expect("a stimulus");
        let taken = self.world().apply(Place::node(drive), &stimulus).expect("a drive of this bus");
        taken.expect("the drive takes it");
    }

    /// Gives a command line, and waits for its end.
    #[track_caller]
    pub(super) fn run(&self, words: &[&str]) -> Ended {
        self.run_until(words, &[])
    }

    /// Gives a command line that these signals ask to end, each so long after it began.
    #[track_caller]
    pub(super) fn run_until(&self, words: &[&str], signals: &[(Duration, Signal)]) -> Ended {
        let before = ["--bus", BUS].into_iter().chain(self.options.iter().map(String::as_str));
        let shared = SharedBus { world: Arc::clone(&self.world), signals: signals.to_vec() };
        ended(before.chain(words.iter().copied()), Some(shared))
    }

    /// Gives a command line that has to succeed.
    #[track_caller]
    pub(super) fn done(&self, words: &[&str]) -> Ended {
        let ended = self.run(words);
        assert_eq!(ended.status, Some(0), "{words:?}: {}{}", ended.out, ended.err);
        ended
    }

    /// The same with `--json`; its report.
    #[track_caller]
    pub(super) fn json(&self, words: &[&str]) -> Value {
        self.done(&[&["--json"], words].concat()).json()
    }

    /// Gives a command line that has to fail, with these words on standard error.
    #[track_caller]
    pub(super) fn refused(&self, words: &[&str], parts: &[&str]) {
        let ended = self.run(words);
        assert_eq!(ended.status, Some(1), "{words:?}: {}{}", ended.out, ended.err);
        for part in parts {
            assert!(ended.err.contains(part), "{words:?} should say {part:?}, but says: {}", ended.err);
        }
    }
}

/// Gives a command line that asks no bus, and waits for its end.
pub(super) fn without_bus(words: &[&str]) -> Ended {
    ended(words.iter().copied(), None)
}

/// What `main` does with the words of a command line.
fn ended<'a>(words: impl Iterator<Item = &'a str>, shared: Option<SharedBus>) -> Ended {
    let matches = match command_line().try_get_matches_from(std::iter::once("ferrodrive").chain(words)) {
        Ok(matches) => matches,
        Err(error) => {
            let (status, err) = match crate::failure::of_named_file(&error) {
                Some(failure) => (failure.status as i32, failure.to_string()),
                None => (error.exit_code(), error.render().to_string()),
            };
            return Ended { status: Some(status), out: String::new(), err };
        }
    };
    let mut cli = Cli::from_arg_matches(&matches).expect("it was parsed");
    cli.global.shared = shared;
    let format = Format { json: cli.global.json, paint: Paint::OFF };
    let ((out, err), ended) = kept::keep(|| {
        let heeded = scope::refuse_unheeded(&cli.global, &cli.command, &matches);
        let global = heeded.and_then(|()| cli.global.with_machine_file(&matches));
        global.and_then(|global| run(&global, format, &cli.command, Typed::of(&matches)))
    });
    let Err(failure) = ended else { return Ended { status: Some(0), out, err } };
    let said = complaint(format, Paint::OFF, &failure).unwrap_or_default();
    let (out, err) = if format.json { (out + &said, err) } else { (out, err + &said) };
    Ended { status: Some(failure.status as i32), out, err }
}
