//! Digital inputs and outputs by their functions: 2030h of both drives (ZLAC8030L, 5.4 and 5.5; ZLIM42-C, 3.2 and 5.4).

use canopen::od::{Dictionary, Object, Storage};

use crate::engine::axis::Switches;

/// What the inputs say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Signals {
    pub(crate) switches: Switches,
    pub(crate) emergency_stop: bool,
}

/// What the outputs may show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Conditions {
    pub(crate) alarm: bool,
    pub(crate) enabled: bool,
    pub(crate) homing_attained: bool,
    pub(crate) in_position: bool,
}

/// Where a drive's table has the functions of its terminals. A bit of a polarity reverses a terminal.
pub(crate) struct Terminals<const INPUTS: usize> {
    pub(crate) input_polarity: Object<u16>,
    pub(crate) input_functions: [Object<u16>; INPUTS],
    pub(crate) output_polarity: Object<u16>,
    pub(crate) output_functions: [Object<u16>; 2],
}

impl<const INPUTS: usize> Terminals<INPUTS> {
    /// What inputs at these `levels` (bit 0 is X0) say. Several may have one function: any of them acts.
    #[inline]
    pub(crate) fn signals<S: Storage>(&self, values: &Dictionary<S>, levels: u16) -> Signals {
        let active = levels ^ values.get(self.input_polarity);
        let mut signals = Signals::default();
        for (n, function) in self.input_functions.iter().enumerate() {
            let function = if active >> n & 1 == 1 { values.get(*function) } else { 0 };
            match function {
                1 => signals.switches.home = true,
                2 => signals.switches.positive_limit = true,
                3 => signals.switches.negative_limit = true,
                9 => signals.emergency_stop = true,
                _ => {}
            }
        }
        signals
    }

    /// Levels of Y0 and Y1.
    #[inline]
    pub(crate) fn outputs<S: Storage>(&self, values: &Dictionary<S>, now: Conditions) -> [bool; 2] {
        let polarity = values.get(self.output_polarity);
        // Bit n is function n; the tables list functions 0 to 4.
        let active = u32::from(now.alarm) << 1
            | u32::from(now.enabled) << 2
            | u32::from(now.homing_attained) << 3
            | u32::from(now.in_position) << 4;
        let level = |n: u16, function: Object<u16>| {
            let active = active.wrapping_shr(u32::from(values.get(function)));
            (active ^ u32::from(polarity >> n)) & 1 == 1
        };
        let [y0, y1] = self.output_functions;
        [level(0, y0), level(1, y1)]
    }
}
