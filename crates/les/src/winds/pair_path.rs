//! Path of a pair that decays and moves: point vortices with their images below the ground, their
//! secondary vortices, buoyancy, a wind that carries each vortex at its own place, and eddies that
//! carry all of them as they move the middle of the pair.
//!
//! All in units of `b0`, `V0` and `t0 = b0/V0`; y from the middle of the pair. Runge-Kutta steps of
//! fourth order with `t0/500`; between the stored times a cubic with the velocities at its ends.
//!
//! Check: tables of an independent program, with and without ground, secondary vortices and wind.

use super::decay::{DecayLaw, buoyancy_factor};
use crate::error::{Error, check};
use std::cell::Cell;

/// Steps of a unit of time, and how many of them lie between two stored times.
const STEPS_PER_TAU: f64 = 500.0;
const STEPS_PER_KNOT: usize = 10;
/// Added to squared distances between point vortices over a ground, `b0^2`.
const SMOOTHING: f64 = 1e-4;
/// Secondary vortices, fitted to a stored simulation at a Reynolds number of 5000 (own choice):
/// height of a vortex at which its secondary vortex is born, where that is, and its circulation
/// `-0.966 (1 - exp(-s/0.173)) exp(-s/1.305)` at `s` after birth.
const BIRTH_HEIGHT: f64 = 0.54;
const BIRTH_FARTHER_OUT: f64 = 1.137;
const BIRTH_OWN_HEIGHT: f64 = 0.179;
const SECONDARY_CIRCULATION: f64 = 0.966;
const SECONDARY_RISE: f64 = 0.173;
const SECONDARY_DECAY: f64 = 1.305;
/// After this time from the birth of its secondary vortex a vortex decays rapidly, at this rate.
const LIFETIME_AFTER_BIRTH: f64 = 1.5;
const FAST_AFTER_BIRTH: f64 = 0.2;
/// Halvings of a step to find a birth: to round-off.
const HALVINGS: u32 = 50;

/// Positions (y, z) of the left and right vortex and of their secondary vortices, the descent, and
/// the factor by which buoyancy slows it.
type State = [f64; 10];
const DESCENT: usize = 8;
const SLOWING: usize = 9;

/// The vortices of a pair, left and right, and their secondary ones.
const VORTICES: usize = 4;
const OUTWARD: [f64; 2] = [-1.0, 1.0];

/// How a pair decays and descends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transport {
    /// How the circulation falls.
    pub law: DecayLaw,
    /// Lifetime `T`, in `t0`.
    pub lifetime_tau: f64,
    /// Stability `N* = N t0`; 0 for neutral air.
    pub n_star: f64,
    /// Whether secondary vortices of the ground let the pair rebound. The two-phase law then ends
    /// its slow phase 1.5 after their birth if that is sooner, with a fast rate of 0.2.
    pub rebound: bool,
}

impl Transport {
    /// The same, checked.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the first field that is not allowed.
    pub fn validated(self) -> Result<Self, Error> {
        self.law.validated()?;
        check("lifetime_tau", self.lifetime_tau, "positive", |v| v > 0.0)?;
        check("n_star", self.n_star, "zero or positive", |v| v >= 0.0)?;
        Ok(self)
    }

    /// Circulation at age `tau`, as a ratio to the first, of a vortex whose secondary one is born
    /// at `birth_tau`; infinite without one.
    fn circulation_ratio(&self, tau: f64, birth_tau: f64) -> f64 {
        let after_birth = birth_tau + LIFETIME_AFTER_BIRTH;
        match self.law {
            DecayLaw::TwoPhase { slow, .. } if after_birth < self.lifetime_tau => {
                let fast = FAST_AFTER_BIRTH;
                DecayLaw::TwoPhase { slow, fast }.circulation_ratio(tau, after_birth)
            }
            law => law.circulation_ratio(tau, self.lifetime_tau),
        }
    }
}

/// Velocity of a wind at (y, z) at a time, in reduced units.
pub(super) type Carrier<'a> = &'a dyn Fn([f64; 2], f64) -> Result<[f64; 2], Error>;

/// A stored time of a path: positions and velocities.
struct Knot {
    tau: f64,
    position: [[f64; 2]; VORTICES],
    velocity: [[f64; 2]; VORTICES],
}

/// Where the vortices are at each age, and how strong.
pub(super) struct PairPath {
    transport: Transport,
    knots: Vec<Knot>,
    /// Births of the secondary vortices of the left and the right vortex; infinite if there is none.
    birth_tau: [f64; 2],
}

/// A vortex in reduced units: its circulation, anticlockwise positive, and its place.
pub(super) type ReducedVortex = (f64, [f64; 2]);

