//! How the circulation of a pair decays: lifetime, decay laws, and the final descent in stable air.
//!
//! Times are in units of `t0 = 2 pi b0^2/Gamma0`, lengths in `b0`. The turbulence of the air is
//! `eps* = (eps b0)^(1/3)/V0`, its stability `N* = N t0` with the Brunt-Vaisala frequency N.
//!
//! Check: tables of an independent program; the branches of the lifetime meet within 0.002; without
//! turbulence and stability the lifetime is 9.18.

use crate::error::{Error, check};
use std::f64::consts::{FRAC_PI_2, PI};

/// Area of the oval of air that descends with the pair, in `b0^2`.
const OVAL_AREA: f64 = 2.84;
/// Where the branches of Sarpkaya's lifetime meet.
const STRONG_TURBULENCE: f64 = 0.2535;
const WEAK_TURBULENCE: f64 = 0.0121;

/// How the circulation of each vortex falls with its age `tau`, as a ratio to its first value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DecayLaw {
    /// `exp(-slow tau - fast max(0, tau - T))` with the lifetime `T`: slow diffusion, then rapid
    /// decay.
    TwoPhase {
        /// Rate before the lifetime is over, per tau.
        slow: f64,
        /// Rate that is added after it, per tau.
        fast: f64,
    },
    /// `exp(-rate tau/T)` with `rate` = 0.45 (Sarpkaya 2000).
    Sarpkaya {
        /// Decay over one lifetime.
        rate: f64,
    },
}

impl DecayLaw {
    /// The two-phase law with the rates of the stored simulation of a wake over ground.
    pub const TWO_PHASE: Self = Self::TwoPhase {
        slow: 0.06,
        fast: 0.4,
    };
    /// The law of Sarpkaya (2000).
    pub const SARPKAYA: Self = Self::Sarpkaya { rate: 0.45 };

    /// Circulation at age `tau`, as a ratio to that at age 0, of a pair with a lifetime.
    pub fn circulation_ratio(self, tau: f64, lifetime_tau: f64) -> f64 {
        match self {
            Self::TwoPhase { slow, fast } => {
                (-slow * tau - fast * (tau - lifetime_tau).max(0.0)).exp()
            }
            Self::Sarpkaya { rate } => (-rate * tau / lifetime_tau).exp(),
        }
    }

    /// The law itself when its rates are allowed.
    pub(super) fn validated(self) -> Result<Self, Error> {
        let rates = match self {
            Self::TwoPhase { slow, fast } => [("slow", slow), ("fast", fast)],
            Self::Sarpkaya { rate } => [("rate", rate); 2],
        };
        for (field, rate) in rates {
            check(field, rate, "zero or positive", |rate| rate >= 0.0)?;
        }
        Ok(self)
    }
}

/// Lifetime \[t0\] of a pair in turbulence `eps*` (Sarpkaya 2000, J. Aircraft 37): by his three
/// branches, solved for `T` to round-off.
///
/// # Errors
/// [`Error::OutOfRange`] for a negative `eps*`.
pub fn sarpkaya_lifetime(eps_star: f64) -> Result<f64, Error> {
    check("eps_star", eps_star, "zero or positive", |v| v >= 0.0)?;
    if eps_star >= STRONG_TURBULENCE {
        return Ok((0.7475 / eps_star).powf(0.75));
    }
    if eps_star < WEAK_TURBULENCE {
        return Ok(9.18 - 180.0 * eps_star);
    }
    // eps* = T^(1/4) exp(-0.70 T) in logarithms; its right side is concave and falls beyond T = 0.36.
    let wanted = eps_star.ln();
    let mut lifetime = 9.0_f64;
    for _ in 0..NEWTON_STEPS {
        let excess = 0.25 * lifetime.ln() - 0.7 * lifetime - wanted;
        lifetime -= excess / (0.25 / lifetime - 0.7);
    }
    Ok(lifetime)
}

/// Newton steps for the lifetime: from 9 they converge to round-off.
const NEWTON_STEPS: u32 = 12;

/// Lifetime \[t0\] in turbulence `eps*` and stability `N*`: that of Sarpkaya, or
/// [`stopped_by_buoyancy_tau`] if that is sooner.
///
/// # Errors
/// [`Error::OutOfRange`] for negative numbers.
pub fn lifetime(eps_star: f64, n_star: f64) -> Result<f64, Error> {
    check("n_star", n_star, "zero or positive", |v| v >= 0.0)?;
    Ok(sarpkaya_lifetime(eps_star)?.min(stopped_by_buoyancy_tau(n_star)))
}

/// Time \[t0\] after which buoyancy alone stops a pair that does not decay,
/// `(pi/2)/sqrt(2.84/(2 pi))/N*`; infinite in neutral air.
pub fn stopped_by_buoyancy_tau(n_star: f64) -> f64 {
    FRAC_PI_2 / (buoyancy_factor().sqrt() * n_star)
}

/// `2.84/(2 pi)`, by which the buoyancy of the descending oval slows the pair.
pub(super) fn buoyancy_factor() -> f64 {
    OVAL_AREA / (2.0 * PI)
}

/// Final descent \[b0\] of a pair in stable, turbulent air by Holzaepfel (2003, J. Aircraft 40) as
/// the contrail model CoCiP has it, for comparison: `1.49/N*` above `N*` = 0.8, else
/// `7.68 (1 - 4.07 eps* + 5.67 eps*^2)(0.79 - N*) + 1.88` with `eps*` of at most 0.36.
pub fn holzaepfel_final_descent(eps_star: f64, n_star: f64) -> f64 {
    let eps_star = eps_star.min(0.36);
    if n_star > 0.8 {
        return 1.49 / n_star;
    }
    7.68 * (1.0 - 4.07 * eps_star + 5.67 * eps_star * eps_star) * (0.79 - n_star) + 1.88
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_of_the_lifetime_meet_within_0_002() {
        for at in [STRONG_TURBULENCE, WEAK_TURBULENCE] {
            let above = sarpkaya_lifetime(at).unwrap();
            let below = sarpkaya_lifetime(at * (1.0 - 1e-12)).unwrap();
            assert!((above - below).abs() < 0.002, "{above} {below}");
        }
        assert_eq!(sarpkaya_lifetime(0.0).unwrap(), 9.18);
        assert!(sarpkaya_lifetime(-0.1).is_err() && lifetime(0.1, f64::NAN).is_err());
    }

    #[test]
    fn the_two_phase_law_turns_at_the_lifetime() {
        let law = DecayLaw::TWO_PHASE;
        let rate = |tau: f64| {
            let ahead = law.circulation_ratio(tau + 1e-6, 3.0).ln();
            (law.circulation_ratio(tau, 3.0).ln() - ahead) / 1e-6
        };
        assert!((rate(2.9) - 0.06).abs() < 1e-6 && (rate(3.1) - 0.46).abs() < 1e-6);
        assert!(DecayLaw::Sarpkaya { rate: -1.0 }.validated().is_err());
    }
}
