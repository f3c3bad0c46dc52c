//! The search: a pilot with the finest keys, one key at a time from fine to coarse, and the choice, tried as a whole with another seed.
//!
//! What is decided depends on forecasts, never on times that were measured, so that a search has the same result on any machine. Measured
//! on the maps are the keys of the estimator, by the same signals, and the response to the efficiency.
//! Check: scenes whose keys are known; budgets; the same for any number of threads.

use super::figures::{Figure, Shift, Shown};
use super::keys::{PADDED, REALISATIONS, WINDOW_STEP, value, with};
use super::ladder::{Ladder, Step, Verdict};
use super::{Accuracy, Request};
use crate::Error;
use crate::plan::{Plan, Target};
use crate::scene::{Atmosphere, Method, SceneFile};
use crate::setup::efficiency_model::{model, signals_cross_screens};
use crate::setup::progress::{Observer, Stage};
use crate::setup::streams::stream;
use crate::sweep::{Common, measured};
use rand_xoshiro::rand_core::Rng;
use std::time::Instant;
use wakescope_optics::plan::Model;

/// Realisations of the pilot at least, for a jackknife.
pub(super) const LEAST: usize = 8;
/// Part of a run below which a key takes its finest value for nothing.
const NOTHING: f64 = 0.05;
/// Planning of the phase screens of a stretch of range, s.
pub(super) const PLANNING_S: f64 = 0.14;

/// A search under way.
pub(super) struct Search<'a> {
    pub(super) request: &'a Request,
    observer: &'a dyn Observer,
    common: Common,
    /// The scene's own run.
    pub(super) own: Plan,
    /// The scene with the finest keys.
    pub(super) fine: SceneFile,
    /// Air and seed of the phase screens that were made.
    crossed: Vec<(Atmosphere, u64)>,
    /// Standard deviation of the efficiency of one realisation of the path, over its mean.
    pub(super) scatter: Option<f64>,
    /// What is found.
    pub(super) out: Accuracy,
}

/// Forecast of a run, s of one core; phase screens are planned before it, and in it once more.
pub(super) fn run_s(plan: &Plan) -> f64 {
    plan.core_s + 2.0 * PLANNING_S * plan.screens.len() as f64
}

impl Accuracy {
    /// The accuracy of a scene.
    ///
    /// # Errors
    /// What the scene refuses; figures that it does not have.
    pub fn of(file: &SceneFile, request: &Request, observer: &dyn Observer) -> Result<Self, Error> {
        let begun = Instant::now();
        let mut scene = file.content.clone();
        (scene.outputs.svg, scene.outputs.png) = (false, false);
        let (fine, common) = (file.with(scene)?, Common::default());
        let own = common.plan(&fine, Target::Run)?;
        own.fits()?;
        let own_s = run_s(&own);
        let spent_s = PLANNING_S * own.screens.len() as f64;
        let mut out = Self::begun(
            (file.clone(), &file.hash),
            request,
            [own_s, spent_s],
            request.figures(&own)?,
        );
        // TOML has signed whole numbers.
        out.verified.seed = stream(file.content.seed, "accuracy", 0).next_u64() >> 1;
        let mut search = Search {
            request,
            observer,
            common,
            own,
            fine,
            crossed: Vec::new(),
            scatter: None,
            out,
        };
        observer.begin(Stage::Cases, 3);
        if model(&file.content) != Model::MonteCarlo {
            search
                .out
                .notes
                .push("efficiency: exact, by quadrature".into());
        }
        let pilot = search.pilot()?;
        observer.advance(1);
        search.respond(&pilot)?;
        search.screens()?;
        observer.advance(1);
        search.verify(&pilot)?;
        observer.advance(1);
        observer.end();
        search.finish(&pilot)?;
        search.out.took_s = begun.elapsed().as_secs_f64();
        Ok(search.out)
    }
}

