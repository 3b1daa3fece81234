//! What a section is, by its name.

use crate::document::Section;

/// A section of an object.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectSection<'a> {
    pub(super) key: Key,
    pub(super) section: Section<'a>,
}

/// Where in the dictionary a section belongs, in the order in which objects are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) index: u16,
    pub(super) role: Role,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// `[1018]`.
    Object,
    /// `[1018sub1]`.
    Sub(u8),
    /// `[1018Name]`: names of compact sub-objects.
    Names,
    /// `[1018Value]`: default values of compact sub-objects, in a DCF their values.
    Values,
    /// `[1018Denotation]`: their names in a plan.
    Denotations,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SectionPlace {
    Part(Key),
    Info(Info),
    /// One of the three lists.
    List,
    /// About the modules of a modular device.
    Module,
    Unknown,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Info {
    File,
    Device,
    Dummies,
    Comments,
    Commissioning,
    DynamicChannels,
}

/// Sections that are not objects.
const NAMED: &[(&str, SectionPlace)] = &[
    ("FileInfo", SectionPlace::Info(Info::File)),
    ("DeviceInfo", SectionPlace::Info(Info::Device)),
    ("DummyUsage", SectionPlace::Info(Info::Dummies)),
    ("Comments", SectionPlace::Info(Info::Comments)),
    ("DeviceComissioning", SectionPlace::Info(Info::Commissioning)),
    ("DeviceCommissioning", SectionPlace::Info(Info::Commissioning)),
    ("DynamicChannels", SectionPlace::Info(Info::DynamicChannels)),
    ("MandatoryObjects", SectionPlace::List),
    ("OptionalObjects", SectionPlace::List),
    ("ManufacturerObjects", SectionPlace::List),
    ("SupportedModules", SectionPlace::Module),
    ("ConnectedModules", SectionPlace::Module),
];

pub(super) fn place(name: &str) -> SectionPlace {
    if let Some(part) = part(name) {
        return SectionPlace::Part(part);
    }
    let named = NAMED.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
    named.map_or_else(
        || if is_of_module(name) { SectionPlace::Module } else { SectionPlace::Unknown },
        |(_, place)| *place,
    )
}

/// True for the sections of a modular device and its modules (CiA 306-1, clause 4.7).
pub(crate) fn is_about_modules(name: &str) -> bool {
    place(name) == SectionPlace::Module
}

/// `1018`, `1018sub1`, `1018Value`.
fn part(name: &str) -> Option<Key> {
    let (digits, rest) = name.split_at_checked(4)?;
    if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let index = u16::from_str_radix(digits, 16).ok()?;
    let is = |word: &str| rest.eq_ignore_ascii_case(word);
    let role = match rest {
        "" => Role::Object,
        _ if is("Name") => Role::Names,
        _ if is("Value") => Role::Values,
        _ if is("Denotation") => Role::Denotations,
        _ => {
            let (sub, digits) = rest.split_at_checked(3)?;
            let well = sub.eq_ignore_ascii_case("sub") && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            Role::Sub(if well { u8::from_str_radix(digits, 16).ok()? } else { return None })
        }
    };
    Some(Key { index, role })
}

/// `M1ModuleInfo`, `M2FixedObjects`, `M1SubExt2000`, ...
fn is_of_module(name: &str) -> bool {
    let Some(rest) = name.strip_prefix(['M', 'm']) else { return false };
    let word = rest.trim_start_matches(|digit: char| digit.is_ascii_digit());
    let begins = |with: &str| word.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with));
    word.len() < rest.len() && ["ModuleInfo", "FixedObjects", "SubExt", "Comments", "Fixed"].into_iter().any(begins)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(index: u16, role: Role) -> SectionPlace {
        SectionPlace::Part(Key { index, role })
    }

    #[test]
    fn names_of_sections_are_read_in_any_case() {
        assert_eq!(place("1018"), key(0x1018, Role::Object));
        assert_eq!(place("1a00SUB1f"), key(0x1A00, Role::Sub(0x1F)));
        assert_eq!(place("1A00sub01"), key(0x1A00, Role::Sub(1)));
        assert_eq!(place("1600value"), key(0x1600, Role::Values));
        assert_eq!(place("devicecommissioning"), SectionPlace::Info(Info::Commissioning));
        assert_eq!(place("M12ModuleInfo"), SectionPlace::Module);
        for name in [
            "",
            "101",
            "10180",
            "1018sub",
            "1018sub100",
            "1018sub+1",
            "+018",
            "Mandatory",
            "MModuleInfo",
            "\u{e4}\u{e4}\u{e4}",
        ] {
            assert_eq!(place(name), SectionPlace::Unknown, "{name}");
        }
    }
}
