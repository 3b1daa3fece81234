//! The law `master_core` of `ferrodrive_tests::laws` under libFuzzer.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| ferrodrive_tests::laws::check("master_core", data));
