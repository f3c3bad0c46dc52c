//! Efficiency and signal-to-noise ratio against range, by the cheapest model that is valid.
//!
//! One function says the efficiency at a range, whoever asks. Check: signals, bound, budget and profile have the same, through any
//! focus (`every_output_has_the_same_ratio_through_a_focus`).

use crate::Error;
use crate::interpolation::{interpolate, linspace};
use crate::measure::efficiency_model::{
    MOST_QUADRATURES, OF_QUADRATURES, OF_SCREENS, model, stretches,
};
use crate::measure::plane;
use crate::memo::Memo;
use crate::plan::instrument::Instrument;
use crate::plan::{Plan, PlannedStage, Stage, Target};
use crate::progress::Observer;
use crate::scene::{ReceiverPath, SnrReference, hash_of};
use std::ops::ControlFlow;
use std::sync::Arc;
use wakescope_optics::air::StructureTable;
use wakescope_optics::plan::{DOUBTFUL_LOSS, Model, Plan as ScreenPlan};
use wakescope_optics::theory::{bistatic_efficiency_with, free_space_efficiency};
use wakescope_optics::{
    EfficiencyProfile, Focus, Misalignment, Stop, Telescope, curved_ranges_m, theory,
};

/// Efficiency (19) and signal-to-noise ratio (14) at the same ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeProfile {
    /// Efficiency by the model that the scene's signals use, with its scatter and error.
    pub efficiency: EfficiencyProfile,
    /// Mean signal-to-noise ratio in the detector band, dB, for a pulse short against the changes
    /// of the path; NaN where no light comes back.
    pub snr_db: Vec<f64>,
    /// The other models side by side, by the name of their column; empty without turbulence.
    pub others: Vec<(&'static str, EfficiencyProfile)>,
    /// Largest mean fraction of the power that the absorbing border of the phase screens took; above 0.01 the
    /// Monte Carlo is doubtful. `None` without one.
    pub lost_power_fraction: Option<f64>,
}

/// Efficiency curves, phase screens and their plans that scenes with the same path share.
#[derive(Debug, Default)]
pub(crate) struct EfficiencyMemo {
    layers: Memo<EfficiencyProfile>,
    screens: Memo<Screens>,
    pub(crate) screen_plans: Memo<Vec<ScreenPlan>>,
}

impl EfficiencyMemo {
    /// Number of efficiency curves that were computed.
    pub(crate) fn computed(&self) -> usize {
        self.layers.len()
    }
}

/// Ranges of the table of the efficiency, m; none if no table is requested.
pub(crate) fn table_ranges_m(plan: &Plan) -> Vec<f64> {
    if !plan.target.has_profile() {
        return Vec::new();
    }
    let o = &plan.scene().outputs;
    linspace(
        o.profile_range_min_m,
        o.profile_range_max_m,
        o.profile_points,
    )
}

/// Ranges between which the efficiency of the layers is interpolated, m; none if the signals need
/// none.
pub(crate) fn layer_ranges_m(plan: &Plan) -> Vec<f64> {
    let is_fixed = matches!(plan.scene().detector.snr, SnrReference::Fixed { .. });
    if is_fixed || plan.target == Target::Efficiency {
        return Vec::new();
    }
    let g = &plan.geometry;
    let last_m = g.first_layer_range_m + g.layers as f64 * g.layer_thickness_m;
    let telescope = &plan.instrument.telescope;
    curved_ranges_m(telescope, g.first_layer_range_m, last_m, OF_QUADRATURES)
}

