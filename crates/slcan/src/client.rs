//! The host's side of one slcan connection: opens the channel, whatever state the adapter was left in, and says what it answers.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Bitrate, Frame, Instant};

use crate::codec::{Answer, Command, Decoder, Line, Malformed, bitrate_code};
use crate::status::Status;

/// How long an adapter may take for an answer. Some firmwares never acknowledge; those cost this much at opening.
const PATIENCE: Duration = Duration::from_millis(500);

/// How often the status flags are asked for: often enough for a person, and one frame's worth of the line. An adapter that has none is
/// asked for its version instead.
const ASKED_EVERY: Duration = Duration::from_secs(1);

/// How long an open adapter that is asked may say nothing at all before it is asked again.
const SILENCE: Duration = Duration::from_secs(1);

/// How often in a row an adapter is asked that says nothing: one answer may be lost, and a caller that was held up asks again before it
/// judges.
const TRIES: u8 = 2;

/// What an adapter brings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The channel is open.
    Opened,
    /// The channel does not open; nothing comes behind this.
    Failed(OpenError),
    /// A frame of the bus.
    Frame(Frame),
    /// The status flags, as they were asked for.
    Status(Status),
    /// A frame of the host is lost: the adapter was in bus-off, or its send queue was full. The services above notice by their timeouts.
    FrameRefused,
    /// A line that is not slcan, by its number since the channel opened: noise, or an extension of the firmware.
    Malformed(u64, Malformed),
    /// The adapter, which has answered before, says nothing any more; nothing comes behind this.
    Silent,
}

/// Why a channel does not open.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// BEL to S.
    #[error("the adapter refused 'S{0}': it does not offer this bit rate")]
    BitrateRefused(u8),
    /// BEL to O.
    #[error("the adapter refused 'O': is the bit rate right?")]
    OpenRefused,
    /// It answered neither V nor O.
    #[error("nothing answered V or O: is it an slcan adapter?")]
    Silent,
}

/// What is awaited of the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OpeningPhase {
    /// The answer to V, behind those of the lines before it; then the bit rate is selected.
    Clearing,
    /// The answer to S.
    Selecting,
    /// The answer to O.
    Opening,
    Open(Polling),
    /// It has not opened, or is silent.
    Failed,
}

/// What an open adapter is asked again and again, so that its silence is noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Polling {
    /// Nothing: it answers neither F nor V.
    Never,
    /// For its flags, the first time: answers come in the order of the commands, so a BEL that comes next says no.
    First,
    /// With this, so many times since it last said anything.
    Asked(Question, u8),
    /// It is asked at the deadline.
    Due(Question),
}

/// What an adapter is known to answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Status,
    Version,
}

/// The side of the program that has the port.
#[derive(Clone, Debug)]
pub struct Client {
    /// The digit behind `S`.
    code: Option<u8>,
    phase: OpeningPhase,
    /// When the present phase, or what is awaited in it, ends without an answer.
    deadline: Instant,
    /// The adapter has answered one of the commands.
    has_answered: bool,
    /// What it has answered to V.
    version: Option<String>,
    decoder: Decoder<Answer>,
    lines: u64,
    output: Vec<u8>,
    events: VecDeque<Event>,
}

impl Client {
    /// Begins to open the channel, with this bit rate where one is given; `None` if slcan cannot select it.
    pub fn open(bitrate: Option<Bitrate>, now: Instant) -> Option<Self> {
        let code = match bitrate {
            Some(bitrate) => Some(bitrate_code(bitrate)?),
            None => None,
        };
        let mut client = Self {
            code,
            phase: OpeningPhase::Clearing,
            deadline: now + PATIENCE,
            has_answered: false,
            version: None,
            decoder: Decoder::default(),
            lines: 0,
            output: Vec::new(),
            events: VecDeque::new(),
        };
        // What an earlier host left half typed ends here, and its channel closes. How many of these lines are answered
        // differs between adapters; the answer to V shows that all of them have been.
        for command in [Command::Empty, Command::Empty, Command::Close, Command::Version] {
            command.emit(&mut client.output);
        }
        Some(client)
    }

    /// Hands a frame to the adapter.
    pub fn transmit(&mut self, frame: &Frame) {
        Command::Transmit(*frame).emit(&mut self.output);
    }

    /// Closes the channel, so that the adapter stops acknowledging frames on the bus.
    pub fn close(&mut self) {
        Command::Close.emit(&mut self.output);
    }

