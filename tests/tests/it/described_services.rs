//! Services of CiA 301 that a device has by the objects of its file: TIME and EMCY of others, multiplexed PDOs, the date of its
//! configuration, and that nothing is taken that has no effect.

use std::time::Duration;

use can::{Bitrate, Instant, Station};
use canopen::od::{Access, Conditions, Kind, condition_numbers};
use canopen::time_stamp::TimeOfDay;
use canopen::{Mux, NodeId, NodeProfile};
use drives::communication::communication;
use drives::node::{DescribedNode, Memory, acts_on, conditions};
use eds::{Eds, keep};
use ferrodrive_tests::sheet::{SheetRow, U8, U16, U32, U64, sheet};
use sim::machine::{Boxed, Order, order};
use sim::{Place, World};

struct Bench {
    node: DescribedNode<Boxed>,
    memory: Memory<Boxed>,
    now: Instant,
}

impl Bench {
    /// Node 9, switched on, its boot-up message taken away.
    fn new(rows: &[SheetRow]) -> Self {
        let model = keep(&Eds::load(&sheet(rows)).expect("it is read").eds).expect("it is kept");
        let list: &'static _ = conditions(model.dictionary).collect::<Vec<_>>().leak();
        let numbers: &'static [u16; 256] = Box::leak(Box::new(condition_numbers(list)));
        let conditions: &'static Conditions = Box::leak(Box::new(Conditions::new(list, numbers)));
        let profile = NodeProfile { conditions, acts_on, ..communication(model) };
        let node = NodeId::new(9).expect("a node-ID");
        let node = DescribedNode::new(model, Box::leak(Box::new(profile)), node, Bitrate::M1);
        let mut bench = Self { node, memory: Memory::empty(model.dictionary), now: Instant::ZERO };
        bench.power_on();
        bench
    }

    fn power_on(&mut self) {
        self.node.power_on(self.memory.clone(), self.now);
        assert_eq!(self.drain(), ["709#00"]);
    }

    fn power_cycle(&mut self) {
        self.memory = self.node.memory().0.clone();
        self.node.power_off();
        self.power_on();
    }

    fn drain(&mut self) -> Vec<String> {
        let mut sent = Vec::new();
        while let Some(frame) = self.node.poll_transmit() {
            self.node.handle_transmitted(&frame, self.now);
            sent.push(frame.to_string());
        }
        sent
    }

    fn send(&mut self, frame: &str) -> Vec<String> {
        self.node.handle_frame(&frame.parse().unwrap(), self.now);
        self.drain()
    }

    fn run(&mut self, ms: u64) -> Vec<String> {
        let end = Instant::from_nanos(self.now.as_nanos() + ms * 1_000_000);
        let mut sent = Vec::new();
        while let Some(due) = self.node.poll_timeout().filter(|due| *due <= end) {
            self.now = due.max(self.now);
            self.node.handle_timeout(self.now);
            sent.extend(self.drain());
        }
        self.now = end;
        sent
    }

    /// The code of an abort; `None` where it is taken.
    fn write(&mut self, index: u16, sub_index: u8, bytes: u8, value: u32) -> Option<u32> {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let command = 0x23 | (4 - bytes) << 2;
        let request = format!("609#{command:02X}{low:02X}{high:02X}{sub_index:02X}{a:02X}{b:02X}{c:02X}{d:02X}");
        let answer = self.send(&request).into_iter().find(|frame| frame.starts_with("589#")).expect("it answers");
        let code = u32::from_str_radix(&answer[12..20], 16).unwrap().swap_bytes();
        answer.starts_with("589#80").then_some(code)
    }

    fn value(&self, index: u16, sub_index: u8) -> i64 {
        self.node.values().view().value(Mux::new(index, sub_index)).expect("it is there")
    }

    fn set(&mut self, index: u16, sub_index: u8, bytes: &[u8]) {
        let slot = self.node.find(Mux::new(index, sub_index)).expect("it is there");
        self.node.set(slot, bytes, self.now).expect("it fits");
    }
}

/// 23:59:59.900 of 2 January 1984: 86399900 ms and 1 day (CiA 301, 7.1.6.5).
const EVENING: &str = "9C5B26050100";

