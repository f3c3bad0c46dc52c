//! One quantity in two files, and what files say of themselves: signals, maps as NetCDF and CSV.

use super::air::{radial_m_s, start_s, velocity_m_s};
use super::eddies::Eddies;
use super::geometry::{Scan, line_time_s};
use super::ledger::Ledger;
use super::power::Pulse;
use super::program::{Bench, Csv};
use super::scene::{C_M_S, Scene};

/// signals.nc beside its scene; a plain RHI of which the first realisation is kept.
pub(crate) fn hold_signals(
    ledger: &mut Ledger,
    bench: &Bench,
    s: &Scene,
    scan: &Scan,
    start_s: f64,
) {
    let mut nc = bench.netcdf(ledger, "o/signals.nc");
    let is_baseband = s.s("detector.signal") == "baseband";
    let fc = if is_baseband {
        0.0
    } else {
        s.f("detector.intermediate_frequency_hz")
    };
    let mut one = |ledger: &mut Ledger, name: &str, right: f64| {
        let found = nc.f(name).first().copied().unwrap_or(f64::NAN);
        ledger.equal(
            &format!("signals.nc: {name}"),
            found,
            right,
            1e-9 * right.abs(),
        );
    };
    one(ledger, "sampling_frequency", s.f("detector.sampling_hz"));
    one(ledger, "intermediate_frequency", fc);
    one(ledger, "bandwidth", s.f("detector.bandwidth_hz"));
    one(
        ledger,
        "pulse_repetition_frequency",
        s.f("laser.pulse_repetition_hz"),
    );
    one(ledger, "wavelength", s.f("laser.wavelength_m"));
    if let Some(pulse) = Pulse::gaussian(s) {
        one(ledger, "pulse_sigma", pulse.sigma_s);
    }
    let samples = scan.sample_m.len();
    let time = nc.f("time");
    for (k, &r) in scan.sample_m.iter().enumerate().step_by(1 + samples / 20) {
        ledger.equal("signals.nc: time", time[k], 2.0 * r / C_M_S, 1e-14);
    }
    let lists = [
        "ray",
        "ray_line",
        "ray_pulse",
        "realization",
        "elevation",
        "pulse_time",
    ]
    .map(|name| nc.f(name));
    for ray in 0..lists[0].len() {
        let (line, pulse) = (ray / scan.pulses, ray % scan.pulses);
        let shot_s = start_s + ray as f64 / s.f("laser.pulse_repetition_hz");
        let right = [
            ray as f64,
            line as f64,
            pulse as f64,
            0.0,
            scan.elevation_rad[line],
            shot_s,
        ];
        let names = [
            "ray",
            "ray_line",
            "ray_pulse",
            "realization",
            "elevation",
            "pulse_time",
        ];
        for ((name, list), right) in names.iter().zip(&lists).zip(right) {
            ledger.equal(&format!("signals.nc: {name}"), list[ray], right, 1e-9);
        }
    }
    let (range, velocity, elevation) = (
        nc.f("range"),
        nc.f("radial_velocity"),
        nc.f("line_elevation"),
    );
    let turbulent_m_s = Eddies::of(s).map_or(0.0, |eddies| 6.0 * eddies.deviation_m_s());
    for line in 0..elevation.len() {
        ledger.equal(
            "signals.nc: line_elevation",
            elevation[line],
            scan.elevation_rad[line],
            1e-12,
        );
        let reach_m = 4.0 * Pulse::gaussian(s).map_or(0.0, |pulse| pulse.scale_m());
        ledger.holds(
            "signals.nc: range",
            range[0] < scan.sample_m[0]
                && range[range.len() - 1] > scan.sample_m[samples - 1] + 0.5 * reach_m,
            "layers end before the pulse does",
        );
        // The path of a pair that meanders depends on the waves.
        if s.is_true("flow.meander") {
            continue;
        }
        for l in (0..range.len()).step_by(1 + range.len() / 10) {
            let right = radial_m_s(s, scan.elevation_rad[line], line_time_s(s, line), range[l]);
            ledger.equal(
                "signals.nc: radial_velocity",
                velocity[line * range.len() + l],
                right,
                1e-6 * right.abs().max(1.0) + turbulent_m_s,
            );
        }
    }
    let values = scan.elevation_rad.len() * scan.pulses * samples;
    for (name, count) in [
        ("current_a", values),
        ("quadrature_a", if is_baseband { values } else { 0 }),
    ] {
        let found = nc.f(name).len();
        ledger.equal(
            &format!("signals.nc: {name}, values"),
            found as f64,
            count as f64,
            0.0,
        );
    }
}

