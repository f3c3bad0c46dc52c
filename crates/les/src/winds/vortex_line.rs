//! Vortices of any axis: straight without end, or polylines of segments, with the circulation (3), (4) of the pair's profile.
//!
//! A segment has the kernel `R/(R^2 + rc^2)^(3/2)` of Biot and Savart with a core; put together without end it is the algebraic
//! profile. Check: a table of velocities of lines and segments; a line along the flight is the vortex of the pair; a long
//! segment tends to the line.

use std::f64::consts::PI;

use super::profile::CirculationProfile;
use super::vortex::Ground;
use super::wind::Wind;
use crate::error::{Error, check, check_lengths};

/// One vortex; anticlockwise about its axis is positive for an axis that points along +x and is seen with y to the right.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexLine {
    /// Places that the vortex goes through, in order, m: two of a straight one without end, or all corners of a polyline.
    pub nodes_m: Vec<[f64; 3]>,
    /// Whether it goes on beyond its two nodes.
    pub endless: bool,
    /// Circulation, m^2/s.
    pub circulation_m2_s: f64,
    /// Radius of the largest tangential velocity, m.
    pub core_radius_m: f64,
    /// Speed of the air along the axis in its middle, against its direction, m/s, falling off as `exp(-d^2/rc^2)`; of endless
    /// vortices.
    pub axial_deficit_m_s: f64,
}

/// Several vortices, with their images below the ground if there is one.
#[derive(Debug, Clone, PartialEq)]
pub struct VortexLines {
    lines: Vec<VortexLine>,
    max_gradient_per_s: f64,
}

impl VortexLines {
    /// The wind of these vortices.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for fewer than two nodes, or more of an endless vortex, nodes in one place, a core that is not
    /// positive, numbers that are not finite.
    pub fn new(lines: Vec<VortexLine>, ground: Ground) -> Result<Self, Error> {
        for line in &lines {
            let nodes = line.nodes_m.len();
            let fits = if line.endless { nodes == 2 } else { nodes >= 2 };
            let allowed = "2 of an endless vortex, 2 or more of another";
            check("number of nodes", nodes as f64, allowed, |_| fits)?;
            for pair in line.nodes_m.windows(2) {
                check(
                    "distance of nodes_m",
                    norm(minus(pair[1], pair[0])),
                    "finite and positive",
                    |d| d > 0.0,
                )?;
            }
            check("circulation_m2_s", line.circulation_m2_s, "finite", |_| {
                true
            })?;
            check("core_radius_m", line.core_radius_m, "positive", |r| r > 0.0)?;
            check(
                "axial_deficit_m_s",
                line.axial_deficit_m_s,
                "finite",
                |_| true,
            )?;
        }
        let image = |line: &VortexLine| VortexLine {
            nodes_m: line.nodes_m.iter().map(|[x, y, z]| [*x, *y, -z]).collect(),
            circulation_m2_s: -line.circulation_m2_s,
            // Below the ground nothing is seen.
            axial_deficit_m_s: 0.0,
            ..line.clone()
        };
        let images: Vec<VortexLine> = match ground {
            Ground::Image => lines.iter().map(image).collect(),
            Ground::None => Vec::new(),
        };
        let lines: Vec<VortexLine> = lines.into_iter().chain(images).collect();
        let max_gradient_per_s = largest_gradient_per_s(&lines);
        Ok(Self {
            lines,
            max_gradient_per_s,
        })
    }
}

impl Wind for VortexLines {
    fn velocity_into(
        &self,
        points_m: &[[f64; 3]],
        _time_s: f64,
        out_m_s: &mut [[f64; 3]],
    ) -> Result<(), Error> {
        check_lengths(points_m.len(), out_m_s.len())?;
        for (point_m, out) in points_m.iter().zip(out_m_s) {
            *out = [0.0; 3];
            for line in &self.lines {
                line.add_velocity(*point_m, out);
            }
        }
        Ok(())
    }

    /// The strain of each vortex at its own core radius, plus what the others can add half-way to it.
    fn max_gradient_per_s(&self, _time_s: f64) -> f64 {
        self.max_gradient_per_s
    }
}

