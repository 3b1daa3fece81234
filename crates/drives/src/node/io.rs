//! Inputs and outputs of a device by CiA 401 (device type 0191h): what its objects do.
//!
//! Lines are counted from 1, eight to a sub-index. [`Io`] holds the levels at the terminals; the objects are the dictionary's. Read so,
//! where the profile leaves it open or makers differ: an error value is taken once, as the node leaves NMT operational or loses its
//! host, and stands in the output's object, until the next write of that; limits and error values of the 16-bit channels (6424h to
//! 6428h, 6444h) are in units of the channel itself. What of the profile is not in [`acts_on`] is not there: writes to it are refused.

use canopen::Mux;
use canopen::od::{Dictionary, Storage};

/// Most lines, and most 16-bit channels either way: so many levels fit one report.
pub(super) const MOST_LINES: u8 = 64;
const MOST_CHANNELS: usize = 32;

const DIGITAL_INPUT: u16 = 0x6000;
const INPUT_POLARITY: u16 = 0x6002;
const INPUT_INTERRUPTS: Mux = Mux::new(0x6005, 0);
const ANY_CHANGE: u16 = 0x6006;
const LOW_TO_HIGH: u16 = 0x6007;
const HIGH_TO_LOW: u16 = 0x6008;
const DIGITAL_OUTPUT: u16 = 0x6200;
const OUTPUT_POLARITY: u16 = 0x6202;
const OUTPUT_ERROR_MODE: u16 = 0x6206;
const OUTPUT_ERROR_VALUE: u16 = 0x6207;
const OUTPUT_FILTER: u16 = 0x6208;
const ANALOGUE_INPUT: u16 = 0x6401;
const ANALOGUE_OUTPUT: u16 = 0x6411;
const TRIGGER_SELECTION: u16 = 0x6421;
const ANALOGUE_INTERRUPTS: Mux = Mux::new(0x6423, 0);
const UPPER_LIMIT: u16 = 0x6424;
const LOWER_LIMIT: u16 = 0x6425;
const DELTA: u16 = 0x6426;
const NEGATIVE_DELTA: u16 = 0x6427;
const POSITIVE_DELTA: u16 = 0x6428;
const ANALOGUE_ERROR_MODE: u16 = 0x6443;
const ANALOGUE_ERROR_VALUE: u16 = 0x6444;

/// Whether [`Io`] does something with an object of the profile.
pub(super) const fn acts_on(mux: Mux) -> bool {
    matches!(
        mux.index,
        DIGITAL_INPUT
            | INPUT_POLARITY
            | 0x6005..=HIGH_TO_LOW
            | DIGITAL_OUTPUT
            | OUTPUT_POLARITY
            | OUTPUT_ERROR_MODE..=OUTPUT_FILTER
            | ANALOGUE_INPUT
            | ANALOGUE_OUTPUT
            | TRIGGER_SELECTION
            | 0x6423..=POSITIVE_DELTA
            | ANALOGUE_ERROR_MODE
            | ANALOGUE_ERROR_VALUE
    )
}

/// The terminals of a device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Io {
    /// Levels at the digital inputs.
    inputs: u64,
    /// Digital outputs as their objects have them, behind 6208h and before 6202h.
    outputs: u64,
    /// The analogue values that were last worth an event.
    sent: [i32; MOST_CHANNELS],
    /// A TPDO on an event is due as far as this profile is asked.
    event: bool,
}

fn value(values: &Dictionary<impl Storage>, index: u16, sub_index: u8) -> Option<i64> {
    values.view().value(Mux::new(index, sub_index)).ok()
}

fn set(values: &mut Dictionary<impl Storage>, index: u16, sub_index: u8, to: i64) {
    if let Ok(slot) = values.table().find(Mux::new(index, sub_index)) {
        let data_type = values.table().row(slot).data_type;
        let (low, high) = data_type.range();
        values.set_raw(slot, data_type.raw(to.clamp(low, high)));
    }
}

