//! A page: headings, words, tables and figures, written as HTML and as Markdown.

mod html;
mod markdown;

use super::chart::Picture;

/// A page.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// What comes before the first section.
    pub lead: Vec<Block>,
    /// Sections, each of which the table of contents names.
    pub sections: Vec<Section>,
}

/// A part with a heading.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Its name in links.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// What it says.
    pub blocks: Vec<Block>,
}

/// A piece of a section. In words, `code` stands in backticks.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading below that of the section.
    Heading(String),
    /// A paragraph.
    Words(String),
    /// A list.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// A figure and its caption.
    Figure(Picture, String),
    /// What only some want to see, under a title.
    Details(String, Vec<Block>),
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows, a cell a column.
    pub rows: Vec<Vec<Cell>>,
}

/// The head of a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// What neighbours with the same word share; empty = nothing.
    pub group: String,
    /// Its name.
    pub name: String,
    /// Whether it is aligned right.
    pub number: bool,
}

/// A cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// Its words.
    pub text: String,
    /// Whether it stands out.
    pub strong: bool,
}

impl Column {
    /// Of words.
    pub fn words(name: &str) -> Self {
        Column { group: String::new(), name: name.into(), number: false }
    }

    /// Of numbers.
    pub fn number(name: &str) -> Self {
        Column { group: String::new(), name: name.into(), number: true }
    }

    /// Of numbers, beside others of the same group.
    pub fn of(group: &str, name: &str) -> Self {
        Column { group: group.into(), name: name.into(), number: true }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Cell { text: text.into(), strong: false }
    }
}

impl Page {
    /// All figures, those in details too.
    pub fn pictures(&self) -> Vec<&Picture> {
        let all = self.lead.iter().chain(self.sections.iter().flat_map(|section| &section.blocks));
        all.flat_map(Block::pictures).collect()
    }
}

impl Block {
    fn pictures(&self) -> Vec<&Picture> {
        match self {
            Block::Figure(picture, _) => vec![picture],
            Block::Details(_, blocks) => blocks.iter().flat_map(Block::pictures).collect(),
            _ => Vec::new(),
        }
    }
}

/// Pieces of words: plain, then in backticks, then plain, and so on. A backtick without a partner is a backtick.
fn pieces(words: &str) -> Vec<(bool, String)> {
    let mut parts: Vec<(bool, String)> = words.split('`').enumerate().map(|(i, part)| (i % 2 == 1, part.to_string())).collect();
    if let Some((true, tail)) = parts.last().cloned() {
        parts.pop();
        let before = parts.last_mut().expect("code begins behind a plain piece");
        before.1 += &format!("`{tail}");
    }
    parts
}
