//! Winds from the beams of VAD and DBS scans: what an instrument would report of each sweep, its error bars, and its true errors.
//!
//! Check: a scan of a uniform wind gives it back; the table has the errors of closed forms.

use crate::Error;
use crate::beams::Beam;
use crate::io::Table;
use crate::measure::map::VelocityEstimates;
use crate::plan::Plan;
use crate::scene::Pattern;
use ndarray::Array2;
use wakescope_estimate::wind_profile::{fit_wind, swing};

/// The wind of one sweep at one range.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamWind {
    /// The sweep.
    pub sweep: usize,
    /// Mean time of its beams from the start of the flow, s.
    pub time_s: f64,
    /// Range, m.
    pub range_m: f64,
    /// Mean height of its beams above the ground there, m.
    pub height_m: f64,
    /// Wind (u, v, w) from the estimates of the first realisation, m/s.
    pub wind_m_s: [f64; 3],
    /// Standard deviations that this realisation itself tells: of a VAD from the residuals, else NaN, m/s.
    pub error_bar_m_s: [f64; 3],
    /// Wind from the mean estimates of all realisations, m/s.
    pub mean_m_s: [f64; 3],
    /// Standard deviation of one realisation, from those of its beams, m/s; NaN for one realisation.
    pub std_m_s: [f64; 3],
    /// Wind from the true velocities weighted with the pulse, m/s: what beams without noise would tell.
    pub noiseless_m_s: [f64; 3],
    /// True wind above the lidar at that height and time, m/s, without the turbulence of `"eddies"`: the mean wind is what a scan is
    /// to find. NaN where it is not known.
    pub true_m_s: [f64; 3],
}

/// The winds of a scan whose beams tell them: VAD and DBS.
///
/// # Errors
/// What the estimators or the wind refuse; a checked scene gives none.
pub fn beam_winds(plan: &Plan, map: &VelocityEstimates) -> Result<Option<Vec<BeamWind>>, Error> {
    let pattern = &plan.scene().scan.pattern;
    if !pattern.has_beam_winds() {
        return Ok(None);
    }
    let mut out = Vec::with_capacity(plan.geometry.schedule.sweeps.len() * map.range_m.len());
    for sweep in 0..plan.geometry.schedule.sweeps.len() {
        let (lines, beams) = beams_of(plan, sweep);
        let direction: Vec<[f64; 3]> = beams.iter().map(|beam| beam.direction.0).collect();
        let time_s = plan.wind.start_s
            + beams.iter().map(|beam| beam.time_s).sum::<f64>() / beams.len().max(1) as f64;
        for (gate, &range_m) in map.range_m.iter().enumerate() {
            let of = |values: &Array2<f64>| -> Vec<f64> {
                lines.iter().map(|line| values[[*line, gate]]).collect()
            };
            let from = |values: &Array2<f64>| wind_of(pattern, &direction, &of(values));
            let (wind_m_s, error_bar_m_s) = from(&map.v_scan_m_s)?;
            let slanted = beams
                .iter()
                .filter(|beam| beam.direction.0[2] < 1.0)
                .map(|beam| beam.at_range_m(range_m)[2]);
            let (sum_m, slanted) =
                slanted.fold((0.0, 0.0), |(sum, n), height_m| (sum + height_m, n + 1.0));
            let height_m = sum_m / slanted;
            let mut truth = [[f64::NAN; 3]];
            let above_m = beams.first().map_or([0.0; 3], |beam| {
                [beam.position_m[0], beam.position_m[1], height_m]
            });
            plan.wind
                .without_eddies()
                .velocity_into(&[above_m], time_s, &mut truth)?;
            out.push(BeamWind {
                sweep,
                time_s,
                range_m,
                height_m,
                wind_m_s,
                error_bar_m_s,
                mean_m_s: from(&map.v_mean_m_s)?.0,
                std_m_s: spread_of(pattern, &direction, &of(&map.std_m_s))?,
                noiseless_m_s: from(&map.v_pulse_m_s)?.0,
                true_m_s: truth[0],
            });
        }
    }
    Ok(Some(out))
}

/// The lines of a sweep, and the beams in the middle of their pulses.
fn beams_of(plan: &Plan, sweep: usize) -> (Vec<usize>, Vec<Beam>) {
    let schedule = &plan.geometry.schedule;
    let lines = (0..schedule.lines.len()).filter(|i| schedule.lines[*i].sweep == sweep);
    lines.map(|line| (line, schedule.middle(line))).unzip()
}

