//! What can be wrong with a wind or a simulation: one error type for the crate.

use std::path::PathBuf;

/// Where a velocity component is worth a word.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The component, `"u"`, `"v"` or `"w"`.
    pub component: &'static str,
    /// Cell, indices along x, y, z.
    pub cell: [usize; 3],
    /// Its position \[m\].
    pub position_m: [f64; 3],
}

/// Why a wind could not be built or sampled, or a flow not simulated. Every variant carries the
/// values and what is allowed.
#[non_exhaustive]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A number is outside its range, or is not finite.
    #[error("{field} = {value:?}: must be {allowed}")]
    OutOfRange {
        /// Name of the field or parameter, with its unit suffix.
        field: &'static str,
        /// The value found.
        value: f64,
        /// The values that are allowed, in words.
        allowed: &'static str,
    },
    /// The output slice is not as long as the list of points.
    #[error("{points} points but {out} places for their velocities: the two lengths must be equal")]
    LengthMismatch {
        /// Number of points.
        points: usize,
        /// Length of the output slice.
        out: usize,
    },
    /// A direction of a mesh that cannot be interpolated, or that the schemes of a flow cannot
    /// take.
    #[error("{axis} direction: {what} = {value:?}: must be {allowed}")]
    BadDirection {
        /// `"x"`, `"y"` or `"z"`.
        axis: &'static str,
        /// What is wrong.
        what: String,
        /// The value found.
        value: f64,
        /// The values that are allowed, in words.
        allowed: &'static str,
    },
    /// A simulation has produced values that are not finite.
    #[error(
        "the {field} {} is not finite at step {step} (t = {time_s:?} s), cell {:?}, x, y, z = {:?} m: \
         the time step is too long, the mesh too coarse for the viscosity, or the initial field was not finite",
        place.component, place.cell, place.position_m
    )]
    Diverged {
        /// Which field.
        field: &'static str,
        /// Number of the step that failed.
        step: u64,
        /// Time that it reached \[s\].
        time_s: f64,
        /// The first such place.
        place: Place,
    },
    /// A time step is so long that the scheme would be unstable.
    #[error(
        "step {step} of {step_s:?} s at t = {time_s:?} s has Courant number {courant:?}, above {limit:?}: fastest is {} in cell \
         {:?}, x, y, z = {:?} m; shorten the step or let a Courant number control it",
        place.component, place.cell, place.position_m
    )]
    CourantTooLarge {
        /// Number of the step that was refused.
        step: u64,
        /// Its length \[s\].
        step_s: f64,
        /// Time at which it would begin \[s\].
        time_s: f64,
        /// Its Courant number.
        courant: f64,
        /// Largest allowed.
        limit: f64,
        /// Where a component is fastest.
        place: Place,
    },
    /// A flow has more kinetic energy than it started with and force or moving walls can have given
    /// it.
    #[error(
        "step {step} (t = {time_s:?} s): the kinetic energy has grown to {energy_m5_s2:.6e} m^5/s^2, at most \
         {allowed_m5_s2:.6e} can have come from the start, a force or walls that move; it grows at {rate_per_s:.3e} 1/s, \
         most in {} near cell {:?}, x, y, z = {:?} m: {cause}",
        place.component, place.cell, place.position_m
    )]
    EnergyGrew {
        /// Number of the step.
        step: u64,
        /// Time reached \[s\].
        time_s: f64,
        /// Kinetic energy, integral of `u^2/2` \[m^5/s^2\].
        energy_m5_s2: f64,
        /// The most that the flow may have.
        allowed_m5_s2: f64,
        /// Growth rate of the energy in this step \[1/s\].
        rate_per_s: f64,
        /// Where the shortest waves are strongest.
        place: Box<Place>,
        /// The likeliest cause, and what to do.
        cause: String,
    },
    /// The time step feeds a flow with more energy than viscosity and subgrid model take.
    #[error("step {step} (t = {time_s:?} s): {cause}")]
    StepFeeds {
        /// Number of the step.
        step: u64,
        /// Time reached \[s\].
        time_s: f64,
        /// What the last steps fed over what viscosity and subgrid model took.
        share: f64,
        /// Courant number that suits.
        suited_courant: f64,
        /// What they did, and what to do.
        cause: String,
    },
    /// The system refused to read or write a file.
    #[error("cannot {action} {}: {reason}", path.display())]
    File {
        /// What was tried, such as `"write"`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Class of the refusal, such as a full disk.
        kind: std::io::ErrorKind,
        /// The system's words.
        reason: String,
    },
    /// The file is something else than a checkpoint.
    #[error("{} is not a checkpoint of a flow: its first bytes are others", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// The checkpoint was written by another version of this program, in a form that this one does
    /// not know.
    #[error("{} is a checkpoint of version {found}: this program reads version {supported}", path.display())]
    CheckpointVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The version that can be read.
        supported: u32,
    },
    /// The checkpoint is cut off or altered.
    #[error("{} is damaged: {what}; go back to an older checkpoint", path.display())]
    CheckpointDamaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        what: &'static str,
    },
    /// The checkpoint belongs to another mesh or to settings that do not allow to continue it.
    #[error("{}: {what} is {stored} in the checkpoint, but {wanted} is asked for: they must be equal", path.display())]
    CheckpointMismatch {
        /// The file.
        path: PathBuf,
        /// The property of mesh or settings that differs.
        what: String,
        /// Its value in the checkpoint.
        stored: String,
        /// Its value in the present mesh or settings.
        wanted: String,
    },
    /// Who watches a run has stopped it, such as an output that cannot be written.
    #[error("the run was stopped after step {step} (t = {time_s:?} s): {reason}")]
    Stopped {
        /// Last step made.
        step: u64,
        /// Time reached \[s\].
        time_s: f64,
        /// The observer's words.
        reason: String,
    },
    /// The time step that the Courant number allows has become so short that the run would not end.
    #[error(
        "step {step} at t = {time_s:?} s is {step_s:?} s long, too short to reach {end_s:?} s: the flow is blowing up"
    )]
    StepTooShort {
        /// Number of the step.
        step: u64,
        /// Time reached \[s\].
        time_s: f64,
        /// Length of the step \[s\].
        step_s: f64,
        /// Time at which the run was to end \[s\].
        end_s: f64,
    },
    /// The pressure equation was not solved to the tolerance asked for.
    #[error(
        "the {method} did not reach the tolerance {tolerance:.1e} of the pressure equation: {reason}; \
         relative residuals after each solve: {}",
        history.iter().map(|residual| format!("{residual:.1e}")).collect::<Vec<_>>().join(", ")
    )]
    PressureNotSolved {
        /// Which solver.
        method: &'static str,
        /// Largest relative residual allowed (2-norm).
        tolerance: f64,
        /// Why it went no further.
        reason: PressureFailure,
        /// Iterations of multigrid; 0 of the direct solver.
        iterations: usize,
        /// Relative residual after each solve.
        history: Vec<f64>,
    },
    /// More ranks than a flow can be shared among.
    #[error(
        "{ranks} ranks for a mesh with {planes} planes along its last direction in memory: a rank owns at least 4 of them, so at most \
         {most} ranks are allowed; give each of them more threads instead"
    )]
    TooManyRanks {
        /// Number of ranks.
        ranks: usize,
        /// Planes of the mesh.
        planes: usize,
        /// Largest number of ranks.
        most: usize,
    },
    /// A rank has ended on which this one waited.
    #[error(
        "rank {rank}, which has a part of the flow, has ended: the run cannot go on; restart it from its last checkpoint"
    )]
    RankLost {
        /// The rank.
        rank: usize,
    },
    /// What went wrong on another rank, in its words.
    #[error("{message}")]
    OtherRank {
        /// The rank.
        rank: usize,
        /// Its error.
        message: String,
    },
}

