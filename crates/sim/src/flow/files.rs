//! What a run writes at its output times: whole fields, planes, initial fields.
//!
//! The ranks of a flow write a file together: the first one makes it, each writes the parts that it has, and when all are on disk the
//! first one puts them into place.
//!
//! Check: files of ranks against those of one process, a rank whose part cannot be written, a rank that is lost.

use super::Begin;
use super::case::{FileFormat, Output};
use super::wake::{self, Due};
use crate::Error;
use crate::io::cf_planes::cf_planes_bytes;
use crate::io::{
    CrossPlanes, Existing, FileGroup, FileParts, Provenance, VelocityField, cf_fields,
};
use ndarray::Array3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wakescope_les::Flow;
use wakescope_les::ranks::{self, Ranks, all_gather};
use wakescope_les::solver::Ends;

/// The case with every default.
pub(super) const CASE: &str = "case.toml";
/// The table of the steps.
pub(super) const STEPS: &str = "steps.csv";

/// A file of an output: a field at the centres of the cells, the velocities on their faces as an initial field, or a plane.
#[derive(Debug, Clone, PartialEq)]
struct OutputFile {
    stem: String,
    /// Number of the output, from 0.
    index: usize,
    format: FileFormat,
    /// Number of the plane; none of a field.
    plane: Option<usize>,
}

impl OutputFile {
    fn name(&self) -> String {
        format!("{}_{:04}.nc", self.stem, self.index + 1)
    }

    /// Its approximate size for a flow with these numbers of cells \[bytes\].
    fn bytes(&self, cells: f64, plane: f64, variables: f64) -> f64 {
        match (self.plane, self.format) {
            (None, FileFormat::InitialNetcdf) => cells * 24.0,
            (None, FileFormat::Netcdf) => cells * variables * 4.0,
            (Some(_), _) => plane * 8.0,
        }
    }
}

/// Row of `steps.csv`, of a record of a wake but for its centres \[bytes\].
const STEP_ROW_BYTES: f64 = 220.0;
const RECORD_BYTES: f64 = 2500.0;

/// Files of one kind.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FileForecast {
    /// Name, `*` standing for the number of the output.
    pub name: String,
    /// How many.
    pub count: usize,
    /// All of them \[bytes\].
    pub bytes: f64,
}

/// The plan of the files.
#[derive(Debug)]
pub(super) struct Files {
    pub(super) folder: PathBuf,
    pub(super) output: Output,
    pub(super) origin: Provenance,
    /// The output times and what is due at each.
    pub(super) schedule: Vec<Due>,
    /// Whether a wake is recorded; fields then have the vorticity, too.
    pub(super) is_wake: bool,
    /// Age of the wake per time \[1/s\].
    pub(super) tau_per_s: f64,
    pub(super) title: String,
}

impl Files {
    /// The files of an output, in the order in which they are written.
    fn of_output(&self, due: Due) -> Vec<OutputFile> {
        let mut out = Vec::new();
        if let Some(index) = due.fields {
            let mut formats = self.output.fields.clone();
            formats.sort_by_key(|format| *format == FileFormat::InitialNetcdf);
            for format in formats {
                let stem = match format {
                    FileFormat::Netcdf => "fields",
                    FileFormat::InitialNetcdf => "initial",
                };
                out.push(OutputFile {
                    stem: stem.into(),
                    index,
                    format,
                    plane: None,
                });
            }
        }
        if let Some(index) = due.planes {
            for number in 0..self.output.planes_x_m.len() {
                for &format in &self.output.planes {
                    out.push(OutputFile {
                        stem: format!("plane{}", number + 1),
                        index,
                        format,
                        plane: Some(number),
                    });
                }
            }
        }
        out
    }

    fn of_outputs(&self) -> impl Iterator<Item = OutputFile> {
        self.schedule.iter().flat_map(|due| self.of_output(*due))
    }

    /// Names of all files of a run, but for its checkpoints.
    fn names(&self) -> Vec<String> {
        let mut out = vec![CASE.to_owned()];
        out.extend(self.output.steps.then(|| STEPS.to_owned()));
        if self.is_wake {
            out.extend(wake::HISTORIES.map(str::to_owned));
            #[cfg(feature = "plots")]
            out.extend(wake::PICTURES.map(str::to_owned));
        }
        out.extend(self.of_outputs().map(|file| file.name()));
        out
    }

