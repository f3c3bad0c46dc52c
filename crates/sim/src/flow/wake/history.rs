//! The history of a wake: records as the run goes, as a table and as NetCDF, kept whole in every checkpoint.
//!
//! A run that is resumed takes its rows from the checkpoint, not from the files, so that these come out the same, byte for byte.
//!
//! Check: tests of `flow` interrupt runs and compare the bytes; rows against the record they came from.

use crate::Error;
use crate::io::{Provenance, Table, write_atomic};
use std::path::PathBuf;
use wakescope_les::Flow;
use wakescope_les::analysis::{VortexRecord, WakeMeter, WakeRecord, WakeScales};

/// What a number is, for its unit and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Length,
    Gamma,
    Rate,
    Energy,
    Enstrophy,
    Number,
}

impl Kind {
    fn suffix(self) -> &'static str {
        match self {
            Self::Length => "_m",
            Self::Gamma => "_m2_s",
            // The tag of 1/s in column names, which readers of tables know: `_per_s` would read as seconds.
            Self::Rate => "_hz",
            Self::Energy => "_m4_s2",
            Self::Enstrophy => "_m2_s2",
            Self::Number => "",
        }
    }

    /// Its unit in NetCDF.
    #[cfg(feature = "netcdf")]
    fn udunits(self) -> &'static str {
        match self {
            Self::Length => "m",
            Self::Gamma => "m2 s-1",
            Self::Rate => "s-1",
            Self::Energy => "m4 s-2",
            Self::Enstrophy => "m2 s-2",
            Self::Number => "1",
        }
    }

    /// What its NetCDF variable is called: a unit that is no tag of column names stays in the name.
    #[cfg(feature = "netcdf")]
    fn variable(self, name: &str) -> String {
        match self {
            Self::Energy | Self::Enstrophy => format!("{name}{}", self.suffix()),
            _ => name.into(),
        }
    }

    /// Its unit in the scales of the pair; circulations in `Gamma0`.
    fn unit(self, scales: &WakeScales) -> f64 {
        let speed = scales.descent_speed_m_s();
        match self {
            Self::Length => scales.spacing_m,
            Self::Gamma => scales.circulation_m2_s,
            Self::Rate => 1.0 / scales.time_unit_s(),
            Self::Energy => (scales.spacing_m * speed).powi(2),
            Self::Enstrophy => speed * speed,
            Self::Number => 1.0,
        }
    }
}

type OfVortex = (&'static str, Kind, &'static str, fn(&VortexRecord) -> f64);
type OfFlow = (&'static str, Kind, &'static str, fn(&WakeRecord) -> f64);

/// Numbers of each vortex with what they are; the first is the one whose ratio to its start is given, too.
const VORTEX: [OfVortex; 12] = [
    // Name and text have the radii of the case.
    ("gamma", Kind::Gamma, "circulation averaged over radii", |v| v.gamma_5_15_m2_s),
    ("y", Kind::Length, "lateral position of the centroid of axial vorticity", |v| v.y_m),
    ("z", Kind::Length, "height of the centroid of axial vorticity", |v| v.z_m),
    ("y_spread", Kind::Length, "standard deviation along x of the lateral position", |v| v.y_spread_m),
    ("z_spread", Kind::Length, "standard deviation along x of the height", |v| v.z_spread_m),
    ("gamma_opposite", Kind::Gamma, "vorticity of the other sign on this side", |v| v.gamma_opposite_m2_s),
    ("secondary_gamma", Kind::Gamma, "circulation of the secondary vortex", |v| v.secondary.gamma_m2_s),
    ("secondary_y", Kind::Length, "lateral position of the secondary vortex", |v| v.secondary.y_m),
    ("secondary_z", Kind::Length, "height of the secondary vortex", |v| v.secondary.z_m),
    ("secondary_y_spread", Kind::Length, "standard deviation along x of its lateral position", |v| {
        v.secondary.y_spread_m
    }),
    ("secondary_z_spread", Kind::Length, "standard deviation along x of its height", |v| v.secondary.z_spread_m),
    ("outward_shear", Kind::Rate, "least shear at the ground of the outward velocity", |v| v.outward_shear_per_s),
];
/// Numbers of the flow with what they are.
const FLOW: [OfFlow; 5] = [
    ("energy", Kind::Energy, "kinetic energy per length of x", |r| r.energy_m4_s2),
    ("energy_3d", Kind::Energy, "kinetic energy of all that varies along x, per length of x", |r| r.energy_3d_m4_s2()),
    ("enstrophy", Kind::Enstrophy, "half the integral of the squared vorticity, per length of x", |r| {
        r.enstrophy_m2_s2
    }),
    ("wall_shear", Kind::Rate, "largest shear at the ground", |r| r.wall_shear_per_s),
    ("wall_units", Kind::Number, "height of the first centre in wall units of that shear", |r| r.wall_units),
];
const SIDES: [&str; 2] = ["left", "right"];
/// Axial modes as columns of the table and variables of the same names; the list in NetCDF has all.
const TABLE_MODES: usize = 8;
/// Files of the history.
const TABLE: &str = "wake.csv";
const SCALED_TABLE: &str = "wake_scaled.csv";
#[cfg(feature = "netcdf")]
const NETCDF: &str = "wake.nc";

