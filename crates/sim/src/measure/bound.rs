//! The Cramer-Rao bound on the velocity for a scene: against the signal-to-noise ratio, and against range.
//!
//! For the scene's pulse, window, sampling and noise in a uniform wind; that of a region comes from the records that its chords
//! cover, each of the samples of all its windows. Check: the stored curve of independent origin for one window of Table 2; no
//! estimate of a region scatters less.

use crate::interpolation::interpolate;
use crate::io::Table;
use crate::measure::map_stages::bound_bytes;
use crate::measure::ray_information::RayInformation;
use crate::measure::region::{RegionInformation, places, region_radius};
use crate::measure::scan::Scanner;
use crate::measure::scan_stages::wind_bytes;
use crate::plan::{Plan, PlannedStage, Stage, estimators, fit};
use crate::progress::Observer;
use crate::{Error, machine, scene::NoiseModel};
use wakescope_estimate::{
    Radius,
    map::{PolarPoint, ScanGeometry, WindowCovariance},
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

/// Whether the memory for the bound of a plan's scene is available: matrices of the samples of a
/// record by as many.
///
/// # Errors
/// Fails with [`Error::TooLarge`] for more than nine tenths of what the machine has available.
pub fn fits(plan: &Plan) -> Result<(), Error> {
    fits_in(
        plan,
        machine::available_memory_bytes().unwrap_or(f64::INFINITY),
    )
}

/// Whether the memory for the bound is within a given amount, bytes.
///
/// # Errors
/// As [`fits`].
fn fits_in(plan: &Plan, available_bytes: f64) -> Result<(), Error> {
    let remedy = "fewer estimator.window_samples";
    let mut stages = Vec::new();
    for stage in &plan.stages {
        if let Stage::PhaseScreens | Stage::Efficiency | Stage::LinesOfSight = stage.stage {
            stages.push(PlannedStage {
                remedy: remedy.into(),
                ..stage.clone()
            });
        }
    }
    let matrices = PlannedStage::running(Stage::Estimates, String::new());
    let bytes = wind_bytes(plan) + bound_bytes(plan);
    stages.push(matrices.with_memory(bytes, 0.0, remedy.into()));
    fit::refuse_too_large(&stages, available_bytes)
}

/// What all points share.
struct Setting<'p> {
    of_rays: RayInformation<'p>,
    places: ScanGeometry,
    covariance: WindowCovariance,
    radius: Radius,
}

impl<'p> Setting<'p> {
    fn new(plan: &'p Plan, scanner: &Scanner<'_>) -> Result<Self, Error> {
        let scene = plan.scene();
        if scene.detector.noise == NoiseModel::None {
            return Err(Error::NoBound);
        }
        let places = places(scene, &plan.geometry)?;
        let of_rays = RayInformation::new(plan, &scanner.layer_snr())?;
        let radius = region_radius(&of_rays, &places)?;
        let covariance = estimators::window_covariance(scene, &plan.instrument.pulse)?;
        Ok(Self {
            of_rays,
            places,
            covariance,
            radius,
        })
    }

    /// At a range, with the scene's own signal-to-noise ratios about it.
    fn at(&self, range_m: f64) -> Result<BoundPoint, Error> {
        let rays = &self.of_rays;
        let radius_m = self.radius.at_m(range_m)?;
        let of_region =
            RegionInformation::new(rays, &self.places, radius_m).about(range_m, radius_m)?;
        let ratios = [
            interpolate(&rays.layer_m, &rays.layer_snr, range_m),
            rays.of_windows(&[range_m])?[0],
        ];
        self.told(range_m, ratios, [rays.at(range_m, 1)?[0], of_region])
    }

    /// At a range, all samples having one signal-to-noise ratio.
    fn of_snr(&self, range_m: f64, snr: f64) -> Result<BoundPoint, Error> {
        let radius_m = self.radius.at_m(range_m)?;
        let by_gates = self.of_rays.of_snr(snr, self.places.most_gates(radius_m))?;
        let point = self.point(range_m);
        let [of_region] = self.places.information(point, radius_m, [&by_gates]);
        self.told(range_m, [snr; 2], [by_gates[0], of_region])
    }

