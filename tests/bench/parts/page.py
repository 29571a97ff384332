"""Pages of benchmarks in the look of the product's own: assets/pages/head.html and its style sheet.

Light and dark, one file, without scripts or network; plots as nodes/pages/drawing.cpp has them.
"""
import html
import math
from pathlib import Path

PAGES = Path(__file__).resolve().parents[3] / "assets/pages"
LEFT, RIGHT, TOP, BELOW, LETTERS = 64, 14, 8, 26, 12
WIDE, HALF = 960, 540  # px; of a plot alone, of one of two side by side


def text(words):
    return html.escape(str(words))


def page(title, under, parts):
    """The whole page."""
    head = (PAGES / "head.html").read_text().replace("{{page_title}}", text(title))
    head = head.replace("{{> style.css}}", (PAGES / "style.css").read_text())
    header = f'<header><h1>{text(title)}</h1><p class="under">{text(under)}</p></header>\n'
    return head + header + "\n".join(parts) + "\n" + (PAGES / "foot.html").read_text()


def heading(words):
    return f"<h2>{text(words)}</h2>"


def paragraph(words, look=""):
    return f'<p class="{look}">{text(words)}</p>' if look else f"<p>{text(words)}</p>"


def facts(items):
    """[(name, value, remark)]: what is read first."""
    return '<dl class="facts">\n' + "\n".join(
        f"<div><dt>{text(name)}</dt><dd>{text(value)}<br/><small>{text(remark)}</small></dd></div>"
        for name, value, remark in items) + "\n</dl>"


def notice(title, items, is_bad):
    rows = "".join(f"<li>{text(item)}</li>" for item in items)
    look = "note bad" if is_bad else "note"
    return f'<div class="{look}"><h3>{text(title)}</h3><ul>{rows}</ul></div>'


def table(head, rows, words=1, texts=()):
    """Columns of numbers, but for the first `words` and those of `texts`, by their places.

    A cell is a text, or (text, whether it is bad)."""
    is_text = lambda column: column < words or column in texts

    def cell(value, column):
        value, is_bad = value if isinstance(value, tuple) else (value, False)
        inner = f'<span class="pill">{text(value)}</span>' if is_bad else text(value)
        return f"<td>{inner}</td>" if is_text(column) else f'<td class="n">{inner}</td>'

    heads = "".join(f"<th>{text(name)}</th>" if is_text(i) else f'<th class="n">{text(name)}</th>'
                    for i, name in enumerate(head))
    body = "".join(
        "<tr>" + "".join(cell(value, i) for i, value in enumerate(row)) + "</tr>\n" for row in rows)
    return f"<table>\n<tr>{heads}</tr>\n{body}</table>"


# ------------------------------------------------------------------------------------------- plots
class Line:
    """Samples (minute, value) in a look of style.css, and what they are."""
    def __init__(self, look, meaning, samples):
        self.look, self.meaning = look, meaning
        self.samples = [
            (at, value) for at, value in samples if value is not None and math.isfinite(value)
        ]


def step_of(span, count):
    """1, 2 or 5 times a power of ten: about `count` of them in the span."""
    rough = max(span, 1e-9) / count
    power = 10**math.floor(math.log10(rough))
    lead = rough / power
    return (5 if lead >= 5 else 2 if lead >= 2 else 1) * power


def number(value, step):
    digits = max(0, min(6, -math.floor(math.log10(step) + 1e-9)))
    return f"{0.0 if abs(value) < step / 2 else value:.{digits}f}"


def coordinate(value):
    return f"{value:.1f}".rstrip("0").rstrip(".")


class Scale:
    """From minutes and values to pixels."""
    def __init__(self, width, height, minutes, low, high):
        self.width, self.height, self.minutes = width, height, max(minutes, 1e-3)
        self.low, self.high = low, high if high > low else low + 1

    def x(self, minute):
        return LEFT + (self.width - LEFT - RIGHT) * min(max(minute / self.minutes, 0), 1)

    def y(self, value):
        return TOP + self.height * (1 - min(max((value - self.low) / (self.high - self.low), 0), 1))


