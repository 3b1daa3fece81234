//! Two files compared, object by object.

use canopen::Mux;

use crate::{DeviceInfo, Eds, Object, Value, Variable};

/// One thing in which two files differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The object; `None` for the device as a whole.
    pub index: Option<u16>,
    /// The sub-index, for what is about one value.
    pub sub_index: Option<u8>,
    /// The object's name, where one of the two has it.
    pub name: String,
    /// What differs: `type`, `access`, `default`, ...
    pub aspect: &'static str,
    /// What the first file says; `None` if nothing.
    pub first: Option<String>,
    /// What the second says.
    pub second: Option<String>,
}

/// All differences: the device, then the objects by index. Names are not compared, and a default that one file has as 0
/// and the other not at all is the same.
///
/// Where a file is a DCF, its values count in place of the defaults.
pub fn diff(first: &Eds, second: &Eds) -> Vec<Difference> {
    let mut found = Vec::new();
    device(&first.device, &second.device, &mut found);
    let (mut left, mut right) = (first.objects.iter().peekable(), second.objects.iter().peekable());
    loop {
        let (a, b) = (left.peek().map(|object| object.index), right.peek().map(|object| object.index));
        let lowest = match (a, b) {
            (Some(a), Some(b)) => a.min(b),
            (Some(index), None) | (None, Some(index)) => index,
            (None, None) => return found,
        };
        let a = left.next_if(|object| object.index == lowest);
        let b = right.next_if(|object| object.index == lowest);
        of_index(lowest, a, b, &mut found);
    }
}

