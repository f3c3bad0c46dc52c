//! The stored curves and how each is computed now.

use crate::claim::Claim;
use crate::failure::Failure;
use crate::workspace::read;

mod compute;

/// Where a stored curve comes from.
#[derive(Clone, Copy)]
pub(crate) enum Origin {
    /// Made by other means than these crates; its file says which.
    Independent,
    /// Written by `cargo xtask bless`.
    Blessed {
        /// What the curve is, with units, for the head of its file.
        quantity: &'static str,
        /// The abscissae.
        grid: fn() -> Vec<f64>,
    },
}

/// A stored curve y(x) and its counterpart.
pub(crate) struct Curve {
    pub(crate) name: &'static str,
    /// Path from the root of the workspace.
    pub(crate) file: &'static str,
    /// Column of the abscissa, with its unit.
    pub(crate) x: &'static str,
    /// Column of the ordinate, with its unit.
    pub(crate) y: &'static str,
    /// Largest allowed |computed - stored| / scale, the scale being |stored| or, where
    /// `absolute`, 1.
    pub(crate) tolerance: f64,
    pub(crate) absolute: bool,
    pub(crate) origin: Origin,
    pub(crate) compute: fn(&[f64]) -> Result<Vec<f64>, Failure>,
}

/// Stored and computed values side by side.
pub(crate) struct Comparison {
    pub(crate) x: Vec<f64>,
    pub(crate) stored: Vec<f64>,
    pub(crate) computed: Vec<f64>,
    pub(crate) worst: usize,
    pub(crate) worst_error: f64,
}

impl Comparison {
    pub(crate) fn claim(&self, curve: &Curve) -> Claim {
        Claim::at_most(curve.name, self.worst_error, curve.tolerance)
    }
}

impl Curve {
    /// Reads the stored curve, computes it anew, and finds the largest error.
    pub(crate) fn compare(&self) -> Result<Comparison, Failure> {
        let (x, stored) =
            columns(&read(self.file)?, self.x, self.y).map_err(|e| Failure::new(format!("{}: {e}", self.file)))?;
        let computed = (self.compute)(&x)?;
        if computed.len() != stored.len() {
            return Err(Failure::new(format!("{} points computed, {} stored", computed.len(), stored.len())));
        }
        let error = |i: usize| {
            let scale = if self.absolute { 1.0 } else { stored[i].abs() };
            let e = (computed[i] - stored[i]).abs() / scale;
            // What is not a number agrees with nothing, unless both values are equal and zero.
            if computed[i] == stored[i] {
                0.0
            } else if e.is_nan() {
                f64::INFINITY
            } else {
                e
            }
        };
        let worst = (0..x.len())
            .max_by(|&i, &j| error(i).total_cmp(&error(j)))
            .ok_or_else(|| Failure::new("no points".into()))?;
        Ok(Comparison { worst_error: error(worst), worst, x, stored, computed })
    }
}

/// Two columns of a CSV text with `#` comments and one header row; rows without both values are left out.
fn columns(text: &str, x: &str, y: &str) -> Result<(Vec<f64>, Vec<f64>), String> {
    let mut lines = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()).peekable();
    // A file without a header row names its columns in the last comment.
    let numbers = lines.peek().is_some_and(|l| l.split(',').all(|c| c.trim().parse::<f64>().is_ok()));
    let comment = text.lines().rfind(|l| l.starts_with('#')).map(|l| l.trim_start_matches('#'));
    let header = if numbers { comment } else { lines.next() };
    let header: Vec<&str> = header.unwrap_or("").split(',').collect();
    let find = |name: &str| header.iter().position(|h| h.trim() == name).ok_or(format!("no column {name}"));
    let (ix, iy) = (find(x)?, find(y)?);
    let mut out = (Vec::new(), Vec::new());
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        if let (Some(Ok(x)), Some(Ok(y))) =
            (cells.get(ix).map(|c| c.trim().parse()), cells.get(iy).map(|c| c.trim().parse()))
        {
            out.0.push(x);
            out.1.push(y);
        }
    }
    Ok(out)
}

/// A curve from an independent source.
const fn independent(
    name: &'static str,
    file: &'static str,
    (x, y): (&'static str, &'static str),
    tolerance: f64,
    compute: fn(&[f64]) -> Result<Vec<f64>, Failure>,
) -> Curve {
    Curve { name, file, x, y, tolerance, absolute: false, origin: Origin::Independent, compute }
}

const ETA: &str = "tests/reference/optics/eta_freespace_table2.csv";
const UNTRUNCATED: &str = "tests/reference/optics/eta_untruncated_analytic.csv";
const CRLB: &str = "tests/reference/signal/crlb_200ns.csv";
const HYPERBOLA: &str = "tests/reference/les/vortex_pair_inviscid_ground_h1.csv";

