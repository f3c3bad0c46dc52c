//! The velocities of a scan tile by tile.
//!
//! The samples of all tiles have one scale, a region sums its lines in their order, and windows have the same numbers in parts of a
//! record, so that tiles change no bit.

use super::lines::{ScanLines, upward};
use super::spectra::GateSpectra;
use super::tiles::{Tile, tiles};
use super::{RecordedOptions, pieces, samples};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::measure::gate_estimates::GateEstimate;
use crate::measure::map_estimator::{MapEstimator, windows_at};
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::progress::Observer;
use ndarray::Array2;
use wakescope_estimate::GateVelocity;
use wakescope_estimate::estimators::Quality;
use wakescope_estimate::map::{MapPoint, ScanGeometry, polar_points};
use wakescope_estimate::window::Sample;

/// Most bytes of the sums of a tile.
const BLOCK_BYTES: usize = 256 << 20;

/// The gates of a scan before they are held against the noise.
pub(super) struct ScanCells {
    pub(super) lines: ScanLines,
    pub(super) gates: Array2<GateEstimate>,
    /// Mean power, A^2, that the estimator finds in the band of the scene's noise; NaN without noise.
    pub(super) noise_a2: f64,
    /// Where the windows of the lines are, and the radius of the regions of each gate, m.
    pub(super) regions: (ScanGeometry, Vec<f64>),
    /// Spectra of the gates over the noise of the scene, where they were asked for.
    pub(super) spectra: Option<Vec<f32>>,
}

/// The gates of all scans, one after the other; `largest` is the largest part of a sample.
pub(super) fn scans<S: Sample>(
    plan: &Plan,
    records: &mut RawRecords,
    largest: f64,
    scans: &[ScanLines],
    options: &RecordedOptions,
    observer: &dyn Observer,
) -> Result<Vec<ScanCells>, Error> {
    let spectra = options
        .spectra
        .then(|| GateSpectra::new(plan, S::KIND))
        .transpose()?;
    spectra
        .iter()
        .try_for_each(|spectra| spectra.fit_a_file(plan))?;
    let layer_snr = Scanner::expected_layer_snr(plan, observer)?;
    let range_m = &plan.geometry.gate_range_m;
    let most_bytes = options.block_bytes.unwrap_or(BLOCK_BYTES);
    let mut out = Vec::with_capacity(scans.len());
    // Repetitions of a scan share what was made for the first.
    for alike in scans.chunk_by(|a, b| a.elevation_rad == b.elevation_rad) {
        let places = windows_at(plan, &alike[0].all_records().1)?;
        let estimator = MapEstimator::<S>::new(plan, &layer_snr, &places)?;
        let tiles = tiles(
            &estimator,
            &places,
            &alike[0].elevation_rad,
            range_m,
            most_bytes,
        )?;
        let blocks = Blocks {
            plan,
            largest,
            observer,
            estimator,
            places,
            tiles,
            spectra: spectra.as_ref(),
        };
        for lines in alike {
            out.push(blocks.scan(records, lines)?);
        }
    }
    Ok(out)
}

/// What scans with the same lines share.
struct Blocks<'p, S> {
    plan: &'p Plan,
    largest: f64,
    observer: &'p dyn Observer,
    estimator: MapEstimator<'p, S>,
    places: ScanGeometry,
    tiles: Vec<Tile>,
    spectra: Option<&'p GateSpectra>,
}

impl<S: Sample> Blocks<'_, S> {
    fn scan(&self, records: &mut RawRecords, lines: &ScanLines) -> Result<ScanCells, Error> {
        let range_m = &self.plan.geometry.gate_range_m;
        let shape = (lines.elevation_rad.len(), range_m.len());
        let none = MapPoint {
            estimate: GateVelocity::none(Quality::Empty),
            level: 0,
            left_out: 0,
            n_eff: 0.0,
        };
        let [power_a2, gain, detection_ratio, deviation] = [f64::NAN; 4];
        let empty = GateEstimate {
            found: none,
            power_a2,
            gain,
            detection_ratio,
            deviation,
        };
        let radius_m = range_m
            .iter()
            .map(|range_m| self.estimator.radius.at_m(*range_m))
            .collect::<Result<_, _>>()?;
        let mut cells = ScanCells {
            lines: lines.clone(),
            gates: Array2::from_elem(shape, empty),
            noise_a2: self.estimator.tools.noise.power_a2,
            regions: (self.places.clone(), radius_m),
            spectra: self
                .spectra
                .map(|of_gate| vec![0.0; shape.0 * shape.1 * of_gate.len()]),
        };
        for tile in &self.tiles {
            self.tile(records, tile, &mut cells)?;
            if tile.gates.end == shape.1 {
                self.observer.advance(tile.lines.len() as u64);
            }
        }
        Ok(cells)
    }

    fn tile(
        &self,
        records: &mut RawRecords,
        tile: &Tile,
        cells: &mut ScanCells,
    ) -> Result<(), Error> {
        let (plan, estimator, (read, held), lines) =
            (self.plan, &self.estimator, &tile.windows, &cells.lines);
        let of_records = lines.records(read);
        let of_samples = plan.scene().gates()?.samples(held);
        let places = windows_at(plan, &lines.record_elevation_rad(read))?;
        let mut sums = estimator
            .sums(places, Some(held.clone()))?
            .scaled_for(self.largest);
        for piece in pieces(of_records.clone(), of_samples.len()) {
            let samples = samples::<S>(records, piece.clone(), of_samples.clone())?;
            sums.add(piece.start - of_records.start, samples.view())?;
        }
        let scan = sums.finish();
        // The estimator takes lines by increasing elevation.
        let gates = &tile.gates;
        let order = upward(tile.lines.clone(), &lines.elevation_rad);
        let angles: Vec<f64> = order
            .iter()
            .map(|line| lines.elevation_rad[*line])
            .collect();
        let points = polar_points(&angles, &plan.geometry.gate_range_m[gates.clone()]);
        let found = estimator.gates(&scan, &points, &estimator.noise(&self.places, &points)?)?;
        for (row, line) in order.into_iter().enumerate() {
            for gate in gates.clone() {
                let at = row * gates.len() + gate - gates.start;
                cells.gates[[line, gate]] = found[at];
                if let (Some(spectra), Some(of_gate)) = (&mut cells.spectra, self.spectra) {
                    let (radius_m, density_a2) =
                        (cells.regions.1[gate], estimator.tools.noise.density_a2);
                    let one = of_gate.density(&scan, points[at], radius_m, density_a2)?;
                    let place = (line * cells.gates.ncols() + gate) * one.len();
                    spectra[place..place + one.len()].copy_from_slice(&one);
                }
            }
        }
        Ok(())
    }
}
