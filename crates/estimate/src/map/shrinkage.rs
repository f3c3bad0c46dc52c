//! A velocity map drawn towards a first guess, as far as the map itself does not contradict it.
//!
//! The residual of the measured map against what the estimator would show of the guess is split into scales (the
//! wavelet transform "a trous" with the cubic B-spline, Holschneider et al. 1989, Starck and Murtagh 1994). At each
//! scale and place the energy of the residual is compared with that of noise, which two maps made from one half of
//! the pulses each give: half of their difference has the noise of the whole map and no wind. What exceeds the noise
//! stays, the rest goes (block shrinkage of James and Stein, Cai 1999):
//!
//! ```text
//! weight = max(0, 1 - factor <noise^2> / <residual^2>)
//! ```
//!
//! So a guess that is right takes the noise away, and where it is wrong the data replace it. The guess may be a
//! fitted wake ([`WakeModel::map`](crate::vortex_fit::WakeModel::map)), a simulated flow, or zeros, which smooths the
//! map. The coarsest scale is always that of the data. The price of a guess that is wrong in a place is some detail
//! there. Check: a right guess removes noise, a wrong one is corrected, no guess keeps structures.

use ndarray::{Array2, ArrayView2};

use crate::error::{Error, length, not_empty, not_negative, positive};

/// Cubic B-spline at the integers.
const SPLINE: [f64; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// How a map is shrunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShrinkageOptions {
    /// Step of the finest scale over lines of sight: its kernel reaches two steps to each side.
    pub line_step: usize,
    /// The same over gates.
    pub gate_step: usize,
    /// Number of scales, each twice as coarse as the one before.
    pub scales: usize,
    /// What the energy of the residual must be over that of the noise to count: 1 is Wiener's filter, 4.5 removes
    /// nearly all noise (Cai 1999) and with it what is weak; 0 leaves the data as they are.
    pub factor: f64,
}

impl ShrinkageOptions {
    /// Four scales and a factor of 2 for a map whose regions have the radius `radius_m`, lines `line_spacing_m` and
    /// gates `gate_spacing_m` apart, and whose pulse and window see `gate_length_m` of air together (root mean
    /// square): the finest scale is that of what the map resolves.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for spacings that are not positive.
    pub fn for_map(
        line_spacing_m: f64,
        gate_spacing_m: f64,
        radius_m: f64,
        gate_length_m: f64,
    ) -> Result<Self, Error> {
        positive("line_spacing_m", line_spacing_m)?;
        positive("gate_spacing_m", gate_spacing_m)?;
        let steps =
            |length_m: f64, spacing_m: f64| (length_m / spacing_m).round().clamp(1.0, 1e6) as usize;
        Ok(Self {
            line_step: steps(0.5 * radius_m, line_spacing_m),
            gate_step: steps(0.5 * gate_length_m, gate_spacing_m),
            scales: 4,
            factor: 2.0,
        })
    }
}

/// What shrinkage gives; all maps \[line, gate\].
#[derive(Debug, Clone, PartialEq)]
pub struct ShrunkMap {
    /// Velocities \[m/s\]; NaN where there is no measured velocity within reach of the coarsest scale.
    pub velocity_m_s: Array2<f64>,
    /// What the data add to the guess \[m/s\].
    pub correction_m_s: Array2<f64>,
}

