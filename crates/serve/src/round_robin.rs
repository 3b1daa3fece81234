//! Whose frame goes next: each client one, in turn.
//!
//! However much one client sends, another waits for one frame of it and no more. Each client's frames keep their order.
//! What clients that are gone have left behind takes one turn together, so that coming back again and again gains nothing.

use std::collections::{BTreeMap, VecDeque};

use can::Frame;

/// Frames of clients that are gone; more are given up.
const MAX_LEFT_BEHIND: usize = 4096;

/// Frames that wait for the wire. `K` names a client.
#[derive(Debug)]
pub(crate) struct RoundRobin<K> {
    /// By client; under `None` what is left of those that are gone.
    waiting: BTreeMap<Option<K>, VecDeque<(K, Frame)>>,
    /// Who has frames waiting, the next first.
    order: VecDeque<Option<K>>,
}

impl<K: Copy + Ord> RoundRobin<K> {
    /// Empty.
    pub(crate) fn new() -> Self {
        Self { waiting: BTreeMap::new(), order: VecDeque::new() }
    }

    /// Nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// A frame of `client`, behind those that it has here already.
    pub(crate) fn push(&mut self, client: K, frame: Frame) {
        self.queue(Some(client)).push_back((client, frame));
    }

    /// The next frame, and whose it is.
    pub(crate) fn pop(&mut self) -> Option<(K, Frame)> {
        let turn = self.order.pop_front()?;
        let queue = self.waiting.get_mut(&turn)?;
        let next = queue.pop_front();
        if queue.is_empty() {
            // A client that stays keeps its queue's memory.
            if turn.is_none() {
                self.waiting.remove(&turn);
            }
        } else {
            self.order.push_back(turn);
        }
        next
    }

    /// `client` is gone. How many of its frames are given up: none, unless others have left too many behind.
    pub(crate) fn leave(&mut self, client: K) -> usize {
        let frames = self.waiting.remove(&Some(client)).unwrap_or_default();
        self.order.retain(|turn| *turn != Some(client));
        if frames.is_empty() {
            return 0;
        }
        let left = self.queue(None);
        let room = MAX_LEFT_BEHIND.saturating_sub(left.len());
        let given_up = frames.len().saturating_sub(room);
        left.extend(frames.into_iter().take(room));
        given_up
    }

    fn queue(&mut self, turn: Option<K>) -> &mut VecDeque<(K, Frame)> {
        let queue = self.waiting.entry(turn).or_default();
        if queue.is_empty() {
            self.order.push_back(turn);
        }
        queue
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::CanId;

    fn frame(client: u16, number: u8) -> Frame {
        Frame::new(CanId::standard(client), &[number])
    }

    fn drained(round_robin: &mut RoundRobin<u16>) -> Vec<(u16, Frame)> {
        std::iter::from_fn(|| round_robin.pop()).collect()
    }

    #[test]
    fn an_honest_client_waits_for_one_frame_of_each_flooder() {
        let mut round_robin = RoundRobin::new();
        for flooder in 1..=200 {
            (0..64).for_each(|number| round_robin.push(flooder, frame(flooder, number)));
        }
        round_robin.push(7, frame(7, 64));
        round_robin.push(999, frame(999, 0));
        let place = drained(&mut round_robin).iter().position(|(client, _)| *client == 999);
        assert_eq!(place, Some(200));
    }

    #[test]
    fn each_clients_frames_keep_their_order_and_none_is_lost() {
        let mut round_robin = RoundRobin::new();
        let mut out = Vec::new();
        for number in 0..100 {
            for client in 1..=(1 + u16::from(number) % 5) {
                round_robin.push(client, frame(client, number));
            }
            out.extend((0..2).filter_map(|_| round_robin.pop()));
        }
        out.extend(drained(&mut round_robin));
        assert_eq!(out.len(), 300);
        for client in 1..=5 {
            let numbers: Vec<u8> =
                out.iter().filter(|(of, _)| *of == client).map(|(_, frame)| frame.data()[0]).collect();
            assert!(numbers.is_sorted() && !numbers.is_empty(), "{numbers:?}");
        }
    }

    #[test]
    fn what_the_departed_leave_goes_out_in_one_turn_and_within_a_bound() {
        let mut round_robin = RoundRobin::new();
        let mut given_up = 0;
        for client in 1..=100 {
            (0..64).for_each(|number| round_robin.push(client, frame(client, number)));
            given_up += round_robin.leave(client);
        }
        assert_eq!(given_up, 100 * 64 - MAX_LEFT_BEHIND);
        round_robin.push(999, frame(999, 0));
        round_robin.push(999, frame(999, 1));
        assert_eq!(
            [round_robin.pop(), round_robin.pop(), round_robin.pop()].map(|next| next.map(|(client, _)| client)),
            [Some(1), Some(999), Some(1)]
        );
        assert_eq!(drained(&mut round_robin).len(), MAX_LEFT_BEHIND + 2 - 3);
        assert_eq!(round_robin.leave(5), 0);
    }
}
