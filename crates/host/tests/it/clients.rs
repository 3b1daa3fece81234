//! Clients of one network, in virtual time: what one has moved is stopped when it goes, and it takes no guard from another. They speak
//! CiA 309-3, as those of `ferrodrive gateway` do.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use host::clients::{Client, Clients};
use master::gateway::Session;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, StationId, Stimulus, World, block_on};

/// A drive that watches for silence, one that watches for heartbeats, one that watches for nothing.
const SERVO: u8 = 4;
const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const MODELS: [(&str, u8); 3] = [("zlac8030l", SERVO), ("m4230e17b50", JOINT), ("zlim42c", STEPPER)];

struct Bench {
    world: World,
    network: Network,
    master: StationId,
    notes: Rc<RefCell<Vec<String>>>,
}

/// A client and what it has said.
struct Talker {
    session: Session,
    client: Client,
    said: u32,
}

impl Talker {
    fn new(network: &Network, clients: &Clients) -> Self {
        Self { session: Session::new(network.clone()), client: clients.join(), said: 0 }
    }

    /// Says a line; the answer without its number.
    async fn ask(&mut self, line: &str) -> String {
        self.said += 1;
        let line = format!("[{}] {line}", self.said);
        self.client.guard(self.session.about_to_move(&line)).await;
        let answer = self.session.answer(&line).await.expect("it is a command");
        answer.trim_end().strip_prefix(&format!("[{}] ", self.said)).expect("its number").to_owned()
    }

    /// Has a drive turn, by CiA 402: mode 3, shutdown, switch on, enable operation. A joint is enabled by the last of them.
    async fn turn(&mut self, node: u8) {
        for line in ["w 0x6060 0 i8 3", "w 0x6083 0 u32 100", "w 0x6040 0 u16 6", "w 0x6040 0 u16 7"] {
            if node != JOINT || line.contains("6060") {
                assert_eq!(self.ask(&format!("{node} {line}")).await, "OK", "node {node}: {line}");
            }
        }
        for line in ["w 0x6040 0 u16 15", "w 0x60FF 0 i32 60"] {
            assert_eq!(self.ask(&format!("{node} {line}")).await, "OK", "node {node}: {line}");
        }
    }

    /// It goes, as at the end of its connection.
    fn go(self) {
        self.client.let_go(self.session.moved());
    }
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::M1, 3);
        let network = Network::new();
        let master = world.add_station(network.clone());
        for (name, number) in MODELS {
            let model = devices::model(name).unwrap();
            let drive = order(model, &Order::new(model, NodeId::new(number).unwrap(), Bitrate::M1)).unwrap();
            world.add_drive(number, drive).unwrap();
        }
        world.run_for(Duration::from_secs(2));
        Self { world, network, master, notes: Rc::default() }
    }

    /// Runs a script of clients to its end; the guards and stops go on for `after` the script.
    fn run<T>(&mut self, after: Duration, script: impl AsyncFnOnce(&Network, &Clients) -> T) -> T {
        let network = self.network.clone();
        let notes = Rc::clone(&self.notes);
        let drive = async |node: NodeId| {
            let model = MODELS.iter().find(|(_, number)| *number == node.raw()).map(|(name, _)| *name);
            let model = model.and_then(devices::model).ok_or("a stranger")?;
            Ok(Drive::new(network.node(node), model))
        };
        let note = move |text: &str| notes.borrow_mut().push(text.to_owned());
        let whole = async {
            let (clients, serving) = Clients::of(&network, "this gateway", drive, note);
            let script = async {
                let done = script(&network, &clients).await;
                network.sleep(after).await;
                done
            };
            tokio::select! {
                done = script => done,
                () = serving => unreachable!("the script has clients"),
            }
        };
        block_on(&mut self.world, whole).unwrap()
    }

    fn speed(&mut self, number: u8) -> f64 {
        self.world.report(number).unwrap().velocity_rpm.abs()
    }

    fn noted(&self, part: &str) -> String {
        let notes = self.notes.borrow();
        notes.iter().find(|note| note.contains(part)).unwrap_or_else(|| panic!("no {part:?} in {notes:?}")).clone()
    }
}

const SOON: Duration = Duration::from_secs(1);

