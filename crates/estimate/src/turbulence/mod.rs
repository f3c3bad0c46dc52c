//! Statistics of isotropic turbulence: what a field of eddies has, and what a scan of it shows.

mod bessel;
mod von_karman;

pub use bessel::bessel_k;
pub use von_karman::VonKarman;
