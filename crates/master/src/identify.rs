//! Who is on the bus: what nodes say of themselves, and which model that can be.
//!
//! In: boot-up and heartbeat messages seen, and answers to 1000h and 1018h. Out: one [`Found`] per node. Nodes are
//! asked in windows, all of a window at the same time. Models may share an identity: those with other objects are told
//! apart by an object that only some of them have. What cannot be told is said.

use core::fmt;
use std::time::Duration;

use canopen::od::Entry;
use canopen::{AbortCode, Mux, NmtState, NodeId};
use drives::profile::{self, DriveProfile, models_by_identity};

use crate::error::Error;
use crate::network::{Network, Node, join_all};

/// Nodes asked at the same time: their requests take about 8 ms of a 500 kbit/s bus, well within the wait for each.
const WINDOW: usize = 32;

/// How long a node is given to answer: drives answer within a few milliseconds, a window of requests takes 8 more
/// at 500 kbit/s and 40 more at 100 kbit/s.
pub const SCAN_TIMEOUT: Duration = Duration::from_millis(100);

/// What a node says that it is. What it refuses to say is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:01.
    pub vendor_id: Option<u32>,
    /// 1018h:02.
    pub product_code: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
}

impl Identity {
    /// True if nothing that it says speaks against the model.
    pub fn matches(&self, model: &profile::Identity) -> bool {
        let fits = |said: Option<u32>, expected| said.is_none_or(|said| said == expected);
        fits(self.device_type, model.device_type)
            && fits(self.vendor_id, model.vendor_id)
            && fits(self.product_code, model.product_code)
            && fits(self.revision_number, model.revision_number)
    }
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            ("device type", self.device_type),
            ("vendor", self.vendor_id),
            ("product", self.product_code),
            ("revision", self.revision_number),
        ];
        let mut separator = "";
        for (name, value) in parts {
            match value {
                Some(value) => write!(f, "{separator}{name} {value:X}h")?,
                None => write!(f, "{separator}{name} not given")?,
            }
            separator = ", ";
        }
        Ok(())
    }
}

/// A node that was found.
#[derive(Clone)]
pub struct Found {
    /// Its node-ID.
    pub node: NodeId,
    /// What it says that it is; `None` if it answers no SDO.
    pub identity: Option<Identity>,
    /// Its NMT state by its last boot-up or heartbeat message, or the NMT command sent since.
    pub nmt_state: Option<NmtState>,
    /// The models that answer so and have its objects. More than one: it cannot be told which.
    pub models: Vec<&'static DriveProfile>,
}

impl fmt::Debug for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let models: Vec<_> = self.models.iter().map(|model| model.model).collect();
        let Self { node, identity, nmt_state, .. } = self;
        write!(f, "Found {{ {node}, {identity:?}, {nmt_state:?}, {models:?} }}")
    }
}

impl Found {
    /// The model, if only one answers so.
    pub fn model(&self) -> Option<&'static DriveProfile> {
        match self.models[..] {
            [model] => Some(model),
            _ => None,
        }
    }

    /// What cannot be told about it, and why.
    pub fn doubt(&self) -> Option<String> {
        let shared = |model: &&DriveProfile| model.quirks.contains(&profile::Quirk::IdentityShared);
        match (self.identity, &self.models[..]) {
            (None, _) => Some("it is heard but answers no SDO: stopped, or busy, or its SDO is elsewhere".to_owned()),
            (Some(_), []) => Some("no model known here answers so".to_owned()),
            (Some(_), [model]) if shared(model) => {
                Some(format!("other models answer the same identity: its objects are those of the {}", model.model))
            }
            (Some(_), [_]) => None,
            (Some(_), models) => {
                let names: Vec<_> = models.iter().map(|model| model.model).collect();
                Some(format!("{} answer the same identity and have the same objects: say which", names.join(" and ")))
            }
        }
    }
}

