//! `wakescope wind`: wind over height with standard errors, and dissipation rate, from lines of sight of any instrument.
//!
//! | module | what it does |
//! |---|---|
//! | `directions` | which components the directions of beams determine |
//! | `windows` | lines of sight in windows of time |
//! | `heights` | bins of height, and the wind of each among bad velocities |
//! | `turbulence` | dissipation and noise of layers, the outer scale |
//! | `rows` | standard errors, derived quantities and flags of each window and height |
//! | `of_map` | winds of a scan of this program, beside the true ones |
//! | `table`, `netcdf`, `pictures` | the files |
//!
//! Check: files of known winds of an independent program (`tests/reference/wind`), in the tests of the program.

mod cross_wind;
mod directions;
mod heights;
mod netcdf;
mod of_map;
#[cfg(feature = "plots")]
mod pictures;
mod rows;
mod table;
mod turbulence;
mod windows;

pub use cross_wind::CrossWind;
pub use directions::Kind;
pub use netcdf::netcdf;
#[cfg(feature = "cli")]
pub(crate) use of_map::gate_stride;
pub use of_map::{table_with_truth, winds_of_map};
#[cfg(feature = "plots")]
pub use pictures::figure;
pub use rows::{Flag, WindRow};
#[cfg(feature = "cli")]
pub use table::json;
pub use table::{summary, table};
pub use windows::{Every, FoundWindows, Window, windows};

use crate::Error;
use crate::io::UtcTime;
use crate::io::scans::Ray;
use cross_wind::nearest_m_s;
use directions::{Components, components, distinct, is_vertical};
use heights::{Bin, winds};
use turbulence::{RunTurbulence, layers};

/// How winds are found.
#[derive(Debug, Clone, PartialEq)]
pub struct WindOptions {
    /// Standard deviation of the weight of a gate along its beam, m; 0 for points.
    pub gate_std_m: f64,
    /// Gates this many apart share no samples.
    pub gate_stride: usize,
    /// Components of the wind; by default those that the directions determine.
    pub kind: Option<Kind>,
    /// Step of the heights, m; by default that of the gates, or 25 m for scans of several elevations.
    pub height_step_m: Option<f64>,
    /// Thickness of the layers of one dissipation, m.
    pub layer_m: f64,
    /// Outer scale of the turbulence, m; by default from the velocities.
    pub outer_scale_m: Option<f64>,
    /// Winds across beams of which the direction shows none; none where these are not known.
    pub cross_winds: Vec<CrossWind>,
}

impl Default for WindOptions {
    fn default() -> Self {
        Self {
            gate_std_m: 0.0,
            gate_stride: 1,
            kind: None,
            height_step_m: None,
            layer_m: 100.0,
            outer_scale_m: None,
            cross_winds: Vec::new(),
        }
    }
}

/// Winds over height in all windows.
#[derive(Debug, Clone, Default)]
pub struct WindProfiles {
    /// One for each window and height.
    pub rows: Vec<WindRow>,
    /// Date from which times count, if there is one.
    pub reference: Option<UtcTime>,
    /// Outer scales, m, and their probabilities; none without turbulence.
    pub outer_scales: Vec<(f64, f64)>,
    /// Of a simulated scan, the true wind (east, north, up) above the lidar at the height and in the middle of the window of each row, m/s,
    /// without the turbulence of `"eddies"`: the mean wind is what a scan is to find. NaN where it is not known.
    pub true_m_s: Vec<[f64; 3]>,
}

/// Half the band of bad velocities is at least this, m/s.
const LEAST_HALF_BAND_M_S: f64 = 10.0;
/// Fraction of the velocities that tells the band.
const NEARLY_ALL: f64 = 0.99;

