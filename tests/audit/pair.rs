//! A pair that decays and moves, (V14) to (V16): point vortices and their images in plain Runge-Kutta steps.
//!
//! Lengths in spacings, times in `tau`; y from the middle of the pair at its release, circulations in that of the release.

use super::air::{circulation_m2_s, mean_wind_m_s};
use super::scene::Scene;
use std::f64::consts::PI;

/// Steps of a unit of time.
const STEPS_PER_TAU: f64 = 1000.0;
/// Time beyond the start of the scan that a path holds, s: no scan of the draws takes longer.
const SCAN_S: f64 = 3.0;

/// Positions of the left and right vortex and of their secondary ones, the descent H and the slowing W.
type State = [f64; 10];

/// A pair and what acts on it.
#[derive(Debug, Clone)]
struct Pair {
    gamma_m2_s: f64,
    spacing_m: f64,
    core_m: f64,
    profile: String,
    middle_m: f64,
    height_m: f64,
    cross_wind_m_s: f64,
    age_tau: f64,
    /// Place and speed of the aircraft behind which the pair is.
    aircraft: Option<[f64; 2]>,
    has_rebound: bool,
    is_two_phase: bool,
    slow: f64,
    fast: f64,
    rate: f64,
    lifetime_tau: f64,
    n_star: f64,
}

/// A pair and its path.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pair: Pair,
    /// Time, state and how it changes, step after step.
    steps: Vec<(f64, State, State)>,
    birth_tau: [f64; 2],
}

