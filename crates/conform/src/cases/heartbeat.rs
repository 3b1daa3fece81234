//! HB 01 to 07: the producer, 1017h, and the consumer, 1016h.

use canopen::emcy::Emcy;
use canopen::{AbortCode, Mux, NmtCommand, NmtState};

use super::emcy::{HEARTBEAT_ERROR, TIME_MS, absent_node, beat, consume};
use crate::bench::{Bench, SILENCE, ms, refused, silent};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const PERIOD: Mux = Mux::new(0x1017, 0);
const CONSUMER: Need = Need::Index(0x1016);

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("HB 01", "1017h can be written", "CiA 301, 7.5.2.20", [Need::Writable(0x1017)], [], writable),
    case!("HB 02", "101 heartbeats in 10 s with 1017h = 100 ms", "CiA 301, 7.2.8.3.2", [Need::Writable(0x1017)], [], counted),
    case!("HB 03", "No heartbeat with 1017h = 0", "CiA 301, 7.5.2.20", [Need::Writable(0x1017)], [], off),
    case!("HB 04", "Refuse a node twice in 1016h", "CiA 301, 7.5.2.19", [CONSUMER], [], twice),
    case!("HB 05", "A producer in time is not missed", "CiA 301, 7.2.8.3.2", [CONSUMER, Need::Index(0x1014)], [], in_time),
    case!("HB 06", "A producer that is late is missed", "CiA 301, 7.2.8.3.2", [CONSUMER, Need::Index(0x1014)], [], late),
    case!("HB 07", "After a reset a consumer in operational that misses a heartbeat reports it and leaves operational", "CiA 301, 7.5.2.32", [CONSUMER, Need::Index(0x1014), Need::Writable(0x1017)], [], missed_in_operational),
    case!("HB 51", "The heartbeat says the NMT state", "CiA 301, 7.2.8.3.2", [Need::Writable(0x1017)], ["heartbeat_tells_alarm"], says_state),
    case!("HB 52", "A consumer waits for the first heartbeat", "CiA 301, 7.2.8.3.2", [CONSUMER, Need::Index(0x1014)], [], waits_for_first),
    case!("HB 53", "The producer's time after a reset is the stored one", "CiA 301, 7.3.2.2.1", [Need::Writable(0x1017)], [], after_reset),
];

async fn writable(bench: &mut Bench) -> Verdict {
    for value in [500_u16, 1000] {
        bench.write(PERIOD, &value.to_le_bytes()).await?;
        let says = bench.number(PERIOD).await?;
        if says != i64::from(value) {
            fail!("{value} ms was written; {says} ms is read");
        }
    }
    Ok("500 ms and 1000 ms are taken".into())
}

async fn counted(bench: &mut Bench) -> Verdict {
    bench.write(PERIOD, &[100, 0]).await?;
    let id = bench.heartbeat_id();
    bench.absorb();
    if bench.wait_for(ms(500), |frame| frame.id() == id).await.is_none() {
        return silent("a heartbeat", ms(500));
    }
    let heard = bench.collect(ms(10_000), |frame| frame.id() == id && !frame.is_remote()).await.len() + 1;
    // Two in a hundred: a device's clock, and where the ten seconds begin.
    if !(99..=103).contains(&heard) {
        fail!("{heard} came in 10 s");
    }
    Ok(format!("{heard} in 10 s"))
}

async fn off(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    bench.heartbeat().await?;
    bench.write(PERIOD, &[0, 0]).await?;
    // One may have waited for the bus.
    bench.pause(ms(20)).await;
    let id = bench.heartbeat_id();
    match bench.wait_for(ms(500), |frame| frame.id() == id).await {
        Some(passed) => fail!("1017h is 0, and {} is sent", passed.frame),
        None => Ok("none in 500 ms".into()),
    }
}

async fn twice(bench: &mut Bench) -> Verdict {
    let entries: Vec<_> =
        bench.subject.rows().filter(|row| row.index == 0x1016 && row.sub_index > 0).map(|row| row.mux()).collect();
    let [.., first, second] = entries[..] else { not_applicable!("1016h has one entry") };
    let value = (u32::from(absent_node(bench).raw()) << 16 | 500).to_le_bytes();
    bench.write(first, &value).await?;
    let answer = bench.try_write(second, &value).await?;
    refused(
        &format!("the node of {first} in {second} too"),
        &answer,
        &[AbortCode::PARAMETER_INCOMPATIBLE, AbortCode::GENERAL],
    )
}

