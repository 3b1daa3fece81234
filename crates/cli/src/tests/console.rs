//! The console of a page and the command line: one parser and one text. Each line is given to both, on fresh buses of the same machine in
//! virtual time.

use std::time::Duration;

use processes::{Scratch, scratch};
use serde_json::{Value, json};
use web::HostedWorld;

use super::virtual_bus::without_bus;

const MACHINE: &str = "timing = 'ideal'\n\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n\n[[drive]]\nmodel = 'm4230e17b50'\nnode = 1\n";

/// A page that has control, with its own world of the machine.
struct Page {
    world: HostedWorld,
    seq: u64,
    /// The texts of its news.
    news: Vec<String>,
}

impl Page {
    fn new() -> Self {
        Self::of(MACHINE)
    }

    fn of(machine: &str) -> Self {
        let world = HostedWorld::open(machine, Duration::ZERO).expect("a machine");
        let mut page = Self { world, seq: 0, news: Vec::new() };
        page.must(json!({ "do": "take_control" }));
        page
    }

    fn say(&mut self, mut command: Value) -> u64 {
        self.seq += 1;
        command["seq"] = self.seq.into();
        command["session"] = "page".into();
        self.world.say(&command.to_string());
        self.seq
    }

    /// The answer, if it comes within the next 100 ms.
    fn answer(&mut self, seq: u64) -> Option<Value> {
        self.world.run_until(self.world.now() + Duration::from_millis(100));
        let sent = self.world.take_sent().into_iter().map(|line| serde_json::from_str::<Value>(&line).expect("JSON"));
        let sent: Vec<_> = sent.collect();
        let news = sent.iter().filter(|message| message["type"] == "news");
        self.news.extend(news.map(|news| news["text"].as_str().expect("a text").to_owned()));
        sent.into_iter().find(|message| message["type"] == "answer" && message["seq"] == seq)
    }

    /// Asks, and holds what moves until the answer has come.
    fn ask(&mut self, command: Value) -> Value {
        let seq = self.say(command);
        for _ in 0..200 {
            if let Some(answer) = self.answer(seq) {
                return answer;
            }
            self.say(json!({ "do": "alive" }));
        }
        panic!("no answer within 20 s");
    }

    fn must(&mut self, command: Value) {
        let answer = self.ask(command);
        assert_eq!(answer["ok"], true, "{answer}");
    }

    /// What a line says, and its status.
    fn line(&mut self, line: &str) -> (String, i64) {
        let answer = self.ask(json!({ "do": "console", "line": line }));
        let said = &answer["result"];
        (said["text"].as_str().expect("a text").to_owned(), said["status"].as_i64().expect("a status"))
    }

    /// The true speed of a shaft, in r/min.
    fn speed(&mut self, node: u8) -> f64 {
        let got = self.world.command(&format!("{node} get")).expect("a drive");
        serde_json::from_str::<Value>(&got).expect("JSON")["velocity_rpm"].as_f64().expect("a speed").abs()
    }

    /// Lets time pass, and holds what moves.
    fn held(&mut self, ms: u64) {
        for _ in 0..ms / 100 {
            self.say(json!({ "do": "alive" }));
            self.silent(100);
        }
    }

    /// Lets time pass without a sign of the page.
    fn silent(&mut self, ms: u64) {
        self.world.run_until(self.world.now() + Duration::from_millis(ms));
    }
}

fn machine(name: &str) -> Scratch {
    let folder = scratch(name);
    std::fs::write(folder.join("machine.toml"), MACHINE).expect("written");
    folder
}

