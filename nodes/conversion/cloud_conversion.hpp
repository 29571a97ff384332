/// \file
/// sensor_msgs/PointCloud2 -> a point cloud to draw. Semantics: RViz 1.14 (point_cloud_common.cpp,
/// point_cloud_transformers.cpp); stricter about sizes, and it honors row_step and is_bigendian,
/// which RViz does not.
///
/// The fields of a PointCloud2: found by name, checked to lie inside a point, read as numbers.
///
/// Colors made from the values in a message. Semantics: RViz 1.14,
/// point_cloud_transformers.cpp.
///
/// sensor_msgs/LaserScan -> a point cloud to draw, as RViz's laser scan display does.
#pragma once

#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/compose/workers.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

enum class ColorSource { Flat, Rgb8, Mono8, RgbF32, Intensity, AxisX, AxisY, AxisZ };

/// The colors of numbers. With equal bounds all get the color of the lower bound.
struct ColorScale {
  bool rainbow = true;
  bool invert = false;                                    ///< the rainbow begins with magenta
  render::Color least{0, 0, 0, 1}, greatest{1, 1, 1, 1};  ///< bounds without the rainbow
  /// The values at the ends of the scale; empty: the least and the greatest of each message.
  std::optional<std::array<double, 2>> bounds;
};

/// Red at 0 over yellow, green, cyan and blue to magenta at 1 (hue 0 to 300 degrees).
render::Color rainbow(double share);

/// Returns a color for each value. Values that are not finite get the color of the lower bound.
render::ColorList colorsOf(const std::vector<double>& values, const ColorScale& scale);

/// The same brightness without hue: MONO8.
render::Color gray(const render::Color& color);

/// Axis 0, 1 or 2 of an Axis source.
int axisOf(ColorSource source);
bool isAxis(ColorSource source);

/// The coordinate that gives a cloud its colors.
struct AxisColor {
  int axis = 2;
  ColorScale scale;
};

/// Replaces the cloud's colors by those of its points' coordinates in the fixed frame.
void colorByAxis(render::PointCloud& cloud, const AxisColor& color,
                 const Eigen::Isometry3d& T_fixed_cloud);

/// The look of a topic's points; from the configuration, not from the messages.
struct CloudStyle {
  render::PointStyle style = render::PointStyle::FlatSquares;
  float size = 0.01f;  ///< meters; for PointStyle::Points pixels
  ColorSource color = ColorSource::Flat;
  std::string channel = "intensity";  ///< the field of ColorSource::Intensity
  ColorScale scale = {};              ///< Intensity and axes
  bool axis_of_fixed_frame = true;    ///< else of the cloud's own frame
};

/// The most points of one message that are drawn; of a larger cloud every second, third, ...
constexpr std::size_t kMostCloudPoints = std::size_t{1} << 20;

/// Points in the frame of the message's header. Those that are not finite or absurdly far are left
/// out. Fields are found by name (FieldFinder): x, y, z as FLOAT32 or FLOAT64; rgb or rgba (with
/// alpha) as FLOAT32, INT32 or UINT32 for Rgb8 and Mono8; r, g, b as FLOAT32 or FLOAT64, 0 to 1,
/// for RgbF32; the channel ("intensity" may be "intensities") of any number type for Intensity. A
/// cloud without points is a value without points, whatever its fields: it clears the layer. Axis
/// colors are made later, when the cloud's place is known (colorByAxis). Refused: sizes that
/// do not fit the data, missing fields and types other than these. Remarks: longer data, odd
/// fields, more points than kMostCloudPoints. Workers share the reading of many points; without
/// them this thread reads all. Pure; throws never.
Converted<render::PointCloud> toPointCloud(const sensor_msgs::PointCloud2& message,
                                           const CloudStyle& style,
                                           render::Workers* workers = nullptr);

/// A field's place within a point, known to lie inside it.
class FieldReader {
 public:
  FieldReader(const sensor_msgs::PointField& field, bool big_endian)
      : offset_(field.offset), datatype_(field.datatype), swap_(big_endian) {}

  /// Returns true if the bytes at offset() are a float as this machine has it.
  bool isPlainFloat() const { return datatype_ == sensor_msgs::PointField::FLOAT32 && !swap_; }
  bool isSwapped() const { return swap_; }
  std::size_t offset() const { return offset_; }

  /// The four bytes as they are: packed colors are bits, even where the field says FLOAT32.
  std::uint32_t bits(const std::uint8_t* point) const { return load<std::uint32_t>(point); }
  double number(const std::uint8_t* point) const;

 private:
  template <typename T>
  T load(const std::uint8_t* point) const {
    std::array<std::uint8_t, sizeof(T)> bytes;
    std::memcpy(bytes.data(), point + offset_, sizeof(T));
    if (swap_) std::reverse(bytes.begin(), bytes.end());
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }

  std::size_t offset_;
  std::uint8_t datatype_;
  bool swap_;
};

/// Finds fields and keeps their faults and remarks. Of several fields of one name the first counts,
/// and of a field of several numbers the first number; both are remarks.
class FieldFinder {
 public:
  explicit FieldFinder(const sensor_msgs::PointCloud2& message) : message_(message) {}

  /// The field of the first of these names that exists. Empty, with fault(), if none exists, its
  /// type is not one of `datatypes`, or it lies beyond the point.
  std::optional<FieldReader> find(const std::vector<std::string>& names,
                                  const std::vector<std::uint8_t>& datatypes);
  bool has(const std::string& name) const { return look(name) != nullptr; }

  const std::string& fault() const { return fault_; }
  const std::string& remarks() const { return remarks_; }  ///< separated by "; "

 private:
  const sensor_msgs::PointField* look(const std::string& name) const;
  void remark(const std::string& text) { remarks_ += (remarks_.empty() ? "" : "; ") + text; }

  const sensor_msgs::PointCloud2& message_;
  std::string fault_, remarks_;
};

extern const std::vector<std::uint8_t> kRealTypes, kPackedTypes, kNumberTypes;

/// The times at which the points of a scan were measured: a turning scanner measures ray after ray.
struct Sweep {
  std::vector<float> seconds;  ///< seconds after the stamp, for each point; empty: all at the stamp
  double last_s = 0;           ///< time of the last ray, whether it returned or not
};

struct ScanPoints {
  render::PointCloud cloud;
  Sweep sweep;
};

/// Points in the plane z = 0 of the scanner's frame, angles counter-clockwise from x. Ranges
/// outside [range_min, range_max] and those that are no numbers are left out; a scan without ranges
/// clears the layer. The points are as the scanner saw them, each at its own time (Sweep).
/// Refused: angles or limits that are no numbers, a time_increment that is no number or makes the
/// scan longer than tf remembers, more ranges than kMostCloudPoints; if colored by intensity,
/// another number of intensities than ranges. Pure; throws never.
Converted<ScanPoints> toScanPoints(const sensor_msgs::LaserScan& message, const CloudStyle& style);

}  // namespace afterglow::nodes