#[test]
fn a_client_that_goes_has_what_it_moved_stopped_and_no_other() {
    for number in [SERVO, JOINT, STEPPER] {
        let mut bench = Bench::new();
        let mover = bench.run(SOON, async |network, clients| {
            let (mut mover, mut looker) = (Talker::new(network, clients), Talker::new(network, clients));
            mover.turn(number).await;
            network.sleep(SOON).await;
            assert!(looker.ask(&format!("{number} r 0x6041 0 u16")).await.parse::<u16>().is_ok());
            looker.go();
            mover
        });
        assert!(bench.speed(number) > 50.0, "node {number}: a client that only looked has gone");
        bench.run(SOON, async |network, clients| {
            // Its requests go to those who serve now.
            let client = clients.join();
            let mut mover = Talker { client, ..mover };
            mover.turn(number).await;
            network.sleep(SOON).await;
            mover.go();
        });
        assert!(bench.speed(number) < 1.0, "node {number}");
        bench.noted(&format!("node {number}: its client has gone; it has been quick-stopped and stands"));
        assert!(bench.network.moved().is_empty(), "node {number}");
    }
}

/// The joint watches for the heartbeat of its host (M joint manual, 5.11.2), which a guard sends, for 2000 ms.
#[test]
fn a_client_that_goes_leaves_the_drives_of_another_guarded() {
    let mut bench = Bench::new();
    bench.run(SOON, async |network, clients| {
        let (mut first, mut second) = (Talker::new(network, clients), Talker::new(network, clients));
        first.turn(JOINT).await;
        second.turn(JOINT).await;
        first.go();
        network.sleep(SOON).await;
        second.turn(JOINT).await;
        network.sleep(SOON).await;
        assert!(network.guarded(NodeId::new(JOINT).unwrap()).is_some());
        // It stays: what follows is the end of the whole program.
        std::mem::forget(second);
    });
    assert!(bench.speed(JOINT) > 50.0);
    bench.world.remove(bench.master);
    bench.world.run_for(Duration::from_secs(4));
    assert!(bench.speed(JOINT) < 1.0, "{}", bench.speed(JOINT));
}

#[test]
fn a_guard_is_given_back_when_the_last_has_gone_that_needed_it() {
    let mut bench = Bench::new();
    let joint = NodeId::new(JOINT).unwrap();
    bench.run(SOON, async |network, clients| {
        let (mut first, mut second) = (Talker::new(network, clients), Talker::new(network, clients));
        first.turn(JOINT).await;
        second.turn(JOINT).await;
        for (client, held) in [(first, true), (second, false)] {
            client.go();
            network.sleep(SOON).await;
            assert_eq!(network.guarded(joint).is_some(), held);
        }
    });
    // Nothing watches any more: an end of the program does not raise an alarm (20h: heartbeat of the host lost).
    bench.world.remove(bench.master);
    bench.world.run_for(Duration::from_secs(4));
    assert_eq!(bench.world.report(JOINT).unwrap().error_code, 0);
}

#[test]
fn a_drive_that_is_not_reached_is_named_with_what_it_does_by_itself() {
    let mut bench = Bench::new();
    let mover = bench.run(SOON, async |network, clients| {
        let mut mover = Talker::new(network, clients);
        mover.turn(SERVO).await;
        mover.turn(STEPPER).await;
        mover
    });
    // Nothing of the stepper's model watches over a host (ZLIM42-C user manual, 5.4).
    bench.noted("node 2: nothing stops it when this gateway dies");
    for number in [SERVO, STEPPER] {
        bench.world.apply(Place::node(number), &Stimulus::CableCut(true)).unwrap().unwrap();
    }
    bench.run(SOON, async |_, clients| {
        let client = clients.join();
        Talker { client, ..mover }.go();
    });
    let servo = bench.noted("its client has gone: node 4 may still be moving");
    assert!(servo.contains("without this gateway it stops by itself 1000 ms after the last frame for it"), "{servo}");
    let stepper = bench.noted("its client has gone: node 2 may still be moving");
    assert!(!stepper.contains("without this gateway"), "{stepper}");
    bench.world.run_for(SOON);
    assert!(bench.speed(SERVO) < 1.0 && bench.speed(STEPPER) > 50.0);
}