/// Asks a node what it is.
///
/// # Errors
/// [`Error::NoAnswer`] when it is silent. Objects that it refuses are left out.
pub async fn identity(node: &Node) -> Result<Identity, Error> {
    Ok(Identity {
        device_type: optional(node, Mux::new(0x1000, 0)).await?,
        vendor_id: optional(node, Mux::new(0x1018, 1)).await?,
        product_code: optional(node, Mux::new(0x1018, 2)).await?,
        revision_number: optional(node, Mux::new(0x1018, 3)).await?,
    })
}

async fn optional(node: &Node, mux: Mux) -> Result<Option<u32>, Error> {
    match node.upload(mux).await {
        Ok(payload) => Ok(Some(payload.raw())),
        Err(Error::NoAnswer { .. }) => Err(node_silent(node, mux)),
        Err(_) => Ok(None),
    }
}

fn node_silent(node: &Node, mux: Mux) -> Error {
    let access = crate::error::Access::Read;
    Error::NoAnswer { node: node.id(), mux, access, waited: node.timeout(), hints: node.hints(false) }
}

/// The models that a node can be: those of its identity, as far as their objects do not speak against it.
///
/// # Errors
/// [`Error::NoAnswer`] when it is silent.
pub async fn models(node: &Node) -> Result<Vec<&'static DriveProfile>, Error> {
    let said = identity(node).await?;
    told_apart(node, models_answering(said)).await
}

/// Those of `models` whose objects the node has.
async fn told_apart(node: &Node, mut models: Vec<&'static DriveProfile>) -> Result<Vec<&'static DriveProfile>, Error> {
    // Each answer leaves fewer models, and at least one.
    while let Some(mux) = distinguishing_object(&models) {
        let present = match node.upload(mux).await {
            Ok(_) => true,
            Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. }) => false,
            Err(Error::NoAnswer { .. }) => return Err(node_silent(node, mux)),
            Err(_) => break,
        };
        models.retain(|model| model.table.find(mux).is_ok() == present);
    }
    Ok(models)
}

/// An object that the first model lets read and another one does not have: its hallmark, if that is one.
fn distinguishing_object(models: &[&'static DriveProfile]) -> Option<Mux> {
    let (first, others) = models.split_first()?;
    let readable = first.table.rows().iter().filter(|entry| entry.access.is_readable()).map(Entry::mux);
    first.hallmark.into_iter().chain(readable).find(|mux| others.iter().any(|other| other.table.find(*mux).is_err()))
}

impl Network {
    /// Asks all 127 node-IDs who they are. `progress` hears how many have been asked.
    ///
    /// Nodes that answer no SDO are found by their boot-up or heartbeat messages, if any came before or meanwhile.
    pub async fn scan(&self, timeout: Duration, mut progress: impl FnMut(usize)) -> Vec<Found> {
        let nodes: Vec<NodeId> = NodeId::all().collect();
        let mut found = Vec::new();
        let mut asked = 0;
        for window in nodes.chunks(WINDOW) {
            let asking = window.iter().map(|id| self.look_at(*id, timeout));
            found.extend(join_all(asking.collect::<Vec<_>>()).await.into_iter().flatten());
            asked += window.len();
            progress(asked);
        }
        found
    }

    async fn look_at(&self, id: NodeId, timeout: Duration) -> Option<Found> {
        let node = self.node(id).with_timeout(timeout);
        let identity = identity(&node).await.ok();
        let facts = node.facts();
        if identity.is_none() && facts.seen_at.is_none() {
            return None;
        }
        let answering = identity.map(models_answering).unwrap_or_default();
        let models = told_apart(&node, answering).await.unwrap_or_default();
        Some(Found { node: id, identity, nmt_state: facts.probable_state(), models })
    }
}

fn models_answering(said: Identity) -> Vec<&'static DriveProfile> {
    let Identity { device_type: Some(device_type), vendor_id, product_code, revision_number } = said else {
        return Vec::new();
    };
    let zero = |value: Option<u32>| value.unwrap_or(0);
    let identity = profile::Identity {
        device_type,
        vendor_id: zero(vendor_id),
        product_code: zero(product_code),
        revision_number: zero(revision_number),
    };
    models_by_identity(identity).collect()
}
