//! The drives on a bus, for commands to all of them.

use std::time::Duration;

use canopen::NodeId;
use cia402::object::STATUSWORD;
use master::{Error, join_all};

use crate::context::Context;

/// How long a node is given to say whether it is a drive.
const PATIENCE: Duration = Duration::from_millis(150);

/// Every drive that answers on the bus; also the nodes that were heard or are in the machine file and do not answer, with why.
pub(super) async fn drives_on_bus(context: &Context) -> Vec<(NodeId, Option<Error>)> {
    let asked = NodeId::all().map(|id| async move {
        let node = context.network.node(id).with_timeout(PATIENCE).by_server_in_use();
        let answer = node.read::<u16>(STATUSWORD).await;
        let expected = context.stated_model(id).is_some() || context.network.facts(id).seen_at.is_some();
        match answer {
            Ok(_) => Some((id, None)),
            Err(Error::NoAnswer { .. }) if !expected => None,
            Err(Error::Aborted { code: canopen::AbortCode::NO_SUCH_OBJECT, .. }) => None,
            Err(error) => Some((id, Some(error))),
        }
    });
    join_all(asked.collect::<Vec<_>>()).await.into_iter().flatten().collect()
}