def drawn(tag, look, words="", **attributes):
    said = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f'<{tag} class="{look}"{said}>{text(words)}</{tag}>'


def grid(scale, unit):
    step = step_of(scale.high - scale.low, 4)
    value, shapes = math.ceil(scale.low / step) * step, []
    while value < scale.high + step / 100:
        y = scale.y(value)
        shapes.append(drawn("path", "rule", d=f"M{LEFT} {coordinate(y)}H{scale.width - RIGHT}"))
        shapes.append(
            drawn("text", "soft end", number(value, step), x=LEFT - 7, y=coordinate(y + 4)))
        value += step
    return shapes + [drawn("text", "soft upward", unit, x=12, y=TOP + scale.height / 2)]


def time_axis(scale):
    bottom, step, shapes, moment = TOP + scale.height, step_of(scale.minutes, 6), [], 0.0
    while moment <= scale.minutes * (1 + 1e-9):
        is_last = moment + step > scale.minutes * (1 + 1e-9)
        x = scale.x(moment)
        shapes.append(drawn("path", "mark", d=f"M{coordinate(x)} {bottom}v5"))
        shapes.append(
            drawn("text",
                  "soft middle",
                  number(moment, step) + (" min" if is_last else ""),
                  x=coordinate(min(x, scale.width - 27)),
                  y=bottom + 19))
        moment += step
    return shapes


def polyline(scale, line):
    points = [
        f"{coordinate(scale.x(at))} {coordinate(scale.y(value))}" for at, value in line.samples
    ]
    if len(points) == 1:
        return [drawn("path", "dots " + line.look, d=f"M{points[0]}h0")]
    return [drawn("path", "line " + line.look, d="M" + "L".join(points))] if points else []


def drawing(lines, unit, minutes, low=None, levels=(), width=WIDE, height=170):
    """Lines over minutes; `levels` are dashed, [(value, look, words)].

    Without a low the axis begins near the least."""
    values = [value for line in lines for _, value in line.samples
             ] + [value for value, _, _ in levels]
    if not values:
        return '<p class="soft">Nothing was seen.</p>'
    least, most = min(values), max(values)
    if low == most:
        most = low + 1
    room = max((most - least) * 0.08, abs(most) * 0.002, 1e-6)
    scale = Scale(width, height, minutes, least - room if low is None else min(low, least),
                  most + room)
    shapes = [drawn("rect", "ground", x=LEFT, y=TOP, width=width - LEFT - RIGHT, height=height)
             ] + grid(scale, unit)
    for line in lines:
        shapes += polyline(scale, line)
    for value, look, words in levels:
        y = scale.y(value)
        shapes.append(drawn("path", "level " + look, d=f"M{LEFT} {coordinate(y)}H{width - RIGHT}"))
        shapes.append(
            drawn("text",
                  "said end " + look,
                  words,
                  x=width - RIGHT - 6,
                  y=coordinate(max(y - 4, TOP + LETTERS))))
    label = ", ".join(line.meaning for line in lines) + f" in {unit} over time"
    return (
        f'<svg class="over-time" viewBox="-0.5 -0.5 {width} {TOP + height + BELOW}" '
        f'font-size="{LETTERS}" '
        f'role="img" aria-label="{text(label)}">\n' + "\n".join(shapes + time_axis(scale)) +
        "\n</svg>")


def legend(lines):
    return '<div class="legend">' + "".join(
        f'<span><i class="line {line.look}"></i>{text(line.meaning)}</span>'
        for line in lines) + "</div>"


def plot(lines, unit, minutes, **how):
    """As wide as the page."""
    return (legend(lines) if len(lines) > 1 else
            "") + f'<div class="plot">{drawing(lines, unit, minutes, **how)}</div>'


def side_by_side(figures):
    """[(heading, words at its right, drawing)], two in a row."""
    return '<div class="two">\n' + "\n".join(
        f'<figure><h3>{text(name)}<span class="right">{text(remark)}</span></h3>\n{inner}</figure>'
        for name, remark, inner in figures) + "\n</div>"
