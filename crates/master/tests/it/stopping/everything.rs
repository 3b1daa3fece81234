//! Everything on the bus stops, whatever moves it: kept going by another master's process data, stopped by NMT, without power, or
//! not there any more.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::future::poll_fn;
use std::pin::pin;
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use canopen::NmtCommand;
use cia402::{Controlword, PowerCommand};
use devices::model;
use master::Network;
use master::base::Twist;
use master::drive::{HostLoss, MotionOptions, StopWay, StoppedAxis, SwitchedOff};
use master::units::Rpm;
use sim::wire::WireEvent;
use sim::{Place, Stimulus, block_on};

use super::{Bench, Motion, Moving, NODES, PERIOD, models, options};
use crate::support::{mux, node};

impl Bench {
    /// Both drives turn, by this program.
    fn turn(&mut self) {
        for drive in self.drives.clone() {
            self.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        }
        self.moving = NODES.to_vec();
    }

    /// Another program stops everything while this one goes on with its cycles. The time after which the last drive was seen to
    /// stand.
    pub(super) fn stop_everything(&mut self, mut moving: Moving, what: &str) -> (Option<Duration>, Option<Moving>) {
        let other = Network::new();
        self.world.add_station(other.clone());
        let network = self.network.clone();
        let go_on = async {
            loop {
                match &mut moving {
                    Moving::Alone => {}
                    Moving::Group(group) => drop(group.cycle().await),
                    Moving::Base(base) => {
                        let _ = base.command(Twist { linear_m_s: 0.6, angular_rad_s: 0.0 });
                        let _ = base.cycle().await;
                    }
                }
                // What has ended does not wait for its next cycle.
                network.sleep(PERIOD / 10).await;
            }
        };
        let models = BTreeMap::new();
        let stopped = block_on(&mut self.world, while_going_on(other.stop_everything(&models), go_on)).unwrap();
        assert_eq!(stopped.len(), NODES.len(), "{what}: {stopped:?}");
        assert!(self.fastest() < 2.0, "{what}: said to stand at {} r/min", self.fastest());
        let times = stopped.iter().map(|axis| axis.outcome.as_ref().unwrap_or_else(|e| panic!("{what}: {e}")).0);
        (times.max(), Some(moving))
    }

    /// Another program on the same bus.
    fn other(&mut self) -> Network {
        let other = Network::new();
        self.world.add_station(other.clone());
        other
    }

    fn stop_everything_by(&mut self, other: &Network) -> Vec<StoppedAxis> {
        self.run(other.stop_everything(&BTreeMap::new()))
    }
}

/// The result of `work`, while `other` goes on without end.
async fn while_going_on<T>(work: impl Future<Output = T>, other: impl Future<Output = Infallible>) -> T {
    let (mut work, mut other) = (pin!(work), pin!(other));
    poll_fn(|context| {
        let done = work.as_mut().poll(context);
        if done.is_pending() {
            let _ = other.as_mut().poll(context);
        }
        done
    })
    .await
}

#[test]
fn process_data_of_another_master_do_not_set_a_drive_going_again() {
    for name in ["zlac8030l", "cia402"] {
        let mut bench = Bench::new(name);
        let (id, feeder) = (node(NODES[0]), bench.other());
        // RPDO1 carries the controlword alone, as soon as it comes (CiA 301, 7.5.2.35 and 7.5.2.36).
        let at = 0x200 + u32::from(NODES[0]);
        let rows: [(_, &[u8]); 7] = [
            // After a quick stop it holds, and may be enabled again (CiA 402-2, 8.4.5).
            (mux(0x605A, 0), &6_i16.to_le_bytes()),
            (mux(0x1400, 1), &(0x8000_0000 | at).to_le_bytes()),
            (mux(0x1600, 0), &[0]),
            (mux(0x1600, 1), &0x6040_0010_u32.to_le_bytes()),
            (mux(0x1600, 0), &[1]),
            (mux(0x1400, 2), &[255]),
            (mux(0x1400, 1), &at.to_le_bytes()),
        ];
        for (object, bytes) in rows {
            bench.run(feeder.node(id).download(object, bytes)).unwrap();
        }
        feeder.node(id).nmt(NmtCommand::Start);
        bench.turn();
        let controlword = PowerCommand::EnableOperation.controlword().0;
        let enable = Frame::new(CanId::standard(at as u16), &controlword.to_le_bytes());
        let keep_going = |feeder: Network| async move {
            loop {
                feeder.transmit(enable);
                feeder.sleep(Duration::from_millis(5)).await;
            }
        };
        // A quick stop alone does not last.
        let other = bench.other();
        let once = async {
            other.node(id).write(mux(0x6040, 0), PowerCommand::QuickStop.controlword().0).await.unwrap();
            other.sleep(Duration::from_secs(2)).await;
        };
        block_on(&mut bench.world, while_going_on(once, keep_going(feeder.clone()))).unwrap();
        assert!(bench.speed(NODES[0]).abs() > 50.0, "{name}: {} r/min", bench.speed(NODES[0]));
        let stop = async {
            let stopped = other.stop_everything(&BTreeMap::new()).await;
            other.sleep(Duration::from_secs(2)).await;
            stopped
        };
        let stopped = block_on(&mut bench.world, while_going_on(stop, keep_going(feeder))).unwrap();
        assert!(stopped.len() == 2 && stopped.iter().all(|axis| axis.outcome.is_ok()), "{name}: {stopped:?}");
        assert!(bench.fastest() < 1.0, "{name}: {} r/min", bench.fastest());
    }
}

