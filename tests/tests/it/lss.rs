//! Layer setting services (CiA 305) in virtual time: the master's side of `canopen::lss` against servos of one make that begin
//! without a node-ID.

use std::time::Duration;

use can::{Bitrate, Frame};
use canopen::NodeId;
use canopen::lss::{Address, Bound, Client, FastScan, Outcome, Part, Reply, Request, Search};
use canopen::object::SERIAL_NUMBER;
use devices::variant::Preset;
use sim::machine::{Order, order};
use sim::{StationId, World};

/// 1018h:01 to 03 of the standard's servo: no vendor, product 402, revision 1.0.
const MAKE: [u32; 3] = [0, 402, 0x1_0000];
/// No drive takes longer to answer.
const PATIENCE: Duration = Duration::from_millis(50);

const fn address(serial: u32) -> Address {
    Address { numbers: [MAKE[0], MAKE[1], MAKE[2], serial] }
}

struct Bench {
    world: World,
    host: StationId,
    client: Client,
}

impl Bench {
    /// Servos with these serial numbers, those of node-ID 0 without one: the world calls those by their place.
    fn of(drives: &[(u32, u8)]) -> Self {
        let mut world = World::new(Bitrate::K500, 1);
        let host = world.add_probe();
        let model = devices::all().iter().find(|model| model.name == "cia402").unwrap();
        for (place, (serial, node)) in (1..).zip(drives) {
            let place = if *node == 0 { place } else { *node };
            let id = NodeId::new(place).unwrap();
            let mut wanted = Order::new(model, id, Bitrate::K500);
            wanted.unconfigured = *node == 0;
            wanted.presets.push(Preset { object: SERIAL_NUMBER, value: i64::from(*serial) });
            world.add_drive(place, order(model, &wanted).unwrap()).unwrap();
        }
        world.run_for(Duration::from_secs(1));
        let mut bench = Self { world, host, client: Client::new(PATIENCE) };
        bench.heard();
        bench
    }

    fn heard(&mut self) -> Vec<Frame> {
        std::iter::from_fn(|| self.world.poll_received(self.host)).map(|(_, frame)| frame).collect()
    }

    fn send(&mut self, frame: Frame) {
        self.world.send(self.host, frame).unwrap();
    }

    /// Asks as a master does, and waits for the answer or until there is none.
    fn ask(&mut self, request: Request) -> Option<Reply> {
        self.client.ask(request, self.world.now());
        while let Some(frame) = self.client.poll_transmit() {
            self.send(frame);
        }
        if !self.client.is_waiting() {
            self.world.run_for(Duration::from_millis(1));
            self.heard();
        }
        while let Some(due) = self.client.poll_timeout() {
            self.world.run_for(Duration::from_micros(500));
            for frame in self.heard() {
                if let Some(reply) = self.client.handle_frame(&frame) {
                    return Some(reply);
                }
            }
            if self.world.now() >= due && self.client.handle_timeout(self.world.now()) {
                return None;
            }
        }
        None
    }

    fn fast_scan(&mut self) -> Option<Address> {
        let mut scan = FastScan::new();
        while let Some(request) = scan.next() {
            let identified = self.ask(request) == Some(Reply::Identified);
            scan.note(identified);
        }
        scan.found()
    }

    fn search(&mut self) -> Vec<Address> {
        let mut search = Search::new(MAKE[0], MAKE[1], None);
        let mut found = Vec::new();
        while let Some(request) = search.poll_request() {
            let answer = self.ask(request);
            if matches!(request, Request::Identify(Bound::HighestSerial, _)) {
                found.extend(search.note(answer == Some(Reply::Identified)));
            }
        }
        found
    }

    fn select(&mut self, serial: u32) -> Option<Reply> {
        self.ask(Request::SwitchGlobal(false));
        let parts = Part::ALL.into_iter().zip(address(serial).numbers);
        parts.map(|(part, number)| self.ask(Request::SwitchSelective(part, number))).last().flatten()
    }

    /// The bit rate of the first drive.
    fn rate(&mut self) -> Option<Bitrate> {
        let number = self.world.drive_numbers().next()?;
        self.world.with_drive(number, |drive, _| drive.bitrate()).ok()?
    }

    /// The transmit error counter of the first drive.
    fn refused_frames(&self) -> u16 {
        let number = self.world.drive_numbers().next().unwrap();
        self.world.counters(self.world.drive_id(number).unwrap()).tec()
    }

