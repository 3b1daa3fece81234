//! NMT commands, and what shows the state that a node is in.

use std::time::Duration;

use can::{BusFrame, CanId, Frame};
use canopen::heartbeat::Heartbeat;
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::{Mux, NmtCommand, NmtState, connection_set};

use super::restore::SETTLING;
use super::{Bench, ms, silent};
use crate::finding::{Finding, fail};

/// Longest time from a reset to the boot-up message. CiA 301 states none; devices with a self-test take seconds.
pub(crate) const BOOT: Duration = Duration::from_secs(10);
/// How long a frame may wait for the bus.
const LATE: Duration = ms(20);
/// Period of the heartbeats that show a state.
const PERIOD_MS: u16 = 50;

impl Bench {
    /// An NMT command, and the time that it takes.
    pub(crate) async fn nmt(&mut self, command: NmtCommand) {
        self.restorer.note_commanded();
        self.send(NmtRequest::new(command, NmtTarget::Node(self.node())).emit());
        self.pause(SETTLING).await;
    }

    /// A reset of the node or of its communication, until its boot-up message.
    pub(crate) async fn reset(&mut self, command: NmtCommand) -> Result<BusFrame, Finding> {
        self.reset_by(command, NmtTarget::Node(self.node())).await
    }

    pub(crate) async fn reset_by(&mut self, command: NmtCommand, target: NmtTarget) -> Result<BusFrame, Finding> {
        self.restorer.prepare_reset().await;
        self.absorb();
        self.send(NmtRequest::new(command, target).emit());
        let sent = self.now();
        let id = self.heartbeat_id();
        // A heartbeat may have waited for the bus when the command came.
        let is_late = |passed: &BusFrame| passed.frame.data() != [0] && passed.at < sent + LATE;
        let mut heard = self.wait_for(BOOT, |frame| frame.id() == id && !frame.is_remote()).await;
        while heard.as_ref().is_some_and(is_late) {
            heard = self.wait_for(BOOT, |frame| frame.id() == id && !frame.is_remote()).await;
        }
        match heard {
            Some(passed) if passed.frame.data() == [0] => Ok(passed),
            Some(passed) => fail!("after the reset {} came; expected the boot-up message, one byte 00h", passed.frame),
            None => silent("the boot-up message", BOOT),
        }
    }

    pub(crate) fn heartbeat_id(&self) -> CanId {
        connection_set::heartbeat(self.node())
    }

    /// Has the node produce heartbeats, where it can.
    pub(crate) async fn start_heartbeat(&mut self) -> Result<(), Finding> {
        if self.subject.row(0x1017, 0).is_none_or(|row| !row.access.is_writable()) {
            return Err(Finding::NotApplicable(
                "nothing shows the NMT state: there is no 1017h that can be written".into(),
            ));
        }
        self.write(PRODUCER_HEARTBEAT_TIME, &PERIOD_MS.to_le_bytes()).await
    }

    /// The byte of the next heartbeat, of a node that produces them.
    pub(crate) async fn heartbeat(&mut self) -> Result<u8, Finding> {
        self.absorb();
        let id = self.heartbeat_id();
        let within = ms(u64::from(PERIOD_MS) * 6);
        match self.wait_for(within, |frame| frame.id() == id && !frame.is_remote()).await {
            Some(BusFrame { frame, .. }) if frame.dlc() == 1 => Ok(frame.padded()[0]),
            Some(BusFrame { frame, .. }) => fail!("the heartbeat {frame} has {} bytes, not 1", frame.dlc()),
            None => silent("a heartbeat", within),
        }
    }

    /// Fails unless the next heartbeat says this state.
    pub(crate) async fn expect_state(&mut self, state: NmtState) -> Result<(), Finding> {
        let byte = self.heartbeat().await?;
        if byte == state.heartbeat_byte() {
            return Ok(());
        }
        fail!("the heartbeat says {byte:02X}h; expected {:02X}h ({state})", state.heartbeat_byte())
    }

    /// The state that the node is in, by what it shows; `None` if nothing does.
    pub(crate) async fn find_state(&mut self) -> Option<NmtState> {
        let shown = self.shown_state().await;
        let left = self.restorer.restore().await;
        shown.map(|byte| NmtState::from_heartbeat_byte(byte & 0x7F)).filter(|_| left.is_empty()).flatten()
    }

    async fn shown_state(&mut self) -> Option<u8> {
        let period = self.number(PRODUCER_HEARTBEAT_TIME).await.unwrap_or(0);
        let id = self.heartbeat_id();
        if period > 0 {
            let within = ms(period as u64 * 2 + 100);
            let heard = self.wait_for(within, |frame| frame.id() == id && !frame.is_remote()).await?;
            return Heartbeat::parse(&heard.frame).map(|heartbeat| heartbeat.state);
        }
        if self.start_heartbeat().await.is_ok()
            && let Ok(byte) = self.heartbeat().await
        {
            return Some(byte);
        }
        self.guard().await.map(|frame| frame.padded()[0])
    }

    /// The answer to node guarding.
    pub(crate) async fn guard(&mut self) -> Option<Frame> {
        let id = self.heartbeat_id();
        self.absorb();
        self.send(Frame::remote(id, 1));
        let heard = self.wait_for(self.timeout, |frame| frame.id() == id && !frame.is_remote()).await;
        heard.map(|passed| passed.frame)
    }
}

/// Cases that change what the device has stored.
impl Bench {
    /// "save" to 1010h:01.
    pub(crate) async fn save(&mut self) -> Result<(), Finding> {
        match self.download(Mux::new(0x1010, 1), b"save").await? {
            Ok(()) => Ok(()),
            Err(code) => fail!("1010h:01 does not take \"save\": {code}"),
        }
    }

    /// What an object is after a start of the device: what its memory has.
    pub(crate) async fn stored_value(&mut self, mux: Mux) -> Result<Vec<u8>, Finding> {
        self.reset(NmtCommand::ResetNode).await?;
        self.read(mux).await
    }

    /// The memory has this value of an object again.
    pub(crate) async fn store_again(&mut self, mux: Mux, stored: &[u8]) -> Result<(), Finding> {
        if let Err(code) = self.download(mux, stored).await? {
            fail!("{mux} does not take again what was stored: {code}");
        }
        self.save().await
    }

    /// What this case has written is put back at once.
    pub(crate) async fn put_back(&mut self) -> Result<(), Finding> {
        match &self.restorer.undo().await[..] {
            [] => Ok(()),
            left => fail!("not put back: {}", left.join(", ")),
        }
    }
}
