//! Nonlinear least squares of a few parameters (D. W. Marquardt, "An algorithm for least-squares estimation of nonlinear
//! parameters", SIAM Journal on Applied Mathematics 11, 1963).

/// Steps at most.
const STEPS: usize = 60;
/// Relative decrease at which it is done.
const DONE: f64 = 1e-9;
/// Relative change of a parameter for its derivative.
const NUDGE: f64 = 1e-6;

/// Moves parameters to where the sum of squared residuals is least near them, and returns that sum.
pub(crate) fn fit<const N: usize>(
    parameters: &mut [f64; N],
    mut residuals: impl FnMut(&[f64; N], &mut Vec<f64>),
) -> f64 {
    let (mut now, mut nudged) = (Vec::new(), Vec::new());
    let sum = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    residuals(parameters, &mut now);
    let mut least = sum(&now);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let mut jacobian = vec![[0.0; N]; now.len()];
        for column in 0..N {
            let mut changed = *parameters;
            let by = NUDGE * changed[column].abs().max(NUDGE);
            changed[column] += by;
            residuals(&changed, &mut nudged);
            for (row, (after, before)) in jacobian.iter_mut().zip(nudged.iter().zip(&now)) {
                row[column] = (after - before) / by;
            }
        }
        let before = least;
        // More damping is a shorter step, down along the slope.
        while damping < 1e12 {
            let Some(step) = step(&jacobian, &now, damping) else { return least };
            let candidate = core::array::from_fn(|column| parameters[column] + step[column]);
            residuals(&candidate, &mut nudged);
            let reached = sum(&nudged);
            if reached < least {
                *parameters = candidate;
                least = reached;
                core::mem::swap(&mut now, &mut nudged);
                damping = (damping * 0.2).max(1e-12);
                break;
            }
            damping *= 5.0;
        }
        if before - least <= DONE * before {
            break;
        }
    }
    least
}

/// Solves `(JᵀJ + damping diag(JᵀJ)) step = -Jᵀr`. `None` where that has no solution.
fn step<const N: usize>(jacobian: &[[f64; N]], residuals: &[f64], damping: f64) -> Option<[f64; N]> {
    let mut matrix = [[0.0; N]; N];
    let mut right = [0.0; N];
    for (row, residual) in jacobian.iter().zip(residuals) {
        for i in 0..N {
            right[i] -= row[i] * residual;
            for j in 0..N {
                matrix[i][j] += row[i] * row[j];
            }
        }
    }
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += damping * row[i] + f64::MIN_POSITIVE;
    }
    solve(matrix, right)
}

/// Elimination with pivots.
pub(crate) fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    for column in 0..N {
        let pivot = (column..N).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))?;
        if matrix[pivot][column] == 0.0 || !matrix[pivot][column].is_finite() {
            return None;
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let pivot_row = matrix[column];
        for row in column + 1..N {
            let share = matrix[row][column] / pivot_row[column];
            for (value, above) in matrix[row].iter_mut().zip(pivot_row).skip(column) {
                *value -= share * above;
            }
            right[row] -= share * right[column];
        }
    }
    for row in (0..N).rev() {
        for other in row + 1..N {
            right[row] -= matrix[row][other] * right[other];
        }
        right[row] /= matrix[row][row];
    }
    right.iter().all(|value| value.is_finite()).then_some(right)
}
