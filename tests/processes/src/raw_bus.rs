//! A socketcand client of the plainest kind, for what must happen at once and for what no good client does.

use std::io::{Read, Write};
use std::net::TcpStream;

use crate::PATIENCE;

/// A connection in raw mode.
pub struct RawBus {
    stream: TcpStream,
    unread: String,
}

impl RawBus {
    /// Connects to `HOST:PORT` and enters raw mode.
    pub fn connect(address: &str) -> Self {
        let stream = TcpStream::connect(address).expect("it listens");
        // The watchdog's.
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket takes a timeout");
        stream.set_nodelay(true).expect("a socket takes an option");
        let mut bus = Self { stream, unread: String::new() };
        for (request, reply) in [("", "hi"), ("< open can0 >", "ok"), ("< rawmode >", "ok")] {
            assert!(bus.say(request));
            assert_eq!(bus.message().as_deref(), Some(reply));
        }
        bus
    }

    /// Sends text as it is; false if the connection is gone.
    pub fn say(&mut self, text: &str) -> bool {
        self.stream.write_all(text.as_bytes()).is_ok()
    }

    /// What stands between the next `<` and `>`; `None` at the end of the connection.
    pub fn message(&mut self) -> Option<String> {
        loop {
            if let Some((message, rest)) = self.unread.split_once('>') {
                let message = message.trim_start_matches(['<', ' ']).trim_end().to_owned();
                self.unread = rest.to_owned();
                return Some(message);
            }
            let mut bytes = [0; 4096];
            match self.stream.read(&mut bytes) {
                Ok(length) if length > 0 => self.unread.push_str(&String::from_utf8_lossy(&bytes[..length])),
                _ => return None,
            }
        }
    }

    /// The next frame: identifier and data in hexadecimal, and how many others were heard before one with `identifier`.
    pub fn frame(&mut self, identifier: &str) -> Option<(String, usize)> {
        let mut others = 0;
        loop {
            let message = self.message()?;
            let mut words = message.split_whitespace();
            if words.next() == Some("frame") {
                if words.next() == Some(identifier) {
                    return Some((words.nth(1).unwrap_or_default().to_owned(), others));
                }
                others += 1;
            }
        }
    }

    /// An expedited SDO download of `size` bytes; the answer's data, or `None` if the connection is gone before.
    pub fn download(&mut self, node: u8, index: u16, sub_index: u8, value: u32, size: u8) -> Option<String> {
        let command = 0x23 | (4 - size) << 2;
        self.transfer(node, command, index, sub_index, value)
    }

    /// An SDO upload; the answer's data.
    pub fn upload(&mut self, node: u8, index: u16, sub_index: u8) -> Option<String> {
        self.transfer(node, 0x40, index, sub_index, 0)
    }

    fn transfer(&mut self, node: u8, command: u8, index: u16, sub_index: u8, value: u32) -> Option<String> {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        let request = 0x600 + u16::from(node);
        let sent = format!("< send {request:X} 8 {command:X} {low:X} {high:X} {sub_index:X} {a:X} {b:X} {c:X} {d:X} >");
        if !self.say(&sent) {
            return None;
        }
        self.frame(&format!("{:X}", 0x580 + u16::from(node))).map(|(data, _)| data)
    }
}
