//! Figure 1: vertical velocity through the two cores of the pair, and the potential profiles.

use super::context::*;
use std::f64::consts::PI;
use wakescope_les::{CirculationProfile, Ground, Motion, VortexPair, Wind};

const GAMMA_M2_S: f64 = 500.0;
const SPACING_M: f64 = 47.0;
const CORE_M: f64 = 2.35;
const POINTS: usize = 801;
const HALF_WIDTH_M: f64 = 60.0;
/// The potential profile is drawn up to this, in units of the largest tangential velocity.
const LARGEST_DRAWN: f64 = 1.7;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let y_m: Vec<f64> = (0..POINTS)
        .map(|i| HALF_WIDTH_M * (2.0 * i as f64 / (POINTS - 1) as f64 - 1.0))
        .collect();
    let w_m_s = vertical_velocity_m_s(&y_m)?;
    let mut rows = Vec::new();
    for (y, w) in y_m.iter().zip(&w_m_s) {
        rows.push([*y, *w, potential_m_s(*y)]);
    }
    let table = numbers_table("y_m w_m_s w_potential_m_s", &rows);
    let parameters = format!(
        "circulation_m2_s = {GAMMA_M2_S:?}\nspacing_m = {SPACING_M:?}\ncore_radius_m = {CORE_M:?}\n"
    );
    let origin = context.provenance_of_formula(&parameters);
    let top_m_s = GAMMA_M2_S / (4.0 * PI * CORE_M);
    let mut out = Rendered::new(&table, &Figure::stacked([plot(&rows, top_m_s)]), &origin)?;
    out.values = vec![
        GAMMA_M2_S.to_string(),
        SPACING_M.to_string(),
        CORE_M.to_string(),
    ];
    out.claims = claims(top_m_s, &y_m, &w_m_s);
    Ok(out)
}

/// Vertical velocity of the pair at the height of its cores.
fn vertical_velocity_m_s(y_m: &[f64]) -> Result<Vec<f64>, Failure> {
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
    let points_m: Vec<[f64; 3]> = y_m.iter().map(|&y| [0.0, y, SPACING_M]).collect();
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    pair.wind()?
        .velocity_into(&points_m, 0.0, &mut velocity_m_s)?;
    Ok(velocity_m_s.iter().map(|v| v[2]).collect())
}

/// Both profiles, in units of the spacing and of the largest tangential velocity.
fn plot(rows: &[[f64; 3]], top_m_s: f64) -> CurvePlot {
    let mut algebraic = Vec::new();
    let mut potential = Vec::new();
    for [y_m, w_m_s, w_potential_m_s] in rows {
        let y = y_m / SPACING_M;
        let w_potential = w_potential_m_s / top_m_s;
        algebraic.push((y, w_m_s / top_m_s));
        // Cut where it leaves the frame, or a line would join its two ends.
        let is_drawn = w_potential.abs() < LARGEST_DRAWN;
        potential.push((y, if is_drawn { w_potential } else { f64::NAN }));
    }
    let x = Axis::linear("y / b₀");
    let y = Axis::linear("w / (Γ₀ / 4π r_{c})").between(-1.6, 1.6);
    let algebraic = Series::new("algebraic profile (3)", Style::Line, algebraic);
    let potential = Series::new("potential vortices", Style::DashDot, potential);
    CurvePlot::new("Vertical velocity through the cores", x, y)
        .with(algebraic)
        .with(potential)
}

/// The pair as potential vortices: the left one turns so that the air between them sinks.
fn potential_m_s(y_m: f64) -> f64 {
    potential_vortex_m_s(y_m - 0.5 * SPACING_M) - potential_vortex_m_s(y_m + 0.5 * SPACING_M)
}

fn potential_vortex_m_s(distance_m: f64) -> f64 {
    GAMMA_M2_S / (2.0 * PI * distance_m)
}

/// Tangential velocity of one vortex.
fn tangential_m_s(radius_m: f64) -> f64 {
    CirculationProfile::Algebraic.tangential_velocity_m_s(GAMMA_M2_S, CORE_M, radius_m)
}

/// Radius of the largest tangential velocity \[m\], by golden section and not by its formula.
fn radius_of_maximum_m() -> f64 {
    let mut low = 0.0;
    let mut high = 10.0 * CORE_M;
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..200 {
        let a = high - ratio * (high - low);
        let b = low + ratio * (high - low);
        if tangential_m_s(a) > tangential_m_s(b) {
            high = b
        } else {
            low = a
        }
    }
    0.5 * (low + high)
}

fn claims(top_m_s: f64, y_m: &[f64], w_m_s: &[f64]) -> Vec<Claim> {
    let radius_m = radius_of_maximum_m();
    let found_m_s = tangential_m_s(radius_m);
    let pass = (found_m_s / top_m_s - 1.0).abs() < 1e-9 && (radius_m / CORE_M - 1.0).abs() < 1e-6;
    let mut farthest = 0.0_f64;
    for (y, w) in y_m.iter().zip(w_m_s) {
        if (y.abs() - 0.5 * SPACING_M).abs() > 5.0 * CORE_M {
            farthest = farthest.max((w / potential_m_s(*y) - 1.0).abs());
        }
    }
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
