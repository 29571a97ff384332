"""Does a figure grow over a run, and is that too much? What judges a soak, without its processes.

Samples are pairs (minute, value), in order. What a program loads and caches while it begins is no
growth: judged are the later two thirds of a run.
"""
import math
import statistics
from dataclasses import dataclass

MIB = 1024  # KiB
MOST_GROWTH_KIB = MIB  # of a run's judged part ...
MOST_GROWTH_KIB_AN_HOUR = MIB  # ... or so much an hour, whichever is more
MOST_MORE_DESCRIPTORS, MOST_MORE_THREADS, MOST_MORE_CHILDREN = 2, 1, 0
MOST_SLOWER = 1.5  # times as long as in the judged part's first third
LEAST_JUDGED_MIN = 5
MOST_DRIFT_MS = 10  # of a replay, from its first second to its last
MOST_BUCKETS = 300


@dataclass
class Verdict:
    """What was found, the bound it was held against, and whether it was kept."""
    what: str
    found: str
    bound: str
    is_kept: bool

    def text(self):
        return f"{self.what} {self.found} ({self.bound}): {'ok' if self.is_kept else 'NOT KEPT'}"


def finite(samples):
    return [(at, value) for at, value in samples if value is not None and math.isfinite(value)]


def judged(samples):
    """The later two thirds, by time."""
    kept = finite(samples)
    if not kept:
        return []
    begin = kept[0][0] + (kept[-1][0] - kept[0][0]) / 3
    return [sample for sample in kept if sample[0] >= begin]


def thinned(samples, most=MOST_BUCKETS):
    """At most so many, the medians of buckets: so a day is judged in a second."""
    if len(samples) <= most:
        return samples
    size = math.ceil(len(samples) / most)
    buckets = [samples[i:i + size] for i in range(0, len(samples), size)]
    return [tuple(statistics.median(column) for column in zip(*bucket)) for bucket in buckets]


def slope(samples):
    """Of a line through the samples, a minute: the median of all pairs' slopes (Theil, Sen).

    Peaks do not turn it."""
    few = thinned(finite(samples))
    slopes = [(later - earlier) / (then - at)
              for i, (at, earlier) in enumerate(few)
              for then, later in few[i + 1:]
              if then > at]
    return statistics.median(slopes) if slopes else 0.0


def minutes(samples):
    return samples[-1][0] - samples[0][0] if samples else 0.0


def most_slope_kib(length_min):
    """KiB a minute that a process may grow by in a judged part of that length."""
    if length_min <= 0:
        return float(MOST_GROWTH_KIB)
    return max(MOST_GROWTH_KIB / length_min, MOST_GROWTH_KIB_AN_HOUR / 60)


def floors(samples):
    """The least of each minute: what is there at rest."""
    least = {}
    for at, value in finite(samples):
        minute = math.floor(at)
        least[minute] = min(value, least.get(minute, value))
    return sorted(least.items())


def growth(samples_kib):
    """KiB a minute, at rest, over the judged part."""
    return slope(floors(judged(samples_kib)))


def memory(samples_kib):
    length, grows = minutes(judged(samples_kib)), growth(samples_kib)
    if length < LEAST_JUDGED_MIN:
        return Verdict("memory", f"{grows:+.1f} KiB/min", "too short a run to judge", True)
    most = most_slope_kib(length)
    return Verdict("memory", f"{grows:+.1f} KiB/min", f"at most {most:.0f}", grows <= most)


def thirds(samples):
    """The first and the last third of samples, values alone."""
    count = max(1, len(samples) // 3)
    return [value for _, value in samples[:count]], [value for _, value in samples[-count:]]


def count(what, samples, most_more):
    """Of what is counted: the fewest in the judged part's last third, against those in its first.

    Work comes and goes, and with it what it needs; what is not given back is there at rest."""
    part = judged(samples)
    if not part:
        return Verdict(what, "not seen", f"at most {most_more} more", True)
    first, last = (min(values) for values in thirds(part))
    return Verdict(what, f"{last:.0f}, {last - first:+.0f}", f"at most {most_more} more",
                   last - first <= most_more)


def pace(what, samples_ms):
    """Of what takes time: the last third's median, against the first's.

    A busy machine fails this without a fault."""
    part = judged(samples_ms)
    if not part:
        return Verdict(what, "never seen", f"at most {MOST_SLOWER} times", False)
    first, last = (statistics.median(values) for values in thirds(part))
    ratio = last / first if first > 0 else 1.0
    return Verdict(what, f"{last:.1f} ms, {ratio:.2f} times", f"at most {MOST_SLOWER} times", ratio
                   <= MOST_SLOWER)


def lost(what, count, of, most_share=0.0):
    """Of what was sent, or begun; nothing sent is a failure, too."""
    bound = f"at most {100 * most_share:g} %" if most_share else "none"
    return Verdict(what, f"{count} of {of} lost", bound, of > 0 and count <= most_share * of)


def store(samples_mb, most_mb):
    """A store whose oldest behaviors make room."""
    largest = max((value for _, value in finite(samples_mb)), default=0)
    return Verdict("store", f"{largest:.0f} MB at most", f"below {most_mb:.0f}", largest <= most_mb)


def drift(samples_ms):
    """Of replays: how much later their last second was than their first, beside the recording."""
    values = [value for _, value in finite(samples_ms)]
    if not values:
        return Verdict("drift of replays", "never measured", f"at most {MOST_DRIFT_MS} ms", False)
    middle = statistics.median(abs(value) for value in values)
    return Verdict("drift of replays",
                   f"{middle:.2f} ms in the median, {max(values, key=abs):+.2f} at most",
                   f"at most {MOST_DRIFT_MS} ms in the median", middle <= MOST_DRIFT_MS)


def schedule_drift(errors_ms, a_second):
    """How much later the last second of a stream arrived than its first, against its schedule.

    None: too few of them.

    errors_ms: how late each message was, in their order."""
    if len(errors_ms) < 2 * a_second:
        return None
    return statistics.median(errors_ms[-a_second:]) - statistics.median(errors_ms[:a_second])


def quantile(values, part):
    """None for no values."""
    values = sorted(values)
    return values[int(part * (len(values) - 1) + 0.5)] if values else None
