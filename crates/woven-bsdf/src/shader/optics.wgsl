// Generated from crates/woven-bsdf/src by `cargo run -p woven-bsdf --example print_shader`; do not edit.

fn openness(gamma_warp: f32, gamma_weft: f32, section: f32, w: vec3<f32>) -> f32 {
    let t0 = (section * section) / max(w.z * w.z, 1e-10f);
    let t1 = sqrt(1.0f + ((w.x * w.x) * t0));
    let t2 = sqrt(1.0f + ((w.y * w.y) * t0));
    let t3 = max(1.0f - (gamma_warp * t1), 0.0f) * max(1.0f - (gamma_weft * t2), 0.0f);
    return t3;
}

// lambert: k_d/π
fn lambert_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8> {
    return array<f32, 8>(select(0.0f, 0.31830987f, (l.z * v.z) < 0.0f), 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f);
}
fn lambert_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return select(0.0f, abs(wi.z) * 0.31830987f, (wo.z * wi.z) < 0.0f);
}
fn lambert_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let t0 = sqrt(max(max(u.x, 0.0f), 1e-14f));
    let t1 = u.y * 6.2831855f;
    let t2 = sqrt(max(1.0f - u.x, 1e-14f));
    let t3 = 1e-6f < t2;
    return vec3<f32>(select(0.0f, t0 * cos(t1), t3), select(0.0f, t0 * sin(t1), t3), select(0.0f, select(-t2, t2, wo.z < 0.0f), t3));
}

// ward: k_d/π + k_s/(4π a_x a_y √((n·l)(n·v'))) exp(-tan²δ (cos²φ_h/a_x² + sin²φ_h/a_y²))
fn ward_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8> {
    let t0 = abs(l.z);
    let t1 = abs(v.z);
    let t2 = l.x + v.x;
    let t3 = l.y + v.y;
    let t4 = t0 + t1;
    let t5 = max(((t2 * t2) + (t3 * t3)) + (t4 * t4), 1e-14f);
    let t6 = 1.0f / sqrt(t5);
    let t7 = t4 * t6;
    let t8 = (s[0] * s[1]) * sqrt(max(t0 * t1, 1e-8f));
    let t9 = (l.z * v.z) < 0.0f;
    let t10 = (t2 * t6) / s[0];
    let t11 = (t3 * t6) / s[1];
    let t12 = -(((t10 * t10) + (t11 * t11)) / max(t7 * t7, 1e-8f));
    return array<f32, 8>(select(0.0f, 0.31830987f, t9), select(0.0f, exp(t12) / (t8 * 12.566371f), t9), 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f);
}
fn ward_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let t0 = abs(wo.z);
    let t1 = abs(wi.z);
    let t2 = wi.x + wo.x;
    let t3 = wi.y + wo.y;
    let t4 = t1 + t0;
    let t5 = max(((t2 * t2) + (t3 * t3)) + (t4 * t4), 1e-14f);
    let t6 = 1.0f / sqrt(t5);
    let t7 = t2 * t6;
    let t8 = t3 * t6;
    let t9 = t4 * t6;
    let t10 = t7 / s[0];
    let t11 = t8 / s[1];
    let t12 = t9 * t9;
    let t13 = -(((t10 * t10) + (t11 * t11)) / max(t12, 1e-8f));
    let t14 = ((s[0] * s[1]) * max(t12 * t9, 1e-9f)) * 3.1415927f;
    let t15 = (((wo.x * t7) + (wo.y * t8)) + (t0 * t9)) * 4.0f;
    let t16 = (wo.z * wi.z) < 0.0f;
    let t17 = select(0.0f, (exp(t13) / t14) / max(t15, 1e-7f), t16);
    let t18 = (w[0] * select(0.0f, t1 * 0.31830987f, t16)) + (w[1] * t17);
    return t18;
}
fn ward_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let t0 = 1.0f - u.x;
    let t1 = max(-log(max(t0, 1e-12f)), 1e-14f);
    let t2 = sqrt(t1);
    let t3 = u.y * 6.2831855f;
    let t4 = cos(t3);
    let t5 = (s[0] * t2) * t4;
    let t6 = sin(t3);
    let t7 = (s[1] * t2) * t6;
    let t8 = max(((t5 * t5) + (t7 * t7)) + 1.0f, 1e-14f);
    let t9 = 1.0f / sqrt(t8);
    let t10 = t5 * t9;
    let t11 = t7 * t9;
    let t12 = abs(wo.z);
    let t13 = ((wo.x * t10) + (wo.y * t11)) + (t12 * t9);
    let t14 = t13 * 2.0f;
    let t15 = (t9 * t14) - t12;
    let t16 = 0.0f < t13;
    let t17 = wo.z < 0.0f;
    let t18 = 1e-6f < t15;
    let t19 = select(0.0f, select(0.0f, (t10 * t14) - wo.x, t18), t16);
    let t20 = select(0.0f, select(0.0f, (t11 * t14) - wo.y, t18), t16);
    let t21 = select(0.0f, select(0.0f, select(-t15, t15, t17), t18), t16);
    let t22 = u.z < w[0];
    let t23 = sqrt(max(max(u.x, 0.0f), 1e-14f));
    let t24 = sqrt(max(t0, 1e-14f));
    let t25 = 1e-6f < t24;
    let t26 = select(t21, select(0.0f, select(-t24, t24, t17), t25), t22);
    return vec3<f32>(select(t19, select(0.0f, t23 * t4, t25), t22), select(t20, select(0.0f, t23 * t6, t25), t22), t26);
}

