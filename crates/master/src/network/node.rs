use std::time::Duration;

use can::CanId;
use canopen::nmt::NmtTarget;
use canopen::od::Scalar;
use canopen::sdo::parameter;
use canopen::{CobId, Mux, NmtCommand, NodeId};

use super::future::{Elapsed, NodeView, Pending, Wait};
use super::handle::Network;
use crate::core::{Command, Failure, NodeFacts, Payload, Request, SdoServer, Transfer};
use crate::error::{Access, Error, Hints};

/// How long an SDO answer is waited for. Drives answer within milliseconds; a loaded bus at 100 kbit/s may add
/// some tens more.
pub const DEFAULT_TIMEOUT: Duration = Duration::from_millis(500);

/// A handle on one node of a [`Network`]: SDO client, NMT, and waiting for what it does.
#[derive(Clone, Debug)]
pub struct Node {
    network: Network,
    id: NodeId,
    timeout: Duration,
    waits_for_server: bool,
}

impl Network {
    /// A handle on one node.
    pub fn node(&self, id: NodeId) -> Node {
        Node { network: self.clone(), id, timeout: DEFAULT_TIMEOUT, waits_for_server: true }
    }
}

impl Node {
    /// The same node with another longest wait for each SDO answer.
    #[must_use]
    pub const fn with_timeout(mut self, timeout: Duration) -> Self {
        self.timeout = timeout;
        self
    }

    /// The same node by the SDO server that is in use: the record of one that was chosen
    /// ([`Network::choose_sdo_servers`]) and not read yet is not read first. For what has to go out at once, as a stop.
    #[must_use]
    pub const fn by_server_in_use(mut self) -> Self {
        self.waits_for_server = false;
        self
    }

    /// The longest wait for each SDO answer.
    pub const fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Its node-ID.
    pub const fn id(&self) -> NodeId {
        self.id
    }

    /// The network it is in.
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// What has been seen of it.
    pub fn facts(&self) -> NodeFacts {
        self.network.facts(self.id)
    }

    /// Asks another of its SDO servers from the next request on, whatever handle makes it: two masters that each have one ask the same
    /// device at the same time, and neither takes the other's answers. Its record, 1201h to 127Fh, is read through the server in use;
    /// 1200h is the default server, which nothing is read for. Of several that are chosen at the same time the one that was asked for last
    /// is used.
    ///
    /// Where the server leaves a stop unanswered (another program may have made it invalid), the second try of the stop and what follows
    /// go to the default server.
    ///
    /// # Errors
    /// As [`read`](Self::read); [`Error::NoSdoServer`] where it does not exist.
    pub async fn use_sdo_server(&self, record: u16) -> Result<SdoServer, Error> {
        let choice = self.network.begin_server_choice(self.id);
        self.use_server_of(record, choice).await
    }

    /// The server that was chosen by this record, unless another is chosen while it is read.
    async fn use_server_of(&self, record: u16, choice: u32) -> Result<SdoServer, Error> {
        let server =
            if record == 0x1200 { SdoServer::default_of(self.id) } else { self.further_server(record).await? };
        self.network.use_chosen_server(self.id, server, choice);
        Ok(server)
    }

    async fn further_server(&self, record: u16) -> Result<SdoServer, Error> {
        let request = self.cob_id(Mux::new(record, 1)).await?;
        let reply = self.cob_id(Mux::new(record, 2)).await?;
        let Some((request, reply)) = parameter::identifiers(request, reply) else {
            return Err(Error::NoSdoServer { node: self.id, record });
        };
        Ok(SdoServer { request: CanId::standard(request), reply })
    }

    async fn cob_id(&self, mux: Mux) -> Result<CobId, Error> {
        Ok(CobId(self.number(mux, self.exchange(mux, Transfer::Upload).await?)?))
    }

    /// SDO upload: the bytes of an object, as they came.
    ///
    /// # Errors
    /// [`Error::NoAnswer`], [`Error::Aborted`], [`Error::BadAnswer`] or [`Error::QueueFull`].
    pub async fn upload(&self, mux: Mux) -> Result<Payload, Error> {
        self.transfer(mux, Transfer::Upload).await
    }

