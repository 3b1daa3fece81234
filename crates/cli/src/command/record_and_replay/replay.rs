//! `ferrodrive replay`: the frames of a log, replayed with their original timing.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use can::{Frame, Instant};
use canlog::{Direction, Entry, Record};
use canopen::NodeId;
use canopen::connection_set::Service;
use cia402::object::CONTROLWORD;
use master::decode::Decoder;
use serde::Serialize;
use words::counted;
use words::models::with_files;

use crate::command::look::dump::{no_log, open_log, unreadable};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;

/// Replay a log with its original timing
///
/// Reads every format that decode reads. A log has the frames of all nodes on the bus: --only chooses which of them are
/// sent; by default all are. Frames that may set a drive in motion (NMT start, RPDOs, writes to controlword, mode,
/// targets and makers' objects) are sent only with --allow-motion; without it a log that has some is refused, and with
/// --skip-motion they are left out. When this command ends early, it quick-stops the nodes to which it has sent such
/// frames.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 replay trace.blf --only master --skip-motion\n  \
    ferrodrive --bus can0 replay trace.log --only 604,704 --speed 2\n  \
    ferrodrive replay trace.log --only sent --allow-motion    # on a virtual bus")]
pub(crate) struct Replay {
    /// Log file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Frames to send: master (what a master sends), nodes (what they send), sent and received (by the program that
    /// wrote the log), identifiers (604, 180-1FF); any match counts
    #[arg(long, value_name = "WHICH,..", value_delimiter = ',')]
    only: Vec<Which>,
    /// Speed as a multiple of the original, or max for as fast as the bus takes the frames
    #[arg(long, value_name = "N|max", default_value = "1")]
    speed: ReplaySpeed,
    /// Also send frames that may set a drive in motion
    #[arg(long, conflicts_with = "skip_motion")]
    allow_motion: bool,
    /// Leave out frames that may set a drive in motion
    #[arg(long)]
    skip_motion: bool,
}

/// A choice of frames.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Which {
    Master,
    Nodes,
    Sent,
    Received,
    Ids(u32, u32),
}

impl FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let id = |digits: &str| u32::from_str_radix(digits, 16).ok().filter(|id| *id <= can::CanId::MAX_EXTENDED);
        match text {
            "master" => Ok(Self::Master),
            "nodes" => Ok(Self::Nodes),
            "sent" => Ok(Self::Sent),
            "received" => Ok(Self::Received),
            _ => {
                let (first, last) = text.split_once('-').unwrap_or((text, text));
                match (id(first), id(last)) {
                    (Some(first), Some(last)) if first <= last => Ok(Self::Ids(first, last)),
                    _ => {
                        Err("expected master, nodes, sent, received, an identifier such as 604, or two such as 180-1FF"
                            .into())
                    }
                }
            }
        }
    }
}

/// A frame that masters send.
fn is_of_master(frame: &Frame) -> bool {
    use Service::{LssMaster, Nmt, Rpdo, SdoRequest, Sync, Time};
    matches!(Service::of(frame.id()), Some(Nmt | Sync | Time | Rpdo(..) | SdoRequest(_) | LssMaster))
}

impl Which {
    fn takes(&self, record: &Record, frame: &Frame) -> bool {
        match self {
            Self::Master => is_of_master(frame),
            Self::Nodes => !is_of_master(frame),
            Self::Sent => record.direction == Some(Direction::Transmitted),
            Self::Received => record.direction == Some(Direction::Received),
            Self::Ids(first, last) => (*first..=*last).contains(&frame.id().raw()),
        }
    }
}

/// How many times faster; `None` for as fast as it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ReplaySpeed(Option<f64>);

impl FromStr for ReplaySpeed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "max" => Ok(Self(None)),
            _ => match text.parse::<f64>() {
                Ok(times) if (0.001..=1000.0).contains(&times) => Ok(Self(Some(times))),
                _ => Err("expected a number from 0.001 to 1000, or max".into()),
            },
        }
    }
}

/// Frames that go out before the run loop has its turn, where time does not divide them: fewer than wait in the master's
/// queue.
const BURST: u64 = 64;

/// Frames that move, shown of a log that is refused.
const SHOWN: usize = 3;

