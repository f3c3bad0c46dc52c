//! Winds beyond the Nyquist interval.
//!
//! Velocities that repeat after the width F are explained by a wind w, and nearly as well by w + n F / cos(elevation): the cosine's change
//! over the scan alone distinguishes these aliases. The wind without vortices is fitted from starts over all possible winds; the
//! fit of the wake begins with the best of them and compares the others at its end.
//! Check: winds of several intervals in narrow and wide sectors, and over the zenith.

use ndarray::Array2;

use crate::error::Error;
use crate::linalg::positive_definite::solve;
use crate::retrieval::hypotheses::{End, Kind, Stage, least};
use crate::retrieval::{Movement, RetrievalOptions, ScanMap};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::guess::SEARCHED;
use crate::vortex_fit::tolerances::{COMPETES, HOPELESS, MINIMUM};
use crate::vortex_fit::{PARAMETERS, Parameter, Wake};

/// Fastest wind that is tried \[m/s\]: no aircraft lands in a faster cross wind by far.
const FASTEST_M_S: f64 = 50.0;
/// Starts of the wind without vortices are this fraction of the width apart.
const START: f64 = 0.5;
/// An alias of the wind differs by more than this fraction of the width.
const SAME: f64 = 0.25;
/// Most aliases on either side.
const MOST_ALIASES: f64 = 20.0;

/// A scan without vortices and without wind.
pub(super) const CALM: [f64; PARAMETERS] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// A map whose velocities are near an assumed wind.
pub(super) struct Unfolded {
    pub(super) map: ScanMap,
    /// A wake with the assumed wind, where this is another one than that to which fits come from calm air.
    assumed: Option<Wake>,
}

impl Unfolded {
    /// Assumes the wind that explains the map best without vortices.
    pub(super) fn new(map: &ScanMap, options: &RetrievalOptions) -> Result<Self, Error> {
        let unfolded = Self {
            map: map.unfolded(),
            assumed: None,
        };
        let Some(fold_m_s) = map.fold_m_s else {
            return Ok(unfolded);
        };
        let blocks = unfolded.map.medians(SEARCHED);
        let sought = blocks.as_ref().unwrap_or(&unfolded.map);
        let gates = Gates::rough(sought, options)?;
        let mut stage = Stage::new(sought, options, &gates);
        let calm = Wake::from_array(&CALM);
        if sought.sigma_m_s.is_none() {
            let first = stage.wind(&calm)?;
            stage = stage.rescaled(&first);
        }
        let usual = stage.wind(&calm)?;
        let mut best = usual.clone();
        let steps = (FASTEST_M_S / (START * fold_m_s)).floor() as i32;
        for step in -steps..=steps {
            let lateral_wind_m_s = f64::from(step) * START * fold_m_s;
            let end = stage.wind(&Wake {
                lateral_wind_m_s,
                ..calm
            })?;
            if end.chi2 < best.chi2 && is_allowed(&end.wake) {
                best = end;
            }
        }
        let scale = stage.residual_scale(&usual).max(1.0);
        if best.chi2 + COMPETES * scale.powi(2) < usual.chi2 {
            return Ok(unfolded.about(&best.wake, options));
        }
        Ok(unfolded)
    }

    /// The same with the wind of a wake assumed.
    pub(super) fn about(&self, wake: &Wake, options: &RetrievalOptions) -> Self {
        Self {
            map: self.map.unfolded_about(&options.model, wake),
            assumed: Some(*wake),
        }
    }

    /// A start of a fit in the assumed wind.
    pub(super) fn with_wind(&self, start: &Wake) -> Wake {
        let Some(assumed) = &self.assumed else {
            return *start;
        };
        Wake {
            lateral_wind_m_s: assumed.lateral_wind_m_s,
            wind_shear_per_s: assumed.wind_shear_per_s,
            log_wind_m_s: assumed.log_wind_m_s,
            ..*start
        }
    }
}

/// The likely wake in the aliases of its wind, the best one first, as far as it competes with that in its own.
pub(super) fn rivals(stage: &Stage<'_>, ends: &[End], scale: f64) -> Vec<End> {
    match least(ends, stage.squares.cells.len()) {
        Some(likely) => in_aliases(stage, likely, scale),
        None => Vec::new(),
    }
}

