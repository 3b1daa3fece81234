//! Text tables with aligned columns.

use crate::Paint;

/// A table: a heading for each column and rows of as many cells.
#[derive(Clone, Debug, Default)]
pub struct Table {
    headings: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(headings: &[&'static str]) -> Self {
        Self { headings: headings.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; missing cells are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The text: heading line, then the rows, two blanks between columns, none at line ends.
    /// `finish` may colour a finished cell (row, column, text).
    pub fn text(&self, paint: Paint, finish: impl Fn(usize, usize, &str) -> Option<String>) -> String {
        let widths = self.widths();
        let mut text = line(&widths, self.headings.iter().map(|heading| (*heading, paint.strong(heading))));
        for (number, row) in self.rows.iter().enumerate() {
            let cells = row
                .iter()
                .enumerate()
                .map(|(column, cell)| (cell.as_str(), finish(number, column, cell).unwrap_or_else(|| cell.clone())));
            text.push('\n');
            text.push_str(&line(&widths, cells));
        }
        text
    }

    /// The text without colours of its own.
    pub fn plain(&self, paint: Paint) -> String {
        self.text(paint, |_, _, _| None)
    }

    /// The same for a screen of so many columns: the last columns are left out while more than `least` are there, then the last one
    /// that stays is cut.
    pub fn narrowed(mut self, screen: usize, least: usize) -> Self {
        let whole = |widths: &[usize]| widths.iter().map(|width| width + 2).sum::<usize>() - 2;
        while self.headings.len() > least && whole(&self.widths()) > screen {
            self.headings.pop();
            let columns = self.headings.len();
            self.rows.iter_mut().for_each(|row| row.truncate(columns));
        }
        let widths = self.widths();
        let (Some(last), too_many) = (widths.last(), whole(&widths).saturating_sub(screen)) else { return self };
        let (room, column) = (last.saturating_sub(too_many).max(1), widths.len() - 1);
        for cell in self.rows.iter_mut().filter_map(|row| row.get_mut(column)) {
            if cell.chars().count() > room {
                *cell = cell.chars().take(room.saturating_sub(2)).chain("..".chars().take(room)).collect();
            }
        }
        self
    }

    fn widths(&self) -> Vec<usize> {
        let widest = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count());
            cells.chain([self.headings[column].chars().count()]).max().unwrap_or(0)
        };
        (0..self.headings.len()).map(widest).collect()
    }
}

/// One line from cells given twice: as counted for the width, and as written.
fn line<'a>(widths: &[usize], cells: impl Iterator<Item = (&'a str, String)>) -> String {
    let mut text = String::new();
    for (width, (counted, written)) in widths.iter().zip(cells) {
        text.push_str(&written);
        text.extend(std::iter::repeat_n(' ', width - counted.chars().count() + 2));
    }
    text.truncate(text.trim_end().len());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new(&["node", "is"]);
        table.row(["4", "a drive"]);
        table.row(["127", "°C"]);
        assert_eq!(table.plain(Paint::OFF), "node  is\n4     a drive\n127   °C");
    }

    #[test]
    fn a_narrow_screen_has_the_first_columns_whole_and_the_last_one_cut() {
        let mut table = Table::new(&["node", "is", "seen"]);
        table.row(["4", "a drive", "never"]);
        let at = |width, least| table.clone().narrowed(width, least).plain(Paint::OFF);
        assert_eq!(at(20, 1), "node  is       seen\n4     a drive  never");
        assert_eq!(at(19, 1), "node  is\n4     a drive");
        assert_eq!(at(10, 2), "node  is\n4     a ..");
        assert_eq!(at(3, 1), "node\n4");
    }
}
