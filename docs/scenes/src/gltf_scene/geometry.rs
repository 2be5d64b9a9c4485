//! Triangles from accessors and buffers.

use anyhow::{Context, Result, anyhow, bail, ensure};
use base64::Engine;
use gltf::accessor::sparse::Sparse;
use gltf::accessor::{Accessor, DataType, Dimensions, Item, Iter};
use gltf::buffer::{Source, View};
use gltf::mesh::{Mode, Primitive};
use gltf::{Buffer, Semantic};
use shadow_warp::glam::{DMat4, DVec3};

use super::file::File;
use crate::echo::echo;

/// By the buffers' indices; those that nobody asked for are empty.
type Buffers = Vec<Option<Vec<u8>>>;

impl File {
    /// Returns the triangles of the meshes of some nodes, in world space.
    ///
    /// # Errors
    /// If a buffer cannot be read, or a mesh refers to what is not in it.
    pub(super) fn triangles(&self, nodes: &[(usize, DMat4)]) -> Result<Vec<[DVec3; 3]>> {
        let mut buffers: Buffers = vec![None; self.document.buffers().len()];
        let mut triangles = Vec::new();
        for (node, world) in nodes {
            let mesh =
                self.document.nodes().nth(*node).and_then(|node| node.mesh()).context("a node has lost its mesh")?;
            for part in mesh.primitives() {
                let name = || format!("meshes[{}].primitives[{}]", mesh.index(), part.index());
                let Some(positions) = part.get(&Semantic::Positions) else { continue };
                for accessor in [Some(positions.clone()), part.indices()].into_iter().flatten() {
                    self.fetch(&accessor, &mut buffers)?;
                }
                triangles.extend(self.part_triangles(&part, &positions, &buffers, world).with_context(name)?);
            }
        }
        Ok(triangles)
    }

    /// Reads the buffers that an accessor needs, where that is not done.
    fn fetch(&self, accessor: &Accessor, buffers: &mut Buffers) -> Result<()> {
        let sparse = accessor.sparse().map(|sparse| [sparse.indices().view(), sparse.values().view()]);
        for view in accessor.view().into_iter().chain(sparse.into_iter().flatten()) {
            let buffer = view.buffer();
            if let Some(place @ None) = buffers.get_mut(buffer.index()) {
                *place = Some(self.buffer(&buffer)?);
            }
        }
        Ok(())
    }

    fn buffer(&self, buffer: &Buffer) -> Result<Vec<u8>> {
        let name = || format!("buffers[{}]", buffer.index());
        match buffer.source() {
            Source::Bin => self.blob.clone().with_context(|| format!("{}: the file holds no data", name())),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(rest) => {
                    let (_, data) =
                        rest.split_once(";base64,").with_context(|| format!("{}: must be base64", name()))?;
                    base64::engine::general_purpose::STANDARD.decode(data).with_context(name)
                }
                None => {
                    let name = || format!("{}: {}", name(), echo(uri));
                    let path = self.folder.join(&*urlencoding::decode(uri).with_context(name)?);
                    ensure!(std::fs::metadata(&path).with_context(name)?.is_file(), "{} must be a file", name());
                    std::fs::read(path).with_context(name)
                }
            },
        }
    }

    fn part_triangles(
        &self,
        part: &Primitive,
        positions: &Accessor,
        buffers: &Buffers,
        world: &DMat4,
    ) -> Result<Vec<[DVec3; 3]>> {
        let points = self.positions(positions, buffers)?;
        let points: Vec<DVec3> = points.into_iter().map(|p| world.transform_point3(p)).collect();
        ensure!(points.iter().all(|p| p.is_finite()), "POSITION must be finite");
        let order = match part.indices() {
            Some(accessor) => indices(&accessor, buffers)?,
            None => (0..points.len()).collect(),
        };
        let corners: Vec<[usize; 3]> = match part.mode() {
            Mode::Triangles => order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every other triangle of a strip has its corners in the other order.
            Mode::TriangleStrip => (order.windows(3).enumerate())
                .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
                .collect(),
            Mode::TriangleFan => match order.split_first() {
                Some((&first, rest)) => rest.windows(2).map(|t| [first, t[0], t[1]]).collect(),
                None => Vec::new(),
            },
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
        };
        // A mirrored node turns its triangles' winding about, which glTF says to undo.
        let mirrored = world.determinant() < 0.0;
        let triangle = |[a, b, c]: [usize; 3]| {
            let point = |i: usize| points.get(i).copied().ok_or_else(|| anyhow!("index {i} is beyond the positions"));
            let (b, c) = if mirrored { (c, b) } else { (b, c) };
            Ok([point(a)?, point(b)?, point(c)?])
        };
        corners.into_iter().map(triangle).collect()
    }

    /// The positions of a mesh, in the units of its node.
    fn positions(&self, accessor: &Accessor, buffers: &Buffers) -> Result<Vec<DVec3>> {
        // The reader takes these for granted.
        let in_threes = accessor.dimensions() == Dimensions::Vec3 && is_readable(accessor);
        let numbers = match accessor.data_type() {
            DataType::F32 if in_threes => threes::<f32>(accessor, buffers),
            DataType::I8 if in_threes && self.quantised => threes::<i8>(accessor, buffers),
            DataType::U8 if in_threes && self.quantised => threes::<u8>(accessor, buffers),
            DataType::I16 if in_threes && self.quantised => threes::<i16>(accessor, buffers),
            DataType::U16 if in_threes && self.quantised => threes::<u16>(accessor, buffers),
            _ if self.quantised => {
                bail!("POSITION must be floats in threes, or integers of 8 or 16 bits, in their buffer view")
            }
            _ => bail!("POSITION must be floats in threes, in their buffer view"),
        };
        let numbers = numbers.context("POSITION must lie in its buffer")?;
        Ok(numbers.into_iter().map(|numbers| in_units(accessor, numbers)).collect())
    }
}

