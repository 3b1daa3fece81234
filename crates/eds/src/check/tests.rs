//! Findings about a file as a whole.

use crate::{Eds, Severity};

fn whats(text: &str) -> Vec<(u32, Severity, String)> {
    let reading = Eds::load(text.as_bytes()).expect("a small file");
    let of_lines =
        reading.findings.iter().filter(|finding| finding.line > 0 && !finding.what.contains("none of the lists"));
    of_lines.map(|finding| (finding.line, finding.severity(), finding.what.clone())).collect()
}

const TARGET: &str = "[607A]\nParameterName=Target position\nDataType=4\nAccessType=rww\nPDOMapping=1\n[6064]\nParameterName=Position\nDataType=4\nAccessType=ro\nPDOMapping=0\n";

fn rpdo(record: &str) -> String {
    format!(
        "{TARGET}[1600]\nParameterName=RPDO1\nObjectType=9\nSubNumber=2\n[1600sub0]\nParameterName=Count\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
         [1600sub1]\nParameterName=First\nDataType=7\nAccessType=rw\nDefaultValue={record}\n[DummyUsage]\nDummy0005=1\nDummy0006=0\n"
    )
}

#[test]
fn what_is_mapped_must_be_there_with_its_length_and_access() {
    let what = |record: &str| whats(&rpdo(record)).into_iter().map(|(_, _, what)| what).collect::<Vec<_>>();
    assert_eq!(what("0x607A0020"), [""; 0]);
    assert_eq!(what("0x00050008"), [""; 0], "a placeholder that is allowed");
    assert_eq!(what("0x00060010"), ["UNSIGNED16 is mapped, but [DummyUsage] does not allow it"]);
    assert_eq!(what("0x607A0010"), ["607Ah:00 is mapped with 16 bits, but is INTEGER32"]);
    assert_eq!(what("0x607B0020"), ["607Bh:00 is mapped, but there is no such object"]);
    assert_eq!(what("0x60640020"), ["6064h:00 is mapped, but its PDOMapping is 0"]);
    assert_eq!(what("0"), ["counted, but nothing is mapped"]);
    assert_eq!(whats(&rpdo("0"))[0].0, 20, "the line of the record");
}

#[test]
fn a_pdo_has_64_bits() {
    let mapped = |records: &[&str]| {
        let count = records.len();
        let head = format!("{TARGET}[1600]\nParameterName=RPDO1\nObjectType=9\nSubNumber={}\n", count + 1);
        let counted = format!("[1600sub0]\nParameterName=Count\nDataType=5\nAccessType=rw\nDefaultValue={count}\n");
        let records = records.iter().enumerate().map(|(place, record)| {
            let sub_index = place + 1;
            format!(
                "[1600sub{sub_index}]\nParameterName=R{sub_index}\nDataType=7\nAccessType=rw\nDefaultValue={record}\n"
            )
        });
        let text = head + &counted + &records.collect::<String>() + "[DummyUsage]\nDummy0005=1\n";
        whats(&text).into_iter().map(|(_, _, what)| what).collect::<Vec<_>>()
    };
    let (long, byte) = ("0x607A0020", "0x00050008");
    assert_eq!(mapped(&[long, long]), [""; 0]);
    assert_eq!(mapped(&[long, long, byte]), ["72 bits are mapped as delivered; a PDO has 64"]);
}

#[test]
fn identifiers_that_every_node_would_have_are_reported() {
    let emcy = |default: &str| {
        whats(&format!("[1014]\nParameterName=COB-ID EMCY\nDataType=7\nAccessType=ro\nDefaultValue={default}\n"))
    };
    assert_eq!(emcy("0x80").len(), 1);
    assert_eq!(emcy("0x80000080").len(), 1);
    assert_eq!(emcy("$NODEID+0x80").len(), 0);
    assert_eq!(emcy("0x85").len(), 0, "the file of one node");
}

#[test]
fn sub_index_0_is_there_and_unsigned8_and_counts_no_more_than_there_is() {
    let record = |data_type: u8, default: u8| {
        format!(
            "[2000]\nParameterName=R\nObjectType=9\nSubNumber=2\n[2000sub0]\nParameterName=Count\nDataType={data_type}\nAccessType=ro\nDefaultValue={default}\n\
             [2000sub1]\nParameterName=A\nDataType=5\nAccessType=ro\n"
        )
    };
    assert_eq!(whats(&record(5, 1)), []);
    assert_eq!(whats(&record(6, 1)).len(), 1);
    assert_eq!(whats(&record(5, 2)).len(), 1);
    let missing =
        "[2000]\nParameterName=R\nObjectType=9\nSubNumber=1\n[2000sub1]\nParameterName=A\nDataType=5\nAccessType=ro\n";
    assert_eq!(whats(missing).iter().map(|(_, severity, _)| *severity).collect::<Vec<_>>(), [Severity::Error]);
}

#[test]
fn names_that_other_tools_cut_and_letters_beyond_ascii_are_reported() {
    let file = "[2000]\nParameterName=Gain #1 \u{fc}\nDataType=5\nAccessType=ro\n";
    let found: Vec<_> = whats(file).into_iter().map(|(line, _, what)| (line, what)).collect();
    let letters = (2, "letters beyond ASCII, which CiA 306 does not have".to_owned());
    assert_eq!(found, [(1, "some tools cut a name at '#'".to_owned()), letters]);
}

#[test]
fn a_drive_that_names_no_mode_is_reported() {
    let drive = |modes: &str| {
        let words =
            "[6040]\nParameterName=C\nDataType=6\nAccessType=rw\n[6041]\nParameterName=S\nDataType=6\nAccessType=ro\n";
        whats(&format!("{words}[6502]\nParameterName=Modes\nDataType=7\nAccessType=ro\n{modes}"))
    };
    let wanted = "says no mode of operation: tools that take the modes from it have none";
    for open in ["", "DefaultValue=\n", "DefaultValue=0\n"] {
        assert_eq!(drive(open), [(9, Severity::Warning, wanted.to_owned())], "{open:?}");
    }
    assert_eq!(drive("DefaultValue=0x25\n"), []);
    let encoder = "[6502]\nParameterName=Total range\nDataType=7\nAccessType=ro\n";
    assert_eq!(whats(encoder), [], "6502h of an encoder (CiA 406) is another object");
}
