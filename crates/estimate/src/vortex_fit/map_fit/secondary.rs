//! Secondary vortices: what the boundary layer at the ground rolls up into beside each vortex, and which turn against it.
//!
//! Gates that are longer than the distance of a vortex from its secondary one see both at once: a fit of two vortices then puts them metres
//! to the side and some tenths too weak. So the residuals of such a fit are searched for a vortex of the other sense near each of
//! the two, beside all that the pair or another profile of its vortices could do about them. If both together explain enough, all four are fitted at once: damped steps of Gauss and Newton with difference quotients at
//! every few places, weighted with the loss. Of secondary vortices it is known before how strong they are and how far from their vortex
//! (`KNOWN_RATIO`, `KNOWN_DISTANCE`), and their cores are kept. Check: exact maps with four vortices, and with two; simulated wakes.

use ndarray::{Array1, Array2, Zip};
use std::ops::Range;

use crate::error::Error;
use crate::retrieval::motion::Motion;
use crate::vortex_fit::damped_newton::{Averaging, halved, inverse, solve};
use crate::vortex_fit::map_fit::data::robust_scale;
use crate::vortex_fit::map_fit::estimator_response::Prepared;
use crate::vortex_fit::map_fit::residual_covariance::{Cell, alike, filling};
use crate::vortex_fit::map_fit::tangent::{self, Tangent};
use crate::vortex_fit::wake::free_parameters::spread;
use crate::vortex_fit::wake::pair::Ray;
use crate::vortex_fit::wake::range_kernel::LineScratch;
use crate::vortex_fit::{CorePrior, MapFitOptions, RangeKernel, VelocityMap, Vortex, Wake, WakeModel};

/// Circulation over that of the vortex, and distance over its height: mean and standard deviation. The strongest secondary vortex of the
/// medium wake (the mean along x, `wake_scaled.csv`) has -0.2 to -0.3 and 1.1 to 0.5 between tau = 1.25 and 2.5, without the weaker
/// vorticity about it that gates see as well.
const KNOWN_RATIO: (f64, f64) = (-0.4, 0.25);
const KNOWN_DISTANCE: (f64, f64) = (0.8, 0.4);
/// What is allowed of both in the search, and in the end of any opposite circulation.
const RATIOS: (f64, f64) = (-0.8, -0.05);
const DISTANCES: (f64, f64) = (0.25, 1.5);
/// Core radius, and distance of the places of the search, over the height of the vortex.
const CORE_OVER_HEIGHT: f64 = 0.12;
const GRID_OVER_HEIGHT: f64 = 0.12;
/// Least gain of the logarithm of the likelihood by both, with velocities that say the same counted once.
const LEAST_GAIN: f64 = 20.0;
const LEAST_SEARCHED: f64 = 3.0;
/// Numbers of the secondary vortices that are fitted.
const NUMBERS: usize = 6;
/// Most steps, rounds of weights in each, and what is left of the last in standard deviations.
const STEPS: usize = 30;
const ROUNDS: usize = 10;
const NEAR_SIGMAS: f64 = 0.3;
/// Steps of difference quotients, over the circulation and the height of the vortex, and how many of them a step of the fit may go.
const QUOTIENTS: [f64; 2] = [0.02, 0.02];
const REACH: f64 = 12.0;

/// A map and what is expected of it.
pub(crate) struct Setting<'a, 'm> {
    pub(crate) map: &'a VelocityMap<'m>,
    pub(crate) model: &'a WakeModel,
    /// What an estimator shows; means over gates without one.
    pub(crate) prepared: Option<&'a Prepared<'a>>,
    /// What gates see in the mean.
    pub(crate) kernel: &'a RangeKernel,
    /// Seconds of each line after the time of the wake, for means of vortices that move; what an estimator shows moves by itself.
    pub(crate) seconds: Option<&'a [f64]>,
    pub(crate) options: &'a MapFitOptions,
    pub(crate) groups: &'a [Vec<usize>],
}

