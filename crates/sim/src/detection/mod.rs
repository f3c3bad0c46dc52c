//! Whether scans hold a wake: statistics against thresholds that are calibrated on empty scans of the same geometry and background.
//!
//! | module | content |
//! |---|---|
//! | `air` | turbulence that is found in each scan |
//! | `scan_turbulence` | columns and JSON of that turbulence |
//! | `scene_noise` | deviations of a scene's velocities, and how far apart they are independent, from scans of still air |
//! | `tables`, `pictures` | what is written |
//!
//! Check: a wake is found and empty scans are not, at their rate; results do not depend on threads.

mod air;
#[cfg(feature = "plots")]
mod pictures;
pub(crate) mod scan_turbulence;
mod scene_noise;
mod tables;

#[cfg(feature = "plots")]
pub use pictures::picture;
pub use scene_noise::SceneNoise;
pub use tables::{scan_table, share_table};

use crate::Error;
use crate::progress::{Observer, Stage};
use crate::streams::stream;
use ndarray::Array2;
use wakescope_estimate::Measured;
use wakescope_estimate::retrieval::{Gate, ScanMap, ScanTurbulence, Turbulence, without_spikes};
use wakescope_estimate::vortex_fit::WakeModel;
use wakescope_estimate::wake_detection::{
    DetectorOptions, EmptyScanLaw, WakeDetector, WakeStatistic,
};

/// Backgrounds with wakes that are drawn for the shares of wakes that are found.
const TRIALS: usize = 2000;
/// Wakes whose places are drawn.
const PLACES: usize = 200;
/// Circulations over the bound, of the curves.
const CURVES: [f64; 4] = [3.0, 4.0, 5.0, 6.0];
/// Correlation of neighbours, in its standard errors, beyond which the background is not the one that was stated: chance brings it once in
/// some thousand scans.
const CORRELATED: f64 = 3.5;

/// How wakes are looked for.
#[derive(Debug, Clone)]
pub struct DetectionSettings {
    /// Rate of false alarms of a scan.
    pub false_alarm: f64,
    /// Profile of the vortices, ground, lidar.
    pub model: WakeModel,
    /// What a velocity is of the air about its range.
    pub gate: Gate,
    /// Wakes that are tried, turbulence.
    pub options: DetectorOptions,
    /// Empty scans that are drawn.
    pub empty_scans: usize,
    /// Every so many lines and gates are used.
    pub stride: (usize, usize),
    /// Seed of what is drawn.
    pub seed: u64,
}

impl Default for DetectionSettings {
    /// A rate of a hundredth from 10 000 empty scans; all velocities, as points, in white noise.
    fn default() -> Self {
        Self {
            false_alarm: 1e-2,
            model: WakeModel::default(),
            gate: Gate::Point,
            options: DetectorOptions::default(),
            empty_scans: 10_000,
            stride: (1, 1),
            seed: 1,
        }
    }
}

/// Part by which the noise of scans without stated deviations may differ from that of a calibration with turbulence.
const SAME_NOISE: f64 = 0.03;

/// What was found in one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanDetection {
    /// The statistic, and the wake that explains most.
    pub statistic: WakeStatistic,
    /// The threshold.
    pub threshold: f64,
    /// Probability that an empty scan reaches that statistic.
    pub false_alarm: f64,
    /// Velocities that stood off their neighbours and were left out.
    pub outliers: usize,
    /// Velocities that were there.
    pub velocities: usize,
    /// Standard deviation that was taken for all velocities, m/s, where the scan states none.
    pub assumed_sigma_m_s: Option<f64>,
    /// The turbulence of the background, if it was found in the scan.
    pub turbulence: Option<ScanTurbulence>,
    /// mu and beta of Gumbel's law with the moments of the empty scans.
    pub gumbel: (f64, f64),
}

impl ScanDetection {
    /// Whether the scan holds a wake.
    #[must_use]
    pub fn is_wake(&self) -> bool {
        self.statistic.value > self.threshold
    }

    /// Whether what is left of the scan is so correlated that the stated background cannot be the true one.
    #[must_use]
    pub fn is_correlated(&self) -> bool {
        let (along, across) = self.statistic.neighbour_correlation;
        let errors = self.statistic.correlation_error;
        along > CORRELATED * errors.0 || across > CORRELATED * errors.1
    }
}

