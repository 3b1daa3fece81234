//! What is drawn for a state, as text, and what keys lead to.

mod units;

use can::Instant;
use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use host::{BusView, DriveView, FaultView, News, NodeView, SessionId, Snapshot};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use serde_json::{Value, json};

use super::app::{Action, App};
use super::screen::{Look, draw};

const NUMBER: SessionId = SessionId(1);

/// Two drives, as the host shows them: one that turns, one with a fault.
fn state() -> Snapshot {
    let turning = DriveView {
        at_s: 12.5,
        state: Some("Operation enabled"),
        mode_name: Some("profile velocity"),
        angle_degrees: Some(268.61),
        velocity_rpm: Some(-10.04),
        current_a: Some(0.16),
        supply_v: Some(36.2),
        driver_celsius: Some(31.4),
        ..DriveView::default()
    };
    let faulted = DriveView {
        at_s: 12.5,
        state: Some("Fault"),
        fault_code: Some(1),
        faults: vec![FaultView { name: "over-voltage", remedy: "Lower the supply." }],
        velocity_rpm: Some(0.0),
        supply_v: Some(71.0),
        ..DriveView::default()
    };
    let joint = NodeView {
        node: 1,
        model: Some("m4230e17b50"),
        nmt: Some("operational".into()),
        heartbeat_age_ms: Some(318),
        without_us: Some("it stops by itself 2000 ms after the last heartbeat".into()),
        drive: Some(Box::new(turning)),
        ..NodeView::default()
    };
    let wheel = NodeView {
        node: 4,
        model: Some("zlac8030l"),
        nmt: Some("pre-operational".into()),
        heartbeat_age_ms: Some(35_315),
        drive: Some(Box::new(faulted)),
        ..NodeView::default()
    };
    let silent = NodeView { node: 9, trouble: Some("no answer within 200 ms".into()), ..NodeView::default() };
    Snapshot {
        time_s: 12.5,
        controller: Some(NUMBER),
        sessions: 1,
        bus: BusView {
            name: "can0".into(),
            bitrate: Some(500_000),
            frames_per_s: 842,
            load_percent: Some(12.34),
            ..BusView::default()
        },
        nodes: vec![joint, wheel, silent],
        ..Snapshot::default()
    }
}

fn app() -> App {
    let mut app = App::new(NUMBER);
    app.take(state().into());
    app
}

/// The lines of the screen, without what is blank behind them.
fn drawn(app: &App, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a screen");
    terminal.draw(|frame| draw(frame, app, Look { colour: false })).expect("drawn");
    let cells = terminal.backend().buffer().content();
    let lines = cells.chunks(usize::from(width));
    lines.map(|line| line.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned()).collect()
}

#[test]
fn eighty_columns_and_24_lines_show_everything() {
    let mut app = app();
    app.note(News { time_s: 1.0, node: Some(4), text: "node 4 booted".into() });
    app.note(News { time_s: 11.25, node: Some(4), text: "over-voltage".into() });
    let lines = drawn(&app, 80, 24);
    assert_eq!(lines[0], "ferrodrive top  can0  500 kbit/s  load 12.3 %  842 frames/s");
    assert_eq!(
        lines[1..5],
        [
            "  node model       NMT             heard   state              speed   A     V",
            "> 1    m4230e17b50 operational     318 ms  Operation enabled  -10.0   0.2   36",
            "  4    zlac8030l   pre-operational 35 s    ! fault 0001h      0.0     -     71",
            "  9    ?           -               -       no answer          -       -     -",
        ]
    );
    assert!(lines[5].starts_with("speed r/min of 1──") && lines[5].contains(" current A of 1──"), "{}", lines[5]);
    assert!(lines[5].contains(" angle deg of 1──"));
    assert_eq!(lines[16], "node 1: profile velocity, 268.6 deg, driver 31 C");
    assert_eq!(lines[17], "jog at 10 r/min, + and - change that; without this program it stops by itself");
    assert_eq!(lines[18], "2000 ms after the last heartbeat");
    // A node is not named twice.
    assert_eq!(lines[20..22], ["     1.0 s  node 4 booted", "    11.2 s  node 4: over-voltage"]);
    assert_eq!(lines[23], "e enable  d disable  left/right jog  s stop  r reset  SPACE stop  ? help  q quit");
    assert_eq!(lines.len(), 24);
}

