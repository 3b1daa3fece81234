//! The ASCII gateway (CiA 309-3) by a raw socket: conversations with all three drives, malformed lines, clients that go.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Stdio};

use processes::{PATIENCE, Simulator, command, done, ferrodrive, wait_until};

/// A running gateway; killed when dropped.
struct Gateway {
    child: Child,
    address: String,
    errors: BufReader<ChildStderr>,
}

impl Gateway {
    fn start(bus: &str, models: &[&str]) -> Self {
        let models: Vec<&str> = models.iter().flat_map(|model| ["--model", model]).collect();
        let arguments = [&["--bus", bus], &models[..], &["gateway", "--listen", "127.0.0.1:0"]].concat();
        let mut child = command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut ready = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
        let address = ready.trim().strip_prefix("ready gateway ").unwrap_or_else(|| panic!("{ready:?}")).to_owned();
        let errors = BufReader::new(child.stderr.take().unwrap());
        Self { child, address, errors }
    }

    fn client(&self) -> Client {
        let stream = TcpStream::connect(&self.address).unwrap();
        // The watchdog's.
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Client { lines: BufReader::new(stream.try_clone().unwrap()), stream }
    }

    /// The next line on its standard error that contains `part`.
    fn reported(&mut self, part: &str) -> String {
        loop {
            let mut line = String::new();
            assert_ne!(self.errors.read_line(&mut line).unwrap(), 0, "no {part:?} on standard error");
            if line.contains(part) {
                return line;
            }
        }
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Client {
    stream: TcpStream,
    lines: BufReader<TcpStream>,
}

impl Client {
    fn say(&mut self, line: &str) {
        self.stream.write_all(format!("{line}\r\n").as_bytes()).unwrap();
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.lines.read_line(&mut line).expect("a line in time");
        line.trim_end().to_owned()
    }

    /// The answer to a line, with what comes by itself before it passed over.
    fn ask(&mut self, line: &str) -> String {
        self.say(line);
        loop {
            let answer = self.line();
            if answer.starts_with('[') {
                return answer;
            }
        }
    }

    /// The next line that contains `part`, with others passed over.
    fn hear(&mut self, part: &str) -> String {
        loop {
            let line = self.line();
            if line.contains(part) {
                return line;
            }
        }
    }
}

const DRIVES: [&str; 6] = ["--drive", "zlac8030l@4", "--drive", "m4230e17b50@1", "--drive", "zlim42c@2"];
const MODELS: [&str; 3] = ["4=zlac8030l", "1=m4230e17b50", "2=zlim42c"];

fn simulator() -> Simulator {
    Simulator::start(&[&DRIVES[..], &["--serve", "socketcand://127.0.0.1:0"]].concat())
}

#[test]
fn objects_of_all_three_drives_are_read_and_written() {
    let simulator = simulator();
    let gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let mut client = gateway.client();
    // 1000h:00 is device profile 402 with the type of drive above it (CiA 402-1): the low half is 0192h.
    for (node, sequence) in [(4, 1), (1, 2), (2, 3)] {
        let answer = client.ask(&format!("[{sequence}] {node} r 0x1000 0 x32"));
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
        let said = client.ask(line);
        assert!(said == answer || said.starts_with(&format!("{answer} ")), "{line}: {said}");
    }
}

#[test]
fn a_client_without_a_default_node_has_to_name_one_and_each_client_has_its_own() {
    let simulator = simulator();
    let gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let (mut one, mut other) = (gateway.client(), gateway.client());
    assert_eq!(one.ask("[1] set node 4"), "[1] OK");
    assert!(one.ask("[2] r 0x1018 0 u8").starts_with("[2] "));
    assert!(other.ask("[2] r 0x1018 0 u8").starts_with("[2] ERROR: 105"), "the default of one client is not another's");
}

#[test]
fn a_line_that_is_no_command_is_a_syntax_error_and_the_next_is_obeyed() {
    let simulator = simulator();
    let gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let mut client = gateway.client();
    let long = format!("[9] 4 w 0x6083 0 u32 {}", "1".repeat(100_000));
    let rows: [(&[u8], &str); 15] = [
        (b"hello", "[0] ERROR: 101"),
        (b"r 0x1000 0 u32", "[0] ERROR: 101"),
        (b"[", "[0] ERROR: 101"),
        (b"[] start", "[0] ERROR: 101"),
        (b"[99999999999] start", "[0] ERROR: 101"),
        (b"[1] dance", "[1] ERROR: 101"),
        (b"[2] 4 r", "[2] ERROR: 101"),
        (b"[3] 4 r 0x1000 0", "[3] ERROR: 101"),
        (b"[4] 4 r 0x1000 0 u33", "[4] ERROR: 101"),
        (b"[5] 4 w 0x6083 0 u32 -1", "[5] ERROR: 101"),
        (b"[6] 4 w 0x6083 0 u32 4294967296", "[6] ERROR: 101"),
        (b"[7] 1 2 3 4 start", "[7] ERROR: 101"),
        (b"[8] 4 w 0x6083 0 vs \"open", "[8] ERROR: 101"),
        (b"[9] \xFF\xFE", "[0] ERROR: 101"),
        (long.as_bytes(), "[0] ERROR: 101"),
    ];
    for (line, answer) in rows {
        client.stream.write_all(&[line, b"\n"].concat()).unwrap();
        let said = client.hear("[");
        assert!(said.starts_with(answer), "{}: {said}", String::from_utf8_lossy(&line[..line.len().min(60)]));
    }
    // Nothing comes for an empty line and a comment; a line may come in pieces.
    client.stream.write_all(b"\r\n# a comment\n[77] 4 r 0x").unwrap();
    client.stream.write_all(b"6083 0 u32 # the default\n").unwrap();
    assert!(client.hear("[").starts_with("[77] "));
}

#[test]
fn boot_ups_emergencies_and_pdos_are_told_to_every_client() {
    let mut simulator = simulator();
    let gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let (mut one, mut other) = (gateway.client(), gateway.client());
    assert_eq!(one.ask("[1] boot_up_indication enable"), "[1] OK");
    assert_eq!(other.ask("[1] boot_up_indication disable"), "[1] OK");
    // CiA 301, 7.2.8: NMT reset node, then the boot-up message.
    assert_eq!(one.ask("[2] 2 reset node"), "[2] OK");
    assert_eq!(one.hear("BOOT_UP"), "1 2 BOOT_UP");
    // "ZLIM42C stepper CANopen" and CiA 402: a Hall or encoder fault is an EMCY; the code is in 603Fh.
    simulator.send("4 fault hall on");
    let reported = one.hear("EMCY");
    assert!(reported.starts_with("1 4 EMCY ") && reported.split(' ').count() == 10, "{reported}");
    assert_eq!(other.hear("EMCY"), reported, "every client hears it, and no boot-up where it is switched off");
    // A PDO that a client has set up: the gateway sends it, another hears it as data.
    assert_eq!(other.ask("[3] set rpdo 7 0x2FF event 2 u16 i32"), "[3] OK");
    let raw = ferrodrive(&["--bus", &simulator.bus("socketcand"), "replay", &pdo_log(), "--allow-motion"]);
    assert_eq!(raw.status, Some(0), "{}", raw.err);
    assert_eq!(other.hear("PDO"), "1 PDO 7 2 4660 -2");
    assert_eq!(other.ask("[4] r p 7"), "[4] 7 2 4660 -2");
}

/// A log with one PDO of two objects at identifier 2FFh.
fn pdo_log() -> String {
    let path = std::env::temp_dir().join(format!("ferrodrive-gateway-{}.log", std::process::id()));
    std::fs::write(&path, "(1.0) can0 2FF#3412FEFFFFFF\n").unwrap();
    path.to_str().unwrap().to_owned()
}

/// Brings a drive into motion at 60 r/min by the gateway alone (CiA 402: mode 3, shutdown, switch on, enable operation).
fn turn(client: &mut Client) {
    for (number, line) in [
        "4 start",
        "4 w 0x6060 0 i8 3",
        "4 w 0x6083 0 u32 100",
        "4 w 0x6040 0 u16 6",
        "4 w 0x6040 0 u16 7",
        "4 w 0x6040 0 u16 15",
        "4 w 0x60FF 0 i32 60",
    ]
    .iter()
    .enumerate()
    {
        assert_eq!(client.ask(&format!("[{number}] {line}")), format!("[{number}] OK"), "{line}");
    }
}

fn speed_of(simulator: &Simulator) -> f64 {
    speed_at(simulator, "4")
}

fn speed_at(simulator: &Simulator, node: &str) -> f64 {
    let control = simulator.address("control");
    done(&["--json", "world", "--control", &control, node, "get"]).json()["velocity_rpm"].as_f64().expect("a speed")
}

/// A drive that a client of a gateway has turn.
fn turning() -> (Simulator, Gateway, Client) {
    let arguments = [&DRIVES[..], &["--serve", "socketcand://127.0.0.1:0", "--control", "127.0.0.1:0"]].concat();
    let simulator = Simulator::start(&arguments);
    let gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let mut client = gateway.client();
    turn(&mut client);
    wait_until("the drive turns", || speed_of(&simulator) > 50.0);
    (simulator, gateway, client)
}

#[test]
fn a_client_that_goes_has_what_it_moved_stopped() {
    let (simulator, mut gateway, mut client) = turning();
    // Another client that has moved nothing comes and goes: the drive goes on.
    let mut looker = gateway.client();
    assert!(looker.ask("[1] 4 r 0x606C 0 i32").starts_with("[1] "));
    drop(looker);
    assert!(client.ask("[50] 4 r 0x606C 0 i32").starts_with("[50] "));
    assert!(speed_of(&simulator) > 50.0);
    drop(client);
    let reported = gateway.reported("its client has gone");
    assert!(reported.contains("node 4") && reported.contains("quick-stopped"), "{reported}");
    wait_until("the drive stands", || speed_of(&simulator).abs() < 1.0);
}

/// The joint watches for the heartbeat of its host (M joint manual, 5.11.2), which a guard sends: a client that goes takes it from no other client.
#[test]
fn a_client_that_goes_leaves_the_drives_of_another_guarded() {
    let arguments = [&DRIVES[..], &["--serve", "socketcand://127.0.0.1:0", "--control", "127.0.0.1:0"]].concat();
    let simulator = Simulator::start(&arguments);
    let mut gateway = Gateway::start(&simulator.bus("socketcand"), &MODELS);
    let (mut first, mut second) = (gateway.client(), gateway.client());
    let turn = |client: &mut Client| {
        for line in ["1 w 0x6060 0 i8 3", "1 w 0x6040 0 u16 15", "1 w 0x60FF 0 i32 30"] {
            assert_eq!(client.ask(&format!("[1] {line}")), "[1] OK", "{line}");
        }
        wait_until("the joint turns", || speed_at(&simulator, "1") > 25.0);
    };
    turn(&mut first);
    turn(&mut second);
    drop(first);
    gateway.reported("node 1: its client has gone; it has been quick-stopped");
    // A guard is given back after that, if it is.
    assert!(second.ask("[2] 1 r 0x1016 1 u32").starts_with("[2] "));
    turn(&mut second);
    gateway.child.kill().unwrap();
    wait_until("the joint stands", || speed_at(&simulator, "1").abs() < 1.0);
}

#[test]
fn a_stop_gets_in_however_many_connections_are_idle() {
    let (simulator, mut gateway, mut mover) = turning();
    // More than there are places for, and none of them ever says a word.
    let idle: Vec<Client> = (0..70).map(|_| gateway.client()).collect();
    let mut stopper = gateway.client();
    assert_eq!(stopper.ask("[1] 4 w 0x6040 0 u16 2"), "[1] OK");
    wait_until("the drive stands", || speed_of(&simulator).abs() < 1.0);
    // Who has moved a drive does not make room for who has not.
    assert!(mover.ask("[50] 4 r 0x606C 0 i32").starts_with("[50] "));
    gateway.reported("has made room");
    drop(idle);
}

#[test]
fn a_gateway_that_is_asked_to_end_stops_what_its_clients_moved() {
    let (simulator, mut gateway, mut client) = turning();
    let ended = std::process::Command::new("kill").args(["-TERM", &gateway.child.id().to_string()]).status();
    assert!(ended.is_ok_and(|status| status.success()));
    assert_eq!(gateway.child.wait().unwrap().code(), Some(143));
    wait_until("the drive stands", || speed_of(&simulator).abs() < 1.0);
    let mut rest = String::new();
    let _ = client.lines.read_to_string(&mut rest);
}

#[test]
fn a_gateway_that_cannot_serve_says_why() {
    let embedded = ferrodrive(&["gateway"]);
    assert!(embedded.status == Some(2) && embedded.err.contains("cannot serve a virtual bus"), "{}", embedded.err);
    let simulator = simulator();
    let bus = simulator.bus("socketcand");
    let first = Gateway::start(&bus, &[]);
    let second = ferrodrive(&["--bus", &bus, "gateway", "--listen", &first.address]);
    assert!(second.status == Some(1) && second.err.contains("cannot listen at"), "{}", second.err);
    // An address of no machine (RFC 5737), and a word that is none.
    let nowhere = ferrodrive(&["--bus", &bus, "gateway", "--listen", "192.0.2.1:1"]);
    assert!(nowhere.status == Some(1) && nowhere.err.contains("cannot listen at 192.0.2.1:1"), "{}", nowhere.err);
    let word = ferrodrive(&["--bus", &bus, "gateway", "--listen", "here"]);
    assert!(word.status == Some(2) && word.err.contains("expected HOST:PORT"), "{}", word.err);
}