/// Names of the files of a history.
pub(in super::super) fn file_names() -> Vec<&'static str> {
    vec![
        TABLE,
        SCALED_TABLE,
        #[cfg(feature = "netcdf")]
        NETCDF,
    ]
}

/// One number of a record.
struct Single {
    name: String,
    kind: Kind,
    /// What it is, in words.
    #[cfg_attr(not(feature = "netcdf"), allow(dead_code))]
    text: String,
    /// Its place in a row.
    place: usize,
}

/// Lengths of the lists of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lengths {
    radii: usize,
    slices: usize,
    modes: usize,
}

impl Lengths {
    /// Where the lists begin in a row: circulations, centres, modes, and its length.
    fn starts(self) -> [usize; 4] {
        let gamma = 1 + 2 * VORTEX.len() + FLOW.len();
        let slices = gamma + 2 * self.radii;
        let modes = slices + 4 * self.slices;
        [gamma, slices, modes, modes + self.modes]
    }
}

/// The meter of a run, what it has found, and its files.
#[derive(Debug)]
pub(in super::super) struct WakeRun {
    meter: WakeMeter,
    scales: WakeScales,
    /// Between which the circulation of a vortex is averaged.
    circulation_radii_m: [f64; 2],
    #[cfg_attr(not(feature = "netcdf"), allow(dead_code))]
    radius_m: Vec<f64>,
    lengths: Lengths,
    #[cfg(feature = "netcdf")]
    x_m: Vec<f64>,
    /// Rows of numbers in SI units.
    rows: Vec<Vec<f64>>,
    folder: PathBuf,
    origin: Provenance,
    /// Of several ranks, which measure together, the first one writes.
    writes: bool,
}

impl WakeRun {
    /// An empty history of flows on the mesh of `flow`.
    pub(in super::super) fn new(
        (meter, circulation_radii_m): (WakeMeter, [f64; 2]),
        flow: &Flow,
        (folder, origin): (PathBuf, Provenance),
        writes: bool,
    ) -> Self {
        let (scales, radius_m, x_m) = (*meter.scales(), meter.radii_m(), flow.mesh().centre_m(0));
        let lengths = Lengths { radii: radius_m.len(), slices: x_m.len(), modes: x_m.len() / 2 + 1 };
        Self {
            meter,
            scales,
            circulation_radii_m,
            radius_m,
            lengths,
            #[cfg(feature = "netcdf")]
            x_m,
            rows: Vec::new(),
            folder,
            origin,
            writes,
        }
    }

    /// Takes back what [`Self::kept`] gave.
    pub(in super::super) fn restore(&mut self, bytes: &[u8]) -> Option<()> {
        let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let (state, rows) = numbers.split_first_chunk::<12>()?;
        let [.., length] = self.lengths.starts();
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
        state.iter().chain(self.rows.iter().flatten()).flat_map(|x| x.to_le_bytes()).collect()
    }

    /// Measures the flow, for which all ranks must ask together, and writes the table anew.
    pub(in super::super) fn record(&mut self, flow: &Flow) -> Result<(), Error> {
        let record = self.meter.measure(flow).map_err(Error::Flow)?;
        let row = self.row(&record);
        self.rows.push(row);
        if self.writes { self.write_table() } else { Ok(()) }
    }

    /// The files of the history.
    pub(in super::super) fn paths(&self) -> Vec<PathBuf> {
        file_names().into_iter().map(|name| self.folder.join(name)).collect()
    }

