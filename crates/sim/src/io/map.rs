//! Results at the border to files and pictures: a scanned map of fields over (ray, gate), and cross-planes of the wind.
//! Plain data; the writers call [`VelocityMap::check`] first, so a wrong shape is an error and never a wrong file.
//! Check: each rule of `check` is broken once by a test; positions follow from ray geometry.

use super::checks::{increasing, same_length};
use super::site::Site;
use super::utc::UtcTime;
use crate::Error;
use crate::beams::{Direction, SweepMode};
use ndarray::{Array2, Array3, Axis};
use std::f64::consts::FRAC_PI_2;
use wakescope_les::winds::{Edges, Side};

/// Unit of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// Tag that ends a CSV column name; empty for a dimensionless one.
    pub tag: &'static str,
    /// Text of the NetCDF attribute `units` (UDUNITS).
    pub udunits: &'static str,
    /// Text for people; empty for a dimensionless one.
    pub label: &'static str,
}

impl Unit {
    /// Dimensionless.
    pub const ONE: Self = Self {
        tag: "",
        udunits: "1",
        label: "",
    };
    /// Metre per second.
    pub const METRE_PER_SECOND: Self = Self {
        tag: "m_s",
        udunits: "m s-1",
        label: "m/s",
    };
    /// Decibel.
    pub const DECIBEL: Self = Self {
        tag: "db",
        udunits: "dB",
        label: "dB",
    };
}

/// One quantity over all rays and gates.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// NetCDF variable name, such as `radial_velocity` or `v_exact`.
    pub name: String,
    /// Unit of `values`.
    pub unit: Unit,
    /// One sentence for plots and headers; for velocities it says that positive means away from the lidar.
    pub long_name: String,
    /// How the value was made of several realisations, in the words of CF.
    pub cell_methods: Option<String>,
    /// Names of the fields that say how good this one is, with blanks between them.
    pub ancillary: String,
    /// Values `[ray, gate]`; NaN = missing. Infinite values are refused.
    pub values: Array2<f64>,
}

impl Field {
    /// A field of that name.
    pub fn float(name: &str, unit: Unit, long_name: &str, values: Array2<f64>) -> Self {
        Self {
            name: name.into(),
            unit,
            long_name: long_name.into(),
            cell_methods: None,
            ancillary: String::new(),
            values,
        }
    }

    /// The same field with the statistic over the realisations that it is, such as `mean` or `standard_deviation`.
    #[must_use]
    pub fn over_realisations(mut self, statistic: &str) -> Self {
        self.cell_methods = Some(format!("realization: {statistic}"));
        self
    }

    /// The same field with the names of those that say how good it is.
    #[must_use]
    pub fn with_ancillary(self, names: &str) -> Self {
        Self {
            ancillary: names.into(),
            ..self
        }
    }

    /// CF or CfRadial standard name, where one exists.
    pub fn standard_name(&self) -> Option<&'static str> {
        match self.name.as_str() {
            "radial_velocity"
            | "velocity_standard_deviation"
            | "v_scan"
            | "v_exact"
            | "v_pulse"
            | "v_gate" => Some("radial_velocity_of_scatterers_away_from_instrument"),
            "width" => Some("doppler_spectrum_width"),
            "count" => Some("number_of_observations"),
            "signal_to_noise_ratio" => Some("signal_to_noise_ratio"),
            _ => None,
        }
    }

    /// Column name in a CSV table: name and unit tag, with the short names `v_mean_m_s` and `std_m_s` of the estimate and `snr_db`.
    pub fn column(&self) -> String {
        match self.name.as_str() {
            "radial_velocity" => "v_mean_m_s".into(),
            "velocity_standard_deviation" => "std_m_s".into(),
            "signal_to_noise_ratio" => "snr_db".into(),
            name if self.unit == Unit::ONE => name.into(),
            name => format!("{name}_{}", self.unit.tag),
        }
    }
}

/// One line of sight of the scan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ray {
    /// Index into [`VelocityMap::sweeps`]; the rays of a sweep are contiguous and sweeps follow in order.
    pub sweep: usize,
    /// Time of the ray from the start of the flow, s; increases strictly over all rays.
    pub time_s: f64,
    /// Elevation above the horizontal, rad.
    pub elevation_rad: f64,
    /// Azimuth, clockwise from north, rad.
    pub azimuth_rad: f64,
    /// Pulses averaged.
    pub pulses: u32,
    /// Where the lidar is (x, y, z), m, and its velocity, m/s, if it moves.
    pub carrier: Option<([f64; 3], [f64; 3])>,
}

/// One sweep at one age of the wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Age of the wake, dimensionless (t Gamma0 / (2 pi b0^2)).
    pub tau: f64,
    /// The angle that stays: azimuth of an RHI, else elevation, rad.
    pub fixed_angle_rad: f64,
    /// Its kind.
    pub mode: SweepMode,
    /// Its Nyquist velocity, m/s, if it is not that of [`PulseInfo`].
    pub nyquist_velocity_m_s: Option<f64>,
}

