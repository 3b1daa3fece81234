//! Ramps, currents and microsteps of a stepper that nothing measures: computed from its motor and its load, tried on its twin.
//!
//! The drive itself shows no lost step. So it is not turned: what is proposed has a margin by the torque of the motor's data, and the
//! twin, whose rotor is known, keeps in step with a load that is larger by that margin, or the proposal is made more careful until
//! it does. What hangs on the shaft is what the user says.

use std::path::PathBuf;
use std::time::Duration;

use canopen::Mux;
use cia402::{RAD_S_PER_RPM, RPM_PER_RAD_S};
use devices::{CountsPerTurn, Description, OpenLoop, Quantity, Ramps, Scale};
use master::Drive;
use master::parameters::Parameters;
use serde::Serialize;
use sim::StepperData;
use tune::{Ramp, Turned};
use words::failure::Failure;

use super::bench::bytes;
use super::ramps_twin::{Rotor, TwinRow};
use super::twin::stepper_of;
use super::{Gain, GainRow};
use crate::network::Progress;
use crate::network::params::Transaction;

/// Makers' general specification of such motors: a temperature rise of at most 80 K, from 25 °C.
const WARM_C: f64 = 105.0;
/// Share of the supply that the bridges give: the rest is dead time, and what cable and bus lose.
const USABLE: f64 = 0.95;
/// By how much a proposal is more careful each time that its twin has lost steps, and how often.
const CAREFUL: f64 = 1.1;
const CORRECTIONS: i32 = 8;
/// Beyond the margin the twin is loaded by so many times more, until it loses steps.
const BEYOND: [f64; 4] = [1.25, 1.5, 2.0, 3.0];

/// What is asked for.
#[derive(Clone, Debug)]
pub struct RampRequest {
    /// What hangs on the shaft, without the rotor.
    pub load: Turned,
    /// Speed that is to be reached.
    pub speed_rpm: f64,
    /// How many times the torque that is needed there is to be.
    pub margin: f64,
    /// Time in which the speed is to be reached; `None` for the shortest that keeps the margin.
    pub ramp: Option<Duration>,
    /// Where the way back is kept while it is written; `None` on a bus that ends with the program.
    pub journal: Option<PathBuf>,
    /// Hears what to do about a journal that stays.
    pub on_kept: fn(&str),
    /// Write the proposed values to the drive.
    pub apply: bool,
    /// Longest time for that transaction.
    pub within: Duration,
}

impl RampRequest {
    /// Whether something can be computed from it.
    ///
    /// # Errors
    /// What is out of range, and what is not.
    pub fn check(&self) -> Result<(), Failure> {
        let Turned { inertia_kg_m2, dry_nm, viscous_nm_s, load_nm } = self.load;
        for (what, unit, value, range) in [
            ("speed", "r/min", self.speed_rpm, 1.0..=100_000.0),
            ("margin", "times what is needed", self.margin, 1.0..=10.0),
            ("load inertia", "kg·m²", inertia_kg_m2, 0.0..=10.0),
            ("load friction", "N·m", dry_nm, 0.0..=100.0),
            ("viscous load friction", "N·m·s/rad", viscous_nm_s, 0.0..=100.0),
            ("load torque", "N·m", load_nm, -100.0..=100.0),
        ] {
            if !range.contains(&value) {
                let (least, most) = (range.start(), range.end());
                return Err(Failure::usage(format!("expected a {what} from {least} to {most} {unit}, got {value}"))
                    .next("nothing was written"));
            }
        }
        Ok(())
    }
}

/// Objects with the values that are proposed.
type Values = Vec<(Mux, i64)>;

/// What was computed and is proposed. Torques and inertia are those at the motor's shaft.
#[derive(Debug, Serialize)]
pub struct RampReport {
    /// Its node-ID.
    pub node: u8,
    /// Its model.
    pub model: &'static str,
    /// Voltage of its bus.
    pub supply_v: f64,
    /// Inertia of all that turns.
    pub inertia_kg_m2: f64,
    /// The speed that is to be reached.
    pub speed_rpm: f64,
    /// What the motor gives there at most, with the proposed current.
    pub pull_out_nm: f64,
    /// What the load takes there without a change of speed.
    pub needed_nm: f64,
    /// The highest speed at which the load has the margin, with the largest current.
    pub highest_rpm: f64,
    /// The highest speed with which a motion may begin and end without a ramp.
    pub start_rpm: f64,
    /// The margin that was asked for.
    pub margin: f64,
    /// The least margin on the ramp with the values that it has.
    pub margin_before: f64,
    /// With those that are proposed.
    pub margin_after: f64,
    /// Proposed values.
    pub values: Vec<GainRow>,
    /// What the twin lost with them.
    pub twin: Vec<TwinRow>,
    /// The drive has the proposed values.
    pub applied: bool,
    /// What else is to be known.
    pub notes: Vec<String>,
}

