//! Efficiency eta_s (19) without random numbers: free space, independent (bistatic) paths at any strength, closed forms, and
//! one path out and back in weak turbulence; the irradiance at the target, and where the light of the mean beam goes.

mod descent;
pub(crate) mod encircled;
mod exact;
mod hankel;
pub(crate) mod overlap;
mod weak;

pub use encircled::mean_power_beyond;
pub use exact::{
    ScreenStrength, bistatic_efficiency, bistatic_efficiency_screens, bistatic_efficiency_with,
    free_space_antenna_efficiency, free_space_efficiency, free_space_efficiency_misaligned,
    untruncated_efficiency,
};
pub use hankel::free_space_efficiency_hankel;
pub use overlap::{LARGEST_FRESNEL_NUMBER, fresnel_number, quadrature_cost_s};
pub use weak::{WeakTurbulence, weak_turbulence_efficiency};
