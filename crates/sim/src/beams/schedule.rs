//! The lines of a scan on the clock of the pulses, and the beam of each pulse.
//!
//! A sweep begins with the next pulse of the laser's clock once the head is there; between lines and between sweeps the head
//! moves, and pulses that leave meanwhile belong to no line. Check: sweeps back and forth against a table, pulse by pulse.

use super::direction::Direction;
use super::head::Head;
use super::path::{Angles, Stop, SweepMode};
use std::f64::consts::TAU;

/// Where the lidar stands and how it points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Place at the start of the scan, m.
    pub position_m: [f64; 3],
    /// Velocity, m/s.
    pub velocity_m_s: [f64; 3],
    /// An azimuth, rad, and the angle from +x that it stands for.
    pub reference_rad: (f64, f64),
}

/// One line of sight: pulses that one spectrum comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Index of its sweep.
    pub sweep: usize,
    /// Lines of equal number may share air in a region of accumulation.
    pub group: usize,
    /// Time of its first pulse in periods of the pulses from the start of the scan.
    pub tick: f64,
    /// Number of its first pulse in the scan.
    pub first: usize,
    /// Its pulses.
    pub pulses: usize,
    /// Angles at its first pulse, rad.
    pub angles_rad: Angles,
    /// How fast they change during the line, rad/s.
    pub rate_rad_s: Angles,
    /// Place of the lidar at its first pulse, m.
    pub position_m: [f64; 3],
    /// Its velocity, m/s.
    pub velocity_m_s: [f64; 3],
}

/// One pulse, or the middle of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Time from the start of the scan, s.
    pub time_s: f64,
    /// Azimuth, rad, clockwise from north.
    pub azimuth_rad: f64,
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// Where it points in the axes of the scene.
    pub direction: Direction,
    /// Where it starts, m.
    pub position_m: [f64; 3],
    /// Velocity of the lidar, m/s.
    pub velocity_m_s: [f64; 3],
}

impl Beam {
    /// The place on the beam at a range, m.
    pub fn at_range_m(&self, range_m: f64) -> [f64; 3] {
        self.direction.at_range_m(self.position_m, range_m)
    }
}

/// Where the vertical plane of a line of sight crosses a line along x, as a lidar sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Elevation, rad.
    pub elevation_rad: f64,
    /// Distance, m.
    pub range_m: f64,
    /// Position along x, m.
    pub x_m: f64,
}

/// A whole scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// Its lines in the order of time.
    pub lines: Vec<Line>,
    /// Kind and fixed angle, rad, of each sweep.
    pub sweeps: Vec<(SweepMode, f64)>,
    /// Time between pulses, s.
    pub prt_s: f64,
    /// Where the lidar is.
    pub mount: Mount,
}

impl Schedule {
    /// The kinds of the sweeps, each once, in their order.
    pub fn modes(&self) -> Vec<SweepMode> {
        let mut modes: Vec<SweepMode> = Vec::new();
        for (mode, _) in &self.sweeps {
            if !modes.contains(mode) {
                modes.push(*mode);
            }
        }
        modes
    }

