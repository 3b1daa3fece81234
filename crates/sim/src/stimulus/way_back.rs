//! What takes a stimulus back.

use super::bus_fault::{BusFault, WireFault};
use super::kinds::{Power, Stimulus};
use super::load::{LoadKind, LoadPart};

impl Stimulus {
    /// What puts the world back to where this has not been done. `None` for what mends something already, and for what was another
    /// value before that the stimulus does not hold: a supply, the object of a node.
    #[must_use]
    pub fn way_back(&self) -> Option<Self> {
        Some(match self {
            Self::Power(Power::Off | Power::Cut) => Self::Power(Power::On),
            // A low input is one to which nothing is connected.
            Self::Input { name, level: true } | Self::Switch { name, .. } => {
                Self::Input { name: name.clone(), level: false }
            }
            Self::LoadTorque(torque_nm) if *torque_nm != 0.0 => Self::LoadTorque(0.0),
            Self::LoadInertia(inertia) if *inertia != 0.0 => Self::LoadInertia(0.0),
            Self::Load(part) => Self::Load(LoadPart::Off(part.kind()?)),
            Self::RotorLock(true) => Self::RotorLock(false),
            Self::Temperature(sensor, Some(_)) => Self::Temperature(*sensor, None),
            Self::Fault(component, true) => Self::Fault(*component, false),
            Self::Battery(false) => Self::Battery(true),
            Self::CableCut(true) => Self::CableCut(false),
            Self::Bus(fault) => Self::Bus(fault.way_back()?),
            Self::Power(Power::On | Power::Cycle)
            | Self::Input { level: false, .. }
            | Self::LoadTorque(_)
            | Self::LoadInertia(_)
            | Self::RotorLock(false)
            | Self::Supply(_)
            | Self::Temperature(_, None)
            | Self::Fault(_, false)
            | Self::Battery(true)
            | Self::Pulses(_)
            | Self::CableCut(false)
            | Self::Object { .. }
            | Self::Mpdo { .. } => return None,
        })
    }
}

impl LoadPart {
    /// Which thing it puts at the shaft; `None` for what takes something away.
    const fn kind(&self) -> Option<LoadKind> {
        match self {
            Self::Friction(_) => Some(LoadKind::Friction),
            Self::Pulley { .. } => Some(LoadKind::Pulley),
            Self::Spring { .. } => Some(LoadKind::Spring),
            Self::Stop { .. } => Some(LoadKind::Stop),
            Self::Fan { .. } => Some(LoadKind::Fan),
            Self::Gear { .. } => Some(LoadKind::Gear),
            Self::Off(_) | Self::None => None,
        }
    }
}

impl BusFault {
    fn way_back(&self) -> Option<Self> {
        match self {
            Self::Silent(true) => Some(Self::Silent(false)),
            Self::Late(Some(_)) => Some(Self::Late(None)),
            Self::Babble(Some(_)) => Some(Self::Babble(None)),
            Self::Overrun(Some(_)) => Some(Self::Overrun(None)),
            Self::Corrupt(probability) if *probability != 0.0 => Some(Self::Corrupt(0.0)),
            Self::Silent(false) | Self::Late(None) | Self::Babble(None) | Self::Overrun(None) | Self::Corrupt(_) => {
                None
            }
        }
    }
}

impl WireFault {
    /// What puts the wire back to where this has not been done.
    #[must_use]
    pub fn way_back(&self) -> Option<Self> {
        match self {
            Self::Corrupt(probability) if *probability != 0.0 => Some(Self::Corrupt(0.0)),
            Self::Corrupt(_) | Self::Destroy { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the words of `ferrodrive sim`, whose second form of each mends it.
    #[test]
    fn what_was_done_is_taken_back_by_the_words_that_mend_it() {
        for (done, back) in [
            ("power off", "power on"),
            ("power cut", "power on"),
            ("input X0 1", "input X0 0"),
            ("switch X0 -5000 max", "input X0 0"),
            ("load torque 2.5", "load torque 0"),
            ("load inertia 0.02", "load inertia 0"),
            ("load pulley 2 0.05", "load pulley off"),
            ("load stop -5000 max", "load stop off"),
            ("rotor lock", "rotor free"),
            ("temperature motor 95", "temperature motor auto"),
            ("fault hall on", "fault hall off"),
            ("battery off", "battery on"),
            ("cable cut", "cable join"),
            ("bus silent on", "bus silent off"),
            ("bus late 5 20", "bus late off"),
            ("bus babble 080# 1", "bus babble off"),
            ("bus overrun 2 0.5", "bus overrun off"),
        ] {
            let done: Stimulus = done.parse().expect(done);
            let way_back = done.way_back().expect("a way back");
            assert_eq!(way_back.to_string(), back, "{done}");
            assert_eq!(way_back.way_back(), None, "{back} mends");
        }
        let corrupt: Stimulus = "bus corrupt 0.3".parse().expect("a stimulus");
        assert_eq!(corrupt.way_back(), "bus corrupt off".parse().ok());
        for done in ["power cycle", "supply 48", "pulses 8192 10000", "set 6000:01 FFh", "load none", "input X0 0"] {
            assert_eq!(done.parse::<Stimulus>().expect(done).way_back(), None, "{done}");
        }
    }
}
