//! What is read and set up before a drive is moved cycle by cycle: PDOs, units, limits, mode (CiA 402-2).

use core::time::Duration;

use canopen::pdo::{Direction, EventTrigger, MappingRecord, PdoId, PdoNumber};
use canopen::{Mux, NmtCommand, NmtState, NodeId};
use cia402::ModeOfOperation;
use cia402::object::{
    CONTROLWORD, INTERPOLATION_DATA_RECORD_1ST_SET_POINT, MODES_OF_OPERATION, POSITION_ACTUAL_VALUE, STATUSWORD,
    TARGET_POSITION,
};
use devices::{AxisDescription, Description, Quantity};

use super::demand::Bound;
use super::drive::{ControlwordPath, CyclicDrive, CyclicProgress};
use super::target::{Target, TargetKind};
use crate::core::{Cadence, CycleRules, NumberForm, PdoMap, Sample, Signal};
use crate::drive::{Drive, STANDSTILL_RPM, STOP, SwitchedOff};
use crate::error::Error;
use crate::host_loss::HostLoss;
use crate::pdo::{PdoConfig, PdoError, SignalError, TimerUnits, TransmissionType};

const INTENT: &str = "move it cycle by cycle";

/// How a drive is moved cycle by cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CyclicOptions {
    /// Has the drive stop by itself when this program dies, as [`Drive::guard`] does; `None` leaves that to the caller.
    pub guard: Option<SwitchedOff>,
    /// Cycles in a row for which the program may give no set-point, or the drive's TPDO may stay away, before the drive is
    /// stopped.
    pub tolerance: u32,
}

impl Default for CyclicOptions {
    /// Guarded, if its watch is not switched off on the drive. Two cycles: one lost frame and a late program at once stop
    /// nothing.
    fn default() -> Self {
        Self { guard: Some(SwitchedOff::Leave), tolerance: 2 }
    }
}

/// Why a drive cannot be moved cycle by cycle.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CyclicError {
    /// A request failed, or the model lacks something.
    #[error(transparent)]
    Drive(#[from] Error),
    /// A PDO could not be set up.
    #[error(transparent)]
    Pdo(#[from] PdoError),
    /// An object that is needed in a PDO is in none.
    #[error(transparent)]
    NotMapped(#[from] SignalError),
    /// The mode has no set-point that could be given each cycle.
    #[error(
        "node {node} cannot be moved cycle by cycle in mode {mode}: choose a mode for speed, torque, interpolated or \
             cyclic synchronous position"
    )]
    NoSetPoint {
        /// The node.
        node: NodeId,
        /// The mode.
        mode: ModeOfOperation,
    },
    /// The TPDO with the statusword comes when something changes, so that its absence means nothing.
    #[error(
        "the TPDO of node {node} with {STATUSWORD} is sent when something changes: its absence would mean \
             nothing. Give it transmission type 1 or an event timer, or call configure_cyclic"
    )]
    OnEventsOnly {
        /// The node.
        node: NodeId,
    },
}

impl CyclicError {
    /// What a drive said, where that is why.
    pub const fn of_drive(&self) -> Option<&Error> {
        match self {
            Self::Drive(error) | Self::Pdo(PdoError::Step { cause: error, .. }) => Some(error),
            _ => None,
        }
    }
}

/// What the set-point of a mode is.
#[derive(Clone, Copy)]
enum SetPointKind {
    Position(Mux),
    Quantity(Quantity),
}

/// The set-point of a mode that follows one each cycle.
fn set_point_of(description: &Description, axis: &AxisDescription, mode: ModeOfOperation) -> Option<SetPointKind> {
    let interpolation_data = axis.object(INTERPOLATION_DATA_RECORD_1ST_SET_POINT);
    match mode {
        ModeOfOperation::INTERPOLATED_POSITION if description.row(interpolation_data).is_some() => {
            Some(SetPointKind::Position(interpolation_data))
        }
        ModeOfOperation::INTERPOLATED_POSITION | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => {
            let target = axis.object(TARGET_POSITION);
            description.row(target).map(|_| SetPointKind::Position(target))
        }
        ModeOfOperation::PROFILE_VELOCITY | ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => {
            axis.units.target_velocity.map(SetPointKind::Quantity)
        }
        ModeOfOperation::PROFILE_TORQUE | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE => {
            axis.units.target_current.map(SetPointKind::Quantity)
        }
        _ => None,
    }
}

