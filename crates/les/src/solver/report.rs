//! What a step and the start of a flow report.

/// Work done on the fluid per time by viscosity, the subgrid stress and the force \[m^5/s^3\].
pub(crate) type Powers = [f64; 3];

/// What one step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// Number of the step, from 1.
    pub step: u64,
    /// Time after the step \[s\].
    pub time_s: f64,
    /// Length of the step \[s\].
    pub step_s: f64,
    /// Courant number `dt max sum |u_i|/h_i` of the field that the step started from.
    pub courant: f64,
    /// Kinetic energy after the step, integral of `u^2/2` \[m^5/s^2\].
    pub kinetic_energy_m5_s2: f64,
    /// Power of the viscous term at the start of the step, negative where it dissipates
    /// \[m^5/s^3\].
    pub viscous_power_m5_s3: f64,
    /// Power of the subgrid stress at the start of the step \[m^5/s^3\].
    pub subgrid_power_m5_s3: f64,
    /// Power of the body force at the start of the step \[m^5/s^3\].
    pub force_power_m5_s3: f64,
    /// Largest subgrid viscosity \[m^2/s\].
    pub subgrid_viscosity_m2_s: f64,
    /// Step times the largest decay rate of the shortest waves by the subgrid viscosity; where it
    /// is above 0.8 (2.0 with Runge-Kutta, less what explicit viscosity takes) the subgrid
    /// viscosity was cut.
    pub subgrid_decay: f64,
    /// Iterations of the last pressure solve; 0 of the direct solver.
    pub pressure_iterations: usize,
    /// Residual of the last pressure solve, 2-norm, relative to its right side.
    pub pressure_residual: Option<f64>,
    /// Mean reduction of the residual per iteration.
    pub pressure_factor: Option<f64>,
}
