//! What the crates compute now against the stored curves of `tests/reference`.

#[test]
fn every_stored_curve_is_computed_within_its_tolerance() {
    for curve in &wakescope_tests::curves::ALL {
        let found = curve.compare().unwrap();
        let (error, worst) = (found.worst_error, found.x[found.worst]);
        assert!(
            found.is_within(curve),
            "{}: {error:e} at {} = {worst}; `cargo xtask regress` draws it",
            curve.name,
            curve.x
        );
    }
}
