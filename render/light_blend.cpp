#include "render/light_blend.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include "render/compose/workers.hpp"
#include "render/paint/float_lens.hpp"
#include "render/scene/lens_domain.hpp"
#include "render/scene/relief.hpp"
#include "render/scene/triangulate.hpp"

namespace afterglow::render {
namespace {

/// Pixels between two nodes, across and down; the light between them is interpolated.
constexpr int kCell = 8;
/// Meters from a surface's edge, in its plane, within which the light behind it gives way to
/// others'.
constexpr double kShadowRamp = 0.05;
constexpr double kTouch = 0.003;  // meters: nearer things lie on the surface
/// Shares that differ by more within a cell are not interpolated.
constexpr float kSteep = 0.3f;
constexpr float kMostRaised = 0.25f;
constexpr float kFull = PixelLight::kFull;

double distanceTo(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& p) {
  double square = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i], way = polygon[(i + 1) % polygon.size()] - a;
    const double along = std::clamp(way.dot(p - a) / way.squaredNorm(), 0.0, 1.0);
    square = std::min(square, (p - a - along * way).squaredNorm());
  }
  return std::sqrt(square);
}

/// 0 at the edges of an image, 1 in its middle.
float inwardness(float x, float width) { return 4 * x / width * (1 - x / width); }

/// A projector's lens, both ways.
struct Beam {
  explicit Beam(const BlendedProjector& projector)
      : settings(projector),
        lens(projector.lens),
        rays(projector.lens),
        columns((projector.lens.width + kCell - 2) / kCell + 1),
        rows((projector.lens.height + kCell - 2) / kCell + 1) {}

  int width() const { return settings.lens.width; }
  int height() const { return settings.lens.height; }
  /// The pixel of a column or row of nodes; the last one is the image's last.
  int column(int i) const { return std::min(i * kCell, width() - 1); }
  int row(int i) const { return std::min(i * kCell, height() - 1); }

  /// The light of the whole image, of a square millimeter's worth of pixels or whatever: flux by
  /// solid angle in a direction (x, y, 1). The pixels on a solid angle are more where the lens
  /// spreads it wider.
  double intensity(double x, double y) const {
    constexpr float kStep = 1e-3f;
    const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
    const Corner left = lens.seen(fx - kStep, fy), right = lens.seen(fx + kStep, fy);
    const Corner above = lens.seen(fx, fy - kStep), below = lens.seen(fx, fy + kStep);
    const double pixels = std::abs(double{right.x - left.x} * double{below.y - above.y} -
                                   double{right.y - left.y} * double{below.x - above.x}) /
                          (4.0 * kStep * kStep);
    return settings.lumens / (double(width()) * height()) * pixels *
           std::pow(1 + x * x + y * y, 1.5);
  }

  BlendedProjector settings;
  FloatLens lens;
  calib::RayMap rays;
  int columns, rows;
};

/// The light at the place of a pixel.
struct Spot {
  int surface = -1;          ///< index; -1: none is reached
  std::uint32_t lit_by = 0;  ///< projectors, a bit each
  float share = 1;           ///< the projector's own
  float own = 1;             ///< illuminance by its full light
  float white = 1;           ///< by all, of white
  float black = 0;           ///< by all, of black
};

/// A projector and a surface.
struct View {
  Eigen::Isometry3d T_projector_surface;
  Eigen::Vector3d p_lens;  ///< surface's frame
};

bool isSame(const SurfacePatch& a, const SurfacePatch& b) {
  return a.T_world_surface.matrix().matrix() == b.T_world_surface.matrix().matrix() &&
         a.polygon == b.polygon && a.relief == b.relief;
}

}  // namespace

struct LightBlend::Impl {
  using Poses = std::vector<std::optional<Rigid<Projector, World>>>;

  bool isSameAsBefore(const std::vector<SurfacePatch>& now, const Poses& now_poses) const {
    const auto isPose = [](const auto& a, const auto& b) {
      return a.has_value() == b.has_value() && (!a || a->matrix().matrix() == b->matrix().matrix());
    };
    return std::equal(now.begin(), now.end(), surfaces.begin(), surfaces.end(),
                      [](const auto& a, const auto& b) { return isSame(a, b); }) &&
           std::equal(now_poses.begin(), now_poses.end(), poses.begin(), poses.end(), isPose);
  }

  const View& view(std::size_t projector, std::size_t surface) const {
    return views[projector * surfaces.size() + surface];
  }

