//! PA: the mean periodogram of all windows of a region (Table 3).

use super::EstimationMethod;
use crate::keys::keys;

keys! {
    /// PA: mean periodogram of all windows of the region (Table 3).
    table PeriodogramAccumulation {}
}

impl EstimationMethod for PeriodogramAccumulation {}
