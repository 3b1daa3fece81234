use std::future::poll_fn;
use std::pin::pin;
use std::time::Duration;

use can::Instant;
use canopen::object::{DEVICE_TYPE, PRODUCER_HEARTBEAT_TIME, PRODUCT_CODE, REVISION_NUMBER, VENDOR_ID};
use canopen::{AbortCode, Mux, NmtState, NodeId};
use devices::Description;

use super::knowledge::{Guess, Identity, Knowledge, names};
use crate::core::{NodeSet, Payload, Twins};
use crate::error::Error;
use crate::models::Models;
use crate::network::{Network, Node, join_all};

/// Nodes asked at the same time: their requests take about 8 ms of a 500 kbit/s bus, well within the wait for each.
const WINDOW: usize = 32;

/// How long a node is given to answer: drives answer within a few milliseconds, a window of requests takes 8 more
/// at 500 kbit/s and 40 more at 100 kbit/s.
pub const SCAN_TIMEOUT: Duration = Duration::from_millis(100);

/// Longest time between two windows, however long the answers are waited for: together they take as long as a drive that was just
/// switched on needs to boot, about a second, so that it is heard meanwhile.
const MOST_APART: Duration = Duration::from_millis(500);

/// How late an answer may come to a scan that asks with a shorter time-out: behind a gateway or a radio link, or of a program on a
/// busy computer, it takes a few tenths of a second. A guess of what a user waits for.
const LATE_ANSWER: Duration = Duration::from_millis(500);

/// How often an object is asked for at most, beside another master.
const TRIES: usize = 4;

/// Longest heartbeat period that a scan waits for: twice that of the joint as delivered, the slowest of the drives here. A
/// guess of how long a user waits for a scan; of slower ones the period is reported.
const HEARTBEAT_PATIENCE: Duration = Duration::from_secs(2);

/// How much later than its period a heartbeat may come: behind a bus full of other frames.
const HEARTBEAT_JITTER: Duration = Duration::from_millis(100);

/// A node that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its node-ID.
    pub node: NodeId,
    /// What it says that it is; `None` if it answers no SDO.
    pub identity: Option<Identity>,
    /// Its NMT state by its last boot-up or heartbeat message, or the NMT command sent since.
    pub nmt_state: Option<NmtState>,
    /// How often it sends a heartbeat, by its 1017h; zero for never, `None` if that cannot be read.
    pub heartbeat: Option<Duration>,
    /// What that shows of its model.
    pub knowledge: Knowledge,
    /// The models that answer so. More than one: its identity does not decide which.
    pub models: Vec<&'static Description>,
    /// What speaks for two devices with this node-ID: what is listed here is of one or the other.
    pub twins: Option<Twins>,
}

impl Found {
    /// What is not known about it, and why.
    pub fn doubt(&self) -> Option<String> {
        match (self.identity, &self.knowledge) {
            (None, _) => Some("it is heard but answers no SDO: stopped, or busy, or its SDO is elsewhere".to_owned()),
            (Some(_), Knowledge::Named(_)) => None,
            (Some(_), Knowledge::Guessed(guess)) => Some(format!("cannot tell: {guess}")),
            (Some(_), Knowledge::Unknown) => Some(match names(self.models.iter().copied()) {
                (answering, true) => {
                    format!("cannot tell: {answering} answer the same identity, and its objects match none of them")
                }
                _ => "no model known here answers so".to_owned(),
            }),
        }
    }
}

/// Asks a node what it is.
///
/// # Errors
/// [`Error::NoAnswer`] when it is silent. Objects that it refuses are left out.
pub async fn identity(node: &Node) -> Result<Identity, Error> {
    Ok(Identity {
        device_type: optional(node, DEVICE_TYPE).await?,
        vendor_id: optional(node, VENDOR_ID).await?,
        product_code: optional(node, PRODUCT_CODE).await?,
        revision_number: optional(node, REVISION_NUMBER).await?,
    })
}

