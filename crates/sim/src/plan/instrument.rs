//! The instrument of a scene and the air that it looks through, in the words of optics and signals: made once, and handed on.

use crate::Error;
use crate::scene::{
    DetectorSignal, Digitiser, NoiseModel, RefractiveTurbulence, Scene, ScreenSampling,
    SnrReference,
};
use wakescope_optics::{self as optics, plan::Plan as ScreenPlan};
use wakescope_signal as signal;

/// Telescope, pulse, receiver and air.
#[derive(Debug, Clone)]
pub struct Instrument {
    /// The telescope.
    pub telescope: optics::Telescope,
    /// The pulse.
    pub pulse: signal::Pulse,
    /// The receiver.
    pub receiver: signal::Receiver,
    /// The converter, if the scene has one.
    pub digitiser: Option<signal::digitise::Digitiser>,
    /// The turbulence, if there is any.
    pub turbulence: Option<optics::Turbulence>,
    /// The air.
    pub air: signal::Medium,
    /// Fraction of the return that the optics transmit, out and back together.
    pub transmission: f64,
    /// Range up to which nothing is seen, m.
    pub blind_range_m: f64,
}

impl Instrument {
    /// The instrument of a scene.
    ///
    /// # Errors
    /// What optics or signals refuse, such as samples that are no pulse.
    pub fn new(scene: &Scene) -> Result<Self, Error> {
        let telescope = telescope(scene).validated()?;
        let receiver = receiver(scene);
        let digitiser = match scene.detector.digitiser {
            Digitiser::None {} => None,
            Digitiser::Quantised {
                bits,
                full_scale_over_noise,
            } => {
                let full_scale_a = full_scale_over_noise * receiver.noise_variance_a2().sqrt();
                Some(signal::digitise::Digitiser::new(bits, full_scale_a)?)
            }
        };
        let turbulence = scene
            .refractive_turbulence()
            .map(|t| t.along(scene.scan.lidar_height_m, 0.0))
            .transpose()?;
        Ok(Self {
            telescope,
            pulse: scene.pulse.simulated()?,
            receiver,
            digitiser,
            turbulence,
            air: scene.atmosphere.medium(scene.laser.wavelength_m)?,
            transmission: 10f64.powf(-0.1 * scene.telescope.optics_loss_db),
            blind_range_m: scene.telescope.blind_range_m,
        })
    }

    /// Return per metre of range K^2 beta A_R/R^2 of the air, (9) without the efficiency, less what the optics lose, 1/m;
    /// nothing from where the receiver is blind.
    ///
    /// # Errors
    /// What optics or signals refuse of a range.
    pub fn return_per_m(&self, range_m: f64) -> Result<f64, Error> {
        let seen = if range_m < self.blind_range_m {
            0.0
        } else {
            self.transmission
        };
        Ok(seen
            * self
                .air
                .return_per_m(range_m, self.telescope.aperture_area_m2())?)
    }

    /// Full width at half maximum of the Gaussian pulse with the same spread, s.
    pub fn gaussian_fwhm_s(&self) -> f64 {
        2.0 * std::f64::consts::LN_2.sqrt() * self.pulse.sigma_s()
    }

    /// Largest power of the pulse, W.
    pub fn peak_power_w(&self) -> f64 {
        const STEPS: u32 = 2000;
        let (first_s, last_s) = self.pulse.support_s();
        let time_s = |i: u32| first_s + (last_s - first_s) * f64::from(i) / f64::from(STEPS);
        self.pulse.energy_j()
            * (0..=STEPS)
                .map(|i| self.pulse.intensity_per_s(time_s(i)))
                .fold(0.0, f64::max)
    }

    /// Grid and layers of the phase screens for several runs, each with its ranges, m, increasing; with their cost.
    ///
    /// # Errors
    /// What cannot be resolved, with every limit and what would do for all of the runs.
    pub fn screen_plans(
        &self,
        t: &RefractiveTurbulence,
        runs: &[&[f64]],
    ) -> Result<Vec<ScreenPlan>, optics::Error> {
        let Some(turbulence) = &self.turbulence else {
            return Ok(Vec::new());
        };
        let case = optics::plan::Case {
            telescope: self.telescope,
            misalignment: optics::Misalignment::NONE,
            turbulence: turbulence.clone(),
            realisations: t.realisations,
        };
        match t.sampling {
            ScreenSampling::Derived => runs.iter().map(|range_m| case.plan(range_m)).collect(),
            ScreenSampling::Explicit => {
                let grid = optics::Grid::square(t.grid_points, t.grid_spacing_m)?;
                case.examine_runs(&grid, t.layers, runs)
            }
        }
    }

