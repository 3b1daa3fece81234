//! The rules by which a file is looked at, with the numbers that stay.
//!
//! 1xx is the file as text, 2xx objects and lists, 3xx values, 4xx the device as a whole. A number is never given to another rule.
//! `ferrodrive eds lint --explain` and the page `docs/eds_rules.md` are made of this table. Clauses of CiA 306-1 are named by
//! their titles where editions number them differently.

use crate::Severity;

/// A table of rules.
macro_rules! rules {
    ($($(#[doc = $doc:literal])+ $rule:ident = $number:literal, $severity:ident, $title:literal, $taken:literal, $clause:literal,
        $why:literal, $wrong:literal => $right:literal;)*) => {
        /// What may be wrong with a file.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Rule {
            $($(#[doc = $doc])+ $rule,)*
        }

        impl Rule {
            /// All rules, by their numbers.
            pub const ALL: &'static [Self] = &[$(Self::$rule),*];

            /// What is said of it.
            pub const fn explanation(self) -> &'static Explanation {
                match self {
                    $(Self::$rule => &Explanation {
                        id: concat!("EDS", $number),
                        severity: Severity::$severity,
                        title: $title,
                        taken: $taken,
                        clause: $clause,
                        why: $why,
                        wrong: $wrong,
                        right: $right,
                    },)*
                }
            }
        }
    };
}

/// What is said of a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// Its number, which stays: `EDS101`.
    pub id: &'static str,
    /// How bad a breach of it is.
    pub severity: Severity,
    /// What is wrong, in a line.
    pub title: &'static str,
    /// What is taken instead.
    pub taken: &'static str,
    /// Where a standard has it: document and clause, or the clause's title.
    pub clause: &'static str,
    /// Why it matters, in a sentence or two.
    pub why: &'static str,
    /// Lines of a file that break this rule; a line `...` stands for those between.
    pub wrong: &'static str,
    /// The same lines put right, part by part.
    pub right: &'static str,
}

impl Rule {
    /// Its number, which stays: `EDS101`.
    pub const fn id(self) -> &'static str {
        self.explanation().id
    }

    /// The rule of a number as people type it: `EDS216`, `eds216`, `216`.
    pub fn of(text: &str) -> Option<Self> {
        let number = |text: &str| text.trim_start_matches(|letter: char| letter.is_ascii_alphabetic()).to_owned();
        let is_id = text.len() == 3 || text.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("EDS"));
        Self::ALL.iter().copied().find(|rule| is_id && number(rule.id()) == number(text))
    }
}