    fn point(&self, range_m: f64) -> PolarPoint {
        PolarPoint::on_line(range_m, self.places.lines() / 2)
    }

    /// From the ratio of the air at the range and that of a window there, and the information of a window and of the region.
    fn told(
        &self,
        range_m: f64,
        snr: [f64; 2],
        information: [f64; 2],
    ) -> Result<BoundPoint, Error> {
        let correlation = self.covariance.correlation(snr[1])?;
        let (level, n_eff) = self.places.level(
            self.point(range_m),
            self.radius.at_m(range_m)?,
            &correlation,
        );
        // Without any return there is no information.
        let bound_m_s = |information: f64| {
            if information > 0.0 {
                information.sqrt().recip()
            } else {
                f64::NAN
            }
        };
        Ok(BoundPoint {
            range_m,
            snr_db: if snr[0] > 0.0 {
                10.0 * snr[0].log10()
            } else {
                f64::NAN
            },
            window_m_s: bound_m_s(information[0]),
            level,
            n_eff,
            region_m_s: bound_m_s(information[1]),
        })
    }
}

/// Computes the bound for a planned scene.
///
/// # Errors
/// [`Error::NoBound`] for a scene without noise; what the crates refuse.
pub fn bound(plan: &Plan, observer: &dyn Observer) -> Result<SceneBound, Error> {
    let scanner = Scanner::new(plan, observer)?;
    let setting = Setting::new(plan, &scanner)?;
    let gates_m = &plan.geometry.gate_range_m;
    let middle_m = gates_m[gates_m.len() / 2];
    let of_snr = |db: i32| setting.of_snr(middle_m, 10f64.powf(0.1 * f64::from(db)));
    let by_snr = SNR_DB.map(of_snr).collect::<Result<_, _>>()?;
    Ok(SceneBound {
        by_snr,
        by_range: gates_m
            .iter()
            .map(|&range_m| setting.at(range_m))
            .collect::<Result<_, _>>()?,
    })
}

/// The bound in the middle of the range of the gates of a scan.
///
/// # Errors
/// As [`bound`].
pub(crate) fn bound_in_the_middle(plan: &Plan, scanner: &Scanner<'_>) -> Result<BoundPoint, Error> {
    Setting::new(plan, scanner)?
        .at(plan.geometry.gate_range_m[plan.geometry.gate_range_m.len() / 2])
}

/// The table `range_m,snr_db,bound_window_m_s,level,n_eff,bound_region_m_s`.
pub fn points(points: &[BoundPoint]) -> Table {
    let column = |get: fn(&BoundPoint) -> f64| points.iter().map(get).collect::<Vec<_>>();
    Table::new()
        .float("range_m", column(|p| p.range_m))
        .float("snr_db", column(|p| p.snr_db))
        .float("bound_window_m_s", column(|p| p.window_m_s))
        .int("level", points.iter().map(|p| p.level as i64))
        .float("n_eff", column(|p| p.n_eff))
        .float("bound_region_m_s", column(|p| p.region_m_s))
}

impl SceneBound {
    /// All points in one table, behind a column `curve` that is `snr` or `range`.
    pub fn table(&self) -> Table {
        let curve =
            |name: &'static str, points: &[BoundPoint]| std::iter::repeat_n(name, points.len());
        Table::new()
            .text(
                "curve",
                curve("snr", &self.by_snr).chain(curve("range", &self.by_range)),
            )
            .beside(points(&[self.by_snr.as_slice(), &self.by_range].concat()))
    }

