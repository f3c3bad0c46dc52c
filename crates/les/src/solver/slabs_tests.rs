//! Flows on ranks against the same flows in one process, bit for bit.

use std::sync::Arc;

use super::cases::{Case, VortexPairCase, channel, taylor_green_3d};
use super::pressure::PressureMethod;
use super::report::StepReport;
use super::settings::{FlowSettings, TimeScheme, TimeStep};
use super::subgrid::SubgridModel;
use crate::Error;
use crate::ranks::{Ranks, Single, on_threads};

/// The energy given at the start, and all that a flow shows after some steps.
type Seen = (f64, Vec<StepReport>, Vec<Vec<u64>>, f64);

fn bits(values: Vec<f64>) -> Vec<u64> {
    values.into_iter().map(f64::to_bits).collect()
}

/// `implicit` says along which memory axes viscosity is implicit, if not the flow.
fn seen(
    case: &Case,
    implicit: Option<[bool; 3]>,
    ranks: Arc<dyn Ranks>,
    steps: usize,
) -> Result<Seen, Error> {
    let settings = FlowSettings {
        ranks,
        ..case.settings.clone()
    };
    let (mut flow, start) = case.initial.start(case.mesh.clone(), settings)?;
    flow.state.implicit = implicit.unwrap_or(flow.state.implicit);
    let reports = (0..steps)
        .map(|_| flow.step())
        .collect::<Result<_, Error>>()?;
    let mut fields: Vec<_> = [0, 1, 2].map(|d| bits(flow.face_velocity_m_s(d))).into();
    fields.push(bits(flow.whole(flow.own_centre_velocity_m_s(2))));
    fields.push(bits(flow.pressure_m2_s2()));
    fields.extend(flow.subgrid_viscosity_m2_s().map(bits));
    Ok((start, reports, fields, flow.relative_divergence()))
}

/// `work` on as many threads as a pool of its own has.
fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
        .install(work)
}

fn assert_same(name: &str, case: &Case, steps: usize) {
    assert_same_with(name, case, None, steps);
}

fn assert_same_with(name: &str, case: &Case, implicit: Option<[bool; 3]>, steps: usize) {
    let alone = seen(case, implicit, Arc::new(Single), steps).unwrap();
    assert!(
        alone.2.iter().flatten().any(|value| *value != 0),
        "{name}: nothing moves"
    );
    for (count, threads) in [2, 3, 5, 7]
        .into_iter()
        .flat_map(|count| [(count, 1), (count, 2)])
    {
        for (rank, found) in on_threads(count, |ranks| {
            with_threads(threads, || seen(case, implicit, ranks, steps))
        })
        .into_iter()
        .enumerate()
        {
            assert!(
                found == Some(Ok(alone.clone())),
                "{name}: rank {rank} of {count}, {threads} threads each"
            );
        }
    }
}

/// Both schemes; 17 and 29 planes leave the ranks uneven parts.
fn wake(cells: [usize; 3], subgrid: SubgridModel, slip_sides: bool) -> Case {
    let case = VortexPairCase {
        cells,
        perturbation: 0.05,
        subgrid,
        slip_sides,
        reynolds: 1000.0,
        ..VortexPairCase::coarse()
    };
    case.case(TimeStep::Courant {
        courant: 0.65,
        longest_s: 0.1,
    })
    .unwrap()
}

#[test]
fn vortices_of_taylor_and_green_are_the_same_on_any_number_of_ranks() {
    let mut case = taylor_green_3d(30, 100.0).unwrap();
    assert_same("Adams-Bashforth, all axes transformed", &case, 4);
    case.settings.scheme = TimeScheme::RungeKutta3;
    case.settings.subgrid = SubgridModel::WALE;
    assert_same_with(
        "Runge-Kutta, all axes implicit, WALE",
        &case,
        Some([true; 3]),
        2,
    );
}

#[test]
fn wakes_with_filters_of_order_1_and_4_are_the_same_on_any_number_of_ranks() {
    for order in [1, 4] {
        let model = SubgridModel::MultiscaleWale {
            constant: 0.9,
            order,
        };
        assert_same(
            &format!("order {order}"),
            &wake([8, 24, 29], model, false),
            2,
        );
    }
    assert_same(
        "planes of two blocks",
        &wake([72, 60, 28], SubgridModel::None, false),
        1,
    );
}

#[test]
fn walls_implicit_lines_and_every_form_of_the_pressure_are_the_same_on_any_number_of_ranks() {
    let between_walls = channel([12, 10, 28], 1.5, 100.0).unwrap();
    assert_same_with(
        "channel, axis 2 implicit",
        &between_walls,
        Some([false, false, true]),
        3,
    );
    let sides = wake([8, 28, 32], SubgridModel::None, true);
    assert_same_with("axis 1 implicit", &sides, Some([false, true, false]), 2);
    let mut long = wake([8, 40, 28], SubgridModel::None, true);
    assert_same("axis 1 factorised", &long, 2);
    long.settings.pressure_tolerance = 1e-15;
    assert_same("a tolerance below round-off", &long, 1);
    long.settings.pressure_tolerance = 1e-10;
    long.settings.pressure = PressureMethod::Multigrid;
    assert_same("multigrid", &long, 2);
    let mut wide = wake([40, 12, 28], SubgridModel::None, true);
    wide.settings.pressure = PressureMethod::Multigrid;
    assert_same("multigrid, three groups of modes", &wide, 2);
}
