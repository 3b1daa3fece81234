//! What a command has in its hands: the network, what is known of its nodes, and how long to wait.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::Duration;

use canopen::NodeId;
use cia402::object::{CONTROLWORD, STATUSWORD};
use cia402::{PowerCommand, PowerState, Statusword};
use master::decode::Decoder;
use master::drive::Drive;
use master::identify::Knowledge;
use master::{Error, Gear, Network, Node};
use sim::recorder::LiveValues;
use transport::BusSpec;

use crate::failure::Failure;
use crate::frames::tap::Traffic;
use crate::global::Global;
use crate::progress::Progress;
use crate::remembered::Remembered;
use host::{Wire, WorldDoor};
use machine::file::{self, Machine};
use words::models::{self, Description};

/// Time for a frame without an answer (NMT) to get onto the bus before a command ends.
const SETTLING_TIME: Duration = Duration::from_millis(50);

/// How long a quick stop may be held up by a look at the statusword: drives answer within a few milliseconds.
const GLANCE: Duration = Duration::from_millis(50);

/// See the [module](self).
pub(crate) struct Context {
    /// The bus as the master sees it.
    pub(crate) network: Network,
    /// Where to show what is going on.
    pub(crate) progress: Progress,
    /// The frames that pass.
    pub(crate) traffic: Traffic,
    bus: BusSpec,
    /// The machine, where a file describes it.
    pub(crate) machine: Option<Machine>,
    /// The world around the drives, where they are virtual ones whose time passes with the clock.
    pub(crate) world: Option<WorldDoor>,
    /// What is true of the drives, where they are virtual ones of this program.
    pub(crate) true_values: Option<LiveValues>,
    /// What the bus says beside frames.
    pub(crate) wire: Wire,
    /// The highest counter of SYNC, where it has one.
    pub(crate) sync_counter: Option<u8>,
    timeout: Duration,
    models: BTreeMap<NodeId, Stated>,
    json: bool,
    embedded: bool,
    remembered: RefCell<Remembered>,
    restorer: RefCell<Option<Restorer>>,
}

/// What puts back what a command has written.
pub(crate) enum Restorer {
    /// Of a case of the conformance suite.
    Conform(conform::Restorer),
    /// Of a capture.
    Capture(host::capture::Restorer),
    /// Of the captures of a host.
    Captures(host::capture::WaysBack),
}

impl Restorer {
    /// Something may be left to put back.
    fn has_written(&self) -> bool {
        match self {
            Self::Conform(_) | Self::Capture(_) => true,
            Self::Captures(ways_back) => !ways_back.is_empty(),
        }
    }
}

/// A model that need not be found out.
#[derive(Clone, Copy)]
enum Stated {
    /// By the embedded bus, whose drive it is.
    ByBus(&'static Description),
    /// By the user, who may be wrong.
    ByUser(&'static Description),
}

impl Stated {
    const fn description(self) -> &'static Description {
        match self {
            Self::ByBus(profile) | Self::ByUser(profile) => profile,
        }
    }
}

impl Context {
    /// A context for `network`. `embedded` are the drives of an embedded bus, which need no machine file; --model overrules
    /// both.
    pub(crate) fn new(
        global: &Global,
        network: Network,
        embedded: Option<&[(NodeId, &'static Description)]>,
        progress: Progress,
        traffic: Traffic,
    ) -> Self {
        let of_machine = global.machine.iter().filter(|_| embedded.is_none()).flat_map(Machine::models);
        let by_user =
            of_machine.chain(global.models.iter().copied()).map(|(node, model)| (node, Stated::ByUser(model)));
        let by_bus = embedded.unwrap_or_default().iter().map(|(node, model)| (*node, Stated::ByBus(model)));
        let models: BTreeMap<_, _> = by_bus.chain(by_user).collect();
        network.set_models(models::with_files(models.values().map(|stated| stated.description())));
        // The file of an embedded bus has been read once, to make the bus.
        let of_bus = match &global.bus {
            BusSpec::Sim { file: Some(path) } => file::read(path).ok(),
            _ => None,
        };
        let machine = of_bus.or_else(|| global.machine.clone());
        // What is typed comes after the file, and overrules it.
        let of_file = machine.iter().flat_map(Machine::sdo_servers);
        network.choose_sdo_servers(of_file.chain(global.sdo_servers.iter().copied()).collect::<Vec<_>>());
        let sync_counter = global.sync_counter.or(machine.as_ref().and_then(|machine| machine.sync_counter));
        network.sync_counter(sync_counter);
        Self {
            machine,
            sync_counter,
            world: None,
            true_values: None,
            wire: Wire::default(),
            network,
            progress,
            traffic,
            bus: global.bus.clone(),
            timeout: global.timeout,
            models,
            json: global.json,
            embedded: embedded.is_some(),
            // On a bus of its own everything is known, and nothing of it lasts.
            restorer: RefCell::new(None),
            remembered: RefCell::new(if embedded.is_some() { Remembered::default() } else { Remembered::by_people() }),
        }
    }

    /// A node, to be waited for as long as the command line says.
    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.network.node(id).with_timeout(self.timeout)
    }

    /// The bus as it was named.
    pub(crate) const fn bus(&self) -> &BusSpec {
        &self.bus
    }

    /// True if programs read what is printed.
    pub(crate) const fn prints_json(&self) -> bool {
        self.json
    }

    /// True on a virtual bus of this command alone.
    pub(crate) const fn is_embedded(&self) -> bool {
        self.embedded
    }

    /// Which model a node is as the user or the embedded bus says.
    pub(crate) fn stated_model(&self, id: NodeId) -> Option<&'static Description> {
        self.models.get(&id).map(|stated| stated.description())
    }