    /// A few lines for people: every tenth decibel, and five ranges.
    pub fn text(&self) -> String {
        let spread = (self.by_range.len().max(2) - 1) as f64 / 4.0;
        let ranges = (0..5)
            .map(|i| (f64::from(i) * spread) as usize)
            .filter_map(|i| self.by_range.get(i));
        points(
            &self
                .by_snr
                .iter()
                .step_by(10)
                .chain(ranges)
                .copied()
                .collect::<Vec<_>>(),
        )
        .aligned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SPEED_OF_LIGHT_M_S;
    use crate::plan::Target;
    use crate::progress::Silent;
    use crate::scene::{DetectorSignal, NoiseModel, Scene, SceneFile, SnrReference};

    fn of(change: impl FnOnce(&mut Scene)) -> Result<SceneBound, Error> {
        let mut scene = Scene::default();
        (scene.scan.elevation_max_rad, scene.scan.elevation_step_rad) = (0.02, 1e-3);
        scene.detector.snr = SnrReference::Fixed { snr_db: 3.0 };
        change(&mut scene);
        bound(
            &Plan::new(SceneFile::new(scene).unwrap(), Target::Map).unwrap(),
            &Silent,
        )
    }

    /// The stored column at the ratios of the file.
    fn stored(column: usize) -> Vec<(f64, f64)> {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/reference/signal/crlb_200ns.csv"
        );
        let text = std::fs::read_to_string(path).unwrap();
        let rows = text
            .lines()
            .filter(|l| l.starts_with(|c: char| c == '-' || c.is_ascii_digit()));
        rows.map(|l| {
            l.split(',')
                .map(|x| x.parse().unwrap())
                .collect::<Vec<f64>>()
        })
        .map(|r| (r[0], r[column]))
        .collect()
    }

    #[test]
    fn bound_of_windows_whose_matrices_do_not_fit_is_refused_and_the_remedy_fits() {
        let plan = |text: &str| {
            let file = SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap();
            Plan::new(file, Target::Run).unwrap()
        };
        let text = |window: &str| {
            format!(
                "[scan]\nrange_max_m = 9000.0\nelevation_max_rad = 0.01\n[estimator]\nwindow_samples = {window}\npadded_samples = 32768\n"
            )
        };
        let long = plan(&text("13000"));
        long.fits_in(8e9).unwrap();
        let refused = fits_in(&long, 8e9).unwrap_err().to_string();
        // Some six matrices of 13 000 x 13 000 numbers.
        assert!(
            refused.contains("needs 8.") && refused.contains("--allow-large"),
            "{refused}"
        );
        assert!(
            refused.contains("fewer estimator.window_samples"),
            "{refused}"
        );
        fits_in(&plan(&text("6500")), 8e9).unwrap();
    }

    #[test]
    fn the_bound_of_one_window_of_table_2_is_the_stored_curve() {
        for (signal, column) in [
            (DetectorSignal::Baseband, 1),
            (DetectorSignal::IntermediateFrequency, 2),
        ] {
            let found = of(|s| (s.detector.noise, s.detector.signal) = (NoiseModel::White, signal))
                .unwrap()
                .by_snr;
            let mut compared = 0;
            for (snr_db, expected_m_s) in stored(column) {
                if let Some(p) = found.iter().find(|p| (p.snr_db - snr_db).abs() < 1e-9) {
                    assert!(
                        (p.window_m_s / expected_m_s - 1.0).abs() < 1e-7,
                        "{snr_db}: {p:?}, {expected_m_s}"
                    );
                    compared += 1;
                }
            }
            assert!(compared > 15, "{compared}");
        }
    }

    #[test]
    fn the_bound_of_a_pulse_with_an_asymmetric_spectrum_is_that_of_its_complex_correlation() {
        let scene = plan(
            "[pulse.shape]\nkind = \"sampled\"\n\
             time_s = [-200e-9, -150e-9, -100e-9, -50e-9, 0.0, 50e-9, 100e-9, 150e-9, 200e-9, 250e-9, 300e-9, 350e-9, 400e-9]\n\
             power = [0.0, 0.2, 0.8, 1.0, 0.8, 0.5, 0.3, 0.2, 0.12, 0.07, 0.03, 0.01, 0.0]\n\
             phase_rad = [0.0, 0.0, 0.0, 0.0, 0.2, 0.6, 1.2, 2.0, 3.0, 4.2, 5.6, 7.2, 9.0]\n\
             [detector]\nsignal = \"baseband\"\nnoise = \"white\"\nbandwidth_hz = 60e6\nsampling_hz = 80e6\n\
             [estimator]\nwindow_samples = 40\nwindow_step_samples = 3\ngate_step_samples = 3\n",
        );
        let found = bound(&scene, &Silent).unwrap().by_snr;
        // (E12) with a natural spline through the complex amplitude, in numpy; the real part of the correlation gives 5 to 7 % more.
        for (snr_db, expected_m_s) in [(-30.0, 93.3605), (0.0, 0.580_689), (20.0, 0.283_639)] {
            let row = found.iter().find(|row| (row.snr_db - snr_db).abs() < 1e-9);
            let found_m_s = row.unwrap().window_m_s;
            assert!(
                (found_m_s / expected_m_s - 1.0).abs() < 2e-3,
                "{snr_db} dB: {found_m_s} {expected_m_s}"
            );
        }
    }

