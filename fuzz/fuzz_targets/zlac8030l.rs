//! The law `zlac8030l` of `ferrodrive_tests::laws` under libFuzzer.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| ferrodrive_tests::laws::check("zlac8030l", data));
