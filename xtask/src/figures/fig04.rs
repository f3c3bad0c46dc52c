//! Figure 4: signal-to-noise ratio and system efficiency against range, in free space and through turbulence.

use super::context::*;
use wakescope_optics::air::StructureTable;
use wakescope_optics::monte_carlo::EfficiencyEstimate;
use wakescope_optics::{
    EfficiencyProfile, Layers, Misalignment, MonteCarlo, Telescope, Turbulence, theory,
};
use wakescope_signal::{GaussianPulse, Medium, Receiver};

const WEAK_M_M23: f64 = 1e-15;
const MEDIUM_M_M23: f64 = 1e-13;
/// Beyond this range the collimated beam has left its near field enough for the two receivers to differ.
const NEAR_FIELD_M: f64 = 300.0;

/// One curve of the figure.
struct Curve {
    name: &'static str,
    label: &'static str,
    style: Style,
    profile: EfficiencyProfile,
    snr_db: Vec<f64>,
}

impl Curve {
    fn new(
        name: &'static str,
        label: &'static str,
        style: Style,
        profile: EfficiencyProfile,
    ) -> Result<Self, Failure> {
        Ok(Self {
            name,
            label,
            style,
            snr_db: decibels(&profile)?,
            profile,
        })
    }
}

/// Weak turbulence has so many fewer realisations than the medium one: it scatters a tenth.
const FEWER_IF_WEAK: usize = 4;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.profile.choose(32, 400, 400);
    let realisations_weak = realisations / FEWER_IF_WEAK;
    // A range in the middle and at the end of each layer of the chapter's path.
    let range_m: Vec<f64> = (1..=20).map(|i| 150.0 * f64::from(i)).collect();
    let turbulence = Turbulence::table2(MEDIUM_M_M23)?;
    let curves = curves(&range_m, realisations, &turbulence, context.seed)?;
    let parameters = format!(
        "set_up = \"chapter: 512 x 512 points of 2 mm, 10 layers\"\nrealisations = {realisations}\nrealisations_weak = {realisations_weak}\n"
    );
    let origin = context.provenance_of_formula(&parameters);
    let figure = Figure::side_by_side([
        plot("Signal-to-noise ratio", "SNR [dB]", &curves, |c| &c.snr_db),
        plot("System efficiency", "efficiency", &curves, |c| {
            &c.profile.mean
        }),
    ]);
    let mut out = Rendered::new(&table(&curves), &figure, &origin)?;
    out.values = vec![realisations.to_string(), realisations_weak.to_string()];
    let screens = exact_for_screens(&range_m, &turbulence)?;
    out.claims = claims(&curves, &screens, realisations)?;
    Ok(out)
}

/// Free space, weak turbulence, then the medium one with independent paths, with the same path and by exact theory.
fn curves(
    range_m: &[f64],
    realisations: usize,
    turbulence: &Turbulence,
    seed: u64,
) -> Result<[Curve; 5], Failure> {
    let weak = monte_carlo(WEAK_M_M23, range_m, realisations / FEWER_IF_WEAK, seed)?;
    let medium = monte_carlo(MEDIUM_M_M23, range_m, realisations, seed)?;
    let telescope = Telescope::table2();
    let free =
        EfficiencyProfile::from_theory(range_m, |r| theory::free_space_efficiency(&telescope, r))?;
    let exact = EfficiencyProfile::from_theory(range_m, |r| {
        theory::bistatic_efficiency(&telescope, &Misalignment::NONE, turbulence, r)
    })?;
    let bistatic = medium
        .bistatic
        .ok_or_else(|| Failure::new("one realisation has no pairs".into()))?;
    Ok([
        Curve::new("free_space", "free space", Style::Line, free)?,
        Curve::new(
            "monostatic_1e-15",
            "monostatic, 10^{−15}",
            Style::Dash,
            weak.monostatic,
        )?,
        Curve::new(
            "bistatic_1e-13",
            "bistatic, 10^{−13}",
            Style::Markers,
            bistatic,
        )?,
        Curve::new(
            "monostatic_1e-13",
            "monostatic, 10^{−13}",
            Style::DashDot,
            medium.monostatic,
        )?,
        Curve::new(
            "bistatic_1e-13_exact",
            "bistatic, 10^{−13}, exact",
            Style::Dot,
            exact,
        )?,
    ])
}

fn monte_carlo(
    cn2_m_m23: f64,
    range_m: &[f64],
    realisations: usize,
    seed: u64,
) -> Result<EfficiencyEstimate, Failure> {
    let set_up = MonteCarlo {
        range_m: range_m.to_vec(),
        ..MonteCarlo::table2(cn2_m_m23, seed)?
    };
    Ok(set_up.run(realisations)?)
}

