#include "nodes/player/time_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "calib/report/html.hpp"

namespace afterglow::nodes {
namespace {

using calib::coordinate;
using calib::element;
using calib::escaped;

constexpr double kLeft = 58, kRight = 14, kTop = 8, kBelow = 34;
constexpr double kLabelHeight = 14;
/// Where nothing was measured for so long there is no line: s.
constexpr double kLineGap = 1;
constexpr const char* kSoft = "#59636e";
constexpr const char* kRule = "#e3e7eb";

std::string attribute(const std::string& attribute_name, double value) {
  return " " + attribute_name + "=\"" + coordinate(value) + "\"";
}

std::string lineElement(double x1, double y1, double x2, double y2, const std::string& style) {
  return element("line",
                 "style=\"" + style + "\"" + attribute("x1", x1) + attribute("y1", y1) +
                     attribute("x2", x2) + attribute("y2", y2),
                 "");
}

std::string pathElement(const std::string& data, const std::string& color, double width) {
  return element(
      "path",
      "d=\"" + data + "\" style=\"stroke:" + color + ";stroke-width:" + coordinate(width) + "\"",
      "");
}

/// 1, 2 or 5 times a power of ten: about `count` of them in the range.
double stepOf(double range, int count) { return calib::roundDown(std::max(range, 1e-9) / count); }

std::string numberText(double value, double step) {
  const int digits = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 6);
  return fmt::format("{:.{}f}", std::abs(value) < step / 2 ? 0.0 : value, digits);
}

/// Half a pixel is as fine as anybody sees.
double snapped(double value) { return std::round(value * 2) / 2; }

}  // namespace

std::string colorOf(replay::Modality modality) {
  switch (modality) {
    case replay::Modality::Body:
      return "#0b5fa5";
    case replay::Modality::Ar:
      return "#b45309";
    case replay::Modality::Speech:
      return "#7c3aed";
  }
  return kSoft;
}

TimePlot::TimePlot(double seconds, double height)
    : seconds_(std::isfinite(seconds) && seconds > 1e-3 ? seconds : 1), height_(height) {
  content_ +=
      element("rect",
              "style=\"fill:#fff;stroke:" + std::string(kRule) + "\"" + attribute("x", kLeft) +
                  attribute("y", kTop) + attribute("width", kWidth - kLeft - kRight) +
                  attribute("height", height_),
              "");
}

double TimePlot::x(double seconds) const {
  return kLeft + (kWidth - kLeft - kRight) * std::clamp(seconds / seconds_, 0.0, 1.0);
}

double TimePlot::y(double value) const {
  const double share = is_logarithmic_
                           ? std::log10(std::max(value, low_) / low_) / std::log10(high_ / low_)
                           : (value - low_) / (high_ - low_);
  return kTop + height_ * (1 - std::clamp(share, 0.0, 1.0));
}

void TimePlot::addGrid(const std::string& words, double y) {
  content_ += lineElement(kLeft, y, kWidth - kRight, y, "stroke:" + std::string(kRule));
  text(kLeft - 7, y - kTop + 4, words, "text-anchor=\"end\"");
}

void TimePlot::setLinear(double low, double high, const std::string& unit) {
  low_ = low;
  high_ = high > low ? high : low + 1;
  is_logarithmic_ = false;
  unit_ = unit;
  const double step = stepOf(high_ - low_, 4);
  for (double value = std::ceil(low_ / step) * step; value < high_ + step / 100; value += step) {
    addGrid(numberText(value, step), y(value));
  }
}

void TimePlot::setLogarithmic(double low, double high, const std::string& unit) {
  low_ = std::pow(10, std::floor(std::log10(low)));
  high_ = std::pow(10, std::max(std::ceil(std::log10(high)), std::floor(std::log10(low)) + 1));
  is_logarithmic_ = true;
  unit_ = unit;
  for (double value = low_; value < high_ * 1.5; value *= 10) {
    addGrid(numberText(value, value), y(value));
  }
}

void TimePlot::shade(double from_s, double seconds) {
  content_ += element("rect",
                      "style=\"fill:#fdecc8\"" + attribute("x", x(from_s)) + attribute("y", kTop) +
                          attribute("width", std::max(1.0, x(from_s + seconds) - x(from_s))) +
                          attribute("height", height_),
                      "");
}

