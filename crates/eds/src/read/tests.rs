//! What real files have, one thing a test.

use super::Reading;
use crate::{AccessType, Eds, Finding, List, Number, ObjectType, Severity, TypeCode, Value};

/// A file with the mandatory objects and what else is given: objects of the manufacturer, with their list.
fn reading(listed: &[u16], sections: &str) -> Reading {
    let list: String = listed.iter().enumerate().map(|(at, index)| format!("{}=0x{index:04X}\n", at + 1)).collect();
    let text = format!(
        "[FileInfo]\nFileName=t.eds\n[DeviceInfo]\nVendorName=V\nBaudRate_500=1\nBaudRate_50=0\n\
         [MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n\
         [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=const\nDefaultValue=0\nPDOMapping=0\n\
         [1001]\nParameterName=Error register\nObjectType=7\nDataType=5\nAccessType=ro\nPDOMapping=1\n\
         [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=1\n\
         [1018sub0]\nParameterName=Count\nDataType=5\nAccessType=const\nDefaultValue=0\n\
         [ManufacturerObjects]\nSupportedObjects={}\n{list}{sections}",
        listed.len()
    );
    Eds::load(text.as_bytes()).expect("a small file")
}

fn of_2000(section: &str) -> Reading {
    reading(&[0x2000], &format!("[2000]\n{section}"))
}

/// The findings in short: severity, key, what was taken.
fn short(reading: &Reading) -> Vec<(Severity, String, Option<String>)> {
    let one = |finding: &Finding| {
        (finding.severity(), finding.key.clone().unwrap_or_default(), finding.taken_instead.clone())
    };
    reading.findings.iter().map(one).collect()
}

fn plain(number: i128) -> Option<Value> {
    Some(Value::Number(Number::plain(number)))
}

const U16: &str = "ParameterName=P\nObjectType=7\nDataType=6\nAccessType=rw\nPDOMapping=0\n";

#[test]
fn a_clean_file_has_no_findings() {
    let reading = of_2000(&format!("{U16}DefaultValue=300\nLowLimit=0x10\nHighLimit=0xFFFF\n"));
    assert_eq!(short(&reading), []);
    let object = reading.eds.object(0x2000).expect("it is there");
    assert_eq!((object.object_type, object.list), (ObjectType::Var, Some(List::Manufacturer)));
    let variable = object.variable(0).expect("a VAR has one");
    assert_eq!((&variable.default, &variable.low, &variable.high), (&plain(300), &plain(16), &plain(65_535)));
    assert_eq!(reading.eds.device.bit_rates, [500]);
}

#[test]
fn access_is_read_in_any_case_and_the_process_directions_too() {
    for (text, access) in [
        ("RO", AccessType::ReadOnly),
        ("Const", AccessType::Const),
        ("rwr", AccessType::ReadWriteInput),
        ("RWW", AccessType::ReadWriteOutput),
        ("wo", AccessType::WriteOnly),
    ] {
        let reading = of_2000(&format!("ParameterName=P\nDataType=6\nAccessType={text}\n"));
        assert_eq!(reading.eds.variable(0x2000, 0).map(|variable| variable.access), Some(access));
        assert!(reading.findings.is_empty(), "{text}");
    }
}

#[test]
fn an_unknown_type_is_taken_as_unsigned32_and_reported_with_its_line() {
    let reading = of_2000("ParameterName=P\nDataType=0x0077\nAccessType=rw\n");
    assert_eq!(short(&reading), [(Severity::Error, "DataType".into(), Some("UNSIGNED32".into()))]);
    let finding = reading.findings.iter().next().expect("one");
    assert_eq!((finding.line, finding.section.as_str()), (39, "2000"));
    assert_eq!(reading.eds.variable(0x2000, 0).map(|variable| variable.data_type), Some(TypeCode::UNSIGNED32));
}

