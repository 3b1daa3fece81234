//! GUARD 01 to 06: node guarding and life guarding (CiA 301, 7.2.8.2.2); HBG 01 to 07: with the heartbeat, one of the two.

use can::Frame;
use canopen::emcy::Emcy;
use canopen::{Mux, NmtCommand, connection_set};

use crate::bench::{Bench, SILENCE, ms, silent};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const TIME: Mux = Mux::new(0x100C, 0);
const FACTOR: Mux = Mux::new(0x100D, 0);
const HEARTBEAT: Mux = Mux::new(0x1017, 0);
const TOGGLE: u8 = 0x80;

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("GUARD 01", "100Ch and 100Dh can be read", "CiA 301, 7.5.2.11", [Need::Index(0x100C), Need::Index(0x100D)], [], readable),
    case!("GUARD 02", "A remote frame is answered with the NMT state", "CiA 301, 7.2.8.3.1", [Need::Index(0x100C)], [], answered),
    case!("GUARD 03", "The toggle bit alternates, from 0 on", "CiA 301, 7.2.8.3.1", [Need::Index(0x100C)], [], toggles),
    case!("GUARD 04", "Remote frames to other nodes are not answered", "CiA 301, 7.2.8.3.1", [Need::Index(0x100C)], [], other_nodes),
    case!("GUARD 05", "100Ch and 100Dh can be written", "CiA 301, 7.5.2.11", [Need::Index(0x100C), Need::Index(0x100D)], [], writable),
    case!("GUARD 06", "A master that stays away is reported", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Index(0x100D), Need::Index(0x1014)], [], life_guarding),
    case!("HBG 01", "Heartbeat and guarding are both there", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], both_there),
    case!("HBG 02", "1017h = 0 stops the heartbeat", "CiA 301, 7.5.2.20", [Need::Index(0x100C), Need::Writable(0x1017)], [], heartbeat_off),
    case!("HBG 03", "Guarding works with the heartbeat off", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], guarding_alone),
    case!("HBG 04", "Heartbeats come with guarding off", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], |bench| heartbeats(bench, false, false)),
    case!("HBG 05", "Remote frames do not disturb heartbeats", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], |bench| heartbeats(bench, false, true)),
    case!("HBG 06", "With both set heartbeats come", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], |bench| heartbeats(bench, true, false)),
    case!("HBG 07", "With both set remote frames are not answered with the toggle bit", "CiA 301, 7.2.8.2.2", [Need::Index(0x100C), Need::Writable(0x1017)], [], |bench| heartbeats(bench, true, true)),
];

async fn readable(bench: &mut Bench) -> Verdict {
    let (time, factor) = (bench.number(TIME).await?, bench.number(FACTOR).await?);
    Ok(format!("{time} ms, factor {factor}"))
}

/// Guarding alone: the heartbeat is off, and the communication starts over, so that the toggle bit does.
async fn start(bench: &mut Bench) -> Result<(), Finding> {
    bench.reset(NmtCommand::ResetCommunication).await?;
    if bench.subject.description.has_index(0x1017) {
        bench.write(HEARTBEAT, &[0, 0]).await?;
    }
    Ok(())
}

async fn guard(bench: &mut Bench) -> Result<u8, Finding> {
    match bench.guard().await {
        Some(frame) if frame.dlc() == 1 => Ok(frame.padded()[0]),
        Some(frame) => fail!("the answer {frame} has {} bytes, not one", frame.dlc()),
        None => silent("the answer to the remote frame", bench.timeout),
    }
}

async fn answered(bench: &mut Bench) -> Verdict {
    start(bench).await?;
    for (command, state) in
        [(NmtCommand::EnterPreOperational, 0x7F), (NmtCommand::Start, 0x05), (NmtCommand::Stop, 0x04)]
    {
        bench.nmt(command).await;
        let byte = guard(bench).await? & !TOGGLE;
        if byte != state {
            fail!("the answer says {byte:02X}h; expected {state:02X}h");
        }
    }
    Ok("7Fh, 05h and 04h in pre-operational, operational and stopped".into())
}

async fn toggles(bench: &mut Bench) -> Verdict {
    start(bench).await?;
    let mut bytes = Vec::new();
    for _ in 0..4 {
        bytes.push(guard(bench).await? & TOGGLE);
    }
    if bytes != [0, TOGGLE, 0, TOGGLE] {
        fail!("bit 7 of four answers after a reset was {bytes:02X?}; expected 0, 80h, 0, 80h");
    }
    Ok("0, 1, 0, 1".into())
}