#[test]
fn time_is_consumed_with_bit_31_of_1012h_and_goes_on() {
    let mut bench = Bench::new(&[(0x1000, 0, U32, "ro", 0, false), (0x1012, 0, U32, "rw", 0x100, false)]);
    let clock = |bench: &Bench| bench.node.overheard().time_of_day(bench.now);
    bench.send(&format!("100#{EVENING}"));
    assert_eq!(clock(&bench), None, "bit 31 is not set");
    assert_eq!(bench.write(0x1012, 0, 4, 0xC000_0100), Some(0x0609_0030), "it has no clock to produce TIME from");
    assert_eq!(bench.write(0x1012, 0, 4, 0x8000_0100), None);
    assert_eq!(bench.write(0x1012, 0, 4, 0x8000_0101), Some(0x0609_0030), "a restricted identifier");
    assert_eq!(bench.write(0x1012, 0, 4, 0x8000_0200), Some(0x0609_0030), "the identifier stays while it is consumed");
    bench.send("100#0102");
    assert_eq!(clock(&bench), None, "too short");
    bench.send(&format!("100#{EVENING}"));
    assert_eq!(clock(&bench), Some(TimeOfDay { millis: 86_399_900, days: 1 }));
    bench.run(350);
    assert_eq!(clock(&bench), Some(TimeOfDay { millis: 250, days: 2 }), "the next day");
    bench.send("000#0209");
    bench.send(&format!("100#{EVENING}"));
    assert_eq!(clock(&bench), Some(TimeOfDay { millis: 250, days: 2 }), "not while stopped");
}

#[test]
fn a_time_producer_by_its_file_takes_1012h_back_and_produces_nothing() {
    let mut bench = Bench::new(&[(0x1000, 0, U32, "ro", 0, false), (0x1012, 0, U32, "rw", 0x4000_0100, false)]);
    assert_eq!(bench.write(0x1012, 0, 4, 0x4000_0100), None);
    assert_eq!(bench.write(0x1012, 0, 4, 0xC000_0100), Some(0x0609_0030));
    assert_eq!(bench.run(2000), Vec::<String>::new());
    assert_eq!((bench.write(0x1012, 0, 4, 0x100), bench.write(0x1012, 0, 4, 0x4000_0100)), (None, Some(0x0609_0030)));
}

#[test]
fn the_emcy_messages_of_1028h_are_heard() {
    let consumers = [0x8000_0000, 0x82, 0x8000_0083].into_iter().zip(1..);
    let mut rows = vec![(0x1000, 0, U32, "ro", 0, false), (0x1028, 0, U8, "ro", 3, false)];
    rows.extend(consumers.map(|(cob_id, node)| (0x1028, node, U32, "rw", cob_id, false)));
    let mut bench = Bench::new(&rows);
    let heard = |bench: &Bench| bench.node.overheard().last_emcy().map(|(node, emcy)| (node.raw(), emcy.code.0));
    bench.send("083#1081010000000000");
    bench.send("081#1081010000000000");
    assert_eq!(heard(&bench), None, "bit 31 of their entries is set");
    bench.send("082#3081110000000000");
    assert_eq!(heard(&bench), Some((2, 0x8130)));
    assert_eq!(bench.write(0x1028, 2, 4, 0x92), Some(0x0609_0030), "a valid entry keeps its identifier");
    assert_eq!(bench.write(0x1028, 1, 4, 0x601), Some(0x0609_0030), "restricted");
    assert_eq!((bench.write(0x1028, 2, 4, 0x8000_0092), bench.write(0x1028, 2, 4, 0x92)), (None, None));
    bench.send("082#0010010000000000");
    assert_eq!(heard(&bench), Some((2, 0x8130)));
    bench.send("092#0010010000000000");
    assert_eq!(heard(&bench), Some((2, 0x1000)));
}

#[test]
fn the_manufacturers_status_is_what_the_application_sets_and_no_client_writes_it() {
    let mut bench = Bench::new(&[(0x1000, 0, U32, "ro", 0, false), (0x1002, 0, U32, "ro", 0, true)]);
    bench.set(0x1002, 0, &0x1234_5678_u32.to_le_bytes());
    assert_eq!(bench.send("609#4002100000000000"), ["589#4302100078563412"]);
    assert_eq!(bench.write(0x1002, 0, 4, 0), Some(0x0601_0002));
}