impl PairPath {
    /// The path of a pair released at `height` over a ground, or without one, until `last_tau`;
    /// eddies move all vortices as they move the middle of the pair.
    ///
    /// # Errors
    /// As [`Transport::validated`]; what wind and eddies refuse.
    pub(super) fn new(
        transport: Transport,
        height: f64,
        has_ground: bool,
        carrier: Carrier<'_>,
        eddies: Option<Carrier<'_>>,
        last_tau: f64,
    ) -> Result<Self, Error> {
        let transport = transport.validated()?;
        let mut integration = Integration {
            transport,
            has_ground,
            carrier,
            eddies,
            last_eddies: Cell::new((f64::NAN, [0.0; 2])),
            birth_tau: [f64::INFINITY; 2],
            tau: 0.0,
            state: [-0.5, height, 0.5, height, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        };
        integration.give_birth();
        let mut knots = vec![integration.knot()?];
        let steps = (last_tau * STEPS_PER_TAU).ceil().max(1.0) as usize;
        for step in 1..=steps {
            let end_tau = step as f64 / STEPS_PER_TAU;
            while integration.advance(end_tau)? {
                knots.push(integration.knot()?);
            }
            if step.is_multiple_of(STEPS_PER_KNOT) || step == steps {
                knots.push(integration.knot()?);
            }
        }
        Ok(Self {
            transport,
            knots,
            birth_tau: integration.birth_tau,
        })
    }

    pub(super) fn transport(&self) -> &Transport {
        &self.transport
    }

    /// Stored times.
    pub(super) fn knots_tau(&self) -> impl Iterator<Item = f64> + '_ {
        self.knots.iter().map(|knot| knot.tau)
    }

    /// The last stored time.
    pub(super) fn last_tau(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.tau)
    }

    /// Births of the secondary vortices of the left and right vortex; infinite if there is none.
    pub(super) fn birth_tau(&self) -> [f64; 2] {
        self.birth_tau
    }

    /// The left and right vortex and their secondary ones at an age from 0 to the last stored time;
    /// one that is not born has no circulation.
    pub(super) fn vortices(&self, tau: f64) -> [ReducedVortex; VORTICES] {
        let last = self.knots.len() - 1;
        // At the time of a birth the later of two equal knots has the newborn.
        let at = self.knots.partition_point(|knot| knot.tau <= tau);
        let after = at.clamp(1, last);
        let a = &self.knots[after - 1];
        let b = &self.knots[after];
        let circulation = circulations(&self.transport, &self.birth_tau, tau);
        std::array::from_fn(|i| (circulation[i], between(a, b, i, tau)))
    }
}

/// Position of vortex `i` between two knots: the cubic with their positions and velocities.
fn between(a: &Knot, b: &Knot, i: usize, tau: f64) -> [f64; 2] {
    let step = b.tau - a.tau;
    if step == 0.0 {
        return b.position[i];
    }
    let s = (tau - a.tau) / step;
    let rest = 1.0 - s;
    std::array::from_fn(|c| {
        let ends = a.position[i][c] * (1.0 + 2.0 * s) * rest * rest
            + b.position[i][c] * (3.0 - 2.0 * s) * s * s;
        let slopes = a.velocity[i][c] * s * rest * rest - b.velocity[i][c] * s * s * rest;
        ends + step * slopes
    })
}

/// Circulations of the vortices at a time, anticlockwise positive; 0 for those not born.
fn circulations(transport: &Transport, birth_tau: &[f64; 2], tau: f64) -> [f64; VORTICES] {
    let mut out = [0.0; VORTICES];
    for side in 0..2 {
        out[side] = OUTWARD[side] * transport.circulation_ratio(tau, birth_tau[side]);
        let since = tau - birth_tau[side];
        if since > 0.0 {
            let growth = -(-since / SECONDARY_RISE).exp_m1();
            let strength = SECONDARY_CIRCULATION * growth * (-since / SECONDARY_DECAY).exp();
            out[2 + side] = -OUTWARD[side] * strength;
        }
    }
    out
}

/// The middle between the left and the right vortex.
fn middle(state: &State) -> [f64; 2] {
    [0.5 * (state[0] + state[2]), 0.5 * (state[1] + state[3])]
}

/// The path while it is found.
struct Integration<'a> {
    transport: Transport,
    has_ground: bool,
    carrier: Carrier<'a>,
    eddies: Option<Carrier<'a>>,
    /// Time and velocity of the last evaluation of the eddies.
    last_eddies: Cell<(f64, [f64; 2])>,
    birth_tau: [f64; 2],
    tau: f64,
    state: State,
}

