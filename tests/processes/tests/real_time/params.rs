//! `ferrodrive params` over buses of its own and served ones: files of every form, refusals before and during the writes, a
//! kill in between, and the way back.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use processes::{Ended, Scratch, Simulator, command, done, ferrodrive, scratch, wait_until};

struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Self {
        Self(scratch(name))
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("UTF-8").to_owned()
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a file");
        path
    }

    /// Values for node 4, a ZLAC8030L.
    fn values(&self, name: &str, values: &str) -> String {
        self.write(name, &format!("[values]\n{values}"))
    }
}

#[test]
fn a_backup_in_any_form_is_what_the_node_has() {
    let folder = Folder::new("params_backup");
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
    // One without an extension that says what it is, before anybody is asked.
    let ended = ferrodrive(&["params", "backup", "4", "-o", &folder.path("wheel.txt")]);
    assert!(ended.status == Some(2) && ended.err.contains(".toml"), "{}", ended.err);
}

#[test]
fn what_is_written_is_read_back_stored_and_there_after_a_start() {
    let folder = Folder::new("params_apply");
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
    let folder = Folder::new("params_refused");
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
    let folder = Folder::new("params_commands");
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

struct Served {
    simulator: Simulator,
    bus: String,
    folder: Folder,
}

impl Served {
    fn new(name: &str, options: &[&str]) -> Self {
        let simulator = Simulator::start(&[options, &["--serve", "socketcand://127.0.0.1:0"]].concat());
        let bus = simulator.bus("socketcand");
        let served = Self { simulator, bus, folder: Folder::new(name) };
        wait_until("the drive boots", || served.run(&["read", served.node(), "1000"]).status == Some(0));
        served
    }

    fn zlac8030l(name: &str) -> Self {
        Self::new(name, &["--drive", "zlac8030l@4"])
    }

    fn node(&self) -> &'static str {
        "4"
    }

    fn command(&self, arguments: &[&str]) -> std::process::Command {
        let mut command = command(&[&["--bus", &self.bus, "--timeout", "10s"], arguments].concat());
        // Where journals are kept.
        command.current_dir(&self.folder.0).stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Ended {
        let output = self.command(arguments).output().expect("the binary runs");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Ended { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    #[track_caller]
    fn done(&self, arguments: &[&str]) -> Ended {
        let ended = self.run(arguments);
        assert_eq!(ended.status, Some(0), "{arguments:?}: {}{}", ended.out, ended.err);
        ended
    }

    fn journal(&self) -> PathBuf {
        self.folder.0.join("ferrodrive-node4.journal")
    }
}

#[test]
fn a_refusal_at_the_third_value_puts_the_first_two_back() {
    let served = Served::zlac8030l("params_rollback");
    served.done(&["params", "backup", "4", "-o", "before.toml"]);
    // 6060h may be mapped into an RPDO, 1017h into nothing: only the drive knows by its refusal.
    let wanted = "1017 = 200\nprofile_acceleration = 150\n\"1A00:00\" = 1\n\"1A00:01\" = 0x10170010\n";
    let file = served.folder.values("wanted.toml", wanted);
    let ended = served.run(&["params", "apply", "4", &file, "--json"]);
    let failure = ended.json();
    assert_eq!((ended.status, failure["error"]["kind"].as_str()), (Some(1), Some("rolled_back")), "{failure}");
    assert_eq!(failure["error"]["abort"], 0x0604_0041);
    assert!(failure["error"]["object"].as_str().is_some_and(|object| object.starts_with("1A00h")), "{failure}");
    assert!(failure["error"]["message"].as_str().is_some_and(|text| text.contains("read as before")), "{failure}");
    served.done(&["params", "verify", "4", "before.toml"]);
    assert!(!served.journal().exists(), "nothing is left to go back to");
}

#[test]
fn a_drive_at_work_is_left_alone_and_the_way_out_is_said() {
    let served = Served::zlac8030l("params_at_work");
    let file = served.folder.values("wanted.toml", "1017 = 200\n");
    served.done(&["enable", "4"]);
    let ended = served.run(&["params", "apply", "4", &file]);
    assert!(ended.status == Some(1) && ended.err.contains("Operation enabled"), "{}", ended.err);
    assert!(ended.err.contains("ferrodrive disable 4"), "{}", ended.err);
    served.done(&["disable", "4"]);
    served.done(&["params", "apply", "4", &file]);
    served.done(&["params", "verify", "4", &file]);
}

#[test]
fn a_power_cycle_proves_what_was_stored() {
    let mut served = Served::zlac8030l("params_prove");
    let file = served.folder.values("wanted.toml", "1017 = 200\n");
    let ended = served.run(&["params", "apply", "4", &file, "--save"]);
    assert!(ended.status == Some(1) && ended.err.contains("--model 4=zlac8030l"), "{}", ended.err);
    assert!(ended.err.contains("Nothing was sent"), "before the first write: {}", ended.err);
    let child = served
        .command(&["--model", "4=zlac8030l", "params", "apply", "4", &file, "--save", "--prove", "--within", "60s"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    // Power fails repeatedly until the command has waited for it: only the command knows when that is.
    let mut child = child;
    wait_until("it has waited for a boot-up", || {
        // Between two failures of the supply: longer than a boot.
        served.simulator.pass(Duration::from_secs(3));
        served.simulator.ask("4 power cycle");
        child.try_wait().expect("a child").is_some()
    });
    let output = child.wait_with_output().expect("it has ended");
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    // A cut during the writes is reported as such, and is not a proof.
    assert!(
        said.contains("after a power cycle all stored values read as written") || !output.status.success(),
        "{said}"
    );
    assert!(said.contains("power cycle") || said.contains("did not answer"), "{said}");
}

/// Far more writes than fit into the time until a look at the folder: at 10 kbit/s each takes 50 ms and more.
fn many_values(begin: i64) -> String {
    let ramps =
        (0x6081..=0x6085).filter(|index| *index != 0x6082).map(|index| format!("{index:X} = {}\n", begin + index));
    let windows =
        [0x6065, 0x6066, 0x6067, 0x6068, 0x606D, 0x606E, 0x606F, 0x6070].map(|index| format!("{index:X} = {begin}\n"));
    let communication = [0x1006, 0x1015, 0x1017, 0x100C].map(|index| format!("{index:X} = {begin}\n"));
    ramps.chain(windows).chain(communication).collect()
}

/// Waits for a journal that is whole: before its last line nothing is written to the node.
fn wait_for(path: &Path, child: &mut Child) {
    while !std::fs::read_to_string(path).is_ok_and(|text| text.contains("whole = true")) {
        if let Some(status) = child.try_wait().expect("a child") {
            panic!("it has ended: {status}");
        }
        // Looked at again and again.
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[cfg(unix)]
#[test]
fn after_a_kill_between_two_writes_the_journal_leads_back() {
    let served = Served::new("params_killed", &["--drive", "cia402@4", "--bitrate", "10k"]);
    let model = ["--model", "4=cia402"];
    let run = |arguments: &[&str]| served.run(&[&model[..], arguments].concat());
    let before = served.folder.values("before.toml", &many_values(50));
    assert_eq!(run(&["params", "apply", "4", &before]).status, Some(0));
    let wanted = served.folder.values("wanted.toml", &many_values(60));
    let arguments = [&model[..], &["params", "apply", "4", &wanted]].concat();
    let mut child = served.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it runs");
    wait_for(&served.journal(), &mut child);
    child.kill().expect("it was running");
    child.wait().expect("it has ended");
    // The answer to its last request is still on its way, and would be one to the wrong question.
    std::thread::sleep(Duration::from_secs(1));
    assert!(served.journal().exists(), "it was killed while it wrote");
    // No other one begins over it.
    let ended = run(&["params", "apply", "4", &wanted]);
    assert!(ended.status == Some(1) && ended.err.contains("params rollback 4"), "{}{}", ended.out, ended.err);
    let back = run(&["params", "rollback", "4"]);
    assert!(back.status == Some(0) && back.out.contains("read as before"), "{}{}", back.out, back.err);
    let verified = run(&["params", "verify", "4", &before]);
    assert_eq!(verified.status, Some(0), "{}{}", verified.out, verified.err);
    let again = run(&["params", "rollback", "4"]);
    assert!(again.status == Some(1) && again.err.contains("there is no journal"), "{}", again.err);
}

#[test]
fn a_journal_of_another_device_or_half_a_one_is_refused() {
    let served = Served::zlac8030l("params_journal");
    let journal = "node = 4\nvendor_id = 0x100\nproduct_code = 0xABC\nundo = [\n  [\"1017:00\", \"0000\"],\n]\n";
    served.folder.write("ferrodrive-node4.journal", journal);
    let ended = served.run(&["params", "rollback", "4"]);
    assert!(ended.status == Some(1) && ended.err.contains("not written to its end"), "{}", ended.err);
    served.folder.write("ferrodrive-node4.journal", &format!("{journal}whole = true\n"));
    let ended = served.run(&["params", "rollback", "4"]);
    assert!(ended.status == Some(1) && ended.err.contains("product ABCh"), "{}", ended.err);
    let ended = served.run(&["params", "rollback", "5", "ferrodrive-node4.journal"]);
    assert!(ended.status == Some(1) && ended.err.contains("belongs to node 4"), "{}", ended.err);
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

#[test]
fn a_pdo_that_was_set_up_comes_and_before_it_was_said_why_not() {
    let served = Served::zlac8030l("params_pdo");
    let shown = |part: &str| {
        let ended = served.done(&["pdo", "show", "4"]);
        assert!(ended.out.contains(part), "{part}: {}", ended.out);
    };
    shown("node 4 TPDO1, TPDO2, TPDO3, TPDO4, RPDO2, RPDO3, RPDO4: nothing is mapped into it");
    shown("node 4 RPDO1: no node was heard sending it");
    served.done(&["pdo", "apply", "4", "tpdo1=statusword,position_actual_value", "tpdo2=off", "--type", "1"]);
    shown("TPDO2: off: bit 31 of its COB-ID is set");
    shown("TPDO1: it waits for SYNC, and none was heard");
    served.done(&["nmt", "4", "start"]);
    let mut sync = served.command(&["sync", "--every", "20ms"]).stdout(Stdio::null()).spawn().expect("it runs");
    wait_until("SYNC is heard, and nothing keeps the PDO away", || {
        let shown = served.done(&["pdo", "show", "4", "--json"]).json();
        let tpdo = &shown["nodes"][0]["pdos"][0];
        tpdo["pdo"] == "TPDO1" && tpdo["silent"] == serde_json::json!([])
    });
    sync.kill().expect("it was running");
    sync.wait().expect("it has ended");
}
