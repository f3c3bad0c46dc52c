//! What the pattern of a scan, its head and the place of its lidar may say.
//! Check: each limit is broken once.

use super::{HeadMotion, HeadMotionKeys, Pattern, Scene, SweepDirection, WindOfPulses};
use crate::io::MAX_TIME_S;
use crate::keys::Checker;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Lines of a scan, at most.
const MOST_LINES: f64 = 1e5;

impl Scene {
    /// How the head moves, beside the pattern.
    pub(super) fn check_head(&self, c: &mut Checker<'_>) {
        let HeadMotionKeys { motion, sweeps, direction, rate_rad_s, .. } = self.scan.head;
        let moves = motion == HeadMotion::Continuous;
        let pattern = self.scan.pattern.name();
        let turning = matches!(self.scan.pattern, Pattern::Rhi {} | Pattern::Ppi(_) | Pattern::Axial(_));
        let allowed =
            format!("\"stepped\" with scan.pattern.kind = \"{pattern}\"; rhi, ppi and axial may be continuous");
        c.require(!moves || turning, "scan.head.motion", "continuous", allowed);
        let finite = "a finite rate in rad/s with scan.head.motion = \"continuous\"";
        c.require(!moves || rate_rad_s.is_finite(), "scan.head.rate_rad_s", rate_rad_s, finite);
        let sweeping = matches!(self.scan.pattern, Pattern::Rhi {} | Pattern::Ppi(_));
        let back = direction == SweepDirection::Alternate;
        let allowed = format!("\"same\" with scan.pattern.kind = \"{pattern}\"; rhi and ppi may go back and forth");
        c.require(!back || sweeping, "scan.head.direction", "alternate", allowed);
        let listed = matches!(self.scan.pattern, Pattern::List { .. });
        c.require(!listed || sweeps == 1, "scan.head.sweeps", sweeps, "1 with scan.pattern.kind = \"list\"");
        let jitter = self.scan.head.pointing_jitter_rad;
        let each = self.scan.wind_of_pulses == WindOfPulses::Pulse {} || self.scan.pulses_per_line == 1;
        let allowed =
            "[0.0, 0.0] unless scan.wind_of_pulses.kind = \"pulse\": pulses that share their air share their direction";
        c.require(each || jitter == [0.0; 2], "scan.head.pointing_jitter_rad", jitter, allowed);
    }

    /// Limits that make sense only where each key is within its own.
    pub(super) fn check_scan_between(&self, c: &mut Checker<'_>) {
        let s = &self.scan;
        let azimuths = match &s.pattern {
            Pattern::Ppi(p) => Some((p.azimuth_min_rad, p.azimuth_max_rad, TAU)),
            Pattern::Axial(p) => Some((p.azimuth_min_rad, p.azimuth_max_rad, FRAC_PI_2)),
            _ => None,
        };
        if let Some((low_rad, high_rad, most_rad)) = azimuths {
            let fits = (0.0..=most_rad * (1.0 + 1e-9)).contains(&(high_rad - low_rad));
            let allowed = format!("from scan.pattern.azimuth_min_rad, {low_rad} rad, to {most_rad:.4} rad beyond it");
            if !c.require(fits, "scan.pattern.azimuth_max_rad", high_rad, allowed) {
                return;
            }
        }
        let moves = s.head.motion == HeadMotion::Continuous;
        let rows = (s.elevation_max_rad - s.elevation_min_rad) / s.elevation_step_rad + 1.0;
        let (turn_rad, step_rad, rows, key) = match &s.pattern {
            Pattern::Rhi {} => {
                (s.elevation_max_rad - s.elevation_min_rad, s.elevation_step_rad, 1.0, "scan.elevation_step_rad")
            }
            Pattern::Ppi(p) => {
                let rows = p.elevations_rad.len() as f64;
                (p.azimuth_max_rad - p.azimuth_min_rad, p.azimuth_step_rad, rows, "scan.pattern.azimuth_step_rad")
            }
            Pattern::Axial(p) => {
                (p.azimuth_max_rad - p.azimuth_min_rad, p.azimuth_step_rad, rows, "scan.pattern.azimuth_step_rad")
            }
            Pattern::Vad(p) => (p.beams as f64 - 1.0, 1.0, 1.0, "scan.pattern.beams"),
            Pattern::Stare(p) => (p.lines as f64 - 1.0, 1.0, 1.0, "scan.pattern.lines"),
            Pattern::Dbs(_) => (4.0, 1.0, 1.0, "scan.head.sweeps"),
            Pattern::List { .. } => return,
        };
        let line_rad = s.head.rate_rad_s * s.pulses_per_line as f64 / self.laser.pulse_repetition_hz;
        let lines = if moves { turn_rad / line_rad } else { (turn_rad / step_rad + 1e-9).floor() + 1.0 };
        let allowed = format!("at most {line_rad:?} rad of a line in a sweep of {turn_rad:?} rad: slower");
        c.require(!moves || lines >= 1.0 - 1e-9, "scan.head.rate_rad_s", s.head.rate_rad_s, allowed);
        // Those of one sweep are counted with its limits.
        let counted = s.pattern == Pattern::default() && !moves && s.head.sweeps == 1;
        let sweeps = rows * s.head.sweeps as f64;
        let all = if counted { 0.0 } else { lines * sweeps };
        let many = || format!("at most 100000 lines of sight; there would be {all:.3e}");
        let side = |key, value: f64, allowed: String| (key, format!("{value:?}"), allowed);
        let of_sweeps = side("scan.head.sweeps", s.head.sweeps as f64, many());
        let of_step = match moves {
            true => side("scan.head.rate_rad_s", s.head.rate_rad_s, many()),
            false => side(key, if step_rad == 1.0 { lines } else { step_rad }, many()),
        };
        let sides = if s.head.sweeps > 1 { [of_sweeps, of_step] } else { [of_step, of_sweeps] };
        let few = c.between(all <= MOST_LINES, &sides);
        // Pulses, and the way of the head from line to line.
        let (prf_hz, dead_time_s) = (self.laser.pulse_repetition_hz, s.head.dead_time_s);
        let turns_s = if step_rad == 1.0 { 0.0 } else { sweeps * turn_rad / s.head.rate_rad_s };
        let lasts_s = turns_s + lines * sweeps * (s.pulses_per_line as f64 / prf_hz + dead_time_s);
        let long = || format!("one for which the scan ends within {MAX_TIME_S:e} s; it would last {lasts_s:.3e} s");
        let sides = [
            side("scan.head.rate_rad_s", s.head.rate_rad_s, long()),
            side("scan.head.dead_time_s", dead_time_s, long()),
            side("laser.pulse_repetition_hz", prf_hz, long()),
            side("scan.pulses_per_line", s.pulses_per_line as f64, long()),
        ];
        c.between(!few || lasts_s <= MAX_TIME_S, &sides);
        let apart = s.head.sweeps > 1 || *s.pattern.name() != *"rhi";
        let word = if self.estimator.follow_wind { "true" } else { "false" };
        let allowed = "false: only a single RHI has lines on both sides of each other";
        c.require(!(apart && self.estimator.follow_wind), "estimator.follow_wind", word, allowed);
    }
}
