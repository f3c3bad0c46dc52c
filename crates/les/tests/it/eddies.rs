//! Fields of eddies: their statistics against independent tables, and sums along lines against
//! sines and cosines.

use approx::assert_relative_eq;
use wakescope_les::Wind;
use wakescope_les::winds::{Eddies, Mode, SampledLine, isotropic_modes};

/// Uniform numbers that depend on a seed and an index (splitmix64).
fn uniform(seed: u64, index: u64) -> f64 {
    let mut z = (seed << 32)
        .wrapping_add(index.wrapping_add(1))
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / 2.0_f64.powi(64)
}

/// Spectrum of von Karman, (A1).
fn energy_m3_s2(dissipation_m2_s3: f64, outer_scale_m: f64, k_rad_m: f64) -> f64 {
    let x2 = (k_rad_m * outer_scale_m).powi(2);
    1.5 * dissipation_m2_s3.powf(2.0 / 3.0) * outer_scale_m.powf(5.0 / 3.0) * x2 * x2
        / (1.0 + x2).powf(17.0 / 6.0)
}

/// Modes from 0.1/L to 2 pi/4 m.
fn modes(seed: u64, dissipation_m2_s3: f64, outer_scale_m: f64, count: usize) -> Vec<Mode> {
    let band_rad_m = [0.1 / outer_scale_m, std::f64::consts::TAU / 4.0];
    let lattice_start = [uniform(seed, 0), uniform(seed, 1)];
    let uniforms = |n: usize| [2, 3, 4].map(|i| uniform(seed, 3 * n as u64 + i));
    let energy = |k| energy_m3_s2(dissipation_m2_s3, outer_scale_m, k);
    isotropic_modes(band_rad_m, count, lattice_start, energy, uniforms).unwrap()
}

fn field(seed: u64) -> Eddies {
    Eddies::new(modes(seed, 5e-4, 100.0, 512)).unwrap()
}

/// Standard deviation of one component of [`field`] \[m/s\].
const SPREAD_M_S: f64 = 0.374;

fn line(elevation_rad: f64, height_m: f64) -> SampledLine {
    let (sin, cos) = elevation_rad.sin_cos();
    SampledLine {
        origin_m: [3.0, -250.0, height_m],
        direction: [0.6 * cos, 0.8 * cos, sin],
        step_m: 0.7,
    }
}

/// The velocity of the modes at a point by the functions of the standard library.
fn by_sines(modes: &[Mode], point_m: [f64; 3], time_s: f64) -> [f64; 3] {
    let mut sum_m_s = [0.0; 3];
    for mode in modes {
        let k = mode.wavenumber_rad_m;
        let phase = k[0] * point_m[0] + k[1] * point_m[1] + k[2] * point_m[2]
            - mode.frequency_rad_s * time_s;
        for (d, sum) in sum_m_s.iter_mut().enumerate() {
            *sum += mode.real_m_s[d] * phase.cos() - mode.imaginary_m_s[d] * phase.sin();
        }
    }
    sum_m_s
}

fn at(wind: &dyn Wind, point_m: [f64; 3], time_s: f64) -> [f64; 3] {
    let mut out = [[0.0; 3]];
    wind.velocity_into(&[point_m], time_s, &mut out).unwrap();
    out[0]
}

fn along(wind: &dyn Wind, line: &SampledLine, first: usize, count: usize) -> Vec<f64> {
    let mut out = vec![0.0; count];
    wind.along_line_into(line, first, 2.5, &mut out).unwrap();
    out
}