// hgf: a_d HG(g_d) + a_s HG(g_s) + c/π, HG(g) = (1-g²)/(4π(1+g²-2g cosθ)^1.5), θ between v and -l
fn hgf_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8> {
    let t0 = l.z * v.z;
    let t1 = -(((l.x * v.x) + (l.y * v.y)) + t0);
    let t2 = min(max(s[0], -0.999f), 0.999f);
    let t3 = t2 * t2;
    let t4 = max((1.0f + t3) - ((t2 * t1) * 2.0f), 1e-9f);
    let t5 = (1.0f - t3) / ((t4 * sqrt(t4)) * 12.566371f);
    let t6 = t0 < 0.0f;
    let t7 = min(max(s[1], -0.999f), 0.999f);
    let t8 = t7 * t7;
    let t9 = max((1.0f + t8) - ((t7 * t1) * 2.0f), 1e-9f);
    let t10 = (1.0f - t8) / ((t9 * sqrt(t9)) * 12.566371f);
    return array<f32, 8>(select(0.0f, t5, t6), select(0.0f, t10, t6), select(0.0f, 0.31830987f, t6), 0.0f, 0.0f, 0.0f, 0.0f, 0.0f);
}
fn hgf_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let t0 = wo.z * wi.z;
    let t1 = -(((wo.x * wi.x) + (wo.y * wi.y)) + t0);
    let t2 = min(max(s[0], -0.999f), 0.999f);
    let t3 = t2 * t2;
    let t4 = max((1.0f + t3) - ((t2 * t1) * 2.0f), 1e-9f);
    let t5 = (1.0f - t3) / ((t4 * sqrt(t4)) * 12.566371f);
    let t6 = min(max(s[1], -0.999f), 0.999f);
    let t7 = t6 * t6;
    let t8 = max((1.0f + t7) - ((t6 * t1) * 2.0f), 1e-9f);
    let t9 = (1.0f - t7) / ((t8 * sqrt(t8)) * 12.566371f);
    let t10 = t0 < 0.0f;
    let t11 = w[2] * select(0.0f, abs(wi.z) * 0.31830987f, t10);
    let t12 = select(0.0f, (w[0] * t5) + (w[1] * t9), t10) + t11;
    return t12;
}
fn hgf_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let t0 = -wo.x;
    let t1 = -wo.y;
    let t2 = -wo.z;
    let t3 = min(max(select(s[1], s[0], u.z < w[0]), -0.999f), 0.999f);
    let t4 = abs(t3) < 0.001f;
    let t5 = select(t3, 0.001f, t4);
    let t6 = t5 * t5;
    let t7 = (1.0f - t6) / ((1.0f - t5) + ((t5 * u.x) * 2.0f));
    let t8 = select(((1.0f + t6) - (t7 * t7)) / (t5 * 2.0f), (u.x * 2.0f) - 1.0f, t4);
    let t9 = min(max(t8, -1.0f), 1.0f);
    let t10 = sqrt(max(1.0f - (t9 * t9), 1e-14f));
    let t11 = u.y * 6.2831855f;
    let t12 = cos(t11);
    let t13 = t10 * t12;
    let t14 = sin(t11);
    let t15 = t10 * t14;
    let t16 = select(1.0f, -1.0f, t2 < 0.0f);
    let t17 = -(1.0f / (t16 + t2));
    let t18 = (t0 * t1) * t17;
    let t19 = 1.0f + ((t16 * (t0 * t0)) * t17);
    let t20 = (t16 + ((t1 * t1) * t17)) * t15;
    let t21 = ((-(t16 * t0)) * t13) + ((-t1) * t15);
    let t22 = (((t16 * t18) * t13) + t20) + (t1 * t9);
    let t23 = t21 + (t2 * t9);
    let t24 = (wo.z * t23) < 0.0f;
    let t25 = select(0.0f, ((t19 * t13) + (t18 * t15)) + (t0 * t9), t24);
    let t26 = u.z < (w[0] + w[1]);
    let t27 = sqrt(max(max(u.x, 0.0f), 1e-14f));
    let t28 = sqrt(max(1.0f - u.x, 1e-14f));
    let t29 = 1e-6f < t28;
    let t30 = select(select(0.0f, select(-t28, t28, wo.z < 0.0f), t29), select(0.0f, t23, t24), t26);
    return vec3<f32>(select(select(0.0f, t27 * t12, t29), t25, t26), select(select(0.0f, t27 * t14, t29), select(0.0f, t22, t24), t26), t30);
}

