//! The kinds of scans of a scene, how the head moves, and what both may say.
//! Check: each limit is broken once.

use super::Scene;
use crate::io::MAX_TIME_S;
use crate::keys::{Checker, Is, Named, Number, keys, side};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

keys! {
    /// Pattern of the lines of sight.
    kinds Pattern by "kind" {
        /// Range-height indicator (RHI): elevation scan in one vertical plane, by the elevations of `[scan]`.
        "rhi" => Rhi {},
        /// Plan position indicator (PPI): azimuth scans at one elevation or several.
        "ppi" => Ppi {
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
        },
        /// Velocity azimuth display (VAD): evenly spaced beams on a cone.
        "vad" => Vad {
            /// Elevation of the beams, rad.
            elevation_rad: f64 = FRAC_PI_3 => 1e-3..=FRAC_PI_2 - 1e-3,
            /// Beams per turn.
            beams: usize = 24 => 4..=10_000,
        },
        /// Doppler beam swinging (DBS): four slanted beams and a vertical one.
        "dbs" => Dbs {
            /// Elevation of the slanted beams, rad.
            elevation_rad: f64 = 62.0 * PI / 180.0 => 1e-3..=FRAC_PI_2 - 1e-3,
        },
        /// One direction, line after line.
        "stare" => Stare {
            /// Elevation, rad.
            elevation_rad: f64 = FRAC_PI_2 => -FRAC_PI_2..=FRAC_PI_2,
            /// Lines, one after the other.
            lines: usize = 60 => 1..=100_000,
        },
        /// Rows of elevation about the flight path, by the elevations of `[scan]`.
        "axial" => Axial {
            /// End of the flight path towards which the lidar points.
            towards: Towards = Towards::PlusX,
            /// First azimuth beside the path, rad.
            azimuth_min_rad: f64 = -0.05 => -TAU..=TAU,
            /// Last azimuth beside the path, rad.
            azimuth_max_rad: f64 = 0.05 => -TAU..=2.0 * TAU,
            /// Angle between lines of a row, rad.
            azimuth_step_rad: f64 = 5e-3 => 1e-7..=PI,
        },
        /// Lines from a file.
        "list" => List {
            /// The file, relative to the folder of the scene: CSV, or lines of HALO's step-stare scans.
            file: String => Named("the name of a file with the lines of the scan"),
        },
    }

    /// An end of the flight path.
    choice Towards {
        /// The end towards which aircraft fly.
        PlusX = "plus_x",
        /// The end from which they come.
        MinusX = "minus_x",
    }

    /// Motion of the scanner head during a line.
    #[derive(Default)]
    choice HeadMotion {
        /// At rest during a line, moving between lines.
        #[default]
        Stepped = "stepped",
        /// Turning at `rate_rad_s`.
        Continuous = "continuous",
    }

    /// Direction of successive sweeps.
    #[derive(Default)]
    choice SweepDirection {
        /// Each from its first angle.
        #[default]
        Same = "same",
        /// Back and forth.
        Alternate = "alternate",
    }

    /// Sequence and timing of the lines.
    #[derive(Copy)]
    table HeadMotionKeys {
        /// Motion of the scanner head during a line.
        motion: HeadMotion = HeadMotion::Stepped,
        /// Repetitions of the whole pattern: sweeps, turns or cycles.
        sweeps: usize = 1 => 1..=100_000,
        /// Direction of successive sweeps.
        direction: SweepDirection = SweepDirection::Same,
        /// Largest angular rate of the head, rad/s; infinite by default.
        rate_rad_s: f64 = f64::INFINITY
            => Number(|rate| rate > 0.0, "a number above 0 in rad/s; inf for a head that jumps"),
        /// Acceleration of the head, rad/s^2.
        acceleration_rad_s2: f64 = f64::INFINITY => Number(|rate| rate > 0.0, "a number above 0 in rad/s^2, or inf"),
        /// Time per line beyond that of its pulses, s.
        dead_time_s: f64 = 0.0 => 0.0..=1e5,
    }

    /// Position of the lidar apart from its height, and the direction of north.
    #[derive(Copy)]
    table LidarPlace {
        /// Position along the flight, m.
        x_m: f64 = 0.0 => -1e6..=1e6,
        /// Position across it, m.
        y_m: f64 = 0.0 => -1e6..=1e6,
        /// Velocity of the lidar (u, v, w), m/s.
        velocity_m_s: [f64; 3] = [0.0; 3] => -1e3..=1e3,
        /// Azimuth of the flight, +x, rad; absent: that of a plane across it is `scan.azimuth_rad`, and else north.
        flight_azimuth_rad: Option<f64> = None => -TAU..=TAU,
    }

    /// How often the wind is sampled within a line.
    #[derive(Copy, Eq)]
    kinds WindOfPulses by "kind" {
        /// Once, at the middle of the line.
        "line" => Line {},
        /// Per pulse.
        "pulse" => Pulse {},
    }
}

