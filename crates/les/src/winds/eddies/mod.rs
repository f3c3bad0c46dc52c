//! Turbulence as a sum of plane waves: a random velocity field whose statistics are known exactly.
//!
//! `u(x, t) = sum of Re{a_n exp i(k_n . (x - U t) - omega_n t)}` with `k_n . a_n = 0` (A6). Nothing
//! but the modes is stored; there is no mesh and no period. The modes are data ([`Mode`]):
//! [`isotropic_modes`] makes those of a spectrum. The field is carried along by one velocity `U`,
//! for that of each height would make it divergent.
//!
//! Over a ground that no air crosses each mode has its harmonic image (Hunt and Graham 1978), with
//! `kappa = |k_h|`:
//! `(i k_h/kappa, -1) a_z exp(i k_h . x - kappa z)` (A7).
//! The vertical velocity is then 0 at the ground, and the horizontal variance 1.5 times the free one.
//!
//! Check: structure functions, blocked variances and correlations in time of independent tables;
//! sums along lines against sines and cosines.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of several arrays, which the compiler makes vectors of"
)]

mod levels;
mod modes;
mod sin_cos;
mod waves;

pub use modes::{Mode, isotropic_modes};

use super::wind::{SampledLine, Wind};
use crate::error::{Error, check, check_lengths};
use levels::LineWaves;
use modes::dot;
use sin_cos::sin_cos;
use waves::Wave;

/// Points whose velocities are computed together.
const LANES: usize = 8;
/// Standard deviations of the gradient that count as its bound.
const DEVIATIONS: f64 = 6.0;

/// A field of turbulence made of modes.
#[derive(Debug, Clone, PartialEq)]
pub struct Eddies {
    modes: Vec<Mode>,
    /// Horizontal velocity (x, y) that carries the field \[m/s\].
    carried_m_s: [f64; 2],
    is_blocked: bool,
    /// Whether long waves are summed at few nodes.
    is_coarse: bool,
    max_gradient_per_s: f64,
}

impl Eddies {
    /// The field of these modes.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a mode whose amplitude is not across its wave vector, to 1e-12.
    pub fn new(modes: Vec<Mode>) -> Result<Self, Error> {
        for mode in &modes {
            mode.validated()?;
        }
        let max_gradient_per_s = DEVIATIONS * open_gradient_per_s(&modes);
        Ok(Self {
            modes,
            carried_m_s: [0.0; 2],
            is_blocked: false,
            is_coarse: true,
            max_gradient_per_s,
        })
    }

    /// The same field carried along by a horizontal velocity (x, y) \[m/s\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a velocity that is not finite.
    pub fn carried(self, carried_m_s: [f64; 2]) -> Result<Self, Error> {
        for value in carried_m_s {
            check("carried_m_s", value, "finite", |_| true)?;
        }
        Ok(Self {
            carried_m_s,
            ..self
        })
    }

    /// The same field over a ground z = 0 that no air crosses, (A7); below it the velocity is NaN.
    #[must_use]
    pub fn blocked(self) -> Self {
        let max_gradient_per_s = DEVIATIONS * blocked_gradient_per_s(&self.modes);
        Self {
            is_blocked: true,
            max_gradient_per_s,
            ..self
        }
    }

    /// The same field with all waves summed at each sample of a line: error below 1e-12. Otherwise
    /// long waves are summed at few nodes and interpolated: error some 2.4e-4 of the standard
    /// deviation.
    #[must_use]
    pub fn summed_at_each_sample(self) -> Self {
        Self {
            is_coarse: false,
            ..self
        }
    }

    /// The modes of waves longer than this \[m\] alone.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a wavelength that is not positive.
    pub fn longer_than(self, wavelength_m: f64) -> Result<Self, Error> {
        check("wavelength_m", wavelength_m, "positive", |v| v > 0.0)?;
        let largest_rad_m = std::f64::consts::TAU / wavelength_m;
        let mut modes = self.modes;
        modes.retain(|mode| {
            let k = mode.wavenumber_rad_m;
            dot(k, k) < largest_rad_m * largest_rad_m
        });
        Ok(Self { modes, ..self })
    }

    /// The modes.
    pub fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// Where the field of time 0 is sampled for a point at a time \[m\].
    fn carried_point_m(&self, point_m: [f64; 3], time_s: f64) -> [f64; 3] {
        [
            point_m[0] - self.carried_m_s[0] * time_s,
            point_m[1] - self.carried_m_s[1] * time_s,
            point_m[2],
        ]
    }

