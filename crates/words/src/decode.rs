//! Bytes of an object as people read them: number, unit, meaning.

use canopen::od::{DataType, Entry};
use cia402::{Controlword, Statusword};
use master::decode::statusword_words;
use serde::Serialize;

use crate::unit::split_factor;
use devices::Description;
use plot::Paint;

/// Most bytes that a line shows whole: some lines of a terminal. Of more it shows the first.
const SHOWN: usize = 128;
const FIRST: usize = 16;

/// A decoded value.
#[derive(Clone, Debug, Serialize)]
pub struct Decoded {
    /// The bytes as they came, hexadecimal, in the order of the wire.
    pub bytes: String,
    /// The object's number; `None` for a text or an unknown length.
    pub value: Option<i64>,
    /// A text object's text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub string: Option<String>,
    /// The number in its unit, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<f64>,
    /// That unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// What the number means, where the object states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meaning: Option<String>,
    #[serde(skip)]
    decimals: usize,
    #[serde(skip)]
    hexadecimal: bool,
}

/// Decodes `bytes`, which came from the object of `row`, if that is known, on a node of `model`.
pub fn decode(model: Option<&Description>, row: Option<&'static Entry>, bytes: &[u8]) -> Decoded {
    let mut decoded = Decoded {
        bytes: bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "),
        value: None,
        string: None,
        quantity: None,
        unit: None,
        meaning: None,
        decimals: 0,
        hexadecimal: true,
    };
    let raw = || bytes.iter().rev().fold(0u32, |raw, byte| raw << 8 | u32::from(*byte));
    let Some(row) = row else {
        decoded.value = (1..=4).contains(&bytes.len()).then(|| raw().into());
        return decoded;
    };
    if row.data_type == DataType::VisibleString {
        decoded.string = Some(String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned());
    } else if bytes.len() == row.data_type.size() {
        let value = row.data_type.value(raw());
        decoded.value = Some(value);
        decoded.meaning = meaning(model, row, value);
        decoded.hexadecimal = is_bit_field(row);
        decoded.measure(row.unit, value);
    } else if let Some(form) = model
        .and_then(|model| model.pdo.mapping.tpdo_form(row.mux()))
        .filter(|form| form.data_type.size() == bytes.len())
    {
        // An object may have another length and unit in TPDOs.
        let value = form.data_type.value(raw());
        decoded.value = Some(value);
        decoded.measure(form.unit, value);
    }
    decoded
}

impl Decoded {
    /// The same bytes as a number of a type, where only that is known of them.
    pub fn typed(mut self, data_type: Option<DataType>) -> Self {
        if let (Some(data_type), Some(value)) = (data_type, self.value) {
            self.value = Some(data_type.value(value as u32));
            self.hexadecimal = false;
        }
        self
    }

    /// The same value where this many counts make one of the unit.
    pub fn at_resolution(mut self, counts: i64) -> Self {
        if counts > 1 {
            self.quantity = self.quantity.map(|quantity| quantity / counts as f64);
            self.decimals += (counts as f64).log10().ceil() as usize;
        }
        self
    }

    fn measure(&mut self, unit: &'static str, value: i64) {
        if unit.is_empty() {
            return;
        }
        let (factor, name) = split_factor(unit);
        self.quantity = Some(value as f64 * factor);
        self.unit = Some(name);
        // A small margin: 1e-3 must not ask for a fourth decimal.
        self.decimals = (-factor.log10() - 1e-9).ceil().max(0.0) as usize;
    }

    /// How many bytes there are.
    pub fn length(&self) -> usize {
        self.bytes.split_whitespace().count()
    }

    /// One line does not show all bytes.
    pub fn is_cut(&self) -> bool {
        self.value.is_none() && self.string.is_none() && self.length() > SHOWN
    }

    /// One line.
    pub fn text(&self, paint: Paint) -> String {
        let number = match (self.value, self.quantity, self.unit, &self.string) {
            (_, Some(quantity), Some(unit), _) => format!("{quantity:.*} {unit}", self.decimals),
            (Some(value), ..) if self.hexadecimal => format!("0x{value:X}"),
            (Some(value), ..) => value.to_string(),
            (None, _, _, Some(string)) => format!("{string:?}"),
            (None, ..) if self.is_cut() => format!("{} bytes, {} ...", self.length(), &self.bytes[..3 * FIRST - 1]),
            (None, ..) => format!("bytes {}", self.bytes),
        };
        let plain = match self.value {
            Some(value) if self.hexadecimal => format!(" ({value})"),
            Some(value) if self.quantity.is_some_and(|quantity| quantity != value as f64) => format!(" ({value})"),
            _ => String::new(),
        };
        let meaning = self.meaning.as_ref().map(|meaning| format!("  {}", paint.strong(meaning))).unwrap_or_default();
        format!("{number}{}{meaning}", paint.dim(&plain))
    }
}