    /// The lines of stops and ways, one after the other, with a time between pulses, s, and as many pulses of a line as a stop does not
    /// state otherwise.
    ///
    /// # Errors
    /// The index of a stop that the head cannot reach in the time that it asks for, and why.
    pub fn new(
        stops: &[Stop],
        prt_s: f64,
        pulses: usize,
        head: &Head,
        mount: Mount,
    ) -> Result<Self, (usize, String)> {
        let mut scan = Self {
            lines: Vec::new(),
            sweeps: Vec::new(),
            prt_s,
            mount,
        };
        // When and where the head has done its last line, and the way it then moves.
        let mut last: Option<(f64, Angles, Angles)> = None;
        for (i, stop) in stops.iter().enumerate() {
            let from = stop.angles_rad;
            let pulses = stop.pulses.unwrap_or(pulses);
            let (lines, periods, rate_rad_s) = way(stop, pulses, prt_s, head);
            let head_s = last.map_or(0.0, |(_, at, _)| head.time_s(apart_rad(at, from)));
            let tick = match (stop.time_s, last) {
                (None, None) => 0.0,
                (None, Some((end, _, moving))) => {
                    let turns = moving
                        .iter()
                        .zip(rate_rad_s)
                        .any(|(before, now)| before * now < 0.0);
                    let least_s = match stop.to_rad {
                        None => head.dead_time_s,
                        Some(_) if turns => head.turn_round_s(),
                        Some(_) => 0.0,
                    };
                    // The first pulse of the clock that is not before the head is there.
                    (end + head_s.max(least_s) / prt_s - 1e-6).ceil()
                }
                (Some(time_s), last) => {
                    let end = last.map_or(f64::NEG_INFINITY, |(end, ..)| end);
                    scan.in_time(time_s, end, head_s)
                        .map_err(|reason| (i, reason))?
                }
            };
            if scan.sweeps.len() <= stop.sweep {
                scan.sweeps.push((
                    stop.mode,
                    if stop.mode == SweepMode::Rhi {
                        from[0]
                    } else {
                        from[1]
                    },
                ));
            }
            let group = if stop.apart {
                stops.len() + i
            } else {
                stop.sweep
            };
            for line in 0..lines {
                let before = (line * pulses) as f64;
                let angles_rad =
                    std::array::from_fn(|d| from[d] + rate_rad_s[d] * (before * prt_s));
                let sweep = stop.sweep;
                let first = scan.pulses();
                let tick = tick + before;
                let own = |d: usize| mount.position_m[d] + mount.velocity_m_s[d] * (tick * prt_s);
                let (position_m, velocity_m_s) = stop
                    .carrier
                    .unwrap_or((std::array::from_fn(own), mount.velocity_m_s));
                let line = Line {
                    sweep,
                    group,
                    tick,
                    first,
                    pulses,
                    angles_rad,
                    rate_rad_s,
                    position_m,
                    velocity_m_s,
                };
                scan.lines.push(line);
            }
            last = Some((tick + periods, stop.to_rad.unwrap_or(from), rate_rad_s));
        }
        Ok(scan)
    }

    /// The tick of a time at which the head must be there, `head_s` after the line that ends at the tick `end`; or what is allowed.
    fn in_time(&self, time_s: f64, end: f64, head_s: f64) -> Result<f64, String> {
        let tick = time_s / self.prt_s;
        let earliest = end + head_s / self.prt_s;
        if tick >= earliest - 1e-6 {
            return Ok(tick);
        }
        let end_s = end * self.prt_s;
        let early_s = earliest * self.prt_s;
        Err(if time_s < end_s {
            format!("at least {end_s:?} s, the end of the line before")
        } else {
            format!("at least {early_s:?} s: the head needs {head_s:.3} s from the angles before")
        })
    }

    /// Pulses of the whole scan.
    pub fn pulses(&self) -> usize {
        self.lines.last().map_or(0, |line| line.first + line.pulses)
    }

    /// The line of a pulse of the scan.
    pub fn line_of(&self, pulse: usize) -> usize {
        self.lines
            .partition_point(|line| line.first <= pulse)
            .saturating_sub(1)
    }

    /// The beam of a pulse of the scan.
    ///
    /// # Panics
    /// If there is no such pulse.
    pub fn beam_of_pulse(&self, pulse: usize) -> Beam {
        let line = self.line_of(pulse);
        self.beam(line, (pulse - self.lines[line].first) as f64)
    }

    /// The beam at a place among the pulses of a line, which may lie between two.
    ///
    /// # Panics
    /// If there is no such line.
    pub fn beam(&self, line: usize, pulse: f64) -> Beam {
        let line = &self.lines[line];
        let after_s = pulse * self.prt_s;
        let [azimuth_rad, elevation_rad] =
            std::array::from_fn(|d| line.angles_rad[d] + line.rate_rad_s[d] * after_s);
        let (zero_rad, from_x_rad) = self.mount.reference_rad;
        Beam {
            time_s: (line.tick + pulse) * self.prt_s,
            azimuth_rad,
            elevation_rad,
            direction: Direction::new((azimuth_rad - zero_rad) + from_x_rad, elevation_rad),
            position_m: std::array::from_fn(|d| {
                line.position_m[d] + line.velocity_m_s[d] * after_s
            }),
            velocity_m_s: line.velocity_m_s,
        }
    }

    /// The beam in the middle of a line.
    pub fn middle(&self, line: usize) -> Beam {
        self.beam(line, 0.5 * (self.lines[line].pulses as f64 - 1.0))
    }

    /// The horizontal direction of the vertical plane of a beam.
    pub fn ahead(&self, beam: &Beam) -> Direction {
        let (zero_rad, from_x_rad) = self.mount.reference_rad;
        Direction::new((beam.azimuth_rad - zero_rad) + from_x_rad, 0.0)
    }

