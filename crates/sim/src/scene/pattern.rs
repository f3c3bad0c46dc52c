//! The kinds of scans of a scene, and how the head moves.

use crate::keys::{Checker, Limit, Limited, join};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

/// Which way the lidar looks, line after line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Pattern {
    /// Upwards in one vertical plane, by the elevations of `[scan]`.
    Rhi {},
    /// Round at one elevation or several.
    Ppi(Ppi),
    /// Turns of evenly spaced beams on a cone.
    Vad(Vad),
    /// Four slanted beams and one straight up.
    Dbs(Dbs),
    /// One direction, line after line.
    Stare(Stare),
    /// Rows of elevation about the flight path, by the elevations of `[scan]`.
    Axial(Axial),
    /// Lines from a file.
    List {
        /// The file, relative to the folder of the scene: CSV, or lines of HALO's step-stare scans.
        file: String,
    },
}

impl Default for Pattern {
    fn default() -> Self {
        Self::Rhi {}
    }
}

impl Pattern {
    /// Whether it is the scan of a scene that states none.
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The word that scenes have for it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Rhi {} => "rhi",
            Self::Ppi(_) => "ppi",
            Self::Vad(_) => "vad",
            Self::Dbs(_) => "dbs",
            Self::Stare(_) => "stare",
            Self::Axial(_) => "axial",
            Self::List { .. } => "list",
        }
    }
}

impl Limited for Pattern {
    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        match self {
            Self::Rhi {} | Self::List { .. } => {}
            Self::Ppi(ppi) => ppi.check_limits(at, c),
            Self::Vad(vad) => vad.check_limits(at, c),
            Self::Dbs(dbs) => dbs.check_limits(at, c),
            Self::Stare(stare) => stare.check_limits(at, c),
            Self::Axial(axial) => axial.check_limits(at, c),
        }
    }
}

section! {
    /// Sweeps of azimuth.
    Ppi {
        /// Elevation of each sweep, rad.
        elevations_rad: Vec<f64> = vec![0.05],
        /// First azimuth, rad.
        azimuth_min_rad: f64 = 0.0 => -TAU..=TAU,
        /// Last azimuth, rad; a full turn from the first ends one step before it.
        azimuth_max_rad: f64 = TAU => -TAU..=2.0 * TAU,
        /// Angle between lines, rad; a head that moves during a line has its own.
        azimuth_step_rad: f64 = TAU / 360.0 => 1e-7..=PI,
    }
}

section! {
    /// Turns of beams on a cone.
    #[derive(Copy)]
    Vad {
        /// Elevation of the beams, rad.
        elevation_rad: f64 = FRAC_PI_3 => 1e-3..=FRAC_PI_2 - 1e-3,
        /// Beams of a turn.
        beams: usize = 24 => 4..=10_000,
    }
}

section! {
    /// Doppler beam swinging.
    #[derive(Copy)]
    Dbs {
        /// Elevation of the slanted beams, rad.
        elevation_rad: f64 = 62.0 * PI / 180.0 => 1e-3..=FRAC_PI_2 - 1e-3,
    }
}

section! {
    /// One direction, at the azimuth of `[scan]`.
    #[derive(Copy)]
    Stare {
        /// Elevation, rad.
        elevation_rad: f64 = FRAC_PI_2 => -FRAC_PI_2..=FRAC_PI_2,
        /// Lines, one after the other.
        lines: usize = 60 => 1..=100_000,
    }
}

section! {
    /// A raster about the flight path, seen from behind or from the front.
    #[derive(Copy)]
    Axial {
        /// Towards which end of the flight path the lidar looks.
        towards: Towards = Towards::PlusX,
        /// First azimuth beside the path, rad.
        azimuth_min_rad: f64 = -0.05 => -TAU..=TAU,
        /// Last azimuth beside the path, rad.
        azimuth_max_rad: f64 = 0.05 => -TAU..=2.0 * TAU,
        /// Angle between lines of a row, rad.
        azimuth_step_rad: f64 = 5e-3 => 1e-7..=PI,
    }
}

/// An end of the flight path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Towards {
    /// Where aircraft fly to.
    PlusX,
    /// Where they come from.
    MinusX,
}

/// What the head does during a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HeadMotion {
    /// It stands still, and moves between lines.
    #[default]
    Stepped,
    /// It turns at `rate_rad_s`.
    Continuous,
}

/// The way of one sweep after another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SweepDirection {
    /// Each from its first angle.
    #[default]
    Same,
    /// Back and forth.
    Alternate,
}

section! {
    /// How the lines follow each other.
    #[derive(Copy)]
    HeadMotionKeys {
        /// What the head does during a line.
        motion: HeadMotion = HeadMotion::Stepped,
        /// How often the whole pattern is repeated: its sweeps, turns or cycles.
        sweeps: usize = 1 => 1..=100_000,
        /// The way of one sweep after another.
        direction: SweepDirection = SweepDirection::Same,
        /// Largest rate of the head, rad/s; without one it jumps.
        rate_rad_s: f64 = f64::INFINITY,
        /// Acceleration of the head, rad/s^2.
        acceleration_rad_s2: f64 = f64::INFINITY,
        /// Time that each line takes beside its pulses, s.
        dead_time_s: f64 = 0.0 => 0.0..=1e5,
        /// Standard deviations of azimuth and elevation of each pulse, rad.
        pointing_jitter_rad: [f64; 2] = [0.0; 2],
    }
}

section! {
    /// Where the lidar is beside its height, and where north is.
    #[derive(Copy)]
    LidarPlace {
        /// Place along the flight, m.
        x_m: f64 = 0.0 => -1e6..=1e6,
        /// Place across it, m.
        y_m: f64 = 0.0 => -1e6..=1e6,
        /// Velocity of the lidar (u, v, w), m/s.
        velocity_m_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Azimuth of the flight, +x, rad; absent: that of a plane across it is `scan.azimuth_rad`, and else north.
        #[serde(skip_serializing_if = "Option::is_none")]
        flight_azimuth_rad: Option<f64> = None => -TAU..=TAU,
    }
}

/// How many airs the pulses of a line meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum WindOfPulses {
    /// One: that of the middle of the line.
    Line {},
    /// Each its own.
    Pulse {},
    /// So many: each that of the middle of its part of the line.
    Groups {
        /// How many.
        groups: usize,
    },
}

impl Default for WindOfPulses {
    fn default() -> Self {
        Self::Line {}
    }
}

impl Limited for WindOfPulses {
    fn check_limits(&self, at: &str, c: &mut Checker<'_>) {
        if let Self::Groups { groups } = self {
            (1..=1_000_000).hold(&join(at, "groups"), groups, c);
        }
    }
}

impl WindOfPulses {
    /// Airs of a line of so many pulses.
    pub fn of_line(self, pulses: usize) -> usize {
        match self {
            Self::Line {} => 1,
            Self::Pulse {} => pulses,
            Self::Groups { groups } => groups.min(pulses),
        }
    }
}

/// Whether a table says nothing.
pub(super) fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}
