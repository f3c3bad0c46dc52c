"""Each command gives what the program writes; arrays and datasets go in without files of one's own."""

import gzip
import json
import struct
import subprocess
import sys

import numpy
import pytest
import xarray
from conftest import ROOT, small

import wakescope


@pytest.fixture(scope="module")
def scan():
    """A whole plane with a wake."""
    return wakescope.run(wakescope.scene(**{"scan.elevation_step_rad": 0.004, "outputs.svg": False, "outputs.png": False}))


def test_tables_are_those_of_the_program(program, tmp_path):
    scene = small()
    wakescope.run(scene).write(tmp_path)
    program("bound", tmp_path / "scene.toml", "--out", tmp_path / "bound.csv")
    lines = [line for line in (tmp_path / "bound.csv").read_text().splitlines() if not line.startswith("#")]
    bound = wakescope.bound(scene)
    assert list(bound) == lines[0].split(",") and bound.sizes["index"] == len(lines) - 1
    for column, name in enumerate(bound):
        kind = type(bound[name].values[0].item())
        assert [kind(line.split(",")[column]) for line in lines[1:]] == bound[name].values.tolist(), name
    budget = wakescope.budget(scene, range=[280, 400])
    assert set(budget.range_m.values) == {280.0, 400.0} and budget.attrs["ambiguous_range_m"] > 1e5
    efficiency = wakescope.efficiency(scene)
    assert efficiency.snr_db.dims == ("range_m",)
    numpy.testing.assert_array_equal(efficiency.snr_db, wakescope.run(scene).profile.snr_db)


def test_a_dataset_is_retrieved_as_its_file(scan, tmp_path):
    scan.write(tmp_path)
    of_file = wakescope.retrieve(tmp_path / "map.nc")
    of_dataset = wakescope.retrieve(scan.map)
    xarray.testing.assert_allclose(of_dataset.drop_vars("file"), of_file.drop_vars("file"), rtol=1e-6)
    numpy.testing.assert_allclose(of_file.azimuth_rad, numpy.pi / 2)
    assert list(of_file.side.values) == ["left", "right"] and (of_file.gamma_std_m2_s > 0).all()
    covariance = of_file.covariance[0].values
    numpy.testing.assert_allclose(covariance, covariance.T)
    at = list(of_file.parameter.values).index("gamma_left_m2_s")
    assert float(of_file.wake[0, at]) == pytest.approx(float(of_file.gamma_m2_s[0]), rel=1e-6)


def test_a_scan_without_a_wake_has_no_circulation_but_a_column_of_numbers():
    found = wakescope.retrieve(wakescope.run(small(**{"flow.circulation_m2_s": 1.0})).map)
    assert found.gamma_m2_s.dtype == float and found.gamma_m2_s.isnull().all() and "no_wake" in str(found["flags"].values[0])


def test_detection_with_and_without_a_scan(scan):
    found = wakescope.detect(scan.map, empty_scans=2000, stride=(4, 6))
    assert int(found.wake[0]) == 1 and found.attrs["smallest_detectable_m2_s"] > 0
    power = wakescope.detect(scene=small(), empty_scans=2000)
    assert power.detection.dims == ("gamma_m2_s",) and float(power.detection[-1]) > 0.9


def test_a_wind_is_a_dataset_over_time_and_height():
    folder = ROOT / "tests/reference/wind"
    found = wakescope.wind(folder / "vad_turbulent.nc", gate_std=14.36)
    assert found.eastward_wind.dims == ("time", "height") and found.sizes["time"] == 1
    assert (found.eastward_wind_std.dropna("height") > 0).all() and float(found.edr.max()) < 1
    stares = sorted(folder.glob("dbs_*.nc"))
    assert wakescope.wind(stares, gate_std=14.36, every=600).northward_wind.notnull().any()


def test_a_sweep_is_a_dataset_over_cases(tmp_path):
    found = wakescope.sweep(small(), vary={"pulse.energy_j": [1e-4, 2e-4]}, no_circulation=True)
    assert found.sizes["case"] == 2
    assert float(found.snr_db[1] - found.snr_db[0]) == pytest.approx(10 * numpy.log10(2), abs=0.02)
    again = wakescope.sweep(small(), vary=["pulse.energy_j=1e-4,2e-4"], no_circulation=True, out=tmp_path / "sweep")
    xarray.testing.assert_equal(found.snr_db, again.snr_db)
    assert (tmp_path / "sweep/results.nc").exists()


def test_accuracy_has_shifts_and_run_times_of_each_setting():
    found = wakescope.accuracy(small(**{"scan.realisations": 4}), within=0.5, of=["std"])
    assert found.attrs["is_reached"] in (0, 1) and "estimator.padded_samples" in found["setting"].values
    assert float(found["run_s"].min()) > 0 and set(found["metric"].values) == {"std"}


