//! The inputs PU and DIR, in all that they can be: pulses, a clock, levels to be shown.

use super::assumptions::INPUT_DEBOUNCE_PERIODS;
use super::hardware::Sensors;
use super::pulses::{PulseParameters, Pulses};
use crate::engine::inputs::Inputs;

/// What is remembered of the two.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct InputTerminals {
    pulses: Pulses,
    inputs: Inputs<2>,
    /// Level of DIR, and how often it has changed since the time base of the interpolation went on.
    dir: bool,
    dir_changes: u8,
}

impl InputTerminals {
    /// The first look since the start.
    pub(super) fn wake(&mut self, sensors: &Sensors) {
        self.dir = sensors.dir;
    }

    /// Every control period: DIR as a clock.
    pub(super) fn sense(&mut self, sensors: &Sensors) {
        self.dir_changes = self.dir_changes.saturating_add(u8::from(self.dir != sensors.dir));
        self.dir = sensors.dir;
    }

    /// Every supervision period: the levels.
    pub(super) fn debounce(&mut self, sensors: &Sensors) {
        self.inputs.update([sensors.pu, sensors.dir], INPUT_DEBOUNCE_PERIODS);
    }

    /// Every supervision period: encoder counts that the shaft is to move by.
    pub(super) fn count(&mut self, parameters: &PulseParameters, sensors: &Sensors) -> i32 {
        self.pulses.update(parameters, &sensors.pulses)
    }

    /// How often DIR has changed since it was asked for last.
    pub(super) fn take_dir_changes(&mut self) -> u8 {
        core::mem::take(&mut self.dir_changes)
    }

    /// 60FDh: PU is bit 0, DIR bit 1.
    pub(super) fn levels(&self) -> u16 {
        self.inputs.levels()
    }
}
