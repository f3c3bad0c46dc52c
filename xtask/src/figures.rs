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
mod fig13_14;
mod fig15;
mod fig16;
mod fig17;
pub(crate) mod fig17_flows;
mod fig18;
mod fig19;
mod fig22;
mod fig23;
mod fig25;
mod fig26;
mod profiles;
mod study;
mod tab01;
mod tab02;

use crate::claim::LIST;
use context::{Context, Rendered};
use fixtures::failure::Failure;

/// A figure that can be asked for.
pub(crate) struct Figure {
    pub(crate) id: &'static str,
    pub(crate) number: u32,
    pub(crate) title: &'static str,
    /// Processor time with the profile quick, about, on a slow core \[s\].
    pub(crate) quick_core_s: f64,
    /// The row of panels that its thumbnail shows, from the top, from 0, and the number of rows, which have equal heights.
    pub(crate) row: (u32, u32),
    pub(crate) make: Make,
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
    /// The figure with a row of panels as its thumbnail, the index from 0.
    const fn with_row(self, index: u32, count: u32) -> Self {
        Self {
            row: (index, count),
            ..self
        }
    }

    /// What it is, with the number by which `--only` selects it.
    pub(crate) fn numbered(&self) -> String {
        let kind = if self.id.starts_with("tab") {
            "Table"
        } else {
            "Figure"
        };
        format!("{kind} {}", self.number)
    }

    /// Number and title.
    pub(crate) fn heading(&self) -> String {
        format!("{}: {}", self.numbered(), self.title)
    }

    /// The words of its caption with the values of a run.
    pub(crate) fn caption(&self, values: &[String]) -> Result<String, Failure> {
        let caption = LIST
            .caption
            .get(self.id)
            .and_then(|words| filled(words, values));
        caption.ok_or_else(|| {
            Failure::new(format!(
                "no caption of {} with {} values",
                self.id,
                values.len()
            ))
        })
    }

    pub(crate) fn lane(&self) -> Lane {
        match self.number {
            6..=14 | 17 | 25 => Lane::Wake,
            15 | 26 => Lane::Alone,
            _ => Lane::Formula,
        }
    }
}

/// A text with values in the places of its braces; nothing unless there are as many.
pub(crate) fn filled(text: &str, values: &[String]) -> Option<String> {
    let parts: Vec<&str> = text.split("{}").collect();
    let between = values.iter().map(String::as_str).chain([""]);
    let all = parts
        .iter()
        .zip(between)
        .flat_map(|(part, value)| [part, value])
        .collect();
    (parts.len() == values.len() + 1).then_some(all)
}

type Make = fn(&Context) -> Result<Rendered, Failure>;

const fn figure(
    id: &'static str,
    number: u32,
    title: &'static str,
    quick_core_s: f64,
    make: Make,
) -> Figure {
    Figure {
        id,
        number,
        title,
        quick_core_s,
        row: (0, 1),
        make,
    }
}

/// All figures, in the order of the report.
pub(crate) const ALL: [Figure; 24] = [
    figure(
        "fig01",
        1,
        "Vertical velocity through the cores of the pair",
        0.1,
        fig01::make,
    ),
    figure(
        "tab01",
        1,
        "ICAO separations behind a landing aircraft",
        0.1,
        tab01::make,
    ),
    figure(
        "tab02",
        2,
        "Lidar parameters as read back from the scene that was run",
        0.1,
        tab02::make,
    ),
    figure(
        "fig03",
        3,
        "Scan pattern across the runway",
        0.1,
        fig03::make,
    ),
    figure(
        "fig04",
        4,
        "Signal-to-noise ratio and system efficiency",
        8.5,
        fig04::make,
    ),
    figure(
        "fig05",
        5,
        "M'4 stencil on a line of sight",
        0.1,
        fig05::make,
    ),
    figure("fig06", 6, "Surfaces of equal vorticity", 22.0, fig06::make).with_row(0, 2),
    figure(
        "fig07",
        7,
        "Circulation and paths of the vortices",
        0.1,
        fig07::make,
    ),
    figure(
        "fig08",
        8,
        "Radial velocity of the wake, early and late",
        2.5,
        fig08::make,
    ),
    figure(
        "fig09",
        9,
        "Accumulation level against range",
        0.1,
        fig09::make,
    ),
    figure(
        "fig10",
        10,
        "Estimation error and gradient",
        4.0,
        fig10::make,
    )
    .with_row(2, 3),
    figure("fig11", 11, "Estimated map, late, 400 ns", 5.0, fig11::make).with_row(3, 5),
    figure("fig12", 12, "Error against pulse energy", 10.0, fig12::make).with_row(1, 2),
    figure(
        "fig13",
        13,
        "Correlogram against periodogram accumulation",
        13.0,
        fig13_14::make_13,
    )
    .with_row(2, 4),
    figure(
        "fig14",
        14,
        "Both accumulations in weak turbulence",
        10.0,
        fig13_14::make_14,
    )
    .with_row(1, 2),
    figure("fig15", 15, "Error against run time", 14.0, fig15::make).with_row(0, 3),
    figure("fig16", 16, "Stiff and extreme cases", 20.0, fig16::make).with_row(0, 6),
    figure(
        "fig17",
        17,
        "Circulation and positions from single scans",
        15.0,
        fig17::make,
    )
    .with_row(0, 4),
    figure(
        "fig18",
        18,
        "Velocity estimators against the Cramer-Rao bound",
        5.0,
        fig18::make,
    )
    .with_row(0, 3),
    figure("fig19", 19, "Detection of wakes", 10.5, fig19::make),
    figure("fig22", 22, "Circulation in turbulence", 12.0, fig22::make),
    figure(
        "fig23",
        23,
        "Turbulence and wind, put in and found",
        12.0,
        fig23::make,
    )
    .with_row(0, 2),
    figure(
        "fig25",
        25,
        "Where correlogram accumulation errs less, and where more",
        14.0,
        fig25::make,
    )
    .with_row(0, 3),
    figure(
        "fig26",
        26,
        "Run time against pulses a line",
        10.0,
        fig26::make,
    )
    .with_row(0, 2),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_a_caption_of_its_own() {
        let captions = &LIST.caption;
        let ids: Vec<&str> = ALL.iter().map(|figure| figure.id).collect();
        assert!(
            captions.keys().all(|id| ids.contains(&id.as_str())) && captions.len() == ids.len()
        );
        assert_eq!(
            ALL[3]
                .caption(&["3", "1.25", "8"].map(String::from))
                .unwrap()
                .matches(" 1.25 mrad;")
                .count(),
            1
        );
        assert!(ALL[3].caption(&[]).is_err());
    }
}
