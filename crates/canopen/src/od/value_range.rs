/// Smallest and largest value that an object accepts, both included. The builders of [`Entry`](super::Entry) take them
/// as the type has them; for whole numbers that `i64` holds the first form is enough, UNSIGNED64 included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueRange {
    /// Of a whole number.
    Integer(i64, i64),
    /// Of an UNSIGNED64 beyond the largest `i64`.
    Unsigned(u64, u64),
    /// Of a REAL32 or REAL64.
    Real(f64, f64),
}

impl ValueRange {
    /// As whole numbers that `i64` holds; what is larger is cut to the largest. `None` for reals.
    pub const fn integers(self) -> Option<(i64, i64)> {
        match self {
            Self::Integer(min, max) => Some((min, max)),
            Self::Unsigned(min, max) => Some((cut(min), cut(max))),
            Self::Real(..) => None,
        }
    }
}

const fn cut(value: u64) -> i64 {
    if value > i64::MAX as u64 { i64::MAX } else { value as i64 }
}
