//! Waves that Adams-Bashforth lets grow, and where a flow's shortest waves are strongest.
//!
//! A wave that turns by the angle `w dt` in a step grows by about `(w dt)^4/4` under Adams-Bashforth, while viscosity takes
//! `nu k^2 dt`. With `w dt = C k'` and `k = kappa/h` (`C` the Courant number, `k'` and `kappa` the symbols of transport and
//! gradient per cell) all waves decay where the cell's Reynolds number `S h^2/nu`, `S = sum |u_i|/h_i`, stays below a limit that
//! falls with `C^3`. It follows from the roots of the scheme: 30 at a Courant number of 0.35 in boxes without no-slip walls, 82
//! with them, whose transport is of lower order. Explicit viscosity, which is as accurate, damps a little more.
//!
//! Check: a wave carried by a uniform stream grows above that number and decays below it.

use std::f64::consts::PI;

use num_complex::Complex;
use rayon::prelude::*;

use super::flow::Flow;
use super::mesh::{Mesh, Wall};
use super::settings::{FlowSettings, TimeScheme, TimeStep};
use super::subgrid::SubgridModel;
use crate::Error;

/// Transport by a uniform stream per cell and Courant number, `sum_m c_m sin(m theta)`, of boxes without no-slip walls and of
/// those with them.
const TRANSPORT: [[f64; 3]; 2] = [[1.5, -0.3, 1.0 / 30.0], [9.0 / 8.0, 0.0, -1.0 / 24.0]];
/// Waves that are tried, from two cells to infinity.
const WAVES: usize = 90;
/// Halvings of an interval that find a limit.
const HALVINGS: usize = 40;

/// Waves of the mesh that grow because the time scheme gives them more than viscosity takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UndampedGrowth {
    /// Largest `h^2 sum |u_i|/h_i/nu`, weighted with the local Courant number; infinite without viscosity.
    pub cell_reynolds: f64,
    /// Up to which every wave decays.
    pub limit: f64,
    /// Courant number of the steps.
    pub courant: f64,
    /// Rate at which the amplitude of the worst wave grows \[1/s\].
    pub rate_per_s: f64,
    transport: [f64; 3],
}

impl UndampedGrowth {
    /// What grows in a flow of `settings` on `mesh`, whose velocity in the cell of the indices along x, y, z is
    /// `velocity_m_s`. `None` where nothing does: Runge-Kutta damps all waves within its Courant number, a subgrid model is
    /// taken to do its work, and viscosity may suffice.
    pub fn of(
        mesh: &Mesh,
        settings: &FlowSettings,
        velocity_m_s: impl Fn([usize; 3]) -> [f64; 3] + Sync,
    ) -> Option<Self> {
        if is_damped(settings) { None } else { Self::at_rates(mesh, settings, largest_rates(mesh, velocity_m_s)) }
    }

    /// The same from the largest of [`Rates::of`].
    fn at_rates(mesh: &Mesh, settings: &FlowSettings, [courant_per_s, worst]: [f64; 2]) -> Option<Self> {
        let step_s = match settings.time_step {
            TimeStep::Fixed { step_s } => step_s,
            TimeStep::Courant { courant, longest_s } => longest_s.min(courant / courant_per_s),
        };
        let courant = step_s * courant_per_s;
        if courant == 0.0 || !courant.is_finite() {
            return None;
        }
        let sticks = mesh.directions().iter().any(|d| d.ends.no_slip() != [false; 2]);
        let transport = TRANSPORT[usize::from(sticks)];
        let cell_reynolds = worst / (courant_per_s.powi(3) * settings.viscosity_m2_s);
        let rate_per_s = largest_growth(transport, courant, courant / cell_reynolds) / step_s;
        let limit = largest_reynolds(transport, courant);
        (cell_reynolds > limit).then_some(Self { cell_reynolds, limit, courant, rate_per_s, transport })
    }

    /// Courant number at which every wave decays; zero without viscosity.
    pub fn damped_courant(&self) -> f64 {
        halve(0.0, self.courant, |courant| largest_reynolds(self.transport, courant) > self.cell_reynolds)
    }
}

/// Whether the scheme or a model damps all waves.
fn is_damped(settings: &FlowSettings) -> bool {
    settings.scheme != TimeScheme::AdamsBashforth2 || settings.subgrid != SubgridModel::None
}

impl Mesh {
    /// Largest `sum |u_i|/h_i` of a flow whose velocity in the cell of the indices along x, y, z is `velocity_m_s`, walls that
    /// move included \[1/s\]: a Courant number over it is a time step.
    pub fn courant_rate_per_s(&self, velocity_m_s: impl Fn([usize; 3]) -> [f64; 3] + Sync) -> f64 {
        largest_rates(self, velocity_m_s)[0]
    }
}

