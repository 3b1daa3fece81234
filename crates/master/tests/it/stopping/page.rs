//! The tables of docs/safety.md, which the tests of both crates make.

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/safety.md");

/// By how much a time on the page may differ from the one that was found, s: where in a cycle an end falls moves with each frame
/// before it.
const TOLERANCE_S: f64 = 0.1;

/// Compares the table that begins like this with the one of the page, which is written anew when that is asked for.
pub(crate) fn compare(begins: &str, table: &str) {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(begins).expect("the page has the table");
    let (former, after) = rest.split_once("\n\n").expect("something follows it");
    if std::env::var_os("FERRODRIVE_WRITE_PAGES").is_some() {
        std::fs::write(PAGE, format!("{before}{table}\n\n{after}")).unwrap();
        return;
    }
    let former = format!("{begins}{former}");
    assert_eq!(former.lines().count(), table.lines().count(), "rows of the table in docs/safety.md");
    for (written, found) in former.lines().zip(table.lines()) {
        let is_same = written.matches('|').count() == found.matches('|').count()
            && written.split('|').zip(found.split('|')).all(|(written, found)| is_near(written, found));
        assert!(is_same, "docs/safety.md says how this table is made; it has\n{written}\nand found was\n{found}");
    }
}

fn is_near(written: &str, found: &str) -> bool {
    match (seconds(written), seconds(found)) {
        (Some(written), Some(found)) => (written - found).abs() < TOLERANCE_S,
        _ => written == found,
    }
}

fn seconds(cell: &str) -> Option<f64> {
    cell.trim().strip_suffix(" s")?.parse().ok()
}
