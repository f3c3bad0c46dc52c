//! Wind alone, one vortex or two: the best fit of each to a scan.
//!
//! Check: the reference maps; wakes of which one vortex is in view.

use crate::error::Error;
use crate::linalg::positive_definite::inverse;
use crate::retrieval::{RetrievalOptions, ScanMap, Side};
use crate::vortex_fit::levenberg_marquardt::{Minimum, StoppingRule};
use crate::vortex_fit::map_fit::cells::{cells, products};
use crate::vortex_fit::map_fit::gates::Gates;
use crate::vortex_fit::map_fit::guess::Search;
use crate::vortex_fit::map_fit::least_squares::LeastSquares;
use crate::vortex_fit::map_fit::starts::CORE_OVER_SPACING;
use crate::vortex_fit::tolerances::{
    EVALUATION, HOPELESS, MINIMUM, NEARLY_SAME_FRACTION, REPORTED, ROUGHLY_SAME_FRACTION,
    SAME_FRACTION, SAME_SIGMAS, SEARCH,
};
use crate::vortex_fit::top::distinct;
use crate::vortex_fit::wake::core_prior::is_core;
use crate::vortex_fit::wake::log_wind_prior::log_wind_std_m_s;
use crate::vortex_fit::{PARAMETERS, Parameter, Vortex, Wake};

/// Where a vortex is that does not exist \[m\] from the other, and the typical core of one without a partner.
const NOWHERE_M: f64 = 1000.0;
const LONE_CORE_M: f64 = 2.0;
/// While fits search their way cores are broad, over the spacing.
const BROAD: f64 = 0.1;
/// A core is not resolved if its deviation is more than this part of it, or if it is more than that part of the spacing.
const RESOLVED: f64 = 0.5;
const LARGEST: f64 = 0.5;

/// Which vortices there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Wind,
    Left,
    Right,
    Both,
}

impl Kind {
    /// Whether the parameter belongs to a vortex that there is, or to the wind.
    pub(crate) fn has(self, place: usize) -> bool {
        let is_left = Side::Left
            .parameters()
            .iter()
            .any(|parameter| *parameter as usize == place);
        match self {
            _ if place >= Parameter::Wind as usize => true,
            Self::Wind => false,
            Self::Left => is_left,
            Self::Right => !is_left,
            Self::Both => true,
        }
    }

    /// The wake without the vortices that there are not.
    pub(crate) fn of(self, wake: &Wake) -> Wake {
        match self {
            Self::Both => *wake,
            Self::Left => Wake {
                right: absent_beside(&wake.left, NOWHERE_M),
                ..*wake
            },
            Self::Right => Wake {
                left: absent_beside(&wake.right, -NOWHERE_M),
                ..*wake
            },
            Self::Wind => wake.wind_alone(),
        }
    }

    /// Whether two wakes are one but for a part of each parameter.
    fn same(self, a: &Wake, b: &Wake, part: f64) -> bool {
        let a = a.to_array();
        let b = b.to_array();
        (0..PARAMETERS).all(|i| (a[i] - b[i]).abs() <= part * a[i].abs().max(20.0) || !self.has(i))
    }
}

/// A vortex without circulation, `offset_m` to the right of another one.
fn absent_beside(other: &Vortex, offset_m: f64) -> Vortex {
    Vortex {
        circulation_m2_s: 0.0,
        ..other.beside(offset_m)
    }
}

/// An end of a fit.
#[derive(Debug, Clone)]
pub(crate) struct End {
    pub(crate) kind: Kind,
    pub(crate) wake: Wake,
    pub(crate) chi2: f64,
    /// The step that is left \[standard deviations\].
    pub(crate) sigmas_left: f64,
    /// Free numbers.
    pub(crate) groups: Vec<Vec<usize>>,
}

impl End {
    /// Whether its vortices turn as those of an aircraft: a left vortex the other way round is a right one.
    fn turns_as_aircraft(&self) -> bool {
        let p = self.wake.to_array();
        [Parameter::LeftCirculation, Parameter::RightCirculation]
            .into_iter()
            .all(|circulation| {
                !self.kind.has(circulation as usize) || p[circulation as usize] > 0.0
            })
    }

