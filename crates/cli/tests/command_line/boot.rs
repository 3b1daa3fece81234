//! `boot` and what a manager's DCF says of it, on the embedded bus.

use processes::{ferrodrive, scratch};
use serde_json::Value;

/// A manager's DCF as its maker's tool writes it: one slave, node 4, which is mandatory.
fn manager(vendor: u32, configuration: &str) -> String {
    format!(
        "[FileInfo]\nFileName=master.dcf\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n\
         [DeviceInfo]\nVendorName=-\nProductName=manager\nVendorNumber=0\nProductNumber=0\n\
         [DeviceComissioning]\nNodeID=127\nBaudrate=500\nCANopenManager=1\n\
         [MandatoryObjects]\nSupportedObjects=0\n\
         [OptionalObjects]\nSupportedObjects=4\n1=0x1F22\n2=0x1F81\n3=0x1F84\n4=0x1F85\n\
         [1F22]\nParameterName=Concise DCF\nObjectType=8\nSubNumber=2\n\
         [1F22sub0]\nParameterName=Highest sub-index\nObjectType=7\nDataType=5\nAccessType=const\nDefaultValue=127\n\
         [1F22sub4]\nParameterName=Node 4\nObjectType=7\nDataType=15\nAccessType=rw\nDownloadFile={configuration}\n\
         {}{}{}",
        array(0x1F81, "Slave assignment", 0x0D),
        array(0x1F84, "Device type", 0x0004_0192),
        array(0x1F85, "Vendor", vendor),
    )
}

/// The letter of the standard's error status with which a node ended.
fn letter(report: &Value, node: u64) -> Option<String> {
    let nodes = report["nodes"].as_array().expect("nodes");
    let found = nodes.iter().find(|found| found["node"] == node).expect("the node");
    found["letter"].as_str().map(str::to_owned)
}

/// 127 entries of which the fourth has a value (CiA 306-1, CompactSubObj).
fn array(index: u16, name: &str, of_node_4: u32) -> String {
    format!(
        "[{index:X}]\nParameterName={name}\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=127\n\
         [{index:X}Value]\nNrOfEntries=1\n4=0x{of_node_4:X}\n"
    )
}

#[test]
fn the_dcf_of_a_manager_says_who_is_booted_and_as_what() {
    let folder = scratch("boot_manager");
    let path = folder.join("master.dcf");
    let file = path.to_str().expect("UTF-8");
    // Concise DCF: one entry, 1017h:00, two bytes, 200.
    std::fs::write(folder.join("wheel.bin"), [1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 200, 0]).expect("a stream");
    // What the ZLAC8030L answers (its manual has the identity of its maker in 1018h:01).
    let vendor = ferrodrive(&["read", "4", "1018:01", "--json"]).json()["value"].as_u64().expect("a vendor-ID");
    let vendor = u32::try_from(vendor).expect("32 bits");
    std::fs::write(&path, manager(vendor, "wheel.bin")).expect("a DCF");
    let ended = ferrodrive(&["boot", file, "--json"]);
    assert_eq!((ended.status, letter(&ended.json(), 4)), (Some(0), None), "{}{}", ended.out, ended.err);
    assert_eq!(ended.json()["nodes"].as_array().map(Vec::len), Some(1), "no other node is a slave: {}", ended.out);

    // CiA 302-2, 8.2: another vendor is D, and a mandatory slave that fails is a failure of the whole.
    std::fs::write(&path, manager(vendor + 1, "wheel.bin")).expect("a DCF");
    let ended = ferrodrive(&["boot", file, "--json"]);
    assert_eq!((ended.status, letter(&ended.json(), 4).as_deref()), (Some(1), Some("D")), "{}", ended.out);
    let text = ferrodrive(&["boot", file]).out;
    assert!(text.contains("1018h:01") && text.contains(&format!("{:X}", vendor + 1)), "{text}");

    // A configuration that is not there, and one that is cut short, before any node is asked.
    std::fs::write(&path, manager(vendor, "nowhere.bin")).expect("a DCF");
    let ended = ferrodrive(&["boot", file]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("nowhere.bin") && ended.err.contains("1F22h:04"), "{}", ended.err);
    std::fs::write(folder.join("wheel.bin"), [1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0]).expect("half a stream");
    std::fs::write(&path, manager(vendor, "wheel.bin")).expect("a DCF");
    let ended = ferrodrive(&["boot", file]);
    assert!(ended.status == Some(1) && ended.err.contains("node 4, is not whole"), "{}", ended.err);
}

/// The joint watches for heartbeats of node 127, which are not sent after a boot (M joint manual, 5.11); the ZLAC8030L stops after a
/// second of silence (2000h), and the ZLIM42-C watches nothing.
#[test]
fn a_watch_that_nothing_arms_is_not_passed() {
    let booted = ferrodrive(&["boot", "--json"]).json();
    let verdict = |node: u64| {
        let nodes = booted["nodes"].as_array().expect("nodes");
        let of_node = nodes.iter().find(|found| found["node"] == node).expect("the node");
        let steps = of_node["steps"].as_array().expect("steps");
        steps.iter().find(|step| step["step"] == "host watch").expect("the step")["verdict"].clone()
    };
    assert_eq!([1, 2, 4].map(verdict), ["noted", "noted", "passed"], "{booted}");
}

#[test]
fn a_machine_file_that_is_cut_short_is_refused_with_its_line_before_the_bus() {
    let folder = scratch("boot_half");
    let path = folder.join("machine.toml");
    std::fs::write(&path, "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n\n[[drive]]\nmodel = \"zlim")
        .expect("half a file");
    // No program listens there: the error is not about the bus.
    let ended = ferrodrive(&["--bus", "socketcand://127.0.0.1:1/can0", "boot", path.to_str().expect("UTF-8")]);
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    assert!(ended.err.contains("machine.toml:6:") && !ended.err.contains("socketcand"), "{}", ended.err);
}
