//! Scans of known wakes, their noise, and how far fits of them are from the truth.

use crate::fixtures::normal;
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;

/// A stored scan, noisy and exact.
pub(crate) fn stored(text: &str) -> (ScanMap, Array2<f64>) {
    let number = |cell: &str| {
        if cell.is_empty() {
            f64::NAN
        } else {
            cell.parse().unwrap()
        }
    };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| line.split(',').map(number).collect())
        .collect();
    let mut elevation_rad: Vec<f64> = rows.iter().map(|row| row[1]).collect();
    let gates = elevation_rad
        .iter()
        .take_while(|e| **e == elevation_rad[0])
        .count();
    elevation_rad = elevation_rad.into_iter().step_by(gates).collect();
    let column = |i: usize| {
        Array2::from_shape_vec(
            (elevation_rad.len(), gates),
            rows.iter().map(|row| row[i]).collect(),
        )
        .unwrap()
    };
    let map = ScanMap {
        time_s: column(2).column(0).to_vec(),
        range_m: column(0).row(0).to_vec(),
        velocity_m_s: column(3),
        sigma_m_s: Some(column(4)),
        fold_m_s: None,
        elevation_rad: elevation_rad.clone(),
    };
    (map, column(5))
}

/// Parameters of a wake in wind and shear, without a logarithmic part.
pub(crate) const STRAIGHT: usize = Parameter::LogWind as usize;

/// A stored scan with what is known of it.
pub(crate) struct Case {
    pub(crate) map: ScanMap,
    pub(crate) exact: Array2<f64>,
    pub(crate) truth: Wake,
    /// Bounds of all parameters in a straight wind.
    pub(crate) bound: [f64; STRAIGHT],
    pub(crate) options: RetrievalOptions,
}

macro_rules! reference {
    ($name:literal) => {
        include_str!(concat!(
            "../../../../tests/reference/estimate/",
            $name,
            ".csv"
        ))
    };
}

pub(crate) use reference;

/// `a`, `b` or `c`.
pub(crate) fn case(name: &str) -> Case {
    let (text, std_m, truth, bound) = match name {
        "a" => (
            reference!("map_a"),
            0.0,
            [
                500.0, 500.0, 376.5, 60.0, 423.5, 60.0, 2.35, 2.35, 2.0, 0.0, 0.0,
            ],
            [
                3.43065, 3.74845, 0.0489695, 0.0256673, 0.0416861, 0.0288482, 0.0389447, 0.0512751,
                0.0340653, 5.42644e-4,
            ],
        ),
        "b" => (
            reference!("map_b"),
            15.0,
            [
                300.0, 300.0, 381.0, 40.0, 419.0, 40.0, 3.0, 3.0, -4.0, 0.03, 0.0,
            ],
            [
                8.82252,
                9.44185,
                0.548307,
                0.107213,
                0.702118,
                0.140685,
                0.20766,
                0.267131,
                0.0463667,
                0.000901482,
            ],
        ),
        _ => (
            reference!("map_c"),
            10.0,
            [
                420.0, 340.0, 380.0, 48.0, 424.0, 38.0, 2.5, 2.5, 3.0, 0.02, 0.0,
            ],
            [
                3.64935,
                3.73507,
                0.146386,
                0.0471245,
                0.18953,
                0.0591762,
                0.0849975,
                0.109539,
                0.031468,
                0.000530674,
            ],
        ),
    };
    let (map, exact) = stored(text);
    let gate = if std_m > 0.0 {
        Gate::Gaussian { std_m }
    } else {
        Gate::Point
    };
    // those of a and b stand still although their lines have times
    let movement = if name == "c" {
        Movement::Moving
    } else {
        Movement::Frozen
    };
    let mut options = RetrievalOptions {
        gate,
        movement,
        ..Default::default()
    };
    // as the bounds
    options.free.wind = WindFit::Linear;
    Case {
        map,
        exact,
        truth: Wake::from_array(&truth),
        bound,
        options,
    }
}

/// Errors, stated deviations and chi-squares per degree of many fits.
pub(crate) struct Scatter {
    pub(crate) errors: Vec<[f64; PARAMETERS]>,
    pub(crate) stated: Vec<[f64; PARAMETERS]>,
    pub(crate) chi2: Vec<f64>,
    /// Scans in which not both vortices were found.
    pub(crate) failed: Vec<(u64, ScanResult)>,
}

pub(crate) fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = numbers.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