impl Integration<'_> {
    fn knot(&self) -> Result<Knot, Error> {
        let pairs = |values: &State| std::array::from_fn(|i| [values[2 * i], values[2 * i + 1]]);
        Ok(Knot {
            tau: self.tau,
            position: pairs(&self.state),
            velocity: pairs(&self.rate(self.tau, &self.state)?),
        })
    }

    /// Goes on to `end_tau`, or to a birth before it; whether there was one.
    fn advance(&mut self, end_tau: f64) -> Result<bool, Error> {
        let step = end_tau - self.tau;
        let end = self.stepped(step)?;
        let sinks = |state: &State| {
            (0..2).any(|side| self.is_unborn(side) && state[2 * side + 1] <= BIRTH_HEIGHT)
        };
        if !sinks(&end) {
            self.tau = end_tau;
            self.state = end;
            return Ok(false);
        }
        let mut above = 0.0;
        let mut below = step;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (above + below);
            if sinks(&self.stepped(middle)?) {
                below = middle;
            } else {
                above = middle;
            }
        }
        self.state = self.stepped(below)?;
        self.tau += below;
        self.give_birth();
        Ok(true)
    }

    fn is_unborn(&self, side: usize) -> bool {
        self.transport.rebound && self.has_ground && self.birth_tau[side].is_infinite()
    }

    /// Lets the secondary vortices be born of vortices that are low enough.
    fn give_birth(&mut self) {
        // Vortices at one height may differ in the last bits.
        let low_enough = BIRTH_HEIGHT + 1e-9;
        for (side, outward) in OUTWARD.into_iter().enumerate() {
            if self.is_unborn(side) && self.state[2 * side + 1] <= low_enough {
                self.birth_tau[side] = self.tau;
                let lateral = self.state[2 * side] + outward * BIRTH_FARTHER_OUT;
                self.state[4 + 2 * side] = lateral;
                self.state[5 + 2 * side] = BIRTH_OWN_HEIGHT;
            }
        }
    }

    /// The state after a step of Runge and Kutta.
    fn stepped(&self, step: f64) -> Result<State, Error> {
        let moved = |rate: &State, by: f64| -> State {
            std::array::from_fn(|i| self.state[i] + by * rate[i])
        };
        let middle_tau = self.tau + 0.5 * step;
        let first = self.rate(self.tau, &self.state)?;
        let second = self.rate(middle_tau, &moved(&first, 0.5 * step))?;
        let third = self.rate(middle_tau, &moved(&second, 0.5 * step))?;
        let fourth = self.rate(self.tau + step, &moved(&third, step))?;
        let mut out: State = std::array::from_fn(|i| {
            let inner = 2.0 * (second[i] + third[i]);
            self.state[i] + step / 6.0 * (first[i] + inner + fourth[i])
        });
        out[SLOWING] = out[SLOWING].max(0.0);
        Ok(out)
    }

    /// How the state changes.
    fn rate(&self, tau: f64, state: &State) -> Result<State, Error> {
        let circulation = circulations(&self.transport, &self.birth_tau, tau);
        let slowing = state[SLOWING].max(0.0);
        let of_eddies = self.of_eddies(tau, state)?;
        let mut out = [0.0; 10];
        for own in 0..VORTICES {
            // Places before birth are none.
            if own >= 2 && self.birth_tau[own - 2] > tau {
                continue;
            }
            let at = [state[2 * own], state[2 * own + 1]];
            let mut velocity = [0.0; 2];
            for other in 0..VORTICES {
                if circulation[other] == 0.0 {
                    continue;
                }
                let place = [state[2 * other], state[2 * other + 1]];
                let added = self.induced(circulation[other], place, at, own == other);
                // Buoyancy acts on the descent of the pair alone.
                let is_pair = own < 2 && other < 2;
                velocity[0] += added[0];
                velocity[1] += if is_pair {
                    slowing * added[1]
                } else {
                    added[1]
                };
            }
            if own < 2 {
                out[DESCENT] -= 0.5 * velocity[1];
            }
            let wind = (self.carrier)(at, tau)?;
            out[2 * own] = velocity[0] + wind[0] + of_eddies[0];
            out[2 * own + 1] = velocity[1] + wind[1] + of_eddies[1];
        }
        if slowing > 0.0 {
            let ratio = 0.5 * (circulation[1] - circulation[0]);
            let stiffness = buoyancy_factor() * self.transport.n_star * self.transport.n_star;
            out[SLOWING] = -stiffness * state[DESCENT] / ratio;
        }
        Ok(out)
    }

    /// Velocity of the eddies at the middle of the pair. Stages of one time share it: their places
    /// differ by less than a thousandth of the shortest of the long waves.
    fn of_eddies(&self, tau: f64, state: &State) -> Result<[f64; 2], Error> {
        let Some(eddies) = self.eddies else {
            return Ok([0.0; 2]);
        };
        let (last_tau, last) = self.last_eddies.get();
        if last_tau == tau {
            return Ok(last);
        }
        let velocity = eddies(middle(state), tau)?;
        self.last_eddies.set((tau, velocity));
        Ok(velocity)
    }

    /// Velocity that a vortex and its image have at a place; the image alone at the vortex itself.
    fn induced(&self, circulation: f64, place: [f64; 2], at: [f64; 2], is_own: bool) -> [f64; 2] {
        let dy = at[0] - place[0];
        let dz = at[1] - place[1];
        let smoothing = if self.has_ground { SMOOTHING } else { 0.0 };
        let mut out = [0.0; 2];
        if !is_own {
            let strength = circulation / (dy * dy + dz * dz + smoothing);
            out = [-strength * dz, strength * dy];
        }
        if self.has_ground {
            let above = at[1] + place[1];
            let strength = -circulation / (dy * dy + above * above + smoothing);
            out[0] -= strength * above;
            out[1] += strength * dy;
        }
        out
    }
}
