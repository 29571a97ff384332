/// \file
/// A depth camera's cloud of a table with things on it; and the one kind of compressed PCD file that
/// tests have: fields label x y z rgba, 4 bytes each.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <utility>
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

/// 640 x 480 rays, in the camera's optical frame. Far away, where the camera's own light does not
/// reach, and here and there, nothing was measured.
class DepthImage {
 public:
  static constexpr std::uint32_t kNothing = 0, kTable = 1, kThing = 2;

  LabeledCloud cloud() const {
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0, kDisparityNoise_px);
    LabeledCloud image;
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const Eigen::Vector3d ray((u - 319.5) / kFocal, (v - 239.5) / kFocal, 1);
        const Hit hit = meet(Eigen::Vector3d::Zero(), ray);
        const double disparity = kFocal * kBase_m / hit.way + noise(random);
        const double measured = kFocal * kBase_m / (std::round(8 * disparity) / 8);
        const bool is_measured =
            hit.way < kReach_m && random() % 100 > 0 && isLit(ray * hit.way);
        image.points.emplace_back(is_measured ? Eigen::Vector3d(ray * measured)
                                              : Eigen::Vector3d::Constant(std::nan("")));
        image.labels.push_back(hit.label);
      }
    }
    return image;
  }

  /// The camera looks down at the table: its middle is 1.1 m away.
  Eigen::Isometry3d T_camera_table = [] {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translate(Eigen::Vector3d(0.05, -0.02, 1.1));
    T.rotate(Eigen::AngleAxisd(2.4, Eigen::Vector3d::UnitX()));
    return T;
  }();

 private:
  static constexpr double kFocal = 525, kBase_m = 0.075, kDisparityNoise_px = 0.05,
                          kReach_m = 2;
  static constexpr double kFloor = -0.72;  ///< below the table
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  struct Hit {
    double way = kInfinity;
    std::uint32_t label = kNothing;
  };
  /// An upright box or cylinder on the table.
  struct Thing {
    double x, y, radius, height;  ///< of a box: half its side
    bool is_round;
  };
  const std::vector<Thing> things_ = {{-0.2, 0.05, 0.05, 0.2, false},
                                      {0.12, 0.1, 0.035, 0.12, true},
                                      {0.25, -0.08, 0.08, 0.06, false},
                                      {-0.02, -0.12, 0.04, 0.1, true}};

  static void keepNearer(Hit& hit, double way, std::uint32_t label) {
    if (way > 1e-6 && way < hit.way) hit = {way, label};
  }

  /// Between which ways a ray is within a thing's outline, seen from above.
  static std::pair<double, double> within(const Thing& thing, const Eigen::Vector2d& from,
                                          const Eigen::Vector2d& direction) {
    const Eigen::Vector2d o = from - Eigen::Vector2d(thing.x, thing.y);
    if (!thing.is_round) {
      const Eigen::Array2d a = (-thing.radius - o.array()) / direction.array();
      const Eigen::Array2d b = (thing.radius - o.array()) / direction.array();
      return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
    }
    const double middle = -o.dot(direction) / direction.squaredNorm();
    const double aside = (o + middle * direction).norm();
    if (aside > thing.radius) return {kInfinity, -kInfinity};
    const double half =
        std::sqrt(thing.radius * thing.radius - aside * aside) / direction.norm();
    return {middle - half, middle + half};
  }

  /// The first surface on a ray, both in the camera's frame.
  Hit meet(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    const Eigen::Isometry3d T_table_camera = T_camera_table.inverse();
    const Eigen::Vector3d o = T_table_camera * eye, d = T_table_camera.linear() * ray;
    Hit hit;
    keepNearer(hit, (kFloor - o.z()) / d.z(), kNothing);
    const Eigen::Vector3d on_table = o - d * (o.z() / d.z());
    if (std::abs(on_table.x()) < 0.6 && std::abs(on_table.y()) < 0.4) {
      keepNearer(hit, -o.z() / d.z(), kTable);
    }
    for (const Thing& thing : things_) {
      const auto [first, last] = within(thing, o.head<2>(), d.head<2>());
      const double top = (thing.height - o.z()) / d.z(), bottom = -o.z() / d.z();
      const double enters = std::max(first, std::min(top, bottom));
      if (enters < std::min(last, std::max(top, bottom))) keepNearer(hit, enters, kThing);
    }
    return hit;
  }

  /// Whether the camera's own light, which comes from beside it, reaches a point.
  bool isLit(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d lamp(kBase_m, 0, 0);
    return meet(lamp, p - lamp).way > 1 - 1e-6;
  }
};

}  // namespace afterglow::test
