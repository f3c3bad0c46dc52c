//! Conditions of one pulse: a line of sight, and the heterodyne efficiency in the turbulence
//! of that moment.
//!
//! Check: a factor of one changes nothing; a factor scales the mean power of its layer.

use crate::error::{check_amounts, check_length};
use crate::{Error, LineOfSight};

/// One pulse along a line of sight.
///
/// A `&LineOfSight` converts into a shot without a factor of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot<'a> {
    /// The air; it may be shared by many pulses.
    pub line: &'a LineOfSight,
    /// Factor of the return of each layer for this pulse, finite and not negative: the heterodyne
    /// efficiency of this moment if the line's weights leave it out, or its ratio to the mean if
    /// they contain the mean. `None`: the line's weights as they are.
    pub efficiency: Option<&'a [f64]>,
    /// The air that the previous pulse lights at the same time, for its second-trip echo: what lies
    /// at `R + c/(2 PRF)` is at `R` of this line. `None`: no second-trip echo.
    pub previous: Option<&'a LineOfSight>,
    /// Seed of what is random beside speckle and noise: phases of the laser and of the telescope's
    /// reflex, speckle of `previous`. Not used where the receiver has none of them.
    pub impairment_seed: u64,
}

impl<'a> From<&'a LineOfSight> for Shot<'a> {
    fn from(line: &'a LineOfSight) -> Self {
        Self {
            line,
            efficiency: None,
            previous: None,
            impairment_seed: 0,
        }
    }
}

impl Shot<'_> {
    /// Checks the shot.
    ///
    /// # Errors
    /// As [`LineOfSight::validate`]; [`Error::LengthMismatch`] if there is not one factor per
    /// layer; [`Error::ElementOutOfRange`] for a factor that is negative or not finite.
    pub fn validate(&self) -> Result<(), Error> {
        self.line.validate()?;
        self.previous.map_or(Ok(()), LineOfSight::validate)?;
        let Some(efficiency) = self.efficiency else {
            return Ok(());
        };
        check_length("efficiency", efficiency.len(), self.line.layers())?;
        check_amounts("efficiency", efficiency)
    }

    /// Return of a layer per metre of range for this pulse \[1/m\].
    pub(crate) fn weight_per_m(&self, layer: usize) -> f64 {
        self.line.weight_per_m[layer] * self.efficiency.map_or(1.0, |efficiency| efficiency[layer])
    }
}
