// Elementary functions written out, so that CPU and GPU round alike; the pair of cpu/math.rs.

// sin and cos of 2 pi u.
fn sincos_turn(u: f32) -> vec2<f32> {
    let quarter = floor(u * 4.0 + 0.5);
    let x = (u * 4.0 - quarter) * FRAC_PI_2;
    let z = x * x;
    let s = ((-1.9515296e-4 * z + 8.332161e-3) * z - 1.6666655e-1) * z * x + x;
    let c = ((2.4433157e-5 * z - 1.3887316e-3) * z + 4.1666646e-2) * z * z - 0.5 * z + 1.0;
    switch i32(quarter) & 3 {
        case 0: { return vec2<f32>(s, c); }
        case 1: { return vec2<f32>(c, -s); }
        case 2: { return vec2<f32>(-s, -c); }
        default: { return vec2<f32>(-c, s); }
    }
}

fn atan_positive(a: f32) -> f32 {
    var x = a;
    var base = 0.0;
    if (a > 2.4142136) {
        base = FRAC_PI_2;
        x = -1.0 / a;
    } else if (a > 0.41421357) {
        base = FRAC_PI_4;
        x = (a - 1.0) / (a + 1.0);
    }
    let z = x * x;
    return base + (((8.0537445e-2 * z - 1.3877686e-1) * z + 1.9977711e-1) * z - 3.333295e-1) * z * x + x;
}

fn arc2(y: f32, x: f32) -> f32 {
    if (y == 0.0 && x == 0.0) {
        return 0.0;
    }
    let ax = abs(x);
    let ay = abs(y);
    var a: f32;
    if (ax >= ay) {
        a = atan_positive(ay / ax);
    } else {
        a = FRAC_PI_2 - atan_positive(ax / ay);
    }
    if (x < 0.0) {
        a = PI - a;
    }
    return select(a, -a, y < 0.0);
}

fn arc_cos(c: f32) -> f32 {
    let x = clamp(c, -1.0, 1.0);
    return 2.0 * arc2(sqrt(1.0 - x), sqrt(1.0 + x));
}

fn sincos(a: f32) -> vec2<f32> {
    let u = a * (1.0 / TAU);
    return sincos_turn(u - floor(u));
}

fn luminance(c: vec3<f32>) -> f32 {
    return c.x * 0.2126 + c.y * 0.7152 + c.z * 0.0722;
}

fn length2(v: vec3<f32>) -> f32 {
    return v.x * v.x + v.y * v.y + v.z * v.z;
}

fn unit(v: vec3<f32>) -> vec3<f32> {
    return v * (1.0 / sqrt(length2(v)));
}

fn max3(c: vec3<f32>) -> f32 {
    return max(c.x, max(c.y, c.z));
}

fn copysign1(a: f32, s: f32) -> f32 {
    return select(a, -a, s < 0.0);
}
