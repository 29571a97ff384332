#!/usr/bin/python3
"""Photographs for a calibration in a room where one thing, or everything, is not as it should be.

  faulty_room.py list
  faulty_room.py photographs --board board.yaml --pattern pattern.png --kind wide --seed 1 --faults sag,jpeg --out DIR
      view_NN.png and view_NN_plain.png (16 poses), camera.yaml as its owner believes it, truth.yaml.
  faulty_room.py judge --truth DIR/truth.yaml --projector projector.yaml --pose T_camera_projector.yaml
      How far off light lands at 1, 2 and 3 m in front of the projector, in the part of the beam that the camera
      sees: the 95th percentile in millimeters on a surface that faces the beam, a line a distance.

Geometry of camera, projector and rigs is procam_sim.py's; how light, lens, sensor and paper behave is this file's
own, and nothing is shared with calib/. Strengths are in FAULTS: NAME=FACTOR makes one so many times as strong, as in
sag=2 (2 mm). Needs python3-numpy, python3-opencv, python3-yaml.
"""
import argparse
import os
import sys

import cv2
import numpy as np
import yaml

import procam_sim as sim

FAULTS = {
    "curve": "the camera's response is an S-curve, not a power",
    "gamma": "the projector's gamma is 1.8, its black shines with 2 % of its white",
    "defocus": "the projector is sharp at 1.35 m only",
    "vignetting": "camera and projector darken toward the corners by a third",
    "jpeg": "a color mosaic, demosaiced, and JPEG of quality 85",
    "highlight": "the paper is glossy: a lamp and the projector shine back, lobe 0.3",
    "camera_info": "camera_info is off: focal length 0.2 %, center 1 px, k1 0.01",
    "sag": "the board sags by 1 mm over its length, as a shelf does",
    "twist": "the corners of the board stand 1 mm off its plane, two above and two below it",
    "bands": "a color wheel behind a rolling shutter: bands of 20 %, elsewhere in each picture",
    "motion": "a hand holds the board: it moves by 1 mm and 1 mrad while a picture is taken",
    "shadow": "an arm's shadow lies across the board, not in the same place in both pictures",
    "window": "the sun comes through a window: bright stripes on the board, a glaring pane behind it",
}
TOGETHER = ("curve", "gamma", "defocus", "vignetting", "jpeg", "highlight", "camera_info", "sag")
SAMPLES = 2  # across and down for each pixel


def strengths(text):
    """{"sag": 1.0, ...} of "sag,jpeg=2" or "together" or "none"."""
    chosen = {}
    for part in filter(None, text.split(",")):
        name, _, factor = part.partition("=")
        names = TOGETHER if name == "together" else () if name == "none" else (name,)
        for one in names:
            if one not in FAULTS:
                sys.exit(f"faulty_room: no fault is called {one}; see: faulty_room.py list")
            chosen[one] = float(factor or 1)
    return chosen


# ------------------------------------------------------------------------------------------- paper
class Sheet:
    """The board: a picture on a sheet that need not be flat."""

    def __init__(self, T, size, picture, faults, camera):
        """The picture as a sample of the camera sees it: the mean over what lies in it, or edges would be stairs."""
        self.T, self.size = T, np.array(size, float)
        width_m = np.linalg.norm((np.linalg.inv(camera.T_camera) @ T)[:3, 3]) / camera.camera.K[0, 0] / SAMPLES
        texels = width_m / self.size[0] * picture.shape[1]
        self.tex = cv2.GaussianBlur(0.04 + 0.86 * (picture / 255.0), (0, 0), max(texels / np.sqrt(12), 0.1))
        self.sag, self.twist = 1e-3 * faults.get("sag", 0), 1e-3 * faults.get("twist", 0)

    def height(self, x, y):
        """Of the paper above its frame's plane, and the slopes along x and y."""
        t = np.clip(x / self.size[0] + 0.5, 0, 1)
        # a shelf on two supports under its own weight
        z = -3.2 * self.sag * (t - 2 * t**3 + t**4)
        zx = -3.2 * self.sag * (1 - 6 * t**2 + 4 * t**3) / self.size[0]
        k = 4 * self.twist / (self.size[0] * self.size[1])
        return z + k * x * y, zx + k * y, k * x + 0 * zx

    def hit(self, eye, rays):
        """Distance along the rays (inf where missed), place on the paper."""
        R, t = self.T[:3, :3], self.T[:3, 3]
        o, d = (eye - t) @ R, rays @ R
        with np.errstate(divide="ignore", invalid="ignore"):
            s = -o[2] / d[:, 2]
            for _ in range(3 if self.sag or self.twist else 0):
                z, zx, zy = self.height(o[0] + s * d[:, 0], o[1] + s * d[:, 1])
                s -= (o[2] + s * d[:, 2] - z) / (d[:, 2] - zx * d[:, 0] - zy * d[:, 1])
            x, y = o[0] + s * d[:, 0], o[1] + s * d[:, 1]
        met = (np.abs(x) <= self.size[0] / 2) & (np.abs(y) <= self.size[1] / 2) & (s > 1e-6)
        return np.where(met, s, np.inf), np.stack([x, y], 1)

    def normals(self, xy):
        _, zx, zy = self.height(xy[:, 0], xy[:, 1])
        n = np.stack([-zx, -zy, np.ones(len(xy))], 1) @ self.T[:3, :3].T
        return n / np.linalg.norm(n, axis=1, keepdims=True)

    def albedo(self, xy):
        h, w = self.tex.shape
        u, v = (xy[:, 0] / self.size[0] + 0.5) * w - 0.5, (0.5 - xy[:, 1] / self.size[1]) * h - 0.5
        return sim.sample(self.tex, u, v)


