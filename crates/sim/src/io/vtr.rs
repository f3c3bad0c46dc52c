//! Cross-planes and whole fields as VTK rectilinear grids (`.vtr`, one per age) and their collection (`.pvd`), for ParaView and
//! PyVista.
//! Point vectors `velocity` = (u, v, w) in m/s, in planes with u = 0 on one x point; names in VTK carry no units.
//! Check: tests read the file back with the VTK parser, and compare its bytes with those of another encoder.

use super::error::OutputResult;
use super::fields::VelocityField;
use super::map::CrossPlanes;
use super::parts::FileParts;
use super::provenance::Provenance;
use base64::prelude::{BASE64_STANDARD, Engine as _};
use ndarray::{Array3, Axis};

/// The collection of a series of files: members with their times, in this order.
pub fn pvd_bytes<'a>(
    members: impl IntoIterator<Item = (f64, &'a str)>,
    provenance: &Provenance,
) -> Vec<u8> {
    let entry = |(time, name): (f64, &str)| {
        format!("    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{name}\"/>\n")
    };
    let entries: String = members.into_iter().map(entry).collect();
    format!(
        "<?xml version=\"1.0\"?>\n{}<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n",
        comment(provenance)
    )
    .into_bytes()
}

/// A whole field as a rectilinear grid with points at the centres: vectors `velocity` in m/s, scalars `pressure_m2_s2`
/// and, where it is there, `vorticity_magnitude` in 1/s; or what one of several ranks has of the file. `behind` are the values of
/// the cell behind the last one that is here, in the order of [`VelocityField::named`]: digits of the encoding hold bytes of both.
///
/// # Errors
/// What [`VelocityField::check`] finds.
pub fn field_parts(
    field: &VelocityField,
    behind: Option<&[f64]>,
    provenance: &Provenance,
) -> OutputResult<FileParts> {
    field.check()?;
    let cells = field.x_m.len() * field.y_m.len() * field.z_m.len();
    let named: Vec<&[f64]> = field.named().map(|(_, values)| values).collect();
    let array = |name: &'static str, columns: std::ops::Range<usize>| Array {
        name,
        values: named[columns.clone()].to_vec(),
        behind: behind.map_or(&[], |values| &values[columns]),
        cells,
        first: field.first(),
    };
    let mut arrays = vec![array("velocity", 0..3), array("pressure_m2_s2", 3..4)];
    arrays.extend(
        field
            .vorticity_per_s
            .is_some()
            .then(|| array("vorticity_magnitude", 4..5)),
    );
    Ok(grid(
        [&field.x_m, &field.y_m, &field.z_m],
        &arrays,
        field.share.is_first,
        provenance,
    ))
}

/// The plane of one age, at one point of x.
///
/// # Errors
/// What [`CrossPlanes::check`] finds.
pub fn plane_bytes(
    planes: &CrossPlanes,
    age: usize,
    provenance: &Provenance,
) -> OutputResult<Vec<u8>> {
    planes.check()?;
    let of = |field: &Array3<f64>| {
        field
            .index_axis(Axis(0), age)
            .iter()
            .copied()
            .collect::<Vec<f64>>()
    };
    let [v, w] = [of(&planes.v_m_s), of(&planes.w_m_s)];
    let u = vec![0.0; v.len()];
    let velocity = Array {
        name: "velocity",
        values: vec![&u, &v, &w],
        behind: &[],
        cells: v.len(),
        first: 0,
    };
    Ok(grid(
        [&[0.0], &planes.y_m, &planes.z_m],
        &[velocity],
        true,
        provenance,
    )
    .into_bytes())
}

