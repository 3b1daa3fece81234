//! Which frames are shown: by node, by service, by object.

use can::CanId;
use canopen::{Mux, NodeId};
use master::decode::{Decoded, Decoder, ServiceKind};

use crate::failure::Failure;
use devices::names::is_former;
use words::models::Description;
use words::node::node;
use words::object::{ObjectArg, object};
use words::suggest::{did_you_mean, near};

/// Frames to show. A frame has to match one value of each option that is given.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Which frames")]
pub(crate) struct Filter {
    /// Show only frames of these nodes, including NMT commands for all nodes
    #[arg(long = "node", value_name = "NODE", value_parser = node, value_delimiter = ',')]
    nodes: Vec<NodeId>,
    /// Show only these services: nmt, sync, time, emcy, pdo, sdo, heartbeat, lss, other
    #[arg(long = "service", value_name = "SERVICE", value_parser = service, value_delimiter = ',')]
    services: Vec<ServiceKind>,
    /// Show only SDO and PDO with these objects: 6041, 6041:00 or a name
    #[arg(long = "object", value_name = "OBJECT", value_parser = wanted, value_delimiter = ',')]
    objects: Vec<WantedObject>,
}

/// An object, all sub-indices of one, or all of a name.
#[derive(Clone, Debug)]
enum WantedObject {
    Index(u16),
    Mux(Mux),
    Name(String),
}

fn service(text: &str) -> Result<ServiceKind, String> {
    let known = ServiceKind::ALL.map(ServiceKind::word);
    let typed = text.to_ascii_lowercase();
    ServiceKind::ALL.into_iter().find(|kind| kind.word() == typed).ok_or_else(|| {
        format!("expected a service, one of {}, got '{text}'{}", known.join(", "), did_you_mean(&near(&typed, known)))
    })
}

fn wanted(text: &str) -> Result<WantedObject, String> {
    Ok(match object(text)? {
        ObjectArg::Mux(mux) if text.contains(':') => WantedObject::Mux(mux),
        ObjectArg::Mux(mux) => WantedObject::Index(mux.index),
        ObjectArg::Name(name) => WantedObject::Name(name),
    })
}

/// Of the present or an earlier version.
fn is_name(typed: &str, name: &str) -> bool {
    typed == name || is_former(typed, name)
}

impl Filter {
    /// Refuses a name that no model has: nothing would ever be shown.
    pub(crate) fn check(&self, models: &[&Description]) -> Result<(), Failure> {
        let names = || models.iter().flat_map(|model| model.dictionary.rows().iter().map(|row| row.name));
        for wanted in &self.objects {
            let WantedObject::Name(name) = wanted else { continue };
            if !names().any(|known| is_name(name, known)) {
                let mut close = near(name, names());
                close.dedup();
                return Err(Failure::usage(format!("no model has an object named '{name}'{}", did_you_mean(&close)))
                    .next("give its index, e.g. --object 6041, or name the model of a node: --model NODE=MODEL"));
            }
        }
        Ok(())
    }

    /// The identifiers of all frames that may match, each once and in order; none where that is every identifier.
    pub(crate) fn ids(&self, decoder: &Decoder) -> Vec<CanId> {
        let mut ids: Vec<CanId> = self.nodes.iter().flat_map(|node| decoder.ids_of(*node)).collect();
        ids.sort_unstable_by_key(|id| id.raw());
        ids.dedup();
        ids
    }

    /// True if the frame matches.
    pub(crate) fn takes(&self, decoder: &Decoder, decoded: &Decoded) -> bool {
        let is_wanted = |mux: Mux| {
            self.objects.iter().any(|wanted| match wanted {
                WantedObject::Index(index) => mux.index == *index,
                WantedObject::Mux(exactly) => mux == *exactly,
                WantedObject::Name(name) => {
                    decoded.node().and_then(|node| decoder.name(node, mux)).is_some_and(|known| is_name(name, known))
                }
            })
        };
        (self.nodes.is_empty() || self.nodes.iter().any(|node| decoded.concerns(*node)))
            && (self.services.is_empty() || self.services.contains(&decoded.service()))
            && (self.objects.is_empty() || decoded.objects().any(is_wanted))
    }
}
