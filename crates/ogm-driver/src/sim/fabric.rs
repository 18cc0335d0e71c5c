//! A fabric file in the simulated beam: the one file where the simulator meets the optics.

use woven_bsdf::fabric::{Fabric, Optics};
use woven_bsdf::model::{self, Model};
use woven_bsdf::sheet::Sheet;
use woven_bsdf::vec3::Vec3;

use super::optics::Sample;
use crate::error::{Error, Result};

/// A fabric seen by a detector with the eye's sensitivity: colours count by their luminance (Rec. 709).
pub struct FabricSample {
    name: String,
    optics: Optics,
    weights: model::Linear<f64>,
}

impl FabricSample {
    /// Puts a fabric into the beam.
    ///
    /// # Errors
    /// [`Error::Rig`] when the fabric's optics are not sound.
    pub fn new(fabric: &Fabric) -> Result<Self> {
        let optics = fabric.optics().map_err(|e| {
            Error::Rig(format!(
                "The fabric {:?} cannot be measured: {e}.",
                fabric.name
            ))
        })?;
        let weights = optics
            .linear
            .map(|c| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
        Ok(FabricSample {
            name: fabric.name.clone(),
            optics,
            weights,
        })
    }

    /// Reads a fabric file.
    ///
    /// # Errors
    /// [`Error::Rig`] with the reader's sentence.
    pub fn read(path: &std::path::Path) -> Result<Self> {
        let fabric = Fabric::read(path)
            .map_err(|e| Error::Rig(format!("The fabric file cannot be used: {e}.")))?;
        Self::new(&fabric)
    }
}

fn vec(d: [f64; 3]) -> Vec3<f64> {
    Vec3::new(d[0], d[1], d[2])
}

impl Sample for FabricSample {
    fn bsdf(&self, l: [f64; 3], v: [f64; 3]) -> f64 {
        let basis = (self.optics.model.f64.basis)(&self.optics.shape, vec(l), vec(v));
        model::dot(&self.weights, &basis)
    }

    fn direct(&self, l: [f64; 3]) -> f64 {
        // Only the sheet has gaps; the single lobes are yarn alone.
        if self.optics.model.name == Sheet::NAME {
            Sheet::gap(&self.optics.shape, vec(l))
        } else {
            0.0
        }
    }

    fn name(&self) -> String {
        self.name.clone()
    }
}