/// All at once: no drive waits for the answer of another.
#[test]
fn no_drive_waits_for_the_answer_of_another_to_be_stopped() {
    for name in models() {
        let mut bench = Bench::new(name);
        bench.turn();
        let other = bench.other();
        for number in NODES {
            let late = "bus late 5 6".parse::<Stimulus>().unwrap();
            bench.world.apply(Place::node(number), &late).unwrap().unwrap();
        }
        let known = NODES.map(|number| (node(number), model(name).unwrap())).into_iter().collect();
        let began = bench.world.now();
        let stopped = bench.run(other.stop_everything(&known));
        assert_eq!(stopped.len(), NODES.len(), "{name}: {stopped:?}");
        let frames = bench.world.log().iter().filter_map(|event| match event {
            WireEvent::Frame { start, frame, .. } if *start >= began => Some(*frame),
            _ => None,
        });
        let frames: Vec<_> = frames.collect();
        let is_from = |frame: &Frame, service: u16| {
            NODES.iter().any(|number| frame.id() == CanId::standard(service + u16::from(*number)))
        };
        let answer = frames.iter().position(|frame| is_from(frame, 0x580)).expect("they answer");
        // Requests of SDO to each (CiA 301, 7.2.4.3), and before them one NMT command to all.
        let mut asked: Vec<_> = frames[..answer].iter().filter(|frame| is_from(frame, 0x600)).map(Frame::id).collect();
        asked.dedup();
        assert_eq!(asked.len(), NODES.len(), "{name}: {frames:?}");
        assert_eq!((frames[0].id(), frames[0].data()), (CanId::standard(0), &[0x80, 0][..]), "{name}");
    }
}

#[test]
fn a_drive_in_nmt_stopped_is_reached_and_seen_to_stand() {
    for name in models() {
        let mut bench = Bench::new(name);
        let other = bench.other();
        bench.turn();
        other.nmt_all(NmtCommand::Stop);
        bench.world.run_for(Duration::from_millis(20));
        let stopped = bench.stop_everything_by(&other);
        assert!(stopped.len() == 2 && stopped.iter().all(|axis| axis.outcome.is_ok()), "{name}: {stopped:?}");
        assert!(bench.fastest() < 1.0, "{name}");
    }
}

#[test]
fn a_drive_without_power_is_left_without_it() {
    for name in models() {
        let mut bench = Bench::new(name);
        let other = bench.other();
        let stopped = bench.stop_everything_by(&other);
        let ways: Vec<_> = stopped.iter().map(|axis| axis.outcome.as_ref().unwrap().1).collect();
        assert_eq!(ways, [StopWay::NoPower; 2], "{name}");
        assert_eq!(stopped[0].node, node(NODES[0]), "{name}");
        let controlword = bench.run(other.node(node(NODES[0])).read::<u16>(mux(0x6040, 0))).unwrap();
        assert_ne!(Controlword(controlword).command(), PowerCommand::EnableOperation, "{name}");
    }
}

#[test]
fn a_drive_whose_answers_come_late_is_seen_to_stand_all_the_same() {
    for name in models() {
        let mut bench = Bench::new(name);
        bench.turn();
        let other = bench.other();
        for number in NODES {
            // Just in time for each question: the looks that show its rest take longer than its ramp.
            let late = "bus late 130 140".parse::<Stimulus>().unwrap();
            bench.world.apply(Place::node(number), &late).unwrap().unwrap();
        }
        let stopped = bench.stop_everything_by(&other);
        for axis in &stopped {
            assert!(axis.outcome.is_ok(), "{name}: {stopped:?}");
        }
        assert_eq!(stopped.len(), NODES.len(), "{name}");
    }
}