/// Exact bistatic efficiency for the ten screens that the Monte Carlo uses.
fn exact_for_screens(
    range_m: &[f64],
    turbulence: &Turbulence,
) -> Result<EfficiencyProfile, Failure> {
    let layers = Layers::equal(10, 3000.0)?;
    let table = StructureTable::new(&*turbulence.spectrum);
    let telescope = Telescope::table2();
    Ok(EfficiencyProfile::from_theory(range_m, |r| {
        let screens = layers.screens_to(r, &turbulence.cn2)?;
        theory::bistatic_efficiency_screens(&telescope, &Misalignment::NONE, &screens, &table, r)
    })?)
}

fn decibels(profile: &EfficiencyProfile) -> Result<Vec<f64>, Failure> {
    let medium = Medium::table2();
    let receiver = Receiver::table2();
    let area_m2 = Telescope::table2().aperture_area_m2();
    let energy_j = GaussianPulse::table2().energy_j();
    let mut snr_db = Vec::new();
    for (&range_m, &efficiency) in profile.range_m.iter().zip(&profile.mean) {
        let weight_per_m = medium.return_per_m(range_m, area_m2)? * efficiency;
        snr_db.push(10.0 * receiver.slowly_varying_snr(energy_j, weight_per_m).log10());
    }
    Ok(snr_db)
}

/// A column of all curves, one after the other.
fn values_of(curves: &[Curve], values: fn(&Curve) -> &Vec<f64>) -> Vec<f64> {
    curves.iter().flat_map(values).copied().collect()
}

fn table(curves: &[Curve]) -> Table {
    let names = curves
        .iter()
        .flat_map(|c| std::iter::repeat_n(c.name, c.profile.range_m.len()));
    Table::new()
        .text("configuration", names)
        .float("range_m", values_of(curves, |c| &c.profile.range_m))
        .float("efficiency", values_of(curves, |c| &c.profile.mean))
        .float(
            "efficiency_standard_deviation",
            values_of(curves, |c| &c.profile.standard_deviation),
        )
        .float(
            "efficiency_standard_error",
            values_of(curves, |c| &c.profile.standard_error),
        )
        .float("snr_db", values_of(curves, |c| &c.snr_db))
}

fn plot(title: &str, label: &str, curves: &[Curve], values: fn(&Curve) -> &Vec<f64>) -> CurvePlot {
    let mut plot = CurvePlot::new(title, Axis::linear("range [m]"), Axis::linear(label));
    plot.shape = 0.8;
    for curve in curves {
        let profile = &curve.profile;
        let mut points = Vec::new();
        let mut half_widths = Vec::new();
        for (i, &value) in values(curve).iter().enumerate() {
            points.push((profile.range_m[i], value));
            // The same relative error in the scale that is drawn.
            let slope = if label.ends_with("[dB]") {
                10.0 / std::f64::consts::LN_10 / profile.mean[i]
            } else {
                1.0
            };
            half_widths.push(slope * profile.standard_error[i]);
        }
        let mut series = Series::new(curve.label, curve.style, points);
        if profile.standard_error.iter().any(|&error| error > 0.0) {
            series = series.with_band(&half_widths);
        }
        plot = plot.with(series);
    }
    plot
}

/// Difference of two profiles at each range, from the fewer realisations.
fn differences(a: &EfficiencyProfile, b: &EfficiencyProfile, realisations: usize) -> Vec<Estimate> {
    let mut differences = Vec::new();
    for i in 0..a.mean.len() {
        differences.push(Estimate {
            value: a.mean[i] - b.mean[i],
            standard_error: a.standard_error[i].hypot(b.standard_error[i]),
            freedom: realisations as f64 - 1.0,
        });
    }
    differences
}

/// Claims on the curves.
fn claims(
    curves: &[Curve; 5],
    screens: &EfficiencyProfile,
    realisations: usize,
) -> Result<Vec<Claim>, Failure> {
    let [free, weak, bistatic, medium, exact] = curves.each_ref().map(|curve| &curve.profile);
    let from_screens = differences(bistatic, screens, realisations);
    let gains = differences(medium, bistatic, realisations);
    let excess = differences(medium, weak, realisations / FEWER_IF_WEAK);
    let largest = (0..excess.len())
        .max_by(|&a, &b| excess[a].value.total_cmp(&excess[b].value))
        .unwrap_or(0);
    Ok(vec![
        falling_claim(exact, free, &from_screens),
        gain_claim(&free.range_m, &gains),
        excess_claim(medium, weak, &excess, largest),
        crossover_claim(&free.range_m, &excess, largest),
        free_space_claim()?,
    ])
}

