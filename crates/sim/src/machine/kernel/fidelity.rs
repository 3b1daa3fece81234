//! A machine whose power stage follows by itself: its ticks are supervision periods, and its plant takes steps as long.
//!
//! A step is done at the end of its period, under what the tick at its beginning asked for, so that the shaft stands where it is
//! at the time that the world has come to. A coupled machine's is done at its beginning, since what moves all its shafts
//! comes after.

use can::{Instant, Station};
use devices::AxisId;
use drives::{Fidelity, Firmware, Resting};

use super::assembly::Assembly;
use super::rest::Rest;
use super::{Life, Machine};
use crate::{Component, Refused};

impl<A: Assembly> Machine<A> {
    /// From one tick to the next, s.
    #[inline]
    pub(super) fn period_s(&self) -> f64 {
        match self.fidelity {
            Fidelity::Full => A::PERIOD_S,
            Fidelity::Mechanical => self.period_ns as f64 * 1e-9,
        }
    }

    /// Before the drive has power. A noisy one has readings of every control period, which this leaves out.
    pub(super) fn change_fidelity(&mut self, fidelity: Fidelity) -> Result<(), Refused> {
        let refused = |reason| Refused::Fidelity { model: self.assembly.model(), reason };
        if fidelity == self.fidelity {
            return Ok(());
        }
        if A::Firmware::MECHANICAL_PERIODS.is_none() {
            return Err(refused("it has no such form; expected full"));
        }
        if self.life != Life::Dead || self.coupled {
            return Err(refused("it runs; choose the fidelity before the drive has power"));
        }
        if self.noise.is_some() {
            return Err(refused("realism full is noise of each control period; choose one of the two"));
        }
        self.disturb();
        self.fidelity = fidelity;
        self.firmware.set_fidelity(fidelity);
        self.assembly.set_fidelity(fidelity);
        Ok(())
    }

    /// Of a firmware that runs: control periods up to its first tick, and from one to the next.
    fn tick_periods(&self) -> [u64; 2] {
        self.fidelity.tick([1; 2], A::Firmware::MECHANICAL_PERIODS.unwrap_or([1; 2]).map(u64::from))
    }

    /// The period of a coupled machine, which is the same before its firmware runs.
    pub(super) fn period_while_coupled_ns(&self) -> u64 {
        A::Firmware::CONTROL_PERIOD_NS * self.tick_periods()[1]
    }

    /// The period that ends at `at`, and the tick there; of a coupled machine the tick, and the period that begins.
    ///
    /// A firmware starts in the control period in which it would start anyway, and supervises from then on when it would.
    // Apart, so that the frequent caller has the step of a control period inlined.
    #[cold]
    #[inline(never)]
    pub(super) fn tick_mechanical(&mut self, at: Instant) {
        if self.coupled {
            self.period_ns = self.period_while_coupled_ns();
            self.run_firmware(at);
            self.step_long();
            return;
        }
        let ran = self.life == Life::Running;
        self.step_long();
        let [first, periods] = self.tick_periods();
        self.period_ns = A::Firmware::CONTROL_PERIOD_NS * if ran { periods } else { 1 };
        self.run_firmware(at);
        if !ran && self.life == Life::Running {
            self.period_ns = A::Firmware::CONTROL_PERIOD_NS * (first - 1).max(1);
        }
        if self.life != Life::Running {
            self.period_ns = A::Firmware::CONTROL_PERIOD_NS;
        }
    }

    /// The firmware has been started from outside, before its next tick: supervises when it would.
    pub(super) fn wait_for_first_tick(&mut self) {
        if self.fidelity == Fidelity::Mechanical && self.life == Life::Running && !self.coupled {
            let wait_ns = A::Firmware::CONTROL_PERIOD_NS * (self.tick_periods()[0] - 1);
            self.next_tick = self.next_tick.plus_nanos(wait_ns);
            self.period_ns += wait_ns;
        }
    }

    fn run_firmware(&mut self, at: Instant) {
        let ran = self.life == Life::Running;
        if !self.is_settled() {
            self.watch_supply(at);
        }
        if !(ran || self.coupled) || self.life != Life::Running {
            return;
        }
        let levels = self.inputs.levels(|axis| self.assembly.shaft_counts(axis));
        let mut sensors = self.assembly.sense(levels);
        self.assembly.add_followed(&mut sensors);
        let next = self.firmware.tick(&sensors, at);
        if let Rest::Watching(watch) = &mut self.rest {
            watch.note(&sensors, &next);
        }
        self.actuation = next;
    }

    /// When the firmware has to be asked: with the first run of its communication task after the tick behind the next one. The runs before it, which
    /// find nothing to do, are left out; what a tick has to send, such as EMCY, goes out with the next one.
    #[cold]
    #[inline(never)]
    pub(super) fn mechanical_timeout(&self) -> Option<Instant> {
        if !self.firmware.task_is_idle() {
            return self.firmware.poll_timeout();
        }
        let task = self.firmware.task_from(self.next_tick.plus_nanos(self.period_ns));
        self.firmware.next_event().into_iter().chain(task).min()
    }

    fn step_long(&mut self) {
        let dt_s = self.period_s();
        self.assembly.step_long(&self.firmware, &self.actuation, dt_s);
    }

    /// Breaks or mends a component; what shows within a control period only is refused where none is computed.
    pub(super) fn set_fault(&mut self, axis: AxisId, component: Component, broken: bool) -> Result<(), Refused> {
        if self.fidelity == Fidelity::Mechanical && broken && matches!(component, Component::Phase | Component::Short) {
            return Err(Refused::NotShown { model: self.assembly.model() });
        }
        self.assembly.set_fault(axis, component, broken)
    }
}
