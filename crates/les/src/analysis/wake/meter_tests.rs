//! An analytic pair on a mesh, cost, memory of the meter.

use super::*;
use crate::ranks::{Single, on_threads};
use crate::solver::cases::VortexPairCase;
use crate::solver::mesh::{Direction, Spread, Wall};
use crate::solver::settings::{FlowSettings, TimeStep};
use crate::winds::CirculationProfile;
use std::f64::consts::TAU;
use std::sync::Arc;

const PAIR: [[f64; 2]; 2] = [[-0.5, 1.0], [0.5, 1.0]];

fn close(found: f64, expected: f64, within: f64, what: &str) {
    assert!(
        (found - expected).abs() <= within,
        "{what}: {found} for {expected}"
    );
}

/// Vortices (circulation, y, z, core radius) with their images below the ground, moved along y by
/// `bend(x)`.
fn vortices(
    list: &'static [(f64, f64, f64, f64)],
    bend: impl Fn(f64) -> f64 + Sync,
) -> impl Fn([f64; 3]) -> [f64; 3] + Sync {
    move |[x, y, z]| {
        let mut out = [0.0; 3];
        for &(gamma, y0, z0, core) in list {
            for copy in -2..=2 {
                for (z0, sign) in [(z0, 1.0), (-z0, -1.0)] {
                    let dy = y - y0 - bend(x) - 4.0 * f64::from(copy);
                    let dz = z - z0;
                    let r2 = dy * dy + dz * dz;
                    let rotation_per_s =
                        sign * gamma / TAU * (1.0 - (-r2 / (core * core)).exp()) / r2.max(1e-12);
                    out[1] -= rotation_per_s * dz;
                    out[2] += rotation_per_s * dy;
                }
            }
        }
        out
    }
}