impl Default for Pattern {
    fn default() -> Self {
        Self::Rhi {}
    }
}

impl Pattern {
    /// Whether the head may turn during a line.
    pub(crate) fn may_turn(&self) -> bool {
        matches!(self, Self::Rhi {} | Self::Ppi { .. } | Self::Axial { .. })
    }

    /// Whether sweeps may go back and forth.
    fn may_alternate(&self) -> bool {
        matches!(self, Self::Rhi {} | Self::Ppi { .. })
    }

    /// Whether the lines have the elevations of `[scan]`.
    pub(crate) fn has_scan_elevations(&self) -> bool {
        matches!(self, Self::Rhi {} | Self::Axial { .. })
    }

    /// Whether the lines have the azimuth of `[scan]`.
    pub(crate) fn has_scan_azimuth(&self) -> bool {
        matches!(self, Self::Rhi {} | Self::Stare { .. })
    }

    /// Whether the beams determine the wind at each height.
    pub(crate) fn has_beam_winds(&self) -> bool {
        matches!(self, Self::Vad { .. } | Self::Dbs { .. })
    }

    /// Key of the angle between lines, if there is one.
    pub(crate) fn step_key(&self) -> Option<&'static str> {
        match self {
            Self::Rhi {} => Some("scan.elevation_step_rad"),
            Self::Ppi { .. } | Self::Axial { .. } => Some("scan.pattern.azimuth_step_rad"),
            _ => None,
        }
    }

    /// Key of the lowest line.
    pub(crate) fn lowest_key(&self) -> &'static str {
        match self {
            Self::Rhi {} | Self::Axial { .. } => "scan.elevation_min_rad",
            Self::Ppi { .. } => "scan.pattern.elevations_rad",
            Self::List { .. } => "scan.pattern.file",
            Self::Vad { .. } | Self::Dbs { .. } | Self::Stare { .. } => {
                "scan.pattern.elevation_rad"
            }
        }
    }
}

impl Default for WindOfPulses {
    fn default() -> Self {
        Self::Line {}
    }
}

/// Lines of a scan, at most.
const MOST_LINES: f64 = 1e5;

impl Scene {
    /// How the head moves, beside the pattern.
    pub(super) fn check_head(&self, c: &mut Checker<'_>) {
        let HeadMotionKeys {
            motion,
            sweeps,
            direction,
            rate_rad_s,
            ..
        } = self.scan.head;
        let moves = motion == HeadMotion::Continuous;
        let pattern = self.scan.pattern.name();
        let turning = self.scan.pattern.may_turn();
        let allowed = format!(
            "\"stepped\" with scan.pattern.kind = \"{pattern}\"; rhi, ppi and axial may be continuous"
        );
        c.require(!moves || turning, "scan.head.motion", "continuous", allowed);
        let finite = "a finite rate in rad/s with scan.head.motion = \"continuous\"";
        c.require(
            !moves || rate_rad_s.is_finite(),
            "scan.head.rate_rad_s",
            rate_rad_s,
            finite,
        );
        let sweeping = self.scan.pattern.may_alternate();
        let back = direction == SweepDirection::Alternate;
        let allowed = format!(
            "\"same\" with scan.pattern.kind = \"{pattern}\"; rhi and ppi may go back and forth"
        );
        c.require(
            !back || sweeping,
            "scan.head.direction",
            "alternate",
            allowed,
        );
        let listed = matches!(self.scan.pattern, Pattern::List { .. });
        c.require(
            !listed || sweeps == 1,
            "scan.head.sweeps",
            sweeps,
            "1 with scan.pattern.kind = \"list\"",
        );
    }

