//! One flight: its scene measured, and the rows that it has in the arrays of the data set.
//!
//! Check: the rows of flights against `wakescope run` of their scenes, `tests/it/dataset.rs`.

use super::plan::{DatasetPlan, Flight};
use super::schema::{self, Shape, name_of_key};
use crate::Error;
use crate::io::zarr::Array;
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::recorded::{GateSpectra, PredictedError};
use crate::measure::region::places;
use crate::measure::scan::Scanner;
use crate::plan::wind::{SceneWind, mean_winds, vortex_pair};
use crate::plan::{Plan, Target};
use crate::progress::Silent;
use crate::retrieve::truth::{is_there, true_vortices};
use crate::run::ScanMiddle;
use crate::scene::{Detector, Scan, SceneFile, SnrReference, hash_of};
use crate::sweep::Common;
use ndarray::Array2;
use std::collections::BTreeMap;
use std::sync::Arc;
use wakescope_estimate::retrieval::VortexResult;
use wakescope_les::Wind as _;

/// Numbers of a flight by the names of their arrays.
type Numbers = BTreeMap<String, Vec<f64>>;

/// The plan of a flight. Winds are not shared: each flight has its own.
///
/// # Errors
/// As [`Plan::new`].
pub(super) fn planned(scene: &SceneFile, common: &Common) -> Result<Plan, Error> {
    let wind = Arc::new(SceneWind::new(scene)?);
    Plan::sharing(scene.clone(), Target::Map, wind, &common.efficiencies)
}

/// Measures a flight, and packs what its arrays hold: the index of each array, and the bytes of its row.
///
/// # Errors
/// What a run refuses; a checked plan gives none.
pub(super) fn rows(
    of: &DatasetPlan,
    flight: &Flight,
    arrays: &[Array],
    common: &Common,
) -> Result<Vec<(usize, Vec<u8>)>, Error> {
    let plan = planned(&flight.scene, common)?;
    let shape = Shape::new(&plan, of.keys.spectra)?;
    let mut numbers = Numbers::new();
    add_measured(&plan, of.keys.spectra, common, &mut numbers)?;
    add_truth(of, flight, &plan, &shape, &mut numbers)?;
    let mut packed = Vec::with_capacity(arrays.len());
    for (index, array) in arrays.iter().enumerate() {
        let mut bytes = Vec::new();
        match array.name.as_str() {
            "seed" => bytes.extend(flight.scene.content.seed.to_le_bytes()),
            "scene_hash" => bytes.extend(hash_number(&flight.scene.hash).to_le_bytes()),
            name => match numbers.get(name) {
                Some(values) => array.pack(values.iter().copied(), &mut bytes),
                None => continue,
            },
        }
        packed.push((index, bytes));
    }
    Ok(packed)
}

/// The number that the hash of a scene writes in hexadecimal digits.
fn hash_number(hash: &str) -> u64 {
    u64::from_str_radix(hash, 16).unwrap_or(0)
}

/// Adds what is measured in a flight.
fn add_measured(
    plan: &Plan,
    has_spectra: bool,
    common: &Common,
    numbers: &mut Numbers,
) -> Result<(), Error> {
    let scanner = Scanner::with(plan, &common.efficiencies, &Silent)?;
    let spectra = has_spectra.then(|| schema::spectra(plan)).transpose()?;
    let mut spectrum_db = Ok(Vec::new());
    let maps = map::of_plans(&[plan], &scanner, &Silent, |map| {
        if let Some(spectra) = &spectra {
            spectrum_db = spectra_db(spectra, map);
        }
    })?;
    let map = maps.into_iter().next().unwrap_or_default();
    let deviation_m_s = deviations_m_s(plan, &map, common)?;
    for (name, cells) in [
        ("velocity", &map.v_scan_m_s),
        ("velocity_standard_deviation", &deviation_m_s),
        ("signal_to_noise_ratio", &map.snr_db),
        ("spectral_width", &map.width_m_s),
        ("quality", &map.quality),
        ("flag", &map.flagged),
        ("true_velocity", &map.v_gate_m_s),
        ("point_velocity", &map.v_exact_m_s),
    ] {
        numbers.insert(name.into(), cells.iter().copied().collect());
    }
    numbers.insert("spectrum".into(), spectrum_db?);
    let middle = ScanMiddle::of(plan, None, Some(&scanner));
    let snr_db = middle.map_or(f64::NAN, |middle| middle.snr_db);
    numbers.insert("snr_middle".into(), vec![snr_db]);
    Ok(())
}

