//! The kinds of scans of a scene, and how the head moves.

use crate::keys::{Is, Number, keys};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

keys! {
    /// Which way the lidar looks, line after line.
    kinds Pattern by "kind" {
        /// Upwards in one vertical plane, by the elevations of `[scan]`.
        "rhi" => Rhi {},
        /// Round at one elevation or several.
        "ppi" => Ppi(Ppi),
        /// Turns of evenly spaced beams on a cone.
        "vad" => Vad(Vad),
        /// Four slanted beams and one straight up.
        "dbs" => Dbs(Dbs),
        /// One direction, line after line.
        "stare" => Stare(Stare),
        /// Rows of elevation about the flight path, by the elevations of `[scan]`.
        "axial" => Axial(Axial),
        /// Lines from a file.
        "list" => List {
            /// The file, relative to the folder of the scene: CSV, or lines of HALO's step-stare scans.
            file: String => Is(|file: &String| !file.is_empty(), "the name of a file with the lines of the scan"),
        },
    }
}

impl Default for Pattern {
    fn default() -> Self {
        Self::Rhi {}
    }
}

keys! {
    /// Sweeps of azimuth.
    table Ppi {
        /// Elevation of each sweep, rad.
        elevations_rad: Vec<f64> = vec![0.05]
            => Is(|list: &Vec<f64>| (1..=1000).contains(&list.len()), "a list of 1 to 1000 elevations")
            => -FRAC_PI_2..=FRAC_PI_2,
        /// First azimuth, rad.
        azimuth_min_rad: f64 = 0.0 => -TAU..=TAU,
        /// Last azimuth, rad; a full turn from the first ends one step before it.
        azimuth_max_rad: f64 = TAU => -TAU..=2.0 * TAU,
        /// Angle between lines, rad; a head that moves during a line has its own.
        azimuth_step_rad: f64 = TAU / 360.0 => 1e-7..=PI,
    }

    /// Turns of beams on a cone.
    #[derive(Copy)]
    table Vad {
        /// Elevation of the beams, rad.
        elevation_rad: f64 = FRAC_PI_3 => 1e-3..=FRAC_PI_2 - 1e-3,
        /// Beams of a turn.
        beams: usize = 24 => 4..=10_000,
    }

    /// Doppler beam swinging.
    #[derive(Copy)]
    table Dbs {
        /// Elevation of the slanted beams, rad.
        elevation_rad: f64 = 62.0 * PI / 180.0 => 1e-3..=FRAC_PI_2 - 1e-3,
    }

    /// One direction, at the azimuth of `[scan]`.
    #[derive(Copy)]
    table Stare {
        /// Elevation, rad.
        elevation_rad: f64 = FRAC_PI_2 => -FRAC_PI_2..=FRAC_PI_2,
        /// Lines, one after the other.
        lines: usize = 60 => 1..=100_000,
    }

    /// A raster about the flight path, seen from behind or from the front.
    #[derive(Copy)]
    table Axial {
        /// Towards which end of the flight path the lidar looks.
        towards: Towards = Towards::PlusX,
        /// First azimuth beside the path, rad.
        azimuth_min_rad: f64 = -0.05 => -TAU..=TAU,
        /// Last azimuth beside the path, rad.
        azimuth_max_rad: f64 = 0.05 => -TAU..=2.0 * TAU,
        /// Angle between lines of a row, rad.
        azimuth_step_rad: f64 = 5e-3 => 1e-7..=PI,
    }

    /// An end of the flight path.
    choice Towards {
        /// Where aircraft fly to.
        PlusX = "plus_x",
        /// Where they come from.
        MinusX = "minus_x",
    }

    /// What the head does during a line.
    #[derive(Default)]
    choice HeadMotion {
        /// It stands still, and moves between lines.
        #[default]
        Stepped = "stepped",
        /// It turns at `rate_rad_s`.
        Continuous = "continuous",
    }

    /// The way of one sweep after another.
    #[derive(Default)]
    choice SweepDirection {
        /// Each from its first angle.
        #[default]
        Same = "same",
        /// Back and forth.
        Alternate = "alternate",
    }

    /// How the lines follow each other.
    #[derive(Copy)]
    table HeadMotionKeys {
        /// What the head does during a line.
        motion: HeadMotion = HeadMotion::Stepped,
        /// How often the whole pattern is repeated: its sweeps, turns or cycles.
        sweeps: usize = 1 => 1..=100_000,
        /// The way of one sweep after another.
        direction: SweepDirection = SweepDirection::Same,
        /// Largest rate of the head, rad/s; without one it jumps.
        rate_rad_s: f64 = f64::INFINITY
            => Number(|rate| rate > 0.0, "a number above 0 in rad/s; inf for a head that jumps"),
        /// Acceleration of the head, rad/s^2.
        acceleration_rad_s2: f64 = f64::INFINITY => Number(|rate| rate > 0.0, "a number above 0 in rad/s^2, or inf"),
        /// Time that each line takes beside its pulses, s.
        dead_time_s: f64 = 0.0 => 0.0..=1e5,
        /// Standard deviations of azimuth and elevation of each pulse, rad.
        pointing_jitter_rad: [f64; 2] = [0.0; 2] => Is(
            |jitter: &[f64; 2]| jitter.iter().all(|sd| (0.0..=0.5).contains(sd)),
            "two standard deviations from 0 to 0.5 rad",
        ),
    }

    /// Where the lidar is beside its height, and where north is.
    #[derive(Copy)]
    table LidarPlace {
        /// Place along the flight, m.
        x_m: f64 = 0.0 => -1e6..=1e6,
        /// Place across it, m.
        y_m: f64 = 0.0 => -1e6..=1e6,
        /// Velocity of the lidar (u, v, w), m/s.
        velocity_m_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Azimuth of the flight, +x, rad; absent: that of a plane across it is `scan.azimuth_rad`, and else north.
        flight_azimuth_rad: Option<f64> = None => -TAU..=TAU,
    }

    /// How many airs the pulses of a line meet.
    #[derive(Copy, Eq)]
    kinds WindOfPulses by "kind" {
        /// One: that of the middle of the line.
        "line" => Line {},
        /// Each its own.
        "pulse" => Pulse {},
        /// So many: each that of the middle of its part of the line.
        "groups" => Groups {
            /// How many.
            groups: usize => 1..=1_000_000,
        },
    }
}

impl Default for WindOfPulses {
    fn default() -> Self {
        Self::Line {}
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

/// Whether a value is the one of a scene that does not state it.
pub(super) fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}
