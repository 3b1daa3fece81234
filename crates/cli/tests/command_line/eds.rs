//! Data sheets on the command line: written, checked, shown, compared; and a device's values as a DCF.

use processes::{done, ferrodrive, scratch};

fn file(folder: &std::path::Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path.to_str().expect("a name of letters").to_owned()
}

const SMALL: &str = "[FileInfo]\nFileName=a.eds\n[MandatoryObjects]\nSupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018\n\
    [1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x20192\n\
    [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n\
    [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=1\n[1018sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\nDefaultValue=0\n";

#[test]
fn a_models_sheet_is_written_and_has_nothing_wrong_with_it() {
    let folder = scratch("eds-written");
    let sheet = done(&["eds", "zlim42c"]).out;
    assert!(sheet.contains("[1014]\nParameterName=COB-ID EMCY\n") && sheet.ends_with('\n'));
    assert!(sheet.contains("DefaultValue=$NODEID+0x80\n"));
    let path = file(&folder, "zlim42c.eds", &sheet);
    let report = done(&["eds", "lint", "--json", &path]).json();
    assert_eq!(report["files"][0]["errors"], 0);
    assert_eq!(done(&["eds", "diff", &path, "zlim42c"]).out, format!("{path} and zlim42c do not differ\n"));
}

#[test]
fn files_that_are_wrong_are_not_compared_in_silence_and_one_that_is_unread_has_no_lines_to_correct() {
    let folder = scratch("eds-wrong");
    // 7 is VAR; a type 77h there is not (EDS208).
    let sheet = done(&["eds", "zlim42c"]).out.replacen("ObjectType=0x7\n", "ObjectType=0x77\n", 1);
    let (wrong, empty) = (file(&folder, "wrong.eds", sheet), file(&folder, "empty.eds", ""));
    let compared = done(&["eds", "diff", &wrong, "zlim42c"]).out;
    assert!(compared.contains(&format!("note: {wrong} has 1 error")), "{compared}");
    let linted = ferrodrive(&["eds", "lint", &empty]).err;
    assert!(linted.contains("beside the file's name") && !linted.contains("correct the lines"), "{linted}");
}

#[test]
fn lint_lists_the_rules_explains_one_and_names_it_in_its_findings() {
    let rules = done(&["eds", "lint", "--list", "--json"]).json()["rules"].clone();
    assert_eq!(rules.as_array().unwrap().len(), eds::Rule::ALL.len());
    let folder = scratch("eds-rules");
    let path = file(&folder, "a.eds", SMALL.replace("DataType=5\nAccessType=ro\n[1018]", "AccessType=ro\n[1018]"));
    let report = ferrodrive(&["eds", "lint", "--json", &path]).json();
    let found: Vec<_> = report["files"][0]["findings"].as_array().unwrap().iter().map(|found| &found["rule"]).collect();
    assert_eq!(found, ["EDS301"], "{report}");
    let explained = done(&["eds", "lint", "--explain", "eds301", "--json"]).json()["rules"].clone();
    assert_eq!(explained.as_array().unwrap().len(), 1);
    assert!(rules.as_array().unwrap().contains(&explained[0]));
    let text = done(&["eds", "lint", "--explain", "301"]).out;
    assert!(text.starts_with("EDS301 (error): ") && text.contains(explained[0]["why"].as_str().unwrap()), "{text}");
    let unknown = ferrodrive(&["eds", "lint", "--explain", "EDS999"]);
    assert!(unknown.err.contains("eds lint --list"), "{}", unknown.err);
}

#[test]
fn a_sheet_is_for_one_node_with_choices_and_for_ros2_canopen() {
    let of_node = done(&["eds", "zlac8030l", "defaults=eds", "6060=3", "--node", "4"]).out;
    assert!(of_node.contains("DefaultValue=0x84\n") && !of_node.contains("$NODEID"));
    let object = |text: &str, section: &str| {
        text.split(&format!("[{section}]\n"))
            .nth(1)
            .map(|rest| rest.split("\n\n").next().unwrap_or_default().to_owned())
    };
    assert!(object(&of_node, "2014").is_some_and(|lines| lines.contains("DefaultValue=300")));
    assert!(object(&of_node, "6060").is_some_and(|lines| lines.contains("DefaultValue=3")));
    let variant = done(&["eds", "zlac8030l", "--variant", "ros2_canopen"]).out;
    assert!(object(&variant, "6502").is_some_and(|lines| lines.contains("DefaultValue=13")));
    let report = done(&["eds", "zlac8030l", "--json"]).json();
    assert_eq!((report["model"].as_str(), report["file_name"].as_str()), (Some("zlac8030l"), Some("zlac8030l.eds")));
}

