//! Raw heterodyne signals as CF NetCDF (classic): the current over (pulse, time after the pulse), with what an estimator
//! must know of the recording, and the true velocities that its results are to be held against.
//! Check: the tests read the bytes back and compare values, axes and units.

use super::error::OutputResult;
use super::netcdf::{Data, FILL, Layout, Variable};
use super::provenance::Provenance;
use super::signals::RawSignals;

/// The file's bytes.
///
/// # Errors
/// What [`RawSignals::check`] finds, or a result too large for one file.
pub fn cf_signals_bytes(signals: &RawSignals<'_>, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    signals.check()?;
    let (rays, samples) = signals.current_a.dim();
    let time = Variable::new("time", &["time"], Data::f64(signals.time_s.clone())).text("units", "s");
    let time = time.named(["time", "time after the middle of the pulse left the telescope", ""]);
    let mut variables = vec![time];
    variables.extend(of_rays(signals, rays));
    let second = "second quadrature of the baseband signal; the first is current_a";
    let currents = [
        ("current_a", Some(&signals.current_a), "heterodyne current of the detector"),
        ("quadrature_a", signals.quadrature_a.as_ref(), second),
    ];
    variables.extend(currents.into_iter().filter_map(|(name, values, text)| {
        Some(Variable::in_units(name, &["ray", "time"], Data::f64(values?.iter().copied()), "A", text))
    }));
    variables.extend(recording(signals));
    variables.extend(truth(signals));
    let (lines, ranges) = signals.radial_velocity_m_s.dim();
    let dims = vec![("ray", rays), ("time", samples), ("line", lines), ("range", ranges)];
    Layout::cf("Raw heterodyne signals", dims, variables, provenance).into_bytes(provenance)
}

/// Bytes of data that the file has with so many pulses of so many samples, of one or two quadratures, and lines of so many
/// ranges.
pub(crate) fn data_bytes([pulses, samples, quadratures]: [f64; 3], [lines, ranges]: [f64; 2]) -> f64 {
    8.0 * pulses * samples * quadratures + 28.0 * pulses + 4.0 * lines * ranges
}

/// Which line, pulse and realisation each record belongs to.
fn of_rays(signals: &RawSignals<'_>, rays: usize) -> Vec<Variable> {
    let scan = signals.elevation_rad.len().max(1);
    let line_of = |ray: usize| signals.first_pulse.partition_point(|first| *first <= ray % scan).saturating_sub(1);
    let before = |ray: usize| signals.first_pulse.get(line_of(ray)).copied().unwrap_or(0);
    let number = |name: &str, of: &dyn Fn(usize) -> usize, text: &str| {
        let values = (0..rays).map(|ray| i32::try_from(of(ray)).unwrap_or(i32::MAX));
        Variable::in_units(name, &["ray"], Data::i32(values), "1", text)
    };
    let value = |name: &str, of: &[f64], units: &str, text: &str| {
        let values = (0..rays).map(|ray| of[ray % scan]);
        Variable::in_units(name, &["ray"], Data::f64(values), units, text)
    };
    let azimuth = (!signals.azimuth_rad.is_empty())
        .then(|| value("azimuth", &signals.azimuth_rad, "rad", "azimuth of the line of sight, clockwise from north"));
    let mut out = vec![
        number("ray", &|ray| ray, "number of the record"),
        number("ray_line", &line_of, "line of sight of the pulse, a place along dimension line"),
        number("ray_pulse", &|ray| ray % scan - before(ray), "number of the pulse on its line of sight"),
        number("realization", &|ray| ray / scan, "number of the repetition of the scan")
            .text("standard_name", "realization"),
        value("elevation", &signals.elevation_rad, "rad", "elevation of the line of sight above the horizon"),
        value("pulse_time", &signals.pulse_time_s, "s", "time of the pulse from the start of the flow"),
    ];
    out.extend(azimuth);
    out
}

