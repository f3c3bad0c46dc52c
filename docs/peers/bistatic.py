"""Bistatic efficiency by split steps with screens of others, against the exact theory for these very screens.

Table 2's beam, Cn2 = 1e-13, 1000 m, five screens in the middles of their layers, 256 x 256 points 4 mm apart, kappa0 = 1 rad/m, inner scale 1 cm.
A row is a number of realisations: the root of the squares of the bias (that of the scheme's own structure function by exact theory,
measured where there is none, and that of five layers) and of the standard error, which falls from the one measured.
"""
import warnings
from importlib.metadata import version

import hcipy
import numpy as np
import scipy.fft
import scipy.special
from aotools.turbulence import phasescreen
from scipy.interpolate import CubicSpline

from common import cpu_s, write

warnings.filterwarnings("ignore")
WAVELENGTH_M, BEAM_M, APERTURE_M, RANGE_M, CN2 = 1.55e-6, 0.03, 0.05, 1000.0, 1e-13
N, D, LAYERS = 256, 4e-3, 5
MEASURED, DRAWN = 250, (50, 200, 800, 3200, 12800, 51200)
k, dz = 2 * np.pi / WAVELENGTH_M, RANGE_M / LAYERS
thin = k * k * CN2 * dz
middles_m = (np.arange(LAYERS) + 0.5) * dz
legendre = np.polynomial.legendre.leggauss


def density(q):
    return 0.0330054 * np.exp(-((q / 592.0) ** 2)) * (q * q + 1.0) ** (-11 / 6)


def pieces(edges, order):
    x, w = legendre(order)
    low, high = edges[:-1, None], edges[1:, None]
    return (0.5 * (high - low) * x + 0.5 * (high + low)).ravel(), (0.5 * (high - low) * w).ravel()


q, wq = pieces(np.concatenate([[0], np.geomspace(1e-3, 6e3, 250)]), 48)
table_m = np.linspace(0, 2 * APERTURE_M, 401)
table = np.array([np.sum(8 * np.pi**2 * wq * q * density(q) * (1 - scipy.special.j0(q * r))) for r in table_m])


def overlap(rho):
    """Mutual coherence of the beam, integrated over the lens that two shifted apertures share."""
    y, wy = legendre(120)
    half = np.sqrt(APERTURE_M**2 * (1 - y * y)) - rho / 2
    y, half, wy = APERTURE_M * y[half > 0], half[half > 0], APERTURE_M * wy[half > 0]
    x, wx = legendre(120)
    x = half[:, None] * x
    amplitude = np.exp(-(x**2 + (rho / 2) ** 2 + y[:, None] ** 2) / BEAM_M**2) / (np.pi * BEAM_M**2)
    return np.sum(wy * half * np.sum(wx * amplitude * np.exp(1j * k * x * rho / RANGE_M), axis=1))


rho, wrho = pieces(np.array([0, 2 * APERTURE_M]), 96)
overlap2 = np.array([abs(overlap(r)) ** 2 for r in rho])


def efficiency(structure):
    return np.sum(wrho * 2 * np.pi * rho * overlap2 * np.exp(-structure)) / (np.pi * APERTURE_M**2)


def of_screens(middles_m, thickness_m):
    return sum(k * k * CN2 * thickness_m * np.interp(rho * (1 - z / RANGE_M), table_m, table) for z in middles_m)


free, exact = efficiency(0), efficiency(of_screens(middles_m, dz))
continuous = efficiency(of_screens((np.arange(400) + 0.5) * RANGE_M / 400, RANGE_M / 400))
layers_bias = exact / continuous - 1  # of five layers against the continuous path


