//! The air between telescope and target: spectrum of its refractive index (17), Cn2 along the path,
//! structure function of the phase, and how strong a path is.

pub(crate) mod cn2;
pub(crate) mod spectrum;
pub(crate) mod structure;
pub(crate) mod turbulence;

pub use cn2::{Cn2Path, hufnagel_valley_m_m23};
pub use spectrum::{CHAPTER_CONSTANT, EXACT_CONSTANT, HillAndrews, Spectrum, VonKarman};
pub use structure::{StructureTable, structure_function_m53};
pub use turbulence::{Turbulence, coherence_radius_m, path_rytov_variance, rytov_variance};