  void placeAll() {
    views.clear();
    for (const auto& pose : poses) {
      for (const SurfacePatch& surface : surfaces) {
        const Eigen::Isometry3d T = (pose ? pose->matrix() : Eigen::Isometry3d::Identity()) *
                                    surface.T_world_surface.matrix();
        views.push_back({T, T.inverse().translation()});
      }
    }
    T_surface_surface.clear();
    for (const SurfacePatch& to : surfaces) {
      for (const SurfacePatch& from : surfaces) {
        T_surface_surface.push_back(to.T_world_surface.matrix().inverse() *
                                    from.T_world_surface.matrix());
      }
    }
  }

  /// The first place on a ray, in the frame of its surface.
  std::optional<std::pair<std::size_t, Eigen::Vector3d>> hit(std::size_t projector,
                                                             const Eigen::Vector2d& ray) const {
    double nearest = std::numeric_limits<double>::infinity();
    std::optional<std::pair<std::size_t, Eigen::Vector3d>> found;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
      const View& from = view(projector, i);
      const Eigen::Vector3d way = from.T_projector_surface.linear().transpose() * ray.homogeneous();
      const auto p = hitOf(surfaces[i], from.p_lens, way);
      if (!p) continue;
      const double depth = (*p - from.p_lens).dot(way) / way.squaredNorm();
      if (depth < LensDomain::kNear || depth >= nearest) continue;
      nearest = depth;
      found.emplace(i, *p);
    }
    return found;
  }

  static std::optional<Eigen::Vector3d> hitOf(const SurfacePatch& surface,
                                              const Eigen::Vector3d& from,
                                              const Eigen::Vector3d& way) {
    if (surface.relief) {
      return way.z() < 0 ? surface.relief->firstHit(from, way) : std::nullopt;
    }
    const Eigen::Vector3d p = from - from.z() / way.z() * way;
    const bool is_there =
        p.allFinite() && (surface.polygon.empty() || isInside(surface.polygon, p.head<2>()));
    return is_there ? std::optional(p) : std::nullopt;
  }

  /// 0 within the shadows of other surfaces on a place, 1 far outside.
  float lightBeside(std::size_t projector, std::size_t surface, const Eigen::Vector3d& p) const {
    float least = 1;
    for (std::size_t i = 0; i < surfaces.size() && least > 0; ++i) {
      if (i == surface || surfaces[i].polygon.empty()) continue;
      const Eigen::Vector3d q = T_surface_surface[i * surfaces.size() + surface] * p;
      const Eigen::Vector3d& p_lens = view(projector, i).p_lens;
      if (q.z() * p_lens.z() > 0 || std::abs(q.z()) < kTouch) continue;
      const Eigen::Vector2d crossed = (q + (p_lens - q) * (q.z() / (q.z() - p_lens.z()))).head<2>();
      if (isInside(surfaces[i].polygon, crossed)) return 0;
      const double ramp = distanceTo(surfaces[i].polygon, crossed) / kShadowRamp;
      least = static_cast<float>(std::min<double>(least, ramp));
    }
    return least;
  }

  /// Adds a projector's light on a place; returns its weight, 0 where it does not get there.
  float addLight(std::size_t projector, std::size_t surface, const Eigen::Vector3d& p, Spot& spot,
                 float& full) const {
    const View& from = view(projector, surface);
    const Beam& beam = beams[projector];
    const Eigen::Vector3d p_projector = from.T_projector_surface * p;
    if (p_projector.z() < LensDomain::kNear) return 0;
    const Eigen::Vector2d ray = p_projector.hnormalized();
    if (ray.squaredNorm() > static_cast<double>(beam.lens.square_fold)) return 0;
    const Corner corner = beam.lens.seen(static_cast<float>(ray.x()), static_cast<float>(ray.y()));
    const auto width = static_cast<float>(beam.width()), height = static_cast<float>(beam.height());
    if (!(corner.x > 0 && corner.x < width && corner.y > 0 && corner.y < height)) return 0;
    const float beside = lightBeside(projector, surface, p);
    if (beside <= 0) return 0;
    full = 1;
    if (is_flux_known) {
      const Eigen::Vector3d way = p - from.p_lens;
      full = static_cast<float>(beam.intensity(ray.x(), ray.y()) * std::abs(way.z()) /
                                std::pow(way.squaredNorm(), 1.5));
    }
    spot.lit_by |= 1u << projector;
    spot.black += static_cast<float>(beam.settings.black) * full;
    const float inward = inwardness(corner.x, width) * inwardness(corner.y, height) * beside;
    return inward * inward + 1e-9f;
  }

  Spot spotOf(std::size_t projector, const Eigen::Vector2d& ray) const {
    Spot spot;
    if (!ray.allFinite()) return spot;
    const auto found = hit(projector, ray);
    if (!found) return spot;
    const auto& [surface, p] = *found;
    float weights = 0, own = 0;
    spot.white = 0;
    for (std::size_t i = 0; i < beams.size(); ++i) {
      if (!poses[i]) continue;
      float full = 0;
      const float weight = addLight(i, surface, p, spot, full);
      weights += weight;
      spot.white += weight * full * static_cast<float>(beams[i].settings.white);
      if (i != projector) continue;
      own = weight;
      spot.own = full;
    }
    // Its own light gets there, but for rounding at the image's border.
    if (own <= 0) return {};
    spot.surface = static_cast<int>(surface);
    spot.share = own / weights;
    spot.white /= weights;
    return spot;
  }

  void findSpots(std::size_t projector) {
    const Beam& beam = beams[projector];
    std::vector<Spot>& of_nodes = spots[projector];
    const auto columns = static_cast<std::size_t>(beam.columns);
    of_nodes.resize(columns * static_cast<std::size_t>(beam.rows));
    workers.share(of_nodes.size(), [&](int, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector2d pixel(beam.column(static_cast<int>(i % columns)),
                                    beam.row(static_cast<int>(i / columns)));
        of_nodes[i] = spotOf(projector, beam.rays.ray(pixel));
      }
    });
  }

  /// What all places are evened to.
  void findGoals() {
    float darkest = std::numeric_limits<float>::infinity(), brightest = 0;
    black_goal = 0;
    for (const auto& of_nodes : spots) {
      for (const Spot& spot : of_nodes) {
        if ((spot.lit_by & (spot.lit_by - 1)) == 0) continue;
        darkest = std::min(darkest, spot.white);
        brightest = std::max(brightest, spot.white);
        black_goal = std::max(black_goal, spot.black);
      }
    }
    white_goal = std::max(darkest, static_cast<float>(kLeastEvened) * brightest);
  }

  float dimming(const Spot& spot) const {
    return is_flux_known && spot.white > white_goal ? white_goal / spot.white : 1;
  }
  float gain(const Spot& spot) const { return spot.share * dimming(spot); }
  float raise(const Spot& spot) const {
    if (spot.surface < 0) return 0;
    return std::clamp(spot.share * (black_goal - spot.black) / spot.own, 0.f, kMostRaised);
  }

  bool isSmooth(const std::array<const Spot*, 4>& corners) const {
    float least = 1, greatest = 0;
    for (const Spot* spot : corners) {
      if (spot->surface != corners[0]->surface) return false;
      if (evens_black && spot->lit_by != corners[0]->lit_by) return false;
      least = std::min(least, spot->share);
      greatest = std::max(greatest, spot->share);
    }
    return greatest - least < kSteep;
  }

  /// The nodes to the right and below are the next cells'; those of the image's last ones their
  /// own.
  void fillCell(std::size_t projector, int column, int row) {
    const Beam& beam = beams[projector];
    const auto node = [&](int x, int y) {
      return &spots[projector][static_cast<std::size_t>(y * beam.columns + x)];
    };
    const int x0 = beam.column(column), x1 = beam.column(column + 1);
    const int y0 = beam.row(row), y1 = beam.row(row + 1);
    const int x_end = column + 2 == beam.columns ? x1 + 1 : x1;
    const int y_end = row + 2 == beam.rows ? y1 + 1 : y1;
    const std::array<const Spot*, 4> corners = {node(column, row), node(column + 1, row),
                                                node(column, row + 1), node(column + 1, row + 1)};
    const auto at = [&](std::vector<std::uint16_t>& list, int x, int y) -> std::uint16_t& {
      return list[static_cast<std::size_t>(y) * static_cast<std::size_t>(beam.width()) +
                  static_cast<std::size_t>(x)];
    };
    PixelLight& light = lights[projector];
    if (!isSmooth(corners)) {
      for (int y = y0; y < y_end; ++y) {
        for (int x = x0; x < x_end; ++x) {
          const Spot spot = spotOf(projector, beam.rays.ray({x, y}));
          at(light.share, x, y) = rounded(gain(spot));
          if (evens_black) at(light.raise, x, y) = rounded(raise(spot));
        }
      }
      return;
    }
    const auto mix = [&](std::vector<std::uint16_t>& list, const std::array<float, 4>& of) {
      for (int y = y0; y < y_end; ++y) {
        const float down = static_cast<float>(y - y0) / static_cast<float>(y1 - y0);
        const float left = kFull * (of[0] + down * (of[2] - of[0])) + 0.5f;
        const float right = kFull * (of[1] + down * (of[3] - of[1])) + 0.5f;
        const float step = (right - left) / static_cast<float>(x1 - x0);
        std::uint16_t* out = &at(list, x0, y);
        for (int x = 0; x < x_end - x0; ++x) {
          out[x] = static_cast<std::uint16_t>(left + step * static_cast<float>(x));
        }
      }
    };
    mix(light.share, {gain(*corners[0]), gain(*corners[1]), gain(*corners[2]), gain(*corners[3])});
    if (!evens_black) return;
    mix(light.raise,
        {raise(*corners[0]), raise(*corners[1]), raise(*corners[2]), raise(*corners[3])});
  }

  static std::uint16_t rounded(float share) {
    return static_cast<std::uint16_t>(kFull * share + 0.5f);
  }

  void fill(std::size_t projector) {
    const Beam& beam = beams[projector];
    const std::size_t pixels =
        static_cast<std::size_t>(beam.width()) * static_cast<std::size_t>(beam.height());
    lights[projector].share.resize(pixels);
    if (evens_black) lights[projector].raise.resize(pixels);
    const int columns = beam.columns - 1, cells = columns * (beam.rows - 1);
    workers.share(static_cast<std::size_t>(cells), [&](int, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const int cell = static_cast<int>(i);
        fillCell(projector, cell % columns, cell / columns);
      }
    });
  }

  Summary summaryOf(std::size_t projector) const {
    Summary summary;
    std::size_t shared = 0;
    for (const Spot& spot : spots[projector]) {
      shared += (spot.lit_by & (spot.lit_by - 1)) != 0;
      summary.dimmed = std::min(summary.dimmed, double{dimming(spot)});
      if (evens_black) summary.raised = std::max(summary.raised, double{raise(spot)});
    }
    summary.shared = static_cast<double>(shared) /
                     static_cast<double>(std::max<std::size_t>(1, spots[projector].size()));
    return summary;
  }

  std::vector<Beam> beams;
  bool is_flux_known = false;
  bool evens_black = false;
  Workers workers;
  std::vector<SurfacePatch> surfaces;
  Poses poses;
  std::vector<View> views;                           ///< by projector, then surface
  std::vector<Eigen::Isometry3d> T_surface_surface;  ///< to, then from
  std::vector<std::vector<Spot>> spots;              ///< of nodes, by projector
  float white_goal = 0, black_goal = 0;
  std::vector<PixelLight> lights;
  std::vector<Summary> summaries;
};

