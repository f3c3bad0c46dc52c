//! What the tests of the subgrid models share: fields from closed forms, meshes, one plain
//! evaluation of the stress.

mod budget;
mod laminar;
mod vortex;

use super::super::mesh::{Direction, Mapping, Mesh, Spread, Wall};
use super::super::operators_1d::Operators1d;
use super::*;

const MODELS: [SubgridModel; 3] = [
    SubgridModel::SMAGORINSKY,
    SubgridModel::WALE,
    SubgridModel::MULTISCALE_WALE,
];

/// A flow on a mesh, with its model.
struct Modelled {
    mesh: Mesh,
    layout: Layout,
    velocity: [Vec<f64>; 3],
    model: Subgrid,
    in_plane: [Aligned; 3],
    /// Small scales of the first component.
    first: Aligned,
}

impl Modelled {
    fn new(
        directions: [Direction; 3],
        model: SubgridModel,
        field: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Self {
        let [x, y, z] = directions;
        let mesh = Mesh::new(x, y, z).unwrap();
        // The memory axes are x, y, z, so that a test can name them.
        let layout = Layout::in_order(&mesh, [0, 1, 2]);
        let velocity = faces(&mesh, &layout, field);
        let model = Subgrid::new(&layout, model).unwrap().unwrap();
        let field = || Aligned::zeros(layout.shape.len());
        let in_plane = [field(), field(), field()];
        let first = field();
        let mut modelled = Self {
            mesh,
            layout,
            velocity,
            model,
            in_plane,
            first,
        };
        modelled.update(f64::INFINITY);
        modelled
    }

    fn update(&mut self, limit_per_s: f64) {
        let velocity = self.velocity.each_ref().map(Vec::as_slice);
        self.model
            .update(velocity, limit_per_s, &mut self.in_plane, &mut self.first)
            .unwrap();
    }

    /// The small scales of the multiscale model.
    fn small(&self) -> Option<[Vec<f64>; 3]> {
        self.model.small.as_ref().map(|(_, small)| {
            let [second, third] = small;
            [&self.first, second, third].map(|scales| scales.to_vec())
        })
    }

    fn index(&self, place: usize) -> [usize; 3] {
        index(&self.layout, place)
    }

    fn at(&self, index: [usize; 3]) -> usize {
        self.layout.shape.row(index[1], index[2]).start + index[0]
    }

    /// Acceleration of each component.
    fn acceleration(&self) -> [Vec<f64>; 3] {
        let shape = self.layout.shape;
        std::array::from_fn(|component| {
            let mut field = self.in_plane[component].to_vec();
            for k in 0..shape.n[2] {
                for j in 0..shape.n[1] {
                    self.model
                        .add_divergence_row(component, j, k, &mut field[shape.row(j, k)]);
                }
            }
            field
        })
    }

    /// Largest modulus of the stress in the cells and edges that `inside` admits.
    fn largest_stress(&self, inside: impl Fn([usize; 3]) -> bool) -> f64 {
        let stress = self.plain_stress();
        let all = stress.iter().flatten().enumerate();
        let count = self.layout.shape.len();
        all.filter(|(i, _)| inside(self.index(i % count)))
            .fold(0.0, |most, (_, t)| most.max(t.abs()))
    }

    /// Stress `tau_00, tau_11, tau_22, tau_01, tau_02, tau_12`, place by place from the rows of the
    /// operators.
    fn plain_stress(&self) -> [Vec<f64>; 6] {
        let small = self.small();
        let mut strain = strain(&self.layout, small.as_ref().unwrap_or(&self.velocity));
        let nu = &self.model.viscosity_m2_s;
        let before = |place: usize, axis: usize| {
            let mut index = self.index(place);
            let n = self.layout.shape.n[axis];
            // On a wall the strain is zero.
            index[axis] = if index[axis] > 0 {
                index[axis] - 1
            } else {
                n - 1
            };
            self.at(index)
        };
        for place in 0..nu.len() {
            for (pair, [a, b]) in PAIRS.into_iter().enumerate() {
                let mean = if a == b {
                    nu[place]
                } else {
                    let p = before(place, a);
                    let q = before(place, b);
                    0.25 * (nu[place] + nu[p] + nu[q] + nu[before(p, b)])
                };
                strain[pair][place] *= 2.0 * mean;
            }
        }
        strain
    }
}

/// Components of a symmetric tensor.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

fn index(layout: &Layout, place: usize) -> [usize; 3] {
    let [n0, n1, _] = layout.shape.n;
    [place % n0, place / n0 % n1, place / (n0 * n1)]
}

/// The values at the faces, zero on walls.
fn faces(mesh: &Mesh, layout: &Layout, field: impl Fn([f64; 3]) -> [f64; 3]) -> [Vec<f64>; 3] {
    let face = [0, 1, 2].map(|d| mesh.face_m(d));
    let centre = [0, 1, 2].map(|d| mesh.centre_m(d));
    std::array::from_fn(|component| {
        let value = |place| {
            let index = index(layout, place);
            let mut at_m = [0.0; 3];
            for axis in 0..3 {
                let d = layout.direction[axis];
                at_m[d] = if axis == component {
                    face[d][index[axis]]
                } else {
                    centre[d][index[axis]]
                };
            }
            let wall = index[component] < layout.line[component].first_face();
            if wall {
                0.0
            } else {
                field(at_m)[layout.direction[component]]
            }
        };
        (0..layout.shape.len()).map(value).collect()
    })
}

/// Strain of a field at the places of the stress, from the rows of the operators.
fn strain(layout: &Layout, velocity: &[Vec<f64>; 3]) -> [Vec<f64>; 6] {
    let shape = layout.shape;
    let divergence = layout.line.each_ref().map(Operators1d::stored_divergence);
    let gradient = layout.line.each_ref().map(Operators1d::gradient);
    let derivative = |component: usize, axis: usize, place: usize| -> f64 {
        let index = index(layout, place);
        let (row, scale) = if component == axis {
            (
                &divergence[axis][index[axis]],
                1.0 / layout.line[axis].cell_mass_m[index[axis]],
            )
        } else {
            (&gradient[axis][index[axis]], 1.0)
        };
        let value = |other: usize| {
            let mut index = index;
            index[axis] = other;
            velocity[component][shape.row(index[1], index[2]).start + index[0]]
        };
        row.iter().map(|&(other, c)| scale * c * value(other)).sum()
    };
    PAIRS.map(|[a, b]| {
        (0..shape.len())
            .map(|place| 0.5 * (derivative(a, b, place) + derivative(b, a, place)))
            .collect()
    })
}

/// Smooth waves without symmetry, down to a few cells, free of divergence.
fn waves(seed: f64, shortest: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |[x, y, z]| {
        let mut sum = [0.0; 3];
        for i in 0..6 {
            let r = |m: f64| ((seed + 7.3 * f64::from(i) + m) * 12.9898).sin() * 43758.5453 % 1.0;
            let k =
                [r(1.0), r(2.0), r(3.0)].map(|k| (k * shortest).round() * std::f64::consts::TAU);
            let a = [r(4.0), r(5.0), r(6.0)];
            let phase = (k[0] * x + k[1] * y + k[2] * z + 6.0 * r(7.0)).sin();
            // k x a has no component along k.
            sum[0] += (k[1] * a[2] - k[2] * a[1]) * phase;
            sum[1] += (k[2] * a[0] - k[0] * a[2]) * phase;
            sum[2] += (k[0] * a[1] - k[1] * a[0]) * phase;
        }
        sum
    }
}

#[test]
fn models_that_are_absent_or_wrong_are_told_apart() {
    let mesh = Mesh::new(
        Direction::thin(1.0),
        Direction::thin(1.0),
        Direction::periodic(4, 0.0, 1.0),
    )
    .unwrap();
    let layout = Layout::new(&mesh);
    assert!(Subgrid::new(&layout, SubgridModel::None).unwrap().is_none());
    for bad in [0.0, -0.1, f64::NAN] {
        let message = Subgrid::new(&layout, SubgridModel::Wale { constant: bad })
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("constant") && message.contains("positive"),
            "{message}"
        );
    }
    for order in [0, 5] {
        let model = SubgridModel::MultiscaleWale {
            constant: 0.5,
            order,
        };
        assert!(
            Subgrid::new(&layout, model)
                .unwrap_err()
                .to_string()
                .contains("1 to 4")
        );
    }
}