/// What was sent.
#[derive(Debug, Default, Serialize)]
pub(crate) struct ReplayReport {
    file: String,
    sent: u64,
    /// Frames that --only left out.
    not_chosen: u64,
    /// Frames that may move a drive, left out by --skip-motion.
    motion_skipped: u64,
    /// Of those sent.
    motion_sent: u64,
    /// Places of the log that could not be read, error frames and CAN FD frames.
    passed_over: u64,
    /// Nodes that are on the bus themselves, and whose frames were sent.
    sent_for: Vec<u8>,
    /// From the first frame to the last, as they were sent.
    took_s: f64,
}

/// The log, frame by frame, with why each may move a drive.
struct Frames<'a> {
    reader: canlog::AnyLogReader,
    decoder: Decoder,
    only: &'a [Which],
    path: &'a Path,
    not_chosen: u64,
    passed_over: u64,
    /// Nothing but places that are not read has come.
    is_garbage: bool,
}

/// A frame that is to be sent.
struct Next {
    at: Instant,
    frame: Frame,
    /// The node that sends it, where that is not a master.
    of: Option<NodeId>,
    moves: Option<(&'static str, Option<NodeId>)>,
}

impl Frames<'_> {
    fn next(&mut self) -> Result<Option<Next>, Failure> {
        while let Some(entry) = self.reader.next_entry().map_err(|error| unreadable(self.path, &error))? {
            let Entry::Record(record) = entry else {
                self.passed_over += 1;
                continue;
            };
            self.is_garbage = false;
            let Some(frame) = record.frame().copied() else {
                self.passed_over += 1;
                continue;
            };
            // Omitted frames are decoded as well: they show how PDOs are mapped, and what a segment belongs to.
            let decoded = self.decoder.decode(&frame);
            if !self.only.is_empty() && !self.only.iter().any(|which| which.takes(&record, &frame)) {
                self.not_chosen += 1;
                continue;
            }
            let moves = decoded.may_move().map(|why| (why, decoded.may_move_node()));
            let of = decoded.node().filter(|_| !is_of_master(&frame));
            return Ok(Some(Next { at: record.at.unwrap_or(Instant::ZERO), frame, of, moves }));
        }
        if self.is_garbage && self.passed_over > 0 {
            return Err(no_log(self.path, self.reader.format()));
        }
        Ok(None)
    }
}

impl Replay {
    /// Sends what was chosen.
    pub(crate) async fn run(&self, context: &Context) -> Result<ReplayReport, Failure> {
        if !self.allow_motion && !self.skip_motion {
            self.refuse_motion(context)?;
        }
        let mut frames = self.frames(context)?;
        let mut report = ReplayReport { file: self.file.display().to_string(), ..ReplayReport::default() };
        let begin = context.network.now();
        let (mut first, mut sent_for) = (None, BTreeSet::new());
        while let Some(Next { at, frame, of, moves }) = frames.next()? {
            if moves.is_some() && self.skip_motion {
                report.motion_skipped += 1;
                continue;
            }
            let since = at.as_nanos().saturating_sub(*first.get_or_insert(at.as_nanos()));
            self.wait(context, begin, since, report.sent).await;
            if let Some((_, node)) = moves {
                report.motion_sent += 1;
                // Whatever ends this command early now stops these nodes.
                let nodes = node.map_or_else(|| context.network.seen().iter().collect(), |node| vec![node]);
                nodes.into_iter().for_each(|node| context.network.note_moved(node, CONTROLWORD));
            }
            context.network.transmit(frame);
            sent_for.extend(of);
            report.sent += 1;
            context.progress.show(format!("{} frames sent", report.sent));
        }
        context.settle().await;
        report.took_s = (context.network.now() - begin).as_secs_f64();
        (report.not_chosen, report.passed_over) = (frames.not_chosen, frames.passed_over);
        let seen = context.network.seen();
        report.sent_for = sent_for.into_iter().filter(|node| seen.contains(*node)).map(NodeId::raw).collect();
        if report.motion_sent > 0 {
            context.warn(
                "frames that move drives were sent: drives in motion keep moving; ferrodrive quick-stop NODE stops one",
            );
        }
        Ok(report)
    }

