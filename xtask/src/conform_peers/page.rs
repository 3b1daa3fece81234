//! The part of docs/conformance.md about stacks of other people: its table is written here, and what people wrote about the
//! cases that failed is compared with those that did.

use std::collections::BTreeSet;

const HEAD: &str = "| stack | passed | failed | not applicable |";

/// The page with this row in its table, in place of that of the same stack.
pub(super) fn with_row(page: &str, stack: &str, counts: [u64; 3]) -> Result<String, String> {
    let [passed, failed, other] = counts;
    let row = format!("| {stack} | {passed} | {failed} | {other} |");
    let mut lines: Vec<&str> = page.lines().collect();
    let head = lines.iter().position(|line| *line == HEAD).ok_or(format!("expected a table with {HEAD}"))?;
    let rows = lines[head..].iter().take_while(|line| line.starts_with('|')).count();
    let own = format!("| {stack} |");
    match lines[head..head + rows].iter().position(|line| line.starts_with(&own)) {
        Some(place) => lines[head + place] = &row,
        None => lines.insert(head + rows, &row),
    }
    Ok(lines.join("\n") + "\n")
}

/// The cases that the page's section on a stack is about; the section begins with `**STACK.**`.
pub(super) fn explained(page: &str, stack: &str) -> Result<BTreeSet<String>, String> {
    let start = format!("**{stack}.**");
    let mut lines = page.lines().skip_while(|line| !line.starts_with(&start));
    if lines.next().is_none() {
        return Ok(BTreeSet::new());
    }
    let section = lines.take_while(|line| !line.starts_with("**") && !line.starts_with('#'));
    let cells = section.filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    let mut cases = BTreeSet::new();
    for cell in cells.filter(|cell| *cell != "cases") {
        cases.extend(ids(cell)?);
    }
    Ok(cases)
}

/// `SDO 05, 07, PDO 23 to 25`.
fn ids(cell: &str) -> Result<Vec<String>, String> {
    let mut group = "";
    let mut found = Vec::new();
    for part in cell.split(", ") {
        let numbers = match part.split_once(' ') {
            Some((name, rest)) if name.starts_with(|first: char| first.is_ascii_uppercase()) => {
                group = name;
                rest
            }
            _ => part,
        };
        let (first, last) = numbers.split_once(" to ").unwrap_or((numbers, numbers));
        let number = |text: &str| {
            text.parse::<u8>().map_err(|_| format!("expected cases such as 'SDO 05, 07 to 09', got '{cell}'"))
        };
        found.extend((number(first)?..=number(last)?).map(|number| format!("{group} {number:02}")));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Page\n\n| stack | passed | failed | not applicable |\n|---|---|---|---|\n| a 1 | 1 | 2 | 3 |\n\n\
                        **a 1.** All theirs.\n\n| cases | seen | clause |\n|---|---|---|\n| SDO 05, 07, PDO 23 to 25 | x | y |\n\n\
                        **b.** None.\n";

    #[test]
    fn a_row_takes_the_place_of_the_one_before_or_comes_last() {
        let page = with_row(PAGE, "a 1", [4, 5, 6]).unwrap();
        assert!(page.contains("|---|\n| a 1 | 4 | 5 | 6 |\n\n**a 1.**"), "{page}");
        let page = with_row(PAGE, "b", [7, 8, 9]).unwrap();
        assert!(page.contains("| a 1 | 1 | 2 | 3 |\n| b | 7 | 8 | 9 |\n\n"), "{page}");
        assert!(with_row("no table", "b", [0; 3]).is_err());
    }

    #[test]
    fn cases_of_a_section_are_those_of_its_table() {
        let cases: Vec<_> = explained(PAGE, "a 1").unwrap().into_iter().collect();
        assert_eq!(cases, ["PDO 23", "PDO 24", "PDO 25", "SDO 05", "SDO 07"]);
        assert!(explained(PAGE, "b").unwrap().is_empty());
        assert!(explained(&PAGE.replace("05, 07", "05 and 07"), "a 1").is_err());
    }
}