/// Four vortices that explain a map better than two.
pub(crate) struct Found {
    pub(crate) wake: Wake,
    pub(crate) secondary: [Vortex; 2],
    /// Of the wake alone \[10, 10\].
    pub(crate) covariance: Array2<f64>,
}

#[derive(Clone, Copy)]
struct State {
    wake: Wake,
    secondary: [Vortex; 2],
}

impl State {
    fn primary(&self, side: usize) -> &Vortex {
        if side == 0 { &self.wake.left } else { &self.wake.right }
    }

    /// Circulation of a secondary vortex over that of its vortex, and distance over the height of the latter.
    fn relative(&self, side: usize) -> (f64, f64) {
        let (own, other) = (self.primary(side), &self.secondary[side]);
        (other.circulation_m2_s / own.circulation_m2_s, distance_m(own, other) / own.height_m)
    }

    /// How far what is known of the secondary vortices is missed, in deviations.
    fn away(&self) -> [f64; 4] {
        let of = |side: usize| {
            let (ratio, distance) = self.relative(side);
            [(ratio - KNOWN_RATIO.0) / KNOWN_RATIO.1, (distance - KNOWN_DISTANCE.0) / KNOWN_DISTANCE.1]
        };
        let ([a, b], [c, d]) = (of(0), of(1));
        [a, b, c, d]
    }

    fn is_possible(&self) -> bool {
        self.wake.validate().is_ok()
            && (0..2).all(|side| self.primary(side).height_m > 0.0 && self.secondary[side].height_m > 0.0)
    }
}

/// Whether a secondary vortex may be that far from its vortex, over the height of the latter.
fn is_near(distance: f64) -> bool {
    (DISTANCES.0..=DISTANCES.1).contains(&distance)
}

fn distance_m(a: &Vortex, b: &Vortex) -> f64 {
    (a.lateral_position_m - b.lateral_position_m).hypot(a.height_m - b.height_m)
}

/// Velocities and slopes about a state, what they cost, and how much they scatter.
struct Linear {
    here: Array2<f64>,
    slopes: Vec<Array2<f64>>,
    deviation: Array2<f64>,
    scale: f64,
}

/// Curvature and gradient of the cost.
struct Sums {
    curvature: Array2<f64>,
    gradient: Vec<f64>,
}

/// Residuals of a pair and what its free numbers can do about them.
struct Free<'a> {
    /// Weighted residuals and weights, over the units.
    weighted: Array2<f64>,
    weights: Array2<f64>,
    slopes: &'a [Array2<f64>],
    /// Of the curvature.
    inverse: Array2<f64>,
    /// Where the free numbers go.
    step: Array1<f64>,
}

impl Setting<'_, '_> {
    /// The best wake with secondary vortices, if there are any beside those of a fit without them and the fit of all comes to an end. Without
    /// a ground there are none.
    pub(crate) fn find(&self, pair: &Wake) -> Option<Found> {
        let possible = |vortex: &Vortex| vortex.circulation_m2_s > 0.0 && vortex.height_m > 0.0;
        if !self.model.images || !possible(&pair.left) || !possible(&pair.right) {
            return None;
        }
        let none = |own: &Vortex| Vortex { circulation_m2_s: 0.0, ..*own };
        let two = State { wake: *pair, secondary: [none(&pair.left), none(&pair.right)] };
        let mut alone = self.about(&two, &self.quotients(&two)[..self.groups.len()]);
        let counted = alike(&self.cells(&alone), self.options.correlated_lines);
        // A profile that does not fit is not mended by vortices.
        let profile = self.model.profile.other();
        let other = self.velocities_of(&WakeModel { profile, ..*self.model }, pair);
        let apart = other - &alone.here;
        alone.slopes.push(apart);
        let (secondary, gain, of_profile) = self.search(pair, &alone)?;
        if gain / counted < LEAST_SEARCHED {
            return None;
        }
        let (state, four) = self.descend(State { wake: *pair, secondary }, counted)?;
        // what two vortices miss looks like noise that neighbours share: what four leave tells how many velocities count as one
        let counted = alike(&self.cells(&four), self.options.correlated_lines).min(counted);
        let known: f64 = state.away().iter().map(|away| 0.5 * away * away).sum();
        let gain = (self.log_likelihood(&four) - self.log_likelihood(&alone) - of_profile) / counted - known;
        // one far from its vortex stands for something else; a little beyond the scan it may be
        let stands = (0..2).all(|side| {
            let (ratio, distance) = state.relative(side);
            (RATIOS.0..0.0).contains(&ratio) && is_near(distance)
        });
        if gain < LEAST_GAIN || !stands {
            return None;
        }
        let covariance = self.covariance(&state, &four, counted).ok()?;
        Some(Found { wake: state.wake, secondary: state.secondary, covariance })
    }