/// The stage of the efficiency.
///
/// # Errors
/// Fails if the Fresnel number of the beam is too large for the quadratures.
pub(crate) fn planned(plan: &Plan) -> Result<PlannedStage, Error> {
    let scene = plan.scene();
    let telescope = &plan.instrument.telescope;
    let mut ranges_m = table_ranges_m(plan);
    ranges_m.extend(layer_ranges_m(plan));
    refuse_fresnel_numbers(telescope, &ranges_m)?;
    if let (SnrReference::Fixed { snr_db }, true) = (scene.detector.snr, ranges_m.is_empty()) {
        let reason = format!("detector.snr fixes {snr_db} dB at every range");
        return Ok(PlannedStage::skipped(Stage::Efficiency, &reason));
    }
    // A table through turbulence has the free-space and the exact bistatic curves beside the Monte
    // Carlo: mean, scatter and error of each model.
    let (places, models) = match scene.refractive_turbulence() {
        Some(_) => (16, 5.0),
        None => (0, 1.0),
    };
    let mut quadratures_s = 0.0;
    for &range_m in &ranges_m {
        quadratures_s += theory::quadrature_cost_s(telescope, places, range_m);
    }
    // Of more ranges than this a curve is made.
    let computed = (MOST_QUADRATURES as f64 / ranges_m.len().max(1) as f64).min(1.0);
    let method = match model(scene) {
        Model::FreeSpace => "free space, by quadrature",
        Model::ExactBistatic => "independent paths, exact by quadrature",
        Model::MonteCarlo => "one path out and back, by phase screens",
    };
    let reason = format!("{method}, at {} ranges", ranges_m.len());
    let kept_bytes = ranges_m.len() as f64 * (16.0 + 24.0 * models);
    Ok(PlannedStage::running(Stage::Efficiency, reason)
        .with_memory(0.0, kept_bytes, plane::FEWER_POINTS.into())
        .with_time(quadratures_s * computed))
}

/// Refuses a beam whose Fresnel number is too large for the quadratures, by the key that reduces it.
fn refuse_fresnel_numbers(telescope: &Telescope, ranges_m: &[f64]) -> Result<(), Error> {
    let most = theory::LARGEST_FRESNEL_NUMBER;
    let mut found = most;
    let mut range_m = f64::NAN;
    for &at_m in ranges_m {
        let number = theory::fresnel_number(telescope, at_m);
        if number > most && number >= found {
            found = number;
            range_m = at_m;
        }
    }
    if range_m.is_nan() {
        return Ok(());
    }
    let excess = format!(
        "a Fresnel number a^2 |1/R - 1/F| / lambda of at most {most}, for which the efficiency has a quadrature; it is {found:.0} at \
         {range_m} m"
    );
    // Without the focus the number would be this.
    let rest = theory::fresnel_number(
        &Telescope {
            focus: Focus::Collimated,
            ..*telescope
        },
        range_m,
    );
    Err(match telescope.focus {
        Focus::At(focus_m) if rest < most => {
            // |1/R - 1/F| <= limit from F = 1/(1/R + limit) upwards, of either sign.
            let shortest_m = range_m * rest / (most + if focus_m > 0.0 { rest } else { -rest });
            let sign = if focus_m > 0.0 { "from " } else { "to -" };
            let reason = format!("{excess}: {sign}{:.2} m", 1.01 * shortest_m + 0.01);
            Error::Key {
                key: "telescope.focus_m",
                reason,
            }
        }
        _ => {
            let largest_m = 0.99 * telescope.aperture_radius_m * (most / found).sqrt();
            Error::Key {
                key: "telescope.aperture_radius_m",
                reason: format!("{excess}: to {largest_m:.4} m"),
            }
        }
    })
}

/// The optics of a plan along its lines: what is known of them already, and who is told of what is made.
#[derive(Clone, Copy)]
pub(crate) struct LineOptics<'a> {
    pub(crate) plan: &'a Plan,
    /// The instrument with the air of the line.
    pub(crate) instrument: &'a Instrument,
    pub(crate) known: &'a EfficiencyMemo,
    pub(crate) observer: &'a dyn Observer,
}