impl Search<'_> {
    /// Most that the keys may shift.
    pub(super) fn limit(&self) -> f64 {
        0.5 * self.out.within
    }

    /// The figures of the map.
    pub(super) fn of_map(&self) -> Vec<Figure> {
        self.out
            .figures
            .iter()
            .copied()
            .filter(|figure| *figure != Figure::Efficiency)
            .collect()
    }

    /// Spends a time, s, where it leaves as much as is kept for what follows.
    pub(super) fn affords(&mut self, cost_s: f64, kept_s: f64) -> bool {
        let is_within = self.out.spent_s + cost_s + kept_s <= self.out.allowed_s;
        self.out.spent_s += if is_within { cost_s } else { 0.0 };
        is_within
    }

    /// Plans a scene: phase screens that were planned are not planned again, and take no time then.
    pub(super) fn plan(&mut self, scene: &SceneFile, target: Target) -> Result<Plan, Error> {
        let before = self.common.planned();
        let plan = self.common.plan(scene, target);
        // Screens that are refused are planned in vain.
        if plan.is_err() || self.common.planned() > before {
            let of = plan.as_ref().unwrap_or(&self.own);
            self.out.spent_s += PLANNING_S * of.screens.len() as f64;
        }
        plan
    }

    /// Adds a key with values from the finest on, to one that is refused; `shifts` are those that a plan knows without realisations. A key
    /// that saves next to nothing stays with the first.
    pub(super) fn vary(
        &mut self,
        key: &'static str,
        now: f64,
        values: impl IntoIterator<Item = f64>,
        shifts: impl Fn(&Self, &Plan) -> Vec<(Figure, Shift)>,
    ) {
        let mut ladder = Ladder::new(key, now, Vec::new());
        for value in values {
            if !ladder.steps.is_empty() && !self.affords(0.0, 0.0) {
                self.out.notes.push(format!(
                    "{key}: not all values are looked at, the budget is spent"
                ));
                break;
            }
            let planned =
                with(&self.fine, &[(key, value)]).and_then(|scene| self.plan(&scene, Target::Run));
            let shifts = planned
                .as_ref()
                .map_or(Vec::new(), |plan| shifts(self, plan));
            let mut step = Step::new(value, planned.map(|plan| run_s(&plan)));
            let is_refused = step.forecast_s.is_nan();
            if !is_refused && !ladder.steps.is_empty() {
                let undecided = shifts.is_empty();
                step.verdict = if undecided {
                    Verdict::NotDecided
                } else {
                    Verdict::of(&shifts, self.limit())
                };
            }
            ladder.steps.push(Step { shifts, ..step });
            if is_refused {
                break;
            }
        }
        let forecasts_s = || ladder.steps.iter().map(|step| step.forecast_s);
        let saved_s =
            forecasts_s().next().unwrap_or(f64::NAN) - forecasts_s().fold(f64::INFINITY, f64::min);
        let saved = saved_s / self.out.own_s;
        // What is refused says itself why there is no other.
        if saved < NOTHING && forecasts_s().all(f64::is_finite) {
            ladder.steps.truncate(1);
            let saved = 100.0 * saved.max(0.0);
            ladder.note = Some(format!(
                "takes its finest value: any other saves {saved:.0} % of a run at most"
            ));
        }
        self.out.ladders.push(ladder);
    }

    /// Time of so many realisations of scenes one after another, those of the same signals beside each other, s.
    pub(super) fn cost_s(&mut self, scenes: &[SceneFile], count: usize) -> Result<f64, Error> {
        let (mut sum_s, mut crossed, mut before) = (0.0, self.crossed.clone(), None);
        for file in scenes {
            let plan = self.plan(file, Target::Map)?;
            let (scene, share) = (
                &file.content,
                count as f64 / file.content.scan.realisations as f64,
            );
            let air = (scene.atmosphere.clone(), scene.seed);
            if !crossed.contains(&air) {
                sum_s += plan.times.optics_s + PLANNING_S * plan.screens.len() as f64;
                crossed.push(air.clone());
            }
            let signals = Some((air, scene.pulse.energy_j));
            sum_s += share * plan.times.maps_s
                + if before == signals {
                    0.0
                } else {
                    share * plan.times.signals_s
                };
            if self.out.figures.contains(&Figure::Circulation) {
                sum_s += count as f64 * plan.times.fit_s;
            }
            before = signals;
        }
        Ok(sum_s)
    }

    /// Realisations `first` to `first + count` of scenes; nothing where they would not leave what is kept, s.
    pub(super) fn measure(
        &mut self,
        scenes: &[SceneFile],
        first: usize,
        count: usize,
        kept_s: f64,
    ) -> Result<Option<Vec<Shown>>, Error> {
        let cost_s = self.cost_s(scenes, count)?;
        if !self.affords(cost_s, kept_s) {
            return Ok(None);
        }
        self.crossed.extend(
            scenes
                .iter()
                .map(|file| (file.content.atmosphere.clone(), file.content.seed)),
        );
        let scenes = scenes
            .iter()
            .map(|scene| with(scene, &[(REALISATIONS, count as f64)]));
        let circulation = self.out.figures.contains(&Figure::Circulation);
        let scenes: Vec<SceneFile> = scenes.collect::<Result<_, _>>()?;
        let found = measured(
            &scenes,
            first,
            &self.common,
            self.observer,
            |plan, scanner, map| Shown::new(plan, scanner, map, circulation),
        )?;
        Ok(Some(found.into_iter().map(|(_, shown)| shown).collect()))
    }
}

