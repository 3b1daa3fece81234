//! The stator's and the rotor's frame of reference: amplitude-invariant Clarke and Park transforms, and back.

const INV_SQRT_3: f32 = 0.577_350_26;
const HALF_SQRT_3: f32 = 0.866_025_4;

/// A vector in the rotor's frame: d along the magnets, q across them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dq {
    /// Along the magnets.
    pub d: f32,
    /// Across the magnets: the torque-producing axis.
    pub q: f32,
}

/// A vector in the stator's frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AlphaBeta {
    /// Along phase U's axis.
    pub alpha: f32,
    /// A quarter of an electrical turn on.
    pub beta: f32,
}

/// Three phase values to a vector; a common part is dropped.
#[inline]
pub fn clarke([u, v, w]: [f32; 3]) -> AlphaBeta {
    AlphaBeta { alpha: u * (2.0 / 3.0) - (v + w) * (1.0 / 3.0), beta: (v - w) * INV_SQRT_3 }
}

/// A vector to three phase values of sum zero.
#[inline]
pub fn inverse_clarke(AlphaBeta { alpha, beta }: AlphaBeta) -> [f32; 3] {
    let (half, side) = (-0.5 * alpha, HALF_SQRT_3 * beta);
    [alpha, half + side, half - side]
}

/// Stator frame to rotor frame.
#[inline]
pub fn park(AlphaBeta { alpha, beta }: AlphaBeta, sin: f32, cos: f32) -> Dq {
    Dq { d: alpha * cos + beta * sin, q: beta * cos - alpha * sin }
}

/// Rotor frame to stator frame.
#[inline]
pub fn inverse_park(Dq { d, q }: Dq, sin: f32, cos: f32) -> AlphaBeta {
    AlphaBeta { alpha: d * cos - q * sin, beta: d * sin + q * cos }
}
