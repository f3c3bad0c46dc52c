//! The statistic of a scan: how much better the best wake of a bank explains it than the wind alone.
//!
//! ```text
//! T = min over wind of chi^2 - min over wind and wake of chi^2 = max over the bank of max(0, s . x)^2
//! ```
//!
//! x the velocities, made white; s what a wake of the bank shows, made white, the wind taken out, of unit length. Products with
//! single vortices are taken once and combined to those of pairs. Check: against a direct least-squares fit; drawn scans.

use ndarray::{Array1, Array2, ArrayView1, s};

use crate::error::{Error, enough_velocities, increasing, not_empty, positive};
use crate::linalg::cholesky::cholesky;
use crate::linalg::positive_definite::solve;
use crate::matched_filter::{Background, Cells, MatchedFilter, WINDS, wind_velocities};
use crate::retrieval::{Gate, ScanMap, ScanTurbulence};
use crate::vortex_fit::{RangeKernel, Vortex, Wake, WakeModel};
use crate::wake_detection::bank::{Bank, DetectorOptions, Template};

/// The fraction of cells that may be missing in a scan is one over this.
const MISSING: usize = 2;
/// Of the variance of a product with a place: keeps the covariance of all of them regular, and changes nothing else.
const REGULAR: f64 = 1e-9;

/// Most wakes of the bank whose contrasts say how much of their variance is turbulence.
const PARTS: usize = 32;

/// What is nearer to a vortex than this \[m\] is not taken for background.
const WAKE_M: f64 = 25.0;

/// The test of one scan's geometry, noise and background for a wake.
#[derive(Debug, Clone)]
pub struct WakeDetector {
    pub(super) filter: MatchedFilter,
    pub(super) bank: Bank,
    pub(super) spacing_m: (f64, f64),
    /// For each wake of the bank, the reciprocal of its length.
    reciprocal_length: Vec<f64>,
    /// Lower factor of the covariance of the products of an empty scan with all places.
    pub(super) factor: Array2<f64>,
}

/// The test of one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeStatistic {
    /// T: what a wake explains of the best wind's chi-square.
    pub value: f64,
    /// Sum of squares over the variances that is left of the scan after the best wind, over its degrees of freedom.
    pub wind_chi2_per_dof: f64,
    /// And after the best wind and wake of the bank.
    pub wake_chi2_per_dof: f64,
    /// The wake of the bank that explains most, without wind; a vortex that it lacks has no circulation.
    pub wake: Wake,
    /// Standard deviation of its circulation \[m^2/s\], were its place known.
    pub circulation_std_m2_s: f64,
    /// Correlation of what is left with the next gate and with the next line, made white and away from that wake: near 0 if the
    /// background is the one that the test assumes.
    pub neighbour_correlation: (f64, f64),
    /// What both scatter by about 0 in such a background: the reciprocal root of the number of neighbours.
    pub correlation_error: (f64, f64),
}

impl WakeStatistic {
    /// Takes what the best wake leaves for the noise, in place of the deviations that were stated; returns the factor between them. For independent
    /// noise of one deviation.
    pub fn take_own_noise(&mut self) -> f64 {
        let variance = self.wake_chi2_per_dof;
        if variance.is_nan() || variance <= 0.0 {
            return 1.0;
        }
        self.value /= variance;
        self.wind_chi2_per_dof /= variance;
        self.wake_chi2_per_dof = 1.0;
        self.circulation_std_m2_s *= variance.sqrt();
        variance.sqrt()
    }
}

impl WakeDetector {
    /// Velocities that a test needs.
    pub const NEEDED: usize = 40;

    /// A test for maps like `map`: its axes, its standard deviations, its missing velocities. `gate` is what a velocity is of the
    /// air about its range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for impossible numbers or a map without standard deviations, [`Error::TooFewVelocities`] with less
    /// than forty, [`Error::Empty`] if no wake of the bank fits into the scan, [`Error::Linalg`] if the background has
    /// no covariance.
    pub fn new(
        map: &ScanMap,
        model: &WakeModel,
        gate: &Gate,
        options: &DetectorOptions,
    ) -> Result<Self, Error> {
        let found = map.validate()?;
        if map.sigma_m_s.is_none() {
            return Err(Error::Empty { field: "sigma_m_s" });
        }
        enough_velocities(found, Self::NEEDED)?;
        positive("least spacing_m", options.spacing_m.0)?;
        if options.spacing_m.0 != options.spacing_m.1 {
            increasing("spacing_m", &[options.spacing_m.0, options.spacing_m.1])?;
        }
        gate.validate(&map.range_m)?;
        let cells = Cells::new(&map.view(), model);
        let background = Background::new(&cells, options.turbulence.as_ref(), gate.std_m())?;
        let kernel = kernel(gate)?;
        let bank = Bank::new(&cells, model, kernel.width_m(), options);
        not_empty("list of wakes that fit into the scan", bank.templates.len())?;
        let (filter, gram) = MatchedFilter::new(
            model,
            kernel,
            cells,
            background,
            &bank.places_m,
            bank.core_m,
        );
        let reciprocal_length = bank
            .templates
            .iter()
            .map(|template| length2(template, &gram).sqrt().recip())
            .collect();
        let floor = REGULAR * gram.diag().iter().fold(0.0_f64, |most, x| most.max(*x));
        let order = gram.nrows();
        let factor = cholesky(gram + Array2::from_diag(&Array1::from_elem(order, floor)));
        let reason = "is not positive definite";
        let factor = factor.ok_or(Error::Linalg {
            what: "covariance of the products with the bank",
            order,
            reason,
        })?;
        Ok(Self {
            filter,
            bank,
            spacing_m: options.spacing_m,
            reciprocal_length,
            factor,
        })
    }

