"""A projector calibrated with OpenCV alone: tests/bench/peers sets it beside `afterglow calibrate`.

    opencv_calibration.py PHOTOGRAPHS BOARD.yaml PATTERN.yaml CAMERA.yaml OUT

The printed tags give each view's homography from photograph to board; it puts the corners of the
tags that are projected on the board where they lie there, calibrateCamera finds the projector's
lens from them, and stereoCalibrate where it stands. The camera is held as CAMERA.yaml has it, which
for the referee's photographs is the truth. Writes OUT/projector.yaml and
OUT/T_camera_projector.yaml as the referee reads them.
"""
import glob
import os
import sys

import cv2
import numpy
import yaml

LEAST_TAGS = 4
# Of corners that OpenCV 4.6 refines as AprilTag does; uncorrected the result is twice as far off.
OFF_PX = 0.5


def read(path):
    with open(path) as file:
        return yaml.safe_load(file)


def corners_of(target):
    """{id: 4 x 2}: meters on a board, pixels of a pattern."""
    return {tag["id"]: numpy.array(tag["corners"], float)[:, :2] for tag in target["tags"]}


class Finder:
    def __init__(self):
        self.dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self.how = cv2.aruco.DetectorParameters_create()
        self.how.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG

    def find(self, path):
        """{id: 4 x 2 pixels}, in whatever order OpenCV has a tag's corners."""
        picture = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        corners, ids, _ = cv2.aruco.detectMarkers(picture, self.dictionary, parameters=self.how)
        return {} if ids is None else {
            int(i[0]): c[0].astype(float) - OFF_PX for i, c in zip(ids, corners)
        }


def pairs(seen, known, turn):
    """Seen corners and where they belong, for the tags that are in both."""
    both = sorted(set(seen) & set(known))
    if not both:
        return numpy.zeros((0, 2)), numpy.zeros((0, 2))
    return (numpy.concatenate([numpy.roll(seen[i], turn, axis=0) for i in both]),
            numpy.concatenate([known[i] for i in both]))


def turn_of(view, board):
    """By how many places OpenCV's order of corners is turned: the one that fits a plane."""
    def misfit(turn):
        seen, on_board = pairs(view, board, turn)
        H, _ = cv2.findHomography(seen, on_board)
        return numpy.abs(cv2.perspectiveTransform(seen[:, None], H)[:, 0] - on_board).mean()

    return min(range(4), key=misfit)


def view_points(plain, shown, board, pattern, K, D, turn, half_size):
    """Of a pose: points on the board (n x 3), in the photograph and in the projector's picture.

    None: too few. What falls beside the board, on the wall behind it, is left out."""
    straight = lambda pixels: cv2.undistortPoints(pixels[:, None], K, D, P=K)[:, 0]
    printed, on_board = pairs(plain, board, turn)
    projected, in_picture = pairs(shown, pattern, turn)
    if len(printed) < 4 * LEAST_TAGS or len(projected) < 4 * LEAST_TAGS:
        return None
    H, _ = cv2.findHomography(straight(printed), on_board, cv2.RANSAC, 0.001)
    flat = cv2.perspectiveTransform(straight(projected)[:, None], H)[:, 0]
    is_on = (numpy.abs(flat) < half_size).all(axis=1).reshape(-1, 4).all(axis=1).repeat(4)
    if is_on.sum() < 4 * LEAST_TAGS:
        return None
    as_float = lambda array: numpy.ascontiguousarray(array[is_on], numpy.float32)
    return (as_float(numpy.hstack([flat, numpy.zeros(
        (len(flat), 1))])), as_float(projected), as_float(in_picture))


def calibrate(folder, board, pattern, camera):
    K = numpy.array(camera["camera_matrix"]["data"], float).reshape(3, 3)
    D = numpy.array(camera["distortion_coefficients"]["data"], float)
    finder, known, shown_at = Finder(), corners_of(board), corners_of(pattern)
    half_size = numpy.array(board["size_m"]) / 2
    views, turn = [], None
    for plain in sorted(glob.glob(f"{folder}/view_*_plain.png")):
        seen = finder.find(plain)
        if len(set(seen) & set(known)) < LEAST_TAGS:
            continue
        turn = turn_of(seen, known) if turn is None else turn
        shown = finder.find(plain.replace("_plain", ""))
        points = view_points(seen, shown, known, shown_at, K, D, turn, half_size)
        views += [points] if points else []
    on_board, in_photograph, in_picture = (list(column) for column in zip(*views))
    size = (pattern["width"], pattern["height"])
    _, K_p, D_p, _, _ = cv2.calibrateCamera(on_board, in_picture, size, None, None)
    rms, _, _, K_p, D_p, R, t, _, _ = cv2.stereoCalibrate(on_board,
                                                          in_photograph,
                                                          in_picture,
                                                          K,
                                                          D,
                                                          K_p,
                                                          D_p,
                                                          size,
                                                          flags=cv2.CALIB_FIX_INTRINSIC)
    T_projector_camera = numpy.vstack([numpy.hstack([R, t]), [0, 0, 0, 1]])
    return K_p, D_p, numpy.linalg.inv(T_projector_camera), rms, len(views)


def write(out, size, K, D, T_camera_projector):
    os.makedirs(out, exist_ok=True)
    P = numpy.hstack([K, numpy.zeros((3, 1))])
    info = {
        "image_width": size[0],
        "image_height": size[1],
        "camera_name": "projector",
        "distortion_model": "plumb_bob",
        "camera_matrix": {
            "rows": 3,
            "cols": 3,
            "data": K.flatten().tolist()
        },
        "distortion_coefficients": {
            "rows": 1,
            "cols": 5,
            "data": D.flatten()[:5].tolist()
        },
        "rectification_matrix": {
            "rows": 3,
            "cols": 3,
            "data": numpy.eye(3).flatten().tolist()
        },
        "projection_matrix": {
            "rows": 3,
            "cols": 4,
            "data": P.flatten().tolist()
        }
    }
    with open(f"{out}/projector.yaml", "w") as file:
        yaml.safe_dump(info, file)
    with open(f"{out}/T_camera_projector.yaml", "w") as file:
        yaml.safe_dump({"T_camera_projector": T_camera_projector.tolist()}, file)


def main():
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    folder, board, pattern, camera, out = sys.argv[1:]
    pattern = read(pattern)
    K, D, T, rms, count = calibrate(folder, read(board), pattern, read(camera))
    write(out, (pattern["width"], pattern["height"]), K, D, T)
    print(f"{count} views, {rms:.3f} px (stereo RMS)")


if __name__ == "__main__":
    main()
