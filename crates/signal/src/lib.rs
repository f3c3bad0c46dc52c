//! wakescope-signal
