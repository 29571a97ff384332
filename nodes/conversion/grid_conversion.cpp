#include "nodes/conversion/grid_conversion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "nodes/conversion/camera_messages.hpp"

namespace afterglow::nodes {
namespace {

using render::Rgba;

const char kCoarser[] =
    "more than 131072 rectangles of different cells: drawn at less than its resolution";

/// Cells of one value, from the first to before the last.
template <typename Value>
struct Rectangle {
  int left, right, top, bottom;
  Value value;
};

/// Joins equal cells of a row, then equal runs of neighboring rows. False: there are more than
/// kMostRectangles.
template <typename Value, typename ValueAt>
bool joinCells(int columns, int rows, const ValueAt& value_at,
               std::vector<Rectangle<Value>>& rectangles) {
  std::vector<Rectangle<Value>> open, next;
  rectangles.clear();
  for (int row = 0; row < rows && rectangles.size() + open.size() <= kMostRectangles; ++row) {
    next.clear();
    auto above = open.begin();
    for (int left = 0, right = 0; left < columns; left = right) {
      const Value value = value_at(left, row);
      for (right = left + 1; right < columns && value_at(right, row) == value;) ++right;
      while (above != open.end() && above->left < left) rectangles.push_back(*above++);
      const bool goes_on = above != open.end() && above->left == left && above->right == right &&
                           above->value == value;
      next.push_back({left, right, goes_on ? above++->top : row, row + 1, value});
    }
    rectangles.insert(rectangles.end(), above, open.end());
    open.swap(next);
  }
  rectangles.insert(rectangles.end(), open.begin(), open.end());
  return rectangles.size() <= kMostRectangles;
}

/// The rectangles as a body. `color_of(value)`; `place_of(column, row)` of corners.
template <typename Value, typename ColorOf, typename PlaceOf>
Converted<Drawables> toBody(const std::vector<Rectangle<Value>>& rectangles,
                            const ColorOf& color_of, const PlaceOf& place_of, std::string remark) {
  auto body = std::make_shared<render::Body>();
  for (const Rectangle<Value>& r : rectangles) {
    const Rgba color = color_of(r.value);
    if (color.a == 0) continue;
    const std::array<Eigen::Vector3f, 4> corners = {
        place_of(r.left, r.top), place_of(r.right, r.top), place_of(r.right, r.bottom),
        place_of(r.left, r.bottom)};
    const bool is_placed = std::all_of(corners.begin(), corners.end(),
                                       [](const auto& corner) { return corner.allFinite(); });
    if (!is_placed) continue;
    const auto first = static_cast<std::uint32_t>(body->points.size());
    body->points.insert(body->points.end(), corners.begin(), corners.end());
    body->colors.insert(body->colors.end(), 4, render::asShares(color));
    body->triangles.push_back({first, first + 1, first + 2});
    body->triangles.push_back({first, first + 2, first + 3});
  }
  Drawables drawables;
  if (!body->points.empty()) {
    render::MeshInstance mesh;
    mesh.body = std::move(body);
    mesh.own_colors = true;
    drawables.push_back({{}, std::move(mesh), {}});
  }
  return {std::move(drawables), std::move(remark)};
}

int parts(int whole, int stride) { return (whole + stride - 1) / stride; }

}  // namespace

render::Rgba cellColor(ColorScheme scheme, std::int8_t value) {
  const auto byte = static_cast<std::uint8_t>(value);
  if (scheme == ColorScheme::Raw) return {byte, byte, byte, 255};
  if (value == -1) return {0x70, 0x89, 0x86, 255};  // unknown
  if (value < -1) {                                 // no value; yellow
    return {255, static_cast<std::uint8_t>(255 * (byte - 128) / (254 - 128)), 0, 255};
  }
  if (value > 100) return {0, 255, 0, 255};  // no value, either
  if (scheme == ColorScheme::Map) {
    const auto light = static_cast<std::uint8_t>(255 - 255 * value / 100);
    return {light, light, light, 255};
  }
  if (value == 0) return {0, 0, 0, 0};
  if (value == 99) return {0, 255, 255, 255};   // the robot would touch something
  if (value == 100) return {255, 0, 255, 255};  // something is there
  const auto red = static_cast<std::uint8_t>(255 * value / 100);
  return {red, 0, static_cast<std::uint8_t>(255 - red), 255};
}

std::string mapFault(const nav_msgs::OccupancyGrid& map) {
  const std::uint64_t cells = std::uint64_t{map.info.width} * map.info.height;
  if (cells > kMostMapCells) return "more than 67108864 cells";
  if (cells != map.data.size()) return "data is not as long as width times height";
  if (cells == 0) return {};
  const double resolution = double{map.info.resolution};
  if (!(resolution > 0)) return "resolution is not positive";
  if (!toVector(resolution * map.info.width, resolution * map.info.height, 0)) {
    return "resolution is not finite or absurdly large";
  }
  const auto origin = toPose(map.info.origin);
  return origin.value ? "" : "the origin's " + origin.reason;
}

Converted<Drawables> toMapShapes(const nav_msgs::OccupancyGrid& map, ColorScheme scheme) {
  if (std::string fault = mapFault(map); !fault.empty()) return refused<Drawables>(fault);
  if (map.data.empty()) return {Drawables(), {}};
  const int width = static_cast<int>(map.info.width), height = static_cast<int>(map.info.height);
  const auto at = [&](int column, int row) {
    return map
        .data[static_cast<std::size_t>(row) * map.info.width + static_cast<std::size_t>(column)];
  };
  std::vector<Rectangle<std::int8_t>> rectangles;
  int stride = 1;
  const auto greatest = [&](int column, int row) {
    const int right = std::min((column + 1) * stride, width);
    const int bottom = std::min((row + 1) * stride, height);
    std::int8_t value = at(column * stride, row * stride);
    for (int y = row * stride; y < bottom; ++y) {
      for (int x = column * stride; x < right; ++x) value = std::max(value, at(x, y));
    }
    return value;
  };
  bool fits = joinCells<std::int8_t>(width, height, at, rectangles);
  for (; !fits; fits = joinCells<std::int8_t>(parts(width, stride), parts(height, stride), greatest,
                                              rectangles)) {
    stride *= 2;
  }
  const auto origin = toPose(map.info.origin);
  std::string remark = stride > 1 ? kCoarser : "";
  if (!origin.reason.empty()) remark = "the origin's " + origin.reason;
  const double resolution = double{map.info.resolution};
  auto drawables = toBody(
      rectangles, [scheme](std::int8_t value) { return cellColor(scheme, value); },
      [&](int x, int y) {
        return Eigen::Vector3f(static_cast<float>(resolution * std::min(x * stride, width)),
                               static_cast<float>(resolution * std::min(y * stride, height)), 0);
      },
      std::move(remark));
  for (render::Drawable& drawable : *drawables.value) {
    drawable.pose = Rigid<World, World>(*origin.value);
  }
  return drawables;
}

std::string updateMap(const map_msgs::OccupancyGridUpdate& update, nav_msgs::OccupancyGrid& map) {
  const bool is_inside = update.x >= 0 && update.y >= 0 &&
                         std::uint64_t(update.x) + update.width <= map.info.width &&
                         std::uint64_t(update.y) + update.height <= map.info.height;
  if (!is_inside) return "an update reaches out of its map";
  if (std::uint64_t{update.width} * update.height != update.data.size()) {
    return "an update's data is not as long as width times height";
  }
  for (std::size_t row = 0; row < update.height; ++row) {
    const auto from = update.data.begin() + static_cast<std::ptrdiff_t>(row * update.width);
    const std::size_t to = (static_cast<std::size_t>(update.y) + row) * map.info.width;
    std::copy(from, from + static_cast<std::ptrdiff_t>(update.width),
              map.data.begin() + static_cast<std::ptrdiff_t>(to) + update.x);
  }
  return {};
}

Converted<Drawables> toImageShapes(const sensor_msgs::Image& message, const ImagePlane& plane) {
  render::Image image;
  try {
    image = toColors(message);
  } catch (const std::invalid_argument& error) {
    return refused<Drawables>(error.what());
  }
  const int width = image.width, height = image.height;
  if (plane.lens && (plane.lens->width != width || plane.lens->height != height)) {
    return refused<Drawables>("the image is not of its camera_info's size");
  }
  using Sum = std::array<unsigned, 3>;
  int stride = 1;
  const auto mean = [&](int column, int row) {
    const int right = std::min((column + 1) * stride, width);
    const int bottom = std::min((row + 1) * stride, height);
    Sum sum{};
    for (int y = row * stride; y < bottom; ++y) {
      for (int x = column * stride; x < right; ++x) {
        const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                    static_cast<std::size_t>(x));
        for (std::size_t i = 0; i < 3; ++i) sum[i] += image.rgb[at + i];
      }
    }
    const auto count = static_cast<unsigned>((right - column * stride) * (bottom - row * stride));
    for (unsigned& channel : sum) channel = (channel + count / 2) / count;
    return sum;
  };
  std::vector<Rectangle<Sum>> rectangles;
  while (!joinCells<Sum>(parts(width, stride), parts(height, stride), mean, rectangles)) {
    stride *= 2;
  }
  // Corners of pixels lie half a pixel before their centers.
  const auto place = [&](int x, int y) {
    const double u = std::min(x * stride, width) - 0.5, v = std::min(y * stride, height) - 0.5;
    if (!plane.lens) {
      const double pixel = plane.width / width;
      return Eigen::Vector3f(
          (plane.center + pixel * Eigen::Vector3d(u - (width - 1) / 2.0, (height - 1) / 2.0 - v, 0))
              .cast<float>());
    }
    const auto ray = calib::unproject(*plane.lens, {u, v});
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    return ray ? Eigen::Vector3f((*ray * plane.distance).cast<float>())
               : Eigen::Vector3f::Constant(kNone);
  };
  return toBody(
      rectangles,
      [](const Sum& sum) {
        return Rgba{static_cast<std::uint8_t>(sum[0]), static_cast<std::uint8_t>(sum[1]),
                    static_cast<std::uint8_t>(sum[2]), 255};
      },
      place, stride > 1 ? kCoarser : "");
}

}  // namespace afterglow::nodes
