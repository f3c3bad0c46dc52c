//! The history of a wake: records as the run goes, as a table and as NetCDF, kept whole in every checkpoint.
//!
//! A run that is resumed takes its rows from the checkpoint, not from the files, so that these come out the same, byte for byte.
//!
//! Check: tests of `flow` interrupt runs and compare the bytes; rows against the record they came from.

use super::schedule::age_tau;
use crate::Error;
use crate::io::netcdf::{Data, Layout, Variable};
use crate::io::{Provenance, Table, write_atomic};
use std::ops::Range;
use std::path::Path;
use wakescope_les::analysis::{VortexRecord, WakeMeter, WakeRecord, WakeScales};
use wakescope_les::{Flow, Mesh};

/// What a number is.
#[derive(Debug)]
pub(super) struct NumberKind {
    /// The end of its name in tables.
    pub(super) suffix: &'static str,
    /// Its unit in NetCDF.
    udunits: &'static str,
    /// Whether a NetCDF variable has the end of the name, too: where it is no tag of column names.
    is_named: bool,
    /// Its unit in the scales of the pair; circulations in `Gamma0`.
    pub(super) unit: fn(&WakeScales) -> f64,
}

const LENGTH: &NumberKind = &NumberKind {
    suffix: "_m",
    udunits: "m",
    is_named: false,
    unit: |s| s.spacing_m,
};
const GAMMA: &NumberKind = &NumberKind {
    suffix: "_m2_s",
    udunits: "m2 s-1",
    is_named: false,
    unit: |s| s.circulation_m2_s,
};
/// The tag of 1/s in column names, which readers of tables know: `_per_s` would read as seconds.
const RATE: &NumberKind = &NumberKind {
    suffix: "_hz",
    udunits: "s-1",
    is_named: false,
    unit: |s| 1.0 / s.time_unit_s(),
};
const ENERGY: &NumberKind = &NumberKind {
    suffix: "_m4_s2",
    udunits: "m4 s-2",
    is_named: true,
    unit: |s| (s.spacing_m * s.descent_speed_m_s()).powi(2),
};
const ENSTROPHY: &NumberKind = &NumberKind {
    suffix: "_m2_s2",
    udunits: "m2 s-2",
    is_named: true,
    unit: |s| s.descent_speed_m_s() * s.descent_speed_m_s(),
};
const NUMBER: &NumberKind = &NumberKind {
    suffix: "",
    udunits: "1",
    is_named: false,
    unit: |_| 1.0,
};

/// Kinds whose names end in a unit; none of the ends is that of another.
pub(super) const SCALED: [&NumberKind; 5] = [LENGTH, GAMMA, RATE, ENERGY, ENSTROPHY];

type OfVortex = (
    &'static str,
    &'static NumberKind,
    &'static str,
    fn(&VortexRecord) -> f64,
);
type OfFlow = (
    &'static str,
    &'static NumberKind,
    &'static str,
    fn(&WakeRecord) -> f64,
);

