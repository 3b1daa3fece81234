//! The journal of a transaction: the writes that lead back, kept on the disk before the first of its own.
//!
//! Its form is TOML. A journal that was not written to its end has no line `whole = true` at its end, and is refused: the
//! transaction behind it had not begun.

use std::fmt::Write as _;

use canopen::{Mux, NodeId};
use master::identify::Identity;

use words::document::reader::{self, Field, Parameters as Placeholders, Table};
use words::document::{BadFile, Problem};
use words::node::node;
use words::object::{ObjectArg, object};
use words::value::bytes_in_hexadecimal;

/// What leads back from a transaction that was broken off.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Journal {
    /// Of which node.
    pub node: NodeId,
    /// What the node said that it is.
    pub identity: Identity,
    /// The node was pre-operational, and has been started by what is led back.
    pub pre_operational: bool,
    /// The writes in their order.
    pub undo: Vec<(Mux, Vec<u8>)>,
}

const EXPECTED: &str = "a list of writes, each [\"1017:00\", \"0000\"]";

impl Journal {
    /// The text of its file.
    pub fn print(&self) -> String {
        let mut text = format!(
            "# What a node had before `ferrodrive params apply`, which has not come to its end if this file is there.\n\
             # `ferrodrive params rollback {0}` writes it back, in this order.\nnode = {0}\n",
            self.node
        );
        let said = [self.identity.vendor_id, self.identity.product_code, self.identity.revision_number];
        for (name, number) in NAMES.iter().zip(said) {
            if let Some(number) = number {
                let _ = writeln!(text, "{name} = 0x{number:X}");
            }
        }
        if self.pre_operational {
            let _ = writeln!(text, "{STATE} = {PRE_OPERATIONAL:?}");
        }
        text += "undo = [\n";
        for (object, bytes) in &self.undo {
            let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            let _ = writeln!(text, "  [\"{object:X}\", \"{digits}\"],");
        }
        text + "]\nwhole = true\n"
    }

    /// Reads it.
    ///
    /// # Errors
    /// What is wrong with it, with its place.
    pub fn parse(text: &str) -> Result<Self, BadFile> {
        reader::read(text, &Placeholders::new(), "a journal", |file| from_table(file).map_err(|problem| vec![problem]))
            .map_err(|problems| BadFile::new(text, problems))
    }
}

/// The state to which the node goes back.
const STATE: &str = "nmt_state";
const PRE_OPERATIONAL: &str = "pre-operational";

const NAMES: [&str; 3] = ["vendor_id", "product_code", "revision_number"];

fn from_table(file: &Table<'_>) -> Result<Journal, Problem> {
    file.takes_only(&[&NAMES[..], &["node", "undo", "whole", STATE]].concat())?;
    if !file.need("whole", "true at its end; it was not written to its end")?.flag("true")? {
        return Err(Problem::new(file.place(), "it was not written to its end"));
    }
    let id = file.need("node", "a node-ID")?;
    let id = node(&id.whole::<u8>("a node-ID")?.to_string()).map_err(|reason| id.problem(reason))?;
    let number = |name| file.get(name).map(|field| field.whole::<u32>("a number of 32 bits")).transpose();
    let identity = Identity {
        device_type: None,
        vendor_id: number(NAMES[0])?,
        product_code: number(NAMES[1])?,
        revision_number: number(NAMES[2])?,
    };
    let pre_operational = match file.get(STATE) {
        None => false,
        Some(field) if field.text(PRE_OPERATIONAL)? == PRE_OPERATIONAL => true,
        Some(field) => return Err(field.wrong(PRE_OPERATIONAL)),
    };
    let undo = file.need("undo", EXPECTED)?.list(EXPECTED)?;
    Ok(Journal { node: id, identity, pre_operational, undo: undo.iter().map(write).collect::<Result<_, _>>()? })
}

fn write(field: &Field<'_>) -> Result<(Mux, Vec<u8>), Problem> {
    let parts = field.list(EXPECTED)?;
    let [place, bytes] = &parts[..] else { return Err(field.wrong(EXPECTED)) };
    let ObjectArg::Mux(mux) = object(place.text(EXPECTED)?).map_err(|reason| place.problem(reason))? else {
        return Err(place.wrong(EXPECTED));
    };
    let digits = bytes.text(EXPECTED)?;
    // A text object may have been empty.
    if digits.is_empty() {
        return Ok((mux, Vec::new()));
    }
    Ok((mux, bytes_in_hexadecimal(digits).map_err(|reason| bytes.problem(reason))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn journal() -> Journal {
        let identity = Identity { vendor_id: Some(0x100), ..Identity::default() };
        let undo = vec![(Mux::new(0x1800, 1), vec![0x84, 1, 0, 0x80]), (Mux::new(0x2000, 0), Vec::new())];
        Journal { node: NodeId::new(4).expect("a node-ID"), identity, pre_operational: true, undo }
    }

    #[test]
    fn a_journal_reads_back_as_it_was_written() {
        assert_eq!(Journal::parse(&journal().print()).unwrap_or_else(|bad| panic!("{bad}")), journal());
    }

    #[test]
    fn a_journal_that_was_cut_off_anywhere_is_refused() {
        let text = journal().print();
        let end = text.trim_end().len();
        for length in 0..end {
            assert!(Journal::parse(&text[..length]).is_err(), "{length} of {end}");
        }
    }
}
