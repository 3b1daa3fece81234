//! An absolute encoder by CiA 406 (device type 0196h): what its objects do with the angle of the shaft that it sits on.
//!
//! ```text
//! raw      = whole steps of the shaft's angle, of 6501h in a turn, round after 6502h turns; 6000h bit 0 turns its sign
//! position = raw * 6001h / 6501h, round after 6002h (6000h bit 2), plus the offset 6509h
//! ```
//!
//! A preset (6003h) makes the present position its value; the offset that follows from it is kept without power. Speed (6030h) is in
//! measuring units a second, held to its type. 6200h, in ms, is the event timer of the first TPDO by another name. Read so: bit 2 is
//! off without 6001h; 6002h that is 0 or more than the disc has is what the disc has. What of the profile is not in [`acts_on`] is
//! not there: writes to it are refused.

use canopen::od::{Condition, Dictionary, Slot, Storage, Table, View};
use canopen::{AbortCode, Mux};

const OPERATING_PARAMETERS: Mux = Mux::new(0x6000, 0);
const UNITS_PER_REVOLUTION: Mux = Mux::new(0x6001, 0);
const TOTAL_RANGE: Mux = Mux::new(0x6002, 0);
const PRESET: Mux = Mux::new(0x6003, 0);
pub(super) const POSITION: Mux = Mux::new(0x6004, 0);
const SPEED: Mux = Mux::new(0x6030, 1);
pub(super) const CYCLIC_TIMER: Mux = Mux::new(0x6200, 0);
const STATUS: Mux = Mux::new(0x6500, 0);
const RESOLUTION: Mux = Mux::new(0x6501, 0);
const REVOLUTIONS: Mux = Mux::new(0x6502, 0);
const OFFSET: Mux = Mux::new(0x6509, 0);

/// 6000h: positions fall where the shaft turns forwards.
const REVERSED: i64 = 1;
/// 6000h: 6001h and 6002h act.
const SCALED: i64 = 1 << 2;

/// A disc without 6501h and 6502h in its table. Guess: the usual 13 and 12 bits.
const DISC: [i64; 2] = [8_192, 4_096];

/// Whether [`Encoder`] does something with an object of the profile.
pub(super) const fn acts_on(mux: Mux) -> bool {
    matches!(mux.index, 0x6000..=0x6004 | 0x6030 | 0x6200 | 0x6500..=0x6502 | 0x6509)
}

/// What is refused beyond the rows: units and ranges that the disc does not have (what a file delivers apart), a preset beyond the
/// range.
pub(super) fn conditions(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    let conditions = [
        (UNITS_PER_REVOLUTION, Condition::Change(units_are_had)),
        (TOTAL_RANGE, Condition::Change(range_is_had)),
        (PRESET, Condition::Check(preset_is_in_range)),
    ];
    conditions.into_iter().filter_map(move |(mux, condition)| Some((table.find(mux).ok()?, condition)))
}

fn between(raw: u32, most: i64) -> Result<(), AbortCode> {
    match i64::from(raw) {
        0 => Err(AbortCode::VALUE_TOO_LOW),
        value if value > most => Err(AbortCode::VALUE_TOO_HIGH),
        _ => Ok(()),
    }
}

fn units_are_had(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    between(raw, Scale::of(*values).steps)
}

fn range_is_had(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let Scale { steps, revolutions, .. } = Scale::of(*values);
    between(raw, steps.saturating_mul(revolutions))
}

fn preset_is_in_range(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let Scale { range, .. } = Scale::of(*values);
    if i64::from(raw) < range { Ok(()) } else { Err(AbortCode::VALUE_TOO_HIGH) }
}

/// How it counts.
#[derive(Clone, Copy, Debug)]
struct Scale {
    /// Of the disc: steps in a turn, and turns that it tells apart.
    steps: i64,
    revolutions: i64,
    reversed: bool,
    /// Measuring units in a turn, and in all.
    units: i64,
    range: i64,
}

impl Scale {
    fn of(values: View<'_>) -> Self {
        let of = |mux, absent| values.value(mux).ok().filter(|value| *value > 0).unwrap_or(absent);
        let (steps, revolutions) = (of(RESOLUTION, DISC[0]), of(REVOLUTIONS, DISC[1]));
        let parameters = values.value(OPERATING_PARAMETERS).unwrap_or(0);
        let most = steps.saturating_mul(revolutions);
        let (units, range) = if parameters & SCALED == 0 {
            (steps, most)
        } else {
            (of(UNITS_PER_REVOLUTION, steps), of(TOTAL_RANGE, most).min(most))
        };
        Self { steps, revolutions, reversed: parameters & REVERSED != 0, units, range }
    }

    /// The position before its offset.
    fn position(&self, turns: f64) -> i64 {
        let turns = if self.reversed { -turns } else { turns };
        // The disc's own steps come first: units that are finer than they are skip values.
        let raw = libm::floor(turns * self.steps as f64);
        let raw = (raw as i64).rem_euclid(self.steps.saturating_mul(self.revolutions));
        let scaled = i128::from(raw) * i128::from(self.units) / i128::from(self.steps);
        (scaled % i128::from(self.range)) as i64
    }
}

/// An encoder on its shaft.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoder {
    /// Angle of the shaft in turns, many turns.
    turns: f64,
    /// Turns a second.
    turns_s: f64,
    /// Added to what the disc says: kept without power.
    offset: i64,
}

impl Encoder {
    /// On a shaft at 0.
    pub(super) const NONE: Self = Self { turns: 0.0, turns_s: 0.0, offset: 0 };

    /// The shaft is there, and turns so.
    pub(super) fn see(&mut self, values: &mut Dictionary<impl Storage>, turns: f64, turns_s: f64) {
        (self.turns, self.turns_s) = (turns, turns_s);
        self.show(values);
    }

    /// What the objects show now.
    pub(super) fn show(&self, values: &mut Dictionary<impl Storage>) {
        let scale = Scale::of(values.view());
        let position = (scale.position(self.turns) + self.offset).rem_euclid(scale.range);
        let direction = if scale.reversed { -1.0 } else { 1.0 };
        let speed = libm::round(self.turns_s * scale.units as f64 * direction) as i64;
        let parameters = values.view().value(OPERATING_PARAMETERS).unwrap_or(0);
        for (mux, value) in [(POSITION, position), (SPEED, speed), (STATUS, parameters), (OFFSET, self.offset)] {
            let Ok(slot) = values.table().find(mux) else { continue };
            let data_type = values.table().row(slot).data_type;
            let (low, high) = data_type.range();
            values.set_raw(slot, data_type.raw(value.clamp(low, high)));
        }
    }

    /// A host wrote to an object.
    pub(super) fn written(&mut self, values: &mut Dictionary<impl Storage>, mux: Mux) {
        if mux == PRESET {
            let preset = values.view().value(PRESET).unwrap_or(0);
            self.offset = preset - Scale::of(values.view()).position(self.turns);
        }
        if acts_on(mux) {
            self.show(values);
        }
    }
}
