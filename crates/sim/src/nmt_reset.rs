//! What an NMT reset ends on the bus: answers of before it, wherever they wait for a store.
//!
//! A node that resets its communication starts its SDO server over (CiA 301, 7.3.2.2.1): an answer that it had not sent by then
//! is never sent.

use can::Frame;
use canopen::NmtCommand;
use canopen::connection_set::SDO_REPLY_BASE;
use canopen::nmt::{NmtRequest, NmtTarget};

/// Whether a frame commands the node of this node-ID to reset its communication, or itself.
pub(crate) fn is_asked_of(frame: &Frame, node: impl FnOnce() -> u8) -> bool {
    let Ok(NmtRequest { command, target }) = NmtRequest::parse(frame) else { return false };
    matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication)
        && match target {
            NmtTarget::All => true,
            NmtTarget::Node(its) => its.raw() == node(),
        }
}

/// The SDO answers of the predefined connection set (CiA 301, 7.3.5); no drive here moves them.
pub(crate) fn is_sdo_answer(frame: &Frame) -> bool {
    let id = frame.id();
    !id.is_extended() && id.raw() & !0x7F == u32::from(SDO_REPLY_BASE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_is_for_its_node_or_for_all_and_no_other_command_is_one() {
        for (frame, is_one) in [
            ("000#8105", true),
            ("000#8205", true),
            ("000#8100", true),
            ("000#8200", true),
            ("000#8106", false),
            ("000#0105", false),
            ("000#8005", false),
            ("000#81", false),
            ("705#8105", false),
        ] {
            assert_eq!(is_asked_of(&frame.parse().expect("a frame"), || 5), is_one, "{frame}");
        }
    }
}
