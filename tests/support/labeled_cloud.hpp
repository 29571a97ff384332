/// \file
/// The one kind of compressed PCD file that tests have: fields label x y z rgba, 4 bytes each.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace afterglow::test {

struct LabeledCloud {
  std::vector<Eigen::Vector3d> points;  ///< those not measured are not finite
  std::vector<std::uint32_t> labels;    ///< one a point
};

/// LZF: runs of bytes, and references to bytes before. Empty if it is damaged.
inline std::string unpackLzf(const std::string& packed) {
  std::string bytes;
  auto next = [&, i = std::size_t{0}]() mutable {
    return i < packed.size() ? static_cast<int>(static_cast<unsigned char>(packed[i++])) : -1;
  };
  for (int control = next(); control >= 0; control = next()) {
    if (control < 32) {
      for (int i = 0; i <= control; ++i) bytes.push_back(static_cast<char>(next()));
      continue;
    }
    int length = control >> 5;
    if (length == 7) length += next();
    const auto back = static_cast<std::size_t>(((control & 31) << 8) + next() + 1);
    if (back > bytes.size()) return {};
    for (int i = 0; i < length + 2; ++i) bytes.push_back(bytes[bytes.size() - back]);
  }
  return bytes;
}

/// Empty if the file cannot be read.
inline LabeledCloud readLabeledCloud(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(file), {}};
  const std::string mark = "DATA binary_compressed\n";
  const std::size_t data = all.find(mark);
  if (data == std::string::npos) return {};
  std::uint32_t packed_size = 0;  // and after it the unpacked one
  std::memcpy(&packed_size, &all[data + mark.size()], 4);
  const std::string bytes = unpackLzf(all.substr(data + mark.size() + 8, packed_size));
  const std::size_t count = bytes.size() / 20;  // field by field
  LabeledCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t label = 0;
    float p[3];
    std::memcpy(&label, &bytes[4 * i], 4);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::memcpy(&p[axis], &bytes[4 * ((axis + 1) * count + i)], 4);
    }
    cloud.points.emplace_back(p[0], p[1], p[2]);
    cloud.labels.push_back(label);
  }
  return cloud;
}

}  // namespace afterglow::test
