//! The path tracer on a GPU, by wgpu. Being written.

use crate::accumulate::Accumulation;
use crate::cpu::path::View;
use crate::table::Table;
use anyhow::{Result, bail};
use std::sync::atomic::AtomicBool;

pub(crate) struct Gpu {}
impl Gpu {
    pub(crate) fn new(_t: &Table, _v: &View, _software: bool) -> Result<Self> {
        bail!("no GPU backend yet")
    }
    pub(crate) fn name(&self) -> &str {
        ""
    }
    pub(crate) fn samples(&self) -> u32 {
        0
    }
    pub(crate) fn step(&mut self, _v: &View, _count: u32, _stop: &AtomicBool) -> Result<bool> {
        bail!("no GPU backend yet")
    }
    pub(crate) fn restore(&mut self, _s: &Accumulation) -> Result<()> {
        Ok(())
    }
    pub(crate) fn read(&mut self, _s: &mut Accumulation) -> Result<()> {
        Ok(())
    }
    pub(crate) fn moved(&mut self, _t: &Table) -> Result<()> {
        Ok(())
    }
}
