//! How the gates of the rays are ordered in a variable: \[time, range\], \[range, time\], either with further dimensions of length 1, or one ray
//! after the other, each with its own number of gates.
//!
//! Each variable is taken as it is stored. Lengths tell rays and gates apart, and names of dimensions where there are as many of both.
//! Check: the same velocities in every order; a square whose dimensions have names that say nothing is refused.

use crate::io::netcdf_input::{NetcdfFile, quoted};
use crate::io::variable::{self, AZIMUTH, ELEVATION, RANGE, TIME, ZENITH};
use crate::machine;

/// Names of dimensions of gates and of rays, for files whose coordinates have others.
const GATES: &str = "range gate gates gate_index range_gate ngates n_gates distance bin bins nbins";
const RAYS: &str = "time ray rays nrays n_rays beam beams profile azimuth elevation line";

/// Where a file has the gates of its rays.
pub(super) struct GateLayout<'f> {
    pub(super) file: &'f NetcdfFile,
    rays: usize,
    gates: usize,
    /// Where each ray begins, and its gates, in a file of rays that follow each other.
    ragged: Option<Vec<(usize, usize)>>,
}

impl<'f> GateLayout<'f> {
    /// The layout of a file whose velocities are the variable `name`.
    ///
    /// # Errors
    /// Velocities of another number of rays or gates.
    pub(super) fn new(
        file: &'f NetcdfFile,
        name: &str,
        [rays, gates]: [usize; 2],
    ) -> Result<Self, String> {
        let one_row = file.shape(name).is_some_and(|shape| shape.len() == 1);
        let is_ragged = one_row && file.has("ray_start_index") && file.has("ray_n_gates");
        let ragged = match is_ragged {
            true => Some(ragged(file, rays, gates)?),
            false => None,
        };
        let layout = Self {
            file,
            rays,
            gates,
            ragged,
        };
        if !is_ragged {
            layout.is_turned(name)?;
        }
        Ok(layout)
    }

    /// Whether the gates of a variable run slower than its rays.
    fn is_turned(&self, name: &str) -> Result<bool, String> {
        let shape = self.file.shape(name).unwrap_or_default();
        let dims = self.file.dims(name).unwrap_or_default();
        let mut axes: Vec<(&str, u64)> = dims.into_iter().zip(shape.iter().copied()).collect();
        while axes.len() > 2 {
            match axes.iter().position(|(_, length)| *length == 1) {
                Some(at) => drop(axes.remove(at)),
                None => break,
            }
        }
        let [(slow, slow_length), (fast, fast_length)] = axes[..] else {
            return Err(format!(
                "variable {name} has {} dimensions; [time, range] are needed",
                axes.len()
            ));
        };
        let stored = [slow_length, fast_length];
        let wanted = [self.rays as u64, self.gates as u64];
        let turned = [wanted[1], wanted[0]];
        let edges = [wanted[0], wanted[1].saturating_sub(1)];
        let turned_edges = [edges[1], edges[0]];
        match (stored == wanted, stored == turned) {
            (true, false) => Ok(false),
            (false, true) => Ok(true),
            (true, true) if self.rays == 1 => Ok(false),
            (true, true) => self.is_turned_by_name(name, [slow, fast]),
            (false, false) => {
                Err(self.other_lengths(name, &shape, stored == edges || turned_edges == stored))
            }
        }
    }

    /// What is said of a variable of other lengths; of one whose ranges may be those of `edges`.
    fn other_lengths(&self, name: &str, shape: &[u64], has_edges: bool) -> String {
        let lengths: Vec<String> = shape.iter().map(u64::to_string).collect();
        let hint = match has_edges {
            true => {
                "; ranges of the edges of gates are not read: those of their middles are needed"
            }
            false => "",
        };
        format!(
            "variable {name} is {}; {} rays x {} ranges are needed{hint}",
            lengths.join(" x "),
            self.rays,
            self.gates
        )
    }

    /// The same of a variable with as many rays as gates.
    fn is_turned_by_name(&self, name: &str, [slow, fast]: [&str; 2]) -> Result<bool, String> {
        let file = self.file;
        let is_along = |known, dim: &str| {
            let dims = variable::find(file, known).and_then(|own| file.dims(own));
            dims.is_some_and(|dims| dims == [dim])
        };
        let is_called = |names: &str, dim: &str| {
            let dim = dim.to_ascii_lowercase();
            names.split(' ').any(|name| name == dim)
        };
        let are_gates = [slow, fast].map(|dim| is_along(&RANGE, dim));
        let are_rays = [slow, fast].map(|dim| {
            let angles = [&ELEVATION, &ZENITH, &AZIMUTH, &TIME];
            angles.into_iter().any(|known| is_along(known, dim))
        });
        // A dimension of both, as plain HDF5 has it for equal lengths, is evidence of neither.
        let gates_alone = [0, 1].map(|at| are_gates[at] && !are_rays[at]);
        let rays_alone = [0, 1].map(|at| are_rays[at] && !are_gates[at]);
        let called_gates = [slow, fast].map(|dim| is_called(GATES, dim));
        let called_rays = [slow, fast].map(|dim| is_called(RAYS, dim));
        for (is_slow, is_fast, means_turned) in [
            (gates_alone[0], gates_alone[1], true),
            (rays_alone[0], rays_alone[1], false),
            (called_gates[0], called_gates[1], true),
            (called_rays[0], called_rays[1], false),
        ] {
            if is_slow != is_fast {
                return Ok(is_slow == means_turned);
            }
        }
        Err(format!(
            "variable {name} has as many rays as ranges, {}, and its dimensions {} and {} do not say which are which: the names of those of \
             elevation and range do",
            self.rays,
            quoted(slow),
            quoted(fast)
        ))
    }