/// T of (V15), the middle branch by halving.
fn lifetime_tau(eps_star: f64) -> f64 {
    if eps_star >= 0.2535 {
        return (0.7475 / eps_star).powf(0.75);
    }
    if eps_star < 0.0121 {
        return 9.18 - 180.0 * eps_star;
    }
    let (mut low, mut high) = (0.5, 12.0);
    for _ in 0..80 {
        let middle: f64 = 0.5 * (low + high);
        match middle.powf(0.25) * (-0.7 * middle).exp() > eps_star {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

impl Pair {
    /// The pair of a scene, if it is transported; one that eddies move has a path that hangs on their waves.
    fn of(s: &Scene) -> Option<Self> {
        let is_transported =
            s.s("flow.kind") == "vortex_pair" && s.s("flow.motion") == "transported";
        if !is_transported || s.is_true("flow.meander") {
            return None;
        }
        let or = |key: &str, default: f64| match s.f(&format!("flow.{key}")) {
            value if value.is_nan() => default,
            value => value,
        };
        let (gamma_m2_s, spacing_m) = (or("circulation_m2_s", 500.0), or("spacing_m", 47.0));
        let v0_m_s = gamma_m2_s / (2.0 * PI * spacing_m);
        let of_eddies = super::eddies::Eddies::of(s).map_or(0.0, |e| e.dissipation_m2_s3);
        let eps_star = (or("dissipation_m2_s3", of_eddies) * spacing_m).cbrt() / v0_m_s;
        let n_star = or("buoyancy_per_s", 0.0) * spacing_m / v0_m_s;
        let of_stability = 0.5 * PI / (2.84 / (2.0 * PI)).sqrt() / n_star;
        let of_turbulence = or("lifetime_tau", lifetime_tau(eps_star));
        let law = s.s("flow.decay.law");
        let aircraft = s
            .has("flow.aircraft")
            .then(|| [or("aircraft.x_m", 0.0), or("aircraft.speed_m_s", 70.0)]);
        Some(Self {
            gamma_m2_s,
            spacing_m,
            core_m: or("core_radius_m", 2.35),
            profile: s.s("flow.profile"),
            middle_m: or("lateral_position_m", 400.0),
            height_m: or("height_m", 47.0),
            cross_wind_m_s: or("cross_wind_m_s", 0.0),
            age_tau: or("age_tau", 0.0),
            aircraft,
            has_rebound: s.is_true("flow.rebound"),
            is_two_phase: law != "sarpkaya",
            slow: or("decay.slow", 0.06),
            fast: or("decay.fast", 0.4),
            rate: or("decay.rate", 0.45),
            lifetime_tau: of_turbulence.min(of_stability),
            n_star,
        })
    }

    fn t0_s(&self) -> f64 {
        2.0 * PI * self.spacing_m.powi(2) / self.gamma_m2_s
    }

    /// Circulations of the four vortices, anticlockwise positive; 0 before birth.
    fn circulations(&self, tau: f64, birth_tau: [f64; 2]) -> [f64; 4] {
        let mut out = [0.0; 4];
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let (mut lifetime_tau, mut fast) = (self.lifetime_tau, self.fast);
            if birth_tau[side] + 1.5 < lifetime_tau {
                (lifetime_tau, fast) = (birth_tau[side] + 1.5, 0.2);
            }
            let decay = match self.is_two_phase {
                true => self.slow * tau + fast * (tau - lifetime_tau).max(0.0),
                false => self.rate * tau / self.lifetime_tau,
            };
            out[side] = sign * (-decay).exp();
            let since = tau - birth_tau[side];
            if since > 0.0 {
                let size = 0.966 * (1.0 - (-since / 0.173).exp()) * (-since / 1.305).exp();
                out[2 + side] = -sign * size;
            }
        }
        out
    }

    /// How a state changes (V16).
    fn rate(&self, s: &Scene, tau: f64, state: &State, birth_tau: [f64; 2]) -> State {
        let circulation = self.circulations(tau, birth_tau);
        let at = |i: usize| [state[2 * i], state[2 * i + 1]];
        let slowing = state[9].max(0.0);
        let mut out = [0.0; 10];
        for own in 0..4 {
            if own >= 2 && tau < birth_tau[own - 2] {
                continue;
            }
            let (mut across, mut up) = (0.0, 0.0);
            for other in 0..4 {
                for (sign, z) in [(1.0, at(other)[1]), (-1.0, -at(other)[1])] {
                    if other == own && sign > 0.0 {
                        continue;
                    }
                    let (dy, dz) = (at(own)[0] - at(other)[0], at(own)[1] - z);
                    let size = sign * circulation[other] / (dy * dy + dz * dz + 1e-4);
                    across -= size * dz;
                    up += size * dy * if own < 2 && other < 2 { slowing } else { 1.0 };
                }
            }
            let wind = self.carried(s, at(own));
            out[2 * own] = across + wind[0];
            out[2 * own + 1] = up + wind[1];
            if own < 2 {
                out[8] -= 0.5 * up;
            }
        }
        if slowing > 0.0 {
            let g = 0.5 * (circulation[1] - circulation[0]);
            out[9] = -2.84 / (2.0 * PI) * self.n_star.powi(2) * state[8] / g;
        }
        out
    }

    /// The mean winds at a place, in spacings a unit of time.
    fn carried(&self, s: &Scene, [_, z]: [f64; 2]) -> [f64; 2] {
        let wind_m_s = mean_wind_m_s(s, z * self.spacing_m);
        let scale = self.t0_s() / self.spacing_m;
        [
            scale * (wind_m_s[1] + self.cross_wind_m_s),
            scale * wind_m_s[2],
        ]
    }

    fn stepped(&self, s: &Scene, tau: f64, at: &State, step: f64, birth_tau: [f64; 2]) -> State {
        let moved =
            |rate: &State, by: f64| -> State { std::array::from_fn(|i| at[i] + by * rate[i]) };
        let a = self.rate(s, tau, at, birth_tau);
        let b = self.rate(s, tau + 0.5 * step, &moved(&a, 0.5 * step), birth_tau);
        let c = self.rate(s, tau + 0.5 * step, &moved(&b, 0.5 * step), birth_tau);
        let d = self.rate(s, tau + step, &moved(&c, step), birth_tau);
        let mut out: State =
            std::array::from_fn(|i| at[i] + step / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        out[9] = out[9].max(0.0);
        out
    }
}

impl Path {
    /// The path of the pair of a scene, from its release to the end of the scan.
    pub(crate) fn of(s: &Scene) -> Option<Self> {
        let pair = Pair::of(s)?;
        let z = pair.height_m / pair.spacing_m;
        let mut state = [-0.5, z, 0.5, z, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let (mut tau, mut birth_tau) = (0.0, [f64::INFINITY; 2]);
        let passed_s = pair
            .aircraft
            .map_or(0.0, |[x_m, speed_m_s]| x_m / speed_m_s);
        let last_tau = pair.age_tau + (SCAN_S + passed_s) / pair.t0_s() + 0.1;
        let mut steps = Vec::new();
        loop {
            for (side, outward) in [(0, -1.0), (1, 1.0)] {
                let is_low = state[2 * side + 1] <= 0.54 + 1e-9;
                if pair.has_rebound && birth_tau[side].is_infinite() && is_low {
                    birth_tau[side] = tau;
                    state[4 + 2 * side] = state[2 * side] + outward * 1.137;
                    state[5 + 2 * side] = 0.179;
                }
            }
            steps.push((tau, state, pair.rate(s, tau, &state, birth_tau)));
            if tau > last_tau {
                return Some(Self {
                    pair,
                    steps,
                    birth_tau,
                });
            }
            let sinks = |state: &State| {
                let is_unborn = |side: usize| pair.has_rebound && birth_tau[side].is_infinite();
                (0..2).any(|side| is_unborn(side) && state[2 * side + 1] <= 0.54)
            };
            let mut step = 1.0 / STEPS_PER_TAU;
            if sinks(&pair.stepped(s, tau, &state, step, birth_tau)) {
                let mut above = 0.0;
                for _ in 0..50 {
                    let middle = 0.5 * (above + step);
                    match sinks(&pair.stepped(s, tau, &state, middle, birth_tau)) {
                        true => step = middle,
                        false => above = middle,
                    }
                }
            }
            state = pair.stepped(s, tau, &state, step, birth_tau);
            tau += step;
        }
    }

    /// Circulation, m^2/s, and place, m, of the left and right vortex and of their secondary ones, `time_s` after the scan began;
    /// nothing before the release.
    pub(crate) fn vortices(&self, x_m: f64, time_s: f64) -> Option<[(f64, [f64; 2]); 4]> {
        let pair = &self.pair;
        let passed_s = pair
            .aircraft
            .map_or(0.0, |[at_m, speed_m_s]| (at_m - x_m) / speed_m_s);
        let tau = pair.age_tau + (time_s + passed_s) / pair.t0_s();
        if tau < 0.0 {
            return None;
        }
        let after = self.steps.partition_point(|(known, ..)| *known <= tau);
        let after = after.clamp(1, self.steps.len() - 1);
        let (from, to) = (&self.steps[after - 1], &self.steps[after]);
        let step = to.0 - from.0;
        let share = (tau - from.0) / step;
        let place = |i: usize| {
            // Straight lines of each end meet in the middle: a cubic.
            let (a, b) = (from.1[i], to.1[i]);
            let (rise, fall) = (step * from.2[i] - (b - a), step * to.2[i] - (b - a));
            let bow = share * (1.0 - share) * ((1.0 - share) * rise - share * fall);
            a + share * (b - a) + bow
        };
        let circulation = pair.circulations(tau, self.birth_tau);
        Some(std::array::from_fn(|i| {
            let y_m = pair.middle_m + pair.spacing_m * place(2 * i);
            let z_m = pair.spacing_m * place(2 * i + 1);
            (pair.gamma_m2_s * circulation[i], [y_m, z_m])
        }))
    }

    /// The velocity that the vortices and their images make, with the cross wind of the pair, m/s.
    pub(crate) fn velocity_m_s(&self, p: [f64; 3], time_s: f64) -> [f64; 3] {
        let pair = &self.pair;
        let mut out = [0.0, pair.cross_wind_m_s, 0.0];
        for (gamma_m2_s, [y_m, z_m]) in self.vortices(p[0], time_s).into_iter().flatten() {
            for (sign, z_m) in [(1.0, z_m), (-1.0, -z_m)] {
                let (dy, dz) = (p[1] - y_m, p[2] - z_m);
                let r2 = dy * dy + dz * dz;
                if r2 > 0.0 && gamma_m2_s != 0.0 {
                    let gamma = circulation_m2_s(&pair.profile, gamma_m2_s, pair.core_m, r2.sqrt());
                    out[1] -= sign * gamma / (2.0 * PI * r2) * dz;
                    out[2] += sign * gamma / (2.0 * PI * r2) * dy;
                }
            }
        }
        out
    }
}
