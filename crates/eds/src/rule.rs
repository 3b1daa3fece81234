//! The rules by which a file is looked at, with the numbers that stay.
//!
//! 1xx is the file as text, 2xx objects and lists, 3xx values, 4xx the device as a whole. A number is never given to another rule.

/// A table of rules.
macro_rules! rules {
    ($($(#[doc = $doc:literal])+ $rule:ident = $number:literal, $title:literal, $taken:literal;)*) => {
        /// What may be wrong with a file.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Rule {
            $($(#[doc = $doc])+ $rule,)*
        }

        impl Rule {
            /// All rules, by their numbers.
            pub const ALL: &'static [Self] = &[$(Self::$rule),*];

            /// Its number, which stays: `EDS101`.
            pub const fn id(self) -> &'static str {
                match self { $(Self::$rule => concat!("EDS", $number),)* }
            }

            /// What is wrong, in a line.
            pub const fn title(self) -> &'static str {
                match self { $(Self::$rule => $title,)* }
            }

            /// What is taken instead.
            pub const fn taken(self) -> &'static str {
                match self { $(Self::$rule => $taken,)* }
            }
        }
    };
}

rules! {
    /// A line that is nothing.
    Stray = 101, "a line that is not a section, a key with a value or a comment", "nothing";
    /// A heading that is more than a name in brackets.
    Heading = 102, "a heading that is not [name] and nothing else", "the name";
    /// Two sections of one name.
    SectionTwice = 103, "two sections of one name", "the first";
    /// Two lines of one key.
    KeyTwice = 104, "two lines of one key", "the first";
    /// A key that CiA 306 does not have.
    UnknownKey = 105, "a key that CiA 306 does not have there", "nothing";
    /// A section that CiA 306 does not have, or of modules.
    UnknownSection = 106, "a section that CiA 306 does not have, or one about modules", "nothing; it is kept as it is";
    /// Letters beyond ASCII.
    Letters = 107, "letters beyond ASCII", "as they stand";
    /// A line of a list that is not numbered.
    ListLine = 201, "a line of a list of objects that is not numbered", "nothing";
    /// The count of a list.
    ListCount = 202, "SupportedObjects missing, hexadecimal, or another count than is listed", "those that are listed";
    /// An object that is listed twice.
    ListedTwice = 203, "an object that is listed twice", "the first";
    /// An object in the wrong list.
    WrongList = 204, "an object in the wrong list", "an object like the others";
    /// An object that is listed and not there.
    ListedWithoutSection = 205, "a listed object without a section", "no such object";
    /// An object in no list.
    Unlisted = 206, "an object in no list", "an object like the others";
    /// Sub-objects of an object that is not there.
    SubWithoutObject = 207, "sub-objects of an object without a section", "a RECORD without a name, or nothing";
    /// The type of an object.
    ObjectType = 208, "a type of object that there is not, or that does not fit its sub-objects", "RECORD or VAR";
    /// A record without sub-objects.
    NoSubObjects = 209, "a RECORD or ARRAY without sub-objects", "a VAR, if it has a type";
    /// Another number of sub-objects than is said.
    SubNumber = 210, "SubNumber missing, or another number than there are sub-objects", "those that are there";
    /// No sub-index 0.
    NoCount = 211, "no sub-index 00h in a record", "what is there";
    /// The type of sub-index 0.
    CountType = 212, "sub-index 00h that is not UNSIGNED8", "as it stands";
    /// Sub-index 0 counts too far.
    CountTooHigh = 213, "sub-index 00h that counts to more than there is", "as it stands";
    /// Compact storage and sections.
    CompactAndSections = 214, "CompactSubObj and sections of sub-objects", "the sections";
    /// An entry of compact storage that is not there.
    CompactEntry = 215, "a value or name of a compact sub-object that there is not", "nothing";
    /// An object without a name.
    Name = 216, "no ParameterName", "no name";
    /// A name at which tools cut a line.
    CutName = 217, "a name with #, ; or =", "as it stands";
    /// No data type, or one that there is not.
    DataType = 301, "no data type, or one that there is not", "UNSIGNED32; DOMAIN for a DOMAIN";
    /// No access type, or one that there is not.
    AccessType = 302, "no access type, or one that there is not", "ro; rw for a DOMAIN";
    /// A value that is not a number.
    NotANumber = 303, "a value that is not a number of its type", "none";
    /// A number beyond its type.
    BeyondType = 304, "a number beyond its type", "none";
    /// The bits of another number.
    SameBits = 305, "a number beyond its type that has the bits of one within", "the number of the same bits";
    /// A number that is written otherwise than CiA 306 has it.
    OddNumber = 306, "a number that is written otherwise than CiA 306 has it", "the number";
    /// The bits of a REAL.
    RealBits = 307, "hexadecimal digits for a REAL", "the number that these bits are";
    /// A low limit above the high one.
    LimitsCrossed = 308, "a low limit above the high limit", "no limits";
    /// A default outside of its limits.
    DefaultOutside = 309, "a default outside of its limits", "the default, without that limit";
    /// A value outside of its limits.
    ValueOutside = 310, "a value of a DCF outside of its limits", "the value";
    /// A node-ID that is none.
    NodeId = 311, "a node-ID that is not 1 to 127", "none";
    /// A mandatory object is missing.
    Mandatory = 401, "1000h, 1001h or 1018h missing", "a device without it";
    /// A drive that says no mode.
    Modes = 402, "6502h of a drive without a value, or 0", "the modes whose objects are there";
    /// An identifier without the node-ID.
    Identifier = 403, "an identifier of the pre-defined connection set without $NODEID", "as it stands";
    /// What is mapped as delivered.
    Mapping = 404, "mapped as delivered: an object that is not there, may not be mapped, or has another length", "as it stands";
    /// More than a PDO holds.
    MappingLength = 405, "more than 64 bits mapped as delivered", "as it stands";
}

