//! Words of other tools, by their sense: who types what `candump`, `odrivetool` or `ros2` call a thing is answered with the
//! command that does it here. A word for looking is never answered with a command that may set a motor in motion.

use clap::Command;
use master::units::parse_duration;
use transport::BusSpec;
use words::node::{node, nodes};

use crate::word_order::{parses, text};

/// Words of one sense, and what is typed here in their place. A word may be two: `sdo read`; `#` stands for a node, `=` for
/// a node and its value.
struct Sense {
    words: &'static [&'static str],
    tips: &'static [&'static str],
}

/// Commands that may set a motor in motion, or give it power.
const MOVING: [&str; 10] =
    ["enable", "velocity", "move", "torque", "home", "group", "drive-base", "replay", "tune", "test-motion"];

/// Words of people who want to see something, or to have it stop: no tip may set a motor in motion.
const LOOKING: &[Sense] = &[
    Sense {
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
    Sense { words: &["quickstop", "quick_stop", "brake"], tips: &["quick-stop 4", "estop"] },
    Sense {
        words: &[
            "candump",
            "isotpdump",
            "sniff",
            "sniffer",
            "cansniffer",
            "listen",
            "can",
            "frames",
            "canmon",
            "can-monitor",
        ],
        tips: &["dump"],
    },
    Sense { words: &["monitor", "mon", "live"], tips: &["top", "watch 4 statusword 606C", "dump"] },
    Sense {
        words: &["list", "ls", "devices", "discover", "nodes", "node list", "search", "ping", "who", "bus"],
        tips: &["scan"],
    },
    Sense { words: &["models", "model", "drives", "supported", "catalog", "catalogue"], tips: &["objects"] },
    Sense { words: &["info", "identify", "id", "describe", "node info"], tips: &["scan", "state 4"] },
    Sense { words: &["mode", "modes", "opmode", "set-mode"], tips: &["state 4", "write --help"] },
    Sense { words: &["accel", "acceleration", "ramp", "ramps"], tips: &["objects 4 acceleration"] },
    Sense { words: &["diff", "compare"], tips: &["params diff 4 drive.toml", "eds diff vendor.eds zlac8030l"] },
    Sense { words: &["heartbeat", "hb", "alive", "watchdog"], tips: &["scan", "read 4 1017", "supervise"] },
    Sense { words: &["canbusload", "busload", "load"], tips: &["plan", "top"] },
    Sense { words: &["nmt-state", "lifecycle"], tips: &["scan", "nmt 4 start --wait"] },
    Sense { words: &["status", "stat", "show", "drv-status", "query"], tips: &["state 4"] },
    Sense {
        words: &["temperature", "voltage", "current", "statusword", "encoder", "angle"],
        tips: &["state 4", "watch 4 statusword 6064"],
    },
    Sense {
        words: &[
            "fault",
            "fix",
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
    Sense { words: &["emergencies", "emergency-messages"], tips: &["emcy watch"] },
    Sense {
        words: &["get", "sdo read", "sdo get", "sdo upload", "sdo", "upload", "param get", "rd", "peek"],
        tips: &["read 4 6064"],
    },
    Sense { words: &["od", "dictionary", "dict", "objdict", "param list", "registers"], tips: &["objects 4"] },
    Sense { words: &["topic", "echo", "follow-object", "tail", "poll"], tips: &["watch 4 statusword 606C"] },
    Sense { words: &["mapping", "rpdo", "tpdo"], tips: &["pdo show 4"] },
    Sense {
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
    Sense { words: &["param", "parameter", "parameters"], tips: &["params backup 4", "read 4 6081"] },
    Sense { words: &["log", "logger", "canlogger", "candump-log", "save-log"], tips: &["dump --log trace.log"] },
    Sense { words: &["trace", "tracing", "spy"], tips: &["dump", "dump --log trace.log", "state 4 -v"] },
    Sense {
        words: &[
            "scope",
            "oscilloscope",
            "plotter",
            "liveplotter",
            "tview",
            "telemetry",
            "sample",
            "bag record",
            "bag",
        ],
        tips: &["top", "studio", "record 4 606C 6077 -o run.mcap --for 5s"],
    },
    Sense { words: &["graph", "draw", "chart"], tips: &["plot run.mcap"] },
    Sense { words: &["log2asc", "asc2log", "log2long", "export-log"], tips: &["convert trace.log trace.asc"] },
    Sense { words: &["parse", "decoder"], tips: &["decode trace.log"] },
    Sense { words: &["dbc"], tips: &["export dbc"] },
    Sense {
        words: &["lint", "validate", "verify"],
        tips: &["check machine.toml", "eds lint vendor.eds", "params verify 4 drive.toml"],
    },
    Sense {
        words: &["params #", "params list", "params show", "params get", "params read", "params dump", "params export"],
        tips: &["params backup 4 -o drive.toml", "read 4 6081", "objects 4"],
    },
    Sense {
        words: &["params compare", "params check"],
        tips: &["params diff 4 drive.toml", "params verify 4 drive.toml"],
    },
    Sense {
        words: &["pdo #", "pdo list", "pdo map", "pdo mapping", "pdo get", "pdo read", "pdo info"],
        tips: &["pdo show 4"],
    },
    Sense { words: &["pdo monitor", "pdo dump", "pdo listen"], tips: &["pdo watch 4"] },
    Sense { words: &["lss find", "lss list", "lss fastscan", "lss discover", "lss search"], tips: &["lss scan"] },
    Sense { words: &["lss get", "lss info", "lss id", "lss show"], tips: &["lss inquire only"] },
    Sense {
        words: &["emcy #", "emcy list", "emcy history", "emcy read", "emcy get", "emcy log"],
        tips: &["emcy show 4"],
    },
    Sense { words: &["emcy monitor", "emcy listen", "emcy dump"], tips: &["emcy watch"] },
    Sense { words: &["eds check", "eds validate", "eds verify"], tips: &["eds lint vendor.eds"] },
    Sense { words: &["eds info", "eds print", "eds list", "eds objects", "eds dump"], tips: &["eds show vendor.eds"] },
    Sense { words: &["eds compare"], tips: &["eds diff vendor.eds zlac8030l"] },
    Sense {
        words: &["eds generate", "eds export", "eds create", "eds make", "eds write", "export eds"],
        tips: &["eds zlac8030l -o zlac8030l.eds"],
    },
    Sense { words: &["export dcf"], tips: &["dcf 4 -o drive.dcf"] },
    Sense { words: &["gui", "ui", "web", "dashboard", "serve", "browser"], tips: &["studio"] },
    Sense { words: &["measure", "measurement"], tips: &["capture 4 606C 6077 -o run.mcap", "top"] },
    Sense {
        words: &["server"],
        tips: &["studio", "sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536", "gateway"],
    },
    Sense {
        words: &["ros2", "ros"],
        tips: &["check bus.yml", "sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536"],
    },
    Sense { words: &["shell", "console", "repl", "interactive", "tui", "htop"], tips: &["top", "studio"] },
    Sense {
        words: &["simulate", "simulator", "emulate", "virtual", "mock", "start-sim"],
        tips: &["sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536"],
    },
    Sense { words: &["scenario", "scenarios"], tips: &["run scenario.toml", "demo"] },
    Sense { words: &["test", "tests"], tips: &["run scenario.toml", "conform 4", "demo"] },
    Sense {
        words: &[
            "conformance",
            "conformity",
            "compliance",
            "compliant",
            "comply",
            "certify",
            "certification",
            "cct",
            "canopen-test",
            "test-node",
            "selftest",
            "self-test",
        ],
        tips: &["conform 4", "conform --list"],
    },
    Sense { words: &["connect", "open", "interface", "interfaces"], tips: &["--bus can0 scan"] },
    Sense { words: &["version"], tips: &["--version"] },
    Sense {
        words: &["off", "disarm", "idle", "power-off", "torque-off", "release", "shutdown"],
        tips: &["disable 4", "estop"],
    },
];

/// Words of people who want to change or to move something.
const ACTING: &[Sense] = &[
    Sense { words: &["autotune", "auto-tune", "tuning", "inertia"], tips: &["tune 4", "objects 4 gain"] },
    Sense { words: &["gains", "pid"], tips: &["objects 4 gain", "tune 4", "params backup 4 -o gains.toml"] },
    Sense { words: &["bode", "frequency", "sweep"], tips: &["tune 4", "test-motion 4 chirp"] },
    Sense { words: &["excite", "excitation", "chirp", "sine"], tips: &["test-motion 4 chirp", "test-motion 4 sine"] },
    Sense { words: &["power"], tips: &["state 4", "enable 4", "disable 4"] },
    Sense { words: &["pv"], tips: &["state 4", "velocity 4 60rpm"] },
    Sense { words: &["pp"], tips: &["state 4", "move 4 90deg"] },
    Sense { words: &["ip", "csp", "csv", "cst"], tips: &["state 4", "group move 1=90deg"] },
    Sense {
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
    Sense {
        words: &["set", "sdo write", "sdo set", "sdo download", "download", "param set", "wr", "poke", "assign"],
        tips: &["write 4 6081 120"],
    },
    Sense {
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
    Sense { words: &["store", "save_configuration", "persist"], tips: &["save 4"] },
    Sense { words: &["rollback", "roll-back", "undo"], tips: &["params rollback 4"] },
    Sense { words: &["flash", "firmware", "update", "upgrade", "bootloader"], tips: &["program 4 firmware.bin"] },
    Sense { words: &["params set", "params write"], tips: &["write 4 6081 120", "params apply 4 drive.toml"] },
    Sense {
        words: &["params load", "params import"],
        tips: &["params plan 4 drive.toml", "params apply 4 drive.toml"],
    },
    Sense {
        words: &["params restore", "params reset", "params undo"],
        tips: &["params apply 4 drive.toml", "params rollback 4", "restore 4"],
    },
    Sense { words: &["params save", "params store"], tips: &["save 4", "params backup 4 -o drive.toml"] },
    Sense {
        words: &["pdo set", "pdo configure", "pdo config", "pdo write"],
        tips: &["pdo plan 4 tpdo1=statusword", "pdo apply 4 tpdo1=statusword"],
    },
    Sense {
        words: &["lss set-id", "lss node-id", "lss assign", "lss configure", "lss store"],
        tips: &["lss set only --node-id 5 --store"],
    },
    Sense { words: &["lss bitrate", "lss baudrate"], tips: &["lss set only --bitrate 250k --store"] },
    Sense { words: &["emcy clear", "emcy reset"], tips: &["reset 4", "write 4 1003:00 0"] },
    Sense { words: &["group ="], tips: &["group move 1=90deg"] },
    Sense {
        words: &["factory-reset", "factory", "defaults", "erase", "erase_configuration", "erase-config"],
        tips: &["restore 4"],
    },
    Sense { words: &["reboot", "restart"], tips: &["nmt 4 reset --wait"] },
    Sense {
        words: &["set-id", "node-id", "nodeid", "address", "baudrate", "bitrate", "baud"],
        tips: &["lss scan", "lss set --help"],
    },
    Sense { words: &["cansend", "cangen", "transmit", "tx", "pub", "publish"], tips: &["send 604#4041600000000000"] },
    Sense { words: &["canplayer", "play", "playback", "bag play"], tips: &["replay trace.log --skip-motion"] },
    Sense { words: &["launch", "bringup", "up"], tips: &["boot", "nmt 4 start"] },
    Sense { words: &["start"], tips: &["nmt 4 start"] },
    Sense { words: &["on", "arm", "power-on", "torque-on", "closed_loop_control"], tips: &["enable 4"] },
    Sense {
        words: &["jog", "spin", "rotate", "turn"],
        tips: &["velocity 4 60rpm --for 2s", "move 4 --relative 90deg"],
    },
    Sense { words: &["speed", "vel", "rpm"], tips: &["state 4", "velocity 4 60rpm"] },
    Sense { words: &["goto", "go", "pos", "position", "moveto", "mv"], tips: &["state 4", "move 4 90deg"] },
    Sense {
        words: &["calibrate", "calibration", "zero", "set-zero", "homing", "reference"],
        tips: &["state 4", "home 4 --method 35"],
    },
    Sense {
        words: &["follow", "trajectory", "path", "interpolate"],
        tips: &["group follow path.csv --approach", "group move 1=90deg"],
    },
    Sense { words: &["drive", "cmd_vel", "twist"], tips: &["drive-base examples/base.toml --linear 0.2 --for 2s"] },
];

/// What is typed here in place of the word at `place`, with the nodes, objects, values and options that were typed.
pub(crate) fn tips(command: &Command, words: &[String], place: usize) -> Option<Vec<String>> {
    let lower = |place: usize| words.get(place).map(|word| word.to_ascii_lowercase());
    let row = |sense: &str| LOOKING.iter().chain(ACTING).find(|row| row.words.contains(&sense));
    let parent = place.checked_sub(1).and_then(|before| command.find_subcommand(&words[before]));
    // The value of an option may be spelt as a command is: `--bus sim`.
    let parent = parent.filter(|its| its.has_subcommands());
    let of_parent = parent.and_then(|its| {
        let word = match &words[place] {
            word if nodes(word).is_ok() => "#".to_owned(),
            word if word.contains('=') => "=".to_owned(),
            word => word.to_ascii_lowercase(),
        };
        // A node, and a node with its value, belong to the command that is meant.
        let from = if ["#", "="].contains(&word.as_str()) { place } else { place + 1 };
        Some((row(&format!("{} {word}", its.get_name()))?, place - 1, from))
    });
    let of_two = || Some((row(&format!("{} {}", lower(place)?, lower(place + 1)?))?, place, place + 2));
    let of_one = || Some((row(&lower(place)?)?, parent.map_or(place, |_| place - 1), place + 1));
    let (row, from, to) = of_parent.or_else(of_two).or_else(of_one)?;
    let mut tips = row.tips.to_vec();
    // A line that names a node means that one.
    if words.get(to).is_some_and(|word| node(word).is_ok()) {
        tips.sort_by_key(|tip| *tip == "estop");
    }
    Some(tips.into_iter().map(|tip| with_typed(command, &words[..from], tip, &words[to..])).collect())
}

/// A tip with what was typed before and behind the word that it replaces, as far as the parser takes it.
fn with_typed(command: &Command, before: &[String], tip: &str, typed: &[String]) -> String {
    let tip: Vec<String> = tip.split(' ').map(str::to_owned).collect();
    let (bus, tip_words) = match &tip[..] {
        [option, bus, rest @ ..] if option == "--bus" => (Some(bus), rest),
        rest => (None, rest),
    };
    let typed_bus = typed.iter().find(|word| is_bus(word));
    let typed: Vec<String> = typed.iter().filter(|word| !is_bus(word)).cloned().collect();
    let before_has_bus = before.iter().any(|word| word == "--bus" || word.starts_with("--bus="));
    let bus = typed_bus.or(bus).filter(|_| !before_has_bus);
    let bus: Vec<String> = bus.into_iter().flat_map(|bus| ["--bus".to_owned(), bus.clone()]).collect();
    let (path, arguments) = tip_words.split_at(depth(command, tip_words));
    let ((named, options), (typed_named, typed_options)) = (apart(arguments), apart(&typed));
    let missing = named.get(typed_named.len()..).unwrap_or_default();
    let of_node = typed_named.first().filter(|word| node(word).is_ok() && !named.is_empty());
    let of_node: Vec<String> = of_node.into_iter().chain(named.iter().skip(1)).cloned().collect();
    // A file that was typed is the one that is read.
    let typed_file = typed_named.iter().skip(1).find(|word| word.contains('.'));
    let mut with_file = options.to_vec();
    if let ([.., option, file], Some(typed)) = (&mut with_file[..], typed_file)
        && option == "--from"
    {
        file.clone_from(typed);
    }
    let lines = [
        [typed_named, missing, typed_options, options].concat(),
        [typed_named, missing, typed_options].concat(),
        [of_node, with_file].concat(),
        arguments.to_vec(),
    ];
    let lines = lines.iter().map(|line| [before, &bus, path, line].concat());
    lines.into_iter().find(|line| parses(command, line)).map_or_else(|| text(&tip), |line| text(&line))
}

/// How many of the first words name a command.
fn depth(command: &Command, words: &[String]) -> usize {
    let mut its = Some(command);
    words
        .iter()
        .take_while(|word| {
            its = its.and_then(|its| its.find_subcommand(word));
            its.is_some()
        })
        .count()
}

/// The arguments that stand by their place, and the options behind them.
fn apart(words: &[String]) -> (&[String], &[String]) {
    let is_option =
        |word: &String| word.strip_prefix('-').is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()));
    words.split_at(words.iter().position(is_option).unwrap_or(words.len()))
}

/// A bus that can be nothing else: `can0`, `vcan1`, or an address.
fn is_bus(word: &str) -> bool {
    let interface = ["slcan", "vcan", "can"].iter().find_map(|kind| word.strip_prefix(kind));
    let numbered = interface.is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()));
    (numbered || word.contains("://")) && word.parse::<BusSpec>().is_ok()
}

/// An argument that was typed without its option.
struct WithoutOption {
    /// The commands whose option it is; of all where there are none.
    commands: &'static [&'static str],
    option: &'static str,
    fits: fn(&str) -> bool,
}

fn ends_in(word: &str, endings: &[&str]) -> bool {
    let ending = std::path::Path::new(word).extension().and_then(std::ffi::OsStr::to_str);
    ending.is_some_and(|ending| endings.iter().any(|other| other.eq_ignore_ascii_case(ending)))
}

const WITHOUT_OPTION: &[WithoutOption] = &[
    WithoutOption { commands: &["home"], option: "--method", fits: |word| word.parse::<i8>().is_ok() },
    WithoutOption { commands: &["init"], option: "-o", fits: |word| ends_in(word, &["toml"]) },
    WithoutOption { commands: &["backup"], option: "-o", fits: |word| ends_in(word, &["toml", "dcf", "bin"]) },
    WithoutOption { commands: &["record"], option: "-o", fits: |word| ends_in(word, &["mcap", "csv"]) },
    WithoutOption { commands: &["dcf"], option: "-o", fits: |word| ends_in(word, &["dcf"]) },
    WithoutOption { commands: &["eds"], option: "-o", fits: |word| ends_in(word, &["eds"]) },
    WithoutOption { commands: &["dbc"], option: "-o", fits: |word| ends_in(word, &["dbc"]) },
    WithoutOption { commands: &["demo", "latency"], option: "-o", fits: |word| ends_in(word, &["svg"]) },
    WithoutOption { commands: &["plot"], option: "-o", fits: |word| ends_in(word, &["svg", "html"]) },
    WithoutOption {
        commands: &["dump", "emcy", "pdo", "record", "supervise", "torque", "velocity", "watch"],
        option: "--for",
        fits: |word| parse_duration(word).is_ok(),
    },
    WithoutOption { commands: &[], option: "--machine", fits: |word| ends_in(word, &["toml"]) },
    WithoutOption { commands: &[], option: "--bus", fits: is_bus },
];

/// What was meant by a line with an argument whose option is missing: `home 2 17`, `scan can0`.
pub(crate) fn with_option(command: &Command, words: &[String]) -> Option<Vec<String>> {
    WITHOUT_OPTION.iter().find_map(|WithoutOption { commands, option, fits }| {
        let of_all = commands.is_empty();
        if !of_all && !words.iter().any(|word| commands.contains(&word.as_str())) {
            return None;
        }
        (0..words.len()).rev().filter(|place| fits(&words[*place])).find_map(|place| {
            let mut line = words.to_vec();
            let pair = [(*option).to_owned(), line.remove(place)];
            let line = if of_all { [&pair[..], &line].concat() } else { [&line[..], &pair].concat() };
            parses(command, &line).then_some(line)
        })
    })
}

/// What is said to `estop 4`: one drive and all of them are stopped by different commands.
pub(crate) fn stop_of_one(command: &Command, words: &[String]) -> Option<String> {
    let place = words.iter().position(|word| word == "estop")?;
    let mut line = words.to_vec();
    "quick-stop".clone_into(&mut line[place]);
    parses(command, &line).then(|| format!("`ferrodrive estop` stops every drive; one is stopped by: {}", text(&line)))
}

/// What is said to `restore 4 backup.toml`: factory settings and a backup come back by different commands.
pub(crate) fn restore_of_file(command: &Command, words: &[String]) -> Option<String> {
    // Not that of --machine.
    let is_file = |at: &usize| {
        let of_option = at.checked_sub(1).is_some_and(|before| words[before].starts_with("--"));
        ends_in(&words[*at], &["toml", "dcf", "bin", "csv"]) && !of_option
    };
    let file = (0..words.len()).find(is_file)?;
    let place = words.iter().position(|word| word == "restore")?;
    let mut line = words.to_vec();
    line.splice(place..=place, ["params".to_owned(), "apply".to_owned()]);
    let meant = parses(command, &line).then(|| text(&line));
    let meant = meant.unwrap_or_else(|| format!("ferrodrive params apply 4 {}", words[file]));
    Some(format!("`ferrodrive restore` loads factory settings, from no file; a backup is written back by: {meant}"))
}

/// Whether a command that is spelt nearly so may be named: what moves a motor only where it was typed but for a slip of the finger.
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
    (made != words && parses(command, &made)).then_some(made)
}

#[cfg(test)]
mod tests;
