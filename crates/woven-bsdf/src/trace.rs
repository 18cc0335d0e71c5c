//! `Rec`: a scalar that records what is done to it, so that a formula written in Rust can be printed as WGSL.
//!
//! A recording lives in a thread-local [`Tape`]; [`record`] opens one, runs the formula and hands the tape back with
//! the roots. Equal operations share one node, constants are folded, `x·1`, `x·0` and `x+0` disappear. Loops of fixed
//! length unroll; there are no branches but [`Real::select`].

pub mod wgsl;

use crate::real::Real;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// One recorded operation; operands are indices into the tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Op {
    /// Input number `i` of the recorded function.
    Input(u32),
    /// A constant, by its bits.
    Const(u64),
    /// A binary operation or function.
    Binary(Binary, u32, u32),
    /// A function of one operand.
    Unary(Unary, u32),
    /// `select(mask, a, b)`.
    Select(u32, u32, u32),
}

/// Operations of two operands; comparisons and `And`, `Or` give masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Min,
    Max,
    Pow,
    Lt,
    Le,
    And,
    Or,
}

/// Operations of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Unary {
    Neg,
    Not,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Abs,
}

/// The operations recorded, in an order in which operands come before their use.
#[derive(Default, Debug)]
pub struct Tape {
    pub(crate) ops: Vec<Op>,
    index: HashMap<Op, u32>,
}

impl Tape {
    fn push(&mut self, op: Op) -> u32 {
        *self.index.entry(op).or_insert_with(|| {
            self.ops.push(op);
            (self.ops.len() - 1) as u32
        })
    }
    fn constant(&self, i: u32) -> Option<f64> {
        match self.ops[i as usize] {
            Op::Const(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }
}

thread_local! {
    static TAPE: RefCell<Tape> = RefCell::new(Tape::default());
}

fn push(op: Op) -> u32 {
    TAPE.with_borrow_mut(|tape| tape.push(op))
}

fn constant(i: u32) -> Option<f64> {
    TAPE.with_borrow(|tape| tape.constant(i))
}

/// Runs `f` on an empty tape and returns the tape and what `f` returned.
pub fn record<T>(f: impl FnOnce() -> T) -> (Tape, T) {
    TAPE.with_borrow_mut(|tape| *tape = Tape::default());
    let out = f();
    (TAPE.with_borrow_mut(std::mem::take), out)
}

/// A recorded number: a place on the tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rec(pub(crate) u32);

/// A recorded truth value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecMask(pub(crate) u32);

impl Rec {
    /// The input number `i` of the function being recorded.
    pub fn input(i: u32) -> Self {
        Rec(push(Op::Input(i)))
    }
}

fn unary(op: Unary, a: Rec, fold: impl Fn(f64) -> f64) -> Rec {
    match constant(a.0) {
        Some(x) => Rec::of(fold(x)),
        None => Rec(push(Op::Unary(op, a.0))),
    }
}

fn binary(op: Binary, a: Rec, b: Rec, fold: impl Fn(f64, f64) -> f64) -> Rec {
    match (constant(a.0), constant(b.0)) {
        (Some(x), Some(y)) => Rec::of(fold(x, y)),
        _ => Rec(push(Op::Binary(op, a.0, b.0))),
    }
}

impl Add for Rec {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        if constant(self.0) == Some(0.0) {
            return o;
        }
        if constant(o.0) == Some(0.0) {
            return self;
        }
        binary(Binary::Add, self, o, |a, b| a + b)
    }
}
impl Sub for Rec {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        if constant(o.0) == Some(0.0) {
            return self;
        }
        binary(Binary::Sub, self, o, |a, b| a - b)
    }
}
impl Mul for Rec {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        match (constant(self.0), constant(o.0)) {
            (Some(1.0), _) => o,
            (_, Some(1.0)) => self,
            (Some(0.0), _) | (_, Some(0.0)) => Rec::of(0.0),
            _ => binary(Binary::Mul, self, o, |a, b| a * b),
        }
    }
}
impl Div for Rec {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        if constant(o.0) == Some(1.0) {
            return self;
        }
        binary(Binary::Div, self, o, |a, b| a / b)
    }
}
impl Neg for Rec {
    type Output = Self;
    fn neg(self) -> Self {
        unary(Unary::Neg, self, |a| -a)
    }
}
impl BitAnd for RecMask {
    type Output = Self;
    fn bitand(self, o: Self) -> Self {
        RecMask(push(Op::Binary(Binary::And, self.0, o.0)))
    }
}
impl BitOr for RecMask {
    type Output = Self;
    fn bitor(self, o: Self) -> Self {
        RecMask(push(Op::Binary(Binary::Or, self.0, o.0)))
    }
}
impl Not for RecMask {
    type Output = Self;
    fn not(self) -> Self {
        RecMask(push(Op::Unary(Unary::Not, self.0)))
    }
}

impl Real for Rec {
    type Mask = RecMask;
    fn of(x: f64) -> Self {
        assert!(x.is_finite(), "WGSL has no literal for {x}");
        Rec(push(Op::Const(x.to_bits())))
    }
    fn lt(self, o: Self) -> RecMask {
        RecMask(push(Op::Binary(Binary::Lt, self.0, o.0)))
    }
    fn le(self, o: Self) -> RecMask {
        RecMask(push(Op::Binary(Binary::Le, self.0, o.0)))
    }
    fn select(mask: RecMask, a: Self, b: Self) -> Self {
        if a == b {
            a
        } else {
            Rec(push(Op::Select(mask.0, a.0, b.0)))
        }
    }
    fn sqrt(self) -> Self {
        unary(Unary::Sqrt, self, f64::sqrt)
    }
    fn exp(self) -> Self {
        unary(Unary::Exp, self, f64::exp)
    }
    fn ln(self) -> Self {
        unary(Unary::Ln, self, f64::ln)
    }
    fn sin(self) -> Self {
        unary(Unary::Sin, self, f64::sin)
    }
    fn cos(self) -> Self {
        unary(Unary::Cos, self, f64::cos)
    }
    fn abs(self) -> Self {
        unary(Unary::Abs, self, f64::abs)
    }
    fn min(self, o: Self) -> Self {
        binary(Binary::Min, self, o, f64::min)
    }
    fn max(self, o: Self) -> Self {
        binary(Binary::Max, self, o, f64::max)
    }
    fn powf(self, e: Self) -> Self {
        binary(Binary::Pow, self, e, f64::powf)
    }
}