/// The same by the default of the trait, through the three components.
fn along_points(wind: &dyn Wind, line: &SampledLine, count: usize) -> Vec<f64> {
    let along = |index: usize| {
        let velocity_m_s = at(wind, line.point_m(index), 2.5);
        (0..3).map(|d| line.direction[d] * velocity_m_s[d]).sum()
    };
    (0..count).map(along).collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn amplitudes_are_across_their_wave_vectors() {
    for mode in modes(3, 5e-4, 100.0, 512) {
        for amplitude_m_s in [mode.real_m_s, mode.imaginary_m_s] {
            let k = mode.wavenumber_rad_m;
            let along: f64 = (0..3).map(|d| k[d] * amplitude_m_s[d]).sum();
            let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(along.abs() <= 1e-14 * size(k) * size(amplitude_m_s));
        }
    }
    let mut along = modes(3, 5e-4, 100.0, 64);
    along[7].real_m_s[0] += 1e-6;
    assert!(Eddies::new(along).is_err());
}

#[test]
fn a_point_has_the_sum_of_sines_and_cosines() {
    let field = field(5).carried([4.0, -3.0]).unwrap();
    for i in 0..20 {
        let point_m = [
            17.3 * f64::from(i),
            250.0 - 31.0 * f64::from(i),
            3.1 * f64::from(i),
        ];
        let carried_m = [point_m[0] - 40.0, point_m[1] + 30.0, point_m[2]];
        let expected = by_sines(field.modes(), carried_m, 10.0);
        let found = at(&field, point_m, 10.0);
        assert!(largest_difference(&found, &expected) < 1e-12);
    }
}

#[test]
fn a_line_has_the_velocities_of_its_points() {
    let count = 1500;
    for elevation_rad in [0.0, 0.12, 1.2, std::f64::consts::FRAC_PI_2] {
        let all = field(5).summed_at_each_sample();
        let line = line(elevation_rad, 2.0);
        let expected = along_points(&all, &line, count);
        let error = largest_difference(&along(&all, &line, 0, count), &expected);
        assert!(error < 1e-12, "all: {error}");
        let levels = along(&field(5), &line, 0, count);
        let error = largest_difference(&levels, &expected);
        assert!(error < 2e-3 * SPREAD_M_S, "levels: {error}");
        let squares: f64 = levels
            .iter()
            .zip(&expected)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        let rms = (squares / count as f64).sqrt();
        assert!(rms < 5e-4 * SPREAD_M_S, "levels: {rms}");
    }
}

#[test]
fn a_line_over_a_blocking_ground_has_the_velocities_of_its_points() {
    let count = 900;
    // Upwards from the ground, level at 3 m, downwards through the ground.
    for (elevation_rad, height_m) in [(0.1, 0.0), (1.3, 1.0), (0.0, 3.0), (-0.3, 100.0)] {
        let all = field(5).blocked().summed_at_each_sample();
        let line = line(elevation_rad, height_m);
        let expected = along_points(&all, &line, count);
        for (field, largest) in [(&all, 1e-12), (&field(5).blocked(), 2e-3 * SPREAD_M_S)] {
            let found = along(field, &line, 0, count);
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let is_below = line.point_m(i)[2] < 0.0;
                assert_eq!(found.is_nan(), is_below);
                assert!(
                    is_below || (found - expected).abs() < largest,
                    "{i}: {found}"
                );
            }
        }
    }
}

#[test]
fn a_sample_has_the_same_bits_whatever_is_computed_with_it() {
    let open = field(9);
    let all = field(9).summed_at_each_sample();
    for field in [&open, &all, &field(9).blocked()] {
        for step_m in [0.3, 0.7, 25.0] {
            let line = SampledLine {
                step_m,
                ..line(0.2, 1.0)
            };
            let whole = along(field, &line, 0, 2600);
            for batch in [1, 7, 256] {
                for first in (0..2600 - batch).step_by(batch.max(97)) {
                    let part = along(field, &line, first, batch);
                    assert_eq!(part, whole[first..first + batch]);
                }
            }
        }
    }
    let points_m: Vec<[f64; 3]> = (0..256).map(|i| line(0.2, 1.0).point_m(i)).collect();
    let mut whole = vec![[0.0; 3]; 256];
    open.velocity_into(&points_m, 1.0, &mut whole).unwrap();
    let mut parts = vec![[0.0; 3]; 256];
    for (points_m, out) in points_m.chunks(7).zip(parts.chunks_mut(7)) {
        open.velocity_into(points_m, 1.0, out).unwrap();
    }
    assert_eq!(whole, parts);
}

