"""Files that the libraries of this Python write now (`tests/files-of-others/make.py`) give what their writer put into them."""

import sys

import numpy
import pytest
from conftest import ROOT

import wakescope

sys.path.insert(0, str(ROOT / "tests/files-of-others"))
make = pytest.importorskip("make", reason="netCDF4 and h5py are needed")
SCANS = [name for name in make.FILES if not name.startswith(("fields", "samples"))]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("others")
    make.make(path)
    return path


@pytest.mark.parametrize("name", SCANS)
def test_the_pair_of_each_scan_is_found(folder, name):
    words = {"min_snr": -13.0} if "ratio" in name else {}
    found = wakescope.retrieve(folder / name, gate_std=0.0, **words)
    scans = 2 if name.startswith("nyquist") else 1
    assert list(found.side.values) == ["left", "right"] * scans
    numpy.testing.assert_allclose(found.y_m, [400.0, 440.0] * scans, atol=0.5)
    # That of the algebraic profile from 5 to 15 m.
    numpy.testing.assert_allclose(found.gamma_5_15_m2_s, 358.8, atol=5.0)


@pytest.mark.parametrize("name", ["samples_of_a_byte.npy", "samples_of_twelve_bits.npy", "samples_with_an_offset.nc"])
def test_samples_have_the_velocity_of_the_air(folder, name):
    scan = {"elevation_min_rad": 0.06, "elevation_max_rad": 0.12, "elevation_step_rad": 0.01, "range_min_m": 320.0, "range_max_m": 480.0}
    keys = {f"scan.{key}": value for key, value in scan.items()} | {"scan.pulses_per_line": 4, "scan.realisations": 1}
    keys |= {"estimator.gate_step_samples": 16}
    words = {}
    if name.endswith(".npy"):
        keys["detector.signal"] = "baseband"
        words["complex"] = True
    found = wakescope.estimate(folder / name, wakescope.scene(**keys), **words)
    assert float(numpy.nanmean(found.map.radial_velocity)) == pytest.approx(5.0, abs=0.3)


def test_an_array_without_sign_has_its_zero_in_the_middle():
    current = make.echoes(False).real
    keys = {"scan.elevation_min_rad": 0.06, "scan.elevation_max_rad": 0.12, "scan.elevation_step_rad": 0.01, "scan.range_min_m": 320.0}
    scene = wakescope.scene(**keys, **{"scan.range_max_m": 480.0, "scan.pulses_per_line": 4, "scan.realisations": 1})
    signed = wakescope.estimate(numpy.round(127 * current).astype("i1"), scene)
    unsigned = wakescope.estimate(numpy.round(127 * current + 128).astype("u1"), scene)
    numpy.testing.assert_allclose(unsigned.map.radial_velocity, signed.map.radial_velocity, atol=0.02)
