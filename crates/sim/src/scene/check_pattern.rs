//! What the pattern of a scan, its head and the place of its lidar may say.
//! Check: each limit is broken once.

use super::{HeadMotion, HeadMotionKeys, Pattern, Scene, SweepDirection, WindOfPulses};
use crate::io::MAX_TIME_S;
use crate::keys::Checker;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Lines of a scan, at most.
const MOST_LINES: f64 = 1e5;

impl Scene {
    /// Each key for itself.
    pub(super) fn check_pattern(&self, c: &mut Checker<'_>) {
        let s = &self.scan;
        let elevation = |c: &mut Checker<'_>, key: &str, value_rad: f64| {
            c.within(key, value_rad, -FRAC_PI_2, FRAC_PI_2, "rad");
        };
        match &s.pattern {
            Pattern::Rhi {} => {}
            Pattern::Ppi(p) => {
                let list = format!("{:?}", p.elevations_rad);
                let is_list = (1..=1000).contains(&p.elevations_rad.len());
                if !is_list {
                    c.refuse("scan.pattern.elevations_rad", &list, "a list of 1 to 1000 elevations");
                }
                for (i, value_rad) in p.elevations_rad.iter().enumerate() {
                    elevation(c, &format!("scan.pattern.elevations_rad[{i}]"), *value_rad);
                }
                self.check_azimuths([p.azimuth_min_rad, p.azimuth_max_rad, p.azimuth_step_rad], TAU, c);
            }
            Pattern::Vad(p) => {
                c.within("scan.pattern.elevation_rad", p.elevation_rad, 1e-3, FRAC_PI_2 - 1e-3, "rad");
                c.count("scan.pattern.beams", p.beams, 4, 10_000);
            }
            Pattern::Dbs(p) => {
                c.within("scan.pattern.elevation_rad", p.elevation_rad, 1e-3, FRAC_PI_2 - 1e-3, "rad");
            }
            Pattern::Stare(p) => {
                elevation(c, "scan.pattern.elevation_rad", p.elevation_rad);
                c.count("scan.pattern.lines", p.lines, 1, MOST_LINES as usize);
            }
            Pattern::Axial(p) => {
                self.check_azimuths([p.azimuth_min_rad, p.azimuth_max_rad, p.azimuth_step_rad], FRAC_PI_2, c);
            }
            Pattern::List { file } => {
                c.require(!file.is_empty(), "scan.pattern.file", file, "the name of a file with the lines of the scan");
            }
        }
        self.check_head(c);
        let l = &s.lidar;
        c.within("scan.lidar.x_m", l.x_m, -1e6, 1e6, "m");
        c.within("scan.lidar.y_m", l.y_m, -1e6, 1e6, "m");
        for v in l.velocity_m_s {
            c.within("scan.lidar.velocity_m_s", v, -1e3, 1e3, "m/s");
        }
        if let Some(azimuth_rad) = l.flight_azimuth_rad {
            c.within("scan.lidar.flight_azimuth_rad", azimuth_rad, -TAU, TAU, "rad");
        }
        if let WindOfPulses::Groups { groups } = s.wind_of_pulses {
            c.count("scan.wind_of_pulses.groups", groups, 1, 1_000_000);
        }
    }

    fn check_azimuths(&self, [low_rad, high_rad, step_rad]: [f64; 3], most_rad: f64, c: &mut Checker<'_>) {
        let good = c.within("scan.pattern.azimuth_min_rad", low_rad, -TAU, TAU, "rad")
            && c.within("scan.pattern.azimuth_max_rad", high_rad, -TAU, 2.0 * TAU, "rad")
            && c.within("scan.pattern.azimuth_step_rad", step_rad, 1e-7, PI, "rad");
        let allowed = format!("from scan.pattern.azimuth_min_rad, {low_rad} rad, to {most_rad:.4} rad beyond it");
        let fits = (0.0..=most_rad * (1.0 + 1e-9)).contains(&(high_rad - low_rad));
        c.require(!good || fits, "scan.pattern.azimuth_max_rad", high_rad, allowed);
    }

    fn check_head(&self, c: &mut Checker<'_>) {
        let HeadMotionKeys { motion, sweeps, direction, rate_rad_s, acceleration_rad_s2, dead_time_s, .. } =
            self.scan.head;
        let moves = motion == HeadMotion::Continuous;
        c.require(
            rate_rad_s > 0.0,
            "scan.head.rate_rad_s",
            rate_rad_s,
            "a number above 0 in rad/s; inf for a head that jumps",
        );
        let fast = acceleration_rad_s2 > 0.0;
        c.require(fast, "scan.head.acceleration_rad_s2", acceleration_rad_s2, "a number above 0 in rad/s^2, or inf");
        c.within("scan.head.dead_time_s", dead_time_s, 0.0, 1e5, "s");
        c.count("scan.head.sweeps", sweeps, 1, 100_000);
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
        let small = jitter.iter().all(|sd| (0.0..=0.5).contains(sd));
        c.require(small, "scan.head.pointing_jitter_rad", jitter, "two standard deviations from 0 to 0.5 rad");
        let each = self.scan.wind_of_pulses == WindOfPulses::Pulse {} || self.scan.pulses_per_line == 1;
        let allowed =
            "[0.0, 0.0] unless scan.wind_of_pulses.kind = \"pulse\": pulses that share their air share their direction";
        c.require(each || jitter == [0.0; 2], "scan.head.pointing_jitter_rad", jitter, allowed);
    }

    /// Limits that make sense only where each key is within its own.
    pub(super) fn check_scan_between(&self, c: &mut Checker<'_>) {
        let s = &self.scan;
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