/// How a drive's rotor is kept in step, if its model is such a one.
pub fn open_loop_of(drive: &Drive) -> Option<(&'static Description, &'static OpenLoop)> {
    let model = drive.description()?;
    let axis = model.axes.get(usize::from(drive.axis_id().0)).or(model.axes.first())?;
    axis.open_loop.as_ref().map(|open_loop| (model, open_loop))
}

/// Objects of a drive, by what they are for.
struct RampObjects {
    up: Mux,
    down: Mux,
    quick_stop: Mux,
    microsteps: Mux,
    pulses: &'static [u16],
    profile_velocity: Mux,
    start: Mux,
    end: Mux,
}

/// What is known of a drive before anything is proposed.
struct Known {
    model: &'static Description,
    open_loop: &'static OpenLoop,
    objects: RampObjects,
    stepper: StepperData,
    supply_v: f64,
    /// All that turns.
    all: Turned,
    speed_rad_s: f64,
    had: Vec<(Mux, i64)>,
}

impl RampObjects {
    fn of(model: &Description, open_loop: &OpenLoop) -> Option<Self> {
        let units = model.axes.first()?.units;
        let Some(Ramps::Times { acceleration, deceleration, quick_stop }) = units.ramps else { return None };
        let CountsPerTurn::Table { object, counts, .. } = units.counts_per_turn else { return None };
        Some(Self {
            up: acceleration,
            down: deceleration,
            quick_stop,
            microsteps: object,
            pulses: counts,
            profile_velocity: units.profile_velocity?.object,
            start: open_loop.start_speed.object,
            end: open_loop.end_speed.object,
        })
    }
}

impl Known {
    async fn of(drive: &Drive, request: &RampRequest) -> Result<Self, Failure> {
        let id = drive.node().id();
        let failed =
            |reason: &str| Failure::new(format!("node {id}: no ramps can be computed")).at_node(id).because(reason);
        let (model, open_loop) =
            open_loop_of(drive).ok_or_else(|| failed("its model is not a stepper in an open loop"))?;
        let objects = RampObjects::of(model, open_loop)
            .ok_or_else(|| failed("its description names no times of its ramps, or no table of microsteps"))?;
        let stepper = stepper_of(model).ok_or_else(|| failed("no data of its motor are known"))?;
        let voltage = model.axes[0].units.bus_voltage.ok_or_else(|| failed("it does not show its bus voltage"))?;
        let supply_v = drive.read_quantity(voltage).await?;
        let RampObjects { up, down, quick_stop, microsteps, profile_velocity, start, end, .. } = objects;
        let standstill = open_loop.standstill.0;
        let mut had = Vec::new();
        for object in [open_loop.current, standstill, microsteps, up, down, quick_stop, profile_velocity, start, end] {
            let raw = drive.read_quantity(Quantity { object, scale: Scale::PerCount(1.0) }).await?;
            had.push((object, raw as i64));
        }
        let (rotor, load) = (stepper.rotor, request.load);
        let all = Turned {
            inertia_kg_m2: rotor.inertia_kg_m2 + load.inertia_kg_m2,
            dry_nm: rotor.coulomb_nm + load.dry_nm,
            viscous_nm_s: rotor.viscous_nm_s + load.viscous_nm_s,
            load_nm: load.load_nm,
        };
        let speed_rad_s = request.speed_rpm * RAD_S_PER_RPM;
        Ok(Self { model, open_loop, objects, stepper, supply_v, all, speed_rad_s, had })
    }

    fn had(&self, object: Mux) -> i64 {
        self.had.iter().find(|(other, _)| *other == object).map_or(0, |(_, value)| *value)
    }

    fn range(&self, object: Mux) -> (i64, i64) {
        self.model.row(object).and_then(|row| row.integer_limits()).unwrap_or((0, i64::from(u16::MAX)))
    }