/// Circulation, m^2/s, rate of false alarms, threshold and share of wakes that are found.
pub type FoundShare = (f64, f64, f64, Measured);

/// How often wakes are found in one geometry and background.
#[derive(Debug, Clone, PartialEq)]
pub struct Power {
    /// The rate of false alarms and its threshold.
    pub false_alarm: f64,
    /// The threshold.
    pub threshold: f64,
    /// mu and beta of Gumbel's law.
    pub gumbel: (f64, f64),
    /// Bound on the circulation of a pair at a known place, m^2/s: root mean square over the places.
    pub circulation_std_m2_s: f64,
    /// Shares that are found at the rate.
    pub found: Vec<FoundShare>,
    /// Those at other rates of some circulations.
    pub roc: Vec<FoundShare>,
    /// The circulation that is found with probability 0.9, m^2/s: measured, and as the bound predicts.
    pub smallest_m2_s: (f64, f64),
    /// Standard error of the measured one, m^2/s.
    pub smallest_error_m2_s: f64,
}

/// A test with its law, for all scans that are alike.
pub struct Calibration {
    map: ScanMap,
    detector: WakeDetector,
    law: EmptyScanLaw,
    threshold: f64,
    assumed_sigma_m_s: Option<f64>,
    turbulence: Option<Turbulence>,
}

impl Calibration {
    /// Calibrates the test for scans like `map`. Where it states no deviations, they are those of what its best wake leaves. The observer
    /// is told of each empty scan that is drawn.
    ///
    /// # Errors
    /// What the test refuses.
    pub fn new(
        map: &ScanMap,
        settings: &DetectionSettings,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let mut map = map.clone();
        let mut assumed_sigma_m_s = None;
        if map.sigma_m_s.is_none() {
            map = air::with_unit_noise(&map);
            if let Some(Turbulence::VonKarman(found)) = settings.options.turbulence {
                // Its covariance has the noise, as a factor of that of the map.
                assumed_sigma_m_s = Some(found.noise_std_m_s);
            } else {
                let sigma_m_s = noise_m_s(&map, settings)?;
                map.sigma_m_s = Some(Array2::from_elem(map.velocity_m_s.raw_dim(), sigma_m_s));
                assumed_sigma_m_s = Some(sigma_m_s);
            }
        }
        let detector = WakeDetector::new(&map, &settings.model, &settings.gate, &settings.options)?;
        observer.begin(Stage::Detection, settings.empty_scans as u64);
        let law = detector.calibrate(settings.empty_scans, |scan| {
            observer.advance(1);
            stream(settings.seed, "empty scans", scan)
        })?;
        observer.end();
        let threshold = law.threshold(settings.false_alarm)?;
        Ok(Self {
            map,
            detector,
            law,
            threshold,
            assumed_sigma_m_s,
            turbulence: settings.options.turbulence,
        })
    }

    /// Whether the calibration holds for another scan: the same axes and turbulence, nearly the same velocities missing, deviations within a
    /// tenth.
    fn is_for(&self, map: &ScanMap, settings: &DetectionSettings) -> bool {
        if settings.options.turbulence != self.turbulence {
            return false;
        }
        let same_axes =
            map.elevation_rad == self.map.elevation_rad && map.range_m == self.map.range_m;
        if !same_axes || map.sigma_m_s.is_none() != self.assumed_sigma_m_s.is_some() {
            return false;
        }
        if let (Some(sigma_m_s), Some(Turbulence::Exponential { .. })) =
            (self.assumed_sigma_m_s, self.turbulence)
        {
            let own_m_s = noise_m_s(&air::with_unit_noise(map), settings);
            if own_m_s.is_ok_and(|own_m_s| (own_m_s / sigma_m_s - 1.0).abs() > SAME_NOISE) {
                return false;
            }
        }
        let mut both = 0;
        let mut one = 0;
        for (at, velocity_m_s) in map.velocity_m_s.indexed_iter() {
            match (
                velocity_m_s.is_finite(),
                self.map.velocity_m_s[at].is_finite(),
            ) {
                (true, true) => {
                    both += 1;
                    if (sigma_at(map, at) / sigma_at(&self.map, at) - 1.0).abs() > 0.1 {
                        return false;
                    }
                }
                (false, false) => {}
                _ => one += 1,
            }
        }
        10 * one < both
    }

