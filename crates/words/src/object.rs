//! An object, by number or by name: `0x6064`, `6064h`, `6064`, `6081:00`, `position_actual_value`.

use canopen::Mux;
use canopen::od::{Entry, Table};
use devices::names::{by_name as standard_by_name, is_former};

use super::suggest::{did_you_mean, near};

/// What was typed: a number, or a name to look up in the table of the node's model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ObjectArg {
    /// Index and sub-index.
    Mux(Mux),
    /// A name in snake case.
    Name(String),
}

const EXPECTED: &str = "an object is a hexadecimal index with an optional sub-index, or a name, \
                        e.g. 6064, 0x6064, 6064h, 2026:01, position_actual_value";

/// Reads an object argument; names are looked up later, when the model is known.
pub fn object(text: &str) -> Result<ObjectArg, String> {
    let (index, sub_index) = text.split_once(':').unwrap_or((text, "0"));
    let index = index.strip_suffix(['h', 'H']).unwrap_or(index);
    let index = index.strip_prefix("0x").or_else(|| index.strip_prefix("0X")).unwrap_or(index);
    let sub_index = sub_index.strip_prefix("0x").or_else(|| sub_index.strip_prefix("0X")).unwrap_or(sub_index);
    let sub_index = sub_index.strip_suffix(['h', 'H']).unwrap_or(sub_index);
    let hex = |digits: &str, most: usize| {
        let valid = (1..=most).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
        valid.then(|| u16::from_str_radix(digits, 16).unwrap_or_default())
    };
    match (hex(index, 4), hex(sub_index, 2)) {
        (Some(index), Some(sub_index)) => Ok(ObjectArg::Mux(Mux::new(index, sub_index as u8))),
        (Some(_), None) => Err(format!("the sub-index of '{text}' is not 00 to FF; {EXPECTED}")),
        (None, _) if is_name(text) => Ok(ObjectArg::Name(text.to_ascii_lowercase().replace('-', "_"))),
        (None, _) => Err(format!("'{text}' is not an object; {EXPECTED}")),
    }
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic())
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
}

impl ObjectArg {
    /// The multiplexor, and the row if `table` has it. A number needs no row: the drive answers for itself.
    pub fn resolve(&self, table: Option<&'static Table>) -> Result<(Mux, Option<&'static Entry>), String> {
        match self {
            Self::Mux(mux) => Ok((*mux, table.and_then(|table| row(table, *mux)))),
            Self::Name(name) => {
                let Some(table) = table else {
                    // What CiA 301 and CiA 402 name is the same on every device.
                    let standard = standard_by_name(name).ok_or_else(|| {
                        format!(
                            "the node's model is not known, and '{name}' is not an object of CiA 301 or CiA 402; give the index, e.g. 6064, or \
                             --model NODE=MODEL"
                        )
                    });
                    return standard.map(|mux| (mux, None));
                };
                let row = by_name(table, name)?;
                Ok((row.mux(), Some(row)))
            }
        }
    }
}

