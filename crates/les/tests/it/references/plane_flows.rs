//! Flows of a plane: order of the scheme, waves on Poiseuille's flow, a dipole against a wall, a cavity.

use std::f64::consts::{FRAC_PI_2, TAU};

use wakescope_les::analysis::decay::value_at;
use wakescope_les::cases::{self, TollmienSchlichting};
use wakescope_les::{Flow, TimeScheme};

use super::{Curve, assert_at_least, assert_relative, assert_within, parabola_vertex, stored};

const VISCOSITY_M2_S: f64 = 0.01;

/// Largest error of plane Taylor-Green vortices on a mesh stretched in both directions, with steps far below their error.
fn vortices_error_m_s(cells: usize) -> f64 {
    let steps = cells * cells / 64;
    let step_s = 0.1 / steps as f64;
    let mut case = cases::taylor_green_plane(cells, [0.5, -0.4], VISCOSITY_M2_S, step_s).unwrap();
    case.settings.scheme = TimeScheme::RungeKutta3;
    let mut flow = case.start().unwrap().0;
    for _ in 0..steps {
        flow.step().unwrap();
    }
    let y_m = flow.mesh().face_m(1);
    let z_m = flow.mesh().centre_m(2);
    let mut largest = 0.0_f64;
    for (i, v) in flow.face_velocity_m_s(1).iter().enumerate() {
        let at_m = [0.0, y_m[i % cells], z_m[i / cells]];
        let exact = cases::taylor_green_plane_exact(at_m, flow.time_s(), VISCOSITY_M2_S);
        largest = largest.max((v - exact[1]).abs());
    }
    largest
}

/// Largest error of a layer that decays between no-slip walls.
fn layer_error_m_s(cells: usize) -> f64 {
    let viscosity_m2_s = 0.1;
    let end_s = 1.0;
    let steps = 20 * cells;
    let plates = cases::Plates {
        cells,
        strength: 1.5,
        viscosity_m2_s,
        step_s: end_s / steps as f64,
    };
    let (mut flow, _) = plates.decaying_layer().unwrap().start().unwrap();
    for _ in 0..steps {
        flow.step().unwrap();
    }
    let decay = (-viscosity_m2_s * FRAC_PI_2 * FRAC_PI_2 * end_s).exp();
    let mut largest = 0.0_f64;
    for (u, z) in flow
        .face_velocity_m_s(0)
        .iter()
        .zip(flow.mesh().centre_m(2))
    {
        largest = largest.max((u - (FRAC_PI_2 * z).cos() * decay).abs());
    }
    largest
}

#[test]
#[ignore = "half a minute; coarser meshes are in exact_flows"]
fn the_order_from_128_to_256_cells_is_four_inside_and_three_between_walls() {
    let order = (vortices_error_m_s(128) / vortices_error_m_s(256)).log2();
    assert_at_least("order inside", order, 3.9);
    let order = (layer_error_m_s(128) / layer_error_m_s(256)).log2();
    assert_at_least("order between walls", order, 2.8);
}

/// The wave is followed from here, when what is not the wave has died, to the end.
const WAVE_FROM_S: f64 = 5.0;
const WAVE_TO_S: f64 = 25.0;

/// Growth rate of the amplitude of a Tollmien-Schlichting wave at Re 7500, wave number 1 \[1/s\].
fn growth_rate_per_s(cells: [usize; 2], step_s: f64) -> f64 {
    let wave = TollmienSchlichting::new(7500.0, 1.0).unwrap();
    let (mut flow, _) = wave
        .case(cells, 1.8, 1e-4, step_s)
        .unwrap()
        .start()
        .unwrap();
    let steps = (WAVE_TO_S / step_s).round() as usize;
    let stride = (0.1 / step_s).round() as usize;
    let mut points = Vec::new();
    for step in 1..=steps {
        flow.step().unwrap();
        if step % stride == 0 && flow.time_s() > WAVE_FROM_S - 0.5 * step_s {
            points.push((flow.time_s(), 0.5 * wave_energy(&flow).ln()));
        }
    }
    slope(&points)
}

/// Energy of the first Fourier mode along x of the velocity along z.
fn wave_energy(flow: &Flow) -> f64 {
    let [nx, _, nz] = flow.mesh().cells();
    let w = flow.face_velocity_m_s(2);
    let face_m = flow.mesh().face_m(2);
    let mut energy = 0.0;
    for k in 1..nz {
        let mut cos = 0.0;
        let mut sin = 0.0;
        for i in 0..nx {
            let phase = TAU * i as f64 / nx as f64;
            cos += w[k * nx + i] * phase.cos();
            sin += w[k * nx + i] * phase.sin();
        }
        energy += 0.5 * (face_m[k + 1] - face_m[k - 1]) * (cos * cos + sin * sin);
    }
    energy
}

/// Least-squares slope.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean_x = points.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|p| p.1).sum::<f64>() / count;
    let mut covariance = 0.0;
    let mut variance = 0.0;
    for (x, y) in points {
        covariance += (x - mean_x) * (y - mean_y);
        variance += (x - mean_x).powi(2);
    }
    covariance / variance
}

#[test]
#[ignore = "two minutes; a coarser mesh is in exact_flows"]
fn tollmien_schlichting_waves_converge_to_the_growth_of_linear_theory() {
    let expected = stored("orr_sommerfeld.csv")[0][3];
    let coarse = growth_rate_per_s([64, 128], 0.01);
    assert_relative("growth rate on 64 x 128", coarse, expected, 0.01);
    let fine = growth_rate_per_s([128, 256], 0.005);
    assert_relative("growth rate on 128 x 256", fine, expected, 0.002);
}

