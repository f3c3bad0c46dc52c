//! Fields and cross-planes of a run, read back from its files.
//!
//! Check: what a run wrote comes back, axes and values.

use crate::Error;
use crate::io::CrossPlanes;
use crate::io::netcdf_input::{TIME, X, Y, Z, open};
use crate::io::planes_input;
use std::path::Path;

/// One variable of a flow in space at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldInSpace {
    /// Time of the flow \[s\].
    pub time_s: f64,
    /// Positions along x, y, z \[m\].
    pub axis_m: [Vec<f64>; 3],
    /// Values `[z][y][x]`, in the unit of the variable.
    pub values: Vec<f64>,
}

/// A variable over (time, z, y, x) of a file that holds one time, such as `vorticity_magnitude`.
///
/// # Errors
/// A file that cannot be read, without the variable, or with other dimensions.
pub fn read_field(path: &Path, variable: &str) -> Result<FieldInSpace, Error> {
    let file = open(path)?;
    let read = || -> Result<FieldInSpace, String> {
        let dims = file.roles(variable, [TIME, Z, Y, X])?;
        let [time, z, y, x] = &dims;
        let times_s = file.coordinate(time)?;
        let [time_s] = times_s[..] else {
            return Err(format!("{} times: one is needed", times_s.len()));
        };
        let axis_m = [file.coordinate(x)?, file.coordinate(y)?, file.coordinate(z)?];
        Ok(FieldInSpace { time_s, axis_m, values: file.ordered(variable, &dims, None)? })
    };
    read().map_err(|reason| file.refuse(reason))
}

/// The cross-planes that a name stands for: a file, or all files `name_0001.nc`, ..., in their order.
///
/// # Errors
/// Neither is there; a file that cannot be read.
pub fn read_planes(name: &Path) -> Result<Vec<CrossPlanes>, Error> {
    planes_input::files(name)?.iter().map(|path| planes_input::read(path)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Begin, CaseFile, WakePreset, run};
    use super::*;
    use crate::Silent;

    #[test]
    fn fields_and_planes_of_a_run_come_back() {
        let mut case = WakePreset::Coarse.case();
        let super::super::CaseKind::Wake(wake) = &mut case.case else { panic!("a wake") };
        wake.cells = [4, 16, 12];
        if let Some(output) = &mut case.wake {
            output.end_tau = 0.02;
            output.fields_tau = Some(vec![0.02]);
            output.planes_tau = Some(vec![0.0, 0.02]);
        }
        let file = CaseFile::parse(&toml::to_string(&case).unwrap(), Path::new("case.toml")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(&file, folder.path(), Begin::New, &Silent).unwrap();
        let field = read_field(&folder.path().join("fields_0001.nc"), "vorticity_magnitude").unwrap();
        assert_eq!(field.axis_m.each_ref().map(Vec::len), [4, 16, 12]);
        assert!((field.time_s - outcome.time_s).abs() < 1e-9);
        // The core turns by Gamma0/(pi r_c^2) at its centre; three cells see part of it.
        let largest = field.values.iter().copied().fold(0.0, f64::max);
        let core_per_s = 500.0 / (std::f64::consts::PI * 4.7_f64.powi(2));
        assert!(largest > 0.05 * core_per_s && largest < 3.0 * core_per_s, "{largest} of {core_per_s}");
        let planes = read_planes(&folder.path().join("plane1")).unwrap();
        assert_eq!(planes.iter().map(|p| p.tau.len()).sum::<usize>(), 2);
        assert!(
            read_field(&folder.path().join("fields_0001.nc"), "nothing").unwrap_err().to_string().contains("nothing")
        );
        assert!(read_planes(&folder.path().join("plane7")).is_err());
    }
}
