//! Figure 6: surfaces of equal vorticity of the wake, and an animation of a cross-plane.

use super::context::{Context, Rendered};
use crate::Failure;
use crate::claim::{Claim, Verdict};
use crate::wakes::Wake;
use std::sync::Arc;
use wakescope_les::analysis::decay::{amplitude_growth, value_at};
use wakescope_sim::export::{CrossPlanes, Table};
use wakescope_sim::flow::{read_field, read_planes};
use wakescope_sim::plot::polar::PlaneCells;
use wakescope_sim::plot::{ColourMap, Figure, IsosurfacePlot, MapPlot, Surface, Volume, animation};

/// Times that the box is repeated along the flight, so that waves can be seen as such.
const REPEATS: usize = 2;
const FRAME_S: f64 = 0.15;

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let wake = Wake::of(context)?;
    let origin = context.provenance_of_formula(&wake.case_toml);
    let mut table = Table::new();
    for name in ["tau".into(), "energy".into(), "energy_3d".into()].into_iter().chain((0..=8).map(mode_name)) {
        table = table.float(&name, wake.column(&name)?.iter().copied());
    }
    let panels = wake.fields_tau.iter().enumerate().map(|(i, tau)| surfaces(&wake, i, *tau));
    let mut figure = Figure::stacked(panels.collect::<Result<Vec<_>, _>>()?);
    figure.columns = 2;
    figure.width = 1200.0;
    let mut out = Rendered::new(&table, &figure, &origin)?;
    out.files.push(("apng".into(), animation::apng(&frames(&wake)?, FRAME_S, &origin)?));
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

fn surfaces(wake: &Wake, index: usize, tau: f64) -> Result<IsosurfacePlot, Failure> {
    let field = read_field(&wake.folder.join(format!("fields_{:04}.nc", index + 1)), "vorticity_magnitude")?;
    let scales = wake.flow.pair.scales()?;
    let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
    let [x, y, z] = field.axis_m;
    let length = wake.flow.size[0];
    let nx = x.len();
    let repeated = (0..REPEATS * nx + 1).map(|i| x[i % nx] / scales.spacing_m + (i / nx) as f64 * length).collect();
    let rows = field.values.chunks(nx);
    let values = rows.flat_map(|row| (0..REPEATS * nx + 1).map(|i| (row[i % nx] / unit_per_s) as f32)).collect();
    let in_b0 = |axis: Vec<f64>| axis.into_iter().map(|a| a / scales.spacing_m).collect();
    let volume = Arc::new(Volume::new([repeated, in_b0(y), in_b0(z)], values)?);
    let surface = |level: f64, colour, opacity| Surface { level, colour, opacity, name: format!("{level}") };
    Ok(IsosurfacePlot {
        title: format!("τ = {tau}"),
        volume,
        surfaces: vec![surface(1.0, [120, 170, 215], 0.35), surface(10.0, [200, 60, 40], 1.0)],
        view_rad: [-0.55, 0.35],
        axes: ["x", "y", "z"].map(String::from),
        ground: true,
    })
}

/// Axial vorticity of a cross-plane over time.
fn frames(wake: &Wake) -> Result<Vec<Figure>, Failure> {
    let scales = wake.flow.pair.scales()?;
    let mut frames: Vec<(f64, Figure)> = Vec::new();
    for planes in read_planes(&wake.folder.join("plane1"))? {
        for (place, tau) in planes.tau.iter().enumerate() {
            let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
            let vorticity = axial_vorticity_per_s(&planes, place).into_iter().map(|w| w / unit_per_s).collect();
            let cells = PlaneCells::about(&planes.y_m, &planes.z_m, vorticity);
            let map = MapPlot::of_plane(cells, "ω_{x} b₀²/Γ₀", true)
                .coloured(ColourMap::Diverging { limit: 10.0 })
                .titled(&format!("τ = {tau:.1}"));
            let mut figure = Figure::stacked([map]);
            figure.width = 640.0;
            frames.push((*tau, figure));
        }
    }
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    frames.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
    Ok(frames.into_iter().map(|f| f.1).collect())
}

/// `dw/dy - dv/dz` by differences over the neighbours, `[z][y]` \[1/s\].
fn axial_vorticity_per_s(planes: &CrossPlanes, place: usize) -> Vec<f64> {
    let (ny, nz) = (planes.y_m.len(), planes.z_m.len());
    let mut out = Vec::with_capacity(ny * nz);
    for k in 0..nz {
        let (low, high) = (k.saturating_sub(1), (k + 1).min(nz - 1));
        for j in 0..ny {
            let (left, right) = (j.saturating_sub(1), (j + 1).min(ny - 1));
            let dw = planes.w_m_s[[place, k, right]] - planes.w_m_s[[place, k, left]];
            let dv = planes.v_m_s[[place, high, j]] - planes.v_m_s[[place, low, j]];
            out.push(dw / (planes.y_m[right] - planes.y_m[left]) - dv / (planes.z_m[high] - planes.z_m[low]));
        }
    }
    out
}

fn secondary(wake: &Wake) -> Result<Claim, Failure> {
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
fn short_waves(wake: &Wake) -> Result<Claim, Failure> {
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
