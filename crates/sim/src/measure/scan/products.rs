//! The products of the samples of a line, summed over its pulses and drawn at once.
//!
//! Each line has its own random stream, keyed by realisation and first pulse. Factors of covariances are kept between
//! realisations as far as they fit a fixed amount of memory; those of other lines are computed again and have the same bits.
//!
//! Check: estimates from draws against those from records, `tests/it/accumulation.rs`; same bytes for one thread and two.

use super::{PIECE_BYTES, ScanAir, Scanner};
use crate::Error;
use crate::progress::Observer;
use crate::streams::stream;
use ndarray::Array2;
use rayon::prelude::*;
use wakescope_signal::{AccumulatedProducts, Sample, Shot};

/// Memory of the factors that are kept, bytes.
pub(crate) const FACTORS_BYTES: usize = 96 << 20;

/// Lines whose factors are kept for a number of realisations.
pub(crate) fn kept_factors(lines: usize, factor_bytes: usize, realisations: usize) -> usize {
    if realisations < 2 {
        return 0;
    }
    lines.min(FACTORS_BYTES / factor_bytes.max(1))
}

/// Lines whose products are in memory at a time.
pub(crate) fn lines_at_once(lines: usize, products_bytes: usize) -> usize {
    (PIECE_BYTES / products_bytes.max(1))
        .max(rayon::current_num_threads())
        .min(lines.max(1))
}

/// Draws the products of the lines of a scan.
pub(crate) struct LineDraws<'s, 'p, T> {
    scanner: &'s Scanner<'p>,
    /// Lags below which products are drawn.
    lags: usize,
    /// Those of the first lines.
    kept: Vec<AccumulatedProducts<T>>,
}

impl<'s, 'p, T: Sample> LineDraws<'s, 'p, T> {
    /// Prepares the draws of a number of realisations, of products with a number of lags.
    ///
    /// # Errors
    /// [`Error::OfLine`] for a covariance that cannot be that of a record.
    pub(crate) fn new(
        scanner: &'s Scanner<'p>,
        lags: usize,
        realisations: usize,
    ) -> Result<Self, Error> {
        let samples = scanner.simulator.record().samples;
        let factor_bytes = samples * samples * size_of::<T>();
        // Realisations with turbulence of their own share no covariance.
        let shared = if scanner.plan.scene().has_air_of_each_realisation() {
            1
        } else {
            realisations
        };
        let kept = kept_factors(scanner.air.lines.len(), factor_bytes, shared);
        Ok(Self {
            scanner,
            lags: lags.min(samples),
            kept: (0..kept)
                .into_par_iter()
                .map(|line| scanner.products_of_line(&scanner.air, line))
                .collect::<Result<_, Error>>()?,
        })
    }

    /// Hands the products of one realisation to `sink`, some lines after others: the first line and, of each line, the products
    /// \[sample, lag\], A^2.
    ///
    /// # Errors
    /// As [`LineDraws::new`], and the errors of `sink`.
    pub(crate) fn in_pieces(
        &self,
        realisation: usize,
        observer: &dyn Observer,
        mut sink: impl FnMut(usize, &[Array2<T>]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let own = self.scanner.own_air(realisation)?;
        let lines = self.scanner.air.lines.len();
        let samples = self.scanner.simulator.record().samples;
        let size = lines_at_once(lines, samples * self.lags * size_of::<T>());
        for first in (0..lines).step_by(size) {
            let last = (first + size).min(lines);
            let products = (first..last)
                .into_par_iter()
                .map(|line| self.draw(realisation, own.as_ref(), line, observer))
                .collect::<Result<Vec<_>, Error>>()?;
            sink(first, &products)?;
        }
        Ok(())
    }

    fn draw(
        &self,
        realisation: usize,
        own: Option<&ScanAir>,
        line: usize,
        observer: &dyn Observer,
    ) -> Result<Array2<T>, Error> {
        let scanner = self.scanner;
        let made;
        let prepared = match self.kept.get(line) {
            Some(kept) if own.is_none() => kept,
            _ => {
                made = scanner.products_of_line(own.unwrap_or(&scanner.air), line)?;
                &made
            }
        };
        let pulses = &scanner.plan.geometry.schedule.lines[line];
        let index = realisation * scanner.pulses() + pulses.first;
        let mut rng = stream(scanner.plan.scene().seed, "products", index as u64);
        let mut products_a2 = Array2::zeros((prepared.samples(), self.lags));
        prepared.draw_into(pulses.pulses, &mut rng, &mut products_a2)?;
        observer.advance(1);
        Ok(products_a2)
    }
}

impl Scanner<'_> {
    /// Factors the covariance of the records of a line.
    fn products_of_line<T: Sample>(
        &self,
        air: &ScanAir,
        line: usize,
    ) -> Result<AccumulatedProducts<T>, Error> {
        let shot = Shot {
            previous: air.previous.as_ref().map(|lines| &lines[line]),
            ..Shot::from(air.of_signals(line))
        };
        AccumulatedProducts::new(&self.simulator, shot).map_err(|source| Error::OfLine {
            line,
            elevation_rad: self.plan.geometry.elevation_rad[line],
            source,
        })
    }
}
