//! Heterodyne efficiency by range: one curve for all pulses, or one realisation of the turbulence for each.
//!
//! Check: straight lines between the points; each pulse gets its realisation; the mean over them is the curve.

use crate::error::{check_any, check_length};
use crate::table::{check_ranges, check_values, locate, value};
use crate::{Error, LineOfSight};

/// Efficiencies at some ranges, in one or more realisations.
#[derive(Debug, Clone, PartialEq)]
pub struct EfficiencyTable {
    range_m: Vec<f64>,
    /// Realisation after realisation.
    efficiency: Vec<f64>,
}

impl EfficiencyTable {
    /// A table of `realisations.len()` realisations (one for a mean curve), each with one efficiency per range.
    ///
    /// # Errors
    /// [`Error::Empty`] without ranges or realisations; [`Error::ElementOutOfRange`] for ranges that do not increase, or an
    /// efficiency that is negative or not finite; [`Error::LengthMismatch`] for a realisation of another length.
    pub fn new<E: AsRef<[f64]>>(range_m: Vec<f64>, realisations: &[E]) -> Result<Self, Error> {
        check_ranges(&range_m)?;
        check_any("realisations", realisations.len())?;
        let mut efficiency = Vec::with_capacity(range_m.len() * realisations.len());
        for realisation in realisations {
            check_values("efficiency", realisation.as_ref(), range_m.len())?;
            efficiency.extend_from_slice(realisation.as_ref());
        }
        Ok(Self { range_m, efficiency })
    }

    /// Number of realisations.
    pub fn realisations(&self) -> usize {
        self.efficiency.len() / self.range_m.len()
    }

    /// The efficiency of each layer of a line, by straight lines between the ranges of the table.
    ///
    /// Memory: one number per realisation and layer. Lines with the same layers share the result.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a layer lies beyond the table.
    pub fn onto_layers(&self, line: &LineOfSight) -> Result<LayerEfficiency, Error> {
        let (field, allowed) = ("range of a layer, m", "within the ranges of the efficiency table");
        let place = |layer| {
            let value = line.range_m(layer);
            locate(&self.range_m, value).ok_or(Error::OutOfRange { field, value, allowed })
        };
        let places = (0..line.layers()).map(place).collect::<Result<Vec<_>, _>>()?;
        check_any("radial_velocity_m_s", places.len())?;
        let rows = self.efficiency.chunks_exact(self.range_m.len());
        let efficiency = rows.flat_map(|row| places.iter().map(|&place| value(row, place))).collect();
        Ok(LayerEfficiency { layers: places.len(), efficiency })
    }
}

/// Efficiencies of the layers of a line, one set for each realisation.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerEfficiency {
    layers: usize,
    efficiency: Vec<f64>,
}

impl LayerEfficiency {
    /// Number of realisations.
    pub fn realisations(&self) -> usize {
        self.efficiency.len() / self.layers
    }

    /// The efficiencies of pulse `index`, one per layer, for [`Shot::efficiency`](crate::Shot::efficiency): its own
    /// realisation. Pulses beyond the last realisation use them again from the first on, so more pulses than realisations
    /// do not lower the variance that turbulence brings.
    pub fn of_pulse(&self, index: usize) -> &[f64] {
        let first = index % self.realisations() * self.layers;
        &self.efficiency[first..first + self.layers]
    }

    /// Writes the mean over the realisations, one per layer: the curve.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`] if `out` has not one place per layer.
    pub fn mean_into(&self, out: &mut [f64]) -> Result<(), Error> {
        check_length("out", out.len(), self.layers)?;
        out.fill(0.0);
        let share = 1.0 / self.realisations() as f64;
        for row in self.efficiency.chunks_exact(self.layers) {
            out.iter_mut().zip(row).for_each(|(mean, e)| *mean += share * e);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn line() -> LineOfSight {
        LineOfSight {
            first_range_m: 100.0,
            layer_thickness_m: 25.0,
            radial_velocity_m_s: vec![0.0; 9],
            weight_per_m: vec![1.0; 9],
        }
    }

    #[test]
    fn layers_lie_on_straight_lines_between_the_ranges() {
        let table = EfficiencyTable::new(vec![100.0, 200.0, 300.0], &[[0.1, 0.3, 0.2]]).unwrap();
        let layers = table.onto_layers(&line()).unwrap();
        let expected = [0.1, 0.15, 0.2, 0.25, 0.3, 0.275, 0.25, 0.225, 0.2];
        for (found, expected) in layers.of_pulse(0).iter().zip(expected) {
            assert_relative_eq!(*found, expected, max_relative = 1e-14);
        }
    }

    #[test]
    fn each_pulse_has_its_realisation_and_their_mean_is_the_curve() {
        let table = EfficiencyTable::new(vec![50.0, 400.0], &[[0.1, 0.1], [0.2, 0.2], [0.6, 0.6]]).unwrap();
        let layers = table.onto_layers(&line()).unwrap();
        assert_eq!((table.realisations(), layers.realisations()), (3, 3));
        for (pulse, expected) in [(0, 0.1), (1, 0.2), (2, 0.6), (3, 0.1), (7, 0.2)] {
            assert!(layers.of_pulse(pulse).iter().all(|e| (e - expected).abs() < 1e-15));
        }
        let mut mean = [0.0; 9];
        layers.mean_into(&mut mean).unwrap();
        assert!(mean.iter().all(|e| (e - 0.3).abs() < 1e-15));
    }

    #[test]
    fn tables_that_are_none_and_layers_beyond_them_are_refused() {
        assert!(matches!(EfficiencyTable::new(vec![], &[[0.0; 0]]), Err(Error::Empty { .. })));
        assert!(matches!(EfficiencyTable::new::<[f64; 1]>(vec![1.0], &[]), Err(Error::Empty { .. })));
        assert!(matches!(EfficiencyTable::new(vec![1.0], &[[0.1, 0.2]]), Err(Error::LengthMismatch { .. })));
        let negative = EfficiencyTable::new(vec![1.0, 2.0], &[[0.1, -0.2]]);
        assert!(matches!(negative, Err(Error::ElementOutOfRange { field: "efficiency", index: 1, .. })));
        let short = EfficiencyTable::new(vec![100.0, 200.0], &[[0.1, 0.2]]).unwrap();
        assert!(matches!(short.onto_layers(&line()), Err(Error::OutOfRange { value: 225.0, .. })));
    }
}
