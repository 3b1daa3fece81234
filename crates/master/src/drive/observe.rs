//! Reads what the explanation of a drive looks at. Nothing is written, so that a running machine may be looked at.

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::Mux;
use canopen::object::DEVICE_TYPE;
use cia402::ModeOfOperation;
use cia402::object::{MAX_CURRENT, MAX_TORQUE, NEGATIVE_TORQUE_LIMIT_VALUE, POSITIVE_TORQUE_LIMIT_VALUE};
use devices::{Quantity, Scale};

use super::explain::faults_in;
use super::handle::Drive;
use crate::error::Error;
use crate::explain::{Explained, Observed, Overheard};
use crate::gear::Gear;
use crate::units::Amperes;

/// Limits in thousandths of what is rated (CiA 402-2, torque profile).
const CURRENT_LIMITS: [Mux; 4] = [MAX_TORQUE, MAX_CURRENT, POSITIVE_TORQUE_LIMIT_VALUE, NEGATIVE_TORQUE_LIMIT_VALUE];

/// Between the two looks at the speed: a shaft that starts has moved on, one that is held has not.
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

impl Drive {
    /// Looks for what keeps this drive from moving and its PDOs from being exchanged. Reads some thirty objects and writes
    /// none; `heard` is what others sent in the time before.
    pub async fn explain(&self, heard: &Overheard) -> Explained {
        // What the rules compare are objects, whatever stands behind the shaft.
        let seen = Observed::of(&self.clone().behind(Gear::DIRECT), heard).await;
        seen.explained()
    }

    /// The largest motor current that its limits allow, the least of them, in A; `None` where its model is not known to have one.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO reads.
    pub async fn current_limit(&self) -> Result<Option<Amperes>, Error> {
        let Some(target) = self.motion("find out its limits")?.units.target_current else { return Ok(None) };
        let named = self.row(target.object, "find out its limits")?.held_to.map(|held| (held.object, held.counts));
        let is_share = matches!(target.scale, Scale::Rated { .. });
        let shares = CURRENT_LIMITS.into_iter().filter(|_| is_share).map(|mux| (self.place(mux), 1));
        let mut least = None::<i64>;
        for (object, counts) in named.into_iter().chain(shares) {
            // A drive that refuses the object holds nothing back by it.
            if let Some(raw) = answered(self.read_number(object).await)? {
                least = Some(least.map_or(raw * counts, |least| least.min(raw * counts)));
            }
        }
        let Some(least) = least else { return Ok(None) };
        Ok(Some(Amperes(least as f64 * self.step_of(target).await?)))
    }
}

impl Observed {
    /// Reads what the rules need. A refused object is left out; silence ends the reading and is reported.
    pub async fn of(drive: &Drive, heard: &Overheard) -> Self {
        let mut seen = Self::unread(drive, heard);
        seen.silence = seen.read(drive, true).await.err();
        if let Some(period) = seen.heartbeat_period() {
            drive.node().look_for_twins(period).await;
            seen.twins = drive.node().facts().twins;
        }
        seen
    }

    /// The same of what the shaft does, and of what it is commanded to do, alone: some thirty reads.
    pub(super) async fn of_shaft(drive: &Drive) -> Self {
        let drive = drive.clone().behind(Gear::DIRECT);
        let mut seen = Self::unread(&drive, &Overheard::from(drive.node().network().now()));
        seen.silence = seen.read(&drive, false).await.err();
        seen
    }

    fn unread(drive: &Drive, heard: &Overheard) -> Self {
        let (facts, now) = (drive.node().facts(), drive.node().network().now());
        Self {
            node: drive.node().id(),
            description: drive.description(),
            axis: drive.axis_description(),
            silence: None,
            nmt: facts.probable_state(drive.description()),
            statusword: None,
            power: None,
            style: drive.power_style(),
            mode: None,
            fault: None,
            speed_rpm: None,
            target_rpm: None,
            speed_change_rpm: None,
            speed_limit_rpm: None,
            current_a: None,
            current_limit_a: None,
            supply_v: None,
            rates_of_zero: Vec::new(),
            pdos: Vec::new(),
            talked_to: facts.talked_to_at.map(|at| now - at),
            twins: facts.twins,
            refuses_blocks: facts.refuses_blocks,
            heard: heard.clone(),
            values: BTreeMap::new(),
        }
    }

