//! A machine file and the command line of `sim`, which make one machine.

use clap::FromArgMatches;
use machine::file::Machine;
use processes::scratch;

use super::virtual_bus::VirtualBus;
use crate::args::{Cli, Command};
use crate::scope::command_line;

/// The machine that a simulator of these words is of.
fn machine_of(words: &[&str]) -> Machine {
    let matches = command_line().try_get_matches_from([&["ferrodrive"], words].concat()).expect("a command line");
    let cli = Cli::from_arg_matches(&matches).expect("it was parsed");
    let global = cli.global.with_machine_file(&matches).expect("a machine file");
    let Command::Sim(sim) = &cli.command else { panic!("no simulator: {words:?}") };
    sim.machine(global.machine.as_ref()).expect("a machine")
}

#[test]
fn a_machine_file_and_the_command_line_put_drives_on_one_bus() {
    let folder = scratch("one-machine");
    let text = "bitrate = '250k'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nsupply_v = 30\n\
                [[drive]]\nmodel = 'zlim42c'\nnode = 2\nswitches = { X0 = ['min', 'max'] }\n";
    let file = folder.write("machine.toml", text);
    let models = ["--model", "4=zlac8030l", "--model", "1=m4230e17b50"];
    let bench =
        VirtualBus::of_machine(&machine_of(&["--machine", &file, "sim", "--drive", "m4230e17b50@1"])).with(&models);
    let [given, built_in, own] = [4, 2, 1].map(|node| bench.report(node).supply_v);
    assert!((given - 30.0).abs() < 0.5 && built_in < 25.0 && own > 35.0, "{given} V, {built_in} V, {own} V");
    assert_eq!(bench.json(&["read", "4", "200E"])["meaning"], "250 kbit/s");
    assert_eq!(bench.json(&["read", "1", "1000"])["value"], 0x2_0192);
    // Without --drive, and at the command line's own rate.
    let alone =
        VirtualBus::of_machine(&machine_of(&["--machine", &file, "sim", "--bitrate", "500k"])).with(&models[..2]);
    assert_eq!(alone.json(&["read", "4", "200E"])["meaning"], "500 kbit/s");
    alone.refused(&["read", "1", "1000"], &["node 1"]);
}
