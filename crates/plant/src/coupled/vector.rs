//! Vectors and rotations of space.

/// Along x, y, z.
pub(super) type Vector = [f64; 3];

/// By rows: turns a vector of an inner frame into one of the outer.
pub(super) type Rotation = [Vector; 3];

pub(super) const NO_TURN: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn scaled(a: Vector, by: f64) -> Vector {
    [a[0] * by, a[1] * by, a[2] * by]
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn turned(rotation: &Rotation, a: Vector) -> Vector {
    [dot(rotation[0], a), dot(rotation[1], a), dot(rotation[2], a)]
}

/// `R diag(moments) R' a`: an inertia whose principal axes are those of an inner frame.
pub(super) fn through_inertia(rotation: &Rotation, moments: Vector, a: Vector) -> Vector {
    let column = |j: usize| [rotation[0][j], rotation[1][j], rotation[2][j]];
    [0, 1, 2].into_iter().fold([0.0; 3], |sum, j| add(sum, scaled(column(j), moments[j] * dot(column(j), a))))
}

/// The rotation, and then in its frame one about an axis of length 1 (Rodrigues' formula).
pub(super) fn turned_about(rotation: &Rotation, axis: Vector, (sin, cos): (f64, f64)) -> Rotation {
    let inner = [0, 1, 2].map(|j| {
        let unit = NO_TURN[j];
        add(add(scaled(unit, cos), scaled(cross(axis, unit), sin)), scaled(axis, dot(axis, unit) * (1.0 - cos)))
    });
    // `inner` has the columns.
    let columns = inner.map(|column| turned(rotation, column));
    [0, 1, 2].map(|row| [columns[0][row], columns[1][row], columns[2][row]])
}