/// The largest of [`Rates::of`] over all cells and walls.
fn largest_rates(mesh: &Mesh, velocity_m_s: impl Fn([usize; 3]) -> [f64; 3] + Sync) -> [f64; 2] {
    let rates = Rates::new(mesh);
    let [nx, ny, nz] = mesh.cells();
    let plane = |k: usize| {
        (0..nx * ny).fold([0.0_f64; 2], |worst, at| {
            let cell = [at % nx, at / nx, k];
            larger(worst, rates.of(cell, velocity_m_s(cell)))
        })
    };
    let inside = (0..nz).into_par_iter().map(plane).reduce(|| [0.0; 2], larger);
    larger(inside, rates.of_walls(mesh))
}

/// The end of the low part of an interval, in which `holds`.
fn halve(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Reynolds number of a cell up to which every wave decays.
fn largest_reynolds(transport: [f64; 3], courant: f64) -> f64 {
    // In powers of ten: the limit spans many.
    10.0_f64.powf(halve(-2.0, 12.0, |power| largest_growth(transport, courant, courant / 10.0_f64.powf(power)) < 0.0))
}

/// Largest growth of a wave in a step, `ln |G|`, with viscosity by Crank-Nicolson and `viscous = nu dt/h^2`.
fn largest_growth(transport: [f64; 3], courant: f64, viscous: f64) -> f64 {
    let growth = |wave: usize| {
        let theta = PI * wave as f64 / WAVES as f64;
        let symbol = (1..=3).map(|m| transport[m - 1] * (m as f64 * theta).sin()).sum::<f64>();
        let kappa = 2.0 * (9.0 / 8.0 * (0.5 * theta).sin() - (1.5 * theta).sin() / 24.0);
        let half = 0.5 * viscous * kappa * kappa;
        // G^2 - (a + 3/2 z) G + z/2 = 0.
        let (a, z) = ((1.0 - half) / (1.0 + half), Complex::new(0.0, courant * symbol / (1.0 + half)));
        let b = a + 1.5 * z;
        let root = (b * b - 2.0 * z).sqrt();
        (0.5 * (b + root)).norm().max((0.5 * (b - root)).norm()).ln()
    };
    (1..=WAVES).map(growth).fold(f64::NEG_INFINITY, f64::max)
}

/// The larger of two, one by one.
fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}

/// Metrics of the cells, for the rates at which their flow carries waves.
struct Rates {
    metric_m: [Vec<f64>; 3],
}

impl Rates {
    fn new(mesh: &Mesh) -> Self {
        let metric = |d: &super::mesh::Direction| (0..d.cells).map(|i| d.at(i as f64 + 0.5).1).collect();
        Self { metric_m: mesh.directions().each_ref().map(metric) }
    }

    /// `S = sum |u_i|/h_i` \[1/s\], and `S^4 h^2`, `h` the cell's length along the largest term: what Adams-Bashforth gives a
    /// wave of the cell over what viscosity takes, but for factors that all cells have in common.
    fn of(&self, cell: [usize; 3], velocity_m_s: [f64; 3]) -> [f64; 2] {
        let (mut sum, mut most, mut length_m) = (0.0, 0.0, 0.0);
        for d in 0..3 {
            if self.metric_m[d].len() == 1 {
                continue;
            }
            let h = self.metric_m[d][cell[d]];
            let rate = velocity_m_s[d].abs() / h;
            sum += rate;
            if rate > most {
                (most, length_m) = (rate, h);
            }
        }
        [sum, sum.powi(4) * length_m * length_m]
    }

    /// The same of walls that move, on the smallest cells: the fluid may come to their speed.
    fn of_walls(&self, mesh: &Mesh) -> [f64; 2] {
        let smallest =
            self.metric_m.each_ref().map(|m| (0..m.len()).min_by(|&a, &b| m[a].total_cmp(&m[b])).unwrap_or(0));
        mesh.directions().iter().flat_map(|d| d.ends.walls()).fold([0.0; 2], |worst, wall| match wall {
            Wall::Slip => worst,
            Wall::NoSlip { velocity_m_s } => larger(worst, self.of(smallest, velocity_m_s)),
        })
    }
}

impl Flow {
    /// Waves of the present field that Adams-Bashforth lets grow, if any.
    pub fn undamped_growth(&self) -> Option<UndampedGrowth> {
        if is_damped(&self.settings) {
            return None;
        }
        let shape = self.layout.shape;
        let axis = [0, 1, 2].map(|d| self.layout.axis_of(d));
        let (own, direction, velocity) = (shape.own(), self.layout.direction, &self.state.velocity);
        let rates = largest_rates(&self.mesh, |cell| {
            let index = direction.map(|d| cell[d]);
            // What others own is at rest here and does not count.
            let place = own.contains(&index[2]).then(|| shape.place(index));
            place.map_or([0.0; 3], |place| axis.map(|a| velocity[a][place]))
        });
        // If a rank is lost, the next step says so.
        let rates = self.layout.slabs.largest(rates).ok()?;
        UndampedGrowth::at_rates(&self.mesh, &self.settings, rates)
    }

