//! What is measured and written of a wake, by its age.

use crate::keys::{ABOVE_ZERO, Checker, FINITE, keys};

keys! {
    /// Measurements and output files of a wake, by its age `tau`.
    table WakeOutput {
        /// Age at which the run ends.
        end_tau: f64 = 5.0 => ABOVE_ZERO,
        /// Time between rows of `wake.csv`, and between the records of `wake.nc`.
        every_tau: f64 = 0.05 => ABOVE_ZERO,
        /// Ages of whole fields; 0.5, the whole numbers and the end if absent.
        fields_tau: Option<Vec<f64>> = None,
        /// Ages of cross-planes; half the end and the end if absent.
        planes_tau: Option<Vec<f64>> = None,
        /// First and last age of a series of cross-planes, for scans of a moving flow.
        series_tau: Option<[f64; 2]> = None,
        /// Time between the planes of the series.
        series_every_tau: f64 = 0.02 => ABOVE_ZERO,
        /// Positions of the planes along the flight, in `b0`.
        planes_x: Vec<f64> = vec![0.5] => FINITE,
    }
}

/// Most whole ages at which fields are written where a case states none.
const WHOLE_AGES: usize = 100;

impl WakeOutput {
    /// Writes the lists out that follow from the end where the case does not have them.
    pub(in super::super) fn complete(&mut self) {
        let end = self.end_tau;
        if !end.is_finite() || end <= 0.0 {
            return;
        }
        self.fields_tau.get_or_insert_with(|| {
            let whole = (1..=WHOLE_AGES).map(|tau| tau as f64);
            let ages = std::iter::once(0.5)
                .chain(whole)
                .take_while(|tau| *tau < end);
            ages.chain(std::iter::once(end)).collect()
        });
        self.planes_tau.get_or_insert_with(|| vec![0.5 * end, end]);
    }

    /// Ends at another age: lists of fields and planes that the case has not of its own follow the new one, others lose what lies
    /// behind it.
    pub(in super::super) fn end_at(&mut self, end_tau: f64, is_own: [bool; 2]) {
        for (list, is_own) in [&mut self.fields_tau, &mut self.planes_tau]
            .into_iter()
            .zip(is_own)
        {
            *list = list.take().filter(|_| is_own);
            list.iter_mut()
                .for_each(|list| list.retain(|tau| *tau <= end_tau));
        }
        self.series_tau = self
            .series_tau
            .map(|[from, to]| [from, to.min(end_tau)])
            .filter(|[from, to]| to > from);
        self.end_tau = end_tau;
        self.complete();
    }

    /// What is missing at the end, in a sentence.
    pub(in super::super) fn idle(&self) -> Option<String> {
        let end = self.end_tau;
        let every = self.every_tau;
        let rows = end / every;
        ((rows - rows.round()).abs() > 1e-6).then(|| {
            format!(
                "wake.every_tau = {every:?} does not divide the end, {end:?}: there is no row of it"
            )
        })
    }

    pub(in super::super) fn check(&self, p: &mut Checker<'_>) {
        for (key, list) in [
            ("wake.fields_tau", &self.fields_tau),
            ("wake.planes_tau", &self.planes_tau),
        ] {
            let list = list.as_deref().unwrap_or_default();
            p.require(
                self.are_ages(list),
                key,
                list,
                "increasing, from 0 to wake.end_tau",
            );
        }
        if let Some(range) = self.series_tau {
            p.require(
                self.are_ages(&range),
                "wake.series_tau",
                range,
                "two ages that increase, from 0 to wake.end_tau",
            );
        }
    }

    /// Whether ages increase from 0 to the end.
    fn are_ages(&self, list: &[f64]) -> bool {
        let increase = list.windows(2).all(|w| w[1] > w[0]);
        increase && list.iter().all(|tau| (0.0..=self.end_tau).contains(tau))
    }
}