/// What a device says of its PDOs.
struct Mapped {
    rpdos: Vec<PdoConfig>,
    tpdos: Vec<PdoConfig>,
}

impl Drive {
    /// Prepares the drive to be moved cycle by cycle in this mode: reads its PDO mapping, units and limits, starts it (NMT),
    /// and sets the mode. It is enabled by the first step that wants motion. Mappings are as the device has them, see
    /// [`configure_cyclic`](Self::configure_cyclic).
    ///
    /// The drive is guarded, if the options do not say otherwise, and has to be released
    /// ([`release_guard`](Self::release_guard)) when it stands still and is no longer moved. If nothing stops it when this
    /// program dies, that is an [`Event::Unguarded`](crate::core::Event::Unguarded).
    ///
    /// # Errors
    /// [`CyclicError`].
    pub async fn cyclic(&self, mode: ModeOfOperation, options: CyclicOptions) -> Result<CyclicDrive, CyclicError> {
        let (description, axis) = (self.known(INTENT)?, self.motion(INTENT)?);
        if !axis.modes.contains(&mode) {
            return Err(self.no_such_mode(axis, mode).into());
        }
        let mapped = self.adopt_pdos(description).await?;
        let (number, mut target) = self.target(description, axis, mode).await?;
        let (statusword_in, cadence) = self.statusword_carrier(description, number, &mapped)?;
        let statusword = self.node().signal_in(statusword_in, axis.object(STATUSWORD))?;
        if let TargetKind::Position { actual, .. } = &mut target.kind {
            // A TPDO that comes, if one of them does.
            *actual = self.node().signal_in(statusword_in, axis.object(POSITION_ACTUAL_VALUE)).unwrap_or(*actual);
        }
        let place = axis.object(CONTROLWORD);
        let controlword = self.controlword_path(number, &mapped);
        self.preset_rpdos(&mapped, number, mode).await?;
        let rules = CycleRules {
            node: self.node().id(),
            stop: STOP.0,
            controlword: place,
            place: if let ControlwordPath::Pdo(set_point) = controlword { Some(set_point.place()) } else { None },
            heard: statusword.place(),
            cadence,
            tolerance: options.tolerance,
        };
        let (position, velocity, current) = (
            self.position_signal(statusword_in).await?,
            self.quantity_signal(description, statusword_in, axis.units.actual_velocity).await?,
            self.quantity_signal(description, statusword_in, axis.units.actual_current).await?,
        );
        // A TPDO that answers another RPDO than that of the cycle does not come.
        let is_answer = description.pdo.event_trigger == EventTrigger::AnswersRpdo;
        let actual = self.place(POSITION_ACTUAL_VALUE);
        let position_comes = !is_answer
            || self
                .node()
                .scaled_signal::<crate::units::Turns>(actual, Some(statusword_in), NumberForm::Signed, 1.0)
                .is_ok();
        let host_loss = self.begin_cyclic(description, mode, options).await?;
        Ok(CyclicDrive {
            node: self.node().id(),
            rpdo: number,
            axis: self.as_moved(),
            mode,
            style: axis.power,
            statusword,
            controlword,
            position,
            position_comes,
            velocity,
            current,
            target,
            cadence,
            answers: is_answer && statusword_in == number,
            tolerance: options.tolerance,
            host_loss,
            watch: self.node().network().with_core(|core| core.watch_cycles(rules)),
            progress: CyclicProgress::new(self.gear().at_output(STANDSTILL_RPM)),
        })
    }

