//! The optics of a plan: phase screens only where no theory is valid, or where they are asked for beside it.

use super::stage::{PlannedStage, Target, run, skip};
use crate::Error;
use crate::interpolation::linspace;
use crate::measure::efficiency_model::{
    MOST_QUADRATURES, OF_QUADRATURES, OF_SCREENS, model, signals_cross_screens, stretches,
    turbulence,
};
use crate::memo::Memo;
use crate::plan::Setup;
use crate::progress::Stage;
use crate::scene::{Problem, RefractiveTurbulence, SceneFile, ScreenSampling, SnrReference};
use std::sync::Arc;
use wakescope_optics::plan::Plan as ScreenPlan;
use wakescope_optics::plan::{Limit, Model, SetUp, Violation, Warning};
use wakescope_optics::{Focus, Telescope, curved_ranges_m, theory};

/// Plans of the phase screens of all stretches of range.
pub(crate) type ScreenPlans = Arc<Vec<ScreenPlan>>;

/// Phase screens and efficiency, their time on one core, s, and the plans of the screens; adds what is doubtful about the screens to
/// `warnings`.
///
/// # Errors
/// Screens that cannot resolve the scene, with every limit and what would do; a beam that no quadrature follows.
pub(super) fn stages(
    setup: &Setup,
    target: Target,
    planned: &Memo<Vec<ScreenPlan>>,
    warnings: &mut Vec<String>,
) -> Result<([PlannedStage; 2], f64, ScreenPlans), Error> {
    let Setup {
        scene: file,
        instrument,
        geometry,
        ..
    } = setup;
    let scene = &file.content;
    let fixed = if let SnrReference::Fixed { snr_db } = scene.detector.snr {
        Some(snr_db)
    } else {
        None
    };
    let o = &scene.outputs;
    let model = model(scene);
    // Ranges at which the efficiency is wanted: for the table, and for the layers of the signals.
    let table = matches!(target, Target::Run | Target::Efficiency).then(|| {
        linspace(
            o.profile_range_min_m,
            o.profile_range_max_m,
            o.profile_points,
        )
    });
    let telescope = &instrument.telescope;
    let layers = (target != Target::Efficiency && fixed.is_none()).then(|| {
        let first_m = geometry.first_layer_range_m;
        let last_m = first_m + geometry.layers as f64 * geometry.layer_thickness_m;
        curved_ranges_m(telescope, first_m, last_m, OF_QUADRATURES)
    });
    let ranges_m: Vec<f64> = table.iter().chain(&layers).flatten().copied().collect();
    refuse_fresnel_numbers(telescope, &ranges_m)?;
    // A table through turbulence has the free-space and the exact bistatic curves beside the Monte Carlo.
    let places = if turbulence(scene).is_some() { 16 } else { 0 };
    let quadratures_s: f64 = ranges_m
        .iter()
        .map(|&r| theory::quadrature_cost_s(telescope, places, r))
        .sum();
    // Of more ranges than this a curve is made.
    let quadratures_s =
        quadratures_s * (MOST_QUADRATURES as f64 / ranges_m.len().max(1) as f64).min(1.0);
    let skipped = |why| (skip(Stage::PhaseScreens, why), 0.0, Arc::default());
    let (screens, screens_s, plans) = match turbulence(scene) {
        None => skipped("no turbulence: atmosphere.turbulence"),
        Some(t) => {
            let drawn = layers.filter(|_| signals_cross_screens(scene));
            let mut across: Vec<f64> = table.iter().chain(&drawn).flatten().copied().collect();
            across.sort_by(f64::total_cmp);
            let of_stretch = |([from_m, to_m], _): ([f64; 2], &[f64])| {
                curved_ranges_m(telescope, from_m, to_m, OF_SCREENS)
            };
            let runs: Vec<Vec<f64>> = stretches(scene, geometry, &across)
                .into_iter()
                .map(of_stretch)
                .collect();
            match (runs.is_empty(), model) {
                (false, _) => screens(setup, &t, &runs, planned, warnings)?,
                (true, Model::ExactBistatic) => {
                    skipped("the bistatic efficiency has an exact theory")
                }
                (true, _) => skipped("not asked for"),
            }
        }
    };
    let efficiency = match fixed {
        Some(snr_db) if ranges_m.is_empty() => skip(
            Stage::Efficiency,
            &format!("detector.snr fixes {snr_db} dB at every range"),
        ),
        _ => {
            let how = match model {
                Model::FreeSpace => "free space, by quadrature",
                Model::ExactBistatic => "independent paths, exact by quadrature",
                Model::MonteCarlo => "one path out and back, by phase screens",
            };
            // Mean, scatter and error of each model.
            let models = if turbulence(scene).is_some() {
                5.0
            } else {
                1.0
            };
            let kept_bytes = ranges_m.len() as f64 * (16.0 + 24.0 * models);
            let reason = format!("{how}, at {} ranges", ranges_m.len());
            run(Stage::Efficiency, reason, [0.0, kept_bytes])
        }
    };
    Ok(([screens, efficiency], quadratures_s + screens_s, plans))
}