    /// The values \[ray, gate\] of a variable, one ray after the other; NaN for gates that a ray does not have.
    ///
    /// # Errors
    /// Another number of values.
    pub(super) fn spread(&self, name: &str, values: Vec<f64>) -> Result<Vec<f64>, String> {
        let rays = self.rays;
        let gates = self.gates;
        let Some(ragged) = &self.ragged else {
            return match self.is_turned(name)? {
                true => Ok((0..rays * gates)
                    .map(|cell| values[cell % gates * rays + cell / gates])
                    .collect()),
                false => Ok(values),
            };
        };
        let mut out = vec![f64::NAN; rays * gates];
        for (ray, (start, count)) in ragged.iter().enumerate() {
            let own = values.get(*start..start + count);
            let own =
                own.ok_or_else(|| format!("variable {name} ends before the gates of ray {ray}"))?;
            out[ray * gates..ray * gates + count].copy_from_slice(own);
        }
        Ok(out)
    }

    /// The plain numbers of a variable, if it is there.
    ///
    /// # Errors
    /// As [`Self::spread`].
    pub(super) fn optional(&self, name: &str) -> Result<Option<Vec<f64>>, String> {
        match self.file.has(name) {
            true => self.spread(name, self.file.floats(name)?).map(Some),
            false => Ok(None),
        }
    }
}

/// Where rays of different numbers of gates begin, and their gates.
fn ragged(file: &NetcdfFile, rays: usize, gates: usize) -> Result<Vec<(usize, usize)>, String> {
    let starts = whole_numbers(file, "ray_start_index", rays)?;
    let counts = whole_numbers(file, "ray_n_gates", rays)?;
    let own: Vec<_> = starts.into_iter().zip(counts).collect();
    if let Some((_, count)) = own.iter().find(|(_, count)| *count > gates) {
        return Err(format!("a ray has {count} gates, range {gates} values"));
    }
    // Velocities, their standard deviations and ratios, and the lines of the map.
    machine::holds(
        &format!("{rays} rays x {gates} ranges"),
        40.0 * rays as f64 * gates as f64,
    )?;
    Ok(own)
}

/// Whole numbers of a variable, one for each ray.
fn whole_numbers(file: &NetcdfFile, name: &str, rays: usize) -> Result<Vec<usize>, String> {
    let values = file.floats(name)?;
    let bad = values.iter().any(|v| !(*v >= 0.0 && *v < 1e9));
    match bad || values.len() != rays {
        true => Err(format!("{name} must have a whole number for each ray")),
        false => Ok(values.into_iter().map(|v| v as usize).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::netcdf::{Data, Layout, Variable};
    use crate::io::netcdf_input::open;
    use crate::io::provenance::example;

    /// A file with these numbers of rays and gates, and the variable `v` over these dimensions.
    fn file(
        [rays, gates]: [usize; 2],
        along: &'static [&'static str],
        values: &[f64],
    ) -> NetcdfFile {
        let counted = |count: usize| Data::f64((0..count).map(|i| 10.0 + i as f64));
        let layout = Layout {
            dims: vec![
                ("time", rays),
                ("range", gates),
                ("one", 1),
                ("a", rays),
                ("b", gates),
                ("beam", rays),
            ],
            globals: Vec::new(),
            variables: vec![
                Variable::new("elevation", &["time"], counted(rays)),
                Variable::new("range", &["range"], counted(gates)),
                Variable::new("v", along, Data::f64(values.iter().copied())),
            ],
        };
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), layout.into_bytes(&example()).unwrap()).unwrap();
        open(file.path()).unwrap()
    }

    /// Cells by ray and gate, in the order of rays or of gates.
    fn cells([rays, gates]: [usize; 2], rays_first: bool) -> Vec<f64> {
        let cell = |ray: usize, gate: usize| (100 * ray + gate) as f64;
        (0..rays * gates)
            .map(|at| match rays_first {
                true => cell(at / gates, at % gates),
                false => cell(at % rays, at / rays),
            })
            .collect()
    }

    #[test]
    fn every_order_of_the_dimensions_gives_the_same_cells() {
        for (size, along, rays_first) in [
            ([4, 3], &["time", "range"][..], true),
            ([4, 3], &["range", "time"], false),
            ([4, 3], &["time", "range", "one"], true),
            ([4, 3], &["one", "range", "time"], false),
            ([4, 3], &["range", "one", "time"], false),
            ([4, 3], &["b", "a"], false),
            ([3, 3], &["time", "range"], true),
            ([3, 3], &["range", "time"], false),
            ([3, 3], &["a", "time"], false),
            ([3, 3], &["range", "a"], false),
            ([3, 3], &["b", "beam"], false),
            ([1, 3], &["range", "time"], false),
        ] {
            let file = file(size, along, &cells(size, rays_first));
            let layout = GateLayout::new(&file, "v", size).expect(along[0]);
            let found = layout.optional("v").unwrap().unwrap();
            assert_eq!(found, cells(size, true), "{along:?}");
        }
    }

    #[test]
    fn variables_of_other_lengths_and_squares_without_names_are_refused() {
        let refused = |size, along: &'static [&'static str]| {
            let file = file([3, 3], along, &[0.0; 9]);
            GateLayout::new(&file, "v", size).err().unwrap_or_default()
        };
        let square = refused([3, 3], &["a", "b"]);
        assert!(
            square.contains("as many rays as ranges, 3, and its dimensions \"a\" and \"b\""),
            "{square}"
        );
        let other = refused([4, 3], &["time", "range"]);
        assert!(other.contains("v is 3 x 3; 4 rays x 3 ranges"), "{other}");
        let edges = refused([3, 4], &["time", "range"]);
        assert!(edges.contains("ranges of the edges of gates"), "{edges}");
    }
}
