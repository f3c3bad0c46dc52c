//! The wake that the lidar looks at: two vortices, their images below the ground, a background wind; its radial
//! velocity and the derivatives of that with respect to every parameter.
//!
//! A vortex turns the air about it with the angular velocity Omega(r^2) = Gamma(r) / (2 pi r^2), (3) and (4). Seen along a line
//! of elevation phi its radial velocity is s Omega (dy sin phi - dz cos phi), (dy, dz) the point seen from the centre, s = -1
//! for the left vortex (clockwise) and +1 for the right one, so that positive circulations move the air between them down.
//! Check: derivatives against difference quotients; the ground is a streamline; the peak of (4).

use multiversion::multiversion;
use std::f64::consts::PI;

use crate::error::{Error, finite, positive};
use crate::vortex_fit::wake::log_wind::log_of_height;

/// Root of 2 s + 1 = exp(s): makes the core radius that of the largest speed of a Lamb-Oseen vortex.
pub(crate) const LAMB_OSEEN_BETA: f64 = 1.256_431_208_626_169_6;

/// Number of parameters of a [`Wake`].
pub const PARAMETERS: usize = 11;
/// Number of those of a secondary vortex beside one of a pair: circulation, lateral position, height, and the natural logarithm of its core
/// radius over the height of its vortex.
pub(crate) const SECONDARY_PARAMETERS: usize = 4;

/// One parameter of a [`Wake`]; `as usize` is its place in gradients and covariances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Circulation of the left vortex \[m^2/s\].
    LeftCirculation,
    /// Circulation of the right vortex \[m^2/s\].
    RightCirculation,
    /// Lateral coordinate of the left vortex \[m\].
    LeftLateral,
    /// Height of the left vortex \[m\].
    LeftHeight,
    /// Lateral coordinate of the right vortex \[m\].
    RightLateral,
    /// Height of the right vortex \[m\].
    RightHeight,
    /// Core radius of the left vortex \[m\].
    LeftCore,
    /// Core radius of the right vortex \[m\].
    RightCore,
    /// Lateral wind at the ground \[m/s\].
    Wind,
    /// Change of the lateral wind with height \[1/s\].
    Shear,
    /// Logarithmic part of the lateral wind \[m/s\].
    LogWind,
}

/// One vortex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vortex {
    /// Circulation \[m^2/s\]; positive is clockwise for the left vortex and anticlockwise for the right one (y to the
    /// right, z up).
    pub circulation_m2_s: f64,
    /// Lateral coordinate y of the centre \[m\].
    pub lateral_position_m: f64,
    /// Height z of the centre over the ground \[m\].
    pub height_m: f64,
    /// Radius of the largest tangential velocity \[m\].
    pub core_radius_m: f64,
}

impl Vortex {
    /// One with its centre at that lateral coordinate and height.
    pub(crate) fn at(
        (lateral_position_m, height_m): (f64, f64),
        circulation_m2_s: f64,
        core_radius_m: f64,
    ) -> Self {
        Self {
            circulation_m2_s,
            lateral_position_m,
            height_m,
            core_radius_m,
        }
    }

    /// Lateral coordinate and height of the centre.
    pub(crate) fn place_m(&self) -> (f64, f64) {
        (self.lateral_position_m, self.height_m)
    }

    /// The same vortex `offset_m` to the right.
    pub(crate) fn beside(&self, offset_m: f64) -> Self {
        Self {
            lateral_position_m: self.lateral_position_m + offset_m,
            ..*self
        }
    }

    /// Distance of the centre from a place.
    pub(crate) fn away_m(&self, (lateral_m, height_m): (f64, f64)) -> f64 {
        (lateral_m - self.lateral_position_m).hypot(height_m - self.height_m)
    }

    /// The secondary vortex of that circulation, lateral coordinate, height and logarithm of the core radius over the height of this vortex.
    fn secondary(
        &self,
        [circulation_m2_s, lateral_m, height_m, log_core]: [f64; SECONDARY_PARAMETERS],
    ) -> Self {
        let core_radius_m = self.height_m * log_core.exp();
        Self::at((lateral_m, height_m), circulation_m2_s, core_radius_m)
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite("circulation_m2_s", self.circulation_m2_s)?;
        finite("lateral_position_m", self.lateral_position_m)?;
        finite("height_m", self.height_m)?;
        positive("core_radius_m", self.core_radius_m)
    }
}

