//! How much a task computes.

/// Resolution and sample counts of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub(crate) enum Profile {
    /// Minutes: every component, coarse meshes and small samples; most bars of flows are then wider.
    Quick,
    /// Tens of minutes: finer meshes and more samples.
    Standard,
    /// The chapter's own numbers.
    Full,
}

impl Profile {
    pub(crate) fn name(self) -> &'static str {
        self.choose("quick", "standard", "full")
    }

    /// One of three values.
    pub(crate) fn choose<T>(self, quick: T, standard: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Standard => standard,
            Self::Full => full,
        }
    }
}
