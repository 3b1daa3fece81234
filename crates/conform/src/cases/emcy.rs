//! EMCY 01 to 06: the error register, the emergency message and the error history.

use std::time::Duration;

use can::{CanId, Frame};
use canopen::emcy::Emcy;
use canopen::{CobId, Mux, NmtCommand, NodeId};

use crate::bench::{Bench, ms, silent};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const REGISTER: Mux = Mux::new(0x1001, 0);
const HISTORY: Mux = Mux::new(0x1003, 0);

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("EMCY 01", "1014h is 80h + node-ID", "CiA 301, 7.5.2.17", [Need::Index(0x1014)], [], identifier),
    case!("EMCY 02", "1001h can be read", "CiA 301, 7.5.2.2", [], [], register),
    case!("EMCY 03", "1003h can be read as far as it counts", "CiA 301, 7.5.2.4", [Need::Index(0x1003)], [], history),
    case!("EMCY 04", "A lost heartbeat, or a short PDO where there is no 1016h, is reported by an EMCY message", "CiA 301, 7.2.7.1", [Need::Index(0x1014), Need::AnError], ["host_heartbeat"], |bench| force(bench, After::Message)),
    case!("EMCY 05", "1001h says what the EMCY message says", "CiA 301, 7.5.2.2", [Need::Index(0x1014), Need::AnError], [], |bench| force(bench, After::Register)),
    case!("EMCY 06", "1003h:01 has the code of the EMCY message", "CiA 301, 7.5.2.4", [Need::Index(0x1014), Need::Index(0x1003), Need::AnError], [], |bench| force(bench, After::History)),
    case!("EMCY 51", "1003h:00 takes 0, which forgets all, and nothing else", "CiA 301, 7.5.2.4", [Need::Index(0x1003)], [], forget),
    case!("EMCY 52", "The end of the error is reported with code 0000h", "CiA 301, 7.2.7.1", [Need::Index(0x1014), Need::Index(0x1016)], [], |bench| force(bench, After::End)),
    case!("EMCY 53", "No EMCY message with bit 31 of 1014h set", "CiA 301, 7.5.2.17", [Need::Index(0x1014), Need::Index(0x1016)], [], switched_off),
];

async fn identifier(bench: &mut Bench) -> Verdict {
    let says = bench.number(Mux::new(0x1014, 0)).await? as u32;
    let expected = 0x80 + u32::from(bench.node().raw());
    if says & 0x7FF != expected || says & 0x6000_0000 != 0 {
        fail!("1014h is {says:08X}h; the predefined connection set has {expected:08X}h");
    }
    Ok(format!("{says:08X}h"))
}

async fn register(bench: &mut Bench) -> Verdict {
    let data = bench.read(REGISTER).await?;
    match data[..] {
        [register] => Ok(format!("{register:02X}h")),
        _ => fail!("1001h has {} bytes, not one", data.len()),
    }
}

async fn history(bench: &mut Bench) -> Verdict {
    let count = bench.number(HISTORY).await?;
    for sub_index in 1..=count.min(254) {
        bench.read(Mux::new(0x1003, sub_index as u8)).await?;
    }
    Ok(format!("{count} errors kept"))
}

async fn forget(bench: &mut Bench) -> Verdict {
    if bench.subject.row(0x1003, 0).is_none_or(|row| !row.access.is_writable()) {
        not_applicable!("1003h:00 is read-only");
    }
    let codes = [canopen::AbortCode::INVALID_VALUE, canopen::AbortCode::VALUE_TOO_HIGH, canopen::AbortCode::GENERAL];
    let answer = bench.download(HISTORY, &[1]).await?;
    crate::bench::refused("1 for 1003h:00", &answer, &codes)?;
    if let Err(code) = bench.download(HISTORY, &[0]).await? {
        fail!("1003h:00 does not take 0: {code}");
    }
    match bench.number(HISTORY).await? {
        0 => Ok("nothing is kept".into()),
        count => fail!("0 was written to 1003h:00, and it says {count}"),
    }
}

/// What is looked at once the error is there.
#[derive(Clone, Copy, PartialEq, Eq)]
enum After {
    Message,
    Register,
    History,
    End,
}

/// CiA 301, table 26: life guard or heartbeat error.
pub(super) const HEARTBEAT_ERROR: u16 = 0x8130;
/// CiA 301, table 26: a PDO is not processed because it is too short.
const SHORT_PDO: u16 = 0x8210;
/// How long the heartbeat that is watched may stay away.
pub(super) const TIME_MS: u32 = 300;

/// A node that is surely not on the bus: the suite speaks for it.
pub(super) fn absent_node(bench: &Bench) -> NodeId {
    let preferred = NodeId::all().filter(|node| *node != bench.node()).last();
    preferred.unwrap_or(bench.node())
}

/// Has the device watch an absent node. Its own sub-index, so that what is watched already stays so.
pub(super) async fn consume(bench: &mut Bench, producer: NodeId) -> Result<Mux, Finding> {
    let rows = || bench.subject.rows().filter(|row| row.index == 0x1016 && row.sub_index > 0);
    let Some(entry) = rows().last().map(|row| row.mux()) else { not_applicable!("1016h has no entry") };
    let value = u32::from(producer.raw()) << 16 | TIME_MS;
    bench.write(entry, &value.to_le_bytes()).await?;
    Ok(entry)
}

/// One heartbeat of an absent node, operational.
pub(super) async fn beat(bench: &mut Bench, producer: NodeId) {
    let id = canopen::connection_set::heartbeat(producer);
    bench.send(Frame::new(id, &[5]));
    // Requests that follow have lower identifiers: they would go before it.
    bench.pause(ms(5)).await;
}