    /// What is known of a node's model: as stated, if the node does not contradict, else as its identity and objects
    /// say.
    async fn knowledge_of(&self, id: NodeId) -> Result<Knowledge, Failure> {
        match self.models.get(&id) {
            Some(Stated::ByBus(model)) => return Ok((*model).into()),
            Some(Stated::ByUser(model)) => {
                Drive::new(self.node(id), model).check_identity().await?;
                return Ok((*model).into());
            }
            None => {}
        }
        Ok(master::identify::knowledge(&self.node(id)).await?)
    }

    /// All models that need not be found out.
    pub(crate) fn stated_models(&self) -> BTreeMap<NodeId, &'static Description> {
        self.models.iter().map(|(node, stated)| (*node, stated.description())).collect()
    }

    /// A decoder that knows the stated models.
    pub(crate) fn decoder(&self) -> Decoder {
        let mut decoder = Decoder::knowing(self.network.models());
        for (node, stated) in &self.models {
            decoder.set_model(*node, stated.description());
        }
        decoder
    }

    /// Listens for this long, or without end, but on an embedded bus for `embedded`: in virtual time Ctrl-C does not come.
    /// `work` ends by itself only with an error.
    pub(crate) async fn listen_for(
        &self,
        duration: Option<Duration>,
        embedded: Duration,
        work: impl Future<Output = Result<(), Failure>>,
    ) -> Result<(), Failure> {
        match duration.or(self.embedded.then_some(embedded)) {
            None => work.await,
            Some(limit) => tokio::select! {
                result = work => result,
                () = self.network.sleep(limit) => Ok(()),
            },
        }
    }

    /// Whatever ends the command, this puts back what it has written.
    pub(crate) fn restore_at_end(&self, restorer: Restorer) {
        self.restorer.replace(Some(restorer));
    }

    /// The command may have written what is to be put back.
    pub(crate) fn is_to_restore(&self) -> bool {
        self.restorer.borrow().as_ref().is_some_and(Restorer::has_written)
    }

    /// Puts back what the command has written, if it has; what could not be.
    pub(crate) async fn restore(&self) -> Option<Vec<String>> {
        let restorer = self.restorer.take().filter(Restorer::has_written)?;
        Some(match restorer {
            Restorer::Conform(restorer) => restorer.restore().await,
            Restorer::Capture(restorer) => restorer.restore().await,
            Restorer::Captures(ways_back) => ways_back.restore().await,
        })
    }

    /// What stands behind the shaft of a drive, as the machine file says.
    fn gear(&self, id: NodeId) -> Gear {
        self.machine.as_ref().map_or(Gear::DIRECT, |machine| machine.gear(id))
    }

    /// What stands behind the shafts of all drives of the machine file.
    pub(crate) fn gears(&self) -> BTreeMap<NodeId, Gear> {
        let nodes = self.machine.iter().flat_map(Machine::models).map(|(node, _)| node);
        nodes.map(|node| (node, self.gear(node))).collect()
    }

    /// Longest wait for each answer.
    pub(crate) fn timeout(&self) -> Duration {
        self.timeout
    }

