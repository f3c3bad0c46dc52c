//! Which components of the wind the directions of beams determine.
//!
//! Check: cones, stares, a scan in elevation, a sector near the horizon.

/// Beams within this angle of the vertical count as vertical, and beams of one plane agree in azimuth to it.
const SAME_PLANE_DEG: f64 = 2.0;
/// Beams within this angle are one direction.
const SAME_DIRECTION_DEG: f64 = 0.5;
/// Largest standard deviation of a component that is determined, for a deviation of 1 of each velocity.
const LARGEST_UNIT_STD: f64 = 5.0;

crate::keys::choice! {
    /// Which components a wind has.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    Kind {
        /// East, north and up.
        Full = "full",
        /// Along one azimuth and up.
        Plane = "plane",
        /// Up.
        Up = "up",
        /// Along one beam.
        Radial = "radial",
    }
}

/// The components that are fitted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Components {
    pub(super) kind: Kind,
    /// Unit vectors of the components (east, north, up); the vertical one is the last one where it is one of several.
    pub(super) axes: Vec<[f64; 3]>,
    /// Azimuth of a plane or a beam, degrees; NaN of others.
    pub(super) azimuth_deg: f64,
    /// Elevation of a beam, degrees; NaN of others.
    pub(super) elevation_deg: f64,
}

const EAST: [f64; 3] = [1.0, 0.0, 0.0];
const NORTH: [f64; 3] = [0.0, 1.0, 0.0];
pub(super) const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// Scalar product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Whether a beam counts as vertical.
pub(super) fn is_vertical(direction: [f64; 3]) -> bool {
    direction[2].abs() > SAME_PLANE_DEG.to_radians().cos()
}

/// Directions that differ.
pub(super) fn distinct(directions: impl IntoIterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
    let same = SAME_DIRECTION_DEG.to_radians().cos();
    let mut found: Vec<[f64; 3]> = Vec::new();
    for direction in directions {
        if !found.iter().any(|known| dot(*known, direction) > same) {
            found.push(direction);
        }
    }
    found
}

/// The components that directions determine, which differ from each other.
pub(super) fn components(directions: &[[f64; 3]]) -> Option<Components> {
    let slanted: Vec<[f64; 3]> = directions
        .iter()
        .copied()
        .filter(|e| !is_vertical(*e))
        .collect();
    let Some(first) = slanted.first() else {
        directions.first()?;
        return Some(Components {
            kind: Kind::Up,
            axes: vec![UP],
            azimuth_deg: f64::NAN,
            elevation_deg: 90.0,
        });
    };
    let azimuth_deg = first[0].atan2(first[1]).to_degrees().rem_euclid(360.0);
    if let [only] = directions {
        return Some(Components {
            kind: Kind::Radial,
            axes: vec![*only],
            azimuth_deg,
            elevation_deg: only[2].asin().to_degrees(),
        });
    }
    let level = first[0].hypot(first[1]);
    let along = [first[0] / level, first[1] / level, 0.0];
    let across = SAME_PLANE_DEG.to_radians().sin();
    let are_of_one_plane = slanted.iter().all(|e| {
        let outside = along[0] * e[1] - along[1] * e[0];
        outside.abs() <= across * e[0].hypot(e[1])
    });
    Some(if are_of_one_plane {
        Components {
            kind: Kind::Plane,
            axes: vec![along, UP],
            azimuth_deg,
            elevation_deg: f64::NAN,
        }
    } else {
        Components {
            kind: Kind::Full,
            axes: vec![EAST, NORTH, UP],
            azimuth_deg: f64::NAN,
            elevation_deg: f64::NAN,
        }
    })
}

impl Components {
    /// The axes along which velocities in these directions determine the wind: all, all but the vertical one, or none.
    pub(super) fn determined_by(&self, directions: &[[f64; 3]]) -> &[[f64; 3]] {
        if are_determined(&self.axes, directions) {
            return &self.axes;
        }
        match self.axes.split_last() {
            Some((last, level)) if *last == UP && are_determined(level, directions) => level,
            _ => &[],
        }
    }
}

/// Whether each component has a small enough standard deviation, for a deviation of 1 of a velocity in each direction.
fn are_determined(axes: &[[f64; 3]], directions: &[[f64; 3]]) -> bool {
    if directions.len() < axes.len() {
        return false;
    }
    let mut normal = [[0.0; 3]; 3];
    for direction in directions {
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate() {
                normal[i][j] += dot(*direction, *a) * dot(*direction, *b);
            }
        }
    }
    // Components that are not fitted.
    for (i, row) in normal.iter_mut().enumerate().skip(axes.len()) {
        row[i] = 1.0;
    }
    let mut determinant = 0.0;
    let mut minors = [0.0; 3];
    for i in 0..3 {
        let j = (i + 1) % 3;
        let k = (i + 2) % 3;
        minors[i] = normal[j][j] * normal[k][k] - normal[j][k] * normal[k][j];
        determinant += normal[0][i] * (normal[1][j] * normal[2][k] - normal[1][k] * normal[2][j]);
    }
    let trace = normal[0][0] + normal[1][1] + normal[2][2];
    if determinant <= 1e-12 * trace.powi(3) {
        return false;
    }
    let largest = LARGEST_UNIT_STD * LARGEST_UNIT_STD;
    minors
        .iter()
        .take(axes.len())
        .all(|minor| minor / determinant <= largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
        let (east, north) = azimuth_deg.to_radians().sin_cos();
        let (up, level) = elevation_deg.to_radians().sin_cos();
        [level * east, level * north, up]
    }

    fn kind(directions: &[[f64; 3]]) -> (Kind, usize) {
        let directions = distinct(directions.iter().copied());
        let found = components(&directions).unwrap();
        (found.kind, found.determined_by(&directions).len())
    }

    #[test]
    fn directions_tell_which_components_there_are() {
        let cone: Vec<_> = (0..12).map(|i| beam(30.0 * f64::from(i), 60.0)).collect();
        assert_eq!(kind(&cone), (Kind::Full, 3));
        let flat: Vec<_> = (0..12).map(|i| beam(10.0 * f64::from(i), 1.0)).collect();
        assert_eq!(kind(&flat), (Kind::Full, 2));
        let rhi: Vec<_> = (0..12).map(|i| beam(45.0, 3.0 * f64::from(i))).collect();
        assert_eq!(kind(&rhi), (Kind::Plane, 2));
        let over: Vec<_> = [30.0, 90.0, 150.0]
            .map(|elevation| beam(45.0, elevation))
            .into();
        assert_eq!(kind(&over), (Kind::Plane, 2));
        let flat_rhi: Vec<_> = (0..4).map(|i| beam(45.0, f64::from(i))).collect();
        assert_eq!(kind(&flat_rhi), (Kind::Plane, 1));
        assert_eq!(kind(&[beam(0.0, 90.0), beam(20.0, 89.0)]), (Kind::Up, 1));
        assert_eq!(kind(&[beam(33.0, 30.0)]), (Kind::Radial, 1));
        assert_eq!(kind(&[beam(0.0, 30.0), beam(90.0, 30.0)]), (Kind::Full, 2));
        assert_eq!(kind(&[beam(0.0, 3.0), beam(4.0, 3.0)]), (Kind::Full, 0));
    }
}
