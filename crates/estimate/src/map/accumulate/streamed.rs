//! The sums over the windows of a scan whose records arrive piece by piece: memory does not grow with the number of pulses.
//!
//! The windows of a line are added in the order of its rays, whatever the pieces, and all scales are powers of two, so the
//! sums have the same bits as if all records were there at once. Check: that, for pieces of several sizes, with the loudest
//! record last and with samples that are missing.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::ops::Range;

use ndarray::{Array2, ArrayView2};

use super::{BLOCK, Scan, add};
use crate::error::{Error, check, length};
use crate::estimators::Statistic;
use crate::map::ScanGeometry;
use crate::parallel::{for_each_chunk, map_each};
use crate::window::missing::{MissingRule, invalid_windows};
use crate::window::{Gates, Sample, Scratch, SignalKind};

/// Statistics of the windows of those records of a scan that have been added.
///
/// Memory: that of [`Scan`], and a few bytes for each window of a record with a sample that is not finite.
pub struct ScanSums<'s, S, T: ?Sized> {
    statistic: &'s T,
    gates: Gates,
    geometry: ScanGeometry,
    /// Gates whose windows are summed.
    held: Range<usize>,
    record_samples: usize,
    /// Numbers of each gate held, and their sums over the pulses of each line: what [`Statistic::evaluate_record`] hands over, or the
    /// statistics themselves where they are sums of products.
    numbers: usize,
    rows: Vec<f64>,
    rule: MissingRule,
    invalid: BTreeMap<usize, Vec<bool>>,
    of_products: bool,
    /// Power of two by which the samples were divided; none before the first that is not 0.
    scale: Option<f64>,
    sample: PhantomData<fn(S)>,
}

impl<'s, S: Sample, T: Statistic<S> + ?Sized> ScanSums<'s, S, T> {
    /// Starts without records; the rays of `geometry` will have records of `record_samples` samples. Samples that are not finite are
    /// missing; only [`Scan::new`], which has all records, also finds those that dwarf all others.
    ///
    /// # Errors
    /// [`Error::Length`] if statistic and gates have windows of different lengths; as [`Gates::count`].
    pub fn new(
        statistic: &'s T,
        gates: &Gates,
        geometry: ScanGeometry,
        record_samples: usize,
    ) -> Result<Self, Error> {
        let held = 0..geometry.gates();
        let sums = Self::of_gates(statistic, gates, geometry, held)?;
        length(
            "windows of a record",
            sums.geometry.gates(),
            gates.count(record_samples)?,
        )?;
        Ok(Self {
            record_samples,
            ..sums
        })
    }

    /// Starts sums over the gates `held` alone, from records of the samples [`Gates::samples`] of these gates: regions hold windows of
    /// these gates only. Regions that lie within them have the same bits as in the sums of whole records.
    ///
    /// # Errors
    /// As [`ScanSums::new`]; [`Error::OutOfRange`] for gates that the geometry does not have.
    pub fn of_gates(
        statistic: &'s T,
        gates: &Gates,
        geometry: ScanGeometry,
        held: Range<usize>,
    ) -> Result<Self, Error> {
        length("window", statistic.window_samples(), gates.window_samples)?;
        let allowed = "behind their start, at most the gates of a record";
        let exist = !held.is_empty() && held.end <= geometry.gates();
        check("end of the gates", held.end as f64, allowed, exist)?;
        // The statistics take the places of the sums.
        let numbers = statistic.sum_len().max(statistic.statistic_len());
        Ok(Self {
            statistic,
            gates: *gates,
            record_samples: gates.samples(&held).len(),
            numbers,
            rows: vec![0.0; geometry.lines() * held.len() * numbers],
            geometry,
            held,
            rule: MissingRule::NOT_FINITE,
            invalid: BTreeMap::new(),
            of_products: false,
            scale: None,
            sample: PhantomData,
        })
    }

    /// Replaces the rule for missing samples.
    pub(super) fn with_rule(self, rule: MissingRule) -> Self {
        Self { rule, ..self }
    }

    /// Sets the scale to that of samples up to `largest`, so that parts of a scan that are summed separately have the bits of the whole.
    #[must_use]
    pub fn scaled_for(mut self, largest: f64) -> Self {
        self.scale = MissingRule::NOT_FINITE.binary_scale(std::iter::once(largest));
        self
    }

