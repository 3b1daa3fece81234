use canopen::Mux;

use crate::placement::Placement;

/// What raw values are worth. A field is `None` where the axis has no such object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Counts of position in one turn of the drive's shaft.
    pub counts_per_turn: CountsPerTurn,
    /// Target velocity, in r/min.
    pub target_velocity: Option<Quantity>,
    /// Actual velocity, in r/min.
    pub actual_velocity: Option<Quantity>,
    /// Profile velocity of position moves, in r/min.
    pub profile_velocity: Option<Quantity>,
    /// Acceleration and deceleration of profiles.
    pub ramps: Option<Ramps>,
    /// Target motor current (torque), in A.
    pub target_current: Option<Quantity>,
    /// Actual motor current, in A.
    pub actual_current: Option<Quantity>,
    /// Bus voltage, in V.
    pub bus_voltage: Option<Quantity>,
    /// Motor temperature, in degC.
    pub motor_temperature: Option<Quantity>,
    /// Driver temperature, in degC.
    pub driver_temperature: Option<Quantity>,
}

impl Units {
    pub(crate) const fn placed(self, placement: Placement) -> Self {
        Self {
            counts_per_turn: self.counts_per_turn.placed(placement),
            target_velocity: placed(self.target_velocity, placement),
            actual_velocity: placed(self.actual_velocity, placement),
            profile_velocity: placed(self.profile_velocity, placement),
            ramps: match self.ramps {
                Some(ramps) => Some(ramps.placed(placement)),
                None => None,
            },
            target_current: placed(self.target_current, placement),
            actual_current: placed(self.actual_current, placement),
            bus_voltage: placed(self.bus_voltage, placement),
            motor_temperature: placed(self.motor_temperature, placement),
            driver_temperature: placed(self.driver_temperature, placement),
        }
    }
}

const fn placed(quantity: Option<Quantity>, placement: Placement) -> Option<Quantity> {
    match quantity {
        Some(quantity) => Some(quantity.placed(placement)),
        None => None,
    }
}

const fn place_some(mux: Option<Mux>, placement: Placement) -> Option<Mux> {
    match mux {
        Some(mux) => Some(placement.place(mux)),
        None => None,
    }
}

/// An object that holds a physical value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Where it is.
    pub object: Mux,
    /// What one count of it is worth, at a resolution of 1 where the object's row has one
    /// ([`Entry::resolution`](canopen::od::Entry::resolution)).
    pub scale: Scale,
}

impl Quantity {
    /// An object and its scale: physical units in one count.
    pub const fn new(index: u16, sub_index: u8, per_count: f64) -> Self {
        Self { object: Mux::new(index, sub_index), scale: Scale::PerCount(per_count) }
    }

    /// An object that holds a speed of the drive's shaft, and how many r/min one count is.
    pub const fn speed(index: u16, sub_index: u8, rpm: f64) -> Self {
        Self { object: Mux::new(index, sub_index), scale: Scale::Shaft(rpm) }
    }

    pub(crate) const fn placed(self, placement: Placement) -> Self {
        Self { object: placement.place(self.object), scale: self.scale.placed(placement) }
    }
}

/// What one count of an object is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// This many physical units.
    PerCount(f64),
    /// This many r/min of the drive's shaft, or (r/min)/s. What it is of the machine depends on the gear behind the shaft.
    Shaft(f64),
    /// This many counts of position, for each second or each second squared: velocities and accelerations as CiA 402-2 has
    /// them in the absence of other units. Its physical unit is r/min, or (r/min)/s.
    Positions(f64),
    /// This many r/min of the drive's shaft: the product of some objects over the product of others, of which one that is 0
    /// counts as 1 (CiA 402-2, velocity mode: 604Bh and 604Ch).
    Factors {
        /// Those that multiply.
        times: [Option<Mux>; 2],
        /// Those that divide.
        over: [Option<Mux>; 2],
    },
    /// A change of the shaft's speed by this factor, in the time that the object's next sub-index has in seconds: together
    /// (r/min)/s (CiA 402-2, velocity mode: 6048h, 6049h and 604Ah with the factor 604Ch). A time of 0 is at once.
    InTime {
        /// What multiplies.
        times: Option<Mux>,
        /// What divides.
        over: Option<Mux>,
    },
    /// This many physical units times the value of another object: a share of something rated (CiA 402-2, torque in
    /// thousandths of 6076h).
    Rated {
        /// The rated value.
        rated: Mux,
        /// Physical units in one count at a rated value of 1.
        per_count: f64,
    },
}

