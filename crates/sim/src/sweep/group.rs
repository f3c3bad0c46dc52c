//! Cases that share their signals, measured together: the records of each realisation are made once.
//!
//! Check: the results of a case are those of the case by itself, to the last bit.

use super::circulation::Retrieval;
use super::results::{Cells, Measured, row};
use crate::Error;
use crate::measure::bound::bound_in_the_middle;
use crate::measure::map::{self, VelocityEstimates};
use crate::measure::profile::Efficiencies;
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::run::ScanMiddle;
use crate::scene::{DetectorSignal, Method, NoiseModel};
use crate::setup::progress::Observer;
use ndarray::Array2;
use num_complex::Complex;
use wakescope_estimate::window::Sample;

/// The rows of plans whose scenes differ in estimator, outputs and site alone.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub(super) fn rows(
    plans: &[Plan],
    known: &Efficiencies,
    observer: &dyn Observer,
    fits: bool,
) -> Result<Vec<Vec<f64>>, Error> {
    let Some(first) = plans.first() else { return Ok(Vec::new()) };
    let scanner = Scanner::with(first, known, observer)?;
    match first.scene.scene.detector.signal {
        DetectorSignal::IntermediateFrequency => of_samples::<f64>(plans, &scanner, observer, fits),
        DetectorSignal::Baseband => of_samples::<Complex<f64>>(plans, &scanner, observer, fits),
    }
}

/// The maps of plans whose scenes differ in estimator, outputs and site alone.
///
/// # Errors
/// What the crates refuse; a checked scene gives none.
pub(super) fn maps(
    plans: &[&Plan],
    known: &Efficiencies,
    observer: &dyn Observer,
) -> Result<Vec<VelocityEstimates>, Error> {
    let Some(first) = plans.first() else { return Ok(Vec::new()) };
    let scanner = Scanner::with(first, known, observer)?;
    match first.scene.scene.detector.signal {
        DetectorSignal::IntermediateFrequency => map::estimates::<f64>(plans, &scanner, observer, |_| (), |_, _| ()),
        DetectorSignal::Baseband => map::estimates::<Complex<f64>>(plans, &scanner, observer, |_| (), |_, _| ()),
    }
}

/// What is collected of the maps of a case.
struct Collected<'p> {
    retrieval: Option<Retrieval<'p>>,
    apart: Vec<(usize, usize)>,
    velocity_m_s: Vec<f64>,
}

fn of_samples<S: Sample + wakescope_signal::Sample>(
    plans: &[Plan],
    scanner: &Scanner<'_>,
    observer: &dyn Observer,
    fits: bool,
) -> Result<Vec<Vec<f64>>, Error> {
    let mut collected = Vec::with_capacity(plans.len());
    for plan in plans {
        let retrieval = if fits { Retrieval::new(plan, scanner) } else { None };
        collected.push(Collected { retrieval, apart: Cells::new(plan)?.apart(), velocity_m_s: Vec::new() });
    }
    let of_plans: Vec<&Plan> = plans.iter().collect();
    let seen = |i: usize, velocity_m_s: &Array2<f64>| {
        if let Some(collected) = collected.get_mut(i) {
            collected.velocity_m_s.extend(collected.apart.iter().map(|cell| velocity_m_s[*cell]));
            collected.retrieval.iter_mut().for_each(|retrieval| retrieval.add(velocity_m_s));
        }
    };
    let maps = map::estimates::<S>(&of_plans, scanner, observer, |_| (), seen)?;
    let mut rows = Vec::with_capacity(plans.len());
    for ((plan, map), collected) in plans.iter().zip(&maps).zip(&collected) {
        let truths_m_s = collected.apart.iter().map(|cell| map.v_gate_m_s[*cell]).cycle();
        let known = collected.velocity_m_s.iter().zip(truths_m_s).filter(|(_, truth)| truth.is_finite());
        let errors_m_s: Vec<f64> = known.map(|(velocity, truth)| velocity - truth).collect();
        let e = &plan.scene.scene;
        // The bound of velocity alone is none on a velocity beside a gradient.
        let bounded =
            e.detector.noise != NoiseModel::None && !matches!(e.estimator.method, Method::GradientLikelihood(_));
        let bound = bounded.then(|| bound_in_the_middle(plan, scanner)).transpose()?;
        let middle = ScanMiddle::of(plan, None, Some(scanner))
            .ok_or(wakescope_estimate::Error::Empty { field: "layers of a line" })?;
        let circulation = collected.retrieval.as_ref().map(Retrieval::result);
        rows.push(row(plan, &Measured { middle, bound, map, errors_m_s: &errors_m_s, circulation })?);
    }
    Ok(rows)
}
