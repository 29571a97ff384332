#include "render/paint/dark_mask.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <stdexcept>
#include <tuple>
#include <type_traits>
#include <variant>

#include "render/paint/vector_clones.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/tessellate.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

// ------------------------------------------------------------------------------- what is avoided

/// A surface as a list of points sees it.
class PointSurface {
 public:
  PointSurface(const SurfacePatch& patch, const Rigid<World, World>& pose)
      : patch_(patch),
        T_surface_points_(
            (patch.T_world_surface.inverse().matrix() * pose.matrix()).cast<float>()) {}

  /// Returns the height over the surface; `is_inside`: within its outline.
  float heightOf(const Eigen::Vector3f& p, bool& is_inside) const {
    const Eigen::Vector3f p_surface = T_surface_points_ * p;
    const Eigen::Vector2d xy = p_surface.head<2>().cast<double>();
    is_inside = patch_.polygon.empty() || isInside(patch_.polygon, xy);
    const auto relief = patch_.relief && is_inside ? patch_.relief->height(xy) : std::nullopt;
    return p_surface.z() - static_cast<float>(relief.value_or(0));
  }
  /// The same without the outline and the relief: most points lie near no other surface's height.
  float heightOfPlane(const Eigen::Vector3f& p) const {
    return T_surface_points_.matrix().row(2).dot(p.homogeneous());
  }
  bool isFlat() const { return patch_.relief == nullptr; }

 private:
  const SurfacePatch& patch_;
  Eigen::Isometry3f T_surface_points_;
};

std::vector<PointSurface> pointSurfaces(const std::vector<SurfacePatch>& surfaces,
                                        const Rigid<World, World>& pose) {
  std::vector<PointSurface> seen;
  for (const SurfacePatch& patch : surfaces) seen.emplace_back(patch, pose);
  return seen;
}

bool isStanding(const std::vector<PointSurface>& surfaces, const Eigen::Vector3f& p, float height) {
  bool is_above = false;
  for (const PointSurface& surface : surfaces) {
    const float plane = surface.heightOfPlane(p);
    bool is_inside = false;
    if (surface.isFlat() && !(std::abs(plane) <= height)) {
      is_above = is_above || plane > height;
      continue;
    }
    const float over = surface.heightOf(p, is_inside);
    if (is_inside && std::abs(over) <= height) return false;
    is_above = is_above || over > height;
  }
  return is_above;
}

/// The cells of space that a surface passes through, and those next to them.
class SurfaceCells {
 public:
  /// Cells so large that two of them side by side are no longer than the padding, corner to corner.
  SurfaceCells(const std::vector<AvoidedPoints>& own, float padding)
      : per_cell_(2 * std::sqrt(3.f) / padding) {
    PointList world;
    for (const AvoidedPoints& part : own) {
      const Eigen::Isometry3f T_world_points = part.pose.matrix().cast<float>();
      for (const Eigen::Vector3f& p : part.points) world.push_back(T_world_points * p);
    }
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : world) box.extend(p);
    if (world.empty() || !box.sizes().allFinite()) return;
    const Eigen::Array3d sides = (box.sizes() * per_cell_).array().cast<double>().floor() + 3;
    if (sides.prod() > kMostCells) return;
    size_ = sides.cast<int>();
    first_ = box.min() - Eigen::Vector3f::Constant(1 / per_cell_);
    cells_.assign(static_cast<std::size_t>(sides.prod()), kFree);
    for (const Eigen::Vector3f& p : world) mark(p);
  }

  bool contains(const Eigen::Vector3f& p_world) const {
    const Eigen::Array3f at = ((p_world - first_) * per_cell_).array();
    if (!((at >= 0).all() && (at < size_.cast<float>()).all())) return false;
    return cells_[indexOf(at.cast<int>())] != kFree;
  }

 private:
  static constexpr double kMostCells = 1 << 24;
  static constexpr char kFree = 0, kBeside = 1, kPassed = 2;

  std::size_t indexOf(const Eigen::Array3i& cell) const {
    return static_cast<std::size_t>((cell.z() * size_.y() + cell.y()) * size_.x() + cell.x());
  }
  /// The box is a cell wider than the points on each side.
  void mark(const Eigen::Vector3f& p) {
    const Eigen::Array3i cell =
        ((p - first_) * per_cell_).array().cast<int>().max(1).min(size_ - 2);
    char& here = cells_[indexOf(cell)];
    if (here == kPassed) return;
    here = kPassed;
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        char* row = &cells_[indexOf(cell + Eigen::Array3i(-1, y, z))];
        for (int x = 0; x < 3; ++x) row[x] = std::max(row[x], kBeside);
      }
    }
  }

  float per_cell_;
  Eigen::Vector3f first_ = Eigen::Vector3f::Zero();
  Eigen::Array3i size_ = Eigen::Array3i::Zero();
  std::vector<char> cells_;
};

