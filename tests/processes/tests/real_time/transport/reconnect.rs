//! Connections that are lost and come back: a server that is restarted, an adapter that is unplugged, a peer that reads no more.

use std::net::SocketAddr;

use super::{frame, heard, hub, socketcand_port, soon};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use transport::{AnyBus, AsyncBus, BusError, BusSpec, Hub, HubOptions, Note, Received, WallClock};

async fn open(place: &str, clock: &WallClock) -> Result<AnyBus, BusError> {
    place.parse::<BusSpec>().unwrap().open(clock).await
}

/// The next note of a bus on which no frame is sent.
async fn note(bus: &mut AnyBus, clock: &WallClock) -> Note {
    match soon(clock, bus.recv()).await.unwrap().1 {
        Received::Note(note) => note,
        Received::Frame(frame) => panic!("heard {frame}"),
    }
}

async fn lost(bus: &mut AnyBus, clock: &WallClock) -> String {
    match note(bus, clock).await {
        Note::ConnectionLost { reason } => reason,
        other => panic!("{other}"),
    }
}

/// The port of a hub that has gone, once it can be listened at again.
async fn hub_at(place: &str, clock: &WallClock) -> Hub {
    loop {
        match Hub::bind(&[place.parse().unwrap()], HubOptions::default(), clock).await {
            Ok(hub) => return hub,
            Err(_) => clock.sleep(std::time::Duration::from_millis(20)).await,
        }
    }
}

#[tokio::test]
async fn a_socketcand_server_that_is_started_again_is_found_again() {
    let clock = WallClock::start();
    let server = hub(&clock).await;
    let address = socketcand_port(&server);
    let mut bus = open(&format!("socketcand://{address}/can0"), &clock).await.unwrap();
    drop(server);
    let reason = lost(&mut bus, &clock).await;
    assert!(reason.contains(&address.to_string()), "{reason}");
    // Frames are lost in the meantime, without blocking.
    soon(&clock, bus.send(&frame("601#40"))).await.unwrap();
    let place = format!("socketcand://{address}");
    let (mut server, back) = tokio::join!(soon(&clock, hub_at(&place, &clock)), note(&mut bus, &clock));
    assert_eq!(back, Note::ConnectionBack);
    bus.send(&frame("602#41")).await.unwrap();
    assert_eq!(heard(&mut server, &clock).await, frame("602#41"));
    server.send(&frame("582#43")).await.unwrap();
    assert_eq!(heard(&mut bus, &clock).await, frame("582#43"));
}

#[tokio::test]
async fn what_is_not_there_at_the_start_is_an_error_at_once() {
    let clock = WallClock::start();
    let free = TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
    for place in [format!("socketcand://{free}/can0"), format!("slcan://{free}")] {
        let error = soon(&clock, open(&place, &clock)).await.unwrap_err().to_string();
        assert!(error.contains("cannot connect to 127.0.0.1:") && error.contains("is the server running"), "{error}");
    }
    let error = open("slcan:///dev/ttyNoSuchAdapter", &clock).await.unwrap_err().to_string();
    assert!(error.contains("/dev/ttyNoSuchAdapter") && error.contains("is the adapter plugged in?"), "{error}");
    let error = open("slcan:///dev/null", &clock).await.unwrap_err().to_string();
    assert!(error.contains("is it a serial device"), "{error}");
}

/// An adapter as far as hosts ask it: answers each line, and keeps those that are not frames. Ends when `frames` frames have come,
/// or with the connection.
async fn adapter<S: AsyncReadExt + AsyncWriteExt + Unpin>(line: &mut S, frames: usize) -> (String, Vec<String>) {
    let (mut received, mut sent, mut command) = (String::new(), Vec::new(), Vec::new());
    while sent.len() < frames {
        let Ok(byte) = line.read_u8().await else { break };
        if byte != b'\r' {
            command.push(byte);
            continue;
        }
        let text = String::from_utf8(std::mem::take(&mut command)).unwrap();
        let answer = match text.as_bytes().first() {
            Some(b'V') => "V1013\r",
            Some(b'F') => "F00\r",
            Some(b't') => "z\r",
            _ => "\r",
        };
        match text.starts_with('t') {
            true => sent.push(text),
            false => received.push_str(&format!("{text} ")),
        }
        if line.write_all(answer.as_bytes()).await.is_err() {
            break;
        }
    }
    (received, sent)
}