#[test]
fn a_default_beyond_its_type_is_left_out_and_one_of_the_same_bits_is_taken() {
    let default = |line: &str, data_type: u8| {
        let reading = of_2000(&format!("ParameterName=P\nDataType={data_type}\nAccessType=rw\nDefaultValue={line}\n"));
        let variable = reading.eds.variable(0x2000, 0).expect("it is there").clone();
        (variable.default, short(&reading).first().map(|(severity, ..)| *severity))
    };
    assert_eq!(default("65536", 6), (None, Some(Severity::Error)));
    assert_eq!(default("0xFFFF", 3), (plain(-1), Some(Severity::Warning)));
    assert_eq!(default("0x1FFFF", 3), (None, Some(Severity::Error)));
    assert_eq!(default("-1", 6), (plain(65_535), Some(Severity::Warning)));
    assert_eq!(default("-40000", 6), (None, Some(Severity::Error)));
    assert_eq!(default("red", 6), (None, Some(Severity::Error)));
    assert_eq!(default("2.0", 6), (plain(2), Some(Severity::Warning)));
    assert_eq!(default("true", 1), (plain(1), Some(Severity::Warning)));
    assert_eq!(default("0xFF", 5), (plain(255), None));
    assert_eq!(default("$NODEID+0x80", 5).1, None, "FFh on node 127");
    assert_eq!(default("$NODEID+0x81", 5), (None, Some(Severity::Error)), "100h on node 127");
    assert_eq!(default("$NODEID+0x80", 7).1, None);
}

#[test]
fn limits_that_contradict_are_not_taken() {
    let limits = |lines: &str| {
        let reading = of_2000(&format!("{U16}{lines}"));
        let variable = reading.eds.variable(0x2000, 0).expect("it is there").clone();
        (variable.default, variable.low, variable.high, reading.findings.count(Severity::Error))
    };
    assert_eq!(limits("DefaultValue=0\nLowLimit=32\nHighLimit=127\n"), (plain(0), None, plain(127), 1));
    assert_eq!(limits("DefaultValue=200\nLowLimit=32\nHighLimit=127\n"), (plain(200), plain(32), None, 1));
    assert_eq!(limits("DefaultValue=50\nLowLimit=127\nHighLimit=32\n"), (plain(50), None, None, 1));
}

#[test]
fn limits_are_compared_with_the_node_id_in_the_default() {
    // (default, low limit, high limit), errors: node-IDs are 1 to 127, so $NODEID+0x200 is 201h to 27Fh.
    for (default, low, high, errors) in [
        ("$NODEID+0x200", "0x201", "0x27F", 0),
        ("$NODEID+0x200", "0x200", "0x3FF", 0),
        ("$NODEID+0x200", "0x280", "0x3FF", 1),
        ("$NODEID+0x200", "0x100", "0x200", 1),
        ("$NODEID+0x200", "$NODEID+0x200", "$NODEID+0x200", 0),
        ("0x205", "$NODEID+0x200", "$NODEID+0x200", 0),
        ("0x200", "$NODEID+0x200", "0x3FF", 1),
        ("0x205", "0x300", "$NODEID+0x200", 1),
    ] {
        let text = format!("{U16}DefaultValue={default}\nLowLimit={low}\nHighLimit={high}\n");
        assert_eq!(of_2000(&text).findings.count(Severity::Error), errors, "{default} {low} {high}");
    }
}

#[test]
fn of_two_objects_at_one_place_the_first_is_taken() {
    let reading = reading(&[0x2000], &format!("[2000]\n{U16}DefaultValue=1\n[2000]\n{U16}DefaultValue=2\n"));
    assert_eq!(short(&reading), [(Severity::Error, String::new(), Some("the one in line 37".into()))]);
    assert_eq!(reading.findings.iter().next().map(|finding| finding.line), Some(44));
    assert_eq!(reading.eds.variable(0x2000, 0).and_then(|variable| variable.default.clone()), plain(1));
}

#[test]
fn of_two_lines_of_one_key_the_first_is_taken() {
    let reading = of_2000(&format!("{U16}DefaultValue=1\nDEFAULTVALUE=2\n"));
    assert_eq!(short(&reading), [(Severity::Warning, "DEFAULTVALUE".into(), Some("1".into()))]);
    assert_eq!(reading.eds.variable(0x2000, 0).and_then(|variable| variable.default.clone()), plain(1));
}

