//! Control periods that change nothing need not be computed.
//!
//! A drive that is not enabled, on a shaft that stands and a bus that is charged, comes back to the same state with each round of
//! control periods: same sensors in, same pins out. That is found out by watching one round, not foretold: the firmware says
//! whether all that its ticks read and write is as it was ([`Resting::rests_since`]), the plant whether a step of it changes
//! anything but heat ([`plant::rest`]). From then on only heat is booked, step by step, until a frame or a hand at the machine
//! comes, something is due, or a thermometer reads otherwise. When that will be is foretold by booking ahead, so that the runs of
//! the communication task on the way, which find nothing to do, are left out too: the world hears of a machine at rest only
//! when there is something to hear. Nothing else is left out, so the run stays the same to the last bit; only what it costs
//! does not.

use can::{Instant, Station};
use drives::{Fidelity, Firmware, Resting};

use super::assembly::Assembly;
use super::rest::{LeftOut, Rest, RestWatch};
use super::{Life, Machine, Supply};

/// From the last disturbance, or from a look in vain, to the next look. A look costs as much as some ten control periods.
const LOOK_AGAIN_NS: u64 = 20_000_000;

/// How far ahead it is foretold what the sensors will read.
const FORETOLD_NS: u64 = 100_000_000;

impl<A: Assembly> Machine<A> {
    /// A stimulus acts on the machine: its control periods are computed again. After [`advance`](crate::VirtualDrive::advance).
    #[inline]
    pub(super) fn disturb(&mut self) {
        if self.rest.is_resting() {
            self.wake_up();
        }
        self.rest = Rest::Awake { look_at: self.next_tick.plus_nanos(LOOK_AGAIN_NS) };
    }

    /// The firmware runs on from where its counters of periods would stand by now.
    #[cold]
    fn wake_up(&mut self) {
        let now = std::mem::replace(&mut self.rest, Rest::from(self.next_tick));
        let Rest::Resting(LeftOut { sensors: Some(sensors), periods: left_out, .. }) = now else { return };
        let round = u64::from(A::Firmware::ROUND);
        self.firmware.leave_out_rounds(left_out / round);
        for back in (1..=left_out % round).rev() {
            let at = Instant::from_nanos(self.next_tick.as_nanos() - back * self.period_ns);
            let _ = self.firmware.tick(&sensors, at);
        }
    }

    /// The firmware's own deadline has come, other than that of its communication task, which finds nothing to do.
    #[inline]
    pub(super) fn wake_for_own_event(&mut self, now: Instant) {
        let is_awake = matches!(self.rest, Rest::Awake { .. });
        if !is_awake && self.firmware.next_event().is_some_and(|due| due <= now) {
            self.disturb();
        }
    }

    /// The communication task has run at `now`, and has found nothing to do: when it may find something.
    #[inline]
    pub(super) fn foretell(&mut self, now: Instant) {
        if self.rest.foretold_to().is_some_and(|to| to <= now) {
            self.book_ahead();
        }
    }

    #[cold]
    fn book_ahead(&mut self) {
        let period_ns = self.period_ns;
        let rested = self.assembly.clone().rest(&self.actuation, self.period_s(), FORETOLD_NS / period_ns);
        if let Rest::Resting(resting) = &mut self.rest {
            resting.foretold_to = self.next_tick.plus_nanos(rested.steps * period_ns);
        }
    }

    /// When the firmware has to be asked, if nothing disturbs it before.
    #[inline]
    pub(super) fn firmware_timeout(&self) -> Option<Instant> {
        match self.rest.foretold_to() {
            None if self.fidelity == Fidelity::Mechanical => self.mechanical_timeout(),
            None => self.firmware.poll_timeout(),
            Some(to) => self.firmware.next_event().into_iter().chain(self.firmware.task_from(to)).min(),
        }
    }

    /// Leaves out the control periods up to `now`, or up to the one that finds other readings.
    pub(super) fn rest_until(&mut self, now: Instant) {
        let period_ns = self.period_ns;
        let due = now.nanos_since(self.next_tick) / period_ns + 1;
        let rested = self.assembly.rest(&self.actuation, self.period_s(), due);
        self.next_tick = self.next_tick.plus_nanos(rested.steps * period_ns);
        if let Rest::Resting(resting) = &mut self.rest {
            resting.periods += rested.steps;
        }
        if !rested.same {
            self.disturb();
        }
    }

    /// Time has been brought up to `next_tick`: a look, where it is worth one.
    #[inline]
    pub(super) fn look_for_rest(&mut self) {
        match &self.rest {
            Rest::Awake { look_at } if *look_at > self.next_tick => {}
            Rest::Watching(watch) if !watch.is_over() => {}
            Rest::Resting(_) => {}
            _ => self.look(),
        }
    }

    #[cold]
    fn look(&mut self) {
        let again = Rest::from(self.next_tick.plus_nanos(LOOK_AGAIN_NS));
        let still = !self.kept_awake
            && !self.coupled
            && self.noise.is_none()
            && self.assembly.can_rest(&self.actuation, self.period_s());
        let before = std::mem::replace(&mut self.rest, again);
        // Foretold is nothing yet: the communication task runs once more first.
        let from_now = |sensors| Rest::Resting(LeftOut { sensors, periods: 0, foretold_to: self.next_tick });
        self.rest = match (self.life, self.supply, before) {
            _ if !still => return,
            (Life::Dead, Supply::Off, _) => from_now(None),
            (Life::Running, Supply::On, Rest::Awake { .. }) => {
                Rest::Watching(Box::new(RestWatch::begin(&self.firmware, &self.actuation)))
            }
            (Life::Running, Supply::On, Rest::Watching(watch)) => {
                let Some(sensors) = watch.end(&self.firmware, self.next_tick) else { return };
                from_now(Some(sensors))
            }
            _ => return,
        };
    }
}

#[cfg(test)]
mod tests {
    use can::Bitrate;
    use canopen::NodeId;
    use devices::servo::CIA402;
    use drives::mjoint::Model;

    use super::*;
    use crate::VirtualDrive;
    use crate::machine::{Order, ServoMachine, mjoint, servo, zlac8030l, zlim42c};

    /// When a machine that is switched on, and that is not used, is first found at rest within `limit_s`.
    fn rests_after<A: Assembly>(mut machine: Machine<A>, limit_s: u64) -> Option<f64> {
        machine.set_power(true, Instant::ZERO);
        let mut now = Instant::ZERO;
        while now < Instant::from_secs(limit_s) && !machine.rest.is_resting() {
            now = machine.poll_timeout().unwrap_or(now.plus_nanos(500_000));
            machine.handle_timeout(now);
            while let Some(frame) = machine.poll_transmit() {
                machine.handle_transmitted(&frame, now);
            }
        }
        machine.rest.is_resting().then_some(now.as_nanos() as f64 * 1e-9)
    }

    fn cia402() -> ServoMachine {
        let order = Order::new(&CIA402, NodeId::MIN, Bitrate::M1);
        servo(&CIA402, &order).expect("the standard's own servo")
    }

    #[test]
    fn a_drive_that_is_not_used_is_at_rest_within_seconds() {
        let joint = mjoint(Model::named("m4230e17b50").expect("a model"), 4, Bitrate::M1);
        let found = [
            ("zlac8030l", rests_after(zlac8030l(4, 0), 10)),
            ("m4230e17b50", rests_after(joint, 10)),
            ("zlim42c", rests_after(zlim42c(4, 0), 10)),
            ("cia402", rests_after(cia402(), 10)),
        ];
        assert!(found.iter().all(|(_, after_s)| after_s.is_some()), "{found:?}");
    }
}
