//! How much light leaves a grid: the tails of the mean beam beyond the absorbing border,
//! from exact theory.

use crate::air::cn2::Cn2Path;
use crate::air::structure::StructureTable;
use crate::air::turbulence::coherence_radius_m;
use crate::theory::encircled::mean_power_beyond;
use crate::{Error, Misalignment, Telescope};

/// The border absorbs the light beyond this fraction of the half width: its window falls there, and
/// acts again at every step.
const BORDER: f64 = 0.85;
/// Planes along the path at which the tails are computed.
const PLANES: u32 = 6;
/// Radii at each.
const RADII: u32 = 64;

/// Power of the mean beam beyond each radius, at some planes along the path.
pub(super) struct Light {
    wavelength_m: f64,
    planes: Vec<Plane>,
}

struct Plane {
    range_m: f64,
    /// Distance of the axis of a displaced BPLO from the axis of the grid \[m\].
    displaced_m: f64,
    first_ln: f64,
    step_ln: f64,
    beyond: Vec<f64>,
}

impl Light {
    /// The tails out to `furthest_m`.
    pub(super) fn new(
        telescope: &Telescope,
        misalignment: &Misalignment,
        cn2: &Cn2Path,
        table: &StructureTable,
        furthest_m: f64,
    ) -> Result<Self, Error> {
        let lit_m = telescope
            .aperture_radius_m
            .min(3.0 * telescope.intensity_radius_m());
        let mut planes = Vec::new();
        for i in 1..=PLANES {
            let range_m = furthest_m * f64::from(i) / f64::from(PLANES);
            let shadow_m = lit_m * (1.0 - range_m * telescope.focus.curvature_per_m()).abs();
            let spread_m = 2.0 * scatter_rad(telescope, cn2, range_m)? * range_m;
            let lobe_m = range_m / (telescope.wavenumber_rad_m() * lit_m);
            // From well inside the beam to where only the 1/r tail of the edge remains.
            let first_m = 0.3 * (shadow_m + lobe_m);
            let last_m = shadow_m + 4.0 * spread_m + 150.0 * lobe_m;
            let step_ln = (last_m / first_m).ln() / f64::from(RADII - 1);
            let radius_m: Vec<f64> = (0..RADII)
                .map(|j| first_m * (step_ln * f64::from(j)).exp())
                .collect();
            planes.push(Plane {
                range_m,
                displaced_m: misalignment.separation_m(range_m),
                first_ln: first_m.ln(),
                step_ln,
                beyond: mean_power_beyond(telescope, cn2, table, range_m, &radius_m)?,
            });
        }
        Ok(Self {
            wavelength_m: telescope.wavelength_m,
            planes,
        })
    }

    /// Largest mean fraction of the light on a grid of this width and spacing that its border
    /// takes.
    pub(super) fn lost(&self, width_m: f64, spacing_m: f64) -> f64 {
        let mut worst = 0f64;
        for plane in &self.planes {
            let border_m = (0.5 * BORDER * width_m - plane.displaced_m).max(0.0);
            // Light at angles beyond the band of the grid, a square of the area of this circle, is
            // not on the grid and cannot be lost.
            let nyquist_m =
                self.wavelength_m * plane.range_m / (spacing_m * std::f64::consts::PI.sqrt());
            worst = worst.max(plane.beyond(border_m) - plane.beyond(nyquist_m));
        }
        worst
    }

    /// Width \[m\] of a grid whose border takes at most `fraction`.
    pub(super) fn width_m(&self, fraction: f64, spacing_m: f64) -> f64 {
        let mut low = 0.0;
        let mut high = spacing_m;
        while self.lost(high, spacing_m) > fraction {
            low = high;
            high *= 2.0;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.lost(middle, spacing_m) > fraction {
                low = middle
            } else {
                high = middle
            }
        }
        high
    }
}

impl Plane {
    /// Fraction of the power beyond a radius; 1/r beyond the last.
    fn beyond(&self, radius_m: f64) -> f64 {
        let last = self.beyond.len() - 1;
        let t = (radius_m.max(1e-300).ln() - self.first_ln) / self.step_ln;
        if t <= 0.0 {
            return 1.0;
        }
        if t >= last as f64 {
            return self.beyond[last] * (-(t - last as f64) * self.step_ln).exp();
        }
        let i = t as usize;
        let u = t - i as f64;
        self.beyond[i] * (1.0 - u) + self.beyond[i + 1] * u
    }
}

/// Angle into which turbulence scatters the beam \[rad\], lambda/(pi rho_0).
pub(super) fn scatter_rad(
    telescope: &Telescope,
    cn2: &Cn2Path,
    range_m: f64,
) -> Result<f64, Error> {
    let rho_0 = coherence_radius_m(cn2, telescope.wavelength_m, range_m)?;
    Ok(telescope.wavelength_m / (std::f64::consts::PI * rho_0))
}
