//! What the comparison of a flow with its reference gives.

use crate::claim::Claim;
use wakescope_sim::io::Table;
use wakescope_sim::plot::Figure;

/// What a case shows.
pub(crate) struct Shown {
    pub(crate) checks: Vec<Claim>,
    pub(crate) table: Table,
    pub(crate) figure: Figure,
}
