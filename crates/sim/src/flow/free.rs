//! A user-supplied flow: mesh, walls, viscosity and initial field, in SI units.

use super::setup::{Initial, Setup};
use crate::Error;
use crate::keys::{ABOVE_ZERO, Checker, FINITE, ZERO_OR_MORE, keys};
use crate::scene::CoreProfile;
use std::path::Path;
use wakescope_les::solver::Ends;
use wakescope_les::{
    Direction, FlowSettings, Ground, Mapping, Mesh, Motion, Spread, TimeScheme, TimeStep,
    VortexPair, Wall, Wind,
};

crate::keys::foreign_choices! {
    Spread {
        Uniform = "uniform",
        Sine = "sine",
        TanhLow = "tanh_low",
        TanhHigh = "tanh_high",
        TanhBoth = "tanh_both",
        SinhMiddle = "sinh_middle",
        Cluster = "cluster",
    }
}

keys! {
    /// Boundary condition at one end of a direction.
    choice EndName {
        /// Periodic; required at both ends.
        Periodic = "periodic",
        /// Free slip.
        Slip = "slip",
        /// No-slip wall.
        NoSlip = "no_slip",
    }

    /// One direction of the mesh.
    #[derive(Copy)]
    table Axis {
        /// Number of cells; 1 for a direction along which nothing varies.
        cells: usize = 1 => 1..=100_000,
        /// Position of the low end \[m\].
        low_m: f64 = 0.0,
        /// Position of the high end \[m\].
        high_m: f64 = 1.0,
        /// Mapping of the cells.
        mapping: Spread = Spread::Uniform,
        /// Strength of the mapping, or amplitude of the sine.
        stretch: f64 = 0.0,
        /// Where a cluster is finest, as a fraction of the length.
        place: Option<f64> = None,
        /// Boundary condition at the low end.
        low_end: EndName = EndName::Periodic,
        /// Boundary condition at the high end.
        high_end: EndName = EndName::Periodic,
        /// Velocity `(u, v, w)` of a no-slip wall at the low end \[m/s\].
        low_velocity_m_s: [f64; 3] = [0.0; 3],
        /// Velocity of a no-slip wall at the high end \[m/s\].
        high_velocity_m_s: [f64; 3] = [0.0; 3],
    }

    /// Initial field.
    kinds InitialName by "kind" {
        /// The same velocity everywhere.
        "uniform" => Uniform {
            /// Velocity `(u, v, w)` \[m/s\].
            velocity_m_s: [f64; 3] => FINITE,
        },
        /// The analytic vortex pair with its images below the ground.
        "vortex_pair" => VortexPair(InitialPair),
        /// Velocities `u`, `v`, `w` of a classic NetCDF file, each on its own axes, which need not be those of the mesh.
        "netcdf" => Netcdf {
            /// The file; a relative path counts from the case file.
            path: String,
        },
    }

    /// A vortex pair in still air or a cross wind.
    #[derive(Copy)]
    table InitialPair {
        /// Circulation of each vortex \[m^2/s\].
        circulation_m2_s: f64 = 500.0 => ABOVE_ZERO,
        /// Distance between the vortices \[m\].
        spacing_m: f64 = 47.0 => ABOVE_ZERO,
        /// Core radius \[m\].
        core_radius_m: f64 = 4.7 => ABOVE_ZERO,
        /// Position of the midpoint of the pair \[m\].
        lateral_position_m: f64 = 0.0 => FINITE,
        /// Height \[m\].
        height_m: f64 = 47.0 => ABOVE_ZERO,
        /// Circulation against radius.
        profile: CoreProfile = CoreProfile::Algebraic,
        /// Uniform cross wind \[m/s\].
        cross_wind_m_s: f64 = 0.0 => FINITE,
    }

    /// A user-supplied flow.
    table Free {
        /// Direction x, along the flight.
        x: Axis = Axis::default(),
        /// Direction y, across it.
        y: Axis = Axis { cells: 64, low_m: -100.0, high_m: 100.0, ..Axis::default() },
        /// Direction z, up.
        z: Axis = Axis {
            cells: 48, high_m: 120.0, low_end: EndName::NoSlip, high_end: EndName::Slip, ..Axis::default()
        },
        /// Kinematic viscosity \[m^2/s\].
        viscosity_m2_s: f64 = 0.1 => ZERO_OR_MORE,
        /// Body force per mass along x, y, z \[m/s^2\].
        force_m_s2: [f64; 3] = [0.0; 3] => FINITE,
        /// Initial field.
        initial: InitialName = InitialName::VortexPair(InitialPair::default()),
    }
}

impl EndName {
    /// The wall at this end; no-slip walls move with a velocity.
    fn wall(self, velocity_m_s: [f64; 3]) -> Wall {
        match self {
            Self::NoSlip => Wall::NoSlip { velocity_m_s },
            Self::Slip | Self::Periodic => Wall::Slip,
        }
    }
}

