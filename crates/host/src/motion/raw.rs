//! Frames that a session sends as they are.

use can::Frame;
use canopen::NodeId;
use cia402::object::CONTROLWORD;

use super::speed_limit::TOO_FAST;
use crate::answer::Answer;
use crate::session::SessionId;
use crate::state::Host;
use crate::work::{Asked, send};

impl Host {
    /// Sends a frame. What it may move counts as moved by this program, and is stopped with the session.
    pub(crate) fn send_frame(&mut self, session: SessionId, text: &str, (seq, answer): Asked) {
        let refused = |kind, text: String| Answer::failed(Some(seq), kind, text);
        let frame: Frame = match text.trim().parse() {
            Ok(frame) => frame,
            Err(error) => {
                let text = format!("'{text}' is not a frame: {error}; expected one such as 604#4041600000000000");
                return send(answer, refused("malformed", text));
            }
        };
        let meaning = self.inbox.trace.meaning(&frame);
        if let Some(why) = meaning.may_move() {
            if !self.setting.allow_motion {
                let text = format!(
                    "{frame} may set a drive in motion ({why}): start the studio with --allow-motion to send such frames"
                );
                return send(answer, refused("motion", text));
            }
            if self.speed_limits.contains_key(&session) {
                let text = format!(
                    "{frame} may set a drive in motion ({why}), at a speed that is not known: remove the speed limit first"
                );
                return send(answer, refused(TOO_FAST, text));
            }
            let nodes: Vec<NodeId> = match meaning.may_move_node() {
                Some(node) => vec![node],
                None => self.nodes.keys().copied().collect(),
            };
            nodes.into_iter().for_each(|node| self.network.note_moved(node, CONTROLWORD));
        }
        self.network.transmit(frame);
        send(answer, Answer::done(seq, vec![format!("sent: {meaning}")]));
    }
}
