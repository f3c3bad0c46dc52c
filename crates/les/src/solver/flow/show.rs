//! The whole flow on one rank, for those who look at it there.

use std::sync::Arc;

use super::Flow;
use crate::Error;
use crate::ranks::Single;
use crate::solver::settings::FlowSettings;

impl Flow {
    /// Brings the whole flow, which rank 0 alone has, up to date; without `fields` only its times and sums. In one process it
    /// is the flow itself.
    ///
    /// # Errors
    /// Those of the exchange between ranks.
    pub(in super::super) fn show(&self, whole: &mut Option<Self>, fields: bool) -> Result<(), Error> {
        let slabs = &self.layout.slabs;
        if slabs.is_alone() {
            return Ok(());
        }
        if slabs.is_first() && whole.is_none() {
            let settings = FlowSettings { ranks: Arc::new(Single), ..self.settings.clone() };
            *whole = Some(Self::at_rest(self.mesh.clone(), settings)?);
        }
        if let Some(Self { state: whole, .. }) = whole {
            let state = &self.state;
            (whole.time_s, whole.step, whole.last_step_s) = (state.time_s, state.step, state.last_step_s);
            (whole.courant_per_s, whole.energy, whole.implicit) = (state.courant_per_s, state.energy, state.implicit);
        }
        if !fields {
            return Ok(());
        }
        let velocity = self.state.velocity.iter().zip(0..);
        for (field, axis) in velocity.chain([(&self.state.pressure, 3)]) {
            let field = slabs.whole(field, false)?;
            if let Some(Self { state, .. }) = whole {
                *state.velocity.get_mut(axis).unwrap_or(&mut state.pressure) = field.into_owned();
            }
        }
        if let Some(model) = &self.model {
            let viscosity_m2_s = slabs.whole(model.viscosity_m2_s(), false)?;
            if let Some(whole) = whole.as_mut().and_then(|whole| whole.model.as_mut()) {
                whole.set_viscosity(viscosity_m2_s.into_owned());
            }
        }
        Ok(())
    }

    /// What rank 0 sees: the flow itself in one process, else the whole flow. Other ranks see nothing.
    pub(in super::super) fn seen<'a>(&'a self, whole: &'a Option<Self>) -> Option<&'a Self> {
        if self.layout.slabs.is_alone() { Some(self) } else { whole.as_ref() }
    }
}
