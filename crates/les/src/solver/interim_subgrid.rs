use super::layout::Layout;
use crate::Error;
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum SubgridModel {
    None,
}
#[derive(Debug)]
pub(crate) struct Subgrid;
impl Subgrid {
    pub(crate) fn new(_l: &Layout, _m: SubgridModel) -> Result<Option<Self>, Error> {
        Ok(None)
    }
    pub(crate) fn update(&mut self, _l: &Layout, _u: [&[f64]; 3]) {}
    pub(crate) fn add_divergence_row(&self, _l: &Layout, _a: usize, _j: usize, _k: usize, _o: &mut [f64]) {}
    pub(crate) fn max_viscosity_m2_s(&self) -> f64 {
        0.0
    }
}
