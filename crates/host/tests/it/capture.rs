//! Fast capture of virtual drives: what is measured is what the drive has, and whatever ends it the drive is as it was.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::{Mux, NmtCommand, NmtState, NodeId};
use host::capture::{Measurand, Pace, Restorer, Running, SeenBy, Span, Taken, Wanted, Way};
use host::network::params::journal::roll_back_by;
use master::drive::MotionOptions;
use master::units::{Ramp, Rpm};
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::stimulus::Power;
use sim::{Place, StationId, Stimulus, World, block_on, block_on_for};
use words::failure::Failure;

pub(crate) const MS: Duration = Duration::from_millis(1);

pub(crate) fn node() -> NodeId {
    NodeId::new(4).expect("a node-ID")
}

pub(crate) struct Bench {
    pub(crate) world: World,
    station: StationId,
    pub(crate) network: Network,
    pub(crate) drive: Drive,
}

impl Bench {
    pub(crate) fn new(name: &str) -> Self {
        let mut world = World::new(Bitrate::K500, 7);
        let network = Network::new();
        let station = world.add_station(network.clone());
        let model = devices::model(name).expect("a model");
        world
            .add_drive(4, order(model, &Order::new(model, node(), Bitrate::K500)).expect("it is built"))
            .expect("added");
        world.run_until(Instant::from_secs(2));
        let drive = Drive::new(network.node(node()), model);
        Self { world, station, network, drive }
    }

    pub(crate) fn run<T>(&mut self, what: impl Future<Output = T>) -> T {
        block_on(&mut self.world, what).expect("the bus goes on")
    }

    /// The same, with the angle that the shaft had every millisecond: times in s, degrees.
    pub(crate) fn run_beside_truth<T>(&mut self, what: impl Future<Output = T>) -> (T, (Vec<f64>, Vec<f64>)) {
        let mut what = std::pin::pin!(what);
        let (mut times, mut angles) = (Vec::new(), Vec::new());
        loop {
            let done = block_on_for(&mut self.world, MS, what.as_mut());
            times.push(self.world.now().as_nanos() as f64 * 1e-9);
            angles.push(self.world.report(4).expect("the drive").shaft_angle_rad.to_degrees());
            if let Ok(done) = done {
                return (done, (times, angles));
            }
        }
    }

    /// Another program comes to the bus; the one before has died.
    fn begin_anew(&mut self) {
        self.world.remove(self.station);
        let model = self.drive.description().expect("a model");
        self.network = Network::new();
        self.station = self.world.add_station(self.network.clone());
        self.drive = Drive::new(self.network.node(node()), model);
    }

    /// Everything about the node's TPDOs, as it reads.
    pub(crate) fn tpdos(&mut self) -> BTreeMap<Mux, Vec<u8>> {
        let drive = self.drive.clone();
        self.run(async {
            let mut objects = BTreeMap::new();
            let indices = (0x1800..0x1804).flat_map(|index| (1..=5).map(move |sub_index| Mux::new(index, sub_index)));
            for object in indices.chain((0x1A00..0x1A04).flat_map(|index| (0..=8).map(move |sub| Mux::new(index, sub))))
            {
                if let Ok(payload) = drive.node().upload(object).await {
                    objects.insert(object, payload.as_bytes().to_vec());
                }
            }
            objects
        })
    }

    pub(crate) fn wanted(&mut self, quantities: &[&str], journal: Option<PathBuf>) -> Wanted {
        let (drive, world) = (self.drive.clone(), Some(self.world.live_values()));
        let quantities = self.run(async {
            let mut found = Vec::new();
            for name in quantities {
                found.push(Measurand::named(&drive, world.as_ref(), name).await.expect("the model has it"));
            }
            found
        });
        let (take, by_sdo, on_kept): (_, _, fn(&str)) = (Vec::new(), false, |_| ());
        Wanted { quantities, period: MS, bitrate: Bitrate::K500, take, by_sdo, journal, on_kept }
    }

