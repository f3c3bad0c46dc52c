//! One scan: the air along each line of sight, and the signals that it returns.

use crate::Error;
use crate::beams::Beam;
use crate::measure::efficiency_model::{drawn_turbulence, stretches};
use crate::measure::profile::{EfficiencyMemo, LineOptics, efficiency_by_theory};
use crate::plan::geometry::Geometry;
use crate::plan::instrument::Instrument;
use crate::plan::line_wind::{known_velocity_m_s, velocity_along_m_s, wind_of_line};
use crate::plan::wind::SceneWind;
use crate::plan::{Plan, Stage};
use crate::progress::{Observer, Silent};
use crate::scene::{DetectorSignal, Scene, SecondTrip, SnrReference};
use crate::streams::stream;
use ndarray::{Array2, ArrayView2};
use rand_xoshiro::rand_core::Rng;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use wakescope_signal::Sample;
use wakescope_signal::efficiency::LayerEfficiency;
use wakescope_signal::receiver::echoes::ambiguous_range_m;
use wakescope_signal::scan::PulseKey;
use wakescope_signal::{LineOfSight, RangeFilter, Record, Scan, Shot, Simulator};

mod layers;
pub(crate) mod products;

/// Size of a piece of records, bytes.
const PIECE_BYTES: usize = 16 << 20;
/// Size of the winds of a piece, where pulses have their own, bytes.
pub(crate) const WINDS_BYTES: f64 = (64 << 20) as f64;

/// Records that are in memory at a time: about ten megabytes of them, and enough for every thread.
pub(crate) fn records_at_once<T>(samples: usize, pulses: usize) -> usize {
    let record_bytes = samples.max(1) * size_of::<T>();
    (PIECE_BYTES / record_bytes)
        .max(rayon::current_num_threads())
        .min(pulses.max(1))
}

/// The lines of sight of a scan, and what makes signals of them.
pub struct Scanner<'a> {
    plan: &'a Plan,
    simulator: Simulator,
    /// Return per metre of each layer, for each air of the plan.
    weights_per_m: Vec<Vec<f64>>,
    /// The air of the first realisation, which all have unless each has its own turbulence.
    pub air: ScanAir,
    /// The efficiency of each pulse over the mean, where pulses have their own, for each turbulence of the plan.
    efficiency: Option<Vec<LayerEfficiency>>,
}

/// The air along the lines of sight of a realisation.
pub struct ScanAir {
    pub(crate) wind: Arc<SceneWind>,
    /// The air of each line, in the order of the geometry's elevations: that of its middle, or the mean of the winds of its pulses.
    pub lines: Vec<LineOfSight>,
    /// The air of the signals of lines that need no layers as thin as those; none where all do.
    thick: Vec<Option<LineOfSight>>,
    /// Standard deviation over the pulses of a line of the velocity weighted with the pulse \[line, gate\], m/s, where the pulses
    /// have winds of their own.
    pub spread_m_s: Option<Array2<f64>>,
    /// The air that the pulse before lights meanwhile, if the scene asks for its echo.
    previous: Option<Vec<LineOfSight>>,
}

impl ScanAir {
    /// Samples a wind along every line of sight.
    fn new(
        plan: &Plan,
        wind: Arc<SceneWind>,
        weights_per_m: &[Vec<f64>],
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let geometry = &plan.geometry;
        let by_pulse = RangeFilter::pulse(&plan.instrument.pulse, geometry.layer_thickness_m)?;
        let ranges_m: Vec<f64> = geometry.layer_range_m().collect();
        let all: Vec<usize> = (0..geometry.schedule.lines.len()).collect();
        let of_line = |&line: &usize| {
            let air = wind_of_line(plan, &wind, &by_pulse, &ranges_m, line)?;
            observer.advance(1);
            Ok(air)
        };
        let winds = in_time_order(&wind, &all, |line| geometry.line_time_s[*line], of_line)?;
        let mut lines = Vec::with_capacity(winds.len());
        let mut spreads = Vec::with_capacity(winds.len());
        for (line, (velocity_m_s, spread_m_s)) in winds.into_iter().enumerate() {
            let weight_per_m = &weights_per_m[plan.air_of_line(line)];
            lines.push(line_of_sight(weight_per_m, velocity_m_s, geometry));
            spreads.push(spread_m_s);
        }
        let spreads: Option<Vec<Vec<f64>>> = spreads.into_iter().collect();
        let shape = (lines.len(), geometry.gate_range_m.len());
        let spread_m_s =
            spreads.and_then(|values| Array2::from_shape_vec(shape, values.concat()).ok());
        let previous = previous_air(plan, &wind, &lines)?;
        let thick = layers::thick_lines(plan, &lines)?;
        Ok(Self {
            thick,
            wind,
            lines,
            spread_m_s,
            previous,
        })
    }
}

