//! Whole records: against the literal sum and closed forms, shapes of pulses, covariance of
//! windows, noise, scans, converters, extreme cases.
#![allow(clippy::unwrap_used)] // a helper of a test may panic as the test may

mod accumulated;
mod baseband;
mod covariance;
mod envelopes;
mod extremes;
mod heterodyne;
mod impairments;
mod noise;
mod power;
mod receiver_tables;
mod records;
mod scan;
mod setup;
