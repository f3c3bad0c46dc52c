//! How accurate the case of a flow is: the same flow on three meshes, and with steps half and twice as long.
//!
//! An error is that of a figure over the run: root mean square over the output times, relative. Runs are compared in memory; what is run
//! and chosen depends on forecasts alone.
//!
//! With an error `C(t) h^p` the differences of neighbours have one shape in time, and `(h_3^p - h_2^p)/(h_2^p - h_1^p)` is the ratio of
//! their norms (Richardson).
//!
//! Check: vortices whose decay is a closed form; a triple that does not converge; budgets; series of known order; series that come to no
//! limit.

use super::figures::{Figure, Shift};
use super::keys::CELLS;
use super::ladder::{Ladder, Step, Verdict};
use super::{Accuracy, Request, Subject};
use crate::Error;
use crate::flow::CaseFile;
use crate::flow::forecast::count;
use crate::flow::trial::{History, of_history};
use crate::io::Provenance;
use crate::plan::units::seconds;
use crate::setup::progress::{Observer, Stage};
use std::time::Instant;

/// Lengths of the cells over those of the case.
const MESHES: [f64; 3] = [1.0, 1.5, 2.0];
/// Lengths of the steps over those of the case, and which are its own.
const STEPS: [f64; 3] = [0.5, 1.0, 2.0];
const OWN_STEP: usize = 1;
/// The figures, as a history has them.
const FIGURES: [Figure; 4] = [
    Figure::Energy,
    Figure::Dissipation,
    Figure::Circulation,
    Figure::Height,
];

impl Subject for CaseFile {
    const NAME: &'static str = "case";
    const IS_NOISY: bool = false;

    fn provenance(&self) -> Provenance {
        Self::provenance(self)
    }
}

/// A run beside others.
struct Trial {
    file: CaseFile,
    /// Length of its cells or steps over that of the case.
    spacing: f64,
    /// What stands in tables for it.
    step: Step,
    /// What it came to, if it was run.
    history: Option<History>,
}

impl Trial {
    fn run(&mut self, observer: &dyn Observer) -> Result<(), Error> {
        match of_history(&self.file, observer) {
            // What one mesh or step does not stand says nothing against the others.
            Err(error) if self.spacing != 1.0 => {
                self.step = Step {
                    cells: self.step.cells,
                    ..Step::new(self.step.value, Err(error))
                };
            }
            found => self.history = Some(found?),
        }
        observer.advance(1);
        Ok(())
    }

    fn has(&self, figure: Figure) -> bool {
        let is_told = |value: &f64| value.is_finite() && *value != 0.0;
        self.history
            .as_ref()
            .is_some_and(|found| found[place(figure)].iter().any(is_told))
    }
}

impl Accuracy<CaseFile> {
    /// The accuracy of the case of a flow.
    ///
    /// # Errors
    /// What the case refuses, half of its cells too few; figures that it does not have; a budget below that of three meshes.
    pub fn of_case(
        file: &CaseFile,
        request: &Request,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let begun = Instant::now();
        let own = file.portable()?;
        let mut meshes = meshes(&own)?;
        observer.forecast(&own.forecast()?.to_string());
        let own_s = meshes[0].step.forecast_s;
        let spent_s = meshes.iter().map(|mesh| mesh.step.forecast_s).sum::<f64>();
        if spent_s > request.budget * own_s {
            let least = (10.0 * spent_s / own_s).ceil() / 10.0;
            let allowed =
                format!("at least {least:?} runs of this case: three meshes take so many");
            return Err(own
                .refuse_word("--budget", &format!("{:?}", request.budget), allowed)
                .into());
        }
        let figures = figures(&own, request)?;
        observer.begin(Stage::Cases, 5);
        meshes.iter_mut().try_for_each(|mesh| mesh.run(observer))?;
        let (figures, missing): (Vec<_>, Vec<_>) = figures
            .into_iter()
            .partition(|figure| meshes[0].has(*figure));
        if let Some(figure) = missing
            .first()
            .filter(|_| figures.is_empty() || !request.of.is_empty())
        {
            let allowed = "a figure that the run has: air at rest has none, and a wake without vortices no circulation and no height";
            return Err(own
                .refuse_word("--of", figure.name(), allowed.into())
                .into());
        }
        let mut out = Self::begun((own, &file.hash), request, [own_s, spent_s], figures);
        out.compare(CELLS, meshes[0].step.value, own_s, &meshes);
        out.vary_steps(&meshes, observer)?;
        observer.end();
        out.choose(&meshes)?;
        out.took_s = begun.elapsed().as_secs_f64();
        Ok(out)
    }