#[test]
fn compact_sub_objects_have_names_and_values_from_the_sections_beside() {
    let reading = reading(
        &[0x2000],
        "[2000]\nParameterName=Word \nObjectType=8\nDataType=6\nAccessType=rw\nDefaultValue=7\nPDOMapping=1\nCompactSubObj=3\n\
         [2000Name]\nNrOfEntries=1\n2=Second\n[2000Value]\nNrOfEntries=3\n1=0x10\n9=1\n0=9\n",
    );
    let object = reading.eds.object(0x2000).expect("it is there");
    let shown: Vec<_> = object.variables.iter().map(|v| (v.sub_index, v.name.as_str(), v.default.clone())).collect();
    let expected =
        [(0, "NrOfObjects", plain(3)), (1, "Word1", plain(16)), (2, "Second", plain(7)), (3, "Word3", plain(7))];
    assert_eq!(shown, expected);
    assert_eq!(
        object.variable(0).map(|count| (count.data_type, count.pdo_mapping)),
        Some((TypeCode::UNSIGNED8, false))
    );
    // Sub-index 0 is the count, which CompactSubObj has already.
    assert_eq!(short(&reading), ["9", "0"].map(|entry| (Severity::Error, entry.into(), Some("nothing".into()))));
}

/// A file that counts so many PDOs and lists the second RPDO only.
fn counting(pdos: u16, compact: u8) -> Result<Reading, crate::Refusal> {
    let text = format!(
        "[DeviceInfo]\nNrOfRXPDO={pdos}\nNrOfTXPDO={pdos}\nCompactPDO={compact}\n[OptionalObjects]\nSupportedObjects=1\n1=0x1401\n\
         [1401]\nParameterName=P\nObjectType=9\nSubNumber=2\n[1401sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
         [1401sub1]\nParameterName=C\nDataType=7\nAccessType=rw\nDefaultValue=$NODEID+0x300\n"
    );
    Eds::load(text.as_bytes())
}

#[test]
fn pdos_that_are_counted_and_not_listed_have_the_sub_indices_that_compact_pdo_names() {
    assert_eq!(counting(3, 0).expect("a small file").eds.objects.len(), 1, "without it there are none");
    let eds = counting(6, 0b1_0111).expect("a small file").eds;
    let indices: Vec<u16> = eds.objects.iter().map(|object| object.index).collect();
    // 1401h is listed without a mapping, which does not come from CompactPDO.
    let expected = [0x1400..0x1406, 0x1600..0x1601, 0x1602..0x1606, 0x1800..0x1806, 0x1A00..0x1A06];
    assert_eq!(indices, expected.into_iter().flatten().collect::<Vec<u16>>());
    let of = |index: u16| eds.object(index).expect("it is there");
    let subs: Vec<u8> = of(0x1804).variables.iter().map(|variable| variable.sub_index).collect();
    assert_eq!((subs, of(0x1401).variables.len(), of(0x1A00).variables.len()), (vec![0, 1, 2, 3, 5], 2, 65));
    let cob_id = |index| of(index).variable(1).and_then(|variable| variable.default.clone());
    let own = |base| Some(Value::Number(Number { base, plus_node_id: true }));
    assert_eq!((cob_id(0x1402), cob_id(0x1803)), (own(0x400), own(0x480)));
    assert_eq!(cob_id(0x1405), plain(0x8000_0000), "no identifier is reserved for RPDO6");
    // Written out they are listed, and no more are added.
    assert_eq!(crate::diff(&eds, &Eds::load(crate::write(&eds).as_bytes()).expect("a small file").eds), []);
}

#[test]
fn a_line_of_compact_pdo_cannot_ask_for_more_values_than_are_read() {
    let refused = counting(u16::MAX, 0x3F).expect_err("73,000 values");
    assert_eq!((refused.line, refused.reason.as_str()), (4, "more than 60000 objects and sub-objects"));
}

