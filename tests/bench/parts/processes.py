"""What Linux knows of processes, read from /proc: memory, descriptors, threads, children, CPU."""
import os
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
PAGE_KIB = os.sysconf("SC_PAGE_SIZE") // 1024


def rollup_kib(pid):
    """Of smaps_rollup: {"Rss": KiB, "Pss": ...}."""
    found = {}
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]:
        name, value = line.split(":")
        found[name] = int(value.split()[0])
    return found


def stat(pid):
    """(state, parent, CPU seconds, threads)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return fields[0], int(fields[1]), (int(fields[11]) + int(fields[12])) / TICKS, int(fields[17])


def look(pid):
    """One sample of a process; None: it is gone.

    `own_kib` is what belongs to it alone and to no file, its heap above all, which a leak makes
    grow. Pages of files that it maps come and go as the machine has room."""
    try:
        _, _, cpu_s, threads = stat(pid)
        memory = rollup_kib(pid)
        descriptors = len(os.listdir(f"/proc/{pid}/fd"))
    except (OSError, ValueError, IndexError):
        return None
    return {
        "rss_kib": memory["Rss"],
        "pss_kib": memory["Pss"],
        "own_kib": memory["Anonymous"],
        "cpu_s": cpu_s,
        "threads": threads,
        "descriptors": descriptors
    }


def program(pid):
    """The name of what runs, of a script the script's; "?": it is gone."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return "?"
    is_python = os.path.basename(words[0]).startswith("python") and len(words) > 1
    return os.path.basename(words[1] if is_python else words[0]) or "?"


def children():
    """{parent: [(pid, is a zombie)]} of all processes."""
    found = {}
    for name in os.listdir("/proc"):
        if not name.isdigit():
            continue
        try:
            state, parent, _, _ = stat(name)
        except (OSError, ValueError, IndexError):
            continue
        found.setdefault(parent, []).append((int(name), state == "Z"))
    return found


def machine_cpu_s():
    """(busy, all) seconds of all cores since the machine began."""
    fields = [
        int(field) / TICKS
        for field in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]
    ]
    return sum(fields) - fields[3] - fields[4], sum(fields)