    fn velocities(&self, state: &State) -> Array2<f64> {
        self.velocities_of(&WakeModel { secondary: Some(state.secondary), ..*self.model }, &state.wake)
    }

    fn velocities_of(&self, model: &WakeModel, wake: &Wake) -> Array2<f64> {
        match self.prepared {
            Some(prepared) => prepared.velocities_of(model, wake),
            None => {
                let mut velocities = Array2::zeros(self.map.velocity_m_s.dim());
                let mut scratch = LineScratch::default();
                let motion = self.seconds.map(|seconds| (Motion::new(model, wake), seconds));
                for (line, mut row) in velocities.rows_mut().into_iter().enumerate() {
                    let then =
                        motion.as_ref().map_or(*wake, |(motion, seconds)| motion.wake_after(wake, seconds[line]));
                    let seen = (model, &then, Ray::new(self.map.elevation_rad[line]));
                    self.kernel.apply(seen, self.map.range_m, false, &mut scratch, |gate, v, _| row[gate] = v);
                }
                velocities
            }
        }
    }

    /// Places with a velocity, their residuals and units \[m/s\]: a scale times what each scatters.
    fn residuals<'l>(&'l self, linear: &'l Linear) -> impl Iterator<Item = ((usize, usize), f64, f64)> + 'l {
        let of = move |(place, velocity): ((usize, usize), &f64)| {
            let unit = linear.scale * linear.deviation[place] * self.map.deviation(place.0, place.1);
            (place, (velocity - linear.here[place]) / unit, unit)
        };
        self.map.velocity_m_s.indexed_iter().map(of).filter(|(_, residual, _)| residual.is_finite())
    }

    fn log_likelihood(&self, linear: &Linear) -> f64 {
        -self.residuals(linear).map(|(_, residual, unit)| self.options.loss.at(residual).0 + unit.ln()).sum::<f64>()
    }

    fn cells(&self, linear: &Linear) -> Vec<Vec<Option<Cell>>> {
        let mut cells = vec![vec![None; self.map.range_m.len()]; self.map.elevation_rad.len()];
        for (place, residual, unit) in self.residuals(linear) {
            let slopes: Vec<f64> = linear.slopes.iter().map(|slope| slope[place] / unit).collect();
            if slopes.iter().all(|slope| slope.is_finite()) {
                let residual = self.options.loss.at(residual).1 * residual;
                cells[place.0][place.1] = Some(Cell { residual, slopes });
            }
        }
        cells
    }