fn row(table: &'static Table, mux: Mux) -> Option<&'static Entry> {
    table.find(mux).ok().map(|slot| table.row(slot))
}

fn by_name(table: &'static Table, name: &str) -> Result<&'static Entry, String> {
    let is_named = table.rows().iter().any(|row| row.name == name);
    let matches = |row: &&Entry| if is_named { row.name == name } else { is_former(name, row.name) };
    let mut rows = table.rows().iter().filter(matches);
    match (rows.next(), rows.next()) {
        (Some(row), None) => Ok(row),
        (Some(first), Some(second)) => Err(format!(
            "'{name}' is the name of several objects; say which by number, e.g. {} or {}",
            first.mux(),
            second.mux()
        )),
        (None, _) => {
            if name.len() > 4 && name.bytes().all(|byte| byte.is_ascii_hexdigit()) {
                return Err(format!(
                    "'{name}' is longer than an index: expected 4 hexadecimal digits, and a sub-index of 2 behind a colon, e.g. 6064 or 2030:0E"
                ));
            }
            let names = near(name, table.rows().iter().map(|row| row.name));
            Err(format!("this model has no object named '{name}'{}", did_you_mean(&names)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::od::{Access, DataType, Index};

    static ROWS: [Entry; 3] = [
        Entry::new(0x1400, 0, DataType::Unsigned8, Access::ReadOnly, "highest_sub_index", ""),
        Entry::new(0x1401, 0, DataType::Unsigned8, Access::ReadOnly, "highest_sub_index", ""),
        Entry::new(0x6064, 0, DataType::Integer32, Access::ReadOnly, "position_actual_value", ""),
    ];
    static INDEX: Index<3> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);

    #[test]
    fn numbers_are_hexadecimal_in_every_spelling() {
        for text in ["0x6064", "6064h", "6064", "6064:00", "6064h:0", "0x6064:0x00"] {
            assert_eq!(object(text), Ok(ObjectArg::Mux(Mux::new(0x6064, 0))), "{text}");
        }
        assert_eq!(object("2030:0E"), Ok(ObjectArg::Mux(Mux::new(0x2030, 0x0E))));
    }

    #[test]
    fn what_is_neither_number_nor_name_is_refused_with_an_example() {
        for wrong in ["", "60644", "6064:", "6064:100", ":1", "6064.1", "0x", "what?", "-6064"] {
            assert!(object(wrong).unwrap_err().contains("e.g. 6064"), "{wrong:?}");
        }
    }

    #[test]
    fn names_are_found_or_suggested() {
        let find = |text: &str| object(text).unwrap().resolve(Some(&TABLE)).map(|found| found.0);
        assert_eq!(find("position_actual_value"), Ok(Mux::new(0x6064, 0)));
        assert_eq!(find("Position-Actual-Value"), Ok(Mux::new(0x6064, 0)));
        assert!(find("position_actual_vale").unwrap_err().contains("did you mean position_actual_value?"));
        assert!(find("FFFFF").unwrap_err().contains("longer than an index: expected 4 hexadecimal digits"));
        assert!(find("highest_sub_index").unwrap_err().contains("1401h:00"));
        assert!(object("velocity").unwrap().resolve(None).err().unwrap().contains("--model"));
        for (name, mux) in [
            ("statusword", Mux::new(0x6041, 0)),
            ("vendor_id", Mux::new(0x1018, 1)),
            ("identity_object", Mux::new(0x1018, 0)),
            ("position_actual_value", Mux::new(0x6064, 0)),
        ] {
            assert_eq!(object(name).unwrap().resolve(None).map(|found| found.0), Ok(mux), "{name}");
        }
    }

    #[test]
    fn a_former_name_is_understood() {
        let table_of = |model| devices::model(model).expect("a model").dictionary;
        let find_in = |model, text: &str| object(text).unwrap().resolve(Some(table_of(model))).map(|found| found.0);
        let find = |text| find_in("zlim42c", text);
        assert_eq!(find("homing_speed_switch"), Ok(Mux::new(0x6099, 1)));
        assert_eq!(find("speed_during_search_for_switch"), Ok(Mux::new(0x6099, 1)));
        assert_eq!(find("software_version"), Ok(Mux::new(0x100A, 0)));
        // What two makers' objects were called, and what another model has by this name of the standard.
        assert_eq!(find_in("zlac8030l", "velocity_kp"), Ok(Mux::new(0x201D, 0)));
        assert_eq!(find_in("m4230e17b50", "velocity_kp"), Ok(Mux::new(0x60F9, 1)));
        assert_eq!(find_in("zlac8030l", "max_motor_speed"), Ok(Mux::new(0x200A, 0)));
        assert_eq!(find_in("cia402", "max_motor_speed"), Ok(Mux::new(0x6080, 0)));
    }

    #[test]
    fn a_number_needs_no_row() {
        assert_eq!(object("5FFF").unwrap().resolve(Some(&TABLE)).map(|found| found.1.is_none()), Ok(true));
    }
}
