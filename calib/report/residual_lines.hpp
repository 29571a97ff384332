/// \file
/// Residuals drawn as magnified lines, over a photograph or on white.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace afterglow::calib {

enum class LineKind { kPrinted, kProjected, kOutlier };

struct ResidualLine {
  Eigen::Vector2d at, error;  ///< px of the picture drawn on
  LineKind kind = LineKind::kProjected;
  std::string remark;  ///< shown for outliers, when pointed at
};

class ResidualLines {
 public:
  /// Those that are not finite are ignored.
  void add(const ResidualLine& line);
  void add(const ResidualLines& others);
  bool empty() const { return lines_.empty(); }
  /// Whether any has a length.
  bool hasErrors() const;

  /// Makes nine of ten lines no longer than a fortieth of the picture's width: 1, 2 or 5 times a
  /// power of ten, at least 1.
  double magnification(int picture_width) const;
  /// With a dark halo, to be seen on any photograph, and, where there are errors, a bar of known
  /// length.
  std::string onPhotograph(double magnification, int width, int height) const;
  std::string onPaper(double magnification, int width) const;
  /// What the colors mean, those that occur.
  std::string legendOnPhotograph() const;
  std::string legendOnPaper() const;

 private:
  bool has(LineKind kind) const;
  std::string path(LineKind kind, double magnification, double longest) const;
  std::string dots(LineKind kind) const;
  std::string outlierRings(int width) const;
  static std::string lengthBar(double magnification, int width, int height);
  std::string legend(bool is_on_paper) const;

  std::vector<ResidualLine> lines_;
};

}  // namespace afterglow::calib
