//! The Cramer-Rao bound on the velocity for a scene: against the signal-to-noise ratio, and against range.
//!
//! For the scene's pulse, window, sampling and noise in a uniform wind; a region is worth n_eff independent windows, which
//! divides the bound by their root. Check: the stored curve of independent origin for one window of Table 2.

use crate::io::Table;
use crate::measure::progress::Observer;
use crate::measure::region::{of_table, region_radius};
use crate::measure::scan::Scanner;
use crate::plan::Plan;
use crate::{Error, measure::estimators};
use wakescope_estimate::{
    Radius, SignalKind,
    bound::WindowModel,
    map::{PolarPoint, ScanGeometry, WindowCorrelation},
};

/// Signal-to-noise ratios of the curve, dB.
const SNR_DB: std::ops::RangeInclusive<i32> = -30..=60;

/// The bound at one signal-to-noise ratio or range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundPoint {
    /// Range of the centre of the window, m.
    pub range_m: f64,
    /// Signal-to-noise ratio in the detector band, dB.
    pub snr_db: f64,
    /// Bound on the standard deviation from one window, m/s.
    pub window_m_s: f64,
    /// Windows of the region of the scene at this range.
    pub level: usize,
    /// Independent windows that they are worth.
    pub n_eff: f64,
    /// Bound from the region, m/s.
    pub region_m_s: f64,
}

/// The bound for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneBound {
    /// Against the signal-to-noise ratio, for a region in the middle of the scan.
    pub by_snr: Vec<BoundPoint>,
    /// At the gates of the map, with the scene's own ratio there.
    pub by_range: Vec<BoundPoint>,
}

/// What all points share.
struct Setting {
    model: WindowModel,
    kind: SignalKind,
    places: ScanGeometry,
    correlation: WindowCorrelation,
    radius: Radius,
    elevation_rad: f64,
}

impl Setting {
    fn new(plan: &Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let (scene, g) = (&plan.scene.scene, &plan.geometry);
        let noise = scene.detector.noise;
        let model = estimators::window_model(scene, noise, &plan.instrument.pulse)?.ok_or(Error::NoBound)?;
        let (sampling, gates, pulses) =
            (estimators::sampling(scene)?, estimators::gates(scene)?, scene.scan.pulses_per_line);
        let places = ScanGeometry::regular(&sampling, &gates, &g.elevation_rad, pulses, g.samples)?;
        let correlation = estimators::window_correlation(scene, &plan.instrument.pulse, scanner.mean_snr())?;
        let radius = region_radius(scene, &plan.instrument.pulse, &scanner.layer_snr(), &places, &correlation)?;
        let elevation_rad = g.elevation_rad[g.elevation_rad.len() / 2];
        Ok(Self { model, kind: estimators::signal_kind(scene), places, correlation, radius, elevation_rad })
    }

    fn at(&self, range_m: f64, snr: f64) -> Result<BoundPoint, Error> {
        let point = PolarPoint { range_m, elevation_rad: self.elevation_rad };
        let (level, n_eff) = self.places.level(point, self.radius.at_m(range_m)?, &self.correlation);
        // Without any return there is no information.
        let window_m_s = match snr > 0.0 {
            true => estimators::bound_m_s(&self.model, snr, self.kind)?,
            false => f64::NAN,
        };
        let snr_db = if snr > 0.0 { 10.0 * snr.log10() } else { f64::NAN };
        Ok(BoundPoint { range_m, snr_db, window_m_s, level, n_eff, region_m_s: window_m_s / n_eff.sqrt() })
    }
}

/// Computes the bound for a planned scene.
///
/// # Errors
/// [`Error::NoBound`] for a scene without noise; what the crates refuse.
pub fn bound(plan: &Plan, observer: &dyn Observer) -> Result<SceneBound, Error> {
    let scanner = Scanner::new(plan, observer)?;
    let (setting, g) = (Setting::new(plan, &scanner)?, &plan.geometry);
    let middle_m = g.gate_range_m[g.gate_range_m.len() / 2];
    let by_snr = SNR_DB.map(|db| setting.at(middle_m, 10f64.powf(0.1 * f64::from(db)))).collect::<Result<_, _>>()?;
    let (layer_m, snr): (Vec<f64>, Vec<f64>) = scanner.layer_snr().into_iter().unzip();
    let by_range =
        g.gate_range_m.iter().map(|&r| setting.at(r, of_table(&layer_m, &snr, r))).collect::<Result<_, _>>()?;
    Ok(SceneBound { by_snr, by_range })
}

/// The bound in the middle of the range of the gates of a scan.
///
/// # Errors
/// As [`bound`].
#[cfg(feature = "sweep")]
pub(crate) fn bound_in_the_middle(plan: &Plan, scanner: &Scanner<'_>) -> Result<BoundPoint, Error> {
    let range_m = plan.geometry.gate_range_m[plan.geometry.gate_range_m.len() / 2];
    let (layer_m, snr): (Vec<f64>, Vec<f64>) = scanner.layer_snr().into_iter().unzip();
    Setting::new(plan, scanner)?.at(range_m, of_table(&layer_m, &snr, range_m))
}

