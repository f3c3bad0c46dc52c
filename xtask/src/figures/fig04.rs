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

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.profile.choose(48, 400, 400);
    // A range in the middle and at the end of each layer of the chapter's path.
    let range_m: Vec<f64> = (1..=20).map(|i| 150.0 * f64::from(i)).collect();
    // weak turbulence scatters a tenth of the other
    let realisations_weak = realisations / 4;
    let weak = monte_carlo(WEAK_M_M23, &range_m, realisations_weak, context.seed)?;
    let medium = monte_carlo(MEDIUM_M_M23, &range_m, realisations, context.seed)?;
    let telescope = Telescope::table2();
    let free =
        EfficiencyProfile::from_theory(&range_m, |r| theory::free_space_efficiency(&telescope, r))?;
    let turbulence = Turbulence::table2(MEDIUM_M_M23)?;
    let exact = EfficiencyProfile::from_theory(&range_m, |r| {
        theory::bistatic_efficiency(&telescope, &Misalignment::NONE, &turbulence, r)
    })?;
    let bistatic = medium
        .bistatic
        .clone()
        .ok_or_else(|| Failure::new("one realisation has no pairs".into()))?;
    let curve = |name, label, style, profile: EfficiencyProfile| {
        let snr_db = decibels(&profile)?;
        Ok::<_, Failure>(Curve {
            name,
            label,
            style,
            profile,
            snr_db,
        })
    };
    let curves = [
        curve("free_space", "free space", Style::Line, free)?,
        curve(
            "monostatic_1e-15",
            "monostatic, 10^{−15}",
            Style::Dash,
            weak.monostatic,
        )?,
        curve(
            "bistatic_1e-13",
            "bistatic, 10^{−13}",
            Style::Markers,
            bistatic,
        )?,
        curve(
            "monostatic_1e-13",
            "monostatic, 10^{−13}",
            Style::DashDot,
            medium.monostatic,
        )?,
        curve(
            "bistatic_1e-13_exact",
            "bistatic, 10^{−13}, exact",
            Style::Dot,
            exact,
        )?,
    ];

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
    out.claims = claims(
        &curves,
        &exact_for_screens(&range_m, &turbulence)?,
        [realisations_weak, realisations],
    )?;
    Ok(out)
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
    let (air, area_m2) = (Medium::table2(), Telescope::table2().aperture_area_m2());
    let of_range = |(&range_m, &efficiency): (&f64, &f64)| {
        let weight_per_m = air.return_per_m(range_m, area_m2)? * efficiency;
        let energy_j = GaussianPulse::table2().energy_j();
        Ok(10.0
            * Receiver::table2()
                .slowly_varying_snr(energy_j, weight_per_m)
                .log10())
    };
    profile
        .range_m
        .iter()
        .zip(&profile.mean)
        .map(of_range)
        .collect()
}

fn table(curves: &[Curve]) -> Table {
    let column =
        |get: fn(&Curve) -> &Vec<f64>| curves.iter().flat_map(move |c| get(c).iter().copied());
    Table::new()
        .text(
            "configuration",
            curves
                .iter()
                .flat_map(|c| std::iter::repeat_n(c.name, c.profile.range_m.len())),
        )
        .float("range_m", column(|c| &c.profile.range_m))
        .float("efficiency", column(|c| &c.profile.mean))
        .float(
            "efficiency_standard_deviation",
            column(|c| &c.profile.standard_deviation),
        )
        .float(
            "efficiency_standard_error",
            column(|c| &c.profile.standard_error),
        )
        .float("snr_db", column(|c| &c.snr_db))
}

fn plot(title: &str, label: &str, curves: &[Curve], value: fn(&Curve) -> &Vec<f64>) -> CurvePlot {
    let mut plot = CurvePlot::new(title, Axis::linear("range [m]"), Axis::linear(label));
    plot.shape = 0.8;
    for curve in curves {
        let p = &curve.profile;
        let y = value(curve);
        let mut series = Series::new(
            curve.label,
            curve.style,
            p.range_m.iter().copied().zip(y.iter().copied()),
        );
        if p.standard_error.iter().any(|&e| e > 0.0) {
            // The same relative error in the scale that is drawn.
            let slope = |i: usize| {
                if label.ends_with("[dB]") {
                    10.0 / std::f64::consts::LN_10 / p.mean[i]
                } else {
                    1.0
                }
            };
            let half: Vec<f64> = (0..y.len())
                .map(|i| slope(i) * p.standard_error[i])
                .collect();
            series = series.with_band(&half);
        }
        plot = plot.with(series);
    }
    plot
}