# ------------------------------------------------------------------------------------------- light
class Projector:
    """What the projector sends: its picture in linear light, sharp or not."""

    FOCUS_M, APERTURE_PX = 1.35, 5.0

    def __init__(self, lens, T_world, shown, faults):
        self.lens, self.T, self.faults = lens, T_world, faults
        gamma = 2.2 - 0.4 * faults.get("gamma", 0)
        black = 0.02 * faults.get("gamma", 0)
        light = black + (1 - black) * np.power(shown / 255.0, gamma)
        self.sharpness = [0.0, 0.5, 1.0, 1.6, 2.4, 3.6] if "defocus" in faults else [0.0]
        self.pictures = [cv2.GaussianBlur(light, (0, 0), s) if s else light for s in self.sharpness]

    def at(self, points):
        """Light through a surface that faces it (3 at a meter for white), and the directions it comes from."""
        T = np.linalg.inv(self.T)
        p = points @ T[:3, :3].T + T[:3, 3]
        uv = self.lens.project(p)
        lit = np.isfinite(uv[:, 0]) & (uv > -0.5).all(1) & (uv < (self.lens.w - 0.5, self.lens.h - 0.5)).all(1)
        way = points - self.T[:3, 3]
        distance = np.linalg.norm(way, axis=1)
        light = np.zeros(len(points))
        light[lit] = 3.0 / distance[lit] ** 2 * self.look_up(uv[lit], p[lit, 2])
        return light, way / distance[:, None]

    def look_up(self, uv, z):
        if len(self.pictures) == 1:
            value = sim.sample(self.pictures[0], uv[:, 0], uv[:, 1])
        else:
            blur = self.faults["defocus"] * self.APERTURE_PX * np.abs(1 - z / self.FOCUS_M) + 1e-9
            level = np.interp(blur, self.sharpness, np.arange(len(self.sharpness)))
            value = np.zeros(len(uv))
            for i, picture in enumerate(self.pictures):
                share = np.clip(1 - np.abs(level - i), 0, 1)
                m = share > 0
                value[m] += share[m] * sim.sample(picture, uv[m, 0], uv[m, 1])
        if "vignetting" in self.faults:
            value = value * vignette(uv, self.lens.w, self.lens.h, self.faults["vignetting"])
        return value


def vignette(uv, w, h, strength):
    r2 = ((uv[:, 0] - w / 2) ** 2 + (uv[:, 1] - h / 2) ** 2) / ((w / 2) ** 2 + (h / 2) ** 2)
    return 1 - strength * r2 / 3


def daylight(xy, size, faults, moved):
    """Light of the room on the paper, and whether the projector's light gets there (0 to 1)."""
    room, passes = np.full(len(xy), 0.25), np.ones(len(xy))
    if "window" in faults:
        stripes = 0.5 + 0.5 * np.tanh(8 * np.sin(14 * xy[:, 0] + 5 * xy[:, 1]))
        room = room + faults["window"] * (0.3 + 0.7 * xy[:, 0] / size[0] + 0.9 * stripes)
    if "shadow" in faults:
        along = (xy[:, 0] - moved[0]) * np.cos(moved[1]) + xy[:, 1] * np.sin(moved[1])
        dark = 0.5 + 0.5 * np.tanh((0.03 * faults["shadow"] - np.abs(along)) / 0.006)
        room, passes = room * (1 - 0.5 * dark), 1 - dark
    return np.maximum(room, 0.02), passes