/// Times and values of the first two maxima of the enstrophy of a dipole that runs against a wall.
fn enstrophy_maxima(cells: usize, reynolds: f64) -> [(f64, f64); 2] {
    let case = cases::dipole_in_a_box([cells; 2], [1.5; 2], reynolds).unwrap();
    let (mut flow, _) = case.start().unwrap();
    let mut history: Curve = Vec::new();
    let mut maxima = Vec::new();
    while flow.time_s() < case.end_s && maxima.len() < 2 {
        let time_s = flow.time_s();
        let report = flow.step().unwrap();
        // Between walls at rest the viscous power is twice the viscosity times the enstrophy.
        history.push((time_s, -0.5 * report.viscous_power_m5_s3 * reynolds));
        if let [.., a, b, c] = history[..]
            && b.1 > a.1
            && b.1 > c.1
            && b.0 > 0.2
        {
            maxima.push(parabola_vertex([a, b, c]));
        }
    }
    [maxima[0], maxima[1]]
}

/// Times and values of both maxima in Clercx and Bruneau (2006): (time, enstrophy).
const MAXIMA_RE_625: [(f64, f64); 2] = [(0.371, 933.6), (0.647, 305.2)];
const MAXIMA_RE_1250: [(f64, f64); 2] = [(0.341, 1899.0), (0.616, 725.3)];

fn assert_maxima(cells: usize, reynolds: f64, expected: [(f64, f64); 2], bar: f64) {
    let found = enstrophy_maxima(cells, reynolds);
    for (found, expected) in found.into_iter().zip(expected) {
        assert_relative("time of the maximum", found.0, expected.0, 0.5 * bar);
        assert_relative("maximum of the enstrophy", found.1, expected.1, bar);
    }
}

#[test]
fn a_dipole_meets_a_wall_twice_on_a_coarse_mesh() {
    assert_maxima(128, 625.0, MAXIMA_RE_625, 0.1);
}

#[test]
#[ignore = "two minutes"]
fn a_dipole_at_re_625_has_the_enstrophy_of_clercx_and_bruneau() {
    assert_maxima(384, 625.0, MAXIMA_RE_625, 0.01);
}

#[test]
#[ignore = "two minutes"]
fn a_dipole_at_re_1250_has_the_enstrophy_of_clercx_and_bruneau() {
    assert_maxima(384, 1250.0, MAXIMA_RE_1250, 0.01);
}

/// Extrema of Botella and Peyret (1998), position and velocity: that along the lid on the vertical centre line, then those across
/// it on the horizontal one.
const ALONG_MINIMUM: (f64, f64) = (0.1717, -0.388_569_8);
const ACROSS_MAXIMUM: (f64, f64) = (0.1578, 0.376_944_7);
const ACROSS_MINIMUM: (f64, f64) = (0.9092, -0.527_077_1);

/// The lid-driven cavity at Re 1000: its extrema within the fraction `bar`, the velocity along the lid within 0.02 of Ghia's.
fn assert_cavity(cells: usize, end_s: f64, bar: f64) {
    let case = cases::lid_driven_cavity(cells, 1.5, 1000.0).unwrap();
    let (mut flow, _) = case.start().unwrap();
    flow.run_to(end_s).unwrap();
    let y_m = flow.mesh().centre_m(1);
    let z_m = flow.mesh().centre_m(2);
    let v = flow.face_velocity_m_s(1);
    let w = flow.face_velocity_m_s(2);
    // The mesh is symmetric: face `middle` lies at 0.5.
    let middle = cells / 2;
    let column: Curve = (0..cells)
        .map(|k| (z_m[k], v[k * cells + middle]))
        .collect();
    let row: Curve = (0..cells)
        .map(|j| (y_m[j], w[middle * cells + j]))
        .collect();
    for (name, found, expected) in [
        ("minimum along the lid", minimum(&column), ALONG_MINIMUM),
        ("maximum across it", maximum(&row), ACROSS_MAXIMUM),
        ("minimum across it", minimum(&row), ACROSS_MINIMUM),
    ] {
        assert_relative(name, found.1, expected.1, bar);
        assert_relative(
            &format!("position of the {name}"),
            found.0,
            expected.0,
            2.0 * bar,
        );
    }
    // Ghia, Ghia and Shin (1982), whose mesh was coarser.
    for row in stored("ghia_cavity_u.csv") {
        let (z, expected) = (row[0], row[3]);
        if z > z_m[0] && z < z_m[cells - 1] {
            let found = value_at(&column, z);
            assert_within(
                &format!("velocity along the lid at {z}"),
                found,
                expected,
                0.02,
            );
        }
    }
}

fn maximum(points: &[(f64, f64)]) -> (f64, f64) {
    let inner = 1..points.len() - 1;
    let largest = inner
        .max_by(|&a, &b| points[a].1.total_cmp(&points[b].1))
        .unwrap();
    parabola_vertex([points[largest - 1], points[largest], points[largest + 1]])
}

fn minimum(points: &[(f64, f64)]) -> (f64, f64) {
    let negated: Curve = points.iter().map(|p| (p.0, -p.1)).collect();
    let (x, y) = maximum(&negated);
    (x, -y)
}

#[test]
fn a_cavity_has_the_extrema_of_botella_and_peyret_on_a_coarse_mesh() {
    assert_cavity(48, 40.0, 0.05);
}

#[test]
#[ignore = "two minutes"]
fn a_cavity_has_the_extrema_of_botella_and_peyret() {
    assert_cavity(128, 60.0, 0.002);
}
