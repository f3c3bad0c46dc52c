//! The lines of a scan in blocks, each with those neighbours that its regions reach: memory that does not grow with the lines.
//!
//! The samples of all blocks have one scale, and a region sums its lines in their order, so that blocks change no bit.

use super::cells::{Cell, ScanCells};
use super::lines::ScanLines;
use super::spectra::GateSpectra;
use super::{FromParts, RecordedOptions, pieces, samples};
use crate::Error;
use crate::io::raw::RawRecords;
use crate::measure::estimators;
use crate::measure::map_estimator::MapEstimator;
use crate::measure::progress::Observer;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use ndarray::Array2;
use std::ops::Range;
use wakescope_estimate::map::{PolarPoint, ScanGeometry};
use wakescope_estimate::{Gates, Sampling};

/// Most bytes of the sums of a block.
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
        let range_m = &self.plan.geometry.gate_range_m;
        let count = lines.elevation_rad.len();
        let reach_rad = range_m.iter().try_fold(0.0_f64, |reach, range_m| -> Result<f64, Error> {
            Ok(reach.max(estimator.reach_rad(*range_m)?))
        })?;
        let line_bytes = places.gates() * estimator.numbers() * size_of::<f64>() * 9 / 8;
        let mut cells = Vec::with_capacity(count * range_m.len());
        let mut spectra = self.spectra.is_some().then(Vec::new);
        let mut first = 0;
        while first < count {
            // As many lines as fit with their neighbours, and one at least.
            let mut block = first..first + 1;
            while block.end < count
                && within(&lines, &(first..block.end + 1), estimator.windows_reach() * reach_rad).len() * line_bytes
                    <= self.block_bytes
            {
                block.end += 1;
            }
            let guessed = within(&lines, &block, (estimator.windows_reach() - 1.0) * reach_rad);
            let needed = within(&lines, &block, estimator.windows_reach() * reach_rad);
            let of_records = lines.records(&needed);
            let mut sums = estimator.sums(self.places(&lines, &needed)?)?.scaled_for(self.largest);
            for piece in pieces(of_records.clone(), records.samples()) {
                let samples = samples::<S>(records, piece.clone())?;
                sums.add(piece.start - of_records.start, samples.view())?;
            }
            let scan = sums.finish();
            // The estimator takes lines by increasing elevation.
            let mut order: Vec<usize> = guessed.collect();
            order.sort_by(|a, b| lines.elevation_rad[*a].total_cmp(&lines.elevation_rad[*b]));
            let points: Vec<PolarPoint> = order
                .iter()
                .flat_map(|line| {
                    let elevation_rad = lines.elevation_rad[*line];
                    range_m.iter().map(move |range_m| PolarPoint { range_m: *range_m, elevation_rad })
                })
                .collect();
            let found = estimator.map(&scan, &points)?;
            let noise = estimator.noise(places, &points)?;
            for line in block.clone() {
                let Some(row) = order.iter().position(|own| *own == line) else { continue };
                for at in row * range_m.len()..(row + 1) * range_m.len() {
                    let e = &found[at].estimate;
                    cells.push(Cell {
                        velocity_m_s: e.velocity_m_s,
                        power_ratio: if e.velocity_m_s.is_finite() {
                            e.power / estimator.noise_power_a2()
                        } else {
                            f64::NAN
                        },
                        detection_ratio: noise.detection_ratio(at, e),
                        deviation: noise.deviation(at),
                        width_m_s: e.width_m_s,
                        quality: e.quality,
                        level: found[at].level as f64,
                        n_eff: found[at].n_eff,
                        is_good: e.is_good(),
                    });
                    if let (Some(spectra), Some(of_gate)) = (&mut spectra, &self.spectra) {
                        let radius_m = estimator.radius_m(points[at].range_m)?;
                        of_gate.push(&scan, points[at], radius_m, estimator.noise_density_a2(), spectra)?;
                    }
                }
                self.observer.advance(1);
            }
            first = block.end;
        }
        let cells = Array2::from_shape_vec((count, range_m.len()), cells)
            .map_err(|_| wakescope_estimate::Error::Empty { field: "gates" })?;
        Ok(ScanCells { lines, cells, spectra })
    }
}

/// The lines around some lines that are at most so far from one of them; the lines of a scan go up or down.
fn within(lines: &ScanLines, some: &Range<usize>, reach_rad: f64) -> Range<usize> {
    let angles = &lines.elevation_rad;
    // A millionth of the reach for rounding.
    let near = |line: usize, end: usize| (angles[line] - angles[end]).abs() <= reach_rad * (1.0 + 1e-6);
    let before = (0..some.start).rev().take_while(|line| near(*line, some.start)).count();
    let after = (some.end..angles.len()).take_while(|line| near(*line, some.end - 1)).count();
    some.start - before..some.end + after
}
