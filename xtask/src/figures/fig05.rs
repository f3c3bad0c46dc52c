//! Figure 5: the M'4 stencil of a point on a line of sight.

use super::context::*;
use wakescope_les::winds::m4_prime;

/// Spacing of the grid, m.
const SPACING_M: f64 = 1.0;
/// The point on the line of sight, m.
const TARGET_M: (f64, f64) = (400.37, 47.61);

/// The coordinate \[m\] and the weight of a node along one axis, of the four about a target.
fn node(target_m: f64, node: usize) -> (f64, f64) {
    let first = (target_m / SPACING_M).floor() - 1.0;
    let position_m = SPACING_M * (first + node as f64);
    let weight = m4_prime((target_m - position_m) / SPACING_M);
    (position_m, weight)
}

/// Grid points (y, z) \[m\] about a target with their weights.
fn stencil(target: (f64, f64)) -> Vec<[f64; 3]> {
    let mut nodes = Vec::new();
    for k in 0..4 {
        for j in 0..4 {
            let (y_m, y_weight) = node(target.0, j);
            let (z_m, z_weight) = node(target.1, k);
            nodes.push([y_m, z_m, y_weight * z_weight]);
        }
    }
    nodes
}

/// Largest error of interpolating the nine products of 1, y, y^2 with 1, z, z^2 about the target; the first is that of the sum.
fn errors(nodes: &[[f64; 3]], target: (f64, f64)) -> [f64; 9] {
    std::array::from_fn(|n| {
        let exact = product(n, target, target.0, target.1);
        let sum: f64 = nodes
            .iter()
            .map(|[y, z, weight]| weight * product(n, target, *y, *z))
            .sum();
        (sum - exact).abs()
    })
}

/// Product of powers number `n` at (y, z), with an offset origin, so that no power of the target itself vanishes.
fn product(n: usize, target: (f64, f64), y: f64, z: f64) -> f64 {
    let p = (n % 3) as i32;
    let q = (n / 3) as i32;
    (y - target.0 + 0.7).powi(p) * (z - target.1 - 0.4).powi(q)
}

/// Points of the grid that is drawn, inside of the stencil or outside.
fn grid(is_inside: bool) -> Vec<(f64, f64)> {
    let y_m = TARGET_M.0.floor() as i32;
    let z_m = TARGET_M.1.floor() as i32;
    let stencil = -1..=2;
    let mut points = Vec::new();
    for k in -3..=4 {
        for j in -3..=4 {
            if (stencil.contains(&j) && stencil.contains(&k)) == is_inside {
                points.push((f64::from(y_m + j), f64::from(z_m + k)));
            }
        }
    }
    points
}

fn plot() -> CurvePlot {
    let slope = TARGET_M.1 / TARGET_M.0;
    let line = [-3.5, 4.5].map(|d| (TARGET_M.0 + d, TARGET_M.1 + slope * d));
    let title = "M'4 stencil: 16 grid points for one point of a line of sight";
    let x = Axis::linear("y [m]").between(396.5, 406.5);
    let mut plot = CurvePlot::new(title, x, Axis::linear("z [m]"))
        .with(Series::new("line of sight", Style::Line, line))
        .with(Series::new("grid", Style::Markers, grid(false)))
        .with(Series::new("stencil", Style::Markers, grid(true)))
        .with(Series::new("target", Style::Markers, [TARGET_M]));
    plot.equal_scales = true;
    plot
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let nodes = stencil(TARGET_M);
    let table = numbers_table("y_m z_m weight", &nodes);
    let parameters = format!(
        "spacing_m = {SPACING_M:?}\ntarget_y_m = {:?}\ntarget_z_m = {:?}\n",
        TARGET_M.0, TARGET_M.1
    );
    let origin = context.provenance_of_formula(&parameters);
    let mut out = Rendered::new(&table, &Figure::stacked([plot()]), &origin)?;
    out.claims.push(claim(nodes.len()));
    Ok(out)
}

/// The claim holds for any target: a grid of offsets is tried.
fn claim(nodes: usize) -> Claim {
    let mut sum_error = 0.0_f64;
    let mut quadratic = 0.0_f64;
    for a in 0..20 {
        for b in 0..20 {
            let target = (400.0 + 0.05 * f64::from(a), 47.0 + 0.05 * f64::from(b));
            let errors = errors(&stencil(target), target);
            sum_error = sum_error.max(errors[0]);
            quadratic = errors.into_iter().fold(quadratic, f64::max);
        }
    }
    Claim::exact(
        "F5",
        format!("{nodes}; {sum_error:.1e} in the sum, {quadratic:.1e} in quadratics"),
        nodes == 16 && sum_error < 1e-12 && quadratic < 1e-12,
    )
}
