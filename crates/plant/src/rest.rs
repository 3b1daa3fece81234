//! A motor at which nothing happens but heat: nothing turns, no current flows, the bus stays where it is.
//!
//! A step of such a motor changes the book of energies, the warm bodies and what follows from their temperature, and nothing
//! else. So many of them can be done at a fraction of the work, and end where steps end, to the last bit: the same sums in
//! the same order. Whether a motor is one is found by steps, not by rules about what each kind of motor does.

use crate::motor::Motor;
use crate::rig::SLOW_EVERY;
use crate::thermal::reading_c;

/// Whether a motor under these pins is at rest.
pub fn is_at_rest<M: Motor>(motor: &M, dt_s: f64, pins: &M::Pins) -> bool {
    let (mut stepped, mut booked) = (motor.clone(), motor.clone());
    // The slow things are among these steps.
    for _ in 0..=SLOW_EVERY {
        stepped.step(dt_s, pins);
        book(&mut booked, dt_s, pins, 1);
    }
    if stepped != booked || stepped.rig().supply != motor.rig().supply {
        return false;
    }
    booked.rig_and_model().0.clone_from(motor.rig());
    booked == *motor
}

/// What [`rest`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rested {
    /// So many steps.
    pub steps: u64,
    /// After them the sensors read what they read before, and nothing has given way.
    pub same: bool,
}

/// Moves motors that [are at rest](is_at_rest), each under its pins, by so many steps, or by fewer: up to the first at whose
/// end a thermometer reads otherwise or something has given way.
pub fn rest<M: Motor>(motors: &mut [M], dt_s: f64, pins: impl Fn(usize) -> M::Pins, steps: u64) -> Rested {
    let (mut done, mut same) = (0, true);
    while done < steps && same {
        let to_slow = motors.iter().map(|motor| motor.rig().steps_to_slow()).min().unwrap_or(SLOW_EVERY);
        let stretch = (steps - done).min(u64::from(to_slow)) as u32;
        for (number, motor) in motors.iter_mut().enumerate() {
            same &= book(motor, dt_s, &pins(number), stretch);
        }
        done += u64::from(stretch);
    }
    Rested { steps: done, same }
}

/// So many steps, of which at most the last is one with the slow things. False if these have changed what is to be seen.
#[inline]
fn book<M: Motor>(motor: &mut M, dt_s: f64, pins: &M::Pins, steps: u32) -> bool {
    let bleeds = motor.bleeds(pins);
    let (rig, model) = motor.rig_and_model();
    if !rig.book_rest(model, dt_s, bleeds, steps) {
        return true;
    }
    let readings = |motor: &M| {
        let rig = motor.rig();
        (reading_c(rig.winding.temperature_c), reading_c(rig.heat_sink.temperature_c), motor.wear())
    };
    let before = readings(motor);
    motor.step_slow();
    readings(motor) == before
}