    /// Bytes of the adapter, cut anywhere.
    pub fn handle_input(&mut self, mut input: &[u8], now: Instant) {
        while let Some(line) = self.decoder.next(&mut input) {
            self.lines += 1;
            match self.phase {
                OpeningPhase::Open(polling) => self.handle_line(line, polling, now),
                _ => self.handle_opening(line, now),
            }
        }
    }

    /// Time has reached `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        match self.phase {
            OpeningPhase::Failed | OpeningPhase::Open(Polling::Never) => {}
            _ if now < self.deadline => {}
            OpeningPhase::Clearing | OpeningPhase::Selecting | OpeningPhase::Opening => self.next_phase(now),
            OpeningPhase::Open(Polling::First) => self.has_no_flags(now),
            OpeningPhase::Open(Polling::Due(question)) => self.ask(question, 0, now),
            OpeningPhase::Open(Polling::Asked(question, tries)) if tries < TRIES => self.ask(question, tries, now),
            OpeningPhase::Open(Polling::Asked(..)) => {
                self.phase = OpeningPhase::Failed;
                self.events.push_back(Event::Silent);
            }
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) is to be called next.
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match self.phase {
            OpeningPhase::Failed | OpeningPhase::Open(Polling::Never) => None,
            _ => Some(self.deadline),
        }
    }

    /// What happened, in order.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Whether bytes wait for the adapter.
    pub fn has_output(&self) -> bool {
        !self.output.is_empty()
    }

    /// The bytes for the adapter since the last call.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    /// The same, appended to `out`.
    pub fn append_output(&mut self, out: &mut Vec<u8>) {
        out.append(&mut self.output);
    }

    fn handle_opening(&mut self, line: Result<Answer, Malformed>, now: Instant) {
        let is_awaited = match (self.phase, &line) {
            (OpeningPhase::Clearing, line) => {
                self.version = version_in(line);
                self.version.is_some()
            }
            (OpeningPhase::Selecting | OpeningPhase::Opening, Ok(Answer::Done)) => true,
            (OpeningPhase::Selecting, Ok(Answer::Refused)) => {
                return self.fail(OpenError::BitrateRefused(self.code.unwrap_or_default()));
            }
            (OpeningPhase::Opening, Ok(Answer::Refused)) => return self.fail(OpenError::OpenRefused),
            _ => false,
        };
        if is_awaited {
            self.has_answered = true;
            self.next_phase(now);
        }
    }

    /// What was awaited has come, or does not come.
    fn next_phase(&mut self, now: Instant) {
        self.deadline = now + PATIENCE;
        match (self.phase, self.code) {
            (OpeningPhase::Clearing, Some(code)) => {
                self.phase = OpeningPhase::Selecting;
                Command::SetBitrate(code).emit(&mut self.output);
            }
            (OpeningPhase::Clearing, None) | (OpeningPhase::Selecting, _) => {
                self.phase = OpeningPhase::Opening;
                Command::Open.emit(&mut self.output);
            }
            (OpeningPhase::Opening, _) if self.has_answered => {
                self.phase = OpeningPhase::Open(Polling::First);
                self.lines = 0;
                Command::Status.emit(&mut self.output);
                self.events.push_back(Event::Opened);
            }
            _ => self.fail(OpenError::Silent),
        }
    }

    fn fail(&mut self, error: OpenError) {
        self.phase = OpeningPhase::Failed;
        self.events.push_back(Event::Failed(error));
    }

    /// Asks an open adapter, which has been asked so often since it last said anything.
    fn ask(&mut self, question: Question, tries: u8, now: Instant) {
        self.phase = OpeningPhase::Open(Polling::Asked(question, tries + 1));
        self.deadline = now + SILENCE;
        let command = match question {
            Question::Status => Command::Status,
            Question::Version => Command::Version,
        };
        command.emit(&mut self.output);
    }

    /// It answers with this: it is asked again in a while.
    fn answers(&mut self, question: Question, now: Instant) {
        self.phase = OpeningPhase::Open(Polling::Due(question));
        self.deadline = now + ASKED_EVERY;
    }

    fn has_no_flags(&mut self, now: Instant) {
        match self.version {
            Some(_) => self.answers(Question::Version, now),
            None => self.phase = OpeningPhase::Open(Polling::Never),
        }
    }

    fn handle_line(&mut self, line: Result<Answer, Malformed>, polling: Polling, now: Instant) {
        if let Polling::Asked(question, _) = polling {
            // Whatever it says, it is there.
            self.phase = OpeningPhase::Open(Polling::Asked(question, 0));
        }
        if self.version.is_some() && version_in(&line) == self.version {
            return self.answers(Question::Version, now);
        }
        let event = match line {
            Ok(Answer::Frame { frame, .. }) => Event::Frame(frame),
            Ok(Answer::Status(flags)) => {
                self.answers(Question::Status, now);
                Event::Status(Status(flags))
            }
            Ok(Answer::Refused) if polling == Polling::First => return self.has_no_flags(now),
            Ok(Answer::Refused) => Event::FrameRefused,
            Ok(_) => return,
            Err(malformed) => Event::Malformed(self.lines, malformed),
        };
        self.events.push_back(event);
    }
}

