//! Devices beside drives on one virtual bus: inputs and outputs by CiA 401, an encoder by CiA 406 on the shaft of a servo. Expected values
//! are those of the profiles, or the geometry of the shaft.

use std::time::Duration;

use can::{Bitrate, Frame};
use canopen::{AbortCode, Mux, NodeId};
use master::units::Degrees;
use master::{Drive, MotionOptions, Network};
use sim::machine::{Order, order};
use sim::{Place, StationId, Stimulus, World, block_on};
use words::models::resolve;

struct Bench {
    world: World,
    host: StationId,
}

const MODULE: u8 = 10;
const ENCODER: u8 = 11;
const SERVO: u8 = 5;

impl Bench {
    /// A module, an encoder on the shaft of a servo, and a host; all nodes operational.
    fn new() -> Self {
        let mut world = World::new(Bitrate::M1, 1);
        for (name, number) in [("io401", MODULE), ("encoder406", ENCODER), ("cia402", SERVO)] {
            let model = resolve(name).unwrap();
            let node = NodeId::new(number).unwrap();
            world.add_drive(number, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
        }
        world.mount(ENCODER, Place::node(SERVO)).unwrap().unwrap();
        let host = world.add_probe();
        let mut bench = Self { world, host };
        bench.run_ms(300);
        bench.send("000#0100");
        bench.run_ms(20);
        bench.heard();
        bench
    }

    fn run_ms(&mut self, ms: u64) {
        self.world.run_for(Duration::from_millis(ms));
    }

    fn send(&mut self, frame: &str) {
        self.world.send(self.host, frame.parse().unwrap()).unwrap();
        self.run_ms(2);
    }

    fn heard(&mut self) -> Vec<Frame> {
        std::iter::from_fn(|| self.world.poll_received(self.host)).map(|(_, frame)| frame).collect()
    }

    /// Frames of one identifier that came since the last look, in `candump`'s form without the identifier.
    fn of(&mut self, id: u32) -> Vec<String> {
        let frames = self.heard().into_iter().filter(|frame| frame.id().raw() == id);
        frames.map(|frame| frame.to_string().split_once('#').unwrap().1.to_owned()).collect()
    }

    fn request(&mut self, node: u8, data: [u8; 8]) -> [u8; 8] {
        self.heard();
        let text: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        self.send(&format!("{:03X}#{text}", 0x600 + u32::from(node)));
        self.run_ms(3);
        let answer = self.heard().into_iter().find(|frame| frame.id().raw() == 0x580 + u32::from(node));
        answer.expect("it answers").data().try_into().unwrap()
    }

    fn write(&mut self, node: u8, index: u16, sub: u8, bytes: u8, value: i64) -> Result<(), AbortCode> {
        let mut data = [0x23 | (4 - bytes) << 2, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0];
        data[4..4 + usize::from(bytes)].copy_from_slice(&value.to_le_bytes()[..usize::from(bytes)]);
        let answer = self.request(node, data);
        if answer[0] == 0x60 { Ok(()) } else { Err(AbortCode(u32::from_le_bytes(answer[4..8].try_into().unwrap()))) }
    }

    fn set(&mut self, node: u8, index: u16, sub: u8, bytes: u8, value: i64) {
        self.write(node, index, sub, bytes, value)
            .unwrap_or_else(|code| panic!("{index:04X}h:{sub} = {value}: {code}"));
    }

    /// As an unsigned number of 32 bits.
    fn read(&mut self, node: u8, index: u16, sub: u8) -> u32 {
        let answer = self.request(node, [0x40, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0]);
        assert_eq!(answer[0] & 0xE0, 0x40, "{index:04X}h:{sub}: {answer:02X?}");
        u32::from_le_bytes(answer[4..8].try_into().unwrap())
    }

    fn apply(&mut self, node: u8, words: &str) {
        self.try_apply(node, words).unwrap_or_else(|error| panic!("{words}: {error}"));
    }

    fn try_apply(&mut self, node: u8, words: &str) -> Result<(), String> {
        let stimulus = words.parse::<Stimulus>().map_err(|error| error.to_string())?;
        self.world.apply(Place::node(node), &stimulus).unwrap().map_err(|refused| refused.to_string())
    }

    /// Levels of the module's outputs.
    fn outputs(&mut self) -> u64 {
        self.world.report(MODULE).unwrap().outputs.bits
    }
}

#[test]
fn an_input_is_an_event_and_its_polarity_turns_it() {
    let mut bench = Bench::new();
    bench.apply(MODULE, "input DI1 1");
    bench.run_ms(5);
    assert_eq!(bench.of(0x18A), ["0100"]);
    bench.apply(MODULE, "input di12 1");
    bench.run_ms(5);
    assert_eq!(bench.of(0x18A), ["0108"]);
    bench.set(MODULE, 0x6002, 1, 1, 0x03);
    assert_eq!(bench.read(MODULE, 0x6000, 1), 0x02, "inverted where the bit is 1");
    let names: Vec<&str> = bench.world.with_drive(MODULE, |drive, _| drive.inputs().to_vec()).unwrap();
    assert_eq!((names.len(), names[0], names[15]), (16, "DI1", "DI16"));
    let refusal = bench.try_apply(MODULE, "input X0 1").unwrap_err();
    assert!(refusal.contains("DI1"), "{refusal}");
}

#[test]
fn only_the_changes_that_are_asked_for_are_events() {
    let mut bench = Bench::new();
    // Of the first line no change, of the second the rising one, of the third the falling one.
    bench.set(MODULE, 0x6006, 1, 1, 0xF8);
    bench.set(MODULE, 0x6007, 1, 1, 0x02);
    bench.set(MODULE, 0x6008, 1, 1, 0x04);
    bench.heard();
    for (words, expected) in [
        ("input DI1 1", None),
        ("input DI2 1", Some("0300")),
        ("input DI2 0", None),
        ("input DI3 1", None),
        ("input DI3 0", Some("0100")),
        ("input DI4 1", Some("0900")),
    ] {
        bench.apply(MODULE, words);
        bench.run_ms(5);
        assert_eq!(bench.of(0x18A), expected.into_iter().map(str::to_owned).collect::<Vec<_>>(), "{words}");
    }
    bench.set(MODULE, 0x6005, 0, 1, 0);
    bench.heard();
    bench.apply(MODULE, "input DI4 0");
    bench.run_ms(5);
    assert!(bench.of(0x18A).is_empty(), "6005h");
    assert_eq!(bench.read(MODULE, 0x6000, 1), 0x01);
}

#[test]
fn outputs_follow_the_rpdo_their_filter_and_their_polarity() {
    let mut bench = Bench::new();
    bench.send("20A#0581");
    assert_eq!(bench.outputs(), 0x8105);
    bench.set(MODULE, 0x6208, 1, 1, 0x0F);
    bench.send("20A#F081");
    assert_eq!(bench.outputs(), 0x8100, "the upper lines of the first byte are not the host's");
    bench.set(MODULE, 0x6202, 2, 1, 0xFF);
    assert_eq!(bench.outputs(), 0x7E00);
    bench.apply(MODULE, "power off");
    assert_eq!(bench.outputs(), 0);
}

#[test]
fn outputs_take_their_error_values_when_the_node_leaves_operational_or_its_host_is_lost() {
    let prepared = || {
        let mut bench = Bench::new();
        // Lines 1 to 4 take their error value, which is on for line 4; the others stay. Channel 1 takes -5, channel 2 stays.
        bench.set(MODULE, 0x6206, 1, 1, 0x0F);
        bench.set(MODULE, 0x6207, 1, 1, 0x08);
        bench.set(MODULE, 0x6444, 1, 4, -5);
        bench.set(MODULE, 0x6443, 2, 1, 0);
        bench.send("20A#1300");
        bench.send("30A#0100020003000400");
        assert_eq!(bench.outputs(), 0x13);
        bench
    };
    let failed = |bench: &mut Bench, how: &str| {
        assert_eq!(bench.outputs(), 0x18, "{how}");
    };
    for (how, command) in [("stop", "000#020A"), ("pre-operational", "000#800A"), ("reset communication", "000#820A")] {
        let mut bench = prepared();
        bench.send(command);
        bench.run_ms(5);
        failed(&mut bench, how);
        bench.send("000#010A");
        failed(&mut bench, how);
        assert_eq!([1, 2].map(|sub| bench.read(MODULE, 0x6411, sub) as u16), [-5_i16 as u16, 2], "{how}");
        bench.send("20A#0100");
        assert_eq!(bench.outputs(), 0x01, "{how}: the next write is the host's again");
    }
    // A lost heartbeat, whatever 1029h says of the NMT state.
    for behaviour in [0, 1, 2] {
        let mut bench = prepared();
        bench.set(MODULE, 0x1029, 1, 1, behaviour);
        bench.set(MODULE, 0x1016, 1, 4, 0x0001_0064);
        bench.send("701#05");
        assert_eq!(bench.outputs(), 0x13);
        bench.run_ms(200);
        failed(&mut bench, "heartbeat");
    }
}

#[test]
fn an_analogue_input_is_an_event_where_its_trigger_is_met() {
    let mut bench = Bench::new();
    let set_to = |bench: &mut Bench, value: i32| {
        bench.heard();
        bench.apply(MODULE, &format!("set 6401:01 {value}"));
        bench.run_ms(5);
        !bench.of(0x28A).is_empty()
    };
    assert!(!set_to(&mut bench, 1000), "6423h is off as delivered");
    assert_eq!(bench.read(MODULE, 0x6401, 1) as u16, 1000);
    bench.set(MODULE, 0x6423, 0, 1, 1);
    // Above 2000, below -2000, or 100 from the last one.
    for (object, value) in [(0x6424, 2000), (0x6425, -2000), (0x6426, 100)] {
        bench.set(MODULE, object, 1, 4, value);
    }
    bench.set(MODULE, 0x6421, 1, 1, 3);
    let events = [1500, 2001, 2002, 1999, -2000, -2001].map(|value| set_to(&mut bench, value));
    assert_eq!(events, [false, true, true, false, false, true]);
    // Deltas, from what was last sent: -2001.
    bench.set(MODULE, 0x6421, 1, 1, 4);
    let events = [-1901, -1900, -1850, -1801, -1799].map(|value| set_to(&mut bench, value));
    assert_eq!(events, [false, true, false, false, true]);
    bench.set(MODULE, 0x6427, 1, 4, 50);
    bench.set(MODULE, 0x6421, 1, 1, 8);
    let events = [-1700, -1849, -1850].map(|value| set_to(&mut bench, value));
    assert_eq!(events, [false, false, true], "fallen by more than 50 from -1799");
}

/// Degrees of the servo's shaft from the zero of its disc.
fn shaft_turns(bench: &mut Bench) -> f64 {
    bench.world.measure(Place::node(SERVO)).unwrap().shaft_angle_rad / std::f64::consts::TAU
}

/// Turns the servo at so many r/min.
fn turn(bench: &mut Bench, rpm: i64) {
    for (index, bytes, value) in [(0x6060, 1, 3), (0x6040, 2, 6), (0x6040, 2, 7), (0x6040, 2, 15)] {
        bench.set(SERVO, index, 0, bytes, value);
    }
    bench.set(SERVO, 0x60FF, 0, 4, rpm * 131_072 / 60);
    bench.run_ms(300);
}

#[test]
fn an_encoder_shows_the_shaft_that_it_sits_on() {
    let mut bench = Bench::new();
    let steps = |turns: f64| (turns * 8192.0).floor().rem_euclid(8192.0 * 4096.0) as u32;
    let at = shaft_turns(&mut bench);
    assert_eq!(bench.read(ENCODER, 0x6004, 0), steps(at));
    turn(&mut bench, 150);
    // 2.5 turns a second: 20480 steps; it is looked at once a millisecond, 20 steps.
    let speed = bench.read(ENCODER, 0x6030, 1) as u16;
    assert!((20_300..20_700).contains(&speed), "{speed}");
    bench.heard();
    bench.run_ms(100);
    assert!(bench.of(0x18B).len() > 90, "TPDO1 on each change");
    bench.send("080#");
    let synchronous = bench.of(0x28B);
    let position = u32::from_str_radix(&synchronous[0][..8], 16).unwrap().swap_bytes();
    let shown = f64::from(position) / 8192.0;
    let expected = shaft_turns(&mut bench).rem_euclid(4096.0);
    assert!((shown - expected).abs() < 0.015, "{shown} {expected}");
}

#[test]
fn an_encoder_counts_in_its_units_and_direction_and_keeps_its_preset() {
    let mut bench = Bench::new();
    // 3600 units a turn, round after three turns.
    bench.set(ENCODER, 0x6001, 0, 4, 3600);
    bench.set(ENCODER, 0x6002, 0, 4, 10_800);
    bench.set(ENCODER, 0x6003, 0, 4, 100);
    assert_eq!(bench.read(ENCODER, 0x6004, 0), 100, "the present position is the preset");
    let begin = shaft_turns(&mut bench);
    turn(&mut bench, 600);
    bench.set(SERVO, 0x60FF, 0, 4, 0);
    bench.run_ms(500);
    let moved = (shaft_turns(&mut bench) - begin) * 3600.0;
    let expected = (100.0 + moved).rem_euclid(10_800.0);
    let shown = f64::from(bench.read(ENCODER, 0x6004, 0));
    assert!((shown - expected).abs() <= 2.0, "{shown} {expected}");
    assert!(moved > 10_800.0, "more than once round: {moved}");
    let offset = bench.read(ENCODER, 0x6509, 0);
    bench.apply(ENCODER, "power cycle");
    bench.run_ms(300);
    assert_eq!(bench.read(ENCODER, 0x6509, 0), offset, "the offset is kept without power");
    // The other way round, and without scaling.
    bench.set(ENCODER, 0x6000, 0, 2, 1);
    let turns = shaft_turns(&mut bench);
    let raw = (-turns * 8192.0).floor().rem_euclid(8192.0 * 4096.0) as u32;
    let shown = bench.read(ENCODER, 0x6004, 0).wrapping_sub(offset) % (8192 * 4096);
    assert!(shown.abs_diff(raw) <= 1, "{shown} {raw}");
    assert_eq!(bench.read(ENCODER, 0x6500, 0) & 5, 1, "the status shows the parameters");
}

#[test]
fn an_encoder_sends_in_its_cycle_and_refuses_what_its_disc_does_not_have() {
    let mut bench = Bench::new();
    bench.set(ENCODER, 0x6200, 0, 2, 20);
    assert_eq!(bench.read(ENCODER, 0x1800, 5) as u16, 20, "the same timer");
    bench.heard();
    bench.run_ms(1000);
    let sent = bench.of(0x18B).len();
    assert!((49..=51).contains(&sent), "once in 20 ms: {sent}");
    for (object, value, code) in [
        (0x6001, 8193, AbortCode::VALUE_TOO_HIGH),
        (0x6001, 0, AbortCode::VALUE_TOO_LOW),
        (0x6002, 0, AbortCode::VALUE_TOO_LOW),
        (0x6002, 8192 * 4096 + 1, AbortCode::VALUE_TOO_HIGH),
        (0x6003, 8192 * 4096, AbortCode::VALUE_TOO_HIGH),
    ] {
        assert_eq!(bench.write(ENCODER, object, 0, 4, value), Err(code), "{object:04X}h = {value}");
    }
}

#[test]
fn an_encoder_takes_back_the_units_that_its_file_leaves_open() {
    let sheet = "[FileInfo]\nFileName=x.eds\n[DeviceInfo]\nProductName=other\n\
        [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x00020196\n\
        [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
        [6001]\nParameterName=Units per revolution\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
        [6002]\nParameterName=Total range\nDataType=7\nAccessType=rw\nDefaultValue=0\n\
        [6004]\nParameterName=Position\nDataType=7\nAccessType=ro\n";
    let description = eds::keep(&eds::Eds::load(sheet.as_bytes()).unwrap().eds).unwrap();
    let mut bench = Bench::new();
    let node = NodeId::new(20).unwrap();
    bench.world.add_drive(20, order(description, &Order::new(description, node, Bitrate::M1)).unwrap()).unwrap();
    bench.run_ms(300);
    for object in [0x6001, 0x6002] {
        assert_eq!(bench.write(20, object, 0, 4, 0), Ok(()), "{object:04X}h as delivered");
        assert_eq!(bench.write(20, object, 0, 4, 100), Ok(()));
        assert_eq!(bench.write(20, object, 0, 4, 0), Err(AbortCode::VALUE_TOO_LOW), "{object:04X}h");
    }
}

#[test]
fn objects_of_the_profile_that_nothing_acts_on_take_no_writes() {
    let sheet = "[FileInfo]\nFileName=x.eds\n[DeviceInfo]\nProductName=other\n\
        [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x00030191\n\
        [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
        [6200]\nParameterName=Outputs\nObjectType=8\nSubNumber=2\n[6200sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
        [6200sub1]\nParameterName=Outputs 1\nDataType=5\nAccessType=rww\n\
        [6003]\nParameterName=Filter\nObjectType=8\nSubNumber=2\n[6003sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
        [6003sub1]\nParameterName=Filter 1\nDataType=5\nAccessType=rw\n\
        [2000]\nParameterName=Own\nDataType=5\nAccessType=rw\n";
    // Of a profile that is not CiA 401 they are stored and answered; where 1000h is left open, the objects decide.
    for (device_type, acts) in [("0x00030191", true), ("0", true), ("0x00030194", false)] {
        let sheet = sheet.replace("0x00030191", device_type);
        let description = eds::keep(&eds::Eds::load(sheet.as_bytes()).unwrap().eds).unwrap();
        let mut bench = Bench::new();
        let node = NodeId::new(20).unwrap();
        bench.world.add_drive(20, order(description, &Order::new(description, node, Bitrate::M1)).unwrap()).unwrap();
        bench.run_ms(300);
        let refused = bench.write(20, 0x6003, 1, 1, 5) == Err(AbortCode::READ_ONLY);
        assert_eq!(refused, acts, "{device_type}");
        let there = i64::from(bench.read(20, 0x6003, 1) & 0xFF);
        assert_eq!(bench.write(20, 0x6003, 1, 1, there), Ok(()), "what is there changes nothing");
        assert_eq!(bench.write(20, 0x6200, 1, 1, 5), Ok(()));
        assert_eq!(bench.write(20, 0x2000, 0, 1, 5), Ok(()), "the maker's own are stored and answered");
        assert_eq!(bench.world.report(20).unwrap().outputs.bits, if acts { 5 } else { 0 }, "{device_type}");
    }
}

#[test]
fn what_is_not_a_drive_is_not_moved_and_is_known_by_its_device_type() {
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    for (name, number) in [("io401", MODULE), ("encoder406", ENCODER)] {
        let (model, node) = (resolve(name).unwrap(), NodeId::new(number).unwrap());
        world.add_drive(number, order(model, &Order::new(model, node, Bitrate::M1)).unwrap()).unwrap();
        world.run_for(Duration::from_millis(300));
        let drive = Drive::new(network.node(node), model);
        let moved = block_on(&mut world, drive.move_relative(Degrees(90.0), MotionOptions::default())).unwrap();
        assert_eq!(
            moved.unwrap_err().to_string(),
            format!("node {number}: the Ferrodrive {name} is not a drive: it has nothing that moves")
        );
        let device_type = block_on(&mut world, drive.node().read::<u32>(Mux::new(0x1000, 0))).unwrap().unwrap();
        assert_eq!(device_type & 0xFFFF, if name == "io401" { 0x0191 } else { 0x0196 });
    }
}

/// What `get` says, as a page or a program reads it: channels by the objects' words, in which `set` takes them.
#[test]
fn get_has_the_analogue_channels_and_the_position_of_an_encoder() {
    let mut bench = Bench::new();
    let get = |bench: &mut Bench, node: u8| -> serde_json::Value {
        let answer = sim::command::answer(&mut bench.world, &format!("{node} get")).unwrap();
        serde_json::from_str(&answer.json).unwrap()
    };
    bench.apply(MODULE, "set 6401:02 -1200");
    bench.set(MODULE, 0x6411, 4, 2, 300);
    let mut expected = serde_json::Map::new();
    for (object, values) in [("6401", [0, -1200, 0, 0]), ("6411", [0, 0, 0, 300])] {
        for (at, value) in values.into_iter().enumerate() {
            expected.insert(format!("{object}:{:02X}", at + 1), value.into());
        }
    }
    assert_eq!(get(&mut bench, MODULE)["analogue"], serde_json::Value::Object(expected));
    turn(&mut bench, 150);
    // 2.5 turns a second of 8192 steps; both are looked at in the same moment.
    let steps = (shaft_turns(&mut bench) * 8192.0).floor().rem_euclid(8192.0 * 4096.0);
    assert_eq!(get(&mut bench, ENCODER)["position"], steps as i64);
    assert!(steps > 4096.0 && get(&mut bench, ENCODER).get("analogue").is_none());
    bench.apply(MODULE, "power off");
    bench.run_ms(10);
    assert!(get(&mut bench, MODULE).get("analogue").is_none(), "without power nothing is converted");
}
