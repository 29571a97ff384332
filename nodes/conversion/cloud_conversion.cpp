#include "nodes/conversion/cloud_conversion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::size_t sizeOf(std::uint8_t datatype) {
  switch (datatype) {
    case PointField::INT8:
    case PointField::UINT8:
      return 1;
    case PointField::INT16:
    case PointField::UINT16:
      return 2;
    case PointField::INT32:
    case PointField::UINT32:
    case PointField::FLOAT32:
      return 4;
    case PointField::FLOAT64:
      return 8;
    default:
      return 0;
  }
}

/// One field's place within a point, known to lie inside it.
class FieldReader {
 public:
  FieldReader(const PointField& field, bool big_endian)
      : offset_(field.offset), datatype_(field.datatype), swap_(big_endian) {}

  /// Whether the bytes at offset() are a float as this machine has it.
  bool isPlainFloat() const { return datatype_ == PointField::FLOAT32 && !swap_; }
  bool isSwapped() const { return swap_; }
  std::size_t offset() const { return offset_; }

  /// The four bytes as they are: packed colors are bits, even where the field says FLOAT32.
  std::uint32_t bits(const std::uint8_t* point) const { return load<std::uint32_t>(point); }

  double number(const std::uint8_t* point) const {
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
        return kNone;
    }
  }

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

/// The first field of one of these names, in the names' order.
const PointField* findField(const PointCloud2& message, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const PointField& field : message.fields) {
      if (field.name == name) return &field;
    }
  }
  return nullptr;
}

/// Why a field cannot be read, or empty.
std::string fieldFault(const PointCloud2& message, const PointField* field, const char* name,
                       std::initializer_list<std::uint8_t> datatypes) {
  const std::string quoted = "field '" + std::string(name) + "'";
  if (field == nullptr) return "no " + quoted;
  if (std::find(datatypes.begin(), datatypes.end(), field->datatype) == datatypes.end()) {
    return quoted + " is of another type than can be read";
  }
  const std::uint64_t end = std::uint64_t{field->offset} + sizeOf(field->datatype);
  return end > message.point_step ? quoted + " lies beyond the point" : "";
}

/// Why the declared sizes do not fit the data, or empty. 64 bits: width * height may pass 2^32.
std::string sizeFault(const PointCloud2& message) {
  const std::uint64_t rows = message.height, columns = message.width;
  if (message.point_step == 0) return "point_step is 0";
  if (rows > kMostPoints || columns > kMostPoints || rows * columns > kMostPoints) {
    return "too many points";
  }
  const std::uint64_t row_size = columns * message.point_step;  // < 2^22 * 2^32
  if (rows > 1 && message.row_step < row_size) return "row_step is shorter than a row";
  if ((rows - 1) * message.row_step + row_size > message.data.size()) {
    return "data is shorter than declared";
  }
  return {};
}

/// Remarks on data that is longer than declared.
std::string sizeRemark(const PointCloud2& message) {
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  const std::uint64_t declared = message.height == 1
                                     ? std::max<std::uint64_t>(row, message.row_step)
                                     : std::uint64_t{message.height} * message.row_step;
  return message.data.size() > declared ? "data is longer than declared" : "";
}

/// Bytes of colors as shares: looked up, for a division each would be most of the work.
constexpr std::array<float, 256> kShares = [] {
  std::array<float, 256> shares{};
  for (std::size_t i = 0; i < shares.size(); ++i) shares[i] = static_cast<float>(i) / 255.0f;
  return shares;
}();

render::Color unpack(std::uint32_t bits, bool with_alpha) {
  const auto channel = [bits](int shift) { return kShares[(bits >> shift) & 0xffu]; };
  return {channel(16), channel(8), channel(0), with_alpha ? channel(24) : 1.0f};
}

/// Reads the points of one message whose sizes and fields have been checked.
class CloudReader {
 public:
  CloudReader(const PointCloud2& message, const CloudStyle& style) : message_(message) {
    cloud_.style = style.style;
    cloud_.size = style.size;
    for (const char* name : {"x", "y", "z"}) {
      xyz_.emplace_back(*findField(message, {name}), message.is_bigendian != 0);
    }
    is_plain_ = std::all_of(xyz_.begin(), xyz_.end(),
                            [](const FieldReader& field) { return field.isPlainFloat(); });
  }

