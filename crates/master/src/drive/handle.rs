//! The handle on a drive, and what all intents ask and write by: the objects as the model's table types them.

use std::time::Duration;

use canopen::Mux;
use canopen::od::Entry;
use cia402::object::{CONTROLWORD, MODES_OF_OPERATION_DISPLAY, STATUSWORD};
use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};
use devices::{AxisDescription, AxisId, Description, HostWatch, PowerStyle, Quantity};

use crate::error::{Access, Error};
use crate::gear::Gear;
use crate::identify::{Guess, Knowledge};
use crate::network::Node;

/// How often a drive is looked at while something is waited for: quick to a person, about 10 % of a 500 kbit/s bus
/// for two objects.
pub(super) const POLL: Duration = Duration::from_millis(10);

/// How long a drive that watches for silence is left without a request while its PDOs carry everything: much less than
/// any of their times as delivered (1000 ms).
const TALKING_INTERVAL: Duration = Duration::from_millis(100);

/// How long one step of the power state machine, or a change of mode, may take.
pub(super) const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// A drive on a network, or one axis of a drive that has several.
#[derive(Clone)]
pub struct Drive {
    pub(super) node: Node,
    pub(super) axis: AxisId,
    pub(super) description: Option<&'static Description>,
    /// Set where the description is only a guess.
    pub(super) guess: Option<Guess>,
    /// What is between its shaft and what is moved.
    pub(super) gear: Gear,
}

impl core::fmt::Debug for Drive {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let model = self.description.map(|description| description.name);
        let guessed = self.guess.is_some();
        f.debug_struct("Drive")
            .field("node", &self.node.id())
            .field("axis", &self.axis.0)
            .field("model", &model)
            .field("guessed", &guessed)
            .finish()
    }
}

impl Drive {
    /// A drive of a known model.
    pub const fn new(node: Node, description: &'static Description) -> Self {
        Self { node, axis: AxisId::FIRST, description: Some(description), guess: None, gear: Gear::DIRECT }
    }

    /// A drive of a model that is known this well. One that is guessed can be moved, and its parameters not be stored.
    pub fn known_as(node: Node, knowledge: Knowledge) -> Self {
        let (description, guess) = (knowledge.description(), knowledge.guess());
        Self { node, axis: AxisId::FIRST, description, guess, gear: Gear::DIRECT }
    }

    /// A CiA 402 drive of unknown model: it can be enabled, disabled, quick-stopped and reset, not moved or stored.
    pub const fn of_unknown_model(node: Node) -> Self {
        Self { node, axis: AxisId::FIRST, description: None, guess: None, gear: Gear::DIRECT }
    }

    /// Another axis of the same drive. What concerns the whole device (its parameter store, the watch over its host) is the
    /// same whichever axis it is asked of.
    ///
    /// # Errors
    /// [`Error::NoSuchAxis`] where the model has none of that number; [`Error::UnknownModel`].
    pub fn axis(&self, axis: AxisId) -> Result<Self, Error> {
        let other = Self { axis, ..self.clone() };
        other.motion("move another axis").map(|_| other)
    }

    /// The same behind a gear: all its angles, speeds and accelerations are those of the gear's output from here on. What an
    /// object holds, and what is reported of objects ([`limits`](Self::limits), [`explain`](crate::explain)), stays the
    /// drive's.
    #[must_use]
    pub fn behind(self, gear: Gear) -> Self {
        Self { gear, ..self }
    }

    /// What is between its shaft and what is moved.
    pub const fn gear(&self) -> Gear {
        self.gear
    }

    /// The same, whose answers are awaited for this long.
    pub(crate) fn asked_within(&self, timeout: Duration) -> Self {
        Self { node: self.node.clone().with_timeout(timeout), ..self.clone() }
    }

    /// Which axis this is.
    pub const fn axis_id(&self) -> AxisId {
        self.axis
    }

