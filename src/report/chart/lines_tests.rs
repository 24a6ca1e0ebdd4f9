//! What a line chart draws.

use super::*;

fn chart() -> Chart {
    let series = |name: &str, look: usize, first: f64, missing: usize| {
        let point = |x: usize| {
            let value = first + 0.05 * x as f64;
            Point { x: x as f64, value, interval: [value - 0.03, value + 0.01], singles: vec![value - 0.01; x + 1] }
        };
        Series { name: name.into(), look, points: (missing..3).map(point).collect(), dense: false }
    };
    let panel = |title: &str, first: f64| Panel {
        title: title.into(),
        series: vec![series("a & b", 0, first, 0), series("c<d", 1, first, 1)],
    };
    Chart {
        id: "some".into(),
        title: "\"success\" > 0".into(),
        description: "two panels".into(),
        x_label: "demos".into(),
        y_label: "success".into(),
        note: String::new(),
        x: Axis::Linear,
        percent: true,
        panels: vec![panel("one", 0.87), panel("two", 0.1)],
    }
}

#[test]
fn the_picture_parses_and_has_one_marker_for_each_datum() {
    let (chart, svg) = (chart(), chart().draw().to_svg());
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let count = |class: &str| document.descendants().filter(|n| n.attribute("class") == Some(class)).count();
    let points: Vec<&Point> = chart.panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.points).collect();
    assert_eq!((points.len(), count("mean"), count("interval"), count("key")), (10, 10, 10, 2));
    assert_eq!(count("single"), points.iter().map(|p| p.singles.len()).sum::<usize>());
    let words: Vec<&str> = document.descendants().filter_map(|n| n.text()).collect();
    for word in ["a & b", "c<d", "\"success\" > 0", "two panels", "demos", "0.5", "2", "80 %", "100 %", "0 %"] {
        assert!(words.contains(&word), "{word} is not written in {words:?}");
    }
}

#[test]
fn higher_values_stand_higher_and_inside_the_axes() {
    let svg = chart().draw().to_svg();
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let heights: Vec<f64> = document
        .descendants()
        .filter(|n| n.attribute("class") == Some("single"))
        .map(|n| n.attribute("cy").and_then(|y| y.parse().ok()).expect("a height"))
        .collect();
    assert!(heights.iter().all(|y| (TOP..=TOP + PLOT_HEIGHT).contains(y)), "{heights:?}");
    assert!(heights[0] > heights[1] && heights[1] > heights[3], "{heights:?}");
}

#[test]
fn a_dense_line_has_a_band_and_few_markers_and_leaves_out_what_the_axis_cannot_hold() {
    let mut chart = chart();
    let point = |x: u32| Point { x: f64::from(x), value: 0.5, interval: [0.4, 0.6], singles: vec![] };
    let line = Series { name: "long".into(), look: 2, points: (0..100).map(point).collect(), dense: true };
    (chart.x, chart.panels) = (Axis::Log, vec![Panel { title: String::new(), series: vec![line] }]);
    let svg = chart.draw().inline();
    assert_eq!((svg.matches("class=\"band\"").count(), svg.matches("class=\"mean\"").count()), (1, 6));
    assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("xmlns"), "{svg}");
}

#[test]
fn a_long_title_widens_the_picture() {
    let mut chart = chart();
    let narrow = chart.draw().size;
    chart.title = "w".repeat(200);
    assert_eq!(chart.draw().size, [200.0 * 8.4 + 2.0 * LEFT, narrow[1]]);
}