/// Two vortices and the background wind, a log-linear profile (see [`Wake::wind_at_m_s`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wake {
    /// The vortex at smaller y.
    pub left: Vortex,
    /// The vortex at larger y.
    pub right: Vortex,
    /// Lateral wind at the ground \[m/s\], positive to larger y.
    pub lateral_wind_m_s: f64,
    /// Change of the lateral wind with height \[1/s\].
    pub wind_shear_per_s: f64,
    /// Logarithmic part of the lateral wind \[m/s\]: friction velocity over von Karman's constant in neutral air.
    pub log_wind_m_s: f64,
}

impl Wake {
    /// The parameters in the order of [`Parameter`].
    #[must_use]
    pub fn to_array(&self) -> [f64; PARAMETERS] {
        let l = &self.left;
        let r = &self.right;
        [
            l.circulation_m2_s,
            r.circulation_m2_s,
            l.lateral_position_m,
            l.height_m,
            r.lateral_position_m,
            r.height_m,
            l.core_radius_m,
            r.core_radius_m,
            self.lateral_wind_m_s,
            self.wind_shear_per_s,
            self.log_wind_m_s,
        ]
    }

    /// The wake of parameters in the order of [`Parameter`].
    #[must_use]
    pub fn from_array(p: &[f64; PARAMETERS]) -> Self {
        Self {
            left: Vortex::at((p[2], p[3]), p[0], p[6]),
            right: Vortex::at((p[4], p[5]), p[1], p[7]),
            lateral_wind_m_s: p[8],
            wind_shear_per_s: p[9],
            log_wind_m_s: p[10],
        }
    }

    /// Two vortices without wind.
    pub(crate) fn calm(left: Vortex, right: Vortex) -> Self {
        Self {
            left,
            right,
            lateral_wind_m_s: 0.0,
            wind_shear_per_s: 0.0,
            log_wind_m_s: 0.0,
        }
    }

    /// An anticlockwise vortex of unit circulation alone, at that lateral position and height.
    pub(crate) fn of_unit_vortex(place_m: (f64, f64), core_radius_m: f64) -> Self {
        let right = Vortex::at(place_m, 1.0, core_radius_m);
        Self::calm(
            Vortex::at((place_m.0 - 1.0, place_m.1), 0.0, core_radius_m),
            right,
        )
    }

    /// The same vortices with that core radius.
    pub(crate) fn with_cores(&self, core_radius_m: f64) -> Self {
        let [left, right] = [self.left, self.right].map(|vortex| Vortex {
            core_radius_m,
            ..vortex
        });
        Self {
            left,
            right,
            ..*self
        }
    }

    /// The same wind without vortices.
    pub(crate) fn wind_alone(&self) -> Self {
        let [left, right] = [self.left, self.right].map(|vortex| Vortex {
            circulation_m2_s: 0.0,
            ..vortex
        });
        Self {
            left,
            right,
            ..*self
        }
    }

    /// The wake of a list of parameters that begins with those of a wake.
    pub(crate) fn from_list(p: &[f64]) -> Self {
        Self::from_array(&std::array::from_fn(|i| p[i]))
    }

    /// Checks that all numbers are finite, cores positive, the left vortex left of the right one.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the field at fault.
    pub fn validate(&self) -> Result<(), Error> {
        self.left.validate()?;
        self.right.validate()?;
        positive(
            "distance of the right vortex from the left one",
            self.spacing_m(),
        )?;
        finite("lateral_wind_m_s", self.lateral_wind_m_s)?;
        finite("wind_shear_per_s", self.wind_shear_per_s)?;
        finite("log_wind_m_s", self.log_wind_m_s)
    }

    /// Lateral wind \[m/s\] at a height \[m\]: u(z) = `lateral_wind_m_s` + z `wind_shear_per_s` + `log_wind_m_s` l(z), a log-linear law
    /// (Monin and Obukhov 1954). l(z) is ln(1 + z / 1 m) without its straight line over the lowest 100 m, so that the first two are the straight
    /// line of the profile.
    #[must_use]
    pub fn wind_at_m_s(&self, height_m: f64) -> f64 {
        self.lateral_wind_m_s
            + self.wind_shear_per_s * height_m
            + self.log_wind_m_s * log_of_height(height_m)
    }

    /// Whether both vortices have a circulation: one without is none.
    pub(crate) fn is_pair(&self) -> bool {
        self.left.circulation_m2_s != 0.0 && self.right.circulation_m2_s != 0.0
    }

