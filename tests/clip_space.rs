//! Conventions by their meaning: named points of a scene land where each interface's documents say.

#![expect(clippy::unwrap_used, reason = "a scene that cannot be built is a broken test")]

mod random;

use approx::assert_abs_diff_eq;
use random::basic::{mixture, signed};
use random::measure::{Scene, box_between, project};
use random::views::Class;
use random::{casters, check, prop};
use shadow_warp::glam::{DMat4, DVec2, DVec3};
use shadow_warp::{Axes, ClipSpace, DepthRange, NearDepth, Rule, ShadowMap, View};

const ALL: [ClipSpace; 9] = [
    ClipSpace::WGPU,
    ClipSpace::DIRECT3D,
    ClipSpace::METAL,
    ClipSpace::VULKAN,
    ClipSpace::OPENGL,
    ClipSpace::OPENGL_ZERO_TO_ONE,
    ClipSpace::WGPU.reversed(),
    ClipSpace::VULKAN.reversed(),
    ClipSpace::OPENGL.reversed(),
];

/// Of coordinates of at most 1: one rounding.
const ROUNDING: f64 = f64::EPSILON;

/// A camera along z sees all of a box; the light stands above it. Right in the picture is -x: the world is
/// right-handed.
fn scene() -> Scene {
    let seen = box_between(DVec3::new(-2.0, -1.0, 4.0), DVec3::new(2.0, 1.0, 9.0));
    let view = View::perspective(DVec3::ZERO, DVec3::Z, DVec3::Y, 2.0, 1.5, 0.1..100.0).unwrap();
    let mut scene = Scene::new(view, DVec3::Y, &[seen], seen);
    scene.near_depth = NearDepth::Receivers;
    scene
}

fn map() -> ShadowMap {
    scene().fit().solve(Rule::Uniform).unwrap()
}

/// Where the corner of the box that is far, right and low lies in clip space, interface by interface, from their
/// documents.
#[test]
fn named_points_land_where_the_documents_say() {
    let far_right_low = DVec3::new(-2.0, -1.0, 9.0);
    let near_left_high = DVec3::new(2.0, 1.0, 4.0);
    let expected = [
        (ClipSpace::WGPU, [1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]),
        (ClipSpace::DIRECT3D, [1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]),
        (ClipSpace::METAL, [1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]),
        (ClipSpace::VULKAN, [1.0, -1.0, 1.0], [-1.0, 1.0, 0.0]),
        (ClipSpace::OPENGL, [1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]),
        (ClipSpace::OPENGL_ZERO_TO_ONE, [1.0, 1.0, 1.0], [-1.0, -1.0, 0.0]),
        (ClipSpace::WGPU.reversed(), [1.0, 1.0, 0.0], [-1.0, -1.0, 1.0]),
        (ClipSpace::VULKAN.reversed(), [1.0, -1.0, 0.0], [-1.0, 1.0, 1.0]),
        (ClipSpace::OPENGL.reversed(), [1.0, 1.0, 0.0], [-1.0, -1.0, 1.0]),
    ];
    for (space, far, near) in expected {
        let matrix = map().clip_from_world(space);
        for (point, ndc) in [(far_right_low, far), (near_left_high, near)] {
            let landed = project(matrix * point.extend(1.0));
            assert_abs_diff_eq!(landed, DVec3::from_array(ndc), epsilon = ROUNDING);
        }
    }
}

/// In texture coordinates the same points lie in the same place of the picture, counted from the texture's first row,
/// and depth is what the depth buffer holds.
#[test]
fn texture_coordinates_find_what_was_drawn() {
    for space in ALL {
        let matrix = map().texture_from_world_at(DVec3::ZERO, space);
        let top = if space.texture_top_first { 0.0 } else { 1.0 };
        let near_depth = if space.depth == DepthRange::OneToZero { 1.0 } else { 0.0 };
        let cases = [
            (DVec3::new(-2.0, -1.0, 9.0), DVec3::new(1.0, top, 1.0 - near_depth)),
            (DVec3::new(2.0, 1.0, 9.0), DVec3::new(0.0, top, near_depth)),
            (DVec3::new(-2.0, 1.0, 4.0), DVec3::new(1.0, 1.0 - top, near_depth)),
            (DVec3::new(0.0, 0.0, 6.5), DVec3::new(0.5, 0.5, 0.5)),
        ];
        for (point, texture) in cases {
            let landed = project(matrix * point.extend(1.0));
            assert_abs_diff_eq!(landed, texture, epsilon = ROUNDING);
        }
        assert_eq!(matrix, space.texture_from_clip() * map().clip_from_world(space));
    }
}

