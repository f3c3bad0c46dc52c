//! Place and date of a measurement, as a scene states them and files carry them.

use super::utc::UtcTime;
use crate::keys::{Is, keys};

keys! {
    /// Position of the lidar and start time of the flow; only written to the files.
    table Site {
        /// Name of the place.
        name: String = "simulated runway".into() => Is(
            |name: &String| name.chars().count() <= 80 && !name.chars().any(char::is_control),
            "one line of at most 80 characters",
        ),
        /// Latitude, degrees north.
        latitude_deg: f64 = 0.0 => -90.0..=90.0,
        /// Longitude, degrees east.
        longitude_deg: f64 = 0.0 => -180.0..=180.0,
        /// Height of the ground above the sea, m.
        altitude_m: f64 = 0.0 => -1e3..=1e4,
        /// Date of the start of the flow, UTC.
        start_utc: String = "2024-01-01T00:00:00Z".into() => Is(
            |date: &String| UtcTime::parse(date).is_some(),
            format!("a date from 1900 to 2199 like \"{}\"", UtcTime::FORM),
        ),
    }
}
