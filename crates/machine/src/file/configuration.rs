//! What a master writes to a drive at its start, in a machine file: `pdos`, `limits`, `heartbeat`, `guarding`, `start_up`. The simulator does
//! not use them: its `options` are what a drive has already.

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::object::{GUARD_TIME, LIFE_TIME_FACTOR, PRODUCER_HEARTBEAT_TIME};
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{Mux, NodeId};
use cia402::object::{MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, MODES_OF_OPERATION};
use devices::Description;
use master::core::PdoMap;
use master::parameters::{Left, is_command};
use master::pdo::{PdoConfig, TransmissionType, record_of, values_off};
use master::units::parse_duration;

use crate::parameters::sheet::{value_of, values_of};
use words::document::Problem;
use words::document::reader::{Field, Table};
use words::object::object;

/// Keys of a drive that are for its master.
pub(super) const KEYS: &[&str] = &["pdos", "limits", "heartbeat", "guarding", "start_up", "sdo_server"];

const PDOS: &str = "a table of PDOs, e.g. { tpdo1 = { objects = [\"statusword\"], type = 1 } }";
const PDO: &str = "\"off\", or a table of objects, type, inhibit, event, id";
const OBJECTS: &str = "a list of objects, e.g. [\"statusword\", \"position_actual_value\"]";
const TIME: &str = "a time as text, e.g. \"100ms\"";
const GUARDING: &str = "a table of time and factor, e.g. { time = \"100ms\", factor = 3 }";
const FACTOR: &str = "a life time factor, 1 to 255";
const SDO_SERVER: &str = "the number of an SDO server, 1 to 128: 2 is that of 1201h";
const SYNC_COUNTER: &str = "the highest counter of SYNC, 2 to 240";
const LIMITS: &str = "a table of position, speed, torque, current, e.g. { speed = \"100rpm\" }";
const BOUNDS: &str = "two bounds, [low, high]";
const START_UP: &str = "a table of objects and their values, e.g. { 1017 = 200 }";

/// Limits that a machine file may name, and where CiA 402-2 has them, in the order in which a model is asked.
const LIMIT_OBJECTS: [(&str, &[u16]); 3] =
    [("speed", &[0x607F, 0x6080]), ("torque", &[0x6072]), ("current", &[0x6073])];

/// Software position limit: lower and upper (CiA 402-2, 607Dh).
const POSITION_LIMITS: [Mux; 2] = [MIN_POSITION_LIMIT, MAX_POSITION_LIMIT];

/// The values that the objects of a drive get at its start. What is wrong is added to `problems`, each thing on its own.
pub(super) fn values(
    table: &Table<'_>,
    model: &'static Description,
    node: NodeId,
    problems: &mut Vec<Problem>,
) -> BTreeMap<Mux, Vec<u8>> {
    let mut all = Collected { values: BTreeMap::new(), problems };
    if let Some(field) = table.get("pdos") {
        all.pdos(&field, model, node);
    }
    if let Some(field) = table.get("limits") {
        all.limits(&field, model);
    }
    if let Some(field) = table.get("heartbeat") {
        let value = heartbeat(&field, model);
        all.add(&field, value.map(|value| vec![(PRODUCER_HEARTBEAT_TIME, value)]));
    }
    if let Some(field) = table.get("guarding") {
        let values = guarding(&field, model);
        all.add(&field, values);
    }
    if let Some(field) = table.get("start_up") {
        match field.table("the values at the start", START_UP).map_err(|problem| vec![problem]) {
            Ok(table) => match values_of(&table, Some(model)) {
                Ok(values) => {
                    all.problems.extend(values.keys().filter_map(|object| set_point(*object, &field, model)));
                    all.add(&field, Ok(values.into_iter().collect()));
                }
                Err(wrong) => all.problems.extend(wrong),
            },
            Err(wrong) => all.problems.extend(wrong),
        }
    }
    all.values
}

/// What `params` leaves out too: it does something when it is written, or once the drive has power. The mode alone does nothing.
fn set_point(object: Mux, field: &Field<'_>, model: &Description) -> Option<Problem> {
    let is_mode = model.axes.iter().any(|axis| axis.object(MODES_OF_OPERATION) == object);
    let acts = !model.axes.is_empty() && is_command(object, Some(model)) && !is_mode;
    acts.then(|| {
        let name = model.row(object).map_or("", |row| row.name);
        field.problem(format!(
            "{object} {name} is {}: by a command the drive acts at its start, and by a set-point it would move when it is enabled; expected \
             settings alone; ferrodrive move, velocity, write or a line of a host is for the others",
            Left::Command
        ))
    })
}

