//! The homing methods of 5.3.6, as rows like those of [`cia402::HOMING_METHODS`].
//!
//! Its paragraphs and its labels name opposite directions for all four methods. Method 17 and 18 are not those of CiA 402-2:
//! the limit switch is left, and met again slowly from inside, and the motor stops on it.

use cia402::Direction::{Negative, Positive};
use cia402::HomingSwitch::{Home, NegativeLimit, PositiveLimit};
use cia402::{Direction, HomingMethod, HomingRow, HomingSwitch, SwitchEdge};

/// The directions of the labels: 24 and 29 with the edge of CiA 402-2, which is the negative one of the home switch for both.
#[rustfmt::skip]
pub static BY_LABEL: [HomingRow; 4] = [
    row(17, NegativeLimit, Negative, false, Negative),
    row(18, PositiveLimit, Positive, false, Positive),
    row(24, Home,          Positive, true,  Positive),
    row(29, Home,          Negative, true,  Positive),
];

/// The directions of the paragraphs: 24 meets the home switch slowly in negative direction, at its positive edge.
#[rustfmt::skip]
pub static BY_PROSE: [HomingRow; 4] = [
    row(17, PositiveLimit, Positive, false, Positive),
    row(18, NegativeLimit, Negative, false, Negative),
    row(24, Home,          Negative, true,  Negative),
    row(29, Home,          Positive, true,  Positive),
];

const fn row(
    method: i8,
    switch: HomingSwitch,
    search: Direction,
    reverses_at_limit: bool,
    crossing: Direction,
) -> HomingRow {
    let (method, edge) = (HomingMethod(method), SwitchEdge::Rising);
    HomingRow { method, switch, search, reverses_at_limit, edge, crossing }
}
