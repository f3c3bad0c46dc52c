//! The figures that a run writes, from the realisations of a setting: values, shifts between settings, and their errors.
//!
//! Settings have the seed in common, so a shift is taken pair by pair and its standard error by leaving out one realisation at a time
//! of the ratio. A shift is no error against the truth: coarse settings smooth, and may look better than fine ones. Check: closed
//! forms of Gaussian errors; a setting against itself.

use crate::Error;
use crate::measure::beam_winds::mean_wind_m_s;
use crate::measure::map::VelocityEstimates;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::sweep::Retrieval;

crate::keys::keys! {
    /// A figure that a run writes.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    choice Figure {
        /// Efficiency in the middle of the scan.
        Efficiency = "efficiency",
        /// Root mean square over the map of the mean error against the velocity weighted with pulse and window, noise taken off.
        Bias = "bias",
        /// Standard deviation of one estimate, over the map.
        Std = "std",
        /// Root mean square error, over the map.
        Rms = "rms",
        /// Wind along x of a VAD or DBS scan, averaged over sweeps and ranges, over the wind speed.
        U = "u",
        /// Wind along y.
        V = "v",
        /// Wind along z.
        W = "w",
        /// Circulation fitted to each map; of a simulated wake that of its history.
        Circulation = "circulation",
        /// Height of the vortices of a simulated wake.
        Height = "height",
        /// Kinetic energy of a flow.
        Energy = "energy",
        /// What viscosity and subgrid model take from it.
        Dissipation = "dissipation",
    }
}

impl Figure {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 11] = {
        use Figure::*;
        [
            Efficiency,
            Bias,
            Std,
            Rms,
            U,
            V,
            W,
            Circulation,
            Height,
            Energy,
            Dissipation,
        ]
    };
}

/// A relative shift and its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shift {
    /// Value over that of the finest setting, less one.
    pub shift: f64,
    /// Its standard error.
    pub error: f64,
}

impl Shift {
    /// What it is at most, with two standard errors.
    #[must_use]
    pub fn bound(self) -> f64 {
        self.shift.abs() + 2.0 * self.error
    }
}

/// A value of all realisations, followed by those of all but each.
#[derive(Debug, Clone)]
pub(super) struct Values(Vec<f64>);

impl Values {
    /// Mean of numbers that are independent; what is no number is left out.
    pub(super) fn mean(numbers: &[f64]) -> Self {
        let finite = || numbers.iter().filter(|x| x.is_finite());
        let (sum, n) = (finite().sum::<f64>(), finite().count() as f64);
        Self(
            [sum / n]
                .into_iter()
                .chain(finite().map(|x| (sum - x) / (n - 1.0)))
                .collect(),
        )
    }

    fn whole(&self) -> f64 {
        self.0[0]
    }

    /// Standard error of the whole.
    fn error(&self) -> f64 {
        let (without, n) = (&self.0[1..], self.0.len() as f64 - 1.0);
        let mean = without.iter().sum::<f64>() / n;
        ((n - 1.0) / n * without.iter().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
    }

    /// The same over the whole.
    pub(super) fn relative_error(&self) -> f64 {
        self.error() / self.whole()
    }

    fn with(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(
            self.0
                .iter()
                .zip(&other.0)
                .map(|(a, b)| of(*a, *b))
                .collect(),
        )
    }

    /// How far this is from `fine`, over a scale.
    pub(super) fn shift(&self, fine: &Self, scale: &Self) -> Shift {
        let over = self
            .with(fine, |a, b| a - b)
            .with(scale, |apart, scale| apart / scale);
        Shift {
            shift: over.whole(),
            error: over.error(),
        }
    }
}

/// What one setting showed, realisation after realisation.
#[derive(Debug, Clone, Default)]
pub(super) struct Shown {
    /// Errors against the velocity weighted with the pulse, m/s, `[realisation][cell]`.
    error_m_s: Vec<Vec<f64>>,
    /// That velocity less the one weighted with pulse and window, m/s.
    off_m_s: Vec<f64>,
    wind_m_s: Vec<[f64; 3]>,
    circulation_m2_s: Vec<f64>,
}

impl Shown {
    /// Of a map; circulations only where they are asked for, as they take long.
    ///
    /// # Errors
    /// What the fits of winds refuse; a checked scene gives none.
    pub(super) fn new(
        plan: &Plan,
        scanner: &Scanner<'_>,
        map: VelocityEstimates,
        circulation: bool,
    ) -> Result<Self, Error> {
        let off_m_s = (&map.v_pulse_m_s - &map.v_gate_m_s)
            .iter()
            .copied()
            .collect();
        let mut shown = Self {
            off_m_s,
            ..Self::default()
        };
        let retrieval = if circulation {
            Retrieval::new(plan, scanner)
        } else {
            None
        };
        for scan in &map.scans {
            let velocity_m_s = &scan.error_m_s + &map.v_pulse_m_s;
            shown.wind_m_s.extend(mean_wind_m_s(plan, &velocity_m_s)?);
            shown.circulation_m2_s.extend(
                retrieval
                    .as_ref()
                    .and_then(|own| own.circulation_m2_s(&velocity_m_s)),
            );
            shown
                .error_m_s
                .push(scan.error_m_s.iter().copied().collect());
        }
        Ok(shown)
    }

