//! The wake of an aircraft as a flow: its case, its presets, what is measured and written while it runs.
//!
//! Geometry and noise are in the units of the pair, lengths `b0` and velocities `V0 = Gamma0/(2 pi b0)`; the pair itself, wind
//! and all files are in SI units.
//!
//! Check: presets are those of the solver; tests of `flow` interrupt runs and compare the bytes.

mod history;
mod schedule;

pub(super) use history::{WakeRun, file_names};
pub(super) use schedule::{Due, Schedule};

use super::case::{CaseKind, Checkpoint, FORMAT, FileFormat, FlowCase, Output, Problems, Solver, Subgrid, Time};
use super::setup::{Setup, WakeSetup};
use crate::Error;
use crate::scene::section;
use serde::{Deserialize, Serialize};
use wakescope_les::analysis::WakeScales;
use wakescope_les::cases::{Case, VortexPairCase};
use wakescope_les::winds::Aircraft;
use wakescope_les::{CirculationProfile, SubgridModel};

/// Longest step, in `tau`.
const LONGEST_STEP: f64 = 0.01;

/// Ready-made wakes, from the quickest to the dearest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum WakePreset {
    /// 24 x 128 x 80 cells, `Re_Gamma` 5000, no subgrid model: minutes.
    Coarse,
    /// 48 x 240 x 128 cells, `Re_Gamma` 5000, no subgrid model: about an hour.
    Medium,
    /// `Re_Gamma` 20000, core 0.05 `b0`, multiscale model, 64 x 256 x 144 cells: hours.
    Fine,
    /// The same flow with walls resolved, 128 x 432 x 224 cells: days.
    Chapter,
}

impl WakePreset {
    /// The case as the solver has it.
    pub fn pair(self) -> VortexPairCase {
        match self {
            Self::Coarse => VortexPairCase::coarse(),
            Self::Medium => VortexPairCase::medium(),
            Self::Fine => VortexPairCase::fine(),
            Self::Chapter => VortexPairCase::chapter(),
        }
    }

    /// The case with all that is written.
    pub fn case(self) -> FlowCase {
        let pair = self.pair();
        let multiscale = pair.subgrid == SubgridModel::MULTISCALE_WALE;
        let subgrid =
            if multiscale { Subgrid::MultiscaleWale { constant: None, order: None } } else { Subgrid::None {} };
        let format = if cfg!(feature = "netcdf") { FileFormat::Netcdf } else { FileFormat::Csv };
        let flow = WakeFlow {
            cells: pair.cells,
            size: pair.size,
            ground_stretch: pair.ground_stretch,
            lateral_stretch: pair.lateral_stretch,
            height: pair.height,
            core_radius: pair.core_radius,
            reynolds: pair.reynolds,
            perturbation: pair.perturbation,
            ..WakeFlow::default()
        };
        FlowCase {
            format: FORMAT,
            case: CaseKind::Wake(Box::new(flow)),
            time: Time::default(),
            solver: Solver { subgrid, ..Solver::default() },
            output: Output { fields: vec![format], planes: vec![format], ..Output::default() },
            checkpoint: Checkpoint::default(),
            wake: Some(WakeOutput::default()),
        }
    }
}

/// Circulation against radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WakeProfile {
    /// `Gamma0 r^2/(r^2 + r_c^2)`, (3).
    Algebraic,
    /// Lamb and Oseen's.
    LambOseen,
    /// A viscous core inside a broad distribution over the span `4 b0/pi`.
    TwoScale,
}

/// Spacing and circulation of the pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "from", rename_all = "snake_case", deny_unknown_fields)]
pub enum PairScale {
    /// As given.
    Circulation {
        /// Distance `b0` between the vortices \[m\].
        spacing_m: f64,
        /// Circulation `Gamma0` of each \[m^2/s\].
        circulation_m2_s: f64,
    },
    /// From mass, speed and span, (5).
    Aircraft {
        /// Mass \[kg\].
        mass_kg: f64,
        /// Flight speed \[m/s\].
        speed_m_s: f64,
        /// Wing span \[m\].
        span_m: f64,
        /// Density of the air \[kg/m^3\].
        air_density_kg_m3: f64,
    },
    /// An A320 at landing.
    A320 {},
    /// An A340-300 at landing.
    A340 {},
    /// A B747-400 at landing.
    B747 {},
    /// An A380-800 at landing.
    A380 {},
}

impl PairScale {
    /// The scales.
    ///
    /// # Errors
    /// What is not positive.
    pub fn scales(self) -> Result<WakeScales, wakescope_les::Error> {
        let of = |aircraft: &Aircraft| WakeScales::of_aircraft(aircraft);
        match self {
            Self::Circulation { spacing_m, circulation_m2_s } => Ok(WakeScales { spacing_m, circulation_m2_s }),
            Self::Aircraft { mass_kg, speed_m_s, span_m, air_density_kg_m3 } => {
                of(&Aircraft { mass_kg, speed_m_s, span_m, air_density_kg_m3 })
            }
            Self::A320 {} => of(&Aircraft::A320),
            Self::A340 {} => of(&Aircraft::A340_300),
            Self::B747 {} => of(&Aircraft::B747_400),
            Self::A380 {} => of(&Aircraft::A380_800),
        }
    }
}