/// Whether two texts are the same but for what is measured while a shaft moves: the host of a page reads its drives on the same bus
/// meanwhile, so that what is read is read somewhat later.
fn is_same(page: &str, shell: &str) -> bool {
    let is_measured =
        |line: &str| ["  at ", "  before "].iter().any(|start| line.starts_with(start)) || line.contains(" after ");
    let unsigned =
        |word: &str| word.trim_start_matches(|sign: char| sign.is_ascii_digit() || "+-.".contains(sign)).to_owned();
    let number = |word: &str| word[..word.len() - unsigned(word).len()].parse::<f64>().ok();
    // By the unit, which stands at the number or behind it.
    let near = |(page, shell): (&str, &str), next: &str| {
        let unit = [unsigned(shell), next.to_owned()].into_iter().find(|unit| !unit.is_empty()).unwrap_or_default();
        let least = match unit.trim_end_matches([',', ':']) {
            "s" => 0.2,
            "counts" => 41.0,
            "°" => 3.6,
            "r/min" => 3.0,
            "A" => 0.5,
            _ => 0.0,
        };
        match (number(page), number(shell)) {
            (Some(page), Some(shell)) if least > 0.0 => (page - shell).abs() <= (0.1 * shell.abs()).max(least),
            _ => page == shell,
        }
    };
    let same_words = |page: &str, shell: &str| {
        let (page, shell): (Vec<_>, Vec<_>) = (page.split(' ').collect(), shell.split(' ').collect());
        let next = shell.iter().skip(1).copied().chain([""]);
        page.len() == shell.len()
            && page.iter().copied().zip(shell.iter().copied()).zip(next).all(|(words, next)| near(words, next))
    };
    page.lines().count() == shell.lines().count()
        && page
            .lines()
            .zip(shell.lines())
            .all(|(page, shell)| page == shell || (is_measured(shell) && same_words(page, shell)))
}

#[test]
fn a_line_says_in_a_page_what_it_says_in_a_shell() {
    let folder = machine("console_same");
    let bus = format!("sim:{}", folder.join("machine.toml").display());
    for line in [
        "state 4",
        "state 2",
        "state 1",
        "enable 4",
        "disable 4",
        "reset 4",
        "explain 4",
        "stop 4",
        "quick-stop 4",
        "move 4 90deg",
        "move 4 --relative -0.5turn --acceleration 300ms",
        "velocity 4 60rpm --for 500ms",
        "torque 4 1.5A --for 200ms",
        "velocity 1 10rpm --for 500ms",
        "home 4 --method 17",
        "estop",
        "state 9",
        "velocity 4 60mm/s",
        "scan",
        "read 4 6041",
        "read 4 1018:* device_type 6083",
        "read 1 1000..1018",
        "read 4 5FFF",
        "read 9 6041",
        "write 4 6083 600ms",
        "write 2 profile_acceleration 0x258",
        "save 4",
        "nmt 4 pre-operational",
        "nmt 4 start --wait 2s",
        "objects",
        "objects zlim42c homing",
        "objects zlac8030l --departures",
        "objects 4 velocity",
        "objects 9",
        "emcy show 4",
        "emcy show 1",
        "pdo show 4",
        "pdo show 9",
        "params backup 4",
        "params backup 9",
        "params diff 4 2",
        "params diff 4 4",
        "params diff 4 9",
    ] {
        // As long as a page waits.
        let on_bus = ["--bus", &bus, "--timeout", "200ms"];
        let of_model = line == "objects" || line.starts_with("objects zl");
        let words: Vec<_> = on_bus.into_iter().filter(|_| !of_model).chain(line.split(' ')).collect();
        let shell = without_bus(&words);
        let (text, status) = Page::new().line(line);
        let said = format!("{}{}", shell.out, shell.err);
        assert!(is_same(&text, said.trim_end()), "{line}\nin a page:\n{text}\nin a shell:\n{said}");
        assert_eq!(Some(status), shell.status.map(i64::from), "{line}");
    }
}

#[test]
fn a_line_that_makes_no_sense_is_refused_in_the_words_of_the_command_line() {
    let mut page = Page::new();
    for line in [
        "fly 4",
        "read 4",
        "write 4 6083",
        "move 4",
        "move 400 90deg",
        "velocity 4 60deg",
        "stop",
        "home 4",
        "move 4 90deg --speed 5",
        "save",
        "nmt 4 fly",
    ] {
        let shell = without_bus(&line.split(' ').collect::<Vec<_>>());
        let (text, status) = page.line(line);
        assert_eq!((status, shell.status), (2, Some(2)), "{line}: {text}");
        // What the parser says first; how a line is formed differs by the program's name and by what a page does not have.
        let first = |text: &str| text.lines().next().map(str::to_owned);
        assert_eq!(first(&text), first(&shell.err), "{line}");
    }
    let (help, status) = page.line("help move");
    assert!(status == 0 && help.contains("Position: 32000 (counts), 90deg"), "{help}");
    assert_eq!(page.line("move 4 90deg --no-guard").1, 2, "a host guards what it moves");
    assert_eq!(page.line("ferrodrive state 4").1, 0, "as it stands in the manual");
    assert!(page.speed(4) < 0.5);
}

