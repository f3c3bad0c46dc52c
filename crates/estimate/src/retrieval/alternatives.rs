//! What else a scan allows beside its best fit, as part of the deviations: other spacings where gates are as long as the pair is wide, and
//! the other profile of the cores where none is stated. Long gates may show one vortex where there is a pair: then a flag says so.
//!
//! Each alternative is a fit of its own, weighed by its likelihood. Long gates show circulation times spacing, so that the least chi-square
//! lies anywhere along a ridge and its curvature says nothing of the ridge's length; there the reported wake has the mean spacing of all.
//! Check: deviations against the scatter over scans with gates longer than half the spacing, and over Lamb-Oseen wakes.

use ndarray::Array2;

use crate::Measured;
use crate::error::Error;
use crate::retrieval::hypotheses::{End, Kind, Stage, best};
use crate::retrieval::report::{Chosen, Report};
use crate::retrieval::{Flag, ScanResult, Side, VortexResult};
use crate::vortex_fit::map_fit::data::nearest_index;
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::tolerances::{COMPETES, EVALUATION, MINIMUM, NEGLIGIBLE, SPACING};
use crate::vortex_fit::top::mixed;
use crate::vortex_fit::{Parameter, Wake};

/// Spacings of the pairs behind aircraft in service \[m\]: pi/4 of spans of 20 to 80 m, one as likely as another in its logarithm.
const SPACINGS_M: (f64, f64) = (16.0, 63.0);
const SPACINGS: usize = 12;
/// Spacings are others if their logarithms differ by more.
const APART: f64 = 0.1;

struct Alternative {
    end: End,
    covariance: Array2<f64>,
    vortices: Vec<VortexResult>,
    /// Its likelihood, at first to that of the best one.
    weight: f64,
}

impl Alternative {
    fn new(report: &Report<'_>, end: End) -> Result<Self, Error> {
        let covariance = report.covariance(&end)?;
        let vortices = report.vortices(&end, &covariance);
        Ok(Self {
            end,
            covariance,
            vortices,
            weight: 1.0,
        })
    }

    /// Whether its likelihood competes with the largest one, that of `least_chi2`.
    fn competes(&self, least_chi2: f64, variance: f64) -> bool {
        self.end.chi2 - least_chi2 < COMPETES * variance
    }

    fn log_spacing(&self) -> f64 {
        self.end.wake.spacing_m().ln()
    }

    /// Mean square about `value` of one of the numbers of the vortex on that side, times the weight; nothing if it has none.
    fn weighted_square(&self, side: Side, number: Number, value: f64) -> Option<f64> {
        let mut vortex = *self.vortices.iter().find(|vortex| vortex.side == side)?;
        let own = number(&mut vortex)?;
        Some(self.weight * (own.std * own.std + (own.value - value).powi(2)))
    }
}

/// Reads one of the numbers of a vortex.
type Number = fn(&mut VortexResult) -> Option<&mut Measured>;

/// The result of a report, its deviations those of all that the scan allows.
pub(crate) fn with_alternatives(report: &Report<'_>) -> Result<ScanResult, Error> {
    let Chosen {
        end,
        covariance,
        statistic,
        alike,
    } = report.chosen()?;
    if end.kind == Kind::Wind {
        return Ok(report.result(end, covariance, statistic));
    }
    let vortices = report.vortices(end, &covariance);
    let mut all = vec![Alternative {
        end: end.clone(),
        covariance,
        vortices,
        weight: 1.0,
    }];
    let variance = report.scale.powi(2) * alike;
    let most = end.chi2 + NEGLIGIBLE * variance;
    // where the curvature of an end tells nothing, those of the others do
    if report.stage.options.other_spacings {
        all.extend(
            other_spacings(report, end, most)
                .into_iter()
                .filter_map(|end| Alternative::new(report, end).ok()),
        );
    }
    let spacings = all.len();
    if report.stage.options.other_profile {
        all.extend(of_other_profile(report, end, most)?);
    }
    let least_chi2 = weigh(&mut all, variance);
    let is_ambiguous = all[..spacings].iter().any(|one| {
        one.competes(least_chi2, variance) && is_other_spacing(&one.end.wake, &end.wake)
    });
    let reported = if is_ambiguous {
        nearest_to_the_mean_spacing(&all[..spacings])
    } else {
        end
    };
    let weighted = all
        .iter()
        .map(|one| (one.weight, &one.end.wake, &one.covariance));
    let mut result = report.result(reported, mixed(weighted, &reported.wake), statistic);
    result
        .vortices
        .iter_mut()
        .for_each(|vortex| widen(vortex, &all));
    let is_ambiguous =
        is_ambiguous || may_be_pair(report, end, variance) || result.has(Flag::Ambiguous);
    result.set(Flag::Ambiguous, is_ambiguous);
    Ok(result)
}

/// Gives each alternative its likelihood as a weight, with a sum of 1, and returns the least chi-square.
fn weigh(all: &mut [Alternative], variance: f64) -> f64 {
    let least_chi2 = all
        .iter()
        .fold(f64::INFINITY, |least, one| least.min(one.end.chi2));
    for one in all.iter_mut() {
        one.weight = (-0.5 * (one.end.chi2 - least_chi2) / variance).exp();
    }
    let sum: f64 = all.iter().map(|one| one.weight).sum();
    for one in all.iter_mut() {
        one.weight /= sum;
    }
    least_chi2
}

fn is_other_spacing(wake: &Wake, reference: &Wake) -> bool {
    (wake.spacing_m() / reference.spacing_m()).ln().abs() > APART
}

