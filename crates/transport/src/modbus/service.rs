//! What a request of a client becomes: a question to whoever has the registers, and the response to its answer.

use std::future::Future;
use std::pin::Pin;

use tokio::sync::{OwnedSemaphorePermit, mpsc, oneshot};
use tokio_modbus::server::Service;
use tokio_modbus::{ExceptionCode, Request, Response, SlaveRequest};

use super::{ModbusRequest, RegisterAccess};

/// Most registers of one read (application protocol, 6.3).
const MAX_READ: u16 = 125;
/// Most registers of one write (application protocol, 6.12).
const MAX_WRITTEN: usize = 123;
/// Address of a request to all on a serial line.
const BROADCAST: u8 = 0;

/// Serves one client, or one line.
pub(super) struct Registers<T> {
    pub(super) requests: mpsc::Sender<T>,
    pub(super) medium: Medium,
    /// The place among the clients, for as long as this one is served.
    pub(super) _place: Option<OwnedSemaphorePermit>,
}

/// What the units are reached by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Medium {
    /// This end is the gateway to the units: one that nobody has is told.
    Tcp,
    /// Units hear everything and keep silent if it is not for them.
    SerialLine,
}

impl<T: From<ModbusRequest> + Send + 'static> Service for Registers<T> {
    type Request = SlaveRequest<'static>;
    type Response = Option<Response>;
    type Exception = ExceptionCode;
    type Future = Pin<Box<dyn Future<Output = Result<Option<Response>, ExceptionCode>> + Send>>;

    fn call(&self, request: SlaveRequest<'static>) -> Self::Future {
        let SlaveRequest { slave: unit, request } = request;
        let (requests, medium) = (self.requests.clone(), self.medium);
        Box::pin(async move {
            let broadcast = medium == Medium::SerialLine && unit == BROADCAST;
            let (answer, answered) = oneshot::channel();
            let asked = ModbusRequest { unit, broadcast, access: access(&request), answer };
            // Who had the registers may be gone.
            let _ = requests.send(asked.into()).await;
            match answered.await.unwrap_or(Some(Err(ExceptionCode::ServerDeviceFailure))) {
                _ if broadcast => Ok(None),
                Some(result) => result.map(|words| Some(response(&request, words))),
                None if medium == Medium::Tcp => Err(ExceptionCode::GatewayTargetDevice),
                None => Ok(None),
            }
        })
    }
}

/// What a request wants of the registers.
///
/// # Errors
/// The exception to answer: 01 for another function, 03 for a quantity that no request may have.
fn access(request: &Request<'_>) -> Result<RegisterAccess, ExceptionCode> {
    match request {
        Request::ReadHoldingRegisters(address, count) | Request::ReadInputRegisters(address, count) => {
            let read = RegisterAccess::Read { address: *address, count: *count };
            (1..=MAX_READ).contains(count).then_some(read).ok_or(ExceptionCode::IllegalDataValue)
        }
        Request::WriteSingleRegister(address, word) => {
            Ok(RegisterAccess::Write { address: *address, words: vec![*word] })
        }
        Request::WriteMultipleRegisters(address, words) => {
            let write = RegisterAccess::Write { address: *address, words: words.to_vec() };
            (1..=MAX_WRITTEN).contains(&words.len()).then_some(write).ok_or(ExceptionCode::IllegalDataValue)
        }
        _ => Err(ExceptionCode::IllegalFunction),
    }
}

/// The response to a request that [`access`] understood: with the words read, or to a write its beginning.
fn response(request: &Request<'_>, read: Vec<u16>) -> Response {
    match request {
        Request::ReadInputRegisters(..) => Response::ReadInputRegisters(read),
        Request::WriteSingleRegister(address, word) => Response::WriteSingleRegister(*address, *word),
        Request::WriteMultipleRegisters(address, words) => {
            Response::WriteMultipleRegisters(*address, words.len() as u16)
        }
        _ => Response::ReadHoldingRegisters(read),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_that_no_request_may_have_are_illegal_values() {
        for count in [0, 126, u16::MAX] {
            assert_eq!(access(&Request::ReadHoldingRegisters(0, count)), Err(ExceptionCode::IllegalDataValue));
            assert_eq!(access(&Request::ReadInputRegisters(0, count)), Err(ExceptionCode::IllegalDataValue));
        }
        for count in [0, 124] {
            let request = Request::WriteMultipleRegisters(0, vec![0; count].into());
            assert_eq!(access(&request), Err(ExceptionCode::IllegalDataValue));
        }
        let read = RegisterAccess::Read { address: 0x6B, count: 125 };
        assert_eq!(access(&Request::ReadInputRegisters(0x6B, 125)), Ok(read));
    }

    #[test]
    fn what_no_register_is_for_is_an_illegal_function() {
        let others = [
            Request::ReadCoils(0, 1),
            Request::WriteSingleCoil(0, true),
            Request::ReportServerId,
            Request::MaskWriteRegister(0, 0, 0),
            Request::ReadWriteMultipleRegisters(0, 1, 0, vec![0].into()),
            Request::Custom(0x41, vec![].into()),
        ];
        for request in others {
            assert_eq!(access(&request), Err(ExceptionCode::IllegalFunction), "{request:?}");
        }
    }
}
