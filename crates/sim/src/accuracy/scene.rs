//! Settings of a scene: each value is a run with the seed of the scene, those of the estimator on the same signals.
//!
//! The shift of the efficiency by the number of phase screens needs no random numbers: for independent paths (bistatic) its mean is
//! exact for the very screens and for the continuous path. Fewer realisations shift nothing; their standard error follows the
//! square-root law.

use super::keys::{
    GRID_POINTS, GRID_SPACING, LAYERS, PADDED, PATHS, REALISATIONS, WINDOW_STEP, value, with,
};
use super::metrics::{Metric, Sample};
use super::{Report, Request, Row, Setting};
use crate::Error;
use crate::interpolation::interpolate;
use crate::io::csv::float_text;
use crate::measure::efficiency_model::{drawn_turbulence, model, signals_cross_screens, stretches};
use crate::measure::map;
use crate::measure::profile::LineOptics;
use crate::measure::scan::Scanner;
use crate::plan::{Plan, Target};
use crate::progress::{Observer, Stage};
use crate::scene::{Scene, SceneFile, ScreenSampling};
use crate::sweep::Common;
use std::time::Instant;
use wakescope_estimate::Measured;
use wakescope_optics::plan::Model;

/// Fewest realisations of the scan for a standard error by the jackknife.
const FEWEST_REALISATIONS: usize = 8;
/// Smallest value of a count. One phase screen would be the whole path, for which the exact mean of independent paths says little of
/// the common one.
const FEWEST: f64 = 2.0;
/// Points of the finest spectrum for each sample of a window.
const FINEST_PADDING: usize = 32;
/// Fineness of phase screens and numbers of realisations over the given ones.
const RATIOS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// Realisations of the path in two antithetic pairs, which the jackknife omits together.
const GROUP: usize = 4;
/// Relative change of the pulse energy by which the response of the map to the efficiency is measured.
const RAISED: f64 = 0.03;

impl Report {
    /// Errors and run time of a scene.
    ///
    /// # Errors
    /// What the scene refuses; metrics that it does not have.
    pub fn of_scene(
        file: &SceneFile,
        request: &Request,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let realisations = file.content.scan.realisations.max(FEWEST_REALISATIONS);
        let base = with(file, REALISATIONS, realisations as f64)?;
        let study = Study::new(file, base, request, observer)?;
        let varied = study.settings();
        let mut notes = Vec::new();
        if varied.iter().any(|(key, _)| *key == LAYERS) {
            notes.push(format!(
                "shifts by {LAYERS} are exact for independent paths (bistatic) and taken for the common path (monostatic)"
            ));
        }
        if drawn_turbulence(&file.content).is_some() {
            notes.push(
                "settings of the turbulence are not varied: each pulse has its own efficiency"
                    .into(),
            );
        }
        observer.begin(
            Stage::Cases,
            varied.iter().map(|(_, values)| values.len() as u64).sum(),
        );
        let settings = varied
            .iter()
            .map(|(key, values)| study.setting(key, values));
        let settings = settings.collect();
        observer.end();
        Ok(Self {
            subject: "scene",
            provenance: file.provenance(),
            within: request.within,
            realisations: Some(realisations),
            metrics: study.metrics,
            settings,
            notes,
        })
    }
}

/// Metrics that a scene may have.
fn metrics_of(plan: &Plan, request: &Request) -> Vec<Metric> {
    let scene = plan.scene();
    let mut metrics = Vec::new();
    if crosses_screens(plan) {
        metrics.push(Metric::Efficiency);
    }
    metrics.extend([Metric::Bias, Metric::Std, Metric::Rms]);
    if scene.scan.pattern.has_beam_winds() {
        metrics.extend([Metric::U, Metric::V, Metric::W]);
    }
    // Fits need long.
    if scene.retrieval.is_some() || request.of.contains(&Metric::Circulation) {
        metrics.push(Metric::Circulation);
    }
    metrics
}

/// Whether phase screens make the efficiency in the middle of the scan, and all pulses have it in common.
fn crosses_screens(plan: &Plan) -> bool {
    let scene = plan.scene();
    let is_common = model(scene) == Model::MonteCarlo && drawn_turbulence(scene).is_none();
    is_common && middle_stretch(plan).is_some()
}

/// Range in the middle of the scan, m.
fn middle_m(plan: &Plan) -> f64 {
    let scan = &plan.scene().scan;
    0.5 * (scan.range_min_m + scan.range_max_m)
}

/// The stretch of range with phase screens of its own that the middle of the scan is in, m.
fn middle_stretch(plan: &Plan) -> Option<[f64; 2]> {
    stretches(plan.scene(), &plan.geometry, &[middle_m(plan)])
        .first()
        .map(|(ends_m, _)| *ends_m)
}

