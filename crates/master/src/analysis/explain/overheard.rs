use std::collections::BTreeMap;
use std::time::Duration;

use can::{Frame, Instant};
use canopen::NodeId;

/// What others sent while a bus was listened to, by identifier. At most one entry for each of the 2048 identifiers of the
/// base format; a frame costs a look-up.
#[derive(Clone, Debug, Default)]
pub struct Overheard {
    began: Option<Instant>,
    ended: Option<Instant>,
    by_id: BTreeMap<u16, HeardFrames>,
}

/// What was heard under one identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeardFrames {
    /// How many data frames.
    pub count: u64,
    /// When the first one came,
    pub first: Instant,
    /// and the last one.
    pub last: Instant,
    /// Longest time between two.
    pub longest_gap: Duration,
    /// How many bytes the shortest one had.
    pub shortest: u8,
    /// The bytes of the last one, the first byte lowest.
    pub bits: u64,
    /// How many bytes that has.
    pub length: u8,
}

/// CiA 301, 7.3.3: identifiers of the predefined connection set.
const NMT: u16 = 0x000;
const SYNC: u16 = 0x080;
const SDO_REQUEST: u16 = 0x600;
const HEARTBEAT: u16 = 0x700;

impl Overheard {
    /// Begins to listen.
    pub fn from(now: Instant) -> Self {
        Self { began: Some(now), ended: Some(now), by_id: BTreeMap::new() }
    }

    /// Takes a frame that another station sent. Remote and extended frames carry nothing that is looked for.
    pub fn note(&mut self, frame: &Frame, at: Instant) {
        self.until(at);
        let Some(id) = frame.standard_data_id() else { return };
        let (length, bits) = (frame.dlc(), u64::from_le_bytes(*frame.padded()));
        let new =
            HeardFrames { count: 0, first: at, last: at, longest_gap: Duration::ZERO, shortest: length, bits, length };
        let heard = self.by_id.entry(id).or_insert(new);
        heard.longest_gap = heard.longest_gap.max(at - heard.last);
        heard.count = heard.count.saturating_add(1);
        heard.shortest = heard.shortest.min(length);
        (heard.last, heard.bits, heard.length) = (at, bits, length);
    }

    /// Takes a frame that this program sent itself. Its SYNC and its PDOs are what the drive gets; its SDO requests and NMT commands are
    /// not those of another master, and are left out.
    pub fn note_own(&mut self, frame: &Frame, at: Instant) {
        let by_master = |id| id == NMT || (SDO_REQUEST + 1..=SDO_REQUEST + u16::from(NodeId::MAX.raw())).contains(&id);
        match frame.standard_data_id() {
            Some(id) if by_master(id) => self.until(at),
            _ => self.note(frame, at),
        }
    }

    /// It was listened until now.
    pub fn until(&mut self, now: Instant) {
        self.began.get_or_insert(now);
        self.ended = Some(self.ended.map_or(now, |ended| ended.max(now)));
    }

    /// How long it was listened.
    pub fn listened(&self) -> Duration {
        self.began.zip(self.ended).map_or(Duration::ZERO, |(began, ended)| ended - began)
    }

    /// What was heard under an identifier.
    pub fn under(&self, id: u16) -> Option<&HeardFrames> {
        self.by_id.get(&id)
    }

    /// SYNC under its usual identifier.
    pub fn sync(&self) -> Option<&HeardFrames> {
        self.under(SYNC)
    }

    /// NMT commands that others have sent to the node or to all; `None` if there were none.
    pub fn nmt(&self) -> Option<&HeardFrames> {
        self.under(NMT)
    }

    /// Boot-up messages and heartbeats of a node.
    pub fn heartbeats(&self, node: NodeId) -> Option<&HeardFrames> {
        self.under(HEARTBEAT + u16::from(node.raw()))
    }

    /// SDO requests to a node.
    pub fn requests(&self, node: NodeId) -> Option<&HeardFrames> {
        self.under(SDO_REQUEST + u16::from(node.raw()))
    }

    /// The longest time in which nothing came under these identifiers, the edges of the listening counted. An interval is
    /// that of the identifier that came most often: what comes between only shortens it.
    pub fn longest_silence(&self, ids: impl IntoIterator<Item = u16>) -> Duration {
        let (Some(began), Some(ended)) = (self.began, self.ended) else { return Duration::ZERO };
        let silence = |heard: &HeardFrames| heard.longest_gap.max(heard.first - began).max(ended - heard.last);
        ids.into_iter().filter_map(|id| self.under(id)).map(silence).min().unwrap_or(ended - began)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::CanId;

    fn ms(at: u64) -> Instant {
        Instant::from_millis(at)
    }

    #[test]
    fn frames_are_counted_by_identifier_with_their_gaps_and_the_last_one() {
        let mut heard = Overheard::from(ms(100));
        for (at, bytes) in [(150, &[0x06, 0x00][..]), (400, &[0x07]), (450, &[0x0F, 0x00])] {
            heard.note(&Frame::new(CanId::standard(0x204), bytes), ms(at));
        }
        heard.note(&Frame::remote(CanId::standard(0x204), 2), ms(460));
        heard.note(&Frame::new(CanId::extended(0x204), &[9]), ms(470));
        heard.until(ms(600));
        let rpdo = heard.under(0x204).unwrap();
        assert_eq!((rpdo.count, rpdo.longest_gap, rpdo.shortest), (3, Duration::from_millis(250), 1));
        assert_eq!((rpdo.bits, rpdo.length), (0x000F, 2));
        assert_eq!(heard.listened(), Duration::from_millis(500));
        assert_eq!(heard.longest_silence([0x204, 0x604]), Duration::from_millis(250));
        assert_eq!(heard.longest_silence([0x604]), Duration::from_millis(500));
        assert_eq!((heard.sync(), heard.nmt()), (None, None));
    }

    #[test]
    fn own_requests_and_commands_are_not_those_of_another_master() {
        let node = NodeId::new(4).unwrap();
        let mut heard = Overheard::from(ms(0));
        // CiA 301, 7.3.3: NMT, SYNC, RPDO1 and SDO request of node 4.
        for (id, at) in [(0x000, 10), (0x080, 20), (0x204, 30), (0x604, 40)] {
            heard.note_own(&Frame::new(CanId::standard(id), &[0, 0]), ms(at));
        }
        assert_eq!((heard.nmt(), heard.requests(node)), (None, None));
        assert!(heard.sync().is_some() && heard.under(0x204).is_some());
        assert_eq!(heard.listened(), Duration::from_millis(40));
        heard.note(&Frame::new(CanId::standard(0x604), &[0, 0]), ms(50));
        assert_eq!(heard.requests(node).map(|frames| frames.count), Some(1));
    }
}