    /// The statistic of a scan with the geometry and noise of this test. Some velocities may be missing that the test has: the wind
    /// takes their place, which lowers the statistic a little.
    ///
    /// # Errors
    /// [`Error::Length`] for another shape, [`Error::TooFewVelocities`] if more than half is missing.
    pub fn statistic(
        &self,
        velocity_m_s: ndarray::ArrayView2<'_, f64>,
    ) -> Result<WakeStatistic, Error> {
        let mut means = self.filter.cells.means(velocity_m_s)?;
        let missing = self.fill(&mut means)?;
        let white = self.filter.white(means);
        let products = self.filter.shapes.dot(&white);
        let (value, best) = self.best(products.view());
        let rest = white.dot(&white);
        let wind_dof = self.filter.cells.cells.len() - missing - self.filter.wind.ncols();
        let wake_dof = wind_dof - 4;
        let length = self.reciprocal_length[best];
        let template = &self.bank.templates[best];
        let mut left = white;
        for (place, sense) in template.iter().zip([-1.0, 1.0]) {
            let Some(place) = place else { continue };
            left.scaled_add(
                -sense * value.sqrt() * length,
                &self.filter.shapes.row(*place),
            );
        }
        let [along, across] = self.neighbour_correlation(&left, template);
        Ok(WakeStatistic {
            value,
            neighbour_correlation: (along.0, across.0),
            correlation_error: (along.1, across.1),
            wind_chi2_per_dof: rest / wind_dof as f64,
            wake_chi2_per_dof: (rest - value) / wake_dof as f64,
            wake: self.wake(template, value.sqrt() * length),
            circulation_std_m2_s: length,
        })
    }

    /// The turbulence that was found in the scan, if it was, and its part of the variance of the contrasts with the bank: the mean over some wakes.
    pub(super) fn turbulent_part(&self) -> Option<(&ScanTurbulence, f64)> {
        let Background::Turbulent(_, Some(known)) = &self.filter.background else {
            return None;
        };
        let stride = self.bank.templates.len().div_ceil(PARTS);
        let mut sum = 0.0;
        let mut count = 0.0;
        for number in (0..self.bank.templates.len()).step_by(stride) {
            let template = &self.bank.templates[number];
            let mut pattern = vec![0.0; self.filter.cells.cells.len()];
            for (place, sense) in template.iter().zip([-1.0, 1.0]) {
                let Some(place) = place else { continue };
                let factor = sense * self.reciprocal_length[number];
                for (sum, shape) in pattern.iter_mut().zip(self.filter.shapes.row(*place)) {
                    *sum += factor * shape;
                }
            }
            sum += self.filter.background.turbulent_part(&pattern)?;
            count += 1.0;
        }
        Some((&known.1, sum / count))
    }

    /// Puts the best wind into cells without a velocity; returns their number.
    fn fill(&self, means: &mut [f64]) -> Result<usize, Error> {
        let missing = means.iter().filter(|value| value.is_nan()).count();
        enough_velocities(means.len() - missing, means.len() - means.len() / MISSING)?;
        let cells = &self.filter.cells.cells;

        let mut curvature = Array2::zeros((WINDS, WINDS));
        let mut towards = [0.0; WINDS];
        for i in (0..means.len()).filter(|&i| means[i].is_finite()) {
            let deviation_m_s = cells[i].deviation_m_s;
            let row = wind_velocities(&self.filter.cells, i).map(|x| x / deviation_m_s);
            let value = means[i] / deviation_m_s;
            for a in 0..WINDS {
                towards[a] += row[a] * value;
                (0..WINDS).for_each(|b| curvature[[a, b]] += row[a] * row[b]);
            }
        }
        let wind =
            solve(&curvature, &towards).unwrap_or_else(|| vec![towards[0] / curvature[[0, 0]]]);
        for (i, value) in means
            .iter_mut()
            .enumerate()
            .filter(|(_, value)| value.is_nan())
        {
            *value = wind_velocities(&self.filter.cells, i)
                .iter()
                .zip(&wind)
                .map(|(row, wind)| row * wind)
                .sum();
        }
        Ok(missing)
    }

