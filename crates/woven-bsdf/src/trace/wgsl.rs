//! Prints a [`Tape`] as the body of a WGSL function: one `let` for each value used more than once or grown long.

use super::{Binary, Op, Rec, Tape, Unary};
use std::fmt::Write;

/// How deep an expression may nest before it gets a name; shader compilers choke on deep nesting.
const MAX_DEPTH: u32 = 4;

/// A WGSL function printed from a recording.
///
/// `inputs[i]` is the WGSL expression of input `i`, `result` turns the printed roots into the return expression.
pub fn function(
    signature: &str,
    prologue: &str,
    inputs: &[String],
    tape: &Tape,
    roots: &[Rec],
    result: impl Fn(&[String]) -> String,
) -> String {
    let mut uses = vec![0u32; tape.ops.len()];
    for root in roots {
        uses[root.0 as usize] += 1;
    }
    for i in (0..tape.ops.len()).rev() {
        if uses[i] > 0 {
            operands(tape.ops[i])
                .iter()
                .for_each(|&o| uses[o as usize] += 1);
        }
    }
    let mut text: Vec<(String, u32)> = Vec::with_capacity(tape.ops.len());
    let mut body = String::new();
    let mut names = 0;
    for (i, &op) in tape.ops.iter().enumerate() {
        if uses[i] == 0 {
            text.push((String::new(), 0));
            continue;
        }
        let (expr, depth) = expression(op, inputs, &text);
        let leaf = matches!(op, Op::Input(_) | Op::Const(_));
        if !leaf && (uses[i] > 1 || depth >= MAX_DEPTH) {
            let name = format!("t{names}");
            names += 1;
            writeln!(body, "    let {name} = {};", strip(&expr)).expect("a string grows");
            text.push((name, 0));
        } else {
            text.push((expr, depth));
        }
    }
    let outs: Vec<String> = roots
        .iter()
        .map(|r| strip(&text[r.0 as usize].0).to_owned())
        .collect();
    format!(
        "{signature} {{\n{prologue}{body}    return {};\n}}\n",
        result(&outs)
    )
}

fn operands(op: Op) -> Vec<u32> {
    match op {
        Op::Input(_) | Op::Const(_) => vec![],
        Op::Unary(_, a) => vec![a],
        Op::Binary(_, a, b) => vec![a, b],
        Op::Select(m, a, b) => vec![m, a, b],
    }
}

/// The expression without the parentheses around the whole of it.
fn strip(expr: &str) -> &str {
    if !(expr.starts_with('(') && expr.ends_with(')')) {
        return expr;
    }
    let mut depth = 0;
    for (i, c) in expr.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if depth == 0 && i + 1 < expr.len() {
            return expr;
        }
    }
    &expr[1..expr.len() - 1]
}

fn expression(op: Op, inputs: &[String], text: &[(String, u32)]) -> (String, u32) {
    let t = |i: u32| text[i as usize].0.as_str();
    let d = |i: u32| text[i as usize].1;
    match op {
        Op::Input(i) => (inputs[i as usize].clone(), 0),
        Op::Const(bits) => (literal(f64::from_bits(bits)), 0),
        Op::Unary(u, a) => {
            let s = match u {
                Unary::Neg => format!("(-{})", t(a)),
                Unary::Not => format!("(!{})", t(a)),
                Unary::Sqrt => format!("sqrt({})", strip(t(a))),
                Unary::Exp => format!("exp({})", strip(t(a))),
                Unary::Ln => format!("log({})", strip(t(a))),
                Unary::Sin => format!("sin({})", strip(t(a))),
                Unary::Cos => format!("cos({})", strip(t(a))),
                Unary::Abs => format!("abs({})", strip(t(a))),
            };
            (s, d(a) + 1)
        }
        Op::Binary(b, x, y) => {
            let infix = |o: &str| format!("({} {o} {})", t(x), t(y));
            let call = |f: &str| format!("{f}({}, {})", strip(t(x)), strip(t(y)));
            let s = match b {
                Binary::Add => infix("+"),
                Binary::Sub => infix("-"),
                Binary::Mul => infix("*"),
                Binary::Div => infix("/"),
                Binary::Min => call("min"),
                Binary::Max => call("max"),
                Binary::Pow => call("pow"),
                Binary::Lt => infix("<"),
                Binary::Le => infix("<="),
                Binary::And => infix("&"),
                Binary::Or => infix("|"),
            };
            (s, d(x).max(d(y)) + 1)
        }
        Op::Select(m, a, b) => (
            format!("select({}, {}, {})", strip(t(b)), strip(t(a)), strip(t(m))),
            d(m).max(d(a)).max(d(b)) + 1,
        ),
    }
}

/// The shortest decimal that reads back as the same f32.
fn literal(x: f64) -> String {
    let x = x as f32;
    if x < 0.0 {
        format!("({x:?}f)")
    } else {
        format!("{x:?}f")
    }
}
