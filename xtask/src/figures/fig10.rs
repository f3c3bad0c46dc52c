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
    let mut tables = Vec::new();
    let mut panels = Vec::new();
    let mut beside = Vec::new();
    let mut claims = Vec::new();
    let scene = with_method(early_scene(realisations), METHODS[0]);
    let studies = Study::at_references(context, &sight, &scene)?;
    for ((name, _), study) in REFERENCES.into_iter().zip(&studies) {
        let map = write::velocity_map(&study.plan, &study.map);
        tables.push((name, map_table(&map)?));
        if panels.is_empty() {
            panels.push(
                MapPlot::new(&map, 0, "v_exact")?
                    .titled(&format!("Radial velocity, {}", sight.mark))
                    .labelled("v_{R} [m/s]"),
            );
        }
        let title = format!("Standard deviation of the estimate, {name} signal-to-noise ratio");
        panels.push(
            MapPlot::new(&map, 0, "velocity_standard_deviation")?
                .titled(&title)
                .labelled("std [m/s]"),
        );
        let gradient = gradient_per_s(study);
        let of_rms = Estimate::of(BATCHES, |without| {
            correlation(&rms_m_s(study, without), &gradient)
        });
        let of_std = correlation(&study.map.std_m_s, &gradient);
        beside.push(format!(
            "{name}: {}, without the bias {of_std:.2}",
            of_rms.words()
        ));
        if name == "chapter" {
            claims.push(Claim::judged_alone("F10", of_rms, "", Bar::Above(0.0)));
        }
    }
    let origin = studies[0].plan.file.provenance();
    let mut out = Rendered::new(
        &stacked("snr_reference", tables)?,
        &Figure::stacked(panels),
        &origin,
    )?;
    out.marks = vec![sight.mark];
    out.values = vec![realisations.to_string(), sight.words];
    let beside = beside.join("; ");
    for claim in claims {
        out.claims.push(claim.beside(&beside));
    }
    Ok(out)
}

/// Root mean square error of each cell, without one batch.
fn rms_m_s(study: &Study, without: Option<usize>) -> Array2<f64> {
    Array2::from_shape_fn(study.map.std_m_s.dim(), |cell| {
        let square = study.over_scans(cell, without, |error| error * error);
        square.sqrt()
    })
}

/// Modulus of the gradient of the exact velocity along the line, 1/s; NaN at the ends.
fn gradient_per_s(study: &Study) -> Array2<f64> {
    let v = &study.map.v_exact_m_s;
    let r = &study.map.range_m;
    Array2::from_shape_fn(v.dim(), |(i, j)| match j {
        0 => f64::NAN,
        j if j + 1 == r.len() => f64::NAN,
        j => ((v[[i, j + 1]] - v[[i, j - 1]]) / (r[j + 1] - r[j - 1])).abs(),
    })
}

/// Pearson's correlation over the cells where both are numbers.
fn correlation(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let mut pairs = Vec::new();
    for (a, b) in a.iter().zip(b) {
        if (a + b).is_finite() {
            pairs.push((*a, *b));
        }
    }
    let n = pairs.len() as f64;
    let mut mean_a = 0.0;
    let mut mean_b = 0.0;
    for (a, b) in &pairs {
        mean_a += a / n;
        mean_b += b / n;
    }
    let mut variance_a = 0.0;
    let mut variance_b = 0.0;
    let mut covariance = 0.0;
    for (a, b) in &pairs {
        let x = a - mean_a;
        let y = b - mean_b;
        variance_a += x * x;
        variance_b += y * y;
        covariance += x * y;
    }
    covariance / (variance_a * variance_b).sqrt()
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
