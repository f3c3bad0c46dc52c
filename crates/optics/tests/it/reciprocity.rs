//! Receiver-plane form of the heterodyne efficiency: light scattered at the target and carried back
//! through the same screens mixes with the local oscillator at the receiver as the BPLO's field at
//! that point says.

use rustfft::num_complex::Complex;
use std::sync::Arc;
use wakescope_optics::screens::{Propagator, ScreenGenerator, stream};
use wakescope_optics::{Grid, VonKarman};

#[test]
fn receiver_plane_overlap_is_the_oscillators_field_at_the_target() {
    let grid = Grid {
        nx: 96,
        ny: 80,
        dx_m: 4e-3,
        dy_m: 5e-3,
    };
    let propagator = Propagator::<f64>::new(grid, 1.55e-6).expect("propagator");
    let mut work = propagator.work();
    let generator =
        ScreenGenerator::<f64>::new(grid, Arc::new(VonKarman::table2())).expect("generator");
    let mut screen_work = generator.work();
    let (mut first, mut second) = (vec![0.0; grid.points()], vec![0.0; grid.points()]);
    generator
        .fill_pair(
            &mut stream(3, 0, 0),
            &mut screen_work,
            &mut first,
            &mut second,
        )
        .expect("screens");
    // A strong path: 4 rad or so over the beam.
    let strength = 25.0;
    let [half, whole] = [60.0, 120.0].map(|d| propagator.transfer(d).expect("step"));
    let oscillator: Vec<Complex<f64>> = (0..grid.points())
        .map(|i| {
            let x = (i % 96) as f64 * 4e-3 - 48.0 * 4e-3;
            let y = (i / 96) as f64 * 5e-3 - 40.0 * 5e-3;
            Complex::cis(300.0 * x) * (-(x * x + y * y) / (2.0 * 0.02 * 0.02)).exp()
        })
        .collect();
    let mut out = oscillator.clone();
    propagator
        .step(&mut out, None, &half, &mut work)
        .expect("sizes");
    propagator
        .step(&mut out, Some((&first, strength)), &whole, &mut work)
        .expect("sizes");
    propagator
        .step(&mut out, Some((&second, strength)), &half, &mut work)
        .expect("sizes");
    let largest = out.iter().map(|e| e.norm()).fold(0.0, f64::max);
    for (x, y) in [(48, 40), (52, 37), (44, 44)] {
        let target = y * 96 + x;
        let mut back = vec![Complex::default(); grid.points()];
        back[target] = Complex::new(1.0, 0.0);
        propagator
            .step(&mut back, None, &half, &mut work)
            .expect("sizes");
        propagator
            .step(&mut back, Some((&second, strength)), &whole, &mut work)
            .expect("sizes");
        propagator
            .step(&mut back, Some((&first, strength)), &half, &mut work)
            .expect("sizes");
        let overlap: Complex<f64> = back.iter().zip(&oscillator).map(|(u, e)| u * e).sum();
        assert!(
            (overlap - out[target]).norm() < 2e-3 * largest,
            "{x} {y}: {overlap} {}",
            out[target]
        );
    }
}