    /// Adds the `records` \[ray, sample\] of the rays `first_ray`, `first_ray + 1`, ...
    ///
    /// The rays of a line must come in their order. Windows with a missing sample are left out.
    ///
    /// # Errors
    /// [`Error::Length`] for records of another length; [`Error::OutOfRange`] after products.
    pub fn add(&mut self, first_ray: usize, records: ArrayView2<'_, S>) -> Result<(), Error> {
        let (rays, samples) = records.dim();
        length("samples of a record", self.record_samples, samples)?;
        let allowed = "added to records alone, not to products";
        check("rays", rays as f64, allowed, !self.of_products)?;
        let scale = self.rescale(records);
        let gates = &self.gates;
        let rule = &self.rule;
        let count = self.held.len();
        let invalid_of_rays = map_each(rays, |ray| {
            invalid_windows(records.row(ray).iter().copied(), rule, gates, count)
        });
        for (ray, windows) in invalid_of_rays.into_iter().enumerate() {
            if let Some(windows) = windows {
                self.invalid.insert(first_ray + ray, windows);
            }
        }
        let statistic = self.statistic;
        let invalid = &self.invalid;
        let lines = &self.geometry.rays;
        let numbers = self.numbers;
        let piece = first_ray..first_ray + rays;
        let first_sample = self.held.start * gates.step_samples;
        for_each_chunk(
            &mut self.rows,
            count * numbers,
            || (Scratch::new(), Vec::with_capacity(samples)),
            |(scratch, row), line, chunk| {
                for ray in lines.within(line, &piece) {
                    row.clear();
                    for sample in records.row(ray - first_ray) {
                        row.push(sample.scaled(scale.recip()));
                    }
                    let windows = invalid.get(&ray);
                    statistic.evaluate_record(
                        row,
                        first_sample,
                        gates.step_samples,
                        &|gate| windows.is_none_or(|invalid| !invalid[gate]),
                        scratch,
                        &mut |gate, of_window| {
                            add(&mut chunk[gate * numbers..][..numbers], of_window);
                        },
                    );
                }
            },
        );
        Ok(())
    }

    /// Adds all records of the lines from `first_line` on by the sums of their products: element
    /// (k, m) of a line is the sum of s(k+m) conj(s(k)) over its rays, with as many lags m as the
    /// statistic has in [`Statistic::product_weights`] or more.
    ///
    /// # Errors
    /// [`Error::Length`] for products of another number of samples or too few lags;
    /// [`Error::OutOfRange`] if the statistic has no weights of products, for lines that the scan
    /// does not have, or after records.
    pub fn add_products(&mut self, first_line: usize, products: &[Array2<S>]) -> Result<(), Error> {
        let weights = self.statistic.product_weights();
        let allowed = "a statistic that is a sum of products of samples";
        check("product_weights", f64::NAN, allowed, weights.is_some())?;
        let weights = weights.unwrap_or_default();
        let last_line = first_line + products.len();
        let allowed = "at most the number of lines of the scan";
        check(
            "lines",
            last_line as f64,
            allowed,
            last_line <= self.geometry.lines(),
        )?;
        for line in products {
            length("samples of the products", self.record_samples, line.nrows())?;
            check(
                "lags of the products",
                line.ncols() as f64,
                "those of the statistic or more",
                line.ncols() >= weights.ncols(),
            )?;
        }
        if !self.of_products {
            let largest = self.rows.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let allowed = "0, since products are not added to records";
            check("sum of records", largest, allowed, largest == 0.0)?;
            self.of_products = true;
            self.numbers = self.statistic.statistic_len();
            self.rows = vec![0.0; self.geometry.lines() * self.held.len() * self.numbers];
        }
        let largest = self.largest_root_mean_square(first_line, products);
        let scale = self.rescale_to(self.rule.binary_scale(std::iter::once(largest)));
        let weights = weights * scale.powi(-2);
        let numbers = self.numbers;
        let step = self.gates.step_samples;
        let line_numbers = self.held.len() * numbers;
        let rows = &mut self.rows[first_line * line_numbers..][..products.len() * line_numbers];
        for_each_chunk(
            rows,
            line_numbers,
            || (),
            |(), line, chunk| {
                for (gate, sums) in chunk.chunks_mut(numbers).enumerate() {
                    add_window_products(&products[line], gate * step, &weights, sums);
                }
            },
        );
        Ok(())
    }

    /// Largest root mean square of a sample of some lines.
    fn largest_root_mean_square(&self, first_line: usize, products: &[Array2<S>]) -> f64 {
        let mut largest = 0.0_f64;
        for (line, products) in (first_line..).zip(products) {
            let rays = self.geometry.rays.count(line) as f64;
            for power in products.column(0) {
                largest = largest.max(power.to_complex().re / rays);
            }
        }
        largest.sqrt()
    }

