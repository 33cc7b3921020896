"""HTML pages of reports: one look, no script, no font, nothing fetched but the files beside the page.

Texts are escaped here and nowhere else; :class:`Html` marks what is HTML already.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

STYLE = """
:root { color-scheme: light dark; --ink: #1b1b1b; --paper: #fff; --line: #c8c8c8; --soft: #f3f3f3;
  --good: #0b5a2a; --bad: #a1161b; --open: #6b4a00; --link: #0b4f9e; }
@media (prefers-color-scheme: dark) { :root { --ink: #ececec; --paper: #161616; --line: #555; --soft: #242424;
  --good: #7fd79c; --bad: #ff9b97; --open: #f0c869; --link: #8ec2ff; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 72rem;
  margin: 0 auto; padding: 1rem; }
a { color: var(--link); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .875rem; margin: .5rem 0 1rem;
  font-variant-numeric: tabular-nums; }
table.wide { width: 100%; }
th, td { border: 1px solid var(--line); padding: .3rem .5rem; text-align: left; vertical-align: top; }
table.numbers td { text-align: right; }
th { background: var(--soft); }
code, pre { font: 13px/1.4 ui-monospace, monospace; }
pre { background: var(--soft); padding: .5rem; overflow-x: auto; }
img, svg, video { max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line); }
.strong { font-weight: 700; white-space: nowrap; }
.good { color: var(--good); } .bad { color: var(--bad); } .open { color: var(--open); }
"""


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def html(value: Any) -> Html:
    """Return a value as HTML: escaped, unless it is HTML already.

    Examples
    --------
    >>> html("a < b"), html(Html("<b>a</b>"))
    ('a &lt; b', '<b>a</b>')
    """
    return value if isinstance(value, Html) else Html(escape(str(value)))


def tag(name: str, *content: Any, **attributes: Any) -> Html:
    """Return an element; ``class_`` stands for ``class``, and attributes that are None are left out.

    Examples
    --------
    >>> tag("p", "a & ", tag("b", "c"), class_="good")
    '<p class="good">a &amp; <b>c</b></p>'
    """
    words = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Html(f"<{name}{words}>{''.join(html(part) for part in content)}</{name}>")


def image(address: str, alt: str) -> Html:
    """Return a paragraph with a picture."""
    return Html(f'<p><img src="{escape(address)}" alt="{escape(alt)}"></p>')


def links(addresses: Mapping[str, str], between: str = " · ") -> Html:
    """Return links, by their words."""
    return Html(between.join(tag("a", words, href=address) for words, address in addresses.items()))


def details(summary: Any, *content: Any) -> Html:
    """Return content that is folded under a line."""
    return tag("details", tag("summary", summary), *content)


def table(
    heads: Sequence[Any], rows: Iterable[Sequence[Any]], *, caption: str = "", kind: str = "wide"
) -> Html:
    """Return a table in a box that scrolls sideways.

    Parameters
    ----------
    heads : sequence
        May be empty.
    rows : iterable of sequences
        Texts are escaped.  The first cell of a row is its head where ``kind`` is ``"numbers"``.
    caption : str
    kind : {"wide", "numbers", "plain"}
        Full width; numbers to the right; neither.
    """
    head = tag("thead", tag("tr", *(tag("th", h, scope="col") for h in heads))) if heads else ""
    body = [_row(row, kind == "numbers") for row in rows]
    parts = [tag("caption", caption) if caption else "", head, tag("tbody", Html("\n".join(body)))]
    return tag(
        "div", tag("table", *parts, class_=kind),
        class_="scroll", tabindex="0", role="region", aria_label=caption or "table",
    )  # fmt: skip


def _row(cells: Sequence[Any], has_head: bool) -> Html:
    first = [tag("th", cells[0], scope="row")] if has_head else []
    return tag("tr", *first, *(tag("td", cell) for cell in cells[len(first) :]))


def page(title: str, *body: Any, heading: Any = None) -> str:
    """Return a whole page.

    Parameters
    ----------
    title : str
    body : sequence
        Its parts, one after the other.
    heading : Html, optional
        In place of the title at the top of the page.
    """
    content = "\n".join(html(part) for part in body if part)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{tag('h1', heading or title)}\n{content}\n</main>\n</body>\n</html>\n"
    )


def shown(value: Any) -> str:
    """Write a value for a reader: four significant digits, lists in brackets, a dash for nothing.

    Examples
    --------
    >>> shown(3.14159), shown([1, 0.5]), shown(None)
    ('3.142', '[1, 0.5]', '–')
    """
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(shown(v) for v in value) + "]"
    return str(value)