    /// Adds the ladder of a key whose runs are these, from the finest on.
    fn compare(&mut self, key: &'static str, now: f64, own_s: f64, trials: &[Trial]) {
        let run: Vec<(f64, &History)> = trials
            .iter()
            .filter_map(|trial| Some((trial.spacing, trial.history.as_ref()?)))
            .collect();
        let spacings: Vec<f64> = run.iter().map(|(spacing, _)| *spacing).collect();
        let of = |figure: &Figure| {
            let series: Vec<&[f64]> = run
                .iter()
                .map(|(_, history)| history[place(*figure)].as_slice())
                .collect();
            (*figure, errors(&spacings, &series))
        };
        let found: Vec<_> = self.figures.iter().map(of).collect();
        let mut steps: Vec<Step> = trials.iter().map(|trial| trial.step.clone()).collect();
        let were_run = steps
            .iter_mut()
            .zip(trials)
            .filter(|(_, trial)| trial.history.is_some());
        for (i, (step, _)) in were_run.enumerate() {
            let shift = |shift: f64| Shift { shift, error: 0.0 };
            step.shifts = found
                .iter()
                .map(|(figure, (_, errors))| (*figure, shift(errors[i])))
                .collect();
            step.verdict = Verdict::of(&step.shifts, self.within);
            step.forecast_s *= self.own_s / own_s;
        }
        let orders = found
            .iter()
            .map(|(figure, (order, _))| (*figure, *order))
            .collect();
        let chosen = trials
            .iter()
            .position(|trial| trial.spacing == 1.0)
            .unwrap_or(0);
        self.ladders.push(Ladder {
            chosen,
            orders,
            ..Ladder::new(key, now, steps)
        });
    }

    /// Runs the finest mesh that the budget has room for with other steps, too.
    fn vary_steps(&mut self, meshes: &[Trial], observer: &dyn Observer) -> Result<(), Error> {
        for (place, mesh) in meshes
            .iter()
            .enumerate()
            .filter(|(_, mesh)| mesh.history.is_some())
        {
            let (mut trials, mut of_key) = (Vec::new(), ("time.courant", f64::NAN));
            for spacing in STEPS {
                let (file, key, value) = mesh.file.with_longer_steps(spacing)?;
                let step = Step::new(value, file.forecast().map(|forecast| forecast.core_s));
                of_key = if spacing == 1.0 { (key, value) } else { of_key };
                let history = mesh
                    .history
                    .clone()
                    .filter(|_| spacing == 1.0 && step.forecast_s.is_finite());
                trials.push(Trial {
                    file,
                    spacing,
                    step,
                    history,
                });
            }
            let more = |trial: &&mut Trial| trial.spacing != 1.0 && trial.step.forecast_s > 0.0;
            let more_s: f64 = trials
                .iter_mut()
                .filter(more)
                .map(|trial| trial.step.forecast_s)
                .sum();
            if self.spent_s + more_s > self.allowed_s {
                continue;
            }
            self.spent_s += more_s;
            trials
                .iter_mut()
                .filter(more)
                .try_for_each(|trial| trial.run(observer))?;
            self.compare(of_key.0, of_key.1, mesh.step.forecast_s, &trials);
            if place > 0 {
                let [nx, ny, nz] = mesh.step.cells.unwrap_or_default();
                let note = format!(
                    "{}: looked at on {nx} x {ny} x {nz} cells, more is beyond the budget",
                    of_key.0
                );
                self.notes.push(note);
            }
            return Ok(());
        }
        self.notes
            .push("steps: not varied, the budget has no room for it".into());
        Ok(())
    }