impl Scatter {
    /// Of a number of scans made by `draw` from the exact one.
    pub(crate) fn of(
        case: &Case,
        draws: u64,
        draw: impl Fn(&Case, &mut Xoshiro256PlusPlus) -> Array2<f64>,
    ) -> Self {
        let mut scatter = Self {
            errors: vec![],
            stated: vec![],
            chi2: vec![],
            failed: vec![],
        };
        for seed in 0..draws {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
            let map = ScanMap {
                velocity_m_s: draw(case, &mut rng),
                ..case.map.clone()
            };
            let found = fit_scan(&map, Velocities::Means, &case.options).unwrap();
            if found.vortices.len() < 2 {
                scatter.failed.push((seed, found));
                continue;
            }
            let wake = found.wake.unwrap().to_array();
            let truth = case.truth.to_array();
            scatter
                .errors
                .push(std::array::from_fn(|i| wake[i] - truth[i]));
            scatter
                .stated
                .push(std::array::from_fn(|i| found.covariance[[i, i]].sqrt()));
            scatter.chi2.push(found.chi2_per_dof);
        }
        scatter
    }

    /// Mean, standard deviation and mean stated deviation of a parameter.
    pub(crate) fn numbers(&self, i: usize) -> (f64, f64, f64) {
        let bias = mean(self.errors.iter().map(|e| e[i]));
        let count = self.errors.len() as f64;
        let variance =
            mean(self.errors.iter().map(|e| (e[i] - bias).powi(2))) * count / (count - 1.0);
        (
            bias,
            variance.sqrt(),
            mean(self.stated.iter().map(|s| s[i])),
        )
    }

    /// Bias in standard errors, scatter over the bound, stated deviation over scatter of each parameter, in words; and whether the bias is
    /// within 3.5 errors, the scatter within `above` bounds and the stated deviation within `off` of it, but for what chance allows.
    pub(crate) fn told(
        &self,
        name: &str,
        bound: &[f64; STRAIGHT],
        (above, off): (f64, f64),
    ) -> (String, bool) {
        let count = self.errors.len() as f64;
        let chance = 3.0 / (2.0 * count).sqrt();
        let mut told = format!(
            "{name}: chi2 per degree {:.3}\n",
            mean(self.chi2.iter().copied())
        );
        for (seed, found) in &self.failed {
            told += &format!("  scan {seed}: {:?} {:?}\n", found.flags, found.vortices);
        }
        let mut holds = self.failed.len() as f64 <= 0.05 * count;
        for (i, bound) in bound.iter().enumerate() {
            let (bias, std, stated) = self.numbers(i);
            let errors = bias / std * count.sqrt();
            told += &format!(
                "  {i}: bias {bias:.4} = {errors:.1} errors, scatter {std:.4} = {:.3} bounds, stated/scatter {:.3}\n",
                std / bound,
                stated / std
            );
            holds &= errors.abs() < 3.5
                && std / bound < above + chance
                && (stated / std - 1.0).abs() < off + chance;
        }
        (told, holds)
    }
}

/// White noise with the deviations of the map.
pub(crate) fn white(case: &Case, rng: &mut Xoshiro256PlusPlus) -> Array2<f64> {
    let sigma = case.map.sigma_m_s.as_ref().unwrap();
    Array2::from_shape_fn(case.exact.dim(), |at| {
        case.exact[at] + sigma[at] * normal(rng)
    })
}

/// The same with 5 % of the velocities anywhere in the band.
pub(crate) fn with_outliers(case: &Case, rng: &mut Xoshiro256PlusPlus) -> Array2<f64> {
    white(case, rng).mapv(|v| {
        if rng.random::<f64>() < 0.05 {
            -19.0 + 38.0 * rng.random::<f64>()
        } else {
            v
        }
    })
}

