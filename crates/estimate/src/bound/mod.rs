//! The Cramer-Rao bound: covariances of windows and the information in them.

mod extended;
mod record;
pub(crate) mod window_model;

pub use record::RecordModel;
pub use window_model::{Noise, WindowModel, bound_m_s};
