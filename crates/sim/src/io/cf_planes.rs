//! Cross-planes of the wind on a stretched mesh as CF NetCDF (classic): fields over (tau, z, y) with exact cell centres.
//! Opens in xarray (netCDF4 and scipy engines): `ds.v.sel(tau=2.5).interp(y=..., z=...)`.
//! Check: the tests read the bytes back and compare axes, values and the missing one.

use super::edges;
use super::map::CrossPlanes;
use super::netcdf::{Data, Layout, described};
use super::provenance::Provenance;
use crate::Error;

/// The file's bytes.
///
/// # Errors
/// What [`CrossPlanes::check`] finds, or a result too large for one file.
pub fn cf_planes_bytes(planes: &CrossPlanes, provenance: &Provenance) -> Result<Vec<u8>, Error> {
    planes.check()?;
    let values = [
        ("tau", Data::f64_slice(&planes.tau)),
        ("z", Data::f64_slice(&planes.z_m)),
        ("z:edges", Data::text(edges::to_text(planes.z_edges))),
        ("y", Data::f64_slice(&planes.y_m)),
        ("y:edges", Data::text(edges::to_text(planes.y_edges))),
        ("time", Data::f64_slice(&planes.time_s)),
        ("v", Data::filled(&planes.v_m_s)),
        ("w", Data::filled(&planes.w_m_s)),
    ];
    let variables = described(include_str!("cf_planes.cdl"), values);
    let dims = vec![
        ("tau", planes.tau.len()),
        ("z", planes.z_m.len()),
        ("y", planes.y_m.len()),
    ];
    Layout::cf(&planes.title, dims, variables, provenance).into_bytes(provenance)
}

#[cfg(test)]
mod tests {
    use super::super::netcdf::FILL;
    use super::super::provenance::example;
    use super::super::samples;
    use super::*;
    use ndarray::Array3;
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
        assert_eq!(
            file.read_var_f32("v").unwrap()[0],
            FILL,
            "NaN is stored as the fill value"
        );
        let set = file.data_set();
        assert_eq!(
            set.get_global_attr_as_string("seed").unwrap(),
            u64::MAX.to_string()
        );
        assert_eq!(
            set.get_global_attr_as_string("scene").unwrap(),
            example().scene_toml
        );
        assert_eq!(set.get_var_attr_f32("v", "_FillValue").unwrap(), [FILL]);
    }

    #[test]
    fn a_plane_of_another_shape_is_refused() {
        let mut planes = samples::planes();
        planes.w_m_s = Array3::zeros((2, 5, 4));
        assert!(cf_planes_bytes(&planes, &example()).is_err());
    }
}
