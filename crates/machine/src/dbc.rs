//! The messages of a CANopen bus as a DBC file, which Vector's tools, SavvyCAN, cantools and others read.
//!
//! In: which nodes there are, of which models, and how their PDOs are mapped. Out: the text. PDOs become messages with a signal
//! for each mapped object: place, length, sign, factor and unit as the model's table has them; beside them NMT, SYNC, and of
//! each node EMCY and heartbeat. SDO is left out: what a frame of it says depends on frames before. The text is ASCII, because
//! a DBC file does not name its encoding.

use std::collections::BTreeSet;
use std::fmt::Write;

use canopen::connection_set;
use canopen::od::DataType;
use canopen::pdo::{Direction, MappingRecord, PdoId};
use canopen::{Mux, NodeId};
use devices::Description;
use master::core::PdoMap;
use master::decode::{common_name, common_type};

use words::unit::split_factor;

/// A node of the bus.
#[derive(Clone, Debug)]
pub struct DbcNode {
    /// Its node-ID.
    pub id: NodeId,
    /// Its model, if that is known.
    pub model: Option<&'static Description>,
    /// Its PDOs that are switched on.
    pub pdos: Vec<DbcPdo>,
}

/// A PDO as it is set up.
#[derive(Clone, Debug)]
pub struct DbcPdo {
    /// Which one.
    pub pdo: PdoId,
    /// Its identifier, 11 bits.
    pub id: u16,
    /// What it carries.
    pub map: PdoMap,
}

/// Who sends NMT, SYNC and RPDOs.
const MASTER: &str = "master";

/// Longest name that the format has; what is longer stands in an attribute, from which tools show it.
const MAX_NAME: usize = 32;

/// NMT command specifiers (CiA 301, 7.2.8.3.1).
const NMT_COMMANDS: [(i64, &str); 5] =
    [(1, "start"), (2, "stop"), (128, "enter pre-operational"), (129, "reset node"), (130, "reset communication")];

/// NMT states as a heartbeat carries them (CiA 301, 7.2.8.3.2.2).
const NMT_STATES: [(i64, &str); 4] = [(0, "boot-up"), (4, "stopped"), (5, "operational"), (127, "pre-operational")];

/// What is behind the messages: comments and tables of values, in the order of the format.
#[derive(Default)]
struct Tail {
    comments: String,
    long_names: String,
    value_types: String,
    values: String,
}

/// A signal of a message.
struct DbcSignal {
    name: Name,
    at: u32,
    bits: u32,
    signed: bool,
    factor: f64,
    unit: String,
    comment: String,
    values: Vec<(i64, String)>,
    /// 0 for a whole number, 1 for IEEE 754 of 32 bits, 2 of 64.
    value_type: u8,
}

/// A name without doubles among its own, as it is in full and as the format has it.
#[derive(Clone)]
struct Name {
    long: String,
    short: String,
}

/// The names of all nodes, or of the signals of one message.
#[derive(Default)]
struct Names {
    long: BTreeSet<String>,
    short: BTreeSet<String>,
}

impl Names {
    /// A name that is there already is numbered. One that is too long is cut, and where that is there already, numbered in its last
    /// five letters, as Vector's tools and cantools have it.
    fn name(&mut self, text: &str) -> Name {
        let text = symbol(text);
        let long = first_free(&mut self.long, text.clone(), |number| format!("{text}_{}", number + 1));
        let cut = |most: usize| &long[..long.len().min(most)];
        let numbered = |number| format!("{}_{number:04}", cut(MAX_NAME - 5));
        Name { short: first_free(&mut self.short, cut(MAX_NAME).to_owned(), numbered), long }
    }
}

/// The first of a name and its numbered forms, from 1 on, that is not taken; it is then.
fn first_free(taken: &mut BTreeSet<String>, name: String, numbered: impl Fn(u32) -> String) -> String {
    let free = std::iter::once(name).chain((1..).map(numbered)).find(|name| !taken.contains(name)).unwrap_or_default();
    taken.insert(free.clone());
    free
}

impl Name {
    /// The attribute of a name that was cut.
    fn attribute(&self, of: &str, attribute: &str) -> String {
        let Self { long, short } = self;
        if long == short { String::new() } else { format!("BA_ \"{attribute}\" {of} {short} \"{long}\";\n") }
    }
}

/// The attributes with which Vector's tools keep long names, and what has them.
const LONG_NAMES: [(&str, &str); 2] = [("BU_", "SystemNodeLongSymbol"), ("SG_", "SystemSignalLongSymbol")];