/// CiA 301, 7.5.2.19: 1016h has up to 127 entries; which of them a host uses is up to it.
#[test]
fn eight_nodes_are_watched_by_whichever_of_127_entries() {
    let mut rows =
        vec![(0x1000, 0, U32, "ro", 0, false), (0x1014, 0, U32, "rw", 0x89, false), (0x1016, 0, U8, "ro", 127, false)];
    // Node 100 as delivered.
    rows.extend((1..=127).map(|sub| (0x1016, sub, U32, "rw", if sub == 100 { 100 << 16 | 100 } else { 0 }, false)));
    let mut bench = Bench::new(&rows);
    let watch = |bench: &mut Bench, sub, node: u32, ms| bench.write(0x1016, sub, 4, node << 16 | ms);
    for (sub, node) in [(127, 1), (126, 2), (9, 3), (10, 4), (11, 5), (12, 6), (1, 7)] {
        assert_eq!(watch(&mut bench, sub, node, 1000), None, "entry {sub}");
    }
    assert_eq!(watch(&mut bench, 50, 8, 1000), Some(0x0604_0043), "a ninth");
    assert_eq!(watch(&mut bench, 50, 1, 1000), Some(0x0604_0043), "node 1 twice");
    assert_eq!(watch(&mut bench, 127, 1, 200), None, "another time");
    assert_eq!(watch(&mut bench, 9, 0, 0), None);
    assert_eq!(watch(&mut bench, 50, 8, 100), None, "there is room again");
    let missed = |bench: &mut Bench, node: u32, ms| {
        bench.send(&format!("{:03X}#05", 0x700 + node));
        bench.run(ms).iter().any(|frame| frame.starts_with("089#3081"))
    };
    assert!(!missed(&mut bench, 3, 2000), "its entry is 0");
    assert!(missed(&mut bench, 100, 150), "as delivered");
    assert_eq!(watch(&mut bench, 100, 0, 0), None);
    assert!(!missed(&mut bench, 1, 150) && missed(&mut bench, 1, 250), "200 ms now");
    assert_eq!(watch(&mut bench, 127, 0, 0), None);
    assert!(missed(&mut bench, 8, 150), "in another entry's room");
}

/// CiA 301, 7.5.2.23: 1020h is 0 once something else than the tool that wrote it has changed what the device starts with.
/// CiA 301, 7.5.2.32: by default a device in operational enters pre-operational; 1029h is there to have it otherwise.
#[test]
fn a_lost_heartbeat_ends_operational_where_no_1029h_says_otherwise() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1001, 0, U8, "ro", 0, false),
        (0x1016, 0, U8, "ro", 1, false),
        (0x1016, 1, U32, "rw", 0x0032_0032, false),
        (0x1017, 0, U16, "rw", 10, false),
    ]);
    bench.send("000#0109");
    bench.send("732#05");
    assert!(bench.run(45).iter().all(|frame| frame == "709#05"));
    assert_eq!(bench.run(30).last().map(String::as_str), Some("709#7F"));
    // Heartbeats that come again leave it to the master to start it.
    bench.send("732#05");
    assert_eq!(bench.run(30).last().map(String::as_str), Some("709#7F"));
}

