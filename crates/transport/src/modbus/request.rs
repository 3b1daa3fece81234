//! What a request wants, and what it may be answered with.

use tokio::sync::oneshot;

/// What a request wants of the registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RegisterAccess {
    /// 03h, 04h.
    Read {
        /// First address.
        address: u16,
        /// 1 to 125 registers.
        count: u16,
    },
    /// 06h, 10h.
    Write {
        /// First address.
        address: u16,
        /// 1 to 123 words.
        words: Vec<u16>,
    },
}

/// Why a request is not carried out (application protocol, chapter 7). The value is the exception code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ModbusException {
    /// The function is not among those that are served.
    IllegalFunction = 0x01,
    /// There is no such register, or it cannot be written.
    IllegalDataAddress = 0x02,
    /// A value out of its range, or a request whose length or quantity contradicts itself.
    IllegalDataValue = 0x03,
    /// The owner of the registers failed to answer.
    ServerDeviceFailure = 0x04,
    /// No unit of this number answers behind the gateway.
    GatewayTargetDevice = 0x0B,
}

/// One request to one unit. Answer it with [`answer`](Self::answer); dropping it answers with exception 04.
#[derive(Debug)]
pub struct ModbusRequest {
    /// Unit identifier, or address on the line.
    pub unit: u8,
    /// Unit 0 of a serial line: a write for all units, which none of them answers.
    pub broadcast: bool,
    /// What is asked for, or what a unit answers because it cannot be understood.
    pub access: Result<RegisterAccess, ModbusException>,
    pub(super) answer: oneshot::Sender<RegisterAnswer>,
}

/// The words read (none after a write), or an exception; `None` if there is no such unit.
pub type RegisterAnswer = Option<Result<Vec<u16>, ModbusException>>;

impl ModbusRequest {
    /// Answers. A client that is gone meanwhile hears nothing.
    pub fn answer(self, answer: RegisterAnswer) {
        let _ = self.answer.send(answer);
    }
}
