//! The chosen setting as a whole, tried with another seed; the realisations that the noise asks for; what a target out of reach takes.
//!
//! Check: with the search.

use super::figures::{Figure, Shift, Shown};
use super::keys::{PATHS, REALISATIONS, value, with};
use super::ladder::{bound, choose, chosen as chosen_steps};
use super::search::{LEAST as PILOT, Search, run_s};
use super::{Found, Noise};
use crate::Error;
use crate::plan::Target;
use crate::scene::{RefractiveTurbulence, Scene, SceneFile};
use crate::setup::efficiency_model::turbulence;

/// How often the search goes a key back.
const BACK: usize = 2;
/// Part of the budget by which the verification may pass it.
const BEYOND: f64 = 0.15;
/// Realisations of a scan at least, for a standard deviation.
const LEAST: f64 = 2.0;
/// Least realisations of the path that a scene is given.
const LEAST_PATHS: f64 = 50.0;

impl Search<'_> {
    /// Chooses, and tries the choice with another seed beside the finest setting; goes a key back where it does not hold.
    pub(super) fn verify(&mut self, pilot: &Option<Shown>) -> Result<(), Error> {
        if pilot.is_none() && !self.of_map().is_empty() {
            return Ok(());
        }
        let (count, limit) = (
            pilot.as_ref().map_or(PILOT, Shown::realisations),
            self.limit(),
        );
        let mut moves = choose(&mut self.out.ladders, &self.out.figures, limit);
        for _ in 0..=BACK {
            // Keys that are good alone may be refused together.
            while self
                .chosen()
                .and_then(|scene| self.plan(&scene, Target::Run))
                .is_err()
            {
                let Some((which, place)) = moves.pop() else {
                    break;
                };
                self.out.ladders[which].chosen = place;
            }
            self.out.verified.rows.clear();
            if !moves.is_empty() {
                let Some(rows) = self.tried(count)? else {
                    break;
                };
                self.out.verified.rows = rows;
            }
            let mut found = self
                .out
                .verified
                .rows
                .iter()
                .map(|(_, _, found)| found.bound());
            self.out.verified.is_confirmed = found.all(|bound| bound <= self.out.within);
            if self.out.verified.is_confirmed {
                break;
            }
            if let Some((which, place)) = moves.pop() {
                self.out.ladders[which].chosen = place;
            }
        }
        Ok(())
    }

    /// Predicted and found shift of each figure; nothing where the budget is spent.
    fn tried(&mut self, count: usize) -> Result<Option<Vec<Found>>, Error> {
        let (chosen, beyond_s) = (self.chosen()?, -BEYOND * self.out.allowed_s);
        let mut found = Vec::new();
        if self.out.figures.contains(&Figure::Efficiency) {
            let plan = self.plan(&chosen, Target::Run)?;
            let coarse = turbulence(&chosen.content).unwrap_or_default();
            let fine = turbulence(&self.own.scene.content).unwrap_or_default();
            let mut shift = Shift {
                shift: self.of_layers(&plan)[0],
                error: 0.0,
            };
            if (fine.grid_points, fine.grid_spacing_m)
                != (coarse.grid_points, coarse.grid_spacing_m)
            {
                let mut on = |t| self.efficiency(&t, self.out.verified.seed, beyond_s);
                let fine = on(RefractiveTurbulence {
                    layers: coarse.layers,
                    ..fine
                })?;
                let (Some(fine), Some(coarse)) = (fine, on(coarse)?) else {
                    return Ok(None);
                };
                let of_grid = coarse.shift(&fine, &fine);
                shift = Shift {
                    shift: shift.shift + of_grid.shift,
                    ..of_grid
                };
            }
            found.push((Figure::Efficiency, shift));
        }
        let figures = self.of_map();
        if !figures.is_empty() {
            let seed = self.out.verified.seed;
            let seeded = |file: &SceneFile| {
                file.with(Scene {
                    seed,
                    ..file.content.clone()
                })
            };
            let scenes = [seeded(&self.fine)?, seeded(&chosen)?];
            let Some(shown) = self.measure(&scenes, 0, count, beyond_s)? else {
                return Ok(None);
            };
            found.extend(
                figures
                    .into_iter()
                    .map(|figure| (figure, shown[1].shift(&shown[0], figure))),
            );
        }
        let shift =
            |figure| chosen_steps(&self.out.ladders).filter_map(move |step| step.shift(figure));
        let predicted = |figure| shift(figure).map(|own| own.shift).sum();
        Ok(Some(
            found
                .into_iter()
                .map(|(figure, found)| (figure, predicted(figure), found))
                .collect(),
        ))
    }

    /// The scene with the chosen keys.
    fn chosen(&self) -> Result<SceneFile, Error> {
        with(
            &self.fine,
            &self
                .out
                .ladders
                .iter()
                .map(|ladder| (ladder.key, ladder.value()))
                .collect::<Vec<_>>(),
        )
    }

    fn bound(&self, figure: Figure) -> f64 {
        bound(&self.out.ladders, figure)
    }

    fn response(&self, figure: Figure) -> f64 {
        self.out
            .response
            .iter()
            .find(|(of, _)| *of == figure)
            .map_or(0.0, |(_, of)| *of)
    }

    /// What the noise asks for: realisations of the path, and of the scan with the rest of the target.
    pub(super) fn finish(&mut self, pilot: &Option<Shown>) -> Result<(), Error> {
        let (within, allowed_s) = (self.out.within, self.out.allowed_s);
        let mut values: Vec<_> = self
            .out
            .ladders
            .iter()
            .map(|ladder| (ladder.key, ladder.value()))
            .collect();
        let chosen = self.chosen()?;
        let plan = self.plan(&chosen, Target::Run)?;
        let (mut whole_s, times) = (run_s(&plan), plan.times);
        let mut of_paths = 0.0;
        if let Some(scatter) = self.scatter {
            let (one, now) = (2.0 * scatter, value(&chosen.content, PATHS));
            let (each_s, fixed_s) = (times.optics_s / now, whole_s - times.optics_s);
            let of = OfNoise {
                key: PATHS,
                now,
                each_s,
                fixed_s,
                least: LEAST_PATHS,
            };
            let judged = self.out.figures.contains(&Figure::Efficiency);
            let own = judged.then(|| {
                of.noise(
                    Figure::Efficiency,
                    one,
                    self.bound(Figure::Efficiency),
                    within,
                    allowed_s,
                )
            });
            // A quarter of the target of a map is for the efficiency that its signals have.
            let rest = |figure| 0.25 * within / self.response(figure);
            let of_maps = self
                .of_map()
                .into_iter()
                .map(|figure| (one / rest(figure)).powi(2));
            // Whole pairs of antithetic pairs.
            let needed = of_maps
                .chain(own.map(|own| own.needed))
                .fold(LEAST_PATHS, f64::max);
            let needed = (0.25 * needed).ceil() * 4.0;
            let paths = if of.run_s(needed) <= allowed_s {
                needed
            } else {
                now
            };
            whole_s = of.run_s(paths);
            of_paths = one / paths.sqrt();
            values.push((PATHS, paths));
            self.out.noises.extend(own);
        }
        let now = value(&chosen.content, REALISATIONS);
        let scans_s = times.signals_s + times.maps_s + times.retrieval_s;
        let of = OfNoise {
            key: REALISATIONS,
            now,
            each_s: scans_s / now,
            fixed_s: whole_s - scans_s,
            least: LEAST,
        };
        let mut realisations = None;
        for (figure, pilot) in self
            .of_map()
            .into_iter()
            .filter_map(|figure| Some((figure, pilot.as_ref()?)))
        {
            let one = 2.0 * pilot.noise(figure) * (pilot.realisations() as f64).sqrt();
            let noise = of.noise(
                figure,
                one,
                self.bound(figure) + of_paths * self.response(figure),
                within,
                allowed_s,
            );
            realisations = realisations.max(noise.is_reached.then_some(noise.needed as usize));
            self.out.noises.push(noise);
        }
        let realisations = realisations.map_or(now, |count| count as f64);
        values.push((REALISATIONS, realisations));
        self.out.run_s = of.run_s(realisations);
        self.out.scene = with(&self.out.scene, &values)?;
        Ok(())
    }
}

/// A key that averages noise: its value, what one more takes and all else, s, and the least that is sensible.
struct OfNoise {
    key: &'static str,
    now: f64,
    each_s: f64,
    fixed_s: f64,
    least: f64,
}

impl OfNoise {
    fn run_s(&self, count: f64) -> f64 {
        self.fixed_s + self.each_s * count
    }

    /// Of a figure with twice the standard error `one` of one realisation, beside what the keys shift.
    fn noise(&self, figure: Figure, one: f64, keys: f64, within: f64, allowed_s: f64) -> Noise {
        let needed = (one / (within - keys).max(0.0))
            .powi(2)
            .ceil()
            .max(self.least);
        let most = ((allowed_s - self.fixed_s) / self.each_s)
            .floor()
            .max(self.least);
        let forecast_s = self.run_s(needed);
        Noise {
            figure,
            key: self.key,
            now: one / self.now.sqrt(),
            needed,
            forecast_s,
            of_budget: keys + one / most.sqrt(),
            is_reached: forecast_s <= allowed_s,
        }
    }
}
