//! Test motions that a session commands: held as any other motion, captured as any other capture. Whatever ends one, the shaft is
//! brought to rest without power and everything is put back.

use std::time::Duration;

use canopen::NodeId;
use futures_util::future::{AbortHandle, AbortRegistration, Abortable};
use master::Drive;
use master::cyclic::CyclicOptions;
use serde_json::{Value, json};

use super::{Motion, Order, Run, ShapeName, run, usual_quantities};
use crate::capture::commanded::{check_size, measurands, refusal, shown};
use crate::capture::{CaptureOutcome, CaptureRun, NamedCapture, Restorer, Wanted, WayBack, not_put_back, with_left};
use crate::command::TestMotionOrder;
use crate::motion::guarding::{expect_guard, guard};
use crate::parameters::transactions::Refusal;
use crate::parameters::{busy, refuse};
use crate::state::Host;
use crate::work::{Asked, Done, LineOf, Running};
use sim::recorder::LiveValues;

/// For people: what the drive is doing.
const TESTING: &str = "test motion";
/// How late this program, or the drive's TPDO, may be: less than the time of the dead man of a jog. Desktops are late.
const LATE: Duration = Duration::from_millis(150);
/// How often steps are captured where nothing is said of it.
const STEPS_MS: f64 = 1.0;
/// Quantities that are captured where none is named.
const USUAL_QUANTITIES: usize = 3;

impl Host {
    /// Starts a test motion.
    pub(crate) fn take_test_motion(&mut self, node: NodeId, order: TestMotionOrder, asked: Asked) {
        match self.begin_test_motion(node, order) {
            Ok(work) => self.work.push(Box::pin(async move { Done::Captured(asked, Box::new(work.await)) })),
            Err(refusal) => refuse(asked, refusal),
        }
    }

    /// Begins one: what its future does last is to bring the drive to rest and to put everything back.
    fn begin_test_motion(
        &mut self,
        node: NodeId,
        TestMotionOrder { motion: order, quantities, capture_ms, sdo }: TestMotionOrder,
    ) -> Result<impl Future<Output = CaptureOutcome> + use<>, Refusal> {
        let (drive, _) = self.known_model(node)?;
        self.check_can_test(node)?;
        let motion = order.motion(cyclic(order.period_ms)).map_err(|why| ("usage", why))?;
        let usual_ms = if matches!(motion, Motion::Points { .. }) { order.period_ms } else { STEPS_MS };
        let mut wanted = self.wanted(node, capture_ms.unwrap_or(usual_ms), sdo)?;
        let columns = if quantities.is_empty() { USUAL_QUANTITIES } else { quantities.len() };
        check_size(columns, order.count, &wanted, &motion.span())?;
        let way_back = WayBack::in_network(&self.setting.ways_back);
        let restorer = way_back.of(&drive).clone();
        let (world, accepted) = (self.true_values().cloned(), self.accepted.contains(&node));
        let (generation, registration) = self.note_tested(node, TESTING);
        Ok(async move {
            let mut runs = Vec::new();
            let moving = async {
                wanted.quantities = quantities_of(&drive, world.as_ref(), quantities).await?;
                moved((&drive, &motion), (&wanted, &restorer), &order, accepted, &mut runs).await
            };
            // A stop drops what sends its set-points; the runs that were made are kept.
            let moved = Abortable::new(moving, registration).await;
            let moved = moved.unwrap_or_else(|_| Err(("stopped", "it was stopped".to_owned())));
            let left = restorer.restore().await;
            way_back.remove_if_done();
            let outcome = outcome_of(node, &order, moved, runs, (&restorer, &left));
            CaptureOutcome { node, generation: Some(generation), outcome }
        })
    }

    /// A motion begins that a stop ends, and whose way back ends it: its number, and what it is dropped by.
    pub(crate) fn note_tested(&mut self, node: NodeId, what: &'static str) -> (u64, AbortRegistration) {
        let (abort, registration) = AbortHandle::new_pair();
        self.generation += 1;
        self.leave_lines(LineOf::Stop(node));
        self.running.insert(node, Running::of_test_motion(self.generation, what, abort.clone()));
        self.captures.insert(node, CaptureRun { ended: None, abort });
        (self.generation, registration)
    }

    /// Whether a test motion or a tuning can begin.
    pub(crate) fn check_can_test(&self, node: NodeId) -> Result<(), Refusal> {
        // Both may end a SYNC of their own, and put TPDOs back.
        if let Some(other) = self.captures.keys().next() {
            return Err(("busy", format!("node {other} is being captured: wait for the end of that, or end it")));
        }
        if self.group.is_some() {
            return Err(("busy", "a group is moving, and a bus has one SYNC: stop it first".to_owned()));
        }
        if self.parameters.is_writing(node) {
            return Err(busy("its parameters are being written"));
        }
        let is_busy =
            self.running.contains_key(&node) || self.jogs.contains_key(&node) || self.network.moved().contains(node);
        match is_busy {
            true => Err(("busy", "the drive is moving, or busy with another command: stop it first".to_owned())),
            false => Ok(()),
        }
    }