/// Runs of a scene with other values of its settings.
struct Study<'a> {
    file: &'a SceneFile,
    /// The scene with enough realisations.
    base: SceneFile,
    metrics: Vec<Metric>,
    observer: &'a dyn Observer,
    common: Common,
    /// The run with the given values.
    given: Sample,
    /// Shift of metrics of the map for a relative shift of the efficiency of their signals.
    response: Vec<(Metric, Measured)>,
}

impl<'a> Study<'a> {
    fn new(
        file: &'a SceneFile,
        base: SceneFile,
        request: &Request,
        observer: &'a dyn Observer,
    ) -> Result<Self, Error> {
        let common = Common::default();
        let plan = common.plan(&base, Target::Run)?;
        let mut available = metrics_of(&plan, request);
        let mut study = Self {
            metrics: request.select("scene", &available)?,
            file,
            base,
            observer,
            common,
            given: Sample::default(),
            response: Vec::new(),
        };
        study.given = study.run(&study.base)?;
        // Circulation is fitted to scans across a pair alone.
        available.retain(|metric| study.given.noise(*metric).is_finite());
        study.metrics = request.select("scene", &available)?;
        if signals_cross_screens(&study.base.content) && crosses_screens(&plan) {
            study.response = study.measured_response()?;
        }
        Ok(study)
    }

    fn of_map(&self) -> impl Iterator<Item = Metric> {
        let metrics = self.metrics.iter().copied();
        metrics.filter(|metric| *metric != Metric::Efficiency)
    }

    /// Runs a scene up to its map.
    fn run(&self, file: &SceneFile) -> Result<Sample, Error> {
        let plan = self.common.plan(file, Target::Run)?;
        plan.fits()?;
        let begun = Instant::now();
        let optics = LineOptics {
            plan: &plan,
            instrument: &plan.instrument,
            known: &self.common.efficiencies,
            observer: self.observer,
        };
        optics.of_layers()?;
        let efficiency = efficiency_in_the_middle(&optics)?;
        let optics_s = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let scanner = Scanner::with(&plan, &self.common.efficiencies, self.observer)?;
        let maps = map::of_plans(&[&plan], &scanner, self.observer, |_| ())?;
        let mut sample = match maps.first() {
            Some(map) => Sample::new(&plan, &scanner, map, &self.metrics)?,
            None => Sample::default(),
        };
        sample.efficiency = efficiency;
        sample.layer_shift = layer_shift(&plan);
        sample.optics_s = optics_s;
        sample.map_s = begun.elapsed().as_secs_f64();
        Ok(sample)
    }

    /// What a change of the efficiency does to the metrics of the map.
    fn measured_response(&self) -> Result<Vec<(Metric, Measured)>, Error> {
        let mut scene = self.base.content.clone();
        scene.pulse.energy_j *= 1.0 + RAISED;
        let raised = self.run(&self.base.with(scene)?)?;
        let mut response = Vec::new();
        for metric in self.of_map() {
            let shift = raised.shift(&self.given, metric);
            response.push((metric, shift.times(Measured::exact(1.0 / RAISED))));
        }
        Ok(response)
    }

    /// The settings with their values from the finest to the coarsest, the given one among them.
    fn settings(&self) -> Vec<(&'static str, Vec<f64>)> {
        let scene = &self.base.content;
        let mut settings = Vec::new();
        if self.of_map().next().is_some() {
            let window = scene.estimator.window_samples;
            let step = value(scene, WINDOW_STEP);
            settings.push((WINDOW_STEP, doubled(1.0, window as f64, step)));
            if scene.estimator.method.behaviour().uses(PADDED) {
                let finest = (FINEST_PADDING * window).next_power_of_two().min(1 << 20);
                let given = value(scene, PADDED);
                let mut points = doubled(window as f64, given.max(finest as f64), given);
                points.reverse();
                settings.push((PADDED, points));
            }
            settings.push((REALISATIONS, scaled(&self.file.content, REALISATIONS)));
        }
        let has_effect = self.metrics.contains(&Metric::Efficiency) || !self.response.is_empty();
        if let Some(t) = scene.refractive_turbulence().filter(|_| has_effect) {
            if t.sampling == ScreenSampling::Explicit {
                settings.push((LAYERS, scaled(scene, LAYERS)));
                settings.push((GRID_POINTS, scaled(scene, GRID_POINTS)));
                let spacings = RATIOS.map(|ratio| t.grid_spacing_m / ratio);
                settings.push((GRID_SPACING, spacings.to_vec()));
            }
            settings.push((PATHS, scaled(scene, PATHS)));
        }
        settings
    }

