//! Writes one small file of each format, with the table that the conformance check compares it with, into a folder:
//!
//! `cargo run -p wakescope-sim --example sample_files -- FOLDER`
//!
//! The content is a made-up vortex pair seen by a noiseless lidar; it exercises two sweeps, missing values and a stretched mesh.

#[path = "sample_data/mod.rs"]
mod sample_data;

use sample_data::{map, origin, planes};
use std::path::Path;
use wakescope_sim::Error;
use wakescope_sim::io::tables::{map_table, planes_table};
use wakescope_sim::io::{FileGroup, Table, VelocityMap};

fn main() -> Result<(), Error> {
    let folder = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "target/sample-files".into());
    let origin = origin();
    let mut files = FileGroup::new(Path::new(&folder));
    let both = map(&[2.5, 5.0], true);
    files.add("map.csv", map_table(&both)?.to_csv(&origin)?)?;
    let one = map(&[2.5], false);
    files.add("one.csv", halo_table(&one)?.to_csv(&origin)?)?;
    files.add(
        "one.hpl",
        wakescope_sim::io::hpl::hpl_bytes(&one, 0, "one.hpl")?,
    )?;
    let wind = planes();
    files.add("planes.csv", planes_table(&wind)?.to_csv(&origin)?)?;
    {
        use wakescope_sim::io::{cf_planes::cf_planes_bytes, cfradial::cfradial_bytes};
        files.add("map.nc", cfradial_bytes(&both, &origin)?)?;
        files.add("planes.nc", cf_planes_bytes(&wind, &origin)?)?;
        let mut exact = map(&[2.5], true);
        exact.fields.retain(|f| f.name.starts_with("v_"));
        files.add("exact.nc", cfradial_bytes(&exact, &origin)?)?;
        files.add("exact.csv", map_table(&exact)?.to_csv(&origin)?)?;
    }
    files.commit()?;
    Ok(())
}

/// What an `.hpl` file holds: velocity and signal-to-noise ratio of one sweep.
fn halo_table(map: &VelocityMap) -> Result<Table, Error> {
    let mut map = map.clone();
    map.fields
        .retain(|f| ["radial_velocity", "signal_to_noise_ratio"].contains(&f.name.as_str()));
    map_table(&map)
}
