//! Scenes with triangles: made up, or from a glTF file.

use std::path::Path;

use anyhow::{Context, Result};
use fastrand::Rng;
use shadow_warp::glam::{DVec2, DVec3};

use crate::gltf_scene::GltfScene;
use crate::scene::{Boxes, Camera, Cuboid, Lamp, Point, Scene, Spot};
use crate::solid::{Triangles, cuboid, floor, frustum, turned};

/// A scene that can be drawn. Triangles run counter-clockwise as seen from outside.
#[derive(Clone, Debug)]
pub struct Model {
    /// A short name, for tables and files.
    pub name: String,
    /// Camera, light, bounds and sizes.
    pub scene: Scene,
    /// The corners of all triangles, in world space.
    pub triangles: Vec<[DVec3; 3]>,
}

const MAP: [u32; 2] = [1024, 1024];
const VIEWPORT: [u32; 2] = [512, 512];

impl Model {
    /// Returns a ground with poles and boxes over the configuration of the LiSPSM paper: a view of
    /// 60 degrees, near 1, far 400, over 400 x 50 x 400 units; the camera is bent down by 20
    /// degrees.
    #[must_use]
    pub fn ground() -> Self {
        let bounds = Cuboid { min: [-200.0, 0.0, -200.0], max: [200.0, 50.0, 200.0] };
        let down = DVec2::from_angle(-20_f64.to_radians());
        let view = camera([0.0, 20.0, -190.0], [0.0, down.y, down.x], 60.0, 1.0, Some(400.0));
        let light = Lamp::directional([0.4, 0.866, -0.3]);
        Self::furnished("ground", scene(view, light, [bounds; 2]))
    }

    /// Returns a scene with made-up contents: a ground over the bottom of the receivers' box, and
    /// poles and boxes in the casters' box. Where a scene has a list of boxes in place of one, each
    /// of them is a solid.
    #[must_use]
    pub fn furnished(name: &str, scene: Scene) -> Self {
        let solids = |list: &[Cuboid]| {
            list.iter().flat_map(|solid| cuboid(solid.min.into(), solid.max.into())).collect::<Triangles>()
        };
        let mut triangles = match &scene.receivers {
            Boxes::One(bounds) => floor(bounds.min.into(), bounds.max.into()),
            Boxes::Many(list) => solids(list),
        };
        triangles.extend(match &scene.casters {
            Boxes::One(bounds) => furniture(bounds.min.into(), bounds.max.into()),
            Boxes::Many(list) => solids(list),
        });
        Self { name: name.to_owned(), scene, triangles }
    }

    /// Returns a town of 289 houses, seen along a street. Shadows are seen on streets and doorsteps
    /// only, so that most casters are no receivers.
    #[must_use]
    pub fn town() -> Self {
        let bounds = Cuboid { min: [-210.0, 0.0, -210.0], max: [210.0, 45.0, 210.0] };
        let mut random = Rng::with_seed(7);
        let mut triangles = floor(bounds.min.into(), bounds.max.into());
        for (i, j) in (-8..=8).flat_map(|i| (-8..=8).map(move |j| (i, j))) {
            let foot = DVec3::new(24.0 * f64::from(i), 0.0, 24.0 * f64::from(j));
            let half = [5.0 + 3.0 * random.f64(), 5.0 + 3.0 * random.f64()];
            let height = 6.0 + 22.0 * random.f64() * random.f64();
            triangles.extend(frustum(foot, half, half, height));
            let ridge = if random.bool() { [0.0, half[1]] } else { [half[0], 0.0] };
            triangles.extend(frustum(foot + DVec3::Y * height, half, ridge, 3.0 + 4.0 * random.f64()));
        }
        let receivers = Cuboid { max: [210.0, 3.0, 210.0], ..bounds };
        let view = camera([-12.0, 3.0, -205.0], [0.06, 0.0, 1.0], 60.0, 0.5, Some(600.0));
        let light = Lamp::directional([0.6, 0.7, 0.4]);
        let scene = scene(view, light, [bounds, receivers]);
        Self { name: "town".to_owned(), scene, triangles }
    }

