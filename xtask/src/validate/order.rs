//! Order of the scheme: plane vortices on meshes stretched both ways, and a layer between walls.

use super::shown::Shown;
use crate::claim::Claim;
use crate::profile::Profile;
use fixtures::failure::Failure;
use wakescope_les::TimeScheme;
use wakescope_les::cases;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const VISCOSITY_M2_S: f64 = 0.01;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let sizes: &[usize] = if profile == Profile::Quick { &[32, 64, 128] } else { &[32, 64, 128, 256] };
    let inside = sizes.iter().map(|&n| Ok((n as f64, vortices(n)?))).collect::<Result<Vec<_>, Failure>>()?;
    let walls = sizes.iter().map(|&n| Ok((n as f64, layer(n)?))).collect::<Result<Vec<_>, Failure>>()?;
    let order = |points: &[(f64, f64)]| {
        let last = points.len() - 1;
        (points[last - 1].1 / points[last].1).log2()
    };
    let checks = vec![
        Claim::at_least("order inside, both directions stretched", order(&inside), 3.9),
        Claim::at_least("order between no-slip walls", order(&walls), 2.8),
    ];
    let table = Table::new()
        .float("cells", inside.iter().map(|p| p.0))
        .float("error_vortices_m_s", inside.iter().map(|p| p.1))
        .float("error_layer_m_s", walls.iter().map(|p| p.1));
    let first = inside[0];
    let slope = |power: i32| sizes.iter().map(move |&n| (n as f64, first.1 * (first.0 / n as f64).powi(power)));
    let plot = CurvePlot::new("Largest error", Axis::log("cells in each direction"), Axis::log("error [m/s]"))
        .with(Series::new("plane vortices, stretched", Style::LineMarkers, inside.clone()))
        .with(Series::new("decaying layer between walls", Style::LineMarkers, walls))
        .with(Series::new("fourth order", Style::Dash, slope(4)))
        .with(Series::new("third order", Style::Dot, slope(3)));
    Ok(Shown { checks, table, figure: Figure::stacked([plot]) })
}

fn vortices(n: usize) -> Result<f64, Failure> {
    let steps = n * n / 64;
    let mut case = cases::taylor_green_plane(n, [0.5, -0.4], VISCOSITY_M2_S, 0.1 / steps as f64)?;
    case.settings.scheme = TimeScheme::RungeKutta3;
    let (mut flow, _) = case.start()?;
    for _ in 0..steps {
        flow.step()?;
    }
    let (y_m, z_m) = (flow.mesh().face_m(1), flow.mesh().centre_m(2));
    let exact =
        |i: usize| cases::taylor_green_plane_exact([0.0, y_m[i % n], z_m[i / n]], flow.time_s(), VISCOSITY_M2_S)[1];
    Ok(flow.face_velocity_m_s(1).iter().enumerate().map(|(i, v)| (v - exact(i)).abs()).fold(0.0, f64::max))
}

fn layer(n: usize) -> Result<f64, Failure> {
    let (nu, end_s) = (0.1, 1.0);
    let steps = 20 * n;
    let (mut flow, _) = cases::Plates { cells: n, strength: 1.5, viscosity_m2_s: nu, step_s: end_s / steps as f64 }
        .decaying_layer()?
        .start()?;
    for _ in 0..steps {
        flow.step()?;
    }
    let half = 0.5 * std::f64::consts::PI;
    let decay = (-nu * half * half * end_s).exp();
    let errors = flow.face_velocity_m_s(0).into_iter().zip(flow.mesh().centre_m(2));
    Ok(errors.map(|(u, z)| (u - (half * z).cos() * decay).abs()).fold(0.0, f64::max))
}
