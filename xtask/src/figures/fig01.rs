//! Figure 1: vertical velocity through the two cores of the pair, and the potential profiles.

use super::context::*;
use std::f64::consts::PI;
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};

const GAMMA_M2_S: f64 = 500.0;
const SPACING_M: f64 = 47.0;
const CORE_M: f64 = 2.35;
const POINTS: usize = 801;
const HALF_WIDTH_M: f64 = 60.0;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let pair = VortexPair {
        circulation_m2_s: GAMMA_M2_S,
        spacing_m: SPACING_M,
        core_radius_m: CORE_M,
        lateral_position_m: 0.0,
        height_m: SPACING_M,
        ground: Ground::None,
        profile: CirculationProfile::Algebraic,
        motion: Motion::Frozen,
    };
    let y_m: Vec<f64> = (0..POINTS)
        .map(|i| HALF_WIDTH_M * (2.0 * i as f64 / (POINTS - 1) as f64 - 1.0))
        .collect();
    let points_m: Vec<[f64; 3]> = y_m.iter().map(|&y| [0.0, y, SPACING_M]).collect();
    let mut velocity_m_s = vec![[0.0; 3]; POINTS];
    pair.wind()?
        .velocity_into(&points_m, 0.0, &mut velocity_m_s)?;
    let w_m_s: Vec<f64> = velocity_m_s.iter().map(|v| v[2]).collect();

    let rows: Vec<[f64; 3]> = y_m
        .iter()
        .zip(&w_m_s)
        .map(|(y, w)| [*y, *w, potential_m_s(*y)])
        .collect();
    let table = numbers_table("y_m w_m_s w_potential_m_s", &rows);
    let parameters = format!(
        "circulation_m2_s = {GAMMA_M2_S:?}\nspacing_m = {SPACING_M:?}\ncore_radius_m = {CORE_M:?}\n"
    );
    let origin = context.provenance_of_formula(&parameters);

    let top_m_s = GAMMA_M2_S / (4.0 * PI * CORE_M);
    let scaled = |v: &[f64]| {
        y_m.iter()
            .map(|y| y / SPACING_M)
            .zip(v.iter().map(|v| v / top_m_s))
            .collect::<Vec<_>>()
    };
    let x = Axis::linear("y / b₀");
    let y = Axis::linear("w / (Γ₀ / 4π r_c)").between(-1.6, 1.6);
    // The potential profile is cut where it leaves the frame, or a line would join its two ends.
    let inside = |v: &f64| {
        if (v / top_m_s).abs() < 1.7 {
            *v
        } else {
            f64::NAN
        }
    };
    let drawn_m_s: Vec<f64> = rows.iter().map(|row| inside(&row[2])).collect();
    let plot = CurvePlot::new("Vertical velocity through the cores", x, y)
        .with(Series::new(
            "algebraic profile (3)",
            Style::Line,
            scaled(&w_m_s),
        ))
        .with(Series::new(
            "potential vortices",
            Style::DashDot,
            scaled(&drawn_m_s),
        ));
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    out.values = vec![
        GAMMA_M2_S.to_string(),
        SPACING_M.to_string(),
        CORE_M.to_string(),
    ];
    out.claims = claims(top_m_s, &y_m, &w_m_s);
    Ok(out)
}

/// The pair as potential vortices: the left one turns so that the air between them sinks.
fn potential_m_s(y_m: f64) -> f64 {
    let one = |distance_m: f64| GAMMA_M2_S / (2.0 * PI * distance_m);
    one(y_m - 0.5 * SPACING_M) - one(y_m + 0.5 * SPACING_M)
}

fn claims(top_m_s: f64, y_m: &[f64], w_m_s: &[f64]) -> Vec<Claim> {
    let speed =
        |r_m: f64| CirculationProfile::Algebraic.tangential_velocity_m_s(GAMMA_M2_S, CORE_M, r_m);
    // The maximum by golden section, not by its formula.
    let (mut low, mut high) = (0.0, 10.0 * CORE_M);
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..200 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if speed(a) > speed(b) {
            high = b
        } else {
            low = a
        }
    }
    let (radius_m, found_m_s) = (0.5 * (low + high), speed(0.5 * (low + high)));
    let pass = (found_m_s / top_m_s - 1.0).abs() < 1e-9 && (radius_m / CORE_M - 1.0).abs() < 1e-6;
    let beyond = y_m
        .iter()
        .zip(w_m_s)
        .filter(|(y, _)| (y.abs() - 0.5 * SPACING_M).abs() > 5.0 * CORE_M);
    let farthest = beyond
        .map(|(y, w)| (w / potential_m_s(*y) - 1.0).abs())
        .fold(0.0, f64::max);
    vec![
        Claim::exact(
            "F1a",
            format!("{found_m_s:.4} m/s at {radius_m:.4} m"),
            pass,
        ),
        Claim::exact(
            "F1b",
            format!("{:.2} %", 100.0 * farthest),
            farthest <= 0.05,
        ),
    ]
}
