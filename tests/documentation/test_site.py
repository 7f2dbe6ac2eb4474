"""The documentation builds into a site without warnings, which needs no network and whose links lead somewhere."""

import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from pydrake.systems.framework import Diagram, LeafSystem

from tests.documentation.hooks import mathml, module_pages
from tests.port_blocks import port_block, system_classes
from tests.source_tree import ROOT, module_name, package_modules

FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src", "object": "data"}
"""Tag -> attribute whose target a browser fetches by itself."""
NO_NETWORK = "http://127.0.0.1:9"
"""A proxy that is not there."""

pytestmark = pytest.mark.slow


class Page(HTMLParser):
    """What of one page matters here."""

    def __init__(self, path: Path):
        super().__init__()
        self.anchors, self.links, self.fetched = set(), [], []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.anchors |= {attributes[name] for name in ("id", "name") if attributes.get(name)}
        if tag == "a" and attributes.get("href"):
            self.links.append(attributes["href"])
        if attributes.get(FETCHED.get(tag)) and attributes.get("rel") != "canonical":
            self.fetched.append(attributes[FETCHED[tag]])


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of the site."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = os.environ | dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"), NO_NETWORK)
    environment["NO_MKDOCS_2_WARNING"] = "1"  # an announcement of the theme's authors
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr, done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site):
    """All pages, by path."""
    return {path.relative_to(site).as_posix(): Page(path) for path in sorted(site.rglob("*.html"))}


def test_links_lead_somewhere(site, pages):
    broken = []
    for name, page in pages.items():
        for link in [*page.links, *page.fetched] if name != "404.html" else ():
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (site / name).parent / unquote(parts.path) if parts.path else site / name
            target = Path(os.path.normpath(target / "index.html" if target.is_dir() else target))
            if not target.is_file():
                broken.append(f"{name}: {link}")
            elif parts.fragment and target.suffix == ".html":
                anchors = pages[target.relative_to(site).as_posix()].anchors
                broken += [] if unquote(parts.fragment) in anchors | {"__top"} else [f"{name}: {link}"]
    assert not broken, "\n".join(broken[:50])


def test_nothing_is_fetched_from_elsewhere(pages):
    assert len(pages) > 60
    elsewhere = {f"{name}: {link}" for name, page in pages.items() for link in page.fetched if urlsplit(link).netloc}
    assert not elsewhere


def test_every_page_of_the_documentation_is_there(pages):
    expected = {path.with_suffix(".html").name for path in (ROOT / "docs").glob("*.md")} - {"README.html"}
    assert expected | {"index.html"} <= set(pages)


def test_every_module_is_described(pages):
    described = set().union(*(page.anchors for name, page in pages.items() if name.startswith("modules/")))
    silent = [name for name in (module.__name__ for module in package_modules()) if name not in described]
    packages = {module_name(path) for path in ROOT.rglob("__init__.py")}
    assert not set(silent) - packages
    assert {f"modules/{name}.html" for name in module_pages()} <= set(pages)


def test_every_system_is_described_with_its_ports(site):
    text = {path.stem: path.read_text(encoding="utf-8") for path in (site / "modules").glob("*.html")}
    for cls in [*system_classes(Diagram), *system_classes(LeafSystem)]:
        page = text[cls.__module__.removeprefix("quadpips_drake.").rpartition(".")[0]]
        assert f'id="{cls.__module__}.{cls.__name__}"' in page
        block = port_block(cls)
        for port in (*block.inputs, *block.outputs):
            name = port.name.replace("<", "&lt;").replace(">", "&gt;")
            assert f"<code>{name}</code>" in page, f"{cls.__name__}: {port.name}"
    assert not any("pydrake_system::" in page for page in text.values())


def test_formulas_are_drawn_by_the_browser(site):
    page = (site / "planning.html").read_text(encoding="utf-8")
    assert page.count("<math") > 20
    assert "arithmatex" not in page and r"\frac" not in page
    assert "<mfrac>" in mathml(r"\frac{a}{b}", True)
