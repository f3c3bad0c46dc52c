//! Flows with known answers against stored numbers: each is run for a few steps, and the last step must be what it was when the
//! numbers were stored.

use wakescope_les::cases::{self, Case, TollmienSchlichting};
use wakescope_les::solver::{PressureMethod, Run, RunObserver, RunPlan, StepRecord, StepReport};
use wakescope_les::{Flow, SubgridModel, TimeScheme, TimeStep};

/// Largest relative difference from a stored number: other machines round elementary functions differently.
const TOLERANCE: f64 = 1e-10;

/// Keeps the report of the last step.
#[derive(Default)]
struct LastStep(Option<StepReport>);

impl RunObserver for LastStep {
    fn step(&mut self, _: &Flow, record: &StepRecord) -> Result<(), String> {
        self.0 = Some(record.report);
        Ok(())
    }
}

/// What is stored of a case.
struct Stored {
    steps: u64,
    /// Courant number of the last step.
    courant: f64,
    kinetic_energy_m5_s2: f64,
    viscous_power_m5_s3: f64,
    subgrid_power_m5_s3: f64,
    subgrid_viscosity_m2_s: f64,
    /// Velocity along x, y, z on the low faces of the cell at two fifths of the cells of each direction.
    probe_m_s: [f64; 3],
}

/// Runs `case` through `output_times_s` to the last of them and compares the last step with `stored`.
fn assert_stored(case: &Case, output_times_s: &[f64], stored: &Stored) {
    let (flow, _) = case.start().unwrap();
    let plan = RunPlan {
        end_s: output_times_s[output_times_s.len() - 1],
        output_times_s: output_times_s.to_vec(),
        ..RunPlan::default()
    };
    let mut run = Run::new(flow, plan).unwrap();
    let mut last = LastStep::default();
    assert!(run.to_end(&mut last).unwrap());
    let report = last.0.unwrap();
    let cells = run.flow().mesh().cells();
    let [x, y, z] = cells.map(|count| 2 * count / 5);
    let index = (z * cells[1] + y) * cells[0] + x;
    let probe_m_s = [0, 1, 2].map(|axis| run.flow().face_velocity_m_s(axis)[index]);
    assert_eq!(report.step, stored.steps);
    let [u, v, w] = probe_m_s;
    let [stored_u, stored_v, stored_w] = stored.probe_m_s;
    let energy = report.kinetic_energy_m5_s2;
    let viscous_power = report.viscous_power_m5_s3;
    let subgrid_power = report.subgrid_power_m5_s3;
    for (name, value, expected) in [
        ("courant", report.courant, stored.courant),
        ("kinetic energy", energy, stored.kinetic_energy_m5_s2),
        ("viscous power", viscous_power, stored.viscous_power_m5_s3),
        ("subgrid power", subgrid_power, stored.subgrid_power_m5_s3),
        (
            "subgrid viscosity",
            report.subgrid_viscosity_m2_s,
            stored.subgrid_viscosity_m2_s,
        ),
        ("u", u, stored_u),
        ("v", v, stored_v),
        ("w", w, stored_w),
    ] {
        let difference = (value - expected).abs();
        // Velocities of zero are zero to round-off of speeds of order one.
        let allowed = TOLERANCE * expected.abs().max(1e-4);
        assert!(difference <= allowed, "{name}: {value:?}, not {expected:?}");
    }
}

#[test]
fn a_lid_driven_cavity_repeats_its_stored_numbers() {
    let case = cases::lid_driven_cavity(24, 1.5, 400.0).unwrap();
    let stored = Stored {
        steps: 68,
        courant: 0.3254677316620766,
        kinetic_energy_m5_s2: 0.010407156990551784,
        viscous_power_m5_s3: 0.00896923476104661,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [0.0, -0.017205060811451588, 0.00802751528636749],
    };
    assert_stored(&case, &[0.5], &stored);
}

#[test]
fn a_dipole_between_walls_repeats_its_stored_numbers() {
    let mut case = cases::dipole_between_walls([48; 2], [0.5, 1.5], 300.0).unwrap();
    case.settings.scheme = TimeScheme::RungeKutta3;
    case.settings.time_step = TimeStep::Courant {
        courant: 0.35,
        longest_s: 0.002,
    };
    let stored = Stored {
        steps: 26,
        courant: 0.3224369156138232,
        kinetic_energy_m5_s2: 1.8474090763677498,
        viscous_power_m5_s3: -5.201025432067468,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [0.0, -0.44427866904688373, -0.16191926568845066],
    };
    assert_stored(&case, &[0.0, 0.03], &stored);
}

#[test]
fn a_dipole_in_a_box_repeats_its_stored_numbers_with_multigrid() {
    let mut case = cases::dipole_in_a_box([32; 2], [1.5; 2], 300.0).unwrap();
    case.settings.pressure = PressureMethod::Multigrid;
    case.settings.pressure_tolerance = 1e-8;
    let stored = Stored {
        steps: 20,
        courant: 0.20640925747800695,
        kinetic_energy_m5_s2: 2.038380783266554,
        viscous_power_m5_s3: -5.735452585583335,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [0.0, -0.16326759342685826, -0.032914606954963385],
    };
    assert_stored(&case, &[0.02], &stored);
}

