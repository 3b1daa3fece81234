//! Records of a drive as files: what is found in them is held to what its plant has, and what they lack is said.

use std::io::Cursor;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use can::{Frame, Instant, Station};
use host::capture::{Restorer, record_of_log};
use host::tune::{Bounds, Excursion, Setup, Twin, loops_of, measure, motor_of, of_capture};
use master::Drive;
use master::cyclic::CyclicOptions;
use master::decode::Decoder;
use recording::{Capture, Kind, Trace};
use sim::{Place, World};
use tune::Samples;

use crate::tune::with_constant;

const LOAD_KG_M2: f64 = 0.03;

/// A wheel with a load.
fn plant() -> Twin {
    let model = devices::model("zlac8030l").unwrap();
    let (motor, loops) = (motor_of(model).unwrap(), model.axes[0].loops.as_ref().unwrap());
    let words = vec![format!("load inertia {LOAD_KG_M2}"), "load friction 0.2 viscous 0.01".to_owned()];
    Twin::with_load((model, loops), words, with_constant(&motor))
}

/// Samples of it while it is excited.
fn measured(world: &mut World, drive: &Drive, period: Duration) -> Samples {
    let run = async {
        let (model, loops) = loops_of(drive).unwrap();
        let setup =
            Setup::begin((drive, &Restorer::of(drive)), (model, loops), &host::tune::speed_gains(loops), None, |_| ())
                .await
                .unwrap();
        let how = (period, Bounds::default(), CyclicOptions::default());
        measure(drive, &setup, loops, how, &mut Excursion::default()).await.unwrap().samples
    };
    sim::block_on(world, run).unwrap()
}

/// The same, as any instrument would have recorded it.
fn captured() -> Capture {
    let (mut world, drive) = plant().world().unwrap();
    let samples = measured(&mut world, &drive, Duration::from_millis(1));
    let time_s: Vec<f64> = (0..samples.len()).map(|n| n as f64 * samples.period_s).collect();
    let trace = |name: &str, unit: &str, values: &[f64], worth: f64| {
        Trace::new(name.into(), unit.into(), values.iter().map(|value| value / worth).collect(), &time_s)
    };
    let traces = vec![
        trace("current_demand_a", "A", &samples.current_a, 1.0),
        trace("position_deg", "deg", &samples.position_rad, std::f64::consts::TAU / 360.0),
        trace("velocity_demand_rpm", "r/min", &samples.set_point_rad_s, cia402::RAD_S_PER_RPM),
    ];
    Capture {
        name: String::new(),
        notes: String::new(),
        model: String::new(),
        place: Place::node(4),
        trigger_s: None,
        time_s,
        traces,
        parameters: Default::default(),
        is_cut_off: false,
    }
}

/// Written to a file of a kind and read back.
fn through(capture: &Capture, kind: Kind) -> Capture {
    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Cursor<Vec<u8>>>>);
    impl std::io::Read for Shared {
        fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().read(into)
        }
    }
    impl std::io::Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    impl std::io::Seek for Shared {
        fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
            self.0.lock().unwrap().seek(to)
        }
    }
    let file = Shared::default();
    capture.write(kind, Box::new(file.clone())).unwrap();
    let bytes = file.0.lock().unwrap().get_ref().clone();
    Capture::of(&recording::read(kind, &bytes).unwrap(), Some(Place::node(4))).unwrap()
}

/// Inertia within 5 %: rotor and load, by the motor's own torque per ampere.
#[test]
fn a_capture_in_a_file_shows_the_inertia_and_the_speed_loop_of_its_drive() {
    let motor = motor_of(devices::model("zlac8030l").unwrap()).unwrap();
    let constant = motor.windings.torque_constant_nm_a();
    let truth = motor.rotor.inertia_kg_m2 + LOAD_KG_M2;
    let capture = captured();
    for kind in [Kind::Csv, Kind::Mcap] {
        let report = of_capture(&through(&capture, kind), Some(constant), None).unwrap();
        let inertia = report.inertia_kg_m2.unwrap();
        assert!((inertia / truth - 1.0).abs() < 0.05, "{inertia} kg m², the plant has {truth}: {report:?}");
        assert!(report.coherent >= 12 && report.model_off < 0.2 && report.resonance_hz.is_none(), "{report:?}");
        assert!(report.proportional_a_s_rad.is_some_and(|gain| gain > 0.0), "{report:?}");
        assert!(report.node == 4 && (report.period_s - 1e-3).abs() < 1e-9, "{}", report.period_s);
    }
    // Without its set-point, and by the speed that it shows.
    let mut other = capture.clone();
    other.traces.retain(|trace| trace.quantity != "velocity_demand_rpm");
    let angle = other.traces[1].values.clone();
    let rpm: Vec<f64> = (0..angle.len())
        .map(|n| (angle[(n + 1).min(angle.len() - 1)] - angle[n.saturating_sub(1)]) / 2e-3 / 6.0)
        .collect();
    other.traces[1] = Trace::new("velocity_rpm".into(), "r/min".into(), rpm, &other.time_s);
    let report = of_capture(&other, Some(constant), None).unwrap();
    let inertia = report.inertia_kg_m2.unwrap();
    assert!((inertia / truth - 1.0).abs() < 0.1, "{inertia} kg m², the plant has {truth}: {report:?}");
    assert!(report.notes.iter().any(|note| note.contains("velocity_demand")) && report.proportional_a_s_rad.is_none());
}

