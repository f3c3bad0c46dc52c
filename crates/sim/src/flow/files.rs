//! What a run writes at its output times: whole fields, planes, initial fields, collections.

use super::Begin;
use super::case::{FileFormat, Output};
use super::shared::{agree, commit};
use super::wake::{self, Due};
use crate::Error;
use crate::io::own::refuse_foreign;
use crate::io::{CrossPlanes, Existing, FileGroup, FileParts, Provenance, Share, VelocityField, tables};
use ndarray::Array3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::Flow;
use wakescope_les::ranks::{Ranks, together};
use wakescope_les::solver::Ends;

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

    /// Writes all files that are due, or none of them; returns their paths, on rank 0 alone. Of fields each rank writes what it
    /// has; planes, which all have, rank 0 writes.
    pub(super) fn write(&self, flow: &Flow, due: Due, ranks: &Arc<dyn Ranks>) -> Result<Vec<PathBuf>, Error> {
        let is_first = ranks.rank() == 0;
        let shown = agree(ranks, self.shown(flow, due, ranks))?;
        let mut group = FileGroup::new(&self.folder);
        let mut rows = Vec::new();
        let mut add = || {
            if let Some(index) = due.fields {
                self.add_fields(&mut group, &mut rows, &shown, index)?;
            }
            if let Some(index) = due.planes {
                for (number, plane) in shown.planes.iter().enumerate() {
                    self.add_plane(&mut group, plane, index, &format!("plane{}", number + 1), is_first)?;
                }
            }
            Ok(())
        };
        agree(ranks, add())?;
        // The numbers are larger than the files.
        drop(shown);
        for (name, text) in rows {
            let own = [text.len() as f64];
            let lengths = together(&**ranks, &own).map_err(Error::Flow)?;
            let before = lengths[..ranks.rank()].iter().sum::<f64>() as u64;
            let length = lengths.iter().sum::<f64>() as u64;
            group.add_parts(&name, FileParts { length, parts: vec![(before, text.into_bytes())] })?;
        }
        commit(&group, ranks)
    }

    /// What is due of the flow, for which all ranks must ask together.
    fn shown(&self, flow: &Flow, due: Due, ranks: &Arc<dyn Ranks>) -> Result<Shown, Error> {
        let share = Share { planes: flow.own_planes(), is_first: ranks.rank() == 0 };
        let wants = |of: &dyn Fn(&FileFormat) -> bool| due.fields.is_some() && self.output.fields.iter().any(of);
        let initial = |format: &FileFormat| *format == FileFormat::InitialNetcdf;
        let field = if wants(&|format| !initial(format)) { Some(self.field(flow, share.clone())?) } else { None };
        #[cfg(feature = "vtk")]
        let behind = field.as_ref().map_or(Ok(None), |field| behind(field, ranks))?;
        let xs_m: &[f64] = if due.planes.is_some() { &self.output.planes_x_m } else { &[] };
        let planes = xs_m.iter().map(|x_m| self.plane(flow, *x_m)).collect::<Result<_, _>>()?;
        Ok(Shown {
            field,
            #[cfg(feature = "vtk")]
            behind,
            #[cfg(feature = "netcdf")]
            faces: if wants(&initial) { Some(self.faces(flow, share)?) } else { None },
            planes,
        })
    }

    /// Adds the fields to the group, or as texts whose places in their files are not known yet.
    #[cfg_attr(
        not(any(feature = "netcdf", feature = "vtk")),
        expect(unused_variables, reason = "texts are not in the group")
    )]
    fn add_fields(
        &self,
        group: &mut FileGroup,
        rows: &mut Vec<(String, String)>,
        shown: &Shown,
        index: usize,
    ) -> Result<(), Error> {
        let name = |extension: &str| numbered("fields", index, extension);
        if let Some(field) = &shown.field {
            for format in &self.output.fields {
                match format {
                    FileFormat::Csv => {
                        let table = field.table()?;
                        let text = if field.share.is_first { table.to_csv(&self.origin)? } else { table.rows()? };
                        rows.push((name("csv"), text));
                    }
                    #[cfg(feature = "netcdf")]
                    FileFormat::Netcdf => {
                        group.add_parts(&name("nc"), crate::io::cf_fields::cf_field_parts(field, &self.origin)?)?;
                    }
                    #[cfg(feature = "vtk")]
                    FileFormat::Vtr => {
                        let file = crate::io::vtr::field_parts(field, shown.behind.as_deref(), &self.origin)?;
                        group.add_parts(&name("vtr"), file)?;
                        let collection = self.collection("fields", index, &self.times_s[0], 1.0);
                        group.add_parts("fields.pvd", of_first(collection, field.share.is_first))?;
                    }
                    // A case that names a format which this build lacks was refused.
                    _ => {}
                }
            }
        }
        #[cfg(feature = "netcdf")]
        if let Some(faces) = &shown.faces {
            let file = crate::io::cf_fields::cf_faces_parts(faces, &self.origin)?;
            group.add_parts(&numbered("initial", index, "nc"), file)?;
        }
        Ok(())
    }

    fn add_plane(
        &self,
        group: &mut FileGroup,
        plane: &CrossPlanes,
        index: usize,
        stem: &str,
        is_first: bool,
    ) -> Result<(), Error> {
        let mut add = |name: &str, bytes: Vec<u8>| group.add_parts(name, of_first(bytes, is_first));
        for format in &self.output.planes {
            match format {
                FileFormat::Csv => {
                    let table = tables::planes_table(plane)?.to_csv(&self.origin)?;
                    add(&numbered(stem, index, "csv"), table.into_bytes())?;
                }
                #[cfg(feature = "netcdf")]
                FileFormat::Netcdf => {
                    let bytes = crate::io::cf_planes::cf_planes_bytes(plane, &self.origin)?;
                    add(&numbered(stem, index, "nc"), bytes)?;
                }
                #[cfg(feature = "vtk")]
                FileFormat::Vtr => {
                    let bytes = crate::io::vtr::plane_file(plane, &self.origin)?;
                    add(&numbered(stem, index, "vtr"), bytes)?;
                    add(&format!("{stem}.pvd"), self.collection(stem, index, &self.times_s[1], self.tau_per_s))?;
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

    fn field(&self, flow: &Flow, share: Share) -> Result<VelocityField, Error> {
        let mesh = flow.mesh();
        let velocity = |axis| flow.own_centre_velocity_m_s(axis).map_err(Error::Flow);
        let vorticity_per_s =
            if self.with_vorticity { Some(flow.own_vorticity_magnitude_per_s().map_err(Error::Flow)?) } else { None };
        Ok(VelocityField {
            title: self.title.clone(),
            time_s: flow.time_s(),
            x_m: mesh.centre_m(0),
            y_m: mesh.centre_m(1),
            z_m: mesh.centre_m(2),
            period_m: [0, 1].map(|axis| {
                let along = &mesh.directions()[axis];
                (along.ends == Ends::Periodic).then(|| along.length_m())
            }),
            velocity_m_s: [velocity(0)?, velocity(1)?, velocity(2)?],
            pressure_m2_s2: flow.own_pressure_m2_s2().map_err(Error::Flow)?,
            vorticity_per_s,
            share,
        })
    }

    #[cfg(feature = "netcdf")]
    fn faces(&self, flow: &Flow, share: Share) -> Result<crate::io::cf_fields::FaceVelocities, Error> {
        let mesh = flow.mesh();
        let velocity = |axis| flow.own_face_velocity_m_s(axis).map_err(Error::Flow);
        Ok(crate::io::cf_fields::FaceVelocities {
            title: self.title.clone(),
            time_s: flow.time_s(),
            centre_m: [0, 1, 2].map(|axis| mesh.centre_m(axis)),
            face_m: [0, 1, 2].map(|axis| {
                let mut faces_m = mesh.face_m(axis);
                faces_m.pop();
                faces_m
            }),
            velocity_m_s: [velocity(0)?, velocity(1)?, velocity(2)?],
            share,
        })
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
            tau: vec![super::age_tau(flow.time_s(), self.tau_per_s)],
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

/// What is due of a flow: of fields what this rank has, planes whole.
struct Shown {
    field: Option<VelocityField>,
    /// Values of the field in the cell behind the last one that is here.
    #[cfg(feature = "vtk")]
    behind: Option<Vec<f64>>,
    #[cfg(feature = "netcdf")]
    faces: Option<crate::io::cf_fields::FaceVelocities>,
    planes: Vec<CrossPlanes>,
}

/// A file that the first rank writes alone.
fn of_first(bytes: Vec<u8>, is_first: bool) -> FileParts {
    let length = bytes.len() as u64;
    FileParts { length, parts: if is_first { vec![(0, bytes)] } else { Vec::new() } }
}

/// Values of a field in the first cell of the next rank that has any.
#[cfg(feature = "vtk")]
fn behind(field: &VelocityField, ranks: &Arc<dyn Ranks>) -> Result<Option<Vec<f64>>, Error> {
    let first: Vec<f64> = field.named().filter_map(|(_, values)| values.first().copied()).collect();
    let count = field.named().count();
    let mut own = vec![field.share.planes.start as f64];
    own.extend(&first);
    let own = if first.is_empty() { &[][..] } else { &own };
    let all = together(&**ranks, own).map_err(Error::Flow)?;
    let next = all.chunks(count + 1).find(|values| values[0] == field.share.planes.end as f64);
    Ok(next.map(|values| values[1..].to_vec()))
}

/// The checkpoint of a run in `folder`, and the one before it.
pub(super) fn checkpoint_paths(folder: &Path) -> [PathBuf; 2] {
    [folder.join("flow.checkpoint"), folder.join("flow.checkpoint.previous")]
}
