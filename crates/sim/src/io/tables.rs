//! A scanned map or a set of cross-planes as a table in long form, one row per value, slowest axis first.
//! Check: positions are recomputed from angles, and a value is looked up at its (ray, gate).

use super::csv::Table;
use super::map::{CrossPlanes, VelocityMap};
use crate::Error;

/// The table of a map: `tau, range_m, elevation_rad, y_m, z_m`, then the fields in order, then `x_m` of a map with a flight and
/// `azimuth_rad, time_s, sweep, ray`. One row per (ray, gate), the gate running fastest.
///
/// # Errors
/// What [`VelocityMap::check`] finds.
pub fn map_table(map: &VelocityMap) -> Result<Table, Error> {
    map.check()?;
    let mut tau = Vec::new();
    let mut range_m = Vec::new();
    let mut elevation_rad = Vec::new();
    let mut position_m = [const { Vec::new() }; 3];
    let mut azimuth_rad = Vec::new();
    let mut time_s = Vec::new();
    let mut sweep = Vec::new();
    let mut number = Vec::new();
    for (index, ray) in map.rays.iter().enumerate() {
        for (gate, gate_range_m) in map.range_m.iter().enumerate() {
            tau.push(map.sweeps[ray.sweep].tau);
            range_m.push(*gate_range_m);
            elevation_rad.push(ray.elevation_rad);
            for (all, coordinate_m) in position_m.iter_mut().zip(map.place_m(index, gate)) {
                all.push(coordinate_m);
            }
            azimuth_rad.push(ray.azimuth_rad);
            time_s.push(ray.time_s);
            sweep.push(ray.sweep as i64);
            number.push(index as i64);
        }
    }
    let [x_m, y_m, z_m] = position_m;
    let mut table = Table::new()
        .float("tau", tau)
        .float("range_m", range_m)
        .float("elevation_rad", elevation_rad)
        .float("y_m", y_m)
        .float("z_m", z_m);
    for field in &map.fields {
        table = table.float(&field.column(), field.values.iter().copied());
    }
    if map.flight.is_some() {
        table = table.float("x_m", x_m);
    }
    Ok(table
        .float("azimuth_rad", azimuth_rad)
        .float("time_s", time_s)
        .int("sweep", sweep)
        .int("ray", number))
}

/// The table of cross-planes: `tau, z_m, y_m, v_m_s, w_m_s, time_s`, with `y_m` running fastest.
///
/// # Errors
/// What [`CrossPlanes::check`] finds.
pub fn planes_table(planes: &CrossPlanes) -> Result<Table, Error> {
    planes.check()?;
    let mut tau = Vec::new();
    let mut z_m = Vec::new();
    let mut y_m = Vec::new();
    let mut time_s = Vec::new();
    for (plane_tau, plane_time_s) in planes.tau.iter().zip(&planes.time_s) {
        for height_m in &planes.z_m {
            for across_m in &planes.y_m {
                tau.push(*plane_tau);
                z_m.push(*height_m);
                y_m.push(*across_m);
                time_s.push(*plane_time_s);
            }
        }
    }
    Ok(Table::new()
        .float("tau", tau)
        .float("z_m", z_m)
        .float("y_m", y_m)
        .float("v_m_s", planes.v_m_s.iter().copied())
        .float("w_m_s", planes.w_m_s.iter().copied())
        .float("time_s", time_s))
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;
    use crate::io::csv::Column;

    fn floats<'a>(table: &'a Table, name: &str) -> &'a [f64] {
        match table.columns().iter().find(|(n, _)| n == name) {
            Some((_, Column::Float(v))) => v,
            other => panic!("{name}: {other:?}"),
        }
    }

    #[test]
    fn a_map_row_holds_the_value_and_place_of_its_cell() {
        let map = samples::map();
        let table = map_table(&map).unwrap();
        let ray = 7;
        let gate = 3;
        let row = ray * map.range_m.len() + gate;
        assert_eq!(
            floats(&table, "v_mean_m_s")[row],
            map.field("radial_velocity").unwrap().values[[ray, gate]]
        );
        let y = floats(&table, "y_m")[row];
        let z = floats(&table, "z_m")[row];
        let range = (y - map.lidar_y_m).hypot(z - map.lidar_height_m);
        approx::assert_relative_eq!(range, map.range_m[gate], max_relative = 1e-14);
        approx::assert_relative_eq!(
            (z - map.lidar_height_m).atan2(y - map.lidar_y_m),
            map.rays[ray].elevation_rad,
            max_relative = 1e-12
        );
        let names: Vec<&str> = table.columns().iter().map(|(n, _)| n.as_str()).collect();
        assert_eq!(
            names[..6],
            [
                "tau",
                "range_m",
                "elevation_rad",
                "y_m",
                "z_m",
                "v_exact_m_s"
            ]
        );
        for name in [
            "v_mean_m_s",
            "std_m_s",
            "rms_m_s",
            "level",
            "n_eff",
            "snr_db",
        ] {
            assert!(names.contains(&name), "{name} missing in {names:?}");
        }
    }

    #[test]
    fn planes_run_fastest_along_y() {
        let planes = samples::planes();
        let table = planes_table(&planes).unwrap();
        let ny = planes.y_m.len();
        let nz = planes.z_m.len();
        let row = (ny * nz) + 2 * ny + 3;
        assert_eq!(floats(&table, "w_m_s")[row], planes.w_m_s[[1, 2, 3]]);
        assert_eq!(floats(&table, "y_m")[row], planes.y_m[3]);
        assert_eq!(floats(&table, "z_m")[row], planes.z_m[2]);
        assert_eq!(floats(&table, "tau")[row], planes.tau[1]);
    }

    #[test]
    fn broken_maps_are_refused() {
        let refused = |spoil: &dyn Fn(&mut VelocityMap)| {
            let mut map = samples::map();
            spoil(&mut map);
            map_table(&map).unwrap_err()
        };
        assert!(matches!(
            refused(&|m| m.range_m[1] = m.range_m[0]),
            Error::Value { .. }
        ));
        assert!(matches!(
            refused(&|m| m.rays[1].time_s = m.rays[0].time_s),
            Error::Value { .. }
        ));
        assert!(matches!(
            refused(&|m| m.rays[2].sweep = 1),
            Error::Value { .. }
        ));
        assert!(matches!(
            refused(&|m| {
                m.sweeps.pop();
            }),
            Error::Length { .. }
        ));
        assert!(matches!(
            refused(&|m| m.fields[0].values[[0, 0]] = f64::INFINITY),
            Error::Value { .. }
        ));
        assert!(matches!(
            refused(&|m| m.fields[1].name = m.fields[0].name.clone()),
            Error::Duplicate { .. }
        ));
        assert!(matches!(
            refused(&|m| {
                m.range_m.pop();
            }),
            Error::Length { .. }
        ));
    }
}
