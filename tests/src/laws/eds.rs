//! EDS and DCF files: a document gives its bytes back, and what a file says can be written and says the same.

use eds::document::{Bounds, Document, LineKind};
use eds::{Eds, Findings, diff, write};

pub(super) const SAMPLES: &[&[u8]] = &[
    b"; by hand\r\n[FileInfo]\r\nFileName=a.eds\r\nFileVersion=1\r\n[DeviceInfo]\r\nVendorNumber=0x100\r\nBaudRate_500=1\r\n\
      [MandatoryObjects]\r\nSupportedObjects=1\r\n1=0x1000\r\n[1000]\r\nParameterName=Device type\r\nObjectType=0x7\r\n\
      DataType=0x0007\r\nAccessType=RO\r\nDefaultValue=0x20192\r\nPDOMapping=0\r\n",
    b"[OptionalObjects]\nSupportedObjects=0x2\n1=0x1014\n2=0x1600\n[1014]\nParameterName=EMCY\nDataType=7\nAccessType=rw\n\
      DefaultValue= $NodeID + 0x80\nParameterValue=0x85\n[1600]\nParameterName=M\nObjectType=9\nSubNumber=2\n\
      [1600sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=1\n[1600sub1]\nParameterName=1\nDataType=7\n\
      AccessType=rw\nDefaultValue=0x60400010\n",
    b"[2000]\nParameterName=Words\nObjectType=8\nDataType=6\nAccessType=rww\nCompactSubObj=3\nLowLimit=-1\nHighLimit=5\n\
      [2000Value]\nNrOfEntries=1\n2=010\n[2000Name]\n3=Third\n[2001]\nParameterName=R\nDataType=8\nAccessType=rw\nDefaultValue=1.5\n",
    b"\xEF\xBB\xBF[DeviceComissioning]\nNodeID=5\n[Comments]\nLines=1\nLine1=\xC3\xA4\n[DummyUsage]\nDummy0005=1\n",
    b"[DynamicChannels]\rNrOfSeg=1\rType1=7\rRange1=0xA080-0xA0BF\r[M1ModuleInfo]\rProductName=\xE4\r[Own]\rA=b",
];

/// Written out, compact sub-objects are longer than any file that is read.
const WRITTEN: Bounds = Bounds { bytes: 64 << 20, lines: 2_000_000, line_bytes: 8_192, sections: 200_000 };

pub(super) fn eds(data: &[u8]) {
    let Ok(document) = Document::parse(data) else { return };
    assert_eq!(document.to_bytes(), data, "a document gives its bytes back");
    let entries: usize = document.sections().map(|section| section.entries().count()).sum();
    let lines = document.lines().filter(|(_, kind, _)| matches!(kind, LineKind::Entry { .. })).count();
    assert!(entries <= lines, "{entries} entries in {lines} lines");
    rewriting_changes_one_line(&document);

    let Ok(reading) = Eds::read(&document) else { return };
    let (eds, findings) = (reading.eds, reading.findings);
    assert!(findings.iter().count() <= Findings::MOST);
    assert!(findings.iter().all(|finding| finding.line as usize <= document.line_count()));
    assert!(eds.objects.is_sorted_by(|a, b| a.index < b.index), "each object once");
    assert!(eds.objects.iter().all(|object| object.variables.is_sorted_by(|a, b| a.sub_index < b.sub_index)));

    let again = read_written(&write(&eds));
    assert_eq!(diff(&eds, &again), [], "what is written says the same");
    let text = write(&again);
    assert_eq!(write(&read_written(&text)), text, "and is written the same");
}

/// The first value of the file, written anew: every other line stays.
fn rewriting_changes_one_line(document: &Document) {
    let Some((section, entry)) = document.sections().find_map(|section| Some((section, section.entries().next()?)))
    else {
        return;
    };
    let first = document.section(section.name()).and_then(|section| section.entry(entry.key));
    let Some(first) = first else { return };
    let mut changed = document.clone();
    if changed.set(section.name(), entry.key, "0x1234").is_err() {
        return;
    }
    assert_eq!(changed.value(section.name(), entry.key), Some("0x1234"));
    let others = |document: &Document| {
        let lines = document.lines().filter(|(line, ..)| *line != first.line);
        lines
            .map(|(line, kind, text)| (line, matches!(kind, LineKind::Entry { .. }), text.to_owned()))
            .collect::<Vec<_>>()
    };
    assert!(others(&changed) == others(document), "line {} was rewritten, and others changed", first.line);
    let read = Document::parse(&changed.to_bytes()).expect("the file is no larger than before");
    // Without the one letter that was not UTF-8 the same bytes are other letters.
    let same_letters = read.encoding() == changed.encoding();
    assert!(!same_letters || others(&read) == others(&changed), "the places of the lines are those of the text");
}

fn read_written(text: &str) -> Eds {
    let document = Document::parse_within(text.as_bytes(), WRITTEN).expect("what is written is a document");
    Eds::read(&document).expect("what is written can be read").eds
}