  void readColors(const PointField& field) {
    packed_.emplace(field, message_.is_bigendian != 0);
    with_alpha_ = field.name == "rgba";
  }
  void readIntensity(const PointField& field) {
    intensity_.emplace(field, message_.is_bigendian != 0);
  }

  render::PointCloud read() {
    const std::size_t most = std::size_t{message_.width} * message_.height;  // data holds as many
    points_.reserve(most);
    if (packed_) colors_.reserve(most);
    for (std::size_t row = 0; row < message_.height; ++row) {
      const std::uint8_t* point = message_.data.data() + row * message_.row_step;
      if (is_plain_ && !intensity_ && !(packed_ && packed_->isSwapped())) {
        addPlainRow(point);
        continue;
      }
      for (std::size_t i = 0; i < message_.width; ++i, point += message_.point_step) {
        addPoint(point);
      }
    }
    if (intensity_) colors_ = rainbowOf(values_);
    cloud_.points = std::move(points_);
    cloud_.colors = std::move(colors_);
    return std::move(cloud_);
  }

 private:
  void addPoint(const std::uint8_t* point) {
    const auto position =
        toVector(xyz_[0].number(point), xyz_[1].number(point), xyz_[2].number(point));
    if (!position) return;
    points_.push_back(*position);
    if (packed_) colors_.push_back(unpack(packed_->bits(point), with_alpha_));
    if (intensity_) values_.push_back(intensity_->number(point));
  }

  /// addPoint for what nearly every cloud has, without a decision for every value.
  void addPlainRow(const std::uint8_t* point) {
    const std::size_t x_at = xyz_[0].offset(), y_at = xyz_[1].offset(), z_at = xyz_[2].offset();
    const bool is_colored = packed_.has_value();
    const std::size_t color_at = is_colored ? packed_->offset() : 0;
    constexpr auto kLimit = static_cast<float>(kFarthest);
    for (std::size_t i = 0; i < message_.width; ++i, point += message_.point_step) {
      float x, y, z;
      std::memcpy(&x, point + x_at, sizeof(x));
      std::memcpy(&y, point + y_at, sizeof(y));
      std::memcpy(&z, point + z_at, sizeof(z));
      const bool fits = (std::abs(x) <= kLimit) & (std::abs(y) <= kLimit) &
                        (std::abs(z) <= kLimit);  // NaN fails, too
      if (!fits) continue;
      points_.emplace_back(x, y, z);
      if (!is_colored) continue;
      std::uint32_t bits;
      std::memcpy(&bits, point + color_at, sizeof(bits));
      colors_.push_back(unpack(bits, with_alpha_));
    }
  }

  const PointCloud2& message_;
  render::PointCloud cloud_;
  render::PointList points_;
  render::ColorList colors_;
  bool is_plain_ = false;
  std::vector<FieldReader> xyz_;
  std::optional<FieldReader> packed_, intensity_;
  std::vector<double> values_;
  bool with_alpha_ = false;
};

}  // namespace

Converted<render::PointCloud> toPointCloud(const PointCloud2& message, const CloudStyle& style) {
  using Result = render::PointCloud;
  if (message.width == 0 || message.height == 0) return {Result{}, {}};
  if (std::string fault = sizeFault(message); !fault.empty()) return refused<Result>(fault);
  for (const char* name : {"x", "y", "z"}) {
    const std::string fault = fieldFault(message, findField(message, {name}), name,
                                         {PointField::FLOAT32, PointField::FLOAT64});
    if (!fault.empty()) return refused<Result>(fault);
  }
  CloudReader reader(message, style);
  if (style.color == ColorSource::Rgb8) {
    const PointField* field = findField(message, {"rgb", "rgba"});
    const std::string fault = fieldFault(
        message, field, "rgb", {PointField::FLOAT32, PointField::INT32, PointField::UINT32});
    if (!fault.empty()) return refused<Result>(fault);
    reader.readColors(*field);
  }
  if (style.color == ColorSource::Intensity) {
    const PointField* field = findField(message, {"intensity", "intensities"});
    const std::string fault = fieldFault(
        message, field, "intensity",
        {PointField::INT8, PointField::UINT8, PointField::INT16, PointField::UINT16,
         PointField::INT32, PointField::UINT32, PointField::FLOAT32, PointField::FLOAT64});
    if (!fault.empty()) return refused<Result>(fault);
    reader.readIntensity(*field);
  }
  return {reader.read(), sizeRemark(message)};
}

}  // namespace afterglow::nodes