    /// Correlation of white numbers by cell with those of the next gate and the next line, far from a wake, each with its error.
    fn neighbour_correlation(&self, numbers: &Array1<f64>, template: &Template) -> [(f64, f64); 2] {
        let mut grid = Array2::from_elem(
            (
                self.filter.cells.elevation_rad.len(),
                self.filter.cells.range_m.len(),
            ),
            f64::NAN,
        );
        for (cell, number) in self.filter.cells.cells.iter().zip(numbers) {
            let mut centres = template
                .iter()
                .flatten()
                .map(|place| self.bank.places_m[*place]);
            if centres.all(|(y, z)| (y - cell.place_m.0).hypot(z - cell.place_m.1) > WAKE_M) {
                grid[[cell.line, cell.gate]] = *number;
            }
        }
        let (power, _) = finite_mean(&(&grid * &grid));
        let along = finite_mean(&(&grid.slice(s![.., 1..]) * &grid.slice(s![.., ..-1])));
        let across = finite_mean(&(&grid.slice(s![1.., ..]) * &grid.slice(s![..-1, ..])));
        [along, across].map(|(product, count): (f64, f64)| (product / power, count.sqrt().recip()))
    }

    /// Statistic and index of the best wake of the bank, given the products of a scan with all places.
    pub(super) fn best(&self, products: ArrayView1<'_, f64>) -> (f64, usize) {
        let all = self.scores(products).enumerate();
        let (most, best) = all.fold(
            (0.0, 0),
            |best, (i, x)| if x > best.0 { (x, i) } else { best },
        );
        (most * most, best)
    }

    /// How well each wake of the bank explains a scan, given its products with all places; the statistic is the square of the largest.
    pub(super) fn scores(&self, products: ArrayView1<'_, f64>) -> impl Iterator<Item = f64> {
        let templates = self.bank.templates.iter().zip(&self.reciprocal_length);
        templates.map(move |(&[left, right], length)| {
            let left = left.map_or(0.0, |place| products[place]);
            let right = right.map_or(0.0, |place| products[place]);
            (right - left) * length
        })
    }

    /// Products of what a wake shows with all places, and its length: the reciprocal of the standard deviation of a factor on its
    /// circulations, were places and cores known.
    pub(super) fn products_of(&self, wake: &Wake) -> (Array1<f64>, f64) {
        let white = self.filter.white_shape(wake);
        (self.filter.shapes.dot(&white), white.dot(&white).sqrt())
    }

    fn wake(&self, &[left, right]: &Template, circulation_m2_s: f64) -> Wake {
        let [left, right] = [(left, right, -1.0), (right, left, 1.0)].map(|(own, other, sense)| {
            let place = own.or(other).unwrap_or(0);
            let (mut lateral_m, height_m) = self.bank.places_m[place];
            if own.is_none() {
                lateral_m += sense * self.bank.step_m.0;
            }
            let circulation_m2_s = own.map_or(0.0, |_| circulation_m2_s);
            Vortex::at((lateral_m, height_m), circulation_m2_s, self.bank.core_m)
        });
        Wake::calm(left, right)
    }
}

/// Mean of the finite products and their number.
fn finite_mean(products: &Array2<f64>) -> (f64, f64) {
    let finite = products.iter().filter(|x| x.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    (sum / count, count)
}

/// The weight of a gate on a grid that is fine enough for wakes of the bank.
fn kernel(gate: &Gate) -> Result<RangeKernel, Error> {
    match gate {
        Gate::Gaussian { std_m } if *std_m != 0.0 => {
            positive("std_m of the gate", *std_m)?;
            let weights: Vec<f64> = (-14..=14)
                .map(|i| 0.25 * f64::from(i))
                .map(|x| (-0.5 * x * x).exp())
                .collect();
            RangeKernel::new(-3.5 * std_m, 0.25 * std_m, &weights)
        }
        Gate::Kernel(kernel) => Ok(kernel.coarser(2)),
        Gate::Point | Gate::Gaussian { .. } => RangeKernel::new(0.0, 1.0, &[1.0]),
    }
}

/// Square of the length of what a wake of unit circulation shows, from the products of single vortices.
fn length2(&[left, right]: &Template, gram: &Array2<f64>) -> f64 {
    let [of_left, of_right, of_both] = [(left, left), (right, right), (left, right)]
        .map(|(a, b)| a.zip(b).map_or(0.0, |(a, b)| gram[[a, b]]));
    of_left + of_right - 2.0 * of_both
}
