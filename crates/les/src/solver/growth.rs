//! Waves of the mesh that a time scheme lets grow, and where a flow's shortest waves are strongest.
//!
//! A wave of `theta` per cell that a stream carries turns by `C s(theta)` in a step
//! (`C = dt sum |u_i|/h_i` the Courant number, `s` the symbol of the transport, at most 1.586, or
//! 1.167 on meshes with no-slip walls), and viscosity takes `nu dt kappa(theta)^2/h^2` of it.
//! Whether it grows follows from the amplification of the scheme, with viscosity explicit or by
//! Crank-Nicolson along the direction of the stream. Runge-Kutta lets none grow up to `C = 1.0921`
//! (1.4846 with walls), more with viscosity. Adams-Bashforth lets every wave grow that viscosity
//! does not damp: all decay where the Reynolds number of the cell, `h^2 S/nu` with
//! `S = sum |u_i|/h_i`, is below a limit that falls about with the cube of `C`: 30 at 0.35, 82 with
//! walls.
//!
//! The air is taken to stream on: where it turns, waves grow less. What a subgrid model takes is
//! not counted; a run measures it.
//!
//! Check: waves carried by a uniform stream grow above these limits and decay below them.

use std::f64::consts::PI;

use num_complex::Complex;
use rayon::prelude::*;

use super::flow::Flow;
use super::mesh::{Mesh, Wall};
use super::settings::{FlowSettings, ROUND_OFF, TimeScheme, TimeStep};
use super::stiffness::{Stiffness, explicit_up_to_s, implicit_axes, metrics, viscous_rates_per_s};
use crate::Error;

/// Transport by a uniform stream per cell and Courant number, `sum_m c_m sin(m theta)`, of boxes
/// without no-slip walls and of those with them.
const TRANSPORT: [[f64; 3]; 2] = [[1.5, -0.3, 1.0 / 30.0], [9.0 / 8.0, 0.0, -1.0 / 24.0]];
/// Waves that are tried, from two cells to infinity.
const WAVES: usize = 90;
/// Halvings of an interval that find a limit.
const HALVINGS: usize = 40;
/// No wave that matters decays beyond this Courant number.
const MOST_COURANT: f64 = 4.0;

/// Waves of the mesh that grow because the time scheme gives them more than viscosity takes.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "short waves grow at {rate_per_s:.2e} 1/s, as viscosity is too small to damp them (cell Reynolds number \
     {cell_reynolds:.3e} at Courant number {courant:.2}; all decay below {damped_courant:.2})"
)]
pub struct UndampedGrowth {
    /// `h^2 sum |u_i|/h_i/nu` of the cell whose waves grow most, `h` its length along the largest
    /// term; infinite without viscosity.
    pub cell_reynolds: f64,
    /// Largest Courant number of the steps.
    pub courant: f64,
    /// Largest Courant number at which every wave decays, steps being shorter for the same flow;
    /// zero without viscosity under Adams-Bashforth.
    pub damped_courant: f64,
    /// Rate at which the amplitude of the worst wave grows \[1/s\].
    pub rate_per_s: f64,
}

/// How fast the cells of a mesh carry and damp the waves of a flow.
#[derive(Debug, Clone)]
pub struct Stability {
    scheme: TimeScheme,
    time_step: TimeStep,
    transport: [f64; 3],
    viscosity_m2_s: f64,
    cells: Vec<FastestCell>,
    /// Whether viscosity is implicit along x, y, z, and up to which steps it is explicit \[s\] in a
    /// flow that starts with them.
    implicit: [bool; 3],
    explicit_up_to_s: [f64; 3],
    stiffness: Stiffness,
}

/// The fastest of the cells that are equally long along the direction that carries most.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FastestCell {
    /// `S = sum |u_i|/h_i` \[1/s\].
    rate_per_s: f64,
    length_m: f64,
    /// That direction.
    axis: usize,
}

