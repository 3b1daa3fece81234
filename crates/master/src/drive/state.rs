use std::time::Duration;

use canopen::NmtState;
use cia402::object::{ERROR_CODE, POSITION_ACTUAL_VALUE};
use cia402::{ModeOfOperation, PowerState, Statusword};
use devices::faults::FaultRow;
use devices::{PowerStyle, Quantity};

use super::explain::faults_in;
use super::handle::Drive;
use crate::error::Error;
use crate::units::{Amperes, Celsius, Counts, Degrees, Rpm, Volts};
use canopen::Mux;

/// Everything that a drive shows at one time. What the model does not have is `None`.
#[derive(Clone, Debug)]
pub struct DriveState {
    /// 6041h.
    pub statusword: Statusword,
    /// The state it shows; of a drive without the state machine, the one that comes closest.
    pub power: Option<PowerState>,
    /// How to read its statusword.
    pub style: PowerStyle,
    /// Bits of the statusword of this model's own, in words.
    pub own_bits: &'static [(u16, &'static str)],
    /// 6061h, or 6060h of a drive without it.
    pub mode: Option<ModeOfOperation>,
    /// The model's fault code, 0 for none; `None` where the drive refuses its object.
    pub fault_code: Option<u16>,
    /// What the code means and what to do.
    pub faults: Vec<&'static FaultRow>,
    /// Position in counts.
    pub position: Option<Counts>,
    /// Position as an angle of the shaft.
    pub angle: Option<Degrees>,
    /// Speed.
    pub velocity: Option<Rpm>,
    /// Motor current.
    pub current: Option<Amperes>,
    /// Supply voltage.
    pub supply: Option<Volts>,
    /// Motor temperature.
    pub motor_temperature: Option<Celsius>,
    /// Temperature of the power stage.
    pub driver_temperature: Option<Celsius>,
    /// NMT state by its last heartbeat or the NMT command sent since.
    pub nmt: Option<NmtState>,
    /// Age of its last heartbeat.
    pub heartbeat_age: Option<Duration>,
}

impl Drive {
    /// Reads everything that the model can say of its state.
    ///
    /// # Errors
    /// Those of the SDO reads. An object that this drive refuses is left out; silence is an error.
    pub async fn state(&self) -> Result<DriveState, Error> {
        let statusword = self.statusword().await?;
        let mode = refused_is_none(self.mode().await)?;
        let fault_code =
            refused_is_none(self.node.upload(self.fault_code()).await)?.map(|payload| payload.raw() as u16);
        let faults = self.description.zip(fault_code).map(|(model, code)| faults_in(model, code)).unwrap_or_default();
        let position = refused_is_none(self.node.read::<i32>(self.place(POSITION_ACTUAL_VALUE)).await)?
            .map(|raw| Counts(raw.into()));
        let angle = match (position, self.axis_description()) {
            (Some(Counts(counts)), Some(_)) => {
                let turn = self.counts_per_turn().await?;
                (turn > 0.0).then(|| Degrees(counts as f64 / turn * 360.0))
            }
            _ => None,
        };
        let units = self.axis_description().map(|axis| &axis.units);
        let facts = self.node.facts();
        Ok(DriveState {
            statusword,
            power: self.power_state(statusword),
            style: self.power_style(),
            own_bits: self.axis_description().map_or(&[], |axis| axis.statusword_bits),
            mode,
            fault_code,
            faults,
            position,
            angle,
            velocity: self.measure(units.and_then(|units| units.actual_velocity)).await?.map(Rpm),
            current: self.measure(units.and_then(|units| units.actual_current)).await?.map(Amperes),
            supply: self.measure(units.and_then(|units| units.bus_voltage)).await?.map(Volts),
            motor_temperature: self.measure(units.and_then(|units| units.motor_temperature)).await?.map(Celsius),
            driver_temperature: self.measure(units.and_then(|units| units.driver_temperature)).await?.map(Celsius),
            nmt: facts.probable_state(self.description),
            heartbeat_age: facts.heartbeat_age(self.node.network().now()),
        })
    }

    /// Where the present fault code is.
    pub(crate) fn fault_code(&self) -> Mux {
        self.place(self.description.and_then(|description| description.faults.code).unwrap_or(ERROR_CODE))
    }

    async fn measure(&self, quantity: Option<Quantity>) -> Result<Option<f64>, Error> {
        match quantity {
            Some(quantity) => refused_is_none(self.read_quantity(quantity).await),
            None => Ok(None),
        }
    }
}

impl DriveState {
    /// The bits of the statusword that are set, in words. Bits 8 and 11 to 15 are given by their number where mode
    /// or maker decide what they mean, unless the model's description says it.
    pub fn statusword_words(&self) -> Vec<&'static str> {
        let own = self.own_bits.iter().filter(|(mask, _)| self.statusword.has(*mask)).map(|(_, name)| *name);
        if self.style != PowerStyle::Cia402 {
            return own.collect();
        }
        let fixed: [(u16, &str); 9] = [
            (0x0001, "ready to switch on"),
            (0x0002, "switched on"),
            (0x0004, "operation enabled"),
            (0x0008, "fault"),
            (0x0010, "voltage enabled"),
            (0x0040, "switch on disabled"),
            (0x0080, "warning"),
            (0x0200, "remote"),
            (0x0400, "target reached"),
        ];
        let bit12 = match self.mode {
            Some(ModeOfOperation::PROFILE_POSITION) => "set-point acknowledged",
            Some(ModeOfOperation::PROFILE_VELOCITY) => "speed is zero",
            Some(ModeOfOperation::HOMING) => "homing attained",
            _ => "bit 12",
        };
        let open = [
            (0x0100, "bit 8"),
            (0x0800, "internal limit active"),
            (0x1000, bit12),
            (0x2000, "bit 13"),
            (0x4000, "bit 14"),
            (0x8000, "bit 15"),
        ];
        let is_own = |mask| self.own_bits.iter().any(|(own, _)| *own == mask);
        let set = |(mask, _): &(u16, &str)| self.statusword.has(*mask) && !is_own(*mask);
        let mut words: Vec<_> = fixed.into_iter().chain(open).filter(set).map(|(_, name)| name).chain(own).collect();
        if self.power == Some(PowerState::QuickStopActive) {
            words.push("quick stop active");
        }
        words
    }
}

/// What the drive refuses is left out.
pub(super) fn refused_is_none<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::Aborted { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
