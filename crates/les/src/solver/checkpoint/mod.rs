//! Checkpoints: the whole state of a simulation in one file, from which it continues with the same
//! bits.
//!
//! A file holds the state (velocity, the terms of the step before, pressure, time, step lengths,
//! implicit directions), what mesh and settings it belongs to, and bytes of the caller. It is
//! versioned, has a checksum for each plane and is put in place by renaming. Each rank writes and
//! reads its own planes. Mesh, walls, viscosity, force, scheme, subgrid model and memory order must
//! be the same to continue; time step, pressure method and tolerance may be changed.
//!
//! Check: restarts of every scheme against uninterrupted runs bit for bit; damaged, foreign and
//! unfitting files.

mod container;

use std::path::Path;

use super::flow::{Flow, State};
use super::layout::Layout;
use super::mesh::{AXIS_NAMES, Direction, Mesh};
use super::settings::FlowSettings;
use crate::Error;
use crate::solver::slabs::WHOLE;
use container::{Planes, Reader, Tag};

/// Version of the content. Raise it with every change of the sections, of the texts in
/// [`identity`], or of what a run keeps beside the flow.
const VERSION: u32 = 4;

const IDENTITY: &Tag = b"IDENTITY";
const METRICS: [&Tag; 3] = [b"METRIC X", b"METRIC Y", b"METRIC Z"];
const SCALARS: &Tag = b"SCALARS ";
const USER: &Tag = b"USERDATA";
/// Fields of which each plane has its values: velocity, terms of the step before, pressure.
const FIELDS: usize = 7;

/// Positions and metrics of another machine may differ in their last digits; a different mapping
/// differs more.
const METRIC_TOLERANCE: f64 = 1e-11;

impl Flow {
    /// Writes a checkpoint; `user_data` comes back from [`Self::restore`]. An older file of that
    /// name is replaced only when the new one is safe on disk, so there is always a whole one.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses; nothing is changed then.
    pub fn save(&self, path: impl AsRef<Path>, user_data: &[u8]) -> Result<(), Error> {
        self.save_and_keep(path.as_ref(), None, user_data)
    }

    /// As [`Self::save`], with the older file renamed to `previous`. Of several ranks the first
    /// begins and ends the file, and each writes its planes.
    pub(crate) fn save_and_keep(
        &self,
        path: &Path,
        previous: Option<&Path>,
        user_data: &[u8],
    ) -> Result<(), Error> {
        let result = self.try_save(path, previous, user_data);
        if result.is_err() && self.layout.slabs.is_first() {
            container::abandon(path);
        }
        result
    }

    /// Writes a checkpoint; a file that was begun stays if it fails.
    fn try_save(
        &self,
        path: &Path,
        previous: Option<&Path>,
        user_data: &[u8],
    ) -> Result<(), Error> {
        let slabs = &self.layout.slabs;
        let begun = if slabs.is_first() {
            self.begin(path, user_data).map(Some)
        } else {
            Ok(None)
        };
        let begun = slabs.all_agree(begun)?;
        slabs.all_agree(self.write_planes(path, begun))?;
        slabs.all_agree(if slabs.is_first() {
            container::finish(path, previous)
        } else {
            Ok(())
        })
    }

    /// Bytes of the fields in a plane.
    fn plane_bytes(&self) -> u64 {
        (8 * FIELDS * self.layout.shape.plane()) as u64
    }

    /// Begins the file.
    fn begin(&self, path: &Path, user_data: &[u8]) -> Result<Planes, Error> {
        let identity = identity(self.mesh(), self.settings(), &self.layout);
        let text: String = identity
            .iter()
            .map(|(name, value)| format!("{name}\t{value}\n"))
            .collect();
        let mut sections = vec![(*IDENTITY, text.into_bytes())];
        for (tag, direction) in METRICS.iter().zip(self.mesh().directions()) {
            let bytes = metrics(direction).into_iter().flat_map(f64::to_le_bytes);
            sections.push((**tag, bytes.collect()));
        }
        sections.push((*SCALARS, scalars(&self.state)));
        sections.push((*USER, user_data.to_vec()));
        container::begin(
            path,
            VERSION,
            &sections,
            [self.layout.shape.n[2] as u64, self.plane_bytes()],
        )
    }