/// Numbers of each vortex with what they are; the first is the one whose ratio to its start is given, too.
const VORTEX: [OfVortex; 12] = [
    // Name and text have the radii of the case.
    ("gamma", GAMMA, "circulation averaged over radii", |v| {
        v.gamma_5_15_m2_s
    }),
    (
        "y",
        LENGTH,
        "lateral position of the centroid of axial vorticity",
        |v| v.y_m,
    ),
    (
        "z",
        LENGTH,
        "height of the centroid of axial vorticity",
        |v| v.z_m,
    ),
    (
        "y_spread",
        LENGTH,
        "standard deviation along x of the lateral position",
        |v| v.y_spread_m,
    ),
    (
        "z_spread",
        LENGTH,
        "standard deviation along x of the height",
        |v| v.z_spread_m,
    ),
    (
        "gamma_opposite",
        GAMMA,
        "vorticity of the other sign on this side",
        |v| v.gamma_opposite_m2_s,
    ),
    (
        "secondary_gamma",
        GAMMA,
        "circulation of the secondary vortex",
        |v| v.secondary.gamma_m2_s,
    ),
    (
        "secondary_y",
        LENGTH,
        "lateral position of the secondary vortex",
        |v| v.secondary.y_m,
    ),
    (
        "secondary_z",
        LENGTH,
        "height of the secondary vortex",
        |v| v.secondary.z_m,
    ),
    (
        "secondary_y_spread",
        LENGTH,
        "standard deviation along x of its lateral position",
        |v| v.secondary.y_spread_m,
    ),
    (
        "secondary_z_spread",
        LENGTH,
        "standard deviation along x of its height",
        |v| v.secondary.z_spread_m,
    ),
    (
        "outward_shear",
        RATE,
        "least shear at the ground of the outward velocity",
        |v| v.outward_shear_per_s,
    ),
];
/// Numbers of the flow with what they are.
const FLOW: [OfFlow; 5] = [
    ("energy", ENERGY, "kinetic energy per length of x", |r| {
        r.energy_m4_s2
    }),
    (
        "energy_3d",
        ENERGY,
        "kinetic energy of all that varies along x, per length of x",
        |r| r.energy_3d_m4_s2(),
    ),
    (
        "enstrophy",
        ENSTROPHY,
        "half the integral of the squared vorticity, per length of x",
        |r| r.enstrophy_m2_s2,
    ),
    ("wall_shear", RATE, "largest shear at the ground", |r| {
        r.wall_shear_per_s
    }),
    (
        "wall_units",
        NUMBER,
        "height of the first centre in wall units of that shear",
        |r| r.wall_units,
    ),
];
const SIDES: [&str; 2] = ["left", "right"];
/// Axial modes as columns of the table and variables of the same names; the list in NetCDF has all.
const TABLE_MODES: usize = 8;
/// Files of the history.
const TABLE: &str = "wake.csv";
const NETCDF: &str = "wake.nc";

/// All of them.
pub(in super::super) const HISTORIES: [&str; 2] = [TABLE, NETCDF];

fn variable(
    name: &str,
    dims: &'static [&'static str],
    values: &[f64],
    units: &str,
    long_name: &str,
) -> Variable {
    Variable::new(name, dims, Data::f64_slice(values))
        .text("units", units)
        .text("long_name", long_name)
}

/// A number of all records.
struct HistoryColumn {
    name: String,
    kind: &'static NumberKind,
    /// What it is, in words.
    text: String,
    /// In SI units.
    values: Vec<f64>,
}

/// The meter of a wake with its scales, and what it has found.
pub(in super::super) struct WakeHistory {
    pub(in super::super) meter: WakeMeter,
    /// Radii between which the circulation is averaged \[m\].
    circulation_radii_m: [f64; 2],
    pub(in super::super) scales: WakeScales,
    /// Core radius at the start \[m\].
    pub(in super::super) core_radius_m: f64,
    radius_m: Vec<f64>,
    x_m: Vec<f64>,
    /// Rows of numbers in SI units.
    rows: Vec<Vec<f64>>,
}

impl WakeHistory {
    /// An empty history of a flow on a mesh.
    pub(super) fn new(
        meter: WakeMeter,
        circulation_radii_m: [f64; 2],
        scales: WakeScales,
        core_radius_m: f64,
        mesh: &Mesh,
    ) -> Self {
        Self {
            radius_m: meter.radii_m(),
            meter,
            circulation_radii_m,
            scales,
            core_radius_m,
            x_m: mesh.centre_m(0),
            rows: Vec::new(),
        }
    }

    /// Axial modes of a record.
    fn modes(&self) -> usize {
        self.x_m.len() / 2 + 1
    }

    /// Where the lists begin in a row: circulations, centres, modes, and its length.
    fn starts(&self) -> [usize; 4] {
        let gamma = 1 + 2 * VORTEX.len() + FLOW.len();
        let slices = gamma + 2 * self.radius_m.len();
        let modes = slices + 4 * self.x_m.len();
        [gamma, slices, modes, modes + self.modes()]
    }