    /// The scale for these records and the earlier ones, to which the sums are converted.
    fn rescale(&mut self, records: ArrayView2<'_, S>) -> f64 {
        self.rescale_to(self.rule.binary_scale(records.iter().copied()))
    }

    fn rescale_to(&mut self, here: Option<f64>) -> f64 {
        let scale = match (self.scale, here) {
            (Some(before), Some(here)) if here > before => {
                let factor = (before / here).powi(2);
                for sum in &mut self.rows {
                    *sum *= factor;
                }
                here
            }
            (Some(before), _) => before,
            (None, Some(here)) => here,
            (None, None) => return 1.0,
        };
        self.scale = Some(scale);
        scale
    }

    /// Replaces the sums of all gates by their statistics, in their places; no more memory is needed.
    fn sums_to_statistics(&mut self) {
        let statistic = self.statistic;
        let before = self.numbers;
        let numbers = statistic.statistic_len();
        for_each_chunk(
            &mut self.rows,
            before,
            || (Scratch::new(), vec![0.0; numbers]),
            |(scratch, one), _, sums| {
                let summed = &sums[..statistic.sum_len()];
                statistic.statistic_of_sum(summed, scratch, one);
                sums[..numbers].copy_from_slice(one);
            },
        );
        let gates = self.rows.len() / before;
        for gate in 0..gates {
            self.rows
                .copy_within(gate * before..gate * before + numbers, gate * numbers);
        }
        self.rows.truncate(gates * numbers);
        self.numbers = numbers;
    }

    /// The scan of the records that were added, ready to be averaged over any region.
    #[must_use]
    pub fn finish(mut self) -> Scan {
        if !self.of_products {
            self.sums_to_statistics();
        }
        let Self {
            geometry,
            held,
            numbers,
            rows,
            invalid,
            of_products,
            scale,
            ..
        } = self;
        // Blocks have the same gates whichever gates are stored.
        let skipped = (held.start.next_multiple_of(BLOCK) - held.start).min(held.len());
        let line_numbers = held.len() * numbers;
        let line_blocks = (held.len() - skipped).div_ceil(BLOCK) * numbers;
        let mut blocks = vec![0.0; geometry.lines() * line_blocks];
        for_each_chunk(
            &mut blocks,
            line_blocks.max(1),
            || (),
            |(), line, chunk| {
                let rows =
                    &rows[line * line_numbers + skipped * numbers..(line + 1) * line_numbers];
                for (sum, rows) in chunk.chunks_mut(numbers).zip(rows.chunks(BLOCK * numbers)) {
                    for row in rows.chunks(numbers) {
                        add(sum, row);
                    }
                }
            },
        );
        let counts = valid_before(&geometry, held.len(), &invalid);
        Scan {
            geometry,
            held,
            numbers,
            rows,
            blocks,
            counts,
            invalid,
            of_products,
            scale: scale.unwrap_or(1.0),
        }
    }
}

/// Adds the numbers of the window that begins at a sample, of all records together.
fn add_window_products<S: Sample>(
    products: &Array2<S>,
    first_sample: usize,
    weights: &Array2<f64>,
    sums: &mut [f64],
) {
    let window = weights.nrows();
    for (k, weights) in weights.rows().into_iter().enumerate() {
        let row = products.row(first_sample + k);
        let lags = row.iter().zip(weights).take(window - k);
        match S::KIND {
            SignalKind::Real => {
                for (sum, (product, weight)) in sums.iter_mut().zip(lags) {
                    *sum += product.to_complex().re * weight;
                }
            }
            SignalKind::Complex => {
                for (sum, (product, weight)) in sums.as_chunks_mut::<2>().0.iter_mut().zip(lags) {
                    let product = product.to_complex() * *weight;
                    sum[0] += product.re;
                    sum[1] += product.im;
                }
            }
        }
    }
}

/// Valid windows before each stored gate, for all lines.
fn valid_before(
    geometry: &ScanGeometry,
    gates: usize,
    invalid: &BTreeMap<usize, Vec<bool>>,
) -> Vec<usize> {
    let lines = geometry.lines();
    let mut counts = Vec::with_capacity(lines * (gates + 1));
    for line in 0..lines {
        let mut broken: Vec<&Vec<bool>> = Vec::new();
        if !invalid.is_empty() {
            broken.extend(geometry.line_rays(line).filter_map(|ray| invalid.get(&ray)));
        }
        let rays = geometry.rays.count(line);
        let mut before = 0;
        counts.push(0);
        for gate in 0..gates {
            before += rays - broken.iter().filter(|list| list[gate]).count();
            counts.push(before);
        }
    }
    counts
}