/// Points of the finest spectrum for each sample of a window.
const FINE_PADDING: usize = 32;
/// Part of the budget that is kept for the verification, which takes less than the pilot, and for phase screens.
const KEPT: f64 = 0.5;
/// Part by which the energy is raised to see what the efficiency does to a map.
const RAISED: f64 = 0.03;

impl Search<'_> {
    /// The finest setting, and beside it each other value of the keys of the estimator; nothing where no map is judged or the budget does
    /// not hold it.
    fn pilot(&mut self) -> Result<Option<Shown>, Error> {
        if self.of_map().is_empty() {
            return Ok(None);
        }
        self.estimator_keys()?;
        let kept_s = KEPT * self.out.allowed_s;
        let mut places = self.undecided();
        let mut scenes = self.beside_the_finest(&places)?;
        let all = places.len();
        let needed_s = (self.out.spent_s + self.cost_s(&scenes, LEAST)?) / (1.0 - KEPT);
        let mut found = self.measure(&scenes, 0, LEAST, kept_s)?;
        // The coarsest values are the likeliest to be too far.
        while found.is_none() && !places.is_empty() {
            let longest = self
                .out
                .ladders
                .iter()
                .map(|ladder| ladder.steps.len())
                .max()
                .unwrap_or(1);
            self.out
                .ladders
                .iter_mut()
                .for_each(|ladder| ladder.steps.truncate(longest - 1));
            places = self.undecided();
            scenes = self.beside_the_finest(&places)?;
            found = self.measure(
                &scenes,
                0,
                LEAST,
                if places.is_empty() { 0.0 } else { kept_s },
            )?;
        }
        if places.len() < all {
            let needed = (needed_s / self.out.own_s).ceil();
            let seen = if places.is_empty() {
                "are not varied"
            } else {
                "are varied but for the coarsest values"
            };
            self.out.notes.push(format!(
                "keys of the estimator {seen}: --budget {needed} would do for all"
            ));
        }
        let Some(mut shown) = found else {
            self.out.notes.push(format!(
                "the map is not measured: its pilot takes {LEAST} realisations"
            ));
            return Ok(None);
        };
        self.refuse_lacking(&shown[0])?;
        self.judge(&shown, &places);
        while self.out.ladders.iter().any(Ladder::is_open) {
            let (count, more) = (shown[0].realisations(), shown[0].realisations() / 2);
            let Some(more) = self.measure(&scenes, count, more, kept_s)? else {
                break;
            };
            shown
                .iter_mut()
                .zip(more)
                .for_each(|(shown, more)| shown.extend(more));
            self.judge(&shown, &places);
        }
        self.out.pilot = shown[0].realisations();
        Ok(Some(shown.swap_remove(0)))
    }

    /// Places of keys and values that are to be measured.
    fn undecided(&self) -> Vec<(usize, usize)> {
        let steps = |which: usize| self.out.ladders[which].steps.iter().enumerate();
        let of_key = |which| steps(which).filter(|(_, step)| step.verdict == Verdict::NotDecided);
        (0..self.out.ladders.len())
            .flat_map(|which| of_key(which).map(move |(place, _)| (which, place)))
            .collect()
    }

    /// The finest setting, and after it the same with each of the values at those places.
    fn beside_the_finest(&self, places: &[(usize, usize)]) -> Result<Vec<SceneFile>, Error> {
        let varied = places.iter().map(|&(which, place)| {
            let ladder = &self.out.ladders[which];
            with(&self.fine, &[(ladder.key, ladder.steps[place].value)])
        });
        std::iter::once(Ok(self.fine.clone()))
            .chain(varied)
            .collect()
    }

    /// The keys of the estimator, from the finest values on.
    fn estimator_keys(&mut self) -> Result<(), Error> {
        let scene = self.fine.content.clone();
        let window = scene.estimator.window_samples;
        let most = (FINE_PADDING * window)
            .next_power_of_two()
            .min(1 << 20)
            .max(scene.estimator.padded_samples) as f64;
        let has_spectrum = scene.estimator.method != (Method::PulsePair {});
        self.fine = with(&self.fine, &[(WINDOW_STEP, 1.0)])?;
        if has_spectrum {
            self.fine = with(&self.fine, &[(PADDED, most)])?;
        }
        let window = window as f64;
        let steps = (0..)
            .map(|i| 2f64.powi(i))
            .take_while(|step| *step <= window);
        self.vary(WINDOW_STEP, value(&scene, WINDOW_STEP), steps, |_, _| {
            Vec::new()
        });
        if has_spectrum {
            let points = (0..)
                .map(|i| most / 2f64.powi(i))
                .take_while(|points| *points >= window);
            self.vary(PADDED, value(&scene, PADDED), points, |_, _| Vec::new());
        }
        Ok(())
    }

    /// The circulation where no map has one: an error if it was asked for.
    fn refuse_lacking(&mut self, shown: &Shown) -> Result<(), Error> {
        let lacking =
            |figure: &Figure| *figure == Figure::Circulation && !shown.noise(*figure).is_finite();
        if self.request.of.iter().any(lacking) {
            let reason = "circulation is fitted to scans across a pair alone, with noise, real signals and a Gaussian pulse";
            return Err(Error::Input {
                path: "--of".into(),
                reason: reason.into(),
            });
        }
        self.out.figures.retain(|figure| !lacking(figure));
        Ok(())
    }

    /// Shifts and verdicts of all values that were measured.
    fn judge(&mut self, shown: &[Shown], places: &[(usize, usize)]) {
        let (figures, limit) = (self.of_map(), self.limit());
        for (&(which, place), own) in places.iter().zip(&shown[1..]) {
            let shifts: Vec<_> = figures
                .iter()
                .map(|figure| (*figure, own.shift(&shown[0], *figure)))
                .collect();
            let lost = own.lost(&shown[0]);
            let step = &mut self.out.ladders[which].steps[place];
            step.verdict = if lost > 0.0 {
                Verdict::Lost(lost)
            } else {
                Verdict::of(&shifts, limit)
            };
            step.shifts = shifts;
        }
    }

    /// What a change of the efficiency does to the map, where screens change that of the signals.
    fn respond(&mut self, pilot: &Option<Shown>) -> Result<(), Error> {
        if pilot.is_none() || !signals_cross_screens(&self.fine.content) {
            return Ok(());
        }
        let mut scene = self.fine.content.clone();
        scene.pulse.energy_j *= 1.0 + RAISED;
        let found = self.measure(&[self.fine.clone(), self.fine.with(scene)?], 0, LEAST, 0.0)?;
        if found.is_none() {
            self.out
                .notes
                .push("response of the map to the efficiency: not measured, taken to be 1".into());
        }
        let response = |figure| match &found {
            Some(found) => (figure, found[1].shift(&found[0], figure).bound() / RAISED),
            None => (figure, 1.0),
        };
        self.out.response = self.of_map().into_iter().map(response).collect();
        Ok(())
    }
}
