#!/usr/bin/python3
"""What several projectors together light on a surface: their light is added up.

  light_sum.py judge --scene scene.yaml --surface floor [--sent sent|asked] [--tolerance 0.05] [--black] [--reach] [--step-mm 20] [--top top.png]
      scene.yaml: surfaces as procam_sim.py has them, and projectors: width, height, K, D, T_world_projector,
      lumens (0: every place is lit as brightly by each), contrast (0: black is dark), gamma (0: sRGB), and two PNG
      beside it: `asked`, its picture alone in sRGB, and `sent`, the picture that it is sent.
      Looks at points (20 mm apart) where all projectors that get there ask for the same, over several pixels (with
      --black: at all points that get any light), and prints how bright they are, compared with what was asked for, as
      parts of their median. Ends with 1 if a part in a thousand or more of them is farther off than the tolerance, or
      if there is no seam among them, or a step between neighbors. --sent asked: as if the pictures were sent as they
      were asked for. --reach: where one projector alone lights a place, and not as brightly as the median even with all
      of its light, this is compared with all of its light.
      --top: the surface as it looks from above, a pixel a point.

Where light lands is procam_sim.py's; that it adds up is this file's. A projector's flux is the same from each of its
pixels, so its light on a place is what a pixel has, divided by the area that the pixel covers there. Needs
python3-numpy, python3-opencv, python3-yaml.
"""
import argparse
import os
import sys

import cv2
import numpy as np
import yaml

import procam_sim as sim

MARGIN_PX = 1.0  # nearer to a picture's border it is not said which pixels a point gets
ALIKE = 0.02     # what is asked for, over 7 x 7 pixels
STEP_MM = 20     # between neighbors: both sides of a border


def light_of_srgb(v):
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


class Projector:
    def __init__(self, d, folder, sent):
        self.lens, self.T = sim.Lens(d), np.array(d["T_world_projector"], float).reshape(4, 4)
        self.lumens, self.contrast = float(d["lumens"]), float(d["contrast"])
        asked, shown = (cv2.imread(os.path.join(folder, d[key])).mean(2) / 255.0 for key in ("asked", sent))
        self.asked = light_of_srgb(asked)
        light = light_of_srgb(shown) if sent == "asked" or not d["gamma"] else shown ** float(d["gamma"])
        black = 1 / self.contrast if self.contrast else 0.0
        self.light = black + (1 - black) * light
        window = np.ones((7, 7), np.uint8)
        self.least, self.greatest = cv2.erode(self.asked, window), cv2.dilate(self.asked, window)

    def pixels(self, points, others):
        """Pixels (n,2) of points, which of them its light gets to past other surfaces, and where that is not sure."""
        T = np.linalg.inv(self.T)
        uv = self.lens.project(points @ T[:3, :3].T + T[:3, 3])
        with np.errstate(invalid="ignore"):
            inside = ((uv > -0.5) & (uv < (self.lens.w - 0.5, self.lens.h - 0.5))).all(1)
            near = (np.abs(uv + 0.5) < MARGIN_PX) | (np.abs(uv + 0.5 - (self.lens.w, self.lens.h)) < MARGIN_PX)
        is_unsure = near.any(1)
        way = points - self.T[:3, 3]
        edge = MARGIN_PX / self.lens.K[0, 0] * np.linalg.norm(way, axis=1).max()
        for other in others:
            inside &= ~hides(other, self.T[:3, 3], way, 0)
            is_unsure |= hides(other, self.T[:3, 3], way, edge) != hides(other, self.T[:3, 3], way, -edge)
        return uv, inside, is_unsure

    def white(self, uv, surface):
        """Illuminance by its full light at pixels whose rays meet the surface."""
        if not self.lumens:
            return np.ones(len(uv))
        corners = []
        for du, dv in ((-.5, -.5), (.5, -.5), (.5, .5), (-.5, .5)):
            ways = self.lens.rays(uv[:, 0] + du, uv[:, 1] + dv) @ self.T[:3, :3].T @ surface.T[:3, :3]
            eye = (self.T[:3, 3] - surface.T[:3, 3]) @ surface.T[:3, :3]
            corners.append((eye - eye[2] / ways[:, 2:3] * ways)[:, :2])
        a, b = corners[2] - corners[0], corners[3] - corners[1]
        area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
        return self.lumens / (self.lens.w * self.lens.h) / area


