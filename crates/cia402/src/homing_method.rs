//! The homing methods as two tables. Source: CiA 402-2, clause 11.3 (IEC 61800-7-201 has the same numbers).
//!
//! A method looks for a switch, and takes one edge of it, crossed slowly in one direction ([`HOMING_METHODS`], 17 to 30).
//! Methods 1 to 14 do the same, sixteen numbers further on, and go on to the encoder's next index pulse
//! ([`INDEX_METHODS`]). 33 and 34 look for the index pulse alone; 35 and 37 take the position where the shaft is.
//! [`HomingMethod::sequence`] joins the tables. Numbers below 0 are the makers'.

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

/// One method of homing by a switch, as a row of CiA 402-2, clause 11.
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

/// One method that ends at an index pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexRow {
    /// Value of 6098h.
    pub method: HomingMethod,
    /// The method of [`HOMING_METHODS`] whose edge comes first; [`HomingMethod::NONE`] if there is none.
    pub after: HomingMethod,
    /// The direction in which the first index pulse is then taken as home position.
    pub direction: Direction,
}

/// All methods of clause 11.3 with an index pulse; 15 and 16 are reserved there. The pulse is looked for onwards from the
/// edge, in the direction in which the edge was crossed.
#[rustfmt::skip]
pub const INDEX_METHODS: [IndexRow; 16] = [
    index( 1, 17, Positive),
    index( 2, 18, Negative),
    index( 3, 19, Negative),
    index( 4, 20, Positive),
    index( 5, 21, Positive),
    index( 6, 22, Negative),
    index( 7, 23, Negative),
    index( 8, 24, Positive),
    index( 9, 25, Negative),
    index(10, 26, Positive),
    index(11, 27, Positive),
    index(12, 28, Negative),
    index(13, 29, Positive),
    index(14, 30, Negative),
    index(33,  0, Negative),
    index(34,  0, Positive),
];

const fn index(method: i8, after: i8, direction: Direction) -> IndexRow {
    IndexRow { method: HomingMethod(method), after: HomingMethod(after), direction }
}

/// What a method does, in this order; what is not there is left out. Without either the home position is where the shaft
/// is, and nothing moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingSequence {
    /// The edge of a switch.
    pub switch: Option<&'static HomingRow>,
    /// The first index pulse in this direction.
    pub index: Option<Direction>,
}

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

    /// The home position is where the shaft is; the number of the standard's first edition.
    pub const HERE_FORMERLY: Self = Self(35);
    /// The home position is where the shaft is.
    pub const HERE: Self = Self(37);

    /// All methods of the standard, ascending.
    pub fn standard() -> impl Iterator<Item = Self> {
        (1..=37).map(Self).filter(|method| method.sequence().is_some())
    }

    /// What the method does at a switch; `None` if it is not in [`HOMING_METHODS`].
    pub fn row(self) -> Option<&'static HomingRow> {
        const ROWS: &[HomingRow] = &HOMING_METHODS;
        ROWS.iter().find(|row| row.method == self)
    }

    /// What the method does; `None` for numbers that the standard does not define.
    pub fn sequence(self) -> Option<HomingSequence> {
        if let Some(row) = INDEX_METHODS.iter().find(|row| row.method == self) {
            return Some(HomingSequence { switch: row.after.row(), index: Some(row.direction) });
        }
        let here = matches!(self, Self::HERE | Self::HERE_FORMERLY);
        let switch = self.row();
        (here || switch.is_some()).then_some(HomingSequence { switch, index: None })
    }
}

impl Direction {
    /// The opposite direction.
    #[must_use]
    pub const fn reversed(self) -> Self {
        match self {
            Negative => Positive,
            Positive => Negative,
        }
    }

    /// -1 for the negative direction, 1 for the positive one: a factor for speeds.
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
    fn methods_1_to_14_go_on_from_the_edge_of_the_method_16_further_on() {
        for method in 1..=14 {
            let sequence = HomingMethod(method).sequence().unwrap();
            let edge = HomingMethod(method + 16).row().unwrap();
            assert_eq!(sequence, HomingSequence { switch: Some(edge), index: Some(edge.crossing) }, "{method}");
        }
    }

    #[test]
    fn all_methods_of_the_standard_and_no_others_have_a_sequence() {
        let standard = (1..=14).chain(17..=30).chain([33, 34, 35, 37]);
        assert!(HomingMethod::standard().map(|method| method.0).eq(standard.clone()));
        for method in (i8::MIN..=i8::MAX).filter(|number| !standard.clone().any(|method| method == *number)) {
            assert_eq!(HomingMethod(method).sequence(), None, "{method}");
        }
    }

    #[test]
    fn without_a_switch_there_is_the_index_pulse_or_the_place() {
        let index = |direction| Some(HomingSequence { switch: None, index: direction });
        assert_eq!(HomingMethod(33).sequence(), index(Some(Negative)));
        assert_eq!(HomingMethod(34).sequence(), index(Some(Positive)));
        assert_eq!(HomingMethod::HERE.sequence(), index(None));
        assert_eq!(HomingMethod::HERE_FORMERLY.sequence(), index(None));
    }

    #[test]
    fn numbers_without_a_switch_edge_have_no_row() {
        for method in [-1, 0, 1, 16, 31, 33, 35, 37] {
            assert_eq!(HomingMethod(method).row(), None, "{method}");
        }
    }
}