def gloss(normals, toward_light, toward_eye, strength):
    """A lobe of about 12 degrees around the mirror's direction."""
    mirrored = 2 * np.sum(toward_light * normals, 1)[:, None] * normals - toward_light
    return strength * np.clip(np.sum(mirrored * toward_eye, 1), 0, 1) ** 60


# ------------------------------------------------------------------------------------------ camera
class Room:
    def __init__(self, rig):
        self.faults = {}
        self.camera, self.T_camera = sim.Lens(rig["camera"]), np.array(rig["T_world_camera"])
        self.lens, self.T_projector = sim.Lens(rig["projector"]), np.array(rig["T_world_projector"])
        step = 1.0 / SAMPLES
        us = np.arange(self.camera.w * SAMPLES) * step + (step - 1) / 2
        vs = np.arange(self.camera.h * SAMPLES) * step + (step - 1) / 2
        # Exact on every fourth sample and linear between: to a thousandth of a pixel. (Bicubic of OpenCV does not
        # follow a straight line.)
        U, V = np.meshgrid(*(x[0] + np.arange(0, len(x) + 4, 4) * step for x in (us, vs)))
        coarse = self.camera.rays(U.ravel(), V.ravel()).reshape(U.shape + (3,)).astype(np.float32)
        at = np.meshgrid(*((np.arange(len(x)) / 4).astype(np.float32) for x in (us, vs)))
        self.shape = (len(vs), len(us))
        self.rays = cv2.remap(coarse, *at, cv2.INTER_LINEAR).reshape(-1, 3).astype(float) @ self.T_camera[:3, :3].T

    def light(self, rays, sheet, projector, arm):
        """What enters the camera along rays."""
        eye = self.T_camera[:3, 3]
        out = np.full(len(rays), 0.02)
        k, xy = sheet.hit(eye, rays)
        on = np.isfinite(k)
        self.floor(out, rays, ~on, sheet, projector)
        if not on.any():
            return out
        xy, k, rays = xy[on], k[on], rays[on]
        points = eye + rays * k[:, None]
        normals = sheet.normals(xy)
        sent, way = projector.at(points)
        room, passes = daylight(xy, sheet.size, self.faults, arm)
        sent = sent * passes * np.abs(np.sum(way * normals, 1))
        value = sheet.albedo(xy) * (room + sent)
        if "highlight" in self.faults:
            strength, toward_eye = 0.3 * self.faults["highlight"], -rays / np.linalg.norm(rays, axis=1)[:, None]
            lamp = np.array([0.4, 0.2, 2.4]) - points
            lamp /= np.linalg.norm(lamp, axis=1)[:, None]
            value += gloss(normals, -way, toward_eye, strength) * sent
            value += gloss(normals, lamp, toward_eye, strength) * room
        out[on] = value
        return out

    def floor(self, out, rays, where, sheet, projector):
        eye = self.T_camera[:3, 3]
        with np.errstate(divide="ignore"):
            s = np.where(where, -eye[2] / rays[:, 2], -1)
        on = (s > 0) & (s < 6)
        points = eye + rays[on] * s[on][:, None]
        sent, way = projector.at(points)
        shaded, _ = sheet.hit(projector.T[:3, 3], points - projector.T[:3, 3])
        out[on] = 0.5 * (0.25 + np.where(shaded < 1, 0, sent) * np.abs(way[:, 2]))
        if "window" in self.faults:
            out[where & ~on & (np.abs(np.sin(6 * rays[:, 0])) > 0.5)] = 4.0 * self.faults["window"]

    def photograph(self, sheets, projector, random):
        """8 bit, gray or color."""
        arm = (random.uniform(-0.15, 0.15), random.uniform(-0.5, 0.5))
        light = np.zeros(len(self.rays))
        for part in np.array_split(np.arange(len(light)), len(light) // 40000):  # what a cache holds
            some = slice(part[0], part[-1] + 1)
            light[some] = sum(self.light(self.rays[some], sheet, projector, arm) for sheet in sheets) / len(sheets)
        image = light.reshape(self.shape).reshape(self.camera.h, SAMPLES, self.camera.w, SAMPLES).mean((1, 3))
        image = cv2.GaussianBlur(image, (0, 0), 0.6)
        return self.develop(image, random)

    def develop(self, image, random):
        f, h, w = self.faults, self.camera.h, self.camera.w
        v, u = np.mgrid[0:h, 0:w]
        if "vignetting" in f:
            image = image * vignette(np.stack([u.ravel(), v.ravel()], 1), w, h, f["vignetting"]).reshape(h, w)
        if "bands" in f:
            image = image * (1 + 0.2 * f["bands"] * np.sin(2 * np.pi * (v / 170.0 + random.uniform())))
        exposed = np.clip(image * 0.85 / np.percentile(image, 99.5), 0, 1)
        if "jpeg" in f:
            gains = np.ones((h, w))
            gains[0::2, 0::2], gains[1::2, 1::2] = 0.75, 0.6
            raw = exposed * gains + random.normal(0, 0.006, (h, w)) * np.sqrt(exposed + 0.02)
            color = cv2.cvtColor((np.clip(raw, 0, 1) * 65535).astype(np.uint16), cv2.COLOR_BayerRG2RGB) / 65535.0
            exposed = np.clip(color / np.array([0.6, 1.0, 0.75]), 0, 1)
        gray = 255 * respond(exposed, f.get("curve", 0))
        if "jpeg" not in f:
            gray = gray + random.normal(0, 1.5, gray.shape)
        image = np.clip(gray, 0, 255).round().astype(np.uint8)
        if "jpeg" in f:
            quality = int(np.clip(100 - 15 * f["jpeg"], 5, 100))
            image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR)
        return image


