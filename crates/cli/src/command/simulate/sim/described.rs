//! Notes at the start about a device that a file describes: what it is run as, what of it has no effect, and what in the
//! file makes no sense.

use canopen::od::{DefaultValue, Dictionary, Entry};
use canopen::pdo::{Direction, Mapping, PdoId, PdoNumber};
use canopen::{Mux, NodeId};
use devices::Description;
use drives::servo::is_left_to_makers;
use sim::machine::{Boxed, is_built_in, without_effect};

/// Profile number of drives in the low half of 1000h.
const DRIVES: u32 = 402;

/// The notes about `model` at `node`; none for one that is built in. With `verbose` objects are named, else counted.
pub(super) fn notes(node: NodeId, model: &'static Description, verbose: bool) -> Vec<String> {
    if is_built_in(model) {
        return Vec::new();
    }
    let mut notes = vec![format!("note: {node} is {} of {}: {}", model.title, model.manual, run_as(model))];
    let quiet: Vec<_> = without_effect(model).map(|mux| named(model, mux)).collect();
    let all = model.dictionary.rows().len();
    let of_all = format!("of its {all} objects are answered, and have no effect");
    notes.extend(list(node, &quiet, &of_all, verbose));
    notes.extend(left_to_makers(node, model));
    let odd: Vec<_> = model.dictionary.rows().iter().filter_map(beyond_limits).collect();
    notes.extend(list(node, &odd, "of its values as delivered are outside of their own limits", verbose));
    let unmapped: Vec<_> = unmapped(model, node);
    notes.extend(list(
        node,
        &unmapped,
        "of its PDOs cannot be mapped as delivered, and are off until a host maps them",
        true,
    ));
    notes
}

fn run_as(model: &Description) -> String {
    match model.axes.len() {
        0 if model.identity.device_type & 0xFFFF == DRIVES => {
            "a node with its objects; it claims to be a drive (1000h), but has no 6040h: nothing turns".into()
        }
        0 => "a node with its objects".into(),
        1 => "a servo".into(),
        axes => format!("a servo of {axes} axes"),
    }
}

/// One note about some objects, or none.
fn list(node: NodeId, objects: &[String], what: &str, named: bool) -> Option<String> {
    let count = objects.len();
    match (count, named) {
        (0, _) => None,
        (_, true) => Some(format!("note: {node}: {count} {what}: {}", objects.join(", "))),
        (_, false) => Some(format!("note: {node}: {count} {what}; -v names them")),
    }
}

/// A file of a servo with objects that a start-up may well write as if a loop used them.
fn left_to_makers(node: NodeId, model: &Description) -> Option<String> {
    let rows = model.dictionary.rows().iter().filter(|row| !model.axes.is_empty() && row.access.is_writable());
    let mut objects: Vec<_> =
        rows.filter(|row| is_left_to_makers(row.mux())).map(|row| format!("{:04X}h", row.index)).collect();
    objects.dedup();
    let names = objects.join(", ");
    (!objects.is_empty()).then(|| {
        format!(
            "note: {node}: {names}: gains and data that CiA 402 leaves to makers are stored and answered; no loop and no limit uses \
             them"
        )
    })
}

fn named(model: &Description, mux: Mux) -> String {
    match model.row(mux) {
        Some(row) if !row.title.is_empty() => format!("{mux} {}", row.title),
        _ => mux.to_string(),
    }
}

fn beyond_limits(row: &Entry) -> Option<String> {
    let DefaultValue::Value(value) = row.default else { return None };
    row.check_value(value).err()?;
    Some(format!("{} = {value}", row.mux()))
}

/// The PDOs whose mapping as delivered is refused, and why.
fn unmapped(model: &'static Description, node: NodeId) -> Vec<String> {
    let values = Dictionary::<Boxed>::new(model.dictionary, node);
    let pdos = [Direction::Rpdo, Direction::Tpdo].into_iter().flat_map(|direction| {
        (0..usize::from(PdoNumber::MAX)).filter_map(PdoNumber::at).map(move |number| PdoId { direction, number })
    });
    pdos.filter_map(|pdo| refusal(model, &values, pdo).map(|reason| format!("{pdo} ({reason})"))).collect()
}