#[test]
fn a_tollmien_schlichting_wave_repeats_its_stored_numbers() {
    let wave = TollmienSchlichting::new(7500.0, 1.0).unwrap();
    let mut case = wave.case([16, 32], 1.5, 1e-3, 0.02).unwrap();
    case.settings.scheme = TimeScheme::RungeKutta3;
    let stored = Stored {
        steps: 25,
        courant: 0.05087951032732549,
        kinetic_energy_m5_s2: 3.351056591060582,
        viscous_power_m5_s3: -0.002234033988810994,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [0.8777495459412452, 0.0, 3.74387091929258e-5],
    };
    assert_stored(&case, &[0.5], &stored);
}

#[test]
fn plane_taylor_green_vortices_repeat_their_stored_numbers() {
    let case = cases::taylor_green_plane(16, [0.4, -0.3], 0.01, 0.004).unwrap();
    let stored = Stored {
        steps: 10,
        courant: 0.08336434245716531,
        kinetic_energy_m5_s2: 0.23470334346210686,
        viscous_power_m5_s3: -0.37281705661538095,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [0.0, -0.33968417304449655, 0.7597189240353323],
    };
    assert_stored(&case, &[0.0, 0.02, 0.04], &stored);
}

/// Taylor-Green vortices on 16 cells at a Reynolds number of 400, to 0.3 s at a Courant number of 0.35.
fn assert_stored_taylor_green(
    scheme: TimeScheme,
    pressure: PressureMethod,
    subgrid: SubgridModel,
    stored: &Stored,
) {
    let mut case = cases::taylor_green_3d(16, 400.0).unwrap();
    case.settings.scheme = scheme;
    case.settings.pressure = pressure;
    case.settings.subgrid = subgrid;
    assert_stored(&case, &[0.3], stored);
}

#[test]
fn taylor_green_vortices_without_a_model_repeat_their_stored_numbers() {
    let stored = Stored {
        steps: 3,
        courant: 0.2964292731717363,
        kinetic_energy_m5_s2: 30.86664030650752,
        viscous_power_m5_s3: -0.4655080337460814,
        subgrid_power_m5_s3: 0.0,
        subgrid_viscosity_m2_s: 0.0,
        probe_m_s: [
            0.5016049777900292,
            -0.47279849653127426,
            -0.027614711838142375,
        ],
    };
    let (scheme, pressure) = (TimeScheme::RungeKutta3, PressureMethod::Direct);
    assert_stored_taylor_green(scheme, pressure, SubgridModel::None, &stored);
}

#[test]
fn taylor_green_vortices_with_smagorinskys_model_repeat_their_stored_numbers() {
    let stored = Stored {
        steps: 3,
        courant: 0.2959252883439743,
        kinetic_energy_m5_s2: 30.72999751194153,
        viscous_power_m5_s3: -0.4641318469330887,
        subgrid_power_m5_s3: -0.45570219300223425,
        subgrid_viscosity_m2_s: 0.0042042482809140835,
        probe_m_s: [
            0.5003522189473617,
            -0.4717580110270555,
            -0.027740853402989322,
        ],
    };
    let (scheme, pressure) = (TimeScheme::AdamsBashforth2, PressureMethod::Direct);
    let model = SubgridModel::Smagorinsky { constant: 0.12 };
    assert_stored_taylor_green(scheme, pressure, model, &stored);
}

#[test]
fn taylor_green_vortices_with_wale_repeat_their_stored_numbers() {
    let stored = Stored {
        steps: 3,
        courant: 0.29520883610119053,
        kinetic_energy_m5_s2: 30.710427974151997,
        viscous_power_m5_s3: -0.46400467044247107,
        subgrid_power_m5_s3: -0.5219553701925138,
        subgrid_viscosity_m2_s: 0.03074380644711484,
        probe_m_s: [
            0.49959935751035656,
            -0.47121999553192473,
            -0.02736594117577404,
        ],
    };
    let (scheme, pressure) = (TimeScheme::RungeKutta3, PressureMethod::Multigrid);
    assert_stored_taylor_green(scheme, pressure, SubgridModel::WALE, &stored);
}

#[test]
fn taylor_green_vortices_with_multiscale_wale_repeat_their_stored_numbers() {
    let stored = Stored {
        steps: 3,
        courant: 0.2964418582513553,
        kinetic_energy_m5_s2: 30.86477900713372,
        viscous_power_m5_s3: -0.46549177226512967,
        subgrid_power_m5_s3: -0.006274028814237348,
        subgrid_viscosity_m2_s: 0.07303268674303082,
        probe_m_s: [
            0.5015445203056176,
            -0.47281340686152473,
            -0.02774397371125695,
        ],
    };
    let (scheme, pressure) = (TimeScheme::AdamsBashforth2, PressureMethod::Multigrid);
    let model = SubgridModel::MultiscaleWale {
        constant: 0.8,
        order: 2,
    };
    assert_stored_taylor_green(scheme, pressure, model, &stored);
}
