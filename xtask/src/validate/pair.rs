//! The plane vortex pair above ground at Re 2500 against a spectral code; over a frictionless ground against the hyperbola.

use super::runs::*;
use std::f64::consts::TAU;
use wakescope_les::CirculationProfile;
use wakescope_les::analysis::{WakeRecord, WakeScales};
use wakescope_les::cases::VortexPairCase;
use wakescope_sim::flow::WakeProfile;

const END: f64 = 3.0;
/// Records per unit of tau.
const PER_TAU: f64 = 20.0;
/// The stored centre is the place of the strongest vorticity: a small circle finds it.
const PEAK_RADIUS: f64 = 0.05;

pub(super) fn show(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick {
        [1, 192, 96]
    } else {
        [1, 384, 192]
    };
    let pair = VortexPairCase {
        cells,
        size: [1.0, 6.0, 3.0],
        core_radius: 0.12,
        profile: CirculationProfile::LambOseen,
        reynolds: 2500.0,
        perturbation: 0.0,
        ..VortexPairCase::coarse()
    };
    let meter = pair
        .meter(&WakeScales::REDUCED)?
        .with_window([0.1, 0.3])?
        .with_core_radius(PEAK_RADIUS)?;
    let (mut meter, mut flow) = (meter, pair.case(VortexPairCase::steps(0.01))?.start()?.0);
    let mut records = vec![meter.measure(&flow)?];
    for record in 1..=(END * PER_TAU).round() as usize {
        flow.run_to(record as f64 / PER_TAU)?;
        records.push(meter.measure(&flow)?);
    }
    let curve =
        |of: fn(&WakeRecord) -> f64| records.iter().map(|r| (r.time_s, of(r))).collect::<Curve>();
    let stored = numbers("wake_2d_ground_re2500.csv")?;
    let column = |column: usize| stored_curve(&stored, column);
    let (y, z) = (curve(|r| r.right.y_m), curve(|r| r.right.z_m));
    let gamma = curve(|r| r.right.gamma_5_15_m2_s / TAU);
    let (energy, enstrophy) = (curve(|r| r.energy_m4_s2), curve(|r| r.enstrophy_m2_s2));
    let range = [0.1, END];
    let off = worst(&y, &column(1), range, apart).max(worst(&z, &column(2), range, apart));
    let asymmetry = records
        .iter()
        .map(|r| (r.left.y_m + r.right.y_m).abs())
        .fold(0.0, f64::max);
    let wide = if profile == Profile::Quick { 4.0 } else { 1.0 };
    let checks = vec![
        Claim::at_most("largest error of the path, b₀", off, 0.01 * wide),
        Claim::at_most(
            "largest error of Γ(0.1..0.3), relative",
            worst(&gamma, &column(4), range, relative),
            0.02,
        ),
        Claim::at_most(
            "largest error of the energy, relative",
            worst(&energy, &column(6), range, relative),
            0.005,
        ),
        Claim::at_most(
            "largest error of the enstrophy, relative",
            worst(&enstrophy, &column(5), range, relative),
            0.02,
        ),
        Claim::at_most("left against right, y", asymmetry, 1e-9),
    ];
    let columns = [
        ("y", &y),
        ("z", &z),
        ("gamma", &gamma),
        ("energy", &energy),
        ("enstrophy", &enstrophy),
    ];
    let table = table_of("tau", &columns);
    let path = CurvePlot::new("Path", Axis::linear("y / b₀"), Axis::linear("z / b₀"))
        .with(Series::new(
            "this solver",
            Style::Line,
            y.iter().zip(&z).map(|(y, z)| (y.1, z.1)),
        ))
        .with(Series::new(
            "spectral code",
            Style::Markers,
            stored.iter().map(|r| (r[1], r[2])),
        ));
    let energy = CurvePlot::new("Energy", Axis::linear("tau"), Axis::linear("E [b₀² V₀²]"))
        .with(Series::new("this solver", Style::Line, energy))
        .with(Series::new("spectral code", Style::Markers, column(6)));
    let clip = |p: (f64, f64)| (p.0, p.1.min(700.0));
    let enstrophy = CurvePlot::new(
        "Enstrophy",
        Axis::linear("tau"),
        Axis::linear("enstrophy [V₀²]").between(0.0, 700.0),
    )
    .with(Series::new(
        "this solver",
        Style::Line,
        enstrophy.into_iter().map(clip),
    ))
    .with(Series::new("spectral code", Style::Markers, column(5)));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([path, energy, enstrophy]),
    })
}

/// Point vortices and their images follow `1/y^2 + 1/z^2 = 5`; compact cores in a wide box without friction should, too.
pub(super) fn show_hyperbola(profile: Profile) -> Result<Shown, Failure> {
    let cells = if profile == Profile::Quick {
        [1, 384, 128]
    } else {
        [1, 560, 176]
    };
    let flow = run(WakePreset::Coarse, Subgrid::None {}, 4.0, |flow| {
        (flow.cells, flow.size) = (cells, [1.0, 36.0, 11.0]);
        (flow.ground_stretch, flow.lateral_stretch) = (2.0, 0.55);
        (flow.core_radius, flow.profile) = (0.12, WakeProfile::LambOseen);
        (flow.reynolds, flow.perturbation) = (1e7, 0.0);
        (flow.sticky_ground, flow.slip_sides) = (false, true);
    })?;
    let stored = numbers("vortex_pair_inviscid_ground_h1.csv")?;
    let (y, z, energy) = (
        flow.curve("y_right")?,
        flow.curve("z_right")?,
        flow.curve("energy")?,
    );
    let off = [(&y, 1), (&z, 2)]
        .map(|(curve, c)| worst(curve, &stored_curve(&stored, c), [0.0, 4.0], apart));
    let lost = 1.0 - energy[energy.len() - 1].1 / energy[0].1;
    let checks = vec![
        Claim::at_most("largest error of y to tau = 4, b₀", off[0], 0.01),
        Claim::at_most("largest error of z to tau = 4, b₀", off[1], 0.01),
        Claim::at_most("energy lost, relative", lost.abs(), 1e-3),
    ];
    let table = table_of("tau", &[("y", &y), ("z", &z)]);
    let path = CurvePlot::new(
        "Path over a frictionless ground",
        Axis::linear("y / b₀"),
        Axis::linear("z / b₀"),
    )
    .with(Series::new(
        "this solver",
        Style::Line,
        y.iter().zip(&z).map(|(y, z)| (y.1, z.1)),
    ))
    .with(Series::new(
        "point vortices",
        Style::Dash,
        stored.iter().filter(|r| r[0] <= 4.0).map(|r| (r[1], r[2])),
    ));
    Ok(Shown {
        checks,
        table,
        figure: Figure::stacked([path]),
    })
}