/// The record of an SDO server by its number, 1 to 128: 1200h is the first, which every node has. Source: CiA 301, 7.5.2.33.
pub const fn sdo_server_record(number: u16) -> Option<u16> {
    if matches!(number, 1..=128) { Some(0x11FF + number) } else { None }
}

/// The record of the SDO server by which a master asks a drive.
pub(super) fn sdo_server(table: &Table<'_>) -> Result<Option<u16>, Problem> {
    let Some(field) = table.get("sdo_server") else { return Ok(None) };
    sdo_server_record(field.whole(SDO_SERVER)?).map(Some).ok_or_else(|| field.wrong(SDO_SERVER))
}

/// The highest counter of SYNC, as 1019h takes it (CiA 301, 7.5.2.22).
pub(super) fn sync_counter(file: &Table<'_>) -> Result<Option<u8>, Problem> {
    let Some(field) = file.get("sync_counter") else { return Ok(None) };
    let highest = field.whole(SYNC_COUNTER)?;
    if matches!(highest, 2..=240) { Ok(Some(highest)) } else { Err(field.wrong(SYNC_COUNTER)) }
}

struct Collected<'a> {
    values: BTreeMap<Mux, Vec<u8>>,
    problems: &'a mut Vec<Problem>,
}

impl Collected<'_> {
    fn add(&mut self, field: &Field<'_>, values: Result<Vec<(Mux, Vec<u8>)>, Problem>) {
        match values {
            Err(problem) => self.problems.push(problem),
            Ok(values) => {
                for (object, value) in values {
                    if self.values.insert(object, value).is_some() {
                        self.problems
                            .push(field.problem(format!("{object} gets a value twice: see what else names it")));
                    }
                }
            }
        }
    }

    fn pdos(&mut self, field: &Field<'_>, model: &'static Description, node: NodeId) {
        let table = match field.table("the PDOs", PDOS) {
            Ok(table) => table,
            Err(problem) => return self.problems.push(problem),
        };
        for pdo in table.fields() {
            let values = pdo_values(&pdo, model, node);
            self.add(&pdo, values);
        }
    }

    fn limits(&mut self, field: &Field<'_>, model: &'static Description) {
        let table = match field.table("the limits", LIMITS) {
            Ok(table) => table,
            Err(problem) => return self.problems.push(problem),
        };
        self.problems.extend(table.strangers(&["position", "speed", "torque", "current"]));
        if let Some(field) = table.get("position") {
            self.add(&field, position(&field, model));
        }
        for (name, indices) in LIMIT_OBJECTS {
            let Some(field) = table.get(name) else { continue };
            let row = indices.iter().find_map(|index| model.row(of_first_axis(model, Mux::new(*index, 0))));
            let value = match row {
                Some(row) => value_of(&field, row, model).map(|value| vec![(row.mux(), value)]),
                None => Err(no_limit(&field, model, name)),
            };
            self.add(&field, value);
        }
    }
}

fn of_first_axis(model: &Description, object: Mux) -> Mux {
    model.first_axis().map_or(object, |axis| axis.object(object))
}

fn no_limit(field: &Field<'_>, model: &Description, name: &str) -> Problem {
    let of = |(_, indices): &(&str, &[u16])| indices.iter().map(|index| format!("{index:04X}h")).collect::<Vec<_>>();
    let objects = LIMIT_OBJECTS.iter().find(|(limit, _)| *limit == name).map_or(vec!["607Dh".to_owned()], of);
    field.problem(format!(
        "a {} has no limit of its {name} by CiA 402 ({}); if it has an object of its own for that, name it in start_up",
        model.name,
        objects.join(", ")
    ))
}

