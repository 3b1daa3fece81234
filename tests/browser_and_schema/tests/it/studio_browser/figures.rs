//! What the page costs on a busy bus: twelve objects of three drives, each a thousand times a second.
//!
//! A few seconds in the tests. With `FERRODRIVE_FIGURES_S=600` ten minutes, and what it says is for `docs/performance.md`:
//!
//! `FERRODRIVE_FIGURES_S=600 cargo test -p ferrodrive-browser-and-schema figures -- --ignored --nocapture`

use std::collections::BTreeMap;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use super::{Locator, PATIENCE, Stage, Studio};
use processes::{Simulator, command, done, wait_until};

/// As long as it takes in the tests.
const SHORT: Duration = Duration::from_secs(5);

/// What is looked at in what is saved.
const LAST: Duration = Duration::from_secs(3);

/// What is drawn: of each of three drives on the two channels of their TPDOs four objects.
const NODES: [u8; 3] = [1, 2, 3];
const OBJECTS: [&str; 4] = ["6064:00", "606C:00", "6077:00", "6041:00"];

/// In the page: counts how often the browser could draw, and how often the scope did, from now on.
const COUNT_FRAMES: &str = "window.frames_ = 0; window.drawn = 0; \
    const count = () => { window.frames_ += 1; requestAnimationFrame(count); }; count(); \
    const pen = CanvasRenderingContext2D.prototype; const clear = pen.clearRect; \
    performance.setResourceTimingBufferSize(5000); performance.clearResourceTimings(); \
    pen.clearRect = function (...area) { window.drawn += 1; clear.apply(this, area); };";

/// In the page: how many requests for what has passed since the one before began while another was on its way, of those from
/// [`COUNT_FRAMES`] on.
const SERIES_AT_ONCE: &str = "const asked = performance.getEntriesByType('resource').filter(({ name }) => /api\\/series.*after=/.test(name)); \
    asked.sort((one, other) => one.startTime - other.startTime); \
    return asked.length < 2 ? null : asked.filter((one, at) => at && one.startTime < asked[at - 1].responseEnd).length;";

/// From the beginning of the page's loading, in ms.
const FIRST_PICTURE: &str = "return performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null";

struct Bus {
    _simulator: Simulator,
    address: String,
    turning: Vec<Child>,
}

impl Drop for Bus {
    fn drop(&mut self) {
        for command in &mut self.turning {
            let _ = command.kill();
            let _ = command.wait();
        }
    }
}

/// Three ZLAC8030L that turn, and whose event timers bring two TPDOs each millisecond: 6,000 frames a second on 1 Mbit/s.
fn busy_bus() -> Bus {
    let drives = NODES.map(|node| format!("zlac8030l@{node}"));
    let mut arguments = vec!["--bitrate", "1M", "--serve", "socketcand://127.0.0.1:0"];
    for drive in &drives {
        arguments.extend(["--drive", drive.as_str()]);
    }
    let mut simulator = Simulator::start(&arguments);
    let address = simulator.bus("socketcand");
    for node in NODES.map(|node| node.to_string()) {
        let set = ["--bus", &address, "pdo", "apply", &node, "tpdo1=6064,606C", "tpdo2=6077,6041", "--event", "1ms"];
        done(&[&set[..], &["--type", "255"]].concat());
    }
    let mut turning = Vec::new();
    for node in NODES.map(|node| node.to_string()) {
        let turn = ["--bus", &address, "velocity", &node, "60rpm", "--for", "7200s"];
        let turn = command(&turn).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        turning.push(turn.expect("it starts"));
        // The next client has to be the only one: an SDO channel has one client (CiA 301, 7.2.4.3).
        let is_turning = |simulator: &mut Simulator| {
            simulator.ask(&format!("{node} get"))["velocity_rpm"].as_f64().is_some_and(|rpm| rpm > 50.0)
        };
        wait_until(&format!("node {node} turns"), || is_turning(&mut simulator));
    }
    Bus { _simulator: simulator, address, turning }
}

/// Processor time in s that a process and all that it started have taken, and the memory that they have to themselves in MB
/// (`proc_pid_stat(5)`, `proc_pid_smaps_rollup`).
fn taken(root: u32) -> (f64, f64) {
    let mut parents = BTreeMap::new();
    for entry in std::fs::read_dir("/proc").expect("/proc").flatten() {
        let Some(process) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
        let Ok(stat) = std::fs::read_to_string(entry.path().join("stat")) else { continue };
        // The name may have anything in it but this.
        let Some((_, fields)) = stat.rsplit_once(')') else { continue };
        let fields: Vec<&str> = fields.split_whitespace().collect();
        let number = |place: usize| fields.get(place).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
        parents.insert(process, (number(1) as u32, number(11) + number(12)));
    }
    let is_of = |mut process: u32| {
        while process != root {
            match parents.get(&process) {
                Some((parent, _)) if *parent > 1 => process = *parent,
                _ => return false,
            }
        }
        true
    };
    let mut sum = (0.0, 0.0);
    for (process, (_, ticks)) in parents.iter().filter(|(process, _)| is_of(**process)) {
        let rollup = std::fs::read_to_string(format!("/proc/{process}/smaps_rollup")).unwrap_or_default();
        let pss = rollup.lines().find_map(|line| line.strip_prefix("Pss:")).unwrap_or("0 kB");
        // 100 ticks in a second, whatever the kernel's own are (`getconf CLK_TCK`).
        sum.0 += ticks / 100.0;
        sum.1 += pss.trim().trim_end_matches(" kB").parse::<f64>().unwrap_or(0.0) / 1e3;
    }
    sum
}

