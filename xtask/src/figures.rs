//! The figures: one file each, and what they have in common.
//!
//! A figure is a function from a [`Context`] to the files it writes and the claims it measures.

pub(crate) mod context;
mod fig01;
mod fig03;
mod fig04;
mod fig05;
mod fig06;
mod fig07;
mod fig08;
mod fig09;
mod fig10;
mod fig11;
mod fig12;
mod fig13;
mod fig14;
mod fig15;
mod fig16;
mod fig17;
mod fig17_flows;
mod fig18;
mod fig19;
mod fig20;
mod fig21;
mod fig25;
mod profiles;
mod study;
mod tab01;
mod tab02;

use context::{Context, Rendered};
use fixtures::failure::Failure;

/// A figure that can be asked for.
pub(crate) struct Figure {
    pub(crate) id: &'static str,
    pub(crate) number: u32,
    pub(crate) title: &'static str,
    pub(crate) make: fn(&Context) -> Result<Rendered, Failure>,
}

/// Which figures are drawn one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Those of the simulated wake, which the first of them may have to run.
    Wake,
    /// Those that do not look at it.
    Formula,
    /// Those that measure times, and need the machine for themselves.
    Alone,
}

impl Figure {
    /// Its own number, by which `--only` asks for it, and what it is called.
    pub(crate) fn heading(&self) -> String {
        let kind = if self.id.starts_with("tab") { "Table" } else { "Figure" };
        format!("{kind} {}: {}", self.number, self.title)
    }

    pub(crate) fn lane(&self) -> Lane {
        match self.number {
            6..=14 | 17 | 25 => Lane::Wake,
            15 => Lane::Alone,
            _ => Lane::Formula,
        }
    }
}

/// All figures, in the order of the report.
pub(crate) const ALL: [Figure; 23] = [
    Figure { id: "fig01", number: 1, title: "Vertical velocity through the cores of the pair", make: fig01::make },
    Figure { id: "tab01", number: 1, title: "ICAO separations behind a landing aircraft", make: tab01::make },
    Figure {
        id: "tab02",
        number: 2,
        title: "Lidar parameters as read back from the scene that was run",
        make: tab02::make,
    },
    Figure { id: "fig03", number: 3, title: "Scan pattern across the runway", make: fig03::make },
    Figure { id: "fig04", number: 4, title: "Signal-to-noise ratio and system efficiency", make: fig04::make },
    Figure { id: "fig05", number: 5, title: "M'4 stencil on a line of sight", make: fig05::make },
    Figure { id: "fig06", number: 6, title: "Surfaces of equal vorticity", make: fig06::make },
    Figure { id: "fig07", number: 7, title: "Circulation and paths of the vortices", make: fig07::make },
    Figure { id: "fig08", number: 8, title: "Radial velocity of the wake, early and late", make: fig08::make },
    Figure { id: "fig09", number: 9, title: "Accumulation level against range", make: fig09::make },
    Figure { id: "fig10", number: 10, title: "Estimation error and gradient", make: fig10::make },
    Figure { id: "fig11", number: 11, title: "Estimated map, late, 400 ns", make: fig11::make },
    Figure { id: "fig12", number: 12, title: "Error against pulse energy", make: fig12::make },
    Figure { id: "fig13", number: 13, title: "Correlogram against periodogram accumulation", make: fig13::make },
    Figure { id: "fig14", number: 14, title: "The same at 200 and 400 ns about the centre", make: fig14::make },
    Figure { id: "fig15", number: 15, title: "Error against run time", make: fig15::make },
    Figure { id: "fig16", number: 16, title: "Stiff and extreme cases", make: fig16::make },
    Figure { id: "fig17", number: 17, title: "Circulation and positions from single scans", make: fig17::make },
    Figure { id: "fig18", number: 18, title: "Velocity estimators against the Cramer-Rao bound", make: fig18::make },
    Figure { id: "fig19", number: 19, title: "Detection of wakes", make: fig19::make },
    Figure { id: "fig20", number: 20, title: "Map, model and residual of one scan", make: fig20::make },
    Figure { id: "fig21", number: 21, title: "One wake across, round and along the flight", make: fig21::make },
    Figure { id: "fig25", number: 25, title: "Where correlogram accumulation errs less", make: fig25::make },
];
