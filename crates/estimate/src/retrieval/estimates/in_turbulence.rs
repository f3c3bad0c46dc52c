//! Covariance of a fit to what an estimator shows of a wake, with the turbulence that the scan shows beside the wake.
//!
//! ```text
//! cov = A^-1 G^T K G A^-1,   K = sum_L p(L) t1 B(L) + t2 R
//! ```
//!
//! A is the curvature of the robust cost, G the slopes times the second derivatives of the loss, R the covariance of the noise, which gates whose
//! pulses and windows overlap and lines of one region share, and the rest as in [`scan_turbulence`](crate::retrieval::scan_turbulence). The fit is that to
//! independent velocities: generalised least squares, which weigh differences of neighbours most, were tried and had no smaller errors in strong
//! turbulence, probably because peaks jump there from place to place. Turbulence that does not stand out of the noise is added to the covariance that the fit has
//! without it.
//! Check: circulations in turbulence through signals, in the tests across crates.

use ndarray::Array2;

use super::EstimateFits;
use crate::error::Error;
use crate::retrieval::report::OUTLIER;
use crate::retrieval::scan_turbulence::{Remainder, gate_covariance, gate_positions};
use crate::retrieval::{ScanTurbulence, Turbulence};
use crate::vortex_fit::map_fit::cells::Cell;
use crate::vortex_fit::map_fit::coarse::every;
use crate::vortex_fit::map_fit::estimates::{EstimatorPrediction, near_vortex};
use crate::vortex_fit::map_fit::estimator_response::Prepared;
use crate::vortex_fit::map_fit::least_squares::{LeastSquares, Scores};
use crate::vortex_fit::map_fit::local_circulation::CIRCULATIONS;
use crate::vortex_fit::map_fit::setting::keep_small_cores;
use crate::vortex_fit::tolerances::ESTIMATES;
use crate::vortex_fit::{MapFit, VelocityMap, Wake};
use crate::wind_profile::GateCovariance;

/// Distance of the places from which turbulence is found: of lines over the radius of their regions, of gates over the width of their weight. The
/// noise of neighbours is correlated by about a half; closer ones make its covariance nearly singular.
const LINES_OVER_RADIUS: f64 = 0.7;
const GATES_OVER_WIDTH: f64 = 1.0;
/// Part of the variance of the noise that no two places share.
const OWN_NOISE: f64 = 0.1;
/// Correlations of the noise below this part do not count.
const LEAST: f64 = 1e-3;

/// A fit in the turbulence of its scan.
pub(super) struct TurbulentFit {
    pub(super) fit: MapFit,
    pub(super) turbulence: ScanTurbulence,
    /// Whether a circulation is that of what is near its vortex.
    pub(super) is_local: bool,
    /// Covariance of the fit from turbulence that does not stand out of the noise; none of other turbulence, which the fit has.
    pub(super) of_air: Array2<f64>,
}

