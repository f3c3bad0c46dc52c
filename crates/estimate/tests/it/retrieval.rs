//! Fits of scans against references of independent origin.

use crate::fixtures::normal;
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;

/// A stored scan, noisy and exact.
fn stored(text: &str) -> (ScanMap, Array2<f64>) {
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| line.split(',').map(number).collect())
        .collect();
    let mut elevation_rad: Vec<f64> = rows.iter().map(|row| row[1]).collect();
    let gates = elevation_rad.iter().take_while(|e| **e == elevation_rad[0]).count();
    elevation_rad = elevation_rad.into_iter().step_by(gates).collect();
    let column = |i: usize| {
        Array2::from_shape_vec((elevation_rad.len(), gates), rows.iter().map(|row| row[i]).collect()).unwrap()
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

/// A stored scan with what is known of it.
struct Case {
    map: ScanMap,
    exact: Array2<f64>,
    truth: Wake,
    /// Bounds of all ten parameters.
    bound: [f64; PARAMETERS],
    options: RetrievalOptions,
}

macro_rules! reference {
    ($name:literal) => {
        include_str!(concat!("../../../../tests/reference/estimate/", $name, ".csv"))
    };
}

/// `a`, `b` or `c`.
fn case(name: &str) -> Case {
    let (text, std_m, truth, bound) = match name {
        "a" => (
            reference!("map_a"),
            0.0,
            [500.0, 500.0, 376.5, 60.0, 423.5, 60.0, 2.35, 2.35, 2.0, 0.0],
            [
                3.43065,
                3.74845,
                0.0489695,
                0.0256673,
                0.0416861,
                0.0288482,
                0.0389447,
                0.0512751,
                0.0340653,
                0.000542644,
            ],
        ),
        "b" => (
            reference!("map_b"),
            15.0,
            [300.0, 300.0, 381.0, 40.0, 419.0, 40.0, 3.0, 3.0, -4.0, 0.03],
            [8.82252, 9.44185, 0.548307, 0.107213, 0.702118, 0.140685, 0.20766, 0.267131, 0.0463667, 0.000901482],
        ),
        _ => (
            reference!("map_c"),
            10.0,
            [420.0, 340.0, 380.0, 48.0, 424.0, 38.0, 2.5, 2.5, 3.0, 0.02],
            [3.64935, 3.73507, 0.146386, 0.0471245, 0.18953, 0.0591762, 0.0849975, 0.109539, 0.031468, 0.000530674],
        ),
    };
    let (map, exact) = stored(text);
    let gate = if std_m > 0.0 { Gate::Gaussian { std_m } } else { Gate::Point };
    // those of a and b stand still although their lines have times
    let movement = if name == "c" { Movement::Moving } else { Movement::Frozen };
    let options = RetrievalOptions { gate, movement, ..Default::default() };
    Case { map, exact, truth: Wake::from_array(&truth), bound, options }
}

/// Errors, stated deviations and chi-squares per degree of many fits.
struct Scatter {
    errors: Vec<[f64; PARAMETERS]>,
    stated: Vec<[f64; PARAMETERS]>,
    chi2: Vec<f64>,
    /// Scans in which not both vortices were found.
    failed: Vec<(u64, ScanResult)>,
}

fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = numbers.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

impl Scatter {
    /// Of so many scans made by `draw` from the exact one.
    fn of(case: &Case, draws: u64, draw: impl Fn(&Case, &mut Xoshiro256PlusPlus) -> Array2<f64>) -> Self {
        let mut scatter = Self { errors: vec![], stated: vec![], chi2: vec![], failed: vec![] };
        for seed in 0..draws {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
            let map = ScanMap { velocity_m_s: draw(case, &mut rng), ..case.map.clone() };
            let found = fit_scan(&map, &case.options).unwrap();
            if found.vortices.len() < 2 {
                scatter.failed.push((seed, found));
                continue;
            }
            let wake = found.wake.unwrap().to_array();
            let truth = case.truth.to_array();
            scatter.errors.push(std::array::from_fn(|i| wake[i] - truth[i]));
            scatter.stated.push(std::array::from_fn(|i| found.covariance[[i, i]].sqrt()));
            scatter.chi2.push(found.chi2_per_dof);
        }
        scatter
    }

    /// Mean, standard deviation and mean stated deviation of a parameter.
    fn numbers(&self, i: usize) -> (f64, f64, f64) {
        let bias = mean(self.errors.iter().map(|e| e[i]));
        let count = self.errors.len() as f64;
        let variance = mean(self.errors.iter().map(|e| (e[i] - bias).powi(2))) * count / (count - 1.0);
        (bias, variance.sqrt(), mean(self.stated.iter().map(|s| s[i])))
    }

    /// Prints bias in standard errors, scatter over the bound, stated deviation over scatter.
    fn print(&self, name: &str, bound: &[f64; PARAMETERS]) {
        let count = self.errors.len() as f64;
        for (seed, found) in &self.failed {
            println!("scan {seed}: {:?} T {} {:?}", found.flags, found.statistic, found.vortices);
        }
        println!("{name}: chi2 per degree {:.3}", mean(self.chi2.iter().copied()));
        for i in 0..PARAMETERS {
            let (bias, std, stated) = self.numbers(i);
            println!(
                "  {i}: bias {bias:.4} = {:.1} errors, scatter {std:.4} = {:.3} bounds, stated/scatter {:.3}",
                bias / std * count.sqrt(),
                std / bound[i],
                stated / std
            );
        }
    }
}

/// White noise with the deviations of the map.
fn white(case: &Case, rng: &mut Xoshiro256PlusPlus) -> Array2<f64> {
    let sigma = case.map.sigma_m_s.as_ref().unwrap();
    Array2::from_shape_fn(case.exact.dim(), |at| case.exact[at] + sigma[at] * normal(rng))
}

/// The same with 5 % of the velocities anywhere in the band.
fn with_outliers(case: &Case, rng: &mut Xoshiro256PlusPlus) -> Array2<f64> {
    white(case, rng).mapv(|v| if rng.random::<f64>() < 0.05 { -19.0 + 38.0 * rng.random::<f64>() } else { v })
}

/// Factor of the covariance of turbulence at the cells of a map.
fn turbulence_factor(map: &ScanMap, deviation_m_s: f64, length_m: f64) -> Vec<Vec<f64>> {
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
            let entry = if k < i { (c - dot) / rows[k][k] } else { (c - dot).sqrt() };
            row.push(entry);
        }
        rows.push(row);
    }
    rows
}

