//! The filter over both vortices, and its smoother.
//!
//! Check: the tests of [`track`](super::track).

use ndarray::{Array1, Array2};

use crate::Measured;
use crate::error::Error;
use crate::linalg::cholesky::cholesky;
use crate::linalg::positive_definite::{inverse, singular};
use crate::retrieval::{ScanResult, Side, VortexResult};

/// Numbers of one vortex and of both.
pub(super) const ONE: usize = 6;
const BOTH: usize = 12;
/// Largest normalised innovation.
const GATE: f64 = 16.3;
/// Scans within which a second detection makes a birth, and misses that make a death.
const BIRTH: usize = 3;
const DEATH: usize = 3;
/// What is known at birth of rates \[m/s\] and of q \[1/s\].
const RATE_M_S: f64 = 5.0;
const DECAY_PER_S: f64 = 0.05;
/// Spectral densities of the changes of the rate of decay \[1/s^3\] that are tried, with the prior of their logarithm to base 10.
const DECAY_DENSITIES_PER_S3: [f64; 6] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4];
const LOG10_DECAY_DENSITY: f64 = -7.0;
const LOG10_DECAY_DENSITY_STD: f64 = 1.5;
/// Spectral densities of a random walk of ln Gamma \[1/s\] that are tried.
const WALKS_PER_S: [f64; 3] = [0.0, 1e-5, 1e-4];
/// Standard deviation of positions whose method states none \[m\].
const UNSTATED_M: f64 = 1.5;

/// Mean and covariance.
#[derive(Clone)]
pub(super) struct State {
    mean: Array1<f64>,
    covariance: Array2<f64>,
}

impl State {
    /// An element of the state with its standard deviation.
    pub(super) fn element(&self, index: usize) -> Measured {
        Measured {
            value: self.mean[index],
            std: self.covariance[[index; 2]].max(0.0).sqrt(),
        }
    }
}

/// One scan of the filter.
pub(super) struct Step {
    /// Transition to this scan.
    transition: Array2<f64>,
    predicted: State,
    filtered: State,
    pub(super) alive: [bool; 2],
    pub(super) detected: [bool; 2],
}

/// The filter over all scans with the densities that make its innovations most likely.
pub(super) fn likely_filter(
    results: &[&ScanResult],
    times_s: &[f64],
    acceleration_m2_s3: f64,
) -> Result<Filter, Error> {
    let mut best: Option<(f64, Filter)> = None;
    for decay_per_s3 in DECAY_DENSITIES_PER_S3 {
        let away = (decay_per_s3.log10() - LOG10_DECAY_DENSITY) / LOG10_DECAY_DENSITY_STD;
        for walk_per_s in WALKS_PER_S {
            let filter =
                Filter::new(acceleration_m2_s3, decay_per_s3, walk_per_s).over(results, times_s)?;
            let posterior = filter.log_likelihood - 0.5 * away * away;
            if best.as_ref().is_none_or(|(most, _)| posterior > *most) {
                best = Some((posterior, filter));
            }
        }
    }
    best.map(|(_, filter)| filter).ok_or(Error::Empty {
        field: "densities of a track",
    })
}

/// How far detections are from their prediction.
struct Innovation {
    /// Square over the covariance.
    square: f64,
    /// Logarithm of the determinant of the covariance.
    log_determinant: f64,
    /// The state with the detections.
    state: State,
}

const INNOVATION: &str = "covariance of the innovation";

/// A filter through the scans of a track.
#[derive(Default)]
pub(super) struct Filter {
    /// Spectral density of the acceleration.
    acceleration_m2_s3: f64,
    /// That of the changes of the rate of decay.
    pub(super) decay_per_s3: f64,
    /// That of a random walk of ln Gamma.
    pub(super) walk_per_s: f64,
    pub(super) steps: Vec<Step>,
    misses: [usize; 2],
    pub(super) innovations: Vec<f64>,
    pub(super) rejected: usize,
    /// Of all innovations but for a constant; a detection that is not taken counts as one at the gate.
    log_likelihood: f64,
}

impl Filter {
    /// The filter before the first scan, with the spectral densities of the acceleration, of the
    /// changes of the rate of decay and of a random walk of ln Gamma.
    pub(super) fn new(acceleration_m2_s3: f64, decay_per_s3: f64, walk_per_s: f64) -> Self {
        Self {
            acceleration_m2_s3,
            decay_per_s3,
            walk_per_s,
            ..Self::default()
        }
    }

    /// The filter after all scans.
    pub(super) fn over(mut self, results: &[&ScanResult], times_s: &[f64]) -> Result<Self, Error> {
        for (k, result) in results.iter().enumerate() {
            let seconds = if k > 0 {
                times_s[k] - times_s[k - 1]
            } else {
                0.0
            };
            let soon = &results[k + 1..results.len().min(k + BIRTH)];
            self.step(result, soon, seconds)?;
        }
        Ok(self)
    }

