"""What MkDocs is told by code: pages about all modules, files outside docs/ that pages link to, formulas as MathML."""

import html
import re
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "quadpips_drake"
OUTSIDE = "sources"
"""Folder of the site for files that lie elsewhere in the repository."""
_LINK_OUTSIDE = re.compile(r"\]\(\.\./([^)#]+)")
_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_config(config):
    """Adds the pages about the modules to the navigation."""
    (reference,) = (entry["Reference"] for entry in config.nav if "Reference" in entry)
    reference.append({"Modules": [{name: f"modules/{name}.md"} for name in module_pages()]})
    return config


def on_files(files, config):
    """Adds the pages about the modules, and what is linked to outside docs/."""
    for name, text in module_pages().items():
        files.append(File.generated(config, f"modules/{name}.md", content=text))
    pages = Path(config.docs_dir).glob("*.md")
    outside = {path for page in pages for path in _LINK_OUTSIDE.findall(page.read_text(encoding="utf-8"))}
    for path in sorted(outside):
        files.append(File.generated(config, f"{OUTSIDE}/{path}", abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown, **_):
    """Links to files outside docs/ lead to their copies."""
    return _LINK_OUTSIDE.sub(rf"]({OUTSIDE}/\1", markdown)


def on_page_content(content, **_):
    """Formulas become MathML, which browsers draw by themselves."""
    return _FORMULA.sub(lambda found: mathml(html.unescape(found.group(2)), found.group(1) == "div"), content)


def mathml(formula: str, is_block: bool) -> str:
    """The formula, in LaTeX, as MathML."""
    return convert(formula.strip(), display="block" if is_block else "inline")


def module_pages() -> dict[str, str]:
    """Folder of the package ("planning.torso", PACKAGE itself) -> Markdown that asks mkdocstrings for its modules."""
    folders = [ROOT / PACKAGE, ROOT / "diagrams"]
    packages = sorted({path.parent for folder in folders for path in folder.rglob("__init__.py")})
    pages = {}
    for folder in packages:
        modules = sorted(path.stem for path in folder.glob("*.py") if path.stem not in ("__init__", "__main__"))
        name = ".".join(folder.relative_to(ROOT).parts)
        name = name if name.startswith(PACKAGE) else f"{PACKAGE}.{name}"
        if modules:
            entries = "\n\n".join(f"::: {name}.{module}" for module in modules)
            pages[name.removeprefix(f"{PACKAGE}.")] = f"# {name}\n\n{entries}\n"
    return pages
