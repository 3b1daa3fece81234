//! Process data for programs: cycles of SYNC, handles on mapped objects, and what a program that comes late is given.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use can::{Frame, Instant, Station};
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use master::core::{Event, PdoMap, RpdoTrigger};
use master::pdo::{SignalError, TimerUnits};
use master::units::Rpm;
use master::{Network, NoCycle, Node};

const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

const PERIOD: Duration = Duration::from_millis(10);

fn map(records: &[u32]) -> PdoMap {
    PdoMap(records.iter().map(|record| MappingRecord::from_raw(*record)).collect())
}

/// A node with statusword and position in TPDO1, controlword and target in RPDO1, both with SYNC.
fn node_with_pdos(network: &Network) -> Node {
    let node = network.node(node(4));
    network.with_core(|core| {
        core.image_mut().set_tpdo(node.id(), PdoNumber::FIRST, 0x184, map(&[0x6041_0010, 0x6064_0020]));
        core.image_mut().set_rpdo(
            node.id(),
            PdoNumber::FIRST,
            0x204,
            map(&[0x6040_0010, 0x607A_0020]),
            RpdoTrigger::Sync,
        );
    });
    node
}

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

/// Everything that the master has to send now.
fn sent(network: &mut Network) -> Vec<String> {
    std::iter::from_fn(|| network.poll_transmit()).map(|frame| frame.to_string()).collect()
}

#[test]
fn an_exchange_sends_whole_images_right_behind_the_sync() {
    let mut bus = Bus::new(vec![]);
    let network = bus.network.clone();
    let node = node_with_pdos(&network);
    let word = node.set_point::<u16>(mux(0x6040, 0)).unwrap();
    let target = node.set_point::<i32>(mux(0x607A, 0)).unwrap();
    network.sync(Some(PERIOD));
    let cycles = bus.block_on(async {
        let mut cycles = Vec::new();
        for target_counts in [-1, 1000, 2000] {
            let cycle = network.next_sync().await.unwrap();
            network.exchange(|io| {
                assert!(io.write(word, 0x0F) && io.write(target, target_counts));
            });
            cycles.push((cycle.number, cycle.missed));
        }
        cycles
    });
    assert_eq!(cycles, [(1, 0), (2, 0), (3, 0)]);
    assert_eq!(bus.frames(), ["080#", "204#0F00FFFFFFFF", "080#", "204#0F00E8030000", "080#", "204#0F00D0070000"]);
    // The SYNCs lie on the grid, whatever the RPDOs do: 128 bits of each at 500 kbit/s.
    let at: Vec<_> = bus.log.iter().step_by(2).map(|(at, _)| *at - bus.log[0].0).collect();
    assert_eq!(at, [Duration::ZERO, PERIOD, 2 * PERIOD]);
}

#[test]
fn a_signal_is_read_with_its_sign_and_its_age() {
    let mut network = Network::new();
    let node = node_with_pdos(&network);
    let position = node.signal::<i32>(mux(0x6064, 0)).unwrap();
    let wide = node.signal::<i64>(mux(0x6064, 0)).unwrap();
    let turns = node.signal::<f64>(mux(0x6064, 0)).unwrap();
    network.sync(Some(PERIOD));
    network.handle_timeout(Instant::ZERO);
    assert_eq!(network.exchange(|io| (io.read(position), io.cycles_since(position))), (None, None));
    network.handle_frame(&frame("184#3702FEFFFFFF"), Instant::from_micros(500));
    network.exchange(|io| {
        assert_eq!((io.read(position), io.read(wide), io.read(turns)), (Some(-2), Some(-2), Some(-2.0)));
        assert_eq!((io.cycles_since(position), io.read_fresh(position, 0)), (Some(0), Some(-2)));
    });
    // Two cycles without it: the value stays, and is old.
    for at in [10, 20] {
        network.handle_timeout(Instant::from_millis(at));
    }
    network.exchange(|io| {
        assert_eq!((io.read(position), io.cycles_since(position)), (Some(-2), Some(2)));
        assert_eq!((io.read_fresh(position, 1), io.read_fresh(position, 2)), (None, Some(-2)));
    });
    // Another mapping ends the handle: it finds nothing, and no other object's bits.
    network.with_core(|core| {
        core.image_mut().set_tpdo(node.id(), PdoNumber::FIRST, 0x184, map(&[0x6064_0020, 0x6041_0010]))
    });
    network.handle_frame(&frame("184#010000003702"), Instant::from_millis(21));
    assert_eq!(network.exchange(|io| io.read(position)), None);
    let position = node.signal::<i32>(mux(0x6064, 0)).unwrap();
    assert_eq!(network.exchange(|io| io.read(position)), Some(1));
}