#[test]
fn no_air_crosses_a_blocking_ground() {
    let field = field(2).blocked();
    for i in 0..200 {
        let point_m = [7.7 * f64::from(i), 400.0 - 3.3 * f64::from(i), 0.0];
        assert_eq!(at(&field, point_m, 3.0)[2], 0.0);
    }
    let high = at(&field, [10.0, 20.0, 1e4], 0.0);
    let free = at(&self::field(2), [10.0, 20.0, 1e4], 0.0);
    assert!(largest_difference(&high, &free) < 1e-3);
    assert!(at(&field, [0.0, 0.0, -1.0], 0.0)[0].is_nan());
}

#[test]
fn a_carried_field_is_the_field_at_a_moved_origin() {
    let still = field(4);
    let carried = field(4).carried([6.0, 2.0]).unwrap();
    let point_m = [30.0, 410.0, 25.0];
    let moved = at(&carried, [30.0 + 48.0, 410.0 + 16.0, 25.0], 8.0);
    let expected = at(&still, point_m, 0.0);
    assert!(largest_difference(&moved, &expected) < 1e-9);
}

/// Standard deviation and largest value of the gradient along lines \[1/s\].
fn gradients_per_s(field: &Eddies, elevations_rad: &[f64], samples: usize) -> (f64, f64) {
    let field = field.clone().summed_at_each_sample();
    let mut squares = 0.0;
    let mut largest = 0.0_f64;
    for &elevation_rad in elevations_rad {
        let line = SampledLine {
            step_m: 0.05,
            ..line(elevation_rad, 0.0)
        };
        let velocity_m_s = along(&field, &line, 0, samples + 1);
        for pair in velocity_m_s.windows(2) {
            let gradient_per_s = (pair[1] - pair[0]) / line.step_m;
            squares += gradient_per_s.powi(2);
            largest = largest.max(gradient_per_s.abs());
        }
    }
    let count = (elevations_rad.len() * samples) as f64;
    ((squares / count).sqrt(), largest)
}

#[test]
fn the_bound_of_the_gradient_is_six_standard_deviations() {
    let open = field(6);
    let bound = open.max_gradient_per_s(0.0);
    let (deviation, largest) = gradients_per_s(&open, &[0.0, 0.3, 0.7, 1.4], 8000);
    assert_relative_eq!(deviation, bound / 6.0, max_relative = 0.1);
    assert!(largest < bound);
    let page = 6.0
        * (0.15 * 5e-4_f64.powf(2.0 / 3.0)).sqrt()
        * (std::f64::consts::TAU / 4.0).powf(2.0 / 3.0);
    assert_relative_eq!(bound, page, max_relative = 0.02);
    // The air at a blocking ground is steeper; a level line lies in it.
    let blocked = field(6).blocked();
    let bound = blocked.max_gradient_per_s(0.0);
    let (deviation, largest) = gradients_per_s(&blocked, &[0.0], 20_000);
    assert!(largest < bound, "{largest} {bound}");
    assert!(deviation > 0.7 * bound / 6.0 && deviation < 1.1 * bound / 6.0);
    let (_, largest) = gradients_per_s(&blocked, &[0.02, 0.3, 0.8, 1.5], 2000);
    assert!(largest < bound);
}

/// Rows of a table under `tests/reference/air`.
fn table(name: &str) -> Vec<Vec<f64>> {
    let path = format!(
        "{}/../../tests/reference/air/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| line.split(',').map(|v| v.parse().unwrap()).collect())
        .collect()
}

/// Mean, its standard error and the scatter of values.
fn statistics(values: &[f64]) -> (f64, f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (square / count).sqrt(), square.sqrt())
}

/// Structure functions along and across lines, of one field: lags in samples of 2 m.
fn structure_functions(field: &Eddies, lags: &[usize]) -> Vec<[f64; 2]> {
    let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let samples = 120;
    let mut sums = vec![[0.0; 2]; lags.len()];
    let mut count = 0.0;
    for direction in directions {
        for start in 0..2 {
            let line = SampledLine {
                origin_m: [37.0 * f64::from(start), 91.0 * f64::from(start), 11.0],
                direction,
                step_m: 2.0,
            };
            let points_m: Vec<[f64; 3]> = (0..samples).map(|i| line.point_m(i)).collect();
            let mut velocity_m_s = vec![[0.0; 3]; samples];
            field
                .velocity_into(&points_m, 0.0, &mut velocity_m_s)
                .unwrap();
            count += 1.0;
            for (sums, lag) in sums.iter_mut().zip(lags) {
                let pairs = (samples - lag) as f64;
                for i in 0..samples - lag {
                    for d in 0..3 {
                        let square = (velocity_m_s[i + lag][d] - velocity_m_s[i][d]).powi(2);
                        if direction[d] == 1.0 {
                            sums[0] += square / pairs;
                        } else {
                            sums[1] += 0.5 * square / pairs;
                        }
                    }
                }
            }
        }
    }
    sums.iter().map(|sum| sum.map(|sum| sum / count)).collect()
}

