"""One self-contained HTML page: text, tables and figures in one file that needs no network and no
script."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ..drawing.style import figure_bytes
from ..files.files import write_text
from ..files.json_files import to_json
from ..units import plain_number
from ..wording import beside_units

_MEDIA = {"svg": "image/svg+xml", "png": "image/png"}


@dataclass(frozen=True)
class Drawing:
    """A small drawing in a table.

    svg : its file's text; width : pixels; alt : for readers who can't see it
    """

    svg: str
    width: float
    alt: str


@dataclass(frozen=True)
class Card:
    """A picture with what there is to say of it.

    title : of the card; badge : the shortest judgement
    good : whether that is good news, None for neither
    lines : (name, value, whether the value is bad)
    picture : bytes of a PNG file, or None; alt : for readers who can't see it
    """

    title: str
    badge: str
    good: bool | None
    lines: Sequence[tuple[str, str, bool]]
    picture: bytes | None = None
    alt: str = ""


class Page:
    """A page that is filled from top to bottom. Texts are plain; whatever they contain is shown as
    it is.

    title : heading of the page
    lead : its first sentences
    """

    def __init__(self, title: str, lead: str = ""):
        self.title = title
        self._body = [f"<h1>{_text(title)}</h1>"]
        if lead:
            self._body.append(f'<p class="lead">{_text(lead)}</p>')
        self._footer = ""

    def section(self, heading: str, text: str = "") -> Page:
        """A new section; empty lines in the text start a new paragraph."""
        self._body.append(f"<h2>{_text(heading)}</h2>")
        return self.text(text)

    def text(self, text: str) -> Page:
        """Paragraphs."""
        self._body += [
            f"<p>{_text(part.strip())}</p>" for part in text.split("\n\n") if part.strip()
        ]
        return self

    def links(self, files: Mapping[str, str]) -> Page:
        """A line of links to files beside the page: text -> path, relative to the page's folder."""
        shown = (f'<a href="{escape(path)}">{_text(text)}</a>' for text, path in files.items())
        self._body.append(f'<p class="links">{" · ".join(shown)}</p>')
        return self

    def table(
        self, headings: Sequence[str], rows: Sequence[Sequence[Any]], caption: str = ""
    ) -> Page:
        """A table; numbers stand right and are shown with four digits, None as a dash."""
        numeric = [any(_is_number(row[k]) for row in rows) for k in range(len(headings))]
        head = "".join(_cell("th", heading, right) for heading, right in zip(headings, numeric))
        body = "".join(
            "<tr>"
            + "".join(
                _cell("td", shown(value), right and not isinstance(value, str))
                for value, right in zip(row, numeric)
            )
            + "</tr>"
            for row in rows
        )
        note = f"<caption><span>{_text(caption)}</span></caption>" if caption else ""
        self._body.append(
            f'<div class="scroll"><table>{note}<thead><tr>{head}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>"
        )
        return self

    def cards(self, cards: Sequence[Card]) -> Page:
        """Pictures side by side, each with a title, a badge and short lines under it."""
        self._body.append(f'<div class="cards">{"".join(map(_card, cards))}</div>')
        return self

    def drawings(
        self,
        headings: Sequence[str],
        rows: Sequence[Sequence[Any]],
        caption: str = "",
        folded: str = "",
    ) -> Page:
        """A table of which some values are drawings, see `Drawing`; the others as in `table`.

        folded : a line of text that the table is folded away under; "" for one that is open
        """
        head = "".join(_cell("th", heading, False) for heading in headings)
        body = "".join(f"<tr>{''.join(map(_drawn_cell, row))}</tr>" for row in rows)
        note = f"<caption><span>{_text(caption)}</span></caption>" if caption else ""
        table = (
            f'<div class="scroll"><table class="drawings">{note}<thead><tr>{head}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>"
        )
        if folded:
            table = f"<details><summary>{_text(folded)}</summary>{table}</details>"
        self._body.append(table)
        return self

    def figure(
        self, figure: Figure | bytes, caption: str, *, alt: str, suffix: str = "svg"
    ) -> Page:
        """A figure (or the bytes of its file), with a text for readers who can't see it."""
        content = figure if isinstance(figure, bytes) else figure_bytes(figure, suffix)
        data = base64.b64encode(content).decode("ascii")
        self._body.append(
            f'<figure><img src="data:{_MEDIA[suffix]};base64,{data}" alt="{_text(alt)}">'
            f"<figcaption>{_text(caption)}</figcaption></figure>"
        )
        return self

    def details(self, summary: str, data: Any) -> Page:
        """Plain data, such as settings, folded away under a line of text."""
        self._body.append(
            f"<details><summary>{_text(summary)}</summary><pre>{escape(to_json(data))}</pre></details>"
        )
        return self

    def footer(self, text: str) -> Page:
        """The page's last line."""
        self._footer = f"<footer>{_text(text)}</footer>"
        return self

    def html(self) -> str:
        """The page. Its policy forbids the browser to load anything from elsewhere."""
        css = (files(__package__) / "page.css").read_text(encoding="utf-8")
        policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
        return "\n".join(
            [
                "<!doctype html>",
                '<html lang="en">',
                "<head>",
                '<meta charset="utf-8">',
                f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                f"<title>{_text(self.title)}</title>",
                f"<style>\n{css}</style>",
                "</head>",
                "<body>",
                *self._body,
                self._footer,
                "</body>",
                "</html>",
                "",
            ]
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page. InputError when the file exists already or can't be written."""
        return write_text(path, self.html(), overwrite=overwrite)


def _text(text: str) -> str:
    """Plain text as HTML has it; numbers stay beside their units."""
    return escape(beside_units(text))


def shown(value: Any) -> str:
    """A table's value as text."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Integral):
        return f"{value:,}"
    return plain_number(float(value)) if isinstance(value, Real) else str(value)


def _card(card: Card) -> str:
    kind = {True: "good", False: "bad", None: ""}[card.good]
    image = '<div class="missing">no equilibrium</div>'
    if card.picture is not None:
        data = base64.b64encode(card.picture).decode("ascii")
        image = f'<img src="data:image/png;base64,{data}" alt="{_text(card.alt)}">'
    lines = "".join(
        f"<dt>{_text(name)}</dt>{'<dd class=bad>' if bad else '<dd>'}{_text(value)}</dd>"
        for name, value, bad in card.lines
    )
    return (
        f'<article><div class="card">{image}<div class="text"><h3>{_text(card.title)} '
        f'<span class="badge {kind}">{_text(card.badge)}</span></h3><dl>{lines}</dl>'
        "</div></div></article>"
    )


def _drawn_cell(value: Any) -> str:
    if isinstance(value, Drawing):
        data = base64.b64encode(value.svg.encode()).decode("ascii")
        return (
            f'<td class="drawing"><img src="data:image/svg+xml;base64,{data}" '
            f'width="{value.width:.0f}" alt="{_text(value.alt)}"></td>'
        )
    return _cell("td", shown(value), _is_number(value))


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _cell(tag: str, text: str, right: bool) -> str:
    kind = ' class="number"' if right else ""
    return f"<{tag}{kind}>{_text(text)}</{tag}>"
