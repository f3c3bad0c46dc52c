//! Claims about whole records: shapes of pulses, covariance of windows, scans, converters, extreme cases.
#![allow(clippy::unwrap_used)] // a helper of a test may panic as the test may

mod baseband;
mod covariance;
mod envelopes;
mod extremes;
mod power;
mod scan;
mod setup;
