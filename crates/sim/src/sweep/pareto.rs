//! Set-ups that no other one beats: the Pareto front of columns of a table, with what is doubtful within the errors.
//!
//! a dominates b if it is nowhere worse and somewhere better. Equal points all stay; what is not finite is never on the front
//! and dominates nothing. Check: the stored fronts, and every pair of 1000 random points.

/// Standard errors of the difference within which a point counts as nearly dominated.
pub const NEAR: f64 = 2.0;

/// A column that is to be small or large.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// What is to be small of each point.
    costs: Vec<f64>,
    /// Standard error of each.
    standard_errors: Vec<f64>,
}

impl Objective {
    /// A column of which small values are better. Standard errors are in the same unit: none where all values are exact, NaN where one
    /// is not known, as of one realisation.
    pub fn small(values: Vec<f64>, standard_errors: Vec<f64>) -> Self {
        Self { costs: values, standard_errors }
    }

    /// A column of which large values are better, with standard errors as of a small one.
    pub fn large(values: Vec<f64>, standard_errors: Vec<f64>) -> Self {
        Self::small(values.into_iter().map(|value| -value).collect(), standard_errors)
    }

    /// By how much point `a` is better than `b`; NaN for what is not there.
    fn gain(&self, a: usize, b: usize) -> f64 {
        let cost = |i: usize| self.costs.get(i).copied().unwrap_or(f64::NAN);
        cost(b) - cost(a)
    }

    /// Standard error of the difference of two points; without end where one is not known.
    fn error(&self, a: usize, b: usize) -> f64 {
        let error = |i: usize| self.standard_errors.get(i).map_or(0.0, |e| if e.is_nan() { f64::INFINITY } else { *e });
        error(a).hypot(error(b))
    }
}

/// What a front says of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Another point dominates it, or a value is not finite.
    Off,
    /// On the front.
    On,
    /// On the front, and with [`NEAR`] standard errors less luck another point would dominate it.
    Doubtful,
}

/// The place of each point.
#[must_use]
pub fn front(objectives: &[Objective]) -> Vec<Place> {
    let points = objectives.iter().map(|o| o.costs.len()).min().unwrap_or(0);
    let is_finite = |i: &usize| objectives.iter().all(|o| o.costs[*i].is_finite());
    let finite: Vec<usize> = (0..points).filter(is_finite).collect();
    let dominates = |a: usize, b: usize, lenience: f64| {
        let luck = |o: &Objective| if lenience > 0.0 { lenience * o.error(a, b) } else { 0.0 };
        let gains = || objectives.iter().map(|o| o.gain(a, b) + luck(o));
        a != b && gains().all(|gain| gain >= 0.0) && gains().any(|gain| gain > 0.0)
    };
    let mut places = vec![Place::Off; points];
    for &point in &finite {
        let beaten = |lenience: f64| finite.iter().any(|other| dominates(*other, point, lenience));
        places[point] = match (beaten(0.0), beaten(NEAR)) {
            (true, _) => Place::Off,
            (false, true) => Place::Doubtful,
            (false, false) => Place::On,
        };
    }
    places
}