def scheme_bias(levels):
    """Bias of screens whose expected structure function is that of a sum of modes with levels of subharmonics."""
    step, total, angles = 2 * np.pi / (N * D), 0, (np.arange(4) + 0.5) * np.pi / 8
    grids = []
    for half, d in [(N // 2 - 1, step)] + [(1, step / 3**level) for level in range(1, levels + 1)]:
        i = np.arange(-half, half + 1) * d
        power = density(np.hypot(i[:, None], i[None])) * d * d
        power[half, half] = 0
        grids.append((i, power))
    shown = slice(None, None, 3)
    for angle in angles:
        structure = np.zeros(len(rho[shown]))
        for j, r in enumerate(rho[shown]):
            for z in middles_m:
                s = r * (1 - z / RANGE_M)
                for i, power in grids:
                    ex, ey = np.exp(1j * i * s * np.cos(angle)), np.exp(1j * i * s * np.sin(angle))
                    structure[j] += thin * 4 * np.pi * (power.sum() - np.real(ex @ power @ ey))
        smooth = CubicSpline(np.append(0, rho[shown]), np.append(0, structure))
        total = total + smooth(rho) / len(angles)
    return efficiency(total) / exact - 1


x = (np.arange(N) - N // 2) * D
x, y = np.meshgrid(x, x, indexing="ij")
beam = (np.exp(-(x * x + y * y) / (2 * BEAM_M**2)) / np.sqrt(np.pi * BEAM_M**2) * (np.hypot(x, y) <= APERTURE_M)).astype(np.complex64)
f2 = np.add.outer(np.fft.fftfreq(N, D) ** 2, np.fft.fftfreq(N, D) ** 2)
half_step, whole_step = (np.exp(-1j * np.pi * WAVELENGTH_M * z * f2).astype(np.complex64) for z in (dz / 2, dz))
edge = np.exp(-((x / (0.47 * N * D)) ** 16 + (y / (0.47 * N * D)) ** 16)).astype(np.float32)


def fft(u):
    return scipy.fft.fft2(u, workers=1)


def walk(screens):
    """Intensity at the range."""
    u = scipy.fft.ifft2(fft(beam) * half_step, workers=1)
    for i, phase in enumerate(screens):
        u = u * np.exp(1j * phase.astype(np.float32))
        u = scipy.fft.ifft2(fft(u) * (whole_step if i < LAYERS - 1 else half_step), workers=1) * edge
    return (u.real**2 + u.imag**2).astype(np.float64)


rng = np.random.default_rng(1)
amplitude = (np.sqrt(2 * np.pi * thin * density(2 * np.pi * np.sqrt(f2))) * 2 * np.pi / (N * D)).astype(np.float32)
amplitude[0, 0] = 0
r0_m = (0.42301 * thin) ** (-3 / 5)
grid = hcipy.make_pupil_grid(N, N * D)
hcipy_layers = [hcipy.FiniteAtmosphericLayer(grid, CN2 * dz, L0=2 * np.pi, velocity=0, height=0, seed=i) for i in range(LAYERS)]


def pairs():
    out = []
    for _ in range((LAYERS + 1) // 2):
        z = np.empty((N, N), np.complex64)
        rng.standard_normal(out=z.view(np.float32), dtype=np.float32)
        z = fft(amplitude * z)
        out += [z.real, z.imag]
    return out[:LAYERS]


def of_hcipy():
    for layer in hcipy_layers:
        layer.reset(make_independent_realization=True)
    return [np.asarray(layer.phase_for(WAVELENGTH_M)).reshape(N, N) for layer in hcipy_layers]


grid_free = WAVELENGTH_M**2 * RANGE_M**2 / (np.pi * APERTURE_M**2) * np.sum(walk([np.zeros((N, N), np.float32)] * LAYERS) ** 2) * D * D
plain, rows = scheme_bias(0), []
for name, package, bias, screens in (
    ("numpy, plain", "numpy", plain, pairs),
    ("AOtools, plain", "aotools", plain, lambda: [phasescreen.ft_phase_screen(r0_m, N, D, 2 * np.pi, 1e-2) for _ in range(LAYERS)]),
    ("AOtools, subharmonics", "aotools", scheme_bias(3), lambda: [phasescreen.ft_sh_phase_screen(r0_m, N, D, 2 * np.pi, 1e-2) for _ in range(LAYERS)]),
    ("HCIPy", "hcipy", None, of_hcipy),
):
    start = cpu_s()
    found = [walk(screens()) for _ in range(MEASURED)]
    seconds = (cpu_s() - start) / MEASURED
    # All pairs of different realisations; the standard error by leaving each out in turn.
    total, own = sum(found), np.array([np.sum(j * j) for j in found])
    dots = np.array([np.sum(total * j) for j in found])
    scale = WAVELENGTH_M**2 * RANGE_M**2 / (np.pi * APERTURE_M**2) * D * D * free / grid_free
    mean = scale * (np.sum(total * total) - own.sum()) / (MEASURED * (MEASURED - 1))
    without = scale * (np.sum(total * total) - 2 * dots + 2 * own - own.sum()) / ((MEASURED - 1) * (MEASURED - 2))
    error = np.sqrt((MEASURED - 1) / MEASURED * np.sum((without - without.mean()) ** 2)) / exact
    print(f"{name}: measured {mean / exact - 1:+.4f} +- {error:.4f}, expected {bias}", flush=True)
    if bias is None:
        rows.append(("bistatic efficiency", name, version(package), MEASURED, abs(mean / continuous - 1), error, MEASURED * seconds))
        continue
    for n in DRAWN:
        noise = error * np.sqrt(MEASURED / n)
        whole = np.hypot(bias + layers_bias, noise)
        rows.append(("bistatic efficiency", name, version(package), n, whole, noise**2 / whole / np.sqrt(2 * MEASURED), n * seconds))
write("bistatic", rows)
