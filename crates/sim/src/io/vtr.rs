//! Cross-planes and whole fields as VTK rectilinear grids (`.vtr`, one per age) and their collection (`.pvd`), for ParaView and
//! PyVista.
//! Point vectors `velocity` = (u, v, w) in m/s, in planes with u = 0 on one x point; names in VTK carry no units.
//! Check: a test reads the file back with the VTK parser.

use super::error::{OutputError, OutputResult};
use super::fields::VelocityField;
use super::map::CrossPlanes;
use super::provenance::Provenance;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, Coordinates, DataSet, Extent, RectilinearGridPiece, Version, Vtk,
};

/// The files of a series: `STEM_0001.vtr`, ... and `STEM.pvd`, whose time steps are the ages tau.
///
/// # Errors
/// What [`CrossPlanes::check`] finds, or a refusal of the encoder.
pub fn vtr_series(planes: &CrossPlanes, stem: &str, provenance: &Provenance) -> OutputResult<Vec<(String, Vec<u8>)>> {
    planes.check()?;
    let mut files = Vec::new();
    let mut entries = String::new();
    for (i, tau) in planes.tau.iter().enumerate() {
        let name = format!("{stem}_{:04}.vtr", i + 1);
        files.push((name.clone(), plane_bytes(planes, i, provenance)?));
        entries += &format!("    <DataSet timestep=\"{tau:?}\" part=\"0\" file=\"{name}\"/>\n");
    }
    files.push((format!("{stem}.pvd"), collection(&entries, provenance)));
    Ok(files)
}

/// The collection of a series of files: members with their times, in this order.
pub fn pvd_bytes<'a>(members: impl IntoIterator<Item = (f64, &'a str)>, provenance: &Provenance) -> Vec<u8> {
    let entry =
        |(time, name): (f64, &str)| format!("    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{name}\"/>\n");
    let entries: String = members.into_iter().map(entry).collect();
    collection(&entries, provenance)
}

fn collection(entries: &str, provenance: &Provenance) -> Vec<u8> {
    format!(
        "<?xml version=\"1.0\"?>\n{}<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n",
        comment(provenance)
    )
    .into_bytes()
}

/// A whole field as a rectilinear grid with points at the centres: vectors `velocity` in m/s, scalars `pressure_m2_s2`
/// and, where it is there, `vorticity_magnitude` in 1/s.
///
/// # Errors
/// What [`VelocityField::check`] finds, or a refusal of the encoder.
pub fn field_bytes(field: &VelocityField, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    field.check()?;
    let [u, v, w] = &field.velocity_m_s;
    let velocity: Vec<f32> = u.iter().zip(v).zip(w).flat_map(|((u, v), w)| [*u as f32, *v as f32, *w as f32]).collect();
    let pressure: Vec<f32> = field.pressure_m2_s2.iter().map(|p| *p as f32).collect();
    let mut point = vec![
        Attribute::vectors("velocity").with_data(velocity),
        Attribute::scalars("pressure_m2_s2", 1).with_data(pressure),
    ];
    if let Some(vorticity) = &field.vorticity_per_s {
        let vorticity: Vec<f32> = vorticity.iter().map(|w| *w as f32).collect();
        point.push(Attribute::scalars("vorticity_magnitude", 1).with_data(vorticity));
    }
    grid_bytes(&field.title, [&field.x_m, &field.y_m, &field.z_m], point, provenance)
}

/// The first plane alone.
///
/// # Errors
/// As [`vtr_series`].
pub fn plane_file(planes: &CrossPlanes, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    planes.check()?;
    plane_bytes(planes, 0, provenance)
}

fn plane_bytes(planes: &CrossPlanes, index: usize, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    let (ny, nz) = (planes.y_m.len(), planes.z_m.len());
    // x runs fastest and has one point, then y, then z: the order of the arrays; the vector is interleaved.
    let mut velocity = Vec::with_capacity(3 * ny * nz);
    for z in 0..nz {
        for y in 0..ny {
            let cell = [index, z, y];
            velocity.extend([0.0, planes.v_m_s[cell] as f32, planes.w_m_s[cell] as f32]);
        }
    }
    let point = vec![Attribute::vectors("velocity").with_data(velocity)];
    grid_bytes(&planes.title, [&[0.0], &planes.y_m, &planes.z_m], point, provenance)
}

