"""Simulator of coherent Doppler lidar measurements of aircraft wake vortices.

Each function is a command of the program `wakescope`, with the same words as keywords: `--false-alarm 1e-3` is `false_alarm=1e-3`.
Scenes and cases are dictionaries or paths; tables and maps come as `xarray.Dataset`, made from the bytes of the files that the program
would write. Nothing is printed or written unless asked for.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from . import _wakescope
from ._result import Result, attributes, covariance, write_table
from ._wakescope import VERSION as __version__
from ._wakescope import presets

if TYPE_CHECKING:
    import numpy
    import xarray

__all__ = [
    "Progress", "Result", "Scene", "WakescopeError", "__version__", "accuracy", "bound", "budget", "case", "check", "dataset", "detect",
    "efficiency", "estimate", "flow", "presets", "retrieve", "run", "scene", "score", "sweep", "wake", "wind",
]  # fmt: skip

Path_ = Union[str, "os.PathLike[str]"]
#: Keys of a scene or case by sections, or the path of its file.
Scene = Union[Mapping[str, Any], Path_]
#: Called with the name of a stage, the part of it that is done, and a text; True shows them on standard error.
Progress = Union[Callable[[str, float, str], object], bool, None]
#: Dictionaries of scenes and cases by the words that stand for them.
Texts = dict[str, dict[str, object]]
#: A map of a scan, or the path of one.
Scan = Union["xarray.Dataset", Path_]


class WakescopeError(Exception):
    """What the program refuses, with its text; `problems` has every one, the other attributes are those of the first.

    Attributes: `key` (path of the key, or word of the command), `value`, `limit` (what is allowed), `path` and `line` of the file;
    each None where there is none.
    """

    def __init__(self, text: str, problems: Sequence[Mapping[str, Any]] = ()) -> None:
        super().__init__(text)
        self.problems = list(problems)
        first = self.problems[0] if self.problems else {}
        self.key: str | None = first.get("key")
        self.value: str | None = first.get("value")
        self.limit: str | None = first.get("allowed")
        self.path: str | None = first.get("file")
        self.line: int | None = first.get("line")

    @classmethod
    def _of(cls, text: str) -> WakescopeError:
        report = json.loads(text)
        return cls(report["error"], report["problems"])

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.problems)


def scene(preset: str | None = None, **keys: Any) -> dict[str, Any]:
    """All keys of the default scene, or of a lidar of `presets()`, with some changed: `scene(**{"pulse.energy_j": 1e-4})`.

    A dictionary replaces a whole section, and so its kind: `scene(flow={"kind": "calm"})`. None takes a key away.
    """
    return _wakescope.scene(preset, keys)


def case(name: str) -> dict[str, Any]:
    """All keys of a wake of a preset, such as "coarse", or of an example of a flow, such as "vortex_pair"."""
    def text(*words: str) -> str:
        return _wakescope.call(words, {}, None, True, None)[2]

    try:
        return _wakescope.table(text("wake", "--preset", name, "--print"))
    except WakescopeError:
        return _wakescope.table(text("flow", "--example", name))


def check(scene: Scene, **options: Any) -> dict[str, Any]:
    """What a run of the scene will do, leave out and why, the forecast of its time and memory, warnings."""
    return _command("check", scene, out=None, **options).answer


def run(scene: Scene, threads: int | None = None, progress: Progress = None, **options: Any) -> Result:
    """Runs the whole measurement: `.map`, `.profile`, `.flow`, ... of what the scene's outputs ask for."""
    return _command("run", scene, threads=threads, progress=progress, **options)


def estimate(signals: numpy.ndarray[Any, Any] | Path_, scene: Scene, **options: Any) -> Result:
    """Velocities, `.map`, from raw signals: an array [record, sample] or [line, pulse, sample], or a file.

    The array is real, complex or of a converter's codes, and is not copied.
    """
    word = _path(signals) if isinstance(signals, (str, os.PathLike)) else "signals"
    array = None if isinstance(signals, (str, os.PathLike)) else signals
    return _command("estimate", word, given=("--scene", scene), signals=array, **options)


