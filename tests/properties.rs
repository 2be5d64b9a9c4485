//! Properties of the fitted maps, on random scenes.
//!
//! The project numbers what must hold of every light-space perspective map; LSP-n stands for
//! property n of this list:
//!
//! | LSP | property | test |
//! |---|---|---|
//! | 1, 2 | all is inside; each of the six bounds is touched | `matrix::contains_and_touches` |
//! | 3, 4 | along the light x and y stay, and depth falls | `matrix::light_rays_stay_in_their_texel` |
//! | 5 | `w` runs from 1 to `1 + eta` over the receivers | `matrix::w_runs_from_one_to_the_ratio` |
//! | 6 | orthonormal axes; `Z . v` is `+sin gamma` | `light_space::axes_are_orthonormal` |
//! | 7 | an excess of nothing is the uniform map | `matrix::no_excess_is_uniform` |
//! | 8 | gradient of the `w` row | `matrix::w_gradient_is_the_view_across_the_light` |
//! | 9 | matrix y is `2s - 1`, with the odds law | `matrix::y_multiplies_the_odds` |
//! | 10 | move, turn and scale the world | `invariance` |
//! | 11 | depth conventions | `matrix::conventions_of_depth` |
//! | 12 | casters change depth alone | `matrix::casters_change_depth_alone` |
//! | 13 | winding | `matrix::winding` |
//! | 14 | the optimum has equal errors at both ends | `optimum::ends_are_equal` |
//! | 15 | the least error is at `sqrt(near far)` | `optimum::least_error_is_at_the_mean_depth` |
//! | 16 | no other excess has a smaller worst error | `optimum::no_other_excess_is_better` |
//! | 17 | uniform, PSM and optimum meet at `sqrt(near far)` | `optimum::three_warps_meet_at_the_mean_depth` |
//! | 18 | density is the derivative of the matrix | `derivatives::density_along_the_warp` |
//! | 19, 20 | cross ratios and planes are kept | `matrix::cross_ratios_and_planes_are_kept` |
//! | 21 | the excess is continuous and `<= d s/(2 z_n)` | `light_space::excess_is_continuous` |
//! | 22 | parallel and opposite are uniform, exactly | `light_space::parallel_is_uniform` |
//! | 23 | warps compose and invert | `optimum::warps_compose_and_invert` |
//! | 24 | PSM: all is inside, all sides are touched | `perspective::contains_and_touches` |
//! | 25 | PSM: along the light x and y stay, and depth falls, on either side of the camera plane | `perspective::light_rays_stay_in_their_texel` |
//! | 26 | PSM: continuous where the light passes the camera plane | `perspective::continuous_where_the_light_passes_the_camera_plane` |
//! | 27 | PSM: uniform with the light along the view | `perspective::a_sun_in_the_picture_makes_a_uniform_map` |
//! | 28 | PSM moved back by `sqrt(n f)` is LiSPSM | `perspective::moved_back_by_the_mean_depth_it_is_lispsm` |
//! | 29, 30 | TSM: all is inside; the focus is on its line; both ends are touched | `trapezoidal::focus_lands_on_its_line` |
//! | 31 | TSM: the paper's eight matrices | `trapezoidal::eight_matrices_make_the_same_map` |
//! | 32 | TSM is the family with its ratio | `trapezoidal::focus_lands_on_its_line` |
//! | 33 | spot lights: all is inside, all sides are touched | `spot::contains_and_touches` |
//! | 34 | spot lights: along the light x and y stay, and depth falls | `spot::light_rays_stay_in_their_texel` |
//! | 35 | spot lights: equal errors at both ends of the line of sight | `spot::errors_on_the_line_of_sight_are_equal` |
//! | 36, 37 | depth slopes | `tests/bias.rs` |
//! | 38 | least error on the line of sight, by brute force | `on_axis` |
//!
//! Each property is tried on scenes of each class, by a runner of its own. Tolerances are ratchets.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]
#![expect(clippy::disallowed_methods, reason = "tests may call what the library must not")]

mod oracle;
mod random;

#[path = "properties/aims.rs"]
mod aims;
#[path = "properties/derivatives.rs"]
mod derivatives;
#[path = "properties/invariance.rs"]
mod invariance;
#[path = "properties/lamps.rs"]
mod lamps;
#[path = "properties/light_space.rs"]
mod light_space;
#[path = "properties/long_run.rs"]
mod long_run;
#[path = "properties/matrix.rs"]
mod matrix;
#[path = "properties/on_axis.rs"]
mod on_axis;
#[path = "properties/optimum.rs"]
mod optimum;
#[path = "properties/options.rs"]
mod options;
#[path = "properties/perspective.rs"]
mod perspective;
#[path = "properties/plane.rs"]
mod plane;
#[path = "properties/spot.rs"]
mod spot;
#[path = "properties/trapezoidal.rs"]
mod trapezoidal;

/// How many scenes of each class a property is tried on.
const CASES: u32 = 200;

/// What LSP-1 and LSP-2 allow in normalised device coordinates: rounding of a product with the
/// matrix.
fn allowance(eta: f64) -> f64 {
    16.0 * f64::EPSILON * (1.0 + eta) + 1e-13
}
