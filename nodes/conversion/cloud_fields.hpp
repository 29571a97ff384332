/// \file
/// The fields of a PointCloud2: found by name, checked to lie inside a point, read as numbers.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::nodes {

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

}  // namespace afterglow::nodes
