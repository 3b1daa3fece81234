//! Words of other tools, each answered with the command that does it here.

use super::*;
use crate::scope::command_line;

#[test]
fn every_tip_is_a_line_that_the_parser_takes_and_no_word_is_a_command() {
    let command = command_line();
    let all = || LOOKING.iter().chain(ACTING);
    for row in all() {
        for word in row.words {
            assert!(command.find_subcommand(word).is_none(), "{word} is a command");
            let (parent, below) = word.split_once(' ').unwrap_or((word, ""));
            let known = command.find_subcommand(parent).and_then(|its| its.find_subcommand(below));
            assert!(known.is_none(), "{word} is a command");
            assert!(all().filter(|other| other.words.contains(word)).count() == 1, "{word} is there twice");
        }
        for tip in row.tips {
            // A machine file is read while the line is parsed.
            let line = ["ferrodrive"].into_iter().chain(tip.split(' '));
            let parsed = command.clone().try_get_matches_from(line);
            let asks_help = parsed.as_ref().is_err_and(|error| error.exit_code() == 0);
            assert!(parsed.is_ok() || asks_help, "{tip}: {}", parsed.unwrap_err());
        }
    }
}

#[test]
fn a_word_for_looking_or_stopping_is_never_answered_with_what_moves_a_motor() {
    for row in LOOKING {
        for tip in row.tips {
            assert!(!tip.split(' ').any(|word| MOVING.contains(&word)), "{:?}: {tip}", row.words);
        }
    }
    let mut command = command_line();
    command.build();
    assert!(MOVING.iter().all(|name| command.find_subcommand(name).is_some()), "{MOVING:?}");
    // What takes a guard, itself or by one of its own commands, moves.
    let takes_guard = |its: &Command| its.get_arguments().any(|argument| argument.get_long() == Some("guard"));
    let guarded: Vec<_> = command
        .get_subcommands()
        .filter(|its| takes_guard(its) || its.get_subcommands().any(takes_guard))
        .map(Command::get_name)
        .collect();
    assert!(guarded.contains(&"velocity") && guarded.len() > 6, "{guarded:?}");
    assert!(guarded.iter().all(|name| MOVING.contains(name)), "{guarded:?}");
    assert!(["dune", "June"].iter().all(|word| !may_be_meant(word, "tune")), "{MOVING:?}");
    assert!(!may_be_meant("trace", "torque") && !may_be_meant("remote", "move") && may_be_meant("velocty", "velocity"));
}

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(Into::into).collect()
}

/// The first tip for a line, whose unknown word is its `place`th.
fn first(line: &str, place: usize) -> Option<String> {
    tips(&command_line(), &words(line), place).map(|tips| tips[0].clone())
}

#[test]
fn what_other_tools_call_it_is_answered_by_its_sense() {
    for (line, tip) in [
        ("candump", "dump"),
        ("cansend", "send 604#4041600000000000"),
        ("get", "read 4 6064"),
        ("set", "write 4 6081 120"),
        ("sdo write", "write 4 6081 120"),
        ("sdo", "read 4 6064"),
        ("info", "scan"),
        ("monitor", "top"),
        ("jog", "velocity 4 60rpm --for 2s"),
        ("trace", "dump"),
        ("backup", "params backup 4 -o drive.toml"),
        ("fault", "explain 4"),
        ("scope", "top"),
        ("log", "dump --log trace.log"),
        ("calibrate", "state 4"),
        ("gains", "objects 4 gain"),
        ("tuning", "tune 4"),
        ("bode", "tune 4"),
        ("chirp", "test-motion 4 chirp"),
        ("isotpdump", "dump"),
        ("power", "state 4"),
        ("shutdown", "disable 4"),
        ("measure", "capture 4 606C 6077 -o run.mcap"),
        ("ros2", "check bus.yml"),
        ("watchdog", "scan"),
        ("halt", "estop"),
        ("autotune", "tune 4"),
        ("follow", "group follow path.csv --approach"),
        ("E-STOP", "estop"),
        ("rollback", "params rollback 4"),
        ("flash", "program 4 firmware.bin"),
        ("diff", "params diff 4 drive.toml"),
        ("fix", "explain 4"),
    ] {
        assert_eq!(first(line, 0).as_deref(), Some(&*format!("ferrodrive {tip}")), "{line}");
    }
    assert_eq!(first("zzzz", 0), None);
}

