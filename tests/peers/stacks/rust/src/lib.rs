//! A node of other people's Rust on a socketcand server, in real time: `PROGRAM HOST PORT NODE FILE.eds` prints `running`
//! when it does, and ends with the connection.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// A frame with an identifier of 11 bits.
#[derive(Debug, PartialEq, Eq)]
pub struct Frame {
    pub id: u16,
    pub remote: bool,
    pub data: Vec<u8>,
}

/// What the program was started with.
pub struct Arguments {
    pub node: u8,
    pub eds: String,
}

/// The connection to the bus.
pub struct Hub {
    stream: TcpStream,
    text: String,
    started: Instant,
}

impl Hub {
    /// Opens the bus that the program's arguments name.
    pub fn open() -> io::Result<(Self, Arguments)> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let [host, port, node, eds] = &arguments[..] else { panic!("expected HOST PORT NODE FILE.eds") };
        let stream = TcpStream::connect(format!("{host}:{port}"))?;
        stream.set_nodelay(true)?;
        // A node of another stack lives in real time.
        stream.set_read_timeout(Some(Duration::from_millis(1)))?;
        // Its timers count from here.
        let mut hub = Self { stream, text: String::new(), started: Instant::now() };
        for command in ["< open can0 >", "< rawmode >", ""] {
            while hub.take().is_none() {
                hub.fill()?;
            }
            hub.stream.write_all(command.as_bytes())?;
        }
        Ok((hub, Arguments { node: node.parse().expect("a node-ID of 1 to 127"), eds: eds.clone() }))
    }

    /// Microseconds since the bus was opened.
    pub fn micros(&self) -> u64 {
        self.started.elapsed().as_micros() as u64
    }

    /// The next frame; none if there is none within a millisecond.
    pub fn receive(&mut self) -> io::Result<Option<Frame>> {
        if !self.text.contains('>') {
            self.fill()?;
        }
        while let Some(words) = self.take() {
            if let Some(frame) = parsed(&words) {
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    pub fn send(&mut self, id: u16, data: &[u8]) -> io::Result<()> {
        let bytes: Vec<String> = data.iter().map(|byte| format!("{byte:02X}")).collect();
        write!(self.stream, "< send {id:X} {} {} >", data.len(), bytes.join(" "))
    }

    /// Reads what is there, for a millisecond at most.
    fn fill(&mut self) -> io::Result<()> {
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => std::process::exit(0),
            Ok(count) => self.text.push_str(&String::from_utf8_lossy(&bytes[..count])),
            Err(error) if [io::ErrorKind::WouldBlock, io::ErrorKind::TimedOut].contains(&error.kind()) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// The next `< .. >`, without the brackets.
    fn take(&mut self) -> Option<String> {
        let end = self.text.find('>')?;
        let words = self.text[..end].trim_start_matches(['<', ' ']).trim().to_owned();
        self.text.drain(..=end);
        Some(words)
    }
}

/// `frame 605 12.345678 4000100000000000`, or `rtr 185 12.345678 2`.
fn parsed(words: &str) -> Option<Frame> {
    let mut words = words.split_whitespace();
    let remote = match words.next()? {
        "frame" => false,
        "rtr" => true,
        _ => return None,
    };
    let id = u16::from_str_radix(words.next()?, 16).ok()?;
    let digits = words.nth(1).filter(|_| !remote).unwrap_or_default();
    let byte = |at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let data = (0..digits.len()).step_by(2).map(byte).collect::<Option<_>>()?;
    Some(Frame { id, remote, data })
}
