//! What a retrieval finds in one scan: none, one or two vortices with their errors, and what to think of them.

use ndarray::Array2;

use crate::Measured;
use crate::retrieval::{ScanMap, ScanTurbulence};
use crate::vortex_fit::map_fit::data::nearest_index;
use crate::vortex_fit::tolerances::{CERTAIN_SIGMAS, COMPETES};
use crate::vortex_fit::wake::motion::Motion;
use crate::vortex_fit::{PARAMETERS, Parameter, Top, Wake, WakeModel};

impl Measured {
    /// A parameter of a wake with that covariance \[10, 10\].
    #[must_use]
    pub fn of_wake(parameter: Parameter, wake: &Wake, covariance: &Array2<f64>) -> Self {
        let place = parameter as usize;
        Self {
            value: wake.to_array()[place],
            std: covariance[[place, place]].sqrt(),
        }
    }
}

/// Which of the two vortices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "snake_case")
)]
pub enum Side {
    /// The one at smaller y, clockwise.
    Left,
    /// The one at larger y, anticlockwise.
    Right,
}

impl Side {
    /// Left before right.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Circulation, lateral coordinate, height and core radius of the vortex of that side.
    #[must_use]
    pub fn parameters(self) -> [Parameter; 4] {
        use Parameter::*;
        match self {
            Self::Left => [LeftCirculation, LeftLateral, LeftHeight, LeftCore],
            Self::Right => [RightCirculation, RightLateral, RightHeight, RightCore],
        }
    }
}

/// One vortex of a scan, where it is when the line through its core is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VortexResult {
    /// Which one.
    pub side: Side,
    /// Time of the core's line \[s\], of the origin of the map's times; NaN if they are unknown.
    pub time_s: f64,
    /// Circulation \[m^2/s\].
    pub circulation_m2_s: Measured,
    /// Its mean over radii of 5 to 15 m \[m^2/s\]. Its standard deviation follows from the covariance of the fit: noise, the
    /// correlation of neighbours, the core; and from other minima: the other profile and, for long gates, other spacings.
    pub circulation_5_15_m2_s: Measured,
    /// Lateral coordinate of the centre \[m\].
    pub lateral_position_m: Measured,
    /// Height of the centre \[m\].
    pub height_m: Measured,
    /// Core radius \[m\]; nothing if it was not fitted.
    pub core_radius_m: Option<Measured>,
}

impl VortexResult {
    /// Lateral coordinate and height of the centre \[m\].
    #[must_use]
    pub fn place_m(&self) -> (f64, f64) {
        (self.lateral_position_m.value, self.height_m.value)
    }

    /// Whether the circulation is positive beyond doubt.
    pub(crate) fn is_certain(&self) -> bool {
        self.circulation_m2_s.value > CERTAIN_SIGMAS * self.circulation_m2_s.std
    }

    /// A vortex of a wake, given with its covariance \[10, 10\] for the middle of the scan, when the line through its core is measured.
    /// A core without variance was not fitted.
    #[must_use]
    pub fn at_its_line(
        map: &ScanMap,
        model: &WakeModel,
        (wake, covariance): (&Wake, &Array2<f64>),
        side: Side,
        moves: bool,
    ) -> Self {
        let [circulation, lateral, height, core] =
            side.parameters().map(|parameter| parameter as usize);
        let motion = moves.then(|| Motion::new(model, wake));
        let motion = motion.as_ref();
        let reference_s = map.middle_s();
        let mut seconds = 0.0;
        // the line is that of the place then
        for _ in 0..4 {
            let p = parameters_after(motion, wake, seconds);
            let (_, elevation_rad) = model.range_and_elevation((p[lateral], p[height]));
            let nearest = nearest_index(&map.elevation_rad, elevation_rad);
            seconds = nearest.map_or(f64::NAN, |line| map.time_s[line] - reference_s);
        }
        let then = parameters_after(motion, wake, seconds);
        let [
            circulation_m2_s,
            lateral_position_m,
            height_m,
            core_radius_m,
        ] = [circulation, lateral, height, core].map(|parameter| Measured {
            value: then[parameter],
            std: std_after(motion, seconds, parameter, covariance),
        });
        let [left, right] = wake.mean_circulations_5_15_m2_s(model.profile, covariance.view());
        let (value, std) = if side == Side::Left { left } else { right };
        Self {
            side,
            time_s: reference_s + seconds,
            circulation_m2_s,
            circulation_5_15_m2_s: Measured { value, std },
            lateral_position_m,
            height_m,
            core_radius_m: (covariance[[core, core]] > 0.0).then_some(core_radius_m),
        }
    }
}

