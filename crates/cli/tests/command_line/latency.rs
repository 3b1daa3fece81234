//! `latency` on the embedded bus, whose times are exact.

use processes::{done, scratch};
use serde_json::Value;

/// Bits of a frame with 8 bytes and a standard identifier: 111 with its end of frame but without stuff bits, of which there are
/// at most 24 (ISO 11898-1), and 3 between frames.
const ANSWER_BITS: std::ops::RangeInclusive<f64> = 111.0..=111.0 + 24.0 + 3.0;

fn figure(report: &Value, what: &str, figure: &str) -> f64 {
    report[what][figure].as_f64().unwrap_or_else(|| panic!("{what} {figure} in {report}"))
}

#[test]
fn on_a_virtual_bus_an_answer_takes_what_its_frame_takes_and_sync_is_even() {
    let directory = scratch("latency");
    let file = directory.join("machine.toml");
    std::fs::write(&file, "bitrate = '500k'\ntiming = 'ideal'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n").unwrap();
    let (bus, svg) = (format!("sim:{}", file.display()), directory.join("latency.svg"));
    let arguments = ["--bus", &bus, "--json", "latency", "4", "--count", "40", "--svg", svg.to_str().unwrap()];
    let report = done(&arguments).json();
    assert_eq!((figure(&report, "sdo", "count"), figure(&report, "sdo", "lost")), (40.0, 0.0));
    for which in ["min_us", "median_us", "max_us"] {
        let bits = figure(&report, "sdo", which) / 2.0;
        assert!(ANSWER_BITS.contains(&bits), "{which}: {bits} bits");
    }
    assert!(figure(&report, "sync", "count") >= 40.0);
    // The first one may wait for a frame that is on the wire.
    for which in ["median_us", "max_us"] {
        assert!((figure(&report, "sync", which) - 10_000.0).abs() <= 10.0, "{report}");
    }
    assert_eq!(report["producer"], "this");
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg "));
}
