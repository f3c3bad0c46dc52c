//! Cross-planes of the wind on a stretched mesh as CF NetCDF (classic): fields over (tau, z, y) with exact cell centres.
//! Opens in xarray (netCDF4 and scipy engines): `ds.v.sel(tau=2.5).interp(y=..., z=...)`.
//! Check: the tests read the bytes back and compare axes, values and the missing one.

use super::edges;
use super::error::OutputResult;
use super::map::CrossPlanes;
use super::netcdf::{Data, FILL, Layout, Variable};
use super::provenance::Provenance;
use ndarray::Array3;

/// The file's bytes.
///
/// # Errors
/// What [`CrossPlanes::check`] finds, or a result too large for one file.
pub fn cf_planes_bytes(planes: &CrossPlanes, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    planes.check()?;
    let axis = |name: &str, dims: &[&'static str], values: &[f64], names: [&str; 3]| {
        Variable::new(name, dims, Data::f64(values.iter().copied())).named(names)
    };
    let across = "horizontal position of the cell centre across the flight direction";
    let variables = vec![
        axis("tau", &["tau"], &planes.tau, ["", "age of the wake, t Gamma0 / (2 pi b0^2)", "1"]),
        axis("z", &["z"], &planes.z_m, ["height", "height of the cell centre above the ground", "m"])
            .text("positive", "up")
            .text("edges", &edges::to_text(planes.z_edges))
            .text("axis", "Z"),
        axis("y", &["y"], &planes.y_m, ["", across, "m"])
            .text("edges", &edges::to_text(planes.y_edges))
            .text("axis", "Y"),
        // Not "seconds since": the run has no date.
        axis("time", &["tau"], &planes.time_s, ["", "time since the start of the flow", "s"]),
        wind("v", &planes.v_m_s, "horizontal wind across the flight direction").text("standard_name", "y_wind"),
        wind("w", &planes.w_m_s, "vertical wind").text("standard_name", "upward_air_velocity"),
    ];
    let dims = vec![("tau", planes.tau.len()), ("z", planes.z_m.len()), ("y", planes.y_m.len())];
    Layout::cf(&planes.title, dims, variables, provenance).into_bytes(provenance)
}

fn wind(name: &str, values: &Array3<f64>, long_name: &str) -> Variable {
    Variable::new(name, &["tau", "z", "y"], Data::filled(values))
        .named(["", long_name, "m s-1"])
        .text("coordinates", "time")
        .attr("_FillValue", Data::f32([FILL]))
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::super::samples;
    use super::*;
    use netcdf3::FileReader;

    #[test]
    fn axes_and_fields_read_back() {
        let planes = samples::planes();
        let temp = tempfile::tempdir().unwrap();
        let path = temp.path().join("planes.nc");
        std::fs::write(&path, cf_planes_bytes(&planes, &example()).unwrap()).unwrap();
        let mut file = FileReader::open(&path).unwrap();
        assert_eq!(file.read_var_f64("y").unwrap(), planes.y_m, "exact nodes");
        assert_eq!(file.read_var_f64("z").unwrap(), planes.z_m);
        assert_eq!(file.read_var_f64("time").unwrap(), planes.time_s);
        let dims: Vec<String> = file.data_set().get_var("w").unwrap().dim_names();
        assert_eq!(dims, ["tau", "z", "y"]);
        let w = file.read_var_f32("w").unwrap();
        let expected: Vec<f32> = planes.w_m_s.iter().map(|v| *v as f32).collect();
        assert_eq!(w, expected);
        assert_eq!(file.read_var_f32("v").unwrap()[0], FILL, "NaN is stored as the fill value");
        let set = file.data_set();
        assert_eq!(set.get_global_attr_as_string("seed").unwrap(), u64::MAX.to_string());
        assert_eq!(set.get_global_attr_as_string("scene").unwrap(), example().scene_toml);
        assert_eq!(set.get_var_attr_f32("v", "_FillValue").unwrap(), [FILL]);
    }

    #[test]
    fn a_plane_of_another_shape_is_refused() {
        let mut planes = samples::planes();
        planes.w_m_s = Array3::zeros((2, 5, 4));
        assert!(cf_planes_bytes(&planes, &example()).is_err());
    }
}
