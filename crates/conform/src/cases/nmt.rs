//! STATE 01 to 04 and TRANS 01 to 04: what a node does in each NMT state, and how it gets there (CiA 301, 7.3.2).

use can::Frame;
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::sdo::wire::Request;
use canopen::{Mux, NmtCommand, NmtState, connection_set};

use crate::bench::{Bench, SILENCE, hex, ms};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);
const PRODUCER: Need = Need::Index(0x1017);

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("STATE 01", "Initialisation: boot-up message, and parameters as stored", "CiA 301, 7.3.2.2.1", [], [], initialisation),
    case!("STATE 02", "Pre-operational: SDO is answered, the node got there by itself", "CiA 301, 7.3.2.2.2", [], ["starts_operational"], pre_operational),
    case!("STATE 03", "Operational: SDO is answered", "CiA 301, 7.3.2.2.3", [PRODUCER], [], operational),
    case!("STATE 04", "Stopped: SDO is not answered", "CiA 301, 7.3.2.2.4", [PRODUCER], ["heartbeat_tells_alarm", "starts_operational"], stopped),
    case!("TRANS 01", "Reset node and reset communication, from every state", "CiA 301, 7.3.2.2.1", [], [], resets),
    case!("TRANS 02", "Enter pre-operational, from every state", "CiA 301, 7.3.2.1", [PRODUCER], ["heartbeat_tells_alarm"], |bench| transition(bench, NmtCommand::EnterPreOperational, NmtState::PreOperational)),
    case!("TRANS 03", "Start, from every state", "CiA 301, 7.3.2.1", [PRODUCER], ["heartbeat_tells_alarm"], |bench| transition(bench, NmtCommand::Start, NmtState::Operational)),
    case!("TRANS 04", "Stop, from every state", "CiA 301, 7.3.2.1", [PRODUCER], ["heartbeat_tells_alarm"], |bench| transition(bench, NmtCommand::Stop, NmtState::Stopped)),
    case!("TRANS 51", "A command to all nodes is meant for this one too", "CiA 301, 7.2.8.3.1", [PRODUCER], ["heartbeat_tells_alarm"], to_all),
    case!("TRANS 52", "A command to another node is not meant for this one", "CiA 301, 7.2.8.3.1", [PRODUCER], ["heartbeat_tells_alarm"], to_another),
    case!("TRANS 53", "Unknown and malformed commands do nothing", "CiA 301, 7.2.8.3.1", [PRODUCER], ["heartbeat_tells_alarm"], malformed),
    case!("TRANS 54", "A reset ends with a boot-up message, and one only", "CiA 301, 7.2.8.3.3", [], [], one_boot_up),
];

async fn initialisation(bench: &mut Bench) -> Verdict {
    // From power-on values: what is written and not stored is forgotten.
    bench.reset(NmtCommand::ResetNode).await?;
    let Some(row) = bench.subject.harmless().find(|row| !row.is_kept()).or_else(|| bench.subject.harmless().next())
    else {
        return Ok("boot-up message".into());
    };
    let mux = row.mux();
    let stored = bench.read(mux).await?;
    let mut other = stored.clone();
    // Of a period 64 ms and not 1 ms, which would fill the bus.
    if let Some(low) = other.first_mut() {
        *low ^= 0x40;
    }
    bench.write(mux, &other).await?;
    bench.reset(NmtCommand::ResetNode).await?;
    let after = bench.read(mux).await?;
    let keeps = bench.subject.description.storage.stores_each_write().is_some();
    if after != stored && !(keeps && row.is_kept()) {
        fail!(
            "{mux} was {}, got {} without being stored, and is {} after a reset",
            hex(&stored),
            hex(&other),
            hex(&after)
        );
    }
    Ok(format!("boot-up message; {mux} is {} again", hex(&after)))
}

async fn pre_operational(bench: &mut Bench) -> Verdict {
    bench.reset(NmtCommand::ResetNode).await?;
    bench.read(DEVICE_TYPE).await?;
    if bench.start_heartbeat().await.is_err() {
        return Ok("1000h is read after the boot-up message".into());
    }
    bench.expect_state(NmtState::PreOperational).await?;
    Ok("1000h is read after the boot-up message; the heartbeat says 7Fh".into())
}

