#!/usr/bin/python3
"""Counts what a run of ctest did, test case by test case, and says why something was skipped.

summarize.py DIR    DIR holds ctest.log (--output-log) and the XML reports of the GoogleTest programs.
A program that failed without naming a failed case (it crashed, or ran out of time) counts as one failure.
Exit status 0 only if something passed and nothing failed.
"""
import os
import re
import sys
import xml.etree.ElementTree as ET


def cases_of(report):
    """(name, outcome, reason) of every case in a GoogleTest report."""
    for case in ET.parse(report).iter("testcase"):
        name = f'{case.get("classname")}.{case.get("name")}'
        skipped = case.find("skipped")
        if case.find("failure") is not None:
            yield name, "failed", ""
        elif skipped is not None or case.get("result") == "skipped":
            message = skipped.get("message") if skipped is not None else ""
            yield name, "skipped", " ".join((message or "").split("\n")[1:]).strip() or message
        elif case.get("status") == "run":
            yield name, "passed", ""


def programs_of(log):
    """(name, whether it passed) of every program. ctest's own XML is younger than Debian 11."""
    line = re.compile(r"^ *\d+/\d+ Test +#\d+: (\S+) \.*(.*)")
    with open(log, encoding="utf-8", errors="replace") as file:
        for found in filter(None, map(line.match, file)):
            yield found[1], found[2].split()[:1] == ["Passed"]


def main(folder):
    count = {"passed": 0, "failed": 0, "skipped": 0}
    lines = []
    for name, ok in programs_of(os.path.join(folder, "ctest.log")):
        report = os.path.join(folder, name + ".xml")
        try:
            cases = list(cases_of(report)) if os.path.exists(report) else []
        except ET.ParseError:
            cases = []  # the program died while it wrote
        if not ok and not any(outcome == "failed" for _, outcome, _ in cases):
            cases.append((name, "failed", "the program crashed, ran out of time or could not start"))
        elif ok and not cases:
            cases.append((name, "passed", ""))
        for case, outcome, reason in cases:
            count[outcome] += 1
            if outcome != "passed":
                lines.append(f"{outcome}: {name}: {case}" + (f": {reason}" if reason else ""))
    print("\n".join(sorted(lines)))
    skipped = f', {count["skipped"]} skipped' if count["skipped"] else ""
    print(f'{count["passed"]} passed, {count["failed"]} failed{skipped}')
    return 0 if count["passed"] and not count["failed"] else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
