//! A recorded path that a group follows: what is read of a file, what is refused before anything moves, where the shafts are on the way,
//! and what stops them.

use std::cell::Cell;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use host::group_follow::{GroupFollow, PlannedFollow, RecordedPath};
use machine::file::Machine;
use machine::group_move::{GroupMove, hold};
use master::cyclic::CyclicOptions;
use master::group::{Group, GroupError, StopCause};
use master::units::{Angle, Rpm};
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, Stimulus, World, block_on, block_on_for};
use words::failure::Failure;

const PERIOD: Duration = Duration::from_millis(10);

struct Bench {
    world: World,
    drives: Vec<Drive>,
}

impl Bench {
    /// One node of each of these models, from node 1 on.
    fn new(models: &[&str]) -> Self {
        let mut world = World::new(Bitrate::M1, 3);
        let network = Network::new();
        world.add_station(network.clone());
        let drives = (1..).zip(models).map(|(number, name)| {
            let (node, model) = (NodeId::new(number).unwrap(), devices::model(name).unwrap());
            world.add_drive(number, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
            Drive::new(network.node(node), model)
        });
        let drives = drives.collect();
        world.run_until(Instant::from_secs(2));
        Self { world, drives }
    }

    fn plan(&mut self, follow: &GroupFollow) -> Result<PlannedFollow, Failure> {
        let drives = self.drives.clone();
        block_on(&mut self.world, follow.plan(None, drives)).unwrap()
    }

    /// Where a shaft truly is, in degrees.
    fn degrees(&mut self, node: u8) -> f64 {
        self.world.report(node).unwrap().shaft_angle_rad.to_degrees()
    }

    /// The angles that the drives show, in degrees.
    fn shown(&mut self) -> Vec<f64> {
        let drives = self.drives.clone();
        drives.iter().map(|drive| block_on(&mut self.world, drive.state()).unwrap().unwrap().angle.unwrap().0).collect()
    }
}

fn follow(path: &str) -> GroupFollow {
    let options = GroupMove {
        period: Some(PERIOD),
        velocity: Some(Rpm(60.0)),
        acceleration: Some(5.0),
        following_error: Some(Angle::Turns(0.2)),
        ..GroupMove::default()
    };
    let path = RecordedPath::parse("path.csv", path.as_bytes()).unwrap();
    GroupFollow { path, approach: false, options }
}

/// From rest to rest by a cycloid: `t/T - sin(2 pi t/T) / 2 pi` of the way.
fn part(of_time: f64) -> f64 {
    let s = of_time.clamp(0.0, 1.0);
    s - (TAU * s).sin() / TAU
}

/// Points of 20 ms, of 2 s, by these angles in degrees from these on.
fn path(axes: &[(f64, f64)]) -> String {
    let mut text = String::from("t_s");
    (1..=axes.len()).for_each(|node| write!(text, ",{node}.angle_deg").unwrap());
    for row in 0..=100 {
        write!(text, "\n{}", f64::from(row) * 0.02).unwrap();
        let angle = |(from, by): &(f64, f64)| from + by * part(f64::from(row) / 100.0);
        axes.iter().for_each(|axis| write!(text, ",{}", angle(axis)).unwrap());
    }
    text + "\n"
}

#[test]
fn shafts_are_where_the_closed_form_has_them_in_the_middle_and_at_the_end() {
    for models in [&["m4230e17b50", "m4230e17b50"][..], &["zlac8030l", "zlac8030l"], &["zlim42c"]] {
        let mut bench = Bench::new(models);
        let by = [180.0, -90.0];
        let axes: Vec<_> = by.iter().take(models.len()).map(|by| (30.0, *by)).collect();
        let mut follow = follow(&path(&axes));
        follow.options.relative = true;
        let planned = bench.plan(&follow).unwrap();
        let begun: Vec<_> = (1..=models.len() as u8).map(|node| bench.degrees(node)).collect();
        let mut group = block_on(&mut bench.world, planned.start.open(CyclicOptions::default())).unwrap().unwrap();
        let gone = Cell::new(Duration::ZERO);
        let mut moving = Box::pin(planned.carry_out(&mut group, |so_far, _| gone.set(so_far)));
        while gone.get() < Duration::from_secs(1) {
            assert!(block_on_for(&mut bench.world, PERIOD / 10, moving.as_mut()).is_err(), "{models:?}");
        }
        // A set-point is sent after one SYNC, taken with the next, and interpolated to until a third: at most 60 ms with what the speed loops
        // of those that are moved by speeds are behind.
        for (index, (_, by)) in axes.iter().enumerate() {
            let at = bench.degrees(index as u8 + 1) - begun[index];
            let [early, late] = [0.94, 1.0].map(|time_s| by * part(time_s / 2.0));
            let slack = 0.03 * by.abs();
            let (low, high) = (early.min(late) - slack, early.max(late) + slack);
            assert!((low..=high).contains(&at), "{models:?} axis {index}: {at} deg, expected {low} to {high}");
        }
        let run = block_on(&mut bench.world, moving).unwrap().unwrap();
        assert_eq!((run.time, run.missed_cycles), (Duration::from_secs(2), 0));
        for (index, (_, by)) in axes.iter().enumerate() {
            let went = bench.degrees(index as u8 + 1) - begun[index];
            assert!((went - by).abs() < 1.5, "{models:?} axis {index}: {went} deg");
            assert!((360.0 * (run.to[index] - run.from[index]) - by).abs() < 1e-6, "{models:?}");
        }
        block_on(&mut bench.world, group.close()).unwrap().unwrap();
    }
}

#[test]
fn axes_that_stand_elsewhere_are_refused_with_how_far_and_are_led_there_if_that_is_asked_for() {
    let mut bench = Bench::new(&["zlac8030l", "zlac8030l"]);
    let mut follow = follow(&path(&[(45.0, 90.0), (0.0, 90.0)]));
    let refused = bench.plan(&follow).err().unwrap();
    assert_eq!((refused.kind, refused.subject.node.map(NodeId::raw)), ("not_at_start", Some(1)));
    assert_eq!(refused.because, ["node 1 stands at 0 deg and the path begins at 45 deg, 45 deg away"]);
    assert!(refused.next[1].ends_with("group move 1=45deg 2=0deg"), "{refused}");
    assert!(refused.next[0].contains("--approach"), "{refused}");
    assert!([1, 2].iter().all(|node| bench.degrees(*node).abs() < 0.1));
    follow.approach = true;
    let planned = bench.plan(&follow).unwrap();
    let run = block_on(&mut bench.world, async {
        let mut group = planned.start.open(CyclicOptions::default()).await.unwrap();
        let run = planned.carry_out(&mut group, |_, _| {}).await.unwrap();
        group.close().await.unwrap();
        run
    });
    let from: Vec<_> = run.unwrap().from.iter().map(|turns| (turns * 360.0).round()).collect();
    assert_eq!(from, [45.0, 0.0]);
    let shown = bench.shown();
    assert!((shown[0] - 135.0).abs() < 1.5 && (shown[1] - 90.0).abs() < 1.5, "{shown:?}");
}

#[test]
fn a_path_beyond_a_limit_is_refused_with_its_time_and_nothing_is_written() {
    let mut bench = Bench::new(&["zlac8030l"]);
    for (path, said) in [
        // 2 A / T in the middle: 500 r/min.
        (path(&[(0.0, 3000.0)]), "axis 1 would need a velocity of"),
        // A leap of 10 deg, with 20 ms for it, between points that stand.
        ("t_s,1.angle_deg\n0,0\n1,0\n1.02,10\n2,10\n".to_owned(), "axis 1 would need"),
    ] {
        let mut follow = follow(&path);
        follow.options.acceleration = Some(100.0);
        let refused = bench.plan(&follow).err().unwrap();
        assert_eq!(refused.kind, "out_of_limits", "{refused}");
        assert!(
            refused.what.starts_with("path.csv cannot be followed: at ") && refused.what.contains(said),
            "{refused}"
        );
        // It says of the whole path what it takes, and the time that is enough is.
        assert!(refused.because.iter().any(|why| why.starts_with("node 1: the path takes up to ")), "{refused}");
        let (_, times) = refused.next[0].split_once(" s, ").expect("so many times");
        let times: f64 = times.split(' ').next().unwrap().parse().unwrap();
        let mut slowed = |factor: f64| {
            let stretched = |line: &str| {
                let (time, angle) = line.split_once(',').unwrap();
                time.parse::<f64>().map_or(line.to_owned(), |time| format!("{},{angle}", time * factor))
            };
            let text: String = path.lines().map(|line| stretched(line) + "\n").collect();
            let mut follow = self::follow(&text);
            follow.options.acceleration = Some(100.0);
            bench.plan(&follow)
        };
        assert!(slowed(times * 1.02).is_ok() && slowed(times * 0.9).is_err(), "{refused}");
    }
    // The peak of s - sin(2 pi s) / 2 pi over 3000 deg in 2 s: 2 A / T.
    let refused = bench.plan(&follow(&path(&[(0.0, 3000.0)]))).err().unwrap();
    let speed = refused.because[0].strip_prefix("node 1: the path takes up to ").unwrap();
    let (speed, limit) = speed.split_once(" deg/s, and ").unwrap();
    assert!((speed.parse::<f64>().unwrap() - 3000.0).abs() < 5.0 && limit == "360 are allowed", "{refused}");
    // The range of the axis in its machine file.
    let machine = Machine::parse(
        "[[drive]]\nmodel = 'zlac8030l'\nnode = 1\n[[group]]\nname = 'one'\n[[group.axis]]\nnode = 1\nrange_deg = [-10, 60]\n\
         velocity_deg_s = 360\nacceleration_deg_s2 = 1800\njerk_deg_s3 = 18000\nfollowing_error_deg = 60\n",
    )
    .unwrap();
    let follow = follow(&path(&[(0.0, 90.0)]));
    let (nodes, plan) = follow.axes(Some(&machine)).unwrap();
    assert_eq!(nodes.len(), 1);
    let drives = bench.drives.clone();
    let refused = block_on(&mut bench.world, follow.plan(plan, drives)).unwrap().err().unwrap();
    assert_eq!(refused.kind, "out_of_limits");
    // 60 of 90 deg are passed where s - sin(2 pi s) / 2 pi = 2/3: s = 0.5847, after 1.17 s.
    assert!(
        refused.what.contains("at 1.17 s node 1: axis 1 would be at 60.")
            || refused.what.contains("at 1.18 s node 1: axis 1"),
        "{refused}"
    );
    let power = block_on(&mut bench.world, bench.drives[0].state()).unwrap().unwrap().power;
    assert_eq!(power, Some(cia402::PowerState::SwitchOnDisabled));
}

#[test]
fn what_is_not_a_path_is_refused_with_its_place_and_a_remedy() {
    for (text, why, remedy) in [
        ("", "its first column is not t_s", "its first line names the columns"),
        ("time,1.angle_deg\n0,0\n1,1\n", "its first column is not t_s", "t_s,1.angle_deg,2.angle_deg"),
        ("t_s,angle\n0,0\n1,1\n", "'angle' is not of the form NODE.SIGNAL", "its first line names the columns"),
        ("t_s,1.velocity_rpm\n0,0\n1,1\n", "none of its columns has positions", "t_s,1.angle_deg"),
        ("t_s,1.angle_deg,2.angle\n0,0,0\n1,1,1\n", "it has 2.angle of node 2", "2.angle_deg, or take"),
        ("t_s;1.angle_deg\n0;0\n", "it is 't_s;1.angle_deg'", "divided by commas"),
        ("t_s,arm.angle_deg\n0,0\n1,1\n", "none of its columns has positions", "t_s,1.angle_deg"),
        ("t_s,1.angle_m\n0,0\n1,1\n", "none of its columns has positions", "t_s,1.angle_deg"),
        ("t_s,5.2.angle_deg\n0,0\n1,1\n", "5.2.angle_deg is not the first axis", "take the column out"),
        ("t_s,1.angle_deg,1.angle_rad\n0,0,0\n1,1,1\n", "node 1 has two columns of positions", "take one of them out"),
        ("t_s,1.angle_deg\n0,0\n1,fast\n", "line 3, column 2: 'fast' is not a number", "its first line"),
        ("t_s,1.angle_deg\n0,0\n-1,1\n", "line 3: a time of -1 s", "its first line"),
        ("t_s,1.angle_deg\n0,0\nnan,1\n", "line 3: a time of NaN s", "its first line"),
        ("t_s,1.angle_deg,2.angle_deg\n0,0,0\n1,1\n", "line 3 has 2 fields", "its first line"),
        ("t_s,1.angle_deg\n0,0\n1,nan\n2,2\n", "at 1 s node 1 has no position", "a position in each line"),
        ("t_s,1.angle_deg\n0,0\n1,inf\n2,2\n", "at 1 s node 1 has no position", "a position in each line"),
        (
            "t_s,1.angle_deg,2.angle_deg\n0,0,0\n1,1,\n2,2,2\n",
            "at 1 s node 2 has no position",
            "a position in each line",
        ),
        ("t_s,1.angle_deg\n0,0\n1,1\n1,2\n", "its times do not rise: 1 s follows 1 s", "sort its lines"),
        ("t_s,1.angle_deg\n0,0\n1,1\n0.5,2\n", "its times do not rise: 0.5 s follows 1 s", "sort its lines"),
        ("t_s,1.angle_deg\n0,0\n", "a path of 1 points leads nowhere", "where the motion begins"),
        ("t_s,1.angle_deg\n0,0\n1,1\n2,2", "its last line has no end", "end it with a line break"),
    ] {
        let refused =
            RecordedPath::parse("path.csv", text.as_bytes()).err().unwrap_or_else(|| panic!("{text:?} is taken"));
        assert_eq!((refused.kind, &*refused.what), ("bad_file", "path.csv cannot be followed"), "{text:?}");
        assert!(refused.because[0].contains(why), "{text:?}: {refused}");
        assert!(refused.next[0].contains(remedy), "{text:?}: {refused}");
    }
    for name in ["path.txt", "/no/such/path.csv"] {
        assert_eq!(RecordedPath::read(std::path::Path::new(name)).err().unwrap().kind, "bad_file");
    }
}

/// Of a record the positions are taken, the measured ones before those that were asked for; lines of other signals are passed over.
#[test]
fn a_record_of_this_program_is_a_path() {
    let record = "t_s,2.velocity_rpm,2.position_demand_counts,2.position_counts,1.target_position_deg,mark\n\
                  0,0,7,0,90,\n0.5,1,,,,\n1,2,7,4096,45,\"node 2: started\"\n1.5,,,,,\"node 2: stopped\"\n";
    let path = RecordedPath::parse("run.csv", record.as_bytes()).unwrap();
    let nodes: Vec<_> = path.nodes().map(NodeId::raw).collect();
    assert_eq!((nodes, path.duration_s()), (vec![2, 1], 1.0));
    // 4096 counts are a turn of the ZLAC8030L (6064h, user manual).
    let mut bench = Bench::new(&["zlac8030l", "zlac8030l"]);
    let asked = GroupFollow { path, approach: true, ..follow("time_s,1.angle_deg\n0,0\n1,1\n") };
    let options = GroupMove { velocity: Some(Rpm(120.0)), acceleration: Some(10.0), ..asked.options.clone() };
    let asked = GroupFollow { options, ..asked };
    let planned = bench.plan(&asked).unwrap();
    let run = block_on(&mut bench.world, async {
        let mut group = planned.start.open(CyclicOptions::default()).await.unwrap();
        let run = planned.carry_out(&mut group, |_, _| {}).await.unwrap();
        group.close().await.unwrap();
        run
    })
    .unwrap();
    // In the order of the drives: node 1 from 90 to 45 deg, node 2 by a turn.
    let rounded = |turns: &[f64]| turns.iter().map(|turns| (turns * 360.0).round()).collect::<Vec<_>>();
    assert_eq!((rounded(&run.from), rounded(&run.to)), (vec![90.0, 0.0], vec![45.0, 360.0]));
}

#[test]
fn a_fault_and_a_cable_on_the_way_stop_all_axes() {
    for model in ["m4230e17b50", "zlac8030l", "zlim42c"] {
        for stimulus in [Stimulus::CableCut(true), Stimulus::RotorLock(true)] {
            // Nothing measures the rotor of the stepper: its drive does not see that it is held.
            if model == "zlim42c" && stimulus == Stimulus::RotorLock(true) {
                continue;
            }
            let mut bench = Bench::new(&[model, model]);
            let mut follow = follow(&path(&[(0.0, 300.0), (0.0, 300.0)]));
            (follow.options.relative, follow.options.following_error) = (true, Some(Angle::Turns(0.1)));
            let planned = bench.plan(&follow).unwrap();
            let open = planned.start.open(CyclicOptions::default());
            let mut group: Group = block_on(&mut bench.world, open).unwrap().unwrap();
            let gone = Cell::new(Duration::ZERO);
            let mut moving = Box::pin(planned.carry_out(&mut group, |so_far, _| gone.set(so_far)));
            while gone.get() < Duration::from_secs(1) {
                assert!(block_on_for(&mut bench.world, PERIOD / 10, moving.as_mut()).is_err(), "{model}");
            }
            bench.world.apply(Place::node(2), &stimulus).unwrap().unwrap();
            let ended = block_on(&mut bench.world, moving).unwrap();
            let stopped = ended.err().unwrap_or_else(|| panic!("{model} {stimulus:?}: nothing stopped it"));
            let cause = match stopped {
                GroupError::Stopped(cause) => cause,
                other => panic!("{model} {stimulus:?}: {other}"),
            };
            let axis = match cause {
                StopCause::Axis { axis, .. } | StopCause::FollowingError { axis, .. } => axis,
                other => panic!("{model} {stimulus:?}: {other}"),
            };
            assert_eq!(axis, 2, "{model} {stimulus:?}");
            let rpm = bench.world.report(1).unwrap().velocity_rpm;
            assert!(rpm.abs() < 3.0, "{model} {stimulus:?}: the other one turns at {rpm} r/min");
            let _ = block_on(&mut bench.world, group.close()).unwrap();
        }
    }
}

/// A torque that turns the shafts once they have no power is held for as long as the axes are; an axis that is lost meanwhile ends it.
#[test]
fn held_axes_stay_where_they_are_under_a_load_until_it_ends_or_one_is_lost() {
    let mut bench = Bench::new(&["m4230e17b50", "zlac8030l"]);
    let mut follow = follow(&path(&[(0.0, 90.0), (0.0, 90.0)]));
    follow.options.relative = true;
    let planned = bench.plan(&follow).unwrap();
    let mut group = block_on(&mut bench.world, planned.start.open(CyclicOptions::default())).unwrap().unwrap();
    block_on(&mut bench.world, planned.carry_out(&mut group, |_, _| {})).unwrap().unwrap();
    bench.world.apply(Place::node(2), &Stimulus::LoadTorque(1.0)).unwrap().unwrap();
    let before = [1, 2].map(|node| bench.degrees(node));
    let span = Duration::from_secs(2);
    let held = block_on(&mut bench.world, hold(&mut group, |held| held >= span)).unwrap().unwrap();
    assert!(held >= span && held < span + 3 * PERIOD, "{held:?}");
    for (node, before) in [1, 2].into_iter().zip(before) {
        let now = bench.degrees(node);
        assert!((now - before).abs() < 10.0, "node {node}: from {before} to {now} deg");
    }
    bench.world.apply(Place::node(1), &Stimulus::CableCut(true)).unwrap().unwrap();
    let lost = block_on(&mut bench.world, hold(&mut group, |_| false)).unwrap().unwrap_err();
    assert!(matches!(lost, GroupError::Stopped(StopCause::Axis { axis: 1, .. })), "{lost}");
    let held_at = bench.degrees(2);
    let _ = block_on(&mut bench.world, group.close()).unwrap();
    bench.world.run_for(Duration::from_secs(1));
    assert!((bench.degrees(2) - held_at).abs() > 90.0, "nothing held it any more");
}