    /// Returns an avenue of 240 trees to the horizon, under a low sun; the camera sees to infinity.
    #[must_use]
    pub fn avenue() -> Self {
        let bounds = Cuboid { min: [-60.0, 0.0, 0.0], max: [60.0, 14.0, 1500.0] };
        let mut triangles = floor(bounds.min.into(), bounds.max.into());
        let mut random = Rng::with_seed(9);
        for (i, side) in (0..120).flat_map(|i| [-9.0, 9.0].map(|side| (i, side))) {
            let foot = DVec3::new(side, 0.0, 8.0 + 12.0 * f64::from(i));
            let (trunk, crown) = (2.5 + random.f64(), 3.0 + random.f64());
            triangles.extend(turned(foot, 6, &[(0.35, 0.0), (0.3, trunk + 1.0)]));
            let rings = [(0.6, 0.0), (crown, 0.3 * crown), (0.7 * crown, 1.4 * crown), (0.0, 2.4 * crown)];
            triangles.extend(turned(foot + DVec3::Y * trunk, 8, &rings));
        }
        let view = camera([0.0, 1.7, 1.0], [0.0, 0.0, 1.0], 50.0, 0.2, None);
        let light = Lamp::directional([0.8, 0.45, 0.25]);
        let scene = scene(view, light, [bounds; 2]);
        Self { name: "avenue".to_owned(), scene, triangles }
    }

    /// Returns a chessboard with its 32 pieces under a spot light.
    #[must_use]
    pub fn chessboard() -> Self {
        let bounds = Cuboid { min: [-4.4, -0.3, -4.4], max: [4.4, 1.6, 4.4] };
        let mut triangles = cuboid(bounds.min.into(), DVec3::new(4.4, 0.0, 4.4));
        for file in 0..8_u32 {
            for (rank, officer) in [(0, true), (1, false), (6, false), (7, true)] {
                let foot = DVec3::new(f64::from(file) - 3.5, 0.0, f64::from(rank) - 3.5);
                // The king's side mirrors the queen's, but for the royal pair itself.
                let height = match (officer, file.min(7 - file)) {
                    (false, _) => 0.7,
                    (true, 3) if file == 3 => 1.3,
                    (true, 3) => 1.5,
                    (true, nearer_edge) => 0.85 + 0.1 * f64::from(nearer_edge),
                };
                let rings =
                    [(0.36, 0.0), (0.36, 0.1), (0.16, 0.25), (0.13, 0.6), (0.25, 0.75), (0.22, 0.9), (0.05, 1.0)];
                triangles.extend(turned(foot, 12, &rings.map(|(radius, at)| (radius, at * height))));
            }
        }
        let view = camera([1.5, 3.2, -7.5], [-0.12, -0.42, 1.0], 45.0, 0.1, Some(30.0));
        let spot =
            Spot { position: [6.0, 7.0, -2.0], direction: [-6.0, -7.0, 2.5], outer_deg: 40.0, near: 1.0, range: 30.0 };
        let light = Lamp { spot: Some(spot), ..Lamp::default() };
        let scene = scene(view, light, [bounds; 2]);
        Self { name: "chessboard".to_owned(), scene, triangles }
    }

    /// Returns a hall of pillars around a lamp that shines all around, seen from a corner.
    #[must_use]
    pub fn hall() -> Self {
        let bounds = Cuboid { min: [-10.0, -0.2, -10.0], max: [10.0, 5.2, 10.0] };
        // Floor, ceiling and walls.
        let sides = [
            ([-10.0, -0.2, -10.0], [10.0, 0.0, 10.0]),
            ([-10.0, 5.0, -10.0], [10.0, 5.2, 10.0]),
            ([-10.0, 0.0, -10.0], [-9.8, 5.0, 10.0]),
            ([9.8, 0.0, -10.0], [10.0, 5.0, 10.0]),
            ([-9.8, 0.0, -10.0], [9.8, 5.0, -9.8]),
            ([-9.8, 0.0, 9.8], [9.8, 5.0, 10.0]),
        ];
        let mut triangles: Triangles =
            sides.into_iter().flat_map(|(low, high)| cuboid(low.into(), high.into())).collect();
        for i in 0..16_u32 {
            let place = DVec2::from_angle(f64::from(i) * 0.7) * (3.0 + 0.3 * f64::from(i));
            let height = 1.2 + 0.2 * f64::from(i * 5 % 16);
            let rings = [(0.5, 0.0), (0.35, 0.2), (0.3, height), (0.5, height + 0.2), (0.4, height + 0.3)];
            triangles.extend(turned(DVec3::new(place.x, 0.0, place.y), 8, &rings));
        }
        // Something on either side of the lamp, above and below.
        triangles.extend(cuboid(DVec3::new(-0.4, 4.2, -1.0), DVec3::new(1.0, 4.4, 0.9)));
        triangles.extend(cuboid(DVec3::new(-0.2, 0.0, -0.9), DVec3::new(1.1, 0.6, 0.4)));
        let view = camera([-9.2, 2.6, -8.9], [1.0, -0.06, 0.95], 80.0, 0.1, Some(40.0));
        let lamp = Point { position: [0.4, 2.4, -0.3], near: 0.2, range: 30.0 };
        let light = Lamp { point: Some(lamp), ..Lamp::default() };
        let scene = scene(view, light, [bounds; 2]);
        Self { name: "hall".to_owned(), scene, triangles }
    }