    fn pull_out_nm(&self, current_a: f64, speed_rad_s: f64) -> f64 {
        self.stepper.stepping.pull_out_nm(current_a, USABLE * self.supply_v, WARM_C, speed_rad_s)
    }

    fn current_a(&self, choice: i64) -> f64 {
        let currents = self.open_loop.currents_a;
        usize::try_from(choice).ok().and_then(|choice| currents.get(choice)).map_or(0.0, |current| f64::from(*current))
    }

    /// The least margin on a ramp of so many milliseconds.
    fn margin(&self, current_a: f64, start_rpm: i64, time_ms: i64) -> f64 {
        let from_rad_s = (start_rpm as f64 * RAD_S_PER_RPM).min(self.speed_rad_s);
        // 0 is the step that it is.
        let time_s = (time_ms as f64 * 1e-3).max(1e-6);
        let ramp = Ramp { from_rad_s, to_rad_s: self.speed_rad_s, time_s };
        self.all.margin(&ramp, |speed_rad_s| self.pull_out_nm(current_a, speed_rad_s))
    }

    /// Currents that can be chosen, with their choices, the smallest first.
    fn currents(&self) -> Vec<(i64, f64)> {
        let mut currents: Vec<(i64, f64)> =
            (0..).zip(self.open_loop.currents_a.iter().map(|current| f64::from(*current))).collect();
        currents.sort_by(|a, b| a.1.total_cmp(&b.1));
        currents
    }

    /// The highest speed with which a motion may begin and end without a ramp, and leave this margin.
    fn start_rpm(&self, current_a: f64, margin: f64) -> f64 {
        let teeth = self.stepper.stepping.windings.teeth;
        self.all.start_rad_s(self.pull_out_nm(current_a, 0.0) / margin, teeth) * RPM_PER_RAD_S
    }

    /// Up to which speed the load has this margin without a change of speed.
    fn highest_rpm(&self, current_a: f64, margin: f64) -> f64 {
        let top = self.range(self.objects.profile_velocity).1;
        let carries = |rpm: i64| {
            let speed = rpm as f64 * RAD_S_PER_RPM;
            self.pull_out_nm(current_a, speed) >= margin * self.all.needed_nm(speed, 0.0)
        };
        first((0, top), |rpm| !carries(rpm)).map_or(top, |rpm| (rpm - 1).max(0)) as f64
    }

    /// The choice of microsteps that stays, or the nearest that the speed allows and that is smooth.
    fn microsteps(&self) -> Option<i64> {
        let turns_s = self.speed_rad_s * RPM_PER_RAD_S / 60.0;
        let had = usize::try_from(self.had(self.objects.microsteps)).ok();
        let had = f64::from(had.and_then(|choice| self.objects.pulses.get(choice)).copied().unwrap_or(1).max(1));
        let fits = |pulses: u16| {
            u32::from(pulses) >= self.open_loop.smooth_pulses
                && f64::from(pulses) * turns_s <= self.open_loop.step_frequency_hz
        };
        let choices = (0..).zip(self.objects.pulses.iter().copied()).filter(|(_, pulses)| fits(*pulses));
        let far = |pulses: u16| (f64::from(pulses) / had).ln().abs();
        choices.min_by(|a, b| far(a.1).total_cmp(&far(b.1))).map(|(choice, _)| choice)
    }