    /// Limits that make sense only where each key is within its own.
    pub(super) fn check_scan_between(&self, c: &mut Checker<'_>) {
        let s = &self.scan;
        let azimuths = match &s.pattern {
            Pattern::Ppi {
                azimuth_min_rad,
                azimuth_max_rad,
                ..
            } => Some((*azimuth_min_rad, *azimuth_max_rad, TAU)),
            Pattern::Axial {
                azimuth_min_rad,
                azimuth_max_rad,
                ..
            } => Some((*azimuth_min_rad, *azimuth_max_rad, FRAC_PI_2)),
            _ => None,
        };
        if let Some((low_rad, high_rad, most_rad)) = azimuths {
            let fits = (0.0..=most_rad * (1.0 + 1e-9)).contains(&(high_rad - low_rad));
            let allowed = format!(
                "from scan.pattern.azimuth_min_rad, {low_rad} rad, to {most_rad:.4} rad beyond it"
            );
            if !c.require(fits, "scan.pattern.azimuth_max_rad", high_rad, allowed) {
                return;
            }
        }
        let moves = s.head.motion == HeadMotion::Continuous;
        let up_rad = s.elevation_max_rad - s.elevation_min_rad;
        let across_rad = azimuths.map_or(0.0, |(a, b, _)| b - a);
        let across = "scan.pattern.azimuth_step_rad";
        let (turn_rad, step_rad, rows, key) = match &s.pattern {
            Pattern::Rhi {} => (up_rad, s.elevation_step_rad, 1.0, "scan.elevation_step_rad"),
            Pattern::Ppi {
                elevations_rad,
                azimuth_step_rad,
                ..
            } => (
                across_rad,
                *azimuth_step_rad,
                elevations_rad.len() as f64,
                across,
            ),
            Pattern::Axial {
                azimuth_step_rad, ..
            } => (
                across_rad,
                *azimuth_step_rad,
                up_rad / s.elevation_step_rad + 1.0,
                across,
            ),
            Pattern::Vad { beams, .. } => (*beams as f64 - 1.0, 1.0, 1.0, "scan.pattern.beams"),
            Pattern::Stare { lines, .. } => (*lines as f64 - 1.0, 1.0, 1.0, "scan.pattern.lines"),
            Pattern::Dbs { .. } => (4.0, 1.0, 1.0, "scan.head.sweeps"),
            Pattern::List { .. } => return,
        };
        let line_rad =
            s.head.rate_rad_s * s.pulses_per_line as f64 / self.laser.pulse_repetition_hz;
        let lines = if moves {
            turn_rad / line_rad
        } else {
            (turn_rad / step_rad + 1e-9).floor() + 1.0
        };
        let allowed =
            format!("at most {line_rad:?} rad of a line in a sweep of {turn_rad:?} rad: slower");
        c.require(
            !moves || lines >= 1.0 - 1e-9,
            "scan.head.rate_rad_s",
            s.head.rate_rad_s,
            allowed,
        );
        let sweeps = rows * s.head.sweeps as f64;
        let all = lines * sweeps;
        let many = || format!("at most 100000 lines of sight; there would be {all:.3e}");
        let of_sweeps = side("scan.head.sweeps", s.head.sweeps as f64, many());
        let of_step = match moves {
            true => side("scan.head.rate_rad_s", s.head.rate_rad_s, many()),
            false => side(key, if step_rad == 1.0 { lines } else { step_rad }, many()),
        };
        let sides = if s.head.sweeps > 1 {
            [of_sweeps, of_step]
        } else {
            [of_step, of_sweeps]
        };
        let few = c.between(all <= MOST_LINES, &sides);
        // Pulses, and the way of the head from line to line.
        let prf_hz = self.laser.pulse_repetition_hz;
        let dead_time_s = s.head.dead_time_s;
        let turns_s = if step_rad == 1.0 {
            0.0
        } else {
            sweeps * turn_rad / s.head.rate_rad_s
        };
        let lasts_s = turns_s + lines * sweeps * (s.pulses_per_line as f64 / prf_hz + dead_time_s);
        let long = || {
            format!(
                "one for which the scan ends within {MAX_TIME_S:e} s; it would last {lasts_s:.3e} s"
            )
        };
        let sides = [
            side("scan.head.rate_rad_s", s.head.rate_rad_s, long()),
            side("scan.head.dead_time_s", dead_time_s, long()),
            side("laser.pulse_repetition_hz", prf_hz, long()),
            side("scan.pulses_per_line", s.pulses_per_line as f64, long()),
        ];
        c.between(!few || lasts_s <= MAX_TIME_S, &sides);
    }
}