    /// Lateral distance of the vortices \[m\].
    #[must_use]
    pub fn spacing_m(&self) -> f64 {
        self.right.lateral_position_m - self.left.lateral_position_m
    }
}

/// Circulation of a vortex as a function of the distance from its centre.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum CoreProfile {
    /// Gamma r^2 / (r^2 + r_c^2), equation (3).
    #[default]
    Algebraic,
    /// Gamma (1 - exp(-1.2564 r^2 / r_c^2)), Lamb (1932), section 334a.
    LambOseen,
}

impl CoreProfile {
    /// The one that it is not.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Algebraic => Self::LambOseen,
            Self::LambOseen => Self::Algebraic,
        }
    }

    /// Omega, its derivative with respect to r^2 and to the core radius, for unit circulation.
    #[inline(always)]
    pub(crate) fn angular(self, r2: f64, core_m: f64) -> (f64, f64, f64) {
        let core2 = core_m * core_m;
        match self {
            Self::Algebraic => {
                let omega = 1.0 / (2.0 * PI * (r2 + core2));
                let slope = -2.0 * PI * omega * omega;
                (omega, slope, 2.0 * core_m * slope)
            }
            Self::LambOseen => {
                let s = LAMB_OSEEN_BETA * r2 / core2;
                let decay = (-s).exp();
                // (1 - exp(-s))/s and its slope, by their series where the quotients would cancel
                let (ratio, slope) = if s < 1e-3 {
                    (1.0 - s / 2.0 + s * s / 6.0, -0.5 + s / 3.0 - s * s / 8.0)
                } else {
                    (-(-s).exp_m1() / s, (decay * (1.0 + s) - 1.0) / (s * s))
                };
                let scale = LAMB_OSEEN_BETA / (2.0 * PI * core2);
                (
                    scale * ratio,
                    scale * slope * LAMB_OSEEN_BETA / core2,
                    -2.0 * scale * decay / core_m,
                )
            }
        }
    }
}

/// What is known of the scene and not fitted: profile, ground, and where the lidar stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeModel {
    /// Circulation against radius.
    pub profile: CoreProfile,
    /// Whether the ground z = 0 is a streamline, made so by image vortices.
    pub images: bool,
    /// Lateral coordinate of the lidar \[m\].
    pub lidar_lateral_position_m: f64,
    /// Height of the lidar over the ground \[m\].
    pub lidar_height_m: f64,
    /// Secondary vortices of the left and the right vortex, which the boundary layer at the ground has rolled up into, if any are known:
    /// they turn against their vortex, so that their circulation is negative. Lines of sight see them; they move neither vortices nor
    /// aircraft.
    pub secondary: Option<[Vortex; 2]>,
}

impl Default for WakeModel {
    /// Profile (3), images, the lidar at the origin on the ground, no secondary vortices.
    fn default() -> Self {
        Self {
            profile: CoreProfile::Algebraic,
            images: true,
            lidar_lateral_position_m: 0.0,
            lidar_height_m: 0.0,
            secondary: None,
        }
    }
}

/// A line of sight with its sine and cosine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    sin: f64,
    cos: f64,
}

impl Ray {
    pub(crate) fn new(elevation_rad: f64) -> Self {
        let (sin, cos) = elevation_rad.sin_cos();
        Self { sin, cos }
    }
}

impl WakeModel {
    /// Lateral coordinate and height \[m\] of a point.
    #[must_use]
    pub fn position_m(&self, range_m: f64, elevation_rad: f64) -> (f64, f64) {
        self.place(range_m, Ray::new(elevation_rad))
    }

    #[inline(always)]
    fn place(&self, range_m: f64, ray: Ray) -> (f64, f64) {
        (
            self.lidar_lateral_position_m + range_m * ray.cos,
            self.lidar_height_m + range_m * ray.sin,
        )
    }

    /// Radial velocity \[m/s\], positive away from the lidar.
    #[must_use]
    pub fn radial_velocity_m_s(&self, wake: &Wake, range_m: f64, elevation_rad: f64) -> f64 {
        let mut velocities = [Vec::new()];
        self.along(wake, &[range_m], Ray::new(elevation_rad), &mut velocities);
        velocities[0][0]
    }

    /// Radial velocity \[m/s\] and its derivatives, in the order of [`Parameter`].
    #[must_use]
    pub fn gradient(
        &self,
        wake: &Wake,
        range_m: f64,
        elevation_rad: f64,
    ) -> (f64, [f64; PARAMETERS]) {
        self.gradients(wake, &[range_m], Ray::new(elevation_rad))[0]
    }

