//! Number of layers of a path: each thin enough for diffraction, and together as accurate as the
//! continuous path at every range.
//!
//! The mean bistatic efficiency is exact both for given screens, (P5), and for the continuous path,
//! (P4). Their difference is the error of the layers, without random numbers.

use crate::air::cn2::Cn2Path;
use crate::air::structure::StructureTable;
use crate::air::turbulence::{path_rytov_variance, rytov_variance};
use crate::monte_carlo::path::Layers;
use crate::quadrature::GaussLegendre;
use crate::theory::overlap::Overlap;
use crate::{Error, Telescope};
use std::f64::consts::PI;

/// Largest Rytov variance (plane wave) of one layer.
pub const LARGEST_LAYER_RYTOV: f64 = 0.1;
/// Largest fraction of the expected standard error that the layers may add.
pub const LARGEST_GAP_SHARE: f64 = 1.0 / 3.0;
/// Largest number of layers that a plan proposes.
const MOST: usize = 1000;
/// Largest number of ranges at which the gap is computed.
const MOST_RANGES: usize = 64;
/// Largest number of terms of all its sums.
const MOST_TERMS: usize = 2_000_000;
/// A relative gap that is negligible, however many realisations.
const NEGLIGIBLE_GAP: f64 = 1e-4;

/// Effect of the layers of a set-up on the mean bistatic efficiency at one range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerGap {
    /// Range \[m\].
    pub range_m: f64,
    /// Mean bistatic efficiency for these screens over that for the continuous path,
    /// less one. Exact.
    pub relative: f64,
    /// Forecast of the relative standard error of the Monte Carlo.
    pub standard_error: f64,
}

impl LayerGap {
    /// The gap over what is allowed.
    pub(super) fn excess(&self) -> f64 {
        self.relative.abs() / (LARGEST_GAP_SHARE * self.standard_error).max(NEGLIGIBLE_GAP)
    }

    /// Whether the layers add more than [`LARGEST_GAP_SHARE`] of the standard error.
    pub fn is_large(&self) -> bool {
        self.excess() > 1.0
    }
}

/// Largest Rytov variance of a layer before `furthest_m`.
pub(super) fn worst_rytov(
    cn2: &Cn2Path,
    wavelength_m: f64,
    layers: &Layers,
    furthest_m: f64,
) -> Result<f64, Error> {
    let mut worst = 0f64;
    for (start, end) in layers
        .bounds_m()
        .take_while(|(start, _)| *start < furthest_m)
    {
        let end = end.min(furthest_m);
        worst = worst.max(rytov_variance(
            cn2.mean(start, end)?,
            wavelength_m,
            end - start,
        )?);
    }
    Ok(worst)
}

/// Equal layers to `furthest_m`, each with a Rytov variance of at most [`LARGEST_LAYER_RYTOV`].
pub(super) fn thin_layers(
    cn2: &Cn2Path,
    wavelength_m: f64,
    furthest_m: f64,
) -> Result<Layers, Error> {
    let mut count = 1;
    while count <= MOST {
        let layers = Layers::equal(count, furthest_m)?;
        if worst_rytov(cn2, wavelength_m, &layers, furthest_m)? <= LARGEST_LAYER_RYTOV {
            return Ok(layers);
        }
        count += 1 + count / 16;
    }
    Err(Error::TooManyLayers { most: MOST })
}

/// Overlap integrals of (P4) and (P5) at the ranges of a run, on fixed nodes.
pub(super) struct Gaps<'a> {
    cn2: &'a Cn2Path,
    table: &'a StructureTable,
    wavenumber_rad_m: f64,
    ranges: Vec<AtRange>,
}

struct AtRange {
    range_m: f64,
    /// Separation and weight 2 pi rho M^2 of each node.
    node: Vec<(f64, f64)>,
    /// The integral for the continuous path.
    path: f64,
    standard_error: f64,
}

