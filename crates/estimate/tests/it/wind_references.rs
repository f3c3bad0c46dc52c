//! Gate covariance, winds among bad velocities, dissipation and its deviation against tables of an independent program
//! (`tests/reference/wind`), and the cost of one block.

use std::collections::BTreeMap;

use wakescope_estimate::wind_profile::{
    Block, GateCovariance, GatePosition, GateSample, LEAST_LIKELIHOOD, MixtureFit,
    RadialVelocities, fit_mixture, spectra, turbulence_covariance,
};

/// A table: the name in the first column, and the numbers by their columns.
struct Row {
    name: String,
    numbers: BTreeMap<String, f64>,
}

impl Row {
    fn at(&self, column: &str) -> f64 {
        self.numbers[column]
    }
}

fn rows(table: &str) -> Vec<Row> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/wind");
    let text = std::fs::read_to_string(format!("{folder}/{table}.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut rows = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let mut numbers = BTreeMap::new();
        for (column, cell) in header.iter().zip(&cells) {
            numbers.insert((*column).to_owned(), cell.parse().unwrap_or(f64::NAN));
        }
        rows.push(Row {
            name: cells[0].to_owned(),
            numbers,
        });
    }
    rows
}

fn direction(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let (up, level) = elevation_deg.to_radians().sin_cos();
    [level * sin, level * cos, up]
}

fn covariance_of(gate_std_m: f64, outer_scale_m: f64, a: &GatePosition, b: &GatePosition) -> f64 {
    let covariance = GateCovariance::new(gate_std_m, &[outer_scale_m], 500.0).unwrap();
    let mut value = [0.0];
    covariance.covariance_into(a, b, &mut value);
    value[0]
}

#[test]
fn covariances_of_parallel_gates_are_those_of_the_table_to_a_ten_thousandth() {
    let mut variance = 0.0;
    let mut worst: f64 = 0.0;
    let mut cached: Option<(f64, f64, GateCovariance)> = None;
    for row in rows("gate_covariance") {
        let gate_std_m = row.at("gate_std_m");
        let outer_scale_m = row.at("outer_scale_m");
        let is_cached = cached
            .as_ref()
            .is_some_and(|known| known.0 == gate_std_m && known.1 == outer_scale_m);
        if !is_cached {
            let new = GateCovariance::new(gate_std_m, &[outer_scale_m], 2000.0).unwrap();
            cached = Some((gate_std_m, outer_scale_m, new));
        }
        let (_, _, covariance) = cached.as_ref().unwrap();
        let along = [0.0, 0.0, 1.0];
        let a = GatePosition::new(along, 100.0, 0.0, [0.0; 3]);
        let across_m_s = [-row.at("y_m"), 0.0, 0.0];
        let b = GatePosition::new(along, 100.0 + row.at("s_m"), 1.0, across_m_s);
        let mut value = [0.0];
        covariance.covariance_into(&a, &b, &mut value);
        let expected = row.at("covariance_m2_s2");
        if row.at("s_m") == 0.0 && row.at("y_m") == 0.0 {
            variance = expected;
        }
        let error = (value[0] - expected).abs() / variance;
        worst = worst.max(error);
        assert!(
            error < 1e-4,
            "{gate_std_m} {outer_scale_m} {row:?}: {} {expected}",
            value[0],
            row = row.numbers
        );
    }
    println!("largest error {worst:.1e} of the variance");
}

#[test]
fn covariances_of_gates_in_two_directions_are_those_of_the_table() {
    for row in rows("gate_covariance_wide") {
        let gate = |number: u8| {
            let at = |column: &str| {
                row.at(&format!(
                    "{column}_{number}{}",
                    if column == "range" { "_m" } else { "_deg" }
                ))
            };
            GatePosition::new(
                direction(at("azimuth"), at("elevation")),
                at("range"),
                0.0,
                [0.0; 3],
            )
        };
        let outer_scale_m = row.at("outer_scale_m");
        let gate_std_m = row.at("gate_std_m");
        let found = covariance_of(gate_std_m, outer_scale_m, &gate(1), &gate(2));
        let variance = covariance_of(gate_std_m, outer_scale_m, &gate(1), &gate(1));
        let expected = row.at("covariance_m2_s2");
        assert!(
            (found - expected).abs() < 3e-3 * variance,
            "{found} {expected} of {variance}"
        );
    }
}

