//! A drive with a master of its own, for importers that have no bus: targets come in as numbers, actual values go out.
//!
//! Drive and master are joined by a bus of their own, with all that belongs to one: boot-up, SDO, PDOs at each SYNC, the drive's watch
//! over its master. The master is the project's own ([`master`]); what it does with the inputs is in `lead`.

mod lead;

use std::path::Path;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::{Bitrate, Instant};
use master::{Drive, Network};
use sim::machine::{TimingMode, order};
use sim::task::Task;
use sim::{CoupledShaft, Coupling, Given, Place, Report, Rule, VirtualDrive, World};
use words::drive::DriveSpec;

use crate::config::{AxisConfig, ConfigError, TargetKind, bitrate};
use crate::joint;
use crate::surroundings::{Surroundings, measured};
use crate::variable::{Causality, Reference, Value, Variable};
use lead::{Led, Shared, lead, mode_of};

const SYNC_PERIOD: Reference = 7;
const ENABLE: Reference = 20;
const STOP: Reference = 21;
const RESET_FAULT: Reference = 22;
const TARGET: Reference = 23;
const LED: Reference = 400;

/// The shortest and the longest period of SYNC, s.
const PERIODS_S: std::ops::RangeInclusive<f64> = 0.000_5..=1.0;

/// The row of what the master says: name, unit, what it is, and where it is.
type LedRow = (&'static str, &'static str, &'static str, fn(&Led) -> Value);

/// What is read of every master, behind the drive's own.
const SAID: [LedRow; 3] = [
    ("ready", "", "the master has set the drive up and hears it", |it| Value::Boolean(it.ready)),
    ("follows", "", "the drive has power and follows its target", |it| Value::Boolean(it.follows)),
    ("refusal", "", "why it does not; empty while it follows or is not to", |it| Value::String(it.refusal.to_string())),
];
const POSITION: LedRow =
    ("actual_position", "rad", "position by the drive's TPDO, at its output", |it| Value::Float64(it.position_rad));
const VELOCITY: LedRow =
    ("actual_velocity", "rad/s", "speed by the drive's TPDO, at its output", |it| Value::Float64(it.velocity_rad_s));
const CURRENT: LedRow = ("actual_current", "A", "motor current by the drive's TPDO", |it| Value::Float64(it.current_a));

/// A drive and its master.
pub struct AxisUnit {
    spec: DriveSpec,
    kind: TargetKind,
    bitrate: Bitrate,
    rule: Rule,
    /// Until time begins.
    idle: Box<dyn VirtualDrive>,
    surroundings: Surroundings,
    period_s: f64,
    shared: Arc<Mutex<Shared>>,
    live: Option<Live>,
    report: Report,
    /// When the report was taken, to be taken again when it is asked for later.
    looked_at: Option<Instant>,
    now: Instant,
}

/// Drive and master on their bus.
struct Live {
    world: World,
    task: Task<Pin<Box<dyn Future<Output = ()> + Send>>>,
}

impl AxisUnit {
    /// The drive without power.
    ///
    /// # Errors
    /// What of it is not known, or that it has no mode for such a target.
    pub fn new(config: &AxisConfig, resources: &Path) -> Result<Self, ConfigError> {
        let spec = config.drive.spec(resources)?;
        if spec.unconfigured {
            return Err(ConfigError::Drive("a drive that waits for LSS cannot be led; give it a node-ID".to_owned()));
        }
        if mode_of(spec.description(), config.mode).is_none() {
            return Err(ConfigError::NoMode(spec.model.name, config.mode.word()));
        }
        Self::of(spec, config.mode, bitrate(config.drive.bitrate)?, config.drive.rule)
    }

    fn of(spec: DriveSpec, kind: TargetKind, bitrate: Bitrate, rule: Rule) -> Result<Self, ConfigError> {
        let ordered = order(spec.model, &spec.order(bitrate));
        let idle = ordered.map_err(|error| ConfigError::Drive(error.to_string()))?;
        let surroundings = Surroundings::of(&*idle, rule).map_err(|error| ConfigError::Drive(error.to_string()))?;
        let report = idle.report();
        let (live, looked_at, now) = (None, None, Instant::ZERO);
        let (period_s, shared) = (0.002, Arc::default());
        Ok(Self { spec, kind, bitrate, rule, idle, surroundings, period_s, shared, live, report, looked_at, now })
    }

    /// One like this before anything was done to it.
    pub(crate) fn anew(&self) -> Self {
        let Ok(anew) = Self::of(self.spec.clone(), self.kind, self.bitrate, self.rule) else {
            unreachable!("it was made of the same")
        };
        anew
    }

    /// Its variables.
    pub fn variables(&self) -> Vec<Variable> {
        use Causality::{Input, Output, Parameter};
        let (target, unit, what) = match self.kind {
            TargetKind::Velocity => ("target_velocity", "rad/s", "speed that the drive is to have at its output"),
            TargetKind::Position => {
                ("target_position", "rad", "where the drive's position is to be, the next point of a path")
            }
            TargetKind::Torque => ("target_current", "A", "motor current that the drive is to have"),
        };
        let stop = "quick stop; after it the drive moves again when enable has been false";
        let reset = "reset a fault while true; after it the drive moves again when enable has been false";
        let enable = "power and motion; the drive is brought to rest and switched off when it becomes false";
        let period = "time from SYNC to SYNC, 0.0005 to 1: how often the drive gets its target";
        let mut rows = vec![
            Variable::new(SYNC_PERIOD, "sync_period", Parameter, Value::Float64(0.002), period).in_unit("s"),
            Variable::new(ENABLE, "enable", Input, Value::Boolean(false), enable),
            Variable::new(STOP, "stop", Input, Value::Boolean(false), stop),
            Variable::new(RESET_FAULT, "reset_fault", Input, Value::Boolean(false), reset),
            Variable::new(TARGET, target, Input, Value::Float64(0.0), what).in_unit(unit),
        ];
        rows.extend(self.surroundings.variables(&*self.idle, &self.report));
        let rest = Led::default();
        for (reference, (name, unit, what, read)) in (LED..).zip(self.said()) {
            rows.push(Variable::new(reference, name, Output, read(&rest), what).in_unit(unit));
        }
        rows
    }

    /// What the master says with this kind of target: other values are not in the drive's TPDO.
    fn said(&self) -> impl Iterator<Item = LedRow> {
        let mapped: &[LedRow] = match self.kind {
            TargetKind::Position => &[POSITION],
            TargetKind::Velocity | TargetKind::Torque => &[VELOCITY, CURRENT],
        };
        SAID.into_iter().chain(mapped.iter().copied())
    }

    /// Reads a variable as of now.
    pub fn get(&mut self, reference: Reference) -> Option<Value> {
        let wishes = self.shared().wishes;
        Some(match reference {
            SYNC_PERIOD => Value::Float64(self.period_s),
            ENABLE => Value::Boolean(wishes.enable),
            STOP => Value::Boolean(wishes.stop),
            RESET_FAULT => Value::Boolean(wishes.reset_fault),
            TARGET => Value::Float64(wishes.target),
            LED.. => self.said().nth((reference - LED) as usize)?.3(&self.shared().led),
            joint::TORQUE if self.surroundings.joint.is_some() => Value::Float64(self.torque_nm()),
            _ => match self.surroundings.get(reference, &self.report) {
                None => measured(reference, self.seen())?,
                Some(known) => known,
            },
        })
    }

    /// Whether [`set`](Self::set) would take it.
    ///
    /// # Errors
    /// As there.
    pub fn check(&self, reference: Reference, value: &Value) -> Result<(), String> {
        match value {
            Value::Float64(period_s) if reference == SYNC_PERIOD && !PERIODS_S.contains(period_s) => {
                let (least, most) = (PERIODS_S.start(), PERIODS_S.end());
                Err(format!("a period of SYNC is {least} s to {most} s, not {period_s} s"))
            }
            _ => self.surroundings.check((reference, value)),
        }
    }

    /// Writes a parameter or an input. Of the master's it acts from the next SYNC on, of the drive's surroundings from now on.
    ///
    /// # Errors
    /// What the drive does not take, a period that cannot be.
    pub fn set(&mut self, reference: Reference, value: &Value) -> Result<(), String> {
        match (reference, value) {
            (SYNC_PERIOD, Value::Float64(period_s)) => {
                self.check(reference, value)?;
                self.period_s = *period_s;
            }
            (ENABLE, Value::Boolean(enable)) => self.shared().wishes.enable = *enable,
            (STOP, Value::Boolean(stop)) => self.shared().wishes.stop = *stop,
            (RESET_FAULT, Value::Boolean(reset)) => self.shared().wishes.reset_fault = *reset,
            (TARGET, Value::Float64(target)) => self.shared().wishes.target = *target,
            _ => self.set_surroundings((reference, value))?,
        }
        Ok(())
    }

    fn set_surroundings(&mut self, variable: (Reference, &Value)) -> Result<(), String> {
        let Some(live) = &mut self.live else {
            return self.surroundings.set(variable, &mut *self.idle, false, self.now);
        };
        self.looked_at = None;
        let (number, was_on) = (self.spec.node.raw(), self.surroundings.supply_on);
        let surroundings = &mut self.surroundings;
        let set = live.world.with_drive(number, |drive, now| surroundings.set(variable, drive, false, now));
        set.map_err(|error| error.to_string())??;
        if surroundings.supply_on != was_on {
            live.world.set_power(number, surroundings.supply_on).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Time begins: the drive gets its power, and its master waits for it to boot.
    ///
    /// # Errors
    /// Its shaft cannot be taken over, as is known before.
    pub fn begin(&mut self) -> Result<(), String> {
        let mut world = World::new(self.bitrate, self.surroundings.seed);
        world.set_timing(self.spec.timing.unwrap_or(TimingMode::Device));
        let network = Network::new();
        world.add_station(network.clone());
        let number = self.spec.node.raw();
        world.add_drive(number, self.idle.clone()).map_err(|error| error.to_string())?;
        if !self.surroundings.supply_on {
            world.set_power(number, false).map_err(|error| error.to_string())?;
        }
        if let Some(joint) = &mut self.surroundings.joint {
            let shaft = CoupledShaft::direct(Place::node(number));
            let coupled = world.couple("external", &Coupling::External(joint.model()), &[shaft]);
            coupled.map_err(|error| error.to_string())?;
            world.next_external_period().into_iter().for_each(|period| joint.begin(period));
        }
        let drive = Drive::new(network.node(self.spec.node), self.spec.description());
        let period = Duration::from_secs_f64(self.period_s);
        let task = Task::new(Box::pin(lead(drive, self.kind, period, Arc::clone(&self.shared))) as Pin<Box<_>>);
        self.live = Some(Live { world, task });
        self.looked_at = None;
        Ok(())
    }

    /// Whether time may pass up to `to` in one step.
    ///
    /// # Errors
    /// The importer moves the joint, and it cannot be where it was said to be; or the step is too long for that.
    pub fn check_step(&mut self, to: Instant) -> Result<(), String> {
        let (Some(live), Some(joint)) = (&mut self.live, &self.surroundings.joint) else { return Ok(()) };
        let Some((dt, angle, velocity)) = joint.exchange(self.now, to) else { return Ok(()) };
        live.world.check_exchange(dt, Given::Motion(&angle, &velocity)).map_err(|error| error.to_string())
    }

    /// Lets time pass up to `to`.
    ///
    /// # Errors
    /// As of [`check_step`](Self::check_step); no time passes then.
    pub fn advance(&mut self, to: Instant) -> Result<(), String> {
        if let Some(live) = &mut self.live {
            if let Some(joint) = &self.surroundings.joint
                && let Some((dt, angle, velocity)) = joint.exchange(self.now, to)
            {
                let begun = live.world.begin_exchange(dt, Given::Motion(&angle, &velocity));
                begun.map_err(|error| error.to_string())?;
            }
            live.run_until(to);
        }
        self.now = to;
        Ok(())
    }

    pub(crate) const fn counts_steps(&self) -> bool {
        self.surroundings.joint.is_some()
    }

    /// Of the drive at its joint, the mean of the last step.
    fn torque_nm(&mut self) -> f64 {
        let mut torque_nm = [0.0];
        if let Some(live) = &mut self.live {
            live.world.read_torques(&mut torque_nm);
        }
        torque_nm[0]
    }

    /// Looks at it now. True if that changed when something next happens.
    pub fn look(&mut self) -> bool {
        let next = |it: &Self| it.live.as_ref().and_then(|live| live.world.next_event());
        let before = next(self);
        self.seen();
        before != next(self)
    }

    /// What can be measured now.
    fn seen(&mut self) -> &Report {
        if self.looked_at != Some(self.now)
            && let Some(live) = &mut self.live
            && let Ok(report) = live.world.report(self.spec.node.raw())
        {
            (self.looked_at, self.report) = (Some(self.now), report);
        }
        &self.report
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Live {
    fn run_until(&mut self, to: Instant) {
        self.world.refresh();
        loop {
            if self.task.poll_if_woken().is_some() {
                self.world.refresh();
            } else if self.world.next_event().is_some_and(|at| at <= to) {
                self.world.step();
            } else {
                break;
            }
        }
        self.world.run_until(to);
    }
}