    /// The identifiers of the boot-ups in the time that follows.
    fn boot_ups(&mut self, time: Duration) -> Vec<u16> {
        self.world.run_for(time);
        let boot_ups = self.heard().into_iter().filter(|frame| frame.data() == [0]);
        boot_ups.map(|frame| frame.id().raw() as u16).filter(|id| *id > 0x700).collect()
    }
}

/// CiA 305, 6.5.3: the smallest address first; a device that has been found can be configured and takes no further part.
#[test]
fn two_of_one_make_are_found_one_after_the_other_and_become_nodes() {
    let mut bench = Bench::of(&[(0xFFFF_FFFF, 0), (7, 0), (9, 5)]);
    for (serial, node) in [(7, 21), (0xFFFF_FFFF, 22)] {
        assert_eq!(bench.ask(Request::IdentifyNonConfigured), Some(Reply::NonConfigured));
        assert_eq!(bench.fast_scan(), Some(address(serial)));
        assert_eq!(bench.ask(Request::Inquire(Part::SerialNumber)), Some(Reply::Number(Part::SerialNumber, serial)));
        assert_eq!(bench.ask(Request::ConfigureNodeId(node)), Some(Reply::NodeIdConfigured(Outcome::DONE)));
        // A device without a node-ID takes its own when it waits again, and boots (CiA 305, 5.3).
        bench.client.ask(Request::SwitchGlobal(false), bench.world.now());
        let frame = bench.client.poll_transmit().unwrap();
        bench.send(frame);
        assert_eq!(bench.boot_ups(Duration::from_secs(1)), [0x700 + u16::from(node)]);
    }
    assert_eq!((bench.fast_scan(), bench.ask(Request::IdentifyNonConfigured)), (None, None));
}

/// CiA 305, 6.5.1: asked of all devices, with a node-ID or without.
#[test]
fn every_device_of_a_make_is_identified_and_nothing_is_changed_by_it() {
    let mut bench = Bench::of(&[(0xFFFF_FFFF, 0), (0, 5), (0x8000_0000, 6)]);
    let all = [address(0), address(0x8000_0000), address(0xFFFF_FFFF)];
    assert_eq!(bench.search(), all);
    assert_eq!(bench.search(), all);
    assert_eq!(bench.select(0x8000_0000), Some(Reply::Selected));
    assert_eq!(bench.ask(Request::InquireNodeId), Some(Reply::NodeId(6)));
    assert_eq!(bench.select(1), None);
}

/// CiA 305, 6.3.3: silent for the delay, the new bit rate, silent for the delay again.
#[test]
fn a_new_bit_rate_begins_after_the_first_delay_and_speech_after_the_second() {
    const DELAY_MS: u16 = 500;
    let mut bench = Bench::of(&[(7, 5)]);
    let delay = Duration::from_millis(DELAY_MS.into());
    // 1017h: a heartbeat each 20 ms shows when it speaks.
    bench.send("605#2B17100014000000".parse().unwrap());
    assert_eq!(bench.select(7), Some(Reply::Selected));
    // Index 3 of table 0 is 250 kbit/s (CiA 305, table 1).
    let rate = Request::ConfigureBitRate { table: 0, index: 3 };
    assert_eq!(bench.ask(rate), Some(Reply::BitRateConfigured(Outcome::DONE)));
    assert_eq!(bench.rate(), Some(Bitrate::K500));
    bench.client.ask(Request::ActivateBitRate(DELAY_MS), bench.world.now());
    let frame = bench.client.poll_transmit().unwrap();
    bench.send(frame);
    bench.world.run_for(Duration::from_millis(1));
    bench.heard();
    // No node acknowledges what it sends at 250 kbit/s, which its controller counts (ISO 11898-1, 12.1.4.2).
    bench.world.run_for(delay - Duration::from_millis(10));
    assert_eq!((bench.heard(), bench.rate(), bench.refused_frames()), (Vec::new(), Some(Bitrate::K500), 0));
    bench.world.run_for(Duration::from_millis(20));
    assert_eq!((bench.heard(), bench.rate(), bench.refused_frames()), (Vec::new(), Some(Bitrate::K250), 0));
    bench.world.run_for(delay - Duration::from_millis(20));
    assert_eq!((bench.heard(), bench.refused_frames()), (Vec::new(), 0));
    bench.world.run_for(Duration::from_millis(60));
    assert!(bench.refused_frames() > 0);
}
