"""The page of all reports: a story in figures, each with what it found in a sentence; then the
other reports, smaller."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape, unescape
from importlib.resources import files
from pathlib import Path

from PIL import Image

from kop_exudyn.errors import InputError
from kop_exudyn.files.files import write_text
from kop_exudyn.files.json_files import read_json

_SIZE = (1080, 720)  # pixels of a picture at most: drawn half as large, sharp on fine screens
_IMAGE = re.compile(r'<img src="data:image/(png|svg\+xml);base64,([^"]+)"')
_LARGEST_SVG = 400_000  # characters; larger drawings would make the index heavy
_SENTENCE = re.compile(r"(?<=[a-z0-9%)°])\.\s+(?=[A-Z])")  # the end of one
_OLD = (
    "<h2>Of earlier versions</h2>\n<p>These reports were made by earlier versions of the program, "
    "on earlier models. Their figures don't hold for the present ones.</p>"
)
_STYLE = """.story, .reports { display: grid; padding: 0; margin: 1.6rem 0; gap: 1.5rem; }
.story { grid-template-columns: repeat(auto-fill, minmax(min(100%, 27rem), 1fr)); }
.reports { grid-template-columns: repeat(auto-fill, minmax(17rem, 1fr)); }
.index li { list-style: none; border: 1px solid var(--line); border-radius: 6px;
  overflow: hidden; }
.story li.first { grid-column: 1 / -1; }
.index a { color: inherit; text-decoration: none; display: block; height: 100%; }
.index a:hover h3, .index a:focus h3 { text-decoration: underline; }
.index .picture { display: flex; align-items: center; justify-content: center; background: #fff;
  border-bottom: 1px solid var(--line); height: 19rem; }
.reports .picture { height: 11rem; } .story .first .picture { height: auto; }
.index img { max-width: 97%; max-height: 18.2rem; } .reports img { max-height: 10.4rem; }
.story .first img { max-width: 100%; max-height: 34rem; }
.index h3 { font-size: 1.1rem; margin: .8rem 1rem .2rem; } .reports h3 { font-size: .98rem; }
.index p { font-size: .92rem; margin: 0 1rem 1rem; }
.index p.made { font-size: .78rem; opacity: .75; margin-top: -.6rem; }
@media (max-width: 720px) { .index .picture { height: auto; padding: .4rem; } }
"""


@dataclass(frozen=True)
class Chapter:
    """A figure of the story.

    name : folder of the report; headline : what a reader gains by it
    picture : number of the image on the report's page, from 0; None: picture.png or the first one
    """

    name: str
    headline: str
    picture: int | None = None


@dataclass(frozen=True)
class Entry:
    """One report.

    name : of its folder; title, finding : plain text; picture : a data URI, or None
    made : when and by which commit, empty where the report doesn't say: those are of times before
        reports did
    """

    name: str
    title: str
    finding: str
    picture: str | None
    made: str = ""


def write_index(folder: str | Path, title: str, lead: str, story: Sequence[Chapter] = ()) -> Path:
    """Write index.html over all folders of reports in a folder, those with an index.html of their
    own.

    story : the figures that the page leads with, in their order, as far as there are such reports;
        the other reports follow; those that don't say which commit made them come last, under a
        heading that says so

    Titles and pictures are taken from each report's page, findings from its data.json, or else from
    the page's lead. Raises InputError when there is no report, or the page can't be written.
    """
    folder = Path(folder)
    pages = {page.parent.name: page.parent for page in sorted(folder.glob("*/index.html"))}
    if not pages:
        raise InputError("holds no reports", source=folder)
    told = [
        replace(entry, title=one.headline)
        for one in story
        if one.name in pages and (entry := entry_of(pages[one.name], one.picture)).made
    ]
    rest = [entry_of(path) for name, path in pages.items() if name not in {e.name for e in told}]
    others, old = [e for e in rest if e.made], [e for e in rest if not e.made]
    return write_text(folder / "index.html", _html(told, others, old, title, lead), overwrite=True)


def entry_of(folder: Path, picture: int | None = None) -> Entry:
    """The entry of one report's folder.

    picture : number of the image on its page; None: picture.png, or the first one
    """
    page = (folder / "index.html").read_text(encoding="utf-8")
    data = folder / "data.json"
    finding = read_json(data).get("finding") if data.exists() else None
    return Entry(
        folder.name,
        _text(page, "h1") or folder.name,
        first_sentence(finding or _text(page, "p") or ""),
        _picture(folder, page, picture),
        _made(folder),
    )


def _made(folder: Path) -> str:
    """When a report was made and by which commit, from its data; empty where they don't say."""
    for name in ("data.json", "result.json"):
        if (folder / name).exists():
            made = read_json(folder / name).get("environment") or {}
            if made.get("commit"):
                return f"{made.get('date', '')}, commit {made['commit']}"
    return ""


def first_sentence(text: str) -> str:
    """The first sentence of a text, with its full stop."""
    first = _SENTENCE.split(text.strip(), maxsplit=1)[0].rstrip(".")
    return f"{first}." if first else ""


def _text(page: str, tag: str) -> str | None:
    found = re.search(rf"<{tag}[^>]*>(.*?)</{tag}>", page, re.DOTALL)
    return unescape(re.sub(r"<[^>]+>", "", found.group(1))).strip() if found else None


def _picture(folder: Path, page: str, number: int | None) -> str | None:
    """An image of the page, or picture.png beside it; the next one where a drawing is too heavy."""
    if number is None and (folder / "picture.png").exists():
        return _thumbnail((folder / "picture.png").read_bytes())
    images = _IMAGE.findall(page)
    for kind, content in images[number or 0 :]:
        if kind == "png":
            return _thumbnail(base64.b64decode(content))
        if len(content) <= _LARGEST_SVG:
            return f"data:image/svg+xml;base64,{content}"
    return None


def _thumbnail(content: bytes) -> str:
    with Image.open(io.BytesIO(content)) as image:
        small = image.convert("RGB")
        small.thumbnail(_SIZE, Image.Resampling.LANCZOS)
        buffer = io.BytesIO()
        small.quantize(128).save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _html(told: list[Entry], others: list[Entry], old: list[Entry], title: str, lead: str) -> str:
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
            *_list("story", told),
            *(["<h2>More of what was tried</h2>"] if told and others else []),
            *_list("reports", others),
            *([_OLD] if old else []),
            *_list("reports", old),
            "</body>",
            "</html>",
            "",
        ]
    )


def _list(kind: str, entries: list[Entry]) -> list[str]:
    if not entries:
        return []
    return [f'<ul class="index {kind}">', *map(_item, entries, range(len(entries))), "</ul>"]


def _item(entry: Entry, number: int) -> str:
    image = f'<img src="{entry.picture}" alt="">' if entry.picture else ""
    return (
        f'<li{"" if number else " class=first"}><a href="{escape(entry.name)}/index.html">'
        f'<div class="picture">{image}</div>'
        f"<h3>{escape(entry.title)}</h3><p>{escape(entry.finding)}</p>"
        f'<p class="made">{escape(entry.made)}</p></a></li>'
    )
