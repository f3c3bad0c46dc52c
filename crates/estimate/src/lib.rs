//! wakescope-estimate
