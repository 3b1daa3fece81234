//! One call of the master for all three models, in degrees and r/min of the motor's shaft. What each model's counts, ramps
//! and controlwords are is the master's business; whether the shafts did what was asked is measured here.

use std::f64::consts::TAU;
use std::time::Duration;

use canopen::NodeId;
use devices::Description;
use master::drive::{Drive, MotionOptions, MotionReport};
use master::units::{Degrees, Ramp, Rpm};
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

/// What is asked of all drives at once.
#[derive(Clone, Copy)]
enum Intent {
    Turn(Rpm),
    KeepTurning(Duration),
    Stop,
    By(Degrees),
    To(Degrees),
    Disable,
}

impl Intent {
    async fn of(self, drive: &Drive) -> Result<Option<MotionReport>, Error> {
        let ramp = Some(Ramp::RpmPerSecond(RAMP_RPM_S));
        let options =
            MotionOptions { speed: Some(SPEED), acceleration: ramp, deceleration: ramp, ..MotionOptions::default() };
        match self {
            Self::Turn(speed) => drive.velocity(speed, MotionOptions { speed: None, ..options }).await.map(Some),
            Self::KeepTurning(time) => drive.supervise(time).await.map(|()| None),
            Self::Stop => drive.stop().await.map(|()| None),
            Self::By(angle) => drive.move_relative(angle, options).await.map(Some),
            Self::To(angle) => drive.move_absolute(angle, options).await.map(Some),
            Self::Disable => drive.disable().await.map(|_| None),
        }
    }

    fn text(self) -> String {
        match self {
            Self::Turn(speed) => format!("turn at {:.0} r/min", speed.0),
            Self::KeepTurning(time) => format!("for {:.0} s", time.as_secs_f64()),
            Self::Stop => "stop".into(),
            Self::By(angle) => format!("move by {:.0}°", angle.0),
            Self::To(angle) => format!("move to {:.0}°", angle.0),
            Self::Disable => "disable".into(),
        }
    }
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
    fn ask(&self, bench: &mut Bench, intent: Intent) -> Vec<(String, f64)> {
        let calls = join_all(self.drives.iter().map(|drive| intent.of(drive)));
        let Ok(answers) = sim::block_on_for(bench.world(), LIMIT, calls) else { return Vec::new() };
        let words = |answer: Result<Option<MotionReport>, Error>| match answer {
            Ok(report) => match report.and_then(|report| report.reached_after) {
                Some(after) => (format!("reached after {:.2} s", after.as_secs_f64()), after.as_secs_f64()),
                None => ("done".into(), f64::NAN),
            },
            Err(error) => (error.to_string(), f64::NAN),
        };
        answers.into_iter().map(words).collect()
    }

    /// A row for each drive, with what it answered.
    fn rows(&self, bench: &mut Bench, intent: Intent, check: impl Fn(&mut Bench, usize, f64)) {
        bench.mark(intent.text(), EventKind::Note);
        let answers = self.ask(bench, intent);
        for place in 0..self.drives.len() {
            let (node, title) = (bench.drives()[place].1, bench.drives()[place].0.title);
            bench.step(format!("{title}: {}", intent.text()));
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

    fn turn(&self, bench: &mut Bench, before_rpm: f64, rpm: f64) {
        self.rows(bench, Intent::Turn(Rpm(rpm)), |bench, place, after_s| {
            let seen = report(bench, place).velocity_rpm;
            bench.moved(format!("{seen:+.1} r/min"));
            // The master takes 5 % off as reached, and looks each 10 ms.
            let expected_s = (rpm - before_rpm).abs() / RAMP_RPM_S;
            bench.expect("after", Expect::Near(expected_s, 0.05), "s", after_s);
        });
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        let (time, begin) = (Duration::from_secs(1), bench.now());
        // The drives are left alone together, so that the way of each is that of one stretch of time.
        self.ask(bench, Intent::KeepTurning(time));
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
        self.rows(bench, Intent::Stop, |bench, place, _| {
            let seen = report(bench, place).velocity_rpm;
            bench.moved(format!("{seen:+.1} r/min"));
            bench.expect("speed", Expect::Near(0.0, 2.0), "r/min", seen);
        });
    }

    fn go_by(&self, bench: &mut Bench, angle: f64) {
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        self.rows(bench, Intent::By(Degrees(angle)), |bench, place, after_s| {
            let seen = angle_deg(bench, place) - from[place];
            bench.moved(format!("{seen:+.1}°"));
            bench.expect("way", Expect::Near(angle, IN_PLACE_DEG), "°", seen);
            expect_time(bench, angle, after_s);
        });
    }

    fn go_to(&self, bench: &mut Bench, angle: f64) {
        let from: Vec<f64> = (0..self.drives.len()).map(|place| angle_deg(bench, place)).collect();
        self.rows(bench, Intent::To(Degrees(angle)), |bench, place, after_s| {
            let seen = angle_deg(bench, place);
            bench.moved(format!("{:+.1}°", seen - from[place]));
            bench.expect("at", Expect::Near(angle, IN_PLACE_DEG), "°", seen);
            expect_time(bench, angle - from[place], after_s);
        });
    }

    fn disable(&self, bench: &mut Bench) {
        self.rows(bench, Intent::Disable, |bench, place, _| {
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
