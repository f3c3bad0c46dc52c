//! The schedule of a scan in words and numbers: how long it takes, how often it comes back, what moves meanwhile.
//! Check: the default scene and a fast sweep, by hand.

use super::Plan;
use crate::SPEED_OF_LIGHT_M_S;

/// What is to be known of a scan before it runs.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ScanSchedule {
    /// The word of the scene for its pattern.
    pub pattern: &'static str,
    /// Lines of sight.
    pub lines: usize,
    /// Sweeps.
    pub sweeps: usize,
    /// Pulses.
    pub pulses: usize,
    /// Time from the first pulse to the last, s.
    pub duration_s: f64,
    /// Longest time from the beginning of a sweep to that of the next, s; NaN for one sweep.
    pub revisit_s: f64,
    /// How far the pair sinks meanwhile in free air, m; NaN where no pair is known. The wind of a scene is superposed: it carries no pair.
    pub wake_moves_m: f64,
    /// Range from which the pulse before comes back at the same time, m.
    pub ambiguous_range_m: f64,
    /// Angle that the head turns during a line, rad.
    pub smear_rad: f64,
    /// The same at the end of the scan, m.
    pub smear_m: f64,
}

impl Plan {
    /// The schedule of the scan.
    pub fn schedule(&self) -> ScanSchedule {
        let scene = self.scene();
        let scan = &self.geometry.schedule;
        let duration_s = scan.duration_s();
        let revisit_s = scan.revisit_s().unwrap_or(f64::NAN);
        let meanwhile_s = if revisit_s.is_nan() {
            duration_s
        } else {
            revisit_s
        };
        let mut flows = std::iter::once(&scene.flow).chain(&scene.added_flows);
        let pair = flows.find_map(|flow| flow.pair());
        let wake_moves_m = pair.map_or(f64::NAN, |pair| {
            meanwhile_s * crate::plan::wind::vortex_pair(pair).descent_speed_m_s()
        });
        let turned = |line: &crate::beams::Line| {
            let fastest = line.rate_rad_s[0].abs().max(line.rate_rad_s[1].abs());
            fastest * line.pulses as f64 * scan.prt_s
        };
        let smear_rad = scan.lines.iter().map(turned).fold(0.0, f64::max);
        ScanSchedule {
            pattern: scene.scan.pattern.name(),
            lines: scan.lines.len(),
            sweeps: scan.sweeps.len(),
            pulses: scan.pulses(),
            duration_s,
            revisit_s,
            wake_moves_m,
            ambiguous_range_m: 0.5 * SPEED_OF_LIGHT_M_S * scan.prt_s,
            smear_rad,
            smear_m: smear_rad * scene.scan.range_max_m,
        }
    }
}

impl std::fmt::Display for ScanSchedule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let many = |n: usize, word: &str| format!("{n} {word}{}", if n == 1 { "" } else { "s" });
        let lines = many(self.lines, "line");
        let sweeps = many(self.sweeps, "sweep");
        write!(
            f,
            "{}: {lines} in {sweeps}, {} in {:.2} s",
            self.pattern,
            many(self.pulses, "pulse"),
            self.duration_s
        )?;
        if self.revisit_s.is_finite() {
            write!(f, ", back after {:.2} s", self.revisit_s)?;
        }
        if self.wake_moves_m.is_finite() {
            write!(
                f,
                "; a wake in free air sinks {:.1} m meanwhile",
                self.wake_moves_m
            )?;
        }
        if self.smear_rad > 0.0 {
            let mrad = 1e3 * self.smear_rad;
            let smear_m = self.smear_m;
            write!(
                f,
                "; each line turns by {mrad:.2} mrad, {smear_m:.1} m at scan.range_max_m"
            )?;
        }
        write!(
            f,
            "; the pulse before is {:.1} km away",
            1e-3 * self.ambiguous_range_m
        )
    }
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::SceneFile;
    use std::path::Path;

    fn schedule(text: &str) -> super::ScanSchedule {
        Plan::new(
            SceneFile::parse(text, Path::new("s.toml")).unwrap(),
            Target::Map,
        )
        .unwrap()
        .schedule()
    }

    #[test]
    fn the_schedule_is_what_one_counts_by_hand() {
        let plain = schedule("");
        assert_eq!(
            (plain.lines, plain.pulses, plain.sweeps, plain.smear_rad),
            (185, 2960, 1, 0.0)
        );
        assert!((plain.duration_s - 2959.0 / 400.0).abs() < 1e-9 && plain.revisit_s.is_nan());
        // V0 = 500/(2 pi 47) = 1.693 m/s.
        assert!(
            (plain.wake_moves_m - 1.6931 * 7.3975).abs() < 0.01,
            "{plain:?}"
        );
        // Winds are superposed and carry no pair.
        for words in [
            "[flow]\ncross_wind_m_s = 6.0\n",
            "[[added_flows]]\nkind = \"uniform\"\nlateral_m_s = 6.0\nvertical_m_s = 0.0\n",
        ] {
            assert_eq!(schedule(words).wake_moves_m, plain.wake_moves_m, "{words}");
        }
        let text = "[scan]\nhead = { motion = \"continuous\", sweeps = 3, direction = \"alternate\", rate_rad_s = 0.03125, \
                    acceleration_rad_s2 = 0.5 }\n";
        let back = schedule(text);
        assert_eq!((back.lines, back.sweeps), (3 * 184, 3));
        assert!((back.revisit_s - 7.5).abs() < 1e-9 && (back.smear_rad - 1.25e-3).abs() < 1e-12);
        let words = back.to_string();
        assert!(
            words.contains("552 lines in 3 sweeps") && words.contains("1.25 mrad, 0.7 m"),
            "{words}"
        );
    }
}
