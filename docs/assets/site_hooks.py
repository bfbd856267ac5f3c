"""What ``mkdocs build`` does beside its plugins: equations as MathML, and links to files that lie outside ``docs``.

Pages are written for two readers, a code forge and the site. So equations are fenced blocks of ``math`` with a
``\\tag``, and links go to files of the repository; here both become something that works without a network.
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
from pymdownx.slugs import slugify

ROOT = Path(__file__).resolve().parents[2]
AT_ROOT = ("CHANGELOG.md", "CONTRIBUTING.md")  # pages of the site that lie beside README.md
SOURCE = "source"  # folder of the site for linked files that are no pages
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
TAG = re.compile(r"\\tag\{([^}]*)\}")


def on_config(config: Any) -> Any:
    """Set what YAML cannot say plainly: formatter of equations, anchors as code forges make them, README's pages."""
    config.mdx_configs["pymdownx.superfences"] = {
        "custom_fences": [{"name": "math", "class": "equation", "format": equation}]
    }
    beside = [name.lower() for name in AT_ROOT if (ROOT / name).is_file()]
    config.nav = [*config.nav, {"Project": beside}] if beside else config.nav
    config.mdx_configs["toc"] = {**config.mdx_configs.get("toc", {}), "slugify": slugify(case="lower")}
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages beside README.md, and every file outside ``docs`` that a page links to."""
    for name in AT_ROOT:
        if (ROOT / name).is_file():
            files.append(File.generated(config, name.lower(), content=(ROOT / name).read_text("utf-8")))
    linked = set()
    for page in files.documentation_pages():
        for _, target, _ in LINK.findall(page.content_string):
            if (path := _outside(page.src_uri, target)) and (ROOT / path).is_file():
                linked.add(path)
    for path in sorted(linked):
        files.append(File.generated(config, f"{SOURCE}/{path}.txt", content=(ROOT / path).read_text("utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Point links that leave ``docs`` to what the site has of them."""

    def renewed(found: re.Match[str]) -> str:
        text, target, anchor = found.groups(default="")
        here = page.file.src_uri
        if here.upper().startswith(AT_ROOT):
            place = target.removeprefix("docs/") if target.startswith("docs/") else None
            return f"[{text}]({place}{anchor})" if place else (found[0] if "://" in target else text)
        if (path := _outside(here, target)) is None:
            return found[0]
        if not (ROOT / path).is_file():
            return f"{text} (`{path}`)" if path not in text else text
        if path in AT_ROOT:
            return f"[{text}]({_relative(here, path.lower())}{anchor})"
        return f"[{text}]({_relative(here, f'{SOURCE}/{path}.txt')})"

    return LINK.sub(renewed, markdown)


def equation(source: str, *_: Any, **__: Any) -> str:
    """One numbered equation as MathML, which browsers draw without a script."""
    tag = TAG.search(source)
    if tag is None:
        raise PluginError(f"an equation has no \\tag: {source}")
    mathml = convert(TAG.sub("", source).strip(), display="block")
    unread = [part.text for part in ElementTree.fromstring(mathml).iter() if (part.text or "")[:1] in ("\\", "&")]
    if unread:
        raise PluginError(f"equation {tag[1]} has {unread}, which latex2mathml cannot read")
    return f'<div class="equation" id="eq-{tag[1].lower()}">{mathml}<span>({tag[1]})</span></div>'


def _outside(page: str, target: str) -> str | None:
    """Path from the repository's root, where a link leaves ``docs``."""
    if "://" in target or target.startswith(("mailto:", "/")):
        return None
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    return None if path.startswith("docs/") else path


def _relative(page: str, target: str) -> str:
    return posixpath.relpath(target, posixpath.dirname(page) or ".")