    #[test]
    fn a_target_is_reached_at_each_gate_with_the_smallest_radius_that_does() {
        let target_m_s = 0.2;
        let largest_m = 30.0;
        let scene = plan(
            "[detector]\nnoise = \"white\"\n[estimator]\nwindow_step_samples = 16\ngate_step_samples = 16\n\
             radius = { kind = \"target\", standard_deviation_m_s = 0.2, largest_m = 30.0 }\n\
             [scan]\npulses_per_line = 8\nrange_min_m = 300.0\nrange_max_m = 900.0\nelevation_max_rad = 0.1\n\
             elevation_step_rad = 4e-3\n",
        );
        let setting = Setting::new(&scene, &Scanner::new(&scene, &Silent).unwrap()).unwrap();
        let mut information = RegionInformation::new(&setting.of_rays, &setting.places, largest_m);
        let mut bound_m_s = |range_m: f64, radius_m: f64| {
            let found = information.about(range_m, radius_m).unwrap();
            found.sqrt().recip()
        };
        let mut reached = 0;
        for &range_m in &scene.geometry.gate_range_m {
            let found = setting.at(range_m).unwrap();
            let radius_m = setting.radius.at_m(range_m).unwrap();
            if found.region_m_s <= target_m_s * (1.0 + 1e-9) {
                let smaller_m_s = bound_m_s(range_m, radius_m - 1e-3 * largest_m);
                assert!(smaller_m_s > target_m_s, "{found:?}: {radius_m}");
                reached += 1;
            } else {
                let least_m_s = bound_m_s(range_m, largest_m);
                assert!(least_m_s > target_m_s, "{found:?}: {radius_m}");
            }
            // Another program: 56 windows give 0.2242 m/s, a radius of 7.409 m and 72 windows what is needed.
            if (range_m - 463.1).abs() < 0.1 {
                assert_eq!(found.level, 72, "{found:?}: {radius_m}");
                assert!((found.region_m_s - 0.1978).abs() < 5e-4, "{found:?}");
            }
        }
        assert!(reached > 40, "{reached}");
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
        assert!(
            (one.n_eff - 1.0).abs() < 1e-9 && (one.snr_db - 3.0).abs() < 1e-9,
            "{one:?}"
        );
        assert!(
            (one.region_m_s / many.region_m_s - 3.0).abs() < 1e-9,
            "{one:?} {many:?}"
        );
        let region = middle(|s| s.scan.pulses_per_line = 1);
        assert!(
            region.level > 20 && region.region_m_s < 0.5 * one.region_m_s,
            "{region:?}"
        );
    }

    fn plan(text: &str) -> Plan {
        Plan::new(
            SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap(),
            Target::Map,
        )
        .unwrap()
    }

    /// Lines so far from each other that they share nothing, in a wind of 3 m/s at rest along them.
    fn lines(detector: &str, pulse_s: f64, pulses: usize, estimator: &str) -> Plan {
        plan(&format!(
            "[pulse.shape]\nduration_s = {pulse_s:?}\n[detector]\n{detector}\n[flow]\nkind = \"uniform\"\nlateral_m_s = 3.0\nvertical_m_s = 0.0\n\
             [scan]\nelevation_min_rad = 0.0\nelevation_max_rad = 0.24\nelevation_step_rad = 0.24\nrange_min_m = 300.0\n\
             range_max_m = 460.0\npulses_per_line = {pulses}\nrealisations = 80\n[estimator]\ngate_step_samples = 20\n{estimator}"
        ))
    }