impl EstimateFits<'_> {
    /// A fit to independent velocities in the turbulence beside its wake, if that of the scan is requested; nothing where velocities are too few to
    /// tell it from noise. Turbulence that stands out of the noise gives the covariance, and each circulation is that of what is near its vortex, in
    /// a wind of its own, where that has the smaller variance. Other turbulence is added to the covariance of the fit.
    ///
    /// # Errors
    /// [`Error::Linalg`] if a free parameter does not show in the map; [`Error::OutOfRange`] for impossible input.
    pub(super) fn in_turbulence(
        &self,
        fit: &MapFit,
        moves: bool,
    ) -> Result<Option<TurbulentFit>, Error> {
        if self.options.turbulence != Some(Turbulence::OfScan) {
            return Ok(None);
        }
        let shown = self.shown_at(&self.view, moves)?;
        let for_slopes = shown.coarse_for_slopes();
        let shown = shown.with_slopes_at(&for_slopes)?;
        let setting = shown.setting();
        let mut p = fit.wake.to_array().to_vec();
        let mut groups = self.map_options.free.groups_of(&fit.wake);
        keep_small_cores(&mut p, &mut groups, setting.least_core_m);
        let linear = setting.linear(&p, &groups, None)?;
        let squares = setting.about(&linear);
        let noise = noise_correlation(&shown.prepared, &squares.cells);
        let remainder = self.remainder(&shown, &squares, (&p, &groups), &noise);
        let table = gate_covariance(&remainder.gates, shown.prepared.kernel.width_m())?;
        let Some(turbulence) = remainder.turbulence(&table)? else {
            return Ok(None);
        };
        let air = (&turbulence, &table);
        let covariance = self.covariance(&fit.wake, air, &noise, [&squares.cells; 2]);
        let uncertainty = squares.uncertainty(&p, &groups, Scores::Correlated(&covariance))?;
        let in_all = uncertainty.covariance(|_| true)?;
        let mut turbulent = TurbulentFit {
            fit: fit.clone(),
            turbulence,
            is_local: false,
            of_air: Array2::zeros(in_all.dim()),
        };
        if !turbulence.stands_out() {
            let of_noise = |i: usize, k: usize| {
                turbulence.noise_factor * noise([&squares.cells[i], &squares.cells[k]])
            };
            let uncertainty = squares.uncertainty(&p, &groups, Scores::Correlated(&of_noise))?;
            turbulent.of_air = in_all - uncertainty.covariance(|_| true)?;
            turbulent.fit.covariance += &turbulent.of_air;
            return Ok(Some(turbulent));
        }
        turbulent.fit.covariance.assign(&in_all);
        for side in 0..CIRCULATIONS.len() {
            let of_pair = (&groups[..], &in_all);
            if let Some(local) = self.nearby(&fit.wake, side, moves, air, of_pair) {
                turbulent.take_if_less_uncertain(side, local);
            }
        }
        Ok(Some(turbulent))
    }

    fn shown_at<'s, 'm: 's>(
        &'s self,
        map: &VelocityMap<'m>,
        moves: bool,
    ) -> Result<EstimatorPrediction<'s, 'm>, Error> {
        let response = self.response(moves);
        EstimatorPrediction::new(map, &self.options.model, response, &self.map_options, 1.0)
    }

    /// What a wake leaves of the velocities at every few lines and gates.
    fn remainder(
        &self,
        shown: &EstimatorPrediction<'_, '_>,
        squares: &LeastSquares<'_>,
        (p, groups): (&[f64], &[Vec<usize>]),
        noise: &(impl Fn([&Cell; 2]) -> f64 + Sync),
    ) -> Remainder {
        let mut few = LeastSquares {
            cells: self.apart(&squares.cells, shown),
            ..squares.clone()
        };
        let residuals = few.rows(p, &[]).residuals;
        let mut residuals = residuals.iter();
        few.cells
            .retain(|_| residuals.next().is_some_and(|r| r.abs() <= OUTLIER));
        let rows = few.rows(p, groups);
        let cells = few.cells;
        let noise_std_m_s = cells.iter().map(|cell| cell.sigma_m_s).collect();
        let gates = gate_positions(self.scan, &cells, &self.options.model, &Wake::from_list(p));
        let correlation = Array2::from_shape_fn((cells.len(), cells.len()), |(i, j)| {
            noise([&cells[i], &cells[j]])
        });
        Remainder::new(gates, rows, noise_std_m_s).with_correlated_noise(correlation)
    }

    /// Cells of every few lines and gates.
    fn apart(&self, all: &[Cell], shown: &EstimatorPrediction<'_, '_>) -> Vec<Cell> {
        let radius_m = shown.prepared.response.least_radius_m(self.view.range_m);
        let width_m = shown.prepared.kernel.width_m();
        let lines_apart = (LINES_OVER_RADIUS * radius_m / self.view.line_spacing_m()).ceil();
        let gates_apart = (GATES_OVER_WIDTH * width_m / self.view.gate_spacing_m()).ceil();
        let (_, lines) = every(self.view.elevation_rad.len(), lines_apart);
        let (_, gates) = every(self.view.range_m.len(), gates_apart);
        let mut cells = all.to_vec();
        cells.retain(|cell| lines.contains(&cell.line) && gates.contains(&cell.gate));
        cells
    }

    /// Covariance of the velocities of cells, by their numbers, over their deviations. The cells are numbered as in the map of the noise and as in
    /// the scan.
    fn covariance<'c>(
        &self,
        wake: &Wake,
        (turbulence, table): (&'c ScanTurbulence, &'c GateCovariance),
        noise: &'c (impl Fn([&Cell; 2]) -> f64 + Sync),
        [cells, in_scan]: [&'c [Cell]; 2],
    ) -> impl Fn(usize, usize) -> f64 + Sync + 'c {
        let gates = gate_positions(self.scan, in_scan, &self.options.model, wake);
        move |i, j| {
            let air_m2_s2 = turbulence.covariance_of_air_m2_s2(table, [&gates[i], &gates[j]]);
            let of_noise = turbulence.noise_factor * noise([&cells[i], &cells[j]]);
            air_m2_s2 / (cells[i].sigma_m_s * cells[j].sigma_m_s) + of_noise
        }
    }

    /// The circulation of one vortex from what is near it, in a wind of its own, and its variance in turbulence, with the free numbers of the pair
    /// and their covariance.
    fn nearby(
        &self,
        pair: &Wake,
        side: usize,
        moves: bool,
        air: (&ScanTurbulence, &GateCovariance),
        of_pair: (&[Vec<usize>], &Array2<f64>),
    ) -> Option<(f64, f64)> {
        let near = near_vortex(
            &self.view,
            &self.options.model,
            &[pair.left, pair.right][side],
        );
        let map = near.map();
        let shown = self.shown_at(&map, moves).ok()?;
        let setting = shown.setting();
        let best = setting.settled_nearby(pair, side, ESTIMATES)?;
        let noise = noise_correlation(&shown.prepared, &best.cells);
        let in_scan = near.in_whole_map(&best.cells);
        let covariance = self.covariance(pair, air, &noise, [&best.cells, &in_scan]);
        let nearby = setting.local_variance(&best, side, Scores::Correlated(&covariance))?;
        let variance = nearby + setting.variance_of_pair(&best, of_pair)?;
        Some((best.at[CIRCULATIONS[side] as usize], variance))
    }
}

