//! First light: a drive boots, is enabled, turns, faults when its supply rises, and is explained; as an animated SVG.
//!
//! ```sh
//! # prints what happened; with a file, draws it as an SVG that moves by itself (`docs/first-light.svg` is one)
//! cargo run -p ferrodrive-examples --example first_light -- first-light.svg
//! ```
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::fmt::Write;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::PowerState;
use devices::zltech::ZLAC8030L;
use master::Network;
use master::drive::{Drive, MotionOptions};
use master::explain::Overheard;
use master::units::Rpm;
use sim::events::EventKind;
use sim::machine::TimingMode;
use sim::recorder::{Channel, Recorder, Signal};
use sim::stimulus::Place;
use sim::{World, machine};

/// The node-ID a ZLAC8030L is delivered with.
const NODE: u8 = 4;

/// 200Eh: number 1 stands for 500 kbit/s, as the drive is delivered.
const BAUD_RATE_500K: u16 = 1;

/// Between two samples; a browser draws what lies between.
const SAMPLING_PERIOD: Duration = Duration::from_millis(50);

/// How long the last frame stays before the animation restarts, in s.
const REST_S: f64 = 4.0;

/// Characters of a row of text in the picture.
const ROW: usize = 98;

const SIGNALS: [Signal; 3] = [Signal::ShaftAngle, Signal::Velocity, Signal::Supply];

/// What was seen.
pub(crate) struct Seen {
    /// Time in s, angle of the shaft in rad, speed in r/min, supply in V.
    samples: Vec<[f64; 4]>,
    /// When the drive entered which power state (CiA 402), s.
    states: Vec<(f64, PowerState)>,
    /// When what happened, s.
    lines: Vec<(f64, String)>,
    end_s: f64,
}

/// Goes through it in virtual time.
pub(crate) fn watch() -> Result<Seen, Box<dyn Error>> {
    let mut world = World::new(Bitrate::K500, 1);
    world.set_timing(TimingMode::Device);
    world.add_drive(NODE, Box::new(machine::zlac8030l(NODE, BAUD_RATE_500K)))?;
    let network = Network::new();
    world.add_station(network.clone());
    let drive = Drive::new(network.node(NodeId::new(NODE).unwrap_or(NodeId::MIN)), &ZLAC8030L);
    let place = Place::node(NODE);
    world.start_recording(Recorder::new(SAMPLING_PERIOD, SIGNALS.map(|signal| Channel { place, signal })));
    world.watch(true);
    let mut lines = Vec::new();
    let mut say = |world: &World, line: String| lines.push((world.now().as_secs_f64(), line));

    world.run_for(Duration::from_millis(1500));
    say(&world, "$ ferrodrive velocity 4 60rpm".to_owned());
    sim::block_on(&mut world, async {
        drive.velocity(Rpm(60.0), MotionOptions::default()).await?;
        drive.supervise(Duration::from_secs(2)).await
    })??;
    say(&world, "# the supply rises to 85 V".to_owned());
    world.apply(place, &"supply 85".parse()?)??;
    let ended = sim::block_on(&mut world, drive.supervise(Duration::from_secs(2)))?;
    // The command that turns it ends with that; its first line is enough for a picture.
    let error = ended.err().map(|error| error.to_string()).unwrap_or_default();
    say(&world, format!("error: {}", error.lines().next().unwrap_or_default()));
    world.run_for(Duration::from_secs(1));
    say(&world, "$ ferrodrive explain 4".to_owned());
    let explained = sim::block_on(&mut world, drive.explain(&Overheard::default()))?;
    if let Some(cause) = explained.findings.first() {
        say(&world, format!("{}: {}", cause.found, cause.follows));
        say(&world, cause.remedy.clone());
    }

    let mut states = Vec::new();
    while let Some(event) = world.poll_event() {
        let at_s = event.at.as_secs_f64();
        match event.kind {
            EventKind::State { to, .. } => states.push((at_s, to)),
            EventKind::Boot | EventKind::Fault { .. } => lines.push((at_s, event.to_string())),
            _ => {}
        }
    }
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let recorder = world.stop_recording().unwrap_or_else(|| unreachable!("it was started above"));
    let samples = recorder.rows().map(|(at, row)| [at.as_secs_f64(), row[0], row[1], row[2]]).collect();
    Ok(Seen { samples, states, lines, end_s: world.now().as_secs_f64() })
}

