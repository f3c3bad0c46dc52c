//! Parts of the cycle: symmetry, interpolation, colours, relaxed lines.

use super::super::super::mesh::{Direction, Spread, Wall};
use super::super::apply::stiffness;
use super::*;

/// The mesh of a direction with the operator of the coarser ones.
fn second_order(direction: &Direction) -> Axis {
    let line = Operators1d::new(direction);
    let Axis {
        mass,
        centre,
        period,
        ..
    } = Axis::finest(&line, 1.0, &stiffness(&line));
    Axis::new(mass, centre, period)
}

fn level(first: Axis, second: Axis) -> Level {
    Level {
        axes: [first, second],
        weights: Default::default(),
        sweeps: 1,
    }
}

fn relaxed(level: &Level, a: usize, mode: &Lanes, u: &mut [Lanes], f: &[Lanes]) {
    let longest = level.axes[0].len().max(level.axes[1].len());
    relax(
        level,
        a,
        mode,
        u,
        f,
        false,
        &mut vec![[NO_CELL; TOGETHER]; longest],
    );
}

fn wave(n: usize, f: f32) -> Vec<Lanes> {
    (0..n)
        .map(|p| std::array::from_fn(|l| ((p * LANES + l) as f32 * f).sin()))
        .collect()
}

#[test]
fn a_cycle_is_symmetric() {
    let ground = Direction::between(25, 0.0, 25.0, Wall::AT_REST, Wall::Slip)
        .stretched(Spread::TanhLow.by(2.0));
    let lines = [ground, Direction::periodic(14, 0.0, 14.0)]
        .each_ref()
        .map(Operators1d::new);
    let levels = Level::hierarchy(
        lines
            .each_ref()
            .map(|line| Axis::finest(line, 1.0, &stiffness(line))),
    );
    let mode: Lanes = std::array::from_fn(|l| 0.02 * (l + 1) as f32);
    let cycled = |f: f32| {
        let sizes = levels
            .iter()
            .map(|level| level.axes[0].len() * level.axes[1].len());
        let mut fields: Vec<[Vec<Lanes>; 2]> =
            sizes.map(|n| [vec![[0.0; LANES]; n], wave(n, f)]).collect();
        let mut lines = Lines {
            line: vec![[NO_CELL; TOGETHER]; 25],
            row: vec![[0.0; LANES]; 25],
        };
        v_cycle(&levels, &mode, &mut fields, &mut lines);
        fields.swap_remove(0)
    };
    let ([bf, f], [bg, g]) = (cycled(0.71), cycled(1.3));
    for l in 0..LANES {
        let dot = |a: &[Lanes], b: &[Lanes]| {
            a.iter()
                .zip(b)
                .map(|(a, b)| f64::from(a[l] * b[l]))
                .sum::<f64>()
        };
        let one = dot(&g, &bf);
        let other = dot(&f, &bg);
        let size = dot(&f, &bf);
        assert!(
            (one - other).abs() < 2e-6 * size && size > 0.0,
            "{l}: {one} {other} of {size}"
        );
    }
}

fn directions() -> [Direction; 3] {
    let walls = |n| Direction::between(n, 0.0, 4.0, Wall::AT_REST, Wall::Slip);
    [
        walls(24),
        walls(37).stretched(Spread::TanhLow.by(3.0)),
        Direction::periodic(19, 0.0, 4.0).stretched(Spread::Sine.by(0.5)),
    ]
}

#[test]
fn interpolation_keeps_constants_and_straight_lines_and_coarse_meshes_keep_the_mass() {
    for direction in directions() {
        let mut axis = second_order(&direction);
        while axis.len() > 1 {
            let coarse = axis.coarsened();
            let sum = |axis: &Axis| axis.mass.iter().sum::<f64>();
            assert!((sum(&coarse) / sum(&axis) - 1.0).abs() < 1e-14);
            for (i, [a, b]) in axis.weights_from(&coarse).iter().enumerate() {
                assert!(
                    (a.1 + b.1 - 1.0).abs() < 1e-6 && a.1 > 0.3 && b.1 >= 0.0,
                    "{i}: {a:?} {b:?}"
                );
                if a.0.abs_diff(b.0) == 1 && coarse.len() > 2 {
                    let x =
                        f64::from(a.1) * coarse.centre[a.0] + f64::from(b.1) * coarse.centre[b.0];
                    assert!(
                        (x - axis.centre[i]).abs() < 1e-5,
                        "{i}: {x} {}",
                        axis.centre[i]
                    );
                }
            }
            axis = coarse;
        }
    }
}

#[test]
fn lines_that_are_relaxed_together_never_touch() {
    for direction in directions() {
        let mut axis = second_order(&direction);
        while axis.len() > 1 {
            let n = axis.len();
            assert_eq!(axis.lines.iter().map(Vec::len).sum::<usize>(), n);
            for (a, b) in (0..n)
                .map(|i| (i, (i + 1) % n))
                .filter(|&(i, _)| axis.link[i] != 0.0)
            {
                assert!(
                    axis.lines
                        .iter()
                        .all(|lines| !(lines.contains(&a) && lines.contains(&b)))
                );
            }
            axis = axis.coarsened();
        }
    }
}

/// Largest residual on the lines of the last colour along axis 1.
fn left_over(level: &Level, mode: &Lanes, u: &[Lanes], f: &[Lanes]) -> f32 {
    let lines = level.axes[0].lines.last().unwrap();
    let places = lines
        .iter()
        .flat_map(|j| (0..level.axes[1].len()).map(move |k| [*j, k]));
    let left = places.flat_map(|place| residual_at(level, place, mode, u, f));
    left.fold(0.0, |worst, r| worst.max(r.abs()))
}

#[test]
fn relaxed_lines_leave_no_residual_in_all_kinds_of_directions() {
    let kinds = [
        Direction::between(13, 0.0, 13.0, Wall::AT_REST, Wall::Slip)
            .stretched(Spread::TanhLow.by(1.0)),
        Direction::periodic(11, 0.0, 11.0).stretched(Spread::Sine.by(0.5)),
        Direction::periodic(8, 0.0, 8.0),
    ];
    let mode: Lanes = std::array::from_fn(|l| if l == 0 { 0.0 } else { 0.1 * l as f32 });
    for a in &kinds {
        for b in &kinds {
            let level = level(second_order(b), second_order(a));
            let n = level.axes[0].len() * level.axes[1].len();
            let mut u = wave(n, 0.3);
            let f = wave(n, 0.7);
            relaxed(&level, 1, &mode, &mut u, &f);
            let left = left_over(&level, &mode, &u, &f);
            assert!(left < 2e-5, "{a:?} {b:?}: {left}");
        }
    }
}

#[test]
fn a_single_line_of_a_constant_mode_is_solved_up_to_its_level() {
    for direction in [
        Direction::periodic(9, 0.0, 9.0),
        Direction::between(9, 0.0, 9.0, Wall::Slip, Wall::Slip),
    ] {
        let level = level(
            second_order(&Direction::thin(1.0)),
            second_order(&direction),
        );
        let mode = [0.0; LANES];
        let mut f = wave(9, 0.7);
        for l in 0..LANES {
            let mean = f.iter().map(|f| f[l]).sum::<f32>() / 9.0;
            f.iter_mut().for_each(|f| f[l] -= mean);
        }
        let mut u = vec![[0.0; LANES]; 9];
        relaxed(&level, 1, &mode, &mut u, &f);
        let left = left_over(&level, &mode, &u, &f);
        assert!(left < 1e-5, "{direction:?}: {left}");
    }
}
