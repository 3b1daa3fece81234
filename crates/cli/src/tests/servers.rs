//! The SDO server by which a node is asked, and the counter of SYNC: on the command line and in a machine file.

use processes::scratch;

use super::virtual_bus::VirtualBus;

const SHEET: &str = "[DeviceInfo]\nVendorName=None\nProductName=Box\n\
    [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x191\n\
    [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
    [1201]\nParameterName=Server\nObjectType=9\nSubNumber=3\n\
    [1201sub0]\nParameterName=n\nDataType=5\nAccessType=const\nDefaultValue=2\n\
    [1201sub1]\nParameterName=Request\nDataType=7\nAccessType=rw\nDefaultValue=0x680\n\
    [1201sub2]\nParameterName=Reply\nDataType=7\nAccessType=rw\nDefaultValue=0x690\n";

/// CiA 301, 7.5.2.33: the second server is that of 1201h, here 680h and 690h.
#[test]
fn a_node_is_asked_by_the_server_that_is_named() {
    let folder = scratch("servers");
    let file = folder.write("box.eds", SHEET);
    let box_at_4 = format!("{file}@4");
    let model = format!("4={file}");
    let bench = VirtualBus::of(&[box_at_4.as_str()]).with(&["--model", &model, "-v"]);
    let read = |more: &[&str]| bench.run(&[&["read", "4", "1000"], more].concat());
    let by_default = read(&[]);
    assert!(by_default.err.contains("604#4000100000000000") && !by_default.err.contains("680#"), "{}", by_default.err);
    let by_second = read(&["--sdo-server", "4=2"]);
    assert_eq!(by_second.out, by_default.out, "{}", by_second.err);
    assert!(
        by_second.err.contains("680#4000100000000000") && by_second.err.contains("690#43001000"),
        "{}",
        by_second.err
    );
    assert!(!by_second.err.contains("604#40001000"), "{}", by_second.err);
    let missing = read(&["--sdo-server", "4=3"]);
    assert!(missing.status != Some(0) && missing.err.contains("1202h:01"), "{}", missing.err);
    let wrong = read(&["--sdo-server", "4=129"]);
    assert!(wrong.status == Some(2) && wrong.err.contains("1 to 128"), "{}", wrong.err);

    let machine = folder.write("machine.toml", "[[drive]]\nmodel = \"box.eds\"\nnode = 4\nsdo_server = 2\n");
    let bench = VirtualBus::of(&[box_at_4.as_str()]).with(&["--machine", &machine, "-v"]);
    let by_file = bench.run(&["read", "4", "1000"]);
    assert!(by_file.err.contains("680#4000100000000000"), "{}{}", by_file.out, by_file.err);
    let overruled = bench.run(&["read", "4", "1000", "--sdo-server", "4=1"]);
    assert!(!overruled.err.contains("680#"), "{}", overruled.err);
}

/// CiA 301, 7.2.5.1: from 1 to the value of 1019h.
#[test]
fn sync_has_the_counter_of_the_machine_file() {
    let folder = scratch("sync-counter");
    let file = folder.write("box.eds", SHEET);
    let machine = folder.write("machine.toml", "sync_counter = 2\n[[drive]]\nmodel = \"box.eds\"\nnode = 4\n");
    let bench = VirtualBus::of(&[&format!("{file}@4")]).with(&["--machine", &machine, "-v"]);
    let counters = |words: &[&str]| -> Vec<String> {
        let ended = bench.run(words);
        let frames = ended.err.split_whitespace().filter(|word| word.starts_with("080#"));
        frames.map(str::to_owned).collect()
    };
    assert_eq!(counters(&["sync", "--every", "10ms", "--count", "3"]), ["080#01", "080#02", "080#01"]);
    let overruled = counters(&["sync", "--every", "10ms", "--count", "4", "--sync-counter", "3"]);
    assert_eq!(overruled, ["080#01", "080#02", "080#03", "080#01"]);
}
