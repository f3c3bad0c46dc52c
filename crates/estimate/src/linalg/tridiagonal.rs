//! Eigenvalues of a symmetric matrix, and the components of vectors along its eigenvectors, which are never formed:
//! Householder's tridiagonal form and the implicit QL method, both applied to the vectors (Golub and Van Loan 2013, sections 8.3.1
//! and 8.3.3). Some directions can be projected out before.
//!
//! Check: the eigenvalues and vectors of `hermitian_eigen`.

use multiversion::multiversion;
use ndarray::Array2;

use crate::error::Error;
use crate::linalg::{dot, failed};

/// Most QL steps for one eigenvalue; two are usual.
const MOST_STEPS: usize = 60;

/// Eigenvalues, and the components of each vector along their eigenvectors.
pub(crate) type Components = (Vec<f64>, Vec<Vec<f64>>);

/// Eigenvalues of `a` in the space orthogonal to `columns`, and the components of `vectors` along the eigenvectors, in the same order.
/// The lower triangle of `a` is read. Columns that depend on the others to within `tolerance` of the largest one are left out.
///
/// # Errors
/// [`Error::Linalg`] with the name `what` for shapes that do not fit, or if the iteration does not converge, as with a value that is not
/// finite.
pub(crate) fn eigenvalues_with_components(
    what: &'static str,
    mut a: Array2<f64>,
    columns: Vec<Vec<f64>>,
    tolerance: f64,
    mut vectors: Vec<Vec<f64>>,
) -> Result<Components, Error> {
    let order = a.nrows();
    let mut all = vectors.iter().chain(&columns);
    if a.ncols() != order || all.any(|vector| vector.len() != order) {
        return Err(failed(
            what,
            order,
            "is not square, or not of the order of the vectors",
        ));
    }
    let not_standard = failed(what, order, "is not in row-major order");
    let rows = a.as_slice_mut().ok_or(not_standard)?;
    let left = project_out(rows, order, columns, tolerance, &mut vectors);
    for vector in &mut vectors {
        vector.truncate(left);
    }
    let (mut diagonal, mut beside) = tridiagonal(rows, order, left, &mut vectors);
    if implicit_ql(&mut diagonal, &mut beside, &mut vectors) {
        Ok((diagonal, vectors))
    } else {
        Err(failed(what, order, "has no converged eigenvalues"))
    }
}

/// Mirrors the columns one after the other, the longest first, onto the last coordinates; returns how many coordinates are left
/// before them.
fn project_out(
    rows: &mut [f64],
    order: usize,
    mut columns: Vec<Vec<f64>>,
    tolerance: f64,
    vectors: &mut [Vec<f64>],
) -> usize {
    let mut left = order;
    let mut product = vec![0.0; order];
    let mut longest = 0.0;
    while left > 1 {
        let mut norms = Vec::with_capacity(columns.len());
        for column in &columns {
            norms.push(dot(&column[..left], &column[..left]).sqrt());
        }
        let first = (0..columns.len()).max_by(|i, j| norms[*i].total_cmp(&norms[*j]));
        let Some(first) = first else {
            break;
        };
        if left == order {
            longest = norms[first];
        }
        if norms[first] <= tolerance * longest {
            break;
        }
        let mut mirror = columns.swap_remove(first);
        mirror.truncate(left);
        if let Some((half, _)) = aim_at_last(&mut mirror) {
            mirror_matrix(rows, order, &mirror, half, &mut product);
            for vector in columns.iter_mut().chain(vectors.iter_mut()) {
                mirror_vector(vector, &mirror, half);
            }
        }
        left -= 1;
    }
    left
}

/// Makes of a vector the normal of the mirror that puts it on its last coordinate; returns half the square of the normal and the last
/// coordinate of the image; none of a zero vector.
#[inline(always)]
fn aim_at_last(vector: &mut [f64]) -> Option<(f64, f64)> {
    let norm = dot(vector, vector).sqrt();
    let last = vector.last_mut()?;
    let half = norm * (norm + last.abs());
    if half == 0.0 {
        return None;
    }
    let image = -norm.copysign(*last);
    *last -= image;
    Some((half, image))
}

