//! Figure 7: circulation and paths of the two vortices of the simulated wake.

use super::context::*;
use crate::wakes::{self, mean};
use crate::workspace::numbers;
use wakescope_les::analysis::decay::{knee, onset};

/// The Reynolds number and the core of the chapter, in spacings.
const CHAPTER_REYNOLDS: f64 = 2e4;
const CHAPTER_CORE_B0: f64 = 0.05;

/// Wakes at the Reynolds number of the chapter with other initial noise, which the chapter does not state, from the tables of the page
/// `validation-flow`.
const OTHER_NOISES: [&str; 5] = [
    "1 %",
    "0.3 %",
    "0.3 % on 80 x 320 x 180 cells",
    "0.1 %",
    "0.03 %",
];
/// Where the straight lines through the early and the steepest decay meet.
const OTHER_ONSETS_TAU: [f64; 5] = [2.13, 2.14, 2.23, 2.51, 2.82];
/// Final circulation over the initial one.
const OTHER_LEVELS: [f64; 5] = [0.59, 0.66, 0.66, 0.65, 0.69];
/// How far the vortices swing back inward, in spacings.
const OTHER_INWARDS_B0: [f64; 5] = [0.09, 0.15, 0.16, 0.21, 0.26];

/// A quantity of the other wakes, each with its noise.
fn other_wakes(quantity: &str, values: [f64; 5]) -> String {
    let mut words = format!("{quantity} on 64 x 256 x 144 cells by initial noise");
    for (noise, value) in OTHER_NOISES.into_iter().zip(values) {
        words += &format!("; {noise}: {value}");
    }
    words
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::of(context)?;
    let origin = context.provenance_of_formula(&wake.file.toml);
    let figure = Figure::side_by_side([
        beside(&wake, wake.circulation_plot()?, [[0, 1], [0, 2]])?,
        paths(&wake)?,
    ]);
    let figure = Figure {
        width: 1200.0,
        ..figure
    };
    let mut out = Rendered::new(&table(&wake)?, &figure, &origin)?;
    out.values = vec![wake.words()];
    out.claims = claims(&wake)?;
    Ok(out)
}

fn table(wake: &FinishedWake) -> Result<Table, Failure> {
    let names = "tau gamma_5_15_left_m2_s gamma_5_15_right_m2_s y_left_m z_left_m y_right_m z_right_m y_left z_left y_right z_right \
                 outward_shear_left outward_shear_right wall_shear";
    let mut table = Table::new();
    for name in names.split(' ') {
        table = table.float(name, wake.column(name)?.iter().copied());
    }
    let tau = wake.column("tau")?;
    for (name, column) in [("y_inviscid", 1), ("z_inviscid", 2)] {
        let path: Vec<(f64, f64)> = inviscid()?.iter().map(|r| (r[0], r[column])).collect();
        table = table.float(name, tau.iter().map(|tau| value_at(&path, *tau)));
    }
    Ok(table)
}

/// The independent simulation in the box of this profile.
fn reference(wake: &FinishedWake) -> Result<Vec<Vec<f64>>, Failure> {
    let narrow = wake.flow.size[1] < 4.5;
    numbers(if narrow {
        "wake_3d_ground_re5000_coarse_box4_cans.csv"
    } else {
        "wake_3d_ground_re5000_cans.csv"
    })
}

/// A plot with two columns of the independent simulation for each vortex.
fn beside(
    wake: &FinishedWake,
    plot: CurvePlot,
    columns: [[usize; 2]; 2],
) -> Result<CurvePlot, Failure> {
    let stored = reference(wake)?;
    let [left, right] = columns;
    let mut plot = plot;
    for (colour, (side, [x, y])) in [("left", left), ("right", right)].into_iter().enumerate() {
        let points = stored.iter().step_by(4).map(|r| (r[x], r[y]));
        let series = Series::new(&format!("Γ₀/ν = 5000, {side}"), Style::Markers, points);
        plot = plot.with(series.in_colour(colour));
    }
    Ok(plot)
}