    /// The vortices of the other sense, one beside each of the pair, that explain most of its residuals by their means over gates if the pair
    /// may move along its slopes, how much of the logarithm of the likelihood, and how much these slopes explain.
    fn search(&self, pair: &Wake, alone: &Linear) -> Option<([Vortex; 2], f64, f64)> {
        let mut free = Free {
            weighted: Array2::zeros(alone.here.dim()),
            weights: Array2::zeros(alone.here.dim()),
            slopes: &alone.slopes,
            inverse: Array2::zeros((0, 0)),
            step: Array1::zeros(0),
        };
        for (place, residual, unit) in self.residuals(alone) {
            let weight = self.options.loss.at(residual).1;
            if alone.slopes.iter().all(|slope| slope[place].is_finite()) {
                free.weighted[place] = weight * residual / unit;
                free.weights[place] = weight / (unit * unit);
            }
        }
        let product = |a: &Array2<f64>, b: &Array2<f64>| {
            Zip::from(a)
                .and(b)
                .and(&free.weights)
                .fold(0.0, |sum, a, b, w| if *w > 0.0 { sum + w * a * b } else { sum })
        };
        let order = alone.slopes.len();
        let curvature = Array2::from_shape_fn((order, order), |(i, j)| product(&alone.slopes[i], &alone.slopes[j]));
        free.inverse = inverse("curvature of the fit", &curvature).ok()?;
        let along = |slope: &Array2<f64>| {
            let both = Zip::from(slope).and(&free.weighted).and(&free.weights);
            both.fold(0.0, |sum, s, r, w| if *w > 0.0 { sum + s * r } else { sum })
        };
        let gradient: Array1<f64> = alone.slopes.iter().map(along).collect();
        free.step = free.inverse.dot(&gradient);
        let ((left, a), (right, b)) = (self.beside(pair, 0, &free)?, self.beside(pair, 1, &free)?);
        Some(([left, right], a + b, 0.5 * gradient.dot(&free.step)))
    }

