/// \file
/// A plot over time.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "nodes/pages/drawing.hpp"
#include "replay/play/figures.hpp"

namespace afterglow::nodes {

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
