//! What the user asked for over time, read from the datagrams that ask for it; for the picture.

use can::Instant;

/// Which quantity a set-point is of.
#[derive(Clone, Copy)]
pub(super) enum Axis {
    Position,
    Velocity,
    Current,
}

/// Set-points over time, s: steps, with a point that is not a number where there is none.
pub(super) struct SetPoints {
    lines: [Vec<(f64, f64)>; 3],
    /// Counts of 60FFh in 1 r/min (202F:05).
    pub(super) counts_per_rpm: f64,
}

impl Default for SetPoints {
    fn default() -> Self {
        Self { lines: Default::default(), counts_per_rpm: 1.0 }
    }
}

impl SetPoints {
    /// The steps of one quantity.
    pub(super) fn line(&self, axis: Axis) -> Vec<(f64, f64)> {
        self.lines[axis as usize].clone()
    }

    /// A new set-point; those of the other quantities end.
    pub(super) fn set(&mut self, axis: Axis, value: f64, now: Instant) {
        for other in [Axis::Position, Axis::Velocity, Axis::Current] {
            let value = if other as usize == axis as usize { value } else { f64::NAN };
            self.push(other, value, now);
        }
    }

    /// No set-point from here on.
    pub(super) fn end(&mut self, now: Instant) {
        for axis in [Axis::Position, Axis::Velocity, Axis::Current] {
            self.push(axis, f64::NAN, now);
        }
    }

    /// Reads an SDO request.
    pub(super) fn note(&mut self, request: &[u8], now: Instant) {
        let mut padded = [0; 8];
        padded.iter_mut().zip(request).for_each(|(to, from)| *to = *from);
        let [command, low, high, _, data @ ..] = padded;
        if command >> 5 != 1 {
            return;
        }
        match u16::from_le_bytes([low, high]) {
            0x60FF => self.set(Axis::Velocity, f64::from(i32::from_le_bytes(data)) / self.counts_per_rpm, now),
            0x6071 => self.set(Axis::Current, f64::from(i16::from_le_bytes([data[0], data[1]])) * 1e-3, now),
            // A change of mode, power off, quick stop, fault reset.
            0x6060 => self.end(now),
            0x6040 if data[0] & 0x0F != 0x0F => self.end(now),
            _ => {}
        }
    }

    fn push(&mut self, axis: Axis, value: f64, now: Instant) {
        let line = &mut self.lines[axis as usize];
        let t_s = now.as_secs_f64();
        let before = line.last().map_or(f64::NAN, |point| point.1);
        if before.is_nan() && value.is_nan() {
            return;
        }
        if !before.is_nan() {
            line.push((t_s, before));
        }
        line.push((t_s, value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_points_are_steps_that_end_with_the_mode() {
        let mut set_points = SetPoints::default();
        let at = Instant::from_secs;
        set_points.note(&[0x23, 0xFF, 0x60, 0, 100, 0, 0, 0], at(1));
        set_points.note(&[0x40, 0xFF, 0x60, 0, 0, 0, 0, 0], at(2));
        set_points.note(&[0x2F, 0x60, 0x60, 0, 1, 0, 0, 0], at(3));
        set_points.end(at(4));
        let line = set_points.line(Axis::Velocity);
        assert_eq!(line[..2], [(1.0, 100.0), (3.0, 100.0)]);
        assert!(line[2].1.is_nan() && line.len() == 3);
        assert!(set_points.line(Axis::Current).is_empty());
    }
}