    /// Takes the cells and steps of least time whose errors together are within the target.
    fn choose(&mut self, meshes: &[Trial]) -> Result<(), Error> {
        let steps = self.ladders.get(1).map_or(1, |ladder| ladder.steps.len());
        let error = |(mesh, step): (usize, usize), figure: Figure| {
            let of = |ladder: &Ladder, place: usize| {
                ladder
                    .steps
                    .get(place)
                    .map_or(f64::NAN, |own| own.bound(figure))
            };
            of(&self.ladders[0], mesh) + self.ladders.get(1).map_or(0.0, |ladder| of(ladder, step))
        };
        let own = (0, OWN_STEP.min(steps - 1));
        let all = (0..meshes.len()).flat_map(|mesh| (0..steps).map(move |step| (mesh, step)));
        let is_within = |at: &(usize, usize)| {
            self.figures
                .iter()
                .all(|figure| error(*at, *figure) <= self.within)
        };
        let mut good = Vec::new();
        for (mesh, step) in all.filter(is_within) {
            let of_key = self.ladders.get(1).filter(|_| step != own.1);
            if of_key.is_some_and(|ladder| ladder.steps[step].shifts.is_empty())
                || meshes[mesh].history.is_none()
            {
                continue;
            }
            let file = match of_key {
                Some(_) => meshes[mesh].file.with_longer_steps(STEPS[step])?.0,
                None => meshes[mesh].file.clone(),
            };
            // Steps that are good on one mesh may be refused on another.
            good.extend(
                file.forecast()
                    .ok()
                    .map(|forecast| (forecast.core_s, (mesh, step), file)),
            );
        }
        good.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.verified.is_confirmed = !good.is_empty();
        let Some((run_s, (mesh, step), file)) = good.into_iter().next() else {
            let note = self.needed(|figure| error(own, figure));
            self.notes.push(note);
            return Ok(());
        };
        if mesh > 0 && step != own.1 {
            self.notes
                .push("cells and steps were not tried together: their errors are added".into());
        }
        (self.run_s, self.scene, self.ladders[0].chosen) = (run_s, file, mesh);
        if let Some(ladder) = self.ladders.get_mut(1) {
            ladder.chosen = step;
        }
        Ok(())
    }

    /// How many cells the orders found ask for, where a figure is off by more than the target, and what a run with them takes.
    fn needed(&self, off: impl Fn(Figure) -> f64) -> String {
        let (meshes, mut ratio) = (&self.ladders[0], 1.0_f64);
        let is_beyond = |figure: &&Figure| off(**figure).is_nan() || off(**figure) > self.within;
        for figure in self.figures.iter().filter(is_beyond) {
            let of_mesh = meshes.steps[0].bound(*figure);
            let rest = self.within - (off(*figure) - of_mesh);
            let order = meshes
                .orders
                .iter()
                .find_map(|(of, order)| order.filter(|_| of == figure));
            let Some(order) = order else {
                let name = figure.name();
                return format!(
                    "{CELLS}: {name} does not converge at these cells, which tells no number that would do: try more"
                );
            };
            if rest <= 0.0 {
                return format!(
                    "{}: the steps alone take it beyond the target; look at shorter ones",
                    figure.name()
                );
            }
            ratio = ratio.max((of_mesh / rest).powf(1.0 / order));
        }
        let finer = self.scene.coarser(1.0 / ratio).content.case.cells();
        let more = count(finer) / meshes.now;
        let directions = finer.iter().filter(|n| **n > 1).count() as f64;
        let [nx, ny, nz] = finer;
        let run = seconds(self.own_s * more.powf(1.0 + 1.0 / directions));
        format!(
            "{CELLS}: by the orders found {nx} x {ny} x {nz} reach it; such a run takes about {run} (forecast)"
        )
    }
}

/// Where a history has a figure.
fn place(figure: Figure) -> usize {
    FIGURES.iter().position(|own| *own == figure).unwrap_or(0)
}

/// The case with its cells and with fewer.
fn meshes(own: &CaseFile) -> Result<Vec<Trial>, Error> {
    let whole = own.content.case.cells();
    let directions = whole.iter().filter(|n| **n > 1).count().max(1) as f64;
    let mut meshes: Vec<Trial> = Vec::new();
    for ratio in MESHES {
        let file = if ratio == 1.0 {
            own.clone()
        } else {
            own.coarser(ratio)
        };
        let cells = file.content.case.cells();
        let forecast = file.forecast().map_err(|error| match ratio {
            1.0 => error,
            _ => own.refuse_cells(format!(
                "so many that half of them along each direction are enough: {error}"
            )),
        })?;
        let (value, spacing) = (
            count(cells),
            (count(whole) / count(cells)).powf(1.0 / directions),
        );
        if meshes.last().is_some_and(|finer| finer.spacing >= spacing) {
            return Err(own.refuse_cells(
                "enough for three meshes, the coarsest of half as many along each direction".into(),
            ));
        }
        let step = Step {
            cells: Some(cells),
            ..Step::new(value, Ok(forecast.core_s))
        };
        meshes.push(Trial {
            file,
            spacing,
            step,
            history: None,
        });
    }
    Ok(meshes)
}

