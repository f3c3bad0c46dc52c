//! The wind of one window and height with its standard errors, what follows from it, and what is to be known of it.
//!
//! Check: `wind` in the tests of the program.

use super::WindOptions;
use super::directions::{Components, Kind};
use super::heights::{Bin, BinWind, FoundWind};
use super::turbulence::{LayerTurbulence, RunTurbulence};
use super::windows::Window;
use crate::Error;
use ndarray::Array2;
use wakescope_estimate::Measured;

/// Standard deviation of a vertical wind that is taken as 0, m/s.
const UNKNOWN_UP_M_S: f64 = 0.3;
/// Half the width of a 95 % interval in standard deviations.
const INTERVAL: f64 = 1.96;
/// Deviations that a dissipation or a speed must exceed 0 by.
const ABOVE_ZERO: f64 = 2.0;
/// Probability of an outer scale at an end of those tried from which on it is to be known.
const AT_EDGE: f64 = 0.5;

crate::keys::choice! {
    /// What is to be known of a row.
    Flag {
        /// The directions do not determine the vertical wind: it is taken as 0 with a standard deviation of 0.3 m/s.
        VerticalTakenAsZero = "vertical_taken_as_zero",
        /// Neighbouring heights were fitted together with this one.
        FewCells = "few_cells",
        /// The wind across the beam is not known; 5 m/s are assumed for the standard deviations.
        WindAssumed = "wind_assumed",
        /// The wind across the plane of a scan in elevation is not known: it is taken as 0, by which the dissipation may be too high.
        CrossWindUnknown = "cross_wind_unknown",
        /// The dissipation is less than two standard deviations.
        EdrBelowNoise = "edr_below_noise",
        /// The outer scale is at an end of those that are tried.
        OuterScaleAtEdge = "outer_scale_at_edge",
        /// Standard deviations are those of the residuals: there is no dissipation.
        ResidualError = "residual_error",
        /// The velocities are noise.
        Noise = "noise",
        /// The directions do not determine the wind.
        Undetermined = "undetermined",
        /// The vertical wind would be beyond 30 m/s, as where velocities are folded.
        VerticalImpossible = "vertical_impossible",
    }
}

/// Wind and turbulence of one window and height. What is not determined is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct WindRow {
    /// Number of the window, from 1.
    pub window: usize,
    /// Start and end of the window, s.
    pub start_s: f64,
    /// End of the window, s.
    pub end_s: f64,
    /// Height over the lidar, m.
    pub height_m: f64,
    /// Which components there are.
    pub kind: Kind,
    /// Azimuth of a plane or a beam, degrees.
    pub azimuth_deg: f64,
    /// Elevation of a beam, degrees.
    pub elevation_deg: f64,
    /// Wind to the east, m/s.
    pub east_m_s: Measured,
    /// Wind to the north, m/s.
    pub north_m_s: Measured,
    /// Vertical wind, m/s, positive upward.
    pub up_m_s: Measured,
    /// Wind along the azimuth of a plane, m/s.
    pub along_m_s: Measured,
    /// Wind along a beam, m/s, positive away from the lidar.
    pub radial_m_s: Measured,
    /// Horizontal speed, m/s.
    pub speed_m_s: Measured,
    /// Direction from which the wind comes, degrees clockwise from north.
    pub from_deg: Measured,
    /// Covariance of the components in the order of the columns, m²/s².
    pub covariance_m2_s2: Array2<f64>,
    /// Cube root of the dissipation, m^(2/3)/s, and the 95 % interval.
    pub edr_m23_s: f64,
    /// Lower end.
    pub edr_low_m23_s: f64,
    /// Upper end.
    pub edr_high_m23_s: f64,
    /// Outer scale, m: the geometric mean over its probabilities.
    pub outer_scale_m: f64,
    /// Standard deviation of the noise of a velocity, m/s.
    pub noise_std_m_s: f64,
    /// Standard deviation of good velocities about the wind, m/s.
    pub residual_std_m_s: f64,
    /// Velocities of this height.
    pub cells: usize,
    /// Good ones, as many as their probabilities add up to.
    pub good_cells: f64,
    /// Fraction of bad ones.
    pub bad_fraction: f64,
    /// Log-likelihood of the wind over that of noise.
    pub likelihood: f64,
    /// What is to be known.
    pub flags: Vec<Flag>,
}