/// map.nc beside map.csv, and what it says of the instrument.
pub(crate) fn hold_map(ledger: &mut Ledger, bench: &Bench, s: &Scene, scan: &Scan, map: &Csv) {
    let mut nc = bench.netcdf(ledger, "o/map.nc");
    let (lines, gates) = (scan.elevation_rad.len(), scan.gate_m.len());
    for variable in nc.names() {
        let column = match variable.as_str() {
            "radial_velocity" => "v_mean_m_s".into(),
            "velocity_standard_deviation" => "std_m_s".into(),
            "signal_to_noise_ratio" => "snr_db".into(),
            other => [format!("{other}_m_s"), other.into()]
                .into_iter()
                .find(|name| map.has(name))
                .unwrap_or_default(),
        };
        let (values, right) = (nc.f(&variable), map.f(&column));
        if map.has(&column) && values.len() == lines * gates {
            for i in 0..values.len() {
                // Floats of 32 bits.
                ledger.equal(
                    &format!("map.nc: {variable}"),
                    values[i],
                    right[i],
                    2e-7 * right[i].abs() + 1e-30,
                );
            }
        }
    }
    ledger.equal("map.nc: sweep_number", nc.f("sweep_number")[0], 0.0, 0.0);
    ledger.equal(
        "map.nc: sweep_start_ray_index",
        nc.f("sweep_start_ray_index")[0],
        0.0,
        0.0,
    );
    ledger.equal(
        "map.nc: sweep_end_ray_index",
        nc.f("sweep_end_ray_index")[0],
        lines as f64 - 1.0,
        0.0,
    );
    let mut list =
        |ledger: &mut Ledger, name: &str, right: &dyn Fn(usize) -> f64, tolerance: f64| {
            for (i, found) in nc.f(name).into_iter().enumerate() {
                ledger.equal(&format!("map.nc: {name}"), found, right(i), tolerance);
            }
        };
    let time = map.f("time_s");
    let degrees = |rad: f64| rad.to_degrees().rem_euclid(360.0);
    list(ledger, "time", &|i| time[i * gates], 1e-9);
    list(ledger, "range", &|i| scan.gate_m[i], 1e-3);
    list(
        ledger,
        "elevation",
        &|i| scan.elevation_rad[i].to_degrees(),
        1e-5,
    );
    list(
        ledger,
        "azimuth",
        &|_| degrees(s.f("scan.azimuth_rad")),
        1e-4,
    );
    list(
        ledger,
        "fixed_angle",
        &|_| degrees(s.f("scan.azimuth_rad")),
        1e-4,
    );
    list(ledger, "wake_age", &|_| map.f("tau")[0], 1e-6);
    list(
        ledger,
        "altitude",
        &|_| s.f("site.altitude_m") + s.f("scan.lidar_height_m"),
        1e-6,
    );
    let lambda = s.f("laser.wavelength_m");
    let prt = 1.0 / s.f("laser.pulse_repetition_hz");
    list(ledger, "prt", &|_| prt, 1e-6 * prt);
    list(
        ledger,
        "frequency",
        &|_| C_M_S / lambda,
        1e-6 * C_M_S / lambda,
    );
    list(ledger, "n_samples", &|_| scan.pulses as f64, 0.0);
    if let Some(pulse) = Pulse::gaussian(s) {
        // Readers take it as full width at half maximum, whatever the scene states.
        list(
            ledger,
            "pulse_width",
            &|_| pulse.fwhm_s(),
            1e-5 * pulse.fwhm_s(),
        );
    }
    // The largest speed of either sign that does not fold: a real current folds at 0 and at half the sampling frequency.
    let (fc, fs) = (
        s.f("detector.intermediate_frequency_hz"),
        s.f("detector.sampling_hz"),
    );
    let is_baseband = s.s("detector.signal") == "baseband";
    let free_hz = if is_baseband {
        0.5 * fs
    } else {
        fc.min(0.5 * fs - fc)
    };
    let nyquist = 0.5 * lambda * free_hz;
    list(ledger, "nyquist_velocity", &|_| nyquist, 1e-5 * nyquist);
    // The telescope stands x_m north (+x is north where nothing else is said) and y_m east of the site.
    let (x, y) = (s.f("scan.lidar.x_m"), s.f("scan.lidar.y_m"));
    let (site_deg, earth_m) = (s.f("site.latitude_deg"), 6_371_000.0);
    list(
        ledger,
        "latitude",
        &|_| site_deg + (x / earth_m).to_degrees(),
        5e-3 * (x / earth_m).to_degrees().abs() + 1e-7,
    );
    let east_deg = (y / (earth_m * site_deg.to_radians().cos())).to_degrees();
    list(
        ledger,
        "longitude",
        &|_| s.f("site.longitude_deg") + east_deg,
        5e-3 * east_deg.abs() + 1e-7,
    );
}

