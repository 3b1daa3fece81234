use core::fmt;

use canopen::AbortCode;

use crate::Error;

/// Why a gateway does not do what a client asks: a code of its own (CiA 309-3, internal error codes), or the node's abort code
/// (CiA 301, 7.2.4.3.17).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A code of the gateway.
    Internal(u16),
    /// What the node said, or would have: a missing answer is 0504 0000h.
    Abort(AbortCode),
}

impl Refusal {
    /// The command is not supported.
    pub const NOT_SUPPORTED: Self = Self::Internal(100);
    /// The line is not a command.
    pub const SYNTAX: Self = Self::Internal(101);
    /// The gateway cannot do it now.
    pub const STATE: Self = Self::Internal(102);
    /// No node was named, and none is set.
    pub const NO_DEFAULT_NODE: Self = Self::Internal(105);
    /// There is no such network.
    pub const NETWORK: Self = Self::Internal(106);
    /// There is no such node-ID.
    pub const NODE: Self = Self::Internal(107);
    /// A PDO has more data than a frame.
    pub const PDO_LENGTH: Self = Self::Internal(401);
}

impl From<&Error> for Refusal {
    fn from(error: &Error) -> Self {
        match error {
            Error::Aborted { code, .. } => Self::Abort(*code),
            Error::NoAnswer { .. } => Self::Abort(AbortCode(0x0504_0000)),
            Error::BadAnswer { .. } => Self::Abort(AbortCode(0x0504_0001)),
            Error::QueueFull { .. } => Self::STATE,
            _ => Self::Abort(AbortCode(0x0800_0000)),
        }
    }
}

/// The code, then what it means behind `#`, which begins a comment.
impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Abort(code) => write!(f, "0x{:08X} #{code}", code.0),
            Self::Internal(code) => {
                let text = match code {
                    100 => "request not supported",
                    101 => "syntax error",
                    102 => "request not processed due to internal state",
                    105 => "no default node set",
                    106 => "unsupported net",
                    107 => "unsupported node",
                    401 => "PDO length exceeded",
                    _ => return write!(f, "{code}"),
                };
                write!(f, "{code} #{text}")
            }
        }
    }
}
