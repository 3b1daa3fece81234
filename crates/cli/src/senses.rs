//! Words of other tools, by their sense: who types what `candump`, `odrivetool` or `ros2` call a thing is answered with the
//! command that does it here. A word for looking is never answered with a command that may set a motor in motion.

use clap::Command;

/// Words of one sense, and what is typed here in their place. A word may be two: `sdo read`.
struct Row {
    words: &'static [&'static str],
    tips: &'static [&'static str],
}

/// Commands that may set a motor in motion, or give it power.
const MOVING: [&str; 8] = ["enable", "velocity", "move", "torque", "home", "group", "drive-base", "replay"];

/// Words of who wants to see something, or to have it stop: no tip may set a motor in motion.
const LOOKING: &[Row] = &[
    Row {
        words: &[
            "e-stop",
            "emergency",
            "emergency-stop",
            "emergency_stop",
            "stop-all",
            "stopall",
            "halt",
            "panic",
            "kill",
        ],
        tips: &["estop", "stop 4"],
    },
    Row { words: &["quickstop", "quick_stop", "brake"], tips: &["quick-stop 4", "estop"] },
    Row {
        words: &["candump", "sniff", "sniffer", "cansniffer", "listen", "can", "frames", "canmon", "can-monitor"],
        tips: &["dump"],
    },
    Row { words: &["monitor", "mon", "live"], tips: &["top", "watch 4 statusword 606C", "dump"] },
    Row {
        words: &["list", "ls", "devices", "discover", "nodes", "node list", "search", "ping", "who", "bus"],
        tips: &["scan"],
    },
    Row { words: &["info", "identify", "id", "describe", "node info"], tips: &["scan", "state 4"] },
    Row { words: &["heartbeat", "hb", "alive"], tips: &["scan", "supervise"] },
    Row { words: &["canbusload", "busload", "load"], tips: &["plan", "top"] },
    Row { words: &["nmt-state", "lifecycle"], tips: &["scan", "nmt 4 start --wait"] },
    Row { words: &["status", "stat", "show", "drv-status", "query"], tips: &["state 4"] },
    Row {
        words: &["temperature", "voltage", "current", "statusword", "encoder", "angle"],
        tips: &["state 4", "watch 4 statusword 6064"],
    },
    Row {
        words: &[
            "fault",
            "faults",
            "error",
            "errors",
            "dump_errors",
            "dump-errors",
            "alarm",
            "alarms",
            "diagnose",
            "diag",
            "why",
            "doctor",
        ],
        tips: &["explain 4", "state 4", "emcy show 4"],
    },
    Row { words: &["emergencies", "emergency-messages"], tips: &["emcy watch"] },
    Row {
        words: &["get", "sdo read", "sdo get", "sdo upload", "sdo", "upload", "param get", "rd", "peek"],
        tips: &["read 4 6064"],
    },
    Row { words: &["od", "dictionary", "dict", "objdict", "param list", "registers"], tips: &["objects 4"] },
    Row { words: &["topic", "echo", "follow-object", "tail", "poll"], tips: &["watch 4 statusword 606C"] },
    Row { words: &["mapping", "rpdo", "tpdo"], tips: &["pdo show 4"] },
    Row {
        words: &[
            "backup",
            "backup-config",
            "backup_config",
            "dump-config",
            "param dump",
            "export-config",
            "save-config",
        ],
        tips: &["params backup 4 -o drive.toml"],
    },
    Row { words: &["param", "parameter", "parameters"], tips: &["params backup 4", "read 4 6081"] },
    Row {
        words: &["tune", "tuning", "gains", "pid", "autotune"],
        tips: &["objects 4 gain", "record 4 606C 6077 -o run.mcap --for 5s", "params backup 4 -o gains.toml"],
    },
    Row { words: &["log", "logger", "canlogger", "candump-log", "save-log"], tips: &["dump --log trace.log"] },
    Row { words: &["trace", "tracing", "spy"], tips: &["dump", "dump --log trace.log", "state 4 -v"] },
    Row {
        words: &[
            "scope",
            "oscilloscope",
            "plotter",
            "liveplotter",
            "tview",
            "telemetry",
            "capture",
            "sample",
            "bag record",
            "bag",
        ],
        tips: &["top", "studio", "record 4 606C 6077 -o run.mcap --for 5s"],
    },
    Row { words: &["graph", "draw", "chart"], tips: &["plot run.mcap"] },
    Row { words: &["log2asc", "asc2log", "log2long", "export-log"], tips: &["convert trace.log trace.asc"] },
    Row { words: &["parse", "decoder"], tips: &["decode trace.log"] },
    Row { words: &["dbc"], tips: &["export dbc"] },
    Row { words: &["lint", "validate", "verify"], tips: &["check machine.toml", "eds lint vendor.eds"] },
    Row { words: &["gui", "ui", "web", "dashboard", "serve", "browser"], tips: &["studio"] },
    Row { words: &["shell", "console", "repl", "interactive", "tui", "htop"], tips: &["top", "studio"] },
    Row {
        words: &["simulate", "simulator", "emulate", "virtual", "mock", "start-sim"],
        tips: &["sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536"],
    },
    Row { words: &["test", "scenario", "scenarios"], tips: &["run scenario.toml", "demo"] },
    Row { words: &["connect", "open", "interface", "interfaces"], tips: &["--bus can0 scan"] },
    Row { words: &["version"], tips: &["--version"] },
    Row { words: &["off", "disarm", "idle", "power-off", "torque-off", "release"], tips: &["disable 4"] },
];

