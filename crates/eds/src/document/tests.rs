//! Documents keep every byte, and refuse what is too large.

use super::*;

const SMALL: &str =
    "; made by hand\r\n[FileInfo]\r\nFileName = a.eds\r\n\r\n[1000]\r\nParameterName=Device type\r\nDefaultValue=\r\n";

fn document(text: &str) -> Document {
    Document::parse(text.as_bytes()).expect("a small document")
}

#[test]
fn bytes_come_back_as_they_were_read() {
    let files: [&[u8]; 9] = [
        SMALL.as_bytes(),
        b"",
        b"\n\n",
        b"[a\nb\n=c\n[ d ]  e\nf=g",
        b"\xEF\xBB\xBF[a]\nb=\xC3\xA4\n",
        b"[a]\nb=\xE4\xFF\n",
        b"\xEF\xBB\xBF[a]\nb=\xE4\xFF\n",
        b"[a]\rb=c\rd=e",
        b"\r\r\n[a]\r\r\nb=1\r\r\n",
    ];
    for bytes in files {
        assert_eq!(Document::parse(bytes).expect("small").to_bytes(), bytes, "{bytes:?}");
    }
}

#[test]
fn sections_and_entries_have_their_lines() {
    let document = document(SMALL);
    let sections: Vec<_> = document.sections().map(|section| (section.line(), section.name())).collect();
    assert_eq!(sections, [(2, "FileInfo"), (5, "1000")]);
    let file_info = document.section("fileinfo").expect("in any case");
    let entries: Vec<_> = file_info.entries().collect();
    assert_eq!(entries, [Entry { line: 3, key: "FileName", value: "a.eds" }]);
    assert_eq!(document.value("1000", "parametername"), Some("Device type"));
    assert_eq!(document.lines().next(), Some((1, LineKind::Comment, "; made by hand")));
}

#[test]
fn old_macintosh_lines_are_lines() {
    assert_eq!(document("[a]\rb=c\rd=e\r").value("a", "d"), Some("e"));
}

#[test]
fn a_heading_with_blanks_or_without_an_end_is_a_section() {
    let document = document("[ 1000 ]\na=1\n[2000\nb=2\n[3000] x\n");
    let names: Vec<_> = document.sections().map(|section| (section.name(), section.is_well_formed())).collect();
    assert_eq!(names, [("1000", false), ("2000", false), ("3000", false)]);
}

#[test]
fn latin_1_is_read_as_such() {
    let document = Document::parse(b"[a]\nb=gr\xFC\xDF\n").expect("small");
    assert_eq!((document.encoding(), document.value("a", "b")), (Encoding::Latin1, Some("gr\u{fc}\u{df}")));
}

/// A byte order mark is not a part of the first line, whatever follows.
#[test]
fn a_byte_order_mark_hides_no_section() {
    for (bytes, encoding, value) in [
        (&b"\xEF\xBB\xBF[a]\nb=c\n"[..], Encoding::Utf8WithMark, "c"),
        (b"\xEF\xBB\xBF[a]\nb=gr\xC3\xBC\xC3\x9F\n", Encoding::Utf8WithMark, "gr\u{fc}\u{df}"),
        (b"\xEF\xBB\xBF[a]\nb=gr\xFC\xDF\n", Encoding::Latin1WithMark, "gr\u{fc}\u{df}"),
    ] {
        let document = Document::parse(bytes).expect("small");
        assert_eq!((document.encoding(), document.value("a", "b")), (encoding, Some(value)), "{bytes:?}");
    }
}

#[test]
fn a_rewritten_value_changes_its_line_only() {
    let mut document = document(SMALL);
    document.set("1000", "DefaultValue", "0x20192").expect("fits");
    document.set("fileinfo", "FILENAME", "longer than before.eds").expect("fits");
    let expected = SMALL.replace("DefaultValue=", "DefaultValue=0x20192").replace("a.eds", "longer than before.eds");
    assert_eq!(document.text(), expected);
    assert_eq!(document.value("1000", "ParameterName"), Some("Device type"), "lines behind have moved");
    document.set("FileInfo", "FileName", "").expect("fits");
    assert_eq!(document.value("1000", "DefaultValue"), Some("0x20192"));
    assert_eq!(document.value("FileInfo", "FileName"), Some(""));
}

#[test]
fn a_new_key_stands_behind_the_last_of_its_section() {
    let mut document = document(SMALL);
    document.set("FileInfo", "FileVersion", "1").expect("fits");
    assert_eq!(document.text(), SMALL.replace("a.eds\r\n", "a.eds\r\nFileVersion=1\r\n"));
    document.add_section("Comments").expect("fits");
    document.set("Comments", "Lines", "0").expect("fits");
    assert!(document.text().ends_with("DefaultValue=\r\n\r\n[Comments]\r\nLines=0\r\n"));
}

#[test]
fn what_is_no_line_of_the_file_is_not_written() {
    let mut latin = Document::parse(b"[a]\nb=\xE4\n").expect("small");
    assert_eq!(latin.set("a", "b", "1\n[x]"), Err(EditError::NotOneLine));
    assert_eq!(latin.set("a", "b", "\u{3a9}"), Err(EditError::Letter('\u{3a9}')));
    assert_eq!(latin.set("c", "b", "1"), Err(EditError::NoSection("c".into())));
    assert_eq!(latin.to_bytes(), b"[a]\nb=\xE4\n");
    let mut ascii = document("[a]\nb=1\n");
    ascii.set("a", "b", "\u{3a9}").expect("an ASCII file may become UTF-8");
    assert_eq!(Document::parse(&ascii.to_bytes()).expect("small").value("a", "b"), Some("\u{3a9}"));
}

fn refusal(bytes: &[u8]) -> Refusal {
    Document::parse(bytes).expect_err("too large")
}

#[test]
fn a_bomb_is_refused_with_its_line() {
    let sections = "[1000]\n".repeat(1_000_000);
    assert!(refusal(sections.as_bytes()).reason.contains("7000000 bytes"));
    let sections = "[1]\n".repeat(1_000_000);
    assert_eq!(
        (refusal(sections.as_bytes()).line, refusal(sections.as_bytes()).reason.as_str()),
        (40_001, "more than 40000 sections")
    );
    let long = format!("[1000]\nParameterName={}\n", "x".repeat(10_000));
    assert_eq!(refusal(long.as_bytes()).line, 2);
    let lines = "\n".repeat(1_000_000);
    assert_eq!(
        (refusal(lines.as_bytes()).line, refusal(lines.as_bytes()).reason.as_str()),
        (250_001, "more than 250000 lines")
    );
}

#[test]
fn text_of_16_bit_characters_is_refused_with_what_to_do() {
    let refused = refusal(b"\xFF\xFE[\0a\0]\0");
    assert_eq!(
        refused.to_string(),
        "line 1: the file is text of 16-bit characters (UTF-16); save it as UTF-8 or Latin-1 text"
    );
}