    /// Waves of the radial velocity along a line.
    fn waves(&self, line: &SampledLine, time_s: f64) -> LineWaves {
        let mut waves = LineWaves::default();
        let origin_m = self.carried_point_m(line.origin_m, time_s);
        let e = line.direction;
        for mode in &self.modes {
            let k = mode.wavenumber_rad_m;
            let turned = mode.frequency_rad_s * time_s;
            let wave = Wave {
                amplitude_m_s: [dot(e, mode.real_m_s), dot(e, mode.imaginary_m_s)],
                phase_rad: dot(k, origin_m) - turned,
                step_rad: dot(k, e) * line.step_m,
                ..Wave::default()
            };
            waves.push(wave, self.is_coarse);
            let kappa = k[0].hypot(k[1]);
            if !self.is_blocked || kappa == 0.0 {
                continue;
            }
            let horizontal = [k[0], k[1], 0.0];
            // e . (i k_h/kappa, -1) a_z
            let along = (e[0] * k[0] + e[1] * k[1]) / kappa;
            let [re, im] = [mode.real_m_s[2], mode.imaginary_m_s[2]];
            let image = Wave {
                amplitude_m_s: [-along * im - e[2] * re, along * re - e[2] * im],
                phase_rad: dot(horizontal, origin_m) - turned,
                step_rad: dot(horizontal, e) * line.step_m,
                growth: -kappa * origin_m[2],
                growth_step: -kappa * e[2] * line.step_m,
            };
            waves.push_decaying(image, self.is_coarse);
        }
        waves
    }
}

impl Wind for Eddies {
    /// Sums the modes at each point; with `time_s` the field is carried along and its modes turn.
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (points_m, out) in points_m.chunks(LANES).zip(out_m_s.chunks_mut(LANES)) {
            // Lanes without a point repeat the first.
            let mut axes = [[0.0; LANES]; 3];
            for lane in 0..LANES {
                let point_m = *points_m.get(lane).unwrap_or(&points_m[0]);
                let carried_m = self.carried_point_m(point_m, time_s);
                for d in 0..3 {
                    axes[d][lane] = carried_m[d];
                }
            }
            let mut sums = [[0.0; LANES]; 3];
            add_modes(&self.modes, time_s, &axes, &mut sums);
            if self.is_blocked {
                let mut images = [[0.0; LANES]; 3];
                add_images(&self.modes, time_s, &axes, &mut images);
                for lane in 0..LANES {
                    let below = if axes[2][lane] < 0.0 { f64::NAN } else { 0.0 };
                    for d in 0..3 {
                        sums[d][lane] += images[d][lane] + below;
                    }
                }
            }
            for (lane, out) in out.iter_mut().enumerate() {
                *out = [sums[0][lane], sums[1][lane], sums[2][lane]];
            }
        }
        Ok(())
    }

    /// Six standard deviations of the gradient, which no more than some 1e-9 of the air exceeds; the
    /// sum of the bounds of all modes would be 20 times as much. Over a blocking ground that at the
    /// ground.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        self.max_gradient_per_s
    }

    fn along_line_into(
        &self,
        line: &SampledLine,
        first: usize,
        time_s: f64,
        out_m_s: &mut [f64],
    ) -> Result<(), Error> {
        self.waves(line, time_s).sum_into(first as i64, out_m_s);
        if self.is_blocked {
            for (i, out) in out_m_s.iter_mut().enumerate() {
                if line.point_m(first + i)[2] < 0.0 {
                    *out = f64::NAN;
                }
            }
        }
        Ok(())
    }
}

/// Adds the modes at a few points, given by their coordinates x, y, z \[m\].
#[cfg_attr(
    feature = "solver",
    multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))
)]
fn add_modes(
    modes: &[Mode],
    time_s: f64,
    axes_m: &[[f64; LANES]; 3],
    sums_m_s: &mut [[f64; LANES]; 3],
) {
    for mode in modes {
        let k = mode.wavenumber_rad_m;
        let turned = mode.frequency_rad_s * time_s;
        let mut phase_rad = [0.0; LANES];
        for lane in 0..LANES {
            let horizontal = k[0] * axes_m[0][lane] + k[1] * axes_m[1][lane] - turned;
            phase_rad[lane] = horizontal + k[2] * axes_m[2][lane];
        }
        let (sine, cosine) = sin_cos(&phase_rad);
        for d in 0..3 {
            for lane in 0..LANES {
                sums_m_s[d][lane] +=
                    mode.real_m_s[d] * cosine[lane] - mode.imaginary_m_s[d] * sine[lane];
            }
        }
    }
}