impl Sweep {
    /// A sweep of elevation at one azimuth.
    pub fn rhi(tau: f64, azimuth_rad: f64) -> Self {
        Self {
            tau,
            fixed_angle_rad: azimuth_rad,
            mode: SweepMode::Rhi,
            nyquist_velocity_m_s: None,
        }
    }
}

/// Pulse and acquisition, the same for all rays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PulseInfo {
    /// Pulse repetition time, s.
    pub prt_s: f64,
    /// Pulse duration, s.
    pub pulse_width_s: f64,
    /// Largest velocity of either sign that is unambiguous (Nyquist velocity), m/s.
    pub nyquist_velocity_m_s: f64,
    /// Samples per second.
    pub sampling_hz: f64,
    /// Pulses averaged per ray, as the scene has them.
    pub samples: u32,
    /// Optical frequency, Hz.
    pub frequency_hz: f64,
}

impl PulseInfo {
    /// Wavelength of the light, m.
    pub fn wavelength_m(&self) -> f64 {
        crate::SPEED_OF_LIGHT_M_S / self.frequency_hz
    }

    /// Whether air that is faster is mirrored, as of real currents; that of complex ones comes out twice `nyquist_velocity_m_s` off.
    pub fn is_mirrored(&self) -> bool {
        // Real currents have half the velocities of complex ones, or less.
        self.nyquist_velocity_m_s < 0.9 * 0.25 * self.wavelength_m() * self.sampling_hz
    }
}

/// A scanned map: fields over (ray, gate), in the geometry of the lidar.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VelocityMap {
    /// Title, such as `Early wake, 200 ns, N = 32`.
    pub title: String,
    /// Rays in the order of their times.
    pub rays: Vec<Ray>,
    /// Gate centres, m, increasing.
    pub range_m: Vec<f64>,
    /// Sweeps, each tiled by its rays.
    pub sweeps: Vec<Sweep>,
    /// Pulse and acquisition.
    pub pulse: PulseInfo,
    /// Quantities over (ray, gate).
    pub fields: Vec<Field>,
    /// Horizontal position of the lidar in the frame of the flow, m.
    pub lidar_y_m: f64,
    /// Height of the telescope above the ground, m.
    pub lidar_height_m: f64,
    /// Where the lidar is along the flight, m, and the azimuth of +x, rad; absent where all rays are in one plane across the flight.
    pub flight: Option<(f64, f64)>,
    /// Place, and date from which the times of the rays count.
    pub site: Site,
    /// Whether the signals were simulated.
    pub is_simulated: bool,
}

impl VelocityMap {
    /// Position of a gate along the flight, across it and above the ground, m.
    pub fn place_m(&self, ray: usize, gate: usize) -> [f64; 3] {
        let here = [
            self.flight.map_or(0.0, |(x_m, _)| x_m),
            self.lidar_y_m,
            self.lidar_height_m,
        ];
        let Ray {
            azimuth_rad,
            elevation_rad,
            carrier,
            ..
        } = self.rays[ray];
        let from_m = carrier.map_or(here, |(place_m, _)| place_m);
        let from_x_rad = self
            .flight
            .map_or(FRAC_PI_2, |(_, x_rad)| azimuth_rad - x_rad);
        Direction::new(from_x_rad, elevation_rad).at_range_m(from_m, self.range_m[gate])
    }

    /// Whether the lidar moves.
    pub fn is_carried(&self) -> bool {
        self.rays.iter().any(|ray| ray.carrier.is_some())
    }

