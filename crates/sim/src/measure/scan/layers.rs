//! Layers of the signals of a line: as thick as its own steepest wind allows.
//!
//! The layers of a scan are as thin as its steepest wind needs, which only lines near a vortex core meet. Signals of the other lines
//! have fewer layers of the same air: every k-th, so that layers still divide the distance of samples or hold a few of them. Only
//! scenes with a transported pair have them: signals of others keep their stored values.
//!
//! Check: thick layers have the air of the thin ones; errors of a map with thick layers are those with thin ones.

use crate::Error;
use crate::plan::Plan;
use crate::plan::geometry::{Geometry, signal_layer_thickness_m};
use wakescope_signal::LineOfSight;

/// The line of sight that the signals of each line have; `None` where it is that of the scan.
///
/// # Errors
/// What the pulse refuses; a checked scene gives none.
pub(super) fn thick_lines(
    plan: &Plan,
    lines: &[LineOfSight],
) -> Result<Vec<Option<LineOfSight>>, Error> {
    if !plan.scene().has_layers_of_each_line() {
        return Ok(Vec::new());
    }
    lines.iter().map(|line| thick_line(plan, line)).collect()
}

/// A line with the thickest layers that its steepest wind allows; `None` if they are as thin as those of the scan.
fn thick_line(plan: &Plan, line: &LineOfSight) -> Result<Option<LineOfSight>, Error> {
    let g = &plan.geometry;
    let steepest_per_s = steepest_per_s(line);
    if steepest_per_s.is_nan() {
        return Ok(None);
    }
    let allowed_m = signal_layer_thickness_m(plan.scene(), &plan.instrument.pulse, steepest_per_s)?;
    let parts = (g.sample_spacing_m / g.layer_thickness_m).round() as usize;
    let samples = (allowed_m / g.sample_spacing_m + 1e-6) as usize;
    if samples > 0 {
        return Ok((samples * parts > 1).then(|| every(line, g, samples * parts)));
    }
    let least = (g.sample_spacing_m / allowed_m).round() as usize;
    let divides = |fewer: &usize| parts.is_multiple_of(*fewer);
    let fewer = (least..parts).find(divides);
    Ok(fewer.map(|fewer| every(line, g, parts / fewer)))
}

/// Largest change of the radial velocity along a line, 1/s; NaN where a layer has none.
fn steepest_per_s(line: &LineOfSight) -> f64 {
    let mut steepest = 0.0;
    for pair in line.radial_velocity_m_s.windows(2) {
        let change = (pair[1] - pair[0]).abs();
        if change.is_nan() {
            return f64::NAN;
        }
        steepest = change.max(steepest);
    }
    steepest / line.layer_thickness_m
}

