//! Records of a drive as files: what is found in them is held to what its plant has, and what they lack is said.

use std::io::Cursor;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host::capture::Restorer;
use host::tune::{Bounds, Excursion, Setup, Twin, loops_of, measure, motor_of, of_capture};
use master::cyclic::CyclicOptions;
use recording::{Capture, Kind, Trace};
use sim::Place;

use crate::tune::with_constant;

const LOAD_KG_M2: f64 = 0.03;

/// What a wheel with a load shows while it is excited, as any instrument would have recorded it.
fn captured() -> Capture {
    let model = devices::model("zlac8030l").unwrap();
    let (motor, loops) = (motor_of(model).unwrap(), model.axes[0].loops.as_ref().unwrap());
    let words = vec![format!("load inertia {LOAD_KG_M2}"), "load friction 0.2 viscous 0.01".to_owned()];
    let plant = Twin::with_load((model, loops), words, with_constant(&motor));
    let (mut world, drive) = plant.world().unwrap();
    let run = async {
        let (model, loops) = loops_of(&drive).unwrap();
        let setup = Setup::begin(
            (&drive, &Restorer::of(&drive)),
            (model, loops),
            &host::tune::speed_gains(loops),
            None,
            |_| (),
        )
        .await
        .unwrap();
        let how = (Duration::from_millis(1), Bounds::default(), CyclicOptions::default());
        measure(&drive, &setup, loops, how, &mut Excursion::default()).await.unwrap().samples
    };
    let samples = sim::block_on(&mut world, run).unwrap();
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
        let report = of_capture(&through(&capture, kind), Some(constant)).unwrap();
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
    let report = of_capture(&other, Some(constant)).unwrap();
    let inertia = report.inertia_kg_m2.unwrap();
    assert!((inertia / truth - 1.0).abs() < 0.1, "{inertia} kg m², the plant has {truth}: {report:?}");
    assert!(report.notes.iter().any(|note| note.contains("velocity_demand")) && report.proportional_a_s_rad.is_none());
}

#[test]
fn what_a_capture_lacks_is_said_with_what_would_do() {
    let capture = captured();
    let says = |change: fn(&mut Capture), text: &str| {
        let mut changed = capture.clone();
        change(&mut changed);
        let failure = of_capture(&changed, None).unwrap_err();
        assert!(failure.to_string().contains(text), "{failure}");
    };
    says(
        |it| drop(it.traces.remove(0)),
        "it has no current_demand_a and no current_a, only position_deg, velocity_demand_rpm",
    );
    says(|it| drop(it.traces.remove(1)), "it has no position_deg and no velocity_rpm");
    says(|it| it.traces[0].values.fill(f64::NAN), "no three rows have all of");
    says(|it| it.time_s.iter_mut().step_by(2).for_each(|at| *at += 0.3e-3), "not evenly spaced: ");
    says(|it| it.traces[1].values.fill(7.0), "the position does not change");
    says(
        |it| {
            it.time_s.truncate(100);
            it.traces.iter_mut().for_each(|trace| trace.values.truncate(100));
        },
        "100 samples are too few",
    );
    // A gap: the longer part of it, which is said.
    let mut gap = capture.clone();
    let at = gap.time_s.len() / 10;
    gap.traces.iter_mut().for_each(|trace| trace.values[at] = f64::NAN);
    let report = of_capture(&gap, None).unwrap();
    assert_eq!(report.rows, capture.time_s.len() - at - 1);
    assert!(report.notes.iter().any(|note| note.contains("the longest stretch without a gap")), "{report:?}");
    assert!(report.inertia_kg_m2.is_none() && report.notes.iter().any(|note| note.contains("--torque-constant")));
}
