//! wakescope-sim