#[test]
fn a_few_lines_of_compact_sub_objects_cannot_ask_for_all_memory() {
    let mut text = String::new();
    for index in 0x2000..0x2400 {
        text +=
            &format!("[{index:04X}]\nParameterName=P\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=254\n");
    }
    let refused = Eds::load(text.as_bytes()).expect_err("260,000 values");
    assert_eq!(refused.reason, "more than 60000 objects and sub-objects");
    assert_eq!(refused.line, 235 * 6 + 1);
}

#[test]
fn texts_that_compact_sub_objects_repeat_are_bounded() {
    let long = "x".repeat(4_000);
    let mut text = String::new();
    for index in 0x2000..0x2010 {
        text += &format!(
            "[{index:04X}]\nParameterName={long}\nObjectType=8\nDataType=9\nAccessType=rw\nCompactSubObj=254\n"
        );
    }
    let refused = Eds::load(text.as_bytes()).expect_err("16 MB from 64 KB");
    assert_eq!((refused.line, refused.reason.as_str()), (8 * 6 + 1, "compact sub-objects repeat texts of megabytes"));
}

#[test]
fn sub_objects_without_their_object_and_a_var_with_sub_objects_are_records() {
    let sub = "[2000sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\nDefaultValue=1\n[2000sub1]\nParameterName=A\nDataType=6\nAccessType=rw\n";
    let orphan = reading(&[0x2000], sub);
    assert_eq!(
        orphan.eds.object(0x2000).map(|object| (object.object_type, object.variables.len())),
        Some((ObjectType::Record, 2))
    );
    assert_eq!(orphan.findings.count(Severity::Error), 1);
    let var = reading(&[0x2000], &format!("[2000]\nParameterName=R\nObjectType=7\nSubNumber=2\n{sub}"));
    assert_eq!(short(&var), [(Severity::Error, "ObjectType".into(), Some("RECORD".into()))]);
}

#[test]
fn lists_that_do_not_fit_the_sections_are_reported() {
    let reading = reading(&[0x2000, 0x2001, 0x6000, 0x2000], &format!("[2000]\n{U16}[6000]\n{U16}[2002]\n{U16}"));
    let whats: Vec<&str> = reading.findings.iter().map(|finding| finding.what.as_str()).collect();
    assert_eq!(
        whats,
        [
            "there is no section [2001]",
            "6000h belongs into [OptionalObjects]",
            "2000h is listed twice, first in line 36",
            "the object stands in none of the lists: [ManufacturerObjects] misses it",
        ]
    );
}

#[test]
fn a_dcf_has_values_and_one_device() {
    let text = format!(
        "[2000]\n{U16}DefaultValue=1\nParameterValue=0x22\nDenotation=left\n[DeviceComissioning]\nNodeID=5\nBaudrate=500\nNodeName=Axis\nCANopenManager=0\nLSS_SerialNumber=0x0\n"
    );
    let reading = reading(&[0x2000], &text);
    assert_eq!(short(&reading), []);
    let variable = reading.eds.variable(0x2000, 0).expect("it is there");
    assert_eq!((&variable.value, variable.denotation.as_str()), (&plain(0x22), "left"));
    let commissioning = reading.eds.commissioning.as_ref().expect("a DCF has it");
    assert_eq!(
        (commissioning.node_id, commissioning.bit_rate, commissioning.node_name.as_str()),
        (Some(5), Some(500), "Axis")
    );
    assert!(reading.eds.is_dcf());
    assert!(!of_2000(U16).eds.is_dcf());
}