def test_a_flow_and_a_wake_tell_their_progress(tmp_path):
    case = wakescope.case("vortex_pair")
    case["case"]["cells"] = [1, 16, 16]
    told = []
    result = wakescope.flow(case, end=0.05, progress=lambda *step: told.append(step))
    assert result.answer["is_complete"] and told and told[-1][0] == "flow simulation"
    assert result.steps.sizes["index" if "index" in result.steps.dims else list(result.steps.dims)[0]] >= 1
    wake = wakescope.case("coarse")
    wake["case"]["cells"] = [4, 16, 12]
    wake["wake"] = {"end_tau": 0.02, "fields_tau": [0.02], "planes_tau": [0.0, 0.02]}
    written = wakescope.wake(wake, out=tmp_path)
    assert written.answer["is_complete"] and (tmp_path / "case.toml").exists()
    assert all(path.parent == tmp_path for path in written.files.values())


@pytest.mark.parametrize("kind", ["f4", "f8", "c8", "c16", "i2", "u2"])
def test_signals_of_every_kind_of_number(kind):
    scene = small(**{"outputs.signals": True})
    signals = wakescope.run(scene).signals.current_a.values
    exact = wakescope.estimate(signals, scene).map
    if kind[0] == "c":
        scene = small(**{"detector.signal": "baseband", "outputs.signals": True})
        own = wakescope.run(scene).signals
        signals = own.current_a.values + 1j * own.quadrature_a.values
        exact = wakescope.estimate(signals, scene).map
    scale = 1.0
    if kind[0] in "iu":
        scale = float(numpy.abs(signals).max()) / 30000
        offset = 32768 if kind[0] == "u" else 0
        found = wakescope.estimate((numpy.rint(signals / scale) + offset).astype(kind), scene, scale=scale, noise="scene").map
    else:
        found = wakescope.estimate(signals.astype(kind), scene, noise="scene").map
        exact = wakescope.estimate(signals, scene, noise="scene").map
    assert float(abs(found.radial_velocity - exact.radial_velocity).median()) < 0.05
    # A view of an array that another program holds, [line, pulse, sample].
    lines = signals.reshape(9, 2, -1)
    assert wakescope.estimate(lines, scene, noise="scene").map.radial_velocity.size == found.radial_velocity.size
    with pytest.raises(ValueError, match="ascontiguousarray"):
        wakescope.estimate(lines[:, :, ::2], scene)


def test_a_reversed_spectrum_is_read_with_towards_and_options_without_effect_are_refused():
    scene = small(**{"outputs.signals": True})
    signals = wakescope.run(scene).signals.current_a.values
    turned = signals * numpy.where(numpy.arange(signals.shape[-1]) % 2, -1.0, 1.0)
    # The intermediate frequency of 80 MHz is mirrored at a quarter of the sampling rate of 250 MHz.
    mirrored = small(**{"outputs.signals": True, "detector.intermediate_frequency_hz": 45e6})
    exact = wakescope.estimate(signals, scene, noise="scene").map
    found = wakescope.estimate(turned, mirrored, towards=True, noise="scene").map
    numpy.testing.assert_array_equal(found.radial_velocity, exact.radial_velocity)
    with pytest.raises(wakescope.WakescopeError, match="--complex has no effect"):
        wakescope.estimate(signals, scene, complex=True)


MEMORY = """
import resource, numpy, wakescope
from math import inf
scene = SCENE
few = numpy.random.default_rng(1).normal(size=(18, 401)).astype("f4")
wakescope.estimate(few, {**scene, "scan": {**scene["scan"], "pulses_per_line": 2}})
signals = numpy.random.default_rng(1).normal(size=(RECORDS, 401)).astype("f4")
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
wakescope.estimate(signals, scene, threads=1)
print(signals.nbytes, 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""


def test_a_large_array_is_not_copied():
    # 100 MB: lines of many pulses, in few windows.
    scene = small(**{"scan.pulses_per_line": 7000, "estimator.window_step_samples": 64, "estimator.gate_step_samples": 64})
    text = MEMORY.replace("SCENE", repr(scene)).replace("RECORDS", str(9 * 7000))
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert not done.stderr, done.stderr
    size, more = map(int, done.stdout.split())
    assert size > 1e8 and more < 0.1 * size, (size, more)


def test_another_openblas_in_the_process_changes_no_value():
    text = """
import sys
if sys.argv[1] == "before":
    import ctypes, glob, numpy, os
    numpy.linalg.eigh(numpy.eye(3))
    names = glob.glob(os.path.join(os.path.dirname(numpy.__file__), "..", "numpy.libs", "*openblas*"))
    [ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL) for name in names]
