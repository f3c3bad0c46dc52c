//! Efficiency eta_s (19) without random numbers: free space, independent (bistatic) paths at any
//! strength, closed forms; where the light of the mean beam goes.

mod descent;
pub(crate) mod encircled;
mod exact;
pub(crate) mod overlap;

pub use encircled::mean_power_beyond;
pub use exact::{
    ScreenStrength, bistatic_efficiency, bistatic_efficiency_screens, bistatic_efficiency_with,
    free_space_efficiency, free_space_efficiency_misaligned, untruncated_efficiency,
};
pub use overlap::{LARGEST_FRESNEL_NUMBER, fresnel_number, quadrature_cost_s};
