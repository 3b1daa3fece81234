//! Lines that wait for one client, within bounds: the oldest values and events are dropped when the client does not
//! read, and their number is reported.

use std::collections::VecDeque;

use serde_json::json;

/// The kind of a line, which decides whether it is dropped when the client does not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The answer to a request. Never dropped: a client with many unread answers is not listened to instead.
    Answer,
    /// An event. Some thousands wait.
    Event,
    /// A sample of values. The newest matter; fewer wait than events.
    Values,
}

/// Bytes of answers that may wait before the client is not listened to any more.
const ANSWERS: usize = 256 << 10;
/// Bytes of events that may wait: some 5,000.
const EVENTS: usize = 1 << 20;
/// Bytes of values that may wait.
const VALUES: usize = 128 << 10;

/// Lines of one class, each with its place among all.
#[derive(Clone, Debug, Default)]
struct Queue {
    lines: VecDeque<(u64, String)>,
    bytes: usize,
    dropped: u64,
}

impl Queue {
    fn push(&mut self, place: u64, line: String) {
        self.bytes += line.len();
        self.lines.push_back((place, line));
    }

    fn pop(&mut self) -> Option<String> {
        let (_, line) = self.lines.pop_front()?;
        self.bytes -= line.len();
        Some(line)
    }

    fn drop_oldest(&mut self, limit: usize) {
        while self.bytes > limit && self.pop().is_some() {
            self.dropped += 1;
        }
    }

    fn place(&self) -> Option<u64> {
        self.lines.front().map(|(place, _)| *place)
    }
}

/// What waits for one client, within bounds: answers before samples, and of samples the newest.
#[derive(Clone, Debug, Default)]
pub struct Outbox {
    answers: Queue,
    events: Queue,
    values: Queue,
    pushed: u64,
}

impl Outbox {
    /// Adds a line, without its end.
    pub fn put(&mut self, class: Class, line: String) {
        self.pushed += 1;
        let (queue, limit) = match class {
            Class::Answer => (&mut self.answers, usize::MAX),
            Class::Event => (&mut self.events, EVENTS),
            Class::Values => (&mut self.values, VALUES),
        };
        queue.push(self.pushed, line);
        queue.drop_oldest(limit);
    }

    /// The next line to send. Where lines were dropped, a line that counts them comes first.
    pub fn next_line(&mut self) -> Option<String> {
        let (events, values) = (std::mem::take(&mut self.events.dropped), std::mem::take(&mut self.values.dropped));
        if events + values > 0 {
            return Some(json!({ "dropped": { "events": events, "values": values } }).to_string());
        }
        let queues = [&mut self.answers, &mut self.events, &mut self.values];
        queues.into_iter().filter(|queue| queue.place().is_some()).min_by_key(|queue| queue.place())?.pop()
    }

    /// Nothing waits.
    pub fn is_empty(&self) -> bool {
        [&self.answers, &self.events, &self.values].iter().all(|queue| queue.lines.is_empty() && queue.dropped == 0)
    }

    /// So many answers wait that the client is not to be listened to before it has read some.
    pub fn is_full(&self) -> bool {
        self.answers.bytes > ANSWERS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drain(outbox: &mut Outbox) -> Vec<String> {
        std::iter::from_fn(|| outbox.next_line()).collect()
    }

    #[test]
    fn lines_keep_their_order_across_classes() {
        let mut outbox = Outbox::default();
        let classes = [Class::Values, Class::Event, Class::Answer, Class::Event, Class::Values];
        for (number, class) in classes.into_iter().enumerate() {
            outbox.put(class, number.to_string());
        }
        assert_eq!(drain(&mut outbox), ["0", "1", "2", "3", "4"]);
        assert!(outbox.is_empty());
    }

    #[test]
    fn a_client_that_does_not_read_loses_old_values_first_then_old_events_and_no_answer() {
        let mut outbox = Outbox::default();
        let line = |number: u32| format!("{number:1000}");
        outbox.put(Class::Answer, "answer".to_owned());
        for number in 0..10_000 {
            outbox.put(Class::Event, line(number));
            outbox.put(Class::Values, line(number));
        }
        let lines = drain(&mut outbox);
        let (events, values) = (EVENTS as u64 / 1000, VALUES as u64 / 1000);
        let said = json!({ "dropped": { "events": 10_000 - events, "values": 10_000 - values } });
        assert_eq!(lines[..2], [said.to_string(), "answer".to_owned()]);
        assert_eq!(lines.len() as u64, 2 + events + values);
        assert_eq!(lines.last(), Some(&line(9_999)));
        assert!(drain(&mut outbox).is_empty());
    }

    #[test]
    fn a_client_with_many_answers_unread_is_full_until_it_reads() {
        let mut outbox = Outbox::default();
        while !outbox.is_full() {
            outbox.put(Class::Answer, "x".repeat(1000));
        }
        outbox.next_line();
        assert!(!outbox.is_full());
    }
}
