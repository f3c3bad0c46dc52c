//! wakescope-les
