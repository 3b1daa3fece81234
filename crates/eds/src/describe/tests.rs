//! The sheet of every model reads back as the model, as far as a sheet goes.

use std::collections::HashSet;

use canopen::od::{Access, DefaultValue, Entry};
use canopen::{Mux, NodeId};
use devices::{Description, Placement};

use super::names;
use super::{Flavour, Sheet, keep, keep_of};
use crate::{Eds, Number, Reading, TypeCode, Value, write};

fn models() -> impl Iterator<Item = &'static Description> {
    devices::all().iter()
}

fn read(sheet: &Sheet<'_>) -> Reading {
    Eds::load(write(&sheet.eds()).as_bytes()).expect("a sheet is of a real size")
}

/// What is found, but for one thing that the drive itself has: 2030h of the ZLAC8030L counts to 16 and ends with 15.
fn findings(reading: &Reading) -> Vec<String> {
    let all = reading.findings.iter().filter(|finding| finding.section != "2030sub0");
    all.map(ToString::to_string).collect()
}

#[test]
fn nothing_is_wrong_with_the_sheet_of_any_model() {
    for model in models() {
        let whats = findings(&read(&Sheet::of(model)));
        // One file cannot say that a TPDO carries 32 bits of what an SDO answers with 16.
        assert_eq!(whats.len(), model.pdo.mapping.tpdo_forms.len(), "{}: {whats:?}", model.name);
        let form = "606Ch:00 is mapped with 32 bits, but is INTEGER16";
        assert!(whats.iter().all(|what| what.contains(form)), "{whats:?}");
    }
}

#[test]
fn nothing_is_wrong_with_the_variant_for_ros2_canopen() {
    for model in models() {
        let reading = read(&Sheet { flavour: Flavour::Ros2Canopen, ..Sheet::of(model) });
        assert_eq!(findings(&reading), [""; 0], "{}", model.name);
        assert!(reading.eds.comments.iter().any(|line| line.contains("ros2_canopen")));
        assert!(reading.eds.object(0x6061).is_some(), "{}", model.name);
    }
    let default = |name: &str, index: u16| {
        let model = devices::model(name).expect("a model");
        let eds = read(&Sheet { flavour: Flavour::Ros2Canopen, ..Sheet::of(model) }).eds;
        eds.variable(index, 0).map(|variable| (variable.data_type, variable.default.clone()))
    };
    let number = |value| Some(Value::Number(Number::plain(value)));
    assert_eq!(default("zlac8030l", 0x6502), Some((TypeCode::UNSIGNED32, number(0x0D))));
    assert_eq!(default("zlim42c", 0x6502), Some((TypeCode::UNSIGNED32, number(0x25))));
    assert_eq!(default("m4230e17b50", 0x606C).map(|(data_type, _)| data_type), Some(TypeCode::INTEGER32));
}

#[test]
fn every_model_reads_back_as_itself_in_each_of_its_editions() {
    let editions = models().flat_map(|model| model.editions.iter().map(|edition| edition.description));
    for model in models().chain(editions) {
        let kept = keep(&read(&Sheet::of(model)).eds).expect("no more rows than the model");
        assert_eq!(kept.identity, model.identity, "{}", model.name);
        assert_eq!(kept.axes.len(), model.axes.len(), "{}", model.name);
        assert_eq!(kept.axes[0].placement, Placement::FIRST);
        assert_eq!(kept.pdo.fixed_mapping, model.pdo.fixed_mapping, "{}", model.name);
        assert_eq!(kept.storage.save.is_some(), model.has_index(0x1010), "{}", model.name);
        assert_eq!(kept.title, names::plain(model.title));
        let (rows, of_file) = (model.dictionary.rows(), kept.dictionary.rows());
        assert_eq!(rows.len(), of_file.len(), "{}", model.name);
        for (row, read) in rows.iter().zip(of_file) {
            same_row(model, row, read);
        }
    }
}

