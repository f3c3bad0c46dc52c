"""Boxes of turbulence that hipersim and mannrs make now are scanned as their spline says."""

import sys

import numpy
import pytest
from conftest import ROOT
from scipy import ndimage

import wakescope

sys.path.insert(0, str(ROOT / "tests/files-of-others"))
import boxes  # noqa: E402

ELEVATION_RAD, HEIGHT_M, LEFT_M, SPEED_M_S = 0.3, 30.0, 120.0, 6.0
START = numpy.datetime64("2024-01-01")


@pytest.mark.parametrize("program", ["hipersim", "mannrs"])
def test_a_carried_box_is_scanned_as_its_spline_says(program, tmp_path):
    box = boxes.box(program)
    box.to_netcdf(tmp_path / "box.nc")
    keys = {
        "flow.kind": "fields",
        "flow.files": str(tmp_path / "box.nc"),
        "flow.mirror_y": True,
        "flow.periodic_x": True,
        "flow.motion": "carried",
        "flow.carried_m_s": [SPEED_M_S, 0.0],
        "flow.origin_m": [0.0, LEFT_M, 0.0],
        "scan.pattern.kind": "stare",
        "scan.pattern.elevation_rad": ELEVATION_RAD,
        "scan.pattern.lines": 200,
        "scan.head.dead_time_s": 0.2,
        "scan.pulses_per_line": 2,
        "scan.lidar_height_m": HEIGHT_M,
        "scan.range_min_m": 30.0,
        "scan.range_max_m": 90.0,
        "scan.realisations": 1,
        "pulse.shape.duration_s": 2e-8,
        "estimator.method.kind": "periodogram",
        "estimator.window_samples": 16,
        "estimator.gate_step_samples": 8,
        "detector.noise": "none",
    }
    found = wakescope.run(wakescope.scene(**keys)).map
    range_m = found.range.values[None, :]
    time_s = ((found.time.values - START) / numpy.timedelta64(1, "s"))[:, None]
    x_m = -SPEED_M_S * time_s + 0.0 * range_m
    y_m = LEFT_M - range_m * numpy.cos(ELEVATION_RAD) + 0.0 * time_s
    z_m = HEIGHT_M + range_m * numpy.sin(ELEVATION_RAD) + 0.0 * time_s
    nodes = boxes.NODES[0]
    place = [numpy.mod(x_m / boxes.STEP_M, nodes) + nodes, y_m / boxes.STEP_M, z_m / boxes.STEP_M]
    wind = {}
    for name in "vw":
        values = box[name].transpose("x", "y", "z").values.astype(float)
        wind[name] = ndimage.map_coordinates(numpy.tile(values, (3, 1, 1)), place, order=3, mode="nearest")
    expected = wind["w"] * numpy.sin(ELEVATION_RAD) - wind["v"] * numpy.cos(ELEVATION_RAD)
    # The kernel (27) of third order and a spline differ where waves are a few nodes long.
    error = numpy.std(found.v_exact.values - expected) / numpy.std(expected)
    assert error < 0.06
    # Without the motion of the box, or with y to the right, nothing agrees.
    assert numpy.corrcoef(found.v_exact.values.ravel(), expected.ravel())[0, 1] > 0.995