fn threes<T: Item + Copy + Into<f64>>(accessor: &Accessor, buffers: &Buffers) -> Option<Vec<[f64; 3]>> {
    let numbers = Iter::<[T; 3]>::new(accessor.clone(), |buffer| bytes(buffers, &buffer))?;
    Some(numbers.map(|three| three.map(T::into)).collect())
}

fn indices(accessor: &Accessor, buffers: &Buffers) -> Result<Vec<usize>> {
    let whole = accessor.dimensions() == Dimensions::Scalar && is_readable(accessor);
    let read = match accessor.data_type() {
        DataType::U8 if whole => scalars::<u8>(accessor, buffers),
        DataType::U16 if whole => scalars::<u16>(accessor, buffers),
        DataType::U32 if whole => scalars::<u32>(accessor, buffers),
        _ => bail!("indices must be unsigned integers, in their buffer view"),
    };
    read.context("indices must lie in their buffer")
}

fn scalars<T: Item + Copy + Into<u32>>(accessor: &Accessor, buffers: &Buffers) -> Option<Vec<usize>> {
    let numbers = Iter::<T>::new(accessor.clone(), |buffer| bytes(buffers, &buffer))?;
    Some(numbers.map(|index| index.into() as usize).collect())
}

fn bytes<'a>(buffers: &'a Buffers, buffer: &Buffer) -> Option<&'a [u8]> {
    buffers.get(buffer.index())?.as_deref()
}

/// Returns what an accessor's numbers mean: where they are normalised integers, the greatest of
/// them is 1, and no signed one is less than -1.
pub(super) fn in_units(accessor: &Accessor, numbers: [f64; 3]) -> DVec3 {
    let greatest = match accessor.data_type() {
        DataType::I8 => 127.0,
        DataType::U8 => 255.0,
        DataType::I16 => 32767.0,
        DataType::U16 => 65535.0,
        DataType::U32 | DataType::F32 => 1.0,
    };
    let numbers = DVec3::from(numbers);
    if accessor.normalized() && greatest > 1.0 { (numbers / greatest).max(DVec3::NEG_ONE) } else { numbers }
}

/// Whether an accessor has elements, not too many, and they lie in its buffer view.
fn is_readable(accessor: &Accessor) -> bool {
    const MOST: usize = 1 << 26;
    let (count, size) = (accessor.count(), accessor.size());
    let fits = |view: &View, offset: usize, count: usize, size: usize| {
        let stride = view.stride().unwrap_or(size);
        let end = stride.checked_mul(count - 1)?.checked_add(size)?.checked_add(offset)?;
        Some(stride >= size && end <= view.length() && view.offset().checked_add(view.length())? <= isize::MAX as usize)
    };
    let sparse_fits = |sparse: &Sparse| {
        let (count, indices, values) = (sparse.count(), sparse.indices(), sparse.values());
        let of_index = indices.index_type().size();
        let indices_fit = fits(&indices.view(), indices.offset(), count, of_index);
        indices_fit == Some(true) && fits(&values.view(), values.offset(), count, size) == Some(true)
    };
    (1..=MOST).contains(&count)
        && accessor.sparse().is_none_or(|sparse| (1..=count).contains(&sparse.count()) && sparse_fits(&sparse))
        && accessor.view().is_none_or(|view| fits(&view, accessor.offset(), count, size) == Some(true))
}
