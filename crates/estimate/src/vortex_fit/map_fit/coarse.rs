//! Some lines and gates of a map: every few, as many as its regions and gates resolve, or those near a point.
//!
//! Neighbouring places of a map see much the same air, so some of them tell nearly all, and what varies no faster than they do is
//! known everywhere from there, linear between. Check: planes are linear between places; holes; what is too small stays whole.

use ndarray::{Array2, ArrayView2, Axis};

use crate::vortex_fit::VelocityMap;
use crate::vortex_fit::map_fit::cells::Cell;

/// Fewer velocities than this are not thinned: they would leave too few for the scale of the residuals.
const NEEDED: usize = 500;

/// Some lines and gates of a map, and the map there.
pub(crate) struct Coarse {
    lines: Vec<usize>,
    gates: Vec<usize>,
    elevation_rad: Vec<f64>,
    range_m: Vec<f64>,
    velocity_m_s: Array2<f64>,
    standard_deviation_m_s: Option<Array2<f64>>,
    /// Lines of the whole map from one to the next.
    pub(crate) line_step: usize,
}

impl Coarse {
    /// Places of a map no farther apart than `line_m` across and `gate_m` along its lines \[m\], unless those of the map are; all of
    /// them where these are too few.
    pub(crate) fn of(map: &VelocityMap<'_>, line_m: f64, gate_m: f64) -> Self {
        let (line_step, lines) = every(map.elevation_rad.len(), line_m / map.line_spacing_m());
        let (gate_step, gates) = every(map.range_m.len(), gate_m / map.gate_spacing_m());
        let some = Self::at(map, lines, gates, line_step);
        let found = some.velocity_m_s.iter().filter(|v| v.is_finite()).count();
        if line_step * gate_step == 1 || found >= NEEDED {
            return some;
        }
        let (all_lines, all_gates) = map.velocity_m_s.dim();
        Self::at(map, (0..all_lines).collect(), (0..all_gates).collect(), 1)
    }

    /// The lines and gates that hold a place which is near, `is_near(line, gate)`; without the velocities of those that are not.
    pub(crate) fn near(map: &VelocityMap<'_>, is_near: impl Fn(usize, usize) -> bool) -> Self {
        let (all_lines, all_gates) = map.velocity_m_s.dim();
        let lines: Vec<usize> = (0..all_lines)
            .filter(|line| (0..all_gates).any(|gate| is_near(*line, gate)))
            .collect();
        let gates: Vec<usize> = (0..all_gates)
            .filter(|gate| (0..all_lines).any(|line| is_near(line, *gate)))
            .collect();
        let mut near = Self::at(map, lines, gates, 1);
        for ((line, gate), velocity_m_s) in near.velocity_m_s.indexed_iter_mut() {
            if !is_near(near.lines[line], near.gates[gate]) {
                *velocity_m_s = f64::NAN;
            }
        }
        near
    }

    fn at(map: &VelocityMap<'_>, lines: Vec<usize>, gates: Vec<usize>, line_step: usize) -> Self {
        let elevation_rad = lines.iter().map(|&line| map.elevation_rad[line]).collect();
        let range_m = gates.iter().map(|&gate| map.range_m[gate]).collect();
        let deviation_m_s = map.standard_deviation_m_s;
        Self {
            elevation_rad,
            range_m,
            velocity_m_s: selected(map.velocity_m_s, &lines, &gates),
            standard_deviation_m_s: deviation_m_s.map(|all| selected(all, &lines, &gates)),
            line_step,
            lines,
            gates,
        }
    }

    /// The map there.
    pub(crate) fn map(&self) -> VelocityMap<'_> {
        VelocityMap {
            elevation_rad: &self.elevation_rad,
            range_m: &self.range_m,
            velocity_m_s: self.velocity_m_s.view(),
            standard_deviation_m_s: self
                .standard_deviation_m_s
                .as_ref()
                .map(|deviation| deviation.view()),
        }
    }

    /// The same cells, numbered as in the whole map.
    pub(crate) fn in_whole_map(&self, cells: &[Cell]) -> Vec<Cell> {
        let mut whole = cells.to_vec();
        for cell in &mut whole {
            cell.line = self.lines[cell.line];
            cell.gate = self.gates[cell.gate];
        }
        whole
    }

    /// Numbers of these places at all places of a map of that size: linear between, and beyond the outermost as there. Numbers
    /// that are not finite are left out.
    pub(crate) fn everywhere(&self, some: &Array2<f64>, size: (usize, usize)) -> Array2<f64> {
        let lines: Vec<_> = (0..size.0).map(|at| neighbours(&self.lines, at)).collect();
        let gates: Vec<_> = (0..size.1).map(|at| neighbours(&self.gates, at)).collect();
        Array2::from_shape_fn(size, |(line, gate)| {
            let [mut sum, mut shares] = [0.0; 2];
            for (i, by_line) in lines[line] {
                for (j, by_gate) in gates[gate] {
                    let share = by_line * by_gate;
                    let number = some[[i, j]];
                    if share > 0.0 && number.is_finite() {
                        sum += share * number;
                        shares += share;
                    }
                }
            }
            sum / shares
        })
    }
}