#[tokio::test]
async fn the_bit_rate_is_selected_again_when_an_adapter_behind_tcp_is_back() {
    let clock = WallClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let place = format!("slcan://{}?bitrate=250k", listener.local_addr().unwrap());
    let first = async {
        let (mut line, _) = listener.accept().await.unwrap();
        adapter(&mut line, 1).await
    };
    let host = async {
        let mut bus = open(&place, &clock).await.unwrap();
        bus.send(&frame("601#01")).await.unwrap();
        bus
    };
    let ((received, sent), mut bus) = soon(&clock, async { tokio::join!(first, host) }).await;
    assert_eq!((received.as_str(), sent), ("  C V S5 O F ", vec!["t601101".to_owned()]));
    lost(&mut bus, &clock).await;
    let second = async {
        let (mut line, _) = listener.accept().await.unwrap();
        adapter(&mut line, 1).await
    };
    let host = async {
        assert_eq!(note(&mut bus, &clock).await, Note::ConnectionBack);
        bus.send(&frame("601#02")).await.unwrap();
    };
    let ((received, sent), ()) = soon(&clock, async { tokio::join!(second, host) }).await;
    assert_eq!((received.as_str(), sent), ("  C V S5 O F ", vec!["t601102".to_owned()]));
}

#[tokio::test]
async fn an_adapter_that_answers_nonsense_or_no_is_distinguished() {
    let clock = WallClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let asked = async |answer: &'static [u8], place: String| {
        let peer = async {
            let (mut line, _) = listener.accept().await.unwrap();
            let mut sink = [0; 64];
            while line.read(&mut sink).await.is_ok_and(|read| read > 0) && line.write_all(answer).await.is_ok() {}
        };
        let host = async { open(&place, &clock).await.map(drop).unwrap_err().to_string() };
        soon(&clock, async { tokio::join!(peer, host) }).await.1
    };
    let error = asked(b"< hi >", format!("slcan://{address}")).await;
    assert!(error.contains("does not answer: waited for an answer to V or O; is it a slcan peer?"), "{error}");
    let error = asked(b"\x07", format!("slcan://{address}?bitrate=1M")).await;
    assert!(error.contains("refused 'S8': the adapter does not offer this bit rate"), "{error}");
    let error = asked(b"\x07", format!("slcan://{address}")).await;
    assert!(error.contains("refused 'O': select a bit rate with ?bitrate=500k"), "{error}");
    let error = asked(b"V1013\r", format!("socketcand://{address}/can0")).await;
    assert!(error.contains("does not answer: waited for < hi >; is it a socketcand peer?"), "{error}");
}

/// A million bytes without an end of line, half a frame, and then a frame.
#[tokio::test]
async fn noise_costs_itself_and_is_reported() {
    let clock = WallClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let place = format!("slcan://{}", listener.local_addr().unwrap());
    let peer = async {
        let (mut line, _) = listener.accept().await.unwrap();
        let (received, _) = adapter(&mut line, 1).await;
        assert_eq!(received, "  C V O F ");
        line.write_all(&vec![b'x'; 1_000_000]).await.unwrap();
        line.write_all(b"\rt18421\rt18420102\r").await.unwrap();
        line
    };
    let host = async {
        let mut bus = open(&place, &clock).await.unwrap();
        bus.send(&frame("601#01")).await.unwrap();
        let notes = [note(&mut bus, &clock).await, note(&mut bus, &clock).await].map(|note| note.to_string());
        assert!(notes[0].contains("line longer than 64 characters"), "{notes:?}");
        assert!(notes[1].contains("'t18421': expected tIIIL"), "{notes:?}");
        assert_eq!(heard(&mut bus, &clock).await, frame("184#0102"));
    };
    soon(&clock, async { tokio::join!(peer, host) }).await;
}

/// Two connections of a server that takes the greeting of slcan and then reads no more.
#[tokio::test]
async fn a_peer_that_reads_no_more_is_given_up_and_tried_again() {
    let clock = WallClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address: SocketAddr = listener.local_addr().unwrap();
    let deaf: std::cell::RefCell<Vec<TcpStream>> = std::cell::RefCell::default();
    let peer = async {
        loop {
            let (mut line, _) = listener.accept().await.unwrap();
            adapter(&mut line, 1).await;
            deaf.borrow_mut().push(line);
        }
    };
    let host = async {
        let mut bus = open(&format!("slcan://{address}"), &clock).await.unwrap();
        let full = frame("601#1122334455667788");
        // What the system buffers is filled first; nothing of it grows.
        let reason = loop {
            bus.send(&full).await.unwrap();
            if let Some(Ok((_, Received::Note(Note::ConnectionLost { reason })))) = now(bus.recv()).await {
                break reason;
            }
        };
        // It answers no question either, which may be noticed first. Where this program gets no processor time for seconds, the system
        // gives the connection up before.
        let given_up = ["takes nothing: what was to be sent has waited for 1 s", "says nothing any more", "timed out"];
        assert!(given_up.iter().any(|words| reason.contains(words)), "{reason}");
        assert_eq!(note(&mut bus, &clock).await, Note::ConnectionBack);
    };
    tokio::select! {
        () = peer => unreachable!("listens for ever"),
        () = soon(&clock, host) => {}
    }
}

