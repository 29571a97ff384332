#include "render/paint/point_projector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "render/compose/composed_image.hpp"
#include "render/paint/float_lens.hpp"
#include "render/paint/vector_clones.hpp"
#include "render/scene/lens_domain.hpp"

namespace afterglow::render {
namespace {

constexpr std::size_t kBlock = 128;  // points a pass: small enough for the innermost cache
using Floats = std::array<float, kBlock>;
using Ints = std::array<std::int32_t, kBlock>;

/// a . p + b, in floats.
struct Row {
  float x, y, z, b;
  explicit Row(const Eigen::RowVector4d& row)
      : x(static_cast<float>(row[0])),
        y(static_cast<float>(row[1])),
        z(static_cast<float>(row[2])),
        b(static_cast<float>(row[3])) {}
};

/// A worker's part of a cloud, and its results.
struct Part {
  std::size_t begin = 0, end = 0;  ///< range of the cloud's points
  std::size_t count = 0;           ///< written from `begin` on
  double depth_sum = 0;
  std::uint32_t first_color = 0;
  bool one_color = true;
};

class PartProjector {
 public:
  PartProjector(const calib::Lens& lens, const PointCloud& cloud, const Color& color,
                const PointPlacement& placement, const Eigen::Vector3f& origin)
      : lens_(lens),
        columns_(lens.width),
        rows_(lens.height),
        points_(cloud.points),
        colors_(cloud.colors),
        color_(color),
        flattened_(placement.flattened),
        gain_(placement.gain),
        origin_(origin),
        x_(placement.P_optical_cloud.row(0)),
        y_(placement.P_optical_cloud.row(1)),
        z_(placement.P_optical_cloud.row(2)),
        w_(placement.P_optical_cloud.row(3)),
        height_(placement.height.transpose()) {}

  void project(Part& part, ScreenPoint* out) const {
    Floats depth;
    Ints u, v, keep;
    const std::uint32_t flat = packedColor(color_, 1, gain_);
    for (std::size_t first = part.begin; first < part.end; first += kBlock) {
      const std::size_t count = std::min(kBlock, part.end - first);
      projectBlock(first, count, u, v, depth, keep);
      for (std::size_t i = 0; i < count; ++i) {
        if (!keep[i]) continue;
        const std::uint32_t color =
            first + i < colors_.size() ? packedColor(colors_[first + i], color_.a, gain_) : flat;
        if (color >> 24 == 0) continue;
        if (part.count == 0) part.first_color = color;
        part.one_color = part.one_color && color == part.first_color;
        part.depth_sum += static_cast<double>(depth[i]);
        ScreenPoint& point = out[part.count++];
        point.u = u[i];
        point.v = v[i];
        point.order = orderOf(depth[i]);
        point.color = color;
      }
    }
  }

 private:
  /// Floats sort like their bits, but for the sign; inverted, the farthest comes first.
  static std::uint32_t orderOf(float depth) {
    std::uint32_t bits;
    std::memcpy(&bits, &depth, sizeof(bits));
    return bits >> 31 ? bits : ~(bits | 0x80000000u);
  }

