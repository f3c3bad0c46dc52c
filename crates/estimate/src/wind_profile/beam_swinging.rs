//! Doppler beam swinging: the wind from four slanted beams a quarter turn apart, as wind profilers take it.

use crate::error::{Error, check};

/// The wind from radial velocities \[m/s\], positive away from the lidar, of beams at azimuths 0, 90, 180 and 270 degrees and one
/// elevation \[rad\]: `(N - S)/(2 cos el)`, `(E - W)/(2 cos el)`, `(N + E + S + W)/(4 sin el)`: along the first
/// beam and along the second, horizontally, and vertically \[m/s\].
///
/// # Errors
/// [`Error::OutOfRange`] for an elevation that is not between 0 and a quarter turn.
pub fn swing(elevation_rad: f64, [north, east, south, west]: [f64; 4]) -> Result<[f64; 3], Error> {
    let (sin, cos) = elevation_rad.sin_cos();
    let slanted = elevation_rad > 0.0 && elevation_rad < std::f64::consts::FRAC_PI_2;
    check(
        "elevation_rad",
        elevation_rad,
        "between 0 and pi/2",
        slanted,
    )?;
    Ok([
        0.5 * (north - south) / cos,
        0.5 * (east - west) / cos,
        0.25 * (north + east + south + west) / sin,
    ])
}
