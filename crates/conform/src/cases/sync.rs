//! SYNC: its identifier, its consumer, its producer and its counter.

use can::{BusFrame, CanId, Frame};
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::{AbortCode, Mux, NmtCommand};

use crate::bench::{Bench, hex, ms, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const COB_ID: Mux = Mux::new(0x1005, 0);
const PERIOD: Mux = Mux::new(0x1006, 0);
const OVERFLOW: Mux = Mux::new(0x1019, 0);
const PRODUCES: u32 = 1 << 30;
const PERIOD_MS: u64 = 20;

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("SYNC 01", "1005h is 80h", "CiA 301, 7.5.2.5", [Need::Index(0x1005)], [], identifier),
    case!("SYNC 02", "A producer sends SYNC with the period of 1006h", "CiA 301, 7.5.2.6", [Need::Index(0x1005), Need::Index(0x1006)], [], produced),
    case!("SYNC 03", "A transmit PDO of type 1 is sent once with each SYNC", "CiA 301, 7.2.5", [Need::Index(0x1005), Need::Tpdo], ["tpdo_answers_rpdo"], consumed),
    case!("SYNC 04", "A producer stops with 1006h = 0", "CiA 301, 7.5.2.6", [Need::Index(0x1005), Need::Index(0x1006)], [], stopped),
    case!("SYNC 05", "Refuse 1 and 241 as 1019h", "CiA 301, 7.5.2.22", [Need::Index(0x1019)], [], reserved_overflow),
    case!("SYNC 06", "With 1019h = 0 SYNC has no byte", "CiA 301, 7.5.2.22", [Need::Index(0x1019), Need::Index(0x1006)], [], without_counter),
    case!("SYNC 07", "The counter of SYNC runs from 1 to 1019h", "CiA 301, 7.2.5", [Need::Index(0x1019), Need::Index(0x1006)], [], with_counter),
    case!("SYNC 08", "1019h is kept by save and reset", "CiA 301, 7.5.2.13", [Need::Index(0x1019), Need::Index(0x1010), Need::Store], [], |bench| kept(bench, false)),
    case!("SYNC 09", "Refuse 1019h while 1006h is not 0", "CiA 301, 7.5.2.22", [Need::Index(0x1019), Need::Index(0x1006)], [], overflow_while_running),
    case!("SYNC 10", "1006h is kept by save and reset", "CiA 301, 7.5.2.13", [Need::Index(0x1006), Need::Index(0x1010), Need::Store], [], |bench| kept(bench, true)),
    case!("SYNC 51", "SYNC is taken from the identifier of 1005h, and from no other", "CiA 301, 7.5.2.5", [Need::Index(0x1005), Need::Tpdo], ["tpdo_answers_rpdo", "other_access"], moved),
    case!("SYNC 52", "The counter of SYNC begins at 1 again when the node leaves stopped", "CiA 301, 7.2.5.1", [Need::Index(0x1019), Need::Index(0x1006)], [], counted_anew),
    case!("SYNC 53", "2 and 240 are taken as 1019h", "CiA 301, 7.5.2.22", [Need::Index(0x1019)], [], overflow_at_its_limits),
];

async fn identifier(bench: &mut Bench) -> Verdict {
    let says = bench.number(COB_ID).await? as u32;
    if says & !PRODUCES != 0x80 {
        fail!("1005h is {says:08X}h; the predefined connection set has 00000080h");
    }
    Ok(format!("{says:08X}h"))
}

/// The node produces SYNC from now on; what it needs is written and comes back.
async fn produce(bench: &mut Bench, overflow: Option<u8>) -> Result<(), Finding> {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    bench.watch(canopen::connection_set::SYNC);
    if let Some(overflow) = overflow
        && let Err(code) = bench.try_write(OVERFLOW, &[overflow]).await?
    {
        not_applicable!("the device takes no SYNC counter: {code}");
    }
    if let Err(code) = bench.try_write(PERIOD, &(PERIOD_MS as u32 * 1000).to_le_bytes()).await? {
        not_applicable!("the device takes no SYNC period: {code}");
    }
    if let Err(code) = bench.try_write(COB_ID, &(0x80 | PRODUCES).to_le_bytes()).await? {
        not_applicable!("the device does not produce SYNC: {code}");
    }
    Ok(())
}