/// Every second line of a case.
fn thinned(case: Case) -> Case {
    let keep = |a: &Array2<f64>| a.slice(ndarray::s![..;2, ..]).to_owned();
    let axis = |a: &[f64]| a.iter().copied().step_by(2).collect::<Vec<f64>>();
    let map = ScanMap {
        elevation_rad: axis(&case.map.elevation_rad),
        time_s: axis(&case.map.time_s),
        velocity_m_s: keep(&case.map.velocity_m_s),
        sigma_m_s: case.map.sigma_m_s.as_ref().map(keep),
        ..case.map
    };
    Case { exact: keep(&case.exact), map, ..case }
}

#[test]
#[ignore = "minutes: scatter over 100 scans of each reference"]
fn scatter_over_many_scans() {
    let draws = 100;
    for name in ["a", "b", "c"] {
        let case = case(name);
        let scatter = Scatter::of(&case, draws, white);
        scatter.print(name, &case.bound);
    }
    let case_a = case("a");
    let squares = Case {
        options: RetrievalOptions { loss: Loss::Squares, covariance: Covariance::Model, ..Default::default() },
        ..case("a")
    };
    Scatter::of(&squares, draws, white).print("a, least squares, covariance of the model", &squares.bound);
    Scatter::of(&case_a, draws, with_outliers).print("a, 5 % outliers", &case_a.bound);
    let mut still = case("c");
    still.options.movement = Movement::Frozen;
    Scatter::of(&still, 25, white).print("c, frozen", &still.bound);
}