/// How many sub-indices of eight lines, or of a channel, an object has.
fn count(values: &Dictionary<impl Storage>, index: u16, most: u8) -> u8 {
    (1..=most).take_while(|sub_index| value(values, index, *sub_index).is_some()).last().unwrap_or(0)
}

const fn byte(levels: u64, sub_index: u8) -> i64 {
    (levels >> (8 * (sub_index - 1)) & 0xFF) as i64
}

const fn with_byte(levels: u64, sub_index: u8, byte: i64) -> u64 {
    let shift = 8 * (sub_index as u32 - 1);
    levels & !(0xFF << shift) | ((byte as u64 & 0xFF) << shift)
}

impl Io {
    /// Nothing at its terminals.
    pub(super) const NONE: Self = Self { inputs: 0, outputs: 0, sent: [0; MOST_CHANNELS], event: false };

    /// Digital inputs of a device, in lines.
    pub(super) fn input_lines(values: &Dictionary<impl Storage>) -> u8 {
        8 * count(values, DIGITAL_INPUT, MOST_LINES / 8)
    }

    /// Digital outputs of a device, in lines.
    pub(super) fn output_lines(values: &Dictionary<impl Storage>) -> u8 {
        8 * count(values, DIGITAL_OUTPUT, MOST_LINES / 8)
    }

    /// Values of the 16-bit channels by their objects: inputs (6401h), then outputs (6411h).
    pub(super) fn analogue(values: &Dictionary<impl Storage>) -> impl Iterator<Item = (Mux, i64)> {
        [ANALOGUE_INPUT, ANALOGUE_OUTPUT].into_iter().flat_map(move |index| {
            (1..=u8::MAX - 1)
                .map_while(move |sub_index| Some((Mux::new(index, sub_index), value(values, index, sub_index)?)))
        })
    }

    /// The firmware starts over: outputs are as their objects have them as delivered, the inputs as they are.
    pub(super) fn restart(&mut self, values: &mut Dictionary<impl Storage>) {
        for sub_index in 1..=MOST_LINES / 8 {
            let output = value(values, DIGITAL_OUTPUT, sub_index).unwrap_or(0);
            self.outputs = with_byte(self.outputs, sub_index, output);
            self.show_inputs(values, sub_index);
        }
        self.event = true;
    }

    /// Levels at the digital inputs, the first line in bit 0.
    pub(super) const fn inputs(&self) -> u64 {
        self.inputs
    }

    /// Levels at the digital outputs, behind their polarity (6202h).
    pub(super) fn output_levels(&self, values: &Dictionary<impl Storage>) -> u64 {
        (1..=Self::output_lines(values) / 8).fold(0, |levels, sub_index| {
            let polarity = value(values, OUTPUT_POLARITY, sub_index).unwrap_or(0);
            with_byte(levels, sub_index, byte(self.outputs, sub_index) ^ polarity)
        })
    }

    /// The level at a digital input has changed; lines count from 0.
    pub(super) fn set_input(&mut self, values: &mut Dictionary<impl Storage>, line: u8, level: bool) {
        let before = self.inputs;
        self.inputs = before & !(1 << line) | u64::from(level) << line;
        self.show_inputs(values, line / 8 + 1);
    }

    /// 6000h: levels behind their polarity (6002h). An event if the changes that are worth one are asked for (6005h to 6008h).
    fn show_inputs(&mut self, values: &mut Dictionary<impl Storage>, sub_index: u8) {
        let Some(before) = value(values, DIGITAL_INPUT, sub_index) else { return };
        let of = |index, absent| value(values, index, sub_index).unwrap_or(absent);
        let now = byte(self.inputs, sub_index) ^ of(INPUT_POLARITY, 0);
        let changed = now ^ before;
        let worth =
            changed & of(ANY_CHANGE, 0xFF) | changed & now & of(LOW_TO_HIGH, 0) | changed & before & of(HIGH_TO_LOW, 0);
        let enabled = values.view().value(INPUT_INTERRUPTS) != Ok(0);
        self.event |= enabled && worth != 0;
        set(values, DIGITAL_INPUT, sub_index, now);
    }

