#include "nodes/conversion/cloud_conversion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

std::array<double, 2> boundsOf(const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  return {least, greatest};
}

render::Color between(const render::Color& a, const render::Color& b, double share) {
  const auto s = static_cast<float>(share);
  return {a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b), 1};
}

}  // namespace

render::Color rainbow(double share) {
  const double hue = 5 * std::clamp(share, 0.0, 1.0);  // in sixths of the circle
  // Distance from red, green and blue on the hue circle of six; full within 1, none from 2.
  const auto channel = [hue](double at) {
    const double apart = std::abs(hue - at);
    return static_cast<float>(std::clamp(2 - std::min(apart, 6 - apart), 0.0, 1.0));
  };
  return {channel(0), channel(2), channel(4), 1};
}

render::ColorList colorsOf(const std::vector<double>& values, const ColorScale& scale) {
  const auto [least, greatest] = scale.bounds ? *scale.bounds : boundsOf(values);
  // Halves, so that the range of two huge values does not overflow.
  const double half_range = greatest / 2 - least / 2;
  render::ColorList colors;
  colors.reserve(values.size());
  for (const double value : values) {
    const bool placed = std::isfinite(value) && half_range > 0;
    const double share = placed ? std::clamp((value / 2 - least / 2) / half_range, 0.0, 1.0) : 0.0;
    colors.push_back(scale.rainbow ? rainbow(scale.invert ? 1 - share : share)
                                   : between(scale.least, scale.greatest, share));
  }
  return colors;
}

render::Color gray(const render::Color& color) {
  const float light = 0.2989f * color.r + 0.5870f * color.g + 0.1140f * color.b;
  return {light, light, light, color.a};
}

bool isAxis(ColorSource source) {
  return source == ColorSource::AxisX || source == ColorSource::AxisY ||
         source == ColorSource::AxisZ;
}

int axisOf(ColorSource source) {
  if (!isAxis(source)) throw std::logic_error("axisOf: this color source has no axis");
  return static_cast<int>(source) - static_cast<int>(ColorSource::AxisX);
}

void colorByAxis(render::PointCloud& cloud, const AxisColor& color,
                 const Eigen::Isometry3d& T_fixed_cloud) {
  const Eigen::RowVector3d row = T_fixed_cloud.linear().row(color.axis);
  const double origin = T_fixed_cloud.translation()[color.axis];
  std::vector<double> values;
  values.reserve(cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points.get()) {
    values.push_back(row.dot(point.cast<double>()) + origin);
  }
  cloud.colors = asBytes(colorsOf(values, color.scale));
}

namespace {

using sensor_msgs::PointCloud2;

/// Returns why the declared sizes do not fit the data, or empty. Divides, because products may
/// overflow.
std::string sizeFault(const PointCloud2& message) {
  const std::uint64_t rows = message.height, columns = message.width, size = message.data.size();
  if (message.point_step == 0) return "point_step is 0";
  const std::uint64_t row_size = columns * message.point_step;  // < 2^64
  if (rows > 1 && message.row_step < row_size) return "row_step is shorter than a row";
  if (row_size > size || (rows > 1 && rows - 1 > (size - row_size) / message.row_step)) {
    return "data is shorter than declared";
  }
  return {};
}

/// Remarks on sizes that fit.
std::string sizeRemark(const PointCloud2& message) {
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  const std::uint64_t declared = message.height == 1
                                     ? std::max<std::uint64_t>(row, message.row_step)
                                     : std::uint64_t{message.height} * message.row_step;
  if (std::uint64_t{message.width} * message.height > kMostCloudPoints) {
    return "too many points: some are left out";
  }
  return message.data.size() > declared ? "data is longer than declared" : "";
}

render::Rgba unpack(std::uint32_t bits, bool with_alpha) {
  const auto channel = [bits](int shift) { return static_cast<std::uint8_t>(bits >> shift); };
  return {channel(16), channel(8), channel(0), with_alpha ? channel(24) : std::uint8_t{255}};
}

/// The fields that are read of every point.
struct CloudFields {
  std::vector<FieldReader> xyz;
  std::vector<FieldReader> color;  ///< packed, three shares, a number, or empty
  bool with_alpha = false;
};

/// Reads the points of one message whose sizes and fields have been checked.
class CloudReader {
 public:
  CloudReader(const PointCloud2& message, const CloudStyle& style, CloudFields fields,
              render::Workers* workers)
      : message_(message), style_(style), fields_(std::move(fields)), workers_(workers) {
    is_plain_ = std::all_of(fields_.xyz.begin(), fields_.xyz.end(),
                            [](const FieldReader& field) { return field.isPlainFloat(); });
    is_packed_ = style.color == ColorSource::Rgb8 || style.color == ColorSource::Mono8;
  }

