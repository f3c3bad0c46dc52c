//! Air of a scene with known statistics: a mean wind over the height, and turbulence.
//!
//! Check: each limit is broken once, in `tests/it/air.rs`.

use super::{EfficiencyOfPulse, Flow, Scene, VortexPair, WindOfPulses};
use crate::keys::{Checker, Problem, keys};
use std::f64::consts::{FRAC_PI_2, TAU};
use wakescope_estimate::turbulence::VonKarman;
use wakescope_les::winds::MeanWind;

/// Smallest wave number of the modes times the outer scale.
pub(crate) const SMALLEST_WAVENUMBER: f64 = 0.1;

/// Fewest modes of a doubling of the wave number.
const MODES_PER_OCTAVE: f64 = 24.0;

/// Largest part of the outer scale that the smallest eddies may have.
const SMALLEST_FRACTION: f64 = 0.2;

keys! {
    /// A horizontal wind that depends on the height.
    table WindProfile {
        /// Law of the speed against the height.
        profile: WindProfileKind = WindProfileKind::Logarithmic,
        /// Speed at reference_height_m, m/s; 5.0 if absent.
        speed_m_s: Option<f64> = None => 0.0..=200.0,
        /// Height of the speed, m; 10.0 if absent.
        reference_height_m: Option<f64> = None => 1e-3..=1e4,
        /// Friction velocity of the logarithmic law, m/s, in place of the speed.
        friction_velocity_m_s: Option<f64> = None => 0.0..=20.0,
        /// Direction towards which the air moves, clockwise from +x, rad; pi/2 if absent.
        toward_rad: Option<f64> = None => 0.0..=TAU,
        /// Head wind at reference_height_m, m/s, with cross_wind_m_s in place of speed and direction.
        head_wind_m_s: Option<f64> = None => -200.0..=200.0,
        /// Cross wind at reference_height_m, m/s, positive away from the lidar.
        cross_wind_m_s: Option<f64> = None => -200.0..=200.0,
        /// Roughness length of the logarithmic law, m; 0.03 if absent.
        roughness_m: Option<f64> = None => 1e-6..=10.0,
        /// Displacement height of the logarithmic law, m; 0.0 if absent.
        displacement_m: Option<f64> = None => 0.0..=100.0,
        /// Exponent of the power law; 0.143 if absent.
        exponent: Option<f64> = None => 0.0..=1.0,
        /// Heights of the table, m, increasing.
        height_m: Vec<f64> as omitted = Vec::<f64>::new() => 0.0..=1e5,
        /// Speed at each height of the table, m/s.
        speeds_m_s: Vec<f64> as omitted = Vec::<f64>::new() => 0.0..=200.0,
        /// Direction at each height of the table, as toward_rad.
        towards_rad: Vec<f64> as omitted = Vec::<f64>::new() => 0.0..=TAU,
    }

    /// Law of the mean wind against the height.
    choice WindProfileKind {
        /// Neutral logarithmic law, linear below 10 roughness lengths or 1 m.
        Logarithmic = "logarithmic",
        /// Power law, linear below 1 m.
        Power = "power",
        /// Straight lines between heights, constant outside.
        Table = "table",
    }

    /// Homogeneous isotropic turbulence with the spectrum of von Karman.
    #[derive(Copy)]
    table EddyField {
        /// Dissipation rate, m^2/s^3; 0 for none.
        dissipation_m2_s3: f64 = 5e-4 => 0.0..=10.0,
        /// Outer scale, m.
        outer_scale_m: f64 = 100.0 => 1.0..=1e5,
        /// Wavelength of the smallest eddies, m, at most a fifth of outer_scale_m.
        smallest_m: f64 = 2.0 => 0.05..=2e4,
        /// Number of modes, at least 24 per octave of wave numbers.
        modes: usize = 512 => 64..=65_536,
        /// How the modes are summed along lines of sight.
        evaluation: EddyEvaluation = EddyEvaluation::Levels,
        /// Kolmogorov constant of the energy spectrum.
        kolmogorov_constant: f64 = 1.5 => 1.0..=2.5,
        /// Whether air crosses z = 0.
        ground: EddyGround = EddyGround::Open,
        /// How the eddies change while they are carried along.
        decorrelation: EddyDecorrelation = EddyDecorrelation::None,
        /// Whether realisations share the eddies.
        realisations: EddyRealisations = EddyRealisations::One,
        /// Height whose mean wind carries the eddies, m; absent: they stay in place.
        carried_at_m: Option<f64> = None => 1e-3..=1e5,
    }

    /// How the modes are summed along lines of sight.
    choice EddyEvaluation {
        /// Long waves at few points, interpolated.
        Levels = "levels",
        /// Every mode at every point.
        All = "all",
    }

    /// Whether air crosses z = 0.
    choice EddyGround {
        /// The ground does not act.
        Open = "open",
        /// No air crosses the ground.
        Blocked = "blocked",
    }

    /// How the eddies change while they are carried along.
    choice EddyDecorrelation {
        /// Frozen turbulence.
        None = "none",
        /// Large eddies sweep small ones: random frequencies.
        Sweeping = "sweeping",
    }

    /// Whether realisations share the eddies.
    choice EddyRealisations {
        /// All realisations have the same eddies; errors hold no turbulence.
        One = "one",
        /// Each realisation has its own eddies and its own truth.
        Each = "each",
    }
}

