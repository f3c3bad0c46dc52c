//! Whole velocity fields as CF NetCDF (classic): at the centres over (time, z, y, x), or each component on its own faces in
//! full precision, from which a run can start. One file for each time: `xarray.concat` or `open_mfdataset` joins them.
//! Check: the tests read the bytes back and compare axes and values.

use super::checks::same_length;
use super::edges;
use super::fields::VelocityField;
use super::netcdf::{Data, Layout, Variable, described};
use super::parts::FileParts;
use super::provenance::Provenance;
use crate::Error;
use std::ops::Range;
use wakescope_les::winds::Edges;

/// The field at the centres as a file, or what one of several ranks has of it.
///
/// # Errors
/// What [`VelocityField::check`] finds, or a result too large for one file.
pub fn cf_field_parts(field: &VelocityField, provenance: &Provenance) -> Result<FileParts, Error> {
    field.check()?;
    let [u, v, w] = &field.velocity_m_s;
    let mut values = vec![
        ("time", Data::f64([field.time_s])),
        ("z", Data::f64_slice(&field.z_m)),
        ("y", Data::f64_slice(&field.y_m)),
        ("x", Data::f64_slice(&field.x_m)),
        ("u", Data::filled(u)),
        ("v", Data::filled(v)),
        ("w", Data::filled(w)),
        ("pressure_m2_s2", Data::filled(&field.pressure_m2_s2)),
    ];
    if let Some(vorticity) = &field.vorticity_per_s {
        values.push(("vorticity_magnitude", Data::filled(vorticity)));
    }
    // By which readers close a period of cells that are not equal.
    for (name, period_m) in ["x:edges", "y:edges"].into_iter().zip(field.period_m) {
        if let Some(period_m) = period_m {
            let text = edges::to_text(Edges::Periodic { period_m });
            values.push((name, Data::text(text)));
        }
    }
    let dims = vec![
        ("time", 1),
        ("z", field.z_m.len()),
        ("y", field.y_m.len()),
        ("x", field.x_m.len()),
    ];
    let variables = shared(
        described(include_str!("cf_fields.cdl"), values),
        field.first(),
    );
    Layout::cf(&field.title, dims, variables, provenance)
        .into_parts(provenance, field.planes.start == 0)
}

/// Velocity components at the low faces of the cells.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceVelocities {
    /// Title of the file.
    pub title: String,
    /// Time, s.
    pub time_s: f64,
    /// Centres of the cells along x, y, z, m.
    pub centre_m: [Vec<f64>; 3],
    /// Their low faces along x, y, z, m.
    pub face_m: [Vec<f64>; 3],
    /// Velocities u, v, w, each `[z][y][x]`, m/s.
    pub velocity_m_s: [Vec<f64>; 3],
    /// The planes across z whose values these are; the rank that has the first one writes what belongs to no plane, too.
    pub planes: Range<usize>,
}

/// The components on their own faces as a file, or what one of several ranks has of it.
///
/// # Errors
/// An array of another length than its axes, or a result too large for one file.
pub fn cf_faces_parts(faces: &FaceVelocities, provenance: &Provenance) -> Result<FileParts, Error> {
    let mut dims = Vec::new();
    let mut values = vec![("time", Data::f64([faces.time_s]))];
    for (d, (name, face)) in [("x", "x_face"), ("y", "y_face"), ("z", "z_face")]
        .into_iter()
        .enumerate()
    {
        same_length(face, faces.face_m[d].len(), name, faces.centre_m[d].len())?;
        for (name, places_m) in [(name, &faces.centre_m[d]), (face, &faces.face_m[d])] {
            dims.push((name, places_m.len()));
            values.push((name, Data::f64(places_m.iter().copied())));
        }
    }
    let plane = faces.centre_m[0].len() * faces.centre_m[1].len();
    for (name, velocity_m_s) in ["u", "v", "w"].into_iter().zip(&faces.velocity_m_s) {
        same_length(
            name,
            velocity_m_s.len(),
            "z x y x x",
            faces.planes.len() * plane,
        )?;
        values.push((name, Data::f64(velocity_m_s.iter().copied())));
    }
    let variables = shared(
        described(include_str!("cf_faces.cdl"), values),
        faces.planes.start * plane,
    );
    Layout::cf(&faces.title, dims, variables, provenance)
        .into_parts(provenance, faces.planes.start == 0)
}

