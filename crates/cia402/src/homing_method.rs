//! The homing methods without index pulse as one table. Source: CiA 402-2, clause 11.3 (methods 17 to 30).
//!
//! A method looks for a switch, and then takes one edge of it, crossed slowly in one direction, as the home position.
//! Methods with an index pulse (1 to 14, 33, 34) and "here" (35, 37) have no switch edge and are not in the table.

/// Homing method, object 6098h. Open: makers have methods of their own below 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct HomingMethod(pub i8);

/// A sense of motion along the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Towards smaller positions.
    Negative,
    /// Towards larger positions.
    Positive,
}

/// The switch that a method is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingSwitch {
    /// At the negative end of travel.
    NegativeLimit,
    /// At the positive end of travel.
    PositiveLimit,
    /// Somewhere between.
    Home,
}

/// What the switch does at the home position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchEdge {
    /// It goes on.
    Rising,
    /// It goes off.
    Falling,
}

/// One method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingRow {
    /// Value of 6098h.
    pub method: HomingMethod,
    /// The switch looked for.
    pub switch: HomingSwitch,
    /// First direction, if the switch is not on already.
    pub search: Direction,
    /// A limit switch met on the search turns it round, instead of ending it.
    pub reverses_at_limit: bool,
    /// The edge that is the home position.
    pub edge: SwitchEdge,
    /// The direction in which that edge is crossed.
    pub crossing: Direction,
}

use Direction::{Negative, Positive};
use HomingSwitch::{Home, NegativeLimit, PositiveLimit};
use SwitchEdge::{Falling, Rising};

/// All methods of clause 11.3 that need no index pulse; 31 and 32 are reserved there. For 19 to 22 the switch reaches to
/// one end of travel.
#[rustfmt::skip]
pub const HOMING_METHODS: [HomingRow; 14] = [
    row(17, NegativeLimit, Negative, false, Falling, Positive),
    row(18, PositiveLimit, Positive, false, Falling, Negative),
    row(19, Home, Positive, false, Falling, Negative),
    row(20, Home, Positive, false, Rising,  Positive),
    row(21, Home, Negative, false, Falling, Positive),
    row(22, Home, Negative, false, Rising,  Negative),
    row(23, Home, Positive, true,  Falling, Negative),
    row(24, Home, Positive, true,  Rising,  Positive),
    row(25, Home, Positive, true,  Rising,  Negative),
    row(26, Home, Positive, true,  Falling, Positive),
    row(27, Home, Negative, true,  Falling, Positive),
    row(28, Home, Negative, true,  Rising,  Negative),
    row(29, Home, Negative, true,  Rising,  Positive),
    row(30, Home, Negative, true,  Falling, Negative),
];

const fn row(
    method: i8,
    switch: HomingSwitch,
    search: Direction,
    reverses_at_limit: bool,
    edge: SwitchEdge,
    crossing: Direction,
) -> HomingRow {
    HomingRow { method: HomingMethod(method), switch, search, reverses_at_limit, edge, crossing }
}

impl HomingMethod {
    /// No method chosen.
    pub const NONE: Self = Self(0);

    /// What the method does; `None` if it is not in [`HOMING_METHODS`].
    pub fn row(self) -> Option<&'static HomingRow> {
        const ROWS: &[HomingRow] = &HOMING_METHODS;
        ROWS.iter().find(|row| row.method == self)
    }
}

impl Direction {
    /// The other one.
    #[must_use]
    pub const fn reversed(self) -> Self {
        match self {
            Negative => Positive,
            Positive => Negative,
        }
    }

    /// -1 or 1.
    pub const fn sign(self) -> i8 {
        match self {
            Negative => -1,
            Positive => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn methods_from_23_on_come_in_mirrored_pairs() {
        // Figure of methods 23 to 30: 27 to 30 are 23 to 26 seen from the other end.
        for method in 23..=26 {
            let (row, mirror) = (HomingMethod(method).row().unwrap(), HomingMethod(method + 4).row().unwrap());
            assert_eq!(row.search, mirror.search.reversed(), "{method}");
            assert_eq!(row.crossing, mirror.crossing.reversed(), "{method}");
            assert_eq!(row.edge, mirror.edge, "{method}");
        }
    }

    #[test]
    fn a_limit_switch_is_left_away_from_its_end() {
        for (method, crossing) in [(17, Positive), (18, Negative)] {
            let row = HomingMethod(method).row().unwrap();
            assert_eq!((row.edge, row.crossing, row.search), (Falling, crossing, crossing.reversed()));
        }
    }

    #[test]
    fn numbers_without_a_switch_edge_have_no_row() {
        for method in [-1, 0, 1, 16, 31, 33, 35, 37] {
            assert_eq!(HomingMethod(method).row(), None, "{method}");
        }
    }
}
