//! The chosen setting as a whole, tried with another seed; the realisations that the noise asks for; what a target out of reach takes.
//!
//! Check: with the search.

use super::figures::{Figure, Shift, Shown};
use super::keys::{PATHS, REALISATIONS, value, with};
use super::ladder::{bound, choose};
use super::search::Search;
use super::{Accuracy, Found, Noise, Verified, paths};
use crate::Error;
use crate::plan::{Plan, Target};
use crate::scene::{SceneFile, Turbulence};
use crate::setup::streams::stream;
use rand_xoshiro::rand_core::Rng;

/// How often the search goes a key back.
const BACK: usize = 2;
/// Part of the budget beyond which nothing more is begun.
const BEYOND: f64 = 1.15;
/// Realisations of a scan at least, for a standard deviation.
const LEAST: f64 = 2.0;

impl Search<'_> {
    /// Chooses, and tries the choice with another seed beside the finest setting; goes a key back where it does not hold.
    pub(super) fn verified(&mut self, own: &Plan, count: usize) -> Result<Verified, Error> {
        let limit = self.limit();
        let mut moves = choose(&mut self.ladders, &self.figures, limit);
        // TOML has signed whole numbers.
        let seed = stream(self.fine.scene.seed, "accuracy", 0).next_u64() >> 1;
        let (mut of_fine, mut rows) = (None, Vec::new());
        for _ in 0..=BACK {
            // Keys that are good alone may be refused together.
            while self.chosen(own).and_then(|scene| self.planned(&scene, Target::Run)).is_err() {
                let Some((which, place)) = moves.pop() else { break };
                self.ladders[which].chosen = place;
            }
            if moves.is_empty() {
                return Ok(Verified { seed, rows: Vec::new(), is_confirmed: true });
            }
            let Some(found) = self.tried(own, count, seed, &mut of_fine)? else { break };
            rows = found;
            if rows.iter().all(|(_, _, found)| found.bound() <= self.request.within) {
                return Ok(Verified { seed, rows, is_confirmed: true });
            }
            if let Some((which, place)) = moves.pop() {
                self.ladders[which].chosen = place;
            }
        }
        Ok(Verified { seed, rows, is_confirmed: false })
    }

    /// Predicted and found shift of each figure; nothing where the budget is spent.
    fn tried(
        &mut self,
        own: &Plan,
        count: usize,
        seed: u64,
        of_fine: &mut Option<Shown>,
    ) -> Result<Option<Vec<Found>>, Error> {
        let seeded = |file: &SceneFile| -> Result<SceneFile, Error> {
            Ok(file.with(crate::scene::Scene { seed, ..file.scene.clone() })?)
        };
        let mut rows = Vec::new();
        let predicted = |search: &Self, figure| -> f64 {
            let steps = search.ladders.iter().filter_map(|ladder| ladder.steps.get(ladder.chosen));
            steps.flat_map(|step| &step.shifts).filter(|(of, _)| *of == figure).map(|(_, own)| own.shift).sum()
        };
        if self.figures.contains(&Figure::Efficiency) {
            let (range_m, chosen) = (paths::middle_m(own), self.chosen(own)?);
            let Turbulence::Refractive(coarse) = chosen.scene.atmosphere.turbulence else { return Ok(Some(rows)) };
            let Turbulence::Refractive(mut fine) = own.scene.scene.atmosphere.turbulence else { return Ok(Some(rows)) };
            fine.layers = coarse.layers;
            let cost_s =
                paths::time_s(&own.instrument, &fine, range_m)? + paths::time_s(&own.instrument, &coarse, range_m)?;
            if self.spent_s + cost_s > BEYOND * self.allowed_s() {
                return Ok(None);
            }
            let [middle, _] = paths::of_layers(own, &coarse)?;
            let mut found = Shift { shift: 0.0, error: 0.0 };
            if (fine.grid_points, fine.grid_spacing_m) != (coarse.grid_points, coarse.grid_spacing_m) {
                self.spent_s += cost_s;
                let of_grid = |t| paths::efficiency(&own.instrument, t, range_m, seed);
                found = paths::shift(&of_grid(&coarse)?, &of_grid(&fine)?);
            }
            rows.push((
                Figure::Efficiency,
                predicted(self, Figure::Efficiency),
                Shift { shift: found.shift + middle, ..found },
            ));
        }
        let figures: Vec<Figure> = self.of_map().collect();
        if !figures.is_empty() {
            let mut scenes = vec![seeded(&self.fine)?, seeded(&self.chosen(own)?)?];
            if of_fine.is_some() {
                scenes.remove(0);
            }
            if self.spent_s + self.cost_s(&scenes, count, true)? > BEYOND * self.allowed_s() {
                return Ok(None);
            }
            let mut shown = self.measure(&scenes, 0, count)?;
            let coarse = shown.pop().unwrap_or_default();
            let fine = of_fine.get_or_insert_with(|| shown.pop().unwrap_or_default());
            let row = |figure| (figure, predicted(self, figure), coarse.shift(fine, figure));
            rows.extend(figures.into_iter().map(row));
        }
        Ok(Some(rows))
    }

    /// The scene with the chosen keys.
    fn chosen(&self, own: &Plan) -> Result<SceneFile, Error> {
        with(&self.fine, &self.values(own))
    }

    fn values(&self, own: &Plan) -> Vec<(&'static str, f64)> {
        let keys = self.ladders.iter().map(|ladder| (ladder.key, ladder.value()));
        keys.chain(self.paths(own).map(|count| (PATHS, count))).collect()
    }

    fn response(&self, figure: Figure) -> f64 {
        self.response.iter().find(|(of, _)| *of == figure).map_or(0.0, |(_, of)| *of)
    }

    /// Realisations of the path that the noise asks for; nothing where their scatter is not known, those of the scene where they would
    /// cost more than the budget.
    fn paths(&self, own: &Plan) -> Option<f64> {
        let (scatter, within) = (self.scatter?, self.request.within);
        let asked = |rest: f64| (2.0 * scatter / rest).powi(2);
        let is_judged = self.figures.contains(&Figure::Efficiency);
        let of_efficiency = if is_judged { asked(within - bound(&self.ladders, Figure::Efficiency)) } else { 0.0 };
        let of_maps = self.of_map().map(|figure| asked(0.25 * within / self.response(figure)));
        let needed = of_maps.fold(of_efficiency, f64::max).max(paths::LEAST);
        let needed = (0.25 * needed).ceil() * 4.0;
        Some(if self.of_paths_s(own, needed) <= self.allowed_s() { needed } else { value(&own.scene.scene, PATHS) })
    }

    /// Forecast of a run with so many realisations of the path and the chosen keys, s.
    fn of_paths_s(&self, own: &Plan, count: f64) -> f64 {
        let now = value(&own.scene.scene, PATHS);
        let keys: Vec<(&'static str, f64)> = self.ladders.iter().map(|ladder| (ladder.key, ladder.value())).collect();
        let planned = with(&self.fine, &keys).and_then(|scene| self.planned(&scene, Target::Run));
        planned.map_or(f64::NAN, |(_, times)| times.total_s() + times.optics_s * (count / now - 1.0))
    }

    /// What the noise asks for, and the whole answer.
    pub(super) fn finished(
        self,
        file: &SceneFile,
        own: Plan,
        pilot: Option<&Shown>,
        verified: Verified,
    ) -> Result<Accuracy, Error> {
        let (within, allowed_s) = (self.request.within, self.allowed_s());
        let chosen = self.chosen(&own)?;
        let (now, times) = (value(&chosen.scene, REALISATIONS), self.planned(&chosen, Target::Run)?.1);
        let each_s = (times.signals_s + times.maps_s + times.retrieval_s) / now;
        let fixed_s = times.total_s() - now * each_s;
        let mut noises = Vec::new();
        if let (Some(scatter), true) = (self.scatter, self.figures.contains(&Figure::Efficiency)) {
            let (now, keys) = (value(&own.scene.scene, PATHS), bound(&self.ladders, Figure::Efficiency));
            let needed = (2.0 * scatter / (within - keys)).powi(2).max(paths::LEAST).ceil();
            let forecast_s = self.of_paths_s(&own, needed);
            let each_s = times.optics_s / value(&chosen.scene, PATHS);
            let most = now + (allowed_s - self.of_paths_s(&own, now)) / each_s;
            noises.push(Noise {
                figure: Figure::Efficiency,
                key: PATHS,
                now: 2.0 * scatter / now.sqrt(),
                needed,
                forecast_s,
                of_budget: keys + 2.0 * scatter / most.max(1.0).sqrt(),
                is_reached: forecast_s <= allowed_s,
            });
        }
        let of_paths = self.scatter.map_or(0.0, |scatter| 2.0 * scatter / self.paths(&own).unwrap_or(1.0).sqrt());
        for (figure, pilot) in self.of_map().filter_map(|figure| Some((figure, pilot?))) {
            let keys = bound(&self.ladders, figure) + of_paths * self.response(figure);
            let one = 2.0 * pilot.noise(figure) * (pilot.realisations() as f64).sqrt();
            let needed = (one / (within - keys).max(0.0)).powi(2).ceil().max(LEAST);
            let forecast_s = fixed_s + each_s * needed;
            let most = ((allowed_s - fixed_s) / each_s).floor().max(LEAST);
            noises.push(Noise {
                figure,
                key: REALISATIONS,
                now: one / (own.scene.scene.scan.realisations as f64).sqrt(),
                needed,
                forecast_s,
                of_budget: keys + one / most.sqrt(),
                is_reached: forecast_s <= allowed_s,
            });
        }
        let reached = noises.iter().filter(|noise| noise.key == REALISATIONS && noise.is_reached);
        let realisations = reached.map(|noise| noise.needed).reduce(f64::max).unwrap_or(now);
        let mut values = self.values(&own);
        values.push((REALISATIONS, realisations));
        Ok(Accuracy {
            of_scene: file.hash.clone(),
            within,
            own_s: self.own_s,
            own_realisations: own.scene.scene.scan.realisations,
            spent_s: self.spent_s,
            took_s: self.begun.elapsed().as_secs_f64(),
            allowed_s,
            pilot: pilot.map_or(0, Shown::realisations),
            figures: self.figures,
            scene: with(file, &values)?,
            run_s: fixed_s + each_s * realisations,
            values,
            ladders: self.ladders,
            response: self.response,
            noises,
            verified,
            notes: self.notes,
            is_short: self.is_short,
        })
    }
}
