//! Registers over Modbus TCP and RTU: another implementation as the client (tokio-modbus), and raw bytes for what a
//! well-behaved client does not send.

mod common;

use std::net::SocketAddr;

use common::{PATIENCE, soon};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio_modbus::prelude::*;
use transport::{ModbusException, ModbusRequest, ModbusServer, ModbusSpec, RegisterAccess, WallClock};

const UNIT: u8 = 7;
const REGISTERS: usize = 200;

/// Serves one unit of 200 registers, in which no value may be FFFFh.
async fn serve(place: &str, clock: &WallClock) -> ModbusServer {
    let (requests, mut incoming) = mpsc::channel::<ModbusRequest>(4);
    tokio::spawn(async move {
        let mut registers = vec![0_u16; REGISTERS];
        while let Some(request) = incoming.recv().await {
            let answer = match &request.access {
                _ if request.unit != UNIT => None,
                Err(exception) => Some(Err(*exception)),
                Ok(access) => Some(carry_out(&mut registers, access)),
            };
            request.answer(answer);
        }
    });
    ModbusServer::bind(&place.parse().unwrap(), requests, clock).await.unwrap()
}

fn carry_out(registers: &mut [u16], access: &RegisterAccess) -> Result<Vec<u16>, ModbusException> {
    let (address, count) = match access {
        RegisterAccess::Read { address, count } => (*address, usize::from(*count)),
        RegisterAccess::Write { address, words } => (*address, words.len()),
    };
    let from = usize::from(address);
    let place = registers.get_mut(from..from + count).ok_or(ModbusException::IllegalDataAddress)?;
    match access {
        RegisterAccess::Read { .. } => Ok(place.to_vec()),
        RegisterAccess::Write { words, .. } if words.contains(&0xFFFF) => Err(ModbusException::IllegalDataValue),
        RegisterAccess::Write { words, .. } => {
            place.copy_from_slice(words);
            Ok(Vec::new())
        }
    }
}

fn address(server: &ModbusServer) -> SocketAddr {
    match server.place() {
        ModbusSpec::Tcp { address } => address.parse().unwrap(),
        ModbusSpec::Rtu { .. } => panic!("serves TCP"),
    }
}

async fn client(server: &ModbusServer, unit: u8) -> tokio_modbus::client::Context {
    tcp::connect_slave(address(server), Slave(unit)).await.unwrap()
}

/// What a client of another make can do with registers, over any line.
async fn use_registers(client: &mut tokio_modbus::client::Context) {
    client.write_single_register(3, 0x1234).await.unwrap().unwrap();
    client.write_multiple_registers(4, &[1, 2, 3]).await.unwrap().unwrap();
    assert_eq!(client.read_holding_registers(2, 6).await.unwrap(), Ok(vec![0, 0x1234, 1, 2, 3, 0]));
    assert_eq!(client.read_input_registers(3, 1).await.unwrap(), Ok(vec![0x1234]));
    assert_eq!(client.read_holding_registers(0, 125).await.unwrap().unwrap().len(), 125);
    assert_eq!(client.write_multiple_registers(0, &[9; 123]).await.unwrap(), Ok(()));
    assert_eq!(client.read_holding_registers(199, 2).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(client.write_single_register(0, 0xFFFF).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
    assert_eq!(client.read_holding_registers(0, 0).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
    assert_eq!(client.read_coils(0, 1).await.unwrap(), Err(ExceptionCode::IllegalFunction));
}

#[tokio::test]
async fn a_client_of_another_make_reads_and_writes_over_tcp() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut client = client(&server, UNIT).await;
    soon(&clock, use_registers(&mut client)).await;
}

#[cfg(unix)]
#[tokio::test]
async fn a_client_of_another_make_reads_and_writes_over_a_serial_line() {
    use tokio_serial::{SerialPort, SerialStream};

    let clock = WallClock::start();
    let (theirs, ours) = SerialStream::pair().unwrap();
    let path = ours.name().unwrap();
    let _server = serve(&format!("rtu://{path}?baud=115200"), &clock).await;
    // Our end stays open beside the server's own, or the line would hang up.
    let mut client = rtu::attach_slave(theirs, Slave(UNIT));
    soon(&clock, use_registers(&mut client)).await;
    drop(ours);
}

#[tokio::test]
async fn a_unit_that_nobody_has_is_a_target_that_fails_to_respond() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    for unit in [0, 1, 255] {
        let mut client = client(&server, unit).await;
        let answer = soon(&clock, client.read_holding_registers(0, 1)).await.unwrap();
        assert_eq!(answer, Err(ExceptionCode::GatewayTargetDevice));
    }
}

#[tokio::test]
async fn clients_are_served_at_the_same_time_and_each_gets_its_own_answers() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut clients = tokio::task::JoinSet::new();
    for number in 0..20_u16 {
        let mut client = client(&server, UNIT).await;
        clients.spawn(async move {
            for value in 0..50 {
                client.write_single_register(number, value).await.unwrap().unwrap();
                assert_eq!(client.read_holding_registers(number, 1).await.unwrap(), Ok(vec![value]));
            }
        });
    }
    while let Some(ended) = soon(&clock, clients.join_next()).await {
        ended.unwrap();
    }
}