    /// Writes the planes that this rank owns to the file that the first rank, which alone has
    /// `begun`, has begun.
    fn write_planes(&self, path: &Path, begun: Option<Planes>) -> Result<(), Error> {
        let mut sent = Vec::new();
        if let Some(planes) = begun {
            sent.push(planes.start as f64);
            sent.extend(planes.checksum.map(f64::from));
        }
        let received = self.layout.slabs.all_gather(sent)?;
        let checksum = std::array::from_fn(|i| received.get(i + 1).map_or(0, |byte| *byte as u8));
        let planes = Planes {
            start: received.first().map_or(0, |start| *start as u64),
            checksum,
        };
        let shape = self.layout.shape;
        let state = &self.state;
        container::write_planes(path, planes, shape.own(), self.plane_bytes(), |k, bytes| {
            let start = shape.place([0, 0, k]);
            for field in state
                .velocity
                .iter()
                .chain(&state.previous_terms)
                .chain([&state.pressure])
            {
                bytes.extend(
                    field[start..start + shape.plane()]
                        .iter()
                        .flat_map(|value| value.to_le_bytes()),
                );
            }
        })
    }

    /// The simulation of a checkpoint, with the caller's bytes. With equal settings it continues
    /// bit for bit as if it had not been interrupted, on any number of threads.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::NotACheckpoint`], [`Error::CheckpointVersion`],
    /// [`Error::CheckpointDamaged`]; what [`Flow::new`] refuses; [`Error::CheckpointMismatch`]
    /// names what differs between the checkpoint and `mesh` or `settings`.
    pub fn restore(
        path: impl AsRef<Path>,
        mesh: Mesh,
        settings: FlowSettings,
    ) -> Result<(Self, Vec<u8>), Error> {
        let read = Self::read(path.as_ref(), &mesh, &settings);
        // The ranks that share the flow must agree on that, too.
        let (mut flow, user_data) = Layout::new(&mesh)
            .shared(settings.ranks)?
            .slabs
            .all_agree(read)?;
        let [u, v, w] = flow.state.velocity.each_mut().map(|field| &mut field[..]);
        flow.layout
            .slabs
            .halos(&mut [u, v, w, &mut flow.state.pressure], WHOLE)?;
        Ok((flow, user_data))
    }

    /// The flow of a checkpoint, without halos.
    fn read(path: &Path, mesh: &Mesh, settings: &FlowSettings) -> Result<(Self, Vec<u8>), Error> {
        let mut file = Reader::open(path, VERSION)?;
        let text = file.bytes(IDENTITY)?;
        let Ok(text) = std::str::from_utf8(text) else {
            return Err(file.damaged("its properties are no text"));
        };
        let wanted = identity(mesh, settings, &Layout::new(mesh));
        compare_identity(path, text, &wanted)?;
        for (axis, tag) in METRICS.iter().enumerate() {
            compare_metrics(
                path,
                axis,
                &file.floats(tag)?,
                &metrics(&mesh.directions()[axis]),
            )?;
        }
        let mut flow = Self::at_rest(mesh.clone(), settings.clone())?;
        read_scalars(file.bytes(SCALARS)?, &mut flow.state)
            .ok_or_else(|| file.damaged("its scalars are not whole"))?;
        let user_data = file.bytes(USER)?.to_vec();
        let shape = flow.layout.shape;
        if file.counts != [shape.n[2] as u64, flow.plane_bytes()] {
            return Err(file.damaged("its fields are not of the size of the mesh"));
        }
        for k in shape.own() {
            let bytes = file.plane(k)?;
            let mut values = bytes
                .as_chunks::<8>()
                .0
                .iter()
                .map(|b| f64::from_le_bytes(*b));
            let start = shape.place([0, 0, k]);
            let State {
                velocity,
                previous_terms,
                pressure,
                ..
            } = &mut flow.state;
            for field in velocity.iter_mut().chain(previous_terms).chain([pressure]) {
                field[start..start + shape.plane()]
                    .iter_mut()
                    .zip(&mut values)
                    .for_each(|(to, value)| *to = value);
            }
        }
        Ok((flow, user_data))
    }
}

/// Whether a file is a whole checkpoint that this program can read; whether it fits a mesh,
/// [`Flow::restore`] says.
///
/// # Errors
/// [`Error::File`], [`Error::NotACheckpoint`], [`Error::CheckpointVersion`],
/// [`Error::CheckpointDamaged`].
pub fn check_checkpoint(path: impl AsRef<Path>) -> Result<(), Error> {
    let mut file = Reader::open(path.as_ref(), VERSION)?;
    let [planes, _] = file.counts;
    (0..planes as usize).try_for_each(|number| file.plane(number).map(drop))
}

