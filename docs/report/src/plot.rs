//! Pixels per texel over depth, for all techniques.

use anyhow::{Context, Result, anyhow};
use plotters::chart::ChartContext;
use plotters::coord::combinators::{LogCoord, WithKeyPoints};
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;
use shadow_warp::{LitBody, aliasing};

use crate::measure::Row;
use crate::table::plain;
use scenes::Job;

/// Twice as large as shown: the plotting library places lines on whole pixels.
const SIZE: (u32, u32) = (2000, 900);
const STEPS: u32 = 240;
/// Colours that stay apart for colour-blind eyes; they repeat where there are more techniques.
const COLOURS: [RGBColor; 12] = [
    RGBColor(70, 76, 84),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 94, 240),
    RGBColor(140, 86, 50),
    RGBColor(220, 38, 127),
    RGBColor(150, 190, 60),
    RGBColor(0, 60, 80),
];

/// For one technique, pairs of depth and pixels per texel.
type Curve = Vec<(f64, f64)>;

/// Returns the plot. At each depth it shows the worst point of what is seen there, so that the
/// highest point of a curve is the technique's worst in the table.
pub(crate) fn depth_plot(rows: &[Row]) -> Result<String> {
    let first = rows.first().context("a plot has curves")?;
    let depths = depths(&first.job, &first.bodies);
    let curve = |row: &Row| depths.iter().filter_map(|&z| Some((z, worst_at(row, z)?))).collect();
    let curves: Vec<Curve> = rows.iter().map(curve).collect();
    let values = curves.iter().flatten().map(|point| point.1);
    let (low, high) = values.fold((f64::INFINITY, 0.0), |(low, high), x| (x.min(low), x.max(high)));
    let up = logarithmic(low / 1.3, high * 1.3);
    let (near, far) = (depths.first().copied().unwrap_or(0.0), depths.last().copied().unwrap_or(1.0));

    let mut picture = String::new();
    {
        let area = SVGBackend::with_string(&mut picture, SIZE).into_drawing_area();
        let mut chart = ChartBuilder::on(&area);
        chart.margin(20).x_label_area_size(96).y_label_area_size(130);
        // Depths of an orthographic camera may be negative.
        let drawn = if first.job.view.is_perspective() {
            let across = logarithmic(near / 1.03, far * 1.03);
            chart.build_cartesian_2d(across, up).and_then(|chart| draw(chart, rows, &curves))
        } else {
            let room = 0.02 * (far - near).max(1e-9 * near.abs().max(far.abs())).max(f64::MIN_POSITIVE);
            chart.build_cartesian_2d(near - room..far + room, up).and_then(|chart| draw(chart, rows, &curves))
        };
        drawn.and_then(|()| area.present()).map_err(|error| anyhow!("plot: {error}"))?;
    }
    Ok(picture)
}

type Drawn = std::result::Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn draw<'a, X>(
    mut chart: ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, WithKeyPoints<LogCoord<f64>>>>,
    rows: &[Row],
    curves: &[Curve],
) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .x_desc("depth along the view axis (world units)")
        .y_desc("worst pixels per texel at that depth")
        .x_label_formatter(&|x| plain(*x))
        .y_label_formatter(&|y| plain(*y))
        .x_labels(14)
        .label_style(("sans-serif", 26))
        .axis_desc_style(("sans-serif", 28))
        .bold_line_style(BLACK.mix(0.16))
        .light_line_style(BLACK.mix(0.05))
        .draw()?;
    for (i, (row, curve)) in rows.iter().zip(curves).enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), colour.stroke_width(4)))?
            .label(row.title())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 40, y)], colour.stroke_width(6)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font(("sans-serif", 26))
        .legend_area_size(50)
        .margin(16)
        .background_style(WHITE.mix(0.88))
        .border_style(BLACK.mix(0.25))
        .draw()
}

/// A logarithmic axis with marks at 1, 2 and 5 times powers of ten, or fewer where they would
/// crowd.
fn logarithmic(low: f64, high: f64) -> WithKeyPoints<LogCoord<f64>> {
    let decades = high.log10() - low.log10();
    let digits: &[f64] = if decades > 5.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let every = (decades / 12.0).ceil().max(1.0) as usize;
    let powers = (low.log10().floor() as i32..=high.log10().ceil() as i32).step_by(every);
    // Printed and read again, a power of ten is exact.
    let mark = |power: i32, digit: f64| format!("{digit}e{power}").parse::<f64>().ok();
    let marks = powers.flat_map(|power| digits.iter().filter_map(move |&digit| mark(power, digit)));
    let marks: Vec<f64> = marks.filter(|mark| (low..=high).contains(mark)).collect();
    (low..high).log_scale().with_key_points(marks)
}

/// The depths of the curves' points: evenly spread on the axis, and those of the bodies' vertices,
/// where the peaks are.
fn depths(job: &Job, bodies: &[LitBody]) -> Vec<f64> {
    let of_body = |body: &LitBody| body.vertices().iter().map(|&q| job.depth(body, q)).collect::<Vec<_>>();
    let mut depths: Vec<f64> = bodies.iter().flat_map(of_body).collect();
    depths.sort_by(f64::total_cmp);
    if let (Some(&near), Some(&far)) = (depths.first(), depths.last()) {
        let step = |i: u32| {
            let t = f64::from(i) / f64::from(STEPS);
            // The axis of a perspective camera is logarithmic: closer together where it begins.
            if job.view.is_perspective() { near + (far - near) * t * t * t } else { near + (far - near) * t }
        };
        depths.extend((1..STEPS).map(step).filter(|z| (near..=far).contains(z)));
        depths.sort_by(f64::total_cmp);
    }
    depths
}

/// The worst point of the bodies' sections at a depth, if there are some.
fn worst_at(row: &Row, z: f64) -> Option<f64> {
    row.bodies.iter().filter_map(|body| worst_of(row, body, z)).reduce(f64::max)
}

/// The worst point of a body's section at a depth. On a section pixels per texel are a convex
/// function, so the worst point is a corner: where an edge crosses.
fn worst_of(row: &Row, body: &LitBody, z: f64) -> Option<f64> {
    let job = &row.job;
    let vertices = body.vertices();
    let crossings = body.edges().filter_map(|(a, b)| {
        let (p, q) = (vertices[a], vertices[b]);
        let (at_p, at_q) = (job.depth(body, p) - z, job.depth(body, q) - z);
        (at_p * at_q <= 0.0).then(|| if at_p.abs() > 0.0 { p + (q - p) * (at_p / (at_p - at_q)) } else { p })
    });
    let worst = |q| aliasing::pixels_per_texel(&row.map, &job.view, job.viewport, q + body.origin());
    crossings.map(worst).reduce(f64::max)
}