/// The figures that are judged.
fn figures(own: &CaseFile, request: &Request) -> Result<Vec<Figure>, Error> {
    let is_wake = own.content.wake.is_some();
    let has = |figure: &Figure| FIGURES[..if is_wake { 4 } else { 2 }].contains(figure);
    if let Some(figure) = request.of.iter().find(|figure| !has(figure)) {
        let allowed = "energy, dissipation; of case.kind = \"wake\" circulation, height besides";
        return Err(own
            .refuse_word("--of", figure.name(), allowed.into())
            .into());
    }
    let is_asked = |figure: &Figure| request.of.is_empty() || request.of.contains(figure);
    Ok(Figure::ALL
        .into_iter()
        .filter(|figure| has(figure) && is_asked(figure))
        .collect())
}

/// Least and largest order that is believed.
const BELIEVED: [f64; 2] = [1.0, 6.0];
/// Least cosine between the differences of neighbours that counts as one shape.
const ALIKE: f64 = 0.8;
/// Relative difference that is rounding and the residual of the pressure.
const ROUNDING: f64 = 1e-9;

/// The order, infinite where all are the same and none where they do not converge, and the error of each, relative to the root mean
/// square of the first; `series` from the finest spacing on, at the same times. Without an order the finest is off by its difference
/// from the next one, the others by theirs from the finest besides.
fn errors(spacings: &[f64], series: &[&[f64]]) -> (Option<f64>, Vec<f64>) {
    let count = series.iter().map(|own| own.len()).min().unwrap_or(0);
    let times: Vec<usize> = (0..count)
        .filter(|t| series.iter().all(|own| own[*t].is_finite()))
        .collect();
    let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
        times.iter().map(|t| a(*t) * b(*t)).sum::<f64>()
    };
    let apart = |a: usize, b: usize| move |t: usize| series[b][t] - series[a][t];
    let scale = product(&|t| series[0][t], &|t| series[0][t]).sqrt();
    let distance = |a: usize, b: usize| product(&apart(a, b), &apart(a, b)).sqrt() / scale;
    if series.len() < 2 || times.is_empty() {
        return (None, vec![f64::NAN; series.len()]);
    }
    let finest = distance(0, 1);
    let off: Vec<f64> = (0..series.len())
        .map(|i| finest + if i == 0 { 0.0 } else { distance(0, i) })
        .collect();
    let [h1, h2, h3] = *spacings else {
        return (None, off);
    };
    if off.iter().all(|error| *error < ROUNDING) {
        return (Some(f64::INFINITY), off);
    }
    let cosine = product(&apart(0, 1), &apart(1, 2)) / (finest * distance(1, 2) * scale * scale);
    let ratio = |p: f64| (h3.powf(p) - h2.powf(p)) / (h2.powf(p) - h1.powf(p));
    let (found, [mut low, mut high]) = (distance(1, 2) / finest, BELIEVED);
    // What is no number converges as little.
    if !(cosine >= ALIKE && found >= ratio(low) && found <= ratio(high)) {
        return (None, off);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if ratio(middle) < found {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    let of = |h: f64| finest * h.powf(low) / (h2.powf(low) - h1.powf(low));
    (Some(low), spacings.iter().map(|h| of(*h)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Silent;
    use crate::flow::plane_vortices::PlaneVortices;
    use std::f64::consts::PI;
    use std::path::Path;

    fn case(text: &str) -> CaseFile {
        CaseFile::parse(text, Path::new("c.toml")).unwrap()
    }

    fn of(file: &CaseFile, within: f64, of: &[Figure]) -> Accuracy<CaseFile> {
        Accuracy::of_case(file, &Request::new(within, of), &Silent).unwrap()
    }

    fn vortices(field: &PlaneVortices) -> CaseFile {
        field.case(32, 0.005, "[time]\nend_s = 1.0\nlongest_step_s = 0.005\n")
    }

    #[test]
    fn the_error_of_decaying_vortices_is_that_against_the_closed_form() {
        let field = PlaneVortices::new();
        let found = of(&vortices(&field), 0.01, &[]);
        assert_eq!(found.figures, [Figure::Energy, Figure::Dissipation]);
        let meshes = &found.ladders[0];
        // Convection and gradients are of fourth order.
        for (figure, order) in &meshes.orders {
            assert!(
                order.is_some_and(|order| (order - 4.0).abs() < 0.3),
                "{figure:?} {order:?}"
            );
        }
        // Energy exp(-16 pi^2 nu t)/4, of which 16 pi^2 nu is lost in a time; at its start it is that of the mesh.
        let rate = 16.0 * PI * PI * 0.005;
        for (place, step) in meshes.steps.iter().enumerate() {
            let own = vortices(&field);
            let file = if place == 0 {
                own
            } else {
                own.coarser(MESHES[place])
            };
            let history = of_history(&file, &Silent).unwrap();
            for (figure, scale) in [(Figure::Energy, 0.25), (Figure::Dissipation, 0.25 * rate)] {
                let (mut off, mut all) = (0.0, 0.0);
                for (i, value) in history[self::place(figure)]
                    .iter()
                    .enumerate()
                    .filter(|(_, v)| v.is_finite())
                {
                    let exact = scale * (-rate * (i + 1) as f64 / 16.0).exp();
                    off += (value - exact).powi(2);
                    all += exact.powi(2);
                }
                let (closed, found) = (f64::sqrt(off / all), step.bound(figure));
                assert!(
                    closed > 1e-7 && (found / closed - 1.0).abs() < 0.15,
                    "{place} {figure:?} {found} {closed}"
                );
            }
        }
        // Viscous steps hardly matter, cells neither, at 1 %: the cheapest is taken, and is a case.
        assert!(found.is_reached() && meshes.chosen == 2 && found.spent_s <= 1.2 * found.allowed_s);
        assert!(found.scene.forecast().unwrap().core_s < found.own_s);
        assert_eq!(found.scene.content.case.cells(), [1, 16, 16]);
    }

    #[test]
    fn a_target_out_of_reach_is_answered_with_the_cells_that_the_order_asks_for() {
        let field = PlaneVortices::new();
        let found = of(&vortices(&field), 2e-6, &[Figure::Energy]);
        let (off, order) = (
            found.ladders[0].steps[0].bound(Figure::Energy),
            found.ladders[0].orders[0].1.unwrap(),
        );
        assert!(!found.is_reached() && off > 2e-6, "{off}");
        let words = found
            .notes
            .iter()
            .find(|note| note.contains("by the orders found"))
            .unwrap();
        let cells: f64 = words.split(" x ").nth(1).unwrap().parse().unwrap();
        let expected = 32.0 * (off / 2e-6).powf(1.0 / order);
        assert!(
            cells > 32.0 && (cells / expected - 1.0).abs() < 0.1,
            "{words}: {expected}"
        );
        assert_eq!(
            found.scene.content.case.cells(),
            [1, 32, 32],
            "the cells stay"
        );
    }

    #[test]
    fn cells_that_do_not_converge_say_so_and_are_off_by_the_finest_difference() {
        let found = of(
            &case("[case]\nkind = \"vortex_pair\"\ncells = [8, 32, 20]\nperturbation = 0.1\n"),
            0.5,
            &[],
        );
        let [finest, middle] =
            [0, 1].map(|place| found.ladders[0].steps[place].bound(Figure::Dissipation));
        assert!((middle / finest - 2.0).abs() < 1e-12, "{finest} {middle}");
        let text = found.text();
        assert!(
            text.contains("dissipation not converging at these cells"),
            "{text}"
        );
        assert!(found.table().to_csv(&found.scene.provenance()).is_ok());
    }

    #[test]
    fn budgets_and_figures_that_a_case_has_not_are_refused() {
        let refused = |file: &CaseFile, request: &Request| {
            Accuracy::of_case(file, request, &Silent)
                .unwrap_err()
                .to_string()
        };
        let few = refused(
            &case("[case]\nkind = \"vortex_pair\"\ncells = [1, 6, 6]\n"),
            &Request::new(0.1, &[]),
        );
        assert!(
            few.starts_with("c.toml:3: case.cells = [1, 6, 6] is not allowed: "),
            "{few}"
        );
        let field = PlaneVortices::new();
        let vortices = vortices(&field);
        let none = refused(&vortices, &Request::new(0.1, &[Figure::Height]));
        assert!(
            none.contains("--of = height is not allowed: energy, dissipation"),
            "{none}"
        );
        // Nothing is judged of air at rest, so that nothing would be within the target.
        let at_rest = "[case]\nkind = \"free\"\nviscosity_m2_s = 0.01\n[case.y]\ncells = 16\nlow_m = 0.0\nhigh_m = 8.0\n[case.z]\ncells = 16\n\
            low_m = 0.0\nhigh_m = 8.0\n[case.initial]\nkind = \"uniform\"\nvelocity_m_s = [0.0, 0.0, 0.0]\n[time]\nend_s = 1.0\nstep_s = 0.2\n";
        let none = refused(&case(at_rest), &Request::new(0.1, &[]));
        assert!(
            none.contains("--of = energy is not allowed: a figure that the run has"),
            "{none}"
        );
        let small = refused(
            &vortices,
            &Request {
                budget: 1.0,
                ..Request::new(0.1, &[])
            },
        );
        assert!(
            small.contains("--budget = 1.0 is not allowed: at least 1."),
            "{small}"
        );
        let none = Accuracy::of_case(
            &vortices,
            &Request {
                budget: 1.8,
                ..Request::new(0.1, &[])
            },
            &Silent,
        )
        .unwrap();
        assert!(
            none.spent_s <= none.allowed_s && none.notes.iter().any(|note| note.contains("budget")),
            "{:?}",
            none.notes
        );
    }
}

#[cfg(test)]
mod order_tests {
    use super::*;

    const SPACINGS: [f64; 3] = [1.0, 1.47, 2.06];

    fn found(of: impl Fn(f64, f64) -> f64) -> (Option<f64>, Vec<f64>) {
        let series = SPACINGS.map(|h| (0..9).map(|t| of(f64::from(t), h)).collect::<Vec<f64>>());
        errors(&SPACINGS, &series.each_ref().map(Vec::as_slice))
    }

    #[test]
    fn orders_and_errors_of_power_laws_are_found() {
        for p in [1.2, 2.0, 4.0] {
            let (order, errors) = found(|t, h| (1.0 + 0.01 * t * h.powf(p)) * (-0.1 * t).exp());
            assert!((order.unwrap() / p - 1.0).abs() < 1e-9, "{order:?} {p}");
            let (mut off, mut all) = (0.0, 0.0);
            for t in 0..9 {
                let (t, decay) = (f64::from(t), (-0.2 * f64::from(t)).exp());
                off += (0.01 * t * SPACINGS[1].powf(p)).powi(2) * decay;
                all += (1.0 + 0.01 * t).powi(2) * decay;
            }
            assert!(
                (errors[1] / (off / all).sqrt() - 1.0).abs() < 1e-9,
                "{errors:?}"
            );
        }
    }

    #[test]
    fn what_comes_to_no_limit_has_no_order_and_the_difference_from_the_finest() {
        let constant = |at: [f64; 3]| {
            move |_: f64, h: f64| at[SPACINGS.iter().position(|own| *own == h).unwrap()]
        };
        // Back and forth; hardly less from mesh to mesh; faster than any scheme.
        for at in [[1.0, 1.02, 1.0], [1.0, 1.02, 1.021], [1.0, 1.0001, 1.02]] {
            let (order, errors) = found(constant(at));
            assert!(
                order.is_none() && (errors[0] - (at[1] - 1.0)).abs() < 1e-12,
                "{at:?} {order:?} {errors:?}"
            );
            assert!(
                (errors[2] - (at[1] - 1.0) - (at[2] - 1.0)).abs() < 1e-12,
                "{errors:?}"
            );
        }
        // Of other shapes in time.
        assert_eq!(
            found(|t, h| if h > 2.0 {
                1.0 + 0.01 * t
            } else {
                1.0 + 0.001 * h * (3.0 * t).sin()
            })
            .0,
            None
        );
        assert_eq!(found(|t, _| 1.0 + t).0, Some(f64::INFINITY));
        let (order, errors) = super::errors(&SPACINGS[..1], &[&[1.0]]);
        assert!(order.is_none() && errors[0].is_nan());
    }
}
