//! Figure 5: the M'4 stencil of a point on a line of sight.

use super::context::*;
use wakescope_les::winds::m4_prime;

/// Spacing of the grid, m.
const SPACING_M: f64 = 1.0;
/// The point on the line of sight, m.
const TARGET_M: (f64, f64) = (400.37, 47.61);

/// Grid points (y, z) \[m\] about a target with their weights.
fn stencil(target: (f64, f64)) -> Vec<[f64; 3]> {
    let first = |x: f64| (x / SPACING_M).floor() - 1.0;
    let place = |at: f64, node: usize| SPACING_M * (first(at) + node as f64);
    let weight = |at: f64, node: usize| m4_prime((at - place(at, node)) / SPACING_M);
    let node = |n: usize| (n % 4, n / 4);
    let all = (0..16).map(node);
    all.map(|(j, k)| {
        [
            place(target.0, j),
            place(target.1, k),
            weight(target.0, j) * weight(target.1, k),
        ]
    })
    .collect()
}

/// Largest error of interpolating the nine products of 1, y, y^2 with 1, z, z^2 about the target; the first is that of the sum.
fn errors(nodes: &[[f64; 3]], target: (f64, f64)) -> [f64; 9] {
    std::array::from_fn(|n| {
        let (p, q) = ((n % 3) as i32, (n / 3) as i32);
        // An offset origin, so that no power of the target itself vanishes.
        let f = |y: f64, z: f64| (y - target.0 + 0.7).powi(p) * (z - target.1 - 0.4).powi(q);
        let sum: f64 = nodes.iter().map(|[y, z, weight]| weight * f(*y, *z)).sum();
        (sum - f(target.0, target.1)).abs()
    })
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let nodes = stencil(TARGET_M);
    let table = numbers_table("y_m z_m weight", &nodes);
    let parameters = format!(
        "spacing_m = {SPACING_M:?}\ntarget_y_m = {:?}\ntarget_z_m = {:?}\n",
        TARGET_M.0, TARGET_M.1
    );
    let origin = context.provenance_of_formula(&parameters);

    let grid = |inside: bool| {
        let (j0, k0) = (TARGET_M.0.floor() as i32, TARGET_M.1.floor() as i32);
        let all = (-3..=4).flat_map(move |k| (-3..=4).map(move |j| (j, k)));
        all.filter(|(j, k)| ((-1..=2).contains(j) && (-1..=2).contains(k)) == inside)
            .map(|(j, k)| (f64::from(j0 + j), f64::from(k0 + k)))
            .collect::<Vec<_>>()
    };
    let slope = TARGET_M.1 / TARGET_M.0;
    let line: Vec<(f64, f64)> = [-3.5, 4.5]
        .iter()
        .map(|d| (TARGET_M.0 + d, TARGET_M.1 + slope * d))
        .collect();
    let title = "M'4 stencil: 16 grid points for one point of a line of sight";
    let mut plot = CurvePlot::new(
        title,
        Axis::linear("y [m]").between(396.5, 406.5),
        Axis::linear("z [m]"),
    )
    .with(Series::new("line of sight", Style::Line, line))
    .with(Series::new("grid", Style::Markers, grid(false)))
    .with(Series::new("stencil", Style::Markers, grid(true)))
    .with(Series::new("target", Style::Markers, [TARGET_M]));
    plot.equal_scales = true;
    let mut out = Rendered::new(&table, &Figure::stacked([plot]), &origin)?;
    // The claim holds for any target: a grid of offsets is tried.
    let (mut sum_error, mut quadratic): (f64, f64) = (0.0, 0.0);
    for (a, b) in (0..20).flat_map(|a| (0..20).map(move |b| (a, b))) {
        let target = (400.0 + 0.05 * f64::from(a), 47.0 + 0.05 * f64::from(b));
        let errors = errors(&stencil(target), target);
        sum_error = sum_error.max(errors[0]);
        quadratic = errors.into_iter().fold(quadratic, f64::max);
    }
    out.claims.push(Claim::exact(
        "F5",
        format!(
            "{}; {sum_error:.1e} in the sum, {quadratic:.1e} in quadratics",
            nodes.len()
        ),
        nodes.len() == 16 && sum_error < 1e-12 && quadratic < 1e-12,
    ));
    Ok(out)
}
