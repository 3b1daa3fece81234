//! Node-ID and bit rate: switches, 2008h, 2009h, and when they take effect.

use can::Bitrate;
use ferrodrive_tests::bench::boot_up_of;
use ferrodrive_tests::zlim42c::{figure, figures};
use sim::VirtualDrive;
use sim::machine::zlim42c;

use crate::virtual_zlim42c::bench::{Bench, RATE_500K};

#[test]
fn the_switches_give_1_to_15_as_the_table_has_it_and_stored_numbers_from_32_on_are_used_and_others_give_node_1() {
    let table = figures().into_iter().filter(|row| row.table == "address" && row.row != "0").map(|row| {
        // 4.1: SW2 is the lowest; OFF counts.
        let address = row.value.split(' ').enumerate().map(|(n, switch)| u8::from(switch == "OFF") << n).sum::<u8>();
        (address, row.row.parse().expect("an address"))
    });
    for (set, used) in table.chain([(32, 32), (100, 100), (127, 127), (16, 1), (31, 1)]) {
        let boot_up = boot_up_of(zlim42c(set, RATE_500K), Bitrate::K500);
        assert_eq!(boot_up, Some(format!("{:03X}#00", 0x700 + used)), "switches or 2008h = {set}");
    }
}

#[test]
fn another_node_number_takes_effect_with_the_next_start_unless_the_switches_decide() {
    let mut machine = Bench::new();
    machine.set(0x2008, 42).reads(0x2000, 1);
    machine.let_store().power_cycle();
    // The bench's drive has its switches at 1: they decide.
    machine.reads(0x2000, 1).reads(0x2008, 42);

    let mut bench = Bench::with(vec![Box::new(zlim42c(32, RATE_500K))]);
    bench.node = 32;
    bench.set(0x2008, 33).run_ms(10).forget().offer("000#8120").run_ms(10).hears(&["721#00"]);
    // 4.1: 0 to 31 are undefined.
    bench.node = 33;
    bench.set(0x2008, 31).run_ms(10).forget().offer("000#8121").run_ms(10).hears(&["701#00"]);
}

#[test]
fn every_bit_rate_of_the_table_takes_effect_with_the_next_start() {
    for number in 0..7_i64 {
        let mut bench = Bench::new();
        bench.set(0x2009, number).let_store();
        assert_eq!(bench.operate(|drive, _| drive.bitrate()), Some(Bitrate::K500));
        bench.power_cycle();
        let rate = bench.operate(|drive, _| drive.bitrate()).expect("it has power");
        let expected = figure("bit_rate", &number.to_string(), "rate") * 1e3;
        assert_eq!(f64::from(rate.bits_per_second()), expected, "2009h = {number}");
    }
}

#[test]
fn both_lengths_are_models_of_their_own() {
    let names: Vec<_> = devices::all().iter().map(|model| model.name).collect();
    assert!(names.contains(&"zlim42c") && names.contains(&"zlim42c-82"));
    assert_eq!(zlim42c(1, RATE_500K).model(), "zlim42c");
    assert_eq!(sim::machine::zlim42c_82(1, RATE_500K).model(), "zlim42c-82");
}
