//! The lines of sight of a scene's scan, from its pattern, its head and the place of its lidar.
//! Check: an RHI has the lines and times of before; what a list or the ground forbids is refused with its key.

use crate::Error;
use crate::beams::path::{self, Stop};
use crate::beams::schedule::Schedule;
use crate::beams::{Head, Mount};
use crate::io::scan_list;
use crate::keys::Problem;
use crate::scene::{HeadMotion, Outside, Pattern, Scene, SceneFile, SweepDirection, Towards};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

/// The lines of sight of a checked scene; a list is looked for relative to the folder of the scene.
///
/// # Errors
/// A list that cannot be read or followed; beams that meet the ground where the scene does not allow it.
pub(crate) fn schedule(file: &SceneFile) -> Result<Schedule, Error> {
    let scene = &file.content;
    let s = &scene.scan;
    let head = &scene.scan.head;
    let prt_s = 1.0 / scene.laser.pulse_repetition_hz;
    let head = Head {
        rate_rad_s: head.rate_rad_s,
        acceleration_rad_s2: head.acceleration_rad_s2,
        dead_time_s: head.dead_time_s,
    };
    let of_key = Error::of_key("scan.pattern.file");
    let (stops, path) = match &s.pattern {
        Pattern::List { file: list } => {
            let path = file.folder().join(list);
            (scan_list::read(&path).map_err(of_key)?, path)
        }
        // Only a list asks for times, which may be too early.
        _ => (stops(scene), PathBuf::new()),
    };
    let scan = Schedule::new(&stops, prt_s, s.pulses_per_line, &head, mount(scene)).map_err(
        |(i, reason)| {
            let time_s = stops.get(i).and_then(|stop| stop.time_s).unwrap_or(0.0);
            of_key(Error::Input {
                path,
                reason: format!("row {}: time_s = {time_s:?}: {reason}", i + 1),
            })
        },
    )?;
    above_ground(file, &scan)?;
    Ok(scan)
}

/// North, and where the lidar is.
fn mount(scene: &Scene) -> Mount {
    let s = &scene.scan;
    let l = &scene.scan.lidar;
    let reference_rad = match (l.flight_azimuth_rad, &s.pattern) {
        (Some(azimuth_rad), _) => (azimuth_rad, 0.0),
        // The plane of a scan across the flight, whatever it is called.
        (None, Pattern::Rhi {}) => (s.azimuth_rad, FRAC_PI_2),
        (None, _) => (0.0, 0.0),
    };
    Mount {
        position_m: [l.x_m, l.y_m, s.lidar_height_m],
        velocity_m_s: l.velocity_m_s,
        reference_rad,
    }
}

/// The stops of a pattern, whose sweeps are repeated as often as the scene says.
fn stops(scene: &Scene) -> Vec<Stop> {
    let s = &scene.scan;
    let moving = s.head.motion == HeadMotion::Continuous;
    let rows = || {
        path::steps(
            s.elevation_min_rad,
            s.elevation_max_rad,
            s.elevation_step_rad,
        )
    };
    let once = match &s.pattern {
        Pattern::Rhi {} => {
            vec![path::rhi(
                s.azimuth_rad,
                s.elevation_min_rad,
                s.elevation_max_rad,
                s.elevation_step_rad,
                moving,
            )]
        }
        Pattern::Ppi {
            elevations_rad,
            azimuth_min_rad,
            azimuth_max_rad,
            azimuth_step_rad,
        } => {
            let row = |el: &f64| {
                path::ppi(
                    *el,
                    *azimuth_min_rad,
                    *azimuth_max_rad,
                    *azimuth_step_rad,
                    moving,
                )
            };
            elevations_rad.iter().map(row).collect()
        }
        Pattern::Vad {
            elevation_rad,
            beams,
        } => vec![path::vad(*elevation_rad, *beams)],
        Pattern::Dbs { elevation_rad } => vec![path::dbs(*elevation_rad)],
        Pattern::Stare {
            elevation_rad,
            lines,
        } => vec![path::stare(s.azimuth_rad, *elevation_rad, *lines)],
        Pattern::Axial {
            towards,
            azimuth_min_rad,
            azimuth_max_rad,
            azimuth_step_rad,
        } => {
            let (zero_rad, from_x_rad) = mount(scene).reference_rad;
            let along_rad = zero_rad - from_x_rad;
            let axis_rad = along_rad + if *towards == Towards::PlusX { 0.0 } else { PI };
            path::raster(
                axis_rad,
                &rows(),
                [*azimuth_min_rad, *azimuth_max_rad, *azimuth_step_rad],
                moving,
            )
        }
        Pattern::List { .. } => Vec::new(),
    };
    let mut all = Vec::new();
    for sweep in 0..s.head.sweeps * once.len() {
        let mut stops = once[sweep % once.len()].clone();
        if s.head.direction == SweepDirection::Alternate && sweep % 2 == 1 {
            path::reverse(&mut stops);
        }
        all.extend(stops.into_iter().map(|stop| Stop { sweep, ..stop }));
    }
    all
}

/// Refuses beams below the ground.
fn above_ground(file: &SceneFile, scan: &Schedule) -> Result<(), Error> {
    let s = &file.content.scan;
    if s.below_ground != (Outside::Error {}) {
        return Ok(());
    }
    let low = |beam: &crate::beams::Beam| beam.position_m[2].min(beam.at_range_m(s.range_max_m)[2]);
    let Some(lowest) = scan
        .ends()
        .min_by(|a, b| low(a).total_cmp(&low(b)))
        .filter(|beam| low(beam) < -1e-9)
    else {
        return Ok(());
    };
    let problem = Problem::new(
        s.pattern.lowest_key(),
        format!("{:?}", lowest.elevation_rad),
        format!(
            "beams above the ground up to scan.range_max_m; the one at {:.3} s ends {:.3} m below it, which \
             scan.below_ground.policy = \"mask\" allows",
            lowest.time_s,
            -low(&lowest)
        ),
    );
    Err(file.located(vec![problem]))
}
