//! The rasteriser: a device, a depth pass, a lit pass, and the way back for what they write.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, anyhow, ensure};
use shadow_warp::ClipSpace;
use shadow_warp::glam::{DMat4, DVec3};
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, CompareFunction, TextureFormat, TextureUsages};

use crate::pass::{DepthMap, DepthPass, Mesh, Pixel};

/// Said where there is no driver.
pub const NO_DRIVER: &str = "no Vulkan driver: install one, for example lavapipe, which needs no graphics card \
                             (Debian, Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers)";

/// A device with the passes of the harness.
pub struct Gpu {
    /// The adapter's name and its driver's.
    pub name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    shaders: wgpu::ShaderModule,
    pipelines: Mutex<HashMap<Pipeline, wgpu::RenderPipeline>>,
    capture: wgpu::ComputePipeline,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Pipeline {
    Depth(DepthPass),
    Lit,
}

impl Gpu {
    /// Opens the adapter whose name contains the environment's `SHADOW_WARP_ADAPTER`; without that lavapipe, or else
    /// the first that there is.
    ///
    /// # Errors
    /// [`NO_DRIVER`] where there is none.
    pub fn open() -> Result<Self> {
        let wanted = std::env::var("SHADOW_WARP_ADAPTER").ok();
        let adapters = adapters()?;
        let find = |name: &str| adapters.iter().find(|adapter| adapter.get_info().name.contains(name));
        let adapter = match &wanted {
            Some(name) => find(name).with_context(|| format!("no adapter is called `{name}`"))?,
            None => find("llvmpipe").or(adapters.first()).context(NO_DRIVER)?,
        };
        Self::new(adapter)
    }

    /// Opens every adapter, lavapipe first.
    ///
    /// # Errors
    /// [`NO_DRIVER`] where there is none.
    pub fn all() -> Result<Vec<Self>> {
        let mut all = adapters()?.iter().map(Self::new).collect::<Result<Vec<Self>>>()?;
        all.sort_by_key(|gpu| !gpu.is_lavapipe());
        Ok(all)
    }