impl Stability {
    /// Of a flow of `settings` on `mesh`, whose velocity in the cell of the indices along x, y, z
    /// is `velocity_m_s`.
    pub fn of(
        mesh: &Mesh,
        settings: &FlowSettings,
        velocity_m_s: impl Fn([usize; 3]) -> [f64; 3] + Sync,
    ) -> Self {
        let rates = largest_rates(mesh, velocity_m_s);
        let implicit = implicit_axes(
            mesh,
            settings,
            rates.iter().flatten().copied().fold(0.0, f64::max),
        );
        Self::at_rates(mesh, settings, implicit, &rates)
    }

    /// The same from [`largest_rates`].
    fn at_rates(
        mesh: &Mesh,
        settings: &FlowSettings,
        implicit: [bool; 3],
        rates: &[Vec<f64>; 3],
    ) -> Self {
        let sticks = mesh
            .directions()
            .iter()
            .any(|d| d.ends.no_slip() != [false; 2]);
        let mut cells: Vec<FastestCell> = Vec::new();
        for (axis, (rates, lengths_m)) in rates.iter().zip(metrics(mesh)).enumerate() {
            for (&rate_per_s, length_m) in
                rates.iter().zip(lengths_m).filter(|(rate, _)| **rate > 0.0)
            {
                match cells
                    .iter_mut()
                    .find(|c| c.length_m == length_m && c.axis == axis)
                {
                    Some(same) => same.rate_per_s = same.rate_per_s.max(rate_per_s),
                    None => cells.push(FastestCell {
                        rate_per_s,
                        length_m,
                        axis,
                    }),
                }
            }
        }
        let transport = TRANSPORT[usize::from(sticks)];
        let &FlowSettings {
            scheme,
            time_step,
            viscosity_m2_s,
            ..
        } = settings;
        let stiffness = Stiffness::new(viscous_rates_per_s(mesh, viscosity_m2_s), implicit);
        let explicit_up_to_s = explicit_up_to_s(mesh, settings);
        Self {
            scheme,
            time_step,
            transport,
            viscosity_m2_s,
            cells,
            implicit,
            explicit_up_to_s,
            stiffness,
        }
    }

    /// Length of the first step, or of the longest if the flow starts from rest \[s\].
    pub fn first_step_s(&self) -> f64 {
        let step_s = self.time_step.step_s(self.courant_per_s());
        if matches!(self.time_step, TimeStep::Fixed { .. }) {
            step_s
        } else {
            step_s.min(self.stiffness.longest_s())
        }
    }

    /// Whether steps of `step_s` are too long for implicit viscosity, in a sentence.
    pub fn stiff_note(&self, step_s: f64) -> Option<String> {
        self.stiffness.note(step_s)
    }

    /// Largest `sum |u_i|/h_i` \[1/s\]: a Courant number over it is a time step.
    pub fn courant_per_s(&self) -> f64 {
        self.cells
            .iter()
            .fold(0.0, |most, cell| most.max(cell.rate_per_s))
    }

    /// Growth of the worst wave in a step of `step_s`, `ln |G|`, and its cell, where viscosity is
    /// `implicit` along these axes.
    fn worst(&self, step_s: f64, implicit: [bool; 3]) -> (f64, Option<FastestCell>) {
        let mut largest = f64::NEG_INFINITY;
        let mut worst = None;
        for cell in &self.cells {
            let growth = largest_growth(
                self.scheme,
                self.transport,
                step_s * cell.rate_per_s,
                self.viscosity_m2_s * step_s / cell.length_m.powi(2),
                implicit[cell.axis],
            );
            if growth > largest {
                largest = growth;
                worst = Some(*cell);
            }
        }
        (largest, worst)
    }

    /// Whether every wave decays in a step of `step_s`.
    fn all_decay(&self, step_s: f64, implicit: [bool; 3]) -> bool {
        self.worst(step_s, implicit).0 <= ROUND_OFF
    }

