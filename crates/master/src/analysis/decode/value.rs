use core::fmt;

use canopen::Mux;
use canopen::od::{DataType, Entry};
use cia402::{Controlword, ModeOfOperation, Statusword};
use devices::{Description, PowerStyle};

use super::common::{common_name, common_row, common_type};

/// The bytes of one object, with what is known about it. Prints as `6041h:00 statusword = 0237h (Operation enabled)`.
#[derive(Clone)]
pub struct DecodedValue<'a> {
    /// Which object.
    pub mux: Mux,
    /// Its bytes, little endian.
    pub bytes: &'a [u8],
    /// Its row in the model's table.
    pub entry: Option<&'static Entry>,
    model: Option<&'static Description>,
}

impl<'a> DecodedValue<'a> {
    /// The bytes of an object, looked up in the model's table, or in what all models agree on.
    pub fn new(mux: Mux, bytes: &'a [u8], model: Option<&'static Description>) -> Self {
        Self { mux, bytes, entry: find(model, mux), model }
    }

    /// The low four bytes as a cell; `None` for longer objects.
    pub fn raw(&self) -> Option<u32> {
        let mut cell = [0; 4];
        cell.get_mut(..self.bytes.len())?.copy_from_slice(self.bytes);
        Some(u32::from_le_bytes(cell))
    }

    /// The number that the bytes stand for, by the table's data type.
    pub fn number(&self) -> Option<i64> {
        let raw = self.raw()?;
        let data_type = match self.entry {
            Some(entry) => self.form(entry).0,
            None if self.model.is_none() && common_name(self.mux).is_some() => common_type(self.mux, self.bytes.len())?,
            None => return None,
        };
        data_type.is_integer().then(|| data_type.value(raw))
    }

    /// What one of [`number`](Self::number) is, by the table; empty if nothing is known.
    pub fn unit(&self) -> &'static str {
        self.entry.map_or("", |entry| self.form(entry).1)
    }

    /// The object's name, if known.
    pub fn name(&self) -> Option<&'static str> {
        object_name(self.mux, self.model)
    }

    /// Type and unit of the bytes: an object may have another form in TPDOs, recognised by its length.
    fn form(&self, entry: &Entry) -> (DataType, &'static str) {
        let form = self.model.and_then(|model| model.pdo.mapping.tpdo_form(self.mux));
        match form {
            Some(form) if form.data_type.size() == self.bytes.len() => (form.data_type, form.unit),
            _ => (entry.data_type, entry.unit),
        }
    }
}

impl fmt::Debug for DecodedValue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "DecodedValue({self})")
    }
}

impl fmt::Display for DecodedValue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_name(f, self.mux, self.model)?;
        f.write_str(" = ")?;
        let Some(raw) = self.raw().filter(|_| !self.bytes.is_empty()) else { return write_long(f, self.bytes) };
        if let Some(words) = standard_words(self.mux, raw, self.model) {
            return f.write_str(&words);
        }
        match (self.number(), self.entry) {
            (Some(number), Some(entry)) => write_number(f, number, raw, entry, self.form(entry).1),
            (Some(number), None) => write!(f, "{number}"),
            _ => write!(f, "{raw:0width$X}h ({raw})", width = self.bytes.len() * 2),
        }
    }
}

/// An object's multiplexor and its name, if known.
pub(super) fn write_name(f: &mut fmt::Formatter<'_>, mux: Mux, model: Option<&'static Description>) -> fmt::Result {
    match object_name(mux, model) {
        Some(name) => write!(f, "{mux} {name}"),
        None => write!(f, "{mux}"),
    }
}

fn object_name(mux: Mux, model: Option<&'static Description>) -> Option<&'static str> {
    model.map_or_else(|| common_name(mux), |model| model.row(mux).map(|row| row.name))
}

fn find(model: Option<&'static Description>, mux: Mux) -> Option<&'static Entry> {
    model.map_or_else(|| common_row(mux), |model| model.row(mux))
}

/// A statusword in words: its state and the bits that say more, or for a model without states its bits.
pub fn statusword_words(word: Statusword, model: Option<&Description>) -> String {
    const BITS: [(u16, &str); 2] = [(Statusword::WARNING, "warning"), (Statusword::TARGET_REACHED, "target reached")];
    let axis = model.and_then(Description::first_axis);
    let own = axis.map_or(&[][..], |axis| axis.statusword_bits);
    let (state, common) = match axis {
        Some(axis) if axis.power != PowerStyle::Cia402 => (None, &[][..]),
        _ => (Some(word.state().map_or("no state of CiA 402", |state| state.name())), &BITS[..]),
    };
    let set = common.iter().chain(own).filter(|(mask, _)| word.has(*mask)).map(|(_, name)| *name);
    let words: Vec<&str> = state.into_iter().chain(set).collect();
    if words.is_empty() { "no bit set".to_owned() } else { words.join(", ") }
}

/// Objects whose bits the standard or the model gives a meaning.
fn standard_words(mux: Mux, raw: u32, model: Option<&Description>) -> Option<String> {
    match (mux.index, mux.sub_index) {
        (0x6040, 0) => Some(Controlword(raw as u16).to_string()),
        (0x6041, 0) => Some(format!("{raw:04X}h ({})", statusword_words(Statusword(raw as u16), model))),
        (0x6060 | 0x6061, 0) => Some(ModeOfOperation(raw as u8 as i8).to_string()),
        (0x1600..=0x17FF | 0x1A00..=0x1BFF, 1..) => {
            Some(format!("{raw:08X}h ({}, {} bits)", Mux::from_key(raw >> 8), raw & 0xFF))
        }
        _ => None,
    }
}

fn write_number(f: &mut fmt::Formatter<'_>, number: i64, raw: u32, entry: &Entry, unit: &'static str) -> fmt::Result {
    let is_identifier = entry.data_type == DataType::Unsigned32 && entry.unit.is_empty() && entry.index < 0x2000;
    if is_identifier {
        write!(f, "{raw:X}h")?
    } else {
        write!(f, "{number}")?
    }
    if !unit.is_empty() {
        write!(f, " [{unit}]")?;
    }
    match entry.meaning(number) {
        Some(meaning) => write!(f, " ({meaning})"),
        None => Ok(()),
    }
}

/// As text when it is printable, else in hexadecimal.
fn write_long(f: &mut fmt::Formatter<'_>, bytes: &[u8]) -> fmt::Result {
    if bytes.is_empty() {
        return f.write_str("(no bytes)");
    }
    match core::str::from_utf8(bytes) {
        Ok(text) if !text.chars().any(char::is_control) => write!(f, "\"{text}\""),
        _ => {
            let mut separator = "";
            bytes.iter().try_for_each(|byte| {
                write!(f, "{separator}{byte:02X}")?;
                separator = " ";
                Ok(())
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_with_another_form_in_tpdos_is_read_by_its_length() {
        let joint = Some(&devices::mjoint::M4230E17B50);
        let speed = |bytes| DecodedValue::new(Mux::new(0x606C, 0), bytes, joint).to_string();
        assert_eq!(speed(&[0x90, 0xE8]), "606Ch:00 velocity_actual_value = -6000 [0.1 r/min]");
        assert_eq!(speed(&[0xA8, 0xFD, 0xFF, 0xFF]), "606Ch:00 velocity_actual_value = -600 [r/min]");
    }
}
