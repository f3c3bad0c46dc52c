"""What a command gives: an answer, and files that are read as datasets."""

from __future__ import annotations

import contextlib
import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _wakescope

if TYPE_CHECKING:
    import os

    import numpy
    import xarray


# The unit at the end of a name: what has one is a number, also where no row has it.
UNIT = re.compile(r"_(m2_s|m_s|per_s|per_m|m|s|rad|db|hz|j|tau|b0)$")


class Result:
    """What a command gives.

    `answer` is the object that `--json` prints, `text` what a person would read, `code` the exit code, `files` the files by their names:
    bytes, or paths where they were written. A map, a table, ... is a dataset: `result.map` or `result["map"]` is `map.nc`, else `map.csv`.
    """

    def __init__(self, code: int, answer: dict[str, Any] | None, text: str, files: dict[str, bytes | Path]) -> None:
        self.code = code
        self.answer: dict[str, Any] = answer or {}
        self.text = text
        self.files = files
        self._datasets: dict[str, xarray.Dataset] = {}

    def read_files(self, into_memory: bool) -> None:
        """Takes the files that the command has written."""
        paths = self.answer.get("files") or []
        for path in map(Path, [paths] if isinstance(paths, str) else paths):
            self.files[path.name] = path.read_bytes() if into_memory else path

    def read(self, name: str) -> bytes:
        """The bytes of a file."""
        content = self.files[name]
        return content.read_bytes() if isinstance(content, Path) else content

    def write(self, folder: str | os.PathLike[str], overwrite: bool = False) -> list[Path]:
        """Writes all files to a folder, all or none; returns their paths. Existing files are replaced only with `overwrite`."""
        files = [(name, self.read(name)) for name in self.files]
        return [Path(path) for path in _wakescope.write(files, folder, overwrite)]

    def __iter__(self) -> Iterator[str]:
        return iter({name.rsplit(".", 1)[0]: None for name in self.files if name.endswith((".nc", ".csv"))})

    def __contains__(self, stem: object) -> bool:
        return stem in list(self)

    def __getitem__(self, stem: str) -> xarray.Dataset:
        if stem not in self:
            raise KeyError(f"{stem}: there is {', '.join(self) or 'no table'}")
        if stem not in self._datasets:
            name = f"{stem}.nc" if f"{stem}.nc" in self.files else f"{stem}.csv"
            self._datasets[stem] = dataset(name, self.read(name))
        return self._datasets[stem]

    def __getattr__(self, stem: str) -> xarray.Dataset:
        if stem.startswith("_"):
            raise AttributeError(stem)
        try:
            return self[stem]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        return f"<wakescope.Result of {', '.join(self.files) or 'no files'}>"

    def _repr_png_(self) -> bytes | None:
        pictures = [name for name in self.files if name.endswith(".png")]
        return self.read("map.png" if "map.png" in pictures else pictures[0]) if pictures else None


def dataset(name: str, content: bytes) -> xarray.Dataset:
    """A file as a dataset; the first column of a table is its coordinate where no value is there twice."""
    import xarray

    if name.endswith(".nc"):
        return xarray.open_dataset(io.BytesIO(content), engine="scipy").load()
    rows = list(csv.reader(line for line in content.decode().splitlines() if not line.startswith("#")))
    columns = {name: numbers(name, [row[place] for row in rows[1:]]) for place, name in enumerate(rows[0])}
    first, values = next(iter(columns.items()))
    is_axis = values.dtype.kind == "f" and len(set(values.tolist())) == len(values) > 0
    axis = first if is_axis else "index"
    return xarray.Dataset({column: (axis, cells) for column, cells in columns.items()})


def numbers(name: str, cells: Sequence[str]) -> numpy.ndarray[Any, Any]:
    """The cells of a column as whole numbers, numbers or texts, whichever comes first."""
    import numpy

    # An empty cell is a number that is not there, unless no cell has one and the name tells of none.
    if any(cells) or UNIT.search(name) or not cells:
        for read in (int, lambda cell: float(cell or "nan")):
            with contextlib.suppress(ValueError):
                return numpy.array([read(cell) for cell in cells])
    return numpy.array(cells, dtype=str)


def write_table(path: Path, table: Any) -> Path:
    """Writes a table as CSV: columns by their names, of a dataset those along the axis of its flights. What is missing is an empty cell."""
    import numpy

    names = [name for name in table.variables if table[name].dims == table["flight"].dims] if hasattr(table, "variables") else list(table)
    columns = [numpy.asarray(table[name]).tolist() for name in names]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows(["" if cell is None or cell != cell else cell for cell in row] for row in zip(*columns))
    return path


def attributes(found: xarray.Dataset, answer: Mapping[str, Any]) -> xarray.Dataset:
    """The same with the plain values of an answer as attributes."""
    plain = {name: int(value) if isinstance(value, bool) else value for name, value in answer.items() if isinstance(value, (str, int, float))}
    return found.assign_attrs(plain)


def covariance(found: xarray.Dataset, scans: Sequence[Mapping[str, Any]]) -> xarray.Dataset:
    """The same with the parameters of each scan's fit and their covariance."""
    import numpy
    import xarray

    names: list[str] = scans[0]["parameters"] if scans else []
    values = numpy.full((len(scans), len(names)), numpy.nan)
    matrix = numpy.full((len(scans), len(names), len(names)), numpy.nan)
    for place, scan in enumerate(scans):
        if scan["wake"] is None:
            continue
        values[place] = [scan["wake"][name] for name in names]
        rows = numpy.array(scan["covariance"], dtype=float)
        if rows.shape == matrix.shape[1:]:
            matrix[place] = rows
    added = xarray.Dataset(
        {"wake": (("fit", "parameter"), values), "covariance": (("fit", "parameter", "parameter_2"), matrix)},
        {"fit": [scan["scan"] for scan in scans], "parameter": names, "parameter_2": names},
    )
    return found.merge(added)