  render::PointCloud read() {
    const std::size_t all = std::size_t{message_.width} * message_.height;  // the data has as many
    const std::size_t stride = (all + kMostCloudPoints - 1) / kMostCloudPoints;
    points_.reserve(all / stride + 1);
    if (style_.color == ColorSource::Intensity) {
      values_.reserve(all / stride + 1);
    } else if (!fields_.color.empty()) {
      colors_.reserve(all / stride + 1);
    }
    if (stride == 1 && isForSeveral(all)) {
      addShared(all);
    } else {
      addRows(stride);
    }
    if (style_.color == ColorSource::Intensity) {
      colors_ = asBytes(colorsOf(values_, style_.scale));
    }
    if (style_.color == ColorSource::Mono8) {
      for (render::Rgba& color : colors_) color = asBytes(gray(asShares(color)));
    }
    render::PointCloud cloud;
    cloud.style = style_.style;
    cloud.size = style_.size;
    cloud.points = std::move(points_);
    cloud.colors = std::move(colors_);
    return cloud;
  }

 private:
  void addRows(std::size_t stride) {
    for (std::size_t row = 0; row < message_.height; ++row) {
      const std::size_t first = (stride - row * message_.width % stride) % stride;
      if (first >= message_.width) continue;
      const std::uint8_t* begin = message_.data.data() + row * message_.row_step;
      addRow(begin + first * message_.point_step, (message_.width - first - 1) / stride + 1,
             stride * message_.point_step);
    }
  }

  /// Many points, one after the other, in the layout of nearly all clouds.
  bool isForSeveral(std::size_t all) const {
    const bool has_gaps = message_.height > 1 &&
                          message_.row_step != std::uint64_t{message_.width} * message_.point_step;
    const bool is_usual = fields_.color.empty() || (is_packed_ && !fields_.color[0].isSwapped());
    return workers_ != nullptr && render::Workers::areMany(all) && is_plain_ && is_usual &&
           !has_gaps;
  }

  /// Adds in parts: each worker reads a part to where that would lie if no point were left out;
  /// then the gaps close.
  void addShared(std::size_t all) {
    struct Part {
      std::size_t begin = 0, used = 0;
    };
    const bool has_colors = !fields_.color.empty();
    points_.resize(all);
    if (has_colors) colors_.resize(all);
    std::vector<Part> parts(static_cast<std::size_t>(workers_->sharers(all)));
    workers_->share(all, [&](int worker, std::size_t first, std::size_t last) {
      const std::size_t count = last - first;
      const std::uint8_t* point = message_.data.data() + first * message_.point_step;
      const std::size_t used = has_colors ? readPacked(point, count, message_.point_step,
                                                       &points_[first], &colors_[first])
                                          : readPlain(point, count, message_.point_step,
                                                      &points_[first], [](const std::uint8_t*) {});
      parts[static_cast<std::size_t>(worker)] = {first, used};
    });
    std::size_t end = 0;
    const auto close = [&](auto& list, const Part& part) {
      const auto from = list.begin() + static_cast<std::ptrdiff_t>(part.begin);
      const auto to = list.begin() + static_cast<std::ptrdiff_t>(end);
      if (from != to) std::copy(from, from + static_cast<std::ptrdiff_t>(part.used), to);
    };
    for (const Part& part : parts) {
      close(points_, part);
      if (has_colors) close(colors_, part);
      end += part.used;
    }
    points_.resize(end);
    if (has_colors) colors_.resize(end);
  }