    /// Every second place of a grid first, then those about the best of them.
    fn beside(&self, pair: &Wake, side: usize, free: &Free<'_>) -> Option<(Vortex, f64)> {
        let own = if side == 0 { &pair.left } else { &pair.right };
        let count = (DISTANCES.1 / GRID_OVER_HEIGHT).ceil() as i64;
        let mut scratch = LineScratch::default();
        let mut best = |rows: Range<i64>, columns: Range<i64>, step: usize| {
            let places = rows.step_by(step).flat_map(|i| columns.clone().step_by(step).map(move |j| (i, j)));
            let gains = places.filter_map(|at| Some((at, self.gain((own, side), at, free, &mut scratch)?)));
            gains.max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))
        };
        let ((i, j), _) = best(-count..count + 1, -count..count + 1, 2)?;
        best(i - 1..i + 2, j - 1..j + 2, 1).map(|(_, found)| found)
    }

    /// The best vortex at a place of the grid about one of the pair, and what it gains; nothing where there can be none.
    fn gain(
        &self,
        (own, side): (&Vortex, usize),
        (i, j): (i64, i64),
        free: &Free<'_>,
        scratch: &mut LineScratch,
    ) -> Option<(Vortex, f64)> {
        let step_m = GRID_OVER_HEIGHT * own.height_m;
        let vortex = Vortex {
            circulation_m2_s: 1.0,
            lateral_position_m: own.lateral_position_m + i as f64 * step_m,
            height_m: own.height_m + j as f64 * step_m,
            core_radius_m: CORE_OVER_HEIGHT * own.height_m,
        };
        let distance = distance_m(own, &vortex) / own.height_m;
        if !is_near(distance) || vortex.height_m <= 0.0 || !self.sees(&vortex) {
            return None;
        }
        let plain = WakeModel { secondary: None, ..*self.model };
        let nowhere = Vortex { circulation_m2_s: 0.0, ..*own };
        let (left, right) = if side == 0 { (vortex, nowhere) } else { (nowhere, vortex) };
        let wake = Wake { left, right, lateral_wind_m_s: 0.0, wind_shear_per_s: 0.0 };
        let (mut slope, mut square, mut shared) = (0.0, 0.0, Array1::zeros(free.slopes.len()));
        for (line, elevation_rad) in self.map.elevation_rad.iter().enumerate() {
            let seen = (&plain, &wake, Ray::new(*elevation_rad));
            self.kernel.apply(seen, self.map.range_m, false, scratch, |gate, velocity, _| {
                let place = [line, gate];
                let weight = free.weights[place];
                if weight > 0.0 {
                    slope += velocity * free.weighted[place];
                    square += velocity * velocity * weight;
                    shared.iter_mut().zip(free.slopes).for_each(|(sum, of)| *sum += weight * velocity * of[place]);
                }
            });
        }
        // what the pair could do as well does not count
        let square = square - shared.dot(&free.inverse.dot(&shared));
        let slope = slope - shared.dot(&free.step);
        let allowed = (RATIOS.0 * own.circulation_m2_s, RATIOS.1 * own.circulation_m2_s);
        let circulation_m2_s = (slope / square).clamp(allowed.0, allowed.1);
        let gain = circulation_m2_s * (slope - 0.5 * circulation_m2_s * square);
        (square > 0.0 && gain.is_finite()).then_some((Vortex { circulation_m2_s, ..vortex }, gain))
    }

    /// Whether a centre lies within the scan.
    fn sees(&self, vortex: &Vortex) -> bool {
        let (y_m, z_m) = (
            vortex.lateral_position_m - self.model.lidar_lateral_position_m,
            vortex.height_m - self.model.lidar_height_m,
        );
        let within =
            |axis: &[f64], at: f64| axis.first().is_some_and(|a| at >= *a) && axis.last().is_some_and(|b| at <= *b);
        within(self.map.range_m, y_m.hypot(z_m)) && within(self.map.elevation_rad, z_m.atan2(y_m))
    }

    /// A state with one of its numbers moved.
    fn moved(&self, state: &State, steps: &[f64]) -> State {
        let mut parameters = state.wake.to_array();
        for (group, step) in self.groups.iter().zip(steps) {
            group.iter().for_each(|&place| parameters[place] += step);
        }
        let mut moved = State { wake: Wake::from_array(&parameters), ..*state };
        for (vortex, by) in moved.secondary.iter_mut().zip(steps[self.groups.len()..].chunks(NUMBERS / 2)) {
            vortex.circulation_m2_s += by[0];
            vortex.lateral_position_m += by[1];
            vortex.height_m += by[2];
        }
        moved
    }

    /// Steps of difference quotients.
    fn quotients(&self, state: &State) -> Vec<f64> {
        let mut steps: Vec<f64> = self.groups.iter().map(|group| tangent::step(&state.wake, group[0])).collect();
        for side in 0..2 {
            let own = state.primary(side);
            let place_m = QUOTIENTS[1] * own.height_m;
            steps.extend([QUOTIENTS[0] * own.circulation_m2_s.abs().max(1.0), place_m, place_m]);
        }
        steps
    }

    /// What is known before: distances in deviations with their slopes.
    fn known(&self, state: &State, steps: &[f64]) -> Vec<(f64, Vec<f64>)> {
        let terms = |state: &State| {
            let cores =
                self.options.core_prior.map_or_else(Vec::new, |known: CorePrior| known.terms(&state.wake, self.groups));
            let mut away: Vec<f64> = cores.into_iter().map(|(away, _)| away).collect();
            away.extend(state.away());
            away
        };
        let here = terms(state);
        let mut known: Vec<(f64, Vec<f64>)> = here.iter().map(|away| (*away, vec![0.0; steps.len()])).collect();
        for (number, step) in steps.iter().enumerate() {
            let mut one = vec![0.0; steps.len()];
            one[number] = *step;
            let there = terms(&self.moved(state, &one));
            for ((known, there), here) in known.iter_mut().zip(&there).zip(&here) {
                known.1[number] = (there - here) / step;
            }
        }
        known
    }

    /// Velocities and slopes about a state.
    fn about(&self, state: &State, steps: &[f64]) -> Linear {
        let here = self.velocities(state);
        let quotient = |number: usize| {
            let mut one = vec![0.0; steps.len()];
            one[number] = steps[number];
            (self.velocities(&self.moved(state, &one)) - &here) / steps[number]
        };
        let slopes = (0..steps.len()).map(quotient).collect();
        let deviation = match self.prepared {
            Some(prepared) => Tangent::new(prepared, state.wake, here.view(), &[], self.map).deviation,
            None => Array2::ones(here.dim()),
        };
        let mut linear = Linear { here, slopes, deviation, scale: 1.0 };
        linear.scale = robust_scale(self.residuals(&linear).map(|(_, residual, _)| residual)).max(1e-6);
        linear
    }

    /// Sums over the places after a step, with the weights of the loss there.
    fn sums(&self, linear: &Linear, known: &[(f64, Vec<f64>)], counted: f64, step: &[f64]) -> Sums {
        let order = step.len();
        let mut sums = Sums { curvature: Array2::zeros((order, order)), gradient: vec![0.0; order] };
        let mut add = |away: f64, weight: f64, slopes: &[f64]| {
            for (i, s) in slopes.iter().enumerate() {
                sums.gradient[i] += weight * away * s;
                for (j, t) in slopes.iter().enumerate() {
                    sums.curvature[[i, j]] += weight * s * t;
                }
            }
        };
        let along = |slopes: &[f64]| slopes.iter().zip(step).map(|(s, by)| s * by).sum::<f64>();
        let mut slopes = vec![0.0; order];
        for (place, residual, unit) in self.residuals(linear) {
            slopes.iter_mut().zip(&linear.slopes).for_each(|(slope, of)| *slope = of[place] / unit);
            if slopes.iter().all(|slope| slope.is_finite()) {
                let left = residual - along(&slopes);
                add(-left, self.options.loss.at(left).1, &slopes);
            }
        }
        known.iter().for_each(|(away, slopes)| add(away + along(slopes), counted, slopes));
        sums
    }

    /// The nearest minimum of the cost and the velocities about it, if the steps come to an end and it is possible.
    fn descend(&self, start: State, counted: f64) -> Option<(State, Linear)> {
        let mut state = start;
        let (mut averaging, mut last) = (Averaging::default(), vec![0.0; self.groups.len() + NUMBERS]);
        for _ in 0..STEPS {
            let steps = self.quotients(&state);
            let linear = self.about(&state, &steps);
            let known = self.known(&state, &steps);
            let mut way = vec![0.0; steps.len()];
            for _ in 0..ROUNDS {
                let Sums { curvature, gradient } = self.sums(&linear, &known, counted, &way);
                let down: Vec<f64> = gradient.iter().map(|g| -g).collect();
                let more = solve(&curvature, &down)?;
                way.iter_mut().zip(&more).for_each(|(way, more)| *way += more);
                if more.iter().zip(&down).map(|(m, d)| m * d).sum::<f64>() <= (0.1 * NEAR_SIGMAS).powi(2) * counted {
                    break;
                }
            }
            let curvature = self.sums(&linear, &known, counted, &way).curvature;
            let product =
                |a: &[f64], b: &[f64]| -> f64 { curvature.indexed_iter().map(|((i, j), c)| c * a[i] * b[j]).sum() };
            let share = averaging.part(product(&way, &last), product(&last, &last));
            if share * (product(&way, &way) / counted).sqrt() <= NEAR_SIGMAS {
                return Some((state, linear));
            }
            let reach = way.iter().zip(&steps).map(|(way, step)| REACH * step / way.abs().max(f64::MIN_POSITIVE));
            let next = halved(reach.fold(share, f64::min), |part| {
                let trial = self.moved(&state, &way.iter().map(|way| part * way).collect::<Vec<f64>>());
                trial.is_possible().then_some(trial)
            })?;
            (state, last) = (next, way);
        }
        None
    }

    /// Of the wake, whatever the secondary vortices are: its part of the sandwich of all numbers.
    fn covariance(&self, state: &State, linear: &Linear, counted: f64) -> Result<Array2<f64>, Error> {
        let steps = self.quotients(state);
        let known = self.known(state, &steps);
        let curvature = self.sums(linear, &known, counted, &vec![0.0; steps.len()]).curvature;
        let bread = inverse("curvature of the fit", &curvature)?;
        let (mut filling, _) = filling(&self.cells(linear), &bread, self.options.correlated_lines);
        for (_, slopes) in &known {
            filling.indexed_iter_mut().for_each(|((i, j), sum)| *sum += counted * counted * slopes[i] * slopes[j]);
        }
        let all = bread.dot(&filling).dot(&bread);
        let own = self.groups.len();
        Ok(spread(self.groups, &all.slice(ndarray::s![..own, ..own]).to_owned()))
    }
}