/// The wind without vortices that explains the velocities best among an end and its aliases, and whether another one competes with it.
pub(super) fn best_wind(stage: &Stage<'_>, wind: End, scale: f64) -> (End, bool) {
    let mut all = in_aliases(stage, &wind, scale);
    all.push(wind.clone());
    all.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let competes = all
        .get(1)
        .is_some_and(|second| second.chi2 - all[0].chi2 < COMPETES * scale.powi(2));
    (all.into_iter().next().unwrap_or(wind), competes)
}

/// An end with the aliases of its wind, the best one first, as far as they compete with it.
fn in_aliases(stage: &Stage<'_>, end: &End, scale: f64) -> Vec<End> {
    let Some([wind_m_s, shear_per_s]) = stage.map.fold_m_s.and_then(|fold| alias(stage, fold))
    else {
        return Vec::new();
    };
    let most = end.chi2 + HOPELESS * scale.powi(2);
    let count = (2.0 * FASTEST_M_S / wind_m_s.abs())
        .min(MOST_ALIASES)
        .floor() as i32;
    let mut found = Vec::new();
    for number in (-count..=count).filter(|number| *number != 0) {
        let times = f64::from(number);
        let start = Wake {
            lateral_wind_m_s: end.wake.lateral_wind_m_s + times * wind_m_s,
            wind_shear_per_s: end.wake.wind_shear_per_s + times * shear_per_s,
            ..end.wake
        };
        if is_allowed(&start) {
            found.extend(stage.lowest(end.kind, &start, end.groups.clone(), MINIMUM));
        }
    }
    found.retain(|found| found.chi2 <= most);
    found.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    found
}

/// The best wake in an alias of the wind, and whether it moves while the scan lasts, where it explains the velocities better than the wakes
/// from which the aliases come.
pub(super) fn better<'a>(
    stages: impl IntoIterator<Item = (&'a Stage<'a>, &'a [End])>,
    scale: f64,
) -> Option<(Wake, Movement)> {
    let mut own_chi2 = f64::INFINITY;
    let mut best: Option<(End, Movement)> = None;
    for (stage, ends) in stages {
        let likely = least(ends, stage.squares.cells.len());
        own_chi2 = own_chi2.min(likely.map_or(f64::INFINITY, |end| end.chi2));
        let movement = match stage.gates.seconds {
            Some(_) => Movement::Moving,
            None => Movement::Frozen,
        };
        let best_chi2 = best.as_ref().map_or(f64::INFINITY, |(end, _)| end.chi2);
        if let Some(rival) = rivals(stage, ends, scale).into_iter().next()
            && rival.chi2 < best_chi2
        {
            best = Some((rival, movement));
        }
    }
    let (end, movement) = best.filter(|(end, _)| end.chi2 < own_chi2)?;
    Some((end.wake, movement))
}

/// Wind and shear that are, along the lines, nearest to the width after which velocities repeat, by least squares; none in sectors whose
/// lines it changes in all ways.
fn alias(stage: &Stage<'_>, fold_m_s: f64) -> Option<[f64; 2]> {
    let shear = Parameter::Shear as usize;
    let has_shear = stage
        .groups(Kind::Wind)
        .iter()
        .any(|group| group.contains(&shear));
    let columns = if has_shear { 2 } else { 1 };
    let mut products = Array2::<f64>::zeros((columns, columns));
    let mut sums = vec![0.0; columns];
    for cell in &stage.squares.cells {
        let elevation_rad = stage.map.elevation_rad[cell.line];
        let range_m = stage.map.range_m[cell.gate];
        let (_, height_m) = stage.gates.model.position_m(range_m, elevation_rad);
        let row = [elevation_rad.cos(), height_m * elevation_rad.cos()];
        for i in 0..columns {
            sums[i] += fold_m_s * row[i];
            for j in 0..columns {
                products[[i, j]] += row[i] * row[j];
            }
        }
    }
    let found = solve(&products, &sums)?;
    let alias = [found[0], found.get(1).copied().unwrap_or(0.0)];
    (alias[0].abs() > SAME * fold_m_s).then_some(alias)
}

fn is_allowed(wake: &Wake) -> bool {
    wake.lateral_wind_m_s.abs() <= FASTEST_M_S
}