LightBlend::LightBlend(std::vector<BlendedProjector> projectors, bool evens_black)
    : impl_(std::make_unique<Impl>()) {
  if (projectors.size() > kMost) throw std::logic_error("too many projectors to blend");
  for (const BlendedProjector& projector : projectors) impl_->beams.emplace_back(projector);
  impl_->is_flux_known =
      std::all_of(projectors.begin(), projectors.end(), [](const auto& p) { return p.lumens > 0; });
  impl_->evens_black = evens_black;
  impl_->spots.resize(projectors.size());
  impl_->lights.resize(projectors.size());
  impl_->summaries.resize(projectors.size());
}

LightBlend::~LightBlend() = default;

void LightBlend::update(const std::vector<SurfacePatch>& surfaces, const Impl::Poses& poses) {
  if (poses.size() != impl_->beams.size()) throw std::logic_error("not one pose a projector");
  if (impl_->isSameAsBefore(surfaces, poses)) return;
  impl_->surfaces = surfaces;
  impl_->poses = poses;
  impl_->placeAll();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    impl_->spots[i].clear();
    if (!poses[i]) impl_->lights[i] = {};
    if (poses[i]) impl_->findSpots(i);
  }
  impl_->findGoals();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i]) impl_->fill(i);
    impl_->summaries[i] = impl_->summaryOf(i);
  }
}

const PixelLight& LightBlend::light(std::size_t projector) const {
  return impl_->lights.at(projector);
}

LightBlend::Summary LightBlend::summary(std::size_t projector) const {
  return impl_->summaries.at(projector);
}

}  // namespace afterglow::render