import hashlib, wakescope
scene = wakescope.scene(**{"scan.elevation_step_rad": 0.02, "estimator.method": {"kind": "autoregressive", "order": 8}})
print(hashlib.sha256(wakescope.run(scene).files["map.nc"]).hexdigest())
"""
    words = [sys.executable, "-c", text]
    found = [subprocess.run([*words, order], capture_output=True, text=True, check=True).stdout for order in ("before", "without")]
    assert found[0] == found[1] and len(found[0]) > 60


def test_names_of_linear_algebra_stay_inside_the_module():
    from wakescope import _wakescope

    listed = subprocess.run(["nm", "-D", "--defined-only", _wakescope.__file__], capture_output=True, text=True)
    if listed.returncode != 0:
        pytest.skip("no nm")
    names = {line.split()[-1] for line in listed.stdout.splitlines() if line.split()[-2] in "TDBRVW"}
    # What the stub is made from lies there, too.
    others = {name for name in names if not name.startswith("PYO3_INTROSPECTION_")}
    assert others == {"PyInit__wakescope"}, others


def test_a_large_module_is_loaded_in_little_time():
    text = "import time; begun = time.perf_counter(); import wakescope; print(time.perf_counter() - begun, 'xarray' in __import__('sys').modules)"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True).stdout.split()
    # Timing never decides: what takes long is not imported.
    assert done[1] == "False"


def test_predictions_are_scored_as_a_file_or_a_table(tmp_path):
    data_set(tmp_path / "d")
    table = {"flight": range(8), "scan": [0] * 8, "side": ["left"] * 7 + ["none"], "y_m": [11.0] * 7 + [None], "z_m": [50.0] * 8}
    table["gamma_5_15_m2_s"] = [310.0] * 8
    table["y_std_m"] = [1.0] * 7 + [float("nan")]
    scores = wakescope.score(tmp_path / "d", table, split="train")
    assert scores.sizes["index"] == len(scores.value) and scores.attrs["flights"] == 8
    rms = scores.value[(scores.group == "all") & (scores.quantity == "gamma_5_15_m2_s") & (scores.statistic == "rms")]
    assert rms.item() == pytest.approx(10.0)
    lines = [",".join(table)] + [",".join("" if cell is None else str(cell) for cell in row) for row in zip(*table.values())]
    (tmp_path / "p.csv").write_text("\n".join(lines) + "\n")
    xarray.testing.assert_equal(scores, wakescope.score(tmp_path / "d", tmp_path / "p.csv", split=["train"]))
    dataset = xarray.Dataset({name: ("index", list(cells)) for name, cells in table.items() if name != "y_m"})
    dataset["y_m"] = ("index", [11.0] * 7 + [float("nan")])
    xarray.testing.assert_equal(scores.value, wakescope.score(tmp_path / "d", dataset, split="train").value)
    with pytest.raises(wakescope.WakescopeError, match="row 8, column side"):
        wakescope.score(tmp_path / "d", {**table, "side": ["left"] * 7 + ["nothing"]}, split="train")


def data_set(folder):
    """Eight flights of one scan with one vortex, as a store of Zarr v3."""
    nan = float("nan")
    axes = ["flight", "scan", "vortex"]
    arrays = {}
    for name, kind, shape, values in [
        *((name, "float64", [8], [value] * 8) for name, value in [("snr_middle", 5.0), ("dissipation", 1e-3), ("spacing", 40.0)]),
        *((name, "uint8", [8], [value] * 8) for name, value in [("split", 0), ("site", 0), ("ready", 1)]),
        ("wake_age", "float64", [8, 1], [1.0] * 8),
        *((name, "float64", [8, 1, 2], [value, nan] * 8) for name, value in [("vortex_y", 10.0), ("vortex_z", 50.0), ("circulation_5_15", 300.0)]),
        ("in_view", "uint8", [8, 1, 2], [1, 0] * 8),
    ]:
        size = 8 if kind == "float64" else 1
        codec = {"name": "bytes", **({"configuration": {"endian": "little"}} if size > 1 else {})}
        arrays[name] = {
            "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": kind,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shape}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "fill_value": "NaN" if size > 1 else 0, "codecs": [codec, {"name": "gzip", "configuration": {"level": 1}}],
            "attributes": {}, "dimension_names": axes[: len(shape)],
        }  # fmt: skip
        chunk = folder / "scans.zarr" / name / "c" / "/".join("0" * len(shape))
        chunk.parent.mkdir(parents=True)
        chunk.write_bytes(gzip.compress(struct.pack(f"<{len(values)}{'d' if size > 1 else 'B'}", *values)))
    group = {"zarr_format": 3, "node_type": "group", "attributes": {"seed": 1}, "consolidated_metadata": {"kind": "inline", "metadata": arrays}}
    (folder / "scans.zarr" / "zarr.json").write_text(json.dumps(group))
