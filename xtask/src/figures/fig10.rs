//! Figure 10: the radial velocity of the early pair, the scatter of its estimates, and their relation to the gradient.

use super::context::*;
use super::study::{
    EARLY_TAU, METHODS, REFERENCES, Sight, Study, early_scene, stacked, with_method,
};
use wakescope_sim::io::tables::map_table;
use wakescope_sim::write;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let realisations = context.profile.choose(16, 128, 400);
    let sight = Sight::of(context, EARLY_TAU)?;
    let (mut tables, mut panels, mut found) = (Vec::new(), Vec::new(), Vec::new());
    let scene = with_method(early_scene(realisations), METHODS[0]);
    let studies = Study::at_references(context, &sight, &scene)?;
    for ((name, _), study) in REFERENCES.into_iter().zip(&studies) {
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
        panels.push(
            MapPlot::new(&map, 0, "velocity_standard_deviation")?
                .titled(&title)
                .labelled("std [m/s]"),
        );
        let gradient = gradient_per_s(study);
        let of_rms = |without| {
            let rms = |cell| {
                study
                    .over_scans(cell, without, |error| error * error)
                    .sqrt()
            };
            correlation(&Array2::from_shape_fn(gradient.dim(), rms), &gradient)
        };
        found.push((
            name,
            Estimate::of(BATCHES, of_rms),
            correlation(&study.map.std_m_s, &gradient),
        ));
    }
    let origin = studies[0].plan.scene.provenance();
    let mut out = Rendered::new(
        &stacked("snr_reference", tables)?,
        &Figure::stacked(panels),
        &origin,
    )?;
    out.marks = vec![sight.mark];
    out.values = vec![realisations.to_string(), sight.words];
    let beside = found.iter().map(|(name, rms, std)| {
        format!(
            "{name}: {}, of the standard deviation {std:.2}",
            rms.words()
        )
    });
    let beside = beside.collect::<Vec<_>>().join("; ");
    let chapter = found.iter().filter(|of| of.0 == "chapter");
    out.claims = chapter
        .map(|of| Claim::judged_alone("F10", of.1, "", Bar::Above(0.0)).beside(&beside))
        .collect();
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
    let pairs: Vec<(f64, f64)> = a
        .iter()
        .copied()
        .zip(b.iter().copied())
        .filter(|(a, b)| (a + b).is_finite())
        .collect();
    let n = pairs.len() as f64;
    let mean = pairs
        .iter()
        .fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let sums = pairs
        .iter()
        .map(|p| (p.0 - mean.0, p.1 - mean.1))
        .fold([0.0; 3], |s, (x, y)| {
            [s[0] + x * x, s[1] + y * y, s[2] + x * y]
        });
    sums[2] / (sums[0] * sums[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_of_a_line_is_one_and_missing_cells_do_not_count() {
        let a = Array2::from_shape_vec((1, 4), vec![1.0, 2.0, 3.0, f64::NAN]).unwrap();
        let b = Array2::from_shape_vec((1, 4), vec![5.0, 3.0, 1.0, 9.0]).unwrap();
        assert!(
            (correlation(&a, &a) - 1.0).abs() < 1e-12 && (correlation(&a, &b) + 1.0).abs() < 1e-12
        );
    }
}
