//! How long a motor turns, and what a drive has after a motion.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use can::{Frame, Instant, Station};
use processes::scratch;

use super::virtual_bus::VirtualBus;

/// At 60 r/min a second longer is a turn more, whatever the looks at the drive take on the bus: each takes a millisecond and more.
#[test]
fn a_motor_turns_for_as_long_as_it_was_asked_to() {
    for model in ["zlac8030l", "m4230e17b50", "zlim42c", "cia402"] {
        let turned_deg = |time: &str| {
            let bench = VirtualBus::of(&[&format!("{model}@4")]).with(&["--model", &format!("4={model}")]);
            let ended = bench.json(&["velocity", "4", "60rpm", "--for", time]);
            ended["before_stop"]["angle_deg"].as_f64().unwrap_or_else(|| panic!("{ended}"))
        };
        let second = (turned_deg("3s") - turned_deg("1s")) / 2.0;
        // A look later than asked at most, at both ends.
        assert!((second - 360.0).abs() < 8.0, "{model}: {second} degrees in a second");
    }
}

/// Ramps that are set for the cycles of a group or a base are as before afterwards: a later move by the drive's own ramps would lose steps.
#[test]
fn a_group_and_a_base_leave_the_ramps_of_their_drives_as_they_were() {
    let folder = scratch("ramps");
    let base = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n[[drive]]\nmodel = 'zlac8030l'\nnode = 5\n[base]\nwheels = [4, 5]\nturns = [1, -1]\n\
                wheel_base_m = 0.5\nwheel_radius_m = 0.084\nlinear_m_s = 0.5\nangular_rad_s = 1\nwheel_m_s = 0.8\nwheel_m_s2 = 0.7\n";
    let machine = folder.write("base.toml", base);
    let ramps = |bench: &VirtualBus, node: &str| {
        ["6083", "6084"].map(|object| bench.json(&["read", node, object])["value"].as_i64().unwrap())
    };
    for (model, words) in [
        ("zlim42c", &["group", "move", "4=90deg"][..]),
        ("zlim42c", &["test-motion", "4", "sine", "--by", "20deg"]),
        ("zlac8030l", &["group", "move", "4=90deg"]),
    ] {
        let bench = VirtualBus::of(&[&format!("{model}@4")]).with(&["--model", &format!("4={model}")]);
        let before = ramps(&bench, "4");
        bench.done(words);
        assert_eq!(ramps(&bench, "4"), before, "{model}: {words:?}");
    }
    let bench = VirtualBus::of(&["zlac8030l@4", "zlac8030l@5"]);
    let before = ["4", "5"].map(|node| ramps(&bench, node));
    bench.done(&["--machine", &machine, "drive-base", "--linear", "0.2", "--for", "1s"]);
    assert_eq!(["4", "5"].map(|node| ramps(&bench, node)), before);
}

/// 10 turns at 60 r/min take 10 s: a move that is given 4 s is refused, and no load is blamed for it.
#[test]
fn a_move_that_cannot_be_there_in_time_is_refused_before_it_begins() {
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    let ended = bench.run(&["move", "4", "10turn", "--profile-velocity", "60rpm", "--within", "4s"]);
    assert!(
        ended.status == Some(1) && ended.err.contains("of 60 r/min the way takes 10.0 s, and 4 s were given"),
        "{}",
        ended.err
    );
    assert_eq!(bench.report(4).position, 0);
    bench.done(&["move", "4", "1turn", "--profile-velocity", "60rpm", "--within", "4s"]);
}

/// A limit switch that is met keeps the drive from taking a set-point: the input is named ("ZLIM42-C CANopen manual V1.03", 3).
#[test]
fn a_move_into_a_limit_that_is_active_names_the_input() {
    let text = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\noptions = { '2030:02' = 3 }\nswitches = { X0 = ['min', 0] }\n";
    let bench = VirtualBus::of_machine(&machine::file::Machine::parse(text).unwrap()).with(&["--model", "2=zlim42c"]);
    let ended = bench.run(&["move", "2", "-1turn"]);
    assert!(ended.status == Some(1) && ended.err.contains("X0 (negative limit)"), "{}", ended.err);
}

/// A frame of another master, at its time.
#[derive(Clone)]
struct OtherMaster {
    at: Instant,
    frame: Arc<Mutex<Option<Frame>>>,
    now: Instant,
}

impl Station for OtherMaster {
    fn handle_frame(&mut self, _: &Frame, now: Instant) {
        self.now = now;
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.now = now;
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.now >= self.at { self.frame.lock().unwrap().take() } else { None }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.frame.lock().unwrap().is_some().then_some(self.at)
    }
}

/// An axis that is stopped by another master ends the motion of all; who it was is said, and of which axes the power was taken. With `--hold`
/// the others hold until then.
#[test]
fn a_group_that_is_stopped_names_who_did_it_and_holds_with_the_others_where_that_was_asked_for() {
    for is_held in [false, true] {
        let bench = VirtualBus::of(&["cia402@4", "cia402@5"]).with(&["--model", "4=cia402", "--model", "5=cia402"]);
        let at = bench.world().now() + Duration::from_secs(2);
        // A quick stop for node 5 (CiA 402-2, 8.4.1), which ends without power (605Ah = 2).
        let frame = Arc::new(Mutex::new(Some("605#2B40600002000000".parse().unwrap())));
        bench.world().add_station(OtherMaster { at, frame, now: Instant::ZERO });
        let group = ["group", "move", "--relative", "4=2turn", "5=2turn"];
        let hold: &[&str] = if is_held { &["--hold", "3s"] } else { &[] };
        let ended = bench.run(&[&group, hold].concat());
        let took = bench.world().now() - at;
        assert_eq!(ended.status, Some(1), "{}", ended.err);
        for part in [
            "another master wrote 2h to 6040h:00",
            "node 5 had lost its power, and the power of node 4 was taken at the end",
        ] {
            assert!(ended.err.contains(part), "{is_held}: {part:?} in {}", ended.err);
        }
        assert!(!ended.err.contains("--tolerance"), "{}", ended.err);
        assert_eq!(ended.err.contains("The other axes hold for 3 s"), is_held, "{}", ended.err);
        assert_eq!(took >= Duration::from_secs(3), is_held, "{took:?}");
        assert!([4, 5].iter().all(|node| bench.report(*node).statusword.is_none_or(|word| word & 0x6F != 0x27)));
    }
}
