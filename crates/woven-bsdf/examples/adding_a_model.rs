//! Adding a model: this file is all that a new model needs; a line `ModelInfo::of::<velvet::Velvet>()` in `MODELS` then
//! gives it sliders, bounds, a fit, a shader and a place in every test. Run it to see its values, derivatives and WGSL.

use std::f64::consts::PI;
use woven_bsdf::model::{Linear, Model, ModelInfo, Param, Shape};
use woven_bsdf::real::Real;
use woven_bsdf::shader;
use woven_bsdf::term::warp;
use woven_bsdf::vec3::Vec3;

/// Light that grows towards the rim, as behind a pile of upright fibres: k (1 - |n·v|)^p (1 - |n·l|)^p.
struct Velvet;

impl Model for Velvet {
    const NAME: &'static str = "velvet";
    const EQUATION: &'static str =
        "k (1 - |n·l|)^p (1 - |n·v|)^p, light and viewer on opposite sides";
    const DOC: &'static str =
        "An example. Reciprocal, because the formula is symmetric in l and v.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        Param::linear("k", "strength at the rim", 1.0, 0.2),
        Param::shape(
            "p",
            "how narrow the rim is: 1 wide, 10 a line",
            0.5,
            10.0,
            2.0,
        ),
    ];

    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        // Guard the operand of a power, not its result: the slope of ln at 0 is infinite.
        let rim = (l.z.abs().one_minus() * v.z.abs().one_minus()).max(R::of(1e-9));
        let mut b = [R::zero(); 8];
        b[0] = R::select((l.z * v.z).lt(R::zero()), rim.powf(s[0]), R::zero());
        b
    }
    fn pdf<R: Real>(_: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let opposite = (wo.z * wi.z).lt(R::zero());
        R::select(opposite, wi.z.abs() * R::of(1.0 / PI), R::zero())
    }
    fn sample<R: Real>(_: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let w = warp::cosine(u[0], u[1]);
        Vec3::new(w.x, w.y, R::select(wo.z.lt(R::zero()), w.z, -w.z))
    }
}

fn main() {
    static VELVET: ModelInfo = ModelInfo::of::<Velvet>();
    let (l, v) = (Vec3::from_angles(1.2, 0.0), Vec3::from_angles(2.0, 1.0));
    println!("f = {:.6}/sr", VELVET.eval(&[0.2, 2.0], l, v));
    let dual = (VELVET.dual)(&VELVET.prepare_dual(&[2.0]), l.cast(), v.cast());
    println!("basis = {:.6}, d basis/dp = {:.6}", dual[0].v, dual[0].d[0]);
    println!("{}", shader::functions(&VELVET));
}
