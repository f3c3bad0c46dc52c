//! Figure 5: the M'4 stencil of a point on a line of sight.

use super::context::{Context, Rendered};
use crate::claim::Claim;
use fixtures::failure::Failure;
use wakescope_les::winds::m4_prime;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

/// Spacing of the grid, m.
const SPACING_M: f64 = 1.0;
/// The point on the line of sight, m.
const TARGET_M: (f64, f64) = (400.37, 47.61);

/// A grid point with its weight.
struct Node {
    y_m: f64,
    z_m: f64,
    weight: f64,
}

fn stencil(target: (f64, f64)) -> Vec<Node> {
    let first = |x: f64| (x / SPACING_M).floor() - 1.0;
    let (j0, k0) = (first(target.0), first(target.1));
    let mut nodes = Vec::new();
    for k in 0..4 {
        for j in 0..4 {
            let (y_m, z_m) = (SPACING_M * (j0 + f64::from(j)), SPACING_M * (k0 + f64::from(k)));
            let weight = m4_prime((target.0 - y_m) / SPACING_M) * m4_prime((target.1 - z_m) / SPACING_M);
            nodes.push(Node { y_m, z_m, weight });
        }
    }
    nodes
}

/// Largest error of interpolating the nine products of 1, y, y^2 with 1, z, z^2 about the target.
fn quadratic_error(nodes: &[Node], target: (f64, f64)) -> f64 {
    let mut worst: f64 = 0.0;
    for (p, q) in (0..3).flat_map(|p| (0..3).map(move |q| (p, q))) {
        // An offset origin, so that no power of the target itself vanishes.
        let f = |y: f64, z: f64| (y - target.0 + 0.7).powi(p) * (z - target.1 - 0.4).powi(q);
        let sum: f64 = nodes.iter().map(|n| n.weight * f(n.y_m, n.z_m)).sum();
        worst = worst.max((sum - f(target.0, target.1)).abs());
    }
    worst
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let nodes = stencil(TARGET_M);
    let table = Table::new()
        .float("y_m", nodes.iter().map(|n| n.y_m))
        .float("z_m", nodes.iter().map(|n| n.z_m))
        .float("weight", nodes.iter().map(|n| n.weight));
    let parameters =
        format!("spacing_m = {SPACING_M:?}\ntarget_y_m = {:?}\ntarget_z_m = {:?}\n", TARGET_M.0, TARGET_M.1);
    let origin = context.provenance_of_formula(&parameters);

    let grid = |inside: bool| {
        let (j0, k0) = (TARGET_M.0.floor() as i32, TARGET_M.1.floor() as i32);
        let all = (-3..=4).flat_map(move |k| (-3..=4).map(move |j| (j, k)));
        all.filter(|(j, k)| ((-1..=2).contains(j) && (-1..=2).contains(k)) == inside)
            .map(|(j, k)| (f64::from(j0 + j), f64::from(k0 + k)))
            .collect::<Vec<_>>()
    };
    let slope = TARGET_M.1 / TARGET_M.0;
    let line: Vec<(f64, f64)> = [-3.5, 4.5].iter().map(|d| (TARGET_M.0 + d, TARGET_M.1 + slope * d)).collect();
    let title = "M'4 stencil: 16 grid points for one point of a line of sight";
    let mut plot = CurvePlot::new(title, Axis::linear("y [m]").between(396.5, 406.5), Axis::linear("z [m]"))
        .with(Series::new("line of sight", Style::Line, line))
        .with(Series::new("grid", Style::Markers, grid(false)))
        .with(Series::new("stencil", Style::Markers, grid(true)))
        .with(Series::new("target", Style::Markers, [TARGET_M]));
    plot.equal_scales = true;
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    out.caption = "The 16 grid points (26) that give the velocity at one point of a line of sight; their weights, \
                   products of the kernel (27), are in the table."
        .into();

    // The claim holds for any target: a grid of offsets is tried.
    let (mut sum_error, mut quadratic): (f64, f64) = (0.0, 0.0);
    for (a, b) in (0..20).flat_map(|a| (0..20).map(move |b| (a, b))) {
        let target = (400.0 + 0.05 * f64::from(a), 47.0 + 0.05 * f64::from(b));
        let nodes = stencil(target);
        sum_error = sum_error.max((nodes.iter().map(|n| n.weight).sum::<f64>() - 1.0).abs());
        quadratic = quadratic.max(quadratic_error(&nodes, target));
    }
    out.claims.push(Claim::exact(
        "F5",
        format!("{}; {sum_error:.1e} in the sum, {quadratic:.1e} in quadratics", nodes.len()),
        nodes.len() == 16 && sum_error < 1e-12 && quadratic < 1e-12,
    ));
    Ok(out)
}