#[test]
fn the_chosen_drive_says_its_fault_and_what_to_do() {
    let mut app = app();
    assert_eq!(app.key(key(KeyCode::Down), at(0)), []);
    let lines = drawn(&app, 80, 24);
    assert!(lines[3].starts_with("> 4"), "{}", lines[3]);
    assert!(lines.iter().any(|line| line == "! over-voltage: Lower the supply."), "{lines:#?}");
    app.key(key(KeyCode::Char('j')), at(0));
    let lines = drawn(&app, 80, 24);
    assert!(lines.iter().any(|line| line == "! no answer within 200 ms"), "{lines:#?}");
    // No further than the last, and back to the first.
    for code in [KeyCode::Down, KeyCode::Down, KeyCode::Up, KeyCode::Char('k'), KeyCode::Up] {
        app.key(key(code), at(0));
    }
    assert_eq!(app.chosen, Some(1));
}

#[test]
fn more_room_goes_to_the_plots_and_more_nodes_than_lines_are_scrolled_to() {
    let mut app = app();
    let mut many = state();
    many.nodes = (1..=20).map(|node| NodeView { node, ..NodeView::default() }).collect();
    app.take(many.into());
    let lines = drawn(&app, 120, 40);
    assert_eq!(lines.len(), 40);
    let listed = |lines: &[String]| lines[2..8].iter().map(|line| line[2..4].trim().to_owned()).collect::<Vec<_>>();
    assert_eq!(listed(&lines), ["1", "2", "3", "4", "5", "6"]);
    for _ in 0..11 {
        app.key(key(KeyCode::Down), at(0));
    }
    assert_eq!(listed(&drawn(&app, 120, 40)), ["7", "8", "9", "10", "11", "12"]);
}

/// A ramp from 0 to 100 r/min within the last minute is a line from the lower left to the upper right.
#[test]
fn a_plot_shows_the_last_minute() {
    let mut app = App::new(NUMBER);
    for step in 0..=60 {
        let mut state = state();
        state.time_s = f64::from(step);
        let drive = state.nodes[0].drive.as_mut().expect("a drive");
        (drive.at_s, drive.velocity_rpm) = (f64::from(step), Some(f64::from(step) / 60.0 * 100.0));
        app.take(state.into());
    }
    let lines = drawn(&app, 80, 24);
    let plot: Vec<Vec<char>> = lines[6..13].iter().map(|line| line.chars().take(26).collect()).collect();
    assert!(plot[0].iter().collect::<String>().starts_with("120"), "{lines:#?}");
    assert!(plot[6].iter().collect::<String>().starts_with('0'), "{lines:#?}");
    let is_dot = |symbol: &char| ('\u{2801}'..='\u{28FF}').contains(symbol);
    let firsts: Vec<_> = plot.iter().filter_map(|line| line.iter().position(is_dot)).collect();
    assert!(firsts.len() >= 5 && firsts.windows(2).all(|pair| pair[0] > pair[1]), "rises to the right: {lines:#?}");
}

#[test]
fn a_window_that_is_too_small_says_so_and_an_empty_bus_what_to_do() {
    let text = drawn(&app(), 60, 10).join(" ");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("too small: 60 x 10, and 80 x 24 are needed. Until then no key moves a drive"), "{text}");
    assert!(text.starts_with("SPACE stops all, q quits"), "{text}");
    for (width, height) in [(1, 1), (80, 23), (79, 24), (2, 200)] {
        drawn(&app(), width, height);
    }
    let empty = App::new(NUMBER);
    assert!(drawn(&empty, 80, 24).iter().any(|line| line.contains("no node has been heard")));
}