async fn operational(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    bench.nmt(NmtCommand::Start).await;
    bench.expect_state(NmtState::Operational).await?;
    bench.read(DEVICE_TYPE).await?;
    Ok("the heartbeat says 05h; 1000h is read".into())
}

async fn stopped(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    bench.nmt(NmtCommand::Stop).await;
    bench.expect_state(NmtState::Stopped).await?;
    let request = Frame::full(connection_set::sdo_request(bench.node()), Request::InitiateUpload(DEVICE_TYPE).emit());
    match bench.ask_briefly(request).await {
        Some(answer) => fail!("the read of 1000h is answered in stopped: {answer}"),
        None => Ok("the heartbeat says 04h; the read of 1000h is not answered".into()),
    }
}

const STATES: [NmtCommand; 3] = [NmtCommand::EnterPreOperational, NmtCommand::Start, NmtCommand::Stop];

async fn resets(bench: &mut Bench) -> Verdict {
    for reset in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
        for from in STATES {
            bench.nmt(from).await;
            bench.reset(reset).await?;
            bench.read(DEVICE_TYPE).await?;
        }
    }
    Ok("six resets, six boot-up messages, and 1000h is read after each".into())
}

async fn transition(bench: &mut Bench, command: NmtCommand, state: NmtState) -> Verdict {
    bench.start_heartbeat().await?;
    for from in STATES {
        bench.nmt(from).await;
        bench.nmt(command).await;
        bench.expect_state(state).await?;
    }
    Ok(format!("{state} from each of the three states"))
}

async fn to_all(bench: &mut Bench) -> Verdict {
    let others = bench.others_heard().await;
    if others > 0 {
        not_applicable!("{others} other nodes are on the bus, which the command would reach");
    }
    bench.start_heartbeat().await?;
    for (command, state) in
        [(NmtCommand::Start, NmtState::Operational), (NmtCommand::EnterPreOperational, NmtState::PreOperational)]
    {
        bench.restorer.note_commanded();
        bench.send(NmtRequest::new(command, NmtTarget::All).emit());
        bench.pause(ms(60)).await;
        bench.expect_state(state).await?;
    }
    Ok("start and enter pre-operational".into())
}

async fn to_another(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let other = super::emcy::absent_node(bench);
    bench.send(NmtRequest::new(NmtCommand::Start, NmtTarget::Node(other)).emit());
    bench.pause(ms(60)).await;
    bench.expect_state(NmtState::PreOperational).await?;
    Ok(format!("a start of node {other} leaves it in pre-operational"))
}

async fn malformed(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let node = bench.node().raw();
    let frames: [&[u8]; 4] = [&[], &[1], &[0x55, node], &[0, node]];
    for data in frames {
        bench.send(Frame::new(connection_set::NMT, data));
        bench.pause(ms(30)).await;
        bench.expect_state(NmtState::PreOperational).await?;
    }
    bench.send(Frame::remote(connection_set::NMT, 2));
    bench.pause(ms(30)).await;
    bench.expect_state(NmtState::PreOperational).await?;
    Ok("no byte, one byte, an unknown command, a remote frame: all without effect".into())
}

async fn one_boot_up(bench: &mut Bench) -> Verdict {
    bench.reset(NmtCommand::ResetCommunication).await?;
    let id = bench.heartbeat_id();
    let further = bench.collect(SILENCE, |frame| frame.id() == id && frame.data() == [0]).await.len();
    if further > 0 {
        fail!("the boot-up message came {} times", further + 1);
    }
    let after = bench.find_late_boot_up().await?;
    Ok(format!("one boot-up message{after}"))
}

impl Bench {
    /// Nodes other than this one that send something within 200 ms.
    async fn others_heard(&mut self) -> usize {
        self.pause(ms(200)).await;
        let node = self.node();
        self.network.seen().iter().filter(|other| *other != node).count()
    }

    /// The node answers at once after its boot-up message.
    async fn find_late_boot_up(&mut self) -> Result<&'static str, Finding> {
        self.read(DEVICE_TYPE).await?;
        Ok("; 1000h is read after it")
    }
}