/// Draws `measured_m_s` towards a guess.
///
/// All maps are \[line, gate\] in m/s. `half_difference_m_s` is half the difference of two maps made from one half of
/// the pulses each, such as those of the odd and of the even lines; `seen_m_s` is what the estimator would show of
/// the guess, `wanted_m_s` what is to be known of it, for example its mean over pulse and gate, and over the pulse
/// alone. Velocities that are NaN in the first two are missing.
///
/// # Errors
/// [`Error::Length`] if the maps differ in shape, [`Error::Empty`] if they are empty, [`Error::OutOfRange`] for a
/// step of 0 or a negative factor.
pub fn shrink_to_guess(
    measured_m_s: ArrayView2<'_, f64>,
    half_difference_m_s: ArrayView2<'_, f64>,
    seen_m_s: ArrayView2<'_, f64>,
    wanted_m_s: ArrayView2<'_, f64>,
    options: &ShrinkageOptions,
) -> Result<ShrunkMap, Error> {
    for (field, map) in [
        ("half_difference_m_s", &half_difference_m_s),
        ("seen_m_s", &seen_m_s),
        ("wanted_m_s", &wanted_m_s),
    ] {
        length(field, measured_m_s.nrows(), map.nrows())?;
        length(field, measured_m_s.ncols(), map.ncols())?;
    }
    not_empty("measured_m_s", measured_m_s.len())?;
    positive("line_step", options.line_step as f64)?;
    positive("gate_step", options.gate_step as f64)?;
    not_negative("factor", options.factor)?;
    let (mut residual, mut noise) = (&measured_m_s - &seen_m_s, half_difference_m_s.to_owned());
    let mut correction = Array2::zeros(measured_m_s.dim());
    let mut steps = [options.line_step, options.gate_step];
    for _ in 0..options.scales {
        let (smooth, quiet) = (smoothed(&residual, steps), smoothed(&noise, steps));
        let (detail, noise_detail) = (&residual - &smooth, &noise - &quiet);
        let energy = |detail: &Array2<f64>| smoothed(&detail.mapv(|value| value * value), steps);
        let (total, own) = (energy(&detail), energy(&noise_detail));
        for ((place, sum), detail) in correction.indexed_iter_mut().zip(&detail) {
            let share = 1.0 - options.factor * own[place] / total[place];
            // no noise known or nothing there: 0/0 and what has no weight count as noise
            if share > 0.0 && detail.is_finite() {
                *sum += share * detail;
            }
        }
        (residual, noise) = (smooth, quiet);
        steps = steps.map(|step| 2 * step);
    }
    correction += &residual;
    Ok(ShrunkMap {
        velocity_m_s: &wanted_m_s + &correction,
        correction_m_s: correction,
    })
}

/// Mean of a map with the weights of the spline, whose taps are the steps over lines and gates apart, over the places that are not NaN.
fn smoothed(map: &Array2<f64>, [line_step, gate_step]: [usize; 2]) -> Array2<f64> {
    let both = |map: Array2<f64>| {
        along_lines(along_lines(map.view(), line_step).t(), gate_step).reversed_axes()
    };
    let sums = both(map.mapv(|value| if value.is_finite() { value } else { 0.0 }));
    sums / both(map.mapv(|value| f64::from(u8::from(value.is_finite()))))
}

