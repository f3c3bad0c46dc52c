//! The bank of wakes that a test tries: places on a grid over the scan, and at them pairs of one circulation and single vortices.
//!
//! Check: places lie in the scan; pairs have the spacings that were asked for.

use ndarray::Array2;

use crate::matched_filter::Cells;
use crate::retrieval::Turbulence;
use crate::vortex_fit::WakeModel;

/// Distance of places \[m\] where lines and gates are closer; between them a wake loses little of its statistic.
const STEP_M: f64 = 4.0;
/// Along the line gates blur: this part of their standard deviation is close enough.
const STEP_OVER_GATE: f64 = 0.4;
/// Places of a large scan, and how many times more there may be where pairs are close: their number is squared in memory and cubed in time.
const MOST_PLACES: f64 = 1200.0;
const MANY: f64 = 2.0;
/// Core radius over the distance of places: what lies between them is not missed.
const CORE_OVER_STEP: f64 = 0.5;

/// What a test takes for granted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorOptions {
    /// Least and largest distance of a pair's vortices that is tried \[m\].
    pub spacing_m: (f64, f64),
    /// Whether single vortices are tried, too: the partner may be out of view.
    pub single_vortices: bool,
    /// The background besides wind and the noise of the map's standard deviations.
    pub turbulence: Option<Turbulence>,
}

impl Default for DetectorOptions {
    /// Wakes of wings of 20 to 80 m (spacing pi/4 of the span), single vortices, and no turbulence.
    fn default() -> Self {
        Self {
            spacing_m: (16.0, 63.0),
            single_vortices: true,
            turbulence: None,
        }
    }
}

/// A wake of the bank: the places of its left and its right vortex, none where there is no such
/// vortex.
pub(super) type Template = [Option<usize>; 2];

/// Places and wakes.
#[derive(Debug, Clone)]
pub(super) struct Bank {
    /// Lateral coordinate and height of each place \[m\].
    pub(super) places_m: Vec<(f64, f64)>,
    /// Distances of neighbouring places \[m\].
    pub(super) step_m: (f64, f64),
    pub(super) core_m: f64,
    /// Lateral coordinates and heights between which the cells are \[m\].
    pub(super) lateral_m: (f64, f64),
    pub(super) up_m: (f64, f64),
    pub(super) templates: Vec<Template>,
}

impl Bank {
    /// Pairs and, if asked for, single vortices; `gate_m` is the standard deviation of a gate.
    pub(super) fn new(
        cells: &Cells,
        model: &WakeModel,
        gate_m: f64,
        options: &DetectorOptions,
    ) -> Self {
        let spacing_m = options.spacing_m;
        let across_m = extent(cells.cells.iter().map(|cell| cell.place_m.0));
        let mut up_m = extent(cells.cells.iter().map(|cell| cell.place_m.1));
        if model.images {
            up_m.0 = up_m.0.max(STEP_M);
        }
        let [width_m, height_m] = [across_m, up_m].map(|(low, high)| (high - low).max(0.0));
        let area = width_m * height_m;
        let apart_m = STEP_M.max((area / MOST_PLACES).sqrt());
        let lateral_m = apart_m.max(STEP_OVER_GATE * gate_m);
        // the least spacing is a number of steps, unless the scan is so large that this gives too many places
        let lateral_m = spacing_m.0 / (spacing_m.0 / lateral_m).ceil().max(1.0);
        let lateral_m = lateral_m.max(area / apart_m / (MANY * MOST_PLACES));
        let step_m = (lateral_m, apart_m);
        let columns = (width_m / lateral_m) as usize + 1;
        let rows = (height_m / apart_m) as usize + 1;
        let mut index = Array2::from_elem((rows, columns), None);
        let mut places_m = Vec::new();
        for ((row, column), at) in index.indexed_iter_mut() {
            let place = (
                across_m.0 + column as f64 * lateral_m,
                up_m.0 + row as f64 * apart_m,
            );
            if cells.hold(model, place) {
                *at = Some(places_m.len());
                places_m.push(place);
            }
        }
        let mut templates = Vec::new();
        let least = (spacing_m.0 / lateral_m - 1e-9).ceil() as usize;
        let most = (spacing_m.1 / lateral_m + 1e-9) as usize;
        for ((row, column), &place) in index.indexed_iter() {
            let Some(place) = place else { continue };
            if options.single_vortices {
                templates.push([Some(place), None]);
                templates.push([None, Some(place)]);
            }
            let partners = (least..=most).filter_map(|away| *index.get((row, column + away))?);
            templates.extend(partners.map(|partner| [Some(place), Some(partner)]));
        }
        Self {
            places_m,
            step_m,
            core_m: CORE_OVER_STEP * apart_m,
            lateral_m: across_m,
            up_m,
            templates,
        }
    }
}

/// Smallest and largest of some numbers.
fn extent(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vortex_fit::VelocityMap;

    /// Least and largest spacing of the pairs of a scan of 100 lines from the ground to `top_rad`, and its places.
    fn bank(top_rad: f64, (first_m, step_m): (f64, f64)) -> (f64, f64, usize) {
        let elevation_rad: Vec<f64> = (0..100).map(|i| 0.01 * top_rad * f64::from(i)).collect();
        let range_m: Vec<f64> = (0..600).map(|i| first_m + step_m * f64::from(i)).collect();
        let velocity = Array2::zeros((100, 600));
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity.view(),
            standard_deviation_m_s: None,
        };
        let model = WakeModel::default();
        let bank = Bank::new(
            &Cells::new(&map, &model),
            &model,
            0.3 * step_m,
            &DetectorOptions::default(),
        );
        let pairs = bank.templates.iter().filter_map(|[left, right]| {
            Some(bank.places_m[(*right)?].0 - bank.places_m[(*left)?].0)
        });
        let (least, most) = pairs.fold((f64::INFINITY, 0.0_f64), |(least, most), b| {
            (least.min(b), most.max(b))
        });
        assert!(!bank.templates.is_empty());
        (least, most, bank.places_m.len())
    }

    #[test]
    fn a_bank_is_bounded_whatever_the_size_of_the_scan_and_its_pairs_have_the_spacings_that_are_asked_for()
     {
        // a lidar near a runway, one that sees 6 km, and a radar that sees 150 km
        for (top_rad, gates, has_pairs) in [
            (0.2, (300.0, 0.5), true),
            (0.5, (500.0, 10.0), true),
            (1.5, (500.0, 250.0), false),
        ] {
            let (least_m, most_m, places) = bank(top_rad, gates);
            assert!(places <= 2700, "{places}");
            assert_eq!(least_m.is_finite(), has_pairs, "{gates:?}: {least_m}");
            assert!(
                !has_pairs || least_m >= 15.99 && most_m <= 63.01,
                "{least_m} {most_m}"
            );
        }
    }
}
