//! Heterodyne efficiency by range: one curve for all pulses, or one realisation of the
//! turbulence for each.
//!
//! Check: straight lines between the points; each pulse gets its realisation.

use crate::error::check_any;
use crate::table::{check_ranges, check_values, locate, value};
use crate::{Error, LineOfSight};

/// Efficiencies of the layers of a line, one set for each realisation of the turbulence.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerEfficiency {
    layers: usize,
    /// Realisation after realisation.
    efficiency: Vec<f64>,
}

impl LayerEfficiency {
    /// The efficiency of each layer of a line in `realisations.len()` realisations (one for a
    /// mean curve), by straight lines between the ranges \[m\] at which each realisation has
    /// one efficiency.
    ///
    /// Memory: one number per realisation and layer. Lines with the same layers share the result.
    ///
    /// # Errors
    /// [`Error::Empty`] without ranges, realisations or layers; [`Error::ElementOutOfRange`] for
    /// ranges that do not increase, or an efficiency that is negative or not finite;
    /// [`Error::LengthMismatch`] for a realisation of another length; [`Error::OutOfRange`] if a
    /// layer lies beyond the ranges.
    pub fn new<E: AsRef<[f64]>>(
        range_m: &[f64],
        realisations: &[E],
        line: &LineOfSight,
    ) -> Result<Self, Error> {
        check_ranges(range_m)?;
        check_any("realisations", realisations.len())?;
        for realisation in realisations {
            check_values("efficiency", realisation.as_ref(), range_m.len())?;
        }
        let mut positions = Vec::with_capacity(line.layers());
        for layer in 0..line.layers() {
            let layer_m = line.range_m(layer);
            let position = locate(range_m, layer_m).ok_or(Error::OutOfRange {
                field: "range of a layer, m",
                value: layer_m,
                allowed: "within the ranges of the efficiency table",
            })?;
            positions.push(position);
        }
        check_any("radial_velocity_m_s", positions.len())?;
        let mut efficiency = Vec::with_capacity(realisations.len() * positions.len());
        for realisation in realisations {
            let row = realisation.as_ref();
            for &(index, fraction) in &positions {
                efficiency.push(value(row, index, fraction));
            }
        }
        Ok(Self {
            layers: positions.len(),
            efficiency,
        })
    }

    /// Number of realisations.
    pub fn realisations(&self) -> usize {
        self.efficiency.len() / self.layers
    }

    /// The efficiencies of pulse `index`, one per layer, for
    /// [`Shot::efficiency`](crate::Shot::efficiency): its own realisation. Pulses beyond the last
    /// realisation use them again from the first on, so more pulses than realisations do not reduce
    /// the variance due to turbulence.
    pub fn of_pulse(&self, index: usize) -> &[f64] {
        let first = index % self.realisations() * self.layers;
        &self.efficiency[first..first + self.layers]
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
        let layers =
            LayerEfficiency::new(&[100.0, 200.0, 300.0], &[[0.1, 0.3, 0.2]], &line()).unwrap();
        let expected = [0.1, 0.15, 0.2, 0.25, 0.3, 0.275, 0.25, 0.225, 0.2];
        for (found, expected) in layers.of_pulse(0).iter().zip(expected) {
            assert_relative_eq!(*found, expected, max_relative = 1e-14);
        }
    }

    #[test]
    fn each_pulse_has_its_realisation() {
        let layers = LayerEfficiency::new(
            &[50.0, 400.0],
            &[[0.1, 0.1], [0.2, 0.2], [0.6, 0.6]],
            &line(),
        )
        .unwrap();
        assert_eq!(layers.realisations(), 3);
        for (pulse, expected) in [(0, 0.1), (1, 0.2), (2, 0.6), (3, 0.1), (7, 0.2)] {
            assert!(
                layers
                    .of_pulse(pulse)
                    .iter()
                    .all(|e| (e - expected).abs() < 1e-15)
            );
        }
    }

    #[test]
    fn tables_that_are_none_and_layers_beyond_them_are_refused() {
        let make = |range_m: &[f64], realisations: &[&[f64]]| {
            LayerEfficiency::new(range_m, realisations, &line())
        };
        assert!(matches!(make(&[], &[&[]]), Err(Error::Empty { .. })));
        assert!(matches!(make(&[1.0], &[]), Err(Error::Empty { .. })));
        assert!(matches!(
            make(&[1.0], &[&[0.1, 0.2]]),
            Err(Error::LengthMismatch { .. })
        ));
        let negative = make(&[1.0, 2.0], &[&[0.1, -0.2]]);
        assert!(matches!(
            negative,
            Err(Error::ElementOutOfRange {
                field: "efficiency",
                index: 1,
                ..
            })
        ));
        let short = make(&[100.0, 200.0], &[&[0.1, 0.2]]);
        assert!(matches!(short, Err(Error::OutOfRange { value: 225.0, .. })));
    }
}