  void addRow(const std::uint8_t* point, std::size_t count, std::size_t step) {
    if (!is_plain_) return addOddPoints(point, count, step);
    if (fields_.color.empty()) {
      return addPlainPoints(point, count, step, [](const std::uint8_t*) {});
    }
    if (is_packed_ && !fields_.color[0].isSwapped()) return addPackedPoints(point, count, step);
    addPlainPoints(point, count, step, [this](const std::uint8_t* p) { addColor(p); });
  }

  void addOddPoints(const std::uint8_t* point, std::size_t count, std::size_t step) {
    const std::vector<FieldReader>& xyz = fields_.xyz;
    for (std::size_t i = 0; i < count; ++i, point += step) {
      const auto position =
          toVector(xyz[0].number(point), xyz[1].number(point), xyz[2].number(point));
      if (!position) continue;
      points_.push_back(*position);
      addColor(point);
    }
  }

  /// A fast loop for the layout of nearly all clouds, without a decision for every value. Returns
  /// how many points it has written.
  template <typename AddColor>
  std::size_t readPlain(const std::uint8_t* point, std::size_t count, std::size_t step,
                        Eigen::Vector3f* out, AddColor addColor) const {
    const std::size_t x_at = fields_.xyz[0].offset(), y_at = fields_.xyz[1].offset(),
                      z_at = fields_.xyz[2].offset();
    constexpr auto kLimit = static_cast<float>(kFarthest);
    Eigen::Vector3f* next = out;
    for (std::size_t i = 0; i < count; ++i, point += step) {
      float x, y, z;
      std::memcpy(&x, point + x_at, sizeof(x));
      std::memcpy(&y, point + y_at, sizeof(y));
      std::memcpy(&z, point + z_at, sizeof(z));
      // One branch instead of three; NaN fails, too.
      const int fits = static_cast<int>(std::abs(x) <= kLimit) &
                       static_cast<int>(std::abs(y) <= kLimit) &
                       static_cast<int>(std::abs(z) <= kLimit);
      if (fits == 0) continue;
      *next++ = Eigen::Vector3f(x, y, z);
      addColor(point);
    }
    return static_cast<std::size_t>(next - out);
  }

  /// The same with colors that a depth camera's driver has packed.
  std::size_t readPacked(const std::uint8_t* point, std::size_t count, std::size_t step,
                         Eigen::Vector3f* out, render::Rgba* next) const {
    const std::size_t at = fields_.color[0].offset();
    const bool with_alpha = fields_.with_alpha;
    return readPlain(point, count, step, out, [&next, at, with_alpha](const std::uint8_t* p) {
      std::uint32_t bits;
      std::memcpy(&bits, p + at, sizeof(bits));
      *next++ = unpack(bits, with_alpha);
    });
  }

  template <typename AddColor>
  void addPlainPoints(const std::uint8_t* point, std::size_t count, std::size_t step,
                      AddColor addColor) {
    const std::size_t before = points_.size();
    points_.resize(before + count);
    points_.resize(before + readPlain(point, count, step, points_.data() + before, addColor));
  }

  void addPackedPoints(const std::uint8_t* point, std::size_t count, std::size_t step) {
    const std::size_t before = points_.size();
    points_.resize(before + count);
    colors_.resize(before + count);
    const std::size_t used =
        readPacked(point, count, step, points_.data() + before, colors_.data() + before);
    points_.resize(before + used);
    colors_.resize(before + used);
  }

  void addColor(const std::uint8_t* point) {
    const std::vector<FieldReader>& color = fields_.color;
    if (is_packed_) {
      colors_.push_back(unpack(color[0].bits(point), fields_.with_alpha));
    } else if (style_.color == ColorSource::RgbF32) {
      const auto share = [&](std::size_t i) {
        const double value = color[i].number(point);
        return static_cast<float>(value > 0 ? std::min(value, 1.0) : 0);  // NaN is dark
      };
      colors_.push_back(asBytes(render::Color{share(0), share(1), share(2), 1}));
    } else if (style_.color == ColorSource::Intensity) {
      values_.push_back(color[0].number(point));
    }
  }