fn selected(all: ArrayView2<'_, f64>, lines: &[usize], gates: &[usize]) -> Array2<f64> {
    all.select(Axis(0), lines).select(Axis(1), gates)
}

/// At most every `step`th of `count` places, about the middle: from one to the next, and which.
pub(crate) fn every(count: usize, step: f64) -> (usize, Vec<usize>) {
    // also 1 for NaN
    let step = (step.max(1.0) as usize).min(count.max(1));
    (
        step,
        (count.saturating_sub(1) % step / 2..count)
            .step_by(step)
            .collect(),
    )
}

/// The chosen places before and after a place, with their shares.
fn neighbours(chosen: &[usize], at: usize) -> [(usize, f64); 2] {
    let next = chosen.partition_point(|&place| place <= at);
    let low = next.saturating_sub(1);
    let high = next.min(chosen.len() - 1);
    let gap = chosen[high] - chosen[low];
    let share = if gap == 0 {
        0.0
    } else {
        (at - chosen[low]) as f64 / gap as f64
    };
    [(low, 1.0 - share), (high, share)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> (Vec<f64>, Vec<f64>) {
        // 1 m and 5 m at 500 m
        (
            (0..90).map(|i| f64::from(i) * 2e-3).collect(),
            (0..41).map(|j| 400.0 + 5.0 * f64::from(j)).collect(),
        )
    }

    #[test]
    fn planes_are_known_everywhere_from_some_places_even_next_to_holes() {
        let (elevation_rad, range_m) = axes();
        let plane = Array2::from_shape_fn((90, 41), |(line, gate)| {
            1.0 + 0.5 * line as f64 - 0.25 * gate as f64
        });
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: plane.view(),
            standard_deviation_m_s: Some(plane.view()),
        };
        let coarse = Coarse::of(&map, 3.1, 10.5);
        let some = coarse.map();
        assert_eq!((coarse.line_step, some.velocity_m_s.dim()), (3, (30, 21)));
        assert_eq!(some.elevation_rad[1], elevation_rad[coarse.lines[1]]);
        assert_eq!(some.range_m[1], range_m[coarse.gates[1]]);
        assert_eq!(
            some.standard_deviation_m_s.unwrap()[[1, 1]],
            plane[[coarse.lines[1], coarse.gates[1]]]
        );
        let mut numbers = coarse.velocity_m_s.clone();
        let everywhere = coarse.everywhere(&numbers, plane.dim());
        for ((line, gate), number) in everywhere.indexed_iter() {
            // beyond the outermost places as there
            let at =
                |place: usize, chosen: &[usize]| place.clamp(chosen[0], chosen[chosen.len() - 1]);
            let expected = plane[[at(line, &coarse.lines), at(gate, &coarse.gates)]];
            assert!(
                (number - expected).abs() < 1e-12,
                "{line} {gate}: {number} {expected}"
            );
        }
        numbers[[3, 4]] = f64::NAN;
        let holed = coarse.everywhere(&numbers, plane.dim());
        let hole = [coarse.lines[3], coarse.gates[4]];
        for (place, number) in holed.indexed_iter() {
            assert_eq!(number.is_nan(), [place.0, place.1] == hole, "{place:?}");
        }
        assert_eq!(holed[[hole[0], hole[1] + 1]], plane[[hole[0], hole[1] + 2]]);
    }

    #[test]
    fn maps_that_are_coarse_or_small_stay_whole() {
        let (elevation_rad, range_m) = axes();
        let velocity = Array2::zeros((90, 41));
        let map = VelocityMap {
            elevation_rad: &elevation_rad,
            range_m: &range_m,
            velocity_m_s: velocity.view(),
            standard_deviation_m_s: None,
        };
        for (line_m, gate_m, size) in [
            (0.0, 9.0, (90, 41)),
            (f64::NAN, 9.0, (90, 41)),
            (9.0, 20.0, (90, 41)),
            (0.0, 11.0, (90, 21)),
        ] {
            let coarse = Coarse::of(&map, line_m, gate_m);
            assert_eq!(coarse.map().velocity_m_s.dim(), size, "{line_m} {gate_m}");
            assert_eq!(coarse.line_step, 1);
        }
        let one = VelocityMap {
            elevation_rad: &elevation_rad[..1],
            velocity_m_s: velocity.slice(ndarray::s![..1, ..]),
            ..map
        };
        assert_eq!(Coarse::of(&one, 3.0, 9.0).map().velocity_m_s.dim(), (1, 41));
    }
}
