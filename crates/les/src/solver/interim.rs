//! Stands in for the pressure solver.
use super::layout::Layout;
use super::momentum::*;
use super::pressure::{PressureSolver, Solved};
use super::projection::Divergence;
use crate::Error;
#[derive(Debug, Clone, Copy, PartialEq)]
/// Which pressure solver.
#[allow(missing_docs)]
pub enum PressureMethod {
    Auto,
}
#[derive(Debug)]
struct Cg {
    ops: [Momentum; 3],
    div: Divergence,
    layout: Layout,
}
impl Cg {
    fn apply(&self, p: &[f64], out: &mut [f64]) {
        let s = self.layout.shape;
        let mut sc = Scratch::new(s.n[0]);
        let mut g = [vec![0.0; s.len()], vec![0.0; s.len()], vec![0.0; s.len()]];
        for a in 0..3 {
            for k in 0..s.n[2] {
                for j in 0..s.n[1] {
                    sc.gradient(&self.ops[a], p, j, k);
                    g[a][s.row(j, k)].copy_from_slice(&sc.pressure);
                }
            }
        }
        self.div.apply([&g[0], &g[1], &g[2]], -1.0, out);
    }
}
impl PressureSolver for Cg {
    fn solve(&mut self, f: &mut [f64], tol: f64) -> Result<Solved, Error> {
        let n = f.len();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let mut r: Vec<f64> = f.iter().map(|v| -v).collect();
        let m: f64 = r.iter().sum::<f64>() / n as f64;
        for v in &mut r {
            *v -= m;
        }
        let r0 = dot(&r, &r);
        f.fill(0.0);
        if r0 == 0.0 {
            return Ok(Solved { residual: None, iterations: 0, factor: None, imbalance: 0.0 });
        }
        let mut p = r.clone();
        let mut rr = r0;
        let mut ap = vec![0.0; n];
        let mut it = 0;
        while rr > 1e-26 * r0 && it < 4000 {
            self.apply(&p, &mut ap);
            let al = rr / dot(&p, &ap);
            for i in 0..n {
                f[i] += al * p[i];
                r[i] -= al * ap[i];
            }
            let m: f64 = r.iter().sum::<f64>() / n as f64;
            for v in &mut r {
                *v -= m;
            }
            let nn = dot(&r, &r);
            let b = nn / rr;
            rr = nn;
            for i in 0..n {
                p[i] = r[i] + b * p[i];
            }
            it += 1;
        }
        let _ = tol;
        Ok(Solved { residual: Some((rr / r0).sqrt()), iterations: it, factor: None, imbalance: 0.0 })
    }
    fn describe(&self) -> String {
        "cg".into()
    }
}
pub(crate) fn build(layout: &Layout, _m: PressureMethod) -> Result<Box<dyn PressureSolver>, Error> {
    Ok(Box::new(Cg {
        ops: std::array::from_fn(|a| Momentum::new(layout, a)),
        div: Divergence::new(layout),
        layout: layout.clone(),
    }))
}