/// Words of who wants to change or to move something.
const ACTING: &[Row] = &[
    Row {
        words: &[
            "clear",
            "clear-faults",
            "clear_errors",
            "clear-errors",
            "ack",
            "acknowledge",
            "reset-fault",
            "fault-reset",
        ],
        tips: &["reset 4"],
    },
    Row {
        words: &["set", "sdo write", "sdo set", "sdo download", "download", "param set", "wr", "poke", "assign"],
        tips: &["write 4 6081 120"],
    },
    Row {
        words: &[
            "restore-config",
            "restore_config",
            "param load",
            "load-config",
            "import",
            "apply",
            "configure",
            "config",
        ],
        tips: &["params plan 4 drive.toml", "params apply 4 drive.toml", "params backup 4 -o drive.toml"],
    },
    Row { words: &["store", "save_configuration", "persist"], tips: &["save 4"] },
    Row {
        words: &["factory-reset", "factory", "defaults", "erase", "erase_configuration", "erase-config"],
        tips: &["restore 4"],
    },
    Row { words: &["reboot", "restart"], tips: &["nmt 4 reset --wait"] },
    Row {
        words: &["set-id", "node-id", "nodeid", "address", "baudrate", "bitrate", "baud"],
        tips: &["lss scan", "lss set --help"],
    },
    Row { words: &["cansend", "cangen", "transmit", "tx", "pub", "publish"], tips: &["send 604#4041600000000000"] },
    Row { words: &["canplayer", "play", "playback", "bag play"], tips: &["replay trace.log --skip-motion"] },
    Row { words: &["launch", "bringup", "up", "start"], tips: &["boot", "nmt 4 start"] },
    Row { words: &["on", "arm", "power-on", "torque-on", "closed_loop_control"], tips: &["enable 4"] },
    Row { words: &["jog", "spin", "rotate", "turn"], tips: &["velocity 4 60rpm --for 2s", "move 4 --relative 90deg"] },
    Row { words: &["speed", "vel", "rpm"], tips: &["state 4", "velocity 4 60rpm"] },
    Row { words: &["goto", "go", "pos", "position", "moveto", "mv"], tips: &["state 4", "move 4 90deg"] },
    Row {
        words: &["calibrate", "calibration", "zero", "set-zero", "homing", "reference"],
        tips: &["home 4 --method 35", "state 4"],
    },
    Row { words: &["follow", "trajectory", "path", "interpolate"], tips: &["group move 1=90deg 4=90deg"] },
    Row { words: &["drive", "cmd_vel", "twist"], tips: &["drive-base examples/base.toml --linear 0.2 --for 2s"] },
];

/// What is typed here in place of an unknown command, with the word behind it where that belongs to it.
pub(crate) fn tips(word: &str, behind: Option<&str>) -> Option<Vec<String>> {
    let two = behind.map(|behind| format!("{word} {behind}"));
    let said = |words: &str| {
        let words = words.to_ascii_lowercase();
        LOOKING.iter().chain(ACTING).find(|row| row.words.contains(&words.as_str()))
    };
    let row = two.and_then(|two| said(&two)).or_else(|| said(word))?;
    Some(row.tips.iter().map(|tip| format!("ferrodrive {tip}")).collect())
}

