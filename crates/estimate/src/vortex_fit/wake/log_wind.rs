//! Logarithmic part of the wind over height.
//!
//! Mean wind near the ground is logarithmic in neutral air, u_*/kappa ln(z/z_0), and has a linear part in stable air. Fitted with a straight line
//! alone, its curvature looks like noise that all velocities have in common, which hides wakes. The roughness length z_0 is not fitted: over the
//! heights of a sector it shifts the profile by a constant.
//! Check: the straight line by least squares; a wake in logarithmic wind.

/// Height \[m\] that is added to each, so that the logarithm is finite at the ground; scans have hardly a gate below it.
const LOWEST_M: f64 = 1.0;
/// Straight line next to ln(1 + z / 1 m) over the lowest 100 m, by least squares: at the ground, and per metre.
const LINE: f64 = 2.271_109_873_67;
const LINE_PER_M: f64 = 0.027_803_236_967;

/// ln(1 + z / 1 m) of a height z \[m\] without its straight line over the lowest 100 m; the logarithm stays 0 below the ground.
pub(crate) fn log_of_height(height_m: f64) -> f64 {
    (1.0 + height_m.max(0.0) / LOWEST_M).ln() - LINE - LINE_PER_M * height_m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over the lowest 100 m of what no straight line explains, and of that times the height, vanish.
    #[test]
    fn the_logarithm_has_no_straight_line_over_the_lowest_hundred_metres() {
        let steps = 100_000;
        let mut mean = 0.0;
        let mut moment_m = 0.0;
        let mut square = 0.0;
        for i in 0..steps {
            let height_m = 100.0 * (f64::from(i) + 0.5) / f64::from(steps);
            let value = log_of_height(height_m) / f64::from(steps);
            mean += value;
            moment_m += value * height_m;
            square += value * value * f64::from(steps);
        }
        assert!(mean.abs() < 1e-5, "{mean}");
        assert!(moment_m.abs() < 1e-3, "{moment_m}");
        assert!(square > 0.05);
        let step = log_of_height(40.0) - log_of_height(20.0);
        assert!((step - (41.0_f64 / 21.0).ln() + 20.0 * LINE_PER_M).abs() < 1e-12);
    }
}
