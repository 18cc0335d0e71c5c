//! Bytes into values and back, with no input or output: SIGMA KOKI SHOT/GSC, GRBL 1.1, and the photodiode head.

pub mod grbl;
pub mod head;
pub mod shot;
