//! Every key does something: a draw that changes it changes what the book says it changes.

use super::ledger::Ledger;
use super::program::Bench;
use super::random::Random;
use super::scene::Scene;

/// A key, what the scene needs for it, its two values (empty: not stated), the command, and what differs between them: a column of a file, or all
/// that is printed.
type Key = (
    &'static str,
    &'static [(&'static str, &'static str)],
    [&'static str; 2],
    &'static str,
    &'static str,
);

const FIXED: (&str, &str) = ("detector.snr", "{ reference = \"fixed\", snr_db = 6.0 }");
const REFRACTIVE: [(&str, &str); 7] = [
    ("atmosphere.turbulence.kind", "\"refractive\""),
    ("atmosphere.turbulence.cn2_m_m23", "1e-13"),
    ("atmosphere.turbulence.grid_points", "150"),
    ("atmosphere.turbulence.grid_spacing_m", "0.004"),
    ("atmosphere.turbulence.layers", "5"),
    ("atmosphere.turbulence.realisations", "8"),
    ("outputs.profile_range_max_m", "600.0"),
];
const BISTATIC: [(&str, &str); 3] = [
    ("atmosphere.turbulence.kind", "\"refractive\""),
    ("atmosphere.turbulence.cn2_m_m23", "3e-14"),
    ("telescope.receiver", "\"bistatic\""),
];
const FRONT: [(&str, &str); 1] = [("detector.front_end.half_power_hz", "1e8")];
const TRANSPORTED: [(&str, &str); 2] =
    [("flow.motion", "\"transported\""), ("flow.age_tau", "4.0")];
const MEANDERING: [(&str, &str); 3] = [
    ("flow.motion", "\"transported\""),
    ("flow.age_tau", "4.0"),
    ("added_flows", "[{ kind = \"eddies\" }]"),
];
const HAZE: [(&str, &str); 1] = [("atmosphere.aerosol.kind", "\"visibility\"")];
const LAYER: [(&str, &str); 1] = [("atmosphere.aerosol.kind", "\"layer\"")];
const HUFNAGEL: [(&str, &str); 3] = [
    ("atmosphere.turbulence.kind", "\"refractive\""),
    ("atmosphere.turbulence.profile.kind", "\"hufnagel_valley\""),
    ("telescope.receiver", "\"bistatic\""),
];
const CN2_TABLE: [(&str, &str); 5] = [
    ("atmosphere.turbulence.kind", "\"refractive\""),
    ("telescope.receiver", "\"bistatic\""),
    ("atmosphere.turbulence.profile.kind", "\"table\""),
    ("atmosphere.turbulence.profile.heights_m", "[0.0, 100.0]"),
    (
        "atmosphere.turbulence.profile.values_m_m23",
        "[1e-13, 1e-14]",
    ),
];
const RETRIEVED: [(&str, &str); 6] = [
    FIXED,
    (
        "added_flows",
        "[{ kind = \"eddies\", dissipation_m2_s3 = 1e-2 }]",
    ),
    ("retrieval.methods", "[\"fit\"]"),
    ("scan.elevation_max_rad", "0.22"),
    ("scan.range_max_m", "460.0"),
    ("estimator.gate_step_samples", "15"),
];
const PPI: [(&str, &str); 1] = [("scan.lidar_height_m", "20.0")];

const KEYS: &[Key] = &[
    ("seed", &[], ["1", "2"], "map", "v_mean_m_s"),
    (
        "laser.wavelength_m",
        &[],
        ["1.5e-6", "2e-6"],
        "map",
        "v_mean_m_s",
    ),
    (
        "laser.pulse_repetition_hz",
        &[],
        ["400.0", "500.0"],
        "map",
        "time_s",
    ),
    (
        "laser.linewidth_hz",
        &[],
        ["0.0", "1e6"],
        "map",
        "v_mean_m_s",
    ),
    ("pulse.energy_j", &[], ["1e-4", "3e-4"], "budget", ""),
    ("pulse.shape.duration_s", &[], ["1e-7", "3e-7"], "bound", ""),
    (
        "pulse.shape.definition",
        &[],
        ["\"fwhm\"", "\"one_over_e_half_width\""],
        "bound",
        "",
    ),
    (
        "pulse.shape",
        &[],
        [
            "{ kind = \"sampled\", time_s = [0.0, 1e-7, 2e-7], power = [0.0, 1.0, 0.0] }",
            "{ kind = \"sampled\", time_s = [0.0, 2e-7, 4e-7], power = [0.0, 1.0, 0.0] }",
        ],
        "bound",
        "",
    ),
    (
        "pulse.shape",
        &[],
        [
            "{ kind = \"sampled\", time_s = [0.0, 1e-7, 3e-7], power = [0.0, 1.0, 0.0], centred = true }",
            "{ kind = \"sampled\", time_s = [0.0, 1e-7, 3e-7], power = [0.0, 1.0, 0.0], centred = false }",
        ],
        "map",
        "v_pulse_m_s",
    ),
    ("detector.bandwidth_hz", &[], ["4e7", "5e7"], "budget", ""),
    (
        "detector.intermediate_frequency_hz",
        &[],
        ["7e7", "8e7"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.sampling_hz",
        &[],
        ["2.5e8", "3e8"],
        "map",
        "range_m",
    ),
    (
        "detector.quantum_efficiency",
        &[],
        ["0.5", "1.0"],
        "budget",
        "",
    ),
    (
        "detector.local_oscillator_w",
        &[("detector.front_end.dark_current_a", "1e-5")],
        ["1e-3", "2e-3"],
        "budget",
        "",
    ),
    (
        "detector.noise",
        &[],
        ["\"band\"", "\"white\""],
        "bound",
        "",
    ),
    (
        "detector.signal",
        &[],
        ["\"intermediate_frequency\"", "\"baseband\""],
        "bound",
        "",
    ),
    (
        "detector.digitiser",
        &[],
        [
            "{ kind = \"none\" }",
            "{ kind = \"quantised\", bits = 4, full_scale_over_noise = 4.0 }",
        ],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.front_end.amplifier_noise_a_rthz",
        &[],
        ["0.0", "1e-11"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.front_end.load_ohm",
        &[],
        ["inf", "50.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.front_end.load_temperature_k",
        &[("detector.front_end.load_ohm", "50.0")],
        ["290.0", "77.0"],
        "budget",
        "",
    ),
    (
        "detector.front_end.dark_current_a",
        &[],
        ["0.0", "1e-4"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.front_end.intensity_noise_db_hz",
        &[],
        ["-inf", "-150.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.front_end.rejection_db",
        &[("detector.front_end.intensity_noise_db_hz", "-150.0")],
        ["0.0", "20.0"],
        "budget",
        "",
    ),
    (
        "detector.front_end.saturation_w",
        &[],
        ["inf", "5e-3"],
        "budget",
        "",
    ),
    (
        "detector.front_end.half_power_hz",
        &[("detector.front_end.amplifier_noise_a_rthz", "1e-11")],
        ["inf", "5e7"],
        "budget",
        "",
    ),
    (
        "detector.front_end.poles",
        &FRONT,
        ["1", "3"],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.snr.reference",
        &[],
        ["\"physical\"", "\"chapter\""],
        "map",
        "v_mean_m_s",
    ),
    (
        "detector.snr",
        &[],
        [
            "{ reference = \"fixed\", snr_db = 0.0 }",
            "{ reference = \"fixed\", snr_db = 9.0 }",
        ],
        "map",
        "v_mean_m_s",
    ),
    (
        "telescope.aperture_radius_m",
        &[],
        ["0.05", "0.06"],
        "budget",
        "",
    ),
    (
        "telescope.obscuration_radius_m",
        &[],
        ["0.0", "0.01"],
        "budget",
        "",
    ),
    (
        "telescope.beam_radius_m",
        &[],
        ["0.03", "0.04"],
        "budget",
        "",
    ),
    (
        "telescope.beam_radius_definition",
        &[],
        ["\"intensity\"", "\"field\""],
        "budget",
        "",
    ),
    (
        "telescope.focus_m",
        &[],
        ["inf", "400.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "telescope.receiver",
        &REFRACTIVE,
        ["\"monostatic\"", "\"bistatic\""],
        "efficiency",
        "efficiency",
    ),
    (
        "telescope.optics_loss_db",
        &[],
        ["0.0", "3.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "telescope.reflection_db",
        &[],
        ["-inf", "-50.0"],
        "budget",
        "",
    ),
    (
        "telescope.blind_range_m",
        &[],
        ["0.0", "330.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.backscatter_per_m_sr",
        &[],
        ["1e-7", "1e-6"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.extinction_per_m",
        &[],
        ["1e-5", "1e-3"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol",
        &[],
        ["{ kind = \"visibility\" }", "{ kind = \"layer\" }"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.visibility_m",
        &HAZE,
        ["5e3", "2e4"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.lidar_ratio_sr",
        &HAZE,
        ["30.0", "60.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.lidar_ratio_sr",
        &LAYER,
        ["30.0", "60.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.ground_backscatter_per_m_sr",
        &LAYER,
        ["1e-6", "2e-6"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.scale_height_m",
        &LAYER,
        ["500.0", "3000.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.top_m",
        &LAYER,
        ["40.0", "900.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.step_m",
        &[
            ("atmosphere.aerosol.kind", "\"layer\""),
            ("atmosphere.aerosol.top_m", "40.0"),
        ],
        ["10.0", "60.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.aerosol.above_backscatter_per_m_sr",
        &[
            ("atmosphere.aerosol.kind", "\"layer\""),
            ("atmosphere.aerosol.top_m", "20.0"),
        ],
        ["1e-8", "1e-7"],
        "map",
        "v_mean_m_s",
    ),
    (
        "atmosphere.turbulence.profile",
        &[
            ("atmosphere.turbulence.kind", "\"refractive\""),
            ("telescope.receiver", "\"bistatic\""),
        ],
        [
            "{ kind = \"hufnagel_valley\" }",
            "{ kind = \"table\", heights_m = [0.0, 100.0], values_m_m23 = [1e-13, 1e-14] }",
        ],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.profile.ground_cn2_m_m23",
        &HUFNAGEL,
        ["1e-14", "1e-13"],
        "budget",
        "",
    ),
    (
        // Its term of the wind is felt high up alone.
        "atmosphere.turbulence.profile.high_wind_m_s",
        &[
            ("atmosphere.turbulence.kind", "\"refractive\""),
            ("atmosphere.turbulence.profile.kind", "\"hufnagel_valley\""),
            ("telescope.receiver", "\"bistatic\""),
            ("scan.elevation_min_rad", "1.4"),
            ("scan.elevation_max_rad", "1.45"),
            ("scan.range_min_m", "8000.0"),
            ("scan.range_max_m", "8500.0"),
        ],
        ["21.0", "150.0"],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.profile.heights_m",
        &CN2_TABLE,
        ["[0.0, 100.0]", "[0.0, 60.0]"],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.profile.values_m_m23",
        &CN2_TABLE,
        ["[1e-13, 1e-14]", "[1e-13, 5e-14]"],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.cn2_m_m23",
        &REFRACTIVE,
        ["1e-13", "2e-13"],
        "efficiency",
        "efficiency",
    ),
    (
        "atmosphere.turbulence.spectrum",
        &BISTATIC,
        ["\"von_karman\"", "\"kolmogorov\""],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.inner_scale_m",
        &BISTATIC,
        ["0.01", "0.03"],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.outer_scale_m",
        &BISTATIC,
        ["1.0", "0.2"],
        "budget",
        "",
    ),
    (
        "atmosphere.turbulence.layers",
        &REFRACTIVE,
        ["5", "6"],
        "efficiency",
        "efficiency",
    ),
    (
        "atmosphere.turbulence.realisations",
        &REFRACTIVE,
        ["8", "12"],
        "efficiency",
        "efficiency",
    ),
    (
        "atmosphere.turbulence.efficiency",
        &REFRACTIVE,
        ["\"mean\"", "\"realisation\""],
        "map",
        "v_mean_m_s",
    ),
    (
        "flow.profile",
        &[],
        ["\"algebraic\"", "\"lamb_oseen\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.motion",
        &[],
        ["\"frozen\"", "\"inviscid\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.decay",
        &TRANSPORTED,
        ["{ law = \"two_phase\" }", "{ law = \"sarpkaya\" }"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.decay.slow",
        &[
            ("flow.motion", "\"transported\""),
            ("flow.age_tau", "4.0"),
            ("flow.decay.law", "\"two_phase\""),
        ],
        ["0.06", "0.1"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.decay.fast",
        &[
            ("flow.motion", "\"transported\""),
            ("flow.age_tau", "4.0"),
            ("flow.lifetime_tau", "2.0"),
            ("flow.decay.law", "\"two_phase\""),
        ],
        ["0.4", "0.6"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.decay.rate",
        &[
            ("flow.motion", "\"transported\""),
            ("flow.age_tau", "4.0"),
            ("flow.decay.law", "\"sarpkaya\""),
        ],
        ["0.45", "0.6"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.lifetime_tau",
        &TRANSPORTED,
        ["1.0", "3.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.dissipation_m2_s3",
        &TRANSPORTED,
        ["1e-4", "1e-2"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.buoyancy_per_s",
        &TRANSPORTED,
        ["0.0", "0.02"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.rebound",
        &TRANSPORTED,
        ["false", "true"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.meander",
        &MEANDERING,
        ["false", "true"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.cross_wind_m_s",
        &[],
        ["0.0", "2.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.profile",
        &[("flow.kind", "\"wind\"")],
        ["\"logarithmic\"", "\"power\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.speed_m_s",
        &[("flow.kind", "\"wind\"")],
        ["5.0", "7.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.reference_height_m",
        &[("flow.kind", "\"wind\"")],
        ["10.0", "20.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.friction_velocity_m_s",
        &[("flow.kind", "\"wind\"")],
        ["0.3", "0.4"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.toward_rad",
        &[("flow.kind", "\"wind\"")],
        ["1.0", "1.5"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.cross_wind_m_s",
        &[("flow.kind", "\"wind\"")],
        ["3.0", "-2.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.head_wind_m_s",
        &[
            ("flow.kind", "\"wind\""),
            ("flow.cross_wind_m_s", "2.0"),
            ("scan.pattern", "{ kind = \"axial\" }"),
        ],
        ["3.0", "-2.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.roughness_m",
        &[("flow.kind", "\"wind\"")],
        ["0.03", "0.1"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.displacement_m",
        &[("flow.kind", "\"wind\"")],
        ["0.0", "2.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.exponent",
        &[("flow.kind", "\"wind\""), ("flow.profile", "\"power\"")],
        ["0.1", "0.2"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.height_m",
        &[
            ("flow.kind", "\"wind\""),
            ("flow.profile", "\"table\""),
            ("flow.height_m", "[10.0, 100.0]"),
            ("flow.speeds_m_s", "[3.0, 8.0]"),
            ("flow.towards_rad", "[1.0, 1.5]"),
        ],
        ["[10.0, 100.0]", "[20.0, 90.0]"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.speeds_m_s",
        &[
            ("flow.kind", "\"wind\""),
            ("flow.profile", "\"table\""),
            ("flow.height_m", "[10.0, 100.0]"),
            ("flow.speeds_m_s", "[3.0, 8.0]"),
            ("flow.towards_rad", "[1.0, 1.5]"),
        ],
        ["[3.0, 8.0]", "[4.0, 8.0]"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.towards_rad",
        &[
            ("flow.kind", "\"wind\""),
            ("flow.profile", "\"table\""),
            ("flow.height_m", "[10.0, 100.0]"),
            ("flow.speeds_m_s", "[3.0, 8.0]"),
            ("flow.towards_rad", "[1.0, 1.5]"),
        ],
        ["[1.0, 1.5]", "[1.2, 1.5]"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.dissipation_m2_s3",
        &[("flow.kind", "\"eddies\"")],
        ["0.0", "1e-3"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.outer_scale_m",
        &[("flow.kind", "\"eddies\"")],
        ["60.0", "100.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.smallest_m",
        &[("flow.kind", "\"eddies\"")],
        ["2.0", "4.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.modes",
        &[("flow.kind", "\"eddies\"")],
        ["512", "600"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.evaluation",
        &[("flow.kind", "\"eddies\"")],
        ["\"levels\"", "\"all\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.kolmogorov_constant",
        &[("flow.kind", "\"eddies\"")],
        ["1.5", "1.521"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.ground",
        &[("flow.kind", "\"eddies\"")],
        ["\"open\"", "\"blocked\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.decorrelation",
        &[("flow.kind", "\"eddies\"")],
        ["\"none\"", "\"sweeping\""],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.realisations",
        &[("flow.kind", "\"eddies\""), ("scan.realisations", "2")],
        ["\"one\"", "\"each\""],
        "map",
        "v_mean_m_s",
    ),
    (
        "flow.carried_at_m",
        &[
            ("flow.kind", "\"eddies\""),
            ("added_flows", "[{ kind = \"wind\" }]"),
        ],
        ["10.0", "50.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "flow.aircraft",
        &[("flow.motion", "\"inviscid\"")],
        [
            "{ speed_m_s = 70.0, x_m = 200.0 }",
            "{ speed_m_s = 90.0, x_m = 200.0 }",
        ],
        "map",
        "v_exact_m_s",
    ),
    (
        "scan.lidar_height_m",
        &[],
        ["0.0", "5.0"],
        "map",
        "v_exact_m_s",
    ),
    (
        "scan.azimuth_rad",
        &[],
        ["1.0", "2.0"],
        "map",
        "azimuth_rad",
    ),
    ("scan.pulses_per_line", &[], ["2", "3"], "map", "level"),
    (
        "scan.second_trip",
        &[("laser.pulse_repetition_hz", "200e3")],
        ["", "{}"],
        "map",
        "v_mean_m_s",
    ),
    ("scan.head.sweeps", &[], ["1", "2"], "map", "sweep"),
    (
        "scan.head.dead_time_s",
        &[],
        ["0.0", "0.5"],
        "map",
        "time_s",
    ),
    (
        "scan.head.direction",
        &[("scan.head.sweeps", "2")],
        ["\"same\"", "\"alternate\""],
        "map",
        "elevation_rad",
    ),
    ("scan.lidar.y_m", &[], ["0.0", "30.0"], "map", "v_exact_m_s"),
    (
        "scan.lidar.velocity_m_s",
        &PPI,
        ["[0.0, 0.0, 0.0]", "[70.0, 0.0, 0.0]"],
        "map",
        "x_m",
    ),
    (
        "estimator.window_step_samples",
        &[],
        ["1", "3"],
        "map",
        "level",
    ),
    (
        "estimator.refinement",
        &[FIXED],
        ["\"parabola\"", "\"none\""],
        "map",
        "v_mean_m_s",
    ),
    (
        "estimator.false_alarm",
        &[],
        ["0.0", "0.1"],
        "map",
        "flagged",
    ),
    (
        "estimator.method.order",
        &[("estimator.method.kind", "\"autoregressive\"")],
        ["4", "8"],
        "map",
        "v_mean_m_s",
    ),
    (
        "estimator.method.moment_reach",
        &[("estimator.method.kind", "\"first_moment\"")],
        ["2.0", "3.5"],
        "map",
        "v_mean_m_s",
    ),
    (
        "estimator.method.likelihood_snr_db",
        &[("estimator.method.kind", "\"likelihood\"")],
        ["-10.0", "30.0"],
        "map",
        "v_mean_m_s",
    ),
    (
        "retrieval.turbulence",
        &RETRIEVED,
        ["\"none\"", "\"auto\""],
        "run",
        "gamma_std_m2_s",
    ),
];

fn small() -> Scene {
    let mut s = Scene::default();
    s.set("outputs.svg", false)
        .set("outputs.png", false)
        .set("outputs.netcdf", false)
        .set("outputs.flow", false);
    s.set("outputs.profile_points", 3)
        .set("outputs.profile_range_min_m", "200.0");
    s.number("scan.elevation_min_rad", 0.1)
        .number("scan.elevation_max_rad", 0.112)
        .number("scan.elevation_step_rad", 4e-3);
    s.number("scan.range_min_m", 300.0)
        .number("scan.range_max_m", 420.0);
    s.set("scan.pulses_per_line", 2)
        .set("scan.realisations", 1)
        .set("estimator.gate_step_samples", 20);
    s
}

/// A few keys of the list, those that the draw takes.
pub(crate) fn hold(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    for _ in 0..6 {
        let (key, needs, values, command, column) = r.pick(KEYS);
        let shown = values.map(|value| {
            let mut s = small();
            for (key, value) in needs {
                s.set(key, value);
            }
            if !value.is_empty() {
                s.set(key, value);
            }
            bench.write("k.toml", &s.text());
            let words: &[&str] = match command {
                "map" | "efficiency" | "run" => &[command, "k.toml", "--out", "k", "--overwrite"],
                _ => &[command, "k.toml"],
            };
            let ended = bench.run(words);
            ledger.holds(
                "every key, two values that run",
                ended.is_good,
                &format!("{key} = {value}: {}", ended.stderr),
            );
            let file = match command {
                "map" => "k/map.csv",
                "run" => "k/retrieval.csv",
                _ => "k/profile.csv",
            };
            if column.is_empty() {
                vec![ended.stdout]
            } else {
                bench.csv(ledger, file).words(column)
            }
        });
        ledger.holds(
            "every key changes what it should",
            shown[0] != shown[1] && !shown[0].is_empty(),
            &format!(
                "{key} = {} and {}: {command} {column} is the same",
                values[0], values[1]
            ),
        );
    }
    hold_seed(bench, ledger);
}

/// The seed of the command line draws other samples, and the file states it.
fn hold_seed(bench: &Bench, ledger: &mut Ledger) {
    let mut s = small();
    s.set("outputs.netcdf", true);
    bench.write("k.toml", &s.text());
    for (command, file, variable) in [
        ("map", "map.nc", "radial_velocity"),
        ("signal", "signals.nc", "current_a"),
    ] {
        let values = ["7", "8"].map(|seed| {
            let folder = format!("{command}{seed}");
            let words = [command, "k.toml", "--seed", seed, "--out", &folder];
            bench.must(ledger, &words)?;
            let mut nc = bench.netcdf(ledger, &format!("{folder}/{file}"));
            ledger.holds(
                "the seed of the command line",
                nc.text_of_file("seed") == seed,
                command,
            );
            Some(nc.f(variable))
        });
        ledger.holds(
            "the seed of the command line",
            values[0] != values[1],
            command,
        );
    }
}