/// The variables of which ranks have the values from number `first` on: those over the planes across z.
fn shared(mut variables: Vec<Variable>, first: usize) -> Vec<Variable> {
    for variable in &mut variables {
        if variable.dims.len() > 2 {
            variable.first = Some(first);
        }
    }
    variables
}

#[cfg(test)]
mod tests {
    use super::super::fields;
    use super::super::provenance::example;
    use super::*;
    use netcdf3::FileReader;

    fn open(file: FileParts) -> (tempfile::TempDir, FileReader) {
        let temp = tempfile::tempdir().unwrap();
        let path = temp.path().join("field.nc");
        std::fs::write(&path, file.into_bytes()).unwrap();
        let file = FileReader::open(&path).unwrap();
        (temp, file)
    }

    #[test]
    fn a_field_at_the_centres_reads_back() {
        let field = fields::example();
        let (_temp, mut file) = open(cf_field_parts(&field, &example()).unwrap());
        assert_eq!(file.read_var_f64("x").unwrap(), field.x_m);
        assert_eq!(file.read_var_f64("z").unwrap(), field.z_m);
        assert_eq!(file.read_var_f64("time").unwrap(), [2.5]);
        assert_eq!(
            file.data_set()
                .get_var_attr_as_string("y", "edges")
                .unwrap(),
            "periodic 3.25"
        );
        assert_eq!(file.data_set().get_var_attr_as_string("x", "edges"), None);
        assert_eq!(
            file.data_set().get_var("w").unwrap().dim_names(),
            ["time", "z", "y", "x"]
        );
        let expected: Vec<f32> = field.velocity_m_s[2].iter().map(|v| *v as f32).collect();
        assert_eq!(file.read_var_f32("w").unwrap(), expected);
        assert_eq!(
            file.data_set().get_global_attr_as_string("scene").unwrap(),
            example().scene_toml
        );
    }

    #[test]
    fn what_ranks_have_of_a_field_is_the_file_of_one() {
        let mut parts = fields::example_on_ranks()
            .into_iter()
            .map(|field| cf_field_parts(&field, &example()).unwrap());
        let mut file = parts.next().unwrap();
        parts.for_each(|other| file.parts.extend(other.parts));
        assert_eq!(
            file.into_bytes(),
            cf_field_parts(&fields::example(), &example())
                .unwrap()
                .into_bytes()
        );
    }

    #[test]
    fn components_on_their_faces_read_back_in_full_precision() {
        let field = fields::example();
        let centre_m = [field.x_m.clone(), field.y_m.clone(), field.z_m.clone()];
        let face_m = centre_m
            .clone()
            .map(|axis| axis.iter().map(|a| a - 0.05).collect::<Vec<f64>>());
        let mut velocity_m_s = field.velocity_m_s.clone();
        velocity_m_s[0][5] = 1.0 / 3.0;
        let faces = FaceVelocities {
            title: "A".into(),
            time_s: 2.5,
            centre_m,
            face_m,
            velocity_m_s,
            planes: 0..4,
        };
        let (_temp, mut file) = open(cf_faces_parts(&faces, &example()).unwrap());
        assert_eq!(
            file.data_set().get_var("v").unwrap().dim_names(),
            ["z", "y_face", "x"]
        );
        assert_eq!(file.read_var_f64("u").unwrap(), faces.velocity_m_s[0]);
        assert_eq!(file.read_var_f64("y_face").unwrap(), faces.face_m[1]);
        let mut short = faces;
        short.velocity_m_s[2].pop();
        assert!(cf_faces_parts(&short, &example()).is_err());
    }
}