async fn number(stage: &Stage, script: &str) -> f64 {
    stage.client.execute(script, vec![]).await.expect("it runs").as_f64().unwrap_or(f64::NAN)
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
#[allow(clippy::print_stdout, reason = "what it measures is what it is for")]
async fn figures_of_twelve_objects_a_thousand_times_a_second() {
    let asked = std::env::var("FERRODRIVE_FIGURES_S").ok().and_then(|text| text.parse().ok());
    let length = asked.map_or(SHORT, Duration::from_secs);
    let bus = busy_bus();
    // A measurement over time.
    let start = Instant::now();
    drop(Studio::start(&["--bus", &bus.address]));
    // A measurement over time.
    let address_ms = start.elapsed().as_secs_f64() * 1e3;
    // A scan waits as long for nodes that are not there.
    let stage = Stage::open_on("figures", &["--timeout", "15s", "--bus", &bus.address]).await;
    let picture_ms = number(&stage, FIRST_PICTURE).await;
    done(&["--bus", &bus.address, "nmt", "all", "start"]);
    stage.click("#tabs [data-name=scope]").await;
    for node in NODES {
        for object in OBJECTS.map(|object| format!("{node}:{object}")) {
            stage.choose("#scope-object", &object).await;
            stage.find(&format!("[data-object='{object}']")).await;
        }
    }
    // Each minute, and at the end.
    stage.client.execute(COUNT_FRAMES, vec![]).await.expect("it runs");
    let (studio, browser) = (stage.studio.child.id(), stage.driver.id());
    // A measurement over time.
    let began = Instant::now();
    let counted = async || (number(&stage, "return window.frames_").await, number(&stage, "return window.drawn").await);
    let mut before = (0.0, taken(studio).0, taken(browser).0, counted().await);
    let mut pictures_per_s = 0.0;
    // A measurement over time.
    while began.elapsed() < length {
        // A measurement over time.
        tokio::time::sleep((length - began.elapsed()).min(Duration::from_mins(1))).await;
        let (of_studio, of_browser) = (taken(studio), taken(browser));
        // A measurement over time.
        let now = (began.elapsed().as_secs_f64(), of_studio.0, of_browser.0, counted().await);
        let span_s = now.0 - before.0;
        let frames_per_s = (now.3.0 - before.3.0) / span_s;
        pictures_per_s = (now.3.1 - before.3.1) / span_s;
        let share = |from: f64, to: f64| 100.0 * (to - from) / span_s;
        println!(
            "{:5.0} s: studio {:5.1} % of a core, {:5.1} MB; browser {:5.1} %, {:5.1} MB; {:4.1} frames a second, the scope drawn in {:4.1}",
            now.0,
            share(before.1, now.1),
            of_studio.1,
            share(before.2, now.2),
            of_browser.1,
            frames_per_s,
            pictures_per_s
        );
        before = now;
    }
    println!(
        "address {address_ms:.0} ms after the program was started, first picture {picture_ms:.0} ms after it was asked for"
    );
    assert!(picture_ms > 0.0 && pictures_per_s > 0.0, "it draws");
    stage.shoot("figures").await;
    assert_eq!(number(&stage, SERIES_AT_ONCE).await, 0.0, "one request at a time, for all objects");
    until_every_object_is_saved(&stage).await;
    let is_reported = stage.client.find(Locator::XPath("//*[contains(., 'are not drawn')]")).await;
    println!("frames that were too many: {}", is_reported.is_ok());
    stage.close().await;
}

/// Saves what is shown until every object is there: a page that gets little of the machine is answered late.
async fn until_every_object_is_saved(stage: &Stage) {
    // The watchdog's.
    let until = Instant::now() + PATIENCE;
    loop {
        stage.click("#scope-pause").await;
        stage.click("#scope-save").await;
        let file = stage.saved("node1.csv").await;
        let saved = std::fs::read_to_string(&file).expect("text");
        let Some(missed) = missed(&saved) else { return };
        // The watchdog's.
        assert!(Instant::now() < until, "{missed}");
        std::fs::remove_file(&file).expect("it is there");
        stage.click("#scope-pause").await;
        // A measurement over time.
        tokio::time::sleep(LAST).await;
    }
}

/// What is missing: of an object that comes each millisecond there are far more samples than the studio reads by itself (nine a second),
/// and all twelve are there. How many more depends on the machine: the simulator, the studio and the browser share it.
fn missed(saved: &str) -> Option<String> {
    let mut lines = saved.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let title = lines.next().expect("titles");
    let rows: Vec<Vec<&str>> = lines.collect();
    let objects = NODES.iter().flat_map(|node| OBJECTS.map(|object| format!("{node}.{}", object.replace(':', "_"))));
    objects.into_iter().find_map(|object| {
        let Some(column) = title.iter().position(|name| *name == object) else {
            return Some(format!("{object}: {title:?}"));
        };
        let times = rows.iter().filter(|row| !row[column].is_empty());
        let times: Vec<f64> = times.map(|row| row[0].parse().expect("a time")).collect();
        // Before the nodes were started only the studio's own readings came.
        let last_s = times[times.len() - 1];
        let count = times.iter().filter(|time| **time > last_s - LAST.as_secs_f64()).count();
        let expected = 0.1 * LAST.as_secs_f64() / 1e-3;
        (count as f64 <= expected)
            .then(|| format!("{object}: {count} in the last {LAST:?}, more than {expected} expected"))
    })
}
