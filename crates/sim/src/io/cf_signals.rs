//! Raw heterodyne signals as CF NetCDF (classic): the current over (pulse, time after the pulse), with what an estimator
//! must know of the recording, and the true velocities that its results are to be held against.
//! Check: the tests read the bytes back and compare values, axes and units.

use super::netcdf::{Data, Layout, described};
use super::provenance::Provenance;
use super::signals::RawSignals;
use crate::Error;

/// The file's bytes.
///
/// # Errors
/// What [`RawSignals::check`] finds, or a result too large for one file.
pub fn cf_signals_bytes(
    signals: &RawSignals<'_>,
    provenance: &Provenance,
) -> Result<Vec<u8>, Error> {
    signals.check()?;
    let (records, samples) = signals.current_a.dim();
    let mut line_elevation_rad = Vec::new();
    for first in &signals.first_pulse {
        line_elevation_rad.extend(signals.elevation_rad.get(*first).copied());
    }
    let elevation_rad = repeated(&signals.elevation_rad, records);
    let pulse_time_s = repeated(&signals.pulse_time_s, records);
    let mut values = vec![
        ("time", Data::f64_slice(&signals.time_s)),
        ("elevation", Data::f64(elevation_rad)),
        ("pulse_time", Data::f64(pulse_time_s)),
        ("current_a", Data::f64(signals.current_a.iter().copied())),
        ("range", Data::f64_slice(&signals.range_m)),
        ("line_elevation", Data::f64(line_elevation_rad)),
        ("radial_velocity", Data::filled(signals.radial_velocity_m_s)),
    ];
    values.extend(record_numbers(signals, records));
    values.extend(recording_values(signals));
    if !signals.azimuth_rad.is_empty() {
        let azimuth_rad = repeated(&signals.azimuth_rad, records);
        values.push(("azimuth", Data::f64(azimuth_rad)));
    }
    if let Some(second) = signals.quadrature_a {
        values.push(("quadrature_a", Data::f64(second.iter().copied())));
    }
    let (lines, ranges) = signals.radial_velocity_m_s.dim();
    let dims = vec![
        ("ray", records),
        ("time", samples),
        ("line", lines),
        ("range", ranges),
    ];
    let variables = described(include_str!("cf_signals.cdl"), values);
    Layout::cf("Raw heterodyne signals", dims, variables, provenance).into_bytes(provenance)
}

/// The line, the pulse of the line and the realisation of each record.
fn record_numbers(signals: &RawSignals<'_>, records: usize) -> [(&'static str, Data); 4] {
    let pulses = signals.elevation_rad.len().max(1);
    let mut record_numbers = Vec::with_capacity(records);
    let mut lines = Vec::with_capacity(records);
    let mut pulses_of_lines = Vec::with_capacity(records);
    let mut realisations = Vec::with_capacity(records);
    for record in 0..records {
        let pulse = record % pulses;
        let begun = signals.first_pulse.partition_point(|first| *first <= pulse);
        let line = begun.saturating_sub(1);
        let first = signals.first_pulse.get(line).copied().unwrap_or(0);
        record_numbers.push(stored_number(record));
        lines.push(stored_number(line));
        pulses_of_lines.push(stored_number(pulse - first));
        realisations.push(stored_number(record / pulses));
    }
    [
        ("ray", Data::i32(record_numbers)),
        ("ray_line", Data::i32(lines)),
        ("ray_pulse", Data::i32(pulses_of_lines)),
        ("realization", Data::i32(realisations)),
    ]
}

/// How the signals were recorded.
fn recording_values(signals: &RawSignals<'_>) -> [(&'static str, Data); 7] {
    [
        ("sampling_frequency", signals.sampling_hz),
        ("intermediate_frequency", signals.intermediate_frequency_hz),
        ("bandwidth", signals.bandwidth_hz),
        ("wavelength", signals.wavelength_m),
        ("pulse_repetition_frequency", signals.pulse_repetition_hz),
        ("pulse_sigma", signals.pulse_sigma_s),
        ("noise_power", signals.noise_power_a2),
    ]
    .map(|(name, value)| (name, Data::f64([value])))
}

/// A whole number as the format stores it; the largest one where it is larger.
fn stored_number(number: usize) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX)
}

/// Values of the pulses of one realisation for all records.
fn repeated(values: &[f64], records: usize) -> Vec<f64> {
    let mut all = Vec::with_capacity(records);
    for record in 0..records {
        all.push(values[record % values.len()]);
    }
    all
}

/// Bytes of data in the file for these numbers of pulses, of samples of one or two quadratures, and of lines and their
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