def retrieve(data: Scan | Sequence[Scan], scene: Scene | None = None, **options: Any) -> xarray.Dataset:
    """Circulation, place and core of the vortices of scans, with the covariance of the parameters of each."""
    result = _of_scans("retrieve", data, scene, options)
    if "scans" not in result.answer:
        return attributes(result["retrieval"], result.answer)
    return covariance(result["retrieval"], result.answer["scans"])


def detect(data: Scan | Sequence[Scan] = (), scene: Scene | None = None, **options: Any) -> xarray.Dataset:
    """Whether scans hold a wake; without scans how often wakes of each circulation are found in those of the scene."""
    result = _of_scans("detect", data, scene, options)
    return attributes(result["detection" if "detection" in result else "detection_power"], result.answer)


def wind(data: Scan | Sequence[Scan], **options: Any) -> xarray.Dataset:
    """Wind over time and height with standard errors, and turbulence, from scans of one lidar; `wind=[4.2, 4.2]` is that across a stare."""
    result = _of_scans("wind", data, None, options)
    return attributes(result["wind"], result.answer)


def bound(scene: Scene, **options: Any) -> xarray.Dataset:
    """The Cramer-Rao bound on the velocity, against signal-to-noise ratio and against range."""
    return _command("bound", scene, keep="bound.csv", **options)["bound"]


def budget(scene: Scene, **options: Any) -> xarray.Dataset:
    """The power budget in dB at some ranges, `range=[280, 400]`."""
    result = _command("budget", scene, **options)
    return attributes(result["budget"], {**result.answer, **result.answer["limits"]})


def efficiency(scene: Scene, **options: Any) -> xarray.Dataset:
    """Heterodyne efficiency and signal-to-noise ratio against range."""
    return _command("efficiency", scene, **options)["profile"]


def sweep(scene: Scene, vary: Mapping[str, Any] | Sequence[str] = (), **options: Any) -> xarray.Dataset:
    """The results of many scenes: `vary={"pulse.energy_j": [1e-4, 2e-4]}`; `out` keeps the folder, for `resume` and `shard`."""
    if isinstance(vary, Mapping):
        vary = [f"{key}={_list(values)}" for key, values in vary.items()]
    return _command("sweep", scene, in_folder=True, vary=list(vary), **options)["results"]


