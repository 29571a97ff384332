#include "nodes/conversion/cloud_fields.hpp"

#include <limits>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
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

}  // namespace afterglow::nodes
