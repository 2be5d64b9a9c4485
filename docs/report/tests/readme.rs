//! The links of README.md: each leads to a file that the packed crate has too.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

const README: &str = include_str!("../../../README.md");

/// The targets of links and pictures that lie in the project.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://")).filter_map(|target| target.split('#').next()).collect()
}

#[test]
fn links_lead_to_packed_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut command = Command::new(env!("CARGO"));
    command.current_dir(&root).args(["package", "--list", "--allow-dirty", "--offline", "--package", "shadow-warp"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let list = String::from_utf8(output.stdout).unwrap();
    let packed: BTreeSet<&str> = list.lines().collect();
    let links = links(README);
    assert!(links.len() > 8, "{links:?}");
    for link in links {
        assert!(packed.contains(link), "{link} is not in the packed crate");
    }
}