/// An error that the suite has brought about.
struct Forced {
    /// The code that its EMCY message has to have.
    code: u16,
    /// In words.
    what: &'static str,
    within: Duration,
    /// Who comes back for it to end.
    producer: Option<NodeId>,
}

async fn lose_heartbeat(bench: &mut Bench) -> Result<Forced, Finding> {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    beat(bench, producer).await;
    let within = ms(u64::from(TIME_MS) + 1000);
    let what = "a heartbeat that is watched has stayed away";
    Ok(Forced { code: HEARTBEAT_ERROR, what, within, producer: Some(producer) })
}

/// A receive PDO without a byte: of the first one that is in use, or else of one that is set up for it.
async fn shorten_pdo(bench: &mut Bench) -> Result<Forced, Finding> {
    if bench.subject.description.pdo.short_rpdo.is_none() {
        not_applicable!("the device has no 1016h, and reports no PDO that is too short");
    }
    // The error of a case before may be there still, and is reported once.
    bench.reset(NmtCommand::ResetCommunication).await?;
    let mut id = None;
    for index in bench.subject.pdos(0x1400) {
        let cob = CobId(bench.number(Mux::new(index, 1)).await? as u32);
        let mapped = bench.number(Mux::new(index + 0x200, 0)).await?;
        let at_once = bench.number(Mux::new(index, 2)).await? >= 254;
        if cob.is_valid() && mapped > 0 && at_once {
            id = Some(CanId::standard((cob.0 & 0x7FF) as u16));
            break;
        }
    }
    let id = match id {
        Some(id) => id,
        None => super::pdo::set_up_rpdo(bench, 255).await?.id,
    };
    bench.nmt(NmtCommand::Start).await;
    bench.absorb();
    bench.send(Frame::new(id, &[]));
    Ok(Forced { code: SHORT_PDO, what: "a PDO without a byte", within: ms(1000), producer: None })
}

async fn force(bench: &mut Bench, after: After) -> Verdict {
    let forced = match bench.subject.description.has_index(0x1016) {
        true => lose_heartbeat(bench).await?,
        false => shorten_pdo(bench).await?,
    };
    let id = bench.emcy_id();
    let Some(passed) = bench.wait_for(forced.within, |frame| frame.id() == id).await else {
        return silent(&format!("an EMCY message after {}", forced.what), forced.within);
    };
    let Some(emcy) = Emcy::parse(&passed.frame).filter(|_| passed.frame.dlc() == 8) else {
        fail!("the EMCY message {} does not have eight bytes", passed.frame);
    };
    if emcy.code.0 != forced.code && after == After::Message {
        fail!(
            "after {} the EMCY message has the code {:04X}h; expected {:04X}h",
            forced.what,
            emcy.code.0,
            forced.code
        );
    }
    let register = bench.number(REGISTER).await? as u8;
    match after {
        After::Message => Ok(format!("{:04X}h, error register {:02X}h", emcy.code.0, emcy.error_register)),
        After::Register => says_the_same(register, &emcy),
        After::History => kept(bench, emcy.code.0).await,
        After::End => ended(bench, forced.producer).await,
    }
}

fn says_the_same(register: u8, emcy: &Emcy) -> Verdict {
    if register != emcy.error_register {
        fail!("1001h is {register:02X}h; the EMCY message has {:02X}h", emcy.error_register);
    }
    // Bit 0 is set with any error (CiA 301, 7.5.2.2).
    if register & 1 == 0 {
        fail!("1001h is {register:02X}h while there is an error: bit 0 is not set");
    }
    Ok(format!("both {register:02X}h"))
}

async fn kept(bench: &mut Bench, code: u16) -> Verdict {
    let latest = bench.number(Mux::new(0x1003, 1)).await? as u32;
    if latest & 0xFFFF != u32::from(code) {
        fail!("1003h:01 is {latest:08X}h; the EMCY message had the code {code:04X}h");
    }
    Ok(format!("{latest:08X}h"))
}

async fn ended(bench: &mut Bench, producer: Option<NodeId>) -> Verdict {
    let id = bench.emcy_id();
    bench.count(id);
    if let Some(producer) = producer {
        beat(bench, producer).await;
    }
    // Of a drive that the loss has brought into Fault the error ends with the reset of that.
    bench.leave_fault().await?;
    // Sooner than the next loss.
    bench.pause(ms(150)).await;
    match bench.last_counted().and_then(|frame| Emcy::parse(&frame)) {
        Some(emcy) if emcy.code.0 == 0 => Ok("error reset".into()),
        Some(emcy) => fail!("when the heartbeat is back the EMCY message has the code {:04X}h, not 0000h", emcy.code.0),
        None => silent("an EMCY message when the heartbeat is back", ms(150)),
    }
}

async fn switched_off(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let cob = 0x8000_0080 + u32::from(bench.node().raw());
    if let Err(code) = bench.try_write(Mux::new(0x1014, 0), &cob.to_le_bytes()).await? {
        not_applicable!("bit 31 of 1014h cannot be set: {code}");
    }
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    beat(bench, producer).await;
    let id = bench.emcy_id();
    match bench.wait_for(ms(u64::from(TIME_MS) + 500), |frame| frame.id() == id).await {
        Some(passed) => fail!("bit 31 of 1014h is set, and {} is sent", passed.frame),
        None => Ok("none is sent".into()),
    }
}