/// Values that are sets of bits or addresses read better in hexadecimal.
fn is_bit_field(row: &Entry) -> bool {
    matches!(row.index, 0x1000..=0x1016 | 0x1018..=0x1FFF | 0x603F..=0x6041)
        && row.unit.is_empty()
        && row.sub_index != 0
        || matches!(row.index, 0x1000 | 0x1001 | 0x1005 | 0x1009 | 0x100A | 0x1014 | 0x603F..=0x6041)
}

fn meaning(model: Option<&Description>, row: &Entry, value: i64) -> Option<String> {
    match (row.index, row.sub_index) {
        (0x6041, 0) => Some(statusword_words(Statusword(value as u16), model)),
        (0x6040, 0) => Some(Controlword(value as u16).command().name().into()),
        _ => row.meaning(value).map(Into::into),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::od::Access;

    #[test]
    fn many_bytes_are_cut_with_their_number_and_few_are_shown_whole() {
        let whole = decode(None, None, &[0xAB; SHOWN]);
        assert_eq!(whole.text(Paint::OFF).matches("AB").count(), SHOWN);
        let cut = decode(None, None, &[0xAB; 10_240]);
        assert!(cut.is_cut() && !whole.is_cut());
        let text = cut.text(Paint::OFF);
        assert!(text.starts_with("10240 bytes, AB AB") && text.len() < 80, "{text}");
        assert_eq!(cut.bytes.len(), 3 * 10_240 - 1, "JSON has them all");
    }

    static SPEED: Entry =
        Entry::new(0x606C, 0, DataType::Integer32, Access::ReadOnly, "velocity_actual_value", "").unit("0.1 r/min");
    static STATUS: Entry = Entry::new(0x6041, 0, DataType::Unsigned16, Access::ReadOnly, "statusword", "");
    static MODE: Entry = Entry::new(0x6060, 0, DataType::Integer8, Access::ReadWrite, "modes_of_operation", "")
        .values(&[(3, "profile velocity")]);
    static POSITION: Entry =
        Entry::new(0x6064, 0, DataType::Integer32, Access::ReadOnly, "position_actual_value", "").unit("counts");

    #[test]
    fn numbers_are_shown_in_their_unit() {
        let text = |row, bytes: &[u8]| decode(None, Some(row), bytes).text(Paint::OFF);
        assert_eq!(text(&SPEED, &[0x18, 0xFC, 0xFF, 0xFF]), "-100.0 r/min (-1000)");
        assert_eq!(text(&POSITION, &[0, 0x7D, 0, 0]), "32000 counts");
        assert_eq!(text(&MODE, &[3]), "3  profile velocity");
    }

    #[test]
    fn a_finer_resolution_divides_the_unit() {
        let target = Entry { unit: "r/min", ..SPEED };
        let target: &'static Entry = Box::leak(Box::new(target));
        let text = |counts| decode(None, Some(target), &[0x1B, 0, 0, 0]).at_resolution(counts).text(Paint::OFF);
        assert_eq!((text(1), text(10)), ("27 r/min".into(), "2.7 r/min (27)".into()));
    }

    #[test]
    fn counts_that_are_a_fraction_of_a_unit_are_shown_in_the_unit() {
        // "M Robot Joint Motor CanOpen Manual", 5.04: 6078h in 1/2000 A, 6079h in 1/327 V.
        let text = |index, bytes: &[u8]| {
            let joint = &devices::mjoint::M4230E17B50;
            decode(Some(joint), joint.row(canopen::Mux::new(index, 0)), bytes).text(Paint::OFF)
        };
        assert_eq!(text(0x6078, &[0xD0, 0x07]), "1.0000 A (2000)");
        assert_eq!(text(0x6079, &[0x48, 0x01]), "1.003 V (328)");
    }

    #[test]
    fn a_statusword_is_put_into_words() {
        let decoded = decode(None, Some(&STATUS), &[0x37, 0x06]);
        assert_eq!(decoded.text(Paint::OFF), "0x637 (1591)  Operation enabled, target reached");
        // "M Robot Joint Motor CanOpen Manual", 5.10.1: an idle joint.
        let joint = decode(Some(&devices::mjoint::M4230E17B50), Some(&STATUS), &[0x04, 0x04]);
        assert_eq!(joint.text(Paint::OFF), "0x404 (1028)  output enabled, target reached");
    }

    #[test]
    fn an_unexpected_length_is_shown_as_bytes() {
        assert_eq!(decode(None, Some(&SPEED), &[1, 2]).text(Paint::OFF), "bytes 01 02");
        assert_eq!(decode(None, None, &[1, 2]).text(Paint::OFF), "0x201 (513)");
        assert_eq!(decode(None, None, &[1; 6]).text(Paint::OFF), "bytes 01 01 01 01 01 01");
    }
}