impl WindProfile {
    /// Direction towards which the air moves, rad clockwise from +x, and its speed at the reference
    /// height, m/s.
    fn direction_and_speed(&self) -> (f64, f64) {
        if self.head_wind_m_s.is_none() && self.cross_wind_m_s.is_none() {
            let toward_rad = self.toward_rad.unwrap_or(FRAC_PI_2);
            return (toward_rad, self.speed_m_s.unwrap_or(5.0));
        }
        let along_m_s = -self.head_wind_m_s.unwrap_or(0.0);
        let across_m_s = self.cross_wind_m_s.unwrap_or(0.0);
        (across_m_s.atan2(along_m_s), along_m_s.hypot(across_m_s))
    }

    /// The wind that is simulated.
    ///
    /// # Errors
    /// What the wind refuses; a checked scene gives none.
    pub(crate) fn simulated(&self) -> Result<MeanWind, wakescope_les::Error> {
        use wakescope_les::winds::WindLaw;
        let (toward_rad, speed_m_s) = self.direction_and_speed();
        let reference_height_m = self.reference_height_m.unwrap_or(10.0);
        let law = match self.profile {
            WindProfileKind::Logarithmic => {
                let roughness_m = self.roughness_m.unwrap_or(0.03);
                let displacement_m = self.displacement_m.unwrap_or(0.0);
                let of_speed_m_s = MeanWind::friction_velocity_m_s(
                    speed_m_s,
                    reference_height_m,
                    roughness_m,
                    displacement_m,
                );
                WindLaw::Logarithmic {
                    friction_velocity_m_s: self.friction_velocity_m_s.unwrap_or(of_speed_m_s),
                    roughness_m,
                    displacement_m,
                }
            }
            WindProfileKind::Power => WindLaw::Power {
                speed_m_s,
                reference_height_m,
                exponent: self.exponent.unwrap_or(0.143),
            },
            WindProfileKind::Table => WindLaw::Table {
                height_m: self.height_m.clone(),
                speed_m_s: self.speeds_m_s.clone(),
                toward_rad: self.towards_rad.clone(),
            },
        };
        MeanWind::new(law, toward_rad)
    }

    /// The keys that are given and act only with some profiles: name, value, and the profiles.
    fn special_keys(&self) -> Vec<(&'static str, f64, &'static [WindProfileKind])> {
        use WindProfileKind::{Logarithmic, Power};
        const LAWS: &[WindProfileKind] = &[Logarithmic, Power];
        let keys: [(&str, Option<f64>, &[WindProfileKind]); 9] = [
            ("speed_m_s", self.speed_m_s, LAWS),
            ("reference_height_m", self.reference_height_m, LAWS),
            (
                "friction_velocity_m_s",
                self.friction_velocity_m_s,
                &[Logarithmic],
            ),
            ("toward_rad", self.toward_rad, LAWS),
            ("head_wind_m_s", self.head_wind_m_s, LAWS),
            ("cross_wind_m_s", self.cross_wind_m_s, LAWS),
            ("roughness_m", self.roughness_m, &[Logarithmic]),
            ("displacement_m", self.displacement_m, &[Logarithmic]),
            ("exponent", self.exponent, &[Power]),
        ];
        keys.into_iter()
            .filter_map(|(name, value, profiles)| Some((name, value?, profiles)))
            .collect()
    }
}

