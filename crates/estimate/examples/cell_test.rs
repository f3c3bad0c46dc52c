//! How much signal a spectral cell needs to be found: `cargo run -p wakescope-estimate --example cell_test`.

#![allow(clippy::print_stdout)]

use wakescope_estimate::Error;
use wakescope_estimate::estimators::CellTest;

fn main() -> Result<(), Error> {
    println!("windows,threshold_known_noise,needed_snr,threshold_against_16_cells,needed_snr");
    for windows in [1.0, 4.0, 10.0, 40.0, 100.0] {
        let row = [
            CellTest::known_noise(windows)?,
            CellTest::against_cells(windows, 16.0)?,
        ]
        .map(|test| Ok::<_, Error>((test.threshold(1e-4)?, test.needed_snr(1e-4, 0.9)?)));
        let [known, against] = row;
        let ((t, s), (u, v)) = (known?, against?);
        println!("{windows},{t:.4},{s:.3},{u:.4},{v:.3}");
    }
    Ok(())
}
