//! The methods beside the fit against the errors that an independent program has of them.

use crate::fixtures::normal;
use ndarray::Array2;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_estimate::retrieval::*;
use wakescope_estimate::vortex_fit::*;

fn mean(numbers: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = numbers.len() as f64;
    numbers.sum::<f64>() / count
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
