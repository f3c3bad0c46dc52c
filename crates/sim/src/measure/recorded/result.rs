//! What an instrument can know of its gates, and the map of it for files.
//!
//! Check: flags and ratios of measured signals are those of a run of the same signals.

use super::NoiseLevel;
use super::blocks::ScanCells;
use super::lines::ScanLines;
use super::predicted::PredictedError;
use crate::Error;
use crate::io::{Field, Ray, Sweep, Unit, VelocityMap};
use crate::measure::gate_estimates::GateSums;
use crate::plan::Plan;
use crate::plan::described::pulse_info;
use ndarray::{Array2, Axis, concatenate};
use wakescope_estimate::estimators::noise_floor;
use wakescope_estimate::map::PolarPoint;

/// Velocities of one scan, each \[line, gate\].
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredScan {
    /// The lines.
    pub lines: ScanLines,
    /// Radial velocity, m/s, positive away from the lidar; NaN where there is none.
    pub velocity_m_s: Array2<f64>,
    /// The standard deviation that the Cramer-Rao bound predicts at the estimated signal-to-noise ratio, m/s.
    pub predicted_m_s: Array2<f64>,
    /// The bias that the method has in the scene's noise at that ratio, m/s; NaN where it is not known.
    pub bias_m_s: Array2<f64>,
    /// Windows accumulated.
    pub level: Array2<f64>,
    /// Independent windows that they are worth.
    pub n_eff: Array2<f64>,
    /// 1 where the estimate was flagged: a flag of its own, or a peak that does not stand out of noise.
    pub flagged: Array2<f64>,
    /// Spectral width of air and pulse, m/s, without what the method adds; NaN where the method shows none, and where the gate is flagged
    /// or its signal too weak to tell.
    pub width_m_s: Array2<f64>,
    /// Signal-to-noise ratio in the detector band, dB; NaN below twice its standard deviation.
    pub snr_db: Array2<f64>,
    /// Density of the peak over the mean density in the band.
    pub quality: Array2<f64>,
}

/// Holds the gates of a scan against the noise.
pub(super) fn measured(
    plan: &Plan,
    scan: ScanCells,
    noise: NoiseLevel,
) -> Result<MeasuredScan, Error> {
    // The noise over that of the scene.
    let factor = match noise {
        NoiseLevel::OfScene => 1.0,
        NoiseLevel::Given(power) => power / plan.instrument.receiver.sampled_noise_a2(),
        NoiseLevel::Quietest => quietest(plan, &scan),
    };
    let ScanCells {
        lines,
        gates,
        noise_a2,
        regions: (places, radius_m),
        ..
    } = scan;
    let largest_m = radius_m.iter().copied().fold(0.0, f64::max);
    let predicted = PredictedError::new(plan, places, largest_m)?;
    let velocity_m_s = gates.map(|gate| gate.found.estimate.velocity_m_s);
    let sums = gates.map(|gate| {
        let mut sums = GateSums::default();
        sums.add(gate, factor);
        sums
    });
    let snr_db = sums.map(|gate| gate.snr_db(noise_a2, factor));
    let deviation_m_s = |at: (usize, usize)| {
        predicted.deviation_m_s(
            point(plan, &lines, at),
            radius_m[at.1],
            sums[at].level,
            snr_db[at],
        )
    };
    let predicted_m_s = Array2::from_shape_fn(sums.dim(), deviation_m_s);
    let bias_m_s = Array2::from_shape_fn(sums.dim(), |at| {
        predicted.bias_m_s(velocity_m_s[at], snr_db[at])
    });
    Ok(MeasuredScan {
        predicted_m_s,
        bias_m_s,
        level: sums.map(|gate| gate.level),
        n_eff: sums.map(|gate| gate.n_eff),
        flagged: sums.map(GateSums::flagged),
        width_m_s: sums.map(|gate| gate.width_m_s(noise_a2, factor)),
        quality: sums.map(GateSums::quality),
        velocity_m_s,
        snr_db,
        lines,
    })
}

/// The place of a gate of a line.
fn point(plan: &Plan, lines: &ScanLines, (line, gate): (usize, usize)) -> PolarPoint {
    PolarPoint::at_elevation(plan.geometry.gate_range_m[gate], lines.elevation_rad[line])
}

