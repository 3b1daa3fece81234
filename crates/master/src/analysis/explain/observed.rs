//! What the rules of the explanation look at: read by `drive/observe.rs`.

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::od::Entry;
use canopen::{CobId, Mux, NmtState, NodeId};
use cia402::object::{
    CONTROLWORD, MAX_CURRENT, MAX_MOTOR_SPEED, MAX_POSITION_LIMIT, MAX_PROFILE_VELOCITY, MAX_TORQUE,
    MIN_POSITION_LIMIT, MODES_OF_OPERATION, MODES_OF_OPERATION_DISPLAY, NEGATIVE_TORQUE_LIMIT_VALUE,
    POSITION_ACTUAL_VALUE, POSITION_WINDOW, POSITIVE_TORQUE_LIMIT_VALUE, PROFILE_ACCELERATION, PROFILE_VELOCITY,
    TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY,
};
use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};
use devices::faults::FaultRow;
use devices::{AxisDescription, Description, HostWatch, Meaning, PowerStyle, Terminals};

use super::overheard::Overheard;
use crate::core::Twins;
use crate::decode::common_row;
use crate::drive::STANDSTILL_RPM;
use crate::error::Error;
use crate::pdo::PdoConfig;

/// Objects of an axis that rules ask for (CiA 402-2); those that a drive does not have are passed over.
const OF_AXIS: [Mux; 17] = [
    CONTROLWORD,
    MODES_OF_OPERATION,
    POSITION_ACTUAL_VALUE,
    TARGET_POSITION,
    TARGET_TORQUE,
    MAX_TORQUE,
    MAX_CURRENT,
    MIN_POSITION_LIMIT,
    MAX_POSITION_LIMIT,
    MAX_PROFILE_VELOCITY,
    MAX_MOTOR_SPEED,
    PROFILE_VELOCITY,
    TARGET_VELOCITY,
    POSITION_WINDOW,
    PROFILE_ACCELERATION,
    POSITIVE_TORQUE_LIMIT_VALUE,
    NEGATIVE_TORQUE_LIMIT_VALUE,
];

/// A speed that differs from its target by less than this part of it follows it.
const FOLLOWED_SHARE: f64 = 0.5;

/// Everything that the rules look at.
#[derive(Clone, Debug)]
pub struct Observed {
    /// The node.
    pub node: NodeId,
    /// Its model, if known.
    pub description: Option<&'static Description>,
    /// The axis of it.
    pub axis: Option<&'static AxisDescription>,
    /// Why nothing could be read.
    pub silence: Option<Error>,
    /// Its NMT state, as far as that was heard.
    pub nmt: Option<NmtState>,
    /// The statusword.
    pub statusword: Option<Statusword>,
    /// The state that it shows.
    pub power: Option<PowerState>,
    /// How the drive is enabled.
    pub style: PowerStyle,
    /// The mode that it shows.
    pub mode: Option<ModeOfOperation>,
    /// Its fault code (0 for none), and what it stands for.
    pub fault: Option<(u16, Vec<&'static FaultRow>)>,
    /// Speed in r/min, the larger of two looks.
    pub speed_rpm: Option<f64>,
    /// The commanded speed, in r/min.
    pub target_rpm: Option<f64>,
    /// By how much the speed differed between the two looks, in r/min.
    pub speed_change_rpm: Option<f64>,
    /// The fastest speed that the limit of the drive allows, in r/min, where its model has one for the target.
    pub speed_limit_rpm: Option<f64>,
    /// Motor current in A.
    pub current_a: Option<f64>,
    /// The largest that its limits allow, in A, where its model has such.
    pub current_limit_a: Option<f64>,
    /// Supply voltage in V.
    pub supply_v: Option<f64>,
    /// Objects that say how fast its speed may change, and are 0.
    pub rates_of_zero: Vec<Mux>,
    /// How its PDOs are set up.
    pub pdos: Vec<(PdoConfig, CobId)>,
    /// This master sent it something within this time before it was looked at.
    pub talked_to: Option<Duration>,
    /// What speaks for two devices with its node-ID.
    pub twins: Option<Twins>,
    /// It has refused SDO block transfer to this master since it has booted.
    pub refuses_blocks: bool,
    /// What others sent.
    pub heard: Overheard,
    /// What the objects have.
    pub(crate) values: BTreeMap<Mux, i64>,
}

impl Observed {
    /// How often it sends a heartbeat by its own word, if it does.
    pub(crate) fn heartbeat_period(&self) -> Option<Duration> {
        let ms = u64::try_from(self.value(PRODUCER_HEARTBEAT_TIME)?).ok().filter(|ms| *ms > 0)?;
        Some(Duration::from_millis(ms))
    }

