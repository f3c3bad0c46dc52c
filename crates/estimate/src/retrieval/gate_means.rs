//! Fit of one scan of means over gates: the best wake, whether there is one, and what is known of it.
//!
//! Wind alone, a left vortex, a right one and both are fitted. Of the last three the one with the least chi^2 + k ln N is taken; it is
//! a wake if the statistic, the least chi^2 of the wind alone minus its own, reaches the threshold, and so for each vortex.
//! Check: the reference maps; scatter, bias and stated deviations over many maps.

use crate::error::Error;
use crate::retrieval::aliases::{self, CALM, Unfolded};
use crate::retrieval::alternatives::with_alternatives;
use crate::retrieval::hypotheses::{End, Kind, Stage, least, rivals};
use crate::retrieval::report::{OUTLIER, Report};
use crate::retrieval::whitening::Whitening;
use crate::retrieval::{Flag, Movement, RetrievalOptions, ScanMap, ScanResult, Turbulence};

use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::guess::SEARCHED;
use crate::vortex_fit::tolerances::MINIMUM;
use crate::vortex_fit::{Loss, Wake};

/// Most velocities that are whitened, and that are fitted: blocks stand for more.
const WHITENED: usize = 1500;
pub(super) const MOST: usize = 16_000;
/// Most winds that are assumed in turn.
const OTHER_WINDS: usize = 3;
/// A statistic below this part of the threshold in medians, which tell two thirds of what all velocities do, is no wake.
const NOTHING: f64 = 0.5;

/// Finds the vortices of a scan whose velocities are means over gates.
///
/// # Errors
/// As [`fit_scan`](crate::retrieval::fit_scan).
pub(super) fn fit_means(map: &ScanMap, options: &RetrievalOptions) -> Result<ScanResult, Error> {
    options.validate()?;
    map.validate()?;
    let mut unfolded = Unfolded::new(map, options)?;
    let mut options = options.clone();
    for _ in 0..OTHER_WINDS {
        let (result, better) = fit_unfolded(&unfolded, &options)?;
        let Some((wake, movement)) = better else {
            return Ok(result);
        };
        unfolded = unfolded.about(&wake, &options);
        options.movement = movement;
    }
    Ok(fit_unfolded(&unfolded, &options)?.0)
}

/// The result in the assumed wind, and a wake in another wind that explains the velocities better, with its movement.
fn fit_unfolded(
    unfolded: &Unfolded,
    options: &RetrievalOptions,
) -> Result<(ScanResult, Option<(Wake, Movement)>), Error> {
    let bounded = unfolded.map.medians(if options.turbulence.is_some() {
        WHITENED
    } else {
        MOST
    });
    let map = bounded.as_ref().unwrap_or(&unfolded.map);
    // broad blocks are enough to search in
    let few = map.medians(SEARCHED);
    let gates = Gates::rough(map, options)?;
    let sought = few.as_ref().unwrap_or(map);
    let sought_gates = Gates::rough(sought, options)?;
    let mut all = Stage::new(map, options, &gates);
    let mut search = Stage::new(sought, options, &sought_gates);
    let mut starts = search.starts()?;
    for (_, start) in &mut starts {
        *start = unfolded.with_wind(start);
    }
    let nothing = unfolded.with_wind(&Wake::from_array(&CALM));
    let about = starts.first().map_or(nothing, |s| s.1);
    if map.sigma_m_s.is_none() {
        // what the wind leaves, until fits are known
        let winds = (search.wind(&about)?, all.wind(&about)?);
        search = search.rescaled(&winds.0);
        all = all.rescaled(&winds.1);
    }
    let found = search.ends_of(&starts);
    let likely = least(&found, search.squares.cells.len());
    all.thinned = bounded.is_some();
    let whitening = options.turbulence.as_ref().map(|turbulence| {
        likely
            .iter()
            .for_each(|end| reject(&mut all, turbulence, end));
        whitening(&all, turbulence)
    });
    let whitening = whitening.transpose()?;
    all.squares.whitening = whitening.as_ref();
    let ends = ends_in_all(
        &all,
        &search,
        (&starts, &found),
        (few.is_some(), &about),
        options,
    )?;
    let cells = all.squares.cells.len();
    let (all, scale) = in_scale(all, least(&ends, cells));
    let ends = rivals(&ends, scale);
    finished(all, &ends, scale, &about)
}

