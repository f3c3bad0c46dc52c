use super::*;
use crate::io::netcdf::{self, Data};
use crate::io::netcdf_input::open;
use crate::io::provenance::example;
use crate::io::variable::{AWAY, TOWARDS};
use std::collections::BTreeMap;

/// Variables with their lengths, text attributes and values.
#[derive(Default)]
struct Made(BTreeMap<&'static str, Variable>);

type Variable = (Vec<u64>, Vec<(&'static str, &'static str)>, Vec<f64>);

impl Made {
    /// A file that holds them. Dimensions are called by their lengths; many values are zeros, in a byte each.
    fn open(&self) -> NetcdfFile {
        let mut dims = Vec::new();
        let mut variables = Vec::new();
        for (name, (shape, attributes, values)) in &self.0 {
            let shape = if shape.len() == 1 {
                vec![values.len() as u64]
            } else {
                shape.clone()
            };
            let mut own: Vec<&'static str> = Vec::new();
            for length in &shape {
                own.push(format!("of_{length}").leak());
                if !dims.contains(&(own[own.len() - 1], *length as usize)) {
                    dims.push((own[own.len() - 1], *length as usize));
                }
            }
            let mut values = values.clone();
            values.resize(shape.iter().product::<u64>() as usize, 0.0);
            let are_zero = values.len() > 1_000_000 && values.iter().all(|value| *value == 0.0);
            let data = if are_zero {
                Data::i8(vec![0; values.len()])
            } else {
                Data::f64(values)
            };
            let variable = netcdf::Variable::new(name, own.leak(), data);
            variables.push(
                attributes
                    .iter()
                    .fold(variable, |variable, (name, text)| variable.text(name, text)),
            );
        }
        let layout = netcdf::Layout {
            dims,
            globals: Vec::new(),
            variables,
        };
        opened(layout)
    }
}

fn opened(layout: netcdf::Layout) -> NetcdfFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), layout.into_bytes(&example()).unwrap()).unwrap();
    open(file.path()).unwrap()
}

const RAYS: usize = 12;
const GATES: usize = 6;

/// Two sweeps of six rays, the second one in azimuth, without Nyquist velocity.
fn made() -> Made {
    let mut made = Made::default();
    let velocity: Vec<f64> = (0..RAYS * GATES).map(|i| i as f64 * 0.1).collect();
    let up = (0..RAYS).map(|ray| 2.0 + (ray % 6) as f64);
    let round = (0..RAYS).map(|ray| {
        if ray < 6 {
            359.9 + 0.02 * ray as f64
        } else {
            30.0 * ray as f64
        }
    });
    let ray = |values: Vec<f64>| (vec![RAYS as u64], vec![("units", "degrees")], values);
    made.0.insert("elevation", ray(up.collect()));
    made.0
        .insert("azimuth", ray(round.map(|a| a % 360.0).collect()));
    let units = vec![("units", "seconds since 2024-01-31 12:00:00.5 +00:00")];
    made.0.insert(
        "time",
        (
            vec![RAYS as u64],
            units,
            (0..RAYS).map(|i| i as f64).collect(),
        ),
    );
    made.0.insert(
        "range",
        (
            vec![GATES as u64],
            vec![("units", "km")],
            (0..GATES).map(|i| 0.3 + 0.01 * i as f64).collect(),
        ),
    );
    made.0
        .insert("sweep_start_ray_index", (vec![2], vec![], vec![0.0, 6.0]));
    made.0
        .insert("sweep_end_ray_index", (vec![2], vec![], vec![5.0, 11.0]));
    made.0.insert(
        "VEL",
        (
            vec![RAYS as u64, GATES as u64],
            vec![("units", "m/s"), ("standard_name", AWAY)],
            velocity,
        ),
    );
    made
}

fn read(made: &Made) -> Result<(Vec<ReadScan>, Vec<String>), String> {
    let found = scans(&made.open(), Path::new("x.nc"), &ScanFormat::default(), 0)?;
    Ok((found.scans, found.skipped))
}