  const PointCloud2& message_;
  const CloudStyle& style_;
  CloudFields fields_;
  render::Workers* workers_;  ///< workers that share the reading; nullptr: this thread alone
  bool is_plain_ = false, is_packed_ = false;
  render::PointList points_;
  render::ByteColorList colors_;
  std::vector<double> values_;
};

/// Empty, with the finder's fault, if a field that is needed cannot be read.
std::optional<CloudFields> findFields(FieldFinder& finder, const CloudStyle& style) {
  CloudFields fields;
  for (const char* name : {"x", "y", "z"}) {
    const auto field = finder.find({name}, kRealTypes);
    if (!field) return std::nullopt;
    fields.xyz.push_back(*field);
  }
  std::vector<std::vector<std::string>> names;
  const std::vector<std::uint8_t>* types = &kPackedTypes;
  if (style.color == ColorSource::Rgb8 || style.color == ColorSource::Mono8) {
    names = {{"rgb", "rgba"}};
    fields.with_alpha = !finder.has("rgb");
  } else if (style.color == ColorSource::RgbF32) {
    names = {{"r"}, {"g"}, {"b"}};
    types = &kRealTypes;
  } else if (style.color == ColorSource::Intensity) {
    names = {{style.channel}};
    if (style.channel == "intensity") names[0].emplace_back("intensities");
    types = &kNumberTypes;
  }
  for (const auto& either : names) {
    const auto field = finder.find(either, *types);
    if (!field) return std::nullopt;
    fields.color.push_back(*field);
  }
  return fields;
}

}  // namespace

Converted<render::PointCloud> toPointCloud(const PointCloud2& message, const CloudStyle& style,
                                           render::Workers* workers) {
  using Result = render::PointCloud;
  if (message.width == 0 || message.height == 0) return {Result{}, {}};
  if (std::string fault = sizeFault(message); !fault.empty()) return refused<Result>(fault);
  FieldFinder finder(message);
  auto fields = findFields(finder, style);
  if (!fields) return refused<Result>(finder.fault());
  std::string remarks = sizeRemark(message);
  if (!finder.remarks().empty()) remarks += (remarks.empty() ? "" : "; ") + finder.remarks();
  return {CloudReader(message, style, std::move(*fields), workers).read(), remarks};
}

namespace {

using sensor_msgs::PointField;

std::size_t sizeOf(std::uint8_t datatype) {
  switch (datatype) {
    case PointField::INT8:
    case PointField::UINT8:
      return 1;
    case PointField::INT16:
    case PointField::UINT16:
      return 2;
    case PointField::FLOAT64:
      return 8;
    default:
      return 4;
  }
}

}  // namespace

const std::vector<std::uint8_t> kRealTypes = {PointField::FLOAT32, PointField::FLOAT64};
const std::vector<std::uint8_t> kPackedTypes = {PointField::FLOAT32, PointField::INT32,
                                                PointField::UINT32};
const std::vector<std::uint8_t> kNumberTypes = {
    PointField::INT8,  PointField::UINT8,  PointField::INT16,   PointField::UINT16,
    PointField::INT32, PointField::UINT32, PointField::FLOAT32, PointField::FLOAT64};

