//! The velocities of a scan tile by tile.
//!
//! The samples of all tiles have one scale, a region sums its lines in their order, and windows have the same numbers in parts of a
//! record, so that tiles change no bit.

use super::cells::{Cell, ScanCells};
use super::lines::ScanLines;
use super::spectra::GateSpectra;
use super::tiles::{Tile, Tiling};
use super::{FromParts, RecordedOptions, pieces, samples};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::measure::map_estimator::MapEstimator;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::setup::estimators;
use crate::setup::progress::Observer;
use ndarray::Array2;
use std::ops::Range;
use wakescope_estimate::map::{ScanGeometry, polar_points};
use wakescope_estimate::{Gates, Sampling};

/// Most bytes of the sums of a tile.
const BLOCK_BYTES: usize = 256 << 20;

pub(super) struct Blocks<'p, S> {
    plan: &'p Plan,
    largest: f64,
    block_bytes: usize,
    observer: &'p dyn Observer,
    sampling: Sampling,
    gates: Gates,
    /// Expected signal-to-noise ratio of the layers of a line.
    layer_snr: Vec<(f64, f64)>,
    spectra: Option<GateSpectra>,
    sample: std::marker::PhantomData<fn(S)>,
}

impl<'p, S: FromParts> Blocks<'p, S> {
    pub(super) fn new(
        plan: &'p Plan,
        largest: f64,
        options: &RecordedOptions,
        observer: &'p dyn Observer,
    ) -> Result<Self, Error> {
        let scene = &plan.scene.scene;
        let spectra = if options.spectra { Some(GateSpectra::new(plan, S::KIND)?) } else { None };
        spectra.iter().try_for_each(|spectra| spectra.fit_a_file(plan))?;
        Ok(Self {
            plan,
            largest,
            block_bytes: options.block_bytes.unwrap_or(BLOCK_BYTES),
            observer,
            sampling: estimators::sampling(scene)?,
            gates: estimators::gates(scene)?,
            layer_snr: Scanner::expected_layer_snr(plan, observer)?,
            spectra,
            sample: std::marker::PhantomData,
        })
    }

    /// All scans, one after the other.
    pub(super) fn scans(&self, records: &mut RawRecords, scans: Vec<ScanLines>) -> Result<Vec<ScanCells>, Error> {
        let mut out = Vec::with_capacity(scans.len());
        let mut known: Option<(Vec<f64>, MapEstimator<S>, ScanGeometry)> = None;
        for lines in scans {
            // Repetitions of a scan share what was made for the first.
            if known.as_ref().is_none_or(|(angles, ..)| *angles != lines.elevation_rad) {
                let places = self.places(&lines, &(0..lines.elevation_rad.len()))?;
                let estimator = MapEstimator::new(self.plan, &self.layer_snr, &places)?;
                known = Some((lines.elevation_rad.clone(), estimator, places));
            }
            let Some((_, estimator, places)) = &known else { continue };
            out.push(self.scan(records, lines, estimator, places)?);
        }
        Ok(out)
    }

    fn places(&self, lines: &ScanLines, some: &Range<usize>) -> Result<ScanGeometry, Error> {
        let angles = lines.record_elevation_rad(some);
        Ok(ScanGeometry::new(&self.sampling, &self.gates, &angles, self.plan.geometry.samples)?)
    }

    fn scan(
        &self,
        records: &mut RawRecords,
        lines: ScanLines,
        estimator: &MapEstimator<S>,
        places: &ScanGeometry,
    ) -> Result<ScanCells, Error> {
        let shape = (lines.elevation_rad.len(), self.plan.geometry.gate_range_m.len());
        let mut cells = Array2::from_elem(shape, Cell::none());
        let mut spectra = self.spectra.as_ref().map(|of_gate| vec![0.0; shape.0 * shape.1 * of_gate.len()]);
        let tiling = Tiling::new(estimator, places, &self.plan.geometry.gate_range_m, self.block_bytes)?;
        for tile in tiling.tiles(&lines) {
            self.tile(records, &lines, (estimator, places), &tile, (&mut cells, spectra.as_deref_mut()))?;
            if tile.gates.end == shape.1 {
                self.observer.advance(tile.lines.len() as u64);
            }
        }
        let radius_m = self.plan.geometry.gate_range_m.iter().map(|range_m| estimator.radius_m(*range_m));
        let regions = (places.clone(), radius_m.collect::<Result<_, _>>()?);
        Ok(ScanCells { lines, cells, regions, spectra })
    }

    fn tile(
        &self,
        records: &mut RawRecords,
        lines: &ScanLines,
        (estimator, places): (&MapEstimator<S>, &ScanGeometry),
        tile: &Tile,
        (cells, mut spectra): (&mut Array2<Cell>, Option<&mut [f32]>),
    ) -> Result<(), Error> {
        let (read, held) = &tile.windows;
        let (of_records, of_samples) = (lines.records(read), self.gates.samples(held));
        let mut sums = estimator.sums_of(self.places(lines, read)?, held.clone())?.scaled_for(self.largest);
        for piece in pieces(of_records.clone(), of_samples.len()) {
            let samples = samples::<S>(records, piece.clone(), of_samples.clone())?;
            sums.add(piece.start - of_records.start, samples.view())?;
        }
        let scan = sums.finish();
        // The estimator takes lines by increasing elevation.
        let (guessed, gates) = &tile.guessed;
        let mut order: Vec<usize> = guessed.clone().collect();
        order.sort_by(|a, b| lines.elevation_rad[*a].total_cmp(&lines.elevation_rad[*b]));
        let angles: Vec<f64> = order.iter().map(|line| lines.elevation_rad[*line]).collect();
        let points = polar_points(&angles, &self.plan.geometry.gate_range_m[gates.clone()]);
        let found = estimator.map(&scan, &points)?;
        let noise = estimator.noise(places, &points)?;
        for (row, line) in order.into_iter().enumerate().filter(|(_, line)| tile.lines.contains(line)) {
            for gate in tile.gates.clone() {
                let at = row * gates.len() + gate - gates.start;
                let (e, radius_m) = (&found[at].estimate, estimator.radius_m(points[at].range_m)?);
                let power_a2 = if e.velocity_m_s.is_finite() { e.power } else { f64::NAN };
                cells[[line, gate]] = Cell {
                    found: found[at],
                    power_ratio: power_a2 / estimator.noise_power_a2(),
                    gain: estimator.gain(e.velocity_m_s),
                    detection_ratio: noise.detection_ratio(at, e),
                    deviation: noise.deviation(at),
                    lines: places.chords(points[at], radius_m).count() as f64,
                };
                if let (Some(spectra), Some(of_gate)) = (&mut spectra, &self.spectra) {
                    let one = of_gate.density(&scan, points[at], radius_m, estimator.noise_density_a2())?;
                    let place = (line * cells.ncols() + gate) * one.len();
                    spectra[place..place + one.len()].copy_from_slice(&one);
                }
            }
        }
        Ok(())
    }
}
