//! Scans in elevation among the rays of a file: which rays lie in one vertical plane, and which are on the way between two.
//!
//! A plane is named by an azimuth. Beyond the zenith the elevation rises to 180 degrees, or the azimuth turns to the opposite one while
//! the elevation falls again: both describe the same lines of sight, and scans have the first. Rays that follow each other in one plane
//! are a scan until the elevation turns or jumps back. Rays outside the planes of the scans (a scanner that turns to the next plane, cuts
//! at one elevation) and rays of impossible or isolated elevation are skipped and counted.
//! Check: scans up and down, over the zenith, of several planes in turn, with transition rays, about azimuth 0.

use super::ReadScan;
use super::rays::Ray;
use super::velocities::drop_missing;
use ndarray::s;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::ops::Range;

/// Largest angle between a ray and the plane of its scan, rad, and between two rays of a scan.
const OFF_PLANE_RAD: f64 = 0.02;
const SPREAD_RAD: f64 = 0.03;
/// Scans of one plane agree in azimuth to this angle, rad: scanners repeat a direction to a tenth of a degree, and planes that are
/// scanned on purpose are a degree apart.
const SAME_PLANE_RAD: f64 = 0.01;
/// Latitudes and longitudes of one place agree to this, degrees: some ten metres, to which receivers of satellites repeat.
pub(super) const SAME_PLACE_DEG: f64 = 2e-4;
/// A scan extends farther in elevation than across its plane, by this factor: where azimuth and elevation turn together there is no plane.
const FLATNESS: f64 = 3.0;
/// The azimuth says nothing where the cosine of the elevation is smaller.
const NEAR_ZENITH: f64 = 0.05;
/// Fraction of a scan's elevations that a line must go back for another scan to begin.
const TURN: f64 = 0.1;
/// Elevations of a scan, with rounding, rad: beyond the zenith it looks to the other side.
pub(super) const ALLOWED_RAD: std::ops::RangeInclusive<f64> = -FRAC_PI_2 - 1e-6..=PI + 1e-6;
/// Fraction of the rays whose elevations may be impossible; more say that the unit is another one.
const IMPOSSIBLE: f64 = 0.1;
/// An elevation is isolated if it is this many usual steps away from those before and after it, which are a few steps apart.
const ISOLATED_STEPS: f64 = 10.0;
const NEIGHBOUR_STEPS: f64 = 4.0;
/// Fewest rays among which an elevation can be isolated.
const FEWEST_RAYS: usize = 8;
/// Fewest different elevations of a scan, and the least extent of those of one that is no stare, rad.
pub(super) const FEWEST_LINES: usize = 3;
const LEVEL_RAD: f64 = 1e-3;
/// Most rays outside the plane within one scan.
const MOST_BETWEEN: usize = 5;

/// The rays of one scan, with elevations from -90 to 180 degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PlaneScan {
    /// From 0 to 2 pi; none if it is unknown.
    pub(super) azimuth_rad: Option<f64>,
    pub(super) rays: Vec<Ray>,
}

/// Scans, and what was skipped.
pub(super) type Split = (Vec<PlaneScan>, Vec<String>);

/// A vertical plane through the lidar, by the azimuth of its front; NaN if it is unknown.
#[derive(Debug, Clone, Copy)]
struct Plane {
    azimuth_rad: f64,
}

