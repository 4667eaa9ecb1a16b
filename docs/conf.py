"""The documentation site: `make docs` builds it into build/docs. Warnings are errors."""

import json
import os
import re
import tomllib
from importlib.util import find_spec
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from pydantic import BaseModel
from pygments.lexers.special import TextLexer
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.directives.code import CodeBlock
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.writers.html5 import HTML5Translator

import pinnray as pr

project = "pinn-ray"
version = release = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))[
    "project"
]["version"]
copyright = "pinn-ray contributors, MIT licence"
language = "en"
smartquotes = False  # two hyphens begin an option

NOTEBOOKS_RUN = find_spec("myst_nb") is not None and os.environ.get("NOTEBOOKS") != "off"
"""Whether notebooks run, by the packages of requirements/docs.txt; else the site shows their code."""

extensions = [
    "myst_nb" if NOTEBOOKS_RUN else "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "cyclopts.sphinx_ext",
]
exclude_patterns = ["examples"]
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["colon_fence"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_raise_on_error = True

default_role = "code"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_typehints_format = "short"
maximum_signature_line_length = 90
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar, napoleon_attr_annotations = True, False
add_module_names = False

# A name of the public interface must be on a page. Those of other libraries would need a network.
nitpicky = True
nitpick_ignore_regex = [
    (
        "py:.*",
        r"(numpy|pathlib|annotated_types|collections\.abc|types|pandas|pd|matplotlib|pydantic|pyvista)\..*",
    ),
    ("py:.*", r"(Figure|Path|ArrayLike|Array|FloatArray|Value|shapely\..*|(.*\.)?T|.*Options)"),
    ("py:.*", r"typing\.Annotated\[.*|lambda"),  # numbers that JSON has as null
    ("py:.*", r"pinnray\.comparison\.(figures|evaluation\.truths)\..*"),
    ("py:.*", r"pinnray\.geometry\.(finger\.(rules|parameters)|drawing\.placement)\..*"),
    ("py:.*", r"pinnray\.(film|measurements|robots|runtime|studies|vision)\..*"),
    ("py:.*", r"pinnray\.solvers\.fem\.adaptive_refinement\..*"),
]

html_math_renderer = "mathml"  # which browsers draw without a script
html_theme = "pydata_sphinx_theme"
html_title = f"pinn-ray {version}"
html_logo = html_favicon = "static/logo.svg"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = html_show_sourcelink = False
html_sidebars = {page: [] for page in ("tutorial", "questions", "gallery")}  # no pages below them
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 9,
    "navbar_persistent": ["search-button"],
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "logo": {"text": html_title},
}
if repository := os.environ.get("REPOSITORY"):  # its address, where the site is built for others
    html_theme_options["icon_links"] = [
        {"name": "Repository", "url": repository, "icon": "fa-solid fa-code-branch"}
    ]

linkcheck_timeout = 20
linkcheck_retries = 2


_NESTED = r"~?numpy\._typing\._nested_sequence\._NestedSequence"
_SCALARS = r"bool \| int \| float \| complex \| str \| bytes"
_SUPPORTS = r"~?numpy\._typing\._array_like\._SupportsArray\[~?numpy\.dtype\[~?typing\.Any\]\]"
LONG_TYPES = {
    rf"{_SUPPORTS} \| {_NESTED}\[{_SUPPORTS}\] \| {_SCALARS} \| {_NESTED}\[{_SCALARS}\]": "ArrayLike",
    r"~?numpy\.ndarray\[[^][]*, ~?numpy\.dtype\[[^][]*\]\]": "Array",
}
"""Short names of arrays in signatures."""


def shorten(_app: Sphinx, _what: str, _name: str, value: object, _options: object, *texts: str) -> object:
    """The signature and the returned type with short names of arrays; none for a table of parameters."""
    if isinstance(value, type) and issubclass(value, BaseModel):
        return "", ""
    for long, short in {**LONG_TYPES, "<factory>": "..."}.items():
        texts = tuple(text and re.sub(long, short, text) for text in texts)
    return texts


def is_hidden(_app: Sphinx, _what: str, name: str, _value: object, skipped: bool, _options: object) -> bool:
    """Whether a name is left out: constants are for readers of the code."""
    return skipped or name.isupper()


def name_public(_app: Sphinx, doctree: nodes.document) -> None:
    """Write `pr.` before the names that `import pinnray as pr` has."""
    public = {f"{value.__module__}.{name}" for name in pr.__all__ if callable(value := getattr(pr, name))}
    for signature in doctree.findall(addnodes.desc_signature):
        if public & set(signature["ids"]):
            signature.insert(0, addnodes.desc_addname("pr.", "pr."))


NOT_IN_NOTEBOOKS = r"^:::.*\n?|^\[?!\[.*\n?|\[(.*?)\]\([^)]*\)"
"""What the text of a notebook goes without: boxes and pictures of the site, and addresses of links."""


def cells_of(text: str) -> list[dict[str, object]]:
    """The cells of a notebook: code of a page that Python or IPython runs, and the text between."""
    cells: list[dict[str, object]] = []
    body = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    for number, part in enumerate(re.split(r"^```(.*?)\n(.*?)^```$", body, flags=re.DOTALL | re.MULTILINE)):
        if number % 3 == 1:
            language = part
        elif number % 3 == 2 and language in ("python", "{code-cell} python"):
            cells.append(
                {
                    "cell_type": "code",
                    "source": part.strip(),
                    "metadata": {},
                    "outputs": [],
                    "execution_count": None,
                }
            )
        elif number % 3 == 2:
            cells.append({"cell_type": "markdown", "source": f"```{language}\n{part}```", "metadata": {}})
        elif said := re.sub(NOT_IN_NOTEBOOKS, r"\1", part, flags=re.MULTILINE).strip():
            cells.append({"cell_type": "markdown", "source": said, "metadata": {}})
    return [{**cell, "id": str(place)} for place, cell in enumerate(cells)]


def offer_notebook(app: Sphinx, page: str, _template: str, context: dict[str, str], _tree: object) -> None:
    """Put a link to its notebook on top of a page that is one, and write the file beside the page."""
    if page != "gallery" and not page.startswith("notebooks/"):
        return
    cells = cells_of(app.env.doc2path(page).read_text("utf-8"))
    file = Path(app.outdir) / f"{page}.ipynb"
    file.parent.mkdir(exist_ok=True)
    whole = {
        "cells": cells,
        "metadata": {"language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    file.write_text(json.dumps(whole, indent=1), "utf-8")
    link = f'<p><a href="{file.name}" download>Download as a notebook</a></p>'
    context["body"] = context["body"].replace("</h1>", f"</h1>{link}", 1)


def formula(translator: HTML5Translator, node: nodes.math | nodes.math_block) -> None:
    """Write a formula as MathML."""
    display = "block" if isinstance(node, nodes.math_block) else "inline"
    mathml = convert(node.astext(), display=display)
    translator.body.append(f'<div class="formula">{mathml}</div>' if display == "block" else mathml)
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Show the code of notebooks where the packages that run them are missing."""
    if not NOTEBOOKS_RUN:
        app.add_directive("code-cell", CodeBlock)
    app.add_lexer("csv", TextLexer)
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    app.connect("autodoc-process-signature", shorten)
    app.connect("autodoc-skip-member", is_hidden)
    app.connect("doctree-read", name_public)
    app.connect("html-page-context", offer_notebook)
    # The sentence below a constant may have a colon; what stands before it is no type.
    GoogleDocstring._parse_attribute_docstring = GoogleDocstring._consume_to_end