    /// True if a test motion or a tuning of this node is under way, or on its way back.
    pub(crate) fn is_tested(&self, node: NodeId) -> bool {
        self.captures.get(&node).is_some_and(|run| run.ended.is_none())
    }

    /// A test motion ends with SYNC, TPDOs and the NMT state as they were before it: nothing else captures meanwhile.
    pub(crate) fn check_no_test_motion(&self) -> Result<(), Refusal> {
        let tested = self.captures.iter().find(|(_, run)| run.ended.is_none());
        let refused = |node: &NodeId| {
            ("busy", format!("node {node} makes a test motion, or is being measured: wait for its end, or stop it"))
        };
        tested.map_or(Ok(()), |(node, _)| Err(refused(node)))
    }

    /// A test motion or a tuning has ended, and its drive was brought to rest, or could not be.
    pub(crate) fn conclude_test_motion(&mut self, node: NodeId, generation: u64) {
        if self.running.get(&node).is_some_and(|running| running.generation == generation) {
            self.running.remove(&node);
            if self.network.moved().contains(node) {
                self.quick_stop_one(node, "", None);
            } else {
                self.unseen_stops.remove(&node);
            }
        }
    }
}

/// How late a motion that a session commands may be.
pub(crate) fn cyclic(period_ms: f64) -> CyclicOptions {
    let usual = CyclicOptions::default();
    let cycles = LATE.as_secs_f64() * 1e3 / period_ms;
    CyclicOptions { tolerance: (cycles as u32).max(usual.tolerance), ..usual }
}

async fn quantities_of(
    drive: &Drive,
    world: Option<&LiveValues>,
    named: Vec<String>,
) -> Result<Vec<crate::capture::Measurand>, Refusal> {
    let named = match named.is_empty() {
        true => usual_quantities(drive).await.map_err(|failure| refusal(&failure))?,
        false => named,
    };
    measurands(drive, world, &named).await.map_err(|failure| refusal(&failure))
}

async fn moved(
    (drive, motion): (&Drive, &Motion),
    (wanted, restorer): (&Wanted, &Restorer),
    order: &Order,
    accepted: bool,
    runs: &mut Vec<Run>,
) -> Result<(), Refusal> {
    wanted.check(&motion.span()).map_err(|failure| refusal(&failure))?;
    match motion {
        // Guarded as what else turns by its own ramps is, and as long.
        Motion::Steps { .. } => guard(drive, accepted).await?,
        // These have a guard of their own.
        Motion::Points { .. } if !accepted => expect_guard(drive).await?,
        Motion::Points { .. } => {}
    }
    let how = (order.count, order.travel_turns);
    run((drive, motion), (wanted, restorer), how, runs, |_| ()).await.map_err(|failure| refusal(&failure))
}

fn outcome_of(
    node: NodeId,
    order: &Order,
    moved: Result<(), Refusal>,
    runs: Vec<Run>,
    (restorer, left): (&Restorer, &[String]),
) -> Result<(Vec<NamedCapture>, Value), Refusal> {
    let not_back = not_put_back(node, left).map(|failure| refusal(&with_left(failure, left)));
    // Of what was seen of no run there is the failure alone.
    if runs.is_empty() {
        let lacks = not_back.map_or_else(String::new, |(_, text)| format!("; {text}"));
        return match moved {
            Err((kind, text)) => Err((kind, format!("{text}{lacks}"))),
            Ok(()) => Err(("failed", format!("no run was made{lacks}"))),
        };
    }
    let lacks: Vec<String> = moved.err().into_iter().chain(not_back).map(|(_, text)| text).collect();
    let rows: Vec<Value> = runs.iter().map(|run| row(node, run)).collect();
    let value = json!({
        "node": node.raw(),
        "shape": order.shape.word(),
        "limits": limits_of(order),
        "runs": rows,
        "nmt_back": restorer.left_operational().map(crate::capture::SeenBy::words),
        "lacks": lacks,
    });
    let name = |number: u32| format!("test motion {}, run {number}", order.shape.word());
    let captures = runs.into_iter().filter(|run| !run.capture.time_s.is_empty());
    Ok((captures.map(|run| (name(run.number), run.capture, run.figures.followed)).collect(), value))
}

fn row(node: NodeId, Run { number, figures, capture, ways, first_at }: &Run) -> Value {
    let mut row = serde_json::to_value(figures).unwrap_or_default();
    row["run"] = (*number).into();
    row["capture"] = shown(node, capture, ways, *first_at);
    row
}

/// What the motion kept to; null where the drive's own is taken.
fn limits_of(order: &Order) -> Value {
    let limits = order.limits().ok();
    let is_points = order.shape != ShapeName::Steps;
    let acceleration = limits.filter(|_| is_points).map(|limits| limits.acceleration_turns_s2 * 60.0);
    json!({
        "velocity_rpm": order.velocity_rpm,
        "acceleration_rpm_s": acceleration.or(order.acceleration_rpm_s),
        "following_error_deg": is_points.then_some(order.following_error_deg),
        "travel_turns": order.travel_turns,
    })
}