/// What a line says as an answer to V: behind the letter, as the protocol has it, or as plain words, as CANable's firmwares do.
fn version_in(line: &Result<Answer, Malformed>) -> Option<String> {
    match line {
        Ok(Answer::Version(text)) => Some(text.clone()),
        Err(Malformed::Syntax { text, .. }) if text.is_ascii() && text.contains(' ') => Some(text.clone()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Adapter;

    fn ms(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    fn events(client: &mut Client) -> Vec<Event> {
        std::iter::from_fn(|| client.poll_event()).collect()
    }

    /// Both sides, until neither has anything to say.
    fn exchange(client: &mut Client, adapter: &mut Adapter, now: Instant) {
        loop {
            let said = client.take_output();
            let mut said = said.as_slice();
            while adapter.receive(&mut said).is_some() {}
            let mut answers = Vec::new();
            while adapter.next_reply(&mut answers) {}
            if answers.is_empty() && !client.has_output() {
                return;
            }
            client.handle_input(&answers, now);
        }
    }

    #[test]
    fn the_two_sides_agree_and_a_wrong_bit_rate_does_not_open() {
        let mut adapter = Adapter::new(Some(Bitrate::K500));
        let mut client = Client::open(Some(Bitrate::K500), ms(0)).expect("S6");
        exchange(&mut client, &mut adapter, ms(0));
        assert_eq!(events(&mut client), [Event::Opened, Event::Status(Status(0))]);
        // A second host finds the channel open, and closes it first.
        let mut client = Client::open(Some(Bitrate::K250), ms(0)).expect("S5");
        exchange(&mut client, &mut adapter, ms(0));
        let [Event::Failed(error)] = &events(&mut client)[..] else { panic!("it opened") };
        assert_eq!(error.to_string(), "the adapter refused 'O': is the bit rate right?");
        assert!(Client::open(Bitrate::new(40_000), ms(0)).is_none());
    }

    #[test]
    fn an_adapter_that_acknowledges_nothing_opens_by_its_version_and_a_silent_line_does_not() {
        let words = "b158aa7-dirty https://example.org/firmware.git\r";
        for (answers, expected) in [
            ("V1013\r", &[Event::Opened, Event::Silent][..]),
            (words, &[Event::Opened, Event::Silent]),
            ("\u{fffd} \u{fffd}\rnoise\r", &[Event::Failed(OpenError::Silent)]),
            ("", &[Event::Failed(OpenError::Silent)]),
        ] {
            let mut client = Client::open(Some(Bitrate::M1), ms(0)).expect("S8");
            client.handle_input(answers.as_bytes(), ms(1));
            while let Some(at) = client.poll_timeout() {
                client.handle_timeout(at);
            }
            assert!(client.take_output().starts_with(b"\r\rC\rV\rS8\rO\r"), "{answers:?}");
            assert_eq!(events(&mut client), expected, "{answers:?}");
        }
    }

    #[test]
    fn what_a_broken_line_brings_costs_only_itself() {
        let mut client = Client::open(None, ms(0)).expect("any adapter");
        // BEL for the close of a closed channel; then the flags are refused, as by adapters that have none.
        for byte in b"\r\r\x07V1\r\r\x07" {
            client.handle_input(&[*byte], ms(0));
        }
        assert_eq!(events(&mut client), [Event::Opened]);
        assert_eq!(client.poll_timeout(), Some(ms(1000)), "then its version shows that it is there");
        client.handle_timeout(ms(1000));
        assert!(client.take_output().ends_with(b"F\rV\r"), "the flags are not asked for again");
        client.handle_input(b"V1\r", ms(1000));
        client.handle_input(b"t1001", ms(1));
        client.handle_input(b"A5\rnoise\r\x07t100", ms(1));
        client.handle_input(&[0xFF; 200], ms(1));
        client.handle_input(b"\rt1000\r", ms(1));
        let found = events(&mut client);
        let frame = |text: &str| Event::Frame(text.parse().expect("a frame"));
        assert_eq!((&found[0], &found[2], &found[4]), (&frame("100#A5"), &Event::FrameRefused, &frame("100#")));
        assert!(matches!(found[1], Event::Malformed(4, Malformed::Syntax { .. })), "{found:?}");
        assert!(matches!(found[3], Event::Malformed(6, Malformed::TooLong)), "{found:?}");
        assert_eq!(found.len(), 5);
    }

    proptest! {
        /// Whatever an adapter sends, however it is cut: the same events and bytes, and an end of the opening.
        #[test]
        fn any_bytes_are_taken_the_same_however_they_are_cut(
            pieces in proptest::collection::vec("(\r|\u{7}|V1\r|z\r|F00\r|t1000\r|t1|@|.)", 0..30)
        ) {
            let made = |bytes: &[&[u8]]| {
                let mut client = Client::open(Some(Bitrate::K500), ms(0)).expect("S6");
                bytes.iter().for_each(|piece| client.handle_input(piece, ms(0)));
                while let Some(at) = client.poll_timeout() {
                    client.handle_timeout(at);
                }
                (events(&mut client), client.take_output())
            };
            let stream = pieces.concat();
            let whole = made(&[stream.as_bytes()]);
            prop_assert!(whole.0.iter().any(|event| matches!(event, Event::Opened | Event::Failed(_))));
            prop_assert_eq!(made(&stream.as_bytes().chunks(1).collect::<Vec<_>>()), whole);
        }
    }

    #[test]
    fn the_flags_are_asked_for_once_a_second() {
        let mut client = Client::open(None, ms(0)).expect("any adapter");
        client.handle_input(b"\r\r\rV1\r\rF24\r", ms(10));
        assert_eq!(events(&mut client), [Event::Opened, Event::Status(Status(0x24))]);
        client.take_output();
        assert_eq!(client.poll_timeout(), Some(ms(1010)));
        client.handle_timeout(ms(1009));
        assert!(!client.has_output());
        client.handle_timeout(ms(1010));
        assert_eq!((client.take_output(), client.poll_timeout()), (b"F\r".to_vec(), Some(ms(2010))));
    }

    /// What is asked, what the adapter says to it, and when it is known to be gone.
    #[test]
    fn an_adapter_that_falls_silent_is_noticed_whatever_it_answered_before() {
        let words = "b158aa7 https://example.org/firmware.git";
        // It has flags; it refuses them, or passes over F, and has a version of either form; it acknowledges O alone.
        for (answers, asked) in [
            ("\r\r\rV1\r\rF24\r".to_owned(), Some("F\r")),
            ("\r\r\rV1\r\r\x07".to_owned(), Some("V\r")),
            (format!("{words}\r"), Some("V\r")),
            ("\r".to_owned(), None),
        ] {
            let mut client = Client::open(None, ms(0)).expect("any adapter");
            client.handle_input(answers.as_bytes(), ms(0));
            let Some(asked) = asked else {
                client.handle_timeout(ms(500));
                client.handle_input(b"\r", ms(500));
                client.handle_timeout(ms(1000));
                assert_eq!((events(&mut client), client.poll_timeout()), (vec![Event::Opened], None));
                continue;
            };
            // By its patience, where it acknowledges nothing.
            let first = loop {
                client.take_output();
                let at = client.poll_timeout().expect("it is asked again");
                client.handle_timeout(at);
                if client.take_output() == asked.as_bytes() && at >= ms(1000) {
                    break at;
                }
            };
            assert_eq!(events(&mut client).first(), Some(&Event::Opened), "{answers:?}");
            // A frame alone shows that it is there: it is asked again, as often as that.
            let mut at = first;
            for _ in 0..5 {
                client.handle_input(b"t1000\r", at);
                at += SILENCE;
                client.handle_timeout(at);
                assert_eq!((client.take_output(), events(&mut client).len()), (asked.as_bytes().to_vec(), 1));
            }
            // A caller that was held up asks once more, and hears what has come meanwhile.
            at += Duration::from_secs(100);
            client.handle_timeout(at);
            assert_eq!((client.take_output(), events(&mut client)), (asked.as_bytes().to_vec(), vec![]));
            let answer = if asked == "F\r" {
                "F00"
            } else if answers.contains(words) {
                words
            } else {
                "V1"
            };
            client.handle_input(format!("{answer}\r").as_bytes(), at);
            assert!(!matches!(events(&mut client)[..], [Event::Malformed(..)]), "{answers:?}");
            at += ASKED_EVERY;
            // Then nothing more.
            for expected in [None, None, Some(Event::Silent)] {
                assert_eq!(client.poll_timeout(), Some(at), "{answers:?}");
                client.handle_timeout(at);
                assert_eq!(client.poll_event(), expected, "{answers:?}");
                at += SILENCE;
            }
            assert_eq!(client.poll_timeout(), None);
        }
    }
}
