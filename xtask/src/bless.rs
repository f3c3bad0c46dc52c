//! `cargo xtask bless NAME ...`: writes stored curves from what the crates compute now.
//!
//! The only way to write one. Curves from independent sources are never written.

use crate::wakes;
use crate::workspace::root;
use fixtures::failure::{Failure, Outcome};
use wakescope_sim::io::write_atomic;
use wakescope_tests::curves::{ALL, Curve, Origin};

/// Writes the curves.
///
/// # Errors
/// An unknown name, a curve of independent origin, or one that cannot be computed.
pub(crate) fn run(names: &[String]) -> Outcome {
    for name in names {
        if name == wakes::NAME {
            wakes::bless()?;
            continue;
        }
        let curve = curve(name)?;
        let Origin::Blessed { quantity, grid } = curve.origin else {
            let why = "it comes from an independent source and is not ours to write";
            return Err(Failure::new(format!("bless {name}: {why}")));
        };
        let x = grid();
        let y = (curve.compute)(&x)?;
        let mut text = format!(
            "# {quantity}\n# Source: cargo xtask bless {name}\n# Uncertainty: the same seed gives the same curve; tolerance of the comparison {:e}\n{},{}\n",
            curve.tolerance, curve.x, curve.y
        );
        for (x, y) in x.iter().zip(&y) {
            text += &format!("{x:?},{y:?}\n");
        }
        write_atomic(&root().join(curve.file), text)?;
        println!(
            "wrote {} points to {}: say in CHANGELOG.md, under Numerics, why the curve changed",
            x.len(),
            curve.file
        );
    }
    Ok(())
}

/// The stored curve of a name.
fn curve(name: &str) -> Result<&'static Curve, Failure> {
    ALL.iter().find(|curve| curve.name == name).ok_or_else(|| {
        let known: Vec<&str> = ALL.iter().map(|curve| curve.name).collect();
        Failure::new(format!(
            "bless {name}: no such curve; there are {}, {}",
            wakes::NAME,
            known.join(", ")
        ))
    })
}