    /// Tests a scan that the calibration is for.
    ///
    /// # Errors
    /// What the test refuses.
    pub(crate) fn of_scan(
        &self,
        scan: &ScanMap,
        settings: &DetectionSettings,
    ) -> Result<ScanDetection, Error> {
        self.test(&cleaned(scan, settings))
    }

    fn test(
        &self,
        (map, outliers, velocities): &(ScanMap, usize, usize),
    ) -> Result<ScanDetection, Error> {
        let mut statistic = self.detector.statistic(map.velocity_m_s.view())?;
        let mut assumed_sigma_m_s = self.assumed_sigma_m_s;
        if self.turbulence.is_none()
            && let Some(sigma_m_s) = &mut assumed_sigma_m_s
        {
            // Each scan has the noise that its own best wake leaves, not that of the scan of the calibration.
            *sigma_m_s *= statistic.take_own_noise();
        }
        Ok(ScanDetection {
            statistic,
            threshold: self.threshold,
            false_alarm: self.law.false_alarm(statistic.value),
            outliers: *outliers,
            velocities: *velocities,
            assumed_sigma_m_s,
            turbulence: match self.turbulence {
                Some(Turbulence::VonKarman(found)) => Some(found),
                _ => None,
            },
            gumbel: self.law.gumbel(),
        })
    }

    /// How often pairs anywhere in the scan are found. The observer is told of each scan that is drawn.
    ///
    /// # Errors
    /// What the trials refuse, such as a scan too small for a pair.
    pub fn power(
        &self,
        settings: &DetectionSettings,
        observer: &dyn Observer,
    ) -> Result<Power, Error> {
        let wakes = self
            .detector
            .draw_wakes(PLACES, |wake| stream(settings.seed, "wakes to find", wake));
        observer.begin(Stage::Detection, TRIALS as u64);
        let trials = self.detector.trials(&wakes, TRIALS, |trial| {
            observer.advance(1);
            stream(settings.seed, "scans with wakes", trial)
        })?;
        observer.end();
        let std_m2_s = trials.circulation_std_m2_s();
        let circulations: Vec<f64> = (0..=20).map(|i| 0.5 * f64::from(i) * std_m2_s).collect();
        let shares = trials.detection(&circulations, self.threshold);
        let found = circulations.into_iter().zip(shares);
        let found = found
            .map(|(circulation, share)| (circulation, settings.false_alarm, self.threshold, share))
            .collect();
        // four rates in a decade
        let rates: Vec<f64> = (-16..0).map(|i| 10f64.powf(0.25 * f64::from(i))).collect();
        let mut roc = Vec::new();
        for circulation_m2_s in CURVES.map(|bounds| bounds * std_m2_s) {
            let statistics = trials.statistics(circulation_m2_s);
            for &rate in &rates {
                let threshold = self.law.threshold(rate)?;
                let hits = statistics
                    .iter()
                    .filter(|value| **value > threshold)
                    .count();
                roc.push((
                    circulation_m2_s,
                    rate,
                    threshold,
                    Measured::share(hits, TRIALS),
                ));
            }
        }
        let [measured, smallest_error_m2_s, foretold] =
            trials.smallest_detectable_m2_s(self.threshold);
        Ok(Power {
            false_alarm: settings.false_alarm,
            threshold: self.threshold,
            gumbel: self.law.gumbel(),
            circulation_std_m2_s: std_m2_s,
            found,
            roc,
            smallest_m2_s: (measured, foretold),
            smallest_error_m2_s,
        })
    }
}

/// Standard deviation of the noise, m/s, that the best wake leaves of a map with one of 1 m/s, in given turbulence.
///
/// # Errors
/// What the test refuses.
fn noise_m_s(map: &ScanMap, settings: &DetectionSettings) -> Result<f64, Error> {
    let calm = DetectorOptions {
        turbulence: None,
        ..settings.options
    };
    let unit = WakeDetector::new(map, &settings.model, &settings.gate, &calm)?;
    let all = unit.statistic(map.velocity_m_s.view())?.wake_chi2_per_dof;
    let air = match settings.options.turbulence {
        Some(Turbulence::Exponential { deviation_m_s, .. }) => deviation_m_s.powi(2),
        _ => 0.0,
    };
    // turbulence has its part of what is left; some noise there must be
    Ok((all - air).max(0.01 * all).sqrt())
}

/// Standard deviation of a velocity of a map, NaN where none is stated.
fn sigma_at(map: &ScanMap, at: (usize, usize)) -> f64 {
    map.sigma_m_s.as_ref().map_or(f64::NAN, |sigma| sigma[at])
}

