#!/usr/bin/env python3
"""Photographs for a calibration by a physically based renderer (Mitsuba 3), and the truth beside them.

  photoreal.py --board board.yaml --pattern pattern.png --out DIR [--seed 1] [--views 16] [--samples 24] [--gloss 0.15]

What tests/referee/ leaves out: light that walls, floor and ceiling send back, glossy paper, depth of field, a
projector's square pixels, sRGB's curve. Camera and projector are those of procam_sim.py's standard rig, without
distortion, which the renderer has not. Writes view_NN.png, view_NN_plain.png, camera.yaml and truth.yaml, which
`faulty_room.py judge` takes. Run by hand, about half a minute a view on two cores; needs `pip
install mitsuba pyyaml opencv-python-headless` from PyPI, and DRJIT_LIBLLVM_PATH, the path of LLVM's library (Debian's
libllvm19; 15 fails).
"""
import argparse
import os
import sys

import cv2
import mitsuba as mi
import numpy as np
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "referee"))
import faulty_room  # noqa: E402
import procam_sim as sim  # noqa: E402

mi.set_variant("llvm_ad_mono")
APERTURE_M, FOCUS_M = 0.0015, 1.4
# Its x points left and its y up.
FROM_OPTICAL = np.diag([-1.0, -1.0, 1.0, 1.0])


def centered(lens):
    """Makes the principal point one that a symmetric picture can have, and the pixels square. Width, height of that
    picture, and where the lens's begins in it."""
    size, begin = [], []
    for i, extent in enumerate((lens["width"], lens["height"])):
        center = round(lens["K"][2 + 3 * i])  # pixels' centers are whole numbers
        lens["K"][2 + 3 * i] = float(center)
        before = max(0, extent - 1 - 2 * center)
        begin.append(before)
        size.append(2 * (before + center) + 1)
    lens["K"][4] = lens["K"][0]
    lens["D"] = [0.0] * len(lens["D"])
    return size, begin


def transform(T):
    return mi.ScalarTransform4f(T)


def field_of_view(lens, width):
    return float(np.degrees(2 * np.arctan(width / (2 * lens["K"][0]))))


class Studio:
    def __init__(self, rig, options):
        self.rig, self.options = rig, options
        self.camera_size, self.camera_begin = centered(rig["camera"])
        self.projector_size, self.projector_begin = centered(rig["projector"])
        layout = yaml.safe_load(open(options.board))
        self.board_size = layout["size_m"]
        path = os.path.join(os.path.dirname(os.path.abspath(options.board)), layout["picture"])
        # From below: there the renderer's texture coordinates begin.
        self.board_picture = np.ascontiguousarray(np.flipud(cv2.imread(path, cv2.IMREAD_GRAYSCALE))[:, :, None])

    def sensor(self):
        camera, (width, height), (left, top) = self.rig["camera"], self.camera_size, self.camera_begin
        return {
            "type": "thinlens", "fov": field_of_view(camera, width), "fov_axis": "x",
            "aperture_radius": APERTURE_M, "focus_distance": FOCUS_M,
            "to_world": transform(np.array(self.rig["T_world_camera"]) @ FROM_OPTICAL),
            "sampler": {"type": "independent"},
            "film": {"type": "hdrfilm", "width": width, "height": height, "crop_offset_x": left, "crop_offset_y": top,
                     "crop_width": camera["width"], "crop_height": camera["height"], "pixel_format": "luminance",
                     "rfilter": {"type": "gaussian", "stddev": 0.5}}}

    def projector(self, shown):
        lens, (width, height), (left, top) = self.rig["projector"], self.projector_size, self.projector_begin
        light = np.zeros((height, width, 3), np.float32)
        inside = np.power(shown / 255.0, 2.2)[:height - top, :width - left, None]
        light[top:top + inside.shape[0], left:left + inside.shape[1]] = inside
        return {"type": "projector", "fov": field_of_view(lens, width), "fov_axis": "x", "scale": 12.0,
                "to_world": transform(np.array(self.rig["T_world_projector"]) @ FROM_OPTICAL),
                "irradiance": {"type": "bitmap", "bitmap": mi.Bitmap(light), "raw": True, "filter_type": "nearest"}}

    def room(self):
        def wall(at, normal, size, reflectance, light=None):
            shape = {"type": "rectangle", "bsdf": {"type": "twosided", "bsdf": {
                "type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}},
                "to_world": mi.ScalarTransform4f().look_at(at, list(np.add(at, normal)), [0.01, 1, 0.02]) @
                mi.ScalarTransform4f().scale([size, size, 1])}
            if light:
                shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": light}}
            return shape
        return {"floor": wall([0, 0, 0], [0, 0, 1], 4, 0.35), "ceiling": wall([0, 0, 3], [0, 0, -1], 4, 0.8),
                "back": wall([0, 4, 1], [0, -1, 0], 4, 0.7), "left": wall([-2.5, 0, 1], [1, 0, 0], 4, 0.6),
                "lamp": wall([0.8, 0.6, 2.9], [0, 0, -1], 0.4, 0.2, 30.0)}

    def sheet(self, T):
        paper = {"type": "roughplastic", "alpha": self.options.gloss, "nonlinear": True,
                 "diffuse_reflectance": {"type": "bitmap", "bitmap": mi.Bitmap(self.board_picture)}}
        half = [self.board_size[0] / 2, self.board_size[1] / 2, 1]
        return {"type": "rectangle", "to_world": transform(T) @ mi.ScalarTransform4f().scale(half),
                "bsdf": {"type": "twosided", "bsdf": paper}}

    def photograph(self, T, shown, seed):
        scene = dict(self.room(), type="scene", sheet=self.sheet(T), sensor=self.sensor(),
                     projector=self.projector(shown), integrator={"type": "path", "max_depth": 6})
        light = np.array(mi.render(mi.load_dict(scene), spp=self.options.samples, seed=seed))[:, :, 0]
        return np.clip(light * 0.85 / np.percentile(light, 99.5), 0, 1)


def srgb(light, random):
    gray = np.where(light < 0.0031308, 12.92 * light, 1.055 * np.power(np.maximum(light, 1e-9), 1 / 2.4) - 0.055)
    return np.clip(255 * gray + random.normal(0, 1.5, gray.shape), 0, 255).round().astype(np.uint8)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    for name in ("--board", "--pattern", "--out"):
        parser.add_argument(name, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--views", type=int, default=16)
    parser.add_argument("--samples", type=int, default=24, help="paths a pixel")
    parser.add_argument("--gloss", type=float, default=0.15, help="roughness of the paper; 0.05 mirrors, 0.4 is matt")
    options = parser.parse_args()
    rig, random = sim.make_rig(options.seed, "standard"), np.random.default_rng(options.seed)
    studio = Studio(rig, options)
    shown = cv2.imread(options.pattern, cv2.IMREAD_GRAYSCALE)
    os.makedirs(options.out, exist_ok=True)
    for i in range(options.views):
        T = faulty_room.board_pose(rig, random, studio.board_size)
        for suffix, image in (("", shown), ("_plain", np.full_like(shown, 160))):
            picture = srgb(studio.photograph(T, image, 2 * i + bool(suffix)), random)
            cv2.imwrite(f"{options.out}/view_{i:02d}{suffix}.png", picture)
        print(f"view {i}", flush=True)
    with open(f"{options.out}/camera.yaml", "w") as file:
        yaml.safe_dump(sim.camera_info("camera", rig["camera"]), file, sort_keys=False)
    with open(f"{options.out}/truth.yaml", "w") as file:
        yaml.safe_dump(rig, file, sort_keys=False)


if __name__ == "__main__":
    main()
