//! The techniques, in one table.

use shadow_warp::glam::DVec3;
use shadow_warp::{Axes, Body, Error, Fit, LightSpaceRule, Plane, Rule};

use crate::job::Job;

/// A way to make a shadow map.
pub struct Technique {
    /// A short name, for tables and files.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    /// What chooses the warp, for a scene.
    pub rule: fn(&Job) -> Result<Rule, Error>,
    /// Which directions the texture's axes follow, where the scene does not say.
    pub axes: Axes,
}

/// All techniques, in the order of the tables. The report and the conformance tests run over
/// whatever is in this list.
pub const TECHNIQUES: &[Technique] = &[
    Technique {
        name: "uniform",
        what: "No warp: the plain map, focused on what is seen.",
        rule: |_| Ok(Rule::Uniform),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm",
        what: "Light-space perspective shadow map, the form of its authors' sample code: the default.",
        rule: |_| Ok(Rule::LISPSM),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm-extent",
        what: "The paper's rule with its refinement: far is near plus the body's extent along the warp.",
        rule: |_| Ok(Rule::LightSpace(LightSpaceRule::Extent)),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm-view-depth",
        what: "The paper's rule without its refinement: near and far are the body's depths in the view.",
        rule: |_| Ok(Rule::LightSpace(LightSpaceRule::ViewDepth)),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm-depth",
        what: "The rule of Wimmer and Scherzer (2005), taken literally.",
        rule: |_| Ok(Rule::LightSpace(LightSpaceRule::Depth)),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm-fixed-axes",
        what: "The default rule on a texel grid that does not turn with the camera.",
        rule: |_| Ok(Rule::LISPSM),
        axes: Axes::LightFixed,
    },
    Technique {
        name: "lispsm-on-axis",
        what: "LiSPSM's aim taken exactly: the least error at the two ends of the line of sight, for any angle and any light.",
        rule: |_| Ok(Rule::OnAxis),
        axes: Axes::View,
    },
    Technique {
        name: "lispsm-middle",
        what: "The default rule, with the warp along the middle of what is seen in place of the line of sight.",
        rule: |_| Ok(Rule::LISPSM),
        axes: Axes::Middle,
    },
    Technique {
        name: "tsm",
        what: "Trapezoidal shadow map: the first fifth of the depth gets four fifths of the map, fading out towards parallel \
               light and view.",
        rule: |_| Ok(Rule::TSM),
        axes: Axes::View,
    },
    Technique {
        name: "psm",
        what: "Perspective shadow map: the light's view of the camera's post-perspective space, without moving the camera back.",
        rule: |_| Ok(Rule::PSM),
        axes: Axes::View,
    },
    Technique {
        name: "plane",
        what: "As many pixels per texel all over one plane. The plane is a face of the receivers' boxes: the lowest one of all \
               along the world axis that the camera's up axis is most along.",
        rule: lowest_face,
        axes: Axes::View,
    },
    Technique {
        name: "optimal",
        what: "The exact best warp: the one whose worst texel is least.",
        rule: |_| Ok(Rule::OPTIMAL),
        axes: Axes::View,
    },
];

fn lowest_face(job: &Job) -> Result<Rule, Error> {
    let up = job.view.up();
    let size = up.abs();
    let axis = match size.to_array().map(|s| s >= size.max_element()) {
        [_, true, _] => DVec3::Y,
        [true, ..] => DVec3::X,
        _ => DVec3::Z,
    };
    let upward = axis * axis.dot(up).signum();
    let corners =
        job.receivers.iter().map(|bounds| if upward.element_sum() > 0.0 { bounds.min() } else { bounds.max() });
    let lowest = corners.reduce(|a, b| if upward.dot(b) < upward.dot(a) { b } else { a });
    Ok(Rule::Plane(Plane::new(upward, lowest.ok_or(Error::NothingVisible)?)?))
}

impl Technique {
    /// Returns the technique of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        TECHNIQUES.iter().find(|technique| technique.name == name)
    }

    /// Returns the axes of this technique for a job: the job's, where it has some.
    #[must_use]
    pub fn axes(&self, job: &Job) -> Axes {
        job.axes.unwrap_or(self.axes)
    }

    /// Returns the library's job as this technique fits it, for receivers that were cut by the
    /// job's view.
    #[must_use]
    pub fn fit<'a>(&self, job: &'a Job, receivers: &'a [Body]) -> Fit<'a> {
        Fit { axes: self.axes(job), ..job.fit(receivers) }
    }
}
