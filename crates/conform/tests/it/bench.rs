//! A bus with one node on it, and the suite.

use std::collections::BTreeMap;
use std::time::Duration;

use can::{Bitrate, Station, Tap};
use canopen::{Mux, NodeId};
use conform::{Capture, CaseResult, Options, Outcome, Report, Subject, Suite};
use devices::Description;
use master::Network;
use sim::machine::{Order, order};
use sim::{Fidelity, VirtualDrive, World, block_on, block_on_for};

/// Longer than the whole suite takes.
pub(crate) const LIMIT: Duration = Duration::from_secs(3600);

pub(crate) fn node() -> NodeId {
    NodeId::new(5).unwrap()
}

/// A virtual device of this description, without power.
pub(crate) fn drive(description: &'static Description) -> Box<dyn VirtualDrive> {
    drive_with(description, Fidelity::Full)
}

/// The same with as much computed.
pub(crate) fn drive_with(description: &'static Description, fidelity: Fidelity) -> Box<dyn VirtualDrive> {
    order(description, &Order { fidelity, ..Order::new(description, node(), Bitrate::K500) }).unwrap()
}

/// All values that can be written and read back. 1003h is left out: it keeps the errors that cases have provoked.
pub(crate) fn values(
    world: &mut World,
    network: &Network,
    description: &'static Description,
) -> BTreeMap<Mux, Vec<u8>> {
    let device = network.node(node());
    let rows = description.dictionary.rows().iter().filter(|row| row.access.is_writable() && row.access.is_readable());
    let rows: Vec<_> = rows.filter(|row| row.index != 0x1003).collect();
    block_on(world, async {
        let mut found = BTreeMap::new();
        for row in rows {
            if let Ok(value) = device.upload(row.mux()).await {
                found.insert(row.mux(), value.as_bytes().to_vec());
            }
        }
        found
    })
    .unwrap()
}

/// Runs the suite against a station that is node 5.
pub(crate) fn run<S: Station + Clone + Send + 'static>(station: S, subject: Subject, options: Options) -> Report {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_station(station);
    run_in(&mut world, subject, options)
}

/// Runs the suite against node 5 of a world.
pub(crate) fn run_in(world: &mut World, subject: Subject, options: Options) -> Report {
    let (network, capture) = (Network::new(), Capture::new());
    world.add_station(Tap::new(network.clone(), capture.clone()));
    world.run_for(Duration::from_secs(2));
    let suite = Suite::new(network, capture, subject, options);
    block_on_for(world, LIMIT, suite.run(|_| ())).unwrap().unwrap()
}

/// The results that a test is about, a line each.
pub(crate) fn shown(report: &Report, wanted: impl Fn(&CaseResult) -> bool) -> String {
    let lines = report.cases.iter().filter(|case| wanted(case));
    lines
        .map(|case| format!("{} {}: {}\n    {}\n", case.id, case.result.word(), case.why, case.frames.join(" ")))
        .collect()
}

pub(crate) fn failed(case: &CaseResult) -> bool {
    case.result == Outcome::Fail
}