    /// What changes the drive, once all is known: the guard, NMT start, the mode.
    async fn begin_cyclic(
        &self,
        description: &Description,
        mode: ModeOfOperation,
        options: CyclicOptions,
    ) -> Result<HostLoss, Error> {
        let (id, network) = (self.node().id(), self.node().network());
        let guarded_before = network.guarded(id).is_some();
        let host_loss = match options.guard {
            Some(switched_off) => self.guard(switched_off).await?,
            None => self.host_loss().await?,
        };
        if host_loss.stops_after().is_none() {
            network.with_core(|core| core.note_unguarded(id, host_loss));
        }
        if self.node().facts().probable_state(Some(description)) != Some(NmtState::Operational) {
            self.node().nmt(NmtCommand::Start);
        }
        if let Err(error) = self.set_mode(mode).await {
            if options.guard.is_some() && !guarded_before {
                // The first error is the one to report.
                let _ = self.release_guard().await;
            }
            return Err(error);
        }
        Ok(host_loss)
    }

    /// Maps what the mode needs, to be sent with each SYNC: RPDO1 gets the controlword and the set-point; TPDO1 the statusword
    /// and the position, or in other modes the speed and the current. A second axis gets RPDO2 and TPDO2. All other TPDOs are
    /// switched off until they are set up again: they would take the room that each cycle needs. A model with a fixed mapping
    /// is left as it is.
    ///
    /// # Errors
    /// [`CyclicError`].
    pub async fn configure_cyclic(&self, mode: ModeOfOperation) -> Result<(), CyclicError> {
        self.configure_cyclic_with(mode, false, false).await
    }

    /// As [`configure_cyclic`](Self::configure_cyclic), and in every mode the TPDO shows the position: for a program that
    /// counts where the shaft came to while it gives speeds.
    ///
    /// # Errors
    /// [`CyclicError`].
    pub async fn configure_cyclic_with_position(&self, mode: ModeOfOperation) -> Result<(), CyclicError> {
        self.configure_cyclic_with(mode, true, false).await
    }

    /// The same for a motion alone: the PDOs are put back as they were when the drive stands and its guard is given back
    /// ([`Network::release_guards`](crate::Network::release_guards)).
    pub(crate) async fn configure_cyclic_for_a_motion(&self, mode: ModeOfOperation) -> Result<(), CyclicError> {
        self.configure_cyclic_with(mode, true, true).await
    }

    async fn configure_cyclic_with(
        &self,
        mode: ModeOfOperation,
        position: bool,
        former: bool,
    ) -> Result<(), CyclicError> {
        let (description, node) = (self.known(INTENT)?, self.node());
        let Some(mapped) = self.pdos_of_cycle(mode, position)? else { return Ok(()) };
        let units = TimerUnits::of(description);
        for pdo in pdos_of(description) {
            let own = mapped.iter().find(|own| own.pdo == pdo);
            let takes_room = pdo.direction == Direction::Tpdo && pdo.number.position() >= description.axes.len();
            if own.is_none() && !takes_room {
                continue;
            }
            let (config, cob_id) = node.pdo_config(pdo, units).await?;
            if own.is_none() && (!cob_id.is_valid() || config.map.0.is_empty()) {
                continue;
            }
            if former {
                // What is mapped meanwhile has no objects of less than a byte.
                let objects = description.pdo.max_objects.min(can::MAX_DATA_LENGTH as u8);
                node.note_former_pdo((config, cob_id), objects, units).await?;
            }
            match own {
                Some(own) => node.configure_pdo(own, units).await?,
                None => node.switch_pdo_off(pdo).await?,
            }
        }
        Ok(())
    }

    /// The object that takes the set-point of a mode.
    pub(crate) fn set_point_object(&self, mode: ModeOfOperation) -> Result<Mux, CyclicError> {
        match set_point_of(self.known(INTENT)?, self.motion(INTENT)?, mode) {
            Some(SetPointKind::Position(object)) => Ok(object),
            Some(SetPointKind::Quantity(quantity)) => Ok(quantity.object),
            None => Err(CyclicError::NoSetPoint { node: self.node().id(), mode }),
        }
    }

