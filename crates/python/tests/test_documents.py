"""The snippets of the documentation, the notebooks and the examples run."""

from __future__ import annotations

import importlib.util
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[3]
PAGES = sorted((ROOT / "docs" / "python" / "pages").glob("*.md"))
NOTEBOOKS = sorted((ROOT / "docs" / "python" / "notebooks").glob("*.py"))
EXAMPLES = sorted((ROOT / "examples" / "python").glob("*.py"))
BLOCK = re.compile(r"(?:<!-- needs (\w+) -->\n)?```python\n(.*?)```", re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_snippets(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    text = page.read_text(encoding="utf-8")
    scope: dict = {"__name__": page.stem}
    for found in BLOCK.finditer(text):
        needs, code = found.groups()
        if needs and importlib.util.find_spec(needs) is None:
            continue
        line = text[: found.start(2)].count("\n")
        exec(compile("\n" * line + code, str(page), "exec"), scope)


def test_there_are_pages():
    assert len(PAGES) > 5 and len(NOTEBOOKS) == 3 and len(EXAMPLES) >= 2
    assert sum(len(BLOCK.findall(page.read_text(encoding="utf-8"))) for page in PAGES) > 15


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks(notebook, monkeypatch):
    jupytext = pytest.importorskip("jupytext")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    book = jupytext.read(notebook)
    assert any(cell.cell_type == "markdown" for cell in book.cells)
    resources = {"metadata": {"path": str(notebook.parent)}}
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3", resources=resources).execute()


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.stem)
def test_examples(example):
    pytest.importorskip("scipy")
    done = subprocess.run([sys.executable, example], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