async fn raw(server: &ModbusServer, bytes: &[u8]) -> TcpStream {
    let mut stream = TcpStream::connect(address(server)).await.unwrap();
    stream.write_all(bytes).await.unwrap();
    stream
}

#[tokio::test]
async fn a_request_whose_parts_disagree_is_answered_and_the_next_one_served() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    // 10h: two registers, but two bytes; then 8000h registers and none; then a good read, all in one segment.
    let requests = [
        &[0, 1, 0, 0, 0, 9, UNIT, 0x10, 0, 0, 0, 2, 2, 0, 1][..],
        &[0, 2, 0, 0, 0, 7, UNIT, 0x10, 0, 0, 0x80, 0, 0],
        &[0, 3, 0, 0, 0, 6, UNIT, 0x03, 0, 0, 0, 1],
    ];
    let mut stream = raw(&server, &requests.concat()).await;
    let mut answers = [0; 9 + 9 + 11];
    soon(&clock, stream.read_exact(&mut answers)).await.unwrap();
    assert_eq!(answers[..9], [0, 1, 0, 0, 0, 3, UNIT, 0x90, 3]);
    assert_eq!(answers[9..18], [0, 2, 0, 0, 0, 3, UNIT, 0x90, 3]);
    assert_eq!(answers[18..], [0, 3, 0, 0, 0, 5, UNIT, 0x03, 2, 0, 0]);
}

#[tokio::test]
async fn bytes_that_are_no_modbus_end_their_connection_and_no_other() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut neighbour = client(&server, UNIT).await;
    for bytes in [
        &b"GET / HTTP/1.1\r\n\r\n"[..],
        &[0, 1, 0, 1, 0, 6, UNIT, 3, 0, 0, 0, 1],
        &[0, 1, 0, 0, 0, 0, UNIT],
        &[0, 1, 0, 0, 0, 1, UNIT],
        &[0, 1, 0, 0, 0xFF, 0xFF, UNIT, 3],
    ] {
        let mut stream = raw(&server, bytes).await;
        let mut rest = Vec::new();
        let _ = soon(&clock, stream.read_to_end(&mut rest)).await;
        assert_eq!(rest, [], "{bytes:02X?}");
    }
    assert_eq!(soon(&clock, neighbour.read_holding_registers(0, 1)).await.unwrap(), Ok(vec![0]));
}

#[tokio::test]
async fn a_client_that_leaves_in_the_middle_of_a_request_disturbs_nobody() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let request = [0, 1, 0, 0, 0, 6, UNIT, 3, 0, 0, 0, 1];
    // More clients than are served at a time, so that each has to be let go of.
    for length in (1..=request.len()).cycle().take(200) {
        drop(raw(&server, &request[..length]).await);
    }
    let mut client = client(&server, UNIT).await;
    assert_eq!(soon(&clock, client.read_holding_registers(0, 1)).await.unwrap(), Ok(vec![0]), "{PATIENCE:?}");
}

#[tokio::test]
async fn the_end_of_the_server_is_the_end_of_its_connections() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut stream = raw(&server, &[]).await;
    let mut client = client(&server, UNIT).await;
    soon(&clock, client.read_holding_registers(0, 1)).await.unwrap().unwrap();
    drop(server);
    let mut rest = Vec::new();
    let _ = soon(&clock, stream.read_to_end(&mut rest)).await;
    assert!(soon(&clock, client.read_holding_registers(0, 1)).await.is_err());
}

#[tokio::test]
async fn a_port_that_is_taken_is_refused_with_its_place() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let (requests, _incoming) = mpsc::channel::<ModbusRequest>(1);
    let refused = ModbusServer::bind(server.place(), requests, &clock).await.unwrap_err();
    assert_eq!(refused.to_string(), format!("cannot serve {}", server.place()));
}