def hides(surface, eye, way, grown):
    """Whether it stands in the way, if it was larger by so much on all sides."""
    surface.size = surface.size + 2 * grown
    distance = surface.hit(eye, way)[0]
    surface.size = surface.size - 2 * grown
    return distance < 1 - 1e-4


def add_up(scene, surface, sent, step):
    """Light on each point of a grid; what was asked for (nan where that is not sure); how many projectors light it;
    its light if all of them showed white."""
    folder = os.path.dirname(os.path.abspath(scene))
    d = yaml.safe_load(open(scene))
    surfaces = [sim.Surface(s) for s in d["surfaces"]]
    s = next((s for s in surfaces if s.name == surface), None) or sys.exit(f"light_sum: no surface {surface}")
    n = np.ceil(s.size / step).astype(int)
    X, Y = np.meshgrid((np.arange(n[0]) + 0.5) * step - s.size[0] / 2, s.size[1] / 2 - (np.arange(n[1]) + 0.5) * step)
    points = np.stack([X.ravel(), Y.ravel(), np.zeros(X.size)], 1) @ s.T[:3, :3].T + s.T[:3, 3]
    light, white, asked = np.zeros(X.size), np.zeros(X.size), np.full(X.size, np.nan)
    count, is_sure = np.zeros(X.size, int), np.ones(X.size, bool)
    for p in (Projector(q, folder, sent) for q in d["projectors"]):
        uv, lit, unsure = p.pixels(points, [q for q in surfaces if q is not s])
        is_sure &= ~unsure
        u, v = uv[lit, 0], uv[lit, 1]
        full = p.white(uv[lit], s)
        white[lit] += full
        light[lit] += full * sim.sample(p.light, u, v)
        own = sim.sample(p.asked, u, v)
        low, high = sim.sample(p.least, u, v), sim.sample(p.greatest, u, v)
        before = asked[lit]
        is_sure[lit] &= (high - low <= ALIKE) & (np.isnan(before) | (np.abs(before - own) <= ALIKE))
        asked[lit] = np.where(np.isnan(before), own, before)
        count[lit] += 1
    asked[~is_sure] = np.nan
    return [values.reshape(X.shape) for values in (light, asked, count, white)]


def judge(a):
    light, asked, count, white = add_up(a.scene, a.surface, a.sent, a.step_mm / 1000)
    wanted = asked if not a.black else np.where(np.isnan(asked), np.nan, 1.0)
    with np.errstate(invalid="ignore"):
        judged = (wanted > 0.1) & (count > 0)
    if a.top:
        scale = np.percentile(light[light > 0], 99) / 0.8
        cv2.imwrite(a.top, (255 * np.clip(light / scale, 0, 1) ** (1 / 2.2)).round().astype(np.uint8))
    parts = np.where(judged, light / np.where(judged, wanted, 1), np.nan)
    many = count[judged] > 1
    if many.sum() < 100 or (~many).sum() < 100:
        sys.exit(f"light_sum: no seam: {many.sum()} points are lit by several, {(~many).sum()} by one")
    median = np.nanmedian(parts)
    parts /= median
    n = max(1, round(STEP_MM / a.step_mm))
    steps = np.abs(np.concatenate([(parts[n:] - parts[:-n]).ravel(), (parts[:, n:] - parts[:, :-n]).ravel()]))
    step = np.nanpercentile(steps, 99.9)
    part, words = parts[judged], ""
    if a.reach:
        far = ~many & (white[judged] < median)
        words = f"; {far.sum()} out of reach, {part[far].min(initial=1):.3f} and more"
        part[far] *= median / white[judged][far]
    off = np.abs(part - 1)
    print(f"{len(part)} points, {many.sum()} lit by several (up to {count[judged].max()}): brightness "
          f"{np.percentile(part, 0.1):.3f} to {np.percentile(part, 99.9):.3f}, all {part.min():.3f} to {part.max():.3f}, "
          f"steps {step:.3f}{words}")
    if np.mean(off > a.tolerance) >= 0.001 or step > a.tolerance:
        sys.exit(1)


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    q = p.add_subparsers(required=True).add_parser("judge")
    q.add_argument("--scene", required=True)
    q.add_argument("--surface", required=True)
    q.add_argument("--sent", choices=["sent", "asked"], default="sent")
    q.add_argument("--tolerance", type=float, default=0.05)
    q.add_argument("--black", action="store_true")
    q.add_argument("--reach", action="store_true")
    q.add_argument("--step-mm", type=float, default=20)
    q.add_argument("--top")
    judge(p.parse_args())


if __name__ == "__main__":
    main()