// ggx-mirrored: k_d/π + k_t D(h) G1(l) G1(v') / (4 (n·l)(n·v')), h = (l+v')/|l+v'|, v' = v mirrored back through the sheet
fn ggx_mirrored_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8> {
    let t0 = (l.z * v.z) < 0.0f;
    let t1 = abs(l.z);
    let t2 = abs(v.z);
    let t3 = l.x + v.x;
    let t4 = l.y + v.y;
    let t5 = t1 + t2;
    let t6 = max(((t3 * t3) + (t4 * t4)) + (t5 * t5), 1e-14f);
    let t7 = 1.0f / sqrt(t6);
    let t8 = t5 * t7;
    let t9 = (t3 * t7) / s[0];
    let t10 = (t4 * t7) / s[1];
    let t11 = ((t9 * t9) + (t10 * t10)) + (t8 * t8);
    let t12 = max(((s[0] * s[1]) * (t11 * t11)) * 3.1415927f, 1e-30f);
    let t13 = l.x * s[0];
    let t14 = l.y * s[1];
    let t15 = 1.0f + (((t13 * t13) + (t14 * t14)) / max(t1 * t1, 1e-12f));
    let t16 = (1.0f / t12) * (2.0f / (1.0f + sqrt(t15)));
    let t17 = v.x * s[0];
    let t18 = v.y * s[1];
    let t19 = 1.0f + (((t17 * t17) + (t18 * t18)) / max(t2 * t2, 1e-12f));
    let t20 = t16 * (2.0f / (1.0f + sqrt(t19)));
    let t21 = t20 / max((t1 * t2) * 4.0f, 1e-7f);
    return array<f32, 8>(select(0.0f, 0.31830987f, t0), select(0.0f, t21, t0), 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f);
}
fn ggx_mirrored_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let t0 = abs(wi.z);
    let t1 = abs(wo.z);
    let t2 = wi.x + wo.x;
    let t3 = wi.y + wo.y;
    let t4 = t0 + t1;
    let t5 = max(((t2 * t2) + (t3 * t3)) + (t4 * t4), 1e-14f);
    let t6 = 1.0f / sqrt(t5);
    let t7 = t4 * t6;
    let t8 = (t2 * t6) / s[0];
    let t9 = (t3 * t6) / s[1];
    let t10 = ((t8 * t8) + (t9 * t9)) + (t7 * t7);
    let t11 = max(((s[0] * s[1]) * (t10 * t10)) * 3.1415927f, 1e-30f);
    let t12 = wo.x * s[0];
    let t13 = wo.y * s[1];
    let t14 = 1.0f + (((t12 * t12) + (t13 * t13)) / max(t1 * t1, 1e-12f));
    let t15 = (1.0f / t11) * (2.0f / (1.0f + sqrt(t14)));
    let t16 = (wo.z * wi.z) < 0.0f;
    let t17 = select(0.0f, t15 / max(t1 * 4.0f, 1e-7f), t16);
    let t18 = (w[0] * select(0.0f, t0 * 0.31830987f, t16)) + (w[1] * t17);
    return t18;
}
fn ggx_mirrored_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let t0 = abs(wo.z);
    let t1 = wo.x * s[0];
    let t2 = wo.y * s[1];
    let t3 = max(((t1 * t1) + (t2 * t2)) + (t0 * t0), 1e-14f);
    let t4 = 1.0f / sqrt(t3);
    let t5 = t0 * t4;
    let t6 = u.x * 6.2831855f;
    let t7 = ((1.0f - u.y) * (1.0f + t5)) - t5;
    let t8 = sqrt(max(1.0f - (t7 * t7), 1e-14f));
    let t9 = ((t8 * cos(t6)) + (t1 * t4)) * s[0];
    let t10 = ((t8 * sin(t6)) + (t2 * t4)) * s[1];
    let t11 = max(t7 + t5, 1e-6f);
    let t12 = max(((t9 * t9) + (t10 * t10)) + (t11 * t11), 1e-14f);
    let t13 = 1.0f / sqrt(t12);
    let t14 = t9 * t13;
    let t15 = t10 * t13;
    let t16 = t11 * t13;
    let t17 = (((wo.x * t14) + (wo.y * t15)) + (t0 * t16)) * 2.0f;
    let t18 = (t16 * t17) - t0;
    let t19 = wo.z < 0.0f;
    let t20 = 1e-6f < t18;
    let t21 = u.z < w[0];
    let t22 = sqrt(max(max(u.x, 0.0f), 1e-14f));
    let t23 = u.y * 6.2831855f;
    let t24 = sqrt(max(1.0f - u.x, 1e-14f));
    let t25 = 1e-6f < t24;
    let t26 = select(select(0.0f, (t14 * t17) - wo.x, t20), select(0.0f, t22 * cos(t23), t25), t21);
    let t27 = select(select(0.0f, (t15 * t17) - wo.y, t20), select(0.0f, t22 * sin(t23), t25), t21);
    let t28 = select(select(0.0f, select(-t18, t18, t19), t20), select(0.0f, select(-t24, t24, t19), t25), t21);
    return vec3<f32>(t26, t27, t28);
}

