#include "render/compose/light_census.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <variant>

namespace afterglow::render {
namespace {

constexpr std::size_t kMostPoints = 2000;  // of a cloud; more are looked at in steps
constexpr double kLarge = 24;              // px; larger things are no sprites (paint/sprites.hpp)

constexpr double kLeastLight = 0.5 / 255;  // less becomes 0 in a picture

/// The share of a channel's full light, over black.
double lightOf(const Rgba& color) {
  return std::max({color.r, color.g, color.b}) / 255.0 * color.a / 255.0;
}
double lightOf(const Color& color, float gain) {
  return static_cast<double>(std::max({color.r, color.g, color.b}) * gain * color.a);
}

/// The light of single pixels by small things together.
class PixelLight {
 public:
  /// Returns true if the pixel at this place is lit, now that this light has come to it.
  bool add(const Eigen::Vector2d& pixel, double light) {
    if (light >= kLeastLight) return true;
    double& sum = sums_[{std::floor(pixel.x()), std::floor(pixel.y())}];
    return (sum += light) >= kLeastLight;
  }

 private:
  std::map<std::pair<double, double>, double> sums_;
};

/// The most of a pixel that a triangle covers: of a sliver its height. In pixels.
double coverage(const std::array<Eigen::Vector2d, 3>& t) {
  const Eigen::Vector2d a = t[1] - t[0], b = t[2] - t[0];
  const double longest = std::max({a.norm(), b.norm(), (b - a).norm()});
  if (!(longest > 0)) return 0;
  const double height = std::abs(a.x() * b.y() - a.y() * b.x()) / longest;
  return std::min(height, 1.0) * std::min(longest, 1.0);
}

Eigen::Vector2d onImage(const Eigen::Vector3d& p) { return p.head<2>() / p.z(); }
Eigen::Vector2d onImage(const LightVertex& v) {
  return Eigen::Vector2d(static_cast<double>(v.x), static_cast<double>(v.y)) /
         static_cast<double>(v.z);
}

/// Returns true if the point lies within by the even-odd rule.
bool isWithin(const SeenOutline& outline, const Eigen::Vector2d& p) {
  bool is_within = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d a = onImage(outline[i]);
    const Eigen::Vector2d b = onImage(outline[(i + 1) % outline.size()]);
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    const double x = a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y());
    if (p.x() < x) is_within = !is_within;
  }
  return is_within;
}

bool isOpen(const ComposedMask* mask, const Eigen::Vector2d& p) {
  if (mask == nullptr) return true;
  if (mask->outline && !isWithin(*mask->outline, p)) return false;
  return std::none_of(mask->shades.begin(), mask->shades.end(),
                      [&](const SeenOutline& shade) { return isWithin(shade, p); });
}

bool isWithin(const std::array<Eigen::Vector2d, 3>& triangle, const Eigen::Vector2d& p) {
  const auto side = [&](std::size_t i) {
    const Eigen::Vector2d along = triangle[(i + 1) % 3] - triangle[i], to = p - triangle[i];
    return along.x() * to.y() - along.y() * to.x();
  };
  const double a = side(0), b = side(1), c = side(2);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

/// Returns true if some of a triangle lies where light may fall, as its corners and its middle
/// tell, and an outline's corners that lie in it.
bool isOpen(const ComposedMask* mask, const std::array<Eigen::Vector2d, 3>& triangle) {
  if (mask == nullptr) return true;
  const Eigen::Vector2d middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
  if (isOpen(mask, middle)) return true;
  for (const Eigen::Vector2d& corner : triangle) {
    if (isOpen(mask, corner)) return true;
  }
  if (!mask->outline) return false;
  return std::any_of(mask->outline->begin(), mask->outline->end(), [&](const Eigen::Vector3d& p) {
    return isWithin(triangle, onImage(p));
  });
}

const ComposedMask* maskOf(const ComposedLayer& layer, const ComposedImage& image) {
  return layer.mask < 0 ? nullptr : &image.masks[static_cast<std::size_t>(layer.mask)];
}

bool isBehind(const Eigen::Vector4d& p_optical) { return p_optical.z() * p_optical.w() <= 0; }

}  // namespace

std::vector<LayerCensus> LightCensus::count(const Scene& scene,
                                            const Rigid<Projector, World>& T_projector_world) {
  const ComposedImage& image = composer_.compose(scene, T_projector_world);
  std::vector<LayerCensus> all;
  for (std::size_t i = 0; i < image.layers.size(); ++i) {
    LayerCensus census;
    census.name = scene.layers[i].name;
    for (const Drawable* drawable : image.layers[i].steps) {
      ++census.drawables;
      is_thinned_ = false;
      ++(census.*fateOf(*drawable, image.layers[i], image));
      if (is_thinned_) ++census.thinned;
    }
    all.push_back(std::move(census));
  }
  return all;
}

struct LightCensus::Things {
  const PointList& points;
  const ByteColorList* bytes;  ///< colors of a cloud's points
  const ColorList* colors;     ///< colors of a list
  double size;                 ///< meters
  bool is_pixels;              ///< true: each is as large as so many pixels
  bool is_too_many;            ///< true: too many to be drawn all, if they are large

