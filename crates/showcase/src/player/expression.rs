//! Arithmetic with what can be measured: numbers, `+ - * / &`, parentheses, names, objects as `[606Ch]` and `[1600h:01]`,
//! and functions of times and frames. Times are in milliseconds since power-on, as `now` is.

use std::f64::consts::TAU;
use std::time::Duration;

use can::{Frame, Instant};
use sim::{Brake, Report};

use super::Player;
use super::text::hexadecimal;
use crate::timing::{largest_gap_ms, smallest_gap_ms};

/// How long the longest of the drives takes to settle at the end of a move is not printed in its manual. The M8025's rotor is
/// 2.5 times as heavy as the M4230's, with the same gains as delivered.
const SETTLING_S: f64 = 0.03;
const SETTLING_HEAVY_S: f64 = 0.3;

impl Player<'_> {
    /// The value of a whole text.
    pub(super) fn value(&mut self, text: &str) -> Result<f64, String> {
        match self.leading(text)? {
            (value, "") => Ok(value),
            (_, rest) => Err(format!("expected the end of '{text}' before '{rest}'")),
        }
    }

    /// The value of the expression that a text begins with, and the rest of the text.
    pub(super) fn leading<'t>(&mut self, text: &'t str) -> Result<(f64, &'t str), String> {
        let (mut sum, mut rest) = self.product(text)?;
        while let Some(sign @ ('+' | '-')) = rest.chars().next() {
            let (next, after) = self.product(&rest[1..])?;
            (sum, rest) = (if sign == '+' { sum + next } else { sum - next }, after);
        }
        Ok((sum, rest))
    }

    fn product<'t>(&mut self, text: &'t str) -> Result<(f64, &'t str), String> {
        let (mut product, mut rest) = self.factor(text)?;
        while let Some(sign @ ('*' | '/' | '&')) = rest.chars().next() {
            let (next, after) = self.factor(&rest[1..])?;
            rest = after;
            product = match sign {
                '*' => product * next,
                '/' => product / next,
                _ if product.is_nan() => product,
                _ => f64::from(product as u32 & next as u32),
            };
        }
        Ok((product, rest))
    }

    fn factor<'t>(&mut self, text: &'t str) -> Result<(f64, &'t str), String> {
        let text = text.trim_start();
        if let Some(negated) = text.strip_prefix('-') {
            return self.factor(negated).map(|(value, rest)| (-value, rest));
        }
        if let Some(inner) = text.strip_prefix('(') {
            let (value, rest) = self.leading(inner)?;
            let rest = rest.strip_prefix(')').ok_or_else(|| format!("expected ')' before '{rest}'"))?;
            return Ok((value, rest.trim_start()));
        }
        if let Some(inner) = text.strip_prefix('[') {
            let (object, rest) = inner.split_once(']').ok_or("expected ']' after an object")?;
            let (index, sub_index) = self.object(object)?;
            return Ok((self.bench.read_f64(index, sub_index), rest.trim_start()));
        }
        let end = text.find(|c: char| !c.is_alphanumeric() && c != '.' && c != '_').unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        if word.starts_with(|first: char| first.is_ascii_digit()) {
            let value = hexadecimal(word).map(f64::from).or_else(|| word.parse().ok());
            return Ok((value.ok_or_else(|| format!("'{word}' is not a number"))?, rest.trim_start()));
        }
        match rest.strip_prefix('(') {
            Some(arguments) => self.function(word, arguments),
            None => Ok((self.named(word)?, rest.trim_start())),
        }
    }

    /// Index and sub-index of `606Ch` or `1600h:01`.
    pub(super) fn object(&mut self, text: &str) -> Result<(u16, u8), String> {
        let (index, sub_index) = text.split_once(':').unwrap_or((text, "0"));
        let index = hexadecimal(index).and_then(|index| u16::try_from(index).ok());
        let sub_index = u8::from_str_radix(sub_index, 16).ok();
        index.zip(sub_index).ok_or_else(|| format!("expected an object such as 606Ch or 1600h:01, got '{text}'"))
    }

    /// What a line has named, or what can be measured.
    fn named(&mut self, name: &str) -> Result<f64, String> {
        if let Some(text) = self.lookup(name) {
            return self.value(&text);
        }
        if let Some(output) = name.strip_prefix("output.") {
            return Ok(f64::from(u8::from(self.bench.output(output))));
        }
        if let Some(output) = name.strip_prefix("changes.") {
            return Ok(f64::from(crate::lights::changes(self.bench, output)));
        }
        let now = self.bench.now();
        let report = self.bench.report();
        let settling_s = if self.bench.model().name.starts_with("m8025") { SETTLING_HEAVY_S } else { SETTLING_S };
        Ok(match name {
            "now" => now.as_nanos() as f64 / 1e6,
            "answer" => self.answer.map_or(f64::NAN, first_number),
            "settling" => settling_s,
            "NaN" => f64::NAN,
            _ => measured(&report, name).ok_or_else(|| format!("'{name}' is not known here"))?,
        })
    }

    /// A function of the arguments up to a closing parenthesis.
    fn function<'t>(&mut self, name: &str, text: &'t str) -> Result<(f64, &'t str), String> {
        let (mut arguments, mut rest) = (Vec::new(), text);
        let rest = loop {
            let (value, after) = self.leading(rest)?;
            arguments.push(value);
            match (after.strip_prefix(','), after.strip_prefix(')')) {
                (Some(next), _) => rest = next,
                (_, Some(end)) => break end.trim_start(),
                _ => return Err(format!("expected ',' or ')' before '{after}'")),
            }
        };
        let value = match (name, &arguments[..]) {
            ("abs", &[x]) => x.abs(),
            ("round", &[x]) => x.round(),
            ("sqrt", &[x]) => x.sqrt(),
            ("not", &[x]) => f64::from(u8::from(x == 0.0)),
            ("known", &[x]) => f64::from(u8::from(!x.is_nan())),
            // How far off the nearest multiple.
            ("off", &[x, unit]) => (x + unit / 2.0).rem_euclid(unit) - unit / 2.0,
            // Seconds since a time.
            ("since", &[ms]) => (self.bench.now() - at(ms)).as_secs_f64(),
            ("register", &[address, count]) => self.bench.read_registers(address as u16, count as usize),
            // Of the frames with an identifier that were heard from a time on: when the first one was, how many there were,
            // the largest and the smallest distance of neighbours in ms, the first 16 bits, the last one's first byte.
            ("first", &[id, ms]) => self.heard(id, ms).first().map_or(f64::NAN, |(at, _)| at.as_nanos() as f64 / 1e6),
            ("count", &[id, ms]) => self.heard(id, ms).len() as f64,
            ("largest_gap", &[id, ms]) => largest_gap_ms(&self.heard(id, ms)),
            ("smallest_gap", &[id, ms]) => smallest_gap_ms(&self.heard(id, ms)),
            ("word", &[id, ms]) => {
                let word = |(_, frame): &(Instant, Frame)| u16::from_le_bytes([frame.padded()[0], frame.padded()[1]]);
                self.heard(id, ms).first().map(word).map_or(f64::NAN, f64::from)
            }
            ("last", &[id, ms]) => self.heard(id, ms).last().map_or(f64::NAN, |(_, frame)| frame.padded()[0].into()),
            // How many of them have this byte alone.
            ("bytes", &[id, byte, ms]) => {
                self.heard(id, ms).iter().filter(|(_, frame)| frame.data() == [byte as u8]).count() as f64
            }
            _ => return Err(format!("'{name}' is not a function of {} values", arguments.len())),
        };
        Ok((value, rest))
    }

    fn heard(&self, id: f64, ms: f64) -> Vec<(Instant, Frame)> {
        self.bench.heard_since(at(ms), id as u16)
    }
}

