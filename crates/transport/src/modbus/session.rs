//! The server's end of one connection or line, sans-IO: bytes in, requests out; an answer in, bytes out.

use super::adu::Adu;
use super::request::{ModbusException, RegisterAccess, RegisterAnswer};
use super::{line, mbap, pdu};

/// Address of a request to all on a serial line (serial line, 2.2).
const BROADCAST: u8 = 0;

/// What the units are reached by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusMedium {
    /// This end is the gateway to the units: one that does not exist is answered with exception 0Bh.
    Tcp,
    /// Units hear everything and keep silent if it is not for them.
    SerialLine,
}

/// One connection or line.
///
/// # Contract
/// After each [`receive`](Self::receive) take what [`next_request`](Self::next_request) gives until it gives nothing, one
/// at a time, and send what [`ModbusInquiry::respond`] appends. On a line report a silence with
/// [`handle_silence`](Self::handle_silence) while [`awaits_silence`](Self::awaits_silence), and take requests again. What
/// it keeps of the bytes is bounded by the longest request and what was received last.
#[derive(Clone, Debug)]
pub struct ModbusSession {
    input: Input,
    ready: Option<Adu>,
    over: bool,
}

#[derive(Clone, Debug)]
enum Input {
    Tcp(Vec<u8>),
    SerialLine(line::SerialLine),
}

impl ModbusSession {
    /// Nothing has been received.
    pub fn new(medium: ModbusMedium) -> Self {
        let input = match medium {
            ModbusMedium::Tcp => Input::Tcp(Vec::new()),
            ModbusMedium::SerialLine => Input::SerialLine(line::SerialLine::default()),
        };
        Self { input, ready: None, over: false }
    }

    /// Bytes arrived.
    pub fn receive(&mut self, bytes: &[u8]) {
        match &mut self.input {
            Input::Tcp(_) if self.over => {}
            Input::Tcp(input) => input.extend_from_slice(bytes),
            Input::SerialLine(line) => line.receive(bytes),
        }
    }

    /// The line has been silent for longer than it is within a frame.
    pub fn handle_silence(&mut self) {
        if let Input::SerialLine(line) = &mut self.input {
            self.ready = line.take_at_silence();
        }
    }

    /// Something came that only a silence can end.
    pub fn awaits_silence(&self) -> bool {
        matches!(&self.input, Input::SerialLine(line) if line.is_waiting())
    }

    /// What came is not Modbus: close the connection, there is no telling where the next request would begin.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// The next request that is whole. Responses of others are passed over.
    pub fn next_request(&mut self) -> Option<ModbusInquiry> {
        loop {
            let (medium, adu) = match (&mut self.input, self.ready.take()) {
                (Input::SerialLine(_), Some(ready)) => (ModbusMedium::SerialLine, ready),
                (Input::SerialLine(line), None) => (ModbusMedium::SerialLine, line.take()?),
                (Input::Tcp(_), _) if self.over => return None,
                (Input::Tcp(input), _) => match mbap::take(input) {
                    Ok(adu) => (ModbusMedium::Tcp, adu?),
                    Err(mbap::NoModbus) => {
                        self.over = true;
                        return None;
                    }
                },
            };
            if let Some(request) = pdu::parse(&adu.pdu) {
                return Some(ModbusInquiry { medium, transaction: adu.transaction, unit: adu.unit, request });
            }
        }
    }
}

/// One request of one client to one unit.
#[derive(Clone, Debug)]
pub struct ModbusInquiry {
    medium: ModbusMedium,
    transaction: u16,
    unit: u8,
    request: pdu::Request,
}

impl ModbusInquiry {
    /// Unit identifier, or address on the line.
    pub fn unit(&self) -> u8 {
        self.unit
    }

    /// Unit 0 of a serial line: a write for all units, which none of them answers.
    pub fn is_broadcast(&self) -> bool {
        self.medium == ModbusMedium::SerialLine && self.unit == BROADCAST
    }

    /// What is asked for, or what a unit answers because it cannot be understood.
    pub fn access(&self) -> &Result<RegisterAccess, ModbusException> {
        &self.request.access
    }

    /// Appends the response to `out`: nothing where the medium wants silence.
    pub fn respond(&self, answer: RegisterAnswer, out: &mut Vec<u8>) {
        let emit = |answer: &Result<_, _>, out: &mut Vec<u8>| pdu::emit(&self.request, answer, out);
        match (self.medium, answer) {
            (ModbusMedium::Tcp, answer) => {
                let answer = answer.unwrap_or(Err(ModbusException::GatewayTargetDevice));
                mbap::wrap(self.transaction, self.unit, out, |out| emit(&answer, out));
            }
            (ModbusMedium::SerialLine, Some(answer)) if !self.is_broadcast() => {
                line::wrap(self.unit, out, |out| emit(&answer, out));
            }
            (ModbusMedium::SerialLine, _) => {}
        }
    }
}