#[test]
fn the_date_of_the_configuration_is_kept_until_another_configuration_is_stored() {
    const SAVE: u32 = u32::from_le_bytes(*b"save");
    const LOAD: u32 = u32::from_le_bytes(*b"load");
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1010, 0, U8, "ro", 1, false),
        (0x1010, 1, U32, "rw", 1, false),
        (0x1011, 0, U8, "ro", 3, false),
        (0x1011, 1, U32, "rw", 1, false),
        (0x1011, 2, U32, "rw", 1, false),
        (0x1011, 3, U32, "rw", 1, false),
        (0x1017, 0, U16, "rw", 0, false),
        (0x1020, 0, U8, "ro", 2, false),
        (0x1020, 1, U32, "rw", 0, false),
        (0x1020, 2, U32, "rw", 0, false),
    ]);
    let configure = |bench: &mut Bench, heartbeat, date| {
        assert_eq!(bench.write(0x1017, 0, 2, heartbeat), None);
        if let Some(date) = date {
            assert_eq!((bench.write(0x1020, 1, 4, date), bench.write(0x1020, 2, 4, date + 1)), (None, None));
        }
    };
    let date = |bench: &Bench| (bench.value(0x1020, 1), bench.value(0x1020, 2), bench.value(0x1017, 0));
    configure(&mut bench, 60_000, Some(0x3A2F));
    assert_eq!(bench.write(0x1010, 1, 4, SAVE), None);
    bench.power_cycle();
    assert_eq!(date(&bench), (0x3A2F, 0x3A30, 60_000));
    // What is written and not stored is gone with the supply: the device starts as it did.
    configure(&mut bench, 50_000, None);
    bench.power_cycle();
    assert_eq!(date(&bench), (0x3A2F, 0x3A30, 60_000));
    configure(&mut bench, 50_000, None);
    assert_eq!(bench.write(0x1010, 1, 4, SAVE), None);
    assert_eq!(date(&bench), (0, 0, 50_000));
    bench.power_cycle();
    assert_eq!(date(&bench), (0, 0, 50_000));
    // Restored parameters, of whatever group.
    configure(&mut bench, 50_000, Some(0x3A2F));
    assert_eq!(bench.write(0x1010, 1, 4, SAVE), None);
    assert_eq!(bench.write(0x1011, 3, 4, LOAD), None);
    bench.power_cycle();
    assert_eq!(date(&bench), (0, 0, 50_000));
}

#[test]
fn changed_objects_of_the_scanning_list_are_sent_in_source_address_mode_in_turn() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1800, 0, U8, "ro", 3, false),
        (0x1800, 1, U32, "rw", 0x189, false),
        (0x1800, 2, U8, "rw", 254, false),
        (0x1A00, 0, U8, "rw", 0xFE, false),
        (0x1A00, 1, U32, "rw", 0, false),
        (0x1FA0, 0, U8, "ro", 2, false),
        // Two sub-indices of 6000h from 1 on, and 2000h.
        (0x1FA0, 1, U32, "rw", 0x0260_0001, false),
        (0x1FA0, 2, U32, "rw", 0x0120_0000, false),
        (0x2000, 0, U16, "ro", 0, true),
        (0x6000, 0, U8, "ro", 2, false),
        (0x6000, 1, U8, "ro", 7, true),
        (0x6000, 2, U8, "ro", 0, true),
    ]);
    bench.set(0x2000, 0, &[1, 0]);
    assert_eq!(bench.run(10), [""; 0], "not before operational");
    bench.send("000#0109");
    assert_eq!(bench.run(10), [""; 0], "what it begins with does not count");
    bench.set(0x6000, 2, &[0xA5]);
    bench.set(0x2000, 0, &[0x34, 0x12]);
    bench.set(0x6000, 1, &[8]);
    assert_eq!(bench.run(10), ["189#0900600108000000", "189#09006002A5000000", "189#0900200034120000"]);
    assert_eq!(bench.run(10), [""; 0]);
    // One that changes always does not keep the others waiting.
    let mut sent = Vec::new();
    for n in 0..4_u8 {
        bench.set(0x6000, 1, &[20 + n]);
        bench.set(0x6000, 2, &[30 + n]);
        sent.extend(bench.run(1));
    }
    let subs: Vec<&str> = sent.iter().map(|frame| &frame[10..12]).collect();
    assert_eq!(subs, ["01", "02", "01", "02"]);
}

/// The rows of a TPDO1 and an RPDO1 that are multiplexed in destination address mode, an object, and no 1005h.
fn to_destinations(rpdo: u64) -> [SheetRow; 9] {
    [
        (0x1000, 0, U32, "ro", 0, false),
        (0x1400, 1, U32, "rw", rpdo, false),
        (0x1400, 2, U8, "rw", 255, false),
        (0x1600, 0, U8, "rw", 0xFF, false),
        (0x1800, 1, U32, "rw", 0x4000_0189, false),
        (0x1800, 2, U8, "rw", 254, false),
        (0x1800, 3, U16, "rw", 20, false),
        (0x1A00, 0, U8, "rw", 0xFF, false),
        (0x6200, 1, U16, "rw", 0, true),
    ]
}

