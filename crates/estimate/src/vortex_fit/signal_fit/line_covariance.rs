//! Covariance of the baseband samples of one line of sight, and its derivatives with respect to the wind, forwards and
//! backwards.
//!
//! R(k, l) = sum over layers of w f(t_k - 2 R/c) f(t_l - 2 R/c) G(v) exp(j omega(v) (t_k - t_l)) + noise, w the SNR
//! times the layer, G the power gain of the filter and omega its angular frequency. The sum runs in two steps:
//! phasors of all lags are shared among nodes, then weighted by the pulse. The backward pass applies the transpose of
//! both, which gives the derivative of a scalar with respect to the velocities of all layers at the price of one
//! covariance. Check: the plain double sum; backward against forward derivatives; difference quotients.

use multiversion::multiversion;
use num_complex::Complex;

use crate::vortex_fit::signal_fit::banded_cholesky::Banded;
use crate::vortex_fit::signal_fit::scan_model::Line;
use crate::vortex_fit::{PARAMETERS, ScanModel, Wake};

/// Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Work {
    /// Phasors of one layer: real parts of all lags, then imaginary parts; lags in the order of `PairWeights`.
    phasor: Vec<f64>,
    /// Sums on the nodes, laid out as `phasor` for each.
    nodes: Vec<f64>,
    /// Velocity of each layer and its derivatives.
    pub(crate) wind: Vec<(f64, [f64; PARAMETERS])>,
    /// Sums over nodes for the lags of one middle.
    sums: Vec<f64>,
}

impl ScanModel {
    /// Velocities of the layers of a line.
    pub(crate) fn wind_into(&self, line: &Line, wake: &Wake, work: &mut Work) {
        work.wind.clear();
        let range_m: Vec<f64> = line.layers.iter().map(|layer| layer.range_m).collect();
        work.wind
            .extend(self.wake.gradients(wake, &range_m, line.ray));
    }

    /// Phasors exp(j m omega T) of all lags m for one velocity.
    fn phasors(&self, velocity_m_s: f64, out: &mut [f64]) {
        let (re, im) = out.split_at_mut(self.weights.lags + 1);
        let turn = self.baseband.turn_rad_s(velocity_m_s) * self.baseband.interval_s();
        let one = Complex::cis(turn);
        let two = Complex::cis(2.0 * turn);
        let even = self.weights.even;
        let mut at = Complex::ONE;
        for index in 0..even {
            re[index] = at.re;
            im[index] = at.im;
            at *= two;
        }
        for index in even..re.len() {
            let a = re[index - even];
            let b = im[index - even];
            re[index] = a * one.re - b * one.im;
            im[index] = a * one.im + b * one.re;
        }
    }

    /// m T d omega / dv of each place.
    fn lag_phase_slopes(&self) -> Vec<f64> {
        let per_lag = self.baseband.turn_per_velocity_rad_m() * self.baseband.interval_s();
        self.weights
            .lag_of_place()
            .map(|lag| lag as f64 * per_lag)
            .collect()
    }

    /// Covariance of the signal of a line for unit noise power, without the noise.
    pub(crate) fn signal_into(&self, line: &Line, work: &mut Work, out: &mut Banded) {
        self.clear_nodes(work);
        for (layer, (velocity, _)) in line.layers.iter().zip(&work.wind) {
            self.phasors(*velocity, &mut work.phasor);
            let (gain, _) = self.gain.at(*velocity);
            add_to_nodes(&mut work.nodes, &work.phasor, layer.node, layer.share, gain);
        }
        self.weigh_into(work, out);
    }

    /// Derivative of that covariance with respect to the parameters of `group`, which change together, times `factor`.
    pub(crate) fn change_into(
        &self,
        line: &Line,
        work: &mut Work,
        group: &[usize],
        factor: f64,
        out: &mut Banded,
    ) {
        self.clear_nodes(work);
        let phase_slopes = self.lag_phase_slopes();
        for (layer, (velocity, slopes)) in line.layers.iter().zip(&work.wind) {
            self.phasors(*velocity, &mut work.phasor);
            let (gain, gain_slope) = self.gain.at(*velocity);
            let (re, im) = work.phasor.split_at_mut(phase_slopes.len());
            for ((re, im), turn) in re.iter_mut().zip(im).zip(&phase_slopes) {
                let a = *re;
                let b = *im;
                *re = gain_slope * a - gain * turn * b;
                *im = gain_slope * b + gain * turn * a;
            }
            let slope: f64 = group.iter().map(|&parameter| slopes[parameter]).sum();
            add_to_nodes(
                &mut work.nodes,
                &work.phasor,
                layer.node,
                layer.share,
                factor * slope,
            );
        }
        self.weigh_into(work, out);
    }

    fn clear_nodes(&self, work: &mut Work) {
        let numbers = 2 * (self.weights.lags + 1);
        work.phasor.resize(numbers, 0.0);
        work.nodes.clear();
        work.nodes.resize(self.nodes * numbers, 0.0);
    }

    /// First node that contributes and indices of the lags, for the middle 2 l + m = `twice` of samples l + m and l.
    fn middle(&self, twice: usize) -> (usize, std::ops::Range<usize>) {
        let longest = twice.min(2 * (self.samples - 1) - twice);
        // the node of the middle is `twice + half + 2`; rows of weights run from -half to half
        (twice + 2, self.weights.places(twice % 2, longest))
    }

