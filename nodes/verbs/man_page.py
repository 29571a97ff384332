#!/usr/bin/python3
"""Writes the man page of `afterglow`: what --help says of the command, of every verb and of what a verb consists of.

man_page.py AFTERGLOW PAGE      AFTERGLOW: the command; PAGE: the file to write, its folder is made

What no --help says (exit status, environment, files) stands here. Needs no ROS master.
"""

import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

INDENT = " " * 30  # before what CLI11 says of an option

DESCRIPTION = """\
Afterglow is a projector-based rendering service for ROS 1 robots, with replay: it calibrates a robot's projector,
draws what the robot says in RViz's terms onto floor and table, records behaviors, finds them again, and repeats a past
behavior's movement, projection and speech on the running robot. This command does what needs no node of its own;
projector_node, recorder_node, player_node, calibrator_node and speaker_node are started by roslaunch.
"""

CLOSING = r"""
.SH EXIT STATUS
.TP
.B 0
Done.
.TP
.B 1
Refused or failed; one line on standard error says why.
.TP
.B 2
Wrong usage.
.SH ENVIRONMENT
.TP
.B AFTERGLOW_STORE
The store where
.B \-\-store
names none.
.TP
.B AFTERGLOW_SPOOL
The folder of the store in which a recorder keeps what a MongoDB server does not have yet.
.TP
.B ROS_MASTER_URI
The ROS master that
.BR record ,
.BR example ,
.BR play ,
.BR watch ,
.BR doctor ,
.BR init ,
.B calibrate mount \-\-from\-tf
and
.B calibrate latency
ask; by default http://localhost:11311. Nothing else needs one.
.TP
.B XDG_CACHE_HOME
Where the folder afterglow/files is, if not in \(ti/.cache.
.SH FILES
.TP
.I \(ti/.local/share/afterglow/afterglow.db
The store, if neither an option nor AFTERGLOW_STORE names another.
.TP
.I \(ti/.local/share/afterglow/spool\-*.db
A store of what a MongoDB server does not have yet.
.TP
.I \(ti/.cache/afterglow/files
Recorded sounds and meshes that a replay needs and this machine does not have.
.SH SEE ALSO
.BR rosbag (1),
.BR ffmpeg (1)
.PP
README.md of Afterglow, and the one in each of its folders.
"""