impl EddyField {
    /// The spectrum; none of a dissipation rate of 0.
    pub(crate) fn spectrum(&self) -> Option<VonKarman> {
        VonKarman::new(
            self.dissipation_m2_s3,
            self.outer_scale_m,
            self.kolmogorov_constant,
        )
        .ok()
    }

    /// Smallest and largest wave number of the modes, rad/m.
    pub(crate) fn wavenumbers_rad_m(&self) -> [f64; 2] {
        [
            SMALLEST_WAVENUMBER / self.outer_scale_m,
            TAU / self.smallest_m,
        ]
    }
}

/// The rules between the keys of a mean wind whose table is at `at`.
pub(super) fn check_wind_profile(wind: &WindProfile, at: &str, c: &mut Checker<'_>) {
    // Limits between keys make sense only once each key does.
    if c.has_problem_of(at) {
        return;
    }
    let key = |name: &str| format!("{at}.{name}");
    for (name, value, profiles) in wind.special_keys() {
        let names: Vec<String> = profiles
            .iter()
            .map(|profile| format!("\"{}\"", profile.name()))
            .collect();
        let allowed = format!(
            "absent: this key is for {at}.profile = {}, and {at}.profile is \"{}\"",
            names.join(" or "),
            wind.profile.name()
        );
        c.require(profiles.contains(&wind.profile), &key(name), value, allowed);
    }
    let has_components = wind.head_wind_m_s.is_some() || wind.cross_wind_m_s.is_some();
    let components = format!("absent beside {at}.head_wind_m_s and {at}.cross_wind_m_s");
    if let (true, Some(toward_rad)) = (has_components, wind.toward_rad) {
        c.refuse(&key("toward_rad"), &format!("{toward_rad:?}"), &*components);
    }
    if let (true, Some(speed_m_s)) = (has_components, wind.speed_m_s) {
        c.refuse(&key("speed_m_s"), &format!("{speed_m_s:?}"), components);
    }
    if let Some(friction_velocity_m_s) = wind.friction_velocity_m_s {
        let has_speed =
            has_components || wind.speed_m_s.is_some() || wind.reference_height_m.is_some();
        let allowed = "absent beside a speed at a height: each determines the other";
        let key = key("friction_velocity_m_s");
        c.require(!has_speed, &key, friction_velocity_m_s, allowed);
    }
    if wind.profile == WindProfileKind::Logarithmic && wind.friction_velocity_m_s.is_none() {
        let height_m = wind.reference_height_m.unwrap_or(10.0);
        let roughness_m = wind.roughness_m.unwrap_or(0.03);
        let zero_m = roughness_m + wind.displacement_m.unwrap_or(0.0);
        let allowed = format!(
            "above {at}.displacement_m + {at}.roughness_m, {zero_m} m, such as {}",
            zero_m + 10.0 * roughness_m.max(1.0)
        );
        c.require(
            height_m > zero_m,
            &key("reference_height_m"),
            height_m,
            allowed,
        );
    }
    check_table(wind, at, c);
}

/// The columns of the table of a mean wind.
fn check_table(wind: &WindProfile, at: &str, c: &mut Checker<'_>) {
    let rows = wind.height_m.len();
    let is_table = wind.profile == WindProfileKind::Table;
    for (i, pair) in wind.height_m.windows(2).enumerate() {
        let key = format!("{at}.height_m[{}]", i + 1);
        let allowed = format!("above the height before it, {} m", pair[0]);
        c.require(pair[1] > pair[0], &key, pair[1], allowed);
    }
    let columns = [
        ("height_m", rows),
        ("speeds_m_s", wind.speeds_m_s.len()),
        ("towards_rad", wind.towards_rad.len()),
    ];
    for (name, length) in columns {
        let value = match length {
            0 => Problem::ABSENT.to_owned(),
            length => format!("{length} values"),
        };
        let key = format!("{at}.{name}");
        if is_table {
            let allowed = format!("one value for each of {at}.height_m, {rows}, at least 1");
            if length != rows || rows == 0 {
                c.refuse(&key, &value, allowed);
            }
        } else if length > 0 {
            let allowed = format!("absent: this key is for {at}.profile = \"table\"");
            c.refuse(&key, &value, allowed);
        }
    }
}

