//! `ferrodrive params` on the embedded bus: files of every form, refusals before and during the writes.

use processes::{done, ferrodrive, scratch};

#[test]
fn a_backup_in_any_form_is_what_the_node_has() {
    let folder = scratch("params_backup");
    for extension in ["toml", "dcf", "bin"] {
        let file = folder.path(&format!("wheel.{extension}"));
        let report = done(&["params", "backup", "4", "-o", &file, "--json"]).json();
        assert!(report["values"].as_u64().is_some_and(|values| values > 100), "{report}");
        let verified = done(&["params", "verify", "4", &file, "--json"]).json();
        assert_eq!(verified["deviations"], serde_json::json!([]), "{extension}");
        assert_eq!(done(&["params", "plan", "4", &file, "--json"]).json()["steps"], serde_json::json!([]));
        // A file that is there is not written over unasked.
        let again = ferrodrive(&["params", "backup", "4", "-o", &file]);
        assert!(again.status == Some(1) && again.err.contains("already exists"), "{}", again.err);
    }
    // One without an extension that says what it is, before any node is asked.
    let ended = ferrodrive(&["params", "backup", "4", "-o", &folder.path("wheel.txt")]);
    assert!(ended.status == Some(2) && ended.err.contains(".toml"), "{}", ended.err);
}

#[test]
fn what_is_written_is_read_back_stored_and_there_after_a_start() {
    let folder = scratch("params_apply");
    let file = folder.values("wheel.toml", "1017 = 200\n\"1800:02\" = 1\nprofile_acceleration = 150\n");
    let ended = done(&["params", "apply", "4", &file, "--save", "--prove"]);
    assert!(ended.out.contains("stored in the drive's memory"), "{}", ended.out);
    assert!(ended.out.contains("after an NMT reset all stored values read as written"), "{}", ended.out);
    // The manual has no S at 6083h (RW, not RW/S).
    assert!(ended.out.contains("6083h:00 profile_acceleration is not kept"), "{}", ended.out);
    // Nothing of it is there on another bus, so that verify fails and says what differs.
    let ended = ferrodrive(&["params", "verify", "4", &file]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.out.contains("producer_heartbeat_time") && ended.err.contains("params apply 4"), "{}", ended.err);
}

#[test]
fn what_cannot_be_written_is_told_with_its_place_and_nothing_is_written() {
    let folder = scratch("params_refused");
    let refused = |file: &str| {
        let ended = ferrodrive(&["params", "apply", "4", file]);
        assert_eq!(ended.status, Some(1), "{}{}", ended.out, ended.err);
        ended.err
    };
    let said = refused(&folder.values("word.toml", "profile_acceleratoin = 1\n"));
    assert!(said.contains("did you mean profile_acceleration") && said.contains("word.toml:2:"), "{said}");
    let said = refused(&folder.values("limit.toml", "profile_acceleration = 99999999\n"));
    assert!(said.contains("6083h:00 profile_acceleration: 99999999 is not taken"), "{said}");
    // Half a file of each kind.
    let whole = folder.path("whole.dcf");
    done(&["params", "backup", "4", "-o", &whole]);
    let dcf = std::fs::read(&whole).expect("a DCF");
    std::fs::write(folder.path("half.dcf"), &dcf[..dcf.len() / 2]).expect("half of it");
    let said = refused(&folder.path("half.dcf"));
    assert!(said.contains("not whole") && said.contains("eds lint"), "{said}");
    let said = refused(&folder.values("half.toml", "profile_acceleration = \"1"));
    assert!(said.contains("half.toml:2:"), "{said}");
    std::fs::write(folder.path("half.bin"), [2, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 200, 0]).expect("half a stream");
    let said = refused(&folder.path("half.bin"));
    assert!(said.contains("entry 2 of 2, at byte 13"), "{said}");
    // Parameters of another model, by what both say of themselves.
    let joint = folder.path("joint.dcf");
    done(&["params", "backup", "1", "-o", &joint]);
    let ended = ferrodrive(&["params", "apply", "4", &joint]);
    assert!(
        ended.status == Some(1) && ended.err.contains("not the device that these parameters are for"),
        "{}",
        ended.err
    );
    assert_eq!(ended.err.matches("vendor").count(), 2, "{}", ended.err);
    // Drives with the same identity are distinguished by the model in the file.
    let stepper = folder.path("stepper.toml");
    done(&["params", "backup", "2", "-o", &stepper]);
    let said = refused(&stepper);
    assert!(said.contains("these are parameters of a zlim42c, and the node is a zlac8030l"), "{said}");
    let said = refused(&folder.path("nowhere.toml"));
    assert!(said.contains("nothing was written"), "{said}");
}

