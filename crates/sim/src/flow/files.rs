//! What a run writes at its output times: whole fields, planes, initial fields, collections.

use super::Begin;
use super::case::{FileFormat, Output};
use super::wake::{self, Due};
use crate::Error;
use crate::io::own::refuse_foreign;
use crate::io::{CrossPlanes, Existing, FileGroup, Provenance, VelocityField, tables};
use ndarray::Array3;
use std::path::{Path, PathBuf};
use wakescope_les::Flow;

/// The case with every default.
pub(super) const CASE: &str = "case.toml";
/// The table of the steps.
const STEPS: &str = "steps.csv";

fn numbered(stem: &str, index: usize, extension: &str) -> String {
    format!("{stem}_{:04}.{extension}", index + 1)
}

/// The plan of the files.
#[derive(Debug)]
pub(super) struct Files {
    pub(super) folder: PathBuf,
    pub(super) output: Output,
    pub(super) origin: Provenance,
    /// Times of the fields, and of the planes \[s\].
    #[cfg(feature = "vtk")]
    pub(super) times_s: [Vec<f64>; 2],
    /// Whether fields have the vorticity, too.
    pub(super) with_vorticity: bool,
    /// Age of the wake per time \[1/s\].
    pub(super) tau_per_s: f64,
    pub(super) title: String,
}

impl Files {
    /// Names of all files of a run, but for its checkpoints.
    pub(super) fn names(&self, due: &[Due], is_wake: bool) -> Vec<String> {
        let mut out = vec![CASE.to_owned()];
        out.extend(self.output.steps.then(|| STEPS.to_owned()));
        if is_wake {
            out.extend(wake::file_names().into_iter().map(str::to_owned));
            #[cfg(feature = "plots")]
            out.extend(wake::PICTURES.map(str::to_owned));
        }
        let mut add = |stem: &str, index: usize, format: FileFormat| match format {
            FileFormat::Csv => out.push(numbered(stem, index, "csv")),
            FileFormat::Netcdf => out.push(numbered(stem, index, "nc")),
            FileFormat::Vtr => {
                out.push(numbered(stem, index, "vtr"));
                out.push(format!("{stem}.pvd"));
            }
            FileFormat::InitialNetcdf => out.push(numbered("initial", index, "nc")),
        };
        for due in due {
            for (index, format) in due.fields.iter().flat_map(|i| self.output.fields.iter().map(move |f| (*i, *f))) {
                add("fields", index, format);
            }
            for (index, format) in due.planes.iter().flat_map(|i| self.output.planes.iter().map(move |f| (*i, *f))) {
                (1..=self.output.planes_x_m.len()).for_each(|n| add(&format!("plane{n}"), index, format));
            }
        }
        out
    }

    /// Refuses a folder with files in the way that this program did not write. On a restart the case may have been edited: its
    /// end and its outputs may change.
    pub(super) fn refuse_foreign(&self, due: &[Due], is_wake: bool, begin: Begin) -> Result<(), Error> {
        let existing = if begin == Begin::Overwrite { Existing::Any } else { Existing::Own };
        let mut names = self.names(due, is_wake);
        names.retain(|name| begin != Begin::Restart || name != CASE);
        Ok(refuse_foreign(&self.folder, names.iter().map(String::as_str), existing)?)
    }

    /// Writes all files that are due, or none of them; returns their paths.
    pub(super) fn write(&self, flow: &Flow, due: Due) -> Result<Vec<PathBuf>, Error> {
        let mut group = FileGroup::new(&self.folder);
        if let Some(index) = due.fields {
            self.add_fields(&mut group, flow, index)?;
        }
        if let Some(index) = due.planes {
            for (number, &x_m) in self.output.planes_x_m.iter().enumerate() {
                self.add_plane(&mut group, flow, index, &format!("plane{}", number + 1), x_m)?;
            }
        }
        Ok(group.commit()?)
    }

    fn add_fields(&self, group: &mut FileGroup, flow: &Flow, index: usize) -> Result<(), Error> {
        let name = |extension: &str| numbered("fields", index, extension);
        let formats = &self.output.fields;
        if formats.iter().any(|format| *format != FileFormat::InitialNetcdf) {
            let field = self.field(flow)?;
            for format in formats {
                match format {
                    FileFormat::Csv => group.add(&name("csv"), field.table()?.to_csv(&self.origin)?)?,
                    #[cfg(feature = "netcdf")]
                    FileFormat::Netcdf => {
                        group.add(&name("nc"), crate::io::cf_fields::cf_field_bytes(&field, &self.origin)?)?;
                    }
                    #[cfg(feature = "vtk")]
                    FileFormat::Vtr => {
                        group.add(&name("vtr"), crate::io::vtr::field_bytes(&field, &self.origin)?)?;
                        group.add("fields.pvd", self.collection("fields", index, &self.times_s[0], 1.0))?;
                    }
                    // A case that names a format which this build lacks was refused.
                    _ => {}
                }
            }
        }
        #[cfg(feature = "netcdf")]
        if formats.contains(&FileFormat::InitialNetcdf) {
            let bytes = crate::io::cf_fields::cf_faces_bytes(&self.faces(flow), &self.origin)?;
            group.add(&numbered("initial", index, "nc"), bytes)?;
        }
        Ok(())
    }