/// The rules between the keys of turbulence whose table is at `at`.
pub(super) fn check_eddies(eddies: &EddyField, at: &str, c: &mut Checker<'_>) {
    if c.has_problem_of(at) {
        return;
    }
    let key = |name: &str| format!("{at}.{name}");
    let largest_m = SMALLEST_FRACTION * eddies.outer_scale_m;
    let allowed =
        format!("at most a fifth of {at}.outer_scale_m, {largest_m} m: {largest_m} passes");
    let is_small = eddies.smallest_m <= largest_m;
    c.require(is_small, &key("smallest_m"), eddies.smallest_m, allowed);
    let [low, high] = eddies.wavenumbers_rad_m();
    let fewest = (MODES_PER_OCTAVE * (high / low).log2()).ceil();
    let allowed = format!(
        "at least {MODES_PER_OCTAVE} for each octave between {at}.outer_scale_m and {at}.smallest_m: {fewest} passes"
    );
    let has_enough = !is_small || eddies.modes as f64 >= fewest;
    c.require(has_enough, &key("modes"), eddies.modes, allowed);
}

impl Scene {
    /// All flows, each with the path of its table.
    pub(crate) fn flows(&self) -> impl Iterator<Item = (String, &Flow)> {
        let added = self.added_flows.iter().enumerate();
        std::iter::once(("flow".to_owned(), &self.flow))
            .chain(added.map(|(i, flow)| (format!("added_flows[{i}]"), flow)))
    }

    /// The turbulence, if there is any.
    pub(crate) fn eddies(&self) -> Option<&EddyField> {
        self.flows().find_map(|(_, flow)| match flow {
            Flow::Eddies(eddies) if eddies.dissipation_m2_s3 > 0.0 => Some(eddies),
            _ => None,
        })
    }

    /// The mean winds.
    pub(crate) fn mean_winds(&self) -> impl Iterator<Item = &WindProfile> {
        self.flows().filter_map(|(_, flow)| match flow {
            Flow::Wind(wind) => Some(wind),
            _ => None,
        })
    }

    /// Whether each realisation has turbulence of its own.
    pub(crate) fn has_air_of_each_realisation(&self) -> bool {
        self.eddies()
            .is_some_and(|eddies| eddies.realisations == EddyRealisations::Each)
    }

    /// Whether its flow is a pair that is transported.
    pub(crate) fn has_transported_pair(&self) -> bool {
        self.flow.pair().is_some_and(VortexPair::is_transported)
    }

    /// Whether the signals of each line have layers as thick as the wind of that line allows. Pulses with winds, echoes or efficiencies
    /// of their own have those of the scan.
    pub(crate) fn has_layers_of_each_line(&self) -> bool {
        let turbulence = self.refractive_turbulence();
        self.has_transported_pair()
            && self.scan.wind_of_pulses == WindOfPulses::default()
            && self.scan.second_trip.is_none()
            && turbulence.is_none_or(|t| t.efficiency != EfficiencyOfPulse::Realisation)
    }

    /// The rules between flows.
    pub(super) fn check_air(&self, c: &mut Checker<'_>) {
        let has_wind = self.mean_winds().next().is_some();
        let mut first_eddies: Option<String> = None;
        for (at, flow) in self.flows() {
            match flow {
                Flow::Eddies(eddies) => {
                    if let Some(carried_at_m) = eddies.carried_at_m {
                        let allowed =
                            "absent without a flow of kind \"wind\", which carries the eddies";
                        c.require(
                            has_wind,
                            &format!("{at}.carried_at_m"),
                            carried_at_m,
                            allowed,
                        );
                    }
                    if let Some(first) = &first_eddies {
                        let allowed = format!(
                            "another kind: {first} is \"eddies\", and a scene has one turbulence"
                        );
                        c.refuse(&format!("{at}.kind"), "\"eddies\"", allowed);
                    }
                    first_eddies.get_or_insert(at);
                }
                Flow::VortexPair(pair) => {
                    let allowed = "0 beside a flow of kind \"wind\", which is the cross wind";
                    let is_single = !has_wind || pair.cross_wind_m_s == 0.0;
                    let key = format!("{at}.cross_wind_m_s");
                    c.require(is_single, &key, pair.cross_wind_m_s, allowed);
                }
                _ => {}
            }
        }
    }
}