impl Plane {
    /// The plane of the first ray whose azimuth says something.
    fn first_of<'r>(rays: impl IntoIterator<Item = &'r Ray>) -> Self {
        let azimuth_rad = rays.into_iter().find(|ray| is_directed(ray));
        Self {
            azimuth_rad: azimuth_rad.map_or(f64::NAN, |ray| ray.azimuth_rad),
        }
    }

    /// Azimuth of a ray relative to the front; 0 if either is unknown.
    fn turn_rad(self, ray: &Ray) -> f64 {
        let turn_rad = difference_rad(ray.azimuth_rad, self.azimuth_rad);
        if turn_rad.is_nan() { 0.0 } else { turn_rad }
    }

    /// Component of a ray across the plane, the sine of the angle between them.
    fn across(self, ray: &Ray) -> f64 {
        self.turn_rad(ray).sin() * ray.elevation_rad.cos()
    }

    /// Whether the azimuth of a ray is that of the back, so that its elevation counts beyond the zenith.
    fn is_behind(self, ray: &Ray) -> bool {
        self.turn_rad(ray).abs() > FRAC_PI_2
    }

    /// Whether a ray lies in the front of the plane.
    fn has_in_front(self, ray: &Ray) -> bool {
        self.across(ray).abs() <= OFF_PLANE_RAD && !self.is_behind(ray)
    }

    /// Whether a ray lies in the back of the plane.
    fn has_behind(self, ray: &Ray) -> bool {
        self.is_behind(ray) && self.across(ray).abs() <= OFF_PLANE_RAD
    }

    /// Elevation of a ray from the horizon in front, rad.
    fn elevation_rad(self, ray: &Ray) -> f64 {
        if self.is_behind(ray) {
            PI - ray.elevation_rad
        } else {
            ray.elevation_rad
        }
    }

    /// Azimuth of a ray or, of one behind, of its opposite, relative to the front.
    fn front_turn_rad(self, ray: &Ray) -> f64 {
        let turn_rad = self.turn_rad(ray);
        if self.is_behind(ray) {
            turn_rad - PI.copysign(turn_rad)
        } else {
            turn_rad
        }
    }

    /// Whether the scanner can have gone from one ray to the next within a scan: it comes to the other side over the zenith alone.
    fn goes_on(self, before: &Ray, next: &Ray) -> bool {
        let step_rad = self.elevation_rad(next) - self.elevation_rad(before);
        let is_in_front = !self.is_behind(before) && !self.is_behind(next);
        is_in_front || step_rad.abs() <= FRAC_PI_4
    }
}

/// Rays that follow each other in one plane.
struct Run<'r> {
    plane: Plane,
    /// Least and largest component across the plane.
    across: (f64, f64),
    rays: Vec<&'r Ray>,
}

impl<'r> Run<'r> {
    fn new(plane: Plane) -> Self {
        Self {
            plane,
            across: (f64::INFINITY, f64::NEG_INFINITY),
            rays: Vec::new(),
        }
    }

    /// Whether rays can follow its last one in its plane.
    fn takes(&self, rays: &[&Ray]) -> bool {
        let (low, high) = self.across_with(rays);
        let ends = self.rays.last().zip(rays.first());
        let goes_on = ends.is_none_or(|(before, next)| self.plane.goes_on(before, next));
        goes_on && high - low <= SPREAD_RAD
    }

    fn across_with(&self, rays: &[&Ray]) -> (f64, f64) {
        let across = rays.iter().map(|ray| self.plane.across(ray));
        across.fold(self.across, |(low, high), across| {
            (low.min(across), high.max(across))
        })
    }

