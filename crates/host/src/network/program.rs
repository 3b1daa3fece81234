//! A program for a node (CiA 302-3): 1F51h stops and clears it, 1F50h takes the data, 1F56h and 1F57h show what came of it, and 1F51h
//! starts it.
//!
//! In: a file's bytes. Out: what was done, and what the node says of it. Nothing is sent to a drive whose power stage is on, and no
//! program again that is there already by its identification: many makers form 1F56h as the CRC-32 of the program, and CiA 302-3
//! leaves it to them.

use std::time::Duration;

use canopen::{AbortCode, Mux, NodeId};
use cia402::{PowerState, Statusword};
use master::{Error, Network, Node};
use serde::Serialize;

use super::Progress;
use words::failure::Failure;

const DATA: u16 = 0x1F50;
const CONTROL: u16 = 0x1F51;
const IDENTIFICATION: u16 = 0x1F56;
const STATUS: u16 = 0x1F57;

const STOP: u8 = 0;
const START: u8 = 1;
const CLEAR: u8 = 3;

/// 1F57h: memory is being written; and its error, 0 for none.
const IN_PROGRESS: u32 = 1;
const NO_PROGRAM: u32 = 1;

/// How long a node may take to clear or write its memory, and how often it is asked. A guess: flash memory of 1 MB takes some 10 s.
const MEMORY_PATIENCE: Duration = Duration::from_secs(60);
const MEMORY_PERIOD: Duration = Duration::from_millis(100);

/// How often progress is shown.
const PROGRESS_PERIOD: Duration = Duration::from_millis(500);

/// Most axes of a device, whose blocks of the profile area begin at each 800h (CiA 402-1).
const AXES: u16 = 8;

/// How a program was downloaded to a node (CiA 302-3: 1F50h, 1F51h): what was sent, and what the node says of it.
#[derive(Debug, Serialize)]
pub struct ProgramReport {
    /// The node.
    pub node: u8,
    /// The number of the program: the sub-index of 1F50h.
    pub program: u8,
    /// Bytes of the file.
    pub bytes: usize,
    /// CRC-32 of the file.
    pub checksum: u32,
    /// False where the node had it already, and nothing was sent.
    pub sent: bool,
    /// 1F56h, read back; `None` of a node without it.
    pub identification: Option<u32>,
    /// 1F57h, read back; `None` of a node without it.
    pub flash_status: Option<u32>,
    /// The identification is the checksum.
    pub verified: bool,
    /// 1F51h says that it runs; `None` of a node without it.
    pub running: Option<bool>,
    /// What to know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Sends a program to a node, unless it is there already, and starts it.
///
/// # Errors
/// What the node refused, or a drive whose power stage is on, or a memory that reports an error.
pub async fn program(
    network: &Network,
    node: NodeId,
    number: u8,
    data: &[u8],
    progress: &impl Progress,
) -> Result<ProgramReport, Failure> {
    let target = ProgramArea { network, node: network.node(node), number };
    target.is_without_power().await?;
    let checksum = crc32(data);
    let before = target.read_u32(IDENTIFICATION).await?;
    let sound = target.read_u32(STATUS).await?.is_none_or(|status| error_of(status) == 0);
    let is_there = before == Some(checksum) && sound;
    if !is_there {
        target.control(STOP, progress).await?;
        target.control(CLEAR, progress).await?;
        target.send(data, progress).await?;
    }
    let flash_status = target.wait_for_memory(progress).await?;
    if let Some(error) = flash_status.map(error_of).filter(|error| *error != 0) {
        return Err(target.bad_memory(error));
    }
    let identification = target.read_u32(IDENTIFICATION).await?;
    if target.read_control().await? != Some(START) {
        target.control(START, progress).await?;
    }
    let running = target.read_control().await?.map(|state| state == START);
    let verified = identification == Some(checksum);
    let note = (!verified).then(|| match identification {
        Some(identification) => format!(
            "1F56h is {identification:08X}h, which is not the CRC-32 of the file: compare it with what the maker states for this program"
        ),
        None => "the node has no 1F56h: what it holds cannot be compared with the file".to_owned(),
    });
    Ok(ProgramReport {
        node: node.raw(),
        program: number,
        bytes: data.len(),
        checksum,
        sent: !is_there,
        identification,
        flash_status,
        verified,
        running,
        note,
    })
}

/// A program of a node.
struct ProgramArea<'a> {
    network: &'a Network,
    node: Node,
    number: u8,
}