    /// Runs the values of a setting, the finest first.
    fn setting(&self, key: &'static str, values: &[f64]) -> Setting {
        let given = value(&self.file.content, key);
        let of_base = value(&self.base.content, key);
        let mut finest: Option<Sample> = None;
        let mut rows = Vec::new();
        for &value in values {
            let trial = if value == of_base {
                Ok(self.given.clone())
            } else {
                with(&self.base, key, value).and_then(|file| self.run(&file))
            };
            let label = match value.fract() {
                0.0 => format!("{value:.0}"),
                _ => float_text(value),
            };
            self.observer.advance(1);
            self.observer.reach(&format!("{key} = {label}"));
            rows.push(match trial {
                Ok(trial) => {
                    let finest = finest.get_or_insert_with(|| trial.clone());
                    // EfficiencyMemo are computed once for all runs with the same path.
                    let optics_s = match key {
                        LAYERS | GRID_POINTS | GRID_SPACING | PATHS => trial.optics_s,
                        _ => self.given.optics_s,
                    };
                    Row {
                        shifts: self.shifts(key, of_base / value, &trial, finest),
                        // A known gate has an estimate in every realisation: of more of them fewer are known.
                        lost: match key {
                            REALISATIONS => 0.0,
                            _ => trial.lost(finest),
                        },
                        ..Row::new(value, label, optics_s + trial.map_s)
                    }
                }
                Err(error) => Row::refused(value, label, &error),
            });
        }
        Setting { key, given, rows }
    }

    /// Shifts of all metrics by a setting; `ratio` is the value of the base over that of the run.
    fn shifts(
        &self,
        key: &str,
        ratio: f64,
        trial: &Sample,
        finest: &Sample,
    ) -> Vec<(Metric, Measured)> {
        let mut shifts = Vec::new();
        match key {
            LAYERS => {
                let [middle, largest] = trial.layer_shift.map(Measured::exact);
                self.by_efficiency(middle, largest)
            }
            GRID_POINTS | GRID_SPACING => {
                let shift = trial.shift(finest, Metric::Efficiency);
                self.by_efficiency(shift, shift)
            }
            PATHS => {
                let noise = self.noise(Metric::Efficiency, ratio);
                self.by_efficiency(noise, noise)
            }
            REALISATIONS => {
                for metric in self.of_map() {
                    shifts.push((metric, self.noise(metric, ratio)));
                }
                shifts
            }
            _ => {
                for metric in self.of_map() {
                    shifts.push((metric, trial.shift(finest, metric)));
                }
                shifts
            }
        }
    }

    /// Standard error of a metric of the base run, in a run with fewer realisations by this ratio.
    fn noise(&self, metric: Metric, ratio: f64) -> Measured {
        Measured {
            value: 0.0,
            std: self.given.noise(metric) * ratio.sqrt(),
        }
    }

    /// What a shift of the efficiency in the middle of the scan, and one anywhere in it, do to all metrics.
    fn by_efficiency(&self, middle: Measured, anywhere: Measured) -> Vec<(Metric, Measured)> {
        let mut shifts = Vec::new();
        if self.metrics.contains(&Metric::Efficiency) {
            shifts.push((Metric::Efficiency, middle));
        }
        for (metric, ratio) in &self.response {
            shifts.push((*metric, anywhere.times(*ratio)));
        }
        shifts
    }
}

/// Efficiency in the middle of the scan, means over groups of realisations of the path; empty where screens do not make it.
fn efficiency_in_the_middle(optics: &LineOptics<'_>) -> Result<Vec<f64>, Error> {
    let stretch = middle_stretch(optics.plan).filter(|_| crosses_screens(optics.plan));
    let Some(ends_m) = stretch else {
        return Ok(Vec::new());
    };
    let middle_m = middle_m(optics.plan);
    let mean = optics.efficiency_at(&[middle_m])?.mean[0];
    let screens = optics.screens(ends_m)?;
    let mut means = Vec::new();
    for group in screens.realisations.chunks(GROUP) {
        let values = group
            .iter()
            .map(|over_mean| mean * interpolate(&screens.range_m, over_mean, middle_m));
        means.push(values.sum::<f64>() / group.len() as f64);
    }
    Ok(means)
}

/// Relative shift of the bistatic efficiency by the phase screens of a plan, in the middle of the scan and the largest over its stretch.
fn layer_shift(plan: &Plan) -> [f64; 2] {
    let middle_m = middle_m(plan);
    let mut stretches = plan.screens.iter();
    let Some(screens) = stretches.find(|screens| {
        let last = screens.gaps.last();
        last.is_some_and(|gap| gap.range_m >= middle_m)
    }) else {
        return [f64::NAN; 2];
    };
    let range_m: Vec<f64> = screens.gaps.iter().map(|gap| gap.range_m).collect();
    let relative: Vec<f64> = screens.gaps.iter().map(|gap| gap.relative).collect();
    let largest = relative.iter().fold(0.0, |most, gap| gap.abs().max(most));
    [interpolate(&range_m, &relative, middle_m), largest]
}