/// The text of a DBC file of these nodes.
pub fn print(nodes: &[DbcNode]) -> String {
    let mut out = String::from("VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: ");
    out.push_str(MASTER);
    let mut names = Names::default();
    names.name(MASTER);
    let names: Vec<Name> = nodes.iter().map(|node| names.name(&node.name())).collect();
    for name in &names {
        out.push(' ');
        out.push_str(&name.short);
    }
    out.push_str("\n\n");
    let mut tail = Tail::default();
    tail.long_names.extend(names.iter().map(|name| name.attribute("BU_", LONG_NAMES[0].1)));
    let all_nodes = names.iter().map(|name| &*name.short).collect::<Vec<_>>().join(",");
    let nmt = [DbcSignal::plain("command", 0, 8).valued(&NMT_COMMANDS), DbcSignal::plain("node", 8, 8)];
    message(&mut out, &mut tail, Head { id: 0, name: "NMT", length: 2, sender: MASTER, receiver: &all_nodes }, &nmt);
    message(&mut out, &mut tail, Head { id: 0x80, name: "SYNC", length: 0, sender: MASTER, receiver: &all_nodes }, &[]);
    for (node, name) in nodes.iter().zip(&names) {
        node.messages(&name.short, &mut out, &mut tail);
    }
    out.push_str(&tail.comments);
    if !tail.long_names.is_empty() {
        let define = |(of, attribute)| format!("BA_DEF_ {of} \"{attribute}\" STRING ;\n");
        let default = |(_, attribute)| format!("BA_DEF_DEF_ \"{attribute}\" \"\";\n");
        out.extend(LONG_NAMES.map(define).into_iter().chain(LONG_NAMES.map(default)));
        out.push_str(&tail.long_names);
    }
    out.push('\n');
    out.push_str(&tail.values);
    out.push_str(&tail.value_types);
    out
}

/// The first line of a message.
struct Head<'a> {
    id: u16,
    name: &'a str,
    length: usize,
    sender: &'a str,
    receiver: &'a str,
}

fn message(out: &mut String, tail: &mut Tail, head: Head<'_>, signals: &[DbcSignal]) {
    let Head { id, name, length, sender, receiver } = head;
    let receiver = if receiver.is_empty() { "Vector__XXX" } else { receiver };
    // Writing to a String does not fail.
    let _ = writeln!(out, "BO_ {id} {name}: {length} {sender}");
    for signal in signals {
        let DbcSignal { name: full, at, bits, factor, unit, comment, .. } = signal;
        let name = &full.short;
        tail.long_names.push_str(&full.attribute(&format!("SG_ {id}"), LONG_NAMES[1].1));
        let sign = if signal.signed { '-' } else { '+' };
        let _ = writeln!(out, " SG_ {name} : {at}|{bits}@1{sign} ({factor},0) [0|0] \"{unit}\" {receiver}");
        if !comment.is_empty() {
            let _ = writeln!(tail.comments, "CM_ SG_ {id} {name} \"{comment}\";");
        }
        if !signal.values.is_empty() {
            let values: String = signal.values.iter().map(|(value, text)| format!(" {value} \"{text}\"")).collect();
            let _ = writeln!(tail.values, "VAL_ {id} {name}{values} ;");
        }
        if signal.value_type != 0 {
            let _ = writeln!(tail.value_types, "SIG_VALTYPE_ {id} {name} : {};", signal.value_type);
        }
    }
    out.push('\n');
}

impl DbcNode {
    /// `zlac8030l_4`, or `node_4`.
    fn name(&self) -> String {
        format!("{}_{}", self.model.map_or("node", |model| model.name), self.id)
    }

    fn messages(&self, name: &str, out: &mut String, tail: &mut Tail) {
        // One that carries nothing is not sent (CiA 301, 7.5.2.36: its mapping is deactivated).
        for pdo in self.pdos.iter().filter(|pdo| pdo.map.bytes() > 0) {
            let (sender, receiver) = match pdo.pdo.direction {
                Direction::Tpdo => (name, MASTER),
                Direction::Rpdo => (MASTER, name),
            };
            let title = symbol(&format!("{}_{}", pdo.pdo, self.id));
            let length = pdo.map.bytes().min(can::MAX_DATA_LENGTH);
            let head = Head { id: pdo.id, name: &title, length, sender, receiver };
            message(out, tail, head, &self.signals(pdo));
        }
        let own = self.id;
        let id = |id: can::CanId| id.as_standard().unwrap_or_default();
        let emcy = [
            DbcSignal::plain("error_code", 0, 16),
            DbcSignal::plain("error_register", 16, 8),
            DbcSignal::plain("manufacturer", 24, 40),
        ];
        let title = format!("EMCY_{own}");
        let head = Head { id: id(connection_set::emcy(own)), name: &title, length: 8, sender: name, receiver: MASTER };
        message(out, tail, head, &emcy);
        // The highest bit toggles in answers to node guarding.
        let heartbeat = [DbcSignal::plain("nmt_state", 0, 7).valued(&NMT_STATES)];
        let title = format!("heartbeat_{own}");
        let head =
            Head { id: id(connection_set::heartbeat(own)), name: &title, length: 1, sender: name, receiver: MASTER };
        message(out, tail, head, &heartbeat);
    }

