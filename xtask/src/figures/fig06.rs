//! Figure 6: surfaces of equal vorticity of the wake, and an animation of a cross-plane.

use super::context::{Context, Rendered};
use crate::Failure;
use crate::claim::{Claim, Verdict};
use crate::wakes;
use wakescope_les::analysis::decay::{amplitude_growth, value_at};
use wakescope_sim::flow::{FinishedWake, REPEATS};
use wakescope_sim::io::Table;
use wakescope_sim::plot::animation;

const FRAME_S: f64 = 0.15;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = wakes::of(context)?;
    let origin = context.provenance_of_formula(&wake.case_toml);
    let mut table = Table::new();
    for name in ["tau".into(), "energy".into(), "energy_3d".into()].into_iter().chain((0..=8).map(mode_name)) {
        table = table.float(&name, wake.column(&name)?.iter().copied());
    }
    let figure = wake.surfaces_figure()?.ok_or_else(|| Failure::new(
            "the wake has no fields as NetCDF: put `fields = [\"netcdf\"]` below `[output]` of its case and run it again".into(),
        ))?;
    let mut out = Rendered::new(&table, &figure, &origin)?;
    out.files.push(("apng".into(), animation::apng(&wake.frames()?, FRAME_S, &origin)?));
    out.caption = format!(
        "Surfaces where |ω| b₀²/Γ₀ is 1 and 10, at τ = {:?}; {}, box repeated {REPEATS} times along the flight. The animation \
         (fig06.apng) shows the axial vorticity of a cross-plane from τ = 0 on.",
        wake.fields_tau,
        wake.words()
    );
    out.claims = vec![secondary(&wake)?, short_waves(&wake)?];
    Ok(out)
}

fn mode_name(mode: usize) -> String {
    format!("energy_mode_{mode}")
}

fn secondary(wake: &FinishedWake) -> Result<Claim, Failure> {
    let tau = wake.column("tau")?;
    let strongest = |side: &str| -> Result<(f64, f64), Failure> {
        let gamma = wake.column(&format!("secondary_gamma_{side}"))?;
        let early = tau.iter().copied().zip(gamma.iter().map(|g| g.abs())).filter(|p| p.0 <= 2.0 && p.1.is_finite());
        Ok(early.fold((f64::NAN, 0.0), |best, p| if p.1 > best.1 { p } else { best }))
    };
    let (left, right) = (strongest("left")?, strongest("right")?);
    let measured = format!(
        "until tau = 2: {:.2} Γ₀ at tau = {:.2} (left), {:.2} Γ₀ at {:.2} (right)",
        left.1, left.0, right.1, right.0
    );
    let pass = left.1 > 0.05 && right.1 > 0.05;
    Ok(Claim::exact(
        "F6a",
        "fig06",
        "secondary vortices of opposite sign exist away from the ground",
        "more than 0.05 Γ₀ above 0.15 b₀ on both sides",
        measured,
        pass,
    ))
}

/// Growth rates of amplitudes: half the slope of the logarithm of the energy of a mode.
fn short_waves(wake: &FinishedWake) -> Result<Claim, Failure> {
    let shortest = wake.flow.size[0] / 0.2;
    let longest = wake.flow.size[0] / 0.6;
    let modes = (1..=8).filter(|m| (longest..=shortest).contains(&(*m as f64)));
    let mut best = (0, f64::NEG_INFINITY, 0.0);
    for mode in modes {
        let curve = wake.curve(&mode_name(mode))?;
        let at = |tau: f64| value_at(&curve, tau);
        let rate = amplitude_growth(&curve, 1.0, 2.0);
        if rate > best.1 {
            best = (mode, rate, at(3.0) / at(1.0));
        }
    }
    let (mode, rate, factor) = best;
    let measured = format!(
        "wavelength {:.2} b₀ grows at {rate:.2} per tau from 1 to 2; its energy at 3 is {factor:.0} times that at 1",
        wake.flow.size[0] / mode as f64
    );
    let pass = rate > 1.0 && factor > 10.0;
    let claim = Claim::exact(
        "F6b",
        "fig06",
        "a short-wave instability grows between tau = 1 and 3",
        "a wave of 0.2 to 0.6 b₀ grows at more than 1 per tau, its energy tenfold",
        measured,
        pass,
    );
    let resolved = wake.flow.cells[0] as f64 / mode.max(1) as f64 >= 6.0;
    Ok(if resolved { claim } else { Claim { verdict: Verdict::NotResolved, ..claim } })
}
