//! One call of the master for all three models, in degrees and r/min of the motor's shaft. What each model's counts, ramps
//! and controlwords are is the master's business; whether the shafts did what was asked is measured here.

use std::f64::consts::TAU;
use std::time::Duration;

use canopen::NodeId;
use devices::Description;
use master::drive::{Command, Drive, Manner, Motion, MotionReport, Report};
use master::units::{Along, Angle, Degrees, Ramp, Rpm};
use master::{Elapsed, Error, Network, Node, join_all};

use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// Every drive boots well within a second.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// After booting a drive looks at its supply, sensors and inputs for some tens of milliseconds before it judges them.
const SETTLING_TIME: Duration = Duration::from_millis(200);

/// Longest time that a call may take.
const LIMIT: Duration = Duration::from_secs(60);

/// Speed and ramp of the moves.
const SPEED: Rpm = Rpm(60.0);
const RAMP_RPM_S: f64 = 600.0;

/// After so long without a voltage no current is left in a winding: many of its time constants L/R, which are some ms.
const WINDING_DECAY: Duration = Duration::from_millis(40);

/// How near to a target a shaft comes to rest: the coarsest of the three is in place within 30 of 4096 counts.
const IN_PLACE_DEG: f64 = 30.0 / 4096.0 * 360.0;

fn to_angle(degrees: f64) -> Along<Angle> {
    Along::Turning(Angle::from(Degrees(degrees)))
}

fn manner() -> Manner {
    let ramp = Some(Ramp::RpmPerSecond(RAMP_RPM_S).into());
    Manner { acceleration: ramp, deceleration: ramp, ..Manner::default() }
}

/// The master's drives.
struct Fleet {
    drives: Vec<Drive>,
}

/// The same calls on all three.
pub(crate) fn same_calls(bench: &mut Bench) {
    bench.section("", "boot");
    let network = Network::new();
    bench.world().add_station(network.clone());
    let known: Vec<_> = bench.drives().iter().map(|(model, node)| (network.node(node_id(*node)), *model)).collect();
    let booted = sim::block_on_for(bench.world(), LIMIT, boot(&network, &known));
    bench.step("three drives boot");
    let ok = matches!(booted, Ok(Ok(())));
    bench.compare("three boot-up messages", if ok { "three" } else { "fewer" }, ok);
    let fleet = Fleet { drives: known.iter().map(|(node, model)| Drive::new(node.clone(), model)).collect() };

    bench.section("", "velocity");
    fleet.turn(bench, 0.0, 120.0);
    fleet.turn(bench, 120.0, 60.0);
    bench.section("", "stop");
    fleet.stop(bench);
    bench.section("", "relative");
    for angle in [360.0, -90.0] {
        fleet.go_by(bench, angle);
    }
    bench.section("", "absolute");
    for angle in [1080.0, 1260.0] {
        fleet.go_to(bench, angle);
    }
    bench.section("", "disable");
    fleet.disable(bench);
}

