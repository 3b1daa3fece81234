//! The ASCII gateway (CiA 309-3) by a raw socket: connections that end, that are idle, and an end by a signal. What is said on them is
//! asked in virtual time (`crates/master/tests/it/gateway.rs`), so is whom a client guards (`crates/host/tests/it/clients.rs`).

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Stdio};

use processes::{PATIENCE, Simulator, command, done, wait_until};

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
}

const DRIVES: [&str; 6] = ["--drive", "zlac8030l@4", "--drive", "m4230e17b50@1", "--drive", "zlim42c@2"];
const MODELS: [&str; 3] = ["4=zlac8030l", "1=m4230e17b50", "2=zlim42c"];

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
    let control = simulator.address("control");
    done(&["--json", "world", "--control", &control, "4", "get"]).json()["velocity_rpm"].as_f64().expect("a speed")
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

#[test]
fn a_stop_gets_in_however_many_connections_are_idle() {
    let (simulator, mut gateway, mut mover) = turning();
    // More than there are places for, and none of them ever says a word.
    let idle: Vec<Client> = (0..70).map(|_| gateway.client()).collect();
    let mut stopper = gateway.client();
    assert_eq!(stopper.ask("[1] 4 w 0x6040 0 u16 2"), "[1] OK");
    wait_until("the drive stands", || speed_of(&simulator).abs() < 1.0);
    // A client that has moved a drive does not make room for one that has not.
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
