//! SDO clients of a node (CiA 301, 7.2.4): one for each record 1280h to 12FFh, which says whom it asks (7.5.2.34).

use core::time::Duration;

use can::{Frame, Instant};

use super::Node;
use crate::AbortCode;
use crate::od::Storage;
use crate::sdo::{Client, parameter};

/// The client of one record. It stands beside its node, with the owner, who says what is read and written and has the bytes.
///
/// Frames and time go to both, and frames come from both. A node of which 1280h names node 5 reads an object there:
///
/// ```
/// use can::{Instant, Station};
/// use canopen::node::SdoClient;
/// use canopen::od::{Access, DataType, Entry, Fixed, Index, Table};
/// use canopen::sdo::client::Outcome;
/// use canopen::{Mux, Node, NodeId, NodeProfile};
/// use core::time::Duration;
///
/// static ROWS: [Entry; 4] = [
///     Entry::new(0x1280, 1, DataType::Unsigned32, Access::ReadWrite, "request", "COB-ID client to server").default(0x8000_0000),
///     Entry::new(0x1280, 2, DataType::Unsigned32, Access::ReadWrite, "reply", "COB-ID server to client").default(0x585),
///     Entry::new(0x1280, 3, DataType::Unsigned8, Access::ReadWrite, "server", "Node-ID of the SDO server").default(5),
///     Entry::new(0x2000, 0, DataType::Unsigned16, Access::ReadWrite, "level", "Level").default(700),
/// ];
/// static INDEX: Index<4> = Index::of(&ROWS);
/// static TABLE: Table = Table::new(&ROWS, &INDEX);
/// static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);
///
/// let now = Instant::ZERO;
/// let [mut asking, mut asked] = [4, 5].map(|id| Node::<Fixed<4>>::new(&PROFILE, NodeId::new(id).unwrap()));
/// for node in [&mut asking, &mut asked] {
///     node.boot(now);
///     node.poll_transmit();
/// }
/// let mut client = SdoClient::new(0x1280, Duration::from_millis(100));
/// assert!(client.on(&asking).is_err(), "not as delivered");
/// // A master gives it the default server of node 5.
/// asking.handle_frame(&"604#2380120105060000".parse().unwrap(), now);
/// assert_eq!(asking.poll_transmit().unwrap().to_string(), "584#6080120100000000");
///
/// let mut bytes = [0; 8];
/// client.on(&asking)?.upload(Mux::new(0x2000, 0), now);
/// let request = client.on(&asking)?.poll_transmit(&bytes).unwrap();
/// asked.handle_frame(&request, now);
/// let reply = asked.poll_transmit().unwrap();
/// assert!(client.hears(&reply));
/// let result = client.on(&asking)?.handle_frame(&reply, &mut bytes, now);
/// assert_eq!(result, Some(Ok(Outcome::Uploaded { mux: Mux::new(0x2000, 0), length: 2 })));
/// assert_eq!(bytes[..2], 700_u16.to_le_bytes());
/// # Ok::<(), canopen::AbortCode>(())
/// ```
#[derive(Clone, Debug)]
pub struct SdoClient {
    index: u16,
    timeout: Duration,
    /// Of the channel that the record had when it was last asked for.
    client: Option<Client>,
}

impl SdoClient {
    /// The client of the record `index`, 1280h to 12FFh. `timeout` is for each reply.
    pub const fn new(index: u16, timeout: Duration) -> Self {
        Self { index, timeout, client: None }
    }

    /// The client, to begin a transfer and for each step of it: on the channel that the record of `node` has now.
    ///
    /// # Errors
    /// 060A 0023h while the record is not there or one of its COB-IDs is not valid, while the NMT state has no SDO, and once after
    /// either has changed under a transfer, which is over.
    pub fn on<S: Storage>(&mut self, node: &Node<S>) -> Result<&mut Client, AbortCode> {
        let channel = parameter::client_channel(&node.dictionary().view(), self.index);
        let channel = channel.filter(|_| node.state().allows_sdo());
        if self.client.as_ref().map(Client::channel) != channel {
            let next = channel.map(|(request, reply)| Client::on(request, reply, self.timeout));
            let last = core::mem::replace(&mut self.client, next);
            if last.is_some_and(|client| client.is_busy()) {
                return Err(AbortCode::RESOURCE_NOT_AVAILABLE);
            }
        }
        self.client.as_mut().ok_or(AbortCode::RESOURCE_NOT_AVAILABLE)
    }

    /// The frame is from its server, and a transfer is under way: for [`Station::ignores`](can::Station::ignores) of the owner.
    pub fn hears(&self, frame: &Frame) -> bool {
        self.client.as_ref().is_some_and(|client| client.is_busy() && client.channel().1 == frame.id())
    }

    /// When the client is to be handed the time at the latest.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.client.as_ref()?.poll_timeout()
    }
}