impl LineOptics<'_> {
    /// The profile at some ranges, m, increasing: with turbulence, theory and Monte Carlo side by side.
    ///
    /// # Errors
    /// What the optics refuse, such as a grid too small for the beam; in turbulence that phase screens cross, ranges beyond the signals and
    /// the profile of the scene.
    pub(crate) fn profile_at(&self, range_m: &[f64]) -> Result<RangeProfile, Error> {
        let scene = self.plan.scene();
        let instrument = self.instrument;
        let theory = efficiency_by_theory(instrument, range_m)?;
        let mut others = Vec::new();
        let mut lost_power_fraction = None;
        let mut efficiency = theory.clone();
        if scene.refractive_turbulence().is_some() {
            let ([monostatic, bistatic], lost) = self.across_screens(&theory)?;
            lost_power_fraction = Some(lost);
            if model(scene) == Model::MonteCarlo {
                efficiency = monostatic.clone();
            }
            others.push(("efficiency_free_space", free_space(instrument, range_m)?));
            others.push(("efficiency_bistatic_exact", theory));
            others.push(("efficiency_monostatic_monte_carlo", monostatic));
            others.push(("efficiency_bistatic_monte_carlo", bistatic));
        }
        // No light comes back from the blind range or from air without aerosol.
        let known = |db: f64| if db.is_finite() { db } else { f64::NAN };
        let snr_db = snr_db(self.plan, &efficiency)?
            .into_iter()
            .map(known)
            .collect();
        Ok(RangeProfile {
            efficiency,
            snr_db,
            others,
            lost_power_fraction,
        })
    }

    /// The efficiency at given ranges, m, increasing, by the cheapest model that is valid: the one that signals, budget, bound, map and
    /// profile have.
    ///
    /// # Errors
    /// As [`Self::profile_at`].
    pub(crate) fn efficiency_at(&self, range_m: &[f64]) -> Result<EfficiencyProfile, Error> {
        let theory = efficiency_by_theory(self.instrument, range_m)?;
        match model(self.plan.scene()) {
            Model::MonteCarlo => Ok(self.across_screens(&theory)?.0[0].clone()),
            _ => Ok(theory),
        }
    }

    /// The efficiency at the layers of the lines, as [`Self::efficiency_at`].
    pub(crate) fn of_layers(&self) -> Result<Arc<EfficiencyProfile>, Error> {
        let ranges_m: Vec<f64> = self.plan.geometry.layer_range_m().collect();
        self.known.layers.get_or_make(self.cause(&ranges_m), || {
            self.observer.begin(Stage::Efficiency, 1);
            let profile = self.efficiency_at(&ranges_m)?;
            self.observer.end();
            Ok(profile)
        })
    }

    /// The phase screens of a stretch of range, m.
    pub(crate) fn screens(&self, [from_m, to_m]: [f64; 2]) -> Result<Arc<Screens>, Error> {
        let range_m = curved_ranges_m(&self.plan.instrument.telescope, from_m, to_m, OF_SCREENS);
        self.known
            .screens
            .get_or_make(self.cause(&range_m), || self.run_screens(range_m))
    }

    /// The monostatic and the bistatic efficiency across phase screens at the ranges of `theory`, and the light lost at the border: the
    /// ratio to theory, which is smooth, on straight lines between the ranges of the screens, times theory.
    fn across_screens(
        &self,
        theory: &EfficiencyProfile,
    ) -> Result<([EfficiencyProfile; 2], f64), Error> {
        let mut found = [const { Vec::new() }; 6];
        let mut done = 0;
        let mut lost = 0f64;
        for (ends_m, inside) in stretches(self.plan.scene(), &self.plan.geometry, &theory.range_m) {
            let screens = self.screens(ends_m)?;
            lost = lost.max(screens.lost_power_fraction);
            if theory.range_m.get(done) != inside.first() {
                break;
            }
            for &range_m in inside {
                for (column, ratio) in found.iter_mut().zip(screens.over_theory.as_flattened()) {
                    column.push(theory.mean[done] * interpolate(&screens.range_m, ratio, range_m));
                }
                done += 1;
            }
        }
        if let Some(&range_m) = theory.range_m.get(done) {
            let o = &self.plan.scene().outputs;
            let first_m = o.profile_range_min_m;
            let last_m = o.profile_range_max_m;
            return Err(wakescope_optics::Error::Extrapolation {
                range_m,
                first_m,
                last_m,
            }
            .into());
        }
        let profile =
            |[mean, standard_deviation, standard_error]: [Vec<f64>; 3]| EfficiencyProfile {
                range_m: theory.range_m.clone(),
                mean,
                standard_deviation,
                standard_error,
            };
        let [a, b, c, d, e, f] = found;
        Ok(([profile([a, b, c]), profile([d, e, f])], lost))
    }

    /// What a curve depends on: on the seed only in turbulence, where screens may be drawn.
    fn cause(&self, range_m: &[f64]) -> String {
        let scene = self.plan.scene();
        let air = &scene.atmosphere.turbulence;
        let laser = scene.laser.wavelength_m;
        let seed = scene.refractive_turbulence().map(|_| scene.seed);
        let cn2 = self.instrument.turbulence.as_ref().map(|t| &t.cn2);
        hash_of(&format!(
            "{:?}",
            (laser, &scene.telescope, air, cn2, seed, range_m)
        ))
    }

    /// Runs the screens of some ranges, m, increasing.
    ///
    /// # Errors
    /// What the optics refuse, such as a grid too small for the beam.
    fn run_screens(&self, range_m: Vec<f64>) -> Result<Screens, Error> {
        let scene = self.plan.scene();
        let instrument = self.instrument;
        let observer = self.observer;
        let t = scene.refractive_turbulence().unwrap_or_default();
        observer.begin(Stage::PhaseScreens, t.realisations as u64);
        let mut seen = 0;
        // Single precision: its rounding is far below the error of any number of realisations.
        let estimate = instrument
            .monte_carlo(&t, &range_m, scene.seed)?
            .run_in::<f32>(Stop::after(t.realisations), |progress| {
                observer.advance((progress.done - seen) as u64);
                seen = progress.done;
                ControlFlow::Continue(())
            })?;
        observer.end();
        let lost_power_fraction = estimate
            .lost_power_fraction
            .iter()
            .copied()
            .fold(0.0, f64::max);
        if lost_power_fraction > DOUBTFUL_LOSS {
            observer.warn(&format!(
                "the border of the phase screens took {lost_power_fraction:.3} of the light, 0.01 at most is good: a wider grid is \
                 needed, more atmosphere.turbulence.grid_points or sampling = \"derived\""
            ));
        }
        // A checked scene has at least two realisations, and so pairs of them.
        let pairs = wakescope_optics::Error::Length {
            field: "realisations",
            found: 1,
            expected: 2,
        };
        let theory = efficiency_by_theory(instrument, &range_m)?.mean;
        let over_theory = [estimate.monostatic, estimate.bistatic.ok_or(pairs)?].map(|found| {
            let over = |values: Vec<f64>| {
                values
                    .iter()
                    .zip(&theory)
                    .map(|(value, eta)| value / eta)
                    .collect()
            };
            [found.mean, found.standard_deviation, found.standard_error].map(over)
        });
        let by_range = match scene.telescope.receiver {
            ReceiverPath::Monostatic => estimate.monostatic_realisations,
            ReceiverPath::Bistatic => estimate.bistatic_realisations,
        };
        let count = by_range.iter().map(Vec::len).min().unwrap_or(0);
        let mean: Vec<f64> = by_range
            .iter()
            .map(|all| all[..count].iter().sum::<f64>() / count as f64)
            .collect();
        let over_mean = |i: usize| {
            by_range
                .iter()
                .zip(&mean)
                .map(|(all, mean)| all[i] / mean)
                .collect()
        };
        let realisations = (0..count).map(over_mean).collect();
        Ok(Screens {
            range_m,
            over_theory,
            realisations,
            lost_power_fraction,
        })
    }
}