/// The winds of windows, whose times count from `reference`.
///
/// # Errors
/// A kind of wind that the directions of no window determine.
pub fn wind_profiles(
    windows: &[Window],
    reference: Option<UtcTime>,
    options: &WindOptions,
) -> Result<WindProfiles, Error> {
    let of_vertical = match options.kind {
        Some(Kind::Up) => Some(vertical(windows)?),
        _ => None,
    };
    let windows = of_vertical.as_deref().unwrap_or(windows);
    let half_band_m_s = half_band_m_s(windows);
    let mut fitted: Vec<(usize, Components, Vec<Bin>)> = Vec::with_capacity(windows.len());
    let mut refused = None;
    let mut all_layers = Vec::new();
    for (number, window) in windows.iter().enumerate() {
        let components = match components_of(&window.rays, options.kind) {
            Ok(components) => components,
            Err(error) => {
                refused = refused.or(Some(error));
                continue;
            }
        };
        let bins = winds(&window.rays, &components, half_band_m_s, options)?;
        all_layers.extend(layers(
            number,
            &window.rays,
            &bins,
            options,
            components.kind == Kind::Plane && options.cross_winds.is_empty(),
            |height_m, mean_m_s| {
                carried_m_s(components.kind, mean_m_s, || {
                    nearest_m_s(&options.cross_winds, window, reference, height_m)
                })
            },
        ));
        fitted.push((number, components, bins));
    }
    // Windows of another kind than the one that is wanted have no rows, unless all are.
    if let Some(error) = refused.filter(|_| fitted.is_empty()) {
        return Err(error);
    }
    let turbulence = RunTurbulence::new(&all_layers, options)?;
    let mut rows = Vec::new();
    for (number, components, bins) in &fitted {
        let of = (*number, &windows[*number], components);
        for bin in bins {
            rows.push(rows::row(of, bin, &turbulence, options)?);
        }
    }
    Ok(WindProfiles {
        rows,
        reference,
        outer_scales: turbulence.outer_scales,
        true_m_s: Vec::new(),
    })
}

/// Half the band of bad velocities that do not repeat, m/s: that of uniform ones with the same velocity below which nearly all are. The fastest
/// may be a single wrong number.
fn half_band_m_s(windows: &[Window]) -> f64 {
    let mut speeds_m_s = Vec::new();
    for ray in windows.iter().flat_map(|window| &window.rays) {
        if ray.fold_m_s.is_none() {
            let known = ray.velocity_m_s.iter().filter(|v| v.is_finite());
            speeds_m_s.extend(known.map(|velocity_m_s| velocity_m_s.abs()));
        }
    }
    if speeds_m_s.is_empty() {
        return LEAST_HALF_BAND_M_S;
    }
    let place = (NEARLY_ALL * (speeds_m_s.len() - 1) as f64).floor() as usize;
    let (_, nearly_fastest_m_s, _) = speeds_m_s.select_nth_unstable_by(place, f64::total_cmp);
    (*nearly_fastest_m_s / NEARLY_ALL).max(LEAST_HALF_BAND_M_S)
}

/// Windows with their vertical beams alone.
fn vertical(windows: &[Window]) -> Result<Vec<Window>, Error> {
    let mut found = Vec::with_capacity(windows.len());
    for window in windows {
        let mut own = window.clone();
        own.rays.retain(|ray| is_vertical(ray.direction()));
        if !own.rays.is_empty() {
            found.push(own);
        }
    }
    match found.is_empty() {
        false => Ok(found),
        true => Err(of_kind("up needs vertical beams, and there are none")),
    }
}

/// The wind that carries the air: of a full wind its own, of a plane the one that is given or its own, of others the one that is
/// given.
fn carried_m_s(
    kind: Kind,
    own_m_s: [f64; 3],
    given: impl Fn() -> Option<[f64; 3]>,
) -> Option<[f64; 3]> {
    match kind {
        Kind::Full => Some(own_m_s),
        Kind::Plane => given().or(Some(own_m_s)),
        Kind::Up | Kind::Radial => given(),
    }
}

/// A refusal of the kind of a wind.
fn of_kind(reason: &str) -> Error {
    Error::Input {
        path: "--kind".into(),
        reason: reason.to_owned(),
    }
}

/// The components of the wind of rays.
fn components_of(rays: &[Ray], kind: Option<Kind>) -> Result<Components, Error> {
    let directions = distinct(rays.iter().map(Ray::direction));
    let found = components(&directions).ok_or_else(|| of_kind("there are no rays"))?;
    match kind {
        Some(kind) if kind != found.kind => {
            let azimuth = found.azimuth_deg;
            let elevation = found.elevation_deg;
            let has = match found.kind {
                Kind::Full => "the beams have several azimuths".to_owned(),
                Kind::Plane => format!("the beams have one azimuth, {azimuth:.1} degrees"),
                Kind::Up => "all beams are vertical".to_owned(),
                Kind::Radial => {
                    format!(
                        "all beams have azimuth {azimuth:.1} and elevation {elevation:.1} degrees"
                    )
                }
            };
            let needed = match kind {
                Kind::Full => "full needs beams of at least three directions that span space",
                Kind::Plane => "plane needs beams of one azimuth and two elevations",
                Kind::Up => "up needs vertical beams",
                Kind::Radial => "radial needs beams of one direction that is not vertical",
            };
            Err(of_kind(&format!(
                "{has}: {needed}; what they determine is {}",
                found.kind.name()
            )))
        }
        _ => Ok(found),
    }
}
