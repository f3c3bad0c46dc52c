"""Records of the discrete sum (15) by numpy: processor time of a record of 300 samples, and the error of its covariance.

The line through a vortex core of `cargo xtask work-precision`, pulse 200 ns, 0.6 m a sample, 16 records a line; against layers of 7.5 cm.
"""
from importlib.metadata import version

import numpy as np

from common import fastest, write

LIGHT_M_S, RATE_HZ, WAVELENGTH_M, FIRST_M, BEFORE = 299792458.0, 250e6, 1.55e-6, 340.0, 256
sigma_s, sample_m = 200e-9 / (2 * np.sqrt(np.log(2))), LIGHT_M_S / 2 / RATE_HZ


def along_m_s(range_m):
    elevation, found = np.arctan(49 / 376.5), 0
    y, z = range_m * np.cos(elevation), range_m * np.sin(elevation)
    for sign, centre, height in ((1, 376.5, 47), (-1, 423.5, 47), (-1, 376.5, -47), (1, 423.5, -47)):
        swirl = sign * 500 / (2 * np.pi) / ((y - centre) ** 2 + (z - height) ** 2 + 2.35**2)
        found = found + swirl * (-(z - height) * np.cos(elevation) + (y - centre) * np.sin(elevation))
    return found


def matrix(samples, parts):
    """From the layers' amplitudes to the samples."""
    range_m = FIRST_M - BEFORE * sample_m + sample_m / parts * np.arange((samples + 2 * BEFORE) * parts)
    t = 2 * FIRST_M / LIGHT_M_S + np.arange(samples)[:, None] / RATE_HZ
    pulse = np.exp(-((t - 2 * range_m / LIGHT_M_S) ** 2) / (2 * sigma_s**2))
    return pulse * np.exp(4j * np.pi / WAVELENGTH_M * along_m_s(range_m) * (t - t[0])) * np.sqrt(sample_m / parts)


def covariance(parts):
    m = matrix(128, parts)
    return m @ m.conj().T


exact, rng, rows = covariance(8), np.random.default_rng(1), []
carrier = np.exp(2j * np.pi * 80e6 * np.arange(300) / RATE_HZ)[:, None]
for parts in (1, 2, 3):
    error = abs(covariance(parts) - exact).max() / abs(exact).max()

    def records():
        m = matrix(300, parts)
        air = (rng.standard_normal((m.shape[1], 16)) + 1j * rng.standard_normal((m.shape[1], 16))) * np.sqrt(0.5)
        return np.sqrt(2) * np.real(m @ air * carrier) + rng.standard_normal((300, 16))

    rows.append(("records, 200 ns", "numpy, 16 records a line", version("numpy"), parts, error, 0, fastest(records, 3, 0.5) / 16))
write("records", rows)
