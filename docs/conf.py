"""Settings of the documentation site: `python -m sphinx -W --keep-going docs build/site`."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "site"))
sys.path.insert(0, str(HERE.parent))

import generate
import inventories

import pushplan

project = "pushplan"
author = "The pushplan developers"
project_copyright = author
version = release = pushplan.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
]
exclude_patterns = ["site"]
templates_path: list[str] = []

myst_enable_extensions = ["attrs_block", "colon_fence"]
myst_heading_anchors = 4
default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {  # by these names, not by what they stand for
    name: name
    for name in (
        *("FloatArray", "IntArray", "BoolArray", "ArrayLike", "Image"),
        *("PositiveFloat", "NonNegativeFloat", "Fraction", "PositiveFraction"),
        *("PositiveInt", "NonNegativeInt"),
    )
}
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
intersphinx_mapping = inventories.reachable(
    {
        "python": "https://docs.python.org/3/",
        "numpy": "https://numpy.org/doc/stable/",
        "scipy": "https://docs.scipy.org/doc/scipy/",
        "gymnasium": "https://gymnasium.farama.org/",
    }
)

pygments_dark_style = "github-dark"
html_theme = "furo"
html_title = f"pushplan {version}"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_search_scorer = str(HERE / "site" / "search_scores.js")
copybutton_prompt_text = "$ "


def setup(app) -> None:
    """Write the generated pages before sources are read."""
    app.connect("builder-inited", lambda app: generate.write_pages(Path(app.srcdir) / "generated"))
    app.connect("source-read", generate.prepare)
    app.connect("missing-reference", generate.resolve)