/// Reads an object. Where another master asks the node too, the answers to the two mix, and one may push the other's request
/// aside (CiA 301, 7.2.4.3: one SDO channel has one client): what got no answer of its own is asked again. A node that was never
/// heard is not there, and is asked once.
async fn upload(node: &Node, mux: Mux) -> Result<Payload, Error> {
    let mut answer = node.upload(mux).await;
    for _ in 1..TRIES {
        match answer {
            Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. }) => {
                return answer;
            }
            Err(Error::BadAnswer { .. } | Error::Aborted { .. }) => {}
            Err(Error::NoAnswer { .. }) if node.facts().seen_at.is_some() => {}
            answer => return answer,
        }
        answer = node.upload(mux).await;
    }
    answer
}

async fn optional(node: &Node, mux: Mux) -> Result<Option<u32>, Error> {
    match upload(node, mux).await {
        Ok(payload) => Ok(Some(payload.raw())),
        Err(Error::NoAnswer { .. }) => Err(node_silent(node, mux)),
        Err(_) => Ok(None),
    }
}

fn node_silent(node: &Node, mux: Mux) -> Error {
    let access = crate::error::Access::Read;
    Error::NoAnswer { node: node.id(), mux, access, waited: node.timeout(), hints: node.hints(false) }
}

/// What a node's identity and objects show of its model.
///
/// # Errors
/// [`Error::NoAnswer`] when it is silent.
pub async fn knowledge(node: &Node) -> Result<Knowledge, Error> {
    let said = identity(node).await?;
    let known = node.network().models();
    distinguish(node, &known, &answering(&known, said)).await
}

/// Which of `models` it is, by the node's objects.
async fn distinguish(node: &Node, known: &Models, models: &[&'static Description]) -> Result<Knowledge, Error> {
    let Some((first, others)) = models.split_first() else { return Ok(Knowledge::Unknown) };
    if others.is_empty() {
        return Ok((*first).into());
    }
    let guessed = |description, evidence| Guess { description, evidence, known: known.clone() };
    if others.iter().all(|other| other.same_objects(first)) {
        return Ok(Knowledge::Guessed(guessed(first, None)));
    }
    let mut guess: Option<Guess> = None;
    for model in models {
        let Some(object) = model.distinguishing_object else { continue };
        let same = |guess: &Guess| guess.description().same_objects(model);
        if guess.as_ref().is_some_and(same) || !has(node, object).await? {
            continue;
        }
        if guess.is_some() {
            // It has what should be one model's own and what should be another's.
            return Ok(Knowledge::Unknown);
        }
        guess = Some(guessed(model, Some(object)));
    }
    Ok(guess.map_or(Knowledge::Unknown, Knowledge::Guessed))
}

/// True if the node has this object.
///
/// # Errors
/// [`Error::NoAnswer`] when it is silent; what keeps the question from being asked.
pub(crate) async fn has(node: &Node, mux: Mux) -> Result<bool, Error> {
    match upload(node, mux).await {
        Ok(_) => Ok(true),
        Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. }) => Ok(false),
        // It is there, and cannot be read now.
        Err(Error::Aborted { .. }) => Ok(true),
        Err(Error::NoAnswer { .. }) => Err(node_silent(node, mux)),
        Err(error) => Err(error),
    }
}

impl Network {
    /// Asks all 127 node-IDs who they are, 32 at a time, the next after `timeout` or half a second, whichever is shorter. `progress`
    /// is given how many have been asked.
    ///
    /// Nodes that answer no SDO are found by their boot-up or heartbeat messages, if any came before or meanwhile; one that boots
    /// meanwhile is asked again, and so is one whose answer came after `timeout`, up to half a second late: with more patience.
    pub async fn scan(&self, timeout: Duration, mut progress: impl FnMut(usize)) -> Vec<Found> {
        let began = self.now();
        let turn = |place: usize| timeout.min(MOST_APART) * (place / WINDOW) as u32;
        let looks = NodeId::all().enumerate().map(async |(place, id)| {
            self.sleep(turn(place)).await;
            self.look_at(id, timeout).await
        });
        let mut looks = pin!(join_all(looks));
        let all = NodeId::all().count();
        let mut asked = (WINDOW..all).step_by(WINDOW).chain([all]).peekable();
        // It is polled when a window has its turn, too.
        let looks = poll_fn(|context| {
            while let Some(count) = asked.next_if(|count| began + turn(count - 1) <= self.now()) {
                progress(count);
            }
            looks.as_mut().poll(context)
        });
        let mut found: Vec<Found> = looks.await.into_iter().flatten().collect();
        // An answer that comes after its time-out shows that its node is there.
        self.sleep(LATE_ANSWER.saturating_sub(timeout)).await;
        self.ask_late_comers(&mut found, began, timeout.max(LATE_ANSWER)).await;
        self.hear_heartbeats(&mut found, began).await;
        found
    }

