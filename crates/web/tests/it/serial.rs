//! A host on the bus behind an slcan adapter, in virtual time: the adapter is the one of crate `slcan`, and stands in a virtual world.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use can::{Bitrate, Frame, Instant, Station};
use serde_json::{Value, json};
use slcan::Adapter;
use web::{LetGo, Line, SerialHost};

const DRIVES: &str =
    "bitrate = \"500k\"\n[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n\n[[drive]]\nmodel = \"zlim42c\"\nnode = 2\n";

/// The adapter in the world: frames of the host for the bus, and bytes for the host.
struct Plugged {
    adapter: Adapter,
    frames: VecDeque<Frame>,
    bytes: Vec<u8>,
    /// Answers BEL to each frame, as an adapter in bus-off.
    is_off: bool,
}

#[derive(Clone)]
struct OnBus(Arc<Mutex<Plugged>>);

impl OnBus {
    fn lock(&self) -> MutexGuard<'_, Plugged> {
        self.0.lock().expect("one thread")
    }
}

impl Station for OnBus {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let Plugged { adapter, bytes, .. } = &mut *self.lock();
        adapter.deliver(now, frame, bytes);
    }

    fn handle_timeout(&mut self, _: Instant) {}

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.lock().frames.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// A world with an adapter on its bus, a host behind it, and a page.
struct Cable {
    world: sim::World,
    on_bus: OnBus,
    is_plugged: bool,
    host: SerialHost,
    seq: u64,
    /// The newest state.
    state: Value,
    answers: Vec<Value>,
    /// All that the host has sent to the adapter since this was emptied.
    said: String,
}

impl Cable {
    /// Drives that have booted, and an adapter whose channel has not been opened.
    fn at(bitrate: Bitrate) -> Self {
        Self::with(DRIVES, bitrate)
    }

    fn with(machine: &str, bitrate: Bitrate) -> Self {
        let machine = machine::file::Machine::parse_in(machine, std::path::Path::new("")).expect("a machine");
        let mut world = machine.build().expect("a world");
        let plugged = Plugged {
            adapter: Adapter::new(Some(Bitrate::K500)),
            frames: VecDeque::new(),
            bytes: Vec::new(),
            is_off: false,
        };
        let on_bus = OnBus(Arc::new(Mutex::new(plugged)));
        world.add_station(on_bus.clone());
        world.run_for(Duration::from_secs(1));
        let host = SerialHost::new("CANable", bitrate, Duration::ZERO, world.now()).expect("a bit rate of slcan");
        let mut cable = Self {
            world,
            on_bus,
            is_plugged: true,
            host,
            seq: 0,
            state: Value::Null,
            answers: Vec::new(),
            said: String::new(),
        };
        cable.host.plug();
        cable.host.join();
        cable
    }

    /// The same with its drives found, and control taken.
    fn in_control() -> Self {
        Self::at(Bitrate::K500).take_control(2)
    }

    /// So many drives are found, and control is taken.
    fn take_control(self, drives: usize) -> Self {
        let mut cable = self;
        cable.until("all drives", |state| {
            state["nodes"]
                .as_array()
                .is_some_and(|nodes| nodes.len() == drives && nodes.iter().all(|node| !node["drive"].is_null()))
        });
        cable.must(json!({ "do": "take_control" }));
        cable
    }