#[test]
fn help_is_over_everything_and_stops_all_the_same() {
    let mut app = app();
    app.key(key(KeyCode::Char('?')), at(0));
    let lines = drawn(&app, 80, 24);
    assert!(lines.iter().any(|line| line.contains("SPACE, Esc       quick stop of every drive")), "{lines:#?}");
    assert!(lines.iter().all(|line| line.chars().count() <= 80));
    // No key does something that is not seen to be about, but for the stop.
    assert_eq!(app.key(key(KeyCode::Char(' ')), at(0)), [say(json!({ "do": "stop_all" }))]);
    assert_eq!(app.key(key(KeyCode::Char('e')), at(0)), []);
    assert!(!app.help, "it goes back");
}

#[test]
fn each_key_says_what_it_is_for() {
    let mut app = app();
    let node = 1;
    for (code, message) in [
        (KeyCode::Char('e'), json!({ "do": "enable", "node": node })),
        (KeyCode::Char('d'), json!({ "do": "disable", "node": node })),
        (KeyCode::Char('s'), json!({ "do": "stop", "node": node })),
        (KeyCode::Char('r'), json!({ "do": "reset_fault", "node": node })),
        (KeyCode::Char('x'), json!({ "do": "explain", "node": node })),
        (KeyCode::Char('n'), json!({ "do": "scan" })),
        (KeyCode::Char('t'), json!({ "do": "take_control" })),
        (KeyCode::Char(' '), json!({ "do": "stop_all" })),
        (KeyCode::Esc, json!({ "do": "stop_all" })),
    ] {
        assert_eq!(app.key(key(code), at(0)), [say(message)], "{code:?}");
    }
    assert_eq!(app.key(key(KeyCode::Char('q')), at(0)), [Action::Quit]);
    let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    assert_eq!(app.key(interrupt, at(0)), [Action::Quit]);
    assert_eq!(app.key(key(KeyCode::Char('z')), at(0)), []);
    assert!(app.news.last().is_some_and(|news| news.text.contains("? shows those that do")));
}

#[test]
fn a_held_key_jogs_and_every_other_ends_it_first() {
    let mut app = app();
    let jog = |rpm: f64| say(json!({ "do": "jog", "node": 1, "rpm": rpm }));
    let end = || say(json!({ "do": "jog_end", "node": 1 }));
    app.key(key(KeyCode::Char('+')), at(0));
    assert_eq!([0, 500, 533].map(|ms| app.key(key(KeyCode::Left), at(ms))), [vec![], vec![], vec![jog(-20.0)]]);
    assert_eq!(app.key(key(KeyCode::Left), at(566)), [say(json!({ "do": "jog_hold", "node": 1 }))]);
    // Another node is chosen: the one that turns gets the command.
    assert_eq!(app.key(key(KeyCode::Down), at(580)), [end()]);
    assert_eq!(app.chosen, Some(4));
    app.key(key(KeyCode::Up), at(590));
    // To the other side.
    assert_eq!([2000, 2500, 2533].map(|ms| app.key(key(KeyCode::Right), at(ms))), [vec![], vec![], vec![jog(20.0)]]);
    assert_eq!(app.key(key(KeyCode::Left), at(2540)), [end()]);
    assert_eq!([3000, 3033].map(|ms| app.key(key(KeyCode::Left), at(ms))), [vec![], vec![jog(-20.0)]]);
    assert_eq!(app.key(key(KeyCode::Char(' ')), at(3040)), [end(), say(json!({ "do": "stop_all" }))]);
    // Released: sent at the next look, within the 190 ms of the host.
    assert_eq!([6000, 6500, 6533].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat(), [jog(20.0)]);
    assert_eq!((app.look(at(6682)), app.look(at(6683))), (vec![], vec![end()]));
    // A terminal that reports releases, and one that loses the keyboard.
    assert_eq!([8000, 8500, 8533].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat(), [jog(20.0)]);
    let release = KeyEvent { kind: KeyEventKind::Release, ..key(KeyCode::Right) };
    assert_eq!(app.key(release, at(8540)), [end()]);
    assert_eq!([8600, 9100, 9133].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat(), [jog(20.0)]);
    assert_eq!(app.lose_focus(at(9140)), [end()]);
}

