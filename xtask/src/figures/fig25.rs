//! Figure 25, beyond the chapter: where correlogram accumulation errs less than periodogram accumulation, and where not.

use super::context::*;
use super::profiles::{self, Profiles};
use super::study::{EARLY_TAU, METHODS, Sight, Study, Zone, near_scene, with_method};
use wakescope_sim::scene::{NoiseModel, Refinement, VortexPair};

/// Ratio at which cores and bins are compared, near that of the chapter, and the one at which noise is, near the physical one, dB.
const CHAPTER_DB: f64 = 0.0;
const WEAK_DB: f64 = -10.0;
const STRONG_DB: f64 = 20.0;
/// The core that the chapter calls typical, and larger ones, in spacings.
const CORES: [f64; 4] = [0.05, 0.075, 0.1, 0.15];

/// One setting of flow and lidar.
#[derive(Clone, Copy, PartialEq)]
struct Case {
    /// Core radius of the analytic pair that is observed, in spacings; none of the simulated wake.
    core_b0: Option<f64>,
    snr_db: f64,
    noise: NoiseModel,
    pulses: usize,
    /// Whether the velocity is that of the highest bin, as (30) has it.
    bins: bool,
}

const WAKE: Case = Case {
    core_b0: None,
    snr_db: CHAPTER_DB,
    noise: NoiseModel::BandLimited,
    pulses: 1,
    bins: false,
};
/// Settings whose error is drawn against the ratio.
const SETTINGS: [Case; 4] = [
    WAKE,
    Case {
        noise: NoiseModel::White,
        ..WAKE
    },
    Case { pulses: 8, ..WAKE },
    PAIR,
];

/// The analytic pair with the chapter's core.
const PAIR: Case = pair(CORES[0]);

const fn pair(core: f64) -> Case {
    Case {
        core_b0: Some(core),
        ..WAKE
    }
}

/// A setting at another ratio.
fn at(setting: Case, snr_db: f64) -> Case {
    Case { snr_db, ..setting }
}

fn cases(context: &Context) -> Vec<Case> {
    let levels_db = context.profile.choose(
        vec![WEAK_DB, CHAPTER_DB, STRONG_DB],
        vec![WEAK_DB, -5.0, CHAPTER_DB, 5.0, 10.0, 15.0, STRONG_DB],
        vec![
            WEAK_DB, -7.5, -5.0, -2.5, CHAPTER_DB, 5.0, 10.0, 15.0, STRONG_DB,
        ],
    );
    let bins_db: &[f64] = context.profile.choose(
        &[CHAPTER_DB],
        &[CHAPTER_DB, STRONG_DB],
        &[CHAPTER_DB, STRONG_DB],
    );
    let mut cases = Vec::new();
    for &snr_db in bins_db {
        cases.push(Case {
            bins: true,
            ..at(WAKE, snr_db)
        });
    }
    for setting in SETTINGS {
        // Eight pulses need eight times the run time, and white noise matters to weak signals.
        let levels_db: &[f64] = match (context.profile, setting.pulses, setting.noise) {
            (Profile::Quick, 8, _) => &[WEAK_DB],
            (Profile::Quick, _, NoiseModel::White) => &[WEAK_DB, CHAPTER_DB],
            _ => &levels_db,
        };
        for &snr_db in levels_db {
            cases.push(at(setting, snr_db));
        }
    }
    for &core in &CORES[1..] {
        cases.push(pair(core));
    }
    cases
}

impl Case {
    /// The scene of a method.
    fn scene(&self, context: &Context, method: &str, scans: usize) -> Scene {
        let mut scene = with_method(near_scene(scans), method);
        scene.detector.snr = SnrReference::Fixed {
            snr_db: self.snr_db,
        };
        scene.detector.noise = self.noise;
        scene.scan.pulses_per_line = self.pulses;
        scene.estimator.gate_step_samples = context.profile.choose(10, 5, 5);
        if self.bins {
            scene.estimator.refinement = Refinement::None;
            scene.estimator.padded_samples = scene.estimator.window_samples;
        }
        scene
    }