    fn add(&mut self, rays: &[&'r Ray]) {
        self.across = self.across_with(rays);
        self.rays.extend(rays);
    }

    /// The scans of the run, without rays of isolated elevation.
    fn scans(&self) -> Vec<PlaneScan> {
        let is_isolated = isolated(&self.elevations_rad(&self.rays));
        let mut rays = Vec::with_capacity(self.rays.len());
        for (ray, is_isolated) in self.rays.iter().zip(is_isolated) {
            if !is_isolated {
                rays.push(*ray);
            }
        }
        let mut scans = Vec::new();
        for part in between_turns(&self.elevations_rad(&rays)) {
            scans.extend(in_one_plane(self.plane, &rays[part]));
        }
        scans
    }

    fn elevations_rad(&self, rays: &[&Ray]) -> Vec<f64> {
        rays.iter()
            .map(|ray| self.plane.elevation_rad(ray))
            .collect()
    }
}

/// The scans of rays in the order in which they were measured.
///
/// # Errors
/// Elevations or velocities that are impossible, as of another unit; rays of all azimuths.
pub(super) fn in_order(rays: Vec<Ray>) -> Result<Split, String> {
    split(rays, |rays| {
        runs(rays).iter().flat_map(Run::scans).collect()
    })
}

/// The scans of rays in any order, one for each plane.
///
/// # Errors
/// Elevations or velocities that are impossible, as of another unit; rays of all azimuths.
pub(super) fn in_any_order(rays: Vec<Ray>) -> Result<Split, String> {
    split(rays, by_plane)
}

/// The scans of rays in the order of their times.
///
/// # Errors
/// As [`in_order`].
pub(super) fn in_time(mut rays: Vec<Ray>) -> Result<Split, String> {
    rays.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    in_order(rays)
}

/// The scans of rays in any order: those of the order of their times where these show several that cover the same elevations of a plane, else one
/// for each plane.
///
/// # Errors
/// As [`in_any_order`].
pub(super) fn in_time_or_any_order(rays: Vec<Ray>) -> Result<Split, String> {
    if rays.iter().all(|ray| ray.time_s.is_finite())
        && let Ok(found) = in_time(rays.clone())
        && cover_elevations_again(&found.0)
    {
        return Ok(found);
    }
    in_any_order(rays)
}

/// Whether two scans of one plane, seen from either side, have more than half of the elevations of one of them in common. Single wrong times
/// cut a scan into parts that have not.
fn cover_elevations_again(scans: &[PlaneScan]) -> bool {
    let mut spans = Vec::with_capacity(scans.len());
    for scan in scans {
        let elevations = scan.rays.iter().map(|ray| ray.elevation_rad);
        let low = elevations.clone().fold(f64::INFINITY, f64::min);
        let high = elevations.fold(f64::NEG_INFINITY, f64::max);
        spans.push((scan.azimuth_rad, low, high));
    }
    for (number, (azimuth_rad, low, high)) in spans.iter().enumerate() {
        for (other_rad, other_low, other_high) in &spans[..number] {
            let apart = azimuth_rad
                .zip(*other_rad)
                .map_or(0.0, |(a, b)| (a - b).sin().abs());
            let common = high.min(*other_high) - low.max(*other_low);
            let shorter = (high - low).min(other_high - other_low);
            if apart < OFF_PLANE_RAD && shorter > 0.0 && common > 0.5 * shorter {
                return true;
            }
        }
    }
    false
}

/// The scans that `find` makes of the possible rays.
fn split(mut rays: Vec<Ray>, find: impl FnOnce(&[Ray]) -> Vec<PlaneScan>) -> Result<Split, String> {
    let mut skipped = Vec::new();
    skipped.extend(drop_impossible(&mut rays)?);
    let velocities = rays.iter_mut().map(|ray| ray.velocity_m_s.as_mut_slice());
    skipped.extend(drop_missing(&mut velocities.collect::<Vec<_>>())?);
    let count = rays.len();
    let azimuths = azimuths_degrees(&rays);
    let scans = find(&rays);
    if scans.is_empty() {
        if let Some((low, high)) = azimuths {
            return Err(format!(
                "it has azimuths from {low:.2} to {high:.2} degrees; a scan in elevation (RHI) has one"
            ));
        }
        // Few lines: the map that is made of them names what is missing.
        let azimuth_rad = Some(Plane::first_of(&rays).azimuth_rad).filter(|a| a.is_finite());
        return Ok((vec![PlaneScan { azimuth_rad, rays }], skipped));
    }
    let used: usize = scans.iter().map(|scan| scan.rays.len()).sum();
    if used < count {
        let outside = count - used;
        skipped.push(format!(
            "{outside} of {count} rays lie outside its scans in elevation (RHI){}",
            at_azimuths(&scans)
        ));
    }
    Ok((scans, skipped))
}

/// The azimuths of scans in words, if they are known.
fn at_azimuths(scans: &[PlaneScan]) -> String {
    let mut azimuths: Vec<String> = Vec::new();
    for azimuth_rad in scans.iter().filter_map(|scan| scan.azimuth_rad) {
        let degrees = format!("{:.1}", azimuth_rad.to_degrees());
        if !azimuths.contains(&degrees) {
            azimuths.push(degrees);
        }
    }
    if azimuths.is_empty() {
        return String::new();
    }
    format!(" at azimuth {} degrees", azimuths.join(", "))
}

fn is_impossible(ray: &Ray) -> bool {
    !ray.elevation_rad.is_nan() && !ALLOWED_RAD.contains(&ray.elevation_rad)
}

/// Removes rays without a possible elevation, in words; elevations below the horizon may count on from 270 degrees.
///
/// # Errors
/// Fails if so many are impossible that the unit must be another one.
fn drop_impossible(rays: &mut Vec<Ray>) -> Result<Option<String>, String> {
    let all = rays.len();
    for ray in rays.iter_mut() {
        if (TAU - FRAC_PI_2..=TAU).contains(&ray.elevation_rad) {
            ray.elevation_rad -= TAU;
        }
    }
    let count = rays.iter().filter(|ray| is_impossible(ray)).count();
    if let Some(bad) = rays.iter().find(|ray| is_impossible(ray))
        && count as f64 > (IMPOSSIBLE * all as f64).max(1.0)
    {
        return Err(format!(
            "elevation is {} degrees: from -90 to 180 are allowed, beyond 90 to the other side",
            bad.elevation_rad.to_degrees()
        ));
    }
    rays.retain(|ray| ALLOWED_RAD.contains(&ray.elevation_rad));
    let skipped = all - rays.len();
    Ok((skipped > 0)
        .then(|| format!("{skipped} of {all} rays have no elevation from -90 to 180 degrees")))
}

/// Rays that follow each other in one plane, where they can be a scan; a few rays between two such are skipped.
fn runs(rays: &[Ray]) -> Vec<Run<'_>> {
    let mut all: Vec<Run<'_>> = Vec::new();
    for (i, ray) in rays.iter().enumerate() {
        match all.last_mut().filter(|run| run.takes(&[ray])) {
            Some(run) => run.add(&[ray]),
            None => {
                let mut run = Run::new(Plane::first_of(&rays[i..]));
                run.add(&[ray]);
                all.push(run);
            }
        }
    }
    let mut kept: Vec<Run<'_>> = Vec::new();
    let mut between = 0;
    for run in all {
        if !can_be_a_scan(&run.rays) {
            between += run.rays.len();
            continue;
        }
        let is_near = between <= MOST_BETWEEN;
        match kept
            .last_mut()
            .filter(|last| is_near && last.takes(&run.rays))
        {
            Some(last) => last.add(&run.rays),
            None => kept.push(run),
        }
        between = 0;
    }
    kept
}