fn mixture(name: &str) -> (Option<MixtureFit>, Row) {
    let mut directions = Vec::new();
    let mut velocity_m_s = Vec::new();
    for row in rows("mixture_cells").iter().filter(|row| row.name == name) {
        directions.extend(["e_east", "e_north", "e_up"].map(|column| row.at(column)));
        velocity_m_s.push(row.at("velocity_m_s"));
    }
    let expected = rows("mixture_fit").into_iter().find(|row| row.name == name);
    let expected = expected.unwrap();
    let shape = (velocity_m_s.len(), 3);
    let data = RadialVelocities {
        rows: ndarray::ArrayView2::from_shape(shape, &directions).unwrap(),
        velocity_m_s: &velocity_m_s,
        half_band_m_s: expected.at("nyquist_m_s"),
        folds_m_s: &[],
    };
    (fit_mixture(&data, None).unwrap(), expected)
}

#[test]
fn winds_among_bad_velocities_are_the_best_fits_of_the_table() {
    for name in ["vad24", "vad36"] {
        let (fit, expected) = mixture(name);
        let fit = fit.unwrap();
        for (found, column) in fit.wind_m_s.iter().zip(["east_m_s", "north_m_s", "up_m_s"]) {
            let expected = expected.at(column);
            assert!(
                (found - expected).abs() < 1e-3,
                "{name} {column}: {found} {expected}"
            );
        }
        assert!(
            (fit.std_m_s - expected.at("std_m_s")).abs() < 0.01,
            "{name} {fit:?}"
        );
        assert!(
            (fit.likelihood - expected.at("lambda")).abs() < 0.01,
            "{name} {fit:?}"
        );
        assert!(
            (fit.good() - expected.at("good_cells")).abs() < 0.01,
            "{name} {fit:?}"
        );
        assert!(fit.is_accepted());
    }
}

/// Velocities that repeat after 10 m/s, in noise alone: their band is that of the receiver, whatever is taken for others.
#[test]
fn noise_of_a_narrow_receiver_is_no_wind() {
    let mut directions = Vec::new();
    let mut velocity_m_s = Vec::new();
    for number in 0..72 {
        let (sin, cos) = (0.261_799_4 * f64::from(number % 24)).sin_cos();
        directions.extend([0.5 * sin, 0.5 * cos, 0.866_025_4]);
        let chance = (0.618_033_988 * f64::from(number * number + 7 * number)).fract();
        velocity_m_s.push(10.0 * chance - 5.0);
    }
    let data = RadialVelocities {
        rows: ndarray::ArrayView2::from_shape((72, 3), &directions).unwrap(),
        velocity_m_s: &velocity_m_s,
        half_band_m_s: 10.0,
        folds_m_s: &[10.0; 72],
    };
    let fit = fit_mixture(&data, None).unwrap().unwrap();
    assert!(!fit.is_accepted(), "{fit:?}");
    let fit = fit_mixture(
        &RadialVelocities {
            folds_m_s: &[],
            ..data
        },
        None,
    );
    assert!(fit.unwrap().unwrap().likelihood > 20.0);
}

#[test]
fn noise_is_no_wind() {
    let (fit, _) = mixture("noise24");
    let fit = fit.unwrap();
    assert!(
        fit.likelihood < LEAST_LIKELIHOOD && !fit.is_accepted(),
        "{fit:?}"
    );
}