#[test]
fn the_sheet_of_every_model_has_the_names_of_the_standards_each_once() {
    let editions = models().flat_map(|model| model.editions.iter().map(|edition| edition.description));
    for model in models().chain(editions) {
        for flavour in [Flavour::Standard, Flavour::Ros2Canopen] {
            let eds = read(&Sheet { flavour, ..Sheet::of(model) }).eds;
            // CiA 301, 7.5.2; CiA 402-2, clauses 8 to 15.
            let all = [
                (0x1000, "Device type"),
                (0x1018, "Identity object"),
                (0x1401, "RPDO communication parameter 2"),
                (0x6040, "Controlword"),
                (0x6041, "Statusword"),
                (0x6060, "Modes of operation"),
                (0x6064, "Position actual value"),
                (0x606C, "Velocity actual value"),
                (0x607A, "Target position"),
                (0x60FF, "Target velocity"),
            ];
            for (index, name) in all {
                let called = eds.object(index).map(|object| object.name.as_str());
                assert_eq!(called, model.has_index(index).then_some(name), "{} {index:04X}h", model.name);
            }
            assert_eq!(eds.variable(0x1018, 1).map(|variable| variable.name.as_str()), Some("Vendor-ID"));
            assert_eq!(eds.variable(0x1018, 0).map(|count| count.name.as_str()), Some("Highest sub-index supported"));
            let mut names = HashSet::new();
            for object in &eds.objects {
                assert!(names.insert(object.name.to_lowercase()), "{}: two are called {}", model.name, object.name);
                let parts: HashSet<&str> = object.variables.iter().map(|part| part.name.as_str()).collect();
                assert_eq!(parts.len(), object.variables.len(), "{}: {}", model.name, object.name);
            }
        }
    }
}

#[test]
fn a_name_that_two_objects_of_a_file_share_is_numbered_in_its_sheet() {
    let file = "[1018]\nParameterName=Identity object\nObjectType=0x9\nSubNumber=2\n\
        [1018sub0]\nParameterName=Highest sub-index supported\nDataType=0x5\nAccessType=const\nDefaultValue=1\n\
        [1018sub1]\nParameterName=Vendor-ID\nDataType=0x7\nAccessType=ro\nDefaultValue=7\n\
        [6041]\nParameterName=Statusword\nDataType=0x6\nAccessType=ro\n\
        [6841]\nParameterName=Statusword\nDataType=0x6\nAccessType=ro\n";
    let kept = keep(&Eds::load(file.as_bytes()).expect("a small file").eds).expect("it fits");
    let eds = read(&Sheet::of(kept)).eds;
    let names: Vec<&str> = eds.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["Identity object", "Statusword", "Statusword 2"]);
    assert_eq!(eds.variable(0x6841, 0).map(|variable| variable.name.as_str()), Some("Statusword 2"));
}

#[test]
fn what_is_typed_is_the_name_of_the_file_in_snake_case() {
    let editions = devices::all().iter().flat_map(|model| model.editions.iter().map(|edition| edition.description));
    for model in devices::all().iter().chain(editions) {
        let eds = Sheet::of(model).eds();
        for row in model.dictionary.rows() {
            let place = format!("{} {}", model.name, row.mux());
            let object = eds.objects.iter().find(|object| object.index == row.index).expect("it is in the sheet");
            let shown = &eds.variable(row.index, row.sub_index).expect("it is in the sheet").name;
            let is_whole = row.sub_index == 0 && object.object_type.has_sub_objects();
            let name = names::name(if is_whole { &object.name } else { shown });
            // Of the standard's records the name to type of some parts has the record's in front.
            let of_standard = devices::names::standard(row.mux()).is_some();
            let in_record = of_standard && row.name == names::name(&format!("{} {shown}", object.name));
            assert!(row.name == name || in_record, "{place}: {shown:?} is typed {}", row.name);
        }
    }
}

fn same_row(model: &Description, row: &Entry, read: &Entry) {
    let place = format!("{} {} {}", model.name, row.mux(), row.name);
    assert_eq!(read.mux(), row.mux(), "{place}");
    let is_count = row.sub_index == 0 && model.row(canopen::Mux::new(row.index, 1)).is_some();
    let code = if is_count { TypeCode::UNSIGNED8.0 } else { row.data_type.code() };
    assert_eq!(read.data_type.code(), code, "{place}");
    assert_eq!(read.access, row.access, "{place}");
    assert_eq!(read.pdo.is_allowed(), row.pdo.is_allowed(), "{place}");
    let shown = Sheet::of(model).eds().variable(row.index, row.sub_index).cloned().expect("it is in the sheet");
    assert_eq!(read.title, shown.name, "{place}");
    let number = shown.name.strip_prefix(names::plain(row.title).as_str());
    assert!(number.is_some_and(|number| number.bytes().all(|byte| byte == b' ' || byte.is_ascii_digit())), "{place}");
    let default = shown.default;
    if default.is_some() || row.access != Access::ReadOnly {
        assert_eq!(read.default, row.default, "{place}");
    } else {
        assert_eq!(read.default, DefaultValue::Value(0), "{place}: what is measured has no default");
    }
    if row.resolution.is_none() && row.check_value(value(row.default)).is_ok() {
        let own =
            |row: &Entry| row.limits.and_then(|limits| limits.integers()).filter(|own| *own != row.data_type.range());
        assert_eq!(own(read), own(row), "{place}");
    }
    if devices::names::standard(row.mux()).is_some() {
        assert_eq!(read.name, row.name, "{place}: the standard's name");
    }
}