impl ProgramArea<'_> {
    const fn object(&self, index: u16) -> Mux {
        Mux::new(index, self.number)
    }

    fn failure(&self, what: &str) -> Failure {
        Failure::new(format!("node {}: {what}", self.node.id())).at_node(self.node.id())
    }

    /// Refuses a drive whose motors have power.
    async fn is_without_power(&self) -> Result<(), Failure> {
        for axis in 0..AXES {
            let object = Mux::new(0x6041 + 0x800 * axis, 0);
            let Some(statusword) = present(self.node.read::<u16>(object).await)? else { return Ok(()) };
            let state = Statusword(statusword).state();
            let powered = [PowerState::OperationEnabled, PowerState::QuickStopActive, PowerState::FaultReactionActive];
            if let Some(state) = state.filter(|state| powered.contains(state)) {
                let node = self.node.id();
                let failure = self.failure("its motor has power, and a program is sent to drives without only");
                return Err(failure
                    .at_object(object)
                    .because(format!("{object} reads {statusword:04X}h, {}", state.name()))
                    .next(format!(
                        "bring it to a stop and disable it: ferrodrive stop {node}, then ferrodrive disable {node}"
                    )));
            }
        }
        Ok(())
    }

    async fn read_u32(&self, index: u16) -> Result<Option<u32>, Failure> {
        present(self.node.read::<u32>(self.object(index)).await)
    }

    async fn read_control(&self) -> Result<Option<u8>, Failure> {
        present(self.node.read::<u8>(self.object(CONTROL)).await)
    }

    /// Stops, clears or starts the program, where the node has 1F51h, and waits for its memory.
    async fn control(&self, value: u8, progress: &impl Progress) -> Result<(), Failure> {
        let what = match value {
            STOP => "stopping",
            CLEAR => "clearing",
            _ => "starting",
        };
        progress.show(format!("node {}: {what} program {}", self.node.id(), self.number));
        present(self.node.write(self.object(CONTROL), value).await)?;
        self.wait_for_memory(progress).await.map(|_| ())
    }

    /// Sends the data.
    async fn send(&self, data: &[u8], progress: &impl Progress) -> Result<(), Failure> {
        let (node, all) = (self.node.id(), data.len());
        let download = self.node.download(self.object(DATA), data);
        tokio::pin!(download);
        loop {
            tokio::select! {
                biased;
                done = &mut download => return done.map_err(Failure::from),
                () = self.network.sleep(PROGRESS_PERIOD) => {
                    if let Some(done) = self.network.with_core(|core| core.bytes_done(node)) {
                        let percent = done * 100 / all.max(1);
                        progress.count(format!("node {node}: {done} of {all} bytes sent ({percent} %)"));
                    }
                }
            }
        }
    }

    /// Waits until the memory is not written any more; what 1F57h then is, where the node has it.
    async fn wait_for_memory(&self, progress: &impl Progress) -> Result<Option<u32>, Failure> {
        let until = self.network.now() + MEMORY_PATIENCE;
        loop {
            let status = self.read_u32(STATUS).await?;
            if status.is_none_or(|status| status & IN_PROGRESS == 0) {
                return Ok(status);
            }
            if self.network.now() >= until {
                let object = self.object(STATUS);
                let failure = self.failure("its memory is still being written after 60 s").at_object(object);
                return Err(failure.next(format!("read {object} again: ferrodrive read {} {object}", self.node.id())));
            }
            progress.show(format!("node {}: its memory is being written", self.node.id()));
            self.network.sleep(MEMORY_PERIOD).await;
        }
    }

    fn bad_memory(&self, error: u32) -> Failure {
        let what = match error {
            NO_PROGRAM => "it has no valid program".to_owned(),
            error => format!("its memory reports error {error}"),
        };
        let object = self.object(STATUS);
        let failure = self.failure(&what).at_object(object);
        failure
            .because(format!("{object}, bits 1 to 7"))
            .next("check that the file is a program for this device, and send it again")
    }
}

const fn error_of(status: u32) -> u32 {
    status >> 1 & 0x7F
}

/// What was read or written, unless the node does not have the object.
fn present<T>(result: Result<T, Error>) -> Result<Option<T>, Failure> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) => match error.abort() {
            Some(AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX) => Ok(None),
            _ => Err(error.into()),
        },
    }
}

/// CRC-32 as in ISO 3309 and IEEE 802.3.
fn crc32(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 == 1 { sum >> 1 ^ POLYNOMIAL } else { sum >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of the catalogue of CRCs.
    #[test]
    fn the_checksum_of_123456789_is_cbf43926() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }
}
