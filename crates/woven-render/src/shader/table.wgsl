// The table's rows and the frame's numbers; the pair of table.rs and gpu/buffers.rs. A test compares the offsets.

const NONE: u32 = 0xffffffffu;
const EMPTY: u32 = 0xffffffffu;
const LEAF: u32 = 0x80000000u;
const STACK: u32 = 64u;
const LAYERS: u32 = 4u;
const PI: f32 = 3.14159265358979;
const TAU: f32 = 6.28318530717959;
const FRAC_PI_2: f32 = 1.57079632679490;
const FRAC_PI_4: f32 = 0.785398163397448;
const FRAC_1_PI: f32 = 0.318309886183791;
const FAR: f32 = 3.0e38;

// MaterialRow.flags
const MATT: u32 = 1u;
const DOUBLE_SIDED: u32 = 2u;
const TRANSMITS: u32 = 4u;
const EMITS: u32 = 8u;
const EVEN: u32 = 16u;
const PLAIN_GLOSS: u32 = 32u;
const MEASURED: u32 = 64u;
const MULTIPLIES: u32 = 128u;

// Layers with Globals.events
const REFLECTED: u32 = 0u;
const TRANSMITTED: u32 = 1u;
const PASSED: u32 = 2u;
const EMITTED: u32 = 3u;

// LightRow.kind
const RECT: u32 = 0u;
const TRIANGLE: u32 = 1u;
const SUN: u32 = 2u;
const POINT: u32 = 3u;
const SPOT: u32 = 4u;
const SKY: u32 = 5u;
const CLUSTER: u32 = 7u;

// What the scene has of each kind; where there is nothing, its part of the shader goes. lavapipe runs both branches of
// every `if`, so what no ray needs costs as much there as what all do.
const TEXTURED: bool = true;
const MEASURES: bool = true;
const LOBES: bool = true;
const CLUSTERS: bool = true;
const SKIES: bool = true;

struct Fork {
    corner: vec3<f32>,
    // By axis 8 bits, the exponent of the step; the lanes that are nodes, then those that are leaves, by a bit each.
    spread: u32,
    lo: vec3<u32>,
    nodes: u32,
    hi: vec3<u32>,
    packets: u32,
}

struct Packet {
    v0: array<vec4<f32>, 3>,
    e1: array<vec4<f32>, 3>,
    e2: array<vec4<f32>, 3>,
    gap: vec4<f32>,
}

struct Shade {
    n0: vec4<f32>,
    n1: vec4<f32>,
    n2: vec4<f32>,
    weft: vec4<f32>,
    v: vec4<f32>,
    colors: vec4<u32>,
    material: u32,
    light: u32,
    mesh: u32,
    triangle: u32,
}

struct MaterialRow {
    linear: array<vec4<f32>, 8>,
    // 16 and 8 numbers.
    shape: array<vec4<f32>, 4>,
    weights: array<vec4<f32>, 2>,
    emission: vec4<f32>,
    metal: vec4<f32>,
    flags: u32,
    layer: u32,
    color_texture: u32,
    coverage_texture: u32,
    emission_texture: u32,
    alpha_cutoff: f32,
    gap: f32,
    cover: f32,
    normal_texture: u32,
    normal_scale: f32,
    measured: u32,
    gloss_texture: u32,
}

struct LightRow {
    p: vec3<f32>,
    kind: u32,
    u: vec3<f32>,
    layer: u32,
    v: vec3<f32>,
    place: u32,
    n: vec3<f32>,
    area: f32,
    radiance: vec3<f32>,
    parent: u32,
}

struct Globals {
    sky_scale: vec4<f32>,
    lights: u32,
    portals: u32,
    sky_width: u32,
    sky_height: u32,
    sky_turn: vec2<f32>,
    portal_share: f32,
    sky_light: u32,
    sky_layer: u32,
    soft_lights: u32,
    offset: f32,
    taps: u32,
    others: u32,
    tree: u32,
    events: u32,
    spare: u32,
}

struct Frame {
    eye: vec3<f32>,
    aperture: f32,
    right: vec3<f32>,
    focus: f32,
    up: vec3<f32>,
    width: u32,
    forward: vec3<f32>,
    height: u32,
    lens_x: vec3<f32>,
    depth: u32,
    lens_y: vec3<f32>,
    seed: u32,
    // Number of the sample, how far the blocks of 8 x 8 pixels are shifted for it, and the first of them.
    index: u32,
    left: u32,
    above: u32,
    block: u32,
    globals: Globals,
}

struct PixelSum {
    direct: array<vec4<f32>, 4>,
    indirect: array<vec4<f32>, 4>,
    albedo: vec4<f32>,
    normal: vec4<f32>,
}

// Storage, not uniform: lavapipe compiles a shader anew whenever the numbers in a uniform buffer change.
@group(0) @binding(0) var<storage, read> frame: Frame;
@group(0) @binding(1) var<storage, read> forks: array<Fork>;
@group(0) @binding(2) var<storage, read> packets: array<Packet>;
@group(0) @binding(3) var<storage, read> shades: array<Shade>;
@group(0) @binding(4) var<storage, read> materials: array<MaterialRow>;
// sRGB decoded, SRGB words; rows of textures, TEXTURE_ROW words each; the texels and measured tables.
@group(0) @binding(5) var<storage, read> texels: array<u32>;
@group(0) @binding(6) var<storage, read> lights: array<LightRow>;
@group(0) @binding(7) var<storage, read> skies: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> sums: array<PixelSum>;
