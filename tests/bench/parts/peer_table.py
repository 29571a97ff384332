"""Figures of Afterglow and of a peer, of the same work in the same minute, as a table.

A ratio above 1: Afterglow does better, whether more or less of a figure is good.
"""
import math
import re
import statistics
from dataclasses import dataclass, field

LESS, MORE = "less is better", "more is better"


@dataclass
class Row:
    """A figure of some work. `pairs` are (ours, the peer's), each pair measured together."""
    work: str
    peer: str
    unit: str
    better: str
    how: str
    pairs: list = field(default_factory=list)
    absent: str = ""  # why it was not measured here


def timing_figures(said):
    """{(stream, player): [(p99, drift) of each round]}, ms; from what replay_timing prints."""
    found = {}
    for line in said.splitlines():
        read = re.match(
            r"(cmd|ar)\s+(afterglow play|rosbag play|third player)\s+"
            r"([-0-9.]+)\s+([-0-9.]+)\s+([-0-9.]+)\s+([-0-9.]+)\s+\d+$", line)
        if read:
            figures = float(read.group(4)), abs(float(read.group(6)))
            found.setdefault((read.group(1), read.group(2)), []).append(figures)
    return found


def ratio_of(ours, theirs, better):
    """None: none can be told, as nothing was measured or both are no good."""
    if ours is None or theirs is None or not (math.isfinite(ours) and math.isfinite(theirs)):
        return None
    if ours == theirs:
        return 1.0
    good, bad = (ours, theirs) if better == MORE else (theirs, ours)
    return good / bad if bad > 0 else math.inf


def ratio(row):
    """The median of the pairs' ratios: what disturbs a machine disturbs both of a pair."""
    ratios = [ratio_of(*pair, row.better) for pair in row.pairs]
    known = [value for value in ratios if value is not None]
    return statistics.median(known) if known else None


def middle(row, side):
    """Of ours (0) or the peer's (1)."""
    values = [pair[side] for pair in row.pairs if pair[side] is not None]
    return statistics.median(values) if values else None


def number(value):
    """Three digits; "-": none."""
    if value is None:
        return "-"
    if math.isinf(value):
        return "∞"
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 4)}f}"


def cells(row):
    """What a row shows: work, peer, ours, theirs, unit, ratio, how."""
    if row.absent:
        return [row.work, row.peer, "-", "-", row.unit, "-", "not here: " + row.absent]
    ours, theirs = (number(middle(row, side)) for side in (0, 1))
    return [row.work, row.peer, ours, theirs, row.unit, number(ratio(row)), row.how]


HEAD = ["Work", "Peer", "Afterglow", "Peer's", "Unit", "Ratio", "How it was measured"]


def text(rows):
    """Columns; the last one, the longest, as it is."""
    lines = [HEAD] + [cells(row) for row in rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEAD) - 1)]
    right = {2, 3, 5}
    return "\n".join("  ".join([
        cell.rjust(width) if i in right else cell.ljust(width)
        for i, (cell, width) in enumerate(zip(line, widths))
    ] + [line[-1]]).rstrip()
                     for line in lines)