#[test]
fn a_wrong_command_of_a_command_is_answered_by_its_sense() {
    for (line, tip) in [
        ("params list 5", "params backup 5 -o drive.toml"),
        ("params restore 5 wheel.toml", "params apply 5 wheel.toml"),
        ("params save 5", "save 5"),
        ("pdo 5", "pdo show 5"),
        ("pdo set 5 tpdo2=off", "pdo plan 5 tpdo2=off"),
        ("lss find", "lss scan"),
        ("emcy 5", "emcy show 5"),
        ("emcy clear 5", "reset 5"),
        ("eds check my.eds", "eds lint my.eds"),
        ("export eds", "eds zlac8030l -o zlac8030l.eds"),
        ("group 1=30deg 2=5deg", "group move 1=30deg 2=5deg"),
    ] {
        assert_eq!(first(line, 1).as_deref(), Some(&*format!("ferrodrive {tip}")), "{line}");
    }
}

#[test]
fn a_tip_keeps_what_was_typed() {
    for (line, place, tip) in [
        ("halt 5", 0, "stop 5"),
        ("kill can1", 0, "--bus can1 estop"),
        ("calibrate 5", 0, "state 5"),
        ("get 5 2000", 0, "read 5 2000"),
        ("get 5", 0, "read 5 6064"),
        ("sdo read 5 2000:01 2001", 0, "read 5 2000:01 2001"),
        ("set 5 6060 3", 0, "write 5 6060 3"),
        ("jog 5 -60rpm", 0, "velocity 5 -60rpm --for 2s"),
        ("jog 5 10rpm --for 1s", 0, "velocity 5 10rpm --for 1s"),
        ("candump can1", 0, "--bus can1 dump"),
        ("cansend vcan0 123#11", 0, "--bus vcan0 send 123#11"),
        ("connect can2", 0, "--bus can2 scan"),
        ("--bus can0 fault 7", 2, "--bus can0 explain 7"),
        ("--bus sim fault 7", 2, "--bus sim explain 7"),
        ("canplayer mine.log", 0, "replay mine.log --skip-motion"),
        ("flash 5 fw.bin", 0, "program 5 fw.bin"),
        ("mode 5 3", 0, "state 5"),
        ("start 5", 0, "nmt 5 start"),
        ("diff a.eds b.eds", 0, "params diff a.eds b.eds"),
        ("accel 5", 0, "objects 5 acceleration"),
        // What makes no sense there is left out.
        ("get it", 0, "read 4 6064"),
    ] {
        assert_eq!(first(line, place).as_deref(), Some(&*format!("ferrodrive {tip}")), "{line}");
    }
}

#[test]
fn an_argument_without_its_option_is_put_behind_it() {
    let meant = |line: &str| with_option(&command_line(), &words(line)).map(|words| words.join(" "));
    for (line, expected) in [
        ("scan can0", "--bus can0 scan"),
        ("state 4 socketcand://10.0.0.1/can0", "--bus socketcand://10.0.0.1/can0 state 4"),
        ("home 2 17", "home 2 --method 17"),
        ("home 2 -1", "home 2 --method -1"),
        ("init machine.toml", "init -o machine.toml"),
        ("state 4 machine.toml", "--machine machine.toml state 4"),
        ("params backup 4 wheel.dcf", "params backup 4 -o wheel.dcf"),
        ("record 4 606C run.csv", "record 4 606C -o run.csv"),
        ("velocity 4 60rpm 2s", "velocity 4 60rpm --for 2s"),
    ] {
        assert_eq!(meant(line).as_deref(), Some(expected), "{line}");
    }
    for line in ["state 4 5", "home 2 backwards", "scan canned"] {
        assert_eq!(meant(line), None, "{line}");
    }
}

#[test]
fn a_unit_and_a_drive_are_put_where_they_belong() {
    let meant = |line: &str| joined(&command_line(), &words(line)).map(|words| words.join(" "));
    assert_eq!(meant("velocity 4 60 rpm").as_deref(), Some("velocity 4 60rpm"));
    assert_eq!(meant("move 4 -90 deg --acceleration 500 ms").as_deref(), Some("move 4 -90deg --acceleration 500ms"));
    assert_eq!(meant("sim zlac8030l@4").as_deref(), Some("sim --drive zlac8030l@4"));
    assert_eq!(meant("sim zlac8030l@4 zlim42c@2").as_deref(), Some("sim --drive zlac8030l@4 --drive zlim42c@2"));
    for line in ["velocity 4 60 apples", "velocity 4 60rpm", "sim toaster@4", "read 4 6064"] {
        assert_eq!(meant(line), None, "{line}");
    }
}
