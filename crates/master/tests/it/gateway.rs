//! A client of the ASCII gateway (CiA 309-3) against a servo, a joint and a stepper: what it says and hears, without its socket.

use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use drives::mjoint::Model;
use master::Network;
use master::gateway::Session;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{Place, StationId, Stimulus, World, block_on};

/// The value of the ZL drives' bit rate objects for 500 kbit/s.
const K500: u16 = 1;

struct Bench {
    world: World,
    network: Network,
    /// Hears what is on the bus, for the clients.
    probe: StationId,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        let joint = Model::named("m4230e17b50").unwrap();
        world.add_drive(1, Box::new(mjoint(joint, 1, Bitrate::K500))).unwrap();
        world.add_drive(2, Box::new(zlim42c(2, K500))).unwrap();
        world.add_drive(4, Box::new(zlac8030l(4, K500))).unwrap();
        world.run_until(Instant::from_secs(2));
        let probe = world.add_probe();
        Self { world, network, probe }
    }

    fn client(&self) -> Session {
        Session::new(self.network.clone())
    }

    /// The answer to a line.
    fn ask(&mut self, client: &mut Session, line: &str) -> String {
        let answer = block_on(&mut self.world, client.answer(line)).unwrap();
        let answer = answer.unwrap_or_else(|| panic!("nothing is answered to {line:?}"));
        answer.strip_suffix("\r\n").expect("a whole line").to_owned()
    }

    /// What each of these clients hears of the frames that pass within a second.
    fn hear<const N: usize>(&mut self, mut clients: [&mut Session; N]) -> [Vec<String>; N] {
        let mut heard = [const { Vec::new() }; N];
        for _ in 0..1000 {
            self.world.run_for(Duration::from_millis(1));
            while let Some((_, frame)) = self.world.poll_received(self.probe) {
                for (client, heard) in clients.iter_mut().zip(&mut heard) {
                    heard.extend(client.frame_line(&frame));
                }
            }
        }
        heard
    }
}

#[test]
fn objects_of_all_three_drives_are_read_and_written() {
    let mut bench = Bench::new();
    let mut client = bench.client();
    // 1000h:00 is device profile 402 with the type of drive above it (CiA 402-1): the low half is 0192h.
    for (node, sequence) in [(4, 1), (1, 2), (2, 3)] {
        let answer = bench.ask(&mut client, &format!("[{sequence}] {node} r 0x1000 0 x32"));
        let (number, value) = answer.split_once(' ').unwrap();
        assert_eq!(number, format!("[{sequence}]"));
        assert!(value.starts_with("0x") && value.ends_with("0192"), "node {node}: {answer}");
    }
    for (line, answer) in [
        // A value goes and comes back, in every form of number.
        ("[10] 4 w 0x6083 0 u32 750", "[10] OK"),
        ("[11] 1 4 read 0x6083 0x00 u32", "[11] 750"),
        ("[12] 4 r 24707 0 x32", "[12] 0x000002EE"),
        ("[13] set node 4", "[13] OK"),
        ("[14] r 0x6083 0 i32", "[14] 750"),
        ("[15] 4 w 0x6060 0 i8 3", "[15] OK"),
        ("[16] r 0x6061 0 i8", "[16] 3"),
        // Refused by the node: no such object, read only (CiA 301, 7.2.4.3.17).
        ("[20] 4 r 0x5FFF 0 u8", "[20] ERROR: 0x06020000"),
        ("[21] 4 w 0x6041 0 u16 0", "[21] ERROR: 0x06010002"),
        // Not as long as the type.
        ("[22] 4 r 0x6083 0 u8", "[22] ERROR: 0x06070010"),
        // Refused by the gateway.
        ("[30] 2 4 r 0x1000 0 u32", "[30] ERROR: 106"),
        ("[31] 128 r 0x1000 0 u32", "[31] ERROR: 107"),
        ("[32] 4 enable guarding 100 3", "[32] ERROR: 100"),
        ("[33] set network 2", "[33] ERROR: 106"),
        ("[34] set network 1", "[34] OK"),
        ("[35] set heartbeat 500", "[35] ERROR: 102"),
        ("[36] w p 1 1 5", "[36] ERROR: 102"),
        ("[37] set tpdo 1 0x204 event 3 u32 u32 u8", "[37] ERROR: 401"),
        // No node there: within the time that was set.
        ("[40] set sdo_timeout 50", "[40] OK"),
        ("[41] 99 r 0x1000 0 u32", "[41] ERROR: 0x05040000"),
        ("[42] info version", "[42] 0 0 0 0 2 1.1"),
    ] {
        let said = bench.ask(&mut client, line);
        assert!(said == answer || said.starts_with(&format!("{answer} ")), "{line}: {said}");
    }
}