    /// The RPDO and the TPDO that a mode needs in each cycle, with the position in every mode or not; `None` for a model whose mapping is
    /// fixed. Nothing is written.
    pub(crate) fn pdos_of_cycle(
        &self,
        mode: ModeOfOperation,
        position: bool,
    ) -> Result<Option<[PdoConfig; 2]>, CyclicError> {
        let (description, axis) = (self.known(INTENT)?, self.motion(INTENT)?);
        let target = self.set_point_object(mode)?;
        if description.pdo.fixed_mapping {
            return Ok(None);
        }
        let record =
            |mux: Mux| description.row(mux).map(|row| MappingRecord { mux, bits: (row.data_type.size() * 8) as u8 });
        let map = |objects: &[Option<Mux>]| {
            let mut map = PdoMap(Vec::new());
            for object in objects.iter().filter_map(|mux| record((*mux)?)) {
                let fits = map.bits() + u32::from(object.bits) <= u64::BITS;
                let room = map.0.len() < usize::from(description.pdo.max_objects);
                if fits && room {
                    map.0.push(object);
                }
            }
            map
        };
        let quantities = [axis.units.actual_velocity, axis.units.actual_current];
        let [velocity, current] = quantities.map(|quantity| quantity.map(|quantity| quantity.object));
        let statusword = Some(axis.object(STATUSWORD));
        let state = match set_point_of(description, axis, mode) {
            Some(SetPointKind::Position(_)) => map(&[statusword, Some(axis.object(POSITION_ACTUAL_VALUE))]),
            // What does not fit any more is left out.
            _ if position => map(&[statusword, Some(axis.object(POSITION_ACTUAL_VALUE)), velocity, current]),
            _ => map(&[statusword, velocity, current]),
        };
        let command = map(&[Some(axis.object(CONTROLWORD)), Some(target)]);
        // A PDO of its own for each axis.
        let number = PdoNumber::at(usize::from(self.axis_id().0)).unwrap_or(PdoNumber::FIRST);
        let mapped = [(Direction::Rpdo, command), (Direction::Tpdo, state)];
        Ok(Some(mapped.map(|(direction, map)| {
            PdoConfig::new(PdoId { direction, number }, map).transmission(TransmissionType::EVERY_SYNC)
        })))
    }

    /// Reads every PDO that the model has, and has this master send and receive them as they are set up.
    async fn adopt_pdos(&self, description: &Description) -> Result<Mapped, Error> {
        let units = TimerUnits::of(description);
        let mut mapped = Mapped { rpdos: Vec::new(), tpdos: Vec::new() };
        for pdo in pdos_of(description) {
            let config = self.node().adopt_pdo(pdo, units).await?;
            match pdo.direction {
                Direction::Rpdo => mapped.rpdos.push(config),
                Direction::Tpdo => mapped.tpdos.push(config),
            }
        }
        Ok(mapped)
    }

    /// The set-point of the mode, and the RPDO that carries it.
    async fn target(
        &self,
        description: &Description,
        axis: &AxisDescription,
        mode: ModeOfOperation,
    ) -> Result<(PdoNumber, Target), CyclicError> {
        let quantity = match set_point_of(description, axis, mode) {
            Some(SetPointKind::Position(object)) => return self.position_target(axis, object).await,
            Some(SetPointKind::Quantity(quantity)) => quantity,
            None => return Err(CyclicError::NoSetPoint { node: self.node().id(), mode }),
        };
        let (number, set_point) = self.node().scaled_set_point(quantity.object, NumberForm::Signed, 1.0)?;
        let per_count = self.step_of(quantity).await?;
        let speed = axis.units.target_velocity.is_some_and(|velocity| velocity.object == quantity.object);
        let kind = if speed { TargetKind::Velocity { per_count } } else { TargetKind::Current { per_count } };
        Ok((number, Target { set_point, limits: self.limits(quantity.object).await?, kind, last_sent: 0 }))
    }