#[test]
fn in_a_dcf_the_values_of_compact_sub_objects_are_values_and_one_beyond_its_limits_is_reported() {
    let object = "[2000]\nParameterName=W\nObjectType=8\nDataType=6\nAccessType=rw\nDefaultValue=1\nHighLimit=9\nCompactSubObj=2\n\
                  [2000Value]\nNrOfEntries=1\n2=7\n";
    let second = |text: &str| {
        let reading = reading(&[0x2000], text);
        let variable = reading.eds.variable(0x2000, 2).expect("it is there").clone();
        (
            variable.default,
            variable.value,
            reading.findings.iter().map(|finding| finding.what.clone()).collect::<Vec<_>>(),
        )
    };
    assert_eq!(second(object), (plain(7), None, vec![]));
    let dcf = format!("{object}[DeviceComissioning]\nNodeID=5\n");
    assert_eq!(second(&dcf), (plain(1), plain(7), vec![]));
    let beyond = vec!["the value lies outside of the limits".to_owned()];
    assert_eq!(second(&dcf.replace("2=7", "2=10")), (plain(1), plain(10), beyond));
}

#[test]
fn domains_reals_strings_and_times_keep_their_values() {
    let value = |data_type: &str, text: &str| {
        let reading = of_2000(&format!("ParameterName=P\nDataType={data_type}\nAccessType=rw\nDefaultValue={text}\n"));
        (reading.eds.variable(0x2000, 0).and_then(|variable| variable.default.clone()), reading.findings.iter().count())
    };
    assert_eq!(value("0x8", "0.1"), (Some(Value::Real(f64::from(0.1_f32))), 0));
    assert_eq!(value("0x11", "0x400921FB54442D18"), (Some(Value::Real(std::f64::consts::PI)), 1));
    assert_eq!(value("0x8", "nan"), (None, 1));
    assert_eq!(value("0x9", "V1.0 = new"), (Some(Value::Text("V1.0 = new".into())), 0));
    assert_eq!(value("0xC", "365 43200000"), (Some(Value::Text("365 43200000".into())), 0));
    let domain = of_2000("ParameterName=P\nObjectType=2\nDataType=0xF\nAccessType=wo\nDownloadFile=a.bin\n");
    let variable = domain.eds.variable(0x2000, 0).expect("it is there");
    assert!(variable.is_domain && variable.download_file == "a.bin" && domain.findings.is_empty());
}

#[test]
fn modules_and_sections_of_somebodys_own_are_kept() {
    let reading = reading(&[], "[M1ModuleInfo]\nProductName=DI8\n[Extra]\nA=b\n");
    let kept: Vec<_> =
        reading.eds.kept.iter().map(|section| (section.name.as_str(), section.entries.clone())).collect();
    let entry = |key: &str, value: &str| vec![(key.to_owned(), value.to_owned())];
    assert_eq!(kept, [("M1ModuleInfo", entry("ProductName", "DI8")), ("Extra", entry("A", "b"))]);
    assert_eq!(reading.findings.count(Severity::Warning), 2);
    assert!(reading.eds.has_modules());
    assert!(!self::reading(&[], "[Extra]\nA=b\n").eds.has_modules());
}

#[test]
fn dynamic_channels_dummies_and_comments_are_read() {
    let text = "[DynamicChannels]\nNrOfSeg=1\nType1=0x0007\nDir1=ro\nRange1=0xA080-0xA0BF\nPPOffset1=0\nMaxCnt1=64\n\
                [DummyUsage]\nDummy0005=1\nDummy0006=0\n[Comments]\nLines=1\nLine1=made by hand\n";
    let reading = reading(&[], text);
    assert_eq!(short(&reading), []);
    assert_eq!(reading.eds.dynamic_channels.first().map(|channel| channel.range.as_str()), Some("0xA080-0xA0BF"));
    assert_eq!(reading.eds.dummies, [(TypeCode::UNSIGNED8, true), (TypeCode::UNSIGNED16, false)]);
    assert_eq!(reading.eds.comments, ["made by hand"]);
}

#[test]
fn lines_that_are_nothing_are_reported() {
    let reading = reading(&[], "what is this\n");
    assert_eq!(reading.findings.iter().map(|finding| finding.line).collect::<Vec<_>>(), [36]);
    assert_eq!(Eds::load(b"a=b\n").expect_err("no section").reason, "the file has no sections");
}