#[test]
fn a_client_without_a_default_node_has_to_name_one_and_each_client_has_its_own() {
    let mut bench = Bench::new();
    let (mut one, mut other) = (bench.client(), bench.client());
    assert_eq!(bench.ask(&mut one, "[1] set node 4"), "[1] OK");
    let named = bench.ask(&mut one, "[2] r 0x1018 0 u8");
    assert!(named.starts_with("[2] ") && !named.contains("ERROR"), "{named}");
    let other = bench.ask(&mut other, "[2] r 0x1018 0 u8");
    assert!(other.starts_with("[2] ERROR: 105"), "the default of one client is not another's: {other}");
}

#[test]
fn a_line_that_is_no_command_is_a_syntax_error_and_the_next_is_obeyed() {
    let mut bench = Bench::new();
    let mut client = bench.client();
    for (line, answer) in [
        ("hello", "[0] ERROR: 101"),
        ("r 0x1000 0 u32", "[0] ERROR: 101"),
        ("[", "[0] ERROR: 101"),
        ("[] start", "[0] ERROR: 101"),
        ("[99999999999] start", "[0] ERROR: 101"),
        ("[1] dance", "[1] ERROR: 101"),
        ("[2] 4 r", "[2] ERROR: 101"),
        ("[3] 4 r 0x1000 0", "[3] ERROR: 101"),
        ("[4] 4 r 0x1000 0 u33", "[4] ERROR: 101"),
        ("[5] 4 w 0x6083 0 u32 -1", "[5] ERROR: 101"),
        ("[6] 4 w 0x6083 0 u32 4294967296", "[6] ERROR: 101"),
        ("[7] 1 2 3 4 start", "[7] ERROR: 101"),
        ("[8] 4 w 0x6083 0 vs \"open", "[8] ERROR: 101"),
    ] {
        let said = bench.ask(&mut client, line);
        assert!(said.starts_with(answer), "{line}: {said}");
    }
    // Nothing comes for an empty line and a comment.
    for nothing in ["", "  ", "# a comment"] {
        assert_eq!(block_on(&mut bench.world, client.answer(nothing)).unwrap(), None, "{nothing:?}");
    }
    let value = bench.ask(&mut client, "[77] 4 r 0x6083 0 u32 # the default");
    assert!(value.strip_prefix("[77] ").is_some_and(|value| value.parse::<u32>().is_ok()), "{value}");
}

#[test]
fn boot_ups_emergencies_and_pdos_are_reported_to_every_client() {
    let mut bench = Bench::new();
    let (mut one, mut other) = (bench.client(), bench.client());
    assert_eq!(bench.ask(&mut one, "[1] boot_up_indication enable"), "[1] OK");
    assert_eq!(bench.ask(&mut other, "[1] boot_up_indication disable"), "[1] OK");
    // CiA 301, 7.2.8: NMT reset node, then the boot-up message.
    assert_eq!(bench.ask(&mut one, "[2] 2 reset node"), "[2] OK");
    let [of_one, of_other] = bench.hear([&mut one, &mut other]);
    assert!(of_one.contains(&"1 2 BOOT_UP\r\n".to_owned()), "{of_one:?}");
    assert!(!of_other.iter().any(|line| line.contains("BOOT_UP")), "{of_other:?}");
    // "ZLIM42C stepper CANopen" and CiA 402: a Hall or encoder fault is an EMCY; the code is in 603Fh.
    let stimulus: Stimulus = "fault hall on".parse().unwrap();
    bench.world.apply(Place::node(4), &stimulus).unwrap().unwrap();
    let heard = bench.hear([&mut one, &mut other]);
    for heard in heard {
        let reported = heard.iter().find(|line| line.contains("EMCY")).unwrap_or_else(|| panic!("{heard:?}"));
        let fields: Vec<&str> = reported.trim_end().split(' ').collect();
        assert!(reported.starts_with("1 4 EMCY ") && fields.len() == 10, "{reported:?}");
    }
    // A PDO that a client has set up: another hears nothing of it, it hears it as data.
    assert_eq!(bench.ask(&mut other, "[3] set rpdo 7 0x2FF event 2 u16 i32"), "[3] OK");
    let pdo = Frame::new(CanId::standard(0x2FF), &[0x34, 0x12, 0xFE, 0xFF, 0xFF, 0xFF]);
    bench.network.transmit(pdo);
    let [of_one, of_other] = bench.hear([&mut one, &mut other]);
    assert!(!of_one.iter().any(|line| line.contains("PDO")), "{of_one:?}");
    assert!(of_other.contains(&"1 PDO 7 2 4660 -2\r\n".to_owned()), "{of_other:?}");
    assert_eq!(bench.ask(&mut other, "[4] r p 7"), "[4] 7 2 4660 -2");
}
