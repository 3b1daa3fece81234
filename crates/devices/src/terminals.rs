use canopen::Mux;

/// What a drive's digital inputs do to its motor and what holds its shaft, where objects show it.
///
/// What is not listed has no object that shows it: a brake that a drive moves by itself, an input that a chain of relays has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terminals {
    /// The levels of all inputs, bit by bit.
    pub levels: Option<Mux>,
    /// A bit that is set here reverses the input of that bit.
    pub polarity: Option<Mux>,
    /// The inputs that may have to do with motion.
    pub inputs: &'static [Input],
    /// The output that sets a holding brake, where the host moves it.
    pub brake: Option<BrakeOutput>,
}

impl Terminals {
    /// No object shows any.
    pub const NONE: Self = Self { levels: None, polarity: None, inputs: &[], brake: None };

    /// CiA 402-2, 60FDh and 60FEh: limit switches, home switch, and the brake by bit 0 where the mask of 60FEh:02 lets the host have it.
    pub const CIA402: Self = Self {
        levels: Some(Mux::new(0x60FD, 0)),
        polarity: None,
        inputs: &[
            Input { name: "negative limit switch", bit: 0, meaning: Meaning::Fixed(InputSignal::NegativeLimit) },
            Input { name: "positive limit switch", bit: 1, meaning: Meaning::Fixed(InputSignal::PositiveLimit) },
            Input { name: "home switch", bit: 2, meaning: Meaning::Fixed(InputSignal::Home) },
        ],
        brake: Some(BrakeOutput {
            name: "set brake",
            object: Mux::new(0x60FE, 1),
            bit: 0,
            mask: Some(Mux::new(0x60FE, 2)),
        }),
    };

    /// Whether an input is active, from the values of [`levels`](Self::levels) and [`polarity`](Self::polarity) (0 where the
    /// model has none).
    pub const fn is_active(input: &Input, levels: i64, polarity: i64) -> bool {
        (levels ^ polarity) >> input.bit & 1 == 1
    }
}

/// A digital input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Its name in the manual.
    pub name: &'static str,
    /// Its bit of the levels.
    pub bit: u8,
    /// What it says when it is active.
    pub meaning: Meaning,
}

/// Where it is said what an input says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Always this.
    Fixed(InputSignal),
    /// What this object chooses, by value; other values have nothing to do with motion.
    Chosen {
        /// The object with the choice.
        function: Mux,
        /// Its values.
        signals: &'static [(i64, InputSignal)],
    },
}

impl Meaning {
    /// What the input says, with the value of the object that chooses it.
    pub fn signal(self, function: Option<i64>) -> Option<InputSignal> {
        match self {
            Self::Fixed(signal) => Some(signal),
            Self::Chosen { signals, .. } => {
                signals.iter().find(|(value, _)| Some(*value) == function).map(|(_, signal)| *signal)
            }
        }
    }
}

/// What an active input says of where the shaft is, or that the motor is to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputSignal {
    /// The motor is to stop.
    EmergencyStop,
    /// The shaft is at the negative end.
    NegativeLimit,
    /// The shaft is at the positive end.
    PositiveLimit,
    /// The shaft is at the home switch.
    Home,
}

impl InputSignal {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::EmergencyStop => "emergency stop",
            Self::NegativeLimit => "negative limit",
            Self::PositiveLimit => "positive limit",
            Self::Home => "home switch",
        }
    }
}

/// An output that sets a holding brake: the shaft is held while its bit is 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrakeOutput {
    /// Its name in the manual.
    pub name: &'static str,
    /// The object that the host writes.
    pub object: Mux,
    /// Its bit there.
    pub bit: u8,
    /// Where the same bit has to be 1 for the host to have a say; `None`: it always has.
    pub mask: Option<Mux>,
}
