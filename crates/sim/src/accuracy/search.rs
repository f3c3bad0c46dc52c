//! The search: a pilot with the finest keys, one key at a time from fine to coarse, and the choice, tried as a whole with another seed.
//!
//! What is decided depends on forecasts, never on times that were measured, so that a search has the same result on any machine.
//! Check: scenes whose keys are known; budgets; the same for any number of threads.

use super::figures::{Figure, Shift, Shown};
use super::keys::{GRID_POINTS, GRID_SPACING, LAYERS, PADDED, PATHS, REALISATIONS, WINDOW_STEP, value, with};
use super::ladder::{Ladder, Step, Verdict};
use super::{Accuracy, Request, paths};
use crate::Error;
use crate::measure::efficiencies::Known;
use crate::plan::{Plan, Target, coverage::empty_gates, time::Times};
use crate::scene::{Method, RefractiveTurbulence, Scene, SceneFile, ScreenSampling, Turbulence};
use crate::setup::efficiency_model::{drawn_turbulence, model, signals_cross_screens, turbulence};
use crate::setup::progress::{Observer, Stage};
use crate::sweep::{Common, measured};
use std::time::Instant;
use wakescope_optics::plan::Model;

/// Realisations of the pilot at least, for a jackknife.
const LEAST: usize = 8;
/// Part of a run below which a key takes its finest value for nothing.
const NOTHING: f64 = 0.05;
/// Points of the finest spectrum for each sample of a window.
const FINE_PADDING: usize = 32;
/// Part by which the energy is raised to see what the efficiency does to a map.
const RAISED: f64 = 0.03;
/// A search under way.
pub(super) struct Search<'a> {
    pub(super) request: &'a Request,
    observer: &'a dyn Observer,
    pub(super) common: Common,
    /// Times of phase screens, s: planning them takes long.
    screens_s: Known<f64>,
    /// The scene with the finest keys.
    pub(super) fine: SceneFile,
    pub(super) own_s: f64,
    pub(super) spent_s: f64,
    pub(super) begun: Instant,
    pub(super) figures: Vec<Figure>,
    pub(super) ladders: Vec<Ladder>,
    /// Shift of a figure of the map for that of the efficiency.
    pub(super) response: Vec<(Figure, f64)>,
    /// Standard deviation of the efficiency of one realisation of the path, over its mean.
    pub(super) scatter: Option<f64>,
    pub(super) notes: Vec<String>,
    /// Whether the budget does not hold what the answer needs.
    pub(super) is_short: bool,
}

impl<'a> Search<'a> {
    /// Searches for a scene.
    ///
    /// # Errors
    /// What the scene refuses; figures that it does not have.
    pub(super) fn run(file: &SceneFile, request: &'a Request, observer: &'a dyn Observer) -> Result<Accuracy, Error> {
        let mut scene = file.scene.clone();
        (scene.outputs.svg, scene.outputs.png) = (false, false);
        let (quiet, common) = (file.with(scene)?, Common::default());
        let own = common.plan(&quiet, Target::Run)?;
        own.fits()?;
        let figures = request.figures(&own)?;
        let mut search = Self {
            request,
            observer,
            common,
            screens_s: Known::default(),
            fine: quiet,
            own_s: own.core_s,
            spent_s: 0.0,
            begun: Instant::now(),
            figures,
            ladders: Vec::new(),
            response: Vec::new(),
            scatter: None,
            notes: Vec::new(),
            is_short: false,
        };
        observer.begin(Stage::Cases, 3);
        if !search.figures.contains(&Figure::Efficiency) && request.of.is_empty() {
            search.notes.push("efficiency: exact, by quadrature".into());
        }
        if search.of_map().next().is_some() {
            search.estimator_ladders(&own)?;
        }
        let pilot = search.pilot()?;
        observer.advance(1);
        search.respond(&own, pilot.as_ref())?;
        search.screen_ladders(&own)?;
        observer.advance(1);
        let verified = search.verified(&own, pilot.as_ref().map_or(LEAST, Shown::realisations))?;
        observer.advance(1);
        observer.end();
        search.finished(file, own, pilot.as_ref(), verified)
    }

