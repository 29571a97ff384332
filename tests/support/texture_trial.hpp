/// \file
/// A robot's projector and camera over a floor that is not even (textured_room.hpp), for
/// calibrating its texture and judging what is sent by it.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "calib/color/color.hpp"
#include "calib/color/texture.hpp"
#include "calib/lens.hpp"
#include "render/scene/image.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/textured_room.hpp"

namespace afterglow::test {

constexpr double kEye = 0.002;  // m: as fine as somebody who stands there sees

inline calib::Lens lensOf(const RoomOptics& optics) {
  return lens(optics.width, optics.height, optics.f, optics.cx, optics.cy,
              {optics.k1, optics.k2, 0, 0, 0});
}

/// A projector 1.5 m over the floor that looks ahead, as a robot carries it, and a camera beside.
/// `scale`: of their pictures' 1280 x 800 and 960 x 720 pixels.
inline TexturedRoom roomWith(RoomSurface surface, double scale = 1) {
  TexturedRoom room(surface);
  room.projector = {
      1280, 800,   1700, 640,
      420,  -0.05, 0.01, lookAt<World>({0, 0, 1.5}, {0.55, 0.05, 0}).matrix().inverse()};
  room.camera = {
      960, 720,   860,  484,
      356, -0.12, 0.03, lookAt<World>({-0.05, 0.25, 1.45}, {0.55, 0, 0}).matrix().inverse()};
  for (RoomOptics* optics : {&room.projector, &room.camera}) {
    optics->width = static_cast<int>(scale * optics->width);
    optics->height = static_cast<int>(scale * optics->height);
    for (double* length : {&optics->f, &optics->cx, &optics->cy}) *length *= scale;
  }
  const auto middle =
      room.projector.placeOf(room.projector.width / 2.0, room.projector.height / 2.0);
  room.unit = room.projector.irradiance({middle->x(), middle->y(), 0});
  return room;
}

/// 0.3 m and 20 degrees, round an axis that turns and tilts it.
inline void moveProjector(TexturedRoom& room) {
  Eigen::Isometry3d T = room.projector.T_optical_surface.inverse();
  const Eigen::Vector3d way = Eigen::Vector3d(-0.12, 0.24, 0.134).normalized();
  T.pretranslate(0.3 * way);
  const Eigen::AngleAxisd turn(20 * M_PI / 180, Eigen::Vector3d(0.35, 0.15, 0.9).normalized());
  T.linear() = T.linear() * turn.toRotationMatrix();
  room.projector.T_optical_surface = T.inverse();
}

struct Verdict {
  std::vector<double> off;
  double reachable = 0;
  double median() { return at(0.5); }
  double p95() { return at(0.95); }

 private:
  double at(double share) {
    std::sort(off.begin(), off.end());
    return off.empty() ? 1e9
                       : off[static_cast<std::size_t>(share * static_cast<double>(off.size() - 1))];
  }
};

inline Eigen::Vector3d lightAsked(const calib::Rgb& color) {
  return {refereeDecode(color[0] / 255.0), refereeDecode(color[1] / 255.0),
          refereeDecode(color[2] / 255.0)};
}

/// The light of white, by half of the places of a picture of one color.
inline double medianWhite(const TexturedRoom& room, const calib::Rgb& color,
                          const render::Image& sent) {
  const auto luminance = [](const Eigen::Vector3d& light) {
    return 0.2126 * light.x() + 0.7152 * light.y() + 0.0722 * light.z();
  };
  std::vector<double> whites;
  for (int i = 0; i < 400; ++i) {
    const auto place = room.projector.placeOf((i % 20 + 0.5) / 20 * room.projector.width,
                                              (i / 20 + 0.5) / 20 * room.projector.height);
    whites.push_back(luminance(room.seenAround(*place, kEye, sent.rgb)) /
                     luminance(lightAsked(color)));
  }
  std::sort(whites.begin(), whites.end());
  return whites[whites.size() / 2];
}

/// By places all over the light where `texture` is known and the color asked for can be reached,
/// white being `white`.
inline Verdict judge(const TexturedRoom& room, const calib::SurfaceTexture& texture, double white,
                     const calib::Rgb& color, const render::Image& sent, double reach_white) {
  Verdict verdict;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> along(0, 1);
  int looked = 0;
  for (int i = 0; i < 600; ++i) {
    const auto place = room.projector.placeOf(3 + along(random) * (room.projector.width - 7),
                                              3 + along(random) * (room.projector.height - 7));
    if (!place) continue;
    const Eigen::Vector2d cell = (*place - texture.origin) / texture.cell;
    const bool is_within =
        cell.minCoeff() >= 0 && cell.x() < texture.columns && cell.y() < texture.rows;
    if (!is_within || !texture.at(int(cell.x()), int(cell.y())).isKnown()) continue;
    ++looked;
    const TexturedRoom::Look look = room.lookAround(*place, kEye);
    const Eigen::Vector3d asked = lightAsked(color);
    const Eigen::Vector3d needed = look.M_seen_light.inverse() * (reach_white * asked - look.dark);
    if (needed.minCoeff() < TexturedRoom::lightOfValue(0) || needed.maxCoeff() > 1) continue;
    verdict.off.push_back(refereeDifference(
        refereeLab(asked), refereeLab(room.seenAround(*place, kEye, sent.rgb) / white)));
  }
  verdict.reachable = looked == 0 ? 0 : static_cast<double>(verdict.off.size()) / looked;
  return verdict;
}

}  // namespace afterglow::test