    /// Returns a glTF file's scene, and what was made up in it.
    ///
    /// # Errors
    /// As [`GltfScene::read`] and [`GltfScene::triangles`].
    pub fn from_gltf(path: &Path) -> Result<(Self, Vec<String>)> {
        let file = GltfScene::read(path)?;
        let name = path.file_stem().context("a file has a name")?.to_string_lossy().into_owned();
        Ok((Self { name, triangles: file.triangles()?, scene: file.scene }, file.notes))
    }

    /// Returns the same model under a light at infinity.
    #[must_use]
    pub fn under_sun(mut self, to_light: DVec3) -> Self {
        self.scene.light = Lamp::directional(to_light.to_array());
        self
    }

    /// Returns the same model elsewhere, with its camera.
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Self {
        let moved = |p: [f64; 3]| (DVec3::from(p) + by).to_array();
        let scene = &mut self.scene;
        for boxes in [&mut scene.casters, &mut scene.receivers] {
            *boxes = boxes.map(|cuboid| Cuboid { min: moved(cuboid.min), max: moved(cuboid.max) });
        }
        scene.view.eye = moved(scene.view.eye);
        if let Some(spot) = &mut scene.light.spot {
            spot.position = moved(spot.position);
        }
        if let Some(point) = &mut scene.light.point {
            point.position = moved(point.position);
        }
        self.triangles = self.triangles.iter().map(|corners| corners.map(|p| p + by)).collect::<Triangles>();
        self
    }
}

fn camera(eye: [f64; 3], forward: [f64; 3], fov_y_deg: f64, near: f64, far: Option<f64>) -> Camera {
    let (fov_y_deg, aspect) = (Some(fov_y_deg), Some(1.0));
    Camera { eye, forward, up: [0.0, 1.0, 0.0], fov_y_deg, aspect, near, far, ..Camera::default() }
}

fn scene(view: Camera, light: Lamp, [casters, receivers]: [Cuboid; 2]) -> Scene {
    Scene::new(view, light, casters.into(), receivers.into(), MAP, VIEWPORT)
}

/// Poles and boxes in eight rows on the bottom of a box.
fn furniture(low: DVec3, high: DVec3) -> Triangles {
    let (size, mut random) = (high - low, Rng::with_seed(4));
    let mut triangles = Triangles::new();
    const ROWS: u32 = 8;
    let cell = size / f64::from(ROWS);
    for (i, j) in (0..ROWS).flat_map(|i| (0..ROWS).map(move |j| (i, j))) {
        let middle = low + cell * DVec3::new(f64::from(i) + 0.5, 0.0, f64::from(j) + 0.5);
        let half = if (i + j) % 2 == 0 {
            DVec3::new(0.02, 0.25 + 0.25 * random.f64(), 0.02)
        } else {
            DVec3::new(0.08 + 0.17 * random.f64(), 0.03 + 0.12 * random.f64(), 0.08 + 0.17 * random.f64())
        };
        let half = half * DVec3::new(cell.x, size.y, cell.z);
        triangles.extend(cuboid(middle - half.with_y(0.0), middle + half * DVec3::new(1.0, 2.0, 1.0)));
    }
    triangles
}