/// H A H of the leading part of a matrix, the lower triangle alone, H = 1 - u u^T/h: with p = A u/h and q = p - u (u·p)/(2 h) it is
/// A - u q^T - q u^T.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn mirror_matrix(rows: &mut [f64], stride: usize, mirror: &[f64], half: f64, product: &mut [f64]) {
    let order = mirror.len();
    let product = &mut product[..order];
    product.fill(0.0);
    for j in 0..order {
        let own = &rows[j * stride..j * stride + j + 1];
        product[j] += dot(own, &mirror[..j + 1]);
        add_multiple(&mut product[..j], mirror[j], &own[..j]);
    }
    for value in product.iter_mut() {
        *value /= half;
    }
    let overlap = 0.5 * dot(product, mirror) / half;
    add_multiple(product, -overlap, mirror);
    for j in 0..order {
        let own = &mut rows[j * stride..j * stride + j + 1];
        let to_product = -mirror[j];
        let to_mirror = -product[j];
        for (i, value) in own.iter_mut().enumerate() {
            *value += to_product * product[i] + to_mirror * mirror[i];
        }
    }
}

fn mirror_vector(vector: &mut [f64], mirror: &[f64], half: f64) {
    let along = dot(&vector[..mirror.len()], mirror) / half;
    add_multiple(&mut vector[..mirror.len()], -along, mirror);
}

