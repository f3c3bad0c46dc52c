use super::*;
use ndarray::Array2;
use wakescope_estimate::retrieval::ScanMap;

/// Rays at azimuths and elevations in degrees; each has its number as time.
fn rays(directions: impl IntoIterator<Item = (f64, f64)>) -> Vec<Ray> {
    let ray = |(i, (azimuth, elevation)): (usize, (f64, f64))| Ray {
        elevation_rad: elevation.to_radians(),
        azimuth_rad: azimuth.to_radians(),
        time_s: i as f64,
        velocity_m_s: vec![1.0; 3],
        ..Ray::default()
    };
    directions.into_iter().enumerate().map(ray).collect()
}

/// Elevations 2 to 14 degrees at an azimuth.
fn up(azimuth: f64) -> impl DoubleEndedIterator<Item = (f64, f64)> + Clone {
    (10..=70).map(move |i| (azimuth, 0.2 * f64::from(i)))
}

/// Azimuth, first and last elevation in degrees, and number of rays of each scan.
fn summary(scans: &[PlaneScan]) -> Vec<(i64, i64, i64, usize)> {
    let degrees = |rad: f64| rad.to_degrees().round() as i64;
    let of = |scan: &PlaneScan| {
        let ends = [&scan.rays[0], &scan.rays[scan.rays.len() - 1]];
        let [first, last] = ends.map(|ray| degrees(ray.elevation_rad));
        let azimuth = scan.azimuth_rad.map_or(-1, degrees);
        (azimuth, first, last, scan.rays.len())
    };
    scans.iter().map(of).collect()
}

#[test]
fn scans_over_the_zenith_without_an_azimuth_all_face_alike() {
    let scan = |azimuth_rad: Option<f64>| {
        let map = ScanMap {
            elevation_rad: vec![0.7, 1.5, 2.0, 2.4],
            time_s: vec![0.0; 4],
            range_m: vec![50.0],
            velocity_m_s: Array2::from_shape_fn((4, 1), |(line, _)| line as f64),
            sigma_m_s: None,
            fold_m_s: None,
        };
        ReadScan {
            azimuth_rad,
            ..ReadScan::new(std::path::Path::new("a"), 0, map)
        }
    };
    for (azimuths, is_turned) in [
        ([None, None], false),
        ([Some(1.0), Some(1.0)], false),
        ([Some(1.0), Some(1.0 + PI)], true),
        ([Some(1.0), None], false),
    ] {
        let mut scans = azimuths.map(scan);
        let before = scans[1].clone();
        face_alike(&mut scans.iter_mut().collect::<Vec<_>>());
        assert_eq!(scans[1] != before, is_turned, "{azimuths:?}");
    }
}

#[test]
fn scans_end_where_the_elevation_turns() {
    let up = |n: usize| (0..n).map(|i| 0.01 * i as f64);
    let both: Vec<f64> = up(20).chain(up(20).rev().skip(1)).collect();
    assert_eq!(between_turns(&both), [0..20, 20..39]);
    let again: Vec<f64> = up(20).chain(up(20)).chain(up(20)).collect();
    assert_eq!(between_turns(&again), [0..20, 20..40, 40..60]);
    let mut shaky: Vec<f64> = up(20).collect();
    shaky[7] -= 0.011;
    assert_eq!(
        between_turns(&shaky),
        vec![std::ops::Range { start: 0, end: 20 }]
    );
}

#[test]
fn planes_in_turn_are_scans_of_their_own_and_rays_between_them_are_counted() {
    let way = [(40.0, 0.0), (62.3, 0.0), (84.4, 0.0)];
    let between = [(97.0, 11.0), (108.0, 6.0)];
    let all = way
        .into_iter()
        .chain(up(90.0))
        .chain(between)
        .chain(up(120.0));
    let all = all
        .chain(up(270.0).rev())
        .chain(up(90.0))
        .chain(up(90.0).rev().skip(1));
    let (scans, skipped) = in_order(rays(all)).unwrap();
    let expected = [
        (90, 2, 14, 61),
        (120, 2, 14, 61),
        (270, 14, 2, 61),
        (90, 2, 14, 61),
        (90, 14, 2, 60),
    ];
    assert_eq!(summary(&scans), expected);
    assert_eq!(
        skipped,
        [
            "5 of 309 rays lie outside its scans in elevation (RHI) at azimuth 90.0, 120.0, 270.0 degrees"
        ]
    );
}

#[test]
fn rays_beside_the_plane_and_isolated_or_impossible_elevations_are_skipped() {
    let mut all: Vec<(f64, f64)> = up(90.0).collect();
    all[20].0 = 101.0;
    all[30].1 = 45.0;
    all[40].1 = f64::NAN;
    all[50].1 = 200.0;
    all.insert(0, (88.5, 1.9));
    let (scans, skipped) = in_order(rays(all)).unwrap();
    assert_eq!(summary(&scans), [(90, 2, 14, 57)]);
    assert_eq!(
        skipped,
        [
            "2 of 62 rays have no elevation from -90 to 180 degrees",
            "3 of 60 rays lie outside its scans in elevation (RHI) at azimuth 90.0 degrees"
        ]
    );
}