/// Tests scans one after the other; those that are alike share a calibration, unless each has turbulence of its own. Returns the first
/// calibration, too.
///
/// # Errors
/// What the test refuses of a scan.
pub fn detect(
    scans: &[ScanMap],
    settings: &DetectionSettings,
    observer: &dyn Observer,
) -> Result<(Vec<ScanDetection>, Option<Calibration>), Error> {
    let mut found = Vec::with_capacity(scans.len());
    let mut calibrations = Vec::<Calibration>::new();
    for scan in scans {
        let cleaned = cleaned(scan, settings);
        let own = air::of_scan(&cleaned.0, settings)?;
        if !calibrations
            .last()
            .is_some_and(|known| known.is_for(&cleaned.0, &own))
        {
            // the first is kept for its curves, the last for the next scan
            calibrations.truncate(1);
            calibrations.push(Calibration::new(&cleaned.0, &own, observer)?);
        }
        found.extend(
            calibrations
                .last()
                .map(|known| known.test(&cleaned))
                .transpose()?,
        );
    }
    calibrations.truncate(1);
    Ok((found, calibrations.pop()))
}

/// What is tested of a scan, and how many outliers and velocities there are: outliers are told by all neighbours, before lines and
/// gates are left out.
fn cleaned(scan: &ScanMap, settings: &DetectionSettings) -> (ScanMap, usize, usize) {
    let (map, outliers) = without_spikes(scan, settings.options.turbulence.as_ref());
    let map = map.strided(settings.stride.0, settings.stride.1);
    let velocities = map.velocity_m_s.iter().filter(|v| v.is_finite()).count();
    (map, outliers, velocities)
}