section! {
    /// The wake of an aircraft near the ground. Lengths without a unit are in `b0`, velocities in `V0`. Defaults: `coarse`.
    WakeFlow {
        /// Spacing and circulation.
        pair: PairScale = PairScale::Circulation { spacing_m: 47.0, circulation_m2_s: 500.0 },
        /// Cells along x (1 for a plane flow), y, z.
        cells: [usize; 3] = [24, 128, 80],
        /// Length, width and height of the box.
        size: [f64; 3] = [1.0, 4.0, 2.5],
        /// Strength of the refinement towards the ground; 0 for equal cells.
        ground_stretch: f64 = 1.5,
        /// Refinement towards the middle of y, 0 to 0.9: cells are `1 - a` of the mean there, `1 + a` at the sides.
        lateral_stretch: f64 = 0.0,
        /// Height of both vortices.
        height: f64 = 1.0,
        /// Core radius.
        core_radius: f64 = 0.1,
        /// Circulation against radius.
        profile: WakeProfile = WakeProfile::Algebraic,
        /// `Gamma0/nu`.
        reynolds: f64 = 5000.0,
        /// The ground: no-slip if true, else a frictionless plane.
        sticky_ground: bool = true,
        /// Whether the sides are frictionless planes instead of periodic.
        slip_sides: bool = false,
        /// Root-mean-square of each component of the noise within 0.3 of the vortices.
        perturbation: f64 = 0.01,
        /// Seed of noise and background; without one the noise is a closed formula.
        #[serde(skip_serializing_if = "Option::is_none")]
        seed: Option<u64> = None,
        /// Root-mean-square of each component of turbulence that fills the box.
        background: f64 = 0.0,
        /// Cross wind at the height of the vortices \[m/s\].
        cross_wind_m_s: f64 = 0.0,
        /// Roughness length of a logarithmic wind \[m\]; 0 for the same wind at all heights.
        wind_roughness_m: f64 = 0.0,
        /// Radii between which `Gamma_5-15` is averaged \[m\].
        circulation_radii_m: [f64; 2] = [5.0, 15.0],
    }
}

section! {
    /// What is measured and written of a wake, by its age `tau`.
    WakeOutput {
        /// Age at which the run ends.
        end_tau: f64 = 5.0,
        /// Time between rows of `wake.csv`, and between the records of `wake.nc`.
        every_tau: f64 = 0.05,
        /// Ages of whole fields; 0.5, the whole numbers and the end if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        fields_tau: Option<Vec<f64>> = None,
        /// Ages of cross-planes; half the end and the end if absent.
        #[serde(skip_serializing_if = "Option::is_none")]
        planes_tau: Option<Vec<f64>> = None,
        /// First and last age of a series of cross-planes, for scans during which the flow moves.
        #[serde(skip_serializing_if = "Option::is_none")]
        series_tau: Option<[f64; 2]> = None,
        /// Time between the planes of the series.
        series_every_tau: f64 = 0.02,
        /// Positions of the planes along the flight, in `b0`.
        planes_x: Vec<f64> = vec![0.5],
    }
}

impl WakeFlow {
    pub(super) fn check(&self, p: &mut Problems) {
        p.cells("case.cells", &self.cells);
        let ok = self.size.iter().all(|l| l.is_finite() && *l > 0.0);
        p.require(ok, "case.size", self.size, "three finite numbers above 0");
        p.stretch("case.ground_stretch", self.ground_stretch);
        let a = self.lateral_stretch;
        p.require((0.0..=0.9).contains(&a), "case.lateral_stretch", a, "a number from 0 to 0.9");
        let height = self.height;
        p.require(height > 0.0 && height < self.size[2], "case.height", height, "above 0 and below the top");
        p.positive("case.core_radius", self.core_radius);
        p.positive("case.reynolds", self.reynolds);
        p.not_negative("case.perturbation", self.perturbation);
        p.not_negative("case.background", self.background);
        p.not_negative("case.wind_roughness_m", self.wind_roughness_m);
        let open = !self.slip_sides;
        let still = self.cross_wind_m_s == 0.0;
        let wind = self.cross_wind_m_s.is_finite() && (still || open);
        p.require(wind, "case.cross_wind_m_s", self.cross_wind_m_s, "finite, and 0 between frictionless sides");
        let [from, to] = self.circulation_radii_m;
        let radii = from > 0.0 && to > from && to.is_finite();
        p.require(radii, "case.circulation_radii_m", self.circulation_radii_m, "two numbers above 0 that increase");
        if let Err(error) = self.pair.scales().and_then(|scales| scales.validate()) {
            p.require(false, "case.pair", self.pair, &error.to_string());
        }
    }

