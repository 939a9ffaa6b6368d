"""The page of all reports: what each found in a sentence or two, with a small picture."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import dataclass
from html import escape, unescape
from importlib.resources import files
from pathlib import Path

from PIL import Image

from kop_exudyn.errors import InputError
from kop_exudyn.files.files import write_text
from kop_exudyn.files.json_files import read_json

_SIZE = (560, 340)  # pixels of a thumbnail at most
_PNG = re.compile(r'<img src="data:image/png;base64,([^"]+)"')
_SVG = re.compile(r'<img src="(data:image/svg\+xml;base64,[^"]+)"')
_LARGEST_SVG = 400_000  # characters; larger drawings would make the index heavy
_STYLE = """ .reports { display: grid; grid-template-columns: repeat(auto-fill, minmax(17rem, 1fr));
gap: 1.6rem; padding: 0; } .reports li { list-style: none; border: 1px solid #dcdcdc; border-radius:
6px; overflow: hidden; } .reports a { color: inherit; text-decoration: none; display: block; height:
100%; } .reports a:hover h2, .reports a:focus h2 { text-decoration: underline; } .reports .picture {
height: 12rem; display: flex; align-items: center; justify-content: center; background: #fff;
border-bottom: 1px solid #ececec; }
.reports img { max-width: 94%; max-height: 11.2rem; margin: 0; }
.reports h2 { font-size: 1.02rem; margin: 0.9rem 1rem 0.3rem; border: 0; padding: 0; }
.reports p { font-size: 0.88rem; margin: 0 1rem 1rem; }
"""


@dataclass(frozen=True)
class Entry:
    """One report.

    name : of its folder; title, finding : plain text; picture : a data URI, or None
    """

    name: str
    title: str
    finding: str
    picture: str | None


def write_index(folder: str | Path, title: str, lead: str) -> Path:
    """Write index.html over all folders of reports in a folder, those with an index.html of their
    own.

    Title and picture are taken from each report's page, the finding from its data.json, or else
    from the page's lead. Raises InputError when there is no report, or the page can't be written.
    """
    folder = Path(folder)
    entries = [entry_of(page.parent) for page in sorted(folder.glob("*/index.html"))]
    if not entries:
        raise InputError("holds no reports", source=folder)
    return write_text(folder / "index.html", _html(entries, title, lead), overwrite=True)


def entry_of(folder: Path) -> Entry:
    """The entry of one report's folder."""
    page = (folder / "index.html").read_text(encoding="utf-8")
    data = folder / "data.json"
    finding = read_json(data).get("finding") if data.exists() else None
    return Entry(
        folder.name,
        _text(page, "h1") or folder.name,
        finding or _text(page, "p") or "",
        _picture(folder, page),
    )


def _text(page: str, tag: str) -> str | None:
    found = re.search(rf"<{tag}[^>]*>(.*?)</{tag}>", page, re.DOTALL)
    return unescape(re.sub(r"<[^>]+>", "", found.group(1))).strip() if found else None


def _picture(folder: Path, page: str) -> str | None:
    """picture.png beside the page, or the page's first figure."""
    png, svg = _PNG.search(page), _SVG.search(page)
    if (folder / "picture.png").exists():
        return _thumbnail((folder / "picture.png").read_bytes())
    if png:
        return _thumbnail(base64.b64decode(png.group(1)))
    return svg.group(1) if svg and len(svg.group(1)) <= _LARGEST_SVG else None


def _thumbnail(content: bytes) -> str:
    with Image.open(io.BytesIO(content)) as image:
        small = image.convert("RGB")
        small.thumbnail(_SIZE, Image.Resampling.LANCZOS)
        buffer = io.BytesIO()
        small.quantize(96).save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _html(entries: list[Entry], title: str, lead: str) -> str:
    css = (files("kop_exudyn.report") / "page.css").read_text(encoding="utf-8")
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(title)}</title>",
            f"<style>\n{css}{_STYLE}</style>",
            "</head>",
            "<body>",
            f"<h1>{escape(title)}</h1>",
            f'<p class="lead">{escape(lead)}</p>',
            '<ul class="reports">',
            *map(_item, entries),
            "</ul>",
            "</body>",
            "</html>",
            "",
        ]
    )


def _item(entry: Entry) -> str:
    image = f'<img src="{entry.picture}" alt="">' if entry.picture else ""
    return (
        f'<li><a href="{escape(entry.name)}/index.html"><div class="picture">{image}</div>'
        f"<h2>{escape(entry.title)}</h2><p>{escape(entry.finding)}</p></a></li>"
    )
