//! One scan: the air along each line of sight, and the signals that it returns.

use crate::geometry::Geometry;
use crate::plan::{Plan, Stage};
use crate::profile::{efficiency_at, model, spaced};
use crate::progress::Observer;
use crate::scene::{Scene, SnrReference};
use crate::streams::stream;
use crate::{Error, join};
use ndarray::Array2;
use rayon::prelude::*;
use wakescope_les::Wind;
use wakescope_optics::plan::Model;
use wakescope_signal::{LineOfSight, Scratch, Simulator};

/// Ranges of the efficiency profile from which the layers take theirs, m: dense where it is a quadrature, few
/// where each costs transforms and the errors of neighbours are alike.
pub(crate) fn profile_ranges_m(scene: &Scene, geometry: &Geometry) -> Vec<f64> {
    let points = match model(scene) {
        Model::FreeSpace | Model::ExactBistatic => 65,
        Model::MonteCarlo => 9,
    };
    let last_m = geometry.first_layer_range_m + geometry.layers as f64 * geometry.layer_thickness_m;
    spaced(geometry.first_layer_range_m, last_m, points)
}

/// The lines of sight of a scan, and what makes signals of them.
pub struct Scanner<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    simulator: Simulator,
    lines: Vec<LineOfSight>,
}

impl<'a> Scanner<'a> {
    /// Samples the wind along every line of sight.
    ///
    /// # Errors
    /// What the crates refuse; a checked scene gives none.
    pub fn new(plan: &'a Plan, observer: &dyn Observer) -> Result<Self, Error> {
        let (scene, geometry) = (&plan.scene.scene, &plan.geometry);
        let weight_per_m = layer_weights(scene, geometry, observer)?;
        let wind = join::wind(scene)?;
        let start_s = join::start_time_s(scene);
        observer.begin(Stage::LinesOfSight, geometry.elevation_rad.len() as u64);
        let lines = (0..geometry.elevation_rad.len())
            .into_par_iter()
            .map(|i| {
                let ranges_m: Vec<f64> = geometry.layer_range_m().collect();
                let time_s = start_s + geometry.line_time_s[i];
                let radial_velocity_m_s =
                    radial_velocity_m_s(&*wind, scene, geometry.elevation_rad[i], time_s, &ranges_m)?;
                observer.advance(1);
                Ok(LineOfSight {
                    first_range_m: geometry.first_layer_range_m,
                    layer_thickness_m: geometry.layer_thickness_m,
                    radial_velocity_m_s,
                    weight_per_m: weight_per_m.clone(),
                })
            })
            .collect::<Result<_, Error>>()?;
        observer.end();
        let simulator = join::simulator(scene, geometry)?;
        Ok(Self { scene, geometry, simulator, lines })
    }

    /// Mean signal-to-noise ratio (14) over the layers, a power ratio.
    pub fn mean_snr(&self) -> f64 {
        let weights = self.lines.first().map_or(&[][..], |line| &line.weight_per_m);
        let mean_per_m = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
        join::receiver(self.scene).slowly_varying_snr(self.scene.pulse.energy_j, mean_per_m)
    }

    /// The air along each line of sight, in the order of the geometry's elevations.
    pub fn lines(&self) -> &[LineOfSight] {
        &self.lines
    }

    /// The signals of one realisation \[pulse, sample\], A; the pulses of a line stand together.
    ///
    /// Every pulse has its own random stream, keyed by realisation, line and pulse.
    ///
    /// # Errors
    /// What the signal simulation refuses; a checked scene gives none.
    pub fn records(&self, realisation: usize, observer: &dyn Observer) -> Result<Array2<f64>, Error> {
        let pulses = self.scene.scan.pulses_per_line;
        let samples = self.geometry.samples;
        let shape = (self.lines.len() * pulses, samples);
        let mut records_a = vec![0.0; shape.0 * shape.1];
        records_a.par_chunks_mut(pulses * samples).enumerate().try_for_each_init(
            Scratch::default,
            |scratch, (line, rows)| {
                for (pulse, out_a) in rows.chunks_mut(samples).enumerate() {
                    let index = ((realisation * self.lines.len() + line) * pulses + pulse) as u64;
                    let mut rng = stream(self.scene.seed, "signal", index);
                    self.simulator.record_into(&self.lines[line], &mut rng, scratch, out_a)?;
                }
                observer.advance(1);
                Ok::<(), Error>(())
            },
        )?;
        Ok(Array2::from_shape_vec(shape, records_a).unwrap_or_else(|e| unreachable!("the vector has this shape: {e}")))
    }
}

/// Return per metre of each layer, K^2 beta A_R eta_s/R^2; the efficiency is interpolated.
fn layer_weights(scene: &Scene, geometry: &Geometry, observer: &dyn Observer) -> Result<Vec<f64>, Error> {
    if let SnrReference::Fixed { snr_db } = scene.detector.snr {
        return Ok(join::fixed_weights_per_m(scene, geometry, snr_db));
    }
    observer.begin(Stage::Efficiency, 1);
    let ranges_m = profile_ranges_m(scene, geometry);
    let profile = efficiency_at(scene, &ranges_m, observer)?;
    observer.end();
    join::layer_weights_per_m(scene, geometry, &profile)
}

/// Radial velocity, m/s, positive away from the lidar, at ranges along a line of sight; NaN below
/// the ground, where there is no air to scatter.
pub(crate) fn radial_velocity_m_s(
    wind: &dyn Wind,
    scene: &Scene,
    elevation_rad: f64,
    time_s: f64,
    range_m: &[f64],
) -> Result<Vec<f64>, Error> {
    let (sin, cos) = elevation_rad.sin_cos();
    let height_m = scene.scan.lidar_height_m;
    let points_m: Vec<[f64; 3]> = range_m.iter().map(|r| [0.0, r * cos, height_m + r * sin]).collect();
    let mut velocity_m_s = vec![[0.0; 3]; points_m.len()];
    wind.velocity_into(&points_m, time_s, &mut velocity_m_s)?;
    let project = |(p, v): (&[f64; 3], &[f64; 3])| if p[2] < 0.0 { f64::NAN } else { v[1] * cos + v[2] * sin };
    Ok(points_m.iter().zip(&velocity_m_s).map(project).collect())
}