/// Mean signal-to-noise ratio (14) in the detector band at the ranges of an efficiency, dB, or what the scene fixes.
pub(crate) fn snr_db(plan: &Plan, efficiency: &EfficiencyProfile) -> Result<Vec<f64>, Error> {
    let scene = plan.scene();
    let instrument = &plan.instrument;
    let snr_db = |(&range_m, &mean): (&f64, &f64)| match scene.detector.snr {
        SnrReference::Fixed { snr_db } => Ok(snr_db),
        _ => {
            let returned = instrument.return_per_m(range_m)? * mean;
            Ok(10.0
                * instrument
                    .receiver
                    .slowly_varying_snr(scene.pulse.energy_j, returned)
                    .log10())
        }
    };
    efficiency
        .range_m
        .iter()
        .zip(&efficiency.mean)
        .map(snr_db)
        .collect()
}

pub(crate) fn free_space(
    instrument: &Instrument,
    range_m: &[f64],
) -> Result<EfficiencyProfile, Error> {
    of_theory(instrument, range_m, |range_m| {
        free_space_efficiency(&instrument.telescope, range_m)
    })
}

/// The efficiency without phase screens: of free space, and in turbulence the exact mean of independent paths, which leaves out
/// what a path out and back gains.
///
/// # Errors
/// What the optics refuse, such as a range of 0.
pub(crate) fn efficiency_by_theory(
    instrument: &Instrument,
    range_m: &[f64],
) -> Result<EfficiencyProfile, Error> {
    let Some(turbulence) = &instrument.turbulence else {
        return free_space(instrument, range_m);
    };
    let table = StructureTable::new(&*turbulence.spectrum);
    of_theory(instrument, range_m, |range_m| {
        bistatic_efficiency_with(
            &instrument.telescope,
            &Misalignment::NONE,
            &turbulence.cn2,
            &table,
            range_m,
        )
    })
}