#[test]
fn a_scan_over_the_zenith_is_one_with_elevations_beyond_it_in_any_order() {
    let jitter = |i: i32| 0.05 * f64::from(i % 3 - 1);
    let flipped = (12..=168).step_by(2).map(|e| match e > 90 {
        true => (190.0 + jitter(e), 180.0 - f64::from(e)),
        false => (10.0 - 360.0 + jitter(e), f64::from(e)),
    });
    let there: Vec<(f64, f64)> = flipped.collect();
    let back: Vec<(f64, f64)> = there.iter().rev().skip(1).copied().collect();
    let all = [there.clone(), back].concat();
    let (scans, skipped) = in_order(rays(all)).unwrap();
    assert_eq!(summary(&scans), [(10, 12, 168, 79), (10, 166, 12, 78)]);
    assert!(skipped.is_empty());
    let azimuth_rad = scans[0].azimuth_rad.unwrap();
    assert!(
        (azimuth_rad - 10f64.to_radians()).abs() < 1e-9,
        "{azimuth_rad}"
    );
    let shuffled: Vec<(f64, f64)> = (0..79).map(|i| there[i * 7 % 79]).collect();
    let (scans, _) = in_any_order(rays(shuffled)).unwrap();
    assert_eq!((scans.len(), scans[0].rays.len()), (1, 79));
    // Scans of both sides that do not come near the zenith are two.
    let (scans, _) = in_order(rays(up(10.0).chain(up(190.0).rev()))).unwrap();
    assert_eq!(summary(&scans), [(10, 2, 14, 61), (190, 14, 2, 61)]);
    let (scans, _) = in_any_order(rays(up(10.0).chain(up(190.0)))).unwrap();
    assert_eq!(summary(&scans), [(10, 2, 14, 61), (190, 2, 14, 61)]);
}

#[test]
fn azimuths_about_north_are_one_plane_and_those_of_a_degree_are_two() {
    let about = up(0.0)
        .enumerate()
        .map(|(i, (_, e))| (if i % 2 == 0 { 359.9 } else { 0.1 }, e));
    let (scans, skipped) = in_order(rays(about)).unwrap();
    assert_eq!(
        (scans.len(), scans[0].rays.len(), skipped.len()),
        (1, 61, 0)
    );
    let (scans, _) = in_order(rays(up(359.0).chain(up(1.0).rev()))).unwrap();
    assert_eq!(summary(&scans), [(359, 2, 14, 61), (1, 14, 2, 61)]);
    let scan = |azimuth: f64| ReadScan {
        azimuth_rad: Some(azimuth.to_radians()),
        ..ReadScan::new(
            std::path::Path::new("x"),
            0,
            ScanMap {
                elevation_rad: vec![],
                time_s: vec![],
                range_m: vec![],
                velocity_m_s: Array2::zeros((0, 0)),
                sigma_m_s: None,
                fold_m_s: None,
            },
        )
    };
    let scans = [359.0, 1.0, -1.0, 359.9, 0.1, 361.0].map(scan);
    assert_eq!(plane_numbers(&scans), [0, 1, 0, 2, 2, 1]);
}

#[test]
fn cuts_at_one_elevation_and_elevations_of_another_unit_are_no_scans() {
    let ppi = (0..90).map(|i| (4.0 * f64::from(i), 3.0));
    let reason = in_order(rays(ppi.clone())).unwrap_err();
    assert!(
        reason.contains("it has azimuths from") && reason.contains("RHI"),
        "{reason}"
    );
    let slow = (0..90).map(|i| (0.3 * f64::from(i), 3.0));
    let (scans, skipped) = in_order(rays(up(90.0).chain(slow.clone()).chain(up(90.0)))).unwrap();
    assert_eq!(summary(&scans), [(90, 2, 14, 61), (90, 2, 14, 61)]);
    assert!(skipped[0].starts_with("90 of 212 rays"), "{skipped:?}");
    // Azimuth and elevation turn together.
    let spiral = (0..90).map(|i| (0.3 * f64::from(i), 3.0 + 0.2 * f64::from(i)));
    assert!(in_order(rays(spiral)).unwrap_err().contains("azimuths"));
    let mut degrees = rays(up(90.0));
    degrees
        .iter_mut()
        .for_each(|ray| ray.elevation_rad = ray.elevation_rad.to_degrees());
    assert!(in_order(degrees).unwrap_err().contains("elevation is"));
    let below = (0..61).map(|i| (90.0, (352.0 + 0.2 * f64::from(i)) % 360.0));
    let (scans, _) = in_order(rays(below)).unwrap();
    assert_eq!(summary(&scans), [(90, -8, 4, 61)]);
}
