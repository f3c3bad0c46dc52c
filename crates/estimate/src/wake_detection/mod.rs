//! Whether a scan holds a wake: a statistic, its law in empty scans, and how often wakes are found.
//!
//! | module | content |
//! |---|---|
//! | `detector` | [`WakeDetector`]: the statistic of a scan with given geometry, noise and background; `bank`: the wakes that are tried |
//! | `law` | [`EmptyScanLaw`]: thresholds for a rate of false alarms, and the rate of a statistic |
//! | `power` | [`DetectionTrials`]: share of wakes that are found, the smallest circulation that is |
//!
//! The rate of false alarms holds for the background that the test assumes, and for no other: the threshold for white noise raises
//! an alarm in nearly every empty scan of turbulent air.

mod bank;
mod detector;
mod law;
mod power;

pub use bank::DetectorOptions;
pub use detector::{WakeDetector, WakeStatistic};
pub use law::EmptyScanLaw;
pub use power::DetectionTrials;
