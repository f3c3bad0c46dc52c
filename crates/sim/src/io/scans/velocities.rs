//! Velocities that no air has, and values that stand for missing ones without being declared so.
//!
//! Writers mark gates without a signal by 0, by a large number or by the end of the band, and not all files name that value. It is
//! known by how often it comes, unless the digits are so few that the air itself has one velocity. Lines of sight of one value do not
//! count, as a beam across an exact wind has 0 m/s in all gates.
//! Check: zeros among velocities of few and of many digits; calm air in few digits; exact winds; fill values that no air has.

use crate::io::units::FASTEST_M_S;

/// Velocities of one value beyond this are missing ones, m/s.
const FAST_M_S: f64 = 90.0;
/// Fraction of the velocities that may be beyond what air has; more say that the unit is another one.
const IMPOSSIBLE: f64 = 0.01;
/// A value stands for missing velocities if it comes this many times as often as any other one.
const TIMES_AS_OFTEN: usize = 10;
/// Least fraction of the velocities, and fewest gates, that such a value has.
const LEAST_FRACTION: f64 = 0.01;
const FEWEST_GATES: usize = 10;
/// Fewest other values beside it.
const FEWEST_OTHERS: usize = 20;
/// Velocities in steps of more than this may all be the same in calm air, m/s: none of them stands for missing ones.
const COARSE_STEP_M_S: f64 = 0.2;
/// In steps of less, air of one velocity also has those beside it, this many times as often as the next ones.
const STEEPNESS: usize = 3;
/// How to mend a file whose velocities are refused.
const CURE: &str =
    "its unit must be m/s, and a missing one its fill value, in a table an empty cell";

/// Takes out what is no velocity of the gates of lines of sight, in words.
///
/// # Errors
/// Velocities of which too many are beyond what air has; large ones of one value.
pub(super) fn drop_missing(lines_m_s: &mut [&mut [f64]]) -> Result<Vec<String>, String> {
    let mut dropped = Vec::new();
    let count = known(lines_m_s).count();
    let impossible = known(lines_m_s).filter(|v| v.abs() > FASTEST_M_S).count();
    if impossible > 0 {
        refuse_impossible(lines_m_s, impossible, count)?;
        replace(lines_m_s, |v| v.abs() > FASTEST_M_S);
        dropped.push(format!(
            "{impossible} of {count} velocities are beyond {FASTEST_M_S} m/s"
        ));
    }
    refuse_fast(lines_m_s)?;
    if let Some(value_m_s) = stand_in_m_s(lines_m_s) {
        let gates = known(lines_m_s).filter(|v| *v == value_m_s).count();
        replace(lines_m_s, |v| v == value_m_s);
        dropped.push(format!(
            "{gates} of {count} velocities are {} m/s and are taken for missing",
            shown(value_m_s)
        ));
    }
    Ok(dropped)
}

/// A velocity with the digits of 32 bits, as most files store it.
fn shown(velocity_m_s: f64) -> f32 {
    velocity_m_s as f32
}

/// All velocities that are not missing; infinite ones are not.
fn known<'l>(lines_m_s: &'l [&mut [f64]]) -> impl Iterator<Item = f64> + 'l {
    let all = lines_m_s.iter().flat_map(|line| line.iter().copied());
    all.filter(|v| !v.is_nan())
}

/// Makes velocities missing.
fn replace(lines_m_s: &mut [&mut [f64]], is_missing: impl Fn(f64) -> bool) {
    for line in lines_m_s {
        for velocity_m_s in line.iter_mut() {
            if is_missing(*velocity_m_s) {
                *velocity_m_s = f64::NAN;
            }
        }
    }
}

fn refuse_impossible(
    lines_m_s: &[&mut [f64]],
    impossible: usize,
    count: usize,
) -> Result<(), String> {
    let first = known(lines_m_s).find(|v| v.abs() > FASTEST_M_S);
    match first.filter(|_| impossible as f64 > (IMPOSSIBLE * count as f64).max(1.0)) {
        Some(bad) => Err(format!("a velocity is {} m/s: {CURE}", shown(bad))),
        None => Ok(()),
    }
}

/// Refuses large velocities of one value.
fn refuse_fast(lines_m_s: &[&mut [f64]]) -> Result<(), String> {
    let mut fast: Vec<f64> = known(lines_m_s).filter(|v| v.abs() >= FAST_M_S).collect();
    fast.sort_by(f64::total_cmp);
    match fast.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(same) => Err(format!(
            "a velocity is {} m/s in more than one gate: {CURE}",
            shown(same[0])
        )),
        None => Ok(()),
    }
}

/// The value that stands for missing velocities, m/s, if there is one.
fn stand_in_m_s(lines_m_s: &[&mut [f64]]) -> Option<f64> {
    let mut all = Vec::new();
    for line in lines_m_s {
        let mut own = line.iter().copied().filter(|v| v.is_finite());
        let first = own.next();
        if own.any(|v| Some(v) != first) {
            all.extend(line.iter().copied().filter(|v| v.is_finite()));
        }
    }
    all.sort_unstable_by(f64::total_cmp);
    let values: Vec<&[f64]> = all.chunk_by(|a, b| a == b).collect();
    let at = (0..values.len()).max_by_key(|at| values[*at].len())?;
    let most = values[at].len();
    let mut others = values.iter().enumerate().filter(|(other, _)| *other != at);
    let is_often = others.all(|(_, other)| most >= TIMES_AS_OFTEN * other.len())
        && most >= FEWEST_GATES
        && most as f64 >= LEAST_FRACTION * all.len() as f64;
    let is_alone = values.len() > FEWEST_OTHERS && !is_coarse(&values) && !is_peak(&values, at);
    (is_often && is_alone).then_some(values[at][0] + 0.0)
}