  Color color(std::size_t i, const Color& otherwise) const {
    if (bytes != nullptr && i < bytes->size()) return asShares((*bytes)[i]);
    return colors != nullptr && i < colors->size() ? (*colors)[i] : otherwise;
  }
  bool hasColor(std::size_t i) const {
    return i < (bytes != nullptr ? bytes->size() : colors->size());
  }
  static std::optional<Things> of(const Shape& shape) {
    if (const auto* cloud = std::get_if<PointCloud>(&shape)) {
      const bool is_too_many = 4 * cloud->points.size() > kMostCorners;
      return Things{cloud->points.get(), &cloud->colors.get(),
                    nullptr,             static_cast<double>(cloud->size),
                    pixelCloud(shape) != nullptr, is_too_many};
    }
    const auto* list = std::get_if<ShapeList>(&shape);
    if (list == nullptr) return std::nullopt;
    return Things{list->points.get(), nullptr, &list->colors.get(),
                  static_cast<double>(list->size.maxCoeff()), false,
                  cornersOf(shape) >= kMostCorners};
  }
};

LightCensus::Fate LightCensus::fateOf(const Drawable& drawable, const ComposedLayer& layer,
                                      const ComposedImage& image) {
  if (const auto things = Things::of(drawable.shape)) {
    if (things->is_pixels || things->points.size() > kMostPoints) {
      return fateOfThings(*things, drawable, layer, image);
    }
  }
  triangles_.place(drawable, layer);
  const Mesh& mesh = triangles_.tessellation().mesh;
  const auto& lines = triangles_.tessellation().thin_lines;
  if (mesh.points.empty() && lines.empty()) {
    return std::holds_alternative<Text>(drawable.shape) ? &LayerCensus::blank
                                                        : &LayerCensus::empty;
  }
  if (lines.empty() && std::all_of(mesh.colors.begin(), mesh.colors.end(), isInvisible)) {
    return &LayerCensus::transparent;
  }
  seen_.vertices.clear();
  seen_.indices.clear();
  if (const std::optional<Piece> piece = triangles_.add(seen_)) {
    return fateOfPiece(*piece, maskOf(layer, image));
  }
  const auto& P_optical_world = layer.placed.P_optical_world;
  const bool is_behind =
      !mesh.points.empty() &&
      std::all_of(mesh.points.begin(), mesh.points.end(), [&](const Eigen::Vector3d& p) {
        return isBehind(P_optical_world * p.homogeneous());
      });
  return is_behind ? &LayerCensus::behind : &LayerCensus::outside;
}

LightCensus::Fate LightCensus::fateOfPiece(const Piece& piece, const ComposedMask* mask) const {
  PixelLight pixels;
  bool is_black = true, is_flat = true;
  for (std::uint32_t i = piece.first; i + 2 < piece.first + piece.count; i += 3) {
    std::array<Eigen::Vector2d, 3> triangle, on_pixels;
    double light = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const LightVertex& vertex = seen_.vertices[seen_.indices[i + k]];
      triangle[k] = onImage(vertex);
      on_pixels[k] = triangle[k].cwiseProduct(domain_.focal());
      light = std::max(light, lightOf(vertex.color));
    }
    if (light < kLeastLight) continue;
    is_black = false;
    if (!pixels.add(on_pixels[0], coverage(on_pixels) * light)) continue;
    is_flat = false;
    if (isOpen(mask, triangle)) return &LayerCensus::lit;
  }
  return is_black ? &LayerCensus::black : is_flat ? &LayerCensus::flat : &LayerCensus::clipped;
}

/// Judges things by their points' centers.
LightCensus::Fate LightCensus::fateOfThings(const Things& things, const Drawable& drawable,
                                            const ComposedLayer& layer,
                                            const ComposedImage& image) {
  const PointList& points = things.points;
  const ComposedMask* mask = maskOf(layer, image);
  const std::size_t step = points.size() / kMostPoints + 1;
  const double size = things.size * domain_.focal().mean();
  PixelLight pixels;
  bool has_alpha = false, has_light = false, is_before = false, is_in_light = false,
       has_points = false, has_extent = false;
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (!points[i].allFinite()) continue;
    has_points = true;
    Color color = things.color(i, drawable.color);
    if (things.hasColor(i)) color.a *= drawable.color.a;
    has_alpha = has_alpha || color.a > 0;
    const double light = lightOf(color, layer.placed.gain);
    if (light < kLeastLight) continue;
    has_light = true;
    Eigen::Vector3d p_world = drawable.pose.matrix() * points[i].cast<double>();
    if (layer.relief != nullptr && !things.is_pixels) {  // the composer has laid the others
      const auto spot = layer.relief->place(p_world);
      if (!spot) continue;
      p_world = *spot;
    }
    CutVertex vertex;
    vertex.p_optical = layer.placed.P_optical_world * p_world.homogeneous();
    if (isBehind(vertex.p_optical)) continue;
    is_before = true;
    if (!isInside(domain_, vertex)) continue;
    is_in_light = true;
    // Those of a pixel's size are as large from everywhere; of others one stands for `step`.
    const double seen = size / vertex.p_optical.z();
    const double side = things.is_pixels ? 1 : std::min(1.0, seen);
    is_thinned_ = is_thinned_ || (things.is_too_many && !things.is_pixels && seen > kLarge);
    const Eigen::Vector2d on_pixels = normalized(vertex).cwiseProduct(domain_.focal());
    if (!pixels.add(on_pixels, side * side * light * static_cast<double>(step))) continue;
    has_extent = true;
    if (isOpen(mask, normalized(vertex))) return &LayerCensus::lit;
  }
  if (!has_points) return &LayerCensus::empty;
  if (!has_light) return has_alpha ? &LayerCensus::black : &LayerCensus::transparent;
  if (!is_before && layer.relief == nullptr) return &LayerCensus::behind;
  if (!is_in_light) return &LayerCensus::outside;
  return has_extent ? &LayerCensus::clipped : &LayerCensus::flat;
}

}  // namespace afterglow::render
