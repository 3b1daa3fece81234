//! How the manuals are read: the tables of `docs/drives`, as data.
//!
//! The pages are the one place where the readings are written down; they are part of the program so that it can show them. A
//! table counts if its last column says how sure the reading is.

use serde::Serialize;

use words::models::Description;

/// The pages by the manuals that they are about.
const PAGES: [(&str, &str); 3] = [
    ("ZLAC8030L quick start guide V1.00", include_str!("../manuals/zlac8030l.md")),
    ("M Robot Joint Motor CanOpen Manual", include_str!("../manuals/mjoint.md")),
    ("ZLIM42-C user manual V1.03", include_str!("../manuals/zlim42c.md")),
];

// In the package, `manuals` leads to the project's `docs/drives` by symbolic links.
const _: () = {
    let mut at = 0;
    while at < PAGES.len() {
        assert!(
            PAGES[at].1.as_bytes()[0] == b'#',
            "no page: this checkout lacks symbolic links (git config core.symlinks)"
        );
        at += 1;
    }
};

/// One place where a manual is silent or contradicts itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Reading {
    /// Its number, such as `Z050`; empty where it has none.
    pub(crate) id: String,
    /// The heading that it stands under.
    pub(crate) section: String,
    /// What the manual prints, or the question that it leaves open.
    pub(crate) manual: String,
    /// What the drive here does.
    pub(crate) here: String,
    /// The reason for it.
    pub(crate) why: String,
    /// How sure that is; empty where nothing was to be decided.
    pub(crate) sure: String,
}

impl Reading {
    /// True if this is the place of that number (`Z050`); one reading may be for several: `Z001, Z048 to Z052`.
    pub(crate) fn is_of(&self, number: &str) -> bool {
        self.id.split(',').any(|part| match part.trim().split_once(" to ") {
            Some((first, last)) => first.len() == number.len() && (first..=last).contains(&number),
            None => part.trim() == number,
        })
    }

    /// True if nothing was found that speaks for it.
    pub(crate) fn is_guess(&self) -> bool {
        self.sure.contains("guess")
    }
}

/// The readings of a model's manual, in the order of the page; none for one without a page, as the standard's own servo.
pub(crate) fn of(model: &Description) -> Vec<Reading> {
    page(model).map(parse).unwrap_or_default()
}

/// The page about a model's manual.
pub(crate) fn page(model: &Description) -> Option<&'static str> {
    PAGES.iter().find(|(manual, _)| *manual == model.manual).map(|(_, text)| *text)
}

/// What a column of a table holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Column {
    Id,
    Manual,
    Here,
    Why,
    Sure,
    Other,
}

fn parse(page: &str) -> Vec<Reading> {
    let (mut section, mut columns, mut readings) = (String::new(), Vec::new(), Vec::new());
    for line in page.lines() {
        if let Some(heading) = line.strip_prefix('#') {
            section = plain(heading.trim_start_matches('#').trim());
        }
        let Some(cells) = cells(line) else {
            columns.clear();
            continue;
        };
        if columns.is_empty() {
            columns = cells.iter().map(|cell| column(cell)).collect();
        } else if columns.last() == Some(&Column::Sure) && !cells.iter().all(|cell| cell.starts_with("---")) {
            readings.push(row(&section, &columns, &cells));
        }
    }
    readings
}

fn row(section: &str, columns: &[Column], cells: &[String]) -> Reading {
    let mut reading = Reading { section: section.to_owned(), ..Reading::default() };
    for (column, cell) in columns.iter().zip(cells) {
        let place = match column {
            Column::Id => &mut reading.id,
            Column::Manual => &mut reading.manual,
            Column::Here => &mut reading.here,
            Column::Why => &mut reading.why,
            Column::Sure => &mut reading.sure,
            Column::Other => continue,
        };
        cell.clone_into(place);
    }
    reading
}

fn column(heading: &str) -> Column {
    match heading {
        "id" => Column::Id,
        "the manual prints" | "question" => Column::Manual,
        "the drive here" => Column::Here,
        "why" => Column::Why,
        "how sure" => Column::Sure,
        _ => Column::Other,
    }
}