    /// Bayesian information criterion chi^2 + k ln N of a fit to N cells (Schwarz 1978).
    fn information_criterion(&self, cells: usize) -> f64 {
        self.chi2 + self.groups.len() as f64 * (cells as f64).ln()
    }
}

/// Fits of one scan with one sight of it.
#[derive(Clone)]
pub(crate) struct Stage<'a> {
    pub(crate) map: &'a ScanMap,
    pub(crate) options: &'a RetrievalOptions,
    pub(crate) gates: &'a Gates<'a>,
    pub(crate) squares: LeastSquares<'a>,
    /// Velocities that were taken away before.
    pub(crate) rejected: usize,
    /// Whether its velocities stand for more.
    pub(crate) thinned: bool,
    /// Whether the residuals are noise, whose correlation says how many velocities count as one; not those of misplaced cores.
    pub(crate) is_noise_left: bool,
    /// Whether the stated noise, with the turbulence of the scan, is right, so that covariances follow from it; else they follow from the residuals.
    pub(crate) is_noise_known: bool,
}

impl<'a> Stage<'a> {
    /// With all velocities of the map, as independent ones of the stated deviations.
    pub(crate) fn new(
        map: &'a ScanMap,
        options: &'a RetrievalOptions,
        gates: &'a Gates<'a>,
    ) -> Self {
        let squares = LeastSquares {
            prediction: gates,
            fold_m_s: map.fold_m_s,
            cells: cells(&map.view()),
            whitening: None,
            loss: options.loss,
            prior: options.core_prior,
            pair_prior: None,
            log_wind_std_m_s: log_wind_std_m_s(&map.view()),
            counted: 1.0,
        };
        Self {
            map,
            options,
            gates,
            squares,
            rejected: 0,
            thinned: false,
            is_noise_left: true,
            is_noise_known: false,
        }
    }

    /// The same with other gates.
    pub(crate) fn through(self, gates: &'a Gates<'a>) -> Self {
        Self {
            gates,
            squares: LeastSquares {
                prediction: gates,
                ..self.squares
            },
            ..self
        }
    }

    /// Where no deviations are stated, they are those of the residuals of an end.
    pub(crate) fn rescaled(self, end: &End) -> Self {
        let scale = self.residual_scale(end);
        Self {
            squares: self.squares.rescaled(scale),
            ..self
        }
    }

    /// Scale of the residuals over their deviations.
    pub(crate) fn residual_scale(&self, end: &End) -> f64 {
        self.squares.residual_scale(&end.wake.to_array())
    }

    pub(crate) fn groups(&self, kind: Kind) -> Vec<Vec<usize>> {
        let all = self.options.free.groups().into_iter();
        all.map(|group| {
            group
                .into_iter()
                .filter(|place| kind.has(*place))
                .collect::<Vec<usize>>()
        })
        .filter(|group| !group.is_empty())
        .collect()
    }

    /// Where fits of a scan start.
    pub(crate) fn starts(&self) -> Result<Vec<(Kind, Wake)>, Error> {
        let search = Search::new(&self.map.view(), self.gates.model, &self.gates.kernel)?;
        let mut starts: Vec<_> = self
            .options
            .start
            .into_iter()
            .chain(search.wakes())
            .map(|wake| (Kind::Both, wake))
            .collect();
        for (kind, sense) in [(Kind::Left, -1.0), (Kind::Right, 1.0)] {
            let single = search.single(sense);
            starts.extend(single.map(|(place_m, circulation_m2_s)| {
                let vortex = Vortex::at(place_m, circulation_m2_s, LONE_CORE_M);
                (kind, kind.of(&Wake::calm(vortex, vortex)))
            }));
        }
        Ok(starts)
    }

    /// The wind alone.
    ///
    /// # Errors
    /// [`Error::NotConverged`] about an impossible wake.
    pub(crate) fn wind(&self, about: &Wake) -> Result<End, Error> {
        let nowhere = Error::NotConverged {
            iterations: 0,
            sigmas_left: f64::INFINITY,
        };
        self.lowest(
            Kind::Wind,
            &Kind::Wind.of(about),
            self.groups(Kind::Wind),
            MINIMUM,
        )
        .ok_or(nowhere)
    }