    /// Prediction to the next scan; a vortex that does not live is forgotten.
    fn predicted(&self, before: &State, alive: [bool; 2], seconds: f64) -> (Array2<f64>, State) {
        let mut transition = Array2::eye(BOTH);
        let mut noise = Array2::zeros((BOTH, BOTH));
        for (i, alive) in alive.into_iter().enumerate() {
            let Self {
                acceleration_m2_s3,
                decay_per_s3,
                walk_per_s,
                ..
            } = *self;
            for (place, sign, density, walk) in [
                (0, 1.0, acceleration_m2_s3, 0.0),
                (2, 1.0, acceleration_m2_s3, 0.0),
                (4, -1.0, decay_per_s3, walk_per_s),
            ] {
                let a = ONE * i + place;
                let b = ONE * i + place + 1;
                if alive {
                    transition[[a, b]] = sign * seconds;
                    noise[[a, a]] = density * seconds.powi(3) / 3.0 + walk * seconds;
                    noise[[b, b]] = density * seconds;
                    noise[[a, b]] = sign * density * seconds.powi(2) / 2.0;
                    noise[[b, a]] = noise[[a, b]];
                } else {
                    transition[[a, a]] = 0.0;
                    transition[[b, b]] = 0.0;
                    noise[[a, a]] = 1.0;
                    noise[[b, b]] = 1.0;
                }
            }
        }
        let mean = transition.dot(&before.mean);
        let covariance = transition.dot(&before.covariance).dot(&transition.t()) + noise;
        (transition, State { mean, covariance })
    }

    /// Adds the scan that is `seconds` after the last one; `soon` are those after it within which a birth needs a second detection.
    fn step(
        &mut self,
        result: &ScanResult,
        soon: &[&ScanResult],
        seconds: f64,
    ) -> Result<(), Error> {
        let nothing = State {
            mean: Array1::zeros(BOTH),
            covariance: Array2::eye(BOTH),
        };
        let (before, mut alive) = self
            .steps
            .last()
            .map_or((&nothing, [false; 2]), |step| (&step.filtered, step.alive));
        let (transition, mut predicted) = self.predicted(before, alive, seconds);
        let mut taken = [None; 2];
        let mut lost = [false; 2];
        for (i, side) in Side::BOTH.into_iter().enumerate() {
            let observed = result
                .vortex(side)
                .filter(|vortex| vortex.circulation_m2_s.value > 0.0);
            if alive[i] {
                taken[i] = self.associated(&predicted, result, i, observed)?;
                let height_m = predicted.mean[ONE * i + 2];
                lost[i] = self.misses[i] >= DEATH || (height_m < 0.0 && taken[i].is_none());
                continue;
            }
            let is_confirmed = soon.iter().any(|next| next.vortex(side).is_some());
            if let Some(vortex) = observed.filter(|_| is_confirmed) {
                Self::born(&mut predicted, i, vortex);
                alive[i] = true;
                self.misses[i] = 0;
                taken[i] = Some(vortex);
            }
        }
        let pairs: Vec<(usize, &VortexResult)> = taken
            .iter()
            .enumerate()
            .filter_map(|(i, v)| Some((i, (*v)?)))
            .collect();
        let mut filtered = predicted.clone();
        if !pairs.is_empty() {
            let innovation = Self::innovation(&predicted, result, &pairs)?;
            self.log_likelihood -= 0.5 * (innovation.square + innovation.log_determinant);
            filtered = innovation.state;
        }
        for i in (0..2).filter(|i| lost[*i]) {
            alive[i] = false;
            self.end_with_last_detection(i);
        }
        let detected = taken.map(|vortex| vortex.is_some());
        self.steps.push(Step {
            transition,
            predicted,
            filtered,
            alive,
            detected,
        });
        Ok(())
    }