#[test]
#[ignore = "minutes: scatter over 100 scans with turbulence"]
fn scatter_in_turbulence() {
    let mut case = thinned(case("a"));
    case.map.sigma_m_s.as_mut().unwrap().fill(0.3);
    let factor = turbulence_factor(&case.map, 1.2, 25.0);
    let draw = |case: &Case, rng: &mut Xoshiro256PlusPlus| {
        let numbers: Vec<f64> = factor.iter().map(|_| normal(rng)).collect();
        let mut velocity = white(case, rng);
        for (v, row) in velocity.iter_mut().zip(&factor) {
            *v += row.iter().zip(&numbers).map(|(l, x)| l * x).sum::<f64>();
        }
        velocity
    };
    case.options.movement = Movement::Frozen;
    Scatter::of(&case, 100, draw).print("a in turbulence, sandwich", &case.bound);
    case.options.turbulence = Some(Turbulence { deviation_m_s: 1.2, length_m: 25.0 });
    Scatter::of(&case, 100, draw).print("a in turbulence, whitened", &case.bound);
    case.options.covariance = Covariance::Model;
    Scatter::of(&case, 30, draw).print("a in turbulence, whitened, covariance of the model", &case.bound);
}

#[test]
fn explore() {
    let maps = [
        (include_str!("../../../../tests/reference/estimate/map_a.csv"), 0.0),
        (include_str!("../../../../tests/reference/estimate/map_b.csv"), 15.0),
        (include_str!("../../../../tests/reference/estimate/map_c.csv"), 10.0),
        (include_str!("../../../../tests/reference/estimate/map_one.csv"), 0.0),
        (include_str!("../../../../tests/reference/estimate/map_noise.csv"), 0.0),
    ];
    for (text, std_m) in maps {
        let (mut map, exact) = stored(text);
        for exactly in [false, true] {
            if exactly {
                map.velocity_m_s = exact.clone();
            }
            for movement in [Movement::Frozen, Movement::Auto] {
                let gate = if std_m > 0.0 { Gate::Gaussian { std_m } } else { Gate::Point };
                let options = RetrievalOptions { gate, movement, ..Default::default() };
                let start = std::time::Instant::now();
                let found = fit_scan(&map, &options).unwrap();
                println!("exact {exactly} {movement:?} {:?}", start.elapsed());
                if let Some(wake) = found.wake {
                    for (i, p) in wake.to_array().iter().enumerate() {
                        print!("{p:.5} +- {:.5}; ", found.covariance[[i, i]].sqrt());
                    }
                }
                println!(
                    "\n{:.3} T {:.1} used {} rejected {} {:?} {} tops",
                    found.chi2_per_dof,
                    found.statistic,
                    found.cells_used,
                    found.cells_rejected,
                    found.flags,
                    found.tops.len()
                );
            }
        }
    }
}

/// Velocities of a wake at 400 m on lines of 3 mrad and gates of 4 m, without noise.
fn made_up(wake: &Wake, std_m: f64) -> ScanMap {
    let elevation_rad: Vec<f64> = (0..95).map(|i| 0.003 * f64::from(i)).collect();
    let range_m: Vec<f64> = (0..41).map(|i| 320.0 + 4.0 * f64::from(i)).collect();
    let model = WakeModel::default();
    let weights: Vec<(f64, f64)> =
        (-210..=210).map(|i| (f64::from(i) / 60.0 * std_m, (-0.5 * (f64::from(i) / 60.0_f64).powi(2)).exp())).collect();
    let sum: f64 = weights.iter().map(|(_, w)| w).sum();
    let velocity_m_s = Array2::from_shape_fn((elevation_rad.len(), range_m.len()), |(line, gate)| {
        let seen = |(offset_m, w): &(f64, f64)| {
            w / sum * model.radial_velocity_m_s(wake, range_m[gate] + offset_m, elevation_rad[line])
        };
        weights.iter().map(seen).sum()
    });
    ScanMap { time_s: vec![0.0; 95], elevation_rad, range_m, velocity_m_s, sigma_m_s: None, fold_m_s: None }
}