    /// Writes the files of the whole history.
    pub(in super::super) fn finish(&self) -> Result<(), Error> {
        if !self.writes {
            return Ok(());
        }
        self.write_table()?;
        #[cfg(feature = "netcdf")]
        write_atomic(&self.folder.join(NETCDF), self.netcdf()?)?;
        Ok(())
    }

    fn row(&self, record: &WakeRecord) -> Vec<f64> {
        let vortices = [&record.left, &record.right];
        let mut row = vec![record.time_s];
        row.extend(vortices.iter().flat_map(|v| VORTEX.map(|(_, _, _, of)| of(v))));
        row.extend(FLOW.map(|(_, _, _, of)| of(record)));
        row.extend(vortices.iter().flat_map(|v| v.gamma_m2_s.iter()));
        for c in 0..2 {
            row.extend(vortices.iter().flat_map(|v| v.slices_m.iter().map(move |slice| slice[c])));
        }
        row.extend(&record.mode_energy_m4_s2);
        row
    }

    /// The single numbers.
    fn singles(&self) -> Vec<Single> {
        let [from, to] = self.circulation_radii_m;
        let of_vortex = |side: usize| {
            VORTEX.iter().enumerate().map(move |(i, (name, kind, text, _))| {
                let (radii, text) = match i {
                    0 => (format!("_{from}_{to}").replace('.', "p"), format!("{text} from {from:?} to {to:?} m")),
                    _ => (String::new(), (*text).to_owned()),
                };
                Single {
                    name: format!("{name}{radii}_{}", SIDES[side]),
                    kind: *kind,
                    text: format!("{} vortex: {text}", SIDES[side]),
                    place: 1 + side * VORTEX.len() + i,
                }
            })
        };
        let of_flow = FLOW.iter().enumerate().map(|(i, (name, kind, text, _))| Single {
            name: (*name).into(),
            kind: *kind,
            text: (*text).into(),
            place: 1 + 2 * VORTEX.len() + i,
        });
        of_vortex(0).chain(of_vortex(1)).chain(of_flow).collect()
    }

    fn column(&self, place: usize, unit: f64) -> Vec<f64> {
        self.rows.iter().map(|row| row[place] / unit).collect()
    }

    fn tau(&self) -> Vec<f64> {
        let time_unit_s = self.scales.time_unit_s();
        self.rows.iter().map(|row| super::super::age_tau(row[0], 1.0 / time_unit_s)).collect()
    }

    /// Circulation of each vortex over its first value.
    fn gamma_ratios(&self) -> [(String, Vec<f64>); 2] {
        [0, 1].map(|side| {
            let gamma = self.column(1 + side * VORTEX.len(), 1.0);
            let first = gamma.first().copied().unwrap_or(f64::NAN);
            (format!("gamma_ratio_{}", SIDES[side]), gamma.iter().map(|g| g / first).collect())
        })
    }

    /// Names and energies of the axial modes that the tables have, in a unit.
    fn modes(&self, suffix: &str, unit: f64) -> Vec<(String, Vec<f64>)> {
        let [.., modes, _] = self.lengths.starts();
        let shown = self.lengths.modes.min(TABLE_MODES + 1);
        (0..shown).map(|mode| (format!("energy_mode_{mode}{suffix}"), self.column(modes + mode, unit))).collect()
    }

    /// The history in SI units: the columns of which NetCDF has a variable each.
    fn table(&self) -> Table {
        let mut table = Table::new().float("tau", self.tau()).float("time_s", self.column(0, 1.0));
        for (name, values) in self.gamma_ratios() {
            table = table.float(&name, values);
        }
        for single in self.singles() {
            table = table.float(&format!("{}{}", single.name, single.kind.suffix()), self.column(single.place, 1.0));
        }
        self.modes(Kind::Energy.suffix(), 1.0)
            .into_iter()
            .fold(table, |table, (name, values)| table.float(&name, values))
    }

    /// The history in the scales of the pair, circulations in `Gamma0`.
    fn scaled_table(&self) -> Table {
        let mut table = Table::new().float("tau", self.tau());
        for single in self.singles() {
            table = table.float(&single.name, self.column(single.place, single.kind.unit(&self.scales)));
        }
        let energy = Kind::Energy.unit(&self.scales);
        self.modes("", energy).into_iter().fold(table, |table, (name, values)| table.float(&name, values))
    }

