//! Places for labels so that none covers another.

/// Gives each span (`left`, `right`, ascending by `left`) the first lane in which it overlaps no earlier one.
/// With all `most` lanes taken it shares the last.
pub(crate) fn assign(spans: &[(f64, f64)], most: usize) -> Vec<usize> {
    let mut ends: Vec<f64> = Vec::new();
    spans
        .iter()
        .map(|&(left, right)| {
            let lane = match ends.iter().position(|end| *end <= left) {
                Some(free) => free,
                None if ends.len() < most.max(1) => {
                    ends.push(f64::NEG_INFINITY);
                    ends.len() - 1
                }
                None => ends.len() - 1,
            };
            ends[lane] = right;
            lane
        })
        .collect()
}

/// Moves heights apart to at least `gap`, keeping their order and staying within `low..=high` where room allows.
pub(crate) fn spread(heights: &[f64], gap: f64, low: f64, high: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|a, b| heights[*a].total_cmp(&heights[*b]));
    let mut placed = heights.to_vec();
    let mut floor = low;
    for &i in &order {
        placed[i] = placed[i].max(floor);
        floor = placed[i] + gap;
    }
    let mut ceiling = high;
    for &i in order.iter().rev() {
        placed[i] = placed[i].min(ceiling);
        ceiling = placed[i] - gap;
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_spans_go_to_different_lanes() {
        assert_eq!(assign(&[(0.0, 10.0), (5.0, 12.0), (10.0, 20.0), (11.0, 13.0)], 3), [0, 1, 0, 2]);
        assert_eq!(assign(&[(0.0, 10.0), (1.0, 10.0), (2.0, 10.0)], 2), [0, 1, 1]);
    }

    #[test]
    fn labels_at_one_height_are_spread() {
        assert_eq!(spread(&[50.0, 50.0, 50.0], 14.0, 0.0, 100.0), [50.0, 64.0, 78.0]);
        assert_eq!(spread(&[95.0, 96.0], 14.0, 0.0, 100.0), [86.0, 100.0]);
    }
}
