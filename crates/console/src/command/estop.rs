//! `ferrodrive estop`, `quick-stop all` and `stop all`: every drive on the bus comes to rest, whichever master moves it.

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::NodeId;
use devices::AxisId;
use master::drive::{Drive, StopWay, StoppedAxis};
use master::join_all;
use serde::Serialize;

use super::on_bus::drives_on_bus;
use crate::context::Context;
use crate::failure::Failure;
use plot::Paint;
use words::plain;

/// Stop every drive on the bus at once, whichever master moves it
///
/// First one NMT command takes all nodes to pre-operational, so that no PDO of another master starts a drive again;
/// then each drive is quick-stopped. The nodes stay pre-operational: `ferrodrive boot` or `ferrodrive nmt all start`
/// continues. Ends with status 0 only when every drive was seen to stand, by its statusword and its speed. A node that
/// was heard, or is in the machine file, and does not answer may still be moving; --timeout has no effect on how long
/// the command waits for it. This is software on a bus: it does not replace an emergency stop that removes the power.
#[derive(Debug, Default, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 estop\n  ferrodrive --bus can0 --machine machine.toml estop --json\n  \
    ferrodrive --bus can0 quick-stop all    # the same\n  ferrodrive --bus can0 stop all          # by the ramps; stays enabled"
)]
pub struct Estop {
    /// The word all, as behind `stop` and `quick-stop`: there is nothing else to choose
    #[arg(value_name = "all", value_parser = ["all"], hide = true)]
    everything: Option<String>,
}

/// What became of every drive on the bus.
#[derive(Debug, Serialize)]
pub struct StopReport {
    ok: bool,
    nodes: Vec<AxisReport>,
    #[serde(skip)]
    failure: Option<Failure>,
}

#[derive(Debug, Serialize)]
struct AxisReport {
    node: u8,
    /// Of a drive that has several, from 1.
    axis: u8,
    model: Option<&'static str>,
    stands: bool,
    /// What holds it, where it was seen to stand.
    way: Option<&'static str>,
    after_ms: Option<u64>,
    /// Why it was not seen to stand.
    why: Option<String>,
}

/// By what a drive that `stop all` has stopped is held.
const RAMP: &str = "ramp";

impl Estop {
    /// Stops everything.
    pub async fn run(&self, context: &Context) -> Result<StopReport, Failure> {
        let models: BTreeMap<_, _> = context.stated_models();
        let stopped = match context.in_control() {
            // A page that sees a danger stops what moves; the state of the bus is for the one that commands it.
            Some(false) => {
                context.note(
                    "without control: each drive gets its quick stop, and the NMT states of the nodes stay as they are. Where another \
                     master sets one going again, take control and give estop once more",
                );
                context.network.quick_stop_everything(&models).await
            }
            Some(true) | None => context.network.stop_everything(&models).await,
        };
        StopReport::new(
            context,
            stopped.into_iter().map(AxisReport::from).collect(),
            "the emergency stop of the machine",
        )
    }
}

/// `stop all`: each by its ramp; it stays enabled.
pub async fn stop_all(context: &Context) -> Result<StopReport, Failure> {
    let found = drives_on_bus(context).await.into_iter();
    let stops = found.map(|(id, silent)| async move {
        let silent = silent.map(Failure::from);
        let drive = match silent {
            None => context.drive_to_stop(id).await,
            Some(silent) => Err(silent),
        };
        match drive {
            Ok(drive) => stop_axes(context, &drive).await,
            Err(failure) => vec![AxisReport::unseen(id, AxisId::FIRST, None, &failure)],
        }
    });
    let stopped = join_all(stops.collect::<Vec<_>>()).await.into_iter().flatten().collect();
    StopReport::new(context, stopped, "ferrodrive estop, or the emergency stop of the machine")
}

/// Stops every axis of a drive.
async fn stop_axes(context: &Context, drive: &Drive) -> Vec<AxisReport> {
    let id = drive.node().id();
    let model = drive.description().filter(|_| drive.guess().is_none()).map(|model| model.name);
    let many = drive.description().map_or(1, |model| model.axes.len());
    let axes = (0..many as u8).map(AxisId).map(|axis| async move {
        let began = context.network.now();
        let stopped = match drive.axis(axis) {
            Ok(drive) => drive.stop().await,
            Err(error) => Err(error),
        };
        match stopped {
            Ok(()) => AxisReport::seen(id, axis, model, context.network.now() - began, RAMP),
            Err(error) => AxisReport::unseen(id, axis, model, &error.into()),
        }
    });
    join_all(axes.collect::<Vec<_>>()).await
}

