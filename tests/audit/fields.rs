//! A linear wind as a file of fields on axes of its own: (27) keeps it, so that what a scene sees of the file is the wind itself.

use super::air::velocity_m_s;
use super::program::Bench;
use super::random::Random;
use super::scene::Scene;
use netcdf3::{DataSet, FileWriter, Version};

/// Writes the wind of a scene to `f.nc`, turned about a place, right-handed or not; gives the scene that reads it.
pub(crate) fn stored(r: &mut Random, bench: &Bench, s: &Scene) -> Scene {
    let (turn, side) = (r.between(-3.0, 3.0), r.pick(&[1.0, -1.0]));
    let origin = [r.between(-50.0, 50.0), r.between(-50.0, 50.0)];
    let (sin, cos) = turn.sin_cos();
    let nodes = |first: f64, step: f64, count: usize| {
        (0..count)
            .map(|i| first + i as f64 * step)
            .collect::<Vec<_>>()
    };
    let (across, up) = (nodes(-600.0, 40.0, 31), nodes(5.0, 10.0, 50));
    let mut wind = [const { Vec::new() }; 3];
    for &z in &up {
        for &y in &across {
            for &x in &across {
                let p = [
                    origin[0] + x * cos - side * y * sin,
                    origin[1] + x * sin + side * y * cos,
                    z,
                ];
                let [u, v, w] = velocity_m_s(s, p, 0.0);
                for (values, value) in
                    wind.iter_mut()
                        .zip([u * cos + v * sin, side * (v * cos - u * sin), w])
                {
                    values.push(value);
                }
            }
        }
    }
    let axes = [
        ("time", vec![0.0]),
        ("z", up),
        ("y", across.clone()),
        ("x", across),
    ];
    let mut set = DataSet::new();
    for (name, values) in &axes {
        set.add_fixed_dim(name, values.len()).unwrap();
        set.add_var_f64(name, &[name]).unwrap();
    }
    let names = ["u", "v", "w"];
    names
        .iter()
        .for_each(|name| set.add_var_f64(name, &["time", "z", "y", "x"]).unwrap());
    let mut file = FileWriter::open(bench.folder.join("f.nc")).unwrap();
    file.set_def(&set, Version::Offset64Bit, 0).unwrap();
    axes.iter()
        .for_each(|(name, values)| file.write_var_f64(name, values).unwrap());
    names
        .iter()
        .zip(&wind)
        .for_each(|(name, values)| file.write_var_f64(name, values).unwrap());
    file.close().unwrap();
    let mut out = s.clone();
    out.unset("flow")
        .word("flow.kind", "fields")
        .word("flow.files", "f.nc")
        .word("flow.motion", "frozen");
    out.set(
        "flow.origin_m",
        format!("[{:?}, {:?}, 0.0]", origin[0], origin[1]),
    )
    .number("flow.rotation_rad", turn);
    out.set("flow.mirror_y", side < 0.0);
    out
}