/// The time at so many milliseconds.
pub(super) fn at(ms: f64) -> Instant {
    Instant::from_nanos((ms * 1e6).round().max(0.0) as u64)
}

/// A length of time in seconds.
pub(super) fn seconds(time_s: f64) -> Result<Duration, String> {
    Duration::try_from_secs_f64(time_s).map_err(|_| format!("{time_s} s is not a length of time"))
}

/// What a meter at the machine shows.
fn measured(report: &Report, name: &str) -> Option<f64> {
    Some(match name {
        "position" => report.position as f64,
        "rotor" => report.rotor_position.map_or(f64::NAN, |rotor| rotor as f64),
        "turns" => report.shaft_angle_rad / TAU,
        "velocity" => report.velocity_rpm,
        "demand" => report.velocity_demand_rpm.unwrap_or(f64::NAN),
        "stands" => f64::from(u8::from(report.velocity_demand_rpm.is_none_or(|rpm| rpm == 0.0))),
        "current" => report.current_a,
        "supply" => report.supply_v,
        "motor_temperature" => report.motor_c.unwrap_or(f64::NAN),
        "driver_temperature" => report.driver_c.unwrap_or(f64::NAN),
        "engaged" => report.brake.map_or(f64::NAN, |brake| f64::from(u8::from(brake == Brake::Engaged))),
        _ => return None,
    })
}

/// The number in the first four bytes of a frame.
fn first_number(frame: Frame) -> f64 {
    let [a, b, c, d, ..] = *frame.padded();
    f64::from(i32::from_le_bytes([a, b, c, d]))
}
