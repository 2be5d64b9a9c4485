// A pass's matrix, and what its interface does to clip coordinates before wgpu's rasteriser sees them:
// y times adapt.x, depth times adapt.y plus w times adapt.z.
struct Pass {
    clip_from_scene: mat4x4f,
    adapt: vec4f,
}

@group(0) @binding(0) var<uniform> job: Pass;

fn project(p: vec3f) -> vec4f {
    let clip = job.clip_from_scene * vec4f(p, 1.0);
    return vec4f(clip.x, clip.y * job.adapt.x, clip.z * job.adapt.y + clip.w * job.adapt.z, clip.w);
}

@vertex
fn depth_vertex(@location(0) p: vec3f) -> @builtin(position) vec4f {
    return project(p);
}

// The clip coordinates themselves.
@group(0) @binding(1) var<storage, read> points: array<f32>;
@group(0) @binding(2) var<storage, read_write> captured: array<vec4f>;

@compute @workgroup_size(64)
fn capture(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&captured) {
        captured[id.x] = project(vec3f(points[3 * id.x], points[3 * id.x + 1], points[3 * id.x + 2]));
    }
}

// The camera's picture, lit through the shadow map. A triangle's bias moves its depth towards the light.
@group(0) @binding(3) var<uniform> texture_from_scene: mat4x4f;
@group(0) @binding(4) var<storage, read> biases: array<f32>;
@group(0) @binding(5) var shadow_map: texture_depth_2d;
@group(0) @binding(6) var compare: sampler_comparison;

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) p: vec3f,
    @location(1) @interpolate(flat, either) triangle: u32,
}

struct Pixel {
    // Place in the shadow map (u, v, depth), and the triangle's number from 1, negative in shadow.
    @location(0) place: vec4f,
    // How u and v change from pixel to pixel: (du/dx, dv/dx, du/dy, dv/dy).
    @location(1) change: vec4f,
}

@vertex
fn lit_vertex(@location(0) p: vec3f, @builtin(vertex_index) vertex: u32) -> Seen {
    return Seen(project(p), p, vertex / 3);
}

@fragment
fn lit_fragment(seen: Seen) -> Pixel {
    let shadow = texture_from_scene * vec4f(seen.p, 1.0);
    let place = shadow.xyz / shadow.w;
    let change = vec4f(dpdxFine(place.xy), dpdyFine(place.xy));
    let lit = textureSampleCompareLevel(shadow_map, compare, place.xy, place.z - biases[seen.triangle]);
    return Pixel(vec4f(place, f32(seen.triangle + 1) * select(-1.0, 1.0, lit > 0.5)), change);
}