async fn other_nodes(bench: &mut Bench) -> Verdict {
    start(bench).await?;
    let node = bench.node();
    let others = canopen::NodeId::all().filter(|other| *other != node);
    // Those whose numbers differ in one bit, and the ends.
    let near = others.filter(|other| (other.raw() ^ node.raw()).count_ones() == 1 || matches!(other.raw(), 1 | 127));
    let id = bench.heartbeat_id();
    for other in near {
        bench.absorb();
        bench.send(Frame::remote(connection_set::heartbeat(other), 1));
        if bench.wait_for(ms(30), |frame| frame.id() == id && !frame.is_remote()).await.is_some() {
            fail!("a remote frame to node {other} was answered by this node");
        }
    }
    Ok("none is answered".into())
}

async fn writable(bench: &mut Bench) -> Verdict {
    bench.write(TIME, &[100, 0]).await?;
    bench.write(FACTOR, &[3]).await?;
    let (time, factor) = (bench.number(TIME).await?, bench.number(FACTOR).await?);
    if (time, factor) != (100, 3) {
        fail!("100 ms and factor 3 were written; {time} ms and factor {factor} are read");
    }
    Ok("100 ms, factor 3".into())
}

async fn life_guarding(bench: &mut Bench) -> Verdict {
    start(bench).await?;
    bench.write(TIME, &[50, 0]).await?;
    bench.write(FACTOR, &[3]).await?;
    let id = bench.emcy_id();
    for _ in 0..4 {
        guard(bench).await?;
        if let Some(passed) = bench.wait_for(ms(50), |frame| frame.id() == id).await {
            fail!("{} came while it was guarded in time", passed.frame);
        }
    }
    let within = ms(1000);
    let Some(passed) = bench.wait_for(within, |frame| frame.id() == id).await else {
        return silent("an EMCY message after a life time of 150 ms", within);
    };
    match Emcy::parse(&passed.frame) {
        Some(emcy) if emcy.code.0 == 0x8130 => Ok("8130h".into()),
        _ => fail!("{} does not have the code 8130h, life guard error", passed.frame),
    }
}

async fn both_there(bench: &mut Bench) -> Verdict {
    let (time, period) = (bench.number(TIME).await?, bench.number(HEARTBEAT).await?);
    Ok(format!("guard time {time} ms, heartbeat {period} ms"))
}

async fn heartbeat_off(bench: &mut Bench) -> Verdict {
    bench.write(HEARTBEAT, &[50, 0]).await?;
    bench.heartbeat().await?;
    bench.write(HEARTBEAT, &[0, 0]).await?;
    // One may have waited for the bus.
    bench.pause(ms(20)).await;
    let id = bench.heartbeat_id();
    match bench.wait_for(SILENCE, |frame| frame.id() == id).await {
        Some(passed) => fail!("1017h is 0, and {} is sent", passed.frame),
        None => Ok("none is sent".into()),
    }
}

async fn guarding_alone(bench: &mut Bench) -> Verdict {
    start(bench).await?;
    bench.write(TIME, &[100, 0]).await?;
    bench.write(FACTOR, &[3]).await?;
    let (first, second) = (guard(bench).await?, guard(bench).await?);
    if (first ^ second) & TOGGLE == 0 {
        fail!("two answers are {first:02X}h and {second:02X}h: the toggle bit does not alternate");
    }
    Ok(format!("{first:02X}h, {second:02X}h"))
}

async fn heartbeats(bench: &mut Bench, guarding: bool, remote: bool) -> Verdict {
    let (time, factor): (u16, u8) = if guarding { (200, 3) } else { (0, 0) };
    bench.write(TIME, &time.to_le_bytes()).await?;
    if bench.subject.description.has_index(0x100D) {
        bench.write(FACTOR, &[factor]).await?;
    }
    bench.write(HEARTBEAT, &[100, 0]).await?;
    let id = bench.heartbeat_id();
    bench.heartbeat().await?;
    let mut heard = Vec::new();
    for _ in 0..5 {
        if remote {
            bench.send(Frame::remote(id, 1));
        }
        heard.extend(bench.collect(ms(100), |frame| frame.id() == id && !frame.is_remote()).await);
    }
    if let Some(wrong) = heard.iter().find(|passed| passed.frame.padded()[0] & TOGGLE != 0) {
        fail!("{} has bit 7 set, which a heartbeat never has", wrong.frame);
    }
    // A remote frame may be answered by one more with the state.
    let most = if remote { 11 } else { 6 };
    if !(4..=most).contains(&heard.len()) {
        fail!("with 1017h = 100 ms {} came in 500 ms", heard.len());
    }
    if heard.len() < 4 {
        not_applicable!("no heartbeat came");
    }
    Ok(format!("{} in 500 ms", heard.len()))
}
