//! What a command has in its hands: the network, what is known of its nodes, and how long to wait. What is around it (a terminal, a
//! page) is a [`Shell`].

use std::collections::BTreeMap;
use std::pin::Pin;
use std::rc::Rc;
use std::time::Duration;

use canopen::NodeId;
use canopen::object::DEVICE_TYPE;
use cia402::object::{CONTROLWORD, STATUSWORD};
use cia402::{PowerCommand, PowerState, Statusword};
use host::network::heard::Counted;
use master::decode::Decoder;
use master::drive::Drive;
use master::explain::Overheard;
use master::identify::Knowledge;
use master::{Error, Gear, Network, Node};
use words::models::{self, Description};

use crate::failure::Failure;

/// Time for a frame without an answer (NMT) to get onto the bus before a command ends.
const SETTLING_TIME: Duration = Duration::from_millis(50);

/// How long a quick stop may be held up by a look at the statusword: drives answer within a few milliseconds.
const GLANCE: Duration = Duration::from_millis(50);

/// Counts the frames that others have sent since it was called last.
pub type Others = Box<dyn FnMut(&mut Counted, &mut Decoder)>;

/// What is around a command.
pub trait Shell {
    /// Shows what is going on, in place of what was shown before.
    fn show(&self, text: String);

    /// Whether that is seen.
    fn is_shown(&self) -> bool;

    /// Notes something that stays.
    fn note(&self, text: &str);

    /// Whether a note, by its key, has not been made yet where it would be seen still.
    fn is_new(&self, key: &str) -> bool;

    /// The frames that others send from now on.
    fn others(&self) -> Others;

    /// What others send within a time.
    fn overhear(&self, time: Duration) -> Pin<Box<dyn Future<Output = Overheard> + '_>>;
}

/// What holds the drives beside the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holding {
    /// Nothing: what goes on when the command has ended is not held any more.
    Unheld,
    /// The bus is the command's own, and ends with it.
    OwnBus,
    /// A host: it guards each drive, and stops what its session does not hold.
    Host {
        /// The session may do more to the bus than stop its drives.
        in_control: bool,
    },
}

/// A model that need not be found out.
#[derive(Clone, Copy, Debug)]
pub enum Stated {
    /// By the embedded bus whose drive it is, or by a host that has found it out.
    ByBus(&'static Description),
    /// By the user, who may be wrong.
    ByUser(&'static Description),
}

impl Stated {
    /// The model.
    pub const fn description(self) -> &'static Description {
        match self {
            Self::ByBus(profile) | Self::ByUser(profile) => profile,
        }
    }
}

/// See the [module](self).
pub struct Context {
    /// The bus as the master sees it.
    pub network: Network,
    /// What is around the command.
    pub shell: Rc<dyn Shell>,
    /// The bus as it was named.
    pub bus_name: String,
    /// Longest wait for each answer.
    pub timeout: Duration,
    /// The models that need not be found out.
    pub models: BTreeMap<NodeId, Stated>,
    /// What stands behind the shafts.
    pub gears: BTreeMap<NodeId, Gear>,
    /// Programs read what is printed.
    pub json: bool,
    /// What holds the drives beside the command.
    pub holding: Holding,
}

impl core::fmt::Debug for Context {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Context").field("bus_name", &self.bus_name).finish_non_exhaustive()
    }
}

impl Context {
    /// A node, to be waited for as long as the command line says.
    pub fn node(&self, id: NodeId) -> Node {
        self.network.node(id).with_timeout(self.timeout)
    }

    /// A decoder that knows the stated models.
    pub fn decoder(&self) -> Decoder {
        let mut decoder = Decoder::knowing(self.network.models());
        for (node, stated) in &self.models {
            decoder.set_model(*node, stated.description());
        }
        decoder
    }

    /// Shows what is going on.
    pub fn show(&self, text: impl Into<String>) {
        self.shell.show(text.into());
    }

    /// Whether what is going on is seen.
    pub fn is_shown(&self) -> bool {
        self.shell.is_shown()
    }

    /// True if programs read what is printed.
    pub const fn prints_json(&self) -> bool {
        self.json
    }

    /// True on a virtual bus of this command alone.
    pub fn is_embedded(&self) -> bool {
        self.holding == Holding::OwnBus
    }

