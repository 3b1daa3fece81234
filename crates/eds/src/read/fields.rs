//! The entries of one object's section, each found once.

use super::reader::Reader;
use crate::Rule;
use crate::document::{Entry, Section};

/// What an object's section may have.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fields<'a> {
    pub(super) parameter_name: Option<Entry<'a>>,
    pub(super) object_type: Option<Entry<'a>>,
    pub(super) data_type: Option<Entry<'a>>,
    pub(super) access_type: Option<Entry<'a>>,
    pub(super) default_value: Option<Entry<'a>>,
    pub(super) low_limit: Option<Entry<'a>>,
    pub(super) high_limit: Option<Entry<'a>>,
    pub(super) pdo_mapping: Option<Entry<'a>>,
    pub(super) sub_number: Option<Entry<'a>>,
    pub(super) compact_sub_obj: Option<Entry<'a>>,
    pub(super) obj_flags: Option<Entry<'a>>,
    pub(super) parameter_value: Option<Entry<'a>>,
    pub(super) denotation: Option<Entry<'a>>,
    pub(super) upload_file: Option<Entry<'a>>,
    pub(super) download_file: Option<Entry<'a>>,
}

impl<'a> Fields<'a> {
    fn of(&mut self, key: &str) -> Option<&mut Option<Entry<'a>>> {
        let is = |name: &str| key.eq_ignore_ascii_case(name);
        // Lengths distinguish nearly all keys, so that a look at each costs no more than a comparison.
        Some(match key.len() {
            8 if is("DataType") => &mut self.data_type,
            8 if is("LowLimit") => &mut self.low_limit,
            8 if is("ObjFlags") => &mut self.obj_flags,
            9 if is("HighLimit") => &mut self.high_limit,
            9 if is("SubNumber") => &mut self.sub_number,
            10 if is("ObjectType") => &mut self.object_type,
            10 if is("AccessType") => &mut self.access_type,
            10 if is("PDOMapping") => &mut self.pdo_mapping,
            10 if is("Denotation") => &mut self.denotation,
            10 if is("UploadFile") => &mut self.upload_file,
            12 if is("DefaultValue") => &mut self.default_value,
            12 if is("DownloadFile") => &mut self.download_file,
            13 if is("ParameterName") => &mut self.parameter_name,
            13 if is("CompactSubObj") => &mut self.compact_sub_obj,
            14 if is("ParameterValue") => &mut self.parameter_value,
            _ => return None,
        })
    }
}

impl Reader {
    /// The entries of a section, with findings about those that it may not have, or not twice.
    pub(super) fn fields<'a>(&mut self, section: Section<'a>) -> Fields<'a> {
        let mut fields = Fields::default();
        for entry in section.entries() {
            match fields.of(entry.key) {
                Some(place @ None) => *place = Some(entry),
                Some(Some(first)) => {
                    let first = *first;
                    self.key_twice(section, entry, first);
                }
                None => self.found(Rule::UnknownKey, section, entry, "CiA 306 has no such key of an object", "nothing"),
            }
        }
        fields
    }
}