    /// Number and size of the files of a run by its steps, those of all outputs together.
    pub(super) fn forecast(
        &self,
        cells: [usize; 3],
        steps: f64,
        writes_checkpoints: bool,
    ) -> Vec<FileForecast> {
        let [nx, ny, nz] = cells.map(|n| n as f64);
        let variables = if self.is_wake { 5.0 } else { 4.0 };
        let mut out: Vec<FileForecast> = Vec::new();
        let (planes, mut files): (Vec<_>, Vec<_>) =
            self.of_outputs().partition(|file| file.plane.is_some());
        files.extend(planes);
        for file in files {
            let stem = if file.plane.is_some() {
                "plane*"
            } else {
                &file.stem
            };
            let bytes = file.bytes(nx * ny * nz, ny * nz, variables);
            add_files(&mut out, &format!("{stem}_*.nc"), 1, bytes);
        }
        let tables = usize::from(self.output.steps);
        add_files(&mut out, STEPS, tables, steps * STEP_ROW_BYTES);
        let histories = if self.is_wake { 2 } else { 0 };
        let records = self.schedule.iter().filter(|due| due.record).count() as f64;
        let history_bytes = records * (RECORD_BYTES + 40.0 * nx);
        add_files(&mut out, "wake.*", histories, history_bytes);
        let checkpoints = if writes_checkpoints { 2 } else { 0 };
        let checkpoint_bytes = 2.0 * 7.0 * 8.0 * nx * ny * nz;
        add_files(&mut out, "flow.checkpoint*", checkpoints, checkpoint_bytes);
        out
    }

    /// Refuses a folder that holds files of the names of this run, unless the run continues there or begins anew.
    pub(super) fn refuse_existing(&self, begin: Begin) -> Result<(), Error> {
        let existing = Existing::with_overwrite(begin != Begin::New);
        existing.check(&self.folder, self.names().iter().map(String::as_str))
    }

    /// Writes all files that are due, or none of them; returns their paths, on rank 0 alone. Of fields each rank writes what it
    /// has; planes, which all have, rank 0 writes.
    pub(super) fn write(
        &self,
        flow: &Flow,
        due: Due,
        ranks: &Arc<dyn Ranks>,
    ) -> Result<Vec<PathBuf>, Error> {
        let group = agree(ranks, self.group(flow, due, ranks.rank() == 0))?;
        commit(&group, ranks)
    }

    /// The files that are due of the flow, which all ranks must make together: of fields what this rank has, planes whole.
    fn group(&self, flow: &Flow, due: Due, is_first: bool) -> Result<FileGroup, Error> {
        let mut group = FileGroup::new(&self.folder);
        for file in self.of_output(due) {
            let parts = match (file.plane, file.format) {
                (None, FileFormat::Netcdf) => {
                    let field = self.field(flow)?;
                    cf_fields::cf_field_parts(&field, &self.origin)?
                }
                (None, FileFormat::InitialNetcdf) => {
                    let faces = self.faces(flow)?;
                    cf_fields::cf_faces_parts(&faces, &self.origin)?
                }
                (Some(plane), FileFormat::Netcdf) => {
                    let plane = self.plane(flow, self.output.planes_x_m[plane])?;
                    of_first(cf_planes_bytes(&plane, &self.origin)?, is_first)
                }
                // Planes are no initial fields: the case refuses them.
                (Some(_), FileFormat::InitialNetcdf) => continue,
            };
            group.add_parts(&file.name(), parts)?;
        }
        Ok(group)
    }

    fn field(&self, flow: &Flow) -> Result<VelocityField, Error> {
        let mesh = flow.mesh();
        let vorticity_per_s = if self.is_wake {
            Some(flow.own_vorticity_magnitude_per_s().map_err(Error::Flow)?)
        } else {
            None
        };
        let u_m_s = flow.own_centre_velocity_m_s(0).map_err(Error::Flow)?;
        let v_m_s = flow.own_centre_velocity_m_s(1).map_err(Error::Flow)?;
        let w_m_s = flow.own_centre_velocity_m_s(2).map_err(Error::Flow)?;
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
            velocity_m_s: [u_m_s, v_m_s, w_m_s],
            pressure_m2_s2: flow.own_pressure_m2_s2().map_err(Error::Flow)?,
            vorticity_per_s,
            planes: flow.own_planes(),
        })
    }

    fn faces(&self, flow: &Flow) -> Result<cf_fields::FaceVelocities, Error> {
        let mesh = flow.mesh();
        let u_m_s = flow.own_face_velocity_m_s(0).map_err(Error::Flow)?;
        let v_m_s = flow.own_face_velocity_m_s(1).map_err(Error::Flow)?;
        let w_m_s = flow.own_face_velocity_m_s(2).map_err(Error::Flow)?;
        Ok(cf_fields::FaceVelocities {
            title: self.title.clone(),
            time_s: flow.time_s(),
            centre_m: [0, 1, 2].map(|axis| mesh.centre_m(axis)),
            face_m: [0, 1, 2].map(|axis| {
                let mut faces_m = mesh.face_m(axis);
                faces_m.pop();
                faces_m
            }),
            velocity_m_s: [u_m_s, v_m_s, w_m_s],
            planes: flow.own_planes(),
        })
    }

    fn plane(&self, flow: &Flow, x_m: f64) -> Result<CrossPlanes, Error> {
        let plane = flow.cross_plane(x_m).map_err(Error::Flow)?;
        let shape = (1, plane.z_m.len(), plane.y_m.len());
        let mut v_m_s = Vec::with_capacity(plane.velocity_m_s.len());
        let mut w_m_s = Vec::with_capacity(plane.velocity_m_s.len());
        for velocity_m_s in &plane.velocity_m_s {
            v_m_s.push(velocity_m_s[1]);
            w_m_s.push(velocity_m_s[2]);
        }
        Ok(CrossPlanes {
            title: format!("{}, plane at x = {x_m} m", self.title),
            tau: vec![wake::age_tau(flow.time_s(), self.tau_per_s)],
            time_s: vec![flow.time_s()],
            v_m_s: in_one_plane(shape, v_m_s),
            w_m_s: in_one_plane(shape, w_m_s),
            y_m: plane.y_m,
            z_m: plane.z_m,
            y_edges: plane.y_edges,
            z_edges: plane.z_edges,
        })
    }
}

