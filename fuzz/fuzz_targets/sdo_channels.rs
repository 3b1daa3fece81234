//! The law `sdo_channels` of `ferrodrive_tests::laws` under libFuzzer.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| ferrodrive_tests::laws::check("sdo_channels", data));
