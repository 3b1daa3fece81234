//! What a controller sends to a drive's pulse inputs, and the timers behind them.

use drives::mjoint::pulses::PulseInput;

use crate::machine::kernel::quantity::QuantityRange;
use crate::{PulseTrain, Refused};

/// Highest input frequency ("Maximum input pulse frequency 500 KHz").
const FREQUENCY: QuantityRange =
    QuantityRange { what: "frequency", expected: "above 0 to 500000 Hz", least: f64::MIN_POSITIVE, greatest: 500e3 };
const DUTY_CYCLE: QuantityRange =
    QuantityRange { what: "duty cycle", expected: "0 to 100 %", least: 0.0, greatest: 100.0 };
/// Of a clock's level: at most one in a control period, which is how often the drive looks at DIR.
const CHANGES: QuantityRange =
    QuantityRange { what: "changes of level", expected: "0 to 20000 Hz", least: 0.0, greatest: 20e3 };

/// A pulse generator wired to PU and DIR.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PulseSource {
    train: Option<PulseTrainState>,
    input: PulseInput,
    /// Level of DIR while it is a clock.
    dir: Option<bool>,
}

#[derive(Clone, Copy, Debug)]
struct PulseTrainState {
    train: PulseTrain,
    /// Pulses or counts sent, with the share of the one under way.
    sent: f64,
}

impl PulseSource {
    /// Begins to send; what was being sent ends.
    pub(super) fn start(&mut self, train: PulseTrain) -> Result<(), Refused> {
        match train {
            PulseTrain::Pulses { hz, .. } | PulseTrain::Quadrature { hz, .. } => {
                FREQUENCY.check(hz)?;
            }
            PulseTrain::Clock(hz) => {
                CHANGES.check(hz)?;
            }
            PulseTrain::Duty(percent) => {
                let percent = DUTY_CYCLE.check(percent)?;
                (self.train, self.dir) = (None, None);
                self.input.duty = Some(percent as f32 / 100.0);
                return Ok(());
            }
        }
        self.input.duty = None;
        self.dir = matches!(train, PulseTrain::Clock(_)).then_some(false);
        self.train = Some(PulseTrainState { train, sent: 0.0 });
        Ok(())
    }

    pub(super) fn read(&self) -> PulseInput {
        self.input
    }

    /// Nothing is being sent: what the drive reads stays as it is.
    pub(super) const fn is_idle(&self) -> bool {
        self.train.is_none()
    }

    /// Level that it gives DIR, if it does.
    pub(super) fn dir(&self) -> Option<bool> {
        self.dir
    }

    /// Time goes on.
    #[inline]
    pub(super) fn advance(&mut self, dt_s: f64) {
        let Some(running) = self.train.as_mut() else { return };
        let (count, hz) = match running.train {
            PulseTrain::Pulses { count, hz } | PulseTrain::Quadrature { count, hz } => (count, hz),
            PulseTrain::Clock(hz) => {
                running.sent = (running.sent + hz * dt_s) % 2.0;
                self.dir = Some(running.sent >= 1.0);
                return;
            }
            PulseTrain::Duty(_) => return,
        };
        let before = running.sent;
        running.sent = (before + hz * dt_s).min(count.unsigned_abs() as f64);
        let sent = running.sent;
        // The timers count down while DIR conducts, or while PU comes after it.
        let step = |from: f64, to: f64| (to.floor() - from.floor()) as i64 * count.signum();
        let add = |counter: u16, by: i64| counter.wrapping_add(by as u16);
        if let PulseTrain::Quadrature { .. } = running.train {
            self.input.quadrature = add(self.input.quadrature, step(before, sent));
        } else {
            // A pulse is up in the second half of its period.
            self.input.rises = add(self.input.rises, step(before + 0.5, sent + 0.5));
            self.input.falls = add(self.input.falls, step(before, sent));
        }
        if sent >= count.unsigned_abs() as f64 {
            self.train = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(train: PulseTrain, s: f64) -> PulseInput {
        let mut source = PulseSource::default();
        source.start(train).expect("a train that can be sent");
        (0..(s / 50e-6) as u32).for_each(|_| source.advance(50e-6));
        source.read()
    }

    #[test]
    fn exactly_as_many_pulses_are_sent_at_the_frequency_asked_for() {
        for (count, hz) in [(8192, 10_000.0), (-777, 123.4), (60_000, 500e3)] {
            let all = run(PulseTrain::Pulses { count, hz }, count.abs() as f64 / hz + 0.01);
            assert_eq!((all.rises, all.falls), (count as u16, count as u16), "{count}");
        }
        let half = run(PulseTrain::Pulses { count: 8192, hz: 10_000.0 }, 0.4096);
        assert!((4095..=4097).contains(&half.falls), "{}", half.falls);
        assert_eq!(run(PulseTrain::Quadrature { count: -400, hz: 1e3 }, 1.0).quadrature, -400_i16 as u16);
        assert_eq!(run(PulseTrain::Duty(40.0), 0.1).duty, Some(0.4));
    }

    #[test]
    fn a_clock_changes_the_level_of_dir_as_often_as_asked_for_until_something_else_is_sent() {
        let mut source = PulseSource::default();
        source.start(PulseTrain::Clock(10_000.0)).expect("a clock");
        let mut changes = 0;
        for _ in 0..20_000 {
            let before = source.dir();
            source.advance(50e-6);
            changes += u32::from(source.dir() != before);
        }
        assert!((9_999..=10_001).contains(&changes), "{changes} in a second");
        assert_eq!(source.read(), PulseInput::default());
        source.start(PulseTrain::Duty(10.0)).expect("a duty cycle");
        assert_eq!(source.dir(), None);
    }

    #[test]
    fn what_no_generator_can_send_is_refused() {
        let mut source = PulseSource::default();
        for train in [
            PulseTrain::Pulses { count: 1, hz: 500_001.0 },
            PulseTrain::Pulses { count: 1, hz: 0.0 },
            PulseTrain::Quadrature { count: 1, hz: -1.0 },
            PulseTrain::Duty(101.0),
            PulseTrain::Clock(20_001.0),
        ] {
            assert!(source.start(train).is_err(), "{train:?}");
        }
    }
}