/// The bistatic efficiency over that of free space falls, and the Monte Carlo agrees with the theory of its screens.
fn falling_claim(
    exact: &EfficiencyProfile,
    free: &EfficiencyProfile,
    from_screens: &[Estimate],
) -> Claim {
    let mut ratio = Vec::new();
    for (exact, free) in exact.mean.iter().zip(&free.mean) {
        ratio.push(exact / free);
    }
    let mut worst = 0.0_f64;
    for difference in from_screens {
        let interval = difference.half_width_of(from_screens.len());
        worst = worst.max(difference.value.abs() / interval);
    }
    let falls = ratio.windows(2).all(|w| w[1] < w[0]);
    Claim::exact(
        "F4a",
        format!(
            "{:.3} to {:.3}; the Monte Carlo is within {worst:.2} of its 95 % interval of the theory",
            ratio[0],
            ratio[ratio.len() - 1]
        ),
        falls && worst < 1.0,
    )
}

/// One path for both ways gains against two, at every range beyond the near field.
fn gain_claim(range_m: &[f64], gains: &[Estimate]) -> Claim {
    let beyond = range_m
        .iter()
        .zip(gains)
        .filter(|(r, _)| **r >= NEAR_FIELD_M);
    let least = beyond.min_by(|(_, a), (_, b)| {
        (a.value / a.standard_error).total_cmp(&(b.value / b.standard_error))
    });
    let parts: Vec<Part> = least
        .into_iter()
        .map(|(r, gain)| Part::new(format!("least sure at {r} m"), *gain, "", Bar::Above(0.0)))
        .collect();
    Claim::judged("F4b", &parts)
}

/// Whether a difference is beyond its interval; of many ranges all intervals must hold together.
fn is_sure(difference: &Estimate, ranges: usize) -> bool {
    difference.value.abs() > difference.half_width_of(ranges)
}

/// Medium turbulence exceeds weak turbulence over some interval of range.
fn excess_claim(
    medium: &EfficiencyProfile,
    weak: &EfficiencyProfile,
    excess: &[Estimate],
    largest: usize,
) -> Claim {
    let range_m = &medium.range_m;
    let above: Vec<usize> = (0..excess.len())
        .filter(|&i| is_sure(&excess[i], excess.len()) && excess[i].value > 0.0)
        .collect();
    let sure = if above.contains(&largest) {
        ""
    } else {
        ", but not surely above 0,"
    };
    let most = format!(
        "largest{sure} at {} m: {}",
        range_m[largest],
        excess[largest].words()
    );
    let measured = match (above.first(), above.last()) {
        (Some(&first), Some(&last)) => {
            let db = 10.0 * (medium.mean[largest] / weak.mean[largest]).log10();
            format!(
                "surely from {} to {} m; {most}, {db:.1} dB",
                range_m[first], range_m[last]
            )
        }
        _ => format!("nowhere; {most}"),
    };
    Claim {
        standard_error: excess[largest].standard_error,
        ..Claim::exact("F4c", measured, !above.is_empty())
    }
}

/// Beyond some range medium turbulence is below weak turbulence.
fn crossover_claim(range_m: &[f64], excess: &[Estimate], largest: usize) -> Claim {
    let ranges = excess.len();
    let after = (largest..ranges).find(|&i| excess[i].value < 0.0);
    let measured = match after {
        Some(i) => format!("between {} and {} m", range_m[i.max(1) - 1], range_m[i]),
        None => format!("none out to {} m", range_m[ranges - 1]),
    };
    let claim = Claim::exact("F4d", measured, after.is_some());
    let is_decided = after.is_none()
        || (largest..ranges).any(|i| is_sure(&excess[i], ranges) && excess[i].value < 0.0);
    if is_decided {
        claim
    } else {
        claim.open("profile standard: eight times the realisations")
    }
}

/// The crate's quadrature against the stored curve of independent origin.
fn free_space_claim() -> Result<Claim, Failure> {
    let curve = wakescope_tests::curves::ALL
        .iter()
        .find(|c| c.name == "optics/eta_intensity_radius")
        .ok_or_else(|| Failure::new("the stored curve of the efficiency is gone".into()))?;
    let compared = curve.compare()?;
    Ok(Claim::exact(
        "F4e",
        format!(
            "within {:.1e} at {} ranges",
            compared.worst_error,
            compared.x.len()
        ),
        compared.is_within(curve),
    ))
}