#[test]
fn radial_velocities_have_the_errors_of_the_stored_table() {
    for z in [0.4, 0.6, 1.0, 1.5] {
        let height_m = 47.0 * z;
        let wake = Wake::from_array(&[400.0, 400.0, 376.5, height_m, 423.5, height_m, 2.35, 2.35, 0.0, 0.0]);
        let mut map = made_up(&wake, 15.0);
        map.sigma_m_s = Some(Array2::from_elem(map.velocity_m_s.dim(), 0.5));
        for images in [false, true] {
            let options = RetrievalOptions {
                model: WakeModel { images, ..Default::default() },
                gate: Gate::Gaussian { std_m: 15.0 },
                movement: Movement::Frozen,
                core_radius_m: Some(2.35),
                ..Default::default()
            };
            for found in [radial_velocity_method(&map, &options).unwrap(), fit_scan(&map, &options).unwrap()] {
                let e = |s| {
                    found.vortex(s).map(|v| {
                        (100.0 * (v.circulation_m2_s.value / 400.0 - 1.0), v.lateral_position_m.value, v.height_m.value)
                    })
                };
                println!("{z} {images} {:?} {:?} {:?}", e(Side::Left), e(Side::Right), found.flags);
            }
        }
    }
}

/// 200 ns, 1.55 um, 50 MHz, a window of 64 ns.
fn shape() -> SpectralShape {
    SpectralShape::gaussian(120.112e-9, 64e-9, 1.55e-6, 50e6).unwrap()
}

/// Spectra of lines 0.5 m apart at the core's gate, as expected or scattered as means of so many pulses.
fn spectra(
    wake: &Wake,
    model: &WakeModel,
    snr: f64,
    pulses: Option<(u32, &mut Xoshiro256PlusPlus)>,
    step_m: f64,
) -> (Vec<f64>, Vec<f64>, ndarray::Array3<f64>) {
    let shape = shape();
    let centre = wake.right.height_m / 400.0;
    let count = (15.0 / step_m) as i32;
    let elevation_rad: Vec<f64> = (-count..=count).map(|i| centre + f64::from(i) * step_m / 400.0).collect();
    let velocity_m_s: Vec<f64> = (-193..=193).map(|i| 0.1 * f64::from(i)).collect();
    let weights: Vec<(f64, f64)> =
        (-350..=350).map(|i| 0.01 * f64::from(i)).map(|u| (u * shape.gate_std_m, (-0.5 * u * u).exp())).collect();
    let sum: f64 = weights.iter().map(|w| w.1).sum();
    let mut power = ndarray::Array3::from_shape_fn((elevation_rad.len(), 1, velocity_m_s.len()), |(line, _, cell)| {
        let air = |(offset, w): &(f64, f64)| {
            let v = model.radial_velocity_m_s(wake, 400.0 + offset, elevation_rad[line]);
            w / sum * (-((velocity_m_s[cell] - v) / shape.width_m_s).powi(2)).exp()
        };
        1.0 + snr * shape.band_m_s / (shape.width_m_s * std::f64::consts::PI.sqrt())
            * weights.iter().map(air).sum::<f64>()
    });
    if let Some((pulses, rng)) = pulses {
        // cells as wide as the resolution scatter alone; between them straight lines
        let every = 15;
        for mut row in power.rows_mut() {
            let factor: Vec<f64> = (0..=row.len() / every + 1)
                .map(|_| (0..2 * pulses).map(|_| normal(rng).powi(2)).sum::<f64>() / f64::from(2 * pulses))
                .collect();
            for (i, p) in row.iter_mut().enumerate() {
                let part = (i % every) as f64 / every as f64;
                *p *= factor[i / every] * (1.0 - part) + factor[i / every + 1] * part;
            }
        }
    }
    (elevation_rad, velocity_m_s, power)
}

