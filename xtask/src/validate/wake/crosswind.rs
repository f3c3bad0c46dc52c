//! The pair in a cross wind: drift, and secondary vortices of different strength.

use super::history::{History, run};
use crate::claim::Claim;
use crate::profile::Profile;
use crate::validate::shown::Shown;
use fixtures::failure::Failure;
use rayon::prelude::*;
use wakescope_les::analysis::decay::value_at;
use wakescope_les::cases::VortexPairCase;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Logarithmic winds at the height of the vortices, in `V0`.
const WINDS: [f64; 3] = [0.0, 0.5, 1.0];
/// Roughness length in `b0`.
const ROUGHNESS: f64 = 0.002;
const END: f64 = 2.5;
/// When the strengths are compared: the secondary vortices are up, the flow is still plane.
const COMPARED: f64 = 1.5;

pub(crate) fn show(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick { [12, 96, 64] } else { [24, 160, 80] };
    let runs: Vec<(f64, History)> = WINDS
        .into_par_iter()
        .map(|cross_wind| {
            let pair = VortexPairCase {
                cells,
                size: [1.0, 5.0, 2.5],
                cross_wind,
                wind_roughness: ROUGHNESS,
                ..VortexPairCase::coarse()
            };
            Ok((cross_wind, run(&pair, END)?))
        })
        .collect::<Result<_, Failure>>()?;
    // Strengths of the secondary vortices, and how far the middle of the pair has moved.
    let second =
        |flow: &History, right: bool| flow.curve(if right { "secondary_gamma_right" } else { "secondary_gamma_left" });
    let middle = |flow: &History| -> Vec<(f64, f64)> {
        let (left, right) = (flow.curve("y_left"), flow.curve("y_right"));
        left.iter().zip(right).map(|(left, right)| (left.0, 0.5 * (left.1 + right.1))).collect()
    };
    let strength = |flow: &History, right: bool| value_at(&second(flow, right), COMPARED).abs();
    let unequal = |flow: &History| strength(flow, false) / strength(flow, true);
    let drift = |flow: &History| value_at(&middle(flow), COMPARED);
    let (still, windy) = (&runs[0].1, &runs[2].1);
    let checks = vec![
        Claim::at_most("no wind: drift to 1.5", drift(still).abs(), 1e-3),
        Claim::relative("no wind: left over right secondary", unequal(still), 1.0, 0.01),
        Claim::at_least("wind V₀: drift to 1.5", drift(windy), 0.8),
        Claim::at_least("wind V₀: drift twice that of V₀/2, share", drift(windy) / drift(&runs[1].1), 1.8),
        Claim::at_least("wind V₀: stronger over weaker secondary", unequal(windy).max(1.0 / unequal(windy)), 1.1),
    ];
    let mut table = Table::new().float("tau", still.column("tau").iter().copied());
    let mut drifts = CurvePlot::new("Middle of the pair", Axis::linear("tau"), Axis::linear("y / b₀"));
    let mut strengths = CurvePlot::new("Secondary vortices", Axis::linear("tau"), Axis::linear("|Γ| / Γ₀"));
    let mut paths = CurvePlot::new("Paths relative to the middle", Axis::linear("y / b₀"), Axis::linear("z / b₀"));
    for (wind, flow) in &runs {
        let name = |what: &str| format!("{what}_wind_{wind}");
        table = table.float(&name("middle"), middle(flow).into_iter().map(|p| p.1));
        drifts = drifts.with(Series::new(&format!("wind {wind} V₀"), Style::Line, middle(flow)));
        for right in [false, true] {
            let side = if right { "right" } else { "left" };
            let curve = second(flow, right);
            table = table.float(&name(&format!("secondary_{side}")), curve.iter().map(|p| p.1));
            let style = if right { Style::Dash } else { Style::Line };
            let shown = curve.into_iter().filter(|p| p.1.is_finite()).map(|p| (p.0, p.1.abs()));
            strengths = strengths.with(Series::new(&format!("wind {wind} V₀, {side}"), style, shown));
            let [y, z] = ["y", "z"].map(|axis| flow.curve(&format!("{axis}_{side}")));
            let path = y.iter().zip(z).zip(middle(flow)).map(|((y, z), middle)| (y.1 - middle.1, z.1));
            let path = path.collect::<Vec<_>>();
            paths = paths.with(Series::new(&format!("wind {wind} V₀, {side}"), style, path));
            let gamma = flow.gamma(right);
            table = table.float(&name(&format!("gamma_5_15_{side}")), gamma.into_iter().map(|p| p.1));
        }
    }
    Ok(Shown { checks, table, figure: Figure::stacked([drifts, strengths, paths]) })
}
