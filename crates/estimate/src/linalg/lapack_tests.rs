//! The bundled symbols called as ndarray-linalg calls them: residuals, `info`, leading dimensions, queries.

use super::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

type C64 = Complex<f64>;

trait Case: Scalar<Real = f64> {
    fn draw(rng: &mut Xoshiro256PlusPlus) -> Self;
    fn getrf(m: i32, n: i32, a: &mut [Self], lda: i32, ipiv: &mut [i32]) -> i32;
    #[allow(clippy::too_many_arguments)]
    fn getrs(trans: u8, n: i32, a: &[Self], lda: i32, ipiv: &[i32], b: &mut [Self], ldb: i32, nrhs: i32) -> i32;
    fn heev(jobz: u8, uplo: u8, n: i32, a: &mut [Self], lda: i32, w: &mut [f64]) -> i32;
}

macro_rules! case {
    ($scalar:ty, $draw:expr, $getrf:ident, $getrs:ident, $heev:ident, $($rwork:expr)?) => {
        impl Case for $scalar {
            fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
                $draw(rng)
            }
            fn getrf(m: i32, n: i32, a: &mut [Self], lda: i32, ipiv: &mut [i32]) -> i32 {
                let mut info = 77;
                // SAFETY: the tests pass slices of sufficient length
                unsafe { $getrf(&m, &n, a.as_mut_ptr(), &lda, ipiv.as_mut_ptr(), &mut info) };
                info
            }
            fn getrs(trans: u8, n: i32, a: &[Self], lda: i32, ipiv: &[i32], b: &mut [Self], ldb: i32, nrhs: i32) -> i32 {
                let (mut info, trans) = (77, trans as c_char);
                // SAFETY: as above
                unsafe { $getrs(&trans, &n, &nrhs, a.as_ptr(), &lda, ipiv.as_ptr(), b.as_mut_ptr(), &ldb, &mut info) };
                info
            }
            fn heev(jobz: u8, uplo: u8, n: i32, a: &mut [Self], lda: i32, w: &mut [f64]) -> i32 {
                let (mut info, mut query, jobz, uplo) = (77, [Self::from_real(0.0)], jobz as c_char, uplo as c_char);
                // SAFETY: a workspace query touches only `query` and `info`
                unsafe {
                    $heev(&jobz, &uplo, &n, std::ptr::null_mut(), &lda, std::ptr::null_mut(),
                        query.as_mut_ptr(), &-1, $($rwork,)? &mut info);
                }
                if info != 0 {
                    return info;
                }
                let lwork = query[0].re() as i32;
                assert!(lwork >= 1);
                let mut work = vec![Self::from_real(0.0); lwork as usize];
                // SAFETY: as above, with the memory that the query asked for
                unsafe {
                    $heev(&jobz, &uplo, &n, a.as_mut_ptr(), &lda, w.as_mut_ptr(),
                        work.as_mut_ptr(), &lwork, $($rwork,)? &mut info);
                }
                info
            }
        }
    };
}

fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

case!(f64, normal, dgetrf_, dgetrs_, dsyev_,);
case!(C64, |rng: &mut _| C64::new(normal(rng), normal(rng)), zgetrf_, zgetrs_, zheev_, std::ptr::null_mut());

/// A random order x order matrix in memory with leading dimension lda.
fn random<T: Case>(order: usize, lda: usize, seed: u64) -> Vec<T> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..lda * order).map(|_| T::draw(&mut rng)).collect()
}

fn solves<T: Case>() {
    for (order, lda) in [(1, 1), (1, 4), (2, 2), (5, 9), (24, 24), (64, 67)] {
        let a = random::<T>(order, lda, order as u64);
        let mut factors = a.clone();
        let mut pivots = vec![0; order];
        assert_eq!(T::getrf(order as i32, order as i32, &mut factors, lda as i32, &mut pivots), 0);
        // the padding between columns is not touched
        for (place, (before, after)) in a.iter().zip(&factors).enumerate() {
            assert!(place % lda < order || before == after);
        }
        let (ldb, right) = (order + 2, 3);
        for trans in *b"NTCn" {
            let b = random::<T>(right, ldb, 99);
            let mut x = b.clone();
            let info = T::getrs(trans, order as i32, &factors, lda as i32, &pivots, &mut x, ldb as i32, right as i32);
            assert_eq!(info, 0);
            for column in 0..right {
                for i in 0..order {
                    let product = (0..order).fold(T::zero(), |sum, j| {
                        let element = match trans {
                            b'T' => a[j + i * lda],
                            b'C' => a[j + i * lda].conj(),
                            _ => a[i + j * lda],
                        };
                        sum + element * x[j + column * ldb]
                    });
                    assert!((product - b[i + column * ldb]).abs() < 1e-11, "{order} {trans}");
                }
                assert_eq!(x[order + column * ldb], b[order + column * ldb]);
            }
        }
    }
}

#[test]
fn solutions_leave_no_residual_real_and_complex() {
    solves::<f64>();
    solves::<C64>();
}