/// A drive that goes on without this program is moved once that was accepted, by a key of its own.
#[test]
fn what_nothing_stops_is_asked_about_in_full_before_it_moves() {
    let held = |app: &mut App, from: u64| {
        [from, from + 500, from + 533].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat()
    };
    let mut app = app();
    let mut state = state();
    state.nodes[0].goes_on = true;
    state.nodes[0].without_us =
        Some("nothing stops it: this model has no watch over its host and goes on as it was commanded".into());
    app.take(state.clone().into());
    assert_eq!(held(&mut app, 0), [], "nothing is begun");
    // The key is still held, and so is the question.
    assert_eq!([566, 600, 633].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat(), []);
    assert_eq!(app.look(at(640)), []);
    let lines = drawn(&app, 80, 24);
    let text = lines.join(" ").replace('│', " ");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "NOTHING STOPS NODE 1 IF THIS PROGRAM DIES",
        "nothing stops it: this model has no watch over its host and goes on as it was commanded.",
        "Keep an emergency stop within reach.",
        "y move it nevertheless",
    ] {
        assert!(text.contains(part), "{part}: {lines:#?}");
    }
    assert_eq!(app.key(key(KeyCode::Char(' ')), at(700)), [say(json!({ "do": "stop_all" }))]);
    assert_eq!(app.question, None);
    assert_eq!(held(&mut app, 3000), []);
    assert_eq!(app.key(key(KeyCode::Char('e')), at(3600)), [], "goes back and does nothing else");
    assert_eq!(held(&mut app, 6000), []);
    assert_eq!(app.key(key(KeyCode::Char('y')), at(6600)), [say(json!({ "do": "accept_unguarded", "node": 1 }))]);
    assert_eq!(app.key(key(KeyCode::Right), at(6640)), [], "what was held all the while begins nothing");
    state.nodes[0].accepted = true;
    app.take(state.into());
    assert_eq!(held(&mut app, 9000), [say(json!({ "do": "jog", "node": 1, "rpm": 10.0 }))], "asked once");
    app.look(at(9900));
    // The host knows it better than the last state.
    let refused = json!({ "ok": false, "error": { "kind": "unguarded", "message": "node 4 was not moved" } });
    assert!(app.answered(Some(4), &refused));
    assert_eq!(app.question, Some(4));
}

/// What cannot be seen is not moved: neither the drive nor the question about it is on the screen.
#[test]
fn in_a_terminal_that_is_too_small_keys_stop_and_quit_and_move_nothing() {
    let held = |app: &mut App, from: u64| {
        [from, from + 500, from + 533].map(|ms| app.key(key(KeyCode::Right), at(ms))).concat()
    };
    for goes_on in [true, false] {
        let mut app = app();
        let mut state = state();
        state.nodes[0].goes_on = goes_on;
        app.take(state.into());
        for (columns, lines) in [(79, 24), (80, 23), (20, 5)] {
            assert_eq!(app.resize(columns, lines, at(0)), []);
            for code in ['e', 'd', 's', 'r', 'x', 'n', 't', 'y', '+', 'j', '?'] {
                assert_eq!(app.key(key(KeyCode::Char(code)), at(10)), [], "{code}");
            }
            assert_eq!(held(&mut app, 2000), []);
            assert_eq!((app.question, app.help, app.jog_rpm()), (None, false, 10.0));
            assert_eq!(app.key(key(KeyCode::Esc), at(3000)), [say(json!({ "do": "stop_all" }))]);
            assert_eq!(app.key(key(KeyCode::Char(' ')), at(3000)), [say(json!({ "do": "stop_all" }))]);
            assert_eq!(app.key(key(KeyCode::Char('q')), at(3000)), [Action::Quit]);
            let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
            assert_eq!(app.key(interrupt, at(3000)), [Action::Quit]);
        }
        // With room again a key counts, and the question is asked.
        assert_eq!(app.resize(80, 24, at(4000)), []);
        let begun = held(&mut app, 5000);
        assert_eq!((begun.is_empty(), app.question.is_some()), (goes_on, goes_on));
        // A question that is no longer seen is not answered, and what is held ends.
        let ends = if goes_on { vec![] } else { vec![say(json!({ "do": "jog_end", "node": 1 }))] };
        assert_eq!(app.resize(60, 24, at(5540)), ends);
        assert_eq!(app.key(key(KeyCode::Char('y')), at(5600)), []);
        assert_eq!(app.question.is_some(), goes_on);
    }
}