/// A quadrature at each range, or at as many as the curvature asks for where there are more.
fn of_theory(
    instrument: &Instrument,
    range_m: &[f64],
    quadrature: impl Fn(f64) -> Result<f64, wakescope_optics::Error>,
) -> Result<EfficiencyProfile, Error> {
    match *range_m {
        [first_m, .., last_m] if range_m.len() > MOST_QUADRATURES => {
            let curved_m = curved_ranges_m(&instrument.telescope, first_m, last_m, OF_QUADRATURES);
            let curve = EfficiencyProfile::from_theory(&curved_m, quadrature)?;
            Ok(EfficiencyProfile::from_theory(range_m, |range_m| {
                curve.interpolated(range_m)
            })?)
        }
        _ => Ok(EfficiencyProfile::from_theory(range_m, quadrature)?),
    }
}

/// What phase screens give for both receivers.
#[derive(Debug)]
pub(crate) struct Screens {
    pub(crate) range_m: Vec<f64>,
    /// Mean, scatter and standard error, monostatic and then bistatic, over theory: `[receiver][number][range]`.
    over_theory: [[Vec<f64>; 3]; 2],
    /// Of the receiver of the scene, over their mean: `[realisation][range]`.
    pub(crate) realisations: Vec<Vec<f64>>,
    /// Largest mean fraction of the power that the border of the grid took.
    lost_power_fraction: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::bound::bound;
    use crate::measure::budget::Budget;
    use crate::progress::Silent;
    use crate::run::run;
    use crate::scene::SceneFile;
    use std::path::Path;

    fn plan(telescope: &str, [from_m, to_m]: [f64; 2], more: &str, target: Target) -> Plan {
        let text = format!(
            "[telescope]\n{telescope}\n[scan]\nelevation_min_rad = 0.1\nelevation_max_rad = 0.1\nrange_min_m = {from_m:?}\n\
             range_max_m = {to_m:?}\npulses_per_line = 1\nrealisations = 2\n[estimator]\ngate_step_samples = 150\n{more}"
        );
        let file =
            SceneFile::parse(&text, Path::new("s.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"));
        Plan::new(file, target).unwrap()
    }

    fn optics<'a>(plan: &'a Plan, known: &'a EfficiencyMemo) -> LineOptics<'a> {
        LineOptics {
            plan,
            instrument: &plan.instrument,
            known,
            observer: &Silent,
        }
    }

