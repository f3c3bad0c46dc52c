//! Runs a plan: each stage once, nothing that the plan leaves out.

use crate::Error;
use crate::export::CrossPlanes;
use crate::map::{self, VelocityEstimates};
use crate::plan::{Plan, Stage, Target};
use crate::plane;
use crate::profile::{RangeProfile, range_profile};
use crate::progress::Observer;
use crate::scan::Scanner;
use crate::scene::DetectorSignal;
use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::Sample;

/// What a run gives; absent is what was not asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunResult {
    /// Efficiency and SNR against range.
    pub profile: Option<RangeProfile>,
    /// Wind on a cross-plane.
    pub plane: Option<CrossPlanes>,
    /// Raw signals \[pulse, sample\], A; one realisation after the other.
    pub signals_a: Option<Array2<f64>>,
    /// Their second quadrature, if the receiver delivers two.
    pub quadrature_a: Option<Array2<f64>>,
    /// True radial velocity of the layers of each line \[line, layer\], m/s, where there are signals.
    pub line_velocity_m_s: Option<Array2<f64>>,
    /// The velocity map with its errors.
    pub map: Option<VelocityEstimates>,
}

/// One line of the summary that a person or a program reads.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryLine {
    /// Name for programs, with the unit.
    pub key: &'static str,
    /// Description for people.
    pub text: &'static str,
    /// The value; NaN if it cannot be given.
    pub value: f64,
}

/// Runs a plan.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub fn run(plan: &Plan, observer: &dyn Observer) -> Result<RunResult, Error> {
    let mut result = RunResult::default();
    if matches!(plan.target, Target::Run | Target::Efficiency) {
        result.profile = Some(range_profile(&plan.scene.scene, observer)?);
    }
    if plan.runs(Stage::CrossPlane) {
        observer.begin(Stage::CrossPlane, 1);
        result.plane = Some(plane::cross_plane(plan)?);
        observer.end();
    }
    if plan.runs(Stage::Signals) {
        let scanner = Scanner::new(plan, observer)?;
        match plan.scene.scene.detector.signal {
            DetectorSignal::IntermediateFrequency => {
                signals_and_map(plan, &scanner, observer, &mut result, |records: &Array2<f64>| {
                    (records.clone(), None)
                })?;
            }
            DetectorSignal::Baseband => {
                let parts = |records: &Array2<Complex<f64>>| (records.mapv(|s| s.re), Some(records.mapv(|s| s.im)));
                signals_and_map(plan, &scanner, observer, &mut result, parts)?;
            }
        }
    }
    Ok(result)
}

/// Current and second quadrature of one realisation.
type Parts = (Array2<f64>, Option<Array2<f64>>);

/// Signals and the map, as the plan has them; `parts` takes records apart for the files.
fn signals_and_map<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    result: &mut RunResult,
    parts: impl Fn(&Array2<S>) -> Parts,
) -> Result<(), Error> {
    let mut kept: Vec<Parts> = Vec::new();
    if plan.runs(Stage::Estimates) {
        result.map = Some(map::estimate(plan, scanner, observer, |records| kept.push(parts(records)))?);
    } else {
        let steps = (plan.realisations() * plan.geometry.elevation_rad.len()) as u64;
        observer.begin(Stage::Signals, steps);
        for realisation in 0..plan.realisations() {
            kept.push(parts(&scanner.samples(realisation, observer)?.0));
        }
        observer.end();
    }
    if !kept.is_empty() {
        let (current, quadrature): (Vec<_>, Vec<_>) = kept.into_iter().unzip();
        let quadrature: Option<Vec<Array2<f64>>> = quadrature.into_iter().collect();
        result.signals_a = Some(joined(&current));
        result.quadrature_a = quadrature.map(|parts| joined(&parts));
        result.line_velocity_m_s = Some(line_velocities(scanner));
    }
    Ok(())
}

/// Arrays of equal rows below each other.
fn joined(parts: &[Array2<f64>]) -> Array2<f64> {
    let columns = parts.first().map_or(0, Array2::ncols);
    let mut out = Array2::zeros((parts.iter().map(Array2::nrows).sum(), columns));
    let all = parts.iter().flat_map(|part| part.outer_iter());
    out.outer_iter_mut().zip(all).for_each(|(mut row, from)| row.assign(&from));
    out
}

fn line_velocities(scanner: &Scanner<'_>) -> Array2<f64> {
    let lines = scanner.lines();
    let layers = lines.first().map_or(0, |line| line.radial_velocity_m_s.len());
    Array2::from_shape_fn((lines.len(), layers), |(i, l)| lines[i].radial_velocity_m_s[l])
}

impl RunResult {
    /// The results in a few numbers.
    pub fn summary(&self) -> Vec<SummaryLine> {
        let mut out = Vec::new();
        let mut line = |key, text, value| out.push(SummaryLine { key, text, value });
        if let Some(p) = &self.profile {
            let middle = p.snr_db.len() / 2;
            line("profile_range_m", "middle of the profile [m]", p.efficiency.range_m[middle]);
            line("efficiency", "efficiency there", p.efficiency.mean[middle]);
            line("snr_db", "signal-to-noise ratio there [dB]", p.snr_db[middle]);
            if let Some(fraction) = p.lost_power_fraction {
                line("lost_power_fraction", "power lost at the screens' border (< 0.01)", fraction);
            }
        }
        if let Some(a) = &self.signals_a {
            line("signal_rms_a", "rms of the raw signals [A]", (a.mapv(|x| x * x).sum() / a.len() as f64).sqrt());
        }
        if let Some(m) = &self.map {
            line("v_max_m_s", "largest estimated velocity [m/s]", fold(&m.v_mean_m_s, f64::max));
            line("v_min_m_s", "smallest estimated velocity [m/s]", fold(&m.v_mean_m_s, f64::min));
            line("bias_mean_m_s", "mean bias against v_pulse [m/s]", mean(&m.bias_m_s));
            line(
                "rms_mean_m_s",
                "root mean square error against v_pulse [m/s]",
                mean(&m.rms_m_s.mapv(|x| x * x)).sqrt(),
            );
            line("std_mean_m_s", "standard deviation of one estimate [m/s]", mean(&m.std_m_s));
            line("flagged_fraction", "fraction of flagged estimates", mean(&m.flagged));
            if m.clipped_fraction > 0.0 {
                line("clipped_fraction", "fraction of clipped samples", m.clipped_fraction);
            }
            line("level_mean", "windows accumulated, mean", mean(&m.level));
        }
        out
    }
}

/// Mean of the values that are numbers; NaN if there is none.
fn mean(values: &Array2<f64>) -> f64 {
    let numbers: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

fn fold(values: &Array2<f64>, pick: fn(f64, f64) -> f64) -> f64 {
    values.iter().copied().fold(f64::NAN, pick)
}
