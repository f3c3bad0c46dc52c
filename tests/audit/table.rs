//! The table of all numbers: where each is defined, what its worst deviation is, and which have no definition of their own.

use super::ledger::{Ledger, Tally};

/// Numbers that are known to be wrong, with the reason; one that comes right must be taken out.
const AWAITED: &[(&str, &str)] = &[];

/// Numbers that the program writes without a definition here, with the reason.
const WITHOUT: &[(&str, &str)] = &[
    ("predicted.csv: *", "as of bound: held there"),
    (
        "profile.csv: efficiency_bistatic_monte*",
        "a Monte Carlo: held by z-scores against (P3) in the optics",
    ),
    (
        "profile.csv: efficiency_monostatic*",
        "a Monte Carlo: held by the theory of weak turbulence in the optics",
    ),
    ("retrieval_summary.csv: *", "words that name the row"),
    (
        "steps.csv: subgrid_decay",
        "of the model and the step: held by a test of the solver",
    ),
    (
        "steps.csv: courant",
        "of the faces of the mesh: held by tests of the solver",
    ),
    (
        "steps.csv: kinetic_energy_m5_s2",
        "of the faces of the mesh: its rate and residual are held",
    ),
    (
        "steps.csv: pressure_*",
        "of the pressure solver: held by its tests",
    ),
    (
        "steps.csv: subgrid_viscosity_m2_s",
        "of the model: held by closed forms in tests of the solver",
    ),
    (
        "wind.csv: *",
        "of a fit to random velocities, or the time and kind of its window: held over 200 cones by tests of `wakescope wind`",
    ),
    ("map.nc: drift", "held with the heading, as the track"),
    ("map.nc: heading", "held with the drift, as the track"),
    ("map.nc: pitch", "0 of a level carrier"),
    ("map.nc: ro*", "0 of a level carrier"),
    ("map.nc: tilt", "0 of a level carrier"),
    (
        "retrieval.csv: *",
        "of a fit to random velocities: held over many scans by cargo xtask fit-trials",
    ),
    (
        "detection.csv: *",
        "random, by a law that is drawn: held over 2000 scans by a test of the detector",
    ),
    ("results.nc: *", "held in results.csv"),
    (
        "run results: clipped_fraction",
        "a count over the samples: held by the closed forms of the converter",
    ),
    (
        "run results: signal_rms_a",
        "random: the power over range is held in signals.nc",
    ),
    (
        "results.csv: circulation*",
        "fits of random maps: held over many scans by cargo xtask fit-trials",
    ),
    (
        "wake.csv: *",
        "of the simulated flow: held by its references",
    ),
    (
        "wake.nc: *",
        "of the simulated flow: held by its references",
    ),
    (
        "budget limits: amplifier_equals_shot_w",
        "where (R2) meets (R1): held by the stored budget",
    ),
    (
        "budget limits: best_local_oscillator_w",
        "where the sum of (R1) to (R4) is best, by search: held by the stored curve of saturation",
    ),
    (
        "budget limits: intensity_equals_shot_w",
        "where (R4) meets (R1): held by the stored budget",
    ),
    (
        "map.csv: v_spread_m_s",
        "of pulses with airs of their own: held by tests of winds of pulses",
    ),
    (
        "map.csv: v_mean_m_s",
        "random: its bias and scatter are held, and the estimators by stored windows",
    ),
    ("map.nc: antenna_transition", "no number: always 0"),
    ("map.nc: follow_mode", "a word of the format"),
    ("map.nc: instrument_type", "a word of the format"),
    ("map.nc: platform_type", "a word of the format"),
    ("map.nc: primary_axis", "a word of the format"),
    ("map.nc: prt_mode", "a word of the format"),
    ("map.nc: sweep_mode", "a word of the format"),
    (
        "map.nc: time_*",
        "dates in words, held by the readers of others",
    ),
    ("map.nc: volume_number", "always 0"),
    (
        "results.csv: bad*",
        "a count over a threshold that the estimates themselves set",
    ),
    ("results.csv: scene_hash", "a hash"),
];

