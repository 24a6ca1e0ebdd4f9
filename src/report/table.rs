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

/// As [`text_table`] where that fits into `width` (any, where it is not said); else each row by itself: its first cell on a line, the others, each after
/// its title, on lines below. An empty cell is left out there.
pub fn fitted_table(header: &[&str], rows: &[Vec<String>], width: Option<usize>) -> String {
    let table = text_table(header, rows);
    let Some(width) = width.filter(|width| table.lines().any(|line| line.chars().count() > *width)) else { return table };
    let mut text = String::new();
    for row in rows {
        text += &wrapped(row.first().map_or("", String::as_str), Some(width));
        let titled = header.iter().zip(row).skip(1).filter(|(_, cell)| !cell.is_empty());
        let parts: Vec<String> = titled.map(|(title, cell)| format!("{title} {cell}").replace(' ', NO_BREAK)).collect();
        text += &wrapped(&format!("  {}", parts.join(", ")), Some(width)).replace(NO_BREAK, " ");
    }
    text
}

/// A blank at which no line is broken.
const NO_BREAK: &str = "\u{a0}";

/// Words in lines of at most `width` characters, those after the first indented by two more than it; a longer word has a line of its own. Ends in a line feed.
pub fn wrapped(words: &str, width: Option<usize>) -> String {
    let Some(width) = width else { return format!("{words}\n") };
    let indent = words.len() - words.trim_start().len();
    let (first, rest) = (" ".repeat(indent), " ".repeat(indent + GAP));
    let options = textwrap::Options::new(width.max(rest.len() + 1)).initial_indent(&first).subsequent_indent(&rest);
    let options =
        options.word_separator(textwrap::WordSeparator::AsciiSpace).word_splitter(textwrap::WordSplitter::NoHyphenation);
    format!("{}\n", textwrap::fill(words.trim_start(), options))
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
    fn a_table_that_does_not_fit_is_told_row_by_row_within_the_width() {
        let rows = [row(&["runs/stack", "94.4 %", "10", ""]), row(&["runs/tower", "8.5 %", "300", "train.rho=0.3"])];
        let header = ["run", "success", "demos", "settings"];
        assert_eq!(fitted_table(&header, &rows, Some(80)), text_table(&header, &rows));
        assert_eq!(fitted_table(&header, &rows, None), text_table(&header, &rows));
        let told =
            "runs/stack\n  success 94.4 %, demos 10\nruns/tower\n  success 8.5 %, demos 300,\n    settings train.rho=0.3\n";
        assert_eq!(fitted_table(&header, &rows, Some(30)), told);
    }

    #[test]
    fn words_are_wrapped_with_their_indent_and_none_is_lost() {
        assert_eq!(wrapped("  one two three", Some(9)), "  one two\n    three\n");
        assert_eq!(
            wrapped("a-long-word-that-fits-nowhere b", Some(5)).split_whitespace().collect::<String>(),
            "a-long-word-that-fits-nowhereb"
        );
        assert_eq!(wrapped("one two", None), "one two\n");
    }

    #[test]
    fn odd_rows_and_no_rows_are_kept() {
        assert_eq!(text_table(&["a", "b"], &[]), "a  b\n-  -\n");
        assert_eq!(text_table(&["name"], &[row(&["x", "extra"]), row(&[])]), "name\n----  -----\nx     extra\n\n");
    }
}