    /// (14) as it is written, for a return that changes slowly over the pulse, in even air.
    fn of_14(plan: &Plan, range_m: f64, efficiency: f64) -> f64 {
        const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
        let scene = plan.scene();
        let air = &plan.scene().atmosphere;
        let photon_j = 6.626_070_15e-34 * SPEED_OF_LIGHT_M_S / scene.laser.wavelength_m;
        let photons = scene.detector.quantum_efficiency * scene.pulse.energy_j / photon_j;
        let area_m2 = std::f64::consts::PI * scene.telescope.aperture_radius_m.powi(2);
        let seen = (-2.0 * air.extinction_per_m * range_m).exp() * area_m2 / (range_m * range_m)
            * efficiency;
        photons / scene.detector.bandwidth_hz
            * 0.5
            * SPEED_OF_LIGHT_M_S
            * air.backscatter_per_m_sr
            * seen
    }

    /// Signal-to-noise ratios of `bound`, `budget` and the profile at the ranges of the bound, dB.
    fn three_outputs(plan: &Plan) -> Vec<(f64, [f64; 3])> {
        let of_bound = bound(plan, &Silent).unwrap().by_range;
        let ranges_m: Vec<f64> = of_bound.iter().map(|p| p.range_m).collect();
        let budget = Budget::new(plan, &ranges_m, &Silent).unwrap();
        let profile = optics(plan, &EfficiencyMemo::default())
            .profile_at(&ranges_m)
            .unwrap();
        let all = of_bound.iter().zip(budget.snr_db()).zip(&profile.snr_db);
        all.map(|((bound, budget), profile)| (bound.range_m, [bound.snr_db, *budget, *profile]))
            .collect()
    }

    #[test]
    fn every_output_has_the_ratio_of_14_through_any_focus() {
        const WIDE: &str = "focus_m = 600.0\naperture_radius_m = 0.15\nbeam_radius_m = 0.09";
        for (telescope, ends_m) in [
            ("focus_m = 300.0", [150.0, 1500.0]),
            (WIDE, [200.0, 2000.0]),
            (
                "focus_m = -700.0\nobscuration_radius_m = 0.02",
                [150.0, 900.0],
            ),
        ] {
            let plan = plan(telescope, ends_m, "", Target::Map);
            let found = three_outputs(&plan);
            assert!(found.len() > 1);
            for (range_m, outputs_db) in found {
                let efficiency =
                    free_space_efficiency(&plan.instrument.telescope, range_m).unwrap();
                let exact_db = 10.0 * of_14(&plan, range_m, efficiency).log10();
                for (snr_db, error_db) in outputs_db.into_iter().zip([0.01, 1e-9, 1e-9]) {
                    assert!(
                        (snr_db - exact_db).abs() < error_db,
                        "{telescope} {range_m}: {outputs_db:?} {exact_db}"
                    );
                }
            }
        }
    }

    #[test]
    fn every_output_has_the_same_ratio_through_a_focus_in_turbulence() {
        for (receiver, efficiency) in [("monostatic", "realisation"), ("bistatic", "realisation")] {
            let more = format!(
                "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-13\ngrid_points = 160\ngrid_spacing_m = 0.0022\n\
                 layers = 5\nrealisations = 5\nefficiency = \"{efficiency}\"\n[outputs]\nprofile_range_min_m = 120.0\n\
                 profile_range_max_m = 660.0\nprofile_points = 5\n"
            );
            let telescope = format!("focus_m = 300.0\nreceiver = \"{receiver}\"");
            let plan = plan(&telescope, [200.0, 540.0], &more, Target::Run);
            for (range_m, [bound, budget, profile]) in three_outputs(&plan) {
                assert!(
                    (bound - budget).abs() < 0.02 && (budget - profile).abs() < 1e-9,
                    "{range_m}: {bound} {budget} {profile}"
                );
            }
            // The profile of a run, the middle of its scan, and ranges before and behind the signals.
            let result = run(&plan, &Silent).unwrap();
            let profile = result.profile.unwrap();
            let budget = Budget::new(&plan, &profile.efficiency.range_m, &Silent).unwrap();
            for (a, b) in budget.snr_db().iter().zip(&profile.snr_db) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
            let middle = result.middle.unwrap();
            let there = optics(&plan, &EfficiencyMemo::default())
                .efficiency_at(&[middle.range_m])
                .unwrap();
            assert!((middle.efficiency / there.mean[0] - 1.0).abs() < 1e-12);
            assert!((middle.snr_db - snr_db(&plan, &there).unwrap()[0]).abs() < 0.02);
        }
    }

