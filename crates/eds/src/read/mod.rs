//! Reading: from the lines of a [`Document`] to an [`Eds`], with a [`Finding`] for each thing that is not as CiA 306 has
//! it. Nothing of a file is dropped in silence.

mod compact;
mod compact_pdo;
mod fields;
mod info;
mod lists;
mod objects;
mod places;
mod reader;
mod values;

use crate::document::Document;
use crate::{Eds, Findings, Refusal, check};

pub(crate) use places::is_about_modules;

use places::ObjectSection;
use reader::Reader;

/// What came of reading a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// What the file says.
    pub eds: Eds,
    /// What is wrong with it, by line.
    pub findings: Findings,
}

impl Eds {
    /// Reads a file's bytes.
    ///
    /// # Errors
    /// Only what is too large or no text is refused ([`Document::parse`], and more values than a file may have). All else
    /// is read, and what is wrong is among the findings.
    pub fn load(bytes: &[u8]) -> Result<Reading, Refusal> {
        Self::read(&Document::parse(bytes)?)
    }

    /// Reads a document.
    ///
    /// # Errors
    /// If there are no sections in it, or if its `CompactSubObj` and `CompactPDO` make more values than are read.
    pub fn read(document: &Document) -> Result<Reading, Refusal> {
        let mut reader = Reader::default();
        reader.strays(document)?;
        let mut parts: Vec<ObjectSection<'_>> = Vec::with_capacity(document.sections().size_hint().0);
        for section in document.sections() {
            reader.section(section, &mut parts);
        }
        // Stable: of two sections of one name the first comes first.
        parts.sort_by_key(|part| part.key);
        reader.objects(&parts)?;
        reader.compact_pdos()?;
        lists::read(document, &mut reader);
        check::all(document, &reader.eds, &mut reader.findings);
        reader.findings.sort();
        Ok(Reading { eds: reader.eds, findings: reader.findings })
    }
}

#[cfg(test)]
mod tests;