    /// Largest Courant number at which every wave decays, as it does at all smaller ones; infinite
    /// in a flow that carries none. Shorter steps make viscosity explicit along more directions.
    pub fn damped_courant(&self) -> f64 {
        let longest_s = MOST_COURANT / self.courant_per_s();
        if longest_s.is_infinite() {
            return f64::INFINITY;
        }
        let mut ends_s = self
            .explicit_up_to_s
            .map(|step_s| step_s.min(longest_s))
            .to_vec();
        ends_s.push(longest_s);
        ends_s.sort_by(f64::total_cmp);
        let mut start_s = 0.0;
        for end_s in ends_s {
            let implicit = self.explicit_up_to_s.map(|step_s| step_s < end_s);
            if !self.all_decay(end_s, implicit) {
                let limit_s = bisect(start_s, end_s, |step_s| self.all_decay(step_s, implicit));
                return self.courant_per_s() * limit_s;
            }
            start_s = end_s;
        }
        MOST_COURANT
    }

    /// What grows in steps of `step_s`; `None` where nothing does.
    pub fn undamped(&self, step_s: f64) -> Option<UndampedGrowth> {
        let (growth, Some(cell)) = self.worst(step_s, self.implicit) else {
            return None;
        };
        (growth > ROUND_OFF).then(|| UndampedGrowth {
            cell_reynolds: cell.length_m.powi(2) * cell.rate_per_s / self.viscosity_m2_s,
            courant: self.courant_per_s() * step_s,
            damped_courant: self.damped_courant(),
            rate_per_s: growth / step_s,
        })
    }

    /// The largest Courant number of such a step, if one of `step_s` is refused.
    pub fn refused(&self, step_s: f64) -> Option<f64> {
        if !self.grows_too_fast(step_s) {
            return None;
        }
        let limit_s = bisect(0.0, step_s, |step_s| !self.grows_too_fast(step_s));
        Some(self.courant_per_s() * limit_s)
    }

    /// Whether a wave grows by more than the scheme allows in a step of `step_s`.
    fn grows_too_fast(&self, step_s: f64) -> bool {
        self.worst(step_s, self.implicit).0 > self.scheme.allowed_growth()
    }
}

/// Largest `sum |u_i|/h_i` \[1/s\] of all cells whose largest term is that of a direction, by their
/// index along it, and of the smallest cells beside walls that move: the fluid may come to their
/// speed.
fn largest_rates(
    mesh: &Mesh,
    velocity_m_s: impl Fn([usize; 3]) -> [f64; 3] + Sync,
) -> [Vec<f64>; 3] {
    let metric_m = metrics(mesh);
    let [nx, ny, nz] = mesh.cells();
    let of_planes = (0..nz).into_par_iter().fold(
        || no_rates(&metric_m),
        |mut rates, k| {
            for j in 0..ny {
                for i in 0..nx {
                    let cell = [i, j, k];
                    add_rate(&mut rates, &metric_m, cell, velocity_m_s(cell));
                }
            }
            rates
        },
    );
    let mut rates = of_planes.reduce(
        || no_rates(&metric_m),
        |mut a, b| {
            larger(&mut a, &b.concat());
            a
        },
    );
    let smallest = metric_m.each_ref().map(|metric_m| smallest_cell(metric_m));
    for wall in mesh.directions().iter().flat_map(|d| d.ends.walls()) {
        if let Wall::NoSlip { velocity_m_s } = wall {
            add_rate(&mut rates, &metric_m, smallest, velocity_m_s);
        }
    }
    rates
}

/// A rate of zero for each cell of each direction.
fn no_rates(metric_m: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    metric_m.each_ref().map(|m| vec![0.0; m.len()])
}

/// Index of the smallest cell of a direction, of the first if there are several.
fn smallest_cell(metric_m: &[f64]) -> usize {
    (0..metric_m.len())
        .min_by(|&a, &b| metric_m[a].total_cmp(&metric_m[b]))
        .unwrap_or(0)
}