def score(data_set: Path_, predictions: Any, **options: Any) -> xarray.Dataset:
    """Errors, coverage and detection of predictions for the scans of a data set, with 95 % intervals, by group, bin and quantity.

    Predictions are a CSV file or a table: columns by their names, a `pandas.DataFrame` or an `xarray.Dataset` such as `retrieve` gives.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = predictions if isinstance(predictions, (str, os.PathLike)) else write_table(Path(folder) / "predictions.csv", predictions)
        result = _command("score", data_set, path, **options)
        return attributes(result["score"], result.answer)


def accuracy(scene: Scene, within: float, **options: Any) -> xarray.Dataset:
    """Numerical error and run time of a scene or of the case of a flow, setting by setting: shifts of each metric with their standard
    errors, and the cheapest value whose error is `within` a relative error, such as 0.03."""
    result = _command("accuracy", scene, within=within, **options)
    return attributes(result["accuracy"], result.answer)


def dataset(plan: Scene | None, out: Path_, progress: Progress = None, **options: Any) -> dict[str, Any]:
    """Simulates a data set with exact truth into a folder, by a plan or with `plan=None` by a `preset`; `shard="1/4"`, `resume=True`.

    The arrays are `xarray.open_zarr(f"{out}/scans.zarr")`; returned is what was done.
    """
    return _command("dataset", plan, out=out, progress=progress, **options).answer


def flow(case: Scene, out: Path_ | None = None, progress: Progress = None, **options: Any) -> Result:
    """Simulates a flow; without `out` its files stay in memory."""
    return _command("flow", case, in_folder=True, out=out, progress=progress, **options)


def wake(case: Scene | None = None, out: Path_ | None = None, progress: Progress = None, **options: Any) -> Result:
    """Simulates a wake near the ground, of a case over a `preset`; without `out` its files stay in memory."""
    return _command("wake", case, in_folder=True, out=out, progress=progress, **options)


def main() -> int:
    """The program `wakescope`."""
    # Ctrl-C ends the program as it does without Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _wakescope.main(sys.argv)


def _path(path: Path_) -> str:
    return os.fspath(path)


def _list(values: Any) -> str:
    if isinstance(values, str) or not hasattr(values, "__iter__"):
        return _word(values)
    return ",".join(_word(value) for value in values)


def _word(value: Any) -> str:
    if isinstance(value, float):
        # numpy's floats are written as Python's.
        return repr(float(value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def _options(options: Mapping[str, Any]) -> list[str]:
    """Keywords as words: True is a word alone, texts of a list are repeated, numbers of a list have commas between."""
    words: list[str] = []
    for name, value in options.items():
        word = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(word)
        elif isinstance(value, (list, tuple)) and all(isinstance(one, (str, os.PathLike)) for one in value):
            words.extend(part for one in value for part in (word, _path(one)))
        else:
            words.append(f"{word}={_list(value)}")
    return words


def _show(stage: str, part: float, text: str) -> None:
    sys.stderr.write(f"\r\x1b[K{stage} {100 * part:3.0f} %  {text}")
    sys.stderr.flush()


def _text(scene: Scene, word: str, texts: Texts) -> str:
    """The word for a scene: its path, or one that stands for its dictionary."""
    if not isinstance(scene, Mapping):
        return _path(scene)
    texts[word] = dict(scene)
    return word


def _command(
    command: str,
    *inputs: Scene | None,
    given: tuple[str, Scene] | None = None,
    signals: Any = None,
    in_folder: bool = False,
    keep: str = ".",
    progress: Progress = None,
    **options: Any,
) -> Result:
    """Runs a command; its files are kept in memory unless `out` says where they go, in a folder on the way if they must."""
    texts: Texts = {}
    word = "case" if command in ("flow", "wake") else "scene"
    words = [command, *(_text(each, word, texts) for each in inputs if each is not None)]
    if given is not None:
        words += [given[0], _text(given[1], "scene", texts)]
    stays = options.get("out") is not None or command == "check"
    if progress is True:
        progress = _show
    with tempfile.TemporaryDirectory() if in_folder and not stays else nullcontext() as folder:
        if not stays:
            options["out"] = folder or keep
        words += _options(options)
        code, answer, text, files = _wakescope.call(words, texts, signals, not stays and not in_folder, progress or None)
        result = Result(code, json.loads(answer), text, dict(files))
        if stays or in_folder:
            result.read_files(into_memory=not stays)
    if progress is _show:
        sys.stderr.write("\n")
    return result


def _of_scans(command: str, data: Scan | Sequence[Scan], scene: Scene | None, options: dict[str, Any]) -> Result:
    """Runs a command on files; datasets become files on the way."""
    scans: Sequence[Scan] = data if isinstance(data, (list, tuple)) else [data]  # type: ignore[list-item]
    with tempfile.TemporaryDirectory() as folder:
        paths: list[str] = []
        for number, scan in enumerate(scans):
            if isinstance(scan, (str, os.PathLike)):
                paths.append(_path(scan))
            else:
                paths.append(str(Path(folder) / f"dataset_{number + 1}.nc"))
                scan.to_netcdf(paths[-1], format="NETCDF3_64BIT")
        return _command(command, *paths, given=None if scene is None else ("--scene", scene), **options)