impl ScanAir {
    /// The air of the signals of a line.
    fn of_signals(&self, line: usize) -> &LineOfSight {
        let thick = self.thick.get(line).and_then(Option::as_ref);
        thick.unwrap_or(&self.lines[line])
    }
}

impl<'a> Scanner<'a> {
    /// Samples the wind along every line of sight.
    ///
    /// # Errors
    /// What the crates refuse; a checked scene gives none.
    pub fn new(plan: &'a Plan, observer: &dyn Observer) -> Result<Self, Error> {
        Self::with(plan, &EfficiencyMemo::default(), observer)
    }

    /// The same with efficiencies that other scans may share.
    ///
    /// # Errors
    /// As [`Scanner::new`].
    pub(crate) fn with(
        plan: &'a Plan,
        known: &EfficiencyMemo,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let scene = plan.scene();
        let instrument = &plan.instrument;
        let geometry = &plan.geometry;
        let optics = LineOptics {
            plan,
            instrument,
            known,
            observer,
        };
        let weights_per_m = returns_of_slants(&optics)?;
        observer.begin(Stage::LinesOfSight, geometry.elevation_rad.len() as u64);
        let air = ScanAir::new(plan, plan.wind.clone(), &weights_per_m, observer)?;
        observer.end();
        let efficiency = drawn_efficiency(&optics, &air.lines)?;
        let record = Record {
            time_of_first_sample_s: 2.0 * scene.scan.range_min_m / crate::SPEED_OF_LIGHT_M_S,
            samples: geometry.samples,
        };
        let simulator = match scene.detector.signal {
            DetectorSignal::IntermediateFrequency => {
                Simulator::new(&instrument.pulse, instrument.receiver, record)?
            }
            DetectorSignal::Baseband => {
                Simulator::for_baseband(&instrument.pulse, instrument.receiver, record)?
            }
        };
        Ok(Self {
            plan,
            simulator,
            weights_per_m,
            air,
            efficiency,
        })
    }

    /// Range of each layer, m, and the signal-to-noise ratio (14) that air like it gives, a power ratio.
    pub fn layer_snr(&self) -> Vec<(f64, f64)> {
        let Some(line) = self.air.lines.get(self.plan.reference_line()) else {
            return Vec::new();
        };
        layer_snr(self.plan.scene(), &self.plan.instrument, line)
    }

    /// The same without any wind, for records that were not made here.
    ///
    /// # Errors
    /// As [`Scanner::new`].
    pub(crate) fn expected_layer_snr(
        plan: &Plan,
        observer: &dyn Observer,
    ) -> Result<Vec<(f64, f64)>, Error> {
        let optics = LineOptics {
            plan,
            instrument: &plan.instrument,
            known: &EfficiencyMemo::default(),
            observer,
        };
        let radial_velocity_m_s = vec![0.0; plan.geometry.layers];
        let returns = layer_returns(&optics)?;
        let line = line_of_sight(&returns, radial_velocity_m_s, &plan.geometry);
        Ok(layer_snr(plan.scene(), &plan.instrument, &line))
    }

    /// Pulses of one realisation.
    pub fn pulses(&self) -> usize {
        self.plan.geometry.schedule.pulses()
    }