/// Takes the rate `sum |u_i|/h_i` of a cell into that of its index along the direction of its
/// largest term.
fn add_rate(
    rates: &mut [Vec<f64>; 3],
    metric_m: &[Vec<f64>; 3],
    cell: [usize; 3],
    velocity_m_s: [f64; 3],
) {
    let mut terms = [0.0; 3];
    for d in 0..3 {
        if metric_m[d].len() > 1 {
            terms[d] = velocity_m_s[d].abs() / metric_m[d][cell[d]];
        }
    }
    let most = (1..3).fold(0, |most, d| if terms[d] > terms[most] { d } else { most });
    let rate = &mut rates[most][cell[most]];
    *rate = rate.max(terms.iter().sum());
}

/// Takes the larger of these rates and those of `others`, one direction after the other.
fn larger(rates: &mut [Vec<f64>; 3], others: &[f64]) {
    rates
        .iter_mut()
        .flatten()
        .zip(others)
        .for_each(|(rate, other)| *rate = rate.max(*other));
}

/// The end of the low part of an interval, in which `holds`.
fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// Largest growth of a wave in a step, `ln |G|`, with `viscous = nu dt/h^2`.
fn largest_growth(
    scheme: TimeScheme,
    transport: [f64; 3],
    courant: f64,
    viscous: f64,
    is_implicit: bool,
) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for wave in 1..=WAVES {
        let theta = PI * wave as f64 / WAVES as f64;
        let symbol = (1..=3)
            .map(|m| transport[m - 1] * (m as f64 * theta).sin())
            .sum::<f64>();
        let kappa = 2.0 * (9.0 / 8.0 * (0.5 * theta).sin() - (1.5 * theta).sin() / 24.0);
        let decay = viscous * kappa * kappa;
        let [explicit, implicit] = if is_implicit {
            [0.0, decay]
        } else {
            [decay, 0.0]
        };
        let rate = Complex::new(-explicit, courant * symbol);
        largest = largest.max(amplification(scheme, rate, implicit).ln());
    }
    largest
}

/// `|G|` of a step of `du/dt = (z u - d u)/dt` with `d` by Crank-Nicolson: the larger root of
/// Adams-Bashforth, the product of the stages of Runge-Kutta.
fn amplification(scheme: TimeScheme, z: Complex<f64>, d: f64) -> f64 {
    if scheme == TimeScheme::AdamsBashforth2 {
        // G^2 - (a + 3/2 z) G + z/2 = 0.
        let a = (1.0 - 0.5 * d) / (1.0 + 0.5 * d);
        let z = z / (1.0 + 0.5 * d);
        let b = a + 1.5 * z;
        let root = (b * b - 2.0 * z).sqrt();
        return (0.5 * (b + root)).norm().max((0.5 * (b - root)).norm());
    }
    let mut u = Complex::from(1.0);
    let mut before = Complex::from(0.0);
    for stage in scheme.stages(None) {
        let term = z * u;
        u += stage.fraction * (stage.new * term + stage.old * before - d * u)
            / (1.0 + 0.5 * stage.fraction * d);
        before = term;
    }
    u.norm()
}

impl Flow {
    /// The step at which `stability`, whose metric is that of the cells, has the Courant number of
    /// a step of `step_s`, whose metric is that of the faces.
    pub(super) fn judged_step_s(&self, stability: &Stability, step_s: f64) -> f64 {
        self.state.courant_per_s * step_s / stability.courant_per_s()
    }

    /// How its cells carry and damp the waves of the present field.
    pub fn stability(&self) -> Result<Stability, Error> {
        let shape = self.layout.shape;
        let axis = [0, 1, 2].map(|d| self.layout.axis_of(d));
        let own = shape.own();
        let mut rates = largest_rates(&self.mesh, |cell| {
            let index = self.layout.direction.map(|d| cell[d]);
            // What others own is at rest here and does not count.
            if !own.contains(&index[2]) {
                return [0.0; 3];
            }
            let place = shape.place(index);
            axis.map(|a| self.state.velocity[a][place])
        });
        let count = rates.iter().map(Vec::len).sum();
        let of_ranks = self.layout.slabs.all_gather(rates.concat())?;
        for others in of_ranks.chunks(count) {
            larger(&mut rates, others);
        }
        let implicit = axis.map(|a| self.state.implicit[a]);
        Ok(Stability::at_rates(
            &self.mesh,
            &self.settings,
            implicit,
            &rates,
        ))
    }