    /// A signal for each object that is mapped and fits into a frame; dummy entries (CiA 301, 7.4.7.1) are gaps.
    fn signals(&self, pdo: &DbcPdo) -> Vec<DbcSignal> {
        let mut names = Names::default();
        let fields =
            pdo.map.fields().filter(|(object, bits)| object.mux.index >= 8 && bits.end <= 64 && !bits.is_empty());
        fields.map(|(object, bits)| self.signal(&mut names, pdo.pdo.direction, &object, bits.start)).collect()
    }

    fn signal(&self, names: &mut Names, direction: Direction, object: &MappingRecord, at: u32) -> DbcSignal {
        let mux = object.mux;
        let row = self.model.and_then(|model| model.row(mux));
        let form =
            self.model.filter(|_| direction == Direction::Tpdo).and_then(|model| model.pdo.mapping.tpdo_form(mux));
        let known = row.map(|row| row.name).or_else(|| common_name(mux));
        let name = known.map_or_else(|| format!("object_{:04X}", mux.index), str::to_owned);
        // Sub-indices of a record may have one name.
        let name = if mux.sub_index == 0 { name } else { format!("{name}_{:02X}", mux.sub_index) };
        let bytes = usize::from(object.bits) / 8;
        let data_type = match (form, row) {
            (Some(form), _) if form.data_type.size() == bytes => Some(form.data_type),
            (_, Some(row)) => Some(row.data_type),
            (_, None) => common_type(mux, bytes),
        };
        let unit = form.map(|form| form.unit).or(row.map(|row| row.unit)).unwrap_or_default();
        let (factor, unit) = if unit.is_empty() { (1.0, "") } else { split_factor(unit) };
        let value_type = match data_type {
            Some(DataType::Real32) if object.bits == 32 => 1,
            Some(DataType::Real64) if object.bits == 64 => 2,
            _ => 0,
        };
        let values = row.map(|row| row.values).unwrap_or_default();
        DbcSignal {
            name: names.name(&name),
            at,
            bits: u32::from(object.bits),
            signed: value_type != 0 || data_type.is_some_and(DataType::is_signed),
            factor,
            unit: plain_text(unit),
            comment: comment(mux, row.map_or("", |row| row.title)),
            values: values.iter().map(|(value, text)| (*value, plain_text(text))).collect(),
            value_type,
        }
    }
}

impl DbcSignal {
    fn plain(name: &str, at: u32, bits: u32) -> Self {
        Self {
            name: Name { long: name.to_owned(), short: name.to_owned() },
            at,
            bits,
            signed: false,
            factor: 1.0,
            unit: String::new(),
            comment: String::new(),
            values: Vec::new(),
            value_type: 0,
        }
    }

    fn valued(self, values: &[(i64, &str)]) -> Self {
        Self { values: values.iter().map(|(value, text)| (*value, (*text).to_owned())).collect(), ..self }
    }
}

fn comment(mux: Mux, title: &str) -> String {
    if title.is_empty() { mux.to_string() } else { format!("{mux} {}", plain_text(title)) }
}

/// A name of letters, digits and underscores that does not begin with a digit.
fn symbol(text: &str) -> String {
    let mut name: String = text.chars().map(|char| if char.is_ascii_alphanumeric() { char } else { '_' }).collect();
    if name.starts_with(|first: char| first.is_ascii_digit()) {
        name.insert(0, '_');
    }
    name
}

