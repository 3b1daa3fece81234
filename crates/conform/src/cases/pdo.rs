//! PDO 01 to 20: parameters, and when a transmit PDO is sent; in operational, and in no other state.

use std::time::Duration;

use can::{BusFrame, Frame};
use canopen::{AbortCode, CobId, Mux, NmtCommand};

use crate::bench::{Bench, SILENCE, Tpdo, another, entry, hex, ms, refused, silent};
use crate::case::{Case, Need, case};
use crate::cases::pdo_mapping::end_if_constant;
use crate::finding::{Finding, Verdict, fail, not_applicable};
use crate::subject::{bytes_of, number_of};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("PDO 01", "Parameters of the receive PDOs", "CiA 301, 7.5.2.35", [Need::Rpdo], [], |bench| parameters(bench, 0x1400)),
    case!("PDO 02", "Parameters of the transmit PDOs", "CiA 301, 7.5.2.37", [Need::Tpdo], [], |bench| parameters(bench, 0x1800)),
    case!("PDO 03", "A remote frame is answered in operational", "CiA 301, 7.2.2.5.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Remote, NmtPhase::Operational)),
    case!("PDO 04", "Event-driven: sent when what it carries changes", "CiA 301, 7.2.2.3", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Event, NmtPhase::Operational)),
    case!("PDO 05", "Event timer: sent with its period", "CiA 301, 7.5.2.37", [Need::Tpdo], ["pdo_timers", "tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Timer, NmtPhase::Operational)),
    case!("PDO 06", "Synchronous, cyclic: sent after every nth SYNC", "CiA 301, 7.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Cyclic, NmtPhase::Operational)),
    case!("PDO 07", "Synchronous, acyclic: sent after a SYNC only", "CiA 301, 7.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Acyclic, NmtPhase::Operational)),
    case!("PDO 08", "SYNC start value: counted from that SYNC on", "CiA 301, 7.5.2.37", [Need::Tpdo], [], |bench| in_state(bench, TriggeredBy::StartValue, NmtPhase::Operational)),
    case!("PDO 09", "A remote frame is not answered in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], ["starts_operational"], |bench| in_state(bench, TriggeredBy::Remote, NmtPhase::Stopped)),
    case!("PDO 10", "Event-driven: not sent in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Event, NmtPhase::Stopped)),
    case!("PDO 11", "Event timer: not sent in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Timer, NmtPhase::Stopped)),
    case!("PDO 12", "Synchronous, cyclic: not sent in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Cyclic, NmtPhase::Stopped)),
    case!("PDO 13", "Synchronous, acyclic: not sent in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Acyclic, NmtPhase::Stopped)),
    case!("PDO 14", "SYNC start value: nothing in stopped", "CiA 301, 7.3.2.2.4", [Need::Tpdo], [], |bench| in_state(bench, TriggeredBy::StartValue, NmtPhase::Stopped)),
    case!("PDO 15", "A remote frame is not answered in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], ["starts_operational"], |bench| in_state(bench, TriggeredBy::Remote, NmtPhase::PreOperational)),
    case!("PDO 16", "Event-driven: not sent in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Event, NmtPhase::PreOperational)),
    case!("PDO 17", "Event timer: not sent in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Timer, NmtPhase::PreOperational)),
    case!("PDO 18", "Synchronous, cyclic: not sent in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Cyclic, NmtPhase::PreOperational)),
    case!("PDO 19", "Synchronous, acyclic: not sent in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], ["tpdo_answers_rpdo"], |bench| in_state(bench, TriggeredBy::Acyclic, NmtPhase::PreOperational)),
    case!("PDO 20", "SYNC start value: nothing in pre-operational", "CiA 301, 7.3.2.2.2", [Need::Tpdo], [], |bench| in_state(bench, TriggeredBy::StartValue, NmtPhase::PreOperational)),
    case!("PDO 51", "Inhibit time: never sent sooner", "CiA 301, 7.5.2.37", [Need::Tpdo], ["pdo_timers", "tpdo_answers_rpdo"], inhibit_time),
    case!("PDO 52", "A receive PDO writes what it carries", "CiA 301, 7.2.2.5.1", [Need::Rpdo], ["fixed_mapping"], receive),
    case!("PDO 53", "A receive PDO of pre-operational is dropped, not kept for operational", "CiA 301, 7.3.2.2.2", [Need::Rpdo], ["starts_operational", "fixed_mapping"], receive_before_start),
    case!("PDO 54", "A receive PDO that is too short writes nothing", "CiA 301, 7.2.2.5.1", [Need::Rpdo], ["fixed_mapping"], receive_short),
    case!("PDO 55", "A synchronous receive PDO acts with the next SYNC", "CiA 301, 7.2.2.2", [Need::Rpdo], ["fixed_mapping"], receive_synchronous),
    case!("PDO 56", "A PDO that does not exist, COB-ID bit 31, is neither sent nor received", "CiA 301, 7.5.2.37", [Need::Tpdo], ["tpdo_answers_rpdo"], switched_off),
    case!("PDO 57", "Refuse a reserved transmission type", "CiA 301, 7.5.2.37", [Need::Tpdo], [], reserved_type),
    case!("PDO 58", "A transmit PDO carries what SDO reads", "CiA 301, 7.2.2.5.1", [Need::Tpdo], ["tpdo_answers_rpdo", "another_form_in_tpdos"], carries_what_sdo_reads),
];

async fn parameters(bench: &mut Bench, base: u16) -> Verdict {
    let indexes: Vec<u16> = bench.subject.pdos(base).collect();
    for index in &indexes {
        let count = bench.number(Mux::new(*index, 0)).await?;
        if !(2..=6).contains(&count) {
            fail!("{index:04X}h:00 is {count}; a communication parameter has 2 to 6 sub-indexes");
        }
        let cob = CobId(bench.number(Mux::new(*index, 1)).await? as u32);
        if cob.is_valid() && cob.is_restricted() {
            fail!("{index:04X}h:01 is {:08X}h, an identifier that no PDO may use", cob.0);
        }
        let transmission = bench.number(Mux::new(*index, 2)).await?;
        if matches!(transmission, 241..=251) {
            fail!("{index:04X}h:02 is {transmission}, a reserved transmission type");
        }
        let mapping = index + 0x200;
        let mapped = bench.number(Mux::new(mapping, 0)).await?;
        let mut bits = 0;
        for sub_index in 1..=mapped.min(64) {
            bits += bench.number(Mux::new(mapping, sub_index as u8)).await? & 0xFF;
        }
        if mapped > 64 || bits > 64 {
            fail!("{mapping:04X}h maps {mapped} objects of {bits} bits altogether; a PDO has 64 bits");
        }
    }
    Ok(format!("{} PDOs", indexes.len()))
}

/// What makes a transmit PDO be sent.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TriggeredBy {
    Remote,
    Event,
    Timer,
    Cyclic,
    Acyclic,
    StartValue,
}

/// The NMT state in which it is looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum NmtPhase {
    Operational,
    Stopped,
    PreOperational,
}

const TIMER_MS: u16 = 100;
/// SYNCs from one to the next of a cyclic PDO.
const CYCLE: u8 = 2;

async fn in_state(bench: &mut Bench, way: TriggeredBy, phase: NmtPhase) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    if way == TriggeredBy::StartValue {
        return start_value(bench, phase).await;
    }
    let (transmission, timer) = match way {
        TriggeredBy::Remote => (253, 0),
        TriggeredBy::Event => (255, 0),
        TriggeredBy::Timer => (255, TIMER_MS),
        TriggeredBy::Cyclic => (CYCLE, 0),
        TriggeredBy::Acyclic | TriggeredBy::StartValue => (0, 0),
    };
    let tpdo = bench.set_up_tpdo(transmission, timer).await?;
    enter(bench, phase).await;
    match phase {
        NmtPhase::Operational => sent(bench, way, tpdo).await,
        NmtPhase::Stopped | NmtPhase::PreOperational => unsent(bench, way, phase, tpdo).await,
    }
}

async fn enter(bench: &mut Bench, phase: NmtPhase) {
    match phase {
        NmtPhase::Operational => bench.nmt(NmtCommand::Start).await,
        NmtPhase::Stopped => {
            bench.nmt(NmtCommand::Start).await;
            bench.nmt(NmtCommand::Stop).await;
        }
        NmtPhase::PreOperational => {}
    }
}

async fn sent(bench: &mut Bench, way: TriggeredBy, tpdo: Tpdo) -> Verdict {
    match way {
        TriggeredBy::Remote => answered(bench, tpdo).await,
        TriggeredBy::Event => sent_with_change(bench, tpdo).await,
        TriggeredBy::Timer => sent_with_timer(bench, tpdo).await,
        TriggeredBy::Cyclic => sent_every_nth(bench, tpdo).await,
        TriggeredBy::Acyclic | TriggeredBy::StartValue => sent_after_sync(bench, tpdo).await,
    }
}

async fn of(bench: &mut Bench, tpdo: Tpdo, during: Duration) -> Vec<BusFrame> {
    bench.absorb();
    bench.collect(during, |frame| frame.id() == tpdo.id && !frame.is_remote()).await
}

async fn answered(bench: &mut Bench, tpdo: Tpdo) -> Verdict {
    of(bench, tpdo, ms(50)).await;
    bench.send(Frame::remote(tpdo.id, 8));
    match of(bench, tpdo, bench.timeout).await.len() {
        0 => silent("the answer to the remote frame", bench.timeout),
        1 => Ok("answered once".into()),
        many => fail!("one remote frame was answered {many} times"),
    }
}

async fn sent_with_change(bench: &mut Bench, tpdo: Tpdo) -> Verdict {
    of(bench, tpdo, ms(50)).await;
    let resting = of(bench, tpdo, SILENCE).await.len();
    let Some(row) = tpdo.mapped else {
        not_applicable!("the mapping cannot be changed to an object that a write changes")
    };
    if resting > 0 {
        // A measurement that changes by itself is sent by itself: nothing can be said.
        not_applicable!("it is sent {resting} times in {} ms without a change by SDO", SILENCE.as_millis());
    }
    bench.count(tpdo.id);
    if !bench.change(row).await? {
        not_applicable!("no object that can be mapped is changed by a write");
    }
    bench.pause(SILENCE).await;
    match bench.counted() {
        0 => silent(&format!("the PDO after {} was changed", row.mux()), SILENCE),
        1 => Ok(format!("sent once when {} was changed", row.mux())),
        many => fail!("one change of {} was sent {many} times", row.mux()),
    }
}

async fn sent_with_timer(bench: &mut Bench, tpdo: Tpdo) -> Verdict {
    let count = 5;
    let period = ms(TIMER_MS.into());
    let heard = of(bench, tpdo, period * (count + 1)).await;
    let times: Vec<_> = heard.iter().map(|passed| passed.at).collect();
    let gaps: Vec<u128> = times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect();
    if times.len() < count as usize {
        fail!(
            "with an event timer of {TIMER_MS} ms it came {} times in {} ms",
            times.len(),
            (period * (count + 1)).as_millis()
        );
    }
    // A tenth, and 10 ms for the bus and the device's own cycle.
    let slack = u128::from(TIMER_MS / 10 + 10);
    let wrong = gaps.iter().find(|gap| gap.abs_diff(TIMER_MS.into()) > slack);
    match wrong {
        Some(gap) => fail!("with an event timer of {TIMER_MS} ms it came {gap} ms after the one before"),
        None => Ok(format!("{} times, {TIMER_MS} ms apart", times.len())),
    }
}

async fn sent_every_nth(bench: &mut Bench, tpdo: Tpdo) -> Verdict {
    of(bench, tpdo, ms(50)).await;
    let before = of(bench, tpdo, SILENCE).await.len();
    if before > 0 {
        fail!("it is sent {before} times without a SYNC");
    }
    let mut heard = Vec::new();
    for _ in 0..6 * CYCLE {
        heard.push(bench.sync(None, tpdo.id).await.len());
    }
    let total: usize = heard.iter().sum();
    let even = heard.chunks(CYCLE.into()).all(|cycle| cycle.iter().sum::<usize>() == 1);
    if total == 0 {
        end_if_no_sync(bench)?;
    }
    if !even {
        fail!("of type {CYCLE} it came {total} times with {} SYNCs: {heard:?}", heard.len());
    }
    Ok(format!("{total} times with {} SYNCs", heard.len()))
}

async fn sent_after_sync(bench: &mut Bench, tpdo: Tpdo) -> Verdict {
    bench.sync(None, tpdo.id).await;
    let Some(row) = tpdo.mapped else {
        not_applicable!("the mapping cannot be changed to an object that a write changes")
    };
    let by_itself = of(bench, tpdo, SILENCE).await.len();
    if by_itself > 0 {
        fail!("it is sent {by_itself} times without a SYNC");
    }
    bench.count(tpdo.id);
    if !bench.change(row).await? {
        not_applicable!("no object that can be mapped is changed by a write");
    }
    bench.pause(SILENCE).await;
    let early = bench.counted();
    let with_sync = bench.sync(None, tpdo.id).await.len();
    let after = bench.sync(None, tpdo.id).await.len();
    if with_sync == 0 {
        end_if_no_sync(bench)?;
    }
    match (early, with_sync, after) {
        (1.., ..) => fail!("after {} was changed it is sent before the SYNC", row.mux()),
        (_, 0, _) => fail!("after {} was changed it is not sent with the next SYNC", row.mux()),
        (_, 1, 0) => Ok(format!("sent with the SYNC after {} was changed, and not with the next one", row.mux())),
        (_, _, more) => {
            fail!("after one change it came {with_sync} times with the next SYNC, and {more} times with the one after")
        }
    }
}

/// Ends a case in which a SYNC did nothing, where no SYNC is said to be taken: 1005h is there of a device with synchronous PDOs
/// (CiA 301, 7.5.2.5).
fn end_if_no_sync(bench: &Bench) -> Result<(), Finding> {
    if bench.subject.row(0x1005, 0).is_none() {
        not_applicable!("the device has no object 1005h, and takes no SYNC");
    }
    Ok(())
}

async fn unsent(bench: &mut Bench, way: TriggeredBy, phase: NmtPhase, tpdo: Tpdo) -> Verdict {
    // What was on its way when the node was stopped is not meant.
    if phase == NmtPhase::Stopped {
        bench.count(tpdo.id);
    }
    match way {
        TriggeredBy::Remote => bench.send(Frame::remote(tpdo.id, 8)),
        TriggeredBy::Event | TriggeredBy::Acyclic if phase == NmtPhase::PreOperational => {
            if let Some(row) = tpdo.mapped {
                bench.change(row).await?;
            }
        }
        TriggeredBy::Timer
        | TriggeredBy::Event
        | TriggeredBy::Cyclic
        | TriggeredBy::Acyclic
        | TriggeredBy::StartValue => {}
    }
    bench.pause(ms(u64::from(TIMER_MS) * 3)).await;
    if matches!(way, TriggeredBy::Cyclic | TriggeredBy::Acyclic) {
        for _ in 0..2 * CYCLE {
            bench.sync(None, tpdo.id).await;
        }
    }
    match bench.counted() {
        0 => Ok("not sent".into()),
        heard => fail!("it was sent {heard} times"),
    }
}

/// Sub-index 06h of the communication parameter: the SYNC counter with which counting begins.
async fn start_value(bench: &mut Bench, phase: NmtPhase) -> Verdict {
    const OVERFLOW: u8 = 10;
    const START: u8 = 3;
    let Some(index) = bench.subject.pdos(0x1800).next() else { not_applicable!("the device has no transmit PDO") };
    let (Some(_), Some(_)) = (bench.subject.row(index, 6), bench.subject.row(0x1019, 0)) else {
        not_applicable!("the device has no SYNC start value ({index:04X}h:06) with a SYNC counter (1019h)");
    };
    if let Err(code) = bench.try_write(Mux::new(0x1019, 0), &[OVERFLOW]).await? {
        not_applicable!("the device takes no SYNC counter: {code}");
    }
    let tpdo = bench.set_up_tpdo(1, 0).await?;
    bench.switch_off(index).await?;
    if let Err(code) = bench.try_write(Mux::new(index, 6), &[START]).await? {
        not_applicable!("the device takes no SYNC start value: {code}");
    }
    bench.switch_on(index, tpdo.id).await?;
    enter(bench, phase).await;
    let mut heard = Vec::new();
    for counter in 1..=6 {
        heard.push(bench.sync(Some(counter), tpdo.id).await.len());
    }
    let expected: &[usize] = if phase == NmtPhase::Operational { &[0, 0, 1, 1, 1, 1] } else { &[0; 6] };
    if heard != expected {
        fail!("with SYNC counters 1 to 6 and the start value {START} it came {heard:?} times; expected {expected:?}");
    }
    Ok(format!("with SYNC counters 1 to 6 it came {heard:?} times"))
}

async fn inhibit_time(bench: &mut Bench) -> Verdict {
    const INHIBIT_MS: u16 = 100;
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let tpdo = bench.set_up_tpdo(255, 0).await?;
    let inhibit = Mux::new(tpdo.index, 3);
    let (Some(row), Some(_)) = (tpdo.mapped, bench.subject.row(tpdo.index, 3)) else {
        not_applicable!("the device has no inhibit time, or a mapping that cannot be changed");
    };
    bench.switch_off(tpdo.index).await?;
    bench.write(inhibit, &(INHIBIT_MS * 10).to_le_bytes()).await?;
    bench.switch_on(tpdo.index, tpdo.id).await?;
    bench.nmt(NmtCommand::Start).await;
    of(bench, tpdo, ms(u64::from(INHIBIT_MS) * 2)).await;
    bench.count(tpdo.id);
    for _ in 0..4 {
        if !bench.change(row).await? {
            not_applicable!("no object that can be mapped is changed by a write");
        }
        bench.pause(ms(20)).await;
    }
    bench.pause(ms(300)).await;
    let times = bench.counted_at();
    let gaps = times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis());
    match gaps.min() {
        None => silent("a second PDO after four changes", ms(300)),
        // A millisecond: when the wire took the first one is the device's to say.
        Some(gap) if gap + 1 < INHIBIT_MS.into() => {
            fail!("with an inhibit time of {INHIBIT_MS} ms it came {gap} ms after the one before")
        }
        Some(gap) => Ok(format!("four changes, {} PDOs, never sooner than {gap} ms", times.len())),
    }
}

/// A receive PDO of one setting, and another value of that.
pub(super) async fn set_up_rpdo(bench: &mut Bench, transmission: u8) -> Result<Receiving, Finding> {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let Some(index) = bench.subject.pdos(0x1400).next() else { not_applicable!("the device has no receive PDO") };
    let Some(row) = bench.receivable() else { not_applicable!("no setting can be mapped into a receive PDO") };
    bench.hush_sync().await?;
    let id = bench.switch_off(index).await?;
    if let Err(code) = bench.try_write(Mux::new(index, 2), &[transmission]).await? {
        not_applicable!("the device does not take transmission type {transmission}: {code}");
    }
    if let Err(code) = bench.map(index, &[entry(row)]).await? {
        end_if_constant(bench, index, code)?;
        fail!("{} cannot be mapped into {index:04X}h: {code}", row.mux());
    }
    bench.switch_on(index, id).await?;
    bench.touch(row.mux()).await?;
    let before = bench.read(row.mux()).await?;
    let value = number_of(row.data_type, &before).and_then(|value| another(row, value));
    let Some(value) = value.map(|value| bytes_of(row.data_type, value)) else {
        not_applicable!("{} takes one value only", row.mux())
    };
    Ok(Receiving { id, mux: row.mux(), before, value })
}

pub(super) struct Receiving {
    pub(super) id: can::CanId,
    mux: Mux,
    before: Vec<u8>,
    value: Vec<u8>,
}

impl Receiving {
    async fn send(&self, bench: &mut Bench, data: &[u8]) {
        bench.send(Frame::new(self.id, data));
        bench.pause(ms(30)).await;
    }

    async fn expect(&self, bench: &mut Bench, value: &[u8], when: &str) -> Result<(), Finding> {
        let has = bench.read(self.mux).await?;
        if has == value {
            return Ok(());
        }
        fail!("{when} {} has {}; expected {}", self.mux, hex(&has), hex(value))
    }
}

async fn receive(bench: &mut Bench) -> Verdict {
    let rpdo = set_up_rpdo(bench, 255).await?;
    bench.nmt(NmtCommand::Start).await;
    rpdo.send(bench, &rpdo.value).await;
    rpdo.expect(bench, &rpdo.value, "after the PDO").await?;
    Ok(format!("{} has what the PDO carried", rpdo.mux))
}

async fn receive_before_start(bench: &mut Bench) -> Verdict {
    let rpdo = set_up_rpdo(bench, 255).await?;
    rpdo.send(bench, &rpdo.value).await;
    rpdo.expect(bench, &rpdo.before, "after a PDO in pre-operational").await?;
    bench.nmt(NmtCommand::Start).await;
    rpdo.expect(bench, &rpdo.before, "after the start that followed a PDO in pre-operational").await?;
    Ok(format!("{} keeps its value, also when the node is started", rpdo.mux))
}

async fn receive_short(bench: &mut Bench) -> Verdict {
    let rpdo = set_up_rpdo(bench, 255).await?;
    bench.nmt(NmtCommand::Start).await;
    let short = &rpdo.value[..rpdo.value.len() - 1];
    rpdo.send(bench, short).await;
    rpdo.expect(bench, &rpdo.before, "after a PDO that is a byte too short").await?;
    Ok(format!("{} keeps its value", rpdo.mux))
}

async fn receive_synchronous(bench: &mut Bench) -> Verdict {
    let rpdo = set_up_rpdo(bench, 1).await?;
    bench.nmt(NmtCommand::Start).await;
    rpdo.send(bench, &rpdo.value).await;
    rpdo.expect(bench, &rpdo.before, "before the SYNC").await?;
    bench.sync(None, rpdo.id).await;
    if bench.read(rpdo.mux).await? == rpdo.before {
        end_if_no_sync(bench)?;
    }
    rpdo.expect(bench, &rpdo.value, "after the SYNC").await?;
    Ok(format!("{} has what the PDO carried after the SYNC, not before", rpdo.mux))
}

async fn switched_off(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let tpdo = bench.set_up_tpdo(1, 0).await?;
    let cob_id = Mux::new(tpdo.index, 1);
    let off = (bench.number(cob_id).await? as u32 | CobId::INVALID).to_le_bytes();
    if let Err(code) = bench.try_write(cob_id, &off).await? {
        not_applicable!("the PDO cannot be switched off: {code}");
    }
    bench.nmt(NmtCommand::Start).await;
    let mut heard = 0;
    for _ in 0..3 {
        heard += bench.sync(None, tpdo.id).await.len();
    }
    if heard > 0 {
        fail!("bit 31 of {:04X}h:01 is set, and it is sent {heard} times with 3 SYNCs", tpdo.index);
    }
    Ok("not sent".into())
}

async fn reserved_type(bench: &mut Bench) -> Verdict {
    let Some(index) = bench.subject.pdos(0x1800).next() else { not_applicable!("the device has no transmit PDO") };
    bench.nmt(NmtCommand::EnterPreOperational).await;
    bench.switch_off(index).await?;
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::GENERAL, AbortCode::READ_ONLY];
    for reserved in [241, 251] {
        let answer = bench.try_write(Mux::new(index, 2), &[reserved]).await?;
        refused(&format!("transmission type {reserved}"), &answer, &codes)?;
    }
    Ok("types 241 and 251 are refused".into())
}

async fn carries_what_sdo_reads(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let tpdo = bench.set_up_tpdo(1, 0).await?;
    let Some(row) = tpdo.mapped.filter(|row| bench.subject.is_setting(row)) else {
        not_applicable!("no setting can be mapped: a measurement changes between PDO and SDO");
    };
    bench.change(row).await?;
    bench.nmt(NmtCommand::Start).await;
    let Some(passed) = bench.sync(None, tpdo.id).await.pop() else {
        end_if_no_sync(bench)?;
        return silent("the PDO after a SYNC", ms(50));
    };
    let by_sdo = bench.read(row.mux()).await?;
    if passed.frame.data() != by_sdo {
        fail!("the PDO carries {}; SDO reads {}", hex(passed.frame.data()), hex(&by_sdo));
    }
    Ok(format!("{} as SDO reads it", row.mux()))
}