impl Scale {
    const fn placed(self, placement: Placement) -> Self {
        match self {
            Self::Rated { rated, per_count } => Self::Rated { rated: placement.place(rated), per_count },
            Self::Factors { times: [a, b], over: [c, d] } => Self::Factors {
                times: [place_some(a, placement), place_some(b, placement)],
                over: [place_some(c, placement), place_some(d, placement)],
            },
            Self::InTime { times, over } => {
                Self::InTime { times: place_some(times, placement), over: place_some(over, placement) }
            }
            scale => scale,
        }
    }
}

/// Counts of position in one turn of the motor's shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CountsPerTurn {
    /// Always this many.
    Fixed(u32),
    /// The value of an object times a factor.
    Object {
        /// Where it is.
        object: Mux,
        /// Counts in one unit of it.
        factor: u32,
    },
    /// The value of an object is the place in a table.
    Table {
        /// Where it is.
        object: Mux,
        /// Counts per turn by value.
        counts: &'static [u16],
        /// Its factory value.
        default: u32,
    },
    /// The product of some objects over the product of others: feed constant and gear ratio of CiA 402-2 (6092h:01 and
    /// 6091h:02 over 6092h:02 and 6091h:01), or the encoder's resolution (608Fh:01 over 608Fh:02).
    Ratio {
        /// Those that multiply.
        times: [Option<Mux>; 2],
        /// Those that divide.
        over: [Option<Mux>; 2],
    },
}

impl CountsPerTurn {
    const fn placed(self, placement: Placement) -> Self {
        match self {
            Self::Fixed(counts) => Self::Fixed(counts),
            Self::Object { object, factor } => Self::Object { object: placement.place(object), factor },
            Self::Table { object, counts, default } => Self::Table { object: placement.place(object), counts, default },
            Self::Ratio { times: [a, b], over: [c, d] } => Self::Ratio {
                times: [place_some(a, placement), place_some(b, placement)],
                over: [place_some(c, placement), place_some(d, placement)],
            },
        }
    }
}

/// How acceleration and deceleration are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ramps {
    /// As the time of the velocity change, in ms.
    Times {
        /// Where the acceleration time is.
        acceleration: Mux,
        /// Where the deceleration time is.
        deceleration: Mux,
        /// Where the quick stop's time is.
        quick_stop: Mux,
    },
    /// As rates, in (r/min)/s.
    Rates {
        /// For speeding up.
        acceleration: Mux,
        /// For slowing down; may be the same object.
        deceleration: Mux,
        /// For a quick stop; `None` where that has no ramp.
        quick_stop: Option<Mux>,
        /// What one count of each is worth.
        scale: Scale,
        /// From this value on there is no ramp.
        none_from: Option<u32>,
    },
}

impl Ramps {
    const fn placed(self, placement: Placement) -> Self {
        match self {
            Self::Times { acceleration, deceleration, quick_stop } => Self::Times {
                acceleration: placement.place(acceleration),
                deceleration: placement.place(deceleration),
                quick_stop: placement.place(quick_stop),
            },
            Self::Rates { acceleration, deceleration, quick_stop, scale, none_from } => Self::Rates {
                acceleration: placement.place(acceleration),
                deceleration: placement.place(deceleration),
                quick_stop: place_some(quick_stop, placement),
                scale: scale.placed(placement),
                none_from,
            },
        }
    }
}