// ---------------------------------------------------------------------------------------- shapes

/// Cuts triangles at the middle of their longest edges until none is longer than `spacing`. Of
/// points that nearly coincide one is kept.
class TriangleSampler {
 public:
  explicit TriangleSampler(double spacing)
      : square_longest_(static_cast<float>(spacing * spacing)),
        per_grain_(static_cast<float>(4 / spacing)) {}

  void add(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
    const std::array<float, 3> edges = {(b - a).squaredNorm(), (c - b).squaredNorm(),
                                        (a - c).squaredNorm()};
    const auto longest = std::max_element(edges.begin(), edges.end()) - edges.begin();
    const bool is_small =
        a.allFinite() && edges[0] < kLargest && edges[1] < kLargest && edges[2] < kLargest;
    if (!is_small || points.size() > kMostPoints) {
      throw std::runtime_error("a shape that is not finite, or too large: not in meters?");
    }
    if (!(edges[static_cast<std::size_t>(longest)] > square_longest_)) {
      for (const Eigen::Vector3f* p : {&a, &b, &c}) keep(*p);
      return;
    }
    const std::array<Eigen::Vector3f, 3> turned = longest == 0   ? std::array{a, b, c}
                                                  : longest == 1 ? std::array{b, c, a}
                                                                 : std::array{c, a, b};
    const Eigen::Vector3f middle = (turned[0] + turned[1]) / 2;
    add(turned[0], middle, turned[2]);
    add(middle, turned[1], turned[2]);
  }

  PointList points;

 private:
  static constexpr float kLargest = 1e6f;  // square meters, of an edge's length
  static constexpr std::size_t kMostPoints = 1'000'000;

  void keep(const Eigen::Vector3f& p) {
    const auto grain = [&](float x) {
      return static_cast<std::int32_t>(std::lround(x * per_grain_));
    };
    if (grains_.emplace(grain(p.x()), grain(p.y()), grain(p.z())).second) points.push_back(p);
  }

  float square_longest_, per_grain_;
  std::set<std::tuple<std::int32_t, std::int32_t, std::int32_t>> grains_;
};

PointList sampled(const Solid& solid, const Eigen::Vector3f& size, double spacing) {
  TriangleSampler sampler(spacing);
  const auto at = [&](std::uint32_t i) -> Eigen::Vector3f {
    return solid.points[i].cast<float>().cwiseProduct(size);
  };
  for (const auto& t : solid.triangles) sampler.add(at(t[0]), at(t[1]), at(t[2]));
  return std::move(sampler.points);
}

constexpr int kRoundSides = 48;

// ------------------------------------------------------------------------------------- the image

constexpr float kLeastPower = -1;
/// A point, or a pixel, is so far from the center of its cell at most, in pixels, together.
constexpr float kCellSlack = 5;
/// Cells around the image: points beside it have their places there. Farther ones reach in from
/// the border of these.
constexpr int kMargin = 24;
constexpr float kLargestRadius = 20'000;  // px
constexpr float kDegenerate = 0.1f;       // of 1 - tan^2 * tan^2: the padding ends beside the lens
constexpr int kGrid = 16;                 // steps over the image by which a lens is measured
constexpr std::size_t kBlock = 128;       // points that are projected together
/// Nearer to the fold than this the model is not trusted.
constexpr float kWithinFold = 0.999f;

/// Pixels per unit of the normalized image, or of a fisheye per radian: the greatest in the image.
/// `widest`: radians off the axis.
float measure(const calib::Lens& lens, float& widest) {
  const auto greatest = [](const Eigen::Matrix2d& A) {
    return Eigen::JacobiSVD<Eigen::Matrix2d>(A).singularValues()[0];
  };
  const bool is_fisheye = lens.model == calib::LensModel::Equidistant;
  double px = 0, angle = 0;
  for (int i = 0; i <= kGrid * kGrid + 2 * kGrid; ++i) {
    const Eigen::Vector2d pixel((i % (kGrid + 1)) * (lens.width - 1.0) / kGrid,
                                (i / (kGrid + 1)) * (lens.height - 1.0) / kGrid);
    const auto ray = calib::unproject(lens, pixel);
    const Eigen::Vector2d xy = ray ? Eigen::Vector2d(ray->head<2>()) : Eigen::Vector2d::Zero();
    angle = std::max(angle, std::atan(ray ? xy.norm() : lens.fold_radius));
    if (!is_fisheye) px = std::max(px, greatest(calib::pixelSlope(lens, xy).by_ray));
  }
  widest = static_cast<float>(angle);
  if (!is_fisheye) return static_cast<float>(px);
  constexpr double kStep = 0.01;
  double by_angle = 1;
  for (double a = kStep; a < angle + kStep; a += kStep) {
    const double radius = calib::equidistantRadius(lens.D, a);
    by_angle = std::max({by_angle, radius / std::sin(std::min(a, M_PI / 2)),
                         (radius - calib::equidistantRadius(lens.D, a - kStep)) / kStep});
  }
  return static_cast<float>(by_angle * greatest(lens.K.topLeftCorner<2, 2>()));
}

