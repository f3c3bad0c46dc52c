//! Standard deviations of winds and dissipations in turbulence that neighbouring velocities share.
//!
//! ```text
//! cov(u) = G [sum_L p(L) t1 B(L)] G^T
//! cov(t) = H^-1 J H^-1,  H_ij = 1/2 sum_b tr(M_i^b K_b M_j^b K_b),  J_ij = 1/2 sum_ab tr(M_i^a K_ab M_j^b K_ab^T)
//! M_1 = P B P,  M_2 = P P,  P = K^-1 - K^-1 X (X^T K^-1 X)^-1 X^T K^-1
//! ```
//!
//! The sandwich takes blocks that a likelihood counts as independent for what they are (Godambe 1960). Check: `edr_stated.csv`; a
//! single block has J = H.

use ndarray::{Array2, ArrayView2, Axis};
use std::collections::BTreeMap;

use super::gate_covariance::{GateCovariance, GatePosition};
use super::restricted_likelihood::{Block, RANK, TurbulenceFit, groups_of_geometry, inverse};
use crate::error::{Error, length};
use crate::linalg::cholesky::{cholesky, forward};
use crate::linalg::positive_definite::singular;
use crate::parallel::map_each;

/// Outer scales beyond which blocks count as independent.
const REACH: f64 = 6.0;
/// Least variance of the noise in parts of that of the turbulence: without any a covariance is singular.
const LEAST_NOISE: f64 = 1e-4;
/// How often, and by which factor, the noise is raised.
const RAISES: usize = 8;
const RAISE: f64 = 3.0;
/// Steps in which displacements of blocks are compared \[m\].
const SAME_DISPLACEMENT_M: f64 = 1e-3;

/// Covariance of a wind u = G v by turbulence alone \[m²/s²\], from its gain G \[component, velocity\], the gates and, for each outer scale of
/// the covariance, its probability times eps^(2/3).
///
/// # Errors
/// [`Error::Length`] for shapes that do not fit.
pub fn wind_covariance(
    gain: ArrayView2<'_, f64>,
    gates: &[GatePosition],
    covariance: &GateCovariance,
    eps23_weights: &[f64],
) -> Result<Array2<f64>, Error> {
    length("gates", gain.ncols(), gates.len())?;
    length("eps23_weights", covariance.len(), eps23_weights.len())?;
    let mut total = Array2::zeros((gates.len(), gates.len()));
    for (matrix, weight) in covariance.matrices(gates).iter().zip(eps23_weights) {
        total.scaled_add(*weight, matrix);
    }
    for i in 0..gates.len() {
        for j in 0..i {
            total[[j, i]] = total[[i, j]];
        }
    }
    Ok(gain.dot(&total).dot(&gain.t()))
}

/// Covariance of eps^(2/3) and of the variance of the noise with the eddies that blocks share, at the only outer scale \[m\] of a covariance.
///
/// # Errors
/// [`Error::Linalg`] if the covariance of a block is singular; [`Error::Length`] for a covariance of several outer scales.
pub fn turbulence_covariance(
    blocks: &[Block],
    covariance: &GateCovariance,
    outer_scale_m: f64,
    fit: &TurbulenceFit,
) -> Result<[[f64; 2]; 2], Error> {
    length("outer_scale_m", 1, covariance.len())?;
    let groups = groups_of_geometry(blocks);
    let mut group_of = vec![None; blocks.len()];
    for (number, group) in groups.iter().enumerate() {
        for block in group {
            group_of[*block] = Some(number);
        }
    }
    let made = map_each(groups.len(), |group| {
        Sensitivity::new(&blocks[groups[group][0]], covariance, fit)
    });
    let mut sensitivities = Vec::with_capacity(made.len());
    for one in made {
        sensitivities.push(one?);
    }
    let mut information = [[0.0; 2]; 2];
    for (sensitivity, group) in sensitivities.iter().zip(&groups) {
        for (sum, own) in information
            .iter_mut()
            .flatten()
            .zip(sensitivity.information)
        {
            *sum += group.len() as f64 * own;
        }
    }
    let mut scatter = information;
    let pairs = pairs(blocks, &group_of, REACH * outer_scale_m);
    let traces = map_each(pairs.len(), |number| {
        let pair = &pairs[number];
        let [a, b] = pair.blocks.map(|block| &blocks[block]);
        let [own, other] = pair.groups.map(|group| &sensitivities[group]);
        own.traces(other, &shared_covariance(a, b, covariance, fit.eps23))
    });
    for (pair, traces) in pairs.iter().zip(traces) {
        for (sum, trace) in scatter.iter_mut().flatten().zip(traces) {
            *sum += pair.count as f64 * trace;
        }
    }
    let singular = singular("the information of turbulence and noise", 2);
    let inverse = inverse(information).ok_or(singular)?;
    Ok(product(product(inverse, scatter), inverse))
}