const UNKNOWN: Measured = Measured {
    value: f64::NAN,
    std: f64::NAN,
};

/// The row of a bin.
///
/// # Errors
/// None for a wind that was found.
pub(super) fn row(
    (number, window, components): (usize, &Window, &Components),
    bin: &Bin,
    turbulence: &RunTurbulence,
    options: &WindOptions,
) -> Result<WindRow, Error> {
    let mut row = empty_row((number, window, components), bin);
    let found = match &bin.wind {
        BinWind::Undetermined => {
            row.flags.push(Flag::Undetermined);
            return Ok(row);
        }
        BinWind::Noise { likelihood } => {
            row.likelihood = *likelihood;
            row.flags.push(Flag::Noise);
            return Ok(row);
        }
        BinWind::Impossible { likelihood } => {
            row.likelihood = *likelihood;
            row.flags.push(Flag::VerticalImpossible);
            return Ok(row);
        }
        BinWind::Found(found) => found,
    };
    row.residual_std_m_s = found.fit.std_m_s;
    row.good_cells = found.own_weights(bin.cells.len()).iter().sum();
    row.bad_fraction = found.fit.bad_fraction;
    row.likelihood = found.fit.likelihood;
    if found.has_no_up {
        row.flags.push(Flag::VerticalTakenAsZero);
    }
    if found.has_few_cells {
        row.flags.push(Flag::FewCells);
    }
    if options.cross_winds.is_empty() {
        row.flags.extend(match components.kind {
            Kind::Full => None,
            Kind::Plane => Some(Flag::CrossWindUnknown),
            Kind::Up | Kind::Radial => Some(Flag::WindAssumed),
        });
    }
    let in_turbulence = turbulence.wind_covariance(number, bin, found, &window.rays, options)?;
    match turbulence.of_height(number, bin.height_m, options.layer_m) {
        Some(layer) => add_turbulence(&mut row, layer, &turbulence.outer_scales),
        None => row.flags.push(Flag::ResidualError),
    }
    let covariance = match in_turbulence {
        Some(covariance) => covariance,
        // as if the residuals were noise
        None => found.noise_covariance_m2_s2(options.gate_stride, |_| found.fit.std_m_s),
    };
    add_wind(&mut row, found, with_unknown_up(found, covariance));
    Ok(row)
}

/// The row of a bin without a wind.
fn empty_row((number, window, components): (usize, &Window, &Components), bin: &Bin) -> WindRow {
    WindRow {
        window: number + 1,
        start_s: window.start_s,
        end_s: window.end_s,
        height_m: bin.height_m,
        kind: components.kind,
        azimuth_deg: components.azimuth_deg,
        elevation_deg: components.elevation_deg,
        east_m_s: UNKNOWN,
        north_m_s: UNKNOWN,
        up_m_s: UNKNOWN,
        along_m_s: UNKNOWN,
        radial_m_s: UNKNOWN,
        speed_m_s: UNKNOWN,
        from_deg: UNKNOWN,
        covariance_m2_s2: Array2::zeros((0, 0)),
        edr_m23_s: f64::NAN,
        edr_low_m23_s: f64::NAN,
        edr_high_m23_s: f64::NAN,
        outer_scale_m: f64::NAN,
        noise_std_m_s: f64::NAN,
        residual_std_m_s: f64::NAN,
        cells: bin.cells.len(),
        good_cells: f64::NAN,
        bad_fraction: f64::NAN,
        likelihood: f64::NAN,
        flags: Vec::new(),
    }
}

/// Dissipation with its interval, and what is to be known of it.
fn add_turbulence(row: &mut WindRow, layer: &LayerTurbulence, outer_scales: &[(f64, f64)]) {
    let low = layer.eps23 - INTERVAL * layer.eps23_std;
    let high = layer.eps23 + INTERVAL * layer.eps23_std;
    row.edr_m23_s = layer.eps23.sqrt();
    row.edr_low_m23_s = low.max(0.0).sqrt();
    row.edr_high_m23_s = high.sqrt();
    row.noise_std_m_s = layer.noise_std_m_s;
    let logarithms = outer_scales
        .iter()
        .map(|(outer_scale_m, p)| p * outer_scale_m.ln());
    row.outer_scale_m = logarithms.sum::<f64>().exp();
    if layer.eps23 < ABOVE_ZERO * layer.eps23_std {
        row.flags.push(Flag::EdrBelowNoise);
    }
    if let [first, .., last] = outer_scales
        && first.1.max(last.1) > AT_EDGE
    {
        row.flags.push(Flag::OuterScaleAtEdge);
    }
}

