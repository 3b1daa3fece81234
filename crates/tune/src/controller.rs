//! The speed loop that a drive has, from the same samples as its shaft.
//!
//! ```text
//! current = (proportional + integral / s) (set-point exp(-s asked_late) - speed exp(-s seen_late) / (1 + s filter))
//! ```
//!
//! So what one count of a gain is worth is measured, and not taken from a manual that does not say it.

use realfft::num_complex::Complex;

use crate::least_squares::fit;
use crate::response::Response;
use crate::samples::Unusable;

/// A speed loop: gains, and what comes late in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// A/(rad/s).
    pub proportional: f64,
    /// A/rad.
    pub integral: f64,
    /// Time constant of the filter of the measured speed.
    pub filter_s: f64,
    /// How late a set-point takes effect, from the sample at which it was given.
    pub asked_late_s: f64,
    /// How late the speed is seen in the current, the filter apart.
    pub seen_late_s: f64,
    /// Root mean square of the relative difference from what was measured.
    pub off: f64,
}

impl Loop {
    /// Current per error, A/(rad/s).
    pub fn controller(&self, omega: f64) -> Complex<f64> {
        self.proportional + self.integral / Complex::new(0.0, omega)
    }

    /// What becomes of the speed before it is compared.
    pub fn feedback(&self, omega: f64) -> Complex<f64> {
        Complex::from_polar(1.0, -omega * self.seen_late_s) / Complex::new(1.0, omega * self.filter_s)
    }
}

/// The loop behind a response. `filter_s` is what the drive's own filter of its speed is set to.
///
/// # Errors
/// [`Unusable::Incoherent`], also where the set-point is not known.
pub fn identify_loop(response: &Response, filter_s: f64) -> Result<Loop, Unusable> {
    response.check()?;
    let lines: Vec<_> = response.coherent().filter(|line| line.drive.is_finite()).collect();
    if lines.is_empty() {
        return Err(Unusable::Constant { signal: "the set-point" });
    }
    let of = |[proportional, integral, asked, seen]: [f64; 4]| Loop {
        proportional: proportional.exp(),
        integral: integral.exp(),
        filter_s,
        asked_late_s: asked * 1e-3,
        seen_late_s: seen * 1e-3,
        off: 0.0,
    };
    let model = |it: &Loop, line: &crate::response::Line| {
        let omega = line.omega();
        it.controller(omega) * (Complex::from_polar(1.0, -omega * it.asked_late_s) - it.feedback(omega) * line.closed)
    };
    // At high frequencies nothing comes back: the current is the set-point's.
    let highest = lines[lines.len() - 1].drive.norm().max(1e-12);
    let mut parameters = [highest.ln(), (highest * 10.0).ln(), response.sample_s * 1e3, response.sample_s * 1e3];
    let cost = fit(&mut parameters, |parameters, into| {
        let it = of(*parameters);
        into.clear();
        for line in &lines {
            // Where the loop is stiff hardly any current is seen, and the model's own error is as large.
            let off = (model(&it, line) - line.drive) / (line.drive.norm() + 0.5 * highest);
            into.extend([off.re, off.im]);
        }
    });
    Ok(Loop { off: (cost / lines.len() as f64).sqrt(), ..of(parameters) })
}
