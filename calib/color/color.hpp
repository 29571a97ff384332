/// \file
/// The looks of a projector's colors on a surface, seen by a camera: measured, and turned round
/// into the values to send so that a color asked for is the color seen.
///
/// The camera's RGB is taken for sRGB: what it calls white is white, and its curve is sRGB's. Light
/// is linear, 1 the camera's full scale.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::calib {

class YamlSource;

/// IEC 61966-2-1: the light of a coded value, 0 to 1, and back. Beyond 0 to 1 the curve goes on.
double lightOfSrgb(double coded);
double srgbOfLight(double light);

/// CIELAB of linear sRGB, its white being (1, 1, 1): CIE 15, D65.
Eigen::Vector3d labOf(const Eigen::Vector3d& light);

/// CIEDE2000 with all weights 1. Source: Sharma, Wu, Dalal, "The CIEDE2000 color-difference
/// formula: implementation notes, supplementary test data, and mathematical observations", Color
/// Research and Application 30 (2005). About 1 is just seen side by side.
double colorDifference(const Eigen::Vector3d& lab_a, const Eigen::Vector3d& lab_b);

using Rgb = std::array<std::uint8_t, 3>;

/// Linear light of sRGB.
Eigen::Vector3d lightOf(const Rgb& color);

/// A photograph: the color that the whole picture had, and how the surface then looked.
struct ColorSample {
  Rgb shown{};
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();
};

/// Returns the brightest gray that can be reached where the light for a color is M_light_seen *
/// seen
/// - in_dark, and each channel's goes from 0 to `most`. 0: there is none.
double brightestGray(const Eigen::Matrix3d& M_light_seen, const Eigen::Vector3d& in_dark,
                     double most = 1);

/// seen = dark + M_seen_light * (response of red, green, blue).
struct ColorResponse {
  std::vector<double> levels;                   ///< 0 to 255, ascending, with both
  std::array<std::vector<double>, 3> response;  ///< response at each level, 0 to 1, rising
  /// The mixing matrix, the surface's color included.
  Eigen::Matrix3d M_seen_light = Eigen::Matrix3d::Identity();
  Eigen::Vector3d dark = Eigen::Vector3d::Zero();  ///< the room's light, and the projector's black

  /// Returns each channel's light, 0 to 1, for these values.
  Eigen::Vector3d light(const Rgb& sent) const;
  Eigen::Vector3d seen(const Rgb& sent) const { return dark + M_seen_light * light(sent); }
  /// Returns, channel by channel, the values to send for `count` lights, evenly from 0 to 1.
  std::array<std::vector<std::uint8_t>, 3> valuesToSend(int count) const;
  /// The brightest gray that can be reached: what white (1, 1, 1) is shown as. 0: there is none.
  double white() const;
  /// The share of the projector's full light, by luminance, that white() takes.
  double whiteShare() const;
};

/// The color to send for a color, and how far off (CIEDE2000, beside white()) the result looks.
struct SentColor {
  Rgb sent{};
  double off = 0;
};

/// `wanted` is sRGB, dimmed to this share of its light. What cannot be reached is clipped, or made
/// paler at its lightness, whichever looks nearer. Black is no light at all, whatever the room.
SentColor colorToSend(const ColorResponse& response, const Rgb& wanted, double brightness = 1);

/// A difference that is seen when looked for: what is farther off is out of reach.
constexpr double kReachedDifference = 2;

/// Red changes fastest; what to send for colors of equal steps from 0 to 255, this many a channel.
constexpr int kColorTableSide = 33;
std::vector<std::uint8_t> colorTable(const ColorResponse& response, double brightness = 1);

/// A measurement that cannot be used; what() says why, and what to do.
class ColorRefused : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ColorReach {
  std::string name;
  SentColor color;
};

struct ColorFit {
  ColorResponse response;
  /// CIEDE2000 between what the response expects and what was seen, of photographs that it was not
  /// fitted to: median, and the worst; NaN without any.
  double check_median = std::numeric_limits<double>::quiet_NaN(), check_worst = check_median;
  int checks = 0;
  std::array<double, 3> gamma{};   ///< the power that is nearest to each channel's response
  std::vector<ColorReach> named;   ///< red, green, ... and how far off they are
  double share_reached = 0;        ///< share of sRGB's cube within reach
};

/// Returns the colors to photograph: black, ramps of each channel, grays and mixtures to check
/// with; black and white once more at the end, to see whether the camera adapts.
std::vector<Rgb> colorsToShow();

/// Returns true for a color that is not fitted to, but checked: it mixes channels, in other shares
/// than white does.
bool isCheck(const Rgb& color);
/// A sentence about the checks: their median, and how far off `most` of them are ("95 %").
std::string checksText(int checks, double median, const std::string& most, double off);

/// Fits black, white and three levels of each channel alone (255 among them). Throws ColorRefused:
/// missing colors, a color seen twice that differs (the camera adapts), a camera that is over- or
/// underexposed, a channel without light, channels that do not add up to white (a projector that
/// mixes light in).
ColorFit fitColor(const std::vector<ColorSample>& samples);

std::string colorYaml(const ColorFit& fit);
/// Throws std::runtime_error "FILE:LINE: what is wrong".
ColorResponse loadColor(const std::string& path);

/// The same as a part of a file that has other keys, too.
std::string responseYaml(const ColorResponse& response);
ColorResponse readResponse(const YamlSource& file, const std::string& what,
                           const std::vector<std::string>& other_keys);

}  // namespace afterglow::calib