/// Whether all different values are far apart.
fn is_coarse(values: &[&[f64]]) -> bool {
    let mut steps = values.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    steps.all(|step_m_s| step_m_s > COARSE_STEP_M_S)
}

/// Whether the values beside one come far more often than those beside them, as about the velocity of calm air.
fn is_peak(values: &[&[f64]], at: usize) -> bool {
    let count = |from: usize| {
        let below = at.checked_sub(from).map_or(0, |below| values[below].len());
        below.max(values.get(at + from).map_or(0, |above| above.len()))
    };
    count(1) > STEEPNESS * count(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Velocities of 40 lines of 12 gates with `per_m_s` steps in 1 m/s, about 2 m/s.
    fn lines_m_s(per_m_s: f64) -> Vec<Vec<f64>> {
        let cell = |line: usize, gate: usize| {
            let phase = 1.7 * line as f64 + 0.61 * gate as f64;
            ((2.0 + 3.0 * phase.sin()) * per_m_s).round() / per_m_s
        };
        let mut lines = Vec::new();
        for line in 0..40 {
            lines.push((0..12).map(|gate| cell(line, gate)).collect());
        }
        lines
    }

    fn dropped(lines: &mut [Vec<f64>]) -> Result<Vec<String>, String> {
        let mut slices: Vec<&mut [f64]> = lines.iter_mut().map(Vec::as_mut_slice).collect();
        drop_missing(&mut slices)
    }

    #[test]
    fn a_value_that_stands_for_missing_velocities_is_taken_out() {
        for per_m_s in [1e6, 100.0] {
            for (value, text) in [(0.0, "0"), (-50.0, "-50"), (-19.4, "-19.4")] {
                let mut lines = lines_m_s(per_m_s);
                for line in &mut lines {
                    line[9..].fill(value);
                }
                let words = dropped(&mut lines).unwrap();
                let said = format!("of 480 velocities are {text} m/s and are taken for missing");
                assert!(words.len() == 1 && words[0].contains(&said), "{words:?}");
                assert!(
                    lines
                        .iter()
                        .all(|line| line[9..].iter().all(|v| v.is_nan()))
                );
                assert!(lines.iter().flatten().filter(|v| v.is_finite()).count() >= 350);
            }
        }
    }

    #[test]
    fn velocities_of_few_digits_and_exact_winds_stay() {
        // Packed in steps of 0.5 m/s, where 0 comes as often as its neighbours.
        let mut packed = lines_m_s(2.0);
        // Calm air in steps, with noise beside it.
        let calm = |step_m_s: f64, part: f64| {
            let mut lines = lines_m_s(1e6);
            for (at, velocity) in lines.iter_mut().flatten().enumerate() {
                let noise = ((17 * at) % 201) as f64 - 100.0;
                let steps = match at % 5 {
                    0 => noise,
                    _ => (part * (1.9 * at as f64).sin()).round(),
                };
                *velocity = step_m_s * steps;
            }
            lines
        };
        let mut calm_in_coarse_steps = calm(0.5, 0.2);
        let mut calm_in_fine_steps = calm(0.1, 0.501);
        // A vertical beam in each fifth line, in a wind that differs from gate to gate.
        let mut exact = lines_m_s(1e6);
        exact.iter_mut().step_by(5).for_each(|line| line.fill(0.0));
        // One wind in all gates.
        let mut uniform: Vec<Vec<f64>> = (0..40).map(|i| vec![f64::from(i % 8); 12]).collect();
        for lines in [
            &mut packed,
            &mut calm_in_coarse_steps,
            &mut calm_in_fine_steps,
            &mut exact,
            &mut uniform,
        ] {
            let before = lines.clone();
            assert_eq!(dropped(lines).unwrap(), Vec::<String>::new());
            assert_eq!(*lines, before);
        }
    }

    #[test]
    fn few_velocities_beyond_those_of_air_are_taken_out_and_many_are_refused() {
        let mut lines = lines_m_s(1e6);
        lines[3][4] = f64::INFINITY;
        lines[5][6] = 1e20;
        let words = dropped(&mut lines).unwrap();
        assert_eq!(words, ["2 of 480 velocities are beyond 500 m/s"]);
        assert!(lines[3][4].is_nan() && lines[5][6].is_nan());
        lines.iter_mut().for_each(|line| line[0] = -9999.0);
        let refused = dropped(&mut lines).unwrap_err();
        assert!(refused.contains("a velocity is -9999 m/s"), "{refused}");
        assert!(refused.contains("fill value"), "{refused}");
        let mut lines = lines_m_s(1e6);
        lines[1][7] = -99.0;
        assert_eq!(dropped(&mut lines).unwrap(), Vec::<String>::new());
        lines[2][3] = -99.0;
        let refused = dropped(&mut lines).unwrap_err();
        assert!(
            refused.contains("-99 m/s in more than one gate"),
            "{refused}"
        );
    }
}
