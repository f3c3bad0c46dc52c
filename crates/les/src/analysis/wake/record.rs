//! What a [`WakeMeter`](super::WakeMeter) finds at one instant.
//!
//! Check: scaling there and back.

/// The state of a wake at one instant. Quantities of the whole flow are per length of x.
#[derive(Debug, Clone, PartialEq)]
pub struct WakeRecord {
    /// Time \[s\].
    pub time_s: f64,
    /// The vortex that began at smaller y, of negative circulation.
    pub left: VortexRecord,
    /// The vortex that began at larger y.
    pub right: VortexRecord,
    /// Kinetic energy, half the integral of the squared speed over the cross-section \[m^4/s^2\].
    pub energy_m4_s2: f64,
    /// That of each axial mode `m = 0, 1, ...`, wavelength `L_x/m`; `m = 0` is the plane part \[m^4/s^2\].
    pub mode_energy_m4_s2: Vec<f64>,
    /// Half the integral of the squared vorticity over the cross-section, ground included \[m^2/s^2\].
    pub enstrophy_m2_s2: f64,
    /// Largest shear at the ground \[1/s\].
    pub wall_shear_per_s: f64,
    /// Height of the first centre above the ground in wall units of that shear; 0 without friction.
    pub wall_units: f64,
}

/// One vortex and the secondary vortices on its side. Missing values are NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexRecord {
    /// Centre `y`: centroid of the vorticity averaged over x, of the vortex's own sign, within 0.15 `b0` of itself \[m\].
    pub y_m: f64,
    /// Height of the centre \[m\].
    pub z_m: f64,
    /// The same centroid `(y, z)` in each cross-plane of the mesh \[m\].
    pub slices_m: Vec<[f64; 2]>,
    /// Standard deviation of their y \[m\].
    pub y_spread_m: f64,
    /// Standard deviation of their z \[m\].
    pub z_spread_m: f64,
    /// Circulation averaged over 21 radii of the window, with its sign, of the flow averaged over x \[m^2/s\].
    pub gamma_5_15_m2_s: f64,
    /// Circulation at [`WakeMeter::radii_m`](super::WakeMeter::radii_m) \[m^2/s\].
    pub gamma_m2_s: Vec<f64>,
    /// Vorticity of the other sign on this side, above 0.15 `b0`, summed \[m^2/s\].
    pub gamma_opposite_m2_s: f64,
    /// The strongest secondary vortex of this side.
    pub secondary: SecondaryRecord,
    /// Least shear of the outward velocity at the ground, averaged over x: negative where the boundary layer has separated
    /// \[1/s\].
    pub outward_shear_per_s: f64,
}

/// A secondary vortex: about the strongest vorticity of the other sign above 0.15 `b0`. NaN before there is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondaryRecord {
    /// Centroid `y` \[m\].
    pub y_m: f64,
    /// Its height \[m\].
    pub z_m: f64,
    /// Standard deviation over x of `y` \[m\].
    pub y_spread_m: f64,
    /// Standard deviation over x of `z` \[m\].
    pub z_spread_m: f64,
    /// Vorticity of its sign within 0.15 `b0` of it, summed \[m^2/s\].
    pub gamma_m2_s: f64,
}

impl SecondaryRecord {
    /// None is there.
    pub(super) const NONE: Self =
        Self { y_m: f64::NAN, z_m: f64::NAN, y_spread_m: f64::NAN, z_spread_m: f64::NAN, gamma_m2_s: f64::NAN };
}

impl WakeRecord {
    /// Energy of all that varies along x \[m^4/s^2\].
    pub fn energy_3d_m4_s2(&self) -> f64 {
        self.mode_energy_m4_s2.iter().skip(1).sum()
    }
}