    /// Values that leave this margin.
    fn propose(&self, request: &RampRequest, margin: f64) -> Result<Values, Failure> {
        let failed = |reason: String| {
            Failure::new(format!("no ramp of a {} keeps a margin of {margin:.2}", self.model.title)).because(reason)
        };
        let (slowest, fastest) = self.range(self.objects.profile_velocity);
        if !(slowest as f64..=fastest as f64).contains(&request.speed_rpm) {
            let what = format!("expected a speed from {slowest} to {fastest} r/min, got {}", request.speed_rpm);
            return Err(Failure::usage(what).next("nothing was written"));
        }
        let currents = self.currents();
        let largest_a = currents.last().map_or(0.0, |(_, current)| *current);
        let objects = &self.objects;
        let least = |object: Mux, rpm: f64| self.had(object).min(rpm.floor() as i64).max(self.range(object).0);
        let start = least(objects.start, self.start_rpm(largest_a, margin));
        let (low, high) = self.range(objects.up);
        let shortest = first((low, high), |time_ms| self.margin(largest_a, start, time_ms) >= margin);
        let Some(shortest) = shortest else {
            let (gives, takes) =
                (self.pull_out_nm(largest_a, self.speed_rad_s), self.all.needed_nm(self.speed_rad_s, 0.0));
            let highest = self.highest_rpm(largest_a, margin);
            return Err(failed(format!(
                "at {:.0} r/min the motor gives {gives:.3} N·m at most, and the load takes {takes:.3} N·m without a change of speed; \
                 {high} ms is the longest ramp",
                request.speed_rpm
            ))
            .next(format!("ask for less: the load has that margin up to {highest:.0} r/min, e.g. --speed {highest:.0}rpm")));
        };
        let time_ms = request.ramp.map_or(shortest, |ramp| ramp.as_millis() as i64);
        if !(shortest..=high).contains(&time_ms) {
            return Err(failed(format!(
                "a ramp of {time_ms} ms was asked for; with it from {shortest} to {high} ms do"
            )));
        }
        let fits = |&&(_, current_a): &&(i64, f64)| {
            self.margin(current_a, start, time_ms) >= margin && self.start_rpm(current_a, margin) >= start as f64
        };
        let &(current, current_a) = currents.iter().find(fits).ok_or_else(|| {
            failed(format!("the load is not caught at {start} r/min, the lowest speed with which a motion can begin"))
        })?;
        let (standstill, shares) = self.open_loop.standstill;
        let holds = |share: f64| self.pull_out_nm(share * current_a, 0.0) >= margin * self.all.load_nm.abs();
        let choice_of = |choice: i64| usize::try_from(choice).ok().and_then(|choice| shares.get(choice)).copied();
        let holding = match choice_of(self.had(standstill)) {
            Some(share) if holds(share) => Some(self.had(standstill)),
            _ => (0..).zip(shares).find(|(_, share)| holds(**share)).map(|(choice, _)| choice),
        };
        let holding = holding.ok_or_else(|| failed("no current at standstill holds the load".to_owned()))?;
        let microsteps =
            self.microsteps().ok_or_else(|| failed("no setting of its microsteps is as fast".to_owned()))?;
        let end = least(objects.end, self.start_rpm(current_a, margin));
        Ok(vec![
            (self.open_loop.current, current),
            (standstill, holding),
            (objects.microsteps, microsteps),
            (objects.up, time_ms),
            (objects.down, time_ms),
            (objects.profile_velocity, request.speed_rpm.floor() as i64),
            (objects.start, start),
            (objects.end, end),
        ])
    }

    fn rotor(&self, values: &[(Mux, i64)], request: &RampRequest) -> Rotor {
        let value = |object: Mux| values.iter().find(|(other, _)| *other == object).map_or(0, |(_, value)| *value);
        Rotor {
            model: self.model,
            values: values.to_vec(),
            rotor: self.stepper.rotor,
            all: self.all,
            supply_v: self.supply_v,
            speed_rpm: request.speed_rpm,
            ramp: Duration::from_millis(value(self.objects.up).unsigned_abs()),
            pulses: usize::try_from(value(self.objects.microsteps))
                .ok()
                .and_then(|it| self.objects.pulses.get(it))
                .copied()
                .unwrap_or(1),
            teeth: self.stepper.stepping.windings.teeth,
        }
    }

    /// Values with which the twin keeps in step under a load as many times as large as the margin, and what it lost.
    async fn proved(&self, request: &RampRequest) -> Result<(Values, Vec<TwinRow>, i32), Failure> {
        let mut lost = Vec::new();
        for more in 0..CORRECTIONS {
            let values = self.propose(request, request.margin * CAREFUL.powi(more))?;
            let rotor = self.rotor(&values, request);
            lost = vec![rotor.turned(1.0).await?, rotor.turned(request.margin).await?];
            if lost.iter().any(|row| row.lost_steps != Some(0)) {
                continue;
            }
            for beyond in BEYOND {
                let row = rotor.turned(request.margin * beyond).await?;
                lost.push(row);
                if row.lost_steps != Some(0) {
                    break;
                }
            }
            return Ok((values, lost, more));
        }
        let rows: Vec<String> = lost.iter().map(TwinRow::to_string).collect();
        Err(Failure::new(format!("the twin of a {} loses steps with all that was proposed", self.model.title))
            .because(rows.join(", "))
            .next("ask for less speed or a longer ramp, e.g. --ramp 500ms"))
    }