    async fn position_target(&self, axis: &AxisDescription, object: Mux) -> Result<(PdoNumber, Target), CyclicError> {
        let (number, set_point) = self.node().scaled_set_point(object, NumberForm::Signed, 1.0)?;
        let counts_per_turn = self.counts_per_turn().await?;
        let velocity = self.has(axis.units.target_velocity, "a target velocity")?;
        let (rpm, speed) = self.highest_speed(velocity).await?;
        let kind = TargetKind::Position {
            actual: self.node().signal(axis.object(POSITION_ACTUAL_VALUE))?,
            counts_per_turn,
            counts_per_s: rpm / 60.0 * counts_per_turn,
            speed,
        };
        let last_sent = self.read_number(axis.object(POSITION_ACTUAL_VALUE)).await?;
        Ok((number, Target { set_point, limits: self.limits(object).await?, kind, last_sent }))
    }

    /// The highest speed that the drive follows, r/min, and what limits it: the target velocity as far as it acts (607Fh, 6080h, its motor).
    async fn highest_speed(&self, velocity: Quantity) -> Result<(f64, Bound), Error> {
        let bound = Bound::from(self.limits(velocity.object).await?);
        Ok((bound.high as f64 * self.step_of(velocity).await?, bound))
    }

    /// The TPDO with the statusword that is sent without a request, the one of the set-point's number first, then the
    /// one that comes with SYNC; and how often it comes.
    fn statusword_carrier(
        &self,
        description: &Description,
        number: PdoNumber,
        mapped: &Mapped,
    ) -> Result<(PdoNumber, Cadence), CyclicError> {
        let answers = description.pdo.event_trigger == EventTrigger::AnswersRpdo;
        let statusword = self.place(STATUSWORD);
        let carriers = mapped.tpdos.iter().filter(|pdo| carries(&pdo.map, statusword));
        let regular = carriers.filter_map(|pdo| {
            let answers = answers && pdo.pdo.number == number;
            Some((pdo.pdo.number != number, cadence_of(pdo, answers)?, pdo.pdo.number))
        });
        if let Some((_, cadence, number)) = regular.min() {
            return Ok((number, cadence));
        }
        // Not mapped at all, or on events only.
        self.node().signal::<u16>(statusword)?;
        Err(CyclicError::OnEventsOnly { node: self.node().id() })
    }

    /// The controlword in the set-point's RPDO, or in one that does not carry the set-point a second time; else by SDO.
    fn controlword_path(&self, number: PdoNumber, mapped: &Mapped) -> ControlwordPath {
        let object = self.place(CONTROLWORD);
        let by_sdo = ControlwordPath::Sdo { object, sent: None };
        let together = mapped.rpdos.iter().any(|pdo| pdo.pdo.number == number && carries(&pdo.map, object));
        if !together {
            return by_sdo;
        }
        match self.node().set_point_in(number, object) {
            Ok(set_point) => ControlwordPath::Pdo(set_point),
            Err(_) => by_sdo,
        }
    }

    /// What else the set-point's RPDO carries is sent with it: as the device has it now, and with the mode.
    async fn preset_rpdos(&self, mapped: &Mapped, number: PdoNumber, mode: ModeOfOperation) -> Result<(), Error> {
        let Some(pdo) = mapped.rpdos.iter().find(|pdo| pdo.pdo.number == number) else { return Ok(()) };
        for object in &pdo.map.0 {
            let raw = match object.mux {
                mux if mux == self.place(MODES_OF_OPERATION) => u64::from(mode.0 as u8),
                mux => match self.node().upload(mux).await {
                    Ok(payload) => payload.raw().into(),
                    // An object that can only be written, or a gap.
                    Err(Error::Aborted { .. }) => 0,
                    Err(error) => return Err(error),
                },
            };
            let (node, mux) = (self.node().id(), object.mux);
            self.node().network().with_core(|core| core.image_mut().preset(node, number, mux, raw));
        }
        Ok(())
    }

