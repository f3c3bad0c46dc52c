//! Cross-planes of the wind as a NumPy archive: `numpy.load(f, allow_pickle=False)`.
//! Keys are the names of the table's columns; axes are 1-D, fields `[tau, z, y]` in f64; provenance as UTF-8 bytes
//! (`bytes(f["scene"]).decode()`). The time of each plane is `plane_time_s`, since `tau` is the axis.
//! Check: a test reads the archive back.

use super::error::{OutputError, OutputResult};
use super::map::CrossPlanes;
use super::provenance::Provenance;
use ndarray::aview1;
use ndarray_npy::NpzWriter;
use std::io::Cursor;

/// The file's bytes.
///
/// # Errors
/// What [`CrossPlanes::check`] finds, or a refusal of the encoder.
pub fn npz_bytes(planes: &CrossPlanes, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    planes.check()?;
    let refuse = |e: ndarray_npy::WriteNpzError| OutputError::encode("NPZ", e);
    let mut file = NpzWriter::new(Cursor::new(Vec::new()));
    let axes = [("tau", &planes.tau), ("z_m", &planes.z_m), ("y_m", &planes.y_m), ("plane_time_s", &planes.time_s)];
    for (name, values) in axes {
        file.add_array(name, &aview1(values)).map_err(refuse)?;
    }
    // Standard layout, so that a transposed view is not written in Fortran order.
    for (name, values) in [("v_m_s", &planes.v_m_s), ("w_m_s", &planes.w_m_s)] {
        file.add_array(name, &values.as_standard_layout()).map_err(refuse)?;
    }
    for (name, text) in provenance.entries() {
        file.add_array(name, &aview1(text.as_bytes())).map_err(refuse)?;
    }
    Ok(file.finish().map_err(refuse)?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::super::samples;
    use super::*;
    use ndarray::{Array1, Array3};
    use ndarray_npy::NpzReader;

    #[test]
    fn arrays_read_back_with_their_shapes() {
        let planes = samples::planes();
        let bytes = npz_bytes(&planes, &example()).unwrap();
        assert_eq!(bytes, npz_bytes(&planes, &example()).unwrap(), "no clock");
        let mut file = NpzReader::new(Cursor::new(bytes)).unwrap();
        let w: Array3<f64> = file.by_name("w_m_s").unwrap();
        assert_eq!(w, planes.w_m_s);
        let y: Array1<f64> = file.by_name("y_m").unwrap();
        assert_eq!(y.to_vec(), planes.y_m);
        let seed: Array1<u8> = file.by_name("seed").unwrap();
        assert_eq!(seed.to_vec(), u64::MAX.to_string().into_bytes());
    }
}