fn device(a: &DeviceInfo, b: &DeviceInfo, found: &mut Vec<Difference>) {
    let hex = |number: Option<u32>| number.map(|number| format!("0x{number:X}"));
    let rates = |rates: &[u16]| Some(rates.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "));
    let count = |count: Option<u16>| count.map(|count| count.to_string());
    let rows = [
        ("vendor number", hex(a.vendor_number), hex(b.vendor_number)),
        ("product number", hex(a.product_number), hex(b.product_number)),
        ("revision number", hex(a.revision_number), hex(b.revision_number)),
        ("bit rates in kbit/s", rates(&a.bit_rates), rates(&b.bit_rates)),
        ("granularity", Some(a.granularity.to_string()), Some(b.granularity.to_string())),
        ("RPDOs", count(a.rpdos), count(b.rpdos)),
        ("TPDOs", count(a.tpdos), count(b.tpdos)),
        ("LSS", Some(a.lss.to_string()), Some(b.lss.to_string())),
    ];
    for (aspect, first, second) in rows.into_iter().filter(|(_, first, second)| first != second) {
        found.push(Difference { index: None, sub_index: None, name: String::new(), aspect, first, second });
    }
}

fn of_index(index: u16, a: Option<&Object>, b: Option<&Object>, found: &mut Vec<Difference>) {
    let name = a.or(b).map(|object| object.name.clone()).unwrap_or_default();
    let kind = |object: &Object| format!("{} of {}", object.object_type.name(), object.variables.len());
    let (Some(a), Some(b)) = (a, b) else {
        let (first, second) = (a.map(kind), b.map(kind));
        found.push(Difference { index: Some(index), sub_index: None, name, aspect: "object", first, second });
        return;
    };
    let (first, second) = (a.object_type.name(), b.object_type.name());
    if first != second {
        let (first, second) = (Some(first.to_owned()), Some(second.to_owned()));
        found.push(Difference { index: Some(index), sub_index: None, name, aspect: "kind", first, second });
    }
    for sub_index in 0..=u8::MAX {
        match (a.variable(sub_index), b.variable(sub_index)) {
            (None, None) => {}
            (Some(a), Some(b)) => variables(index, a, b, found),
            (a, b) => {
                let name = a.or(b).map(|variable| variable.name.clone()).unwrap_or_default();
                let there = |variable: Option<&Variable>| variable.map(|variable| variable.data_type.to_string());
                let (index, sub_index, first, second) = (Some(index), Some(sub_index), there(a), there(b));
                found.push(Difference { index, sub_index, name, aspect: "sub-object", first, second });
            }
        }
    }
}

fn variables(index: u16, a: &Variable, b: &Variable, found: &mut Vec<Difference>) {
    let is_dcf = a.value.is_some() || b.value.is_some();
    let shown = |variable: &Variable, value: &Option<Value>| {
        value.as_ref().map(|value| mapped(index, value).unwrap_or_else(|| value.in_file(index, variable.data_type)))
    };
    let effective = |variable: &Variable| {
        shown(variable, if variable.value.is_some() { &variable.value } else { &variable.default })
    };
    let yes_no = |flag: bool| Some(if flag { "yes" } else { "no" }.to_owned());
    let rows = [
        ("type", Some(a.data_type.to_string()), Some(b.data_type.to_string())),
        ("access", Some(a.access.name().to_owned()), Some(b.access.name().to_owned())),
        (if is_dcf { "value" } else { "default" }, effective(a), effective(b)),
        ("low limit", shown(a, &a.low), shown(b, &b.low)),
        ("high limit", shown(a, &a.high), shown(b, &b.high)),
        ("PDO mapping", yes_no(a.pdo_mapping), yes_no(b.pdo_mapping)),
    ];
    for (aspect, first, second) in rows {
        if first != second
            && !(matches!(aspect, "default" | "value") && is_zero(first.as_deref()) && is_zero(second.as_deref()))
        {
            let name = if a.name.is_empty() { b.name.clone() } else { a.name.clone() };
            found.push(Difference { index: Some(index), sub_index: Some(a.sub_index), name, aspect, first, second });
        }
    }
}

/// Not said is 0, or no text.
fn is_zero(value: Option<&str>) -> bool {
    matches!(value, None | Some("" | "0" | "0.0"))
}

/// What a mapping record maps: `6040h:00, 16 bits`.
fn mapped(index: u16, value: &Value) -> Option<String> {
    if !matches!(index, 0x1600..=0x17FF | 0x1A00..=0x1BFF) {
        return None;
    }
    let Value::Number(number) = value else { return None };
    let record = u32::try_from(number.base).ok().filter(|record| *record > 0xFF)?;
    Some(format!("{}, {} bits", Mux::from_key(record >> 8), record & 0xFF))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECT: &str = "[2000]\nParameterName=Gain\nDataType=6\nAccessType=rw\nPDOMapping=0\n";

    fn eds(text: &str) -> Eds {
        Eds::load(format!("[DeviceInfo]\nBaudRate_500=1\n{text}").as_bytes()).expect("a small file").eds
    }

    fn short(a: &str, b: &str) -> Vec<(Option<u16>, &'static str, String, String)> {
        let say = |text: Option<String>| text.unwrap_or_else(|| "-".into());
        diff(&eds(a), &eds(b))
            .into_iter()
            .map(|found| (found.index, found.aspect, say(found.first), say(found.second)))
            .collect()
    }

    fn row(index: u16, aspect: &'static str, a: &str, b: &str) -> (Option<u16>, &'static str, String, String) {
        (Some(index), aspect, a.into(), b.into())
    }

    #[test]
    fn a_file_does_not_differ_from_itself() {
        assert_eq!(short(OBJECT, OBJECT), []);
    }

    #[test]
    fn objects_of_one_file_only_are_reported_in_order() {
        let other = OBJECT.replace("2000", "3000");
        assert_eq!(
            short(OBJECT, &other),
            [row(0x2000, "object", "VAR of 1", "-"), row(0x3000, "object", "-", "VAR of 1")]
        );
    }

    #[test]
    fn types_access_defaults_and_limits_are_compared() {
        let other = OBJECT
            .replace("=6", "=3")
            .replace("rw", "ro")
            .replace("PDOMapping=0", "PDOMapping=1\nDefaultValue=7\nLowLimit=-1");
        let expected = [
            row(0x2000, "type", "UNSIGNED16", "INTEGER16"),
            row(0x2000, "access", "rw", "ro"),
            row(0x2000, "default", "-", "7"),
            row(0x2000, "low limit", "-", "-1"),
            row(0x2000, "PDO mapping", "no", "yes"),
        ];
        assert_eq!(short(OBJECT, &other), expected);
        assert_eq!(short(OBJECT, &OBJECT.replace("rw", "rw\nDefaultValue=0")), []);
    }

    #[test]
    fn the_values_of_a_dcf_count_in_place_of_the_defaults() {
        let file = OBJECT.replace("rw", "rw\nDefaultValue=5");
        let dcf = file.replace("DefaultValue=5", "DefaultValue=5\nParameterValue=9");
        assert_eq!(short(&file, &dcf), [row(0x2000, "value", "5", "9")]);
    }

    #[test]
    fn what_a_pdo_maps_is_reported_in_words() {
        let pdo = |record: &str| {
            format!(
                "[1600]\nParameterName=M\nObjectType=9\nSubNumber=1\n[1600sub1]\nParameterName=E\nDataType=7\nAccessType=rw\nDefaultValue={record}\n"
            )
        };
        let expected = [row(0x1600, "default", "6040h:00, 16 bits", "60FFh:00, 32 bits")];
        assert_eq!(short(&pdo("0x60400010"), &pdo("0x60FF0020")), expected);
    }

    #[test]
    fn the_device_is_compared_too() {
        let found = short("[DeviceInfo]\n[1000]\n", "[1000]\n");
        assert_eq!(found, []);
        let other = Eds::load(b"[DeviceInfo]\nBaudRate_500=1\nVendorNumber=5\n").expect("a small file").eds;
        let found = diff(&eds(""), &other);
        assert_eq!(
            found.iter().map(|found| (found.index, found.aspect)).collect::<Vec<_>>(),
            [(None, "vendor number")]
        );
    }
}
