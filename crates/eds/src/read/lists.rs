//! The three lists of objects.

use std::collections::HashMap;

use super::reader::{Reader, shortened};
use crate::List;
use crate::Rule;
use crate::document::{Document, Entry, Section};

/// Reads the lists and notes in each object where it stands.
pub(super) fn read(document: &Document, reader: &mut Reader) {
    let mut seen = HashMap::with_capacity(reader.eds.objects.len());
    for list in List::ALL {
        let mut sections = document.sections().filter(|section| section.name().eq_ignore_ascii_case(list.section()));
        let Some(section) = sections.next() else {
            continue;
        };
        for other in sections {
            reader.error_section(
                Rule::SectionTwice,
                other,
                "two sections of this name",
                format!("the one in line {}", section.line()),
            );
        }
        reader.list(list, section, &mut seen);
    }
    reader.unlisted();
}

impl Reader {
    fn list(&mut self, list: List, section: Section<'_>, seen: &mut HashMap<u16, u32>) {
        let mut said = None;
        let mut count = 0_usize;
        for entry in section.entries() {
            if entry.key.eq_ignore_ascii_case("SupportedObjects") {
                said = self.supported_objects(section, entry);
                continue;
            }
            if entry.key.is_empty() || !entry.key.bytes().all(|digit| digit.is_ascii_digit()) {
                self.warn(
                    Rule::ListLine,
                    section,
                    entry,
                    "not the number of a line of the list",
                    Some("nothing".into()),
                );
                continue;
            }
            count += 1;
            if let Some(index) = self.count::<u16>(section, entry) {
                self.listed(list, section, entry, index, seen);
            }
        }
        match said {
            Some((entry, said)) if said != count => {
                let what = format!("SupportedObjects is {said}, but {count} are listed");
                self.warn(Rule::ListCount, section, entry, what, Some("those that are listed".into()));
            }
            None => {
                self.warn_section(Rule::ListCount, section, "no SupportedObjects", Some("those that are listed".into()))
            }
            _ => {}
        }
    }

    fn supported_objects<'a>(&mut self, section: Section<'_>, entry: Entry<'a>) -> Option<(Entry<'a>, usize)> {
        if entry.value.starts_with("0x") || entry.value.starts_with("0X") {
            self.warn(
                Rule::ListCount,
                section,
                entry,
                "a count is decimal (CiA 306): strict tools refuse the file",
                None,
            );
        }
        self.count(section, entry).map(|count| (entry, count))
    }

    fn listed(&mut self, list: List, section: Section<'_>, entry: Entry<'_>, index: u16, seen: &mut HashMap<u16, u32>) {
        if let Some(line) = seen.insert(index, entry.line) {
            self.warn(
                Rule::ListedTwice,
                section,
                entry,
                format!("{index:04X}h is listed twice, first in line {line}"),
                None,
            );
            return;
        }
        if List::of(index) != list {
            self.warn(
                Rule::WrongList,
                section,
                entry,
                format!("{index:04X}h belongs into [{}]", List::of(index).section()),
                None,
            );
        }
        match self.eds.objects.binary_search_by_key(&index, |object| object.index) {
            Ok(at) => self.eds.objects[at].list = Some(list),
            Err(_) => {
                let what = format!("there is no section [{}]", shortened(&format!("{index:04X}")));
                self.error(Rule::ListedWithoutSection, section, entry, what, "no such object");
            }
        }
    }

    fn unlisted(&mut self) {
        let lines: Vec<(u32, u16)> = self
            .eds
            .objects
            .iter()
            .filter(|object| object.list.is_none())
            .map(|object| (object.line, object.index))
            .collect();
        for (line, index) in lines {
            let what = format!("the object stands in none of the lists: [{}] misses it", List::of(index).section());
            let taken = Some("an object like the others".into());
            self.find(Rule::Unlisted, crate::Severity::Warning, (&format!("{index:04X}"), None, line), what, taken);
        }
    }
}