/// The background that the rate of false alarms holds for, in words.
#[must_use]
pub fn background(settings: &DetectionSettings, has_sigma: bool) -> String {
    let noise = match has_sigma {
        true => "independent noise with the stated deviation of each velocity",
        false => "independent noise of one deviation, that of what is left of the scan",
    };
    let air = match settings.options.turbulence {
        None => String::new(),
        Some(Turbulence::Exponential {
            deviation_m_s,
            length_m,
        }) => format!(", and turbulence of {deviation_m_s} m/s correlated over {length_m} m"),
        Some(Turbulence::VonKarman(_) | Turbulence::OfScan) => {
            ", and isotropic turbulence of the dissipation and outer scale of each scan".to_owned()
        }
    };
    format!("a wind that is linear in height, {noise}{air}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use rand_xoshiro::rand_core::Rng;
    use wakescope_estimate::vortex_fit::Wake;

    fn map(seed: u64, circulation_m2_s: f64) -> ScanMap {
        let elevation_rad: Vec<f64> = (0..44).map(|i| 0.01 + 4e-3 * f64::from(i)).collect();
        let range_m: Vec<f64> = (0..26).map(|i| 340.0 + 5.0 * f64::from(i)).collect();
        let c = circulation_m2_s;
        let wake = Wake::from_array(&[c, c, 379.0, 46.0, 421.0, 46.0, 2.0, 2.0, 1.5, 0.01, 0.0]);
        let mut rng = stream(seed, "test", 0);
        let velocity_m_s = Array2::from_shape_fn((44, 26), |(i, j)| {
            // twelve uniform numbers are nearly normal
            let noise: f64 = (0..12)
                .map(|_| rng.next_u64() as f64 / u64::MAX as f64)
                .sum::<f64>()
                - 6.0;
            WakeModel::default().radial_velocity_m_s(&wake, range_m[j], elevation_rad[i])
                + 0.5 * noise
        });
        let sigma_m_s = Some(Array2::from_elem((44, 26), 0.5));
        ScanMap {
            time_s: vec![f64::NAN; 44],
            elevation_rad,
            range_m,
            velocity_m_s,
            sigma_m_s,
            fold_m_s: None,
        }
    }

    fn settings() -> DetectionSettings {
        DetectionSettings {
            empty_scans: 2000,
            ..DetectionSettings::default()
        }
    }

    #[test]
    fn wakes_are_found_and_empty_scans_are_not_whatever_the_threads() {
        let scans = [map(1, 0.0), map(2, 60.0), map(3, 0.0)];
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| detect(&scans, &settings(), &Silent).unwrap().0)
        };
        let found = run(1);
        assert_eq!(found, run(3));
        assert_eq!(
            found.iter().map(ScanDetection::is_wake).collect::<Vec<_>>(),
            [false, true, false]
        );
        assert!(
            found[1].false_alarm < 1e-6 && found[0].false_alarm > 1e-2,
            "{found:?}"
        );
        assert!(!found.iter().any(ScanDetection::is_correlated), "{found:?}");
        let wake = found[1].statistic.wake;
        assert!(
            (wake.left.lateral_position_m - 379.0).abs() < 8.0
                && (wake.right.height_m - 46.0).abs() < 5.0
        );
        // a scan that states no deviations is told by its residuals
        let unstated = ScanMap {
            sigma_m_s: None,
            ..scans[1].clone()
        };
        let (found, _) = detect(&[unstated], &settings(), &Silent).unwrap();
        assert!(
            found[0].is_wake() && (found[0].assumed_sigma_m_s.unwrap() / 0.5 - 1.0).abs() < 0.1,
            "{found:?}"
        );
    }

    /// Scans that state no deviations have their own noise each, though they share a calibration.
    #[test]
    fn a_noisier_scan_has_the_statistic_of_its_own_noise() {
        let quiet = ScanMap {
            sigma_m_s: None,
            ..map(1, 0.0)
        };
        let noisy = ScanMap {
            velocity_m_s: &quiet.velocity_m_s * 1.7,
            ..quiet.clone()
        };
        let (found, _) = detect(&[quiet, noisy], &settings(), &Silent).unwrap();
        let [quiet, noisy] = [0, 1].map(|scan| &found[scan]);
        assert!((noisy.statistic.value / quiet.statistic.value - 1.0).abs() < 1e-9);
        let sigmas = [quiet, noisy].map(|scan| scan.assumed_sigma_m_s.unwrap());
        assert!((sigmas[1] / sigmas[0] - 1.7).abs() < 1e-9, "{sigmas:?}");
    }

    #[test]
    fn shares_grow_with_circulation_and_rate_and_reach_the_smallest_that_is_found() {
        let (_, calibration) = detect(&[map(1, 0.0)], &settings(), &Silent).unwrap();
        let power = calibration.unwrap().power(&settings(), &Silent).unwrap();
        assert!(
            power
                .found
                .windows(2)
                .all(|pair| pair[1].3.value >= pair[0].3.value - 0.01)
        );
        assert!(
            power.found[0].3.value < 0.03 && power.found[20].3.value > 0.99,
            "{power:?}"
        );
        let (measured, foretold) = power.smallest_m2_s;
        assert!(
            (measured / foretold - 1.0).abs() < 0.15,
            "{measured} {foretold}"
        );
        for curve in power.roc.chunks(16) {
            assert!(
                curve
                    .windows(2)
                    .all(|pair| pair[1].3.value >= pair[0].3.value)
            );
        }
    }

    #[test]
    fn neighbours_that_say_the_same_are_told_and_a_stride_parts_them() {
        let mut smooth = map(5, 0.0);
        let from = smooth.velocity_m_s.clone();
        for ((line, gate), v) in smooth.velocity_m_s.indexed_iter_mut() {
            let last = (line + 3).min(44);
            *v = from.slice(ndarray::s![line..last, gate]).mean().unwrap() * 3f64.sqrt();
        }
        let (found, _) = detect(std::slice::from_ref(&smooth), &settings(), &Silent).unwrap();
        assert!(found[0].is_correlated(), "{found:?}");
        let parted = DetectionSettings {
            stride: (3, 1),
            ..settings()
        };
        assert!(!detect(&[smooth], &parted, &Silent).unwrap().0[0].is_correlated());
    }

    #[test]
    fn correlation_of_a_few_neighbours_is_held_against_its_own_error() {
        let scans: Vec<ScanMap> = (100..250).map(|seed| map(seed, 0.0)).collect();
        let (found, _) = detect(
            &scans,
            &DetectionSettings {
                stride: (6, 4),
                ..settings()
            },
            &Silent,
        )
        .unwrap();
        let beyond = |limit: f64| {
            found
                .iter()
                .filter(|f| f.statistic.neighbour_correlation.0 > limit)
                .count()
        };
        // a seventh is chance among so few
        assert!(
            beyond(0.15) > 5 && found.iter().filter(|f| f.is_correlated()).count() <= 1,
            "{}",
            beyond(0.15)
        );
    }
}