/// Band value of the table at a separation, by interpolation of the logarithms.
fn band_value(rows: &[Vec<f64>], separation_m: f64, column: usize) -> f64 {
    let above = rows.iter().position(|row| row[2] >= separation_m).unwrap();
    let low = &rows[above - 1];
    let high = &rows[above];
    let fraction = (separation_m / low[2]).ln() / (high[2] / low[2]).ln();
    (low[column].ln() + fraction * (high[column] / low[column]).ln()).exp()
}

fn check_structure_functions(seeds: u64, air: &[(f64, f64)]) {
    let rows = table("structure_functions.csv");
    let lags = [1, 2, 3, 6, 12, 30, 60];
    for &(dissipation_m2_s3, outer_scale_m) in air {
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .filter(|row| row[0] == dissipation_m2_s3 && row[1] == outer_scale_m)
            .cloned()
            .collect();
        let mut found = vec![[Vec::new(), Vec::new()]; lags.len()];
        for seed in 0..seeds {
            let field = Eddies::new(modes(seed, dissipation_m2_s3, outer_scale_m, 512)).unwrap();
            let one = structure_functions(&field, &lags);
            for (found, one) in found.iter_mut().zip(one) {
                found[0].push(one[0]);
                found[1].push(one[1]);
            }
        }
        for (lag, found) in lags.iter().zip(&found) {
            for (kind, values) in found.iter().enumerate() {
                let expected = band_value(&rows, 2.0 * *lag as f64, 5 + kind);
                let (mean, error, scatter) = statistics(values);
                assert!(
                    (mean - expected).abs() < 0.02 * expected + 3.0 * error,
                    "eps {dissipation_m2_s3} L {outer_scale_m} lag {lag} kind {kind}: {} +- {}, scatter {}",
                    mean / expected,
                    error / expected,
                    scatter / expected
                );
            }
        }
    }
}

#[test]
fn the_structure_function_of_seeds_is_that_of_the_band() {
    check_structure_functions(24, &[(5e-4, 30.0)]);
}

#[test]
#[ignore = "400 seeds of each air"]
fn the_structure_function_of_400_seeds_is_that_of_the_band() {
    let mut air = Vec::new();
    for dissipation_m2_s3 in [4e-5, 5e-4, 1.45e-2] {
        air.push((dissipation_m2_s3, 30.0));
        air.push((dissipation_m2_s3, 100.0));
    }
    check_structure_functions(400, &air);
}

/// Velocities far apart, of many fields.
#[test]
fn velocities_are_normal_and_of_the_variance_of_the_spectrum() {
    let mut second = 0.0;
    let mut fourth = 0.0;
    let mut count = 0.0;
    for seed in 0..100 {
        let field = field(1000 + seed);
        for i in 0..24 {
            let point_m = [
                211.0 * f64::from(i),
                -173.0 * f64::from(i),
                97.0 * f64::from(i),
            ];
            for component in at(&field, point_m, 0.0) {
                second += component.powi(2);
                fourth += component.powi(4);
                count += 1.0;
            }
        }
    }
    let kurtosis = count * fourth / (second * second);
    assert!((kurtosis - 3.0).abs() < 0.15, "{kurtosis}");
    // The band holds all but 2 to 5 % of the variance.
    let ratio = second / count / (SPREAD_M_S * SPREAD_M_S);
    assert!(ratio > 0.9 && ratio < 1.02, "{ratio}");
}