fn paths(wake: &FinishedWake) -> Result<CurvePlot, Failure> {
    let mut plot = beside(wake, wake.path_plot()?, [[3, 4], [5, 6]])?;
    let hyperbola = inviscid()?;
    for (name, sign) in [("inviscid", 1.0), ("", -1.0)] {
        let mut path = Vec::new();
        for row in &hyperbola {
            if row[1] <= 2.0 {
                path.push((sign * row[1], row[2]));
            }
        }
        plot = plot.with(Series::new(name, Style::Dash, path));
    }
    Ok(plot)
}

fn claims(wake: &FinishedWake) -> Result<Vec<Claim>, Failure> {
    let y = mean(wake, "y", -1.0)?;
    let z = mean(wake, "z", 1.0)?;
    let mut claims = decay_claims(wake)?;
    claims.push(inviscid_path(wake, &y, &z)?);
    let inward = other_wakes("inward swing in b₀", OTHER_INWARDS_B0);
    claims.push(rebound(&y, &z).beside(&inward));
    Ok(claims)
}

/// The loss before the onset of the fast decay, its age and what is left. What depends on the Reynolds number of the chapter is
/// measured, but not judged, at another.
fn decay_claims(wake: &FinishedWake) -> Result<Vec<Claim>, Failure> {
    let gamma = mean(wake, "gamma_ratio", 1.0)?;
    let onset = onset(&gamma);
    let noise = format!(
        "noise {} V₀, Γ₀/ν = {}",
        wake.flow.perturbation, wake.flow.reynolds
    );
    let meets = knee(&gamma).map_or("never".into(), |tau| format!("at {tau:.2}"));
    let onset_words = onset.map_or("never".into(), |tau| format!("tau = {tau:.2}"));
    let lost = onset.map_or(f64::NAN, |tau| 1.0 - value_at(&gamma, tau - 0.1));
    let left = value_at(&gamma, 5.0);
    let claims = [
        Claim::exact(
            "F7a",
            format!("{lost:.3} at the onset, {onset_words}"),
            lost < 0.1,
        )
        .beside(&noise),
        Claim::exact(
            "F7b",
            format!(
                "{onset_words}, where the loss is three times the early one; straight lines through the early and the steepest decay meet {meets}"
            ),
            onset.is_some_and(|tau| (tau - 2.8).abs() <= 0.3),
        )
        .beside(&format!(
            "{noise}; {}",
            other_wakes("tau where the lines meet", OTHER_ONSETS_TAU)
        )),
        Claim::exact(
            "F7c",
            format!("{left:.3} at tau = 5"),
            (left - 0.6).abs() <= 0.07,
        )
        .beside(&format!(
            "{noise}; {}",
            other_wakes("final level", OTHER_LEVELS)
        )),
    ];
    let is_of_chapter =
        wake.flow.reynolds >= CHAPTER_REYNOLDS && wake.flow.core_radius <= CHAPTER_CORE_B0;
    if is_of_chapter {
        return Ok(claims.to_vec());
    }
    let needed = "a wake at 2e4 with a core of 0.05 b₀: `--wake` of preset fine (an hour), profile full (days)";
    Ok(claims.map(|claim| claim.open(needed)).to_vec())
}

/// The age at which the boundary layer separates: the shear at the ground turns. NaN if it does not.
fn separation_tau(wake: &FinishedWake) -> Result<f64, Failure> {
    let shear = mean(wake, "outward_shear", 1.0)?;
    let largest = wake.column("wall_shear")?;
    for ((tau, shear), largest) in shear.into_iter().zip(largest) {
        // On the lines of symmetry the shear is zero to round-off and noise from the start.
        if tau > 0.1 && shear < -0.01 * largest {
            return Ok(tau);
        }
    }
    Ok(f64::NAN)
}