    fn frames(&self, context: &Context) -> Result<Frames<'_>, Failure> {
        if self.file.as_os_str() == "-" {
            return Err(Failure::usage("a replay reads its log twice, and cannot read it from standard input")
                .because("frames that may move a drive are reported before anything is sent")
                .next("write the log to a file first"));
        }
        let mut decoder = Decoder::knowing(with_files(std::iter::empty()));
        for node in (1..=127).filter_map(NodeId::new) {
            if let Some(model) = context.stated_model(node) {
                decoder.set_model(node, model);
            }
        }
        let reader = open_log(&self.file)?;
        Ok(Frames {
            reader,
            decoder,
            only: &self.only,
            path: &self.file,
            not_chosen: 0,
            passed_over: 0,
            is_garbage: true,
        })
    }

    /// Waits for the time of the next frame.
    async fn wait(&self, context: &Context, begin: Instant, since_nanos: u64, sent: u64) {
        match self.speed {
            ReplaySpeed(Some(times)) => {
                let due = begin + Duration::from_nanos((since_nanos as f64 / times) as u64);
                let now = context.network.now();
                if due > now {
                    context.network.sleep(due - now).await;
                } else if sent.is_multiple_of(BURST) {
                    context.network.sleep(Duration::from_micros(1)).await;
                }
            }
            ReplaySpeed(None) if sent.is_multiple_of(BURST) => context.network.sleep(Duration::from_millis(10)).await,
            ReplaySpeed(None) => {}
        }
    }

    /// Says what of the log may move a drive, and what to do about it.
    fn refuse_motion(&self, context: &Context) -> Result<(), Failure> {
        let mut frames = self.frames(context)?;
        let (mut reasons, mut examples, mut first) = (BTreeMap::<_, u64>::new(), Vec::new(), None);
        while let Some(next) = frames.next()? {
            let began = *first.get_or_insert(next.at);
            if let Some((why, _)) = next.moves {
                *reasons.entry(why).or_default() += 1;
                if examples.len() < SHOWN {
                    let at = (next.at - began).as_secs_f64();
                    examples.push(format!("{at:.6} s from its first frame: {} ({why})", next.frame));
                }
            }
        }
        if reasons.is_empty() {
            return Ok(());
        }
        let all: u64 = reasons.values().sum();
        let counts: Vec<String> = reasons.iter().map(|(why, count)| format!("{count} x {why}")).collect();
        let failure = Failure::new(format!("{all} frames of {} may set a drive in motion", self.file.display()))
            .of_kind("motion")
            .because(counts.join(", "));
        let failure = examples.into_iter().fold(failure, Failure::because);
        Err(failure
            .next("--skip-motion leaves them out")
            .next("--allow-motion sends them; first make sure that no person is near, and that an emergency stop is within reach"))
    }
}

impl Report for ReplayReport {
    fn text(&self, paint: Paint) -> String {
        let Self { file, sent, not_chosen, motion_skipped, motion_sent, passed_over, sent_for, took_s } = self;
        let mut text = format!("{} of {file} sent in {took_s:.3} s", paint.strong(&counted(*sent, "frame")));
        for (count, what) in [
            (motion_sent, "of them may move a drive"),
            (motion_skipped, "that may move a drive left out"),
            (not_chosen, "not chosen"),
            (passed_over, "not read as frames"),
        ] {
            if *count > 0 {
                text.push_str(&format!("; {count} {what}"));
            }
        }
        if !sent_for.is_empty() {
            let nodes: Vec<_> = sent_for.iter().map(u8::to_string).collect();
            let twice = format!(
                "frames were sent in the name of nodes that are on the bus themselves ({}): two senders of one identifier disturb each \
                 other, and requests have two answers; --only master leaves them out",
                nodes.join(", ")
            );
            text.push_str(&format!("\n{}", paint.bad(&twice)));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_chosen_by_who_sent_them_and_by_identifier() {
        let takes = |which: &str, frame: &str, direction| {
            let frame: Frame = frame.parse().unwrap();
            let record = Record { direction, ..Record::of_frame(Instant::ZERO, frame) };
            which.parse::<Which>().unwrap().takes(&record, &frame)
        };
        for (which, frame, taken) in [
            ("master", "604#4041600000000000", true),
            ("master", "000#0104", true),
            ("master", "080#", true),
            ("master", "204#0F00", true),
            ("master", "584#4341600000000000", false),
            ("nodes", "584#4341600000000000", true),
            ("nodes", "704#05", true),
            ("604", "604#00", true),
            ("180-1FF", "184#00", true),
            ("180-1FF", "200#00", false),
        ] {
            assert_eq!(takes(which, frame, None), taken, "{which} {frame}");
        }
        assert!(takes("sent", "604#00", Some(Direction::Transmitted)) && !takes("sent", "604#00", None));
        assert!(takes("received", "604#00", Some(Direction::Received)));
        for wrong in ["", "them", "1FF-180", "99999999", "-"] {
            assert!(wrong.parse::<Which>().is_err(), "{wrong}");
        }
    }
}