/// Parameters of a wake `seconds` after its reference time; without a motion those of the reference time.
fn parameters_after(motion: Option<&Motion>, wake: &Wake, seconds: f64) -> [f64; PARAMETERS] {
    motion
        .map_or(*wake, |motion| motion.wake_after(wake, seconds))
        .to_array()
}

/// Standard deviation of a parameter `seconds` after the reference time, from the covariance \[10, 10\] at that time.
fn std_after(
    motion: Option<&Motion>,
    seconds: f64,
    parameter: usize,
    covariance: &Array2<f64>,
) -> f64 {
    let mut slope = [0.0; PARAMETERS];
    slope[parameter] = 1.0;
    if let Some(motion) = motion {
        motion.carry_back(seconds, &mut slope);
    }
    let terms = covariance
        .indexed_iter()
        .map(|((i, j), c)| slope[i] * c * slope[j]);
    terms.sum::<f64>().max(0.0).sqrt()
}

/// What to think of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "snake_case")
)]
pub enum Flag {
    /// No wake was found.
    NoWake,
    /// The vortices that explain the scan best are none of an aircraft, or the scan does not resolve them.
    Implausible,
    /// A wake was found, but a circulation is less than three of its deviations, or nothing is known of the vortices.
    Uncertain,
    /// One vortex only is in view.
    OneVortex,
    /// The core radius is not of this scan.
    CoreKept,
    /// A vortex is so near the end of the sector that one of its sides is not seen.
    AtEdge,
    /// A vortex is lower than half the spacing, where the ground makes secondary vortices.
    NearGround,
    /// The scan shows secondary vortices beside the pair; whether they were fitted is in the options.
    SecondaryVortices,
    /// Circulations are from what is near each vortex, in a wind of its own: the pair does not explain the scan.
    LocalCirculation,
    /// The vortices were taken as standing still although the scan lasted, or its times are unknown.
    MotionIgnored,
    /// Another wake is within 9 of the least chi-square.
    Ambiguous,
    /// Residuals are larger than stated: chi-square per degree above 2 after robust scaling.
    PoorFit,
    /// More than 10 % of the velocities are outliers.
    Outliers,
    /// Velocities were taken for means over gates, though nothing says that they are: peaks of spectra read less in a vortex.
    TakenForMeans,
    /// Medians over blocks were fitted: there are more than 16 000 velocities, or more than 1500 to be whitened.
    Thinned,
    /// The fit did not converge: its last iterate is reported.
    NotConverged,
    /// The test of the scan for a wake, at the rate of false alarms that is stated for it, does not find this one.
    NotDetected,
}

impl Flag {
    /// Whether the flag is about the scan and its fit, not about vortices.
    pub(crate) fn is_of_scan(self) -> bool {
        matches!(
            self,
            Self::PoorFit | Self::Outliers | Self::Thinned | Self::NotConverged
        )
    }
}

/// Outcome of a retrieval from one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanResult {
    /// The vortices, left before right; none if there is no wake.
    pub vortices: Vec<VortexResult>,
    /// The fitted wake at the reference time; a vortex that is not there has no circulation. Nothing without a wake.
    pub wake: Option<Wake>,
    /// Reference time \[s\]: the middle of the scan. NaN if times are unknown.
    pub reference_time_s: f64,
    /// Covariance \[10, 10\] of the wake at the reference time, in the order of [`Parameter`].
    pub covariance: Array2<f64>,
    /// Lateral wind at the ground \[m/s\].
    pub lateral_wind_m_s: Measured,
    /// Its change with height \[1/s\].
    pub wind_shear_per_s: Measured,
    /// Sum of squares of the residuals of used velocities over the stated deviations, per degree of freedom; 1 by construction if
    /// none were stated.
    pub chi2_per_dof: f64,
    /// Velocities used.
    pub cells_used: usize,
    /// Velocities with a residual beyond 4 of its deviations.
    pub cells_rejected: usize,
    /// Least chi-square of the wind alone minus the least one of wind and wake.
    pub statistic: f64,
    /// The least statistic that was asked for.
    pub threshold: f64,
    /// What to think of the result, in the order of [`Flag`].
    pub flags: Vec<Flag>,
    /// All ends of the fit that are not the same, the best first.
    pub tops: Vec<Top>,
    /// The turbulence that was found in the scan and taken into account, if that was requested.
    pub turbulence: Option<ScanTurbulence>,
    /// The model that was fitted: that of the options, with the secondary vortices beside a pair if they were.
    pub model: WakeModel,
}

