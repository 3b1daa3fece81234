//! A cubic spline through points that are not evenly spaced, at rest at both ends: position, velocity and acceleration are continuous.

/// The spline; between knots `t0` and `t1` with `h = t1 - t0`, `a = (t1 - t) / h` and `b = (t - t0) / h` it is
/// `a y0 + b y1 + ((a^3 - a) y0'' + (b^3 - b) y1'') h^2 / 6`.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    times: Vec<f64>,
    values: Vec<f64>,
    /// The second derivative at each knot.
    bends: Vec<f64>,
}

impl Spline {
    /// Through these values at these times, two or more, which rise.
    pub(super) fn new(times: &[f64], values: &[f64]) -> Self {
        let last = times.len() - 1;
        let slope = |at: usize| (values[at + 1] - values[at]) / (times[at + 1] - times[at]);
        // Row i: below[i] y''[i-1] + middle[i] y''[i] + above[i] y''[i+1] = right[i]. The first and the last state that it stands there,
        // the others that the velocity has no step.
        let (mut middle, mut right) = (vec![0.0; last + 1], vec![0.0; last + 1]);
        let above = |at: usize| if at < last { times[at + 1] - times[at] } else { 0.0 };
        let below = |at: usize| if at > 0 { times[at] - times[at - 1] } else { 0.0 };
        for at in 0..=last {
            middle[at] = 2.0 * (below(at) + above(at));
            let (before, after) = (if at > 0 { slope(at - 1) } else { 0.0 }, if at < last { slope(at) } else { 0.0 });
            right[at] = 6.0 * (after - before);
        }
        // Thomas: the diagonal dominates, so that no division is by zero.
        for at in 1..=last {
            let factor = below(at) / middle[at - 1];
            middle[at] -= factor * above(at - 1);
            right[at] -= factor * right[at - 1];
        }
        let mut bends = right;
        bends[last] /= middle[last];
        for at in (0..last).rev() {
            bends[at] = (bends[at] - above(at) * bends[at + 1]) / middle[at];
        }
        Self { times: times.to_vec(), values: values.to_vec(), bends }
    }

    /// Its value at a time; before the first knot and behind the last that of the knot.
    pub(super) fn at(&self, time_s: f64) -> f64 {
        let right = self.times.partition_point(|knot| *knot < time_s).clamp(1, self.times.len() - 1);
        let (t0, t1) = (self.times[right - 1], self.times[right]);
        let h = t1 - t0;
        let b = ((time_s - t0) / h).clamp(0.0, 1.0);
        let a = 1.0 - b;
        let bent = (a * a * a - a) * self.bends[right - 1] + (b * b * b - b) * self.bends[right];
        a * self.values[right - 1] + b * self.values[right] + bent * h * h / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_through_its_points_and_is_a_cubic_where_that_is_at_rest_at_both_ends() {
        // Two points: 3 s^2 - 2 s^3, the one cubic from rest to rest.
        let two = Spline::new(&[1.0, 3.0], &[10.0, 14.0]);
        // The same cubic with knots in between, unevenly: the spline is unique.
        let cubic = |time: f64| {
            let s = (time - 1.0) / 2.0;
            10.0 + 4.0 * s * s * (3.0 - 2.0 * s)
        };
        let times = [1.0, 1.1, 1.7, 2.0, 2.9, 3.0];
        let many = Spline::new(&times, &times.map(cubic));
        for step in 0..=40 {
            let at = 1.0 + f64::from(step) * 0.05;
            assert!((two.at(at) - cubic(at)).abs() < 1e-12, "{at}");
            assert!((many.at(at) - cubic(at)).abs() < 1e-12, "{at}");
        }
        assert_eq!((two.at(0.0), two.at(9.0)), (10.0, 14.0));
    }

    #[test]
    fn it_comes_closer_to_a_cosine_with_the_fourth_power_of_the_spacing() {
        let cosine = |time: f64| 1.0 - (core::f64::consts::TAU * time).cos();
        let worst = |knots: u32| {
            let times: Vec<f64> = (0..=knots).map(|knot| f64::from(knot) / f64::from(knots)).collect();
            let values: Vec<f64> = times.iter().map(|time| cosine(*time)).collect();
            let spline = Spline::new(&times, &values);
            let off = (0..=1000).map(|step| f64::from(step) / 1000.0).map(|at| (spline.at(at) - cosine(at)).abs());
            off.fold(0.0, f64::max)
        };
        // 5/384 h^4 max|y''''| (Hall and Meyer 1976): 1.5e-4 with 20 knots.
        let bound = 5.0 / 384.0 * core::f64::consts::TAU.powi(4) / 20.0_f64.powi(4);
        assert!(worst(20) <= bound, "{} {bound}", worst(20));
        let ratio = worst(20) / worst(40);
        assert!((14.0..18.0).contains(&ratio), "{ratio}");
    }
}