/// A grid with its arrays at the points of these axes, the first one fastest: all of it, or what a rank has that has `is_first` or not.
fn grid(
    axes: [&[f64]; 3],
    arrays: &[Array<'_>],
    is_first: bool,
    provenance: &Provenance,
) -> FileParts {
    let extent = axes.map(|axis| format!("0 {}", axis.len() - 1)).join(" ");
    let scalars = arrays.iter().find(|array| array.values.len() == 1);
    let scalars = scalars.map_or_else(String::new, |array| format!("Scalars=\"{}\" ", array.name));
    let mut file = FileParts::default();
    let add = |file: &mut FileParts, text: String| {
        let start = file.length;
        file.length += text.len() as u64;
        if is_first {
            file.parts.push((start, text.into_bytes()));
        }
    };
    // The provenance goes as a comment before the root element.
    let mut text = format!(
        "{}<VTKFile type=\"RectilinearGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\
         <RectilinearGrid WholeExtent=\"{extent}\"><Piece Extent=\"{extent}\" NumberOfPoints=\"0\" NumberOfLines=\"0\" \
         NumberOfStrips=\"0\" NumberOfPolys=\"0\" NumberOfVerts=\"0\"><PointData {scalars}Vectors=\"velocity\">",
        comment(provenance)
    );
    for array in arrays {
        let (name, components) = (array.name, array.values.len());
        text += &format!(
            "<DataArray type=\"Float32\" Name=\"{name}\" format=\"binary\" NumberOfComponents=\"{components}\">"
        );
        add(&mut file, text);
        let (start, digits) = array.encoded();
        file.parts.push((file.length + start, digits));
        file.length += array.length();
        text = "</DataArray>".into();
    }
    text += "</PointData><CellData/><Coordinates>";
    for axis in axes {
        let length = (8 * axis.len() as u64).to_le_bytes();
        let bytes: Vec<u8> = length
            .into_iter()
            .chain(axis.iter().flat_map(|value| value.to_le_bytes()))
            .collect();
        let digits = BASE64_STANDARD.encode(bytes);
        text += &format!(
            "<DataArray type=\"Float64\" format=\"binary\" NumberOfComponents=\"1\">{digits}</DataArray>"
        );
    }
    add(
        &mut file,
        text + "</Coordinates></Piece></RectilinearGrid></VTKFile>",
    );
    file
}

/// An array of 32-bit floats as it stands in a file, in base64 with its length before it.
struct Array<'a> {
    name: &'static str,
    /// The values that are here, of each component.
    values: Vec<&'a [f64]>,
    /// The values of the cell behind the last one that is here.
    behind: &'a [f64],
    /// Of the whole array.
    cells: usize,
    /// The first cell that is here.
    first: usize,
}