    /// Memory axis and place of the component whose waves of two cells are strongest: where
    /// numerical growth shows most.
    pub(super) fn strongest_short_wave(&self) -> Result<(usize, usize), Error> {
        let (_, component, place) = self.first_largest(|component, place| {
            let [a, b, c] = [0, 1, 2].map(|axis| self.short_wave(component, place, axis));
            a.max(b).max(c)
        })?;
        Ok((component, place))
    }

    /// Modulus of the second difference of a component along an axis; zero beside a wall.
    fn short_wave(&self, component: usize, place: usize, axis: usize) -> f64 {
        let shape = self.layout.shape;
        let index = shape.index_held(place);
        let n = shape.n[axis];
        let at_end = index[axis] == 0 || index[axis] + 1 == n;
        if n <= 2 || (at_end && !self.layout.line[axis].is_periodic()) {
            return 0.0;
        }
        let [below, own, above] = [0, 1, 2].map(|offset| {
            let mut other = index;
            other[axis] = (index[axis] + n + offset - 1) % n;
            self.state.velocity[component][shape.place(other)]
        });
        (below - 2.0 * own + above).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Direction;
    use super::*;

    const AB2: TimeScheme = TimeScheme::AdamsBashforth2;
    const RK3: TimeScheme = TimeScheme::RungeKutta3;

    /// A wave of the mesh, carried by a stream of 1 m/s on 48 cells of 1 m.
    fn wave(
        cells_per_wave: f64,
        viscosity_m2_s: f64,
        courant: f64,
        scheme: TimeScheme,
        implicit: bool,
    ) -> Flow {
        let mesh = || {
            let y = Direction::periodic(48, 0.0, 48.0);
            Mesh::new(Direction::thin(1.0), y, Direction::periodic(4, 0.0, 4.0)).unwrap()
        };
        let mut settings = FlowSettings::new(viscosity_m2_s, TimeStep::Fixed { step_s: courant });
        settings.scheme = scheme;
        let wave = std::f64::consts::TAU / cells_per_wave;
        let mut flow = Flow::new(mesh(), settings, |[_, y, _]| {
            [1e-3 * (wave * y).cos(), 1.0, 0.0]
        })
        .unwrap()
        .0;
        flow.state.implicit = flow.layout.direction.map(|d| d > 0 && implicit);
        flow
    }

    /// Growth of the energy of such a wave per second, and what is said of it.
    fn measured_per_s(
        cells_per_wave: f64,
        viscosity_m2_s: f64,
        courant: f64,
    ) -> (f64, Option<UndampedGrowth>) {
        let mut flow = wave(cells_per_wave, viscosity_m2_s, courant, AB2, true);
        let growth = flow.stability().unwrap().undamped(courant);
        let energy = |flow: &Flow| flow.face_velocity_m_s(0).iter().map(|u| u * u).sum::<f64>();
        // The spurious root of the scheme dies out first.
        for _ in 0..20 {
            flow.step().unwrap();
        }
        let start = energy(&flow);
        let steps = 100;
        for _ in 0..steps {
            flow.step().unwrap();
        }
        (
            (energy(&flow) / start).ln() / (f64::from(steps) * courant),
            growth,
        )
    }

    /// Reynolds number of a cell up to which every wave decays under Adams-Bashforth.
    fn largest_reynolds(transport: [f64; 3], courant: f64, is_implicit: bool) -> f64 {
        let decays = |power: f64| {
            largest_growth(
                AB2,
                transport,
                courant,
                courant / 10.0_f64.powf(power),
                is_implicit,
            ) < 0.0
        };
        10.0_f64.powf(bisect(-2.0, 12.0, decays))
    }

    /// Largest Courant number at which every wave decays.
    fn limit(scheme: TimeScheme, sticks: bool, viscous: f64, is_implicit: bool) -> f64 {
        let transport = TRANSPORT[usize::from(sticks)];
        bisect(0.0, 2.0, |courant| {
            largest_growth(scheme, transport, courant, viscous, is_implicit) <= ROUND_OFF
        })
    }

    #[test]
    fn a_wave_grows_above_the_cells_reynolds_number_and_decays_below_it() {
        let waves = [2.4, 3.2, 48.0 / 13.0, 4.0, 8.0, 24.0];
        for (courant, factor) in [(0.2, 0.88), (0.35, 0.66)] {
            let limit = largest_reynolds(TRANSPORT[0], courant, true);
            // The leading order of the growth gives 4/(2.047 C^3).
            assert!(
                (limit * 2.047 * courant.powi(3) / 4.0 - factor).abs() < 0.02,
                "{limit}"
            );
            let all =
                |reynolds: f64| waves.map(|cells| measured_per_s(cells, 1.0 / reynolds, courant));
            let above = all(1.15 * limit);
            assert!(above.iter().any(|(grown, _)| *grown > 0.0), "{above:?}");
            let found = above[0].1.unwrap();
            assert!(
                (found.cell_reynolds / limit - 1.15).abs() < 1e-9,
                "{found:?}"
            );
            // In a flow that starts with so little viscosity it is explicit.
            let damped = largest_reynolds(TRANSPORT[0], found.damped_courant, false);
            assert!(
                (damped / found.cell_reynolds - 1.0).abs() < 1e-6,
                "{found:?}"
            );
            let below = all(0.85 * limit);
            assert!(
                below
                    .iter()
                    .all(|(grown, found)| *grown < 0.0 && found.is_none()),
                "{below:?}"
            );
        }
        assert!((largest_reynolds(TRANSPORT[1], 0.35, true) / 82.0 - 1.0).abs() < 0.01);
        // Without viscosity; the rate of the amplitude is half that of the energy, and the worst
        // wave has 3.2 cells.
        let (grown, found) = measured_per_s(3.2, 0.0, 0.35);
        let found = found.unwrap();
        assert!(
            found.cell_reynolds.is_infinite() && found.damped_courant < 0.01,
            "{found:?}"
        );
        assert!(
            (0.5 * grown / found.rate_per_s - 1.0).abs() < 0.01,
            "{grown}, {found:?}"
        );
    }

    /// Viscous number and the Courant number that is the limit at it.
    type MeasuredLimit = (f64, f64);

    /// Limits `(viscous, courant)` of a scheme with viscosity implicit or explicit, measured with
    /// fixed steps on lines of 48 and 64 cells, white noise or the worst wave.
    #[rustfmt::skip]
    const MEASURED_LIMITS: [(TimeScheme, bool, &[MeasuredLimit]); 4] = [
        (RK3, true, &[(0.0, 1.0921), (0.001, 1.099), (0.01, 1.147), (0.1, 1.364), (0.3, 1.546), (0.4, 1.589)]),
        (RK3, false, &[(0.001, 1.101), (0.01, 1.162), (0.1, 1.413), (0.3, 1.453), (0.4, 1.095)]),
        (AB2, true, &[(0.001, 0.204), (0.01, 0.339), (0.03, 0.4195), (0.1, 0.516), (0.15, 0.552)]),
        (AB2, false, &[(0.001, 0.206), (0.01, 0.351), (0.03, 0.438), (0.1, 0.5075), (0.15, 0.478)]),
    ];

    #[test]
    fn limits_are_the_measured_ones_of_both_schemes_with_viscosity_explicit_and_implicit() {
        for (scheme, is_implicit, table) in MEASURED_LIMITS {
            for &(viscous, measured) in table {
                let found = limit(scheme, false, viscous, is_implicit);
                assert!(
                    (found / measured - 1.0).abs() < 0.01,
                    "{scheme:?}, {viscous}: {found}"
                );
            }
        }
        assert!(
            (limit(RK3, true, 0.0, true) / 1.4846 - 1.0).abs() < 0.001,
            "with walls"
        );
        // Explicit viscosity alone.
        for (scheme, most) in [(AB2, 1.0), (RK3, 2.513)] {
            let most = most / (49.0 / 9.0);
            assert!(largest_growth(scheme, TRANSPORT[0], 0.0, 0.98 * most, false) <= ROUND_OFF);
            assert!(largest_growth(scheme, TRANSPORT[0], 0.0, 1.02 * most, false) > ROUND_OFF);
        }
    }

    #[test]
    fn steps_of_runge_kutta_are_taken_just_below_their_limit_and_refused_just_above() {
        for (viscosity_m2_s, implicit) in [(0.0, true), (0.05, true), (0.05, false), (0.2, false)] {
            let step = |courant: f64| wave(3.6, viscosity_m2_s, courant, RK3, implicit);
            // nu dt/h^2 changes with the step.
            let limit = bisect(0.0, 2.0, |c| {
                largest_growth(RK3, TRANSPORT[0], c, viscosity_m2_s * c, implicit) <= ROUND_OFF
            });
            let mut flow = step(0.999 * limit);
            let start = flow.kinetic_energy_m5_s2();
            for _ in 0..50 {
                flow.step().unwrap();
            }
            assert!(flow.kinetic_energy_m5_s2() <= start * (1.0 + 1e-12));
            let Err(Error::CourantTooLarge { limit: said, .. }) = step(1.001 * limit).step() else {
                panic!("{limit}")
            };
            assert!((said / limit - 1.0).abs() < 1e-6, "{said}, {limit}");
        }
    }

    #[test]
    fn cells_of_their_own_length_and_directions_without_variation_are_judged_each() {
        let y = Direction::periodic(8, 0.0, 8.0);
        let mesh = Mesh::new(
            Direction::thin(1.0),
            y.clone(),
            Direction::periodic(8, 0.0, 80.0),
        )
        .unwrap();
        let settings = FlowSettings::new(0.05, TimeStep::Fixed { step_s: 0.3 });
        let of = |settings: &FlowSettings, u: [f64; 3]| {
            Stability::of(&mesh, settings, |_| u).undamped(0.3)
        };
        assert!(
            of(&settings, [5.0, 0.0, 0.0]).is_none(),
            "nothing varies along x"
        );
        // The same Courant number, but viscosity takes a hundredth from the long cells.
        assert!(of(&settings, [0.0, 1.0, 0.0]).is_none());
        let found = of(&settings, [0.0, 0.0, 10.0]).unwrap();
        assert!(
            (found.cell_reynolds - 2000.0).abs() < 1e-6 && (found.courant - 0.3).abs() < 1e-12,
            "{found:?}"
        );
        // The cell that carries less may be the worse one.
        let both = of(&settings, [0.0, 1.2, 9.0]).unwrap();
        assert!(both.cell_reynolds < 100.0, "{both:?}");
        let mixed = Stability::of(&mesh, &settings, |[_, j, _]| {
            if j == 0 {
                [0.0, 0.0, 9.0]
            } else {
                [0.0, 1.2, 0.0]
            }
        });
        let mixed = mixed.undamped(0.3).unwrap();
        assert!(
            (mixed.cell_reynolds - 1800.0).abs() < 1e-6 && (mixed.courant - 0.36).abs() < 1e-12,
            "{mixed:?}"
        );
        assert!(
            of(
                &FlowSettings {
                    scheme: RK3,
                    ..settings
                },
                [0.0, 0.0, 10.0]
            )
            .is_none()
        );
    }
}
