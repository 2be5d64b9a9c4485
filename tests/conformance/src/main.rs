//! Measures every technique on every rasteriser that there is, and prints the tables of `docs/conformance.md`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use conformance::check::{
    ANGLES, Containment, Origin, SIZES, SPACES, Shadows, changes, containment, conventions, far_away, ground_at,
    other_scenes, place, shadows,
};
use conformance::gpu::Gpu;
use conformance::pictures::{Image, Pictures, pictures};
use conformance::raster::Agreement;
use conformance::stage::Stage;
use scenes::{Model, TECHNIQUES, Technique};
use shadow_warp::glam::DVec3;
use shadow_warp::{Rule, Warp};

const INTRODUCTION: &str = include_str!("introduction.md");
/// Printed by `tests/mutants.sh rasteriser`.
const MUTANTS: &str = include_str!("mutants.md");

/// Measures every technique on every Vulkan driver that there is, and prints tables in Markdown.
///
/// It fails where there is no driver, or a check fails.
#[derive(Parser)]
#[command(name = "conformance")]
struct Cli {
    /// More scenes, from glTF files.
    #[arg(value_name = "FILE.glb|gltf")]
    scenes: Vec<PathBuf>,
    /// Where pictures of all scenes go, as PNG files: for each technique, in the order of the tables, the scene with its
    /// shadows, the depth map, and the pixels per texel.
    #[arg(long, value_name = "DIR", default_value = "target/conformance")]
    pictures: PathBuf,
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("conformance: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Whether every check passes.
fn run(cli: &Cli) -> Result<bool> {
    let gpus = Gpu::all()?;
    let mut models = other_scenes();
    for path in &cli.scenes {
        models.push(Model::from_gltf(path).with_context(|| path.display().to_string())?.0);
    }
    let gpu = Gpu::open()?;
    for model in [Model::ground()].iter().chain(&models) {
        draw(&gpu, model, &cli.pictures)?;
    }
    let others = models.iter().map(Stage::all).collect::<Result<Vec<Vec<Stage>>>>()?;
    let others: Vec<Stage> = others.into_iter().flatten().collect();
    let mut out = std::io::stdout().lock();
    writeln!(out, "{INTRODUCTION}")?;
    let mut passes = true;
    for gpu in &gpus {
        let (text, failures) = report(gpu, &others)?;
        passes &= failures.is_empty();
        let verdict = if failures.is_empty() { "Every check passes.\n" } else { "Failures:\n\n" };
        writeln!(out, "## {}\n\n{verdict}{failures}{text}", gpu.name)?;
    }
    writeln!(out, "{MUTANTS}")?;
    Ok(passes)
}

/// One picture of a scene with every technique that has a map; of a point light, one for each face.
fn draw(gpu: &Gpu, model: &Model, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for stage in Stage::with_picture(model, [384, 384])? {
        let drawn = running(&stage).map(|technique| pictures(gpu, &stage, technique)).collect::<Result<Vec<_>>>()?;
        let rows: Vec<_> = drawn.iter().map(|Pictures { shaded, depth, heat }| [shaded, depth, heat]).collect();
        let path = folder.join(format!("{}.png", stage.name.replace(' ', "")));
        std::fs::write(&path, Image::sheet(&rows).png()?).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The techniques that have a map for a stage. The others are in the table of [`refusals`].
fn running(stage: &Stage) -> impl Iterator<Item = &'static Technique> {
    TECHNIQUES.iter().filter(|technique| runs(stage, technique))
}

fn runs(stage: &Stage, technique: &Technique) -> bool {
    stage.refusal(technique, 256).is_none()
}

/// A table in Markdown, and whatever is not as it must be.
struct Table {
    text: String,
    failures: Vec<String>,
}

impl Table {
    fn new(title: &str, meaning: &str, columns: &[&str]) -> Self {
        let rule = "|---".repeat(columns.len());
        let text = format!("\n### {title}\n\n{meaning}\n\n| {} |\n{rule}|\n", columns.join(" | "));
        Self { text, failures: Vec::new() }
    }

    fn row(&mut self, cells: &[String]) {
        self.text += &format!("| {} |\n", cells.join(" | "));
    }

    fn check(&mut self, name: &str, failures: Vec<String>) {
        self.failures.extend(failures.into_iter().map(|failure| format!("- {name}: {failure}\n")));
    }
}

/// The tables, and whatever is not as it must be.
fn report(gpu: &Gpu, others: &[Stage]) -> Result<(String, String)> {
    let grounds = ANGLES.iter().map(|&angle| Ok((angle, ground_at(angle)?))).collect::<Result<Vec<(f64, Stage)>>>()?;
    let tables = [
        refusals(&grounds, others)?,
        places(gpu, &grounds)?,
        strong_warps(gpu, &grounds[0].1)?,
        clipping(gpu, &grounds, others)?,
        wrong_pixels(gpu, &grounds, others)?,
        derivatives(gpu, &grounds, others)?,
        interfaces(gpu, &grounds[1].1)?,
        distances(gpu)?,
    ];
    let failures = tables.iter().flat_map(|table| table.failures.clone()).collect();
    Ok((tables.into_iter().map(|table| table.text).collect(), failures))
}

fn refusals(grounds: &[(f64, Stage)], others: &[Stage]) -> Result<Table> {
    let mut table = Table::new(
        "Refused",
        "Where a technique has no map, and why. All other pairs of technique and scene are in the tables below.",
        &["technique", "scenes", "reason"],
    );
    for technique in TECHNIQUES {
        // Scenes by reason.
        let mut refused: Vec<(String, Vec<String>)> = Vec::new();
        for (name, stage) in by_name(grounds, others) {
            let Some(error) = stage.refusal(technique, 256) else { continue };
            let reason = error.to_string();
            match refused.iter_mut().find(|(other, _)| *other == reason) {
                Some((_, names)) => names.push(name),
                None => refused.push((reason, vec![name])),
            }
        }
        for (reason, names) in refused {
            table.row(&[technique.name.to_owned(), names.join(", "), reason]);
        }
    }
    Ok(table)
}

fn places(gpu: &Gpu, grounds: &[(f64, Stage)]) -> Result<Table> {
    let mut table = Table::new(
        "Depth and place",
        "160 triangles of all sizes in the receivers' body, at the six angles: the centre of a texel that is furthest on the wrong \
         side of an edge; the error in depth, also over what is allowed there.",
        &["technique", "map", "texels", "edge, texels", "depth", "of allowed"],
    );
    for technique in TECHNIQUES {
        for size in SIZES {
            let mut sum = Agreement::default();
            for (angle, stage) in grounds.iter().filter(|(_, stage)| runs(stage, technique)) {
                let (found, allowance) = place(gpu, stage, technique, stage.rule(technique)?, size, Origin::Eye)?;
                table.check(&format!("place, {}, {angle} degrees, {size}", technique.name), found.failures(&allowance));
                sum = sum.and(found);
            }
            let Agreement { texels, coverage, depth, depth_of_allowed, .. } = sum;
            let [coverage, depth, of_allowed] = [coverage, depth, depth_of_allowed].map(short);
            table.row(&[technique.name.to_owned(), size.to_string(), texels.to_string(), coverage, depth, of_allowed]);
        }
    }
    Ok(table)
}

fn strong_warps(gpu: &Gpu, stage: &Stage) -> Result<Table> {
    let mut table = Table::new(
        "Strong warps",
        "The same with `w` from 1 to 1000, at 90 degrees, by what matrix and positions are relative to. The first rows are the \
         map without warp.",
        &["warp", "map", "relative to", "edge, texels", "depth", "of allowed"],
    );
    let strong = Rule::Explicit(Warp::new(999.0)?);
    for (name, rule) in [("none", Rule::Uniform), ("1 : 1000", strong)] {
        for size in SIZES {
            for (about, origin) in [("the world's origin", Origin::World), ("the eye", Origin::Eye)] {
                let (found, allowance) = place(gpu, stage, &TECHNIQUES[0], rule, size, origin)?;
                table.check(&format!("strong warp, {size}, relative to {about}"), found.failures(&allowance));
                let [coverage, depth, of_allowed] = [found.coverage, found.depth, found.depth_of_allowed].map(short);
                table.row(&[name.to_owned(), size.to_string(), about.to_owned(), coverage, depth, of_allowed]);
            }
        }
    }
    Ok(table)
}

fn clipping(gpu: &Gpu, grounds: &[(f64, Stage)], others: &[Stage]) -> Result<Table> {
    let mut table = Table::new(
        "Containment",
        "The ground at the six angles and the other scenes, maps of 256 texels. *Clipped*: corners of the \
         receivers' body outside of the map. *Slack*: how far the body is from touching the furthest of the four sides. *Wrong*: of \
         the texels whose light reaches the body, those that do not hold the caster nearest to the light; with depths from casters \
         to receivers, and with those of receivers alone and depth clamp.",
        &["technique", "clipped", "in the border", "slack, texels", "texels", "wrong", "wrong, clamped"],
    );
    for technique in TECHNIQUES {
        let mut sum = Containment::default();
        for (name, stage) in by_name(grounds, others).filter(|(_, stage)| runs(stage, technique)) {
            let found = containment(gpu, stage, technique, 256)?;
            table.check(&format!("containment, {}, {name}", technique.name), found.failures());
            sum.clipped += found.clipped;
            sum.in_border += found.in_border;
            sum.slack = sum.slack.max(found.slack);
            sum.texels += found.texels;
            sum.wrong += found.wrong;
            sum.wrong_clamped += found.wrong_clamped;
        }
        let counts = |counts: &[usize]| counts.iter().map(usize::to_string).collect::<Vec<_>>();
        let [before, after] =
            [[sum.clipped, sum.in_border].to_vec(), [sum.texels, sum.wrong, sum.wrong_clamped].to_vec()];
        let row = [vec![technique.name.to_owned()], counts(&before), vec![short(sum.slack)], counts(&after)].concat();
        table.row(&row);
    }
    Ok(table)
}

fn wrong_pixels(gpu: &Gpu, grounds: &[(f64, Stage)], others: &[Stage]) -> Result<Table> {
    let mut names: Vec<String> = by_name(grounds, others).map(|(name, stage)| scene(&name, stage)).collect();
    names.dedup();
    let columns: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut table = Table::new(
        "Shadows",
        "Pixels of a picture of 224 x 224 that are wrong, of ten thousand, through a map of 1024 texels: the ground by the angle \
         between light and view, and the other scenes. Then the same pixels by reason, all scenes and maps together (the ground also \
         with 256 and 4096 texels): a shadow's edge within the texel, something in contact that the bias hides, a surface that \
         shadows itself; and pixels that are not as predicted.",
        &[&["technique"], columns.as_slice(), &["edge", "contact", "self", "unexplained", "compared"]].concat(),
    );
    for technique in TECHNIQUES {
        let (mut row, mut sum) = (vec![technique.name.to_owned()], Shadows::default());
        for column in &names {
            let mut at_1024 = Shadows::default();
            let of_column = |(name, stage): &(String, &Stage)| scene(name, stage) == *column && runs(stage, technique);
            for (name, stage) in by_name(grounds, others).filter(of_column) {
                let sizes = if stage.model.name == "ground" { &SIZES[..] } else { &[1024] };
                for &size in sizes {
                    let found = shadows(gpu, stage, technique, size)?;
                    table.check(&format!("shadows, {}, {name}, {size}", technique.name), found.failures());
                    sum = sum.and(found);
                    if size == 1024 {
                        at_1024 = at_1024.and(found);
                    }
                }
            }
            row.push(if at_1024.pixels > 0 { format!("{:.0}", 1e4 * at_1024.wrong()) } else { "refused".to_owned() });
        }
        row.extend([sum.edge, sum.contact, sum.acne, sum.unexplained, sum.pixels].map(|count| count.to_string()));
        table.row(&row);
    }
    Ok(table)
}

fn derivatives(gpu: &Gpu, grounds: &[(f64, Stage)], others: &[Stage]) -> Result<Table> {
    let mut table = Table::new(
        "Aliasing",
        "The derivatives of the shadow's coordinates, as `dpdxFine` and `dpdyFine` measure them, against their closed form half-way \
         between the two pixels, relative: median, 99 %, largest. Then the largest error against the exact difference, in texels of \
         1024, and over what rounding to `f32` explains. The worst of the six angles; in brackets the worst of the other scenes, \
         where far triangles are seen edge-on.",
        &["technique", "pairs", "median", "99 %", "largest", "texels", "of allowed"],
    );
    for technique in TECHNIQUES {
        let worst = |stages: &mut dyn Iterator<Item = &Stage>, table: &mut Table| -> Result<(usize, [f64; 5])> {
            let (mut pairs, mut worst) = (0, [0.0; 5]);
            for stage in stages.filter(|stage| runs(stage, technique)) {
                let found = changes(gpu, stage, technique, 1024)?;
                table.check(&format!("aliasing, {}, {}", technique.name, stage.name), found.failures());
                pairs += found.count();
                let [median, most, all] = [0.5, 0.99, 1.0].map(|share| found.quantile(share));
                let values = [median, most, all, found.texels, found.of_allowed];
                let worse = |a: f64, b: f64| if a > b || a.is_nan() { a } else { b };
                worst = std::array::from_fn(|i| worse(worst[i], values[i]));
            }
            Ok((pairs, worst))
        };
        let (pairs, on_ground) = worst(&mut grounds.iter().map(|(_, stage)| stage), &mut table)?;
        let (more, elsewhere) = worst(&mut others.iter(), &mut table)?;
        let both = on_ground.iter().zip(elsewhere).map(|(&a, b)| format!("{} ({})", short(a), short(b)));
        table.row(&[technique.name.to_owned(), (pairs + more).to_string()].into_iter().chain(both).collect::<Vec<_>>());
    }
    Ok(table)
}

fn interfaces(gpu: &Gpu, stage: &Stage) -> Result<Table> {
    let mut table = Table::new(
        "Conventions",
        "The ground at 60 degrees, LiSPSM, a map of 256 texels, in the conventions of every interface, undone to wgpu's: texels that \
         are covered otherwise, or hold another depth (by more than 1e-4); pixels of the picture that are lit otherwise; texels that \
         change without back faces, and that stay without front faces. A few texels have their centre on an edge of the \
         rasteriser's grid, and belong to another face when rows run the other way.",
        &["conventions", "texels", "coverage", "depth", "lit", "back faces", "no front face"],
    );
    let technique = Technique::named("lispsm").context("LiSPSM is a technique")?;
    for ((name, _), found) in SPACES.iter().zip(conventions(gpu, stage, technique, 256)?) {
        table.check(&format!("conventions, {name}"), found.failures());
        let [texels, coverage, depth, back, front] =
            [found.texels, found.coverage, found.depth, found.back, found.front].map(|count| count.to_string());
        table.row(&[(*name).to_owned(), texels, coverage, depth, short(found.lit), back, front]);
    }
    Ok(table)
}

fn distances(gpu: &Gpu) -> Result<Table> {
    let mut table = Table::new(
        "Far away",
        "The ground, moved away from the world's origin: how far the device displaces a corner of the receivers' body, with matrix and \
         positions rounded to `f32`, in texels of 1024; in brackets the crate's bound.",
        &["technique", "distance", "relative to the world's origin", "to the eye", "to the body"],
    );
    for technique in TECHNIQUES {
        for (name, distance) in [("0", 0.0), ("1e5", 1e5), ("1e7", 1e7)] {
            let stage = Stage::new(Model::ground().moved(DVec3::new(distance, 0.0, -distance)))?;
            let mut row = vec![technique.name.to_owned(), name.to_owned()];
            for origin in [Origin::World, Origin::Eye, Origin::Body] {
                let found = far_away(gpu, &stage, technique, 1024, origin)?;
                table.check(&format!("far away, {}, {distance}, {origin:?}", technique.name), found.failures());
                row.push(format!("{} ({})", short(found.displacement), short(found.bound)));
            }
            table.row(&row);
        }
    }
    Ok(table)
}

/// All stages: the ground's by angle.
fn by_name<'a>(grounds: &'a [(f64, Stage)], others: &'a [Stage]) -> impl Iterator<Item = (String, &'a Stage)> {
    let grounds = grounds.iter().map(|(angle, stage)| (format!("{angle}°"), stage));
    grounds.chain(others.iter().map(|stage| (stage.name.clone(), stage)))
}

/// The name of a scene, which has the faces of a point light together.
fn scene(name: &str, stage: &Stage) -> String {
    if stage.job.face.is_some() { stage.model.name.clone() } else { name.to_owned() }
}

/// Two significant digits or more.
fn short(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        0.001..0.01 => format!("{x:.4}"),
        0.01..0.1 => format!("{x:.3}"),
        0.1..10.0 => format!("{x:.2}"),
        10.0..1e4 => format!("{x:.0}"),
        _ => format!("{x:.1e}"),
    }
}