    /// The case of the solver.
    ///
    /// # Errors
    /// What the solver refuses.
    pub fn pair_case(&self) -> Result<VortexPairCase, wakescope_les::Error> {
        let scales = self.pair.scales()?;
        let pair = VortexPairCase {
            cells: self.cells,
            size: self.size,
            ground_stretch: self.ground_stretch,
            lateral_stretch: self.lateral_stretch,
            height: self.height,
            core_radius: self.core_radius,
            profile: match self.profile {
                WakeProfile::LambOseen => CirculationProfile::LambOseen,
                WakeProfile::Algebraic | WakeProfile::TwoScale => CirculationProfile::Algebraic,
            },
            reynolds: self.reynolds,
            sticky_ground: self.sticky_ground,
            slip_sides: self.slip_sides,
            perturbation: self.perturbation,
            seed: self.seed,
            background: self.background,
            cross_wind: self.cross_wind_m_s / scales.descent_speed_m_s(),
            wind_roughness: self.wind_roughness_m / scales.spacing_m,
            ..VortexPairCase::coarse()
        };
        if self.profile == WakeProfile::TwoScale { pair.with_two_scales() } else { Ok(pair) }
    }

    pub(super) fn setup(&self) -> Result<Setup, Error> {
        let scales = self.pair.scales().map_err(Error::Flow)?;
        let pair = self.pair_case().map_err(Error::Flow)?;
        let unit_s = scales.time_unit_s();
        let window = self.circulation_radii_m.map(|r| r / scales.spacing_m);
        let meter = pair.meter(&scales).and_then(|meter| meter.with_window(window)).map_err(Error::Flow)?;
        let Case { mesh, settings, initial, end_s } =
            pair.scaled(&scales, VortexPairCase::steps(LONGEST_STEP * unit_s)).map_err(Error::Flow)?;
        let wake = Some(WakeSetup { meter, scales });
        Ok(Setup { mesh, settings, initial, end_s: Some(end_s), tau_per_s: 1.0 / unit_s, wake, undamped: None })
    }
}

/// Most whole ages at which fields are written where a case states none.
const WHOLE_AGES: usize = 100;

impl WakeOutput {
    /// Writes the lists out that follow from the end where the case does not have them.
    pub(super) fn complete(&mut self) {
        let end = self.end_tau;
        if !end.is_finite() || end <= 0.0 {
            return;
        }
        self.fields_tau.get_or_insert_with(|| {
            let whole = (1..=WHOLE_AGES).map(|tau| tau as f64);
            let ages = std::iter::once(0.5).chain(whole).take_while(|tau| *tau < end);
            ages.chain(std::iter::once(end)).collect()
        });
        self.planes_tau.get_or_insert_with(|| vec![0.5 * end, end]);
    }

    /// Ends at another age: lists that followed from the old end follow the new one, others lose what lies behind it.
    pub(super) fn end_at(&mut self, end_tau: f64) {
        let mut own = Self { fields_tau: None, planes_tau: None, ..self.clone() };
        own.complete();
        let kept = |list: &Option<Vec<f64>>, own: &Option<Vec<f64>>| {
            let list = list.as_ref().filter(|_| list != own)?;
            Some(list.iter().copied().filter(|tau| *tau <= end_tau).collect())
        };
        (self.fields_tau, self.planes_tau) =
            (kept(&self.fields_tau, &own.fields_tau), kept(&self.planes_tau, &own.planes_tau));
        self.series_tau = self.series_tau.map(|[from, to]| [from, to.min(end_tau)]).filter(|[from, to]| to > from);
        self.end_tau = end_tau;
        self.complete();
    }

    pub(super) fn check(&self, p: &mut Problems) {
        p.positive("wake.end_tau", self.end_tau);
        p.positive("wake.every_tau", self.every_tau);
        p.positive("wake.series_every_tau", self.series_every_tau);
        let end = self.end_tau;
        let within =
            |list: &[f64]| list.windows(2).all(|w| w[1] > w[0]) && list.iter().all(|tau| (0.0..=end).contains(tau));
        for (key, list) in [("wake.fields_tau", &self.fields_tau), ("wake.planes_tau", &self.planes_tau)] {
            let list = list.as_deref().unwrap_or_default();
            p.require(within(list), key, list, "increasing, from 0 to wake.end_tau");
        }
        if let Some(range) = self.series_tau {
            p.require(within(&range), "wake.series_tau", range, "two ages that increase, from 0 to wake.end_tau");
        }
        p.require(self.planes_x.iter().all(|x| x.is_finite()), "wake.planes_x", &self.planes_x, "finite");
    }
}