/// Refuses a beam whose Fresnel number is too large for the quadratures, in the words of the scene.
fn refuse_fresnel_numbers(telescope: &Telescope, ranges_m: &[f64]) -> Result<(), Error> {
    let worst = ranges_m
        .iter()
        .map(|&r| (theory::fresnel_number(telescope, r), r))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((found, range_m)) = worst.filter(|(n, _)| *n > theory::LARGEST_FRESNEL_NUMBER) else {
        return Ok(());
    };
    let most = theory::LARGEST_FRESNEL_NUMBER;
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

/// The phase screens of all runs, each for its own ranges, their time, s, and their plans.
fn screens(
    setup: &Setup,
    t: &RefractiveTurbulence,
    runs: &[Vec<f64>],
    planned: &Memo<Vec<ScreenPlan>>,
    warnings: &mut Vec<String>,
) -> Result<(PlannedStage, f64, ScreenPlans), Error> {
    let (mut core_s, mut working_bytes) = (0.0, 0.0_f64);
    let mut what = Vec::new();
    let lists: Vec<&[f64]> = runs.iter().map(Vec::as_slice).collect();
    let plan = || {
        setup
            .instrument
            .screen_plans(t, &lists)
            .map_err(|e| refused(&setup.scene, t, e))
    };
    let plans = planned.of(format!("{:?}", (setup.instrument.telescope, t, runs)), plan)?;
    for (range_m, plan) in runs.iter().zip(plans.iter()) {
        core_s += plan.realisation_cpu_s * t.realisations as f64;
        let memory_bytes = plan.memory_bytes_of(t.realisations, rayon::current_num_threads());
        working_bytes = working_bytes.max(memory_bytes as f64);
        let last_m = range_m.last().copied().unwrap_or(0.0);
        let g = plan.grid;
        let mut words = format!(
            "{} screens to {last_m:.0} m of {} x {} points of {:.3} mm",
            plan.layers.end_m().len(),
            g.nx,
            g.ny,
            1e3 * g.dx_m
        );
        if let Some(worst) = plan
            .gaps
            .iter()
            .max_by(|a, b| a.relative.abs().total_cmp(&b.relative.abs()))
        {
            // The layers' own error, known without random numbers, beside the one that the realisations leave.
            words += &format!(
                " (layers shift the mean by {:+.2} % at {:.0} m, where its error is {:.2} %)",
                100.0 * worst.relative,
                worst.range_m,
                100.0 * worst.standard_error
            );
        }
        what.push(words);
        for words in plan.warnings.iter().map(|w| in_words(w, last_m, t)) {
            // That of the inner scale is the same for all.
            if !warnings.contains(&words) {
                warnings.push(words);
            }
        }
    }
    let reason = format!("{} realisations of {}", t.realisations, what.join("; "));
    Ok((
        run(Stage::PhaseScreens, reason, [working_bytes, 0.0]),
        core_s,
        plans,
    ))
}

/// A refusal of the optics in the keys of the scene; the strongest limit of each key is named.
fn refused(file: &SceneFile, t: &RefractiveTurbulence, error: wakescope_optics::Error) -> Error {
    let (violations, would_do) = match error {
        wakescope_optics::Error::Sampling {
            violations,
            would_do,
        } => (violations, would_do),
        other => return other.into(),
    };
    let key = |name: &str| format!("atmosphere.turbulence.{name}");
    let strongest = |which: fn(&Violation) -> bool, sign: f64| {
        violations
            .iter()
            .filter(|v| which(v))
            .max_by(|a, b| (sign * a.needed).total_cmp(&(sign * b.needed)))
    };
    let mut problems = Vec::new();
    if let Some(v) = strongest(|v| v.limit == Limit::Points, 1.0) {
        let allowed = format!(
            "beam and turbulence that at most {} points along an axis resolve and hold, not {}: shorter ranges, a longer focus, or \
             telescope.receiver = \"bistatic\", which needs no screens for signals",
            v.found, v.needed
        );
        problems.push(Problem {
            key: key("sampling"),
            value: "\"derived\"".into(),
            allowed,
        });
    } else if t.sampling == ScreenSampling::Derived {
        let words: Vec<String> = violations.iter().map(ToString::to_string).collect();
        problems.push(Problem {
            key: key("sampling"),
            value: "\"derived\"".into(),
            allowed: words.join("; "),
        });
    } else {
        if let Some(v) = strongest(|v| !v.limit.is_spacing(), 1.0) {
            let mut points = (v.needed / t.grid_spacing_m).ceil() as usize;
            while (points as f64) * t.grid_spacing_m < v.needed {
                points += 1;
            }
            let allowed = format!(
                "at least {points} at atmosphere.turbulence.grid_spacing_m = {}, a width of {} m {}",
                t.grid_spacing_m,
                v.needed,
                v.limit.purpose()
            );
            problems.push(of_grid(
                file,
                ["grid_points", "grid_spacing_m"],
                t.grid_points.to_string(),
                allowed,
            ));
        }
        if let Some(v) = strongest(|v| v.limit.is_spacing(), -1.0) {
            let allowed = format!("at most {} m {}", v.needed, v.limit.purpose());
            problems.push(of_grid(
                file,
                ["grid_spacing_m", "grid_points"],
                t.grid_spacing_m.to_string(),
                allowed,
            ));
        }
    }
    if let Some(last) = problems.last_mut() {
        last.allowed += &match would_do {
            Some(SetUp {
                points,
                spacing_m,
                layers,
            }) => format!(
                "; together, grid_points = {points}, grid_spacing_m = {spacing_m}, layers = {layers} hold, and so does sampling = \
                 \"derived\""
            ),
            None if t.sampling == ScreenSampling::Explicit => {
                "; no grid of at most 16384 points holds all: shorter ranges or a longer focus"
                    .into()
            }
            None => String::new(),
        };
    }
    file.located(problems).into()
}

/// A limit of the first of two keys of the grid; of the other one or of the strength of the turbulence if the file leaves the first to its default.
fn of_grid(file: &SceneFile, [own, other]: [&str; 2], value: String, allowed: String) -> Problem {
    let key = |name: &str| format!("atmosphere.turbulence.{name}");
    match [own, other, "cn2_m_m23"]
        .map(key)
        .into_iter()
        .find(|key| file.states(key))
    {
        Some(stated) if stated != key(own) => {
            let allowed = format!(
                "one for which {own} = {value}, the default, holds, which has to be {allowed}"
            );
            Problem {
                key: stated,
                value: String::new(),
                allowed,
            }
        }
        _ => Problem {
            key: key(own),
            value,
            allowed,
        },
    }
}

fn more_layers(t: &RefractiveTurbulence, needed: Option<usize>) -> String {
    match (t.sampling, needed) {
        (ScreenSampling::Explicit, Some(count)) => {
            format!("atmosphere.turbulence.layers = {count} would do, or sampling = \"derived\"")
        }
        _ => "more than 1000 layers would be needed".into(),
    }
}

fn in_words(warning: &Warning, range_m: f64, t: &RefractiveTurbulence) -> String {
    match warning {
        Warning::InnerScale { missing } => format!(
            "the screens miss {:.1} % of the structure function at one grid spacing: atmosphere.turbulence.grid_spacing_m is \
             above half the inner scale",
            100.0 * missing
        ),
        Warning::ThickLayers {
            rytov_variance,
            layers_needed,
        } => format!(
            "layers to {range_m:.0} m have a Rytov variance of {rytov_variance:.2}, above 0.1: {}",
            more_layers(t, *layers_needed)
        ),
        Warning::LayerGap {
            worst,
            layers_needed,
        } => format!(
            "the layers to {range_m:.0} m shift the mean efficiency by {:+.2} % at {:.0} m, more than a third of its standard \
             error of {:.2} %: {}",
            100.0 * worst.relative,
            worst.range_m,
            100.0 * worst.standard_error,
            more_layers(t, *layers_needed)
        ),
        Warning::LightLost { fraction, width_m } => {
            let points = (width_m / t.grid_spacing_m).ceil();
            let remedy = match points <= 16384.0 && t.sampling == ScreenSampling::Explicit {
                true => format!("atmosphere.turbulence.grid_points = {points} would do"),
                false => "shorter ranges or a wider aperture would".into(),
            };
            let percent = 100.0 * fraction;
            format!(
                "the border of the screens to {range_m:.0} m will take {percent:.1} % of the light, 1 % at most is good: {remedy}"
            )
        }
        Warning::WeakTurbulence { rytov_variance } => format!(
            "turbulence of Rytov variance {rytov_variance:.1e} changes less than the error of phase screens: \
             atmosphere.turbulence.kind = \"none\" is as good"
        ),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use crate::plan::{Plan, Target};
    use crate::scene::SceneFile;
    use std::path::Path;

    fn plan(text: &str) -> Result<Plan, String> {
        let file = SceneFile::parse(text, Path::new("s.toml")).map_err(|e| e.to_string())?;
        Plan::new(file, Target::Efficiency).map_err(|e| e.to_string())
    }

    /// The number that follows `words`.
    fn number(message: &str, words: &str) -> String {
        let (_, rest) = message
            .split_once(words)
            .unwrap_or_else(|| panic!("{words} is not in {message}"));
        rest.chars()
            .take_while(|c| c.is_ascii_digit() || ['.', 'e', '-'].contains(c))
            .collect()
    }

    fn turbulent(cn2: &str, keys: &str) -> String {
        format!("[atmosphere.turbulence]\nkind = \"refractive\"\ncn2_m_m23 = {cn2}\n{keys}")
    }

    #[test]
    fn screens_that_do_not_hold_are_refused_in_keys_with_numbers_that_are_then_accepted() {
        // Width and spacing at once, at the lines that state them.
        let message = plan(&turbulent(
            "1e-12",
            "grid_points = 128\ngrid_spacing_m = 0.004\n",
        ))
        .unwrap_err();
        assert!(
            message.contains("s.toml:4: atmosphere.turbulence.grid_points = 128"),
            "{message}"
        );
        assert!(
            message.contains("s.toml:5: atmosphere.turbulence.grid_spacing_m = 0.004"),
            "{message}"
        );
        let [points, spacing, layers] =
            ["together, grid_points = ", "grid_spacing_m = ", "layers = "].map(|w| {
                number(
                    message.split_at(message.find("together").unwrap()).1,
                    w.trim_start_matches("together, "),
                )
            });
        let good =
            format!("grid_points = {points}\ngrid_spacing_m = {spacing}\nlayers = {layers}\n");
        let accepted = plan(&turbulent("1e-12", &good)).unwrap();
        assert!(accepted.warnings.is_empty(), "{:?}", accepted.warnings);
        // What the file states is blamed, not the default beside it.
        let message = plan(&turbulent("1e-12", "")).unwrap_err();
        assert!(
            message.contains(
                "s.toml:3: atmosphere.turbulence.cn2_m_m23 = 1e-12 is not allowed: one for"
            ),
            "{message}"
        );
        let message = plan(&turbulent("1e-14", "grid_spacing_m = 2e-5\n")).unwrap_err();
        assert!(
            message.contains("s.toml:4: atmosphere.turbulence.grid_spacing_m = 2e-5"),
            "{message}"
        );
        let message = plan(&turbulent(
            "1e-12",
            "grid_points = 128\ngrid_spacing_m = 0.004\n",
        ))
        .unwrap_err();
        // Each number alone mends its own limit.
        let least = number(&message, "at least ");
        let message = plan(&turbulent(
            "1e-12",
            &format!("grid_points = {least}\ngrid_spacing_m = 0.004\n"),
        ))
        .unwrap_err();
        assert!(!message.contains("turbulence.grid_points = "), "{message}");
        let most = number(&message, "at most ");
        plan(&turbulent(
            "1e-12",
            &format!("grid_points = 4000\ngrid_spacing_m = {most}\n"),
        ))
        .unwrap();
    }

    #[test]
    fn a_refusal_that_is_obeyed_is_accepted_however_many_points_it_asks_for() {
        let small = "[telescope]\naperture_radius_m = 0.01\nbeam_radius_m = 0.006\n[outputs]\nprofile_range_max_m = 20000.0\n";
        let with = |keys: &str| plan(&(turbulent("1e-14", keys) + small));
        let message = with("grid_spacing_m = 0.004\n").unwrap_err();
        let together = message.split_at(message.find("together").unwrap()).1;
        let [points, spacing, layers] = ["grid_points = ", "grid_spacing_m = ", "layers = "]
            .map(|words| number(together, words));
        // With a word on the light that even the widest grid would lose.
        for keys in [
            format!("grid_points = {points}\ngrid_spacing_m = {spacing}\nlayers = {layers}\n"),
            "sampling = \"derived\"\n".into(),
        ] {
            let warnings = with(&keys).unwrap().warnings;
            assert!(
                warnings.len() < 2
                    && warnings
                        .iter()
                        .all(|w| w.contains("would take") || w.contains("will take")),
                "{warnings:?}"
            );
        }
        // What an explicit grid is accepted for, a derived one finds.
        let far = "[outputs]\nprofile_range_max_m = 5000.0\n";
        plan(&(turbulent("1e-12", "grid_points = 2460\nlayers = 93\n") + far)).unwrap();
        let derived = plan(&(turbulent("1e-12", "sampling = \"derived\"\n") + far)).unwrap();
        assert!(derived.warnings.is_empty(), "{:?}", derived.warnings);
    }

    #[test]
    fn all_warnings_of_a_run_name_one_number_of_layers_and_none_comes_twice() {
        let scene = |layers: &str| {
            let keys = format!("grid_spacing_m = 0.004\ngrid_points = 256\nlayers = {layers}\n");
            let rest = "[outputs]\nprofile_range_max_m = 1400.0\n[scan]\nrange_max_m = 480.0\n";
            let file =
                SceneFile::parse(&(turbulent("1e-13", &keys) + rest), Path::new("s.toml")).unwrap();
            Plan::new(file, Target::Run).unwrap().warnings
        };
        let warnings = scene("2");
        let named: Vec<String> = warnings
            .iter()
            .filter(|w| w.contains("layers = "))
            .map(|w| number(w, "layers = "))
            .collect();
        assert!(
            named.len() > 2 && named.iter().all(|n| *n == named[0]),
            "{warnings:?}"
        );
        assert!(
            !scene(&named[0]).iter().any(|w| w.contains("layers")),
            "{:?}",
            scene(&named[0])
        );
        let rough = scene("2\ninner_scale_m = 0.005");
        assert_eq!(
            rough.iter().filter(|w| w.contains("inner scale")).count(),
            1,
            "{rough:?}"
        );
    }

    #[test]
    fn beam_of_too_many_fresnel_zones_is_refused_by_its_key() {
        let message = plan("[telescope]\nfocus_m = 1.777e-4\n").unwrap_err();
        assert!(
            message.starts_with("s.toml:2: telescope.focus_m = 1.777e-4"),
            "{message}"
        );
        plan(&format!(
            "[telescope]\nfocus_m = {}\n",
            number(&message, "from ")
        ))
        .unwrap();
        let message = plan("[telescope]\nfocus_m = -1e-3\n").unwrap_err();
        plan(&format!(
            "[telescope]\nfocus_m = {}\n",
            number(&message, "to ")
        ))
        .unwrap();
        let message =
            plan("[telescope]\naperture_radius_m = 10.0\nbeam_radius_m = 6.0\n").unwrap_err();
        assert!(
            message.starts_with("s.toml:2: telescope.aperture_radius_m = 10"),
            "{message}"
        );
        plan(&format!(
            "[telescope]\naperture_radius_m = {}\nbeam_radius_m = 6.0\n",
            number(&message, ": to ")
        ))
        .unwrap();
    }

    #[test]
    fn largest_counts_that_a_scene_may_state_are_planned() {
        let text = turbulent(
            "1e-15",
            "grid_points = 16384\nlayers = 10000\nspectrum = \"kolmogorov\"\n",
        ) + "[outputs]\nprofile_points = 100000\n";
        let plan = plan(&text).unwrap();
        assert!(
            plan.stages
                .iter()
                .any(|s| s.memory_bytes - s.kept_bytes > 1e10)
        );
    }

    #[test]
    fn error_of_the_layers_is_told_and_a_plan_of_its_own_has_enough() {
        let ranges = "[outputs]\nprofile_range_min_m = 200.0\nprofile_range_max_m = 600.0\nprofile_points = 3\n";
        let few = plan(&(turbulent("1e-13", "layers = 3\n") + ranges)).unwrap();
        let warning = few
            .warnings
            .iter()
            .find(|w| w.contains("shift the mean"))
            .unwrap();
        let layers = number(warning, "layers = ");
        let enough = plan(&(turbulent("1e-13", &format!("layers = {layers}\n")) + ranges)).unwrap();
        assert!(enough.warnings.is_empty(), "{:?}", enough.warnings);
        let derived = plan(&(turbulent("1e-13", "sampling = \"derived\"\n") + ranges)).unwrap();
        assert!(derived.warnings.is_empty(), "{:?}", derived.warnings);
        assert!(
            derived.to_string().contains("layers shift the mean"),
            "{derived}"
        );
    }
}
