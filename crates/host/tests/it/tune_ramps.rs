//! Ramps of a stepper: held to the torques of its motor, and by its rotor, which only a virtual drive shows.

use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use devices::{Quantity, Scale};
use host::tune::{RampReport, RampRequest, tune_ramps};
use master::units::Rpm;
use master::{Drive, MotionOptions, Network};
use sim::machine::{Order, order};
use sim::{Place, World};
use tune::Turned;

const NODE: NodeId = NodeId::MIN;
const NO_LOAD: Turned = Turned { inertia_kg_m2: 0.0, dry_nm: 0.0, viscous_nm_s: 0.0, load_nm: 0.0 };

fn request(load: Turned, speed_rpm: f64) -> RampRequest {
    RampRequest {
        load,
        speed_rpm,
        margin: 1.5,
        ramp: None,
        journal: None,
        on_kept: |_| (),
        apply: true,
        within: Duration::from_secs(60),
    }
}

fn stepper(model: &str, load: &Turned) -> (World, Drive) {
    let (model, mut world, network) = (devices::model(model).unwrap(), World::new(Bitrate::M1, 1), Network::new());
    world.add_station(network.clone());
    world.add_drive(1, order(model, &Order::new(model, NODE, Bitrate::M1)).unwrap()).unwrap();
    for words in [format!("load inertia {}", load.inertia_kg_m2), format!("load friction {}", load.dry_nm)] {
        world.apply(Place::node(1), &words.parse().unwrap()).unwrap().unwrap();
    }
    world.run_for(Duration::from_secs(1));
    (world, Drive::new(network.node(NODE), model))
}

fn tuned(world: &mut World, drive: &Drive, request: &RampRequest) -> RampReport {
    sim::block_on(world, tune_ramps(drive, request, &())).unwrap().unwrap()
}

fn read(world: &mut World, drive: &Drive, object: Mux) -> i64 {
    let quantity = Quantity { object, scale: Scale::PerCount(1.0) };
    sim::block_on(world, drive.read_quantity(quantity)).unwrap().unwrap() as i64
}

fn value(report: &RampReport, object: &str) -> i64 {
    report.values.iter().find(|row| row.object == object).unwrap().after
}

/// By how many full steps the rotor is off after a motion up to a speed and back, with a ramp of so many milliseconds.
fn lost(world: &mut World, drive: &Drive, speed_rpm: f64, ramp_ms: u32) -> i64 {
    let off = |world: &mut World| {
        let report = world.report(1).unwrap();
        report.rotor_position.unwrap() - report.position
    };
    let pulses = sim::block_on(world, async {
        for object in [0x6083, 0x6084] {
            drive.node().download(Mux::new(object, 0), &ramp_ms.to_le_bytes()).await.unwrap();
        }
        drive.enable().await.unwrap();
        drive.counts_per_turn().await.unwrap()
    })
    .unwrap();
    world.run_for(Duration::from_millis(200));
    let (mut before, mut lost) = (off(world), 0);
    for speed in [speed_rpm, 0.0] {
        let turn = drive.velocity(Rpm(speed), MotionOptions { wait: false, ..MotionOptions::default() });
        sim::block_on(world, turn).unwrap().unwrap();
        world.run_for(Duration::from_millis(u64::from(ramp_ms) + 300));
        let now = off(world);
        // What is lost on one way may be won on the other.
        lost += 4 * ((now - before) as f64 / pulses * 50.0).round().abs() as i64;
        before = now;
    }
    lost
}

#[test]
fn a_proposed_ramp_loses_no_step_and_a_ramp_beyond_its_margin_does() {
    for (model, inertia_kg_m2, dry_nm, speed_rpm) in
        [("zlim42c", 3e-5, 0.02, 900.0), ("zlim42c", 8e-5, 0.05, 500.0), ("zlim42c-82", 5e-5, 0.05, 600.0)]
    {
        let load = Turned { inertia_kg_m2, dry_nm, ..NO_LOAD };
        let (mut world, drive) = stepper(model, &load);
        let report = tuned(&mut world, &drive, &request(load, speed_rpm));
        assert!(report.applied && report.margin_after >= 1.5, "{report:?}");
        // The twin keeps in step as far as the margin goes, and not by half as much again.
        let [.., last] = report.twin[..] else { panic!("{report:?}") };
        let kept: Vec<f64> = report.twin.iter().filter(|row| row.lost_steps == Some(0)).map(|row| row.load).collect();
        assert!(kept.contains(&1.0) && kept.contains(&1.5), "{report:?}");
        assert!(last.lost_steps != Some(0) && last.load <= 2.25, "{report:?}");
        for row in &report.values {
            let (index, sub) = row.object.split_once("h:").unwrap();
            let object = Mux::new(u16::from_str_radix(index, 16).unwrap(), sub.parse().unwrap());
            assert_eq!(read(&mut world, &drive, object), row.after, "{row:?}");
        }
        let ramp_ms = u32::try_from(value(&report, "6083h:00")).unwrap();
        assert_eq!(lost(&mut world, &drive, speed_rpm, ramp_ms), 0, "{report:?}");
        let beyond_ms = (f64::from(ramp_ms) / (3.0 * report.margin_after)) as u32;
        let off = lost(&mut world, &drive, speed_rpm, beyond_ms);
        assert_ne!(off, 0, "with {beyond_ms} ms: {report:?}");
    }
}

