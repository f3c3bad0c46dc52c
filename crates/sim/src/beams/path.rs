//! The angles of the lines of each kind of scan, sweep after sweep.
//!
//! Check: counts, ends and orders of the lines of each kind.

use std::f64::consts::{FRAC_PI_2, TAU};

crate::keys::choice! {
    /// A kind of sweep, by the word of CfRadial 1.4 for it.
    SweepMode {
        /// Elevation at one azimuth.
        Rhi = "rhi",
        /// A full turn of azimuth at one elevation.
        AzimuthSurveillance = "azimuth_surveillance",
        /// A part of a turn.
        Sector = "sector",
        /// Straight up.
        VerticalPointing = "vertical_pointing",
        /// One or a few directions.
        Pointing = "pointing",
    }
}

impl SweepMode {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Rhi,
        Self::AzimuthSurveillance,
        Self::Sector,
        Self::VerticalPointing,
        Self::Pointing,
    ];

    /// Whether it is made of directions, not of a way of the head.
    pub(crate) fn is_pointing(self) -> bool {
        matches!(self, Self::VerticalPointing | Self::Pointing)
    }
}

/// Azimuth and elevation, rad.
pub type Angles = [f64; 2];

/// A line of sight that a scan or a file asks for, or all those of a way of the head.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Time of its first pulse from the start of the scan, s; as soon as the head is there if absent.
    pub time_s: Option<f64>,
    /// Azimuth and elevation, rad.
    pub angles_rad: Angles,
    /// Where the head moves to from there at its rate, line after line, rad; it stands still during one line if absent.
    pub to_rad: Option<Angles>,
    /// Pulses of a line, if not as many as for others.
    pub pulses: Option<usize>,
    /// Number of its sweep, from 0.
    pub sweep: usize,
    /// The kind of its sweep.
    pub mode: SweepMode,
    /// Whether it sees air that has nothing to do with that of the others: other times, other places.
    pub apart: bool,
    /// Place of the lidar, m, and its velocity, m/s, if not those of the mount.
    pub carrier: Option<([f64; 3], [f64; 3])>,
}

impl Stop {
    /// One line of the first sweep, as soon as the head is there; directions are apart.
    pub fn new(mode: SweepMode, angles_rad: Angles) -> Self {
        let apart = mode.is_pointing();
        Self {
            time_s: None,
            angles_rad,
            to_rad: None,
            pulses: None,
            sweep: 0,
            mode,
            apart,
            carrier: None,
        }
    }
}

/// Turns a sweep round: from its end to its beginning.
pub fn reverse(sweep: &mut [Stop]) {
    sweep.reverse();
    for stop in sweep {
        if let Some(to_rad) = &mut stop.to_rad {
            std::mem::swap(to_rad, &mut stop.angles_rad);
        }
    }
}

/// Angles from `low` in steps, up to `high` at most.
pub fn steps(low_rad: f64, high_rad: f64, step_rad: f64) -> Vec<f64> {
    let lines = ((high_rad - low_rad) / step_rad + 1e-9) as usize + 1;
    (0..lines).map(|i| low_rad + i as f64 * step_rad).collect()
}

/// From one angle to another: at a rate, or in steps.
fn sweep(
    mode: SweepMode,
    ends_rad: [f64; 2],
    step_rad: f64,
    moving: bool,
    at: impl Fn(f64) -> Angles,
) -> Vec<Stop> {
    let [low_rad, high_rad] = ends_rad;
    if moving {
        return vec![Stop {
            to_rad: Some(at(high_rad)),
            ..Stop::new(mode, at(low_rad))
        }];
    }
    steps(low_rad, high_rad, step_rad)
        .into_iter()
        .map(|angle_rad| Stop::new(mode, at(angle_rad)))
        .collect()
}

/// Upwards at one azimuth.
pub fn rhi(
    azimuth_rad: f64,
    low_rad: f64,
    high_rad: f64,
    step_rad: f64,
    moving: bool,
) -> Vec<Stop> {
    sweep(
        SweepMode::Rhi,
        [low_rad, high_rad],
        step_rad,
        moving,
        |elevation_rad| [azimuth_rad, elevation_rad],
    )
}

/// Round at one elevation; a full turn has no line twice.
pub fn ppi(
    elevation_rad: f64,
    low_rad: f64,
    high_rad: f64,
    step_rad: f64,
    moving: bool,
) -> Vec<Stop> {
    // One turn, or several.
    let turns = (high_rad - low_rad) / TAU;
    let full = turns > 0.5 && (turns - turns.round()).abs() < 1e-9;
    let last_rad = if full && !moving {
        high_rad - 1e-3 * step_rad
    } else {
        high_rad
    };
    let mode = if full {
        SweepMode::AzimuthSurveillance
    } else {
        SweepMode::Sector
    };
    sweep(mode, [low_rad, last_rad], step_rad, moving, |azimuth_rad| {
        [azimuth_rad, elevation_rad]
    })
}

/// One turn of evenly spaced beams on a cone.
pub fn vad(elevation_rad: f64, beams: usize) -> Vec<Stop> {
    let of_turn = |k: usize| {
        Stop::new(
            SweepMode::AzimuthSurveillance,
            [TAU * k as f64 / beams as f64, elevation_rad],
        )
    };
    (0..beams)
        .map(|k| Stop {
            apart: true,
            ..of_turn(k)
        })
        .collect()
}

/// North, east, south, west and straight up, one cycle.
pub fn dbs(elevation_rad: f64) -> Vec<Stop> {
    let slanted = (0..4).map(|k| [f64::from(k) * FRAC_PI_2, elevation_rad]);
    slanted
        .chain([[0.0, FRAC_PI_2]])
        .map(|angles_rad| Stop::new(SweepMode::Pointing, angles_rad))
        .collect()
}

/// One direction, line after line.
pub fn stare(azimuth_rad: f64, elevation_rad: f64, lines: usize) -> Vec<Stop> {
    let up = (elevation_rad - FRAC_PI_2).abs() < 1e-9;
    let mode = if up {
        SweepMode::VerticalPointing
    } else {
        SweepMode::Pointing
    };
    vec![Stop::new(mode, [azimuth_rad, elevation_rad]); lines]
}

/// Rows of elevation, each a sweep over azimuths about `axis_rad`, back and forth.
pub fn raster(
    axis_rad: f64,
    rows_rad: &[f64],
    columns_rad: [f64; 3],
    moving: bool,
) -> Vec<Vec<Stop>> {
    let [low_rad, high_rad, step_rad] = columns_rad;
    let row = |(i, &elevation_rad): (usize, &f64)| {
        let mut row = ppi(
            elevation_rad,
            axis_rad + low_rad,
            axis_rad + high_rad,
            step_rad,
            moving,
        );
        row.iter_mut()
            .for_each(|stop| stop.mode = SweepMode::Sector);
        if i % 2 == 1 {
            reverse(&mut row);
        }
        row
    };
    rows_rad.iter().enumerate().map(row).collect()
}
