//! The techniques, in one table.

use shadow_warp::{Axes, Error, Fit, LightSpaceRule, Rule, ShadowMap};

/// A way to make a shadow map.
pub struct Technique {
    /// A short name, for tables and files.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    /// What chooses the warp.
    pub rule: Rule,
    /// Which directions the texture's axes follow.
    pub axes: Axes,
}

/// All techniques, in the order of the tables. The report and the conformance tests run over whatever is in this list.
pub const TECHNIQUES: &[Technique] = &[
    Technique {
        name: "uniform",
        what: "No warp: the plain map, focused on what is seen.",
        rule: Rule::Uniform,
        axes: Axes::View,
    },
    Technique {
        name: "lispsm",
        what: "Light-space perspective shadow map, the form of its authors' sample code: the default.",
        rule: Rule::LISPSM,
        axes: Axes::View,
    },
    Technique::light_space(
        "lispsm-extent",
        "The paper's rule with its refinement: far is near plus the body's extent along the warp.",
        LightSpaceRule::Extent,
    ),
    Technique::light_space(
        "lispsm-view-depth",
        "The paper's rule without its refinement: near and far are the body's depths in the view.",
        LightSpaceRule::ViewDepth,
    ),
    Technique::light_space(
        "lispsm-depth",
        "The rule of Wimmer and Scherzer (2005), taken literally.",
        LightSpaceRule::Depth,
    ),
    Technique {
        name: "lispsm-fixed-axes",
        what: "The default rule on a texel grid that does not turn with the camera.",
        rule: Rule::LISPSM,
        axes: Axes::LightFixed,
    },
];

impl Technique {
    const fn light_space(name: &'static str, what: &'static str, rule: LightSpaceRule) -> Self {
        Self { name, what, rule: Rule::LightSpace(rule), axes: Axes::View }
    }

    /// Returns the job as this technique fits it.
    #[must_use]
    pub fn fit<'a>(&self, fit: Fit<'a>) -> Fit<'a> {
        Fit { axes: self.axes, ..fit }
    }

    /// Returns the technique's map.
    ///
    /// # Errors
    /// As [`Fit::solve`].
    pub fn solve(&self, fit: Fit) -> Result<ShadowMap, Error> {
        self.fit(fit).solve(self.rule)
    }
}
