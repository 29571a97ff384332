#!/usr/bin/python3
"""Measures the demo's films and key pictures: tests/bench/films.py [OUT], OUT being the demo's folder (out/demo).

Of each film: length, median brightness of the room, longest time without motion and speech, first sound, loudness,
peak. Of each key picture: median brightness, the light's share of its pixels, and its brightest without the light.
Brightness is the strongest channel, 0 to 255; light is what is brighter than anything in the unlit room. Exit status 1
where something is beyond its limit.
"""
import pathlib
import re
import subprocess
import sys

import numpy

LIGHT = 90  # the unlit room is darker
# Words at the end of a chapter of the long film stand 3.5 s, to be read.
LIMITS = {"s": 15, "demo s": 66, "median": 45, "light %": 2, "still s": 2, "demo still s": 3.6, "sound s": 3,
          "LUFS": (-18, -14), "peak dB": -0.5}
WIDTH, HEIGHT, BAR = 320, 180, 18  # of a film as it is measured, and of the captions' bar in it
FPS = 10


def pixels(path, width, height, *options):
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", path, *options, "-s", f"{width}x{height}", "-f", "rawvideo",
                          "-pix_fmt", "rgb24", "-"], stdout=subprocess.PIPE, check=True).stdout
    return numpy.frombuffer(raw, numpy.uint8).reshape(-1, height, width, 3)


def heard(path):
    """Spans that sound, integrated loudness and peak."""
    text = subprocess.run(["ffmpeg", "-hide_banner", "-nostats", "-i", path, "-vn", "-af",
                           "silencedetect=noise=-45dB:duration=0.3,ebur128=peak=true:framelog=verbose", "-f", "null",
                           "-"], stderr=subprocess.PIPE, text=True, check=True).stderr
    silent = [(float(a), float(b)) for a, b in
              re.findall(r"silence_start: (\S+)[\s\S]*?silence_end: (\S+)", text)]
    loudness = float(re.findall(r"I:\s+(\S+) LUFS", text)[-1])
    return silent, loudness, float(re.findall(r"Peak:\s+(\S+) dBFS", text)[-1])


def film(path):
    frames = pixels(path, WIDTH, HEIGHT, "-r", str(FPS))
    room = frames[:, :HEIGHT - BAR]
    silent, loudness, peak = heard(path)
    first = silent[0][1] if silent and silent[0][0] < 0.1 else 0
    moves = numpy.abs(numpy.diff(room.astype(numpy.int16), axis=0)).max(axis=(1, 2, 3)) > 12
    says = numpy.abs(numpy.diff(frames[:, HEIGHT - BAR:].astype(numpy.int16), axis=0)).max(axis=(1, 2, 3)) > 40
    longest = still = 0
    for i, motion in enumerate(moves):
        is_silent = any(a <= i / FPS < b for a, b in silent)
        still = 0 if motion or says[i] or not is_silent else still + 1
        longest = max(longest, still)
    return {"s": len(frames) / FPS, "median": float(numpy.median(room.max(axis=3))), "still s": longest / FPS,
            "sound s": first, "LUFS": loudness, "peak dB": peak}


def picture(path):
    brightness = pixels(path, 640, 324)[0].max(axis=2)
    return {"median": float(numpy.median(brightness)), "light %": 100 * float((brightness > LIGHT).mean())}


def is_bad(name, key, value):
    limit = LIMITS.get(f"{name} {key}", LIMITS[key])
    if isinstance(limit, tuple):
        return not limit[0] <= value <= limit[1]
    return value < limit if key == "light %" else value > limit


def main():
    out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo")
    measured = [(path.stem, film(path)) for path in sorted(out.glob("*.mp4"))]
    measured += [(path.stem, picture(path)) for path in sorted((out / "frames").glob("*.png"))
                 if not path.stem.endswith("_projector")]
    bad = 0
    for name, values in measured:
        marks = [f"{key} {value:.1f}{' !' if is_bad(name, key, value) else ''}" for key, value in values.items()]
        bad += sum(mark.endswith("!") for mark in marks)
        print(f"{name:32} " + "  ".join(marks))
    sys.exit(bad > 0)


main()