#[test]
fn commands_in_a_file_are_left_out_with_the_reason() {
    let folder = scratch("params_commands");
    let planned = |node: &str, name: &str, values: &str| {
        let file = folder.values(name, values);
        let report = done(&["params", "plan", node, &file, "--json"]).json();
        let objects = |key: &str| -> Vec<String> {
            let rows = report[key].as_array().expect("a list");
            rows.iter().map(|row| row["object"].as_str().expect("an object").to_owned()).collect()
        };
        (objects("steps"), objects("left"))
    };
    // Factory settings, a new zero, a fault reset, a motion: what a person may have copied out of a maker's list of objects.
    let wheel = "register_parameter_setting = 1\nclear_current_position = 1\n\"60FF\" = 100\n1017 = 200\n";
    assert_eq!(
        planned("4", "wheel.toml", wheel),
        (vec!["1017h:00".into()], ["2006h:00", "2009h:00", "60FFh:00"].map(String::from).into())
    );
    let stepper = "\"2010\" = 2\nfault_reset = 1\n1017 = 200\n";
    assert_eq!(
        planned("2", "stepper.toml", stepper),
        (vec!["1017h:00".into()], ["2010h:00", "2011h:00"].map(String::from).into())
    );
    let joint = "incremental_position = 1000\ndata_save_flag = 1\n1017 = 200\n";
    assert_eq!(
        planned("1", "joint.toml", joint),
        (vec!["1017h:00".into()], ["260Ch:00", "2614h:00"].map(String::from).into())
    );
    let ended = done(&["params", "apply", "4", &folder.path("wheel.toml")]);
    assert!(ended.out.contains("2009h:00 register_parameter_setting is left out: a command"), "{}", ended.out);
}

#[test]
fn pdos_in_words_are_planned_with_their_bits_and_the_load() {
    let asked = ["tpdo1=statusword,position_actual_value", "rpdo1=controlword,target_velocity", "--type", "1"];
    let plan = done(&[&["pdo", "plan", "4"][..], &asked, &["--json"]].concat()).json();
    let bits: Vec<_> = plan["pdos"].as_array().expect("a list").iter().map(|pdo| pdo["bits"].as_u64()).collect();
    assert_eq!(bits, [Some(48), Some(48)], "{plan}");
    let places: Vec<_> = plan["steps"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|step| step["object"].as_str().unwrap_or_default())
        .collect();
    // Off, empty, fill, count, type, on (CiA 301, 7.5.2.36 and 7.5.2.38).
    let (off, emptied) =
        (places.iter().position(|place| *place == "1800h:01"), places.iter().position(|place| *place == "1A00h:01"));
    assert!(off < emptied && places.last() == Some(&"1800h:01"), "{places:?}");
    // SYNC is 0 bytes and each PDO 6: 47 + 10 stuff bits and 95 + 19 + 3 with what is between, every 10 ms at 500 kbit/s.
    let load = |key: &str| plan[key].as_f64().expect("a number");
    assert!(load("load_after") > load("load_before") && (0.03..0.08).contains(&load("load_after")), "{plan}");
}

#[test]
fn what_a_pdo_cannot_carry_is_said_before_anything_is_written() {
    for (asked, said) in [
        (&["tpdo1=statusword,6064,606C"][..], "TPDO1 would have 80 bits"),
        (&["tpdo1=1017"], "1017h:00 producer_heartbeat_time cannot be in TPDO1"),
        (&["tpdo1=statuswort"], "did you mean statusword"),
        (&["tpdo9=statusword"], "has no TPDO9; it has TPDO1, TPDO2, TPDO3, TPDO4"),
        (&["rpdo1=statusword"], "cannot be in RPDO1: it can only be read"),
        // A dummy entry (CiA 301, 7.4.7.1), of which this drive takes none.
        (&["rpdo1=0005,controlword"], "a zlac8030l has no object 0005h:00"),
        (&["tpdo1=statusword", "--inhibit", "100s"], "is not taken for the inhibit time"),
        (&["tpdo1=statusword", "--id", "0x601"], "another service"),
        (&["tpdo1=statusword", "tpdo2=6064", "--id", "0x185"], "--id takes one PDO"),
        (&["tpdo1"], "expected a PDO and its objects"),
        (&["pdo1=statusword"], "is not a PDO; expected tpdo1"),
        (&[], "expected the PDOs to configure"),
    ] {
        let ended = ferrodrive(&[&["pdo", "apply", "4"], asked].concat());
        assert!(ended.status == Some(2) && ended.err.contains(said), "{asked:?}: {:?} {}", ended.status, ended.err);
    }
    let ended = ferrodrive(&["pdo", "apply", "1", "tpdo1=statusword"]);
    assert!(ended.err.contains("mapping of a m4230e17b50 is fixed"), "{}", ended.err);
}