def run(command, *arguments):
    done = subprocess.run([command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"man_page.py: {' '.join([command, *arguments])} failed: {done.stderr.strip()}")
    return done.stdout


# ------------------------------------------------------------------------------------------------ reading --help
class Entry:
    """An option, a positional or a verb, and what is said of it."""

    def __init__(self, head, text):
        self.head, self.text = head, text


class Help:
    """A --help of CLI11's: what it is for, its usage, and its sections of entries."""

    def __init__(self, text):
        lines = text.rstrip("\n").split("\n")
        self.purpose = lines[0]
        self.usage = lines[1][len("Usage: "):]
        self.sections = {}
        section = None
        for line, below in zip(lines[2:], lines[3:] + [""]):
            if line and not line.startswith(" "):
                section = self.sections.setdefault(line.rstrip(":"), [])
            elif "Example" in self.sections:  # the last section: lines as they are
                section.append(Entry(line.strip(), ""))
            elif line.startswith(INDENT):
                section[-1].text = line.strip()
            elif line.strip():
                # A long name has a line to itself; what is said of it follows below.
                end = len(line) if below.startswith(INDENT) else len(INDENT)
                section.append(Entry(line[:end].strip(), line[end:].strip()))

    def verbs(self):
        return [entry.head for entry in self.sections.get("Subcommands", [])]


def helps(command):
    """Every --help by its words: (), ("play",), ("store", "check"), in their order. Several at a time."""
    found = {(): Help(run(command, "--help"))}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        new = [()]
        while new:
            new = [words + (verb,) for words in new for verb in found[words].verbs()]
            texts = pool.map(lambda words: run(command, *words, "--help"), new)
            found.update(zip(new, map(Help, texts)))
    return found


# ------------------------------------------------------------------------------------------------ writing
def roff(text):
    for character, escape in [("\\", r"\e"), ("-", r"\-"), ("~", r"\(ti"), ("^", r"\(ha"), ("'", r"\(aq")]:
        text = text.replace(character, escape)
    return "\\&" + text if text.startswith(".") else text


def bold(text):
    return rf"\fB{roff(text)}\fR"


def sentence(text):
    return text if not text or text.endswith(".") else text + "."


def typed(kind):
    """:{a,b} is a|b, TEXT:FILE.png|FILE.mp4 the latter, INT:INT in [1 - 240] a number."""
    choice = re.fullmatch(r"[A-Z]*:(?:\{(.*)\}|(FILE.*))", kind)
    if choice:
        return (choice.group(1) or choice.group(2)).replace(",", "|")
    return re.sub(r"^(FLOAT|U?INT)\b", "NUMBER", kind.partition(":")[0])


def range_of(kind):
    limits = re.search(r" in \[(\S+) - (\S+)\]", kind)
    if limits:
        return f" From {limits.group(1)} to {limits.group(2)}."
    return " Above 0." if kind.endswith(":POSITIVE") else ""


def condition_text(condition, is_option):
    """Of REQUIRED, "Needs: --a --b", "Excludes: --c"."""
    what, _, options = condition.partition(": ")
    said = {"REQUIRED": "Required" if is_option else "", "Needs": "Only with", "Excludes": "Not with"}[what]
    named = ", ".join(bold(option) for option in options.split())
    return f"{said} {named}".rstrip() + "." if said else ""


def entry_text(entry, is_option):
    """An entry as a paragraph with a tag. CLI11 puts type, default and conditions behind the name."""
    head, *conditions = re.split(r" (?=REQUIRED|Needs: |Excludes: )", entry.head)
    name, _, kind = head.partition(" ")
    is_list = kind.endswith("...")
    kind, _, default = kind[:-3 if is_list else None].strip().partition("=")
    if kind.startswith("UINT:SIZE"):  # its = tells what units are
        default = ""
    said = sentence(entry.text) + range_of(kind)
    if default and "efault" not in said:
        said += f" Default: {default}."
    tag = ", ".join(bold(part) for part in name.replace("{false}", "").split(","))
    if is_option and kind:
        tag += rf" \fI{roff(typed(kind))}\fR"
    tag += " ..." if is_list else ""
    told = [roff(said), *[condition_text(condition, is_option) for condition in conditions]]
    return [".TP", tag, " ".join(text for text in told if text)]


def verb_text(help_):
    lines = [f".SS {roff(help_.usage)}", roff(sentence(help_.purpose))]
    for title, entries in help_.sections.items():
        told = [entry for entry in entries if entry.head != "-h,--help"]  # said once, of the command
        if title not in ("Options", "Positionals"):
            lines += [".PP", roff(title) + ":"]
        if title == "Example":
            lines += [".nf", *[roff(entry.head) for entry in told], ".fi"]
            continue
        for entry in told:
            lines += entry_text(entry, title != "Positionals")
    return lines


def synopsis(found):
    lines = []
    for words, help_ in found.items():
        if words and not help_.verbs():
            typed_words, _, behind = help_.usage.partition(" [OPTIONS]")
            line = rf"{bold(typed_words)} [\fIOPTIONS\fR]"
            lines.append(line + (rf" \fI{roff(behind.strip())}\fR" if behind else ""))
    return [*lines, r"\fBafterglow\fR [\fIVERB\fR ...] \fB\-\-help\fR", r"\fBafterglow \-\-version\fR"]


def page(command):
    version = run(command, "--version").strip()
    found = helps(command)
    top = found[()]
    purpose = top.purpose[0].lower() + top.purpose[1:].rstrip(".")
    lines = [r""".\" Made by nodes/verbs/man_page.py from --help.""", f'.TH AFTERGLOW 1 "" "{version}" "User Commands"',
             ".nh", ".ad l", ".SH NAME", rf"afterglow \- {roff(purpose)}", ".SH SYNOPSIS", ".nf",
             *synopsis(found), ".fi", ".SH DESCRIPTION", roff(DESCRIPTION.strip()), ".SH VERBS"]
    for entry in top.sections["Subcommands"]:
        lines += [".TP", bold(entry.head), roff(sentence(entry.text))]
    lines.append(".SH OPTIONS")
    for entry in top.sections["Options"]:
        lines += entry_text(entry, True)
    for words in in_order(found):
        lines += [f".SH {words[0].upper()}"] if len(words) == 1 else []
        lines += [roff(sentence(found[words].purpose))] if found[words].verbs() else verb_text(found[words])
    return "\n".join(lines) + CLOSING


def in_order(found):
    """Each verb, then what it consists of, as --help lists them."""
    for verb in found[()].verbs():
        yield (verb,)
        yield from ((verb, part) for part in found[(verb,)].verbs())


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: man_page.py AFTERGLOW PAGE")
    path = pathlib.Path(sys.argv[2])
    text = page(sys.argv[1])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


main()
