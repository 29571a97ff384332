#include "render/body_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "render/scene/closed_body.hpp"

namespace afterglow::render {
namespace {

struct Head {
  char kind[8] = {'A', 'G', 'B', 'O', 'D', 'Y', '0', '1'};
  std::uint64_t points = 0, colors = 0, triangles = 0;
};

using Triangle = std::array<std::uint32_t, 3>;

[[noreturn]] void fail() { throw std::runtime_error("no triangles in these bytes"); }

template <typename T>
void append(std::string& bytes, const std::vector<T>& list) {
  if (!list.empty()) {
    bytes.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T));
  }
}

/// Takes a list that is known to lie there.
template <typename T>
std::vector<T> take(const std::string& bytes, std::size_t& at, std::uint64_t count) {
  std::vector<T> list(count);
  if (count > 0) std::memcpy(static_cast<void*>(list.data()), &bytes[at], count * sizeof(T));
  at += count * sizeof(T);
  return list;
}

bool isSound(const Body& body) {
  const auto finite = [](const Eigen::Vector3f& p) { return p.allFinite(); };
  const auto lit = [](const Color& c) {
    return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b) && std::isfinite(c.a);
  };
  const auto known = [&body](const Triangle& t) {
    return std::max({t[0], t[1], t[2]}) < body.points.size();
  };
  return std::all_of(body.points.begin(), body.points.end(), finite) &&
         std::all_of(body.colors.begin(), body.colors.end(), lit) &&
         std::all_of(body.triangles.begin(), body.triangles.end(), known);
}

}  // namespace

std::string toBytes(const Body& body) {
  Head head;
  head.points = body.points.size();
  head.colors = body.colors.size();
  head.triangles = body.triangles.size();
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof(head));
  append(bytes, body.points);
  append(bytes, body.colors);
  append(bytes, body.triangles);
  return bytes;
}

Body bodyFromBytes(const std::string& bytes) {
  Head head;
  if (bytes.size() < sizeof(head)) fail();
  if (std::memcmp(bytes.data(), head.kind, sizeof(head.kind)) != 0) fail();
  std::memcpy(&head, bytes.data(), sizeof(head));
  // Each count first by itself, so that their sum cannot wrap round.
  const std::uint64_t most = bytes.size();
  if (head.points > most || head.colors > most || head.triangles > most) fail();
  if (head.colors != 0 && head.colors != head.points) fail();
  if (sizeof(head) + head.points * sizeof(Eigen::Vector3f) + head.colors * sizeof(Color) +
          head.triangles * sizeof(Triangle) !=
      most) {
    fail();
  }
  std::size_t at = sizeof(head);
  Body body;
  body.points = take<Eigen::Vector3f>(bytes, at, head.points);
  body.colors = take<Color>(bytes, at, head.colors);
  body.triangles = take<Triangle>(bytes, at, head.triangles);
  if (!isSound(body)) fail();
  findWhetherClosed(body);
  return body;
}

}  // namespace afterglow::render
