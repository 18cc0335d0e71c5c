//! Bytes into values and back, with no input or output: SIGMA KOKI SHOT/GSC, GRBL 1.1, the photodiode head, and detector commands.

pub mod camera;
pub mod grbl;
pub mod head;
pub mod shot;
