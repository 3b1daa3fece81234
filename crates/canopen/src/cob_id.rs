use can::CanId;

use crate::AbortCode;

/// The 32-bit value of a COB-ID object: identifier plus flags. Not what stands on the wire: see [`CanId`].
///
/// Source: CiA 301, 7.5.2.5 (SYNC), 7.5.2.17 (EMCY), 7.5.2.35 and 7.5.2.37 (PDO).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CobId(pub u32);

impl CobId {
    /// Bit 31 of PDO and EMCY COB-IDs: the object does not exist / is not valid.
    pub const INVALID: u32 = 1 << 31;
    /// Bit 30 of TPDO COB-IDs: no RTR allowed.
    pub const NO_RTR: u32 = 1 << 30;
    /// Bit 30 of the SYNC and TIME COB-IDs: the device generates the message.
    pub const GENERATES: u32 = 1 << 30;
    /// Bit 31 of the TIME COB-ID: the device consumes the message.
    pub const CONSUMES: u32 = 1 << 31;
    /// Bit 29: 29-bit identifier.
    pub const EXTENDED: u32 = 1 << 29;

    /// A valid COB-ID with a standard identifier and no flags.
    pub const fn standard(id: u16) -> Self {
        Self(id as u32 & 0x7FF)
    }

    /// True if remote frames may ask for a TPDO with this COB-ID: bit 30 is not set.
    pub const fn allows_rtr(self) -> bool {
        self.0 & Self::NO_RTR == 0
    }

    /// True if the device generates the message (SYNC, TIME).
    pub const fn generates(self) -> bool {
        self.0 & Self::GENERATES != 0
    }

    /// True if the device consumes the message (TIME).
    pub const fn consumes(self) -> bool {
        self.0 & Self::CONSUMES != 0
    }

    /// False when bit 31 is set.
    pub const fn is_valid(self) -> bool {
        self.0 & Self::INVALID == 0
    }

    /// True when bit 29 is set.
    pub const fn is_extended(self) -> bool {
        self.0 & Self::EXTENDED != 0
    }

    /// The identifier on the wire.
    pub const fn can_id(self) -> CanId {
        if self.is_extended() { CanId::extended(self.0) } else { CanId::standard(self.0 as u16) }
    }

    /// Whether an object may have this COB-ID: only the base frame format is offered, so bit 29 is refused; so are
    /// restricted identifiers unless bit 31 is set.
    ///
    /// # Errors
    /// 0609 0030h.
    pub const fn check_identifier(self) -> Result<(), AbortCode> {
        if self.is_extended() || (self.is_valid() && self.is_restricted()) {
            Err(AbortCode::INVALID_VALUE)
        } else {
            Ok(())
        }
    }

    /// Whether an object with this COB-ID may take `new`: the identifier of a valid one may move only if
    /// `while_valid`. Bit 30 may change at any time.
    ///
    /// # Errors
    /// 0609 0030h.
    pub fn check_change(self, new: Self, while_valid: bool) -> Result<(), AbortCode> {
        new.check_identifier()?;
        let moves = new.can_id() != self.can_id();
        let stays_valid = self.is_valid() && new.is_valid();
        if moves && stays_valid && !while_valid { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
    }

    /// True for identifiers that no PDO, SYNC or EMCY may use. Source: CiA 301, table 41 (restricted CAN-IDs).
    pub const fn is_restricted(self) -> bool {
        if self.is_extended() {
            return false;
        }
        matches!(
            self.0 as u16 & 0x7FF,
            0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x77F | 0x780..=0x7FF
        )
    }
}
