//! `ferrodrive demo`: every procedure of the manuals against the virtual drives.

mod report;

use std::io::Write;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use sim::machine::models;
use transport::WallClock;

use crate::failure::Failure;
use crate::global::Global;
use crate::progress::Progress;
use crate::serve::files::create_picture;
use crate::session::exit_on_signal;
use report::DemoReport;
use testbench::models::resolve;

/// Show the whole thing on an embedded virtual bus: every procedure of the three manuals against the three drives
///
/// Prints what was asked, what answered and what moved, beside what the manuals let expect, and draws the motion.
/// Exit status 1 if anything differs.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive demo\n  ferrodrive demo --drive zlim42c --svg stepper.svg")]
pub(crate) struct Demo {
    /// Where to draw the motion
    #[arg(long, value_name = "FILE", default_value = "demo.svg")]
    svg: PathBuf,
    /// Only the part of one drive, which may be any model that its manual is about
    #[arg(long, value_name = "MODEL", value_parser = PossibleValuesParser::new(models().map(|known| known.name)))]
    drive: Option<String>,
}

impl Demo {
    /// Runs it and writes the picture.
    pub(crate) fn run(&self, global: &Global) -> Result<DemoReport, Failure> {
        exit_on_signal();
        let clock = WallClock::start();
        let progress = Progress::new(global.json);
        let shown = progress.clone();
        let only = self.drive.as_deref().and_then(|name| resolve(name).ok());
        let showcase =
            showcase::run(only, move |section| shown.show(section)).map_err(|error| Failure::new(error.to_string()))?;
        progress.clear();
        // A picture of somebody else's stays.
        create_picture(&self.svg, b"<svg")
            .and_then(|mut file| file.write_all(showcase.poster.to_svg().as_bytes()))
            .map_err(|error| Failure::of_writing("the picture", &self.svg, &error))?;
        let (svg, took_s) = (self.svg.display().to_string(), clock.now().as_secs_f64());
        Ok(DemoReport::new(showcase.parts, svg, took_s))
    }
}
