/// \file
/// The way from the drawn image to the one that is sent to a projector: the projector's measured
/// response or colors, the limit of its light, its mirrors. GL-free.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/scene/image.hpp"

namespace afterglow::render {

/// Horizontal swaps left and right, Vertical top and bottom, Both is half a turn.
enum class Mirror { None, Horizontal, Vertical, Both };
/// The names in the enum's order.
inline const std::vector<std::string> kMirrorNames = {"none", "horizontal", "vertical", "both"};

/// The differences between a projector and one that shows sRGB upright and in full light.
///
/// A mirror and calibration: the lens and everything else that is calibrated describe the image
/// *before* it is mirrored here, since no lens and pose can describe a reflection. So calibrate
/// with the same mirror (calibrator_node's ~mirror): the thrown tags are then upright on the wall.
/// Where the projector's own menu mirrors (rear or ceiling projection), no mirror is needed here.
struct LightSettings {
  /// Measured response of red, green and blue: light = (value / 255)^gamma. Absent: sRGB's curve.
  std::optional<std::array<double, 3>> gamma;
  /// Share of its full light that white gets, in (linear) light; all else dims in proportion.
  double max_brightness = 1;
  Mirror mirror = Mirror::None;
  /// The values to send for colors (calib::colorTable), with gamma and limit of light in it; empty:
  /// as drawn.
  std::vector<std::uint8_t> colors{};
};

/// Tables made once, for images of one projector. Any thread; black stays black. Throws
/// std::invalid_argument for a table of colors of another size.
class LightOutput {
 public:
  explicit LightOutput(const LightSettings& settings);
  /// Changes the image in place, in one pass. Settings that say nothing cost nothing.
  void apply(Image& image) const;

 private:
  /// Gives both pixels their new values, each in the other's place. They may be one and the same.
  void exchange(std::uint8_t* a, std::uint8_t* b) const;
  void recolor(Image& image) const;
  /// Interpolates between the eight colors of the table around the pixel's.
  void recolor(std::uint8_t* pixel) const;

  bool is_identity_;
  bool flips_columns_, flips_rows_;
  std::array<std::array<std::uint8_t, 256>, 3> tables_;
  std::vector<std::uint8_t> colors_;
};

}  // namespace afterglow::render