    /// The pulse's weights applied to the sums on the nodes.
    fn weigh_into(&self, work: &mut Work, out: &mut Banded) {
        out.reset(self.samples, self.weights.lags);
        let lags = self.weights.lags + 1;
        for twice in 0..2 * self.samples - 1 {
            let (first, indices) = self.middle(twice);
            let count = indices.len();
            work.sums.clear();
            work.sums.resize(2 * count, 0.0);
            let (sum_re, sum_im) = work.sums.split_at_mut(count);
            let row = (lags, indices.start);
            sum_nodes(
                &self.weights.rows,
                &work.nodes[first * 2 * lags..],
                row,
                sum_re,
                sum_im,
            );
            for i in 0..count {
                let lag = 2 * i + twice % 2;
                let index = out.at((twice - lag) / 2, lag);
                out.re[index] = sum_re[i];
                out.im[index] = sum_im[i];
            }
        }
    }

    /// Adds to `gradient` the derivatives of the scalar whose change is Re sum of conj(weight(k, l)) dR(k, l) over k >= l.
    pub(crate) fn pull_back(
        &self,
        line: &Line,
        weight: &Banded,
        work: &mut Work,
        gradient: &mut [f64; PARAMETERS],
    ) {
        self.clear_nodes(work);
        let lags = self.weights.lags + 1;
        for twice in 0..2 * self.samples - 1 {
            let (first, indices) = self.middle(twice);
            let count = indices.len();
            work.sums.clear();
            work.sums.resize(2 * count, 0.0);
            let (sum_re, sum_im) = work.sums.split_at_mut(count);
            for i in 0..count {
                let lag = 2 * i + twice % 2;
                let index = weight.at((twice - lag) / 2, lag);
                sum_re[i] = weight.re[index];
                sum_im[i] = weight.im[index];
            }
            let row = (lags, indices.start);
            spread_to_nodes(
                &self.weights.rows,
                &mut work.nodes[first * 2 * lags..],
                row,
                sum_re,
                sum_im,
            );
        }
        let phase_slopes = self.lag_phase_slopes();
        let mut gathered = vec![0.0; 2 * lags];
        for (layer, (velocity, slopes)) in line.layers.iter().zip(&work.wind) {
            self.phasors(*velocity, &mut work.phasor);
            let (gain, gain_slope) = self.gain.at(*velocity);
            gathered.fill(0.0);
            for (i, share) in layer.share.iter().enumerate() {
                let node = &work.nodes[(layer.node + i) * 2 * lags..][..2 * lags];
                for (sum, node) in gathered.iter_mut().zip(node) {
                    *sum += share * node;
                }
            }
            let (re, im) = work.phasor.split_at(lags);
            let (g_re, g_im) = gathered.split_at(lags);
            let mut by_velocity = 0.0;
            for m in 0..lags {
                by_velocity += gain * phase_slopes[m] * (re[m] * g_im[m] - im[m] * g_re[m])
                    + gain_slope * (re[m] * g_re[m] + im[m] * g_im[m]);
            }
            for (sum, slope) in gradient.iter_mut().zip(slopes) {
                *sum += by_velocity * slope;
            }
        }
    }
}

/// Sums over nodes with the weights of one middle. The weight of a node at distance d from the middle is that of the middle at
/// -d from the node: rows of `lags` weights run against the nodes. Lags are taken from index `start` of each row on.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sum_nodes(
    weights: &[f64],
    nodes: &[f64],
    (lags, start): (usize, usize),
    sum_re: &mut [f64],
    sum_im: &mut [f64],
) {
    let count = sum_re.len().min(sum_im.len());
    let sum_re = &mut sum_re[..count];
    let sum_im = &mut sum_im[..count];
    let rows = weights.chunks_exact(lags).rev();
    for (row, node) in rows.zip(nodes.chunks_exact(2 * lags)) {
        let (re, im) = node.split_at(lags);
        let weights = &row[start..][..count];
        let re = &re[start..][..count];
        let im = &im[start..][..count];
        for i in 0..count {
            sum_re[i] += weights[i] * re[i];
            sum_im[i] += weights[i] * im[i];
        }
    }
}

/// The transpose of [`sum_nodes`]: adds the sums to the nodes.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn spread_to_nodes(
    weights: &[f64],
    nodes: &mut [f64],
    (lags, start): (usize, usize),
    sum_re: &[f64],
    sum_im: &[f64],
) {
    let count = sum_re.len().min(sum_im.len());
    let sum_re = &sum_re[..count];
    let sum_im = &sum_im[..count];
    let rows = weights.chunks_exact(lags).rev();
    for (row, node) in rows.zip(nodes.chunks_exact_mut(2 * lags)) {
        let (re, im) = node.split_at_mut(lags);
        let weights = &row[start..][..count];
        let re = &mut re[start..][..count];
        let im = &mut im[start..][..count];
        for i in 0..count {
            re[i] += weights[i] * sum_re[i];
            im[i] += weights[i] * sum_im[i];
        }
    }
}

/// nodes += factor share phasor, for the four nodes of a layer.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add_to_nodes(nodes: &mut [f64], phasor: &[f64], first: usize, share: [f64; 4], factor: f64) {
    let numbers = phasor.len();
    for (i, share) in share.iter().enumerate() {
        let weight = factor * share;
        let node = &mut nodes[(first + i) * numbers..(first + i + 1) * numbers];
        for (node, phasor) in node.iter_mut().zip(phasor) {
            *node += weight * phasor;
        }
    }
}