#[cfg(test)]
mod tests {
    use super::Rule;
    use crate::Eds;

    const RIGHT: &str = "[FileInfo]\nFileName=a.eds\n[DeviceInfo]\nVendorName=a\n[MandatoryObjects]\nSupportedObjects=3\n\
        1=0x1000\n2=0x1001\n3=0x1018\n[OptionalObjects]\nSupportedObjects=0\n[ManufacturerObjects]\nSupportedObjects=1\n1=0x2000\n\
        [1000]\nParameterName=Type\nDataType=7\nAccessType=ro\nDefaultValue=0\n\
        [1001]\nParameterName=Register\nDataType=5\nAccessType=ro\n\
        [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n\
        [1018sub0]\nParameterName=Count\nDataType=5\nAccessType=const\nDefaultValue=1\n\
        [1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\nDefaultValue=1\n\
        [2000]\nParameterName=Speed\nDataType=6\nAccessType=rw\nDefaultValue=5\nLowLimit=1\nHighLimit=9\n";

    fn found(text: &str) -> Vec<&'static str> {
        Eds::load(text.as_bytes()).unwrap().findings.iter().map(|finding| finding.rule.id()).collect()
    }

    #[test]
    fn numbers_ascend_and_no_two_rules_have_one() {
        assert!(Rule::ALL.windows(2).all(|pair| pair[0].id() < pair[1].id()));
    }

    #[test]
    fn a_right_file_breaks_no_rule_and_one_change_breaks_its_own() {
        assert_eq!(found(RIGHT), [""; 0]);
        for (rule, before, after) in [
            (Rule::Stray, "[2000]\n", "[2000]\nnothing\n"),
            (Rule::Heading, "[2000]\n", "[2000] x\n"),
            (Rule::KeyTwice, "DefaultValue=5\n", "DefaultValue=5\nDefaultValue=6\n"),
            (Rule::UnknownKey, "DefaultValue=5\n", "DefaultValue=5\nColour=6\n"),
            (Rule::UnknownSection, "[2000]\n", "[Colours]\nRed=1\n[2000]\n"),
            (Rule::Letters, "=Speed", "=V\u{e4}lue"),
            (Rule::ListLine, "1=0x2000\n", "1=0x2000\nfirst=0x2000\n"),
            (Rule::ListCount, "SupportedObjects=1\n", "SupportedObjects=2\n"),
            (Rule::ListedWithoutSection, "SupportedObjects=1\n1=0x2000\n", "SupportedObjects=2\n1=0x2000\n2=0x2001\n"),
            (Rule::Unlisted, "SupportedObjects=1\n1=0x2000\n", "SupportedObjects=0\n"),
            (Rule::ObjectType, "ObjectType=9\n", "ObjectType=7\n"),
            (Rule::SubNumber, "SubNumber=2\n", "SubNumber=3\n"),
            (Rule::CountType, "Count\nDataType=5", "Count\nDataType=6"),
            (Rule::CountTooHigh, "AccessType=const\nDefaultValue=1", "AccessType=const\nDefaultValue=4"),
            (Rule::Name, "ParameterName=Speed\n", ""),
            (Rule::CutName, "=Speed", "=Speed#1"),
            (Rule::DataType, "Speed\nDataType=6\n", "Speed\n"),
            (Rule::AccessType, "AccessType=rw", "AccessType=maybe"),
            (Rule::NotANumber, "DefaultValue=5\n", "DefaultValue=five\n"),
            (Rule::BeyondType, "HighLimit=9", "HighLimit=70000"),
            (Rule::SameBits, "DefaultValue=5\nLowLimit=1\nHighLimit=9\n", "DefaultValue=-1\n"),
            (Rule::OddNumber, "DefaultValue=5\n", "DefaultValue=5LL\n"),
            (Rule::LimitsCrossed, "LowLimit=1\n", "LowLimit=10\n"),
            (Rule::DefaultOutside, "LowLimit=1\n", "LowLimit=6\n"),
        ] {
            let text = RIGHT.replacen(before, after, 1);
            assert_ne!(text, RIGHT, "{rule:?}");
            let found = found(&text);
            assert!(found.contains(&rule.id()), "{rule:?} ({}): {found:?}", rule.id());
        }
    }
}