/// Rays of one side of a plane each, in the order in which they first come; both sides are one scan if both reach up to the zenith.
fn by_plane(rays: &[Ray]) -> Vec<PlaneScan> {
    let mut sides: Vec<Run<'_>> = Vec::new();
    for ray in rays {
        match sides.iter_mut().find(|side| side.plane.has_in_front(ray)) {
            Some(side) => side.rays.push(ray),
            None => {
                let mut side = Run::new(Plane::first_of([ray]));
                side.rays.push(ray);
                sides.push(side);
            }
        }
    }
    let mut scans = Vec::new();
    while !sides.is_empty() {
        let Run {
            plane, mut rays, ..
        } = sides.remove(0);
        if let Some(back) = sides.iter().position(|side| plane.has_behind(side.rays[0]))
            && reaches_up(&rays)
            && reaches_up(&sides[back].rays)
        {
            rays.extend(sides.remove(back).rays);
        }
        scans.extend(in_one_plane(plane, &rays));
    }
    scans
}

fn reaches_up(rays: &[&Ray]) -> bool {
    rays.iter().any(|ray| ray.elevation_rad > FRAC_PI_4)
}

/// The scan of rays near a plane: its azimuth is their median, and those too far from it are skipped; none where no plane is theirs.
fn in_one_plane(near: Plane, rays: &[&Ray]) -> Option<PlaneScan> {
    let directed = rays.iter().filter(|ray| is_directed(ray));
    let mut turns_rad: Vec<f64> = directed.map(|ray| near.front_turn_rad(ray)).collect();
    turns_rad.sort_by(f64::total_cmp);
    let turn_rad = turns_rad.get(turns_rad.len() / 2).copied();
    let plane = Plane {
        azimuth_rad: turn_rad.map_or(f64::NAN, |turn_rad| near.azimuth_rad + turn_rad),
    };
    let rays = rays
        .iter()
        .filter(|ray| plane.across(ray).abs() <= OFF_PLANE_RAD);
    let spread = extent(rays.clone().map(|ray| plane.across(ray)));
    let rays: Vec<Ray> = rays
        .map(|ray| Ray {
            elevation_rad: plane.elevation_rad(ray),
            ..(*ray).clone()
        })
        .collect();
    let is_flat = FLATNESS * spread <= extent(rays.iter().map(|ray| ray.elevation_rad));
    (is_flat && can_be_a_scan(&rays.iter().collect::<Vec<_>>())).then(|| PlaneScan {
        azimuth_rad: turn_rad.map(|_| plane.azimuth_rad.rem_euclid(TAU)),
        rays,
    })
}