    fn notes(&self, values: &[(Mux, i64)], more: i32, request: &RampRequest) -> Vec<String> {
        let value = |object: Mux| values.iter().find(|(other, _)| *other == object).map_or(0, |(_, value)| *value);
        let mut notes = vec![
            "torques are by the data that are assumed of its motor, its windings at 105 °C: the manual has no curve of torque over speed".to_owned(),
            "the drive shows no lost step: see on the machine whether its home switch is where it was after some motions".to_owned(),
        ];
        if more > 0 {
            notes.push(format!(
                "the twin lost steps with a shorter ramp: what is proposed has a margin of {:.2} by the torques alone",
                request.margin * CAREFUL.powi(more)
            ));
        }
        let microsteps = self.objects.microsteps;
        if value(microsteps) != self.had(microsteps) {
            notes.push(format!("{microsteps} changes: every position of the drive is counted in other pulses, once the motor has been free"));
        }
        let quick_ms = self.had(self.objects.quick_stop);
        let quick = self.margin(self.current_a(value(self.open_loop.current)), value(self.objects.end), quick_ms);
        if quick < 1.0 {
            notes.push(format!(
                "its quick stop ({}) of {quick_ms} ms needs more torque than there is: it loses steps from that speed, so home again after one",
                self.objects.quick_stop
            ));
        }
        notes
    }
}

/// The first of these numbers for which something is true, which stays true from there on.
fn first((mut low, mut high): (i64, i64), holds: impl Fn(i64) -> bool) -> Option<i64> {
    if !holds(high) {
        return None;
    }
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    Some(low)
}

/// Computes ramps, currents and microsteps of a stepper, and has its twin try them; the drive is only read, and with
/// [`apply`](RampRequest::apply) written as a transaction. It is not turned.
///
/// # Errors
/// What is out of range or cannot be reached; those of the reads and of the transaction.
pub async fn tune_ramps(drive: &Drive, request: &RampRequest, progress: &impl Progress) -> Result<RampReport, Failure> {
    request.check()?;
    let known = Known::of(drive, request).await?;
    let id = drive.node().id();
    progress.show(format!("node {id}: its twin turns"));
    let (values, twin, more) = known.proved(request).await?;
    let value = |object: Mux| values.iter().find(|(other, _)| *other == object).map_or(0, |(_, value)| *value);
    let (current, up, start) = (known.open_loop.current, known.objects.up, known.objects.start);
    let (had_a, current_a) = (known.current_a(known.had(current)), known.current_a(value(current)));
    let largest_a = known.currents().last().map_or(0.0, |(_, current)| *current);
    let name = |object| known.model.row(object).map_or("", |row| row.name);
    let gains = values.iter().map(|(object, after)| Gain {
        object: *object,
        name: name(*object),
        before: known.had(*object),
        after: *after,
    });
    let mut report = RampReport {
        node: id.raw(),
        model: known.model.name,
        supply_v: known.supply_v,
        inertia_kg_m2: known.all.inertia_kg_m2,
        speed_rpm: request.speed_rpm,
        pull_out_nm: known.pull_out_nm(current_a, known.speed_rad_s),
        needed_nm: known.all.needed_nm(known.speed_rad_s, 0.0),
        highest_rpm: known.highest_rpm(largest_a, request.margin),
        start_rpm: known.start_rpm(current_a, request.margin),
        margin: request.margin,
        margin_before: known.margin(had_a, known.had(start), known.had(up)),
        margin_after: known.margin(current_a, value(start), value(up)),
        values: gains.map(|gain| GainRow::from(&gain)).collect(),
        twin,
        applied: false,
        notes: known.notes(&values, more, request),
    };
    if request.apply {
        let mut wanted = Parameters::default();
        wanted.values.extend(values.iter().map(|(object, value)| (*object, bytes(drive, *object, *value))));
        let (journal, within, on_kept) = (request.journal.clone(), request.within, request.on_kept);
        let transaction = Transaction { address: false, save: false, prove: None, within, journal, on_kept };
        let applied = transaction.apply(progress, drive, &wanted, "proposed ramps".to_owned()).await?;
        report.notes.extend(applied.notes);
        report.applied = true;
    }
    Ok(report)
}
