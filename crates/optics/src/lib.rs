//! wakescope-optics