/// CiA 301, 7.2.3.2.1: FFh and the consumer's node-ID with bit 7, its object, four bytes. The inhibit time is 2 ms.
#[test]
fn the_application_of_a_described_node_writes_to_objects_of_others() {
    let mut bench = Bench::new(&to_destinations(0x8000_0209));
    let (object, data) = (Mux::new(0x6200, 1), 0x1234_u32.to_le_bytes());
    let send = |bench: &mut Bench, to| bench.node.send_to_destination(NodeId::new(to), object, data, bench.now);
    assert!(!send(&mut bench, 7), "not before operational");
    bench.send("000#0109");
    assert!(send(&mut bench, 7));
    assert_eq!(bench.drain(), ["189#8700620134120000"]);
    assert!(send(&mut bench, 0) && !send(&mut bench, 7), "one waits");
    assert_eq!(bench.run(1), [""; 0], "inhibit time");
    assert_eq!(bench.run(1), ["189#8000620134120000"], "of all");
    bench.set(0x6200, 1, &[1, 0]);
    assert_eq!(bench.run(10), [""; 0], "by its application alone");
    assert_eq!(bench.write(0x1800, 1, 4, 0xC000_0189), None);
    assert_eq!(bench.write(0x1A00, 0, 1, 0), None);
    assert_eq!(bench.write(0x1A00, 0, 1, 0xFF), None, "a host may choose it");
    assert_eq!(bench.write(0x1800, 1, 4, 0x4000_0189), None);
    assert!(send(&mut bench, 7));
}

#[test]
fn in_a_world_one_described_node_writes_to_another_and_a_drive_has_no_such_application() {
    let mut world = World::new(Bitrate::M1, 1);
    let model = |rpdo| keep(&Eds::load(&sheet(&to_destinations(rpdo))).unwrap().eds).unwrap();
    // They listen to what the other sends; node 9's sends as node 8's.
    for (number, model) in [(8, model(0x0189)), (9, model(0x8000_0209)), (5, &devices::servo::CIA402)] {
        let drive = order(model, &Order::new(model, NodeId::new(number).unwrap(), Bitrate::M1)).unwrap();
        world.add_drive(number, drive).unwrap();
    }
    world.run_for(Duration::from_secs(1));
    let apply = |world: &mut World, node, words: &str| {
        let applied = world.apply(Place::node(node), &words.parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(5));
        applied.map_err(|refused| refused.to_string())
    };
    let host = world.add_probe();
    let refused = apply(&mut world, 9, "mpdo 8 6200:01 4660").unwrap_err();
    assert!(refused.contains("it has to be operational, with FFh in 1A00h:00"), "{refused}");
    world.send(host, "000#0100".parse().unwrap()).unwrap();
    world.run_for(Duration::from_millis(5));
    let read = |world: &mut World| {
        world.send(host, "608#4000620100000000".parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(5));
        let heard = std::iter::from_fn(|| world.poll_received(host)).map(|(_, frame)| frame.to_string());
        heard.filter(|frame| frame.starts_with("588#")).last().unwrap()
    };
    for (words, value) in
        [("mpdo 8 6200:01 4660", "3412"), ("mpdo all 6200:01 -2", "FEFF"), ("mpdo 7 6200:01 1", "FEFF")]
    {
        assert_eq!(apply(&mut world, 9, words), Ok(()), "{words}");
        assert_eq!(read(&mut world), format!("588#4B006201{value}0000"), "{words}");
    }
    let refused = apply(&mut world, 5, "mpdo 8 6200:01 1").unwrap_err();
    assert_eq!(refused, "a cia402 has no application that writes to other nodes");
}