    /// The end from a start on, with those free numbers.
    pub(crate) fn lowest(
        &self,
        kind: Kind,
        start: &Wake,
        groups: Vec<Vec<usize>>,
        stop: StoppingRule,
    ) -> Option<End> {
        let Minimum {
            at,
            normal,
            sigmas_left,
            ..
        } = self.squares.minimum(&start.to_array(), &groups, stop)?;
        Some(End {
            kind,
            wake: Wake::from_list(&at),
            chi2: 2.0 * normal.cost,
            sigmas_left,
            groups,
        })
    }

    /// Core radius that a fit starts with or keeps.
    fn core_m(&self, kind: Kind, wake: &Wake) -> f64 {
        let typical = if kind == Kind::Both {
            CORE_OVER_SPACING * wake.spacing_m()
        } else {
            LONE_CORE_M
        };
        self.options.core_radius_m.unwrap_or(typical)
    }

    /// From a rough start with broad cores, until the places are known.
    fn near(&self, kind: Kind, start: &Wake) -> Option<Wake> {
        let groups = self.groups(kind);
        let coreless: Vec<Vec<usize>> = groups
            .iter()
            .filter(|group| !is_core(group))
            .cloned()
            .collect();
        let spacing_m = if kind == Kind::Both {
            start.spacing_m()
        } else {
            LONE_CORE_M / CORE_OVER_SPACING
        };
        let broad = self.options.free.start(start).with_cores(BROAD * spacing_m);
        self.lowest(kind, &broad, coreless, SEARCH)
            .map(|end| end.wake)
    }

    /// From a start near the end, with cores begun anew.
    fn polished(&self, kind: Kind, near: &Wake) -> Option<End> {
        let mut groups = self.groups(kind);
        let core_m = self.core_m(kind, near);
        if !groups.iter().any(|group| is_core(group)) {
            let end = self.lowest(kind, &near.with_cores(core_m), groups.clone(), MINIMUM)?;
            // the typical core is that of the spacing which the fit ends with
            return self.lowest(
                kind,
                &end.wake.with_cores(self.core_m(kind, &end.wake)),
                groups,
                MINIMUM,
            );
        }
        let spacing_m = if kind == Kind::Both {
            near.spacing_m()
        } else {
            LONE_CORE_M / CORE_OVER_SPACING
        };
        let end = self.lowest(kind, &near.with_cores(core_m), groups.clone(), MINIMUM);
        let vague: Vec<usize> = match &end {
            Some(end) => self.vague_cores(end, LARGEST * spacing_m),
            None => vec![Parameter::LeftCore as usize, Parameter::RightCore as usize],
        };
        if vague.is_empty() {
            return end;
        }
        groups.retain(|group| !group.iter().all(|place| vague.contains(place)));
        let mut p = near.to_array();
        vague.iter().for_each(|place| p[*place] = core_m);
        if let Some(end) = end {
            let found = end.wake.to_array();
            (0..PARAMETERS)
                .filter(|place| is_core(&[*place]) && !vague.contains(place))
                .for_each(|i| p[i] = found[i]);
        }
        self.lowest(kind, &Wake::from_array(&p), groups, MINIMUM)
    }

    /// Places of the core radii that the scan does not resolve.
    fn vague_cores(&self, end: &End, largest_m: f64) -> Vec<usize> {
        let rows = self.squares.rows(&end.wake.to_array(), &end.groups);
        let curvature = products(&vec![1.0; rows.residuals.len()], &rows.slopes);
        let covariance = inverse("curvature of the fit", &curvature);
        let p = end.wake.to_array();
        let mut vague = Vec::new();
        for (i, group) in end.groups.iter().enumerate() {
            if !is_core(group) {
                continue;
            }
            let core_m = p[group[0]];
            let deviation_m = covariance
                .as_ref()
                .map_or(f64::INFINITY, |c| c[[i, i]].sqrt());
            // a NaN resolves nothing
            let is_resolved = deviation_m < RESOLVED * core_m && core_m < largest_m;
            if !is_resolved {
                vague.extend(group);
            }
        }
        vague
    }