    /// Asks those that have booted, answered or were first heard after they had been given up. Each is asked once more, so that this
    /// ends.
    async fn ask_late_comers(&self, found: &mut Vec<Found>, began: Instant, timeout: Duration) {
        let mut asked_again = NodeSet::EMPTY;
        loop {
            let is_late = |id: &NodeId| match found.iter().find(|found| found.node == *id) {
                Some(found) => found.identity.is_none() && self.has_come_since(*id, began),
                None => true,
            };
            let late: Vec<_> = self.seen().iter().filter(|id| is_late(id) && !asked_again.contains(*id)).collect();
            if late.is_empty() {
                break;
            }
            late.iter().for_each(|id| asked_again.insert(*id));
            let asking: Vec<_> = late.iter().map(|id| self.look_at(*id, timeout)).collect();
            let answers: Vec<_> = join_all(asking).await.into_iter().flatten().collect();
            found.retain(|found| answers.iter().all(|answer| answer.node != found.node));
            found.extend(answers);
        }
        found.sort_by_key(|found| found.node);
    }

    /// True if a node has booted or answered an SDO request since then.
    fn has_come_since(&self, id: NodeId, then: Instant) -> bool {
        let facts = self.facts(id);
        facts.boot_up.map(|(at, _)| at).max(facts.answered_at).is_some_and(|at| at > then)
    }

    /// Waits for one and a half heartbeat periods of each node since `began`, and puts down what all have said by then: a node
    /// that beats more slowly than the scan looks is not silent, and two with one node-ID both come to a heartbeat.
    async fn hear_heartbeats(&self, found: &mut [Found], began: Instant) {
        let passed = self.now() - began;
        let due = found.iter().filter_map(|found| {
            let period = found.heartbeat.filter(|period| !period.is_zero() && *period <= HEARTBEAT_PATIENCE)?;
            Some(self.hear_heartbeats_of(found.node, period, passed))
        });
        join_all(due.collect::<Vec<_>>()).await;
        for found in found {
            let facts = self.facts(found.node);
            found.nmt_state = facts.probable_state(found.knowledge.description());
            found.twins = facts.twins;
        }
    }

    async fn hear_heartbeats_of(&self, id: NodeId, period: Duration, passed: Duration) {
        let node = self.node(id);
        let left = (period * 3 / 2 + HEARTBEAT_JITTER).saturating_sub(passed);
        let _ = node.wait(|node| node.facts.twins, left).await;
        node.look_for_twins(period).await;
    }

    async fn look_at(&self, id: NodeId, timeout: Duration) -> Option<Found> {
        let node = self.node(id).with_timeout(timeout);
        let identity = identity(&node).await.ok();
        let facts = node.facts();
        if identity.is_none() && facts.seen_at.is_none() {
            return None;
        }
        let known = self.models();
        let models = identity.map(|said| answering(&known, said)).unwrap_or_default();
        let knowledge = distinguish(&node, &known, &models).await.unwrap_or(Knowledge::Unknown);
        let heartbeat = match identity {
            Some(_) => optional(&node, PRODUCER_HEARTBEAT_TIME).await.ok().flatten(),
            None => None,
        };
        let heartbeat = heartbeat.map(|ms| Duration::from_millis(u64::from(ms) & 0xFFFF));
        let nmt_state = facts.probable_state(knowledge.description());
        Some(Found { node: id, identity, nmt_state, heartbeat, knowledge, models, twins: None })
    }
}

fn answering(known: &Models, said: Identity) -> Vec<&'static Description> {
    let Identity { device_type: Some(device_type), vendor_id, product_code, revision_number } = said else {
        return Vec::new();
    };
    let zero = |value: Option<u32>| value.unwrap_or(0);
    let identity = devices::Identity {
        device_type,
        vendor_id: zero(vendor_id),
        product_code: zero(product_code),
        revision_number: zero(revision_number),
    };
    known.catalogue().of_identity(identity).collect()
}