fn diagonalises<T: Case>() {
    for (order, lda) in [(1, 3), (2, 2), (7, 7), (24, 30), (64, 64)] {
        let raw = random::<T>(order, order, 7 + order as u64);
        let element = |i: usize, j: usize| raw[i + j * order] + raw[j + i * order].conj();
        for uplo in *b"UL" {
            // the other triangle holds rubbish that must not be read
            let mut a = vec![T::from_real(f64::NAN); lda * order];
            for j in 0..order {
                for i in (0..order).filter(|&i| i == j || (i > j) == (uplo == b'L')) {
                    a[i + j * lda] = element(i, j);
                }
            }
            let mut only = vec![0.0; order];
            assert_eq!(T::heev(b'N', uplo, order as i32, &mut a.clone(), lda as i32, &mut only), 0);
            let mut values = vec![0.0; order];
            assert_eq!(T::heev(b'V', uplo, order as i32, &mut a, lda as i32, &mut values), 0);
            assert_eq!(only, values);
            assert!(values.is_sorted());
            let trace: f64 = (0..order).map(|i| element(i, i).re()).sum();
            assert!((trace - values.iter().sum::<f64>()).abs() < 1e-11);
            for (k, value) in values.iter().enumerate() {
                let vector = &a[k * lda..k * lda + order];
                for i in 0..order {
                    let product = (0..order).fold(T::zero(), |sum, j| sum + element(i, j) * vector[j]);
                    assert!((product - vector[i].mul_real(*value)).abs() < 1e-11, "{order}");
                }
                let norm: f64 = vector.iter().map(|x| x.abs().powi(2)).sum();
                assert!((norm - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn eigenvectors_leave_no_residual_real_and_complex() {
    diagonalises::<f64>();
    diagonalises::<C64>();
}

#[test]
fn singular_matrices_report_the_first_zero_pivot() {
    // columns 2 and 3 are multiples of column 1
    let mut a = [1.0, 2.0, 4.0, 2.0, 4.0, 8.0, 3.0, 6.0, 12.0];
    let mut pivots = [0; 3];
    assert_eq!(f64::getrf(3, 3, &mut a, 3, &mut pivots), 2);
    assert_eq!(C64::getrf(1, 1, &mut [C64::ZERO], 1, &mut [0]), 1);
}

#[test]
fn rectangular_matrices_are_factored() {
    // 3 x 2: P A = L U with L unit lower trapezoidal
    let a = [1.0, 4.0, 2.0, 3.0, 5.0, 7.0];
    let (mut lu, mut pivots) = (a, [0; 2]);
    assert_eq!(f64::getrf(3, 2, &mut lu, 3, &mut pivots), 0);
    let mut rows: Vec<[f64; 2]> = (0..3).map(|i| [a[i], a[i + 3]]).collect();
    pivots.iter().enumerate().for_each(|(k, &p)| rows.swap(k, p as usize - 1));
    for (i, row) in rows.iter().enumerate() {
        let l = [[1.0, 0.0], [lu[1], 1.0], [lu[2], lu[5]]][i];
        assert!((l[0] * lu[0] - row[0]).abs() < 1e-14);
        assert!((l[0] * lu[3] + l[1] * lu[4] - row[1]).abs() < 1e-14);
    }
}

#[test]
fn empty_matrices_succeed_and_wrong_arguments_are_named() {
    assert_eq!(f64::getrf(0, 0, &mut [], 1, &mut []), 0);
    assert_eq!(f64::getrs(b'N', 0, &[], 1, &[], &mut [], 1, 1), 0);
    assert_eq!(C64::heev(b'V', b'L', 0, &mut [], 1, &mut []), 0);
    assert_eq!(f64::getrf(-1, 2, &mut [], 1, &mut []), -1);
    assert_eq!(f64::getrf(2, 2, &mut [0.0; 4], 1, &mut [0; 2]), -4);
    assert_eq!(f64::getrs(b'X', 1, &[1.0], 1, &[1], &mut [1.0], 1, 1), -1);
    assert_eq!(f64::heev(b'Q', b'L', 1, &mut [1.0], 1, &mut [0.0]), -1);
    assert_eq!(f64::heev(b'V', b'Q', 1, &mut [1.0], 1, &mut [0.0]), -2);
    assert_eq!(f64::heev(b'V', b'L', 2, &mut [1.0; 4], 1, &mut [0.0; 2]), -5);
    // not converged: NaN
    assert!(C64::heev(b'V', b'L', 2, &mut [C64::new(f64::NAN, 0.0); 4], 2, &mut [0.0; 2]) > 0);
}

#[test]
fn rank_one_and_equal_eigenvalues_converge() {
    let order = 40;
    let mut ones = vec![1.0; order * order];
    let mut values = vec![0.0; order];
    assert_eq!(f64::heev(b'V', b'U', order as i32, &mut ones, order as i32, &mut values), 0);
    assert!((values[order - 1] - order as f64).abs() < 1e-12);
    assert!(values[..order - 1].iter().all(|value| value.abs() < 1e-12));
    let mut unit: Vec<C64> = (0..9).map(|k| C64::from_real(f64::from(k % 4 == 0))).collect();
    assert_eq!(C64::heev(b'V', b'L', 3, &mut unit, 3, &mut values[..3]), 0);
    assert_eq!(values[..3], [1.0; 3]);
}