    /// The Monte Carlo of the turbulence for given ranges, m, increasing.
    ///
    /// # Errors
    /// As [`Instrument::screen_plans`]; air without turbulence.
    pub fn monte_carlo(
        &self,
        t: &RefractiveTurbulence,
        range_m: &[f64],
        seed: u64,
    ) -> Result<optics::MonteCarlo, Error> {
        let plan = self.screen_plans(t, &[range_m])?.pop();
        let (Some(plan), Some(turbulence)) = (plan, &self.turbulence) else {
            return Err(optics::Error::Length {
                field: "range_m",
                found: 0,
                expected: 1,
            }
            .into());
        };
        Ok(optics::MonteCarlo {
            telescope: self.telescope,
            misalignment: optics::Misalignment::NONE,
            turbulence: turbulence.clone(),
            grid: plan.grid,
            layers: plan.layers,
            range_m: range_m.to_vec(),
            seed,
            sampling: optics::monte_carlo::Sampling::Antithetic,
        })
    }
}

fn telescope(scene: &Scene) -> optics::Telescope {
    let t = &scene.telescope;
    optics::Telescope {
        wavelength_m: scene.laser.wavelength_m,
        aperture_radius_m: t.aperture_radius_m,
        obscuration_radius_m: t.obscuration_radius_m,
        beam_radius_m: t.beam_radius_m,
        radius_definition: t.beam_radius_definition,
        focus: if t.focus_m.is_infinite() {
            optics::Focus::Collimated
        } else {
            optics::Focus::At(t.focus_m)
        },
    }
}

/// The receiver of a scene.
pub fn receiver(scene: &Scene) -> signal::Receiver {
    let d = &scene.detector;
    signal::Receiver {
        wavelength_m: scene.laser.wavelength_m,
        sample_rate_hz: d.sampling_hz,
        intermediate_frequency_hz: d.intermediate_frequency_hz,
        bandwidth_hz: d.bandwidth_hz,
        quantum_efficiency: d.quantum_efficiency,
        local_oscillator_w: d.local_oscillator_w,
        planck: match d.snr {
            SnrReference::Chapter {} => signal::receiver::PlanckConvention::Hbar,
            _ => signal::receiver::PlanckConvention::H,
        },
        noise: d.noise,
        front_end: front_end(scene),
    }
}

/// The converter of a scene, if it has one, with the noise at its input.
pub(crate) fn converter(scene: &Scene) -> Option<signal::receiver::Converter> {
    let d = &scene.detector;
    match d.digitiser {
        Digitiser::None {} => None,
        Digitiser::Quantised {
            bits,
            full_scale_over_noise,
        } => Some(signal::receiver::Converter {
            bits,
            full_scale_over_noise,
            bandwidth_hz: d.bandwidth_hz,
            sample_rate_hz: d.sampling_hz,
            input_over_noise: match (d.noise, d.signal) {
                (NoiseModel::White, _) => (0.5 * d.sampling_hz / d.bandwidth_hz).sqrt(),
                (_, DetectorSignal::IntermediateFrequency) => 1.0,
                (_, DetectorSignal::Baseband) => std::f64::consts::FRAC_1_SQRT_2,
            },
        }),
    }
}

/// What the receiver of a scene has beyond shot noise.
fn front_end(scene: &Scene) -> signal::receiver::FrontEnd {
    let words = scene.detector.front_end.unwrap_or_default();
    let converter = converter(scene);
    signal::receiver::FrontEnd {
        amplifier_noise_a_rthz: words.amplifier_noise_a_rthz,
        load_ohm: words.load_ohm,
        load_temperature_k: words.load_temperature_k,
        dark_current_a: words.dark_current_a,
        intensity_noise_db_hz: words.intensity_noise_db_hz,
        rejection_db: words.rejection_db,
        saturation_w: words.saturation_w,
        poles: words.poles,
        half_power_hz: words.half_power_hz,
        rounding_noise: converter.map_or(0.0, |converter| converter.rounding()),
        clipping_noise: converter.map_or(0.0, |converter| converter.clipping_noise()),
        clipping_gain: converter.map_or(1.0, |converter| converter.clipping().gain),
        linewidth_hz: scene.laser.linewidth_hz,
        reflection: 10f64.powf(0.1 * scene.telescope.reflection_db),
    }
}