// sheet: T: c_l c_v t_d/(π c̄) + min(c_l,c_v) k_t (M(l,v') + (1-E_l)(1-E_v)/(π(1-Ē))); R: c_l c_v r_d/(π c̄) + min(c_l,c_v) k_r M_r(l,v) F(f0); c = 1 - openness; gap: openness·δ
fn sheet_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8> {
    let t0 = (l.z * v.z) < 0.0f;
    let t1 = s[2] * s[2];
    let t2 = t1 / max(l.z * l.z, 1e-10f);
    let t3 = sqrt(1.0f + ((l.x * l.x) * t2));
    let t4 = sqrt(1.0f + ((l.y * l.y) * t2));
    let t5 = max(1.0f - (s[0] * t3), 0.0f) * max(1.0f - (s[1] * t4), 0.0f);
    let t6 = 1.0f - t5;
    let t7 = t1 / max(v.z * v.z, 1e-10f);
    let t8 = sqrt(1.0f + ((v.x * v.x) * t7));
    let t9 = sqrt(1.0f + ((v.y * v.y) * t7));
    let t10 = max(1.0f - (s[0] * t8), 0.0f) * max(1.0f - (s[1] * t9), 0.0f);
    let t11 = 1.0f - t10;
    let t12 = ((t6 * t11) * s[8]) * 0.31830987f;
    let t13 = select(s[5], s[3], t0);
    let t14 = select(s[6], s[4], t0);
    let t15 = abs(l.z);
    let t16 = abs(v.z);
    let t17 = l.x + v.x;
    let t18 = l.y + v.y;
    let t19 = t15 + t16;
    let t20 = max(((t17 * t17) + (t18 * t18)) + (t19 * t19), 1e-14f);
    let t21 = 1.0f / sqrt(t20);
    let t22 = t17 * t21;
    let t23 = t18 * t21;
    let t24 = t19 * t21;
    let t25 = t22 / t13;
    let t26 = t23 / t14;
    let t27 = ((t25 * t25) + (t26 * t26)) + (t24 * t24);
    let t28 = max(((t13 * t14) * (t27 * t27)) * 3.1415927f, 1e-30f);
    let t29 = l.x * t13;
    let t30 = l.y * t14;
    let t31 = 1.0f + (((t29 * t29) + (t30 * t30)) / max(t15 * t15, 1e-12f));
    let t32 = (1.0f / t28) * (2.0f / (1.0f + sqrt(t31)));
    let t33 = v.x * t13;
    let t34 = v.y * t14;
    let t35 = 1.0f + (((t33 * t33) + (t34 * t34)) / max(t16 * t16, 1e-12f));
    let t36 = t32 * (2.0f / (1.0f + sqrt(t35)));
    let t37 = t36 / max((t15 * t16) * 4.0f, 1e-7f);
    let t38 = min(max(t15, 0.0f), 1.0f);
    let t39 = s[9] * 1.5f;
    let t40 = t38 / max(t38 + t39, 1e-6f);
    let t41 = ((((-21.144463f) * s[9]) + (-16.781918f)) * s[9]) + 64.21432f;
    let t42 = (((t41 * s[9]) + (-5.954266f)) * s[9]) + (-6.036059f);
    let t43 = (((111.59707f * s[9]) + (-8.149532f)) * s[9]) + (-146.26772f);
    let t44 = (((t43 * s[9]) + 17.876793f) * s[9]) + 16.636341f;
    let t45 = ((((-93.81055f) * s[9]) + (-11.945922f)) * s[9]) + 140.7482f;
    let t46 = (((t45 * s[9]) + (-21.667885f)) * s[9]) + (-15.358249f);
    let t47 = (((t42 * t40) + t44) * t40) + t46;
    let t48 = (((20.753538f * s[9]) + 33.436848f) * s[9]) + (-69.08945f);
    let t49 = (((t48 * s[9]) + 12.033237f) * s[9]) + 5.178192f;
    let t50 = ((((-0.97849f) * s[9]) + (-10.735562f)) * s[9]) + 14.104216f;
    let t51 = (((t50 * s[9]) + (-2.582927f)) * s[9]) + (-0.693694f);
    let t52 = (((t47 * t40) + t49) * t40) + t51;
    let t53 = ((((-0.374508f) * s[9]) + 1.030206f) * s[9]) + 0.030101f;
    let t54 = (((t53 * s[9]) + 0.048797f) * s[9]) + 0.21256f;
    let t55 = (((0.126509f * s[9]) + (-0.503019f)) * s[9]) + 0.686083f;
    let t56 = (((t55 * s[9]) + 0.015319f) * s[9]) + 0.06093f;
    let t57 = (((t52 * t40) + t54) * t40) + t56;
    let t58 = min(max(t16, 0.0f), 1.0f);
    let t59 = t58 / max(t58 + t39, 1e-6f);
    let t60 = (((t42 * t59) + t44) * t59) + t46;
    let t61 = (((t60 * t59) + t49) * t59) + t51;
    let t62 = (((t61 * t59) + t54) * t59) + t56;
    let t63 = (min(max(t57, 0.0f), 1.0f) * min(max(t62, 0.0f), 1.0f)) * s[10];
    let t64 = max(((l.x * t22) + (l.y * t23)) + (t15 * t24), 0.0f);
    let t65 = 1.0f - min(t64, 1.0f);
    let t66 = t65 * t65;
    let t67 = s[7] + ((1.0f - s[7]) * ((t66 * t66) * t65));
    let t68 = min(t6, t11);
    let t69 = select(0.0f, t68 * (t37 + (t63 * 0.31830987f)), t0);
    return array<f32, 8>(select(0.0f, t12, t0), t69, select(t12, 0.0f, t0), select((t68 * t37) * t67, 0.0f, t0), 0.0f, 0.0f, 0.0f, 0.0f);
}
fn sheet_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let t0 = (wo.z * wi.z) < 0.0f;
    let t1 = abs(wo.z);
    let t2 = min(max(t1, 0.0f), 1.0f);
    let t3 = t2 / max(t2 + (s[9] * 1.5f), 1e-6f);
    let t4 = ((((-21.144463f) * s[9]) + (-16.781918f)) * s[9]) + 64.21432f;
    let t5 = (((t4 * s[9]) + (-5.954266f)) * s[9]) + (-6.036059f);
    let t6 = (((111.59707f * s[9]) + (-8.149532f)) * s[9]) + (-146.26772f);
    let t7 = (((t6 * s[9]) + 17.876793f) * s[9]) + 16.636341f;
    let t8 = ((((-93.81055f) * s[9]) + (-11.945922f)) * s[9]) + 140.7482f;
    let t9 = (((t8 * s[9]) + (-21.667885f)) * s[9]) + (-15.358249f);
    let t10 = (((t5 * t3) + t7) * t3) + t9;
    let t11 = (((20.753538f * s[9]) + 33.436848f) * s[9]) + (-69.08945f);
    let t12 = (((t11 * s[9]) + 12.033237f) * s[9]) + 5.178192f;
    let t13 = ((((-0.97849f) * s[9]) + (-10.735562f)) * s[9]) + 14.104216f;
    let t14 = (((t13 * s[9]) + (-2.582927f)) * s[9]) + (-0.693694f);
    let t15 = (((t10 * t3) + t12) * t3) + t14;
    let t16 = ((((-0.374508f) * s[9]) + 1.030206f) * s[9]) + 0.030101f;
    let t17 = (((t16 * s[9]) + 0.048797f) * s[9]) + 0.21256f;
    let t18 = (((0.126509f * s[9]) + (-0.503019f)) * s[9]) + 0.686083f;
    let t19 = (((t18 * s[9]) + 0.015319f) * s[9]) + 0.06093f;
    let t20 = (((t15 * t3) + t17) * t3) + t19;
    let t21 = min(max(t20, 0.0f), 1.0f);
    let t22 = select(s[5], s[3], t0);
    let t23 = select(s[6], s[4], t0);
    let t24 = abs(wi.z);
    let t25 = wi.x + wo.x;
    let t26 = wi.y + wo.y;
    let t27 = t24 + t1;
    let t28 = max(((t25 * t25) + (t26 * t26)) + (t27 * t27), 1e-14f);
    let t29 = 1.0f / sqrt(t28);
    let t30 = t27 * t29;
    let t31 = (t25 * t29) / t22;
    let t32 = (t26 * t29) / t23;
    let t33 = ((t31 * t31) + (t32 * t32)) + (t30 * t30);
    let t34 = max(((t22 * t23) * (t33 * t33)) * 3.1415927f, 1e-30f);
    let t35 = wo.x * t22;
    let t36 = wo.y * t23;
    let t37 = 1.0f + (((t35 * t35) + (t36 * t36)) / max(t1 * t1, 1e-12f));
    let t38 = (1.0f / t34) * (2.0f / (1.0f + sqrt(t37)));
    let t39 = select(w[2], w[0] + (w[1] * t21), t0) * (t24 * 0.31830987f);
    let t40 = select(w[3], w[1] * (1.0f - t21), t0) * (t38 / max(t1 * 4.0f, 1e-7f));
    return t39 + t40;
}
fn sheet_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let t0 = abs(wo.z);
    let t1 = min(max(t0, 0.0f), 1.0f);
    let t2 = t1 / max(t1 + (s[9] * 1.5f), 1e-6f);
    let t3 = ((((-21.144463f) * s[9]) + (-16.781918f)) * s[9]) + 64.21432f;
    let t4 = (((t3 * s[9]) + (-5.954266f)) * s[9]) + (-6.036059f);
    let t5 = (((111.59707f * s[9]) + (-8.149532f)) * s[9]) + (-146.26772f);
    let t6 = (((t5 * s[9]) + 17.876793f) * s[9]) + 16.636341f;
    let t7 = ((((-93.81055f) * s[9]) + (-11.945922f)) * s[9]) + 140.7482f;
    let t8 = (((t7 * s[9]) + (-21.667885f)) * s[9]) + (-15.358249f);
    let t9 = (((t4 * t2) + t6) * t2) + t8;
    let t10 = (((20.753538f * s[9]) + 33.436848f) * s[9]) + (-69.08945f);
    let t11 = (((t10 * s[9]) + 12.033237f) * s[9]) + 5.178192f;
    let t12 = ((((-0.97849f) * s[9]) + (-10.735562f)) * s[9]) + 14.104216f;
    let t13 = (((t12 * s[9]) + (-2.582927f)) * s[9]) + (-0.693694f);
    let t14 = (((t9 * t2) + t11) * t2) + t13;
    let t15 = ((((-0.374508f) * s[9]) + 1.030206f) * s[9]) + 0.030101f;
    let t16 = (((t15 * s[9]) + 0.048797f) * s[9]) + 0.21256f;
    let t17 = (((0.126509f * s[9]) + (-0.503019f)) * s[9]) + 0.686083f;
    let t18 = (((t17 * s[9]) + 0.015319f) * s[9]) + 0.06093f;
    let t19 = (((t14 * t2) + t16) * t2) + t18;
    let t20 = min(max(t19, 0.0f), 1.0f);
    let t21 = w[0] + (w[1] * t20);
    let t22 = t21 + w[2];
    let t23 = u.z < t22;
    let t24 = u.z < (t22 + (w[1] * (1.0f - t20)));
    let t25 = (u.z < t21) | (t24 & (!t23));
    let t26 = select(s[5], s[3], t25);
    let t27 = select(s[6], s[4], t25);
    let t28 = wo.x * t26;
    let t29 = wo.y * t27;
    let t30 = max(((t28 * t28) + (t29 * t29)) + (t0 * t0), 1e-14f);
    let t31 = 1.0f / sqrt(t30);
    let t32 = t0 * t31;
    let t33 = u.x * 6.2831855f;
    let t34 = ((1.0f - u.y) * (1.0f + t32)) - t32;
    let t35 = sqrt(max(1.0f - (t34 * t34), 1e-14f));
    let t36 = ((t35 * cos(t33)) + (t28 * t31)) * t26;
    let t37 = ((t35 * sin(t33)) + (t29 * t31)) * t27;
    let t38 = max(t34 + t32, 1e-6f);
    let t39 = max(((t36 * t36) + (t37 * t37)) + (t38 * t38), 1e-14f);
    let t40 = 1.0f / sqrt(t39);
    let t41 = t36 * t40;
    let t42 = t37 * t40;
    let t43 = t38 * t40;
    let t44 = (((wo.x * t41) + (wo.y * t42)) + (t0 * t43)) * 2.0f;
    let t45 = sqrt(max(max(u.x, 0.0f), 1e-14f));
    let t46 = u.y * 6.2831855f;
    let t47 = select((t43 * t44) - t0, sqrt(max(1.0f - u.x, 1e-14f)), t23);
    let t48 = 1e-6f < t47;
    let t49 = select(0.0f, select((t41 * t44) - wo.x, t45 * cos(t46), t23), t48);
    let t50 = select(0.0f, select((t42 * t44) - wo.y, t45 * sin(t46), t23), t48);
    let t51 = select(0.0f, select(-t47, t47, wo.z < 0.0f), t48);
    return vec3<f32>(t49, t50, select(-t51, t51, t25));
}