/// The upper envelope of parabolas that open downwards, one at each place where `power` is at least
/// 0, at the places without a margin at both ends; kLeastPower where none of them is. Source: P.
/// Felzenszwalb, D. Huttenlocher, Distance Transforms of Sampled Functions (2012), with heights
/// turned round.
class Envelope {
 public:
  explicit Envelope(int count)
      : tops_(static_cast<std::size_t>(count)), from_(static_cast<std::size_t>(count)) {}

  void spread(const float* power, int count, float* out, int out_step) {
    std::size_t used = 0;
    for (int i = 0; i < count; ++i) {
      if (!(power[i] >= 0)) continue;
      float begin = -std::numeric_limits<float>::infinity();
      for (; used > 0; --used) {
        begin = crossing(power, tops_[used - 1], i);
        if (begin > from_[used - 1]) break;
        begin = -std::numeric_limits<float>::infinity();
      }
      tops_[used] = i;
      from_[used++] = begin;
    }
    std::size_t top = 0;
    for (int i = kMargin; i < count - kMargin; ++i, out += out_step) {
      if (used == 0) {
        *out = kLeastPower;
        continue;
      }
      while (top + 1 < used && from_[top + 1] <= static_cast<float>(i)) ++top;
      const auto away = static_cast<float>(i - tops_[top]);
      *out = std::max(power[tops_[top]] - away * away, kLeastPower);
    }
  }

 private:
  /// The place from which on the parabola at j is higher than the one at i, which is left of it.
  static float crossing(const float* power, int i, int j) {
    const auto a = static_cast<float>(i), b = static_cast<float>(j);
    return ((b * b - power[j]) - (a * a - power[i])) / (2 * (b - a));
  }

  std::vector<int> tops_;
  std::vector<float> from_;
};

/// The points of a block in the optical frame; then on the image and its margin: where, in cells
/// from the margin's corner, and the squares of how far what they darken reaches.
struct Block {
  std::array<float, kBlock> x, y, z, column, row, power;
  std::array<std::int32_t, kBlock> is_near;  ///< not by these formulas
};

/// What is the same for all points of a list.
struct BlockTerms {
  FloatLens lens;
  Eigen::Matrix<float, 3, 4> T_optical_points;
  float padding, px_per_radian, columns, rows;
};

