//! A node of zencan on a socketcand server, for the conformance test: `zencan_stack HOST PORT NODE FILE.eds`.
//!
//! Nothing is added to what the library does by itself. It ends with the connection.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use zencan_node::common::NodeId;
use zencan_node::common::messages::{CanId, CanMessage};
use zencan_node::{Callbacks, Node};

mod zencan {
    zencan_node::include_modules!(ZENCAN_CONFIG);
}

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [host, port, node, _eds] = &arguments[..] else { panic!("expected HOST PORT NODE FILE.eds") };
    let mut stream = TcpStream::connect(format!("{host}:{port}"))?;
    stream.set_nodelay(true)?;
    // A node of another stack lives in real time.
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    let mut text = String::new();
    for command in ["< open can0 >", "< rawmode >"] {
        wait_for(&mut stream, &mut text)?;
        stream.write_all(command.as_bytes())?;
    }
    wait_for(&mut stream, &mut text)?;
    let raw: u8 = node.parse().expect("a node-ID");
    let id = NodeId::new(raw).expect("a node-ID of 1 to 127");
    zencan::OBJECT1018.set_serial(1);
    let mut node = Node::new(id, Callbacks::new(), &zencan::NODE_MBOX, &zencan::NODE_STATE, &zencan::OD_TABLE);
    println!("running");
    // Its timers count from here.
    let started = Instant::now();
    loop {
        receive(&mut stream, &mut text)?;
        while let Some(frame) = take(&mut text) {
            if let Some(message) = parse(&frame) {
                // What the stack does not want it gives back.
                let _ = zencan::NODE_MBOX.store_message(message);
                node.process(started.elapsed().as_micros() as u64);
            }
        }
        node.process(started.elapsed().as_micros() as u64);
        while let Some(message) = zencan::NODE_MBOX.next_transmit_message() {
            let CanId::Std(id) = message.id else { continue };
            let data: Vec<String> = message.data().iter().map(|byte| format!("{byte:02X}")).collect();
            write!(stream, "< send {id:X} {} {} >", data.len(), data.join(" "))?;
        }
    }
}

/// Waits for one `< .. >` of the server.
fn wait_for(stream: &mut TcpStream, text: &mut String) -> io::Result<()> {
    while take(text).is_none() {
        receive(stream, text)?;
    }
    Ok(())
}

fn receive(stream: &mut TcpStream, text: &mut String) -> io::Result<()> {
    let mut bytes = [0; 4096];
    match stream.read(&mut bytes) {
        Ok(0) => std::process::exit(0),
        Ok(count) => text.push_str(&String::from_utf8_lossy(&bytes[..count])),
        Err(error) if [io::ErrorKind::WouldBlock, io::ErrorKind::TimedOut].contains(&error.kind()) => {}
        Err(error) => return Err(error),
    }
    Ok(())
}

/// The next `< .. >`, without the brackets.
fn take(text: &mut String) -> Option<String> {
    let end = text.find('>')?;
    let frame = text[..end].trim_start_matches(['<', ' ']).trim().to_owned();
    text.drain(..=end);
    Some(frame)
}

/// `frame 605 12.345678 4000100000000000`.
fn parse(frame: &str) -> Option<CanMessage> {
    let mut words = frame.strip_prefix("frame ")?.split_whitespace();
    let id = CanId::Std(u16::from_str_radix(words.next()?, 16).ok()?);
    words.next()?;
    let digits = words.next().unwrap_or_default();
    if digits.starts_with(['R', 'r']) {
        return Some(CanMessage::new_rtr(id));
    }
    let data: Option<Vec<u8>> = (0..digits.len() / 2).map(|at| u8::from_str_radix(&digits[at * 2..at * 2 + 2], 16).ok()).collect();
    Some(CanMessage::new(id, &data?))
}
