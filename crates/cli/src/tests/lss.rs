//! `ferrodrive lss` on devices of which one begins without a node-ID, and on drives that have no LSS.

use processes::Ended;
use serde_json::{Value, json};

use super::virtual_bus::VirtualBus;

/// 1018h of the standard's servo, in hexadecimal: no vendor, product 402, revision 1.0, serial number 1.
const ADDRESS: &str = "0:192:10000:1";

fn refused(bench: &VirtualBus, words: &[&str]) -> Ended {
    let ended = bench.run(&[&["--json"], words].concat());
    assert_ne!(ended.status, Some(0), "{words:?}: {}", ended.out);
    ended
}

#[test]
fn a_device_without_a_node_id_is_found_and_becomes_a_node() {
    let bus = VirtualBus::of(&["cia402@4,node-id=none", "zlac8030l@5"]);
    // No device is node 4: the device sends nothing and answers no SDO.
    assert_eq!(refused(&bus, &["nmt", "4", "start", "--wait", "1s"]).status, Some(1));
    let found = &bus.json(&["lss", "--within", "1s", "scan"])["devices"];
    assert_eq!(found.as_array().map(Vec::len), Some(1), "{found}");
    assert_eq!((&found[0]["address"], &found[0]["node_id"]), (&json!(ADDRESS), &Value::Null));
    assert_eq!((&found[0]["product_code"], &found[0]["revision_number"]), (&json!(402), &json!(65536)));

    let set = bus.json(&["lss", "--within", "5s", "set", ADDRESS, "--node-id", "9", "--store"]);
    assert_eq!((&set["done"], &set["pending"]), (&json!(["node-ID 9", "stored"]), &Value::Null));
    assert_eq!(bus.json(&["read", "9", "1018:02"])["value"], json!(402));
    let inquired = &bus.json(&["lss", "--within", "5s", "inquire", "only"])["devices"];
    assert_eq!((&inquired[0]["address"], &inquired[0]["node_id"]), (&json!(ADDRESS), &json!(9)));
    // It has a node-ID now, and the ZLAC8030L has no LSS.
    let absent = refused(&bus, &["lss", "scan"]).out;
    assert!(
        absent.contains("no device without a node-ID") && absent.contains("according to their manuals, zlac8030l"),
        "{absent}"
    );
}

#[test]
fn a_new_node_id_waits_for_reset_communication_and_what_is_not_stored_is_forgotten() {
    let bus = VirtualBus::of(&["cia402@4"]);
    let set = bus.json(&["lss", "--within", "5s", "set", ADDRESS, "--node-id", "10"]);
    // NMT reset communication is 82h (CiA 301, 7.2.8.2.1).
    assert!(set["pending"].as_str().unwrap().contains("send 000#8204"), "{set}");
    assert_eq!(bus.json(&["read", "4", "1018:02"])["value"], json!(402));
    bus.json(&["send", "000#8204"]);
    assert_eq!(bus.json(&["read", "10", "1018:02"])["value"], json!(402));
    // COB-IDs follow the node-ID (CiA 301, 7.5.2.15: 80h + node-ID).
    assert_eq!(bus.json(&["read", "10", "1014"])["value"], json!(0x8A));
    // CiA 305: a reset of the application begins with what is stored, here nothing.
    bus.json(&["send", "000#810A"]);
    assert_eq!(bus.json(&["read", "4", "1018:02"])["value"], json!(402));
    let set = bus.json(&["lss", "--within", "5s", "set", "only", "--node-id", "11", "--reset"]);
    assert_eq!(set["pending"], Value::Null);
    assert_eq!(bus.json(&["read", "11", "1018:02"])["value"], json!(402));
}

#[test]
fn what_is_no_node_id_or_bit_rate_is_refused_and_a_stranger_is_not_configured() {
    let bus = VirtualBus::of(&["cia402@4"]);
    let stranger = refused(&bus, &["lss", "set", "0:192:10000:2", "--node-id", "9"]);
    assert!(stranger.out.contains("0:192:10000:2 does not answer LSS"), "{}", stranger.out);
    assert_eq!(bus.json(&["read", "4", "1018:04"])["value"], json!(1));
    // 100 kbit/s is not in CiA 305, table 1.
    for wrong in [&["--node-id", "128"], &["--node-id", "0"], &["--bitrate", "100k"]] {
        let refused = refused(&bus, &[&["lss", "set", ADDRESS][..], wrong].concat());
        assert_eq!(refused.status, Some(2), "{wrong:?}");
    }
    assert_eq!(refused(&bus, &["lss", "set", ADDRESS]).status, Some(2));
    let rate = bus.json(&["lss", "--within", "5s", "set", ADDRESS, "--bitrate", "500k"]);
    assert_eq!(rate["done"], json!(["500 kbit/s"]));
}

#[test]
fn a_device_is_found_by_its_make_and_a_listener_reads_it_in_words() {
    let bus = VirtualBus::of(&["cia402@4,1018:04=0xDEADBEEF"]);
    let found = &bus.json(&["lss", "--within", "2s", "identify", "0:192:10000"])["devices"];
    assert_eq!((found.as_array().map(Vec::len), &found[0]["node_id"]), (Some(1), &json!(4)), "{found}");
    assert_eq!(found[0]["address"], json!("0:192:10000:DEADBEEF"));
    assert_eq!(bus.json(&["read", "4", "1018:04"])["value"], json!(0xDEAD_BEEF_u32));
    let absent = refused(&bus, &["lss", "identify", "0:193"]);
    assert!(absent.out.contains("a device 0:193 does not answer LSS"), "{}", absent.out);
    let reported = bus.run(&["-v", "lss", "--within", "5s", "inquire", "only"]).err;
    for words in
        ["LSS switch state global: configuration", "LSS inquire serial number", "LSS reply: serial number DEADBEEFh"]
    {
        assert!(reported.contains(words), "{words}: {reported}");
    }
}

#[test]
fn only_is_refused_where_more_than_one_device_answers() {
    let bus = VirtualBus::of(&["cia402@4,1018:04=7", "cia402@5,1018:04=9"]);
    for words in
        [&["lss", "inquire", "only"][..], &["lss", "set", "only", "--node-id", "9"], &["lss", "set", "only", "--store"]]
    {
        let several = refused(&bus, words);
        assert_eq!(several.status, Some(1), "{words:?}");
        assert!(several.out.contains("more than one device answers"), "{words:?}: {}", several.out);
    }
    // A reset would have shown a node-ID that was set in spite of it.
    bus.json(&["nmt", "all", "reset-communication"]);
    for node in ["4", "5"] {
        assert_eq!(bus.json(&["read", node, "1018:02"])["value"], json!(402));
    }
}

#[test]
fn a_node_id_that_is_in_use_is_refused_before_anything_is_set() {
    let bus = VirtualBus::of(&["cia402@4,1018:04=7", "cia402@5,1018:04=9"]);
    let in_use = refused(&bus, &["lss", "set", "0:192:10000:7", "--node-id", "5", "--reset"]);
    assert!(in_use.status == Some(1) && in_use.out.contains("node-ID 5 is in use"), "{}", in_use.out);
    assert_eq!(bus.json(&["read", "4", "1018:04"])["value"], json!(7));
    // Its own it may keep.
    let own = bus.json(&["lss", "set", "0:192:10000:7", "--node-id", "4"]);
    assert_eq!(own["done"], json!(["node-ID 4"]));
}