/// Sums over lines with the weights of the spline; what lies outside the map is left out.
fn along_lines(map: ArrayView2<'_, f64>, step: usize) -> Array2<f64> {
    let mut out = Array2::zeros(map.dim());
    for line in 0..map.nrows() {
        for (tap, weight) in SPLINE.iter().enumerate() {
            let source = (line + tap * step)
                .checked_sub(2 * step)
                .filter(|&source| source < map.nrows());
            if let Some(source) = source {
                out.row_mut(line).scaled_add(*weight, &map.row(source));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const SHAPE: (usize, usize) = (60, 50);
    const OPTIONS: ShrinkageOptions = ShrinkageOptions {
        line_step: 1,
        gate_step: 1,
        scales: 4,
        factor: 2.0,
    };

    fn noise(seed: u64) -> Array2<f64> {
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        Array2::from_shape_fn(SHAPE, |_| rng.sample::<f64, _>(rand_distr::StandardNormal))
    }

    /// A vortex-like structure of 5 m/s.
    fn structure() -> Array2<f64> {
        Array2::from_shape_fn(SHAPE, |(line, gate)| {
            let (y, z) = ((gate as f64 - 25.0) / 6.0, (line as f64 - 30.0) / 3.0);
            5.0 * z * (-0.5 * (y * y + z * z)).exp()
        })
    }

    fn rms(map: &Array2<f64>) -> f64 {
        (map.iter().map(|v| v * v).sum::<f64>() / map.len() as f64).sqrt()
    }

    /// Wind with noise of 0.5 m/s, from halves with 0.7 each, shrunk to a guess.
    fn shrunk(wind: &Array2<f64>, guess: &Array2<f64>, options: &ShrinkageOptions) -> Array2<f64> {
        let (a, b) = (
            wind + 0.5_f64.sqrt() * noise(1),
            wind + 0.5_f64.sqrt() * noise(2),
        );
        let (mean, half) = (0.5 * (&a + &b), 0.5 * (&a - &b));
        shrink_to_guess(
            mean.view(),
            half.view(),
            guess.view(),
            guess.view(),
            options,
        )
        .unwrap()
        .velocity_m_s
    }

    #[test]
    fn a_right_guess_takes_nearly_all_noise_away() {
        let (wind, options) = (structure(), OPTIONS);
        assert!(rms(&(shrunk(&wind, &wind, &options) - &wind)) < 0.3 * 0.5);
        // a factor of 0 leaves the data
        let data = shrunk(
            &wind,
            &wind,
            &ShrinkageOptions {
                factor: 0.0,
                ..options
            },
        ) - &wind;
        assert!((rms(&data) / 0.5 - 1.0).abs() < 0.1);
    }

    #[test]
    fn a_wrong_guess_is_replaced_by_the_data() {
        let (wind, nothing) = (structure(), Array2::zeros(SHAPE));
        let error = |guess| rms(&(shrunk(&wind, guess, &OPTIONS) - &wind));
        // a vortex that is not there, and one that is missing: little worse than the data's 0.5 m/s in the mean over the map
        let (missing, double) = (error(&nothing), error(&(2.0 * &wind)));
        assert!(missing < 0.5 && double < 0.5, "{missing} {double}");
        let without_noise = |options: &ShrinkageOptions| {
            shrink_to_guess(
                wind.view(),
                nothing.view(),
                (2.0 * &wind).view(),
                (2.0 * &wind).view(),
                options,
            )
            .unwrap()
        };
        assert!(rms(&(without_noise(&OPTIONS).velocity_m_s - &wind)) < 1e-12);
    }

    #[test]
    fn what_is_wanted_of_the_guess_need_not_be_what_is_seen() {
        let (seen, wanted) = (structure(), 1.5 * structure());
        let found = shrink_to_guess(
            seen.view(),
            noise(3).view(),
            seen.view(),
            wanted.view(),
            &OPTIONS,
        )
        .unwrap();
        assert_eq!(found.velocity_m_s, wanted);
        assert_eq!(rms(&found.correction_m_s), 0.0);
    }

    #[test]
    fn missing_velocities_are_filled_from_their_surroundings_and_an_empty_map_stays_empty() {
        let (mut measured, zero) = (Array2::from_elem(SHAPE, 2.0), Array2::zeros(SHAPE));
        measured[[20, 20]] = f64::NAN;
        let found = shrink_to_guess(
            measured.view(),
            zero.view(),
            zero.view(),
            zero.view(),
            &OPTIONS,
        )
        .unwrap();
        assert!(found.velocity_m_s.iter().all(|v| (v - 2.0).abs() < 1e-12));
        measured.fill(f64::NAN);
        let found = shrink_to_guess(
            measured.view(),
            zero.view(),
            zero.view(),
            zero.view(),
            &OPTIONS,
        )
        .unwrap();
        assert!(found.velocity_m_s.iter().all(|v| v.is_nan()));
    }

    #[test]
    fn maps_of_other_shapes_and_impossible_options_are_refused() {
        let (map, other) = (structure(), Array2::zeros((60, 49)));
        assert!(
            shrink_to_guess(map.view(), other.view(), map.view(), map.view(), &OPTIONS).is_err()
        );
        for options in [
            ShrinkageOptions {
                line_step: 0,
                ..OPTIONS
            },
            ShrinkageOptions {
                gate_step: 0,
                ..OPTIONS
            },
            ShrinkageOptions {
                factor: f64::NAN,
                ..OPTIONS
            },
        ] {
            assert!(
                shrink_to_guess(map.view(), map.view(), map.view(), map.view(), &options).is_err()
            );
        }
        let none = Array2::<f64>::zeros((0, 0));
        assert!(
            shrink_to_guess(none.view(), none.view(), none.view(), none.view(), &OPTIONS).is_err()
        );
        assert!(ShrinkageOptions::for_map(0.0, 1.0, 2.0, 15.0).is_err());
    }
}
