//! The way of a node back to pre-operational, which something has started for a while.

use std::time::Duration;

use can::Instant;
use canopen::{NmtCommand, NmtState};
use master::Drive;

/// By what a node was seen to be pre-operational again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenBy {
    /// Its heartbeat has that state.
    Heartbeat,
    /// TPDOs that came until then have stopped.
    Silence,
    /// Nothing that it sends shows it.
    Nothing,
}

impl SeenBy {
    /// In a word, for programs.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::Silence => "no more frames",
            Self::Nothing => "nothing",
        }
    }

    /// In words, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Heartbeat => "by its heartbeat it is pre-operational again",
            Self::Silence => "commanded to be pre-operational again, it has stopped sending PDOs",
            Self::Nothing => "it was commanded to be pre-operational again, which nothing that it sends confirms",
        }
    }
}

/// How long a node may take to show that it is pre-operational.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often is looked for that.
const LOOK: Duration = Duration::from_millis(10);
/// Frames that are kept between two looks: whether one came is what counts.
const FEW: usize = 8;

/// Commands a node to be pre-operational, and looks whether it is; `sending` are the identifiers of PDOs that it has sent until now, and
/// the time between two of each.
///
/// # Errors
/// It still sends them.
pub(crate) async fn leave_operational(drive: &Drive, sending: Option<&(Vec<u16>, Duration)>) -> Result<SeenBy, String> {
    let (node, network) = (drive.node(), drive.node().network());
    let log = sending.map(|(ids, _)| network.log_frames(ids, FEW));
    node.nmt(NmtCommand::EnterPreOperational);
    let commanded = network.now();
    let (mut heard_at, mut frames) = (commanded, Vec::new());
    loop {
        network.sleep(LOOK).await;
        let (now, facts) = (network.now(), node.facts());
        if let Some(log) = &log {
            log.take(&mut frames);
            heard_at = frames.drain(..).map(|frame| frame.at).fold(heard_at, Instant::max);
        }
        let has_beaten = facts.heartbeat_at.is_some_and(|at| at > commanded);
        // The heartbeat of some models shows an alarm in place of the state.
        let shows_state = drive.description().zip(facts.nmt_state).is_none_or(|(model, said)| !model.tells_alarm(said));
        let state = facts.probable_state(drive.description());
        if has_beaten && shows_state && state == Some(NmtState::PreOperational) {
            return Ok(SeenBy::Heartbeat);
        }
        let quiet = sending.is_some_and(|(_, period)| now - heard_at > *period * 2 + LOOK);
        // A heartbeat says more than silence does: it is waited for where there is one.
        let booted_at = facts.boot_up.map(|(at, _)| at);
        let waits = facts.heartbeat_at > booted_at && now - commanded < PATIENCE;
        match (quiet, sending) {
            (true, _) if !waits => return Ok(SeenBy::Silence),
            (_, None) if !waits => return Ok(SeenBy::Nothing),
            _ if now - commanded > PATIENCE * 2 => return Err("NMT state: it still sends PDOs".to_owned()),
            _ => {}
        }
    }
}
