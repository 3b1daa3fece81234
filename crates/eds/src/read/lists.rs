//! The three lists of objects.

use std::collections::HashMap;

use super::reader::{AS_IT_STANDS, Reader, shortened};
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
            reader.section_twice(other, section.line());
        }
        reader.list(list, section, &mut seen);
    }
    reader.unlisted();
}

impl Reader {
    fn list(&mut self, list: List, section: Section<'_>, seen: &mut HashMap<u16, u32>) {
        let mut said = None;
        let mut count = 0_usize;
        for entry in self.entries(section) {
            if entry.key.eq_ignore_ascii_case("SupportedObjects") {
                said = self.supported_objects(section, entry);
                continue;
            }
            if entry.key.is_empty() || !entry.key.bytes().all(|digit| digit.is_ascii_digit()) {
                self.found(Rule::ListLine, section, entry, "not the number of a line of the list", "nothing");
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
                self.found(Rule::ListCount, section, entry, what, "those that are listed");
            }
            None => self.found_in(Rule::ListCount, section, "no SupportedObjects", "those that are listed"),
            _ => {}
        }
    }

    fn supported_objects<'a>(&mut self, section: Section<'_>, entry: Entry<'a>) -> Option<(Entry<'a>, usize)> {
        if entry.value.starts_with("0x") || entry.value.starts_with("0X") {
            self.found(
                Rule::ListCount,
                section,
                entry,
                "a count is decimal (CiA 306): strict tools refuse the file",
                AS_IT_STANDS,
            );
        }
        self.count(section, entry).map(|count| (entry, count))
    }

    fn listed(&mut self, list: List, section: Section<'_>, entry: Entry<'_>, index: u16, seen: &mut HashMap<u16, u32>) {
        if let Some(line) = seen.insert(index, entry.line) {
            self.found(
                Rule::ListedTwice,
                section,
                entry,
                format!("{index:04X}h is listed twice, first in line {line}"),
                AS_IT_STANDS,
            );
            return;
        }
        if List::of(index) != list {
            self.found(
                Rule::WrongList,
                section,
                entry,
                format!("{index:04X}h belongs into [{}]", List::of(index).section()),
                AS_IT_STANDS,
            );
        }
        match self.eds.objects.binary_search_by_key(&index, |object| object.index) {
            Ok(at) => self.eds.objects[at].list = Some(list),
            Err(_) => {
                let what = format!("there is no section [{}]", shortened(&format!("{index:04X}")));
                self.found(Rule::ListedWithoutSection, section, entry, what, "no such object");
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
            self.push((line, &format!("{index:04X}"), None), Rule::Unlisted, what, taken);
        }
    }
}