    /// Whether the model exists for a list of parameters: with images, above the ground only.
    pub(crate) fn allows(&self, p: &[f64]) -> bool {
        let (Self { secondary, .. }, wake) = self.with(p);
        let mut all = [&wake.left, &wake.right]
            .into_iter()
            .chain(secondary.iter().flatten());
        wake.validate().is_ok() && (!self.images || all.all(|vortex| vortex.height_m > 0.0))
    }

    /// The model and the wake of a list of parameters: those of a wake and, if there are more, those of a secondary vortex beside each vortex.
    pub(crate) fn with(&self, p: &[f64]) -> (Self, Wake) {
        let wake = Wake::from_list(p);
        let secondary = match p[PARAMETERS..].as_chunks().0 {
            [left, right] => Some([wake.left.secondary(*left), wake.right.secondary(*right)]),
            _ => self.secondary,
        };
        (Self { secondary, ..*self }, wake)
    }

    /// Distance at which a line of sight passes the centre of a vortex \[m\].
    pub(crate) fn passes_m(&self, ray: Ray, vortex: &Vortex) -> f64 {
        let dy = vortex.lateral_position_m - self.lidar_lateral_position_m;
        let dz = vortex.height_m - self.lidar_height_m;
        (dy * ray.sin - dz * ray.cos).abs()
    }

    /// (vortex, index of its circulation, y, z and core, height of the centre over its sign, sense of turning).
    pub(crate) fn sources<'w>(
        &self,
        wake: &'w Wake,
    ) -> impl Iterator<Item = (&'w Vortex, [usize; 4], f64, f64)> + use<'w> {
        const LEFT: [usize; 4] = [0, 2, 3, 6];
        const RIGHT: [usize; 4] = [1, 4, 5, 7];
        let images = self.images;
        let all = [
            (&wake.left, LEFT, 1.0, -1.0),
            (&wake.left, LEFT, -1.0, 1.0),
            (&wake.right, RIGHT, 1.0, 1.0),
            (&wake.right, RIGHT, -1.0, -1.0),
        ];
        all.into_iter()
            .filter(move |source| images || source.2 > 0.0)
    }

    /// Radial velocities at points of a line with their derivatives.
    pub(crate) fn gradients(
        &self,
        wake: &Wake,
        range_m: &[f64],
        ray: Ray,
    ) -> Vec<(f64, [f64; PARAMETERS])> {
        let mut rows = vec![Vec::new(); PARAMETERS + 1];
        self.along(wake, range_m, ray, &mut rows);
        (0..range_m.len())
            .map(|i| (rows[0][i], std::array::from_fn(|place| rows[place + 1][i])))
            .collect()
    }

    /// Radial velocities at points of a line, in the first row, and, if there are more rows, their derivatives.
    pub(crate) fn along(&self, wake: &Wake, range_m: &[f64], ray: Ray, rows: &mut [Vec<f64>]) {
        for row in rows.iter_mut() {
            row.clear();
            row.resize(range_m.len(), 0.0);
        }
        let slopes = rows.len() > 1;
        for (i, range_m) in range_m.iter().enumerate() {
            let (_, z_m) = self.place(*range_m, ray);
            rows[0][i] = wake.wind_at_m_s(z_m) * ray.cos;
            if slopes {
                rows[Parameter::Wind as usize + 1][i] = ray.cos;
                rows[Parameter::Shear as usize + 1][i] = z_m * ray.cos;
                rows[Parameter::LogWind as usize + 1][i] = log_of_height(z_m) * ray.cos;
            }
        }
        // a search tries vortices one by one
        for (vortex, places, side, sense) in self
            .sources(wake)
            .filter(|s| slopes || s.0.circulation_m2_s != 0.0)
        {
            add_along(
                (self, (vortex, side, sense), range_m, ray),
                rows,
                slopes.then_some(places),
            );
        }
        let secondary = self.secondary.map(|[left, right]| Wake {
            left,
            right,
            ..*wake
        });
        for (vortex, _, side, sense) in secondary
            .iter()
            .flat_map(|secondary| self.sources(secondary))
        {
            add_along((self, (vortex, side, sense), range_m, ray), rows, None);
        }
    }
}

