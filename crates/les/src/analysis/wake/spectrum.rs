//! Kinetic energy of a flow by axial wave number.
//!
//! Check: a field of known modes.

use rayon::prelude::*;
use realfft::{RealFftPlanner, RealToComplex};

use super::vorticity::Curl;
use crate::Error;
use crate::solver::planes::Faces;

/// Energy per length of x \[m^4/s^2\] of each axial mode `m = 0..=n/2`, wavelength `L_x/m`, all
/// velocity components together.
///
/// # Errors
/// Those of the exchange between ranks.
pub(super) fn mode_energies_m4_s2(curl: &Curl, velocity: &Faces) -> Result<Vec<f64>, Error> {
    let nx = curl.cell_m[0].len();
    let transform = RealFftPlanner::new().plan_fft_forward(nx);
    let modes = nx / 2 + 1;
    let mut energies = vec![0.0; modes];
    for (component, field) in velocity.field.iter().enumerate() {
        let [y_m, z_m] = [1, 2].map(|d| {
            if component == d {
                &curl.face_m[d]
            } else {
                &curl.cell_m[d]
            }
        });
        let own = field[velocity.shape.own_range()].par_chunks(velocity.shape.plane());
        let own: Vec<Vec<f64>> = own
            .map(|plane| plane_spectrum(&*transform, plane, y_m))
            .collect();
        let planes = velocity.slabs.all_gather(own.concat())?;
        for (sums, z_m) in planes.chunks(modes).zip(z_m) {
            for (energy, sum) in energies.iter_mut().zip(sums) {
                *energy += 0.5 * z_m * sum;
            }
        }
    }
    for (m, energy) in energies.iter_mut().enumerate() {
        // All but the mean and the shortest wave of an even count stand for themselves and their
        // conjugate.
        let pair = if m == 0 || 2 * m == nx { 1.0 } else { 2.0 };
        *energy *= pair / (nx * nx) as f64;
    }
    Ok(energies)
}

/// Squared moduli of the spectra of the rows of a plane, weighted with their lengths and summed.
fn plane_spectrum(transform: &dyn RealToComplex<f64>, plane: &[f64], y_m: &[f64]) -> Vec<f64> {
    let nx = transform.len();
    let mut row = vec![0.0; nx];
    let mut scratch = transform.make_scratch_vec();
    let mut spectrum = transform.make_output_vec();
    let mut sums = vec![0.0; spectrum.len()];
    for (values, y_m) in plane.chunks(nx).zip(y_m) {
        row.copy_from_slice(values);
        let transformed = transform.process_with_scratch(&mut row, &mut spectrum, &mut scratch);
        // The buffers were made by the plan: their lengths are right.
        if transformed.is_ok() {
            for (sum, value) in sums.iter_mut().zip(&spectrum) {
                *sum += y_m * value.norm_sqr();
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::layout::Layout;
    use crate::solver::mesh::{Direction, Mesh, Spread, Wall};
    use crate::solver::shape::Shape;
    use std::f64::consts::TAU;

    #[test]
    fn a_field_of_known_modes_has_their_energies() {
        for nx in [9, 12] {
            let x = Direction::periodic(nx, 0.0, 3.0);
            let y = Direction::periodic(8, 0.0, 2.0).stretched(Spread::Sine.by(0.3));
            let z = Direction::between(16, 0.0, 0.5, Wall::AT_REST, Wall::Slip)
                .stretched(Spread::TanhLow.by(1.0));
            let mesh = Mesh::new(x, y, z).unwrap();
            let curl = Curl::new(&mesh).unwrap();
            let x_m = mesh.face_m(0);
            let u: Vec<f64> = (0..8 * 16)
                .flat_map(|_| {
                    x_m[..nx]
                        .iter()
                        .map(|x| 0.7 + 0.5 * (2.0 * TAU * x / 3.0 + 0.3).cos())
                })
                .collect();
            let v: Vec<f64> = (0..8 * 16)
                .flat_map(|_| x_m[..nx].iter().map(|x| (TAU * x / 3.0).sin()))
                .collect();
            let w = vec![0.0; u.len()];
            let faces = Faces {
                shape: Shape::whole([nx, 8, 16]),
                field: [u, v, w],
                slabs: Layout::new(&mesh).slabs,
            };
            let energies = mode_energies_m4_s2(&curl, &faces).unwrap();
            assert_eq!(energies.len(), nx / 2 + 1);
            // The area is 1; a wave of amplitude a has the energy a^2/4.
            for (m, expected) in [0.5 * 0.49, 0.25, 0.25 * 0.25, 0.0].into_iter().enumerate() {
                assert!(
                    (energies[m] - expected).abs() < 1e-13,
                    "{nx}, {m}: {}",
                    energies[m]
                );
            }
        }
        let even = Direction::periodic(4, 0.0, 1.0);
        let z = Direction::between(4, 0.0, 1.0, Wall::Slip, Wall::Slip);
        let mesh = Mesh::new(even.clone(), even, z).unwrap();
        let curl = Curl::new(&mesh).unwrap();
        let saw: Vec<f64> = (0..64)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let field = [saw, vec![0.0; 64], vec![0.0; 64]];
        let faces = Faces {
            shape: Shape::whole([4; 3]),
            field,
            slabs: Layout::new(&mesh).slabs,
        };
        let energies = mode_energies_m4_s2(&curl, &faces).unwrap();
        assert!(
            (energies[2] - 0.5).abs() < 1e-14 && energies[0].abs() < 1e-14,
            "the shortest wave: {energies:?}"
        );
    }
}
