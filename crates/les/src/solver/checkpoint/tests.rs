//! Restarts bit for bit, and files that must be refused.

use std::path::PathBuf;
use std::sync::Arc;

use super::super::mesh::{Direction, Mapping, MappingFn, Spread, Wall};
use super::super::settings::{TimeScheme, TimeStep};
use super::*;

fn mesh() -> Mesh {
    Mesh::new(
        Direction::periodic(4, 0.0, 1.0),
        Direction::periodic(6, 0.0, 1.0).stretched(Spread::Sine.by(0.2)),
        Direction::between(12, 0.0, 1.0, Wall::AT_REST, Wall::Slip)
            .stretched(Spread::TanhLow.by(1.0)),
    )
    .unwrap()
}

fn settings() -> FlowSettings {
    FlowSettings::new(2e-3, TimeStep::Fixed { step_s: 0.01 })
}

fn start(settings: FlowSettings) -> Flow {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    let field =
        move |[x, y, z]: [f64; 3]| [wave(y + 0.1) * z, wave(x + 2.0 * y) * z, 0.3 * wave(x - y)];
    Flow::new(mesh(), settings, field).unwrap().0
}

fn variants() -> Vec<FlowSettings> {
    let courant = TimeStep::Courant {
        courant: 0.3,
        longest_s: 0.1,
    };
    vec![
        // Viscosity implicit along y and z.
        FlowSettings {
            viscosity_m2_s: 2e-2,
            ..settings()
        },
        FlowSettings {
            time_step: courant,
            ..settings()
        },
        FlowSettings {
            time_step: courant,
            scheme: TimeScheme::RungeKutta3,
            ..settings()
        },
    ]
}

fn threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build()
        .unwrap()
        .install(work)
}

fn file(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("flow.ckpt")
}

#[test]
fn a_restart_after_any_step_continues_with_the_same_bits_on_other_threads() {
    let folder = tempfile::tempdir().unwrap();
    for settings in variants() {
        let mut states = Vec::new();
        threads(1, || {
            let mut flow = start(settings.clone());
            for step in 0..5_u8 {
                flow.save(folder.path().join(format!("{step}")), &[step, 77])
                    .unwrap();
                states.push(flow.state.clone());
                flow.step().unwrap();
            }
            states.push(flow.state.clone());
        });
        for step in 0..5_u8 {
            let state = threads(3, || {
                let path = folder.path().join(format!("{step}"));
                let (mut flow, user_data) = Flow::restore(path, mesh(), settings.clone()).unwrap();
                assert_eq!(user_data, [step, 77]);
                assert_eq!(flow.state, states[usize::from(step)]);
                for _ in step..5 {
                    flow.step().unwrap();
                }
                flow.state
            });
            // `PartialEq` takes 0 for -0, so compare the bits.
            let bits = |state: &State| {
                state
                    .velocity
                    .iter()
                    .flat_map(|field| field.iter())
                    .map(|v| v.to_bits())
                    .collect::<Vec<_>>()
            };
            assert_eq!(state, states[5], "{settings:?} from step {step}");
            assert_eq!(bits(&state), bits(&states[5]));
        }
    }
}

#[test]
fn the_terms_of_the_step_before_matter() {
    // What this crate's array of previous terms is for: without it the restart would be an Euler
    // step.
    let mut flow = start(settings());
    for _ in 0..3 {
        flow.step().unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    flow.save(file(&folder), &[]).unwrap();
    let (mut again, _) = Flow::restore(file(&folder), mesh(), settings()).unwrap();
    for field in &mut again.state.previous_terms {
        field.fill(0.0);
    }
    flow.step().unwrap();
    again.step().unwrap();
    assert_ne!(flow.state.velocity, again.state.velocity);
}

#[test]
fn every_truncation_and_every_flipped_byte_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder);
    start(settings()).save(&path, b"notes").unwrap();
    let good = std::fs::read(&path).unwrap();
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Flow::restore(&path, mesh(), settings()).unwrap_err()
    };
    // Every byte of the head and of the tail, and some between.
    let places = (0..80)
        .chain((80..good.len()).step_by(997))
        .chain(good.len() - 80..good.len());
    for place in places {
        let cut = refused(&good[..place]);
        assert!(
            matches!(
                cut,
                Error::CheckpointDamaged { .. } | Error::NotACheckpoint { .. }
            ),
            "{place}: {cut}"
        );
        let mut altered = good.clone();
        altered[place] ^= 0x10;
        let found = refused(&altered);
        match place {
            0..16 => assert!(
                matches!(found, Error::NotACheckpoint { .. }),
                "{place}: {found}"
            ),
            16..20 => assert!(
                matches!(
                    found,
                    Error::CheckpointVersion {
                        supported: VERSION,
                        ..
                    }
                ),
                "{place}: {found}"
            ),
            _ => assert!(
                matches!(found, Error::CheckpointDamaged { .. }),
                "{place}: {found}"
            ),
        }
    }
    let longer = [&good[..], b"x"].concat();
    assert!(matches!(refused(&longer), Error::CheckpointDamaged { .. }));
    assert!(matches!(refused(b""), Error::NotACheckpoint { .. }));
    assert!(matches!(
        refused(b"CDF\x02 something else"),
        Error::NotACheckpoint { .. }
    ));
    std::fs::write(&path, &good).unwrap();
    Flow::restore(&path, mesh(), settings()).unwrap();
}