fn value(default: DefaultValue) -> i64 {
    match default {
        DefaultValue::Value(value) => value,
        _ => 0,
    }
}

#[test]
fn the_same_content_is_kept_once() {
    let model = devices::model("zlac8030l").expect("a model");
    let first = keep(&read(&Sheet::of(model)).eds).expect("it fits");
    let again = keep(&read(&Sheet::of(model)).eds).expect("it fits");
    assert!(std::ptr::eq(first, again));
    let other = keep(&read(&Sheet { node_id: NodeId::new(9), ..Sheet::of(model) }).eds).expect("it fits");
    assert!(!std::ptr::eq(first, other));
    // Where it stands in the file, and how a number is written, is not what it says.
    let text = write(&Sheet::of(model).eds());
    let moved = format!("; a remark\n\n{}", text.replace("0x1000", "0x001000"));
    assert_ne!(
        Eds::load(moved.as_bytes()).expect("a small file").eds,
        Eds::load(text.as_bytes()).expect("a small file").eds
    );
    assert!(std::ptr::eq(first, keep(&Eds::load(moved.as_bytes()).expect("a small file").eds).expect("it fits")));
    // One name, one limit, one default, one comment more or less is another file.
    for (said, otherwise) in
        [("=Device type", "=Device Type"), ("LowLimit=0", "LowLimit=1"), ("DefaultValue=500", "DefaultValue=501")]
    {
        let changed = text.replacen(said, otherwise, 1);
        assert_ne!(changed, text, "{said}");
        let changed = keep(&Eds::load(changed.as_bytes()).expect("a small file").eds).expect("it fits");
        assert!(!std::ptr::eq(first, changed), "{said}");
    }
    // Under another path it is called otherwise, and nothing else is kept twice.
    let copy = keep_of(&read(&Sheet::of(model)).eds, "line/wheel.eds").expect("it fits");
    assert_eq!((first.manual, copy.manual), ("the file zlac8030l.eds", "the file line/wheel.eds"));
    assert!(std::ptr::eq(first.dictionary, copy.dictionary));
}

#[test]
fn a_description_says_that_it_is_without_the_modules_of_its_file() {
    let written = write(&Sheet::of(devices::model("cia402").expect("a model")).eds());
    let text = format!("{written}[SupportedModules]\nNrOfEntries=1\n[M1ModuleInfo]\nProductName=DI8\n");
    let modular = Eds::load(text.as_bytes()).expect("a small file").eds;
    assert_eq!(keep_of(&modular, "coupler.eds").expect("it fits").manual, "the file coupler.eds, without its modules");
}

#[test]
fn choices_presets_and_a_node_change_the_sheet() {
    let model = devices::model("zlac8030l").expect("a model");
    let mut sheet = Sheet::of(model);
    let default = |sheet: &Sheet<'_>, index, sub_index| match sheet
        .eds()
        .variable(index, sub_index)
        .and_then(|variable| variable.default.clone())
    {
        Some(Value::Number(number)) => Some(number),
        _ => None,
    };
    assert_eq!(default(&sheet, 0x2014, 0), Some(Number::plain(150)));
    assert_eq!(default(&sheet, 0x1014, 0), Some(Number { base: 0x80, plus_node_id: true }));
    sheet.variant.choose("defaults", "eds").expect("a choice of this model");
    assert_eq!(default(&sheet, 0x2014, 0), Some(Number::plain(300)), "of the maker's own EDS");
    let presets = [devices::variant::Preset::new(0x2014, 0, 77)];
    let sheet = Sheet { presets: &presets, node_id: NodeId::new(5), ..sheet };
    assert_eq!(default(&sheet, 0x2014, 0), Some(Number::plain(77)));
    assert_eq!(default(&sheet, 0x1014, 0), Some(Number::plain(0x85)));
}

