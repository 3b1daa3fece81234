//! Every procedure of the three manuals against the virtual drives, datagram by datagram as printed, and the three drives
//! together on one bus: what `ferrodrive demo` shows.
//!
//! What is expected comes from the manuals ("ZLAC8030L quick start guide V1.00", "M Robot Joint Motor CanOpen Manual",
//! "ZLIM42-C user manual V1.03"; misprints as `docs/drives` reads them) or from a closed form of their figures, never
//! from an earlier run. Each [`Row`] says what was asked, what answered, what moved and what was seen.
//!
//! [`run`] is plain values out: the rows of each part, and a [`Poster`] of the motion that becomes SVG. [`Report`]
//! is its table. Where they are shown is not decided here: `ferrodrive demo` does, and the program `demo` of this crate, which
//! is built in a quarter of the time.
//!
//! ```
//! let stepper = devices::model("zlim42c").expect("the model is known");
//! let showcase = showcase::run(Some(stepper), |section| assert!(section.starts_with(stepper.title)))?;
//! let part = &showcase.parts[0];
//! assert_eq!(part.passed, part.steps);
//! assert!(showcase.poster.to_svg().starts_with("<svg "));
//! # Ok::<(), showcase::Error>(())
//! ```

mod bench;
mod datagram;
mod error;
mod expect;
mod figure;
mod lights;
mod part;
mod player;
mod report;
mod row;
mod set_points;
mod timing;
mod together;

use std::rc::Rc;
use std::time::Duration;

use can::Bitrate;
use devices::Description;

use bench::Bench;
pub use error::Error;
pub use part::PartReport;
pub use plot::Poster;
pub use report::Report;
pub use row::{Check, Row};

/// Every drive boots within this time.
const BOOT_TIME: Duration = Duration::from_secs(1);

/// A part of the whole: some drives on a bus, and what is done with them.
struct Part {
    /// As in the table's heading.
    name: &'static str,
    /// The drives with their node-IDs; the first one is talked to.
    drives: &'static [(&'static Description, u8)],
    bitrate: Bitrate,
    procedures: Procedures,
    draw: fn(&bench::Finished, &'static str) -> Vec<Vec<plot::Figure>>,
}

/// What is done with them.
enum Procedures {
    /// A file of `procedures`, by its name and its text.
    File(&'static str, &'static str),
    /// What the master does with several drives.
    Calls(fn(&mut Bench)),
}

impl Procedures {
    fn run(&self, bench: &mut Bench) -> Result<(), Error> {
        match *self {
            Self::File(name, text) => player::play(bench, name, text, false),
            Self::Calls(calls) => {
                calls(bench);
                Ok(())
            }
        }
    }
}

/// "Set to different addresses in advance, such as addresses 1, 2, 3" (5.10.3).
const JOINTS: [(&Description, u8); 3] = {
    let joint = &devices::mjoint::M4230E17B50;
    [(joint, 1), (joint, 2), (joint, 3)]
};

/// The three drives and their node-IDs: as delivered, but for the ZLIM42-C, whose 1 is the joint's.
const THREE: [(&Description, u8); 3] =
    [(&devices::zltech::ZLAC8030L, 4), (&devices::mjoint::M4230E17B50, 1), (&devices::zltech::ZLIM42C, 2)];

/// Node-IDs and bit rates are those of the manuals' examples.
const PARTS: [Part; 5] = [
    Part {
        name: "ZLAC8030L",
        drives: &[(&devices::zltech::ZLAC8030L, 4)],
        bitrate: Bitrate::K500,
        procedures: Procedures::File("zlac8030l.can", include_str!("../procedures/zlac8030l.can")),
        draw: figure::zlac8030l,
    },
    Part {
        name: "M4230E17B50",
        drives: &[(&devices::mjoint::M4230E17B50, 1)],
        bitrate: Bitrate::M1,
        procedures: Procedures::File("mjoint.can", include_str!("../procedures/mjoint.can")),
        draw: figure::mjoint,
    },
    Part {
        name: "ZLIM42-C",
        drives: &[(&devices::zltech::ZLIM42C, 1)],
        bitrate: Bitrate::K500,
        procedures: Procedures::File("zlim42c.can", include_str!("../procedures/zlim42c.can")),
        draw: figure::zlim42c,
    },
    Part {
        name: "Three drives, one bus, the same calls",
        drives: &THREE,
        bitrate: Bitrate::K500,
        procedures: Procedures::Calls(together::intents::same_calls),
        draw: figure::same_calls,
    },
    Part {
        name: "Three joints, interpolation at 2 ms",
        drives: &JOINTS,
        bitrate: Bitrate::M1,
        procedures: Procedures::Calls(together::interpolation::three_joints),
        draw: figure::interpolation,
    },
];

/// What was seen.
#[derive(Clone, Debug)]
pub struct Showcase {
    /// The table, part by part.
    pub parts: Vec<PartReport>,
    /// The picture of the motion.
    pub poster: Poster,
}

/// Runs everything, or the part of one model. `progress` is called for each section as it begins.
pub fn run(only: Option<&'static Description>, progress: impl Fn(&str) + 'static) -> Result<Showcase, Error> {
    let progress: bench::Progress = Rc::new(progress);
    let mut parts = Vec::new();
    let mut poster = figure::poster(only.is_some());
    for part in &PARTS {
        let (name, drives) = match only {
            None => (part.name, part.drives.to_vec()),
            Some(model) => match part.with(model) {
                Some(drives) => (model.title, drives),
                None => continue,
            },
        };
        let mut bench = Bench::new(&drives, part.bitrate, Rc::clone(&progress))?;
        part.procedures.run(&mut bench)?;
        let finished = bench.finish();
        poster.rows.extend((part.draw)(&finished, name));
        parts.push(PartReport::new(name, finished));
    }
    Ok(Showcase { parts, poster })
}

/// Plays a conversation: a file that begins with `drive MODEL NODE` and lists every frame that is sent and heard from then
/// on, the drive having booted. The first line that the drive does not keep to is an error, shown with its neighbours.
pub fn converse(name: &str, text: &str) -> Result<(), Error> {
    let header = (1..).zip(text.lines()).find(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (number, line) = header.unwrap_or((1, ""));
    let mut words = line.split_whitespace();
    let model = words.next().filter(|word| *word == "drive").and_then(|_| words.next()).and_then(devices::model);
    let part = model.and_then(|model| PARTS.iter().find_map(|part| Some((part.with(model)?, part.bitrate))));
    let Some((drives, bitrate)) = part else {
        let what = format!("expected a header such as 'drive zlac8030l 4', got '{line}'");
        return Err(Error::line(name, text, number, what));
    };
    let mut bench = Bench::new(&drives, bitrate, Rc::new(|_: &str| {}))?;
    bench.run_silently(BOOT_TIME);
    bench.forget();
    player::play(&mut bench, name, text, true)
}

impl Part {
    /// The part with another model in place of its drive, if the manual is the same: then the objects are too.
    fn with(&self, model: &'static Description) -> Option<Vec<(&'static Description, u8)>> {
        match *self.drives {
            [(profile, node)] if std::ptr::eq(profile.dictionary, model.dictionary) => Some(vec![(model, node)]),
            _ => None,
        }
    }
}