    /// The observed vortex if its normalised innovation is small enough, else a miss of the vortex that lives.
    fn associated<'v>(
        &mut self,
        predicted: &State,
        result: &ScanResult,
        i: usize,
        observed: Option<&'v VortexResult>,
    ) -> Result<Option<&'v VortexResult>, Error> {
        if let Some(vortex) = observed {
            let innovation = Self::innovation(predicted, result, &[(i, vortex)])?;
            if innovation.square < GATE {
                self.innovations.push(innovation.square);
                self.misses[i] = 0;
                return Ok(Some(vortex));
            }
            self.log_likelihood -= 0.5 * (GATE + innovation.log_determinant);
            self.rejected += 1;
        }
        self.misses[i] += 1;
        Ok(None)
    }

    /// Removes a vortex from the scans since its last detection.
    fn end_with_last_detection(&mut self, i: usize) {
        for step in self.steps.iter_mut().rev() {
            if !step.alive[i] || step.detected[i] {
                break;
            }
            step.alive[i] = false;
        }
    }

    /// A vortex begins where it is seen, with rates that are unknown.
    fn born(state: &mut State, i: usize, vortex: &VortexResult) {
        let z = Self::measured(vortex);
        for (place, rate) in [(0, RATE_M_S), (2, RATE_M_S), (4, DECAY_PER_S)] {
            let (value, std) = z[place / 2];
            for (at, mean, deviation) in [
                (ONE * i + place, value, 100.0 * std),
                (ONE * i + place + 1, 0.0, rate),
            ] {
                state.mean[at] = mean;
                state.covariance.row_mut(at).fill(0.0);
                state.covariance.column_mut(at).fill(0.0);
                state.covariance[[at, at]] = deviation * deviation;
            }
        }
    }

    /// y, z and ln Gamma with their standard deviations.
    fn measured(vortex: &VortexResult) -> [(f64, f64); 3] {
        let circulation = vortex.circulation_m2_s;
        let part = circulation.std / circulation.value;
        let log = (circulation.value.ln(), if part > 0.0 { part } else { 0.1 });
        let [lateral, height] = [vortex.lateral_position_m, vortex.height_m].map(|position| {
            let is_stated = position.std > 0.0;
            let std_m = if is_stated { position.std } else { UNSTATED_M };
            (position.value, std_m)
        });
        [lateral, height, log]
    }

    /// Innovation of the vortices of a scan.
    fn innovation(
        state: &State,
        result: &ScanResult,
        vortices: &[(usize, &VortexResult)],
    ) -> Result<Innovation, Error> {
        let order = 3 * vortices.len();
        let mut z = Array1::zeros(order);
        let mut h = Array2::zeros((order, BOTH));
        let mut deviations = vec![];
        let mut places = vec![];
        for (n, (i, vortex)) in vortices.iter().enumerate() {
            let seconds = if vortex.time_s.is_finite() {
                vortex.time_s - result.reference_time_s
            } else {
                0.0
            };
            for (row, (value, std)) in Self::measured(vortex).into_iter().enumerate() {
                z[3 * n + row] = value;
                h[[3 * n + row, ONE * i + 2 * row]] = 1.0;
                h[[3 * n + row, ONE * i + 2 * row + 1]] = if row < 2 { seconds } else { -seconds };
                deviations.push(std);
            }
            let [circulation, lateral, height, _] = vortex.side.parameters();
            places.extend([lateral, height, circulation].map(|parameter| parameter as usize));
        }
        let c = &result.covariance;
        let r = Array2::from_shape_fn((order, order), |(i, j)| {
            let a = places[i];
            let b = places[j];
            let correlation = if i == j {
                1.0
            } else {
                c[[a, b]] / (c[[a, a]] * c[[b, b]]).sqrt()
            };
            (if correlation.is_finite() {
                correlation
            } else {
                0.0
            }) * deviations[i]
                * deviations[j]
        });
        let innovation = z - h.dot(&state.mean);
        let ph = state.covariance.dot(&h.t());
        let of_innovation = h.dot(&ph) + &r;
        let s = inverse(INNOVATION, &of_innovation)?;
        let lower = cholesky(of_innovation).ok_or_else(|| singular(INNOVATION, order))?;
        let gain = ph.dot(&s);
        let keep = Array2::<f64>::eye(BOTH) - gain.dot(&h);
        // Joseph's form keeps it positive
        let covariance = keep.dot(&state.covariance).dot(&keep.t()) + gain.dot(&r).dot(&gain.t());
        let mean = &state.mean + &gain.dot(&innovation);
        Ok(Innovation {
            square: innovation.dot(&s.dot(&innovation)),
            log_determinant: 2.0 * lower.diag().iter().map(|pivot| pivot.ln()).sum::<f64>(),
            state: State { mean, covariance },
        })
    }

    /// States given all scans.
    pub(super) fn smoothed(&self) -> Result<Vec<State>, Error> {
        let mut states: Vec<State> = self
            .steps
            .iter()
            .map(|step| step.filtered.clone())
            .collect();
        for k in (0..states.len().saturating_sub(1)).rev() {
            let next = &self.steps[k + 1];
            let filtered = &self.steps[k].filtered;
            let mut gain = filtered.covariance.dot(&next.transition.t());
            gain = gain.dot(&inverse(
                "predicted covariance of a track",
                &next.predicted.covariance,
            )?);
            let later = &states[k + 1];
            let mean = &filtered.mean + &gain.dot(&(&later.mean - &next.predicted.mean));
            let change = &later.covariance - &next.predicted.covariance;
            let covariance = &filtered.covariance + &gain.dot(&change).dot(&gain.t());
            states[k] = State { mean, covariance };
        }
        Ok(states)
    }
}
