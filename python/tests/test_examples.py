"""Notebooks are those of their texts, and the pages of the book are those of the notebooks. `python/check` runs them."""

import json
import subprocess
import sys

import pytest
from conftest import ROOT

EXAMPLES = ROOT / "python/examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))


def test_notebooks_are_those_of_their_texts(tmp_path):
    subprocess.run([sys.executable, EXAMPLES / "make_notebooks.py", tmp_path], check=True)
    made = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_text() for path in NOTEBOOKS} and len(made) == 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_pages_of_the_book_have_the_cells_of_their_notebook(path):
    page = (ROOT / f"docs/src/notebooks/{path.stem}.md").read_text()
    missing = [cell["source"] for cell in json.loads(path.read_text())["cells"] if cell["source"] not in page]
    assert not missing, missing
