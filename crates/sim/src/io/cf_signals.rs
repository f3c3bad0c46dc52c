//! Raw heterodyne signals as CF NetCDF (classic): the current over (pulse, time after the pulse), with what an estimator
//! must know of the recording, and the true velocities that its results are to be held against.
//! Check: the tests read the bytes back and compare values, axes and units.

use super::error::OutputResult;
use super::netcdf::{Data, Layout, described};
use super::provenance::Provenance;
use super::signals::RawSignals;

/// The file's bytes.
///
/// # Errors
/// What [`RawSignals::check`] finds, or a result too large for one file.
pub fn cf_signals_bytes(
    signals: &RawSignals<'_>,
    provenance: &Provenance,
) -> OutputResult<Vec<u8>> {
    signals.check()?;
    let (rays, samples) = signals.current_a.dim();
    // Which line, pulse and realisation each record belongs to.
    let scan = signals.elevation_rad.len().max(1);
    let line_of = |ray: usize| {
        signals
            .first_pulse
            .partition_point(|first| *first <= ray % scan)
            .saturating_sub(1)
    };
    let before = |ray: usize| signals.first_pulse.get(line_of(ray)).copied().unwrap_or(0);
    let number = |of: &dyn Fn(usize) -> usize| {
        Data::i32((0..rays).map(|ray| i32::try_from(of(ray)).unwrap_or(i32::MAX)))
    };
    let value = |of: &[f64]| Data::f64((0..rays).map(|ray| of[ray % scan]));
    let elevation = signals
        .first_pulse
        .iter()
        .filter_map(|first| signals.elevation_rad.get(*first));
    let r = &signals.recording;
    let mut values = vec![
        ("time", Data::f64(signals.time_s.iter().copied())),
        ("ray", number(&|ray| ray)),
        ("ray_line", number(&line_of)),
        ("ray_pulse", number(&|ray| ray % scan - before(ray))),
        ("realization", number(&|ray| ray / scan)),
        ("elevation", value(&signals.elevation_rad)),
        ("pulse_time", value(&signals.pulse_time_s)),
        ("current_a", Data::f64(signals.current_a.iter().copied())),
        ("sampling_frequency", Data::f64([r.sampling_hz])),
        (
            "intermediate_frequency",
            Data::f64([r.intermediate_frequency_hz]),
        ),
        ("bandwidth", Data::f64([r.bandwidth_hz])),
        ("wavelength", Data::f64([r.wavelength_m])),
        (
            "pulse_repetition_frequency",
            Data::f64([r.pulse_repetition_hz]),
        ),
        ("pulse_sigma", Data::f64([r.pulse_sigma_s])),
        ("noise_power", Data::f64([r.noise_power_a2])),
        ("range", Data::f64(signals.range_m.iter().copied())),
        ("line_elevation", Data::f64(elevation.copied())),
        ("radial_velocity", Data::filled(signals.radial_velocity_m_s)),
    ];
    if !signals.azimuth_rad.is_empty() {
        values.push(("azimuth", value(&signals.azimuth_rad)));
    }
    values.extend(
        signals
            .quadrature_a
            .map(|second| ("quadrature_a", Data::f64(second.iter().copied()))),
    );
    let (lines, ranges) = signals.radial_velocity_m_s.dim();
    let dims = vec![
        ("ray", rays),
        ("time", samples),
        ("line", lines),
        ("range", ranges),
    ];
    let variables = described(include_str!("cf_signals.cdl"), values);
    Layout::cf("Raw heterodyne signals", dims, variables, provenance).into_bytes(provenance)
}

/// Bytes of data that the file has with so many pulses of so many samples, of one or two quadratures, and lines of so many
/// ranges.
pub(crate) fn data_bytes(
    [pulses, samples, quadratures]: [f64; 3],
    [lines, ranges]: [f64; 2],
) -> f64 {
    8.0 * pulses * samples * quadratures + 28.0 * pulses + 4.0 * lines * ranges
}

#[cfg(test)]
mod tests {
    use super::super::netcdf::FILL;
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
            assert_eq!(
                file.data_set()
                    .get_var_attr_as_string(name, "units")
                    .as_deref(),
                Some(units),
                "{name}"
            );
        }
        assert!(
            file.data_set()
                .get_global_attr_as_string("history")
                .is_some()
        );
        assert_eq!(
            file.read_var_f32("radial_velocity").unwrap(),
            [1.5, -2.5, FILL, 0.5]
        );
        assert_eq!(file.read_var_f64("range").unwrap(), [100.0, 130.0]);
        assert_eq!(file.read_var_f64("line_elevation").unwrap(), [0.0, 0.1]);
        assert_eq!(
            file.data_set()
                .get_var("radial_velocity")
                .unwrap()
                .dim_names(),
            ["line", "range"]
        );
    }

    #[test]
    fn records_know_their_line_pulse_and_realisation() {
        let signals = signals::example();
        let (_temp, mut file) = reopened(&signals);
        assert_eq!(
            file.read_var_i32("ray_line").unwrap(),
            [0, 0, 1, 1, 0, 0, 1, 1]
        );
        assert_eq!(
            file.read_var_i32("ray_pulse").unwrap(),
            [0, 1, 0, 1, 0, 1, 0, 1]
        );
        assert_eq!(
            file.read_var_i32("realization").unwrap(),
            [0, 0, 0, 0, 1, 1, 1, 1]
        );
        let times = file.read_var_f64("pulse_time").unwrap();
        assert_eq!((times.len(), times[5]), (8, signals.pulse_time_s[1]));
        let current = file.read_var_f64("current_a").unwrap();
        assert_eq!(
            current,
            signals.current_a.iter().copied().collect::<Vec<_>>()
        );
    }
}