std::vector<std::pair<double, double>> TimePlot::points(const replay::Samples& samples) const {
  std::vector<std::pair<double, double>> found;
  for (const replay::Sample& sample : samples.kept()) {
    if (std::isfinite(sample.played_s) && std::isfinite(sample.value)) {
      found.emplace_back(snapped(x(sample.played_s)), snapped(y(sample.value)));
    }
  }
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void TimePlot::dots(const replay::Samples& samples, const std::string& color) {
  std::string data;
  for (const auto& [right, down] : points(samples)) {
    data += "M" + coordinate(right) + " " + coordinate(down) + "h0";
  }
  if (!data.empty()) content_ += pathElement(data, color, 3);
}

void TimePlot::line(const replay::Samples& samples, const std::string& color) {
  const std::vector<replay::Sample>& kept = samples.kept();
  if (kept.empty()) return;
  const double usual =
      (kept.back().played_s - kept.front().played_s) / static_cast<double>(kept.size());
  std::string data;
  const replay::Sample* before = nullptr;
  for (const replay::Sample& sample : kept) {
    if (!std::isfinite(sample.played_s) || !std::isfinite(sample.value)) continue;
    const bool goes_on =
        before && sample.played_s - before->played_s < std::max(kLineGap, 4 * usual);
    data += (goes_on ? "L" : "M") + coordinate(snapped(x(sample.played_s))) + " " +
            coordinate(snapped(y(sample.value)));
    before = &sample;
  }
  content_ += pathElement(data, color, 1.5);
}

void TimePlot::ticks(const std::vector<double>& moments_s, double top, double height,
                     const std::string& color) {
  std::set<double> places;
  for (const double moment : moments_s) {
    if (std::isfinite(moment)) places.insert(snapped(x(moment)));
  }
  std::string data;
  for (const double place : places) {
    data += "M" + coordinate(place) + " " + coordinate(kTop + top) + "v" + coordinate(height);
  }
  if (!data.empty()) content_ += pathElement(data, color, 1);
}

void TimePlot::bar(double from_s, double to_s, double top, double height,
                   const std::string& color) {
  content_ += element("rect",
                      "style=\"fill:" + color + "\" rx=\"1.5\"" + attribute("x", x(from_s)) +
                          attribute("y", kTop + top) +
                          attribute("width", std::max(2.0, x(to_s) - x(from_s))) +
                          attribute("height", height),
                      "");
}

void TimePlot::rule(double below_top) {
  content_ += lineElement(kLeft, kTop + below_top, kWidth - kRight, kTop + below_top,
                          "stroke:" + std::string(kRule));
}

void TimePlot::text(double left, double below_top, const std::string& words,
                    const std::string& attributes) {
  content_ +=
      element("text",
              "font-size=\"12\" fill=\"" + std::string(kSoft) + "\"" + attribute("x", left) +
                  attribute("y", kTop + below_top) + (attributes.empty() ? "" : " " + attributes),
              escaped(words));
}

void TimePlot::level(double value, const std::string& color, const std::string& words) {
  levels_.push_back({y(value), color, words});
}

std::string TimePlot::levels() const {
  std::vector<Level> sorted = levels_;
  std::sort(sorted.begin(), sorted.end(), [](const Level& a, const Level& b) { return a.y < b.y; });
  std::string lines, labels;
  double lowest = kTop;
  for (const Level& level : sorted) {
    lines += lineElement(kLeft, level.y, kWidth - kRight, level.y,
                         "stroke-dasharray:5 4;stroke:" + level.color);
    const double baseline = std::max(level.y - 4, lowest + kLabelHeight);
    labels += element("text",
                      "font-size=\"12\" text-anchor=\"end\" style=\"paint-order:stroke;stroke:#fff;"
                      "stroke-width:4px;fill:" +
                          level.color + "\"" + attribute("x", kWidth - kRight - 6) +
                          attribute("y", baseline),
                      escaped(level.words));
    lowest = baseline;
  }
  return lines + labels;
}

std::string TimePlot::timeAxis() const {
  std::string content;
  const double step = stepOf(seconds_, 6), bottom = kTop + height_;
  for (double moment = 0; moment <= seconds_ * (1 + 1e-9); moment += step) {
    content +=
        lineElement(x(moment), bottom, x(moment), bottom + 5, "stroke:" + std::string(kSoft));
    const bool is_last = moment + step > seconds_ * (1 + 1e-9);
    content +=
        element("text",
                "font-size=\"12\" text-anchor=\"middle\" fill=\"" + std::string(kSoft) + "\"" +
                    attribute("x", std::min(x(moment), kWidth - 16)) + attribute("y", bottom + 19),
                numberText(moment, step) + (is_last ? " s" : ""));
  }
  return content;
}

std::string TimePlot::figure(const std::string& label) const {
  const double height = kTop + height_ + kBelow - 8;
  std::string unit;
  if (!unit_.empty()) {
    const double middle = kTop + height_ / 2;
    unit = element("text",
                   "font-size=\"12\" text-anchor=\"middle\" fill=\"" + std::string(kSoft) +
                       "\" transform=\"rotate(-90 12 " + coordinate(middle) + ")\" x=\"12\"" +
                       attribute("y", middle + 4),
                   escaped(unit_));
  }
  const std::string picture =
      calib::drawing(static_cast<int>(kWidth), static_cast<int>(std::ceil(height)), label,
                     content_ + levels() + timeAxis() + unit);
  return element("div", "style=\"overflow-x:auto\"",
                 element("div", "style=\"min-width:720px\"", picture));
}

}  // namespace afterglow::nodes
