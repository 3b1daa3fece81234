//! A reader that goes away before a command has printed all (`ferrodrive objects zlac8030l | head -1`) is not an error, and
//! nothing is reported.

use std::io::Read;
use std::process::{Command, Stdio};

/// Every command that prints without a bus of its own to end it, and help.
const PRINTING: [&[&str]; 10] = [
    &["--help"],
    &["sim", "--help"],
    &["--version"],
    &["completions", "bash"],
    &["completions", "zsh"],
    &["objects", "zlac8030l"],
    &["--json", "objects", "zlac8030l"],
    &["--json", "scan"],
    &["dump"],
    &["--json", "dump"],
];

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    for arguments in PRINTING {
        let mut child = Command::new(processes::program())
            .args(arguments)
            .env_remove("FERRODRIVE_BUS")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert_eq!((child.wait().unwrap().code(), said.as_str()), (Some(0), ""), "{arguments:?}");
    }
}

/// The reader of an error text may have gone too: the status remains.
#[test]
fn nobody_to_read_an_error_leaves_its_status() {
    let lost = |arguments: &[&str]| {
        let mut child = Command::new(processes::program())
            .args(arguments)
            .env_remove("FERRODRIVE_BUS")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stderr.take());
        child.wait().unwrap().code()
    };
    assert_eq!(lost(&["read", "9", "6064"]), Some(1));
    assert_eq!(lost(&["read", "0", "6064"]), Some(2));
    assert_eq!(lost(&["--bus", "can7", "velocity", "4", "60rpm"]), Some(1));
}
