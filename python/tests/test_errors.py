"""Every input that the program refuses is an exception that names the key, the value and what is allowed."""

import pickle

import pytest
from conftest import ROOT, small

import wakescope

BAD = [path for path in sorted((ROOT / "tests/bad-input").glob("*.toml")) if path.name != "netcdf.toml"]


def test_a_value_out_of_its_limits():
    with pytest.raises(wakescope.WakescopeError) as caught:
        wakescope.run({"scan": {"realisations": 0}, "laser": {"wavelenght_m": 1.5e-6}})
    error = caught.value
    assert len(error.problems) == 1 and error.key == "laser.wavelenght_m" and "wavelength_m" in error.limit
    with pytest.raises(wakescope.WakescopeError) as caught:
        wakescope.run({"scan": {"realisations": 0}})
    error = caught.value
    assert (error.key, error.value, error.limit) == ("scan.realisations", "0", "a whole number from 1 to 1000000")
    assert str(error) == "scene: scan.realisations = 0 is not allowed: a whole number from 1 to 1000000"
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.problems) == (str(error), error.problems)


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.name)
def test_bad_scenes_and_cases_of_files(path):
    first, *wanted = (line[2:] for line in path.read_text(errors="replace").splitlines() if line.startswith("# "))
    command = getattr(wakescope, first.split()[0])
    with pytest.raises(wakescope.WakescopeError) as caught:
        command(path)
    said = str(caught.value).splitlines()[0]
    # Files that some of them name stand beside them only where the tests of the crates put them.
    names_a_file = any(f'{ending}"' in path.read_text(errors="replace") for ending in (".nc", ".csv", "\"absent"))
    assert said == wanted[0].replace("FILE", str(path)) or names_a_file


def test_values_that_no_scene_has():
    for value in (object(), 1j, b"text"):
        with pytest.raises((TypeError, wakescope.WakescopeError), match="seed"):
            wakescope.run({"seed": value})
    with pytest.raises(wakescope.WakescopeError, match="windcube"):
        wakescope.scene("nothing")
    with pytest.raises(wakescope.WakescopeError) as caught:
        wakescope.scene(**{"pulse.energy_j": -1.0})
    assert caught.value.key == "pulse.energy_j" and caught.value.line is None


def test_words_that_the_command_does_not_know(tmp_path):
    with pytest.raises(wakescope.WakescopeError, match="--nothing"):
        wakescope.run(small(), nothing=3)
    with pytest.raises(wakescope.WakescopeError) as caught:
        wakescope.detect(scene=small(), false_alarm=0.7)
    assert "--false-alarm" in caught.value.key and caught.value.value == "0.7"
    assert "0.5" in caught.value.limit and "--" not in caught.value.limit
    with pytest.raises(wakescope.WakescopeError) as caught:
        wakescope.retrieve(tmp_path / "nothing.nc")
    assert caught.value.path.endswith("nothing.nc")
    with pytest.raises(AttributeError, match="profile"):
        wakescope.run(small()).nothing
