//! Figure 6: surfaces of equal vorticity of the wake, and an animation of a cross-plane.

use super::context::*;
use crate::wakes;
use wakescope_sim::flow::REPEATS;
use wakescope_sim::plot::apng;

const FRAME_S: f64 = 0.15;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::whole(context)?;
    let origin = context.provenance_of_formula(&wake.file.toml);
    let mut table = Table::new();
    let names = [
        "tau",
        "energy",
        "energy_3d",
        "secondary_gamma_left",
        "secondary_gamma_right",
    ]
    .map(String::from);
    for name in names
        .into_iter()
        .chain((0..=8).map(|mode| format!("energy_mode_{mode}")))
    {
        table = table.float(&name, wake.column(&name)?.iter().copied());
    }
    let figure = wake.surfaces_figure()?.ok_or_else(|| Failure::new(
            "the wake has no fields as NetCDF: put `fields = [\"netcdf\"]` below `[output]` of its case and run it again".into(),
        ))?;
    let mut out = Rendered::new(&table, &figure, &origin)?;
    out.files
        .push(("apng".into(), apng(&wake.frames()?, FRAME_S, &origin)?));
    out.values = vec![
        format!("{:?}", wake.fields_tau),
        wake.words(),
        REPEATS.to_string(),
    ];
    out.claims = vec![secondary(&wake)?, short_waves(&wake)?];
    Ok(out)
}

fn secondary(wake: &FinishedWake) -> Result<Claim, Failure> {
    let tau = wake.column("tau")?;
    let strongest = |side: &str| -> Result<(f64, f64), Failure> {
        let gamma = wake.column(&format!("secondary_gamma_{side}"))?;
        let early = tau
            .iter()
            .copied()
            .zip(gamma.iter().map(|g| g.abs()))
            .filter(|p| p.0 <= 2.0 && p.1.is_finite());
        Ok(early.fold(
            (f64::NAN, 0.0),
            |best, p| if p.1 > best.1 { p } else { best },
        ))
    };
    let (left, right) = (strongest("left")?, strongest("right")?);
    let measured = format!(
        "until tau = 2: {:.2} Γ₀ at tau = {:.2} (left), {:.2} Γ₀ at {:.2} (right)",
        left.1, left.0, right.1, right.0
    );
    let pass = left.1 > 0.05 && right.1 > 0.05;
    Ok(Claim::exact("F6a", measured, pass))
}

/// Waves of 0.2 to 0.6 spacings together: their growth, half the slope of the logarithm of their energy, and their share of all waves.
fn short_waves(wake: &FinishedWake) -> Result<Claim, Failure> {
    let [shortest, longest] = [0.2, 0.6].map(|length| wake.flow.size[0] / length);
    let modes = (1..=8).map(|mode| Ok((mode, wake.curve(&format!("energy_mode_{mode}"))?)));
    let modes: Vec<(usize, Vec<(f64, f64)>)> = modes.collect::<Result<_, Failure>>()?;
    let (short, others): (Vec<_>, Vec<_>) = modes
        .iter()
        .partition(|of| (longest..=shortest).contains(&(of.0 as f64)));
    let sum = |of: &[&(usize, Vec<(f64, f64)>)], tau: f64| {
        of.iter()
            .map(|(_, curve)| value_at(curve, tau))
            .sum::<f64>()
    };
    let share = |tau: f64| sum(&short, tau) / (sum(&short, tau) + sum(&others, tau));
    let rate = 0.5 * (sum(&short, 2.0) / sum(&short, 1.0)).ln();
    let [first, last] = [short.first(), short.last()].map(|of| of.map_or(0, |of| of.0));
    let measured = format!(
        "modes {first} to {last} of the box, all together, grow at {rate:.2} per tau from 1 to 2; of the energy of modes 1 to 8 they hold \
         {:.2} at tau = 0, {:.2} at 1 and {:.2} at 2",
        share(0.0),
        share(1.0),
        share(2.0)
    );
    let claim = Claim::exact("F6b", measured, rate > 1.0 && share(2.0) > 0.75);
    let resolved = wake.flow.cells[0] as f64 / last.max(1) as f64 >= 4.0;
    Ok(if resolved {
        claim
    } else {
        claim.open("a mesh of four cells a wave along the flight")
    })
}
