/// \file
/// A plot over a replay's time, drawn as SVG.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "replay/plan/topic_role.hpp"
#include "replay/play/samples.hpp"

namespace afterglow::nodes {

/// "#rrggbb", one a modality, dark enough on white.
std::string colorOf(replay::Modality modality);

/// Seconds go right from 0. What is added first lies below. Sizes in the drawing's own pixels, of
/// which it is kWidth wide.
class TimePlot {
 public:
  static constexpr double kWidth = 960;

  /// `height`: of what is plotted, without the axis below it.
  TimePlot(double seconds, double height);

  /// Values go up; logarithmic ones have to be above zero, smaller ones lie at the bottom.
  void setLinear(double low, double high, const std::string& unit);
  void setLogarithmic(double low, double high, const std::string& unit);

  double x(double seconds) const;
  double y(double value) const;

  void shade(double from_s, double seconds);
  void dots(const replay::Samples& samples, const std::string& color);
  /// With gaps where there are long ones between samples.
  void line(const replay::Samples& samples, const std::string& color);
  /// One for each moment, so far below the top.
  void ticks(const std::vector<double>& moments_s, double top, double height,
             const std::string& color);
  void bar(double from_s, double to_s, double top, double height, const std::string& color);
  /// A line from side to side, so far below the top.
  void rule(double below_top);
  /// The words' baseline lies so far below the top.
  void text(double left, double below_top, const std::string& words, const std::string& attributes);
  /// A dashed line at a value, with words at its end; those of several do not overlap.
  void level(double value, const std::string& color, const std::string& words);

  /// A part of a page, which a narrow screen scrolls. The label is read out to who cannot see it.
  std::string figure(const std::string& label) const;

 private:
  struct Level {
    double y;
    std::string color, words;
  };

  void addGrid(const std::string& words, double y);
  std::string timeAxis() const;
  std::string levels() const;
  std::vector<std::pair<double, double>> points(const replay::Samples& samples) const;

  double seconds_, height_;
  double low_ = 0, high_ = 1;
  bool is_logarithmic_ = false;
  std::string unit_, content_;
  std::vector<Level> levels_;
};

}  // namespace afterglow::nodes
