//! Values of a key from fine to coarse, what each shifts, and the choice among them.
//!
//! Errors of keys add with their sign; the sum of their sizes, each with two standard errors, bounds them. Check: choices by hand.

use super::figures::{Figure, Shift};
use crate::Error;

/// What is said of a value of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The finest value that is looked at.
    Finest,
    /// Every figure stays inside half the target, two standard errors included.
    Kept,
    /// A figure is outside, two standard errors taken off.
    TooFar,
    /// Neither is sure.
    NotDecided,
    /// Part of the gates have no estimate any more.
    Lost(f64),
    /// The program refuses the scene.
    Refused(String),
}

impl Verdict {
    /// Of the shifts of all figures, for each at most `limit`.
    pub(super) fn of(shifts: &[(Figure, Shift)], limit: f64) -> Self {
        if shifts.iter().all(|(_, own)| own.bound() <= limit) {
            return Self::Kept;
        }
        let is_far = |own: &Shift| own.shift.abs() - 2.0 * own.error > limit;
        if shifts.iter().any(|(_, own)| is_far(own)) {
            Self::TooFar
        } else {
            Self::NotDecided
        }
    }

    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::Finest => "finest".into(),
            Self::Kept => "kept".into(),
            Self::TooFar => "too far".into(),
            Self::NotDecided => "not decided".into(),
            Self::Lost(part) => format!("loses {:.1} % of the gates", 100.0 * part),
            // What would do for this key, without the place of a value that the user did not write.
            Self::Refused(why) => {
                let allowed = why
                    .lines()
                    .next()
                    .unwrap_or_default()
                    .split("is not allowed: ")
                    .last()
                    .unwrap_or_default();
                format!(
                    "refused: {}",
                    allowed.split("; together").next().unwrap_or_default()
                )
            }
        }
    }
}

/// A value of a key.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The value; of a mesh the number of its cells.
    pub value: f64,
    /// Cells of a mesh along x, y, z.
    pub cells: Option<[usize; 3]>,
    /// Forecast of a run with it and the finest values of the others, s of one core.
    pub forecast_s: f64,
    /// What it shifts.
    pub shifts: Vec<(Figure, Shift)>,
    /// What is said of it.
    pub verdict: Verdict,
}

impl Step {
    /// A value with its forecast, or why it is refused.
    pub(super) fn new(value: f64, forecast_s: Result<f64, Error>) -> Self {
        let refused = |error: Error| (f64::NAN, Verdict::Refused(error.to_string()));
        let (forecast_s, verdict) =
            forecast_s.map_or_else(refused, |forecast_s| (forecast_s, Verdict::Finest));
        Self {
            value,
            cells: None,
            forecast_s,
            shifts: Vec::new(),
            verdict,
        }
    }

    /// What it shifts a figure, where that is known.
    #[must_use]
    pub fn shift(&self, figure: Figure) -> Option<Shift> {
        self.shifts
            .iter()
            .find(|(of, _)| *of == figure)
            .map(|(_, own)| *own)
    }

    /// What it shifts a figure at most; nothing where that is not known.
    pub(super) fn bound(&self, figure: Figure) -> f64 {
        self.shift(figure).map_or(0.0, Shift::bound)
    }
}

/// A key with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Ladder {
    /// The key.
    pub key: &'static str,
    /// Its value in the scene.
    pub now: f64,
    /// Values from the finest on.
    pub steps: Vec<Step>,
    /// Place of the chosen one.
    pub chosen: usize,
    /// Why it was not varied.
    pub note: Option<String>,
    /// Order of the error of each figure of a flow; none where it does not converge at these values.
    pub orders: Vec<(Figure, Option<f64>)>,
}

impl Ladder {
    /// Values of a key from the finest on, which is chosen.
    pub(super) fn new(key: &'static str, now: f64, steps: Vec<Step>) -> Self {
        Self {
            key,
            now,
            steps,
            chosen: 0,
            note: None,
            orders: Vec::new(),
        }
    }

    /// The value that is chosen.
    #[must_use]
    pub fn value(&self) -> f64 {
        self.steps
            .get(self.chosen)
            .map_or(self.now, |step| step.value)
    }

    /// The first value that is not known to be good or bad.
    pub(super) fn is_open(&self) -> bool {
        let first = self
            .steps
            .iter()
            .find(|step| !matches!(step.verdict, Verdict::Finest | Verdict::Kept));
        first.is_some_and(|step| step.verdict == Verdict::NotDecided)
    }
}

/// The values that are chosen.
pub(super) fn chosen(ladders: &[Ladder]) -> impl Iterator<Item = &Step> {
    ladders
        .iter()
        .filter_map(|ladder| ladder.steps.get(ladder.chosen))
}

