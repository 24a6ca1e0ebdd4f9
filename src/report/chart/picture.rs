//! What all charts share: frame, style, markers, words. No fonts, scripts or files from elsewhere. A picture brings its own background, light or
//! dark as the viewer prefers, so it is readable on any page. Looks differ by colour, marker and dash, so that it is readable in grey.

/// Looks that can be told apart.
pub const LOOKS: usize = 6;
/// Colours of Okabe and Ito that are told apart by colour-blind eyes, and stand out on white and on black.
const COLORS: [&str; LOOKS] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
/// Dash patterns.
const DASHES: [&str; LOOKS] = ["none", "6 4", "2 3", "10 3 2 3", "14 4", "1 5"];
/// Half a marker \[pixels\].
const MARKER: f64 = 4.5;
/// An average letter of a label \[pixels\].
const LETTER: f64 = 6.8;
/// An average letter of a chart's title \[pixels\].
const TITLE_LETTER: f64 = 8.4;
/// Names at the ends of lines stand this far apart at least \[pixels\].
const LINE: f64 = 14.0;
/// What a legend's entry has beside its letters \[pixels\].
const KEY: f64 = 48.0;

const STYLE: &str = "text{font-family:system-ui,-apple-system,Segoe UI,Helvetica,Arial,sans-serif;font-size:13px;fill:#24292f}\
    .chart-title{font-size:15px;font-weight:600}.chart-small{font-size:12px}.chart-back{fill:#ffffff}.chart-grid{stroke:#d0d7de;fill:none}\
    .chart-axis{stroke:#57606a;fill:none}\
    @media (prefers-color-scheme:dark){text{fill:#e6edf3}.chart-back{fill:#0d1117}.chart-grid{stroke:#30363d}.chart-axis{stroke:#8b949e}}";

/// A drawn chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Name of its file without ending, and of its elements on a page.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// The same for who cannot see it.
    pub description: String,
    /// Width and height \[pixels\].
    pub size: [f64; 2],
    /// Its elements.
    pub body: String,
}

impl Picture {
    /// As a file of its own.
    pub fn to_svg(&self) -> String {
        self.element(" xmlns=\"http://www.w3.org/2000/svg\"")
    }

    /// As an element of an HTML page, which needs no name space.
    pub fn inline(&self) -> String {
        self.element("")
    }

    fn element(&self, namespace: &str) -> String {
        let (id, [width, height]) = (&self.id, self.size);
        format!(
            "<svg{namespace} viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\" \
             aria-labelledby=\"{id}-title {id}-desc\">\n<title id=\"{id}-title\">{}</title>\n<desc id=\"{id}-desc\">{}</desc>\n\
             <style>{STYLE}</style>\n<rect class=\"chart-back\" width=\"{width}\" height=\"{height}\" rx=\"8\"/>\n{}</svg>\n",
            escaped(&self.title),
            escaped(&self.description),
            self.body
        )
    }
}

/// Colour and dash of a look, as attributes of a line.
pub(super) fn stroke(look: usize) -> String {
    let (color, dash) = (color(look), DASHES[look % LOOKS]);
    format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"")
}

pub(super) fn color(look: usize) -> &'static str {
    COLORS[look % LOOKS]
}

/// Circle, square, diamond, triangle, triangle on its tip or cross around a point.
pub(super) fn marker(look: usize, x: f64, y: f64, class: &str) -> String {
    let (m, side) = (MARKER, 2.0 * MARKER);
    let shape = match look % LOOKS {
        0 => format!("M{:.1} {y:.1}a{m} {m} 0 1 0 {side} 0a{m} {m} 0 1 0 -{side} 0z", x - m),
        1 => format!("M{:.1} {:.1}h{side}v{side}h-{side}z", x - m, y - m),
        2 => format!("M{x:.1} {:.1}l{m} {m}l-{m} {m}l-{m} -{m}z", y - m),
        3 => format!("M{x:.1} {:.1}l{m} {side}h-{side}z", y - m),
        4 => format!("M{x:.1} {:.1}l{m} -{side}h-{side}z", y + m),
        _ => {
            let arm = side / 3.0;
            let (left, top) = (x - arm / 2.0, y - m);
            format!("M{left:.1} {top:.1}h{arm}v{arm}h{arm}v{arm}h-{arm}v{arm}h-{arm}v-{arm}h-{arm}v-{arm}h{arm}z")
        }
    };
    format!("<path class=\"{class}\" d=\"{shape}\" fill=\"{}\"/>\n", color(look))
}

/// Names of looks, in a line that begins at `left`.
pub(super) fn legend(entries: &[(usize, &str)], left: f64, y: f64) -> String {
    let (mut svg, mut x) = (String::new(), left);
    for (look, name) in entries {
        svg += &format!("<path d=\"M{x:.1} {y:.1}h22\" {}/>\n", stroke(*look));
        svg += &marker(*look, x + 11.0, y, "key");
        svg += &text(x + 28.0, y + 4.0, "start", "", name);
        x += width_of(name) + KEY;
    }
    svg
}

/// Names at the ends of lines with their heights, moved apart where they would lie on each other, none below `bottom`.
pub(super) fn names_at(x: f64, mut names: Vec<(f64, &str)>, bottom: f64) -> String {
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    for i in 1..names.len() {
        names[i].0 = names[i].0.max(names[i - 1].0 + LINE);
    }
    let mut lowest = bottom;
    for name in names.iter_mut().rev() {
        name.0 = name.0.min(lowest);
        lowest = name.0 - LINE;
    }
    names.iter().map(|(y, name)| text(x, y + 4.0, "start", "chart-small", name)).collect()
}

/// A picture's width that holds its title, which begins at `left`, too.
pub(super) fn width_with(title: &str, left: f64, width: f64) -> f64 {
    width.max(2.0 * left + TITLE_LETTER * title.chars().count() as f64)
}

/// About how wide a label is \[pixels\].
pub(super) fn width_of(words: &str) -> f64 {
    LETTER * words.chars().count() as f64
}

pub(super) fn text(x: f64, y: f64, anchor: &str, class: &str, words: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" class=\"{class}\">{}</text>\n", escaped(words))
}

/// Words within XML and HTML.
pub fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