/// CiA 301, 7.5.2.5: 1005h is the identifier of what such a device would wait for. What its file delivers stays, and does nothing.
#[test]
fn without_1005h_nothing_is_taken_that_waits_for_sync() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1007, 0, U32, "rw", 0, false),
        (0x1019, 0, U8, "rw", 0, false),
        (0x1400, 1, U32, "rw", 0x209, false),
        (0x1400, 2, U8, "rw", 1, false),
        (0x1600, 0, U8, "rw", 1, false),
        (0x1600, 1, U32, "rw", 0x6200_0108, false),
        (0x1800, 1, U32, "rw", 0x189, false),
        (0x1800, 2, U8, "rw", 1, false),
        (0x1800, 6, U8, "rw", 3, false),
        (0x1A00, 0, U8, "rw", 1, false),
        (0x1A00, 1, U32, "rw", 0x6200_0108, false),
        (0x6200, 1, U8, "rw", 0, true),
    ]);
    bench.send("000#0109");
    bench.send("209#55");
    assert_eq!((bench.send("080#"), bench.value(0x6200, 1)), (vec![], 0), "as delivered, and without effect");
    let kinds = [(1, true), (0, false), (2, false), (240, false), (252, false), (251, false), (254, true), (255, true)];
    for (parameter, (kind, is_taken)) in [0x1400, 0x1800].into_iter().flat_map(|index| kinds.map(|kind| (index, kind)))
    {
        let expected = if is_taken { None } else { Some(0x0609_0030) };
        assert_eq!(bench.write(parameter, 2, 1, kind), expected, "{parameter:04X}h, type {kind}");
    }
    assert_eq!(bench.write(0x1800, 2, 1, 253), None, "remote frames need no SYNC");
    assert_eq!(bench.write(0x1800, 2, 1, 1), Some(0x0609_0030), "as delivered it was, and is not any more");
    bench.write(0x1800, 1, 4, 0x8000_0189);
    for (index, sub_index, bytes, own) in [(0x1007, 0, 4, 0), (0x1019, 0, 1, 0), (0x1800, 6, 1, 3)] {
        assert_eq!(bench.write(index, sub_index, bytes, own), None, "{index:04X}h");
        assert_eq!(bench.write(index, sub_index, bytes, 5), Some(0x0609_0030), "{index:04X}h");
    }
}

#[test]
fn a_multiplexed_rpdo_is_stored_and_a_missing_destination_is_emcy_8230h() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1001, 0, U8, "ro", 0, false),
        (0x1014, 0, U32, "rw", 0x89, false),
        (0x1400, 0, U8, "ro", 2, false),
        (0x1400, 1, U32, "rw", 0x209, false),
        (0x1400, 2, U8, "rw", 255, false),
        (0x1600, 0, U8, "rw", 0xFF, false),
        (0x1600, 1, U32, "rw", 0, false),
        (0x1FD0, 0, U8, "ro", 1, false),
        (0x1FD0, 1, U64, "rw", 0, false),
        (0x6200, 0, U8, "rw", 0, true),
    ]);
    bench.send("000#0109");
    assert_eq!(bench.send("209#890062005A000000"), [""; 0]);
    assert_eq!(bench.value(0x6200, 0), 0x5A);
    assert_eq!(bench.send("209#8901620001000000"), ["089#3082000000000000", "089#0000000000000000"]);
}

/// Every communication object that a file has and that has no effect here keeps its value: the value itself is taken, another is
/// 0609 0030h. A record has several entries; which act is decided for each.
#[test]
fn what_has_no_effect_takes_its_own_value_and_no_other() {
    const AT_ONCE: usize = 500;
    const SUBS: [u8; 8] = [0, 1, 2, 3, 4, 8, 0x7F, 0xFE];
    let all = (0x1000..=0x1FFF_u16).flat_map(|index| SUBS.map(|sub| Mux::new(index, sub)));
    let others = all.filter(|mux| !acts_on(*mux)).collect::<Vec<_>>();
    let has = |index, sub| others.contains(&Mux::new(index, sub));
    assert!(
        others.len() > 8000
            && has(0x1013, 0)
            && has(0x1F81, 0x7F)
            && has(0x1280, 1)
            && has(0x1029, 2)
            && !has(0x1029, 1)
    );
    for objects in others.chunks(AT_ONCE) {
        let mut rows = vec![(0x1000, 0, U32, "ro", 0, false)];
        rows.extend(objects.iter().map(|mux| (mux.index, mux.sub_index, U32, "rw", 5, false)));
        let mut bench = Bench::new(&rows);
        for mux in objects {
            assert_eq!(bench.write(mux.index, mux.sub_index, 4, 6), Some(0x0609_0030), "{mux}");
            assert_eq!(bench.write(mux.index, mux.sub_index, 4, 5), None, "{mux}");
            assert_eq!(bench.value(mux.index, mux.sub_index), 5);
        }
    }
    // A text, and an object of a record of which other entries act.
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1029, 0, U8, "ro", 2, false),
        (0x1029, 1, U8, "rw", 0, false),
        (0x1029, 2, U8, "rw", 0, false),
        (0x1FFE, 0, U64, "rw", 3, false),
    ]);
    assert!(acts_on(Mux::new(0x1029, 1)) && !acts_on(Mux::new(0x1029, 2)));
    assert_eq!((bench.write(0x1029, 1, 1, 1), bench.write(0x1029, 2, 1, 1)), (None, Some(0x0609_0030)));
}