/// The result of rough ends, followed to their end with vortices that move or stand still, and a wake in another wind that explains the
/// velocities better, with its movement.
fn finished(
    all: Stage<'_>,
    rough: &[End],
    scale: f64,
    about: &Wake,
) -> Result<(ScanResult, Option<(Wake, Movement)>), Error> {
    let map = all.map;
    let options = all.options;
    let dense = Gates::on_grid(map, options, 1)?;
    let frozen = dense.clone().frozen();
    let stage = all.through(&dense);
    let mut ends = stage.onwards(rough, |_| MINIMUM);
    let may_stand = options.movement == Movement::Auto && dense.seconds.is_some();
    let still = stage.clone().through(&frozen);
    let standing = if may_stand {
        ends_at_rest(&stage, &still, &ends, scale)
    } else {
        None
    };
    let at_rest = if map.fold_m_s.is_some() && may_stand {
        still.onwards(&ends, |_| MINIMUM)
    } else {
        Vec::new()
    };
    let better = aliases::better([(&stage, &ends[..]), (&still, &at_rest)], scale);
    let (chosen, gates) = match &standing {
        Some(_) => (&still, frozen.clone()),
        None => (&stage, dense.clone()),
    };
    ends = standing.unwrap_or(ends);
    ends.extend(aliases::rivals(chosen, &ends, scale));
    let fine = gates.fine(&options.gate)?;
    let stage = stage.through(&fine);
    let wind = stage.wind(about)?;
    let ends = stage.fine(&ends);
    let (wind, other_wind_competes) = aliases::best_wind(&stage, wind, scale);
    let mut result = with_alternatives(&Report {
        stage: &stage,
        scale,
        wind: &wind,
        ends: &ends,
    })?;
    if result.wake.is_none() {
        result.set(Flag::Ambiguous, other_wind_competes);
    }
    Ok((result, better))
}

/// The ends in all velocities that come of a search, whose blocks stand for them if they are many.
fn ends_in_all(
    all: &Stage<'_>,
    search: &Stage<'_>,
    (starts, found): (&[(Kind, Wake)], &[End]),
    (is_of_blocks, about): (bool, &Wake),
    options: &RetrievalOptions,
) -> Result<Vec<End>, Error> {
    if all.squares.whitening.is_some() {
        return Ok(all.ends_of(starts));
    }
    let Some(likely) = least(found, search.squares.cells.len()).filter(|_| is_of_blocks) else {
        return Ok(found.to_vec());
    };
    // the scale in which they compete
    let scale = search.residual_scale(likely).max(1.0);
    let report = Report {
        stage: search,
        scale,
        wind: &search.wind(about)?,
        ends: found,
    };
    // where blocks show next to nothing, the best is enough to tell so
    let is_empty = report.chosen()?.statistic < NOTHING * options.threshold;
    Ok(all.again(&if is_empty {
        vec![likely.clone()]
    } else {
        rivals(found, scale)
    }))
}

/// The ends of vortices at rest, where they explain the velocities better than those that move by more than motion costs.
fn ends_at_rest(
    moving: &Stage<'_>,
    still: &Stage<'_>,
    ends: &[End],
    scale: f64,
) -> Option<Vec<End>> {
    let likely = least(ends, moving.squares.cells.len())?;
    let end = still
        .onwards(std::slice::from_ref(likely), |_| MINIMUM)
        .pop()?;
    let sense = if moving.map.lasts_s() < RetrievalOptions::SHORT_S {
        -1.0
    } else {
        1.0
    };
    let margin = RetrievalOptions::MOVES * scale.powi(2) * sense;
    (end.chi2 + margin < likely.chi2).then(|| still.onwards(ends, |_| MINIMUM))
}

/// A stage with deviations or a loss of the scale of the residuals that a likely end leaves, and that scale over the stated deviations.
fn in_scale<'a>(mut stage: Stage<'a>, likely: Option<&End>) -> (Stage<'a>, f64) {
    let Some(likely) = likely else {
        return (stage, 1.0);
    };
    if stage.map.sigma_m_s.is_none() && stage.squares.whitening.is_none() {
        return (stage.rescaled(likely), 1.0);
    }
    let scale = stage.residual_scale(likely).max(1.0);
    if let Loss::Cauchy { width } = &mut stage.squares.loss {
        *width *= scale;
    }
    (stage, scale)
}

/// What makes the velocities of a stage white.
fn whitening(stage: &Stage<'_>, turbulence: &Turbulence) -> Result<Whitening, Error> {
    let mut places = Vec::with_capacity(stage.squares.cells.len());
    for cell in &stage.squares.cells {
        let range_m = stage.map.range_m[cell.gate];
        let elevation_rad = stage.map.elevation_rad[cell.line];
        let position_m = stage.gates.model.position_m(range_m, elevation_rad);
        places.push((position_m, cell.sigma_m_s));
    }
    Whitening::new(&places, turbulence).ok_or(Error::Linalg {
        what: "covariance of the velocities",
        order: places.len(),
        reason: "is singular to working precision: state larger deviations of the velocities",
    })
}

/// Takes away velocities far off a first fit, which whitening would spread over their neighbours.
fn reject(stage: &mut Stage<'_>, turbulence: &Turbulence, end: &End) {
    let residuals = stage.squares.rows(&end.wake.to_array(), &[]).residuals;
    let mut residuals = residuals.iter();
    let before = stage.squares.cells.len();
    stage.squares.cells.retain(|cell| {
        let deviation_m_s = cell.sigma_m_s.hypot(turbulence.deviation_m_s);
        residuals
            .next()
            .is_none_or(|r| r.abs() * cell.sigma_m_s <= OUTLIER * deviation_m_s)
    });
    stage.rejected = before - stage.squares.cells.len();
}