impl ScanResult {
    /// Whether a flag is set.
    #[must_use]
    pub fn has(&self, flag: Flag) -> bool {
        self.flags.contains(&flag)
    }

    /// Sets a flag, or takes it away.
    pub fn set(&mut self, flag: Flag, is_set: bool) {
        self.flags.retain(|own| *own != flag);
        self.flags.extend(is_set.then_some(flag));
        self.flags.sort();
    }

    /// The vortex of that side, if there is one.
    #[must_use]
    pub fn vortex(&self, side: Side) -> Option<&VortexResult> {
        self.vortices.iter().find(|vortex| vortex.side == side)
    }

    /// The result of another fit that ends at a wake with that covariance \[10, 10\] and those minima: the vortices that it has, each when the line
    /// of sight passes it.
    #[must_use]
    pub fn with_wake(
        &self,
        map: &ScanMap,
        model: &WakeModel,
        (wake, covariance): (Wake, Array2<f64>),
        tops: Vec<Top>,
        moves: bool,
    ) -> Self {
        let mut vortices = Vec::new();
        for side in Side::BOTH {
            if wake.to_array()[side.parameters()[0] as usize] != 0.0 {
                let fitted = (&wake, &covariance);
                vortices.push(VortexResult::at_its_line(map, model, fitted, side, moves));
            }
        }
        let mut result = Self {
            vortices,
            wake: Some(wake),
            lateral_wind_m_s: Measured::of_wake(Parameter::Wind, &wake, &covariance),
            wind_shear_per_s: Measured::of_wake(Parameter::Shear, &wake, &covariance),
            covariance,
            tops,
            model: *model,
            ..self.clone()
        };
        if result.vortices.len() != self.vortices.len() {
            // What the other fit left says nothing of this one.
            result.set(Flag::PoorFit, false);
            result.chi2_per_dof = f64::NAN;
        }
        result.set(Flag::NoWake, false);
        result.set(Flag::Uncertain, false);
        let is_instant = map.has_times() && map.lasts_s() == 0.0;
        result.set(Flag::MotionIgnored, !moves && !is_instant);
        result.set(Flag::NotConverged, false);
        let competing = result
            .tops
            .iter()
            .skip(1)
            .any(|top| top.chi2 - result.tops[0].chi2 < COMPETES);
        result.set(Flag::Ambiguous, competing);
        result.reporting(|_| true)
    }

    /// The result with those of its vortices that are reported.
    pub(crate) fn reporting(mut self, is_reported: impl Fn(&VortexResult) -> bool) -> Self {
        self.vortices.retain(is_reported);
        self.set(Flag::OneVortex, self.vortices.len() == 1);
        let mut vortices = self.vortices.iter();
        let is_core_kept = vortices.any(|vortex| vortex.core_radius_m.is_none());
        self.set(Flag::CoreKept, is_core_kept);
        self
    }

    /// Counts the distance from another result as an error, in all numbers that are known.
    pub(crate) fn add_distance_from(&mut self, other: &Self, map: &ScanMap) {
        let Some((wake, other)) = self.wake.zip(other.wake) else {
            return;
        };
        let own = wake.to_array();
        let other = other.to_array();
        let variances = self.covariance.diag().to_owned();
        let distance: [f64; PARAMETERS] = std::array::from_fn(|i| {
            if variances[i] > 0.0 {
                own[i] - other[i]
            } else {
                0.0
            }
        });
        let mut covariance = self.covariance.clone();
        for ((i, j), c) in covariance.indexed_iter_mut() {
            *c += distance[i] * distance[j];
        }
        let moves = !self.has(Flag::MotionIgnored);
        let tops = self.tops.clone();
        *self = self.with_wake(map, &self.model, (wake, covariance), tops, moves);
    }
}