/// What acts in 2000h to 9FFFh is the application's, which a file does not describe: a device without a known profile keeps what is
/// written there, each object for itself.
#[test]
fn an_object_of_an_unknown_application_is_stored_and_changes_no_other() {
    const AT_ONCE: u16 = 512;
    for first in (0x2000..0xA000_u16).step_by(AT_ONCE.into()) {
        let objects = || (first..first + AT_ONCE).flat_map(|index| [(index, 0), (index, 3)]);
        let mut rows = vec![(0x1000, 0, U32, "ro", 0, false)];
        rows.extend(objects().map(|(index, sub)| (index, sub, U32, "rw", 5, true)));
        let mut bench = Bench::new(&rows);
        for (index, sub) in objects() {
            let value = u32::from(index) << 8 | u32::from(sub);
            assert_eq!(bench.write(index, sub, 4, value), None, "{index:04X}h:{sub:02X}");
        }
        for (index, sub) in objects() {
            assert_eq!(bench.value(index, sub), i64::from(index) << 8 | i64::from(sub), "{index:04X}h:{sub:02X}");
        }
    }
}

/// The built-in servo has no writable communication object without an effect.
#[test]
fn the_built_in_servo_acts_on_every_communication_object_that_can_be_written() {
    let rows = devices::servo::CIA402.dictionary.rows().iter();
    let writable = rows.filter(|row| row.is_communication() && !matches!(row.access, Access::ReadOnly | Access::Const));
    for row in writable.filter(|row| row.data_type.kind() != Kind::Bytes) {
        assert!(acts_on(row.mux()), "{}", row.mux());
    }
}

/// CiA 301, 7.2.8.2.1 and 7.3.2.2: it boots again, and answers; reset communication leaves what is not communication.
#[test]
fn nmt_resets_leave_the_node_alive() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0x191, false),
        (0x1017, 0, U16, "rw", 0, false),
        (0x6200, 0, U8, "rw", 0, true),
    ]);
    for (command, kept) in [("000#8209", 0x5A), ("000#8200", 0x5A), ("000#8109", 0), ("000#8100", 0)] {
        assert_eq!((bench.write(0x1017, 0, 2, 60_000), bench.write(0x6200, 0, 1, 0x5A)), (None, None));
        assert_eq!(bench.send(command), ["709#00"]);
        assert_eq!((bench.value(0x1017, 0), bench.value(0x6200, 0)), (0, kept), "{command}");
        assert_eq!(bench.send("609#4000100000000000"), ["589#4300100091010000"]);
        assert_eq!(bench.send("000#0100"), [""; 0]);
    }
}

/// CiA 301, 7.2.8.2: a device does one of the two. The heartbeat counts while it is on.
#[test]
fn guarding_is_answered_while_no_heartbeat_is_produced() {
    let mut bench = Bench::new(&[
        (0x1000, 0, U32, "ro", 0, false),
        (0x1001, 0, U8, "ro", 0, false),
        (0x100C, 0, U16, "rw", 100, false),
        (0x100D, 0, U8, "rw", 2, false),
        (0x1014, 0, U32, "rw", 0x89, false),
        (0x1017, 0, U16, "rw", 0, false),
    ]);
    assert_eq!(bench.send("709#R1"), ["709#7F"]);
    assert_eq!(bench.send("709#R1"), ["709#FF"]);
    bench.write(0x1017, 0, 2, 1000);
    assert_eq!(bench.send("709#R1"), [""; 0]);
    assert_eq!(bench.run(3000), ["709#7F", "709#7F", "709#7F"], "heartbeats alone, and the life time is not watched");
    bench.write(0x1017, 0, 2, 0);
    assert_eq!(bench.send("709#R1"), ["709#7F"], "the toggle bit begins with 0");
    assert_eq!(bench.run(1000), ["089#3081110000000000"], "200 ms later the master has gone");
    assert_eq!(bench.send("709#R1"), ["709#FF", "089#0000000000000000"]);
}
