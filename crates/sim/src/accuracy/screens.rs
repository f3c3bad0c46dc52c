//! The keys of the phase screens: what they do to the efficiency in the middle of the scan.
//!
//! The shift by layers is known without random numbers, from the exact mean of independent paths (bistatic); it is taken for the
//! common one (monostatic), too. Grids are compared on the same realisations; an error leaves out four at a time, as they come in two
//! antithetic pairs. Check: a collimated beam through two layers.

use super::figures::{Figure, Shift, Values};
use super::keys::{GRID_POINTS, GRID_SPACING, LAYERS, with};
use super::ladder::Verdict;
use super::search::{PLANNING_S, Search};
use crate::Error;
use crate::plan::{Plan, Target};
use crate::scene::{RefractiveTurbulence, ScreenSampling};
use crate::setup::efficiency_model::{drawn_turbulence, model, turbulence};
use crate::setup::table::of_table;
use std::ops::ControlFlow;
use wakescope_optics::Stop;
use wakescope_optics::plan::{LayerGap, Model};

/// Realisations on which grids are compared, the least for a trusted error of a mean.
const COMPARED: usize = 64;
/// Least layers: one screen would be the whole path, for which the exact mean of independent paths says little of the common one.
const LEAST_LAYERS: f64 = 2.0;
/// Realisations of two antithetic pairs, which are left out together.
const TOGETHER: usize = 4;

