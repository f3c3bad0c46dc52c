//! Waves along a line: sums of `Re{c exp((g + i d) j + ...)}` at equally spaced nodes j, by
//! geometric series in blocks.
//!
//! Node j belongs to the block of its own index, never to one of the call, and a node sums the waves
//! in their order. The bits of a sum therefore do not depend on the nodes that are computed with it.
//! There are multiplications and additions only, no fused ones, whose bits depend on the machine.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of several arrays, which the compiler makes vectors of"
)]

use super::sin_cos::sin_cos;

/// Nodes of a block.
pub(super) const BLOCK: usize = 16;
/// Blocks whose anchors follow from one sine and cosine.
const CHAIN: i64 = 64;
/// Index of the first node of block 0, negated: nodes just before the line need no other chain.
const SHIFT: i64 = BLOCK as i64;
/// Waves that are summed together.
const GROUP: usize = 4;

/// Exponents above this belong to nodes far below the ground, where nothing is known.
const HIGHEST_EXPONENT: f64 = 30.0;
/// A wave of exponent below this is less than rounding.
const LOWEST_EXPONENT: f64 = -45.0;

/// A wave along a line: `Re{c exp(growth + growth_step j) exp(i (phase + step j))}` at node j.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wave {
    /// `c`, real and imaginary part \[m/s\].
    pub(super) amplitude_m_s: [f64; 2],
    /// Phase at node 0 \[rad\].
    pub(super) phase_rad: f64,
    /// Change of phase from node to node \[rad\].
    pub(super) step_rad: f64,
    /// Exponent of the size at node 0.
    pub(super) growth: f64,
    /// Change of the exponent from node to node.
    pub(super) growth_step: f64,
}

/// Block that holds a node.
pub(super) fn block_of(node: i64) -> i64 {
    (node + SHIFT).div_euclid(BLOCK as i64)
}

/// First node of a block.
pub(super) fn first_node(block: i64) -> i64 {
    block * BLOCK as i64 - SHIFT
}

/// Powers of the step of each wave of a group: one block of offsets.
struct Offsets {
    real: [[f64; BLOCK]; GROUP],
    imaginary: [[f64; BLOCK]; GROUP],
}

impl Offsets {
    /// Powers 0 to BLOCK - 1 of `size exp(i step)`, by doubling.
    #[inline(always)]
    fn new(step_rad: &[f64; GROUP], size: &[f64; GROUP]) -> Self {
        let (sine, cosine) = sin_cos(step_rad);
        let mut real = [[0.0; BLOCK]; GROUP];
        let mut imaginary = [[0.0; BLOCK]; GROUP];
        for g in 0..GROUP {
            let mut power = [size[g] * cosine[g], size[g] * sine[g]];
            let re = &mut real[g];
            let im = &mut imaginary[g];
            re[0] = 1.0;
            let mut done = 1;
            while done < BLOCK {
                for o in 0..done {
                    re[done + o] = re[o] * power[0] - im[o] * power[1];
                    im[done + o] = re[o] * power[1] + im[o] * power[0];
                }
                power = [
                    power[0] * power[0] - power[1] * power[1],
                    2.0 * power[0] * power[1],
                ];
                done *= 2;
            }
        }
        Self { real, imaginary }
    }

    /// The power BLOCK of each step.
    #[inline(always)]
    fn block_step(&self) -> [[f64; GROUP]; 2] {
        let mut out = [[0.0; GROUP]; 2];
        for g in 0..GROUP {
            let last = [self.real[g][BLOCK - 1], self.imaginary[g][BLOCK - 1]];
            let first = [self.real[g][1], self.imaginary[g][1]];
            out[0][g] = last[0] * first[0] - last[1] * first[1];
            out[1][g] = last[0] * first[1] + last[1] * first[0];
        }
        out
    }

    /// Adds the waves of a group with these anchors to one block of sums.
    #[inline(always)]
    fn add(&self, anchor: &[[f64; GROUP]; 2], sums: &mut [f64; BLOCK]) {
        for o in 0..BLOCK {
            let mut sum = sums[o];
            for g in 0..GROUP {
                sum += anchor[0][g] * self.real[g][o] - anchor[1][g] * self.imaginary[g][o];
            }
            sums[o] = sum;
        }
    }
}

/// The waves in groups; the last one is completed by waves without amplitude.
fn groups(waves: &[Wave]) -> impl Iterator<Item = [Wave; GROUP]> + '_ {
    waves.chunks(GROUP).map(|chunk| {
        let mut group = [Wave::default(); GROUP];
        group[..chunk.len()].copy_from_slice(chunk);
        group
    })
}

/// Anchors of a group at the first node of a chain of blocks.
#[inline(always)]
fn chain_anchor(group: &[Wave; GROUP], spacing: f64, chain: i64) -> [[f64; GROUP]; 2] {
    let node = first_node(chain * CHAIN) as f64;
    let mut angle_rad = [0.0; GROUP];
    for g in 0..GROUP {
        angle_rad[g] = group[g].phase_rad + group[g].step_rad * spacing * node;
    }
    let (sine, cosine) = sin_cos(&angle_rad);
    let mut anchor = [[0.0; GROUP]; 2];
    for g in 0..GROUP {
        let [re, im] = group[g].amplitude_m_s;
        anchor[0][g] = re * cosine[g] - im * sine[g];
        anchor[1][g] = re * sine[g] + im * cosine[g];
    }
    anchor
}

