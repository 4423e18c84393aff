"""The documentation's site: `python -m sphinx -W --keep-going docs site` (extra `docs`).

The pages of this folder are the guide and `examples` is a gallery that runs while it is built. Commands,
options and effects are read from the program (`_reference.py`), evidence from the files of the benchmarks
(`_evidence.py`), modules from their docstrings without importing them. A warning is an error.
"""

import os
import re
import sys
from importlib.metadata import version as installed
from pathlib import Path

import pyvista

import palpate

ROOT = Path(__file__).resolve().parents[1]
INSTALLED = Path(palpate.__file__).parent
if INSTALLED.name != "palpate":
    raise SystemExit(
        f"palpate is installed as editable, from {INSTALLED}, where its rooms have not the names that their "
        "pages say. Run: pip install '.[docs]'"
    )
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]
import _evidence  # noqa: E402
import _notebooks  # noqa: E402
import _reference  # noqa: E402
import _touch  # noqa: E402

project = "Palpate"
author = "The Palpate developers"
version = release = installed("palpate")
extensions = ["myst_parser", "autoapi.extension", "sphinx_gallery.gen_gallery", "sphinx_copybutton"]
html_theme = "furo"
html_title = f"Palpate {release}"
html_show_copyright = False
html_favicon = None
html_extra_path = ["reference/generated/files"]  # schemas/NAME.schema.json, notebooks/NAME.ipynb
exclude_patterns = ["**/README.md"]
# names of constants that are unpacked from a tuple are there all the same
# annotations name local types by their last word, which others share
suppress_warnings = ["config.cache", "autoapi.python_import_resolution", "ref.python"]

myst_heading_anchors = 4

autoapi_dirs = [str(INSTALLED)]
autoapi_root = "reference/rooms"
autoapi_options = ["members", "undoc-members", "show-module-summary"]
# flags in signatures: the commands' pages say them; a kit's adapters are scripts, not modules
autoapi_ignore = ["*/operations/*", "*/conformance/adapters/*"]
autoapi_member_order = "groupwise"
autoapi_python_class_content = "class"
autoapi_add_toctree_entry = False
autoapi_keep_files = False

pyvista.OFF_SCREEN = pyvista.BUILDING_GALLERY = True
# for the processes that run essays side by side
os.environ |= {"PYVISTA_OFF_SCREEN": "true", "PYVISTA_BUILDING_GALLERY": "true", "MPLBACKEND": "Agg"}
sphinx_gallery_conf = {
    "examples_dirs": [str(ROOT / "examples")],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r".*\.py",
    "ignore_pattern": r"(__init__|conftest|robot_client)\.py",
    "image_scrapers": ("matplotlib", "pyvista"),
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "write_computation_times": False,
    "remove_config_comments": True,
    "min_reported_time": 0,
    "abort_on_example_error": True,
    "parallel": 2,
    "show_signature": False,
    "reset_modules": (),
}

_TICKS = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
_MARKS = re.compile(r"(?<!\\)([*|])|(?<=\w)(_)(?=[\s.,;:)\]]|$)")


def plain_words(app, what, name, obj, options, lines):
    """Docstrings are plain words, no markup: single ticks are code, stars and bars are themselves, what is
    set in stands as it is."""
    said: list[str] = []
    inside = False
    for line in lines:
        if line.startswith(" ") and not inside:
            said += ["", "::", ""]
        elif line and not line.startswith(" ") and inside:
            said.append("")
        inside = line.startswith(" ") or (inside and not line)
        said.append(line if inside else _escaped(line))
    lines[:] = said


def _escaped(line: str) -> str:
    parts = _TICKS.split(line)
    # a letter right after code needs a mark between them that nobody sees
    joined = ["\\ " if part[:1].isalnum() else "" for part in [*parts[1:], ""]]
    return "".join(
        f"``{p}``{after}" if k % 2 else _MARKS.sub(r"\\\1\2", p)
        for k, (p, after) in enumerate(zip(parts, joined, strict=True))
    )


def short_navigation(app, page, template, context, doctree):
    """Beside a page stand those of its own branch: all of the reference beside each took half of the time."""
    if whole := context.get("toctree"):
        context["toctree"] = lambda **how: whole(**how | {"collapse": True, "maxdepth": 2})


def with_its_notebook(app, page, text):
    """A tutorial ends with the way to its notebook."""
    folder, _, name = page.rpartition("/")
    if folder == "tutorials" and name in _notebooks.NAMES:
        text[0] += f'\n<p><a href="../notebooks/{name}.ipynb" download>This page as a notebook</a></p>\n'


def with_pages_to_press(app):
    """Those of docs/touch.md, written beside the site's own while these are made."""
    if app.builder.format == "html":
        process = _touch.started(Path(app.outdir) / "touch")
        app.connect("build-finished", lambda app, problem: _touch.finished(process))


def setup(app):
    """Sphinx's hook."""
    app.connect("builder-inited", with_pages_to_press)
    _reference.write(ROOT / "docs" / "reference" / "generated")
    _notebooks.write(ROOT / "docs" / "reference" / "generated" / "files" / "notebooks")
    app.connect("source-read", with_its_notebook)
    _evidence.write(ROOT / "docs" / "evidence" / "generated")
    app.connect("autodoc-process-docstring", plain_words)
    app.connect("html-page-context", short_navigation, priority=400)