/// Largest value less the smallest one; negative without any.
fn extent(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    high - low
}

/// Whether the azimuth of a ray is known and says something.
fn is_directed(ray: &Ray) -> bool {
    ray.azimuth_rad.is_finite() && ray.elevation_rad.cos().abs() > NEAR_ZENITH
}

/// Whether rays have enough elevations that differ.
fn can_be_a_scan(rays: &[&Ray]) -> bool {
    let mut all: Vec<f64> = rays.iter().map(|ray| ray.elevation_rad).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all.len() >= FEWEST_LINES && extent(all.into_iter()) >= LEVEL_RAD
}

/// Least and largest azimuth of rays, degrees, where they are of several planes; the largest may be above 360.
fn azimuths_degrees(rays: &[Ray]) -> Option<(f64, f64)> {
    let first = Plane::first_of(rays);
    let directed = rays.iter().filter(|ray| is_directed(ray));
    let turns = directed.map(|ray| first.turn_rad(ray));
    let (low, high) = turns.fold((0.0_f64, 0.0_f64), |(low, high), turn| {
        (low.min(turn), high.max(turn))
    });
    (high - low > OFF_PLANE_RAD).then(|| {
        (
            (first.azimuth_rad + low).to_degrees(),
            (first.azimuth_rad + high).to_degrees(),
        )
    })
}

/// Angle from one azimuth to another, rad, from -pi to pi.
fn difference_rad(azimuth_rad: f64, from_rad: f64) -> f64 {
    (azimuth_rad - from_rad + PI).rem_euclid(TAU) - PI
}

/// Which elevations are far from those before and after them, which are near each other.
fn isolated(elevation_rad: &[f64]) -> Vec<bool> {
    let count = elevation_rad.len();
    let steps = elevation_rad
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs());
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let Some(step) = steps.get(steps.len() / 2).filter(|_| count >= FEWEST_RAYS) else {
        return vec![false; count];
    };
    let mut is_isolated = Vec::with_capacity(count);
    for (i, own) in elevation_rad.iter().enumerate() {
        let [before, after] = match i {
            0 => [1, 2],
            last if last + 1 == count => [last - 2, last - 1],
            middle => [middle - 1, middle + 1],
        }
        .map(|neighbour| elevation_rad[neighbour]);
        let away = (own - before).abs().min((own - after).abs());
        let are_near = (after - before).abs() <= NEIGHBOUR_STEPS * step;
        is_isolated.push(away > ISOLATED_STEPS * step && are_near);
    }
    is_isolated
}