/// Fewer draws than these say nothing about an awaited number that comes out right.
const ENOUGH_DRAWS: usize = 100;

/// What an audit found.
#[derive(Debug)]
pub struct Report {
    /// The table, a line for each number, and the faults in full.
    pub text: String,
    /// The table for the book, as Markdown.
    pub page: String,
    /// Names of the numbers that are wrong.
    pub faults: Vec<String>,
}

/// `*` stands for anything.
fn covers(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        Some((start, rest)) => name.strip_prefix(start).is_some_and(|left| {
            (0..=left.len()).any(|at| left.get(at..).is_some_and(|left| covers(rest, left)))
        }),
        None => pattern == name,
    }
}

fn awaited(number: &str) -> Option<&'static str> {
    AWAITED
        .iter()
        .find(|(pattern, _)| covers(pattern, number))
        .map(|(_, reason)| *reason)
}

impl Report {
    pub(crate) fn new(ledger: &Ledger, draws: usize) -> Self {
        let (mut text, mut faults, mut details) = (String::new(), Vec::new(), String::new());
        let mut page = String::from(
            "| number | defined in | draws | worst deviation | verdict |\n|---|---|---|---|---|\n",
        );
        text += &format!(
            "{:<62} {:<18} {:>6}  {:<34} verdict\n",
            "number", "defined in", "draws", "worst"
        );
        for (number, tally) in &ledger.tallies {
            let is_wrong = tally.excess() > 1.0;
            let verdict = match (is_wrong, awaited(number)) {
                (true, Some(_)) => "awaited",
                (true, None) => "FAULT",
                (false, _) => "right",
            };
            if verdict == "FAULT" {
                faults.push(number.clone());
            }
            if is_wrong {
                details += &format!("{verdict}: {number}\n    {}\n", tally.at);
            }
            let (place, draws, worst) = (place(tally), tally.draws, tally.shown());
            text += &format!("{number:<62} {place:<18} {draws:>6}  {worst:<34} {verdict}\n");
            page += &format!("| {number} | `{place}` | {draws} | {worst} | {verdict} |\n");
        }
        page += "\n| number without a definition here | why |\n|---|---|\n";
        for name in &ledger.seen {
            let is_held = ledger.tallies.keys().any(|n| {
                n == name
                    || n.strip_prefix(name.as_str())
                        .is_some_and(|rest| rest.starts_with(", "))
            });
            match WITHOUT.iter().find(|(pattern, _)| covers(pattern, name)) {
                _ if is_held => {}
                None if draws < ENOUGH_DRAWS => {}
                Some((_, reason)) => {
                    text += &format!("{name:<62} none: {reason}\n");
                    page += &format!("| {name} | {reason} |\n");
                }
                None => {
                    text += &format!("{name:<62} FAULT: it has no definition, and no reason why\n");
                    faults.push(name.clone());
                }
            }
        }
        let is_wrong = |pattern: &str| {
            ledger
                .tallies
                .iter()
                .any(|(n, tally)| covers(pattern, n) && tally.excess() > 1.0)
        };
        for (pattern, reason) in AWAITED
            .iter()
            .filter(|(pattern, _)| draws >= ENOUGH_DRAWS && !is_wrong(pattern))
        {
            details += &format!("FAULT: {pattern} came right: take it out of AWAITED ({reason})\n");
            faults.push((*pattern).into());
        }
        let (refused, held) = (ledger.refused.len(), ledger.tallies.len());
        let sum = format!(
            "{draws} draws, {refused} refused; {held} numbers held, {} faults\n",
            faults.len()
        );
        text += &format!("{details}{sum}");
        Self {
            text,
            page: format!("{sum}\n{page}"),
            faults,
        }
    }
}

/// File and line of a definition.
fn place(tally: &Tally) -> String {
    let file = tally.place.file().rsplit('/').next().unwrap_or_default();
    format!("{file}:{}", tally.place.line())
}
