//! `ferrodrive man-pages`: manual pages for those who package the program.

use std::path::PathBuf;

use crate::failure::Failure;
use crate::output::file_path;

/// Write the manual pages of all commands to a folder, for packages
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive man-pages ~/.local/share/man/man1")]
pub(crate) struct ManPages {
    /// Folder, which is created if it does not exist
    #[arg(value_parser = file_path)]
    folder: PathBuf,
}

impl ManPages {
    /// Writes a page for a command line and for each of its commands.
    pub(crate) fn run(&self, whole: clap::Command) -> Result<(), Failure> {
        let written =
            std::fs::create_dir_all(&self.folder).and_then(|()| clap_mangen::generate_to(whole, &self.folder));
        written.map_err(|error| Failure::of_writing("manual pages to", &self.folder, &error))
    }
}