/// A vortex or an image, height of the centre over its sign, sense of turning.
type Source<'a> = (&'a Vortex, f64, f64);

/// Radial velocity of one vortex or image and its derivatives by circulation, y, z and core.
#[inline(always)]
fn of_source(
    profile: CoreProfile,
    (vortex, side, sense): Source<'_>,
    (y_m, z_m): (f64, f64),
    ray: Ray,
) -> (f64, [f64; 4]) {
    let dy = y_m - vortex.lateral_position_m;
    let dz = z_m - side * vortex.height_m;
    let (omega, by_r2, by_core) = profile.angular(dy * dy + dz * dz, vortex.core_radius_m);
    let arm = dy * ray.sin - dz * ray.cos;
    let strength = sense * vortex.circulation_m2_s;
    let by_lateral = -strength * (2.0 * dy * by_r2 * arm + omega * ray.sin);
    let by_height = side * strength * (omega * ray.cos - 2.0 * dz * by_r2 * arm);
    (
        strength * omega * arm,
        [
            sense * omega * arm,
            by_lateral,
            by_height,
            strength * by_core * arm,
        ],
    )
}

/// A source, and the points of a line.
type Along<'a> = (&'a WakeModel, Source<'a>, &'a [f64], Ray);

/// Adds the velocities of a source at points of a line to the first row, and their derivatives to those of its parameters.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn add_along(along: Along<'_>, rows: &mut [Vec<f64>], slopes: Option<[usize; 4]>) {
    // with a profile that is known here points are taken side by side
    match along.0.profile {
        CoreProfile::Algebraic => add(CoreProfile::Algebraic, along, rows, slopes),
        CoreProfile::LambOseen => add(CoreProfile::LambOseen, along, rows, slopes),
    }
}

