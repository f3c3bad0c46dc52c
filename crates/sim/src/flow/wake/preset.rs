//! Ready-made cases of wakes.

use super::super::case::{FileFormat, FlowCase, Output, Solver, Subgrid};
use super::super::kind::CaseKind;
use super::case::WakeFlow;
use super::output::WakeOutput;

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
    /// The flow.
    pub fn flow(self) -> WakeFlow {
        match self {
            Self::Coarse => WakeFlow::default(),
            // Case B of the independent reference, the same flow in a wider box.
            Self::Medium => WakeFlow {
                cells: [48, 240, 128],
                size: [1.0, 5.0, 2.5],
                ..WakeFlow::default()
            },
            // Cells about the vortices are a third of a core radius and more.
            Self::Fine => WakeFlow {
                cells: [64, 256, 144],
                size: [1.0, 5.0, 2.5],
                ground_stretch: 2.0,
                lateral_stretch: 0.45,
                core_radius: 0.05,
                reynolds: 2e4,
                ..WakeFlow::default()
            },
            Self::Chapter => WakeFlow {
                cells: [128, 432, 224],
                size: [2.0, 6.0, 3.0],
                ground_stretch: 2.2,
                ..Self::Fine.flow()
            },
        }
    }

    /// The case with all that is written.
    pub fn case(self) -> FlowCase {
        let subgrid = match self {
            Self::Coarse | Self::Medium => Subgrid::None {},
            Self::Fine | Self::Chapter => Subgrid::MultiscaleWale {
                constant: None,
                order: None,
            },
        };
        FlowCase {
            case: CaseKind::Wake(Box::new(self.flow())),
            solver: Solver {
                subgrid,
                ..Solver::default()
            },
            output: Output {
                fields: vec![FileFormat::Netcdf],
                ..Output::default()
            },
            wake: Some(WakeOutput::default()),
            ..FlowCase::default()
        }
    }
}
