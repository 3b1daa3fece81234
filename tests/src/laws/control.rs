//! The control connection: any bytes, in any pieces, from two clients at once.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use can::Bitrate;
use host::control::{Class, Control, LineBuffer, Outbox, Outcome, ReadLine, Sink};
use serde_json::Value;
use sim::World;
use sim::command::Service;
use sim::machine::zlac8030l;

/// Lines; what follows a NUL is how many milliseconds pass, in a byte.
pub(super) const SAMPLES: &[&[u8]] = &[
    b"{\"id\":1,\"request\":\"hello\",\"name\":\"a\"}\n{\"request\":\"now\"}\n\0\x05{\"request\":\"help\"}\n4 get\n",
    b"{\"id\":\"x\",\"request\":\"get\",\"node\":4,\"axis\":1}\n{\"request\":\"world\",\"line\":\"4 supply 90\"}\n\0\x20",
    b"{\"request\":\"world\",\"node\":4,\"command\":[\"load\",\"torque\",-2.5]}\n{\"request\":\"run\",\"for\":\"20ms\"}\n",
    b"{\"request\":\"subscribe\",\"events\":{\"nodes\":[4],\"kinds\":[\"fault\",\"power\"]}}\n4 power cut\n\0\x014 power on\n\0\x20",
    b"{\"request\":\"subscribe\",\"values\":[{\"node\":4,\"signals\":[\"velocity_rpm\",\"statusword\"]}],\"every\":\"1ms\"}\n\0\x20",
    b"{\"request\":\"subscribe\",\"events\":{}}\n{\"request\":\"unsubscribe\",\"subscription\":1}\n4 cable cut\n\0\x084 cable join\nquit\n",
];

#[derive(Clone, Debug, Default)]
struct Inbox(Rc<RefCell<(Outbox, u64)>>);

impl Sink for Inbox {
    fn put(&mut self, class: Class, line: String) {
        let mut inbox = self.0.borrow_mut();
        inbox.1 += u64::from(class == Class::Answer);
        inbox.0.put(class, line);
    }
}

/// Each line that is neither blank nor a comment gets one answer, or is a run for the caller; every line sent is an object of
/// JSON on one line; a client that goes leaves nothing behind.
pub(super) fn control(data: &[u8]) {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_probe();
    assert!(world.add_drive(4, Box::new(zlac8030l(4, 1))).is_ok(), "the first drive");
    let mut control = Control::new(None);
    let (speaker, hearer) = (Inbox::default(), Inbox::default());
    control.join(1, speaker.clone());
    control.join(2, hearer.clone());
    let all = ReadLine::Text(r#"{"request":"subscribe","events":{}}"#.to_owned());
    control.handle(2, &all, &mut world, Service::default());
    let mut buffer = LineBuffer::default();
    for part in data.split_inclusive(|byte| *byte == b'\n') {
        let (part, pause) = match part.strip_prefix(b"\0") {
            Some([pause, part @ ..]) => (part, *pause),
            _ => (part, 0),
        };
        pass(&mut world, &mut control, pause);
        let mut lines = Vec::new();
        let (first, second) = part.split_at(part.len() / 2);
        buffer.take(first, |line| lines.push(line));
        buffer.take(second, |line| lines.push(line));
        for line in lines {
            let before = speaker.0.borrow().1;
            let outcome = control.handle(1, &line, &mut world, Service::default());
            let says_nothing = matches!(&line, ReadLine::Text(text) if !sim::command::asks_for_an_answer(text));
            let answers = speaker.0.borrow().1 - before;
            let run = matches!(outcome, Outcome::Run(_));
            assert_eq!(answers + u64::from(run), u64::from(!says_nothing), "{line:?}");
        }
    }
    for inbox in [speaker, hearer] {
        let next = || inbox.0.borrow_mut().0.next_line();
        while let Some(line) = next() {
            assert!(!line.contains(['\n', '\r']), "{line}");
            let value: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"));
            assert!(value.is_object(), "{line}");
        }
    }
    control.leave(1, &mut world);
    control.leave(2, &mut world);
    assert_eq!((control.next_sample(), world.poll_event()), (None, None));
}

/// Time passes as in front of sockets.
fn pass(world: &mut World, control: &mut Control<Inbox>, millis: u8) {
    let end = world.now() + Duration::from_millis(millis.min(50).into());
    while world.now() < end {
        world.run_until(control.next_sample().map_or(end, |due| due.min(end)));
        control.publish(world);
    }
}