/// Powers of two times `first` up to `last`, with the given value among them.
fn doubled(first: f64, last: f64, given: f64) -> Vec<f64> {
    let mut values = vec![given];
    let mut value = first;
    while value <= last {
        values.push(value);
        value *= 2.0;
    }
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// Whole values of a key about the given one, from large to small.
fn scaled(scene: &Scene, key: &str) -> Vec<f64> {
    let given = value(scene, key);
    let mut values = RATIOS.map(|ratio| (ratio * given).round()).to_vec();
    values.retain(|value| *value >= FEWEST || *value == given);
    values.dedup();
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Silent;
    use std::path::Path;
    use wakescope_optics::Misalignment;
    use wakescope_optics::air::StructureTable;
    use wakescope_optics::theory::{bistatic_efficiency, bistatic_efficiency_screens};

    const TURBULENT: &str = "seed = 5\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.1\n\
        range_min_m = 900.0\nrange_max_m = 1000.0\npulses_per_line = 1\nrealisations = 8\n[atmosphere.turbulence]\n\
        kind = \"refractive\"\ncn2_m_m23 = 1e-12\ngrid_points = 256\ngrid_spacing_m = 0.004\nlayers = 4\nrealisations = 8\n\
        [outputs]\nprofile_points = 2\nprofile_range_min_m = 900.0\nprofile_range_max_m = 1000.0\n";

    #[test]
    fn the_shift_by_layers_is_the_ratio_of_the_exact_means_of_screens_and_path() {
        let file = SceneFile::parse(TURBULENT, Path::new("s.toml")).unwrap();
        let common = Common::default();
        let mut shifts = Vec::new();
        for layers in [2.0, 4.0, 8.0] {
            let file = with(&file, LAYERS, layers).unwrap();
            let plan = common.plan(&file, Target::Run).unwrap();
            let telescope = &plan.instrument.telescope;
            let turbulence = plan.instrument.turbulence.as_ref().unwrap();
            let screens = plan.screens.last().unwrap();
            let range_m: Vec<f64> = screens.gaps.iter().map(|gap| gap.range_m).collect();
            // A range inside a layer cuts it.
            let layers = screens.layers.split_at(&range_m);
            let table = StructureTable::new(&*turbulence.spectrum);
            let none = Misalignment::NONE;
            let mut exact = Vec::new();
            for &range_m in &range_m {
                let strengths = layers.screens_to(range_m, &turbulence.cn2).unwrap();
                let across_screens =
                    bistatic_efficiency_screens(telescope, &none, &strengths, &table, range_m)
                        .unwrap();
                let along_path =
                    bistatic_efficiency(telescope, &none, turbulence, range_m).unwrap();
                exact.push(across_screens / along_path - 1.0);
            }
            let [middle, largest] = layer_shift(&plan);
            let expected = interpolate(&range_m, &exact, middle_m(&plan));
            assert!(
                (middle / expected - 1.0).abs() < 1e-3,
                "{middle} {expected}"
            );
            assert!(
                exact
                    .iter()
                    .any(|shift| (shift.abs() / largest - 1.0).abs() < 1e-3)
            );
            shifts.push(middle.abs());
        }
        assert!(shifts[0] > shifts[1] && shifts[1] > shifts[2], "{shifts:?}");
    }

    #[test]
    fn values_are_powers_of_two_or_multiples_and_have_the_given_one() {
        assert_eq!(doubled(1.0, 10.0, 3.0), [1.0, 2.0, 3.0, 4.0, 8.0]);
        assert_eq!(doubled(8.0, 32.0, 16.0), [8.0, 16.0, 32.0]);
        let file = SceneFile::parse(TURBULENT, Path::new("s.toml")).unwrap();
        assert_eq!(scaled(&file.content, LAYERS), [8.0, 4.0, 2.0]);
        assert_eq!(scaled(&file.content, PATHS), [16.0, 8.0, 4.0, 2.0]);
    }

    #[test]
    fn a_scene_without_a_metric_refuses_it() {
        let file = SceneFile::parse(TURBULENT, Path::new("s.toml")).unwrap();
        for (metric, expected) in [
            (
                Metric::V,
                "v is not a metric of this scene, which has: efficiency, bias, std, rms",
            ),
            (Metric::Energy, "energy is not a metric of this scene"),
        ] {
            let request = Request {
                within: 0.1,
                of: vec![metric],
            };
            let error = Report::of_scene(&file, &request, &Silent).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
