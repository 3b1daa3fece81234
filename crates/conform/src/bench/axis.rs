//! The first axis of a drive: its controlword and statusword, and small motions in its own counts.

use std::time::Duration;

use canopen::Mux;
use cia402::{Controlword, ModeOfOperation, PowerCommand, PowerState, Statusword, next_command};
use devices::{AxisDescription, CountsPerTurn, PowerStyle, Scale};
use master::core::NodeSet;

use super::{Bench, ms};
use crate::finding::{Finding, fail, not_applicable};
use crate::subject::bytes_of;

/// Longest time for a change of state: brakes and contactors take some.
pub(crate) const CHANGE: Duration = Duration::from_secs(2);
/// Longest time for a small motion.
pub(crate) const MOTION: Duration = Duration::from_secs(10);
/// How often the statusword is looked at.
const LOOK: Duration = Duration::from_millis(5);
/// Speed of motions, in r/min of the drive's shaft.
pub(crate) const SPEED_RPM: f64 = 20.0;

impl Bench {
    pub(crate) fn axis(&self) -> Result<&'static AxisDescription, Finding> {
        self.subject.axis().ok_or_else(|| Finding::NotApplicable("the device is not a drive".into()))
    }

    /// Where the first axis has an object of the standard.
    pub(crate) fn place(&self, index: u16) -> Mux {
        self.place_sub(index, 0)
    }

    pub(crate) fn place_sub(&self, index: u16, sub_index: u8) -> Mux {
        let mux = Mux::new(index, sub_index);
        self.subject.axis().map_or(mux, |axis| axis.object(mux))
    }

    pub(crate) async fn statusword(&mut self) -> Result<Statusword, Finding> {
        let data = self.read(self.place(0x6041)).await?;
        match data[..] {
            [low, high] => Ok(Statusword(u16::from_le_bytes([low, high]))),
            _ => fail!("6041h has {} bytes, not two", data.len()),
        }
    }

    /// Writes the controlword; the program remembers that it has moved the axis, so that whatever ends it stops it.
    pub(crate) async fn control(&mut self, word: u16) -> Result<(), Finding> {
        let mux = self.place(0x6040);
        if word & Controlword::ENABLE_OPERATION != 0 {
            self.network.note_moved(self.node(), mux);
        }
        match self.download(mux, &word.to_le_bytes()).await? {
            Ok(()) => Ok(()),
            Err(code) => fail!("6040h does not take {word:04X}h: {code}"),
        }
    }

    pub(crate) async fn command(&mut self, command: PowerCommand) -> Result<(), Finding> {
        self.control(command.controlword().0).await
    }

    /// Waits until the statusword is as wanted.
    pub(crate) async fn until(
        &mut self,
        within: Duration,
        wanted: impl Fn(Statusword) -> bool,
    ) -> Result<Result<Statusword, Statusword>, Finding> {
        let end = self.now() + within;
        loop {
            let word = self.statusword().await?;
            if wanted(word) {
                return Ok(Ok(word));
            }
            if self.now() >= end {
                return Ok(Err(word));
            }
            self.pause(LOOK).await;
        }
    }

    /// Waits for a state of the power state machine.
    pub(crate) async fn expect_power(&mut self, state: PowerState) -> Result<Statusword, Finding> {
        match self.until(CHANGE, |word| word.state() == Some(state)).await? {
            Ok(word) => Ok(word),
            Err(word) => fail!("the statusword is {word}; expected {}", state.name()),
        }
    }

    /// Leads the drive to a state from wherever it is, by the commands that the standard has for it.
    pub(crate) async fn lead_to(&mut self, state: PowerState) -> Result<(), Finding> {
        if !self.leave_fault().await? {
            not_applicable!("the drive is in fault, and a reset does not clear it");
        }
        self.command(PowerCommand::DisableVoltage).await?;
        self.expect_power(PowerState::SwitchOnDisabled).await?;
        let mut at = PowerState::SwitchOnDisabled;
        while at != state {
            let Some(command) = next_command(at) else { fail!("no command leads from {} on", at.name()) };
            self.command(command).await?;
            at = match at {
                PowerState::SwitchOnDisabled => PowerState::ReadyToSwitchOn,
                PowerState::ReadyToSwitchOn => PowerState::SwitchedOn,
                _ => PowerState::OperationEnabled,
            };
            self.expect_power(at).await?;
        }
        Ok(())
    }

    /// Resets a fault, of a drive that is in one. False if it stays.
    pub(crate) async fn leave_fault(&mut self) -> Result<bool, Finding> {
        let states = self.subject.axis().is_some_and(|axis| axis.power == PowerStyle::Cia402);
        if !states || self.statusword().await?.state() != Some(PowerState::Fault) {
            return Ok(true);
        }
        self.control(0).await?;
        self.command(PowerCommand::FaultReset).await?;
        let left = self.until(CHANGE, |word| word.state() != Some(PowerState::Fault)).await?.is_ok();
        self.control(0).await?;
        Ok(left)
    }

    /// Chooses a mode, and waits until it is shown.
    pub(crate) async fn choose(&mut self, mode: ModeOfOperation) -> Result<(), Finding> {
        let axis = self.axis()?;
        self.write(self.place(0x6060), &[mode.0 as u8]).await?;
        let end = self.now() + CHANGE;
        loop {
            let shown = self.number(axis.mode_display).await?;
            if shown == i64::from(mode.0) {
                return Ok(());
            }
            if self.now() >= end {
                fail!("6060h took mode {}, and {} shows {shown}", mode.0, axis.mode_display);
            }
            self.pause(LOOK).await;
        }
    }

    /// Enabled, in a mode, with its set-points at rest.
    pub(crate) async fn enable_in(&mut self, mode: ModeOfOperation) -> Result<(), Finding> {
        self.lead_to(PowerState::SwitchOnDisabled).await?;
        self.choose(mode).await?;
        if mode == ModeOfOperation::PROFILE_VELOCITY {
            self.write(self.place(0x60FF), &[0; 4]).await?;
        }
        self.lead_to(PowerState::OperationEnabled).await
    }

    /// The motor stands and is let go, whatever the case came to.
    pub(crate) async fn let_go(&mut self) -> Vec<String> {
        let nodes: NodeSet = std::iter::once(self.node()).collect();
        let stopped = self.network.stop_moved(nodes).await;
        let mut left: Vec<String> = Vec::new();
        for stop in stopped {
            if let Err(error) = stop.outcome {
                left.push(format!("the motor may still be moving: {error}"));
            }
        }
        // Quick stop active is left by this; elsewhere it changes nothing.
        let _ = self.download(self.place(0x6040), &[0, 0]).await;
        left
    }

    /// Counts of position in a turn of the drive's shaft.
    pub(crate) async fn counts_per_turn(&mut self) -> Result<f64, Finding> {
        Ok(match self.axis()?.units.counts_per_turn {
            CountsPerTurn::Fixed(counts) => counts.into(),
            CountsPerTurn::Object { object, factor } => self.number(object).await? as f64 * f64::from(factor),
            CountsPerTurn::Table { object, counts, default } => {
                let place = self.number(object).await.unwrap_or(default.into());
                counts.get(place as usize).map_or(200.0, |counts| f64::from(*counts))
            }
            CountsPerTurn::Ratio { times, over } => {
                let mut ratio = 1.0;
                for mux in times.into_iter().flatten() {
                    ratio *= self.number(mux).await? as f64;
                }
                for mux in over.into_iter().flatten() {
                    ratio /= (self.number(mux).await? as f64).max(1.0);
                }
                ratio
            }
        })
    }

    /// [`SPEED_RPM`] in counts of 60FFh.
    pub(crate) async fn slow(&mut self) -> Result<i32, Finding> {
        let Some(target) = self.axis()?.units.target_velocity else {
            not_applicable!("the unit of 60FFh is not known")
        };
        let resolution = match self.subject.description.row(target.object).and_then(|row| row.resolution) {
            Some(mux) => (self.number(mux).await? as f64).max(1.0),
            None => 1.0,
        };
        let counts = match target.scale {
            Scale::PerCount(rpm) | Scale::Shaft(rpm) => SPEED_RPM / rpm * resolution,
            Scale::Positions(factor) => SPEED_RPM / 60.0 * self.counts_per_turn().await? / factor,
            Scale::Factors { .. } | Scale::InTime { .. } | Scale::Rated { .. } => {
                not_applicable!("the unit of 60FFh is not known")
            }
        };
        Ok(counts.round() as i32)
    }

    /// The position, in the drive's counts.
    pub(crate) async fn position(&mut self) -> Result<i32, Finding> {
        Ok(self.number(self.place(0x6064)).await? as i32)
    }

    /// Counts that the position changes by within a time.
    pub(crate) async fn travel(&mut self, during: Duration) -> Result<i32, Finding> {
        let before = self.position().await?;
        self.pause(during).await;
        Ok(self.position().await?.wrapping_sub(before))
    }

    /// Waits until the position stays where it is: less than a hundredth of what [`SPEED_RPM`] would be.
    pub(crate) async fn expect_standstill(&mut self) -> Result<(), Finding> {
        let moving = self.counts_per_turn().await? * SPEED_RPM / 60.0 * 0.05;
        let end = self.now() + MOTION;
        loop {
            let travel = self.travel(ms(50)).await?;
            if f64::from(travel.abs()) <= moving * 0.05 + 2.0 {
                return Ok(());
            }
            if self.now() >= end {
                fail!("the position still changes by {travel} counts in 50 ms");
            }
        }
    }

    /// A small target, from where the shaft is: a twentieth of a turn.
    pub(crate) async fn small_step(&mut self) -> Result<i32, Finding> {
        Ok((self.counts_per_turn().await? / 20.0).max(20.0) as i32)
    }

    /// Writes an INTEGER32 of the first axis.
    pub(crate) async fn set(&mut self, index: u16, value: i32) -> Result<(), Finding> {
        let mux = self.place(index);
        let row = self.subject.description.row(mux);
        let data = row.map_or(value.to_le_bytes().to_vec(), |row| bytes_of(row.data_type, value.into()));
        self.write(mux, &data).await
    }
}
