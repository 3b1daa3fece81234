//! What a shell gets as the continuations of a line, by a real bash where there is one; and what commands at a terminal remember.
#![cfg(unix)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use processes::{Simulator, done, scratch};

/// What bash offers for the last of these words, with this cache. The words are those of bash, which splits a line at `:` and `=`.
fn offered(cache: &Path, words: &[&str]) -> Vec<String> {
    let ask = r#"
        COMP_LINE=$1; shift; COMP_POINT=${#COMP_LINE}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_TYPE=9
        _ferrodrive ferrodrive "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
        printf '%s\n' "${COMPREPLY[@]}""#;
    let script = done(&["completions", "bash"]).out;
    let line = format!("ferrodrive {}", words.join(" "));
    let mut bash = with_the_program("bash", cache);
    bash.args(["--norc", "--noprofile", "-c", &format!("{script}\n{ask}"), "bash", &line, "ferrodrive"]).args(words);
    let ended = bash.output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    String::from_utf8(ended.stdout).unwrap().lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// A shell that finds `ferrodrive` and this cache, and no bus of ours.
fn with_the_program(shell: &str, cache: &Path) -> Command {
    let program = Path::new(processes::program());
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let mut shell = Command::new(shell);
    shell.env("PATH", path).env("XDG_CACHE_HOME", cache).env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE");
    shell
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
    let embedded: BTreeSet<String> = words::models::embedded().iter().map(|(node, _)| node.to_string()).collect();
    assert!(["1", "2", "4"].iter().all(|node| embedded.contains(*node)));
    let offered: BTreeSet<String> = of(&["read", ""]).into_iter().filter(|word| word.parse::<u8>().is_ok()).collect();
    assert_eq!(offered, embedded);
    let heard = of(&["--bus", "can7", "state", ""]);
    assert!(["9", "12"].iter().all(|node| heard.iter().any(|word| word == node)), "{heard:?}");
    assert!(of(&["--bus", "can"]).contains(&"can7".to_owned()));
    // Objects by name and by index, of the node's model: 2008h:00 is a joint's, 2014h a ZL drive's.
    assert_eq!(of(&["read", "4", "position_act"]), ["position_actual_value"]);
    assert!(of(&["read", "4", "201"]).contains(&"2014".to_owned()));
    assert!(!of(&["read", "1", "201"]).contains(&"2014".to_owned()));
    assert!(of(&["--bus", "can7", "--model", "9=zlac8030l", "watch", "9", "201"]).contains(&"2014".to_owned()));
    // The number of an option is not a node.
    assert!(of(&["watch", "--count", "1", "4", "201"]).contains(&"2014".to_owned()));
    assert_eq!(of(&["objects", "zla"]), ["zlac8030l"]);
    assert!(of(&["sim", "--drive", "m42"]).len() >= 2);
    assert_eq!(of(&["ini"]), ["init"]);
    assert_eq!(of(&["init", "--drive", "zla"]), ["zlac8030l"]);
    assert!(of(&["init", "--"]).iter().any(|word| word == "--output"));
    assert_eq!(of(&["plan", "machine.toml", "--mode", "cs"]), ["csp", "csv", "cst"]);
    // What makes no sense is completed by nothing, and is not an error.
    assert!(of(&["read", "4", "no_such_obj"]).is_empty());
}

/// The words that a line has in an interactive bash after a press of the Tab key at its end.
fn after_tab(cache: &Path, lines: &[&str]) -> Vec<String> {
    const PROMPT: &str = "[ready]";
    let file = cache.join("completion.bash");
    std::fs::write(&file, format!("{}\nstty cols 500\nPS1='{PROMPT}'\n", done(&["completions", "bash"]).out)).unwrap();
    // A line that does not fit is drawn anew, with its prompt.
    // With an end to it: a prompt that never comes is an error of this test, not a wait for ever.
    let mut script = with_the_program("timeout", cache);
    let bash = format!("bash --noprofile --rcfile {} -i", file.display());
    script.args(["60", "script", "-q", "-c", &bash, "/dev/null"]).env("TERM", "dumb");
    let mut script = script.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let (mut keys, mut screen) = (script.stdin.take().unwrap(), script.stdout.take().unwrap());
    // A prompt is waited for before anything is typed: keys that come earlier are not for the line editor.
    let mut until = |end: &str| {
        let mut shown = Vec::new();
        let mut byte = [0];
        while !shown.ends_with(end.as_bytes()) {
            assert_eq!(screen.read(&mut byte).unwrap(), 1, "{}", String::from_utf8_lossy(&shown));
            shown.push(byte[0]);
        }
        String::from_utf8_lossy(&shown).into_owned()
    };
    until(PROMPT);
    let mut typed = |text: &str| {
        keys.write_all(text.as_bytes()).unwrap();
        // The last printed word and the next prompt: the editor writes a prompt when it draws a line anew, too.
        until(&format!(">{PROMPT}"))
    };
    // Tab; Ctrl-A goes to the begin of the line, which is then one that prints its words.
    let words = lines.iter().map(|line| typed(&format!("{line}\t\x01printf '<%s>' \n"))).collect::<Vec<_>>();
    drop(keys);
    script.kill().unwrap();
    script.wait().unwrap();
    let of = |shown: String| shown.lines().rfind(|line| line.starts_with('<')).unwrap_or(&shown).replace(PROMPT, "");
    words.into_iter().map(of).collect()
}

/// Bash takes an address apart at its colons and an option at its `=`.
#[test]
fn an_interactive_bash_completes_behind_colons_and_equals_signs() {
    if !is_there("script") || !is_there("bash") {
        return eprintln!("skipped: there is no `script` or no `bash` here");
    }
    let cache = scratch("tab");
    let bus = "socketcand://127.0.0.1:29536/can0";
    let remembered = format!(r#"{{"buses":[{{"name":"{bus}","nodes":{{"93":"zlac8030l"}}}}],"said":[]}}"#);
    std::fs::create_dir_all(cache.join("ferrodrive")).unwrap();
    std::fs::write(cache.join("ferrodrive/remembered.json"), remembered).unwrap();
    let lines = [
        "ferrodrive --bus socketcand://127.0.0.1:29536/can0 --model 9=zlac8030l read 9 position_act",
        "ferrodrive --bus=socketcand://127.0.0.1:29536/can0 velo",
        "ferrodrive --bus socketcand://127.0.0.1:2",
        "ferrodrive --bus=socketcand:",
        "ferrodrive --bus socketcand://127.0.0.1:29536/can0 state 9",
        "ferrodrive --model 4=zlac",
        "ferrodrive --bus 'socketcand://127.0.0.1:29536/can0' read 93 position_act",
    ];
    let expected = [
        "<ferrodrive><--bus><socketcand://127.0.0.1:29536/can0><--model><9=zlac8030l><read><9><position_actual_value>",
        "<ferrodrive><--bus=socketcand://127.0.0.1:29536/can0><velocity>",
        "<ferrodrive><--bus><socketcand://127.0.0.1:29536/can0>",
        "<ferrodrive><--bus=socketcand://127.0.0.1:29536/can0>",
        "<ferrodrive><--bus><socketcand://127.0.0.1:29536/can0><state><93>",
        "<ferrodrive><--model><4=zlac8030l>",
        "<ferrodrive><--bus><socketcand://127.0.0.1:29536/can0><read><93><position_actual_value>",
    ];
    for (line, (got, expected)) in lines.iter().zip(after_tab(&cache, &lines).iter().zip(expected)) {
        assert_eq!(got, expected, "after {line}");
    }
}

#[test]
fn fish_completes_behind_an_address() {
    if !is_there("fish") {
        return eprintln!("skipped: there is no fish here");
    }
    let cache = scratch("fish");
    let file = cache.join("ferrodrive.fish");
    std::fs::create_dir_all(&cache).unwrap();
    std::fs::write(&file, done(&["completions", "fish"]).out).unwrap();
    let line = "ferrodrive --bus socketcand://127.0.0.1:29536/can0 --model 4=zlac8030l read 4 position_actual_v";
    let mut fish = with_the_program("fish", &cache);
    fish.args(["--no-config", "-c", &format!("source {}; complete -C '{line}'", file.display())]).env("HOME", &cache);
    let ended = fish.output().unwrap();
    // An offer and its help, with a tab between.
    let said = String::from_utf8(ended.stdout).unwrap();
    assert_eq!(
        said.split('\t').next(),
        Some("position_actual_value"),
        "{said}{}",
        String::from_utf8_lossy(&ended.stderr)
    );
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
    let line = format!("{} --bus {bus} read 4 2014", processes::program());
    let read = || {
        let mut script = Command::new("script");
        script.args(["-q", "-e", "-c", &line, "/dev/null"]).env("XDG_CACHE_HOME", &cache);
        let ended = script.stdin(Stdio::null()).output().unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stdout));
        String::from_utf8(ended.stdout).unwrap()
    };
    let first = read();
    assert!(first.contains("its model is not certain") && first.contains("--model 4="), "{first}");
    let second = read();
    assert!(!second.contains("its model is not certain") && second.contains("2014h"), "{second}");
    let kept = std::fs::read_to_string(cache.join("ferrodrive/remembered.json")).unwrap();
    assert!(kept.contains(&bus) && kept.contains("\"4\""), "{kept}");
    // Without a terminal each call reports it, and nothing is kept.
    let elsewhere = scratch("not-remembered");
    for _ in 0..2 {
        let mut quiet = Command::new(processes::program());
        let ended =
            quiet.args(["--bus", &bus, "read", "4", "2014"]).env("XDG_CACHE_HOME", &elsewhere).output().unwrap();
        assert!(String::from_utf8(ended.stderr).unwrap().contains("its model is not certain"));
    }
    assert!(!elsewhere.join("ferrodrive").exists());
}