/// All that is on a bus.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<(Instant, Frame)>>>);

impl Station for Log {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.0.lock().unwrap().push((now, *frame));
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self) -> Option<Frame> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// By its PDOs: current and position from TPDOs, the set-point from the RPDO of the program that moved it. In mA and counts, at the times of SYNC.
#[test]
fn a_log_of_frames_shows_the_inertia_and_the_speed_loop_too() {
    let (mut world, drive) = plant().world().unwrap();
    let log = Log::default();
    world.add_station(log.clone());
    measured(&mut world, &drive, Duration::from_millis(5));
    let model = devices::model("zlac8030l").unwrap();
    let mut decoder = Decoder::new();
    decoder.set_model(drive.node().id(), model);
    let frames = std::mem::take(&mut *log.0.lock().unwrap());
    let capture = Capture::of(&record_of_log(decoder, frames).unwrap(), None).unwrap();
    let motor = motor_of(model).unwrap();
    let report = of_capture(&capture, None, Some(model)).unwrap();
    assert_eq!(report.quantities, ["torque_demand", "position_actual_value_counts", "sent_target_velocity_rpm"]);
    let inertia = report.inertia_kg_m2.unwrap();
    let truth = motor.rotor.inertia_kg_m2 + LOAD_KG_M2;
    assert!((inertia / truth - 1.0).abs() < 0.1 && report.resonance_hz.is_none(), "{inertia}, the plant has {truth}");
    // 0.5e-3 A/(r/min) for a count of its gain, of which it has 500; the time constant of its filter is not in a log.
    let proportional = report.proportional_a_s_rad.unwrap() * cia402::RAD_S_PER_RPM;
    assert!((proportional / 0.25 - 1.0).abs() < 0.25, "{proportional}");
    assert!(
        report.notes.iter().any(|note| note.contains("4096 counts, as the model is delivered")),
        "{:?}",
        report.notes
    );
}

#[test]
fn what_a_capture_lacks_is_said_with_what_would_do() {
    let capture = captured();
    let says = |change: fn(&mut Capture), text: &str| {
        let mut changed = capture.clone();
        change(&mut changed);
        let failure = of_capture(&changed, None, None).unwrap_err();
        assert!(failure.to_string().contains(text), "{failure}");
    };
    says(
        |it| drop(it.traces.remove(0)),
        "it has no current in A: current_demand_a or current_a, only position_deg, velocity_demand_rpm",
    );
    says(|it| drop(it.traces.remove(1)), "it has no motion: position_deg or velocity_rpm");
    says(|it| it.traces[0].values.fill(f64::NAN), "no three rows have all of");
    says(|it| it.time_s.iter_mut().step_by(2).for_each(|at| *at += 0.7e-3), "not evenly spaced: ");
    says(|it| it.traces[1].values.fill(7.0), "the position does not change");
    says(
        |it| {
            it.time_s.truncate(100);
            it.traces.iter_mut().for_each(|trace| trace.values.truncate(100));
        },
        "100 samples are too few",
    );
    // Each row a while before or after its time, with the values that it has then: read between them.
    let mut uneven = capture.clone();
    let late = |row: usize| 0.2e-3 * f64::sin(row as f64);
    for trace in &mut uneven.traces {
        let even = trace.values.clone();
        for (row, value) in trace.values.iter_mut().enumerate().skip(1).take(even.len() - 2) {
            let (share, next) = (late(row) / 1e-3, if late(row) > 0.0 { row + 1 } else { row - 1 });
            *value += share.abs() * (even[next] - even[row]);
        }
    }
    uneven.time_s.iter_mut().enumerate().skip(1).for_each(|(row, at)| *at += late(row));
    let [report, other] = [&capture, &uneven].map(|of| of_capture(of, Some(1.0), None).unwrap());
    let [inertia, same] = [&other, &report].map(|found| found.inertia_kg_m2.unwrap());
    assert!((inertia / same - 1.0).abs() < 0.03, "{inertia}, evenly {same}");
    assert!(other.notes.iter().any(|note| note.contains("read at equal times")), "{other:?}");
    // A gap: the longer part of it, which is said.
    let mut gap = capture.clone();
    let at = gap.time_s.len() / 10;
    gap.traces.iter_mut().for_each(|trace| trace.values[at] = f64::NAN);
    let report = of_capture(&gap, None, None).unwrap();
    assert_eq!(report.rows, capture.time_s.len() - at - 1);
    assert!(report.notes.iter().any(|note| note.contains("the longest stretch without a gap")), "{report:?}");
    assert!(report.inertia_kg_m2.is_none() && report.notes.iter().any(|note| note.contains("--torque-constant")));
}