    /// The sweeps of one kind alone.
    #[must_use]
    pub fn of_mode(&self, mode: SweepMode) -> Self {
        let mut sweeps = Vec::new();
        let mut number_of_sweep = Vec::with_capacity(self.sweeps.len());
        for sweep in &self.sweeps {
            number_of_sweep.push((sweep.mode == mode).then_some(sweeps.len()));
            if sweep.mode == mode {
                sweeps.push(*sweep);
            }
        }
        let mut indices = Vec::new();
        let mut rays = Vec::new();
        for (index, ray) in self.rays.iter().enumerate() {
            if let Some(Some(sweep)) = number_of_sweep.get(ray.sweep).copied() {
                indices.push(index);
                rays.push(Ray { sweep, ..*ray });
            }
        }
        let mut fields = Vec::with_capacity(self.fields.len());
        for field in &self.fields {
            fields.push(Field {
                values: field.values.select(Axis(0), &indices),
                ..field.clone()
            });
        }
        Self {
            rays,
            sweeps,
            fields,
            ..self.clone()
        }
    }

    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|f| f.name == name)
    }

    /// The date from which the times of the rays count.
    pub fn start(&self) -> UtcTime {
        UtcTime::parse(&self.site.start_utc).unwrap_or(UtcTime::SYNTHETIC)
    }

    /// First and last (inclusive) ray of each sweep: of all rays that follow each other in it.
    pub fn sweep_bounds(&self) -> Vec<(usize, usize)> {
        let mut bounds = Vec::new();
        let mut next = 0;
        for rays in self.rays.chunk_by(|a, b| a.sweep == b.sweep) {
            bounds.push((next, next + rays.len() - 1));
            next += rays.len();
        }
        bounds
    }

    /// Checks shapes, order and values.
    ///
    /// # Errors
    /// The first rule that is broken: no rays or sweeps, times or ranges that do not increase, sweeps that do not tile the
    /// rays in order, a field of another shape, a repeated field name, an infinite value.
    pub fn check(&self) -> Result<(), Error> {
        increasing("range_m", &self.range_m)?;
        let times: Vec<f64> = self.rays.iter().map(|r| r.time_s).collect();
        increasing("ray time_s", &times)?;
        if self.range_m[0] <= 0.0 {
            return Err(Error::value(
                "range_m",
                format!("{:?}", self.range_m[0]),
                "must be positive",
            ));
        }
        self.check_rays()?;
        for (i, field) in self.fields.iter().enumerate() {
            if self.fields[..i].iter().any(|f| f.name == field.name) {
                return Err(Error::Duplicate {
                    what: "field",
                    name: field.name.clone(),
                });
            }
            self.check_field(field)?;
        }
        Ok(())
    }

    fn check_rays(&self) -> Result<(), Error> {
        for (i, ray) in self.rays.iter().enumerate() {
            if !(ray.elevation_rad.is_finite() && ray.azimuth_rad.is_finite()) {
                return Err(Error::value(
                    format!("ray {i} angles"),
                    format!("{}, {}", ray.elevation_rad, ray.azimuth_rad),
                    "must be finite",
                ));
            }
        }
        let bounds = self.sweep_bounds();
        for (expected, (first, _)) in bounds.iter().enumerate() {
            let sweep = self.rays[*first].sweep;
            if sweep != expected {
                let allowed = format!("sweeps tile the rays in order: {expected} is next");
                return Err(Error::value(format!("ray {first} sweep"), sweep, allowed));
            }
        }
        same_length("sweeps", self.sweeps.len(), "the rays", bounds.len())
    }

    fn check_field(&self, field: &Field) -> Result<(), Error> {
        let (rays, gates) = field.values.dim();
        same_length(&field.name, rays, "rays", self.rays.len())?;
        same_length(&field.name, gates, "range_m", self.range_m.len())?;
        if let Some(bad) = field.values.iter().find(|v| v.is_infinite()) {
            return Err(Error::value(
                &field.name,
                bad,
                "must be finite, or NaN where missing",
            ));
        }
        Ok(())
    }
}

/// Wind in planes across the flight direction, at cell centres of a stretched mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossPlanes {
    /// Title of the file.
    pub title: String,
    /// Ages of the wake, increasing.
    pub tau: Vec<f64>,
    /// Times of the planes, s, one per `tau`.
    pub time_s: Vec<f64>,
    /// Horizontal cell centres, m, increasing.
    pub y_m: Vec<f64>,
    /// Vertical cell centres, m, increasing.
    pub z_m: Vec<f64>,
    /// Horizontal wind `[tau, z, y]`, m/s; NaN = missing.
    pub v_m_s: Array3<f64>,
    /// Vertical wind `[tau, z, y]`, m/s; NaN = missing.
    pub w_m_s: Array3<f64>,
    /// What lies beyond the ends in y, for those who interpolate.
    pub y_edges: Edges,
    /// The same in z.
    pub z_edges: Edges,
}

/// Ends of an axis of which nothing is known beyond its last values.
pub const OPEN_EDGES: Edges = Edges::Bounded {
    low: Side::Open,
    high: Side::Open,
};

impl CrossPlanes {
    /// Checks axes and shapes.
    ///
    /// # Errors
    /// An axis that is empty or does not increase, or an array of another shape.
    pub fn check(&self) -> Result<(), Error> {
        increasing("tau", &self.tau)?;
        increasing("time_s", &self.time_s)?;
        increasing("y_m", &self.y_m)?;
        increasing("z_m", &self.z_m)?;
        same_length("time_s", self.time_s.len(), "tau", self.tau.len())?;
        for (name, array) in [("v_m_s", &self.v_m_s), ("w_m_s", &self.w_m_s)] {
            let (t, z, y) = array.dim();
            same_length(name, t, "tau", self.tau.len())?;
            same_length(name, z, "z_m", self.z_m.len())?;
            same_length(name, y, "y_m", self.y_m.len())?;
            if let Some(bad) = array.iter().find(|v| v.is_infinite()) {
                return Err(Error::value(
                    name,
                    bad,
                    "must be finite, or NaN where missing",
                ));
            }
        }
        Ok(())
    }
}