def respond(light, strength):
    """Gray 0 to 1 for light: a power of 1/2.2, bent into an S by the strength."""
    gray = np.power(light, 1 / 2.2)
    return gray + 0.5 * strength * gray * (1 - gray) * (2 * gray - 1) * 0.8


# ---------------------------------------------------------------------------------------- commands
def board_pose(rig, random, size):
    """As a person holds it: in the beam, whole in the picture, turned toward the camera."""
    projector, camera = sim.Lens(rig["projector"]), sim.Lens(rig["camera"])
    Tp, Tc = np.array(rig["T_world_projector"]), np.array(rig["T_world_camera"])
    for _ in range(4000):
        pixel = random.uniform(0.08, 0.92, 2) * (projector.w, projector.h)
        ray = Tp[:3, :3] @ projector.rays(pixel[:1], pixel[1:])[0]
        middle = Tp[:3, 3] + ray * random.uniform(1.05, 1.75)
        z = (Tp[:3, 3] + Tc[:3, 3]) / 2 - middle
        z /= np.linalg.norm(z)
        x = np.cross([0, 1.0, 0.2], z)
        x /= np.linalg.norm(x)
        tilt = random.uniform(-0.6, 0.6, 2)
        T = sim.pose(np.stack([x, np.cross(z, x), z], 1) @ sim.euler(*tilt, random.uniform(-0.4, 0.4)), middle)
        corners = np.array([[sx * size[0] / 2, sy * size[1] / 2, 0, 1] for sx in (-1, 1) for sy in (-1, 1)]) @ T.T
        inv = np.linalg.inv(Tc)
        seen = camera.project(corners[:, :3] @ inv[:3, :3].T + inv[:3, 3])
        with np.errstate(invalid="ignore"):
            whole = (seen > 5).all() and (seen < (camera.w - 5, camera.h - 5)).all()
        if whole and corners[:, 2].min() > 0.05:
            return T
    sys.exit("faulty_room: no pose of the board is in the beam and whole in the camera's picture; is it too large?")


def shaken(T, random, strength):
    """The board at four moments of an exposure."""
    shift, turn = random.normal(0, 1e-3 * strength / 1.7, 3), random.normal(0, 1e-3 * strength / 1.7, 3)
    return [T @ sim.pose(sim.euler(*(s * turn)), s * shift) for s in (-0.5, -0.17, 0.17, 0.5)]


def believed(camera, faults, random):
    """The camera_info of a camera, as good as its owner's."""
    d = dict(camera, K=list(camera["K"]), D=list(camera["D"]))
    by = faults.get("camera_info", 0)
    sign = random.choice([-1, 1], 4)
    for i in (0, 4):
        d["K"][i] *= 1 + 0.002 * by * sign[0]
    d["K"][2] += by * sign[1]
    d["K"][5] += by * sign[2]
    d["D"][0] += 0.01 * by * sign[3]
    d["K"], d["D"] = [float(x) for x in d["K"]], [float(x) for x in d["D"]]
    return sim.camera_info("camera", d)