/// The output of a future that is ready.
async fn now<T>(future: impl Future<Output = T>) -> Option<T> {
    tokio::select! {
        biased;
        output = future => Some(output),
        () = std::future::ready(()) => None,
    }
}

#[cfg(unix)]
mod on_a_tty {
    use std::os::unix::fs::symlink;
    use std::path::{Path, PathBuf};

    use tokio_serial::{SerialPort, SerialStream};

    use super::*;

    /// An adapter's end of a line, whose host's end has the name `link`, as udev gives one.
    fn plug_in(link: &Path) -> SerialStream {
        let (adapter, host) = SerialStream::pair().unwrap();
        symlink(host.name().unwrap(), link).unwrap();
        adapter
    }

    fn link(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("ferrodrive-tty-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    /// As [`adapter`], one that waits for its host: until the other end is open, reading a line fails.
    async fn patient_adapter(line: &mut SerialStream, clock: &WallClock) -> (String, Vec<String>) {
        loop {
            let (received, sent) = adapter(line, 1).await;
            if !received.is_empty() {
                return (received, sent);
            }
            clock.sleep(std::time::Duration::from_millis(5)).await;
        }
    }

    #[tokio::test]
    async fn an_adapter_that_is_unplugged_and_back_goes_on() {
        let clock = WallClock::start();
        let link = link("unplugged");
        let mut line = plug_in(&link);
        let place = format!("slcan://{}?bitrate=500k", link.display());
        let host = async {
            let mut bus = open(&place, &clock).await.unwrap();
            bus.send(&frame("601#01")).await.unwrap();
            bus
        };
        let ((received, sent), mut bus) =
            soon(&clock, async { tokio::join!(patient_adapter(&mut line, &clock), host) }).await;
        assert_eq!((received.as_str(), sent), ("  C V S6 O F ", vec!["t601101".to_owned()]));
        // Unplugged: the device and its name go.
        drop(line);
        std::fs::remove_file(&link).unwrap();
        let reason = lost(&mut bus, &clock).await;
        assert!(reason.contains("ferrodrive-tty-"), "{reason}");
        soon(&clock, bus.send(&frame("601#02"))).await.unwrap();
        assert!(now(bus.recv()).await.is_none(), "there is nothing to come back to");
        let mut line = plug_in(&link);
        let host = async {
            assert_eq!(note(&mut bus, &clock).await, Note::ConnectionBack);
            bus.send(&frame("601#03")).await.unwrap();
        };
        let ((received, sent), ()) =
            soon(&clock, async { tokio::join!(patient_adapter(&mut line, &clock), host) }).await;
        assert_eq!((received.as_str(), sent), ("  C V S6 O F ", vec!["t601103".to_owned()]));
        line.write_all(b"t583101\r").await.unwrap();
        assert_eq!(heard(&mut bus, &clock).await, frame("583#01"));
        std::fs::remove_file(&link).unwrap();
    }

    #[tokio::test]
    async fn an_adapter_that_hangs_is_given_up() {
        let clock = WallClock::start();
        let link = link("hangs");
        let mut line = plug_in(&link);
        let place = format!("slcan://{}", link.display());
        let host = async {
            let mut bus = open(&place, &clock).await.unwrap();
            bus.send(&frame("601#00")).await.unwrap();
            bus
        };
        let (_, mut bus) = soon(&clock, async { tokio::join!(patient_adapter(&mut line, &clock), host) }).await;
        let reason = soon(&clock, async {
            loop {
                bus.send(&frame("601#1122334455667788")).await.unwrap();
                match now(bus.recv()).await {
                    Some(Ok((_, Received::Note(Note::ConnectionLost { reason })))) => break reason,
                    Some(Err(error)) => panic!("{error}"),
                    _ => {}
                }
            }
        });
        let reason = reason.await;
        assert!(reason.contains("takes nothing"), "{reason}");
        std::fs::remove_file(&link).unwrap();
    }
}
