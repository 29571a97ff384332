#include "nodes/pages/drawing.hpp"

#include <cmath>

#include "calib/number_text.hpp"

namespace afterglow::nodes {
namespace {

double rounded(double value) { return std::round(value * 100) / 100; }

}  // namespace

Drawing::Drawing(const std::string& kind, double width, double height, double letters,
                 const std::string& label)
    : data_({{"kind", kind},
             {"width", rounded(width)},
             {"height", rounded(height)},
             {"letters", rounded(letters)},
             {"label", label},
             {"shapes", PageData::array()}}) {}

void Drawing::add(const char* kind, PageData shape) {
  shape[kind] = true;
  data_["shapes"].push_back(std::move(shape));
}

void Drawing::box(const std::string& look, double x, double y, double width, double height) {
  add("is_box", {{"look", look},
                 {"x", rounded(x)},
                 {"y", rounded(y)},
                 {"w", rounded(width)},
                 {"h", rounded(height)}});
}

void Drawing::path(const std::string& look, const std::string& d) {
  if (!d.empty()) add("is_path", {{"look", look}, {"d", d}});
}

void Drawing::text(const std::string& look, double x, double y, const std::string& words) {
  add("is_text", {{"look", look}, {"x", rounded(x)}, {"y", rounded(y)}, {"words", words}});
}

void Drawing::ring(const std::string& look, const Eigen::Vector2d& center, double radius,
                   const std::string& words) {
  add("is_ring", {{"look", look},
                  {"x", rounded(center.x())},
                  {"y", rounded(center.y())},
                  {"r", rounded(radius)},
                  {"words", words}});
}

void Drawing::image(const std::string& uri) {
  add("is_image", {{"w", data_["width"]}, {"h", data_["height"]}, {"uri", uri}});
}

std::string coordinate(double value) {
  std::string text = calib::fixedText(value, 2);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string point(const Eigen::Vector2d& value) {
  return coordinate(value.x()) + " " + coordinate(value.y());
}

double roundDown(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  const double lead = value / power;
  return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

}  // namespace afterglow::nodes
