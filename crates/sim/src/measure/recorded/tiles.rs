//! A scan in tiles of lines and gates, each with those neighbours that its regions reach: memory that grows neither with the lines
//! nor with the samples of a record.
//!
//! Check: tiles hold each gate once; for records of a million samples they are no larger than for short ones.

use crate::Error;
use crate::measure::map_estimator::MapEstimator;
use std::ops::Range;
use wakescope_estimate::map::ScanGeometry;
use wakescope_estimate::window::Sample;

/// Some lines and gates of a map, and what their estimates depend on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tile {
    pub(super) lines: Range<usize>,
    pub(super) gates: Range<usize>,
    /// Lines whose records are read, and the windows in them.
    pub(super) windows: (Range<usize>, Range<usize>),
}

/// How far a gate of the map reaches: to angles from its line, rad, and to windows.
#[derive(Debug, Clone, PartialEq)]
struct Reach {
    windows_rad: f64,
    windows: Range<usize>,
}

impl Reach {
    fn and(&self, other: &Self) -> Self {
        let start = self.windows.start.min(other.windows.start);
        let end = self.windows.end.max(other.windows.end);
        Self {
            windows_rad: self.windows_rad.max(other.windows_rad),
            windows: start..end,
        }
    }
}

/// How far each gate of a map at `range_m` reaches.
fn reaches<S: Sample>(
    estimator: &MapEstimator<'_, S>,
    places: &ScanGeometry,
    range_m: &[f64],
) -> Result<Vec<Reach>, Error> {
    let own = range_m.iter().map(|range_m| {
        let radius_m = estimator.radius.at_m(*range_m)?;
        let windows = places.gates_between(range_m - radius_m, range_m + radius_m);
        let windows_rad = if radius_m < *range_m {
            (radius_m / range_m).asin()
        } else {
            std::f64::consts::PI
        };
        Ok(Reach {
            windows_rad,
            windows,
        })
    });
    own.collect()
}

/// The tiles of a scan with lines at some elevations, rad, and gates at `range_m`: gates by increasing range and for each the lines
/// in their order. The sums of a tile take `most_bytes` at most, or it is one gate of one line.
pub(super) fn tiles<S: Sample>(
    estimator: &MapEstimator<'_, S>,
    places: &ScanGeometry,
    elevation_rad: &[f64],
    range_m: &[f64],
    most_bytes: usize,
) -> Result<Vec<Tile>, Error> {
    let reaches = reaches(estimator, places, range_m)?;
    // Sums of windows, and those of eight of them.
    let window_bytes = estimator.tools.statistic.sum_len() * size_of::<f64>() * 9 / 8;
    let step_rad = elevation_rad
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(f64::INFINITY, f64::min);
    let bytes =
        |lines: usize, reach: &Reach| lines.saturating_mul(reach.windows.len()) * window_bytes;
    let mut tiles = Vec::new();
    let mut gates = 0..0;
    while let Some(first) = reaches.get(gates.end) {
        gates = gates.end..gates.end + 1;
        let mut reach = first.clone();
        // As many gates as leave half of the bytes to more lines than one.
        while let Some(next) = reaches.get(gates.end) {
            let wider = reach.and(next);
            let near = 1.0 + 2.0 * (wider.windows_rad / step_rad).floor();
            // Infinite or NaN where lines coincide: a cast takes it.
            if 2 * bytes((near as usize).min(elevation_rad.len()).max(1), &wider) > most_bytes {
                break;
            }
            (reach, gates.end) = (wider, gates.end + 1);
        }
        let mut some = 0..0;
        while some.end < elevation_rad.len() {
            some = some.end..some.end + 1;
            let read = |end: usize| within(elevation_rad, &(some.start..end), reach.windows_rad);
            let fits = |end: &usize| bytes(read(*end).len(), &reach) <= most_bytes;
            some.end += (some.end + 1..=elevation_rad.len())
                .take_while(fits)
                .count();
            tiles.push(Tile {
                lines: some.clone(),
                gates: gates.clone(),
                windows: (
                    within(elevation_rad, &some, reach.windows_rad),
                    reach.windows.clone(),
                ),
            });
        }
    }
    Ok(tiles)
}