    fn add_plane(&self, group: &mut FileGroup, flow: &Flow, index: usize, stem: &str, x_m: f64) -> Result<(), Error> {
        let plane = self.plane(flow, x_m)?;
        for format in &self.output.planes {
            match format {
                FileFormat::Csv => {
                    let table = tables::planes_table(&plane)?.to_csv(&self.origin)?;
                    group.add(&numbered(stem, index, "csv"), table)?;
                }
                #[cfg(feature = "netcdf")]
                FileFormat::Netcdf => {
                    let bytes = crate::io::cf_planes::cf_planes_bytes(&plane, &self.origin)?;
                    group.add(&numbered(stem, index, "nc"), bytes)?;
                }
                #[cfg(feature = "vtk")]
                FileFormat::Vtr => {
                    let bytes = crate::io::vtr::plane_file(&plane, &self.origin)?;
                    group.add(&numbered(stem, index, "vtr"), bytes)?;
                    group
                        .add(&format!("{stem}.pvd"), self.collection(stem, index, &self.times_s[1], self.tau_per_s))?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The collection of all outputs up to this one.
    #[cfg(feature = "vtk")]
    fn collection(&self, stem: &str, index: usize, times_s: &[f64], per_s: f64) -> Vec<u8> {
        let names: Vec<String> = (0..=index).map(|i| numbered(stem, i, "vtr")).collect();
        let members = times_s.iter().map(|t| t * per_s).zip(names.iter().map(String::as_str));
        crate::io::vtr::pvd_bytes(members, &self.origin)
    }

    fn field(&self, flow: &Flow) -> Result<VelocityField, Error> {
        let mesh = flow.mesh();
        let vorticity_per_s =
            if self.with_vorticity { Some(flow.vorticity_magnitude_per_s().map_err(Error::Flow)?) } else { None };
        Ok(VelocityField {
            title: self.title.clone(),
            time_s: flow.time_s(),
            x_m: mesh.centre_m(0),
            y_m: mesh.centre_m(1),
            z_m: mesh.centre_m(2),
            velocity_m_s: [0, 1, 2].map(|axis| flow.centre_velocity_m_s(axis)),
            pressure_m2_s2: flow.pressure_m2_s2(),
            vorticity_per_s,
        })
    }

    #[cfg(feature = "netcdf")]
    fn faces(&self, flow: &Flow) -> crate::io::cf_fields::FaceVelocities {
        let mesh = flow.mesh();
        crate::io::cf_fields::FaceVelocities {
            title: self.title.clone(),
            time_s: flow.time_s(),
            centre_m: [0, 1, 2].map(|axis| mesh.centre_m(axis)),
            face_m: [0, 1, 2].map(|axis| {
                let mut faces_m = mesh.face_m(axis);
                faces_m.pop();
                faces_m
            }),
            velocity_m_s: [0, 1, 2].map(|axis| flow.face_velocity_m_s(axis)),
        }
    }

    fn plane(&self, flow: &Flow, x_m: f64) -> Result<CrossPlanes, Error> {
        let plane = flow.cross_plane(x_m).map_err(Error::Flow)?;
        let shape = (1, plane.z_m.len(), plane.y_m.len());
        let component = |c: usize| {
            let values = plane.velocity_m_s.iter().map(|v| v[c]).collect();
            Array3::from_shape_vec(shape, values).unwrap_or_else(|_| Array3::zeros(shape))
        };
        Ok(CrossPlanes {
            title: format!("{}, plane at x = {x_m} m", self.title),
            tau: vec![flow.time_s() * self.tau_per_s],
            time_s: vec![flow.time_s()],
            v_m_s: component(1),
            w_m_s: component(2),
            y_m: plane.y_m,
            z_m: plane.z_m,
            y_edges: plane.y_edges,
            z_edges: plane.z_edges,
        })
    }

    /// The table of the steps.
    pub(super) fn steps_path(&self) -> PathBuf {
        self.folder.join(STEPS)
    }
}

/// The checkpoint of a run in `folder`, and the one before it.
pub(super) fn checkpoint_paths(folder: &Path) -> [PathBuf; 2] {
    [folder.join("flow.checkpoint"), folder.join("flow.checkpoint.previous")]
}
