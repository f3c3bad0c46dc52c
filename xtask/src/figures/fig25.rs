//! Figure 25, beyond the chapter: where correlogram accumulation errs less than periodogram accumulation, and where not.

use super::context::*;
use super::profiles::{self, Profiles};
use super::study::{EARLY_TAU, METHODS, Sight, Study, near_scene, with_method};
use crate::statistics::NO_DIFFERENCE;
use crate::wakes;
use wakescope_sim::scene::{NoiseModel, Refinement, VortexPair};

/// Ratio at which cores and bins are compared, near that of the chapter, and the one at which noise is, near the physical one, dB.
const CHAPTER_DB: f64 = 0.0;
const WEAK_DB: f64 = -10.0;
const STRONG_DB: f64 = 20.0;
/// The core that the chapter calls typical, and larger ones, in spacings.
const CORES: [f64; 4] = [0.05, 0.075, 0.1, 0.15];

/// What is looked at.
#[derive(Clone, Copy, PartialEq)]
enum Seen {
    Wake,
    /// A wake with twice the core, on a coarse mesh.
    Coarse,
    /// The analytic pair with a core radius in spacings.
    Pair(f64),
}

/// One setting of flow and lidar.
#[derive(Clone, Copy, PartialEq)]
struct Case {
    seen: Seen,
    snr_db: f64,
    noise: NoiseModel,
    pulses: usize,
    /// Whether the velocity is that of the highest bin, as (30) has it.
    bins: bool,
}

const WAKE: Case = Case {
    seen: Seen::Wake,
    snr_db: CHAPTER_DB,
    noise: NoiseModel::BandLimited,
    pulses: 1,
    bins: false,
};
/// What is followed along the ratio.
const WAYS: [Case; 4] = [
    WAKE,
    Case {
        noise: NoiseModel::White,
        ..WAKE
    },
    Case { pulses: 8, ..WAKE },
    Case {
        seen: Seen::Pair(CORES[0]),
        ..WAKE
    },
];

fn cases(context: &Context) -> Vec<Case> {
    let levels_db = context.profile.choose(
        vec![WEAK_DB, -5.0, CHAPTER_DB, 10.0, STRONG_DB],
        vec![WEAK_DB, -5.0, CHAPTER_DB, 5.0, 10.0, 15.0, STRONG_DB],
        vec![
            WEAK_DB, -7.5, -5.0, -2.5, CHAPTER_DB, 5.0, 10.0, 15.0, STRONG_DB,
        ],
    );
    // Eight pulses take eight times as long, and white noise is of weak signals: quick has where claims are, and where they began.
    let is_short = |way: &Case| {
        context.profile == Profile::Quick && (way.pulses > 1 || way.noise == NoiseModel::White)
    };
    let levels_of = |way: &Case| {
        if is_short(way) {
            vec![WEAK_DB, CHAPTER_DB]
        } else {
            levels_db.clone()
        }
    };
    let along = WAYS.into_iter().flat_map(|way| {
        levels_of(&way)
            .into_iter()
            .map(move |snr_db| Case { snr_db, ..way })
    });
    let cores = CORES[1..].iter().map(|core| Case {
        seen: Seen::Pair(*core),
        ..WAKE
    });
    let bins = [CHAPTER_DB, STRONG_DB].map(|snr_db| Case {
        snr_db,
        bins: true,
        ..WAKE
    });
    // The flow that quick has whole is another one.
    let is_coarse =
        context.profile == Profile::Quick && context.wake.is_none() && !context.analytic;
    let coarse = is_coarse.then_some(Case {
        seen: Seen::Coarse,
        ..WAKE
    });
    bins.into_iter()
        .chain(along)
        .chain(cores)
        .chain(coarse)
        .collect()
}

impl Case {
    fn core_b0(&self) -> f64 {
        if let Seen::Pair(core) = self.seen {
            core
        } else {
            f64::NAN
        }
    }

    fn name(&self) -> String {
        let flow = match self.seen {
            Seen::Wake => "wake".into(),
            Seen::Coarse => "coarse wake".into(),
            Seen::Pair(core) => format!("pair, core {core} b₀"),
        };
        let noise = if self.noise == NoiseModel::White {
            "white noise"
        } else {
            "band noise"
        };
        let bins = if self.bins { ", raw bins" } else { "" };
        format!(
            "{flow}, {noise}, {} a line{bins}",
            if self.pulses == 1 {
                "one pulse"
            } else {
                "eight pulses"
            }
        )
    }
}

/// A case and what its methods err.
struct Measured {
    case: Case,
    of: Vec<Profiles>,
}