/// The lines around some lines that are at most so far from one of them; the lines of a scan go up or down.
fn within(elevation_rad: &[f64], some: &Range<usize>, reach_rad: f64) -> Range<usize> {
    // A millionth of the reach for rounding.
    let near = |line: usize, end: usize| {
        (elevation_rad[line] - elevation_rad[end]).abs() <= reach_rad * (1.0 + 1e-6)
    };
    let before = (0..some.start)
        .rev()
        .take_while(|line| near(*line, some.start))
        .count();
    let after = (some.end..elevation_rad.len())
        .take_while(|line| near(*line, some.end - 1))
        .count();
    some.start - before..some.end + after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::map_estimator::windows_at;
    use crate::plan::{Plan, Target};
    use crate::scene::SceneFile;
    use wakescope_estimate::map::PolarPoint;

    /// Lines a milliradian apart, records of so many samples.
    fn scene(samples: usize, words: &str) -> Plan {
        let last_m = 80.0 + (samples as f64 - 0.5) * 0.599_584_916;
        let text = format!(
            "[scan]\nelevation_min_rad = 0.1\n\
             elevation_max_rad = 0.16\nelevation_step_rad = 1e-3\nrange_min_m = 80.0\nrange_max_m = {last_m}\n\
             [estimator]\nradius_m = 5.0\n{words}"
        );
        let scene = SceneFile::parse(&text, std::path::Path::new("s.toml")).unwrap();
        Plan::new(scene, Target::Map).unwrap()
    }

    #[test]
    fn tiles_hold_each_gate_once_with_all_that_it_reaches_and_do_not_grow_with_the_record() {
        for (samples, words) in [(5_000, ""), (250_000, "gate_step_samples = 100")] {
            let plan = scene(samples, words);
            let elevation_rad = plan.geometry.elevation_rad.clone();
            let places = windows_at(&plan, &elevation_rad).unwrap();
            assert_eq!(plan.geometry.samples, samples);
            let layer_snr: Vec<(f64, f64)> = plan
                .geometry
                .layer_range_m()
                .map(|range_m| (range_m, 1.0))
                .collect();
            let estimator = MapEstimator::<f64>::new(&plan, &layer_snr, &places).unwrap();
            let range_m = &plan.geometry.gate_range_m;
            let most_bytes = 16 << 20;
            let mut held = vec![0_u8; elevation_rad.len() * range_m.len()];
            for tile in tiles(&estimator, &places, &elevation_rad, range_m, most_bytes).unwrap() {
                let (read, windows) = &tile.windows;
                let bytes = read.len() * windows.len() * estimator.tools.statistic.sum_len() * 9;
                assert!(
                    bytes <= most_bytes,
                    "{samples} samples: {bytes} bytes for {tile:?}"
                );
                for line in tile.lines.clone() {
                    tile.gates
                        .clone()
                        .for_each(|gate| held[line * range_m.len() + gate] += 1);
                }
                // What the estimates at the corners depend on: their windows.
                for line in [tile.lines.start, tile.lines.end - 1] {
                    for gate in [tile.gates.start, tile.gates.end - 1] {
                        let point = PolarPoint::at_elevation(range_m[gate], elevation_rad[line]);
                        for (line, gates) in places.chords(point, 5.0) {
                            assert!(read.contains(&line), "{point:?} {gates:?} {tile:?}");
                            assert!(
                                windows.start <= gates.start && gates.end <= windows.end,
                                "{point:?} {tile:?}"
                            );
                        }
                    }
                }
            }
            assert!(held.iter().all(|count| *count == 1), "{samples} samples");
        }
    }
}