impl AxisReport {
    fn seen(node: NodeId, axis: AxisId, model: Option<&'static str>, after: Duration, way: &'static str) -> Self {
        let (way, after_ms) = (Some(way), Some(after.as_millis() as u64));
        Self { node: node.raw(), axis: axis.0 + 1, model, stands: true, way, after_ms, why: None }
    }

    fn unseen(node: NodeId, axis: AxisId, model: Option<&'static str>, failure: &Failure) -> Self {
        let why = [&[failure.what.as_str()], &failure.because.iter().map(String::as_str).collect::<Vec<_>>()[..]]
            .concat()
            .join("; ");
        Self { node: node.raw(), axis: axis.0 + 1, model, stands: false, way: None, after_ms: None, why: Some(why) }
    }

    /// `node 4`, and the axis where it is not the first.
    fn name(&self) -> String {
        if self.axis == 1 { format!("node {}", self.node) } else { format!("node {}, axis {}", self.node, self.axis) }
    }
}

impl From<StoppedAxis> for AxisReport {
    fn from(stopped: StoppedAxis) -> Self {
        let StoppedAxis { node, axis, model, outcome } = stopped;
        let model = model.map(|model| model.name);
        match outcome {
            Ok((after, way)) => Self::seen(node, axis, model, after, way.words()),
            Err(error) => Self::unseen(node, axis, model, &error.into()),
        }
    }
}

impl StopReport {
    fn new(context: &Context, nodes: Vec<AxisReport>, surer: &str) -> Result<Self, Failure> {
        let bus = &context.bus_name;
        if nodes.is_empty() {
            return Err(Failure::new(format!("no drive answers on {bus}: drives may still be moving"))
                .of_kind("no_node")
                .because("no node has a statusword (6041h), and none was heard")
                .next(format!("if something moves that must not: {surer}"))
                .next("check supply, cable and bit rate, then: ferrodrive scan"));
        }
        let moving: Vec<_> = nodes.iter().filter(|axis| !axis.stands).collect();
        let failure = moving.first().map(|_| {
            let names: Vec<_> = moving.iter().map(|axis| axis.name()).collect();
            let what = format!("{} may still be moving", names.join("; "));
            let failure = Failure::new(what)
                .of_kind("not_stopped")
                .next(surer)
                .next(format!("then: ferrodrive state {}", moving[0].node));
            moving
                .iter()
                .filter_map(|axis| {
                    let (name, why) = (axis.name(), axis.why.as_ref()?);
                    // The master's errors name the node.
                    Some(if why.starts_with(&name) { why.clone() } else { format!("{name}: {why}") })
                })
                .fold(failure, Failure::because)
        });
        Ok(Self { ok: failure.is_none(), nodes, failure })
    }

    /// Why not every drive was seen to stand.
    pub fn failure(&self) -> Option<Failure> {
        self.failure.clone()
    }
}

impl StopReport {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let line = |axis: &AxisReport| {
            let model = axis.model.map(|model| format!(" ({model})")).unwrap_or_default();
            let said = match (axis.after_ms, axis.way) {
                (Some(ms), Some(way)) => format!("at standstill after {:.2} s: {}", ms as f64 / 1e3, in_words(way)),
                _ => paint.bad("may still be moving"),
            };
            format!("{}{}: {said}", axis.name(), plain(&model))
        };
        self.nodes.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

/// What a way to stand means for the machine.
fn in_words(way: &'static str) -> String {
    if way == StopWay::QuickStop.words() {
        "quick stop, its motor holds".to_owned()
    } else if way == StopWay::NoPower.words() {
        "motor unpowered; a load may still turn it".to_owned()
    } else if way == StopWay::Fault.words() {
        "motor unpowered by a fault; a load may still turn it".to_owned()
    } else {
        "by its ramp; it stays enabled if it was".to_owned()
    }
}
