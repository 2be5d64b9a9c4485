//! The table's columns, for the terminal and for the page alike.

use std::fmt::Write;

use crate::measure::{Least, Refused, Report, Rounding, Row};

pub(crate) struct Column {
    pub(crate) title: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) meaning: &'static str,
    pub(crate) cell: fn(&Row) -> String,
}

pub(crate) const COLUMNS: &[Column] = &[
    Column { title: "technique", unit: "", meaning: "how the map is made", cell: Row::title },
    Column {
        title: "excess",
        unit: "eta",
        meaning: "the strength of the warp; 0 is the uniform map",
        cell: |row| short(row.eta),
    },
    Column {
        title: "ratio",
        unit: "1 + eta",
        meaning: "far over near distance of the warp's frustum",
        cell: |row| short(row.warp_ratio),
    },
    Column {
        title: "worst",
        unit: "px/texel",
        meaning: "pixels of the picture that the longer side of a texel covers, at the worst point of what is seen; \
                  1 is perfect, 10 shows steps of ten pixels. Exact: the worst point is a vertex of the body",
        cell: |row| short(row.worst_pixels_per_texel),
    },
    Column {
        title: "over least",
        unit: "times",
        meaning: "the worst over the larger of the two least errors below. They are for one direction and one centre of the warp, \
                  so this says what other ratios could gain, and no more: a map with another centre may have less across. Only \
                  for maps on the axes that they are for",
        cell: |row| row.worst_over_least.map_or("-".to_owned(), short),
    },
    Column {
        title: "mean",
        unit: "px/texel",
        meaning: "the same, averaged over what is seen; by volume most of it is far away, so the mean favours maps that neglect \
                  the foreground",
        cell: |row| short(row.mean_pixels_per_texel),
    },
    Column {
        title: "map used",
        unit: "%",
        meaning: "share of the map that the visible receivers cover; the other texels are never looked up",
        cell: |row| short(100.0 * row.map_share),
    },
    Column {
        title: "setup",
        unit: "ns",
        meaning: "time from the camera to the finished matrix (clipping the box and fitting the map), the fastest of 301 \
                  batches of 16 runs on this machine",
        cell: |row| format!("{:.0}", row.setup_ns),
    },
    Column {
        title: "f32 at eye",
        unit: "texels (bound)",
        meaning: "largest displacement of a receiver vertex when matrix, positions and products are rounded to f32, with \
                  positions relative to the eye; in brackets the proven bound",
        cell: |row| pair(row.f32_texels.eye, row.f32_texels.eye_bound),
    },
    Column {
        title: "f32 in world",
        unit: "texels (bound)",
        meaning: "the same, with positions in world space",
        cell: |row| {
            let Rounding { world, world_bound, .. } = row.f32_texels;
            pair(world, world_bound)
        },
    },
];

fn pair(seen: f64, bound: f64) -> String {
    format!("{} ({})", short(seen), short(bound))
}

/// Four significant digits.
pub(crate) fn short(x: f64) -> String {
    let size = x.abs();
    match size {
        _ if x.is_nan() => "beyond f32".to_owned(),
        _ if size == f64::INFINITY => "\u{221e}".to_owned(),
        0.0 => "0".to_owned(),
        1e4..1e7 => format!("{x:.0}"),
        1e3..1e4 => format!("{x:.1}"),
        100.0..1e3 => format!("{x:.1}"),
        10.0..100.0 => format!("{x:.2}"),
        1.0..10.0 => format!("{x:.3}"),
        1e-3..1.0 => format!("{x:.4}"),
        _ => format!("{x:.2e}"),
    }
}

/// The same without zeros that say nothing.
pub(crate) fn plain(x: f64) -> String {
    let text = short(x);
    let needless = text.contains('.') && !text.contains('e');
    if needless { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

impl Row {
    /// The technique, with the face of a point light.
    pub(crate) fn title(&self) -> String {
        titled(self.name, self.face)
    }
}

fn titled(name: &str, face: Option<&str>) -> String {
    face.map_or(name.to_owned(), |face| format!("{name} {face}"))
}

/// What has no map, and why: faces of a point light that need none, and techniques that refuse.
pub(crate) fn without_map(report: &Report) -> Vec<String> {
    let faces = report.faces.iter().filter_map(|face| Some((face.face, face.reason.as_ref()?)));
    let faces = faces.map(|(face, reason)| format!("face {face} needs no map: {reason}."));
    let refused = report.refused.iter().map(|Refused { name, face, reason }| {
        let title = titled(name, *face);
        format!("{title} has no map: {reason}.")
    });
    faces.chain(refused).collect()
}

/// What the least error across is, and is not.
pub(crate) const ACROSS: &str =
    "across over ratios, with this centre (along is a bound for any spacing of texels on these axes; across is none)";

/// The least errors, with the name of the face of a point light.
pub(crate) fn least_errors(report: &Report) -> Vec<(String, Least)> {
    let faces = report.faces.iter().filter_map(|face| Some((format!(" on face {}", face.face), face.least_errors?)));
    report.least_errors.map(|least| (String::new(), least)).into_iter().chain(faces).collect()
}

/// The table as text, or the reason why there is none.
pub(crate) fn text(report: &Report) -> String {
    if let Some(reason) = &report.reason {
        return format!("{}: no map is needed: {reason}\n", report.name);
    }
    let mut rows: Vec<Vec<String>> = vec![
        COLUMNS.iter().map(|column| column.title.to_owned()).collect(),
        COLUMNS.iter().map(|column| column.unit.to_owned()).collect(),
    ];
    rows.extend(report.techniques.iter().map(|row| COLUMNS.iter().map(|column| (column.cell)(row)).collect()));
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();

    let ([map_x, map_y], [width, height]) = (report.scene.map, report.scene.viewport);
    let mut out = format!("{}: map {map_x} x {map_y} texels, picture {width} x {height} pixels\n", report.name);
    for note in &report.notes {
        let _ = writeln!(out, "  {note}");
    }
    out.push('\n');
    for row in &rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        let _ = writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
    out.push('\n');
    for line in without_map(report) {
        let _ = writeln!(out, "{line}");
    }
    for (what, Least { along, across }) in least_errors(report) {
        let _ = writeln!(out, "least{what}: {} px/texel along, {} {ACROSS}.", short(along), short(across));
    }
    let _ = writeln!(out, "mean over {}.", report.mean_over);
    let _ = writeln!(out, "setup: the fastest of 301 batches of 16 runs, from the camera to the matrix.");
    let _ = writeln!(out, "f32: largest displacement of a receiver vertex (in brackets the proven bound).");
    out
}
