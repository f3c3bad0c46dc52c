//! The plane vortex pair above ground at Re 2500 against a spectral code; over a frictionless ground against the hyperbola.

use super::shown::Shown;
use super::wake::history::{run, run_with, worst};
use crate::claim::Claim;
use crate::profile::Profile;
use crate::references::numbers;
use fixtures::failure::Failure;
use wakescope_les::CirculationProfile;
use wakescope_les::analysis::WakeScales;
use wakescope_les::cases::VortexPairCase;
use wakescope_sim::io::Table;
use wakescope_sim::plot::{Axis, CurvePlot, Figure, Series, Style};

const END: f64 = 3.0;
/// The stored centre is the place of the strongest vorticity: a small circle finds it.
const PEAK_RADIUS: f64 = 0.05;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick { [1, 192, 96] } else { [1, 384, 192] };
    let pair = VortexPairCase {
        cells,
        size: [1.0, 6.0, 3.0],
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: 2500.0,
        perturbation: 0.0,
        ..VortexPairCase::coarse()
    };
    let meter = pair.meter(&WakeScales::REDUCED)?.with_window([0.1, 0.3])?.with_core_radius(PEAK_RADIUS)?;
    let flow = run_with(&pair, meter, END)?;
    let stored = numbers("wake_2d_ground_re2500.csv")?;
    let column = |column: usize| stored.iter().map(move |r| (r[0], r[column])).collect::<Vec<_>>();
    let [y, z] = ["y_right", "z_right"].map(|name| flow.curve(name));
    let gamma = flow.curve("gamma_5_15_right");
    let [energy, enstrophy] = ["energy", "enstrophy"].map(|name| flow.curve(name));
    let range = [0.1, END];
    let apart = |a: f64, b: f64| (a - b).abs();
    let relative = |a: f64, b: f64| (a / b - 1.0).abs();
    let off = worst(&y, &column(1), range, apart).max(worst(&z, &column(2), range, apart));
    let sides = flow.column("y_left").iter().zip(flow.column("y_right"));
    let asymmetry = sides.map(|(left, right)| (left + right).abs()).fold(0.0, f64::max);
    let wide = if profile == Profile::Quick { 4.0 } else { 1.0 };
    let checks = vec![
        Claim::at_most("largest error of the path, b₀", off, 0.01 * wide),
        Claim::at_most("largest error of Γ(0.1..0.3), relative", worst(&gamma, &column(4), range, relative), 0.02),
        Claim::at_most("largest error of the energy, relative", worst(&energy, &column(6), range, relative), 0.005),
        Claim::at_most(
            "largest error of the enstrophy, relative",
            worst(&enstrophy, &column(5), range, relative),
            0.02,
        ),
        Claim::at_most("left against right, y", asymmetry, 1e-9),
    ];
    let table = Table::new()
        .float("tau", y.iter().map(|p| p.0))
        .float("y", y.iter().map(|p| p.1))
        .float("z", z.iter().map(|p| p.1))
        .float("gamma", gamma.iter().map(|p| p.1))
        .float("energy", energy.iter().map(|p| p.1))
        .float("enstrophy", enstrophy.iter().map(|p| p.1));
    let path = CurvePlot::new("Path", Axis::linear("y / b₀"), Axis::linear("z / b₀"))
        .with(Series::new("this solver", Style::Line, y.iter().zip(&z).map(|(y, z)| (y.1, z.1))))
        .with(Series::new("spectral code", Style::Markers, stored.iter().map(|r| (r[1], r[2]))));
    let energy = CurvePlot::new("Energy", Axis::linear("tau"), Axis::linear("E [b₀² V₀²]"))
        .with(Series::new("this solver", Style::Line, energy))
        .with(Series::new("spectral code", Style::Markers, column(6)));
    let clip = |p: (f64, f64)| (p.0, p.1.min(700.0));
    let enstrophy =
        CurvePlot::new("Enstrophy", Axis::linear("tau"), Axis::linear("enstrophy [V₀²]").between(0.0, 700.0))
            .with(Series::new("this solver", Style::Line, enstrophy.into_iter().map(clip)))
            .with(Series::new("spectral code", Style::Markers, column(5)));
    Ok(Shown { checks, table, figure: Figure::stacked([path, energy, enstrophy]) })
}

/// Point vortices and their images follow `1/y^2 + 1/z^2 = 5`; compact cores in a wide box without friction should, too.
pub(super) fn show_hyperbola(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick { [1, 384, 128] } else { [1, 560, 176] };
    let pair = VortexPairCase {
        cells,
        size: [1.0, 36.0, 11.0],
        ground_stretch: 2.0,
        lateral_stretch: 0.55,
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: 1e7,
        sticky_ground: false,
        slip_sides: true,
        perturbation: 0.0,
        ..VortexPairCase::coarse()
    };
    let flow = run(&pair, 4.0)?;
    let stored = numbers("vortex_pair_inviscid_ground_h1.csv")?;
    let column = |column: usize| stored.iter().map(move |r| (r[0], r[column])).collect::<Vec<_>>();
    let [y, z] = ["y_right", "z_right"].map(|name| flow.curve(name));
    let apart = |a: f64, b: f64| (a - b).abs();
    let off = [(&y, 1), (&z, 2)].map(|(curve, c)| worst(curve, &column(c), [0.0, 4.0], apart));
    let energy = flow.curve("energy");
    let lost = 1.0 - energy[energy.len() - 1].1 / energy[0].1;
    let checks = vec![
        Claim::at_most("largest error of y to tau = 4, b₀", off[0], 0.01),
        Claim::at_most("largest error of z to tau = 4, b₀", off[1], 0.01),
        Claim::at_most("energy lost, relative", lost.abs(), 1e-3),
    ];
    let table = Table::new()
        .float("tau", y.iter().map(|p| p.0))
        .float("y", y.iter().map(|p| p.1))
        .float("z", z.iter().map(|p| p.1));
    let path = CurvePlot::new("Path over a frictionless ground", Axis::linear("y / b₀"), Axis::linear("z / b₀"))
        .with(Series::new("this solver", Style::Line, y.iter().zip(&z).map(|(y, z)| (y.1, z.1))))
        .with(Series::new("point vortices", Style::Dash, stored.iter().filter(|r| r[0] <= 4.0).map(|r| (r[1], r[2]))));
    Ok(Shown { checks, table, figure: Figure::stacked([path]) })
}
