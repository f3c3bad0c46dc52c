//! A vortex pair that decays, descends, rebounds and drifts with the wind: the wind that it makes.
//!
//! Decay laws, lifetime and buoyancy after Sarpkaya (2000); over a ground with images and, if
//! requested, secondary vortices. The path is computed once.
//!
//! Check: the path against tables of an independent program; without decay and buoyancy the
//! velocities of the inviscid pair.

use super::pair_path::{Carrier, PairPath, Transport};
use super::vortex::{Ground, Vortex, VortexPair, largest_gradient_per_s};
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// A pair with its path.
pub struct TransportedPair {
    pair: VortexPair,
    path: PairPath,
    /// Stored times of the path, tau, and the largest gradient from each on, 1/s.
    gradient_from: Vec<(f64, f64)>,
}

impl TransportedPair {
    /// The pair from its release at time 0 until `last_tau`; `carrier` is the wind that carries
    /// each vortex, `eddies` those that move the whole pair as they move its middle, both at x = 0
    /// and at times from the release; `pair.motion` does not matter.
    ///
    /// # Errors
    /// As [`VortexPair::validate`] and [`Transport::validated`]; [`Error::OutOfRange`] for a pair
    /// without circulation; what the winds refuse.
    pub fn new(
        pair: VortexPair,
        transport: Transport,
        carrier: Option<&dyn Wind>,
        eddies: Option<&dyn Wind>,
        last_tau: f64,
    ) -> Result<Self, Error> {
        pair.validate()?;
        check("circulation_m2_s", pair.circulation_m2_s, "positive", |v| {
            v > 0.0
        })?;
        check("last_tau", last_tau, "zero or positive", |v| v >= 0.0)?;
        let at_vortex = |at, tau| reduced_velocity(&pair, carrier, at, tau);
        let at_middle = |at, tau| reduced_velocity(&pair, eddies, at, tau);
        let of_eddies: Option<Carrier<'_>> = eddies.is_some().then_some(&at_middle);
        let height = pair.height_m / pair.spacing_m;
        let has_ground = pair.ground == Ground::Image;
        let path = PairPath::new(
            transport, height, has_ground, &at_vortex, of_eddies, last_tau,
        )?;
        let mut found = Self {
            pair,
            path,
            gradient_from: Vec::new(),
        };
        let of_knot = |tau: f64| {
            let born = found.born(tau);
            (tau, largest_gradient_per_s(&found.pair, &born))
        };
        let mut gradient_from: Vec<(f64, f64)> = found.path.knots_tau().map(of_knot).collect();
        let mut largest_per_s = 0.0_f64;
        for (_, gradient_per_s) in gradient_from.iter_mut().rev() {
            largest_per_s = largest_per_s.max(*gradient_per_s);
            *gradient_per_s = largest_per_s;
        }
        found.gradient_from = gradient_from;
        Ok(found)
    }

    /// How the pair decays and descends.
    pub fn transport(&self) -> &Transport {
        self.path.transport()
    }

    /// The left and the right vortex at `time_s` since their release.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a time before the release or after the end of the path.
    pub fn primary_vortices(&self, time_s: f64) -> Result<[Vortex; 2], Error> {
        let tau = self.tau(time_s)?;
        let [left, right, ..] = self.path.vortices(tau);
        Ok([left, right].map(|vortex| self.scaled(vortex)))
    }

    /// The vortices at `time_s` since their release: left, right, and the secondary vortices that
    /// are born.
    ///
    /// # Errors
    /// As [`Self::primary_vortices`].
    pub fn vortices(&self, time_s: f64) -> Result<Vec<Vortex>, Error> {
        Ok(self.born(self.tau(time_s)?))
    }

    /// When the secondary vortices of the left and the right one are born, s since the release;
    /// infinite where none is.
    pub fn birth_s(&self) -> [f64; 2] {
        self.path.birth_tau().map(|tau| self.pair.time_s(tau))
    }

    /// The last time that the path knows, s since the release.
    pub fn last_time_s(&self) -> f64 {
        self.pair.time_s(self.path.last_tau())
    }

    fn born(&self, tau: f64) -> Vec<Vortex> {
        let vortices = self.path.vortices(tau).into_iter();
        vortices
            .filter(|(circulation, _)| *circulation != 0.0)
            .map(|vortex| self.scaled(vortex))
            .collect()
    }

    fn scaled(&self, (circulation, [y, z]): (f64, [f64; 2])) -> Vortex {
        Vortex {
            circulation_m2_s: circulation * self.pair.circulation_m2_s,
            lateral_position_m: self.pair.lateral_position_m + y * self.pair.spacing_m,
            height_m: z * self.pair.spacing_m,
        }
    }

    /// Age of a time, within the path but for round-off.
    fn tau(&self, time_s: f64) -> Result<f64, Error> {
        let tau = time_s / self.pair.time_s(1.0);
        let last_tau = self.path.last_tau();
        let slack = 1e-9 * last_tau;
        check(
            "time_s",
            time_s,
            "from the release of the pair to the end of its path",
            |_| (-slack..=last_tau + slack).contains(&tau),
        )?;
        Ok(tau.clamp(0.0, last_tau))
    }
}

/// Velocity of a wind at a reduced place and time, in reduced units; 0 without a wind.
fn reduced_velocity(
    pair: &VortexPair,
    wind: Option<&dyn Wind>,
    [y, z]: [f64; 2],
    tau: f64,
) -> Result<[f64; 2], Error> {
    let Some(wind) = wind else {
        return Ok([0.0; 2]);
    };
    let y_m = pair.lateral_position_m + y * pair.spacing_m;
    let at_m = [0.0, y_m, z * pair.spacing_m];
    let mut out_m_s = [[0.0; 3]];
    wind.velocity_into(&[at_m], pair.time_s(tau), &mut out_m_s)?;
    let scale_m_s = pair.descent_speed_m_s();
    Ok([out_m_s[0][1] / scale_m_s, out_m_s[0][2] / scale_m_s])
}

impl Wind for TransportedPair {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        let vortices = self.vortices(time_s)?;
        self.pair.sum_into(&vortices, points_m, out_m_s);
        Ok(())
    }

    /// The largest from the time on, at the times that are stored: a pair may come closer to the
    /// ground or to a secondary vortex.
    fn max_gradient_per_s(&self, time_s: f64) -> f64 {
        let tau = time_s / self.pair.time_s(1.0);
        let after = self.gradient_from.partition_point(|(from, _)| *from <= tau);
        let at = after.max(1) - 1;
        self.gradient_from[at].1
    }
}