    pub(crate) fn begin(&mut self, wanted: &Wanted) -> Result<(Running, Restorer), Failure> {
        let (drive, restorer) = (self.drive.clone(), Restorer::of(&self.drive));
        self.run(wanted.begin(&drive, &restorer)).map(|running| (running, restorer))
    }
}

pub(crate) fn at_once(ms: u64) -> Span {
    Span { duration: Duration::from_millis(ms), trigger: None, pre_trigger: Duration::ZERO }
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("ferrodrive-capture-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder.join("journal")
}

#[test]
fn a_motion_is_captured_at_the_rate_that_was_asked_for_with_demand_and_truth() {
    for (name, quantities) in [
        ("zlac8030l", &["velocity", "target_velocity", "current", "position"][..]),
        ("cia402", &["velocity", "velocity_demand", "current"]),
    ] {
        let mut bench = Bench::new(name);
        let before = bench.tpdos();
        let mut wanted = bench.wanted(quantities, None);
        // The statuswords that a cia402 sends by itself take the rest of a bus of 500 kbit/s.
        wanted.period = if name == "cia402" { 2 * MS } else { MS };
        let period_s = wanted.period.as_secs_f64();
        let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
        let drive = bench.drive.clone();
        let ramp = Some(Ramp::Time(Duration::from_millis(200)));
        let options = MotionOptions { acceleration: ramp, deceleration: ramp, wait: false, ..MotionOptions::default() };
        bench.run(drive.velocity(Rpm(60.0), options)).expect("it turns");
        let (taken, truth) = bench.run_beside_truth(running.next(&at_once(500)));
        let taken = taken.expect("it is captured");
        assert!(taken.cut_off.is_none(), "{name}: {:?}", taken.cut_off);
        let capture = taken.capture;
        for trace in &capture.traces {
            assert!((trace.period_s - period_s).abs() < 2e-5, "{name} {}: {}", trace.quantity, trace.period_s);
            assert!(trace.jitter_s < 3e-4 && trace.gaps == 0, "{name} {}: {}", trace.quantity, trace.jitter_s);
            assert_eq!(trace.values.iter().filter(|value| value.is_finite()).count(), capture.time_s.len(), "{name}");
        }
        let most = (0.5 / period_s) as usize;
        assert!((most - 5..=most + 5).contains(&capture.time_s.len()), "{name}: {} rows", capture.time_s.len());
        let speed = capture.trace("velocity_rpm").expect("a speed");
        assert_eq!(speed.unit, "r/min");
        // At rest at its speed, the mean of the readings is what the shaft has turned in that time.
        let at_speed = |times: &[f64], values: &[f64]| {
            let after = times.partition_point(|at| at - times[0] < 0.3);
            (times[after..].to_vec(), values[after..].to_vec())
        };
        let (_, readings) = at_speed(&capture.time_s, &speed.values);
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let (times, turned) = at_speed(&truth.0, &truth.1);
        let last = times.len() - 1;
        let rpm = ((turned[last] - turned[0]) / (times[last] - times[0]) / 6.0).abs();
        // One count of the speed of a zlac8030l is 0.1 r/min (quick start guide V1.00, 606Ch).
        assert!((mean - rpm).abs() < 0.05 && (rpm - 60.0).abs() < 0.1, "{name}: {mean}, {rpm}");
        if name == "zlac8030l" {
            assert_eq!(capture.trace("target_velocity").expect("a demand").values.last(), Some(&60.0));
        }
        assert!(capture.parameters.contains_key(&Mux::new(0x1800, 2)) && capture.model == name);
        bench.run(drive.quick_stop()).expect("it stops");
        drop(running);
        assert_eq!(bench.run(restorer.restore()), Vec::<String>::new(), "{name}");
        assert_eq!(bench.tpdos(), before, "{name}");
        // The node is no longer operational: nothing more comes.
        let log = bench.network.log_frames(&[0x184, 0x284, 0x384, 0x484], 100);
        bench.world.run_for(Duration::from_millis(100));
        let mut came = Vec::new();
        log.take(&mut came);
        assert!(came.is_empty(), "{name}: {came:?}");
    }
}

#[test]
fn what_is_true_of_a_virtual_drive_stands_in_the_rows_of_what_it_sends() {
    let mut bench = Bench::new("zlac8030l");
    let wanted = bench.wanted(&["velocity", "true_velocity", "true_shaft_angle_rad"], None);
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    assert_eq!(running.ways().iter().map(ToString::to_string).collect::<Vec<_>>(), ["TPDO1", "world", "world"]);
    let drive = bench.drive.clone();
    let options = MotionOptions { wait: false, ..MotionOptions::default() };
    bench.run(drive.velocity(Rpm(60.0), options)).expect("it turns");
    let trigger = Some("true_velocity > 30".parse().expect("a trigger"));
    let span = Span { duration: Duration::from_millis(700), trigger, pre_trigger: 20 * MS };
    let (taken, seen) = bench.run_beside_truth(running.next(&span));
    let Taken { capture, first_at, .. } = taken.expect("it is captured");
    let of = |name: &str| &capture.trace(name).expect("it was captured").values;
    let (said, speed, angle) = (of("velocity"), of("true_velocity"), of("true_shaft_angle"));
    let trigger_s = capture.trigger_s.expect("it was triggered");
    for (at, time_s) in capture.time_s.iter().enumerate() {
        assert!([said[at], speed[at], angle[at]].iter().all(|value| value.is_finite()), "{time_s}: one row");
        assert_eq!(speed[at] > 30.0, *time_s >= trigger_s - 1e-9, "{time_s}: {}", speed[at]);
    }
    assert_eq!((capture.traces[1].unit.as_str(), capture.traces[2].unit.as_str()), ("r/min", "rad"));
    // The speed is the slope of the angle, over each 100 ms.
    for from in (0..600).step_by(100) {
        let span_s = capture.time_s[from + 100] - capture.time_s[from];
        let slope = (angle[from + 100] - angle[from]) / span_s * 60.0 / std::f64::consts::TAU;
        let mean = (speed[from] + speed[from + 100]) / 2.0 + speed[from + 1..from + 100].iter().sum::<f64>();
        assert!((slope - mean / 100.0).abs() < 0.02, "{from}: {slope}, {mean}");
    }
    // The angle is that which the shaft has: degrees of every millisecond, looked at from outside.
    let first_s = (first_at - Instant::ZERO).as_secs_f64();
    for (time_s, angle) in capture.time_s.iter().map(|time| first_s + time).zip(angle) {
        let after = seen.0.partition_point(|seen_s| *seen_s < time_s);
        // 60 r/min are 0.36 degrees in the millisecond between two looks.
        let (from, to) = (seen.1[after - 1], seen.1[after]);
        let degrees = angle.to_degrees();
        assert!((from - 0.01..=to + 0.01).contains(&degrees) && to - from < 0.4, "{time_s}: {from}, {degrees}, {to}");
    }
    bench.run(drive.quick_stop()).expect("it stops");
    drop(running);
    assert_eq!(bench.run(restorer.restore()), Vec::<String>::new());
}

#[test]
fn true_values_alone_change_nothing_on_the_bus_and_are_those_of_the_node_that_was_asked_for() {
    let mut bench = Bench::new("zlac8030l");
    let (before, mut copy) = (bench.tpdos(), bench.world.snapshot());
    let wanted = bench.wanted(&["true_winding", "true_velocity_demand"], None);
    let (mut running, _restorer) = bench.begin(&wanted).expect("it begins");
    assert_eq!((running.plan(), bench.tpdos()), (None, before));
    let capture = bench.run(running.next(&at_once(100))).expect("it is captured").capture;
    let winding = capture.trace("true_winding_c").expect("a temperature");
    assert_eq!((winding.values.len(), winding.gaps), (101, 0));
    assert!((winding.period_s - 1e-3).abs() < 1e-9 && winding.jitter_s < 1e-9, "{}", winding.jitter_s);
    let ambient = copy.report(4).expect("a drive").physics.expect("a motor").ambient_c;
    assert!((winding.values[0] - ambient).abs() < 0.5, "it has not moved: {}, {ambient}", winding.values[0]);
    // On a real bus nothing knows them.
    let drive = bench.drive.clone();
    let refused = bench.run(Measurand::named(&drive, None, "true_velocity")).expect_err("a real bus");
    assert_eq!(refused.kind, "no_true_values");
    assert!(refused.because[0].contains("of a virtual drive alone"), "{refused:?}");
    let world = bench.world.live_values();
    let refused = bench.run(Measurand::named(&drive, Some(&world), "true_windign")).expect_err("a slip of the keys");
    assert!(refused.what.contains("did you mean") && refused.what.contains("winding"), "{refused:?}");
    // A node that is not a drive of this world.
    let stranger =
        Drive::new(bench.network.node(NodeId::new(9).expect("a node-ID")), drive.description().expect("known"));
    let named = bench.run(Measurand::named(&stranger, Some(&world), "true_velocity"));
    assert!(named.is_ok(), "whether it is one is seen when it is sampled");
}

#[test]
fn a_trigger_keeps_what_was_before_it_and_is_armed_again() {
    let mut bench = Bench::new("zlac8030l");
    let wanted = bench.wanted(&["velocity"], None);
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let drive = bench.drive.clone();
    let span = Span {
        duration: Duration::from_millis(100),
        trigger: Some("velocity > 20".parse().expect("a trigger")),
        pre_trigger: Duration::from_millis(50),
    };
    let options = MotionOptions { wait: false, ..MotionOptions::default() };
    for turn in 0..2 {
        bench.run(drive.velocity(Rpm(60.0), options)).expect("it turns");
        let taken = bench.run(running.next(&span)).expect("it is captured");
        let capture = taken.capture;
        let at = capture.trigger_s.expect("it was triggered");
        assert!((0.045..=0.051).contains(&at), "{turn}: {at}");
        let points: Vec<(f64, f64)> = capture.points(&capture.traces[0]).collect();
        assert!(points.iter().all(|(time, value)| (*value > 20.0) == (*time >= at - 1e-9)), "{turn}: {points:?}");
        let end = points.last().expect("a reading").0;
        assert!((at + 0.098..=at + 0.1001).contains(&end), "{turn}: {end}");
        bench.run(drive.stop()).expect("it stops");
    }
    let other = Span { trigger: Some("current > 1".parse().expect("a trigger")), ..span };
    let refused = bench.run(running.next(&other)).expect_err("it is not captured");
    assert!(refused.to_string().contains("name one of: velocity_rpm"), "{refused}");
    bench.run(restorer.restore());
}

/// What is said of the NMT state is what was seen: a heartbeat, TPDOs that stop, or nothing; and that it did not work.
#[test]
fn that_a_node_is_pre_operational_again_is_said_as_it_was_seen() {
    for (heartbeat_ms, expected) in [(0, SeenBy::Silence), (50, SeenBy::Heartbeat)] {
        let mut bench = Bench::new("zlac8030l");
        let drive = bench.drive.clone();
        let time = u16::to_le_bytes(heartbeat_ms);
        bench.run(drive.node().download(Mux::new(0x1017, 0), &time)).expect("it has a heartbeat");
        let wanted = bench.wanted(&["velocity"], None);
        let (_, restorer) = bench.begin(&wanted).expect("it begins");
        assert_eq!(restorer.left_operational(), None);
        assert_eq!(bench.run(restorer.restore()), Vec::<String>::new());
        assert_eq!(restorer.left_operational(), Some(expected));
    }
    // Another master starts it again and again: that is not said to be as before.
    let mut bench = Bench::new("zlac8030l");
    let wanted = bench.wanted(&["velocity"], None);
    let (_, restorer) = bench.begin(&wanted).expect("it begins");
    let other = Network::new();
    bench.world.add_station(other.clone());
    let starting = async {
        loop {
            other.node(node()).nmt(NmtCommand::Start);
            other.sleep(MS).await;
        }
    };
    let left = bench.run(async {
        let (restoring, starting) = (std::pin::pin!(restorer.restore()), std::pin::pin!(starting));
        match futures_util::future::select(restoring, starting).await {
            futures_util::future::Either::Left((left, _)) => left,
            futures_util::future::Either::Right(((), _)) => unreachable!("it starts the node for ever"),
        }
    });
    assert_eq!(left, ["NMT state: it still sends PDOs"]);
    assert_eq!(restorer.left_operational(), None);
}

/// The law: at whatever point it is ended, by whichever way back, the TPDOs read as they did before.
#[test]
fn whatever_point_a_capture_is_ended_at_the_tpdos_are_as_they_were() {
    for name in ["zlac8030l", "zlim42c", "cia402"] {
        let mut changed = 0;
        for end_ms in [0, 3, 9, 260, 300, 335, 350, 358, 366, 374, 382, 390, 400, 420, 460, 500, 600] {
            for killed in [false, true] {
                let mut bench = Bench::new(name);
                let before = bench.tpdos();
                let path = scratch(&format!("{name}-{end_ms}-{killed}"));
                let mut wanted = bench.wanted(&["velocity", "position"], Some(path.clone()));
                wanted.period = 2 * MS;
                let drive = bench.drive.clone();
                let restorer = Restorer::of(&drive);
                let capturing = async { wanted.begin(&drive, &restorer).await?.next(&at_once(10_000)).await };
                let end = block_on_for(&mut bench.world, Duration::from_millis(end_ms), capturing);
                assert!(end.is_err(), "{name} {end_ms} ms: it came to its end: {:?}", end.map(|end| end.err()));
                let at_the_end = path.exists();
                changed += usize::from(at_the_end);
                if killed {
                    // Another program leads it back, by the journal.
                    bench.begin_anew();
                    roll_back(&mut bench, &path, (name, end_ms));
                } else {
                    // Its owner does.
                    assert_eq!(bench.run(restorer.restore()), Vec::<String>::new(), "{name} {end_ms} ms");
                    // Of two of them it has sent SYNC itself.
                    assert_eq!(bench.network.with_core(|core| core.sync_period()), None, "{name} {end_ms} ms");
                }
                assert!(!path.exists(), "{name} {end_ms} ms");
                let now = bench.tpdos();
                assert_eq!(now, before, "{name} {end_ms} ms, killed: {killed}");
                let _ = std::fs::remove_dir_all(path.parent().expect("a folder"));
            }
        }
        assert!(changed >= 6, "{name}: ended {changed} times while something was changed");
    }
}

fn roll_back(bench: &mut Bench, path: &Path, what: (&str, u64)) {
    if path.exists() {
        let drive = bench.drive.clone();
        bench.run(roll_back_by(path, &drive)).unwrap_or_else(|failure| panic!("{what:?}: {failure}"));
    }
}

/// A node that a capture has started goes back to pre-operational, by the journal as by the capture's own end; one that was operational
/// stays so.
#[test]
fn a_capture_that_is_killed_leaves_a_journal_that_leads_the_nmt_state_back() {
    for (start, heartbeat_ms, back) in [(false, 50_u16, Some("heartbeat")), (true, 50, None)] {
        let mut bench = Bench::new("zlac8030l");
        bench.run(bench.drive.clone().node().write(Mux::new(0x1017, 0), heartbeat_ms)).expect("written");
        if start {
            bench.network.node(node()).nmt(NmtCommand::Start);
        }
        bench.world.run_for(Duration::from_millis(200));
        let path = scratch(&format!("state-{start}"));
        let wanted = bench.wanted(&["velocity"], Some(path.clone()));
        let (drive, restorer) = (bench.drive.clone(), Restorer::of(&bench.drive));
        let capturing = async { wanted.begin(&drive, &restorer).await?.next(&at_once(10_000)).await };
        block_on_for(&mut bench.world, Duration::from_secs(3), capturing).expect_err("it goes on");
        bench.begin_anew();
        bench.world.run_for(Duration::from_millis(200));
        let state = |bench: &Bench| bench.network.facts(node()).nmt_state;
        assert_eq!(state(&bench), Some(NmtState::Operational), "started: {start}");
        let drive = bench.drive.clone();
        let report = bench.run(roll_back_by(&path, &drive)).unwrap_or_else(|failure| panic!("{failure}"));
        assert_eq!(report.nmt_back, back, "started: {start}");
        bench.world.run_for(Duration::from_millis(200));
        let expected = if start { NmtState::Operational } else { NmtState::PreOperational };
        assert_eq!(state(&bench), Some(expected), "started: {start}");
        let _ = std::fs::remove_dir_all(path.parent().expect("a folder"));
    }
}

#[test]
fn a_drive_that_loses_its_supply_cuts_the_capture_off_and_what_came_is_kept() {
    let mut bench = Bench::new("zlac8030l");
    let path = scratch("supply");
    let wanted = bench.wanted(&["velocity"], Some(path.clone()));
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    bench.world.apply(Place::node(4), &Stimulus::Power(Power::Off)).expect("known").expect("it is done");
    let taken = bench.run(running.next(&at_once(5000))).expect("what came is there");
    let why = taken.cut_off.expect("it is cut off");
    assert_eq!(why.kind, "capture_cut_off");
    assert!(taken.capture.is_cut_off);
    drop(running);
    // The drive does not answer: what could not be put back is said, and the journal stays.
    assert!(!bench.run(restorer.restore()).is_empty());
    drop(restorer);
    assert!(path.exists());
    bench.world.apply(Place::node(4), &Stimulus::Power(Power::On)).expect("known").expect("it is done");
    bench.world.run_for(Duration::from_secs(2));
    roll_back(&mut bench, &path, ("supply", 0));
    let _ = std::fs::remove_dir_all(path.parent().expect("a folder"));
}

#[test]
fn what_cannot_be_mapped_is_refused_or_read_by_sdo_and_changes_nothing() {
    let mut bench = Bench::new("m4230e17b50");
    let before = bench.tpdos();
    let mut wanted = bench.wanted(&["velocity", "position"], None);
    let refused = bench.begin(&wanted).expect_err("its mapping is fixed");
    assert_eq!(refused.kind, "no_mapping");
    assert_eq!(bench.tpdos(), before);
    wanted.by_sdo = true;
    let (mut running, restorer) = bench.begin(&wanted).expect("by SDO");
    assert_eq!(running.ways(), [Way::Sdo, Way::Sdo]);
    let taken = bench.run(running.next(&at_once(200))).expect("it is captured");
    for trace in &taken.capture.traces {
        // Asked for every millisecond; an SDO to this drive takes a millisecond or two.
        assert!((1e-3..10e-3).contains(&trace.period_s), "{}: {}", trace.quantity, trace.period_s);
    }
    assert_eq!(bench.run(restorer.restore()), Vec::<String>::new());
    assert_eq!(bench.tpdos(), before);
}

#[test]
fn a_sync_that_others_send_is_followed() {
    let mut bench = Bench::new("zlac8030l");
    let other = Network::new();
    bench.world.add_station(other.clone());
    other.sync(Some(2 * MS));
    bench.world.run_for(Duration::from_millis(20));
    let mut wanted = bench.wanted(&["velocity"], None);
    wanted.period = 4 * MS;
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    assert_eq!(running.plan().map(|plan| plan.pace), Some(Pace::Sync(2)));
    let taken = bench.run(running.next(&at_once(200))).expect("it is captured");
    assert!((taken.capture.traces[0].period_s - 4e-3).abs() < 1e-4);
    bench.run(restorer.restore());
}