impl<'a> Gaps<'a> {
    /// Prepares at most 64 of the ranges, spread over all, first and last included.
    pub(super) fn new(
        telescope: &Telescope,
        cn2: &'a Cn2Path,
        table: &'a StructureTable,
        range_m: &[f64],
        realisations: usize,
    ) -> Result<Self, Error> {
        let wavenumber_rad_m = telescope.wavenumber_rad_m();
        let rule = GaussLegendre::new(10);
        let mut gaps = Self {
            cn2,
            table,
            wavenumber_rad_m,
            ranges: Vec::new(),
        };
        if cn2.is_none() {
            return Ok(gaps);
        }
        for range_m in spread_over(range_m, MOST_RANGES) {
            let overlap = Overlap::new(telescope, range_m);
            let mut node = Vec::new();
            for pair in overlap.breaks().windows(2) {
                // Two panels at least: strong turbulence leaves a peak at small separations.
                let middle = pair[0] + 0.25 * (pair[1] - pair[0]);
                for (low, high) in [(pair[0], middle), (middle, pair[1])] {
                    for (rho, w) in rule.mapped(low, high) {
                        node.push((rho, w * 2.0 * PI * rho * overlap.at(rho).powi(2)));
                    }
                }
            }
            let rytov = path_rytov_variance(cn2, telescope.wavelength_m, range_m)?;
            let path = gaps.integral(&node, range_m, cn2.quadrature(range_m)?);
            gaps.ranges.push(AtRange {
                range_m,
                node,
                path,
                standard_error: forecast_error(rytov, realisations),
            });
        }
        Ok(gaps)
    }

    /// Integral of M^2 exp(-D) for a path with `positions` z and weights Cn2 dz.
    fn integral(
        &self,
        node: &[(f64, f64)],
        range_m: f64,
        positions: impl IntoIterator<Item = (f64, f64)>,
    ) -> f64 {
        let structure_rad2 =
            self.table
                .of_spherical_waves(self.wavenumber_rad_m, range_m, positions);
        node.iter()
            .map(|&(rho, weight)| weight * (-structure_rad2(rho)).exp())
            .sum()
    }

    /// The gap of a set of layers at each range; with very many layers, at a thinned set of ranges.
    pub(super) fn of_layers(&self, layers: &Layers) -> Result<Vec<LayerGap>, Error> {
        let nodes: usize = self.ranges.iter().map(|r| r.node.len()).sum();
        let terms = nodes.max(1) * layers.end_m().len();
        let fraction = (MOST_TERMS as f64 / terms as f64).min(1.0);
        let thinned = (self.ranges.len() as f64 * fraction).ceil().max(2.0) as usize;
        let ranges: Vec<&AtRange> = self.ranges.iter().collect();
        let mut out = Vec::new();
        for at in spread_over(&ranges, thinned) {
            let screens = layers.screens_to(at.range_m, self.cn2)?;
            let places = screens.iter().map(|s| (s.position_m, s.cn2_thickness_m13));
            let relative = self.integral(&at.node, at.range_m, places) / at.path - 1.0;
            out.push(LayerGap {
                range_m: at.range_m,
                relative,
                standard_error: at.standard_error,
            });
        }
        Ok(out)
    }

    /// `layers`, halved until no range has a large gap; at each range the layer whose screen has
    /// the largest error is halved first.
    pub(super) fn refined(&self, mut layers: Layers) -> Result<Layers, Error> {
        loop {
            let mut large = self.of_layers(&layers)?;
            large.retain(LayerGap::is_large);
            if large.is_empty() || layers.end_m().len() >= MOST {
                return Ok(layers);
            }
            let mut is_halved = vec![false; layers.end_m().len()];
            for gap in &large {
                let errors = self.weight_errors(&layers, gap.range_m)?;
                let worst = errors.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
                if let Some((layer, _)) = worst {
                    is_halved[layer] = true;
                }
            }
            let mut ends_m = Vec::new();
            for ((start, end), is_halved) in layers.bounds_m().zip(is_halved) {
                if is_halved {
                    ends_m.push(0.5 * (start + end));
                }
                ends_m.push(end);
            }
            layers = Layers::new(ends_m)?;
        }
    }

    /// Error of the screen of each layer in the integral of Cn2 (1 - z/R)^(5/3) for a wave from
    /// `range_m`.
    fn weight_errors(&self, layers: &Layers, range_m: f64) -> Result<Vec<f64>, Error> {
        let rule = GaussLegendre::new(6);
        let mut errors = Vec::new();
        for (start, end) in layers.bounds_m().take_while(|(start, _)| *start < range_m) {
            let end = end.min(range_m);
            let mut exact = 0.0;
            for (z, dz) in rule.mapped(start, end) {
                exact += self.cn2.at(z)? * spherical_weight(z, range_m) * dz;
            }
            let middle = 0.5 * (start + end);
            let screen =
                self.cn2.mean(start, end)? * (end - start) * spherical_weight(middle, range_m);
            errors.push((exact - screen).abs());
        }
        Ok(errors)
    }