impl TurbulentFit {
    /// Takes a circulation \[m²/s\] with its variance if that is less than that of the pair; correlations stay.
    fn take_if_less_uncertain(&mut self, side: usize, (circulation_m2_s, variance): (f64, f64)) {
        let own = CIRCULATIONS[side] as usize;
        let covariance = &mut self.fit.covariance;
        let of_pair = covariance[[own, own]];
        if variance >= of_pair {
            return;
        }
        let smaller = (variance / of_pair).sqrt();
        covariance
            .row_mut(own)
            .mapv_inplace(|value| smaller * value);
        covariance
            .column_mut(own)
            .mapv_inplace(|value| smaller * value);
        let mut p = self.fit.wake.to_array();
        p[own] = circulation_m2_s;
        self.fit.wake = Wake::from_array(&p);
        self.is_local = true;
    }
}

/// Correlation of the noise of two cells of a map, of whose least standard deviation `cells` tell. Gates share the noise that they have in uniform
/// wind, which is the least; what the air about vortices adds to it only lines share.
fn noise_correlation<'a>(
    prepared: &'a Prepared<'a>,
    cells: &[Cell],
) -> impl Fn([&Cell; 2]) -> f64 + Sync + use<'a> {
    let sigmas_m_s = cells.iter().map(|cell| cell.sigma_m_s);
    let least_m_s = sigmas_m_s.fold(f64::INFINITY, f64::min);
    move |[a, b]| {
        if (a.line, a.gate) == (b.line, b.gate) {
            return 1.0;
        }
        let of_gates = prepared.noise_correlation_of_gates([a.gate, b.gate]);
        if of_gates < LEAST {
            return 0.0;
        }
        let least = [a, b].map(|cell| least_m_s / cell.sigma_m_s);
        let of_air = match a.gate == b.gate {
            true => least.map(|part| (1.0 - part * part).sqrt()),
            false => [0.0; 2],
        };
        let places = [[a.line, a.gate], [b.line, b.gate]];
        let of_lines = prepared.noise_correlation_of_lines(places);
        let shared = least[0] * least[1] * of_gates + of_air[0] * of_air[1];
        (1.0 - OWN_NOISE) * of_lines * shared
    }
}