impl Search<'_> {
    /// The keys of the phase screens, where these make the efficiency.
    pub(super) fn screens(&mut self) -> Result<(), Error> {
        let scene = self.own.scene.content.clone();
        let Some(t) = turbulence(&scene).filter(|_| model(&scene) == Model::MonteCarlo) else {
            return Ok(());
        };
        if drawn_turbulence(&scene).is_some() {
            self.out.notes.push(
                "keys of the turbulence are not varied: pulses have efficiencies of their own"
                    .into(),
            );
            return Ok(());
        }
        let mut compared = t;
        if t.sampling == ScreenSampling::Explicit {
            let mut finest = t.layers as f64;
            while finest < 64.0 * t.layers as f64 && self.affords(0.0, 0.0) {
                let plan = self.plan(&with(&self.fine, &[(LAYERS, finest)])?, Target::Run)?;
                if self.of_layers(&plan)[1] <= 0.5 * self.limit() {
                    break;
                }
                finest *= 2.0;
            }
            let halves = (0..)
                .map(|i| (finest / 2f64.powi(i)).floor())
                .take_while(|layers| *layers >= LEAST_LAYERS);
            self.vary(LAYERS, t.layers as f64, halves, |search, plan| {
                let [middle, worst] = search
                    .of_layers(plan)
                    .map(|shift| Shift { shift, error: 0.0 });
                search.of_efficiency(middle, worst)
            });
            self.out.notes.push(format!(
                "shifts of {LAYERS} are exact for independent paths (bistatic), and taken for the common path (monostatic)"
            ));
            // Grids do the same whatever the layers: the fewest that are good.
            let steps = self
                .out
                .ladders
                .last()
                .map(|ladder| ladder.steps.as_slice())
                .unwrap_or_default();
            let good = steps
                .iter()
                .take_while(|s| matches!(s.verdict, Verdict::Finest | Verdict::Kept));
            compared.layers = good.last().map_or(t.layers, |step| step.value as usize);
            // Points before spacing: a scene is given them in this order, and the second keeps the width.
            let points = (0..5).map(|i| (t.grid_points as f64 / 2f64.powi(i)).floor());
            self.vary(GRID_POINTS, t.grid_points as f64, points, |_, _| Vec::new());
            let spacings = (0..5).map(|i| t.grid_spacing_m * 2f64.powi(i));
            self.vary(GRID_SPACING, t.grid_spacing_m, spacings, |_, _| Vec::new());
        }
        self.compare_grids(&compared)
    }

    /// The same realisations on every grid, with so few layers as do.
    fn compare_grids(&mut self, t: &RefractiveTurbulence) -> Result<(), Error> {
        let seed = self.own.scene.content.seed;
        let Some(fine) = self.efficiency(t, seed, 0.0)? else {
            self.out
                .notes
                .push("grids of the screens are not varied: the budget is spent".into());
            return Ok(());
        };
        self.scatter = Some(fine.relative_error() * (COMPARED as f64).sqrt());
        let mut ladders = std::mem::take(&mut self.out.ladders);
        for ladder in ladders
            .iter_mut()
            .filter(|ladder| matches!(ladder.key, GRID_POINTS | GRID_SPACING))
        {
            let open = ladder
                .steps
                .iter_mut()
                .skip(1)
                .take_while(|step| step.verdict == Verdict::NotDecided);
            for step in open {
                let scene = with(
                    &self.own.scene,
                    &[(LAYERS, t.layers as f64), (ladder.key, step.value)],
                )?;
                // What is refused on so short a path stays not decided.
                let t = turbulence(&scene.content).unwrap_or_default();
                let Ok(Some(found)) = self.efficiency(&t, seed, 0.0) else {
                    break;
                };
                let shift = found.shift(&fine, &fine);
                step.shifts = self.of_efficiency(shift, shift);
                step.verdict = Verdict::of(&step.shifts, self.limit());
                if step.verdict != Verdict::Kept {
                    break;
                }
            }
        }
        self.out.ladders = ladders;
        Ok(())
    }

    /// Range in the middle of the scan, m.
    fn middle_m(&self) -> f64 {
        0.5 * (self.own.scene.content.scan.range_min_m + self.own.scene.content.scan.range_max_m)
    }

    /// What the layers of a plan do to the efficiency in the middle of the scan, and at most over the stretch of range that has it.
    pub(super) fn of_layers(&self, plan: &Plan) -> [f64; 2] {
        let middle_m = self.middle_m();
        let gaps = plan.screens.iter().map(|plan| plan.gaps.as_slice());
        let reaches = |gaps: &&[_]| {
            gaps.last()
                .is_some_and(|gap: &LayerGap| gap.range_m >= middle_m)
        };
        let Some(gaps) = gaps.into_iter().find(reaches) else {
            return [f64::NAN; 2];
        };
        let (range_m, gap): (Vec<f64>, Vec<f64>) =
            gaps.iter().map(|gap| (gap.range_m, gap.relative)).unzip();
        [
            of_table(&range_m, &gap, middle_m),
            gap.iter().fold(0.0, |most, gap| gap.abs().max(most)),
        ]
    }

    /// What a shift of the efficiency in the middle, and one anywhere, do to all figures.
    fn of_efficiency(&self, middle: Shift, anywhere: Shift) -> Vec<(Figure, Shift)> {
        let of_map = |(figure, of): &(Figure, f64)| {
            (
                *figure,
                Shift {
                    shift: of * anywhere.shift,
                    error: of * anywhere.error,
                },
            )
        };
        let own = self
            .out
            .figures
            .contains(&Figure::Efficiency)
            .then_some((Figure::Efficiency, middle));
        own.into_iter()
            .chain(self.out.response.iter().map(of_map))
            .collect()
    }

    /// The efficiency in the middle of the scan, and its mean with each of so many independent parts left out; nothing where it would not
    /// leave what is kept, s.
    pub(super) fn efficiency(
        &mut self,
        t: &RefractiveTurbulence,
        seed: u64,
        kept_s: f64,
    ) -> Result<Option<Values>, Error> {
        let (run, realisation_s) = self
            .own
            .instrument
            .monte_carlo(t, &[self.middle_m()], seed)?;
        self.out.spent_s += PLANNING_S;
        if !self.affords(realisation_s * COMPARED as f64, kept_s) {
            return Ok(None);
        }
        let found = run.run_in::<f32>(Stop::after(COMPARED), |_| ControlFlow::Continue(()))?;
        let each = found
            .monostatic_realisations
            .first()
            .map(Vec::as_slice)
            .unwrap_or_default();
        // As the profile, freed of the error of the grid in free space.
        let scale = found.exact_free_space[0] / found.grid_free_space[0];
        let means = each
            .chunks(TOGETHER)
            .map(|part| scale * part.iter().sum::<f64>() / part.len() as f64);
        Ok(Some(Values::mean(&means.collect::<Vec<_>>())))
    }
}
