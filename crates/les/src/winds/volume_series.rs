//! Fields in three dimensions at several times, of which at most the two about the time that was asked for last are kept.
//!
//! Between two fields the velocity is linear in time, as in a series of planes. Check: fields linear in time are exact; many
//! times in order read each field once and keep two.

use std::sync::{Arc, Mutex, PoisonError};

use super::between_times::{about, blend, check_times};
use super::volume::VolumeSnapshot;
use super::wind::Wind;
use crate::Error;
use crate::error::check_lengths;

/// Reads field number `i`.
type Reader = dyn Fn(usize) -> Result<VolumeSnapshot, Error> + Send + Sync;

/// Fields of one flow at increasing times, read when they are needed.
pub struct VolumeSeries {
    time_s: Vec<f64>,
    read: Box<Reader>,
    kept: Mutex<Vec<(usize, Arc<VolumeSnapshot>)>>,
    max_gradient_per_s: f64,
}

impl VolumeSeries {
    /// A series with the times \[s\] of its fields, what reads them, and the largest gradient of all \[1/s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for no times, and for times that are not finite or do not increase.
    pub fn new(
        time_s: Vec<f64>,
        max_gradient_per_s: f64,
        read: impl Fn(usize) -> Result<VolumeSnapshot, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        check_times(&time_s)?;
        Ok(Self { time_s, read: Box::new(read), kept: Mutex::new(Vec::new()), max_gradient_per_s })
    }

    fn field(&self, number: usize) -> Result<Arc<VolumeSnapshot>, Error> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, field)) = kept.iter().find(|(n, _)| *n == number) {
            return Ok(Arc::clone(field));
        }
        let field = Arc::new((self.read)(number)?);
        if kept.len() > 1 {
            kept.remove(0);
        }
        kept.push((number, Arc::clone(&field)));
        Ok(field)
    }
}

impl Wind for VolumeSeries {
    /// As the trait says; a time outside the series is refused.
    fn velocity_into(&self, points_m: &[[f64; 3]], time_s: f64, out_m_s: &mut [[f64; 3]]) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        let (at, weight) = about(&self.time_s, time_s)?;
        self.field(at)?.velocity_into(points_m, time_s, out_m_s)?;
        let Some(weight) = weight else { return Ok(()) };
        blend(&*self.field(at + 1)?, weight, points_m, time_s, out_m_s)
    }

    /// As the velocity: linear between two times, unknown where one of them does not know it.
    fn scalar_into(&self, points_m: &[[f64; 3]], time_s: f64, out: &mut [f64]) -> Result<(), Error> {
        let (at, weight) = about(&self.time_s, time_s)?;
        self.field(at)?.scalar_into(points_m, time_s, out)?;
        let Some(weight) = weight else { return Ok(()) };
        let mut later = vec![0.0; out.len()];
        self.field(at + 1)?.scalar_into(points_m, time_s, &mut later)?;
        out.iter_mut().zip(&later).for_each(|(out, later)| *out += weight * (later - *out));
        Ok(())
    }

    /// The largest of all fields.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        self.max_gradient_per_s
    }
}
