//! What a shell is told that a line may go on with, by a real bash where there is one; and what commands at a terminal remember.
#![cfg(unix)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

mod common;

use std::path::Path;
use std::process::Command;

use common::{Simulator, done, scratch};

/// What bash offers for the last of these words, with this cache.
fn offered(cache: &Path, words: &[&str]) -> Vec<String> {
    let script = done(&["completions", "bash"]).out;
    let program = Path::new(env!("CARGO_BIN_EXE_ferrodrive"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let ask = r#"
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_TYPE=9
        _clap_complete_ferrodrive ferrodrive "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
        printf '%s\n' "${COMPREPLY[@]}""#;
    let mut bash = Command::new("bash");
    bash.args(["--norc", "--noprofile", "-c", &format!("{script}\n{ask}"), "bash", "ferrodrive"]).args(words);
    bash.env("PATH", path).env("XDG_CACHE_HOME", cache).env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE");
    let ended = bash.output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    String::from_utf8(ended.stdout).unwrap().lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

#[test]
fn bash_completes_nodes_objects_models_and_modes() {
    if !is_there("bash") {
        return eprintln!("skipped: there is no bash here");
    }
    let cache = scratch("completion");
    std::fs::create_dir_all(cache.join("ferrodrive")).unwrap();
    let remembered = r#"{"buses":[{"name":"can7","nodes":{"9":null,"12":"zlim42c"}}],"said":[]}"#;
    std::fs::write(cache.join("ferrodrive/remembered.json"), remembered).unwrap();
    let of = |words: &[&str]| offered(&cache, words);
    assert!(of(&["vel"]).contains(&"velocity".to_owned()));
    // The drives of the embedded bus, and of a bus that was used before.
    assert_eq!(
        of(&["read", ""]).into_iter().filter(|word| word.parse::<u8>().is_ok()).collect::<Vec<_>>(),
        ["1", "2", "4"]
    );
    let heard = of(&["--bus", "can7", "state", ""]);
    assert!(["9", "12"].iter().all(|node| heard.iter().any(|word| word == node)), "{heard:?}");
    assert!(of(&["--bus", "can"]).contains(&"can7".to_owned()));
    // Objects by name and by index, of the node's model: 2008h:00 is a joint's, 2014h a ZL drive's.
    assert_eq!(of(&["read", "4", "position_act"]), ["position_actual_value"]);
    assert!(of(&["read", "4", "201"]).contains(&"2014".to_owned()));
    assert!(!of(&["read", "1", "201"]).contains(&"2014".to_owned()));
    assert!(of(&["--bus", "can7", "--model", "9=zlac8030l", "watch", "9", "201"]).contains(&"2014".to_owned()));
    assert_eq!(of(&["objects", "zla"]), ["zlac8030l"]);
    assert!(of(&["sim", "--drive", "m42"]).len() >= 2);
    assert_eq!(of(&["plan", "machine.toml", "--mode", "cs"]), ["csp", "csv", "cst"]);
    // What makes no sense is completed by nothing, and is no error.
    assert!(of(&["read", "4", "no_such_obj"]).is_empty());
}

/// `script` (util-linux) gives a command a terminal; without it this is not tried.
#[test]
fn at_a_terminal_a_guess_is_said_once_and_the_nodes_are_remembered() {
    if !is_there("script") {
        return eprintln!("skipped: there is no `script` here, which gives a command a terminal");
    }
    let cache = scratch("remembered");
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let line = format!("{} --bus {bus} read 4 2014", env!("CARGO_BIN_EXE_ferrodrive"));
    let read = || {
        let mut script = Command::new("script");
        script.args(["-q", "-e", "-c", &line, "/dev/null"]).env("XDG_CACHE_HOME", &cache);
        let ended = script.stdin(std::process::Stdio::null()).output().unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stdout));
        String::from_utf8(ended.stdout).unwrap()
    };
    let first = read();
    assert!(first.contains("cannot tell its model") && first.contains("--model 4="), "{first}");
    let second = read();
    assert!(!second.contains("cannot tell its model") && second.contains("2014h"), "{second}");
    let kept = std::fs::read_to_string(cache.join("ferrodrive/remembered.json")).unwrap();
    assert!(kept.contains(&bus) && kept.contains("\"4\""), "{kept}");
    // Where nobody looks, each call says it, and nothing is kept.
    let elsewhere = scratch("not-remembered");
    for _ in 0..2 {
        let mut quiet = Command::new(env!("CARGO_BIN_EXE_ferrodrive"));
        let ended =
            quiet.args(["--bus", &bus, "read", "4", "2014"]).env("XDG_CACHE_HOME", &elsewhere).output().unwrap();
        assert!(String::from_utf8(ended.stderr).unwrap().contains("cannot tell its model"));
    }
    assert!(!elsewhere.join("ferrodrive").exists());
}
