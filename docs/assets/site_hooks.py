"""Hooks of ``mkdocs build``: equations as MathML, the notebook, links to files outside ``docs``.

Pages are written for two readers, a code forge and the site. So equations are fenced blocks of
``math`` with a ``\\tag``, and links go to files of the repository; here both become something
that works without a network.
"""

from __future__ import annotations

import posixpath
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter
from pymdownx.slugs import slugify

ROOT = Path(__file__).resolve().parents[2]
ROOT_PAGES = {
    name.lower(): name for name in ("CHANGELOG.md", "CONTRIBUTING.md", "THIRD-PARTY.md")
}  # next to README.md
SOURCE = "source"  # folder of the site for linked files that are no pages
NOTEBOOK, TOUR = "tour.ipynb", "tour.md"
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
TAG = re.compile(r"\\tag\{([^}]*)\}")


def on_config(config: Any) -> Any:
    """Set what YAML cannot say plainly.

    The format of equations, anchors as code forges make them, more pages.
    """
    config.mdx_configs["pymdownx.superfences"] = {
        "custom_fences": [{"name": "math", "class": "equation", "format": equation}]
    }
    config.mdx_configs["toc"] = {
        **config.mdx_configs.get("toc", {}),
        "slugify": slugify(case="lower"),
    }
    if pages := [page for page, name in ROOT_PAGES.items() if (ROOT / name).is_file()]:
        config.nav = [*config.nav, {"Project": pages}]
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages next to README.md, the notebook, and every file that a page links to."""
    for page, name in ROOT_PAGES.items():
        if (ROOT / name).is_file():
            files.append(
                File.generated(config, page, content=(ROOT / name).read_text("utf-8"))
            )
    for file in notebook_page(config):
        files.append(file)
    linked = set()
    for page in files.documentation_pages():
        linked |= {
            _path(page.src_uri, target)
            for _, target, _ in LINK.findall(page.content_string)
        }
    for path in sorted(filter(None, linked)):
        if (site_path := _site_path(path)) and site_path.startswith(f"{SOURCE}/"):
            files.append(
                File.generated(
                    config, site_path, content=(ROOT / path).read_text("utf-8")
                )
            )
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Point links that leave ``docs`` to what the site has of them.

    A folder's name is left as text.
    """

    def renewed(found: re.Match[str]) -> str:
        text, target, anchor = found.groups(default="")
        here = page.file.src_uri
        target = target.replace(NOTEBOOK, TOUR)
        path = _path(here, target)
        if path is None or (path.startswith("docs/") and here not in ROOT_PAGES):
            return f"[{text}]({target}{anchor})"
        if (site_path := _site_path(path)) is None:
            return text if path in text else f"{text} (`{path}`)"
        return f"[{text}]({posixpath.relpath(site_path, posixpath.dirname(here) or '.')}{anchor})"

    return LINK.sub(renewed, markdown)


def notebook_page(config: Any) -> list[File]:
    """The notebook with its stored outputs as a page, and the pictures in it."""
    exporter = MarkdownExporter()
    resources = {"unique_key": "tour", "output_files_dir": "tour_files"}
    text, made = exporter.from_filename(ROOT / "docs" / NOTEBOOK, resources=resources)
    pictures = made["outputs"].items()
    return [
        File.generated(config, TOUR, content=text),
        *(File.generated(config, name, content=data) for name, data in pictures),
    ]


def equation(source: str, *_: Any, **__: Any) -> str:
    """One numbered equation as MathML, which browsers draw without a script."""
    tag = TAG.search(source)
    if tag is None:
        raise PluginError(f"an equation has no \\tag: {source}")
    mathml = convert(TAG.sub("", source).strip(), display="block")
    unread = [
        part.text
        for part in ElementTree.fromstring(mathml).iter()
        if (part.text or "")[:1] in ("\\", "&")
    ]
    if unread:
        raise PluginError(
            f"equation {tag[1]} has {unread}, which latex2mathml cannot read"
        )
    return f'<div class="equation" id="eq-{tag[1].lower()}">{mathml}<span>({tag[1]})</span></div>'


def _path(page: str, target: str) -> str | None:
    """Path from the repository's root that a page's link leads to.

    None where it leaves the repository.
    """
    if "://" in target or target.startswith(("mailto:", "/")):
        return None
    folder = (
        "" if page in ROOT_PAGES else posixpath.join("docs", posixpath.dirname(page))
    )
    return posixpath.normpath(posixpath.join(folder, target))


def _site_path(path: str) -> str | None:
    """Path on the site of a file of the repository, None where there is no such file."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if path.lower() in ROOT_PAGES:
        return path.lower()
    return f"{SOURCE}/{path}.txt" if (ROOT / path).is_file() else None