/// Adds the images of the modes in a blocking ground. At the ground the sum of their vertical
/// velocities is that of the modes, negated, to the bit.
#[cfg_attr(
    feature = "solver",
    multiversion::multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))
)]
fn add_images(
    modes: &[Mode],
    time_s: f64,
    axes_m: &[[f64; LANES]; 3],
    sums_m_s: &mut [[f64; LANES]; 3],
) {
    for mode in modes {
        let k = mode.wavenumber_rad_m;
        let kappa = k[0].hypot(k[1]);
        if kappa == 0.0 {
            continue;
        }
        let turned = mode.frequency_rad_s * time_s;
        let mut phase_rad = [0.0; LANES];
        let mut size = [0.0; LANES];
        for lane in 0..LANES {
            phase_rad[lane] = k[0] * axes_m[0][lane] + k[1] * axes_m[1][lane] - turned;
            size[lane] = (-kappa * axes_m[2][lane].max(0.0)).exp();
        }
        let (sine, cosine) = sin_cos(&phase_rad);
        let [re, im] = [mode.real_m_s[2], mode.imaginary_m_s[2]];
        for lane in 0..LANES {
            let across = size[lane] * (re * sine[lane] + im * cosine[lane]);
            sums_m_s[0][lane] -= k[0] / kappa * across;
            sums_m_s[1][lane] -= k[1] / kappa * across;
            sums_m_s[2][lane] -= size[lane] * (re * cosine[lane] - im * sine[lane]);
        }
    }
}

/// Standard deviation of the gradient of the radial velocity along a line \[1/s\], averaged over
/// directions: in isotropic air `<(du/dx)^2>` is 1/15 of the sum of the squares of all gradients,
/// for a spectrum far below the outer scale `0.15 eps^(2/3) k_max^(4/3)`.
fn open_gradient_per_s(modes: &[Mode]) -> f64 {
    let mut squares = 0.0;
    for mode in modes {
        let k2 = dot(mode.wavenumber_rad_m, mode.wavenumber_rad_m);
        squares += k2 * mode.mean_square_m2_s2();
    }
    (squares / 15.0).sqrt()
}

/// The same at a blocking ground, in the steepest of 13 directions, and at least that far above it.
fn blocked_gradient_per_s(modes: &[Mode]) -> f64 {
    let mut steepest = open_gradient_per_s(modes);
    for x in [-1.0, 0.0, 1.0] {
        for y in [-1.0, 0.0, 1.0] {
            for z in [0.0, 1.0_f64] {
                let length = dot([x, y, z], [x, y, z]).sqrt();
                if length > 0.0 {
                    let e = [x, y, z].map(|part: f64| part / length);
                    steepest = steepest.max(ground_gradient_per_s(modes, e));
                }
            }
        }
    }
    steepest
}

/// Standard deviation of the gradient along a direction at a blocking ground \[1/s\].
fn ground_gradient_per_s(modes: &[Mode], e: [f64; 3]) -> f64 {
    let mut squares = 0.0;
    for mode in modes {
        let k = mode.wavenumber_rad_m;
        let kappa = k[0].hypot(k[1]);
        let along = dot(k, e);
        // i (e . k) (e . a)
        let mut gradient = [
            -along * dot(e, mode.imaginary_m_s),
            along * dot(e, mode.real_m_s),
        ];
        if kappa > 0.0 {
            // kappa (e . g)^2 a_z with g = (i k_h/kappa, -1)
            let h = (e[0] * k[0] + e[1] * k[1]) / kappa;
            let square = [e[2] * e[2] - h * h, -2.0 * h * e[2]];
            let [re, im] = [mode.real_m_s[2], mode.imaginary_m_s[2]];
            gradient[0] += kappa * (square[0] * re - square[1] * im);
            gradient[1] += kappa * (square[0] * im + square[1] * re);
        }
        squares += 0.5 * (gradient[0] * gradient[0] + gradient[1] * gradient[1]);
    }
    squares.sqrt()
}