#[test]
fn the_sweep_in_elevation_is_read_and_others_are_told() {
    let (found, left_out) = read(&made()).unwrap();
    assert_eq!((found.len(), left_out.len()), (1, 1));
    assert!(
        left_out[0].contains("sweep 1") && left_out[0].contains("azimuths"),
        "{left_out:?}"
    );
    let map = &found[0].map;
    assert_eq!(
        (
            map.velocity_m_s.dim(),
            map.fold_m_s,
            map.velocity_m_s[[5, 5]]
        ),
        ((6, 6), None, 3.5)
    );
    assert!(
        (map.range_m[1] - 310.0).abs() < 1e-9
            && (map.elevation_rad[0] - 2f64.to_radians()).abs() < 1e-12
    );
    assert_eq!(
        found[0].reference.unwrap().to_string(),
        "2024-01-31T12:00:00Z"
    );
}

#[test]
fn rays_without_an_elevation_are_skipped_and_counted() {
    let mut made = made();
    made.0.get_mut("elevation").unwrap().2[3] = f64::NAN;
    let (found, left_out) = read(&made).unwrap();
    assert_eq!(found[0].map.elevation_rad.len(), 5);
    assert!(
        left_out[0].contains("sweep 0: 1 of 6 rays have no elevation"),
        "{left_out:?}"
    );
}

#[test]
fn ranges_of_the_starts_of_gates_follow_their_bounds() {
    for (start_km, first_m) in [(0.295, 300.0), (0.2999999, 299.9999)] {
        let mut starts = made();
        let (shape, _, middles_km) = starts.0.remove("range").unwrap();
        let edges = middles_km.iter().flat_map(|km| [km - 0.005, km + 0.005]);
        let edges: Vec<f64> = edges.collect();
        starts.0.insert(
            "edges",
            (vec![GATES as u64, 2], vec![("units", "km")], edges),
        );
        let attributes = vec![("units", "km"), ("bounds", "edges")];
        let own = (0..GATES).map(|i| start_km + 0.01 * i as f64).collect();
        starts.0.insert("range", (shape, attributes, own));
        let map = read(&starts).unwrap().0.remove(0).map;
        assert!((map.range_m[0] - first_m).abs() < 1e-9, "{start_km}");
        assert!((map.range_m[5] - first_m - 50.0).abs() < 1e-9);
        // Edges of other gates are none of these.
        let (shape, attributes, edges) = starts.0.remove("edges").unwrap();
        let far = edges.iter().map(|edge| 10.0 * edge).collect();
        starts.0.insert("edges", (shape, attributes, far));
        let map = read(&starts).unwrap().0.remove(0).map;
        assert!((map.range_m[0] - 1e3 * start_km).abs() < 1e-9);
    }
}

#[test]
fn a_sign_that_contradicts_the_standard_name_is_refused() {
    let towards = ScanFormat {
        towards: true,
        ..ScanFormat::default()
    };
    let refused = scans(&made().open(), Path::new("a.nc"), &towards, 0).err();
    assert!(refused.is_some_and(|reason| reason.contains("the standard name of its variable VEL")));
}