    async fn position_signal<T: Sample>(&self, near: PdoNumber) -> Result<Option<Signal<T>>, Error> {
        let per_count = 1.0 / self.counts_per_turn().await?;
        Ok(self.signal_near(near, self.place(POSITION_ACTUAL_VALUE), NumberForm::Signed, per_count))
    }

    /// An object in this TPDO, or else in another one.
    fn signal_near<T: Sample>(&self, near: PdoNumber, mux: Mux, form: NumberForm, per_count: f64) -> Option<Signal<T>> {
        let found = [Some(near), None].map(|number| self.node().scaled_signal(mux, number, form, per_count).ok());
        found.into_iter().flatten().next()
    }

    /// A physical value, if it is mapped in the form that the model's table has.
    async fn quantity_signal<T: Sample>(
        &self,
        description: &Description,
        near: PdoNumber,
        quantity: Option<Quantity>,
    ) -> Result<Option<Signal<T>>, Error> {
        let Some(quantity) = quantity else { return Ok(None) };
        let Some(row) = description.row(quantity.object) else { return Ok(None) };
        let per_count = self.step_of(quantity).await?;
        let as_in_sdo = (row.data_type, per_count);
        let in_tpdo = description.pdo.mapping.tpdo_form(quantity.object);
        // One count in the TPDO is so many of those by SDO.
        let in_tpdo = in_tpdo.map(|form| (form.data_type, per_count * f64::from(form.divisor)));
        let (data_type, per_count) = in_tpdo.unwrap_or(as_in_sdo);
        let form = if data_type.is_signed() { NumberForm::Signed } else { NumberForm::Unsigned };
        let signal = self.signal_near::<T>(near, quantity.object, form, per_count);
        // Mapped with another length it is something else.
        Ok(signal.filter(|signal| signal.field().bits as usize == data_type.size() * 8))
    }
}

/// Every PDO that a model has.
fn pdos_of(description: &Description) -> impl Iterator<Item = PdoId> {
    let parameters = description.dictionary.rows().iter().map(|row| row.mux()).filter(|mux| mux.sub_index == 1);
    parameters
        .filter_map(|mux| PdoId::of_object(mux.index))
        .filter_map(|(pdo, is_mapping)| (!is_mapping).then_some(pdo))
}

/// How often a TPDO is sent without a request, if it does. With `answers` it is sent for each RPDO of its number.
fn cadence_of(pdo: &PdoConfig, answers: bool) -> Option<Cadence> {
    let time = |time: Option<Duration>| time.filter(|time| !time.is_zero());
    let inhibited = time(pdo.inhibit_time);
    match pdo.transmission {
        _ if answers => Some(inhibited.map_or(Cadence::Cycles(1), Cadence::Time)),
        TransmissionType(every @ 1..=240) => Some(Cadence::Cycles(every.into())),
        // Neither timer counts for the other types (CiA 301, 7.5.2.37).
        TransmissionType::EVENT_MANUFACTURER | TransmissionType::EVENT_PROFILE => {
            time(pdo.event_time).map(|time| Cadence::Time(time.max(inhibited.unwrap_or_default())))
        }
        _ => None,
    }
}

fn carries(map: &PdoMap, mux: Mux) -> bool {
    map.find(mux).is_some()
}

#[cfg(test)]
mod tests {
    use canopen::od::{Entry, Index, Table};
    use devices::row::{U32, ro};
    use devices::servo::CIA402;

    use super::*;

    static ROWS: [Entry; 1] = [ro(0x1000, 0, U32, devices::name!("Device type"))];
    static INDEX: Index<1> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);
    static SPEED_ONLY: Description = Description { dictionary: &TABLE, ..CIA402 };

    #[test]
    fn a_drive_without_607ah_takes_no_positions_in_cycles() {
        for mode in [ModeOfOperation::INTERPOLATED_POSITION, ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION] {
            assert!(set_point_of(&CIA402, &CIA402.axes[0], mode).is_some(), "{mode}");
            assert!(set_point_of(&SPEED_ONLY, &CIA402.axes[0], mode).is_none(), "{mode}");
        }
    }
}
