//! Tables as plain text: no colour and no control codes, so they read the same on a terminal, in a log and in a file.

/// Blank columns between two cells.
const GAP: usize = 2;

/// Formats `rows` under `header`, a rule between them, one line each, ending in a line feed. Columns are as wide as their widest
/// cell. A column whose filled cells all start like a number is aligned right, every other one left. A short row is filled up with
/// blanks; cells beyond the header are kept under an empty title.
pub fn text_table(header: &[&str], rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).chain([header.len()]).max().unwrap_or(0);
    let cell = |row: usize, column: usize| rows[row].get(column).map_or("", String::as_str);
    let title = |column: usize| header.get(column).copied().unwrap_or("");
    let layout: Vec<(usize, bool)> = (0..columns)
        .map(|c| {
            let cells = || (0..rows.len()).map(|r| cell(r, c));
            let width = cells().chain([title(c)]).map(|text| text.chars().count()).max().unwrap_or(0);
            let right = cells().any(|text| !text.is_empty()) && cells().all(|text| text.is_empty() || is_number_like(text));
            (width, right)
        })
        .collect();
    let rule: Vec<String> = layout.iter().map(|(width, _)| "-".repeat(*width)).collect();
    let mut out = line(&layout, title);
    out += &line(&layout, |c| &rule[c]);
    (0..rows.len()).for_each(|r| out += &line(&layout, |c| cell(r, c)));
    out
}

/// One line of the table, without blanks at its end.
fn line<'a>(layout: &[(usize, bool)], cell: impl Fn(usize) -> &'a str) -> String {
    let cells = layout.iter().enumerate().map(|(c, &(width, right))| {
        let text = cell(c);
        if right { format!("{text:>width$}") } else { format!("{text:<width$}") }
    });
    let joined = cells.collect::<Vec<_>>().join(&" ".repeat(GAP));
    format!("{}\n", joined.trim_end())
}

/// Whether a cell reads as a number, perhaps with a unit or an interval behind it: "-3.5", "97.0 %", ".5 s", "-".
fn is_number_like(text: &str) -> bool {
    text == "-" || text.trim_start_matches(['-', '+', '.']).starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(cells: &[&str]) -> Vec<String> {
        cells.iter().map(|c| c.to_string()).collect()
    }

    #[test]
    fn words_go_left_and_numbers_right() {
        let rows = [row(&["pick-up", "97.0 %", "12"]), row(&["größe", "5.25 %", "-"])];
        let expected = "task     success  episodes\n\
                        -------  -------  --------\n\
                        pick-up   97.0 %        12\n\
                        größe     5.25 %         -\n";
        assert_eq!(text_table(&["task", "success", "episodes"], &rows), expected);
    }

    #[test]
    fn odd_rows_and_no_rows_are_kept() {
        assert_eq!(text_table(&["a", "b"], &[]), "a  b\n-  -\n");
        assert_eq!(text_table(&["name"], &[row(&["x", "extra"]), row(&[])]), "name\n----  -----\nx     extra\n\n");
    }
}
