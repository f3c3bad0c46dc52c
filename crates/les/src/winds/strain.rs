//! The largest gradient of the radial velocity along any line, from the gradient of the velocity.
//!
//! Check: pure shear has half of it, a stretching itself; rotation has none.

use std::f64::consts::PI;

/// The eigenvalue of largest magnitude of the strain rate of a velocity gradient
/// `[component][direction]` \[1/s\], by the cosines of the cubic (Smith 1961).
pub(crate) fn largest_strain_per_s(gradient_per_s: &[[f64; 3]; 3]) -> f64 {
    let g = gradient_per_s;
    let [xx, yy, zz] = [g[0][0], g[1][1], g[2][2]];
    let [xy, xz, yz] = [
        0.5 * (g[0][1] + g[1][0]),
        0.5 * (g[0][2] + g[2][0]),
        0.5 * (g[1][2] + g[2][1]),
    ];
    let mean = (xx + yy + zz) / 3.0;
    let [a, b, c] = [xx - mean, yy - mean, zz - mean];
    let spread = ((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    if spread == 0.0 {
        return mean.abs();
    }
    let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    let angle = (0.5 * determinant / (spread * spread * spread))
        .clamp(-1.0, 1.0)
        .acos()
        / 3.0;
    let first = (mean + 2.0 * spread * angle.cos()).abs();
    let last = (mean + 2.0 * spread * (angle + 2.0 * PI / 3.0).cos()).abs();
    first.max(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn shear_stretching_and_rotation_have_their_strain() {
        let shear = [[0.0, 0.0, 0.3], [0.0; 3], [0.0; 3]];
        assert_relative_eq!(largest_strain_per_s(&shear), 0.15, max_relative = 1e-12);
        let stretch = [[0.2, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 0.3]];
        assert_relative_eq!(largest_strain_per_s(&stretch), 0.5, max_relative = 1e-12);
        assert_eq!(
            largest_strain_per_s(&[[0.0, -0.4, 0.0], [0.4, 0.0, 0.0], [0.0; 3]]),
            0.0
        );
        // Eigenvalues 3 and -1 of a full matrix: ones everywhere off the diagonal 0 give 2 and -1.
        let full = [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]];
        assert_relative_eq!(largest_strain_per_s(&full), 2.0, max_relative = 1e-12);
    }
}