async fn syncs(bench: &mut Bench, during: u64) -> Vec<BusFrame> {
    bench.absorb();
    bench.collect(ms(during), |frame| frame.id() == canopen::connection_set::SYNC).await
}

/// The counters of SYNC, of those that have one.
async fn counters(bench: &mut Bench, during: u64) -> Vec<u8> {
    let heard = syncs(bench, during).await;
    heard.iter().filter_map(|passed| passed.frame.data().first().copied()).collect()
}

async fn produced(bench: &mut Bench) -> Verdict {
    produce(bench, None).await?;
    let count = 10;
    let heard = syncs(bench, PERIOD_MS * count).await.len() as u64;
    if heard.abs_diff(count) > 1 {
        fail!("with a period of {PERIOD_MS} ms it sent {heard} in {} ms", PERIOD_MS * count);
    }
    Ok(format!("{heard} in {} ms", PERIOD_MS * count))
}

async fn stopped(bench: &mut Bench) -> Verdict {
    produce(bench, None).await?;
    bench.write(PERIOD, &[0; 4]).await?;
    match syncs(bench, PERIOD_MS * 10).await.len() {
        0 => Ok("none is sent".into()),
        heard => fail!("1006h is 0, and SYNC is sent {heard} times in {} ms", PERIOD_MS * 10),
    }
}

async fn without_counter(bench: &mut Bench) -> Verdict {
    produce(bench, Some(0)).await?;
    let heard = syncs(bench, PERIOD_MS * 5).await;
    match heard.iter().find(|passed| passed.frame.dlc() != 0) {
        Some(passed) => fail!("1019h is 0, and SYNC is {}", passed.frame),
        None if heard.is_empty() => fail!("no SYNC came"),
        None => Ok(format!("{} without a byte", heard.len())),
    }
}

async fn with_counter(bench: &mut Bench) -> Verdict {
    const HIGHEST: u8 = 4;
    produce(bench, Some(HIGHEST)).await?;
    let counters = counters(bench, PERIOD_MS * 10).await;
    let follows = |pair: &[u8]| pair[1] == pair[0] % HIGHEST + 1;
    if counters.len() < 5 || !counters.windows(2).all(follows) || !counters.iter().all(|at| (1..=HIGHEST).contains(at))
    {
        fail!("with 1019h = {HIGHEST} the counters were {counters:?}");
    }
    Ok(format!("{counters:?}"))
}

async fn counted_anew(bench: &mut Bench) -> Verdict {
    // Not reached here: what goes on counting does not come to 1 by itself.
    produce(bench, Some(100)).await?;
    let before = counters(bench, PERIOD_MS * 10).await;
    let Some(last) = before.last().filter(|last| **last > 1) else {
        not_applicable!("no counter is there to begin anew: {before:?}");
    };
    bench.nmt(NmtCommand::Stop).await;
    bench.absorb();
    // All that comes from now on, not only what comes after the time that a command takes.
    bench.send(NmtRequest::new(NmtCommand::EnterPreOperational, NmtTarget::Node(bench.node())).emit());
    let heard = bench.collect(ms(PERIOD_MS * 10), |frame| frame.id() == canopen::connection_set::SYNC).await;
    match heard.first().and_then(|passed| passed.frame.data().first()) {
        Some(1) => Ok(format!("1 after {last}, with NMT stopped in between")),
        Some(first) => fail!("the counter was {last}; after NMT stopped it went on with {first}"),
        None => fail!("no SYNC with a counter came after the node left NMT stopped"),
    }
}

