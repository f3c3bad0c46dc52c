//! The pair along a parameter: when the fast decay begins against noise and Reynolds number, on 16 x 96 x 64 cells; drift and secondary
//! vortices in a cross wind.

use super::runs::*;
use crate::wakes::mean;

/// Noise and Reynolds number of each run; the first two are those of the claim, which the quick form has alone.
const RUNS: [(f64, f64); 6] = [
    (1e-3, 5000.0),
    (1e-2, 5000.0),
    (3e-3, 5000.0),
    (3e-2, 5000.0),
    (1e-2, 2500.0),
    (1e-2, 10_000.0),
];

/// When the fast decay begins, on a mesh coarser than the coarse preset.
pub(super) fn onset_by_noise(profile: Profile) -> Result<Shown, Failure> {
    let mut rows = Vec::new();
    let mut decay = CurvePlot::new(
        "Circulation",
        Axis::linear("tau"),
        Axis::linear("Gamma_5-15 / initial").between(0.3, 1.02),
    );
    for &(noise, reynolds) in &RUNS[..if profile == Profile::Quick { 2 } else { 6 }] {
        // Late enough for the weakest noise.
        let flow = run(WakePreset::Coarse, Subgrid::None {}, 4.5, |flow| {
            (flow.cells, flow.perturbation, flow.reynolds) = ([16, 96, 64], noise, reynolds);
        })?;
        let begins = |side: &str| Ok::<_, Failure>(onset(&flow.curve(side)?).unwrap_or(f64::NAN));
        let gamma = mean(&flow, "gamma_ratio", 1.0)?;
        let [left, right] = [begins("gamma_ratio_left")?, begins("gamma_ratio_right")?];
        rows.push([noise, reynolds, left, right, value_at(&gamma, 4.0)]);
        decay = decay.with(Series::new(
            &format!("noise {noise}, Re {reynolds}"),
            Style::Line,
            gamma,
        ));
    }
    let middle = |row: &[f64; 5]| 0.5 * (row[2] + row[3]);
    // The independent code: 0.7 per decade.
    let checks = vec![Claim::within(
        "onset, noise 1e-3 after 1e-2",
        middle(&rows[0]) - middle(&rows[1]),
        0.7,
        0.25,
    )];
    let names = [
        "noise_rms",
        "reynolds",
        "onset_left",
        "onset_right",
        "gamma_ratio_at_4",
    ];
    let columns = names.into_iter().enumerate();
    let table = columns.fold(Table::new(), |table, (k, name)| {
        table.float(name, rows.iter().map(|row| row[k]))
    });
    let panel =
        |title: &str, x: Axis, place: usize, fixed: (usize, f64)| {
            let mut points: Curve = rows
                .iter()
                .filter(|row| row[fixed.0] == fixed.1)
                .map(|row| (row[place], middle(row)))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            CurvePlot::new(title, x, Axis::linear("onset of the fast decay, tau"))
                .with(Series::new("16 x 96 x 64", Style::LineMarkers, points))
        };
    let by_noise = panel(
        "Re 5000",
        Axis::log("noise, rms of a component [V₀]"),
        0,
        (1, 5000.0),
    );
    let by_reynolds = panel("Noise 0.01", Axis::log("Re_Gamma"), 1, (0, 1e-2));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([by_noise, by_reynolds, decay]),
    })
}

/// When the strengths are compared: the secondary vortices are up, the flow is still plane.
const COMPARED: f64 = 1.5;

/// The pair in logarithmic cross winds of 0, 0.5 and 1 `V0` at its height: drift, and secondary vortices of different strength.
pub(super) fn cross_wind(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick {
        [12, 96, 64]
    } else {
        [24, 160, 80]
    };
    let scales = WakeFlow::default().pair.scales()?;
    let second = |flow: &FinishedWake, side: &str| flow.curve(&format!("secondary_gamma_{side}"));
    let mut table = Table::new();
    let mut drifts = CurvePlot::new(
        "Middle of the pair",
        Axis::linear("tau"),
        Axis::linear("y / b₀"),
    );
    let mut strengths = CurvePlot::new(
        "Secondary vortices",
        Axis::linear("tau"),
        Axis::linear("|Γ| / Γ₀"),
    );
    let mut paths = CurvePlot::new(
        "Paths relative to the middle",
        Axis::linear("y / b₀"),
        Axis::linear("z / b₀"),
    );
    let (mut drift, mut unequal) = (Vec::new(), Vec::new());
    for wind in [0.0, 0.5, 1.0] {
        let flow = run(WakePreset::Coarse, Subgrid::None {}, 2.5, |flow| {
            (flow.cells, flow.size) = (cells, [1.0, 5.0, 2.5]);
            flow.cross_wind_m_s = wind * scales.descent_speed_m_s();
            flow.wind_roughness_m = if wind > 0.0 {
                0.002 * scales.spacing_m
            } else {
                0.0
            };
        })?;
        let middle = mean(&flow, "y", 1.0)?;
        drift.push(value_at(&middle, COMPARED));
        let strength = |side| Ok::<f64, Failure>(value_at(&second(&flow, side)?, COMPARED).abs());
        unequal.push(strength("left")? / strength("right")?);
        if wind == 0.0 {
            table = table.float("tau", middle.iter().map(|p| p.0));
        }
        let name = |what: &str| format!("{what}_wind_{wind}");
        table = table.float(&name("middle"), middle.iter().map(|p| p.1));
        drifts = drifts.with(Series::new(
            &format!("wind {wind} V₀"),
            Style::Line,
            middle.iter().copied(),
        ));
        for (side, style) in [("left", Style::Line), ("right", Style::Dash)] {
            let (curve, label) = (second(&flow, side)?, format!("wind {wind} V₀, {side}"));
            table = table.float(
                &name(&format!("secondary_{side}")),
                curve.iter().map(|p| p.1),
            );
            let shown = curve
                .into_iter()
                .filter(|p| p.1.is_finite())
                .map(|p| (p.0, p.1.abs()));
            strengths = strengths.with(Series::new(&label, style, shown));
            let [y, z] = [
                flow.curve(&format!("y_{side}"))?,
                flow.curve(&format!("z_{side}"))?,
            ];
            let path: Curve = y
                .iter()
                .zip(z)
                .zip(&middle)
                .map(|((y, z), middle)| (y.1 - middle.1, z.1))
                .collect();
            paths = paths.with(Series::new(&label, style, path));
            let gamma = flow.column(&format!("gamma_ratio_{side}"))?.iter().copied();
            table = table.float(&name(&format!("gamma_5_15_{side}")), gamma);
        }
    }
    let checks = vec![
        Claim::at_most("no wind: drift to 1.5", drift[0].abs(), 1e-3),
        Claim::relative("no wind: left over right secondary", unequal[0], 1.0, 0.01),
        Claim::at_least("wind V₀: drift to 1.5", drift[2], 0.8),
        Claim::at_least(
            "wind V₀: drift twice that of V₀/2, share",
            drift[2] / drift[1],
            1.8,
        ),
        Claim::at_least(
            "wind V₀: stronger over weaker secondary",
            unequal[2].max(1.0 / unequal[2]),
            1.1,
        ),
    ];
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([drifts, strengths, paths]),
    })
}
