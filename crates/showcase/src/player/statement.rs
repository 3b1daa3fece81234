//! What one line of a procedure does.

use std::time::Duration;

use plot::EventKind;

use super::expression::{at, seconds};
use super::text::{columns, is_hexadecimal, split_label};
use super::{Player, Trouble};
use crate::datagram::Pattern;
use crate::expect::Expect;
use crate::lights::red_flashes;

/// A flash of the red light that lasts this long is a long one. No table prints times.
const LONG_FLASH: Duration = Duration::from_millis(500);

type Done = Result<(), Trouble>;

impl Player<'_> {
    /// A line with its braces filled in; `is_answered`: the next one is the frame that answers it.
    pub(super) fn statement(&mut self, line: &str, is_answered: bool) -> Done {
        let (head, label) = split_label(line);
        let (word, rest) = head.split_once(' ').unwrap_or((head, ""));
        match word {
            "drive" => self.drive(rest)?,
            "section" => self.bench.section(rest, label),
            "step" if rest.is_empty() => self.bench.step(label),
            "step" => self.bench.step_in(rest, label),
            ">" => self.send(rest, label, is_answered)?,
            "<" => self.hear(rest, label)?,
            "&" => self.bench.send_within(rest.parse().map_err(|_| not_a_frame(rest))?),
            "write" => self.write(rest, label)?,
            "+" => self.wait(rest)?,
            "!" => self.bench.machine(rest),
            "until" => self.until(rest)?,
            "let" => {
                let (name, expression) = rest.split_once('=').ok_or("expected 'let NAME = EXPRESSION'")?;
                let value = self.value(expression)?;
                self.name(name, value);
            }
            "largest" => self.largest(rest)?,
            "?" => self.expect(rest, label)?,
            "is" => self.expect_that(rest, label)?,
            "same" => self.expect_same(rest, label)?,
            "heard" => self.expect_heard(rest, false)?,
            "first" => self.expect_heard(rest, true)?,
            "moved" => self.bench.moved(label),
            "mark" => self.mark(rest, label)?,
            "aim" if rest == "nothing" => self.bench.aim_at_nothing(),
            "aim" => {
                let counts = self.value(rest)?;
                self.bench.aim_at(counts);
            }
            "resolve" => {
                let counts_per_rpm = self.value(rest)?;
                self.bench.resolve(counts_per_rpm);
            }
            "registers" => self.write_registers(rest)?,
            "watch" if rest == "red" => self.watch_red(),
            _ => return Err(format!("'{word}' does not begin a line here").into()),
        }
        Ok(())
    }

    /// The header: the bench is the part's, on which another model with the same manual may stand.
    fn drive(&self, text: &str) -> Done {
        let (name, node) = text.split_once(' ').unwrap_or((text, ""));
        let (here, number) = (self.bench.model(), self.bench.node());
        let is_same = devices::model(name).is_some_and(|model| std::ptr::eq(model.dictionary, here.dictionary));
        match is_same && node.parse() == Ok(number) {
            true => Ok(()),
            false => Err(format!("expected 'drive {} {number}'", here.name).into()),
        }
    }

    /// `304#3C000000`.
    fn send(&mut self, text: &str, label: &str, is_answered: bool) -> Done {
        let frame = text.parse().map_err(|_| not_a_frame(text))?;
        // A frame takes a quarter of a millisecond, and a drive about one more. In a conversation the next line is the first to
        // hear what it does.
        let time = match (is_answered, self.strict) {
            (true, _) => Duration::ZERO,
            (false, true) => Duration::from_micros(300),
            (false, false) => Duration::from_millis(2),
        };
        self.bench.request(label, frame, time);
        Ok(())
    }

    /// `584#436C6000........`: what answers, or is heard next.
    fn hear(&mut self, text: &str, label: &str) -> Done {
        let pattern = Pattern::parse(text).ok_or_else(|| not_a_frame(text))?;
        self.answer = self.bench.hear(&pattern, self.strict);
        let range = label.split_whitespace().next().and_then(|word| word.split_once(".."));
        if let (Some((low, high)), Some(frame)) = (range, self.answer) {
            let (low, high) = (self.value(low)?, self.value(high)?);
            let value = pattern.open_number(&frame) as f64;
            let is_within = (low..=high).contains(&value);
            self.bench.compare(format!("{low}..{high}"), format!("{value} in {frame}"), is_within);
        }
        Ok(())
    }

    /// `6040h 0Fh`.
    fn write(&mut self, text: &str, label: &str) -> Done {
        let (object, value) = text.split_once(' ').ok_or("expected 'write OBJECT VALUE'")?;
        let (index, sub_index) = self.object(object)?;
        let value = self.value(value)?;
        self.bench.write(label, index, sub_index, value as i64);
        Ok(())
    }

    /// `500 ms`, `1.5 s unseen`.
    fn wait(&mut self, text: &str) -> Done {
        let (time, how) = self.time(text)?;
        match how {
            "silent" => self.bench.run_silently(time),
            "" if self.strict => self.bench.run_silently(time),
            "" => self.bench.run(time),
            "unseen" => self.bench.unseen(|bench| bench.run(time)),
            "silent unseen" => self.bench.unseen(|bench| bench.run_silently(time)),
            _ => return Err(format!("expected 'silent' or 'unseen' after a time, got '{how}'").into()),
        }
        Ok(())
    }

    /// A length of time, and what stands behind it.
    fn time<'t>(&mut self, text: &'t str) -> Result<(Duration, &'t str), Trouble> {
        let (value, rest) = self.leading(text)?;
        let (unit, rest) = rest.split_once(' ').unwrap_or((rest, ""));
        let time_s = match unit {
            "s" => value,
            "ms" => value / 1e3,
            _ => return Err(format!("expected a time such as 500 ms or 1.5 s, got '{text}'").into()),
        };
        Ok((seconds(time_s)?, rest.trim()))
    }

    /// `status 0400h [BITS] within 5 s`, after which `met` says whether it was; `output.ZO each 1 ms within 2 s`.
    fn until(&mut self, text: &str) -> Done {
        let (condition, limit) = text.rsplit_once(" within ").ok_or("expected 'until CONDITION within TIME'")?;
        let (limit, _) = self.time(limit)?;
        if let Some(bits) = condition.strip_prefix("status ") {
            let (mask, rest) = self.leading(bits)?;
            let bits = if rest.is_empty() { mask } else { self.value(rest)? };
            let (mask, bits) = (mask as u16, bits as u16);
            let met = self.bench.run_until(limit, |word| word & mask == bits).is_some();
            self.name("met", f64::from(u8::from(met)));
            return Ok(());
        }
        let (condition, look) = condition.split_once(" each ").ok_or("expected 'each TIME' before 'within'")?;
        let (look, _) = self.time(look)?;
        let begin = self.bench.now();
        while self.value(condition)? == 0.0 && self.bench.now() - begin < limit {
            self.bench.run(look);
        }
        Ok(())
    }

    /// `NAME = EXPRESSION in 100 looks each 10 ms`: the largest value seen.
    fn largest(&mut self, text: &str) -> Done {
        const FORM: &str = "expected 'largest NAME = EXPRESSION in COUNT looks each TIME'";
        let (name, rest) = text.split_once('=').ok_or(FORM)?;
        let (expression, looks) = rest.split_once(" in ").ok_or(FORM)?;
        let (looks, each) = looks.split_once(" looks each ").ok_or(FORM)?;
        let (each, _) = self.time(each)?;
        let mut largest = f64::NEG_INFINITY;
        for _ in 0..self.value(looks)? as u32 {
            self.bench.run(each);
            largest = largest.max(self.value(expression)?);
        }
        self.name(name, largest);
        Ok(())
    }

    /// `velocity = 100 ±1 r/min`, `[603Fh] = 0001h`, `current <= 3.1 A`.
    fn expect(&mut self, text: &str, label: &str) -> Done {
        let (seen, relation) = self.leading(text)?;
        // An object alone is its own label.
        let left = text[..text.len() - relation.len()].trim();
        let object = left.strip_prefix('[').and_then(|left| left.strip_suffix(']'));
        let label = if label.is_empty() { object.unwrap_or("") } else { label };
        if let Some(most) = relation.strip_prefix("<=") {
            let (most, unit) = self.leading(most)?;
            self.bench.expect(label, Expect::AtMost(most), unit, seen);
        } else if let Some(least) = relation.strip_prefix(">=") {
            let (least, unit) = self.leading(least)?;
            self.bench.expect(label, Expect::AtLeast(least), unit, seen);
        } else {
            let near = relation.strip_prefix('=').ok_or_else(|| format!("expected = <= or >= in '{text}'"))?;
            let (value, rest) = self.leading(near)?;
            let (tolerance, unit) = rest.strip_prefix('±').map_or(Ok((0.0, rest)), |rest| self.leading(rest))?;
            let is_bits = near.split_whitespace().next().is_some_and(is_hexadecimal);
            let expect = if is_bits { Expect::Bits(value as u32) } else { Expect::Near(value, tolerance) };
            self.bench.expect(label, expect, unit, seen);
        }
        Ok(())
    }

    /// `output.WR | on | off`: a condition, and the words for it and for its contrary; without a label the first is expected.
    fn expect_that(&mut self, text: &str, label: &str) -> Done {
        let [condition, yes, no] = &columns(text)[..] else { return Err("expected 'is CONDITION | YES | NO'".into()) };
        let is_so = self.value(condition)? > 0.0;
        let label = if label.is_empty() { yes } else { label };
        self.bench.compare(label, if is_so { yes.as_str() } else { no }, is_so);
        Ok(())
    }

    /// `SEEN | EXPECTED`, both in words.
    fn expect_same(&mut self, text: &str, label: &str) -> Done {
        let [seen, expected] = &columns(text)[..] else { return Err("expected 'same SEEN | EXPECTED'".into()) };
        self.bench.compare(format!("{label} {expected}"), seen.as_str(), seen == expected);
        Ok(())
    }

    /// `704#00 since TIME`: a frame from then on, or the first one with this identifier.
    fn expect_heard(&mut self, text: &str, is_first: bool) -> Done {
        let (expected, since) = text.split_once(" since ").ok_or("expected 'heard FRAME since TIME'")?;
        let pattern = Pattern::parse(expected).ok_or_else(|| not_a_frame(expected))?;
        let begin = at(self.value(since)?);
        let heard = self.bench.heard_since(begin, pattern.id);
        let looked_at = if is_first { &heard[..heard.len().min(1)] } else { &heard[..] };
        let seen = looked_at.iter().find(|(_, frame)| pattern.fits(frame)).or(heard.first());
        let text = seen.map_or_else(|| "nothing".into(), |(_, frame)| frame.to_string());
        let ok = seen.is_some_and(|(_, frame)| pattern.fits(frame));
        self.bench.compare(expected, text, ok);
        Ok(())
    }

    fn mark(&mut self, kind: &str, label: &str) -> Done {
        let kind = match kind {
            "fault" => EventKind::Fault,
            "stop" => EventKind::Stop,
            "note" => EventKind::Note,
            _ => return Err(format!("expected fault, stop or note after 'mark', got '{kind}'").into()),
        };
        self.bench.mark(label, kind);
        Ok(())
    }

    /// `0Eh 10000 0`: Modbus registers from an address on.
    fn write_registers(&mut self, text: &str) -> Done {
        let values: Result<Vec<u16>, String> =
            text.split_whitespace().map(|word| self.value(word).map(|value| value as u16)).collect();
        let values = values?;
        let (address, words) = values.split_first().ok_or("expected 'registers ADDRESS VALUE..'")?;
        self.bench.write_registers(*address, words);
        Ok(())
    }

    /// One whole round of the red light: `long` and `short` flashes.
    fn watch_red(&mut self) {
        let seen = red_flashes(self.bench);
        let long = seen.iter().filter(|lit| **lit >= LONG_FLASH).count();
        self.name("long", long as f64);
        self.name("short", (seen.len() - long) as f64);
    }
}

fn not_a_frame(text: &str) -> String {
    format!("expected a frame such as 604#2F60600003000000, got '{text}'")
}
