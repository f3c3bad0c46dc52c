//! The level scheme: a wave that is long against the samples is summed at few nodes and
//! interpolated.
//!
//! A wave lives on the nodes of spacing 2^m samples of the largest m that gives at least 8 nodes a
//! wave. From level to level the middle between two nodes follows from six nodes with the weights
//! (3, -25, 150, 150, -25, 3)/256. Nodes are at absolute indices of the line. Error of the
//! sum: some 2.4e-4 of its standard deviation.

use super::waves::{BLOCK, Wave, add_decaying_waves, add_waves, block_of, first_node};
use std::f64::consts::FRAC_PI_4;

/// Number of levels.
const LEVELS: usize = 10;
/// Nodes that the interpolation needs before and behind.
const BEFORE: i64 = 2;
const BEHIND: i64 = 3;

/// Waves along a line by their level.
#[derive(Debug, Default)]
pub(super) struct LineWaves {
    steady: [Vec<Wave>; LEVELS],
    decaying: [Vec<Wave>; LEVELS],
}

impl LineWaves {
    /// Adds a wave that does not grow; on level 0 unless `is_coarse`.
    pub(super) fn push(&mut self, wave: Wave, is_coarse: bool) {
        let level = if is_coarse { level(wave.step_rad) } else { 0 };
        self.steady[level].push(wave);
    }

    /// Adds a wave that grows or decays along the line.
    pub(super) fn push_decaying(&mut self, wave: Wave, is_coarse: bool) {
        let fastest = wave.step_rad.abs().max(wave.growth_step.abs());
        let level = if is_coarse { level(fastest) } else { 0 };
        self.decaying[level].push(wave);
    }

    /// Writes the sum of the waves at samples `first`, `first + 1`, ... into `out_m_s`.
    pub(super) fn sum_into(&self, first: i64, out_m_s: &mut [f64]) {
        if out_m_s.is_empty() {
            return;
        }
        let is_used =
            |level: &usize| !self.steady[*level].is_empty() || !self.decaying[*level].is_empty();
        let top = (0..LEVELS).rfind(is_used).unwrap_or(0);
        let mut spans = vec![(first, first + out_m_s.len() as i64 - 1)];
        for level in 0..top {
            let (low, high) = spans[level];
            spans.push((low.div_euclid(2) - BEFORE, high.div_euclid(2) + BEHIND));
        }
        let mut coarse = Nodes::new(spans[top]);
        self.add_level(top, &mut coarse);
        for level in (0..top).rev() {
            let mut fine = Nodes::new(spans[level]);
            fine.interpolate(spans[level], &coarse);
            self.add_level(level, &mut fine);
            coarse = fine;
        }
        let start = (first - coarse.first) as usize;
        out_m_s.copy_from_slice(&coarse.sums[start..start + out_m_s.len()]);
    }

    /// Adds the waves of a level to its nodes.
    fn add_level(&self, level: usize, nodes: &mut Nodes) {
        let spacing = (1_u64 << level) as f64;
        let block = block_of(nodes.first);
        add_waves(&self.steady[level], spacing, block, &mut nodes.sums);
        add_decaying_waves(&self.decaying[level], spacing, block, &mut nodes.sums);
    }
}

/// Largest level on which a wave with this phase step between samples has 8 nodes.
fn level(step_rad: f64) -> usize {
    let nodes = FRAC_PI_4 / step_rad.abs();
    // The exponent of the number; endless and tiny ones have the extremes.
    let exponent = ((nodes.to_bits() >> 52) & 0x7ff) as i64 - 1023;
    exponent.clamp(0, LEVELS as i64 - 1) as usize
}

/// Sums at whole blocks of nodes.
struct Nodes {
    /// Index of the first node, that of a block.
    first: i64,
    sums: Vec<f64>,
}

impl Nodes {
    /// The blocks that hold the nodes from the first to the last.
    fn new((low, high): (i64, i64)) -> Self {
        let first_block = block_of(low);
        let blocks = (block_of(high) - first_block + 1) as usize;
        Self {
            first: first_node(first_block),
            sums: vec![0.0; blocks * BLOCK],
        }
    }

    /// Sets the nodes from the first to the last from those of the level above.
    fn interpolate(&mut self, (low, high): (i64, i64), coarse: &Self) {
        let values = &coarse.sums[(low.div_euclid(2) - BEFORE - coarse.first) as usize..];
        let start = low.div_euclid(2);
        for node in low..=high {
            // Index of the coarse node at or before this one, BEFORE nodes into the stencil.
            let at = (node.div_euclid(2) - start) as usize;
            let stencil = &values[at..at + 6];
            let value = if node & 1 == 0 {
                stencil[2]
            } else {
                let outer = 3.0 * (stencil[0] + stencil[5]);
                let middle = 25.0 * (stencil[1] + stencil[4]);
                let inner = 150.0 * (stencil[2] + stencil[3]);
                (outer - middle + inner) / 256.0
            };
            self.sums[(node - self.first) as usize] = value;
        }
    }
}