#[test]
fn a_drive_whose_stop_was_not_seen_is_named_on_a_screen_of_any_size() {
    let mut app = app();
    let mut state = state();
    state.nodes[2].stop_unseen = true;
    app.take(state.into());
    for (columns, lines) in [(80, 24), (200, 60), (40, 6)] {
        let text = drawn(&app, columns, lines).join(" ");
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.starts_with("! NODE 9 MAY STILL BE MOVING: no stop was seen. Use the emergency stop"), "{text}");
    }
}

#[test]
fn answers_are_shown_where_they_say_something() {
    let mut app = app();
    let refused = json!({ "ok": false, "error": { "kind": "no_control", "message": "session 2 has control" } });
    assert!(app.answered(Some(4), &refused));
    assert_eq!(app.news.last().map(|news| (news.node, news.text.as_str())), Some((Some(4), "session 2 has control")));
    for kind in ["stopped", "replaced", "not_held"] {
        assert!(!app.answered(Some(4), &json!({ "ok": false, "error": { "kind": kind, "message": "." } })));
    }
    assert!(!app.answered(None, &json!({ "ok": true })));
    let finding = json!({ "cause": true, "follows": "It waits for its enable", "remedy": "Enable it" });
    assert!(app.answered(Some(1), &json!({ "ok": true, "result": { "findings": [finding] } })));
    assert_eq!(app.news.last().map(|news| news.text.as_str()), Some("It waits for its enable. Enable it"));
    assert!(app.answered(Some(1), &json!({ "ok": true, "result": { "findings": [] } })));
    assert!(app.news.last().is_some_and(|news| news.text.contains("nothing is found")));
}

/// All that has happened, of which three lines are shown otherwise, and in full.
#[test]
fn what_has_happened_is_read_back_in_full() {
    let mut app = app();
    let long = "the drive stands because it is commanded to. Write 60FFh:00, by SDO or by the first RPDO, and see whether it comes";
    app.note(News { time_s: 0.5, node: Some(4), text: long.into() });
    for number in 1..=100 {
        app.note(News { time_s: f64::from(number), node: None, text: format!("number {number}") });
    }
    let has = |app: &App, text: &str| drawn(app, 80, 24).iter().any(|line| line.contains(text));
    assert!(has(&app, "number 100") && !has(&app, "number 97"));
    app.key(key(KeyCode::Char('w')), at(0));
    // 24 lines without the border.
    assert!(has(&app, "number 79") && !has(&app, "number 78") && has(&app, "news up to 101 of 101"));
    app.key(key(KeyCode::PageUp), at(0));
    app.key(key(KeyCode::Up), at(0));
    assert!(has(&app, "number 89") && !has(&app, "number 90") && has(&app, "number 68"), "{:#?}", drawn(&app, 80, 24));
    app.key(key(KeyCode::Home), at(0));
    let shown: String =
        drawn(&app, 80, 24)[1..].iter().map(|line| line.trim_matches('│').trim().to_owned() + " ").collect();
    assert!(shown.contains(long), "{shown}");
    // A held key moves nothing that is not seen, and stop stops.
    assert_eq!([0, 500, 533].map(|ms| app.key(key(KeyCode::Left), at(ms))).concat(), []);
    assert_eq!(app.key(key(KeyCode::Char(' ')), at(600)), [say(json!({ "do": "stop_all" }))]);
    app.key(key(KeyCode::Char('e')), at(700));
    assert!(app.read_back.is_none() && has(&app, "number 100"));
}

