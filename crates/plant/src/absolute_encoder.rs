//! Absolute encoder on a motor's shaft, with a counter of whole turns that lives on a battery.
//!
//! M-series robot joint manual, "Low-power multi-turn absolute value description": the position within a turn is
//! absolute (15 bits); whole turns, -60000 to 60000, are counted by electronics that the supply feeds and, when it is
//! off, a battery. While the motor has power the battery is charged; without it the battery gives 0.07 mA, and a shaft
//! that is turned wakes the counter. With battery and power both gone the turns are lost: the next power-on finds the
//! position within one turn only, until an origin is set.

use crate::angle::Angle;

/// What never changes about an encoder and its battery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsoluteEncoderModel {
    /// Counts per turn.
    pub counts_per_turn: u32,
    /// Turns that the counter reaches on either side of the origin; beyond, it goes on from the other end.
    pub turn_limit: u32,
    /// What the battery holds when it is full.
    pub battery_capacity_mah: f64,
    /// What the charging circuit gives.
    pub charge_current_ma: f64,
    /// What the counter takes from the battery while the motor has no power.
    pub standby_current_ma: f64,
}

/// How the battery is, as the drive sees it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum BatteryState {
    /// Unplugged, or the wire has come off.
    #[default]
    Disconnected,
    /// Plugged in and not full.
    Charging,
    /// Plugged in and full.
    Full,
}

/// The battery. `connected` may be changed while running.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// It is plugged in.
    pub connected: bool,
    /// What it holds.
    pub charge_mah: f64,
}

/// State of an encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsoluteEncoderData {
    /// The battery.
    pub battery: Battery,
    /// The turns have been lost since the origin was last set.
    pub turns_lost: bool,
    /// Counts from the shaft's own zero to the origin.
    origin_count: i64,
    /// The counter has had power of some kind without a break.
    alive: bool,
}

impl AbsoluteEncoderModel {
    /// An encoder with a full battery whose origin is the shaft's own zero.
    pub fn with_full_battery(&self) -> AbsoluteEncoderData {
        AbsoluteEncoderData {
            battery: Battery { connected: true, charge_mah: self.battery_capacity_mah },
            turns_lost: false,
            origin_count: 0,
            alive: true,
        }
    }

    /// Battery and counter over a stretch of time, at whose end the shaft is at `angle`. May be called seldom: the
    /// position itself is read from the shaft.
    pub fn step(&self, data: &mut AbsoluteEncoderData, dt_s: f64, angle: Angle, powered: bool) {
        let hours = dt_s / 3600.0;
        let battery = &mut data.battery;
        if battery.connected {
            let change_mah = if powered { self.charge_current_ma * hours } else { -self.standby_current_ma * hours };
            battery.charge_mah = (battery.charge_mah + change_mah).max(0.0).min(self.battery_capacity_mah);
        }
        let on_battery = battery.connected && battery.charge_mah > 0.0;
        if !powered && !on_battery {
            data.alive = false;
        }
        if powered && !data.alive {
            let position = angle.count(self.counts_per_turn).wrapping_sub(data.origin_count);
            let within_turn = position.rem_euclid(i64::from(self.counts_per_turn));
            data.origin_count = data.origin_count.wrapping_add(position - within_turn);
            data.turns_lost = true;
            data.alive = true;
        }
    }

    /// Makes the present position the origin; the turns are known again.
    pub fn set_origin(&self, data: &mut AbsoluteEncoderData, angle: Angle) {
        data.origin_count = angle.count(self.counts_per_turn);
        data.turns_lost = false;
    }

    /// Counts from the origin.
    #[inline]
    pub fn position_counts(&self, data: &AbsoluteEncoderData, angle: Angle) -> i32 {
        let position = angle.count(self.counts_per_turn).wrapping_sub(data.origin_count);
        let limit = i64::from(self.turn_limit) * i64::from(self.counts_per_turn);
        if (-limit..limit).contains(&position) {
            return position as i32;
        }
        (position.wrapping_add(limit).rem_euclid(2 * limit) - limit) as i32
    }