    /// Which model a node is as the user or the embedded bus says.
    pub fn stated_model(&self, id: NodeId) -> Option<&'static Description> {
        self.models.get(&id).map(|stated| stated.description())
    }

    /// Whether this is a line for a host: in control, or not.
    pub const fn in_control(&self) -> Option<bool> {
        match self.holding {
            Holding::Host { in_control } => Some(in_control),
            Holding::Unheld | Holding::OwnBus => None,
        }
    }

    /// What is known of a node's model: as stated, if the node does not contradict, else as its identity and objects
    /// say.
    async fn knowledge_of(&self, node: &Node) -> Result<Knowledge, Failure> {
        match self.models.get(&node.id()) {
            Some(Stated::ByBus(model)) => return Ok((*model).into()),
            Some(Stated::ByUser(model)) => {
                Drive::new(node.clone(), model).check_identity().await?;
                return Ok((*model).into());
            }
            None => {}
        }
        Ok(master::identify::knowledge(node).await?)
    }

    /// All models that need not be found out.
    pub fn stated_models(&self) -> BTreeMap<NodeId, &'static Description> {
        self.models.iter().map(|(node, stated)| (*node, stated.description())).collect()
    }

    /// What stands behind the shaft of a drive, as the machine file says.
    fn gear(&self, id: NodeId) -> Gear {
        self.gears.get(&id).copied().unwrap_or(Gear::DIRECT)
    }

    /// Longest wait for each answer.
    pub const fn timeout(&self) -> Duration {
        self.timeout
    }

    /// A drive of a known or guessed model, for commands that need one. A guess is reported.
    ///
    /// # Errors
    /// The model is not known; errors of the master.
    pub async fn known_drive(&self, id: NodeId) -> Result<Drive, Failure> {
        let drive = self.drive(id).await?;
        if drive.description().is_some() {
            return Ok(drive);
        }
        Err(Failure::new(format!("the model of node {id} is not known"))
            .of_kind("unknown_model")
            .at_node(id)
            .because("its identity (1018h) and objects fit no model, or more than one")
            .next(format!(
                "name it with --model {id}=FILE.eds, its maker's data sheet, or --model {id}=MODEL, where MODEL is one of: {}",
                models::names()
            )))
    }

    /// A drive, of a known model or not. A guess is reported.
    ///
    /// # Errors
    /// Those of the master.
    pub async fn drive(&self, id: NodeId) -> Result<Drive, Failure> {
        self.drive_at(self.node(id)).await.inspect(|drive| self.note_guess(drive))
    }

    async fn drive_at(&self, node: Node) -> Result<Drive, Failure> {
        let (gear, knowledge) = (self.gear(node.id()), self.knowledge_of(&node).await?);
        Ok(Drive::known_as(node, knowledge).behind(gear))
    }

    /// A drive, for commands that may refuse to work with a guess, which is then reported with the refusal.
    ///
    /// # Errors
    /// Those of the master.
    pub async fn drive_without_note(&self, id: NodeId) -> Result<Drive, Failure> {
        self.drive_at(self.node(id)).await
    }

    /// Notes if what follows rests on a guess. Where all models that answer so have the same objects, it does not.
    pub fn note_guess(&self, drive: &Drive) {
        let Some(guess) = drive.guess().filter(|guess| guess.evidence().is_some() && !self.json) else { return };
        let id = drive.node().id();
        let fitting: Vec<_> = guess.fitting().map(|model| model.name).collect();
        let key = format!("{} node {id} taken for {}", self.bus_name, guess.description().name);
        let how = models::how_to_say(id, &fitting);
        self.note_once(
            &key,
            &format!("node {id}: its model is not certain: {guess}, which is assumed; to be sure: {how}"),
        );
    }

    /// Warns people of what may happen to a motor. On an embedded bus there is none; programs read the report.
    pub fn warn(&self, text: &str) {
        if !self.is_embedded() {
            self.note(text);
        }
    }

    /// Notes what would be the same with every call: at a terminal once, in a file or a pipe each time.
    pub fn note_once(&self, key: &str, text: &str) {
        if !self.json && self.shell.is_new(key) {
            self.note(text);
        }
    }

    /// Notes something for people; programs read the report.
    pub fn note(&self, text: &str) {
        if !self.json {
            self.shell.note(text);
        }
    }

    /// Refuses a node-ID that another device has: two nodes with one node-ID disturb each other.
    ///
    /// # Errors
    /// That it is in use.
    pub async fn expect_free(&self, new: NodeId) -> Result<(), Failure> {
        let answer = self.node(new).upload(DEVICE_TYPE).await;
        // A node that is stopped answers no SDO.
        if matches!(answer, Err(Error::NoAnswer { .. })) && !self.network.seen().contains(new) {
            return Ok(());
        }
        Err(Failure::new(format!("node-ID {new} is in use: a node {new} is on the bus"))
            .at_node(new)
            .because("nothing was set")
            .next("choose another, or give that node another one first; ferrodrive scan shows the nodes"))
    }

    /// A drive that is to be stopped: as what the user takes it for, be that right or wrong. It is not asked first for the record of
    /// a server.
    ///
    /// # Errors
    /// Those of the master.
    pub async fn drive_to_stop(&self, id: NodeId) -> Result<Drive, Failure> {
        let node = self.node(id).by_server_in_use();
        match self.stated_model(id) {
            Some(model) => Ok(Drive::new(node, model).behind(self.gear(id))),
            None => self.drive_at(node).await.inspect(|drive| self.note_guess(drive)),
        }
    }

    /// Quick stop, whatever the node is doing, unless it soon says that its motor has no power (statusword bit 4): a drive
    /// without the state machine would energise the motor to hold it.
    ///
    /// # Errors
    /// Those of SDO.
    pub async fn quick_stop(&self, id: NodeId) -> Result<(), Error> {
        // Nor does it wait for the record of a server.
        let node = self.node(id).by_server_in_use();
        let statusword = node.clone().with_timeout(GLANCE).read::<u16>(STATUSWORD).await.map(Statusword);
        let enabled = |word: Statusword| word.state() == Some(PowerState::OperationEnabled);
        if statusword.is_ok_and(|word| !word.has(Statusword::VOLTAGE_ENABLED) && !enabled(word)) {
            return Ok(());
        }
        node.write(CONTROLWORD, PowerCommand::QuickStop.controlword().0).await
    }

    /// Waits until frames are sent that have no answer.
    pub async fn settle(&self) {
        self.network.sleep(SETTLING_TIME).await;
    }
}
