//! The truth of a data set that predictions are held against, as plain structures, and its reader.
//!
//! Check: the reference case; a store that is written and read.

use super::Quantity;
use crate::Error;
use crate::io::data_set::{DataSet, Split};
use std::path::Path;
use wakescope_estimate::retrieval::Side;

/// Place and strength of a vortex; also their errors or standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VortexValues {
    /// Lateral coordinate, m.
    pub y_m: f64,
    /// Height above ground, m.
    pub z_m: f64,
    /// Circulation averaged over radii of 5 to 15 m, m²/s, positive.
    pub gamma_5_15_m2_s: f64,
}

impl VortexValues {
    /// One of the three.
    #[must_use]
    pub fn value(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::LateralPosition => self.y_m,
            Quantity::Height => self.z_m,
            Quantity::Circulation => self.gamma_5_15_m2_s,
        }
    }
}

/// A vortex that exists during a scan, when the line of sight passes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueVortex {
    /// Which of the two.
    pub side: Side,
    /// Place and strength.
    pub values: VortexValues,
    /// Whether its centre is between the first and last gate and line.
    pub is_in_view: bool,
}

impl TrueVortex {
    /// Whether finding it counts: it is in view and has the least circulation, m²/s, or more.
    #[must_use]
    pub fn is_scored(&self, least_m2_s: f64) -> bool {
        self.is_in_view && self.values.gamma_5_15_m2_s >= least_m2_s
    }
}

/// A scan of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueScan {
    /// Age of the wake in its own time scale when the scan begins; NaN before the passage.
    pub age_tau: f64,
    /// The vortices that exist, at most one of each side.
    pub vortices: Vec<TrueVortex>,
}

/// A flight; its number is its index in [`Truth::flights`].
#[derive(Debug, Clone, PartialEq)]
pub struct TrueFlight {
    /// Where it belongs.
    pub split: Split,
    /// Number of its site.
    pub site: usize,
    /// Signal-to-noise ratio of one pulse in the middle of the scan, dB; NaN if it is unknown.
    pub snr_db: f64,
    /// Dissipation rate of the turbulence, m²/s³; NaN if it is unknown.
    pub dissipation_m2_s3: f64,
    /// Distance between the vortices that the aircraft leaves behind, m.
    pub spacing_m: f64,
    /// Its scans in their order.
    pub scans: Vec<TrueScan>,
}

/// The truth of a data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// All flights of the plan; none where one is not ready.
    pub flights: Vec<Option<TrueFlight>>,
    /// Scans of each flight.
    pub scans_per_flight: usize,
}

impl Truth {
    /// Reads the truth of a data set.
    ///
    /// # Errors
    /// Arrays that are missing; chunks of ready flights that are missing or damaged, with their path.
    pub fn read(folder: &Path) -> Result<(Self, DataSet), Error> {
        let data_set = DataSet::open(folder)?;
        let mut flights = Vec::with_capacity(data_set.splits.len());
        let read = |name: &str| data_set.values(name, 0..data_set.splits.len());
        let site = read("site")?;
        let snr_db = read("snr_middle")?;
        let dissipation_m2_s3 = read("dissipation")?;
        let spacing_m = read("spacing")?;
        let scans = scans(&data_set)?;
        for ((flight, split), scans) in data_set.splits.iter().enumerate().zip(scans) {
            flights.push(split.map(|split| TrueFlight {
                split,
                site: site[[flight]] as usize,
                snr_db: snr_db[[flight]],
                dissipation_m2_s3: dissipation_m2_s3[[flight]],
                spacing_m: spacing_m[[flight]],
                scans,
            }));
        }
        let truth = Self {
            flights,
            scans_per_flight: data_set.scans_per_flight,
        };
        Ok((truth, data_set))
    }

    /// Mean of a quantity over the scored vortices of the training flights: what a method that sees nothing would predict. NaN
    /// without any.
    #[must_use]
    pub(super) fn training_mean(&self, quantity: Quantity, least_m2_s: f64) -> f64 {
        let mut sum = 0.0;
        let mut count = 0.0;
        for flight in self.flights.iter().flatten() {
            if flight.split != Split::Train {
                continue;
            }
            for scan in &flight.scans {
                for vortex in &scan.vortices {
                    if vortex.is_scored(least_m2_s) {
                        sum += vortex.values.value(quantity);
                        count += 1.0;
                    }
                }
            }
        }
        sum / count
    }
}

/// The scans of each flight.
fn scans(data_set: &DataSet) -> Result<Vec<Vec<TrueScan>>, Error> {
    let read = |name: &str| data_set.values(name, 0..data_set.splits.len());
    let age_tau = read("wake_age")?;
    let y_m = read("vortex_y")?;
    let z_m = read("vortex_z")?;
    let gamma_5_15_m2_s = read("circulation_5_15")?;
    let in_view = read("in_view")?;
    let mut flights = Vec::with_capacity(data_set.splits.len());
    for flight in 0..data_set.splits.len() {
        let mut scans = Vec::with_capacity(data_set.scans_per_flight);
        for scan in 0..data_set.scans_per_flight {
            let mut vortices = Vec::new();
            for (index, side) in Side::BOTH.into_iter().enumerate() {
                let at = [flight, scan, index];
                let values = VortexValues {
                    y_m: y_m[at],
                    z_m: z_m[at],
                    gamma_5_15_m2_s: gamma_5_15_m2_s[at],
                };
                // Where there is none, its place is missing.
                if !values.y_m.is_nan() {
                    vortices.push(TrueVortex {
                        side,
                        values,
                        is_in_view: in_view[at] == 1.0,
                    });
                }
            }
            scans.push(TrueScan {
                age_tau: age_tau[[flight, scan]],
                vortices,
            });
        }
        flights.push(scans);
    }
    Ok(flights)
}