/// Loops without branches over values that nothing else changes: they become vector code.
/// Comparisons are written so that NaN is near.
template <bool kFisheye>
__attribute__((always_inline)) inline void projectBlock(const BlockTerms& terms,
                                                        const Eigen::Vector3f* points,
                                                        std::size_t count, Block& block) {
  const FloatLens lens = terms.lens;
  const Eigen::Matrix<float, 3, 4> T = terms.T_optical_points;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = points[i].x(), y = points[i].y(), z = points[i].z();
    block.x[i] = T(0, 0) * x + T(0, 1) * y + T(0, 2) * z + T(0, 3);
    block.y[i] = T(1, 0) * x + T(1, 1) * y + T(1, 2) * z + T(1, 3);
    block.z[i] = T(2, 0) * x + T(2, 1) * y + T(2, 2) * z + T(2, 3);
  }
  for (std::size_t i = count; i < kBlock; ++i) block.x[i] = block.y[i] = block.z[i] = 1;
  constexpr float kCells = 1.f / DarkMask::kCell;
  const float padding = terms.padding, square_padding = padding * padding;
  const float fold = kWithinFold * std::sqrt(lens.square_fold);
  const float px_per_radian = terms.px_per_radian;
  const float last_column = terms.columns - 0.5f, last_row = terms.rows - 0.5f;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float x = block.x[i], y = block.y[i], z = block.z[i];
    const float square = x * x + y * y + z * z, inverse = 1 / z;
    const float nx = x * inverse, ny = y * inverse, square_tan = nx * nx + ny * ny;
    // A cone around the padding, of this tangent, meets the plane of the image in an ellipse: its
    // center lies farther out than the point, and its longer half axis points there.
    const float square_out = square - square_padding;
    const float half = padding / std::sqrt(square_out > 1e-12f ? square_out : 1e-12f);
    const float across = 1 - square_tan * half * half;
    const float outward = kFisheye ? 1 : (1 + half * half) / across;
    const float cx = nx * outward, cy = ny * outward;
    const float center = std::sqrt(cx * cx + cy * cy);
    const float shrink = center > fold ? fold / center : 1.f;
    float u, v;
    lens.project<kFisheye>(cx * shrink, cy * shrink, u, v);
    u += 0.5f + lens.fx * (cx - cx * shrink);
    v += 0.5f + lens.fy * (cy - cy * shrink);
    const float spread = kFisheye ? std::atan(half) : half * (1 + square_tan) / across;
    const float reach = spread * px_per_radian + kCellSlack;
    const float radius = kCells * (reach < kLargestRadius ? reach : kLargestRadius);
    const float column = u * kCells + kMargin, row = v * kCells + kMargin;
    const float right = column > 0 ? column : 0, below = row > 0 ? row : 0;
    const float in_column = right < last_column ? right : last_column;
    const float in_row = below < last_row ? below : last_row;
    const float beside = column - in_column, above = row - in_row;
    block.column[i] = in_column;
    block.row[i] = in_row;
    // What a disc around a point outside darkens inside lies in a smaller disc around the nearest
    // point of the border.
    block.power[i] = radius * radius - beside * beside - above * above;
    block.is_near[i] =
        !((z > 0) & (square > 1.001f * square_padding) & (kFisheye | (across > kDegenerate)));
  }
}

AFTERGLOW_VECTOR_CLONES
void projectStraight(const BlockTerms& terms, const Eigen::Vector3f* points, std::size_t count,
                     Block& block) {
  projectBlock<false>(terms, points, count, block);
}

}  // namespace

PointList standingPoints(const PointList& points, const Rigid<World, World>& pose,
                         const std::vector<SurfacePatch>& surfaces, double height) {
  const std::vector<PointSurface> seen = pointSurfaces(surfaces, pose);
  const auto least = static_cast<float>(height);
  PointList standing;
  for (const Eigen::Vector3f& p : points) {
    if (isStanding(seen, p, least)) standing.push_back(p);
  }
  return standing;
}

PointList foreignPoints(const PointList& points, const Rigid<World, World>& pose,
                        const std::vector<AvoidedPoints>& own) {
  if (own.empty() || !(own.front().padding > 0)) return points;
  const SurfaceCells cells(own, own.front().padding);
  const Eigen::Isometry3f T_world_points = pose.matrix().cast<float>();
  PointList foreign;
  for (const Eigen::Vector3f& p : points) {
    if (!cells.contains(T_world_points * p)) foreign.push_back(p);
  }
  return foreign;
}

PointList standingColumns(const PointList& points, const Rigid<World, World>& pose,
                          const std::vector<SurfacePatch>& surfaces, double reach, double spacing) {
  const int steps = static_cast<int>(std::lround(reach / spacing));
  PointList columns;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3d p_world = pose * p.cast<double>();
    double height = std::numeric_limits<double>::infinity();
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    for (const SurfacePatch& surface : surfaces) {
      const double over = (surface.T_world_surface.inverse() * p_world).z();
      if (!(over >= 0 && over < height)) continue;
      height = over;
      up = surface.T_world_surface.matrix().linear().col(2);
    }
    if (!std::isfinite(height)) continue;
    for (int i = 0; i <= steps; ++i) {
      columns.push_back((p_world + (i * spacing - height) * up).cast<float>());
    }
  }
  return columns;
}

PointList surfacePoints(const Shape& shape, double spacing) {
  return std::visit(
      [spacing](const auto& solid) -> PointList {
        using Type = std::decay_t<decltype(solid)>;
        if constexpr (std::is_same_v<Type, Cube>) return sampled(unitCube(), solid.size, spacing);
        if constexpr (std::is_same_v<Type, Sphere>) {
          return sampled(unitSphere(kRoundSides), solid.size, spacing);
        }
        if constexpr (std::is_same_v<Type, Cylinder>) {
          return sampled(unitCylinder(kRoundSides), solid.size, spacing);
        }
        if constexpr (std::is_same_v<Type, MeshInstance>) {
          TriangleSampler sampler(spacing);
          const auto at = [&](std::uint32_t i) -> Eigen::Vector3f {
            return solid.body->points[i].cwiseProduct(solid.scale);
          };
          for (const auto& t : solid.body->triangles) sampler.add(at(t[0]), at(t[1]), at(t[2]));
          return std::move(sampler.points);
        }
        throw std::invalid_argument("surfacePoints: the shape is no solid");
      },
      shape);
}

