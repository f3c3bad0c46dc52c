"""Blocks of Python in the book run as they stand, and the page on fields prints what the program does."""

import re
import subprocess
import sys

import pytest
from conftest import ROOT


def blocks(page, language):
    text = (ROOT / "docs/src" / page).read_text()
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


@pytest.mark.parametrize("page", ["python.md", "les.md"])
def test_blocks_of_python_run_in_their_order(page, tmp_path):
    script = tmp_path / "page.py"
    script.write_text("import matplotlib\nmatplotlib.use('agg')\n" + "\n".join(blocks(page, "python")))
    subprocess.run([sys.executable, script], check=True, cwd=tmp_path)


def test_scans_of_fields_print_what_the_page_shows(program, tmp_path):
    [script] = blocks("les.md", "python")
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)
    [scene] = blocks("les.md", "toml")
    (tmp_path / "les.toml").write_text(scene)
    printed = ""
    for line in blocks("les.md", "sh")[0].splitlines():
        printed += program(*line.split()[1:], cwd=tmp_path).stdout
    for line in blocks("les.md", "text")[0].splitlines():
        assert line in printed