#[test]
fn sign_folds_masks_and_ragged_gates_follow_the_file() {
    let mut towards = made();
    let (shape, _, values) = towards.0.remove("VEL").unwrap();
    towards.0.insert(
        "speed",
        (shape, vec![("standard_name", TOWARDS)], values.clone()),
    );
    towards.0.insert(
        "nyquist_velocity",
        (vec![RAYS as u64], vec![], vec![12.0; RAYS]),
    );
    let moving = (0..RAYS).map(|ray| f64::from(u8::from(ray == 2))).collect();
    towards
        .0
        .insert("antenna_transition", (vec![RAYS as u64], vec![], moving));
    let map = read(&towards).unwrap().0.remove(0).map;
    assert_eq!(
        (
            map.velocity_m_s[[4, 5]],
            map.fold_m_s,
            map.elevation_rad.len()
        ),
        (-3.5, Some(24.0), 5)
    );
    // Real currents are mirrored: no multiple is lost.
    towards.0.insert(
        "nyquist_velocity",
        (
            vec![RAYS as u64],
            vec![("folding", MIRRORED)],
            vec![12.0; RAYS],
        ),
    );
    assert_eq!(read(&towards).unwrap().0.remove(0).map.fold_m_s, None);
    // A remark says as much as the standard name.
    for (attribute, remark, velocity_m_s) in [
        ("positive", "towards", -3.5),
        ("long_name", "velocity, positive towards the lidar", -3.5),
        ("comment", "away: positive, toward: negative", 3.5),
        ("comment", "negative towards the lidar", 3.5),
    ] {
        let mut remarked = made();
        let (shape, _, values) = remarked.0.remove("VEL").unwrap();
        remarked
            .0
            .insert("VEL", (shape, vec![(attribute, remark)], values));
        let found = read(&remarked).unwrap().0.remove(0).map;
        assert_eq!(found.velocity_m_s[[5, 5]], velocity_m_s, "{remark}");
    }
    // The same gates one ray after the other, the last gate of the first ray missing.
    let mut ragged = made();
    let own = values
        .iter()
        .enumerate()
        .filter(|(i, _)| *i != 5)
        .map(|(_, v)| *v)
        .collect::<Vec<_>>();
    let starts = (0..RAYS)
        .map(|ray| {
            if ray == 0 {
                0.0
            } else {
                (ray * GATES - 1) as f64
            }
        })
        .collect();
    let counts = (0..RAYS)
        .map(|ray| if ray == 0 { 5.0 } else { 6.0 })
        .collect();
    ragged
        .0
        .insert("VEL", (vec![own.len() as u64], vec![], own));
    ragged
        .0
        .insert("ray_start_index", (vec![RAYS as u64], vec![], starts));
    ragged
        .0
        .insert("ray_n_gates", (vec![RAYS as u64], vec![], counts));
    let map = read(&ragged).unwrap().0.remove(0).map;
    assert!(
        map.velocity_m_s[[0, 5]].is_nan()
            && map.velocity_m_s[[0, 4]] == 0.4
            && map.velocity_m_s[[5, 5]] == 3.5
    );
}

#[test]
fn each_ray_has_its_own_nyquist_velocity() {
    let folds = |shape: u64, values: Vec<f64>| {
        let mut made = made();
        let up = (0..RAYS).map(|ray| 2.0 + (ray % 6) as f64).collect();
        made.0.get_mut("azimuth").unwrap().2 = vec![90.0; RAYS];
        made.0.get_mut("elevation").unwrap().2 = up;
        let nyquist = (vec![shape], vec![("units", "cm s-1")], values);
        made.0.insert("nyquist_velocity", nyquist);
        let found = read(&made).unwrap().0;
        let fold = |scan: &ReadScan| (scan.map.elevation_rad.len(), scan.map.fold_m_s);
        found.iter().map(fold).collect::<Vec<_>>()
    };
    let both = [(6, Some(60.0)), (6, Some(20.0))];
    let of_rays = (0..RAYS).map(|ray| if ray < 6 { 3000.0 } else { 1000.0 });
    assert_eq!(folds(RAYS as u64, of_rays.collect()), both);
    assert_eq!(folds(2, vec![3000.0, 1000.0]), both);
    // Every other ray; 18 velocities of each are too few for a scan, 30 are enough.
    let in_turn = (0..RAYS).map(|ray| if ray % 6 == 5 { 1000.0 } else { 3000.0 });
    assert_eq!(folds(RAYS as u64, in_turn.collect()), [(5, Some(60.0)); 2]);
}

#[test]
fn a_status_tells_which_of_its_values_are_trusted() {
    let trusted = |meanings: &str| {
        let status = netcdf::Variable::new(STATUS, &["gate"], Data::i8(vec![0; 3]));
        trusted_values(&opened(netcdf::Layout {
            dims: vec![("gate", 3)],
            globals: Vec::new(),
            variables: vec![
                status
                    .attr("flag_values", Data::i8([0, 1, 2]))
                    .text("flag_meanings", meanings),
            ],
        }))
    };
    assert_eq!(trusted("good bad not_valid"), Ok(vec![0.0]));
    assert_eq!(trusted("bad valid_data Good"), Ok(vec![1.0, 2.0]));
    let refused = trusted("a b c").unwrap_err();
    assert!(refused.contains("flag_meanings = \"a b c\""), "{refused}");
    assert_eq!(trusted_values(&made().open()), Ok(vec![1.0]));
}