    #[test]
    fn no_estimate_of_a_region_scatters_less_than_its_bound() {
        let fixed = |db: f64| format!("snr = {{ reference = \"fixed\", snr_db = {db:?} }}");
        let complex = |db: f64| format!("signal = \"baseband\"\nnoise = \"white\"\n{}", fixed(db));
        let likelihood = "method.kind = \"likelihood\"\nwindow_samples = 16\n";
        let of_radius = |radius_m: f64| format!("{likelihood}radius_m = {radius_m:?}\n");
        // The bound of one window over the root of n_eff is above the scatter in the first three.
        for (plan, beaten) in [
            (lines(&complex(10.0), 400e-9, 1, &of_radius(60.0)), true),
            (lines(&complex(-5.0), 400e-9, 8, &of_radius(60.0)), true),
            (lines(&fixed(10.0), 400e-9, 4, &of_radius(30.0)), true),
            (lines(&fixed(10.0), 200e-9, 4, &of_radius(30.0)), true),
            (lines(&fixed(10.0), 200e-9, 8, "radius_m = 2.0\n"), false),
            (
                lines(
                    &fixed(3.0),
                    200e-9,
                    20,
                    "method.kind = \"likelihood\"\nradius_m = 10.0\nwindow_samples = 32\n",
                ),
                false,
            ),
        ] {
            let map = crate::run::run(&plan, &Silent).unwrap().map.unwrap();
            let gate = map.range_m.len() / 2;
            let column = map.std_m_s.column(gate);
            let std_m_s = column
                .iter()
                .map(|std| std * std / column.len() as f64)
                .sum::<f64>()
                .sqrt();
            let error_m_s = std_m_s / (2.0 * column.len() as f64 * 79.0).sqrt();
            let found = bound(&plan, &Silent).unwrap().by_range[gate];
            assert!(
                found.region_m_s < std_m_s + 3.0 * error_m_s,
                "{found:?}: {std_m_s} +- {error_m_s}"
            );
            assert!(found.region_m_s > 0.2 * std_m_s, "{found:?}: {std_m_s}");
            let by_n_eff_m_s = found.window_m_s / found.n_eff.sqrt();
            assert_eq!(
                by_n_eff_m_s > std_m_s + 3.0 * error_m_s,
                beaten,
                "{by_n_eff_m_s} {std_m_s} {found:?}"
            );
        }
    }

    #[test]
    fn each_row_has_what_its_own_ratio_is_worth() {
        let at = |db: f64| {
            let detector = format!("snr = {{ reference = \"fixed\", snr_db = {db:?} }}");
            bound(
                &lines(
                    &detector,
                    200e-9,
                    1,
                    "window_samples = 16\nradius_m = 10.0\n",
                ),
                &Silent,
            )
            .unwrap()
        };
        let strong = at(0.0);
        let weak = at(-20.0);
        let row = strong.by_snr[10];
        let gate = weak.by_range[weak.by_range.len() / 2];
        assert!((row.snr_db + 20.0).abs() < 1e-9 && (gate.snr_db + 20.0).abs() < 1e-9);
        for (row, gate) in [
            (row.n_eff, gate.n_eff),
            (row.region_m_s, gate.region_m_s),
            (row.window_m_s, gate.window_m_s),
        ] {
            assert!((row / gate - 1.0).abs() < 1e-6, "{row} {gate}");
        }
        assert!(
            row.n_eff > 1.3 * strong.by_snr[30].n_eff,
            "{row:?} {:?}",
            strong.by_snr[30]
        );
    }

    #[test]
    fn a_cloud_far_away_changes_no_gate_and_one_near_by_is_seen_through_the_pulse() {
        let of = |cloud: &str| {
            let scene = plan(&format!(
                "[pulse]\nenergy_j = 1e-3\n[pulse.shape]\nduration_s = 100e-9\n[atmosphere.profile]\n\
                 range_m = [0.0, 470.0, 470.1, 900.0]\nbackscatter_per_m_sr = [1e-7, 1e-7, {cloud}, {cloud}]\n\
                 extinction_per_m = [7e-5, 7e-5, 7e-5, 7e-5]\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.1\n\
                 range_max_m = 550.0\n[estimator]\nwindow_samples = 16\nradius_m = 6.0\n"
            ));
            let points = bound(&scene, &Silent).unwrap().by_range;
            let map = crate::run::run(&scene, &Silent).unwrap().map.unwrap();
            (points, map.n_eff.row(0).to_vec())
        };
        let clear = of("1e-7");
        let cloudy = of("1e-4");
        let at = |range_m: f64| {
            clear
                .0
                .iter()
                .position(|point| point.range_m > range_m)
                .unwrap()
        };
        let far = at(350.0);
        let near = at(464.0);
        let ratio = |gate: usize| cloudy.0[gate].region_m_s / clear.0[gate].region_m_s;
        assert!(
            (ratio(far) - 1.0).abs() < 1e-9 && ratio(near) < 0.7,
            "{} {}",
            ratio(far),
            ratio(near)
        );
        assert!(
            (cloudy.1[far] / clear.1[far] - 1.0).abs() < 1e-9,
            "{} {}",
            cloudy.1[far],
            clear.1[far]
        );
        assert!(
            (cloudy.1[far] / cloudy.0[far].n_eff - 1.0).abs() < 1e-9,
            "map and bound differ"
        );
    }

