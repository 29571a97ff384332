/// \file
/// The drawings of a page: shapes, of which drawing.html makes SVG; and plots over time.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "nodes/pages/page.hpp"
#include "replay/play/figures.hpp"

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

/// Seconds go right from 0. What is added first lies below. Sizes in the drawing's own pixels, of
/// which it is kWidth wide; looks as in style.css.
class TimePlot {
 public:
  static constexpr double kWidth = 960;

  /// `height`: of what is plotted, without the axis below it.
  TimePlot(double seconds, double height, const std::string& label);

  /// Values go up; logarithmic ones have to be above zero, smaller ones lie at the bottom.
  void setLinear(double low, double high, const std::string& unit);
  void setLogarithmic(double low, double high, const std::string& unit);
  /// Sets the texts at the ends of the time axis, instead of seconds along it.
  void setTimes(const std::string& first, const std::string& last);

  double x(double seconds) const;
  double y(double value) const;

  void shade(double from_s, double seconds);
  void dots(const replay::Samples& samples, const std::string& look);
  /// Draws a line with gaps between samples that are farther apart than `longest_gap_s`, and than
  /// usual.
  void line(const replay::Samples& samples, const std::string& look,
            double longest_gap_s = HUGE_VAL);
  /// Draws a tick for each moment, so far below the top.
  void ticks(const std::vector<double>& moments_s, double top, double height,
             const std::string& look);
  void bar(double from_s, double to_s, double top, double height, const std::string& look);
  /// A line from side to side, so far below the top.
  void rule(double below_top);
  /// The words' baseline lies so far below the top.
  void text(const std::string& look, double left, double below_top, const std::string& words);
  /// A dashed line at a value, with words at its end; those of several do not overlap.
  void level(double value, const std::string& look, const std::string& words);

  /// The whole plot, for drawing.html.
  PageData data() const;

 private:
  struct Level {
    double y;
    std::string look, words;
  };

  void addGrid(const std::string& words, double y);
  void addLevels(Drawing& drawing) const;
  void addTimeAxis(Drawing& drawing) const;

  double seconds_, height_;
  double low_ = 0, high_ = 1;
  bool is_logarithmic_ = false;
  std::string unit_, first_time_, last_time_;
  Drawing drawing_;
  std::vector<Level> levels_;
};

}  // namespace afterglow::nodes