#[test]
fn envelopes_have_the_errors_of_the_stored_table_and_their_inversion_has_none() {
    assert!((shape().width_m_s - 2.18).abs() < 0.01 && (shape().gate_std_m - 14.4).abs() < 0.1);
    let model = WakeModel { images: false, ..Default::default() };
    let wake = Wake::from_array(&[0.0, 400.0, -1000.0, 60.0, 395.474, 60.0, 2.35, 2.35, 0.0, 0.0]);
    for (db, rows) in [
        (0.0, [(1.5, 43.0, -20.0), (2.0, 33.0, -23.0), (3.0, 16.0, -30.0)]),
        (5.0, [(1.5, 57.0, -18.0), (2.0, 49.0, -19.0), (3.0, 40.0, -21.0)]),
        (10.0, [(1.5, 69.0, -16.0), (2.0, 62.0, -17.0), (3.0, 55.0, -18.0)]),
    ] {
        let snr = 10.0_f64.powf(0.1 * db);
        let (elevation_rad, velocity_m_s, power) = spectra(&wake, &model, snr, None, 0.5);
        let spectra = ScanSpectra {
            elevation_rad: &elevation_rad,
            range_m: &[400.0],
            velocity_m_s: &velocity_m_s,
            power: power.view(),
            snr,
        };
        for (threshold, raw, narrowed) in rows {
            let [_, found] = velocity_envelopes(&spectra, &shape(), &model, &wake, threshold).unwrap();
            let truth = 400.0 * CoreProfile::Algebraic.mean_5_15(2.35).0;
            let per_cent = |x: f64| 100.0 * (x / truth - 1.0);
            println!(
                "{db} {threshold}: {:.1} {raw} {:.1} {narrowed} {:.2} {} {}",
                per_cent(found.raw_m2_s),
                per_cent(found.narrowed_m2_s),
                per_cent(found.inverted_m2_s.value),
                found.lines,
                found.left_out
            );
        }
    }
}

#[test]
fn integrals_lose_what_the_stored_table_says_and_their_correction_gives_it_back() {
    let wake = Wake::from_array(&[400.0, 400.0, 376.5, 60.0, 423.5, 60.0, 2.35, 2.35, 0.0, 0.0]);
    let radii: Vec<f64> = (0..=20).map(|i| 5.0 + 0.5 * f64::from(i)).collect();
    let truth = 400.0 * CoreProfile::Algebraic.mean_5_15(2.35).0;
    for (std_m, across, around) in
        [(0.0, -5.0, -0.5), (3.0, -13.0, -4.0), (6.0, -26.0, -17.0), (10.0, -40.0, -36.0), (15.0, -54.0, -53.0)]
    {
        let map = made_up(&wake, std_m);
        let options = RetrievalOptions { gate: Gate::Gaussian { std_m }, ..Default::default() };
        for side in [Side::Left, Side::Right] {
            let profile = circulation_profile(&map, &wake, side, &radii, &options).unwrap();
            let per_cent = |of: fn(&ProfilePoint) -> f64| 100.0 * (mean(profile.iter().map(of)) / truth - 1.0);
            println!(
                "{std_m} {:.1} {across} {:.1} {around} {:.2} {:.2}",
                per_cent(|p| p.across_m2_s),
                per_cent(|p| p.around_m2_s),
                per_cent(|p| p.across_corrected_m2_s),
                per_cent(|p| p.around_corrected_m2_s)
            );
        }
    }
}
