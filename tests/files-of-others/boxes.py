"""Boxes of turbulence that hipersim and mannrs make, as files that `flow.kind = "fields"` reads (`docs/src/scans.md`).

    python boxes.py hipersim|mannrs FILE

Axes of both: x along the wind, y to its left, z up, so that a scene wants `mirror_y = true`. Periodic along x.
"""

import sys

import numpy
import xarray

NODES = (64, 32, 32)
STEP_M = 4.0
# alpha epsilon^(2/3) in m^(4/3)/s^2, length scale in m, shear parameter of Mann (1994).
STRENGTH, LENGTH_M, SHEAR = 0.05, 33.6, 3.9


def from_hipersim():
    from hipersim import MannTurbulenceField

    box = MannTurbulenceField.generate(
        alphaepsilon=STRENGTH, L=LENGTH_M, Gamma=SHEAR, Nxyz=NODES, dxyz=(STEP_M,) * 3, seed=1, HighFreqComp=0, double_xyz=(False,) * 3
    )
    # One array (uvw, x, y, z): a variable for each component.
    return box.to_xarray().to_dataset(dim="uvw")


def from_mannrs():
    from mannrs import Stencil

    size = {name: nodes * STEP_M for name, nodes in zip(("Lx", "Ly", "Lz"), NODES)}
    stencil = Stencil(L=LENGTH_M, gamma=SHEAR, **size, **dict(zip(("Nx", "Ny", "Nz"), NODES))).build(parallel=False)
    wind = stencil.turbulence(STRENGTH, 1, parallel=False)
    return xarray.Dataset({name: (("x", "y", "z"), values) for name, values in zip("uvw", (wind.U, wind.V, wind.W))})


def box(program):
    """The box with its nodes STEP_M apart: the axes that mannrs writes end at the period, one node too far."""
    made = {"hipersim": from_hipersim, "mannrs": from_mannrs}[program]()
    return made.assign_coords({name: STEP_M * numpy.arange(nodes) for name, nodes in zip("xyz", NODES)})


if __name__ == "__main__":
    box(sys.argv[1]).to_netcdf(sys.argv[2])
