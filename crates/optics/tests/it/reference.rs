//! The stored curves of the optics.

/// Rows of a stored curve, without comment and header lines.
pub(crate) fn reference(name: &str) -> Vec<Vec<f64>> {
    let path = format!(
        "{}/../../tests/reference/optics/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    std::fs::read_to_string(path)
        .expect("stored curve")
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| {
            line.split(',')
                .map(|v| v.parse().expect("number"))
                .collect()
        })
        .collect()
}