async fn overflow_at_its_limits(bench: &mut Bench) -> Verdict {
    // It may be written while SYNC is not produced only; a device without 1006h produces none.
    let _ = bench.try_write(PERIOD, &[0; 4]).await?;
    if let Err(code) = bench.try_write(OVERFLOW, &[10]).await? {
        not_applicable!("the device takes no SYNC counter: {code}");
    }
    for value in [2, canopen::sync::MAX_COUNTER] {
        if let Err(code) = bench.try_write(OVERFLOW, &[value]).await? {
            fail!("{value} for 1019h was refused: {code}");
        }
        let read = bench.number(OVERFLOW).await?;
        if read != i64::from(value) {
            fail!("{value} was written to 1019h, and {read} is read");
        }
    }
    Ok("2 and 240 are taken".into())
}

async fn consumed(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let tpdo = bench.set_up_tpdo(1, 0).await?;
    bench.nmt(NmtCommand::Start).await;
    bench.collect(ms(50), |_| false).await;
    for number in 1..=5 {
        let heard = bench.sync(None, tpdo.id).await.len();
        if heard != 1 {
            fail!("SYNC {number} was followed by {heard} PDOs of type 1");
        }
    }
    Ok("5 SYNCs, 5 PDOs".into())
}

async fn reserved_overflow(bench: &mut Bench) -> Verdict {
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW, AbortCode::GENERAL];
    for value in [1, 241] {
        let answer = bench.try_write(OVERFLOW, &[value]).await?;
        refused(&format!("{value} for 1019h"), &answer, &codes)?;
    }
    Ok("1 and 241 are refused".into())
}

async fn overflow_while_running(bench: &mut Bench) -> Verdict {
    if let Err(code) = bench.try_write(PERIOD, &(PERIOD_MS as u32 * 1000).to_le_bytes()).await? {
        not_applicable!("the device takes no SYNC period: {code}");
    }
    let answer = bench.try_write(OVERFLOW, &[10]).await?;
    // A device without a counter refuses the value as such.
    let codes = [AbortCode::DEVICE_STATE, AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::GENERAL];
    refused("10 for 1019h while 1006h is not 0", &answer, &codes)
}

async fn kept(bench: &mut Bench, period: bool) -> Verdict {
    let (mux, data): (_, &[u8]) = if period { (PERIOD, &[0x20, 0x4E, 0, 0]) } else { (OVERFLOW, &[10]) };
    let stored = bench.stored_value(mux).await?;
    if let Err(code) = bench.download(mux, data).await? {
        not_applicable!("{mux} does not take the value: {code}");
    }
    let after = saved_and_read(bench, mux).await;
    bench.store_again(mux, &stored).await?;
    let after = after?;
    if after != data {
        fail!("{mux} was saved as {} and is {} after a reset", hex(data), hex(&after));
    }
    Ok(format!("{mux} is {} after save and reset", hex(data)))
}

async fn saved_and_read(bench: &mut Bench, mux: Mux) -> Result<Vec<u8>, Finding> {
    bench.save().await?;
    bench.stored_value(mux).await
}

async fn moved(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let tpdo = bench.set_up_tpdo(1, 0).await?;
    if let Err(code) = bench.try_write(COB_ID, &0xA0_u32.to_le_bytes()).await? {
        // CiA 301, 7.5.2.5 lets it be constant.
        not_applicable!("1005h does not take another identifier: {code}");
    }
    bench.nmt(NmtCommand::Start).await;
    bench.collect(ms(50), |_| false).await;
    let at_80 = bench.sync(None, tpdo.id).await.len();
    bench.send(Frame::new(CanId::standard(0xA0), &[]));
    let at_a0 = bench.collect(ms(50), |frame| frame.id() == tpdo.id).await.len();
    if (at_80, at_a0) != (0, 1) {
        fail!("with 1005h = A0h a SYNC of 080h was followed by {at_80} PDOs, one of 0A0h by {at_a0}");
    }
    Ok("a SYNC of 0A0h is taken, one of 080h is not".into())
}
