//! What a command of this program has in its hands beside what every command has ([`console::context::Context`]): the machine file, the
//! frames that pass, the world, and what is to be put back at its end.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::pin::Pin;
use std::rc::Rc;
use std::time::Duration;

use can::BusFrame;
use canopen::NodeId;
use console::context::{Context as OnBus, Holding, Others, Shell, Stated};
use master::explain::Overheard;
use master::{Gear, Network};
use sim::recorder::LiveValues;
use tokio::sync::broadcast::error::TryRecvError;
use transport::BusSpec;

use crate::failure::Failure;
use crate::frames::tap::Traffic;
use crate::global::Global;
use crate::progress::Progress;
use crate::remembered::Remembered;
use host::{Wire, WorldDoor};
use machine::file::{self, Machine};
use words::models::{self, Description};

/// See the [module](self).
pub(crate) struct Context {
    on_bus: OnBus,
    /// Where to show what is going on.
    pub(crate) progress: Progress,
    /// The frames that pass.
    pub(crate) traffic: Traffic,
    bus: BusSpec,
    /// The machine, where a file describes it.
    pub(crate) machine: Option<Machine>,
    /// The world around the drives, where they are virtual ones whose time passes with the clock.
    pub(crate) world: Option<WorldDoor>,
    /// True values from the simulation, where the drives are virtual ones of this program.
    pub(crate) true_values: Option<LiveValues>,
    /// What the bus says beside frames.
    pub(crate) wire: Wire,
    /// The highest counter of SYNC, where it has one.
    pub(crate) sync_counter: Option<u8>,
    remembered: Rc<RefCell<Remembered>>,
    restorer: RefCell<Option<Restorer>>,
}

/// What puts back what a command has written.
#[derive(Clone)]
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
            Self::Conform(_) => true,
            Self::Capture(restorer) => !restorer.is_done(),
            Self::Captures(ways_back) => !ways_back.is_empty(),
        }
    }
}

impl Deref for Context {
    type Target = OnBus;

    fn deref(&self) -> &OnBus {
        &self.on_bus
    }
}

/// A terminal, or a file or pipe in its place.
struct Terminal {
    network: Network,
    progress: Progress,
    traffic: Traffic,
    remembered: Rc<RefCell<Remembered>>,
}

impl Shell for Terminal {
    fn show(&self, text: String) {
        self.progress.show(text);
    }

    fn is_shown(&self) -> bool {
        self.progress.is_shown()
    }

    fn note(&self, text: &str) {
        self.progress.note(text);
    }

    fn is_new(&self, key: &str) -> bool {
        self.remembered.borrow_mut().is_new(key)
    }

    fn others(&self) -> Others {
        let mut others = self.traffic.of_others();
        Box::new(move |counted, decoder| {
            loop {
                match others.try_recv() {
                    Ok(passed) => counted.note(decoder, &passed.frame),
                    // What was missed is of the kinds that come again.
                    Err(TryRecvError::Lagged(_)) => {}
                    Err(TryRecvError::Empty | TryRecvError::Closed) => return,
                }
            }
        })
    }

    fn overhear(&self, time: Duration) -> Pin<Box<dyn Future<Output = Overheard> + '_>> {
        self.traffic.listen();
        Box::pin(async move {
            let mut heard = Overheard::from(self.network.now());
            let listening = async {
                loop {
                    let BusFrame { at, frame, .. } = self.traffic.next().await;
                    heard.note(&frame, at);
                }
            };
            tokio::select! {
                () = listening => {}
                () = self.network.sleep(time) => {}
            }
            heard.until(self.network.now());
            heard
        })
    }
}

impl Context {
    /// The models that were named, for a file that is not of this bus: those of the embedded bus only where a machine file describes it.
    pub(crate) fn named_models(&self) -> impl Iterator<Item = (NodeId, &'static Description)> {
        let is_described = !matches!(self.bus, BusSpec::Sim { file: None });
        let is_named = move |stated: &Stated| is_described || matches!(stated, Stated::ByUser(_));
        self.models
            .iter()
            .filter(move |(_, stated)| is_named(stated))
            .map(|(node, stated)| (*node, stated.description()))
    }

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
        // On a bus of its own everything is known, and nothing of it lasts.
        let remembered = if embedded.is_some() { Remembered::default() } else { Remembered::by_people() };
        let remembered = Rc::new(RefCell::new(remembered));
        let shell = Terminal {
            network: network.clone(),
            progress: progress.clone(),
            traffic: traffic.clone(),
            remembered: Rc::clone(&remembered),
        };
        let on_bus = OnBus {
            network,
            shell: Rc::new(shell),
            bus_name: global.bus.to_string(),
            timeout: global.timeout,
            models,
            gears: gears(machine.as_ref()),
            json: global.json,
            holding: if embedded.is_some() { Holding::OwnBus } else { Holding::Unheld },
        };
        Self {
            on_bus,
            machine,
            sync_counter,
            world: None,
            true_values: None,
            wire: Wire::default(),
            progress,
            traffic,
            bus: global.bus.clone(),
            restorer: RefCell::new(None),
            remembered,
        }
    }

    /// The bus as it was named.
    pub(crate) const fn bus(&self) -> &BusSpec {
        &self.bus
    }

    /// Listens for this long, or without end, but on an embedded bus for `embedded`: in virtual time Ctrl-C does not come.
    /// `work` ends by itself only with an error.
    pub(crate) async fn listen_for(
        &self,
        duration: Option<Duration>,
        embedded: Duration,
        work: impl Future<Output = Result<(), Failure>>,
    ) -> Result<(), Failure> {
        match duration.or(self.is_embedded().then_some(embedded)) {
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
        let restorer = self.restorer.borrow().clone().filter(Restorer::has_written)?;
        let left = match restorer {
            Restorer::Conform(restorer) => restorer.restore().await,
            Restorer::Capture(restorer) => restorer.restore().await,
            Restorer::Captures(ways_back) => ways_back.restore().await,
        };
        // Not before: what a signal interrupts is begun anew.
        self.restorer.take();
        Some(left)
    }

    /// What stands behind the shafts of all drives of the machine file.
    pub(crate) fn gears(&self) -> BTreeMap<NodeId, Gear> {
        self.on_bus.gears.clone()
    }

    /// Keeps for completion which nodes were heard, and which models they are as far as that was said.
    pub(crate) fn remember_nodes(&self) {
        let heard = self.network.seen();
        let nodes = heard.iter().map(|node| (node, self.stated_model(node).map(|model| model.name)));
        self.remembered.borrow_mut().heard(&self.bus.to_string(), nodes);
    }

    /// Says of which nodes there are two.
    pub(crate) fn note_twins(&self) {
        let seen = self.network.seen();
        for (node, twins) in seen.iter().filter_map(|node| Some((node, self.network.node(node).facts().twins?))) {
            self.note(&master::core::two_devices(node, twins));
        }
    }
}

fn gears(machine: Option<&Machine>) -> BTreeMap<NodeId, Gear> {
    let nodes = |machine: &Machine| machine.models().map(|(node, _)| (node, machine.gear(node))).collect();
    machine.map(nodes).unwrap_or_default()
}