    /// What is known of this axis; `None` of an unknown model, or one that is not a drive.
    pub fn axis_description(&self) -> Option<&'static AxisDescription> {
        self.description?.axes.get(usize::from(self.axis.0))
    }

    /// The node that the axis is on, for requests of one's own.
    pub const fn node(&self) -> &Node {
        &self.node
    }

    /// The model's description, or of a guess the one to read and move with.
    pub const fn description(&self) -> Option<&'static Description> {
        self.description
    }

    /// Why its model is no more than a guess, if it is.
    pub fn guess(&self) -> Option<Guess> {
        self.guess.clone()
    }

    /// Checks that the node identifies itself as this model, and has the object that distinguishes it from others with
    /// that identity.
    ///
    /// # Errors
    /// [`Error::WrongModel`] when its device type or vendor differ, [`Error::OtherModel`] when it lacks that object;
    /// those of the SDO reads.
    pub async fn check_identity(&self) -> Result<(), Error> {
        let description = self.known("compare its identity")?;
        let (node, model) = (self.node.id(), description.title);
        let found = crate::identify::identity(&self.node).await?;
        if !found.matches(&description.identity) {
            let wanted = description.identity;
            return Err(Error::WrongModel { node, model, found, wanted });
        }
        match description.distinguishing_object {
            Some(object) if !crate::identify::has(&self.node, object).await? => {
                Err(Error::OtherModel { node, model, object })
            }
            _ => Ok(()),
        }
    }

    /// Checks that this value of this object means the same on every model that the drive may be.
    ///
    /// # Errors
    /// [`Error::GuessedModel`] where it does not and the model is no more than a guess.
    pub fn check_write(&self, mux: Mux, value: i64) -> Result<(), Error> {
        match self.guess().filter(|guess| !guess.may_write(mux, value)) {
            Some(guess) => Err(Error::GuessedModel { node: self.node.id(), intent: format!("write {mux}"), guess }),
            None => Ok(()),
        }
    }

    /// The statusword.
    ///
    /// # Errors
    /// Those of the SDO read.
    pub async fn statusword(&self) -> Result<Statusword, Error> {
        let object = self.place(STATUSWORD);
        match self.in_process_data(object, 16) {
            Some(raw) => Ok(Statusword(raw as u16)),
            None => self.node.read::<u16>(object).await.map(Statusword),
        }
    }

    /// The power state that a statusword of this model shows.
    pub(crate) fn power_state(&self, statusword: Statusword) -> Option<PowerState> {
        self.power_style().state(statusword)
    }

    pub(crate) fn power_style(&self) -> PowerStyle {
        self.axis_description().map_or(PowerStyle::Cia402, |axis| axis.power)
    }

    /// What the process image holds of an object, if it is as good as an answer by SDO: it came within the time of one poll,
    /// and after everything that was sent to the drive. A drive that watches for silence is asked by SDO now and then
    /// all the same: that keeps it content.
    fn in_process_data(&self, object: Mux, bits: u32) -> Option<u64> {
        let watches_for_silence =
            matches!(self.description.map(|description| description.host_watch), Some(HostWatch::Silence { .. }));
        let node = self.node.id();
        self.node.network().look(|core| {
            let received = core.image().value_of_length(node, object, bits)?;
            let (facts, now) = (core.facts(node), core.now());
            let fresh = now - received.at < POLL && facts.written_at.is_none_or(|at| at < received.at);
            let content = !watches_for_silence || facts.talked_to_at.is_some_and(|at| now - at < TALKING_INTERVAL);
            (fresh && content).then_some(received.raw)
        })
    }

    /// The mode that the drive is in.
    ///
    /// # Errors
    /// Those of the SDO read.
    pub async fn mode(&self) -> Result<ModeOfOperation, Error> {
        let display = self.axis_description().map_or(MODES_OF_OPERATION_DISPLAY, |axis| axis.mode_display);
        match self.in_process_data(display, 8) {
            Some(raw) => Ok(ModeOfOperation(raw as i8)),
            None => self.node.read::<i8>(display).await.map(ModeOfOperation),
        }
    }

    pub(super) async fn write_controlword(&self, controlword: Controlword) -> Result<(), Error> {
        self.node.write(self.place(CONTROLWORD), controlword.0).await
    }

    pub(crate) fn no_such_mode(&self, axis: &AxisDescription, mode: ModeOfOperation) -> Error {
        Error::NoSuchMode { node: self.node.id(), model: self.title(), mode, modes: axis.modes }
    }

    pub(crate) fn title(&self) -> &'static str {
        self.description.map_or("drive", |description| description.title)
    }

    /// What is known of this axis, or an error that says what it was needed for.
    pub(crate) fn motion(&self, intent: &'static str) -> Result<&'static AxisDescription, Error> {
        let description = self.known(intent)?;
        let (node, model, axes) = (self.node.id(), description.title, description.axes.len());
        self.axis_description().ok_or(Error::NoSuchAxis { node, model, axis: self.axis, axes })
    }

    /// Where this axis has an object of the standard.
    pub(crate) fn place(&self, object: Mux) -> Mux {
        self.axis_description().map_or(object, |axis| axis.object(object))
    }

    /// Where the axis has a quantity, or an error that says which is missing.
    pub(crate) fn has(&self, quantity: Option<Quantity>, what: &'static str) -> Result<Quantity, Error> {
        quantity.ok_or(Error::NoSuchQuantity { node: self.node.id(), model: self.title(), what })
    }

    /// The model's description, or an error that says what it was needed for.
    pub(crate) fn known(&self, intent: &'static str) -> Result<&'static Description, Error> {
        self.description.ok_or(Error::UnknownModel { node: self.node.id(), intent })
    }

    /// An error if a group or a base of this program moves the axis: its next cycle would take back what is written here.
    ///
    /// # Errors
    /// [`Error::InCycles`], with what was intended.
    pub fn check_unclaimed(&self, intent: &'static str) -> Result<(), Error> {
        let node = self.node.id();
        match self.node.network().is_claimed(node, self.place(CONTROLWORD)) {
            true => Err(Error::InCycles { node, intent }),
            false => Ok(()),
        }
    }

    /// The model's description, if it is more than a guess.
    pub(super) fn named(&self, intent: &'static str) -> Result<&'static Description, Error> {
        match self.guess() {
            Some(guess) => Err(Error::GuessedModel { node: self.node.id(), intent: intent.to_owned(), guess }),
            None => self.known(intent),
        }
    }

    /// The model's row of an object.
    pub(super) fn row(&self, mux: Mux, intent: &'static str) -> Result<&'static Entry, Error> {
        let description = self.known(intent)?;
        let slot = description.dictionary.find(mux);
        let slot = slot.map_err(|code| Error::Aborted { node: self.node.id(), mux, access: Access::Read, code })?;
        Ok(description.dictionary.row(slot))
    }

    /// Reads an object as the model's table types it.
    pub(crate) async fn read_number(&self, mux: Mux) -> Result<i64, Error> {
        let row = self.row(mux, "read an object by its model's table")?;
        if let Some(raw) = self.in_process_data(mux, row.data_type.size() as u32 * 8) {
            return Ok(row.data_type.value(raw as _));
        }
        let payload = self.node.upload(mux).await?;
        let (expected, received) = (row.data_type.size(), payload.as_bytes().len());
        if expected != received {
            return Err(Error::WrongLength { node: self.node.id(), mux, expected, received });
        }
        Ok(row.data_type.value(payload.raw()))
    }

    /// Writes an object as the model's table types it, after checking its limits.
    pub(super) async fn write_number(&self, mux: Mux, value: i64) -> Result<(), Error> {
        let row = self.check_number(mux, value).await?;
        let bytes = row.data_type.raw(value).to_le_bytes();
        self.node.download(mux, &bytes[..row.data_type.size()]).await
    }
}