/// A block of the table. Beams of the scan in elevation that are ten lines apart are just 0.1 rad apart, where the rule for parallel
/// beams ends: the scan is stretched by a millionth of `stretch`, so that they are on one side of it.
fn edr_block(name: &str, carried_m_s: [f64; 3], stretch: f64) -> Block {
    let mut samples = Vec::new();
    for row in rows("edr_cells").iter().filter(|row| row.name == name) {
        let mut e = ["e_east", "e_north", "e_up"].map(|column| row.at(column));
        if name == "rhi" {
            let (up, level) = (e[2].asin() * (1.0 + 1e-6 * stretch)).sin_cos();
            e = [level, 0.0, up];
        }
        samples.push(GateSample {
            time_s: row.at("t_s"),
            direction: e,
            range_m: row.at("range_m"),
            velocity_m_s: row.at("velocity_m_s"),
            noise_std_m_s: 1.0,
        });
    }
    Block::new(&samples, carried_m_s)
}

/// The number of the table is one of two, or between them.
fn is_between(found: [f64; 2], expected: f64, tolerance: f64) -> bool {
    let low = found[0].min(found[1]) - tolerance;
    let high = found[0].max(found[1]) + tolerance;
    (low..=high).contains(&expected)
}

#[test]
fn dissipation_and_noise_are_those_of_the_table_at_each_outer_scale() {
    // `edr_fit` takes the beams of the scan in elevation as parallel: up to 3 % of eps^(2/3), 0.3 of the likelihood.
    let mut all = rows("edr_fit");
    all.retain(|row| row.name != "rhi");
    all.extend(rows("edr_fit_exact"));
    for expected in all {
        let carried_m_s = [
            expected.at("advection_east_m_s"),
            expected.at("advection_north_m_s"),
            0.0,
        ];
        let gate_std_m = expected.at("gate_std_m");
        let outer_scale_m = expected.at("outer_scale_m");
        let covariance = GateCovariance::new(gate_std_m, &[outer_scale_m], 1000.0).unwrap();
        let fits = [-1.0, 1.0].map(|stretch| {
            let blocks = [edr_block(&expected.name, carried_m_s, stretch)];
            let spectrum = spectra(&blocks, &covariance).unwrap().remove(0);
            let columns = blocks[0].len() - spectrum.len();
            assert_eq!(columns, expected.at("mean_columns") as usize);
            let fit = spectrum.maximum().unwrap();
            // A single block shares its eddies with no other; which columns of the mean depend on others is judged in another basis.
            let stated = turbulence_covariance(&blocks, &covariance, outer_scale_m, &fit).unwrap();
            let widening = (stated[0][0] / fit.covariance[0][0]).sqrt();
            assert!((widening - 1.0).abs() < 0.01, "{widening}");
            fit
        });
        let context = format!("{} at {outer_scale_m}: {fits:?}", expected.name);
        let eps23 = expected.at("eps23");
        let noise_m2_s2 = expected.at("noise_variance_m2_s2");
        let std = expected.at("std_eps23");
        let likelihood = expected.at("loglik");
        assert!(
            is_between(fits.map(|fit| fit.eps23), eps23, 5e-3 * eps23),
            "{context}"
        );
        assert!(
            is_between(
                fits.map(|fit| fit.noise_m2_s2),
                noise_m2_s2,
                5e-3 * noise_m2_s2
            ),
            "{context}"
        );
        assert!(
            is_between(fits.map(|fit| fit.likelihood), likelihood, 0.05),
            "{context}"
        );
        assert!(
            is_between(fits.map(|fit| fit.covariance[0][0].sqrt()), std, 0.01 * std),
            "{context}"
        );
    }
}

