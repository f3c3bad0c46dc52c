//! Raw heterodyne signals as CF NetCDF (classic): the current over (pulse, time after the pulse).
//! Check: the tests read the bytes back and compare values and axes.

use super::error::OutputResult;
use super::netcdf::{Data, Layout, Variable};
use super::provenance::Provenance;
use super::signals::RawSignals;

/// The file's bytes.
///
/// # Errors
/// What [`RawSignals::check`] finds, or a result too large for one file.
pub fn cf_signals_bytes(signals: &RawSignals, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    signals.check()?;
    let (rays, samples) = signals.current_a.dim();
    let ray_numbers: Vec<i32> = (0..rays as i32).collect();
    let mut variables = vec![
        Variable::new("ray", &["ray"], Data::I32(ray_numbers))
            .text("long_name", "number of the pulse")
            .text("units", "1"),
        Variable::new("time", &["time"], Data::F64(signals.time_s.clone()))
            .text("long_name", "time after the middle of the pulse left the telescope")
            .text("units", "s"),
        Variable::new("elevation", &["ray"], Data::F64(signals.elevation_rad.clone()))
            .text("long_name", "elevation of the line of sight above the horizon")
            .text("units", "rad"),
        Variable::new("current_a", &["ray", "time"], Data::F64(signals.current_a.iter().copied().collect()))
            .text("long_name", "heterodyne current of the detector")
            .text("units", "A"),
    ];
    if let Some(quadrature) = &signals.quadrature_a {
        let values = Data::F64(quadrature.iter().copied().collect());
        let text = "second quadrature of the baseband signal; the first is current_a";
        variables
            .push(Variable::new("quadrature_a", &["ray", "time"], values).text("long_name", text).text("units", "A"));
    }
    let globals = vec![("Conventions", "CF-1.10".to_owned()), ("title", "Raw heterodyne signals".to_owned())];
    Layout { dims: vec![("ray", rays), ("time", samples)], globals, variables }.to_bytes(provenance)
}