/// Two blocks, and how many pairs have the same geometries and displacement.
struct Pair {
    groups: [usize; 2],
    blocks: [usize; 2],
    count: usize,
}

/// Pairs of blocks that are at most `reach_m` apart.
fn pairs(blocks: &[Block], group_of: &[Option<usize>], reach_m: f64) -> Vec<Pair> {
    let mut found: BTreeMap<([usize; 2], [i64; 3]), Pair> = BTreeMap::new();
    for a in 0..blocks.len() {
        for b in a + 1..blocks.len() {
            let (Some(group_a), Some(group_b)) = (group_of[a], group_of[b]) else {
                continue;
            };
            let displacement_m = displacement_m(&blocks[a], &blocks[b]);
            let distance2: f64 = displacement_m.iter().map(|d| d * d).sum();
            if distance2.sqrt() > reach_m {
                continue;
            }
            let groups = [group_a, group_b];
            let steps = displacement_m.map(|d| (d / SAME_DISPLACEMENT_M).round() as i64);
            let pair = found.entry((groups, steps)).or_insert(Pair {
                groups,
                blocks: [a, b],
                count: 0,
            });
            pair.count += 1;
        }
    }
    found.into_values().collect()
}

/// Product of two matrices.
fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let mut out = [[0.0; 2]; 2];
    for i in 0..2 {
        for j in 0..2 {
            out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j];
        }
    }
    out
}

/// From the first gate of one block to that of another.
fn displacement_m(a: &Block, b: &Block) -> [f64; 3] {
    let mut displacement_m = b.gates[0].position_m;
    for (d, own_m) in displacement_m.iter_mut().enumerate() {
        *own_m -= a.gates[0].position_m[d];
    }
    displacement_m
}

/// Covariance of the velocities of two blocks, over the standard deviations of their noise.
fn shared_covariance(a: &Block, b: &Block, covariance: &GateCovariance, eps23: f64) -> Array2<f64> {
    let mut shared = covariance.between(&a.gates, &b.gates).swap_remove(0);
    for ((i, j), value) in shared.indexed_iter_mut() {
        *value *= eps23 / (a.noise_std_m_s[i] * b.noise_std_m_s[j]);
    }
    shared
}

/// How the likelihood of a block depends on the covariance of its velocities.
struct Sensitivity {
    /// M of turbulence and of noise.
    matrices: [Array2<f64>; 2],
    /// Row by row, of one block.
    information: [f64; 4],
}

impl Sensitivity {
    fn new(block: &Block, covariance: &GateCovariance, fit: &TurbulenceFit) -> Result<Self, Error> {
        let order = block.len();
        let mut turbulence = block.covariances(covariance).swap_remove(0);
        for i in 0..order {
            for j in 0..i {
                turbulence[[j, i]] = turbulence[[i, j]];
            }
        }
        let what = "the covariance of the velocities";
        let total = fit.eps23 * &turbulence;
        let lower = factor(&total, fit.noise_m2_s2).ok_or_else(|| singular(what, order))?;
        // With L^-1 and an orthonormal basis N of L^-1 X: P = L^-T (1 - N N^T) L^-1
        let mut columns = Array2::zeros((order, 0));
        for column in block.mean_columns() {
            let column = ndarray::Array1::from(column);
            columns
                .push_column(column.view())
                .map_err(|_| singular(what, order))?;
        }
        forward(lower.view(), &mut columns);
        let mut rest = Array2::eye(order);
        forward(lower.view(), &mut rest);
        let basis = orthonormal_basis(&columns);
        let projected = &rest - &basis.dot(&basis.t().dot(&rest));
        let p = rest.t().dot(&projected);
        let of_noise = p.dot(&p);
        let turbulence_p = turbulence.dot(&p);
        let of_turbulence = p.dot(&turbulence_p);
        // With P K P = P: tr(M_i K M_j K) = tr(D_i P D_j P), D = B, 1
        let mixed = 0.5 * trace(&turbulence_p, &p);
        let information = [
            0.5 * trace(&turbulence_p, &turbulence_p),
            mixed,
            mixed,
            0.5 * trace(&p, &p),
        ];
        Ok(Self {
            matrices: [of_turbulence, of_noise],
            information,
        })
    }

