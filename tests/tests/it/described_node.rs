//! A device that is not a drive, from our own data sheet: what a host on the bus sees of it, and changes from outside.

use std::time::Duration;

use can::Bitrate;
use canopen::{NmtState, NodeId};
use master::Network;
use master::boot::{BootPlan, Expectation};
use sim::machine::{Order, order};
use sim::{StationId, World};

/// Inputs and outputs of CiA 401, values of every length, TPDO1 by event and TPDO2 with SYNC. In Latin-1: the name has a letter
/// beyond ASCII.
const SHEET: &[u8] = b"[FileInfo]\nFileName=io.eds\n[DeviceInfo]\nVendorName=None\nProductName=Inputs\n\
[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x00030191\n\
[1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
[1003]\nParameterName=Errors\nObjectType=8\nSubNumber=3\n\
[1003sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=0\n\
[1003sub1]\nParameterName=1\nDataType=7\nAccessType=ro\n[1003sub2]\nParameterName=2\nDataType=7\nAccessType=ro\n\
[1005]\nParameterName=SYNC\nDataType=7\nAccessType=rw\nDefaultValue=0x80\n\
[1008]\nParameterName=Name\nDataType=9\nAccessType=const\nDefaultValue=Pr\xFCf\n\
[1010]\nParameterName=Store\nObjectType=8\nSubNumber=2\n[1010sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1010sub1]\nParameterName=All\nDataType=7\nAccessType=rw\nDefaultValue=1\n\
[1014]\nParameterName=EMCY\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x80\n\
[1017]\nParameterName=Heartbeat\nDataType=6\nAccessType=rw\nDefaultValue=0\n\
[1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n[1018sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\nDefaultValue=7\n\
[1800]\nParameterName=T1\nObjectType=9\nSubNumber=3\n[1800sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n\
[1800sub1]\nParameterName=COB\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x180\n\
[1800sub2]\nParameterName=Type\nDataType=5\nAccessType=rw\nDefaultValue=255\n\
[1801]\nParameterName=T2\nObjectType=9\nSubNumber=3\n[1801sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=2\n\
[1801sub1]\nParameterName=COB\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x280\n\
[1801sub2]\nParameterName=Type\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
[1A00]\nParameterName=M1\nObjectType=9\nSubNumber=2\n[1A00sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
[1A00sub1]\nParameterName=1\nDataType=7\nAccessType=rw\nDefaultValue=0x60000108\n\
[1A01]\nParameterName=M2\nObjectType=9\nSubNumber=2\n[1A01sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
[1A01sub1]\nParameterName=1\nDataType=7\nAccessType=rw\nDefaultValue=0x60000108\n\
[2000]\nParameterName=Gain\nDataType=8\nAccessType=rw\nDefaultValue=0.5\nLowLimit=0.0\nHighLimit=2.5\n\
[2001]\nParameterName=Label\nDataType=9\nAccessType=rw\nDefaultValue=abc\n\
[2002]\nParameterName=Counter\nDataType=0x1B\nAccessType=ro\nDefaultValue=0\n\
[2003]\nParameterName=Level\nDataType=5\nAccessType=rw\nDefaultValue=5\nLowLimit=1\nHighLimit=9\n\
[6000]\nParameterName=Inputs\nObjectType=8\nSubNumber=2\n[6000sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[6000sub1]\nParameterName=1\nDataType=5\nAccessType=ro\nPDOMapping=1\nDefaultValue=0\n";

struct Bench {
    world: World,
    host: StationId,
}

impl Bench {
    /// Node 9, switched on and operational.
    fn new() -> Self {
        Self::of(SHEET)
    }

    fn of(sheet: &[u8]) -> Self {
        let eds = eds::Eds::load(sheet).expect("it is read").eds;
        let model = eds::keep(&eds).expect("it makes a description");
        let mut world = World::new(Bitrate::M1, 1);
        let host = world.add_probe();
        let node = NodeId::new(9).unwrap();
        world.add_drive(9, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
        world.run_for(Duration::from_millis(100));
        let mut bench = Self { world, host };
        assert_eq!(bench.heard(), ["709#00"]);
        assert_eq!(bench.send("000#0109"), ["189#00"], "an event-driven TPDO is sent once at the start");
        bench
    }

    fn heard(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.world.poll_received(self.host)).map(|(_, frame)| frame.to_string()).collect()
    }

    /// A frame from the host; what is heard within 20 ms of it.
    fn send(&mut self, frame: &str) -> Vec<String> {
        self.world.send(self.host, frame.parse().unwrap()).unwrap();
        self.world.run_for(Duration::from_millis(20));
        self.heard()
    }

    /// A world command; what is heard within 20 ms of it.
    fn world_command(&mut self, line: &str) -> Vec<String> {
        let answer = sim::command::answer(&mut self.world, line).unwrap().json;
        assert!(answer.starts_with("{\"ok\":true"), "{line}: {answer}");
        self.world.run_for(Duration::from_millis(20));
        self.heard()
    }
}

#[test]
fn what_the_world_sets_is_sent_by_event_and_with_sync() {
    let mut bench = Bench::new();
    assert_eq!(bench.world_command("9 set 6000:01 5Ah"), ["189#5A"]);
    assert!(bench.world_command("9 set 6000:01 5Ah").is_empty(), "no change, no event");
    assert_eq!(bench.send("080#"), ["289#5A"]);
    bench.send("000#8009");
    assert!(bench.world_command("9 set 6000:01 1").is_empty(), "pre-operational: no PDO");
}

#[test]
fn limits_are_kept_for_whole_numbers_and_reals() {
    let mut bench = Bench::new();
    // 0609 0031h and 0609 0032h: too high, too low; 2.0 and 3.0 in IEEE 754.
    assert_eq!(bench.send("609#2F0320000A000000"), ["589#8003200031000906"]);
    assert_eq!(bench.send("609#2F03200000000000"), ["589#8003200032000906"]);
    assert_eq!(bench.send("609#2300200000004040"), ["589#8000200031000906"]);
    assert_eq!(bench.send("609#2300200000000040"), ["589#6000200000000000"]);
    assert_eq!(bench.send("609#4000200000000000"), ["589#4300200000000040"]);
}

#[test]
fn a_default_beyond_ascii_goes_over_the_bus_byte_for_byte() {
    // "Prüf" in Latin-1: 50h 72h FCh 66h.
    assert_eq!(Bench::new().send("609#4008100000000000"), ["589#430810005072FC66"]);
}

/// CiA 301, 7.5.2.33 and 7.5.2.34: a further server is made, and what would have no effect is refused with 0609 0030h.
#[test]
fn a_further_sdo_channel_of_a_server_is_made_and_none_of_a_client() {
    let channel = |index: &str| {
        format!(
            "[{index}]\nParameterName=SDO\nObjectType=9\nSubNumber=3\n[{index}sub0]\nParameterName=n\nDataType=5\nAccessType=ro\n\
             DefaultValue=2\n[{index}sub1]\nParameterName=to server\nDataType=7\nAccessType=rw\nDefaultValue=0x80000000\n\
             [{index}sub2]\nParameterName=to client\nDataType=7\nAccessType=rw\nDefaultValue=0x80000000\n"
        )
    };
    let mut bench = Bench::of(&[SHEET, channel("1201").as_bytes(), channel("1280").as_bytes()].concat());
    for (object, is_server) in [("011201", true), ("011202", true), ("801201", false), ("801202", false)] {
        let (taken, refused) = ([format!("589#60{object}00000000")], [format!("589#80{object}30000906")]);
        assert_eq!(bench.send(&format!("609#23{object}40060000")), refused, "restricted (table 41)");
        assert_eq!(
            bench.send(&format!("609#23{object}90060000")) == taken,
            is_server,
            "no application asks as a client"
        );
        assert_eq!(bench.send(&format!("609#23{object}90060080")) == taken, is_server);
        assert_eq!(bench.send(&format!("609#23{object}00000080")), taken, "as delivered");
    }
}

/// CiA 301, 7.2.4.3.9: the label in two segments.
#[test]
fn a_text_is_written_in_blocks() {
    let mut bench = Bench::new();
    assert_eq!(bench.send("609#C601200008000000"), ["589#A40120007F000000"]);
    assert!(bench.send("609#0141424344454647").is_empty());
    assert_eq!(bench.send("609#8248000000000000"), ["589#A2027F0000000000"]);
    let [low, high] = canopen::sdo::block::checksum(0, b"ABCDEFGH").to_le_bytes();
    assert_eq!(bench.send(&format!("609#D9{low:02X}{high:02X}0000000000")), ["589#A100000000000000"]);
    assert_eq!(bench.send("609#4001200000000000"), ["589#4101200008000000"]);
}

#[test]
fn texts_and_64_bits_are_set_from_outside_and_stored_over_power_cycles() {
    let mut bench = Bench::new();
    bench.world_command("9 set 2001 \"new\"");
    assert_eq!(bench.send("609#4001200000000000"), ["589#470120006E657700"]);
    bench.world_command("9 set 2002 18446744073709551615");
    assert_eq!(bench.send("609#4002200000000000"), ["589#4102200008000000"]);
    assert_eq!(bench.send("609#6000000000000000"), ["589#00FFFFFFFFFFFFFF"]);
    assert_eq!(bench.send("609#7000000000000000"), ["589#1DFF000000000000"]);
    bench.send("609#2300200000000040");
    assert_eq!(bench.send("609#2310100173617665"), ["589#6010100100000000"], "save");
    bench.world_command("9 power off");
    bench.world_command("9 power on");
    assert_eq!(bench.send("609#4001200000000000"), ["589#470120006E657700"], "the label");
    assert_eq!(bench.send("609#4000200000000000"), ["589#4300200000000040"], "the gain");
    let answer = sim::command::answer(&mut bench.world, "9 set 2001 5").unwrap().json;
    assert!(answer.contains("a text in quotation marks is meant"), "{answer}");
    let answer = sim::command::answer(&mut bench.world, "9 set 2002 -1").unwrap().json;
    assert!(answer.contains("UNSIGNED64 takes 0 to 18446744073709551615"), "{answer}");
}

#[test]
fn a_new_error_register_is_reported_by_emcy_and_kept_in_the_history() {
    let mut bench = Bench::new();
    // Generic and temperature.
    assert_eq!(bench.world_command("9 set 1001 9"), ["089#0010090000000000"]);
    assert_eq!(bench.send("609#4003100100000000"), ["589#4303100100100000"]);
    assert_eq!(bench.world_command("9 set 1001 0"), ["089#0000000000000000"]);
    assert_eq!(bench.send("609#4001100000000000"), ["589#4F01100000000000"]);
}

#[test]
fn heartbeats_come_in_their_time() {
    let mut bench = Bench::new();
    bench.send("609#2B17100064000000");
    bench.world.run_for(Duration::from_millis(500));
    let beats = bench.heard();
    assert!(beats.len() == 5 && beats.iter().all(|frame| frame == "709#05"), "{beats:?}");
}

/// What is refused, as the code of the abort; `None` is taken.
fn write(bench: &mut Bench, index: u16, sub_index: u8, bytes: u8, value: u32) -> Option<u32> {
    let command = 0x23 | (4 - bytes) << 2;
    let (index, value) = (index.to_le_bytes(), value.to_le_bytes());
    let data: String =
        [command, index[0], index[1], sub_index].iter().chain(&value).map(|b| format!("{b:02X}")).collect();
    let answer = bench.send(&format!("609#{data}"));
    let answer = answer.iter().find(|frame| frame.starts_with("589#")).expect("it answers");
    let code = u32::from_str_radix(&answer[12..20], 16).unwrap().swap_bytes();
    answer.starts_with("589#80").then_some(code)
}

const SYNC_OBJECTS: &[u8] = b"[1006]\nParameterName=Cycle\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
[1007]\nParameterName=Window\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
[1019]\nParameterName=Counter\nDataType=5\nAccessType=rw\nDefaultValue=0\n";

#[test]
fn a_file_with_1006h_and_1019h_makes_a_producer_of_sync_that_counts() {
    let mut bench = Bench::of(&[SHEET, SYNC_OBJECTS].concat());
    for (index, bytes, value) in [(0x1019, 1, 3), (0x1006, 4, 10_000), (0x1005, 4, 0x4000_0080)] {
        assert_eq!(write(&mut bench, index, 0, bytes, value), None, "{index:04X}h");
    }
    // The write took its time on the wire: the second SYNC is not yet seen 20 ms after it. TPDO2 comes right behind each.
    bench.world.run_for(Duration::from_millis(40));
    assert_eq!(bench.heard(), ["080#02", "289#00", "080#03", "289#00", "080#01", "289#00", "080#02", "289#00"]);
    assert_eq!(write(&mut bench, 0x1005, 0, 4, 0x4000_0081), Some(0x0609_0030), "its identifier stays");
}

#[test]
fn a_remote_frame_gets_a_tpdo_unless_bit_30_of_its_cob_id_is_set() {
    let mut bench = Bench::new();
    assert_eq!(bench.send("189#R1"), ["189#00"]);
    assert_eq!(write(&mut bench, 0x1800, 1, 4, 0x4000_0189), None);
    assert_eq!(bench.send("189#R1"), [""; 0]);
    assert_eq!(write(&mut bench, 0x1800, 2, 1, 253), Some(0x0609_0030));
    assert_eq!(write(&mut bench, 0x1800, 1, 4, 0x189), None);
    assert_eq!(write(&mut bench, 0x1800, 2, 1, 253), None);
    assert_eq!(bench.world_command("9 set 6000:01 5Ah"), [""; 0], "only when asked");
    assert_eq!(bench.send("189#R1"), ["189#5A"]);
}

#[test]
fn what_nothing_acts_on_and_what_contradicts_is_refused_with_the_standards_codes() {
    let services = b"[1006]\nParameterName=Cycle\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
[1007]\nParameterName=Window\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
[1012]\nParameterName=TIME\nDataType=7\nAccessType=rw\nDefaultValue=0x100\n\
[1016]\nParameterName=Consumers\nObjectType=8\nSubNumber=4\n[1016sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=3\n\
[1016sub1]\nParameterName=1\nDataType=7\nAccessType=rw\n[1016sub2]\nParameterName=2\nDataType=7\nAccessType=rw\n\
[1016sub3]\nParameterName=3\nDataType=7\nAccessType=rw\n\
[1019]\nParameterName=Counter\nDataType=5\nAccessType=rw\nDefaultValue=0\n";
    let mut bench = Bench::of(&[SHEET, services].concat());
    let mut refused = |index, sub_index, bytes, value| write(&mut bench, index, sub_index, bytes, value);
    // CiA 301, 7.5.2.19: no two times for one node; a time of 0 watches no node.
    assert_eq!(refused(0x1016, 1, 4, 0x0005_03E8), None);
    assert_eq!(refused(0x1016, 2, 4, 0x0005_01F4), Some(0x0604_0043));
    assert_eq!(refused(0x1016, 2, 4, 0x0005_0000), None);
    assert_eq!(refused(0x1016, 1, 4, 0x0005_07D0), None, "its own entry may change");
    assert_eq!(refused(0x1016, 3, 4, 0x0006_01F4), None);
    assert_eq!(refused(0x1016, 1, 4, 0), None);
    assert_eq!(refused(0x1016, 2, 4, 0x0005_01F4), None, "no other entry watches it any more");
    // It has no clock to produce TIME from.
    assert_eq!(refused(0x1012, 0, 4, 0x4000_0100), Some(0x0609_0030));
    assert_eq!(refused(0x1012, 0, 4, 0x100), None);
    // CiA 301, 7.5.2.22: 0 or 2 to 240, while 1006h is 0.
    for (value, code) in [(1, Some(0x0609_0030)), (241, Some(0x0609_0030)), (2, None), (240, None)] {
        assert_eq!(refused(0x1019, 0, 1, value), code, "{value}");
    }
    assert_eq!(refused(0x1006, 0, 4, 1000), None);
    assert_eq!(refused(0x1019, 0, 1, 4), Some(0x0800_0022));
    assert_eq!(refused(0x1019, 0, 1, 240), None, "as it is");
}

/// A device whose file has 100Ch and 100Dh, and no 1017h, is watched by node guarding (CiA 301, 7.2.8.2.1), and so is its master by it.
#[test]
fn a_device_without_a_heartbeat_is_guarded_by_the_master_that_boots_it() {
    let without = String::from_utf8_lossy(SHEET)
        .replace("[1017]\nParameterName=Heartbeat\nDataType=6\n", "[2010]\nParameterName=X\nDataType=6\n");
    let guard = "[100C]\nParameterName=Guard time\nDataType=6\nAccessType=rw\nDefaultValue=50\n\
                 [100D]\nParameterName=Life time factor\nDataType=5\nAccessType=rw\nDefaultValue=4\n";
    let read = eds::Eds::load((without + guard).as_bytes()).expect("it is read");
    let model = eds::keep(&read.eds).expect("it makes a description");
    let (node, network) = (NodeId::new(9).unwrap(), Network::new());
    let mut world = World::new(Bitrate::M1, 1);
    world.add_station(network.clone());
    world.add_drive(9, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
    world.run_for(Duration::from_millis(100));
    let plan = BootPlan::new([(node, Expectation { vendor_id: None, ..Expectation::of(model) })]);
    let report = sim::block_on(&mut world, network.boot(&plan)).unwrap().nodes.remove(0);
    assert!(!report.has_failed() && report.state == Some(NmtState::Operational), "{report}");
    let watch = |network: &Network| network.node(node).facts().heartbeat_watch.expect("it is watched");
    assert_eq!((watch(&network).time, watch(&network).asked), (Duration::from_millis(200), true));
    world.run_for(Duration::from_secs(5));
    assert!(!watch(&network).lost);
    while network.poll_event().is_some() {}
    for line in ["9 cable cut", "9 cable join"] {
        assert!(sim::command::answer(&mut world, line).unwrap().json.starts_with("{\"ok\":true"));
        world.run_for(Duration::from_secs(1));
        assert_eq!(watch(&network).lost, line.ends_with("cut"), "{line}");
    }
    let said: Vec<String> = std::iter::from_fn(|| network.poll_event()).map(|(_, event)| event.to_string()).collect();
    assert!(said.contains(&"node 9: no answer to node guarding for 200 ms".to_owned()), "{said:?}");
    // Its own life time was over as well: life guarding error, and its end.
    for expected in ["emergency 8130h", "emergency 0000h", "it is heard again"] {
        assert!(said.iter().any(|event| event.contains(expected)), "{expected}: {said:?}");
    }
}
