/// \file
/// The way from the drawn image to the one that is sent to a projector: the projector's measured
/// response, colors or surfaces' textures, the limit of its light, its mirrors. GL-free.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/color/texture.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "render/scene/image.hpp"
#include "render/scene/scene.hpp"
#include "render/texture_light.hpp"

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
  /// Surfaces that are not even, by their names: other light goes by gamma or colors.
  std::vector<calib::SurfaceTexture> textures{};
};

/// The light of each pixel of one projector's image among several projectors' (light_blend.hpp),
/// row by row, before it is mirrored.
struct PixelLight {
  static constexpr int kFull = 65535;
  std::vector<std::uint16_t> share;  ///< factor on its light, of kFull; empty: 1 everywhere
  /// What is added to its light, of kFull, which is the projector's full light; empty: nothing.
  std::vector<std::uint16_t> raise;
};

/// Tables made once, for images of one projector. Black stays black, unless it is to be raised.
/// Throws std::invalid_argument for a table of colors of another size.
class LightOutput {
 public:
  /// For images that are not thrown on surfaces: textures are left out. `is_blended`: images may
  /// come with the light of their pixels.
  explicit LightOutput(const LightSettings& settings, bool is_blended = false);
  LightOutput(const LightSettings& settings, const calib::Lens& lens, bool is_blended = false);

  /// Changes the image in place; any thread. Settings that say nothing cost nothing. `light`: of an
  /// image that is blended with others. Throws std::logic_error for the light of another number of
  /// pixels, or where this is not for such images.
  void apply(Image& image, const PixelLight* light = nullptr) const;
  /// The same of an image for surfaces, drawn through the lens from this pose; from one thread at a
  /// time. Throws std::logic_error for an image that is blended where a surface has a texture.
  void apply(Image& image, const std::vector<SurfacePatch>& surfaces,
             const Rigid<Projector, World>& T_projector_world, const PixelLight* light = nullptr);
  /// By textured surface, of the last image.
  std::vector<TextureReport> textureReports() const;

 private:
  void recolor(std::uint8_t* begin, std::uint8_t* end) const;
  /// Interpolates between the eight colors of the table around the pixel's.
  void recolor(std::uint8_t* pixel) const;
  void blend(Image& image, const PixelLight& light) const;
  template <typename Value>
  void mirror(Image& image, const Value& value) const;

  bool is_identity_;
  bool flips_columns_, flips_rows_;
  std::array<std::array<std::uint8_t, 256>, 3> tables_;
  std::array<std::uint16_t, 256> light_;  ///< light of a drawn value, of PixelLight::kFull
  /// The values to send for each light, by channel; empty: not for images that are blended.
  std::array<std::vector<std::uint8_t>, 3> sent_;
  std::vector<std::uint8_t> colors_;
  std::unique_ptr<TextureLight> textures_;
};

}  // namespace afterglow::render
