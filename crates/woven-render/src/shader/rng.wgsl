// Random numbers; the pair of rng.rs, bit for bit.

const PERIOD: u32 = 65536u;

// SOBOL: the function sobol(i) is printed here from rng.rs's directions.

struct Rng {
    seed: u32,
    index: u32,
    state: u32,
}

fn hash(a: u32) -> u32 {
    var x = (a ^ (a >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

fn hash2(a: u32, b: u32) -> u32 {
    return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6u) + (a >> 2u)));
}

fn laine_karras(a: u32, seed: u32) -> u32 {
    var x = a ^ (a * 0x3d20adeau);
    x = x + seed;
    x = x * ((seed >> 16u) | 1u);
    x = x ^ (x * 0x05526c56u);
    return x ^ (x * 0x53a22864u);
}

fn scramble(x: u32, seed: u32) -> u32 {
    return reverseBits(laine_karras(reverseBits(x), seed));
}

fn to_unit(x: u32) -> f32 {
    return f32(x >> 8u) * (1.0 / 16777216.0);
}

fn spread(a: u32) -> u32 {
    var x = a & 0xffffu;
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}

fn morton(x: u32, y: u32) -> u32 {
    return spread(x) | (spread(y) << 1u);
}

fn rng_new(x: u32, y: u32, index: u32, seed: u32) -> Rng {
    let s = hash2(hash2(x | (y << 16u), seed), index / PERIOD);
    return Rng(s, index % PERIOD, hash2(s, index ^ 0x5bd1e995u));
}

fn rng_set(rng: ptr<function, Rng>, number: u32) -> vec4<f32> {
    let seed = hash2((*rng).seed, number);
    let i = scramble((*rng).index, seed) & (PERIOD - 1u);
    let p = sobol(i);
    let s1 = hash(seed ^ 0xa511e9b3u);
    let s2 = hash(s1);
    return vec4<f32>(
        to_unit(scramble(p.x, s1)),
        to_unit(scramble(p.y, s2)),
        to_unit(scramble(p.z, s1 ^ 0x68e31da4u)),
        to_unit(scramble(p.w, s2 ^ 0x1b56c4e9u)),
    );
}

fn rng_aside(rng: ptr<function, Rng>) -> Rng {
    _ = rng_coin(rng);
    return Rng((*rng).seed, (*rng).index, hash((*rng).state));
}

fn rng_coin(rng: ptr<function, Rng>) -> f32 {
    let state = (*rng).state * 747796405u + 2891336453u;
    (*rng).state = state;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return to_unit((word >> 22u) ^ word);
}