/// Moves anchors by one block.
#[inline(always)]
fn advance(anchor: &mut [[f64; GROUP]; 2], step: &[[f64; GROUP]; 2]) {
    for g in 0..GROUP {
        let re = anchor[0][g] * step[0][g] - anchor[1][g] * step[1][g];
        anchor[1][g] = anchor[0][g] * step[1][g] + anchor[1][g] * step[0][g];
        anchor[0][g] = re;
    }
}

/// Adds waves that do not grow to `sums`, whole blocks of nodes from block `first_block` on; node j
/// is at the sample `spacing j` of the line.
#[cfg_attr(
    feature = "solver",
    multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))
)]
pub(super) fn add_waves(waves: &[Wave], spacing: f64, first_block: i64, sums: &mut [f64]) {
    let (blocks, _) = sums.as_chunks_mut::<BLOCK>();
    let end_block = first_block + blocks.len() as i64;
    for group in groups(waves) {
        let offsets = Offsets::new(&group.map(|wave| wave.step_rad * spacing), &[1.0; GROUP]);
        let step = offsets.block_step();
        let mut chain = first_block.div_euclid(CHAIN);
        while chain * CHAIN < end_block {
            let mut anchor = chain_anchor(&group, spacing, chain);
            for block in chain * CHAIN..((chain + 1) * CHAIN).min(end_block) {
                if block >= first_block {
                    offsets.add(&anchor, &mut blocks[(block - first_block) as usize]);
                }
                advance(&mut anchor, &step);
            }
            chain += 1;
        }
    }
}

/// As [`add_waves`] for waves that grow or decay. Each block has its own exponent, since nothing
/// comes back from a size that has become 0.
#[cfg_attr(
    feature = "solver",
    multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))
)]
pub(super) fn add_decaying_waves(waves: &[Wave], spacing: f64, first_block: i64, sums: &mut [f64]) {
    let (blocks, _) = sums.as_chunks_mut::<BLOCK>();
    let end_block = first_block + blocks.len() as i64;
    for group in groups(waves) {
        // Sizes relative to that at the end of the block where they are largest.
        let decay = group.map(|wave| (-(wave.growth_step * spacing).abs()).exp());
        let unit = Offsets::new(&group.map(|wave| wave.step_rad * spacing), &[1.0; GROUP]);
        let offsets = scaled(&unit, &group, &decay);
        let step = unit.block_step();
        let mut chain = first_block.div_euclid(CHAIN);
        while chain * CHAIN < end_block {
            let mut anchor = chain_anchor(&group, spacing, chain);
            for block in chain * CHAIN..((chain + 1) * CHAIN).min(end_block) {
                if block >= first_block {
                    let sums = &mut blocks[(block - first_block) as usize];
                    add_decaying_block(&group, spacing, block, &anchor, &offsets, sums);
                }
                advance(&mut anchor, &step);
            }
            chain += 1;
        }
    }
}

/// Offsets times the size at each node of a block relative to the largest one.
#[inline(always)]
fn scaled(unit: &Offsets, group: &[Wave; GROUP], decay: &[f64; GROUP]) -> Offsets {
    let mut real = unit.real;
    let mut imaginary = unit.imaginary;
    for g in 0..GROUP {
        let mut size = 1.0;
        for o in 0..BLOCK {
            let at = if group[g].growth_step > 0.0 {
                BLOCK - 1 - o
            } else {
                o
            };
            real[g][at] *= size;
            imaginary[g][at] *= size;
            size *= decay[g];
        }
    }
    Offsets { real, imaginary }
}

/// Adds one block of waves that grow or decay.
#[inline(always)]
fn add_decaying_block(
    group: &[Wave; GROUP],
    spacing: f64,
    block: i64,
    anchor: &[[f64; GROUP]; 2],
    offsets: &Offsets,
    sums: &mut [f64; BLOCK],
) {
    let first = first_node(block) as f64;
    let last = first + (BLOCK - 1) as f64;
    let mut largest = [0.0; GROUP];
    for g in 0..GROUP {
        let step = group[g].growth_step * spacing;
        let node = if step > 0.0 { last } else { first };
        largest[g] = group[g].growth + step * node;
    }
    if largest.iter().all(|exponent| *exponent < LOWEST_EXPONENT) {
        return;
    }
    let mut sized = [[0.0; GROUP]; 2];
    for g in 0..GROUP {
        if largest[g] > HIGHEST_EXPONENT {
            add_directly(&group[g], spacing, first, sums);
        } else {
            let size = largest[g].exp();
            sized[0][g] = anchor[0][g] * size;
            sized[1][g] = anchor[1][g] * size;
        }
    }
    offsets.add(&sized, sums);
}

/// Adds a wave that changes so fast that its size at one end of the block has no number.
fn add_directly(wave: &Wave, spacing: f64, first: f64, sums: &mut [f64; BLOCK]) {
    for (o, sum) in sums.iter_mut().enumerate() {
        let sample = spacing * (first + o as f64);
        let exponent = (wave.growth + wave.growth_step * sample).min(HIGHEST_EXPONENT);
        let ([sine], [cosine]) = sin_cos(&[wave.phase_rad + wave.step_rad * sample]);
        let [re, im] = wave.amplitude_m_s;
        *sum += exponent.exp() * (re * cosine - im * sine);
    }
}