    /// How the battery is.
    #[inline]
    pub fn battery_state(&self, data: &AbsoluteEncoderData) -> BatteryState {
        match data.battery {
            Battery { connected: false, .. } => BatteryState::Disconnected,
            Battery { charge_mah, .. } if charge_mah < self.battery_capacity_mah => BatteryState::Charging,
            Battery { .. } => BatteryState::Full,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENCODER: AbsoluteEncoderModel = AbsoluteEncoderModel {
        counts_per_turn: 32_768,
        turn_limit: 60_000,
        battery_capacity_mah: 7.0,
        charge_current_ma: 0.7,
        standby_current_ma: 0.07,
    };
    const HOUR_S: f64 = 3600.0;

    fn at(turns: f64) -> Angle {
        Angle::from_turns(turns)
    }

    #[test]
    fn a_turn_has_32768_counts_and_turns_are_counted_both_ways() {
        let data = ENCODER.with_full_battery();
        assert_eq!(ENCODER.position_counts(&data, at(0.25)), 8_192);
        assert_eq!(ENCODER.position_counts(&data, at(59_999.5)), 59_999 * 32_768 + 16_384);
        assert_eq!(ENCODER.position_counts(&data, at(-60_000.0)), -60_000 * 32_768);
    }

    #[test]
    fn beyond_its_turns_the_counter_goes_on_from_the_other_end() {
        let data = ENCODER.with_full_battery();
        assert_eq!(ENCODER.position_counts(&data, at(60_000.0)), -60_000 * 32_768);
        assert_eq!(ENCODER.position_counts(&data, at(60_001.25)), -59_999 * 32_768 + 8_192);
        assert_eq!(ENCODER.position_counts(&data, at(-60_000.5)), 59_999 * 32_768 + 16_384);
    }

    #[test]
    fn a_shaft_turned_without_power_is_counted_while_the_battery_lives() {
        let mut data = ENCODER.with_full_battery();
        ENCODER.step(&mut data, 10.0 * HOUR_S, at(12.5), false);
        assert!((data.battery.charge_mah - 6.3).abs() < 1e-9);
        ENCODER.step(&mut data, 1.0, at(12.5), true);
        assert_eq!(ENCODER.position_counts(&data, at(12.5)), 12 * 32_768 + 16_384);
        assert!(!data.turns_lost);
    }

    #[test]
    fn an_empty_battery_loses_the_turns_after_capacity_over_current_and_keeps_the_place_in_the_turn() {
        let mut data = ENCODER.with_full_battery();
        // 7 mAh at 0.07 mA: 100 h.
        ENCODER.step(&mut data, 99.9 * HOUR_S, at(12.5), false);
        ENCODER.step(&mut data, 0.001, at(12.5), true);
        assert!(!data.turns_lost);
        ENCODER.step(&mut data, 0.2 * HOUR_S, at(12.5), false);
        ENCODER.step(&mut data, 0.001, at(12.5), true);
        assert!(data.turns_lost);
        assert_eq!(ENCODER.position_counts(&data, at(12.5)), 16_384);
    }

    #[test]
    fn an_unplugged_battery_loses_the_turns_only_when_power_goes_too() {
        let mut data = ENCODER.with_full_battery();
        data.battery.connected = false;
        ENCODER.step(&mut data, 10.0, at(3.25), true);
        assert!(!data.turns_lost);
        assert_eq!(ENCODER.battery_state(&data), BatteryState::Disconnected);
        ENCODER.step(&mut data, 1e-3, at(3.25), false);
        data.battery.connected = true;
        ENCODER.step(&mut data, 1e-3, at(-3.75), true);
        assert!(data.turns_lost);
        assert_eq!(ENCODER.position_counts(&data, at(-3.75)), 8_192);
    }

    #[test]
    fn setting_the_origin_makes_the_position_zero_and_it_survives_a_loss_of_turns() {
        let mut data = ENCODER.with_full_battery();
        data.turns_lost = true;
        ENCODER.set_origin(&mut data, at(7.75));
        assert!(!data.turns_lost);
        assert_eq!(ENCODER.position_counts(&data, at(7.75)), 0);
        data.battery.connected = false;
        ENCODER.step(&mut data, 1.0, at(9.8), false);
        ENCODER.step(&mut data, 1.0, at(9.8), true);
        // 2.05 turns from the origin; only the place in the turn is left.
        assert_eq!(ENCODER.position_counts(&data, at(9.8)), (0.05 * 32_768.0) as i32);
    }

    #[test]
    fn an_empty_battery_charges_in_capacity_over_current_while_there_is_power() {
        let mut data = ENCODER.with_full_battery();
        data.battery.charge_mah = 0.0;
        ENCODER.step(&mut data, 9.9 * HOUR_S, at(0.0), true);
        assert_eq!(ENCODER.battery_state(&data), BatteryState::Charging);
        ENCODER.step(&mut data, 0.2 * HOUR_S, at(0.0), true);
        assert_eq!(ENCODER.battery_state(&data), BatteryState::Full);
        assert_eq!(data.battery.charge_mah, 7.0);
    }
}