#[inline(always)]
fn add(
    profile: CoreProfile,
    (model, source, range_m, ray): Along<'_>,
    rows: &mut [Vec<f64>],
    slopes: Option<[usize; 4]>,
) {
    let Some([a, b, c, d]) = slopes else {
        for (velocity, &range_m) in rows[0].iter_mut().zip(range_m) {
            *velocity += of_source(profile, source, model.place(range_m, ray), ray).0;
        }
        return;
    };
    let Ok(rows) = rows.get_disjoint_mut([0, a + 1, b + 1, c + 1, d + 1]) else {
        return;
    };
    let mut rows = rows.map(|row| &mut row[..range_m.len()]);
    for (i, &range_m) in range_m.iter().enumerate() {
        let (velocity, [a, b, c, d]) = of_source(profile, source, model.place(range_m, ray), ray);
        for (row, by) in rows.iter_mut().zip([velocity, a, b, c, d]) {
            row[i] += by;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn wake() -> Wake {
        let vortex = |circulation_m2_s, lateral_position_m, height_m, core_radius_m| Vortex {
            circulation_m2_s,
            lateral_position_m,
            height_m,
            core_radius_m,
        };
        Wake {
            left: vortex(480.0, 376.5, 45.0, 2.0),
            right: vortex(520.0, 423.5, 49.0, 2.7),
            lateral_wind_m_s: 1.3,
            wind_shear_per_s: 0.02,
            log_wind_m_s: 0.4,
        }
    }

    /// (3) by hand: above its centre a left vortex moves the air to larger y, its secondary one to smaller y; so do their images below the
    /// ground with the opposite sense, and the slopes of the pair are those without them.
    #[test]
    fn secondary_vortices_are_seen_as_vortices_of_the_other_sense_with_images() {
        let vortex = |circulation_m2_s, lateral_position_m, height_m| Vortex {
            circulation_m2_s,
            lateral_position_m,
            height_m,
            core_radius_m: 5.0,
        };
        let secondary = Some([vortex(-200.0, 350.0, 30.0), vortex(-100.0, 450.0, 40.0)]);
        let level = WakeModel {
            lidar_height_m: 42.0,
            ..Default::default()
        };
        let with = WakeModel { secondary, ..level };
        // along y at z = 42 m, right above the left one
        let lateral_m_s =
            |turn: f64, dy: f64, dz: f64| turn * dz / (2.0 * PI * (dy * dy + dz * dz + 25.0));
        let expected = lateral_m_s(-200.0, 0.0, 12.0) + lateral_m_s(200.0, 0.0, 72.0)
            - lateral_m_s(-100.0, -100.0, 2.0)
            - lateral_m_s(100.0, -100.0, 82.0);
        let seen = with.radial_velocity_m_s(&wake(), 350.0, 0.0)
            - level.radial_velocity_m_s(&wake(), 350.0, 0.0);
        assert!(expected < -1.5);
        assert_relative_eq!(seen, expected, max_relative = 1e-12);
        let ((v, slope), (plain, alone)) = (
            with.gradient(&wake(), 350.0, 0.0),
            level.gradient(&wake(), 350.0, 0.0),
        );
        assert_relative_eq!(v - plain, expected, max_relative = 1e-12);
        assert_eq!(slope, alone);
    }

    #[test]
    fn derivatives_are_difference_quotients_for_both_profiles_with_and_without_ground() {
        for profile in [CoreProfile::Algebraic, CoreProfile::LambOseen] {
            for images in [true, false] {
                let model = WakeModel {
                    profile,
                    images,
                    lidar_lateral_position_m: -20.0,
                    lidar_height_m: 1.5,
                    secondary: None,
                };
                // the last two are inside a core, one within the series of the Lamb-Oseen profile
                for (range_m, elevation_rad) in [
                    (300.0, 0.05),
                    (420.0, 0.2),
                    (399.0, 0.109_3),
                    (398.923_6, 0.109_261),
                ] {
                    let (velocity, slope) = model.gradient(&wake(), range_m, elevation_rad);
                    assert_eq!(
                        velocity,
                        model.radial_velocity_m_s(&wake(), range_m, elevation_rad)
                    );
                    for index in 0..PARAMETERS {
                        let moved = |by: f64| {
                            let mut p = wake().to_array();
                            p[index] += by;
                            model.radial_velocity_m_s(&Wake::from_array(&p), range_m, elevation_rad)
                        };
                        let h = 1e-4;
                        let quotient = (8.0 * (moved(h) - moved(-h))
                            - (moved(2.0 * h) - moved(-2.0 * h)))
                            / (12.0 * h);
                        assert_relative_eq!(
                            slope[index],
                            quotient,
                            max_relative = 1e-8,
                            epsilon = 1e-9
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_ground_is_a_streamline_and_the_air_between_the_vortices_moves_down() {
        let model = WakeModel {
            lidar_lateral_position_m: 410.0,
            ..Default::default()
        };
        let wake = Wake {
            lateral_wind_m_s: 0.0,
            wind_shear_per_s: 0.0,
            log_wind_m_s: 0.0,
            ..wake()
        };
        let up = std::f64::consts::FRAC_PI_2;
        assert!(model.radial_velocity_m_s(&wake, 0.0, up).abs() < 1e-12);
        assert!(model.radial_velocity_m_s(&wake, 47.0, up) < -5.0);
    }

    #[test]
    fn a_vertical_line_through_a_core_sees_the_peak_velocity_at_the_core_radius() {
        // beside a lone right vortex, r_c to its right, the air rises at Gamma/(4 pi r_c)
        let wake = Wake {
            left: Vortex {
                circulation_m2_s: 0.0,
                ..wake().left
            },
            lateral_wind_m_s: 0.0,
            wind_shear_per_s: 0.0,
            log_wind_m_s: 0.0,
            ..wake()
        };
        let right = wake.right;
        for (profile, peak_m_s) in [
            (CoreProfile::Algebraic, 520.0 / (4.0 * PI * 2.7)),
            (
                CoreProfile::LambOseen,
                520.0 * (1.0 - (-LAMB_OSEEN_BETA).exp()) / (2.0 * PI * 2.7),
            ),
        ] {
            let model = WakeModel {
                profile,
                images: false,
                lidar_lateral_position_m: right.lateral_position_m + right.core_radius_m,
                ..Default::default()
            };
            let velocity =
                model.radial_velocity_m_s(&wake, right.height_m, std::f64::consts::FRAC_PI_2);
            assert_relative_eq!(velocity, peak_m_s, max_relative = 1e-12);
        }
    }

    #[test]
    fn impossible_wakes_are_refused_with_the_field_name() {
        assert!(wake().validate().is_ok());
        let mut bad = wake();
        bad.left.core_radius_m = 0.0;
        assert!(
            bad.validate()
                .unwrap_err()
                .to_string()
                .contains("core_radius_m")
        );
        let mut bad = wake();
        std::mem::swap(&mut bad.left, &mut bad.right);
        assert!(
            bad.validate()
                .unwrap_err()
                .to_string()
                .contains("right vortex")
        );
    }
}