fn refusal(model: &Description, values: &Dictionary<Boxed>, pdo: PdoId) -> Option<String> {
    model.row(Mux::new(pdo.mapping_index(), 0))?;
    let error = Mapping::read(values, pdo.mapping_index(), pdo.direction, model.pdo.mapping).err()?;
    Some(error.meaning().unwrap_or("it is refused").to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::od::ValueRange;
    use devices::servo::CIA402;
    use eds::{Eds, keep};

    /// A drive by 1000h without a controlword, and a PDO that maps an object that is not there.
    const ODD: &str = "[FileInfo]\nFileName=odd.eds\n[DeviceInfo]\nVendorName=None\nProductName=Odd\n\
        [MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n\
        [OptionalObjects]\nSupportedObjects=2\n1=0x1A00\n2=0x2000\n\
        [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0x00020192\n\
        [2000]\nParameterName=Depth\nObjectType=7\nDataType=5\nAccessType=rw\nDefaultValue=9\n\
        [1A00]\nParameterName=Mapping\nObjectType=9\nSubNumber=2\n\
        [1A00sub0]\nParameterName=Count\nObjectType=7\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
        [1A00sub1]\nParameterName=First\nObjectType=7\nDataType=7\nAccessType=rw\nDefaultValue=0x60410010\n";

    fn said(verbose: bool) -> String {
        let description = keep(&Eds::load(ODD.as_bytes()).expect("it is read").eds).expect("it is kept");
        notes(NodeId::MIN, description, verbose).join("\n")
    }

    #[test]
    fn of_a_model_that_is_built_in_nothing_is_said() {
        assert_eq!(notes(NodeId::MIN, &CIA402, true), Vec::<String>::new());
    }

    #[test]
    fn what_has_no_effect_in_the_built_in_servo_can_have_one_value_only() {
        for mux in without_effect(&CIA402) {
            let row = CIA402.row(mux).expect("it is of its table");
            let fixed = row.values.len() == 1
                || row.limits.and_then(ValueRange::integers).is_some_and(|(low, high)| low == high);
            assert!(fixed || !row.access.is_writable(), "{mux}");
        }
    }

    #[test]
    fn of_a_servo_by_its_file_the_gains_that_no_loop_uses_are_named() {
        let row = |index: &str, sub: &str, access: &str| {
            format!(
                "[{index}{sub}]\nParameterName={index}{sub}\nObjectType=7\nDataType=6\nAccessType={access}\nDefaultValue=0\n"
            )
        };
        let record = |index: &str| {
            format!(
                "[{index}]\nParameterName=Gains\nObjectType=9\nSubNumber=3\n{}{}{}",
                row(index, "sub0", "ro"),
                row(index, "sub1", "rw"),
                row(index, "sub2", "rw")
            )
        };
        let text = ODD.replace(
            "SupportedObjects=2\n1=0x1A00\n2=0x2000",
            "SupportedObjects=7\n1=0x1A00\n2=0x2000\n3=0x6040\n4=0x6041\n5=0x60F9\n6=0x6410\n7=0x60F7",
        );
        let text =
            [text, row("6040", "", "rw"), row("6041", "", "ro"), record("60F9"), record("6410"), row("60F7", "", "ro")]
                .concat();
        let description = keep(&Eds::load(text.as_bytes()).expect("it is read").eds).expect("it is kept");
        let said = notes(NodeId::MIN, description, false).join("\n");
        assert!(
            said.contains("a servo") && said.contains("\nnote: 1: 60F9h, 6410h: gains and data that CiA 402 leaves"),
            "{said}"
        );
        assert!(!self::said(false).contains("CiA 402 leaves"));
    }

    #[test]
    fn of_a_file_what_makes_no_sense_and_what_has_no_effect_is_counted_and_with_v_named() {
        let counted = said(false);
        assert!(counted.contains("claims to be a drive (1000h), but has no 6040h"), "{counted}");
        assert!(counted.contains("1 of its 4 objects are answered, and have no effect; -v"), "{counted}");
        assert!(
            counted.contains("1 of its PDOs cannot be mapped as delivered") && counted.contains("TPDO1 (object"),
            "{counted}"
        );
        let named = said(true);
        assert!(named.contains("no effect: 2000h:00 Depth"), "{named}");
    }
}
