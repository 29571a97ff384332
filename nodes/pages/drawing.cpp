#include "nodes/pages/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

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

namespace {

constexpr double kLeft = 58, kRight = TimePlot::kWidth - 14, kTop = 8, kBelow = 26;
constexpr double kLetters = 12, kLabelHeight = 14;

/// 1, 2 or 5 times a power of ten: about `count` of them in the range.
double stepOf(double range, int count) { return roundDown(std::max(range, 1e-9) / count); }

std::string numberAt(double value, double step) {
  const int digits = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 6);
  return fmt::format("{:.{}f}", std::abs(value) < step / 2 ? 0.0 : value, digits);
}

/// Half a pixel is as fine as anybody sees.
double snapped(double value) { return std::round(value * 2) / 2; }

std::string across(double y) {
  return "M" + point({kLeft, y}) + "H" + coordinate(kRight);
}

bool isFinite(const replay::Sample& sample) {
  return std::isfinite(sample.played_s) && std::isfinite(sample.value);
}

}  // namespace

TimePlot::TimePlot(double seconds, double height, const std::string& label)
    : seconds_(std::isfinite(seconds) && seconds > 1e-3 ? seconds : 1),
      height_(height),
      drawing_("over-time", kWidth, std::ceil(kTop + height + kBelow), kLetters, label) {
  drawing_.box("ground", kLeft, kTop, kRight - kLeft, height_);
}

double TimePlot::x(double seconds) const {
  return kLeft + (kRight - kLeft) * std::clamp(seconds / seconds_, 0.0, 1.0);
}

double TimePlot::y(double value) const {
  const double share = is_logarithmic_
                           ? std::log10(std::max(value, low_) / low_) / std::log10(high_ / low_)
                           : (value - low_) / (high_ - low_);
  return kTop + height_ * (1 - std::clamp(share, 0.0, 1.0));
}

void TimePlot::addGrid(const std::string& words, double y) {
  drawing_.path("rule", across(y));
  drawing_.text("soft end", kLeft - 7, y + 4, words);
}

void TimePlot::setLinear(double low, double high, const std::string& unit) {
  low_ = low;
  high_ = high > low ? high : low + 1;
  is_logarithmic_ = false;
  unit_ = unit;
  const double step = stepOf(high_ - low_, 4);
  for (double value = std::ceil(low_ / step) * step; value < high_ + step / 100; value += step) {
    addGrid(numberAt(value, step), y(value));
  }
}

void TimePlot::setLogarithmic(double low, double high, const std::string& unit) {
  low_ = std::pow(10, std::floor(std::log10(low)));
  high_ = std::pow(10, std::max(std::ceil(std::log10(high)), std::floor(std::log10(low)) + 1));
  is_logarithmic_ = true;
  unit_ = unit;
  for (double value = low_; value < high_ * 1.5; value *= 10) {
    addGrid(numberAt(value, value), y(value));
  }
}

void TimePlot::setTimes(const std::string& first, const std::string& last) {
  first_time_ = first;
  last_time_ = last;
}

void TimePlot::shade(double from_s, double seconds) {
  drawing_.box("wait", x(from_s), kTop, std::max(1.0, x(from_s + seconds) - x(from_s)), height_);
}

void TimePlot::dots(const replay::Samples& samples, const std::string& look) {
  std::string d, before;
  for (const replay::Sample& sample : samples.kept()) {
    if (!isFinite(sample)) continue;
    const std::string dot = dotAt({snapped(x(sample.played_s)), snapped(y(sample.value))});
    if (dot != before) d += dot;
    before = dot;
  }
  drawing_.path("dots " + look, d);
}

void TimePlot::line(const replay::Samples& samples, const std::string& look,
                    double longest_gap_s) {
  const std::vector<replay::Sample>& kept = samples.kept();
  if (kept.empty()) return;
  const double usual =
      (kept.back().played_s - kept.front().played_s) / static_cast<double>(kept.size());
  std::string d;
  const replay::Sample* before = nullptr;
  for (const replay::Sample& sample : kept) {
    if (!isFinite(sample)) continue;
    const bool goes_on =
        before && sample.played_s - before->played_s < std::max(longest_gap_s, 4 * usual);
    d += (goes_on ? "L" : "M") + point({snapped(x(sample.played_s)), snapped(y(sample.value))});
    before = &sample;
  }
  drawing_.path("line " + look, d);
}

void TimePlot::ticks(const std::vector<double>& moments_s, double top, double height,
                     const std::string& look) {
  std::set<double> places;
  for (const double moment : moments_s) {
    if (std::isfinite(moment)) places.insert(snapped(x(moment)));
  }
  std::string d;
  for (const double place : places) {
    d += "M" + point({place, kTop + top}) + "v" + coordinate(height);
  }
  drawing_.path("tick " + look, d);
}

void TimePlot::bar(double from_s, double to_s, double top, double height,
                   const std::string& look) {
  drawing_.box("bar " + look, x(from_s), kTop + top, std::max(2.0, x(to_s) - x(from_s)), height);
}

void TimePlot::rule(double below_top) { drawing_.path("rule", across(kTop + below_top)); }

void TimePlot::text(const std::string& look, double left, double below_top,
                    const std::string& words) {
  drawing_.text(look, left, kTop + below_top, words);
}

void TimePlot::level(double value, const std::string& look, const std::string& words) {
  levels_.push_back({y(value), look, words});
}

void TimePlot::addLevels(Drawing& drawing) const {
  std::vector<Level> sorted = levels_;
  std::sort(sorted.begin(), sorted.end(), [](const Level& a, const Level& b) { return a.y < b.y; });
  for (const Level& level : sorted) drawing.path("level " + level.look, across(level.y));
  double lowest = kTop;
  for (const Level& level : sorted) {
    lowest = std::max(level.y - 4, lowest + kLabelHeight);
    drawing.text("said end " + level.look, kRight - 6, lowest, level.words);
  }
}

void TimePlot::addTimeAxis(Drawing& drawing) const {
  const double bottom = kTop + height_, baseline = bottom + 19;
  if (!first_time_.empty()) {
    drawing.text("soft", kLeft, baseline, first_time_);
    drawing.text("soft end", kRight, baseline, last_time_);
    return;
  }
  const double step = stepOf(seconds_, 6);
  for (double moment = 0; moment <= seconds_ * (1 + 1e-9); moment += step) {
    drawing.path("mark", "M" + point({x(moment), bottom}) + "v5");
    const bool is_last = moment + step > seconds_ * (1 + 1e-9);
    drawing.text("soft middle", std::min(x(moment), kWidth - 16), baseline,
                 numberAt(moment, step) + (is_last ? " s" : ""));
  }
}

PageData TimePlot::data() const {
  Drawing drawing = drawing_;
  addLevels(drawing);
  addTimeAxis(drawing);
  if (!unit_.empty()) drawing.text("soft upward", 12, kTop + height_ / 2, unit_);
  return drawing.data();
}

}  // namespace afterglow::nodes
