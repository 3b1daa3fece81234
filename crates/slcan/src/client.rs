//! The host's side of one slcan connection: opens the channel, whatever state the adapter was left in, and says what it answers.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Bitrate, Frame, Instant};

use crate::codec::{Answer, Command, Decoder, Line, Malformed, bitrate_code};
use crate::status::Status;

/// How long an adapter may take for an answer. Some firmwares never acknowledge; those cost this much at opening.
const PATIENCE: Duration = Duration::from_millis(500);

/// How often the status flags are asked for: often enough for a person, and one frame's worth of the line.
const STATUS_PERIOD: Duration = Duration::from_secs(1);

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
enum Phase {
    /// The answer to V, behind those of the lines before it; then the bit rate is selected.
    Clearing,
    /// The answer to S.
    Selecting,
    /// The answer to O.
    Opening,
    Open(Polling),
    Failed,
}

/// Whether the adapter reports its status flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Polling {
    /// It does not.
    Never,
    /// Asked for the first time: answers come in the order of the commands, so a BEL that comes next says no.
    Asked,
    /// Asked, by one that answers.
    AskedAgain,
    /// It does, and is asked again then.
    Due(Instant),
}

/// The side of the program that has the port.
#[derive(Clone, Debug)]
pub struct Client {
    /// The digit behind `S`.
    code: Option<u8>,
    phase: Phase,
    /// When the present phase of opening ends without an answer.
    deadline: Instant,
    /// The adapter has answered one of the commands.
    has_answered: bool,
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
            phase: Phase::Clearing,
            deadline: now + PATIENCE,
            has_answered: false,
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
                Phase::Open(polling) => self.handle_line(line, polling, now),
                _ => self.handle_opening(line.ok(), now),
            }
        }
    }

    /// Time has reached `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        match self.phase {
            Phase::Clearing | Phase::Selecting | Phase::Opening if now >= self.deadline => self.next_phase(now),
            Phase::Open(Polling::Due(at)) if now >= at => {
                self.phase = Phase::Open(Polling::AskedAgain);
                Command::Status.emit(&mut self.output);
            }
            _ => {}
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) is to be called next.
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match self.phase {
            Phase::Clearing | Phase::Selecting | Phase::Opening => Some(self.deadline),
            Phase::Open(Polling::Due(at)) => Some(at),
            Phase::Open(_) | Phase::Failed => None,
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

    fn handle_opening(&mut self, answer: Option<Answer>, now: Instant) {
        let is_awaited = match (self.phase, &answer) {
            (Phase::Clearing, Some(Answer::Version(_))) => true,
            (Phase::Selecting | Phase::Opening, Some(Answer::Done)) => true,
            (Phase::Selecting, Some(Answer::Refused)) => {
                return self.fail(OpenError::BitrateRefused(self.code.unwrap_or_default()));
            }
            (Phase::Opening, Some(Answer::Refused)) => return self.fail(OpenError::OpenRefused),
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
            (Phase::Clearing, Some(code)) => {
                self.phase = Phase::Selecting;
                Command::SetBitrate(code).emit(&mut self.output);
            }
            (Phase::Clearing, None) | (Phase::Selecting, _) => {
                self.phase = Phase::Opening;
                Command::Open.emit(&mut self.output);
            }
            (Phase::Opening, _) if self.has_answered => {
                self.phase = Phase::Open(Polling::Asked);
                self.lines = 0;
                Command::Status.emit(&mut self.output);
                self.events.push_back(Event::Opened);
            }
            _ => self.fail(OpenError::Silent),
        }
    }

    fn fail(&mut self, error: OpenError) {
        self.phase = Phase::Failed;
        self.events.push_back(Event::Failed(error));
    }

    fn handle_line(&mut self, line: Result<Answer, Malformed>, polling: Polling, now: Instant) {
        let event = match line {
            Ok(Answer::Frame { frame, .. }) => Event::Frame(frame),
            Ok(Answer::Status(flags)) => {
                self.phase = Phase::Open(Polling::Due(now + STATUS_PERIOD));
                Event::Status(Status(flags))
            }
            Ok(Answer::Refused) if polling == Polling::Asked => {
                self.phase = Phase::Open(Polling::Never);
                return;
            }
            Ok(Answer::Refused) => Event::FrameRefused,
            Ok(_) => return,
            Err(malformed) => Event::Malformed(self.lines, malformed),
        };
        self.events.push_back(event);
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
        for (answers, expected) in [("V1013\r", Event::Opened), ("", Event::Failed(OpenError::Silent))] {
            let mut client = Client::open(Some(Bitrate::M1), ms(0)).expect("S8");
            client.handle_input(answers.as_bytes(), ms(1));
            while let Some(at) = client.poll_timeout() {
                client.handle_timeout(at);
            }
            assert!(client.take_output().starts_with(b"\r\rC\rV\rS8\rO\r"), "{answers:?}");
            assert_eq!(events(&mut client), [expected], "{answers:?}");
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
        assert_eq!(client.poll_timeout(), None, "the flags are not asked for again");
        client.handle_input(b"t1001", ms(1));
        client.handle_input(b"A5\rnoise\r\x07t100", ms(1));
        client.handle_input(&[0xFF; 200], ms(1));
        client.handle_input(b"\rt1000\r", ms(1));
        let found = events(&mut client);
        let frame = |text: &str| Event::Frame(text.parse().expect("a frame"));
        assert_eq!((&found[0], &found[2], &found[4]), (&frame("100#A5"), &Event::FrameRefused, &frame("100#")));
        assert!(matches!(found[1], Event::Malformed(3, Malformed::Syntax { .. })), "{found:?}");
        assert!(matches!(found[3], Event::Malformed(5, Malformed::TooLong)), "{found:?}");
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
        assert_eq!((client.take_output(), client.poll_timeout()), (b"F\r".to_vec(), None));
    }
}