/// In pre-operational they send no TPDO, and answer SDO: they are seen to stand there, and no watch over a host is left armed.
#[test]
fn a_group_that_another_program_has_stopped_closes_and_gives_the_watches_back() {
    for name in models() {
        let mut bench = Bench::new(name);
        let Some(moving) = bench.set_in_motion(Motion::GroupMove) else { continue };
        let (_, moving) = bench.stop_everything(moving, name);
        let Some(Moving::Group(group)) = moving else { panic!("{name}: it is a group") };
        bench.run(group.close()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(NODES.iter().all(|number| bench.network.guarded(node(*number)).is_none()), "{name}");
        assert!(bench.network.moved().is_empty(), "{name}");
        // Longer than any of them waits for its host.
        bench.world.run_for(Duration::from_secs(4));
        for number in NODES {
            assert_eq!(bench.world.report(number).unwrap().error_code, 0, "{name}");
        }
    }
}

const BEATING: u8 = 9;

/// Sends the heartbeat of a device in pre-operational each 100 ms, and answers nothing.
#[derive(Clone)]
struct Beating {
    due: Instant,
    sent: bool,
}

impl Station for Beating {
    fn handle_frame(&mut self, _: &Frame, _: Instant) {}

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.due {
            (self.due, self.sent) = (now + Duration::from_millis(100), false);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let beat = Frame::new(CanId::standard(0x700 + u16::from(BEATING)), &[0x7F]);
        (!std::mem::replace(&mut self.sent, true)).then_some(beat)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.due)
    }
}

/// It beats as node 127 and answers nothing. A device that drives watch and that answers nothing is not taken for one: it obeys NMT.
#[test]
fn the_program_that_a_drive_watches_is_no_drive_that_does_not_answer() {
    for name in models() {
        let mut bench = Bench::new(name);
        let other = bench.other();
        let [first, _] = bench.drives.clone();
        let loss = bench.run(first.guard(SwitchedOff::Leave)).unwrap();
        bench.turn();
        bench.world.run_for(Duration::from_secs(2));
        let host = node(127);
        let beats = matches!(loss, HostLoss::StopsWithoutHeartbeat { .. });
        assert_eq!(other.seen().contains(host), beats, "{name}");
        let stopped = bench.stop_everything_by(&other);
        assert_eq!(stopped.iter().map(|axis| axis.node).collect::<Vec<_>>(), NODES.map(node), "{name}: {stopped:?}");
        assert!(stopped.iter().all(|axis| axis.outcome.is_ok()), "{name}: {stopped:?}");
        if !beats {
            continue;
        }
        bench.run(first.release_guard()).unwrap();
        bench.world.add_station(Beating { due: bench.world.now(), sent: true });
        // For a second.
        bench.run(first.node().write(mux(0x1016, 1), u32::from(BEATING) << 16 | 1000)).unwrap();
        let other = bench.other();
        bench.world.run_for(Duration::from_secs(1));
        let stopped = bench.stop_everything_by(&other);
        let silent = stopped.iter().find(|axis| axis.node == node(BEATING)).expect("it was heard");
        assert!(silent.outcome.is_err() && stopped.len() == NODES.len() + 1, "{name}: {stopped:?}");
    }
}

#[test]
fn what_was_heard_or_is_known_and_does_not_answer_may_still_be_moving() {
    for name in models() {
        let mut bench = Bench::new(name);
        bench.turn();
        bench.world.apply(Place::node(NODES[1]), &Stimulus::CableCut(true)).unwrap().unwrap();
        let other = bench.other();
        // Nothing shows the second one to a program that has never heard of it.
        let stopped = bench.stop_everything_by(&other);
        assert_eq!(stopped.iter().map(|axis| axis.node).collect::<Vec<_>>(), [node(NODES[0])], "{name}: {stopped:?}");
        let known = NODES.map(|number| (node(number), model(name).unwrap())).into_iter().collect();
        let began = bench.world.now();
        let stopped = bench.run(other.stop_everything(&known));
        let [stands, silent] = &stopped[..] else { panic!("{name}: {stopped:?}") };
        assert!(stands.outcome.is_ok(), "{name}: {stopped:?}");
        let why = silent.outcome.as_ref().unwrap_err().to_string();
        assert!(why.contains("The drive does not answer"), "{name}: {why}");
        assert!(bench.world.now() - began < Duration::from_secs(1), "{name}");
        assert!(bench.speed(NODES[1]).abs() > 50.0, "{name}: it was said rightly");
    }
}