    /// Adds later realisations.
    pub(super) fn extend(&mut self, more: Self) {
        self.error_m_s.extend(more.error_m_s);
        self.wind_m_s.extend(more.wind_m_s);
        self.circulation_m2_s.extend(more.circulation_m2_s);
    }

    pub(super) fn realisations(&self) -> usize {
        self.error_m_s.len()
    }

    /// Cells with an estimate in every realisation.
    fn known(&self) -> Vec<bool> {
        let finite = |cell: usize| self.error_m_s.iter().all(|scan| scan[cell].is_finite());
        (0..self.off_m_s.len())
            .map(|cell| self.off_m_s[cell].is_finite() && finite(cell))
            .collect()
    }

    /// Part of the cells of `fine` that this setting has no estimate of.
    pub(super) fn lost(&self, fine: &Self) -> f64 {
        let (own, all) = (self.known(), fine.known());
        let count =
            |of: &dyn Fn(usize) -> bool| (0..all.len()).filter(|cell| of(*cell)).count() as f64;
        count(&|cell| all[cell] && !own[cell]) / count(&|cell| all[cell]).max(1.0)
    }

    /// Shift of a figure from the finest setting, over cells that both know, of circulations over the maps that both have one of.
    pub(super) fn shift(&self, fine: &Self, figure: Figure) -> Shift {
        if figure == Figure::Circulation {
            let pairs = self.circulation_m2_s.iter().zip(&fine.circulation_m2_s);
            let both = pairs.filter(|(own, fine)| own.is_finite() && fine.is_finite());
            let (own, fine): (Vec<f64>, Vec<f64>) = both.unzip();
            let fine = Values::mean(&fine);
            return Values::mean(&own).shift(&fine, &fine);
        }
        let both: Vec<bool> = self
            .known()
            .iter()
            .zip(fine.known())
            .map(|(a, b)| *a && b)
            .collect();
        self.values(figure, &both)
            .shift(&fine.values(figure, &both), &fine.scale(figure, &both))
    }

    /// Relative standard error of a figure with these realisations.
    pub(super) fn noise(&self, figure: Figure) -> f64 {
        let known = self.known();
        self.values(figure, &known).error() / self.scale(figure, &known).whole()
    }

    /// What a figure is compared with: itself, but for a bias that does not stand out of its error the root mean square error, and for a
    /// part of the wind its speed or, in still air, that error.
    fn scale(&self, figure: Figure, cells: &[bool]) -> Values {
        let own = self.values(figure, cells);
        let rms = || self.values(Figure::Rms, cells);
        match figure {
            Figure::Bias if own.whole() <= 4.0 * own.error() => rms(),
            Figure::U | Figure::V | Figure::W => {
                let part = |of| self.values(of, cells);
                let speed = part(Figure::U)
                    .with(&part(Figure::V), f64::hypot)
                    .with(&part(Figure::W), f64::hypot);
                speed.with(&rms(), f64::max)
            }
            _ => own,
        }
    }

    fn values(&self, figure: Figure, cells: &[bool]) -> Values {
        let wind = |part: usize| {
            Values::mean(
                &self
                    .wind_m_s
                    .iter()
                    .map(|wind| wind[part])
                    .collect::<Vec<_>>(),
            )
        };
        match figure {
            Figure::U => wind(0),
            Figure::V => wind(1),
            Figure::W => wind(2),
            Figure::Circulation => Values::mean(&self.circulation_m2_s),
            _ => self.of_map(figure, cells),
        }
    }