    /// Hands the signals of one realisation to `sink`, piece after piece: the number of the first pulse and the records
    /// \[pulse, sample\], A, real at the intermediate frequency or complex about zero. The pulses of a line stand together.
    /// Returns how many samples the converter clipped.
    ///
    /// A piece has some ten megabytes of records, however many pulses there are. Every pulse has its own random stream, keyed by
    /// realisation, line and pulse.
    ///
    /// # Errors
    /// What the signal simulation refuses; a checked scene gives none; and the errors of `sink`.
    pub fn in_pieces<T: Sample>(
        &self,
        realisation: usize,
        observer: &dyn Observer,
        mut sink: impl FnMut(usize, ArrayView2<'_, T>) -> Result<(), Error>,
    ) -> Result<u64, Error> {
        let mut size = records_at_once::<T>(self.simulator.record().samples, self.pulses());
        let own = self.own_air(realisation)?;
        let air = own.as_ref().unwrap_or(&self.air);
        if air.spread_m_s.is_some() {
            // Each pulse brings its air: velocity and weight of each layer.
            let layers = self.plan.geometry.layers.max(1);
            size =
                size.min((WINDS_BYTES as usize / (16 * layers)).max(rayon::current_num_threads()));
        }
        let mut clipped = 0_u64;
        for first in (0..self.pulses()).step_by(size) {
            let last = (first + size).min(self.pulses());
            let (records, here) = self.piece(realisation, air, first..last, observer)?;
            clipped += here;
            sink(first, records.view())?;
        }
        Ok(clipped)
    }

    /// The air of a realisation that has turbulence of its own; none of one that has that of all.
    ///
    /// # Errors
    /// What the wind refuses; a checked scene gives none.
    pub(crate) fn own_air(&self, realisation: usize) -> Result<Option<ScanAir>, Error> {
        let plan = self.plan;
        if realisation == 0 || !plan.scene().has_air_of_each_realisation() {
            return Ok(None);
        }
        let wind = Arc::new(plan.wind.with_eddies_of(&plan.file, realisation)?);
        ScanAir::new(plan, wind, &self.weights_per_m, &Silent).map(Some)
    }

    /// The records of some pulses of a realisation.
    fn piece<T: Sample>(
        &self,
        realisation: usize,
        air: &ScanAir,
        pulses: Range<usize>,
        observer: &dyn Observer,
    ) -> Result<(Array2<T>, u64), Error> {
        let schedule = &self.plan.geometry.schedule;
        let index = |key: PulseKey| realisation * self.pulses() + pulses.start + key.pulse;
        let lines = self.lines_of_pulses(air, &pulses)?;
        let scan = Scan {
            simulator: &self.simulator,
            // One line after the other, which the simulation of signals need not know.
            lines: 1,
            pulses_per_line: pulses.len(),
            shot: |key: PulseKey| {
                let pulse = pulses.start + key.pulse;
                let line = schedule.line_of(pulse);
                if schedule.lines[line].first == pulse {
                    observer.advance(1);
                }
                let turbulence = self.plan.turbulence_of_line(line);
                let efficiency = self
                    .efficiency
                    .as_ref()
                    .map(|all| all[turbulence].of_pulse(index(key)));
                let previous = air.previous.as_ref().map(|lines| &lines[line]);
                let impairment_seed =
                    stream(self.plan.scene().seed, "asides", index(key) as u64).next_u64();
                Shot {
                    line: lines.get(key.pulse).unwrap_or(air.of_signals(line)),
                    efficiency,
                    previous,
                    impairment_seed,
                }
            },
            generator: |key| stream(self.plan.scene().seed, "signal", index(key) as u64),
            digitiser: self.plan.instrument.digitiser,
        };
        Ok(scan.collect()?)
    }

    /// The air that each of some pulses meets; none where the pulses of a line share one.
    fn lines_of_pulses(
        &self,
        air: &ScanAir,
        pulses: &Range<usize>,
    ) -> Result<Vec<LineOfSight>, Error> {
        if air.spread_m_s.is_none() {
            return Ok(Vec::new());
        }
        let schedule = &self.plan.geometry.schedule;
        let ranges_m: Vec<f64> = self.plan.geometry.layer_range_m().collect();
        let beams: Vec<(usize, Beam)> = pulses
            .clone()
            .map(|pulse| (schedule.line_of(pulse), schedule.beam_of_pulse(pulse)))
            .collect();
        let along = |(line, beam): &(usize, Beam)| {
            let velocity_m_s = velocity_along_m_s(self.plan, &air.wind, beam, &ranges_m)?;
            let geometry = &self.plan.geometry;
            let weight_per_m = &self.weights_per_m[self.plan.air_of_line(*line)];
            Ok(line_of_sight(weight_per_m, velocity_m_s, geometry))
        };
        in_time_order(&air.wind, &beams, |(_, beam)| beam.time_s, along)
    }
}

/// Works on items in parallel, but on those of one stretch of the wind's times after those of the one before: a wind that is read
/// from files then reads each once.
fn in_time_order<T: Sync, R: Send>(
    wind: &SceneWind,
    items: &[T],
    time_s: impl Fn(&T) -> f64,
    work: impl Fn(&T) -> Result<R, Error> + Sync,
) -> Result<Vec<R>, Error> {
    let stretch = |item: &T| wind.stretch_of(wind.start_s + time_s(item));
    let mut out = Vec::with_capacity(items.len());
    for part in items.chunk_by(|a, b| stretch(a) == stretch(b)) {
        out.extend(
            part.par_iter()
                .map(&work)
                .collect::<Result<Vec<_>, Error>>()?,
        );
    }
    Ok(out)
}

fn layer_snr(scene: &Scene, instrument: &Instrument, line: &LineOfSight) -> Vec<(f64, f64)> {
    let snr = |&weight_per_m: &f64| {
        instrument
            .receiver
            .slowly_varying_snr(scene.pulse.energy_j, weight_per_m)
    };
    line.weight_per_m
        .iter()
        .enumerate()
        .map(|(l, weight_per_m)| (line.range_m(l), snr(weight_per_m)))
        .collect()
}

/// Signal-to-noise ratio of most layers that return light, given with their ranges: the median, which a cloud does not move; 0 where none
/// does.
pub(crate) fn median_snr(layer_snr: &[(f64, f64)]) -> f64 {
    let mut all: Vec<f64> = layer_snr
        .iter()
        .map(|(_, snr)| *snr)
        .filter(|snr| *snr > 0.0)
        .collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// A line of sight through air of that radial velocity, m/s, whose layers return `weight_per_m`.
fn line_of_sight(
    weight_per_m: &[f64],
    radial_velocity_m_s: Vec<f64>,
    geometry: &Geometry,
) -> LineOfSight {
    LineOfSight {
        first_range_m: geometry.first_layer_range_m,
        layer_thickness_m: geometry.layer_thickness_m,
        radial_velocity_m_s,
        weight_per_m: weight_per_m.to_vec(),
    }
}

/// [`layer_returns`] of each air of the plan.
fn returns_of_slants(optics: &LineOptics<'_>) -> Result<Vec<Vec<f64>>, Error> {
    let instruments = optics.plan.instruments();
    instruments
        .iter()
        .map(|instrument| {
            layer_returns(&LineOptics {
                instrument,
                ..*optics
            })
        })
        .collect()
}

/// Return per metre of each layer, K^2 beta A_R eta_s/R^2, (9), with the mean efficiency; a signal-to-noise ratio that the scene
/// states takes the place of all of it.
fn layer_returns(optics: &LineOptics<'_>) -> Result<Vec<f64>, Error> {
    let plan = optics.plan;
    let scene = plan.scene();
    let instrument = optics.instrument;
    let geometry = &plan.geometry;
    if let SnrReference::Fixed { snr_db } = scene.detector.snr {
        let unit = instrument
            .receiver
            .slowly_varying_snr(scene.pulse.energy_j, 1.0);
        return Ok(vec![10f64.powf(0.1 * snr_db) / unit; geometry.layers]);
    }
    let efficiency = optics.of_layers()?;
    efficiency
        .range_m
        .iter()
        .zip(&efficiency.mean)
        .map(|(&range_m, eta)| Ok(instrument.return_per_m(range_m)? * eta))
        .collect()
}

/// The air from which the pulse before comes back at the same time, c/(2 PRF) farther away, at the ranges of the lines. Nothing comes
/// from below the ground, and nothing is seen at ranges from which the receiver is blind.
fn previous_air(
    plan: &Plan,
    wind: &SceneWind,
    lines: &[LineOfSight],
) -> Result<Option<Vec<LineOfSight>>, Error> {
    let scene = plan.scene();
    let geometry = &plan.geometry;
    let Some(SecondTrip {
        radial_velocity_m_s: elsewhere_m_s,
    }) = scene.scan.second_trip
    else {
        return Ok(None);
    };
    let apart_m = ambiguous_range_m(scene.laser.pulse_repetition_hz);
    let ranges_m: Vec<f64> = geometry
        .layer_range_m()
        .map(|range_m| range_m + apart_m)
        .collect();
    let mut weights_per_m = Vec::new();
    for instrument in plan.instruments() {
        let efficiency = efficiency_by_theory(instrument, &ranges_m)?;
        let mut weight_per_m = Vec::with_capacity(ranges_m.len());
        let far = ranges_m.iter().zip(&efficiency.mean);
        for (own_range_m, (far_m, eta)) in geometry.layer_range_m().zip(far) {
            let is_blind = own_range_m < instrument.blind_range_m;
            let seen = if is_blind { 0.0 } else { *eta };
            weight_per_m.push(instrument.return_per_m(*far_m)? * seen);
        }
        weights_per_m.push(weight_per_m);
    }
    let far = |(i, line): (usize, &LineOfSight)| {
        let middle = geometry.schedule.middle(i);
        let (points_m, mut velocity_m_s) = known_velocity_m_s(wind, &middle, &ranges_m)?;
        velocity_m_s
            .iter_mut()
            .filter(|v| v.is_nan())
            .for_each(|v| *v = elsewhere_m_s);
        let mut weight_per_m = weights_per_m[plan.air_of_line(i)].clone();
        for (weight_per_m, point_m) in weight_per_m.iter_mut().zip(&points_m) {
            if point_m[2] < 0.0 {
                *weight_per_m = 0.0;
            }
        }
        Ok(LineOfSight {
            radial_velocity_m_s: velocity_m_s,
            weight_per_m,
            ..line.clone()
        })
    };
    Ok(Some(
        lines
            .iter()
            .enumerate()
            .map(far)
            .collect::<Result<_, Error>>()?,
    ))
}

/// Efficiency of the layers over their mean, one set for each realisation of the turbulence, if the pulses have their own; for each
/// turbulence of the plan.
fn drawn_efficiency(
    optics: &LineOptics<'_>,
    lines: &[LineOfSight],
) -> Result<Option<Vec<LayerEfficiency>>, Error> {
    let scene = optics.plan.scene();
    let geometry = &optics.plan.geometry;
    let (Some(_), Some(line)) = (drawn_turbulence(scene), lines.first()) else {
        return Ok(None);
    };
    let first_m = [geometry.first_layer_range_m];
    let Some(&(ends_m, _)) = stretches(scene, geometry, &first_m).first() else {
        return Ok(None);
    };
    let mut all = Vec::new();
    for instrument in optics.plan.turbulences() {
        let optics = LineOptics {
            instrument,
            ..*optics
        };
        let screens = optics.screens(ends_m)?;
        let of_layers = LayerEfficiency::new(&screens.range_m, &screens.realisations, line)?;
        all.push(of_layers);
    }
    Ok(Some(all))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::SceneFile;
    use std::path::Path;

    #[test]
    fn the_pulse_before_has_no_echo_from_below_the_ground_and_none_at_blind_ranges() {
        // Pulses 1.5 km apart: one line is then 100 m and more below the ground, one above it.
        let text = "flow = { kind = \"uniform\", lateral_m_s = 4.0, vertical_m_s = 0.0 }\n\
            [laser]\npulse_repetition_hz = 100e3\n[telescope]\nblind_range_m = 350.0\n\
            [scan]\nlidar_height_m = 60.0\nelevation_min_rad = -0.1\nelevation_max_rad = 0.1\nelevation_step_rad = 0.2\n\
            range_min_m = 300.0\nrange_max_m = 400.0\nsecond_trip = {}\n";
        let file = SceneFile::parse(text, Path::new("s.toml")).unwrap();
        let plan = Plan::new(file, Target::Signal).unwrap();
        let geometry = &plan.geometry;
        assert_eq!(geometry.schedule.lines.len(), 2);
        let air = line_of_sight(
            &vec![1.0; geometry.layers],
            vec![0.0; geometry.layers],
            geometry,
        );
        let lines = vec![air; 2];
        let previous = previous_air(&plan, &plan.wind, &lines).unwrap().unwrap();
        assert!(previous[0].weight_per_m.iter().all(|weight| *weight == 0.0));
        for (range_m, weight) in geometry.layer_range_m().zip(&previous[1].weight_per_m) {
            assert_eq!(*weight > 0.0, range_m >= 350.0, "{range_m}: {weight}");
        }
    }
}