impl VortexLine {
    fn add_velocity(&self, point_m: [f64; 3], out_m_s: &mut [f64; 3]) {
        for ends in self.nodes_m.windows(2) {
            let (a, b) = (minus(ends[0], point_m), minus(ends[1], point_m));
            let whole = minus(ends[1], ends[0]);
            let length_m = norm(whole);
            let t = whole.map(|x| x / length_m);
            // The offset of the point from the axis, and the two ends along it.
            let (s1, s2) = (dot(t, a), dot(t, b));
            let d: [f64; 3] = std::array::from_fn(|i| s1 * t[i] - a[i]);
            let q = dot(d, d) + self.core_radius_m * self.core_radius_m;
            let reach = if self.endless {
                2.0
            } else {
                s2 / (s2 * s2 + q).sqrt() - s1 / (s1 * s1 + q).sqrt()
            };
            let strength = self.circulation_m2_s / (4.0 * PI) / q * reach;
            // The axes are left-handed, so the product is taken by components: along +x it turns y towards z.
            let turn = cross(t, d);
            for i in 0..3 {
                out_m_s[i] += strength * turn[i];
            }
            if self.axial_deficit_m_s != 0.0 && self.endless {
                let along = -self.axial_deficit_m_s
                    * (-dot(d, d) / (self.core_radius_m * self.core_radius_m)).exp();
                out_m_s
                    .iter_mut()
                    .zip(t)
                    .for_each(|(out, t)| *out += along * t);
            }
        }
    }

    fn own_gradient_per_s(&self) -> f64 {
        let axial =
            self.axial_deficit_m_s.abs() * (2.0 / std::f64::consts::E).sqrt() / self.core_radius_m;
        let turning = CirculationProfile::Algebraic;
        // A corner of a polyline adds up to as much as the segment itself.
        let corners = if self.nodes_m.len() > 2 { 2.0 } else { 1.0 };
        corners * turning.max_line_gradient_per_s(self.circulation_m2_s.abs(), self.core_radius_m)
            + 0.5 * axial
    }
}

fn largest_gradient_per_s(lines: &[VortexLine]) -> f64 {
    let added = |other: &VortexLine, line: &VortexLine| {
        let nearest_m = if other.endless && line.endless {
            distance_m(line, other)
        } else {
            let pairs = line
                .nodes_m
                .windows(2)
                .flat_map(|a| other.nodes_m.windows(2).map(move |b| (a, b)));
            pairs
                .map(|(a, b)| segment_distance_m([a[0], a[1]], [b[0], b[1]]))
                .fold(f64::INFINITY, f64::min)
        };
        let (profile, core_m) = (CirculationProfile::Algebraic, other.core_radius_m);
        // Beyond the core radius the strain only falls.
        profile.strain_rate_per_s(
            other.circulation_m2_s.abs(),
            core_m,
            (0.5 * nearest_m).max(core_m),
        )
    };
    let of = |i: usize| {
        let others = lines.iter().enumerate().filter(|(j, _)| *j != i);
        lines[i].own_gradient_per_s()
            + others
                .map(|(_, other)| added(other, &lines[i]))
                .sum::<f64>()
    };
    (0..lines.len()).map(of).fold(0.0, f64::max)
}

/// Distance of two straight lines without end.
fn distance_m(a: &VortexLine, b: &VortexLine) -> f64 {
    let (along_a, along_b) = (
        minus(a.nodes_m[1], a.nodes_m[0]),
        minus(b.nodes_m[1], b.nodes_m[0]),
    );
    let between = minus(b.nodes_m[0], a.nodes_m[0]);
    let normal = cross(along_a, along_b);
    if norm(normal) > 1e-12 * norm(along_a) * norm(along_b) {
        return dot(between, normal).abs() / norm(normal);
    }
    norm(cross(between, along_a)) / norm(along_a)
}

/// A distance that two segments certainly have: that of their middles less half of both lengths.
fn segment_distance_m(a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> f64 {
    let middle = |s: [[f64; 3]; 2]| std::array::from_fn(|i| 0.5 * (s[0][i] + s[1][i]));
    let half = |s: [[f64; 3]; 2]| 0.5 * norm(minus(s[1], s[0]));
    (norm(minus(middle(a), middle(b))) - half(a) - half(b)).max(0.0)
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 3] {
    [b * f - c * e, c * d - a * f, a * e - b * d]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