/// A weight of 0.2 N·m: 0.48 N·m at 2.2 A (ZLIM42-C manual, 2.1) hold it 1.5 times with more than 1.38 A, and at half of the largest
/// current, 0.24 N·m, only 1.2 times.
#[test]
fn a_weight_is_held_at_standstill_too() {
    let (mut world, drive) = stepper("zlim42c", &NO_LOAD);
    let weight = RampRequest { apply: false, ..request(Turned { load_nm: -0.2, ..NO_LOAD }, 300.0) };
    let report = tuned(&mut world, &drive, &weight);
    assert_eq!(value(&report, "2007h:00"), 1, "{report:?}");
    assert!(value(&report, "2005h:00") >= 4, "{report:?}");
    // With half of the current it falls: the twin's rotor, which the proposal has not let go, would show it.
    assert!(report.twin[..2].iter().all(|row| row.lost_steps == Some(0)), "{report:?}");
    assert!(!report.applied);
    // As delivered (ZLIM42-C manual, 5.4).
    for (index, delivered) in [(0x2005, 3), (0x2007, 0), (0x6083, 100), (0x6081, 120)] {
        assert_eq!(read(&mut world, &drive, Mux::new(index, 0)), delivered);
    }
}

#[test]
fn microsteps_that_are_too_fine_for_a_speed_become_coarser_and_a_start_speed_that_is_not_caught_lower() {
    // 25600 pulses a turn are 468 r/min at 200000 a second (2.1).
    let load = Turned { inertia_kg_m2: 2e-4, ..NO_LOAD };
    let (mut world, drive) = stepper("zlim42c", &load);
    for (index, value) in [(0x2006, 7_u16), (0x200E, 300)] {
        let written = sim::block_on(&mut world, drive.node().download(Mux::new(index, 0), &value.to_le_bytes()));
        written.unwrap().unwrap();
    }
    let report = tuned(&mut world, &drive, &RampRequest { apply: false, ..request(load, 500.0) });
    // 20000 pulses a turn are the next: 600 r/min.
    assert_eq!(value(&report, "2006h:00"), 14, "{report:?}");
    // `sqrt(4 T / (teeth J))`, T = 0.48 N·m / 1.5: 106 r/min less what the bearings' friction takes.
    assert!((98.0..106.0).contains(&report.start_rpm), "{report:?}");
    // A proposal that its twin made more careful begins slower still.
    assert!((50..=106).contains(&value(&report, "200Eh:00")), "{report:?}");
    assert!(report.notes.iter().any(|note| note.contains("2006h:00 changes")), "{report:?}");
}

#[test]
fn what_no_ramp_reaches_is_refused_with_the_speed_that_one_reaches() {
    let (mut world, drive) = stepper("zlim42c", &NO_LOAD);
    let load = Turned { dry_nm: 0.25, ..NO_LOAD };
    for (asked, says) in [
        (request(load, 1500.0), "the load has that margin up to"),
        (RampRequest { ramp: Some(Duration::from_millis(1)), ..request(load, 300.0) }, "a ramp of 1 ms was asked for"),
        (request(load, 3001.0), "expected a speed from 5 to 3000 r/min, got 3001"),
        (request(Turned { dry_nm: f64::NAN, ..load }, 300.0), "expected a load friction from 0 to 100 N·m, got NaN"),
    ] {
        let failure = sim::block_on(&mut world, tune_ramps(&drive, &asked, &())).unwrap().unwrap_err();
        assert!(failure.to_string().contains(says), "{failure}");
    }
    assert_eq!(read(&mut world, &drive, Mux::new(0x6083, 0)), 100);
}
