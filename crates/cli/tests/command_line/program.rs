//! `ferrodrive program`: a program into a node of the private virtual bus.

use processes::{done, ferrodrive, scratch};
use serde_json::json;

/// A box with one program (CiA 302-3), which is not a drive.
const SHEET: &str = "[FileInfo]\nFileName=box.eds\n[DeviceInfo]\nVendorName=None\nProductName=Box\n\
[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x00030191\n\
[1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
[1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n[1018sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1018sub1]\nParameterName=Vendor\nDataType=7\nAccessType=ro\nDefaultValue=7\n\
[1F50]\nParameterName=Data\nObjectType=8\nSubNumber=2\n[1F50sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1F50sub1]\nParameterName=1\nDataType=0xF\nAccessType=wo\n\
[1F51]\nParameterName=Control\nObjectType=8\nSubNumber=2\n[1F51sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1F51sub1]\nParameterName=1\nDataType=5\nAccessType=rw\nDefaultValue=0\n\
[1F56]\nParameterName=Id\nObjectType=8\nSubNumber=2\n[1F56sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1F56sub1]\nParameterName=1\nDataType=7\nAccessType=ro\nDefaultValue=0\n\
[1F57]\nParameterName=Status\nObjectType=8\nSubNumber=2\n[1F57sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
[1F57sub1]\nParameterName=1\nDataType=7\nAccessType=ro\nDefaultValue=0\n";

#[test]
fn a_program_is_sent_read_back_and_started() {
    let folder = scratch("program");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(path("box.eds"), SHEET).unwrap();
    std::fs::write(path("m.toml"), "bitrate = \"1M\"\n[[drive]]\nmodel = \"box.eds\"\nnode = 9\n").unwrap();
    std::fs::write(path("nine.bin"), "123456789").unwrap();
    let (machine, program) = (path("m.toml"), path("nine.bin"));
    let report = done(&["--json", "--machine", &machine, "program", "9", &program]).json();
    // The check value of CRC-32.
    let sum = json!(0xCBF4_3926_u32);
    assert_eq!((&report["bytes"], &report["checksum"], &report["identification"]), (&json!(9), &sum, &sum));
    assert_eq!((&report["sent"], &report["verified"], &report["running"]), (&json!(true), &json!(true), &json!(true)));
    let text = done(&["--machine", &machine, "program", "9", &program]).out;
    assert_eq!(text, "node 9: program 1: 9 bytes sent, CRC-32 CBF43926h read back, running\n");
}

#[test]
fn a_node_without_programs_and_an_empty_file_are_refused() {
    let folder = scratch("no_program");
    let path = folder.join("empty.bin").to_str().unwrap().to_owned();
    std::fs::write(&path, "").unwrap();
    let ended = ferrodrive(&["program", "4", &path]);
    assert!(ended.status == Some(1) && ended.err.contains("is empty"), "{}", ended.err);
    std::fs::write(&path, "123456789").unwrap();
    let ended = ferrodrive(&["program", "4", &path]);
    assert!(
        ended.status == Some(1) && ended.err.contains("1F50h") && ended.err.contains("0602 0000h"),
        "{}",
        ended.err
    );
}