#[test]
fn a_line_moves_a_drive_for_the_session_in_control_alone_and_within_its_speed_limit() {
    let mut page = Page::new();
    page.must(json!({ "do": "release_control" }));
    for line in [
        "move 4 90deg",
        "velocity 4 60rpm",
        "enable 4",
        "stop 4",
        "reset 4",
        "write 4 6083 600",
        "save 4",
        "nmt 4 start",
    ] {
        let (text, status) = page.line(line);
        assert!(status == 1 && text.contains("take control first"), "{line}: {text}");
    }
    assert_eq!(page.line("state 4").1, 0, "looking is open to all");
    assert_eq!(page.line("quick-stop 4").1, 0, "and so is a stop");
    page.must(json!({ "do": "take_control" }));
    page.must(json!({ "do": "limit_speed", "rpm": 30 }));
    let (text, _) = page.line("velocity 4 60rpm");
    assert!(text.contains("beyond the speed limit of this session, 30 r/min"), "{text}");
    assert!(page.speed(4) < 0.5);
    assert_eq!(page.line("velocity 4 20rpm").1, 0);
    assert!((page.speed(4) - 20.0).abs() < 2.0);
}

#[test]
fn what_a_line_moves_is_stopped_by_all_that_stops_a_page() {
    for how in ["stop_all", "silent", "quick-stop 4", "joined anew"] {
        let mut page = Page::new();
        let (text, status) = page.line("velocity 4 60rpm");
        assert!(status == 0 && !text.contains("this command ends here"), "the host holds it: {text}");
        assert!((page.speed(4) - 60.0).abs() < 3.0, "{how}");
        match how {
            "stop_all" => page.must(json!({ "do": "stop_all" })),
            "silent" => page.silent(3000),
            "joined anew" => page.world.join(),
            line => assert_eq!(page.line(line).1, 0, "{line}"),
        }
        page.silent(1000);
        assert!(page.speed(4) < 2.0, "{how}: {} r/min", page.speed(4));
    }
}

#[test]
fn a_line_that_is_stopped_or_replaced_says_so() {
    let mut page = Page::new();
    for (by, says) in [
        (json!({ "do": "stop_all" }), "stopped by a press of stop"),
        (json!({ "do": "velocity", "node": 4, "rpm": 10 }), "replaced by another command to the drive"),
        (json!({ "do": "console", "line": "quick-stop 4" }), "stopped by a quick stop"),
    ] {
        let seq = page.say(json!({ "do": "console", "line": "velocity 4 60rpm --for 60s" }));
        for _ in 0..15 {
            assert_eq!(page.answer(seq), None);
            page.say(json!({ "do": "alive" }));
        }
        assert!((page.speed(4) - 60.0).abs() < 3.0);
        page.say(by);
        let answer = (0..20).find_map(|_| page.answer(seq)).expect("an answer");
        let said = &answer["result"];
        assert!(said["status"] == 1 && said["text"].as_str().is_some_and(|text| text.contains(says)), "{answer}");
    }
}

/// What a line writes is written as the Parameters view does it: planned first, at rest, nothing that commands a motion, and it can be
/// taken back.
#[test]
fn a_line_writes_a_parameter_by_the_rules_of_the_parameters_view() {
    let mut page = Page::new();
    let value = |page: &mut Page| page.line("read 4 6083").0;
    let before = value(&mut page);
    assert_eq!(page.line("write 4 6083 600").1, 0);
    assert!(value(&mut page).contains("= 600"), "{before}");
    page.must(json!({ "do": "roll_back", "node": 4 }));
    assert_eq!(value(&mut page), before);
    for (line, status) in [
        ("write 4 6040 0x0F", 1),
        ("write 4 60FF 60rpm", 1),
        ("write 4 6083 --from x.bin", 2),
        ("write 4 6083 much", 1),
    ] {
        let said = page.line(line);
        assert!(said.1 == status && said.0.starts_with("error: "), "{line}: {said:?}");
    }
    assert_eq!(page.line("velocity 4 60rpm").1, 0);
    let (text, status) = page.line("write 4 6083 700");
    assert!(status == 1 && (page.speed(4) - 60.0).abs() < 3.0, "{text}");
    assert_eq!(page.line("quick-stop 4").1, 0);
    assert_eq!(value(&mut page), before);
}