/// Factor of the covariance of turbulence at the cells of a map.
pub(crate) fn turbulence_factor(map: &ScanMap, deviation_m_s: f64, length_m: f64) -> Vec<Vec<f64>> {
    let places: Vec<(f64, f64)> = map
        .velocity_m_s
        .indexed_iter()
        .map(|((line, gate), _)| {
            let (sin, cos) = map.elevation_rad[line].sin_cos();
            (map.range_m[gate] * cos, map.range_m[gate] * sin)
        })
        .collect();
    let mut rows: Vec<Vec<f64>> = vec![];
    for (i, a) in places.iter().enumerate() {
        let mut row: Vec<f64> = Vec::with_capacity(i + 1);
        for (k, b) in places.iter().enumerate().take(i + 1) {
            let c = deviation_m_s.powi(2) * (-(a.0 - b.0).hypot(a.1 - b.1) / length_m).exp();
            let above = if k < i { &rows[k] } else { &row };
            let dot: f64 = row[..k].iter().zip(&above[..k]).map(|(x, y)| x * y).sum();
            let entry = if k < i {
                (c - dot) / rows[k][k]
            } else {
                (c - dot).sqrt()
            };
            row.push(entry);
        }
        rows.push(row);
    }
    rows
}

/// Every second line of a case.
pub(crate) fn thinned(case: Case) -> Case {
    let keep = |a: &Array2<f64>| a.slice(ndarray::s![..;2, ..]).to_owned();
    let axis = |a: &[f64]| a.iter().copied().step_by(2).collect::<Vec<f64>>();
    let map = ScanMap {
        elevation_rad: axis(&case.map.elevation_rad),
        time_s: axis(&case.map.time_s),
        velocity_m_s: keep(&case.map.velocity_m_s),
        sigma_m_s: case.map.sigma_m_s.as_ref().map(keep),
        ..case.map
    };
    Case {
        exact: keep(&case.exact),
        map,
        ..case
    }
}

/// A vortex's circulation, place and core, where they are measured.
pub(crate) fn numbers(vortex: &VortexResult) -> [Measured; 4] {
    let core = vortex.core_radius_m.unwrap();
    [
        vortex.circulation_m2_s,
        vortex.lateral_position_m,
        vortex.height_m,
        core,
    ]
}

/// Errors in units of the bound at the lines of the cores.
pub(crate) fn errors_over_bounds(case: &Case, found: &ScanResult) -> Vec<f64> {
    let (p, bound) = (case.truth.to_array(), case.bound);
    let velocities = WakeModel::default().centre_velocities_m_s(&case.truth);
    let mut errors = vec![];
    for (vortex, places, motion) in [
        (
            found.vortex(Side::Left).unwrap(),
            [0, 2, 3, 6],
            &velocities[..2],
        ),
        (
            found.vortex(Side::Right).unwrap(),
            [1, 4, 5, 7],
            &velocities[2..],
        ),
    ] {
        // the truth of the moving one holds at time 0
        let seconds = if case.options.movement == Movement::Moving {
            vortex.time_s
        } else {
            0.0
        };
        let moved = [0.0, seconds * motion[0], seconds * motion[1], 0.0];
        for ((number, place), moved) in numbers(vortex).iter().zip(places).zip(moved) {
            errors.push((number.value - p[place] - moved) / bound[place]);
        }
    }
    errors.push((found.lateral_wind_m_s.value - p[8]) / bound[8]);
    errors.push((found.wind_shear_per_s.value - p[9]) / bound[9]);
    errors
}

/// A scan of a wake with white noise of 0.5 m/s; lines and gates are (first, step, count).
pub(crate) fn noisy(
    wake: &Wake,
    options: &RetrievalOptions,
    lines: (f64, f64, u32),
    gates: (f64, f64, u32),
    seed: u64,
) -> ScanMap {
    let axis = |(first, step, count): (f64, f64, u32)| -> Vec<f64> {
        (0..count).map(|i| first + step * f64::from(i)).collect()
    };
    let (elevation_rad, range_m) = (axis(lines), axis(gates));
    let std_m = if let Gate::Gaussian { std_m } = options.gate {
        std_m
    } else {
        0.0
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let velocity_m_s =
        Array2::from_shape_fn((elevation_rad.len(), range_m.len()), |(line, gate)| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for i in -40..=40 {
                let away = f64::from(i) / 10.0;
                let weight = (-0.5 * away * away).exp();
                weights += weight;
                sum += weight
                    * options.model.radial_velocity_m_s(
                        wake,
                        range_m[gate] + away * std_m,
                        elevation_rad[line],
                    );
            }
            sum / weights + 0.5 * normal(&mut rng)
        });
    let sigma_m_s = Some(Array2::from_elem(velocity_m_s.dim(), 0.5));
    let time_s = vec![f64::NAN; elevation_rad.len()];
    ScanMap {
        elevation_rad,
        time_s,
        range_m,
        velocity_m_s,
        sigma_m_s,
        fold_m_s: None,
    }
}