rules! {
    /// A line that is nothing.
    Stray = 101, Warning, "a line that is not a section, a key with a value or a comment", "nothing",
        "CiA 306-1, basic structure",
        "A remark without its semicolon, or half of a line that was broken. Readers built on a common INI \
        library refuse the whole file for it.",
        "ParameterName=Speed limit\nthe lower of the two acts" => "ParameterName=Speed limit\n; the lower of the two acts";
    /// A heading that is more than a name in brackets.
    Heading = 102, Warning, "a heading that is not [name] and nothing else", "the name",
        "CiA 306-1, basic structure",
        "One reader takes what stands behind the bracket for a remark, another for a part of the name, and \
        then does not find the object.",
        "[2003] ratio of the gear" => "[2003]";
    /// Two sections of one name.
    SectionTwice = 103, Error, "two sections of one name", "the first",
        "CiA 306-1, basic structure",
        "Which of the two is meant is not said: one reader takes the first, another the last, a third refuses \
        the file. It is often an object that was copied and not renumbered.",
        "[FileInfo]\nFileName=axis.dcf\n[FileInfo]\nCreatedBy=A. Maker" => "[FileInfo]\nFileName=axis.dcf\nCreatedBy=A. Maker";
    /// Two lines of one key.
    KeyTwice = 104, Warning, "two lines of one key", "the first",
        "CiA 306-1, basic structure",
        "As with two sections: readers differ in which line they take, so that two tools configure one device \
        differently.",
        "LowLimit=100\nLowLimit=200\nHighLimit=900" => "LowLimit=100\nHighLimit=900";
    /// A key that CiA 306 does not have.
    UnknownKey = 105, Warning, "a key that CiA 306 does not have there", "nothing",
        "CiA 306-1, file information, general device information, object dictionary",
        "A spelling mistake (`Defaultvalue1`) is read by no tool, and the value is missing. Makers also \
        add keys of their own, which other tools do not know.",
        "Unit=r/min" => "; unit: r/min";
    /// A section that CiA 306 does not have, or of modules.
    UnknownSection = 106, Warning, "a section that CiA 306 does not have, or one about modules", "nothing; it is kept as it is",
        "CiA 306-1, basic structure; modules: 4.7",
        "Only its maker's tools know what it means. Of modules (`[M1ModuleInfo]`, \
        `[SupportedModules]`, ...) the file does not say which are plugged in, so that their objects are not \
        read; a coupler with modules has to have them as objects of the device.",
        "[Notes]\nLines=1\nLine1=Made for the left wheel" => "[Comments]\nLines=1\nLine1=Made for the left wheel";
    /// Letters beyond ASCII.
    Letters = 107, Warning, "letters beyond ASCII", "as they stand",
        "CiA 306-1, basic structure",
        "The file does not say how they are coded. UTF-8 that is read as Latin-1, or the reverse, shows other \
        letters, and some readers refuse the bytes.",
        "ProductName=M\u{f6}bius 40" => "ProductName=Moebius 40";
    /// A line of a list that is not numbered.
    ListLine = 201, Warning, "a line of a list of objects that is not numbered", "nothing",
        "CiA 306-1, object dictionary",
        "A list has `SupportedObjects` and lines numbered from 1. Readers that count up from 1 do not see \
        another line.",
        "3=0x1018\nIdentity=0x1018" => "3=0x1018";
    /// The count of a list.
    ListCount = 202, Warning, "SupportedObjects missing, hexadecimal, or another count than is listed", "those that are listed",
        "CiA 306-1, object dictionary",
        "A reader that believes the count stops too early, or looks for lines that are not there. The count \
        is decimal; strict tools refuse a hexadecimal one.",
        "[MandatoryObjects]\nSupportedObjects=0x3" => "[MandatoryObjects]\nSupportedObjects=3";
    /// An object that is listed twice.
    ListedTwice = 203, Warning, "an object that is listed twice", "the first",
        "CiA 306-1, object dictionary",
        "The count does not agree with the number of objects, and a tool that makes an entry per line has the \
        object twice.",
        "[ManufacturerObjects]\nSupportedObjects=6\n1=0x2000\n6=0x2000" => "[ManufacturerObjects]\nSupportedObjects=5\n1=0x2000";
    /// An object in the wrong list.
    WrongList = 204, Warning, "an object in the wrong list", "an object like the others",
        "CiA 306-1, object dictionary",
        "1000h, 1001h and 1018h belong into `[MandatoryObjects]`, 2000h to 5FFFh into \
        `[ManufacturerObjects]`, all others into `[OptionalObjects]`. A test tool asks a device for what is \
        listed as mandatory, and for no more.",
        "[MandatoryObjects]\nSupportedObjects=4\n4=0x1014\n...\n[OptionalObjects]\nSupportedObjects=7" => "[MandatoryObjects]\nSupportedObjects=3\n...\n[OptionalObjects]\nSupportedObjects=8\n1=0x1014";
    /// An object that is listed and not there.
    ListedWithoutSection = 205, Error, "a listed object without a section", "no such object",
        "CiA 306-1, object dictionary",
        "Its type, access and default are not said, so that no tool can read or write it by this file.",
        "[ManufacturerObjects]\nSupportedObjects=6\n6=0x20FF" => "[ManufacturerObjects]\nSupportedObjects=5";
    /// An object in no list.
    Unlisted = 206, Warning, "an object in no list", "an object like the others",
        "CiA 306-1, object dictionary",
        "Tools that go by the lists do not have the object, those that go by the sections do.",
        "[ManufacturerObjects]\nSupportedObjects=4" => "[ManufacturerObjects]\nSupportedObjects=5\n1=0x2000";
    /// Sub-objects of an object that is not there.
    SubWithoutObject = 207, Error, "sub-objects of an object without a section", "a RECORD without a name, or nothing",
        "CiA 306-1, object dictionary",
        "Whether it is an ARRAY or a RECORD, what it is called and how many sub-objects it has stands in the \
        section of the object.",
        "[2001sub0]" => "[2001]\nParameterName=Gains\nObjectType=9\nSubNumber=2\n[2001sub0]";
    /// The type of an object.
    ObjectType = 208, Error, "a type of object that there is not, or that does not fit its sub-objects", "RECORD or VAR",
        "CiA 306-1, object dictionary; CiA 301, 7.4.3",
        "`ObjectType` is 2 (DOMAIN), 5 (DEFTYPE), 6 (DEFSTRUCT), 7 (VAR), 8 (ARRAY) or 9 (RECORD), and 7 \
        where the key is missing. A reader that takes a VAR at its word does not look for its sub-objects.",
        "ParameterName=Gains\nObjectType=7" => "ParameterName=Gains\nObjectType=9";
    /// A record without sub-objects.
    NoSubObjects = 209, Error, "a RECORD or ARRAY without sub-objects", "a VAR, if it has a type",
        "CiA 306-1, object dictionary; CiA 301, 7.4.3",
        "A RECORD has its values in sub-objects. Without them there is nothing to read but what a VAR has.",
        "ParameterName=Ratio\nObjectType=9" => "ParameterName=Ratio\nObjectType=7";
    /// Another number of sub-objects than is said.
    SubNumber = 210, Warning, "SubNumber missing, or another number than there are sub-objects", "those that are there",
        "CiA 306-1, object dictionary",
        "`SubNumber` counts the sections of sub-objects, sub-index 00h included. A reader that believes it \
        looks for a section that is not there, or misses the last.",
        "ParameterName=Gains\nObjectType=9\nSubNumber=3" => "ParameterName=Gains\nObjectType=9\nSubNumber=2";
    /// No sub-index 0.
    NoCount = 211, Error, "no sub-index 00h in a record", "what is there",
        "CiA 301, 7.4.6",
        "Every ARRAY and RECORD has it: the highest sub-index that is there. A master that reads it first \
        gets an abort.",
        "SubNumber=1\n[2001sub1]" => "SubNumber=2\n[2001sub0]\nParameterName=Highest \
        sub-index\nDataType=5\nAccessType=const\nDefaultValue=1\n[2001sub1]";
    /// The type of sub-index 0.
    CountType = 212, Warning, "sub-index 00h that is not UNSIGNED8", "as it stands",
        "CiA 301, 7.4.6",
        "A master that reads or writes one byte, as the standard has it, is answered with the abort code of a \
        wrong length.",
        "[2001sub0]\nParameterName=Highest sub-index\nDataType=6" => "[2001sub0]\nParameterName=Highest sub-index\nDataType=5";
    /// Sub-index 0 counts too far.
    CountTooHigh = 213, Warning, "sub-index 00h that counts to more than there is", "as it stands",
        "CiA 301, 7.4.6",
        "A tool that reads all sub-indices up to the count reads some that are not there. The count may be \
        less than what is described (1003h, a mapping), never more.",
        "[2001sub0]\nParameterName=Highest sub-index\nDataType=5\nAccessType=const\nDefaultValue=4" => "[2001sub0]\nParameterName=Highest sub-index\nDataType=5\nAccessType=const\nDefaultValue=1";
    /// Compact storage and sections.
    CompactAndSections = 214, Warning, "CompactSubObj and sections of sub-objects", "the sections",
        "CiA 306-1, 4.6.3.4",
        "`CompactSubObj` stands in place of the sections. With both, one reader takes its sub-objects from \
        here and another from there.",
        "SubNumber=2\nCompactSubObj=1\n[2001sub0]" => "SubNumber=2\n[2001sub0]";
    /// An entry of compact storage that is not there.
    CompactEntry = 215, Error, "a value or name of a compact sub-object that there is not", "nothing",
        "CiA 306-1, 4.6.3.4",
        "`CompactSubObj` says how many sub-objects there are, and this is one beyond them; the value is lost.",
        "NrOfEntries=1\n9=40" => "NrOfEntries=1\n2=40";
    /// An object without a name.
    Name = 216, Warning, "no ParameterName", "no name",
        "CiA 306-1, object dictionary",
        "The key is mandatory, and tools that use names cannot show the object, or refuse the file.",
        "[2003]\nObjectType=7" => "[2003]\nParameterName=Ratio\nObjectType=7";
    /// A name at which tools cut a line.
    CutName = 217, Warning, "a name with #, ; or =", "as it stands",
        "CiA 306-1, basic structure",
        "Where a remark or a value begins is decided differently by the INI libraries that tools use: the \
        name is cut, and two objects may have one name.",
        "ParameterName=Torque limit #1" => "ParameterName=Torque limit 1";
    /// No data type, or one that there is not.
    DataType = 301, Error, "no data type, or one that there is not", "UNSIGNED32; DOMAIN for a DOMAIN",
        "CiA 306-1, object dictionary; CiA 301, 7.4.7",
        "The length of the value is not known: a master that guesses it is answered with an abort, or maps \
        the object with a wrong length.",
        "DataType=0x40\nAccessType=rw\nCompactSubObj=3" => "DataType=6\nAccessType=rw\nCompactSubObj=3";
    /// No access type, or one that there is not.
    AccessType = 302, Error, "no access type, or one that there is not", "ro; rw for a DOMAIN",
        "CiA 306-1, object dictionary",
        "It is ro, wo, rw, rwr, rww or const, in any case of letters. What may be written or mapped is not \
        known without it; program and data that are transferred as a DOMAIN are rw.",
        "AccessType=read/write\nCompactSubObj=3" => "AccessType=rw\nCompactSubObj=3";
    /// A value that is not a number.
    NotANumber = 303, Error, "a value that is not a number of its type", "none; decimal where a leading zero has digits 8 and 9 behind it",
        "CiA 306-1, entry value interpretation",
        "The value is not used, and the device is believed to have none. With a leading zero a number is \
        octal, which has no digits 8 and 9: whether 0800 means 800 is a guess.",
        "DefaultValue=1,5" => "DefaultValue=1.5";
    /// A number beyond its type.
    BeyondType = 304, Error, "a number beyond its type", "none",
        "CiA 306-1, object dictionary; CiA 301, 7.1.4",
        "The object cannot have this value. Often it is the type that is wrong.",
        "HighLimit=70000\nDefaultValue=500" => "HighLimit=900\nDefaultValue=500";
    /// The bits of another number.
    SameBits = 305, Warning, "a number beyond its type that has the bits of one within", "the number of the same bits",
        "CiA 306-1, object dictionary; CiA 301, 7.1.4",
        "`0xFFFF` for an INTEGER16 is meant as -1, `-1` for an UNSIGNED16 as 65535. A reader that does not \
        take the bits has 65535, or refuses the value.",
        "DefaultValue=0xFFFF" => "DefaultValue=-1";
    /// A number that is written otherwise than CiA 306 has it.
    OddNumber = 306, Warning, "a number that tools read differently, or that is written otherwise than CiA 306 has it", "the number",
        "CiA 306-1, entry value interpretation",
        "`1000h`, `1LL`, `1.0`, a flag as `true` or 2, quotes, a remark behind the number: other readers \
        refuse it or take what stands before. An octal number (a leading zero) is allowed; many tools read \
        it as decimal.",
        "HighLimit=384h\nDefaultValue=500" => "HighLimit=900\nDefaultValue=500";
    /// The bits of a REAL.
    RealBits = 307, Warning, "hexadecimal digits for a REAL", "the number that these bits are",
        "CiA 306-1, entry value interpretation; CiA 301, 7.1.4.6",
        "Here they are the bits of the number (0x3FC00000 is 1.5); another reader takes them for a whole \
        number.",
        "DefaultValue=0x3FC00000" => "DefaultValue=1.5";
    /// A low limit above the high one.
    LimitsCrossed = 308, Error, "a low limit above the high limit", "no limits",
        "CiA 306-1, object dictionary",
        "No value lies within them, so that a tool that checks before it writes refuses every value.",
        "LowLimit=900\nHighLimit=100" => "LowLimit=100\nHighLimit=900";
    /// A default outside of its limits.
    DefaultOutside = 309, Error, "a default outside of its limits", "the default, without that limit",
        "CiA 306-1, object dictionary",
        "The device is delivered with a value that the file says it cannot have. With `$NODEID` it is one \
        only if it lies outside for every node-ID.",
        "HighLimit=900\nDefaultValue=950" => "HighLimit=900\nDefaultValue=500";
    /// A value outside of its limits.
    ValueOutside = 310, Warning, "a value of a DCF outside of its limits", "the value",
        "CiA 306-1, device configuration file (5)",
        "It is what the user wants, and the device is asked; by the file it refuses the value, with 0609 \
        0031h or 0609 0032h.",
        "ParameterValue=950" => "ParameterValue=600";
    /// A node-ID out of range.
    NodeId = 311, Error, "a node-ID that is not 1 to 127", "none",
        "CiA 306-1, device configuration file (5); CiA 301, 7.3.3",
        "Identifiers are made of it: with 128 the EMCY message would have the identifier of TIME.",
        "[DeviceComissioning]\nNodeID=128" => "[DeviceComissioning]\nNodeID=4";
    /// A mandatory object is missing.
    Mandatory = 401, Error, "1000h, 1001h or 1018h missing", "a device without it",
        "CiA 301, 7.5.2; CiA 306-1, object dictionary",
        "Every device has them. A master asks for 1000h and 1018h before it starts the node, and what comes \
        back is compared with the file.",
        "[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n3=0x1018\n...\n[1018]" => "[MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n...\n[1001]\nParameterName=Error \
        register\nDataType=5\nAccessType=ro\nPDOMapping=1\n[1018]";
    /// A drive that says no mode.
    Modes = 402, Warning, "6502h of a drive without a value, or 0", "the modes whose objects are there",
        "CiA 402-2, supported drive modes (6502h)",
        "Tools that take the modes of operation from the file have none, and refuse homing or positions.",
        "DefaultValue=0\n[2000]" => "DefaultValue=0x25\n[2000]";
    /// An identifier without the node-ID.
    Identifier = 403, Warning, "an identifier of the pre-defined connection set without $NODEID", "as it stands",
        "CiA 301, 7.3.3; CiA 306-1, entry value interpretation",
        "By the file every node has the same identifier: two of them on one bus send under one identifier, \
        which is an error of the bus as soon as they do so at once.",
        "DefaultValue=0x80" => "DefaultValue=$NODEID+0x80";
    /// What is mapped as delivered.
    Mapping = 404, Warning, "mapped as delivered: an object that is not there, may not be mapped, or has another length", "as it stands",
        "CiA 301, 7.5.2.36 and 7.5.2.38",
        "A device refuses this mapping when it is written (0604 0041h, 0602 0000h), or the file describes \
        another device. `PDOMapping` has to be 1, and the access rw, wo or rww for an RPDO, rw, ro, rwr or \
        const for a TPDO.",
        "DefaultValue=0x60640010" => "DefaultValue=0x60640020";
    /// More than a PDO holds.
    MappingLength = 405, Warning, "more than 64 bits mapped as delivered", "as it stands",
        "CiA 301, 7.5.2.36 and 7.5.2.38",
        "A CAN frame has eight bytes. A device refuses the count (0604 0042h), or the file describes another \
        device.",
        "ParameterName=Mapped objects\nDataType=5\nAccessType=rw\nDefaultValue=3" => "ParameterName=Mapped objects\nDataType=5\nAccessType=rw\nDefaultValue=2";
    /// Who the device is, said twice.
    DeviceIdentity = 406, Warning, "a number of the device that is not the one of its identity object", "as it stands",
        "CiA 306-1, general device information; CiA 301, 7.5.2.19",
        "Tools that find the file of a device look for the numbers of `[DeviceInfo]`, masters compare the device with 1018h: one \
        of them takes the device for another.",
        "VendorNumber=0x101" => "VendorNumber=0x100";
    /// How many PDOs there are, said twice.
    PdoCount = 407, Warning, "another number of PDOs than are described", "those that are described",
        "CiA 306-1, general device information (NrOfRXPDO, NrOfTXPDO)",
        "A tool that goes by the number offers PDOs that are not there, or does not show some that are.",
        "NrOfTXPDO=4" => "NrOfTXPDO=1";
    /// One identifier for two things.
    SharedIdentifier = 408, Warning, "one identifier for two messages that the device sends, or for two that it takes", "as it stands",
        "CiA 301, 7.3.3",
        "Who receives the identifier cannot tell which of the two it is; an RPDO that shares one is written by the frames of the \
        other.",
        "ParameterName=COB-ID\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x80" => "ParameterName=COB-ID\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x180";
}
