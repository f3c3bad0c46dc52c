//! Runs a plan: each stage once, nothing that the plan leaves out.

use crate::Error;
use crate::interpolation::{interpolate, linspace};
use crate::io::CrossPlanes;
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::plane;
use crate::measure::profile::{EfficiencyMemo, LineOptics, RangeProfile};
use crate::measure::scan::Scanner;
use crate::plan::{Plan, Stage, Target};
use crate::progress::Observer;
use crate::retrieve::realisations::{SceneRetrieval, of_realisations};
use crate::scene::DetectorSignal;
use ndarray::{Array2, ArrayView2};
use num_complex::Complex;
use wakescope_estimate::{SignalKind, window::Sample};

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
    /// Vortices of all realisations against those of the flow.
    pub retrieval: Option<SceneRetrieval>,
    /// What comes back from the middle of the scan.
    pub middle: Option<ScanMiddle>,
}

/// Efficiency and signal-to-noise ratio at the range in the middle of the scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanMiddle {
    /// The range, m.
    pub range_m: f64,
    /// Efficiency; NaN if the profile does not reach there.
    pub efficiency: f64,
    /// Mean signal-to-noise ratio (14) in the detector band, dB; that of the signals where there are any.
    pub snr_db: f64,
}

impl ScanMiddle {
    /// From the profile at that range, and from the layers of the signals where there are any.
    pub(crate) fn of(
        plan: &Plan,
        there: Option<&RangeProfile>,
        scanner: Option<&Scanner<'_>>,
    ) -> Option<Self> {
        let range_m = middle_m(plan);
        let of_signals = scanner.map(|scanner| {
            let (layer_m, snr): (Vec<f64>, Vec<f64>) = scanner.layer_snr().into_iter().unzip();
            10.0 * interpolate(&layer_m, &snr, range_m).log10()
        });
        let efficiency = there.and_then(|p| p.efficiency.mean.first().copied());
        let snr_db = of_signals.or_else(|| there?.snr_db.first().copied())?;
        Some(Self {
            range_m,
            efficiency: efficiency.unwrap_or(f64::NAN),
            snr_db,
        })
    }
}

fn middle_m(plan: &Plan) -> f64 {
    let scan = &plan.scene().scan;
    0.5 * (scan.range_min_m + scan.range_max_m)
}

/// Runs a plan.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub fn run(plan: &Plan, observer: &dyn Observer) -> Result<RunResult, Error> {
    let mut result = RunResult::default();
    let o = &plan.scene().outputs;
    let known = EfficiencyMemo::default();
    let mut there = None;
    let optics = LineOptics {
        plan,
        instrument: &plan.instrument,
        known: &known,
        observer,
    };
    if matches!(plan.target, Target::Run | Target::Efficiency) {
        let range_m = linspace(
            o.profile_range_min_m,
            o.profile_range_max_m,
            o.profile_points,
        );
        result.profile = Some(optics.profile_at(&range_m)?);
        if (o.profile_range_min_m..=o.profile_range_max_m).contains(&middle_m(plan)) {
            there = Some(optics.profile_at(&[middle_m(plan)])?);
        }
    }
    if plan.runs(Stage::CrossPlane) {
        observer.begin(Stage::CrossPlane, 1);
        result.plane = Some(plane::cross_plane(plan)?);
        observer.end();
    }
    let scanner = plan
        .runs(Stage::Signals)
        .then(|| Scanner::with(plan, &known, observer))
        .transpose()?;
    result.middle = ScanMiddle::of(plan, there.as_ref(), scanner.as_ref());
    if let Some(scanner) = scanner {
        match plan.scene().detector.signal {
            DetectorSignal::IntermediateFrequency => {
                signals_and_map::<f64>(plan, &scanner, observer, &mut result)?
            }
            DetectorSignal::Baseband => {
                signals_and_map::<Complex<f64>>(plan, &scanner, observer, &mut result)?
            }
        }
    }
    Ok(result)
}

