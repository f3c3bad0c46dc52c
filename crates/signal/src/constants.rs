//! Constants of nature, exact in the SI of 2019.

/// Speed of light in vacuum \[m/s\].
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;

/// Planck constant `h` \[J s\].
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;

/// Elementary charge `e` \[C\].
pub const ELEMENTARY_CHARGE_C: f64 = 1.602_176_634e-19;

/// Boltzmann constant `k` \[J/K\].
pub const BOLTZMANN_J_K: f64 = 1.380_649e-23;
