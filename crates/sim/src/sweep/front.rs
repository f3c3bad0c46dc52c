//! The Pareto front: the points that no other point dominates.
//!
//! a dominates b if it is nowhere worse and somewhere better. Equal points all stay; a point with a value that is not finite is
//! never on the front and dominates none. Check: the stored fronts, and every pair of 1000 random points.

use super::stored::CaseResult;

/// The rows on the front of precision and resolution, in their order.
pub(super) fn on_front(rows: &[CaseResult]) -> Vec<&CaseResult> {
    let resolution_m = rows.iter().map(|row| row.result("resolution_m")).collect();
    let std_m_s = rows.iter().map(|row| row.result("std_m_s")).collect();
    let mut found = Vec::new();
    for (row, is_on_front) in rows.iter().zip(front(&[resolution_m, std_m_s])) {
        if is_on_front {
            found.push(row);
        }
    }
    found
}

/// Whether each point is on the front; `costs` has a column for each objective, of which small values are better.
#[must_use]
pub fn front(costs: &[Vec<f64>]) -> Vec<bool> {
    let points = costs.iter().map(Vec::len).min().unwrap_or(0);
    let mut finite: Vec<usize> = (0..points).collect();
    finite.retain(|&point| costs.iter().all(|column| column[point].is_finite()));
    let mut on_front = vec![false; points];
    for &point in &finite {
        on_front[point] = !finite.iter().any(|&other| dominates(costs, other, point));
    }
    on_front
}

/// Whether point `a` dominates point `b`.
fn dominates(costs: &[Vec<f64>], a: usize, b: usize) -> bool {
    costs.iter().all(|column| column[a] <= column[b])
        && costs.iter().any(|column| column[a] < column[b])
}