/// The row of pixels that a rasteriser writes is the row that the texture coordinates read.
#[test]
fn rasterised_rows_are_read_back() {
    for space in ALL {
        let (clip, texture) = (map().clip_from_world(space), map().texture_from_world_at(DVec3::ZERO, space));
        for point in [DVec3::new(0.5, 0.0, 5.0), DVec3::new(-1.5, 0.25, 8.0)] {
            let ndc = project(clip * point.extend(1.0));
            // Viewport transforms: Vulkan's y and OpenGL's row number grow with y of the device, the others' against
            // it.
            let rows_grow_with_y = space.y_down || !space.texture_top_first;
            let row = if rows_grow_with_y { 0.5 + 0.5 * ndc.y } else { 0.5 - 0.5 * ndc.y };
            let read = project(texture * point.extend(1.0));
            assert_abs_diff_eq!(read.truncate(), DVec2::new(0.5 + 0.5 * ndc.x, row), epsilon = ROUNDING);
        }
    }
}

#[test]
fn reversing() {
    assert_eq!(ClipSpace::DIRECT3D, ClipSpace::WGPU);
    for space in ALL {
        let twice = space.reversed().reversed();
        let from_minus_one = space.depth == DepthRange::NegativeOneToOne;
        assert_eq!(twice, if from_minus_one { ClipSpace::OPENGL_ZERO_TO_ONE } else { space });
        assert_ne!(space.reversed(), space);
    }
}

/// Twice the area of a triangle in the plane of the picture.
fn area(matrix: &DMat4, triangle: [DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|p| project(*matrix * p.extend(1.0)).truncate());
    DVec2::perp_dot(b - a, c - a)
}

/// A triangle that faces the light has the winding that it has for an ordinary camera of the same interface at the
/// light.
#[test]
fn winding_is_that_of_an_ordinary_camera() {
    let (mut cases, mut seen) = (0, 0);
    for class in [Class::Realistic, Class::OffCentre, Class::Orthographic, Class::Mirrored] {
        let axes = prop::sample::select(vec![Axes::View, Axes::LightFixed]);
        let input = (casters::scene(class), axes, mixture(), signed());
        check(&format!("winding/{class:?}"), 100, input, |(job, axes, place, slope)| {
            cases += 1;
            let scene = Scene::new(job.view, job.to_light, &[job.receivers], job.casters);
            let scene = Scene { axes, ..scene };
            let Ok(map) = scene.fit().solve(Rule::LISPSM) else { return };
            seen += 1;
            let points = scene.receivers(map.origin());
            let size = points.iter().map(|p| p.length()).fold(1e-6, f64::max) * 1e-6;
            let l = scene.to_light();
            let across = l.any_orthonormal_vector() * size;
            // Counter-clockwise, seen from the light; sloped, but still facing it.
            let slope = l * size * 3.0 * slope;
            let corner = place.of(&points);
            let triangle = [corner, corner + across + slope, corner + l.cross(across)];

            // An ordinary camera in a right-handed world: right, up and backward are right-handed.
            let (right, up) = (across / size, l.cross(across) / size);
            for space in ALL {
                let y_sign = if space.y_down { -1.0 } else { 1.0 };
                let picture = triangle.map(|p| DVec2::new(right.dot(p), y_sign * up.dot(p)));
                let ordinary = (picture[1] - picture[0]).perp_dot(picture[2] - picture[0]);
                let drawn = area(&map.clip_from_world_at(map.origin(), space), triangle);
                assert!(ordinary * drawn > 0.0, "{space:?}: {ordinary} {drawn}");
            }
        });
    }
    assert!(2 * seen > cases, "{seen} of {cases} see anything");
}