/// Whether a pair that the gates do not resolve competes with the one vortex of `end`.
fn may_be_pair(report: &Report<'_>, end: &End, variance: f64) -> bool {
    let pair = best(report.ends, Kind::Both).filter(|_| end.kind != Kind::Both);
    pair.is_some_and(|pair| {
        pair.chi2 - end.chi2 < COMPETES * variance
            && !report.stage.options.gate.resolves(pair.wake.spacing_m())
    })
}

/// Fits of pairs with given spacings, where gates are long: away from that of the end as far as chi-squares stay below `most`.
fn other_spacings(report: &Report<'_>, end: &End, most: f64) -> Vec<End> {
    let lateral = [
        Parameter::LeftLateral as usize,
        Parameter::RightLateral as usize,
    ];
    let spacing_m = end.wake.spacing_m();
    let are_free = lateral
        .iter()
        .all(|place| end.groups.contains(&vec![*place]));
    if end.kind != Kind::Both || !are_free || report.stage.options.gate.resolves(spacing_m) {
        return Vec::new();
    }
    let fits = report.stage;
    // both move alike: the spacing stays; cores of which something is known are free, as what suits one spacing does not suit another
    let known = report.stage.squares.prior.is_some();
    let mut groups = if known {
        fits.groups(end.kind)
    } else {
        end.groups.clone()
    };
    groups.retain(|group| !lateral.iter().any(|place| group == &[*place]));
    groups.push(lateral.to_vec());
    let step = (SPACINGS_M.1 / SPACINGS_M.0).ln() / (SPACINGS - 1) as f64;
    let spacings_m: Vec<f64> = (0..SPACINGS)
        .map(|i| SPACINGS_M.0 * (step * i as f64).exp())
        .collect();
    let (less, more) =
        spacings_m.split_at(spacings_m.partition_point(|other_m| *other_m < spacing_m));
    let mut ends = Vec::new();
    for way in [less.iter().rev().collect::<Vec<_>>(), more.iter().collect()] {
        // each begins where its neighbour ended
        let mut near = end.wake;
        for spacing_m in way {
            let Some(found) = fits.lowest(
                end.kind,
                &with_spacing(&near, *spacing_m),
                groups.clone(),
                SPACING,
            ) else {
                continue;
            };
            if found.chi2 > most {
                break;
            }
            if found.wake.left.circulation_m2_s > 0.0 && found.wake.right.circulation_m2_s > 0.0 {
                near = found.wake;
                ends.push(found);
            }
        }
    }
    ends
}

/// The pair about its middle, with circulation times spacing as it was.
fn with_spacing(wake: &Wake, spacing_m: f64) -> Wake {
    let middle_m = 0.5 * (wake.left.lateral_position_m + wake.right.lateral_position_m);
    let ratio = spacing_m / wake.spacing_m();
    let mut wake = *wake;
    for vortex in [&mut wake.left, &mut wake.right] {
        vortex.circulation_m2_s /= ratio;
        vortex.lateral_position_m = middle_m + ratio * (vortex.lateral_position_m - middle_m);
    }
    wake
}

/// The fit with the other profile, from the end of the stated one, unless its chi-square is above `most`.
fn of_other_profile(
    report: &Report<'_>,
    end: &End,
    most: f64,
) -> Result<Option<Alternative>, Error> {
    let mut options = report.stage.options.clone();
    options.model.profile = options.model.profile.other();
    let moving = Gates::on_grid(report.stage.map, &options, 1)?;
    let dense = if report.stage.gates.seconds.is_some() {
        moving
    } else {
        moving.frozen()
    };
    let fine = dense.clone().fine(&options.gate)?;
    let stage = Stage {
        options: &options,
        ..report.stage.clone()
    }
    .through(&dense);
    let near = stage.onwards(std::slice::from_ref(end), |_| MINIMUM);
    let stage = stage.through(&fine);
    let other = stage.onwards(&near, |_| EVALUATION).pop();
    let other = other.filter(|other| other.chi2 <= most);
    let report = Report {
        stage: &stage,
        ..*report
    };
    Ok(other.and_then(|end| Alternative::new(&report, end).ok()))
}

/// The end whose spacing is nearest to the mean of all by weight, in the logarithm.
fn nearest_to_the_mean_spacing(all: &[Alternative]) -> &End {
    let log_spacings: Vec<f64> = all.iter().map(Alternative::log_spacing).collect();
    let sum: f64 = all.iter().map(|one| one.weight).sum();
    let mean = all
        .iter()
        .zip(&log_spacings)
        .map(|(one, log_spacing)| one.weight * log_spacing)
        .sum::<f64>()
        / sum;
    &all[nearest_index(&log_spacings, mean).unwrap_or(0)].end
}

/// Deviations of a vortex become those of all that the scan allows, each at its own line and with its own profile.
fn widen(vortex: &mut VortexResult, all: &[Alternative]) {
    const NUMBERS: [Number; 5] = [
        |vortex| Some(&mut vortex.circulation_m2_s),
        |vortex| Some(&mut vortex.circulation_5_15_m2_s),
        |vortex| Some(&mut vortex.lateral_position_m),
        |vortex| Some(&mut vortex.height_m),
        |vortex| vortex.core_radius_m.as_mut(),
    ];
    for number in NUMBERS {
        let Some(own) = number(vortex).map(|own| own.value) else {
            continue;
        };
        let squares: f64 = all
            .iter()
            .filter_map(|one| one.weighted_square(vortex.side, number, own))
            .sum();
        if let Some(own) = number(vortex) {
            own.std = squares.sqrt();
        }
    }
}