/// The cells of a table's line; `None` of another line.
fn cells(line: &str) -> Option<Vec<String>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    Some(inner.split('|').map(|cell| plain(cell.trim())).collect())
}

/// Text without the marks of Markdown: code, strong, links.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    // `[words](target)` is `words`.
    while let Some((before, link)) = rest.split_once('[') {
        plain.push_str(before);
        match link.split_once("](").and_then(|(words, after)| Some((words, after.split_once(')')?.1))) {
            Some((words, after)) => {
                plain.push_str(words);
                rest = after;
            }
            None => {
                plain.push('[');
                rest = link;
            }
        }
    }
    plain.push_str(rest);
    plain.replace(['`', '*'], "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use devices::variant::VariationKind;
    use sim::machine::models;

    const PAGE: &str = "# Title\n\n| word | means |\n|---|---|\n| guess | nothing |\n\n## 5.3 Homing\n\n\
        | id | the manual prints | the drive here | why | how sure |\n|---|---|---|---|---|\n\
        | Z050 | a `label` | the [label](#homing) | 5.4 | guess |\n\n\
        | question | the drive here | how sure |\n|---|---|---|\n| Is it? | No | standard |\n";

    #[test]
    fn a_page_is_read_by_the_headings_of_its_tables() {
        let readings = parse(PAGE);
        let label = Reading {
            id: "Z050".into(),
            section: "5.3 Homing".into(),
            manual: "a label".into(),
            here: "the label".into(),
            why: "5.4".into(),
            sure: "guess".into(),
        };
        assert_eq!(readings.len(), 2);
        assert_eq!(readings[0], label);
        assert!(readings[0].is_guess());
        assert_eq!((readings[1].manual.as_str(), readings[1].sure.as_str()), ("Is it?", "standard"));
    }

    #[test]
    fn a_reading_may_be_for_several_places() {
        let reading = Reading { id: "L102, L112 to L116".into(), ..Reading::default() };
        assert!(["L102", "L112", "L114", "L116"].iter().all(|number| reading.is_of(number)));
        assert!(!["L103", "L111", "L117", "L1", "L1130"].iter().any(|number| reading.is_of(number)));
    }

    #[test]
    fn each_time_of_a_model_stands_on_its_page() {
        for model in models().filter(|model| page(model).is_some()) {
            let times: Vec<Reading> = of(model).into_iter().filter(|reading| reading.section == "Times").collect();
            let spans = model.timing.spans();
            assert_eq!(times.len(), spans.len(), "{}", model.name);
            for ((what, span), reading) in spans.iter().zip(&times) {
                assert!(reading.here.starts_with(&span.to_string()), "{}: {what} {span}: {}", model.name, reading.here);
                assert!(span.source.starts_with(&reading.sure), "{}: {what}: {}", model.name, reading.sure);
            }
        }
    }

    #[test]
    fn every_row_of_every_page_is_found() {
        for (manual, text) in PAGES {
            let numbered = |line: &&str| {
                // A letter and three digits: a model's name may begin so too.
                let id = line.strip_prefix("| ").unwrap_or_default().split([' ', ',']).next().unwrap_or_default();
                id.len() == 4
                    && id.starts_with(|first: char| first.is_ascii_uppercase())
                    && id[1..].parse::<u16>().is_ok()
            };
            let rows = text.lines().filter(numbered).count();
            let found = parse(text).iter().filter(|reading| !reading.id.is_empty()).count();
            assert!(rows > 0 && found == rows, "{manual}: {found} of {rows}");
        }
    }

    #[test]
    fn every_page_is_of_a_model_and_every_file_a_page() {
        for (manual, _) in PAGES {
            assert!(models().any(|model| model.manual == manual), "{manual}");
        }
        let files = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/manuals")).expect("the pages");
        assert_eq!(files.count(), PAGES.len());
    }

    #[test]
    fn every_reading_that_can_be_chosen_stands_on_its_page() {
        for model in models() {
            let readings = of(model);
            for variation in model.variations.iter().filter(|variation| variation.kind == VariationKind::Reading) {
                let known = readings.iter().any(|reading| reading.is_of(variation.key));
                assert!(known, "{} {}", model.name, variation.key);
            }
        }
    }
}