impl Axis {
    fn check(&self, name: &str, p: &mut Checker<'_>) {
        let ordered = self.low_m.is_finite() && self.high_m.is_finite() && self.high_m > self.low_m;
        p.require(
            ordered,
            &format!("case.{name}.high_m"),
            self.high_m,
            "finite, above low_m",
        );
        self.check_mapping(name, p);
        let is_periodic = self.low_end == EndName::Periodic;
        p.require(
            is_periodic == (self.high_end == EndName::Periodic),
            &format!("case.{name}.high_end"),
            self.high_end,
            "periodic at both ends or at none",
        );
        for (field, end, velocity) in [
            ("low_velocity_m_s", self.low_end, self.low_velocity_m_s),
            ("high_velocity_m_s", self.high_end, self.high_velocity_m_s),
        ] {
            let is_finite = velocity.iter().all(|v| v.is_finite());
            p.require(
                is_finite && (end == EndName::NoSlip || velocity == [0.0; 3]),
                &format!("case.{name}.{field}"),
                velocity,
                "finite, and 0 where there is no no-slip wall",
            );
        }
    }

    /// Checks how the cells are spread.
    fn check_mapping(&self, name: &str, p: &mut Checker<'_>) {
        let (is_allowed, allowed) = match self.mapping {
            Spread::Uniform => (self.stretch == 0.0, "0 for equal cells; name a mapping"),
            Spread::Sine => (self.stretch.abs() < 1.0, "between -1 and 1 for a sine"),
            _ => (
                self.stretch > 0.0 && self.stretch <= 20.0,
                "above 0 and at most 20 for this mapping",
            ),
        };
        let key = format!("case.{name}.stretch");
        p.require(is_allowed, &key, self.stretch, allowed);
        let is_cluster = self.mapping == Spread::Cluster;
        p.require(
            self.place
                .is_none_or(|place| (0.0..=1.0).contains(&place) && is_cluster),
            &format!("case.{name}.place"),
            self.place,
            "a fraction of the length, 0 to 1, and only with mapping = \"cluster\"",
        );
        let repeats = is_cluster || matches!(self.mapping, Spread::Uniform | Spread::Sine);
        p.require(
            match self.low_end {
                EndName::Periodic => repeats,
                _ => !is_cluster,
            },
            &format!("case.{name}.mapping"),
            self.mapping,
            "uniform, sine or cluster in a periodic direction, and no cluster between planes",
        );
    }

    fn direction(&self) -> Direction {
        Direction {
            cells: self.cells,
            low_m: self.low_m,
            high_m: self.high_m,
            mapping: Mapping {
                place: self.place.unwrap_or(0.5),
                ..self.mapping.by(self.stretch)
            },
            ends: match self.low_end {
                EndName::Periodic => Ends::Periodic,
                _ => Ends::Walls {
                    low: self.low_end.wall(self.low_velocity_m_s),
                    high: self.high_end.wall(self.high_velocity_m_s),
                },
            },
        }
    }
}

impl Free {
    pub(super) fn check(&self, p: &mut Checker<'_>) {
        for (name, axis) in [("x", self.x), ("y", self.y), ("z", self.z)] {
            axis.check(name, p);
        }
    }

    pub(super) fn setup(&self, folder: &Path) -> Result<Setup, Error> {
        let mesh = Mesh::new(self.x.direction(), self.y.direction(), self.z.direction())
            .map_err(Error::Flow)?;
        let (initial, tau_per_s) = self.initial(&mesh, folder)?;
        // Without an end of its own a case needs one from its file, and so has no longest step of its own.
        let courant = TimeScheme::AdamsBashforth2.default_courant();
        let longest_s = f64::MAX;
        let mut settings = FlowSettings::new(
            self.viscosity_m2_s,
            TimeStep::Courant { courant, longest_s },
        );
        settings.force_m_s2 = self.force_m_s2;
        Ok(Setup {
            mesh,
            settings,
            initial,
            end_s: None,
            tau_per_s,
            wake: None,
            undamped: None,
        })
    }

    fn initial(&self, mesh: &Mesh, folder: &Path) -> Result<(Initial, f64), Error> {
        match &self.initial {
            &InitialName::Uniform { velocity_m_s } => {
                Ok((Initial::Field(Box::new(move |_| velocity_m_s)), 1.0))
            }
            InitialName::VortexPair(pair) => {
                let speed_m_s = pair.circulation_m2_s / (std::f64::consts::TAU * pair.spacing_m);
                Ok((pair.field()?, speed_m_s / pair.spacing_m))
            }
            InitialName::Netcdf { path } => {
                let faces = super::initial_file::read(&folder.join(path), mesh);
                Ok((
                    Initial::Faces(faces.map_err(Error::of_key("case.initial.path"))?),
                    1.0,
                ))
            }
        }
    }
}

impl InitialPair {
    fn field(&self) -> Result<Initial, Error> {
        let pair = VortexPair {
            circulation_m2_s: self.circulation_m2_s,
            spacing_m: self.spacing_m,
            core_radius_m: self.core_radius_m,
            lateral_position_m: self.lateral_position_m,
            height_m: self.height_m,
            ground: Ground::Image,
            profile: crate::plan::wind::circulation_profile(self.profile),
            motion: Motion::Frozen,
        };
        let wind = pair.wind().map_err(Error::Flow)?;
        let cross_m_s = self.cross_wind_m_s;
        Ok(Initial::Field(Box::new(move |at_m| {
            let mut velocity = [[0.0; 3]];
            // One point and one place for it: what could be refused would show as a field that is not finite.
            match wind.velocity_into(&[at_m], 0.0, &mut velocity) {
                Ok(()) => [velocity[0][0], velocity[0][1] + cross_m_s, velocity[0][2]],
                Err(_) => [f64::NAN; 3],
            }
        })))
    }
}