  /// Loops without branches, over arrays the compiler can see: they become vector code. Comparisons
  /// are written so that NaN fails.
  AFTERGLOW_VECTOR_CLONES
  void projectBlock(std::size_t first, std::size_t count, Ints& u, Ints& v, Floats& depth,
                    Ints& keep) const {
    Floats px, py, pz;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f& p = points_[first + i];
      px[i] = p.x() - origin_.x();
      py[i] = p.y() - origin_.y();
      pz[i] = p.z() - origin_.z();
    }
    for (std::size_t i = count; i < kBlock; ++i) px[i] = py[i] = pz[i] = 0;
    Floats nx, ny, z;
    Ints in_front;
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float w = w_.x * px[i] + w_.y * py[i] + w_.z * pz[i] + w_.b;
      const float zw = z_.x * px[i] + z_.y * py[i] + z_.z * pz[i] + z_.b;
      const float inverse = 1 / zw;
      nx[i] = (x_.x * px[i] + x_.y * py[i] + x_.z * pz[i] + x_.b) * inverse;
      ny[i] = (y_.x * px[i] + y_.y * py[i] + y_.z * pz[i] + y_.b) * inverse;
      z[i] = zw / w;
      in_front[i] = (w > 0) & (z[i] >= static_cast<float>(LensDomain::kNear));
    }
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float h = height_.x * px[i] + height_.y * py[i] + height_.z * pz[i] + height_.b;
      const float flat = -h / (1 + std::abs(h));
      const float distant = 1 - 2 * static_cast<float>(LensDomain::kNear) / z[i];
      depth[i] = flattened_ ? flat : distant;
    }
    if (lens_.is_fisheye) {
      throughLens<true>(nx, ny, in_front, u, v, keep);
    } else {
      throughLens<false>(nx, ny, in_front, u, v, keep);
    }
  }

  /// calib::project, of normalized coordinates.
  template <bool kFisheye>
  __attribute__((always_inline)) void throughLens(const Floats& nx, const Floats& ny,
                                                  const Ints& in_front, Ints& u, Ints& v,
                                                  Ints& keep) const {
    const FloatLens lens = lens_;
    const float u_end = static_cast<float>(columns_) + kPointMargin;
    const float v_end = static_cast<float>(rows_) + kPointMargin;
    constexpr float kFirst = -kPointMargin;
    constexpr int kLift = 256;  // px: above zero, cutting off rounds down
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float x = nx[i], y = ny[i];
      float pixel_u, pixel_v;
      lens.project<kFisheye>(x, y, pixel_u, pixel_v);
      const int kept = in_front[i] & (x * x + y * y <= lens.square_fold) & (pixel_u >= kFirst) &
                       (pixel_u <= u_end) & (pixel_v >= kFirst) & (pixel_v <= v_end);
      const float shown_u = kept ? pixel_u : 0, shown_v = kept ? pixel_v : 0;
      u[i] = static_cast<int>((shown_u + kLift) * kSubpixels + 0.5f) - kLift * kSubpixels;
      v[i] = static_cast<int>((shown_v + kLift) * kSubpixels + 0.5f) - kLift * kSubpixels;
      keep[i] = kept;
    }
  }

  const FloatLens lens_;
  const int columns_, rows_;
  const PointList& points_;
  const ByteColorList& colors_;
  const Color color_;
  const bool flattened_;
  const float gain_;
  const Eigen::Vector3f origin_;
  const Row x_, y_, z_, w_, height_;
};

}  // namespace

PointRun PointProjector::project(const PointCloud& cloud, const Color& color,
                                 const PointPlacement& placement, Workers& workers,
                                 std::vector<ScreenPoint>& points, std::size_t& used) const {
  PointRun run;
  run.first = static_cast<std::uint32_t>(used);
  run.size_px = cloud.size;
  const std::size_t total = cloud.points.size();
  const PointList& list = cloud.points;
  const auto origin =
      std::find_if(list.begin(), list.end(), [](const auto& p) { return p.allFinite(); });
  if (origin == list.end() || !placement.P_optical_cloud.allFinite()) return run;
  if (points.size() < used + total) points.resize(used + total);
  const PartProjector projector(lens_, cloud, color, placement.from(*origin), *origin);
  std::vector<Part> parts(static_cast<std::size_t>(workers.sharers(total)));
  workers.share(total, [&](int worker, std::size_t begin, std::size_t end) {
    Part part;
    part.begin = begin;
    part.end = end;
    projector.project(part, points.data() + used + begin);
    parts[static_cast<std::size_t>(worker)] = part;
  });
  double depth_sum = 0;
  bool one_color = true;
  std::uint32_t some_color = 0;
  for (const Part& part : parts) {
    if (part.count == 0) continue;
    const ScreenPoint* from = points.data() + run.first + part.begin;
    // Closes the gap; to the front.
    if (from != points.data() + used) std::copy(from, from + part.count, points.data() + used);
    one_color = one_color && part.one_color && (run.count == 0 || part.first_color == some_color);
    some_color = part.first_color;
    depth_sum += part.depth_sum;
    used += part.count;
    run.count += static_cast<std::uint32_t>(part.count);
  }
  run.is_ordered = !one_color || some_color >> 24 != 255;
  run.mean_depth = depth_sum / std::max(1.0, static_cast<double>(run.count));
  return run;
}

}  // namespace afterglow::render
