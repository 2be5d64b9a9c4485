//! Says how good each shadow-map technique is for a camera, a light and the bounds of a scene: a
//! table on standard output, and a page with pictures.

mod mean;
mod measure;
mod page;
mod picture;
mod place;
mod plot;
mod quiet;
mod rendered;
mod survey;
mod table;

use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use clap::error::ErrorKind as Usage;

use measure::Report;
use scenes::{GltfScene, Model, Scene, echo};

/// Says how good each shadow-map technique is for a camera, a light and the bounds of a scene.
///
/// Without arguments it reports on an embedded scene, the configuration of the LiSPSM paper; it
/// stands below.
#[derive(Parser)]
#[command(name = "report", version, after_help = AFTER_HELP)]
struct Cli {
    /// Read the scene from a JSON file; `-` is standard input.
    #[arg(long, value_name = "FILE.json", conflicts_with = "gltf")]
    scene: Option<PathBuf>,
    /// Read bounds, camera and directional light from a glTF file; what it lacks is made up from
    /// its bounds.
    #[arg(long, value_name = "FILE.glb|gltf")]
    gltf: Option<PathBuf>,
    /// Where the page goes. By default `target/report/<scene name>.html`; with `--json`, nowhere.
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Also write the pictures into this folder, as SVG files.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// Print the results as JSON, and nothing else.
    #[arg(long)]
    json: bool,
    /// Print the survey of the techniques over some hundreds of settings, and nothing else:
    /// `docs/survey.md`.
    #[arg(long, conflicts_with_all = ["scene", "gltf", "out", "figures", "json"])]
    survey: bool,
}

const EMBEDDED: &str = include_str!("../scenes/paper.json");
const AFTER_HELP: &str =
    concat!("An example of a scene; docs/scene-format.md has every field:\n", include_str!("../scenes/paper.json"));

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if matches!(error.kind(), Usage::DisplayHelp | Usage::DisplayVersion) => {
            // A closed pipe is the reader's choice.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            let text = error.to_string();
            let lines: Vec<&str> = text.lines().take_while(|line| !line.is_empty()).map(str::trim).collect();
            let message = lines.join(" ");
            let message = message.trim_start_matches("error: ");
            // What it quotes stands between apostrophes, or between the first and the last if it
            // has some itself.
            let parts = [message.find('\''), message.rfind('\'')].map(|at| at.unwrap_or(message.len()));
            let (quoted, [before, after]) =
                (&message[parts[0]..parts[1]], [&message[..parts[0]], &message[parts[1]..]]);
            return fail(&format!("{before}{}{after} (see --help)", echo(quoted)));
        }
    };
    quiet::without_mesas_layer();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => fail(&format!("{error:#}")),
    }
}

fn run(cli: &Cli) -> Result<()> {
    if cli.survey {
        std::io::stdout().write_all(survey::page()?.as_bytes())?;
        return Ok(());
    }
    let Source { name, stem, scene, notes, file } = read(cli)?;
    let job = scene.validated().with_context(|| name.clone())?;
    let report = measure::report(&stem, scene, notes, &job).with_context(|| name)?;

    // The page first: where it cannot be written, the error is all there is.
    let page = page_path(cli, &report);
    let mut drawn_by = String::new();
    if let Some(path) = &page {
        let rendered = model(&report, file.as_ref())
            .and_then(|model| rendered::rendered(&model, &report.techniques))
            .map_err(|error| format!("{error:#}"));
        write_file("--out", path, &page::html(&job, &report, &rendered)?)?;
        drawn_by = match rendered {
            Ok(rendered) => format!("with pictures drawn by {}", rendered.device),
            Err(reason) => format!("without drawn pictures: {reason}"),
        };
    }
    if let Some(folder) = &cli.figures {
        for (name, picture) in page::figures(&report)? {
            write_file("--figures", &folder.join(name), &picture)?;
        }
    }
    let mut stdout = std::io::stdout().lock();
    if cli.json {
        serde_json::to_writer(&mut stdout, &report).map_err(std::io::Error::from)?;
        writeln!(stdout)?;
    } else {
        write!(stdout, "{}", table::text(&report))?;
        if let Some(path) = page {
            writeln!(stdout, "\npage: {}, {drawn_by}", path.display())?;
        }
    }
    stdout.flush()?;
    Ok(())
}

/// Where a scene comes from.
struct Source {
    /// For messages.
    name: String,
    /// For tables and files.
    stem: String,
    scene: Scene,
    /// What was made up in it.
    notes: Vec<String>,
    /// The file with its triangles, if it has some.
    file: Option<GltfScene>,
}

fn read(cli: &Cli) -> Result<Source> {
    if let Some(path) = &cli.gltf {
        let name = shown(path);
        let file = GltfScene::read(path).with_context(|| name.clone())?;
        return Ok(Source {
            name,
            stem: name_of(path),
            scene: file.scene.clone(),
            notes: file.notes.clone(),
            file: Some(file),
        });
    }
    let (name, stem, text) = match &cli.scene {
        None => ("paper".to_owned(), "paper".to_owned(), EMBEDDED.as_bytes().to_owned()),
        Some(path) if path == Path::new("-") => {
            let mut text = Vec::new();
            std::io::stdin().read_to_end(&mut text).context("standard input")?;
            ("stdin".to_owned(), "stdin".to_owned(), text)
        }
        Some(path) => {
            let name = shown(path);
            let text = std::fs::read(path).with_context(|| name.clone())?;
            (name, name_of(path), text)
        }
    };
    let scene = Scene::parse(&text).with_context(|| name.clone())?;
    Ok(Source { name, stem, scene, notes: Vec::new(), file: None })
}

/// What the pictures show: the file's triangles, or some made up to fill the boxes.
fn model(report: &Report, file: Option<&GltfScene>) -> Result<Model> {
    let (name, scene) = (report.name.as_str(), report.scene.clone());
    match file {
        Some(file) => Ok(Model { name: name.to_owned(), scene, triangles: file.triangles()? }),
        None => Ok(Model::furnished(name, scene)),
    }
}

/// A file's name without folder and extension.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.unwrap_or_else(|| "scene".to_owned())
}

/// A path, as far as an error repeats it.
fn shown(path: &Path) -> String {
    echo(&path.display().to_string())
}

/// Where the page goes, if there is to be one. Without techniques there is nothing to draw.
fn page_path(cli: &Cli, report: &Report) -> Option<PathBuf> {
    if report.techniques.is_empty() {
        return None;
    }
    let by_default = || Path::new("target/report").join(format!("{}.html", report.name));
    cli.out.clone().or_else(|| (!cli.json).then(by_default))
}

fn write_file(option: &str, path: &Path, text: &str) -> Result<()> {
    let place = || format!("{option} {}", shown(path));
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(place)?;
    }
    std::fs::write(path, text).with_context(place)
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}

/// One line on standard error, whatever the message quotes.
fn fail(message: &str) -> ExitCode {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let _ = writeln!(std::io::stderr(), "report: {line}");
    ExitCode::from(2)
}
