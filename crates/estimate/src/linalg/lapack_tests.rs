//! The bundled symbols called as ndarray-linalg calls them: residuals, `info`, leading dimensions, queries.

use super::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

type C64 = Complex<f64>;

trait Case: Scalar<Real = f64> {
    fn draw(rng: &mut Xoshiro256PlusPlus) -> Self;
    fn heev(jobz: u8, uplo: u8, n: i32, a: &mut [Self], lda: i32, w: &mut [f64]) -> i32;
}

macro_rules! case {
    ($scalar:ty, $draw:expr, $heev:ident, $($rwork:expr)?) => {
        impl Case for $scalar {
            fn draw(rng: &mut Xoshiro256PlusPlus) -> Self {
                $draw(rng)
            }
            fn heev(jobz: u8, uplo: u8, n: i32, a: &mut [Self], lda: i32, w: &mut [f64]) -> i32 {
                let mut info = 77;
                let mut query = [Self::from_real(0.0)];
                let jobz = jobz as c_char;
                let uplo = uplo as c_char;
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
                // SAFETY: the tests pass slices of sufficient length, with the memory that the query asked for
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

case!(f64, normal, dsyev_,);
case!(
    C64,
    |rng: &mut _| C64::new(normal(rng), normal(rng)),
    zheev_,
    std::ptr::null_mut()
);

/// A random order x order matrix in memory with leading dimension lda.
fn random<T: Case>(order: usize, lda: usize, seed: u64) -> Vec<T> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..lda * order).map(|_| T::draw(&mut rng)).collect()
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
            assert_eq!(
                T::heev(
                    b'N',
                    uplo,
                    order as i32,
                    &mut a.clone(),
                    lda as i32,
                    &mut only
                ),
                0
            );
            let mut values = vec![0.0; order];
            assert_eq!(
                T::heev(b'V', uplo, order as i32, &mut a, lda as i32, &mut values),
                0
            );
            assert_eq!(only, values);
            assert!(values.is_sorted());
            let trace: f64 = (0..order).map(|i| element(i, i).re()).sum();
            assert!((trace - values.iter().sum::<f64>()).abs() < 1e-11);
            for (k, value) in values.iter().enumerate() {
                let vector = &a[k * lda..k * lda + order];
                for i in 0..order {
                    let product =
                        (0..order).fold(T::zero(), |sum, j| sum + element(i, j) * vector[j]);
                    assert!(
                        (product - vector[i].mul_real(*value)).abs() < 1e-11,
                        "{order}"
                    );
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
fn empty_matrices_succeed_and_wrong_arguments_are_named() {
    assert_eq!(C64::heev(b'V', b'L', 0, &mut [], 1, &mut []), 0);
    assert_eq!(f64::heev(b'Q', b'L', 1, &mut [1.0], 1, &mut [0.0]), -1);
    assert_eq!(f64::heev(b'V', b'Q', 1, &mut [1.0], 1, &mut [0.0]), -2);
    assert_eq!(
        f64::heev(b'V', b'L', 2, &mut [1.0; 4], 1, &mut [0.0; 2]),
        -5
    );
    // not converged: NaN
    assert!(
        C64::heev(
            b'V',
            b'L',
            2,
            &mut [C64::new(f64::NAN, 0.0); 4],
            2,
            &mut [0.0; 2]
        ) > 0
    );
}

#[test]
fn rank_one_and_equal_eigenvalues_converge() {
    let order = 40;
    let mut ones = vec![1.0; order * order];
    let mut values = vec![0.0; order];
    assert_eq!(
        f64::heev(
            b'V',
            b'U',
            order as i32,
            &mut ones,
            order as i32,
            &mut values
        ),
        0
    );
    assert!((values[order - 1] - order as f64).abs() < 1e-12);
    assert!(values[..order - 1].iter().all(|value| value.abs() < 1e-12));
    let mut unit: Vec<C64> = (0..9)
        .map(|k| C64::from_real(f64::from(k % 4 == 0)))
        .collect();
    assert_eq!(C64::heev(b'V', b'L', 3, &mut unit, 3, &mut values[..3]), 0);
    assert_eq!(values[..3], [1.0; 3]);
}
