//! How fast viscosity damps the shortest waves along each direction, along which it is taken
//! implicitly, and how long steps may then be.

use super::mesh::Mesh;
use super::operators_1d::LAPLACIAN_SYMBOL;
use super::settings::FlowSettings;

/// Share of the explicit viscous limit beyond which a direction is taken implicitly.
const IMPLICIT_SHARE: f64 = 0.1;
/// Largest product of a variable step and the second of the decay rates of implicit axes. The
/// factored increments take `(d1 + d2)/((1 + d1/2) (1 + d2/2))` of a wave that is stiff along two
/// axes: a ninth here, less and less beyond.
const STIFF_DECAY: f64 = 64.0;
/// Product of the step and the largest decay rate beyond which Crank-Nicolson turns the sign of the
/// shortest waves for hundreds of steps.
const RINGING_DECAY: f64 = 400.0;
/// The same beyond which the mean of the viscous powers at both ends of a step is not that of the
/// step.
const RESOLVED_DECAY: f64 = 4.0;

/// Lengths of the cells along each direction \[m\].
pub(super) fn metrics(mesh: &Mesh) -> [Vec<f64>; 3] {
    mesh.directions()
        .each_ref()
        .map(|d| (0..d.cells).map(|i| d.at(i as f64 + 0.5).1).collect())
}

/// Largest decay rate of the viscous term along x, y, z \[1/s\]; zero along a direction of one
/// cell.
pub(super) fn viscous_rates_per_s(mesh: &Mesh, viscosity_m2_s: f64) -> [f64; 3] {
    metrics(mesh).map(|metric_m| {
        let least_m = metric_m.iter().copied().fold(f64::INFINITY, f64::min);
        if metric_m.len() > 1 {
            LAPLACIAN_SYMBOL * viscosity_m2_s / least_m.powi(2)
        } else {
            0.0
        }
    })
}

/// Longest steps of a flow in which viscosity is explicit along x, y, z \[s\].
pub(super) fn explicit_up_to_s(mesh: &Mesh, settings: &FlowSettings) -> [f64; 3] {
    let most = IMPLICIT_SHARE * settings.scheme.largest_decay();
    viscous_rates_per_s(mesh, settings.viscosity_m2_s).map(|rate_per_s| most / rate_per_s)
}

/// Along which of x, y, z viscosity is implicit in a flow whose largest `sum |u_i|/h_i` is
/// `courant_per_s` at first.
pub(super) fn implicit_axes(mesh: &Mesh, settings: &FlowSettings, courant_per_s: f64) -> [bool; 3] {
    let step_s = settings.time_step.step_s(courant_per_s);
    explicit_up_to_s(mesh, settings).map(|longest_s| step_s > longest_s)
}

/// The two largest decay rates of viscosity along implicit axes \[1/s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stiffness([f64; 2]);

impl Stiffness {
    /// From the rates along all axes and whether viscosity is implicit there.
    pub(super) fn new(rates_per_s: [f64; 3], implicit: [bool; 3]) -> Self {
        let mut rates_per_s: [f64; 3] =
            std::array::from_fn(|a| if implicit[a] { rates_per_s[a] } else { 0.0 });
        rates_per_s.sort_by(|a, b| b.total_cmp(a));
        Self([rates_per_s[0], rates_per_s[1]])
    }

    /// Longest step in which waves that are short along two axes decay well \[s\].
    pub(super) fn longest_s(self) -> f64 {
        STIFF_DECAY / self.0[1]
    }

    /// Whether the mean of the viscous powers at both ends of a step of `step_s` is that of the
    /// step.
    pub(super) fn is_resolved(self, step_s: f64) -> bool {
        step_s * self.0[0] <= RESOLVED_DECAY
    }

    /// What steps of `step_s` do to the shortest waves, if it is not what viscosity does.
    pub(super) fn note(self, step_s: f64) -> Option<String> {
        let [first, second] = self.0.map(|rate| step_s * rate / LAPLACIAN_SYMBOL);
        if step_s > (1.0 + 1e-9) * self.longest_s() {
            return Some(format!(
                "the step is too long for viscosity along two directions (nu dt/h^2 = {first:.3e} and {second:.3e}): short waves \
                 hardly decay; take steps of at most {:.3e} s",
                self.longest_s()
            ));
        }
        (first * LAPLACIAN_SYMBOL > RINGING_DECAY).then(|| {
            format!(
                "Crank-Nicolson keeps the shortest waves of a sudden start for many steps (nu dt/h^2 = {first:.3e}); steps of at \
                 most {:.3e} s damp them",
                RINGING_DECAY / self.0[0]
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Direction;
    use super::super::settings::{TimeScheme, TimeStep};
    use super::*;

    #[test]
    fn a_direction_is_implicit_beyond_a_tenth_of_the_limit_of_its_scheme() {
        let direction = |cells| Direction::periodic(cells, 0.0, 1.0);
        let mesh = Mesh::new(Direction::thin(1.0), direction(8), direction(32)).unwrap();
        let step_s = 0.01;
        let per_viscosity = viscous_rates_per_s(&mesh, 1.0)[2] * step_s;
        for (scheme, limit) in [
            (TimeScheme::AdamsBashforth2, 1.0),
            (TimeScheme::RungeKutta3, 2.5),
        ] {
            for share in [0.09, 0.11] {
                let viscosity_m2_s = share * limit / per_viscosity;
                let settings = FlowSettings {
                    scheme,
                    ..FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s })
                };
                let implicit = implicit_axes(&mesh, &settings, 0.0);
                assert_eq!(
                    implicit,
                    [false, false, share > 0.1],
                    "{scheme:?} at {share} of its limit"
                );
            }
        }
    }
}
