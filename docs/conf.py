"""Configuration of the documentation. Everything is served locally: a page fetches nothing from elsewhere."""

import sys
import warnings
from importlib.metadata import version as installed_version
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

project = "printhammer"
author = "The printhammer authors"
copyright = author
release = version = installed_version("printhammer")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "key_tables",
    "mathml",
    "measured_tables",
    "studio_page",
]
exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py"]
default_role = "code"
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}

myst_enable_extensions = ["deflist", "dollarmath", "fieldlist", "smartquotes"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "printhammer"
html_static_path = ["_static"]
html_css_files = ["printhammer.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": False}

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_default_options = {"exclude-members": "model_config, model_post_init"}
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_maximum_signature_line_length = 88

# A warning in an example is a fault of the example or of the program.
warnings.filterwarnings("error", module=r"printhammer")

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"cubic_spring\.py$",
    "within_subsection_order": "gallery_style.TeachingOrder",
    "reset_modules": ("gallery_style.plain_style",),
    "image_scrapers": ("gallery_style.figures",),
    "abort_on_example_error": True,
    "backreferences_dir": None,
    "capture_repr": (),
    "default_thumb_file": None,
    "download_all_examples": False,
    "min_reported_time": 1e9,
    "plot_gallery": "True",
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}
