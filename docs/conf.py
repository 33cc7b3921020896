"""Sphinx configuration of the book. Built from a copy of docs/ that docs/_tools/stage.py lays out."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent  # docs/, or docs/_build/source when staged
ROOT = next(folder for folder in HERE.parents if (folder / "pyproject.toml").is_file())
BUILD = ROOT / "docs" / "_build"
sys.path[:0] = [str(ROOT / "docs" / "_tools"), str(ROOT)]

import book  # noqa: E402

import vslam_ref  # noqa: E402

project = "vslam_ref"
author = "The vslam_ref authors"
project_copyright = "2026, The vslam_ref authors. Text CC BY 4.0, code MIT"
version = release = vslam_ref.__version__
language = "en"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "house_sphinx",
]
exclude_patterns = ["_build", "_tools", "chapters/exercises", "chapters/solutions"]

# The pages were executed by docs/_tools/notebooks.py; here they are only rendered.
nb_execution_mode = "off"
nb_merge_streams = True
nb_render_markdown_format = "myst"  # tables that a cell makes
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_rtype = False
napoleon_use_ivar = True  # a dataclass documents its fields once

suppress_warnings = [
    "myst.mathjax",
    "myst-nb.lexer",  # a page without its notebook, of which docs/_tools/stage.py warns
    "ref.python",  # a word of a docstring's type line that is the name of several fields
]
if not book.pages():  # nothing to cite yet: the first page makes every missing label an error
    suppress_warnings.append("ref.eq")

html_theme = "sphinx_book_theme"
html_title = "vslam_ref"
html_static_path = ["_static"]
html_css_files = ["book.css"]
html_copy_source = False
html_theme_options = {
    "use_download_button": False,
    "use_fullscreen_button": False,
    "navbar_persistent": [],  # the side bar has a search field already
    "show_navbar_depth": 1,
    "show_toc_level": 2,
}

# Formulas are drawn by a copy of MathJax in the site itself (docs/_tools/mathjax.py).
mathjax3_config = {"svg": {"fontCache": "global"}, "options": {"enableMenu": False}}
if (BUILD / "mathjax" / "mathjax" / "tex-svg.js").is_file():
    html_static_path.append(str(BUILD / "mathjax"))
    mathjax_path = "mathjax/tex-svg.js"
else:
    mathjax_path = "https://cdn.jsdelivr.net/npm/mathjax@3.2.2/es5/tex-svg.js"