/// The states in the picture, in the order in which CiA 402 draws them.
const STATES: [PowerState; 6] = [
    PowerState::NotReadyToSwitchOn,
    PowerState::SwitchOnDisabled,
    PowerState::ReadyToSwitchOn,
    PowerState::SwitchedOn,
    PowerState::OperationEnabled,
    PowerState::Fault,
];

impl Seen {
    /// Length of a round of the animation, s.
    fn round_s(&self) -> f64 {
        self.end_s + REST_S
    }

    /// When something is, as a share of a round.
    fn share(&self, at_s: f64) -> f64 {
        (at_s / self.round_s()).min(1.0)
    }

    /// An animation of an attribute: a value for each time, from one to the next in a line or in steps.
    fn animation(&self, attribute: &str, mode: &str, values: impl Iterator<Item = (f64, String)>) -> String {
        let (times, values): (Vec<_>, Vec<_>) =
            values.map(|(at_s, value)| (format!("{:.4}", self.share(at_s)), value)).unzip();
        format!(
            r#"<animate{} dur="{:.2}s" repeatCount="indefinite" calcMode="{mode}" keyTimes="{}" values="{}"/>"#,
            attribute,
            self.round_s(),
            times.join(";"),
            values.join(";")
        )
    }

    /// Shown between two times of a round.
    fn shown(&self, from_s: f64, to_s: f64) -> String {
        let steps = [(0.0, "0"), (from_s, "1"), (to_s, "0")];
        let first = usize::from(from_s <= 0.0);
        let last = if to_s >= self.round_s() { 2 } else { 3 };
        let steps = steps[first..last].iter().map(|(at_s, value)| (*at_s, (*value).to_owned()));
        self.animation(r#" attributeName="opacity""#, "discrete", steps)
    }

    /// The picture, as the text of an SVG file. It holds no script.
    pub(crate) fn to_svg(&self) -> String {
        let mut svg = String::from(HEAD);
        self.wheel(&mut svg);
        self.curve(&mut svg, "speed, r/min", 2, (58.0, 84.0), (0.0, 80.0));
        self.curve(&mut svg, "supply, V", 3, (166.0, 60.0), (40.0, 90.0));
        self.states(&mut svg);
        let rows = self.lines.iter().flat_map(|(at_s, line)| wrapped(line).into_iter().map(move |row| (*at_s, row)));
        for (row, (at_s, line)) in rows.enumerate() {
            let (y, colour) = (304.0 + 18.0 * row as f64, if line.starts_with('$') { "#0f766e" } else { "#1f2933" });
            let line = line.replace('&', "&amp;").replace('<', "&lt;");
            let shown = self.shown(at_s, self.round_s());
            let _ = writeln!(svg, r#"<text x="30" y="{y}" class="line" fill="{colour}">{line}{shown}</text>"#);
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// Turned as the shaft is.
    fn wheel(&self, svg: &mut String) {
        svg.push_str(WHEEL);
        let angles = self.samples.iter().map(|sample| (sample[0], format!("{:.1} 120 142", sample[1].to_degrees())));
        let last = self.samples.last().map(|sample| (self.round_s(), format!("{:.1} 120 142", sample[1].to_degrees())));
        let turned =
            self.animation(r#"Transform attributeName="transform" type="rotate""#, "linear", angles.chain(last));
        let _ = writeln!(svg, "{turned}</g>");
    }

    /// A line that is drawn as time passes.
    fn curve(&self, svg: &mut String, name: &str, column: usize, (top, height): (f64, f64), (low, high): (f64, f64)) {
        let (left, width) = (262.0, 568.0);
        let x = |at_s: f64| left + at_s / self.end_s * width;
        let y = |value: f64| top + height - (value.clamp(low, high) - low) / (high - low) * height;
        let points = self.samples.iter().map(|sample| format!("{:.1} {:.1}", x(sample[0]), y(sample[column])));
        let path = format!("M{}", points.collect::<Vec<_>>().join("L"));
        let covered = [(0.0, 0.0), (self.end_s, width), (self.round_s(), width)];
        let covered = covered.into_iter().map(|(at_s, width)| (at_s, format!("{width}")));
        let clip = self.animation(r#" attributeName="width""#, "linear", covered);
        let _ = writeln!(
            svg,
            r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="#f7f9fb" stroke="#d0d7de"/>
<clipPath id="c{column}"><rect x="{left}" y="{top}" width="{width}" height="{height}">{clip}</rect></clipPath>
<path d="{path}" fill="none" stroke="#0f766e" stroke-width="2" clip-path="url(#c{column})"/>
<text x="{left}" y="{}" class="name">{name}</text>
<text x="{}" y="{}" class="tick">{high}</text><text x="{}" y="{}" class="tick">{low}</text>"##,
            top - 5.0,
            left - 5.0,
            top + 9.0,
            left - 5.0,
            top + height,
        );
    }

    /// The power states; the one that the drive is in is lit.
    fn states(&self, svg: &mut String) {
        for (column, state) in STATES.into_iter().enumerate() {
            let x = 30.0 + 134.0 * column as f64;
            let _ = writeln!(svg, r##"<rect x="{x}" y="248" width="128" height="26" rx="5" class="state"/>"##);
            let lit = if state == PowerState::Fault { "#b42318" } else { "#0f766e" };
            for (place, (from_s, entered)) in self.states.iter().enumerate() {
                let to_s = self.states.get(place + 1).map_or(self.round_s(), |next| next.0);
                // Fault reaction active is over within the blink of an eye: with Fault.
                let is_it =
                    *entered == state || (state, *entered) == (PowerState::Fault, PowerState::FaultReactionActive);
                if is_it && to_s > *from_s {
                    let shown = self.shown(*from_s, to_s);
                    let _ = writeln!(
                        svg,
                        r#"<rect x="{x}" y="248" width="128" height="26" rx="5" fill="{lit}" opacity="0">{shown}</rect>"#
                    );
                }
            }
            let name = state.name();
            let _ = writeln!(svg, r#"<text x="{}" y="265" class="chip">{name}</text>"#, x + 64.0);
        }
    }
}

/// A line in rows that fit the picture.
fn wrapped(line: &str) -> Vec<String> {
    let mut rows = vec![String::new()];
    for word in line.split(' ') {
        match rows.last_mut() {
            Some(row) if row.is_empty() => row.push_str(word),
            Some(row) if row.len() + word.len() < ROW => {
                row.push(' ');
                row.push_str(word);
            }
            _ => rows.push(word.to_owned()),
        }
    }
    rows
}

const HEAD: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 860 476" width="860" height="476" role="img" font-family="ui-sans-serif, system-ui, 'Segoe UI', Helvetica, Arial, sans-serif">
<title>A virtual drive boots, is enabled, turns, faults when its supply rises, and is explained</title>
<style>.name{font-size:12px;fill:#3e4c59}.tick{font-size:11px;fill:#5b6773;text-anchor:end}.line{font-size:13px;font-family:ui-monospace,Menlo,Consolas,monospace}.state{fill:#9aa5b1}.chip{font-size:10.5px;fill:#fff;text-anchor:middle}</style>
<rect x="0.5" y="0.5" width="859" height="475" rx="8" fill="#ffffff" stroke="#d0d7de"/>
<text x="30" y="34" font-size="16" font-weight="600" fill="#1f2933">A ZLAC8030L with its wheel, at node 4 of a virtual bus</text>
"##;

const WHEEL: &str = r##"<circle cx="120" cy="142" r="84" fill="#1f2933"/>
<g>
<circle cx="120" cy="142" r="66" fill="#dce3ea"/>
<path d="M120 142 V78 M120 142 L175.4 174 M120 142 L64.6 174" stroke="#5b6773" stroke-width="9" stroke-linecap="round"/>
<circle cx="120" cy="142" r="22" fill="#0f766e"/>
<circle cx="120" cy="66" r="6" fill="#f59e0b"/>
"##;

/// `FILE`: where the picture goes.
#[allow(dead_code, reason = "a test draws the picture")]
pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let seen = watch()?;
    for (at_s, line) in &seen.lines {
        println!("{at_s:7.3} s  {line}");
    }
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, seen.to_svg())?;
    }
    Ok(())
}