    /// Time passes, with the page there. The line brings its bytes in pieces of seven.
    fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.world.run_for(Duration::from_millis(1));
            self.exchange();
        }
    }

    /// Time passes while the page is not run.
    fn sleep(&mut self, ms: u64) {
        self.world.run_for(Duration::from_millis(ms));
    }

    fn exchange(&mut self) {
        let now = self.world.now();
        let bytes = std::mem::take(&mut self.on_bus.lock().bytes);
        if self.is_plugged {
            bytes.chunks(7).for_each(|piece| self.host.run(piece, now));
        }
        self.host.run(&[], now);
        let output = self.host.take_output();
        self.said.push_str(std::str::from_utf8(&output).expect("lines are text"));
        self.take(&output);
        for line in self.host.take_sent() {
            let message: Value = serde_json::from_str(&line).expect("JSON");
            match message["type"].as_str() {
                Some("welcome") => {
                    self.seq = 0;
                    self.answers.clear();
                    self.state = Value::Null;
                }
                Some("state") => self.state = message,
                Some("answer") => self.answers.push(message),
                _ => {}
            }
        }
    }

    fn take(&mut self, mut output: &[u8]) {
        if !self.is_plugged {
            return;
        }
        let mut plugged = self.on_bus.lock();
        let Plugged { adapter, frames, bytes, is_off } = &mut *plugged;
        while let Some(frame) = adapter.receive(&mut output) {
            match is_off {
                // In place of what it says of a frame that is queued.
                true => {
                    while adapter.next_reply(&mut Vec::new()) {}
                    bytes.push(7);
                }
                false => frames.push_back(frame),
            }
        }
        while adapter.next_reply(bytes) {}
        // The world looks at its stations.
        drop(plugged);
        self.world.refresh();
    }

    fn until(&mut self, what: &str, is_so: impl Fn(&Value) -> bool) {
        for _ in 0..10_000 {
            if is_so(&self.state) {
                return;
            }
            self.run(1);
        }
        panic!("{what}: not within 10 s: {}", self.state);
    }

    fn say(&mut self, mut command: Value) {
        self.seq += 1;
        (command["seq"], command["session"]) = (self.seq.into(), "page".into());
        self.host.say(&command.to_string());
    }

    fn ask(&mut self, command: Value) -> Value {
        self.say(command);
        let seq = self.seq;
        for at in 0..10_000 {
            self.run(1);
            if let Some(answer) = self.answers.iter().find(|answer| answer["seq"] == seq) {
                return answer.clone();
            }
            if at % 500 == 499 {
                self.say(json!({ "do": "alive" }));
            }
        }
        panic!("no answer within 10 s");
    }

    fn must(&mut self, command: Value) {
        let answer = self.ask(command);
        assert_eq!(answer["ok"], true, "{answer}");
    }

    /// What a drive truly does.
    fn get(&mut self, node: u8) -> Value {
        let command = format!("{node} get").parse().expect("a command");
        let got = sim::command::perform(&mut self.world, &command, sim::command::Service::default()).expect("a drive");
        serde_json::from_str(&got).expect("JSON")
    }

    /// The true speed of a shaft, in r/min.
    fn speed(&mut self, node: u8) -> f64 {
        self.get(node)["velocity_rpm"].as_f64().expect("a speed")
    }

    /// The first frame that the host has sent is a quick stop of the wheel: CiA 301, 7.2.4.3.3: a download of two bytes to 6040h; CiA 402-2,
    /// table 28: quick stop has of bits 7, 2 and 1 only the last.
    fn has_said_stop_first(&self) -> bool {
        let first = self.said.split('\r').find(|line| line.starts_with('t')).expect("a frame");
        let (download, low) = first.split_at_checked(13).expect("eight bytes");
        download == "t60482B406000" && u8::from_str_radix(&low[..2], 16).expect("a byte") & 0x86 == 0x02
    }

    /// The wheel turns.
    fn turning() -> Self {
        let mut cable = Self::in_control();
        cable.must(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
        assert!((cable.speed(4) - 60.0).abs() < 3.0, "{} r/min", cable.speed(4));
        assert_eq!(cable.host.moved(), [4]);
        cable.said.clear();
        cable
    }

    fn node(&self, node: u8) -> &Value {
        let nodes = self.state["nodes"].as_array().map(Vec::as_slice).unwrap_or_default();
        nodes.iter().find(|one| one["node"] == node).expect("the node")
    }

    fn let_go(&mut self) -> (String, Vec<String>) {
        let let_go = self.host.take_let_go().expect("the session has ended");
        (let_go.why, let_go.moving)
    }

    /// The wheel comes to rest, which the host has seen, and a page has to take control anew.
    fn rests_and_control_is_free(&mut self) {
        self.run(1000);
        assert!(self.speed(4).abs() < 1.0, "{} r/min", self.speed(4));
        assert_eq!(self.host.moved(), [0; 0]);
        self.host.join();
        self.until("a state", |state| state.is_object() && state["controller"].is_null());
        let refused = self.ask(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
        assert_eq!(refused["error"]["kind"], "not_in_control");
    }
}

#[test]
fn drives_behind_an_adapter_are_found_moved_and_stopped() {
    let mut cable = Cable::turning();
    cable.must(json!({ "do": "stop_all" }));
    cable.run(1000);
    assert!(cable.speed(4).abs() < 1.0);
    // The channel is closed as the last thing, so that the adapter acknowledges nothing any more.
    cable.said.clear();
    cable.host.close();
    cable.exchange();
    assert!(cable.said.ends_with("C\r") && !cable.on_bus.lock().adapter.is_open(), "{}", cable.said);
}

/// What cannot be stopped without the page is known before it moves.
#[test]
fn a_drive_without_a_watch_moves_only_after_that_is_accepted_and_the_others_watch_this_page() {
    let mut cable = Cable::in_control();
    let refused = cable.ask(json!({ "do": "velocity", "node": 2, "rpm": 60 }));
    assert_eq!(refused["error"]["kind"], "unguarded", "{refused}");
    assert!(cable.speed(2).abs() < 1.0);
    cable.until("what both do", |state| {
        state["nodes"].as_array().is_some_and(|nodes| nodes.iter().all(|node| !node["goes_on"].is_null()))
    });
    assert_eq!((&cable.node(2)["goes_on"], &cable.node(4)["goes_on"]), (&json!(true), &json!(false)));
    cable.must(json!({ "do": "accept_unguarded", "node": 2 }));
    cable.must(json!({ "do": "velocity", "node": 2, "rpm": 60 }));
}

#[test]
fn a_hidden_page_stops_what_it_moved_and_loses_control() {
    let mut cable = Cable::turning();
    cable.host.let_go("The page was hidden");
    cable.exchange();
    let expected = LetGo { why: "The page was hidden".into(), moved: vec![4], moving: vec![] };
    assert_eq!(cable.host.take_let_go(), Some(expected));
    cable.rests_and_control_is_free();
}

#[test]
fn a_page_that_falls_silent_is_stopped_by_the_host_in_its_worker() {
    let mut cable = Cable::turning();
    // The presence span, and the ramp.
    cable.run(3000 + 1000);
    assert!(cable.speed(4).abs() < 1.0);
    assert_eq!(cable.host.moved(), [0; 0], "it was seen to stand");
}

/// Before the drive's own watch, of 1 s, and behind it.
#[test]
fn a_machine_that_wakes_stops_what_moved_before_anything_else() {
    for slept in [1100, 20_000] {
        let mut cable = Cable::turning();
        cable.sleep(slept);
        // What the page said before it slept comes late, and moves nothing.
        cable.exchange();
        assert!(cable.has_said_stop_first(), "slept {slept} ms: {}", cable.said);
        let (why, _) = cable.let_go();
        assert!(why.contains("slept") && why.contains(&format!("{:.1} s", slept as f64 / 1000.0)), "{why}");
        cable.say(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
        cable.rests_and_control_is_free();
    }
}

#[test]
fn an_adapter_that_is_unplugged_leaves_its_drives_to_their_watch_and_they_are_stopped_again_when_it_is_back() {
    let mut cable = Cable::turning();
    cable.is_plugged = false;
    cable.host.unplug("the cable was pulled");
    let (why, moving) = cable.let_go();
    assert!(why.contains("the cable was pulled"), "{why}");
    assert!(
        moving.len() == 1
            && moving[0].starts_with("node 4 may still be moving")
            && moving[0].contains("without this page"),
        "{moving:?}"
    );
    assert_eq!(cable.host.line(), Line::Closed(Some("the cable was pulled".into())));
    cable.host.join();
    // 2000h of the ZLAC8030L: 1000 ms, and its ramp.
    cable.run(3000);
    assert!(cable.speed(4).abs() < 1.0, "{} r/min", cable.speed(4));
    assert_eq!((cable.host.moved(), &cable.node(4)["stop_unseen"]), (vec![4], &json!(true)));
    assert_eq!(cable.state["bus"]["health"]["state"], "connection lost");
    cable.is_plugged = true;
    cable.host.plug();
    cable.until("it is seen to stand", |state| {
        state["nodes"].as_array().is_some_and(|nodes| nodes.iter().all(|node| node["stop_unseen"] == false))
    });
    cable.run(2000);
    assert_eq!((cable.host.moved(), cable.host.line()), (vec![], Line::Open));
    assert_eq!(cable.state["controller"], Value::Null);
}

#[test]
fn an_adapter_that_refuses_frames_or_sends_garbage_ends_what_moves() {
    let mut cable = Cable::turning();
    cable.on_bus.lock().is_off = true;
    // Until a frame of the host was refused: long before the watch of the drive, of 1 s.
    let refused = (0..500).find_map(|_| {
        cable.said.clear();
        cable.run(1);
        cable.host.take_let_go()
    });
    let why = refused.expect("the session has ended").why;
    assert!(why.contains("BEL") && why.contains("terminated"), "{why}");
    assert!(cable.has_said_stop_first(), "{}", cable.said);
    cable.on_bus.lock().is_off = false;
    cable.run(2000);
    cable.rests_and_control_is_free();

    let mut cable = Cable::turning();
    for _ in 0..10 {
        assert!(cable.host.take_let_go().is_none());
        cable.on_bus.lock().bytes = b"@@\r".to_vec();
        cable.exchange();
    }
    let (why, _) = cable.let_go();
    assert!(why.contains("not slcan") && why.contains("'@@'"), "{why}");
    assert!(cable.has_said_stop_first(), "{}", cable.said);
    cable.rests_and_control_is_free();
}

/// A session that takes control while it goes on has it until the next line, as long as something may move.
#[test]
fn an_adapter_that_goes_on_sending_garbage_lets_nobody_have_control() {
    let mut cable = Cable::turning();
    let garbage = |cable: &mut Cable| {
        cable.world.run_for(Duration::from_millis(1));
        cable.on_bus.lock().bytes = b"@@\r".to_vec();
        cable.exchange();
    };
    (0..10).for_each(|_| garbage(&mut cable));
    assert!(cable.let_go().0.contains("not slcan"));
    cable.host.join();
    garbage(&mut cable);
    assert_eq!(cable.host.moved(), [4], "it was not seen to stand");
    cable.say(json!({ "do": "take_control" }));
    (0..3).for_each(|_| garbage(&mut cable));
    assert!(cable.let_go().0.contains("not slcan"));
}

#[test]
fn a_wrong_bit_rate_is_said_and_nothing_is_hosted() {
    let mut cable = Cable::at(Bitrate::K250);
    cable.run(10);
    assert_eq!(cable.host.line(), Line::Closed(Some("the adapter refused 'O': is the bit rate right?".into())));
    assert!(cable.host.take_let_go().is_none() && cable.state.is_null());
    let request = web::Request { path: "/api/state".into() };
    assert_eq!(cable.host.request(&request, &[]).expect_err("no host").kind, "no_bus");
    // Asked for once, when the page is opened.
    for path in ["/api/power-states", "/api/power-states?of=all"] {
        let request = web::Request { path: path.into() };
        assert_eq!(cable.host.request(&request, &[]).expect("it is the same for all").status, 200);
    }
    let odd = SerialHost::new("CANable", Bitrate::new(40_000).expect("a rate"), Duration::ZERO, Instant::ZERO);
    assert!(odd.expect_err("slcan has it not").message.contains("800k"));
}

/// What an earlier page was stopped for ends no session that is not in control: it sees what its drives do.
#[test]
fn a_page_that_only_looks_stays_while_the_adapter_refuses_frames() {
    let mut cable = Cable::turning();
    cable.on_bus.lock().is_off = true;
    cable.run(50);
    assert!(cable.let_go().0.contains("BEL"));
    cable.host.join();
    // The host looks at its drives, and repeats its stop.
    for _ in 0..40 {
        cable.run(50);
        assert_eq!(cable.host.take_let_go(), None);
        assert_eq!(cable.host.moved(), [4], "it was not seen to stand");
    }
    assert!(cable.state.is_object() && cable.state["controller"].is_null(), "{}", cable.state);
}

#[test]
fn an_adapter_that_falls_silent_is_lost_with_all_that_moved() {
    let mut cable = Cable::turning();
    cable.is_plugged = false;
    // Asked each second, and twice for a second each.
    cable.run(3000 + 10);
    let (why, moving) = cable.let_go();
    assert!(why.contains("says nothing any more"), "{why}");
    assert!(moving.len() == 1 && moving[0].starts_with("node 4 may still be moving"), "{moving:?}");
    assert!(matches!(cable.host.line(), Line::Closed(Some(_))));
}

/// The joint watches for the heartbeat of its host from the first one on: without its guard given back, it would raise an alarm 2 s after
/// that has gone.
#[test]
fn a_page_that_takes_leave_gives_the_watches_back_once_its_drives_stand() {
    let mut cable = Cable::with("[[drive]]\nmodel = \"m4230e17b50\"\nnode = 1\n", Bitrate::K500).take_control(1);
    cable.must(json!({ "do": "velocity", "node": 1, "rpm": 10 }));
    cable.run(1000);
    assert!((cable.speed(1) - 10.0).abs() < 1.0, "{} r/min", cable.speed(1));
    cable.host.take_leave();
    assert_eq!(cable.host.left(), None);
    cable.exchange();
    cable.state = Value::Null;
    while cable.host.left().is_none() {
        cable.run(1);
        // A page that connects again gets no session.
        cable.host.join();
        cable.say(json!({ "do": "take_control" }));
        assert!(cable.state.is_null(), "{}", cable.state);
    }
    assert_eq!((cable.host.left(), cable.host.moved()), (Some(&[][..]), vec![]));
    assert!(cable.speed(1).abs() < 1.0, "{} r/min", cable.speed(1));
    cable.host.close();
    cable.said.clear();
    cable.exchange();
    assert!(cable.said.ends_with("C\r"), "{}", cable.said);
    cable.sleep(5000);
    assert_eq!(cable.get(1)["error_code"], 0);
}

#[test]
fn a_page_that_takes_leave_of_an_adapter_that_is_gone_says_what_may_be_moving() {
    let mut cable = Cable::turning();
    cable.host.take_leave();
    cable.is_plugged = false;
    cable.host.unplug("the cable was pulled");
    let moving = cable.host.left().expect("no more can be done");
    assert!(moving.len() == 1 && moving[0].starts_with("node 4 may still be moving"), "{moving:?}");
    // One that answers nothing, though its line is there.
    let mut cable = Cable::turning();
    cable.host.take_leave();
    cable.is_plugged = false;
    cable.run(3000);
    let moving = cable.host.left().expect("each wait has its end");
    assert!(moving.len() == 1 && moving[0].starts_with("node 4 may still be moving"), "{moving:?}");
}
