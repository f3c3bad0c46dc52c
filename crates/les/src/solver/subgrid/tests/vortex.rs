//! Rotation and vortices of the plane: what the multiscale form is for.

use super::super::super::flow::Flow;
use super::super::super::settings::{FlowSettings, TimeStep};
use super::*;

/// A vortex along x in the middle of a box of 64 x 64 cells of size 1, four cells long.
fn vortex(model: SubgridModel, circulation_fraction: impl Fn(f64) -> f64) -> Modelled {
    let wide = || Direction::between(64, -32.0, 32.0, Wall::Slip, Wall::Slip);
    Modelled::new(
        [Direction::periodic(4, 0.0, 4.0), wide(), wide()],
        model,
        |[_, y, z]| {
            let square = (y * y + z * z).max(1e-30);
            let rate = circulation_fraction(square) / square;
            [0.0, -z * rate, y * rate]
        },
    )
}

/// Root mean square of the stress where `y^2 + z^2 < radius^2`.
fn rms_stress(flow: &Modelled, radius: f64) -> f64 {
    let mut sum = 0.0;
    let mut count = 0.0;
    for ([a, b], stress) in PAIRS.into_iter().zip(flow.plain_stress()) {
        for (place, stress) in stress.iter().enumerate() {
            let [_, j, k] = flow.index(place);
            let y = j as f64 - 31.5;
            let z = k as f64 - 31.5;
            if y * y + z * z < radius * radius {
                sum += if a == b {
                    stress * stress
                } else {
                    2.0 * stress * stress
                };
                count += 1.0;
            }
        }
    }
    (sum / count).sqrt()
}

#[test]
fn solid_rotation_has_wale_viscosity_but_no_multiscale_stress() {
    let flow = vortex(SubgridModel::MULTISCALE_WALE, |square| 0.7 * square);
    let inside = |[_, j, k]: [usize; 3]| (8..56).contains(&j) && (8..56).contains(&k);
    let centre = flow.model.viscosity_m2_s[flow.at([1, 32, 32])];
    assert!(centre > 0.1, "{centre}");
    let largest = flow.largest_stress(inside);
    assert!(
        largest < 1e-13 * centre * 0.7,
        "{largest} against {}",
        centre * 0.7
    );
}

#[test]
fn in_the_core_of_a_vortex_the_multiscale_stress_is_a_tenth_of_that_of_wale_or_less() {
    for core in [4.0_f64, 5.0, 6.0] {
        let algebraic = |square: f64| square / (square + core * core);
        let gaussian = |square: f64| -(-1.2564 * square / (core * core)).exp_m1();
        let profiles: [(&str, &dyn Fn(f64) -> f64); 2] =
            [("algebraic", &algebraic), ("Gaussian", &gaussian)];
        for (name, profile) in profiles {
            let wale = rms_stress(&vortex(SubgridModel::WALE, profile), core);
            let flow = vortex(SubgridModel::MULTISCALE_WALE, profile);
            let ratio = rms_stress(&flow, core) / wale;
            assert!(ratio < 0.1, "{name} vortex, core of {core} cells: {ratio}");
        }
    }
}

/// Root mean square of the velocity along the axis of a tight vortex with a little noise, after
/// `steps` steps over before.
fn noise_along_a_vortex(steps: usize) -> f64 {
    let wide = || Direction::between(32, -16.0, 16.0, Wall::Slip, Wall::Slip);
    let mesh = Mesh::new(Direction::periodic(8, 0.0, 8.0), wide(), wide()).unwrap();
    let mut settings = FlowSettings::new(
        1e-3,
        TimeStep::Courant {
            courant: 0.35,
            longest_s: 10.0,
        },
    );
    settings.subgrid = SubgridModel::MULTISCALE_WALE;
    let field = |[x, y, z]: [f64; 3]| {
        let rate = 30.0 / (y * y + z * z + 9.0);
        let noise =
            |a: f64| 1e-4 * ((2.3 * x + 1.9 * y + a * z).sin() + (2.9 * x - 2.7 * y + a * y).cos());
        [noise(2.1), -z * rate + noise(1.1), y * rate + noise(2.8)]
    };
    let (mut flow, _) = Flow::new(mesh, settings, field).unwrap();
    let rms = |flow: &Flow| {
        flow.face_velocity_m_s(0)
            .iter()
            .map(|u| u * u)
            .sum::<f64>()
            .sqrt()
    };
    let before = rms(&flow);
    let mut cut = false;
    for _ in 0..steps {
        let report = flow.step().unwrap();
        cut |= report.subgrid_decay > 1.0;
        let largest = flow
            .subgrid_viscosity_m2_s()
            .unwrap()
            .into_iter()
            .fold(0.0, f64::max);
        assert_eq!(largest, report.subgrid_viscosity_m2_s);
    }
    assert!(
        cut,
        "the viscosity of the core must be more than an explicit step can follow"
    );
    rms(&flow) / before
}

#[test]
fn the_core_of_a_tight_vortex_stays_smooth_at_the_step_that_convection_allows() {
    let growth = noise_along_a_vortex(150);
    assert!(growth < 1.0, "{growth}");
}

#[test]
fn constants_of_the_multiscale_model_give_the_dissipation_of_wale_in_a_minus_five_thirds_spectrum()
{
    use std::f64::consts::PI;
    const STEPS: usize = 48;
    let middle = |i: usize| (i as f64 + 0.5) / STEPS as f64;
    for order in 1..=4_usize {
        let kept = |phase: f64| 1.0 - (0.5 * phase).sin().powi(2 * order as i32);
        let mut small = 0.0;
        let mut all = 0.0;
        // Midpoint rule over the octant of the sphere |k| < pi: k^2 E(k) = k^(1/3), uniform in
        // direction.
        for (i, j, l) in
            (0..STEPS * STEPS * STEPS).map(|p| (p / (STEPS * STEPS), p / STEPS % STEPS, p % STEPS))
        {
            let k = PI * middle(i);
            let cosine = middle(j);
            let angle = 0.5 * PI * middle(l);
            let sine = (1.0 - cosine * cosine).sqrt();
            let low =
                kept(k * sine * angle.cos()) * kept(k * sine * angle.sin()) * kept(k * cosine);
            small += k.cbrt() * (1.0 - low);
            all += k.cbrt();
        }
        let share = small / all;
        let constant = SubgridModel::multiscale_constant(0.5, order);
        assert!(
            (constant * constant * share / 0.25 - 1.0).abs() < 1e-3,
            "order {order}: {share}, {constant}"
        );
    }
    let SubgridModel::MultiscaleWale { constant, order } = SubgridModel::MULTISCALE_WALE else {
        unreachable!()
    };
    assert!((constant - SubgridModel::multiscale_constant(0.5, order)).abs() < 1e-4);
}