/// Every `step`-th layer of a line, with the layer at the first sample among them; beyond its ends the air of the last layer.
fn every(line: &LineOfSight, g: &Geometry, step: usize) -> LineOfSight {
    let layers = line.radial_velocity_m_s.len();
    let first_sample_m = g.first_sample_m;
    let before = ((first_sample_m - line.first_range_m) / line.layer_thickness_m).round() as usize;
    let near = before.div_ceil(step);
    let far = (layers - before).div_ceil(step);
    let layer_thickness_m = step as f64 * line.layer_thickness_m;
    let mut thick = LineOfSight {
        first_range_m: first_sample_m - near as f64 * layer_thickness_m,
        layer_thickness_m,
        radial_velocity_m_s: Vec::with_capacity(near + far + 1),
        weight_per_m: Vec::with_capacity(near + far + 1),
    };
    for layer in 0..=near + far {
        let place = (before + layer * step)
            .saturating_sub(near * step)
            .min(layers - 1);
        thick
            .radial_velocity_m_s
            .push(line.radial_velocity_m_s[place]);
        thick.weight_per_m.push(line.weight_per_m[place]);
    }
    thick
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::map;
    use crate::measure::scan::Scanner;
    use crate::plan::Target;
    use crate::plan::line_wind::radial_velocity_m_s;
    use crate::progress::Silent;
    use crate::scene::SceneFile;
    use std::path::Path;
    use wakescope_signal::{Record, Simulator};

    /// A plan of a pair with this motion.
    fn plan(motion: &str) -> Plan {
        let text = format!(
            "[detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n[flow]\nmotion = \"{motion}\"\ncore_radius_m = 0.8\n[scan]\nelevation_min_rad = 0.02\n\
             elevation_step_rad = 0.02\npulses_per_line = 2\nrealisations = 64\n[estimator]\nwindow_step_samples = 4\n"
        );
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        Plan::new(file, Target::Map).unwrap()
    }

    #[test]
    fn thick_layers_have_the_air_of_the_thin_ones_and_cover_them() {
        let plan = plan("transported");
        let scanner = Scanner::new(&plan, &Silent).unwrap();
        let thick = thick_lines(&plan, &scanner.air.lines).unwrap();
        let found = thick.iter().filter(|line| line.is_some()).count();
        assert!(2 * found > thick.len(), "{found} of {}", thick.len());
        for (line, thick) in scanner.air.lines.iter().zip(thick) {
            let Some(thick) = thick else {
                continue;
            };
            let last_m = |line: &LineOfSight| line.range_m(line.radial_velocity_m_s.len() - 1);
            assert!(thick.first_range_m <= line.first_range_m && last_m(&thick) >= last_m(line));
            for (layer, velocity_m_s) in thick.radial_velocity_m_s.iter().enumerate() {
                let place = (thick.range_m(layer) - line.first_range_m) / line.layer_thickness_m;
                let place = place.clamp(0.0, line.radial_velocity_m_s.len() as f64 - 1.0);
                assert!((place - place.round()).abs() < 1e-6);
                assert_eq!(
                    *velocity_m_s,
                    line.radial_velocity_m_s[place.round() as usize]
                );
            }
        }
        let plan_at_rest = super::tests::plan("frozen");
        assert!(
            thick_lines(&plan_at_rest, &scanner.air.lines)
                .unwrap()
                .is_empty()
        );
    }

    /// Range of the steepest wind of a line, m.
    fn steepest_at_m(line: &LineOfSight) -> f64 {
        let mut found = (0.0, 0);
        for (layer, pair) in line.radial_velocity_m_s.windows(2).enumerate() {
            let change_m_s = (pair[1] - pair[0]).abs();
            if change_m_s > found.0 {
                found = (change_m_s, layer);
            }
        }
        line.range_m(found.1)
    }

    /// The same air in layers an eighth as thick.
    fn refined(plan: &Plan, line: usize, coarse: &LineOfSight) -> LineOfSight {
        let layer_thickness_m = coarse.layer_thickness_m / 8.0;
        let layers = 8 * coarse.layers();
        let mut range_m = Vec::with_capacity(layers);
        for layer in 0..layers {
            range_m.push(coarse.first_range_m + layer as f64 * layer_thickness_m);
        }
        LineOfSight {
            layer_thickness_m,
            radial_velocity_m_s: radial_velocity_m_s(plan, &plan.wind, line, &range_m).unwrap(),
            weight_per_m: vec![coarse.weight_per_m[0]; layers],
            ..*coarse
        }
    }

    /// Largest error of the covariances of records through the smallest core of the preset `landing`, which lines pass at all
    /// distances, over the power, beside other flows.
    fn covariance_error(added_flows: &str) -> f64 {
        let text = format!(
            "[detector.snr]\nreference = \"fixed\"\nsnr_db = 10.0\n[flow]\nmotion = \"transported\"\nspacing_m = 26.6\n\
             core_radius_m = 1.33\ncirculation_m2_s = 250.0\n[scan]\nelevation_step_rad = 1.6e-3\n{added_flows}"
        );
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Map).unwrap();
        let scanner = Scanner::new(&plan, &Silent).unwrap();
        let samples = plan.scene().estimator.window_samples;
        let mut worst: f64 = 0.0;
        let mut steep = 0;
        let mut of_samples = 0;
        for (index, line) in scanner.air.lines.iter().enumerate() {
            let is_steep = steepest_per_s(line) >= 1.0;
            if !is_steep && index % 8 > 0 {
                continue;
            }
            steep += usize::from(is_steep);
            let of_signals = scanner.air.of_signals(index);
            let samples_per_layer = of_signals.layer_thickness_m / plan.geometry.sample_spacing_m;
            of_samples += usize::from(samples_per_layer > 3.9);
            // About the steepest wind, but within the ranges that are scanned.
            let g = &plan.geometry;
            let last_m = g.first_sample_m + (g.samples - samples) as f64 * g.sample_spacing_m;
            let first_m = steepest_at_m(line) - 0.5 * samples as f64 * g.sample_spacing_m;
            let first_m = first_m.clamp(g.first_sample_m, last_m);
            let record = Record {
                time_of_first_sample_s: 2.0 * first_m / crate::SPEED_OF_LIGHT_M_S,
                samples,
            };
            let simulator =
                Simulator::new(&plan.instrument.pulse, plan.instrument.receiver, record).unwrap();
            let thick_a2 = simulator.covariance_a2(of_signals).unwrap();
            let thin_a2 = simulator
                .covariance_a2(&refined(&plan, index, of_signals))
                .unwrap();
            let power_a2 = thin_a2[(samples / 2, samples / 2)].re;
            for (thick_a2, thin_a2) in thick_a2.iter().zip(&thin_a2) {
                worst = worst.max((thick_a2 - thin_a2).norm() / power_a2);
            }
        }
        assert!(steep > 5 && of_samples > 5, "{steep} {of_samples}");
        worst
    }

    #[test]
    fn covariances_of_records_are_those_of_layers_an_eighth_as_thick() {
        let eddies =
            "[[added_flows]]\nkind = \"eddies\"\ndissipation_m2_s3 = 1e-2\nsmallest_m = 4.0\n";
        for added_flows in ["", eddies] {
            let worst = covariance_error(added_flows);
            assert!(worst < 0.004, "{added_flows}: {worst}");
        }
    }

    #[test]
    fn errors_with_thick_layers_are_those_with_thin_ones() {
        let plan = plan("transported");
        let mut scanner = Scanner::new(&plan, &Silent).unwrap();
        let mut std_m_s = Vec::new();
        for is_thick in [true, false] {
            if !is_thick {
                scanner.air.thick.clear();
            }
            let maps = map::of_plans(&[&plan], &scanner, &Silent, |_| ()).unwrap();
            let mean_square = maps[0].std_m_s.mapv(|std_m_s| std_m_s * std_m_s).mean();
            std_m_s.push(mean_square.unwrap().sqrt());
        }
        let ratio = std_m_s[0] / std_m_s[1];
        // Some 60 independent cells and 64 realisations: 1.2 % of each deviation.
        assert!((ratio - 1.0).abs() < 0.06, "{std_m_s:?}");
    }
}
