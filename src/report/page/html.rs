//! A page as one HTML file: nothing is loaded from elsewhere, nothing runs.

use super::{Block, Page, Table, pieces};
use crate::report::chart::escaped;
use std::fmt::Write;

const STYLE: &str = include_str!("style.css");

impl Page {
    /// The file.
    pub fn to_html(&self) -> String {
        let title = escaped(&self.title);
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"generator\" content=\"hilt report\"/>\n<meta name=\"viewport\" content=\"width=device-width, \
             initial-scale=1\"/>\n<meta name=\"color-scheme\" content=\"light dark\"/>\n<title>{title}</title>\n<link rel=\"icon\" href=\"data:,\"/>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n{}</header>\n",
            blocks(&self.lead)
        );
        html += "<nav aria-label=\"Contents\">\n<h2>Contents</h2>\n<ol>\n";
        for section in &self.sections {
            let _ = writeln!(html, "<li><a href=\"#{}\">{}</a></li>", section.id, escaped(&section.title));
        }
        html += "</ol>\n</nav>\n<main>\n";
        for section in &self.sections {
            let (id, title) = (&section.id, escaped(&section.title));
            let _ = writeln!(html, "<section id=\"{id}\">\n<h2>{title}</h2>\n{}</section>", blocks(&section.blocks));
        }
        html + "</main>\n</body>\n</html>\n"
    }
}

fn blocks(of: &[Block]) -> String {
    of.iter().map(block).collect()
}

fn block(of: &Block) -> String {
    match of {
        Block::Heading(words) => format!("<h3>{}</h3>\n", inline(words)),
        Block::Words(words) => format!("<p>{}</p>\n", inline(words)),
        Block::List(items) => {
            let items: String = items.iter().map(|item| format!("<li>{}</li>\n", inline(item))).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Block::Table(of) => table(of),
        Block::Figure(picture, caption) => {
            let (id, svg, caption) = (&picture.id, picture.inline(), inline(caption));
            format!("<figure id=\"{id}\">\n<div class=\"wide\">\n{svg}</div>\n<figcaption>{caption}</figcaption>\n</figure>\n")
        }
        Block::Details(title, inner) => {
            format!("<details>\n<summary>{}</summary>\n{}</details>\n", inline(title), blocks(inner))
        }
    }
}

fn table(of: &Table) -> String {
    let mut html = format!("<div class=\"wide\">\n<table>\n<caption>{}</caption>\n<thead>\n", inline(&of.caption));
    let class = |number: bool| if number { " class=\"number\"" } else { "" };
    if of.columns.iter().any(|column| !column.group.is_empty()) {
        html += "<tr>";
        let mut at = 0;
        while at < of.columns.len() {
            let group = &of.columns[at].group;
            let span = of.columns[at..].iter().take_while(|column| !group.is_empty() && column.group == *group).count().max(1);
            let scope = if group.is_empty() { "" } else { " scope=\"colgroup\"" };
            let _ = write!(html, "<th colspan=\"{span}\"{scope} class=\"group\">{}</th>", inline(group));
            at += span;
        }
        html += "</tr>\n";
    }
    html += "<tr>";
    for column in &of.columns {
        let _ = write!(html, "<th scope=\"col\"{}>{}</th>", class(column.number), inline(&column.name));
    }
    html += "</tr>\n</thead>\n<tbody>\n";
    for row in &of.rows {
        html += "<tr>";
        for (i, (cell, column)) in row.iter().zip(&of.columns).enumerate() {
            let words = inline(&cell.text);
            let words = if cell.strong { format!("<strong>{words}</strong>") } else { words };
            let _ = match i {
                0 => write!(html, "<th scope=\"row\">{words}</th>"),
                _ => write!(html, "<td{}>{words}</td>", class(column.number)),
            };
        }
        html += "</tr>\n";
    }
    html + "</tbody>\n</table>\n</div>\n"
}

fn inline(words: &str) -> String {
    let piece = |(code, words): (bool, String)| {
        let words = escaped(&words);
        if code { format!("<code>{words}</code>") } else { words }
    };
    pieces(words).into_iter().map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Block, Cell, Column, Page, Section, Table};

    fn page() -> Page {
        let table = Table {
            caption: "a < b".into(),
            columns: vec![Column::words("name"), Column::of("pick-up", "paper"), Column::of("pick-up", "ours")],
            rows: vec![vec!["x | y".into(), ".5".into(), Cell { text: "1".into(), strong: true }]],
        };
        let words = Block::Words("run `hilt <x>` & wait ` ".into());
        let section = Section { id: "s".into(), title: "A & B".into(), blocks: vec![words, Block::Table(table)] };
        Page { title: "T".into(), lead: vec![Block::List(vec!["one".into()])], sections: vec![section] }
    }

    #[test]
    fn words_are_escaped_and_tables_have_heads() {
        let html = page().to_html();
        for part in [
            "<p>run <code>hilt &lt;x&gt;</code> &amp; wait ` </p>",
            "<a href=\"#s\">A &amp; B</a>",
            "<th colspan=\"1\" class=\"group\"></th><th colspan=\"2\" scope=\"colgroup\" class=\"group\">pick-up</th>",
            "<th scope=\"row\">x | y</th><td class=\"number\">.5</td><td class=\"number\"><strong>1</strong></td>",
            "<caption>a &lt; b</caption>",
        ] {
            assert!(html.contains(part), "{part} is missing in {html}");
        }
    }

    #[test]
    fn markdown_says_the_same() {
        let text = page().to_markdown();
        for part in [
            "# T\n",
            "- one\n",
            "## A & B\n",
            "| name | pick-up: paper | pick-up: ours |\n|---|---:|---:|\n| x \\| y | .5 | **1** |\n",
        ] {
            assert!(text.contains(part), "{part} is missing in {text}");
        }
    }
}
