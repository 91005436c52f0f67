"""The snippets of the documentation, the notebooks and the examples run."""

from __future__ import annotations

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


NEEDED = [
    (page, package)
    for page in PAGES
    for package in sorted({needs for needs, _ in BLOCK.findall(page.read_text(encoding="utf-8"))} - {""})
]


def run_snippets(page, wanted):
    """Runs the snippets of a page in one scope, those that need another package than the wanted ones left out; how many of them."""
    text = page.read_text(encoding="utf-8")
    scope: dict = {"__name__": page.stem}
    ran = 0
    for found in BLOCK.finditer(text):
        needs, code = found.groups()
        if needs is None or needs == wanted:
            line = text[: found.start(2)].count("\n")
            exec(compile("\n" * line + code, str(page), "exec"), scope)
            ran += needs == wanted
    return ran


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_snippets(page, monkeypatch):
    monkeypatch.chdir(ROOT)
    run_snippets(page, None)


@pytest.mark.parametrize("page, package", NEEDED, ids=lambda x: getattr(x, "stem", x))
def test_snippets_that_need_a_package(page, package, monkeypatch):
    pytest.importorskip(package)
    monkeypatch.chdir(ROOT)
    assert run_snippets(page, package) > 0


def test_there_are_pages():
    assert len(PAGES) > 5 and len(NOTEBOOKS) == 3 and len(EXAMPLES) >= 2
    assert {package for _, package in NEEDED} == {"torch", "jax"}
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
