#include "render/compose/light_census.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace afterglow::render {
namespace {

constexpr std::size_t kMostPoints = 2000;  // of a cloud; more are looked at in steps

bool isDark(const Rgba& color) {
  return isInvisible(color) || (color.r == 0 && color.g == 0 && color.b == 0);
}

bool isDark(const Color& color, float gain) {
  const float least = 0.5f / 255;
  return color.a <= 0 || std::max({color.r, color.g, color.b}) * gain < least;
}

Eigen::Vector2d onImage(const Eigen::Vector3d& p) { return p.head<2>() / p.z(); }
Eigen::Vector2d onImage(const LightVertex& v) {
  return Eigen::Vector2d(static_cast<double>(v.x), static_cast<double>(v.y)) /
         static_cast<double>(v.z);
}

/// By the even-odd rule.
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

/// Whether some of a triangle lies where light may fall, as its corners and its middle tell, and an
/// outline's corners that lie in it.
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
      ++(census.*fateOf(*drawable, image.layers[i], image));
    }
    all.push_back(std::move(census));
  }
  return all;
}

LightCensus::Fate LightCensus::fateOf(const Drawable& drawable, const ComposedLayer& layer,
                                      const ComposedImage& image) {
  const auto* cloud = std::get_if<PointCloud>(&drawable.shape);
  const bool is_large = cloud != nullptr && cloud->points.size() > kMostPoints;
  if (is_large || pixelCloud(drawable.shape) != nullptr) {
    return fateOfCloud(*cloud, drawable, layer, image);
  }
  triangles_.place(drawable, layer);
  const Mesh& mesh = triangles_.tessellation().mesh;
  const auto& lines = triangles_.tessellation().thin_lines;
  if (mesh.points.empty() && lines.empty()) return &LayerCensus::empty;
  if (lines.empty() && std::all_of(mesh.colors.begin(), mesh.colors.end(), isInvisible)) {
    return &LayerCensus::black;
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
  bool is_dark = true;
  for (std::uint32_t i = piece.first; i + 2 < piece.first + piece.count; i += 3) {
    std::array<Eigen::Vector2d, 3> triangle;
    bool has_light = false;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const LightVertex& vertex = seen_.vertices[seen_.indices[i + k]];
      triangle[k] = onImage(vertex);
      has_light = has_light || !isDark(vertex.color);
    }
    if (!has_light) continue;
    is_dark = false;
    if (isOpen(mask, triangle)) return &LayerCensus::lit;
  }
  return is_dark ? &LayerCensus::black : &LayerCensus::clipped;
}

/// By its points' centers.
LightCensus::Fate LightCensus::fateOfCloud(const PointCloud& cloud, const Drawable& drawable,
                                           const ComposedLayer& layer,
                                           const ComposedImage& image) const {
  const auto& points = cloud.points.get();
  const auto& colors = cloud.colors.get();
  const ComposedMask* mask = maskOf(layer, image);
  const bool is_laid = pixelCloud(drawable.shape) != nullptr;  // the composer has done it
  const std::size_t step = points.size() / kMostPoints + 1;
  bool has_light = false, is_before = false, is_in_light = false, has_points = false;
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (!points[i].allFinite()) continue;
    has_points = true;
    Color color = i < colors.size() ? asShares(colors[i]) : drawable.color;
    if (i < colors.size()) color.a *= drawable.color.a;
    if (isDark(color, layer.placed.gain)) continue;
    has_light = true;
    Eigen::Vector3d p_world = drawable.pose.matrix() * points[i].cast<double>();
    if (layer.relief != nullptr && !is_laid) {
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
    if (isOpen(mask, normalized(vertex))) return &LayerCensus::lit;
  }
  if (!has_points) return &LayerCensus::empty;
  if (!has_light) return &LayerCensus::black;
  if (!is_before && layer.relief == nullptr) return &LayerCensus::behind;
  return is_in_light ? &LayerCensus::clipped : &LayerCensus::outside;
}

}  // namespace afterglow::render