/// Variances (horizontal, vertical) over a blocking ground of all modes of wave number 1/z times
/// `kz`, over those far above: (A7) averaged over directions.
fn blocked_variances(kz: f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    let steps = 400;
    for i in 0..steps {
        // Cosine and sine of the angle between wave vector and vertical, by the midpoint rule.
        let angle = std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(steps);
        let (sine, cosine) = angle.sin_cos();
        let weight = 1.5 * 0.5 * sine * std::f64::consts::PI / f64::from(steps);
        let image = (-kz * sine).exp();
        let (s, c) = (kz * cosine).sin_cos();
        // a_z exp(i k_z z) - a_z exp(-kappa z); |a_z|^2 is 3/2 sin^2 of the variance.
        sums[1] += weight * sine * sine * ((c - image).powi(2) + s * s);
        // Along k_h: -(k_z/kappa) a_z exp(i k_z z) + i a_z exp(-kappa z); and across it.
        let along = (cosine * c).powi(2) + (sine * image - cosine * s).powi(2);
        sums[0] += 0.5 * weight * (1.0 + along);
    }
    sums
}

/// [`blocked_variances`] of a band of the spectrum, over the variance of the whole.
fn band_variances(z_m: f64, outer_scale_m: f64, band: [f64; 2]) -> [f64; 2] {
    let whole = [1e-4 / outer_scale_m, 1e6 / outer_scale_m];
    let integral = |[low, high]: [f64; 2], at_m: Option<f64>| {
        let mut sums = [0.0; 2];
        let steps = 1500;
        let step = (high / low).ln() / f64::from(steps);
        for i in 0..steps {
            let k = low * (step * (f64::from(i) + 0.5)).exp();
            let energy = k * energy_m3_s2(1.0, outer_scale_m, k) * step;
            let ratio = at_m.map_or([1.0; 2], |z_m| blocked_variances(k * z_m));
            sums[0] += ratio[0] * energy;
            sums[1] += ratio[1] * energy;
        }
        sums
    };
    let [variance, _] = integral(whole, None);
    integral(band, Some(z_m)).map(|sum| sum / variance)
}

/// Variances over the ground of seeds, against those of the band.
fn check_blocking(seeds: u64, heights_m: &[f64]) {
    let outer_scale_m = 100.0;
    let band = [0.1 / outer_scale_m, std::f64::consts::TAU / 4.0];
    for &z_m in heights_m {
        let mut values = [Vec::new(), Vec::new()];
        for seed in 0..seeds {
            let field = field(seed).blocked();
            let mut sums = [0.0; 2];
            for i in 0..12 {
                let point_m = [911.0 * f64::from(i), 777.0 * f64::from(i), z_m];
                let [u, v, w] = at(&field, point_m, 0.0);
                sums[0] += 0.5 * (u * u + v * v) / 12.0;
                sums[1] += w * w / 12.0;
            }
            values[0].push(sums[0]);
            values[1].push(sums[1]);
        }
        let variance = 1.0325 * (5e-4 * outer_scale_m).powf(2.0 / 3.0);
        let expected = band_variances(z_m, outer_scale_m, band);
        for (values, expected) in values.iter().zip(expected) {
            let (mean, error, _) = statistics(values);
            assert!(
                (mean / variance - expected).abs() <= 3.0 * error / variance,
                "{z_m} m: {} +- {}, {expected}",
                mean / variance,
                error / variance
            );
        }
    }
}

/// The averages over directions are those of the independent table.
#[test]
fn variances_of_the_whole_spectrum_over_a_blocking_ground_are_those_of_the_table() {
    for row in table("blocking.csv") {
        let whole = [1e-4 / row[0], 1e6 / row[0]];
        if row[1] == 2.0 || row[1] == 40.0 {
            let found = band_variances(row[1], row[0], whole);
            assert_relative_eq!(found[0], row[2], max_relative = 2e-3);
            assert_relative_eq!(found[1], row[3], max_relative = 2e-3);
        }
    }
}

#[test]
fn a_blocking_ground_has_the_variances_of_its_band() {
    check_blocking(24, &[0.0, 2.0, 20.0, 160.0]);
}

#[test]
#[ignore = "400 seeds"]
fn a_blocking_ground_has_the_variances_of_its_band_in_400_seeds() {
    check_blocking(
        400,
        &[0.0, 0.5, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0],
    );
}
