"""A simulated wake near the ground and what the lidar measures of it, as an animated picture.

The first argument is a folder of `wakescope wake` with a cross-plane every quarter of tau:

    wakescope wake --preset coarse --print > case.toml    # planes_tau = [0.0, 0.25, ..., 5.0]
    wakescope wake case.toml --out wake
    python moving_wake.py wake moving-wake.png
"""

import sys
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.collections import QuadMesh

import wakescope

folder, picture = sys.argv[1:]
keys: dict[str, Any] = {
    "scan.elevation_min_rad": 0.0,
    "scan.elevation_max_rad": 0.2,
    "scan.range_min_m": 285.0,
    "scan.range_max_m": 515.0,
    "scan.realisations": 1,
    "detector.snr": {"reference": "fixed", "snr_db": 0.0},
    "outputs.svg": False,
    "outputs.png": False,
}
ages_tau = np.arange(0.0, 5.01, 0.25)
maps = []
for age_tau in ages_tau:
    flow = {"kind": "simulated", "planes": f"{folder}/plane1", "motion": "frozen", "age_tau": float(age_tau)}
    maps.append(wakescope.run(wakescope.scene(flow=flow, **keys)).map)

figure, axes = plt.subplots(1, 2, figsize=(8.4, 2.6), sharey=True, layout="constrained")
elevation = np.radians(maps[0].elevation.values)[:, None]
lateral_m = maps[0].range.values * np.cos(elevation)
height_m = maps[0].range.values * np.sin(elevation)
meshes: list[QuadMesh] = []
for axis, title in zip(axes, ["simulated wake", "as the lidar measures it"]):
    empty = np.full(lateral_m.shape, np.nan)
    mesh = axis.pcolormesh(lateral_m, height_m, empty, cmap="RdBu_r", vmin=-6, vmax=6, shading="nearest")
    axis.set(title=title, xlabel="y [m]", ylim=(0, 100), aspect="equal")
    meshes.append(mesh)
axes[0].set_ylabel("z [m]")
figure.colorbar(meshes[1], ax=axes, label="radial velocity [m/s]")
age = axes[0].text(0.03, 0.91, "", transform=axes[0].transAxes)


def draw(frame: int) -> list[QuadMesh]:
    """Draws the maps of one age."""
    for mesh, name in zip(meshes, ["v_exact", "radial_velocity"]):
        mesh.set_array(maps[frame][name].values)
    age.set_text(f"τ = {ages_tau[frame]:.2f}")
    return meshes


FuncAnimation(figure, draw, frames=len(maps)).save(picture, PillowWriter(fps=4), dpi=90)
