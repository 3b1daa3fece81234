//! Several velocities that are joined by inertia, each with dry friction of its own.
//!
//! ```text
//! S a = push - dry * sign(a), where a velocity is zero if its friction can hold it
//! ```
//!
//! `S` is symmetric and positive definite: there is exactly one answer, the least of `a S a / 2 - push a + sum of dry |a|`.

/// Motors that one machine takes at most.
pub const MOST: usize = 7;

/// Changes of one coordinate's case before the answer is closed in on instead.
const MOST_CHANGES: usize = 64;
/// Rounds of closing in.
const MOST_ROUNDS: usize = 2000;
/// Relative change at which it is done.
const DONE: f64 = 1e-13;
/// Held up to this share over the friction, so that rounding does not let go what is just held.
const HOLDS: f64 = 1.0 + 1e-12;

/// The equations of one step.
#[derive(Debug, Clone, Copy)]
pub struct System {
    /// How many of the coordinates count.
    pub count: usize,
    /// `S`.
    pub matrix: [[f64; MOST]; MOST],
    /// What pushes each.
    pub push: [f64; MOST],
    /// What holds each.
    pub dry: [f64; MOST],
}

/// What one coordinate does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Case {
    Held,
    /// In this direction; 0 without friction, where it makes no difference.
    Slides(f64),
}

impl System {
    /// Coordinates without anything.
    pub const fn new(count: usize) -> Self {
        Self { count, matrix: [[0.0; MOST]; MOST], push: [0.0; MOST], dry: [0.0; MOST] }
    }

    /// The velocities after the step, from those before: most go on as they went.
    pub fn velocities(&self, before: &[f64; MOST]) -> [f64; MOST] {
        let mut cases = [Case::Held; MOST];
        for (i, case) in cases.iter_mut().enumerate().take(self.count) {
            if self.dry[i] == 0.0 {
                *case = Case::Slides(0.0);
            } else if before[i] != 0.0 {
                *case = Case::Slides(1_f64.copysign(before[i]));
            }
        }
        for _ in 0..MOST_CHANGES {
            let after = self.solve(&cases);
            let Some((i, case)) = self.contradiction(&cases, &after) else { return after };
            cases[i] = case;
        }
        self.close_in()
    }

    /// What dry friction gives at these velocities, positive against positive motion.
    pub fn friction(&self, after: &[f64; MOST]) -> [f64; MOST] {
        core::array::from_fn(|i| if i < self.count { self.rest(i, after) } else { 0.0 })
    }

    fn rest(&self, i: usize, after: &[f64; MOST]) -> f64 {
        self.push[i] - (0..self.count).map(|j| self.matrix[i][j] * after[j]).sum::<f64>()
    }

    /// The first coordinate whose case does not agree with the velocities, and what it is instead.
    fn contradiction(&self, cases: &[Case; MOST], after: &[f64; MOST]) -> Option<(usize, Case)> {
        (0..self.count).find_map(|i| match cases[i] {
            Case::Slides(sign) => (after[i] * sign < 0.0).then_some((i, Case::Held)),
            Case::Held => {
                let rest = self.rest(i, after);
                (rest.abs() > HOLDS * self.dry[i]).then(|| (i, Case::Slides(1_f64.copysign(rest))))
            }
        })
    }

    /// The velocities of these cases, by Cholesky's rule. Rows of what is held are those of `a = 0`.
    fn solve(&self, cases: &[Case; MOST]) -> [f64; MOST] {
        let held = |i: usize| cases[i] == Case::Held;
        let mut lower = [[0.0; MOST]; MOST];
        let mut x = [0.0; MOST];
        for i in 0..self.count {
            for j in 0..=i {
                let entry = match (held(i) || held(j), i == j) {
                    (true, true) => 1.0,
                    (true, false) => 0.0,
                    _ => self.matrix[i][j],
                };
                let sum = entry - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
                // Rounding may leave nothing of a coordinate without any inertia of its own.
                lower[i][j] = if i == j { libm::sqrt(sum.max(f64::MIN_POSITIVE)) } else { sum / lower[j][j] };
            }
            let push = match cases[i] {
                Case::Held => 0.0,
                Case::Slides(sign) => self.push[i] - self.dry[i] * sign,
            };
            x[i] = (push - (0..i).map(|k| lower[i][k] * x[k]).sum::<f64>()) / lower[i][i];
        }
        for i in (0..self.count).rev() {
            x[i] = (x[i] - (i + 1..self.count).map(|k| lower[k][i] * x[k]).sum::<f64>()) / lower[i][i];
        }
        for (i, x) in x.iter_mut().enumerate().take(self.count) {
            if held(i) {
                *x = 0.0;
            }
        }
        x
    }

    /// One coordinate after the other to where it is best while the others stay: always goes to the answer, if slowly.
    #[cold]
    fn close_in(&self) -> [f64; MOST] {
        let mut after = [0.0; MOST];
        for _ in 0..MOST_ROUNDS {
            let (mut change, mut size) = (0.0, 0.0_f64);
            for i in 0..self.count {
                let own = self.matrix[i][i];
                let push = self.rest(i, &after) + own * after[i];
                let best = (push.abs() - self.dry[i]).max(0.0).copysign(push) / own;
                change += (best - after[i]).abs();
                size += best.abs();
                after[i] = best;
            }
            if change <= DONE * size {
                break;
            }
        }
        after
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]

        /// Both ways lead to the one answer, and the answer is one: friction opposes what moves and holds what stands.
        #[test]
        fn the_answer_fulfils_the_equations(
            entries in prop::collection::vec(-1.0..1.0_f64, 49),
            push in prop::collection::vec(-3.0..3.0_f64, 7),
            dry in prop::collection::vec(0.0..2.0_f64, 7),
            before in prop::collection::vec(-1.0..1.0_f64, 7),
            count in 1..=7_usize,
        ) {
            let mut system = System::new(count);
            for i in 0..count {
                for j in 0..count {
                    // A A' + 1 is positive definite.
                    let product: f64 = (0..7).map(|k| entries[7 * i + k] * entries[7 * j + k]).sum();
                    system.matrix[i][j] = product + f64::from(u8::from(i == j)) * 0.1;
                }
                (system.push[i], system.dry[i]) = (push[i], if dry[i] < 0.3 { 0.0 } else { dry[i] });
            }
            let before: [f64; MOST] = core::array::from_fn(|i| before[i]);
            let after = system.velocities(&before);
            let friction = system.friction(&after);
            for i in 0..count {
                prop_assert!(friction[i].abs() <= system.dry[i] + 1e-9, "{i}: {friction:?}");
                prop_assert!(after[i] == 0.0 || (friction[i] - system.dry[i].copysign(after[i])).abs() < 1e-9, "{i}");
            }
            let closed_in = system.close_in();
            for i in 0..count {
                prop_assert!((after[i] - closed_in[i]).abs() < 1e-6 * (1.0 + after[i].abs()), "{after:?} {closed_in:?}");
            }
        }
    }
}