/// Difference of two profiles at each range, from the fewer realisations.
fn differences(a: &EfficiencyProfile, b: &EfficiencyProfile, realisations: usize) -> Vec<Estimate> {
    let at = |i: usize| Estimate {
        value: a.mean[i] - b.mean[i],
        standard_error: a.standard_error[i].hypot(b.standard_error[i]),
        freedom: realisations as f64 - 1.0,
    };
    (0..a.mean.len()).map(at).collect()
}

/// Claims on curves with so many realisations, of the weak turbulence and of the other.
fn claims(
    curves: &[Curve; 5],
    screens: &EfficiencyProfile,
    [few, many]: [usize; 2],
) -> Result<Vec<Claim>, Failure> {
    let [free, weak, bistatic, medium, exact] = [0, 1, 2, 3, 4].map(|i| &curves[i].profile);
    let range_m = &free.range_m;
    let places = range_m.len();

    let ratio: Vec<f64> = exact
        .mean
        .iter()
        .zip(&free.mean)
        .map(|(e, f)| e / f)
        .collect();
    let off = differences(bistatic, screens, many);
    let worst = off
        .iter()
        .map(|d| d.value.abs() / d.half_width_of(places))
        .fold(0.0, f64::max);
    let f4a = Claim::exact(
        "F4a",
        format!(
            "{:.3} to {:.3}; largest distance {worst:.2} of the interval",
            ratio[0],
            ratio[ratio.len() - 1]
        ),
        ratio.windows(2).all(|w| w[1] < w[0]) && worst < 1.0,
    );

    let gains = differences(medium, bistatic, many);
    let beyond = range_m
        .iter()
        .zip(&gains)
        .filter(|(r, _)| **r >= NEAR_FIELD_M);
    let least = beyond.min_by(|a, b| {
        (a.1.value / a.1.standard_error).total_cmp(&(b.1.value / b.1.standard_error))
    });
    let least: Vec<Part> = least
        .into_iter()
        .map(|(r, d)| (format!("least sure at {r} m"), *d, "", Bar::Above(0.0)))
        .collect();
    let f4b = Claim::judged("F4b", &least);

    // Some place of many: all their intervals must hold together.
    let excess = differences(medium, weak, few);
    let sure = |i: &usize| excess[*i].value.abs() > excess[*i].half_width_of(places);
    let above: Vec<usize> = (0..places)
        .filter(|i| sure(i) && excess[*i].value > 0.0)
        .collect();
    let best = (0..places)
        .max_by(|&a, &b| excess[a].value.total_cmp(&excess[b].value))
        .unwrap_or(0);
    let most = format!("most at {} m: {}", range_m[best], excess[best].words());
    let told = match (above.first(), above.last()) {
        (Some(&first), Some(&last)) => {
            let db = 10.0 * (medium.mean[best] / weak.mean[best]).log10();
            format!(
                "from {} to {} m; {most}, {db:.1} dB",
                range_m[first], range_m[last]
            )
        }
        _ => format!("nowhere; {most}"),
    };
    let f4c = Claim {
        standard_error: excess[best].standard_error,
        ..Claim::exact("F4c", told, !above.is_empty())
    };
    let after = (best..places).find(|&i| excess[i].value < 0.0);
    let told = match after {
        Some(i) => format!("between {} and {} m", range_m[i.max(1) - 1], range_m[i]),
        None => format!("none out to {} m", range_m[places - 1]),
    };
    let f4d = Claim::exact("F4d", told, after.is_some());
    let ends = after.is_none() || (best..places).any(|i| sure(&i) && excess[i].value < 0.0);
    let f4d = if ends {
        f4d
    } else {
        f4d.open("profile standard: eight times the realisations")
    };
    Ok(vec![f4a, f4b, f4c, f4d, free_space_claim()?])
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
