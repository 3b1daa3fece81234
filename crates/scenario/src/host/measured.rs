//! What a host measures of a drive: captures, test motions, gains.

use host::capture::CaptureLine;
use host::test_motion::TestMotionLine;
use host::tune::TuneLine;
use master::units::Shown;
use sim::Place;
use words::counted;

use super::whole::said;
use super::{Done, HostTask};

impl HostTask {
    /// Captures of a drive, as `ferrodrive capture` does: of each quantity its least and its greatest value.
    pub(super) async fn capture(&self, place: Place, asked: &CaptureLine) -> Done {
        let taken =
            asked.carry_out(&self.drive(place)?, self.machine.bus_bitrate()).await.map_err(|failure| said(&failure))?;
        if let Some(failure) = taken.cut_off {
            return Err(said(&failure));
        }
        let capture = taken.capture;
        let traces = capture.traces.iter().map(|trace| {
            let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max]
                .map(|of| Shown(capture.points(trace).map(|(_, value)| value).reduce(of).unwrap_or(f64::NAN)));
            format!("{} {low} to {high}", trace.quantity)
        });
        let rows = counted(capture.time_s.len(), "row");
        Ok((std::iter::once(rows).chain(traces).collect::<Vec<_>>().join("; "), None))
    }

    /// Moves a drive by a test motion, as `ferrodrive test-motion` does: the figures of each run.
    pub(super) async fn test_motion(&self, place: Place, asked: &TestMotionLine) -> Done {
        let runs =
            asked.carry_out(&self.drive(place)?, self.machine.bus_bitrate()).await.map_err(|failure| said(&failure))?;
        let runs = runs.iter().map(|run| {
            let rows = run.figures.rows().into_iter().map(|[what, value, _]| format!("{what} {value}"));
            let why = run.figures.no_steps.clone();
            format!("run {}: {}", run.number, rows.chain(why).collect::<Vec<_>>().join(", "))
        });
        Ok((runs.collect::<Vec<_>>().join("; "), None))
    }

    /// Finds gains for a drive, as `ferrodrive tune` does: what it is, and what is proposed.
    pub(super) async fn tune(&self, place: Place, asked: &TuneLine) -> Done {
        // The mathematics is not part of the module of a page without a server.
        if cfg!(target_arch = "wasm32") {
            return Err("a page without a server finds no gains: `ferrodrive run` does".to_owned());
        }
        let report = asked.carry_out(&self.drive(place)?).await.map_err(|failure| said(&failure))?;
        let gains = report.gains.iter().map(|gain| format!("{} {} -> {}", gain.object, gain.before, gain.after));
        let found = format!("inertia {} kg m2", Shown(report.inertia_kg_m2));
        let tried = match (asked.apply, report.applied) {
            (false, _) => "tried on its twin".to_owned(),
            (true, true) => "tried on the drive, which has them".to_owned(),
            (true, false) => format!("the drive has what it had: {}", report.notes.join("; ")),
        };
        Ok((std::iter::once(found).chain(gains).chain([tried]).collect::<Vec<_>>().join("; "), None))
    }
}
