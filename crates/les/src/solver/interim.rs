//! The pressure solver under the name that the time step knows.

pub(crate) use super::pressure::build;