/// The stop of a line does not go on behind the command that has taken its place, and what that moves is stopped with the page.
#[test]
fn a_line_that_stops_gives_way_to_the_next_command() {
    for after_ms in [5, 60, 180] {
        let mut page = Page::new();
        assert_eq!(page.line("velocity 4 60rpm").1, 0);
        page.say(json!({ "do": "console", "line": "quick-stop 4" }));
        page.silent(after_ms);
        page.must(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
        page.held(1000);
        assert!((page.speed(4) - 60.0).abs() < 3.0, "{after_ms} ms: {} r/min", page.speed(4));
        page.silent(4000);
        assert!(page.speed(4) < 2.0, "{after_ms} ms: {} r/min", page.speed(4));
    }
}

/// The wheels of a base of 40 kg swing through a target before they rest there.
#[test]
fn a_wheel_of_the_machine_that_a_page_begins_with_is_moved_to_its_target() {
    let machine = concat!(env!("CARGO_MANIFEST_DIR"), "/../web/machine.toml");
    let mut page = Page::of(&std::fs::read_to_string(machine).expect("a machine file"));
    let (text, status) = page.line("move 4 90deg");
    assert_eq!(status, 0, "{text}");
    page.held(1000);
    let got = page.world.command("4 get").expect("a drive");
    let position = &serde_json::from_str::<Value>(&got).expect("JSON")["position"];
    // 4096 counts a turn; a hundredth of it is near enough.
    assert!(position.as_f64().is_some_and(|at| (at - 1024.0).abs() <= 41.0), "{got}");
}

/// What is refused has not begun: what moves goes on, whatever the reason.
#[test]
fn a_line_that_is_refused_does_not_disturb_the_motion_under_way() {
    let mut page = Page::new();
    assert_eq!(page.line("velocity 4 60rpm").1, 0);
    page.held(1000);
    for (line, status, says) in [
        ("velocity 4 60mm/s", 1, "feed_constant"),
        ("move 4 40mm", 1, "feed_constant"),
        ("velocity 4 10rpm --acceleration 5mm/s2", 1, "feed_constant"),
        ("velocity 4 10rpm --guard", 2, "the host guards every drive that it moves"),
        ("move 4 90deg --guard off", 2, "the host guards every drive that it moves"),
        ("torque 4 1A --no-guard", 2, "the host guards every drive that it moves"),
        ("home 1 --method 17 --guard", 2, "the host guards every drive that it moves"),
        ("home 4 --method 17", 1, "has no mode 6 (homing)"),
    ] {
        let said = page.line(line);
        assert!(said.1 == status && said.0.contains(says), "{line}: {said:?}");
        // Longer than a quick stop takes.
        page.held(200);
        assert!((page.speed(4) - 60.0).abs() < 3.0, "{line}: {} r/min", page.speed(4));
    }
}

/// The session that gave the line has its whole text; the news of all are one line.
#[test]
fn the_news_of_a_line_that_failed_are_one_line() {
    let mut page = Page::new();
    let (text, status) = page.line("move 4 20turn --within 300ms");
    assert!(status == 1 && text.lines().count() > 1, "{text}");
    page.silent(100);
    page.ask(json!({ "do": "alive" }));
    let why = text.lines().find_map(|line| line.strip_prefix("error: ")).expect("an error");
    assert!(page.news.iter().any(|news| news.starts_with(why)), "{why}: {:?}", page.news);
    assert!(page.news.iter().all(|news| !news.contains('\n')), "{:?}", page.news);
}

#[test]
fn lines_that_look_end_with_their_session() {
    let mut page = Page::new();
    // Together more than may be under way at once.
    for _ in 0..4 {
        for _ in 0..12 {
            page.say(json!({ "do": "console", "line": "explain 4 --watch 600s" }));
        }
        page.silent(10);
        page.world.join();
    }
    assert_eq!(page.line("state 4").1, 0);
}

/// A page that sees a danger stops what moves. More than that (the NMT state of every node) is for the session in control.
#[test]
fn an_estop_of_a_session_without_control_stops_and_does_no_more() {
    let mut page = Page::new();
    page.must(json!({ "do": "release_control" }));
    let (text, status) = page.line("estop");
    assert!(status == 0 && text.contains("node 4 (zlac8030l): at standstill"), "{text}");
    assert!(text.contains("the NMT states of the nodes stay as they are"), "{text}");
    let has =
        |page: &mut Page, nmt: &str| page.line("state 1").0.lines().any(|line| line == format!("  nmt         {nmt}"));
    assert!(has(&mut page, "operational"));
    page.must(json!({ "do": "take_control" }));
    let (text, status) = page.line("estop");
    assert!(status == 0 && !text.contains("NMT") && has(&mut page, "pre-operational"), "{text}");
}

#[test]
fn a_speed_along_a_way_is_held_to_the_limit_by_the_feed_of_the_machine_file() {
    // 200 mm a turn of the output: 50 mm/s are 15 r/min.
    let gear = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nunits = { feed_constant = '200 mm' }\n\n[[drive]]\nmodel = 'zlac8030l'\nnode = 5\n";
    let mut page = Page::of(gear);
    page.must(json!({ "do": "limit_speed", "rpm": 30 }));
    let (text, status) = page.line("velocity 4 150mm/s");
    assert!(status == 1 && text.contains("45.0 r/min is beyond the speed limit"), "{text}");
    let (text, status) = page.line("velocity 4 50mm/s");
    assert_eq!(status, 0, "{text}");
    page.held(1000);
    assert!((page.speed(4) - 15.0).abs() < 1.0, "{} r/min", page.speed(4));
    let (text, status) = page.line("velocity 5 50mm/s");
    assert!(status == 1 && text.contains("no feed constant"), "{text}");
}

/// A line has no `--model` and no `--bus`: what its page has in their place is said.
#[test]
fn a_line_is_advised_of_nothing_that_it_does_not_have() {
    let mut page = Page::new();
    for command in [
        "state",
        "enable",
        "move",
        "explain",
        "torque",
        "home",
        "estop",
        "scan",
        "read",
        "write",
        "objects",
        "emcy show",
        "pdo show",
        "params backup",
        "params diff",
    ] {
        let (text, status) = page.line(&format!("help {command}"));
        assert!(
            status == 0
                && !["--bus", "--machine", "--model", "--json", "--from", "-v ", "guard"]
                    .iter()
                    .any(|not| text.contains(not)),
            "{text}"
        );
    }
}

/// Nothing stops the stepper when the program dies: a person has to accept that first, as for every motion.
#[test]
fn what_nothing_would_stop_is_moved_only_after_that_was_accepted() {
    let mut page = Page::new();
    let (text, status) = page.line("move 2 90deg");
    assert!(status == 1 && text.contains("node 2 was not moved") && text.contains("Accept that first"), "{text}");
    page.must(json!({ "do": "accept_unguarded", "node": 2 }));
    let (text, status) = page.line("move 2 90deg");
    assert!(status == 0 && text.contains("note: node 2: if this command dies, nothing stops it"), "{text}");
}

/// What only the program can do is said to be there, with the view that does it in a page: a word is known or it is not.
#[test]
fn a_line_knows_every_command_of_the_program() {
    let mut page = Page::new();
    for command in crate::scope::command_line().get_subcommands() {
        let name = command.get_name();
        let (text, status) = page.line(&format!("{name} --help"));
        let is_elsewhere =
            status == 2 && text.starts_with(&format!("error: the console of a page has no command '{name}'"));
        assert!(status == 0 || is_elsewhere, "{name}: {status} {text}");
    }
    let (text, _) = page.line("pdo watch 4");
    assert!(text.contains("no command 'pdo watch'") && text.contains("the PDO view does that here"), "{text}");
    let (text, _) = page.line("params apply 4 wheel.toml");
    assert!(text.contains("the Parameters view does that here; ferrodrive params apply, in a shell"), "{text}");
}

#[test]
fn a_line_stores_and_resets_no_node() {
    let mut page = Page::new();
    assert_eq!(page.line("write 2 1017 500").1, 0);
    let written = page.line("read 2 1017").0;
    assert_eq!(page.line("save 2").1, 0);
    page.world.command("2 power cycle").expect("a world");
    page.silent(3000);
    assert_eq!(page.line("read 2 1017").0, written);
    let has =
        |page: &mut Page, nmt: &str| page.line("state 4").0.lines().any(|line| line == format!("  nmt         {nmt}"));
    assert_eq!(page.line("nmt 4 pre-operational").1, 0);
    page.silent(1500);
    assert!(has(&mut page, "pre-operational"));
    for line in ["nmt all start", "nmt 4 reset", "nmt 4 stop", "nmt 4 reset-communication"] {
        let (text, status) = page.line(line);
        assert!(status == 2 && text.contains("nmt NODE pre-operational"), "{line}: {text}");
    }
    page.silent(1500);
    assert!(has(&mut page, "pre-operational"));
}