    fn write_table(&self) -> Result<(), Error> {
        write_atomic(&self.folder.join(TABLE), self.table().to_csv(&self.origin)?)?;
        Ok(write_atomic(&self.folder.join(SCALED_TABLE), self.scaled_table().to_csv(&self.origin)?)?)
    }

    /// All columns of the table and all lists over their axes, in SI units.
    #[cfg(feature = "netcdf")]
    fn netcdf(&self) -> Result<Vec<u8>, Error> {
        use crate::io::netcdf::{Data, Layout, Variable};
        let [gamma, slices, modes, end] = self.lengths.starts();
        let part =
            |from: usize, to: usize| self.rows.iter().flat_map(|row| row[from..to].to_vec()).collect::<Vec<f64>>();
        let lists = |name: &str, dims: &'static [&'static str], values: Vec<f64>, units: &str, long_name: &str| {
            Variable::new(name, dims, Data::F64(values)).text("units", units).text("long_name", long_name)
        };
        let middle = slices + 2 * self.lengths.slices;
        let mut variables = vec![
            lists("tau", &["tau"], self.tau(), "1", "age of the wake, t Gamma0 / (2 pi b0^2)"),
            lists("time", &["tau"], self.column(0, 1.0), "s", "time since the start of the flow"),
            lists("radius", &["radius"], self.radius_m.clone(), "m", "radius of a circle about the centre of a vortex"),
            lists("x", &["x"], self.x_m.clone(), "m", "position along the flight direction"),
            lists("vortex", &["vortex"], vec![0.0, 1.0], "1", "0: began at smaller y; 1: at larger y"),
            lists(
                "mode",
                &["mode"],
                (0..self.lengths.modes).map(|m| m as f64).collect(),
                "1",
                "waves along x in the box",
            ),
            lists(
                "gamma",
                &["tau", "vortex", "radius"],
                part(gamma, slices),
                "m2 s-1",
                "circulation of the flow averaged along x; NaN where the circle leaves the flow",
            ),
            lists("y_centre", &["tau", "vortex", "x"], part(slices, middle), "m", "lateral position of the vortex"),
            lists("z_centre", &["tau", "vortex", "x"], part(middle, modes), "m", "height of the vortex"),
            lists(
                "mode_energy",
                &["tau", "mode"],
                part(modes, end),
                "m4 s-2",
                "kinetic energy of an axial mode, per length of x",
            ),
        ];
        variables.extend(self.series());
        let dims = vec![
            ("tau", self.rows.len()),
            ("vortex", 2),
            ("radius", self.radius_m.len()),
            ("x", self.x_m.len()),
            ("mode", self.lengths.modes),
        ];
        let globals = vec![
            ("Conventions", "CF-1.10".into()),
            ("title", "History of a simulated wake".into()),
            ("history", format!("written by {}", self.origin.program)),
            ("spacing_m", format!("{:?}", self.scales.spacing_m)),
            ("circulation_m2_s", format!("{:?}", self.scales.circulation_m2_s)),
        ];
        Ok(Layout { dims, globals, variables }.into_bytes(&self.origin)?)
    }

    /// The columns of the table over `tau`.
    #[cfg(feature = "netcdf")]
    fn series(&self) -> Vec<crate::io::netcdf::Variable> {
        use crate::io::netcdf::{Data, Variable};
        let variable = |name: &str, values: Vec<f64>, units: &str, long_name: &str| {
            Variable::new(name, &["tau"], Data::F64(values))
                .text("units", units)
                .text("long_name", long_name)
                .text("coordinates", "time")
        };
        let [from, to] = self.circulation_radii_m;
        let ratio_text = format!("{} from {from:?} to {to:?} m", VORTEX[0].2);
        let ratio = |(name, values): (String, Vec<f64>)| {
            variable(&name, values, "1", &format!("{ratio_text}, over its first value"))
        };
        let mut out: Vec<Variable> = self.gamma_ratios().into_iter().map(ratio).collect();
        for single in self.singles() {
            let (name, units) = (single.kind.variable(&single.name), single.kind.udunits());
            out.push(variable(&name, self.column(single.place, 1.0), units, &single.text));
        }
        for (mode, (name, values)) in self.modes(Kind::Energy.suffix(), 1.0).into_iter().enumerate() {
            let text = format!("kinetic energy of axial mode {mode}, per length of x");
            out.push(variable(&name, values, Kind::Energy.udunits(), &text));
        }
        out
    }
}
