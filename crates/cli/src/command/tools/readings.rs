//! `ferrodrive readings`: where a manual is silent or contradicts itself, and what the drives here do there.

use devices::variant::{Variation, VariationKind};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::Report;
use crate::readings::{self, Reading};
use plot::Paint;
use words::models::{Description, resolve};

/// List where a model's manual is silent or contradicts itself, and what can be chosen
///
/// Each entry has what the manual prints, what the virtual drive does, why, and how certain that is: traffic of real
/// drives, another document of the maker, a sibling's manual, the standard, or a guess.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive readings zlim42c homing\n  ferrodrive readings zlac8030l L123\n  \
    ferrodrive readings zlac8030l --choices")]
pub(crate) struct Readings {
    /// Model, e.g. zlac8030l
    #[arg(value_parser = resolve)]
    model: &'static Description,
    /// Show only entries with this number or with these words
    search: Vec<String>,
    /// Show only what can be chosen for a virtual drive (sim --drive MODEL@NODE,...)
    #[arg(long)]
    choices: bool,
    /// Show only guesses
    #[arg(long)]
    guesses: bool,
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct ReadingList {
    model: &'static str,
    manual: &'static str,
    readings: Vec<ReadingRow>,
    /// What can be chosen besides readings: firmware, factory values, motor.
    options: Vec<Options>,
    #[serde(skip)]
    guesses: usize,
}

#[derive(Debug, Serialize)]
struct ReadingRow {
    #[serde(flatten)]
    reading: Reading,
    #[serde(skip_serializing_if = "Option::is_none")]
    choose: Option<Options>,
}

/// A point at which drives of the model may differ.
#[derive(Debug, Serialize)]
struct Options {
    about: &'static str,
    section: &'static str,
    /// The first is taken unless another is asked for.
    choices: Vec<Offer>,
}

#[derive(Debug, Serialize)]
struct Offer {
    /// What to write after the comma of --drive.
    write: String,
    does: &'static str,
    sure: &'static str,
}

impl Options {
    fn of(variation: &Variation) -> Self {
        let write = |choice: &str| match variation.kind {
            VariationKind::Reading => format!("reading={}:{choice}", variation.key),
            VariationKind::Build => format!("{}={choice}", variation.key),
        };
        let choices = variation.choices.iter().map(|choice| Offer {
            write: write(choice.name),
            does: choice.does,
            sure: choice.trust.word(),
        });
        Self { about: variation.about, section: variation.section, choices: choices.collect() }
    }

    fn lines(&self, paint: Paint) -> Vec<String> {
        let width = self.choices.iter().map(|choice| choice.write.chars().count()).max().unwrap_or_default();
        let line = |(place, choice): (usize, &Offer)| {
            let taken = if place == 0 { "; the default" } else { "" };
            let name = format!("{:width$}", choice.write);
            format!("  {}  {} ({}{taken})", paint.strong(&name), choice.does, choice.sure)
        };
        self.choices.iter().enumerate().map(line).collect()
    }
}

impl Readings {
    /// Searches the page of the model's manual.
    pub(crate) fn list(&self) -> Result<ReadingList, Failure> {
        let variations = self.model.variations;
        let all = readings::of(self.model);
        let guesses = all.iter().filter(|reading| reading.is_guess()).count();
        let rows = all.into_iter().map(|reading| {
            let variation = variations.iter().find(|variation| reading.is_of(variation.key));
            ReadingRow { choose: variation.map(Options::of), reading }
        });
        let wanted = |row: &ReadingRow| {
            (!self.choices || row.choose.is_some()) && (!self.guesses || row.reading.is_guess()) && self.matches(row)
        };
        let readings: Vec<ReadingRow> = rows.filter(wanted).collect();
        let builds = variations.iter().filter(|variation| variation.kind == VariationKind::Build);
        let options: Vec<_> = builds.filter(|_| self.search.is_empty() && !self.guesses).map(Options::of).collect();
        if readings.is_empty() && options.is_empty() {
            return Err(Failure::new(format!("no reading of the {} matches", self.model.name))
                .next(format!("ferrodrive readings {} lists all", self.model.name)));
        }
        Ok(ReadingList { model: self.model.name, manual: self.model.manual, readings, options, guesses })
    }

    fn matches(&self, row: &ReadingRow) -> bool {
        let Reading { id, section, manual, here, why, sure } = &row.reading;
        let text = [id, section, manual, here, why, sure].map(|part| part.to_lowercase()).join("\n");
        let number = |word: &str| row.reading.is_of(&word.to_uppercase());
        self.search.iter().all(|word| number(word) || text.contains(&word.to_lowercase()))
    }
}

impl Report for ReadingList {
    fn text(&self, paint: Paint) -> String {
        let count = self.readings.len();
        let mut lines = vec![format!(
            "\"{}\": {count} place{} ({} of all are guesses)",
            self.manual,
            if count == 1 { "" } else { "s" },
            self.guesses
        )];
        let mut section = "";
        for ReadingRow { reading, choose } in &self.readings {
            if reading.section != section {
                section = &reading.section;
                lines.extend([String::new(), paint.strong(section)]);
            }
            lines.push(String::new());
            let name = if reading.id.is_empty() { "manual" } else { &reading.id };
            for (name, words) in
                [(name, &reading.manual), ("here", &reading.here), ("why", &reading.why), ("sure", &reading.sure)]
            {
                if !words.is_empty() {
                    lines.push(format!("{}  {words}", paint.dim(&format!("{name:6}"))));
                }
            }
            lines.extend(choose.iter().flat_map(|choose| choose.lines(paint)));
        }
        for options in &self.options {
            lines.extend([String::new(), paint.strong(options.about)]);
            lines.extend(options.lines(paint));
        }
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::page;
    use sim::machine::models;

    fn list(model: &'static Description, words: &[&str], guesses: bool) -> Result<ReadingList, Failure> {
        let search = words.iter().map(|word| (*word).into()).collect();
        Readings { model, search, choices: false, guesses }.list()
    }

    #[test]
    fn a_place_is_found_by_its_number_and_by_words() {
        let zlac = models().next().unwrap();
        let found = list(zlac, &["l004"], false).unwrap_or_else(|failure| panic!("{failure}"));
        assert_eq!(found.readings.len(), 1);
        assert!(found.text(Paint::OFF).contains("L004"), "{}", found.text(Paint::OFF));
        assert!(list(zlac, &["node", "switch"], false).is_ok_and(|found| !found.readings.is_empty()));
        assert!(list(zlac, &["zebra"], false).is_err());
    }

    #[test]
    fn the_guesses_of_a_model_are_as_many_as_its_page_has() {
        for model in models().filter(|model| page(model).is_some()) {
            // The last column of the page's tables.
            let guesses = page(model).into_iter().flat_map(str::lines).filter(|line| line.starts_with('|'));
            let on_page = guesses.filter(|line| line.rsplit('|').nth(1).is_some_and(|sure| sure.contains("guess")));
            let found = list(model, &[], true).map(|found| (found.readings.len(), found.guesses));
            let on_page = on_page.count();
            assert!(found.is_ok_and(|found| found == (on_page, on_page)), "{}: {on_page}", model.name);
        }
    }
}
