//! Thinning of long traces: the lowest and the highest point of each pixel column.

/// Points in pixels, thinned to at most two for each column of one pixel width. `points` ascend in x.
pub(crate) fn thin(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut thinned = Vec::new();
    let mut column: Option<PixelColumn> = None;
    for point in points {
        match &mut column {
            Some(open) if open.number == point.0.floor() as i64 => open.add(point),
            _ => {
                if let Some(done) = column.replace(PixelColumn::new(point)) {
                    done.emit(&mut thinned);
                }
            }
        }
    }
    if let Some(done) = column {
        done.emit(&mut thinned);
    }
    thinned
}

struct PixelColumn {
    number: i64,
    lowest: (f64, f64),
    highest: (f64, f64),
}

impl PixelColumn {
    fn new(point: (f64, f64)) -> Self {
        Self { number: point.0.floor() as i64, lowest: point, highest: point }
    }

    fn add(&mut self, point: (f64, f64)) {
        if point.1 < self.lowest.1 {
            self.lowest = point;
        }
        if point.1 > self.highest.1 {
            self.highest = point;
        }
    }

    fn emit(&self, out: &mut Vec<(f64, f64)>) {
        let (earlier, later) =
            if self.lowest.0 <= self.highest.0 { (self.lowest, self.highest) } else { (self.highest, self.lowest) };
        for point in [earlier, later] {
            if out.last() != Some(&point) {
                out.push(point);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_inside_one_column_survives() {
        let points = (0..1000).map(|i| (f64::from(i) * 0.01, if i == 505 { 9.0 } else { 1.0 }));
        let thinned = thin(points);
        assert!(thinned.len() < 20, "{} points", thinned.len());
        assert!(thinned.iter().any(|point| point.1 == 9.0));
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [(0.0, 1.0), (10.0, 2.0), (20.0, 0.0)];
        assert_eq!(thin(points), points);
        assert_eq!(thin([]), []);
    }
}