const ORR_SOMMERFELD: &str = "tests/reference/les/orr_sommerfeld.csv";
const GROUND_PAIR: &str = "tests/reference/les/wake_2d_ground_re2500.csv";
/// The file names its columns in a sentence; this is what stands between the commas.
const GROUND_PAIR_ENSTROPHY: &str = "enstrophy 1/2 int w^2 and energy 1/2 int |u|^2 over y in [-3";

/// All stored curves.
pub(crate) const ALL: [Curve; 14] = [
    independent("optics/eta_intensity_radius", ETA, ("R_m", "eta_int_before"), 1e-9, compute::eta_intensity_radius),
    independent("optics/eta_field_radius", ETA, ("R_m", "eta_fld_before"), 1e-9, compute::eta_field_radius),
    independent("optics/eta_hankel", ETA, ("R_m", "eta_int_before"), 1e-7, compute::eta_hankel),
    independent("optics/snr_free_space", ETA, ("R_m", "snr_int"), 5e-9, compute::snr_free_space),
    independent("optics/eta_untruncated", UNTRUNCATED, ("R_m", "eta_collimated"), 1e-12, compute::eta_untruncated),
    Curve {
        absolute: true,
        ..independent(
            "les/m4_prime_kernel",
            "tests/reference/signal/m4prime_kernel.csv",
            ("x", "W"),
            1e-15,
            compute::m4_prime,
        )
    },
    Curve {
        absolute: true,
        ..independent("les/orr_sommerfeld", ORR_SOMMERFELD, ("Re", "omega_i"), 2e-7, compute::growth_rates)
    },
    independent(
        "les/ground_pair_enstrophy",
        GROUND_PAIR,
        ("tau", GROUND_PAIR_ENSTROPHY),
        2e-3,
        compute::pair_enstrophy,
    ),
    independent("les/inviscid_pair_y", HYPERBOLA, ("tau", "y"), 5e-9, compute::pair_y),
    independent("les/inviscid_pair_z", HYPERBOLA, ("tau", "z"), 5e-9, compute::pair_z),
    independent("estimate/bound_complex", CRLB, ("snr_db", "crlb_complex"), 1e-7, compute::bound_complex),
    independent("estimate/bound_real", CRLB, ("snr_db", "crlb_real"), 1e-7, compute::bound_real),
    Curve {
        name: "sim/map_line_velocity",
        file: "tests/reference/sim/map_line_velocity.csv",
        x: "range_m",
        y: "v_mean_m_s",
        tolerance: 1e-6,
        absolute: true,
        origin: Origin::Blessed {
            quantity: "Mean estimated radial velocity [m/s] against range [m] through the near vortex: analytic pair, 10 dB at every range, periodogram accumulation, seed 1.",
            grid: compute::map_line_ranges,
        },
        compute: compute::map_line_velocity,
    },
    Curve {
        name: "sim/mean_signal_power",
        file: "tests/reference/sim/mean_signal_power.csv",
        x: "range_m",
        y: "snr_db",
        tolerance: 1e-6,
        absolute: true,
        origin: Origin::Blessed {
            quantity: "Signal-to-noise ratio (14) [dB] against range [m], Table 2 in free space, whole chain.",
            grid: compute::profile_ranges,
        },
        compute: compute::profile_snr,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(compute: fn(&[f64]) -> Result<Vec<f64>, Failure>) -> Curve {
        independent("eta", ETA, ("R_m", "eta_int_before"), 1e-9, compute)
    }

    #[test]
    fn a_wrong_curve_fails() {
        let right = curve(compute::eta_intensity_radius);
        assert!(right.compare().unwrap().claim(&right).passes());
        let wrong = curve(|x| Ok(compute::eta_intensity_radius(x)?.into_iter().map(|y| y * (1.0 + 1e-8)).collect()));
        assert!(!wrong.compare().unwrap().claim(&wrong).passes());
        let nan = curve(|x| Ok(vec![f64::NAN; x.len()]));
        assert!(!nan.compare().unwrap().claim(&nan).passes());
    }

    #[test]
    fn rows_and_columns_are_found_by_name() {
        let text = "# head\na,b,c\n1,2,3\n4,,6\n";
        assert_eq!(columns(text, "c", "a"), Ok((vec![3.0, 6.0], vec![1.0, 4.0])));
        assert_eq!(columns(text, "a", "b"), Ok((vec![1.0], vec![2.0])));
        assert!(columns(text, "a", "d").is_err());
        assert_eq!(columns("# head\n# p, q\n1,2\n", "q", "p"), Ok((vec![2.0], vec![1.0])));
    }
}
