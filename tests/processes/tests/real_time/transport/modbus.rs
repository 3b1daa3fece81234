//! Registers over Modbus TCP and RTU: another implementation as the client (tokio-modbus), and raw bytes for what a
//! well-behaved client does not send.

use std::net::SocketAddr;

use super::{PATIENCE, soon};
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

/// Address and PDU with the check of "MODBUS over Serial Line V1.02", 6.2.2: x^16 + x^15 + x^2 + 1, low bit first.
#[cfg(unix)]
fn line_frame(content: &[u8]) -> Vec<u8> {
    let crc = content.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 != 0 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    });
    [content, &crc.to_le_bytes()].concat()
}

#[cfg(unix)]
#[tokio::test]
async fn a_line_is_answered_by_its_unit_alone_also_after_noise() {
    use tokio_serial::{SerialPort, SerialStream};

    let clock = WallClock::start();
    let (mut theirs, ours) = SerialStream::pair().unwrap();
    let _server = serve(&format!("rtu://{}", ours.name().unwrap()), &clock).await;
    let read = |unit| line_frame(&[unit, 3, 0, 0, 0, 1]);
    let mut broken = read(UNIT);
    broken[3] ^= 1;
    // For another unit, for all, broken, and cut short: silence. Then our own: as often as a master would ask.
    for silent in [read(UNIT + 1), read(0), broken, read(UNIT)[..5].to_vec()] {
        theirs.write_all(&silent).await.unwrap();
        clock.sleep(std::time::Duration::from_millis(20)).await;
    }
    let expected = line_frame(&[UNIT, 3, 2, 0, 0]);
    let mut heard = Vec::new();
    let asked_since = clock.now();
    while heard.len() < expected.len() {
        assert!(clock.now() - asked_since < PATIENCE, "no answer");
        theirs.write_all(&read(UNIT)).await.unwrap();
        let mut bytes = [0; 64];
        tokio::select! {
            read = theirs.read(&mut bytes) => heard.extend_from_slice(&bytes[..read.unwrap()]),
            () = clock.sleep(std::time::Duration::from_millis(200)) => {}
        }
    }
    assert!(heard.chunks(expected.len()).all(|answer| answer == expected), "{heard:02X?}");
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

/// What is left of a stream until the server ends it.
async fn rest(clock: &WallClock, mut stream: TcpStream) -> Vec<u8> {
    let mut rest = Vec::new();
    let _ = soon(clock, stream.read_to_end(&mut rest)).await;
    rest
}

#[tokio::test]
async fn bytes_that_are_no_modbus_end_their_connection_and_no_other() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut neighbour = client(&server, UNIT).await;
    for bytes in [
        // Another protocol; no unit; no function; more than the 253 bytes of a request.
        &[0, 1, 0, 1, 0, 6, UNIT, 3, 0, 0, 0, 1][..],
        &[0, 1, 0, 0, 0, 0, UNIT],
        &[0, 1, 0, 0, 0, 1, UNIT],
        &[0, 1, 0, 0, 0, 255, UNIT, 3],
    ] {
        let stream = raw(&server, bytes).await;
        assert_eq!(rest(&clock, stream).await, [0_u8; 0], "{bytes:02X?}");
    }
    assert_eq!(soon(&clock, neighbour.read_holding_registers(0, 1)).await.unwrap(), Ok(vec![0]));
}

/// Requests that contradict themselves, each with the exception of "MODBUS Application Protocol Specification V1.1b3":
/// 03 for lengths and quantities (chapter 7), 01 for a function that is not served, whatever follows it.
const CONTRADICTIONS: [(&[u8], u8); 10] = [
    // 03h too short and too long.
    (&[0x03, 0, 0, 0], 3),
    (&[0x03, 0, 0, 0, 1, 0], 3),
    // 10h: two registers in two bytes, one in three, 8000h in none, 8001h in two, one in more bytes than its count.
    (&[0x10, 0, 0, 0, 2, 2, 0, 1], 3),
    (&[0x10, 0, 0, 0, 1, 3, 0, 1, 0], 3),
    (&[0x10, 0, 0, 0x80, 0, 0], 3),
    (&[0x10, 0, 0, 0x80, 1, 2, 0, 1], 3),
    (&[0x10, 0, 0, 0, 1, 2, 0, 1, 0, 1], 3),
    // 0Fh: 65,535 coils in one byte. 17h: 8001h registers in two bytes. 2Bh: cut short.
    (&[0x0F, 0, 0, 0xFF, 0xFF, 1, 0], 1),
    (&[0x17, 0, 0, 0, 1, 0, 0, 0x80, 1, 2, 0, 1], 1),
    (&[0x2B], 1),
];

#[tokio::test]
async fn requests_that_contradict_themselves_get_their_exception_and_the_connection_goes_on() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut stream = raw(&server, &[]).await;
    for (pdu, exception) in CONTRADICTIONS {
        let request = [&[0xAB, 0xCD, 0, 0, 0, 1 + pdu.len() as u8, UNIT], pdu].concat();
        stream.write_all(&request).await.unwrap();
        let mut answer = [0; 9];
        soon(&clock, stream.read_exact(&mut answer)).await.unwrap();
        assert_eq!(answer, [0xAB, 0xCD, 0, 0, 0, 3, UNIT, pdu[0] | 0x80, exception], "{pdu:02X?}");
    }
    // A response is nothing to answer.
    let response_and_read = [0, 1, 0, 0, 0, 2, UNIT, 0x83, 0, 2, 0, 0, 0, 6, UNIT, 3, 0, 0, 0, 1];
    stream.write_all(&response_and_read).await.unwrap();
    let mut answer = [0; 11];
    soon(&clock, stream.read_exact(&mut answer)).await.unwrap();
    assert_eq!(answer, [0, 2, 0, 0, 0, 5, UNIT, 3, 2, 0, 0]);
}

