//! Lines of sight of all files in windows of time.
//!
//! Check: sweeps and stares over several files; times without a date; instruments at two places.

use super::directions::{Kind, components, distinct};
use crate::Error;
use crate::io::UtcTime;
use crate::io::scans::{Ray, RaySweep};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Duration of a window of files whose sweeps determine no wind, s.
const USUAL_WINDOW_S: f64 = 600.0;
/// Latitudes and longitudes of one place agree to this, degrees: some ten metres, to which receivers of satellites repeat.
const SAME_PLACE_DEG: f64 = 2e-4;

/// How rays are put together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Every {
    /// Each sweep where all of them determine a wind or are a scan in elevation, else ten minutes.
    Auto,
    /// Each sweep.
    Sweep,
    /// Windows of this many seconds of UTC.
    Seconds(f64),
}

/// Lines of sight of a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Its first and last time, s; NaN without times.
    pub start_s: f64,
    /// Its last time, s.
    pub end_s: f64,
    /// Its lines of sight.
    pub rays: Vec<Ray>,
}

/// Brings times to the first date from which some of them count. Returns that date, and the files whose times count from none: these have no
/// times then.
fn share_origin(sweeps: &mut [RaySweep]) -> (Option<UtcTime>, Vec<PathBuf>) {
    let mut undated = Vec::new();
    let Some(first) = sweeps.iter().find_map(|sweep| sweep.reference) else {
        return (None, undated);
    };
    for sweep in sweeps {
        let later_s = sweep
            .reference
            .map_or(f64::NAN, |own| own.seconds_since(first));
        let has_times = sweep.rays.iter().any(|ray| ray.time_s.is_finite());
        if sweep.reference.is_none() && has_times && undated.last() != Some(&sweep.path) {
            undated.push(sweep.path.clone());
        }
        for ray in &mut sweep.rays {
            ray.time_s += later_s;
        }
    }
    (Some(first), undated)
}

/// Windows with the date from which their times count, and what was skipped.
pub type FoundWindows = (Vec<Window>, Option<UtcTime>, Vec<String>);

/// The lines of sight of sweeps in windows, in the order of their times.
///
/// # Errors
/// Sweeps of two places in one window; windows of time without any time.
pub fn windows(mut sweeps: Vec<RaySweep>, every: Every) -> Result<FoundWindows, Error> {
    let (reference, undated) = share_origin(&mut sweeps);
    let mut notes = Vec::new();
    for path in undated {
        notes.push(format!(
            "{}: its times count from no date, those of other files do: its rays have no times",
            path.display()
        ));
    }
    let seconds = match every {
        Every::Seconds(seconds) => Some(seconds),
        Every::Sweep => None,
        Every::Auto => (!sweeps.iter().all(determines_wind)).then_some(USUAL_WINDOW_S),
    };
    let epoch = UtcTime::parse("1970-01-01T00:00:00Z");
    let both = reference.zip(epoch);
    let origin_s = both.map_or(0.0, |(reference, epoch)| reference.seconds_since(epoch));
    let (groups, without_time) = grouped(&sweeps, seconds, origin_s);
    if without_time > 0 {
        let text = format!("{without_time} rays have no time");
        if groups.is_empty() {
            let path = sweeps.first().map(|sweep| sweep.path.clone());
            let reason = format!("{text}: windows of time need them; --every sweep does not");
            return Err(Error::input(&path.unwrap_or_default(), reason));
        }
        notes.push(format!("{text}: skipped"));
    }
    let mut found = Vec::with_capacity(groups.len());
    for (key, group) in groups {
        have_one_place(&group)?;
        let mut rays: Vec<Ray> = group.into_iter().map(|(_, ray)| ray.clone()).collect();
        rays.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let start_s = match seconds {
            Some(seconds) => key as f64 * seconds - origin_s,
            None => rays.iter().map(|ray| ray.time_s).fold(f64::NAN, f64::min),
        };
        let end_s = match seconds {
            Some(seconds) => start_s + seconds,
            None => rays.iter().map(|ray| ray.time_s).fold(f64::NAN, f64::max),
        };
        found.push(Window {
            start_s,
            end_s,
            rays,
        });
    }
    found.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    Ok((found, reference, notes))
}

/// Rays by the numbers of their windows.
type Groups<'s> = BTreeMap<i64, Vec<(&'s RaySweep, &'s Ray)>>;

/// Rays by windows of seconds after the epoch, which is `origin_s` before the date of their times, or by sweeps; and how many have no
/// time where one is needed.
fn grouped(sweeps: &[RaySweep], seconds: Option<f64>, origin_s: f64) -> (Groups<'_>, usize) {
    let mut groups = Groups::new();
    let mut without_time = 0;
    for (number, sweep) in sweeps.iter().enumerate() {
        for ray in &sweep.rays {
            let key = match seconds {
                None => number as i64,
                Some(seconds) => ((origin_s + ray.time_s) / seconds).floor() as i64,
            };
            if seconds.is_some() && !ray.time_s.is_finite() {
                without_time += 1;
            } else {
                groups.entry(key).or_default().push((sweep, ray));
            }
        }
    }
    (groups, without_time)
}

/// Whether the beams of a sweep determine a full wind, or are a scan in elevation.
fn determines_wind(sweep: &RaySweep) -> bool {
    let directions = distinct(sweep.rays.iter().map(Ray::direction));
    directions.len() >= 3
        && components(&directions)
            .is_some_and(|found| matches!(found.kind, Kind::Full | Kind::Plane))
}

/// Refuses sweeps of two places.
fn have_one_place(group: &[(&RaySweep, &Ray)]) -> Result<(), Error> {
    let mut first: Option<(&RaySweep, [f64; 2])> = None;
    for (sweep, _) in group {
        let Some(place_deg) = sweep.place_deg else {
            continue;
        };
        let Some((other, other_deg)) = first else {
            first = Some((sweep, place_deg));
            continue;
        };
        let are_same = (0..2).all(|d| (place_deg[d] - other_deg[d]).abs() <= SAME_PLACE_DEG);
        if !are_same {
            return Err(Error::Input {
                path: sweep.path.clone(),
                reason: format!(
                    "its lidar is at latitude {} and longitude {} degrees, that of {} at {} and {}: winds of one window are of one lidar; \
                     run the command for the files of each",
                    place_deg[0],
                    place_deg[1],
                    other.path.display(),
                    other_deg[0],
                    other_deg[1]
                ),
            });
        }
    }
    Ok(())
}