#[test]
fn a_file_is_called_as_the_user_calls_it_and_not_as_it_calls_itself() {
    let folder = scratch("eds-called");
    let path = file(&folder, "wheel.eds", SMALL);
    let objects = done(&["objects", &path]).out;
    assert!(objects.contains(&format!("object dictionary of \"the file {path}\"")), "{objects}");
}

#[test]
fn what_makes_no_sheet_is_a_usage_error() {
    for (words, why) in [
        (&["eds", "zlac8030"][..], "did you mean zlac8030l?"),
        (&["eds", "zlac8030l", "colour=red"], "takes no 'colour'"),
        (&["eds", "zlac8030l", "fast"], "KEY=VALUE"),
        (&["eds", "zlac8030l", "2014=99999"], "2014h:00 of a zlac8030l cannot be 99999"),
        (&["eds", "--bus", "can0", "zlac8030l"], "--bus has no effect on eds"),
        (&["eds", "diff", "zlac8030l", "nothing"], "there is no file nothing"),
    ] {
        let ended = ferrodrive(words);
        assert_eq!(ended.status, Some(2), "{words:?}: {}{}", ended.out, ended.err);
        assert!(ended.err.contains(why), "{words:?}: {}", ended.err);
    }
}

#[test]
fn lint_fails_for_errors_and_with_strict_for_warnings_too() {
    let folder = scratch("eds-lint");
    let clean = file(&folder, "clean.eds", SMALL);
    let warned = file(&folder, "warned.eds", SMALL.replace("SupportedObjects=3", "SupportedObjects=0x3"));
    let wrong = file(&folder, "wrong.eds", SMALL.replace("DataType=5", "DataType=0x99"));
    let refused = file(&folder, "refused.eds", "no sections");
    assert_eq!(ferrodrive(&["eds", "lint", &clean, &warned]).status, Some(0));
    assert_eq!(ferrodrive(&["eds", "lint", "--strict", &clean]).status, Some(0));
    let ended = ferrodrive(&["eds", "lint", "--strict", &warned]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.out.contains("a count is decimal"), "{}", ended.out);
    assert!(ended.err.contains("1 of 1 file with errors or warnings"), "{}", ended.err);
    let ended = ferrodrive(&["eds", "lint", &clean, &wrong, &refused, "/nowhere.eds"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("3 of 4 files with errors"), "{}", ended.err);
    assert!(
        ended.out.contains("type 0099h is not the data type of a value") && ended.out.contains("UNSIGNED32"),
        "{}",
        ended.out
    );
    assert!(ended.out.contains("the file has no sections"), "{}", ended.out);
    let ended = ferrodrive(&["eds", "lint", "--json", &wrong]);
    let finding = ended.json()["files"][0]["findings"][0].clone();
    assert_eq!(
        (ended.status, finding["line"].as_u64(), finding["severity"].as_str()),
        (Some(1), Some(15), Some("error"))
    );
    assert_eq!(ended.err, "", "programs have it in the report");
}

#[test]
fn show_finds_objects_by_index_and_word_and_says_the_device() {
    let folder = scratch("eds-show");
    let path = file(&folder, "small.eds", SMALL);
    let shown = done(&["eds", "show", &path, "1000"]).out;
    assert!(shown.contains("1000h:00  Device type  UNSIGNED32  ro      0x20192"), "{shown}");
    assert!(!shown.contains("1001h"));
    let report = done(&["eds", "show", "--json", "zlac8030l", "control", "word"]).json();
    assert_eq!(
        (report["vendor"].as_str(), report["objects"][0]["object"].as_str()),
        (Some("ZLTECH"), Some("6040h:00"))
    );
    let ended = ferrodrive(&["eds", "show", &path, "zebra"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("lists all 3"), "{}", ended.err);
}

#[test]
fn a_files_letters_do_not_steer_the_terminal() {
    let folder = scratch("eds-letters");
    let path = file(&folder, "escape.eds", SMALL.replace("Device type", "Device\u{1b}[31m"));
    let shown = done(&["eds", "show", &path]).out;
    assert!(!shown.contains('\u{1b}') && shown.contains("Device\\u{1b}[31m"), "{shown}");
}

#[test]
fn a_bomb_is_refused_at_its_line() {
    let folder = scratch("eds-bomb");
    let path = file(&folder, "bomb.eds", "[1]\n".repeat(1_000_000));
    let ended = ferrodrive(&["eds", "show", &path]);
    assert_eq!(ended.status, Some(1));
    assert!(
        ended.err.contains("line 40001 cannot be read as an EDS") && ended.err.contains("more than 40000 sections"),
        "{}",
        ended.err
    );
}

#[test]
fn a_devices_values_make_a_dcf_that_is_not_written_over_unasked() {
    let folder = scratch("eds-dcf");
    let path = folder.join("wheel.dcf").to_str().expect("a name of letters").to_owned();
    let report = done(&["dcf", "4", "--output", &path, "--name", "left", "--json"]).json();
    assert_eq!(
        (report["node"].as_u64(), report["values"].as_u64()),
        (Some(4), Some(116)),
        "its parameters, as `params backup` reads them"
    );
    assert!(report["read"].as_u64().is_some_and(|read| read > 100), "{report}");
    assert!(report["left_out"].as_array().is_some_and(|objects| objects.iter().any(|object| object == "6040h:00")));
    let written = std::fs::read_to_string(&path).expect("the file");
    assert!(written.contains("[DeviceComissioning]\nNodeID=4\nNodeName=left\nBaudrate=500\n"), "{written}");
    assert!(written.contains("FileName=wheel.dcf\n") && written.contains("LastEDS=zlac8030l.eds\n"));

    let backup = folder.join("backup").join("wheel.dcf");
    std::fs::create_dir(backup.parent().unwrap()).unwrap();
    done(&["params", "backup", "4", "-o", backup.to_str().unwrap()]);
    let backup = std::fs::read_to_string(backup).unwrap();
    assert_eq!(backup, written.replace("NodeName=left\n", "NodeName=\n"), "one file for one node");

    let ended = ferrodrive(&["dcf", "4", "--output", &path]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("already exists") && ended.err.contains("--force"), "{}", ended.err);
    let forced = done(&["dcf", "4", "--output", &path, "--force", "--all"]).out;
    assert!(forced.contains("152 objects read, 152 values in the file"), "{forced}");
    assert!(std::fs::read_to_string(&path).expect("the file").contains("ParameterValue="));
}

#[test]
fn values_that_differ_from_a_makers_sheet_are_in_the_dcf_and_what_the_device_refuses_is_reported() {
    let folder = scratch("eds-dcf_eds");
    let sheet = "; kept\n[FileInfo]\nFileName=v.eds\n\
        [2014]\nParameterName=Rated current\nDataType=6\nAccessType=rw\nDefaultValue=300\n\
        [2015]\nParameterName=Maximum current\nDataType=6\nAccessType=rw\nDefaultValue=300\n\
        [2FFF]\nParameterName=Not there\nDataType=6\nAccessType=rw\n\
        [6060]\nParameterName=Mode\nDataType=6\nAccessType=rw\n";
    let sheet_path = file(&folder, "v.eds", sheet);
    let ended = done(&["dcf", "4", "--eds", &sheet_path]);
    let expected = sheet.replace("DefaultValue=300\n[2015]", "DefaultValue=300\nParameterValue=150\n[2015]");
    let expected = expected.replace("FileName=v.eds\n", "FileName=node4.dcf\nLastEDS=v.eds\n");
    assert!(ended.out.starts_with(&expected), "{}", ended.out);
    assert!(ended.err.contains("2FFFh:00") && ended.err.contains("0602 0000h"), "{}", ended.err);
    assert!(
        ended.err.contains("6060h:00") && ended.err.contains("1 bytes, by the data sheet there are 2"),
        "{}",
        ended.err
    );
    let report = done(&["dcf", "4", "--eds", &sheet_path, "--json"]).json();
    assert_eq!((report["values"].as_u64(), report["refused"][0]["abort"].as_u64()), (Some(1), Some(0x0602_0000)));
    assert!(report["dcf"].as_str().is_some_and(|dcf| dcf.starts_with("; kept\n")));
}