    fn name(&self) -> String {
        let flow = match self.core_b0 {
            None => "wake".into(),
            Some(core) => format!("pair, core {core} b₀"),
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

/// Where errors are compared.
type Region = fn(&Profiles) -> &Zone;

fn inside(profiles: &Profiles) -> &Zone {
    &profiles.inside
}

fn outside(profiles: &Profiles) -> &Zone {
    &profiles.outside
}

/// A case and the errors of its methods.
struct Measured {
    case: Case,
    of: Vec<Profiles>,
}

impl Measured {
    /// CA less PA, without or with the Gaussian weighting, over PA.
    fn share(&self, pa: usize, region: Region) -> Estimate {
        region(&self.of[2]).over(region(&self.of[pa]))
    }

    /// The error of CA inside over that of unweighted PA, without one batch.
    fn ratio(&self, without: Option<usize>) -> f64 {
        self.of[2].inside.rms_m_s(without) / self.of[0].inside.rms_m_s(without)
    }
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.profile.choose(8, 48, 200);
    let sight = Sight::of(context, EARLY_TAU)?;
    let mut all = Vec::new();
    // The pair is observed from the position of the wake.
    for cases in cases(context).chunk_by(|a, b| a.core_b0 == b.core_b0) {
        let sight = match cases[0].core_b0 {
            None => &sight,
            Some(core) => &Sight::of_pair(VortexPair {
                core_radius_m: core * VortexPair::default().spacing_m,
                ..VortexPair::default()
            }),
        };
        all.extend(measured(context, sight, cases, scans)?);
    }
    let shown = sight.scene(context, near_scene(scans));
    let origin = context.provenance_of_formula(&shown.to_toml());
    let mut out = Rendered::new(&table(&all), &picture(&all), &origin)?;
    let mut zones = Vec::new();
    for m in &all {
        let case = format!("{}; {} dB", m.case.name(), m.case.snr_db);
        for p in &m.of {
            zones.extend(p.regions(&case));
        }
    }
    out.add("batches.csv", &Table::stack(zones)?, &origin)?;
    out.values = vec![scans.to_string(), sight.words];
    out.marks = vec![sight.mark, "analytic pair".into()];
    for snr_db in [WEAK_DB, STRONG_DB] {
        let measured = find(&all, at(WAKE, snr_db))?;
        out.comparison.extend(profiles::comparison(&measured.of));
    }
    out.claims = claims(&all)?;
    Ok(out)
}

/// All methods on the cases of one flow.
fn measured(
    context: &Context,
    sight: &Sight,
    cases: &[Case],
    scans: usize,
) -> Result<Vec<Measured>, Failure> {
    let mut scenes = Vec::new();
    for case in cases {
        for method in METHODS {
            scenes.push(case.scene(context, method, scans));
        }
    }
    let studies = Study::runs(context, sight, scenes)?;
    let mut all = Vec::new();
    for (case, studies) in cases.iter().zip(studies.chunks(METHODS.len())) {
        let mut of = Vec::new();
        for (method, study) in METHODS.iter().zip(studies) {
            of.push(Profiles::of(method, "fixed", case.snr_db, study));
        }
        all.push(Measured { case: *case, of });
    }
    Ok(all)
}

/// One row for each case, region and PA.
fn table(all: &[Measured]) -> Table {
    let regions: [(&str, Region); 2] = [("inside", inside), ("outside", outside)];
    let mut cases = Vec::new();
    let mut zones = Vec::new();
    let mut against = Vec::new();
    let mut rms_pa_m_s = Vec::new();
    let mut rms_ca_m_s = Vec::new();
    let mut shares = Vec::new();
    for measured in all {
        for (name, region) in regions {
            for pa in [0, 1] {
                cases.push(&measured.case);
                zones.push(name);
                against.push(METHODS[pa]);
                rms_pa_m_s.push(region(&measured.of[pa]).rms_m_s(None));
                rms_ca_m_s.push(region(&measured.of[2]).rms_m_s(None));
                shares.push(measured.share(pa, region));
            }
        }
    }
    Table::new()
        .text("case", column(&cases, |case| case.name()))
        .float("snr_db", column(&cases, |case| case.snr_db))
        .float(
            "core_b0",
            column(&cases, |case| case.core_b0.unwrap_or(f64::NAN)),
        )
        .text("zone", zones)
        .text("against", against)
        .float("rms_pa_m_s", rms_pa_m_s)
        .float("rms_ca_m_s", rms_ca_m_s)
        .float("share", column(&shares, |share| share.value))
        .float(
            "standard_error",
            column(&shares, |share| share.standard_error),
        )
}

/// A curve of a panel: its name, and its cases.
type Curve<'m> = (String, Vec<&'m Measured>);

fn picture(all: &[Measured]) -> Figure {
    let mut along = Vec::new();
    for setting in SETTINGS {
        let of = all
            .iter()
            .filter(|m| at(m.case, setting.snr_db) == setting)
            .collect();
        along.push((setting.name(), of));
    }
    let cores = all
        .iter()
        .filter(|m| m.case.core_b0.is_some() && m.case.snr_db == CHAPTER_DB)
        .collect();
    let cores = [("pair, band noise, one pulse a line".into(), cores)];
    let by_snr = |case: &Case| case.snr_db;
    // Points at the weakest and the strongest signal stay clear of the frame.
    let snr = || Axis::linear("signal-to-noise ratio [dB]").between(WEAK_DB - 1.5, STRONG_DB + 1.5);
    let in_vortices = panel("Inside the vortices", snr(), inside, by_snr, &along);
    let beyond = panel("Outside", snr(), outside, by_snr, &along);
    let title = format!("Inside the vortices of the pair, {CHAPTER_DB} dB");
    let core = Axis::linear("core radius [b₀]");
    let by_core = panel(
        &title,
        core,
        inside,
        |case| case.core_b0.unwrap_or(f64::NAN),
        &cores,
    );
    Figure::stacked([in_vortices, beyond, by_core])
}

/// CA less each PA over the latter, against a number of the cases.
fn panel(
    title: &str,
    x: Axis,
    region: Region,
    number: fn(&Case) -> f64,
    curves: &[Curve],
) -> CurvePlot {
    let y = Axis::linear("(CA − PA)/PA").between(-0.8, 1.6);
    let mut plot = CurvePlot::new(title, x, y);
    for (colour, (name, of)) in curves.iter().enumerate() {
        for (pa, style) in [(0, Style::LineMarkers), (1, Style::Dash)] {
            let mut points = Vec::new();
            let mut half_widths = Vec::new();
            for m in of {
                let share = m.share(pa, region);
                points.push((number(&m.case), share.value));
                half_widths.push(share.half_width());
            }
            let name = if pa == 0 { name } else { "" };
            let series = Series::new(name, style, points)
                .with_band(&half_widths)
                .in_colour(colour);
            plot = plot.with(series);
        }
    }
    plot
}

fn find(all: &[Measured], case: Case) -> Result<&Measured, Failure> {
    all.iter()
        .find(|m| m.case == case)
        .ok_or_else(|| Failure::new(format!("figure 25 lacks {}", case.name())))
}

/// CA against PA in a case, and where the difference must lie.
fn part(
    all: &[Measured],
    case: Case,
    pa: usize,
    region: Region,
    bar: Bar,
) -> Result<Part, Failure> {
    let name = format!("{}, {} dB, {}", case.name(), case.snr_db, METHODS[pa]);
    let share = find(all, case)?.share(pa, region);
    Ok(Part::new(name, share, "", bar))
}

/// Whether CA over PA is smaller in one case than in another.
fn smaller_ratio(all: &[Measured], smaller: Case, larger: Case) -> Result<[Part; 1], Failure> {
    let smaller = find(all, smaller)?;
    let larger = find(all, larger)?;
    let batches = smaller.of[0].inside.of_batch.len();
    let found = Estimate::of(batches, |without| {
        smaller.ratio(without) - larger.ratio(without)
    });
    let name = "difference of the ratios";
    Ok([Part::new(name, found, "", Bar::Below(0.0))])
}

fn claims(all: &[Measured]) -> Result<Vec<Claim>, Failure> {
    let less = Bar::Less(NO_DIFFERENCE);
    let above = Bar::Above(0.0);
    let weak = at(WAKE, WEAK_DB);
    let strong = at(WAKE, STRONG_DB);
    let strong_pair = at(PAIR, STRONG_DB);
    let white = Case {
        noise: NoiseModel::White,
        ..weak
    };
    let bins = Case { bins: true, ..WAKE };
    let many = Case { pulses: 8, ..weak };
    let turned = [
        part(all, strong, 0, inside, above)?,
        part(all, strong_pair, 0, inside, above)?,
    ];
    let around = [
        part(all, WAKE, 0, outside, less)?,
        part(all, PAIR, 0, outside, less)?,
    ];
    let raw_bins = [
        part(all, bins, 0, inside, less)?,
        part(all, bins, 1, inside, less)?,
    ];
    let eight_pulses = [
        part(all, many, 0, inside, above)?,
        part(all, many, 1, inside, above)?,
    ];
    Ok(vec![
        Claim::judged("CP1", &smaller_ratio(all, white, weak)?),
        Claim::judged("CP2", &turned),
        Claim::judged("CP3", &smaller_ratio(all, pair(CORES[3]), PAIR)?),
        Claim::judged("CP4", &around),
        Claim::judged("CP5", &raw_bins),
        Claim::judged("CP6", &eight_pulses),
    ])
}