async fn in_time(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    let id = bench.emcy_id();
    for _ in 0..10 {
        beat(bench, producer).await;
        if let Some(passed) = bench.wait_for(ms(150), |frame| frame.id() == id).await {
            fail!("{} came though a heartbeat came every 150 ms of {TIME_MS} ms", passed.frame);
        }
    }
    Ok("ten heartbeats, 150 ms apart, and none is missed".into())
}

async fn late(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    let id = bench.emcy_id();
    beat(bench, producer).await;
    let Some(passed) = bench.wait_for(ms(1000), |frame| frame.id() == id).await else {
        return silent(&format!("an EMCY message after {TIME_MS} ms without a heartbeat"), ms(1000));
    };
    Ok(format!("{}", passed.frame))
}

async fn waits_for_first(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    let id = bench.emcy_id();
    match bench.wait_for(ms(800), |frame| frame.id() == id).await {
        Some(passed) => fail!("{} came though no heartbeat ever came", passed.frame),
        None => Ok("nothing is missed before the first heartbeat".into()),
    }
}

/// Pre-operational, if 1029h:01 does not ask for another state.
async fn after_error(bench: &mut Bench) -> Result<NmtState, Finding> {
    let behaviour = Mux::new(0x1029, 1);
    if bench.subject.description.row(behaviour).is_none() {
        return Ok(NmtState::PreOperational);
    }
    match bench.number(behaviour).await? {
        0 => Ok(NmtState::PreOperational),
        1 => Ok(NmtState::Operational),
        2 => Ok(NmtState::Stopped),
        other => not_applicable!("1029h:01 is {other}, a behaviour of the maker's"),
    }
}

async fn missed_in_operational(bench: &mut Bench) -> Verdict {
    bench.reset(NmtCommand::ResetNode).await?;
    let expected = after_error(bench).await?;
    bench.start_heartbeat().await?;
    let producer = absent_node(bench);
    consume(bench, producer).await?;
    bench.nmt(NmtCommand::Start).await;
    beat(bench, producer).await;
    bench.expect_state(NmtState::Operational).await?;
    let id = bench.emcy_id();
    let Some(passed) = bench.wait_for(ms(1000), |frame| frame.id() == id).await else {
        return silent(&format!("an EMCY message after {TIME_MS} ms without a heartbeat"), ms(1000));
    };
    match Emcy::parse(&passed.frame) {
        Some(emcy) if emcy.code.0 == HEARTBEAT_ERROR => {}
        _ => fail!("{} does not have the code {HEARTBEAT_ERROR:04X}h, heartbeat error", passed.frame),
    }
    // One may have waited for the bus.
    bench.pause(ms(20)).await;
    bench.expect_state(expected).await?;
    Ok(format!("{}, and {expected}", passed.frame))
}

async fn after_reset(bench: &mut Bench) -> Verdict {
    bench.reset(NmtCommand::ResetCommunication).await?;
    let stored = bench.number(PERIOD).await?;
    let other: u16 = if stored == 50 { 70 } else { 50 };
    bench.write(PERIOD, &other.to_le_bytes()).await?;
    bench.reset(NmtCommand::ResetCommunication).await?;
    let says = bench.number(PERIOD).await?;
    // Some devices store each write by themselves.
    let keeps = bench.subject.description.storage.stores_each_write().is_some();
    if says != stored && !(keeps && says == i64::from(other)) {
        fail!("1017h was {stored} after a reset, got {other} and is {says} after another reset");
    }
    let id = bench.heartbeat_id();
    bench.absorb();
    let heard = bench.wait_for(SILENCE.max(ms(says as u64 * 2)), |frame| frame.id() == id).await;
    match (says, heard) {
        (0, Some(passed)) => fail!("1017h is 0, and {} is sent", passed.frame),
        (1.., None) => silent("a heartbeat", ms(says as u64 * 2)),
        _ => Ok(format!("{says} ms")),
    }
}

async fn says_state(bench: &mut Bench) -> Verdict {
    bench.start_heartbeat().await?;
    for (command, state) in
        [(NmtCommand::EnterPreOperational, 0x7F), (NmtCommand::Start, 0x05), (NmtCommand::Stop, 0x04)]
    {
        bench.nmt(command).await;
        let byte = bench.heartbeat().await?;
        if byte != state {
            fail!("the heartbeat says {byte:02X}h; expected {state:02X}h");
        }
    }
    Ok("7Fh, 05h and 04h".into())
}