fn position(field: &Field<'_>, model: &'static Description) -> Result<Vec<(Mux, Vec<u8>)>, Problem> {
    let bounds = field.list(BOUNDS)?;
    let [low, high] = &bounds[..] else { return Err(field.wrong(BOUNDS)) };
    let rows = POSITION_LIMITS.map(|object| model.row(of_first_axis(model, object)));
    let [Some(min), Some(max)] = rows else { return Err(no_limit(field, model, "position")) };
    let value = |field: &Field<'_>, row: &'static canopen::od::Entry| Ok((row.mux(), value_of(field, row, model)?));
    let values = vec![value(low, min)?, value(high, max)?];
    let number = |bytes: &[u8]| <[u8; 4]>::try_from(bytes).map(i32::from_le_bytes).ok();
    if let (Some(low), Some(high)) = (number(&values[0].1), number(&values[1].1))
        && low >= high
    {
        return Err(field.problem(format!("the lower bound, {low}, is not below the upper, {high}")));
    }
    Ok(values)
}

fn heartbeat(field: &Field<'_>, model: &'static Description) -> Result<Vec<u8>, Problem> {
    if model.row(PRODUCER_HEARTBEAT_TIME).is_none_or(|row| !row.access.is_writable()) {
        return Err(
            field.problem(format!("a {} has no producer heartbeat time (1017h) that can be written", model.name))
        );
    }
    let time = time(field)?;
    let ms = u16::try_from(time.as_millis()).ok().filter(|ms| Duration::from_millis((*ms).into()) == time);
    let ms = ms.ok_or_else(|| field.problem("1017h counts whole ms; expected \"1ms\" to \"65535ms\""))?;
    Ok(ms.to_le_bytes().to_vec())
}

/// Node guarding in place of a heartbeat: the node watches its master by it as well (CiA 301, 7.2.8.2.1).
fn guarding(field: &Field<'_>, model: &'static Description) -> Result<Vec<(Mux, Vec<u8>)>, Problem> {
    let writable = |object| model.row(object).is_some_and(|row| row.access.is_writable());
    if !writable(GUARD_TIME) || !writable(LIFE_TIME_FACTOR) {
        let name = model.name;
        return Err(field
            .problem(format!("a {name} has no guard time and life time factor (100Ch, 100Dh) that can be written")));
    }
    let table = field.table("node guarding", GUARDING)?;
    if let Some(problem) = table.strangers(&["time", "factor"]).into_iter().next() {
        return Err(problem);
    }
    let (Some(time), Some(factor)) = (table.get("time"), table.get("factor")) else {
        return Err(field.wrong(GUARDING));
    };
    let ms = whole_ms(&time, "100Ch")?;
    let factor =
        factor.whole::<u8>(FACTOR).and_then(|value| if value == 0 { Err(factor.wrong(FACTOR)) } else { Ok(value) })?;
    Ok(vec![(GUARD_TIME, ms.to_le_bytes().to_vec()), (LIFE_TIME_FACTOR, vec![factor])])
}

fn whole_ms(field: &Field<'_>, object: &str) -> Result<u16, Problem> {
    let time = time(field)?;
    let ms = u16::try_from(time.as_millis()).ok();
    let ms = ms.filter(|ms| *ms > 0 && Duration::from_millis((*ms).into()) == time);
    ms.ok_or_else(|| field.problem(format!("{object} counts whole ms; expected \"1ms\" to \"65535ms\"")))
}

pub(super) fn time(field: &Field<'_>) -> Result<Duration, Problem> {
    parse_duration(&field.words(TIME)?).map_err(|error| field.problem(format!("{error}; expected {TIME}")))
}

/// `tpdo1`.
pub fn pdo_id(text: &str) -> Result<PdoId, String> {
    let lower = text.to_ascii_lowercase();
    let found = [("tpdo", Direction::Tpdo), ("rpdo", Direction::Rpdo)].into_iter().find_map(|(word, direction)| {
        let number = PdoNumber::new(lower.strip_prefix(word)?.parse().ok()?)?;
        Some(PdoId { direction, number })
    });
    found.ok_or_else(|| {
        format!("'{text}' is not a PDO; expected tpdo1 to tpdo512 or rpdo1 to rpdo512, counted as by CiA 301")
    })
}

/// `tpdo1`, of those that a device sends.
pub fn tpdo_id(text: &str) -> Result<PdoId, String> {
    let pdo = pdo_id(text)?;
    let is_sent = pdo.direction == Direction::Tpdo;
    is_sent.then_some(pdo).ok_or_else(|| format!("'{text}' is not a TPDO; expected tpdo1 to tpdo512"))
}