    /// Takes back what [`Self::kept`] gave.
    pub(in super::super) fn restore(&mut self, bytes: &[u8]) -> Option<()> {
        let numbers: Vec<f64> = bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| f64::from_le_bytes(*b))
            .collect();
        let (state, rows) = numbers.split_first_chunk::<12>()?;
        let [.., length] = self.starts();
        if rows.len() % length != 0 || !bytes.len().is_multiple_of(8) {
            return None;
        }
        self.meter.restore(*state);
        self.rows = rows.chunks(length).map(<[f64]>::to_vec).collect();
        Some(())
    }

    /// What a checkpoint must keep.
    pub(in super::super) fn kept(&self) -> Vec<u8> {
        let state = self.meter.state();
        let mut bytes = Vec::new();
        for number in state.iter().chain(self.rows.iter().flatten()) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    /// Measures the flow, for which all ranks must ask together.
    pub(in super::super) fn record(&mut self, flow: &Flow) -> Result<(), Error> {
        let record = self.meter.measure(flow).map_err(Error::Flow)?;
        self.rows.push(row(&record));
        Ok(())
    }

    /// The numbers that tables have, those over their first value first.
    fn columns(&self) -> Vec<HistoryColumn> {
        let [from, to] = self.circulation_radii_m;
        let radii_tag = format!("_{from}_{to}").replace('.', "p");
        let radii = format!(" from {from:?} to {to:?} m");
        let mut out = Vec::new();
        for (side, which) in SIDES.iter().enumerate() {
            let mut values = self.column(1 + side * VORTEX.len());
            let first = values.first().copied().unwrap_or(f64::NAN);
            for value in &mut values {
                *value /= first;
            }
            out.push(HistoryColumn {
                name: format!("gamma_ratio_{which}"),
                kind: NUMBER,
                text: format!("{}{radii}, over its first value", VORTEX[0].2),
                values,
            });
        }
        for (side, which) in SIDES.iter().enumerate() {
            for (i, (name, kind, text, _)) in VORTEX.iter().enumerate() {
                let (tag, radii) = match i {
                    0 => (radii_tag.as_str(), radii.as_str()),
                    _ => ("", ""),
                };
                out.push(HistoryColumn {
                    name: format!("{name}{tag}_{which}"),
                    kind,
                    text: format!("{which} vortex: {text}{radii}"),
                    values: self.column(1 + side * VORTEX.len() + i),
                });
            }
        }
        for (i, (name, kind, text, _)) in FLOW.iter().enumerate() {
            out.push(HistoryColumn {
                name: (*name).into(),
                kind,
                text: (*text).into(),
                values: self.column(1 + 2 * VORTEX.len() + i),
            });
        }
        let [.., modes, _] = self.starts();
        for mode in 0..self.modes().min(TABLE_MODES + 1) {
            out.push(HistoryColumn {
                name: format!("energy_mode_{mode}"),
                kind: ENERGY,
                text: format!("kinetic energy of axial mode {mode}, per length of x"),
                values: self.column(modes + mode),
            });
        }
        out
    }

    fn column(&self, place: usize) -> Vec<f64> {
        self.rows.iter().map(|row| row[place]).collect()
    }

    fn tau(&self) -> Vec<f64> {
        let time_unit_s = self.scales.time_unit_s();
        self.rows
            .iter()
            .map(|row| age_tau(row[0], 1.0 / time_unit_s))
            .collect()
    }

    /// The history in SI units: the columns of which NetCDF has a variable each.
    fn table(&self) -> Table {
        let mut table = Table::new()
            .float("tau", self.tau())
            .float("time_s", self.column(0));
        for column in self.columns() {
            let name = format!("{}{}", column.name, column.kind.suffix);
            table = table.float(&name, column.values);
        }
        table
    }

    /// Writes the table of the history so far.
    pub(in super::super) fn write_table(
        &self,
        folder: &Path,
        origin: &Provenance,
    ) -> Result<(), Error> {
        write_atomic(&folder.join(TABLE), self.table().to_csv(origin)?)
    }

    /// Writes all files of the whole history.
    pub(in super::super) fn finish(&self, folder: &Path, origin: &Provenance) -> Result<(), Error> {
        self.write_table(folder, origin)?;
        write_atomic(&folder.join(NETCDF), self.netcdf(origin)?)
    }

    /// All columns of the table and all lists over their axes, in SI units.
    fn netcdf(&self, origin: &Provenance) -> Result<Vec<u8>, Error> {
        let mut variables = self.axis_variables();
        variables.extend(self.list_variables());
        for column in self.columns() {
            let name = if column.kind.is_named {
                format!("{}{}", column.name, column.kind.suffix)
            } else {
                column.name
            };
            let units = column.kind.udunits;
            let variable = variable(&name, &["tau"], &column.values, units, &column.text);
            variables.push(variable.text("coordinates", "time"));
        }
        let dims = vec![
            ("tau", self.rows.len()),
            ("vortex", 2),
            ("radius", self.radius_m.len()),
            ("x", self.x_m.len()),
            ("mode", self.modes()),
        ];
        let mut layout = Layout::cf("History of a simulated wake", dims, variables, origin);
        let scales = &self.scales;
        for (name, value) in [
            ("spacing_m", scales.spacing_m),
            ("circulation_m2_s", scales.circulation_m2_s),
        ] {
            layout.globals.push((name, format!("{value:?}")));
        }
        layout.into_bytes(origin)
    }

    /// Axes of the lists, with the times beside the ages.
    fn axis_variables(&self) -> Vec<Variable> {
        let modes: Vec<f64> = (0..self.modes()).map(|mode| mode as f64).collect();
        vec![
            variable(
                "tau",
                &["tau"],
                &self.tau(),
                "1",
                "age of the wake, t Gamma0 / (2 pi b0^2)",
            ),
            variable(
                "time",
                &["tau"],
                &self.column(0),
                "s",
                "time since the start of the flow",
            ),
            variable(
                "radius",
                &["radius"],
                &self.radius_m,
                "m",
                "radius of a circle about the centre of a vortex",
            ),
            variable(
                "x",
                &["x"],
                &self.x_m,
                "m",
                "position along the flight direction",
            ),
            variable(
                "vortex",
                &["vortex"],
                &[0.0, 1.0],
                "1",
                "0: began at smaller y; 1: at larger y",
            ),
            variable("mode", &["mode"], &modes, "1", "waves along x in the box"),
        ]
    }

    /// Lists over their axes.
    fn list_variables(&self) -> Vec<Variable> {
        let [gamma, slices, modes, end] = self.starts();
        let middle = slices + 2 * self.x_m.len();
        vec![
            variable(
                "gamma",
                &["tau", "vortex", "radius"],
                &self.lists(gamma..slices),
                "m2 s-1",
                "circulation of the flow averaged along x; NaN where the circle leaves the flow",
            ),
            variable(
                "y_centre",
                &["tau", "vortex", "x"],
                &self.lists(slices..middle),
                "m",
                "lateral position of the vortex",
            ),
            variable(
                "z_centre",
                &["tau", "vortex", "x"],
                &self.lists(middle..modes),
                "m",
                "height of the vortex",
            ),
            variable(
                "mode_energy",
                &["tau", "mode"],
                &self.lists(modes..end),
                "m4 s-2",
                "kinetic energy of an axial mode, per length of x",
            ),
        ]
    }

    /// These numbers of all records, one record after the other.
    fn lists(&self, numbers: Range<usize>) -> Vec<f64> {
        let mut lists = Vec::with_capacity(self.rows.len() * numbers.len());
        for row in &self.rows {
            lists.extend(&row[numbers.clone()]);
        }
        lists
    }
}

/// A record as a row of numbers in SI units.
fn row(record: &WakeRecord) -> Vec<f64> {
    let vortices = [&record.left, &record.right];
    let mut row = vec![record.time_s];
    row.extend(
        vortices
            .iter()
            .flat_map(|v| VORTEX.map(|(_, _, _, of)| of(v))),
    );
    row.extend(FLOW.map(|(_, _, _, of)| of(record)));
    row.extend(vortices.iter().flat_map(|v| v.gamma_m2_s.iter()));
    for c in 0..2 {
        row.extend(
            vortices
                .iter()
                .flat_map(|v| v.slices_m.iter().map(move |slice| slice[c])),
        );
    }
    row.extend(&record.mode_energy_m4_s2);
    row
}