DarkMask::DarkMask(const calib::Lens& lens)
    : width_(lens.width),
      height_(lens.height),
      columns_((lens.width + kCell - 1) / kCell + 2 * kMargin),
      rows_((lens.height + kCell - 1) / kCell + 2 * kMargin),
      lens_(lens),
      px_per_radian_(measure(lens, widest_)),
      power_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kLeastPower),
      turned_(static_cast<std::size_t>(columns_ - 2 * kMargin) * static_cast<std::size_t>(rows_),
              kLeastPower),
      dark_(static_cast<std::size_t>(columns_ - 2 * kMargin) *
                static_cast<std::size_t>(rows_ - 2 * kMargin),
            kLeastPower) {}

void DarkMask::draw(const std::vector<AvoidedPoints>& avoided,
                    const Rigid<Projector, World>& T_projector_world) {
  is_all_dark_ = false;
  std::fill(power_.begin(), power_.end(), kLeastPower);
  for (const AvoidedPoints& list : avoided) {
    if (!is_all_dark_) add(list, T_projector_world);
  }
  if (!is_all_dark_) spread();
}

void DarkMask::add(const AvoidedPoints& avoided, const Rigid<Projector, World>& T_projector_world) {
  const Eigen::Isometry3d T_projector_points = T_projector_world.matrix() * avoided.pose.matrix();
  const BlockTerms terms{lens_,
                         T_projector_points.matrix().topRows<3>().cast<float>(),
                         avoided.padding,
                         px_per_radian_,
                         static_cast<float>(columns_),
                         static_cast<float>(rows_)};
  const PointList& points = avoided.points;
  Block block;
  for (std::size_t first = 0; first < points.size() && !is_all_dark_; first += kBlock) {
    const std::size_t count = std::min(kBlock, points.size() - first);
    if (lens_.is_fisheye) {
      projectBlock<true>(terms, &points[first], count, block);
    } else {
      projectStraight(terms, &points[first], count, block);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (block.is_near[i]) {
        addNear({block.x[i], block.y[i], block.z[i]}, avoided.padding);
      } else if (block.power[i] >= 0) {
        float& power = power_[static_cast<std::size_t>(static_cast<int>(block.row[i]) * columns_ +
                                                       static_cast<int>(block.column[i]))];
        power = std::max(power, block.power[i]);
      }
    }
  }
}

/// Beside or around the lens: all or nothing.
void DarkMask::addNear(const Eigen::Vector3f& p, float padding) {
  if (!p.allFinite() || p.z() <= -padding) return;
  const float distance = p.norm();
  const float off_axis = std::atan2(p.head<2>().norm(), p.z());
  is_all_dark_ = is_all_dark_ || distance <= 1.001f * padding ||
                 off_axis - std::asin(padding / distance) <= widest_;
}

void DarkMask::spread() {
  Envelope along_row(columns_), along_column(rows_);
  const int columns = columns_ - 2 * kMargin;
  for (int row = 0; row < rows_; ++row) {
    along_row.spread(&power_[static_cast<std::size_t>(row * columns_)], columns_,
                     &turned_[static_cast<std::size_t>(row)], rows_);
  }
  for (int column = 0; column < columns; ++column) {
    along_column.spread(&turned_[static_cast<std::size_t>(column * rows_)], rows_,
                        &dark_[static_cast<std::size_t>(column)], columns);
  }
}

void DarkMask::apply(Image& image) const {
  if (image.width != width_ || image.height != height_) {
    throw std::logic_error("DarkMask: an image of another size than the lens's");
  }
  if (is_all_dark_) return std::fill(image.rgb.begin(), image.rgb.end(), std::uint8_t{0});
  const int columns = columns_ - 2 * kMargin;
  for (int y = 0; y < height_; ++y) {
    const float* power = &dark_[static_cast<std::size_t>(y / kCell * columns)];
    std::uint8_t* row =
        &image.rgb[3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    for (int column = 0; column < columns; ++column) {
      if (power[column] < 0) continue;
      const int end = std::min((column + 1) * kCell, width_);
      std::fill(row + 3 * column * kCell, row + 3 * end, std::uint8_t{0});
    }
  }
}

double DarkMask::share() const {
  if (is_all_dark_) return 1;
  const auto dark = std::count_if(dark_.begin(), dark_.end(), [](float p) { return p >= 0; });
  return static_cast<double>(dark) / static_cast<double>(dark_.size());
}

}  // namespace afterglow::render