impl SceneBound {
    /// The table `curve,range_m,snr_db,bound_window_m_s,level,n_eff,bound_region_m_s`; `curve` is `snr` or `range`.
    pub fn table(&self) -> Table {
        let named =
            |name: &'static str, points: &[BoundPoint]| points.iter().map(move |p| (name, *p)).collect::<Vec<_>>();
        let rows = [named("snr", &self.by_snr), named("range", &self.by_range)].concat();
        let column = |get: fn(&BoundPoint) -> f64| rows.iter().map(move |(_, p)| get(p)).collect::<Vec<_>>();
        Table::new()
            .text("curve", rows.iter().map(|(name, _)| *name))
            .float("range_m", column(|p| p.range_m))
            .float("snr_db", column(|p| p.snr_db))
            .float("bound_window_m_s", column(|p| p.window_m_s))
            .int("level", rows.iter().map(|(_, p)| p.level as i64))
            .float("n_eff", column(|p| p.n_eff))
            .float("bound_region_m_s", column(|p| p.region_m_s))
    }

    /// A few lines for people: every tenth decibel, and five ranges.
    pub fn text(&self) -> String {
        let mut out = String::from(
            "       SNR      range  one window  windows    n_eff    region\n        dB          m         m/s                         m/s\n",
        );
        let spread = (self.by_range.len().max(2) - 1) as f64 / 4.0;
        let ranges = (0..5).map(|i| (f64::from(i) * spread) as usize).filter_map(|i| self.by_range.get(i));
        for p in self.by_snr.iter().step_by(10).chain(ranges) {
            out += &format!(
                "{:>10.2} {:>10.1} {:>11.4} {:>8} {:>8.2} {:>9.4}\n",
                p.snr_db, p.range_m, p.window_m_s, p.level, p.n_eff, p.region_m_s
            );
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::progress::Silent;
    use crate::plan::Target;
    use crate::scene::{DetectorSignal, NoiseKind, Scene, SceneFile, SnrReference};

    fn of(change: impl FnOnce(&mut Scene)) -> Result<SceneBound, Error> {
        let mut scene = Scene::default();
        (scene.scan.elevation_max_rad, scene.scan.elevation_step_rad) = (0.02, 1e-3);
        scene.detector.snr = SnrReference::Fixed { snr_db: 3.0 };
        change(&mut scene);
        bound(&Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap(), &Silent)
    }

    /// The stored column at the ratios of the file.
    fn stored(column: usize) -> Vec<(f64, f64)> {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/signal/crlb_200ns.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let rows = text.lines().filter(|l| l.starts_with(|c: char| c == '-' || c.is_ascii_digit()));
        rows.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect::<Vec<f64>>())
            .map(|r| (r[0], r[column]))
            .collect()
    }

    #[test]
    fn the_bound_of_one_window_of_table_2_is_the_stored_curve() {
        for (signal, column) in [(DetectorSignal::Baseband, 1), (DetectorSignal::IntermediateFrequency, 2)] {
            let found = of(|s| (s.detector.noise, s.detector.signal) = (NoiseKind::White, signal)).unwrap().by_snr;
            let mut compared = 0;
            for (snr_db, expected_m_s) in stored(column) {
                if let Some(p) = found.iter().find(|p| (p.snr_db - snr_db).abs() < 1e-9) {
                    assert!((p.window_m_s / expected_m_s - 1.0).abs() < 1e-7, "{snr_db}: {p:?}, {expected_m_s}");
                    compared += 1;
                }
            }
            assert!(compared > 15, "{compared}");
        }
    }

    #[test]
    fn regions_and_pulses_lower_the_bound_by_the_root_of_their_number() {
        let middle = |change: fn(&mut Scene)| of(change).unwrap().by_range[40];
        let one = middle(|s| {
            s.estimator.radius_m = 0.0;
            s.scan.pulses_per_line = 1;
        });
        let many = middle(|s| {
            s.estimator.radius_m = 0.0;
            s.scan.pulses_per_line = 9;
        });
        assert!((one.n_eff - 1.0).abs() < 1e-9 && (one.snr_db - 3.0).abs() < 1e-9, "{one:?}");
        assert!((one.region_m_s / many.region_m_s - 3.0).abs() < 1e-9, "{one:?} {many:?}");
        let region = middle(|s| s.scan.pulses_per_line = 1);
        assert!(region.level > 20 && region.region_m_s < 0.5 * one.region_m_s, "{region:?}");
    }

    #[test]
    fn a_scene_without_noise_has_no_bound() {
        let refused = of(|s| s.detector.noise = NoiseKind::None).unwrap_err();
        assert!(matches!(refused, Error::NoBound), "{refused}");
    }
}
