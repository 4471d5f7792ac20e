"""Sphinx configuration of the manual: python -m sphinx -W -b html docs docs/_build/html

The tutorials and the gallery of scenes are run where their files have changed; ``-D plot_gallery=0`` runs none.
"""

import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))

import findings  # noqa: E402
import inventories  # noqa: E402
import tables  # noqa: E402

from vibrokit import __version__  # noqa: E402

project = "vibrokit"
author = "The vibrokit developers"
copyright = "The vibrokit developers"
version = release = __version__

extensions = [
    "mathml",
    "type_words",
    "sphinx.ext.autodoc",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "scenes", "**/sg_execution_times.rst", "sg_execution_times.rst"]
autodoc_member_order = "bysource"
default_role = "py:obj"  # names in backticks of docstrings are links where the reference has them
autodoc_typehints = "none"  # the numpydoc sections say it in words
napoleon_google_docstring = False
napoleon_custom_sections = ["For developers"]
intersphinx_mapping = inventories.write_inventories(DOCS)
sphinx_gallery_conf = {
    "examples_dirs": ["../tutorials", "scenes"],
    "gallery_dirs": ["tutorials", "gallery"],
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"__",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "capture_repr": (),  # only print writes output
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 1,
}
html_theme = "furo"
html_title = "vibrokit"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["manual.css"]

findings.write(DOCS)
tables.write(DOCS)