/// Two axes of the standard, 800h apart (CiA 402-1), and what else a file may have.
const TWO_AXES: &str = "[FileInfo]\nFileName=two.eds\n[DeviceInfo]\nVendorName=V\nProductName=Two\nVendorNumber=7\n\
    [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x20192\n\
    [1010]\nParameterName=Store\nObjectType=8\nSubNumber=2\n[1010sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
    [1010sub1]\nParameterName=All\nDataType=7\nAccessType=rw\n\
    [2000]\nParameterName=My gain\nDataType=8\nAccessType=rw\nDefaultValue=0.5\nHighLimit=2.5\n\
    [2001]\nParameterName=Text\nDataType=9\nAccessType=rw\nDefaultValue=abc\n\
    [2002]\nParameterName=Bytes\nDataType=0xA\nAccessType=ro\nDefaultValue=01 02FF\n\
    [2003]\nParameterName=My gain\nDataType=0x1B\nAccessType=rw\nDefaultValue=0xFFFFFFFFFFFFFFFF\n\
    [2004]\nParameterName=Long\nDataType=0x15\nAccessType=rw\nDefaultValue=-1\n\
    [6040]\nParameterName=CW\nDataType=6\nAccessType=rww\nPDOMapping=1\n\
    [6041]\nParameterName=SW\nDataType=6\nAccessType=ro\nPDOMapping=1\n\
    [6060]\nParameterName=Mode\nDataType=2\nAccessType=rw\n\
    [60FF]\nParameterName=Target velocity\nDataType=4\nAccessType=rww\nPDOMapping=1\n\
    [6840]\nParameterName=CW 2\nDataType=6\nAccessType=rww\nPDOMapping=1\n\
    [6841]\nParameterName=SW 2\nDataType=6\nAccessType=ro\nPDOMapping=1\n\
    [6861]\nParameterName=Display\nDataType=2\nAccessType=ro\nPDOMapping=1\n\
    [6D02]\nParameterName=Modes\nDataType=7\nAccessType=ro\nDefaultValue=0x85\n";

#[test]
fn a_file_of_two_axes_is_a_description_with_two() {
    let kept = keep(&Eds::load(TWO_AXES.as_bytes()).expect("a small file").eds).expect("it fits");
    assert_eq!((kept.name, kept.title, kept.identity.vendor_id), ("two", "V Two", 7));
    let modes: Vec<Vec<i8>> = kept.axes.iter().map(|axis| axis.modes.iter().map(|mode| mode.0).collect()).collect();
    assert_eq!(modes, [vec![3], vec![1, 3, 8]], "by their targets, by 6502h");
    assert_eq!(kept.axes[0].mode_display.to_string(), "6060h:00");
    assert_eq!(kept.axes[1].mode_display.to_string(), "6861h:00");
    assert_eq!(kept.axes[1].units.target_velocity, None, "the second has no 68FFh");
    assert!(kept.storage.save.is_some() && kept.storage.restore.is_none());
    let rows: Vec<_> = kept.dictionary.rows().iter().filter(|row| row.index >= 0x2000).map(|row| row.name).collect();
    assert_eq!(
        rows,
        [
            "my_gain",
            "text",
            "bytes",
            "my_gain_2003_00",
            "long",
            "controlword",
            "statusword",
            "modes_of_operation",
            "target_velocity",
            "controlword_2",
            "statusword_2",
            "modes_of_operation_display_2",
            "supported_drive_modes_2",
        ]
    );
}

#[test]
fn a_file_that_leaves_the_device_type_open_is_a_drive_by_its_objects() {
    let axes = |text: &str| keep(&Eds::load(text.as_bytes()).expect("a small file").eds).map(|kept| kept.axes.len());
    assert_eq!(axes(&TWO_AXES.replace("DefaultValue=0x20192\n", "")), Ok(2));
    assert_eq!(axes(&TWO_AXES.replace("0x20192", "0x30191")), Ok(0), "an I/O module with objects there");
}

#[test]
fn values_of_every_kind_are_those_of_the_file() {
    let kept = keep(&Eds::load(TWO_AXES.as_bytes()).expect("a small file").eds).expect("it fits");
    let row = |index| kept.row(canopen::Mux::new(index, 0)).expect("it is there");
    assert_eq!(row(0x2000).default, DefaultValue::Real(0.5));
    assert_eq!(row(0x2001).default, DefaultValue::Text("abc"));
    assert_eq!(row(0x2002).default, DefaultValue::Bytes(&[1, 2, 0xFF]));
    assert_eq!(row(0x2003).default, DefaultValue::Unsigned(u64::MAX));
    assert_eq!((row(0x2004).default, row(0x2004).limits), (DefaultValue::Value(-1), None));
    assert!(row(0x2000).saved && row(0x2001).capacity >= 3 && !row(0x6040).saved);
}

