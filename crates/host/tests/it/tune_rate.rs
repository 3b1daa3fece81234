//! How often a drive is sampled that is measured: as its own time and the bus allow.

use std::time::Duration;

use can::{Bitrate, Instant};
use host::capture::Restorer;
use host::tune::{Excursion, Request, find, motor_of, tune};
use master::{Drive, Network};
use sim::machine::{Order, TimingMode, order};
use sim::{Place, World};

use crate::tune::{relative, request};

/// A wheel that takes the time of a device, with 0.02 kg m² behind it.
fn slow(bitrate: Bitrate) -> (World, Drive) {
    let (model, id) = (devices::model("zlac8030l").unwrap(), canopen::NodeId::MIN);
    let mut world = World::new(bitrate, 1);
    let network = Network::new();
    world.add_station(network.clone());
    world.set_timing(TimingMode::Device);
    world.add_drive(id.raw(), order(model, &Order::new(model, id, bitrate)).unwrap()).unwrap();
    world.apply(Place::node(1), &"load inertia 0.02".parse().unwrap()).unwrap().unwrap();
    world.run_until(Instant::from_secs(2));
    (world, Drive::new(network.node(id), model))
}

/// At 500 kbit/s SYNC, one RPDO and two TPDOs are 0.7 ms and more, and the drive takes up to 0.4 ms before it answers. When it reads its
/// position, which makes a steady speed look uneven, does not decide whether new gains are better.
#[test]
fn a_drive_is_sampled_in_the_shortest_period_in_which_nothing_is_missing_and_takes_its_new_gains() {
    for (bitrate, period_ms) in [(Bitrate::K500, 2.0), (Bitrate::M1, 1.0)] {
        let (mut world, drive) = slow(bitrate);
        let request = Request { period: None, apply: true, ..request() };
        let restorer = Restorer::of(&drive);
        let run = tune((&drive, &restorer), &request, &(), std::future::ready(false));
        let report = sim::block_on(&mut world, run).unwrap().unwrap();
        assert_eq!(report.period_ms, Some(period_ms));
        let is_said = report.notes.iter().any(|note| note.starts_with("it was sampled every 2ms"));
        assert_eq!(is_said, bitrate == Bitrate::K500, "{:?}", report.notes);
        let rotor = motor_of(drive.description().unwrap()).unwrap().rotor.inertia_kg_m2;
        assert!(relative(report.inertia_kg_m2, rotor + 0.02) < 0.05, "{}", report.inertia_kg_m2);
        let [before, after] = report.drive_error.unwrap();
        assert!(report.applied && after < before, "{before} {after} {:?}", report.notes);
    }
}

/// Its plug is loose for 3 ms once in the excitation: a sample or two stay away.
#[test]
fn a_sample_that_is_missing_once_is_no_reason_to_measure_again() {
    let (mut world, drive) = slow(Bitrate::M1);
    let station = world.drive_id(1).unwrap();
    let (period, restorer) = (Some(Duration::from_millis(2)), Restorer::of(&drive));
    let request = Request { period, ..request() };
    let mut run = Box::pin(tune((&drive, &restorer), &request, &(), std::future::ready(false)));
    let out_of_time = |ended| matches!(ended, Err(sim::BlockOnError::OutOfTime { .. }));
    assert!(out_of_time(sim::block_on_for(&mut world, Duration::from_secs(14), &mut run).map(|_| ())));
    world.cut(station);
    assert!(out_of_time(sim::block_on_for(&mut world, Duration::from_millis(3), &mut run).map(|_| ())));
    world.join(station);
    let report = sim::block_on(&mut world, run).unwrap().unwrap();
    let said = report.notes.iter().filter(|note| note.contains("did not come in their cycle")).count();
    assert_eq!((report.period_ms, said), (Some(2.0), 1), "{:?}", report.notes);
    let rotor = motor_of(drive.description().unwrap()).unwrap().rotor.inertia_kg_m2;
    assert!(relative(report.inertia_kg_m2, rotor + 0.02) < 0.05, "{}", report.inertia_kg_m2);
}

/// The speed loop answers to the step of a set-point with a current that has fallen by half before the next sample.
#[test]
fn few_samples_find_the_same_inertia_as_many() {
    for period_ms in [5, 10] {
        let (mut world, drive) = slow(Bitrate::M1);
        let period = Some(Duration::from_millis(period_ms));
        let (request, restorer, mut excursion) =
            (Request { period, ..request() }, Restorer::of(&drive), Excursion::default());
        let run = find((&drive, &restorer), &request, &mut excursion);
        let (report, _) = sim::block_on(&mut world, run).unwrap().unwrap();
        let rotor = motor_of(drive.description().unwrap()).unwrap().rotor.inertia_kg_m2;
        let off = relative(report.inertia_kg_m2, rotor + 0.02);
        assert!(off < 0.05, "{period_ms} ms: {} kg m²", report.inertia_kg_m2);
        assert!(report.twin_off < 0.1, "{period_ms} ms: the twin is {} off", report.twin_off);
    }
}

#[test]
fn a_period_in_which_samples_are_missing_is_refused_before_the_shaft_has_gone_far() {
    let (mut world, drive) = slow(Bitrate::K500);
    let stood = world.report(1).unwrap().position;
    let period = Some(Duration::from_millis(1));
    let (request, restorer, mut excursion) =
        (Request { period, ..request() }, Restorer::of(&drive), Excursion::default());
    let run = find((&drive, &restorer), &request, &mut excursion);
    let failure = sim::block_on(&mut world, run).unwrap().unwrap_err();
    assert_eq!(failure.kind, "no_rate", "{failure:?}");
    assert!(failure.to_string().contains("a sample is missing") && failure.next[0].contains("longer --period"));
    let report = world.report(1).unwrap();
    // 4096 counts are a turn; the whole measurement takes more than ten. The first sample that is missing may be a lone one.
    assert!((report.position - stood).abs() < 2 * 4096, "{report:?}");
    assert_ne!(report.state, Some(cia402::PowerState::OperationEnabled));
}
