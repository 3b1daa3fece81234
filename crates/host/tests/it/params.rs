//! What a transaction has stored is proved by a person who switches the supply off and on.

use std::cell::Cell;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use can::Bitrate;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::{Mux, NodeId};
use host::network::Progress;
use host::network::params::{ApplyReport, Proof, Transaction};
use master::parameters::Parameters;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{Place, World};
use words::failure::Failure;
use words::models;

const NODE: u8 = 4;
const HEARTBEAT: Mux = PRODUCER_HEARTBEAT_TIME;

/// Longer than a drive takes to boot.
const WITHIN: Duration = Duration::from_secs(60);

/// Does what is asked of a person, and nothing else.
#[derive(Default)]
struct Person {
    is_asked: Cell<bool>,
}

impl Progress for Person {
    fn show(&self, _: String) {}

    fn count(&self, _: String) {}

    fn note(&self, text: &str) {
        assert_eq!(text, "now switch the supply of node 4 off and on again; waiting for its boot-up");
        assert!(!self.is_asked.replace(true), "asked once");
    }
}

/// Writes 200 ms as heartbeat time, stores it, and has that proved by a person who `obeys`.
fn proved(obeys: bool) -> Result<ApplyReport, Failure> {
    let model = models::resolve("zlac8030l").unwrap();
    let id = NodeId::new(NODE).unwrap();
    let mut world = World::new(Bitrate::K500, 1);
    let network = Network::new();
    world.add_station(network.clone());
    world.add_drive(NODE, order(model, &Order::new(model, id, Bitrate::K500)).unwrap()).unwrap();
    world.run_for(Duration::from_secs(2));
    let drive = Drive::new(network.node(id), model);
    let transaction = Transaction {
        address: false,
        save: true,
        prove: Some(Proof::PowerCycle),
        within: WITHIN,
        journal: None,
        on_kept: |_| (),
    };
    let wanted = Parameters { values: [(HEARTBEAT, vec![200, 0])].into(), ..Parameters::default() };
    let person = Person::default();
    let mut apply = pin!(transaction.apply(&person, &drive, &wanted, "wanted.toml".to_owned()));
    loop {
        if let Poll::Ready(ended) = apply.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return ended;
        }
        world.refresh();
        if obeys && person.is_asked.take() {
            world.apply(Place::node(NODE), &"power cycle".parse().unwrap()).unwrap().unwrap();
        }
        world.step();
    }
}

#[test]
fn a_power_cycle_proves_what_was_stored() {
    let report = proved(true).unwrap_or_else(|failure| panic!("{failure}"));
    assert!(report.saved && report.writes > 0, "{report:?}");
    assert_eq!(report.proved, Some("a power cycle"));
}

#[test]
fn a_supply_that_stays_on_proves_nothing() {
    let failure = proved(false).expect_err("the drive has not booted").to_string();
    assert!(failure.contains("were not read again after a restart"), "{failure}");
}
