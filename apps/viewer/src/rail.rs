//! The description of the stage's curtain for the viewer's simulation: the catalog's own, on a coarser grid.

use woven_catalog::catalog::{Catalog, Motion};
use woven_cloth::CurtainSpec;

use crate::cloth::Cloth;

/// Columns and rows of the cloth's grid: coarse enough to be blown live, fine enough for round folds.
const GRID: [u32; 2] = [88, 48];

/// The curtain of the built-in catalog, hung from the stage's rail.
///
/// # Errors
/// A sentence when the built-in catalog is broken.
pub fn curtain(cloth: &Cloth) -> Result<CurtainSpec, String> {
    let catalog = Catalog::builtin().map_err(|e| format!("{e:#}"))?;
    let fabric = catalog
        .fabrics
        .first()
        .ok_or("The built-in catalog has no fabric.")?;
    let motion = Motion {
        mesh: GRID,
        ..catalog.motion
    };
    let openness = cloth.gap(woven_bsdf::vec3::Vec3::new(0.0, 0.0, 1.0));
    woven_catalog::cloth::spec(fabric, openness, &motion).map_err(|e| format!("{e:#}"))
}