    async fn read(&mut self, drive: &Drive, with_pdos: bool) -> Result<(), Error> {
        let units = self.axis.map(|axis| &axis.units);
        // Every node answers this one: the first request shows whether one is there.
        answered(drive.node().upload(DEVICE_TYPE).await)?;
        if let Some(statusword) = answered(drive.statusword().await)? {
            (self.statusword, self.power) = (Some(statusword), drive.power_state(statusword));
        }
        let speed = units.and_then(|units| units.actual_velocity);
        let first = measure(drive, speed).await?;
        for mux in self.wanted() {
            self.read_value(drive, mux).await?;
        }
        self.mode = self.axis_value(self.mode_object()).and_then(|raw| i8::try_from(raw).ok()).map(ModeOfOperation);
        let code = answered(drive.node().upload(drive.fault_code()).await)?.map(|payload| payload.raw() as u16);
        self.fault = code.map(|code| (code, self.description.map(|model| faults_in(model, code)).unwrap_or_default()));
        self.target_rpm = measure(drive, units.and_then(|units| units.target_velocity)).await?;
        self.current_a = measure(drive, units.and_then(|units| units.actual_current)).await?;
        self.supply_v = measure(drive, units.and_then(|units| units.bus_voltage)).await?;
        self.speed_limit_rpm = self.held_to(drive, units.and_then(|units| units.target_velocity), &[]).await?;
        let current = units.and_then(|units| units.target_current);
        self.current_limit_a = self.held_to(drive, current, &CURRENT_LIMITS).await?;
        self.rates_of_zero = drive.rates_of_zero().await;
        if with_pdos {
            self.pdos = drive.pdos().await?;
        }
        drive.node().network().sleep(BETWEEN_LOOKS).await;
        let second = measure(drive, speed).await?;
        self.speed_change_rpm = first.zip(second).map(|(first, second)| second - first);
        self.speed_rpm = first.into_iter().chain(second).max_by(|a, b| a.abs().total_cmp(&b.abs()));
        Ok(())
    }

    /// The least of what holds a target: the object that its row names, and of a share of something rated those that are shares of
    /// the same.
    async fn held_to(&self, drive: &Drive, target: Option<Quantity>, shares: &[Mux]) -> Result<Option<f64>, Error> {
        let Some(target) = target else { return Ok(None) };
        let named = self.row(target.object).and_then(|row| row.held_to);
        let named = named.and_then(|held| Some(self.value(held.object)? * held.counts));
        let is_share = matches!(target.scale, Scale::Rated { .. });
        let shares = shares.iter().filter(|_| is_share).filter_map(|mux| self.axis_value(*mux));
        let Some(least) = named.into_iter().chain(shares).min() else { return Ok(None) };
        Ok(answered(drive.step_of(target).await)?.map(|step| least as f64 * step))
    }

    async fn read_value(&mut self, drive: &Drive, mux: Mux) -> Result<(), Error> {
        let Some(row) = self.row(mux) else { return Ok(()) };
        if let Some(payload) = answered(drive.node().upload(mux).await)?
            && payload.as_bytes().len() == row.data_type.size()
        {
            self.values.insert(mux, row.data_type.value(payload.raw()));
        }
        Ok(())
    }
}

async fn measure(drive: &Drive, quantity: Option<Quantity>) -> Result<Option<f64>, Error> {
    match quantity {
        Some(quantity) => answered(drive.read_quantity(quantity).await),
        None => Ok(None),
    }
}

/// What is refused, or comes in another form, says nothing; silence is handed on.
fn answered<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error @ Error::NoAnswer { .. }) => Err(error),
        Err(_) => Ok(None),
    }
}
