//! For tests: the decaying vortices of Taylor and Green in a plane, `v = sin(2 pi y) cos(2 pi z) exp(-8 pi^2 nu t)` on the unit
//! square, as a flow that starts from a file.

use super::CaseFile;
use crate::io::Provenance;
use crate::io::cf_fields::{FaceVelocities, cf_faces_parts};
use tempfile::TempDir;
use wakescope_les::cases::taylor_green_plane_exact;

/// Nodes of the file along y and z: its cubics are far more accurate than the meshes of the tests.
const NODES: usize = 128;

/// A new folder with the initial field.
pub(crate) fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |offset: f64| -> Vec<f64> {
        let position = |i| (i as f64 + offset) / NODES as f64;
        (0..NODES).map(position).collect()
    };
    let face_m = at(0.0);
    let centre_m = at(0.5);
    let velocity = |component: usize, y_m: &[f64], z_m: &[f64]| -> Vec<f64> {
        let row = |z| {
            let value = move |y| taylor_green_plane_exact([0.0, y, z], 0.0, 0.0)[component];
            y_m.iter().copied().map(value)
        };
        z_m.iter().copied().flat_map(row).collect()
    };
    let field = FaceVelocities {
        title: "Vortices of Taylor and Green in a plane".into(),
        time_s: 0.0,
        velocity_m_s: [
            vec![0.0; NODES * NODES],
            velocity(1, &face_m, &centre_m),
            velocity(2, &centre_m, &face_m),
        ],
        centre_m: [vec![0.5], centre_m.clone(), centre_m],
        face_m: [vec![0.0], face_m.clone(), face_m],
        planes: 0..NODES,
    };
    let origin = Provenance::new("", "", 0);
    let bytes = cf_faces_parts(&field, &origin).unwrap().into_bytes();
    std::fs::write(folder.path().join("vortices.nc"), bytes).unwrap();
    folder
}

/// The flow on `cells` x `cells`, with the further sections of the case.
pub(crate) fn case(
    folder: &TempDir,
    cells: usize,
    viscosity_m2_s: f64,
    sections: &str,
) -> CaseFile {
    let axis = format!(
        "{{ cells = {cells}, low_end = \"periodic\", high_end = \"periodic\", low_m = 0.0, high_m = 1.0 }}"
    );
    let text = format!(
        "[case]\nkind = \"free\"\nviscosity_m2_s = {viscosity_m2_s:?}\ny = {axis}\nz = {axis}\n\
             initial = {{ kind = \"netcdf\", path = \"vortices.nc\" }}\n{sections}"
    );
    parse(folder, &text)
}

/// A case file that lies beside the field.
pub(crate) fn parse(folder: &TempDir, text: &str) -> CaseFile {
    let path = folder.path().join("case.toml");
    CaseFile::parse(text, &path).unwrap_or_else(|e| panic!("{e}\n{text}"))
}
