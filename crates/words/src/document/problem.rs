//! What is wrong with a text, and where: as a compiler says it.

use std::fmt;
use std::ops::Range;

/// Something wrong, by the bytes of the text that it is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Which bytes.
    pub at: Range<usize>,
    /// What is wrong, and what is expected there.
    pub what: String,
}

impl Problem {
    /// Something wrong at these bytes.
    pub fn new(at: Range<usize>, what: impl Into<String>) -> Self {
        Self { at, what: what.into() }
    }

    /// With its line and column in `text`.
    pub fn locate(&self, text: &str) -> Located {
        let start = floor(text, self.at.start);
        let begin = text[..start].rfind('\n').map_or(0, |end| end + 1);
        let end = text[start..].find('\n').map_or(text.len(), |length| start + length);
        let line = &text[begin..end];
        let column = text[begin..start].chars().count() + 1;
        let marked = text[start..floor(text, self.at.end).clamp(start, end)].chars().count();
        Located {
            line: text[..begin].matches('\n').count() + 1,
            column,
            width: marked.max(1),
            shown: line.trim_end().to_owned(),
            what: self.what.clone(),
        }
    }
}

/// The next boundary of a letter at or before `at`.
fn floor(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Something wrong at a line and column, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Located {
    /// Which line.
    pub line: usize,
    /// Which letter of it.
    pub column: usize,
    /// How many letters it is about.
    pub width: usize,
    /// The line.
    pub shown: String,
    /// What is wrong, and what is expected there.
    pub what: String,
}

impl Located {
    /// The same place with another complaint.
    pub fn saying(&self, what: impl Into<String>) -> Self {
        Self { what: what.into(), ..self.clone() }
    }
}

/// A file that cannot be used: everything that is wrong with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadFile {
    /// The file's name, where it has one.
    pub name: Option<String>,
    /// What is wrong with it, in the order of the text; at least one.
    pub problems: Vec<Located>,
}

/// So many problems are shown; a file of another kind has hundreds.
const MOST_SHOWN: usize = 20;

/// So much of a line is shown: a file of one line has a million letters.
const WIDEST: usize = 120;

impl BadFile {
    /// What is wrong with `text`.
    pub fn new(text: &str, mut problems: Vec<Problem>) -> Self {
        problems.sort_by_key(|problem| (problem.at.start, problem.at.end));
        problems.dedup();
        let mut located: Vec<_> = problems.iter().take(MOST_SHOWN).map(|problem| problem.locate(text)).collect();
        if let (Some(last), true) = (located.last().cloned(), problems.len() > MOST_SHOWN) {
            located.push(last.saying(format!("and {} more like these", problems.len() - MOST_SHOWN)));
        }
        Self { name: None, problems: located }
    }

    /// One thing that is wrong, whose place is known already.
    pub fn one(problem: Located) -> Self {
        Self { name: None, problems: vec![problem] }
    }

    /// Several things that are wrong, whose places are known already; nothing, if there is none.
    ///
    /// # Errors
    /// These.
    pub fn none_or(mut problems: Vec<Located>) -> Result<(), Self> {
        problems.sort_by_key(|problem| (problem.line, problem.column));
        if problems.is_empty() { Ok(()) } else { Err(Self { name: None, problems }) }
    }

    /// The same of a file with this name.
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: Some(name.into()), ..self }
    }
}

impl std::error::Error for BadFile {}

/// `wheel.toml:4:1: what is wrong`, then the line and a mark below.
impl fmt::Display for BadFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, problem) in self.problems.iter().enumerate() {
            let Located { line, column, what, .. } = problem;
            let gap = if n == 0 { "" } else { "\n" };
            match &self.name {
                Some(name) => write!(f, "{gap}{name}:{line}:{column}: {what}")?,
                None => write!(f, "{gap}line {line}, column {column}: {what}")?,
            }
            problem.excerpt(f)?;
        }
        Ok(())
    }
}

impl Located {
    fn excerpt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Of a long line the part around the mark; a tab would move the mark.
        let skipped = (self.column - 1).saturating_sub(WIDEST / 2);
        let shown: String =
            self.shown.chars().skip(skipped).take(WIDEST).map(|c| if c == '\t' { ' ' } else { c }).collect();
        if shown.trim().is_empty() {
            return Ok(());
        }
        let (cut, rest) = (if skipped > 0 { ".. " } else { "" }, self.shown.chars().count() > skipped + WIDEST);
        let end = if rest { " .." } else { "" };
        let before = self.column - 1 - skipped + cut.len();
        let marks = self.width.min((WIDEST + cut.len()).saturating_sub(before)).max(1);
        let line = self.line;
        let gutter = line.to_string().len();
        write!(f, "\n  {line} | {cut}{shown}{end}\n  {:gutter$} | {:before$}{}", "", "", "^".repeat(marks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_shown_with_a_mark_below_what_is_meant() {
        let text = "a = 1\n\u{e4}\u{f6} = 'slip'\nc = 3";
        let at = text.find("'slip'").expect("it is there");
        let bad = BadFile::new(text, vec![Problem::new(at..at + 6, "not a number")]).named("m.toml");
        assert_eq!(bad.to_string(), "m.toml:2:6: not a number\n  2 | \u{e4}\u{f6} = 'slip'\n    |      ^^^^^^");
    }

    #[test]
    fn places_beyond_the_text_and_inside_a_letter_are_no_trouble() {
        for at in [0..0, 1..2, 3..900, 900..1000] {
            let shown = BadFile::new("\u{e4}\n", vec![Problem::new(at, "x")]).to_string();
            assert!(shown.starts_with("line "), "{shown}");
        }
    }

    #[test]
    fn of_many_problems_and_of_a_long_line_a_part_is_shown() {
        let text = "x".repeat(100_000);
        let many = (0..1000).map(|at| Problem::new(at * 100..at * 100 + 50_000, "no")).collect();
        let shown = BadFile::new(&text, many).to_string();
        assert!(shown.len() < 8_000 && shown.contains("and 980 more"), "{}", shown.len());
        let line = format!("{}= 'slip'{}", " ".repeat(200), "y".repeat(200));
        let shown = BadFile::new(&line, vec![Problem::new(202..208, "x")]).to_string();
        let [_, excerpt, mark] = shown.lines().collect::<Vec<_>>()[..] else { panic!("{shown}") };
        assert!(excerpt.starts_with("  1 | .. ") && excerpt.ends_with("y .."), "{shown}");
        assert_eq!(excerpt.find("'slip'"), mark.find('^'), "{shown}");
        assert!(mark.ends_with(" ^^^^^^"), "{shown}");
    }
}
