"""What the site does to its pages: equations become MathML, notebooks pages, and links out of docs/ are led on."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

DOCS = Path(__file__).resolve().parents[1]
OUTSIDE = re.compile(r"\]\(((?:\.\./)+[^)\s#]+)(#[^)\s]*)?\)")
EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, *, config: Any) -> Files:
    """Make a page of each notebook, with the outputs that it has."""
    for name in [each.src_uri for each in files if each.src_uri.endswith(".ipynb")]:
        book = json.loads((DOCS / name).read_text(encoding="utf-8"))
        text = f"[Download it]({Path(name).name}){{ download }}\n\n" + "\n\n".join(map(_cell, book["cells"]))
        title, _, rest = text.partition("\n\n")
        heading, _, rest = rest.partition("\n\n")
        files.append(File.generated(config, name.replace(".ipynb", ".md"), content=f"{heading}\n\n{title}\n\n{rest}"))
    return files


def _cell(cell: dict[str, Any]) -> str:
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        return source
    return "\n\n".join([f"```python\n{source}\n```", *map(_output, cell["outputs"])])


def _output(output: dict[str, Any]) -> str:
    shown = output.get("data", {})
    if "image/png" in shown:
        return f'<img src="data:image/png;base64,{shown["image/png"].strip()}" alt="what this draws">'
    if "text/html" in shown:
        table = "".join(shown["text/html"])
        bare = re.sub(r"<style.*?</style>", "", table, flags=re.DOTALL).replace("\n", "")
        return bare.replace(' border="1" class="dataframe"', "")  # so that it looks as all tables do
    text = "".join(output.get("text") or shown.get("text/plain", ""))
    return f"```text\n{text.rstrip()}\n```"


def on_page_markdown(markdown: str, *, page: Any, config: Any, **_: Any) -> str:
    """Lead links that leave docs/ to the repository; one that leads nowhere is left, which ends a strict build."""
    folder = (DOCS / page.file.src_uri).parent

    def outside(link: re.Match[str]) -> str:
        path = (folder / link[1]).resolve()
        if DOCS in path.parents or not path.exists():
            return link[0]
        return f"]({config.extra['repository']}/blob/main/{path.relative_to(DOCS.parent).as_posix()}{link[2] or ''})"

    return OUTSIDE.sub(outside, markdown)


def on_page_content(content: str, **_: Any) -> str:
    """Draw equations as MathML, which browsers read without a script."""
    return EQUATION.sub(
        lambda found: convert(html.unescape(found[3]), display="inline" if found[2] == "(" else "block"), content
    )
