"""Every link of the documentation leads somewhere: files and headings of the checkout, pages and marks of the built
site; addresses outside are of their form, since no test calls the network."""

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from lxml import html

from tests.assets import ROOT

WORKFLOWS = "../../actions/"
"""Where GitHub shows a checkout's workflows, as seen from its README."""
OUTSIDE = ("https", "http", "mailto")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)[^)]*\)")
CODE = re.compile(r"^( *)```.*?^\1```|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def pages() -> list[Path]:
    """Every tracked page of the checkout."""
    words = ["git", "ls-files", "-co", "--exclude-standard", "*.md"]
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in listed.splitlines() if (ROOT / name).is_file()]


def links(page: Path) -> list[str]:
    """Addresses of a page's links and pictures; code is none."""
    return LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))


def mark(heading: str) -> str:
    """The anchor of a heading, as GitHub and the site name it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def marks(page: Path) -> set[str]:
    """The anchors of a page's headings."""
    return set(map(mark, re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)))


def broken(page: Path, link: str) -> str:
    """The fault of a page's link; empty without one."""
    parts = urlsplit(link)
    if parts.scheme:
        named = parts.scheme in OUTSIDE and (parts.scheme == "mailto" or re.fullmatch(r"[\w.-]+(:\d+)?", parts.netloc))
        return "" if named else f"{link}: no address"
    if link.startswith(WORKFLOWS):
        return "" if (ROOT / ".github" / link.removeprefix(WORKFLOWS).removesuffix("/badge.svg")).is_file() else link
    target = (page.parent / unquote(parts.path)) if parts.path else page
    if not target.exists():
        return f"{link}: no such file"
    if parts.fragment and parts.fragment not in marks(target):
        return f"{link}: no such heading"
    return ""


def unresolved(site: Path) -> Iterator[str]:
    """Links and pictures of a built site that lead to no file of it, or to no mark in it."""
    trees = {path: html.parse(str(path)).getroot() for path in site.rglob("*.html")}
    ids = {path: {*tree.xpath("//@id"), *tree.xpath("//a/@name")} for path, tree in trees.items()}
    for path, tree in trees.items():
        for link in {*tree.xpath("//a/@href"), *tree.xpath("//img/@src"), *tree.xpath("//link/@href")}:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                yield f"{path.relative_to(site)}: {link}: no such file"
            elif parts.fragment and target in ids and unquote(parts.fragment) not in ids[target]:
                yield f"{path.relative_to(site)}: {link}: no such mark"


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    assert [said for link in links(page) if (said := broken(page, link))] == []


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A heading, of two\n[a](other.md) [b](#a-heading-of-two) [c](#no) [d](https://) `[e](no)`\n")
    assert [bool(broken(page, link)) for link in links(page)] == [True, False, True, True]
    (tmp_path / "a.html").write_text("<p id='x'><a href='#x'/><a href='#y'/><a href='b.html'/><img src='c'></p>")
    assert len(list(unresolved(tmp_path))) == 3