    /// A drive of a known or guessed model, for commands that need one. A guess is reported.
    pub(crate) async fn known_drive(&self, id: NodeId) -> Result<Drive, Failure> {
        let drive = self.drive(id).await?;
        if drive.description().is_some() {
            return Ok(drive);
        }
        Err(Failure::new(format!("the model of node {id} is not known"))
            .of_kind("unknown_model")
            .at_node(id)
            .because("its identity (1018h) and objects fit no model, or more than one")
            .next(format!("name it with --model {id}=MODEL, where MODEL is one of: {}", models::names())))
    }

    /// A drive, of a known model or not. A guess is reported.
    pub(crate) async fn drive(&self, id: NodeId) -> Result<Drive, Failure> {
        let drive = self.drive_without_note(id).await?;
        self.note_guess(&drive);
        Ok(drive)
    }

    /// A drive, for commands that may refuse to work with a guess, which is then reported with the refusal.
    pub(crate) async fn drive_without_note(&self, id: NodeId) -> Result<Drive, Failure> {
        Ok(Drive::known_as(self.node(id), self.knowledge_of(id).await?).behind(self.gear(id)))
    }

    /// Notes if what follows rests on a guess. Where all models that answer so have the same objects, it does not.
    pub(crate) fn note_guess(&self, drive: &Drive) {
        let Some(guess) = drive.guess().filter(|guess| guess.evidence().is_some() && !self.json) else { return };
        let id = drive.node().id();
        let fitting: Vec<_> = guess.fitting().map(|model| model.name).collect();
        let key = format!("{} node {id} taken for {}", self.bus, guess.description().name);
        let how = models::how_to_say(id, &fitting);
        self.note_once(
            &key,
            &format!("node {id}: its model is not certain: {guess}, which is assumed; to be sure: {how}"),
        );
    }

    /// Keeps for completion which nodes were heard, and which models they are as far as that was said.
    pub(crate) fn remember_nodes(&self) {
        let heard = self.network.seen();
        let nodes = heard.iter().map(|node| (node, self.stated_model(node).map(|model| model.name)));
        self.remembered.borrow_mut().heard(&self.bus.to_string(), nodes);
    }

    /// Warns people of what may happen to a motor. On an embedded bus there is none; programs read the report.
    pub(crate) fn warn(&self, text: &str) {
        if !self.json && !self.embedded {
            self.progress.note(text);
        }
    }

    /// Notes what would be the same with every call: at a terminal once, in a file or a pipe each time.
    pub(crate) fn note_once(&self, key: &str, text: &str) {
        if !self.json && self.remembered.borrow_mut().is_new(key) {
            self.note(text);
        }
    }

    /// Prints a note on standard error; programs read the report.
    pub(crate) fn note(&self, text: &str) {
        if !self.json {
            self.progress.note(text);
        }
    }

    /// A drive that is to be stopped: as what the user takes it for, be that right or wrong.
    pub(crate) async fn drive_to_stop(&self, id: NodeId) -> Result<Drive, Failure> {
        match self.stated_model(id) {
            Some(model) => Ok(Drive::new(self.node(id), model).behind(self.gear(id))),
            None => self.drive(id).await,
        }
    }

    /// Quick stop, whatever the node is doing, unless it soon says that its motor has no power (statusword bit 4): a drive
    /// without the state machine would energise the motor to hold it.
    pub(crate) async fn quick_stop(&self, id: NodeId) -> Result<(), Error> {
        // Nor does it wait for the record of a server.
        self.network.choose_sdo_servers([]);
        let statusword = self.network.node(id).with_timeout(GLANCE).read::<u16>(STATUSWORD).await.map(Statusword);
        let enabled = |word: Statusword| word.state() == Some(PowerState::OperationEnabled);
        if statusword.is_ok_and(|word| !word.has(Statusword::VOLTAGE_ENABLED) && !enabled(word)) {
            return Ok(());
        }
        self.node(id).write(CONTROLWORD, PowerCommand::QuickStop.controlword().0).await
    }

    /// Says of which nodes there are two.
    pub(crate) fn note_twins(&self) {
        let seen = self.network.seen();
        for (node, twins) in seen.iter().filter_map(|node| Some((node, self.network.node(node).facts().twins?))) {
            self.note(&master::core::two_devices(node, twins));
        }
    }

    /// Waits until frames are sent that have no answer.
    pub(crate) async fn settle(&self) {
        self.network.sleep(SETTLING_TIME).await;
    }
}