double FieldReader::number(const std::uint8_t* point) const {
  switch (datatype_) {
    case PointField::INT8:
      return load<std::int8_t>(point);
    case PointField::UINT8:
      return load<std::uint8_t>(point);
    case PointField::INT16:
      return load<std::int16_t>(point);
    case PointField::UINT16:
      return load<std::uint16_t>(point);
    case PointField::INT32:
      return load<std::int32_t>(point);
    case PointField::UINT32:
      return load<std::uint32_t>(point);
    case PointField::FLOAT32:
      return static_cast<double>(load<float>(point));
    case PointField::FLOAT64:
      return load<double>(point);
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

const PointField* FieldFinder::look(const std::string& name) const {
  const auto found = std::find_if(message_.fields.begin(), message_.fields.end(),
                                  [&name](const PointField& field) { return field.name == name; });
  return found == message_.fields.end() ? nullptr : &*found;
}

std::optional<FieldReader> FieldFinder::find(const std::vector<std::string>& names,
                                             const std::vector<std::uint8_t>& datatypes) {
  const auto name = std::find_if(names.begin(), names.end(),
                                 [this](const std::string& candidate) { return has(candidate); });
  const std::string quoted = "field '" + printable(name == names.end() ? names[0] : *name) + "'";
  if (name == names.end()) {
    fault_ = "no " + quoted;
    return std::nullopt;
  }
  const PointField& field = *look(*name);
  if (std::find(datatypes.begin(), datatypes.end(), field.datatype) == datatypes.end()) {
    fault_ = quoted + " is of another type than can be read";
    return std::nullopt;
  }
  if (std::uint64_t{field.offset} + sizeOf(field.datatype) > message_.point_step) {
    fault_ = quoted + " lies beyond the point";
    return std::nullopt;
  }
  const auto of_name = std::count_if(message_.fields.begin(), message_.fields.end(),
                                     [&name](const auto& other) { return other.name == *name; });
  if (of_name > 1) remark(quoted + " more than once: the first counts");
  if (field.count != 1) remark(quoted + " is not of one number: the first counts");
  return FieldReader(field, message_.is_bigendian != 0);
}

namespace {

constexpr double kLongestSweep = 10;  // s; tf2_ros remembers as much

/// An angle's or time's step from ray to ray; a single ray has none.
double stepOf(const sensor_msgs::LaserScan& message, float increment) {
  return message.ranges.size() > 1 ? static_cast<double>(increment) : 0;
}

/// Returns why a scan cannot be read, or empty.
std::string scanFault(const sensor_msgs::LaserScan& message, bool by_intensity) {
  if (message.ranges.size() > kMostCloudPoints) return "too many points";
  if (!std::isfinite(message.angle_min) ||
      !std::isfinite(stepOf(message, message.angle_increment))) {
    return "scan angles are not finite";
  }
  // An infinite range_max is legal; rays without return are infinite and left out in any case.
  if (std::isnan(message.range_min) || std::isnan(message.range_max)) {
    return "range limits are no numbers";
  }
  const double last_s =
      stepOf(message, message.time_increment) * static_cast<double>(message.ranges.size() - 1);
  if (!(std::abs(last_s) <= kLongestSweep)) return "time_increment is absurd";
  if (by_intensity && message.intensities.size() != message.ranges.size()) {
    return "intensities are not as many as ranges";
  }
  return {};
}

}  // namespace

Converted<ScanPoints> toScanPoints(const sensor_msgs::LaserScan& message, const CloudStyle& style) {
  ScanPoints scan;
  if (message.ranges.empty()) return {scan, {}};
  const bool by_intensity = style.color == ColorSource::Intensity;
  if (const std::string fault = scanFault(message, by_intensity); !fault.empty()) {
    return refused<ScanPoints>(fault);
  }
  const double increment_s = stepOf(message, message.time_increment);
  const double angle_step = stepOf(message, message.angle_increment);
  const bool is_swept = increment_s != 0;
  scan.sweep.last_s = increment_s * static_cast<double>(message.ranges.size() - 1);
  render::PointList points;
  std::vector<double> values;
  for (std::size_t i = 0; i < message.ranges.size(); ++i) {
    const auto range = static_cast<double>(message.ranges[i]);
    if (!(range >= message.range_min && range <= message.range_max)) continue;
    const double angle =
        static_cast<double>(message.angle_min) + static_cast<double>(i) * angle_step;
    const auto point = toVector(range * std::cos(angle), range * std::sin(angle), 0);
    if (!point) continue;
    points.push_back(*point);
    if (by_intensity) values.push_back(static_cast<double>(message.intensities[i]));
    if (is_swept) {
      scan.sweep.seconds.push_back(static_cast<float>(increment_s * static_cast<double>(i)));
    }
  }
  scan.cloud.style = style.style;
  scan.cloud.size = style.size;
  scan.cloud.points = std::move(points);
  if (by_intensity) scan.cloud.colors = asBytes(colorsOf(values, style.scale));
  return {std::move(scan), {}};
}

}  // namespace afterglow::nodes