    /// SDO download: writes these bytes to an object.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    pub async fn download(&self, mux: Mux, data: &[u8]) -> Result<(), Error> {
        self.transfer(mux, Transfer::Download(Payload::new(data))).await.map(|_| ())
    }

    /// Reads a number.
    ///
    /// # Errors
    /// As [`upload`](Self::upload); [`Error::WrongLength`] when the object is not as long as a `T`.
    pub async fn read<T: Scalar>(&self, mux: Mux) -> Result<T, Error> {
        self.number(mux, self.upload(mux).await?)
    }

    fn number<T: Scalar>(&self, mux: Mux, payload: Payload) -> Result<T, Error> {
        let (expected, received) = (T::DATA_TYPE.size(), payload.as_bytes().len());
        if expected == received {
            Ok(T::from_raw(payload.raw()))
        } else {
            Err(Error::WrongLength { node: self.id, mux, expected, received })
        }
    }

    /// Writes a number with the length of its type.
    ///
    /// # Errors
    /// As [`upload`](Self::upload).
    pub async fn write<T: Scalar>(&self, mux: Mux, value: T) -> Result<(), Error> {
        self.download(mux, &value.to_raw().to_le_bytes()[..T::DATA_TYPE.size()]).await
    }

    /// Sends it an NMT command.
    pub fn nmt(&self, command: NmtCommand) {
        self.network.submit(Command::Nmt(NmtTarget::Node(self.id), command));
    }

    /// Expects a heartbeat of it at least this often, from the first one on; `None` ends the watch.
    pub fn watch_heartbeat(&self, time: Option<Duration>) {
        self.network.submit(Command::WatchHeartbeat(self.id, time));
    }

    /// Watches it by node guarding in place of a heartbeat (CiA 301, 7.2.8.2.1): it is asked for its state each `guard_time`, of 1 ms at least,
    /// and counts as lost when no answer has come for that times `life_time_factor` (0 is as 1). Ended by
    /// [`watch_heartbeat`](Self::watch_heartbeat). The runner has to go on running.
    pub fn watch_by_guarding(&self, guard_time: Duration, life_time_factor: u8) {
        self.network.submit(Command::WatchByGuarding(self.id, guard_time, life_time_factor));
    }

    /// Asks it for its statusword (6041h) whenever nothing else was sent to it for this long, so that a drive that stops when
    /// its host is silent goes on; `None` ends it. The runner has to go on running.
    pub fn keep_fed(&self, period: Option<Duration>) {
        self.keep_fed_within(period, None);
    }

    /// The same for a drive that stops when it was left without a frame for `allowed`: after that it is not asked any more.
    pub(crate) fn keep_fed_within(&self, period: Option<Duration>, allowed: Option<Duration>) {
        self.network.submit(Command::KeepFed(self.id, period, allowed));
    }

    /// Waits for its next boot-up message, counted from this call.
    ///
    /// # Errors
    /// [`Error::NoBootUp`] with what has been seen of the node instead.
    pub fn wait_boot_up(&self, timeout: Duration) -> impl Future<Output = Result<(), Error>> + use<> {
        let before = self.facts().boot_up.map_or(0, |(_, count)| count);
        let booted = move |node: &NodeView<'_>| node.facts.boot_up.filter(|(_, count)| *count > before).map(|_| ());
        let wait = self.wait(booted, timeout);
        let node = self.clone();
        async move {
            wait.await.map_err(|Elapsed| Error::NoBootUp { node: node.id, waited: timeout, hints: node.hints(false) })
        }
    }

    /// Resets it (NMT reset node) and waits for its boot-up message.
    ///
    /// # Errors
    /// [`Error::NoBootUp`].
    pub async fn reset(&self, timeout: Duration) -> Result<(), Error> {
        let booted = self.wait_boot_up(timeout);
        self.nmt(NmtCommand::ResetNode);
        booted.await
    }

    /// Where its heartbeats came closer to each other than this period of theirs allows, waits until it is known whether two devices
    /// have this node-ID: one whose heartbeat was only late is in time again, what two send takes three periods.
    pub(crate) async fn look_for_twins(&self, period: Duration) {
        let is_close = |shortest: Duration| shortest < period * 3 / 4;
        if self.facts().shortest_heartbeat_interval().is_some_and(is_close) {
            let _ = self.wait(|node| node.facts.twins, 3 * period).await;
        }
    }

    /// Waits until `condition` gives a value, looking whenever something is heard of the node.
    pub fn wait<T, F>(&self, condition: F, timeout: Duration) -> Wait<F>
    where
        F: FnMut(&NodeView<'_>) -> Option<T> + Unpin,
    {
        Wait::new(self.network.clone(), self.id, condition, timeout)
    }

    async fn transfer(&self, mux: Mux, transfer: Transfer) -> Result<Payload, Error> {
        // While its record is read, another one may be chosen.
        while let Some((record, choice)) = self.network.chosen_server(self.id).filter(|_| self.waits_for_server) {
            self.use_server_of(record, choice).await?;
        }
        self.exchange(mux, transfer).await
    }

    /// By the server in use.
    async fn exchange(&self, mux: Mux, transfer: Transfer) -> Result<Payload, Error> {
        let access = if transfer == Transfer::Upload { Access::Read } else { Access::Write };
        let request = Request { node: self.id, mux, transfer, timeout: self.timeout };
        let outcome = Pending::request(self.network.clone(), request).await;
        outcome.map_err(|failure| self.error(mux, access, failure))
    }

    fn error(&self, mux: Mux, access: Access, failure: Failure) -> Error {
        let node = self.id;
        match failure {
            Failure::NoAnswer { waited, unsent } => {
                Error::NoAnswer { node, mux, access, waited, hints: self.hints(unsent) }
            }
            Failure::Aborted(code) => Error::Aborted { node, mux, access, code },
            Failure::BadAnswer(why) => Error::BadAnswer { node, mux, access, why },
            Failure::QueueFull => Error::QueueFull { node },
        }
    }

    /// What may explain its silence.
    pub(crate) fn hints(&self, unsent: bool) -> Hints {
        let shared = self.network.lock();
        let facts = shared.core.facts(self.id);
        Hints {
            unsent,
            nmt_state: facts.probable_state(None),
            silent_for: facts.seen_at.map(|at| shared.core.now() - at),
            others: NodeId::all()
                .filter(|other| *other != self.id && shared.core.facts(*other).seen_at.is_some())
                .collect(),
        }
    }
}