#[test]
fn deviations_of_lines_that_share_eddies_are_those_of_the_table() {
    for row in rows("edr_stated") {
        let mut blocks = Vec::new();
        for line in 0..row.at("lines") as usize {
            let mut samples = Vec::new();
            for gate in 0..row.at("gates") as usize {
                samples.push(GateSample {
                    time_s: row.at("dt_s") * line as f64,
                    direction: [0.0, 0.0, 1.0],
                    range_m: 200.0 + row.at("gate_step_m") * gate as f64,
                    velocity_m_s: if (gate + line) % 2 == 0 { 0.1 } else { -0.1 },
                    noise_std_m_s: 1.0,
                });
            }
            blocks.push(Block::new(&samples, [row.at("wind_m_s"), 0.0, 0.0]));
        }
        let outer_scale_m = row.at("outer_scale_m");
        let covariance =
            GateCovariance::new(row.at("gate_std_m"), &[outer_scale_m], 700.0).unwrap();
        let mut fit = spectra(&blocks, &covariance).unwrap()[0].maximum().unwrap();
        fit.eps23 = row.at("eps_m2_s3").powf(2.0 / 3.0);
        fit.noise_m2_s2 = row.at("noise_m_s").powi(2);
        let stated = turbulence_covariance(&blocks, &covariance, outer_scale_m, &fit).unwrap();
        let found = stated[0][0].sqrt();
        let expected = row.at("std_stated");
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
    }
}

/// `cargo test --release -p wakescope-estimate --test it -- --ignored cost_of_a_block --nocapture`: 0.15 s at most for one outer scale.
#[test]
#[ignore = "prints a time"]
fn cost_of_a_block_of_512_velocities() {
    let mut samples = Vec::new();
    for line in 0..32 {
        for gate in 0..16 {
            samples.push(GateSample {
                time_s: f64::from(line),
                direction: [0.0, 0.0, 1.0],
                range_m: 200.0 + 30.0 * f64::from(gate),
                velocity_m_s: f64::from(line * 7 + gate * 3).sin(),
                noise_std_m_s: 1.0,
            });
        }
    }
    let blocks = [Block::new(&samples, [8.0, 0.0, 0.0])];
    let start = std::time::Instant::now();
    let covariance = GateCovariance::new(14.36, &[100.0], 700.0).unwrap();
    println!("table {:?}", start.elapsed());
    let start = std::time::Instant::now();
    let found = spectra(&blocks, &covariance).unwrap();
    println!("block {:?}, {} contrasts", start.elapsed(), found[0].len());
}

#[test]
fn velocities_of_two_nyquist_intervals_are_fitted_each_in_its_own() {
    let wind_m_s = [12.0, 0.5];
    let mut rows = Vec::new();
    let mut velocity_m_s = Vec::new();
    let mut folds_m_s = Vec::new();
    for line in 0..60_u32 {
        let (up, along) = (4e-3 * f64::from(line / 2)).sin_cos();
        let fold_m_s = [19.375, f64::INFINITY][line as usize % 2];
        let velocity = along * wind_m_s[0] + up * wind_m_s[1];
        rows.extend([along, up]);
        velocity_m_s.push(match line % 2 {
            0 => velocity - fold_m_s * (velocity / fold_m_s).round(),
            _ => velocity,
        });
        folds_m_s.push(fold_m_s);
    }
    let mut data = RadialVelocities {
        rows: ndarray::ArrayView2::from_shape((60, 2), &rows).unwrap(),
        velocity_m_s: &velocity_m_s,
        half_band_m_s: 20.0,
        folds_m_s: &folds_m_s,
    };
    let fit = fit_mixture(&data, None).unwrap().unwrap();
    for (found, expected) in fit.wind_m_s.iter().zip(wind_m_s) {
        assert!((found - expected).abs() < 1e-9, "{:?}", fit.wind_m_s);
    }
    assert!(fit.good() > 59.0);
    // As if nothing repeated, half of the velocities are bad.
    data.folds_m_s = &[];
    let without = fit_mixture(&data, None).unwrap().unwrap();
    assert!(without.good() < 31.0);
    data.folds_m_s = &folds_m_s[..59];
    assert!(fit_mixture(&data, None).is_err());
}
