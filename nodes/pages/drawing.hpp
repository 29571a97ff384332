/// \file
/// The drawings of a page: shapes, of which drawing.html makes SVG.
#pragma once

#include <Eigen/Core>
#include <string>

#include "nodes/pages/page.hpp"

namespace afterglow::nodes {

/// Shapes over a picture of width x height px, in the order they are drawn. Pixel coordinates: the
/// center of the top-left pixel is (0, 0). A shape's look, and the drawing's kind, are classes of
/// style.css, which has their colors, light and dark.
class Drawing {
 public:
  /// `letters`: height of a text, px. The label is read out to who cannot see the drawing.
  Drawing(const std::string& kind, double width, double height, double letters,
          const std::string& label);

  void box(const std::string& look, double x, double y, double width, double height);
  /// `d`: SVG's path data, made with point() and dotAt(). Nothing is drawn if it is empty.
  void path(const std::string& look, const std::string& d);
  void text(const std::string& look, double x, double y, const std::string& words);
  /// The words are shown when it is pointed at.
  void ring(const std::string& look, const Eigen::Vector2d& center, double radius,
            const std::string& words);
  /// Draws an image over the whole drawing.
  void image(const std::string& uri);

  /// The data for drawing.html.
  const PageData& data() const { return data_; }

 private:
  void add(const char* kind, PageData shape);

  PageData data_;
};

/// A coordinate: two decimals at most.
std::string coordinate(double value);
/// "x y"
std::string point(const Eigen::Vector2d& value);
/// Path data of a dot: a line of no length with round ends.
inline std::string dotAt(const Eigen::Vector2d& at) { return "M" + point(at) + "h0"; }

/// 1, 2 or 5 times a power of ten, not above the value (> 0).
double roundDown(double value);

}  // namespace afterglow::nodes