fn grid_bytes(title: &str, axes: [&[f64]; 3], point: Vec<Attribute>, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    let [x, y, z] = axes.map(<[f64]>::to_vec);
    let range = |axis: &[f64]| 0..=(axis.len() as i32 - 1);
    let grid = RectilinearGridPiece {
        extent: Extent::Ranges([range(&x), range(&y), range(&z)]),
        coords: Coordinates { x: x.into(), y: y.into(), z: z.into() },
        data: Attributes { point, cell: vec![] },
    };
    let file = Vtk {
        version: Version::new((1, 0)),
        title: title.to_owned(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::inline(grid),
        file_path: None,
    };
    let mut bytes = Vec::new();
    file.write_xml(&mut bytes).map_err(|e| OutputError::encode("VTK", e))?;
    insert_comment(bytes, provenance)
}

/// The provenance goes as a comment before the root element.
fn insert_comment(bytes: Vec<u8>, provenance: &Provenance) -> OutputResult<Vec<u8>> {
    let text = String::from_utf8(bytes).map_err(|e| OutputError::encode("VTK", e))?;
    let root = text.find("<VTKFile").ok_or_else(|| OutputError::encode("VTK", "no root element"))?;
    Ok([&text[..root], &comment(provenance), &text[root..]].concat().into_bytes())
}

fn comment(provenance: &Provenance) -> String {
    // Two hyphens would end an XML comment.
    let text = provenance.comment_lines().replace('-', "\u{2010}");
    format!("<!--\n{text}-->\n")
}

#[cfg(test)]
mod tests {
    use super::super::provenance::example;
    use super::super::samples;
    use super::*;
    use vtkio::model::Piece;

    #[test]
    fn a_plane_reads_back_with_its_nodes_and_vectors() {
        let planes = samples::planes();
        let files = vtr_series(&planes, "wake", &example()).unwrap();
        let names: Vec<&str> = files.iter().map(|f| f.0.as_str()).collect();
        assert_eq!(names, ["wake_0001.vtr", "wake_0002.vtr", "wake.pvd"]);
        let vtk = Vtk::parse_xml(files[1].1.as_slice()).unwrap();
        let DataSet::RectilinearGrid { pieces, .. } = vtk.data else { panic!("no rectilinear grid") };
        let Piece::Inline(grid) = &pieces[0] else { panic!("no inline piece") };
        assert_eq!(grid.coords.y.clone().cast_into::<f64>().unwrap(), planes.y_m);
        assert_eq!(grid.coords.z.clone().cast_into::<f64>().unwrap(), planes.z_m);
        let Attribute::DataArray(array) = &grid.data.point[0] else { panic!("no point data") };
        let velocity = array.data.clone().cast_into::<f32>().unwrap();
        let (ny, z, y) = (planes.y_m.len(), 2, 3);
        let vector = &velocity[3 * (z * ny + y)..][..3];
        assert_eq!(vector, [0.0, planes.v_m_s[[1, z, y]] as f32, planes.w_m_s[[1, z, y]] as f32]);
    }

    #[test]
    fn the_collection_lists_the_members_and_the_provenance() {
        let files = vtr_series(&samples::planes(), "wake", &example()).unwrap();
        let pvd = String::from_utf8(files[2].1.clone()).unwrap();
        assert!(pvd.contains("timestep=\"2.5\" part=\"0\" file=\"wake_0001.vtr\""));
        for (_, bytes) in &files {
            let text = String::from_utf8_lossy(bytes);
            assert!(text.contains("18446744073709551615"), "seed in every file");
        }
    }

    #[test]
    fn a_whole_field_reads_back_with_x_fastest() {
        let field = super::super::fields::example();
        let vtk = Vtk::parse_xml(field_bytes(&field, &example()).unwrap().as_slice()).unwrap();
        let DataSet::RectilinearGrid { pieces, .. } = vtk.data else { panic!("no rectilinear grid") };
        let Piece::Inline(grid) = &pieces[0] else { panic!("no inline piece") };
        assert_eq!(grid.coords.x.clone().cast_into::<f64>().unwrap(), field.x_m);
        let Attribute::DataArray(array) = &grid.data.point[0] else { panic!("no point data") };
        let velocity = array.data.clone().cast_into::<f32>().unwrap();
        let place = (3 * field.y_m.len() + 1) * field.x_m.len() + 2;
        assert_eq!(velocity[3 * place..][..3], field.velocity_m_s.each_ref().map(|u| u[place] as f32));
        let pvd = String::from_utf8(pvd_bytes([(0.5, "a.vtr"), (1.0, "b.vtr")], &example())).unwrap();
        assert!(pvd.contains("timestep=\"0.5\" part=\"0\" file=\"a.vtr\""));
    }
}