impl Array<'_> {
    /// Bytes before the values of a cell.
    fn before(&self, cell: usize) -> usize {
        8 + 4 * self.values.len() * cell
    }

    /// Digits of the whole array.
    fn length(&self) -> u64 {
        4 * self.before(self.cells).div_ceil(3) as u64
    }

    /// The digits that begin here, and the place of the first of them.
    fn encoded(&self) -> (u64, Vec<u8>) {
        let cells = self.values.first().map_or(0, |values| values.len());
        let end = self.first + cells;
        let mut bytes = Vec::with_capacity(4 * self.values.len() * (cells + 1) + 8);
        if self.first == 0 {
            bytes.extend((self.before(self.cells) as u64 - 8).to_le_bytes());
        }
        for cell in 0..cells {
            bytes.extend(
                self.values
                    .iter()
                    .flat_map(|values| (values[cell] as f32).to_le_bytes()),
            );
        }
        bytes.extend(
            self.behind
                .iter()
                .flat_map(|value| (*value as f32).to_le_bytes()),
        );
        // Three bytes make four digits, which belong to who has the first of these.
        let from = if self.first == 0 {
            0
        } else {
            self.before(self.first).next_multiple_of(3)
        };
        let to = if end == self.cells {
            self.before(end)
        } else {
            self.before(end).next_multiple_of(3)
        };
        let here = if self.first == 0 {
            0
        } else {
            self.before(self.first)
        };
        let own = bytes
            .get(from - here..to - here)
            .filter(|_| cells > 0)
            .unwrap_or_default();
        (
            (from / 3 * 4) as u64,
            BASE64_STANDARD.encode(own).into_bytes(),
        )
    }
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
    use vtkio::model::{
        Attribute, Attributes, ByteOrder, Coordinates, DataSet, Extent, Piece,
        RectilinearGridPiece, Version, Vtk,
    };

    /// What another encoder makes of a grid.
    fn encoded(axes: [&[f64]; 3], point: Vec<Attribute>) -> Vec<u8> {
        let [x, y, z] = axes.map(<[f64]>::to_vec);
        let range = |axis: &[f64]| 0..=(axis.len() as i32 - 1);
        let grid = RectilinearGridPiece {
            extent: Extent::Ranges([range(&x), range(&y), range(&z)]),
            coords: Coordinates {
                x: x.into(),
                y: y.into(),
                z: z.into(),
            },
            data: Attributes {
                point,
                cell: vec![],
            },
        };
        let file = Vtk {
            version: Version::new((1, 0)),
            title: String::new(),
            byte_order: ByteOrder::LittleEndian,
            data: DataSet::inline(grid),
            file_path: None,
        };
        let mut bytes = comment(&example()).into_bytes();
        file.write_xml(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_plane_reads_back_with_its_nodes_and_vectors() {
        let planes = samples::planes();
        let file = plane_bytes(&planes, 1, &example()).unwrap();
        let vtk = Vtk::parse_xml(file.as_slice()).unwrap();
        let DataSet::RectilinearGrid { pieces, .. } = vtk.data else {
            panic!("no rectilinear grid")
        };
        let Piece::Inline(grid) = &pieces[0] else {
            panic!("no inline piece")
        };
        assert_eq!(
            grid.coords.y.clone().cast_into::<f64>().unwrap(),
            planes.y_m
        );
        assert_eq!(
            grid.coords.z.clone().cast_into::<f64>().unwrap(),
            planes.z_m
        );
        let Attribute::DataArray(array) = &grid.data.point[0] else {
            panic!("no point data")
        };
        let velocity = array.data.clone().cast_into::<f32>().unwrap();
        let (ny, z, y) = (planes.y_m.len(), 2, 3);
        let vector = &velocity[3 * (z * ny + y)..][..3];
        assert_eq!(
            vector,
            [
                0.0,
                planes.v_m_s[[1, z, y]] as f32,
                planes.w_m_s[[1, z, y]] as f32
            ]
        );
        let point = vec![Attribute::vectors("velocity").with_data(velocity.clone())];
        assert!(file == encoded([&[0.0], &planes.y_m, &planes.z_m], point));
    }

    #[test]
    fn the_collection_lists_the_members_and_the_provenance() {
        let planes = samples::planes();
        let collection = pvd_bytes([(2.5, "wake_0001.vtr"), (5.0, "wake_0002.vtr")], &example());
        let pvd = String::from_utf8(collection.clone()).unwrap();
        assert!(pvd.contains("timestep=\"2.5\" part=\"0\" file=\"wake_0001.vtr\""));
        let members = [0, 1].map(|age| plane_bytes(&planes, age, &example()).unwrap());
        for bytes in members.iter().chain([&collection]) {
            let text = String::from_utf8_lossy(bytes);
            assert!(text.contains("18446744073709551615"), "seed in every file");
        }
    }

    #[test]
    fn fields_have_the_bytes_of_the_encoder_and_what_ranks_have_of_them_is_the_file_of_one() {
        for with_vorticity in [true, false] {
            let keep = |mut field: VelocityField| {
                field.vorticity_per_s = field.vorticity_per_s.filter(|_| with_vorticity);
                field
            };
            let field = keep(super::super::fields::example());
            let floats = |values: &[f64]| {
                values
                    .iter()
                    .map(|value| *value as f32)
                    .collect::<Vec<f32>>()
            };
            let [u, v, w] = field.velocity_m_s.each_ref().map(|values| floats(values));
            let velocity: Vec<f32> = (0..u.len()).flat_map(|i| [u[i], v[i], w[i]]).collect();
            let mut point = vec![
                Attribute::vectors("velocity").with_data(velocity),
                Attribute::scalars("pressure_m2_s2", 1).with_data(floats(&field.pressure_m2_s2)),
            ];
            point.extend(
                field
                    .vorticity_per_s
                    .as_ref()
                    .map(|w| Attribute::scalars("vorticity_magnitude", 1).with_data(floats(w))),
            );
            let expected = encoded([&field.x_m, &field.y_m, &field.z_m], point);
            assert!(field_parts(&field, None, &example()).unwrap().into_bytes() == expected);
            let ranks: Vec<VelocityField> = super::super::fields::example_on_ranks()
                .into_iter()
                .map(keep)
                .collect();
            let mut file = FileParts::default();
            for rank in &ranks {
                let next = ranks.iter().find(|next| {
                    next.share.planes.start == rank.share.planes.end
                        && !next.share.planes.is_empty()
                });
                let behind: Option<Vec<f64>> =
                    next.map(|next| next.named().map(|(_, values)| values[0]).collect());
                let parts = field_parts(rank, behind.as_deref(), &example()).unwrap();
                file.length = parts.length;
                file.parts.extend(parts.parts);
            }
            assert!(
                file.into_bytes() == expected,
                "ranks, vorticity: {with_vorticity}"
            );
        }
    }

    #[test]
    fn a_whole_field_reads_back_with_x_fastest() {
        let field = super::super::fields::example();
        let vtk = Vtk::parse_xml(
            field_parts(&field, None, &example())
                .unwrap()
                .into_bytes()
                .as_slice(),
        )
        .unwrap();
        let DataSet::RectilinearGrid { pieces, .. } = vtk.data else {
            panic!("no rectilinear grid")
        };
        let Piece::Inline(grid) = &pieces[0] else {
            panic!("no inline piece")
        };
        assert_eq!(grid.coords.x.clone().cast_into::<f64>().unwrap(), field.x_m);
        let Attribute::DataArray(array) = &grid.data.point[0] else {
            panic!("no point data")
        };
        let velocity = array.data.clone().cast_into::<f32>().unwrap();
        let place = (3 * field.y_m.len() + 1) * field.x_m.len() + 2;
        assert_eq!(
            velocity[3 * place..][..3],
            field.velocity_m_s.each_ref().map(|u| u[place] as f32)
        );
        let pvd =
            String::from_utf8(pvd_bytes([(0.5, "a.vtr"), (1.0, "b.vtr")], &example())).unwrap();
        assert!(pvd.contains("timestep=\"0.5\" part=\"0\" file=\"a.vtr\""));
    }
}