    #[test]
    fn signals_have_their_efficiency_wherever_the_profile_begins_and_ends() {
        for [first_m, last_m] in [[120.0, 660.0], [300.0, 400.0], [600.0, 660.0], [50.0, 60.0]] {
            let more = format!(
                "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-13\ngrid_points = 160\ngrid_spacing_m = 0.0022\n\
                 layers = 5\nrealisations = 5\n[outputs]\nprofile_range_min_m = {first_m:?}\nprofile_range_max_m = {last_m:?}\n"
            );
            let plan = plan("focus_m = 300.0", [200.0, 540.0], &more, Target::Run);
            let mut ranges_m: Vec<f64> = plan
                .geometry
                .layer_range_m()
                .chain([first_m, last_m])
                .collect();
            ranges_m.sort_by(f64::total_cmp);
            let found: usize = stretches(plan.scene(), &plan.geometry, &ranges_m)
                .iter()
                .map(|s| s.1.len())
                .sum();
            assert_eq!(found, ranges_m.len(), "{first_m} {last_m}");
        }
    }

    #[test]
    fn what_is_joined_between_ranges_of_the_screens_is_what_they_give_there() {
        let more = "[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = 1e-13\ngrid_points = 160\n\
             grid_spacing_m = 0.0022\nlayers = 5\nrealisations = 8\n[outputs]\nprofile_range_max_m = 560.0\n";
        let plan = plan("focus_m = 300.0", [200.0, 500.0], more, Target::Map);
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let (ends_m, _) = stretches(scene, &plan.geometry, &[300.0])[0];
        let nodes_m = curved_ranges_m(&instrument.telescope, ends_m[0], ends_m[1], OF_SCREENS);
        let between_m: Vec<f64> = nodes_m.windows(2).map(|r| 0.5 * (r[0] + r[1])).collect();
        let mut all_m: Vec<f64> = nodes_m.iter().chain(&between_m).copied().collect();
        all_m.sort_by(f64::total_cmp);
        // One run at all of them has the same layers and random numbers: what differs is the interpolation.
        let screens = optics(&plan, &EfficiencyMemo::default())
            .run_screens(all_m.clone())
            .unwrap();
        let ratio = |range_m: &f64| {
            screens.over_theory[0][0][all_m.iter().position(|m| m == range_m).unwrap()]
        };
        let at_nodes: Vec<f64> = nodes_m.iter().map(ratio).collect();
        for range_m in &between_m {
            let off_db =
                10.0 * (interpolate(&nodes_m, &at_nodes, *range_m) / ratio(range_m)).log10();
            assert!(off_db.abs() < 0.04, "{range_m}: {off_db}");
        }
    }

    #[test]
    fn the_summary_has_the_efficiency_of_the_middle_however_few_points_the_profile_has() {
        for (telescope, target) in [("", Target::Run), ("focus_m = 420.0", Target::Efficiency)] {
            let plan = plan(
                telescope,
                [280.0, 520.0],
                "[outputs]\nprofile_points = 2\n",
                target,
            );
            let middle = run(&plan, &Silent).unwrap().middle.unwrap();
            let exact = free_space_efficiency(&plan.instrument.telescope, 400.0).unwrap();
            assert!(
                (middle.efficiency / exact - 1.0).abs() < 1e-12,
                "{} {exact}",
                middle.efficiency
            );
            let snr_db = 10.0 * of_14(&plan, 400.0, exact).log10();
            assert!(
                (middle.snr_db - snr_db).abs() < 1e-3,
                "{} {snr_db}",
                middle.snr_db
            );
        }
    }
}