/// Signals and the map, as the plan has them.
fn signals_and_map<S: Sample + wakescope_signal::Sample>(
    plan: &Plan,
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    result: &mut RunResult,
) -> Result<(), Error> {
    // The records that are kept for the files, as real numbers.
    let shape = (
        plan.kept_realisations() * scanner.pulses(),
        plan.geometry.samples,
    );
    let samples = shape.0 * shape.1;
    let mut in_phase = Vec::with_capacity(samples);
    let mut quadrature = (S::KIND == SignalKind::Complex).then(|| Vec::with_capacity(samples));
    let mut keep = |records: ArrayView2<'_, S>| {
        if samples > 0 {
            in_phase.extend(records.iter().map(|sample| sample.to_complex().re));
            quadrature
                .iter_mut()
                .for_each(|q| q.extend(records.iter().map(|sample| sample.to_complex().im)));
        }
    };
    if plan.runs(Stage::Estimates) {
        let mut maps = Vec::new();
        let seen = |map: &map::RealisationMap<'_>| {
            if plan.runs(Stage::Retrieval) {
                maps.push(map.velocity_m_s.clone());
            }
        };
        result.map = map::estimates(&[plan], scanner, observer, keep, seen)?.pop();
        if plan.runs(Stage::Retrieval) {
            result.retrieval = of_realisations::<S>(plan, scanner, &maps, observer)?;
        }
    } else {
        let steps = (plan.realisations() * plan.geometry.elevation_rad.len()) as u64;
        observer.begin(Stage::Signals, steps);
        for realisation in 0..plan.realisations() {
            scanner.in_pieces(realisation, observer, |_, records| {
                keep(records);
                Ok(())
            })?;
        }
        observer.end();
    }
    if samples > 0 {
        result.signals_a = Array2::from_shape_vec(shape, in_phase).ok();
        result.quadrature_a =
            quadrature.and_then(|values| Array2::from_shape_vec(shape, values).ok());
        let lines = &scanner.air.lines;
        let layers = lines
            .first()
            .map_or(0, |line| line.radial_velocity_m_s.len());
        let velocity_m_s = |(i, l): (usize, usize)| lines[i].radial_velocity_m_s[l];
        result.line_velocity_m_s = Some(Array2::from_shape_fn((lines.len(), layers), velocity_m_s));
    }
    Ok(())
}

impl RunResult {
    /// The results in a few numbers: of each its name for programs, with the unit, its description for people, and the value; NaN if it
    /// cannot be given.
    pub fn summary(&self) -> Vec<(&'static str, &'static str, f64)> {
        let mut out = Vec::new();
        let mut line = |key, text, value| out.push((key, text, value));
        if let Some(middle) = &self.middle {
            line("scan_range_m", "middle of the scan [m]", middle.range_m);
            line("scan_efficiency", "efficiency there", middle.efficiency);
            line(
                "scan_snr_db",
                "signal-to-noise ratio there [dB]",
                middle.snr_db,
            );
        }
        if let Some(fraction) = self
            .profile
            .as_ref()
            .and_then(|profile| profile.lost_power_fraction)
        {
            line(
                "lost_power_fraction",
                "power lost at the screens' border (< 0.01)",
                fraction,
            );
        }
        if let Some(a) = &self.signals_a {
            let mean_square = a.iter().map(|x| x * x).sum::<f64>() / a.len() as f64;
            line(
                "signal_rms_a",
                "rms of the raw signals [A]",
                mean_square.sqrt(),
            );
        }
        if let Some(m) = &self.map {
            line(
                "v_max_m_s",
                "largest estimated velocity [m/s]",
                fold(&m.v_mean_m_s, f64::max),
            );
            line(
                "v_min_m_s",
                "smallest estimated velocity [m/s]",
                fold(&m.v_mean_m_s, f64::min),
            );
            line(
                "bias_mean_m_s",
                "mean bias against v_pulse [m/s]",
                mean(&m.bias_m_s),
            );
            let root_mean_square = |field: &Array2<f64>| mean(&field.mapv(|x| x * x)).sqrt();
            line(
                "rms_mean_m_s",
                "root mean square error against v_pulse [m/s]",
                root_mean_square(&m.rms_m_s),
            );
            line(
                "std_mean_m_s",
                "standard deviation of one estimate [m/s]",
                root_mean_square(&m.std_m_s),
            );
            line(
                "flagged_fraction",
                "fraction of flagged estimates",
                mean(&m.flagged),
            );
            if m.clipped_fraction > 0.0 {
                line(
                    "clipped_fraction",
                    "fraction of clipped samples",
                    m.clipped_fraction,
                );
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