/// Power of the gates without a signal over that of the scene's noise, from the means over the lines.
fn quietest(plan: &Plan, scan: &ScanCells) -> f64 {
    let ScanCells {
        lines,
        gates,
        noise_a2,
        regions: (places, radius_m),
        ..
    } = scan;
    let ratio = gates.map(|gate| gate.power_a2 / noise_a2);
    let mean_of_lines = |of: &dyn Fn((usize, usize)) -> f64| {
        let mean = |gate: usize| {
            let known = || {
                (0..gates.nrows())
                    .map(|line| (line, gate))
                    .filter(|at| ratio[*at].is_finite())
            };
            known().map(of).sum::<f64>() / known().count() as f64
        };
        (0..gates.ncols())
            .map(mean)
            .filter(|value| value.is_finite())
            .collect::<Vec<f64>>()
    };
    // Regions that reach over several lines share their windows.
    let variances = mean_of_lines(&|at| {
        gates[at].deviation.powi(2)
            * places
                .chords(point(plan, lines, at), radius_m[at.1])
                .count() as f64
    });
    let variance = variances.iter().sum::<f64>() / (variances.len() * gates.nrows()) as f64;
    noise_floor(&mean_of_lines(&|at| ratio[at]), variance.sqrt())
}

/// The map of the scans, each a sweep, in the form that files and pictures take.
pub fn measured_map(plan: &Plan, scans: &[MeasuredScan]) -> Result<VelocityMap, Error> {
    type Of = fn(&MeasuredScan) -> &Array2<f64>;
    let scene = plan.scene();
    let azimuth_rad = scene.scan.azimuth_rad;
    let pulses = scene.scan.pulses_per_line as u32;
    let of_scan = |(sweep, scan): (usize, &MeasuredScan)| -> Vec<Ray> {
        let rays = scan.lines.elevation_rad.iter().zip(&scan.lines.time_s);
        rays.map(|(&elevation_rad, &time_s)| Ray {
            sweep,
            time_s,
            elevation_rad,
            azimuth_rad,
            pulses,
            carrier: None,
        })
        .collect()
    };
    let stacked = |of: Of| -> Result<Array2<f64>, Error> {
        let views: Vec<_> = scans.iter().map(|scan| of(scan).view()).collect();
        concatenate(Axis(0), &views)
            .map_err(|_| wakescope_estimate::Error::Empty { field: "scans" }.into())
    };
    let speed = Unit::METRE_PER_SECOND;
    let of_bound =
        "predicted standard deviation: Cramer-Rao bound at the estimated signal-to-noise ratio";
    let in_band = "signal-to-noise ratio in the detector band that the spectra show";
    let fields: [(&str, Unit, &str, Of); 9] = [
        (
            "radial_velocity",
            speed,
            "estimated radial velocity, positive away from the lidar",
            |s| &s.velocity_m_s,
        ),
        ("velocity_standard_deviation", speed, of_bound, |s| {
            &s.predicted_m_s
        }),
        (
            "bias",
            speed,
            "predicted bias of the method in this noise, not taken off",
            |s| &s.bias_m_s,
        ),
        (
            "level",
            Unit::ONE,
            "windows accumulated for one estimate",
            |s| &s.level,
        ),
        (
            "n_eff",
            Unit::ONE,
            "independent windows that these are worth",
            |s| &s.n_eff,
        ),
        (
            "flagged",
            Unit::ONE,
            "1 where the estimate was flagged",
            |s| &s.flagged,
        ),
        ("width", speed, "spectral width of air and pulse", |s| {
            &s.width_m_s
        }),
        ("signal_to_noise_ratio", Unit::DECIBEL, in_band, |s| {
            &s.snr_db
        }),
        (
            "quality",
            Unit::ONE,
            "density of the peak over the mean density in the band",
            |s| &s.quality,
        ),
    ];
    let field = |(name, unit, text, of): (&str, Unit, &str, Of)| {
        Ok(Field::float(name, unit, text, stacked(of)?))
    };
    let mut fields = fields
        .into_iter()
        .map(field)
        .collect::<Result<Vec<Field>, Error>>()?;
    fields[0].ancillary =
        "velocity_standard_deviation bias level n_eff flagged signal_to_noise_ratio quality".into();
    Ok(VelocityMap {
        title: "Radial velocity estimated from recorded signals".into(),
        rays: scans.iter().enumerate().flat_map(of_scan).collect(),
        range_m: plan.geometry.gate_range_m.clone(),
        sweeps: scans
            .iter()
            .map(|_| Sweep::rhi(f64::NAN, azimuth_rad))
            .collect(),
        pulse: pulse_info(scene),
        fields,
        lidar_height_m: scene.scan.lidar_height_m,
        site: scene.site.clone(),
        ..VelocityMap::default()
    })
}