/// Spectra of all gates over the noise, dB \[line, gate, bin\].
fn spectra_db(spectra: &GateSpectra, map: &map::RealisationMap<'_>) -> Result<Vec<f64>, Error> {
    let bins = spectra.velocity_m_s().len();
    let mut all = Vec::with_capacity(map.points.len() * bins);
    for (index, point) in map.points.iter().enumerate() {
        let radius_m = map.radius_m[index % map.radius_m.len()];
        for density in spectra.density(map.scan, *point, radius_m, map.noise_density_a2)? {
            all.push(10.0 * f64::from(density).log10());
        }
    }
    Ok(all)
}

/// The standard deviation that the Cramer-Rao bound predicts at the estimated signal-to-noise ratio of each gate, m/s.
fn deviations_m_s(
    plan: &Plan,
    map: &VelocityEstimates,
    common: &Common,
) -> Result<Array2<f64>, Error> {
    let scene = plan.scene();
    let places = places(scene, &plan.geometry)?;
    let points = places.points(&map.range_m);
    // It depends on instrument, lines and estimator alone.
    let detector = Detector {
        snr: SnrReference::Physical {},
        ..scene.detector.clone()
    };
    let scan = Scan {
        lidar_height_m: 0.0,
        ..scene.scan.clone()
    };
    let cause = format!(
        "{:?}",
        (&scene.laser, &scene.pulse, detector, scan, &scene.estimator)
    );
    let predicted = common.predicted.get_or_make(hash_of(&cause), || {
        let largest_m = map.radius_m.iter().copied().fold(0.0, f64::max);
        PredictedError::new(plan, places, largest_m)
    })?;
    let gates = map.range_m.len();
    Ok(Array2::from_shape_fn(map.snr_db.dim(), |at| {
        let point = points[at.0 * gates + at.1];
        predicted.deviation_m_s(point, map.radius_m[at.1], map.level[at], map.snr_db[at])
    }))
}

/// Adds what is known of a flight: its splits, its air, its vortices.
fn add_truth(
    of: &DatasetPlan,
    flight: &Flight,
    plan: &Plan,
    shape: &Shape,
    numbers: &mut Numbers,
) -> Result<(), Error> {
    let scene = plan.scene();
    let pair = scene.flow.pair();
    let eddies = scene.eddies();
    let of_pair = pair.and_then(|pair| pair.dissipation_m2_s3);
    let dissipation = eddies.map(|eddies| eddies.dissipation_m2_s3).or(of_pair);
    let mut add = |name: &str, values: Vec<f64>| drop(numbers.insert(name.into(), values));
    add("site", vec![flight.site as f64]);
    add("split", vec![f64::from(of.keys.split_of(flight.number))]);
    add(
        "has_wake",
        vec![f64::from(u8::from(scene.flow.has_vortices()))],
    );
    add("dissipation", vec![dissipation.unwrap_or(f64::NAN)]);
    add(
        "outer_scale",
        vec![eddies.map_or(f64::NAN, |eddies| eddies.outer_scale_m)],
    );
    add(
        "spacing",
        vec![pair.map_or(f64::NAN, |pair| pair.spacing_m)],
    );
    add("ready", vec![1.0]);
    for (index, ((key, _), value)) in of.drawn.keys.iter().zip(&flight.values).enumerate() {
        add(&name_of_key(&key.path), vec![of.stored_value(index, value)]);
    }
    let wind = mean_wind_m_s(&flight.scene, &of.keys.heights_m)?;
    add("wind_x", wind.iter().map(|velocity| velocity[0]).collect());
    add("wind_y", wind.iter().map(|velocity| velocity[1]).collect());
    let mut truth = Vec::with_capacity(shape.scans);
    let lines = shape.elevation_deg.len();
    for scan in 0..shape.scans {
        let of_scan: Vec<usize> = (scan * lines..(scan + 1) * lines).collect();
        truth.extend(match scene.flow.has_vortices() {
            true => true_vortices(plan, &of_scan)?.map(Some),
            false => [None, None],
        });
    }
    add("wake_age", wake_ages_tau(plan, shape));
    add_vortices(plan, shape, &truth, &mut add);
    Ok(())
}