    /// The objects to read, those that the model's units and limits name among them.
    pub(crate) fn wanted(&self) -> Vec<Mux> {
        let mut wanted: Vec<Mux> = OF_AXIS.iter().map(|mux| self.place(*mux)).collect();
        wanted.extend([PRODUCER_HEARTBEAT_TIME, self.mode_object()]);
        if let Some(units) = self.axis.map(|axis| &axis.units) {
            let quantities = [units.target_velocity, units.profile_velocity, units.target_current];
            wanted.extend(quantities.into_iter().flatten().map(|quantity| quantity.object));
        }
        wanted.extend(match self.description.map(|description| description.host_watch) {
            Some(HostWatch::Silence { time }) => Some(time),
            Some(HostWatch::Heartbeat { consumer, .. }) => Some(consumer),
            _ => None,
        });
        wanted.extend(self.of_terminals());
        let held_to: Vec<_> = wanted.iter().filter_map(|mux| self.row(*mux)?.held_to).map(|held| held.object).collect();
        wanted.extend(held_to);
        wanted.sort();
        wanted.dedup();
        wanted
    }

    /// The objects that show its inputs and its brake.
    fn of_terminals(&self) -> Vec<Mux> {
        let Some(Terminals { levels, polarity, inputs, brake }) = self.axis.map(|axis| axis.terminals) else {
            return Vec::new();
        };
        let functions = inputs.iter().filter_map(|input| match input.meaning {
            Meaning::Chosen { function, .. } => Some(function),
            Meaning::Fixed(_) => None,
        });
        let brake = brake.into_iter().flat_map(|brake| [Some(brake.object), brake.mask]).flatten();
        levels.into_iter().chain(polarity).chain(functions).chain(brake).map(|mux| self.place(mux)).collect()
    }

    /// The model's row of an object, or the one on which all models agree.
    pub(crate) fn row(&self, mux: Mux) -> Option<&'static Entry> {
        self.description.map_or_else(|| common_row(mux), |description| description.row(mux))
    }

    /// Where the axis has an object of the standard.
    pub(super) fn place(&self, mux: Mux) -> Mux {
        self.axis.map_or(mux, |axis| axis.object(mux))
    }

    /// Where the mode is shown.
    pub(crate) fn mode_object(&self) -> Mux {
        self.axis.map_or(MODES_OF_OPERATION_DISPLAY, |axis| axis.mode_display)
    }

    /// What an object has, where it is the drive's.
    pub(crate) fn value(&self, mux: Mux) -> Option<i64> {
        self.values.get(&mux).copied()
    }

    /// What an object of the standard has, of this axis.
    pub(crate) fn axis_value(&self, mux: Mux) -> Option<i64> {
        self.value(self.place(mux))
    }

    /// The controlword that the drive has.
    pub(super) fn controlword(&self) -> Option<Controlword> {
        self.axis_value(CONTROLWORD).map(|raw| Controlword(raw as u16))
    }

    /// True in Operation enabled.
    pub(super) fn is_enabled(&self) -> bool {
        self.power == Some(PowerState::OperationEnabled)
    }

    /// True if its statusword shows that its motor has power.
    pub(super) fn is_live(&self) -> bool {
        self.statusword.is_some_and(|statusword| self.style.is_live(statusword))
    }

    /// True if its fault is that of its watch over the heartbeat of a host.
    pub(super) fn has_lost_host(&self) -> bool {
        let (Some(model), Some((code, _))) = (self.description, &self.fault) else { return false };
        let HostWatch::Heartbeat { fault, .. } = model.host_watch else { return false };
        if model.faults.bit_field { code & fault != 0 } else { *code == fault }
    }

    /// True if the shaft was seen to turn.
    pub(super) fn turns(&self) -> bool {
        self.speed_rpm.is_some_and(|speed| speed.abs() > STANDSTILL_RPM)
    }

    /// True if it is to turn at a speed and does so, be it slower than what counts as turning.
    pub(super) fn follows_speed(&self) -> bool {
        let by_speed = self.axis.map(AxisDescription::velocity_mode) == self.mode
            || self.mode == Some(ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY);
        let (Some(target), Some(speed)) = (self.target_rpm, self.speed_rpm) else { return false };
        by_speed && target != 0.0 && ((speed - target) / target).abs() < FOLLOWED_SHARE
    }

    /// True if the statusword has this bit, and the model gives it no meaning of its own.
    pub(super) fn has_standard_bit(&self, mask: u16) -> bool {
        let own = self.axis.is_some_and(|axis| axis.statusword_bits.iter().any(|(bits, _)| bits & mask != 0));
        !own && self.style == PowerStyle::Cia402 && self.statusword.is_some_and(|word| word.has(mask))
    }

    /// `60FFh:00 target_velocity`.
    pub(super) fn named(&self, mux: Mux) -> String {
        self.row(mux).map_or_else(|| mux.to_string(), |row| format!("{mux} {}", row.name))
    }
}