/// How far the path of a wake is from the hyperbola until the boundary layer separates, as curves and at equal times.
fn inviscid_path(
    wake: &FinishedWake,
    y: &[(f64, f64)],
    z: &[(f64, f64)],
) -> Result<Claim, Failure> {
    let separation = separation_tau(wake)?;
    let mut curve = Vec::new();
    let mut exact_y = Vec::new();
    let mut exact_z = Vec::new();
    for row in inviscid()? {
        curve.push([row[1], row[2]]);
        exact_y.push((row[0], row[1]));
        exact_z.push((row[0], row[2]));
    }
    let mut worst = 0.0_f64;
    let mut lag = 0.0_f64;
    for &(tau, _) in y.iter().filter(|(tau, _)| *tau <= separation) {
        let point = [value_at(y, tau), value_at(z, tau)];
        let away_y = point[0] - value_at(&exact_y, tau);
        let away_z = point[1] - value_at(&exact_z, tau);
        lag = lag.max(away_y.hypot(away_z));
        worst = worst.max(off_curve(point, &curve));
    }
    let measured = format!(
        "{worst:.4} b₀ between the curves until tau = {separation:.2}, where the shear at the ground turns; {lag:.4} b₀ at equal times"
    );
    Ok(Claim::exact(
        "F7d",
        measured,
        separation.is_finite() && worst < 0.03,
    ))
}

/// The path of point vortices: tau, y, z.
fn inviscid() -> Result<Vec<Vec<f64>>, Failure> {
    numbers("vortex_pair_inviscid_ground_h1.csv")
}

/// Distance of a point from a curve of straight pieces.
fn off_curve(point: [f64; 2], curve: &[[f64; 2]]) -> f64 {
    let mut nearest = f64::INFINITY;
    for ends in curve.windows(2) {
        let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let from = [point[0] - ends[0][0], point[1] - ends[0][1]];
        let length2 = along[0].powi(2) + along[1].powi(2);
        let share = ((along[0] * from[0] + along[1] * from[1]) / length2).clamp(0.0, 1.0);
        let distance = (from[0] - share * along[0]).hypot(from[1] - share * along[1]);
        nearest = nearest.min(distance);
    }
    nearest
}

fn rebound(y: &[(f64, f64)], z: &[(f64, f64)]) -> Claim {
    let lowest = z
        .iter()
        .filter(|p| p.0 < 2.0)
        .fold((0.0, f64::INFINITY), |m, p| if p.1 < m.1 { *p } else { m });
    let top = z
        .iter()
        .filter(|p| p.0 > lowest.0 && p.0 < 3.5)
        .fold((0.0, 0.0), |m, p| if p.1 > m.1 { *p } else { m });
    let [widest, inner] = swing(y);
    let measured = format!(
        "lowest {:.3} at tau = {:.2}, top {:.3} at {:.2}; widest {:.3} at {:.2}, then inward to {:.3} at {:.2}",
        lowest.1, lowest.0, top.1, top.0, widest.1, widest.0, inner.1, inner.0
    );
    let pass = top.1 > lowest.1 + 0.2 && inner.1 < widest.1 - 0.1;
    Claim::exact("F7e", measured, pass)
}

/// The widest place of a path `y` until `tau = 3`, and the innermost after it.
fn swing(y: &[(f64, f64)]) -> [(f64, f64); 2] {
    let mut widest = (0.0, 0.0);
    for point in y.iter().filter(|p| p.0 < 3.0) {
        if point.1 > widest.1 {
            widest = *point;
        }
    }
    let mut innermost = (0.0, f64::INFINITY);
    for point in y.iter().filter(|p| p.0 > widest.0) {
        if point.1 < innermost.1 {
            innermost = *point;
        }
    }
    [widest, innermost]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_lags_is_on_the_curve() {
        let curve = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]];
        for (point, distance) in [
            ([0.5, 0.0], 0.0),
            ([0.5, 0.3], 0.3),
            ([1.2, 1.9], 0.2),
            ([1.3, 2.4], 0.5),
        ] {
            assert!((off_curve(point, &curve) - distance).abs() < 1e-12);
        }
    }
}