    #[test]
    fn behind_a_focus_the_bound_rises_without_a_step() {
        let scene = plan(
            "[telescope]\nfocus_m = 254.0\naperture_radius_m = 0.086\nbeam_radius_m = 0.068\n[pulse]\nenergy_j = 3.4e-5\n\
             [pulse.shape]\nduration_s = 400e-9\n[atmosphere]\nbackscatter_per_m_sr = 1e-6\n[scan]\nelevation_min_rad = 0.1\n\
             elevation_max_rad = 0.1\nrange_min_m = 300.0\nrange_max_m = 460.0\n[estimator]\nwindow_samples = 32\ngate_step_samples = 16\n\
             radius_m = 4.0\n",
        );
        let points = bound(&scene, &Silent).unwrap().by_range;
        for of in [|p: &BoundPoint| p.window_m_s, |p: &BoundPoint| p.region_m_s] {
            // Apart from the ends, which cut regions.
            let rise: Vec<f64> = points[1..points.len() - 1]
                .windows(2)
                .map(|p| of(&p[1]) / of(&p[0]))
                .collect();
            assert!(rise.iter().all(|rise| *rise > 1.05), "{rise:?}");
            assert!(
                rise.windows(2).all(|rise| rise[1] < 1.01 * rise[0]),
                "{rise:?}"
            );
        }
    }

    #[test]
    fn two_windows_behind_a_focus_have_the_bound_of_the_record_that_they_cover() {
        let at = |estimator: &str, radius_m: f64, range_m: f64| {
            let scene = plan(&format!(
                "[telescope]\nfocus_m = 254.0\naperture_radius_m = 0.086\nbeam_radius_m = 0.068\n[pulse]\nenergy_j = 3.4e-5\n\
                 [pulse.shape]\nduration_s = 300e-9\n[atmosphere]\nbackscatter_per_m_sr = 1e-6\n[scan]\nelevation_min_rad = 0.1\n\
                 elevation_max_rad = 0.1\nrange_min_m = 300.0\nrange_max_m = 460.0\n[estimator]\n{estimator}\nradius_m = {radius_m:?}\n"
            ));
            Setting::new(&scene, &Scanner::new(&scene, &Silent).unwrap())
                .unwrap()
                .at(range_m)
                .unwrap()
        };
        // Two windows of 24 samples, 8 samples apart, and one of 32 between them.
        let step_m = 4.0 * SPEED_OF_LIGHT_M_S / 250e6;
        let gates = plan(
            "[estimator]\nwindow_samples = 24\nwindow_step_samples = 8\n[scan]\nrange_min_m = 300.0\n",
        );
        let gate_m = places(gates.scene(), &gates.geometry)
            .unwrap()
            .gate_ranges_m()[10];
        let middle_m = gate_m + 0.5 * step_m;
        let two = at(
            "window_samples = 24\nwindow_step_samples = 8",
            0.6 * step_m,
            middle_m,
        );
        let one = at("window_samples = 32", 0.0, middle_m);
        assert_eq!(two.level, 32);
        assert!(
            (two.region_m_s / (one.window_m_s / 4.0) - 1.0).abs() < 1e-9,
            "{two:?} {one:?}"
        );
    }

    #[test]
    fn a_scene_without_noise_has_no_bound() {
        let refused = of(|s| s.detector.noise = NoiseModel::None).unwrap_err();
        assert!(matches!(refused, Error::NoBound), "{refused}");
    }
}
