//! At which output time what is written.
//!
//! Check: lists that share times, the series, the numbers of the files.

use super::output::WakeOutput;

/// Ages closer than this are the same.
const SAME: f64 = 1e-6;

/// An output time and what is due at it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in super::super) struct Due {
    /// The time, s.
    pub(in super::super) time_s: f64,
    /// A record of the wake.
    pub(in super::super) record: bool,
    /// Whole fields, with their number from 0.
    pub(in super::super) fields: Option<usize>,
    /// Planes, with their number from 0.
    pub(in super::super) planes: Option<usize>,
}

/// Age of a wake at a time, without the last digits, in which it may differ from the requested age.
pub(in super::super) fn age_tau(time_s: f64, tau_per_s: f64) -> f64 {
    crate::quantities::rounded(time_s * tau_per_s, 13)
}

/// Ages from one to another, a step apart.
fn ages([from, to]: [f64; 2], step: f64) -> Vec<f64> {
    let count = ((to - from) / step + SAME).floor() as usize;
    (0..=count).map(|i| from + i as f64 * step).collect()
}

/// Fields and planes at all times.
pub(in super::super) fn plain_schedule(times_s: Vec<f64>) -> Vec<Due> {
    let mut schedule = Vec::with_capacity(times_s.len());
    for (index, time_s) in times_s.into_iter().enumerate() {
        schedule.push(Due {
            time_s,
            record: false,
            fields: Some(index),
            planes: Some(index),
        });
    }
    schedule
}

/// The outputs of a wake whose `tau` grows by `tau_per_s` and which ends at `end_s`.
pub(in super::super) fn wake_schedule(output: &WakeOutput, tau_per_s: f64, end_s: f64) -> Vec<Due> {
    let end_tau = end_s * tau_per_s;
    let mut planes = output.planes_tau.clone().unwrap_or_default();
    if let Some(range) = output.series_tau {
        planes.extend(ages(range, output.series_every_tau));
    }
    let lists = [
        ages([0.0, end_tau], output.every_tau),
        output.fields_tau.clone().unwrap_or_default(),
        planes,
    ];
    let mut all: Vec<(f64, usize)> = Vec::new();
    for (kind, list) in lists.iter().enumerate() {
        for tau in list {
            if *tau <= end_tau + SAME {
                all.push((*tau, kind));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut schedule: Vec<Due> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    let mut fields = 0..usize::MAX;
    let mut planes = 0..usize::MAX;
    for (tau, kind) in all {
        if tau - last > SAME {
            last = tau;
            // The last age may be the end but for rounding.
            let is_end = (tau - end_tau).abs() <= SAME;
            schedule.push(Due {
                time_s: if is_end { end_s } else { tau / tau_per_s },
                ..Due::default()
            });
        }
        if let Some(due) = schedule.last_mut() {
            match kind {
                0 => due.record = true,
                1 => due.fields = due.fields.or_else(|| fields.next()),
                _ => due.planes = due.planes.or_else(|| planes.next()),
            }
        }
    }
    schedule
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_that_share_ages_are_joined_and_numbered() {
        let output = WakeOutput {
            every_tau: 0.5,
            fields_tau: Some(vec![1.0, 2.0]),
            planes_tau: Some(vec![0.25, 1.5]),
            series_tau: Some([1.0, 1.5]),
            series_every_tau: 0.25,
            ..WakeOutput::default()
        };
        let schedule = wake_schedule(&output, 0.1, 20.0);
        let expected = [0.0, 2.5, 5.0, 10.0, 12.5, 15.0, 20.0];
        assert_eq!(schedule.len(), expected.len());
        assert!(
            schedule
                .iter()
                .zip(expected)
                .all(|(due, expected)| (due.time_s - expected).abs() < 1e-9),
            "{schedule:?}"
        );
        let planes: Vec<Option<usize>> = schedule.iter().map(|d| d.planes).collect();
        assert_eq!(
            planes,
            [None, Some(0), None, Some(1), Some(2), Some(3), None]
        );
        let fields: Vec<Option<usize>> = schedule.iter().map(|d| d.fields).collect();
        assert_eq!(fields, [None, None, None, Some(0), None, None, Some(1)]);
        let records: Vec<bool> = schedule.iter().map(|d| d.record).collect();
        assert_eq!(records, [true, false, true, true, false, true, true]);
        assert_eq!(schedule[6].time_s, 20.0, "the end to the bit");
    }
}