/// What a checkpoint and its continuation must have in common, as names and values.
fn identity(mesh: &Mesh, settings: &FlowSettings, layout: &Layout) -> Vec<(String, String)> {
    let mut list = Vec::new();
    for (axis, d) in AXIS_NAMES.iter().zip(mesh.directions()) {
        list.extend([
            (
                format!("the number of cells along {axis}"),
                d.cells.to_string(),
            ),
            (format!("the low end of {axis}"), format!("{:?} m", d.low_m)),
            (
                format!("the high end of {axis}"),
                format!("{:?} m", d.high_m),
            ),
            (format!("the mapping of {axis}"), format!("{:?}", d.mapping)),
            (format!("what bounds {axis}"), format!("{:?}", d.ends)),
        ]);
    }
    let settings = [
        ("viscosity_m2_s", format!("{:?}", settings.viscosity_m2_s)),
        ("force_m_s2", format!("{:?}", settings.force_m_s2)),
        ("the time scheme", format!("{:?}", settings.scheme)),
        ("the subgrid model", format!("{:?}", settings.subgrid)),
        (
            "the order of the directions in memory",
            format!("{:?}", layout.direction),
        ),
    ];
    list.extend(settings.map(|(name, value)| (name.to_owned(), value)));
    list
}

fn compare_identity(path: &Path, stored: &str, wanted: &[(String, String)]) -> Result<(), Error> {
    let stored: Vec<(&str, &str)> = stored
        .lines()
        .filter_map(|line| line.split_once('\t'))
        .collect();
    for (what, value) in wanted {
        let found = stored.iter().find(|(name, _)| name == what);
        let found = found.map_or("absent", |(_, value)| value);
        if found != value {
            return Err(Error::CheckpointMismatch {
                path: path.to_owned(),
                what: what.clone(),
                stored: found.to_owned(),
                wanted: value.clone(),
            });
        }
    }
    Ok(())
}

/// Position and metric at all faces and centres \[m\].
fn metrics(direction: &Direction) -> Vec<f64> {
    (0..=2 * direction.cells)
        .flat_map(|i| <[f64; 2]>::from(direction.at(0.5 * i as f64)))
        .collect()
}

/// Tells custom mappings apart, which have no name.
fn compare_metrics(path: &Path, axis: usize, stored: &[f64], wanted: &[f64]) -> Result<(), Error> {
    let Some(i) = first_difference(stored, wanted) else {
        return Ok(());
    };
    let kind = ["position [m]", "metric [m]"][i % 2];
    let xi = 0.5 * (i / 2) as f64;
    Err(Error::CheckpointMismatch {
        path: path.to_owned(),
        what: format!(
            "the {kind} at xi = {xi} of the mapping of {}",
            AXIS_NAMES[axis]
        ),
        stored: stored.get(i).map_or("absent".into(), |v| format!("{v:?}")),
        wanted: format!("{:?}", wanted[i]),
    })
}

/// Index of the first position that differs against the length, or metric against itself.
fn first_difference(stored: &[f64], wanted: &[f64]) -> Option<usize> {
    if stored.len() != wanted.len() {
        return Some(0);
    }
    let length_m = wanted[wanted.len() - 2] - wanted[0];
    let position_scale_m = wanted[0].abs() + length_m;
    for (i, (a, b)) in stored.iter().zip(wanted).enumerate() {
        let scale_m = if i % 2 == 0 {
            position_scale_m
        } else {
            b.abs()
        };
        if (a - b).abs() > METRIC_TOLERANCE * scale_m {
            return Some(i);
        }
    }
    None
}

/// The numbers of the state, eight bytes each.
fn scalars(state: &State) -> Vec<u8> {
    let [implicit_0, implicit_1, implicit_2] = state.implicit.map(u64::from);
    let numbers = [
        state.time_s.to_bits(),
        state.step,
        state.last_step_s.to_bits(),
        state.courant_per_s.to_bits(),
        state.energy.to_bits(),
        implicit_0,
        implicit_1,
        implicit_2,
    ];
    numbers.into_iter().flat_map(u64::to_le_bytes).collect()
}

fn read_scalars(bytes: &[u8], state: &mut State) -> Option<()> {
    let (numbers, []) = bytes.as_chunks::<8>() else {
        return None;
    };
    let numbers: &[[u8; 8]; 8] = numbers.try_into().ok()?;
    let numbers = numbers.map(u64::from_le_bytes);
    let [time, step, last_step, courant, energy, implicit @ ..] = numbers;
    state.time_s = f64::from_bits(time);
    state.step = step;
    state.last_step_s = f64::from_bits(last_step);
    state.courant_per_s = f64::from_bits(courant);
    state.energy = f64::from_bits(energy);
    state.implicit = implicit.map(|flag| flag != 0);
    Some(())
}

#[cfg(test)]
mod tests;