#[test]
fn a_dcf_is_the_device_as_configured_and_a_device_of_another_profile_has_no_axis() {
    let file = "[FileInfo]\nFileName=io.dcf\n[DeviceComissioning]\nNodeID=9\nBaudrate=250\n\
        [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x30191\n\
        [6000]\nParameterName=Inputs\nDataType=5\nAccessType=rw\nDefaultValue=1\nParameterValue=2\n";
    let kept = keep(&Eds::load(file.as_bytes()).expect("a small file").eds).expect("it fits");
    assert_eq!((kept.axes.len(), kept.name), (0, "io"));
    assert_eq!(kept.node_id, NodeId::new(9));
    assert_eq!(kept.bitrate.map(|rate| rate.to_string()), Some("250k".into()));
    assert_eq!(kept.row(canopen::Mux::new(0x6000, 0)).map(|row| row.default), Some(DefaultValue::Value(2)));
}

#[test]
fn a_file_without_objects_or_with_too_many_is_not_kept() {
    let keep = |text: &str| keep(&Eds::load(text.as_bytes()).expect("a small file").eds).map(|kept| kept.name);
    assert_eq!(keep("[FileInfo]\n"), Err(super::Unkept::NoObjects));
    let compact = |index: u16| {
        format!("[{index:04X}]\nParameterName=P\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=254\n")
    };
    let many: String = (0x2000..0x2110).map(compact).collect();
    assert!(Eds::load(many.as_bytes()).is_err());
}

#[test]
fn an_object_with_other_rights_than_the_standard_gives_it_is_a_departure_of_the_file() {
    let text = write(&Sheet::of(devices::model("cia402").expect("a model")).eds());
    let section = text.find("[6081]").expect("the profile velocity");
    let changed = format!("{}{}", &text[..section], text[section..].replacen("AccessType=rw", "AccessType=ro", 1));
    let keys = |text: &str| {
        let kept = keep(&Eds::load(text.as_bytes()).expect("a small file").eds).expect("it fits");
        let all = kept.departures(devices::all());
        all.map(|departure| (departure.key(), departure.object())).collect::<Vec<_>>()
    };
    let other = ("other_access", Some(Mux::new(0x6081, 0)));
    assert!(keys(&changed).contains(&other) && !keys(&text).contains(&other));
    assert_eq!(keys(&changed).len(), keys(&text).len() + 1);
}

/// The description of the sheet of the standard's servo, some lines of it written otherwise.
fn of_servo(change: impl Fn(&mut Eds)) -> &'static Description {
    let mut eds = read(&Sheet::of(&devices::servo::CIA402)).eds;
    change(&mut eds);
    keep(&eds).expect("no more rows than the model")
}

fn without_default(eds: &mut Eds, index: u16, sub_index: u8) {
    let object = eds.objects.iter_mut().find(|object| object.index == index).expect("it is there");
    let of = object.variables.iter_mut().find(|of| of.sub_index == sub_index).expect("it is there");
    of.default = None;
}

#[test]
fn supported_modes_that_are_left_open_are_those_whose_objects_are_there() {
    let answers = |kept: &Description| kept.row(Mux::new(0x6502, 0)).map(|row| row.default);
    let open = of_servo(|eds| without_default(eds, 0x6502, 0));
    // pp, vl, pv, tq, hm, ip, csp, csv, cst, cstca: bits 0 to 3 and 5 to 10.
    assert_eq!(answers(open), Some(DefaultValue::Value(0x7EF)));
    assert_eq!(open.axes[0].modes, devices::servo::MODES);
    let few = of_servo(|eds| {
        without_default(eds, 0x6502, 0);
        eds.objects.retain(|object| !matches!(object.index, 0x6042 | 0x6071 | 0x6098 | 0x60C1 | 0x60C2));
    });
    assert_eq!(answers(few), Some(DefaultValue::Value(0b101)));
    let said = of_servo(|eds| eds.objects.retain(|object| object.index != 0x6071));
    assert_eq!(answers(said), Some(DefaultValue::Value(0x7EF)), "what the file says stands");
}

#[test]
fn a_device_answers_the_identity_that_it_is_known_by() {
    for open in 0..8_u8 {
        let kept = of_servo(|eds| {
            let device = &mut eds.device;
            (device.vendor_number, device.product_number, device.revision_number) = (Some(0x5A), Some(0xC1), Some(1));
            (1..=3).filter(|sub| open >> (sub - 1) & 1 == 1).for_each(|sub| without_default(eds, 0x1018, sub));
        });
        let answer = |sub_index| match kept.row(Mux::new(0x1018, sub_index)).map(|row| row.default) {
            Some(DefaultValue::Value(value)) => value as u32,
            other => panic!("{other:?}"),
        };
        let identity = kept.identity;
        let known = [identity.vendor_id, identity.product_code, identity.revision_number];
        assert_eq!([1, 2, 3].map(answer), known, "{open:03b}");
        assert_eq!(known[2], if open & 4 == 0 { 0x0001_0000 } else { 1 });
    }
}
