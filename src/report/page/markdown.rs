//! A page as Markdown, its figures as files beside it.

use super::{Block, Page, Table};

impl Page {
    /// The text; figures are `figures/ID.svg`.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n\n{}", self.title, blocks(&self.lead));
        for section in &self.sections {
            text += &format!("## {}\n\n{}", section.title, blocks(&section.blocks));
        }
        text
    }
}

fn blocks(of: &[Block]) -> String {
    of.iter().map(block).collect()
}

fn block(of: &Block) -> String {
    match of {
        Block::Heading(words) => format!("### {words}\n\n"),
        Block::Words(words) => format!("{words}\n\n"),
        Block::List(items) => items.iter().map(|item| format!("- {item}\n")).collect::<String>() + "\n",
        Block::Table(of) => table(of),
        Block::Figure(picture, caption) => format!("![{}](figures/{}.svg)\n\n*{caption}*\n\n", picture.title, picture.id),
        Block::Details(title, inner) => format!("### {title}\n\n{}", blocks(inner)),
    }
}

fn table(of: &Table) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let cell = |words: &str| words.replace('|', "\\|");
    let head = |column: &super::Column| match column.group.as_str() {
        "" => cell(&column.name),
        group => format!("{}: {}", cell(group), cell(&column.name)),
    };
    let rules: String = of.columns.iter().map(|column| if column.number { "---:|" } else { "---|" }).collect();
    let mut text = format!("*{}*\n\n{}|{rules}\n", of.caption, line(of.columns.iter().map(head).collect()));
    for row in &of.rows {
        let strong = |c: &super::Cell| if c.strong { format!("**{}**", cell(&c.text)) } else { cell(&c.text) };
        text += &line(row.iter().map(strong).collect());
    }
    text + "\n"
}