/// Bound on a figure by the values that are chosen.
pub(super) fn bound(ladders: &[Ladder], figure: Figure) -> f64 {
    chosen(ladders).map(|step| step.bound(figure)).sum()
}

/// Moves keys to coarser values, the one that saves most time for the share of the limit that it takes first, while the sum of the bounds
/// stays within the limit. Returns the moves: which key, from which place.
pub(super) fn choose(
    ladders: &mut [Ladder],
    figures: &[Figure],
    limit: f64,
) -> Vec<(usize, usize)> {
    let mut moves = Vec::new();
    loop {
        let mut best: Option<(f64, usize, usize)> = None;
        for (which, ladder) in ladders.iter().enumerate() {
            let Some(here) = ladder.steps.get(ladder.chosen) else {
                continue;
            };
            let coarser = ladder.steps.iter().enumerate().skip(ladder.chosen + 1);
            for (place, step) in coarser.take_while(|(_, step)| step.verdict == Verdict::Kept) {
                let more = |figure: &Figure| step.bound(*figure) - here.bound(*figure);
                let fits = figures
                    .iter()
                    .all(|figure| bound(ladders, *figure) + more(figure) <= limit);
                let (saved_s, share) = (
                    here.forecast_s - step.forecast_s,
                    figures.iter().map(more).fold(0.0, f64::max) / limit,
                );
                let gain = saved_s / share.max(1e-6);
                if fits && saved_s > 0.0 && best.is_none_or(|(most, ..)| gain > most) {
                    best = Some((gain, which, place));
                }
            }
        }
        let Some((_, which, place)) = best else {
            return moves;
        };
        moves.push((which, ladders[which].chosen));
        ladders[which].chosen = place;
    }
}

#[cfg(test)]
mod tests {
    use super::super::keys::{LAYERS, WINDOW_STEP};
    use super::*;

    fn ladder(key: &'static str, steps: &[(f64, f64, f64, f64)]) -> Ladder {
        let step = |(i, &(value, forecast_s, shift, error)): (usize, &(f64, f64, f64, f64))| {
            let shifts = vec![(Figure::Rms, Shift { shift, error })];
            let verdict = if i == 0 {
                Verdict::Finest
            } else {
                Verdict::of(&shifts, 0.015)
            };
            Step {
                value,
                cells: None,
                forecast_s,
                shifts,
                verdict,
            }
        };
        let steps = steps.iter().enumerate().map(step).collect();
        Ladder {
            key,
            now: 1.0,
            steps,
            chosen: 0,
            note: None,
            orders: Vec::new(),
        }
    }

    #[test]
    fn verdicts_are_those_of_the_bounds() {
        let of = |shift, error| Verdict::of(&[(Figure::Std, Shift { shift, error })], 0.015);
        assert_eq!(of(-0.01, 0.0025), Verdict::Kept);
        assert_eq!(of(-0.02, 0.002), Verdict::TooFar);
        assert_eq!(of(-0.02, 0.003), Verdict::NotDecided);
        assert_eq!(of(f64::NAN, 0.0), Verdict::NotDecided);
    }

    #[test]
    fn the_cheapest_for_its_share_goes_first_and_the_sum_stays_inside_the_limit() {
        let step = ladder(
            WINDOW_STEP,
            &[
                (1.0, 10.0, 0.0, 0.0),
                (2.0, 9.0, 0.004, 0.001),
                (4.0, 8.5, 0.01, 0.001),
            ],
        );
        let layers = ladder(
            LAYERS,
            &[
                (8.0, 10.0, 0.0, 0.0),
                (4.0, 6.0, 0.005, 0.0),
                (2.0, 4.0, 0.012, 0.0),
            ],
        );
        let mut all = [step, layers];
        let moves = choose(&mut all, &[Figure::Rms], 0.015);
        // 4 layers save 4 s for 0.005, and 2 another 2 s for 0.007; then a step of 2, which takes 0.006, no longer fits.
        assert_eq!(
            (all[0].value(), all[1].value(), moves),
            (1.0, 2.0, vec![(1, 0), (1, 1)])
        );
        assert!((bound(&all, Figure::Rms) - 0.012).abs() < 1e-12);
    }

    #[test]
    fn what_loses_gates_or_is_not_decided_is_never_passed() {
        let mut own = ladder(
            WINDOW_STEP,
            &[
                (1.0, 9.0, 0.0, 0.0),
                (2.0, 8.0, 0.02, 0.003),
                (4.0, 7.0, 0.0, 0.0),
            ],
        );
        assert!(own.is_open());
        assert!(choose(std::slice::from_mut(&mut own), &[Figure::Rms], 0.015).is_empty());
        own.steps[1].verdict = Verdict::Lost(0.13);
        assert!(
            choose(std::slice::from_mut(&mut own), &[Figure::Rms], 0.015).is_empty()
                && !own.is_open()
        );
    }
}