#[cfg(unix)]
#[tokio::test]
async fn requests_that_contradict_themselves_get_their_exception_and_the_line_goes_on() {
    use tokio_serial::{SerialPort, SerialStream};

    let clock = WallClock::start();
    let (mut theirs, ours) = SerialStream::pair().unwrap();
    let _server = serve(&format!("rtu://{}", ours.name().unwrap()), &clock).await;
    for (pdu, exception) in CONTRADICTIONS {
        theirs.write_all(&line_frame(&[&[UNIT], pdu].concat())).await.unwrap();
        let mut answer = [0; 5];
        soon(&clock, theirs.read_exact(&mut answer)).await.unwrap();
        assert_eq!(answer[..], line_frame(&[UNIT, pdu[0] | 0x80, exception]), "{pdu:02X?}");
        // The very next request is answered.
        theirs.write_all(&line_frame(&[UNIT, 3, 0, 0, 0, 1])).await.unwrap();
        let mut answer = [0; 7];
        soon(&clock, theirs.read_exact(&mut answer)).await.unwrap();
        assert_eq!(answer[..], line_frame(&[UNIT, 3, 2, 0, 0]), "{pdu:02X?}");
    }
    drop(ours);
}

#[tokio::test]
async fn of_many_clients_the_longest_idle_one_makes_room_for_the_next() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut first = client(&server, UNIT).await;
    assert!(soon(&clock, first.read_holding_registers(0, 1)).await.unwrap().is_ok());
    // As many as there are places, none of which says a word or more than half of one.
    let mut idle = Vec::new();
    for number in 0..64 {
        idle.push(raw(&server, if number % 2 == 0 { &[] } else { &[0, 1, 0] }).await);
        // A client that sends requests is not idle, however long it is connected.
        assert!(soon(&clock, first.read_holding_registers(0, 1)).await.unwrap().is_ok(), "{number}");
    }
    let mut last = client(&server, UNIT).await;
    assert!(soon(&clock, last.read_holding_registers(0, 1)).await.unwrap().is_ok());
    assert!(soon(&clock, first.read_holding_registers(0, 1)).await.unwrap().is_ok());
    // 66 came and 64 are served: the two that came first and were silent had to go, the third is still there.
    let mut idle = idle.into_iter();
    for gone in idle.by_ref().take(2) {
        assert_eq!(rest(&clock, gone).await, [0_u8; 0]);
    }
    let mut third = idle.next().unwrap();
    third.write_all(&[0, 2, 0, 0, 0, 6, UNIT, 3, 0, 0, 0, 1]).await.unwrap();
    let mut answer = [0; 11];
    soon(&clock, third.read_exact(&mut answer)).await.unwrap();
}

#[tokio::test]
async fn a_request_in_pieces_and_two_in_one_segment_are_answered() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let write = [0, 1, 0, 0, 0, 6, UNIT, 0x06, 0, 5, 0xBE, 0xEF];
    let read = [0, 2, 0, 0, 0, 6, UNIT, 0x03, 0, 5, 0, 1];
    let mut stream = raw(&server, &write[..9]).await;
    clock.sleep(std::time::Duration::from_millis(20)).await;
    stream.write_all(&[&write[9..], &read].concat()).await.unwrap();
    let mut answers = [0; 12 + 11];
    soon(&clock, stream.read_exact(&mut answers)).await.unwrap();
    assert_eq!(answers[..12], write);
    assert_eq!(answers[12..], [0, 2, 0, 0, 0, 5, UNIT, 0x03, 2, 0xBE, 0xEF]);
}

#[tokio::test]
async fn a_client_that_sends_anything_disturbs_no_other() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let mut neighbour = client(&server, UNIT).await;
    // A generator of Marsaglia's ("Xorshift RNGs", 2003), from a fixed seed.
    let mut state = 2_463_534_242_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    };
    let mut held = std::collections::VecDeque::new();
    for round in 0..300 {
        let length = next() % 40;
        let mut bytes: Vec<u8> = (0..length).map(|_| next() as u8).collect();
        // Two of three have a sound header, for another unit.
        if round % 3 != 0 {
            bytes.splice(0..0, [0, 1, 0, 0, 0, length as u8 + 1, 9, [3, 6, 0x10, 0x17][round % 4]]);
        }
        let mut stream = TcpStream::connect(address(&server)).await.unwrap();
        // It may have been ended meanwhile.
        let _ = stream.write_all(&bytes).await;
        held.push_back(stream);
        if held.len() > 20 {
            held.pop_front();
        }
        if round % 10 == 0 {
            assert_eq!(soon(&clock, neighbour.read_holding_registers(0, 1)).await.unwrap(), Ok(vec![0]), "{round}");
        }
    }
}

#[tokio::test]
async fn a_client_that_leaves_in_the_middle_of_a_request_disturbs_nobody() {
    let clock = WallClock::start();
    let server = serve("127.0.0.1:0", &clock).await;
    let request = [0, 1, 0, 0, 0, 6, UNIT, 3, 0, 0, 0, 1];
    // More clients than are served at a time, so that each has to be released.
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