/// Adds the vortices of all scans, left and right; NaN where there is none.
fn add_vortices(
    plan: &Plan,
    shape: &Shape,
    truth: &[Option<VortexResult>],
    add: &mut impl FnMut(&str, Vec<f64>),
) {
    type Get = fn(&VortexResult) -> f64;
    let numbers: [(&str, Get); 5] = [
        ("vortex_y", |vortex| vortex.lateral_position_m.value),
        ("vortex_z", |vortex| vortex.height_m.value),
        ("circulation", |vortex| vortex.circulation_m2_s.value),
        ("circulation_5_15", |vortex| {
            vortex.circulation_5_15_m2_s.value
        }),
        ("core_radius", |vortex| {
            vortex.core_radius_m.map_or(f64::NAN, |core| core.value)
        }),
    ];
    let known = |vortex: &Option<VortexResult>| vortex.filter(is_there);
    for (name, get) in numbers {
        let values = truth
            .iter()
            .map(|vortex| known(vortex).as_ref().map_or(f64::NAN, get));
        add(name, values.collect());
    }
    let start_s = plan.wind.start_s;
    let times_s = truth
        .iter()
        .map(|vortex| known(vortex).map_or(f64::NAN, |vortex| vortex.time_s - start_s));
    add("passing_time", times_s.collect());
    let in_view = truth
        .iter()
        .map(|vortex| known(vortex).is_some_and(|vortex| is_in_view(plan, shape, &vortex)));
    add(
        "in_view",
        in_view.map(|is_in| f64::from(u8::from(is_in))).collect(),
    );
}

/// Whether the centre of a vortex lies within the first and the last gate and line, seen from where the lidar is when it is passed.
fn is_in_view(plan: &Plan, shape: &Shape, vortex: &VortexResult) -> bool {
    let g = &plan.geometry;
    let off_s = |line: usize| (plan.wind.start_s + g.line_time_s[line] - vortex.time_s).abs();
    let passing = (0..g.line_time_s.len()).min_by(|a, b| off_s(*a).total_cmp(&off_s(*b)));
    let Some(line) = passing else { return false };
    let crossing = g.schedule.crossing(line, vortex.place_m());
    is_between(&shape.range_m, crossing.range_m)
        && is_between(&shape.elevation_deg, crossing.elevation_rad.to_degrees())
}

/// Whether a value lies within the smallest and the largest one.
fn is_between(values: &[f64], value: f64) -> bool {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (least..=most).contains(&value)
}

/// Age of the pair in t V0/b0 when each scan begins, where the plane of its first line crosses the place of the release; NaN before the
/// passage, and without a pair.
fn wake_ages_tau(plan: &Plan, shape: &Shape) -> Vec<f64> {
    let mut ages = vec![f64::NAN; shape.scans];
    let scene = plan.scene();
    let Some(pair) = scene.flow.pair().filter(|pair| pair.circulation_m2_s > 0.0) else {
        return ages;
    };
    let unit_s = vortex_pair(pair).time_s(1.0);
    let schedule = &plan.geometry.schedule;
    for (scan, age) in ages.iter_mut().enumerate() {
        let first = scan * shape.elevation_deg.len();
        let released_m = (pair.lateral_position_m, pair.height_m);
        let x_m = schedule.crossing(first, released_m).x_m;
        let since_s = pair.aircraft.map_or(plan.wind.start_s, |aircraft| {
            (aircraft.x_m - x_m) / aircraft.speed_m_s
        });
        let age_s = since_s + schedule.lines[first].tick * schedule.prt_s;
        // A passage when a scan begins is rounded.
        if age_s >= -1e-9 {
            *age = age_s.max(0.0) / unit_s;
        }
    }
    ages
}

/// The mean wind at some heights over the origin when the scan begins, m/s, without vortices and turbulence.
fn mean_wind_m_s(scene: &SceneFile, heights_m: &[f64]) -> Result<Vec<[f64; 3]>, Error> {
    let pair = scene.content.flow.pair();
    let wind = mean_winds(pair.map_or(0.0, |pair| pair.cross_wind_m_s), scene)?;
    let points_m: Vec<[f64; 3]> = heights_m
        .iter()
        .map(|height_m| [0.0, 0.0, *height_m])
        .collect();
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    wind.velocity_into(&points_m, 0.0, &mut velocity_m_s)?;
    Ok(velocity_m_s)
}