#[test]
fn what_a_field_cannot_hold_is_refused_and_the_image_stays() {
    let mut network = Network::new();
    let node = node_with_pdos(&network);
    let target = node.set_point::<i64>(mux(0x607A, 0)).unwrap();
    assert!(network.exchange(|io| io.write(target, 5)));
    assert!(!network.exchange(|io| io.write(target, 1 << 31)));
    network.handle_timeout(Instant::ZERO);
    assert_eq!(sent(&mut network), ["204#000005000000"]);
}

#[test]
fn an_object_that_is_not_mapped_or_does_not_suit_is_reported_with_what_is_there() {
    let network = Network::new();
    let node = node_with_pdos(&network);
    let error = node.signal::<i32>(mux(0x606C, 0)).unwrap_err();
    assert!(matches!(error, SignalError::NotMapped { direction: Direction::Tpdo, .. }));
    assert_eq!(
        error.to_string(),
        "606Ch:00 of node 4 is in no TPDO that this master knows: TPDO1 has 6041h:00 6064h:00. Map it with configure_pdo"
    );
    let error = node.signal::<i16>(mux(0x6064, 0)).unwrap_err();
    assert!(matches!(error, SignalError::DoesNotSuit { bits: 32, .. }), "{error}");
    let error = network.node(crate::support::node(5)).set_point::<Rpm>(mux(0x60FF, 0)).unwrap_err();
    assert!(error.to_string().contains("none was read from it or set up"), "{error}");
}

#[test]
fn a_program_that_comes_late_finds_the_cycles_that_it_missed() {
    let mut bus = Bus::new(vec![]);
    let network = bus.network.clone();
    network.sync(Some(PERIOD));
    let (first, second) = bus.block_on(async {
        let first = network.next_sync().await.unwrap();
        network.sleep(Duration::from_millis(35)).await;
        (first, network.next_sync().await.unwrap())
    });
    // Number 2, 3 and 4 went by at 10, 20 and 30 ms; number 5 came at 40.
    assert_eq!((first.number, second.number, second.missed_since(&first)), (1, 5, 3));
    assert_eq!(second.missed, 0);
}

#[test]
fn a_runner_that_comes_late_has_its_missed_cycles_reported() {
    let mut network = Network::new();
    network.sync(Some(PERIOD));
    for at in [0, 10, 45, 50] {
        network.handle_timeout(Instant::from_millis(at));
        assert_eq!(sent(&mut network), ["080#"]);
    }
    let events: Vec<_> = std::iter::from_fn(|| network.poll_event()).collect();
    assert_eq!(events, [(Instant::from_millis(45), Event::CyclesMissed(2))]);
    assert_eq!((network.cycle().unwrap().number, network.with_core(|core| core.missed_cycles())), (6, 2));
}

#[test]
fn the_sync_of_another_node_is_followed_and_its_loss_reported() {
    let mut bus = Bus::new(vec![]);
    let network = bus.network.clone();
    let begin = bus.now;
    bus.noise = [3, 13, 23].map(|ms| (begin + Duration::from_millis(ms), frame("080#"))).to_vec();
    network.follow_sync(Some(PERIOD));
    let (numbers, lost) = bus.block_on(async {
        let mut numbers = Vec::new();
        loop {
            match network.next_sync().await {
                Ok(cycle) => numbers.push(cycle.number),
                Err(lost) => return (numbers, lost),
            }
        }
    });
    assert_eq!((numbers, lost), (vec![1, 2, 3], NoCycle::Lost { period: PERIOD }));
    // The last came at 23 ms and a frame's length; three periods later it is lost.
    assert_eq!(bus.now, bus.log[2].0 + 3 * PERIOD);
    assert_eq!(lost.to_string(), "no SYNC has come for 30 ms: check its producer and the cable");
    assert!(matches!(network.poll_event(), Some((_, Event::SyncLost(_)))));
}

#[test]
fn without_a_producer_no_cycle_is_waited_for() {
    let mut bus = Bus::new(vec![]);
    let network = bus.network.clone();
    assert_eq!(bus.block_on(network.next_sync()), Err(NoCycle::NoSync));
    // One that stops ends the wait.
    network.sync(Some(PERIOD));
    let stopping = async {
        let waiting = network.next_sync();
        network.next_sync().await.unwrap();
        network.sync(None);
        waiting.await
    };
    assert_eq!(bus.block_on(stopping), Err(NoCycle::NoSync));
}

#[test]
fn mappings_are_read_from_the_device() {
    let mut toy = Toy::new(4).u32(0x1800, 1, 0x4000_0184).u8(0x1800, 2, 1).u8(0x1A00, 0, 2);
    toy = toy.u32(0x1A00, 1, 0x6041_0010).u32(0x1A00, 2, 0x606C_0010);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    bus.block_on(node.adopt_pdo(TPDO1, TimerUnits::STANDARD)).unwrap();
    let speed = node.signal::<i32>(mux(0x606C, 0)).unwrap();
    bus.toys[0].send(0x180, &[0x37, 0x02, 0x9C, 0xFF]);
    bus.settle();
    assert_eq!(network.exchange(|io| io.read(speed)), Some(-100));
}