def cmd_photographs(a):
    of_view = [strengths(text) for text in a.faults.split("/")]
    rig = sim.make_rig(a.seed, a.kind)
    with open(a.board) as file:
        layout = yaml.safe_load(file)
    picture = cv2.imread(os.path.join(os.path.dirname(a.board), layout["picture"]), cv2.IMREAD_GRAYSCALE)
    shown = cv2.imread(a.pattern, cv2.IMREAD_GRAYSCALE)
    random = np.random.default_rng(a.seed)
    room = Room(rig)
    if shown is None or picture is None or shown.shape != (room.lens.h, room.lens.w):
        size = f"{room.lens.w}x{room.lens.h}"
        sys.exit(f"faulty_room: cannot read the board's picture or {a.pattern}, or that is not {size}")
    os.makedirs(a.out, exist_ok=True)
    poses = [board_pose(rig, random, layout["size_m"]) for _ in range(a.views)]
    for i, T in enumerate(poses):
        faults = room.faults = of_view[i % len(of_view)]
        for suffix, image in (("", shown), ("_plain", np.full_like(shown, 160))):
            held = shaken(T, random, faults["motion"]) if "motion" in faults else [T]
            sheets = [Sheet(moment, layout["size_m"], picture.astype(float), faults, room) for moment in held]
            sent = Projector(room.lens, room.T_projector, image.astype(float), faults)
            cv2.imwrite(f"{a.out}/view_{i:02d}{suffix}.png", room.photograph(sheets, sent, random))
    with open(f"{a.out}/camera.yaml", "w") as file:
        yaml.safe_dump(believed(rig["camera"], of_view[0], random), file, sort_keys=False)
    with open(f"{a.out}/truth.yaml", "w") as file:
        yaml.safe_dump(dict(rig, faults=of_view, board_poses=[T.tolist() for T in poses]), file, sort_keys=False)
    print(f"{a.views} views in {a.out}")


def errors_mm(truth, projector, pose, distance):
    """Of light through the pixels of a grid, at a distance in front of the projector."""
    lens, T_world = sim.Lens(truth["projector"]), np.array(truth["T_world_projector"])
    camera, T_camera = sim.Lens(truth["camera"]), np.array(truth["T_world_camera"])
    found = sim.Lens(dict(width=projector["image_width"], height=projector["image_height"],
                          K=projector["camera_matrix"]["data"], D=projector["distortion_coefficients"]["data"]))
    T_found = np.linalg.inv(np.array(pose["T_camera_projector"], float).reshape(4, 4)) @ np.linalg.inv(T_camera)
    u, v = (g.ravel() for g in np.meshgrid(np.linspace(0, lens.w - 1, 65), np.linspace(0, lens.h - 1, 41)))
    world = distance * lens.rays(u, v) @ T_world[:3, :3].T + T_world[:3, 3]
    inv = np.linalg.inv(T_camera)
    seen = camera.project(world @ inv[:3, :3].T + inv[:3, 3])
    with np.errstate(invalid="ignore"):
        ok = (seen > 20).all(1) & (seen < (camera.w - 20, camera.h - 20)).all(1)
    sent = found.project(world[ok] @ T_found[:3, :3].T + T_found[:3, 3])
    px = np.linalg.norm(sent - np.stack([u, v], 1)[ok], axis=1)
    return np.where(np.isfinite(px), px, 1e4) * distance / lens.K[0, 0] * 1000


def cmd_judge(a):
    truth, projector, pose = (yaml.safe_load(open(path)) for path in (a.truth, a.projector, a.pose))
    for distance in (1.0, 2.0, 3.0):
        print(f"{distance:.0f} m: p95 {np.percentile(errors_mm(truth, projector, pose, distance), 95):.4f} mm")


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    sub = p.add_subparsers(required=True)
    sub.add_parser("list").set_defaults(f=lambda a: print("\n".join(f"{k:12} {v}" for k, v in FAULTS.items())))
    q = sub.add_parser("photographs")
    q.set_defaults(f=cmd_photographs)
    for name in ("--board", "--pattern", "--out"):
        q.add_argument(name, required=True)
    q.add_argument("--kind", default="standard", choices=["standard", "lens_shift", "wide", "short_throw"])
    q.add_argument("--seed", type=int, default=1)
    q.add_argument("--views", type=int, default=16)
    q.add_argument("--faults", default="none",
                   help="names and strengths, as in sag,jpeg=2; or together; one/other: of each view in turn")
    q = sub.add_parser("judge")
    q.set_defaults(f=cmd_judge)
    for name in ("--truth", "--projector", "--pose"):
        q.add_argument(name, required=True)
    a = p.parse_args()
    a.f(a)


if __name__ == "__main__":
    main()
