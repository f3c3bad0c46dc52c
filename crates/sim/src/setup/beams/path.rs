//! The angles of the lines of each kind of scan, sweep after sweep.
//!
//! Check: counts, ends and orders of the lines of each kind.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// How CfRadial names a kind of sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepMode {
    /// Elevation at one azimuth.
    Rhi,
    /// A full turn of azimuth at one elevation.
    AzimuthSurveillance,
    /// A part of a turn.
    Sector,
    /// Straight up.
    VerticalPointing,
    /// One or a few directions.
    Pointing,
}

impl SweepMode {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Rhi, Self::AzimuthSurveillance, Self::Sector, Self::VerticalPointing, Self::Pointing];

    /// The word of CfRadial 1.4 for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rhi => "rhi",
            Self::AzimuthSurveillance => "azimuth_surveillance",
            Self::Sector => "sector",
            Self::VerticalPointing => "vertical_pointing",
            Self::Pointing => "pointing",
        }
    }
}

/// Azimuth and elevation, rad.
pub type Angles = [f64; 2];

/// The way of the head in one sweep.
#[derive(Debug, Clone, PartialEq)]
pub enum Path {
    /// Still during each line: the angles of the lines.
    Stepped(Vec<Angles>),
    /// Moving at its rate from one end to the other.
    Moving {
        /// Where the sweep begins.
        from: Angles,
        /// Where it ends.
        to: Angles,
    },
}

impl Path {
    /// The same way from its end to its beginning.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Stepped(mut lines) => {
                lines.reverse();
                Self::Stepped(lines)
            }
            Self::Moving { from, to } => Self::Moving { from: to, to: from },
        }
    }
}

/// One sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPath {
    /// Its kind.
    pub mode: SweepMode,
    /// The angle that stays: azimuth of an RHI, else elevation, rad.
    pub fixed_angle_rad: f64,
    /// Its angles.
    pub path: Path,
    /// Whether its lines see air that has nothing to do with that of each other: other times, other places.
    pub apart: bool,
}

/// Angles from `low` in steps, up to `high` at most.
pub fn steps(low_rad: f64, high_rad: f64, step_rad: f64) -> Vec<f64> {
    let lines = ((high_rad - low_rad) / step_rad + 1e-9) as usize + 1;
    (0..lines).map(|i| low_rad + i as f64 * step_rad).collect()
}

/// Upwards at one azimuth.
pub fn rhi(azimuth_rad: f64, low_rad: f64, high_rad: f64, step_rad: f64, moving: bool) -> SweepPath {
    let path = if moving {
        Path::Moving { from: [azimuth_rad, low_rad], to: [azimuth_rad, high_rad] }
    } else {
        Path::Stepped(steps(low_rad, high_rad, step_rad).into_iter().map(|el| [azimuth_rad, el]).collect())
    };
    SweepPath { mode: SweepMode::Rhi, fixed_angle_rad: azimuth_rad, path, apart: false }
}

/// Round at one elevation; a full turn has no line twice.
pub fn ppi(elevation_rad: f64, low_rad: f64, high_rad: f64, step_rad: f64, moving: bool) -> SweepPath {
    let full = is_full_turn(high_rad - low_rad);
    let path = if moving {
        Path::Moving { from: [low_rad, elevation_rad], to: [high_rad, elevation_rad] }
    } else {
        let last_rad = if full { high_rad - 1e-3 * step_rad } else { high_rad };
        Path::Stepped(steps(low_rad, last_rad, step_rad).into_iter().map(|az| [az, elevation_rad]).collect())
    };
    let mode = if full { SweepMode::AzimuthSurveillance } else { SweepMode::Sector };
    SweepPath { mode, fixed_angle_rad: elevation_rad, path, apart: false }
}

/// Whether an angle is a full turn, or several.
pub fn is_full_turn(angle_rad: f64) -> bool {
    angle_rad > PI && (angle_rad / TAU - (angle_rad / TAU).round()).abs() < 1e-9
}

/// One turn of evenly spaced beams on a cone.
pub fn vad(elevation_rad: f64, beams: usize) -> SweepPath {
    let lines = (0..beams).map(|k| [TAU * k as f64 / beams as f64, elevation_rad]).collect();
    let mode = SweepMode::AzimuthSurveillance;
    SweepPath { mode, fixed_angle_rad: elevation_rad, path: Path::Stepped(lines), apart: true }
}

/// North, east, south, west and straight up, one cycle.
pub fn dbs(elevation_rad: f64) -> SweepPath {
    let slanted = (0..4).map(|k| [f64::from(k) * FRAC_PI_2, elevation_rad]);
    let lines = slanted.chain([[0.0, FRAC_PI_2]]).collect();
    SweepPath { mode: SweepMode::Pointing, fixed_angle_rad: elevation_rad, path: Path::Stepped(lines), apart: true }
}

/// One direction, line after line.
pub fn stare(azimuth_rad: f64, elevation_rad: f64, lines: usize) -> SweepPath {
    let up = (elevation_rad - FRAC_PI_2).abs() < 1e-9;
    let mode = if up { SweepMode::VerticalPointing } else { SweepMode::Pointing };
    let path = Path::Stepped(vec![[azimuth_rad, elevation_rad]; lines]);
    SweepPath { mode, fixed_angle_rad: elevation_rad, path, apart: true }
}

/// Rows of elevation, each a sweep over azimuths about `axis_rad`, back and forth.
pub fn raster(axis_rad: f64, rows_rad: &[f64], columns_rad: [f64; 3], moving: bool) -> Vec<SweepPath> {
    let [low_rad, high_rad, step_rad] = columns_rad;
    let row = |(i, &elevation_rad): (usize, &f64)| {
        let sweep = ppi(elevation_rad, axis_rad + low_rad, axis_rad + high_rad, step_rad, moving);
        let path = if i % 2 == 1 { sweep.path.reversed() } else { sweep.path };
        SweepPath { mode: SweepMode::Sector, path, ..sweep }
    };
    rows_rad.iter().enumerate().map(row).collect()
}
