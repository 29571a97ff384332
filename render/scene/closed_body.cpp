#include "render/scene/closed_body.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace afterglow::render {
namespace {

/// Returns for each point the first point at its place.
std::vector<std::uint32_t> placesOf(const PointList& points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto isBefore = [&](std::uint32_t a, std::uint32_t b) {
    return std::lexicographical_compare(points[a].data(), points[a].data() + 3, points[b].data(),
                                        points[b].data() + 3);
  };
  std::sort(order.begin(), order.end(), isBefore);
  std::vector<std::uint32_t> places(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_new = i == 0 || points[order[i]] != points[order[i - 1]];
    places[order[i]] = is_new ? order[i] : places[order[i - 1]];
  }
  return places;
}

}  // namespace

void findWhetherClosed(Body& body) {
  body.is_closed = false;
  const std::vector<std::uint32_t> places = placesOf(body.points);
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> edges, reversed;
  double volume = 0;  // six times
  for (const auto& t : body.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = places[t[i]], b = places[t[(i + 1) % 3]];
      if (a == b) continue;  // a sliver's corners may coincide
      edges.emplace_back(a, b);
      reversed.emplace_back(b, a);
    }
    const auto p = [&](std::size_t i) { return Eigen::Vector3d(body.points[t[i]].cast<double>()); };
    volume += p(0).dot(p(1).cross(p(2)));
  }
  std::sort(edges.begin(), edges.end());
  std::sort(reversed.begin(), reversed.end());
  body.is_closed = volume > 0 && edges == reversed;
}

void findOutline(Body& body) {
  using Edge = std::array<std::uint32_t, 2>;
  std::vector<Edge> edges, reversed;
  for (const auto& t : body.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      edges.push_back({t[i], t[(i + 1) % 3]});
      reversed.push_back({t[(i + 1) % 3], t[i]});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::sort(reversed.begin(), reversed.end());
  body.outline.clear();
  std::set_difference(edges.begin(), edges.end(), reversed.begin(), reversed.end(),
                      std::back_inserter(body.outline));
}

}  // namespace afterglow::render
