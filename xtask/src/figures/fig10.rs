//! Figure 10: the radial velocity of the early pair, the scatter of its estimates, and their relation to the gradient.
//!
//! Some independent batches of realisations give the correlation its confidence interval.

use super::context::{Context, Rendered};
use super::study::{Age, REFERENCES, Sight, Study, early_scene, mean_and_error, of_batch, stacked, with_method};
use crate::Failure;
use crate::claim::{Claim, Verdict};
use ndarray::Array2;
use wakescope_sim::io::tables::map_table;
use wakescope_sim::measure::write;
use wakescope_sim::plot::{Figure, MapPlot};

/// Batches, and Student's factor of a 95 % interval for their mean.
const BATCHES: u64 = 4;
const STUDENT: f64 = 3.182;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.choose(4, 32, 100);
    let sight = Sight::of(context, Age::Early)?;
    let (mut tables, mut panels, mut shown) = (Vec::new(), Vec::new(), Vec::new());
    let mut origin = None;
    let scene = |reference, batch| {
        let mut scene = of_batch(with_method(early_scene(realisations), "PA"), batch);
        scene.detector.snr = reference;
        scene
    };
    let scenes = REFERENCES.iter().flat_map(|(_, reference)| (0..BATCHES).map(|batch| scene(*reference, batch)));
    let all = Study::runs(context, &sight, scenes.collect())?;
    for ((name, _), studies) in REFERENCES.into_iter().zip(all.chunks(BATCHES as usize)) {
        let (mut of_rms, mut of_std) = (Vec::new(), Vec::new());
        for (batch, study) in studies.iter().enumerate() {
            let gradient = gradient_per_s(study);
            of_rms.push(correlation(&study.map.rms_m_s, &gradient));
            of_std.push(correlation(&study.map.std_m_s, &gradient));
            if batch == 0 {
                let map = write::velocity_map(&study.plan, &study.map);
                tables.push((name, map_table(&map)?));
                if panels.is_empty() {
                    panels.push(
                        MapPlot::new(&map, 0, "v_exact")?
                            .titled(&format!("Radial velocity, {}", sight.mark))
                            .labelled("v_R [m/s]"),
                    );
                }
                let title = format!("Standard deviation of the estimate, {name} signal-to-noise ratio");
                panels.push(MapPlot::new(&map, 0, "velocity_standard_deviation")?.titled(&title).labelled("std [m/s]"));
                origin.get_or_insert_with(|| study.provenance());
            }
        }
        shown.push((name, mean_and_error(&of_rms), mean_and_error(&of_std)));
    }
    let origin = origin.ok_or_else(|| Failure::new("no map was made".into()))?;
    let mut out = Rendered::new(&stacked("snr_reference", tables)?, &Figure::stacked(panels), &origin)?;
    out.marks = vec![sight.mark];
    out.caption = format!(
        "Radial velocity (top) and standard deviation of its estimates by periodogram accumulation over \
         {realisations} scans of one pulse a line, rho = 2 m, for (14) with h (middle) and as the chapter prints it (bottom); {}.",
        sight.words
    );
    out.claims.push(claim(&shown));
    Ok(out)
}

/// Modulus of the gradient of the exact velocity along the line, 1/s; NaN at the ends.
fn gradient_per_s(study: &Study) -> Array2<f64> {
    let (v, r) = (&study.map.v_exact_m_s, &study.map.range_m);
    Array2::from_shape_fn(v.dim(), |(i, j)| match j {
        0 => f64::NAN,
        j if j + 1 == r.len() => f64::NAN,
        j => ((v[[i, j + 1]] - v[[i, j - 1]]) / (r[j + 1] - r[j - 1])).abs(),
    })
}

/// Pearson's correlation over the cells where both are numbers.
fn correlation(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let pairs: Vec<(f64, f64)> =
        a.iter().copied().zip(b.iter().copied()).filter(|(a, b)| (a + b).is_finite()).collect();
    let n = pairs.len() as f64;
    let mean = pairs.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let sums = pairs
        .iter()
        .map(|p| (p.0 - mean.0, p.1 - mean.1))
        .fold([0.0; 3], |s, (x, y)| [s[0] + x * x, s[1] + y * y, s[2] + x * y]);
    sums[2] / (sums[0] * sums[1]).sqrt()
}

/// Name of a reference and two correlations, each with its standard error or limits.
type Correlations<'a> = (&'a str, (f64, f64), (f64, f64));

fn claim(shown: &[Correlations<'_>]) -> Claim {
    let words: Vec<String> = shown
        .iter()
        .map(|(name, rms, std)| {
            let interval =
                |x: &(f64, f64)| format!("{:.3} ({:.3} to {:.3})", x.0, x.0 - STUDENT * x.1, x.0 + STUDENT * x.1);
            format!("{name}: root mean square {}, standard deviation {}", interval(rms), interval(std))
        })
        .collect();
    let verdicts: Vec<Verdict> = shown
        .iter()
        .map(|(_, (r, error), _)| match (*r - STUDENT * error > 0.0, *r + STUDENT * error < 0.0) {
            (true, _) => Verdict::Pass,
            (_, true) => Verdict::Fail,
            _ => Verdict::NotResolved,
        })
        .collect();
    let verdict = match (verdicts.contains(&Verdict::Fail), verdicts.contains(&Verdict::NotResolved)) {
        (true, _) => Verdict::Fail,
        (_, true) => Verdict::NotResolved,
        _ => Verdict::Pass,
    };
    Claim {
        verdict,
        standard_error: shown.iter().map(|s| s.1.1).fold(0.0, f64::max),
        ..Claim::exact(
            "F10",
            "fig10",
            "the error of the estimate and the gradient along the line of sight are correlated over the map (95 % intervals)",
            "above 0 with both references",
            words.join("; "),
            false,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_of_a_line_is_one_and_missing_cells_do_not_count() {
        let a = Array2::from_shape_vec((1, 4), vec![1.0, 2.0, 3.0, f64::NAN]).unwrap();
        let b = Array2::from_shape_vec((1, 4), vec![5.0, 3.0, 1.0, 9.0]).unwrap();
        assert!((correlation(&a, &a) - 1.0).abs() < 1e-12 && (correlation(&a, &b) + 1.0).abs() < 1e-12);
    }
}
