//! Scenario and machine files: any text is taken, or refused with places that are in it; and what is taken can be begun.

use std::path::Path;

use machine::file::Machine;
use scenario::{Runner, Scenario};
use words::document::BadFile;

pub(super) const SAMPLES: &[&[u8]] = &[
    b"title = 'a'\nlimit = '2s'\n[machine]\nbitrate = '500k'\nseed = 3\nrealism = 'full'\n[[machine.drive]]\nmodel = 'zlac8030l'\n\
      node = 4\nsupply_v = 48\nload = { torque_nm = 0.5, inertia_kg_m2 = 0.01 }\noptions = { 2014 = '{amps}' }\n\
      [parameters]\namps = 100\n[sweep]\namps = { from = 50, to = 150, step = 50 }\n[figures]\npeak = 'peak 4 current'\n\
      [[step]]\nname = 's'\nwhen = '4 velocity > 5'\nwithin = '1s'\ndelay = '10ms'\ndo = ['4 supply 20', 'bus corrupt 0.1']\n\
      [[host]]\nstart = '500ms'\ndo = ['4 velocity 60rpm', { do = '4 read 603F', is = 0, within = '1s' }, 'wait for done s']\n\
      [[expect]]\nthat = '4 fault and not 4 powered'\nafter = 's'\nwithin = '1s'\n[[expect]]\nnever = 'frame 084#1032..'\n",
    b"machine = { drive = [{ model = 'm4230e17b50', node = 1, battery = false, switches = { PU = ['min', -5] } }] }\n\
      [[step]]\nat = '0s'\ndo = '1 bus late 5 20'\n[[step]]\nafter = 'host'\ndo = 'host die'\n\
      [[host]]\ndo = ['sync 10ms', '1 nmt reset', 'send 601#4041600000000000', 'all nmt start', '1 home 17 within 1s']\n\
      [[expect]]\nalways = '1 powered'\nat = '3s'\n",
    b"bitrate = '1M'\n[[drive]]\nmodel = 'cia402'\nnode = 5\nfaults = ['encoder']\nrotor_locked = true\n\
      temperatures_c = { motor = 95 }\ninputs = { X0 = true }\nsupply = { voltage_v = 36, limit_a = 10, resistance_ohm = 0.2 }\n",
];

/// Steps of the world that a scenario is followed for: it may be one that takes a day.
const STEPS: usize = 300;

pub(super) fn scenario(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Machine::parse(&text) {
        Ok(machine) => drop(machine.build()),
        Err(bad) => assert_placed(&bad, &text),
    }
    let scenario = match Scenario::parse(&text, Path::new("/nowhere")) {
        Ok(scenario) => scenario,
        Err(bad) => return assert_placed(&bad, &text),
    };
    let Ok(mut runner) = Runner::new(&scenario, None) else { return };
    for _ in 0..STEPS {
        if !runner.step() {
            break;
        }
    }
    let outcome = runner.conclude();
    assert!(outcome.end <= Runner::new(&scenario, None).map_or(outcome.end, |runner| runner.limit()));
    assert!(!outcome.to_junit().contains('\u{1b}'));
}

/// Something is wrong, at a line that there is, and its mark is within the line or just behind it.
fn assert_placed(bad: &BadFile, text: &str) {
    assert!(!bad.problems.is_empty());
    for problem in &bad.problems {
        let line = text.split('\n').nth(problem.line - 1);
        let length = line.unwrap_or_else(|| panic!("no line {} in {text:?}", problem.line)).chars().count();
        assert!(problem.column <= length + 1, "{problem:?}");
    }
    assert!(bad.to_string().len() < 200_000, "a message too long to read");
}