/// y += factor x.
#[inline(always)]
fn add_multiple(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// Tridiagonal form of the leading part of a matrix: its diagonal, and beside it the elements (i + 1, i), the last of which is 0. Row by
/// row from the last, whose elements left of the diagonal are mirrored onto their last one.
fn tridiagonal(
    rows: &mut [f64],
    stride: usize,
    order: usize,
    vectors: &mut [Vec<f64>],
) -> (Vec<f64>, Vec<f64>) {
    let mut diagonal = vec![0.0; order];
    let mut beside = vec![0.0; order];
    let mut product = vec![0.0; order];
    for i in (1..order).rev() {
        let (above, row) = rows.split_at_mut(i * stride);
        diagonal[i] = row[i];
        let mirror = &mut row[..i];
        let Some((half, image)) = aim_at_last(mirror) else {
            continue;
        };
        beside[i - 1] = image;
        mirror_matrix(above, stride, mirror, half, &mut product);
        for vector in vectors.iter_mut() {
            mirror_vector(vector, mirror, half);
        }
    }
    if let Some(first) = diagonal.first_mut() {
        *first = rows[0];
    }
    (diagonal, beside)
}

/// Eigenvalues of a tridiagonal matrix in the place of its diagonal; the rotations are applied to the vectors. Returns whether all
/// converged.
fn implicit_ql(diagonal: &mut [f64], beside: &mut [f64], vectors: &mut [Vec<f64>]) -> bool {
    for first in 0..diagonal.len() {
        let mut steps = 0;
        loop {
            let last = decoupled(diagonal, beside, first);
            if last == first {
                break;
            }
            steps += 1;
            if steps > MOST_STEPS || !diagonal[first].is_finite() {
                return false;
            }
            ql_step(diagonal, beside, vectors, first..last);
        }
    }
    diagonal.iter().all(|value| value.is_finite())
}

/// The first row from `first` on whose element to the next row is rounding.
fn decoupled(diagonal: &[f64], beside: &[f64], first: usize) -> usize {
    let last = diagonal.len() - 1;
    for row in first..last {
        let scale = diagonal[row].abs() + diagonal[row + 1].abs();
        if beside[row].abs() <= f64::EPSILON * scale {
            return row;
        }
    }
    last
}

/// One implicit QL step with Wilkinson's shift on the rows of a range and the one after it.
fn ql_step(
    diagonal: &mut [f64],
    beside: &mut [f64],
    vectors: &mut [Vec<f64>],
    range: std::ops::Range<usize>,
) {
    let first = range.start;
    let last = range.end;
    let half = (diagonal[first + 1] - diagonal[first]) / (2.0 * beside[first]);
    let root = half.hypot(1.0).copysign(half);
    let mut g = diagonal[last] - diagonal[first] + beside[first] / (half + root);
    let mut sine = 1.0;
    let mut cosine = 1.0;
    let mut shift = 0.0;
    for i in range.rev() {
        let f = sine * beside[i];
        let b = cosine * beside[i];
        let r = f.hypot(g);
        beside[i + 1] = r;
        if r == 0.0 {
            diagonal[i + 1] -= shift;
            beside[last] = 0.0;
            return;
        }
        sine = f / r;
        cosine = g / r;
        g = diagonal[i + 1] - shift;
        let t = (diagonal[i] - g) * sine + 2.0 * cosine * b;
        shift = sine * t;
        diagonal[i + 1] = g + shift;
        g = cosine * t - b;
        for vector in vectors.iter_mut() {
            let other = vector[i + 1];
            vector[i + 1] = sine * vector[i] + cosine * other;
            vector[i] = cosine * vector[i] - sine * other;
        }
    }
    diagonal[first] -= shift;
    beside[first] = g;
    beside[last] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::hermitian_eigen;

    fn covariance(order: usize) -> Array2<f64> {
        Array2::from_shape_fn((order, order), |(i, j)| {
            let lag = i.abs_diff(j) as f64;
            (-lag / 7.0).exp() * (0.3 * (i + j) as f64).cos()
        })
    }

    fn wave(order: usize, per_index: f64) -> Vec<f64> {
        (0..order).map(|i| (per_index * i as f64).sin()).collect()
    }

    #[test]
    fn eigenvalues_and_components_are_those_of_the_eigenvectors() {
        for order in [1, 2, 3, 17, 60] {
            let a = covariance(order);
            let waves = vec![wave(order, 1.7), wave(order, 0.4)];
            let (values, vectors) = hermitian_eigen("test", a.view()).unwrap();
            let (found, components) =
                eigenvalues_with_components("test", a, Vec::new(), 0.0, waves.clone()).unwrap();
            let mut sorted: Vec<usize> = (0..order).collect();
            sorted.sort_by(|i, j| found[*i].total_cmp(&found[*j]));
            for (i, own) in sorted.into_iter().enumerate() {
                let column = vectors.column(i).to_vec();
                assert!((found[own] - values[i]).abs() < 1e-12, "{order} {i}");
                for (wave, components) in waves.iter().zip(&components) {
                    let expected = dot(&column, wave).abs();
                    assert!(
                        (components[own].abs() - expected).abs() < 1e-9,
                        "{order} {i}"
                    );
                }
            }
        }
    }

    /// With P = 1 - Q Q^T, Q an orthonormal basis of the columns, the eigenvalues are those of P A P but for a zero for each column.
    #[test]
    fn columns_are_projected_out_and_dependent_ones_left_out() {
        let order = 30;
        let columns = vec![vec![1.0; order], wave(order, 0.2), vec![-3.0; order]];
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for column in &columns[..2] {
            let mut rest = column.clone();
            for other in &basis {
                let along = dot(&rest, other);
                add_multiple(&mut rest, -along, other);
            }
            let norm = dot(&rest, &rest).sqrt();
            basis.push(rest.iter().map(|value| value / norm).collect());
        }
        let mut projector = Array2::eye(order);
        for column in &basis {
            for ((i, j), value) in projector.indexed_iter_mut() {
                *value -= column[i] * column[j];
            }
        }
        let projected = projector.dot(&covariance(order)).dot(&projector);
        let vector = wave(order, 1.1);
        let (values, vectors) = hermitian_eigen("test", projected.view()).unwrap();
        let (found, components) = eigenvalues_with_components(
            "test",
            covariance(order),
            columns,
            1e-4,
            vec![vector.clone()],
        )
        .unwrap();
        assert_eq!(found.len(), order - 2);
        let mut expected = 0.0;
        for (value, column) in values.iter().zip(vectors.columns()) {
            expected += value * dot(&column.to_vec(), &vector).powi(2);
        }
        let mut sum = 0.0;
        for (value, component) in found.iter().zip(&components[0]) {
            sum += value * component * component;
        }
        assert!((sum / expected - 1.0).abs() < 1e-12, "{sum} {expected}");
        let trace: f64 = found.iter().sum();
        assert!((trace - values.sum()).abs() < 1e-11);
    }

    #[test]
    fn equal_eigenvalues_keep_the_length_of_the_vector_and_bad_numbers_are_errors() {
        let of = |a: Array2<f64>| {
            eigenvalues_with_components("test", a, Vec::new(), 0.0, vec![vec![2.0; 9]])
        };
        let (values, components) = of(Array2::eye(9)).unwrap();
        assert!(values.iter().all(|value| *value == 1.0));
        assert!((dot(&components[0], &components[0]) - 36.0).abs() < 1e-12);
        assert!(of(Array2::from_elem((9, 9), f64::NAN)).is_err());
        assert!(of(Array2::eye(8)).is_err());
    }
}