/// By its name as it is typed, `h` and `l` too, which jog otherwise.
#[test]
fn an_object_of_choice_is_read_and_plotted_until_another_is_chosen() {
    let mut app = app();
    let typed = |app: &mut App, name: &str| {
        app.key(key(KeyCode::Char('o')), at(0));
        for letter in name.chars() {
            assert_eq!(app.key(key(KeyCode::Char(letter)), at(0)), [], "{letter}");
        }
        assert!(drawn(app, 80, 24).iter().any(|line| line.contains(&format!("object to plot: {name}_"))));
        app.key(key(KeyCode::Enter), at(0));
    };
    typed(&mut app, "vl_targex");
    app.object = None;
    typed(&mut app, "60F4");
    let reads = say(json!({ "do": "read_objects", "node": 1, "objects": ["60F4"] }));
    assert_eq!((app.look(at(10)), app.look(at(20))), (vec![reads.clone()], vec![]), "one at a time");
    let answer = |text: &str| json!({ "ok": true, "result": { "values": [{ "object": "60F4h:00", "text": text }] } });
    app.object_read(Some(1), "6064", &answer("7"), at(25));
    app.object_read(Some(4), "60F4", &answer("7"), at(25));
    assert!(app.object.as_ref().is_some_and(|object| object.values(0.0).is_empty()), "of another one");
    app.object_read(Some(1), "60F4", &answer("-250"), at(30));
    assert_eq!((app.look(at(79)), app.look(at(80))), (vec![], vec![reads]));
    app.object_read(Some(1), "60F4", &answer("250 (0.7 deg)"), at(90));
    let lines = drawn(&app, 120, 40);
    let plot = lines.iter().find(|line| line.contains("60F4 of 1")).expect("its title");
    assert!(plot.contains("speed r/min of 1") && lines.iter().any(|line| line.contains("-300")), "{lines:#?}");
    // Neither a number nor an answer: it ends, and why is shown.
    app.object_read(Some(1), "60F4", &answer("profile velocity"), at(100));
    assert!(app.object.is_none() && app.news.last().is_some_and(|news| news.text.contains("is not a number")));
    typed(&mut app, "7000");
    app.object_read(
        Some(1),
        "7000",
        &json!({ "ok": false, "error": { "kind": "x", "message": "there is none" } }),
        at(110),
    );
    assert!(app.object.is_none() && app.news.last().is_some_and(|news| news.text.contains("there is none")));
    // Stop stops while it is typed, and Enter alone plots none.
    app.key(key(KeyCode::Char('o')), at(0));
    assert_eq!(app.key(key(KeyCode::Char(' ')), at(0)), [say(json!({ "do": "stop_all" }))]);
    assert!(app.typed.is_none());
    typed(&mut app, "6041");
    typed(&mut app, "");
    assert!(app.object.is_none() && app.look(at(200)).is_empty());
}

#[test]
fn more_nodes_than_lines_are_counted_and_a_request_for_the_shell_is_one() {
    let mut app = app();
    let mut many = state();
    many.nodes.extend((20..=36).map(|node| NodeView { node, ..NodeView::default() }));
    app.take(many.into());
    assert!(drawn(&app, 120, 40)[0].ends_with("  20 nodes, 1 faulted"), "{}", drawn(&app, 120, 40)[0]);
    let suspend = KeyEvent::new(KeyCode::Char('z'), KeyModifiers::CONTROL);
    assert_eq!(app.key(suspend, at(0)), [Action::Suspend]);
}

fn key(code: KeyCode) -> KeyEvent {
    KeyEvent::new(code, KeyModifiers::NONE)
}

fn at(ms: u64) -> Instant {
    Instant::from_millis(ms)
}

fn say(message: Value) -> Action {
    Action::Say(message)
}
