//! The markers of curves.

/// Corners of the marker of a series: its shape differs as well as its colour.
pub(crate) fn marker(at: (f64, f64), index: usize) -> Vec<(f64, f64)> {
    let (corners, radius, turn): (u32, f64, f64) = match index % 4 {
        0 => (24, 4.6, 0.0),
        1 => (4, 5.6, 0.125),
        2 => (3, 6.2, -0.25),
        _ => (4, 5.8, 0.0),
    };
    (0..corners)
        .map(|i| {
            let angle = std::f64::consts::TAU * (f64::from(i) / f64::from(corners) + turn);
            (at.0 + radius * angle.cos(), at.1 + radius * angle.sin())
        })
        .collect()
}
