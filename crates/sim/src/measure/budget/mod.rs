//! The power budget: from the photons of a pulse to the signal-to-noise ratio (14) at some ranges, factor by factor in decibels.
//!
//! Check: the rows sum to the signal-to-noise ratio of the profile for every telescope, air and receiver; the stored budget of
//! Table 2.

mod digits;
mod limits;

use crate::Error;
use crate::io::Table;
use crate::measure::profile::{EfficiencyMemo, LineOptics, efficiency_by_theory, free_space};
use crate::plan::Plan;
use crate::plan::instrument::Instrument;
use crate::progress::Observer;
use crate::scene::{Digitiser, FrontEnd, Scene, SnrReference};
use digits::{scientific, si};
use std::f64::consts::{LN_2, PI};

use wakescope_optics::EfficiencyProfile;
use wakescope_signal::receiver::echoes::ambiguous_range_m;

/// One factor of the signal-to-noise ratio, or one of its sums.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// What it is; sums begin with an equals sign.
    #[serde(rename = "row")]
    pub name: &'static str,
    /// The factor as a formula.
    pub symbol: &'static str,
    /// What it comes from, for people.
    pub value: String,
    /// Of each range, dB.
    pub db: Vec<f64>,
}

/// The budget of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// Ranges, m.
    pub range_m: Vec<f64>,
    /// Factors, each sum below what it sums.
    pub rows: Vec<Row>,
    /// What bounds the instrument: names with units, and values.
    pub limits: Vec<(&'static str, f64)>,
    /// The same for people.
    pub limit_lines: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Name of the row of the signal-to-noise ratio.
pub const TOTAL: &str = "= SNR in the band";

/// The ranges of a scan at which a budget is of use, m: first, middle, last.
pub fn scan_ranges_m(scene: &Scene) -> Vec<f64> {
    let first_m = scene.scan.range_min_m;
    let last_m = scene.scan.range_max_m;
    vec![first_m, 0.5 * (first_m + last_m), last_m]
}

impl Budget {
    /// The budget of a planned scene at some ranges, m; through turbulence that both beams share it runs the phase screens of
    /// the signals or the profile.
    ///
    /// # Errors
    /// What the optics refuse, such as a range beyond both in turbulence.
    pub fn new(plan: &Plan, range_m: &[f64], observer: &dyn Observer) -> Result<Self, Error> {
        let optics = LineOptics {
            plan,
            instrument: &plan.instrument,
            known: &EfficiencyMemo::default(),
            observer,
        };
        let mut budget = Self::of_ratio(plan, range_m, |sorted_m| optics.efficiency_at(sorted_m))?;
        budget.beside_the_ratio(plan)?;
        budget.add_limits(plan)?;
        Ok(budget)
    }

    /// The signal-to-noise ratio in the detector band at each range, dB.
    pub fn snr_db(&self) -> &[f64] {
        self.rows
            .iter()
            .find(|row| row.name == TOTAL)
            .map_or(&[], |row| &row.db)
    }

    /// The table `range_m,row,symbol,db`, range after range.
    pub fn table(&self) -> Table {
        let rows = || {
            self.range_m
                .iter()
                .enumerate()
                .flat_map(|(i, r)| self.rows.iter().map(move |row| (i, *r, row)))
        };
        Table::new()
            .float("range_m", rows().map(|(_, range_m, _)| range_m))
            .text("row", rows().map(|(_, _, row)| row.name))
            .text("symbol", rows().map(|(_, _, row)| row.symbol))
            .float("db", rows().map(|(i, _, row)| row.db[i]))
    }

    /// The table for people, with the limits and the warnings.
    pub fn text(&self) -> String {
        let columns = |cells: &mut dyn Iterator<Item = String>| {
            cells.map(|cell| format!("{cell:>11}")).collect::<String>()
        };
        let mut out = format!("power budget, dB; range in m\n{:66}", "");
        out += &(columns(&mut self.range_m.iter().map(f64::to_string)) + "\n");
        for row in &self.rows {
            let cells = columns(&mut row.db.iter().map(|db| format!("{db:.2}")));
            out += &format!("  {:<28}{:<36}{cells}\n", row.name, row.value);
        }
        out += "limits\n";
        for line in &self.limit_lines {
            out += &format!("  {line}\n");
        }
        for warning in &self.warnings {
            out += &format!("warning: {warning}\n");
        }
        out
    }
}

/// The signal-to-noise ratio of a planned scene at some ranges, dB, without phase screens: in turbulence that of independent paths.
///
/// # Errors
/// What the optics refuse.
pub fn snr_without_screens_db(plan: &Plan, range_m: &[f64]) -> Result<Vec<f64>, Error> {
    let budget = Budget::of_ratio(plan, range_m, |sorted_m| {
        efficiency_by_theory(&plan.instrument, sorted_m)
    })?;
    // The last row of all.
    Ok(budget
        .rows
        .into_iter()
        .next_back()
        .map_or(Vec::new(), |row| row.db))
}

fn increasing(range_m: &[f64]) -> Vec<f64> {
    let mut sorted = range_m.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    sorted
}

fn decibels(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

impl Budget {
    /// All that the signal-to-noise ratio is made of; `efficiency` is asked for increasing ranges, if the scene needs any.
    fn of_ratio(
        plan: &Plan,
        range_m: &[f64],
        efficiency: impl FnOnce(&[f64]) -> Result<EfficiencyProfile, Error>,
    ) -> Result<Self, Error> {
        let mut budget = Self {
            range_m: range_m.to_vec(),
            rows: Vec::new(),
            limits: Vec::new(),
            limit_lines: Vec::new(),
            warnings: plan.warnings.clone(),
        };
        match plan.scene().detector.snr {
            SnrReference::Fixed { snr_db } => {
                budget.same("stated by the scene", "", "detector.snr".into(), snr_db)
            }
            _ => {
                budget.transmitter_and_path(plan, &efficiency(&increasing(range_m))?)?;
                budget.sum("= shot-noise limit", "(14)", "(14)".into());
                budget.receiver(plan);
            }
        }
        budget.sum(TOTAL, "", "one pulse".into());
        Ok(budget)
    }

    /// The ratio in the width of the pulse, and the echo of the pulse before.
    fn beside_the_ratio(&mut self, plan: &Plan) -> Result<(), Error> {
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let width_hz = instrument.pulse.spectral_full_width_half_maximum_hz();
        let gain_db = decibels(scene.detector.bandwidth_hz / width_hz);
        let fwhm_s = instrument.gaussian_fwhm_s();
        // Of a Gaussian the product is 2 ln 2/pi.
        let value = match (width_hz * fwhm_s * PI - 2.0 * LN_2).abs() < 1e-9 {
            true => format!("0.44/{} = {}", si(fwhm_s, "s"), si(width_hz, "Hz")),
            false => si(width_hz, "Hz"),
        };
        let wide = self.sums().iter().map(|db| db + gain_db).collect();
        self.push("= in the width of the pulse", "", value, wide);
        if scene.scan.second_trip.is_some() {
            let echoes = self.at_each(&|range_m| second_trip(plan, range_m))?;
            let value = format!(
                "from {} farther",
                si(ambiguous_range_m(scene.laser.pulse_repetition_hz), "m")
            );
            self.push("= pulse before over echo", "", value, echoes);
        }
        Ok(())
    }

    fn push(&mut self, name: &'static str, symbol: &'static str, value: String, db: Vec<f64>) {
        self.rows.push(Row {
            name,
            symbol,
            value,
            db,
        });
    }

    /// A factor that is the same at every range.
    fn same(&mut self, name: &'static str, symbol: &'static str, value: String, db: f64) {
        self.push(name, symbol, value, vec![db; self.range_m.len()]);
    }

    /// A factor that a scene need not have.
    fn optional(
        &mut self,
        is_there: bool,
        name: &'static str,
        symbol: &'static str,
        value: String,
        db: f64,
    ) {
        if is_there {
            self.same(name, symbol, value, db);
        }
    }

    /// A loss with a word for one that is not there.
    fn or_none(&mut self, is_there: bool, name: &'static str, value: String, db: f64) {
        self.same(name, "", if is_there { value } else { "none".into() }, db);
    }

    fn sums(&self) -> Vec<f64> {
        let factors = self.rows.iter().filter(|row| !row.name.starts_with('='));
        factors.fold(vec![0.0; self.range_m.len()], |sums, row| {
            sums.iter().zip(&row.db).map(|(a, b)| a + b).collect()
        })
    }

    fn sum(&mut self, name: &'static str, symbol: &'static str, value: String) {
        let db = self.sums();
        self.push(name, symbol, value, db);
    }

    /// A factor at each range, dB.
    fn at_each(&self, of: &dyn Fn(f64) -> Result<f64, Error>) -> Result<Vec<f64>, Error> {
        self.range_m
            .iter()
            .map(|&range_m| Ok(decibels(of(range_m)?)))
            .collect()
    }

    /// From the photons of the pulse to the electrons that it gives.
    fn transmitter_and_path(
        &mut self,
        plan: &Plan,
        efficiency: &EfficiencyProfile,
    ) -> Result<(), Error> {
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let telescope = &instrument.telescope;
        let receiver = &instrument.receiver;
        let t = &scene.telescope;
        let energy_j = scene.pulse.energy_j;
        let photon_j = receiver.photon_energy_j();
        let area_m2 = telescope.aperture_area_m2();
        let solid_angle = |r: f64| area_m2 / (r * r);
        let sent = format!("{} / {photon_j:.2e} J", si(energy_j, "J"));
        self.same(
            "photons sent",
            "E/(h nu)",
            sent,
            decibels(energy_j / photon_j),
        );
        let printed = scene.detector.snr == SnrReference::Chapter {};
        self.optional(
            printed,
            "hbar for h",
            "2 pi",
            "as the chapter prints (14)".into(),
            decibels(2.0 * PI),
        );
        let bandwidth_hz = receiver.bandwidth_hz;
        self.same(
            "per bandwidth",
            "1/B",
            si(bandwidth_hz, "Hz"),
            -decibels(bandwidth_hz),
        );
        self.same(
            "range per time",
            "c/2",
            "c/2".into(),
            decibels(0.5 * crate::SPEED_OF_LIGHT_M_S),
        );
        let profile = || "profile".to_owned();
        let atmosphere = &scene.atmosphere;
        let is_profile = atmosphere.profile.is_some() || atmosphere.aerosol.is_some();
        let coefficient = |value: f64, unit: &str| match is_profile {
            true => profile(),
            false => format!("{} {unit}", scientific(value)),
        };
        let backscatter = self.at_each(&|r| {
            let clear = Instrument {
                blind_range_m: 0.0,
                transmission: 1.0,
                ..instrument.clone()
            };
            Ok(clear.return_per_m(r)? / (instrument.air.transmission(r)?.powi(2) * solid_angle(r)))
        })?;
        let value = coefficient(atmosphere.backscatter_per_m_sr, "/(m sr)");
        self.push("backscatter", "beta", value, backscatter);
        let value = format!(
            "A_R/R^2, aperture {}",
            si(2.0 * telescope.aperture_radius_m, "m")
        );
        self.push(
            "solid angle",
            "A_R/R^2",
            value,
            self.at_each(&|r| Ok(solid_angle(r)))?,
        );
        let value = coefficient(atmosphere.extinction_per_m, "/m");
        self.push(
            "air, out and back",
            "K^2",
            value,
            self.at_each(&|r| Ok(instrument.air.transmission(r)?.powi(2)))?,
        );
        let passed = telescope.transmitted_fraction();
        self.same(
            "truncation, two beams",
            "T^2",
            format!("T = {passed:.4}"),
            2.0 * decibels(passed),
        );
        let empty = free_space(instrument, &increasing(&self.range_m))?;
        let antenna = self.at_each(&|r| Ok(empty.interpolated(r)? / passed.powi(2)))?;
        self.push("antenna efficiency", "eta_a", "free space".into(), antenna);
        if let Some(air) = scene.refractive_turbulence() {
            let value = match &air.profile {
                Some(_) => profile(),
                None => format!("Cn2 {} m^(-2/3)", scientific(air.cn2_m_m23)),
            };
            let left =
                self.at_each(&|r| Ok(efficiency.interpolated(r)? / empty.interpolated(r)?))?;
            self.push("turbulence", "eta_s/eta_s(0)", value, left);
        }
        let lost = |db: f64| if db == 0.0 { 0.0 } else { -db };
        self.same(
            "optics",
            "both ways",
            "key optics_loss_db".into(),
            lost(t.optics_loss_db),
        );
        let efficiency = receiver.quantum_efficiency;
        self.same(
            "quantum efficiency",
            "eta_Q",
            format!("{efficiency:.2}"),
            decibels(efficiency),
        );
        if self.range_m.iter().any(|r| *r < t.blind_range_m) {
            let seen = self.at_each(&|r| Ok(f64::from(u8::from(r >= t.blind_range_m))))?;
            self.push(
                "blind range",
                "",
                format!("to {}", si(t.blind_range_m, "m")),
                seen,
            );
        }
        Ok(())
    }

    /// What the receiver loses against the shot-noise limit.
    fn receiver(&mut self, plan: &Plan) {
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let receiver = &instrument.receiver;
        let front = scene.detector.front_end.unwrap_or_default();
        let lost = receiver.penalties();
        let n = receiver.noise_densities();
        let FrontEnd {
            saturation_w,
            half_power_hz,
            dark_current_a,
            intensity_noise_db_hz,
            rejection_db,
            ..
        } = front;
        let value = format!(
            "{} of {}",
            si(receiver.local_oscillator_w, "W"),
            si(saturation_w, "W")
        );
        self.optional(
            saturation_w.is_finite(),
            "saturation",
            "(1 + P/Ps)^-3",
            value,
            -lost.saturation_db,
        );
        let amplifier_a2_hz = n.amplifier_a2_hz;
        let shot_a2_hz = n.shot_a2_hz;
        let root = si(amplifier_a2_hz.sqrt(), "A/rtHz");
        let value = format!("{root}: {amplifier_a2_hz:.1e} of shot {shot_a2_hz:.1e}");
        self.or_none(
            amplifier_a2_hz > 0.0,
            "amplifier noise",
            value,
            -lost.amplifier_db,
        );
        self.or_none(
            dark_current_a > 0.0,
            "dark current",
            si(dark_current_a, "A"),
            -lost.dark_db,
        );
        let value = format!("{intensity_noise_db_hz} dB/Hz, {rejection_db} dB rejected");
        self.or_none(
            n.intensity_a2_hz > 0.0,
            "intensity noise of the LO",
            value,
            -lost.intensity_db,
        );
        let value = format!("half power at {}", si(half_power_hz, "Hz"));
        self.optional(
            half_power_hz.is_finite(),
            "response of the detector",
            "|H|^2",
            value,
            -lost.response_db,
        );
        let (value, is_clipped) = match scene.detector.digitiser {
            Digitiser::None {} => ("none".into(), false),
            Digitiser::Quantised {
                bits,
                full_scale_over_noise: k,
            } => (format!("{bits} bits, {k} x noise"), lost.clipping_db > 0.0),
        };
        self.same("converter", "", value, -lost.rounding_db);
        self.optional(
            is_clipped,
            "clipping",
            "",
            "beyond full scale".into(),
            -lost.clipping_db,
        );
    }
}

/// Echo of the pulse before over that of the last, on the line in the middle of the scan: none from below the ground and none at ranges
/// from which the receiver is blind; NaN where the last pulse has no echo.
fn second_trip(plan: &Plan, range_m: f64) -> Result<f64, Error> {
    let instrument = &plan.instrument;
    let schedule = &plan.geometry.schedule;
    let far_m = range_m + ambiguous_range_m(plan.scene().laser.pulse_repetition_hz);
    let middle = schedule.middle(schedule.lines.len() / 2);
    if range_m < instrument.blind_range_m || middle.at_range_m(far_m)[2] < 0.0 {
        return Ok(0.0);
    }
    let efficiency = efficiency_by_theory(instrument, &[range_m, far_m])?;
    let power = |r: f64| Ok::<_, Error>(instrument.return_per_m(r)? * efficiency.interpolated(r)?);
    let last = power(range_m)?;
    let before = power(far_m)?;
    Ok(if last > 0.0 { before / last } else { f64::NAN })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::progress::Silent;
    use crate::run::run;
    use crate::scene::{ReceiverPath, RefractiveTurbulence, SceneFile, SecondTrip, Turbulence};

    fn budget(text: &str, range_m: &[f64]) -> Budget {
        let file = SceneFile::parse(text, std::path::Path::new("s.toml")).unwrap();
        Budget::new(
            &Plan::new(file, Target::Efficiency).unwrap(),
            range_m,
            &Silent,
        )
        .unwrap()
    }

    const REAL: &str = "[laser]\nlinewidth_hz = 1e3\n\
        [telescope]\noptics_loss_db = 2.2\nreflection_db = -60.0\n\
        [detector]\nquantum_efficiency = 0.8\ndigitiser = { kind = \"quantised\", bits = 8, full_scale_over_noise = 8.0 }\n\
        [detector.front_end]\namplifier_noise_a_rthz = 10e-12\ndark_current_a = 5e-9\n\
        intensity_noise_db_hz = -155.0\nrejection_db = 25.0\n";

    #[test]
    fn rows_of_table_2_and_of_a_real_receiver_are_the_stored_ones() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/reference/receiver/budget.csv"
        );
        let stored = std::fs::read_to_string(path).unwrap();
        for (case, text) in [("table2,", ""), ("table2_real,", REAL)] {
            let found = budget(text, &[400.0]);
            let expected: Vec<f64> = stored
                .lines()
                .filter(|line| line.starts_with(case))
                .map(|line| line.rsplit(',').next().unwrap().parse().unwrap())
                .collect();
            assert_eq!(expected.len(), 16);
            for (row, expected) in found.rows.iter().zip(expected) {
                assert!(
                    (row.db[0] - expected).abs() < 1e-6,
                    "{}: {} {expected}",
                    row.name,
                    row.db[0]
                );
            }
        }
    }

    /// Turbulence with screens that take no time.
    fn coarse() -> Turbulence {
        Turbulence::Refractive(RefractiveTurbulence {
            grid_points: 128,
            grid_spacing_m: 4e-3,
            layers: 4,
            realisations: 5,
            ..RefractiveTurbulence::default()
        })
    }

    #[test]
    fn rows_sum_to_the_profile_for_every_telescope_air_and_receiver() {
        type Change = fn(&mut Scene);
        let changes: [Change; 9] = [
            |s| s.telescope.focus_m = 500.0,
            |s| s.telescope.obscuration_radius_m = 0.01,
            |s| s.detector.snr = SnrReference::Chapter {},
            |s| s.detector.snr = SnrReference::Fixed { snr_db: 3.0 },
            |s| s.telescope.blind_range_m = 250.0,
            |s| {
                (s.telescope.receiver, s.atmosphere.turbulence) = (ReceiverPath::Bistatic, coarse())
            },
            |s| s.atmosphere.turbulence = coarse(),
            |s| {
                let front_end = FrontEnd {
                    saturation_w: 4e-3,
                    half_power_hz: 90e6,
                    poles: 2,
                    load_ohm: 50.0,
                    ..Default::default()
                };
                s.detector.front_end = Some(front_end);
                s.detector.digitiser = Digitiser::Quantised {
                    bits: 5,
                    full_scale_over_noise: 1.5,
                };
                s.scan.second_trip = Some(SecondTrip::default());
            },
            |s| {
                s.atmosphere.profile = Some(crate::scene::AirProfile {
                    range_m: vec![0.0, 300.0, 900.0],
                    backscatter_per_m_sr: vec![2e-7, 1e-7, 4e-7],
                    extinction_per_m: vec![1e-4, 5e-5, 2e-4],
                });
            },
        ];
        for (i, change) in changes.into_iter().enumerate() {
            let mut scene = Scene::default();
            (
                scene.outputs.profile_range_min_m,
                scene.outputs.profile_range_max_m,
            ) = (200.0, 600.0);
            scene.outputs.profile_points = 3;
            change(&mut scene);
            let plan =
                Plan::new(SceneFile::new(scene.clone()).unwrap(), Target::Efficiency).unwrap();
            let profile = run(&plan, &Silent).unwrap().profile.unwrap();
            let found = Budget::new(&plan, &profile.efficiency.range_m, &Silent).unwrap();
            let sums: Vec<f64> = (0..3)
                .map(|at| {
                    found
                        .rows
                        .iter()
                        .filter(|row| !row.name.starts_with('='))
                        .map(|row| row.db[at])
                        .sum()
                })
                .collect();
            for (at, snr_db) in profile.snr_db.iter().enumerate() {
                // Where no light comes back the profile has no ratio.
                let close = |sum: f64| {
                    (sum - snr_db).abs() < 1e-9 || (snr_db.is_nan() && sum == f64::NEG_INFINITY)
                };
                assert!(
                    close(sums[at]) && close(found.snr_db()[at]),
                    "{i}: {} {snr_db}",
                    sums[at]
                );
            }
        }
    }

    /// Row of the pulse before at 320 m, where the receiver is blind, and at 360 m: pulses 1.5 km apart from a lidar 60 m above ground.
    fn second_trip_db(scan: &str, air: &str) -> Vec<f64> {
        let text = format!(
            "[laser]\npulse_repetition_hz = 100e3\n[telescope]\nblind_range_m = 350.0\n\
             [scan]\nlidar_height_m = 60.0\nrange_min_m = 300.0\nrange_max_m = 400.0\nsecond_trip = {{}}\n{scan}\n{air}"
        );
        let rows = budget(&text, &[320.0, 360.0]).rows;
        let row = rows.iter().find(|row| row.name.contains("pulse before"));
        row.unwrap().db.clone()
    }

    #[test]
    fn the_pulse_before_has_no_echo_at_blind_ranges_from_below_the_ground_or_beside_none() {
        let level = "elevation_min_rad = 0.0\nelevation_max_rad = 0.01";
        let seen_db = second_trip_db(level, "");
        assert_eq!(seen_db[0], f64::NEG_INFINITY);
        assert!(seen_db[1].is_finite(), "{seen_db:?}");
        let down = "elevation_min_rad = -0.1\nelevation_max_rad = -0.09";
        assert_eq!(second_trip_db(down, ""), [f64::NEG_INFINITY; 2]);
        let clear = "[atmosphere]\nbackscatter_per_m_sr = 0.0\n";
        assert!(second_trip_db(level, clear)[1].is_nan());
    }

    #[test]
    fn the_width_of_a_pulse_is_that_of_its_spectrum_at_half_its_maximum() {
        // A trapezoid of 400 ns, whose spectrum has far tails: a transform of its own gives 2.448 MHz.
        let time_s: Vec<f64> = (0..=200).map(|i| f64::from(i) * 2e-9).collect();
        let power: Vec<f64> = time_s
            .iter()
            .map(|t| (t.min(4e-7 - t) / 4e-8).min(1.0).powi(2))
            .collect();
        let flat =
            format!("[pulse.shape]\nkind = \"sampled\"\ntime_s = {time_s:?}\npower = {power:?}\n");
        for (text, width_hz) in [(flat.as_str(), 2.4478e6), ("", 2.0 * LN_2 / PI / 200e-9)] {
            let found = budget(text, &[400.0]);
            let row = found
                .rows
                .iter()
                .find(|row| row.name.contains("width of the pulse"))
                .unwrap();
            let gain_db = row.db[0] - found.snr_db()[0];
            assert!(
                (gain_db - 10.0 * (50e6 / width_hz).log10()).abs() < 0.02,
                "{gain_db}: {}",
                row.value
            );
        }
    }

    /// Budget of a receiver with amplifier and intensity noise, and its line of the local oscillator.
    fn saturating(local_oscillator_w: f64, saturation_w: f64) -> (Budget, String) {
        let text = format!(
            "[laser]\nwavelength_m = 2.05e-6\n[detector]\nquantum_efficiency = 0.7\nlocal_oscillator_w = {local_oscillator_w:?}\n\
             [detector.front_end]\namplifier_noise_a_rthz = 10e-12\nload_ohm = 200.0\nload_temperature_k = 310.0\n\
             intensity_noise_db_hz = -150.0\nrejection_db = 20.0\nsaturation_w = {saturation_w:?}\n"
        );
        let found = budget(&text, &[400.0]);
        let mut lines = found.limit_lines.iter();
        let line = lines.find(|line| line.starts_with("local oscillator"));
        let line = line.unwrap().clone();
        (found, line)
    }

    #[test]
    fn noises_that_saturation_keeps_apart_equal_shot_noise_at_no_power() {
        for local_oscillator_w in [2e-3, 1e-3] {
            let (found, line) = saturating(local_oscillator_w, 5e-3);
            assert!(line.contains("shot noise at 556 uW;"), "{line}");
            assert!(
                line.contains("intensity noise is below shot noise at any power"),
                "{line}"
            );
            let mut limits = found.limits.iter();
            assert!(limits.all(|(name, _)| *name != "intensity_equals_shot_w"));
        }
        let (_, line) = saturating(2e-3, 4e-4);
        assert!(
            line.contains("amplifier noise is above shot noise at any power"),
            "{line}"
        );
    }

    #[test]
    fn the_text_has_the_columns_and_limits_that_designers_know() {
        let text = budget(REAL, &[280.0, 400.0, 520.0]).text();
        for line in [
            "power budget, dB; range in m",
            "  photons sent                150 uJ / 1.28e-19 J                      150.68     150.68     150.68",
            "  amplifier noise             10 pA/rtHz: 1.0e-22 of shot 3.2e-22       -1.18      -1.18      -1.18",
            "  = SNR in the band           one pulse                                -12.74     -12.80     -12.86",
            "  = in the width of the pulse 0.44/200 ns = 2.21 MHz                     0.82       0.76       0.69",
            "  velocity: band +-19.4 m/s; sampled -34.9 to +62.0 m/s; flow reaches 17 m/s",
            "  resolution: pulse 30.0 m, gate (pulse and Gaussian window of 64) 33.9 m, full width at half maximum",
        ] {
            assert!(text.lines().any(|found| found == line), "{line}\n{text}");
        }
        for part in [
            "blind to 85.6 m",
            "linewidth 1 kHz: 0.027 m/s",
            "equals it at 320 mW",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