    /// An object that the outer world sets has changed. An analogue input is an event where 6423h allows any and its trigger
    /// (6421h) is met: beyond a limit, or further from what was last sent than a delta.
    pub(super) fn measured(&mut self, values: &Dictionary<impl Storage>, mux: Mux) {
        if mux.index != ANALOGUE_INPUT || mux.sub_index == 0 {
            self.event = true;
            return;
        }
        let Some(now) = value(values, ANALOGUE_INPUT, mux.sub_index) else { return };
        let sent = self.sent.get_mut(usize::from(mux.sub_index - 1));
        let before = sent.as_ref().map_or(now, |sent| i64::from(**sent));
        if values.view().value(ANALOGUE_INTERRUPTS) == Ok(0) || !is_triggered(values, mux.sub_index, before, now) {
            return;
        }
        self.event = true;
        if let Some(sent) = sent {
            // A channel of more bits than 32 counts with its ends.
            *sent = now.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        }
    }

    /// A host wrote to an object.
    pub(super) fn written(&mut self, values: &mut Dictionary<impl Storage>, mux: Mux) {
        self.event = true;
        match mux.index {
            DIGITAL_OUTPUT if (1..=MOST_LINES / 8).contains(&mux.sub_index) => {
                let filter = value(values, OUTPUT_FILTER, mux.sub_index).unwrap_or(0xFF);
                let written = value(values, DIGITAL_OUTPUT, mux.sub_index).unwrap_or(0);
                let output = written & filter | byte(self.outputs, mux.sub_index) & !filter;
                self.outputs = with_byte(self.outputs, mux.sub_index, output);
            }
            INPUT_POLARITY if (1..=MOST_LINES / 8).contains(&mux.sub_index) => self.show_inputs(values, mux.sub_index),
            _ => {}
        }
    }

    /// The node has left NMT operational, or its host is lost: outputs take their error values where
    /// their error mode is 1.
    pub(super) fn fail(&mut self, values: &mut Dictionary<impl Storage>) {
        for sub_index in 1..=MOST_LINES / 8 {
            let mode = value(values, OUTPUT_ERROR_MODE, sub_index);
            let (Some(mode), Some(to)) = (mode, value(values, OUTPUT_ERROR_VALUE, sub_index)) else { continue };
            let output = byte(self.outputs, sub_index) & !mode | to & mode;
            self.outputs = with_byte(self.outputs, sub_index, output);
            set(values, DIGITAL_OUTPUT, sub_index, output);
        }
        for sub_index in 1..=u8::MAX - 1 {
            let Some(mode) = value(values, ANALOGUE_ERROR_MODE, sub_index) else { break };
            if let (1, Some(to)) = (mode, value(values, ANALOGUE_ERROR_VALUE, sub_index)) {
                set(values, ANALOGUE_OUTPUT, sub_index, to);
            }
        }
        self.event = true;
    }

    /// Whether an event is due, once.
    pub(super) const fn take_event(&mut self) -> bool {
        core::mem::replace(&mut self.event, false)
    }
}

/// 6421h: bit 0 above the upper limit, 1 below the lower, 2 changed by more than the delta, 3 fallen, 4 risen by more than theirs.
/// Without the object any change is meant.
fn is_triggered(values: &Dictionary<impl Storage>, sub_index: u8, before: i64, now: i64) -> bool {
    let Some(selection) = value(values, TRIGGER_SELECTION, sub_index) else { return now != before };
    let of = |index| value(values, index, sub_index).unwrap_or(0);
    let bit = |bit: u32, met: bool| selection >> bit & 1 == 1 && met;
    let change = now - before;
    change != 0
        && (bit(0, now > of(UPPER_LIMIT))
            || bit(1, now < of(LOWER_LIMIT))
            || bit(2, change.abs() > of(DELTA))
            || bit(3, -change > of(NEGATIVE_DELTA))
            || bit(4, change > of(POSITIVE_DELTA)))
}
