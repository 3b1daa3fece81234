//! `ferrodrive demo`: every procedure of the manuals against the virtual drives.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use plot::Paint;
use serde::Serialize;
use sim::machine::models;
use transport::WallClock;

use crate::command::record_and_replay::plot::{svg_path, write_svg};
use crate::failure::{Failure, refuse_missing_folder};
use crate::global::Global;
use crate::output::Report;
use crate::progress::Progress;
use crate::session::exit_on_signal;
use words::models::resolve;

/// Run every procedure of the manuals against virtual drives
///
/// Runs on embedded virtual buses. Prints each request, its answer and the motion beside what the three manuals let
/// expect, and draws the motion. Ends with status 1 if anything differs.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive demo\n  ferrodrive demo --drive zlim42c -o stepper.svg")]
pub(crate) struct Demo {
    /// Draw the motion to this file
    #[arg(long = "output", short = 'o', alias = "svg", value_name = "FILE.svg", default_value = "demo.svg", value_parser = svg_path)]
    svg: PathBuf,
    /// Run only the part of one drive, which may be any model that its manual covers
    #[arg(long, value_name = "MODEL", value_parser = PossibleValuesParser::new(models().map(|known| known.name)))]
    drive: Option<String>,
}

impl Demo {
    /// Runs it and writes the picture.
    pub(crate) fn run(&self, global: &Global) -> Result<DemoReport, Failure> {
        refuse_missing_folder("the picture", &self.svg)?;
        exit_on_signal();
        let clock = WallClock::start();
        let progress = Progress::new(global.json);
        let shown = progress.clone();
        let only = self.drive.as_deref().and_then(|name| resolve(name).ok());
        let showcase = showcase::run(only, move |section| shown.show(section))
            .map_err(|error| Failure::new(error.to_string()).next("--drive MODEL runs the part of one drive alone"))?;
        progress.clear();
        let picture = write_svg(&self.svg, showcase.poster.to_svg())?;
        let (svg, took_s) = (self.svg.display().to_string(), clock.now().as_secs_f64());
        Ok(DemoReport { found: showcase::Report::new(showcase.parts, svg, took_s), picture })
    }
}

/// What the demo found, and why it failed if it did.
#[derive(Debug, Serialize)]
pub(crate) struct DemoReport {
    #[serde(flatten)]
    found: showcase::Report,
    /// The picture, if it goes to standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

impl DemoReport {
    /// Why the demo failed, if it did.
    pub(crate) fn failure(&self) -> Option<Failure> {
        (!self.found.ok).then(|| {
            let failure = Failure::new("not every result matches the manuals").of_kind("differs");
            failure.next("look for DIFFERS in the table, or for \"ok\":false in the rows")
        })
    }
}

impl Report for DemoReport {
    fn text(&self, paint: Paint) -> String {
        match &self.picture {
            Some(picture) => picture.trim_end().to_owned(),
            None => self.found.text(paint),
        }
    }
}
