//! Who is due next, without asking every node.

use can::Instant;

/// The deadline of each station, with the earliest at hand: a binary heap that knows everyone's place.
///
/// Stations due at the same instant come in the order of their numbers, so that runs repeat exactly.
#[derive(Clone, Debug, Default)]
pub(super) struct DueTimes {
    times: Vec<Instant>,
    heap: Vec<usize>,
    places: Vec<usize>,
}

impl DueTimes {
    /// One more station, due never.
    pub(super) fn push(&mut self) {
        let station = self.times.len();
        self.times.push(Instant::FAR_FUTURE);
        self.places.push(self.heap.len());
        self.heap.push(station);
    }

    pub(super) fn set(&mut self, station: usize, time: Instant) {
        let before = std::mem::replace(&mut self.times[station], time);
        if time < before {
            self.rise(self.places[station]);
        } else if time > before {
            self.sink(self.places[station]);
        }
    }

    /// When a station is due.
    pub(super) fn of(&self, station: usize) -> Instant {
        self.times[station]
    }

    /// The station that is due next, and when.
    pub(super) fn first(&self) -> Option<(Instant, usize)> {
        let station = *self.heap.first()?;
        Some((self.times[station], station)).filter(|(time, _)| *time != Instant::FAR_FUTURE)
    }

    fn precedes(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.heap[a], self.heap[b]);
        (self.times[a], a) < (self.times[b], b)
    }

    fn rise(&mut self, mut place: usize) {
        while place > 0 && self.precedes(place, (place - 1) / 2) {
            self.swap(place, (place - 1) / 2);
            place = (place - 1) / 2;
        }
    }

    fn sink(&mut self, mut place: usize) {
        loop {
            let mut least = place;
            for child in [2 * place + 1, 2 * place + 2] {
                if child < self.heap.len() && self.precedes(child, least) {
                    least = child;
                }
            }
            if least == place {
                return;
            }
            self.swap(place, least);
            place = least;
        }
    }

    fn swap(&mut self, a: usize, b: usize) {
        self.heap.swap(a, b);
        self.places[self.heap[a]] = a;
        self.places[self.heap[b]] = b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Prng;

    #[test]
    fn always_names_the_earliest_and_among_equals_the_lowest_number() {
        let mut prng = Prng::new(3);
        let mut due = DueTimes::default();
        let mut plain = vec![Instant::FAR_FUTURE; 130];
        (0..130).for_each(|_| due.push());
        assert_eq!(due.first(), None);
        for _ in 0..20_000 {
            let station = prng.below(130) as usize;
            let time = match prng.below(10) {
                0 => Instant::FAR_FUTURE,
                _ => Instant::from_nanos(prng.below(50)),
            };
            due.set(station, time);
            plain[station] = time;
            let expected = plain.iter().enumerate().map(|(station, time)| (*time, station)).min();
            assert_eq!(due.first(), expected.filter(|(time, _)| *time != Instant::FAR_FUTURE));
        }
    }
}
