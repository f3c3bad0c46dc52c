//! The stage of the phase screens: only where no theory is valid, or where they are requested beside
//! it.

use crate::Error;
use crate::measure::efficiency_model::{OF_SCREENS, model, signals_cross_screens, stretches};
use crate::measure::profile::{EfficiencyMemo, layer_ranges_m, table_ranges_m};
use crate::plan::instrument::Instrument;
use crate::plan::{Plan, PlannedStage, Stage};
use crate::scene::{Problem, RefractiveTurbulence, SceneFile, ScreenSampling};
use std::sync::Arc;
use wakescope_optics::curved_ranges_m;
use wakescope_optics::plan::Plan as ScreenPlan;
use wakescope_optics::plan::{LayerGap, Limit, Model, SetUp, Violation, Warning};

/// The stage of the phase screens, and the plans of the screens of all stretches of range.
///
/// # Errors
/// Fails if screens cannot resolve the scene, with every limit and what would do.
pub(crate) fn planned(
    plan: &Plan,
    memo: &EfficiencyMemo,
) -> Result<(PlannedStage, Arc<Vec<ScreenPlan>>), Error> {
    let skipped = |why: &str| {
        let stage = PlannedStage::skipped(Stage::PhaseScreens, why);
        Ok((stage, Arc::default()))
    };
    let Some(t) = plan.scene().refractive_turbulence() else {
        return skipped("no turbulence: atmosphere.turbulence");
    };
    let ranges_m = screen_ranges_m(plan);
    if ranges_m.is_empty() {
        return skipped(match model(plan.scene()) {
            Model::ExactBistatic => "the bistatic efficiency has an exact theory",
            _ => "not asked for",
        });
    }
    let of_air = |instrument: &Instrument| {
        let cn2 = instrument.turbulence.as_ref().map(|t| &t.cn2);
        let key = format!("{:?}", (instrument.telescope, &t, cn2, &ranges_m));
        memo.screen_plans.get_or_make(key, || {
            let runs: Vec<&[f64]> = ranges_m.iter().map(Vec::as_slice).collect();
            let plans = instrument.screen_plans(&t, &runs);
            plans.map_err(|error| refused(&plan.file, &t, error))
        })
    };
    let screens = of_air(&plan.instrument)?;
    let mut core_s = 0.0;
    // Those of other elevations, where Cn2 changes with height.
    for instrument in &plan.turbulences()[1..] {
        for screens in of_air(instrument)?.iter() {
            core_s += screens.realisation_cpu_s * t.realisations as f64;
        }
    }
    let mut working_bytes = 0.0_f64;
    let mut descriptions = Vec::new();
    for (range_m, screens) in ranges_m.iter().zip(screens.iter()) {
        core_s += screens.realisation_cpu_s * t.realisations as f64;
        let memory_bytes = screens.memory_bytes_of(t.realisations, rayon::current_num_threads());
        working_bytes = working_bytes.max(memory_bytes as f64);
        descriptions.push(described(screens, range_m.last().copied().unwrap_or(0.0)));
    }
    let reason = format!(
        "{} realisations of {}",
        t.realisations,
        descriptions.join("; ")
    );
    let remedy = match t.sampling {
        ScreenSampling::Derived => "a smaller scan.range_max_m and outputs.profile_range_max_m",
        ScreenSampling::Explicit => "fewer atmosphere.turbulence.grid_points",
    };
    let stage = PlannedStage::running(Stage::PhaseScreens, reason)
        .with_memory(working_bytes, 0.0, remedy.into())
        .with_time(core_s);
    Ok((stage, screens))
}

/// What is doubtful about the phase screens of a plan, each warning once.
pub(crate) fn warnings(plan: &Plan, screens: &[ScreenPlan]) -> Vec<String> {
    let mut out = Vec::new();
    let Some(t) = plan.scene().refractive_turbulence() else {
        return out;
    };
    for (range_m, screens) in screen_ranges_m(plan).iter().zip(screens) {
        let last_m = range_m.last().copied().unwrap_or(0.0);
        for warning in &screens.warnings {
            let text = warning_text(warning, last_m, &t);
            // That of the inner scale is the same for all.
            if !out.contains(&text) {
                out.push(text);
            }
        }
    }
    out
}

/// Ranges of each run of phase screens, m: one run for each stretch of range that has its own.
fn screen_ranges_m(plan: &Plan) -> Vec<Vec<f64>> {
    let mut across_m = table_ranges_m(plan);
    if signals_cross_screens(plan.scene()) {
        across_m.extend(layer_ranges_m(plan));
    }
    across_m.sort_by(f64::total_cmp);
    let mut runs = Vec::new();
    for ([from_m, to_m], _) in stretches(plan.scene(), &plan.geometry, &across_m) {
        runs.push(curved_ranges_m(
            &plan.instrument.telescope,
            from_m,
            to_m,
            OF_SCREENS,
        ));
    }
    runs
}

/// Screens of one run up to a range, m, in words.
fn described(screens: &ScreenPlan, last_m: f64) -> String {
    let g = screens.grid;
    let mut text = format!(
        "{} screens to {last_m:.0} m of {} x {} points of {:.3} mm",
        screens.layers.end_m().len(),
        g.nx,
        g.ny,
        1e3 * g.dx_m
    );
    if let Some(worst) = worst_gap(&screens.gaps) {
        // The layers' own error, known without random numbers, beside that of the realisations.
        text += &format!(
            " (layers shift the mean by {:+.2} % at {:.0} m, where its error is {:.2} %)",
            100.0 * worst.relative,
            worst.range_m,
            100.0 * worst.standard_error
        );
    }
    text
}

/// The largest shift of the mean by the layers.
fn worst_gap(gaps: &[LayerGap]) -> Option<&LayerGap> {
    gaps.iter()
        .max_by(|a, b| a.relative.abs().total_cmp(&b.relative.abs()))
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
        problems.push(Problem::new(key("sampling"), "\"derived\"", allowed));
    } else if t.sampling == ScreenSampling::Derived {
        let words: Vec<String> = violations.iter().map(ToString::to_string).collect();
        problems.push(Problem::new(
            key("sampling"),
            "\"derived\"",
            words.join("; "),
        ));
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
    file.located(problems)
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
            Problem::new(stated, String::new(), allowed)
        }
        _ => Problem::new(key(own), value, allowed),
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

fn warning_text(warning: &Warning, range_m: f64, t: &RefractiveTurbulence) -> String {
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
