//! Limits that loops share.

use crate::frames::Dq;

/// Shortens a voltage vector to a circle: the d axis keeps its part first (it holds the field), q gets the rest.
#[inline]
pub fn circle(wanted: Dq, radius: f32) -> Dq {
    let radius = radius.max(0.0);
    let d = wanted.d.clamp(-radius, radius);
    let room = radius * radius - d * d;
    if wanted.q * wanted.q <= room {
        return Dq { d, q: wanted.q };
    }
    Dq { d, q: libm::sqrtf(room.max(0.0)).copysign(wanted.q) }
}

/// Holds a value to `-limit..=limit`; a limit that is negative or not a number holds it to zero.
#[inline]
pub fn symmetric(value: f32, limit: f32) -> f32 {
    let limit = limit.max(0.0);
    value.clamp(-limit, limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_circle_keeps_what_fits_and_shortens_q_first() {
        assert_eq!(circle(Dq { d: 3.0, q: -4.0 }, 5.0), Dq { d: 3.0, q: -4.0 });
        assert_eq!(circle(Dq { d: -3.0, q: 9.0 }, 5.0), Dq { d: -3.0, q: 4.0 });
        assert_eq!(circle(Dq { d: 7.0, q: 1.0 }, 5.0), Dq { d: 5.0, q: 0.0 });
        assert_eq!(circle(Dq { d: 1.0, q: 1.0 }, -1.0), Dq { d: 0.0, q: 0.0 });
    }

    #[test]
    fn a_limit_that_is_no_number_holds_to_zero() {
        assert_eq!(symmetric(3.0, f32::NAN), 0.0);
        assert_eq!(symmetric(-3.0, 2.0), -2.0);
    }
}