#[test]
fn another_mesh_or_other_physics_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder);
    start(settings()).save(&path, &[]).unwrap();
    let [x, y, z] = mesh().directions().clone();
    let mismatch = |mesh: Mesh, settings: FlowSettings| match Flow::restore(&path, mesh, settings)
        .unwrap_err()
    {
        Error::CheckpointMismatch {
            what,
            stored,
            wanted,
            ..
        } => (what, stored, wanted),
        other => panic!("{other}"),
    };
    let meshed = |y: Direction| mismatch(Mesh::new(x.clone(), y, z.clone()).unwrap(), settings());
    let expected = |what: &str, stored: &str, wanted: &str| {
        (what.to_owned(), stored.to_owned(), wanted.to_owned())
    };
    assert_eq!(
        meshed(Direction {
            cells: 8,
            ..y.clone()
        }),
        expected("the number of cells along y", "6", "8")
    );
    assert_eq!(
        meshed(Direction {
            high_m: 2.0,
            ..y.clone()
        }),
        expected("the high end of y", "1.0 m", "2.0 m")
    );
    let (what, ..) = meshed(y.clone().stretched(Spread::Sine.by(0.3)));
    assert_eq!(what, "the mapping of y");
    let changed = |change: fn(&mut FlowSettings)| {
        let mut other = settings();
        change(&mut other);
        mismatch(mesh(), other).0
    };
    assert_eq!(changed(|s| s.viscosity_m2_s = 1e-3), "viscosity_m2_s");
    assert_eq!(changed(|s| s.force_m_s2 = [1.0, 0.0, 0.0]), "force_m_s2");
    assert_eq!(
        changed(|s| s.scheme = TimeScheme::RungeKutta3),
        "the time scheme"
    );
    // The length of the step and the effort of the pressure solve are the user's to change.
    let time_step = TimeStep::Fixed { step_s: 0.005 };
    let gentler = FlowSettings {
        time_step,
        pressure_tolerance: 1e-6,
        ..settings()
    };
    Flow::restore(&path, mesh(), gentler)
        .unwrap()
        .0
        .step()
        .unwrap();
}

#[test]
fn custom_mappings_are_told_apart_by_their_metrics() {
    let bent = |a: f64| -> Mapping {
        let map: MappingFn = Arc::new(move |s| (s + a * s * (1.0 - s), 1.0 + a * (1.0 - 2.0 * s)));
        Mapping {
            custom: Some(map),
            ..Mapping::default()
        }
    };
    let mesh = |a| {
        let wall = Direction::between(8, 0.0, 1.0, Wall::Slip, Wall::Slip);
        Mesh::new(
            Direction::thin(1.0),
            Direction::periodic(4, 0.0, 1.0),
            wall.stretched(bent(a)),
        )
        .unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let (flow, _) = Flow::new(mesh(0.1), settings(), |_| [1.0, 0.0, 0.0]).unwrap();
    flow.save(file(&folder), &[]).unwrap();
    Flow::restore(file(&folder), mesh(0.1), settings()).unwrap();
    let message = Flow::restore(file(&folder), mesh(0.100001), settings())
        .unwrap_err()
        .to_string();
    assert!(message.contains("mapping of z"), "{message}");
}

#[test]
fn what_cannot_be_written_leaves_the_older_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder);
    let mut flow = start(settings());
    flow.save(&path, b"old").unwrap();
    // A folder stands where the new file would be written first.
    let part = folder.path().join("flow.ckpt.part");
    std::fs::create_dir(&part).unwrap();
    flow.step().unwrap();
    assert!(matches!(
        flow.save(&path, b"new"),
        Err(Error::File {
            action: "write",
            ..
        })
    ));
    let (old, user_data) = Flow::restore(&path, mesh(), settings()).unwrap();
    assert_eq!((old.steps(), user_data), (0, b"old".to_vec()));
    std::fs::remove_dir(&part).unwrap();
    flow.save(&path, b"new").unwrap();
    assert_eq!(
        Flow::restore(&path, mesh(), settings()).unwrap().0.steps(),
        1
    );
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "no part is left behind"
    );
    let absent = flow.save(folder.path().join("none/flow.ckpt"), &[]);
    assert!(matches!(
        absent,
        Err(Error::File {
            kind: std::io::ErrorKind::NotFound,
            ..
        })
    ));
}