/// flow.csv beside the closed form of the wind, and flow.nc beside it.
pub(crate) fn hold_flow(ledger: &mut Ledger, bench: &Bench, s: &Scene) {
    if !bench.folder.join("o/flow.csv").exists() {
        return;
    }
    let (csv, mut nc) = (
        bench.csv(ledger, "o/flow.csv"),
        bench.netcdf(ledger, "o/flow.nc"),
    );
    let f = |name: &str| csv.f(name);
    let (tau, time, y, z, v, w) = (
        f("tau"),
        f("time_s"),
        f("y_m"),
        f("z_m"),
        f("v_m_s"),
        f("w_m_s"),
    );
    let lists = ["v", "w"].map(|name| nc.f(name));
    let axes = ["y", "z"].map(|name| nc.f(name));
    let age = if s.s("flow.kind") == "vortex_pair" {
        s.f("flow.age_tau")
    } else {
        0.0
    };
    ledger.equal("flow.nc: tau", nc.f("tau")[0], age, 1e-12);
    ledger.equal("flow.nc: time", nc.f("time")[0], start_s(s), 1e-9);
    let eddies = Eddies::of(s);
    for row in (0..csv.len()).step_by(1 + csv.len() / 60) {
        ledger.equal("flow.csv: tau", tau[row], age, 1e-12);
        ledger.equal("flow.csv: time_s", time[row], start_s(s), 1e-9);
        let columns = axes[0].len();
        ledger.equal("flow.nc: y", axes[0][row % columns], y[row], 0.0);
        ledger.equal("flow.nc: z", axes[1][row / columns], z[row], 0.0);
        ledger.equal("flow.csv: y_m", y[row], axes[0][row % columns], 0.0);
        ledger.equal("flow.csv: z_m", z[row], axes[1][row / columns], 0.0);
        let u = velocity_m_s(s, [0.0, y[row], z[row]], 0.0);
        for (name, list, column, right) in [("v", &lists[0], &v, u[1]), ("w", &lists[1], &w, u[2])]
        {
            let number = format!("flow.csv: {name}_m_s");
            // Where no air crosses the ground, turbulence neither does.
            let is_still = name == "w" && z[row] == 0.0;
            match eddies
                .as_ref()
                .filter(|eddies| !(eddies.is_blocked && is_still))
            {
                None => {
                    let of_path = if s.path().is_some() { 1e-5 } else { 1e-10 };
                    let tolerance = of_path * right.abs().max(1.0);
                    ledger.equal(&number, column[row], right, tolerance);
                }
                // Turbulence moves the pair too.
                Some(_) if s.is_true("flow.meander") => {}
                Some(eddies) => {
                    let number = format!("{number}, in turbulence");
                    let tolerance = 6.0 * eddies.deviation_m_s();
                    ledger.equal(&number, column[row], right, tolerance);
                }
            }
            ledger.equal(
                &format!("flow.nc: {name}"),
                list[row],
                column[row],
                2e-7 * column[row].abs() + 1e-30,
            );
        }
    }
}