/// Scans that follow each other: a line that goes back by more than a tenth of all elevations begins another.
fn between_turns(elevation_rad: &[f64]) -> Vec<Range<usize>> {
    let back = TURN * extent(elevation_rad.iter().copied());
    let mut out = Vec::new();
    let mut first = 0;
    let mut extreme = 0;
    let mut direction = 0.0;
    for i in 1..elevation_rad.len() {
        let step = elevation_rad[i] - elevation_rad[extreme];
        if direction == 0.0 {
            if step.abs() > back {
                direction = step.signum();
                extreme = i;
            }
        } else if step * direction >= 0.0 {
            extreme = i;
        } else if step.abs() > back {
            out.push(first..extreme + 1);
            (first, direction) = (extreme + 1, 0.0);
            // What goes on the same way after a jump back is a scan, too.
            extreme = first;
        }
    }
    out.push(first..elevation_rad.len());
    out
}

/// Whether two scans are of one plane: of one place and one azimuth, as far as these are known.
#[must_use]
pub fn are_of_one_plane(one: &ReadScan, other: &ReadScan) -> bool {
    let is_one_azimuth = match (one.azimuth_rad, other.azimuth_rad) {
        (Some(one), Some(other)) => difference_rad(one, other).abs() <= SAME_PLANE_RAD,
        (one, other) => one == other,
    };
    let is_one_place = match (one.place_deg, other.place_deg) {
        (Some(one), Some(other)) => one
            .iter()
            .zip(other)
            .all(|(one, other)| (one - other).abs() <= SAME_PLACE_DEG),
        (one, other) => one == other,
    };
    is_one_azimuth && is_one_place
}

/// Numbers the planes of scans from 0 in the order in which they first come.
#[must_use]
pub fn plane_numbers<'s>(scans: impl IntoIterator<Item = &'s ReadScan>) -> Vec<usize> {
    let mut firsts: Vec<&ReadScan> = Vec::new();
    let mut numbers = Vec::new();
    for scan in scans {
        let known = firsts
            .iter()
            .position(|first| are_of_one_plane(first, scan));
        numbers.push(known.unwrap_or(firsts.len()));
        if known.is_none() {
            firsts.push(scan);
        }
    }
    numbers
}

/// Turns scans over the zenith that look back in the plane of one before, so that all of a plane have one azimuth. Scans of unknown azimuth
/// all face alike.
pub fn face_alike(scans: &mut [&mut ReadScan]) {
    for i in 0..scans.len() {
        let (before, rest) = scans.split_at_mut(i);
        let scan = &mut *rest[0];
        if scan.azimuth_rad.is_none() || !is_over_zenith(scan) {
            continue;
        }
        let turned = turned(scan);
        if before
            .iter()
            .any(|other| is_over_zenith(other) && are_of_one_plane(other, &turned))
        {
            *scan = turned;
        }
    }
}

fn is_over_zenith(scan: &ReadScan) -> bool {
    let elevation_rad = &scan.map.elevation_rad;
    let ends = elevation_rad.first().zip(elevation_rad.last());
    ends.is_some_and(|(first, last)| *first < FRAC_PI_2 && *last > FRAC_PI_2)
}

/// A scan with the opposite azimuth.
fn turned(scan: &ReadScan) -> ReadScan {
    let mut turned = scan.clone();
    let azimuth_rad = scan.azimuth_rad;
    turned.azimuth_rad = azimuth_rad.map(|azimuth_rad| (azimuth_rad + PI).rem_euclid(TAU));
    let map = &mut turned.map;
    map.elevation_rad.reverse();
    for elevation_rad in &mut map.elevation_rad {
        *elevation_rad = PI - *elevation_rad;
    }
    map.time_s.reverse();
    map.velocity_m_s = map.velocity_m_s.slice(s![..;-1, ..]).to_owned();
    if let Some(sigma_m_s) = &mut map.sigma_m_s {
        *sigma_m_s = sigma_m_s.slice(s![..;-1, ..]).to_owned();
    }
    turned
}

#[cfg(test)]
#[path = "planes_tests.rs"]
mod tests;
