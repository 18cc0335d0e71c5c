//! Fits models of woven cloth to goniometer measurements: Levenberg–Marquardt, ranking, error bars one can believe.

pub mod convert;
pub mod figures;
pub mod fit;
pub mod info;
pub mod linalg;
pub mod measurement;
pub mod plot;
pub mod problem;
pub mod rank;
pub mod report;
pub mod robust;
pub mod solve;
pub mod starts;
pub mod text;
pub mod uncertainty;