    /// Memory axis and place of the component whose waves of two cells are strongest: where numerical growth shows most.
    pub(super) fn strongest_short_wave(&self) -> Result<(usize, usize), Error> {
        let shape = self.layout.shape;
        let n = shape.n;
        let first = shape.own().start * shape.plane();
        let (_, component, place) = self.first_largest(|component, place| {
            let index = shape.index(place - shape.own_places().start + first);
            let field = &self.state.velocity[component];
            let of = |axis: usize| {
                let at_end = index[axis] == 0 || index[axis] + 1 == n[axis];
                if n[axis] <= 2 || (at_end && !self.layout.line[axis].is_periodic()) {
                    return 0.0;
                }
                let at = |offset: usize| {
                    let mut other = index;
                    other[axis] = (index[axis] + n[axis] + offset - 1) % n[axis];
                    field[shape.place(other)]
                };
                (at(0) - 2.0 * at(1) + at(2)).abs()
            };
            of(0).max(of(1)).max(of(2))
        })?;
        Ok((component, place))
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Direction;
    use super::super::settings::ViscousTreatment;
    use super::*;

    /// Growth of the energy of a wave of the mesh per second, carried by a stream of 1 m/s on cells of 1 m.
    fn measured_per_s(cells_per_wave: f64, viscosity_m2_s: f64, courant: f64) -> (f64, Option<UndampedGrowth>) {
        let mesh = || {
            let y = Direction::periodic(40, 0.0, 40.0);
            Mesh::new(Direction::thin(1.0), y, Direction::periodic(4, 0.0, 4.0)).unwrap()
        };
        let mut settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s: courant });
        settings.viscous = ViscousTreatment::Implicit([false, true, true]);
        let wave = std::f64::consts::TAU / cells_per_wave;
        let (mut flow, _) = Flow::new(mesh(), settings, |[_, y, _]| [1e-3 * (wave * y).cos(), 1.0, 0.0]).unwrap();
        let growth = flow.undamped_growth();
        let energy = |flow: &Flow| flow.face_velocity_m_s(0).iter().map(|u| u * u).sum::<f64>();
        // The spurious root of the scheme dies out first.
        for _ in 0..20 {
            flow.step().unwrap();
        }
        let (start, steps) = (energy(&flow), 100);
        for _ in 0..steps {
            flow.step().unwrap();
        }
        ((energy(&flow) / start).ln() / (f64::from(steps) * courant), growth)
    }

    #[test]
    fn a_wave_grows_above_the_cells_reynolds_number_and_decays_below_it() {
        let waves = [2.5, 40.0 / 12.0, 40.0 / 11.0, 4.0, 8.0, 20.0];
        for (courant, factor) in [(0.2, 0.88), (0.35, 0.66)] {
            let limit = largest_reynolds(TRANSPORT[0], courant);
            // The leading order of the growth gives 4/(2.047 C^3).
            assert!((limit * 2.047 * courant.powi(3) / 4.0 - factor).abs() < 0.02, "{limit}");
            let all = |reynolds: f64| waves.map(|cells| measured_per_s(cells, 1.0 / reynolds, courant));
            let above = all(1.15 * limit);
            assert!(above.iter().any(|(grown, _)| *grown > 0.0), "{above:?}");
            let found = above[0].1.unwrap();
            assert!((found.cell_reynolds / limit - 1.15).abs() < 1e-9 && (found.limit / limit - 1.0).abs() < 1e-6);
            let damped = found.damped_courant();
            assert!((largest_reynolds(TRANSPORT[0], damped) / found.cell_reynolds - 1.0).abs() < 1e-6, "{damped}");
            let below = all(0.85 * limit);
            assert!(below.iter().all(|(grown, found)| *grown < 0.0 && found.is_none()), "{below:?}");
        }
        assert!((largest_reynolds(TRANSPORT[1], 0.35) / 82.0 - 1.0).abs() < 0.01);
        // Without viscosity; the rate of the amplitude is half that of the energy, and the worst wave has 3.2 cells.
        let (grown, found) = measured_per_s(40.0 / 13.0, 0.0, 0.35);
        let found = found.unwrap();
        assert!(found.cell_reynolds.is_infinite() && found.damped_courant() < 0.01, "{found:?}");
        assert!((0.5 * grown / found.rate_per_s - 0.963).abs() < 0.01, "{grown}, {found:?}");
    }

    #[test]
    fn runge_kutta_models_and_flows_without_convection_have_nothing_to_damp() {
        let y = Direction::periodic(8, 0.0, 8.0);
        let mesh = Mesh::new(Direction::thin(1.0), y.clone(), y).unwrap();
        let settings = FlowSettings::new(0.0, TimeStep::Fixed { step_s: 0.3 });
        let of = |settings: &FlowSettings, u: [f64; 3]| UndampedGrowth::of(&mesh, settings, |_| u);
        assert!(of(&settings, [0.0, 1.0, 0.0]).is_some());
        assert!(of(&settings, [5.0, 0.0, 0.0]).is_none(), "nothing varies along x");
        assert!(of(&FlowSettings { scheme: TimeScheme::RungeKutta3, ..settings.clone() }, [0.0, 1.0, 0.0]).is_none());
        assert!(of(&FlowSettings { subgrid: SubgridModel::WALE, ..settings }, [0.0, 1.0, 0.0]).is_none());
    }
}
