//! The page: table and pictures in one file that needs no other.

use anyhow::Result;
use base64::Engine;
use conformance::pictures::{HEAT, Image, Pictures, heat};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use shadow_warp::{Lens, NearDepth};

use crate::measure::{Least, Lit, Report, Row};
use crate::picture::{BODY, Drawing, EYE, TEXELS, WARP, WORLD};
use crate::plot;
use crate::rendered::Rendered;
use crate::table::{ACROSS, COLUMNS, least_errors, plain, without_map};
use scenes::Job;

const STYLE: &str = "
:root { color-scheme: light; }
body { margin: 0; background: #f6f7f9; color: #1d2733; font: 16px/1.55 system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 36px 24px 64px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 6px; }
h2 { font-size: 21px; margin: 44px 0 8px; }
h3 { font-size: 17px; margin: 0 0 2px; }
p { margin: 6px 0; max-width: 82ch; }
.lead { color: #4a5766; }
.card { background: #fff; border: 1px solid #dfe4ea; border-radius: 8px; padding: 18px 20px; margin: 16px 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
.wide { overflow-x: auto; }
.results { width: 100%; font-size: 14.5px; }
.results th, .results td { text-align: right; padding: 7px 10px; border-bottom: 1px solid #e8ecf0; white-space: nowrap; }
.results th:first-child, .results td:first-child { text-align: left; padding-left: 2px; }
.results td:first-child { font-weight: 600; }
.results thead th { border-bottom: 2px solid #c3cad2; vertical-align: bottom; }
.unit { display: block; font-weight: 400; font-size: 12.5px; color: #66727f; }
.best { color: #0b6b3a; font-weight: 700; }
.facts th { text-align: left; font-weight: 600; padding: 3px 22px 3px 0; vertical-align: top; white-space: nowrap; }
.facts td { padding: 3px 0; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 4px 16px; margin: 8px 0; font-size: 14.5px; }
dt { font-weight: 600; } dd { margin: 0; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(320px, 1fr)); gap: 8px; margin-top: 8px; }
.drawn { display: grid; grid-template-columns: repeat(3, 1fr); gap: 8px; margin-top: 8px; align-items: end; }
.drawn figure { margin: 0; } .drawn img { width: 100%; display: block; }
.drawn figcaption { font-size: 13px; color: #4a5766; text-align: center; }
.scale { display: flex; font-size: 12px; margin: 6px 0; max-width: 640px; }
.scale span { flex: 1; text-align: center; padding: 3px 0; color: #fff; text-shadow: 0 0 3px #000; }
svg { max-width: 100%; height: auto; display: block; }
.legend { display: grid; grid-template-columns: repeat(auto-fit, minmax(310px, 1fr)); gap: 4px 24px; font-size: 14.5px; padding: 0; margin: 8px 0; list-style: none; }
.legend li { display: flex; gap: 10px; }
.legend i { flex: none; width: 24px; height: 0; border-top: 3px solid; margin-top: 10px; }
.legend i.dashed { border-top-style: dashed; }
.legend i.dotted { border-top-style: dotted; }
.caption { font-size: 14px; color: #4a5766; margin: 4px 0 0; max-width: none; }
@media print { body { background: #fff; } .card { break-inside: avoid; } }
";

/// Every picture of the page with a name for its file.
pub(crate) fn figures(report: &Report) -> Result<Vec<(String, String)>> {
    let mut figures = Vec::new();
    for rows in by_face(report) {
        let of_face = rows.iter().find_map(|row| row.face).map_or(String::new(), |face| format!("{face}-"));
        figures.push((format!("{of_face}depth.svg"), plot::depth_plot(rows)?));
        for row in rows {
            let drawing = Drawing::new(row);
            figures.push((format!("{of_face}{}-before.svg", row.name), drawing.before()));
            figures.push((format!("{of_face}{}-after.svg", row.name), drawing.after()));
        }
    }
    Ok(figures)
}

/// The rows of each face of a point light; of another light, all of them.
fn by_face(report: &Report) -> impl Iterator<Item = &[Row]> {
    report.techniques.chunk_by(|a, b| a.face == b.face)
}

pub(crate) fn html(job: &Job, report: &Report, rendered: &Result<Rendered, String>) -> Result<String> {
    let plots = by_face(report).map(|rows| Ok((rows, plot::depth_plot(rows)?))).collect::<Result<Vec<_>>>()?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "Shadow-map report: " (report.name) }
                style { (PreEscaped(STYLE)) }
            }
            body { main {
                h1 { "Shadow-map report: " (report.name) }
                p.lead {
                    "Every map below covers exactly the part of the scene that the camera sees in the light. They differ in where \
                     they spend their texels."
                }
                (facts(job, report))
                h2 { "Results" }
                (results(report))
                h2 { "Aliasing over depth" }
                @for (rows, plot) in plots { div.card {
                    @if let Some(face) = rows.iter().find_map(|row| row.face) { h3 { "face " (face) } }
                    (PreEscaped(plot))
                    p.caption {
                        "At each depth, the worst point of what the camera sees there; the highest point of a curve is the \
                         technique's worst in the table. Both axes are logarithmic"
                        @if !job.view.is_perspective() { ", but for the depth of an orthographic camera" }
                        ". A perfect map lies at 1 throughout; below it the map is finer than the picture."
                    }
                } }
                h2 { "The maps" }
                (legend(rendered))
                @for (i, row) in report.techniques.iter().enumerate() {
                    (technique(row, rendered.as_ref().ok().and_then(|rendered| rendered.pictures.get(i)))?)
                }
            } }
        }
    };
    Ok(page.into_string())
}

fn facts(job: &Job, report: &Report) -> Markup {
    let vector = |v: [f64; 3]| format!("({}, {}, {})", plain(v[0]), plain(v[1]), plain(v[2]));
    let light = match report.light {
        Lit::Directional { to_light } => format!("directional, towards {}", vector(to_light)),
        Lit::Spot { position, direction, outer_deg, near, range } => format!(
            "spot light at {}, shining along {}; outer angle {} degrees, near {}, range {}",
            vector(position),
            vector(direction),
            plain(outer_deg),
            plain(near),
            plain(range)
        ),
        Lit::Point { position, near, range } => {
            format!("point light at {}; near {}, range {}", vector(position), plain(near), plain(range))
        }
    };
    let view = &job.view;
    let lens = match view.lens() {
        Lens::Perspective(s) => format!(
            "perspective, tangents {} to {} across and {} to {} up",
            plain(s.left),
            plain(s.right),
            plain(s.bottom),
            plain(s.top)
        ),
        Lens::Orthographic(s) => {
            format!("orthographic, {} x {} units", plain(s.right - s.left), plain(s.top - s.bottom))
        }
    };
    let cuboid = |b: &shadow_warp::Bounds| format!("{} to {}", vector(b.min().to_array()), vector(b.max().to_array()));
    let ([map_x, map_y], [width, height]) = (job.map, job.viewport);
    html! {
        div.card {
            table.facts {
                tr { th { "Camera" } td {
                    "at " (vector(view.eye().to_array())) ", looking along " (vector(view.forward().to_array())) "; " (lens)
                    "; near " (plain(view.near())) ", far " (plain(view.far()))
                } }
                tr { th { "Light" } td { (light) } }
                @for receivers in &job.receivers { tr { th { "Receivers" } td { (cuboid(receivers)) } } }
                tr { th { "Casters" } td { (cuboid(&job.casters)) } }
                tr { th { "Sizes" } td { "map " (map_x) " x " (map_y) " texels, picture " (width) " x " (height) " pixels" } }
                @for (what, value) in options(job) { tr { th { (what) } td { (value) } } }
                @for note in &report.notes { tr { th { "Note" } td { (note) } } }
            }
        }
    }
}

/// What the scene says that it need not say.
fn options(job: &Job) -> Vec<(&'static str, String)> {
    let mut options = Vec::new();
    if let Some(axes) = job.axes {
        options
            .push(("Axes", format!("{axes:?}, of every technique, whatever its name; psm and plane have their own")));
    }
    if job.near_depth == NearDepth::Receivers {
        options.push(("Near plane", "at the receivers; casters before it are drawn with depth clamp".to_owned()));
    }
    if let Some([near, far]) = job.warp_depths {
        options.push(("Warp", format!("chosen for depths from {} to {}", plain(near), plain(far))));
    }
    options
}

fn results(report: &Report) -> Markup {
    let best = |face: Option<&str>| {
        let rows = report.techniques.iter().filter(|row| row.face == face);
        rows.map(|row| row.worst_pixels_per_texel).fold(f64::INFINITY, f64::min)
    };
    let is_best = |row: &Row, title: &str| title == "worst" && row.worst_pixels_per_texel <= best(row.face);
    html! {
        div.card {
            div.wide { table.results {
                thead { tr { @for column in COLUMNS {
                    th { (column.title) span.unit { (column.unit) @if column.unit.is_empty() { (PreEscaped("&nbsp;")) } } }
                } } }
                tbody { @for row in &report.techniques { tr { @for column in COLUMNS {
                    td class=[is_best(row, column.title).then_some("best")] { ((column.cell)(row)) }
                } } } }
            } }
            dl {
                @for column in COLUMNS.iter().skip(1) { dt { (column.title) } dd { (column.meaning) "." } }
            }
            @for line in without_map(report) { p { (line) } }
            @for (what, Least { along, across }) in least_errors(report) { p.caption {
                "Least" (what) ": " (plain(along)) " px/texel along, " (plain(across)) " " (ACROSS) "."
            } }
            p.caption { "The mean is taken over " (report.mean_over) "." }
        }
    }
}

fn legend(rendered: &Result<Rendered, String>) -> Markup {
    let items = [
        (BODY, "", "the body: the part of the receivers that the camera sees"),
        (EYE, "dashed", "the camera: its eye (dot) and the edges of its view volume"),
        (WARP, "", "the border of the map: the warp's frustum, cut across"),
        (WARP, "dotted", "its sides, towards the point where they meet"),
        (TEXELS, "", "lines of the texel grid, one for every 16th of the map"),
        (WORLD, "", "right picture: a regular grid in the world, as the map shows it"),
    ];
    html! {
        div.card {
            p {
                "Each technique is drawn twice, as the light sees it. The left picture shows the scene undistorted: small cells are \
                 where the map has its texels close together. The right picture shows the map itself, with all cells alike: \
                 what lies near the camera is drawn large there. The far end is at the top of both."
            }
            ul.legend { @for (colour, line, text) in items {
                li { i class=(line) style={ "border-color:" (colour) } {} span { (text) } }
            } }
            @match rendered {
                Ok(rendered) => {
                    p {
                        "Below them are pictures drawn through the map by " (rendered.device) ": the scene with its shadows, the depth \
                         map (dark is near the light), and the pixels that the longer side of a texel covers on the surfaces that are seen \
                         (grey: not in the light)."
                    }
                    (scale())
                }
                Err(reason) => p { "There are no drawn pictures: " (reason) "." }
            }
        }
    }
}

/// The colours of the pictures of pixels per texel.
fn scale() -> Markup {
    let [low, high] = HEAT;
    let values = std::iter::successors(Some(low), |&value| (value < high).then_some(2.0 * value));
    html! {
        div.scale { @for value in values {
            span style={ "background:rgb(" (heat(value).map(|c| c.to_string()).join(",")) ")" } { (plain(value)) }
        } }
    }
}

fn technique(row: &Row, pictures: Option<&Result<Pictures, String>>) -> Result<Markup> {
    let drawing = Drawing::new(row);
    Ok(html! {
        section.card {
            h3 { (row.title()) }
            p.lead { (row.technique.what) }
            div.pair {
                figure style="margin:0" { (PreEscaped(drawing.before())) }
                figure style="margin:0" { (PreEscaped(drawing.after())) }
            }
            @match pictures {
                Some(Ok(Pictures { shaded, depth, heat })) => div.drawn {
                    (figure(shaded, "the scene with its shadows")?)
                    (figure(depth, "the depth map")?)
                    (figure(heat, "pixels per texel")?)
                },
                Some(Err(reason)) => p { "There are no drawn pictures: " (reason) "." },
                None => {}
            }
            p.caption {
                "Ratio " (plain(row.warp_ratio)) ", worst " (plain(row.worst_pixels_per_texel)) " px/texel, mean "
                (plain(row.mean_pixels_per_texel)) " px/texel. Lines of the world's grid are "
                (drawing.units(drawing.world_spacing())) " apart."
            }
        }
    })
}

fn figure(image: &Image, what: &str) -> Result<Markup> {
    let data = base64::engine::general_purpose::STANDARD.encode(image.png()?);
    Ok(html! { figure { img alt=(what) src={ "data:image/png;base64," (data) }; figcaption { (what) } } })
}