/// Waits until every drive has booted and looked about.
async fn boot(network: &Network, drives: &[(Node, &'static Description)]) -> Result<(), Elapsed> {
    for (node, _) in drives {
        node.wait(|node| node.facts.boot_up, BOOT_PATIENCE).await?;
    }
    network.sleep(SETTLING_TIME).await;
    Ok(())
}

fn node_id(number: u8) -> NodeId {
    NodeId::new(number).unwrap_or(NodeId::MIN)
}

impl Fleet {
    /// Asks all of them at once; their answers in words, and the times of those that reached a target.
    fn ask(&self, bench: &mut Bench, command: Command) -> Vec<(String, f64)> {
        let calls = join_all(self.drives.iter().map(|drive| drive.perform(&command)));
        let Ok(answers) = sim::block_on_for(bench.world(), LIMIT, calls) else { return Vec::new() };
        let words = |answer: Result<Report, Error>| match answer {
            Ok(Report::Moved(MotionReport { reached_after: Some(after), .. })) => {
                (format!("reached after {:.2} s", after.as_secs_f64()), after.as_secs_f64())
            }
            Ok(_) => ("done".into(), f64::NAN),
            Err(error) => (error.to_string(), f64::NAN),
        };
        answers.into_iter().map(words).collect()
    }

    /// A row for each drive, with what it answered.
    fn rows(&self, bench: &mut Bench, what: &str, command: impl Into<Command>, check: impl Fn(&mut Bench, usize, f64)) {
        bench.mark(what.to_owned(), EventKind::Note);
        let answers = self.ask(bench, command.into());
        for place in 0..self.drives.len() {
            let (node, title) = (bench.drives()[place].1, bench.drives()[place].0.title);
            bench.step(format!("{title}: {what}"));
            let (words, after_s) = answers.get(place).cloned().unwrap_or_else(|| ("nothing in time".into(), f64::NAN));
            let ok = words.starts_with("reached") || words == "done";
            bench.asked(format!("node {node}"));
            bench.answered_with(&words);
            if !ok {
                bench.compare("done", words, false);
            }
            check(bench, place, after_s);
        }
    }

    /// Leaves all of them turning for a time.
    fn keep_turning(&self, bench: &mut Bench, time: Duration) {
        let calls = join_all(self.drives.iter().map(|drive| drive.supervise(time)));
        // One that does not turn shows in the way that is measured.
        let _ = sim::block_on_for(bench.world(), LIMIT, calls);
    }

    fn turn(&self, bench: &mut Bench, before_rpm: f64, rpm: f64) {
        let turn = Motion::Velocity(Rpm(rpm).into(), manner());
        self.rows(bench, &format!("turn at {rpm:.0} r/min"), turn, |bench, place, after_s| {
            let seen = report(bench, place).velocity_rpm;
            bench.moved(format!("{seen:+.1} r/min"));
            // The master takes 5 % off as reached, and looks each 10 ms.
            let expected_s = (rpm - before_rpm).abs() / RAMP_RPM_S;
            bench.expect("after", Expect::Near(expected_s, 0.05), "s", after_s);
        });
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        let (time, begin) = (Duration::from_secs(1), bench.now());
        // The drives are left alone together, so that the way of each is that of one stretch of time.
        self.keep_turning(bench, time);
        let time_s = (bench.now() - begin).as_secs_f64();
        for (place, from) in from.iter().enumerate() {
            let title = bench.drives()[place].0.title;
            bench.step(format!("{title}: for {time_s:.2} s"));
            let way = angle_deg(bench, place) - from;
            let expected = rpm * 6.0 * time_s;
            bench.moved(format!("{way:+.1}°"));
            bench.expect("way", Expect::Near(expected.round(), (0.02 * expected.abs()).round()), "°", way);
        }
    }

    fn stop(&self, bench: &mut Bench) {
        self.rows(bench, "stop", Command::Stop, |bench, place, _| {
            let seen = report(bench, place).velocity_rpm;
            bench.moved(format!("{seen:+.1} r/min"));
            bench.expect("speed", Expect::Near(0.0, 2.0), "r/min", seen);
        });
    }

    fn go_by(&self, bench: &mut Bench, angle: f64) {
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        let by = Motion::Move { to: to_angle(angle), relative: true, speed: Some(SPEED.into()), manner: manner() };
        self.rows(bench, &format!("move by {angle:.0}°"), by, |bench, place, after_s| {
            let seen = angle_deg(bench, place) - from[place];
            bench.moved(format!("{seen:+.1}°"));
            bench.expect("way", Expect::Near(angle, IN_PLACE_DEG), "°", seen);
            expect_time(bench, angle, after_s);
        });
    }

    fn go_to(&self, bench: &mut Bench, angle: f64) {
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        let to = Motion::Move { to: to_angle(angle), relative: false, speed: Some(SPEED.into()), manner: manner() };
        self.rows(bench, &format!("move to {angle:.0}°"), to, |bench, place, after_s| {
            let seen = angle_deg(bench, place);
            bench.moved(format!("{:+.1}°", seen - from[place]));
            bench.expect("at", Expect::Near(angle, IN_PLACE_DEG), "°", seen);
            expect_time(bench, angle - from[place], after_s);
        });
    }

    fn disable(&self, bench: &mut Bench) {
        self.rows(bench, "disable", Command::Disable, |bench, place, _| {
            bench.run_silently(WINDING_DECAY);
            let current = report(bench, place).current_a;
            bench.expect("current", Expect::Near(0.0, 0.05), "A", current);
        });
    }
}

/// The way at full speed, and a ramp: the mean speed of each is half of it. The drives have S-shaped ramps, trapezoids and
/// start speeds, the master looks each 10 ms.
fn expect_time(bench: &mut Bench, way_deg: f64, after_s: f64) {
    let expected_s = way_deg.abs() / (SPEED.0 * 6.0) + SPEED.0 / RAMP_RPM_S;
    bench.expect("after", Expect::Near(expected_s, 0.1), "s", after_s);
}

fn report(bench: &mut Bench, place: usize) -> sim::Report {
    let node = bench.drives()[place].1;
    bench.report_of(node)
}

/// Where the shaft truly is: all three begin at 0, as their positions do.
fn angle_deg(bench: &mut Bench, place: usize) -> f64 {
    report(bench, place).shaft_angle_rad / TAU * 360.0
}