    /// Terms of J of this block and another one, in both orders, row by row.
    fn traces(&self, other: &Self, shared: &Array2<f64>) -> [f64; 4] {
        let own = self.matrices.each_ref().map(|m| m.dot(shared));
        let others = other.matrices.each_ref().map(|m| m.dot(&shared.t()));
        let mixed = 0.5 * (trace(&own[0], &others[1]) + trace(&own[1], &others[0]));
        [
            trace(&own[0], &others[0]),
            mixed,
            mixed,
            trace(&own[1], &others[1]),
        ]
    }
}

/// Cholesky factor of a covariance with that variance of noise added. Beams that count as parallel make the covariance of gates near the lidar
/// indefinite by a tenth of it: where the noise is smaller, it is raised until there is a factor, which makes the stated deviations larger.
fn factor(turbulence: &Array2<f64>, noise_m2_s2: f64) -> Option<Array2<f64>> {
    let mut noise_m2_s2 = noise_m2_s2.max(LEAST_NOISE * turbulence[[0, 0]]);
    for _ in 0..RAISES {
        let mut total = turbulence.clone();
        total.diag_mut().mapv_inplace(|value| value + noise_m2_s2);
        if let Some(lower) = cholesky(total) {
            return Some(lower);
        }
        noise_m2_s2 *= RAISE;
    }
    None
}

/// Trace of a product.
fn trace(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let mut sum = 0.0;
    for (row, column) in a.rows().into_iter().zip(b.columns()) {
        sum += row.dot(&column);
    }
    sum
}

/// Orthonormal basis of columns, the longest first; those that depend on the others to within [`RANK`] are left out.
fn orthonormal_basis(columns: &Array2<f64>) -> Array2<f64> {
    let mut rest = columns.clone();
    let mut basis = Array2::zeros((columns.nrows(), 0));
    let mut longest = 0.0;
    while basis.ncols() < columns.ncols().min(columns.nrows()) {
        let squares = rest.map_axis(Axis(0), |column| column.dot(&column));
        let longest_left = (0..squares.len()).max_by(|i, j| squares[*i].total_cmp(&squares[*j]));
        let Some(first) = longest_left else {
            break;
        };
        let norm = squares[first].sqrt();
        if basis.ncols() == 0 {
            longest = norm;
        }
        if norm <= RANK * longest {
            break;
        }
        let unit = rest.column(first).mapv(|value| value / norm);
        for mut column in rest.columns_mut() {
            let along = unit.dot(&column);
            column.scaled_add(-along, &unit);
        }
        if basis.push_column(unit.view()).is_err() {
            break;
        }
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beams 4 degrees apart in air without noise: some count as parallel and others do not, so that the covariance is not positive definite.
    #[test]
    fn low_noise_in_turbulence_has_a_factor() {
        let mut gates = Vec::new();
        for beam in 0..90 {
            let azimuth_rad = f64::from(4 * beam).to_radians();
            let up = 5f64.to_radians().sin();
            let across = 5f64.to_radians().cos();
            let direction = [across * azimuth_rad.sin(), across * azimuth_rad.cos(), up];
            for gate in 0..4 {
                let range_m = 15.0 + 30.0 * f64::from(gate);
                let time_s = 0.5 * f64::from(beam);
                let carried_m_s = [4.0, -4.5, 0.0];
                gates.push(GatePosition::new(direction, range_m, time_s, carried_m_s));
            }
        }
        let covariance = GateCovariance::new(9.0, &[60.0], 500.0).unwrap();
        let mut matrix = covariance.matrices(&gates).remove(0);
        for i in 0..gates.len() {
            for j in 0..i {
                matrix[[j, i]] = matrix[[i, j]];
            }
        }
        let mut least = matrix.clone();
        let least_m2_s2 = LEAST_NOISE * matrix[[0, 0]];
        least.diag_mut().mapv_inplace(|value| value + least_m2_s2);
        assert!(cholesky(least).is_none());
        let lower = factor(&matrix, 0.0).unwrap();
        let square = lower.row(0).dot(&lower.row(0));
        let over = square / matrix[[0, 0]];
        assert!(over < 1.3, "{over}");
    }
}