/// Whether a command that is spelt nearly so may be named: what moves a motor only to who wrote it but for a slip of the finger.
pub(crate) fn may_be_meant(word: &str, command: &str) -> bool {
    let begin = |text: &str| text.chars().take(2).collect::<String>().to_ascii_lowercase();
    !MOVING.contains(&command) || begin(word) == begin(command)
}

/// Words that belong together but were typed apart or without their option: `60 rpm`, `sim zlac8030l@4`.
pub(crate) fn joined(command: &Command, words: &[String]) -> Option<Vec<String>> {
    let mut made: Vec<String> = Vec::new();
    for word in words {
        let is_unit = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '°')
            && word.chars().all(|c| c.is_alphanumeric() || "/°²^".contains(c));
        match made.last_mut().filter(|before| is_unit && before.parse::<f64>().is_ok_and(f64::is_finite)) {
            Some(number) => number.push_str(word),
            None => made.push(word.clone()),
        }
    }
    let of_sim = made.iter().any(|word| word == "sim");
    let made: Vec<String> = made.iter().enumerate().fold(Vec::new(), |mut line, (place, word)| {
        let before = place.checked_sub(1).map(|before| made[before].as_str());
        let is_drive = of_sim && !word.contains("://") && word.contains('@') && !word.starts_with('-');
        if is_drive && before.is_some_and(|before| !before.starts_with("--") || before.contains('=')) {
            line.push("--drive".to_owned());
        }
        line.push(word.clone());
        line
    });
    let line = ["ferrodrive".to_owned()].into_iter().chain(made.iter().cloned());
    (made != words && command.clone().try_get_matches_from(line).is_ok()).then_some(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scope::command_line;

    #[test]
    fn every_tip_is_a_line_that_the_parser_takes_and_no_word_is_a_command() {
        let command = command_line();
        let all = || LOOKING.iter().chain(ACTING);
        for row in all() {
            for word in row.words {
                assert!(command.find_subcommand(word).is_none(), "{word} is a command");
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
        assert!(
            !may_be_meant("trace", "torque") && !may_be_meant("remote", "move") && may_be_meant("velocty", "velocity")
        );
    }

    #[test]
    fn what_other_tools_call_it_is_answered_by_its_sense() {
        for (word, behind, first) in [
            ("candump", None, "ferrodrive dump"),
            ("cansend", None, "ferrodrive send 604#4041600000000000"),
            ("get", Some("4"), "ferrodrive read 4 6064"),
            ("set", Some("4"), "ferrodrive write 4 6081 120"),
            ("sdo", Some("write"), "ferrodrive write 4 6081 120"),
            ("sdo", Some("4"), "ferrodrive read 4 6064"),
            ("info", None, "ferrodrive scan"),
            ("monitor", None, "ferrodrive top"),
            ("jog", Some("4"), "ferrodrive velocity 4 60rpm --for 2s"),
            ("trace", None, "ferrodrive dump"),
            ("backup", None, "ferrodrive params backup 4 -o drive.toml"),
            ("fault", None, "ferrodrive explain 4"),
            ("scope", None, "ferrodrive top"),
            ("log", None, "ferrodrive dump --log trace.log"),
            ("calibrate", None, "ferrodrive home 4 --method 35"),
            ("tune", None, "ferrodrive objects 4 gain"),
            ("follow", None, "ferrodrive group move 1=90deg 4=90deg"),
            ("E-STOP", None, "ferrodrive estop"),
        ] {
            assert_eq!(tips(word, behind).unwrap()[0], first, "{word}");
        }
        assert_eq!(tips("zzzz", None), None);
    }

    #[test]
    fn a_unit_and_a_drive_are_put_where_they_belong() {
        let meant = |line: &str| {
            let words: Vec<String> = line.split(' ').map(Into::into).collect();
            joined(&command_line(), &words).map(|words| words.join(" "))
        };
        assert_eq!(meant("velocity 4 60 rpm").as_deref(), Some("velocity 4 60rpm"));
        assert_eq!(
            meant("move 4 -90 deg --acceleration 500 ms").as_deref(),
            Some("move 4 -90deg --acceleration 500ms")
        );
        assert_eq!(meant("sim zlac8030l@4").as_deref(), Some("sim --drive zlac8030l@4"));
        assert_eq!(meant("sim zlac8030l@4 zlim42c@2").as_deref(), Some("sim --drive zlac8030l@4 --drive zlim42c@2"));
        for line in ["velocity 4 60 apples", "velocity 4 60rpm", "sim toaster@4", "read 4 6064"] {
            assert_eq!(meant(line), None, "{line}");
        }
    }
}