fn flow(nx: usize, field: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> Flow {
    let x = if nx == 1 {
        Direction::thin(1.0)
    } else {
        Direction::periodic(nx, 0.0, 1.0)
    };
    let z = Direction::between(80, 0.0, 2.5, Wall::AT_REST, Wall::Slip)
        .stretched(Spread::TanhLow.by(1.5));
    let mesh = Mesh::new(x, Direction::periodic(128, -2.0, 2.0), z).unwrap();
    Flow::new(
        mesh,
        FlowSettings::new(TAU / 5000.0, TimeStep::Fixed { step_s: 1e-3 }),
        field,
    )
    .unwrap()
    .0
}

fn meter(flow: &Flow) -> WakeMeter {
    WakeMeter::new(
        flow.mesh(),
        flow.settings().viscosity_m2_s,
        WakeScales::REDUCED,
        PAIR,
    )
    .unwrap()
}

#[test]
fn an_analytic_pair_has_its_centres_and_its_circulation_profile() {
    const LIST: &[(f64, f64, f64, f64)] = &[(-TAU, -0.487, 0.963, 0.1), (TAU, 0.513, 0.963, 0.1)];
    let flow = flow(1, vortices(LIST, |_| 0.0));
    let mut meter = meter(&flow);
    let record = meter.measure(&flow).unwrap();
    let cell = 4.0 / 128.0;
    for (vortex, sign, y) in [(&record.left, -1.0, -0.487), (&record.right, 1.0, 0.513)] {
        close(vortex.y_m, y, 0.02 * cell, "y");
        close(vortex.z_m, 0.963, 0.02 * cell, "z");
        for (radius, gamma) in meter.radii_m().iter().zip(&vortex.gamma_m2_s) {
            // A circle about one vortex sees nothing of the others, whose cores are small.
            if (0.1..0.4).contains(radius) {
                let expected = sign * TAU * (1.0 - (-radius * radius / 0.01).exp());
                close(
                    *gamma,
                    expected,
                    0.005 * TAU,
                    &format!("circulation at {radius}"),
                );
            }
        }
        let mean: f64 = (0..21)
            .map(|i| (5.0 + 0.5 * f64::from(i)) / 47.0)
            .map(|r| sign * TAU * (1.0 - (-r * r / 0.01_f64).exp()) / 21.0)
            .sum();
        close(
            vortex.gamma_5_15_m2_s,
            mean,
            0.002 * TAU,
            "mean circulation",
        );
        assert!(
            vortex.secondary.y_m.is_nan() && vortex.gamma_opposite_m2_s.abs() < 0.003 * TAU,
            "{vortex:?}"
        );
        assert!(vortex.y_spread_m < 1e-12 && vortex.slices_m.len() == 1);
    }
    close(
        record.mode_energy_m4_s2[0],
        record.energy_m4_s2,
        1e-3 * record.energy_m4_s2,
        "energy of the plane part",
    );
    // Beneath the pair the air moves outward at up to V0 / ...; the wall is not slipped over, so
    // the shear is strong.
    assert!(
        record.left.outward_shear_per_s > 0.0 && record.wall_shear_per_s > 50.0,
        "{record:?}"
    );
    close(
        record.wall_units,
        flow.mesh().centre_m(2)[0]
            * (record.wall_shear_per_s / flow.settings().viscosity_m2_s).sqrt(),
        1e-9,
        "wall units",
    );
}

#[test]
fn a_bent_pair_has_its_spread_and_secondary_vortices_belong_to_their_side() {
    const LIST: &[(f64, f64, f64, f64)] = &[
        (-TAU, -0.8, 0.8, 0.1),
        (TAU, 0.8, 0.8, 0.1),
        (0.4 * TAU, -1.25, 0.7, 0.07),
        (-0.2 * TAU, 1.25, 0.9, 0.07),
    ];
    let flow = flow(12, vortices(LIST, |x| 0.03 * (TAU * x).sin()));
    let pair = [[-0.78, 0.83], [0.83, 0.78]];
    let mut meter = WakeMeter::new(flow.mesh(), 1e-3, WakeScales::REDUCED, pair).unwrap();
    let record = meter.measure(&flow).unwrap();
    for (vortex, y, second) in [
        (&record.left, -0.8, (-1.25, 0.7, 0.4)),
        (&record.right, 0.8, (1.25, 0.9, -0.2)),
    ] {
        close(vortex.y_m, y, 0.004, "y");
        close(vortex.z_m, 0.8, 0.004, "z");
        assert_eq!(vortex.slices_m.len(), 12);
        close(
            vortex.y_spread_m,
            0.03 / 2.0_f64.sqrt(),
            0.002,
            "spread of y",
        );
        assert!(vortex.z_spread_m < 0.002, "{}", vortex.z_spread_m);
        let (y, z, gamma) = second;
        close(vortex.secondary.y_m, y, 0.01, "secondary y");
        close(vortex.secondary.z_m, z, 0.01, "secondary z");
        close(
            vortex.secondary.gamma_m2_s,
            gamma * TAU,
            0.03 * TAU,
            "secondary circulation",
        );
        close(
            vortex.gamma_opposite_m2_s,
            gamma * TAU,
            0.03 * TAU,
            "circulation of the other sign",
        );
        close(
            vortex.secondary.y_spread_m,
            0.03 / 2.0_f64.sqrt(),
            0.003,
            "spread of the secondary",
        );
    }
    // The bend is of mode 1 and what follows from it.
    assert!(
        record.energy_3d_m4_s2() > 0.0
            && record.mode_energy_m4_s2[1] > 5.0 * record.mode_energy_m4_s2[2]
    );
}

#[test]
fn the_secondary_vortex_is_neither_the_sharpest_sheet_nor_the_first_vortex_of_the_other_side() {
    // On the right a weak spot of higher vorticity than the secondary; over the middle the tail of
    // a wide right vortex.
    const LIST: &[(f64, f64, f64, f64)] = &[
        (-TAU, -0.5, 0.8, 0.1),
        (2.0 * TAU, 0.5, 0.8, 0.3),
        (-0.2 * TAU, 1.5, 0.9, 0.1),
        (-0.05 * TAU, 1.6, 0.4, 0.04),
    ];
    let flow = flow(1, vortices(LIST, |_| 0.0));
    let record = meter(&flow).measure(&flow).unwrap();
    close(record.right.secondary.y_m, 1.5, 0.02, "y of the larger");
    close(record.right.secondary.z_m, 0.9, 0.02, "z of the larger");
    assert!(
        record.left.secondary.gamma_m2_s.is_nan(),
        "{:?}",
        record.left.secondary
    );
}

#[test]
fn secondary_vortices_are_counted_on_over_the_sides_with_their_own() {
    const LIST: &[(f64, f64, f64, f64)] = &[
        (-TAU, -0.5, 0.8, 0.1),
        (TAU, 0.5, 0.8, 0.1),
        (0.3 * TAU, -1.2, 0.9, 0.1),
        (-0.3 * TAU, 1.2, 0.9, 0.1),
    ];
    let flow = flow(1, vortices(LIST, |_| 0.0));
    for periods in [-2.0, -1.0, 0.0, 1.0, 2.0] {
        let shift = 4.0 * periods;
        let centres = PAIR.map(|[y, z]| [y + shift, z]);
        let nu = flow.settings().viscosity_m2_s;
        let record = WakeMeter::new(flow.mesh(), nu, WakeScales::REDUCED, centres)
            .unwrap()
            .measure(&flow)
            .unwrap();
        close(
            record.right.secondary.y_m,
            record.right.y_m + 0.7,
            0.02,
            "beside the right vortex",
        );
        close(
            record.left.secondary.y_m,
            record.left.y_m - 0.7,
            0.02,
            "beside the left vortex",
        );
        close(record.right.y_m, 0.5 + shift, 0.02, "counted on");
    }
}

#[test]
fn the_meter_follows_across_the_period_and_remembers_through_a_restart() {
    let pair = VortexPairCase {
        cells: [1, 64, 40],
        core_radius: 0.15,
        profile: CirculationProfile::LambOseen,
        sticky_ground: false,
        perturbation: 0.0,
        cross_wind: 2.0,
        ..VortexPairCase::coarse()
    };
    let (mut flow, _) = pair
        .case(TimeStep::Fixed { step_s: 0.002 })
        .unwrap()
        .start()
        .unwrap();
    let mut meter = meter(&flow).moving_with([[2.0, -0.8]; 2]);
    let mut last = f64::NEG_INFINITY;
    for _ in 0..10 {
        let record = meter.measure(&flow).unwrap();
        assert!(record.right.y_m > last, "{} after {last}", record.right.y_m);
        last = record.right.y_m;
        let until_s = flow.time_s() + 0.1;
        while flow.time_s() < until_s - 1e-9 {
            flow.step().unwrap();
        }
    }
    assert!(last > 2.2, "beyond the side at 2: {last}");
    let mut other = super::WakeMeter::new(flow.mesh(), 1e-3, WakeScales::REDUCED, PAIR).unwrap();
    other.restore(meter.state());
    other.viscosity_m2_s = meter.viscosity_m2_s;
    // Some values are NaN, which are not equal to themselves.
    let shown = |meter: &mut WakeMeter| format!("{:?}", meter.measure(&flow).unwrap());
    assert_eq!(shown(&mut meter), shown(&mut other));
}

#[test]
fn records_scale_with_the_pair() {
    const LIST: &[(f64, f64, f64, f64)] = &[(-TAU, -0.5, 1.0, 0.1), (TAU, 0.5, 1.0, 0.1)];
    let flow = flow(1, vortices(LIST, |_| 0.0));
    let record = meter(&flow).measure(&flow).unwrap();
    let scales = WakeScales {
        spacing_m: 2.0,
        circulation_m2_s: 3.0 * TAU,
    };
    let reduced = record.reduced(&scales);
    // b0 = 2 m, V0 = 1.5 m/s, b0/V0 = 4/3 s.
    close(reduced.left.y_m, record.left.y_m / 2.0, 1e-14, "lengths");
    close(
        reduced.right.gamma_5_15_m2_s,
        record.right.gamma_5_15_m2_s / 3.0,
        1e-13,
        "circulations",
    );
    close(
        reduced.energy_m4_s2,
        record.energy_m4_s2 / 9.0,
        1e-12,
        "energy",
    );
    close(
        reduced.enstrophy_m2_s2,
        record.enstrophy_m2_s2 / 2.25,
        1e-9,
        "enstrophy",
    );
    close(
        reduced.wall_shear_per_s,
        record.wall_shear_per_s * 4.0 / 3.0,
        1e-9,
        "shear",
    );
    assert!(meter(&flow).with_window([0.3, 0.2]).is_err());
}

#[test]
fn records_on_ranks_have_the_bits_of_one_process_in_every_order_in_memory() {
    let pair = VortexPairCase {
        cells: [10, 32, 29],
        perturbation: 0.1,
        ..VortexPairCase::coarse()
    };
    let case = pair
        .case(TimeStep::Courant {
            courant: 0.65,
            longest_s: 0.1,
        })
        .unwrap();
    for (order, counts) in [
        ([0, 1, 2], &[2, 5, 7][..]),
        ([0, 2, 1], &[3, 8]),
        ([1, 2, 0], &[2]),
    ] {
        let records = |ranks: Arc<dyn Ranks>| {
            let settings = FlowSettings {
                ranks,
                ..case.settings.clone()
            };
            let mut flow = case
                .initial
                .start_in_order(order, case.mesh.clone(), settings)?;
            let mut meter = meter(&flow);
            let first = meter.measure(&flow)?;
            flow.step()?;
            let planes = [flow.cross_plane(0.13)?, flow.mean_plane_of(&flow.faces()?)?];
            Ok::<_, Error>((
                first,
                meter.measure(&flow)?,
                planes,
                bits(&flow.whole(flow.own_vorticity_magnitude_per_s())),
            ))
        };
        let alone = records(Arc::new(Single)).unwrap();
        assert!(
            alone.1.left.slices_m.iter().all(|slice| slice[0] < 0.0),
            "{:?}",
            alone.1.left.slices_m
        );
        for &count in counts {
            for (rank, found) in on_threads(count, records).into_iter().enumerate() {
                let found = found.unwrap().unwrap();
                // As texts, in which what is missing equals itself.
                assert_eq!(
                    format!("{found:?}"),
                    format!("{alone:?}"),
                    "rank {rank} of {count}, {order:?}"
                );
            }
        }
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}