/// Wind (u, v, w) of radial velocities \[line, gate\], m/s, averaged over sweeps and ranges; none of scans whose beams tell none.
///
/// # Errors
/// As [`beam_winds`].
pub(crate) fn mean_wind_m_s(
    plan: &Plan,
    velocity_m_s: &Array2<f64>,
) -> Result<Option<[f64; 3]>, Error> {
    let pattern = &plan.scene().scan.pattern;
    if !pattern.has_beam_winds() {
        return Ok(None);
    }
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for sweep in 0..plan.geometry.schedule.sweeps.len() {
        let (lines, beams) = beams_of(plan, sweep);
        let direction: Vec<[f64; 3]> = beams.iter().map(|beam| beam.direction.0).collect();
        for gate in velocity_m_s.columns() {
            let seen: Vec<f64> = lines.iter().map(|line| gate[*line]).collect();
            let (wind, _) = wind_of(pattern, &direction, &seen)?;
            if wind.iter().all(|part| part.is_finite()) {
                sum.iter_mut()
                    .zip(wind)
                    .for_each(|(sum, part)| *sum += part);
                count += 1.0;
            }
        }
    }
    Ok(Some(sum.map(|sum| sum / count)))
}

/// Wind of radial velocities, m/s, and what they tell of its standard deviations.
fn wind_of(
    pattern: &Pattern,
    direction: &[[f64; 3]],
    seen_m_s: &[f64],
) -> Result<([f64; 3], [f64; 3]), Error> {
    let unknown = [f64::NAN; 3];
    match (pattern, seen_m_s) {
        (Pattern::Dbs { elevation_rad }, &[north, east, south, west, up]) => {
            let [along, across, _] = swing(*elevation_rad, [north, east, south, west])?;
            // From north and east to the axes of the scene: those of the first two beams.
            let horizontal = |d: usize| {
                let unit = |beam: usize| direction[beam][d] / elevation_rad.cos();
                along * unit(0) + across * unit(1)
            };
            Ok(([horizontal(0), horizontal(1), up], unknown))
        }
        (Pattern::Dbs { .. }, _) => Ok((unknown, unknown)),
        _ => Ok(
            fit_wind(direction, seen_m_s)?.map_or((unknown, unknown), |fit| {
                (fit.velocity_m_s, fit.standard_deviation_m_s())
            }),
        ),
    }
}

/// Standard deviations of the wind for independent beams with these standard deviations: the wind is linear in what they see.
fn spread_of(
    pattern: &Pattern,
    direction: &[[f64; 3]],
    std_m_s: &[f64],
) -> Result<[f64; 3], Error> {
    let mut variance = [0.0; 3];
    for (beam, std) in std_m_s.iter().enumerate() {
        let one: Vec<f64> = (0..std_m_s.len())
            .map(|i| if i == beam { *std } else { 0.0 })
            .collect();
        let (part, _) = wind_of(pattern, direction, &one)?;
        variance
            .iter_mut()
            .zip(part)
            .for_each(|(sum, v)| *sum += v * v);
    }
    let known = std_m_s.iter().all(|std| std.is_finite());
    Ok(variance.map(|v| if known { v.sqrt() } else { f64::NAN }))
}

/// The table of a scan's winds.
pub fn table(winds: &[BeamWind]) -> Table {
    let column = |of: &dyn Fn(&BeamWind) -> f64| winds.iter().map(of).collect::<Vec<_>>();
    let mut table = Table::new()
        .int("sweep", winds.iter().map(|wind| wind.sweep as i64))
        .float("time_s", column(&|w| w.time_s))
        .float("range_m", column(&|w| w.range_m))
        .float("height_m", column(&|w| w.height_m));
    type Part = fn(&BeamWind) -> &[f64; 3];
    let parts: [(&str, Part); 6] = [
        ("", |w| &w.wind_m_s),
        ("error_bar_", |w| &w.error_bar_m_s),
        ("mean_", |w| &w.mean_m_s),
        ("std_", |w| &w.std_m_s),
        ("noiseless_", |w| &w.noiseless_m_s),
        ("true_", |w| &w.true_m_s),
    ];
    for (name, part) in parts {
        for (d, letter) in ["u", "v", "w"].into_iter().enumerate() {
            table = table.float(&format!("{letter}_{name}m_s"), column(&|w| part(w)[d]));
        }
    }
    table
}
