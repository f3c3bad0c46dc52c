"""Maxima of the restricted likelihood (A15) of the scan in elevation of edr_cells.csv with the exact covariance of its gates.

python3 edr_fit_exact.py > edr_fit_exact.csv        (NumPy and SciPy; a minute)

edr_fit.csv takes beams less than 0.1 rad apart as parallel, so that its covariances of this scan are up to 0.4 % of the variance too
large. Here gates of any two beams are integrated over 121 x 121 nodes, parallel ones over 4001 (A13).
"""

import csv
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import gamma, kv

FOLDER = Path(__file__).parent
GATE_STD_M = 14.36
KOLMOGOROV = 1.5
FEW, MANY = (np.linspace(-5, 5, count) for count in (121, 4001))


def rows(name):
    lines = (FOLDER / name).read_text().splitlines()
    return [row for row in csv.DictReader(line for line in lines if not line.startswith("#")) if row["set"] == "rhi"]


def correlations(outer_scale_m):
    """B_LL and B_NN of von Karman's spectrum over the variance, at distances in m."""
    roots = np.linspace(0, 1200 ** (1 / 3), 60001)
    x = np.maximum(roots**3 / outer_scale_m, 1e-9)
    factor = 2 / gamma(1 / 3) * (x / 2) ** (1 / 3)
    along = factor * kv(1 / 3, x)
    across = along - factor * x / 2 * kv(2 / 3, x)
    return lambda r: (np.interp(np.cbrt(r), roots, along), np.interp(np.cbrt(r), roots, across))


def variance_m2_s2(outer_scale_m):
    """Of a dissipation of 1 m2/s3: D_LL = 27/55 Gamma(1/3) C r^(2/3) at small r."""
    constant = 27 / 55 * gamma(1 / 3) * KOLMOGOROV
    return constant * (2 * outer_scale_m) ** (2 / 3) * gamma(4 / 3) / (2 * gamma(2 / 3))


def weights(nodes):
    values = np.exp(-(nodes**2) / 2)
    return values / values.sum()


def covariance(directions, ranges_m, outer_scale_m):
    correlation = correlations(outer_scale_m)
    count = len(ranges_m)
    out = np.zeros((count, count))
    for i in range(count):
        for j in range(i + 1):
            a, b = directions[i], directions[j]
            apart_m = ranges_m[i] * a - ranges_m[j] * b
            if a @ b > 1 - 1e-12:
                r_m = np.abs(apart_m @ a + np.sqrt(2) * GATE_STD_M * MANY)
                out[i, j] = weights(MANY) @ correlation(r_m)[0]
            else:
                r_m = apart_m + GATE_STD_M * (FEW[:, None, None] * a - FEW[None, :, None] * b)
                square = np.maximum((r_m**2).sum(axis=2), 1e-30)
                along, across = correlation(np.sqrt(square))
                product = across * (a @ b) + (along - across) * (r_m @ a) * (r_m @ b) / square
                out[i, j] = weights(FEW) @ product @ weights(FEW)
            out[j, i] = out[i, j]
    return variance_m2_s2(outer_scale_m) * out


def maximum(covariance_m2_s2, velocity_m_s, mean):
    basis, _, _ = np.linalg.svd(mean / np.linalg.norm(mean, axis=0))
    basis = basis[:, mean.shape[1] :]
    values, vectors = np.linalg.eigh(basis.T @ covariance_m2_s2 @ basis)
    square = (vectors.T @ (basis.T @ velocity_m_s)) ** 2

    def loss(logarithms):
        variance = np.exp(logarithms[0]) * values + np.exp(logarithms[1])
        return 0.5 * np.sum(np.log(variance) + square / variance) if (variance > 0).all() else 1e9

    found = minimize(loss, np.log([0.05, 0.06]), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-11, "maxiter": 4000})
    eps23, noise = np.exp(found.x)
    scaled = np.array([values, np.ones_like(values)]) / (eps23 * values + noise)
    std = np.sqrt(np.linalg.inv(0.5 * scaled @ scaled.T)[0, 0])
    return -found.fun, eps23, noise, std


def main():
    cells = rows("edr_cells.csv")
    directions = np.array([[float(row[name]) for name in ("e_east", "e_north", "e_up")] for row in cells])
    ranges_m = np.array([float(row["range_m"]) for row in cells])
    velocity_m_s = np.array([float(row["velocity_m_s"]) for row in cells])
    height_m = directions[:, 2] * ranges_m
    plane = directions[:, [0, 2]]
    mean = np.hstack([plane, plane * (height_m - height_m.mean())[:, None]])
    print("# What: maxima of the restricted likelihood of the scan in elevation of edr_cells with exact covariances.")
    print("# Source: edr_fit_exact.py. Units in the column names. Uncertainty: 1e-3 of the numbers, 0.01 of the likelihood.")
    columns = ["gate_std_m", "advection_east_m_s", "advection_north_m_s", "mean_columns"]
    print(",".join(["set", *columns, "outer_scale_m", "loglik", "eps23", "noise_variance_m2_s2", "std_eps23"]))
    for row in rows("edr_fit.csv"):
        outer_scale_m = float(row["outer_scale_m"])
        found = maximum(covariance(directions, ranges_m, outer_scale_m), velocity_m_s, mean)
        known = [row[name] for name in columns]
        print(",".join(["rhi", *known, row["outer_scale_m"], *(f"{value:.10g}" for value in found)]))


main()
