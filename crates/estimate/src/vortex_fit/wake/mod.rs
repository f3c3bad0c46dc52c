//! The wake that the lidar looks at, what of it may be fitted, and what gates and regions see of it.

pub(crate) mod core_prior;
pub(crate) mod free_parameters;
pub(crate) mod log_wind;
pub(crate) mod log_wind_prior;
pub(crate) mod mean_circulation;
pub(crate) mod motion;
pub(crate) mod pair;
pub(crate) mod pair_prior;
pub(crate) mod pulse;
pub(crate) mod range_kernel;
pub(crate) mod rolling_moment;
pub(crate) mod wake_map;