    /// Root means over cells, from the sums over realisations of each cell.
    fn of_map(&self, figure: Figure, cells: &[bool]) -> Values {
        let all = self.error_m_s.len() as f64;
        let (mut sums, mut count) = (vec![0.0; self.error_m_s.len() + 1], 0.0);
        let square = |n: f64, sum: f64, squares: f64, off: f64| {
            let variance = (squares - sum * sum / n) / (n - 1.0);
            match figure {
                Figure::Bias => (sum / n + off).powi(2) - variance / n,
                Figure::Std => variance,
                _ => squares / n,
            }
        };
        for cell in (0..cells.len()).filter(|cell| cells[*cell]) {
            let errors = || self.error_m_s.iter().map(|scan| scan[cell]);
            let (sum, squares) =
                errors().fold((0.0, 0.0), |(sum, squares), e| (sum + e, squares + e * e));
            count += 1.0;
            sums[0] += square(all, sum, squares, self.off_m_s[cell]);
            for (out, e) in sums[1..].iter_mut().zip(errors()) {
                *out += square(all - 1.0, sum - e, squares - e * e, self.off_m_s[cell]);
            }
        }
        Values(
            sums.into_iter()
                .map(|sum| (sum / count).max(0.0).sqrt())
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of zero mean and unit variance, in pairs of opposite sign, of so many cells.
    fn shown(realisations: usize, cells: usize, change: impl Fn(f64) -> f64) -> Shown {
        let mut state = 1u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let error_m_s = (0..realisations)
            .map(|_| (0..cells).map(|_| change(normal())).collect())
            .collect();
        Shown {
            error_m_s,
            off_m_s: vec![0.5; cells],
            ..Shown::default()
        }
    }

    #[test]
    fn figures_of_gaussian_errors_are_those_of_closed_forms_and_their_errors_too() {
        let (m, n) = (16, 4000);
        let own = shown(m, n, |e| e + 1.0);
        let all = vec![true; n];
        let of = |figure| own.values(figure, &all);
        // sqrt(2/(M - 1)/cells)/2 of a standard deviation
        let expected = (0.5 / ((m - 1) as f64 * n as f64)).sqrt();
        assert!(
            (of(Figure::Std).whole() - 1.0).abs() < 4.0 * expected,
            "{:?}",
            of(Figure::Std).whole()
        );
        assert!(
            (own.noise(Figure::Std) / expected - 1.0).abs() < 0.6,
            "{} {expected}",
            own.noise(Figure::Std)
        );
        // The mean error is 1 against the pulse's velocity and 1.5 against the gate's.
        assert!(
            (of(Figure::Bias).whole() - 1.5).abs() < 4.0 * of(Figure::Bias).error(),
            "{:?}",
            of(Figure::Bias).whole()
        );
        assert!((of(Figure::Rms).whole() - 2f64.sqrt()).abs() < 4.0 * of(Figure::Rms).error());
    }

    #[test]
    fn a_setting_is_not_shifted_from_itself_and_a_pair_knows_a_shift_better_than_its_values() {
        let (fine, coarse) = (shown(8, 500, |e| e), shown(8, 500, |e| 1.02 * e));
        assert_eq!(fine.shift(&fine, Figure::Std), Shift::default());
        let found = coarse.shift(&fine, Figure::Std);
        assert!(
            (found.shift - 0.02).abs() < 1e-12 && found.error < 1e-12,
            "{found:?}"
        );
        assert!(fine.noise(Figure::Std) > 1e-3);
    }

    #[test]
    fn a_bias_within_its_error_is_compared_with_the_root_mean_square_error() {
        let still = Shown {
            off_m_s: vec![0.0; 500],
            ..shown(8, 500, |e| e)
        };
        let (noise, rms) = (still.noise(Figure::Bias), still.noise(Figure::Rms));
        assert!(
            noise.is_finite() && noise < 0.2 && rms < 0.05,
            "{noise} {rms}"
        );
        // Where noise alone is left, whichever realisation is left out, the bias is zero and so is its error.
        let of = |size: f64| {
            (0..8)
                .map(|scan| vec![if scan % 2 == 0 { size } else { -size }; 50])
                .collect()
        };
        let [fine, coarse] = [1.0, 1.1].map(|size| Shown {
            error_m_s: of(size),
            off_m_s: vec![0.0; 50],
            ..still.clone()
        });
        assert_eq!(coarse.shift(&fine, Figure::Bias), Shift::default());
    }

    #[test]
    fn a_fit_that_came_to_no_end_leaves_the_others_in_their_pairs() {
        let fine = Shown {
            circulation_m2_s: vec![480.0, 530.0, 470.0, 515.0, 490.0],
            ..Shown::default()
        };
        let mut coarse = fine.clone();
        coarse
            .circulation_m2_s
            .iter_mut()
            .for_each(|circulation| *circulation *= 1.02);
        coarse.circulation_m2_s[1] = f64::NAN;
        let found = coarse.shift(&fine, Figure::Circulation);
        assert!(
            (found.shift - 0.02).abs() < 1e-12 && found.error < 1e-12,
            "{found:?}"
        );
    }

    #[test]
    fn cells_without_an_estimate_are_counted_as_lost() {
        let fine = shown(4, 100, |e| e);
        let mut holes = fine.clone();
        (0..13).for_each(|cell| holes.error_m_s[2][cell] = f64::NAN);
        assert_eq!((holes.lost(&fine), fine.lost(&fine)), (0.13, 0.0));
        assert_eq!(holes.shift(&fine, Figure::Std), Shift::default());
    }
}