/// Why a pressure solver went no further.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PressureFailure {
    /// The last digit of the solution leaves as much: waves much longer than the cells are high
    /// make it large against its differences.
    #[error(
        "round-off of so large a solution leaves about {attainable:.0e}, so ask for a tolerance above that, or for a \
         mesh that is shorter in units of its finest cell"
    )]
    RoundOff {
        /// Relative residual that round-off of the solution leaves, about.
        attainable: f64,
    },
    /// The iteration no longer reduces the residual.
    #[error(
        "the residual no longer falls; take the direct solver, or a mesh whose cells are less flat"
    )]
    Stalled,
    /// The right side holds a value that is not finite.
    #[error("the right side holds a value that is not finite")]
    NotFinite,
}

/// `value` if it is finite and `accept` holds, else [`Error::OutOfRange`].
pub(crate) fn check(
    field: &'static str,
    value: f64,
    allowed: &'static str,
    accept: impl Fn(f64) -> bool,
) -> Result<(), Error> {
    if value.is_finite() && accept(value) {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            field,
            value,
            allowed,
        })
    }
}

/// Equal lengths of points and outputs, or [`Error::LengthMismatch`].
pub(crate) fn check_lengths(points: usize, out: usize) -> Result<(), Error> {
    if points == out {
        Ok(())
    } else {
        Err(Error::LengthMismatch { points, out })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiny_and_huge_values_are_told_in_few_digits() {
        for (value, text) in [
            (1e-201, "1e-201"),
            (-3e300, "-3e300"),
            (0.5, "0.5"),
            (f64::NAN, "NaN"),
        ] {
            let error = Error::OutOfRange {
                field: "a_m",
                value,
                allowed: "positive",
            };
            assert_eq!(error.to_string(), format!("a_m = {text}: must be positive"));
            let error = Error::BadDirection {
                axis: "y",
                what: "length_m".into(),
                value,
                allowed: "positive",
            };
            assert_eq!(
                error.to_string(),
                format!("y direction: length_m = {text}: must be positive")
            );
        }
    }
}
