"""
Words and scenes go in, an object and the bytes of files come out.
"""

from _typeshed import SupportsGetItem
from os import PathLike
from pathlib import Path
from typing import Any, Final

__all__ = ["VERSION", "call", "main", "presets", "scene", "table", "write"]

VERSION: Final[str]
"""
Version of the program.
"""

def call(words: SupportsGetItem[int, str], texts: "dict[str, dict[str, object]]", signals: Any | None, keep: bool, progress: Any | None) -> tuple[int, str, str, list[tuple[str, bytes]]]:
    """
    Runs a command with the words of its command line. `texts` are dictionaries of scenes and cases by the words that stand for them,
    `signals` an array for the word "signals". With `keep` the files stay in memory. `progress` is called with the name of a stage,
    the part of it that is done and a text. Returns the exit code, an object as JSON, the text and the files.
    """

def main(words: SupportsGetItem[int, str]) -> int:
    """
    Runs the program with the words of its command line, of which the first is its name; returns its exit code.
    """

def presets() -> list[str]:
    """
    Names of the lidars that `scene` knows.
    """

def scene(preset: str | None, keys: "dict[str, object]") -> "dict[str, object]":
    """
    The scene of a preset, or the default one, with some keys changed, `{"section.key": value}`: all its keys.
    """

def table(text: str) -> "dict[str, object]":
    """
    The keys of a text in the format of scenes and cases.
    """

def write(files: SupportsGetItem[int, tuple[str, bytes]], folder: str | PathLike[str], overwrite: bool) -> list[Path]:
    """
    Writes files to a folder, all or none, and returns their paths; existing files are replaced only with `overwrite`.
    """
