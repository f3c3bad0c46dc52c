"""Phase screens: expected structure function against quadrature, processor time of a screen.

Von Karman with a Gaussian inner scale of 1 cm, kappa0 = 1 rad/m, 2 mm between points. Where a scheme is a sum of independent
modes its EXPECTED structure function is computed, without noise; HCIPy's is measured. The error is the worst from two points to half the grid.
"""
import warnings
from importlib.metadata import version

import aotools
import hcipy
import numpy as np
import scipy.fft
import scipy.special
from aotools.turbulence import phasescreen

from common import REFERENCE, fastest, numbers, write

warnings.filterwarnings("ignore")
SPACING_M, INNER_M, CONSTANT = 2e-3, 1e-2, 0.0330054
R0_M, OUTER_M = 0.1, 2 * np.pi
SIZES = (128, 256, 512)
PANEL = "phase screens"


def density(k):
    """Spectrum over Cn2."""
    return CONSTANT * np.exp(-((k * INNER_M / 5.92) ** 2)) * (k * k + 1.0) ** (-11 / 6)


def exact(r):
    """Structure function for unit k^2 Cn2 dz, by quadrature."""
    x, w = np.polynomial.legendre.leggauss(64)
    edges = np.concatenate([[0], np.geomspace(1e-3, 6e3, 400)])
    low, high = edges[:-1, None], edges[1:, None]
    k, weight = 0.5 * (high - low) * x + 0.5 * (high + low), 0.5 * (high - low) * w
    return 8 * np.pi**2 * np.sum(weight * k * (1 - scipy.special.j0(k * r)) * density(k))


def expected(levels, r, n):
    """The same of screens of n points with levels of subharmonics as Lane, Glindemann and Dainty have them."""
    step = 2 * np.pi / (n * SPACING_M)

    def cells(half, step):
        i = np.arange(-half, half + 1) * step
        value = density(np.hypot(i[:, None], i[None]))
        value[half, half] = 0
        return np.sum(value * step * step * (1 - np.cos(i[:, None] * r)))

    return 4 * np.pi * (cells(n // 2 - 1, step) + sum(cells(1, step / 3**level) for level in range(1, levels + 1)))


def separations(n):
    return [s for s in (2, 4, 8, 16, 32, 64, 128, 256) if s <= n // 2]


def worst(levels, n):
    return max(abs(expected(levels, s * SPACING_M, n) / exact(s * SPACING_M) - 1) for s in separations(n))


def measured(layer, n, screens):
    """Largest relative error of the mean over screens, and its standard error."""
    found = []
    for _ in range(screens):
        layer.reset(make_independent_realization=True)
        p = np.asarray(layer.phase_for(1.55e-6)).reshape(n, n)
        found.append([0.5 * (np.mean((p[s:] - p[:-s]) ** 2) + np.mean((p[:, s:] - p[:, :-s]) ** 2)) for s in separations(n)])
    mean, error = np.mean(found, 0), np.std(found, 0) / np.sqrt(screens)
    truth = np.array([exact(s * SPACING_M) for s in separations(n)]) * R0_M ** (-5 / 3) / 0.42301
    at = np.argmax(abs(mean / truth - 1))
    return abs(mean / truth - 1)[at], (error / truth)[at]


rows = []
stored = {row[0]: row[1] for row in numbers(REFERENCE / "optics/structure_function_vonkarman.csv")}
near = min(stored, key=lambda r: abs(r - 0.1))
assert abs(exact(near) / CONSTANT * 0.033 / stored[near] - 1) < 1e-9, "the quadrature is not that of the reference"
for n in SIZES:
    for name, levels, make in (
        ("AOtools, plain", 0, phasescreen.ft_phase_screen),
        ("AOtools, subharmonics", 3, phasescreen.ft_sh_phase_screen),
    ):
        seconds = fastest(lambda: make(R0_M, n, SPACING_M, OUTER_M, INNER_M), 3)
        rows.append((PANEL, name, version("aotools"), n, worst(levels, n), 0, seconds))
    grid = hcipy.make_pupil_grid(n, n * SPACING_M)
    strength = hcipy.Cn_squared_from_fried_parameter(R0_M, 1.55e-6)
    layer = hcipy.FiniteAtmosphericLayer(grid, strength, L0=OUTER_M, velocity=0, height=0, seed=1)
    seconds = fastest(lambda: (layer.reset(), layer.phase_for(1.55e-6)), 3)
    rows.append((PANEL, "HCIPy", version("hcipy"), n, *measured(layer, n, 60 if n == 512 else 200), seconds))
    # What a user would write: amplitudes in a table, two screens of one complex transform, no low frequencies.
    f = np.fft.fftfreq(n) * 2 * np.pi / SPACING_M
    amplitude = np.sqrt(2 * np.pi * density(np.hypot(f[:, None], f[None]))) * 2 * np.pi / (n * SPACING_M)
    amplitude[0, 0] = 0
    single, rng = amplitude.astype(np.float32), np.random.default_rng(1)

    def double_pair():
        return np.fft.fft2(amplitude * (rng.standard_normal((n, n)) + 1j * rng.standard_normal((n, n))))

    def single_pair():
        z = np.empty((n, n), np.complex64)
        rng.standard_normal(out=z.view(np.float32), dtype=np.float32)
        z *= single
        return scipy.fft.fft2(z, workers=1, overwrite_x=True)

    rows.append((PANEL, "numpy, plain", version("numpy"), n, worst(0, n), 0, fastest(double_pair) / 2))
    rows.append((PANEL, "scipy f32, plain", version("scipy"), n, worst(0, n), 0, fastest(single_pair) / 2))
write("screens", rows)
