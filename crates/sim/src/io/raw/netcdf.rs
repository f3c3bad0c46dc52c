//! Raw signals in NetCDF: `signals.nc`, or a variable of one's own with the samples of a record running fastest. Those of classic files
//! are read piece by piece, those of NetCDF-4 at once.
//!
//! Check: signals of a run come back; constants of the recording that the scene contradicts are named.

use super::array::{ArrayInFile, Order, Parts};
use super::{About, RawFormat, Store, WholeRecords};
use crate::Error;
use crate::io::netcdf_input::{NetcdfFile, open};
use crate::io::number::ByteOrder;
use num_complex::Complex;
use std::path::Path;

/// Constants of a recording: the name of the variable, and the key of a scene that says the same.
const CONSTANTS: [(&str, &str); 6] = [
    ("sampling_frequency", "detector.sampling_hz"),
    ("intermediate_frequency", "detector.intermediate_frequency_hz"),
    ("bandwidth", "detector.bandwidth_hz"),
    ("wavelength", "laser.wavelength_m"),
    ("pulse_repetition_frequency", "laser.pulse_repetition_hz"),
    ("pulse_sigma", "pulse"),
];

/// Opens the signals of a file.
pub(super) fn read(path: &Path, format: &RawFormat) -> Result<(Store, About), Error> {
    let mut file = open(path)?;
    let found = signals(&mut file, format);
    found.map_err(|reason| file.refuse(reason))
}

fn signals(file: &mut NetcdfFile, format: &RawFormat) -> Result<(Store, About), String> {
    let name = match &format.variable {
        Some(name) => name.clone(),
        None if file.has("current_a") => "current_a".to_owned(),
        None => return Err("it has no variable current_a: --variable names the one that holds the samples".into()),
    };
    let mut shape = file.shape(&name).ok_or_else(|| format!("it has no variable {name}"))?;
    let second = match &format.quadrature {
        Some(name) => Some(name.clone()),
        None => (name == "current_a" && file.has("quadrature_a")).then(|| "quadrature_a".to_owned()),
    };
    let mut parts = Parts::Real;
    if let Some(second) = &second {
        if file.shape(second) != Some(shape.clone()) {
            return Err(format!("variable {second} has not the dimensions of {name}"));
        }
        parts = Parts::Apart(file.layout(second).ok_or("it has no second quadrature")?.begin);
    } else if format.complex && shape.last() == Some(&2) {
        shape.pop();
        parts = Parts::Together;
    }
    let (Some(samples), true) = (shape.pop(), shape.iter().all(|length| *length > 0)) else {
        return Err(format!("variable {name} has no dimension: records with samples are needed"));
    };
    let records = shape.iter().product::<u64>() as usize;
    if file.handle().is_err() {
        let whole = whole(file, &name, second.as_deref(), parts)?;
        let values = whole.into_iter().map(|value| value * format.scale).collect();
        let (samples, is_complex) = (samples as usize, parts != Parts::Real);
        let store = Store::Whole(WholeRecords { values, samples, is_complex });
        return Ok((store, about(file, records)?));
    }
    let layout = file.layout(&name).ok_or("it has no such variable")?;
    // The dimension that grows is the first; one record of the file must be one of the signals.
    if layout.stride.is_some() && shape.len() > 1 {
        return Err(format!("variable {name} grows along a dimension and has two more: nccopy -u makes it fixed"));
    }
    let (mut fills, scale, offset) = file.packing(&name);
    if fills.is_empty() {
        // What stands where nothing was written.
        fills.extend(layout.number.netcdf_fill());
    }
    let handle = file.handle().map_err(|e| e.to_string())?;
    let array = ArrayInFile {
        byte_order: ByteOrder::Big,
        parts,
        order: Order::LineMajor,
        begin: layout.begin,
        stride: layout.stride,
        fills,
        scale: scale * format.scale,
        offset: offset * format.scale,
        ..ArrayInFile::new(handle, layout.number, [records, samples as usize], (format, 1))
    };
    let about = about(file, records)?;
    Ok((Store::Array(array), about))
}