fn recording(signals: &RawSignals<'_>) -> Vec<Variable> {
    let r = &signals.recording;
    let at_rest = "frequency of air at rest; a velocity v away from the lidar lowers it by 2 v/wavelength";
    let scalars = [
        ("sampling_frequency", r.sampling_hz, "Hz", "sampling frequency"),
        ("intermediate_frequency", r.intermediate_frequency_hz, "Hz", at_rest),
        ("bandwidth", r.bandwidth_hz, "Hz", "width of the detector band about the intermediate frequency"),
        ("wavelength", r.wavelength_m, "m", "wavelength of the laser"),
        ("pulse_repetition_frequency", r.pulse_repetition_hz, "Hz", "pulses per second"),
        ("pulse_sigma", r.pulse_sigma_s, "s", "half width of the power of the pulse at 1/e of its largest"),
        ("noise_power", r.noise_power_a2, "A2", "mean square of the shot noise of a sample, both quadratures together"),
    ];
    let scalar = |(name, value, units, text)| {
        let variable = Variable::in_units(name, &[], Data::f64([value]), units, text);
        if name == "wavelength" { variable.text("standard_name", "radiation_wavelength") } else { variable }
    };
    scalars.into_iter().map(scalar).collect()
}

fn truth(signals: &RawSignals<'_>) -> Vec<Variable> {
    let above_horizon = "elevation of the line of sight above the horizon";
    let range = Data::f64(signals.range_m.clone());
    let elevation = signals.first_pulse.iter().filter_map(|first| signals.elevation_rad.get(*first));
    vec![
        Variable::in_units("range", &["range"], range, "m", "range of the true velocities"),
        Variable::in_units("line_elevation", &["line"], Data::f64(elevation.copied()), "rad", above_horizon),
        Variable::new("radial_velocity", &["line", "range"], Data::filled(signals.radial_velocity_m_s))
            .text("units", "m s-1")
            .text("standard_name", "radial_velocity_of_scatterers_away_from_instrument")
            .text("long_name", "true radial velocity of the air on the line of sight, positive away from the lidar")
            .attr("_FillValue", Data::f32([FILL])),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::super::signals;
    use super::*;
    use netcdf3::FileReader;

    fn reopened(signals: &RawSignals<'_>) -> (tempfile::TempDir, FileReader) {
        let temp = tempfile::tempdir().unwrap();
        let path = temp.path().join("signals.nc");
        std::fs::write(&path, cf_signals_bytes(signals, &example()).unwrap()).unwrap();
        let file = FileReader::open(&path).unwrap();
        (temp, file)
    }

    #[test]
    fn all_that_an_estimator_needs_is_in_the_file() {
        let signals = signals::example();
        let (_temp, mut file) = reopened(&signals);
        for (name, value, units) in [
            ("sampling_frequency", 1e6, "Hz"),
            ("intermediate_frequency", 8e5, "Hz"),
            ("bandwidth", 5e5, "Hz"),
            ("wavelength", 1.5e-6, "m"),
            ("pulse_repetition_frequency", 400.0, "Hz"),
            ("pulse_sigma", 1.2e-7, "s"),
            ("noise_power", 3e-13, "A2"),
        ] {
            assert_eq!(file.read_var_f64(name).unwrap(), [value], "{name}");
            assert_eq!(file.data_set().get_var_attr_as_string(name, "units").as_deref(), Some(units), "{name}");
        }
        assert!(file.data_set().get_global_attr_as_string("history").is_some());
        assert_eq!(file.read_var_f32("radial_velocity").unwrap(), [1.5, -2.5, FILL, 0.5]);
        assert_eq!(file.read_var_f64("range").unwrap(), [100.0, 130.0]);
        assert_eq!(file.read_var_f64("line_elevation").unwrap(), [0.0, 0.1]);
        assert_eq!(file.data_set().get_var("radial_velocity").unwrap().dim_names(), ["line", "range"]);
    }

    #[test]
    fn records_know_their_line_pulse_and_realisation() {
        let signals = signals::example();
        let (_temp, mut file) = reopened(&signals);
        assert_eq!(file.read_var_i32("ray_line").unwrap(), [0, 0, 1, 1, 0, 0, 1, 1]);
        assert_eq!(file.read_var_i32("ray_pulse").unwrap(), [0, 1, 0, 1, 0, 1, 0, 1]);
        assert_eq!(file.read_var_i32("realization").unwrap(), [0, 0, 0, 0, 1, 1, 1, 1]);
        let times = file.read_var_f64("pulse_time").unwrap();
        assert_eq!((times.len(), times[5]), (8, signals.pulse_time_s[1]));
        let current = file.read_var_f64("current_a").unwrap();
        assert_eq!(current, signals.current_a.iter().copied().collect::<Vec<_>>());
    }
}