/// ASCII without quotes.
fn plain_text(text: &str) -> String {
    let mut plain = String::new();
    for char in text.chars() {
        match char {
            '"' => plain.push('\''),
            '°' => plain.push_str("deg"),
            'µ' | 'μ' => plain.push('u'),
            'Ω' => plain.push_str("ohm"),
            '²' => plain.push('2'),
            '·' => plain.push('.'),
            _ if char.is_ascii() && !char.is_ascii_control() => plain.push(char),
            _ => plain.push('?'),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::pdo::PdoNumber;

    fn node(map: &[(u16, u8, u8)]) -> DbcNode {
        let records = map.iter().map(|(index, sub, bits)| MappingRecord { mux: Mux::new(*index, *sub), bits: *bits });
        let pdo = PdoId { direction: Direction::Tpdo, number: PdoNumber::new(1).unwrap() };
        let pdos = vec![DbcPdo { pdo, id: 0x184, map: PdoMap(records.collect()) }];
        DbcNode { id: NodeId::new(4).unwrap(), model: devices::model("zlac8030l"), pdos }
    }

    #[test]
    fn a_mapped_object_is_a_signal_with_its_place_sign_factor_and_unit() {
        // "ZLAC8030L quick start guide V1.00": 606Ch in 0.1 r/min, signed, behind 16 bits of statusword.
        let text = print(&[node(&[(0x6041, 0, 16), (0x606C, 0, 32)])]);
        for line in [
            "BU_: master zlac8030l_4",
            "BO_ 0 NMT: 2 master",
            "BO_ 388 TPDO1_4: 6 zlac8030l_4",
            " SG_ statusword : 0|16@1+ (1,0) [0|0] \"\" master",
            " SG_ velocity_actual_value : 16|32@1- (0.1,0) [0|0] \"r/min\" master",
            "BO_ 132 EMCY_4: 8 zlac8030l_4",
            "BO_ 1796 heartbeat_4: 1 zlac8030l_4",
            "VAL_ 1796 nmt_state 0 \"boot-up\" 4 \"stopped\" 5 \"operational\" 127 \"pre-operational\" ;",
        ] {
            assert!(text.lines().any(|found| found == line), "{line:?} in {text}");
        }
        assert!(text.is_ascii());
        let empty = print(&[node(&[])]);
        assert!(
            empty.contains("BO_ 132 EMCY_4") && !empty.contains("TPDO"),
            "what carries nothing is not sent: {empty}"
        );
    }

    #[test]
    fn dummies_are_gaps_what_is_too_long_is_left_out_and_names_are_distinguished() {
        let text = print(&[node(&[(0x0005, 0, 8), (0x6061, 0, 8), (0x6061, 0, 8), (0x5FFF, 1, 16), (0x6064, 0, 32)])]);
        for line in [
            " SG_ modes_of_operation_display : 8|8@1- (1,0) [0|0] \"\" master",
            " SG_ modes_of_operation_display_2 : 16|8@1- (1,0) [0|0] \"\" master",
            " SG_ object_5FFF_01 : 24|16@1+ (1,0) [0|0] \"\" master",
        ] {
            assert!(text.lines().any(|found| found == line), "{line:?} in {text}");
        }
        assert!(!text.contains("position_actual_value"), "it ends behind bit 64: {text}");
        assert!(!text.contains("LongSymbol"), "all names are short: {text}");
    }

    #[test]
    fn names_that_are_too_long_are_cut_to_names_of_their_own_and_kept_as_an_attribute() {
        let mut names = Names::default();
        let long = "motor_temperature_of_the_left_wheel";
        let named = [long, long, "motor_temperature_of_the_left_whip", "motor"].map(|text| names.name(text));
        let expected = [
            ("motor_temperature_of_the_left_wheel", "motor_temperature_of_the_left_wh"),
            ("motor_temperature_of_the_left_wheel_2", "motor_temperature_of_the_le_0001"),
            ("motor_temperature_of_the_left_whip", "motor_temperature_of_the_le_0002"),
            ("motor", "motor"),
        ];
        assert_eq!(named.each_ref().map(|Name { long, short }| (&**long, &**short)), expected);
        assert_eq!(
            named[0].attribute("SG_ 388", "SystemSignalLongSymbol"),
            format!("BA_ \"SystemSignalLongSymbol\" SG_ 388 motor_temperature_of_the_left_wh \"{long}\";\n")
        );
        assert_eq!(named[3].attribute("SG_ 388", "SystemSignalLongSymbol"), "");
        let text = print(&[node(&[(0x1400, 1, 32), (0x1400, 2, 8)])]);
        let mut lines = text.lines();
        for line in [
            " SG_ rpdo_communication_parameter_1_c : 0|32@1+ (1,0) [0|0] \"\" master",
            " SG_ rpdo_communication_parameter_1_t : 32|8@1+ (1,0) [0|0] \"\" master",
            "BA_DEF_ SG_ \"SystemSignalLongSymbol\" STRING ;",
            "BA_DEF_DEF_ \"SystemSignalLongSymbol\" \"\";",
            "BA_ \"SystemSignalLongSymbol\" SG_ 388 rpdo_communication_parameter_1_t \
             \"rpdo_communication_parameter_1_transmission_type_02\";",
            "VAL_ 1796 nmt_state 0 \"boot-up\" 4 \"stopped\" 5 \"operational\" 127 \"pre-operational\" ;",
        ] {
            assert!(lines.any(|found| found == line), "{line:?}, in this order, in {text}");
        }
    }
}
