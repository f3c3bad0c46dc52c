"""Free-space propagation of Table 2's truncated beam over 1000 m in one step on a grid, against the exact efficiency.

Pixels at the edge of the aperture count by the share that it covers: hard masks are right by luck at one range and wrong at the next.
"""
import warnings
from importlib.metadata import version

import aotools
import hcipy
import LightPipes
import numpy as np
import scipy.fft
from prysm.propagation import angular_spectrum

from common import REFERENCE, fastest, numbers, write

warnings.filterwarnings("ignore")
WAVELENGTH_M, BEAM_M, APERTURE_M, RANGE_M = 1.55e-6, 0.03, 0.05, 1000.0
exact = {row[0]: row[1] for row in numbers(REFERENCE / "optics/eta_freespace_table2.csv")}[RANGE_M]
rows = []


def pupil(n, d, parts=16):
    x = (np.arange(n) - n // 2) * d
    x, y = np.meshgrid(x, x, indexing="ij")
    offsets = ((np.arange(parts) + 0.5) / parts - 0.5) * d
    covered = sum(np.hypot(x + i, y + j) <= APERTURE_M for i in offsets for j in offsets) / parts**2
    return covered * np.exp(-(x * x + y * y) / (2 * BEAM_M**2)) / np.sqrt(np.pi * BEAM_M**2)


def add(name, package, n, d, field):
    j = np.abs(field()) ** 2
    efficiency = WAVELENGTH_M**2 * RANGE_M**2 / (np.pi * APERTURE_M**2) * np.sum(j * j) * d * d
    error = abs(efficiency / exact - 1)
    rows.append(("free-space propagation", name, version(package), n, error, 0, fastest(field, least_s=0.1)))


for n in (128, 256, 512, 1024):
    d = 1.024 / n
    u = pupil(n, d).astype(complex)
    f = np.fft.fftfreq(n, d)
    transfer = np.exp(-1j * np.pi * WAVELENGTH_M * RANGE_M * (f[:, None] ** 2 + f[None] ** 2))
    transfer32, u32 = transfer.astype(np.complex64), u.astype(np.complex64)
    add("scipy f32, one step", "scipy", n, d, lambda: scipy.fft.ifft2(scipy.fft.fft2(u32, workers=1) * transfer32, workers=1))
    add("numpy, one step", "numpy", n, d, lambda: np.fft.ifft2(np.fft.fft2(u) * transfer))
    add("AOtools", "aotools", n, d, lambda: aotools.opticalpropagation.angularSpectrum(u, WAVELENGTH_M, d, d, RANGE_M))
    grid = hcipy.make_pupil_grid(n, n * d)
    fresnel, wave = hcipy.FresnelPropagator(grid, RANGE_M), hcipy.Wavefront(hcipy.Field(u.ravel(), grid), WAVELENGTH_M)
    add("HCIPy", "hcipy", n, d, lambda: np.asarray(fresnel.forward(wave).electric_field).reshape(n, n))
    beam = LightPipes.Begin(n * d, WAVELENGTH_M, n)
    beam.field = u.copy()
    add("LightPipes", "LightPipes", n, d, lambda: np.asarray(LightPipes.Forvard(RANGE_M, beam).field))
    add("prysm", "prysm", n, d, lambda: angular_spectrum(u, WAVELENGTH_M * 1e6, d * 1e3, RANGE_M * 1e3, Q=1))
write("propagation", rows)