/// All samples of a file.
fn whole(file: &mut NetcdfFile, name: &str, second: Option<&str>, parts: Parts) -> Result<Vec<Complex<f64>>, String> {
    let numbers = file.floats(name)?;
    Ok(match (parts, second) {
        (Parts::Together, _) => numbers.chunks_exact(2).map(|pair| Complex::new(pair[0], pair[1])).collect(),
        (_, Some(second)) => {
            numbers.into_iter().zip(file.floats(second)?).map(|(re, im)| Complex::new(re, im)).collect()
        }
        (_, None) => numbers.into_iter().map(|re| Complex::new(re, 0.0)).collect(),
    })
}

fn about(file: &mut NetcdfFile, records: usize) -> Result<About, String> {
    let mut about = About { scene_toml: file.global_text("scene").map(str::to_owned), ..About::default() };
    let mut of_records = |names: [&str; 2]| -> Result<Option<Vec<f64>>, String> {
        let Some(name) = names.into_iter().find(|name| file.has(name)) else { return Ok(None) };
        let units = file.text(name, "units").unwrap_or_default().to_ascii_lowercase();
        let values = file.floats(name)?;
        let factor = if units.starts_with("deg") { 1f64.to_radians() } else { 1.0 };
        match values.len() == records {
            true => Ok(Some(values.into_iter().map(|value| value * factor).collect())),
            // A coordinate of the samples, such as time, is none of the records.
            false => Ok(None),
        }
    };
    about.elevation_rad = of_records(["elevation", "elevation_rad"])?;
    about.time_s = of_records(["pulse_time", "ray_time"])?;
    about.line = of_records(["ray_line", "line"])?;
    for (name, key) in CONSTANTS {
        if file.has(name)
            && let Some(value) = file.floats(name)?.first()
        {
            about.constants.push((name, key, *value));
        }
    }
    Ok(about)
}

#[cfg(test)]
#[cfg(feature = "netcdf4")]
mod tests {
    use super::super::{RawFormat, RawRecords, RecordShape};
    use crate::io::netcdf4_input::made::of_arrays;
    use num_complex::Complex;

    /// Lines with pulses with samples, and what stands beside them, as another program may have stored a `signals.nc` again.
    #[test]
    fn signals_in_netcdf4_are_those_of_the_array() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.nc");
        let numbers = |from: f64| (0..24).map(|i| from + f64::from(i)).collect::<Vec<f64>>();
        let real = ("current_a", &[2, 3, 4][..], numbers(0.5));
        let second = ("quadrature_a", &[2, 3, 4][..], numbers(100.0));
        let lines = ("ray_line", &[6][..], vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let open = |arrays: &[(&str, &[u64], Vec<f64>)], format: &RawFormat| {
            std::fs::write(&path, of_arrays(arrays)).unwrap();
            RawRecords::open(&path, format, RecordShape { samples: 4, pulses_per_line: 3 }).unwrap()
        };
        let twice = RawFormat { scale: 2.0, ..RawFormat::default() };
        let mut found = open(&[real.clone(), lines], &twice);
        assert_eq!((found.records(), found.samples(), found.is_complex()), (6, 4, false));
        assert_eq!(found.about.line, Some(vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]));
        let some = found.read_samples(1..3, 1..3).unwrap();
        assert_eq!(some, [5.5, 6.5, 9.5, 10.5].map(|re| Complex::new(2.0 * re, 0.0)));
        let mut found = open(&[real, second], &RawFormat::default());
        assert!(found.is_complex());
        assert_eq!(found.read(5..6).unwrap()[3], Complex::new(23.5, 123.0));
        let mut pairs = open(
            &[("volts", &[3, 4, 2], numbers(0.0))],
            &RawFormat { variable: Some("volts".into()), complex: true, ..RawFormat::default() },
        );
        assert_eq!((pairs.records(), pairs.read(1..2).unwrap()[0]), (3, Complex::new(8.0, 9.0)));
    }
}
