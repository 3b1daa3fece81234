//! What lines of a host and conditions of a scenario mean, seen in what they do to a drive.

use std::path::Path;

use scenario::{Outcome, Runner, Scenario, Verdict};

const MACHINE: &str = "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\n";

fn run(rest: &str) -> Outcome {
    run_whole(&format!("{MACHINE}{rest}"))
}

fn run_whole(text: &str) -> Outcome {
    let scenario = Scenario::parse(text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run()
}

/// Verdict and what was seen of the row that asks this.
#[track_caller]
fn row<'a>(outcome: &'a Outcome, asked: &str) -> (Verdict, &'a str) {
    let row = outcome.rows.iter().find(|row| row.asked.starts_with(asked));
    row.map(|row| (row.verdict, row.seen.as_str())).unwrap_or_else(|| panic!("no row {asked:?} in {:#?}", outcome.rows))
}

/// Objects and units: ZLAC8030L CANopen communication of motor drive V1.00: 60FFh in r/min, 606Ch in 0.1 r/min.
#[test]
fn process_data_turns_a_wheel_with_each_sync_and_shows_its_speed() {
    let outcome = run(
        "[[host]]\ndo = ['4 write 6060 3', '4 nmt pre-operational', '4 pdo map rpdo 1 6040 60FF type 1', \
         '4 pdo map tpdo 1 6041 606C type 1', '4 nmt start', 'sync 10ms', '4 pdo write 6040 6', 'wait 50ms', \
         '4 pdo write 6040 7', 'wait 50ms', '4 pdo write 6040 15', 'wait for 4 event state operation-enabled', '4 pdo write 60FF 60', \
         'wait for 4 event target reached', 'wait 200ms', { do = '4 pdo read 606C', is = 600, tolerance = 20 }, \
         { do = '4 pdo write 6081 5', fails = 'no RPDO' }, { do = '4 pdo read 6064', fails = 'no TPDO' }]\n\
         [[expect]]\nthat = '4 velocity = 60 +- 2'\n[[expect]]\nnever = '4 event fault'\n",
    );
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

#[test]
fn a_pdo_is_taken_as_the_device_has_it_and_what_cannot_be_mapped_is_refused() {
    let outcome = run(
        "[[host]]\ndo = ['4 pdo adopt tpdo 1', '4 pdo map tpdo 2 6041 606C', { do = '4 pdo adopt tpdo 2', name = 'mapped' }, { do = '4 pdo map tpdo 1 6064 6064 6064', fails = '64 bits' }, \
         { do = '4 pdo map tpdo 1 no_such_object', fails = 'no_such_object' }]\n",
    );
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    // As delivered its TPDO 1 is empty (ZLAC8030L CANopen communication of motor drive V1.00: 1A00h).
    assert_eq!(row(&outcome, "4 pdo adopt tpdo 1").1, "TPDO1 carries nothing");
    assert_eq!(row(&outcome, "4 pdo adopt tpdo 2").1, "TPDO2 carries 6041h:00, 606Ch:00");
}

#[test]
fn events_happen_once_each_and_are_reported_with_the_time_at_which_they_do() {
    let outcome = run("[[step]]\nname = 'low'\nat = '1s'\ndo = '4 supply 12'\n\
         [[step]]\nname = 'heard'\nwhen = '4 event fault 0x0002'\ndelay = '10ms'\ndo = '4 supply 48'\n\
         [[expect]]\nthat = 'event stimulus supply'\nafter = 'low'\n\
         [[expect]]\nthat = '4 event fault 2'\nafter = 'low'\nwithin = '200ms'\n\
         [[expect]]\nthat = '4 event fault 0x0001'\nafter = 'heard'\nwithin = '100ms'\n\
         [[expect]]\nnever = '4 event fault'\nafter = 'heard'\nuntil = '2s'\n\
         [[expect]]\nthat = '4 event boot and 4 powered'\n");
    // An event before the expectation begins does not count, and a fault that stays does not come again.
    let failed: Vec<_> = outcome.failures().map(|row| (row.asked.as_str(), row.seen.as_str())).collect();
    assert_eq!(failed, [("4 event fault 0x0001", "no such event")], "{:#?}", outcome.rows);
    assert_eq!(row(&outcome, "4 event fault 2"), (Verdict::Passed, "node 4: fault 0002h, under-voltage"));
}

#[test]
fn a_world_is_the_same_whether_its_events_are_heard_or_not() {
    let digest =
        |expect: &str| run(&format!("end = '2s'\n[[host]]\ndo = ['4 velocity 60rpm']\n[[expect]]\n{expect}\n")).digest;
    assert_eq!(digest("that = '4 event target reached'"), digest("that = '4 velocity > 5'"));
}

#[test]
fn a_body_that_drives_move_is_a_machine_that_steps_act_on() {
    let machine = "[machine]\ndrive = [{ model = 'zlac8030l', node = 4 }, { model = 'zlac8030l', node = 5 }]\n\
                   [[machine.body]]\nname = 'base'\nkind = 'differential-drive'\ndrives = [4, 5]\nturns = [1, -1]\n\
                   mass_kg = 40\nwheel_base_m = 0.5\nwheel_radius_m = 0.08\n";
    let text = |name: &str| format!("{machine}[[step]]\nat = '1s'\ndo = 'body {name} slope 5'\n");
    let parse = |text: &str| Scenario::parse(text, Path::new(""));
    if let Err(bad) = parse(&text("bse")) {
        assert!(bad.to_string().contains("the machine has no body \"bse\"; it has: base"), "{bad}");
    } else {
        panic!("a body that is not there");
    }
    for (expect, said) in
        [("that = 'body bse x_m > 0'", "the machine has no body \"bse\""), ("that = 'body base x > 0'", "has no 'x'")]
    {
        let refused = parse(&format!("{}[[expect]]\n{expect}\n", text("base"))).err().map(|bad| bad.to_string());
        assert!(refused.as_ref().is_some_and(|refused| refused.contains(said)), "{expect}: {refused:?}");
    }
    // Down a slope of 5 degrees, uphill being along x, it rolls backwards: nothing holds it.
    let expects = "[[expect]]\nthat = 'body base x_m < -0.01'\n[figures]\nway = 'last body base x_m'\n";
    let scenario = parse(&format!("end = '3s'\n{}{expects}", text("base"))).unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// Two free wheels under a base: m g (sin - rolling cos) less the dry friction of both wheels moves its mass and the wheels'.
#[test]
fn a_step_that_tilts_the_ground_rolls_a_base_down_and_one_that_levels_it_lets_it_slow_down() {
    const RADIUS_M: f64 = 0.0865;
    // The hub motor's rotor inertia in kg·m² and its friction, N·m and as much again at 27.4 rad/s (no-load current of its data sheet).
    let (weight_n, dry_n, viscous_n_s) =
        (30.0 * 9.806_65, 2.0 * 0.099 / RADIUS_M, 2.0 * 0.099 / 27.4 / (RADIUS_M * RADIUS_M));
    let mass_kg = 30.0 + 2.0 * 0.014 / (RADIUS_M * RADIUS_M);
    // m v' = force - viscous v.
    let speed = |force_n: f64, from: f64, time_s: f64| {
        let end = force_n / viscous_n_s;
        end + (from - end) * (-viscous_n_s / mass_kg * time_s).exp()
    };
    let slope = 10_f64.to_radians();
    let rolled = -speed(weight_n * (slope.sin() - 0.01 * slope.cos()) - dry_n, 0.0, 0.5);
    let slowed = -speed(-weight_n * 0.01 - dry_n, -rolled, 1.0);
    let text = format!(
        "[machine]\ndrive = [{{ model = 'zlac8030l', node = 4 }}, {{ model = 'zlac8030l', node = 5 }}]\n\
         [[machine.body]]\nname = 'base'\nkind = 'differential-drive'\ndrives = [4, 5]\nturns = [1, -1]\nmass_kg = 30\n\
         yaw_inertia_kg_m2 = 1.5\nwheel_base_m = 0.5\nwheel_radius_m = {RADIUS_M}\nrolling = 0.01\n\
         [[step]]\nname = 'tilted'\nat = '1s'\ndo = 'body base slope 10'\n\
         [[step]]\nat = '1500001us'\ndo = 'body base slope 0'\n\
         [[expect]]\nat = '999ms'\nthat = 'body base x_m = 0'\n\
         [[expect]]\nat = '1500ms'\nthat = 'body base speed_m_s = {rolled} +- 0.007'\n\
         [[expect]]\nat = '2500ms'\nthat = 'body base speed_m_s = {slowed} +- 0.007'\n"
    );
    let scenario = Scenario::parse(&text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    let refused = Scenario::parse(&text.replace("slope 0", "slop 0"), Path::new("")).err().map(|bad| bad.to_string());
    assert!(refused.is_some_and(|said| said.contains("body NAME slope|grip|mass|payload VALUE")));
}

/// Two joints behind a gear, in cycles of 2 ms, and what their host does.
fn arm(rest: &str) -> Result<Scenario, String> {
    let joint = |node| format!("{{ model = 'm8025e25b50', node = {node}, units = {{ gear_ratio = 50 }} }}");
    let axis = |node| {
        format!(
            "{{ node = {node}, velocity_deg_s = 60, acceleration_deg_s2 = 120, jerk_deg_s3 = 1200, following_error_deg = 5 }}"
        )
    };
    let text = format!(
        "[machine]\nbitrate = '1M'\ndrive = [{}, {}]\ngroup = [{{ name = 'arm', period = '2ms', axis = [{}, {}] }}]\n{rest}",
        joint(1),
        joint(2),
        axis(1),
        axis(2)
    );
    Scenario::parse(&text, Path::new("")).map_err(|bad| bad.to_string())
}

/// The output behind the gear: 262144 counts of a joint for one turn of its own shaft, 50 of these for one of the output.
#[test]
fn a_group_moves_as_one_and_a_line_sees_it_arrive() {
    let scenario =
        arm("[[host]]\nname = 'moved'\ndo = ['group move 1=9deg 2=-4.5deg within 2s', 'group move by 2=4.5deg']\n\
                        [[expect]]\nafter = 'moved'\nthat = '1 velocity = 0 +- 0.5'\n")
        .unwrap();
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    let (verdict, seen) = row(&outcome, "group move 1=9deg");
    assert!(verdict == Verdict::Passed && seen.starts_with("2 axes moved together in 2 s"), "{seen}");
}

#[test]
fn a_cable_that_is_cut_in_a_move_stops_the_group() {
    let scenario = arm("[[step]]\nat = '1.5s'\ndo = '2 cable cut'\n\
                        [[host]]\ndo = [{ do = 'group move 1=30deg 2=30deg within 4s', fails = 'node 2' }]\n\
                        [[expect]]\nfrom = '2.5s'\nuntil = '3s'\nalways = '1 velocity = 0 +- 0.5'\n")
    .unwrap();
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// A joint has 32768 counts for a turn, and 50 turns for one of the output: 2^31 of them are 1310.72 turns, 471859.2 deg.
#[test]
fn a_position_that_no_drive_counts_to_is_refused_before_anything_moves() {
    let scenario = arm("[[host]]\ndo = [{ do = 'group move 1=1e9deg', fails = '471859.2 deg either way' }, \
                        { do = 'group move by 2=-471860deg', fails = 'axis 2 would go to -471860 deg' }, \
                        { do = 'group move 2=2147483649counts', fails = 'either way' }]\n\
                        [[expect]]\nalways = '1 velocity = 0 and not 1 state operation-enabled'\n")
    .unwrap();
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// By 9 and -4.5 deg in 2 s as t - sin(t): a set-point in each cycle of 2 ms between points of 20 ms.
#[test]
fn a_recorded_path_is_followed_and_one_that_is_not_usable_is_refused_before_the_run() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let part = |time_s: f64| (time_s / 2.0) - (std::f64::consts::PI * time_s).sin() / std::f64::consts::TAU;
    let rows = (0..=100).map(|row| {
        let time_s = f64::from(row) * 0.02;
        format!("{time_s:.2},{},{}\n", 9.0 * part(time_s), -4.5 * part(time_s))
    });
    let path = format!("t_s,1.angle_deg,2.angle_deg\n{}", rows.collect::<String>());
    let file = |name: &str| folder.join(name).display().to_string();
    std::fs::write(file("path.csv"), &path).unwrap();
    std::fs::write(file("strange.csv"), path.replace("2.angle", "9.angle")).unwrap();
    std::fs::write(file("torn.csv"), path.trim_end()).unwrap();
    let lines = |lines: &str| arm(&format!("[[host]]\nname = 'moved'\ndo = [{lines}]\n{BOTH_STAND}"));
    let path = file("path.csv");
    let followed = lines(&format!("'group follow {path} by hold 1s'")).unwrap();
    let away = lines(&format!("'group move 1=3deg 2=0deg', {{ do = 'group follow {path}', fails = 'node 1 stands at 3' }}, 'group follow {path} approach'")).unwrap();
    let refused = [
        ("strange.csv", "these nodes are not in one [[group]]"),
        ("torn.csv", "its last line has no end"),
        ("none.csv", "cannot be followed"),
    ]
    .map(|(name, said)| (lines(&format!("'group follow {} by'", file(name))).err().unwrap_or_default(), said));
    for scenario in [&followed, &away] {
        let outcome = Runner::new(scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
        assert!(outcome.passed(), "{:#?}", outcome.rows);
        let (_, seen) = row(&outcome, "group follow");
        assert!(seen.starts_with("2 axes followed the path in 2 s") || seen.contains("does not begin"), "{seen}");
    }
    for (what, said) in refused {
        assert!(what.contains(said), "{what}");
    }
}

const BOTH_STAND: &str = "[[expect]]\nafter = 'moved'\nthat = '1 velocity = 0 +- 0.5 and 2 velocity = 0 +- 0.5'\n";

#[test]
fn a_group_that_is_not_there_is_refused_before_the_run() {
    for (line, said) in [
        ("group move 9=30deg", "the machine has no node 9; it has: 1, 2"),
        ("group move 1=30deg of leg", "there is no group 'leg': the machine file has: arm"),
        ("group move 1=30", "'30' has no unit"),
        ("group fly", "expected: group move [by] NODE=POSITION.."),
    ] {
        let refused = arm(&format!("[[host]]\ndo = ['{line}']\n")).err().unwrap_or_default();
        assert!(refused.contains(said), "{line}: {refused}");
    }
}

/// A base of two wheels as a machine, and what its host does.
fn base(rest: &str) -> Result<Scenario, String> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    Scenario::parse(&format!("machine = 'base.toml'\n{rest}"), &examples).map_err(|bad| bad.to_string())
}

/// Ramps up and down take as long: 0.3 m/s for 2 s are 0.6 m, and 0.5 rad/s for 1 s half a radian.
#[test]
fn a_base_goes_by_its_twist_and_stands_where_it_says() {
    let scenario = base(
        "[[host]]\nname = 'gone'\ndo = ['drive-base linear 0.3 for 2s', 'drive-base angular 0.5 for 1s']\n\
         [[expect]]\nafter = 'gone'\nthat = 'body base x_m = 0.6 +- 0.01 and body base heading_deg = 28.6 +- 1'\n\
         [[expect]]\nafter = 'gone'\nalways = '4 velocity = 0 +- 0.5 and 5 velocity = 0 +- 0.5'\n",
    )
    .unwrap();
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    let (_, seen) = row(&outcome, "drive-base linear 0.3");
    assert!(seen.starts_with("it stands at x 0.6") || seen.starts_with("it stands at x 0.59"), "{seen}");
}

#[test]
fn a_wheel_that_is_lost_stops_the_base_and_its_line_fails() {
    let scenario = base(
        "[[step]]\nwhen = '4 velocity > 20'\ndo = '5 cable cut'\n\
         [[host]]\ndo = [{ do = 'drive-base linear 0.3 for 5s', fails = 'node 5' }]\n\
         [[expect]]\nfrom = '4s'\nuntil = '4.5s'\nalways = '4 velocity = 0 +- 0.5'\n",
    )
    .unwrap();
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// The machine's settings are in the drive after the boot-up (1017h and 6083h as the file has them), and a drive that is not there
/// fails it.
#[test]
fn a_machine_is_booted_as_its_file_says() {
    let machine =
        "[machine]\ndrive = [{ model = 'zlac8030l', node = 4, heartbeat = '200ms', start_up = { 6083 = 700 } }]\n";
    let lines = "[[host]]\ndo = [{ do = '4 read 6083', is = 500 }, 'boot', { do = '4 read 6083', is = 700 }, { do = '4 read 1017', is = 200 }, \
                 '4 params verify', 'boot', 'boot node 4 reset']\n\
                 [[step]]\nname = 'off'\nafter = 'host'\ndo = '4 power off'\n\
                 [[host]]\ndo = ['wait for done off', 'wait 2s', { do = 'boot', fails = 'node 4' }]\n";
    let scenario = Scenario::parse(&format!("{machine}{lines}"), Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

#[test]
fn parameters_of_a_file_are_written_checked_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("wheel.toml"), "[values]\n2000 = 700\n1017 = 200\n").unwrap();
    let text = "[machine]\ndrive = [{ model = 'zlac8030l', node = 4 }]\n\
                [[host]]\ndo = [{ do = '4 params verify wheel.toml', fails = '2000h:00 is 1000 ms, not 700 ms' }, '4 params apply wheel.toml save', \
                '4 params verify wheel.toml', '4 nmt reset', '4 params verify wheel.toml', '4 params apply wheel.toml', \
                '4 enable', { do = '4 params apply wheel.toml', fails = 'nothing was written' }]\n";
    let scenario = Scenario::parse(text, folder.path());
    let scenario = scenario.unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// What a person measured in the studio is measured again; the shaft has its speed while a capture shows it, and no power after a test motion.
#[test]
fn captures_and_test_motions_measure_a_drive_and_put_its_pdos_back() {
    let outcome = run(
        "[[host]]\ndo = [{ do = '4 read 1A03:00', is = 0 }, '4 velocity 30rpm', '4 capture velocity 606C for 200ms rate 2ms', '4 stop', \
         '4 test-motion steps speed 60rpm time 500ms count 2', '4 test-motion sine by 10deg frequency 2 periods 1', \
         { do = '4 capture mass for 1s', fails = 'mass' }, { do = '4 test-motion steps speed 20rpm time 5s travel 0.5', fails = 'turns from where it stood' }, \
         { do = '4 read 1A03:00', is = 0 }]\n[[expect]]\nafter = 'host'\nthat = '4 velocity = 0 +- 0.5 and 4 state switch-on-disabled'\n",
    );
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    let (_, seen) = row(&outcome, "4 capture velocity");
    let shown: Vec<&str> = seen.split("; ").collect();
    assert!(shown[0] == "101 rows" || shown[0] == "100 rows", "{seen}");
    for of in &shown[1..] {
        let values: Vec<f64> = of.split(' ').filter_map(|word| word.parse().ok()).collect();
        assert!(matches!(values[..], [low, high] if low > 28.0 && high < 32.0), "{seen}");
    }
    assert!(shown.len() == 3 && shown[1].starts_with("velocity_rpm "), "{seen}");
    let (_, seen) = row(&outcome, "4 test-motion steps speed 60rpm");
    assert!(seen.contains("rise, 0 to 60 r/min") && seen.contains("; run 2: rise, 0 to 60 r/min"), "{seen}");
    let (_, seen) = row(&outcome, "4 test-motion sine");
    assert!(seen.starts_with("run 1: following error"), "{seen}");
}

/// A PDO that was received before is received again, where a capture has taken it.
#[test]
fn a_capture_gives_back_what_was_received_before_it() {
    let outcome = run(
        "[[host]]\ndo = ['4 pdo map tpdo 1 6041 606C type 1', '4 nmt start', 'sync 10ms', '4 capture velocity for 100ms rate 10ms take tpdo1', \
         'sync 10ms', 'wait 100ms', { do = '4 pdo read 606C', is = 0, tolerance = 5 }]\n",
    );
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// Two hosts on one drive: what would take the other's PDOs is refused, a motion by SDO is not, nor a stop.
#[test]
fn a_drive_that_one_host_measures_is_not_measured_or_moved_in_cycles_by_another() {
    let outcome = run(
        "[[host]]\nname = 'captures'\ndo = ['4 capture velocity for 5s', { do = '4 read 1A03:00', is = 0 }, '4 test-motion sine by 10deg periods 2']\n\
         [[host]]\nstart = '2s'\ndo = [{ do = '4 capture current for 100ms', fails = 'node 4 is captured meanwhile' }, \
         { do = '4 test-motion steps', fails = 'is captured meanwhile' }, { do = '4 tune', fails = 'is captured meanwhile' }, '4 velocity 30rpm', '4 stop', '4 disable', \
         'wait for 4 velocity > 2 within 10s', { do = '4 velocity 30rpm', fails = 'makes a test motion' }]\n",
    );
    assert!(outcome.passed(), "{:#?}", outcome.rows);
}

/// 0.03 kg m² at the shaft, and the rotor: within 5 %. The drive has the gains then that its row names (201Dh).
#[test]
fn gains_are_found_for_a_drive_and_tried() {
    // A cycle of 1 ms takes a bus of 1 Mbit/s.
    let machine = MACHINE.replacen("drive =", "bitrate = '1M', drive =", 1);
    let outcome = run_whole(&format!(
        "{machine}[[step]]\nat = '0s'\ndo = '4 load inertia 0.03'\n[[host]]\ndo = ['4 tune speed 60rpm apply', '4 read 201D']\n",
    ));
    assert!(outcome.passed(), "{:#?}", outcome.rows);
    let (_, seen) = row(&outcome, "4 tune");
    let rotor = host::tune::motor_of(devices::model("zlac8030l").unwrap()).unwrap().rotor.inertia_kg_m2;
    let found: f64 = seen.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(f64::NAN);
    assert!((found / (rotor + 0.03) - 1.0).abs() < 0.05, "{seen}");
    let (_, read) = row(&outcome, "4 read 201D");
    let gain = read.split(' ').next().unwrap();
    assert!(
        seen.ends_with("tried on the drive, which has them") && seen.contains(&format!("201Dh:00 500 -> {gain};")),
        "{seen}: {read}"
    );
}

#[test]
fn a_base_a_node_and_a_file_that_are_not_there_are_refused_before_the_run() {
    for (line, said) in [
        ("drive-base linear 0.3 for 2s", "the machine has no [base]"),
        ("boot node 9", "the machine has no node 9; it has: 1, 2"),
        ("9 velocity 60rpm", "the machine has no node 9; it has: 1, 2"),
        ("9 tune", "the machine has no node 9; it has: 1, 2"),
        ("9 params verify", "the machine has no node 9; it has: 1, 2"),
        ("1 params apply missing.toml", "cannot read missing.toml as parameters"),
        ("1 params apply", "the machine file has no settings for node 1"),
    ] {
        let refused = arm(&format!("[[host]]\ndo = ['{line}']\n")).err().unwrap_or_default();
        assert!(refused.contains(said), "{line}: {refused}");
    }
    let refused = base("[[host]]\ndo = ['drive-base linear 3 for 2s']\n").err().unwrap_or_default();
    assert!(refused.contains("beyond the limits of [base]"), "{refused}");
}