    fn new(adapter: &wgpu::Adapter) -> Result<Self> {
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            required_features: wgpu::Features::DEPTH_CLIP_CONTROL,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).context(info.name.clone())?;
        let shaders = device.create_shader_module(wgpu::include_wgsl!("shaders.wgsl"));
        let capture = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &shaders,
            entry_point: Some("capture"),
            compilation_options: Default::default(),
            cache: None,
        });
        let name = [info.name, info.driver_info].join(" ").trim().to_owned();
        Ok(Self { name, device, queue, shaders, pipelines: Mutex::default(), capture })
    }

    /// Whether this is Mesa's rasteriser in software. It rounds positions for coverage, and not for depth.
    #[must_use]
    pub fn is_lavapipe(&self) -> bool {
        self.name.contains("llvmpipe")
    }

    /// The grid that positions are rounded to, in texels.
    #[must_use]
    pub fn grid(&self) -> f64 {
        if self.name.contains("SwiftShader") { 1.0 / 16.0 } else { 1.0 / 256.0 }
    }

    /// Puts triangles on the device, relative to an origin.
    ///
    /// # Errors
    /// If the device refuses.
    pub fn mesh<'a>(&self, triangles: impl IntoIterator<Item = &'a [DVec3; 3]>, origin: DVec3) -> Result<Mesh> {
        let corners = triangles.into_iter().flatten();
        let positions: Vec<f32> = corners.flat_map(|p| (*p - origin).as_vec3().to_array()).collect();
        ensure!(!positions.is_empty(), "there is nothing to draw");
        let buffer = self.checked(|| Ok(self.buffer(&positions, BufferUsages::VERTEX | BufferUsages::STORAGE)))?;
        Ok(Mesh { positions, buffer })
    }

    /// Draws a depth map. The matrix is for positions relative to the mesh's origin; it is rounded to `f32` here.
    ///
    /// # Errors
    /// If the device refuses.
    pub fn depth(&self, mesh: &Mesh, clip_from_scene: DMat4, pass: DepthPass, size: [u32; 2]) -> Result<DepthMap> {
        self.checked(|| {
            let texture = self.target(size, TextureFormat::Depth32Float)?;
            let job = self.job(clip_from_scene, pass.adapt());
            self.draw(Pipeline::Depth(pass), mesh, &[], &texture, pass.cleared(), &[(0, job.as_entire_binding())])?;
            Ok(DepthMap { pass, texture })
        })
    }

    /// Returns a depth map's texels, row by row from the first one.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn read(&self, map: &DepthMap) -> Result<Vec<f32>> {
        self.read_texture(&map.texture, wgpu::TextureAspect::DepthOnly, 1)
    }

    /// Draws the picture of a camera, lit through a shadow map; `None` where nothing is seen. `biases` has a value for
    /// each triangle, in depth; it is subtracted before the comparison.
    ///
    /// # Errors
    /// If the device refuses.
    pub fn lit(
        &self,
        mesh: &Mesh,
        camera: DMat4,
        texture_from_scene: DMat4,
        biases: &[f32],
        shadows: &DepthMap,
        size: [u32; 2],
    ) -> Result<Vec<Option<Pixel>>> {
        let colours = self.checked(|| {
            let colours =
                [self.target(size, TextureFormat::Rgba32Float)?, self.target(size, TextureFormat::Rgba32Float)?];
            let depth = self.target(size, TextureFormat::Depth32Float)?;
            let job = self.job(camera, [1.0, 1.0, 0.0, 0.0]);
            let lookup = self.buffer(&texture_from_scene.as_mat4().to_cols_array(), BufferUsages::UNIFORM);
            let biases = self.buffer(biases, BufferUsages::STORAGE);
            let compare = self.device.create_sampler(&wgpu::SamplerDescriptor {
                compare: Some(if shadows.pass.is_reversed() {
                    CompareFunction::GreaterEqual
                } else {
                    CompareFunction::LessEqual
                }),
                ..Default::default()
            });
            let map = shadows.texture.create_view(&Default::default());
            let bindings = [
                (0, job.as_entire_binding()),
                (3, lookup.as_entire_binding()),
                (4, biases.as_entire_binding()),
                (5, wgpu::BindingResource::TextureView(&map)),
                (6, wgpu::BindingResource::Sampler(&compare)),
            ];
            // The camera's depth is reversed.
            self.draw(Pipeline::Lit, mesh, &colours, &depth, 0.0, &bindings)?;
            Ok(colours)
        })?;
        let [places, changes] = colours;
        let places = self.read_texture(&places, wgpu::TextureAspect::All, 4)?;
        let changes = self.read_texture(&changes, wgpu::TextureAspect::All, 4)?;
        let pixel = |(place, change): (&[f32], &[f32])| {
            let number = place[3];
            (number != 0.0).then(|| Pixel {
                triangle: number.abs() as usize - 1,
                lit: number > 0.0,
                place: [place[0], place[1], place[2]],
                change: [[change[0], change[1]], [change[2], change[3]]],
            })
        };
        Ok(places.chunks_exact(4).zip(changes.chunks_exact(4)).map(pixel).collect())
    }

    /// Returns the clip coordinates of a mesh's corners as the device computes them.
    ///
    /// # Errors
    /// If the device refuses.
    pub fn capture(&self, mesh: &Mesh, clip_from_scene: DMat4) -> Result<Vec<[f32; 4]>> {
        let job = self.job(clip_from_scene, [1.0, 1.0, 0.0, 0.0]);
        let bytes = 16 * mesh.len() as u64;
        let captured = self.empty_buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let bindings =
            [(0, job.as_entire_binding()), (1, mesh.buffer.as_entire_binding()), (2, captured.as_entire_binding())];
        let group = self.bind(&self.capture.get_bind_group_layout(0), &bindings);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.capture);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(u32::try_from(mesh.len().div_ceil(64))?, 1, 1);
        }
        let back = self.empty_buffer(bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ);
        encoder.copy_buffer_to_buffer(&captured, 0, &back, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let floats = self.mapped(&back)?;
        Ok(floats.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect())
    }

    fn draw(
        &self,
        pipeline: Pipeline,
        mesh: &Mesh,
        colours: &[wgpu::Texture],
        depth: &wgpu::Texture,
        cleared: f32,
        bindings: &[(u32, wgpu::BindingResource)],
    ) -> Result<()> {
        let pipeline = self.pipeline(pipeline);
        let group = self.bind(&pipeline.get_bind_group_layout(0), bindings);
        let views: Vec<_> = colours.iter().map(|texture| texture.create_view(&Default::default())).collect();
        let colours: Vec<_> = views
            .iter()
            .map(|view| {
                let ops = wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                };
                Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
            })
            .collect();
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &colours,
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &depth.create_view(&Default::default()),
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(cleared),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.set_vertex_buffer(0, mesh.buffer.slice(..));
            pass.draw(0..u32::try_from(mesh.len())?, 0..1);
        }
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Turns what the device refuses into an error.
    fn checked<T>(&self, job: impl FnOnce() -> Result<T>) -> Result<T> {
        let invalid = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let too_large = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let done = job();
        for scope in [too_large, invalid] {
            if let Some(error) = pollster::block_on(scope.pop()) {
                return Err(anyhow!("the device refuses: {error}"));
            }
        }
        done
    }

    /// A pipeline is made once.
    fn pipeline(&self, kind: Pipeline) -> wgpu::RenderPipeline {
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&kind) {
            return pipeline.clone();
        }
        let (pass, vertex) = match kind {
            Pipeline::Depth(pass) => (pass, "depth_vertex"),
            Pipeline::Lit => (DepthPass { space: ClipSpace::WGPU.reversed(), ..DepthPass::WGPU }, "lit_vertex"),
        };
        let targets = [(); 2].map(|()| Some(TextureFormat::Rgba32Float.into()));
        let attributes = wgpu::vertex_attr_array![0 => Float32x3];
        let pipeline = self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &self.shaders,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: 12,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &attributes,
                })],
            },
            primitive: wgpu::PrimitiveState {
                front_face: pass.front(),
                cull_mode: pass.cull,
                unclipped_depth: pass.clamp,
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(if pass.is_reversed() { CompareFunction::Greater } else { CompareFunction::Less }),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: (kind == Pipeline::Lit).then(|| wgpu::FragmentState {
                module: &self.shaders,
                entry_point: Some("lit_fragment"),
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        pipelines.entry(kind).or_insert(pipeline).clone()
    }

    fn job(&self, clip_from_scene: DMat4, adapt: [f32; 4]) -> wgpu::Buffer {
        let matrix = clip_from_scene.as_mat4().to_cols_array();
        self.buffer(&[matrix.as_slice(), &adapt].concat(), BufferUsages::UNIFORM)
    }

    fn buffer(&self, floats: &[f32], usage: BufferUsages) -> wgpu::Buffer {
        let contents = bytemuck::cast_slice(floats);
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    }

    fn empty_buffer(&self, size: u64, usage: BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    }

    fn bind(&self, layout: &wgpu::BindGroupLayout, bindings: &[(u32, wgpu::BindingResource)]) -> wgpu::BindGroup {
        let entries: Vec<_> = bindings
            .iter()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    fn target(&self, [width, height]: [u32; 2], format: TextureFormat) -> Result<wgpu::Texture> {
        let most = self.device.limits().max_texture_dimension_2d;
        ensure!(width.max(height) <= most, "the device has textures of at most {most} texels across");
        Ok(self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC,
            view_formats: &[],
        }))
    }

    fn read_texture(&self, texture: &wgpu::Texture, aspect: wgpu::TextureAspect, channels: u32) -> Result<Vec<f32>> {
        let (size, row) = (texture.size(), 4 * channels * texture.width());
        // Rows are padded on the device.
        let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self
            .empty_buffer(u64::from(stride) * u64::from(size.height), BufferUsages::COPY_DST | BufferUsages::MAP_READ);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { aspect, ..texture.as_image_copy() },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(stride), rows_per_image: None },
            },
            size,
        );
        self.queue.submit([encoder.finish()]);
        let padded = self.mapped(&buffer)?;
        let (row, stride) = ((row / 4) as usize, (stride / 4) as usize);
        Ok(if row == stride { padded } else { padded.chunks_exact(stride).flat_map(|r| &r[..row]).copied().collect() })
    }

    fn mapped(&self, buffer: &wgpu::Buffer) -> Result<Vec<f32>> {
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver waits below.
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receiver.recv()??;
        let range = buffer.get_mapped_range(..)?;
        Ok(bytemuck::pod_collect_to_vec(&range))
    }
}

fn adapters() -> Result<Vec<wgpu::Adapter>> {
    let descriptor = wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle_from_env()
    };
    let instance = wgpu::Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    ensure!(!adapters.is_empty(), NO_DRIVER);
    Ok(adapters)
}