/// An entry for an object that is named as people name objects.
pub fn mapped(model: &'static Description, pdo: PdoId, name: &str) -> Result<canopen::pdo::MappingRecord, String> {
    let (mux, _) = object(name)?.resolve(Some(model.dictionary))?;
    record_of(model, pdo, mux).map_err(|error| error.to_string())
}

fn pdo_values(field: &Field<'_>, model: &'static Description, node: NodeId) -> Result<Vec<(Mux, Vec<u8>)>, Problem> {
    let pdo = pdo_id(field.name()).map_err(|reason| field.problem(reason))?;
    if !field.is_table() {
        return match field.text(PDO)? {
            "off" => values_off(model, pdo, node).map_err(|error| field.problem(error.to_string())),
            _ => Err(field.wrong(PDO)),
        };
    }
    let table = field.table("a PDO", PDO)?;
    table.takes_only(&["objects", "type", "inhibit", "event", "id"])?;
    let mut map = PdoMap::default();
    if let Some(objects) = table.get("objects") {
        for entry in objects.list(OBJECTS)? {
            map.0.push(mapped(model, pdo, &entry.word(OBJECTS)?).map_err(|reason| entry.problem(reason))?);
        }
    } else if !model.pdo.fixed_mapping {
        table.need("objects", OBJECTS)?;
    }
    let mut config = PdoConfig::new(pdo, map);
    if let Some(kind) = table.get("type") {
        config.transmission = TransmissionType(kind.whole("a transmission type, 0 to 255 (CiA 301, 7.5.2.35)")?);
    }
    config.inhibit_time = table.get("inhibit").map(|field| time(&field)).transpose()?;
    config.event_time = table.get("event").map(|field| time(&field)).transpose()?;
    let id = "an identifier of 11 bits, e.g. 0x184";
    config.id =
        table.get("id").map(|field| field.whole::<u16>(id).and_then(|raw| checked(raw, &field, id))).transpose()?;
    config.values(model, node).map_err(|error| field.problem(error.to_string()))
}

