"""Scans of a data set as input of a network, and its answers as predictions for `wakescope score`."""
import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray

TRAIN = 0
VALIDATION = 1
TEST_HOME = 2
TEST_AWAY = 3
LEAST_CIRCULATION = 50.0  # m2/s: weaker vortices are not scored
SIDES = ("left", "right")
ORIGIN = np.array([400.0, 55.0, 300.0])  # of y, z above the lidar and circulation, m, m, m2/s
SCALE = np.array([40.0, 30.0, 100.0])  # targets less origin are of this order
COLUMNS = "flight scan side y_m z_m gamma_5_15_m2_s y_std_m z_std_m gamma_5_15_std_m2_s score".split()


class Scans(NamedTuple):
    """Scans of some splits of a data set, those of a flight one after the other."""

    flight: np.ndarray  # [scan], number of the flight
    scan: np.ndarray  # [scan], number of the scan in its flight
    split: np.ndarray  # [scan]
    lidar_height_m: np.ndarray  # [scan], above the ground
    inputs: np.ndarray  # [scan, channel, line, gate]: velocity less its mean, that mean, signal-to-noise ratio, y, z
    targets: np.ndarray  # [scan, vortex, 3]: y in m, z in m, circulation in m2/s; NaN where no vortex is scored


class Mixture(NamedTuple):
    """Gaussians whose weighted sum is the posterior of the scaled targets of each vortex."""

    presence: np.ndarray  # [scan, vortex], logit of the probability that the vortex is there
    log_weight: np.ndarray  # [scan, vortex, component]
    mean: np.ndarray  # [scan, vortex, component, 3]
    log_deviation: np.ndarray  # [scan, vortex, component, 3]


def read(folder, splits):
    """Reads the scans of the flights of `splits` that are ready."""
    ds = xarray.open_zarr(Path(folder) / "scans.zarr")
    wanted = (ds.ready.values == 1) & np.isin(ds.split.values, splits)
    ds = ds.isel(flight=np.flatnonzero(wanted))
    shape = (ds.sizes["flight"] * ds.sizes["scan"],)
    flight, scan = np.meshgrid(ds.flight.values, ds.scan.values, indexing="ij")
    of_scans = np.ones_like(flight)
    return Scans(
        flight=flight.ravel(),
        scan=scan.ravel(),
        split=(ds.split.values[:, None] * of_scans).ravel(),
        lidar_height_m=(ds.draw_scan_lidar_height_m.values[:, None] * of_scans).ravel(),
        inputs=network_inputs(ds).reshape(*shape, 5, ds.sizes["line"], ds.sizes["gate"]),
        targets=true_vortices(ds).reshape(*shape, 2, 3),
    )


def network_inputs(ds):
    """Channels of order one [flight, scan, channel, line, gate], float32; 0 where a cell is missing."""
    velocity = np.where(ds.flag.values == 1, np.nan, ds.velocity.values)
    wind = np.nanmean(velocity, axis=(2, 3), keepdims=True)
    elevation = np.deg2rad(ds.elevation.values)[:, None]
    y = ds.range.values * np.cos(elevation)
    z = ds.range.values * np.sin(elevation)
    channels = [
        np.nan_to_num((velocity - wind) / 3.0),
        np.nan_to_num(wind / 3.0),
        np.nan_to_num(ds.signal_to_noise_ratio.values / 10.0),
        (y - ORIGIN[0]) / SCALE[0],
        (z - ORIGIN[1]) / SCALE[1],
    ]
    return np.stack([np.broadcast_to(channel, velocity.shape) for channel in channels], axis=2).astype("float32")


def true_vortices(ds):
    """True y, z and circulation [flight, scan, vortex, 3] of the vortices that are scored."""
    truth = np.stack([ds.vortex_y.values, ds.vortex_z.values, ds.circulation_5_15.values], axis=-1)
    is_scored = (ds.in_view.values == 1) & (truth[..., 2] >= LEAST_CIRCULATION)
    return np.where(is_scored[..., None], truth, np.nan)


def origins(scans):
    """Zero of the scaled targets [scan, 1, 3]: z counts from the lidar, whose height is known."""
    origin = np.tile(ORIGIN, (len(scans.flight), 1, 1))
    origin[:, 0, 1] += scans.lidar_height_m
    return origin


def scaled_targets(scans):
    """Targets [scan, vortex, 3] of order one."""
    return (scans.targets - origins(scans)) / SCALE


def moments(mixture, scans):
    """Mean and standard deviation [scan, vortex, 3] of a mixture of Gaussians of scaled targets."""
    weight = np.exp(mixture.log_weight)[..., None]
    mean = (weight * mixture.mean).sum(2)
    squares = np.exp(2.0 * mixture.log_deviation) + (mixture.mean - mean[:, :, None]) ** 2
    deviation = np.sqrt((weight * squares).sum(2))
    return origins(scans) + SCALE * mean, SCALE * deviation


def write_predictions(path, scans, mixture):
    """Writes a row for each vortex that is more probable than not, or one row "none" for a scan."""
    mean, deviation = moments(mixture, scans)
    presence = 1.0 / (1.0 + np.exp(-np.asarray(mixture.presence)))
    with open(path, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for k in range(len(scans.flight)):
            number = [scans.flight[k], scans.scan[k]]
            score = presence[k].max()
            for vortex in np.flatnonzero(presence[k] > 0.5):
                table.writerow([*number, SIDES[vortex], *mean[k, vortex], *deviation[k, vortex], score])
            if score <= 0.5:
                table.writerow([*number, "none", *6 * [""], score])