/// The covariance with what an unknown vertical wind adds to the other components, and with the variance of its own.
fn with_unknown_up(found: &FoundWind, covariance: Array2<f64>) -> Array2<f64> {
    if !found.has_no_up {
        return covariance;
    }
    let variance = UNKNOWN_UP_M_S * UNKNOWN_UP_M_S;
    let ups: Vec<f64> = found.used.iter().map(|cell| cell.direction[2]).collect();
    let shift = found.gain.dot(&ndarray::aview1(&ups));
    let count = covariance.nrows();
    Array2::from_shape_fn((count + 1, count + 1), |(i, j)| {
        let slope = |index: usize| if index == count { -1.0 } else { shift[index] };
        let own = if i < count && j < count {
            covariance[[i, j]]
        } else {
            0.0
        };
        own + variance * slope(i) * slope(j)
    })
}

/// The components with their standard deviations, and what follows from them.
fn add_wind(row: &mut WindRow, found: &FoundWind, covariance: Array2<f64>) {
    let mut values = found.fit.wind_m_s.clone();
    if found.has_no_up {
        values.push(0.0);
    }
    let component = |index: usize| Measured {
        value: values[index],
        std: covariance[[index, index]].sqrt(),
    };
    match row.kind {
        Kind::Full => {
            row.east_m_s = component(0);
            row.north_m_s = component(1);
            row.up_m_s = component(2);
            add_speed(row, &covariance);
        }
        Kind::Plane => {
            row.along_m_s = component(0);
            row.up_m_s = component(1);
        }
        Kind::Up => row.up_m_s = component(0),
        Kind::Radial => row.radial_m_s = component(0),
    }
    row.covariance_m2_s2 = covariance;
}

/// Speed and direction of a horizontal wind.
fn add_speed(row: &mut WindRow, covariance: &Array2<f64>) {
    let wind = [row.east_m_s.value, row.north_m_s.value];
    let speed = wind[0].hypot(wind[1]);
    let variance_along = |unit: [f64; 2]| {
        let mut sum = 0.0;
        for i in 0..2 {
            for j in 0..2 {
                sum += unit[i] * covariance[[i, j]] * unit[j];
            }
        }
        sum
    };
    let along = [wind[0] / speed, wind[1] / speed];
    let across = [-along[1], along[0]];
    row.speed_m_s = Measured {
        value: speed,
        std: variance_along(along).sqrt(),
    };
    if speed >= ABOVE_ZERO * row.speed_m_s.std {
        row.from_deg = Measured {
            value: (-wind[0]).atan2(-wind[1]).to_degrees().rem_euclid(360.0),
            std: (variance_along(across).sqrt() / speed).to_degrees(),
        };
    }
}

impl WindRow {
    /// The components of the kind of the row with their names, in the order of the covariance.
    #[must_use]
    pub fn components(&self) -> Vec<(&'static str, Measured)> {
        match self.kind {
            Kind::Full => vec![
                ("east", self.east_m_s),
                ("north", self.north_m_s),
                ("up", self.up_m_s),
            ],
            Kind::Plane => vec![("along", self.along_m_s), ("up", self.up_m_s)],
            Kind::Up => vec![("up", self.up_m_s)],
            Kind::Radial => vec![("radial", self.radial_m_s)],
        }
    }

    /// Whether it has a wind.
    #[must_use]
    pub fn has_wind(&self) -> bool {
        let without = [Flag::Noise, Flag::Undetermined, Flag::VerticalImpossible];
        !self.flags.iter().any(|flag| without.contains(flag))
    }

    /// Dissipation rate, m²/s³.
    #[must_use]
    pub fn dissipation_m2_s3(&self) -> f64 {
        self.edr_m23_s.powi(3)
    }
}