/// Values of one plane; zeros if their number differs from the shape.
fn in_one_plane(shape: (usize, usize, usize), values: Vec<f64>) -> Array3<f64> {
    Array3::from_shape_vec(shape, values).unwrap_or_else(|_| Array3::zeros(shape))
}

/// A file that all ranks have whole: the first one writes it.
fn of_first(bytes: Vec<u8>, is_first: bool) -> FileParts {
    let all = FileParts::from(bytes);
    if is_first {
        all
    } else {
        FileParts {
            parts: Vec::new(),
            ..all
        }
    }
}

/// Adds files to those of the same name, or as a new kind.
fn add_files(kinds: &mut Vec<FileForecast>, name: &str, count: usize, bytes: f64) {
    match kinds.iter_mut().find(|kind| kind.name == name) {
        Some(kind) => {
            kind.count += count;
            kind.bytes += bytes;
        }
        None if count > 0 => kinds.push(FileForecast {
            name: name.into(),
            count,
            bytes,
        }),
        None => {}
    }
}
/// An error of one rank is that of all.
pub(super) fn agree<T>(ranks: &Arc<dyn Ranks>, result: Result<T, Error>) -> Result<T, Error> {
    ranks::all_agree(&**ranks, result, Error::Flow)
}

/// Writes the files of a group, which has the same names on all ranks, all of them or none; the folder exists.
///
/// # Errors
/// The first refusal of the system on any rank; the folder is then as it was before.
fn commit(group: &FileGroup, ranks: &Arc<dyn Ranks>) -> Result<Vec<PathBuf>, Error> {
    let is_first = ranks.rank() == 0;
    let begun = if is_first {
        group.begin().map(Some)
    } else {
        Ok(None)
    };
    let stage = agree(ranks, begun)?;
    let name = stage.as_ref().map_or_else(Vec::new, |stage| {
        stage.name().bytes().map(f64::from).collect()
    });
    let name = all_gather(&**ranks, name).map_err(Error::Flow)?;
    let name: Vec<u8> = name.into_iter().map(|byte| byte as u8).collect();
    agree(ranks, group.write(&String::from_utf8_lossy(&name)))?;
    agree(
        ranks,
        stage.map_or(Ok(Vec::new()), |stage| group.put(&stage)),
    )
}

/// The checkpoint of a run in `folder`, and the one before it.
pub(super) fn checkpoint_paths(folder: &Path) -> [PathBuf; 2] {
    [
        folder.join("flow.checkpoint"),
        folder.join("flow.checkpoint.previous"),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::thread_ranks::on_threads;
    use super::*;
    use crate::io::FileParts;
    use std::fs;

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let write = |text: &'static str, fails: bool| {
            on_threads(3, |ranks| {
                let rank = ranks.rank();
                let mut group = FileGroup::new(folder.path());
                let part = (rank as u64, vec![text.as_bytes()[rank]]);
                // No file reaches so far.
                let part = if fails && rank == 1 {
                    (u64::MAX, part.1)
                } else {
                    part
                };
                group
                    .add_parts(
                        "a",
                        FileParts {
                            length: 3,
                            parts: vec![part],
                        },
                    )
                    .unwrap();
                commit(&group, &ranks).map_err(|error| error.to_string())
            })
        };
        let names = || fs::read_dir(folder.path()).unwrap().count();
        let written = write("abc", false);
        assert_eq!(written[0], Some(Ok(vec![path.clone()])));
        assert_eq!(
            (fs::read_to_string(&path).unwrap().as_str(), names()),
            ("abc", 1)
        );
        let failed = write("xyz", true);
        assert!(
            failed
                .iter()
                .all(|one| matches!(one, Some(Err(words)) if words.contains("cannot write"))),
            "{failed:?}"
        );
        assert_eq!(
            (fs::read_to_string(&path).unwrap().as_str(), names()),
            ("abc", 1),
            "nothing is left behind"
        );
    }

    #[test]
    fn a_rank_that_is_lost_leaves_no_file_under_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let found = on_threads(2, |ranks| {
            assert!(ranks.rank() == 0, "this one ends early");
            let mut group = FileGroup::new(folder.path());
            group.add("a", "abc").unwrap();
            commit(&group, &ranks).is_err()
        });
        assert_eq!(found, [Some(true), None]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
