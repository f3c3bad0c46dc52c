//! What is measured on the maps: the keys of the estimator by the same signals, and the response to the efficiency.
//!
//! Check: with the search.

use super::figures::{Figure, Shown};
use super::keys::{PADDED, WINDOW_STEP, value, with};
use super::ladder::{Ladder, Verdict};
use super::search::{LEAST, Search};
use crate::Error;
use crate::scene::{Method, SceneFile};
use crate::setup::efficiency_model::signals_cross_screens;

/// Points of the finest spectrum for each sample of a window.
const FINE_PADDING: usize = 32;
/// Part of the budget that is kept for the verification, which takes less than the pilot, and for phase screens.
const KEPT: f64 = 0.5;
/// Part by which the energy is raised to see what the efficiency does to a map.
const RAISED: f64 = 0.03;

impl Search<'_> {
    /// The finest setting, and beside it each other value of the keys of the estimator; nothing where no map is judged or the budget does
    /// not hold it.
    pub(super) fn pilot(&mut self) -> Result<Option<Shown>, Error> {
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
            let longest = self.out.ladders.iter().map(|ladder| ladder.steps.len()).max().unwrap_or(1);
            self.out.ladders.iter_mut().for_each(|ladder| ladder.steps.truncate(longest - 1));
            places = self.undecided();
            scenes = self.beside_the_finest(&places)?;
            found = self.measure(&scenes, 0, LEAST, if places.is_empty() { 0.0 } else { kept_s })?;
        }
        if places.len() < all {
            let needed = (needed_s / self.out.own_s).ceil();
            let seen = if places.is_empty() { "are not varied" } else { "are varied but for the coarsest values" };
            self.out.notes.push(format!("keys of the estimator {seen}: --budget {needed} would do for all"));
        }
        let Some(mut shown) = found else {
            self.out.notes.push(format!("the map is not measured: its pilot takes {LEAST} realisations"));
            return Ok(None);
        };
        self.refuse_lacking(&shown[0])?;
        self.judge(&shown, &places);
        while self.out.ladders.iter().any(Ladder::is_open) {
            let (count, more) = (shown[0].realisations(), shown[0].realisations() / 2);
            let Some(more) = self.measure(&scenes, count, more, kept_s)? else { break };
            shown.iter_mut().zip(more).for_each(|(shown, more)| shown.extend(more));
            self.judge(&shown, &places);
        }
        self.out.pilot = shown[0].realisations();
        Ok(Some(shown.swap_remove(0)))
    }

    /// Places of keys and values that are to be measured.
    fn undecided(&self) -> Vec<(usize, usize)> {
        let steps = |which: usize| self.out.ladders[which].steps.iter().enumerate();
        let of_key = |which| steps(which).filter(|(_, step)| step.verdict == Verdict::NotDecided);
        (0..self.out.ladders.len()).flat_map(|which| of_key(which).map(move |(place, _)| (which, place))).collect()
    }

    /// The finest setting, and after it the same with each of the values at those places.
    fn beside_the_finest(&self, places: &[(usize, usize)]) -> Result<Vec<SceneFile>, Error> {
        let varied = places.iter().map(|&(which, place)| {
            let ladder = &self.out.ladders[which];
            with(&self.fine, &[(ladder.key, ladder.steps[place].value)])
        });
        std::iter::once(Ok(self.fine.clone())).chain(varied).collect()
    }

    /// The keys of the estimator, from the finest values on.
    fn estimator_keys(&mut self) -> Result<(), Error> {
        let scene = self.fine.scene.clone();
        let window = scene.estimator.window_samples;
        let most = (FINE_PADDING * window).next_power_of_two().min(1 << 20).max(scene.estimator.padded_samples) as f64;
        let has_spectrum = !matches!(scene.estimator.method, Method::PulsePair {} | Method::AutoregressivePole(_));
        self.fine = with(&self.fine, &[(WINDOW_STEP, 1.0)])?;
        if has_spectrum {
            self.fine = with(&self.fine, &[(PADDED, most)])?;
        }
        let window = window as f64;
        let steps = (0..).map(|i| 2f64.powi(i)).take_while(|step| *step <= window);
        self.vary(WINDOW_STEP, value(&scene, WINDOW_STEP), steps, |_, _| Vec::new());
        if has_spectrum {
            let points = (0..).map(|i| most / 2f64.powi(i)).take_while(|points| *points >= window);
            self.vary(PADDED, value(&scene, PADDED), points, |_, _| Vec::new());
        }
        Ok(())
    }

    /// The circulation where no map has one: an error if it was asked for.
    fn refuse_lacking(&mut self, shown: &Shown) -> Result<(), Error> {
        let lacking = |figure: &Figure| *figure == Figure::Circulation && !shown.noise(*figure).is_finite();
        if self.request.of.iter().any(lacking) {
            let reason =
                "circulation is fitted to scans across a pair alone, with noise, real signals and a Gaussian pulse";
            return Err(Error::Input { path: "--of".into(), reason: reason.into() });
        }
        self.out.figures.retain(|figure| !lacking(figure));
        Ok(())
    }

    /// Shifts and verdicts of all values that were measured.
    fn judge(&mut self, shown: &[Shown], places: &[(usize, usize)]) {
        let (figures, limit) = (self.of_map(), self.limit());
        for (&(which, place), own) in places.iter().zip(&shown[1..]) {
            let shifts: Vec<_> = figures.iter().map(|figure| (*figure, own.shift(&shown[0], *figure))).collect();
            let lost = own.lost(&shown[0]);
            let step = &mut self.out.ladders[which].steps[place];
            step.verdict = if lost > 0.0 { Verdict::Lost(lost) } else { Verdict::of(&shifts, limit) };
            step.shifts = shifts;
        }
    }

    /// What a change of the efficiency does to the map, where screens change that of the signals.
    pub(super) fn respond(&mut self, pilot: &Option<Shown>) -> Result<(), Error> {
        if pilot.is_none() || !signals_cross_screens(&self.fine.scene) {
            return Ok(());
        }
        let mut scene = self.fine.scene.clone();
        match &mut scene.laser.amplifier {
            Some(amplifier) => {
                amplifier.mean_power_w *= 1.0 + RAISED;
                amplifier.largest_energy_j *= 1.0 + RAISED;
            }
            None => scene.pulse.energy_j *= 1.0 + RAISED,
        }
        let found = self.measure(&[self.fine.clone(), self.fine.with(scene)?], 0, LEAST, 0.0)?;
        if found.is_none() {
            self.out.notes.push("response of the map to the efficiency: not measured, taken to be 1".into());
        }
        let response = |figure| match &found {
            Some(found) => (figure, found[1].shift(&found[0], figure).bound() / RAISED),
            None => (figure, 1.0),
        };
        self.out.response = self.of_map().into_iter().map(response).collect();
        Ok(())
    }
}