fn checked(raw: u16, field: &Field<'_>, expected: &str) -> Result<u16, Problem> {
    if raw > 0x7FF {
        return Err(field.wrong(expected));
    }
    match canopen::CobId::standard(raw).check_identifier() {
        Ok(()) => Ok(raw),
        Err(_) => Err(field.problem(format!("{raw:03X}h is kept for another service (CiA 301, table 41)"))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Machine;
    use super::*;

    const DRIVE: &str = "[[drive]]\nmodel = 'cia402'\nnode = 5\n";

    fn values(lines: &str) -> BTreeMap<Mux, Vec<u8>> {
        let machine = Machine::parse(&format!("{DRIVE}{lines}")).unwrap_or_else(|bad| panic!("{bad}"));
        machine.parameters(NodeId::new(5).expect("a node-ID")).expect("there").values
    }

    fn refusal(lines: &str) -> String {
        Machine::parse(&format!("{DRIVE}{lines}")).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    #[test]
    fn what_a_master_writes_becomes_values_of_objects() {
        let said = "heartbeat = '200ms'\n[drive.limits]\nposition = [-5000, 5000]\ntorque = '150%'\n\
                    [drive.pdos]\ntpdo1 = { objects = ['statusword', '6064'], type = 1 }\ntpdo2 = 'off'\n\
                    [drive.start_up]\n6066 = 50\nposition_window_time = '20ms'\n";
        let values = values(said);
        let of = |index, sub_index| values[&Mux::new(index, sub_index)].clone();
        assert_eq!((of(0x1017, 0), of(0x6066, 0), of(0x6068, 0)), (vec![200, 0], vec![50, 0], vec![20, 0]));
        // 6072h counts per mille of the rated torque (CiA 402-2).
        assert_eq!(of(0x6072, 0), 1500_u16.to_le_bytes());
        assert_eq!((of(0x607D, 1), of(0x607D, 2)), ((-5000_i32).to_le_bytes().into(), 5000_i32.to_le_bytes().into()));
        assert_eq!((of(0x1A00, 0), of(0x1A00, 2)), (vec![2], 0x6064_0020_u32.to_le_bytes().to_vec()));
        assert_eq!((of(0x1800, 2), of(0x1800, 1)[0]), (vec![1], 0x85));
        assert_eq!(of(0x1801, 1)[3] & 0x80, 0x80);
    }

    #[test]
    fn node_guarding_becomes_guard_time_and_life_time_factor() {
        let values = values("guarding = { time = '250ms', factor = 3 }");
        assert_eq!((&values[&GUARD_TIME][..], &values[&LIFE_TIME_FACTOR][..]), (&[250, 0][..], &[3][..]));
        let joint = "[[drive]]\nmodel = 'm4230e17b50'\nnode = 5\nguarding = { time = '250ms', factor = 3 }\n";
        let refused = Machine::parse(joint).map_or_else(|bad| bad.to_string(), |_| String::new());
        assert!(refused.contains("has no guard time and life time factor (100Ch, 100Dh)"), "{refused}");
    }

    #[test]
    fn the_writes_of_a_drive_are_in_a_legal_order() {
        let machine = Machine::parse(&format!("{DRIVE}pdos = {{ tpdo1 = {{ objects = ['6041'], type = 1 }} }}"));
        let machine = machine.unwrap_or_else(|bad| panic!("{bad}"));
        let writes = machine.configuration(NodeId::new(5).expect("a node-ID"));
        let places: Vec<String> = writes.iter().map(|(object, _)| object.to_string()).collect();
        let expected = ["1800h:01", "1A00h:00", "1A00h:01", "1A00h:00", "1800h:02", "1800h:01"];
        assert_eq!(places, expected);
        assert_eq!(machine.configuration(NodeId::new(9).expect("a node-ID")), []);
    }

    #[test]
    fn what_is_wrong_is_reported_at_its_place() {
        let pdo = |said: &str| refusal(&format!("pdos = {{ tpdo1 = {{ {said} }} }}"));
        assert!(pdo("objects = ['status']").contains("line 4, column 31"), "{}", pdo("objects = ['status']"));
        assert!(pdo("objects = ['statusword', '6064', '606C']").contains("would have 80 bits"));
        assert!(pdo("objects = ['1017']").contains("cannot be in TPDO1"));
        assert!(pdo("objects = ['6041'], kind = 1").contains("has no 'kind'"));
        assert!(pdo("objects = ['6041'], type = 300").contains("expected a transmission type"));
        assert!(pdo("objects = ['6041'], inhibit = 5").contains("expected a time as text"));
        assert!(pdo("objects = ['6041'], id = 0x601").contains("another service"));
        assert!(pdo("objects = ['6041'], id = 0x800").contains("expected an identifier"));
        assert!(refusal("pdos = { pdo1 = 'off' }").contains("'pdo1' is not a PDO"));
        assert!(refusal("pdos = { tpdo1 = 'on' }").contains("expected \"off\", or a table"));
        assert!(refusal("heartbeat = 200").contains("expected a time as text"));
        assert!(refusal("heartbeat = '2d'").contains("expected"));
        assert!(refusal("heartbeat = '2h'").contains("to \"65535ms\""));
        assert!(refusal("guarding = '100ms'").contains("expected a table of time and factor"));
        assert!(refusal("guarding = { time = '100ms' }").contains("expected a table of time and factor"));
        assert!(refusal("guarding = { time = '100ms', factor = 0 }").contains("expected a life time factor, 1 to 255"));
        assert!(refusal("guarding = { time = '70s', factor = 2 }").contains("100Ch counts whole ms"));
        assert!(refusal("guarding = { time = '1ms', factor = 2, of = 3 }").contains("has no 'of'"));
        for empty in ["[5, 1]", "[5, 5]"] {
            assert!(
                refusal(&format!("limits = {{ position = {empty} }}")).contains("is not below the upper"),
                "{empty}"
            );
        }
        assert!(refusal("limits = { pace = 5 }").contains("has no 'pace'"));
        assert!(refusal("start_up = { 1017 = 5 }\nheartbeat = '5ms'").contains("1017h:00 gets a value twice"));
        assert!(refusal("start_up = { 6066 = 70000 }").contains("6066h:00"));
        for moving in ["60FF = 60", "target_position = 100", "6040 = 15"] {
            assert!(
                refusal(&format!("start_up = {{ {moving} }}")).contains("would move when it is enabled"),
                "{moving}"
            );
        }
    }
}
