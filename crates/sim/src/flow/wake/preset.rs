//! Ready-made cases of wakes.

use super::super::case::{Checkpoint, FORMAT, FileFormat, FlowCase, Output, Solver, Subgrid, Time};
use super::super::kind::CaseKind;
use super::case::WakeFlow;
use super::output::WakeOutput;
use wakescope_les::SubgridModel;
use wakescope_les::cases::VortexPairCase;

/// Ready-made wakes, from the quickest to the dearest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum WakePreset {
    /// 24 x 128 x 80 cells, `Re_Gamma` 5000, no subgrid model: minutes.
    Coarse,
    /// 48 x 240 x 128 cells, `Re_Gamma` 5000, no subgrid model: some twenty minutes of one core.
    Medium,
    /// `Re_Gamma` 20000, core 0.05 `b0`, multiscale model, 64 x 256 x 144 cells: two hours of one core.
    Fine,
    /// The same flow with walls resolved, 128 x 432 x 224 cells: a day of one core.
    Chapter,
}

impl WakePreset {
    /// The case as the solver has it.
    pub fn pair(self) -> VortexPairCase {
        match self {
            Self::Coarse => VortexPairCase::coarse(),
            Self::Medium => VortexPairCase::medium(),
            Self::Fine => VortexPairCase::fine(),
            Self::Chapter => VortexPairCase::chapter(),
        }
    }

    /// The case with all that is written.
    pub fn case(self) -> FlowCase {
        let pair = self.pair();
        let multiscale = pair.subgrid == SubgridModel::MULTISCALE_WALE;
        let subgrid =
            if multiscale { Subgrid::MultiscaleWale { constant: None, order: None } } else { Subgrid::None {} };
        let format = FileFormat::Netcdf;
        let flow = WakeFlow {
            cells: pair.cells,
            size: pair.size,
            ground_stretch: pair.ground_stretch,
            lateral_stretch: pair.lateral_stretch,
            height: pair.height,
            core_radius: pair.core_radius,
            reynolds: pair.reynolds,
            perturbation: pair.perturbation,
            ..WakeFlow::default()
        };
        FlowCase {
            format: FORMAT,
            case: CaseKind::Wake(Box::new(flow)),
            time: Time::default(),
            solver: Solver { subgrid, ..Solver::default() },
            output: Output { fields: vec![format], planes: vec![format], ..Output::default() },
            checkpoint: Checkpoint::default(),
            wake: Some(WakeOutput::default()),
        }
    }
}