impl Measured {
    /// CA less PA, without or with the Gaussian weighting, over PA: inside the vortices or outside.
    fn share(&self, pa: usize, is_inside: bool) -> Estimate {
        let zone = |p: usize| {
            if is_inside {
                &self.of[p].inside
            } else {
                &self.of[p].outside
            }
        };
        zone(2).over(zone(pa))
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.profile.choose(8, 48, 200);
    let sight = Sight::of(context, EARLY_TAU)?;
    let cases = cases(context);
    let mut all = Vec::new();
    // The pair is looked at from where the wake is.
    for of_flow in cases.chunk_by(|a, b| a.seen == b.seen) {
        let sight = match of_flow[0].seen {
            Seen::Wake => &sight,
            Seen::Coarse => &Sight::of_wake(&wakes::whole(context)?, EARLY_TAU)?,
            Seen::Pair(core) => &Sight::of_pair(VortexPair {
                core_radius_m: core * VortexPair::default().spacing_m,
                ..VortexPair::default()
            }),
        };
        let scene = |case: &Case, method: &str| {
            let mut scene = with_method(near_scene(scans), method);
            scene.detector.snr = SnrReference::Fixed {
                snr_db: case.snr_db,
            };
            scene.detector.noise = case.noise;
            scene.scan.pulses_per_line = case.pulses;
            scene.estimator.gate_step_samples = context.profile.choose(10, 5, 5);
            if case.bins {
                (scene.estimator.refinement, scene.estimator.padded_samples) =
                    (Refinement::None, scene.estimator.window_samples);
            }
            scene
        };
        let scenes = of_flow
            .iter()
            .flat_map(|case| METHODS.map(|method| scene(case, method)));
        let studies = Study::runs(context, sight, scenes.collect())?;
        for (case, studies) in of_flow.iter().zip(studies.chunks(METHODS.len())) {
            let of = METHODS.iter().zip(studies);
            let of = of
                .map(|(method, study)| Profiles::of(method, "fixed", case.snr_db, study))
                .collect();
            all.push(Measured { case: *case, of });
        }
    }
    let origin = context.provenance_of_formula(&sight.scene(context, near_scene(scans)).to_toml());
    let mut out = Rendered::new(&table(&all), &picture(&all), &origin)?;
    let named = all.iter().flat_map(|m| {
        m.of.iter()
            .map(|p| (format!("{}; {} dB", m.case.name(), m.case.snr_db), p))
    });
    out.add(
        "batches.csv",
        &profiles::batches_table(named, false),
        &origin,
    )?;
    out.values = vec![scans.to_string(), sight.words];
    out.marks = vec![sight.mark, "analytic pair".into()];
    out.words = words(&all)?;
    out.claims = claims(&all)?;
    Ok(out)
}

fn table(all: &[Measured]) -> Table {
    let rows: Vec<(&Measured, usize, bool)> = all
        .iter()
        .flat_map(|m| [(m, 0, true), (m, 1, true), (m, 0, false), (m, 1, false)])
        .collect();
    let float = |get: &dyn Fn(&Measured, usize, bool) -> f64| {
        rows.iter().map(|r| get(r.0, r.1, r.2)).collect::<Vec<_>>()
    };
    let rms = |p: &Profiles, is_inside| {
        if is_inside {
            p.inside.rms_m_s(None)
        } else {
            p.outside.rms_m_s(None)
        }
    };
    Table::new()
        .text("case", rows.iter().map(|r| r.0.case.name()))
        .float("snr_db", float(&|m, _, _| m.case.snr_db))
        .float("core_b0", float(&|m, _, _| m.case.core_b0()))
        .text(
            "zone",
            rows.iter().map(|r| if r.2 { "inside" } else { "outside" }),
        )
        .text("against", rows.iter().map(|r| METHODS[r.1]))
        .float("rms_pa_m_s", float(&|m, pa, inside| rms(&m.of[pa], inside)))
        .float("rms_ca_m_s", float(&|m, _, inside| rms(&m.of[2], inside)))
        .float("share", float(&|m, pa, inside| m.share(pa, inside).value))
        .float(
            "standard_error",
            float(&|m, pa, inside| m.share(pa, inside).standard_error),
        )
}

fn picture(all: &[Measured]) -> Figure {
    let panel = |title: &str,
                 x: &str,
                 is_inside: bool,
                 at: fn(&Case) -> f64,
                 curves: Vec<(String, Vec<&Measured>)>| {
        let y = Axis::linear("(CA - PA)/PA").between(-0.8, 1.6);
        let mut plot = CurvePlot::new(title, Axis::linear(x), y);
        for (colour, (label, of)) in curves.iter().enumerate() {
            for (pa, style) in [(0, Style::LineMarkers), (1, Style::Dash)] {
                let points = of
                    .iter()
                    .map(|m| (at(&m.case), m.share(pa, is_inside).value));
                let band: Vec<f64> = of
                    .iter()
                    .map(|m| m.share(pa, is_inside).half_width())
                    .collect();
                let label = if pa == 0 { label } else { "" };
                plot = plot.with(
                    Series::new(label, style, points)
                        .with_band(&band)
                        .in_colour(colour),
                );
            }
        }
        plot
    };
    let along = || {
        let curves = WAYS.iter().map(|way| {
            let of = all.iter().filter(|m| {
                Case {
                    snr_db: way.snr_db,
                    ..m.case
                } == *way
            });
            (way.name(), of.collect())
        });
        curves.collect()
    };
    let cores = all
        .iter()
        .filter(|m| matches!(m.case.seen, Seen::Pair(_)) && m.case.snr_db == CHAPTER_DB)
        .collect();
    Figure::stacked([
        panel(
            "Inside the vortices",
            "SNR [dB]",
            true,
            |case| case.snr_db,
            along(),
        ),
        panel("Outside", "SNR [dB]", false, |case| case.snr_db, along()),
        panel(
            &format!("Inside the vortices of the pair, {CHAPTER_DB} dB"),
            "core radius [b₀]",
            true,
            |case| case.core_b0(),
            vec![("pair, band noise, one pulse a line".into(), cores)],
        ),
    ])
}

fn find(all: &[Measured], case: Case) -> Result<&Measured, Failure> {
    all.iter()
        .find(|m| m.case == case)
        .ok_or_else(|| Failure::new(format!("figure 25 lacks {}", case.name())))
}

/// Where it holds and where not, in a sentence.
fn words(all: &[Measured]) -> Result<String, Failure> {
    let per_cent = |case| {
        Ok::<_, Failure>(format!(
            "{} %",
            find(all, case)?.share(0, true).times(100.0).words()
        ))
    };
    let mut holds = Vec::new();
    for m in all.iter().filter(|m| {
        Case {
            snr_db: CHAPTER_DB,
            ..m.case
        } == WAKE
    }) {
        let verdict = match Bar::Less(NO_DIFFERENCE).verdict(&m.share(0, true)) {
            Verdict::Pass => "less",
            Verdict::Fail => "not less",
            Verdict::Open => "open",
        };
        holds.push(format!(
            "{} dB {verdict} ({})",
            m.case.snr_db,
            per_cent(m.case)?
        ));
    }
    let coarse = find(
        all,
        Case {
            seen: Seen::Coarse,
            ..WAKE
        },
    )
    .and_then(|m| per_cent(m.case));
    let coarse = coarse.map_or(String::new(), |share| {
        format!(", on a coarse wake with twice the core {share}")
    });
    Ok(format!(
        "Where that reaches (figure 25, error of CA less that of unweighted PA over the latter, inside): on the wake {}; at {WEAK_DB} dB in white noise \
         {}; inside a core of {} b₀ at {CHAPTER_DB} dB {}, of {} b₀ {}{coarse}.",
        holds.join(", "),
        per_cent(Case {
            noise: NoiseModel::White,
            snr_db: WEAK_DB,
            ..WAKE
        })?,
        CORES[0],
        per_cent(Case {
            seen: Seen::Pair(CORES[0]),
            ..WAKE
        })?,
        CORES[3],
        per_cent(Case {
            seen: Seen::Pair(CORES[3]),
            ..WAKE
        })?
    ))
}

fn claims(all: &[Measured]) -> Result<Vec<Claim>, Failure> {
    let part = |case: Case, pa: usize, is_inside: bool, bar: Bar| {
        let share = find(all, case)?.share(pa, is_inside);
        Ok::<_, Failure>((
            format!("{}, {} dB, {}", case.name(), case.snr_db, METHODS[pa]),
            share,
            "",
            bar,
        ))
    };
    let less = Bar::Less(NO_DIFFERENCE);
    let [weak, strong] = [WEAK_DB, STRONG_DB].map(|snr_db| Case { snr_db, ..WAKE });
    let white = Case {
        noise: NoiseModel::White,
        ..weak
    };
    let pair = Case {
        seen: Seen::Pair(CORES[0]),
        ..WAKE
    };
    let between = |name: &str, a: Case, b: Case| {
        let [a, b] = [find(all, a)?, find(all, b)?];
        let share = |m: &Measured, without| {
            m.of[2].inside.rms_m_s(without) / m.of[0].inside.rms_m_s(without)
        };
        let found = Estimate::of(a.of[0].inside.of_batch.len(), |without| {
            share(a, without) - share(b, without)
        });
        Ok::<_, Failure>(vec![(name.into(), found, "", Bar::Below(0.0))])
    };
    let turned = [
        strong,
        Case {
            seen: pair.seen,
            ..strong
        },
    ];
    let outside = [part(WAKE, 0, false, less)?, part(pair, 0, false, less)?];
    let bins = Case { bins: true, ..WAKE };
    let many = Case { pulses: 8, ..weak };
    let above = |case, pa| part(case, pa, true, Bar::Above(0.0));
    Ok(vec![
        Claim::judged("CP1", &between("difference of the ratios", white, weak)?),
        Claim::judged("CP2", &[above(turned[0], 0)?, above(turned[1], 0)?]),
        Claim::judged(
            "CP3",
            &between(
                "difference of the ratios",
                Case {
                    seen: Seen::Pair(CORES[3]),
                    ..WAKE
                },
                pair,
            )?,
        ),
        Claim::judged("CP4", &outside),
        Claim::judged(
            "CP5",
            &[part(bins, 0, true, less)?, part(bins, 1, true, less)?],
        ),
        Claim::judged("CP6", &[above(many, 0)?, above(many, 1)?]),
    ])
}