    /// Number of equal layers to `furthest_m`, `least` or more, without a large gap; none
    /// if 1000 have one.
    pub(super) fn equal_layers(
        &self,
        least: usize,
        furthest_m: f64,
    ) -> Result<Option<usize>, Error> {
        let mut count = least;
        while count <= MOST {
            let gaps = self.of_layers(&Layers::equal(count, furthest_m)?)?;
            if !gaps.iter().any(LayerGap::is_large) {
                return Ok(Some(count));
            }
            count += 1 + count / 4;
        }
        Ok(None)
    }
}

/// (1 - z/R)^(5/3), the weight of Cn2 at `position_m` for a spherical wave from `range_m`.
fn spherical_weight(position_m: f64, range_m: f64) -> f64 {
    (1.0 - position_m / range_m).max(0.0).powf(5.0 / 3.0)
}

/// Forecast of the relative standard error of a mean over realisations, half of them antithetic:
/// the scatter of one grows with the Rytov variance and levels off (measured: 0.3 times it up to
/// 0.3; 0.35 to 0.5 in strong turbulence).
fn forecast_error(rytov_variance: f64, realisations: usize) -> f64 {
    (0.3 * rytov_variance).min(0.35) / (realisations.max(1) as f64).sqrt()
}

/// At most `count` of the items, evenly over the list, first and last included.
fn spread_over<T: Copy>(items: &[T], count: usize) -> Vec<T> {
    if items.len() <= count || count < 2 {
        return items.iter().copied().take(count.max(1)).collect();
    }
    (0..count)
        .map(|i| items[i * (items.len() - 1) / (count - 1)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Turbulence;
    use crate::air::cn2::hufnagel_valley;
    use std::f64::consts::FRAC_PI_2;

    /// Hufnagel-Valley 5/7 above the telescope.
    fn slanted(elevation_rad: f64) -> Cn2Path {
        hufnagel_valley(3100.0, 2.0, elevation_rad)
    }

    #[test]
    fn derived_layers_are_enough_at_every_range_where_equal_ones_were_not() {
        let telescope = Telescope::table2();
        let table = StructureTable::new(&*Turbulence::table2(1e-15).unwrap().spectrum);
        let strong = Cn2Path::Uniform { cn2_m_m23: 1e-13 };
        for (cn2, furthest_m) in [
            (strong, 600.0),
            (slanted(30f64.to_radians()), 3000.0),
            (slanted(FRAC_PI_2), 3000.0),
        ] {
            let range_m: Vec<f64> = (1..=6).map(|i| furthest_m * f64::from(i) / 6.0).collect();
            let gaps = Gaps::new(&telescope, &cn2, &table, &range_m, 400).unwrap();
            let thin = thin_layers(&cn2, telescope.wavelength_m, furthest_m).unwrap();
            let worst = |layers: &Layers| {
                gaps.of_layers(layers)
                    .unwrap()
                    .iter()
                    .fold(0f64, |w, g| w.max(g.excess()))
            };
            assert!(worst(&thin) > 1.0, "{}", worst(&thin));
            let refined = gaps.refined(thin.clone()).unwrap();
            assert!(
                worst(&refined) <= 1.0 && refined.end_m().len() < 60,
                "{refined:?}"
            );
            let equal = gaps
                .equal_layers(thin.end_m().len(), furthest_m)
                .unwrap()
                .unwrap();
            assert!(worst(&Layers::equal(equal, furthest_m).unwrap()) <= 1.0);
        }
    }

    #[test]
    fn gap_is_that_of_the_two_exact_efficiencies() {
        let telescope = Telescope::table2();
        let none = crate::Misalignment::NONE;
        let turbulence = Turbulence::table2(1e-13).unwrap();
        let table = StructureTable::new(&*turbulence.spectrum);
        let gaps = Gaps::new(
            &telescope,
            &turbulence.cn2,
            &table,
            &[80.0, 200.0, 600.0],
            400,
        )
        .unwrap();
        let layers = Layers::equal(3, 600.0).unwrap();
        for gap in gaps.of_layers(&layers).unwrap() {
            let r = gap.range_m;
            let screens = layers.screens_to(r, &turbulence.cn2).unwrap();
            let of_screens =
                crate::theory::bistatic_efficiency_screens(&telescope, &none, &screens, &table, r)
                    .unwrap();
            let of_path =
                crate::theory::bistatic_efficiency(&telescope, &none, &turbulence, r).unwrap();
            let exact = of_screens / of_path - 1.0;
            assert!(
                (gap.relative - exact).abs() < 1e-3 * exact.abs() + 1e-9,
                "{r}: {} {exact}",
                gap.relative
            );
        }
    }
}
