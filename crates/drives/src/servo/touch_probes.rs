//! The two touch probes of an axis over their objects.

use canopen::od::{Dictionary, Storage};
use cia402::{TouchProbe, TouchProbeFunction, TouchProbeSource};

use super::slots::AxisSlots;
use super::write;

/// Both channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TouchProbes([TouchProbe; 2]);

impl TouchProbes {
    /// 60B8h was written.
    pub(super) fn set_function(&mut self, object: u16, inputs: [bool; 2]) {
        let functions = TouchProbeFunction::of(object);
        for ((probe, function), input) in self.0.iter_mut().zip(functions).zip(inputs) {
            probe.set_function(function, input && function.source() == TouchProbeSource::Input);
        }
    }

    /// One period: what the inputs say, where the index pulse came, and the position now.
    pub(super) fn update(
        &mut self,
        values: &mut Dictionary<impl Storage>,
        slots: &AxisSlots,
        inputs: [bool; 2],
        position: i64,
        index: Option<i64>,
    ) {
        let objects = [
            [slots.touch_probe_1_positive, slots.touch_probe_1_negative],
            [slots.touch_probe_2_positive, slots.touch_probe_2_negative],
        ];
        for ((probe, [positive, negative]), input) in self.0.iter_mut().zip(objects).zip(inputs) {
            let by_index = probe.source() == TouchProbeSource::IndexPulse;
            let latched = probe.update(if by_index { index.is_some() } else { input });
            if latched.positive {
                write(values, positive, if by_index { index.unwrap_or(position) } else { position });
            }
            if latched.negative {
                write(values, negative, position);
            }
        }
        write(values, slots.touch_probe_status, i64::from(TouchProbe::object(self.0)));
    }
}
