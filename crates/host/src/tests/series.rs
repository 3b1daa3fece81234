//! The values of objects over time.

use std::time::Duration;

use canopen::Mux;
use serde_json::{Value, json};

use super::{Stage, WHEEL, play, velocity};
use crate::command::SessionCommand;
use crate::trace::AskedSeries;

impl Stage {
    fn series(&self, asked: Value) -> Value {
        let asked: AskedSeries = serde_json::from_value(asked).expect("parameters");
        let query = asked.understand().expect("it makes sense");
        serde_json::to_value(query.values(&self.handle.trace().held())).expect("JSON")
    }
}

fn points(series: &Value) -> Vec<(f64, f64)> {
    let points = series["points"].as_array().expect("points").iter();
    points.map(|point| (point[0].as_f64().expect("a time"), point[1].as_f64().expect("a value"))).collect()
}

/// ZLAC8030L: 606Ch counts tenths of r/min. Each PDO is a sample with its own time.
#[test]
fn mapped_objects_and_objects_that_are_read_are_series() {
    play(async |stage| {
        let wheel = stage.network.node(WHEEL);
        wheel.write(Mux::new(0x1800, 1), 0x8000_0184_u32).await.expect("off");
        wheel.write(Mux::new(0x1A00, 0), 0_u8).await.expect("it is taken");
        wheel.write(Mux::new(0x1A00, 1), 0x606C_0020_u32).await.expect("it is taken");
        wheel.write(Mux::new(0x1A00, 0), 1_u8).await.expect("it is taken");
        wheel.write(Mux::new(0x1800, 2), 0x01_u8).await.expect("with each SYNC");
        wheel.write(Mux::new(0x1800, 1), 0x0184_u32).await.expect("on");
        wheel.nmt(canopen::NmtCommand::Start);
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        let begin = stage.series(json!({}))["to"].clone();
        let before = stage.network.now();
        stage.network.sync(Some(Duration::from_millis(5)));
        stage.sleep(500).await;
        let took_s = (stage.network.now() - before).as_secs_f64();
        let shown = stage.series(json!({ "objects": "4:606C:00,2:6064:0", "after": begin }));
        let series = shown["series"].as_array().expect("series");
        assert_eq!((&shown["skipped"], series.len()), (&0.into(), 2), "{shown}");
        let (arm, wheel) = (&series[0], &series[1]);
        assert_eq!((&arm["object"], &arm["name"]), (&"2:6064:00".into(), &"position_actual_value".into()));
        assert_eq!((&wheel["object"], &wheel["unit"]), (&"4:606C:00".into(), &"0.1 r/min".into()));
        let speeds = points(wheel);
        assert!(speeds.len() > 95, "each SYNC gives one, besides those that are read: {}", speeds.len());
        assert!(speeds.is_sorted_by(|a, b| a.0 <= b.0));
        let span_s = speeds[speeds.len() - 1].0 - speeds[0].0;
        assert!((span_s - took_s).abs() < 0.05, "{span_s} of {took_s}");
        let last = speeds[speeds.len() - 1].1;
        assert!((last - 600.0).abs() < 60.0, "60 r/min is 600: {last}");
        let all = stage.series(json!({}));
        let known: Vec<_> = all["series"].as_array().expect("series").iter().map(|one| &one["object"]).collect();
        assert!(known.contains(&&json!("4:603F:00")) && known.contains(&&json!("2:6041:00")), "{known:?}");
    });
}

#[test]
fn a_text_that_is_not_an_object_is_refused() {
    for wrong in ["606C", "4:606C", "0:606C:00", "4:606G:00", "4:606C:100", "4:606C:00:1"] {
        let asked: AskedSeries = serde_json::from_value(json!({ "objects": wrong })).expect("parameters");
        let refused = asked.understand().expect_err("it is not valid");
        assert!(refused.contains("expected"), "{refused}");
    }
    let many = vec!["4:606C:00"; 33].join(",");
    let asked: AskedSeries = serde_json::from_value(json!({ "objects": many })).expect("parameters");
    assert!(asked.understand().expect_err("too many").contains("at most 32"));
}
