"""Writes the notebooks beside it, or to the folder that is named, from the texts here: cells of words begin with #, all others are Python."""

import json
import sys
from pathlib import Path

FIRST_MAP = """
# # A first map
#
# A scene is a dictionary with a value for every key. Here some keys of the default lidar are changed, the rest are as they are.
---
import wakescope
import matplotlib.pyplot as plt

scene = wakescope.scene(**{"scan.elevation_step_rad": 0.003, "outputs.svg": False, "outputs.png": False})
---
# What will run, and what is left out and why:
---
for stage in wakescope.check(scene)["stages"]:
    print(stage["stage"], "runs" if stage["runs"] else f"is left out: {stage['reason']}")
---
result = wakescope.run(scene)
result
---
# `result.map` is `map.nc` as a dataset: the estimates, the exact velocities, the errors.
---
by_elevation = result.map.swap_dims(time="elevation")
figure, axes = plt.subplots(1, 2, figsize=(9, 3.5), sharey=True, layout="constrained")
for axis, name in zip(axes, ["v_exact", "radial_velocity"]):
    by_elevation[name].plot(ax=axis, vmin=-15, vmax=15, cmap="RdBu_r", cbar_kwargs={"label": "m/s"})
    axis.set(title=name, xlabel="range [m]", ylabel="elevation [deg]")
"""

CIRCULATION = """
# # The circulation of a file
#
# `retrieve` takes CfRadial, HALO `.hpl` and tables of any instrument. The file here is one that the program writes; put the path of another in its place.
---
import tempfile
from pathlib import Path

import wakescope

folder = Path(tempfile.mkdtemp())
scene = wakescope.scene(**{"scan.elevation_step_rad": 0.004, "outputs.svg": False, "outputs.png": False})
written = wakescope.run(scene).write(folder)
---
found = wakescope.retrieve(folder / "map.nc")
found[["side", "gamma_5_15_m2_s", "gamma_5_15_std_m2_s", "y_m", "z_m"]].to_dataframe()
---
# The covariance of all parameters of the fit, here as correlations:
---
import numpy

covariance = found.covariance[0]
deviation = numpy.sqrt(numpy.diag(covariance))
(covariance / numpy.outer(deviation, deviation)).round(2).to_pandas()
---
# A dataset goes in as a file does, and errors are exceptions that say what is allowed:
---
try:
    wakescope.retrieve(folder / "map.nc", threshold=-1)
except wakescope.WakescopeError as error:
    print(error.key, error.value, error.limit, sep="; ")
"""

DESIGN = """
# # A design study
#
# Pulses of several energies and durations: what does the error of a velocity come to?
---
import matplotlib.pyplot as plt

import wakescope

scene = wakescope.scene(**{"scan.elevation_step_rad": 0.04, "scan.realisations": 4})
vary = {"pulse.energy_j": [5e-5, 1e-4, 2e-4, 4e-4], "pulse.shape.duration_s": [2e-7, 4e-7]}
results = wakescope.sweep(scene, vary=vary, no_circulation=True)
results
---
for duration_s, group in results.groupby("pulse.shape.duration_s"):
    plt.loglog(group["pulse.energy_j"] * 1e6, group["bound_m_s"], "o-", label=f"{1e9 * duration_s:.0f} ns")
plt.xlabel("energy of a pulse [µJ]")
plt.ylabel("Cramér-Rao bound of a velocity [m/s]")
plt.legend();
---
# The bound against the signal-to-noise ratio, and where the light goes:
---
bound = wakescope.bound(scene)
curve = bound.where(bound.curve == "snr", drop=True)
plt.semilogy(curve.snr_db, curve.bound_window_m_s)
plt.xlabel("signal-to-noise ratio [dB]")
plt.ylabel("bound of one window [m/s]");
---
wakescope.budget(scene, range=[400]).to_dataframe()
"""

NOTEBOOKS = {"first_map": FIRST_MAP, "circulation_of_a_file": CIRCULATION, "design_study": DESIGN}
KERNEL = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}, "language_info": {"name": "python"}}


def cell(number: int, text: str) -> dict[str, object]:
    """A cell of a notebook."""
    if all(line.startswith("#") for line in text.splitlines()):
        words = "\n".join(line[1:].removeprefix(" ") for line in text.splitlines())
        return {"cell_type": "markdown", "id": f"cell-{number}", "metadata": {}, "source": words}
    return {"cell_type": "code", "id": f"cell-{number}", "metadata": {}, "source": text, "execution_count": None, "outputs": []}


folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
for name, text in NOTEBOOKS.items():
    cells = [cell(number, part.strip()) for number, part in enumerate(text.split("\n---\n"))]
    notebook = {"cells": cells, "metadata": KERNEL, "nbformat": 4, "nbformat_minor": 5}
    (folder / f"{name}.ipynb").write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