#[test]
fn ranges_of_each_ray_are_read_where_they_are_the_same() {
    let with = |range_m: &dyn Fn(usize, usize) -> f64| {
        let mut made = made();
        let all = (0..RAYS * GATES).map(|i| range_m(i / GATES, i % GATES));
        let shape = vec![RAYS as u64, GATES as u64];
        made.0
            .insert("range", (shape, vec![("units", "m")], all.collect()));
        read(&made).map(|(found, _)| found[0].map.range_m.clone())
    };
    let one = |ray: usize, gate: usize| match ray {
        3 => f64::NAN,
        _ => 300.0 + 10.0 * gate as f64,
    };
    assert_eq!(
        with(&one),
        Ok((0..GATES).map(|gate| one(0, gate)).collect())
    );
    let refused = with(&|ray, gate| (ray + gate) as f64).unwrap_err();
    assert!(
        refused.contains("gates that are the same for all rays"),
        "{refused}"
    );
}

#[test]
fn a_least_ratio_needs_a_variable_and_takes_it_in_any_unit() {
    let loud = ScanFormat {
        min_snr_db: Some(-10.0),
        ..ScanFormat::default()
    };
    let known = |made: &Made| {
        let found = scans(&made.open(), Path::new("x.nc"), &loud, 0)?;
        let velocities = &found.scans[0].map.velocity_m_s;
        Ok::<_, String>(velocities.iter().filter(|v| v.is_finite()).count())
    };
    let mut made = made();
    assert!(known(&made).unwrap_err().contains("--min-snr"));
    let ratio: Vec<f64> = (0..RAYS * GATES)
        .map(|i| if i % GATES == 0 { 1.05 } else { 1.2 })
        .collect();
    let shape = vec![RAYS as u64, GATES as u64];
    let intensity = (shape, vec![("units", "unitless")], ratio);
    made.0.insert("intensity", intensity);
    assert_eq!(known(&made), Ok(30));
}

/// Rays of different lengths can ask for far more than the file holds.
#[test]
fn gates_that_no_memory_holds_are_refused_before_they_are_made() {
    const MANY: usize = 3_000_000;
    let mut made = made();
    let many = |value: f64| (vec![MANY as u64], vec![], vec![value; MANY]);
    for name in [
        "elevation",
        "azimuth",
        "time",
        "ray_start_index",
        "ray_n_gates",
        "VEL",
    ] {
        made.0.insert(name, many(0.0));
    }
    made.0.insert(
        "range",
        (
            vec![MANY as u64],
            vec![],
            (0..MANY).map(|i| i as f64).collect(),
        ),
    );
    let refused = read(&made).unwrap_err();
    assert!(
        refused.contains("3000000 rays x 3000000 ranges would take"),
        "{refused}"
    );
}

#[test]
fn what_contradicts_itself_is_refused_by_name() {
    let refused = |change: &dyn Fn(&mut Made)| {
        let mut made = made();
        change(&mut made);
        read(&made).unwrap_err()
    };
    assert!(
        refused(&|m| m.0.get_mut("VEL").unwrap().0 = vec![7, 6])
            .contains("VEL is 7 x 6; 12 rays x 6 ranges")
    );
    assert!(refused(&|m| drop(m.0.remove("VEL"))).contains("no radial velocity"));
    assert!(refused(&|m| drop(m.0.remove("elevation"))).contains("elevation"));
    assert!(
        refused(&|m| m.0.get_mut("VEL").unwrap().1 = vec![("units", "furlongs")])
            .contains("VEL has units = \"furlongs\"")
    );
    assert!(
        refused(&|m| m.0.get_mut("time").unwrap().2 = vec![0.0; 3]).contains("time has 3 values")
    );
    assert!(
        refused(&|m| m.0.get_mut("sweep_end_ray_index").unwrap().2 = vec![5.0, 99.0])
            .contains("ray 99")
    );
    let all_missing = |m: &mut Made| m.0.get_mut("VEL").unwrap().2.fill(f64::NAN);
    let (found, left_out) = {
        let mut made = made();
        all_missing(&mut made);
        read(&made).unwrap()
    };
    assert!(found.is_empty() && left_out[0].contains("all of its velocities are missing"));
}