    pub(super) fn allowed_s(&self) -> f64 {
        self.request.budget * self.own_s
    }

    pub(super) fn limit(&self) -> f64 {
        0.5 * self.request.within
    }

    /// The figures of the map.
    pub(super) fn of_map(&self) -> impl Iterator<Item = Figure> + Clone + '_ {
        self.figures.iter().copied().filter(|figure| *figure != Figure::Efficiency)
    }

    fn with(&self, key: &'static str, value: f64) -> Result<SceneFile, Error> {
        with(&self.fine, &[(key, value)])
    }

    /// The plan of a scene without its phase screens, and the forecast with them: they are planned once for all scenes that have them.
    pub(super) fn planned(&self, scene: &SceneFile, target: Target) -> Result<(Plan, Times), Error> {
        let Turbulence::Refractive(screens) = scene.scene.atmosphere.turbulence else {
            let plan = self.common.plan(scene, target)?;
            let times = plan.times;
            return Ok((plan, times));
        };
        // In proportion to the realisations.
        let count = value(&self.fine.scene, PATHS);
        let one = with(scene, &[(PATHS, count)])?;
        let cause = format!("{:?}", (one.scene.atmosphere.turbulence, target));
        let screens_s = self.screens_s.of(cause, || Ok(self.common.plan(&one, target)?.times.optics_s))?;
        let mut calm = scene.scene.clone();
        calm.atmosphere.turbulence = Turbulence::None {};
        let plan = self.common.plan(&scene.with(calm)?, target)?;
        let times = Times { optics_s: *screens_s * screens.realisations as f64 / count, ..plan.times };
        Ok((plan, times))
    }

    /// A ladder of scenes with one key changed, until a scene is refused or has gates without windows.
    fn ladder(&self, key: &'static str, now: f64, values: impl IntoIterator<Item = f64>) -> Ladder {
        let mut ladder = Ladder { key, now, steps: Vec::new(), chosen: 0, note: None };
        let mut empty_of_finest = 0.0;
        for value in values {
            let planned = self.with(key, value).and_then(|scene| self.planned(&scene, Target::Run));
            let found = planned.and_then(|(plan, times)| {
                let empty = empty_gates(&plan.scene.scene, &plan.geometry)? as f64;
                Ok((times.total_s(), empty / plan.geometry.gate_range_m.len() as f64))
            });
            let (forecast_s, verdict) = match found {
                Ok((core_s, lost)) if ladder.steps.is_empty() => {
                    empty_of_finest = lost;
                    (core_s, Verdict::Finest)
                }
                Ok((core_s, lost)) if lost > empty_of_finest => (core_s, Verdict::Lost(lost - empty_of_finest)),
                Ok((core_s, _)) => (core_s, Verdict::NotDecided),
                Err(error) => (f64::NAN, Verdict::Refused(error.to_string())),
            };
            let is_last = matches!(verdict, Verdict::Lost(_) | Verdict::Refused(_));
            ladder.steps.push(Step { value, forecast_s, shifts: Vec::new(), verdict });
            if is_last {
                break;
            }
        }
        ladder
    }

    /// The keys of the estimator; what costs nothing takes the finest value.
    fn estimator_ladders(&mut self, own: &Plan) -> Result<(), Error> {
        let (now, window) = (self.fine.scene.clone(), self.fine.scene.estimator.window_samples);
        let most = (FINE_PADDING * window).next_power_of_two().min(1 << 20).max(now.estimator.padded_samples);
        let has_spectrum = !matches!(now.estimator.method, Method::PulsePair {} | Method::AutoregressivePole(_));
        let mut values = vec![(WINDOW_STEP, 1.0)];
        values.extend(has_spectrum.then_some((PADDED, most as f64)));
        self.fine = with(&self.fine, &values)?;
        for (key, finest) in values {
            let halves = |i: i32| match key {
                WINDOW_STEP => finest * 2f64.powi(i),
                _ => finest / 2f64.powi(i),
            };
            let is_sensible = |value: &f64| match key {
                WINDOW_STEP => *value <= window as f64,
                _ => *value >= window as f64,
            };
            let mut ladder = self.ladder(key, value(&now, key), (0..).map(halves).take_while(is_sensible));
            let cheapest_s = ladder.steps.iter().map(|step| step.forecast_s).fold(f64::INFINITY, f64::min);
            let saved = (ladder.steps[0].forecast_s - cheapest_s) / own.core_s;
            if saved < NOTHING {
                ladder.steps.truncate(1);
                ladder.note = Some(format!(
                    "takes its finest value: any other saves {:.0} % of a run at most",
                    100.0 * saved.max(0.0)
                ));
            }
            self.ladders.push(ladder);
        }
        Ok(())
    }

    /// Time of so many realisations of scenes one after another, those of the same signals beside each other, s.
    pub(super) fn cost_s(&self, scenes: &[SceneFile], count: usize, optics: bool) -> Result<f64, Error> {
        let mut sum_s = 0.0;
        let signals = |scene: &Scene| (scene.atmosphere.clone(), scene.pulse_energy_j());
        for (i, scene) in scenes.iter().enumerate() {
            let (_, times) = self.planned(scene, Target::Map)?;
            let share = count as f64 / scene.scene.scan.realisations as f64;
            let before = i.checked_sub(1).map(|before| signals(&scenes[before].scene));
            if before != Some(signals(&scene.scene)) {
                sum_s += share * times.signals_s + if optics { times.optics_s } else { 0.0 };
            }
            sum_s += share * times.maps_s;
        }
        Ok(sum_s)
    }

    /// Realisations `first` to `first + count` of scenes.
    pub(super) fn measure(&mut self, scenes: &[SceneFile], first: usize, count: usize) -> Result<Vec<Shown>, Error> {
        self.spent_s += self.cost_s(scenes, count, first == 0)?;
        let scenes: Vec<SceneFile> =
            scenes.iter().map(|scene| with(scene, &[(REALISATIONS, count as f64)])).collect::<Result<_, _>>()?;
        let circulation = self.figures.contains(&Figure::Circulation);
        let found = measured(&scenes, first, &self.common, self.observer, |plan, scanner, map| {
            Shown::new(plan, scanner, map, circulation)
        })?;
        Ok(found.into_iter().map(|(_, shown)| shown).collect())
    }

    /// The finest setting, and beside it each other value of the keys of the estimator by the same signals.
    fn pilot(&mut self) -> Result<Option<Shown>, Error> {
        if self.of_map().next().is_none() {
            return Ok(None);
        }
        let mut scenes = vec![self.fine.clone()];
        let mut places = Vec::new();
        for (which, ladder) in self.ladders.iter().enumerate() {
            for (place, step) in ladder.steps.iter().enumerate().filter(|(_, s)| s.verdict == Verdict::NotDecided) {
                scenes.push(self.with(ladder.key, step.value)?);
                places.push((which, place));
            }
        }
        // The verification costs as much for two settings.
        let all_s = |count: usize, optics| -> Result<f64, Error> {
            let verify: &[SceneFile] = &scenes[..scenes.len().min(2)];
            let once_s = if scenes.len() > 1 { self.cost_s(verify, count, true)? } else { 0.0 };
            Ok(self.cost_s(&scenes, count, optics)? + once_s)
        };
        if all_s(LEAST, true)? > self.allowed_s() {
            let needed = (all_s(LEAST, true)? / self.own_s).ceil();
            self.ladders.iter_mut().for_each(|ladder| ladder.steps.truncate(1));
            self.notes.push(format!("keys of the estimator are not varied: --budget {needed} would do"));
            scenes.truncate(1);
            places.clear();
        }
        if self.cost_s(&scenes, LEAST, true)? > self.allowed_s() {
            self.is_short = true;
            self.notes.push(format!("the map is not measured: its pilot takes {LEAST} realisations"));
            return Ok(None);
        }
        let mut shown = self.measure(&scenes, 0, LEAST)?;
        self.refuse_lacking(&shown[0])?;
        let mut count = LEAST;
        self.judge(&shown, &places);
        // The response to the efficiency, and screens of the choice.
        let crosses = signals_cross_screens(&self.fine.scene);
        let kept_s = if crosses { self.cost_s(&scenes[..1], LEAST, true)? } else { 0.0 };
        while self.ladders.iter().any(Ladder::is_open) {
            let half = count / 2;
            let more_s = self.cost_s(&scenes, half, false)? + self.cost_s(&scenes[..2], count + half, true)?;
            if self.spent_s + more_s + kept_s > self.allowed_s() {
                break;
            }
            let more = self.measure(&scenes, count, half)?;
            shown.iter_mut().zip(more).for_each(|(shown, more)| shown.extend(more));
            count += half;
            self.judge(&shown, &places);
        }
        Ok(Some(shown.swap_remove(0)))
    }

    /// Figures that were asked for and that the maps do not show.
    fn refuse_lacking(&mut self, shown: &Shown) -> Result<(), Error> {
        let lacking = |figure: &Figure| *figure != Figure::Efficiency && !shown.has(*figure);
        if self.request.of.iter().any(lacking) {
            let reason =
                "circulation is fitted to scans across a pair alone, with noise, real signals and a Gaussian pulse";
            return Err(Error::Input { path: "--of".into(), reason: reason.into() });
        }
        self.figures.retain(|figure| !lacking(figure));
        Ok(())
    }

    /// Shifts and verdicts of all values that were measured.
    fn judge(&mut self, shown: &[Shown], places: &[(usize, usize)]) {
        let (figures, limit): (Vec<Figure>, f64) = (self.of_map().collect(), self.limit());
        for (&(which, place), own) in places.iter().zip(&shown[1..]) {
            let shifts: Vec<_> = figures.iter().map(|figure| (*figure, own.shift(&shown[0], *figure))).collect();
            let lost = own.lost(&shown[0]);
            let step = &mut self.ladders[which].steps[place];
            step.verdict = if lost > 0.0 { Verdict::Lost(lost) } else { Verdict::of(&shifts, limit) };
            step.shifts = shifts;
        }
    }

    /// What a change of the efficiency does to the map, where screens change that of the signals.
    fn respond(&mut self, own: &Plan, pilot: Option<&Shown>) -> Result<(), Error> {
        let Some(pilot) = pilot.filter(|_| signals_cross_screens(&own.scene.scene)) else { return Ok(()) };
        let mut scene = self.fine.scene.clone();
        match &mut scene.laser.amplifier {
            Some(amplifier) => {
                amplifier.mean_power_w *= 1.0 + RAISED;
                amplifier.largest_energy_j *= 1.0 + RAISED;
            }
            None => scene.pulse.energy_j *= 1.0 + RAISED,
        }
        let raised = [self.fine.with(scene)?];
        let figures: Vec<Figure> = self.of_map().collect();
        if self.spent_s + self.cost_s(&raised, LEAST, false)? > self.allowed_s() {
            self.response = figures.into_iter().map(|figure| (figure, 1.0)).collect();
            self.notes.push("response of the map to the efficiency: not measured, taken to be 1".into());
            return Ok(());
        }
        let first = pilot.first(LEAST);
        // The screens of the pilot serve.
        self.spent_s -= self.planned(&raised[0], Target::Map)?.1.optics_s;
        let found = self.measure(&raised, 0, LEAST)?;
        let of = |figure: Figure| (figure, found[0].shift(&first, figure).bound() / RAISED);
        self.response = figures.into_iter().map(of).collect();
        Ok(())
    }

    /// What a shift of the efficiency in the middle, and one anywhere, do to all figures.
    fn of_efficiency(&self, middle: Shift, anywhere: Shift) -> Vec<(Figure, Shift)> {
        let of_map =
            |(figure, of): &(Figure, f64)| (*figure, Shift { shift: of * anywhere.shift, error: of * anywhere.error });
        let own = self.figures.contains(&Figure::Efficiency).then_some((Figure::Efficiency, middle));
        own.into_iter().chain(self.response.iter().map(of_map)).collect()
    }

    /// The keys of the phase screens.
    fn screen_ladders(&mut self, own: &Plan) -> Result<(), Error> {
        let scene = &own.scene.scene;
        let Some(t) = turbulence(scene).filter(|_| model(scene) == Model::MonteCarlo) else { return Ok(()) };
        if drawn_turbulence(scene).is_some() {
            self.notes.push("keys of the turbulence are not varied: pulses have efficiencies of their own".into());
            return Ok(());
        }
        let coarse = t.sampling == ScreenSampling::Explicit && own.times.optics_s >= NOTHING * own.core_s;
        let mut compared = t;
        if coarse {
            let mut finest = t.layers;
            while finest < 64 * t.layers
                && paths::of_layers(own, &RefractiveTurbulence { layers: finest, ..t })?[1] > 0.5 * self.limit()
            {
                finest *= 2;
            }
            let halves = (0..)
                .map(|i| (finest as f64 / 2f64.powi(i)).floor())
                .take_while(|layers| *layers >= paths::LEAST_LAYERS);
            let mut ladder = self.ladder(LAYERS, t.layers as f64, halves);
            for step in ladder.steps.iter_mut().filter(|step| step.forecast_s.is_finite()) {
                let t = RefractiveTurbulence { layers: step.value as usize, ..t };
                let [middle, worst] = paths::of_layers(own, &t)?.map(|shift| Shift { shift, error: 0.0 });
                step.shifts = self.of_efficiency(middle, worst);
                if step.verdict != Verdict::Finest {
                    step.verdict = Verdict::of(&step.shifts, self.limit());
                }
            }
            // Grids do the same whatever the layers: the fewest that are good.
            let good = ladder.steps.iter().take_while(|s| matches!(s.verdict, Verdict::Finest | Verdict::Kept));
            compared.layers = good.last().map_or(t.layers, |step| step.value as usize);
            self.ladders.push(ladder);
            // Points before spacing: a scene is given them in this order, and the second keeps the width.
            let points = (0..5).map(|i| (t.grid_points as f64 / 2f64.powi(i)).floor());
            self.ladders.push(self.ladder(GRID_POINTS, t.grid_points as f64, points));
            let spacings = (0..5).map(|i| t.grid_spacing_m * 2f64.powi(i));
            self.ladders.push(self.ladder(GRID_SPACING, t.grid_spacing_m, spacings));
        }
        self.compare_grids(own, &compared, coarse)
    }

    /// The same realisations on every grid, with so few layers as do.
    fn compare_grids(&mut self, own: &Plan, t: &RefractiveTurbulence, coarse: bool) -> Result<(), Error> {
        let (range_m, seed) = (paths::middle_m(own), own.scene.scene.seed);
        let cost_s = paths::time_s(&own.instrument, t, range_m)?;
        if self.spent_s + cost_s > self.allowed_s() {
            self.notes.push("grids of the screens are not varied: the budget is spent".into());
            self.ladders.retain(|ladder| !matches!(ladder.key, GRID_SPACING | GRID_POINTS));
            return Ok(());
        }
        self.spent_s += cost_s;
        let fine = paths::efficiency(&own.instrument, t, range_m, seed)?;
        self.scatter = Some(paths::scatter(&fine));
        for which in (0..self.ladders.len()).filter(|_| coarse) {
            let key = self.ladders[which].key;
            if !matches!(key, GRID_SPACING | GRID_POINTS) {
                continue;
            }
            for place in 1..self.ladders[which].steps.len() {
                let Step { value, verdict: Verdict::NotDecided, .. } = self.ladders[which].steps[place] else { break };
                let scene = with(&own.scene, &[(LAYERS, t.layers as f64), (key, value)])?;
                let t = turbulence(&scene.scene).unwrap_or_default();
                let cost_s = paths::time_s(&own.instrument, &t, range_m)?;
                if self.spent_s + cost_s > self.allowed_s() {
                    break;
                }
                self.spent_s += cost_s;
                let found = match paths::efficiency(&own.instrument, &t, range_m, seed) {
                    Ok(found) => paths::shift(&found, &fine),
                    Err(error) => {
                        self.ladders[which].steps[place].verdict = Verdict::Refused(error.to_string());
                        break;
                    }
                };
                let shifts = self.of_efficiency(found, found);
                let verdict = Verdict::of(&shifts, self.limit());
                let is_last = verdict != Verdict::Kept;
                let step = &mut self.ladders[which].steps[place];
                (step.shifts, step.verdict) = (shifts, verdict);
                if is_last {
                    self.ladders[which].steps.truncate(place + 1);
                    break;
                }
            }
        }
        Ok(())
    }
}