    /// Ends of all starts; pairs also start fits of each of their vortices alone.
    pub(crate) fn ends_of(&self, starts: &[(Kind, Wake)]) -> Vec<End> {
        let nears = starts
            .iter()
            .filter_map(|(kind, start)| Some((*kind, self.near(*kind, start)?)));
        let nears = distinct(nears, |(other, wake), (kind, near)| {
            other == kind && kind.same(wake, near, NEARLY_SAME_FRACTION)
        });
        let mut ends: Vec<End> = nears
            .iter()
            .filter_map(|(kind, near)| self.polished(*kind, near))
            .collect();
        if let Some(pair) = best(&ends, Kind::Both).map(|end| end.wake) {
            ends.extend(
                [Kind::Left, Kind::Right]
                    .iter()
                    .filter_map(|kind| self.polished(*kind, &kind.of(&pair))),
            );
        }
        ends
    }

    /// The ends for another problem, such as another scale of the loss.
    pub(crate) fn onwards(&self, ends: &[End], stop: impl Fn(&End) -> StoppingRule) -> Vec<End> {
        ends.iter()
            .filter_map(|end| self.lowest(end.kind, &end.wake, end.groups.clone(), stop(end)))
            .collect()
    }

    /// The minima with each gate's own points: the most likely one, which is reported, until it converges; of the others the chi-square.
    pub(crate) fn fine(&self, ends: &[End]) -> Vec<End> {
        let likely = least(ends, self.squares.cells.len()).map(|likely| likely.chi2);
        self.onwards(ends, |end| {
            if Some(end.chi2) == likely {
                REPORTED
            } else {
                EVALUATION
            }
        })
    }

    /// Ends for a problem with more velocities, from those of one with fewer.
    pub(crate) fn again(&self, ends: &[End]) -> Vec<End> {
        ends.iter()
            .filter_map(|end| self.polished(end.kind, &end.wake))
            .collect()
    }
}

/// Rough ends without those that are the same or far worse than the best of their kind.
pub(crate) fn rivals(ends: &[End], scale: f64) -> Vec<End> {
    let followed = ends.iter().filter(|end| !is_hopeless(end, ends, scale));
    distinct(followed.cloned(), |other, end| {
        other.kind == end.kind && end.kind.same(&end.wake, &other.wake, ROUGHLY_SAME_FRACTION)
    })
}

/// Whether an end is far worse than the best one of its kind.
fn is_hopeless(end: &End, ends: &[End], scale: f64) -> bool {
    best(ends, end.kind).is_none_or(|best| end.chi2 > best.chi2 + HOPELESS * scale * scale)
}

/// The best end of a kind whose circulations have the sense of an aircraft's.
pub(crate) fn best(ends: &[End], kind: Kind) -> Option<&End> {
    ends.iter()
        .filter(|end| end.kind == kind && end.turns_as_aircraft())
        .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
}

/// The end with the least information criterion among all kinds of wakes.
pub(crate) fn least(ends: &[End], cells: usize) -> Option<&End> {
    let bests = [Kind::Left, Kind::Right, Kind::Both]
        .into_iter()
        .filter_map(|kind| best(ends, kind));
    bests.min_by(|a, b| {
        a.information_criterion(cells)
            .total_cmp(&b.information_criterion(cells))
    })
}

/// All ends of the kind of the best one that are not the same, the best first, given its covariance.
pub(crate) fn tops<'a>(
    ends: &'a [End],
    best: &End,
    covariance: &ndarray::Array2<f64>,
) -> Vec<&'a End> {
    let mut sorted: Vec<&End> = ends.iter().filter(|end| end.kind == best.kind).collect();
    sorted.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    distinct(sorted, |top, end| {
        let a = end.wake.to_array();
        let b = top.wake.to_array();
        (0..PARAMETERS).all(|i| {
            let sigma = covariance[[i, i]].sqrt();
            let tolerance = (SAME_SIGMAS * sigma).max(SAME_FRACTION * a[i].abs().max(1.0));
            (a[i] - b[i]).abs() <= tolerance || !end.kind.has(i)
        })
    })
}