    /// Where the vertical plane of the middle of a line of sight crosses the line along x at a place (y, z), m. A plane along x
    /// crosses none: its range is not finite.
    ///
    /// # Panics
    /// If there is no such line of sight.
    pub fn crossing(&self, line: usize, (y_m, z_m): (f64, f64)) -> Crossing {
        let beam = self.middle(line);
        let [along, across, _] = self.ahead(&beam).0;
        let ahead_m = (y_m - beam.position_m[1]) / across;
        let above_m = z_m - beam.position_m[2];
        Crossing {
            elevation_rad: above_m.atan2(ahead_m),
            range_m: ahead_m.hypot(above_m),
            x_m: beam.position_m[0] + ahead_m * along,
        }
    }

    /// First and last beam of each line, by which the whole line is bounded.
    pub fn ends(&self) -> impl Iterator<Item = Beam> + '_ {
        let of_line =
            |i: usize| [0.0, (self.lines[i].pulses - 1) as f64].map(|pulse| self.beam(i, pulse));
        (0..self.lines.len()).flat_map(of_line)
    }

    /// Time from the first pulse to the last, s.
    pub fn duration_s(&self) -> f64 {
        let end = self
            .lines
            .last()
            .map_or(0.0, |line| line.tick + line.pulses as f64 - 1.0);
        (end - self.lines.first().map_or(0.0, |line| line.tick)) * self.prt_s
    }

    /// Longest time between the beginnings of sweeps, s; none for one sweep.
    pub fn revisit_s(&self) -> Option<f64> {
        let first = |sweep: usize| {
            self.lines
                .iter()
                .find(|line| line.sweep == sweep)
                .map(|line| line.tick)
        };
        let ticks: Vec<f64> = (0..self.sweeps.len()).filter_map(first).collect();
        ticks
            .windows(2)
            .map(|pair| (pair[1] - pair[0]) * self.prt_s)
            .reduce(f64::max)
    }

    /// Whether all is one RHI upwards of equal lines from a lidar that stands still: the scan that regions in a plane are for.
    pub fn is_plane(&self) -> bool {
        self.is_of_one_plane()
            && self.sweeps.len() == 1
            && self
                .lines
                .windows(2)
                .all(|pair| pair[1].angles_rad[1] > pair[0].angles_rad[1])
    }

    /// Whether all lines are in one vertical plane, up or down, and the head stands still during each.
    pub fn keeps_to_a_plane(&self) -> bool {
        self.is_of_one_plane() && self.lines.iter().all(|line| line.rate_rad_s == [0.0; 2])
    }

    fn is_of_one_plane(&self) -> bool {
        let first = self
            .lines
            .first()
            .map(|line| (line.pulses, line.angles_rad[0]));
        let here_m = self.mount.position_m;
        let still = [0.0; 3];
        let alike = |line: &Line| {
            Some((line.pulses, line.angles_rad[0])) == first
                && (line.position_m, line.velocity_m_s) == (here_m, still)
        };
        self.sweeps.iter().all(|(mode, _)| *mode == SweepMode::Rhi) && self.lines.iter().all(alike)
    }
}

/// Lines of a stop or a way, how many periods of the pulses the head is on it, and its rate, rad/s.
fn way(stop: &Stop, pulses: usize, prt_s: f64, head: &Head) -> (usize, f64, Angles) {
    let Some(to) = stop.to_rad else {
        return (1, pulses as f64, [0.0; 2]);
    };
    let turn_rad = difference(stop.angles_rad, to);
    let length_rad = turn_rad.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
    let way_s = length_rad / head.rate_rad_s;
    let lines = (way_s / (pulses as f64 * prt_s) + 1e-9) as usize;
    (
        lines,
        way_s / prt_s,
        turn_rad.map(|d| d / length_rad * head.rate_rad_s),
    )
}

/// From one pair of angles to another, rad; azimuths as they are given.
fn difference(from: Angles, to: Angles) -> Angles {
    std::array::from_fn(|d| to[d] - from[d])
}

/// How far the head turns, rad: the longer of its two ways, azimuths the shorter way round.
fn apart_rad(from: Angles, to: Angles) -> f64 {
    let [azimuth, elevation] = difference(from, to);
    (azimuth - TAU * (azimuth / TAU).round())
        .abs()
        .max(elevation.abs())
}
