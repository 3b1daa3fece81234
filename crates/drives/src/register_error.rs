use canopen::AbortCode;

/// Why registers were not read or written. Nothing was stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegisterError {
    /// There is no register at one of the addresses.
    NoSuchAddress,
    /// One of the registers cannot be written.
    ReadOnly,
    /// The drive takes no writes as it is set.
    Forbidden,
    /// A value that its object does not take: the code that an SDO download of it would be aborted with.
    BadValue(AbortCode),
}

impl From<AbortCode> for RegisterError {
    fn from(code: AbortCode) -> Self {
        if code == AbortCode::READ_ONLY { Self::ReadOnly } else { Self::BadValue(code) }
    }
}
