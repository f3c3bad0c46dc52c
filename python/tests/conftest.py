"""What the tests share: a scene that runs in a second, and the program."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import wakescope

ROOT = Path(__file__).resolve().parents[2]


def small(**keys):
    """A scan of nine lines."""
    few = {"scan.elevation_min_rad": 0.1, "scan.elevation_max_rad": 0.11, "scan.pulses_per_line": 2}
    return wakescope.scene(**{**few, "outputs.svg": False, "outputs.png": False, **keys})


@pytest.fixture
def program():
    """Runs the program on the PATH, or the one that WAKESCOPE_PROGRAM names."""
    path = os.environ.get("WAKESCOPE_PROGRAM") or shutil.which("wakescope")
    assert path, "no program wakescope"

    def run(*words, **options):
        return subprocess.run([path, *map(str, words)], capture_output=True, text=True, check=True, **options)

    return run
