"""Data sets: arrays as the page describes them, the same bytes from any number of processes, the launchers as real processes."""

import filecmp
import json
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy
import pandas
import pytest
import xarray
from conftest import ROOT

import wakescope

FLIGHTS = 4
#: Axes and number types of the arrays; chunks hold eight flights, spectra one.
CELLS = ("flight", "scan", "line", "gate")
ARRAYS = {
    **dict.fromkeys(["flight", "scan", "vortex"], "int32"),
    **dict.fromkeys(["elevation", "azimuth", "range", "line_time", "height", "bin_velocity"], "float64"),
    **dict.fromkeys(["velocity", "velocity_standard_deviation", "signal_to_noise_ratio", "spectral_width", "quality"], "int16"),
    **dict.fromkeys(["true_velocity", "point_velocity"], "int16"),
    **dict.fromkeys(["flag", "spectrum", "split", "has_wake", "ready", "in_view"], "uint8"),
    **dict.fromkeys(["dissipation", "outer_scale", "snr_middle", "spacing", "wind_x", "wind_y", "wake_age", "draw_flow_height_m"], "float64"),
    **dict.fromkeys(["vortex_y", "vortex_z", "circulation", "circulation_5_15", "core_radius", "passing_time"], "float64"),
    "site": "uint16",
    "seed": "int64",
    "scene_hash": "uint64",
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a small data set by one process, and its plan."""
    folder = tmp_path_factory.mktemp("dataset")
    answer = wakescope.dataset(None, out=folder / "one", preset="tiny", flights=FLIGHTS, threads=1)
    assert answer["flights"] == 4 * FLIGHTS and answer["kept"] == 0
    (folder / "plan.toml").write_bytes((folder / "one/plan.toml").read_bytes())
    return folder


@pytest.fixture(scope="module")
def small(whole):
    """The plan of a smaller data set, made by one process in the folder "small"."""
    plan = whole / "small.toml"
    plan.write_text((whole / "plan.toml").read_text().replace("flights_per_site = 32", "flights_per_site = 8"))
    wakescope.dataset(plan, out=whole / "small")
    return plan


def assert_same(one: Path, other: Path) -> None:
    files = [sorted(path.relative_to(of) for path in of.rglob("*") if path.is_file()) for of in (one, other)]
    assert files[0] == files[1]
    _, differ, failed = filecmp.cmpfiles(one, other, files[0], shallow=False)
    assert not differ and not failed, differ + failed


def test_arrays_are_those_of_the_page_and_absent_chunks_are_missing(whole):
    root = json.loads((whole / "one/scans.zarr/zarr.json").read_text())
    stored = root["consolidated_metadata"]["metadata"]
    for name, number in ARRAYS.items():
        assert stored[name]["data_type"] == number, name
        assert stored[name] == json.loads((whole / f"one/scans.zarr/{name}/zarr.json").read_text())
    assert tuple(stored["velocity"]["dimension_names"]) == CELLS
    assert stored["velocity"]["chunk_grid"]["configuration"]["chunk_shape"] == [8, 4, 25, 24]
    assert stored["spectrum"]["chunk_grid"]["configuration"]["chunk_shape"][0] == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        import zarr

        found = xarray.open_zarr(whole / "one/scans.zarr")
        assert zarr.open_group(whole / "one/scans.zarr", mode="r")["velocity"].attrs["scale_factor"] == 0.005
    assert "dask" in type(found.velocity.data).__module__ and found.attrs["seed"] == 1
    ready = found.ready.values == 1
    assert ready.reshape(4, 32)[:, :FLIGHTS].all() and ready.sum() == 4 * FLIGHTS
    assert numpy.isnan(found.velocity.values[~ready]).all() and numpy.isnan(found.vortex_y.values[~ready]).all()
    there = found.isel(flight=numpy.flatnonzero(ready)).load()
    error = (there.velocity - there.true_velocity).values
    assert numpy.nanmedian(abs(error)) < 0.6
    # The density of each spectrum is highest near the velocity of its gate, whose regions the spectra share.
    strong = there.signal_to_noise_ratio.values > 5
    highest = there.bin_velocity.values[there.spectrum.fillna(-99).argmax("bin").values]
    assert numpy.median(abs(highest - there.velocity.values)[strong]) < 1.5
    passed = numpy.isfinite(there.wake_age.values)
    assert (numpy.isfinite(there.vortex_y.values) == passed[:, :, None]).all()
    assert (passed.any(axis=1) == (there.has_wake.values == 1)).all() and not passed[:, 0].any()


def process(plan: str, out: Path, options: str) -> subprocess.Popen[bytes]:
    """A process that makes a data set."""
    code = f"import wakescope; wakescope.dataset({plan!r}, out={str(out)!r}, flights={FLIGHTS}, {options})"
    return subprocess.Popen([sys.executable, "-c", code])


def test_processes_kills_and_dictionaries_change_no_byte(whole, program):
    plan = str(whole / "plan.toml")
    words = ["dataset", plan, "--quiet", "--flights", FLIGHTS]
    shards = [process(plan, whole / "four", f"shard='{k}/4'") for k in range(1, 5)]
    assert [shard.wait() for shard in shards] == [0] * 4
    assert_same(whole / "one", whole / "four")
    program(*words, "--out", whole / "two", "--threads", 2)
    assert_same(whole / "one", whole / "two")
    for kill in range(3):
        run = process(plan, whole / "killed", "resume=True")
        time.sleep(1.0 + kill)
        run.send_signal(signal.SIGKILL)
        run.wait()
    program(*words, "--out", whole / "killed", "--resume")
    assert_same(whole / "one", whole / "killed")
    with pytest.raises(wakescope.WakescopeError, match="flights_per_site = 12 is not allowed"):
        wakescope.dataset({"title": "a dictionary", "flights_per_site": 12}, out=whole / "none")
    assert not (whole / "none").exists()


def test_the_description_is_croissant_and_the_store_a_dataset_for_loaders(whole):
    import datasets
    import mlcroissant

    described = mlcroissant.Dataset(whole / "one/croissant.json")
    assert not described.metadata.ctx.issues.errors and not described.metadata.ctx.issues.warnings
    ds = xarray.open_zarr(whole / "one/scans.zarr")
    ds = ds.isel(flight=numpy.flatnonzero(ds.ready.values)[:2])
    rows = ({"velocity": ds.velocity[f].values, "y": ds.vortex_y[f].values} for f in range(ds.sizes["flight"]))
    loaded = list(rows)
    made = datasets.Dataset.from_generator(lambda: iter(loaded))
    assert len(made) == 2 and numpy.shape(made[0]["velocity"]) == (4, 25, 24)


def test_a_slurm_array_makes_its_shards(whole, small):
    program = os.environ.get("WAKESCOPE_PROGRAM")
    path = os.pathsep.join(([str(Path(program).parent)] if program else []) + [os.environ["PATH"]])
    for index in (1, 2):
        own = {"SLURM_ARRAY_TASK_ID": str(index), "SLURM_ARRAY_TASK_COUNT": "2", "SLURM_CPUS_PER_TASK": "1", "PATH": path}
        words = ["bash", ROOT / "docs/src/launch_slurm.sh", small, whole / "array"]
        subprocess.run(words, env={**os.environ, **own}, check=True)
    assert_same(whole / "small", whole / "array")


def test_the_shard_of_a_dask_worker_that_is_killed_is_run_again(whole, small):
    launcher = subprocess.Popen([sys.executable, ROOT / "docs/src/launch_dask.py", small, whole / "dask", "4"])
    killed = False
    while launcher.poll() is None:
        # Once the first flight is there a worker is at work.
        if not killed and list((whole / "dask/scans.zarr/spectrum/c").glob("*")):
            killed = kill_a_worker(launcher.pid)
        time.sleep(0.05)
    assert launcher.returncode == 0 and killed
    assert_same(whole / "small", whole / "dask")


def kill_a_worker(launcher: int) -> bool:
    """Kills one of the processes that computes below a launcher."""
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(status.read_text().rpartition(")")[2].split()[1])
            command = (status.parent / "cmdline").read_text()
        except (OSError, ValueError):
            continue
        if parent == launcher and "spawn_main" in command and "resource_tracker" not in command:
            os.kill(int(status.parent.name), signal.SIGKILL)
            return True
    return False


def test_the_network_of_the_book_reads_the_truth_of_each_split(whole, small, monkeypatch, program):
    monkeypatch.syspath_prepend(ROOT / "docs/src")
    import posterior_data as data

    assert not {"jax", "equinox", "optax"} & set(sys.modules)
    read = [data.read(whole / "small", [split]) for split in range(4)]
    # Three sites with six flights, one and one; eight flights at a site of its own; four scans each.
    assert [len(scans.flight) for scans in read] == [72, 12, 12, 32]
    scans = data.read(whole / "small", [data.TEST_HOME, data.TEST_AWAY])
    ds = xarray.open_zarr(whole / "small/scans.zarr").load()
    assert set(scans.flight) == set(ds.flight.values[ds.split.values >= 2])
    assert set(scans.flight).isdisjoint([*read[data.TRAIN].flight, *read[data.VALIDATION].flight])
    stored = ds.isel(flight=xarray.DataArray(scans.flight), scan=xarray.DataArray(scans.scan))
    assert (stored.split.values == scans.split).all() and scans.inputs.shape == (44, 5, 25, 24)
    missing = stored.flag.values == 1
    velocity = 3.0 * (scans.inputs[:, 0] + scans.inputs[:, 1])
    numpy.testing.assert_allclose(velocity[~missing], stored.velocity.values[~missing], atol=1e-5)
    ratio_db = stored.signal_to_noise_ratio.fillna(0.0).values
    numpy.testing.assert_allclose(10.0 * scans.inputs[:, 2], ratio_db, atol=1e-5)
    for k, name in enumerate(["vortex_y", "vortex_z", "circulation_5_15"]):
        true = numpy.where((stored.in_view.values == 1) & (stored.circulation_5_15.values >= 50.0), stored[name].values, numpy.nan)
        numpy.testing.assert_array_equal(scans.targets[..., k], true)
    # Two Gaussians on either side of the truth: no error, and a continuous ranked probability score by their standard deviation.
    is_there = numpy.isfinite(scans.targets[..., 0])
    true = numpy.nan_to_num(data.scaled_targets(scans))[:, :, None]
    mean = numpy.concatenate([true - 0.3, true + 0.3], axis=2)
    presence = numpy.where(is_there, 9.0, -9.0)
    mixture = data.Mixture(presence, numpy.full((44, 2, 2), numpy.log(0.5)), mean, numpy.full(mean.shape, -2.0))
    data.write_predictions(whole / "predictions.csv", scans, mixture)
    program("score", whole / "small", whole / "predictions.csv", "--split", "test_home,test_away", "--out", whole / "scores")
    scores = pandas.read_csv(whole / "scores/score.csv", comment="#").query("group == 'all'")
    scores = scores.set_index(["quantity", "statistic"]).value
    assert scores["vortices", "f1"] == 1.0 and scores["scans", "false_alarms"] == 0.0
    for scale, quantity in zip(data.SCALE, ["y_m", "z_m", "gamma_5_15_m2_s"]):
        deviation = scale * numpy.hypot(0.3, numpy.exp(-2.0))
        assert scores[quantity, "rms"] < 1e-6
        numpy.testing.assert_allclose(scores[quantity, "crps"], deviation * (2**0.5 - 1) / numpy.pi**0.5, rtol=1e-6)
